//! The request for a bake of a region, and the rules by which it becomes a plan.

use std::path::Path;

use crate::area::Region;
use crate::bake::Shard;
use crate::error::Error;
use crate::export::{Export, Manifest, MeshOptions, Plan, Profile, TileNames, VectorOptions, look};
use crate::world::World;

/// A request for a bake of a region.
#[derive(Debug)]
pub struct PlanRequest {
    /// The preset's name.
    pub preset_name: String,
    /// The world to bake.
    pub world: World,
    /// The tiles to bake.
    pub region: Region,
    /// The exports to write, besides those of the profile.
    pub exports: Vec<Export>,
    /// The program that the files are for, if any.
    pub profile: Option<Profile>,
    /// Options of meshes.
    pub meshes: MeshOptions,
    /// Options of vectors.
    pub vectors: VectorOptions,
    /// Range of 16-bit heights in metres, if it is not the world's.
    pub height_range_m: Option<[f32; 2]>,
    /// Naming of the files of tiles.
    pub names: TileNames,
    /// Names of the options that were given and that only some exports read: of meshes, of vectors, of 16-bit heights.
    pub given: [Vec<&'static str>; 3],
    /// The shard to bake, if not the whole region.
    pub shard: Option<Shard>,
}

impl PlanRequest {
    /// Fits the region to the profile, for a request that asks for no size. Returns the options that ask for the new
    /// size, or `None` if the old one fits.
    ///
    /// # Errors
    /// When the profile takes no region like that.
    pub fn fit_to_profile(&mut self) -> Result<Option<String>, Error> {
        let fitted = self.profile.map(|profile| profile.fitted(&self.world, &self.region)).transpose()?.flatten();
        let Some((region, options)) = fitted else { return Ok(None) };
        let preset = self.world.preset().with_tile_cells(region.tile_cells());
        (self.region, self.world) = (region, World::new(preset, Some(self.world.seed()))?);
        Ok(Some(options))
    }

    /// Takes everything that was not given from an old bake, to which exports are added.
    ///
    /// # Errors
    /// When the old bake has an export that is not known.
    pub fn add_to(&mut self, old: &Manifest) -> Result<(), Error> {
        let added = std::mem::replace(&mut self.exports, old.known_exports()?);
        self.exports.extend(added.into_iter().filter(|export| !old.has(*export)));
        let [meshes, vectors, heights] = &self.given;
        self.names = old.tile_names;
        if old.reads("--lod") && meshes.is_empty() {
            self.meshes = old.meshes.clone();
        }
        // All files of a folder share one mesh origin, whichever export reads it.
        if !meshes.contains(&"--mesh-origin") {
            self.meshes.origin = old.meshes.origin;
        }
        if old.reads("--clip") && vectors.is_empty() {
            self.vectors = old.vectors.clone();
        }
        if old.reads("--height-range") && heights.is_empty() {
            self.height_range_m = old.chosen_range_m(&self.world);
        }
        Ok(())
    }

    /// Returns the range of the region's heights in metres: as recorded by the bake that goes on in a folder, otherwise
    /// as `measure` finds it.
    ///
    /// # Errors
    /// As `measure`.
    pub fn region_range_m(
        &self,
        begun: Option<&Path>,
        measure: impl FnOnce(&World, &Region) -> Result<[f32; 2], Error>,
    ) -> Result<Option<[f32; 2]>, Error> {
        match begun.and_then(|folder| look(folder).ok()?.pop()) {
            Some(begun) => Ok(begun.manifest.chosen_range_m(&self.world)),
            None => measure(&self.world, &self.region).map(Some),
        }
    }

    /// Returns the checked plan.
    ///
    /// # Errors
    /// As [`Plan::new`] and its methods, and when an option is given that no export reads.
    pub fn plan(&self) -> Result<Plan<'_>, Error> {
        let mut plan = Plan::new(&self.world, &self.preset_name, self.region, self.exports.clone())?
            .with_meshes(self.meshes.clone())?
            .with_vectors(self.vectors.clone())?
            .with_height_range(self.height_range_m)?
            .with_names(self.names);
        if let Some(profile) = self.profile {
            plan = plan.with_profile(profile)?;
        }
        plan.check_options(&self.given.concat())?;
        match self.shard {
            Some(shard) => plan.with_shard(shard),
            None => Ok(plan),
        }
    }
}
