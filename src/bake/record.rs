//! What a bake says of each file that it leaves.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::area::TileId;

/// A file of the bake.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FileRecord {
    /// Path in the folder of the bake, with `/` between its parts.
    pub path: String,
    /// The export that it belongs to; `registry` for the tile registry, which every bake has.
    pub export: String,
    /// Rasters: pixels from west to east.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub width: Option<u64>,
    /// Rasters: pixels from north to south.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub height: Option<u64>,
    /// Rasters: what each channel holds.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub channels: Vec<String>,
    /// Meshes of one tile: what they show.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mesh: Option<MeshRecord>,
    /// Files of one tile: its true number in the world.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tile: Option<TileId>,
    /// Size in bytes.
    pub bytes: u64,
    /// BLAKE3 hash of its bytes, in hexadecimal.
    pub blake3: String,
}

/// The land of a tile's mesh.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MeshRecord {
    /// Level of detail; 0 is every vertex.
    pub lod: u32,
    /// Metres that no vertex of the raster lies above or below the mesh.
    pub error_m: f64,
    /// Vertices of the land.
    pub vertices: u64,
    /// Triangles of the land.
    pub triangles: u64,
    /// Least metres east, up and south of the meshes' origin.
    pub min_m: [f64; 3],
    /// Greatest metres east, up and south of the meshes' origin.
    pub max_m: [f64; 3],
}

impl FileRecord {
    /// The record of a file that holds no raster, no mesh and no one tile.
    pub(crate) fn new(path: String, export: &str, finished: Finished) -> FileRecord {
        FileRecord {
            path,
            export: export.to_owned(),
            width: None,
            height: None,
            channels: Vec::new(),
            mesh: None,
            tile: None,
            bytes: finished.bytes,
            blake3: finished.blake3.to_hex().to_string(),
        }
    }
}

/// The size and the hash of a finished file.
pub(crate) struct Finished {
    pub bytes: u64,
    pub blake3: blake3::Hash,
}
