//! Land of noise on every GPU that is there, beside the CPU: vertices a second, and whether the bits are the same.
//!
//! `cargo bench --bench gpu`. The kernel alone, exact and approximate, in groups of three sizes; all that comes back to the CPU; and the
//! CPU on one thread and on all.

use std::hint::black_box;
use std::sync::Arc;
use std::time::{Duration, Instant};

use rayon::prelude::*;
use terrane::area::Area;
use terrane::clock::Clock;
use terrane::device::LandMaker;
use terrane::device::gpu::{Adapter, Arithmetic, Gpu, GpuMaker, adapters};
use terrane::preset::Preset;
use terrane::relief::{NoiseRelief, Relief};
use terrane::world::World;

/// Vertices to a side of what the kernel computes at once.
const SIDE: usize = 1024;
/// Areas that are read back at once.
const AREAS: usize = 8;
const ROUNDS: usize = 5;

fn main() {
    let adapters = adapters();
    if adapters.is_empty() {
        println!("no GPU, or no driver of one");
    }
    for name in ["thesis", "hills", "mountains"] {
        let (_, preset) = Preset::load(name).expect("it is built in");
        let world = World::new(preset, None).expect("built-in presets are sound");
        let Relief::Noise(relief) = world.relief() else { continue };
        println!("\n{name}");
        cpu(relief);
        for adapter in &adapters {
            gpu(adapter, relief);
        }
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

fn cpu(relief: &NoiseRelief) {
    let one = best(ROUNDS, || drop(black_box(relief.heights(Area::new(1024, -3072, 512, 512)))));
    println!("  {:44} {}", "CPU, one thread", rate(512 * 512, one));
    let areas = areas(256, 4 * rayon::current_num_threads());
    let all = best(ROUNDS, || areas.par_iter().for_each(|area| drop(black_box(relief.heights(*area)))));
    println!(
        "  {:44} {}",
        format!("CPU, {} threads", rayon::current_num_threads()),
        rate(areas.len() * 256 * 256, all)
    );
}

/// Some areas side by side.
fn areas(side: usize, count: usize) -> Vec<Area> {
    (0..count).map(|index| Area::new(1024 + (index * side) as i64, -3072, side, side)).collect()
}

fn gpu(adapter: &Adapter, relief: &Arc<NoiseRelief>) {
    println!("  {}, {}", adapter.name(), adapter.driver());
    let rounds = if adapter.is_software() { 1 } else { ROUNDS };
    for (name, arithmetic) in [("exact", Arithmetic::Exact), ("approximate", Arithmetic::Approximate)] {
        for group_side in [8, 16, 32] {
            let title = format!("{name}, groups of {group_side} x {group_side}");
            let gpu = match Gpu::open(adapter, group_side, arithmetic) {
                Ok(gpu) => Arc::new(gpu),
                Err(reason) => {
                    println!("  {title:44} {reason}");
                    continue;
                }
            };
            let maker = GpuMaker::new(gpu, Arc::clone(relief));
            let times = if adapter.is_software() { 1 } else { 200 };
            let kernel = (0..rounds).filter_map(|_| maker.kernel_time(Area::new(1024, -3072, SIDE, SIDE), times)).min();
            let kernel = kernel.map_or_else(|| "failed".into(), |time| rate(SIDE * SIDE, time));
            println!(
                "  {title:44} {kernel}   {}",
                maker.probe().map_or_else(|reason| reason, |()| "the CPU's bits".into())
            );
            if group_side == 8 {
                let areas = areas(1024, AREAS);
                let clock = Clock::default();
                let back = best(rounds, || drop(black_box(maker.lands(&areas, &clock))));
                println!("  {:44} {}", format!("{name}, read back"), rate(AREAS * 1024 * 1024, back));
            }
        }
    }
}
