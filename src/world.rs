//! A preset as understood: checked, seeded, with every range proved and every pad added up.

use std::sync::Arc;

use crate::agents::paths::{PathList, Paths};
use crate::area::Area;
use crate::error::Error;
use crate::fluvial::Fluvial;
use crate::fluvial::rivers::River;
use crate::places::Places;
use crate::places::road::Road;
use crate::places::site::{Site, SiteId};
use crate::preset::Preset;
use crate::relief::{NoiseRelief, Relief};
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
        preset.check()?;
        let seed = seed.unwrap_or(preset.seed);
        let Preset { spacing_m, sea_level_m, .. } = preset;
        let (warp, land) = (preset.warp.as_ref(), preset.land.as_ref());
        let relief = match &preset.fluvial {
            Some(settings) => Relief::Fluvial(Box::new(Fluvial::new(settings, spacing_m, sea_level_m, seed))),
            None => Relief::Noise(Box::new(NoiseRelief::new(&preset.noise, warp, land, spacing_m, seed))),
        };
        let agents = (preset.rivers.as_ref(), preset.roads.as_ref());
        let paths = Paths::new(agents, preset.tile_cells, spacing_m, sea_level_m, preset.ground.slope_scale, seed);
        let settle = |settings| Places::new(settings, spacing_m, seed);
        let places = preset.places.as_ref().map(settle).transpose()?;
        Ok(World { preset, seed, relief, paths, places, vectors: Vectors::default() })
    }

    /// What is allowed in the recipe and probably not meant, a sentence each.
    pub fn warnings(&self) -> Vec<String> {
        let ((min_m, max_m), preset) = (self.height_range_m(), &self.preset);
        let Some(sea_m) = preset.sea_level_m else { return Vec::new() };
        let sentence = match &preset.fluvial {
            // The land's ceiling is a height, and does not sink with the sea.
            Some(fluvial) if sea_m < -fluvial.ceiling_m => format!(
                "the sea at {sea_m} m lies so far below ceiling_m = {} that heights of 16 bits are {:.2} m apart; a higher \
                 sea_level_m wastes less",
                fluvial.ceiling_m,
                (max_m - min_m) / 65535.0,
            ),
            None if sea_m <= min_m as f64 => {
                format!("nothing is as low as the sea at {sea_m} m: all heights exceed {min_m} m")
            }
            None if sea_m >= max_m as f64 => format!("all is under the sea at {sea_m} m: no height exceeds {max_m} m"),
            _ => return Vec::new(),
        };
        vec![sentence]
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
