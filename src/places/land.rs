//! The land as those find it who settle on it and build roads: heights, waters and rivers.

use crate::area::Area;
use crate::memory::heap_bytes;

/// Parts of a vertex in which places on a line are counted: road points and river pieces.
pub const FIXED: i64 = 256;

/// What those who settle and build roads know about the land before they come.
///
/// Whatever is asked must be a pure function of the place and the step: the same vertex has the same height and water in
/// every question with that step, and a piece of a river is the same in every area that it touches. With longer steps
/// the land may be known less finely.
pub trait Land: Sync {
    /// Height in metres of the bare land at the vertices `(x0 + i * step, y0 + j * step)`, row by row, `cols` x `rows`.
    fn heights_m(&self, x0: i64, y0: i64, step: i64, cols: usize, rows: usize) -> Vec<f32>;

    /// What stands on the land there, likewise.
    fn waters(&self, x0: i64, y0: i64, step: i64, cols: usize, rows: usize) -> Vec<Water>;

    /// All pieces of rivers whose middle line touches `area`, in any order.
    fn rivers(&self, area: &Area) -> Vec<RiverPiece>;
}

/// What stands on the land at a vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Water {
    /// Nothing.
    Dry,
    /// A river that is wide enough for a vertex to lie in it.
    River,
    /// A lake.
    Lake,
    /// The sea.
    Sea,
}

heap_bytes!(Water);

impl Water {
    /// Whether it is a lake or the sea, which roads keep out of.
    pub fn is_open(self) -> bool {
        matches!(self, Water::Lake | Water::Sea)
    }
}

/// A straight piece of a river's middle line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RiverPiece {
    /// Upstream end in 1/256 vertex.
    pub from: [i64; 2],
    /// Downstream end in 1/256 vertex.
    pub to: [i64; 2],
    /// Width in metres.
    pub width_m: f32,
    /// Height in metres of the water's surface.
    pub level_m: f32,
}

heap_bytes!(RiverPiece);

impl RiverPiece {
    /// What pieces are sorted by, so that the order in which the land lists them does not matter.
    pub(super) fn key(&self) -> ([i64; 2], [i64; 2], u32, u32) {
        (self.from, self.to, self.width_m.to_bits(), self.level_m.to_bits())
    }
}
