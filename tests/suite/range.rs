//! The height range is proved from the preset: random worlds try to leave it.

use proptest::prelude::*;

use terrane::area::Area;
use terrane::preset::Preset;
use terrane::preset::ground::GroundSettings;
use terrane::preset::map::MapStyle;
use terrane::recipe::mask::Mask;
use terrane::relief::settings::{LandMask, NoiseKind, NoiseTerm, WarpSettings};
use terrane::world::World;

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
            spacing_m: 1.0,
            tile_cells: 16,
            sea_level_m: None,
            noise,
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
