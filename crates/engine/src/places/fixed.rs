//! Segments between places in 1/256 vertex: whole numbers, so that tests for crossings are exact.

use glam::DVec2;

use crate::geometry::LineSegment;
use crate::lines::FIXED;

/// The segment between two places in 1/256 vertex, both relative to the same vertex.
#[derive(Clone, Copy, Debug)]
pub(super) struct FixedSegment {
    pub from: [i64; 2],
    pub to: [i64; 2],
}

impl FixedSegment {
    /// True if this segment crosses another one. If a segment passes exactly through the common end of two consecutive
    /// ones, it crosses just one of the two.
    pub fn crosses(&self, other: &FixedSegment) -> bool {
        let side = |line: &FixedSegment, at: [i64; 2]| {
            let (ax, ay) = ((line.to[0] - line.from[0]) as i128, (line.to[1] - line.from[1]) as i128);
            ax * (at[1] - line.from[1]) as i128 - ay * (at[0] - line.from[0]) as i128 >= 0
        };
        side(self, other.from) != side(self, other.to) && side(other, self.from) != side(other, self.to)
    }

    /// Returns the vector from the start to the end.
    pub fn along(&self) -> DVec2 {
        self.way_to(self.to)
    }

    /// Returns the square of the distance from a place, in (1/256 vertex)^2.
    pub fn distance2(&self, at: [i64; 2]) -> f64 {
        LineSegment { from: [0.0; 2], along: self.along().into() }.nearest(self.way_to(at).into()).1
    }

    /// Returns the share of the segment's length, 0 to 1, at which it is nearest to a place.
    pub fn nearest_share(&self, at: [i64; 2]) -> f64 {
        let [from, to] = [self.from, self.to].map(|end| [(end[0] - at[0]) as f64, (end[1] - at[1]) as f64]);
        LineSegment::between(from, to).nearest([0.0; 2]).0
    }

    /// Returns the length in metres. `spacing_m` is the distance between vertices.
    pub fn length_m(&self, spacing_m: f64) -> f64 {
        self.along().length() * (spacing_m / FIXED as f64)
    }

    fn way_to(&self, place: [i64; 2]) -> DVec2 {
        // Whole numbers are subtracted before the conversion: far from the origin a place itself does not fit into an
        // `f64`.
        [0, 1].map(|axis| (place[axis] - self.from[axis]) as f64).into()
    }
}

/// Rounds a place in vertices to the nearest place in 1/256 vertex.
pub(super) fn fixed(place: DVec2) -> [i64; 2] {
    // Halves are rounded up on both sides of 0; `round` would round them away from 0.
    (place * FIXED as f64 + 0.5).floor().to_array().map(|at| at as i64)
}
