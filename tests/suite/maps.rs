//! Maps: the same pixels and names whatever is drawn at once, in every style, and what a user gets wrong.

use std::collections::BTreeSet;
use std::fmt::Write;
use std::fs;
use std::path::Path;
use std::sync::Arc;

use terrane::area::Area;
use terrane::clock::Clock;
use terrane::find;
use terrane::map::Chart;
use terrane::map::scale::Scale;
use terrane::map::style::{STYLES, Style};
use terrane::preset::{Preset, summary};
use terrane::recipe::source::RecipeSources;
use terrane::stop::Stopped;
use terrane::world::World;

/// Returns the world of alps, seed 3, without its country: the maps must show what lies there.
fn alps() -> Arc<World> {
    let preset = Preset { country: None, ..Preset::load("alps").unwrap().1 };
    Chart::world(&preset, Some(3)).unwrap()
}

#[test]
fn a_map_drawn_at_once_in_strips_and_in_sheets_is_the_same() {
    // Land with many names, which meet at the borders of sheets, in a style whose names know of no more than they must;
    // and a village where sheets meet.
    let names = "extends = \"atlas\"\n[roads]\ndraw = false";
    let far = (names, Scale { metres_per_pixel: 100.0, pixels_per_mm: 1.0 }, Area::new(-200, -300, 360, 300));
    let near = (
        "extends = \"topographic\"",
        Scale { metres_per_pixel: 10.0, pixels_per_mm: 2.0 },
        Area::new(560, 600, 260, 220),
    );
    let (_, preset) = Preset::load("alps").unwrap();
    for (style, scale, area) in [far, near] {
        let style = RecipeSources::<Style>::parse("style.toml", style).unwrap().read_all().unwrap();
        let chart = Chart::new(&preset, Some(3), style, scale).unwrap();
        check_parts(&chart, area);
    }
}

fn check_parts(chart: &Arc<Chart>, area: Area) {
    let whole = chart.picture(area, &Clock::default()).unwrap();
    let all = whole.pixels(area, &Clock::default()).unwrap();
    let mut strips = Vec::new();
    let mut add = |strip: &[u8]| {
        strips.extend_from_slice(strip);
        Ok::<_, Stopped>(())
    };
    whole.strips(&Clock::default(), &mut add).unwrap();
    assert!(strips == all, "strips differ");
    for part in area.halves().into_iter().flat_map(Area::halves) {
        // A sheet of its own, that knows only what lies around it.
        let sheet = chart.picture(part, &Clock::default()).unwrap().pixels(part, &Clock::default()).unwrap();
        for (line, y) in sheet.chunks_exact(part.width() * 3).zip(part.y0..) {
            let start = ((y - area.y0) as usize * area.width() + (part.x0 - area.x0) as usize) * 3;
            assert!(line == &all[start..start + line.len()], "row {y} of {part:?}");
        }
    }
}

/// The style of a plain hillshade: one light, 45 degrees high.
const PLAIN: &str = "extends = \"relief\"
[tint]
temperate = [{ at = 0, colour = \"#b4b4b4\" }, { at = 1, colour = \"#b4b4b4\" }]
alpine = [{ at = 0, colour = \"#b4b4b4\" }, { at = 1, colour = \"#b4b4b4\" }]
[relief]
turn_deg = 0
soften = 0
exaggeration = 1
strength = 1
shadow = \"#000000\"
light = \"#ffffff\"
highlight = 1
texture = 0
sky = 0
aerial = 0
haze_share = 0
[cover]
rock = { colour = \"#000000\", share = 0 }
snow = { colour = \"#000000\", share = 0 }
forest = { colour = \"#000000\", share = 0 }
grass = { colour = \"#000000\", share = 0 }
dirt = { colour = \"#000000\", share = 0 }
sand = { colour = \"#000000\", share = 0 }
scree = { colour = \"#000000\", share = 0 }
wetland = { colour = \"#000000\", share = 0 }
";

/// What `gdaldem hillshade` makes of three rows of three heights, with the sun in the north-west and 45 degrees high.
fn hillshade(rows: [[f64; 3]; 3], metres: f64) -> f64 {
    let [[a, b, c], [d, _, f], [g, h, i]] = rows;
    let east = ((c + 2.0 * f + i) - (a + 2.0 * d + g)) / (8.0 * metres);
    let south = ((g + 2.0 * h + i) - (a + 2.0 * b + c)) / (8.0 * metres);
    // The light comes from the north-west: what falls there is lit.
    let facing = (east + south) * std::f64::consts::FRAC_1_SQRT_2;
    let shade = (1.0 + facing) / (2.0 * (1.0 + east * east + south * south)).sqrt();
    1.0 + 254.0 * shade.max(0.0)
}

#[test]
fn a_plain_hillshade_is_that_of_gdaldem() {
    // At 1:25,000 slopes are as steep as they are.
    let scale = Scale { metres_per_pixel: 10.0, pixels_per_mm: 2.5 };
    let (_, preset) = Preset::load("alps").unwrap();
    let style = RecipeSources::<Style>::parse("plain.toml", PLAIN).unwrap().read_all().unwrap();
    let chart = Chart::new(&preset, Some(3), style, scale).unwrap();
    let area = Area::new(100, 50, 300, 200);
    let pixels = chart.picture(area, &Clock::default()).unwrap().pixels(area, &Clock::default()).unwrap();
    let wide = area.padded(1);
    let heights = chart.heights_m(wide, &Clock::default()).unwrap();
    let height = |x: usize, y: usize| f64::from(heights[y * wide.width() + x]);
    let mut sum = 0.0;
    for (index, pixel) in pixels.chunks_exact(3).enumerate() {
        let (x, y) = (index % area.width(), index / area.width());
        let rows = [0, 1, 2].map(|dy| [0, 1, 2].map(|dx| height(x + dx, y + dy)));
        sum += (hillshade(rows, 10.0) - f64::from(pixel[0])).abs();
    }
    let mean = sum / area.len() as f64;
    assert!(mean < 1.0, "{mean} of 255");
}

#[test]
fn every_style_draws_as_it_did_and_as_no_other_does() {
    const HINT: &str = "if the change is meant: TERRANE_ACCEPT=1 cargo test --profile quick --test suite maps";
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/maps");
    let scale = Scale { metres_per_pixel: 15.0, pixels_per_mm: 4.0 };
    let area = Area::new(200, 300, 320, 240);
    let mut list =
        String::from("# style, and the first 16 digits of the BLAKE3 of its picture beside this list: alps, seed 3\n");
    let world = alps();
    let mut seen = BTreeSet::new();
    for (name, _) in STYLES {
        let style = Style::load(name).unwrap();
        if style.check_for(&world).is_err() {
            // `climates.rs` draws it.
            assert!(["climate", "geology"].contains(name), "{name}");
            continue;
        }
        let chart = Chart::of_world(&world, style, scale, &Clock::default()).unwrap();
        let pixels = chart.picture(area, &Clock::default()).unwrap().pixels(area, &Clock::default()).unwrap();
        assert_eq!(pixels.len(), area.len() * 3);
        let shades: BTreeSet<&[u8]> = pixels.chunks_exact(3).collect();
        assert!(shades.len() > 60, "{name} has {} colours", shades.len());
        writeln!(list, "{name} {}", &blake3::hash(&pixels).to_hex()[..16]).unwrap();
        if std::env::var_os("TERRANE_ACCEPT").is_some() {
            fs::create_dir_all(&folder).unwrap();
            let mut file = fs::File::create(folder.join(format!("{name}.webp"))).unwrap();
            let encoder = image_webp::WebPEncoder::new(&mut file);
            encoder.encode(&pixels, area.width() as u32, area.height() as u32, image_webp::ColorType::Rgb8).unwrap();
        }
        assert!(seen.insert(pixels), "{name} looks as another one does");
    }
    if std::env::var_os("TERRANE_ACCEPT").is_some() {
        fs::write(folder.join("hashes.txt"), &list).unwrap();
    }
    assert_eq!(list, fs::read_to_string(folder.join("hashes.txt")).unwrap(), "{HINT}");
}

#[test]
fn something_is_found_by_its_name_or_else_what_is_called_nearly_so() {
    let preset = Preset::parse("settled.toml", include_str!("../settled.toml")).unwrap();
    let world = World::new(preset.clone(), None).unwrap();
    let site = &world.sites(&Area::new(-500, -500, 1000, 1000), &Clock::default()).unwrap()[0];
    let found = find::named(preset.clone(), None, &site.name.to_uppercase(), [0.0; 2], &Clock::default()).unwrap();
    assert_eq!(found.name.as_ref(), Some(&site.name));
    let off = [0, 1].map(|axis| (found.at_km[axis].abs() - (site.at[axis] as f64 * 0.02).abs()).abs());
    // Another one of the same name may be nearer to the origin.
    assert!(off == [0.0, 0.0] || found.distance_km < 20.0, "{found:?}");
    let error = find::named(preset, None, &format!("{}xx", site.name), [0.0; 2], &Clock::default()).unwrap_err();
    let hint = error.hint().unwrap_or_default();
    assert!(hint.contains(&site.name) && hint.contains("X,Y,KM"), "{error}: {hint}");
}

#[test]
fn rivers_and_roads_of_agents_are_drawn() {
    let scale = Scale { metres_per_pixel: 2.0, pixels_per_mm: 4.0 };
    let area = Area::new(0, 0, 400, 400);
    let style = |text: &str| {
        let text = format!("extends = \"relief\"\n{text}");
        RecipeSources::<Style>::parse("style.toml", &text).unwrap().read_all().unwrap()
    };
    let picture = |text: &str| {
        let (_, preset) = Preset::load("thesis").unwrap();
        Chart::new(&preset, Some(3), style(text), scale)
            .unwrap()
            .picture(area, &Clock::default())
            .unwrap()
            .pixels(area, &Clock::default())
            .unwrap()
    };
    let bare = picture("");
    for lines in ["[roads]\ndraw = true", "[water]\ndraw = true"] {
        let changed = picture(lines).chunks_exact(3).zip(bare.chunks_exact(3)).filter(|(a, b)| a != b).count();
        assert!(changed > 200, "{lines}: {changed} pixels");
    }
}

#[test]
fn built_in_styles_are_the_files_of_their_folder() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("styles");
    let name = |entry: std::io::Result<fs::DirEntry>| entry.unwrap().file_name().into_string().unwrap();
    let files: BTreeSet<String> = fs::read_dir(folder).unwrap().map(name).collect();
    assert_eq!(files, STYLES.iter().map(|(name, _)| format!("{name}.toml")).collect());
    for (name, text) in STYLES {
        assert!(text.starts_with("# ") && summary(text).len() > 20, "{name}: {:?} says little", summary(text));
    }
}

#[test]
fn a_bad_style_is_refused_where_it_is_wrong() {
    for (text, place, message) in [
        ("extends = \"atlas\"\n[relief]\nsun = 3", "style.toml:3:1", "relief.sun: there is no such key here"),
        (
            "extends = \"atlas\"\n[relief]\nsun_deg = 400",
            "style.toml:3:11",
            "relief.sun_deg: expected 0 to 360, found 400",
        ),
        ("extends = \"atlas\"\npaper = \"white\"", "style.toml:2:9", "expected a colour such as \"#a0b4c8\""),
        ("extends = \"swiss\"", "style.toml:1:11", "there is neither a file nor a built-in style named \"swiss\""),
        (
            "extends = \"atlas\"\n[tint]\narid = [{ at = 0, colour = \"#000000\" }, { at = 0, colour = \"#ffffff\" }]",
            "style.toml:3:48",
            "tint.arid[1].at: expected more than 0",
        ),
        ("ink = \"#000000\"", "style.toml:1:1", "the key paper is missing"),
    ] {
        let error =
            RecipeSources::<Style>::parse("style.toml", text).and_then(|sources| sources.read_all()).unwrap_err();
        let shown = error.to_string();
        assert!(shown.contains(place) && shown.contains(message), "{text}: {shown}");
        assert_eq!(error.exit_code(), 2);
    }
    // A font lies where its style does.
    let folder = tempfile::tempdir().unwrap();
    let (style, font) = (folder.path().join("own.toml"), folder.path().join("own.ttf"));
    fs::write(&style, "extends = \"atlas\"\n[labels]\nfont = \"own.ttf\"").unwrap();
    fs::write(&font, "no font").unwrap();
    let sources = RecipeSources::<Style>::load(&style.to_string_lossy()).unwrap();
    let shown = sources.read_all().unwrap_err().to_string();
    let refused = format!("labels.font: {font:?} is no TrueType or OpenType font");
    assert!(shown.contains("own.toml:3:8") && shown.contains(&refused), "{shown}");
    // A change of one key.
    let mut sources = RecipeSources::<Style>::load("relief").unwrap();
    sources.set("--style-set", "contours.draw=true").unwrap();
    assert!(sources.read_all().unwrap().contours.draw);
}
