//! Presets: a world's recipe as its author writes it, read with errors that point at the place.
//!
//! [`Preset`] holds the recipe as written, and [`World`](crate::world::World) the objects that follow from it. The
//! settings of a stage, with the units, ranges and defaults of their keys, are defined beside that stage. Here they are
//! put together, and conditions between stages are checked. The settings of [`ground`] and [`map`], which apply after
//! the world is made, are defined here too.
//!
//! The reading of a preset is described in [`recipe`](crate::recipe).

mod built_in;
pub mod ground;
pub mod map;

use std::ops::RangeInclusive;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::json;
use toml::Spanned;
use toml::de::DeValue;

use crate::agents::settings::{RiverAgents, RoadAgents};
use crate::error::Error;
use crate::fluvial::settings::FluvialSettings;
use crate::geography::settings::GeographySettings;
use crate::hash;
use crate::places::settings::PlacesSettings;
use crate::preset::ground::GroundSettings;
use crate::preset::map::MapStyle;
use crate::recipe::HEIGHT_LIMIT_M;
use crate::recipe::fault::{Fault, KeyPath};
use crate::recipe::mask::Mask;
use crate::recipe::schema;
use crate::recipe::source::{self, Recipe};
use crate::relief::settings::{LandMask, NoiseTerm, WarpSettings};

pub use built_in::{BUILT_IN, summary};

/// A world's recipe: the content of a preset file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Preset {
    /// The seed when the command gives none: a whole number of 64 bits. Default: 1.
    #[schemars(range(min = 0, max = u64::MAX))]
    #[serde(default = "one")]
    pub seed: u64,
    /// Name of the country, a word that is mixed into the seed: presets with the same country, seed and `spacing_m`
    /// have their mountains, rivers, lakes and towns at the same places. So a preset that `extends` another, or has a
    /// key set, shows the other's country changed, and a preset with a country of its own shows another one. Up to 100
    /// letters. Default: none, and everything follows from the seed alone.
    #[schemars(length(max = 100))]
    pub country: Option<String>,
    /// Metres between neighbouring vertices, 0.001 to 10,000. Rivers, lakes and towns of fluvial relief are laid out in
    /// vertices: with another spacing they lie elsewhere and have other names. Default: 1.
    #[schemars(range(min = 0.001, max = 10000))]
    #[serde(default = "one_metre")]
    pub spacing_m: f64,
    /// Number of cells per tile side, 16 to 4096. Default: 256.
    #[schemars(range(min = *TILE_CELLS.start(), max = *TILE_CELLS.end()))]
    #[serde(default = "default_tile_cells")]
    pub tile_cells: u32,
    /// Height of the sea's surface in metres, -100,000 to 100,000. Default: no sea.
    #[schemars(range(min = -HEIGHT_LIMIT_M, max = HEIGHT_LIMIT_M))]
    pub sea_level_m: Option<f64>,
    /// The geography of a whole world: continents, ranges and climates, which differ from place to place. Needs
    /// `fluvial` and `sea_level_m`. Default: none, and the settings of the preset hold everywhere.
    pub geography: Option<GeographySettings>,
    /// Fluvial relief, shaped by water, with its rivers and lakes. Default: none, and the relief is that of the noise
    /// terms.
    pub fluvial: Option<FluvialSettings>,
    /// Noise terms that are added up to the relief of the land. 1 to 16, unless `fluvial` is given.
    #[schemars(length(max = MAX_TERMS))]
    #[serde(default)]
    pub noise: Vec<NoiseTerm>,
    /// Domain warp of all terms and masks: displacement of the positions at which they are evaluated. Default: none.
    pub warp: Option<WarpSettings>,
    /// Distribution of land and sea floor. Default: land everywhere.
    pub land: Option<LandMask>,
    /// Rivers by the thesis' agents. Default: none.
    pub rivers: Option<RiverAgents>,
    /// Roads by the thesis' agents. Default: none.
    pub roads: Option<RoadAgents>,
    /// Settlements and the roads between them; needs `fluvial`. Default: none.
    pub places: Option<PlacesSettings>,
    /// Distribution of the ground's materials.
    #[serde(default)]
    pub ground: GroundSettings,
    /// Colours and shading of the map.
    #[serde(default)]
    pub map: MapStyle,
}

fn one() -> u64 {
    1
}

fn one_metre() -> f64 {
    1.0
}

fn default_tile_cells() -> u32 {
    256
}

/// Allowed numbers of cells per tile side.
pub const TILE_CELLS: RangeInclusive<u32> = 16..=4096;

impl Preset {
    /// Loads the built-in preset of this name, or else the preset in the file at this path. Returns its short name and
    /// the preset.
    ///
    /// # Errors
    /// When there is no such preset, or when it cannot be read or parsed.
    pub fn load(name_or_path: &str) -> Result<(String, Preset), Error> {
        let sources = Sources::load(name_or_path)?;
        Ok((sources.name().to_owned(), sources.read_all()?))
    }

    /// Parses the preset in `text`, with every default filled in. `file` is its name in errors.
    ///
    /// # Errors
    /// When the text is not TOML, has an unknown key, lacks a key or has a value out of its range; the error points at
    /// the place.
    pub fn parse(file: &str, text: &str) -> Result<Preset, Error> {
        Sources::parse(file, text)?.read_all()
    }

    /// Returns warnings, a sentence each, about unexpected effects of single keys that were set. `self` is the preset
    /// that `sources` make.
    pub fn warnings(&self, sources: &Sources) -> Vec<String> {
        let Ok(unset) = sources.read_unset() else { return Vec::new() };
        let (old_m, new_m) = (unset.spacing_m, self.spacing_m);
        if self.fluvial.is_none() || old_m == new_m {
            return Vec::new();
        }
        vec![format!(
            "spacing_m = {new_m} makes other land, not the same more or less finely: rivers and lakes have other courses and \
             shores than with {old_m}, and towns lie elsewhere"
        )]
    }

    /// Returns the JSON schema of preset files.
    pub fn schema() -> serde_json::Value {
        let mut schema = schema::of::<Preset>();
        schema["properties"]["extends"] = json!({
            "type": "string",
            "description": "A built-in preset, or the path of a file from this one's folder, on which this one is built: its \
                tables are merged with this one's, and all else here takes the place of what is there. Default: none.",
        });
        schema
    }

    /// Returns the number from which all random numbers of a world follow: the seed with the country mixed in, which
    /// happens nowhere else.
    pub fn chance(&self, seed: u64) -> u64 {
        hash::with_text(seed, self.country.as_deref().unwrap_or_default())
    }

    /// Fills in the defaults that depend on other keys.
    pub(crate) fn fill_defaults(&mut self) {
        self.noise.iter_mut().for_each(NoiseTerm::fill_defaults);
    }

    /// Checks ranges and relations of the values in a preset that was built in code instead of read.
    ///
    /// # Errors
    /// The first fault, if there is one.
    pub fn check(&self) -> Result<(), Fault> {
        // TOML has no unsigned 64-bit integers, so a large seed could not be written. Every seed is valid, so the check
        // uses 0.
        let mut filled = Preset { seed: 0, ..self.clone() };
        filled.fill_defaults();
        schema::check(&filled, &KeyPath::default())?;
        filled.check_together()
    }

    /// Finds the first value that contradicts another one. Each value alone must be within its range.
    fn check_together(&self) -> Result<(), Fault> {
        let root = KeyPath::default();
        if let Some(fluvial) = &self.fluvial {
            const NOISE: &str = "nothing reads it in a world of fluvial relief";
            const RIVERS: &str =
                "agents cut rivers into finished land, and fluvial relief has its own, which drain all of it";
            const ROADS: &str =
                "agents follow the land of a tile or two, and fluvial land has roads between settlements";
            let others = [
                ("noise", !self.noise.is_empty(), NOISE, "leave it out, or leave [fluvial] out"),
                ("warp", self.warp.is_some(), NOISE, "leave it out, or leave [fluvial] out"),
                ("land", self.land.is_some(), NOISE, "leave it out, or leave [fluvial] out"),
                ("rivers", self.rivers.is_some(), RIVERS, "leave it out: [fluvial] says how many rivers there are"),
                ("roads", self.roads.is_some(), ROADS, "leave it out, and add [places]"),
            ];
            if let Some((key, _, reason, hint)) = others.into_iter().find(|(_, given, ..)| *given) {
                return Err(root.key(key).fault(reason, hint).at_key());
            }
            fluvial.check(&root.key("fluvial"), self.spacing_m)?;
            // With a higher sea, the land's compression at large heights would push rivers below the sea that they flow
            // into.
            let pressed_m = fluvial.knee * fluvial.ceiling_m;
            let what = "knee times ceiling_m of [fluvial], from where on the land is pressed together";
            root.key("sea_level_m").at_most(self.sea_level_m.unwrap_or(pressed_m), pressed_m, what)?;
        } else if self.noise.is_empty() {
            let hint = "add a [[noise]] table, or [fluvial]";
            return Err(root.fault("there must be at least one [[noise]] term, or [fluvial]", hint));
        }
        if let Some(places) = &self.places {
            let path = root.key("places");
            if self.fluvial.is_none() {
                let hint = "add [fluvial], or leave it out; [roads] is for worlds of noise";
                return Err(path.fault("nothing reads it in a world of noise", hint).at_key());
            }
            places.check(&path, self.spacing_m)?;
        }
        for (index, term) in self.noise.iter().enumerate() {
            term.check(&root.key("noise").index(index), self.spacing_m)?;
        }
        if let Some(land) = &self.land {
            land.check(&root.key("land"), self.spacing_m)?;
        }
        if let Some(warp) = &self.warp {
            let masks = self.noise.iter().filter_map(|term| term.mask.as_ref());
            let masks = masks.chain(self.land.iter().map(|land| &land.mask));
            let noises = self.noise.iter().map(NoiseTerm::fractal).chain(masks.map(Mask::fractal));
            warp.check(&root.key("warp"), noises, self.spacing_m)?;
        }
        self.ground.check(&root.key("ground"))?;
        if let Some(rivers) = &self.rivers {
            rivers.check(&root.key("rivers"), self.tile_cells, self.spacing_m)?;
        }
        if let Some(roads) = &self.roads {
            roads.check(&root.key("roads"), self.tile_cells, self.spacing_m)?;
        }
        self.map.check(&root.key("map"))
    }

    /// Returns the same preset with tiles of another size.
    #[must_use]
    pub fn with_tile_cells(&self, tile_cells: u32) -> Preset {
        Preset { tile_cells, ..self.clone() }
    }
}

/// The texts that make a preset: from the base that all others extend to the last single setting.
pub type Sources = source::RecipeSources<Preset>;

impl Recipe for Preset {
    const WHAT: &'static str = "preset";
    const FOLDER: &'static str = "presets";
    const BUILT_IN: &'static [(&'static str, &'static str)] = BUILT_IN;

    fn check_written(root: &DeValue) -> Result<(), Fault> {
        check_needs(root)
    }

    fn complete(&mut self) -> Result<(), Fault> {
        self.fill_defaults();
        self.check_together()
    }
}

/// Largest number of terms, more than anybody needs; the time of a bake grows with each.
const MAX_TERMS: usize = 16;

/// Pairs of keys: nothing reads the first unless the second is written too.
const NEEDS: &[(&str, &str)] = &[
    ("geography", "fluvial"),
    ("geography", "sea_level_m"),
    ("fluvial.coast", "sea_level_m"),
    ("ground.sand_m", "sea_level_m"),
    ("ground.snow_slope", "ground.snow_m"),
    ("ground.snow_aspect_m", "ground.snow_m"),
    ("ground.sand_slope", "ground.sand_m"),
    ("ground.scree_m", "ground.scree"),
    ("ground.forest_share", "ground.forest_m"),
    ("ground.forest_slope", "ground.forest_m"),
    ("ground.forest_aspect_m", "ground.forest_m"),
    ("ground.meadow", "ground.forest_m"),
    ("ground.wet_m", "fluvial"),
    ("ground.forest_wet", "ground.forest_m"),
    ("ground.forest_wet", "ground.wet_m"),
];

/// Keys that nothing reads in a world with a geography, whose places have values of their own.
const OF_PLACES: &[&str] = &[
    "fluvial.basin_m",
    "fluvial.uplift",
    "fluvial.valley",
    "fluvial.levees",
    "fluvial.ice_m",
    "fluvial.moraines",
    "fluvial.glacier_m",
    "fluvial.gullies",
    "fluvial.rock",
    "fluvial.runoff_m",
    "fluvial.lakes",
    "fluvial.old_arms",
    "fluvial.braids",
    "fluvial.coast.octaves",
];

/// Finds the first key written in a preset that nothing would read.
fn check_needs(root: &DeValue) -> Result<(), Fault> {
    let path = |keys: &str| keys.split('.').fold(KeyPath::default(), |path, key| path.key(key));
    let is_written =
        |keys: &str| keys.split('.').try_fold(root, |value, key| value.get(key).map(Spanned::get_ref)).is_some();
    let of_place = match NEEDS.iter().find(|(key, needed)| is_written(key) && !is_written(needed)) {
        Some((key, needed)) => {
            let hint = format!("give {needed}, or leave it out");
            return Err(path(key).fault(format!("nothing reads it without {needed}"), hint).at_key());
        }
        None if is_written("geography") => OF_PLACES.iter().find(|key| is_written(key)),
        None => None,
    };
    match of_place {
        Some(key) => {
            let hint = "leave it out, or extend world: each place has its own value, by its land and its climate";
            Err(path(key).fault("nothing reads it with a geography", hint).at_key())
        }
        None => Ok(()),
    }
}
