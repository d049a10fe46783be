//! `terrane registry`.

use std::fmt::Write;
use std::path::Path;

use serde_json::{Value, json};

use crate::cli::console::Console;
use crate::error::Error;
use crate::export;
use crate::registry::{Start, TileRow};
use crate::tile::TilePart;

/// How much text is printed at once: a registry may be longer than memory.
const PRINTED_BYTES: usize = 1 << 16;

/// Lists the registry of a folder, as a table or as JSON lines.
pub(super) fn run(folder: &Path, console: &Console) -> Result<(), Error> {
    let registry = export::registry(folder)?;
    let mut text = String::new();
    if !console.is_json() {
        text.push_str(&line(["x", "y", "river from", "road from", "lines", "heights", "blend", "files", "record"]));
    }
    registry.for_each(|row| {
        match console.is_json() {
            true => writeln!(text, "{}", object(&row)).expect("a String takes everything"),
            false => text.push_str(&table_line(&row)),
        }
        if text.len() < PRINTED_BYTES {
            return Ok(());
        }
        Console::text(&std::mem::take(&mut text))
    })?;
    Console::text(&text)
}

fn line([x, y, river, road, lines, heights, blend, files, record]: [&str; 9]) -> String {
    let line = format!("{x:>8} {y:>8}  {river:24} {road:24} {lines:>5} {heights:12} {blend:12} {files:>5}  {record}");
    format!("{}\n", line.trim_end())
}

fn table_line(row: &TileRow) -> String {
    let start = |start: Option<Start>| match start {
        Some(Start { node: (x, y), direction }) => format!("{x},{y} {}", direction.map_or("", |it| it.name())),
        None => "-".to_owned(),
    };
    // As many digits as tell tiles apart.
    let hash = |part| {
        let hash = row.digest.as_ref().and_then(|digest| digest.of(part));
        hash.map_or("-".to_owned(), |hash| hash.to_hex()[..12].to_owned())
    };
    line([
        &row.tile.x.to_string(),
        &row.tile.y.to_string(),
        start(row.river).trim_end(),
        start(row.road).trim_end(),
        &row.lines.len().to_string(),
        &hash(TilePart::Heights),
        &hash(TilePart::Blend),
        &row.files.len().to_string(),
        &row.record.as_ref().map_or("-".to_owned(), |record| format!("{} bytes", record.len())),
    ])
}

fn object(row: &TileRow) -> Value {
    let start = |start: Option<Start>| {
        start.map(|Start { node: (x, y), direction }| {
            json!({ "x": x, "y": y, "direction": direction.map(crate::agents::Direction::name) })
        })
    };
    let hashes = row.digest.map(|digest| {
        let hash = |(part, hash): (TilePart, Option<blake3::Hash>)| {
            (part.name().to_owned(), hash.map_or(Value::Null, |hash| hash.to_hex().to_string().into()))
        };
        Value::Object(digest.parts().map(hash).collect())
    });
    json!({
        "type": "tile", "x": row.tile.x, "y": row.tile.y, "river": start(row.river), "road": start(row.road),
        "lines": row.lines, "hashes": hashes, "files": row.files, "record_bytes": row.record.as_ref().map(Vec::len),
    })
}
