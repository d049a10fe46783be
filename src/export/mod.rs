//! Exports: what a bake leaves, in which formats, and the folder that it leaves it in.

pub(crate) mod file;
mod writer;
mod image;
mod raster;
mod hashes;
mod registry;
mod layers;
mod mesh;
mod vector;
mod geopackage;
mod geojson;
mod manifest;
mod profile;
mod cost;
mod limit;
mod plan;

pub use manifest::{Axes, DeviceProfile, FileRecord, HeightRange, Manifest, MeshRecord, RegionRecord};
pub use mesh::{Lods, MeshOptions};
pub use profile::Profile;

pub use cost::{Cost, Forecast};
pub use limit::Limit;
pub use plan::{Bytes, Output, Plan};
pub use writer::Format;

use std::fmt;
use std::path::Path;
use std::str::FromStr;

use crate::area::Region;
use crate::bake::Sink;
use crate::error::{Error, nearest};
use crate::world::World;
use image::{Image, Layout};
use raster::{Quantity, RegionRaster, TileRasters};

/// Something that a bake can leave, by the name that the command knows it by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Export(&'static Kind);

/// An export's name and what becomes of it.
#[derive(Debug, PartialEq, Eq)]
struct Kind {
    name: &'static str,
    about: &'static str,
    content: Content,
}

#[derive(Debug, PartialEq, Eq)]
enum Content {
    /// Rasters: one file each for the region, or with `tiles` one each a tile.
    Rasters { format: Format, tiles: bool, images: &'static [(&'static str, Quantity)] },
    /// Rasters as an engine wants them, each in its own way.
    Engine(&'static [Image]),
    /// A list of hashes.
    Hashes,
    /// Layers of features, and the tiles, in a database.
    GeoPackage,
    /// Layers of features as text.
    GeoJson,
    /// Meshes: a GLB a tile, and a glTF of the region.
    Gltf,
    /// Meshes as text: one of the region, or one a tile.
    Obj { tiles: bool },
}

/// The images of the blend map: four materials each.
const BLEND: &[(&str, Quantity)] =
    &[("blend/blend_ground", Quantity::GroundWeights), ("blend/blend_cover", Quantity::CoverWeights)];
const HEIGHT: &[(&str, Quantity)] = &[("height/height", Quantity::Height16)];
const METRES: &[(&str, Quantity)] = &[("height/height", Quantity::HeightMetres)];
const NORMAL: &[(&str, Quantity)] = &[("normal/normal", Quantity::Normal)];
const COLOUR: &[(&str, Quantity)] = &[("colour/colour", Quantity::Colour)];
const MAP: &[(&str, Quantity)] = &[("map/map", Quantity::Map)];
const WATER: &[(&str, Quantity)] = &[("water/water", Quantity::Water)];
const DEPTH: &[(&str, Quantity)] = &[("water/depth", Quantity::WaterDepth)];
const FLOW: &[(&str, Quantity)] = &[("water/flow", Quantity::Flow)];

const fn rasters(
    name: &'static str,
    about: &'static str,
    format: Format,
    tiles: bool,
    images: &'static [(&'static str, Quantity)],
) -> Kind {
    Kind { name, about, content: Content::Rasters { format, tiles, images } }
}

const KINDS: &[Kind] = &[
    rasters("height", "16-bit grey PNG of the region, over the world's height range", Format::Png, false, HEIGHT),
    rasters("height-tiles", "the same, a PNG a tile", Format::Png, true, HEIGHT),
    rasters("exr", "heights in metres as 32-bit float OpenEXR", Format::Exr, false, METRES),
    rasters("exr-tiles", "the same, an EXR a tile", Format::Exr, true, METRES),
    rasters("r16", "16-bit little-endian heights without a header, and a JSON sidecar", Format::R16, false, HEIGHT),
    rasters("r16-tiles", "the same, a pair a tile", Format::R16, true, HEIGHT),
    rasters("blend", "two RGBA PNGs: grass, dirt, rock, sand; snow", Format::Png, false, BLEND),
    rasters("blend-tiles", "the same, two PNGs a tile", Format::Png, true, BLEND),
    rasters("normal", "normal map, RGB PNG in the OpenGL convention (green is north)", Format::Png, false, NORMAL),
    rasters("normal-tiles", "the same, a PNG a tile", Format::Png, true, NORMAL),
    rasters("map", "top-down picture of the region, RGB PNG", Format::Png, false, MAP),
    rasters("map-tiles", "the same, a PNG a tile", Format::Png, true, MAP),
    rasters("colour", "colour of the ground without light, RGB PNG", Format::Png, false, COLOUR),
    rasters("colour-tiles", "the same, a PNG a tile", Format::Png, true, COLOUR),
    rasters("water", "where water is, 8-bit grey PNG: 64 river, 128 lake, 255 sea", Format::Png, false, WATER),
    rasters("water-tiles", "the same, a PNG a tile", Format::Png, true, WATER),
    rasters("depth", "depth of the water in metres as 32-bit float OpenEXR", Format::Exr, false, DEPTH),
    rasters("depth-tiles", "the same, an EXR a tile", Format::Exr, true, DEPTH),
    rasters("flow", "discharge of the rivers in m3/s as 32-bit float OpenEXR", Format::Exr, false, FLOW),
    rasters("flow-tiles", "the same, an EXR a tile", Format::Exr, true, FLOW),
    Kind { name: "hashes", about: "BLAKE3 of each tile's heights, normals and weights", content: Content::Hashes },
    Kind {
        name: "vector",
        about: "rivers, lakes, coast, peaks, sites, roads, crossings and tiles as one GeoPackage",
        content: Content::GeoPackage,
    },
    Kind { name: "geojson", about: "the same layers as GeoJSON, coordinates in metres", content: Content::GeoJson },
    Kind {
        name: "gltf",
        about: "meshes of land, water and roads with textures: a GLB a tile, and a glTF that places all",
        content: Content::Gltf,
    },
    Kind {
        name: "obj",
        about: "the same meshes as one OBJ of the region, with its MTL and colour",
        content: Content::Obj { tiles: false },
    },
    Kind { name: "obj-tiles", about: "the same, an OBJ a tile", content: Content::Obj { tiles: true } },
];

impl Export {
    /// What a bake leaves when nothing is asked for.
    pub const DEFAULT: &str = "height,blend,normal,map";

    /// All exports that have a name of their own; a profile brings others.
    pub fn all() -> impl Iterator<Item = Export> {
        KINDS.iter().map(Export)
    }

    /// The name, as the command knows it.
    pub fn name(self) -> &'static str {
        self.0.name
    }

    /// What it is, in a few words.
    pub fn about(self) -> &'static str {
        self.0.about
    }

    /// The exports of a list with commas between; a name given twice counts once.
    ///
    /// # Errors
    /// When a name is not known, or the list is empty; the hint lists the names.
    pub fn parse_list(list: &str) -> Result<Vec<Export>, Error> {
        let mut exports = Vec::new();
        for name in list.split(',').map(str::trim) {
            let export = name.parse()?;
            if !exports.contains(&export) {
                exports.push(export);
            }
        }
        Ok(exports)
    }

    /// All exports that a bake can have, those of profiles too.
    fn known() -> impl Iterator<Item = Export> {
        Export::all().chain(profile::exports())
    }

    /// The raster images of this export.
    fn images(self) -> impl Iterator<Item = Image> {
        let (format, tiles, plain, engine) = match self.0.content {
            Content::Rasters { format, tiles, images } => (format, tiles, images, &[][..]),
            Content::Engine(images) => (Format::Png, false, &[][..], images),
            _ => (Format::Png, false, &[][..], &[][..]),
        };
        let layout = Layout::PLAIN;
        let image = move |&(stem, quantity): &_| Image { export: self.name(), stem, quantity, format, tiles, layout };
        plain.iter().map(image).chain(engine.iter().copied())
    }

    /// The exports that the files of this one refer to.
    fn needs(self) -> Option<Export> {
        let name = match self.0.content {
            Content::Obj { tiles: false } => "colour",
            Content::Obj { tiles: true } => "colour-tiles",
            _ => return None,
        };
        Export::all().find(|export| export.name() == name)
    }

    /// Whether this export has meshes.
    fn is_mesh(self) -> bool {
        matches!(self.0.content, Content::Gltf | Content::Obj { .. })
    }

    /// How many files of this export are not rasters.
    fn other_files(self, world: &World, region: &Region, meshes: &MeshOptions) -> u64 {
        let lods = meshes.lods.all().len() as u64;
        match self.0.content {
            Content::GeoJson => layers::layers(world).len() as u64,
            Content::Gltf => lods.saturating_mul(region.tiles() + 1),
            Content::Obj { tiles: false } => 2 * lods,
            Content::Obj { tiles: true } => region.tiles().saturating_mul(2 * lods),
            _ => self.others().len() as u64,
        }
    }

    /// The files of this export that are not rasters, of worlds of any kind.
    fn others(self) -> &'static [&'static str] {
        match self.0.content {
            Content::Rasters { .. } | Content::Engine(_) | Content::Gltf | Content::Obj { .. } => &[],
            Content::Hashes => &[hashes::PATH],
            Content::GeoPackage => geopackage::PATHS,
            Content::GeoJson => geojson::PATHS,
        }
    }

    /// Whether a bake would give this export a file of that path.
    fn names(self, path: &str) -> bool {
        let is_mesh = match self.0.content {
            Content::Gltf => mesh::names(path, true, false, &["gltf"]) || mesh::names(path, false, true, &["glb"]),
            Content::Obj { tiles } => mesh::names(path, !tiles, tiles, &["obj", "mtl"]),
            _ => false,
        };
        is_mesh || self.others().contains(&path) || self.images().any(|image| image.names(path))
    }

    /// The sinks that write this export into the folder of a bake.
    fn sinks<'a>(
        self,
        world: &'a World,
        region: Region,
        meshes: &MeshOptions,
        out: &Path,
    ) -> Result<Vec<Box<dyn Sink + 'a>>, Error> {
        match self.0.content {
            Content::Rasters { .. } | Content::Engine(_) => {}
            Content::Hashes => return Ok(vec![Box::new(hashes::TileHashes::create(region, out)?)]),
            Content::GeoPackage => return Ok(vec![Box::new(geopackage::GeoPackage::create(world, region, out)?)]),
            Content::GeoJson => return Ok(vec![Box::new(geojson::GeoJson::create(world, out)?)]),
            Content::Gltf => return Ok(vec![Box::new(mesh::GltfSink::create(world, region, meshes, out)?)]),
            Content::Obj { tiles } => {
                return Ok(vec![Box::new(mesh::ObjSink::create(world, region, meshes, tiles, out)?)]);
            }
        }
        let sink = |image: Image| -> Result<Box<dyn Sink + 'a>, Error> {
            match image.tiles {
                true => Ok(Box::new(TileRasters::create(world, region, image, out))),
                false => Ok(Box::new(RegionRaster::create(world, region, image, out)?)),
            }
        };
        self.images().map(sink).collect()
    }
}

impl FromStr for Export {
    type Err = Error;

    fn from_str(name: &str) -> Result<Export, Error> {
        Export::all().find(|export| export.name() == name).ok_or_else(|| {
            let names = || Export::all().map(Export::name);
            let list = names().collect::<Vec<_>>().join(", ");
            Error::Export {
                message: format!("there is no export named {name:?}"),
                hint: match nearest(name, names()) {
                    Some(meant) => format!("did you mean {meant}? exports: {list}"),
                    None => format!("exports: {list}"),
                },
            }
        })
    }
}

impl fmt::Display for Export {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
