//! Repair: a bake that is not whole becomes as it was.

use std::path::{Path, PathBuf};

use crate::error::Error;
use crate::export::Rebake;
use crate::export::check::{check, told};
use crate::export::folder::{Mode, Output, settle};
use crate::export::plan::Plan;
use crate::watch::Watch;

/// What was mended.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Repaired {
    /// Files that have their bytes again, as paths in the folder of the bake.
    pub files: Vec<String>,
    /// Files that were not as they were baked, and may have been changed on purpose: where they are now.
    pub kept: Vec<PathBuf>,
}

/// Bakes again what is wrong with the bake in a folder, on the threads of the current rayon pool: afterwards each file has the
/// bytes that it had when it was baked. The whole bake is made beside the old one for that, and only what is damaged is replaced: what
/// stands there gets another name.
///
/// # Errors
/// When neither the manifest nor the registry says what was baked, or names a world that this program cannot make, or is damaged
/// there; when a bake is writing to the folder, when there is too little room, or when a file cannot be written.
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
