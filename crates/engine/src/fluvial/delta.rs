//! Deltas: what large rivers have filled of their drowned valleys since the sea rose.
//!
//! A bed that passes under the sea goes on above it to the delta's front, and falls from there to where it was. Its
//! floor follows it, so the valley is a plain from side to side; what joins it there comes to the bed as it is now.

use super::channel::{Knot, ways};
use super::fields::Fields;

/// Metres that the bed lies above the sea at the front: enough that the plain is none of it.
const FRONT_M: f64 = 0.3;

/// Slope of the bed at the front. Chosen by eye.
const PLAIN_SLOPE: f64 = 2e-4;

/// Slope that it comes to further up, as a share of the bed's above the delta, and at most: gentler than that, so that the two
/// meet, and not by so much that the plain has an edge there. Chosen by eye.
const UPPER_SLOPE: f64 = 0.7;
const MOST_SLOPE: f64 = 0.008;

/// Slope at which its front falls to the sea's floor. Chosen by eye.
const FRONT_SLOPE: f64 = 0.15;

/// Metres of water that a delta has filled at its front, at most. Chosen by eye.
const DEEPEST_M: f64 = 25.0;

/// Metres that the land's edge lies above the sea where there is a delta, at least: the plain is as high nowhere.
const LEAST_EDGE_M: f32 = 12.0;

/// Knots of a delta, and of its front, at least: so that it ends where it should though the bed has knots far apart.
const PARTS: usize = 32;

/// Lets a bed run on above the sea for some grains at most, where the valley is still one.
///
/// Its ends stay as they are, for other channels begin and end there.
pub fn build(fields: &Fields, knots: &mut Vec<Knot>, longest: f64) {
    let (sea_m, metres) = (fields.sea_level_m(), fields.metres_a_grain());
    let Some(wet) = knots.iter().position(|knot| knot.level_m < sea_m + FRONT_M).filter(|wet| *wet > 0) else { return };
    // Grains along the bed from its head to each knot.
    let places = ways(knots);
    let whole = places[places.len() - 1];
    let share = (knots[wet - 1].level_m - sea_m - FRONT_M) / (knots[wet - 1].level_m - knots[wet].level_m);
    let shore = places[wet - 1] + (places[wet] - places[wet - 1]) * share;
    let upper_slope = (UPPER_SLOPE * (knots[0].level_m - sea_m) / (shore * metres).max(1e-9)).min(MOST_SLOPE);
    // At the front's foot the bed has come back to what it was.
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
    // Steeper and steeper up to where the sea was.
    let steeper = (upper_slope - PLAIN_SLOPE).max(0.0) / (2.0 * (front - shore) * metres);
    let level_m = |place: f64| {
        let above_m = (front - place) * metres;
        let plain_m = above_m.clamp(0.0, (front - shore) * metres);
        let rise_m = PLAIN_SLOPE * plain_m + steeper * plain_m * plain_m;
        let upper_m = upper_slope.max(PLAIN_SLOPE) * (above_m - plain_m).max(0.0);
        sea_m + FRONT_M + rise_m + upper_m + FRONT_SLOPE * above_m.min(0.0)
    };
    // The bed has come to it already at its head, from which others go on.
    if level_m(0.0) > knots[0].level_m {
        return;
    }
    let front_step = front_grains / PARTS as f64;
    let more = (0..=parts).map(|part| shore + step * part as f64);
    let more =
        more.chain((1..=PARTS).map(|part| front + front_step * part as f64)).map(|place| (place, knot_at(place)));
    let mut built: Vec<(f64, Knot)> = places.iter().copied().zip(knots.iter().copied()).chain(more).collect();
    built.sort_by(|a, b| a.0.total_cmp(&b.0));
    // What was as far along already.
    built.dedup_by(|a, b| a.1.at == b.1.at);
    let raised = |(place, knot): (f64, Knot)| match place < foot {
        true => Knot { level_m: knot.level_m.max(level_m(place)), ..knot },
        false => knot,
    };
    *knots = built.into_iter().map(raised).collect();
}
