//! The removal of bakes.

use std::fs;
use std::path::Path;

use rayon::prelude::*;

use crate::clock::Clock;
use crate::error::Error;
use crate::export::folder::lock::Lock;
use crate::export::folder::manifest::{self, Manifest};
use crate::export::folder::moving::remove_empty_above;
use crate::export::folder::runs;
use crate::export::folder::{WORK, size};
use crate::file::{remove, remove_folder, remove_unfinished};
use crate::stop::Stopped;

/// The result of removing a bake.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Cleaned {
    /// Number of removed files.
    pub files: u64,
    /// Bytes of the removed files.
    pub bytes: u64,
    /// Files of the bake that somebody has changed since: they are kept.
    pub kept: Vec<String>,
}

/// Removes what bakes have left in a folder, and nothing else: unchanged files that the manifest lists, the manifest, a
/// bake that was cut off, and folders that become empty. With `dry` nothing is removed, only counted.
///
/// # Errors
/// When there is no bake, when one is writing to the folder, or when a file cannot be removed. When `clock` stops the
/// work; then nothing is removed.
pub fn clean(path: &Path, dry: bool, clock: &Clock) -> Result<Cleaned, Error> {
    let work = path.join(WORK);
    let manifest = match Manifest::read(path) {
        Err(error) if !work.is_dir() => return Err(error),
        manifest => manifest.ok(),
    };
    Lock::check(path)?;
    let lock = if dry { None } else { Some(Lock::take(path)?) };
    let mut cleaned = Cleaned::default();
    let files = manifest.map(|manifest| manifest.all_files(path)).unwrap_or_default();
    let faults = files.par_iter().map(|record| Ok(record.fault(path, clock)?.is_some()));
    let faults = faults.collect::<Result<Vec<bool>, Stopped>>()?;
    // The manifest goes first: if the removal is cut off, the rest does not look like a bake.
    let of_bake = [manifest::PATH.to_owned(), runs::PATH.to_owned()].into_iter();
    let ours = files.iter().zip(&faults).filter(|(_, fault)| !**fault).map(|(record, _)| record.path.clone());
    for file in of_bake.chain(ours).filter(|file| path.join(file).is_file()) {
        let at = path.join(&file);
        cleaned.files += 1;
        cleaned.bytes += at.metadata().map_or(0, |there| there.len());
        if !dry {
            remove(&at)?;
            remove_empty_above(path, &file);
        }
    }
    let changed = files.iter().zip(&faults).filter(|(_, fault)| **fault).map(|(record, _)| &record.path);
    cleaned.kept = changed.filter(|file| path.join(file).symlink_metadata().is_ok()).cloned().collect();
    cleaned.bytes += size(&work);
    if lock.is_some() {
        remove_folder(&work)?;
        remove_unfinished(path)?;
        drop(lock);
        _ = fs::remove_dir(path);
    }
    Ok(cleaned)
}
