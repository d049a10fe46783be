//! The log of a bake's runs: when each run began, its task and device, and how it ended. It is the one file that
//! differs between equal bakes, so neither the manifest nor the registry lists it.

use std::fs::OpenOptions;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{Instant, SystemTime};

use serde::{Deserialize, Serialize};

use crate::error::Error;
use crate::file::{Operation, gate};
use crate::generator;

/// The file in the folder of the bake: one JSON object per line.
pub(crate) const PATH: &str = "runs.jsonl";

/// An event in the log of a bake.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "snake_case")]
pub enum Run {
    /// A run began. If no end follows, the run was killed.
    Begun {
        /// Seconds since the beginning of 1970.
        unix_s: u64,
        /// Task of the run: `new`, `replace`, `resume`, `add`, `extend` or `repair`.
        mode: String,
        /// The version of the program.
        version: String,
        /// Device that the run computed on.
        device: String,
        /// Number of threads.
        threads: usize,
    },
    /// The run ended.
    Ended {
        /// Seconds since the beginning of 1970.
        unix_s: u64,
        /// Outcome: `whole`, or the reason why the bake did not become whole.
        outcome: String,
        /// Duration of the run in seconds.
        seconds: f64,
        /// Number of tiles that this run made.
        tiles_made: u64,
        /// Number of tiles that an earlier run had made.
        tiles_known: u64,
    },
}

/// The log of a run under way.
#[derive(Debug)]
pub(crate) struct Log {
    path: PathBuf,
    start: Instant,
}

impl Log {
    /// Adds the beginning of a run to the log of a folder.
    pub fn begin(folder: &Path, mode: &str, threads: usize, device: String) -> Result<Log, Error> {
        let log = Log { path: folder.join(PATH), start: Instant::now() };
        log.add(&Run::Begun {
            unix_s: now(),
            mode: mode.to_owned(),
            version: generator::VERSION.to_owned(),
            device,
            threads,
        })?;
        Ok(log)
    }

    /// Adds the end of the run to the log.
    pub fn end(&self, outcome: &str, tiles_made: u64, tiles_known: u64) -> Result<(), Error> {
        let seconds = self.start.elapsed().as_secs_f64();
        self.add(&Run::Ended { unix_s: now(), outcome: outcome.to_owned(), seconds, tiles_made, tiles_known })
    }

    fn add(&self, run: &Run) -> Result<(), Error> {
        gate(Operation::Write, &self.path)?;
        let line = serde_json::to_string(run).expect("texts and finite numbers are JSON") + "\n";
        let open = OpenOptions::new().create(true).append(true).open(&self.path);
        open.and_then(|mut file| file.write_all(line.as_bytes())).map_err(Error::io(&self.path))
    }
}

/// Reads the log of the bake in a folder. Lines that cannot be read are left out.
pub fn runs(folder: &Path) -> Vec<Run> {
    let text = std::fs::read_to_string(folder.join(PATH)).unwrap_or_default();
    text.lines().filter_map(|line| serde_json::from_str(line).ok()).collect()
}

fn now() -> u64 {
    SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).map_or(0, |since| since.as_secs())
}
