//! Deltas: plains with which large rivers have filled their drowned valleys since the sea rose.
//!
//! A bed that would pass under the sea runs on above it to the delta's front, and falls from there to its former
//! height. The valley's floor follows the bed, so the delta is a plain from side to side, and tributaries join the
//! raised bed.
//!
//! To judge the numbers chosen by eye, look at the bays of `archipelago`, at the mouths of its large rivers.

use super::channel::{Knot, ways};
use super::fields::Fields;

/// Height of the bed above the sea at the front, in metres: enough that the whole plain lies above the sea.
const FRONT_M: f64 = 0.3;

/// Slope of the bed at the front. Chosen by eye.
const PLAIN_SLOPE: f64 = 2e-4;

/// Slope of the bed at the upper end of the delta, as a share of the bed's slope above the delta, and its greatest
/// value: gentler than the bed above, so that the two meet, but not so gentle that the plain has an edge there. Chosen
/// by eye.
const UPPER_SLOPE: f64 = 0.7;
const MOST_SLOPE: f64 = 0.008;

/// Slope of the delta's front down to the sea's floor. Chosen by eye.
const FRONT_SLOPE: f64 = 0.15;

/// Greatest depth in metres of the water that a delta has filled at its front. Chosen by eye.
const DEEPEST_M: f64 = 25.0;

/// Least height in metres of the land's edge above the sea beside a delta: higher than the plain anywhere.
const LEAST_EDGE_M: f32 = 12.0;

/// Number of knots that a delta gets, and its front too: so the delta ends in the right place even where the bed's
/// knots are far apart.
const PARTS: usize = 32;

/// Raises a bed so that it runs on above the sea for at most `longest` grains, as far as its valley still has sides.
///
/// Both ends of the bed stay as they are, as other channels begin and end there.
pub fn build(fields: &Fields, knots: &mut Vec<Knot>, longest: f64) {
    let (sea_m, metres) = (fields.sea_level_m(), fields.metres_a_grain());
    let Some(wet) = knots.iter().position(|knot| knot.level_m < sea_m + FRONT_M).filter(|wet| *wet > 0) else { return };
    // Grains along the bed from its head to each knot.
    let places = ways(knots);
    let whole = places[places.len() - 1];
    let share = (knots[wet - 1].level_m - sea_m - FRONT_M) / (knots[wet - 1].level_m - knots[wet].level_m);
    let shore = places[wet - 1] + (places[wet] - places[wet - 1]) * share;
    let upper_slope = (UPPER_SLOPE * (knots[0].level_m - sea_m) / (shore * metres).max(1e-9)).min(MOST_SLOPE);
    // At the foot of the front the bed is back at its former height.
    let front_grains = (DEEPEST_M + FRONT_M) / FRONT_SLOPE / metres;
    let longest = longest.min(whole - front_grains - shore);
    if longest <= 0.0 {
        return;
    }
    let knot_at = |place: f64| {
        let knot = (places.partition_point(|other| *other <= place).max(1) - 1).min(knots.len() - 2);
        let step = places[knot + 1] - places[knot];
        knots[knot].towards(&knots[knot + 1], if step > 0.0 { (place - places[knot]) / step } else { 0.0 })
    };
    let is_plain = |place: f64| {
        let knot = knot_at(place);
        knot.level_m > sea_m - DEEPEST_M && fields.edge_m(knot.at) > sea_m as f32 + LEAST_EDGE_M
    };
    let step = longest / PARTS as f64;
    let parts = (1..=PARTS).take_while(|part| is_plain(shore + step * *part as f64)).count();
    if parts == 0 {
        return;
    }
    let front = shore + step * parts as f64;
    let foot = front + front_grains;
    // The plain grows steeper from the front up to the former shore.
    let steeper = (upper_slope - PLAIN_SLOPE).max(0.0) / (2.0 * (front - shore) * metres);
    let level_m = |place: f64| {
        let above_m = (front - place) * metres;
        let plain_m = above_m.clamp(0.0, (front - shore) * metres);
        let rise_m = PLAIN_SLOPE * plain_m + steeper * plain_m * plain_m;
        let upper_m = upper_slope.max(PLAIN_SLOPE) * (above_m - plain_m).max(0.0);
        sea_m + FRONT_M + rise_m + upper_m + FRONT_SLOPE * above_m.min(0.0)
    };
    // The raised bed may not lie above the bed's head, at which other channels end.
    if level_m(0.0) > knots[0].level_m {
        return;
    }
    let front_step = front_grains / PARTS as f64;
    let more = (0..=parts).map(|part| shore + step * part as f64);
    let more =
        more.chain((1..=PARTS).map(|part| front + front_step * part as f64)).map(|place| (place, knot_at(place)));
    let mut built: Vec<(f64, Knot)> = places.iter().copied().zip(knots.iter().copied()).chain(more).collect();
    built.sort_by(|a, b| a.0.total_cmp(&b.0));
    // Remove added knots that coincide with knots of the bed.
    built.dedup_by(|a, b| a.1.at == b.1.at);
    let raised = |(place, knot): (f64, Knot)| match place < foot {
        true => Knot { level_m: knot.level_m.max(level_m(place)), ..knot },
        false => knot,
    };
    *knots = built.into_iter().map(raised).collect();
}
