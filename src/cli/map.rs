//! `terrane map`.

use std::fs;
use std::io::BufWriter;
use std::path::{Path, PathBuf};
use std::time::Instant;

use serde_json::json;

use crate::area::{Area, TileId};
use crate::cli::args::{MapArguments, sources};
use crate::cli::console::Console;
use crate::cli::{thread_count, thread_pool};
use crate::error::Error;
use crate::map::Chart;
use crate::map::scale::Scale;
use crate::map::style::Style;
use crate::preset::Preset;
use crate::recipe::source::Sources;

/// Millimetres of an inch.
const INCH_MM: f64 = 25.4;

/// Draws what the command line asks for.
pub(super) fn run(arguments: &MapArguments, console: &Console) -> Result<(), Error> {
    let style = style(arguments)?;
    let sources = sources(&arguments.preset, &arguments.set)?;
    let preset = sources.read_all()?;
    let bounds_m = bounds_m(arguments, &preset)?;
    let scale = scale(arguments, bounds_m)?;
    let out = arguments.out.clone().unwrap_or_else(|| Path::new("out").join(format!("{}.png", sources.name())));
    let start = Instant::now();
    let pool = thread_pool(thread_count(arguments.threads))?;
    let area = scale.pixels_of(bounds_m);
    pool.install(|| draw(&out, &Chart::new(&preset, arguments.seed, style, scale)?, area))?;
    let seconds = start.elapsed().as_secs_f64();
    let object = json!({
        "type": "done", "out": out.to_string_lossy(), "width": area.width(), "height": area.height(),
        "metres_per_pixel": scale.metres_per_pixel, "scale": scale.denominator(), "seconds": seconds,
    });
    let text = format!(
        "{}: {} x {} pixels, 1:{:.0} at {} dpi, {seconds:.2} s\n",
        out.display(),
        area.width(),
        area.height(),
        scale.denominator(),
        arguments.dpi,
    );
    console.message(object, &text)
}

/// The style with all that the options set in it.
fn style(arguments: &MapArguments) -> Result<Style, Error> {
    let mut sources: Sources<Style> = Sources::load(&arguments.style)?;
    for setting in &arguments.style_set {
        sources.set("--style-set", setting)?;
    }
    sources.read_all()
}

/// What the map shows: metres east and north of the origin, west, south, east and north.
fn bounds_m(arguments: &MapArguments, preset: &Preset) -> Result<[f64; 4], Error> {
    let around = arguments.around.map(|[x, y, side]| [x - side / 2.0, y - side / 2.0, x + side / 2.0, y + side / 2.0]);
    if let Some(bounds) = arguments.bounds.or(around) {
        let [west, south, east, north] = bounds;
        if west >= east || south >= north {
            return Err(Error::Region {
                message: format!("from {west} to {east} km east and from {south} to {north} km north there is nothing"),
                hint: "give west, south, east and north, such as --bounds=-10,-10,10,10".into(),
            });
        }
        return Ok(bounds.map(|km| km * 1000.0));
    }
    let TileId { x, y } = arguments.at.unwrap_or(TileId { x: 0, y: 0 });
    let (cols, rows) = arguments.size.unwrap_or((8, 8));
    let tile_m = f64::from(preset.tile_cells) * preset.spacing_m;
    let [x, y, cols, rows] = [x as f64, y as f64, cols as f64, rows as f64];
    Ok([x, -(y + rows), x + cols, -y].map(|tiles| tiles * tile_m))
}

fn scale(arguments: &MapArguments, [west, _, east, _]: [f64; 4]) -> Result<Scale, Error> {
    let pixels_per_mm = arguments.dpi / INCH_MM;
    let metres_per_pixel = match (arguments.scale, arguments.metres_per_pixel) {
        (Some(denominator), _) => denominator / 1000.0 / pixels_per_mm,
        (None, Some(metres)) => metres,
        (None, None) => (east - west) / f64::from(arguments.width.unwrap_or(2048)),
    };
    Ok(Scale { metres_per_pixel, pixels_per_mm })
}

fn draw(out: &PathBuf, chart: &Chart, area: Area) -> Result<(), Error> {
    let io = |source: std::io::Error| Error::Io { path: out.clone(), source };
    if let Some(folder) = out.parent() {
        fs::create_dir_all(folder).map_err(io)?;
    }
    let file = fs::File::create(out).map_err(io)?;
    let mut encoder = png::Encoder::new(BufWriter::new(file), area.width() as u32, area.height() as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Fast);
    let dots = (chart.scale().pixels_per_mm * 1000.0).round() as u32;
    encoder.set_pixel_dims(Some(png::PixelDimensions { xppu: dots, yppu: dots, unit: png::Unit::Meter }));
    let refuse = |error: png::EncodingError| io(std::io::Error::other(error));
    let mut writer = encoder.write_header().map_err(refuse)?;
    let mut stream = writer.stream_writer().map_err(refuse)?;
    chart.picture(area).strips(|strip| std::io::Write::write_all(&mut stream, strip).map_err(io))?;
    stream.finish().map_err(refuse)
}
