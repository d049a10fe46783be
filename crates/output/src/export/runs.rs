//! The log of a bake's runs: when each began, with what, and how it ended. The one file of a bake that no two bakes have the same,
//! so neither the manifest nor the registry knows of it.

use std::fs::OpenOptions;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{Instant, SystemTime};

use serde::{Deserialize, Serialize};

use crate::error::Error;
use crate::file::{Operation, gate};
use crate::generator;

/// The file in the folder of the bake: a JSON object a line.
pub(crate) const PATH: &str = "runs.jsonl";

/// What happened to a bake.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "snake_case")]
pub enum Run {
    /// A run began. Without an end after it, it was killed.
    Begun {
        /// Seconds since the beginning of 1970.
        unix_s: u64,
        /// What it was to do: `new`, `replace`, `resume`, `add`, `extend` or `repair`.
        mode: String,
        /// The version of the program.
        version: String,
        /// What it computed on.
        device: String,
        /// On how many threads.
        threads: usize,
    },
    /// It ended.
    Ended {
        /// Seconds since the beginning of 1970.
        unix_s: u64,
        /// How: `whole`, or what was in the way.
        outcome: String,
        /// How long it took.
        seconds: f64,
        /// Tiles that it made.
        tiles_made: u64,
        /// Tiles that an earlier one had made.
        tiles_known: u64,
    },
}

/// The log of a run under way.
#[derive(Debug)]
pub(super) struct Log {
    path: PathBuf,
    start: Instant,
}

impl Log {
    /// Notes that a run begins, in the log of a folder.
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

    /// Notes how it ended.
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

/// The runs of the bake in a folder, as far as its log can be read.
pub fn runs(folder: &Path) -> Vec<Run> {
    let text = std::fs::read_to_string(folder.join(PATH)).unwrap_or_default();
    text.lines().filter_map(|line| serde_json::from_str(line).ok()).collect()
}

fn now() -> u64 {
    SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).map_or(0, |since| since.as_secs())
}
