//! Arguments of `atlas`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::map::{StyleArguments, parse_map_scale};
use super::place::PlaceArguments;
use super::shared::WorldArguments;
use super::values::{parse_size, within};

#[derive(Args)]
pub struct AtlasArguments {
    #[command(flatten)]
    pub world: WorldArguments,
    /// Folder to write to [default: in out/, named after preset, seed, place, sheets, scale and style].
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// The formats to write: png for one picture per sheet, pdf for one document of all sheets.
    #[arg(long, value_name = "LIST", default_value = "png,pdf", value_delimiter = ',')]
    pub format: Vec<AtlasFormat>,
    #[command(flatten)]
    pub place: PlaceArguments,
    /// Sheets from west to east and from north to south, around a middle, for which --around=X,Y is enough [default: as
    /// many as cover the region, or 2x2 without one].
    #[arg(long, value_name = "COLSxROWS", help_heading = "Place", value_parser = parse_size)]
    #[arg(conflicts_with_all = ["at", "size", "bounds"])]
    pub sheets: Option<(u64, u64)>,
    /// The scale on paper, such as 1:50000.
    #[arg(long, value_name = "1:N", default_value = "1:50000", value_parser = parse_map_scale, help_heading = "Scale")]
    pub scale: f64,
    /// The paper: a0 to a6, letter, legal or tabloid, or millimetres such as 420x297.
    #[arg(long, value_name = "NAME|WxH", default_value = "a3", value_parser = parse_paper, help_heading = "Sheet")]
    pub paper: [f64; 2],
    /// Stand the paper upright.
    #[arg(long, help_heading = "Sheet")]
    pub portrait: bool,
    /// Overlap of neighbouring sheets in millimetres.
    #[arg(long, value_name = "MM", default_value_t = 10.0, value_parser = within(0.0..=1000.0, " millimetres"), help_heading = "Sheet")]
    pub overlap: f64,
    #[command(flatten)]
    pub style: StyleArguments,
}

/// A file format of an atlas.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum AtlasFormat {
    /// One picture per sheet.
    Png,
    /// One document of all sheets, with links.
    Pdf,
}

/// Reads a paper size in millimetres: the longer side first for named sizes, in the given order for numbers.
fn parse_paper(text: &str) -> Result<[f64; 2], String> {
    let known = match text.trim().to_lowercase().as_str() {
        "a0" => [1189.0, 841.0],
        "a1" => [841.0, 594.0],
        "a2" => [594.0, 420.0],
        "a3" => [420.0, 297.0],
        "a4" => [297.0, 210.0],
        "a5" => [210.0, 148.0],
        "a6" => [148.0, 105.0],
        "letter" => [279.4, 215.9],
        "legal" => [355.6, 215.9],
        "tabloid" | "ledger" => [431.8, 279.4],
        other => {
            let sides: Option<Vec<f64>> = other.split('x').map(|side| side.trim().parse().ok()).collect();
            let expected =
                || format!("expected a0 to a6, letter, legal, tabloid or millimetres such as 420x297, found {text:?}");
            let sides: [f64; 2] = sides.and_then(|sides| sides.try_into().ok()).ok_or_else(expected)?;
            if !sides.iter().all(|mm| (30.0..=5000.0).contains(mm)) {
                return Err(format!("paper has sides of 30 to 5000 mm, found {text:?}"));
            }
            sides
        }
    };
    Ok(known)
}
