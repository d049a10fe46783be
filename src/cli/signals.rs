//! Interrupts and what else asks the command to end: Ctrl-C, SIGTERM and a terminal that closes.

use std::io::{self, Write};
use std::process;
#[cfg(unix)]
use std::sync::Arc;
use std::thread;
use std::time::Duration;

use crate::error::Error;
use crate::stop;

/// How long the command has to end by itself: what waits for a disk, a pipe or a terminal may never come to see that it should.
const PATIENCE: Duration = Duration::from_millis(1800);

/// Lets the first signal stop the work, and a second one end the command on the spot.
pub(super) fn listen() {
    // A file that may grow no more is an error of whoever writes to it, not the end of the command without a word.
    #[cfg(unix)]
    {
        _ = signal_hook::flag::register(signal_hook::consts::SIGXFSZ, Arc::default());
    }
    // Without a handler a signal still ends the program; it only leaves what was half-written.
    _ = ctrlc::set_handler(|| {
        if stop::is_requested() {
            end();
        }
        stop::request();
        // If it cannot be started, a second signal still ends the command.
        _ = thread::Builder::new().spawn(|| {
            thread::sleep(PATIENCE);
            end();
        });
        // When nobody listens there is nobody to tell.
        _ = writeln!(io::stderr(), "stopping");
    });
}

/// Ends the command with what it has half-written where it is, under names by which the next bake removes it.
fn end() {
    process::exit(Error::Interrupted.exit_code().into());
}
