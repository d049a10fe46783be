//! Costs of the turns from one move to the next, and limits of how sharp they may be.
//!
//! A turn may be as sharp as the arc of its curve fits into the legs before and after it, so a route climbs in hairpins
//! where a straight one would be too steep. The arcs have no transition curves: real hairpins, of 6 to 15 m as a rule,
//! seldom have them ("Mountain Roads' Geometric Design: Methodological Proposal for Hairpin Bend Design/Retrofitting",
//! Infrastructures 7(9), 112, 2022).
//!
//! To judge the numbers chosen by eye, look at the hairpins of `alps`.

use glam::DVec2;

use crate::places::move_cost::{FORBIDDEN, UNIT};
use crate::places::moves::{self, MOVES};
use crate::places::settings::Standard;

/// Cost of a turn in square metres: times the square of its angle, divided by the length over which it is made, it
/// gives metres of level way. Chosen by eye: a right angle over 100 m costs 40 m of way.
const CURVATURE_M2: f64 = 2000.0;

/// Largest height in metres that the land may rise through a hairpin beyond what its curve can climb, and the cost of
/// each of these metres: half is filled under the lower arm, half is cut behind the upper one. Chosen by eye.
const HAIRPIN_M: f64 = 12.0;
const EARTHWORK: f64 = 10.0;

/// Costs of turns by the move before and the move after; [`FORBIDDEN`] where a turn is too sharp.
pub(super) type Turns = Vec<[u32; MOVES]>;

/// Returns the costs of all turns, in units, with `step_m` metres between nodes.
pub(super) fn turns(standard: &Standard, step_m: f64) -> Turns {
    let vector = |number: usize| DVec2::from(moves::vector(number).map(|part| part as f64)) * step_m;
    let cost = |came: usize, goes: usize| {
        let (a, b) = (vector(came), vector(goes));
        let (length_a, length_b) = (a.length(), b.length());
        let cos = a.dot(b) / (length_a * length_b);
        // A bend may take half of the shorter leg. That also forbids turning straight back.
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

/// Returns the cost of the earthworks of a turn on land of such a gradient, metres up a metre east and south: 0 for
/// turns of a right angle or less, `None` for a hairpin that would need too much earthwork.
pub(super) fn hairpin(standard: &Standard, gradient: [f64; 2], came: usize, goes: usize) -> Option<u32> {
    let (a, b) = (moves::vector(came), moves::vector(goes));
    if a[0] * b[0] + a[1] * b[1] >= 0 {
        return Some(0);
    }
    let [a, b] = [a, b].map(|by| {
        let by = DVec2::from(by.map(|part| part as f64));
        by / by.length()
    });
    let cos = a.dot(b);
    let bend_m = bend_m(cos, standard.radius_m);
    // The rise of the land from the curve's start to its end, and the climb along the curve at the maximum grade.
    let rise_m = (bend_m * (a + b).dot(gradient.into())).abs();
    let climb_m = standard.max_grade * standard.radius_m * libm::acos(cos);
    let off_m = (rise_m - climb_m).max(0.0);
    (off_m <= HAIRPIN_M).then_some((EARTHWORK * off_m * UNIT) as u32)
}

/// Returns the length in metres, to each side of a corner, that an arc of `radius_m` takes. `cos` is the cosine of the
/// angle by which the line turns.
pub(super) fn bend_m(cos: f64, radius_m: f64) -> f64 {
    // The tangent of half the angle. For a line that turns straight back it is very large, but finite.
    radius_m * ((1.0 - cos).max(0.0) / (1.0 + cos).max(1e-9)).sqrt()
}
