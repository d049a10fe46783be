//! A preset as understood: checked, seeded, with every range proved and every pad added up.

use std::sync::Arc;

use crate::agents::paths::{PathList, Paths};
use crate::area::Area;
use crate::error::Error;
use crate::fluvial::Fluvial;
use crate::fluvial::point::GRAINS;
use crate::fluvial::rivers::River;
use crate::memory::Fill;
use crate::places::Places;
use crate::places::road::Road;
use crate::places::site::{Site, SiteId};
use crate::preset::Preset;
use crate::relief::Relief;
use crate::vectors::Vectors;
use crate::vectors::coast::Coast;
use crate::vectors::lakes::Lake;
use crate::vectors::peaks::Peak;

/// How many vertices around a tile its heights must be known: normals look one vertex past the tile's edge.
///
/// The one place where the pad stands: a [`Grid`](crate::grid::Grid) panics for a stage that reaches further.
pub const HEIGHT_PAD: usize = 1;

/// A world, ready to be baked: any tile of it is a pure function of this and the tile's place.
#[derive(Debug)]
pub struct World {
    preset: Preset,
    seed: u64,
    relief: Relief,
    paths: Paths,
    places: Option<Places>,
    vectors: Vectors,
}

impl World {
    /// The world of a preset, with the preset's own seed unless another is given.
    ///
    /// # Errors
    /// When a value of the preset is out of its range.
    pub fn new(mut preset: Preset, seed: Option<u64>) -> Result<World, Error> {
        preset.fill_defaults();
        preset.check().map_err(|fault| fault.into_error(None))?;
        let seed = seed.unwrap_or(preset.seed);
        let relief = Relief::new(&preset, seed);
        let paths = Paths::new(&preset, seed);
        let settle = |settings| Places::new(settings, preset.spacing_m, seed);
        let places = preset.places.as_ref().map(settle).transpose()?;
        Ok(World { preset, seed, relief, paths, places, vectors: Vectors::default() })
    }

    /// The recipe, with every default filled in.
    pub fn preset(&self) -> &Preset {
        &self.preset
    }

    /// The seed in use.
    pub fn seed(&self) -> u64 {
        self.seed
    }

    /// Metres between neighbouring vertices.
    pub fn spacing_m(&self) -> f64 {
        self.preset.spacing_m
    }

    /// Cells a tile side.
    pub fn tile_cells(&self) -> u32 {
        self.preset.tile_cells
    }

    /// Heights from noise.
    pub fn relief(&self) -> &Relief {
        &self.relief
    }

    /// All rivers and roads whose effect may touch a vertex of `area`, whole, sorted by kind and owner.
    pub fn ways(&self, area: &Area) -> PathList {
        self.paths.touching(&self.relief, area)
    }

    /// All rivers of a fluvial world of which a part lies in `area`, whole, sorted by id.
    pub fn rivers(&self, area: &Area) -> Vec<Arc<River>> {
        self.vectors.rivers(&self.relief, area)
    }

    /// All lakes of a fluvial world of which a part lies in `area`, whole, sorted by id.
    pub fn lakes(&self, area: &Area) -> Vec<Arc<Lake>> {
        self.vectors.lakes(&self.relief, area)
    }

    /// All pieces of coast of a fluvial world of which a part lies in `area`, whole, sorted by id.
    pub fn coasts(&self, area: &Area) -> Vec<Arc<Coast>> {
        self.vectors.coasts(&self.relief, area)
    }

    /// All peaks of a fluvial world on vertices of `area`, sorted by id.
    pub fn peaks(&self, area: &Area) -> Vec<Peak> {
        self.vectors.peaks(&self.relief, area)
    }

    /// All roads between settlements whose effect may touch a vertex of `area`, whole, sorted by id; none in a world
    /// without places.
    pub fn roads(&self, area: &Area) -> Vec<Arc<Road>> {
        let settled = self.places.as_ref().zip(self.relief.fluvial());
        settled.map_or_else(Vec::new, |(places, land)| places.roads(land, area))
    }

    /// All settlements that stand on a vertex of `area`, sorted by id; none in a world without places.
    pub fn sites(&self, area: &Area) -> Vec<Arc<Site>> {
        let settled = self.places.as_ref().zip(self.relief.fluvial());
        settled.map_or_else(Vec::new, |(places, land)| places.sites(land, area))
    }

    /// The settlement of a site cell, if it has one; none in a world without places.
    pub fn site(&self, id: SiteId) -> Option<Arc<Site>> {
        let (places, land) = self.places.as_ref().zip(self.relief.fluvial())?;
        places.site(land, id)
    }

    /// Settlements and roads of this world, and what is remembered of them.
    pub fn places(&self) -> Option<&Places> {
        self.places.as_ref()
    }

    /// The rivers and roads of this world, and what is remembered of them.
    pub(crate) fn paths(&self) -> &Paths {
        &self.paths
    }

    /// Bytes that this world remembers at most of what it has planned and made, while a region of so many columns is
    /// baked.
    pub fn memory_bytes(&self, cols: u64) -> u64 {
        self.paths.prepare_for(cols);
        self.fills().iter().map(|fill| fill.most as u64).sum()
    }

    /// Bytes that this world remembers now.
    pub fn remembered_bytes(&self) -> u64 {
        self.fills().iter().map(|fill| fill.held as u64).sum()
    }

    /// How full the memories of all stages are.
    pub(crate) fn fills(&self) -> Vec<Fill> {
        let relief = self.relief.fluvial().map(Fluvial::fills).unwrap_or_default();
        let places = self.places.as_ref().map(Places::fills).unwrap_or_default();
        let features = self.relief.fluvial().map(|_| self.vectors.fills()).unwrap_or_default();
        [relief, self.paths.fills(), places, features].concat()
    }

    /// Vertices around an area that are planned to make it, about.
    pub(crate) fn planned_around(&self) -> i64 {
        let trunks = self.relief.fluvial().map_or(0, |fluvial| 2 * fluvial.fields().side(0) / GRAINS);
        let places = self.places.as_ref().map_or(0, Places::reach);
        trunks.max(places).max(self.paths.reach())
    }

    /// Bytes that a thread holds while it plans, measured: a search of a usual route among them, which is far from the
    /// longest.
    pub(crate) fn planning_bytes(&self) -> u64 {
        let fluvial = if self.relief.fluvial().is_some() { 1 << 20 } else { 0 };
        let routes = if self.places.is_some() { 2 << 20 } else { 0 };
        fluvial + routes
    }

    /// Bounds that no height of this world can leave: (lowest, highest) in metres. 16-bit heights are encoded in them.
    ///
    /// They are those of the relief, less the depth to which rivers cut into its lowest ground.
    pub fn height_range_m(&self) -> (f32, f32) {
        let (min_m, max_m) = self.relief.range_m();
        // A river's floor lies at most its depth below some height; a thousandth more is for rounding.
        let depth_m = self.preset.rivers.as_ref().map_or(0.0, |rivers| rivers.depth_m[1] * 1.001);
        (min_m - depth_m as f32, max_m)
    }
}
