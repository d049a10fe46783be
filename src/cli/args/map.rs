//! Arguments of `map`, and those of sheets that `atlas` has too.

use std::path::PathBuf;

use clap::Args;

use super::place::PlaceArguments;
use super::shared::{Manner, WorldArguments};
use super::values::{parse_kilometres, within};
use super::{Named, built_in_names};
use crate::error::Error;
use crate::export::Lettering;
use crate::map::sheet::{Cells, Overlay};
use crate::map::style::Style;
use crate::recipe::source::RecipeSources;

/// Help for the subject of a map.
const SUBJECT: &str = "A preset file, the name of a built-in preset (terrane presets), - for standard input, or the folder of a bake, \
                       whose world and region are drawn";

#[derive(Args)]
#[command(mut_arg("preset", |preset| preset.value_name("PRESET|DIR").help(SUBJECT)))]
pub struct MapArguments {
    #[command(flatten)]
    pub world: WorldArguments,
    /// The file to write: .png or .webp, with a world file beside it that places the map in a GIS, or .pdf or .svg,
    /// with vector lines in named layers [default: in out/, named after preset, seed, place, size, scale and style,
    /// .png].
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    #[command(flatten)]
    pub place: PlaceArguments,
    /// The scale on paper, such as 1:50000.
    #[arg(long, value_name = "1:N", value_parser = parse_map_scale, help_heading = "Scale")]
    #[arg(conflicts_with_all = ["width", "metres_per_pixel"])]
    pub scale: Option<f64>,
    /// Pixels of the map from west to east, without what stands around it [default: 2048].
    #[arg(long, value_name = "PIXELS", value_parser = clap::value_parser!(u32).range(16..=1_000_000), help_heading = "Scale")]
    #[arg(conflicts_with = "metres_per_pixel")]
    pub width: Option<u32>,
    /// Metres per pixel.
    #[arg(long, value_name = "METRES", value_parser = within(0.001..=1e9, " metres"), help_heading = "Scale")]
    pub metres_per_pixel: Option<f64>,
    /// Letters in a .pdf or .svg: as text with its fonts in the file, which can be searched and changed; or as
    /// outlines, which look the same in every program [default: text in .pdf; outlines in .svg, whose fonts only
    /// browsers use].
    #[arg(long, value_name = "HOW", value_parser = parse_lettering, help_heading = "Sheet")]
    pub text: Option<Lettering>,
    #[command(flatten)]
    pub style: StyleArguments,
}

/// Options for drawing maps.
#[derive(Args)]
pub struct StyleArguments {
    /// The style: a built-in one (terrane styles), or a file.
    #[arg(long, value_name = "NAME|FILE", default_value = "topographic")]
    #[arg(value_parser = Named(built_in_names::<Style>), hide_possible_values = true)]
    pub style: String,
    /// Set a key of the style, such as relief.sun_deg=300 or contours.interval_m=50; the value is as in TOML. May be
    /// repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    pub style_set: Vec<String>,
    /// Pixels per inch of paper; sets how large lines and letters are.
    #[arg(long, value_name = "N", default_value_t = 200.0, value_parser = within(10.0..=2400.0, ""), help_heading = "Scale")]
    pub dpi: f64,
    /// The furniture around a map, with commas between: title, frame, grid, scale, north, legend, recipe, or all, or
    /// none.
    #[arg(long, value_name = "LIST", default_value = "all", help_heading = "Sheet")]
    pub furniture: String,
    /// The title [default: the preset's name].
    #[arg(long, value_name = "TEXT", help_heading = "Sheet")]
    pub title: Option<String>,
    /// Numbered cells over a map, with their width in kilometres.
    #[arg(long, value_name = "squares:KM|hexes:KM", value_parser = parse_overlay, help_heading = "Sheet")]
    pub overlay: Option<Overlay>,
    /// Replace what is there.
    #[arg(long)]
    pub overwrite: bool,
    #[command(flatten)]
    pub manner: Manner,
}

impl StyleArguments {
    /// Returns the style with the settings of the options applied.
    pub fn style(&self) -> Result<Style, Error> {
        let mut sources: RecipeSources<Style> = RecipeSources::load(&self.style)?;
        for setting in &self.style_set {
            sources.set("--style-set", setting)?;
        }
        sources.read_all()
    }
}

fn parse_overlay(text: &str) -> Result<Overlay, String> {
    let expected = || format!("expected squares:KM or hexes:KM, such as hexes:5, found {text:?}");
    let (form, km) = text.split_once(':').ok_or_else(expected)?;
    let form = match form.trim() {
        "square" | "squares" => Cells::Squares,
        "hex" | "hexes" | "hexagons" => Cells::Hexagons,
        _ => return Err(expected()),
    };
    Ok(Overlay { form, side_m: 1000.0 * parse_kilometres(km)? })
}

/// Reads a scale on paper such as 1:50000, or 50000, and returns its denominator.
pub fn parse_map_scale(text: &str) -> Result<f64, String> {
    let trimmed = text.trim();
    let number = trimmed.strip_prefix("1:").unwrap_or(trimmed).replace(['_', ' '], "");
    let share = if text.contains('/') { "; a share of the vertices is --stride of a bake" } else { "" };
    match number.parse::<f64>() {
        Ok(number) if (1.0..=1e12).contains(&number) => Ok(number),
        _ => Err(format!("expected 1: and a number from 1 on, such as 1:50000, found {text:?}{share}")),
    }
}

fn parse_lettering(text: &str) -> Result<Lettering, String> {
    match text.trim() {
        "text" => Ok(Lettering::Text),
        "outlines" => Ok(Lettering::Outlines),
        other => Err(format!("expected text or outlines, found {other:?}")),
    }
}
