//! Arguments of `experiment`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::shared::{CameraArguments, parse_group_side};
use crate::cli::thread_count;

#[derive(Args)]
pub struct ExperimentArguments {
    /// Cells a tile side, 16 to 4096, with commas between.
    #[arg(long, value_name = "LIST", default_value = "64,128,256,512", value_delimiter = ',')]
    pub sizes: Vec<u32>,
    /// With agents, without, or both.
    #[arg(long, value_name = "LIST", default_value = "on,off", value_delimiter = ',')]
    pub agents: Vec<Switch>,
    #[command(flatten)]
    pub camera: CameraArguments,
    /// The device that makes the land of tiles: cpu, gpu, or both side by side.
    #[arg(long, value_name = "LIST", default_value = "cpu", value_delimiter = ',')]
    pub device: Vec<String>,
    /// Threads along one side of a GPU's workgroups, 8, 16 or 32, with commas between.
    #[arg(long, value_name = "LIST", default_value = "8", value_delimiter = ',', value_parser = parse_group_side)]
    pub workgroup: Vec<u32>,
    /// Layers of tiles around the camera's own, 1 to 16, with commas between: 1 are the eight neighbours of the thesis.
    #[arg(long, value_name = "LIST", default_value = "1", value_delimiter = ',')]
    pub layers: Vec<u32>,
    /// Tiles that a step makes: all that are missing, as in the thesis, or one, the nearest; or both.
    #[arg(long, value_name = "LIST", default_value = "all", value_delimiter = ',')]
    pub step: Vec<StepSize>,
    /// Measure the thesis' plain method too, for the speed-up.
    #[arg(long, value_name = "ON|OFF", default_value = "on")]
    pub baseline: Switch,
    /// Threads to use, or several numbers to compare, such as 1,all; all means one a core. The baseline has one.
    #[arg(long, value_name = "LIST", default_value = "all", value_delimiter = ',', value_parser = parse_threads)]
    pub threads: Vec<usize>,
    /// Folder to write to [default: out/experiment].
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Replace what is there.
    #[arg(long)]
    pub overwrite: bool,
}

/// The tiles that a step of the experiment makes.
#[derive(Clone, Copy, ValueEnum)]
pub enum StepSize {
    /// All missing tiles.
    All,
    /// The nearest missing tile.
    One,
}

#[derive(Clone, Copy, ValueEnum)]
pub enum Switch {
    On,
    Off,
}

impl Switch {
    pub fn is_on(self) -> bool {
        matches!(self, Switch::On)
    }
}

/// Reads a number of threads; `all` is one per core.
fn parse_threads(text: &str) -> Result<usize, String> {
    let number = match text.trim() {
        "all" => Some(thread_count(None)),
        number => number.parse().ok().filter(|number| (1..=4096).contains(number)),
    };
    number.ok_or_else(|| format!("expected 1 to 4096, or all, found {text:?}"))
}
