//! `terrane registry`.

use serde_json::{Value, json};

use crate::area::TileId;
use crate::cli::args::{RegistryArguments, Started};
use crate::cli::console::Console;
use crate::error::Error;
use crate::export;
use crate::registry::{FileRow, Registry, Start, TileRow};
use crate::tile::TilePart;

/// Bytes of text that are gathered before they are printed: a whole registry may be larger than memory.
const PRINTED_BYTES: usize = 1 << 16;

/// Lists the registry of a folder, as a table or as JSON lines.
pub(super) fn run(arguments: &RegistryArguments, console: &Console) -> Result<(), Error> {
    let registry = export::registry(&arguments.folder)?;
    let mut printer = Printer { console, text: String::new() };
    if arguments.files {
        list_files(&registry, arguments, &mut printer)?;
    } else {
        list_tiles(&registry, arguments, &mut printer)?;
    }
    console.text(&printer.text)
}

/// Buffer of text that is printed part by part.
struct Printer<'a> {
    console: &'a Console,
    text: String,
}

impl Printer<'_> {
    fn add(&mut self, text: &str) -> Result<(), Error> {
        self.text.push_str(text);
        if self.text.len() < PRINTED_BYTES { Ok(()) } else { self.console.text(&std::mem::take(&mut self.text)) }
    }
}

fn list_tiles(registry: &Registry, arguments: &RegistryArguments, printer: &mut Printer<'_>) -> Result<(), Error> {
    if !printer.console.is_json() {
        printer.add(&line(["x", "y", "river from", "road from", "lines", "heights", "blend", "files", "state"]))?;
    }
    let mut print = |row: TileRow| {
        let is_meant = match arguments.start {
            None => true,
            Some(Started::River) => row.river.is_some(),
            Some(Started::Road) => row.road.is_some(),
        };
        match (is_meant, printer.console.is_json()) {
            (false, _) => Ok(()),
            (true, true) => printer.add(&format!("{}\n", object(&row))),
            (true, false) => printer.add(&table_line(&row)),
        }
    };
    match arguments.tile {
        Some(tile) => registry.row(tile)?.map_or(Ok(()), print),
        None => registry.for_each(&mut print),
    }
}

fn list_files(registry: &Registry, arguments: &RegistryArguments, printer: &mut Printer<'_>) -> Result<(), Error> {
    registry.for_each_file(|file| {
        let is_meant = arguments.export.as_ref().is_none_or(|export| *export == file.export)
            && arguments.tile.is_none_or(|tile| file.tile == Some(tile));
        if !is_meant {
            return Ok(());
        }
        let FileRow { path, export, tile, bytes, blake3 } = file;
        if printer.console.is_json() {
            let tile = tile.map(|tile| [tile.x, tile.y]);
            let object = json!({
                "type": "file", "path": path, "export": export, "tile": tile, "bytes": bytes, "blake3": blake3.to_hex().as_str(),
            });
            return printer.add(&format!("{object}\n"));
        }
        let tile = tile.map_or("region".to_owned(), |TileId { x, y }| format!("{x},{y}"));
        printer.add(&format!("{bytes:>12} {tile:>12}  {export:14} {}  {path}\n", &blake3.to_hex()[..12]))
    })
}

fn line([x, y, river, road, lines, heights, blend, files, state]: [&str; 9]) -> String {
    let line = format!("{x:>8} {y:>8}  {river:24} {road:24} {lines:>5} {heights:12} {blend:12} {files:>5}  {state}");
    format!("{}\n", line.trim_end())
}

fn table_line(row: &TileRow) -> String {
    let start = |start: Option<Start>| match start {
        Some(Start { node: (x, y), direction }) => format!("{x},{y} {}", direction.map_or("", |it| it.name())),
        None => "-".to_owned(),
    };
    // The first digits of the hash: enough to tell tiles apart.
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
        row.state.name(),
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
        "type": "tile", "x": row.tile.x, "y": row.tile.y, "state": row.state.name(), "stride": row.stride, "river": start(row.river), "road": start(row.road),
        "lines": row.lines, "hashes": hashes, "files": row.files, "record_bytes": row.record.as_ref().map(Vec::len),
    })
}
