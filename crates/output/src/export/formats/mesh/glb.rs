//! A GLB being written: its JSON, and the numbers and pictures that the JSON refers to.

use gltf_json::accessor::{Accessor, ComponentType, GenericComponentType, Type};
use gltf_json::buffer::{Buffer, Stride, Target, View};
use gltf_json::extensions;
use gltf_json::image::{Image, MimeType};
use gltf_json::material::Material;
use gltf_json::mesh::{Mesh, Mode, Primitive};
use gltf_json::texture::{MagFilter, MinFilter, Sampler, Texture, WrappingMode};
use gltf_json::validation::Checked::Valid;
use gltf_json::validation::USize64;
use gltf_json::{Index, Root};
use serde_json::{Map, Value, json};

use super::values::{MeshData, Values};

/// Names of extensions.
pub(super) const QUANTIZATION: &str = "KHR_mesh_quantization";
pub(super) const COMPRESSION: &str = "EXT_meshopt_compression";
pub(super) const TRANSFORM: &str = "KHR_texture_transform";

/// Largest number of bytes of a GLB, which counts them in 32 bits.
pub(super) const MAX_BYTES: u64 = u32::MAX as u64;

/// A GLB being written.
pub(super) struct Glb {
    pub root: Root,
    bytes: Vec<u8>,
    /// Bytes that the numbers would have without compression; `None` if they are not compressed.
    plain_bytes: Option<usize>,
}

/// The kind of numbers in a part of the buffer.
enum BufferContent {
    Vertices,
    Indices,
}

impl Glb {
    /// Begins an empty GLB.
    pub fn new(compressed: bool) -> Glb {
        let mut root = Root::default();
        root.asset.generator = Some(crate::generator::NAME.to_owned());
        root.samplers.push(Sampler {
            mag_filter: Some(Valid(MagFilter::Linear)),
            min_filter: Some(Valid(MinFilter::LinearMipmapLinear)),
            // Neighbouring tiles agree on the texels of their shared edge. A repeated texture would mix in texels of
            // the far side.
            wrap_s: Valid(WrappingMode::ClampToEdge),
            wrap_t: Valid(WrappingMode::ClampToEdge),
            ..Default::default()
        });
        Glb { root, bytes: Vec::new(), plain_bytes: compressed.then_some(0) }
    }

    /// Declares an extension that readers need, if `required`, or else may use.
    pub fn uses(&mut self, extension: &str, required: bool) {
        // An extension that readers need must be in both lists.
        let mut lists = vec![&mut self.root.extensions_used];
        if required {
            lists.push(&mut self.root.extensions_required);
        }
        for list in lists {
            if !list.iter().any(|name| name == extension) {
                list.push(extension.to_owned());
            }
        }
    }

    /// Adds a mesh. A visible mesh has a material.
    pub fn mesh(&mut self, name: &str, geometry: MeshData, material: Option<Index<Material>>) -> Index<Mesh> {
        let vertices = geometry.attributes[0].1.count;
        let attributes =
            geometry.attributes.into_iter().map(|(semantic, values)| (Valid(semantic), self.attribute(values)));
        let attributes = attributes.collect();
        let indices = self.indices(&geometry.indices, vertices);
        let primitive = Primitive {
            attributes,
            extensions: None,
            extras: None,
            indices: Some(indices),
            material,
            mode: Valid(Mode::Triangles),
            targets: None,
        };
        self.root.push(Mesh {
            extensions: None,
            extras: None,
            name: Some(name.to_owned()),
            primitives: vec![primitive],
            weights: None,
        })
    }

    /// Adds a texture that shows a PNG.
    pub fn texture(&mut self, name: &str, png: &[u8]) -> Index<Texture> {
        let source = self.image(name, png);
        self.root.push(Texture { name: None, sampler: Some(Index::new(0)), source, extensions: None, extras: None })
    }

    /// Adds a PNG that no texture shows.
    pub fn image(&mut self, name: &str, png: &[u8]) -> Index<Image> {
        let view = self.view(png, None);
        self.root.push(Image {
            buffer_view: Some(view),
            mime_type: Some(MimeType("image/png".to_owned())),
            name: Some(name.to_owned()),
            uri: None,
            extensions: None,
            extras: None,
        })
    }

    fn attribute(&mut self, values: Values) -> Index<Accessor> {
        let stride = values.stride();
        let view = self.numbers(&values.bytes, BufferContent::Vertices, stride);
        let (min, max) = values.bounds.map(|[min, max]| (Value::from(min), Value::from(max))).unzip();
        let accessor = accessor(view, values.component, values.dimensions, values.count);
        self.root.push(Accessor { min, max, normalized: values.normalized, ..accessor })
    }

    /// Adds the indices of triangles, in 16 bits if that is enough.
    fn indices(&mut self, indices: &[u32], vertices: usize) -> Index<Accessor> {
        // The index 65535 must not occur, since it restarts a strip.
        let short = u16::try_from(vertices).is_ok();
        let (component, bytes) = if short {
            let shorts: Vec<_> = indices.iter().map(|index| (*index as u16).to_le_bytes()).collect();
            (ComponentType::U16, shorts.into_flattened())
        } else {
            let longs: Vec<_> = indices.iter().map(|index| index.to_le_bytes()).collect();
            (ComponentType::U32, longs.into_flattened())
        };
        let view = self.numbers(&bytes, BufferContent::Indices, if short { 2 } else { 4 });
        self.root.push(accessor(view, component, Type::Scalar, indices.len()))
    }

    /// Adds numbers to the buffer, compressed if this GLB is.
    fn numbers(&mut self, bytes: &[u8], content: BufferContent, stride: usize) -> Index<View> {
        let (target, byte_stride) = match content {
            BufferContent::Vertices => (Target::ArrayBuffer, Some(Stride(stride))),
            BufferContent::Indices => (Target::ElementArrayBuffer, None),
        };
        let view = match self.plain_bytes {
            None => self.view(bytes, Some(target)),
            Some(before) => {
                let count = bytes.len() / stride;
                let (mode, coded) = match content {
                    BufferContent::Vertices => ("ATTRIBUTES", compressed_vertices(bytes, stride)),
                    BufferContent::Indices => ("TRIANGLES", compressed_indices(bytes, stride)),
                };
                let offset = self.append(&coded);
                // The offset in a buffer of uncompressed numbers, which is described but not written.
                self.plain_bytes = Some(before + bytes.len().next_multiple_of(4));
                let extension = json!({
                    "buffer": 0, "byteOffset": offset, "byteLength": coded.len(), "byteStride": stride, "count": count,
                    "mode": mode,
                });
                let others = Map::from_iter([(COMPRESSION.to_owned(), extension)]);
                self.root.push(View {
                    // Buffer 1 has no data: a reader that does not know the compression finds nothing to read.
                    buffer: Index::new(1),
                    byte_length: bytes.len().into(),
                    byte_offset: Some(before.into()),
                    byte_stride: None,
                    name: None,
                    target: Some(Valid(target)),
                    extensions: Some(extensions::buffer::View { others }),
                    extras: None,
                })
            }
        };
        self.root.buffer_views[view.value()].byte_stride = byte_stride;
        view
    }

    fn view(&mut self, bytes: &[u8], target: Option<Target>) -> Index<View> {
        let offset = self.append(bytes);
        self.root.push(View {
            buffer: Index::new(0),
            byte_length: bytes.len().into(),
            byte_offset: Some(offset.into()),
            byte_stride: None,
            name: None,
            target: target.map(Valid),
            extensions: None,
            extras: None,
        })
    }

    /// Appends bytes to the buffer and returns their offset.
    fn append(&mut self, bytes: &[u8]) -> usize {
        let offset = self.bytes.len();
        self.bytes.extend(bytes);
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        offset
    }

    /// Returns the finished file.
    ///
    /// # Panics
    /// When there are more bytes than a GLB can hold.
    pub fn finish(mut self) -> GlbFile {
        self.root.buffers.push(buffer(self.bytes.len()));
        self.root.buffers.extend(self.plain_bytes.map(fallback));
        let mut json = self.root.to_vec().expect("names and finite numbers are JSON");
        // GLB pads chunks to multiples of 4 bytes: JSON with spaces, numbers with zeros.
        json.resize(json.len().next_multiple_of(4), b' ');
        let total = GlbFile::numbers_at(json.len()) + self.bytes.len();
        let word = |count: usize| u32::try_from(count).expect("the plan has checked the size").to_le_bytes();
        let mut bytes = Vec::with_capacity(total);
        bytes.extend([*b"glTF", word(2), word(total), word(json.len()), *b"JSON"].as_flattened());
        bytes.extend(&json);
        bytes.extend([word(self.bytes.len()), *b"BIN\0"].as_flattened());
        bytes.extend(&self.bytes);
        GlbFile { bytes, json_bytes: json.len() }
    }
}

/// A finished file.
pub(super) struct GlbFile {
    pub bytes: Vec<u8>,
    json_bytes: usize,
}

impl GlbFile {
    /// Number of bytes of the file's header, three words, and of the header of each chunk.
    const HEADER: usize = 12;
    const CHUNK_HEADER: usize = 8;

    /// Returns the offset of the buffer in a file whose JSON has `json_bytes` bytes.
    pub fn numbers_at(json_bytes: usize) -> usize {
        GlbFile::HEADER + 2 * GlbFile::CHUNK_HEADER + json_bytes
    }

    /// Returns the JSON, with the spaces that pad it.
    pub fn json(&self) -> &[u8] {
        &self.bytes[GlbFile::HEADER + GlbFile::CHUNK_HEADER..][..self.json_bytes]
    }

    /// Returns the buffer.
    pub fn numbers(&self) -> &[u8] {
        &self.bytes[GlbFile::numbers_at(self.json_bytes)..]
    }
}

fn accessor(view: Index<View>, component: ComponentType, dimensions: Type, count: usize) -> Accessor {
    Accessor {
        buffer_view: Some(view),
        byte_offset: None,
        count: count.into(),
        component_type: Valid(GenericComponentType(component)),
        extensions: None,
        extras: None,
        type_: Valid(dimensions),
        min: None,
        max: None,
        name: None,
        normalized: false,
        sparse: None,
    }
}

/// Describes the buffer of a file's own numbers.
pub(super) fn buffer(bytes: usize) -> Buffer {
    Buffer { byte_length: USize64::from(bytes), name: None, uri: None, extensions: None, extras: None }
}

/// Describes the buffer that the numbers would be in without compression. It is not written.
pub(super) fn fallback(bytes: usize) -> Buffer {
    let others = Map::from_iter([(COMPRESSION.to_owned(), json!({ "fallback": true }))]);
    Buffer { extensions: Some(extensions::buffer::Buffer { others }), ..buffer(bytes) }
}

/// Compresses vertices for EXT_meshopt_compression. The codec takes vertices as a type of their size.
fn compressed_vertices(bytes: &[u8], stride: usize) -> Vec<u8> {
    /// The version of the format that the extension names.
    const VERSION: Option<i32> = Some(0);
    // The library's own default; this version of the format has no other levels.
    const LEVEL: i32 = 2;
    fn of<const N: usize>(bytes: &[u8]) -> Vec<u8> {
        let vertices = bytes.as_chunks::<N>().0;
        meshopt::encode_vertex_buffer_level(vertices, LEVEL, VERSION)
            .expect("the buffer is as large as it may need to be")
    }
    match stride {
        4 => of::<4>(bytes),
        8 => of::<8>(bytes),
        12 => of::<12>(bytes),
        16 => of::<16>(bytes),
        _ => unreachable!("no attribute has {stride} bytes"),
    }
}

/// Compresses triangles for EXT_meshopt_compression.
fn compressed_indices(bytes: &[u8], size: usize) -> Vec<u8> {
    let index = |bytes: &[u8]| bytes.iter().rev().fold(0, |index, byte| index << 8 | u32::from(*byte));
    let indices: Vec<u32> = bytes.chunks_exact(size).map(index).collect();
    // The codec needs a bound for the indices, which need not be the number of vertices.
    let vertices = indices.iter().max().map_or(0, |most| *most as usize + 1);
    meshopt::encode_index_buffer(&indices, vertices).expect("the buffer is as large as it may need to be")
}
