//! Land of noise and tiles of it on every GPU that is there, beside the CPU: vertices a second, and whether the bits
//! are the same.
//!
//! `cargo bench --bench gpu`. The kernels alone, in groups of three sizes; all that comes back to the CPU; and the CPU on one thread
//! and on all.
//!
//! How far from the limits of an H200 (132 multiprocessors of 128 lanes at 2 GHz, 4.8 TB/s): the thesis' eight octaves
//! take about 1,400 instructions a vertex, of which a third are the exclusive ors that keep products and sums apart, so
//! 10^10 vertices a second are 43 % of what it can issue; the 4 bytes that each vertex is written as are 1 % of what
//! its memory takes. Of a tile 28 bytes a vertex come back: 10^9 vertices a second would be 28 GB/s through the bus and
//! into memory that is cleared first, of which 8 GB/s were reached.

use std::hint::black_box;
use std::sync::Arc;
use std::time::{Duration, Instant};

use rayon::prelude::*;
use terrane::area::{Area, TileId};
use terrane::clock::Clock;
use terrane::device::gpu::{Adapter, Gpu, NoiseMaker, adapters};
use terrane::device::{Cpu, LandMaker};
use terrane::preset::Preset;
use terrane::relief::Relief;
use terrane::tile::{GroundRule, TilePlan, shaped_input};
use terrane::world::World;

/// Vertices to a side of what the kernels compute at once.
const SIDE: usize = 1024;
/// Areas, and tiles, that are read back at once.
const AREAS: usize = 8;
const ROUNDS: usize = 5;

fn main() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    keep_memory();
    let adapters = adapters();
    if adapters.is_empty() {
        println!("no GPU, or no driver of one");
    }
    for name in ["thesis", "hills", "mountains"] {
        let (_, mut preset) = Preset::load(name).expect("it is built in");
        // Agents are the CPU's.
        (preset.rivers, preset.roads) = (None, None);
        let world = World::new(preset, None).expect("built-in presets are sound");
        println!("\n{name}");
        cpu(&world);
        for adapter in &adapters {
            gpu(adapter, &world);
        }
    }
}

/// Makes the allocator keep what is given back, as the command does (`src/main.rs`).
#[cfg(all(target_os = "linux", target_env = "gnu"))]
#[allow(unsafe_code, reason = "there is no safe way to set up the C library's allocator")]
fn keep_memory() {
    // SAFETY: no other thread runs yet, and both are parameters that it knows.
    unsafe {
        libc::mallopt(libc::M_MMAP_THRESHOLD, 32 << 20);
        libc::mallopt(libc::M_TRIM_THRESHOLD, 512 << 20);
    }
}

/// Vertices a second as millions.
fn rate(vertices: usize, time: Duration) -> String {
    format!("{:10.1} Mvertices/s", vertices as f64 / time.as_secs_f64() / 1e6)
}

/// The least time of some rounds, for a busy machine only ever adds to it.
fn best(rounds: usize, mut work: impl FnMut()) -> Duration {
    let round = |_| {
        let start = Instant::now();
        work();
        start.elapsed()
    };
    (0..rounds).map(round).min().expect("there are rounds")
}

fn cpu(world: &World) {
    let relief = world.relief();
    let one = best(ROUNDS, || drop(black_box(relief.heights(Area::new(1024, -3072, 512, 512)))));
    println!("  {:44} {}", "CPU, one thread", rate(512 * 512, one));
    let (threads, maker) = (rayon::current_num_threads(), Cpu::maker(relief));
    let areas = areas(256, 4 * threads);
    let all = best(ROUNDS, || drop(black_box(maker.lands(&areas, &Clock::default()).unwrap())));
    println!("  {:44} {}", format!("CPU, {threads} threads"), rate(areas.len() * 256 * 256, all));
    let count = 4 * threads;
    let tiles = best(ROUNDS, || {
        plans(world, count)
            .into_par_iter()
            .for_each(|plan| drop(black_box(maker.tiles(world, vec![plan], &Clock::default()).unwrap())));
    });
    let vertices = count * (world.tile_cells() as usize + 1).pow(2);
    println!("  {:44} {}", format!("CPU, {threads} threads, whole tiles"), rate(vertices, tiles));
}

/// Some areas side by side.
fn areas(side: usize, count: usize) -> Vec<Area> {
    (0..count).map(|index| Area::new(1024 + (index * side) as i64, -3072, side, side)).collect()
}

/// Plans of some tiles side by side.
fn plans(world: &World, count: usize) -> Vec<TilePlan> {
    let id = |index: usize| TileId { x: 4 + index as i64, y: -12 };
    (0..count).map(|index| TilePlan::new(world, id(index), &Clock::default()).unwrap()).collect()
}

fn gpu(adapter: &Adapter, world: &World) {
    println!("  {}, {}", adapter.name(), adapter.driver());
    let Relief::Noise(relief) = world.relief() else { return };
    let rounds = if adapter.is_software() { 1 } else { ROUNDS };
    for group_side in [8, 16, 32] {
        let title = format!("groups of {group_side} x {group_side}");
        let gpu = match Gpu::open(adapter, group_side) {
            Ok(gpu) => Arc::new(gpu),
            Err(reason) => {
                println!("  {title:44} {reason}");
                continue;
            }
        };
        let maker = NoiseMaker::new(gpu, Arc::clone(relief), GroundRule::of(world));
        let times = if adapter.is_software() { 1 } else { 200 };
        let kernels = |land: Area, cells: Option<Area>| {
            let time = (0..rounds).filter_map(|_| maker.kernel_time(land, cells, times)).min();
            time.map_or_else(|| "failed".into(), |time| rate(cells.unwrap_or(land).len(), time))
        };
        println!(
            "  {title:44} {}   {}",
            kernels(Area::new(1024, -3072, SIDE, SIDE), None),
            maker.probe().map_or_else(|reason| reason, |()| "the CPU's bits".into())
        );
        // As large as a submission takes whole.
        let cells = Area::new(1024, -3072, SIDE / 2, SIDE / 2);
        println!("  {:44} {}", format!("{title}, tiles"), kernels(shaped_input(world, cells), Some(cells)));
        if group_side == 8 {
            let (areas, clock) = (areas(SIDE, AREAS), Clock::default());
            let back = best(rounds, || drop(black_box(maker.lands(&areas, &clock).unwrap())));
            println!("  {:44} {}", "read back", rate(AREAS * SIDE * SIDE, back));
            let wide = World::new(world.preset().clone(), None).expect("it is sound").with_tile_cells(SIDE as u32);
            let back = best(rounds, || drop(black_box(maker.tiles(&wide, plans(&wide, AREAS), &clock).unwrap())));
            println!("  {:44} {}", "tiles read back", rate(AREAS * (SIDE + 1).pow(2), back));
            let clock = Clock::default();
            let whole = best(1, || drop(black_box(maker.tiles(&wide, plans(&wide, AREAS), &clock).unwrap())));
            let stages = clock.stages().into_iter().map(|(stage, spent)| format!("{stage} {spent:.1?}"));
            println!("    of {whole:.1?}: {}", stages.collect::<Vec<_>>().join(", "));
        }
    }
}
