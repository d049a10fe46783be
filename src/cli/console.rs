//! Output of the command: text or JSON lines on standard output, errors and progress on standard error.

use std::io::{self, ErrorKind, Write};
use std::path::PathBuf;

use serde_json::{Value, json};

use crate::error::Error;
use crate::export::{Bytes, Limit};

/// The two streams of the command.
pub(super) struct Console {
    json: bool,
}

impl Console {
    pub fn new(json: bool) -> Console {
        Console { json }
    }

    /// True if messages are JSON objects, one a line.
    pub fn is_json(&self) -> bool {
        self.json
    }

    /// Prints text.
    pub fn text(text: &str) -> Result<(), Error> {
        Console::bytes(text.as_bytes())
    }

    /// Prints bytes. It is no error if the reader has closed the pipe.
    pub fn bytes(bytes: &[u8]) -> Result<(), Error> {
        let mut stdout = io::stdout().lock();
        match stdout.write_all(bytes).and_then(|()| stdout.flush()) {
            Err(error) if error.kind() != ErrorKind::BrokenPipe => {
                Err(Error::Io { path: PathBuf::from("standard output"), source: error })
            }
            _ => Ok(()),
        }
    }

    /// Prints a message: as the JSON object with `--json`, otherwise as the text.
    pub fn message(&self, object: Value, text: &str) -> Result<(), Error> {
        if self.json { Console::text(&format!("{object}\n")) } else { Console::text(text) }
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
            if self.json {
                _ = Console::text(&format!("{}\n", json!({ "type": "warning", "message": sentence })));
            }
        }
    }

    /// Prints an error, with its hint at a remedy if it has one.
    pub fn error(&self, error: &Error) {
        let hint = error.hint().map_or(String::new(), |hint| format!("\nhint: {hint}"));
        // A closed standard error is ignored: there is nowhere else to report it.
        _ = writeln!(io::stderr(), "error: {error}{hint}");
        if self.json {
            let object = json!({
                "type": "error", "message": error.to_string(), "hint": error.hint(), "exit_code": error.exit_code(),
            });
            _ = Console::text(&format!("{object}\n"));
        }
    }
}
