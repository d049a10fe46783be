//! Output of the command: text or JSON lines on standard output, errors and progress on standard error.

use std::io::{self, ErrorKind, Write};
use std::path::PathBuf;

use serde_json::{Value, json};

use crate::cli::args::MessageOptions;
use crate::error::Error;
use crate::export::{Bytes, Limit};
use crate::stop::Stop;
use crate::watch::Watch;

/// The two streams of the command, and the stop that a signal requests.
pub(super) struct Console {
    pub messages: MessageOptions,
    pub stop: Stop,
}

/// Prints text. It is no error if the reader has closed the pipe.
pub(super) fn print(text: &str) -> Result<(), Error> {
    let mut stdout = io::stdout().lock();
    match stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            Err(Error::Io { path: PathBuf::from("standard output"), source: error })
        }
        _ => Ok(()),
    }
}

impl Console {
    pub fn new(messages: MessageOptions) -> Console {
        Console { messages, stop: Stop::default() }
    }

    /// Creates a watch for work of the command.
    pub fn watch(&self) -> Watch {
        Watch::stopped_by(&self.stop)
    }

    /// True if messages are JSON objects, one a line.
    pub fn is_json(&self) -> bool {
        self.messages.json
    }

    /// True if progress is shown.
    pub fn shows_progress(&self) -> bool {
        !self.messages.quiet && !self.messages.no_progress
    }

    /// Prints text unless the command is quiet.
    pub fn text(&self, text: &str) -> Result<(), Error> {
        if self.messages.quiet { Ok(()) } else { print(text) }
    }

    /// Prints a message: as the JSON object with `--json`, otherwise as the text.
    pub fn message(&self, object: Value, text: &str) -> Result<(), Error> {
        if self.is_json() { self.text(&format!("{object}\n")) } else { self.text(text) }
    }

    /// Prints where the time of watched work went, if that is asked for.
    pub fn stages(&self, watch: &Watch) -> Result<(), Error> {
        let stages = watch.stages();
        let total: f64 = stages.iter().map(|(_, spent)| spent.as_secs_f64()).sum();
        stages.into_iter().filter(|_| self.messages.verbose).try_for_each(|(stage, spent)| {
            let seconds = spent.as_secs_f64();
            let share = 100.0 * seconds / total;
            let object = json!({ "type": "stage", "stage": stage, "seconds": seconds, "percent": share });
            self.message(object, &format!("{seconds:9.3} s {share:5.1} %  {stage}\n"))
        })
    }

    /// Refuses work that may take more memory than there is. A dry run prints the memory that the work may take.
    /// Returns true if the work is to be done: it is no dry run.
    pub fn may_begin(&self, what: &str, memory_bytes: u64, hint: &str, dry_run: bool) -> Result<bool, Error> {
        if dry_run {
            let object = json!({ "type": "plan", "memory_bytes": memory_bytes });
            self.message(object, &format!("memory   up to {}\n", Bytes(memory_bytes)))?;
        }
        Limit::check(what, memory_bytes, hint)?;
        Ok(!dry_run)
    }

    /// Prints warnings about input that is allowed but probably not meant.
    pub fn warnings(&self, sentences: &[String]) {
        for sentence in sentences {
            // A closed standard error is ignored: there is nowhere else to report it.
            _ = writeln!(io::stderr(), "warning: {sentence}");
            if self.is_json() {
                _ = print(&format!("{}\n", json!({ "type": "warning", "message": sentence })));
            }
        }
    }

    /// Prints an error, with its hint at a remedy if it has one.
    pub fn error(&self, error: &Error) {
        let hint = error.hint().map_or(String::new(), |hint| format!("\nhint: {hint}"));
        // A closed standard error is ignored: there is nowhere else to report it.
        _ = writeln!(io::stderr(), "error: {error}{hint}");
        if self.is_json() {
            let object = json!({
                "type": "error", "message": error.to_string(), "hint": error.hint(), "exit_code": error.exit_code(),
            });
            _ = print(&format!("{object}\n"));
        }
    }
}
