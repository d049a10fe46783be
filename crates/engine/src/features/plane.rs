//! Conversion of lattice positions to metres east and north.

use crate::geometry::length;

/// Converts a position in vertices east and south to metres east and north.
pub(super) fn metres([x, y]: [f64; 2], spacing_m: f64) -> [f64; 2] {
    // Subtracted from 0 instead of negated, because the negative of 0 is -0, which has other bits.
    [x * spacing_m, 0.0 - y * spacing_m]
}

/// Returns the length of a line in metres, seen from above. The first two numbers of a point are metres east and north.
pub(super) fn length_m<const N: usize>(line: &[[f64; N]]) -> f64 {
    let step_m = |pair: &[[f64; N]]| length([pair[1][0] - pair[0][0], pair[1][1] - pair[0][1]]);
    // Not `sum`, which starts from -0 and so returns -0 for a line without steps.
    line.windows(2).map(step_m).fold(0.0, |sum, step| sum + step)
}
