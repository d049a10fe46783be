//! Progress of a bake, a map or an atlas: a bar on a terminal, plain lines elsewhere, JSON objects with `--json`.

use std::io::{self, IsTerminal, Write};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread::{self, Scope, ScopedJoinHandle};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde_json::json;

use crate::cli::args::ThreadOptions;
use crate::cli::console::Console;
use crate::error::Error;
use crate::watch::{Progress, Watch};

/// Time between two progress lines, if there is no bar.
const LINE_INTERVAL: Duration = Duration::from_secs(3);
/// Time between two updates of the bar.
const BAR_INTERVAL: Duration = Duration::from_millis(100);

/// The tiles of a bake. For tiles the report also has the vertices per second.
#[derive(Clone, Copy)]
pub(super) struct Tiles {
    pub count: u64,
    /// Cells of each tile.
    pub cells: u64,
}

/// Reports the progress of long work, from its own thread, until the reporter is dropped.
pub(super) struct Reporter<'scope> {
    stop: Option<Sender<()>>,
    thread: Option<ScopedJoinHandle<'scope, ()>>,
}

impl<'scope> Reporter<'scope> {
    /// Begins to report if progress is shown; `tiles` is given for a bake.
    pub fn start<'env>(
        scope: &'scope Scope<'scope, 'env>,
        console: &'env Console,
        watch: &'env Watch,
        tiles: Option<Tiles>,
    ) -> Option<Reporter<'scope>> {
        let (stop, stopped) = channel();
        let report = move || {
            let bar = bar(console);
            let interval = if bar.is_some() { BAR_INTERVAL } else { LINE_INTERVAL };
            let mut last = None;
            while stopped.recv_timeout(interval) == Err(RecvTimeoutError::Timeout) {
                let Some(progress) = watch.progress() else { continue };
                if let Some(bar) = &bar {
                    show(bar, &progress, tiles);
                    continue;
                }
                // Print a line only if the stage or the count has changed.
                let told = Some((progress.stage, progress.done));
                if last != told {
                    last = told;
                    print(console, &progress, tiles);
                }
            }
            if let Some(bar) = bar {
                bar.finish_and_clear();
            }
        };
        // If the thread cannot be started, the work is done without reports.
        let thread = console.shows_progress().then(|| thread::Builder::new().spawn_scoped(scope, report).ok())?;
        Some(Reporter { stop: Some(stop), thread })
    }
}

/// Does work on the given threads, while its progress is shown. In the end it is told where the time went, if that is
/// asked for.
pub(super) fn watched<T: Send>(
    console: &Console,
    threads: ThreadOptions,
    work: impl FnOnce(&Watch) -> Result<T, Error> + Send,
) -> Result<T, Error> {
    let (watch, pool) = (console.watch(), threads.pool()?);
    let done = thread::scope(|scope| {
        let _reporter = Reporter::start(scope, console, &watch, None);
        pool.install(|| work(&watch))
    })?;
    console.stages(&watch)?;
    Ok(done)
}

impl Drop for Reporter<'_> {
    fn drop(&mut self) {
        self.stop = None;
        if let Some(thread) = self.thread.take() {
            _ = thread.join();
        }
    }
}

/// Returns the bar if standard error is a terminal that can show it.
fn bar(console: &Console) -> Option<ProgressBar> {
    let set = |name: &str| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    let dumb = std::env::var_os("TERM").is_some_and(|term| term == "dumb");
    if console.is_json() || !io::stderr().is_terminal() || dumb || set("NO_COLOR") {
        return None;
    }
    Some(ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr()))
}

fn show(bar: &ProgressBar, progress: &Progress, tiles: Option<Tiles>) {
    // A stage without a total has no length that a bar could show.
    let template =
        if progress.of.is_some() { "{wide_bar} {msg}, {elapsed} elapsed" } else { "{msg}, {elapsed} elapsed" };
    bar.set_style(ProgressStyle::with_template(template).expect("the template is well-formed"));
    bar.set_length(progress.of.map_or(0, |(of, _)| of));
    bar.set_position(progress.done);
    bar.set_message(text(progress, tiles));
}

fn print(console: &Console, progress: &Progress, tiles: Option<Tiles>) {
    // A closed stream is no reason to stop the work.
    if console.is_json() {
        let mut object = json!({
            "type": "progress", "stage": progress.stage, "done": progress.done, "of": progress.of.map(|(of, _)| of),
            "percent": progress.share().map(|share| 100.0 * share), "seconds_left": progress.seconds_left(),
        });
        if let Some(tiles) = tiles {
            // The stages after the tiles count something else: then all tiles are done.
            let done = if counts_tiles(progress) { progress.done } else { tiles.count };
            object["tiles"] = done.into();
            object["of_tiles"] = tiles.count.into();
            object["mvertices_per_second"] = mvertices_per_second(progress, tiles).into();
        }
        _ = console.text(&format!("{object}\n"));
    } else {
        _ = writeln!(io::stderr(), "{}", text(progress, tiles));
    }
}

/// Describes the progress: "done of total unit", or the name of the stage if it has no total or nothing is done yet.
fn text(progress: &Progress, tiles: Option<Tiles>) -> String {
    let Some((of, unit)) = progress.of.filter(|_| progress.done > 0) else { return progress.stage.to_owned() };
    let rate = tiles.and_then(|tiles| mvertices_per_second(progress, tiles));
    let rate = rate.map_or(String::new(), |rate| format!(", {rate:.1} Mvertices/s"));
    let left = progress.seconds_left().map_or(String::new(), |seconds| format!(", {seconds:.0} s left"));
    format!("{} of {of} {unit}{rate}{left}", progress.done)
}

fn counts_tiles(progress: &Progress) -> bool {
    progress.of.is_some_and(|(_, unit)| unit == "tiles")
}

/// Millions of vertices baked per second, if the stage counts tiles.
fn mvertices_per_second(progress: &Progress, tiles: Tiles) -> Option<f64> {
    progress.rate.filter(|_| counts_tiles(progress)).map(|rate| rate * tiles.cells as f64 / 1e6)
}
