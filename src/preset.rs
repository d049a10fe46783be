//! Presets: a world's recipe as its author writes it, read with errors that point at the place.
//!
//! [`Preset`] is the recipe as written; [`World`](crate::world::World) is the recipe as understood. Every key, its
//! unit, its range and its default is documented here, and the error for an unknown key lists the known ones.

use std::fmt::Display;
use std::fs;
use std::io::Read;
use std::ops::{Range, RangeInclusive};
use std::path::Path;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use toml::de::{DeTable, DeValue};

use crate::error::{Error, SourcePlace, nearest};
use crate::fluvial::settings::FluvialSettings;
use crate::noise::{Fractal, FractalKind, FractalSpec};
use crate::places::settings::PlacesSettings;

/// A world's recipe: the content of a preset file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Preset {
    /// The seed when the command gives none. Default: 1.
    #[serde(default = "one")]
    pub seed: u64,
    /// Metres between neighbouring vertices, 0.001 to 10,000. Default: 1.
    #[serde(default = "one_metre")]
    pub spacing_m: f64,
    /// Cells a tile side, 16 to 4096. Default: 256.
    #[serde(default = "default_tile_cells")]
    pub tile_cells: u32,
    /// Height of the sea's surface in metres. Default: no sea.
    pub sea_level_m: Option<f64>,
    /// Relief that water made, with its rivers and lakes. Default: none, and the relief is that of the noise terms.
    pub fluvial: Option<FluvialSettings>,
    /// Noise terms, added up: the relief of the land. At least one, or else `fluvial`.
    #[serde(default)]
    pub noise: Vec<NoiseTerm>,
    /// Displacement of the points at which all terms and masks are read. Default: none.
    pub warp: Option<Warp>,
    /// Where the land is and where the sea floor. Default: land everywhere.
    pub land: Option<Land>,
    /// Rivers by the thesis' agents. Default: none.
    pub rivers: Option<RiverAgents>,
    /// Roads by the thesis' agents. Default: none.
    pub roads: Option<RoadAgents>,
    /// Settlements and the roads between them; needs `fluvial`. Default: none.
    pub places: Option<PlacesSettings>,
    /// Which ground lies where.
    #[serde(default)]
    pub ground: Ground,
    /// How the map is coloured.
    #[serde(default)]
    pub map: MapStyle,
}

/// One fractal noise term: `height_m * curve(fractal) + base_m`, times its mask.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NoiseTerm {
    /// How the octaves combine.
    pub kind: NoiseKind,
    /// Metres that one unit of noise is high, -100,000 to 100,000.
    pub height_m: f64,
    /// Metres added where the term applies, -100,000 to 100,000. Default: 0.
    #[serde(default)]
    pub base_m: f64,
    /// Wavelength of the first octave in metres. Default: 1400.
    #[serde(default = "thesis_wavelength_m")]
    pub wavelength_m: f64,
    /// Octaves, 1 to 16. Default: 8.
    #[serde(default = "thesis_octaves")]
    pub octaves: u32,
    /// Musgrave's H: octave i has the amplitude `lacunarity^(-H i)`, 0 to 4. Default: 2 for `ridged`, 0.25 for
    /// `hybrid`, else 1.
    pub dimension: Option<f64>,
    /// Ratio of the frequencies of neighbouring octaves, 1.5 to 8. Default: 2.5.
    #[serde(default = "thesis_lacunarity")]
    pub lacunarity: f64,
    /// `ridged`, `hybrid` and `hetero` only: what is added to the noise (ridged: from what its absolute value is
    /// taken), 0 to 4. Default: 0.7 for `hybrid`, else 1.
    pub offset: Option<f64>,
    /// `ridged` only: how strongly an octave's signal lets the next one in, 0 to 16. Default: 2.
    pub gain: Option<f64>,
    /// A piecewise linear map `[[in, out], ...]` of the fractal's value, level beyond its ends. Default: the value
    /// itself.
    pub curve: Option<Vec<[f64; 2]>>,
    /// Where the term applies. Default: everywhere.
    pub mask: Option<Mask>,
}

/// How the octaves of a term combine. Based on: Ebert et al., *Texturing and Modeling*, chapter 16 (Musgrave).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum NoiseKind {
    /// Fractional Brownian motion: the plain sum.
    Fbm,
    /// Ridged multifractal: sharp crests, with detail where the octave before was high.
    Ridged,
    /// Hybrid multifractal: smooth in the valleys, rough on the heights.
    Hybrid,
    /// Heterogeneous terrain: roughness grows with the height itself.
    Hetero,
}

/// A slowly varying share from 0 to 1: plain noise, eased from 0 at `from` to 1 at `to`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Mask {
    /// Wavelength of the first octave in metres.
    pub wavelength_m: f64,
    /// Octaves, 1 to 16. Default: 3.
    #[serde(default = "default_mask_octaves")]
    pub octaves: u32,
    /// The noise (about -1 to 1) at which the share is 0.
    pub from: f64,
    /// The noise at which the share is 1; below `from`, and the mask is inverted.
    pub to: f64,
}

/// Displacement of the points at which the noise is read.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Warp {
    /// Wavelength of the first octave in metres.
    pub wavelength_m: f64,
    /// Octaves, 1 to 16. Default: 3.
    #[serde(default = "default_mask_octaves")]
    pub octaves: u32,
    /// Metres that one unit of noise displaces.
    pub distance_m: f64,
}

/// Where land is: the heights are the terms' where the mask is 1 and `floor_m` where it is 0.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Land {
    /// Where land is.
    pub mask: Mask,
    /// Height of the sea floor far from land, in metres.
    pub floor_m: f64,
}

/// Which ground lies where: grass, with dirt and rock by slope, sand by height, snow by height and aspect.
///
/// Slope enters as the thesis has it, `slope_scale * (1 - n.up)` for the normal n, cut off at 1. With the thesis' scale
/// of 5, steepness 0.1 is a slope of 11 degrees, 0.5 is 26 and 1 is 37.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Ground {
    /// What `1 - n.up` is multiplied by to give the steepness, 0.1 to 100. Default: 5.
    #[serde(default = "thesis_slope_scale")]
    pub slope_scale: f64,
    /// Steepness at which dirt begins and at which it has taken the grass' place. Default: [0.1, 0.5].
    #[serde(default = "default_dirt")]
    pub dirt: [f64; 2],
    /// Steepness at which rock begins and at which all is rock. Default: [0.4, 0.9].
    #[serde(default = "default_rock")]
    pub rock: [f64; 2],
    /// Metres above the sea level up to which all is sand, and at which sand ends. Default: no sand.
    pub sand_m: Option<[f64; 2]>,
    /// Height in metres at which snow begins and at which all is snow. Default: no snow.
    pub snow_m: Option<[f64; 2]>,
    /// Steepness at which snow begins to slide off and at which none is left. Default: [0.6, 1].
    #[serde(default = "default_snow_slope")]
    pub snow_slope: [f64; 2],
    /// Metres by which snow reaches further down a slope of 45 degrees that faces north than down level ground, and less
    /// far down one that faces south, -2000 to 2000: below 0 the sun stands in the north. Default: 0.
    #[serde(default)]
    pub snow_aspect_m: f64,
}

impl Default for Ground {
    fn default() -> Ground {
        Ground {
            slope_scale: thesis_slope_scale(),
            dirt: default_dirt(),
            rock: default_rock(),
            sand_m: None,
            snow_m: None,
            snow_slope: default_snow_slope(),
            snow_aspect_m: 0.0,
        }
    }
}

/// How the map is coloured.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MapStyle {
    /// The hypsometric tint. Default: `temperate`.
    #[serde(default)]
    pub tint: Tint,
    /// Height in metres of the lowest land colour. Default: the sea level, or the lowest height of the world.
    pub low_m: Option<f64>,
    /// Height in metres of the highest land colour. Default: the highest height of the world.
    pub high_m: Option<f64>,
    /// How many times the slopes are steepened before they are shaded, 0.1 to 20. Default: 1.
    pub exaggeration: Option<f64>,
}

/// A scale of land colours by height.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Tint {
    /// Lowland green through straw and brown to grey and white.
    #[default]
    Temperate,
    /// Sand, ochre and red rock.
    Arid,
    /// Dark forest, alpine meadow, rock and snow.
    Alpine,
}

/// The thesis' river agents: a greedy search downhill, from the highest vertex of the tile that owns the river.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct RiverAgents {
    /// Share of the tiles that own a river, 0 to 1. Default: 0.5.
    pub density: f64,
    /// Tile edges that a river may cross, 0 to 8: its reach. Default: 3.
    pub max_tiles: u32,
    /// What a step in the assigned direction is worth. Default: 1.
    pub direction_weight: f64,
    /// What a metre down is worth. Default: 24.
    pub height_weight: f64,
    /// Metres above its lowest point that a river may climb before the way is too far uphill. Default: 4.
    pub max_climb_m: f64,
    /// Where the assigned direction comes from. Default: `slope`.
    pub aim: Aim,
    /// What becomes of a river that ends in nothing. Default: `trim`.
    pub ending: Ending,
    /// Width of the bed in metres at the source and where it has come as far as its reach. Default: [3, 12].
    pub width_m: [f64; 2],
    /// Depth of the bed in metres, likewise. Default: [0.6, 2.5].
    pub depth_m: [f64; 2],
    /// Metres from the bed to where the bank meets the land. Default: 10.
    pub bank_m: f64,
}

impl Default for RiverAgents {
    fn default() -> RiverAgents {
        RiverAgents {
            density: 0.5,
            max_tiles: 3,
            direction_weight: 1.0,
            height_weight: 24.0,
            max_climb_m: 4.0,
            aim: Aim::Slope,
            ending: Ending::Trim,
            width_m: [3.0, 12.0],
            depth_m: [0.6, 2.5],
            bank_m: 10.0,
        }
    }
}

/// Where an agent's direction comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Aim {
    /// The hash of the tile that owns it.
    Hash,
    /// The large-scale slope of that tile: downhill.
    Slope,
}

/// What becomes of a river that ends in nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Ending {
    /// It loses the last third of its way, as in the thesis.
    Trim,
    /// It ends in a pond.
    Pond,
}

/// The thesis' road agents: a greedy search over level ground, from the middle of the tile that owns the road.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct RoadAgents {
    /// Share of the tiles that own a road, 0 to 1. Default: 0.3.
    pub density: f64,
    /// Tile edges that a road may cross, 0 to 8: its reach. Default: 3.
    pub max_tiles: u32,
    /// Vertices from a node to the next; the thesis: one at a time zigzags. Default: 7.
    pub step_cells: u32,
    /// What a step in the assigned direction is worth. Default: 1.
    pub direction_weight: f64,
    /// What full steepness costs. Default: 10.
    pub steepness_weight: f64,
    /// Steepness at which a road ends. Default: 0.9.
    pub max_steepness: f64,
    /// Width of the road in metres. Default: 5.
    pub width_m: f64,
    /// Metres from the road's edge to where nothing of it is left. Default: 4.
    pub shoulder_m: f64,
    /// Whether the ground is levelled across the road; in the thesis it is not. Default: false.
    pub graded: bool,
}

impl Default for RoadAgents {
    fn default() -> RoadAgents {
        RoadAgents {
            density: 0.3,
            max_tiles: 3,
            step_cells: 7,
            direction_weight: 1.0,
            steepness_weight: 10.0,
            max_steepness: 0.9,
            width_m: 5.0,
            shoulder_m: 4.0,
            graded: false,
        }
    }
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

// The thesis' table 4.1 and the scale of its coordinates.
fn thesis_octaves() -> u32 {
    8
}

fn thesis_lacunarity() -> f64 {
    2.5
}

fn thesis_wavelength_m() -> f64 {
    1400.0
}

fn thesis_slope_scale() -> f64 {
    5.0
}

fn default_mask_octaves() -> u32 {
    3
}

fn default_dirt() -> [f64; 2] {
    [0.1, 0.5]
}

fn default_rock() -> [f64; 2] {
    [0.4, 0.9]
}

fn default_snow_slope() -> [f64; 2] {
    [0.6, 1.0]
}

/// Cells a tile side may have.
pub const TILE_CELLS: RangeInclusive<u32> = 16..=4096;

/// No preset is longer than this; a longer file is something else.
const MAX_PRESET_BYTES: u64 = 1 << 20;

/// The built-in presets, as name and text: the files of `presets/`.
pub const BUILT_IN: &[(&str, &str)] = &[
    ("alps", include_str!("../presets/alps.toml")),
    ("highlands", include_str!("../presets/highlands.toml")),
    ("archipelago", include_str!("../presets/archipelago.toml")),
    ("canyon", include_str!("../presets/canyon.toml")),
    ("plains", include_str!("../presets/plains.toml")),
    ("thesis", include_str!("../presets/thesis.toml")),
    ("mountains", include_str!("../presets/mountains.toml")),
    ("hills", include_str!("../presets/hills.toml")),
];

/// The first line of a preset's text without its comment mark: what the preset shows.
pub fn summary(text: &str) -> &str {
    text.lines().next().unwrap_or_default().trim_start_matches('#').trim()
}

/// The text of a built-in preset.
///
/// # Errors
/// When there is none of that name; the hint lists the names.
pub fn built_in(name: &str) -> Result<&'static str, Error> {
    let names = BUILT_IN.iter().map(|(name, _)| *name);
    BUILT_IN.iter().find(|(known, _)| *known == name).map(|(_, text)| *text).ok_or_else(|| Error::Preset {
        message: format!("there is neither a file nor a built-in preset named {name:?}"),
        source_place: None,
        hint: match nearest(name, names.clone()) {
            Some(meant) => format!("did you mean {meant}? built-in presets: {}", names.collect::<Vec<_>>().join(", ")),
            None => format!("built-in presets: {}", names.collect::<Vec<_>>().join(", ")),
        },
    })
}

impl Preset {
    /// The built-in preset of that name or else the preset in the file of that path, and its short name.
    ///
    /// # Errors
    /// When there is no such preset, or when it cannot be read or understood.
    pub fn load(name_or_path: &str) -> Result<(String, Preset), Error> {
        if let Some((name, text)) = BUILT_IN.iter().find(|(name, _)| *name == name_or_path) {
            return Ok((name.to_string(), Preset::parse(&format!("presets/{name}.toml"), text)?));
        }
        let path = Path::new(name_or_path);
        if fs::metadata(path).is_err() && path.components().count() == 1 && path.extension().is_none() {
            built_in(name_or_path)?;
        }
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        Ok((name, Preset::parse(name_or_path, &read_text(path)?)?))
    }

    /// The preset that `text` writes, with every default filled in. `file` is what errors name.
    ///
    /// # Errors
    /// When it is not TOML, has an unknown key, lacks one or has a value out of its range; the error points at it.
    pub fn parse(file: &str, text: &str) -> Result<Preset, Error> {
        let mut preset: Preset = toml::from_str(text).map_err(|error| {
            let span = error.span().unwrap_or(0..0);
            let message = error.message().trim().to_owned();
            Error::Preset {
                hint: hint_for_syntax(&message),
                message,
                source_place: Some(Box::new(SourcePlace::new(file, text, span))),
            }
        })?;
        preset.fill_defaults();
        preset.check().map_err(|fault| {
            let span = locate(text, &fault.path);
            fault.into_error(Some(Box::new(SourcePlace::new(file, text, span))))
        })?;
        Ok(preset)
    }

    /// Writes the defaults that depend on other keys into their places.
    pub(crate) fn fill_defaults(&mut self) {
        for term in &mut self.noise {
            let (dimension, offset, gain) = match term.kind {
                NoiseKind::Ridged => (2.0, Some(1.0), Some(2.0)),
                NoiseKind::Hybrid => (0.25, Some(0.7), None),
                NoiseKind::Hetero => (1.0, Some(1.0), None),
                NoiseKind::Fbm => (1.0, None, None),
            };
            term.dimension.get_or_insert(dimension);
            term.offset = term.offset.or(offset);
            term.gain = term.gain.or(gain);
        }
    }

    /// Finds the first value that is out of its range or that nothing would read.
    pub(crate) fn check(&self) -> Result<(), Fault> {
        let root = KeyPath::default();
        root.key("spacing_m").within(self.spacing_m, 0.001..=10_000.0)?;
        let (low, high) = TILE_CELLS.into_inner();
        root.key("tile_cells").within(self.tile_cells, low..=high)?;
        if let Some(level) = self.sea_level_m {
            root.key("sea_level_m").within(level, -HEIGHT_LIMIT_M..=HEIGHT_LIMIT_M)?;
        }
        if let Some(fluvial) = &self.fluvial {
            let others = [
                ("noise", !self.noise.is_empty()),
                ("warp", self.warp.is_some()),
                ("land", self.land.is_some()),
                ("rivers", self.rivers.is_some()),
                ("roads", self.roads.is_some()),
            ];
            if let Some((key, _)) = others.into_iter().find(|(_, given)| *given) {
                let hint = "leave it out, or leave [fluvial] out";
                return Err(root.key(key).fault("nothing reads it in a world of fluvial relief", hint));
            }
            fluvial.check(&root.key("fluvial"), self.spacing_m)?;
        } else if self.noise.is_empty() {
            let hint = "add a [[noise]] table, or [fluvial]";
            return Err(root.key("noise").fault("there must be at least one noise term", hint));
        }
        if let Some(places) = &self.places {
            let path = root.key("places");
            if self.fluvial.is_none() {
                let hint = "add [fluvial], or leave it out; [roads] is for worlds of noise";
                return Err(path.fault("nothing reads it in a world of noise", hint));
            }
            places.check(&path, self.spacing_m)?;
        }
        if self.noise.len() > MAX_TERMS {
            let message = format!("there must be at most {MAX_TERMS} noise terms, but there are {}", self.noise.len());
            return Err(root.key("noise").fault(message, "leave some out"));
        }
        for (index, term) in self.noise.iter().enumerate() {
            term.check(&root.key("noise").index(index), self.spacing_m)?;
        }
        if let Some(warp) = &self.warp {
            let path = root.key("warp");
            check_octaves(&path, warp.wavelength_m, warp.octaves, MASK_LACUNARITY, self.spacing_m)?;
            path.key("distance_m").within(warp.distance_m, 0.0..=100_000.0)?;
        }
        if let Some(land) = &self.land {
            let path = root.key("land");
            land.mask.check(&path.key("mask"), self.spacing_m)?;
            path.key("floor_m").within(land.floor_m, -HEIGHT_LIMIT_M..=HEIGHT_LIMIT_M)?;
        }
        self.ground.check(&root.key("ground"), self.sea_level_m.is_some())?;
        if let Some(rivers) = &self.rivers {
            rivers.check(&root.key("rivers"), self.tile_side_m())?;
        }
        if let Some(roads) = &self.roads {
            roads.check(&root.key("roads"), self.tile_side_m(), self.tile_cells)?;
        }
        let map = root.key("map");
        for (key, value) in [("low_m", self.map.low_m), ("high_m", self.map.high_m)] {
            if let Some(value) = value {
                map.key(key).within(value, -HEIGHT_LIMIT_M..=HEIGHT_LIMIT_M)?;
            }
        }
        if let (Some(low), Some(high)) = (self.map.low_m, self.map.high_m)
            && low >= high
        {
            return Err(map.key("high_m").fault(format!("must lie above low_m = {low}, but it is {high}"), ""));
        }
        if let Some(exaggeration) = self.map.exaggeration {
            map.key("exaggeration").within(exaggeration, 0.1..=20.0)?;
        }
        self.check_reach_of_warp(&root)
    }

    /// The same recipe with tiles of another size.
    pub(crate) fn with_tile_cells(&self, tile_cells: u32) -> Preset {
        Preset { tile_cells, ..self.clone() }
    }

    fn tile_side_m(&self) -> f64 {
        self.tile_cells as f64 * self.spacing_m
    }

    /// Checks that the finest octave of all noises can follow the warp; all other values are sound.
    fn check_reach_of_warp(&self, root: &KeyPath) -> Result<(), Fault> {
        let Some(warp) = &self.warp else { return Ok(()) };
        let fractal = |spec: FractalSpec| Fractal::new(&spec, self.spacing_m, 0);
        let (low, high) = fractal(warp.fractal()).bounds();
        let reach_m = low.abs().max(high.abs()) as f64 * warp.distance_m;
        let masks =
            self.noise.iter().filter_map(|term| term.mask.as_ref()).chain(self.land.iter().map(|land| &land.mask));
        let noises = self.noise.iter().map(NoiseTerm::fractal).chain(masks.map(Mask::fractal));
        let most_m = noises.map(|spec| fractal(spec).max_warp_m()).fold(f32::INFINITY, f32::min) as f64;
        if reach_m <= most_m {
            return Ok(());
        }
        let message = format!("the warp reaches {reach_m:.0} m, and the finest octave follows {most_m:.0} m");
        Err(root.key("warp").key("distance_m").fault(message, "a smaller distance_m, or fewer octaves in the terms"))
    }
}

/// Heights and their factors may not be larger: 16 bits would be too coarse and `f32` metres too.
pub(crate) const HEIGHT_LIMIT_M: f64 = 100_000.0;

/// More terms than anybody needs; the time of a bake grows with each.
const MAX_TERMS: usize = 16;

/// Masks and warps are plain noise with octaves an octave apart, in the musician's sense.
const MASK_LACUNARITY: f64 = 2.0;

impl NoiseTerm {
    fn check(&self, path: &KeyPath, spacing_m: f64) -> Result<(), Fault> {
        path.key("height_m").within(self.height_m, -HEIGHT_LIMIT_M..=HEIGHT_LIMIT_M)?;
        path.key("base_m").within(self.base_m, -HEIGHT_LIMIT_M..=HEIGHT_LIMIT_M)?;
        path.key("lacunarity").within(self.lacunarity, 1.5..=8.0)?;
        check_octaves(path, self.wavelength_m, self.octaves, self.lacunarity, spacing_m)?;
        if let Some(dimension) = self.dimension {
            path.key("dimension").within(dimension, 0.0..=4.0)?;
        }
        let unread = |key: &str, kinds: &str| {
            let message = format!("nothing reads {key:?} in a term of kind {:?}", self.kind);
            Err(path.key(key).fault(message.to_lowercase(), format!("leave it out; it is for {kinds}")))
        };
        match self.offset {
            Some(_) if self.kind == NoiseKind::Fbm => return unread("offset", "ridged, hybrid and hetero"),
            Some(offset) => path.key("offset").within(offset, 0.0..=4.0)?,
            None => {}
        }
        match self.gain {
            Some(_) if self.kind != NoiseKind::Ridged => return unread("gain", "ridged"),
            // Nearly nothing would turn into a step between weights of 0 and 1.
            Some(gain) if gain != 0.0 => path.key("gain").within(gain, 1e-6..=16.0)?,
            _ => {}
        }
        if let Some(curve) = &self.curve {
            let path = path.key("curve");
            if !(2..=64).contains(&curve.len()) {
                let message = format!("must have 2 to 64 points, but it has {}", curve.len());
                return Err(path.fault(message, "write it as [[in, out], [in, out]]"));
            }
            for (index, point) in curve.iter().enumerate() {
                path.index(index).index(0).within(point[0], -1000.0..=1000.0)?;
                path.index(index).index(1).within(point[1], -1000.0..=1000.0)?;
                // Nearer points would make a step that is finer than the noise itself.
                if index > 0 && point[0] - curve[index - 1][0] < 1e-4 {
                    let message =
                        format!("the inputs of a curve must rise by 0.0001 or more, but {} does not", point[0]);
                    return Err(path.index(index).fault(message, "sort the points by their first number"));
                }
            }
        }
        self.mask.as_ref().map_or(Ok(()), |mask| mask.check(&path.key("mask"), spacing_m))
    }

    /// The fractal of this term, whose defaults are filled in.
    pub(crate) fn fractal(&self) -> FractalSpec {
        let filled = "fill_defaults has run";
        let kind = match self.kind {
            NoiseKind::Fbm => FractalKind::Fbm,
            NoiseKind::Ridged => {
                FractalKind::Ridged { offset: self.offset.expect(filled), gain: self.gain.expect(filled) }
            }
            NoiseKind::Hybrid => FractalKind::Hybrid { offset: self.offset.expect(filled) },
            NoiseKind::Hetero => FractalKind::Hetero { offset: self.offset.expect(filled) },
        };
        FractalSpec {
            kind,
            octaves: self.octaves,
            wavelength_m: self.wavelength_m,
            lacunarity: self.lacunarity,
            h: self.dimension.expect(filled),
        }
    }
}

/// The plain noise of masks and warps.
fn plain(wavelength_m: f64, octaves: u32) -> FractalSpec {
    FractalSpec { kind: FractalKind::Fbm, octaves, wavelength_m, lacunarity: MASK_LACUNARITY, h: 1.0 }
}

impl Warp {
    /// The noise of each of the two displacements.
    pub(crate) fn fractal(&self) -> FractalSpec {
        plain(self.wavelength_m, self.octaves)
    }
}

impl Mask {
    /// The noise that is eased into shares.
    pub(crate) fn fractal(&self) -> FractalSpec {
        plain(self.wavelength_m, self.octaves)
    }

    pub(crate) fn check(&self, path: &KeyPath, spacing_m: f64) -> Result<(), Fault> {
        check_octaves(path, self.wavelength_m, self.octaves, MASK_LACUNARITY, spacing_m)?;
        path.key("from").within(self.from, -10.0..=10.0)?;
        path.key("to").within(self.to, -10.0..=10.0)?;
        if (self.from - self.to).abs() < 1e-3 {
            let message = format!("must differ from `from` = {} by 0.001 or more, but it is {}", self.from, self.to);
            return Err(path.key("to").fault(message, "a step without a width would be a cliff"));
        }
        Ok(())
    }
}

/// Tiles that an agent may cross: the square of it is how many tiles a single one asks for their agents.
const MAX_CROSSED_TILES: u32 = 8;

impl RiverAgents {
    fn check(&self, path: &KeyPath, tile_side_m: f64) -> Result<(), Fault> {
        path.key("density").within(self.density, 0.0..=1.0)?;
        path.key("max_tiles").within(self.max_tiles, 0..=MAX_CROSSED_TILES)?;
        path.key("direction_weight").within(self.direction_weight, 0.0..=1000.0)?;
        path.key("height_weight").within(self.height_weight, 0.0..=1000.0)?;
        path.key("max_climb_m").within(self.max_climb_m, 0.0..=1000.0)?;
        for index in 0..2 {
            path.key("width_m").index(index).within(self.width_m[index], 0.1..=tile_side_m / 4.0)?;
            path.key("depth_m").index(index).within(self.depth_m[index], 0.0..=100.0)?;
        }
        for (key, [source, mouth]) in [("width_m", self.width_m), ("depth_m", self.depth_m)] {
            if mouth < source {
                let message =
                    format!("a river grows downstream, but {mouth} at its end is less than {source} at its source");
                return Err(path.key(key).fault(message, "write [source, end]"));
            }
        }
        path.key("bank_m").within(self.bank_m, 0.1..=tile_side_m / 4.0)
    }
}

impl RoadAgents {
    fn check(&self, path: &KeyPath, tile_side_m: f64, tile_cells: u32) -> Result<(), Fault> {
        path.key("density").within(self.density, 0.0..=1.0)?;
        path.key("max_tiles").within(self.max_tiles, 0..=MAX_CROSSED_TILES)?;
        path.key("step_cells").within(self.step_cells, 1..=tile_cells)?;
        path.key("direction_weight").within(self.direction_weight, 0.0..=1000.0)?;
        path.key("steepness_weight").within(self.steepness_weight, 0.0..=1000.0)?;
        path.key("max_steepness").within(self.max_steepness, 0.0..=1.0)?;
        path.key("width_m").within(self.width_m, 0.1..=tile_side_m / 4.0)?;
        path.key("shoulder_m").within(self.shoulder_m, 0.1..=tile_side_m / 4.0)
    }
}

impl Ground {
    fn check(&self, path: &KeyPath, sea: bool) -> Result<(), Fault> {
        path.key("slope_scale").within(self.slope_scale, 0.1..=100.0)?;
        let steepness = 0.0..=1.0;
        path.key("dirt").rising(self.dirt, steepness.clone())?;
        path.key("rock").rising(self.rock, steepness.clone())?;
        path.key("snow_slope").rising(self.snow_slope, steepness)?;
        if let Some(sand) = self.sand_m {
            if !sea {
                let message = "sand lies by the sea, and this world has none";
                return Err(path.key("sand_m").fault(message, "give sea_level_m, or leave it out"));
            }
            path.key("sand_m").rising(sand, -HEIGHT_LIMIT_M..=HEIGHT_LIMIT_M)?;
        }
        if let Some(snow) = self.snow_m {
            path.key("snow_m").rising(snow, -HEIGHT_LIMIT_M..=HEIGHT_LIMIT_M)?;
        } else if self.snow_aspect_m != 0.0 {
            let message = "there is no snow that could reach further down";
            return Err(path.key("snow_aspect_m").fault(message, "give snow_m, or leave it out"));
        }
        path.key("snow_aspect_m").within(self.snow_aspect_m, -2000.0..=2000.0)
    }
}

/// Checks a wavelength and its octaves: the finest must still be seen on the lattice.
fn check_octaves(
    path: &KeyPath,
    wavelength_m: f64,
    octaves: u32,
    lacunarity: f64,
    spacing_m: f64,
) -> Result<(), Fault> {
    path.key("octaves").within(octaves, 1..=16)?;
    path.key("wavelength_m").within(wavelength_m, spacing_m..=1e9)?;
    let finest = |octaves: u32| (1..octaves).fold(wavelength_m, |wavelength, _| wavelength / lacunarity);
    if finest(octaves) < spacing_m {
        let most = (1..octaves).rev().find(|&n| finest(n) >= spacing_m).unwrap_or(1);
        let message = format!(
            "the last of {octaves} octaves has a wavelength of {:.3} m, finer than the vertices ({spacing_m} m apart)",
            finest(octaves)
        );
        let hint = format!("give octaves = {most}, or a longer wavelength_m, or a smaller spacing_m");
        return Err(path.key("octaves").fault(message, hint));
    }
    Ok(())
}

/// What is wrong with a preset's value, and under which key.
#[derive(Debug)]
pub(crate) struct Fault {
    path: Vec<Step>,
    message: String,
    hint: String,
}

impl Fault {
    /// The error, pointing at a place if there is a text to point into.
    pub(crate) fn into_error(self, source_place: Option<Box<SourcePlace>>) -> Error {
        let key = self.path.iter().fold(String::new(), |text, step| match step {
            Step::Key(key) if text.is_empty() => key.clone(),
            Step::Key(key) => format!("{text}.{key}"),
            Step::Index(index) => format!("{text}[{index}]"),
        });
        Error::Preset { message: format!("{key}: {}", self.message), source_place, hint: self.hint }
    }
}

#[derive(Clone, Debug)]
enum Step {
    Key(String),
    Index(usize),
}

/// The way from the preset's root to a value.
#[derive(Clone, Default)]
pub(crate) struct KeyPath(Vec<Step>);

impl KeyPath {
    pub(crate) fn key(&self, key: &str) -> KeyPath {
        KeyPath([self.0.clone(), vec![Step::Key(key.to_owned())]].concat())
    }

    pub(crate) fn index(&self, index: usize) -> KeyPath {
        KeyPath([self.0.clone(), vec![Step::Index(index)]].concat())
    }

    pub(crate) fn fault(&self, message: impl Into<String>, hint: impl Into<String>) -> Fault {
        Fault { path: self.0.clone(), message: message.into(), hint: hint.into() }
    }

    pub(crate) fn within<T: PartialOrd + Display>(&self, value: T, range: RangeInclusive<T>) -> Result<(), Fault> {
        if range.contains(&value) {
            return Ok(());
        }
        let (low, high) = range.into_inner();
        Err(self.fault(format!("expected {low} to {high}, found {value}"), ""))
    }

    pub(crate) fn rising(&self, [from, to]: [f64; 2], range: RangeInclusive<f64>) -> Result<(), Fault> {
        self.index(0).within(from, range.clone())?;
        self.index(1).within(to, range)?;
        if to - from < 1e-3 {
            let message = format!("expected two numbers of which the second is larger, found [{from}, {to}]");
            return Err(self.fault(message, "between them the ground changes gradually"));
        }
        Ok(())
    }
}

/// The bytes of `text` in which the value at `path` stands, or the nearest table around it that is written at all.
fn locate(text: &str, path: &[Step]) -> Range<usize> {
    let Ok(root) = DeTable::parse(text) else { return 0..0 };
    let mut span = 0..0;
    let mut value = DeValue::Table(root.into_inner());
    for step in path {
        let next = match step {
            Step::Key(key) => value.get(key.as_str()),
            Step::Index(index) => value.get(*index),
        };
        let Some(next) = next else { break };
        span = next.span();
        value = next.get_ref().clone();
    }
    span
}

/// What would do where the TOML itself, a key or a type is wrong.
fn hint_for_syntax(message: &str) -> String {
    // The reader names an unknown key and the known ones in backquotes, in that order.
    let mut quoted = message.split('`').skip(1).step_by(2);
    match quoted.next() {
        Some(unknown) if message.starts_with("unknown") => match nearest(unknown, quoted) {
            Some(meant) => format!("did you mean {meant}?"),
            None => "keys and their meanings: terrane schema preset".to_owned(),
        },
        _ if message.starts_with("missing field") => "add the key to this table".to_owned(),
        _ if message.starts_with("invalid type") || message.starts_with("invalid value") => {
            "what each key takes: terrane schema preset".to_owned()
        }
        _ => "presets are TOML; terrane presets thesis prints one to start from".to_owned(),
    }
}

/// The text of a preset file.
fn read_text(path: &Path) -> Result<String, Error> {
    let refuse = |message: String, hint: &str| {
        let message = format!("{}: {message}", path.display());
        Err(Error::Preset { message, source_place: None, hint: hint.into() })
    };
    let metadata = match fs::metadata(path) {
        Ok(metadata) => metadata,
        Err(error) => return refuse(error.to_string(), "name a preset file or a built-in preset (terrane presets)"),
    };
    if metadata.is_dir() {
        return refuse("is a folder, not a preset".into(), "name the file in it");
    }
    let mut bytes = Vec::new();
    // One byte more than allowed is enough to know, even of a device that never ends.
    let read = fs::File::open(path).and_then(|file| file.take(MAX_PRESET_BYTES + 1).read_to_end(&mut bytes));
    if let Err(error) = read {
        return refuse(error.to_string(), "");
    }
    if bytes.len() as u64 > MAX_PRESET_BYTES {
        return refuse("is longer than 1 MiB, so it is no preset".into(), "a preset is a short TOML text");
    }
    String::from_utf8(bytes).or_else(|error| {
        let at = error.utf8_error().valid_up_to();
        let line = error.as_bytes()[..at].split(|&byte| byte == b'\n').count();
        refuse(format!("is not UTF-8 from byte {at} (line {line}) on"), "save it as UTF-8 text")
    })
}
