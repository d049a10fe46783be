//! Built-in presets over the whole of a region: varied, within their range, and using it.

use rayon::prelude::*;
use terrane::area::Area;
use terrane::preset::{BUILT_IN, Preset};
use terrane::world::World;

#[test]
#[ignore = "slow for its own sake"]
fn every_preset_makes_varied_land_within_a_fine_range() {
    let presets = BUILT_IN.par_iter().map(|(name, text)| (name, Preset::parse(name, text).unwrap()));
    // A whole world is varied from continent to continent, which `tests/earth.py` looks at.
    presets.filter(|(_, preset)| preset.geography.is_none()).for_each(|(name, preset)| {
        let spacing_m = preset.spacing_m;
        let world = World::new(preset, None).unwrap();
        let (min_m, max_m) = world.height_range_m();
        // A look every so many vertices over 20,000 x 20,000: the whole of a region, thinly.
        let looks = if world.relief().fluvial().is_some() { 20 } else { 200 };
        let step = 20_000 / looks;
        let area = |look: i64| Area::new(look % looks * step, look / looks * step, 1, 1);
        let heights: Vec<f32> =
            (0..looks * looks).flat_map(|look| world.relief().heights(area(look)).values().to_vec()).collect();
        let low = heights.iter().copied().fold(f32::INFINITY, f32::min);
        let high = heights.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        assert!(min_m <= low && high <= max_m, "{name}: {low}..{high} m are not within {min_m}..{max_m} m");
        assert!(high - low > 30.0, "{name} has only {} m of relief", high - low);
        // A range that is proved much too wide would waste the steps of 16 bits.
        assert!(high - low > 0.3 * (max_m - min_m), "{name} uses {low}..{high} m of {min_m}..{max_m} m");
        let step_m = (max_m - min_m) / 65535.0;
        assert!(step_m < 0.05 * spacing_m as f32, "{name}: a step of 16 bits is {step_m} m");
        if let Some(sea_level_m) = world.preset().sea_level_m {
            assert!((low as f64) < sea_level_m && sea_level_m < high as f64, "{name} has sea and land");
        }
    });
}
