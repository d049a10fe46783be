//! `terrane merge`.

use crate::cli::args::MergeArguments;
use crate::cli::bake::{carry_out, default_folder};
use crate::cli::console::Console;
use crate::cli::progress::watched;
use crate::error::Error;
use crate::export::Shards;

/// Merges shards into one bake.
pub(super) fn run(arguments: &MergeArguments, console: &Console) -> Result<(), Error> {
    let MergeArguments { shards, folder, run } = arguments;
    let shards = Shards::open(shards)?;
    let manifest = shards.manifest();
    let world = manifest.world()?;
    let plan = shards.plan(&world)?;
    let out = folder.out.clone().unwrap_or_else(|| default_folder(&manifest.preset_name, &world, plan.region(), None));
    if !run.dry_run {
        // Check all shards before anything is written.
        watched(console, run.threads, |watch| shards.check(watch))?;
    }
    carry_out(&plan, folder.mode(), &out, run, console)
}
