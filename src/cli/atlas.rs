//! `terrane atlas`.

use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::Instant;

use serde_json::json;

use crate::cli::args::{AtlasArguments, AtlasFormat};
use crate::cli::bake::trouble;
use crate::cli::console::Console;
use crate::cli::map::{captions, furniture, lacking, named, pixels_per_mm, texts};
use crate::cli::progress::watched;
use crate::error::Error;
use crate::export::{AtlasFiles, SMALLER};
use crate::map::Chart;
use crate::map::atlas::Layout;
use crate::map::scale::Scale;
use crate::map::sheet::thousands;
use crate::watch::Watch;
use crate::world::World;

/// Draws the atlas that the command line asks for.
pub(super) fn run(arguments: &AtlasArguments, console: &Console) -> Result<(), Error> {
    let asked = &arguments.style;
    let style = asked.style()?;
    let sources = arguments.world.sources()?;
    let preset = sources.read_all()?;
    console.warnings(&preset.warnings(&sources));
    let seed = arguments.world.seed.unwrap_or(preset.seed);
    let place = arguments.place.located(&preset, Some(seed), console)?;
    let (middle_m, size_m) = if arguments.place.has_size() {
        let [west, south, east, north] = place.bounds_m(preset.tile_cells, preset.spacing_m)?;
        ([west.midpoint(east), south.midpoint(north)], Some([east - west, north - south]))
    } else {
        (place.middle_km().map(|km| km * 1000.0), None)
    };
    let pixels_per_mm = pixels_per_mm(asked);
    let scale = Scale { metres_per_pixel: arguments.scale / 1000.0 / pixels_per_mm, pixels_per_mm };
    let [long, short] = arguments.paper;
    let paper = if arguments.portrait { [short, long] } else { [long, short] };
    let furniture = furniture(asked)?;
    let layout = |sheets| Layout::new(scale, sheets, paper, arguments.overlap, middle_m, (&style, &furniture));
    let [columns, rows] = match (arguments.sheets, size_m) {
        (Some(_), Some(_)) => {
            return Err(Error::Option {
                message: "the size of the place and --sheets both say how many sheets there are".into(),
                hint: "leave out either".into(),
            });
        }
        (None, Some(size_m)) => layout([1, 1])?.covering(size_m),
        // Numbers beyond u32 are clamped: the atlas refuses such large ones anyway.
        (sheets, None) => <[u64; 2]>::from(sheets.unwrap_or((2, 2))).map(|count| count.try_into().unwrap_or(u32::MAX)),
    };
    let layout = layout([columns, rows])?;
    let name = || named(sources.name(), seed, middle_m, &format!("{columns}x{rows}"), scale, &asked.style);
    let folder = arguments.out.clone().unwrap_or_else(|| Path::new("out").join(format!("{}-atlas", name())));
    let [x, y] = middle_m.map(|metres| metres / 1000.0);
    let place = format!(
        "--sheets {columns}x{rows} --around={x},{y} --scale 1:{} --paper {}x{} --overlap {}",
        arguments.scale, paper[0], paper[1], arguments.overlap
    );
    let texts = texts("atlas", &arguments.world, asked, (sources.name(), seed), &place);
    let subtitle = format!("{}, seed {seed}, 1 : {}", sources.name(), thousands(scale.denominator()));
    let captions = captions(asked, furniture.clone(), &texts, subtitle)?;
    let [has_pictures, has_document] =
        [AtlasFormat::Png, AtlasFormat::Pdf].map(|format| arguments.format.contains(&format));
    let files = AtlasFiles::new(&folder, layout, has_pictures, has_document, asked.overwrite)?;
    let threads = asked.manner.run.threads.count();
    let world = Chart::world(&preset, Some(seed))?;
    style.check_for(&world)?;
    let memory_bytes = files.memory_bytes(&world, threads);
    if !console.may_begin("the atlas", memory_bytes, SMALLER, asked.manner.run.dry_run)? {
        return Ok(());
    }
    let start = Instant::now();
    let makers = Mutex::new(Vec::new());
    let maker = |world: &World| {
        let maker = asked.manner.device.maker(world, console)?;
        makers.lock().expect("no thread panics while it keeps a maker").push(Arc::clone(&maker));
        Ok(maker)
    };
    let write = |watch: &Watch| files.write(&world, maker, &style, &captions, &texts, watch);
    let written = watched(console, asked.manner.run.threads, write)?;
    for maker in makers.into_inner().expect("no thread panics while it keeps a maker") {
        console.warnings(&trouble(&*maker));
    }
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
