//! Places on the lattice as metres east and north.

use crate::geometry::length;

/// Metres east and north of a place in vertices east and south.
pub(super) fn metres([x, y]: [f64; 2], spacing_m: f64) -> [f64; 2] {
    // Not the negative, which has a zero of its own.
    [x * spacing_m, 0.0 - y * spacing_m]
}

/// Metres from end to end of a line, seen from above: the first two numbers of a point are metres east and north.
pub(super) fn length_m<const N: usize>(line: &[[f64; N]]) -> f64 {
    let step_m = |pair: &[[f64; N]]| length([pair[1][0] - pair[0][0], pair[1][1] - pair[0][1]]);
    // Not `sum`, whose nothing is the negative zero.
    line.windows(2).map(step_m).fold(0.0, |sum, step| sum + step)
}
