//! A spatial index of the rivers of a window.

use crate::places::buckets::Buckets;
use crate::places::fixed::FixedSegment;
use crate::places::plan_land::{PlanScale, Window};

/// Side of a bucket of river pieces in nodes.
const BUCKET: i64 = 2;

/// The river pieces of a window in buckets by place. Places are in 1/256 vertex from the window's first node, so that
/// products are exact.
#[derive(Debug)]
pub(super) struct RiverIndex {
    pieces: Vec<PlanPiece>,
    buckets: Buckets,
    /// Side of a bucket in 1/256 vertex.
    side: i64,
}

/// A straight piece of a river, relative to a window.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlanPiece {
    /// The middle line of the piece, downstream.
    pub middle: FixedSegment,
    pub width_m: f64,
    /// Heights in metres of the water's surface at both ends.
    level_m: [f64; 2],
}

impl RiverIndex {
    /// Indexes the pieces of a window. `margin_m` is the distance from a river's edge up to which it is still found.
    pub fn new(window: &Window, scale: &PlanScale, margin_m: f64) -> RiverIndex {
        let origin = scale.fixed(window.at);
        let side = scale.fixed([BUCKET; 2])[0];
        let count = |nodes: usize| nodes as i64 / BUCKET + 1;
        let mut buckets = Buckets::new(count(window.cols), count(window.rows));
        let mut pieces = Vec::new();
        for piece in &window.rivers {
            let [from, to] = [piece.from, piece.to].map(|at| [at[0] - origin[0], at[1] - origin[1]]);
            let (middle, width_m) = (FixedSegment { from, to }, piece.width_m as f64);
            // One more for rounding: a piece found in vain costs little, but a missed piece puts a road into a river.
            let margin = scale.fixed_length(width_m / 2.0 + margin_m) as i64 + 1;
            let [first, last] = under(middle, margin, side);
            buckets.put(pieces.len() as u32, first, last);
            pieces.push(PlanPiece { middle, width_m, level_m: piece.level_m.map(f64::from) });
        }
        RiverIndex { pieces, buckets, side }
    }

    /// Returns all pieces that may come near a segment, in order. `numbers` is a buffer that many queries share.
    pub fn near<'a>(&'a self, line: FixedSegment, numbers: &'a mut Vec<u32>) -> impl Iterator<Item = &'a PlanPiece> {
        let [first, last] = under(line, 0, self.side);
        self.buckets.find(first, last, numbers);
        numbers.iter().map(|number| &self.pieces[*number as usize])
    }

    /// Returns all pieces that may come near a place, as [`near`](RiverIndex::near) does for a segment.
    pub fn around<'a>(&'a self, at: [i64; 2], numbers: &'a mut Vec<u32>) -> impl Iterator<Item = &'a PlanPiece> {
        self.near(FixedSegment { from: at, to: at }, numbers)
    }
}

/// Returns the first and the last bucket under the bounding box of a segment, widened by a margin.
fn under(line: FixedSegment, margin: i64, side: i64) -> [[i64; 2]; 2] {
    let low = [0, 1].map(|axis| line.from[axis].min(line.to[axis]) - margin);
    let high = [0, 1].map(|axis| line.from[axis].max(line.to[axis]) + margin);
    [low, high].map(|corner| corner.map(|at| at.div_euclid(side)))
}

impl PlanPiece {
    /// Returns the height in metres of the water's surface at the point of the middle line that is nearest to a place.
    pub fn surface_m(&self, at: [i64; 2]) -> f64 {
        self.level_m[0] + (self.level_m[1] - self.level_m[0]) * self.middle.nearest_share(at)
    }
}
