//! The record of a file in the manifest of a bake.

use std::fs::File;
use std::io::{self, Read};
use std::path::{Component, Path, PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::area::TileId;
use crate::clock::Clock;
use crate::stop::Stopped;

/// Bytes of a file that are hashed at once.
const PIECE: usize = 1 << 20;

/// A file of the bake.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FileRecord {
    /// Path in the folder of the bake, with `/` between its parts.
    pub path: String,
    /// The export that the file belongs to; `registry` for the tile registry, which every bake has.
    pub export: String,
    /// Rasters: pixels from west to east.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub width: Option<u64>,
    /// Rasters: pixels from north to south.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub height: Option<u64>,
    /// Rasters: the content of each channel.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub channels: Vec<String>,
    /// Meshes of one tile: facts about the mesh.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mesh: Option<MeshRecord>,
    /// Files of one tile: the tile's true number in the world.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tile: Option<TileId>,
    /// Size in bytes.
    pub bytes: u64,
    /// BLAKE3 hash of the file's bytes, in hexadecimal.
    pub blake3: String,
}

/// The land of a tile's mesh.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MeshRecord {
    /// Level of detail; 0 is every vertex.
    pub lod: u32,
    /// Largest distance in metres of the raster's vertices above or below the mesh, except for vertices under water.
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
    /// Creates the record of a file that holds no raster, no mesh and not just one tile.
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

    /// True if another record is of the same file with the same bytes, whatever else the two say about the content.
    pub(crate) fn is_same_file(&self, other: &FileRecord) -> bool {
        let key = |record: &FileRecord| (record.path.clone(), record.export.clone(), record.tile, record.bytes);
        key(self) == key(other) && self.blake3 == other.blake3
    }

    /// Returns a description of what is wrong with the file in the folder of a bake; `None` if its bytes are as they
    /// were written.
    ///
    /// # Errors
    /// When `clock` stops the work.
    pub(crate) fn fault(&self, folder: &Path, clock: &Clock) -> Result<Option<String>, Stopped> {
        let Some(path) = path_in(folder, &self.path) else {
            return Ok(Some("leads out of the folder, or over a link".into()));
        };
        match path.metadata() {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Some("is missing".into())),
            Err(error) => return Ok(Some(format!("cannot be read: {error}"))),
            Ok(there) if !there.is_file() => return Ok(Some("is no file".into())),
            Ok(there) if there.len() != self.bytes => {
                return Ok(Some(format!("has {} bytes, and was written with {}", there.len(), self.bytes)));
            }
            Ok(_) => {}
        }
        let hash = hash_of(&path, clock);
        clock.check()?;
        Ok(match hash {
            Err(error) => Some(format!("cannot be read: {error}")),
            Ok(hash) if hash.to_hex().as_str() != self.blake3 => Some("has other bytes than were written".into()),
            Ok(_) => None,
        })
    }
}

/// Returns the path of a file of a bake; `None` if the path leads out of the folder or over a link.
pub(crate) fn path_in(folder: &Path, path: &str) -> Option<PathBuf> {
    let parts = Path::new(path);
    let is_plain = !path.is_empty()
        && !path.contains(['\\', '\0'])
        && parts.components().all(|part| matches!(part, Component::Normal(_)));
    let mut at = folder.to_owned();
    let follows_no_link = is_plain
        && parts.components().all(|part| {
            at.push(part);
            at.symlink_metadata().map_or(true, |there| !there.is_symlink())
        });
    follows_no_link.then_some(at)
}

fn hash_of(path: &Path, clock: &Clock) -> io::Result<blake3::Hash> {
    let mut file = File::open(path)?;
    let mut hasher = blake3::Hasher::new();
    let mut piece = vec![0; PIECE];
    loop {
        clock.check()?;
        match file.read(&mut piece)? {
            0 => return Ok(hasher.finalize()),
            count => _ = hasher.update(&piece[..count]),
        }
    }
}

/// The size and the hash of a finished file.
pub struct Finished {
    /// Size in bytes.
    pub bytes: u64,
    /// BLAKE3 hash of the bytes.
    pub blake3: blake3::Hash,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_path_leads_out_of_the_folder() {
        let folder = tempfile::tempdir().unwrap();
        for path in ["", "/etc/passwd", "../x", "a/../../x", "a\\b", ".", "a\0b"] {
            assert_eq!(path_in(folder.path(), path), None, "{path:?}");
        }
        assert!(path_in(folder.path(), "map/map.png").is_some());
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink("/etc", folder.path().join("map")).unwrap();
            assert_eq!(path_in(folder.path(), "map/passwd"), None);
        }
    }
}
