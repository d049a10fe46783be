//! `terrane experiment`.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::Instant;

use serde_json::json;

use crate::cli::args::{ExperimentArguments, Switch};
use crate::cli::console::Console;
use crate::cli::{thread_count, thread_pool};
use crate::device::Device;
use crate::error::Error;
use crate::experiment::{self, Engine, FILES, Options, Report};
use crate::stop;

/// Measures what the command line asks for.
pub(super) fn run(arguments: ExperimentArguments, console: &Console) -> Result<(), Error> {
    // What is asked for, checked before anything is measured.
    let mut options = Options {
        sizes: arguments.sizes,
        agents: arguments.agents.into_iter().map(Switch::is_on).collect(),
        minutes: arguments.minutes,
        speed_m_s: arguments.speed,
        engines: engines(&arguments.device, &arguments.workgroup)?,
        baseline: arguments.baseline.is_on(),
    };
    options.sizes.sort_unstable();
    // A size that is named twice is walked once.
    options.sizes.dedup();
    options.check()?;
    let out = arguments.out.unwrap_or_else(|| PathBuf::from("out/experiment"));
    let threads = thread_count(arguments.threads);
    let pool = thread_pool(threads)?;
    // A folder that takes files, since it is too late to look for another when all is measured.
    let is_new = !out.exists();
    prepare_folder(&out, arguments.overwrite)?;
    let result = stop::catch(|| measure(&options, threads, &pool, &out, console));
    if result.is_err() && is_new {
        // Only an empty one can be removed so.
        _ = fs::remove_dir(&out);
    }
    result
}

/// What is measured of what the command names.
fn engines(devices: &[String], group_sides: &[u32]) -> Result<Vec<Engine>, Error> {
    let mut engines = Vec::new();
    // One that is named twice is measured once.
    let mut add = |engine| {
        if !engines.contains(&engine) {
            engines.push(engine);
        }
    };
    for name in devices {
        match name.parse::<Device>()? {
            Device::Cpu => add(Engine::Cpu),
            Device::Gpu => group_sides.iter().for_each(|group_side| add(Engine::Gpu { group_side: *group_side })),
            Device::Auto => {
                return Err(Error::Option {
                    message: "what is measured must be known: auto may be either device".into(),
                    hint: "give cpu, gpu, or cpu,gpu for both side by side".into(),
                });
            }
        }
    }
    Ok(engines)
}

fn measure(
    options: &Options,
    threads: usize,
    pool: &rayon::ThreadPool,
    out: &Path,
    console: &Console,
) -> Result<(), Error> {
    // The walks, the smallest tiles first.
    let mut walks = Vec::new();
    for &size in &options.sizes {
        let start = Instant::now();
        let walk = pool.install(|| experiment::walk(options, size))?;
        let expansions = walk.series.iter().map(|series| series.timings.len()).max().unwrap_or(0);
        // When nobody listens there is nobody to tell.
        _ = writeln!(io::stderr(), "{size}x{size}: {expansions} expansions, {:.1} s", start.elapsed().as_secs_f64());
        walks.push(walk);
    }
    // What they come to.
    let report = Report::new(options, threads, &walks);
    experiment::write_files(out, &report, &walks)?;
    let object = json!({ "type": "done", "out": out.to_string_lossy(), "files": FILES, "report": report });
    console.message(object, &format!("{}\n{}: {}\n", report.to_text(), out.display(), FILES.join(", ")))
}

/// Makes the folder; refuses one that is none, that takes no files, or that holds an experiment which is to stay.
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
