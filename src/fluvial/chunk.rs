//! Chunks: squares of cells of a level's lattice, whose channels are made together.

use super::fields::Fields;
use super::point::Point;
use super::trunk::NodeId;

/// The id of a chunk.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ChunkId {
    /// The level: 0 has the trunks.
    pub level: u32,
    /// Chunks east of the one at the origin.
    pub x: i64,
    /// Chunks south of the one at the origin.
    pub y: i64,
}

/// Cells a side of a chunk: in larger ones more channels would be made that nobody asks for, and for each of single cells what is
/// above it would be gathered anew.
const SIDE: i64 = 2;

impl ChunkId {
    /// The chunk that holds a cell.
    pub fn of_cell(level: u32, (x, y): NodeId) -> ChunkId {
        ChunkId { level, x: x.div_euclid(SIDE), y: y.div_euclid(SIDE) }
    }

    /// The chunks of a level that touch a rectangle.
    pub fn touching(fields: &Fields, level: u32, [low, high]: [Point; 2]) -> impl Iterator<Item = ChunkId> {
        let grains = SIDE * fields.side(level);
        let columns = low.x.div_euclid(grains)..=high.x.div_euclid(grains);
        let rows = low.y.div_euclid(grains)..=high.y.div_euclid(grains);
        rows.flat_map(move |y| columns.clone().map(move |x| ChunkId { level, x, y }))
    }

    /// The corners of its square.
    pub fn square(self, fields: &Fields) -> [Point; 2] {
        let grains = SIDE * fields.side(self.level);
        let low = Point { x: self.x * grains, y: self.y * grains };
        [low, Point { x: low.x + grains, y: low.y + grains }]
    }

    /// Its cells.
    pub fn cells(self) -> impl Iterator<Item = NodeId> {
        (0..SIDE * SIDE).map(move |n| (self.x * SIDE + n % SIDE, self.y * SIDE + n / SIDE))
    }
}
