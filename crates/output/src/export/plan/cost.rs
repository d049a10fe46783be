//! The cost of a bake: memory is bounded by the plan; disk and time are measured on sample tiles, which are baked
//! and thrown away.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::time::Duration;

use rayon::prelude::*;

use crate::agents::record::TileRecord;
use crate::area::{Place, TileId};
use crate::bake::{self, FileRecord, rows_in_flight, shard_store};
use crate::error::Error;
use crate::export::folder::registry_file;
use crate::export::formats::format::folder;
use crate::export::plan::memory::told;
use crate::export::{Export, Mode, Output, Plan};
use crate::file::{free_bytes, make_folder};
use crate::land::Land;
use crate::memory::Usage;
use crate::registry;
use crate::stop::Stop;
use crate::tile::{accumulation_input, shaped_input};
use crate::watch::Watch;

/// The files that a bake will leave and the resources that it needs.
#[derive(Clone, Debug, PartialEq)]
pub struct Cost {
    /// Number of files, the manifest included.
    pub files: u64,
    /// Bytes of memory besides those that the world remembers.
    working_bytes: u64,
    /// Largest number of bytes that the world remembers.
    remembered_bytes: u64,
    /// The forecast from sample tiles, if any were baked.
    pub forecast: Option<Forecast>,
}

/// A forecast of disk and time for a bake, from some of its tiles.
#[derive(Clone, Debug, PartialEq)]
pub struct Forecast {
    /// Bytes on the disk, with a margin: as a rule a bake takes less.
    pub disk_bytes: u64,
    /// Bytes on the disk in each folder of the bake, by the folder's name.
    folders: BTreeMap<String, u64>,
    /// Approximate duration; `None` for a merge, whose tiles are there already.
    pub time: Option<Duration>,
    /// Bytes that a world will remember.
    remembered_bytes: u64,
}

impl Forecast {
    /// Bytes of the files in a folder of the bake.
    pub(crate) fn folder_bytes(&self, folder: &str) -> u64 {
        self.folders.get(folder).copied().unwrap_or(0)
    }
}

impl Plan<'_> {
    /// Estimates what the bake will leave and need on `threads` threads, as far as possible without baking sample
    /// tiles.
    pub fn cost(&self, threads: usize) -> Cost {
        let request = self.request_of_made();
        let files = self.exports().iter().map(|export| export.0.files(&request)).fold(0, u64::saturating_add);
        // Two for the manifest and the registry, and the files that a profile adds.
        let written = self.profile().map_or(0, |profile| profile.written().len() as u64);
        let files = files.saturating_add(2 + written);
        // The agents of a walk remember only their records.
        let remembered_bytes = self.walk().map_or_else(|| self.world().memory_bytes(self.made().cols()), |_| 0);
        // Asked for now, before sample tiles leave something in memory.
        let working_bytes = told(threads, working_bytes(self, files, threads), 0);
        Cost { files, working_bytes, remembered_bytes, forecast: None }
    }

    /// Adds a forecast to the cost: sample tiles are baked and thrown away on the threads of the current rayon pool.
    ///
    /// # Errors
    /// When the sample tiles cannot be baked, or the work is stopped.
    pub fn forecast(&self, cost: Cost, stop: &Stop) -> Result<Cost, Error> {
        Ok(Cost { forecast: Some(self.trial(stop)?.forecast(self)), ..cost })
    }
}

impl Cost {
    /// Returns an upper bound for the bytes of memory that may be in use.
    pub fn memory_bytes(&self) -> u64 {
        let of_tiles = self.forecast.as_ref().map_or(u64::MAX, |forecast| forecast.remembered_bytes);
        // Twice, as in `told`.
        self.working_bytes.saturating_add(self.remembered_bytes.min(of_tiles).saturating_mul(2))
    }

    /// True if the disk may be too small for the bake, so that sample tiles are worth baking. The limit of 4 KiB for
    /// each vertex and export is exceeded only where contours are very close.
    pub fn may_fill(&self, plan: &Plan, out: &Path) -> bool {
        const MOST_BYTES: u64 = 4 << 10;
        let most = plan.vertices().saturating_mul(MOST_BYTES * plan.exports().len() as u64);
        free_bytes(out).is_some_and(|free| free < most)
    }
}

/// Bytes of a file's entry in the manifest, rounded up: a path, a hash, and some numbers with their names.
const RECORD_BYTES: u64 = 512;

/// Returns an upper bound for the memory that the bake of a plan takes, besides what the world remembers.
fn working_bytes(plan: &Plan, files: u64, threads: usize) -> u64 {
    let (world, region, request) = (plan.world(), plan.made(), plan.request_of_made());
    let tile = region.at().area(region.tile_cells());
    let around = shaped_input(world, tile).hull(&accumulation_input(tile)).len() as u64;
    let vertices = tile.len() as u64;
    // A thread holds at most 16 numbers of 32 bits for each vertex of the land around its tile: heights and water before
    // and after a step, and shares of its flow. It holds as many for each vertex of the tile: normals, weights, samples
    // and a file of them. A mesh has 12 numbers a vertex, and 6 for the two triangles of a cell; it is held as surface,
    // model, buffer and file.
    let is_mesh = plan.exports().iter().any(|export| export.0.options().contains(&"--lod"));
    let land = around * 64 + vertices * if is_mesh { 320 } else { 64 };
    // Whoever looks for lakes and coasts holds a square of land.
    let searched = if world.relief().fluvial().is_some() { SEARCHED.pow(2) * Land::VERTEX_BYTES } else { 0 };
    // Pieces of rows of tiles: one batch waits while the next is made. A shard packs those of a tile, and a merge holds
    // a batch in packed form too.
    let kept = vertices * plan.kept_a_vertex();
    let batches = if plan.is_merge() { 3 } else { 2 };
    let waiting = region.cols().saturating_mul(rows_in_flight(&region, threads)).saturating_mul(batches * kept);
    // The tiles around a walker, with those that one step past a corner makes, and the records of its agents.
    let walking = plan.walk().map_or(0, |walk| {
        let side = 2 * u64::from(walk.tour().layers) + 2;
        (side * side * around * 64).saturating_add(plan.tiles().saturating_mul(2 * TileRecord::BYTES as u64))
    });
    let held = plan.exports().iter().map(|export| export.0.held_bytes(&request, threads));
    let parts = [
        threads as u64 * (land + searched + 2 * kept),
        waiting,
        walking,
        // The manifest lists all files, and is made in memory when they are finished.
        files.saturating_mul(RECORD_BYTES),
        plan.maker().host_bytes(threads),
    ];
    parts.into_iter().chain(held).fold(0, u64::saturating_add)
}

/// Side in vertices of the largest square of land in which lakes and coasts are looked for.
const SEARCHED: u64 = 1024;

/// Safety factor for the forecast of disk: other tiles may take more than the mean of the sample.
const MARGIN: f64 = 2.0;

/// Bytes of a manifest without its list of files: a recipe of some kilobytes.
const MANIFEST_BYTES: u64 = 8 << 10;

/// Bytes of one text that a profile writes, rounded up: the longest has 33 KB.
const WRITTEN_BYTES: u64 = 48 << 10;

/// Bytes of files, by kind.
type Sizes = BTreeMap<FileKind, f64>;

/// A kind of files: those of one export in one folder of the bake.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct FileKind {
    export: String,
    folder: String,
    /// True if a bake has these files once, however many tiles it has: lists in the folder of the bake that describe
    /// other files, and the sidecar files that georeference a picture of the region.
    is_once: bool,
}

impl FileKind {
    fn of(file: &FileRecord) -> FileKind {
        let folder = folder(&file.path).to_owned();
        let places = [".aux.xml", ".pgw"].iter().any(|ending| file.path.ends_with(ending));
        let is_once = (folder.is_empty() && file.export != shard_store::EXPORT) || (places && file.tile.is_none());
        FileKind { export: file.export.clone(), folder, is_once }
    }
}

/// Sample tiles of a bake, each baked alone and thrown away.
#[derive(Debug, Default)]
pub struct Trial {
    tiles: u64,
    /// Bytes of the sample's files; and bytes of the files that hold features, if features are cut off at the tile's
    /// edge.
    sizes: Sizes,
    clipped: Sizes,
    /// Bytes that files have before they hold any tile.
    heads: Sizes,
    /// For each export that grows by other units than tiles: the units in the sample, and the seconds that finishing it
    /// took.
    ended: BTreeMap<&'static str, (u64, f64)>,
    /// Seconds of one thread to plan the surroundings of a tile, and then to make the tile while `at_once` threads
    /// work.
    planning_s: f64,
    making_s: f64,
    at_once: usize,
    /// Contents of the world's caches after it had made the first tile.
    usages: Vec<Usage>,
}

/// Size of the sample: as many tiles as have `LOOKED_AT_VERTICES` vertices, or one tile of `ONE_OF` if that is more,
/// and at most `MOST_TILES`. Enough to see land and sea, for a second of work or a sixteenth of the bake.
const LOOKED_AT_VERTICES: u64 = 1 << 19;
const ONE_OF: u64 = 16;
const MOST_TILES: u64 = 16;

/// Number of sample tiles for which exports that take long to finish, such as maps at all scales, are baked too.
const ENDED: usize = 2;

impl Plan<'_> {
    /// Bakes sample tiles and throws them away, on the threads of the current rayon pool. One trial serves all shards
    /// of the bake.
    ///
    /// # Errors
    /// When the sample tiles cannot be baked, or the work is stopped.
    pub fn trial(&self, stop: &Stop) -> Result<Trial, Error> {
        let (tiles, exports, own) = (spread(self), self.exports(), self.vectors().clipped);
        let request = self.request_of_made();
        let grows = |export: &Export| export.0.units(&request).is_some() && self.shard().is_none();
        let of_tiles: Vec<Export> = exports.iter().copied().filter(|export| !grows(export)).collect();
        let cut: Vec<Export> =
            of_tiles.iter().copied().filter(|export| export.0.options().contains(&"--clip")).collect();
        let bake = |(index, tile): (usize, &TileId)| {
            let exports = if index < ENDED { exports } else { &of_tiles };
            Baked::of(&self.of_tile(*tile, own, exports.to_vec())?, stop)
        };
        // The first tile is baked alone, to measure the time of its planning and what the world remembers of it.
        let first = bake((0, &tiles[0]))?;
        let mut trial = Trial { tiles: tiles.len() as u64, usages: self.world().usages(), ..Trial::default() };
        let others = tiles.par_iter().enumerate().skip(1).map(bake).collect::<Result<Vec<Baked>, Error>>()?;
        let baked: Vec<Baked> = std::iter::once(first).chain(others).collect();
        for one in &baked {
            add(&mut trial.sizes, &one.sizes);
        }
        // Bake again with features cut off at the tile's edge: the parts beyond the edge grow with the region's edge,
        // not with its area.
        if !own && !cut.is_empty() && self.shard().is_none() {
            let clipped = tiles.par_iter().map(|tile| Baked::of(&self.of_tile(*tile, true, cut.clone())?, stop));
            for one in clipped.collect::<Result<Vec<Baked>, Error>>()? {
                add(&mut trial.clipped, &one.sizes);
            }
        }
        for export in exports.iter().filter(|_| self.shard().is_none()) {
            add(&mut trial.heads, &head(&self.of_tile(tiles[0], own, vec![*export])?)?);
            for (tile, one) in tiles.iter().zip(&baked).take(ENDED).filter(|_| grows(export)) {
                let units = export.0.units(&self.of_tile(*tile, own, Vec::new())?.request()).unwrap_or(0);
                let ended = trial.ended.entry(export.name()).or_default();
                *ended = (ended.0 + units, ended.1 + one.seconds(|stage| stage == format!("finish {export}")));
            }
        }
        // Bake once more, with as many tiles at a time as in the bake. The surroundings are planned already, so only
        // making counts.
        let is_made = |stage: &str| !stage.starts_with("finish ") && stage != bake::JOURNAL;
        let seconds = |baked: &[Baked]| baked.iter().map(|one| one.seconds(is_made)).sum::<f64>() / baked.len() as f64;
        trial.at_once = rayon::current_num_threads().min(tiles.len());
        let again = tiles.par_iter().take(trial.at_once);
        let again = again.map(|tile| Baked::of(&self.of_tile(*tile, own, of_tiles.clone())?, stop));
        trial.making_s = seconds(&again.collect::<Result<Vec<Baked>, Error>>()?);
        trial.planning_s = (seconds(&baked[..1]) - trial.making_s).max(0.0);
        Ok(trial)
    }
}

impl Trial {
    /// Forecasts a bake of the same world and exports.
    pub fn forecast(&self, plan: &Plan) -> Forecast {
        let (request, region) = (plan.request_of_made(), plan.made());
        let tiles = request.tiles() as f64;
        let edge = (region.cols() + region.rows()) as f64 / 2.0;
        let units = |name: &str| {
            let export = plan.exports().iter().find(|export| export.name() == name);
            export.and_then(|export| export.0.units(&request)).unwrap_or(0) as f64
        };
        let mut folders: BTreeMap<String, f64> = BTreeMap::new();
        let count = self.tiles as f64;
        for (kind, bytes) in &self.sizes {
            let bytes = if let Some((looked_at, _)) = self.ended.get(&kind.export[..]) {
                bytes / (*looked_at).max(1) as f64 * units(&kind.export)
            } else if kind.is_once && !self.heads.contains_key(kind) {
                bytes / count
            } else {
                let head = self.heads.get(kind).copied().unwrap_or(0.0);
                let within = self.clipped.get(kind).copied().unwrap_or(*bytes);
                head + (within / count - head).max(0.0) * tiles + (bytes - within) / count * edge
            };
            *folders.entry(kind.folder.clone()).or_default() += bytes * MARGIN;
        }
        let files = plan.cost(1).files;
        let written = plan.profile().map_or(0, |profile| profile.written().len() as u64 * WRITTEN_BYTES);
        let lists = registry_file::bytes(plan, files) + MANIFEST_BYTES + files.saturating_mul(RECORD_BYTES) + written;
        // The pieces of a walk's tiles stay on the disk until the last tile is made.
        let kept = plan.walk().map_or(0, |_| request.vertices().saturating_mul(plan.kept_a_vertex()));
        let whole = folders.values().sum::<f64>() as u64;
        Forecast {
            disk_bytes: whole.saturating_add(lists).saturating_add(kept),
            folders: folders.into_iter().map(|(folder, bytes)| (folder, bytes as u64)).collect(),
            time: (!plan.is_merge()).then(|| self.time(plan, tiles, units)),
            remembered_bytes: self.remembered_bytes(plan),
        }
    }

    fn time(&self, plan: &Plan, tiles: f64, units: impl Fn(&str) -> f64) -> Duration {
        // The agents of a walk plan nothing.
        let planned = if plan.walk().is_some() { 0.0 } else { growth(plan, plan.world().planned_whole_around()) };
        let ending_s = self.ended.iter().map(|(name, (looked_at, s))| s / (*looked_at).max(1) as f64 * units(name));
        let work_s = self.planning_s * planned + self.making_s * tiles + ending_s.sum::<f64>();
        // A `Duration` panics beyond 2^64 seconds, and no one waits for that long.
        Duration::from_secs_f64((work_s / self.at_once as f64).min(1e15))
    }

    /// Estimates the bytes that a world remembers: they grow with the planned area, up to the limit of each cache.
    fn remembered_bytes(&self, plan: &Plan) -> u64 {
        let growth = growth(plan, plan.world().planned_around());
        // A cache with large values may already hold more than its limit.
        let remembered = |usage: &Usage| (usage.held as f64 * growth).min(usage.most as f64).max(usage.held as f64);
        self.usages.iter().map(remembered).sum::<f64>() as u64
    }
}

/// Returns the ratio of the area that is planned for a bake to the area planned for one of its tiles. `around` is the
/// width in vertices of the margin that is planned around either of them.
fn growth(plan: &Plan, around: i64) -> f64 {
    let side = |vertices: u64| vertices as f64 + 2.0 * around as f64;
    let region = plan.made();
    side(region.width()) * side(region.height()) / side(region.tile_cells().into()).powi(2)
}

/// Sizes and times of the bake of one tile, whose files are removed again.
struct Baked {
    sizes: Sizes,
    stages: Vec<(String, Duration)>,
}

impl Baked {
    fn of(plan: &Plan, stop: &Stop) -> Result<Baked, Error> {
        let aside = aside()?;
        let (out, watch) = (aside.path().join("bake"), Watch::stopped_by(stop));
        let output = Output::prepare(&out, Mode::New, plan, &plan.cost(1))?;
        let manifest = plan.run(&output, &watch)?;
        let files = manifest.all_files(&out);
        Ok(Baked {
            sizes: by_kind(files.iter().filter(|file| file.export != registry::EXPORT)),
            stages: watch.clock.stages(),
        })
    }

    /// Returns the seconds of one thread that the chosen stages took.
    fn seconds(&self, is_meant: impl Fn(&str) -> bool) -> f64 {
        self.stages.iter().filter(|(stage, _)| is_meant(stage)).map(|(_, spent)| spent.as_secs_f64()).sum()
    }
}

/// Returns the bytes of the files of a one-tile plan in which the tile shows nothing, for exports whose files have
/// bytes besides those of tiles.
fn head(plan: &Plan) -> Result<Sizes, Error> {
    let aside = aside()?;
    for folder in plan.folders() {
        make_folder(&aside.path().join(folder))?;
    }
    let (mut files, watch) = (Vec::new(), Watch::default());
    for export in plan.exports() {
        let Some(blank) = export.0.blank_pieces(&plan.request()) else { continue };
        for (number, sink) in export.0.sinks(&plan.request(), aside.path())?.into_iter().enumerate() {
            if let Some(piece) = blank.get(number) {
                sink.append(0, &[piece], &watch.clock)?;
            }
            files.extend(sink.finish(&watch)?);
        }
    }
    Ok(by_kind(files.iter()))
}

/// Makes a temporary folder, which is removed with its contents when dropped.
fn aside() -> Result<tempfile::TempDir, Error> {
    tempfile::tempdir().map_err(Error::io(std::env::temp_dir()))
}

fn by_kind<'a>(files: impl Iterator<Item = &'a FileRecord>) -> Sizes {
    let mut bytes = Sizes::new();
    for file in files {
        *bytes.entry(FileKind::of(file)).or_default() += file.bytes as f64;
    }
    bytes
}

fn add(sum: &mut Sizes, more: &Sizes) {
    for (kind, bytes) in more {
        *sum.entry(kind.clone()).or_default() += bytes;
    }
}

/// Chooses tiles of a plan, spread evenly over it and the same each time.
fn spread(plan: &Plan) -> Vec<TileId> {
    let (region, tiles) = (plan.made(), plan.tiles());
    let looked_at = LOOKED_AT_VERTICES / (u64::from(region.tile_cells()) + 1).pow(2);
    let count = looked_at.max(tiles / ONE_OF).clamp(1, MOST_TILES).min(tiles);
    let nth = |index: u64| (2 * index + 1) * tiles / (2 * count);
    let place = |index: u64| match count == tiles {
        true => Place { row: index / region.cols(), col: index % region.cols() },
        // Steps of the golden section from west to east put each column far from the columns before it.
        false => Place {
            row: (2 * index + 1) * region.rows() / (2 * count),
            col: ((index as f64 * GOLDEN).fract() * region.cols() as f64) as u64,
        },
    };
    let tile = |index: u64| match plan.walk() {
        Some(walk) => walk.tiles().iter().nth(nth(index) as usize).copied(),
        None => Some(region.tile(place(index))),
    };
    (0..count).filter_map(tile).collect::<BTreeSet<TileId>>().into_iter().collect()
}

/// The golden section: the larger part of a line of length 1.
const GOLDEN: f64 = 0.618_033_988_749_895;
