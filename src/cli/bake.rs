//! `terrane bake` and `terrane tile`.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::thread;
use std::time::{Duration, Instant};

use serde_json::json;

use crate::area::{Place, Region};
use crate::bake::Watch;
use crate::cli::args::Job;
use crate::cli::console::Console;
use crate::cli::progress::Progress;
use crate::error::Error;
use crate::export::{Bytes, Cost, Output, Plan};
use crate::preset::Preset;
use crate::tile::Tile;
use crate::world::World;

/// Bakes what the command line asks for.
pub(super) fn run(job: &Job, console: &Console) -> Result<(), Error> {
    let options = &job.common;
    // What is asked for, checked before anything is written.
    let (name, mut preset) = Preset::load(&job.preset)?;
    preset.tile_cells = options.tile_cells.unwrap_or(preset.tile_cells);
    let world = World::new(preset, options.seed)?;
    let exports = job.exports()?;
    let region = Region::new(job.at, job.size.0, job.size.1, world.tile_cells())?;
    let mut plan = Plan::new(&world, &name, region, exports)?.with_meshes(job.meshes())?;
    if let Some(profile) = job.profile()? {
        plan = plan.with_profile(profile)?;
    }
    let threads = match options.threads {
        Some(threads) => threads as usize,
        None => thread::available_parallelism().map_or(1, usize::from),
    };
    let cost = plan.cost(threads);
    let out = options.out.clone().unwrap_or_else(|| Path::new("out").join(&name));
    if options.dry_run {
        if !options.quiet {
            print_plan(console, &plan, &cost, &world, threads, &out)?;
        }
        return Output::check(&out, options.overwrite, &cost);
    }
    // The bake, which an interrupt stops between two tiles.
    let watch = Arc::new(Watch::default());
    let told = Arc::clone(&watch);
    // Without a handler an interrupt still ends the program; it only leaves what was half-written.
    _ = ctrlc::set_handler(move || told.cancelled.store(true, Ordering::Relaxed));
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().map_err(|error| Error::Option {
        message: format!("{threads} threads cannot be started: {error}"),
        hint: "give fewer with --threads".into(),
    })?;
    let output = Output::prepare(&out, options.overwrite, &cost)?;
    let start = Instant::now();
    let manifest = thread::scope(|scope| {
        let shown = !options.quiet && !options.no_progress;
        let cells = (region.tile_cells() as u64).pow(2);
        let _progress = shown.then(|| Progress::start(scope, console, &watch, region.tiles(), cells));
        pool.install(|| plan.run(&output, &watch))
    })?;
    let elapsed = start.elapsed();
    if options.verbose {
        print_stages(console, &watch)?;
    }
    if options.quiet {
        return Ok(());
    }
    // What there is now.
    let bytes: u64 = manifest.files.iter().map(|file| file.bytes).sum();
    let rate = region.vertices() as f64 / elapsed.as_secs_f64() / 1e6;
    let object = json!({
        "type": "done", "out": out.to_string_lossy(), "files": manifest.files.len() + 1, "bytes": bytes, "tiles": region.tiles(),
        "vertices": region.vertices(), "seconds": elapsed.as_secs_f64(), "mvertices_per_second": rate,
    });
    let text = format!(
        "{}: {} x {} vertices in {} files, {}, {:.2} s ({rate:.1} Mvertices/s)\n",
        out.display(),
        region.width(),
        region.height(),
        manifest.files.len() + 1,
        Bytes(bytes),
        elapsed.as_secs_f64(),
    );
    console.message(object, &text)
}

fn print_plan(
    console: &Console,
    plan: &Plan,
    cost: &Cost,
    world: &World,
    threads: usize,
    out: &PathBuf,
) -> Result<(), Error> {
    let region = plan.region();
    let (min_m, max_m) = world.height_range_m();
    let step_m = (max_m - min_m) / 65535.0;
    let seconds = estimate(world, region, cost, threads).as_secs_f64();
    let object = json!({
        "type": "plan", "out": out.to_string_lossy(), "tiles": region.tiles(), "width": region.width(), "height": region.height(),
        "min_m": min_m, "max_m": max_m, "step_m": step_m, "files": cost.files, "disk_bytes_at_most": cost.disk_bytes,
        "memory_bytes": cost.memory_bytes, "seconds": seconds, "threads": threads,
    });
    let mut text = String::new();
    let mut line = |what: &str, value: String| writeln!(text, "{what:9}{value}").expect("a String takes everything");
    line("folder", out.display().to_string());
    line("region", format!("{} tiles, {} x {} vertices", region.tiles(), region.width(), region.height()));
    line("heights", format!("{min_m} to {max_m} m, {step_m:.4} m a step of 16 bits"));
    line("files", format!("{}, at most {}", cost.files, Bytes(cost.disk_bytes)));
    line("memory", format!("about {}", Bytes(cost.memory_bytes)));
    line("time", format!("about {seconds:.1} s on {threads} threads"));
    console.message(object, &text)
}

/// Raw bytes that one thread encodes a second, with the settings of the exports: the middle of what they reach.
const ENCODED_BYTES_A_SECOND: f64 = 600e6;

/// How long a bake will take: the region's middle tile is made to see, and encoding is added.
fn estimate(world: &World, region: &Region, cost: &Cost, threads: usize) -> Duration {
    let middle = region.tile(Place { row: region.rows() / 2, col: region.cols() / 2 });
    let time = || {
        let start = Instant::now();
        std::hint::black_box(Tile::new(world, middle));
        start.elapsed().as_secs_f64()
    };
    // The first tile pays for memory that later ones find there.
    let tile_seconds = (0..3).map(|_| time()).fold(f64::INFINITY, f64::min);
    let at_once = (threads as u64).min(region.tiles()) as f64;
    let seconds = (tile_seconds * region.tiles() as f64 + cost.disk_bytes as f64 / ENCODED_BYTES_A_SECOND) / at_once;
    Duration::from_secs_f64(seconds.min(1e15))
}

fn print_stages(console: &Console, watch: &Watch) -> Result<(), Error> {
    let stages = watch.clock.stages();
    let total: f64 = stages.iter().map(|(_, spent)| spent.as_secs_f64()).sum();
    for (stage, spent) in stages {
        let seconds = spent.as_secs_f64();
        let share = 100.0 * seconds / total;
        let object = json!({ "type": "stage", "stage": stage, "seconds": seconds, "percent": share });
        console.message(object, &format!("{seconds:9.3} s {share:5.1} %  {stage}\n"))?;
    }
    Ok(())
}
