//! The rivers of a window, by place.

use crate::places::buckets::Buckets;
use crate::places::fixed::FixedSegment;
use crate::places::plan_land::{Scale, Window};

/// Nodes a side of a bucket of river pieces.
const BUCKET: i64 = 2;

/// The river pieces of a window by place: in 1/256 vertex from the window's first node, so that products are exact.
#[derive(Debug)]
pub(super) struct RiverIndex {
    pieces: Vec<PlanPiece>,
    buckets: Buckets,
    /// A bucket's side in 1/256 vertex.
    side: i64,
}

/// A piece of a river, relative to a window.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlanPiece {
    /// Its middle line, downstream.
    pub middle: FixedSegment,
    pub width_m: f64,
    /// Heights of the water's surface at both ends.
    level_m: [f64; 2],
}

impl RiverIndex {
    /// The pieces of a window. `margin_m` is how far from a river's edge it is still found.
    pub fn new(window: &Window, scale: &Scale, margin_m: f64) -> RiverIndex {
        let origin = scale.fixed(window.at);
        let side = scale.fixed([BUCKET; 2])[0];
        let count = |nodes: usize| nodes as i64 / BUCKET + 1;
        let mut buckets = Buckets::new(count(window.cols), count(window.rows));
        let mut pieces = Vec::new();
        for piece in &window.rivers {
            let [from, to] = [piece.from, piece.to].map(|at| [at[0] - origin[0], at[1] - origin[1]]);
            let (middle, width_m) = (FixedSegment { from, to }, piece.width_m as f64);
            // One more for rounding: a piece that is found in vain costs little, and one that is missed a road in a river.
            let margin = scale.fixed_length(width_m / 2.0 + margin_m) as i64 + 1;
            let [first, last] = under(middle, margin, side);
            buckets.put(pieces.len() as u32, first, last);
            pieces.push(PlanPiece { middle, width_m, level_m: piece.level_m.map(f64::from) });
        }
        RiverIndex { pieces, buckets, side }
    }

    /// All pieces that may come near a line, in order; `numbers` is room for what is found, so that many questions share it.
    pub fn near<'a>(&'a self, line: FixedSegment, numbers: &'a mut Vec<u32>) -> impl Iterator<Item = &'a PlanPiece> {
        let [first, last] = under(line, 0, self.side);
        self.buckets.find(first, last, numbers);
        numbers.iter().map(|number| &self.pieces[*number as usize])
    }

    /// All pieces that may come near a place, likewise.
    pub fn around<'a>(&'a self, at: [i64; 2], numbers: &'a mut Vec<u32>) -> impl Iterator<Item = &'a PlanPiece> {
        self.near(FixedSegment { from: at, to: at }, numbers)
    }
}

/// The first and the last bucket under the bounds of a line and a margin.
fn under(line: FixedSegment, margin: i64, side: i64) -> [[i64; 2]; 2] {
    let low = [0, 1].map(|axis| line.from[axis].min(line.to[axis]) - margin);
    let high = [0, 1].map(|axis| line.from[axis].max(line.to[axis]) + margin);
    [low, high].map(|corner| corner.map(|at| at.div_euclid(side)))
}

impl PlanPiece {
    /// The height in metres of the water's surface where the middle line is nearest to a place.
    pub fn surface_m(&self, at: [i64; 2]) -> f64 {
        self.level_m[0] + (self.level_m[1] - self.level_m[0]) * self.middle.nearest_share(at)
    }
}
