//! `terrane find`.

use std::fmt::Write;

use serde_json::json;

use crate::cli::args::FindArguments;
use crate::cli::console::Console;
use crate::cli::{thread_count, thread_pool};
use crate::error::Error;
use crate::find::{Finder, Found, Query};

/// Finds what the command line asks for, and prints it as a table or as JSON lines.
pub(super) fn run(arguments: &FindArguments, console: &Console) -> Result<(), Error> {
    let queries: Vec<Query> = arguments.queries.iter().map(|text| text.parse()).collect::<Result<_, Error>>()?;
    let preset = arguments.sources()?.read_all()?;
    let mut finder = Finder::new(preset, arguments.seed)?;
    let pool = thread_pool(thread_count(arguments.threads))?;
    for (number, query) in queries.iter().enumerate() {
        let limit = arguments.limit as usize;
        let found = pool.install(|| finder.find(query, arguments.near, arguments.radius, limit))?;
        if console.is_json() {
            for found in &found {
                let values = found.values.iter().map(|(measure, value)| (measure.unit().to_owned(), json!(value)));
                let values: serde_json::Map<String, serde_json::Value> = values.collect();
                let object = json!({
                    "type": "found", "query": query.text, "id": found.id, "name": found.name, "at_km": found.at_km,
                    "distance_km": found.distance_km, "values": values, "bake": command(arguments, &finder, found),
                });
                console.message(object, "")?;
            }
            continue;
        }
        let mut text = if number == 0 { String::new() } else { "\n".to_owned() };
        let mut line = |text_line: String| writeln!(text, "{text_line}").expect("a String takes everything");
        if found.is_empty() {
            let [x, y] = arguments.near;
            line(format!("{}: nothing within {} km of {x},{y}", query.text, arguments.radius));
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
            let bake = command(arguments, &finder, found);
            line(format!("  {name:24} {:24} {place:>16} km, {far:>6} km off   {bake}", values.join(", ")));
        }
        Console::text(&text)?;
    }
    Ok(())
}

/// A number with as many digits as somebody reads.
fn rounded(value: f64) -> f64 {
    let step = if value.abs() >= 100.0 { 1.0 } else { 100.0 };
    (value * step).round() / step
}

/// The command that bakes what was found.
fn command(arguments: &FindArguments, finder: &Finder, found: &Found) -> String {
    let [x, y] = found.at_km.map(|km| (km * 100.0).round() / 100.0);
    let mut command = format!("terrane bake {}", arguments.preset);
    if arguments.seed.is_some() {
        write!(command, " --seed {}", finder.world().seed()).expect("a String takes everything");
    }
    for setting in &arguments.set {
        write!(command, " --set '{setting}'").expect("a String takes everything");
    }
    command + &format!(" --around={x},{y},{}", found.around_km)
}
