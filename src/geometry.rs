//! Geometry of straight lines in the plane.

/// Whether a straight line touches the rectangle from the origin to a corner.
pub fn crosses(from: [f64; 2], to: [f64; 2], corner: [f64; 2]) -> bool {
    let (mut enters, mut leaves) = (0.0f64, 1.0f64);
    for axis in [0, 1] {
        let way = to[axis] - from[axis];
        if way == 0.0 {
            if from[axis] < 0.0 || from[axis] > corner[axis] {
                return false;
            }
            continue;
        }
        let (a, b) = (-from[axis] / way, (corner[axis] - from[axis]) / way);
        enters = enters.max(a.min(b));
        leaves = leaves.min(a.max(b));
    }
    enters <= leaves
}
