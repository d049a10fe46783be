//! Arguments of the commands that look after the folder of a bake: `registry` and `verify`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::shared::ThreadOptions;
use super::values::parse_tile;
use crate::area::TileId;

#[derive(Args)]
pub struct RegistryArguments {
    /// Folder of the bake.
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
    /// List files with their sizes and hashes instead of tiles.
    #[arg(long)]
    pub files: bool,
    /// Only this tile, or with --files only its files.
    #[arg(long, value_name = "X,Y", allow_hyphen_values = true, value_parser = parse_tile)]
    pub tile: Option<TileId>,
    /// Only tiles on which a river or a road starts.
    #[arg(long, value_name = "KIND", conflicts_with = "files")]
    pub start: Option<Started>,
    /// Only files of this export.
    #[arg(long, value_name = "NAME", requires = "files")]
    pub export: Option<String>,
}

/// A thing that starts on a tile.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Started {
    /// A river.
    River,
    /// A road.
    Road,
}

#[derive(Args)]
pub struct VerifyArguments {
    /// Folder of the bake.
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
    /// Share of the tiles to bake again and compare, in percent; at least one tile.
    #[arg(long, value_name = "PERCENT", default_value = "1", value_parser = parse_percent)]
    pub sample: f64,
    /// Bake all of its tiles again.
    #[arg(long, conflicts_with = "sample")]
    pub all: bool,
    /// Check only the files, and bake no tile again.
    #[arg(long, alias = "files", conflicts_with_all = ["sample", "all"])]
    pub files_only: bool,
    #[command(flatten)]
    pub threads: ThreadOptions,
}

/// Reads a percentage, with or without the % sign, as a share of 1.
fn parse_percent(text: &str) -> Result<f64, String> {
    let number = text.trim().trim_end_matches('%').trim_end().parse::<f64>();
    let share = number.ok().map(|percent| percent / 100.0).filter(|share| *share > 0.0 && *share <= 1.0);
    share.ok_or_else(|| format!("expected more than 0 and at most 100 percent, such as 5 or 5%; found {text:?}"))
}
