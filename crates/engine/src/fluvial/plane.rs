//! Helpers for places in the plane: unit vectors, segments between places, and distances along polylines.

use glam::DVec2;

use crate::geometry::{LineSegment, come};

/// Returns the vector of length 1 in the direction of `way`. If `way` is shorter than 1e-9, the result is shorter than
/// 1, so that a way of length 0 gives 0 and not NaN.
pub fn unit(way: DVec2) -> DVec2 {
    way / way.length().max(1e-9)
}

/// Returns the segments of the polyline through every `step`th place, beginning with the first place. The places after
/// the last multiple of `step` are left out.
pub fn lines(places: &[DVec2], step: usize) -> Vec<LineSegment> {
    let ends = places.iter().step_by(step);
    ends.clone().zip(ends.skip(1)).map(|(from, to)| LineSegment::between((*from).into(), (*to).into())).collect()
}

/// Returns the distance along a polyline at each of its points.
pub fn come_along(places: &[DVec2]) -> Vec<f64> {
    come(places.windows(2).map(|pair| pair[1].distance(pair[0])))
}
