//! What an author says about the thesis' agents.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::recipe::fault::{Fault, KeyPath};

/// The thesis' river agents: a greedy search downhill, from the highest vertex of the tile that owns the river.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct RiverAgents {
    /// Share of the tiles that own a river, 0 to 1. Default: 0.5.
    pub density: f64,
    /// Tile edges that a river may cross, 0 to 8: its reach. Default: 3.
    pub max_tiles: u32,
    /// What a step in the assigned direction is worth. Default: 1.
    pub direction_weight: f64,
    /// What a metre down is worth. Default: 24.
    pub height_weight: f64,
    /// Metres above its lowest point that a river may climb before the way is too far uphill. Default: 4.
    pub max_climb_m: f64,
    /// Where the assigned direction comes from. Default: `slope`.
    pub aim: Aim,
    /// What becomes of a river that ends in nothing. Default: `trim`.
    pub ending: Ending,
    /// Width of the bed in metres at the source and where it has come as far as its reach. Default: [3, 12].
    pub width_m: [f64; 2],
    /// Depth of the bed in metres, likewise. Default: [0.6, 2.5].
    pub depth_m: [f64; 2],
    /// Metres from the bed to where the bank meets the land. Default: 10.
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

/// The thesis' road agents: a greedy search over level ground, from the middle of the tile that owns the road.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct RoadAgents {
    /// Share of the tiles that own a road, 0 to 1. Default: 0.3.
    pub density: f64,
    /// Tile edges that a road may cross, 0 to 8: its reach. Default: 3.
    pub max_tiles: u32,
    /// Vertices from a node to the next; the thesis: one at a time zigzags. Default: 7.
    pub step_cells: u32,
    /// What a step in the assigned direction is worth. Default: 1.
    pub direction_weight: f64,
    /// What full steepness costs. Default: 10.
    pub steepness_weight: f64,
    /// Steepness at which a road ends. Default: 0.9.
    pub max_steepness: f64,
    /// Width of the road in metres. Default: 5.
    pub width_m: f64,
    /// Metres from the road's edge to where nothing of it is left. Default: 4.
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

impl RiverAgents {
    /// Finds the first value that is out of its range.
    pub(crate) fn check(&self, path: &KeyPath, tile_side_m: f64) -> Result<(), Fault> {
        path.key("density").within(self.density, 0.0..=1.0)?;
        path.key("max_tiles").within(self.max_tiles, 0..=MAX_CROSSED_TILES)?;
        path.key("direction_weight").within(self.direction_weight, 0.0..=1000.0)?;
        path.key("height_weight").within(self.height_weight, 0.0..=1000.0)?;
        path.key("max_climb_m").within(self.max_climb_m, 0.0..=1000.0)?;
        for index in 0..2 {
            path.key("width_m").index(index).within(self.width_m[index], 0.1..=tile_side_m / 4.0)?;
            path.key("depth_m").index(index).within(self.depth_m[index], 0.0..=100.0)?;
        }
        for (key, [source, mouth]) in [("width_m", self.width_m), ("depth_m", self.depth_m)] {
            if mouth < source {
                let message =
                    format!("a river grows downstream, but {mouth} at its end is less than {source} at its source");
                return Err(path.key(key).fault(message, "write [source, end]"));
            }
        }
        path.key("bank_m").within(self.bank_m, 0.1..=tile_side_m / 4.0)
    }
}

impl RoadAgents {
    /// Finds the first value that is out of its range.
    pub(crate) fn check(&self, path: &KeyPath, tile_side_m: f64, tile_cells: u32) -> Result<(), Fault> {
        path.key("density").within(self.density, 0.0..=1.0)?;
        path.key("max_tiles").within(self.max_tiles, 0..=MAX_CROSSED_TILES)?;
        path.key("step_cells").within(self.step_cells, 1..=tile_cells)?;
        path.key("direction_weight").within(self.direction_weight, 0.0..=1000.0)?;
        path.key("steepness_weight").within(self.steepness_weight, 0.0..=1000.0)?;
        path.key("max_steepness").within(self.max_steepness, 0.0..=1.0)?;
        path.key("width_m").within(self.width_m, 0.1..=tile_side_m / 4.0)?;
        path.key("shoulder_m").within(self.shoulder_m, 0.1..=tile_side_m / 4.0)
    }
}
