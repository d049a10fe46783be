//! Meshes: what of a tile they show, and the formats that hold it.
//!
//! ```text
//!   model.rs              tile -> land, waters, ribbons, ordered for a GPU
//!   values.rs             model -> numbers, in floats or in 8 and 16 bits
//!   relative_normals.rs   tile, land -> the normal map of a coarse mesh
//!   glb.rs                numbers, pictures -> the bytes of a GLB
//!   gltf.rs               model -> a GLB a tile     region.rs   all GLBs -> one glTF
//!   obj.rs                model -> OBJ and MTL             collision.rs   model -> a GLB of positions a tile
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
use crate::export::format::FormatCost;
use crate::export::options::Lods;

/// The folder of meshes in that of a bake.
const FOLDER: &str = "mesh";

/// The file of a tile at a level of detail, by the numbers that it is named after.
fn tile_path(lod: u32, [x, y]: [i64; 2], ending: &str) -> String {
    format!("{FOLDER}/tile{}_x{x}_y{y}.{ending}", level(lod))
}

/// The file of a region at a level of detail.
fn region_path(lod: u32, ending: &str) -> String {
    format!("{FOLDER}/region{}.{ending}", level(lod))
}

/// The name of a part of a tile, such as `land_x3_y-4`: other files than these, of other regions too, have no part of the
/// same name, so a scene may hold all of them. The bake's finest level goes without saying, whichever it is.
fn part_name(part: &str, TileId { x, y }: TileId, lod: u32, lods: &Lods) -> String {
    let level = if lods.all().first() == Some(&lod) { String::new() } else { level(lod) };
    format!("{part}_x{x}_y{y}{level}")
}

/// The finest level goes without saying.
fn level(lod: u32) -> String {
    if lod == 0 { String::new() } else { format!("_lod{lod}") }
}

/// What meshes take that have so many bytes a tile: a thread holds the mesh, and its file.
fn cost(bytes: u64, files: u64) -> FormatCost {
    FormatCost { files, thread_bytes: 2 * bytes, ..FormatCost::default() }
}
