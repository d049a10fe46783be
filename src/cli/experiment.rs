//! `terrane experiment`.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::Instant;

use serde_json::json;

use crate::cli::args::{ExperimentArguments, StepSize, Switch};
use crate::cli::console::Console;
use crate::cli::thread_pool;
use crate::device::Device;
use crate::error::Error;
use crate::experiment::{self, Engine, ExperimentOptions, FILES, Report, Step};

/// Measures what the command line asks for.
pub(super) fn run(arguments: ExperimentArguments, console: &Console) -> Result<(), Error> {
    // Check all options before anything is measured.
    // `None` stands for the largest number of threads; smaller numbers are measured side by side with it.
    let threads = arguments.threads.iter().copied().max().unwrap_or(1);
    let fewer = |count: usize| (count < threads).then_some(count);
    let mut options = ExperimentOptions {
        sizes: arguments.sizes,
        agents: arguments.agents.into_iter().map(Switch::is_on).collect(),
        minutes: arguments.camera.minutes,
        speed_m_s: arguments.camera.speed,
        engines: engines(&arguments.device, &arguments.workgroup)?,
        layers: each_once(arguments.layers),
        steps: each_once(arguments.step.into_iter().map(step)),
        threads: each_once(arguments.threads.into_iter().map(fewer)),
        baseline: arguments.baseline.is_on(),
    };
    options.sizes.sort_unstable();
    // A size that is named twice is walked once.
    options.sizes.dedup();
    options.check()?;
    let out = arguments.out.unwrap_or_else(|| PathBuf::from("out/experiment"));
    let pool = thread_pool(threads)?;
    // Check that the folder can be written to: after the measurements it is too late to choose another.
    let is_new = !out.exists();
    prepare_folder(&out, arguments.overwrite)?;
    let result = measure(&options, threads, &pool, &out, console);
    if result.is_err() && is_new {
        // Removes the folder only if it is empty.
        _ = fs::remove_dir(&out);
    }
    result
}

fn step(size: StepSize) -> Step {
    match size {
        StepSize::All => Step::All,
        StepSize::One => Step::One,
    }
}

/// Returns the items in their order, without repetitions.
fn each_once<T: PartialEq>(named: impl IntoIterator<Item = T>) -> Vec<T> {
    let mut once = Vec::new();
    for one in named {
        if !once.contains(&one) {
            once.push(one);
        }
    }
    once
}

/// Returns the engines to measure for the named devices and group sides.
fn engines(devices: &[String], group_sides: &[u32]) -> Result<Vec<Engine>, Error> {
    let mut engines = Vec::new();
    for name in devices {
        match name.parse::<Device>()? {
            Device::Cpu => engines.push(Engine::Cpu),
            Device::Gpu => engines.extend(group_sides.iter().map(|group_side| Engine::Gpu { group_side: *group_side })),
            Device::Auto => {
                return Err(Error::Option {
                    message: "what is measured must be known: auto may be either device".into(),
                    hint: "give cpu, gpu, or cpu,gpu for both side by side".into(),
                });
            }
        }
    }
    Ok(each_once(engines))
}

fn measure(
    options: &ExperimentOptions,
    threads: usize,
    pool: &rayon::ThreadPool,
    out: &Path,
    console: &Console,
) -> Result<(), Error> {
    // The walks, the smallest tiles first.
    let mut walks = Vec::new();
    for &size in &options.sizes {
        let start = Instant::now();
        let walk = pool.install(|| experiment::walk(options, size, &console.stop))?;
        let expansions = walk.series.iter().map(|series| series.timings.len()).max().unwrap_or(0);
        // A closed standard error is ignored: there is nowhere else to report it.
        _ = writeln!(io::stderr(), "{size}x{size}: {expansions} expansions, {:.1} s", start.elapsed().as_secs_f64());
        walks.push(walk);
    }
    // The report of all walks.
    let report = Report::new(options, threads, &walks);
    experiment::write_files(out, &report, &walks)?;
    let object = json!({ "type": "done", "out": out.to_string_lossy(), "files": FILES, "report": report });
    console.message(object, &format!("{}\n{}: {}\n", report.to_text(), out.display(), FILES.join(", ")))
}

/// Makes the folder. Refuses a path that is no folder, a folder that cannot be written to, and one that holds an
/// experiment if `overwrite` is false.
fn prepare_folder(out: &Path, overwrite: bool) -> Result<(), Error> {
    let refuse = |message: &str, hint: &str| {
        Err(Error::Output { path: out.to_owned(), message: message.into(), hint: hint.into() })
    };
    if out.symlink_metadata().is_ok() && !out.is_dir() {
        return refuse("is a file, not a folder", "choose another folder with --out");
    }
    let is_empty = fs::read_dir(out).map_or(true, |mut entries| entries.next().is_none());
    if !is_empty && !overwrite {
        return refuse(
            "the folder is not empty",
            "choose another with --out, or replace the experiment in it with --overwrite",
        );
    }
    let writable = fs::create_dir_all(out).and_then(|()| tempfile::tempfile_in(out));
    match writable {
        Ok(_) => Ok(()),
        Err(error) => refuse(&format!("cannot be written to: {error}"), "choose another folder with --out"),
    }
}
