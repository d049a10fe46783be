//! What lies in the folder of a bake, at a glance: no file is read but the manifest and the registry.

use std::path::Path;

use crate::error::Error;
use crate::export::check::told;
use crate::export::folder::begun;
use crate::export::lock::Lock;
use crate::export::manifest::Manifest;
use crate::export::runs::{Run, runs};
use crate::registry::{FILE_NAME, Registry};

/// How far a bake has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// All of it is there.
    Whole,
    /// It is being made.
    UnderWay,
    /// It did not come to its end, and can be gone on with.
    CutOff,
}

/// What lies in the folder of a bake.
#[derive(Clone, Debug, PartialEq)]
pub struct Contents {
    /// What was baked; without files where the bake is not whole.
    pub manifest: Manifest,
    /// How far it has come.
    pub state: State,
    /// How many of its tiles are known.
    pub tiles: u64,
    /// How many it has, or is to have.
    pub tiles_of: u64,
    /// Files that are not there, or have another size, as paths in the folder.
    pub missing: Vec<String>,
    /// Its runs, as far as their log can be read.
    pub runs: Vec<Run>,
}

/// Looks at the bakes in a folder: one that is whole, and one that is under way or was cut off.
///
/// # Errors
/// When there is none that can be read.
pub fn look(folder: &Path) -> Result<Vec<Contents>, Error> {
    let mut found = Vec::new();
    let whole = told(folder);
    let work = begun(folder);
    if let Ok(manifest) = &whole {
        let files = manifest.all_files(folder);
        let is_there = |path: &str, bytes: u64| folder.join(path).metadata().is_ok_and(|there| there.len() == bytes);
        let missing = files.iter().filter(|file| !is_there(&file.path, file.bytes));
        found.push(Contents {
            state: State::Whole,
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
            state: if is_held { State::UnderWay } else { State::CutOff },
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

/// How many tiles a manifest tells of; all of the region, where this program cannot tell which are those of a walk.
fn tiles_of(manifest: &Manifest) -> u64 {
    if let Some(shard) = &manifest.shard {
        return shard.cols.saturating_mul(shard.rows);
    }
    let walked = manifest.walk.as_ref().and_then(|_| manifest.tiles().ok());
    walked.map_or(manifest.region.cols * manifest.region.rows, |tiles| tiles.len() as u64)
}

/// How often a registry is read of which nothing can be told: that of a bake under way may change meanwhile.
const LOOKS: u32 = 3;

fn tiles(folder: &Path) -> u64 {
    let look = |_| Registry::read(&folder.join(FILE_NAME)).and_then(|registry| registry.tiles()).ok();
    (0..LOOKS).find_map(look).unwrap_or(0)
}
