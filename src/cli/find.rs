//! `terrane find`.

use std::fmt::Write;

use serde_json::json;

use crate::area::Stride;
use crate::cli::args::{FindArguments, WorldArguments};
use crate::cli::console::Console;
use crate::cli::progress::watched;
use crate::error::Error;
use crate::export::told_memory_bytes;
use crate::find::{Finder, Found, Query};
use crate::shell::quoted;
use crate::watch::Watch;

/// Bytes of the land that one thread searches at a time.
const PART_BYTES: u64 = 32 << 20;

/// Most vertices a side of the bake of something large.
const MOST_VERTICES: f64 = 2048.0;

/// Finds what the command line asks for, and prints it as a table or as JSON lines.
pub(super) fn run(arguments: &FindArguments, console: &Console) -> Result<(), Error> {
    let queries = Query::parse_all(&arguments.queries)?;
    let sources = arguments.world.sources()?;
    let preset = sources.read_all()?;
    console.warnings(&preset.warnings(&sources));
    let mut finder = Finder::new(preset, arguments.world.seed)?;
    let threads = arguments.run.threads.count();
    // The world at full detail and the coarse world, and for each thread the land of one part of a block.
    let memory_bytes = told_memory_bytes(threads, threads as u64 * PART_BYTES, 2 * finder.world().memory_bytes(1));
    if !console.may_begin("the search", memory_bytes, "give fewer --threads", arguments.run.dry_run)? {
        return Ok(());
    }
    for (number, query) in queries.iter().enumerate() {
        let limit = arguments.limit as usize;
        let radius = arguments.radius.unwrap_or(query.thing.radius_km());
        let search = |watch: &Watch| finder.find(query, arguments.near, radius, limit, watch);
        let found = watched(console, arguments.run.threads, search)?;
        if console.is_json() {
            for found in &found {
                // Round to 6 decimals: millimetres for places in kilometres, and all significant digits of a value.
                let exact = |value: f64| (value * 1e6).round() / 1e6;
                let values =
                    found.values.iter().map(|(measure, value)| (measure.unit().to_owned(), json!(exact(*value))));
                let values: serde_json::Map<String, serde_json::Value> = values.collect();
                let (at_km, distance_km) = (found.at_km.map(exact), exact(found.distance_km));
                let object = json!({
                    "type": "found", "query": query.text, "id": found.id, "name": found.name, "at_km": at_km,
                    "distance_km": distance_km, "values": values, "bake": command(arguments, &finder, query.thing.is_large(), found),
                });
                console.message(object, "")?;
            }
            continue;
        }
        let mut text = if number == 0 { String::new() } else { "\n".to_owned() };
        let mut line = |text_line: String| writeln!(text, "{text_line}").expect("a String takes everything");
        if found.is_empty() {
            let [x, y] = arguments.near;
            line(format!("{}: nothing within {} km of {x},{y}", query.text, radius));
        } else {
            line(format!("{}:", query.text));
        }
        for found in &found {
            let name = found.name.as_deref().unwrap_or(&found.id);
            let values: Vec<String> =
                found.values.iter().map(|(measure, value)| format!("{} {}", rounded(*value), measure.unit())).collect();
            let [x, y] = found.at_km.map(rounded);
            let place = format!("{x},{y}");
            let far = rounded(found.distance_km);
            let bake = command(arguments, &finder, query.thing.is_large(), found);
            line(format!("  {name:24} {:24} {place:>16} km, {far:>6} km off   {bake}", values.join(", ")));
        }
        console.text(&text)?;
    }
    Ok(())
}

/// Rounds a number for the table: to whole numbers from 100 on, else to hundredths.
fn rounded(value: f64) -> f64 {
    let step = if value.abs() >= 100.0 { 1.0 } else { 100.0 };
    (value * step).round() / step
}

/// Returns the command that bakes the surroundings of a found feature, by fewer vertices if it is large.
fn command(arguments: &FindArguments, finder: &Finder, is_large: bool, found: &Found) -> String {
    let [x, y] = found.at_km.map(|km| (km * 100.0).round() / 100.0);
    let WorldArguments { preset, seed, set } = &arguments.world;
    let mut command = format!("terrane bake {}", quoted(preset));
    if seed.is_some() {
        write!(command, " --seed {}", finder.world().seed()).expect("a String takes everything");
    }
    for setting in set {
        write!(command, " --set {}", quoted(setting)).expect("a String takes everything");
    }
    let stride = stride(finder.world().spacing_m(), found.around_km);
    if is_large && stride > 1 {
        write!(command, " --stride {stride}").expect("a String takes everything");
    }
    command + &format!(" --around={x},{y},{}", found.around_km)
}

/// Returns the least stride at which a bake of something so wide is no wider than [`MOST_VERTICES`].
fn stride(spacing_m: f64, around_km: f64) -> i64 {
    let is_enough = |stride: &Stride| around_km * 1000.0 <= MOST_VERTICES * spacing_m * stride.vertices() as f64;
    let strides = (0..).map_while(|shift| Stride::new(1 << shift));
    strides.clone().find(is_enough).or(strides.last()).unwrap_or(Stride::ONE).vertices()
}
