//! `terrane info`.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;
use std::time::{Duration, UNIX_EPOCH};

use humantime::format_rfc3339_seconds;
use serde_json::{Value, json};

use crate::area::TileId;
use crate::cli::console::Console;
use crate::error::Error;
use crate::export::{self, BakeState, Bytes, Contents, Run};

/// Largest number of missing files that are listed.
const SHOWN: usize = 20;

/// Prints what the folder of a bake holds.
pub(super) fn run(folder: &Path, console: &Console) -> Result<(), Error> {
    export::look(folder)?.iter().try_for_each(|contents| {
        let text = if console.is_json() { String::new() } else { text(contents) };
        console.message(object(folder, contents), &text)
    })
}

fn state_name(state: BakeState) -> &'static str {
    match state {
        BakeState::Whole => "whole",
        BakeState::UnderWay => "under way",
        BakeState::CutOff => "cut off",
    }
}

fn object(folder: &Path, contents: &Contents) -> Value {
    let Contents { manifest, state, tiles, tiles_of, missing, runs } = contents;
    let region = &manifest.region;
    let bytes: u64 = manifest.files.iter().map(|file| file.bytes).sum();
    json!({
        "type": "info", "folder": folder.to_string_lossy(), "state": state_name(*state), "generator": manifest.generator,
        "preset": manifest.preset_name, "seed": manifest.seed, "stride": manifest.stride, "spacing_m": manifest.spacing_m,
        "at": [region.at.x, region.at.y], "cols": region.cols, "rows": region.rows, "width": region.width,
        "height": region.height, "bounds_km": region.bounds_km, "min_m": manifest.height_range.min_m,
        "max_m": manifest.height_range.max_m, "sea_level_m": manifest.sea_level_m, "profile": manifest.profile,
        "exports": manifest.exports, "tiles": tiles, "tiles_of": tiles_of, "walk": manifest.walk, "shard": manifest.shard,
        "files": manifest.files.len(), "bytes": bytes, "missing": missing, "runs": runs,
    })
}

fn text(contents: &Contents) -> String {
    let Contents { manifest, state, tiles, tiles_of, missing, runs } = contents;
    let (region, heights) = (&manifest.region, &manifest.height_range);
    let mut text = String::new();
    let mut line = |what: &str, value: String| writeln!(text, "{what:9}{value}").expect("a String takes everything");
    line("state", format!("{}, {tiles} of {tiles_of} tiles", state_name(*state)));
    let (name, seed, spacing_m) = (&manifest.preset_name, manifest.seed, manifest.spacing_m);
    line("world", format!("{name}, seed {seed}, {spacing_m} m a vertex, of {}", manifest.generator));
    let [west, south, east, north] = region.bounds_km;
    line("ground", format!("from {west} to {east} km east and from {south} to {north} km north"));
    let (cols, rows, TileId { x, y }) = (region.cols, region.rows, region.at);
    line("region", format!("{cols} x {rows} tiles from {x},{y}, {} x {} vertices", region.width, region.height));
    if let Some(tour) = &manifest.walk {
        line("walk", tour.to_string());
    }
    if let Some(shard) = &manifest.shard {
        let TileId { x, y } = shard.at;
        line("shard", format!("{shard}, {} x {} tiles from {x},{y}", shard.cols, shard.rows));
    }
    let sea = manifest.sea_level_m.map_or(String::new(), |metres| format!(", the sea at {metres} m"));
    let [min_m, max_m] = heights.written_m();
    line("heights", format!("{min_m} to {max_m} m{sea}"));
    line("exports", manifest.exports.join(", "));
    let mut by_export: BTreeMap<&str, [u64; 2]> = BTreeMap::new();
    for file in &manifest.files {
        let [count, bytes] = by_export.entry(&file.export).or_default();
        *count += 1;
        *bytes += file.bytes;
    }
    for (export, [count, bytes]) in by_export {
        line("files", format!("{export}: {count}, {}", Bytes(bytes)));
    }
    for run in runs {
        let said = match run {
            Run::Begun { unix_s, mode, version, device, threads } => {
                format!("{} {mode}, terrane {version}, {device}, {threads} threads", date(*unix_s))
            }
            Run::Ended { unix_s, outcome, seconds, tiles_made, tiles_known } => {
                let at = date(*unix_s);
                format!("{at} {outcome}, {tiles_made} tiles made and {tiles_known} known, {seconds:.1} s")
            }
        };
        line("run", said);
    }
    missing.iter().take(SHOWN).for_each(|path| line("missing", path.clone()));
    if missing.len() > SHOWN {
        line("missing", format!("and {} more files", missing.len() - SHOWN));
    }
    text
}

/// Formats a Unix time in seconds as ISO 8601, in UTC. Its last year is 9999.
fn date(unix_s: u64) -> String {
    const LAST_S: u64 = 253_402_300_799;
    format_rfc3339_seconds(UNIX_EPOCH + Duration::from_secs(unix_s.min(LAST_S))).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_are_those_of_the_calendar() {
        assert_eq!(date(0), "1970-01-01T00:00:00Z");
        assert_eq!(date(951_782_399), "2000-02-28T23:59:59Z");
        assert_eq!(date(951_868_800), "2000-03-01T00:00:00Z");
        assert_eq!(date(1_795_651_245), "2026-11-26T00:00:45Z");
        assert_eq!(date(u64::MAX), "9999-12-31T23:59:59Z");
    }
}
