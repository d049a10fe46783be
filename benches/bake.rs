//! The whole bake: seconds, share of time per stage and peak memory, as the tables of docs/speed.md.
//!
//! `cargo bench --bench bake` bakes 8192 x 8192 vertices of each preset named below with the default exports, on all
//! cores, and then 32768 x 32768 vertices to a sink that only hashes, on two threads. It needs 2 GB of disk.

use std::fs;
use std::thread::available_parallelism;
use std::time::Instant;

use terrane::area::{Region, TileId};
use terrane::export::{Export, Mode, Output, Plan};
use terrane::preset::Preset;
use terrane::watch::Watch;
use terrane::world::World;

fn main() {
    let threads = available_parallelism().map_or(1, usize::from);
    for preset in ["thesis", "mountains", "alps"] {
        bench(preset, 8192, Export::DEFAULT, threads);
    }
    bench("thesis", 32768, "hashes", 2);
}

/// Bakes a square region and prints where time and memory went.
fn bench(name: &str, side: u64, exports: &str, threads: usize) {
    let (_, preset) = Preset::load(name).expect("it is built in");
    let world = World::new(preset, None).expect("built-in presets are sound");
    let tiles = side / world.tile_cells() as u64;
    let region = Region::new(TileId { x: 0, y: 0 }, tiles, tiles, world.tile_cells()).expect("it is a small region");
    let exports = Export::parse_list(exports).expect("they are known");
    let plan = Plan::new(&world, name, region, exports.clone()).expect("PNG holds this size");
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).expect("the target folder can be written to");
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a few threads can be started");
    let watch = Watch::default();
    forget_peak_memory();
    let start = Instant::now();
    let output = Output::prepare(folder.path(), Mode::New, &plan, &plan.cost(threads)).expect("there is room");
    let manifest = pool.install(|| plan.run(&output, &watch)).expect("the disk can be written to");
    let seconds = start.elapsed().as_secs_f64();
    let names = exports.iter().map(|export| export.name()).collect::<Vec<_>>().join(", ");
    let written: u64 = manifest.files.iter().map(|file| file.bytes).sum();
    println!("\n{name}, {side} x {side} vertices, {names}, {threads} threads:");
    println!(
        "{seconds:.2} s, {:.1} Mvertices/s, {} MB written, peak memory {} MB (planned {} MB)\n",
        region.vertices() as f64 / seconds / 1e6,
        written / 1_000_000,
        peak_memory_bytes().map_or("?".to_owned(), |bytes| (bytes / 1_000_000).to_string()),
        plan.cost(threads).memory_bytes() / 1_000_000,
    );
    println!("| stage | share of time | ns a vertex and core |\n|---|---|---|");
    let stages = watch.clock.stages();
    let total: f64 = stages.iter().map(|(_, spent)| spent.as_secs_f64()).sum();
    for (stage, spent) in stages {
        let spent = spent.as_secs_f64();
        println!("| {stage} | {:.1} % | {:.2} |", 100.0 * spent / total, spent / region.vertices() as f64 * 1e9);
    }
}

/// Makes the kernel count the peak of memory anew. Linux only; elsewhere nothing happens.
fn forget_peak_memory() {
    _ = fs::write("/proc/self/clear_refs", "5");
}

/// The most memory that was in use since then. Linux only.
fn peak_memory_bytes() -> Option<u64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    let kilobytes: u64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kilobytes * 1024)
}
