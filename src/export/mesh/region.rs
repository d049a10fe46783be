//! The glTF of a region: all its tiles in one scene, whose numbers and pictures stay in the tiles' GLBs.

use std::fs::File;
use std::io::{BufWriter, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use gltf_json::{Index, Root};
use serde::Serialize;
use serde_json::Value;

use super::glb::COMPRESSION;
use super::model::SUBSTANCES;
use crate::bake::FileRecord;
use crate::error::Error;
use crate::export::format::{Format, file_name};
use crate::file::{Operation, PartFile, gate};
use crate::generator;

/// A region's glTF under way: each of its lists in a file of its own until all tiles are there, so that none is held.
pub(super) struct RegionFile {
    path: String,
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
    /// The numbers of the materials that tiles share.
    shared: [Option<u32>; SUBSTANCES.len()],
    /// Extensions that readers may use, and those that they need.
    extensions: (Vec<String>, Vec<String>),
}

/// A list of JSON values that is written somewhere.
struct Spool {
    /// Its name in the glTF.
    name: &'static str,
    file: BufWriter<File>,
    count: u32,
}

impl Spool {
    fn create(name: &'static str, folder: &Path) -> Result<Spool, Error> {
        // Nameless, so it is gone with the program, however that ends.
        gate(Operation::Create, folder)?;
        let file = tempfile::tempfile_in(folder).map_err(Error::io(folder))?;
        Ok(Spool { name, file: BufWriter::new(file), count: 0 })
    }

    fn push(&mut self, value: &impl Serialize) -> std::io::Result<()> {
        if self.count > 0 {
            self.file.write_all(b",\n")?;
        }
        self.count += 1;
        serde_json::to_writer(&mut self.file, value).map_err(std::io::Error::from)
    }

    /// Copies the list into a file.
    fn copy_to(self, target: &mut impl Write) -> std::io::Result<()> {
        if self.count == 0 {
            return Ok(());
        }
        let mut file = self.file.into_inner().map_err(std::io::IntoInnerError::into_error)?;
        file.seek(SeekFrom::Start(0))?;
        write!(target, ",\n\"{}\":[", self.name)?;
        std::io::copy(&mut Read::by_ref(&mut file), target)?;
        target.write_all(b"]")
    }
}

impl RegionFile {
    /// Begins the file of a level of detail.
    pub fn create(lod: u32, out: &Path) -> Result<RegionFile, Error> {
        let path = super::region_path(lod, "gltf");
        let folder = out.join(super::FOLDER);
        let spool = |name| Spool::create(name, &folder);
        Ok(RegionFile {
            path,
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
        })
    }

    /// Adds a tile, whose GLB has that path in the folder of the bake and its buffer at `start`.
    pub fn add(&mut self, root: Root, path: &str, start: usize) -> Result<(), Error> {
        self.add_shifted(root, path, start).map_err(Error::io(self.out.join(&self.path)))
    }

    fn add_shifted(&mut self, root: Root, path: &str, start: usize) -> std::io::Result<()> {
        // How many there were before: what a tile's indices are raised by.
        let (nodes, meshes, accessors) = (self.nodes.count, self.meshes.count, self.accessors.count);
        let (views, buffers, images) = (self.views.count, self.buffers.count, self.images.count);
        let textures = self.textures.count;
        // Buffers: a GLB is read as the bytes that it is.
        for (index, mut buffer) in root.buffers.into_iter().enumerate() {
            if index == 0 {
                buffer.uri = Some(file_name(path).to_owned());
                buffer.byte_length = (buffer.byte_length.0 + start as u64).into();
            }
            self.buffers.push(&buffer)?;
        }
        for mut view in root.buffer_views {
            if view.buffer.value() == 0 {
                view.byte_offset = Some((view.byte_offset.map_or(0, |offset| offset.0) + start as u64).into());
            }
            shift(&mut view.buffer, buffers);
            // Compressed numbers lie where their extension says; the view itself describes a buffer that is not written.
            if let Some(coded) = view.extensions.as_mut().and_then(|extensions| extensions.others.get_mut(COMPRESSION))
            {
                raise(&mut coded["buffer"], u64::from(buffers));
                raise(&mut coded["byteOffset"], start as u64);
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
        // Materials of tiles are their own; those of water and roads are all the same.
        let mut materials = Vec::with_capacity(root.materials.len());
        for mut material in root.materials {
            // By name, since a tile has only those that it shows.
            let substance = SUBSTANCES.iter().position(|substance| material.name.as_deref() == Some(substance.name));
            let known = substance.and_then(|substance| self.shared[substance]);
            materials.push(Index::new(known.unwrap_or(self.materials.count)));
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
        // The same in all tiles of a bake.
        self.extensions = (root.extensions_used, root.extensions_required);
        Ok(())
    }

    /// Puts the lists together.
    pub fn finish(self) -> Result<FileRecord, Error> {
        let path = self.out.join(&self.path);
        let mut file = PartFile::create(path.clone())?;
        let record = self.path.clone();
        self.write(&mut file).map_err(Error::io(path))?;
        Ok(FileRecord::new(record, super::Gltf.name(), file.finish()?))
    }

    fn write(self, file: &mut PartFile) -> std::io::Result<()> {
        // List by list, since they are in files: together they may be larger than memory.
        let generator = generator::NAME;
        write!(
            file,
            "{{\"asset\":{{\"version\":\"2.0\",\"generator\":\"{generator}\"}},\n\"scene\":0,\n\"scenes\":[{{\"name\":\"region\""
        )?;
        self.scene.copy_to(file)?;
        file.write_all(b"}]")?;
        for (name, list) in [("extensionsUsed", self.extensions.0), ("extensionsRequired", self.extensions.1)] {
            if !list.is_empty() {
                write!(file, ",\n\"{name}\":{}", serde_json::to_string(&list)?)?;
            }
        }
        let lists = [self.nodes, self.meshes, self.materials, self.textures, self.samplers, self.images];
        for list in lists.into_iter().chain([self.accessors, self.views, self.buffers]) {
            list.copy_to(file)?;
        }
        file.write_all(b"}\n")
    }
}

fn shift<T>(index: &mut Index<T>, by: u32) {
    *index = Index::new(index.value() as u32 + by);
}

fn raise(number: &mut Value, by: u64) {
    *number = Value::from(number.as_u64().expect("an offset is a whole number") + by);
}
