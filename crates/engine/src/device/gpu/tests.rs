//! Tests of the GPU against the CPU. On a machine with neither a GPU nor a software implementation of one, these tests
//! print that they are skipped.

use std::cell::Cell;
use std::sync::Arc;

use bytemuck::cast_slice;
use wgpu::util::{BufferInitDescriptor, DeviceExt};
use wgpu::{
    BindGroupDescriptor, BindGroupEntry, BufferDescriptor, BufferUsages, CommandEncoderDescriptor,
    ComputePassDescriptor, ComputePipelineDescriptor, MapMode, PipelineCompilationOptions, PipelineLayoutDescriptor,
    PollType, ShaderModuleDescriptor, ShaderSource,
};

use super::*;
use crate::area::{Area, MAX_COORDINATE, Stride, TileId};
use crate::clock::{Clock, stage};
use crate::device::LandMaker;
use crate::hash;
use crate::preset::Preset;
use crate::relief::Relief;
use crate::tile::{GroundRule, Tile, TilePlan};
use crate::world::World;

/// Returns the GPU for the tests.
fn adapter() -> Option<Adapter> {
    let adapter = adapters().into_iter().next();
    if adapter.is_none() {
        eprintln!("SKIPPED: no GPU, and no program that does as if it were one");
    }
    adapter
}

/// Returns worlds of noise of the built-in presets, at full resolution and at coarse strides: with all kinds of
/// fractals, with and without warp, with masks.
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

fn maker(gpu: Arc<Gpu>, world: &World) -> NoiseMaker {
    match world.relief() {
        Relief::Noise(noise) => NoiseMaker::new(gpu, Arc::clone(noise), GroundRule::of(world)),
        Relief::Fluvial(_) => panic!("a world of noise"),
    }
}

/// Asserts that the GPU made everything that it can make.
fn assert_made_there(clock: &Clock) {
    let stages: Vec<String> = clock.stages().into_iter().map(|(stage, _)| stage).collect();
    assert!(stages.iter().any(|name| name == stage::GPU_READS), "{stages:?}");
    let own = [stage::RELIEF, stage::NORMALS];
    assert!(!stages.iter().any(|name| own.contains(&name.as_str())), "{stages:?}");
}

/// Returns areas of all shapes: smaller than a block, across many blocks, and at the ends of the world.
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
    let gpus = [8, 16, 32].map(|side| Arc::new(Gpu::open(&adapter, side).expect("a GPU that can be opened")));
    // Each preset has more strides than there are sizes of groups, so that it is tried with all of them.
    for (world, gpu) in worlds().into_iter().zip(gpus.iter().cycle()) {
        let maker = maker(Arc::clone(gpu), &world);
        let lands = maker.lands(&scenes(), &Clock::default()).unwrap();
        assert_eq!(maker.trouble(), None);
        for (area, land) in scenes().into_iter().zip(lands) {
            let reference = world.relief().heights(area);
            let bits = |values: &[f32]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
            assert!(
                bits(land.heights.values()) == bits(reference.values()),
                "{area:?}, stride {}, groups of {}",
                world.stride().vertices(),
                gpu.group_side
            );
        }
    }
}

#[test]
fn more_than_a_submission_takes_goes_in_several() {
    let Some(adapter) = adapter() else { return };
    let gpu = Arc::new(Gpu::open(&adapter, 8).expect("a GPU that can be opened"));
    let world = worlds().remove(0);
    let maker = maker(gpu, &world);
    // All areas together exceed a submission, and so does the second alone.
    let areas = [Area::new(-9, -9, 300, 200), Area::new(-1500, 64, 1490, 1500), Area::new(7, 7, 40, 90)];
    let lands = maker.lands(&areas, &Clock::default()).unwrap();
    assert_eq!(maker.trouble(), None);
    for (area, land) in areas.into_iter().zip(lands) {
        assert!(land.heights == world.relief().heights(area), "{area:?}");
    }
}

/// The caller that asks for one tile may hold a lock that other work of the same pool waits for, so no such work may
/// begin on its thread.
#[test]
fn a_tile_is_made_without_other_work_of_the_pool() {
    thread_local!(static IS_MAKING: Cell<bool> = const { Cell::new(false) });
    let Some(adapter) = adapter() else { return };
    let gpu = Arc::new(Gpu::open(&adapter, 8).expect("a GPU that can be opened"));
    let pool = rayon::ThreadPoolBuilder::new().num_threads(4).build().expect("a pool");
    let (_, preset) = Preset::load("mountains").expect("it is built in");
    let world = World::new(preset, Some(3)).expect("it is sound").with_tile_cells(32);
    let maker = maker(gpu, &world);
    let make = &|x: i64| {
        assert!(!IS_MAKING.replace(true), "another tile was begun while one was made");
        let plan = TilePlan::without_lines(&world, TileId { x, y: 0 });
        drop(maker.tiles(&world, vec![plan], &Clock::default()).unwrap());
        IS_MAKING.set(false);
    };
    // All jobs wait in one queue. Each idle thread takes the next job, or work that another thread has started to
    // share.
    pool.scope(|scope| (0..64).for_each(|x| scope.spawn(move |_| make(x))));
    assert_eq!(maker.trouble(), None);
}

#[test]
fn what_a_lost_gpu_cannot_make_the_cpu_makes() {
    let Some(adapter) = adapter() else { return };
    let gpu = Arc::new(Gpu::open(&adapter, 8).expect("a GPU that can be opened"));
    let world = worlds().remove(0);
    let maker = maker(Arc::clone(&gpu), &world);
    let area = Area::new(40, -80, 100, 50);
    let whole = maker.lands(&[area], &Clock::default()).unwrap().remove(0);
    gpu.lose();
    for _ in 0..2 {
        assert_eq!(maker.lands(&[area], &Clock::default()).unwrap().remove(0).heights, whole.heights);
    }
    assert!(maker.trouble().is_some_and(|trouble| trouble.contains(&adapter.name())), "{:?}", maker.trouble());
}

#[test]
fn a_gpu_that_cannot_be_used_says_why() {
    let Some(adapter) = adapter() else { return };
    let refused = Gpu::open(&adapter, 256).map(drop).expect_err("no GPU takes so many threads");
    assert!(refused.contains("takes groups of at most") && refused.contains("not 256 x 256"), "{refused}");
}

#[test]
fn a_gpu_that_gives_the_bits_of_the_cpu_is_used() {
    let Some(adapter) = adapter() else { return };
    assert_eq!(probe(&adapter), Ok(()));
}

/// Returns a world of noise with agents' lines, and one whose ground depends on the surroundings of each vertex.
fn tiled() -> Vec<World> {
    let thesis = Preset::load("thesis").expect("it is built in").1;
    let mut rough = Preset::load("mountains").expect("it is built in").1;
    rough.ground.scree = Some([0.3, 0.9]);
    rough.ground.forest_m = Some([800.0, 1500.0]);
    rough.ground.forest_aspect_m = 120.0;
    rough.ground.meadow = Some([0.01, 0.1]);
    let world = |preset: Preset| World::new(preset, Some(5)).expect("it is sound").with_tile_cells(96);
    vec![world(thesis), world(rough)]
}

#[test]
fn tiles_have_the_bits_of_the_cpu() {
    let Some(adapter) = adapter() else { return };
    let gpu = Arc::new(Gpu::open(&adapter, 16).expect("a GPU that can be opened"));
    let mut shaped = 0;
    for world in tiled() {
        let maker = maker(Arc::clone(&gpu), &world);
        let ids: Vec<TileId> = (-3..3).flat_map(|x| [-1, 40_000_000].map(|y| TileId { x, y })).collect();
        let plan = |id: &TileId| TilePlan::new(&world, *id, &Clock::default()).unwrap();
        let clock = Clock::default();
        let tiles = maker.tiles(&world, ids.iter().map(plan).collect(), &clock).unwrap();
        assert_eq!(maker.trouble(), None);
        assert_made_there(&clock);
        for (id, tile) in ids.into_iter().zip(tiles) {
            let reference = Tile::new(&world, id);
            shaped += usize::from(tile.imprint().is_some());
            assert_eq!(tile.digest(), reference.digest(), "{id:?}");
            assert!(tile.normals().slope() == reference.normals().slope(), "slopes of {id:?}");
            let dirt = |tile: &Tile| tile.imprint().map(|imprint| imprint.dirt().cloned().collect::<Vec<_>>());
            assert!(dirt(&tile) == dirt(&reference), "dirt of {id:?}");
            let water = |tile: &Tile| tile.imprint()?.dug().map(|dug| (dug.water.clone(), dug.cut_m.clone()));
            assert!(water(&tile) == water(&reference), "water of {id:?}");
        }
    }
    assert!(shaped > 2, "{shaped} tiles with lines");
}

/// Computes quotients and roots of pairs of numbers on a GPU, with the arithmetic of the shader text `exact`.
fn quotients_and_roots(gpu: &Gpu, exact: &str, pairs: &[[f32; 2]]) -> Vec<[f32; 2]> {
    let arithmetic = [&adapter::inputs(), exact].join("\n");
    let kernel = "@compute @workgroup_size(64)
        fn arithmetic(@builtin(global_invocation_id) id: vec3<u32>) {
            if id.x < same[0] {
                put_f32(2u * id.x, div(own_f32(2u * id.x), own_f32(2u * id.x + 1u)));
                put_f32(2u * id.x + 1u, root(own_f32(2u * id.x)));
            }
        }";
    let source = ShaderSource::Wgsl(format!("{arithmetic}\n{kernel}").into());
    let module = gpu.device.create_shader_module(ShaderModuleDescriptor { label: None, source });
    let layout = gpu.device.create_pipeline_layout(&PipelineLayoutDescriptor {
        label: None,
        bind_group_layouts: &[Some(&gpu.layout)],
        immediate_size: 0,
    });
    let pipeline = gpu.device.create_compute_pipeline(&ComputePipelineDescriptor {
        label: None,
        layout: Some(&layout),
        module: &module,
        entry_point: Some("arithmetic"),
        compilation_options: PipelineCompilationOptions::default(),
        cache: None,
    });
    let given = |contents: &[u8], usage: BufferUsages| {
        gpu.device.create_buffer_init(&BufferInitDescriptor { label: None, contents, usage })
    };
    let size = 8 * pairs.len() as u64;
    let room = |usage: BufferUsages| {
        gpu.device.create_buffer(&BufferDescriptor { label: None, size, usage, mapped_at_creation: false })
    };
    let job = given(cast_slice(&[0u32; 3]), BufferUsages::UNIFORM);
    let same = given(cast_slice(&[pairs.len() as u32]), BufferUsages::STORAGE);
    let own = given(cast_slice(pairs), BufferUsages::STORAGE);
    let planes = room(BufferUsages::STORAGE | BufferUsages::COPY_SRC);
    let back = room(BufferUsages::COPY_DST | BufferUsages::MAP_READ);
    let entries: Vec<BindGroupEntry<'_>> = (0..)
        .zip([&job, &same, &own, &planes])
        .map(|(binding, buffer)| BindGroupEntry { binding, resource: buffer.as_entire_binding() })
        .collect();
    let descriptor = BindGroupDescriptor { label: None, layout: &gpu.layout, entries: &entries };
    let group = gpu.device.create_bind_group(&descriptor);
    let mut encoder = gpu.device.create_command_encoder(&CommandEncoderDescriptor::default());
    {
        let mut pass = encoder.begin_compute_pass(&ComputePassDescriptor::default());
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups((pairs.len() as u32).div_ceil(64), 1, 1);
    }
    encoder.copy_buffer_to_buffer(&planes, 0, &back, 0, size);
    gpu.queue.submit([encoder.finish()]);
    back.map_async(MapMode::Read, .., |result| result.expect("it can be read"));
    gpu.device.poll(PollType::wait_indefinitely()).expect("it ends");
    let bytes = back.get_mapped_range(..).expect("it is mapped");
    cast_slice(&bytes).to_vec()
}

#[test]
fn quotients_and_roots_have_the_bits_of_the_cpu() {
    let Some(adapter) = adapter() else { return };
    let gpu = Gpu::open(&adapter, 8).expect("a GPU that can be opened");
    // Numbers from 2^-60 to 2^60, with few significant bits and with many, powers of two and the numbers just beside
    // them.
    let number = |stream: u64, index: u64| {
        let bits = hash::lattice(stream, index as i64, 0);
        let exponent = 67 + (bits >> 32) as u32 % 120;
        let fraction = match bits >> 61 {
            0 => 0,
            1 => 0x7f_ffff - (bits as u32 & 3),
            2 => bits as u32 & 3,
            3 => bits as u32 & 0x7f_0000,
            _ => bits as u32 & 0x7f_ffff,
        };
        f32::from_bits(exponent << 23 | fraction)
    };
    let pairs: Vec<[f32; 2]> = (0..1_000_000)
        .map(|index| {
            let sign = |number: f32, bit: u64| if index >> bit & 1 == 1 { -number } else { number };
            // Signs vary. In every third pair the dividend is a rounded multiple of the divisor, so the quotient is
            // close to a float.
            let b = sign(number(2, index), 1);
            match index % 3 {
                0 => [number(1, index) / 2.0f32.powi(30), b],
                1 => [(b * number(3, index % 4096)).abs(), b],
                _ => [number(1, index), b],
            }
        })
        .filter(|[a, b]| (a / b).is_finite() && (a / b).abs() > f32::MIN_POSITIVE && a.is_normal())
        .chain([[0.0, 3.0], [0.0, -7.5], [1.0, 3.0], [16_777_215.0, 16_777_216.0], [4.0, 2.0], [2.0, 4.0]])
        .collect();
    assert!(pairs.len() > 990_000);
    let exact = adapter::EXACT;
    // Simulates a GPU whose own quotients and roots are off by six units in the last place; the rules allow three.
    let worse = exact.replace("8388608.0", "8388613.0").replace("2896.3093", "2896.311");
    assert!(worse.contains("8388613.0") && worse.contains("2896.311"), "{exact}");
    for arithmetic in [exact, &worse] {
        // No dividend is negative, so each has a root.
        for ([a, b], [quotient, root]) in pairs.iter().zip(quotients_and_roots(&gpu, arithmetic, &pairs)) {
            assert_eq!(quotient.to_bits(), (a / b).to_bits(), "{a:e} / {b:e} is {quotient:e}, not {:e}", a / b);
            assert_eq!(root.to_bits(), a.sqrt().to_bits(), "the root of {a:e} is {root:e}, not {:e}", a.sqrt());
        }
    }
}

#[test]
fn shaders_are_valid() {
    for source in adapter::Shader::ALL.map(adapter::Shader::source) {
        let module =
            naga::front::wgsl::parse_str(&source).unwrap_or_else(|error| panic!("{}", error.emit_to_string(&source)));
        let mut validator =
            naga::valid::Validator::new(naga::valid::ValidationFlags::all(), naga::valid::Capabilities::empty());
        validator.validate(&module).unwrap_or_else(|error| panic!("{}", error.emit_to_string(&source)));
    }
}
