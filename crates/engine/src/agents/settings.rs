//! Settings of the thesis' agents.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::recipe::fault::{Fault, KeyPath};

/// The thesis' river agents: a greedy search downhill. It starts at the highest vertex of the tile that owns the river,
/// away from the tile's borders.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct RiverAgents {
    /// Share of the tiles that own a river in bakes, 0 to 1; ignored around a walker. Default: 0.5.
    #[schemars(range(min = 0, max = 1))]
    pub density: f64,
    /// Number of tile edges that a river may cross, 0 to 8: its reach. Default: 3.
    #[schemars(range(min = 0, max = MAX_CROSSED_TILES))]
    pub max_tiles: u32,
    /// Weight of a step in the assigned direction, 0 to 1000. Default: 1.
    #[schemars(range(min = 0, max = 1000))]
    pub direction_weight: f64,
    /// Weight of a metre downhill, 0 to 1000. Default: 24.
    #[schemars(range(min = 0, max = 1000))]
    pub height_weight: f64,
    /// Largest climb of a river in metres above its lowest point, 0 to 1000; it ends where its best way on is higher.
    /// Default: 4.
    #[schemars(range(min = 0, max = 1000))]
    pub max_climb_m: f64,
    /// Source of the assigned direction. Default: `slope`.
    pub aim: Aim,
    /// Treatment of a river that reaches neither the sea nor another river. Default: `trim`.
    pub ending: Ending,
    /// Width of the bed in metres at the source and at the full length of its reach, 0.1 to 10,000 and at most a
    /// quarter of a tile's side. Default: [3, 12].
    #[schemars(inner(range(min = 0.1, max = WIDEST_M)))]
    pub width_m: [f64; 2],
    /// Depth of the bed in metres at the source and at the full length of its reach, 0 to 100. Default: [0.6, 2.5].
    #[schemars(inner(range(min = 0, max = 100)))]
    pub depth_m: [f64; 2],
    /// Width of the bank in metres, from the bed to unchanged land, 0.1 to 10,000 and at most a quarter of a tile's
    /// side. Default: 10.
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

/// Source of an agent's direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Aim {
    /// The hash of the tile that owns the agent.
    Hash,
    /// The large-scale slope of the tile that owns the agent: downhill.
    Slope,
}

/// Treatment of a river that reaches neither the sea nor another river.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Ending {
    /// The river loses the last third of its way, as in the thesis.
    Trim,
    /// The river ends in a pond.
    Pond,
}

/// The thesis' road agents: a greedy search over level ground. It starts in the middle of the tile that owns the road,
/// or at the nearest place from which there is a way on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct RoadAgents {
    /// Share of the tiles that own a road in bakes, 0 to 1; ignored around a walker. Default: 0.3.
    #[schemars(range(min = 0, max = 1))]
    pub density: f64,
    /// Number of tile edges that a road may cross, 0 to 8: its reach. Default: 3.
    #[schemars(range(min = 0, max = MAX_CROSSED_TILES))]
    pub max_tiles: u32,
    /// Vertices from a node of the road to the next, 1 to 4096 and at most `tile_cells`. As the thesis notes, steps of
    /// one vertex zigzag. Default: 7.
    #[schemars(range(min = 1, max = 4096))]
    pub step_cells: u32,
    /// Weight of a step in the assigned direction, 0 to 1000. Default: 1.
    #[schemars(range(min = 0, max = 1000))]
    pub direction_weight: f64,
    /// Cost of full steepness, 0 to 1000. Default: 10.
    #[schemars(range(min = 0, max = 1000))]
    pub steepness_weight: f64,
    /// Steepness above which no road goes, 0 to 1: it goes around, and ends where all ways on are steeper.
    /// Default: 0.9.
    #[schemars(range(min = 0, max = 1))]
    pub max_steepness: f64,
    /// Width of the road in metres, 0.1 to 10,000 and at most a quarter of a tile's side. Default: 5.
    #[schemars(range(min = 0.1, max = WIDEST_M))]
    pub width_m: f64,
    /// Width of the shoulder in metres, from the road's edge to unchanged land, 0.1 to 10,000 and at most a quarter of
    /// a tile's side. Default: 4.
    #[schemars(range(min = 0.1, max = WIDEST_M))]
    pub shoulder_m: f64,
    /// True to level the ground across the road; in the thesis it is not levelled. Default: false.
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

/// Largest number of tile edges that an agent may cross. A tile asks a number of tiles for their agents that grows with
/// the square of this limit.
const MAX_CROSSED_TILES: u32 = 8;

/// Largest width in metres of a bed, a bank or a road: wider than any river.
const WIDEST_M: f64 = 10_000.0;

/// Checks that a width is at most a quarter of a tile's side. A wider line would reach beyond the tiles next to those
/// that it touches.
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
    /// Finds the first value that contradicts another one.
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
    /// Finds the first value that contradicts another one.
    pub(crate) fn check(&self, path: &KeyPath, tile_cells: u32, spacing_m: f64) -> Result<(), Fault> {
        path.key("step_cells").at_most(self.step_cells, tile_cells, "tile_cells")?;
        check_width(&path.key("width_m"), self.width_m, tile_cells, spacing_m)?;
        check_width(&path.key("shoulder_m"), self.shoulder_m, tile_cells, spacing_m)
    }
}
