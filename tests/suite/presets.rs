//! The built-in presets: complete, described, different and bakeable.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use proptest::prelude::*;
use terrane::area::{Area, TileId};
use terrane::clock::Clock;
use terrane::preset::{BUILT_IN, Preset, Sources, summary};
use terrane::tile::Tile;
use terrane::world::World;

#[test]
fn the_built_in_presets_are_the_files_of_the_folder() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("presets");
    let files: BTreeSet<String> =
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    let built_in: BTreeSet<String> = BUILT_IN.iter().map(|(name, _)| format!("{name}.toml")).collect();
    assert_eq!(files, built_in);
}

#[test]
fn the_first_line_says_what_a_preset_shows() {
    let mut seen = BTreeSet::new();
    for (name, text) in BUILT_IN {
        assert!(text.starts_with("# "), "{name} begins with a comment");
        assert!(summary(text).len() > 20, "{name}: {:?} says little", summary(text));
        assert!(seen.insert(summary(text)), "{name} is described as another one is");
    }
}

#[test]
fn the_thesis_has_the_values_of_its_table() {
    let (_, preset) = Preset::load("thesis").unwrap();
    let [term] = &preset.noise[..] else { panic!("the thesis has one term") };
    assert_eq!((term.octaves, term.dimension, term.lacunarity), (8, Some(2.0), 2.5));
    assert_eq!((term.offset, term.gain, term.wavelength_m), (Some(1.0), Some(2.0), 1400.0));
    assert_eq!((preset.tile_cells, preset.ground.slope_scale), (256, 5.0));
    assert!(preset.warp.is_none() && preset.land.is_none() && term.mask.is_none() && term.curve.is_none());
}

#[test]
fn a_seed_makes_another_world() {
    let height = |seed| {
        let world = World::new(Preset::load("thesis").unwrap().1, Some(seed)).unwrap();
        Tile::new(&world, TileId { x: 0, y: 0 }).digest()
    };
    assert_ne!(height(1), height(2));
    assert_eq!(height(2), height(2));
}

/// What is wrong: the text, where the error must point, what it must say, and its hint.
type BadText = (&'static str, &'static str, &'static str, &'static str);

const BAD_TEXTS: &[BadText] = &[
    // Lists that are too long, and too short.
    (
        "spacing_m = 10\n[fluvial]\n[places]\nwidth_m = [1, 2, 3, 4]",
        "4:11",
        "places.width_m: expected a list of 3, found one of 4",
        "schema",
    ),
    (
        "spacing_m = 10\n[fluvial]\nhill_slope = [0.1]",
        "3:14",
        "fluvial.hill_slope: expected a list of 2, found one of 1",
        "schema",
    ),
    (
        "[[noise]]\nkind = \"fbm\"\nheight_m = 1\ncurve = [[0, 1, 2], [1, 2]]",
        "4:10",
        "noise[0].curve[0]: expected a list of 2",
        "",
    ),
    // Defaults that do not go with what is written.
    (
        "spacing_m = 300\n[fluvial]\nlevels = 3",
        "2:1",
        "fluvial.trunk_m (not given): expected 64 to 4096 times spacing_m, which is 19200 to 1228800, but the default is 12800",
        "a smaller spacing_m",
    ),
    (
        "spacing_m = 10\n[fluvial]\nbasin_m = 100",
        "3:11",
        "fluvial.basin_m: expected 2 to 512 times trunk_m, which is 25600 to 6553600, found 100",
        "",
    ),
    (
        "spacing_m = 10\n[fluvial]\nlake_m = 4000",
        "3:10",
        "fluvial.lake_m: expected at most 1600, an eighth of trunk_m, found 4000",
        "",
    ),
    (
        "tile_cells = 16\nspacing_m = 0.016\n[[noise]]\nkind = \"fbm\"\nheight_m = 1\nwavelength_m = 100\n[roads]\nwidth_m = 0.1",
        "8:11",
        "roads.width_m: expected at most 0.064, a quarter of a tile's side (tile_cells = 16, spacing_m = 0.016), found 0.1",
        "a tile_cells of 25 or more, or roads.width_m = 0.064 or less",
    ),
    // Keys that nothing would read.
    (
        "spacing_m = 10\n[fluvial]\n[fluvial.coast]\nbelow = 0.1",
        "3:10",
        "fluvial.coast: nothing reads it without sea_level_m",
        "give sea_level_m",
    ),
    (
        "spacing_m = 10\nsea_level_m = 0\n[geography]\n[fluvial]\nvalley = 0.1",
        "5:1",
        "fluvial.valley: nothing reads it with a geography",
        "each place has its own value",
    ),
    (
        "spacing_m = 10\n[fluvial]\n[fluvial.rock]\nfolded = 0.5",
        "3:1",
        "fluvial.rock: the land has no rock at all",
        "a part above 0",
    ),
    (
        "spacing_m = 10\n[fluvial]\n[ground]\nsand_m = [1, 2]",
        "4:1",
        "ground.sand_m: nothing reads it without sea_level_m",
        "leave it out",
    ),
    (
        "spacing_m = 10\n[fluvial]\n[ground]\nsnow_slope = [0.5, 1]",
        "4:1",
        "ground.snow_slope: nothing reads it without ground.snow_m",
        "snow_m",
    ),
    (
        "[[noise]]\nkind = \"fbm\"\nheight_m = 1\nwavelength_m = 100\n[ground]\nforest_m = [1, 2]\nwet_m = 9",
        "7:1",
        "ground.wet_m: nothing reads it without fluvial",
        "leave it out",
    ),
    (
        "spacing_m = 10\n[fluvial]\n[ground]\nmeadow = [0.1, 0.2]",
        "4:1",
        "ground.meadow: nothing reads it without ground.forest_m",
        "forest_m",
    ),
    (
        "spacing_m = 10\n[fluvial]\n[warp]\nwavelength_m = 9\ndistance_m = 1",
        "3:2",
        "warp: nothing reads it in a world of fluvial",
        "leave it out",
    ),
    (
        "spacing_m = 10\n[fluvial]\n[rivers]",
        "3:2",
        "rivers: agents cut rivers into finished land, and fluvial relief has its own",
        "leave it out",
    ),
    ("spacing_m = 10\n[fluvial]\n[roads]", "3:2", "roads: agents follow the land of a tile or two", "add [places]"),
    // Types, in the user's words.
    (
        "spacing_m = 10\n[fluvial]\ntrunk_m = \"far\"",
        "3:11",
        "fluvial.trunk_m: expected a number, found \"far\"",
        "schema",
    ),
    ("fluvial = 1", "1:11", "fluvial: expected a table, found 1", "schema"),
    ("seed = 1.5\nspacing_m = 10\n[fluvial]", "1:8", "seed: expected a whole number, found 1.5", "schema"),
    ("seed = -1\n[fluvial]", "1:8", "seed: expected 0 to 18446744073709551615, found -1", ""),
    (
        "spacing_m = 10\n[fluvial]\n[map]\ntint = \"blue\"",
        "4:8",
        "map.tint: expected \"temperate\" or \"arid\" or \"alpine\", found \"blue\"",
        "",
    ),
    (
        "[[noise]]\nkind = \"fbm\"\nheight_m = 1\n[roads]\ngraded = 1",
        "5:10",
        "roads.graded: expected true or false, found 1",
        "",
    ),
    (
        "spacing_m = 10\n[fluvial]\nlevels = 2024-01-01",
        "3:10",
        "fluvial.levels: expected a whole number, found the date 2024-01-01",
        "",
    ),
    // What a preset extends.
    ("extends = \"thesiss\"", "1:11", "extends: there is neither a file nor a built-in preset", "did you mean thesis?"),
    ("extends = 3", "1:11", "extends: expected the name of a preset", "alps"),
];

#[test]
fn a_bad_text_is_refused_in_the_users_words() {
    for (text, place, words, hint) in BAD_TEXTS {
        let error = Preset::parse("p.toml", text).expect_err(text);
        let message = error.to_string();
        assert!(message.starts_with(&format!("p.toml:{place}: {words}")), "{text:?}: {message}");
        assert!(error.hint().unwrap_or_default().contains(hint), "{text:?}: {:?}", error.hint());
    }
}

#[test]
fn an_error_shows_neither_control_characters_nor_endless_lines() {
    let long = "x".repeat(100_000);
    for text in [
        format!("[fluvial]\nlevels = \"\u{7f}\u{9b}31m\u{202e}{long}\""),
        format!("[fluvial]\nlevels = 3 #{long}\n\"a\\u001b[31m{long}\" = 1"),
        format!("# {long}\u{1b}[31m\n[fluvial]"),
        format!("seed = 1 # {long}\nseed{long} = \u{1b}"),
    ] {
        let error = Preset::parse("p\u{1b}[31m.toml", &text).expect_err("it is wrong").to_string();
        assert!(error.chars().all(|c| c == '\n' || !c.is_control() && c != '\u{202e}'), "{error:?}");
        assert!(error.len() < 2500, "{} characters: {error}", error.len());
    }
}

#[test]
fn a_preset_extends_another_table_by_table() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| {
        fs::write(folder.path().join(name), text).unwrap();
        folder.path().join(name).to_str().unwrap().to_owned()
    };
    write("base.toml", "extends = \"alps\"\nspacing_m = 4\n[fluvial]\nlevels = 5\nhill_slope = [0.1, 0.2]\n");
    let path = write("child.toml", "extends = \"base.toml\"\n[fluvial]\nlevels = 4\n");
    let (name, child) = Preset::load(&path).unwrap();
    let alps = Preset::load("alps").unwrap().1;
    let mut expected = Preset { spacing_m: 4.0, ..alps };
    let fluvial = expected.fluvial.as_mut().unwrap();
    (fluvial.levels, fluvial.hill_slope) = (4, [0.1, 0.2]);
    assert_eq!((&name[..], child), ("child", expected));
    // An error points at the file that has the value.
    write("base.toml", "extends = \"alps\"\n\n[fluvial]\ntrunk_slope = 3\n");
    let error = Preset::load(&path).unwrap_err().to_string();
    assert!(error.contains("base.toml:4:15: fluvial.trunk_slope: expected 0.0001 to 0.2, found 3"), "{error}");
    // Nothing extends itself, whatever is between.
    write("base.toml", "\nextends = \"./child.toml\"\n");
    let error = Preset::load(&path).unwrap_err().to_string();
    assert!(error.contains("base.toml:2:11: extends: this preset extends itself"), "{error}");
}

#[test]
fn a_setting_comes_over_all_texts() {
    let set = |settings: &[&str]| {
        let mut sources = Sources::load("thesis").unwrap();
        settings.iter().try_for_each(|setting| sources.set("--set", setting))?;
        sources.read_all()
    };
    let preset =
        set(&["noise[0].height_m=300", "noise.0.octaves = 4", "map.tint=\"arid\"", "rivers.width_m=[1, 2]"]).unwrap();
    assert_eq!((preset.noise[0].height_m, preset.noise[0].octaves), (300.0, 4));
    assert_eq!(preset.rivers.unwrap().width_m, [1.0, 2.0]);
    for (setting, place, words) in [
        ("tile_cells=8", 12, "tile_cells: expected 16 to 4096, found 8"),
        ("noise[0].octavs=8", 1, "noise[0].octavs: there is no such key here"),
        ("noise[1].octaves=8", 1, "noise[1].octaves: there is no [1] in a list of 1"),
        ("noise.octaves=8", 1, "noise.octaves: octaves is asked of a list"),
        ("seed.x=8", 1, "seed.x: x is asked of what is no table"),
        ("map.tint=arid", 10, "map.tint: this is no value"),
        ("map.tint", 1, "there is no ="),
        ("=3", 1, "this is no key"),
        ("a..b=3", 1, "this is no key"),
        ("seed=3\nspacing_m=1", 6, "seed: this is no value"),
    ] {
        let error = set(&["seed=2", setting]).expect_err(setting).to_string();
        assert!(error.starts_with(&format!("--set:1:{place}: {words}")), "{setting}: {error}");
    }
    // The setting that leaves no room for a default is pointed at.
    let error = set(&["tile_cells=32"]).unwrap_err().to_string();
    assert!(error.starts_with("--set:1:12: rivers.width_m[1] (not given)"), "{error}");
}

#[test]
fn the_schema_has_the_bounds_that_are_checked() {
    let schema = Preset::schema();
    let bounds = |value: &serde_json::Value| (value["minimum"].as_f64(), value["maximum"].as_f64());
    assert_eq!(bounds(&schema["properties"]["tile_cells"]), (Some(16.0), Some(4096.0)));
    let places = &schema["$defs"]["PlacesSettings"]["properties"];
    assert_eq!(bounds(&places["width_m"]["items"]), (Some(0.5), Some(50.0)));
    assert_eq!((&places["width_m"]["minItems"], &places["width_m"]["maxItems"]), (&3.into(), &3.into()));
    assert_eq!(schema["properties"]["extends"]["type"], "string");
}

/// The settlements within ten kilometres of the origin: their names and places.
fn towns(preset: Preset, seed: u64) -> BTreeSet<(String, [i64; 2])> {
    let world = World::new(Preset { tile_cells: 64, ..preset }, Some(seed)).unwrap();
    let sites = world.sites(&Area::new(-1000, -1000, 2000, 2000), &Clock::default()).unwrap();
    assert!(sites.len() > 5, "{} settlements", sites.len());
    sites.iter().map(|site| (site.name.clone(), site.at)).collect()
}

#[test]
fn each_built_in_preset_shows_a_country_of_its_own() {
    let countries: BTreeSet<Option<String>> =
        BUILT_IN.iter().map(|(name, text)| Preset::parse(name, text).unwrap().country).collect();
    assert_eq!(countries.len(), BUILT_IN.len());
    assert!(!countries.contains(&None));
    let [alps, fjords] = ["alps", "fjords"].map(|name| towns(Preset::load(name).unwrap().1, 1));
    let names =
        |towns: &BTreeSet<(String, [i64; 2])>| towns.iter().map(|(name, _)| name.clone()).collect::<BTreeSet<_>>();
    assert!(names(&alps).is_disjoint(&names(&fjords)), "{alps:?} {fjords:?}");
    assert!(alps.iter().all(|(_, at)| fjords.iter().all(|(_, other)| at != other)));
}

#[test]
fn a_preset_on_top_of_another_shows_its_country() {
    let alps = Preset::load("alps").unwrap().1;
    let seed = alps.seed;
    let lower = Preset::parse("lower", "extends = \"alps\"\n[ground]\nscree_m = 90\n").unwrap();
    assert_eq!(lower.chance(seed), alps.chance(seed));
    let set = |setting: &str| {
        let mut sources = Sources::load("alps").unwrap();
        sources.set("--set", setting).unwrap();
        sources.read_all().unwrap()
    };
    let tilted = set("ground.scree_m=90");
    assert_eq!(towns(tilted, seed), towns(alps.clone(), seed));
    // Another word, another seed and none at all are other countries.
    let other = set("country=\"bavaria\"");
    let none = Preset { country: None, ..alps.clone() };
    let chances = [alps.chance(seed), alps.chance(seed + 1), other.chance(seed), none.chance(seed)];
    assert_eq!(BTreeSet::from(chances).len(), chances.len());
    assert_eq!(none.chance(seed), seed, "without a country all is of the seed alone");
    assert_eq!(World::new(other.clone(), None).unwrap().chance(), other.chance(seed));
    let error =
        Preset::parse("long", &format!("country = \"{}\"\n[fluvial]\n", "x".repeat(101))).unwrap_err().to_string();
    assert!(error.contains("country: expected a text of at most 100 letters, found one of 101"), "{error}");
}

#[test]
fn a_preset_that_was_made_and_not_read_is_checked_too() {
    let (_, thesis) = Preset::load("thesis").unwrap();
    let odd = Preset { spacing_m: f64::NAN, ..thesis.clone() };
    let error = World::new(odd, None).unwrap_err().to_string();
    assert_eq!(error, "spacing_m: expected 0.001 to 10000, found NaN");
    assert_eq!(World::new(Preset { seed: u64::MAX, ..thesis }, None).unwrap().seed(), u64::MAX);
}

/// Parts of presets, well and badly formed.
const TOKENS: &[&str] = &[
    "[[noise]]\n",
    "[fluvial]\n",
    "[fluvial.coast]\n",
    "[places]\n",
    "[ground]\n",
    "[rivers]\n",
    "kind = ",
    "\"fbm\"\n",
    "height_m = ",
    "spacing_m = ",
    "width_m = ",
    "curve = ",
    "octaves = ",
    "levels = ",
    "extends = ",
    "\"alps\"\n",
    "1\n",
    "-1.5\n",
    "nan\n",
    "1e999\n",
    "[1, 2, 3]\n",
    "[]\n",
    "[[0, 1], [1, \"x\"]]\n",
    "{ from = 1 }\n",
    "true\n",
    "2024-01-01\n",
    "0x10\n",
    "9999999999999999999999\n",
    "\n",
    "#",
    "\"",
    "]",
    "=",
    ".",
    "\u{feff}",
    "\r\n",
    "\u{1b}",
    "ü",
];

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(4096) })]

    #[test]
    fn whatever_is_written_is_read_or_refused_in_words(
        tokens in prop::collection::vec(prop::sample::select(TOKENS), 0..12),
        setting in prop::collection::vec(prop::sample::select(TOKENS), 0..4),
    ) {
        let refused = |error: terrane::error::Error| {
            let message = error.to_string();
            let own = ["f64", "u32", "u64", "invalid type", "unknown field", "missing field", "unknown variant"];
            prop_assert!(own.iter().all(|word| !message.contains(word)), "{message}");
            Ok(())
        };
        match Sources::parse("p.toml", &tokens.concat()) {
            Ok(mut sources) => {
                _ = sources.set("--set", &setting.concat());
                sources.read_all().map_or_else(refused, |_| Ok(()))?;
            }
            Err(error) => refused(error)?,
        }
    }
}
