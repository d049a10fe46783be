//! Repair of damaged bakes: restores the bytes of all files.

use std::path::{Path, PathBuf};

use crate::error::Error;
use crate::export::Rebake;
use crate::export::folder::check::{check, told};
use crate::export::folder::{Mode, Output, settle};
use crate::export::plan::Plan;
use crate::watch::Watch;

/// The result of a repair.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Repaired {
    /// Restored files, as paths in the folder of the bake.
    pub files: Vec<String>,
    /// New paths of changed files. The repair renames these files and keeps them, because somebody may have changed
    /// them on purpose.
    pub kept: Vec<PathBuf>,
}

/// Restores all damaged and missing files of the bake in a folder, on the threads of the current rayon pool: afterwards
/// each file has the bytes that it had when it was baked. If a file is damaged or missing, the whole bake is made again
/// beside the old one, but only the files that differ are put in place. A damaged file is renamed and not removed.
///
/// # Errors
/// When the manifest is missing; when it is damaged where it says what was baked, and the registry cannot be read
/// either; when this program cannot make the world that was baked; when another bake is writing to the folder, when
/// there is too little room, or when a file cannot be written.
pub fn repair(folder: &Path, watch: &Watch) -> Result<Repaired, Error> {
    let kept = settle(folder)?;
    if check(folder, Rebake::None, watch)?.faults.is_empty() {
        return Ok(Repaired { files: Vec::new(), kept });
    }
    let old = told(folder)?;
    let world = old.world()?;
    let plan = Plan::of(&old, &world)?;
    let output = Output::prepare(folder, Mode::Repair, &plan, &plan.cost(rayon::current_num_threads()))?;
    plan.run(&output, watch)?;
    Ok(Repaired { files: output.renewed(), kept: [kept, output.kept()].concat() })
}
