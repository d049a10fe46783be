//! `terrane map`.

use std::collections::BTreeSet;
use std::path::Path;
use std::time::Instant;

use serde_json::json;

use crate::area::Area;
use crate::cli::args::{MapArguments, sources};
use crate::cli::console::Console;
use crate::cli::{thread_count, thread_pool};
use crate::error::{Error, nearest};
use crate::export::{MapPicture, Texts};
use crate::map::Chart;
use crate::map::scale::Scale;
use crate::map::sheet::{Captions, Furniture, Sheet, thousands};
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
    let bounds_m = arguments.place.bounds_m(preset.tile_cells, preset.spacing_m)?;
    let scale = scale(arguments, bounds_m);
    let out = arguments.out.clone().unwrap_or_else(|| Path::new("out").join(format!("{}.png", sources.name())));
    let area = scale.pixels_of(bounds_m);
    check_size(area)?;
    let texts = texts(arguments, sources.name(), &preset, bounds_m, scale);
    let captions = captions(arguments, sources.name(), &preset, scale, &texts)?;
    let page = Sheet::area(area, scale, &captions.furniture);
    let file = MapPicture::new(&out, (page.width(), page.height()), arguments.overwrite)?;
    file.prepare()?;
    let start = Instant::now();
    let pool = thread_pool(thread_count(arguments.threads))?;
    pool.install(|| {
        let chart = Chart::new(&preset, arguments.seed, style, scale)?;
        file.write(&Sheet::new(&chart.picture(area), &captions), scale, &texts)
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
        arguments.dpi,
    );
    console.message(object, &text)
}

/// Pixels a side that a map has at most.
const MOST_PIXELS: i64 = 1_000_000;

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

/// The style with all that the options set in it.
fn style(arguments: &MapArguments) -> Result<Style, Error> {
    let mut sources: Sources<Style> = Sources::load(&arguments.style)?;
    for setting in &arguments.style_set {
        sources.set("--style-set", setting)?;
    }
    sources.read_all()
}

fn scale(arguments: &MapArguments, [west, _, east, _]: [f64; 4]) -> Scale {
    let pixels_per_mm = arguments.dpi / INCH_MM;
    let metres_per_pixel = match (arguments.scale, arguments.metres_per_pixel) {
        (Some(denominator), _) => denominator / 1000.0 / pixels_per_mm,
        (None, Some(metres)) => metres,
        (None, None) => (east - west) / f64::from(arguments.width.unwrap_or(2048)),
    };
    Scale { metres_per_pixel, pixels_per_mm }
}

/// What is written around the map.
fn captions(
    arguments: &MapArguments,
    name: &str,
    preset: &Preset,
    scale: Scale,
    texts: &Texts,
) -> Result<Captions, Error> {
    let mut furniture = BTreeSet::new();
    for part in arguments.furniture.split(',').map(str::trim) {
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
    let seed = arguments.seed.unwrap_or(preset.seed);
    let subtitle = format!("{name}, seed {seed}, 1 : {}", thousands(scale.denominator()));
    let recipe = format!("{}   {}", texts.software, texts.description);
    Ok(Captions { title: texts.title.clone(), subtitle, recipe, furniture })
}

/// What a map says of itself: how to draw it again.
fn texts(arguments: &MapArguments, name: &str, preset: &Preset, bounds_m: [f64; 4], scale: Scale) -> Texts {
    let [west, south, east, north] = bounds_m.map(|metres| metres / 1000.0);
    let seed = arguments.seed.unwrap_or(preset.seed);
    let options = |name: &str, settings: &[String]| {
        settings.iter().fold(String::new(), |text, setting| text + &format!(" {name} {}", quoted(setting)))
    };
    let settings = options("--set", &arguments.set);
    let style_settings = options("--style-set", &arguments.style_set);
    let title = arguments.title.as_ref().map_or_else(String::new, |title| format!(" --title {}", quoted(title)));
    let description = format!(
        "terrane map {} --seed {seed}{settings} --style {}{style_settings} --bounds={west},{south},{east},{north} \
         --metres-per-pixel {} --dpi {} --furniture {}{title}",
        quoted(&arguments.preset),
        quoted(&arguments.style),
        scale.metres_per_pixel,
        arguments.dpi,
        arguments.furniture
    );
    let title = arguments.title.clone().unwrap_or_else(|| {
        let mut letters = name.chars();
        letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
    });
    Texts { title, description, software: format!("terrane {}", env!("CARGO_PKG_VERSION")) }
}

/// A text as a shell takes it for one word.
fn quoted(text: &str) -> String {
    let is_plain = |byte: u8| byte.is_ascii_alphanumeric() || b"-_./,:=".contains(&byte);
    if !text.is_empty() && text.bytes().all(is_plain) {
        text.to_owned()
    } else {
        format!("'{}'", text.replace('\'', "'\\''"))
    }
}
