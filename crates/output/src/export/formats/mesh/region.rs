//! The glTF of a region: all its tiles in one scene. Numbers and pictures stay in the tiles' GLBs, or are in this file
//! too.

use std::fs::File;
use std::io::{BufWriter, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use gltf_json::{Buffer, Index, Material, Root};
use serde::Serialize;
use serde_json::Value;

use super::glb::{COMPRESSION, MAX_BYTES};
use super::gltf::SMALLER;
use super::model::SUBSTANCES;
use crate::bake::FileRecord;
use crate::clock::Clock;
use crate::error::Error;
use crate::export::formats::format::file_name;
use crate::file::{Operation, PartFile, gate};
use crate::generator;

/// A region's glTF being written. Each list waits in a file of its own until all tiles are there, so that none is held
/// in memory.
pub(super) struct RegionFile {
    path: String,
    export: &'static str,
    out: PathBuf,
    scene: Spool,
    nodes: Spool,
    meshes: Spool,
    accessors: Spool,
    views: Spool,
    buffers: Spool,
    images: Spool,
    textures: Spool,
    samplers: Spool,
    materials: Spool,
    /// The indices of the materials that tiles share.
    shared: [Option<u32>; SUBSTANCES.len()],
    /// Extensions that readers may use, and those that they need.
    extensions: (Vec<String>, Vec<String>),
    /// Numbers and pictures, if they belong into this file.
    numbers: Option<BufferFile>,
}

/// The numbers and pictures of all tiles, one after the other.
struct BufferFile {
    file: BufWriter<File>,
    bytes: u64,
    /// Bytes that compressed numbers would have without compression.
    plain_bytes: u64,
}

/// The place of a tile's numbers and pictures.
pub(super) enum TileNumbers<'a> {
    /// In the tile's GLB: its path in the folder of the bake, and the offset of its buffer.
    In(&'a str, usize),
    /// In memory.
    Here(&'a [u8]),
}

/// A list of JSON values that waits in a file.
struct Spool {
    /// Name of the list in the glTF.
    name: &'static str,
    file: BufWriter<File>,
    count: u32,
}

impl Spool {
    fn create(name: &'static str, folder: &Path) -> Result<Spool, Error> {
        Ok(Spool { name, file: BufWriter::new(nameless(folder)?), count: 0 })
    }

    fn push(&mut self, value: &impl Serialize) -> std::io::Result<()> {
        if self.count > 0 {
            self.file.write_all(b",\n")?;
        }
        self.count += 1;
        serde_json::to_writer(&mut self.file, value).map_err(std::io::Error::from)
    }

    /// Copies the list into a file.
    fn copy_to(self, target: &mut impl Write, clock: &Clock) -> std::io::Result<()> {
        if self.count == 0 {
            return Ok(());
        }
        write!(target, ",\n\"{}\":[", self.name)?;
        copied(&mut rewound(self.file)?, target, clock)?;
        target.write_all(b"]")
    }
}

impl RegionFile {
    /// Begins the file of a level of detail. A `whole` file has numbers and pictures in it.
    pub fn create(lod: u32, export: &'static str, whole: bool, out: &Path) -> Result<RegionFile, Error> {
        let path = super::region_path(lod, if whole { "glb" } else { "gltf" });
        let folder = out.join(super::FOLDER);
        let spool = |name| Spool::create(name, &folder);
        let numbers = || -> Result<BufferFile, Error> {
            Ok(BufferFile { file: BufWriter::new(nameless(&folder)?), bytes: 0, plain_bytes: 0 })
        };
        Ok(RegionFile {
            path,
            export,
            out: out.to_owned(),
            scene: spool("nodes")?,
            nodes: spool("nodes")?,
            meshes: spool("meshes")?,
            accessors: spool("accessors")?,
            views: spool("bufferViews")?,
            buffers: spool("buffers")?,
            images: spool("images")?,
            textures: spool("textures")?,
            samplers: spool("samplers")?,
            materials: spool("materials")?,
            shared: [None; SUBSTANCES.len()],
            extensions: Default::default(),
            numbers: whole.then(numbers).transpose()?,
        })
    }

    /// Adds a tile.
    pub fn add(&mut self, root: Root, numbers: TileNumbers) -> Result<(), Error> {
        let path = self.out.join(&self.path);
        self.add_shifted(root, numbers).map_err(Error::io(&path))?;
        match &self.numbers {
            Some(numbers) if numbers.bytes > MAX_BYTES => Err(Error::Export {
                message: format!("{}: has more bytes than the 2^32 at which GLB ends", path.display()),
                hint: SMALLER.into(),
            }),
            _ => Ok(()),
        }
    }

    fn add_shifted(&mut self, root: Root, numbers: TileNumbers) -> std::io::Result<()> {
        // Lengths of the lists before this tile, by which the tile's indices are raised.
        let (nodes, meshes, accessors) = (self.nodes.count, self.meshes.count, self.accessors.count);
        let (views, images, textures) = (self.views.count, self.images.count, self.textures.count);
        let (buffers, start, plain_start) = self.add_buffers(root.buffers, numbers)?;
        for mut view in root.buffer_views {
            let begin = if view.buffer.value() == 0 { start } else { plain_start };
            view.byte_offset = Some((view.byte_offset.map_or(0, |offset| offset.0) + begin).into());
            shift(&mut view.buffer, buffers);
            // The extension says where compressed numbers lie; the view itself describes a buffer that is not written.
            if let Some(coded) = view.extensions.as_mut().and_then(|extensions| extensions.others.get_mut(COMPRESSION))
            {
                raise(&mut coded["buffer"], u64::from(buffers));
                raise(&mut coded["byteOffset"], start);
            }
            self.views.push(&view)?;
        }
        for mut accessor in root.accessors {
            accessor.buffer_view.iter_mut().for_each(|view| shift(view, views));
            self.accessors.push(&accessor)?;
        }
        for mut image in root.images {
            image.buffer_view.iter_mut().for_each(|view| shift(view, views));
            self.images.push(&image)?;
        }
        // All tiles have the same sampler.
        if self.samplers.count == 0 {
            root.samplers.iter().try_for_each(|sampler| self.samplers.push(sampler))?;
        }
        for mut texture in root.textures {
            shift(&mut texture.source, images);
            self.textures.push(&texture)?;
        }
        let materials = self.add_materials(root.materials, textures)?;
        for mut mesh in root.meshes {
            for primitive in &mut mesh.primitives {
                primitive.attributes.values_mut().for_each(|accessor| shift(accessor, accessors));
                primitive.indices.iter_mut().for_each(|indices| shift(indices, accessors));
                primitive.material.iter_mut().for_each(|material| *material = materials[material.value()]);
            }
            self.meshes.push(&mesh)?;
        }
        for mut node in root.nodes {
            node.mesh.iter_mut().for_each(|mesh| shift(mesh, meshes));
            node.children.iter_mut().flatten().for_each(|child| shift(child, nodes));
            self.nodes.push(&node)?;
        }
        for mut node in root.scenes.into_iter().flat_map(|scene| scene.nodes) {
            shift(&mut node, nodes);
            self.scene.push(&node)?;
        }
        // All tiles of a bake have the same extensions.
        self.extensions = (root.extensions_used, root.extensions_required);
        Ok(())
    }

    /// Adds the buffers of a tile. Returns the number of buffers before them, the offset of the tile's numbers in their
    /// buffer, and that of its uncompressed numbers in theirs, which is described but not written.
    fn add_buffers(&mut self, buffers: Vec<Buffer>, numbers: TileNumbers) -> std::io::Result<(u32, u64, u64)> {
        match (numbers, &mut self.numbers) {
            (TileNumbers::Here(bytes), Some(all)) => {
                let before = (0, all.bytes, all.plain_bytes);
                all.file.write_all(bytes)?;
                all.bytes += bytes.len() as u64;
                all.plain_bytes += buffers.get(1).map_or(0, |plain| plain.byte_length.0);
                Ok(before)
            }
            (TileNumbers::In(path, start), _) => {
                let before = self.buffers.count;
                // The buffer is the whole GLB file, which is read as plain bytes.
                for (index, mut buffer) in buffers.into_iter().enumerate() {
                    if index == 0 {
                        buffer.uri = Some(file_name(path).to_owned());
                        buffer.byte_length = (buffer.byte_length.0 + start as u64).into();
                    }
                    self.buffers.push(&buffer)?;
                }
                Ok((before, start as u64, 0))
            }
            (TileNumbers::Here(_), None) => unreachable!("only a whole file is given numbers"),
        }
    }

    /// Adds the materials of a tile, before whose textures there are others. Returns their indices. Each tile has its
    /// own material for the land; those of water and roads are the same in all tiles.
    fn add_materials(&mut self, materials: Vec<Material>, textures: u32) -> std::io::Result<Vec<Index<Material>>> {
        let mut indices = Vec::with_capacity(materials.len());
        for mut material in materials {
            // Match by name, since a tile has only the materials that it shows.
            let substance = SUBSTANCES.iter().position(|substance| material.name.as_deref() == Some(substance.name));
            let known = substance.and_then(|substance| self.shared[substance]);
            indices.push(Index::new(known.unwrap_or(self.materials.count)));
            if known.is_some() {
                continue;
            }
            if let Some(substance) = substance {
                self.shared[substance] = Some(self.materials.count);
            }
            if let Some(colour) = &mut material.pbr_metallic_roughness.base_color_texture {
                shift(&mut colour.index, textures);
            }
            if let Some(normal) = &mut material.normal_texture {
                shift(&mut normal.index, textures);
            }
            self.materials.push(&material)?;
        }
        Ok(indices)
    }

    /// Joins the lists to one file, with the numbers after them.
    pub fn finish(mut self, clock: &Clock) -> Result<FileRecord, Error> {
        let path = self.out.join(&self.path);
        let (record, export) = (self.path.clone(), self.export);
        let mut file = PartFile::create(path.clone())?;
        let written = match self.numbers.take() {
            None => self.write(&mut file, clock),
            Some(numbers) => {
                let text = nameless(&self.out.join(super::FOLDER))?;
                self.write_whole(numbers, text, &mut file, clock)
            }
        };
        written.map_err(Error::io(path))?;
        Ok(FileRecord::new(record, export, file.finish()?))
    }

    fn write_whole(
        mut self,
        numbers: BufferFile,
        text: File,
        file: &mut PartFile,
        clock: &Clock,
    ) -> std::io::Result<()> {
        self.buffers.push(&super::glb::buffer(numbers.bytes as usize))?;
        if numbers.plain_bytes > 0 {
            self.buffers.push(&super::glb::fallback(numbers.plain_bytes as usize))?;
        }
        // The length of the text stands before it, so write the text into a file of its own first.
        let mut text = BufWriter::new(text);
        self.write(&mut text, clock)?;
        let (mut text, mut bytes) = (rewound(text)?, rewound(numbers.file)?);
        let (text_bytes, binary_bytes) = (text.metadata()?.len(), numbers.bytes);
        // Chunks of a GLB are padded to 4 bytes. The numbers already are.
        let padded = text_bytes.next_multiple_of(4);
        // A file that is too long has been refused by `add`, unless only the last kilobytes make it so.
        let word = |count: u64| u32::try_from(count).map(u32::to_le_bytes).map_err(std::io::Error::other);
        let total = 12 + 8 + padded + 8 + binary_bytes;
        file.write_all([*b"glTF", word(2)?, word(total)?, word(padded)?, *b"JSON"].as_flattened())?;
        copied(&mut text, file, clock)?;
        file.write_all(&b"   "[..(padded - text_bytes) as usize])?;
        file.write_all([word(binary_bytes)?, *b"BIN\0"].as_flattened())?;
        copied(&mut bytes, file, clock)
    }

    fn write(self, file: &mut impl Write, clock: &Clock) -> std::io::Result<()> {
        // Copy list by list from their files: together they may be larger than memory.
        let generator = generator::NAME;
        write!(
            file,
            "{{\"asset\":{{\"version\":\"2.0\",\"generator\":\"{generator}\"}},\n\"scene\":0,\n\"scenes\":[{{\"name\":\"region\""
        )?;
        self.scene.copy_to(file, clock)?;
        file.write_all(b"}]")?;
        for (name, list) in [("extensionsUsed", self.extensions.0), ("extensionsRequired", self.extensions.1)] {
            if !list.is_empty() {
                write!(file, ",\n\"{name}\":{}", serde_json::to_string(&list)?)?;
            }
        }
        let lists = [self.nodes, self.meshes, self.materials, self.textures, self.samplers, self.images];
        for list in lists.into_iter().chain([self.accessors, self.views, self.buffers]) {
            list.copy_to(file, clock)?;
        }
        file.write_all(b"}\n")
    }
}

/// Creates a file without a name, which is gone with the program, however the program ends.
fn nameless(folder: &Path) -> Result<File, Error> {
    gate(Operation::Create, folder)?;
    tempfile::tempfile_in(folder).map_err(Error::io(folder))
}

/// Returns a file that was written, set back to its start.
fn rewound(file: BufWriter<File>) -> std::io::Result<File> {
    let mut file = file.into_inner().map_err(std::io::IntoInnerError::into_error)?;
    file.seek(SeekFrom::Start(0))?;
    Ok(file)
}

/// Copies a file in pieces, so that a long copy can be stopped.
fn copied(from: &mut File, target: &mut impl Write, clock: &Clock) -> std::io::Result<()> {
    const AT_ONCE: u64 = 1 << 24;
    while std::io::copy(&mut Read::by_ref(from).take(AT_ONCE), target)? > 0 {
        clock.check()?;
    }
    Ok(())
}

fn shift<T>(index: &mut Index<T>, by: u32) {
    *index = Index::new(index.value() as u32 + by);
}

fn raise(number: &mut Value, by: u64) {
    *number = Value::from(number.as_u64().expect("an offset is a whole number") + by);
}
