//! Cuts of beds into the sides of other valleys.
//!
//! To judge the numbers chosen by eye, look where side valleys of `alps` and `canyon` come down the walls of larger
//! ones.

use glam::DVec2;

use super::channel::Knot;
use super::fields::Fields;
use super::segment::{Circle, Segment};
use crate::grain_point::{GRAINS, Point};

/// Largest slope of a river that runs down the side of another valley, as a share of that side's slope: the river cuts
/// into the side, and is not lost on it. Chosen by eye.
pub const INCISION: f64 = 0.65;

/// Least fall from knot to knot of a bed that is cut into the side of another valley, in metres, and in metres a metre.
/// From one vertex to the next it is large enough for heights in `f32` to show it.
const LEAST_FALL_M: f64 = 0.01;
const LEAST_FALL: f64 = 1e-4;

/// Distance in grains between the places at which a bed is compared with the sides of other valleys, about: eight
/// vertices.
const LONGEST_CUT: f64 = (8 * GRAINS) as f64;

/// Number of knots of a bed that are compared with the sides of other valleys together.
const CUT_RUN: usize = 8;

/// Returns a circle that holds a bed, and the height of the bed's highest water.
pub fn bed_in(knots: &[Knot], origin: Point) -> (Circle, f64) {
    let places: Vec<DVec2> = knots.iter().map(|knot| knot.at.from(origin)).collect();
    (Circle::around(&places), knots.iter().map(|knot| knot.level_m).fold(f64::NEG_INFINITY, f64::max))
}

/// Returns the segments whose sides may be below a height somewhere in a circle, for hillsides that rise `slope` metres
/// a grain.
pub fn nearly_below<'a>(segments: &[&'a Segment], circle: &Circle, slope: f64, most_m: f64) -> Vec<&'a Segment> {
    let may_be_below = |segment: &&Segment| {
        most_m > segment.lowest_m() && segment.may_be_below(circle.least(segment).powi(2), slope, most_m)
    };
    segments.iter().copied().filter(may_be_below).collect()
}

/// Lowers a bed, from its mouth up, to below the sides of other valleys, given their segments relative to an origin.
/// Where the bed is straight for long, it gets a new knot at each place that is lowered.
pub fn cut_into(fields: &Fields, knots: &mut Vec<Knot>, hill_slope: f64, segments: &[&Segment], origin: Point) {
    let least_slope = INCISION * hill_slope.min(fields.least_laws().hill_slope) * fields.metres_a_grain();
    let below = |knots: &[Knot], segments| {
        let (circle, highest_m) = bed_in(knots, origin);
        nearly_below(segments, &circle, least_slope, highest_m)
    };
    let near = below(knots, segments);
    let mut cut: Vec<Knot> = knots.last().copied().into_iter().collect();
    // From the mouth up, because each knot must stay above the one below; and in runs, each of which has few segments
    // near.
    for end in (1..knots.len()).rev().step_by(CUT_RUN) {
        let run = &knots[end.saturating_sub(CUT_RUN)..=end];
        let near = below(run, &near);
        let laws = fields.all_laws(&run.iter().map(|knot| knot.at).collect::<Vec<_>>());
        for (pair, laws) in run.windows(2).zip(&laws).rev() {
            let (mut here, mut below) = (pair[0], cut[cut.len() - 1]);
            let slope = INCISION * laws.hill_slope.min(hill_slope) * fields.metres_a_grain();
            // The segments whose sides may be below the bed somewhere on the way between the two knots.
            let half = here.at.distance(pair[1].at) / 2.0;
            let circle = Circle { middle: here.towards(&pair[1], 0.5).at.from(origin), radius: half };
            let lower = nearly_below(&near, &circle, slope, here.level_m.max(pair[1].level_m));
            let cut_m = |knot: &Knot| {
                let at = knot.at.from(origin);
                lower
                    .iter()
                    .fold(knot.level_m, |most_m, segment| segment.side_below_m(at, slope, most_m).unwrap_or(most_m))
            };
            // Wherever the bed fell, it still falls by a little at least. In a lake the bed may rise to the sill.
            let whole = (2.0 * half).max(1.0);
            let least_fall_m = LEAST_FALL_M.max(LEAST_FALL * whole * fields.metres_a_grain());
            let least_fall_m = (here.level_m - below.level_m).min(least_fall_m);
            let least_m = |at: Point, below: &Knot| below.level_m + least_fall_m * (at.distance(below.at) / whole);
            here.level_m = cut_m(&here).max(least_m(here.at, &below));
            let parts = (here.at.distance(below.at) / LONGEST_CUT).ceil();
            for part in (1..parts as usize).rev().filter(|_| least_fall_m > 0.0) {
                // The rest of the way down from here is straight, to the last knot that was lowered.
                let straight = here.towards(&pair[1], part as f64 / parts);
                let left = straight.at.distance(below.at) / here.at.distance(below.at);
                let straight = Knot { level_m: below.level_m + (here.level_m - below.level_m) * left, ..straight };
                let level_m = cut_m(&straight).max(least_m(straight.at, &below));
                if level_m < straight.level_m {
                    below = Knot { level_m, ..straight };
                    cut.push(below);
                }
            }
            here.level_m = here.level_m.max(least_m(here.at, &below));
            cut.push(here);
        }
    }
    cut.reverse();
    *knots = cut;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fluvial::channel::{Channel, Mouth};
    use crate::fluvial::cross_section::measured;
    use crate::fluvial::laws::Laws;
    use crate::fluvial::segment::segments_of;

    #[test]
    fn a_bed_is_cut_where_it_is_straight_for_long() {
        let fields = Fields::of_preset("alps", 4, |_| {});
        let knot = |x: i64, y: i64, level_m: f64| Knot {
            at: Point::at_vertex(x, y),
            level_m,
            area: 0.001,
            discharge_m3s: 0.01,
            pool_m: f64::NEG_INFINITY,
        };
        // The knots are a hundred vertices apart, and half way the deep head of another channel lies ten vertices
        // beside the bed.
        let mut bed = vec![knot(0, 0, 1200.0), knot(100, 0, 1000.0)];
        let (head, foot) = (knot(50, 10, 1010.0), knot(50, 60, 900.0));
        let laws = Laws { hill_slope: 0.6, ..*fields.most_laws() };
        let other = Channel::new((3, 0, 0), vec![head, foot], Mouth::Sea, laws);
        let origin = Point::at_vertex(0, 0);
        let other = measured(&fields, other);
        let segments: Vec<Segment> = segments_of(&fields, &other, 0, origin, |_| true).collect();
        cut_into(&fields, &mut bed, 0.6, &segments.iter().collect::<Vec<_>>(), origin);
        assert!(bed.len() > 2 && bed.windows(2).all(|pair| pair[0].level_m > pair[1].level_m), "{bed:?}");
        let slope = fields.laws(head.at).hill_slope.min(0.6) * fields.metres_a_grain();
        for knot in &bed[1..bed.len() - 1] {
            let side_m = segments[0].side_m(knot.at.from(origin), slope);
            assert!(knot.level_m < side_m, "{knot:?}, but the side is at {side_m}");
        }
    }
}
