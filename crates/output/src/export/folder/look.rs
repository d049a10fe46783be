//! The contents of a bake's folder at a glance: only the manifest and the registry are read.

use std::path::Path;

use crate::error::Error;
use crate::export::folder::begun;
use crate::export::folder::check::told;
use crate::export::folder::lock::Lock;
use crate::export::folder::manifest::Manifest;
use crate::export::folder::runs::{Run, runs};
use crate::registry::{FILE_NAME, Registry};

/// Progress of a bake.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BakeState {
    /// All of the bake is there.
    Whole,
    /// The bake is being made.
    UnderWay,
    /// The bake was cut off, and can be resumed.
    CutOff,
}

/// A bake in a folder.
#[derive(Clone, Debug, PartialEq)]
pub struct Contents {
    /// The manifest; without files if the bake is not whole.
    pub manifest: Manifest,
    /// Progress of the bake.
    pub state: BakeState,
    /// Number of tiles in its registry.
    pub tiles: u64,
    /// Number of tiles of the whole bake.
    pub tiles_of: u64,
    /// Files that are missing or have another size, as paths in the folder.
    pub missing: Vec<String>,
    /// Runs of the bake, as far as their log can be read.
    pub runs: Vec<Run>,
}

/// Looks at the bakes in a folder: a whole one, and one that is under way or was cut off.
///
/// # Errors
/// When there is no bake that can be read.
pub fn look(folder: &Path) -> Result<Vec<Contents>, Error> {
    let mut found = Vec::new();
    let whole = told(folder);
    let work = begun(folder);
    if let Ok(manifest) = &whole {
        let files = manifest.all_files(folder);
        let is_there = |path: &str, bytes: u64| folder.join(path).metadata().is_ok_and(|there| there.len() == bytes);
        let missing = files.iter().filter(|file| !is_there(&file.path, file.bytes));
        found.push(Contents {
            state: BakeState::Whole,
            tiles: tiles(folder),
            tiles_of: tiles_of(manifest),
            missing: missing.map(|file| file.path.clone()).collect(),
            runs: runs(folder),
            manifest: manifest.clone(),
        });
    }
    if let Some((work, manifest)) = work {
        let is_held = Lock::check(folder).is_err();
        found.push(Contents {
            tiles_of: tiles_of(&manifest),
            manifest,
            state: if is_held { BakeState::UnderWay } else { BakeState::CutOff },
            tiles: tiles(&work),
            missing: Vec::new(),
            runs: runs(&work),
        });
    }
    match whole {
        Err(error) if found.is_empty() => Err(error),
        _ => Ok(found),
    }
}

/// Returns the number of tiles of a manifest's bake. Of a walk that this program cannot repeat, all tiles of the region
/// count.
fn tiles_of(manifest: &Manifest) -> u64 {
    if let Some(shard) = &manifest.shard {
        return shard.cols.saturating_mul(shard.rows);
    }
    let walked = manifest.walk.as_ref().and_then(|_| manifest.tiles().ok());
    walked.map_or(manifest.region.cols * manifest.region.rows, |tiles| tiles.len() as u64)
}

/// Number of attempts to read a registry: that of a bake under way may change during an attempt.
const LOOKS: u32 = 3;

fn tiles(folder: &Path) -> u64 {
    let look = |_| Registry::read(&folder.join(FILE_NAME)).and_then(|registry| registry.tiles()).ok();
    (0..LOOKS).find_map(look).unwrap_or(0)
}
