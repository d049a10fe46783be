//! Arguments of `explore`.

use std::path::PathBuf;

use clap::Args;

use super::place::PlaceArguments;
use super::shared::{ThreadOptions, WorldArguments};

/// Help for the preset of the explorer.
const SOURCE: &str =
    "A preset file, which may be edited while the page is open, or the name of a built-in preset (terrane presets)";

#[derive(Args)]
#[command(mut_arg("preset", |preset| preset.help(SOURCE)))]
pub struct ExploreArguments {
    #[command(flatten)]
    pub world: WorldArguments,
    #[command(flatten)]
    pub place: PlaceArguments,
    /// The port of the page's address on this machine; 0 takes any free one. Other machines cannot reach it.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub port: u16,
    /// Open the page in the browser.
    #[arg(long)]
    pub open: bool,
    /// The cache folder for what was drawn, so that it is there at once the next time [default: in the user's cache
    /// folder].
    #[arg(long, value_name = "DIR")]
    pub cache: Option<PathBuf>,
    /// Size limit of the cache folder, such as 500MB or 4GB; 0 keeps nothing.
    #[arg(long, value_name = "SIZE", default_value = "1GB", value_parser = parse_bytes)]
    pub cache_limit: u64,
    /// Memory limit for the data of all worlds that are looked at, such as 500MB or 4GB: with a lower limit, data must
    /// be made again sooner. The drawing in progress takes some 300 MB more.
    #[arg(long, value_name = "SIZE", default_value = "500MB", value_parser = parse_bytes)]
    pub memory_limit: u64,
    #[command(flatten)]
    pub threads: ThreadOptions,
}

/// Reads a number of bytes, with units in powers of ten.
fn parse_bytes(text: &str) -> Result<u64, String> {
    let units = [("kB", 1e3), ("KB", 1e3), ("MB", 1e6), ("GB", 1e9), ("TB", 1e12), ("B", 1.0), ("", 1.0)];
    let bytes = units.iter().find_map(|(unit, bytes)| {
        let number: f64 = text.trim().strip_suffix(unit)?.trim().parse().ok()?;
        Some(number * bytes)
    });
    let bytes = bytes.filter(|bytes| (0.0..=1e18).contains(bytes));
    bytes.map(|bytes| bytes as u64).ok_or_else(|| "expected bytes, such as 500MB or 4GB".into())
}
