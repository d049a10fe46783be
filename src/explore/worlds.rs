//! The worlds that pages look at.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex};

use serde::Deserialize;
use serde_json::{Value, json};

use crate::error::Error;
use crate::explore::tile_address::{MAX_ZOOM, REACH, pixel_m};
use crate::find::Finder;
use crate::generator;
use crate::map::Chart;
use crate::map::style::{STYLES, Style};
use crate::memory::Budget;
use crate::preset::{BUILT_IN, Preset};
use crate::recipe::source::{RecipeSources, built_in};
use crate::web::{HEIGHT_SPACING_PX, HEIGHT_STEP_M, TileEncoding};
use crate::world::World;

/// The name by which pages ask for the preset file that the explorer was started with.
pub(super) const FILE: &str = "@";

/// Largest number of worlds that are kept open.
const MOST_OPEN: usize = 8;

/// Number of letters of a world's identity in addresses.
const ID_LETTERS: usize = 16;

/// The world that an explorer was started with.
#[derive(Clone, Debug)]
pub struct Given {
    /// The name of a built-in preset, or the path of a file.
    pub preset: String,
    /// The seed to use instead of the preset's.
    pub seed: Option<u64>,
    /// Settings on top of the preset, as `key=value`.
    pub set: Vec<String>,
}

/// A world as a page asks for it: a preset, and what is changed in it.
#[derive(Clone, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct WorldRecipe {
    /// The name of a built-in preset, or [`FILE`].
    pub preset: String,
    pub seed: Option<u64>,
    #[serde(default)]
    pub set: Vec<String>,
}

/// An open world, which somebody looks at.
pub(super) struct Opened {
    /// Digest of the preset, the seed and the program's version, which tells the world from all others.
    pub digest: blake3::Hash,
    pub recipe: WorldRecipe,
    /// The preset's name or path, as a command line has it.
    pub source: String,
    pub name: String,
    /// The preset as it was read. The world for maps has another tile size.
    pub preset: Preset,
    pub world: Arc<World>,
    /// Finds things in the world; made by the first search.
    pub finder: Mutex<Option<Finder>>,
}

/// The open worlds, most recently used first.
pub(super) struct Worlds {
    given: Given,
    open: Mutex<VecDeque<Arc<Opened>>>,
    /// The memory that all worlds at all scales share.
    pub budget: Arc<Budget>,
}

impl Worlds {
    pub fn new(given: Given, budget: Arc<Budget>) -> Worlds {
        Worlds { given, open: Mutex::default(), budget }
    }

    /// Returns the recipe of the world that the explorer was started with.
    pub fn first(&self) -> WorldRecipe {
        let Given { preset, seed, set } = self.given.clone();
        let preset = if self.file().is_some() { FILE.into() } else { preset };
        WorldRecipe { preset, seed, set }
    }

    /// Returns the preset file that the explorer was started with; `None` for a built-in preset.
    pub fn file(&self) -> Option<&str> {
        let preset = &self.given.preset;
        BUILT_IN.iter().all(|(name, _)| name != preset).then_some(preset)
    }

    /// Reads a preset, and returns its source, its name and itself. Only the file that the explorer was started with
    /// and the files that it extends are ever read.
    ///
    /// # Errors
    /// When there is no such preset, or something is wrong with it.
    pub fn read(&self, recipe: &WorldRecipe) -> Result<(String, String, Preset), Error> {
        let source = match self.file() {
            Some(file) if recipe.preset == FILE => file,
            _ => built_in::<Preset>(&recipe.preset).map(|_| &*recipe.preset)?,
        };
        let mut sources = RecipeSources::<Preset>::load(source)?;
        recipe.set.iter().try_for_each(|setting| sources.set("--set", setting))?;
        Ok((source.to_owned(), sources.name().to_owned(), sources.read_all()?))
    }

    /// Opens the world of a recipe, with the preset's file as it is at this time.
    ///
    /// # Errors
    /// The errors of [`read`](Worlds::read), and when a value is out of its range.
    pub fn open(&self, recipe: &WorldRecipe) -> Result<Arc<Opened>, Error> {
        let (source, name, preset) = self.read(recipe)?;
        let seed = recipe.seed.unwrap_or(preset.seed);
        let identity = json!([generator::VERSION, generator::layers(), preset, seed]);
        let digest = blake3::hash(identity.to_string().as_bytes());
        let known = self.find(|opened| opened.digest == digest && opened.recipe == *recipe);
        if let Some(opened) = known {
            return Ok(opened);
        }
        let world = match self.find(|opened| opened.digest == digest) {
            Some(same) => same.world.clone(),
            None => Chart::world_within(&preset, Some(seed), &self.budget)?,
        };
        let opened =
            Arc::new(Opened { digest, recipe: recipe.clone(), source, name, preset, world, finder: Mutex::default() });
        let mut open = self.open.lock().expect("no thread panics while it looks at worlds");
        open.retain(|other| other.digest != digest);
        open.push_front(opened.clone());
        open.truncate(MOST_OPEN);
        Ok(opened)
    }

    /// Returns the open world with an identity.
    pub fn known(&self, id: &str) -> Option<Arc<Opened>> {
        self.find(|opened| opened.id() == id)
    }

    fn find(&self, is_it: impl Fn(&Opened) -> bool) -> Option<Arc<Opened>> {
        let mut open = self.open.lock().expect("no thread panics while it looks at worlds");
        let at = open.iter().position(|opened| is_it(opened))?;
        let opened = open.remove(at).expect("it was just there");
        open.push_front(opened.clone());
        Some(opened)
    }
}

impl Opened {
    pub fn id(&self) -> String {
        self.digest.to_hex()[..ID_LETTERS].to_owned()
    }

    /// Returns all that a page must know of the world.
    pub fn about(&self) -> Value {
        let (world, preset) = (&self.world, &self.preset);
        let WorldRecipe { preset: named, set, .. } = &self.recipe;
        let suits = |name: &str| Style::load(name).is_ok_and(|style| style.check_for(world).is_ok());
        let titles = STYLES
            .iter()
            .filter(|(name, _)| suits(name))
            .map(|(name, _)| json!({ "name": name, "title": capitalised(name) }));
        let reach_m = REACH as f64 * world.spacing_m();
        let (lowest_m, highest_m) = world.height_range_m();
        json!({
            "id": self.id(), "name": self.name, "preset": named, "seed": world.seed(), "set": set,
            "file": (named == FILE).then_some(&self.source),
            "description": format!("seed {}, {} m between vertices", world.seed(), world.spacing_m()),
            "warnings": world.warnings(), "spacing_m": world.spacing_m(), "tile_cells": preset.tile_cells,
            "is_fluvial": preset.fluvial.is_some(), "sea_level_m": preset.sea_level_m,
            "height_range_m": [lowest_m, highest_m], "values": preset,
            "ending": TileEncoding::WebP.ending(), "dense": true, "layers": titles.collect::<Vec<_>>(),
            "heights": { "step_m": HEIGHT_STEP_M, "spacing_px": HEIGHT_SPACING_PX },
            "ground": {
                "min_zoom": 0, "max_zoom": MAX_ZOOM, "finest_m": pixel_m(world.spacing_m(), MAX_ZOOM), "corner_m": [0, 0],
                "bounds_m": [-reach_m, -reach_m, reach_m, reach_m],
            },
        })
    }
}

fn capitalised(name: &str) -> String {
    let mut letters = name.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn worlds(preset: &str) -> Worlds {
        Worlds::new(Given { preset: preset.into(), seed: None, set: Vec::new() }, Budget::new(1 << 20))
    }

    #[test]
    fn a_world_has_one_identity_however_it_is_written() {
        let worlds = worlds("thesis");
        let open = |seed, set: &[&str]| {
            let set = set.iter().map(|setting| (*setting).to_owned()).collect();
            worlds.open(&WorldRecipe { preset: "thesis".into(), seed, set }).unwrap()
        };
        let first = open(None, &[]);
        let id = first.id();
        assert_eq!(id.len(), ID_LETTERS);
        assert_eq!(open(Some(first.world.seed()), &[]).id(), id);
        assert!(Arc::ptr_eq(&open(Some(first.world.seed()), &[]).world, &first.world));
        assert_ne!(open(Some(77), &[]).id(), id);
        assert_ne!(open(None, &["spacing_m=0.5"]).id(), id);
        assert!(worlds.known(&id).is_some() && worlds.known("0123456789abcdef").is_none());
    }

    #[test]
    fn no_file_is_read_but_the_one_that_was_given() {
        let folder = tempfile::tempdir().unwrap();
        let [given, other] = ["given.toml", "other.toml"].map(|name| folder.path().join(name).display().to_string());
        std::fs::write(&given, "extends = \"thesis\"\nspacing_m = 0.5\n").unwrap();
        std::fs::write(&other, "extends = \"thesis\"\n").unwrap();
        let worlds = worlds(&given);
        let recipe = |preset: &str| WorldRecipe { preset: preset.into(), ..WorldRecipe::default() };
        assert_eq!(worlds.first(), recipe(FILE));
        assert_eq!(worlds.open(&recipe(FILE)).unwrap().world.spacing_m(), 0.5);
        for elsewhere in [&given, &other, "/etc/passwd", "../Cargo.toml", "-", ""] {
            assert!(worlds.open(&recipe(elsewhere)).is_err(), "{elsewhere}");
        }
        // The file is read each time, so a change shows.
        std::fs::write(&given, "extends = \"thesis\"\nspacing_m = 2\n").unwrap();
        assert_eq!(worlds.open(&recipe(FILE)).unwrap().world.spacing_m(), 2.0);
        std::fs::write(&given, "spacing_m = \n").unwrap();
        assert!(worlds.open(&recipe(FILE)).err().unwrap().to_string().contains("given.toml:1"));
        // An explorer of a built-in preset has no file.
        assert!(self::worlds("thesis").open(&recipe(FILE)).is_err());
    }

    #[test]
    fn a_few_worlds_are_kept() {
        let worlds = worlds("thesis");
        let open = |seed| {
            worlds.open(&WorldRecipe { preset: "thesis".into(), seed: Some(seed), set: Vec::new() }).unwrap().id()
        };
        let first = open(0);
        let ids: Vec<String> = (1..MOST_OPEN as u64).map(open).collect();
        assert!(worlds.known(&first).is_some(), "it was just used, and stays");
        open(99);
        assert!(worlds.known(&first).is_some() && worlds.known(&ids[0]).is_none());
    }
}
