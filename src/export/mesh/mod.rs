//! Meshes: what of a tile they show, and the formats that hold it.
//!
//! ```text
//!   model.rs              tile -> land, waters, ribbons, ordered for a GPU
//!   values.rs             model -> numbers, in floats or in 8 and 16 bits
//!   relative_normals.rs   tile, land -> the normal map of a coarse mesh
//!   glb.rs                numbers, pictures -> the bytes of a GLB
//!   gltf.rs               model -> a GLB a tile     region.rs   all GLBs -> one glTF
//!   obj.rs                model -> OBJ and MTL
//! ```

mod glb;
mod gltf;
mod model;
mod obj;
mod region;
mod relative_normals;
mod values;

pub(super) use gltf::Gltf;
pub(super) use obj::{OBJ, OBJ_TILES};

use crate::area::Place;
use crate::export::format::{FormatCost, RECORD_BYTES, Request, is_number};

/// The folder of meshes in that of a bake.
const FOLDER: &str = "mesh";

/// The file of a tile at a level of detail.
fn tile_path(lod: u32, place: Place, ending: &str) -> String {
    format!("{FOLDER}/tile{}_x{}_y{}.{ending}", level(lod), place.col, place.row)
}

/// The file of a region at a level of detail.
fn region_path(lod: u32, ending: &str) -> String {
    format!("{FOLDER}/region{}.{ending}", level(lod))
}

/// The finest level goes without saying.
fn level(lod: u32) -> String {
    if lod == 0 { String::new() } else { format!("_lod{lod}") }
}

/// What a thread takes to triangulate a vertex at LOD 0 and to make its share of the textures, measured over 16 x 16 tiles
/// of the thesis' world.
const MESH_NS_A_VERTEX: u64 = 700;

/// What meshes take of which each has at most `bytes` in a file of its own, or as much of one, and `more` elsewhere.
fn cost(request: &Request, bytes: u64, more: u64, files: u64) -> FormatCost {
    let meshes = request.region.tiles().saturating_mul(request.meshes.lods.all().len() as u64);
    let disk_bytes = (bytes + more + RECORD_BYTES).saturating_mul(meshes).saturating_add(1 << 20);
    FormatCost {
        files,
        disk_bytes,
        tile_file_bytes: bytes,
        work_ns_a_vertex: MESH_NS_A_VERTEX,
        ..FormatCost::default()
    }
}

/// Whether a bake gives a file with one of those endings that path, in a file of the region or of a tile.
fn names(path: &str, region: bool, tiles: bool, endings: &[&str]) -> bool {
    let stem = || {
        let (stem, ending) = path.strip_prefix(FOLDER)?.strip_prefix('/')?.rsplit_once('.')?;
        endings.contains(&ending).then_some(stem)
    };
    let without_level = |rest: &'static str, stem: &str| -> Option<String> {
        let stem = stem.strip_prefix(rest)?;
        let Some(level) = stem.strip_prefix("_lod") else { return Some(stem.to_owned()) };
        // The level is followed by the tile's place, or by nothing.
        let end = level.find('_').unwrap_or(level.len());
        is_number(&level[..end]).then(|| level[end..].to_owned())
    };
    let Some(stem) = stem() else { return false };
    let is_tile = || {
        let rest = without_level("tile", stem)?;
        let (col, row) = rest.strip_prefix("_x")?.split_once("_y")?;
        Some(is_number(col) && is_number(row))
    };
    region && without_level("region", stem).is_some_and(|rest| rest.is_empty()) || tiles && is_tile() == Some(true)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_names_of_files_are_known_again() {
        let place = Place { row: 3, col: 12 };
        for lod in [0, 7] {
            assert!(names(&tile_path(lod, place, "glb"), false, true, &["glb"]));
            assert!(names(&region_path(lod, "gltf"), true, false, &["gltf"]));
            assert!(!names(&region_path(lod, "gltf"), false, true, &["gltf"]));
        }
        for other in
            ["mesh/tile_x1.glb", "mesh/mine.glb", "mesh/tile_lod_x1_y1.glb", "mesh/region2.glb", "tile_x1_y1.glb"]
        {
            assert!(!names(other, true, true, &["glb"]), "{other}");
        }
    }
}
