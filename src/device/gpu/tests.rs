//! The GPU beside the CPU. On a machine without one, or a program that does as if it were one, these tests say that they skip.

use std::sync::Arc;

use super::*;
use crate::area::{Area, MAX_COORDINATE, Stride};
use crate::clock::Clock;
use crate::device::{Device, LandMaker};
use crate::preset::Preset;
use crate::relief::{NoiseRelief, Relief};
use crate::world::World;

/// The GPU that the tests run on.
fn adapter() -> Option<Adapter> {
    let adapter = adapters().into_iter().next();
    if adapter.is_none() {
        eprintln!("SKIPPED: no GPU, and no program that does as if it were one");
    }
    adapter
}

/// Noise of the built-in presets, near and from afar: all kinds of fractals, warped and not, with masks.
fn worlds() -> Vec<World> {
    let strides = [1, 2, 16, 256].map(|vertices| Stride::new(vertices).expect("a power of two"));
    let world = |(name, stride): (&str, Stride)| {
        let (_, preset) = Preset::load(name).expect("it is built in");
        World::strided(preset, Some(77), stride).expect("it is sound")
    };
    ["thesis", "hills", "mountains"]
        .into_iter()
        .flat_map(|name| strides.map(|stride| (name, stride)))
        .map(world)
        .collect()
}

fn noise(world: &World) -> Arc<NoiseRelief> {
    match world.relief() {
        Relief::Noise(noise) => Arc::clone(noise),
        Relief::Fluvial(_) => panic!("a world of noise"),
    }
}

/// Areas of all forms: smaller than a block, across many, at the ends of the world.
fn scenes() -> Vec<Area> {
    vec![
        Area::new(0, 0, 1, 1),
        Area::new(-1, -1, 3, 2),
        Area::new(63, 31, 2, 2),
        Area::new(-700, 400, 261, 259),
        Area::new(5, -90, 1, 300),
        Area::new(-3, 7, 500, 1),
        Area::new(1 << 40, -(1 << 41), 130, 70),
        Area::new(-MAX_COORDINATE, MAX_COORDINATE - 50, 65, 50),
    ]
}

#[test]
fn heights_have_the_bits_of_the_cpu() {
    let Some(adapter) = adapter() else { return };
    for group_side in [8, 16, 32] {
        let gpu = Arc::new(Gpu::open(&adapter, group_side, Arithmetic::Exact).expect("a GPU that can be opened"));
        for world in worlds() {
            let maker = GpuMaker::new(Arc::clone(&gpu), noise(&world));
            let lands = maker.lands(&scenes(), &Clock::default());
            assert_eq!(maker.trouble(), None);
            for (area, land) in scenes().into_iter().zip(lands) {
                let reference = world.relief().heights(area);
                let bits = |values: &[f32]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
                assert!(
                    bits(land.heights.values()) == bits(reference.values()),
                    "{area:?}, stride {}, groups of {group_side}",
                    world.stride().vertices()
                );
            }
        }
    }
}

#[test]
fn more_than_a_submission_takes_goes_in_several() {
    let Some(adapter) = adapter() else { return };
    let gpu = Arc::new(Gpu::open(&adapter, 8, Arithmetic::Exact).expect("a GPU that can be opened"));
    let world = worlds().remove(0);
    let maker = GpuMaker::new(gpu, noise(&world));
    // Together more than a submission, the second alone as well.
    let areas = [Area::new(-9, -9, 300, 200), Area::new(-1500, 64, 1490, 1500), Area::new(7, 7, 40, 90)];
    let lands = maker.lands(&areas, &Clock::default());
    assert_eq!(maker.trouble(), None);
    for (area, land) in areas.into_iter().zip(lands) {
        assert!(land.heights == world.relief().heights(area), "{area:?}");
    }
}

#[test]
fn what_a_lost_gpu_cannot_make_the_cpu_makes() {
    let Some(adapter) = adapter() else { return };
    let gpu = Arc::new(Gpu::open(&adapter, 8, Arithmetic::Exact).expect("a GPU that can be opened"));
    let world = worlds().remove(0);
    let maker = GpuMaker::new(Arc::clone(&gpu), noise(&world));
    let area = Area::new(40, -80, 100, 50);
    let whole = maker.lands(&[area], &Clock::default()).remove(0);
    gpu.lose();
    for _ in 0..2 {
        assert_eq!(maker.lands(&[area], &Clock::default()).remove(0).heights, whole.heights);
    }
    assert!(maker.trouble().is_some_and(|trouble| trouble.contains(&adapter.name())), "{:?}", maker.trouble());
}

#[test]
fn a_gpu_that_cannot_be_used_says_why() {
    let Some(adapter) = adapter() else { return };
    let refused = Gpu::open(&adapter, 256, Arithmetic::Exact).map(drop).expect_err("no GPU takes so many threads");
    assert!(refused.contains("takes groups of at most") && refused.contains("not 256 x 256"), "{refused}");
    let (_, preset) = Preset::load("alps").expect("it is built in");
    let world = World::new(preset, None).expect("it is sound");
    let error = Device::Gpu.maker(world.relief(), 8).map(drop).expect_err("it has rivers");
    assert_eq!((error.exit_code(), error.to_string()), (1, "GPUs make land of noise, not land with rivers".into()));
    let (maker, reason) = Device::Auto.maker(world.relief(), 8).expect("the CPU makes it");
    assert!(maker.name().starts_with("cpu") && reason.is_some(), "{} {reason:?}", maker.name());
}

#[test]
fn shaders_are_valid() {
    for source in [Arithmetic::Exact, Arithmetic::Approximate].map(relief_shader) {
        let module =
            naga::front::wgsl::parse_str(&source).unwrap_or_else(|error| panic!("{}", error.emit_to_string(&source)));
        let mut validator =
            naga::valid::Validator::new(naga::valid::ValidationFlags::all(), naga::valid::Capabilities::empty());
        validator.validate(&module).unwrap_or_else(|error| panic!("{}", error.emit_to_string(&source)));
    }
}
