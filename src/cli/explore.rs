//! `terrane explore`.

use std::env;
use std::path::PathBuf;

use etcetera::{BaseStrategy, choose_base_strategy};
use serde_json::json;

use crate::cli::args::{ExploreArguments, WorldArguments};
use crate::cli::console::Console;
use crate::error::Error;
use crate::explore::{Given, Options, Server};
use crate::export::Bytes;

/// Name of this program's folder in the user's cache folder.
const CACHE: &str = "terrane";

/// Smallest memory limit in bytes: the land of a single view.
const LEAST_REMEMBERED: u64 = 20_000_000;

/// Pixels across which the page shows the place that it begins with.
const VIEW_PX: f64 = 900.0;

/// Shows a world in a browser until it is interrupted.
pub(super) fn run(arguments: ExploreArguments, console: &Console) -> Result<(), Error> {
    let ExploreArguments { world, place, port, open, cache, cache_limit, memory_limit, threads } = arguments;
    if world.preset == "-" {
        return Err(Error::Option {
            message: "the explorer reads the preset again when it has changed, which standard input does not".into(),
            hint: "give a file, or the name of a built-in preset".into(),
        });
    }
    if memory_limit < LEAST_REMEMBERED {
        return Err(Error::Option {
            message: format!("--memory-limit {memory_limit}: expected {} or more", Bytes(LEAST_REMEMBERED)),
            hint: "with less, nothing is drawn without making its land again and again".into(),
        });
    }
    let view = if place.is_given() {
        let read = world.sources()?.read_all()?;
        let located = place.located(&read, world.seed, console)?;
        let [west, south, east, north] = located.bounds_m(read.tile_cells, read.spacing_m)?;
        let pixel_m = (east - west).max(north - south) / VIEW_PX;
        Some(([west.midpoint(east), south.midpoint(north)], pixel_m))
    } else {
        None
    };
    let WorldArguments { preset, seed, set } = world;
    let program = env::current_exe().map_err(Error::io("this program"))?;
    let options = Options {
        given: Given { preset, seed, set },
        view,
        port,
        cache: (cache_limit > 0).then(|| cache.or_else(default_cache)).flatten(),
        cached_bytes: cache_limit,
        remembered_bytes: memory_limit,
        program,
        threads: threads.count(),
    };
    let server = Server::bind(options, &console.stop)?;
    let url = server.url();
    console.message(json!({ "type": "serving", "url": url }), &format!("{url}\nCtrl-C ends\n"))?;
    if open && let Err(error) = open::that_detached(&url) {
        console.warnings(&[format!("no browser could be opened: {error}")]);
    }
    match server.serve() {
        // An interrupt is the normal end of this command.
        Err(Error::Interrupted) => Ok(()),
        served => served,
    }
}

/// Returns this program's folder in the user's cache folder, if there is one.
fn default_cache() -> Option<PathBuf> {
    choose_base_strategy().ok().map(|strategy| strategy.cache_dir().join(CACHE))
}
