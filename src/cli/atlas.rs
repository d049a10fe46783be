//! `terrane atlas`.

use std::path::Path;
use std::time::Instant;

use serde_json::json;

use crate::cli::args::{Around, AtlasArguments, AtlasFormat};
use crate::cli::console::Console;
use crate::cli::map::{captions, lacking, named, pixels_per_mm, texts};
use crate::cli::progress::watched;
use crate::error::Error;
use crate::export::{AtlasFiles, SMALLER};
use crate::find;
use crate::map::Chart;
use crate::map::atlas::Layout;
use crate::map::scale::Scale;
use crate::map::sheet::thousands;
use crate::watch::Watch;

/// Draws the atlas that the command line asks for.
pub(super) fn run(arguments: &AtlasArguments, console: &Console) -> Result<(), Error> {
    let asked = &arguments.style;
    let style = asked.style()?;
    let sources = arguments.world.sources()?;
    let preset = sources.read_all()?;
    console.warnings(&preset.warnings(&sources));
    let seed = arguments.world.seed.unwrap_or(preset.seed);
    let [x, y] = match &arguments.middle {
        Around::Place(middle, _) => *middle,
        Around::Named(name, _) => find::named(preset.clone(), Some(seed), name, [0.0; 2])?.at_km,
    };
    let pixels_per_mm = pixels_per_mm(asked);
    let scale = Scale { metres_per_pixel: arguments.scale / 1000.0 / pixels_per_mm, pixels_per_mm };
    let [long, short] = arguments.paper;
    let paper = if arguments.portrait { [short, long] } else { [long, short] };
    // Numbers beyond u32 are clamped: the atlas refuses such large ones anyway.
    let [columns, rows] =
        [arguments.sheets.0, arguments.sheets.1].map(|count| u32::try_from(count).unwrap_or(u32::MAX));
    let middle_m = [x, y].map(|km| km * 1000.0);
    let name = || named(sources.name(), seed, middle_m, &format!("{columns}x{rows}"), scale, &asked.style);
    let folder = arguments.out.clone().unwrap_or_else(|| Path::new("out").join(format!("{}-atlas", name())));
    let place = format!(
        "--sheets {columns}x{rows} --middle={x},{y} --scale 1:{} --paper {}x{} --overlap {}",
        arguments.scale, paper[0], paper[1], arguments.overlap
    );
    let texts = texts("atlas", &arguments.world, asked, (sources.name(), seed), &place);
    let subtitle = format!("{}, seed {seed}, 1 : {}", sources.name(), thousands(scale.denominator()));
    let captions = captions(asked, &texts, subtitle)?;
    let layout = Layout::new(scale, [columns, rows], paper, arguments.overlap, middle_m, &captions.furniture)?;
    let [has_pictures, has_document] =
        [AtlasFormat::Png, AtlasFormat::Pdf].map(|format| arguments.format.contains(&format));
    let files = AtlasFiles::new(&folder, layout, has_pictures, has_document, asked.overwrite)?;
    let threads = asked.run.threads.count();
    let world = Chart::world(&preset, Some(seed))?;
    let memory_bytes = files.memory_bytes(&world, threads);
    if !console.may_begin("the atlas", memory_bytes, SMALLER, asked.run.dry_run)? {
        return Ok(());
    }
    let start = Instant::now();
    let write = |watch: &Watch| files.write(&preset, Some(seed), &style, &captions, &texts, watch);
    let written = watched(console, asked.run.threads, write)?;
    console.warnings(&lacking(&written.missing));
    let seconds = start.elapsed().as_secs_f64();
    let paths: Vec<String> = written.files.iter().map(|path| path.to_string_lossy().into_owned()).collect();
    let object = json!({
        "type": "done", "out": folder.to_string_lossy(), "files": paths, "names": written.names, "seconds": seconds,
    });
    let text = format!(
        "{}: {columns} x {rows} sheets of 1:{:.0} in {} files, {} names, {seconds:.2} s\n",
        folder.display(),
        arguments.scale,
        paths.len(),
        written.names
    );
    console.message(object, &text)
}
