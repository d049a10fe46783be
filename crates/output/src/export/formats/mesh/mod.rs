//! Meshes: their content for each tile, and the formats that hold them.
//!
//! ```text
//!   model.rs              tile -> land, waters, ribbons, ordered for a GPU
//!   values.rs             model -> numbers, in floats or in 8 and 16 bits
//!   relative_normals.rs   tile, land -> the normal map of a coarse mesh
//!   glb.rs                numbers, pictures -> the bytes of a GLB
//!   gltf.rs               model -> a GLB for each tile
//!   region.rs             all GLBs -> one glTF
//!   obj.rs                model -> OBJ and MTL
//!   collision.rs          model -> a GLB of positions for each tile
//! ```

mod collision;
mod glb;
mod gltf;
mod model;
mod obj;
mod region;
mod relative_normals;
mod values;

pub(super) use collision::Collision;
pub(super) use gltf::{GLTF, GLTF_REGION};
pub(super) use obj::{OBJ, OBJ_TILES};

use crate::area::TileId;
use crate::export::plan::options::Lods;

/// Folder of meshes within that of the bake.
const FOLDER: &str = "mesh";

/// Returns the path of a tile's file at a level of detail, named after the tile's numbers.
fn tile_path(lod: u32, [x, y]: [i64; 2], ending: &str) -> String {
    format!("{FOLDER}/tile{}_x{x}_y{y}.{ending}", level(lod))
}

/// Returns the path of a region's file at a level of detail.
fn region_path(lod: u32, ending: &str) -> String {
    format!("{FOLDER}/region{}.{ending}", level(lod))
}

/// Returns the name of a part of a tile, such as `land_x3_y-4`. No file of another tile or level, of other regions too,
/// has a part of the same name, so a scene may hold all of them. The bake's finest level, whichever it is, has no
/// suffix.
fn part_name(part: &str, TileId { x, y }: TileId, lod: u32, lods: &Lods) -> String {
    let level = if lods.all().first() == Some(&lod) { String::new() } else { level(lod) };
    format!("{part}_x{x}_y{y}{level}")
}

/// Returns the suffix of a level of detail. LOD 0 has none.
fn level(lod: u32) -> String {
    if lod == 0 { String::new() } else { format!("_lod{lod}") }
}
