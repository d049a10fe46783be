//! `terrane bake`, `terrane tile` and `terrane extend`.

use std::fmt::Write as _;
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::thread;
use std::time::{Duration, Instant};

use serde_json::json;

use crate::area::{Region, Stride, TileId};
use crate::bake::Shard;
use crate::cli::args::{AskedRange, BakeArguments, ExtendArguments, Manner, RunOptions, WriteArguments};
use crate::cli::console::Console;
use crate::cli::progress::{Reporter, Tiles, watched};
use crate::device::LandMaker;
use crate::error::Error;
use crate::export::{
    Bytes, Cost, HeightRange, Limit, Manifest, MeshOptions, Mode, Output, Plan, PlanRequest, Profile, measured_range_m,
};
use crate::generator;
use crate::world::World;

/// Bakes the region that the command line asks for.
pub(super) fn run(arguments: &BakeArguments, console: &Console) -> Result<(), Error> {
    let write = &arguments.write;
    let (request, out) = requested(arguments, console)?;
    let plan = on_device(request.plan()?, &write.manner, console)?;
    carry_out(&plan, write.mode(), &out, &write.manner.run, console)
}

/// Returns the request that the command line makes, with the folder of the bake.
pub(super) fn requested(arguments: &BakeArguments, console: &Console) -> Result<(PlanRequest, PathBuf), Error> {
    let BakeArguments { world: asked, common: options, write, .. } = arguments;
    // Check all options before anything is written.
    if let Some(version) = &options.generator {
        generator::check(version)?;
    }
    let sources = arguments.sources()?;
    let name = sources.name().to_owned();
    let preset = sources.read_all()?;
    console.warnings(&preset.warnings(&sources));
    let place = arguments.place.located(&preset, asked.seed, console)?;
    let region = place.region(preset.tile_cells, preset.spacing_m)?;
    let region = if options.stride == Stride::ONE { region } else { region.strided(options.stride)? };
    let world = World::strided(preset, asked.seed, options.stride)?.with_tile_cells(region.tile_cells());
    console.warnings(&world.warnings());
    let (exports, mut profile) = (arguments.exports()?, arguments.profile()?);
    // With --add, the manifest of the bake that the files are added to.
    let old = write.folder.out.as_ref().filter(|_| write.add).map(|out| Manifest::read(out)).transpose()?;
    if let (None, Some(known)) = (profile, old.as_ref().and_then(|old| old.profile.as_ref())) {
        profile = Some(known.parse()?);
    }
    let mut request = PlanRequest {
        preset_name: name,
        world,
        region,
        exports,
        profile,
        meshes: MeshOptions::default(),
        vectors: options.vectors.options(),
        height_range_m: None,
        names: options.names,
        given: arguments.format_options(),
        shard: arguments.shard,
    };
    if !arguments.asks_for_size()
        && let Some(added) = request.fit_to_profile()?
    {
        say_fitted(console, &request, &region, &added)?;
    }
    let PlanRequest { preset_name, world, region, .. } = &request;
    let out = write.folder.out.clone().unwrap_or_else(|| default_folder(preset_name, world, region, arguments.shard));
    request.meshes = arguments.meshes(&request.region, request.world.spacing_m())?;
    request.height_range_m = match options.height_range {
        None => None,
        Some(AskedRange::Metres(range_m)) => Some(range_m),
        Some(AskedRange::Auto) => auto_range_m(&request, &out, write, console)?,
    };
    if write.add {
        request.add_to(&old.map_or_else(|| Manifest::read(&out), Ok)?)?;
    }
    Ok((request, out))
}

/// Returns the range of heights of a region in metres: as recorded by a bake that was begun in the folder, otherwise
/// measured here. A dry run measures nothing.
fn auto_range_m(
    request: &PlanRequest,
    out: &Path,
    options: &WriteArguments,
    console: &Console,
) -> Result<Option<[f32; 2]>, Error> {
    if options.manner.run.dry_run {
        return Ok(None);
    }
    let begun = (options.folder.resume || options.add).then_some(out);
    let measure = |world: &World, region: &Region| {
        watched(console, options.manner.run.threads, |watch| measured_range_m(world, region, watch))
    };
    request.region_range_m(begun, measure)
}

/// Extends a bake to a larger region: bakes the tiles that are missing.
pub(super) fn extend(arguments: &ExtendArguments, console: &Console) -> Result<(), Error> {
    let ExtendArguments { folder, place, manner } = arguments;
    let manifest = Manifest::read(folder)?;
    manifest.check_is_no_walk(folder)?;
    manifest.check_is_no_shard(folder)?;
    let world = manifest.world()?;
    let old = manifest.region.region()?;
    let place = place.located(&manifest.preset, Some(manifest.seed), console)?;
    let region = match (place.bounds.is_some() || place.around.is_some(), place.at, place.size) {
        (true, ..) => place.region(old.tile_cells(), world.spacing_m())?,
        (false, None, None) => {
            return Err(Error::Region {
                message: "no larger region is given".into(),
                hint: format!("give its size in tiles, such as --size {}x{}", 2 * old.cols(), 2 * old.rows()),
            });
        }
        (false, at, size) => {
            let at = at.unwrap_or(old.at());
            // The default size reaches to the old region's far edges.
            let until = |old: i64, count: u64, at: i64| (old + count as i64).saturating_sub(at).max(1) as u64;
            let rest = (until(old.at().x, old.cols(), at.x), until(old.at().y, old.rows(), at.y));
            let (cols, rows) = size.unwrap_or(rest);
            Region::new(at, cols, rows, old.tile_cells())?
        }
    };
    let plan = Plan::of_region(&manifest, &world, region)?;
    if let Some([min_m, max_m]) = manifest.chosen_range_m(&world).filter(|_| manifest.reads("--height-range")) {
        console.warnings(&[format!(
            "16-bit heights stay those of {min_m} to {max_m} m: land beyond them is written as they are"
        )]);
    }
    let plan = on_device(plan, manner, console)?;
    carry_out(&plan, Mode::Extend, folder, &manner.run, console)
}

/// Prints which region a profile gets instead of the default one.
fn say_fitted(console: &Console, request: &PlanRequest, asked: &Region, options: &str) -> Result<(), Error> {
    let (profile, fitted) = (request.profile.map_or("", Profile::name), &request.region);
    let object = json!({
        "type": "fitted", "profile": profile, "at": [fitted.at().x, fitted.at().y], "cols": fitted.cols(),
        "rows": fitted.rows(), "tile_cells": fitted.tile_cells(), "options": options,
    });
    let text = format!(
        "profile {} does not take {} x {} tiles of {} cells; the nearest that it takes: {} x {} tiles of {} cells, {} x {} \
         vertices; added: {options}\n",
        profile,
        asked.cols(),
        asked.rows(),
        asked.tile_cells(),
        fitted.cols(),
        fitted.rows(),
        fitted.tile_cells(),
        fitted.width(),
        fitted.height(),
    );
    console.message(object, &text)
}

/// Returns the default folder of a bake: a different one for each seed, place and shard.
pub(super) fn default_folder(name: &str, world: &World, region: &Region, shard: Option<Shard>) -> PathBuf {
    let TileId { x, y } = region.at();
    let (seed, cols, rows) = (world.seed(), region.cols(), region.rows());
    let scale = world.stride().vertices();
    let scale = if scale == 1 { String::new() } else { format!("-scale{scale}") };
    let shard = shard.map_or(String::new(), |shard| format!("-shard{}of{}", shard.number(), shard.of()));
    Path::new("out").join(format!("{name}-seed{seed}-x{x}-y{y}-{cols}x{rows}{scale}{shard}"))
}

/// Returns the plan with the maker of land that the options ask for.
pub(super) fn on_device<'a>(plan: Plan<'a>, options: &Manner, console: &Console) -> Result<Plan<'a>, Error> {
    let maker = options.device.maker(plan.world(), console)?;
    Ok(plan.with_maker(maker))
}

/// Says that some tiles are baked to see what a bake takes, if they may take long.
pub(super) fn announce_trial(console: &Console, world: &World) {
    if console.shows_progress() && world.relief().fluvial().is_some() {
        // A closed standard error is ignored: there is nowhere else to report it.
        _ = writeln!(io::stderr(), "baking some tiles, to see what the bake takes");
    }
}

/// Returns a sentence about the trouble of a maker of land, if it had any.
pub(super) fn trouble(maker: &dyn LandMaker) -> Vec<String> {
    let sentence = |trouble| format!("the CPU has made what was left of the land: {trouble}");
    maker.trouble().map(sentence).into_iter().collect()
}

/// Bakes a plan into a folder, or prints its costs for a dry run.
pub(super) fn carry_out(
    plan: &Plan<'_>,
    mode: Mode,
    out: &Path,
    options: &RunOptions,
    console: &Console,
) -> Result<(), Error> {
    let (world, region) = (plan.world(), plan.made());
    let threads = options.threads.count();
    let pool = options.threads.pool()?;
    let mut cost = plan.cost(threads);
    // Keep a refusal until the plan is printed: a dry run prints the costs even of a bake that is refused.
    let hint = "give fewer --threads, a narrower --size or fewer exports";
    let short = |cost: &Cost| Limit::check("the bake", cost.memory_bytes(), hint);
    let refused = Output::check(out, mode, plan, &cost);
    console.warnings(&plan.warnings());
    let may_lack_room = || refused.is_ok() && (cost.may_fill(plan, out) || short(&cost).is_err());
    if (options.dry_run && !console.messages.quiet) || may_lack_room() {
        announce_trial(console, world);
        cost = pool.install(|| plan.forecast(cost, &console.stop))?;
    }
    if options.dry_run {
        print_plan(console, plan, &cost, world, threads, out)?;
    }
    refused.and_then(|()| short(&cost)).and_then(|()| Output::check(out, mode, plan, &cost))?;
    if options.dry_run {
        return Ok(());
    }
    // The bake.
    let watch = console.watch();
    let output = Output::prepare(out, mode, plan, &cost)?;
    console.warnings(&output.lock_warning());
    let start = Instant::now();
    let baked = thread::scope(|scope| {
        let tiles = Tiles { count: plan.tiles(), cells: (region.tile_cells() as u64).pow(2) };
        let _reporter = Reporter::start(scope, console, &watch, Some(tiles));
        pool.install(|| {
            console.warnings(&output.changed_warnings(&watch)?);
            plan.run(&output, &watch)
        })
    });
    let manifest = baked.inspect_err(|_| {
        // Without a work folder nothing is kept, for example if no format can hold the output.
        if output.can_resume() && !console.messages.quiet {
            let goes_on = match mode {
                Mode::New | Mode::Resume => "the same command with --resume",
                Mode::Replace => "the same command with --resume in the place of --overwrite",
                Mode::Add | Mode::Extend | Mode::Repair => "the same command",
            };
            // A closed standard error is ignored: there is nowhere else to report it.
            _ = writeln!(io::stderr(), "{}: what was made is kept: {goes_on} goes on with it", out.display());
        }
    })?;
    console.warnings(&output.kept_warnings());
    console.warnings(&trouble(plan.maker()));
    let elapsed = start.elapsed();
    console.stages(&watch)?;
    print_done(console, plan, &output, (out, &manifest), elapsed)
}

/// Prints the summary of a finished bake.
fn print_done(
    console: &Console,
    plan: &Plan<'_>,
    output: &Output,
    (out, manifest): (&Path, &Manifest),
    elapsed: Duration,
) -> Result<(), Error> {
    let (world, region) = (plan.world(), plan.made());
    let bytes: u64 = manifest.files.iter().map(|file| file.bytes).sum();
    let rate = plan.vertices() as f64 / elapsed.as_secs_f64() / 1e6;
    let object = json!({
        "type": "done", "out": out.to_string_lossy(), "files": manifest.files.len() + 1, "bytes": bytes, "tiles": plan.tiles(),
        "vertices": plan.vertices(), "bounds_km": region.bounds_km(world.spacing_m()),
        "seconds": elapsed.as_secs_f64(), "mvertices_per_second": rate, "files_untouched": output.untouched(),
        "files_renewed": output.renewed().len(),
    });
    if output.was_whole() {
        let text =
            format!("{}: is whole already: {} files, {}\n", out.display(), manifest.files.len() + 1, Bytes(bytes));
        return console.message(object, &text);
    }
    let part = match (plan.walk(), plan.shard()) {
        (Some(_), _) => format!("a walk to {} tiles of ", plan.tiles()),
        (_, Some(shard)) => format!("shard {shard}, "),
        _ => String::new(),
    };
    let text = format!(
        "{}: {part}{} x {} vertices, {}, in {} files, {}, {:.2} s ({rate:.1} Mvertices/s)\n",
        out.display(),
        region.width(),
        region.height(),
        kilometres(&region, world.spacing_m()),
        manifest.files.len() + 1,
        Bytes(bytes),
        elapsed.as_secs_f64(),
    );
    console.message(object, &text)
}

/// Formats the width and height of a region in kilometres.
fn kilometres(region: &Region, spacing_m: f64) -> String {
    let [west, south, east, north] = region.bounds_km(spacing_m);
    // Round to millimetres: the subtraction leaves noise in the last digits.
    let km = |from: f64, to: f64| ((to - from) * 1e6).round() / 1e6;
    format!("{} x {} km", km(west, east), km(south, north))
}

fn print_plan(
    console: &Console,
    plan: &Plan,
    cost: &Cost,
    world: &World,
    threads: usize,
    out: &Path,
) -> Result<(), Error> {
    let region = &plan.made();
    let (min_m, max_m) = plan.height_range_m();
    let step_m = (max_m - min_m) / 65535.0;
    let disk_bytes = cost.forecast.as_ref().map(|forecast| forecast.disk_bytes);
    let seconds = cost.forecast.as_ref().and_then(|forecast| forecast.time).map(|time| time.as_secs_f64());
    let object = json!({
        "type": "plan", "out": out.to_string_lossy(), "tiles": plan.tiles(), "width": region.width(),
        "height": region.height(), "bounds_km": region.bounds_km(world.spacing_m()), "min_m": min_m,
        "max_m": max_m, "step_m": step_m, "files": cost.files,
        "disk_bytes": disk_bytes, "memory_bytes": cost.memory_bytes(), "seconds": seconds, "threads": threads,
    });
    let mut text = String::new();
    let mut line = |what: &str, value: String| writeln!(text, "{what:9}{value}").expect("a String takes everything");
    line("folder", out.display().to_string());
    if let Some(walk) = plan.walk() {
        line("walk", walk.tour().to_string());
    }
    if let Some(shard) = plan.shard() {
        let whole = plan.region();
        line("shard", format!("{shard} of {} x {} tiles", whole.cols(), whole.rows()));
    }
    line("region", format!("{} tiles, {} x {} vertices", plan.tiles(), region.width(), region.height()));
    let [west, south, east, north] = region.bounds_km(world.spacing_m());
    let size = kilometres(region, world.spacing_m());
    line("ground", format!("{size}, from {west} to {east} km east and from {south} to {north} km north"));
    let [low, high] = HeightRange { min_m, max_m, step_m }.written_m();
    line("heights", format!("{low} to {high} m, {step_m:.4} m a step of 16 bits"));
    let room = disk_bytes.map_or(String::new(), |bytes| format!(", up to {}", Bytes(bytes)));
    line("files", format!("{}{room}", cost.files));
    line("memory", format!("up to {}", Bytes(cost.memory_bytes())));
    if let Some(seconds) = seconds {
        line("time", format!("about {seconds:.1} s on {threads} threads"));
    }
    console.message(object, &text)
}
