//! How far a bake is: a bar on a terminal, plain lines elsewhere, objects with `--json`.

use std::io::{self, IsTerminal, Write};
use std::sync::atomic::Ordering;
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread::{Scope, ScopedJoinHandle};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde_json::json;

use crate::bake::Watch;
use crate::cli::console::Console;

/// Between two lines where there is no bar.
const LINE_INTERVAL: Duration = Duration::from_secs(3);
/// Between two looks at the count for the bar.
const BAR_INTERVAL: Duration = Duration::from_millis(100);

/// Reports on a bake from a thread of its own until it is dropped.
pub(super) struct Progress<'scope> {
    stop: Option<Sender<()>>,
    thread: Option<ScopedJoinHandle<'scope, ()>>,
}

impl<'scope> Progress<'scope> {
    /// Begins to report.
    pub fn start<'env>(
        scope: &'scope Scope<'scope, 'env>,
        console: &'env Console,
        watch: &'env Watch,
        tiles: u64,
        cells_a_tile: u64,
    ) -> Progress<'scope> {
        let (stop, stopped) = channel();
        let thread = scope.spawn(move || {
            let bar = bar(console, tiles);
            let interval = if bar.is_some() { BAR_INTERVAL } else { LINE_INTERVAL };
            let start = Instant::now();
            while stopped.recv_timeout(interval) == Err(RecvTimeoutError::Timeout) {
                let done = watch.tiles.load(Ordering::Relaxed);
                let rate = (done * cells_a_tile) as f64 / start.elapsed().as_secs_f64() / 1e6;
                match &bar {
                    Some(bar) => {
                        bar.set_message(format!("{rate:.1} Mvertices/s"));
                        bar.set_position(done);
                    }
                    None => line(console, done, tiles, rate, start.elapsed()),
                }
            }
            if let Some(bar) = bar {
                bar.finish_and_clear();
            }
        });
        Progress { stop: Some(stop), thread: Some(thread) }
    }
}

impl Drop for Progress<'_> {
    fn drop(&mut self) {
        self.stop = None;
        if let Some(thread) = self.thread.take() {
            _ = thread.join();
        }
    }
}

/// The bar, where a terminal can show one.
fn bar(console: &Console, tiles: u64) -> Option<ProgressBar> {
    let set = |name: &str| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    let dumb = std::env::var_os("TERM").is_some_and(|term| term == "dumb");
    if console.is_json() || !io::stderr().is_terminal() || dumb || set("NO_COLOR") {
        return None;
    }
    let bar = ProgressBar::with_draw_target(Some(tiles), ProgressDrawTarget::stderr());
    let template = "{wide_bar} {pos}/{len} tiles  {msg}  {elapsed} elapsed, {eta} left";
    bar.set_style(ProgressStyle::with_template(template).expect("the template is well-formed"));
    Some(bar)
}

fn line(console: &Console, done: u64, tiles: u64, rate: f64, elapsed: Duration) {
    let share = done as f64 / tiles as f64;
    let seconds_left = (done > 0).then(|| elapsed.as_secs_f64() * (1.0 - share) / share);
    // A closed stream is no reason to stop the bake.
    if console.is_json() {
        let object = json!({
            "type": "progress", "percent": 100.0 * share, "tiles": done, "of_tiles": tiles,
            "mvertices_per_second": rate, "seconds_left": seconds_left,
        });
        _ = Console::text(&format!("{object}\n"));
    } else {
        let left = seconds_left.map_or(String::new(), |seconds| format!(", {seconds:.0} s left"));
        _ = writeln!(io::stderr(), "{done} of {tiles} tiles, {rate:.1} Mvertices/s{left}");
    }
}
