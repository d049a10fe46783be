//! Vectors of the plane, and the segments between places.

use glam::DVec2;

use crate::geometry::{LineSegment, come};

/// Returns the unit vector of a way; next to nothing for a way of next to no length.
pub fn unit(way: DVec2) -> DVec2 {
    way / way.length().max(1e-9)
}

/// Returns the segments from each `step`th place to the next.
pub fn lines(places: &[DVec2], step: usize) -> Vec<LineSegment> {
    let ends = places.iter().step_by(step);
    ends.clone().zip(ends.skip(1)).map(|(from, to)| LineSegment::between((*from).into(), (*to).into())).collect()
}

/// Returns the distance along a polyline at each of its points.
pub fn come_along(places: &[DVec2]) -> Vec<f64> {
    come(places.windows(2).map(|pair| pair[1].distance(pair[0])))
}
