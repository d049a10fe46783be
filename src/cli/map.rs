//! `terrane map`.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::time::Instant;

use serde_json::json;

use crate::area::Area;
use crate::cli::args::{MapArguments, StyleArguments, WorldArguments};
use crate::cli::bake::trouble;
use crate::cli::console::Console;
use crate::cli::progress::watched;
use crate::error::{Error, nearest};
use crate::export::{Lettering, Manifest, MapPicture, SMALLER, Texts, shortest_that};
use crate::map::Chart;
use crate::map::scale::Scale;
use crate::map::sheet::{Captions, Cells, Furniture, Overlay, Sheet, thousands};
use crate::preset::Preset;
use crate::shell::quoted;
use crate::world::World;

/// Millimetres per inch.
const INCH_MM: f64 = 25.4;

/// Draws the map that the command line asks for.
pub(super) fn run(arguments: &MapArguments, console: &Console) -> Result<(), Error> {
    let asked = &arguments.style;
    let style = asked.style()?;
    let MapSubject { name, preset, seed, bounds_m } = MapSubject::of(arguments, console)?;
    let scale = scale(arguments, bounds_m);
    let out = arguments.out.clone().unwrap_or_else(|| default_file(&name, seed, bounds_m, scale, &asked.style));
    let bounds_m = on_pixels(bounds_m, scale, arguments);
    let area = scale.pixels_of(bounds_m);
    check_size(area)?;
    let place = place(arguments, bounds_m, scale);
    let texts = texts("map", &arguments.world, asked, (&name, seed), &place);
    let subtitle = format!("{name}, seed {seed}, 1 : {}", thousands(scale.denominator()));
    let captions = captions(asked, furniture(asked)?, &texts, subtitle)?;
    let most = Sheet::area(area, (&style, scale), &captions);
    let mut file = MapPicture::new(&out, (most.width(), most.height()), asked.overwrite)?;
    if let Some(lettering) = arguments.text {
        file = file.lettered(lettering)?;
    }
    let world = Chart::world(&preset, Some(seed))?;
    style.check_for(&world)?;
    let threads = asked.manner.run.threads.count();
    let memory_bytes = file.memory_bytes(&world, scale, (most.width(), most.height()), threads);
    if !console.may_begin("the map", memory_bytes, SMALLER, asked.manner.run.dry_run)? {
        return Ok(());
    }
    file.prepare()?;
    console.warnings(&file.warnings(most, scale));
    let start = Instant::now();
    let page = watched(console, asked.manner.run.threads, |watch| {
        let maker = |world: &World| asked.manner.device.maker(world, console);
        let chart = Chart::made_by(maker, &world, style, scale, &watch.clock)?;
        let picture = Sheet::picture(&chart, area, &captions.furniture, watch)?;
        let sheet = Sheet::new(&picture, &captions);
        console.warnings(&lacking(&sheet.missing_letters()));
        watch.begin("drawing", Some((sheet.page().height() as u64, "rows")));
        let written = file.write(&sheet, scale, &texts, watch);
        console.warnings(&trouble(chart.maker()));
        written.map(|()| sheet.page())
    })?;
    let seconds = start.elapsed().as_secs_f64();
    let object = json!({
        "type": "done", "out": out.to_string_lossy(), "width": page.width(), "height": page.height(),
        "metres_per_pixel": scale.metres_per_pixel, "scale": scale.denominator(), "seconds": seconds,
    });
    let text = format!(
        "{}: {} x {} pixels, 1:{:.0} at {} dpi, {seconds:.2} s\n",
        out.display(),
        page.width(),
        page.height(),
        scale.denominator(),
        asked.dpi,
    );
    console.message(object, &text)
}

/// Returns the default file of a map: a different one for each place, scale and style of a world.
fn default_file(name: &str, seed: u64, bounds_m: [f64; 4], scale: Scale, style: &str) -> PathBuf {
    let [west, south, east, north] = bounds_m;
    let size = format!("{}x{}km", in_km(east - west), in_km(north - south));
    let middle_m = [west.midpoint(east), south.midpoint(north)];
    Path::new("out").join(format!("{}.png", named(name, seed, middle_m, &size, scale, style)))
}

/// Names a map or an atlas after its world, middle, size, scale and style.
pub(super) fn named(name: &str, seed: u64, middle_m: [f64; 2], size: &str, scale: Scale, style: &str) -> String {
    let [x, y] = middle_m.map(in_km);
    // A user's own style is a path: take the name of the file.
    let style = Path::new(style).file_stem().unwrap_or_default().to_string_lossy();
    format!("{name}-seed{seed}-x{x}km-y{y}km-{size}-1to{:.0}-{style}", scale.denominator())
}

/// Formats metres as kilometres, to the metre, without trailing zeros.
fn in_km(metres: f64) -> String {
    let km = format!("{:.3}", metres / 1000.0);
    let short = km.trim_end_matches('0').trim_end_matches('.');
    if short == "-0" { "0".into() } else { short.into() }
}

/// The subject of a map: a world, and the part of it to draw, in metres.
struct MapSubject {
    name: String,
    preset: Preset,
    seed: u64,
    bounds_m: [f64; 4],
}

impl MapSubject {
    /// Reads the world of a preset or of the bake in a folder. By default a bake's own region is drawn.
    fn of(arguments: &MapArguments, console: &Console) -> Result<MapSubject, Error> {
        let MapArguments { world: asked, place, .. } = arguments;
        let source = &asked.preset;
        if !Path::new(source).is_dir() {
            let sources = asked.sources()?;
            let preset = sources.read_all()?;
            console.warnings(&preset.warnings(&sources));
            let seed = asked.seed.unwrap_or(preset.seed);
            let bounds_m =
                place.located(&preset, Some(seed), console)?.bounds_m(preset.tile_cells, preset.spacing_m)?;
            return Ok(MapSubject { name: sources.name().to_owned(), preset, seed, bounds_m });
        }
        if !asked.set.is_empty() || asked.seed.is_some() {
            return Err(Error::Option {
                message: format!("{source} holds a bake, whose world is what it is"),
                hint: "leave out --set and --seed, or name a preset".into(),
            });
        }
        let manifest = Manifest::read(Path::new(source))?;
        manifest.check_is_no_walk(Path::new(source))?;
        let Manifest { preset_name: name, preset, seed, region, .. } = manifest;
        let bounds_m = match place.is_given() {
            true => place.located(&preset, Some(seed), console)?.bounds_m(region.tile_cells, preset.spacing_m)?,
            false => region.bounds_km.map(|km| km * 1000.0),
        };
        Ok(MapSubject { name, preset, seed, bounds_m })
    }
}

/// Largest number of missing letters that a warning names one by one.
const MOST_NAMED: usize = 24;

/// Returns the warning about letters that no font has.
pub(super) fn lacking(letters: &BTreeSet<char>) -> Vec<String> {
    if letters.is_empty() {
        return Vec::new();
    }
    let named = |letter: &char| format!("{} (U+{:04X})", letter.escape_debug(), u32::from(*letter));
    let mut list = letters.iter().take(MOST_NAMED).map(named).collect::<Vec<_>>().join(", ");
    if letters.len() > MOST_NAMED {
        list = format!("{list} and {} more", letters.len() - MOST_NAMED);
    }
    vec![format!(
        "no font of the map has {list}: a box stands for each; --style-set labels.font='\"FILE\"' names a font file that has them"
    )]
}

/// Largest width and height of a map in pixels.
const MOST_PIXELS: i64 = 1_000_000;

/// Largest number of letters in a title.
const MOST_TITLE: usize = 500;

fn check_size(area: Area) -> Result<(), Error> {
    let [width, height] = [area.x1 - area.x0, area.y1 - area.y0];
    if (1..=MOST_PIXELS).contains(&width) && (1..=MOST_PIXELS).contains(&height) {
        return Ok(());
    }
    Err(Error::Option {
        message: format!("a map has 1 to {MOST_PIXELS} pixels a side, and this would have {width} x {height}"),
        hint: "give another --scale, --width or --metres-per-pixel".into(),
    })
}

fn scale(arguments: &MapArguments, [west, _, east, _]: [f64; 4]) -> Scale {
    let pixels_per_mm = pixels_per_mm(&arguments.style);
    let metres_per_pixel = match (arguments.scale, arguments.metres_per_pixel) {
        (Some(denominator), _) => denominator / 1000.0 / pixels_per_mm,
        (None, Some(metres)) => metres,
        (None, None) => (east - west) / f64::from(arguments.width.unwrap_or(2048)),
    };
    Scale { metres_per_pixel, pixels_per_mm }
}

/// Returns bounds whose western and eastern edges lie between pixels if the number of pixels is given: edges that halve a
/// pixel would be rounded to one pixel more or less.
fn on_pixels(bounds_m: [f64; 4], scale: Scale, arguments: &MapArguments) -> [f64; 4] {
    let [west, south, _, north] = bounds_m;
    let first = (west / scale.metres_per_pixel).round();
    let edge = |pixels: u32| (first + f64::from(pixels)) * scale.metres_per_pixel;
    arguments.width.map_or(bounds_m, |width| [edge(0), south, edge(width), north])
}

/// Returns the options that draw the same pixels at the same scale again, with as few digits as possible.
fn place(arguments: &MapArguments, bounds_m: [f64; 4], scale: Scale) -> String {
    let measure = match (arguments.scale, arguments.metres_per_pixel) {
        (Some(denominator), _) => format!("--scale 1:{denominator}"),
        (None, Some(metres)) => format!("--metres-per-pixel {metres}"),
        (None, None) => format!("--metres-per-pixel {}", scale.metres_per_pixel),
    };
    let area = scale.pixels_of(bounds_m);
    let lettering = match arguments.text {
        None => "",
        Some(Lettering::Text) => " --text text",
        Some(Lettering::Outlines) => " --text outlines",
    };
    let bounds =
        shortest_that(bounds_m.map(|metres| metres / 1000.0), |km| scale.pixels_of(km.map(|km| km * 1000.0)) == area);
    format!("--bounds={} {measure}{lettering}", bounds.join(","))
}

/// Pixels per millimetre of paper.
pub(super) fn pixels_per_mm(asked: &StyleArguments) -> f64 {
    asked.dpi / INCH_MM
}

/// Returns the furniture around a map.
pub(super) fn furniture(asked: &StyleArguments) -> Result<BTreeSet<Furniture>, Error> {
    let mut furniture = BTreeSet::new();
    for part in asked.furniture.split(',').map(str::trim) {
        match (part, Furniture::ALL.into_iter().find(|known| known.name() == part)) {
            ("none", _) => {}
            ("all", _) => furniture.extend(Furniture::ALL),
            (_, Some(known)) => _ = furniture.insert(known),
            (unknown, None) => {
                let names = Furniture::ALL.map(Furniture::name);
                let meant = nearest(unknown, names).map_or_else(String::new, |meant| format!("did you mean {meant}? "));
                return Err(Error::Option {
                    message: format!("nothing that stands around a map is called {unknown:?}"),
                    hint: format!("{meant}there are all, none, {}", names.join(", ")),
                });
            }
        }
    }
    Ok(furniture)
}

/// Returns the captions around a map.
pub(super) fn captions(
    asked: &StyleArguments,
    furniture: BTreeSet<Furniture>,
    texts: &Texts,
    subtitle: String,
) -> Result<Captions, Error> {
    let letters = texts.title.chars().count();
    if letters > MOST_TITLE {
        return Err(Error::Option {
            message: format!("a title of {letters} letters is more than any sheet has room for"),
            hint: format!("give at most {MOST_TITLE} with --title"),
        });
    }
    let recipe = format!("{}   {}", texts.software, texts.description);
    let (title, overlay) = (texts.title.clone(), asked.overlay);
    Ok(Captions { title, subtitle, recipe, furniture, overlay, neighbours: Default::default() })
}

/// Returns the texts that a map or an atlas carries about itself: the command that draws it again.
pub(super) fn texts(
    command: &str,
    WorldArguments { preset: source, set, .. }: &WorldArguments,
    asked: &StyleArguments,
    (name, seed): (&str, u64),
    place: &str,
) -> Texts {
    let options = |name: &str, settings: &[String]| {
        settings.iter().fold(String::new(), |text, setting| text + &format!(" {name} {}", quoted(setting)))
    };
    let settings = options("--set", set);
    let style_settings = options("--style-set", &asked.style_set);
    let title = asked.title.as_ref().map_or_else(String::new, |title| format!(" --title {}", quoted(title)));
    let overlay = asked.overlay.map_or_else(String::new, |Overlay { form, side_m }| {
        let form = if form == Cells::Squares { "squares" } else { "hexes" };
        format!(" --overlay {form}:{}", side_m / 1000.0)
    });
    let world = (name.to_owned(), seed);
    // A bake's folder already fixes the seed.
    let seed = if Path::new(source).is_dir() { String::new() } else { format!(" --seed {seed}") };
    let description = format!(
        "terrane {command} {}{seed}{settings} --style {}{style_settings} {place} --dpi {} --furniture {}{title}{overlay}",
        quoted(source),
        quoted(&asked.style),
        asked.dpi,
        asked.furniture
    );
    let title = asked.title.clone().unwrap_or_else(|| {
        let mut letters = name.chars();
        letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
    });
    Texts { title, description, software: format!("terrane {}", env!("CARGO_PKG_VERSION")), world }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_place_scale_or_style_is_another_file() {
        let scale = |metres_per_pixel| Scale { metres_per_pixel, pixels_per_mm: 4.0 };
        let file = |seed, bounds_m, scale, style| {
            default_file("alps", seed, bounds_m, scale, style).to_string_lossy().into_owned()
        };
        let bounds_m = [-1000.0, 500.0, 5000.0, 4500.0];
        let first = file(1, bounds_m, scale(6.25), "atlas");
        assert_eq!(first, Path::new("out/alps-seed1-x2km-y2.5km-6x4km-1to25000-atlas.png").to_string_lossy());
        let others = [
            file(2, bounds_m, scale(6.25), "atlas"),
            file(1, [-1001.0, 500.0, 5000.0, 4500.0], scale(6.25), "atlas"),
            file(1, bounds_m, scale(12.5), "atlas"),
            file(1, bounds_m, scale(6.25), "styles/own.toml"),
        ];
        assert!(others.iter().all(|other| *other != first), "{others:?}");
        assert!(others[3].ends_with("-own.png"), "{}", others[3]);
        assert_eq!(in_km(-0.2), "0");
    }
}
