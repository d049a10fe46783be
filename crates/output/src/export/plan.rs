//! The plan of a bake: what it will leave and need, checked before anything is written.

use std::collections::BTreeSet;
use std::sync::Arc;

use crate::agents::record::TileRecord;
use crate::area::Region;
use crate::bake::{Shard, rows_in_flight};
use crate::device::{Cpu, LandMaker};
use crate::error::Error;
use crate::export::cost::{Cost, Forecast, Trial};
use crate::export::format::{FormatCost, Lack, RECORD_BYTES, Request};
use crate::export::manifest::{Manifest, ShardRecord};
use crate::export::merge::Shards;
use crate::export::{Export, MeshOptions, Profile, TileNames, VectorOptions, profile, registry_file};
use crate::mesh::default_origin;
use crate::tile::{accumulation_input, shaped_input};
use crate::walker::Walk;
use crate::world::World;

/// A bake that has been thought through: the formats can hold the region.
#[derive(Clone)]
pub struct Plan<'a> {
    world: &'a World,
    preset_name: &'a str,
    region: Region,
    exports: Vec<Export>,
    meshes: MeshOptions,
    vectors: VectorOptions,
    height_range_m: Option<[f32; 2]>,
    names: TileNames,
    profile: Option<Profile>,
    maker: Arc<dyn LandMaker>,
    walk: Option<Walk>,
    shard: Option<ShardRecord>,
    shards: Option<&'a Shards>,
}

/// Pages of the program's file that the kernel has mapped: 14 to 18 MiB of its 51 were measured, and 19 where a kernel maps
/// more around what is read. It may take them back at any time, for they are on the disk.
const PROGRAM_BYTES: u64 = 24 << 20;

/// What the program holds and the allocator keeps beside all else that is counted: most of what `tests/suite/cost.rs` measures.
const PROCESS_BYTES: u64 = 1 << 20;

/// The stack of a thread, and what the allocator keeps for it: 0.4 MiB more a thread were measured on two of them, and less
/// on more; rounded up.
const THREAD_BYTES: u64 = 1 << 20;

/// What files of features hold while they are written: pages of the database, and the features of a row of tiles. With these
/// 4 MiB and those below, no bake of `tests/suite/cost.rs` takes more than it is told.
const FEATURE_BYTES: u64 = 4 << 20;

/// What a thread holds while it looks for features: the land around a lake; and where there is a sea, of a cell of the
/// coast. Chosen with [`FEATURE_BYTES`].
const SEARCH_BYTES: [u64; 2] = [1 << 20, 20 << 20];

/// What the accumulation of a tile takes while it is made, a vertex of the land around it: heights and water, eight shares, and what
/// drains before a step and after it.
const DRAINED_BYTES: u64 = 4 + 14 + 8 * 4 + 2 * 4;

/// Bytes of the manifest without its files: those of the built-in presets have 3 KiB, and recipes may be longer.
const MANIFEST_BYTES: u64 = 16 << 10;

/// Bytes of a tile's row of the registry while it waits to be written: nine hashes of 33, and short texts.
const ROW_BYTES: u64 = 512;

/// What the tiles around a walker take, of whose land so many vertices are made each, and the records of all that it comes to.
fn walking_bytes(walk: &Walk, shaped: u64, tiles: u64) -> u64 {
    // Those that stand, and as many as a step through a corner makes. Heights, normals and weights; what rivers and roads do to them.
    const STANDING_BYTES: u64 = 4 + 16 + 8 + 20;
    let side = 2 * u64::from(walk.tour().layers) + 1;
    let standing = side * side + 2 * side;
    standing.saturating_mul(shaped * STANDING_BYTES).saturating_add(tiles.saturating_mul(2 * TileRecord::BYTES as u64))
}

impl<'a> Plan<'a> {
    /// The plan of baking `region` of `world` into `exports`, and into those that they refer to.
    ///
    /// # Errors
    /// When a format cannot hold the region, or the world has not what an export shows; the hint says what will do.
    pub fn new(
        world: &'a World,
        preset_name: &'a str,
        region: Region,
        exports: Vec<Export>,
    ) -> Result<Plan<'a>, Error> {
        Plan::begun(world, preset_name, region, exports, None)
    }

    /// The plan of baking the tiles of a walk through `world`, as the walker comes to them, into `exports`.
    ///
    /// # Errors
    /// As [`new`](Plan::new), and when an export cannot show a walk; the hint names those that can.
    pub fn of_walk(
        world: &'a World,
        preset_name: &'a str,
        walk: Walk,
        exports: Vec<Export>,
    ) -> Result<Plan<'a>, Error> {
        Plan::begun(world, preset_name, walk.region(), exports, Some(walk))
    }

    fn begun(
        world: &'a World,
        preset_name: &'a str,
        region: Region,
        exports: Vec<Export>,
        walk: Option<Walk>,
    ) -> Result<Plan<'a>, Error> {
        let meshes = MeshOptions { origin: Some(default_origin(&region)), ..MeshOptions::default() };
        let vectors = VectorOptions::default();
        let names = TileNames::default();
        let maker = Cpu::maker(world.relief());
        let (height_range_m, profile, shard, shards) = (None, None, None, None);
        Plan {
            world,
            preset_name,
            region,
            exports,
            meshes,
            vectors,
            height_range_m,
            names,
            profile,
            maker,
            walk,
            shard,
            shards,
        }
        .checked()
    }

    /// The plan with the files of a profile too.
    ///
    /// # Errors
    /// As [`new`](Plan::new), and when the engine of the profile cannot take the region; the hint names the nearest that it
    /// takes.
    pub fn with_profile(mut self, profile: Profile) -> Result<Plan<'a>, Error> {
        profile.check(self.world, &self.region, &self.meshes)?;
        let missing = profile.exports().into_iter().filter(|export| !self.exports.contains(export));
        self.exports.extend(missing.collect::<Vec<_>>());
        // Again, for the profile's exports may need others.
        Plan { profile: Some(profile), ..self }.checked()
    }

    fn checked(mut self) -> Result<Plan<'a>, Error> {
        let needed: Vec<_> = self.exports.iter().filter_map(|export| export.0.needs()).collect();
        // What is needed needs nothing itself, so one round is enough.
        let missing = |export: &Export| needed.contains(&export.name()) && !self.exports.contains(export);
        self.exports.extend(Export::all().filter(missing).collect::<Vec<_>>());
        self.exports.iter().try_for_each(|export| self.check_shows_walk(*export))?;
        let request = self.request();
        self.exports.iter().try_for_each(|export| export.0.check(&request))?;
        self.exports.iter().try_for_each(|export| self.check_shows(*export))?;
        Ok(self)
    }

    /// Refuses an export that shows no walks, if this is one.
    fn check_shows_walk(&self, export: Export) -> Result<(), Error> {
        if self.walk.is_none() || export.0.shows_walks() {
            return Ok(());
        }
        let others: Vec<_> = Export::of_walks().map(Export::name).collect();
        Err(Error::Export {
            message: format!(
                "export {export} cannot show a walk: its tiles are no rectangle, and their rivers and roads are not those of the world"
            ),
            hint: format!("exports for walks: {}", others.join(", ")),
        })
    }

    /// Refuses an export of what the world has not.
    fn check_shows(&self, export: Export) -> Result<(), Error> {
        let Some(Lack { shows, has, preset }) = export.0.lacks(self.world) else { return Ok(()) };
        let others: Vec<_> =
            Export::all().filter(|other| other.0.lacks(self.world).is_none()).map(Export::name).collect();
        Err(Error::Export {
            message: format!("export {export} shows {shows}, and {} has {has}", self.preset_name),
            hint: format!("bake {preset}, or leave it out; exports for this one: {}", others.join(", ")),
        })
    }

    pub(super) fn request(&self) -> Request<'_> {
        let Plan { world, preset_name: name, region, meshes, vectors, names, .. } = self;
        let (height_range_m, walk, is_shard) = (self.height_range_m(), self.walk.as_ref(), self.shard.is_some());
        Request { name, world, region: *region, meshes, vectors, names: *names, height_range_m, walk, is_shard }
    }

    /// What a bake of the tiles alone that are made would ask of its formats.
    fn request_of_made(&self) -> Request<'_> {
        Request { region: self.made(), ..self.request() }
    }

    /// The plan with meshes made in another way.
    ///
    /// # Errors
    /// When they cannot be made so; the hint says what will do.
    pub fn with_meshes(self, meshes: MeshOptions) -> Result<Plan<'a>, Error> {
        meshes.check(self.world, &self.region)?;
        // Written down, so that a region that grows keeps it.
        let origin = Some(meshes.origin.unwrap_or_else(|| default_origin(&self.region)));
        Ok(Plan { meshes: MeshOptions { origin, ..meshes }, ..self })
    }

    /// The plan with vectors written in another way.
    ///
    /// # Errors
    /// When they cannot be written so; the hint says what will do.
    pub fn with_vectors(self, vectors: VectorOptions) -> Result<Plan<'a>, Error> {
        vectors.check(self.world, &self.region)?;
        Ok(Plan { vectors, ..self })
    }

    /// The plan with other metres of the least and of the greatest step of 16-bit heights than the world's. What lies beyond
    /// them is written as they are.
    ///
    /// # Errors
    /// When the first is not less than the second.
    pub fn with_height_range(self, height_range_m: Option<[f32; 2]>) -> Result<Plan<'a>, Error> {
        match height_range_m {
            Some([min_m, max_m]) if !(min_m.is_finite() && max_m.is_finite() && min_m < max_m) => Err(Error::Option {
                message: format!("heights cannot range from {min_m} to {max_m} m"),
                hint: "give the least and then the greatest, such as --height-range 0,1200".into(),
            }),
            _ => Ok(Plan { height_range_m, ..self }),
        }
    }

    /// The plan with files of tiles named in another way.
    #[must_use]
    pub fn with_names(self, names: TileNames) -> Plan<'a> {
        Plan { names, ..self }
    }

    /// The plan with the land of its tiles made by another maker: the bytes are the same.
    #[must_use]
    pub fn with_maker(self, maker: Arc<dyn LandMaker>) -> Plan<'a> {
        Plan { maker, ..self }
    }

    /// The plan of a shard of it alone: its tiles, and what the files of the region need of them.
    ///
    /// # Errors
    /// When there are fewer tiles than shards.
    pub fn with_shard(self, shard: Shard) -> Result<Plan<'a>, Error> {
        let shard = Some(ShardRecord::of(shard, &self.region)?);
        Ok(Plan { shard, ..self })
    }

    /// The plan with all tiles taken from shards, and none made.
    pub(super) fn with_shards(self, shards: &'a Shards) -> Plan<'a> {
        Plan { shards: Some(shards), ..self }
    }

    /// What makes the land of its tiles.
    pub fn maker(&self) -> &dyn LandMaker {
        &*self.maker
    }

    pub(super) fn shared_maker(&self) -> Arc<dyn LandMaker> {
        Arc::clone(&self.maker)
    }

    /// Whether any export reads each of some options of the command that only some exports read.
    ///
    /// # Errors
    /// When none does; the hint names those that would.
    pub fn check_options(&self, given: &[&str]) -> Result<(), Error> {
        let reads = |export: &Export, option: &str| export.0.options().contains(&option);
        let unread = given.iter().find(|option| !self.exports.iter().any(|export| reads(export, option)));
        let Some(option) = unread else { return Ok(()) };
        let readers: Vec<_> = Export::all().filter(|export| reads(export, option)).map(Export::name).collect();
        Err(Error::Option {
            message: format!("no export of this bake reads {option}"),
            hint: format!("leave it out, or bake one of those that do: {}", readers.join(", ")),
        })
    }

    /// The plan that a bake was made by.
    ///
    /// # Errors
    /// When the manifest names an export or a profile that is not known, or a region that cannot be.
    pub fn of(manifest: &'a Manifest, world: &'a World) -> Result<Plan<'a>, Error> {
        match &manifest.walk {
            None => {
                let plan = Plan::of_region(manifest, world, manifest.region.region()?)?;
                Ok(Plan { shard: manifest.shard.clone(), ..plan })
            }
            Some(tour) => {
                let walk = Walk::new(tour.clone(), world)?;
                Plan::of_walk(world, &manifest.preset_name, walk, manifest.known_exports()?)?.like(manifest)
            }
        }
    }

    /// The plan of the same of another region.
    ///
    /// # Errors
    /// As [`of`](Plan::of), and as [`new`](Plan::new).
    pub fn of_region(manifest: &'a Manifest, world: &'a World, region: Region) -> Result<Plan<'a>, Error> {
        Plan::new(world, &manifest.preset_name, region, manifest.known_exports()?)?.like(manifest)
    }

    /// The plan with all that a manifest says of how files are written.
    fn like(self, manifest: &Manifest) -> Result<Plan<'a>, Error> {
        let height_range_m = manifest.chosen_range_m(self.world);
        let plan = self
            .with_meshes(manifest.meshes.clone())?
            .with_vectors(manifest.vectors.clone())?
            .with_height_range(height_range_m)?
            .with_names(manifest.tile_names);
        match &manifest.profile {
            Some(profile) => plan.with_profile(profile.parse()?),
            None => Ok(plan),
        }
    }

    /// The plan of the whole of which a shard is a part; of a bake that is whole its own.
    ///
    /// # Errors
    /// As [`of`](Plan::of).
    pub(super) fn of_whole(manifest: &'a Manifest, world: &'a World) -> Result<Plan<'a>, Error> {
        Ok(Plan { shard: None, ..Plan::of(manifest, world)? })
    }

    /// What is baked: the world, the name of its preset, the exports, the profile, and how meshes are made.
    pub fn world(&self) -> &World {
        self.world
    }

    pub(super) fn preset_name(&self) -> &str {
        self.preset_name
    }

    pub(super) fn exports(&self) -> &[Export] {
        &self.exports
    }

    pub(super) fn profile(&self) -> Option<Profile> {
        self.profile
    }

    pub(super) fn meshes(&self) -> &MeshOptions {
        &self.meshes
    }

    /// The vertex of the world that is the origin of all meshes.
    pub(super) fn mesh_origin(&self) -> [i64; 2] {
        self.meshes.origin.expect("a plan has one")
    }

    pub(super) fn names(&self) -> TileNames {
        self.names
    }

    pub(super) fn vectors(&self) -> &VectorOptions {
        &self.vectors
    }

    /// Metres of the least and of the greatest step of 16-bit heights.
    pub fn height_range_m(&self) -> (f32, f32) {
        self.height_range_m.map_or(self.world.height_range_m(), |[min_m, max_m]| (min_m, max_m))
    }

    /// The region; of a walk the one around all of its tiles.
    pub fn region(&self) -> &Region {
        &self.region
    }

    /// The walk whose tiles are baked, if they are not all of the region.
    pub fn walk(&self) -> Option<&Walk> {
        self.walk.as_ref()
    }

    /// The shard that is baked, if it is one.
    pub fn shard(&self) -> Option<&ShardRecord> {
        self.shard.as_ref()
    }

    /// The shards that all tiles are taken from, if none are made.
    pub(super) fn shards(&self) -> Option<&Shards> {
        self.shards
    }

    /// Whether all tiles are taken from shards, and none are made.
    pub fn is_merge(&self) -> bool {
        self.shards.is_some()
    }

    /// The rectangle of tiles that is baked: the region, or the shard of it.
    pub fn made(&self) -> Region {
        let shard = self.shard.as_ref().and_then(|shard| shard.tiles(&self.region));
        shard.unwrap_or(self.region)
    }

    /// How many tiles there are.
    pub fn tiles(&self) -> u64 {
        self.request_of_made().tiles()
    }

    /// How many vertices they have.
    pub fn vertices(&self) -> u64 {
        self.request_of_made().vertices()
    }

    /// What the files of all exports take.
    fn format_cost(&self) -> FormatCost {
        let request = self.request_of_made();
        let costs = self.exports.iter().map(|export| export.0.cost(&request));
        costs.fold(FormatCost::default(), FormatCost::and)
    }

    /// The most bytes of the files of the exports that have a folder.
    pub(super) fn folder_bytes(&self, folder: &str) -> u64 {
        let request = self.request_of_made();
        let inside = self.exports.iter().filter(|export| export.0.folders().contains(&folder));
        inside.map(|export| export.0.cost(&request).disk_bytes).fold(0, u64::saturating_add)
    }

    /// What the bake will leave and need on so many threads.
    pub fn cost(&self, threads: usize) -> Cost {
        let region = &self.made();
        let side = region.tile_cells() as u64 + 1;
        let format = self.format_cost();
        let FormatCost { mut files, mut disk_bytes, kept_a_vertex, tile_file_bytes, features, .. } = format;
        // The manifest, the registry, and what a profile writes besides.
        let written = self.profile.map_or(0, |profile| profile.written().len() as u64);
        files = files.saturating_add(2 + written);
        let besides =
            registry_file::bytes_at_most(self, files).saturating_add(MANIFEST_BYTES + written * profile::WRITTEN_BYTES);
        disk_bytes = disk_bytes.saturating_add(besides);
        // A tile is made with some vertices around it, which normals and weights read.
        let shaped = shaped_input(self.world, region.at().area(region.tile_cells())).len() as u64;
        // Heights, four floats of normal and slope and two words of weights a vertex, the relief's bands, and a file.
        let mut a_thread =
            shaped * 4 + side * side * (16 + 8 + format.drawn_a_vertex) + (5 << 18) + 2 * tile_file_bytes;
        // What the accumulation of a tile is made of, and it and the densities that stay with the tile.
        let drained = match format.accumulation {
            true => {
                let around = accumulation_input(region.at().area(region.tile_cells())).len() as u64;
                around * DRAINED_BYTES + side * side * (4 + 16)
            }
            false => 0,
        };
        if self.shard.is_some() {
            // What is kept is written down instead of the files of the region; and a thread holds that of a tile, and it packed.
            let kept = self.vertices().saturating_mul(kept_a_vertex);
            disk_bytes = disk_bytes.saturating_add(kept + kept / 64);
            a_thread += 2 * side * side * kept_a_vertex;
        }
        // Two batches of rows: the one that is made and the one that is written.
        let batch_tiles = region.cols().saturating_mul(rows_in_flight(region, threads));
        let batch_bytes = batch_tiles.saturating_mul(side * side * kept_a_vertex);
        // The manifest lists all files, and is made in memory when they are finished.
        let records = files.saturating_mul(RECORD_BYTES);
        let rows = batch_tiles.saturating_mul(2 * ROW_BYTES);
        // What is read of a batch, packed, while it is unpacked.
        let packed = if self.is_merge() { batch_bytes } else { 0 };
        let walking = match &self.walk {
            None => 0,
            Some(walk) => {
                // What sinks keep of all tiles is on the disk until the last one stands, features as they will be in their files.
                let kept =
                    self.vertices().saturating_mul(kept_a_vertex).saturating_add(if features { disk_bytes } else { 0 });
                disk_bytes = disk_bytes.saturating_add(kept);
                walking_bytes(walk, shaped, self.tiles())
            }
        };
        let planning = self.world.planning_bytes();
        let (features, search) = if features {
            (FEATURE_BYTES, SEARCH_BYTES[usize::from(self.world.preset().sea_level_m.is_some())])
        } else {
            (0, 0)
        };
        let parts = [
            features,
            format.held_bytes,
            batch_bytes.saturating_mul(2),
            packed,
            (a_thread + drained + planning + search + THREAD_BYTES) * threads as u64,
            records,
            rows,
            walking,
            self.maker.host_bytes(threads),
            PROGRAM_BYTES,
            PROCESS_BYTES,
        ];
        let working_bytes = parts.into_iter().fold(0, u64::saturating_add);
        // The agents of a walk remember nothing but their records.
        let remembered_bytes = if self.walk.is_some() { 0 } else { self.world.memory_bytes(region.cols()) };
        let memory_bytes = working_bytes.saturating_add(remembered_bytes);
        Cost { files, disk_bytes, working_bytes, batch_bytes, memory_bytes }
    }

    /// What the bake of that cost will probably take. It may take as long as planning does to say so.
    pub fn forecast(&self, cost: &Cost, threads: usize) -> Forecast {
        self.forecast_by(&self.trial(threads), cost)
    }

    /// What one tile of it takes on so many threads. It may take as long as planning does to say so, and is the same for all shards of a
    /// bake.
    pub fn trial(&self, threads: usize) -> Trial {
        Trial::take(&self.request_of_made(), &self.format_cost(), threads)
    }

    /// What the bake of that cost will probably take, by one tile of it.
    pub fn forecast_by(&self, trial: &Trial, cost: &Cost) -> Forecast {
        Forecast::new(trial, &self.request_of_made(), cost, &self.format_cost())
    }

    /// The manifest of the bake before there is any file.
    pub(super) fn draft(&self) -> Manifest {
        Manifest::new(self, Vec::new())
    }

    /// The folders in that of the bake that hold its files, but for itself.
    pub(super) fn folders(&self) -> Vec<&'static str> {
        let folders: BTreeSet<_> = self.exports.iter().flat_map(|export| export.0.folders()).collect();
        folders.into_iter().filter(|folder| !folder.is_empty()).collect()
    }
}

/// A number of bytes for people.
pub struct Bytes(pub u64);

impl std::fmt::Display for Bytes {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        const UNITS: [&str; 7] = ["B", "KiB", "MiB", "GiB", "TiB", "PiB", "EiB"];
        // A unit is 2^10 of the one before it.
        let unit = (self.0.max(1).ilog2() / 10) as usize;
        let value = self.0 as f64 / (1u64 << (10 * unit)) as f64;
        write!(f, "{value:.*} {}", usize::from(unit > 0), UNITS[unit])
    }
}
