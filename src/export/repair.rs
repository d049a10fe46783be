//! Repair: a bake that is not whole becomes as it was.

use std::fs;
use std::path::Path;

use crate::error::Error;
use crate::export::check::{file_fault, path_in};
use crate::export::folder::{Output, clean};
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
/// When the manifest cannot be read, names a world that this program cannot make, or says of a file what it never was; when
/// another bake is writing to the folder, when there is too little room, or when a file cannot be written.
pub fn repair(folder: &Path, watch: &Watch) -> Result<Repaired, Error> {
    let checked = check(folder, Rebake::None, watch)?;
    if checked.faults.is_empty() {
        return Ok(Repaired::default());
    }
    let lock = Lock::take(folder)?;
    let old = Manifest::read(folder)?;
    let world = old.world()?;
    let plan = Plan::of(&old, &world)?;
    let again = folder.join(AGAIN);
    let output = Output::prepare(&again, true, &plan.cost(rayon::current_num_threads()))?;
    let new = plan.run(&output, watch)?;
    let mut repaired = Repaired::default();
    for record in new.files.iter().filter(|record| file_fault(folder, record).is_some()) {
        let unsafe_path = || Error::Output {
            path: folder.join(&record.path),
            message: "would be written over a link".into(),
            hint: "remove the link, and repair again".into(),
        };
        let to = path_in(folder, &record.path).ok_or_else(unsafe_path)?;
        let parent = to.parent().unwrap_or(folder);
        fs::create_dir_all(parent).map_err(Error::io(parent))?;
        fs::rename(again.join(&record.path), &to).map_err(Error::io(&to))?;
        sync_folder(parent)?;
        repaired.files.push(record.path.clone());
    }
    // Last: until then it says of the old files what they are not.
    let text = |folder: &Path| fs::read(folder.join(manifest::PATH)).map_err(Error::io(folder.join(manifest::PATH)));
    if text(folder)? != text(&again)? {
        let to = folder.join(manifest::PATH);
        fs::copy(again.join(manifest::PATH), again.join("manifest")).map_err(Error::io(&again))?;
        fs::rename(again.join("manifest"), &to).map_err(Error::io(&to))?;
        repaired.files.push(manifest::PATH.to_owned());
    }
    sync_folder(folder)?;
    drop(output);
    // What was moved away is missed there, and the rest goes.
    clean(&again, false)?;
    drop(lock);
    Ok(repaired)
}
