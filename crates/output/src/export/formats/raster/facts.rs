//! Metadata inside a raster file (texts of a PNG, attributes of an OpenEXR, tags of a GeoTIFF), so that a single file
//! explains itself.

use crate::area::{Region, TileId};
use crate::export::formats::georeference::Georeference;
use crate::export::formats::raster::quantity::Quantity;
use crate::export::plan::digits::of_32_bits;
use crate::generator;

/// Metadata of one raster: keys and values, always in the same order.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Facts(pub Vec<(&'static str, Fact)>);

/// Value of one entry of the metadata.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Fact {
    Text(String),
    Number(f64),
    Pair([f64; 2]),
}

impl std::fmt::Display for Fact {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Fact::Text(text) => f.write_str(text),
            Fact::Number(number) => write!(f, "{number}"),
            Fact::Pair([one, other]) => write!(f, "{one} {other}"),
        }
    }
}

/// The world and the region that rasters show.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Shown {
    pub preset_name: String,
    pub seed: u64,
    pub region: Region,
    /// True if the tiles are those of a walk, with the rivers and roads of the walker's way.
    pub is_walk: bool,
}

impl Facts {
    /// Creates the metadata of a quantity's raster of one tile or, with `None`, of the whole region. `range_m` is the
    /// range of heights that 16-bit steps divide; it is `None` for quantities without steps.
    pub fn new(
        shown: &Shown,
        quantity: &Quantity,
        tile: Option<TileId>,
        place: Georeference,
        range_m: Option<(f32, f32)>,
    ) -> Facts {
        let Shown { preset_name, seed, region, is_walk } = shown;
        let text = |text: String| Fact::Text(text);
        let cells = region.tile_cells();
        let walk = if *is_walk { " of a walk, with the rivers and roads of its way" } else { "" };
        let part = if let Some(TileId { x, y }) = tile {
            format!("tile {x},{y} of {cells} x {cells} cells{walk}")
        } else {
            let (TileId { x, y }, cols, rows) = (region.at(), region.cols(), region.rows());
            format!("{cols} x {rows} tiles of {cells} x {cells} cells from tile {x},{y} on{walk}")
        };
        let channels = quantity.channels.join("; ");
        let mut facts = vec![
            ("Title", text(format!("{} of {preset_name}, seed {seed}", quantity.title))),
            ("Description", text(format!("{channels}; rows from north to south, a pixel a vertex"))),
            ("Software", text(generator::NAME.to_owned())),
            ("preset", text(preset_name.clone())),
            // The seed is a text, since few programs keep all 64 bits of a number.
            ("seed", text(seed.to_string())),
            ("part", text(part)),
            ("spacing_m", Fact::Number(place.spacing_m)),
            // Metres east and north of the world's origin.
            ("first_pixel_m", Fact::Pair(place.first_m)),
        ];
        if let Some((min_m, max_m)) = range_m {
            facts.extend(
                [("min_m", min_m), ("max_m", max_m)].map(|(key, metres)| (key, Fact::Number(of_32_bits(metres)))),
            );
        }
        Facts(facts)
    }

    /// Returns the keys and values as texts.
    pub fn texts(&self) -> impl Iterator<Item = (&'static str, String)> {
        self.0.iter().map(|(key, fact)| (*key, fact.to_string()))
    }
}
