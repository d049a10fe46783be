//! What turns from one move to the next cost, and how sharp they may be.
//!
//! A turn may go on until its arc needs more room than its legs have, so a way climbs by hairpins what is too steep for a
//! straight one. Their arcs have no transition curves: those of real ones, of 6 to 15 m as a rule, seldom have ("Mountain
//! Roads' Geometric Design: Methodological Proposal for Hairpin Bend Design/Retrofitting", Infrastructures 7(9), 112, 2022).

use crate::geometry::length;
use crate::places::move_cost::{FORBIDDEN, UNIT};
use crate::places::moves::{self, MOVES};
use crate::places::settings::Standard;

/// Square metres: what the square of a turn's angle costs, times the length over which it is made. Chosen by eye: a right
/// angle over 100 m costs 40 m of way.
const CURVATURE_M2: f64 = 2000.0;

/// Metres that the land may rise through a hairpin beyond what its curve can climb, and what each of them costs: half is
/// filled under its lower arm, half is cut behind its upper one. Chosen by eye.
const HAIRPIN_M: f64 = 12.0;
const EARTHWORK: f64 = 10.0;

/// How sharp a turn may be, and what it costs: by the move before and the move after.
pub(super) type Turns = Vec<[u32; MOVES]>;

/// What all turns cost, in parts of a metre, with `step_m` metres between nodes.
pub(super) fn turns(standard: &Standard, step_m: f64) -> Turns {
    let vector = |number: usize| moves::vector(number).map(|part| part as f64 * step_m);
    let cost = |came: usize, goes: usize| {
        let (a, b) = (vector(came), vector(goes));
        let (length_a, length_b) = (length(a), length(b));
        let cos = (a[0] * b[0] + a[1] * b[1]) / (length_a * length_b);
        // Half of the shorter leg is there to bend in; nothing turns back on itself.
        let legs_m = length_a.min(length_b);
        if came == goes {
            return 0;
        }
        if bend_m(cos, standard.radius_m) > legs_m / 2.0 {
            return FORBIDDEN;
        }
        (CURVATURE_M2 * 2.0 * (1.0 - cos) / legs_m * UNIT) as u32
    };
    (0..MOVES).map(|came| std::array::from_fn(|goes| cost(came, goes))).collect()
}

/// What the earthworks of a turn cost on land of such a gradient, metres up a metre east and south: those of a hairpin, if it
/// can be built at all, and none where it turns by less than a right angle.
pub(super) fn hairpin(standard: &Standard, [east, south]: [f64; 2], came: usize, goes: usize) -> Option<u32> {
    let (a, b) = (moves::vector(came), moves::vector(goes));
    if a[0] * b[0] + a[1] * b[1] >= 0 {
        return Some(0);
    }
    let [a, b] = [a, b].map(|by| {
        let by = by.map(|part| part as f64);
        by.map(|part| part / length(by))
    });
    let cos = a[0] * b[0] + a[1] * b[1];
    let bend_m = bend_m(cos, standard.radius_m);
    // From where the curve begins to where it ends, and along it.
    let rise_m = (bend_m * (east * (a[0] + b[0]) + south * (a[1] + b[1]))).abs();
    let climb_m = standard.max_grade * standard.radius_m * libm::acos(cos);
    let off_m = (rise_m - climb_m).max(0.0);
    (off_m <= HAIRPIN_M).then_some((EARTHWORK * off_m * UNIT) as u32)
}

/// Metres to each side of a corner that an arc of `radius_m` takes. `cos` is the cosine of the angle by which the line turns.
pub(super) fn bend_m(cos: f64, radius_m: f64) -> f64 {
    // The tangent of half of the angle; for a line that turns right back very large, but a number.
    radius_m * ((1.0 - cos).max(0.0) / (1.0 + cos).max(1e-9)).sqrt()
}
