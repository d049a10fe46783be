//! `terrane merge`.

use std::thread;

use crate::cli::args::MergeArguments;
use crate::cli::bake::{carry_out, default_folder};
use crate::cli::console::Console;
use crate::cli::progress::Reporter;
use crate::cli::{thread_count, thread_pool};
use crate::error::Error;
use crate::export::{Mode, Shards};
use crate::watch::Watch;

/// Merges shards into one bake.
pub(super) fn run(arguments: &MergeArguments, console: &Console) -> Result<(), Error> {
    let MergeArguments { shards, out, overwrite, resume, run } = arguments;
    let shards = Shards::open(shards)?;
    let manifest = shards.manifest();
    let world = manifest.world()?;
    let plan = shards.plan(&world)?;
    let out = out.clone().unwrap_or_else(|| default_folder(&manifest.preset_name, &world, plan.region(), None));
    let mode = match (overwrite, resume) {
        (true, _) => Mode::Replace,
        (_, true) => Mode::Resume,
        _ => Mode::New,
    };
    if !run.dry_run {
        // Check all shards before anything is written.
        let (watch, pool) = (Watch::default(), thread_pool(thread_count(run.threads))?);
        thread::scope(|scope| {
            let shown = !run.quiet && !run.no_progress;
            let _reporter = shown.then(|| Reporter::start(scope, console, &watch, None));
            pool.install(|| shards.check(&watch))
        })?;
    }
    carry_out(&plan, mode, &out, run, console)
}
