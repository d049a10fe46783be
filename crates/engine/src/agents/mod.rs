//! The thesis' agents: rivers and roads by greedy search over the vertex lattice.
//!
//! The same agents come in two versions. The **order-free** agents ([`order_free`]) are used by a bake. Each belongs to
//! the tile whose hash starts it. Its way is a pure function of the world and that tile, over un-carved ground, and
//! every tile that it touches carves it. The **classic** agents ([`walker`](crate::walker)) are those of the thesis:
//! they wait at the edge of the existing tiles, go on when a walker comes there, and end at tiles that exist already.
//! Their shape depends on the walker's route, so one seed does not always give the same world, as the order-free agents
//! do. Both versions share the search, the heuristics and the carving.

pub mod bed;
pub mod search;
pub mod heuristic;
pub mod order_free;
pub mod record;
pub mod settings;

use crate::agents::search::Node;
use crate::area::Area;
use crate::grid::Grid;

/// Width in cells of the margin along a tile's edges in which no river starts. Without it many rivers would begin on
/// the border, since the highest vertex of a slope lies on the tile's edge. In small tiles the margin is an eighth of
/// the side.
const MARGIN_CELLS: u32 = 12;

/// Returns the margin of [`MARGIN_CELLS`] for tiles with this many cells per side.
pub(crate) fn margin_cells(tile_cells: u32) -> i64 {
    // In the smallest tiles agents still need room to turn.
    MARGIN_CELLS.min(tile_cells / 8) as i64
}

/// Returns the highest vertex of a tile outside the margin, where its river starts; if several are equally high, the
/// first, row by row.
pub(crate) fn highest(heights: &Grid<f32>, tile: Area, margin_cells: i64) -> Node {
    // The margin is at most an eighth of the side, so the remaining area is never empty.
    let (x0, x1) = (tile.x0 + margin_cells, tile.x1 - margin_cells);
    let mut highest = (f32::NEG_INFINITY, (x0, tile.y0 + margin_cells));
    for y in tile.y0 + margin_cells..tile.y1 - margin_cells {
        for (x, height_m) in (x0..).zip(heights.row(y, x0, x1)) {
            if *height_m > highest.0 {
                highest = (*height_m, (x, y));
            }
        }
    }
    highest.1
}

/// One of the four directions along the axes of the lattice.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Direction {
    /// Towards smaller y.
    North,
    /// Towards larger x.
    East,
    /// Towards larger y.
    South,
    /// Towards smaller x.
    West,
}

impl Direction {
    /// All four directions, clockwise from north.
    pub const ALL: [Direction; 4] = [Direction::North, Direction::East, Direction::South, Direction::West];

    /// Returns the step to the next vertex as (east, south).
    pub fn step(self) -> (i64, i64) {
        match self {
            Direction::North => (0, -1),
            Direction::East => (1, 0),
            Direction::South => (0, 1),
            Direction::West => (-1, 0),
        }
    }

    /// Returns the name in lower case.
    pub fn name(self) -> &'static str {
        match self {
            Direction::North => "north",
            Direction::East => "east",
            Direction::South => "south",
            Direction::West => "west",
        }
    }

    /// Returns the opposite direction.
    #[must_use]
    pub fn opposite(self) -> Direction {
        Direction::ALL[(self as usize + 2) % 4]
    }

    /// Returns 1 for the same direction, -1 for the opposite one and 0 for a perpendicular one.
    pub fn along(self, other: Direction) -> i64 {
        let ((east, south), (other_east, other_south)) = (self.step(), other.step());
        east * other_east + south * other_south
    }
}

/// The un-carved land that agents look at.
pub trait Terrain {
    /// Returns the height of a vertex in metres.
    fn height_m(&mut self, node: Node) -> f32;

    /// Returns the steepness of a vertex, 0 to 1, as the blend map defines it.
    fn steepness(&mut self, node: Node) -> f32;

    /// True if the sea covers a vertex.
    fn is_under_water(&mut self, node: Node) -> bool;
}
