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
    /// Changed files that the repair has renamed, since somebody may have changed them on purpose: their new paths.
    pub kept: Vec<PathBuf>,
}

/// Bakes again what is wrong with the bake in a folder, on the threads of the current rayon pool: afterwards each file
/// has the bytes that it had when it was baked. For that the whole bake is made again beside the old one, but only
/// damaged files are replaced. The damaged files are renamed.
///
/// # Errors
/// When neither the manifest nor the registry says what was baked, or names a world that this program cannot make, or
/// is damaged there; when a bake is writing to the folder, when there is too little room, or when a file cannot be
/// written.
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
