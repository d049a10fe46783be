//! Straight lines between places in 1/256 vertex: whole numbers, so that who crosses whom is exact.

use crate::geometry::{LineSegment, length};
use crate::lines::FIXED;

/// The straight line between two places in 1/256 vertex from some vertex.
#[derive(Clone, Copy, Debug)]
pub(super) struct FixedSegment {
    pub from: [i64; 2],
    pub to: [i64; 2],
}

impl FixedSegment {
    /// Whether it crosses another one. Of lines that follow on each other, exactly one is crossed where a crossing meets
    /// their common end.
    pub fn crosses(&self, other: &FixedSegment) -> bool {
        let side = |line: &FixedSegment, at: [i64; 2]| {
            let (ax, ay) = ((line.to[0] - line.from[0]) as i128, (line.to[1] - line.from[1]) as i128);
            ax * (at[1] - line.from[1]) as i128 - ay * (at[0] - line.from[0]) as i128 >= 0
        };
        side(self, other.from) != side(self, other.to) && side(other, self.from) != side(other, self.to)
    }

    /// The way from its start to its end.
    pub fn along(&self) -> [f64; 2] {
        self.way_to(self.to)
    }

    /// The square of the distance from a place, in (1/256 vertex)^2.
    pub fn distance2(&self, at: [i64; 2]) -> f64 {
        LineSegment { from: [0.0; 2], along: self.along() }.nearest(self.way_to(at)).1
    }

    /// The share of its length, 0 to 1, at which it is nearest to a place.
    pub fn nearest_share(&self, at: [i64; 2]) -> f64 {
        let [from, to] = [self.from, self.to].map(|end| [(end[0] - at[0]) as f64, (end[1] - at[1]) as f64]);
        LineSegment::between(from, to).nearest([0.0; 2]).0
    }

    /// Its length in metres, with `spacing_m` metres between vertices.
    pub fn length_m(&self, spacing_m: f64) -> f64 {
        length(self.along()) * (spacing_m / FIXED as f64)
    }

    fn way_to(&self, place: [i64; 2]) -> [f64; 2] {
        // Subtracted while they are whole: far from the origin a place itself does not fit into a double.
        [0, 1].map(|axis| (place[axis] - self.from[axis]) as f64)
    }
}

/// A place in vertices, as the nearest in 1/256 vertex.
pub(super) fn fixed(place: [f64; 2]) -> [i64; 2] {
    // Halves go up on both sides of 0; `round` would send them away from it.
    place.map(|at| (at * FIXED as f64 + 0.5).floor() as i64)
}
