//! The built-in presets: complete, described, different and bakeable.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use terrane::area::TileId;
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
fn a_seed_makes_another_world() {
    let height = |seed| {
        let world = World::new(Preset::load("thesis").unwrap().1, Some(seed)).unwrap();
        Tile::new(&world, TileId { x: 0, y: 0 }).hash()
    };
    assert_ne!(height(1), height(2));
    assert_eq!(height(2), height(2));
}
