//! The built-in presets: complete, described, different and bakeable.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use terrane::area::{Area, TileId};
use terrane::preset::{BUILT_IN, Preset, summary};
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
fn every_preset_makes_varied_land_within_a_fine_range() {
    for (name, text) in BUILT_IN {
        let preset = Preset::parse(name, text).unwrap();
        let spacing_m = preset.spacing_m;
        let world = World::new(preset, None).unwrap();
        let (min_m, max_m) = world.height_range_m();
        // A look every so many vertices over 20,000 x 20,000: the whole of a region, thinly.
        let looks = if world.relief().fluvial().is_some() { 30 } else { 200 };
        let step = 20_000 / looks;
        let heights: Vec<f32> = (0..looks * looks)
            .map(|look| world.relief().heights(Area::new(look % looks * step, look / looks * step, 1, 1)).values()[0])
            .collect();
        let low = heights.iter().copied().fold(f32::INFINITY, f32::min);
        let high = heights.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        assert!(high - low > 30.0, "{name} has only {} m of relief", high - low);
        // A range that is proved much too wide would waste the steps of 16 bits.
        assert!(high - low > 0.3 * (max_m - min_m), "{name} uses {low}..{high} m of {min_m}..{max_m} m");
        let step_m = (max_m - min_m) / 65535.0;
        assert!(step_m < 0.05 * spacing_m as f32, "{name}: a step of 16 bits is {step_m} m");
        if let Some(sea_level_m) = world.preset().sea_level_m {
            assert!((low as f64) < sea_level_m && sea_level_m < high as f64, "{name} has sea and land");
        }
    }
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
