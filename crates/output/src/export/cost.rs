//! What a bake takes of the machine: memory by reasoning; disk and time by some of its tiles, which are baked and thrown away.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::time::Duration;

use rayon::prelude::*;

use crate::agents::record::TileRecord;
use crate::area::{Place, TileId};
use crate::bake::{self, FileRecord, rows_in_flight, store};
use crate::error::Error;
use crate::export::folder::free_bytes;
use crate::export::format::{FormatCost, folder};
use crate::export::memory;
use crate::export::{Export, Mode, Output, Plan, registry_file};
use crate::file::make_folder;
use crate::land::Land;
use crate::memory::Usage;
use crate::registry;
use crate::tile::shaped_input;
use crate::watch::Watch;

/// What a bake will leave and need.
#[derive(Clone, Debug, PartialEq)]
pub struct Cost {
    /// Files, the manifest among them.
    pub files: u64,
    threads: usize,
    /// Bytes of memory beside what worlds remember, and how many worlds do.
    working_bytes: u64,
    worlds: u64,
    /// The most that one remembers.
    remembered_bytes: u64,
    /// What tiles of it have said, if any were looked at.
    pub forecast: Option<Forecast>,
}

/// What a bake will leave on the disk, and how long it takes, by some of its tiles.
#[derive(Clone, Debug, PartialEq)]
pub struct Forecast {
    /// Bytes on the disk: with a margin, so that as a rule a bake takes less.
    pub disk_bytes: u64,
    /// Those of them in each folder of the bake, by its name.
    folders: BTreeMap<String, u64>,
    /// About how long it takes, if it is not a merge, whose tiles are there already.
    pub time: Option<Duration>,
    /// Bytes that a world will remember.
    remembered_bytes: u64,
}

impl Forecast {
    /// Bytes of the files in a folder of the bake.
    pub(super) fn folder_bytes(&self, folder: &str) -> u64 {
        self.folders.get(folder).copied().unwrap_or(0)
    }
}

impl Cost {
    /// What the bake of a plan takes on so many threads.
    pub(super) fn new(plan: &Plan, threads: usize) -> Cost {
        let format = plan.format_cost();
        // The manifest, the registry, and what a profile writes besides.
        let written = plan.profile().map_or(0, |profile| profile.written().len() as u64);
        let files = format.files.saturating_add(2 + written);
        // The agents of a walk remember their records alone.
        let remembered_bytes = plan.walk().map_or_else(|| plan.world().memory_bytes(plan.made().cols()), |_| 0);
        let working_bytes = working_bytes(plan, &format, files, threads);
        Cost { files, threads, working_bytes, worlds: 1 + format.worlds, remembered_bytes, forecast: None }
    }

    /// The cost, with what tiles have said.
    pub(super) fn with(self, forecast: Forecast) -> Cost {
        Cost { forecast: Some(forecast), ..self }
    }

    /// The most bytes of memory that may be in use.
    pub fn memory_bytes(&self) -> u64 {
        let of_tiles = self.forecast.as_ref().map_or(u64::MAX, |forecast| forecast.remembered_bytes);
        let remembered = self.remembered_bytes.min(of_tiles).saturating_mul(self.worlds);
        memory::told(self.threads, self.working_bytes, remembered)
    }

    /// Whether there may be too little room for the bake, so that it is worth to look at some of its tiles: no export takes so many
    /// bytes a vertex unless its contours are very close.
    pub fn may_fill(&self, plan: &Plan, out: &Path) -> bool {
        const MOST_BYTES: u64 = 4 << 10;
        let most = plan.vertices().saturating_mul(MOST_BYTES * plan.exports().len() as u64);
        free_bytes(out).is_some_and(|free| free < most)
    }
}

/// Bytes of a file's entry in the manifest, rounded up: a path, a hash, and some numbers with their names.
const RECORD_BYTES: u64 = 512;

/// The most memory of the bake of a plan on so many threads, beside the program and what worlds remember.
fn working_bytes(plan: &Plan, format: &FormatCost, files: u64, threads: usize) -> u64 {
    let (world, region) = (plan.world(), plan.made());
    let tile = region.at().area(region.tile_cells());
    let [shaped, vertices] = [shaped_input(world, tile), tile].map(|area| area.len() as u64);
    // The land that a tile is made of and another one that it is made from, four numbers of normal and slope and two words of weights.
    let land = shaped * 2 * Land::VERTEX_BYTES + vertices * (16 + 8);
    // What is kept of rows of tiles: one batch waits while the next is made. In a shard and in a merge it is packed besides.
    let kept = vertices * format.kept_a_vertex;
    let batch = region.cols().saturating_mul(rows_in_flight(&region, threads)).saturating_mul(kept);
    let packed = if plan.is_merge() { batch } else { 0 };
    let packing = if plan.shard().is_some() { 2 * kept } else { 0 };
    // Tiles stand around a walker, and as many as a step through a corner makes: heights, normals, weights, and what lines do to them.
    let walking = plan.walk().map_or(0, |walk| {
        let side = 2 * u64::from(walk.tour().layers) + 1;
        let records = plan.tiles().saturating_mul(2 * TileRecord::BYTES as u64);
        (side * side + 2 * side).saturating_mul(shaped * (4 + 16 + 8 + 20)).saturating_add(records)
    });
    let parts = [
        threads as u64 * (land + packing + format.thread_bytes),
        batch.saturating_mul(2),
        packed,
        walking,
        format.held_bytes,
        // The manifest lists all files, and is made in memory when they are finished.
        files.saturating_mul(RECORD_BYTES),
        plan.maker().host_bytes(threads),
    ];
    parts.into_iter().fold(0, u64::saturating_add)
}

/// How many times as much disk is told as tiles have taken on the mean, since others may take more.
const MARGIN: f64 = 2.0;

/// Bytes of a manifest without its files: a recipe of some kilobytes.
const MANIFEST_BYTES: u64 = 8 << 10;

/// Bytes of a text that a profile writes: the longest has 33 KB.
const WRITTEN_BYTES: u64 = 48 << 10;

/// Bytes of files, by kind.
type Sizes = BTreeMap<Kind, f64>;

/// A kind of files: those of an export in a folder of the bake.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Kind {
    export: String,
    folder: String,
    /// Whether a bake has them once, however many tiles there are: lists in the folder of the bake, which say what other files are,
    /// and what places a picture of the region beside it.
    is_once: bool,
}

impl Kind {
    fn of(file: &FileRecord) -> Kind {
        let folder = folder(&file.path).to_owned();
        let places = [".aux.xml", ".pgw"].iter().any(|ending| file.path.ends_with(ending));
        let is_once = (folder.is_empty() && file.export != store::EXPORT) || (places && file.tile.is_none());
        Kind { export: file.export.clone(), folder, is_once }
    }
}

/// Tiles of a bake, each baked alone and thrown away.
#[derive(Debug, Default)]
pub struct Trial {
    tiles: u64,
    /// What their files have, and those that hold features if these are cut off at the tile's edge.
    sizes: Sizes,
    clipped: Sizes,
    /// What files have before there is any tile in them.
    heads: Sizes,
    /// Of the exports that grow by something else than tiles how much of that there was, and seconds that it took to end them.
    ended: BTreeMap<&'static str, (u64, f64)>,
    /// Seconds of one thread to plan what lies around a tile, and to make it then, with so many threads at work.
    planning_s: f64,
    making_s: f64,
    at_once: usize,
    /// What the memories of the world held when it had made the first tile.
    usages: Vec<Usage>,
}

/// Of a large bake the tiles that are looked at: as many as have so many vertices, or one of so many if these are more. Enough to
/// see land and sea, for a second of work or a sixteenth of it.
const LOOKED_AT_VERTICES: u64 = 1 << 19;
const ONE_OF: u64 = 16;
const MOST_TILES: u64 = 16;

/// Those of them for which exports are baked that take long to end, such as maps at all scales.
const ENDED: usize = 2;

impl Trial {
    /// Bakes tiles of a plan on the threads of the current rayon pool.
    pub(super) fn take(plan: &Plan) -> Result<Trial, Error> {
        let (tiles, exports, own) = (spread(plan), plan.exports(), plan.vectors().clipped);
        let request = plan.request_of_made();
        let grows = |export: &Export| export.0.units(&request).is_some() && plan.shard().is_none();
        let of_tiles: Vec<Export> = exports.iter().copied().filter(|export| !grows(export)).collect();
        let cut: Vec<Export> =
            of_tiles.iter().copied().filter(|export| export.0.options().contains(&"--clip")).collect();
        let bake = |(index, tile): (usize, &TileId)| {
            let exports = if index < ENDED { exports } else { &of_tiles };
            Baked::of(&plan.of_tile(*tile, own, exports.to_vec())?)
        };
        // The first one alone: what is planned for it shows in what the world remembers, and how long that takes.
        let first = bake((0, &tiles[0]))?;
        let mut trial = Trial { tiles: tiles.len() as u64, usages: plan.world().usages(), ..Trial::default() };
        let others = tiles.par_iter().enumerate().skip(1).map(bake).collect::<Result<Vec<Baked>, Error>>()?;
        let baked: Vec<Baked> = std::iter::once(first).chain(others).collect();
        for one in &baked {
            add(&mut trial.sizes, &one.sizes);
        }
        // The same without what reaches out of a tile: of that there is as much as the region has edge.
        if !own && !cut.is_empty() && plan.shard().is_none() {
            let clipped = tiles.par_iter().map(|tile| Baked::of(&plan.of_tile(*tile, true, cut.clone())?));
            for one in clipped.collect::<Result<Vec<Baked>, Error>>()? {
                add(&mut trial.clipped, &one.sizes);
            }
        }
        for export in exports.iter().filter(|_| plan.shard().is_none()) {
            add(&mut trial.heads, &head(&plan.of_tile(tiles[0], own, vec![*export])?)?);
            for (tile, one) in tiles.iter().zip(&baked).take(ENDED).filter(|_| grows(export)) {
                let units = export.0.units(&plan.of_tile(*tile, own, Vec::new())?.request()).unwrap_or(0);
                let ended = trial.ended.entry(export.name()).or_default();
                *ended = (ended.0 + units, ended.1 + one.seconds(|stage| stage == format!("finish {export}")));
            }
        }
        // Once more, as many at a time as in the bake: what lies around is planned by now.
        let is_made = |stage: &str| !stage.starts_with("finish ") && stage != bake::JOURNAL;
        let seconds = |baked: &[Baked]| baked.iter().map(|one| one.seconds(is_made)).sum::<f64>() / baked.len() as f64;
        trial.at_once = rayon::current_num_threads().min(tiles.len());
        let again =
            tiles.par_iter().take(trial.at_once).map(|tile| Baked::of(&plan.of_tile(*tile, own, of_tiles.clone())?));
        trial.making_s = seconds(&again.collect::<Result<Vec<Baked>, Error>>()?);
        trial.planning_s = (seconds(&baked[..1]) - trial.making_s).max(0.0);
        Ok(trial)
    }

    /// What they say of a bake of the same world and exports.
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
        // What is kept of a walk's tiles is on the disk until the last one stands.
        let kept = plan.walk().map_or(0, |_| request.vertices().saturating_mul(plan.format_cost().kept_a_vertex));
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

    /// What is remembered grows with the area that is planned for, up to what memories hold.
    fn remembered_bytes(&self, plan: &Plan) -> u64 {
        let growth = growth(plan, plan.world().planned_around());
        // One whose values are large may hold more already than it should.
        let remembered = |usage: &Usage| (usage.held as f64 * growth).min(usage.most as f64).max(usage.held as f64);
        self.usages.iter().map(remembered).sum::<f64>() as u64
    }
}

/// How many times as much is planned for a bake as for one of its tiles, given the vertices around either for which it is.
fn growth(plan: &Plan, around: i64) -> f64 {
    let side = |vertices: u64| vertices as f64 + 2.0 * around as f64;
    let region = plan.made();
    side(region.width()) * side(region.height()) / side(region.tile_cells().into()).powi(2)
}

/// A bake of one tile, which is gone.
struct Baked {
    sizes: Sizes,
    stages: Vec<(String, Duration)>,
}

impl Baked {
    fn of(plan: &Plan) -> Result<Baked, Error> {
        let aside = aside()?;
        let (out, watch) = (aside.path().join("bake"), Watch::default());
        let output = Output::prepare(&out, Mode::New, plan, &plan.cost(1))?;
        let manifest = plan.run(&output, &watch)?;
        let files = manifest.all_files(&out);
        Ok(Baked {
            sizes: by_kind(files.iter().filter(|file| file.export != registry::EXPORT)),
            stages: watch.clock.stages(),
        })
    }

    /// Seconds of one thread that some stages took.
    fn seconds(&self, is_meant: impl Fn(&str) -> bool) -> f64 {
        self.stages.iter().filter(|(stage, _)| is_meant(stage)).map(|(_, spent)| spent.as_secs_f64()).sum()
    }
}

/// Bytes of the files of a plan of one tile that shows nothing, of exports whose files have bytes of their own.
fn head(plan: &Plan) -> Result<Sizes, Error> {
    let aside = aside()?;
    for folder in plan.folders() {
        make_folder(&aside.path().join(folder))?;
    }
    let mut files = Vec::new();
    for export in plan.exports() {
        let Some(blank) = export.0.blank_pieces(&plan.request()) else { continue };
        for (number, sink) in export.0.sinks(&plan.request(), aside.path())?.into_iter().enumerate() {
            if let Some(piece) = blank.get(number) {
                sink.append(0, &[piece])?;
            }
            files.extend(sink.finish(&Watch::default())?);
        }
    }
    Ok(by_kind(files.iter()))
}

/// A folder that is removed with all that is in it when it is dropped.
fn aside() -> Result<tempfile::TempDir, Error> {
    tempfile::tempdir().map_err(Error::io(std::env::temp_dir()))
}

fn by_kind<'a>(files: impl Iterator<Item = &'a FileRecord>) -> Sizes {
    let mut bytes = Sizes::new();
    for file in files {
        *bytes.entry(Kind::of(file)).or_default() += file.bytes as f64;
    }
    bytes
}

fn add(sum: &mut Sizes, more: &Sizes) {
    for (kind, bytes) in more {
        *sum.entry(kind.clone()).or_default() += bytes;
    }
}

/// Tiles of a plan, spread evenly over it and the same each time.
fn spread(plan: &Plan) -> Vec<TileId> {
    let (region, tiles) = (plan.made(), plan.tiles());
    let looked_at = LOOKED_AT_VERTICES / (u64::from(region.tile_cells()) + 1).pow(2);
    let count = looked_at.max(tiles / ONE_OF).clamp(1, MOST_TILES).min(tiles);
    let nth = |index: u64| (2 * index + 1) * tiles / (2 * count);
    let place = |index: u64| match count == tiles {
        true => Place { row: index / region.cols(), col: index % region.cols() },
        // Each golden section of the way from west to east lies far from those before it.
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

/// The golden section.
const GOLDEN: f64 = 0.618_033_988_749_895;
