//! Signals that ask the command to end: Ctrl-C, SIGTERM and a terminal that closes.

use std::io::{self, Write};
use std::process;
#[cfg(unix)]
use std::sync::Arc;
use std::thread;
use std::time::Duration;

use crate::error::Error;
use crate::stop::Stop;

/// Time that the command has to end by itself. A thread that waits for a disk, a pipe or a terminal may never see the
/// request to stop, so the command is ended after that time.
const PATIENCE: Duration = Duration::from_millis(1800);

/// Installs the handlers: the first signal stops the work, a second one ends the command at once.
pub(super) fn listen(stop: Stop) {
    // A file over the size limit (SIGXFSZ) shall be an error of the write, not end the command without a message.
    #[cfg(unix)]
    {
        _ = signal_hook::flag::register(signal_hook::consts::SIGXFSZ, Arc::default());
    }
    // If the handler cannot be set, a signal still ends the program, but half-written files stay.
    _ = ctrlc::set_handler(move || {
        if stop.is_requested() {
            end();
        }
        stop.request();
        // If this thread cannot be started, a second signal still ends the command.
        _ = thread::Builder::new().spawn(|| {
            thread::sleep(PATIENCE);
            end();
        });
        // A closed standard error is ignored: there is nowhere else to report it.
        _ = writeln!(io::stderr(), "stopping");
    });
}

/// Ends the command at once. Half-written files stay, under temporary names by which the next bake removes them.
fn end() {
    process::exit(Error::Interrupted.exit_code().into());
}
