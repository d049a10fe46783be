//! Presets: a world's recipe as its author writes it, read with errors that point at the place.
//!
//! [`Preset`] is the recipe as written; [`World`](crate::world::World) is the recipe as understood. Every key, its
//! unit, its range and its default is documented here, and the error for an unknown key lists the known ones.

pub mod ground;
pub mod map;

use std::fs;
use std::io::Read;
use std::ops::{Range, RangeInclusive};
use std::path::Path;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use toml::de::{DeTable, DeValue};

use crate::agents::settings::{RiverAgents, RoadAgents};
use crate::error::{Error, SourcePlace, nearest};
use crate::fluvial::settings::FluvialSettings;
use crate::places::settings::PlacesSettings;
use crate::preset::ground::GroundSettings;
use crate::preset::map::MapStyle;
use crate::recipe::HEIGHT_LIMIT_M;
use crate::recipe::fault::{Fault, KeyPath, Step};
use crate::recipe::mask::Mask;
use crate::relief::settings::{LandMask, NoiseTerm, WarpSettings};

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
    pub warp: Option<WarpSettings>,
    /// Where the land is and where the sea floor. Default: land everywhere.
    pub land: Option<LandMask>,
    /// Rivers by the thesis' agents. Default: none.
    pub rivers: Option<RiverAgents>,
    /// Roads by the thesis' agents. Default: none.
    pub roads: Option<RoadAgents>,
    /// Settlements and the roads between them; needs `fluvial`. Default: none.
    pub places: Option<PlacesSettings>,
    /// Which ground lies where.
    #[serde(default)]
    pub ground: GroundSettings,
    /// How the map is coloured.
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

/// Cells a tile side may have.
pub const TILE_CELLS: RangeInclusive<u32> = 16..=4096;

/// No preset is longer than this; a longer file is something else.
const MAX_PRESET_BYTES: u64 = 1 << 20;

/// The built-in presets, as name and text: the files of `presets/`.
pub const BUILT_IN: &[(&str, &str)] = &[
    ("alps", include_str!("../../presets/alps.toml")),
    ("highlands", include_str!("../../presets/highlands.toml")),
    ("archipelago", include_str!("../../presets/archipelago.toml")),
    ("canyon", include_str!("../../presets/canyon.toml")),
    ("plains", include_str!("../../presets/plains.toml")),
    ("thesis", include_str!("../../presets/thesis.toml")),
    ("mountains", include_str!("../../presets/mountains.toml")),
    ("hills", include_str!("../../presets/hills.toml")),
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
        self.noise.iter_mut().for_each(NoiseTerm::fill_defaults);
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
        if let Some(land) = &self.land {
            land.check(&root.key("land"), self.spacing_m)?;
        }
        if let Some(warp) = &self.warp {
            let masks = self.noise.iter().filter_map(|term| term.mask.as_ref());
            let masks = masks.chain(self.land.iter().map(|land| &land.mask));
            let noises = self.noise.iter().map(NoiseTerm::fractal).chain(masks.map(Mask::fractal));
            warp.check(&root.key("warp"), noises, self.spacing_m)?;
        }
        self.ground.check(&root.key("ground"), self.sea_level_m.is_some())?;
        if let Some(rivers) = &self.rivers {
            rivers.check(&root.key("rivers"), self.tile_side_m())?;
        }
        if let Some(roads) = &self.roads {
            roads.check(&root.key("roads"), self.tile_side_m(), self.tile_cells)?;
        }
        self.map.check(&root.key("map"))
    }

    /// The same recipe with tiles of another size.
    pub(crate) fn with_tile_cells(&self, tile_cells: u32) -> Preset {
        Preset { tile_cells, ..self.clone() }
    }

    fn tile_side_m(&self) -> f64 {
        self.tile_cells as f64 * self.spacing_m
    }
}

/// More terms than anybody needs; the time of a bake grows with each.
const MAX_TERMS: usize = 16;

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
