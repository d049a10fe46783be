//! Maps: the same pixels and names whatever is drawn at once, in every style, and what a user gets wrong.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::sync::Arc;

use terrane::area::Area;
use terrane::map::Chart;
use terrane::map::scale::Scale;
use terrane::map::style::{STYLES, Style};
use terrane::preset::{Preset, summary};
use terrane::recipe::source::Sources;

fn chart(preset: &str, style: &str, scale: Scale) -> Arc<Chart> {
    let (_, preset) = Preset::load(preset).unwrap();
    Chart::new(&preset, Some(3), Style::load(style).unwrap(), scale).unwrap()
}

#[test]
fn a_map_drawn_at_once_in_strips_and_in_sheets_is_the_same() {
    // Small letters on land with many names, so that these meet at the borders of sheets.
    let scale = Scale { metres_per_pixel: 50.0, pixels_per_mm: 1.0 };
    let chart = chart("alps", "topographic", scale);
    let area = Area::new(-130, -700, 300, 260);
    let whole = chart.picture(area);
    let all = whole.pixels(area);
    let mut strips = Vec::new();
    let mut add = |strip: &[u8]| {
        strips.extend_from_slice(strip);
        Ok::<_, ()>(())
    };
    whole.strips(&mut add).unwrap();
    assert!(strips == all, "strips differ");
    for part in area.halves().into_iter().flat_map(Area::halves) {
        // A sheet of its own, that knows only what lies around it.
        let sheet = chart.picture(part).pixels(part);
        for (line, y) in sheet.chunks_exact(part.width() * 3).zip(part.y0..) {
            let start = ((y - area.y0) as usize * area.width() + (part.x0 - area.x0) as usize) * 3;
            assert!(line == &all[start..start + line.len()], "row {y} of {part:?}");
        }
    }
}

#[test]
fn rivers_and_roads_of_agents_are_drawn() {
    let scale = Scale { metres_per_pixel: 2.0, pixels_per_mm: 4.0 };
    let area = Area::new(0, 0, 400, 400);
    let style = |text: &str| {
        let text = format!("extends = \"relief\"\n{text}");
        Sources::<Style>::parse("style.toml", &text).unwrap().read_all().unwrap()
    };
    let picture = |text: &str| {
        let (_, preset) = Preset::load("thesis").unwrap();
        Chart::new(&preset, Some(3), style(text), scale).unwrap().picture(area).pixels(area)
    };
    let bare = picture("");
    for lines in ["[roads]\ndraw = true", "[water]\ndraw = true"] {
        let changed = picture(lines).chunks_exact(3).zip(bare.chunks_exact(3)).filter(|(a, b)| a != b).count();
        assert!(changed > 200, "{lines}: {changed} pixels");
    }
}

#[test]
fn all_styles_draw_and_differ() {
    let scale = Scale { metres_per_pixel: 10.0, pixels_per_mm: 1.0 };
    let area = Area::new(0, 0, 300, 200);
    let mut seen = BTreeSet::new();
    for (name, _) in STYLES {
        let pixels = chart("alps", name, scale).picture(area).pixels(area);
        assert_eq!(pixels.len(), area.len() * 3);
        let shades: BTreeSet<&[u8]> = pixels.chunks_exact(3).collect();
        assert!(shades.len() > 60, "{name} has {} colours", shades.len());
        assert!(seen.insert(pixels), "{name} looks as another one does");
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
        let error = Sources::<Style>::parse("style.toml", text).and_then(|sources| sources.read_all()).unwrap_err();
        let shown = error.to_string();
        assert!(shown.contains(place) && shown.contains(message), "{text}: {shown}");
        assert_eq!(error.exit_code(), 2);
    }
    // A change of one key.
    let mut sources = Sources::<Style>::load("relief").unwrap();
    sources.set("--style-set", "contours.draw=true").unwrap();
    assert!(sources.read_all().unwrap().contours.draw);
}
