//! The height range is proved from the preset: random worlds try to leave it.

use proptest::prelude::*;

use terrane::area::Area;
use terrane::fluvial::settings::{CoastSettings, FluvialSettings, Strata};
use terrane::preset::ground::GroundSettings;
use terrane::preset::map::MapStyle;
use terrane::preset::{BUILT_IN, Preset, Sources};
use terrane::recipe::mask::Mask;
use terrane::relief::settings::{LandMask, NoiseKind, NoiseTerm, WarpSettings};
use terrane::world::World;

use crate::is_long;

fn mask() -> impl Strategy<Value = Mask> {
    (20.0..5000.0, 1..5u32, -1.0..1.0, 0.01..2.0f64, any::<bool>()).prop_map(
        |(wavelength_m, octaves, from, width, down)| {
            let to = from + if down { -width } else { width };
            Mask { wavelength_m, octaves, from, to }
        },
    )
}

fn curve() -> impl Strategy<Value = Vec<[f64; 2]>> {
    prop::collection::vec((0.01..1.0f64, -2.0..2.0f64), 2..6).prop_map(|steps| {
        let mut input = -1.5;
        let point = |(width, output)| {
            input += width;
            [input, output]
        };
        steps.into_iter().map(point).collect()
    })
}

fn term() -> impl Strategy<Value = NoiseTerm> {
    let kind = prop::sample::select(vec![NoiseKind::Fbm, NoiseKind::Ridged, NoiseKind::Hybrid, NoiseKind::Hetero]);
    let shape = (-900.0..900.0, -500.0..500.0, 1.5..4.0f64, 0.0..3.0, 0.0..2.0, 0.0..8.0);
    let extras = (1..8u32, 1.0..50.0f64, prop::option::of(curve()), prop::option::of(mask()));
    (kind, shape, extras).prop_map(|(kind, (height_m, base_m, lacunarity, dimension, offset, gain), extras)| {
        let (octaves, finest_m, curve, mask) = extras;
        NoiseTerm {
            kind,
            height_m,
            base_m,
            // The finest wavelength is chosen and the first follows, so that every octave is wider than a cell.
            wavelength_m: finest_m * f64::powi(lacunarity, octaves as i32 - 1) * 1.001,
            octaves,
            dimension: Some(dimension),
            lacunarity,
            offset: (kind != NoiseKind::Fbm).then_some(offset),
            gain: (kind == NoiseKind::Ridged).then_some(gain),
            curve,
            mask,
        }
    })
}

fn preset() -> impl Strategy<Value = Preset> {
    let warp = (50.0..3000.0, 1..4u32, 0.0..30.0).prop_map(|(wavelength_m, octaves, distance_m)| WarpSettings {
        wavelength_m,
        octaves,
        distance_m,
    });
    let land = (mask(), -800.0..100.0).prop_map(|(mask, floor_m)| LandMask { mask, floor_m });
    (prop::collection::vec(term(), 1..4), prop::option::of(warp), prop::option::of(land)).prop_map(
        |(noise, warp, land)| Preset {
            seed: 1,
            country: None,
            spacing_m: 1.0,
            tile_cells: 16,
            sea_level_m: None,
            noise,
            geography: None,
            fluvial: None,
            places: None,
            warp,
            land,
            rivers: None,
            roads: None,
            ground: GroundSettings::default(),
            map: MapStyle::default(),
        },
    )
}

fn fluvial() -> impl Strategy<Value = Preset> {
    let size = (2..=4u32, 8.0..24.0, prop::sample::select(vec![0.5, 4.0, 30.0]));
    let heights = (0.0..3000.0, 1.0..4.0, 0.1..0.98, prop::option::of(-1.0..1.0f64), 0.0..3.3);
    let slopes = (0.0001..0.2, 0.05..0.9, [0.005..2.0, 0.005..2.0], [0.001..2.0, 0.001..2.0], 0.0..1000.0);
    let strata = prop::option::of((1.0..1000.0, 1.0..20.0, 0.05..0.95));
    let water = (0.01..10.0, 0.1..100.0, 0.0..1.0, -0.5..0.5, 0.0..0.2);
    (size, heights, slopes, strata, water).prop_map(|(size, heights, slopes, strata, water)| {
        let ((levels, finest, spacing_m), (base_m, ceiling, knee, sea, depth)) = (size, heights);
        let (trunk_slope, channel_slope, hill_slope, slope, crest_m) = slopes;
        let (runoff_m, river_width_m, lakes, below, valley) = water;
        let trunk_m = f64::max(finest * f64::from(1 << levels), 64.0) * spacing_m;
        let ceiling_m = f64::powf(10.0, ceiling);
        let strata = strata.map(|(thickness_m, steepness, cliff)| Strata { thickness_m, steepness, cliff });
        let settings = FluvialSettings {
            trunk_m,
            levels,
            base_m,
            trunk_slope,
            channel_slope,
            hill_slope,
            crest_m,
            ceiling_m,
            knee,
            strata,
            runoff_m,
            river_width_m,
            lakes,
            valley,
            coast: CoastSettings { below, slope, depth_m: f64::powf(10.0, depth), ..CoastSettings::default() },
            ..FluvialSettings::default()
        };
        // From as far below 0 as the ceiling is above to where the land begins to be pressed together.
        let sea_level_m = sea.map(|share| share * if share < 0.0 { ceiling_m } else { ceiling_m * knee });
        Preset {
            spacing_m,
            sea_level_m,
            fluvial: Some(settings),
            ..Preset::parse("bare", "spacing_m = 10\n[fluvial]").unwrap()
        }
    })
}

proptest! {
    // A fluvial world takes a second to plan.
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(if is_long() { 24 } else { 6 }) })]

    #[test]
    fn no_fluvial_height_leaves_the_range(preset in fluvial(), seed: u64, x in -(1i64 << 40)..1 << 40) {
        let world = World::new(preset, Some(seed)).unwrap();
        let (min_m, max_m) = world.height_range_m();
        for step in 0..6 {
            let heights = world.relief().heights(Area::new(x + step * 61, step * 37, 40, 40));
            for &height_m in heights.values() {
                prop_assert!(min_m <= height_m && height_m <= max_m, "{height_m} m is outside {min_m}..{max_m} m");
            }
        }
    }
}

proptest! {
    // A failing world is written out by the assertion itself; there is no file of old failures to keep.
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(512) })]

    #[test]
    fn no_height_leaves_the_range(preset in preset(), seed: u64, x in -(1i64 << 52)..1 << 52, y in -(1i64 << 52)..1 << 52) {
        let world = World::new(preset, Some(seed)).unwrap();
        let (min_m, max_m) = world.height_range_m();
        // A sparse look at much ground finds extremes sooner than a close look at little.
        for step in 0..24 {
            let heights = world.relief().heights(Area::new(x + step * 1009, y - step * 2003, 48, 8));
            for &height_m in heights.values() {
                prop_assert!(min_m <= height_m && height_m <= max_m, "{height_m} m is outside {min_m}..{max_m} m");
            }
        }
    }
}

#[test]
fn the_range_of_the_thesis_is_that_of_its_series() {
    let (_, mut preset) = Preset::load("thesis").unwrap();
    // Rivers cut a little deeper than the series goes.
    preset.rivers = None;
    let (min_m, max_m) = World::new(preset, None).unwrap().height_range_m();
    // Signals are 0 to 1; amplitudes are 2.5^-2 = 0.16 an octave, eight of them.
    let sum: f64 = (0..8).map(|octave| 0.16f64.powi(octave)).sum();
    assert!((-0.1..=0.0).contains(&min_m), "{min_m}");
    assert!((max_m as f64 - 200.0 * sum).abs() < 0.1, "{max_m}");
}

#[test]
fn a_sea_above_the_land_is_refused_and_one_far_below_is_warned_of() {
    let world = |name: &str, setting: &str| {
        let mut sources = Sources::load(name).unwrap();
        sources.set("--set", setting).unwrap();
        sources.read_all().map(|preset| World::new(preset, None).unwrap())
    };
    let refused = world("archipelago", "sea_level_m=5000").unwrap_err().to_string();
    assert!(refused.starts_with("--set:1:13: sea_level_m: expected at most 600, knee times ceiling_m"), "{refused}");
    for (name, setting, words) in [
        ("archipelago", "sea_level_m=-5000", "wastes"),
        ("mountains", "sea_level_m=90000", "all is under the sea"),
        ("mountains", "sea_level_m=-90000", "nothing is as low as the sea"),
    ] {
        let warnings = world(name, setting).unwrap().warnings();
        assert!(warnings.len() == 1 && warnings[0].contains(words), "{warnings:?}");
    }
    for (name, _) in BUILT_IN {
        let warnings = World::new(Preset::load(name).unwrap().1, None).unwrap().warnings();
        assert!(warnings.is_empty(), "{name}: {warnings:?}");
    }
}

#[test]
fn layers_of_rock_begin_at_the_level_of_the_sea() {
    // Were the layers counted from 0, the land by the shore would be in the upper part of one, which presses it down by
    // hundreds of metres.
    let text = "spacing_m = 10\nsea_level_m = 950\n[fluvial]\ntrunk_m = 640\nlevels = 2\nbase_m = 100\nceiling_m = 10000\n\
                knee = 0.9\nhill_slope = [0.005, 0.005]\nstrata = { thickness_m = 1000, steepness = 20, cliff = 0.5 }\n\
                coast = { depth_m = 1, below = 0 }\n";
    let world = World::new(Preset::parse("layers.toml", text).unwrap(), None).unwrap();
    let (min_m, max_m) = world.height_range_m();
    let heights = world.relief().heights(Area::new(0, 0, 320, 320));
    let lowest_m = heights.values().iter().copied().fold(f32::INFINITY, f32::min);
    assert!(lowest_m > 900.0, "the lowest land is at {lowest_m} m: the sea's floor was pressed down");
    assert!(
        heights.values().iter().all(|height_m| (min_m..=max_m).contains(height_m)),
        "{lowest_m} is below {min_m} m"
    );
}

#[test]
fn a_bed_on_the_floor_of_the_sea_is_not_made_of_layers() {
    // The layers are thicker than all the land is high: what lies below 0 would be pressed down by most of one.
    let text = "spacing_m = 4\nsea_level_m = 0\n[fluvial]\ntrunk_m = 272\nlevels = 2\nbase_m = 0\ntrunk_slope = 0.0001\n\
                channel_slope = 0.05\nhill_slope = [0.005, 0.005]\nuplift = { mask = { wavelength_m = 64000, octaves = 3, from = -0.4, to = 0.4 }, \
                least = 0.08 }\nvalley = 0\ncrest_m = 0\nbend = 0.9\ngullies = 0.5\nceiling_m = 10\nknee = 0.1\n\
                strata = { thickness_m = 876, steepness = 17, cliff = 0.55 }\nrunoff_m = 6.3\nriver_width_m = 0.1\n\
                lakes = 0\ncoast = { below = -0.116, slope = [0.001, 0.174], depth_m = 7.8 }\n";
    let world = World::new(Preset::parse("layers.toml", text).unwrap(), Some(13_584_090_202_954_795_123)).unwrap();
    let (min_m, max_m) = world.height_range_m();
    for step in 0..40 {
        let heights = world.relief().heights(Area::new(step * 97, 0, 97, 97));
        let outside = heights.values().iter().find(|height_m| !(min_m..=max_m).contains(*height_m));
        assert_eq!(outside, None, "within {min_m} to {max_m} m");
    }
}
