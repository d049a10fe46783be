//! Worlds of the built-in presets that tests share, so that what is planned for one is remembered for the next.

use std::collections::BTreeMap;
use std::sync::Mutex;

use terrane::fluvial::Fluvial;
use terrane::preset::{BUILT_IN, Preset};
use terrane::world::World;

/// The built-in presets that the suite tries with all that is tried with each; its long form tries the others.
const QUICK: [&str; 5] = ["alps", "archipelago", "thesis", "mountains", "hills"];

/// Whether these tests try a preset, or leave that to the others.
pub fn is_tried(name: &str) -> bool {
    is_quick(name) != crate::is_long()
}

/// Whether the suite tries a preset with all.
pub fn is_quick(name: &str) -> bool {
    QUICK.contains(&name)
}

/// Lightens a preset for the suite, but not for its long form.
pub fn lighten(preset: &mut Preset) {
    if !crate::is_long() {
        lighten_always(preset);
    }
}

/// Has a third of the channels planned: the finest are as near to each other as before, and two levels above them are
/// left out.
pub fn lighten_always(preset: &mut Preset) {
    if let Some(fluvial) = preset.fluvial.as_mut() {
        fluvial.levels -= 2;
        fluvial.trunk_m /= 4.0;
        fluvial.lake_m = fluvial.lake_m.map(|lake_m| lake_m.min(fluvial.trunk_m / 8.0));
    }
}

/// The built-in presets of one land of fluvial relief. A whole world has the sea at most places that tests look at.
pub fn fluvial_names() -> impl Iterator<Item = &'static str> {
    let is_one_land = |preset: Preset| preset.fluvial.is_some() && preset.geography.is_none();
    let parsed = |name: &str, text: &str| Preset::parse(name, text).unwrap();
    BUILT_IN.iter().filter(move |(name, text)| is_one_land(parsed(name, text))).map(|(name, _)| *name)
}

/// The world of a built-in preset's settings and a seed that all tests of the process share. It has no country: tests
/// name a seed for what they found in its world, whichever country the preset shows.
pub fn shared(name: &'static str, seed: u64) -> &'static World {
    static WORLDS: Mutex<BTreeMap<(&str, u64), &'static World>> = Mutex::new(BTreeMap::new());
    let preset = || Preset { country: None, ..Preset::load(name).unwrap().1 };
    let world = || World::new(preset(), Some(seed)).unwrap();
    WORLDS.lock().unwrap().entry((name, seed)).or_insert_with(|| Box::leak(Box::new(world())))
}

pub fn fluvial(world: &World) -> &Fluvial {
    world.relief().fluvial().expect("a world of fluvial relief")
}
