//! What the command says: text or JSON lines on standard output, errors and progress on standard error.

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

    /// Whether messages are JSON objects, one a line.
    pub fn is_json(&self) -> bool {
        self.json
    }

    /// Prints text.
    pub fn text(text: &str) -> Result<(), Error> {
        Console::bytes(text.as_bytes())
    }

    /// Prints bytes. A reader that has seen enough and has closed the pipe is no error.
    pub fn bytes(bytes: &[u8]) -> Result<(), Error> {
        let mut stdout = io::stdout().lock();
        match stdout.write_all(bytes).and_then(|()| stdout.flush()) {
            Err(error) if error.kind() != ErrorKind::BrokenPipe => {
                Err(Error::Io { path: PathBuf::from("standard output"), source: error })
            }
            _ => Ok(()),
        }
    }

    /// Prints a message: the JSON object, or else the text.
    pub fn message(&self, object: Value, text: &str) -> Result<(), Error> {
        if self.json { Console::text(&format!("{object}\n")) } else { Console::text(text) }
    }

    /// Refuses work that may take more memory than there is, and prints for a dry run what it may take; whether it is to be done.
    pub fn may_begin(&self, what: &str, memory_bytes: u64, hint: &str, dry_run: bool) -> Result<bool, Error> {
        if dry_run {
            let object = json!({ "type": "plan", "memory_bytes": memory_bytes });
            self.message(object, &format!("memory   up to {}\n", Bytes(memory_bytes)))?;
        }
        Limit::check(what, memory_bytes, hint)?;
        Ok(!dry_run)
    }

    /// Prints what is allowed and probably not meant.
    pub fn warnings(&self, sentences: &[String]) {
        for sentence in sentences {
            // When nobody listens there is nobody to tell.
            _ = writeln!(io::stderr(), "warning: {sentence}");
            if self.json {
                _ = Console::text(&format!("{}\n", json!({ "type": "warning", "message": sentence })));
            }
        }
    }

    /// Prints an error, with what would do instead.
    pub fn error(&self, error: &Error) {
        let hint = error.hint().map_or(String::new(), |hint| format!("\nhint: {hint}"));
        // When nobody listens there is nobody to tell.
        _ = writeln!(io::stderr(), "error: {error}{hint}");
        if self.json {
            let object = json!({
                "type": "error", "message": error.to_string(), "hint": error.hint(), "exit_code": error.exit_code(),
            });
            _ = Console::text(&format!("{object}\n"));
        }
    }
}
