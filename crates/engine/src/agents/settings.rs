//! What an author says about the thesis' agents.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::recipe::fault::{Fault, KeyPath};

/// The thesis' river agents: a greedy search downhill, from the highest vertex of the tile that owns the river, off its borders.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct RiverAgents {
    /// Share of the tiles that own a river in bakes, 0 to 1; around a walker it has no say. Default: 0.5.
    #[schemars(range(min = 0, max = 1))]
    pub density: f64,
    /// Tile edges that a river may cross, 0 to 8: its reach. Default: 3.
    #[schemars(range(min = 0, max = MAX_CROSSED_TILES))]
    pub max_tiles: u32,
    /// What a step in the assigned direction is worth, 0 to 1000. Default: 1.
    #[schemars(range(min = 0, max = 1000))]
    pub direction_weight: f64,
    /// What a metre down is worth, 0 to 1000. Default: 24.
    #[schemars(range(min = 0, max = 1000))]
    pub height_weight: f64,
    /// Metres above its lowest point that a river may climb before the way is too far uphill, 0 to 1000. Default: 4.
    #[schemars(range(min = 0, max = 1000))]
    pub max_climb_m: f64,
    /// Where the assigned direction comes from. Default: `slope`.
    pub aim: Aim,
    /// What becomes of a river that ends in nothing. Default: `trim`.
    pub ending: Ending,
    /// Width of the bed in metres at the source and where it has come as far as its reach, 0.1 to 10,000 and at most a quarter of a tile's side. Default: [3, 12].
    #[schemars(inner(range(min = 0.1, max = WIDEST_M)))]
    pub width_m: [f64; 2],
    /// Depth of the bed in metres, likewise, 0 to 100. Default: [0.6, 2.5].
    #[schemars(inner(range(min = 0, max = 100)))]
    pub depth_m: [f64; 2],
    /// Metres from the bed to where the bank meets the land, 0.1 to 10,000 and at most a quarter of a tile's side. Default: 10.
    #[schemars(range(min = 0.1, max = WIDEST_M))]
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

/// The thesis' road agents: a greedy search over level ground, from the middle of the tile that owns the road, or from the
/// nearest place to it where there is a way on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct RoadAgents {
    /// Share of the tiles that own a road in bakes, 0 to 1; around a walker it has no say. Default: 0.3.
    #[schemars(range(min = 0, max = 1))]
    pub density: f64,
    /// Tile edges that a road may cross, 0 to 8: its reach. Default: 3.
    #[schemars(range(min = 0, max = MAX_CROSSED_TILES))]
    pub max_tiles: u32,
    /// Vertices from a node to the next, 1 to 4096 and at most `tile_cells`; the thesis: one at a time zigzags. Default: 7.
    #[schemars(range(min = 1, max = 4096))]
    pub step_cells: u32,
    /// What a step in the assigned direction is worth, 0 to 1000. Default: 1.
    #[schemars(range(min = 0, max = 1000))]
    pub direction_weight: f64,
    /// What full steepness costs, 0 to 1000. Default: 10.
    #[schemars(range(min = 0, max = 1000))]
    pub steepness_weight: f64,
    /// Steepness above which no road goes, 0 to 1: it goes around, and ends where all ways on are steeper. Default: 0.9.
    #[schemars(range(min = 0, max = 1))]
    pub max_steepness: f64,
    /// Width of the road in metres, 0.1 to 10,000 and at most a quarter of a tile's side. Default: 5.
    #[schemars(range(min = 0.1, max = WIDEST_M))]
    pub width_m: f64,
    /// Metres from the road's edge to where nothing of it is left, 0.1 to 10,000 and at most a quarter of a tile's side. Default: 4.
    #[schemars(range(min = 0.1, max = WIDEST_M))]
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

/// Tiles that an agent may cross: the square of it is how many tiles a single one asks for their agents.
const MAX_CROSSED_TILES: u32 = 8;

/// The widest bed or bank in metres: beyond any river.
const WIDEST_M: f64 = 10_000.0;

/// Checks a length that must not exceed a quarter of a tile's side: what touches a tile would stick out of its neighbours.
fn check_width(path: &KeyPath, metres: f64, tile_cells: u32, spacing_m: f64) -> Result<(), Fault> {
    let most_m = tile_cells as f64 * spacing_m / 4.0;
    if metres <= most_m {
        return Ok(());
    }
    let message = format!(
        "expected at most {most_m}, a quarter of a tile's side (tile_cells = {tile_cells}, spacing_m = {spacing_m})"
    );
    let least = (4.0 * metres / spacing_m).ceil();
    let hint = format!("a tile_cells of {least} or more, or {path} = {most_m} or less");
    Err(path.fault(message, hint).found(metres).beside(KeyPath::default().key("tile_cells")))
}

impl RiverAgents {
    /// Finds the first value that does not go with others.
    pub(crate) fn check(&self, path: &KeyPath, tile_cells: u32, spacing_m: f64) -> Result<(), Fault> {
        for (key, [source, mouth]) in [("width_m", self.width_m), ("depth_m", self.depth_m)] {
            if mouth < source {
                let message =
                    format!("a river grows downstream, but {mouth} at its end is less than {source} at its source");
                return Err(path.key(key).fault(message, "write [source, end]"));
            }
        }
        check_width(&path.key("width_m").index(1), self.width_m[1], tile_cells, spacing_m)?;
        check_width(&path.key("bank_m"), self.bank_m, tile_cells, spacing_m)
    }
}

impl RoadAgents {
    /// Finds the first value that does not go with others.
    pub(crate) fn check(&self, path: &KeyPath, tile_cells: u32, spacing_m: f64) -> Result<(), Fault> {
        path.key("step_cells").at_most(self.step_cells, tile_cells, "tile_cells")?;
        check_width(&path.key("width_m"), self.width_m, tile_cells, spacing_m)?;
        check_width(&path.key("shoulder_m"), self.shoulder_m, tile_cells, spacing_m)
    }
}
