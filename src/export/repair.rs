//! Repair: a bake that is not whole becomes as it was.

use std::fs;
use std::path::Path;

use rayon::prelude::*;

use crate::bake::FileRecord;
use crate::error::Error;
use crate::export::check::{file_fault, path_in};
use crate::export::folder::Output;
use crate::export::lock::Lock;
use crate::export::manifest::{self, Manifest};
use crate::export::plan::Plan;
use crate::export::{Rebake, check};
use crate::file::sync_folder;
use crate::watch::Watch;

/// The folder in that of the bake in which it is baked again.
pub(super) const AGAIN: &str = ".terrane-repair";

/// What was mended.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Repaired {
    /// Files that have their bytes again, as paths in the folder of the bake.
    pub files: Vec<String>,
}

/// Bakes again what is wrong with the bake in a folder, on the threads of the current rayon pool: afterwards each file has the
/// bytes that it had when it was baked. The whole bake is made beside the old one for that, and only what is damaged is replaced.
///
/// # Errors
/// When the manifest cannot be read, names a world that this program cannot make, or is damaged where it says what was baked;
/// when a bake is writing to the folder, when there is too little room, or when a file cannot be written.
pub fn repair(folder: &Path, watch: &Watch) -> Result<Repaired, Error> {
    if check(folder, Rebake::None, watch)?.faults.is_empty() {
        return Ok(Repaired::default());
    }
    let lock = Lock::take(folder)?;
    let again = folder.join(AGAIN);
    let repaired = replace(folder, &again, watch);
    // Whatever has become of it; no link is followed.
    _ = fs::remove_dir_all(&again);
    // There is a manifest, so what a repair that was cut off has left of its lock marks nothing.
    lock.unmark();
    repaired
}

/// Bakes into a folder `again`, and moves from there what is damaged.
fn replace(folder: &Path, again: &Path, watch: &Watch) -> Result<Repaired, Error> {
    let old = Manifest::read(folder)?;
    let world = old.world()?;
    let plan = Plan::of(&old, &world)?;
    let output = Output::prepare(again, true, &plan.cost(rayon::current_num_threads()))?;
    let new = plan.run(&output, watch)?;
    let damaged: Vec<&FileRecord> =
        new.files.par_iter().filter(|record| file_fault(folder, record).is_some()).collect();
    // A manifest that is not as it was written may tell of another world: it is believed where files bear it out.
    let is_known = |record: &&FileRecord| old.files.iter().any(|known| known == *record);
    if !old.is_sealed() && !damaged.iter().all(is_known) {
        return Err(Error::Faulty {
            path: folder.join(manifest::PATH),
            message: "is damaged where it says what was baked, and nothing else tells that".into(),
            hint: "bake again with the preset and the seed of this bake, and --overwrite".into(),
        });
    }
    let mut repaired = Repaired::default();
    for FileRecord { path, .. } in damaged {
        let to = path_in(folder, path).ok_or_else(|| Error::Output {
            path: folder.join(path),
            message: "would be written over a link".into(),
            hint: "remove the link, and repair again".into(),
        })?;
        let parent = to.parent().unwrap_or(folder);
        fs::create_dir_all(parent).map_err(Error::io(parent))?;
        fs::rename(again.join(path), &to).map_err(Error::io(&to))?;
        sync_folder(parent)?;
        repaired.files.push(path.clone());
    }
    // Last: until then it says of the old files what they are not.
    let [to, from] = [folder, again].map(|folder| folder.join(manifest::PATH));
    let text = |path: &Path| fs::read(path).map_err(Error::io(path));
    if text(&to)? != text(&from)? {
        fs::rename(&from, &to).map_err(Error::io(&to))?;
        repaired.files.push(manifest::PATH.to_owned());
    }
    sync_folder(folder)?;
    Ok(repaired)
}
