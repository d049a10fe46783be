//! Formats: a file for each, with what it needs.
//!
//! ```text
//!   format.rs     the trait of all formats; formats(), below, lists them
//!   raster/       tiles -> PNG, OpenEXR, bare samples, GeoTIFF: the rows of a table of products
//!   vector/       features -> GeoPackage, GeoJSON      project.rs   all files for GIS -> a QGIS project
//!   mesh/         tiles -> glTF, OBJ                   splines/     rivers, roads -> knots of curves
//!   instances.rs  tiles -> the objects on them, as text             hashes.rs    tiles -> a list of hashes
//!   web.rs        the region as a web map, drawn as maps are
//!   profile/      files for one engine: formats of its own, sizes, IMPORT.md
//!   map_picture.rs   a map -> PNG, WebP and a world file, pdf.rs, svg.rs with path_data.rs and sfnt.rs
//!   atlas.rs      many maps                            georeference.rs   where files lie, in the terms of GIS
//! ```

pub(crate) mod format;
pub(crate) mod georeference;
pub(crate) mod path_data;
pub(crate) mod sfnt;
pub(crate) mod svg;
pub(crate) mod pdf;
pub(crate) mod raster;
pub(crate) mod vector;
pub(crate) mod splines;
pub(crate) mod instances;
pub(crate) mod mesh;
pub(crate) mod hashes;
pub(crate) mod web;
pub(crate) mod profile;
pub(crate) mod project;
pub(crate) mod map_picture;
pub(crate) mod atlas;

use std::fmt;
use std::str::FromStr;
use std::sync::{Mutex, MutexGuard};

use crate::error::{Error, nearest};
use crate::world::World;
use format::Format;

/// All formats with a name that the user can give, in the order of the help. A new format is a line here.
fn formats() -> impl Iterator<Item = &'static dyn Format> {
    let others: [&dyn Format; 12] = [
        &instances::Instances,
        &splines::Splines,
        &hashes::Hashes,
        &vector::GeoPackage,
        &vector::GeoJson,
        &mesh::GLTF,
        &mesh::GLTF_REGION,
        &mesh::OBJ,
        &mesh::OBJ_TILES,
        &mesh::Collision,
        &web::WEBP,
        &web::PNG,
    ];
    dynamic(&raster::product::NAMED).chain(others)
}

fn dynamic<F: Format>(table: &'static [F]) -> impl Iterator<Item = &'static dyn Format> {
    table.iter().map(|format| format as &dyn Format)
}

/// A kind of files that a bake can leave, identified by its name on the command line.
#[derive(Clone, Copy)]
pub struct Export(pub(crate) &'static dyn Format);

impl Export {
    /// Exports of a bake for which the user names none.
    pub const DEFAULT: &str = "height,blend,normal,map";

    /// Exports of a walk for which the user names none.
    pub const DEFAULT_OF_WALKS: &str = "height-tiles,blend-tiles,normal-tiles,map";

    /// Returns all exports that can show walks.
    pub fn of_walks() -> impl Iterator<Item = Export> {
        formats().filter(|format| format.shows_walks()).map(Export)
    }

    /// Returns all exports that the user can name; a profile adds others.
    pub fn all() -> impl Iterator<Item = Export> {
        formats().map(Export)
    }

    /// Returns the name, as given on the command line.
    pub fn name(self) -> &'static str {
        self.0.name()
    }

    /// True if the world has everything that the export shows.
    pub fn is_shown_by(self, world: &World) -> bool {
        self.0.lacks(world).is_none()
    }

    /// Returns a description of the export in a few words.
    pub fn about(self) -> &'static str {
        self.0.about()
    }

    /// Parses a list of exports, separated by commas; a name given twice counts once.
    ///
    /// # Errors
    /// When a name is not known, or the list is empty; the hint lists the names.
    pub fn parse_list(list: &str) -> Result<Vec<Export>, Error> {
        let mut exports = Vec::new();
        for name in list.split(',').map(str::trim) {
            let export = name.parse()?;
            // A second copy of an export would write the same files at the same time.
            if !exports.contains(&export) {
                exports.push(export);
            }
        }
        Ok(exports)
    }

    /// Returns all exports that a bake can have, those of profiles included.
    pub(crate) fn known() -> impl Iterator<Item = Export> {
        formats().chain(dynamic(&profile::FORMATS)).map(Export)
    }
}

/// Compares names, which are unique: a format is a trait object and cannot be compared itself.
impl PartialEq for Export {
    fn eq(&self, other: &Export) -> bool {
        self.name() == other.name()
    }
}

impl Eq for Export {}

impl fmt::Debug for Export {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Export({})", self.name())
    }
}

impl FromStr for Export {
    type Err = Error;

    fn from_str(name: &str) -> Result<Export, Error> {
        Export::all().find(|export| export.name() == name).ok_or_else(|| {
            let (message, hint) = unknown("export", name, &Export::all().map(Export::name).collect::<Vec<_>>());
            Error::Export { message, hint }
        })
    }
}

/// Locks state of a sink that the threads of a bake share.
pub(crate) fn locked<T>(shared: &Mutex<T>) -> MutexGuard<'_, T> {
    shared.lock().expect("no thread panics while it writes")
}

/// Returns the message and the hint for an unknown name; `kind` is the kind of thing that was named.
pub(crate) fn unknown(kind: &str, name: &str, known: &[&str]) -> (String, String) {
    let meant = nearest(name, known.iter().copied()).map_or(String::new(), |meant| format!("did you mean {meant}? "));
    (format!("there is no {kind} named {name:?}"), format!("{meant}{kind}s: {}", known.join(", ")))
}

impl fmt::Display for Export {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::area::{Region, TileId};
    use crate::export::{MeshOptions, Mode, Output, Plan, TileNames, VectorOptions};
    use crate::preset::Preset;
    use crate::watch::Watch;
    use format::{Request, folder};

    /// Bakes every export: its files and folders must be those that its format declares. A new format is covered once
    /// it is listed.
    #[test]
    fn every_format_leaves_the_files_that_it_says() {
        let text = "tile_cells = 32\nnoise = [{ kind = \"ridged\", height_m = 60.0, wavelength_m = 300.0, octaves = 4 }]\n\
                    rivers = { density = 1.0, width_m = [1.0, 4.0], bank_m = 3.0 }";
        let world = World::new(Preset::parse("test", text).unwrap(), None).unwrap();
        let region = Region::new(TileId { x: -1, y: 2 }, 2, 3, 32).unwrap();
        let meshes = MeshOptions { lods: "0..1".parse().unwrap(), ..MeshOptions::default() };
        let exports: Vec<Export> = Export::known().filter(|export| export.0.lacks(&world).is_none()).collect();
        let plan = Plan::new(&world, "test", region, exports.clone()).unwrap().with_meshes(meshes.clone()).unwrap();
        let out = tempfile::tempdir().unwrap();
        let output = Output::prepare(out.path(), Mode::New, &plan, &plan.cost(2)).unwrap();
        let manifest = plan.run(&output, &Watch::default()).unwrap();
        let height_range_m = world.height_range_m();
        let vectors = VectorOptions::default();
        let request = Request {
            name: "thesis",
            world: &world,
            region,
            meshes: &meshes,
            vectors: &vectors,
            names: TileNames::default(),
            height_range_m,
            walk: None,
            is_shard: false,
        };
        for export in exports {
            let files: Vec<_> = manifest.files.iter().filter(|file| file.export == export.name()).collect();
            assert_eq!(files.len() as u64, export.0.files(&request), "{export}");
            for path in files.iter().map(|file| &file.path) {
                assert!(export.0.folders().contains(&folder(path)), "{path}");
            }
        }
    }
}
