//! The plan of a bake: the files that it will leave and the resources that it needs, checked before anything is
//! written.
//!
//! ```text
//!   digits.rs    numbers for people                            options.rs   the user's options for meshes and vectors
//!   measure.rs   the heights of a region                       request.rs   what is asked for -> a plan
//!   bounds.rs    the limits of a manifest's values
//!   memory.rs    memory that is announced, and that is left    cost.rs      a plan -> its memory, disk and time
//! ```

pub(crate) mod digits;
pub(crate) mod options;
pub(crate) mod measure;
pub(crate) mod request;
pub(crate) mod bounds;
pub(crate) mod memory;
pub(crate) mod cost;

use std::collections::BTreeSet;
use std::sync::Arc;

use crate::area::{Region, TileId};
use crate::bake::Shard;
use crate::device::{Cpu, LandMaker};
use crate::error::Error;
use crate::export::folder::manifest::{Manifest, ShardRecord};
use crate::export::folder::merge::Shards;
use crate::export::formats::format::{Lack, Request};
use crate::export::plan::digits::{noise_m, shortest};
use crate::export::{Export, MeshOptions, Profile, TileNames, VectorOptions};
use crate::mesh::default_origin;
use crate::walker::Walk;
use crate::world::World;

/// A bake that has been checked: the formats can hold the region.
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

impl<'a> Plan<'a> {
    /// Plans to bake `region` of `world` into `exports`, and into the exports that these refer to.
    ///
    /// # Errors
    /// When a format cannot hold the region, or the world lacks what an export shows; the hint says what will do.
    pub fn new(
        world: &'a World,
        preset_name: &'a str,
        region: Region,
        exports: Vec<Export>,
    ) -> Result<Plan<'a>, Error> {
        Plan::begun(world, preset_name, region, exports, None)
    }

    /// Plans to bake the tiles of a walk through `world` into `exports`, in the order in which the walker comes to
    /// them.
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
        Plan {
            world,
            preset_name,
            region,
            exports,
            meshes: MeshOptions { origin: Some(default_origin(&region)), ..MeshOptions::default() },
            vectors: VectorOptions::default(),
            height_range_m: None,
            names: TileNames::default(),
            profile: None,
            maker: Cpu::maker(world.relief()),
            walk,
            shard: None,
            shards: None,
        }
        .checked()
    }

    /// Adds the files of a profile to the plan.
    ///
    /// # Errors
    /// As [`new`](Plan::new), and when the engine of the profile cannot take the region; the hint names the nearest
    /// region that it takes.
    pub fn with_profile(mut self, profile: Profile) -> Result<Plan<'a>, Error> {
        profile.check(self.world, &self.region, &self.meshes)?;
        let missing = profile.exports().into_iter().filter(|export| !self.exports.contains(export));
        self.exports.extend(missing.collect::<Vec<_>>());
        // Check again: the profile's exports may need others.
        Plan { profile: Some(profile), ..self }.checked()
    }

    fn checked(mut self) -> Result<Plan<'a>, Error> {
        // The name goes into files that other programs read.
        bounds::check_text(self.preset_name).map_err(|message| Error::Option {
            message: format!("the preset's name is {message}"),
            hint: "give it another name".into(),
        })?;
        let needed: Vec<_> = self.exports.iter().filter_map(|export| export.0.needs()).collect();
        // A needed export needs no other export, so one round is enough.
        let missing = |export: &Export| needed.contains(&export.name()) && !self.exports.contains(export);
        self.exports.extend(Export::all().filter(missing).collect::<Vec<_>>());
        self.exports.iter().try_for_each(|export| self.check_shows_walk(*export))?;
        let request = self.request();
        self.exports.iter().try_for_each(|export| export.0.check(&request))?;
        self.exports.iter().try_for_each(|export| self.check_shows(*export))?;
        Ok(self)
    }

    /// Refuses an export that cannot show a walk, if the plan is one of a walk.
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

    /// Refuses an export of something that the world lacks.
    fn check_shows(&self, export: Export) -> Result<(), Error> {
        let Some(Lack { shows, has, preset }) = export.0.lacks(self.world) else { return Ok(()) };
        let others: Vec<_> = Export::all().filter(|other| other.is_shown_by(self.world)).map(Export::name).collect();
        Err(Error::Export {
            message: format!("export {export} shows {shows}, and {} has {has}", self.preset_name),
            hint: format!("bake {preset}, or leave it out; exports for this one: {}", others.join(", ")),
        })
    }

    pub(crate) fn request(&self) -> Request<'_> {
        let Plan { world, preset_name: name, region, meshes, vectors, names, .. } = self;
        let (height_range_m, walk, is_shard) = (self.height_range_m(), self.walk.as_ref(), self.shard.is_some());
        Request { name, world, region: *region, meshes, vectors, names: *names, height_range_m, walk, is_shard }
    }

    /// Returns the request for the tiles alone that this plan makes: those of the shard, if the plan is one of a shard.
    pub(crate) fn request_of_made(&self) -> Request<'_> {
        Request { region: self.made(), ..self.request() }
    }

    /// Returns the plan with other mesh options.
    ///
    /// # Errors
    /// When meshes cannot be made so; the hint says what will do.
    pub fn with_meshes(self, meshes: MeshOptions) -> Result<Plan<'a>, Error> {
        meshes.check(self.world, &self.region)?;
        // The plan records the origin, so that a bake whose region grows keeps it.
        let origin = Some(meshes.origin.unwrap_or_else(|| default_origin(&self.region)));
        let plan = Plan { meshes: MeshOptions { origin, ..meshes }, ..self };
        plan.exports.iter().try_for_each(|export| export.0.check_meshes(&plan.request()))?;
        Ok(plan)
    }

    /// Returns the plan with other vector options.
    ///
    /// # Errors
    /// When vectors cannot be written so; the hint says what will do.
    pub fn with_vectors(self, vectors: VectorOptions) -> Result<Plan<'a>, Error> {
        vectors.check(self.world, &self.region)?;
        Ok(Plan { vectors, ..self })
    }

    /// Returns the plan with another range of 16-bit heights than the world's, in metres of the lowest and of the
    /// highest step. Heights beyond the range are written as its nearer end.
    ///
    /// # Errors
    /// When the first number is not less than the second, or when hardly any step would lie within the land's heights.
    pub fn with_height_range(self, height_range_m: Option<[f32; 2]>) -> Result<Plan<'a>, Error> {
        if let Some(range_m) = height_range_m {
            check_range(range_m, self.world.height_range_m())?;
        }
        Ok(Plan { height_range_m, ..self })
    }

    /// Returns the plan with the files of tiles named in another way.
    #[must_use]
    pub fn with_names(self, names: TileNames) -> Plan<'a> {
        Plan { names, ..self }
    }

    /// Returns the plan with another maker of the land: the bytes of the files are the same.
    #[must_use]
    pub fn with_maker(self, maker: Arc<dyn LandMaker>) -> Plan<'a> {
        Plan { maker, ..self }
    }

    /// Returns the plan for one shard of the bake: the shard's tiles, and the pieces of them that files of the region
    /// need.
    ///
    /// # Errors
    /// When there are fewer tiles than shards.
    pub fn with_shard(self, shard: Shard) -> Result<Plan<'a>, Error> {
        let shard = Some(ShardRecord::of(shard, &self.region)?);
        Ok(Plan { shard, ..self })
    }

    /// Returns the plan with all tiles taken from shards, and none made.
    pub(crate) fn with_shards(self, shards: &'a Shards) -> Plan<'a> {
        Plan { shards: Some(shards), ..self }
    }

    /// Returns the device that makes the land of the tiles.
    pub fn maker(&self) -> &dyn LandMaker {
        &*self.maker
    }

    pub(crate) fn shared_maker(&self) -> Arc<dyn LandMaker> {
        Arc::clone(&self.maker)
    }

    /// Checks that some export, or the profile, reads each of the given options, which only some exports read.
    ///
    /// # Errors
    /// When an option is read by none; the hint names the exports that would read it.
    pub fn check_options(&self, given: &[&str]) -> Result<(), Error> {
        let reads = |export: &Export, option: &str| export.0.options().contains(&option);
        let is_read = |option: &&str| {
            self.exports.iter().any(|export| reads(export, option))
                || self.profile.is_some() && Profile::OPTIONS.contains(option)
        };
        let unread = given.iter().find(|option| !is_read(option));
        let Some(option) = unread else { return Ok(()) };
        let readers: Vec<_> = Export::all().filter(|export| reads(export, option)).map(Export::name).collect();
        Err(Error::Option {
            message: format!("no export of this bake reads {option}"),
            hint: format!("leave it out, or bake one of those that do: {}", readers.join(", ")),
        })
    }

    /// Returns warnings for the user before the bake: problems that may show only when files are made.
    pub fn warnings(&self) -> Vec<String> {
        // A shard has no file of the region, so no warning applies.
        let exports = self.exports.iter().filter(|_| self.shard.is_none());
        exports.filter_map(|export| export.0.warning(&self.request())).collect()
    }

    /// Returns the plan that a bake was made by.
    ///
    /// # Errors
    /// When the manifest names an unknown export or profile, or an impossible region.
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

    /// Returns the plan for another region, with the same preset, exports and options.
    ///
    /// # Errors
    /// As [`of`](Plan::of), and as [`new`](Plan::new).
    pub fn of_region(manifest: &'a Manifest, world: &'a World, region: Region) -> Result<Plan<'a>, Error> {
        Plan::new(world, &manifest.preset_name, region, manifest.known_exports()?)?.like(manifest)
    }

    /// Returns the plan with all options that a manifest records of how files are written.
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

    /// Returns the plan of the whole bake that a shard is a part of; for a bake that is no shard, its own plan.
    ///
    /// # Errors
    /// As [`of`](Plan::of).
    pub(crate) fn of_whole(manifest: &'a Manifest, world: &'a World) -> Result<Plan<'a>, Error> {
        Ok(Plan { shard: None, ..Plan::of(manifest, world)? })
    }

    /// Returns the world that is baked.
    pub fn world(&self) -> &World {
        self.world
    }

    pub(crate) fn preset_name(&self) -> &str {
        self.preset_name
    }

    pub(crate) fn exports(&self) -> &[Export] {
        &self.exports
    }

    pub(crate) fn profile(&self) -> Option<Profile> {
        self.profile
    }

    pub(crate) fn meshes(&self) -> &MeshOptions {
        &self.meshes
    }

    /// Returns the vertex of the world that is the origin of all meshes.
    pub(crate) fn mesh_origin(&self) -> [i64; 2] {
        self.meshes.origin.expect("a plan has one")
    }

    pub(crate) fn names(&self) -> TileNames {
        self.names
    }

    pub(crate) fn vectors(&self) -> &VectorOptions {
        &self.vectors
    }

    /// Returns the metres of the lowest and of the highest step of 16-bit heights.
    pub fn height_range_m(&self) -> (f32, f32) {
        self.height_range_m.map_or(self.world.height_range_m(), |[min_m, max_m]| (min_m, max_m))
    }

    /// Returns the region; of a walk, the bounding rectangle of its tiles.
    pub fn region(&self) -> &Region {
        &self.region
    }

    /// Returns the walk whose tiles are baked, if they are not all tiles of the region.
    pub fn walk(&self) -> Option<&Walk> {
        self.walk.as_ref()
    }

    /// Returns the shard that is baked, if the plan is one of a shard.
    pub fn shard(&self) -> Option<&ShardRecord> {
        self.shard.as_ref()
    }

    /// Returns the shards that all tiles are taken from, if this plan makes none.
    pub(crate) fn shards(&self) -> Option<&Shards> {
        self.shards
    }

    /// True if all tiles are taken from shards, and none are made.
    pub fn is_merge(&self) -> bool {
        self.shards.is_some()
    }

    /// Returns the rectangle of tiles that is baked: the region, or the shard's part of it.
    pub fn made(&self) -> Region {
        let shard = self.shard.as_ref().and_then(|shard| shard.tiles(&self.region));
        shard.unwrap_or(self.region)
    }

    /// Returns the number of tiles that are baked.
    pub fn tiles(&self) -> u64 {
        self.request_of_made().tiles()
    }

    /// Returns the number of vertices of these tiles.
    pub fn vertices(&self) -> u64 {
        self.request_of_made().vertices()
    }

    /// Returns the largest number of bytes that the exports keep of each vertex until its row of tiles is written.
    pub(crate) fn kept_a_vertex(&self) -> u64 {
        let request = self.request_of_made();
        self.exports.iter().map(|export| export.0.kept_a_vertex(&request)).sum()
    }

    /// Returns the plan for one tile alone and for some exports, with whole features or with features cut off at the
    /// tile's edge.
    pub(crate) fn of_tile(&self, tile: TileId, is_clipped: bool, exports: Vec<Export>) -> Result<Plan<'a>, Error> {
        let region = Region::new(tile, 1, 1, self.region.tile_cells())?;
        let alone = || ShardRecord::of(Shard::new(1, 1).expect("there is a first one"), &region);
        let shard = self.shard.as_ref().map(|_| alone()).transpose()?;
        let vectors = VectorOptions { clipped: is_clipped, ..self.vectors.clone() };
        Ok(Plan { region, exports, vectors, shard, profile: None, walk: None, shards: None, ..self.clone() })
    }

    /// Returns the manifest of the bake before any file exists.
    pub(crate) fn draft(&self) -> Manifest {
        Manifest::new(self, Vec::new())
    }

    /// Returns the folders of files within the folder of the bake, without that folder itself.
    pub(crate) fn folders(&self) -> Vec<&'static str> {
        let folders: BTreeSet<_> = self.exports.iter().flat_map(|export| export.0.folders()).collect();
        folders.into_iter().filter(|folder| !folder.is_empty()).collect()
    }
}

/// Least number of steps of 16-bit heights that the land of a world must span: with fewer, slopes look like stairs.
const LEAST_STEPS: f32 = 16.0;

/// Checks that 16-bit heights can have the chosen range in a world; the second range is the world's own.
fn check_range([min_m, max_m]: [f32; 2], (lowest_m, highest_m): (f32, f32)) -> Result<(), Error> {
    let refuse = |message: String, hint: String| Err(Error::Option { message, hint });
    if !(min_m < max_m && (max_m - min_m).is_finite()) {
        return refuse(
            format!("heights cannot range from {min_m} to {max_m} m"),
            "give the least and then the greatest, such as --height-range 0,1200".into(),
        );
    }
    let (step_m, span_m) = ((max_m - min_m) / 65535.0, highest_m - lowest_m);
    let noise_m = noise_m(f64::from(lowest_m), f64::from(highest_m));
    let [lowest, highest, step] = [lowest_m, highest_m, step_m].map(|height_m| shortest(f64::from(height_m), noise_m));
    if step_m * LEAST_STEPS > span_m {
        return refuse(
            format!(
                "heights from {min_m} to {max_m} m are written {step} m apart, and land ranges from {lowest} to {highest} m"
            ),
            format!("give less, such as --height-range {lowest},{highest}"),
        );
    }
    Ok(())
}

/// A number of bytes, displayed for people.
pub struct Bytes(pub u64);

impl std::fmt::Display for Bytes {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        const UNITS: [&str; 7] = ["B", "KiB", "MiB", "GiB", "TiB", "PiB", "EiB"];
        // Each unit is 2^10 of the unit before it.
        let unit = (self.0.max(1).ilog2() / 10) as usize;
        let value = self.0 as f64 / (1u64 << (10 * unit)) as f64;
        write!(f, "{value:.*} {}", usize::from(unit > 0), UNITS[unit])
    }
}
