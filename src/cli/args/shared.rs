//! Options that several commands share: the same word is the same option in all of them.

use std::io;
use std::path::PathBuf;
use std::sync::Arc;

use clap::Args;
use rayon::ThreadPool;

use super::{Named, built_in_names};
use crate::cli::console::Console;
use crate::cli::{thread_count, thread_pool};
use crate::device::{Device, LandMaker};
use crate::error::Error;
use crate::export::{Mode, VectorOptions};
use crate::preset::{Preset, Sources};
use crate::world::World;

/// The world that a command works in.
#[derive(Args)]
pub struct WorldArguments {
    /// A preset file, the name of a built-in preset (terrane presets), or - for standard input.
    #[arg(value_parser = Named(built_in_names::<Preset>), hide_possible_values = true)]
    pub preset: String,
    /// Seed of the world [default: the preset's].
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
    /// Set a key of the preset, such as sea_level_m=40 or noise[0].height_m=300; the value is as in TOML. May be
    /// repeated. Setting another spacing_m moves rivers, lakes and towns and changes their names.
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,
}

impl WorldArguments {
    /// Loads the preset and applies the settings.
    pub fn sources(&self) -> Result<Sources, Error> {
        let mut sources = match &self.preset[..] {
            "-" => Sources::read("stdin", io::stdin().lock())?,
            name_or_path => Sources::load(name_or_path)?,
        };
        for setting in &self.set {
            sources.set("--set", setting)?;
        }
        Ok(sources)
    }

    /// Loads the preset and applies the settings, and the cells per tile side if given.
    pub fn sources_in_tiles(&self, tile_cells: Option<u32>) -> Result<Sources, Error> {
        let mut sources = self.sources()?;
        if let Some(cells) = tile_cells {
            // After --set, so that the option with a name of its own wins.
            sources.set("--tile-cells", &format!("tile_cells={cells}"))?;
        }
        Ok(sources)
    }
}

/// The folder that a bake, a merge or a walk writes to.
#[derive(Args, Default)]
#[command(next_help_heading = "Folder")]
pub struct FolderArguments {
    /// Folder to write to [default: in out/, named after preset, seed, and place and size or way].
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Replace what is there. The old files stay whole until the new ones are complete.
    #[arg(long)]
    pub overwrite: bool,
    /// Go on with the same command where it was cut off; if it is complete, make damaged files again.
    #[arg(long, conflicts_with = "overwrite")]
    pub resume: bool,
}

impl FolderArguments {
    /// Returns the way in which the folder is written to.
    pub fn mode(&self) -> Mode {
        match (self.overwrite, self.resume) {
            (true, _) => Mode::Replace,
            (_, true) => Mode::Resume,
            _ => Mode::New,
        }
    }
}

/// The camera of the thesis' experiment, on its way through the terrain.
#[derive(Args)]
#[command(next_help_heading = "Camera")]
pub struct CameraArguments {
    /// Minutes that the camera walks, in its own time; it turns to the right each minute.
    #[arg(long, value_name = "N", default_value_t = 5.0, allow_negative_numbers = true)]
    pub minutes: f64,
    /// Speed of the camera in metres per second; by default enough for a hundred expansions of 512-metre tiles in five
    /// minutes.
    #[arg(long, value_name = "V", default_value_t = 128.0, allow_negative_numbers = true)]
    pub speed: f64,
}

/// Options for writing vectors.
#[derive(Args)]
#[command(next_help_heading = "GIS")]
pub struct VectorArguments {
    /// Clip features at the edge of the region; by default they are whole and reach beyond it.
    #[arg(long)]
    pub clip: bool,
    /// Metres between two contours [default: by the spacing and the heights of the world].
    #[arg(long, value_name = "METRES", allow_negative_numbers = true)]
    pub contours: Option<f64>,
    /// Write longitudes and latitudes to GeoJSON. They are the inverse of web mercator (EPSG:3857), with the world's
    /// metres as its metres, so the world's origin lies at 0, 0.
    #[arg(long)]
    pub degrees: bool,
}

impl VectorArguments {
    /// Returns the options for writing vectors.
    pub fn options(&self) -> VectorOptions {
        let VectorArguments { clip, degrees, contours } = self;
        VectorOptions { clipped: *clip, degrees: *degrees, contours_m: *contours }
    }

    /// Returns the names of the options that were given.
    pub fn given(&self) -> Vec<&'static str> {
        let VectorArguments { clip, degrees, contours } = self;
        given(&[(*clip, "--clip"), (*degrees, "--degrees"), (contours.is_some(), "--contours")])
    }
}

/// Returns the names of the options that were given.
pub fn given(all: &[(bool, &'static str)]) -> Vec<&'static str> {
    all.iter().filter_map(|(given, name)| given.then_some(*name)).collect()
}

/// The device that makes land.
#[derive(Args)]
pub struct DeviceArguments {
    /// The device that makes land and tiles: auto (a GPU if there is one that gives the same bits), cpu or gpu; the
    /// bytes are the same.
    #[arg(long, value_name = "NAME", default_value = "cpu")]
    #[arg(value_parser = Named(device_names), hide_possible_values = true)]
    pub device: String,
    /// Threads along one side of a GPU's workgroups: 8, 16 or 32.
    #[arg(long, value_name = "N", default_value = "8", value_parser = parse_group_side)]
    pub workgroup: u32,
}

impl DeviceArguments {
    /// Returns the maker of a world's land and tiles. Prints a warning if a reason is given why no GPU is used.
    pub fn maker(&self, world: &World, console: &Console) -> Result<Arc<dyn LandMaker>, Error> {
        let device: Device = self.device.parse()?;
        let (maker, reason) = device.maker(world, self.workgroup)?;
        console.warnings(reason.as_slice());
        Ok(maker)
    }
}

/// Reads the threads along one side of a workgroup.
pub fn parse_group_side(text: &str) -> Result<u32, String> {
    let side = text.trim().parse().ok().filter(|side| [8, 16, 32].contains(side));
    side.ok_or_else(|| format!("expected 8, 16 or 32, found {text:?}"))
}

fn device_names() -> Vec<&'static str> {
    Device::ALL.map(Device::name).to_vec()
}

/// Options for how a bake runs.
#[derive(Args)]
pub struct Manner {
    #[command(flatten)]
    pub run: RunOptions,
    #[command(flatten)]
    pub device: DeviceArguments,
}

/// Options for how a command runs that first says what it costs.
#[derive(Args, Clone, Copy)]
pub struct RunOptions {
    #[command(flatten)]
    pub threads: ThreadOptions,
    /// Print what would be done, and what it would cost, and do nothing.
    #[arg(long)]
    pub dry_run: bool,
}

/// The threads of a command.
#[derive(Args, Clone, Copy)]
pub struct ThreadOptions {
    /// Threads to use [default: one a core].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4096))]
    threads: Option<u32>,
}

impl ThreadOptions {
    /// Returns the number of threads.
    pub fn count(self) -> usize {
        thread_count(self.threads)
    }

    /// Returns a pool of the threads.
    pub fn pool(self) -> Result<ThreadPool, Error> {
        thread_pool(self.count())
    }
}

/// What is said, and how.
#[derive(Args, Clone, Copy, Default)]
#[command(next_help_heading = "Messages")]
pub struct MessageOptions {
    /// Print one JSON object a line instead of text.
    #[arg(long, global = true)]
    pub json: bool,
    /// Print nothing but warnings and errors.
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    pub quiet: bool,
    /// Print where the time went.
    #[arg(short, long, global = true)]
    pub verbose: bool,
    /// Show no progress.
    #[arg(long, global = true)]
    pub no_progress: bool,
}
