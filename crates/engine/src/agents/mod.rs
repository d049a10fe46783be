//! The thesis' agents: rivers and roads by greedy search over the vertex lattice.
//!
//! There are two kinds of tale about the same agents. The **order-free** ones ([`order_free`]), which a bake uses, belong to
//! the tile whose hash starts them; their way is a pure function of the world and that tile, over un-carved ground, and
//! every tile that it touches carves it. The **classic** ones ([`walker`](crate::walker)) are those of the thesis: they wait at the edge
//! of what is made, go on when a walker comes there, and are cut off by tiles that stand. What they look like depends
//! on where the walker came from, so they cannot keep the promise of one world; that is what the order-free ones are
//! for. Both share the search, the heuristics and the carving.

pub mod bed;
pub mod search;
pub mod heuristic;
pub mod order_free;
pub mod record;
pub mod settings;

use crate::agents::search::Node;
use crate::area::Area;
use crate::grid::Grid;

/// Cells from a tile's edge within which no river starts: a slope is highest at the edge of a tile, where a river would
/// begin on its border. In small tiles it is an eighth of the side.
const MARGIN_CELLS: u32 = 12;

/// The cells of [`MARGIN_CELLS`] in tiles of so many cells a side.
pub(crate) fn margin_cells(tile_cells: u32) -> i64 {
    // In the smallest tiles agents still need room to turn.
    MARGIN_CELLS.min(tile_cells / 8) as i64
}

/// The highest vertex of a tile's ground beyond so many cells of margin, where its river starts; of several the first, row
/// by row.
pub(crate) fn highest(heights: &Grid<f32>, tile: Area, margin_cells: i64) -> Node {
    // The margin is an eighth at most, so something is left.
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
    /// All four, clockwise from north.
    pub const ALL: [Direction; 4] = [Direction::North, Direction::East, Direction::South, Direction::West];

    /// The step to the next vertex: (east, south).
    pub fn step(self) -> (i64, i64) {
        match self {
            Direction::North => (0, -1),
            Direction::East => (1, 0),
            Direction::South => (0, 1),
            Direction::West => (-1, 0),
        }
    }

    /// The name, in small letters.
    pub fn name(self) -> &'static str {
        match self {
            Direction::North => "north",
            Direction::East => "east",
            Direction::South => "south",
            Direction::West => "west",
        }
    }

    /// The direction back.
    #[must_use]
    pub fn opposite(self) -> Direction {
        Direction::ALL[(self as usize + 2) % 4]
    }

    /// 1 for the same direction, -1 for the opposite one, 0 across.
    pub fn along(self, other: Direction) -> i64 {
        let ((east, south), (other_east, other_south)) = (self.step(), other.step());
        east * other_east + south * other_south
    }
}

/// The un-carved land as agents see it.
pub trait Terrain {
    /// The height of a vertex in metres.
    fn height_m(&mut self, node: Node) -> f32;

    /// The steepness of a vertex, 0 to 1, as the blend map has it.
    fn steepness(&mut self, node: Node) -> f32;

    /// Whether the sea covers a vertex.
    fn is_under_water(&mut self, node: Node) -> bool;
}
