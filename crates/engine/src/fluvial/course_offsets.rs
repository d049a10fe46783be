//! Wandering: how channels leave the straight line, at all scales, without crossing each other.
//!
//! A channel stays in a tube around its straight course that is narrower than half of the distance to the next course.
//! So no two tubes meet, whichever channel is made first.
//!
//! Based on: A. Fournier, D. Fussell, L. Carpenter, Computer rendering of stochastic models, 1982 (midpoint
//! displacement).

use glam::DVec2;

use crate::geometry::LineSegment;
use crate::grain_point::chance;
use crate::hash::Draw;

/// Greatest sideways displacement of the middle of a stretch, as a share of the stretch's length.
///
/// The length that each halving adds to a channel makes long rivers longer than their basins are wide: Hack's law. With
/// a half, corners are at most 90 degrees.
const SWING: f64 = 0.5;

/// Greatest distance of a channel from its course, as a share of its length. Each halving adds its own swing to at most
/// the mean of two neighbours: 1/2 + 1/8 + 1/32 and so on.
pub const MOST_ASIDE: f64 = 2.0 / 3.0;

/// Share of the distance to the next course that a channel may use: less than a half, so that two channels never meet,
/// and leave some room for their widths.
const TUBE: f64 = 0.4;

/// Cosine of the least turn that counts as a corner: ten degrees.
const STRAIGHT: f64 = 0.985;

/// Returns the sideways offsets of a channel at the ends of its segments, as shares of its length. The number of
/// segments is a power of two; both ends have offset 0.
pub fn offsets(seed: u64, id: (i64, i64), segments: usize) -> Vec<f64> {
    // Midpoint displacement: the middle of each stretch moves to the side, then the middles of its halves.
    let mut offsets = vec![0.0; segments + 1];
    let mut stretch = segments;
    while stretch > 1 {
        let swing = SWING * stretch as f64 / segments as f64;
        for from in (0..segments).step_by(stretch) {
            let middle = from + stretch / 2;
            let side = 2.0 * chance(seed, id, Draw::Swing, middle as u64) - 1.0;
            offsets[middle] = f64::midpoint(offsets[from], offsets[from + stretch]) + swing * side;
        }
        stretch /= 2;
    }
    offsets
}

/// Returns the largest of these [`offsets`] to either side: a bound that needs no neighbouring channels.
pub fn most_aside(seed: u64, id: (i64, i64), segments: usize) -> f64 {
    offsets(seed, id, segments).into_iter().fold(0.0, |most, offset| offset.abs().max(most))
}

/// Returns the same offsets without swings shorter than `stretch` segments, interpolated smoothly.
pub fn smooth_offsets(seed: u64, id: (i64, i64), segments: usize, stretch: usize) -> Vec<f64> {
    let coarse = offsets(seed, id, segments / stretch);
    let last = coarse.len() - 1;
    // Hermite's cubic between the coarse offsets, with the slopes across each; level at both ends.
    let slope = |at: usize| if at == 0 || at == last { 0.0 } else { (coarse[at + 1] - coarse[at - 1]) / 2.0 };
    let at = |step: usize| {
        let (from, t) = (step / stretch, (step % stretch) as f64 / stretch as f64);
        if t == 0.0 {
            return coarse[from];
        }
        let (t2, t3) = (t * t, t * t * t);
        let way = coarse[from + 1] - coarse[from];
        coarse[from] + way * (3.0 * t2 - 2.0 * t3) + slope(from) * (t3 - 2.0 * t2 + t) + slope(from + 1) * (t3 - t2)
    };
    (0..=segments).map(at).collect()
}

/// Returns the distance by which each place of a course may lie to the side, at most `most`: a share of the distance to
/// the nearest line around; 0 at both ends.
pub fn rooms(course: &[DVec2], around: &[LineSegment], most: f64) -> Vec<f64> {
    let last = course.len() - 1;
    let reach = most / TUBE;
    let middle = course[0].lerp_monotonic(course[last], 0.5);
    let extent = course.iter().map(|at| at.distance(middle)).fold(0.0, f64::max);
    let around: Vec<&LineSegment> = around.iter().filter(|line| line.touches(middle.into(), reach + extent)).collect();
    // At half of the distance to the nearest line, a place would be as near to that line as to its own course. Places
    // between two knots are examined too, as the room there may be less than at both knots.
    let after = |knot: usize| {
        let (from, to) = (course[knot], course[knot + 1]);
        let at = |share: f64| from.lerp_monotonic(to, share).to_array();
        let (middle, half) = (at(0.5), 0.5 * to.distance(from));
        let mut least = [reach; 2];
        for line in &around {
            // Skip lines that cannot be nearer than all before.
            if line.touches(middle, least[0].max(least[1]) + half) {
                let between = [0.25, 0.5, 0.75].map(|share| line.distance(at(share)));
                least = [least[0].min(line.distance(from.into())), between.into_iter().fold(least[1], f64::min)];
            }
        }
        least.map(|least| TUBE * least)
    };
    let after: Vec<[f64; 2]> = (0..last).map(after).collect();
    let at = |knot: usize| match knot {
        _ if knot == 0 || knot == last => 0.0,
        _ => after[knot][0].min(after[knot][1]).min(after[knot - 1][1]),
    };
    (0..=last).map(at).collect()
}

/// Moves offsets towards the course, so that they change by at most `most_change` from one place to the next. Where
/// offsets are clamped to their room, the channel would otherwise turn a corner from one side of the course to the
/// other.
pub fn draw_in(offsets: &mut [f64], most_change: f64) {
    let last = offsets.len() - 1;
    for side in [1.0, -1.0] {
        // Looks at one side at a time, with offsets to the other side taken as 0, and limits the change from either
        // end.
        let mut limit = |at: usize, beside: usize| {
            let most = (side * offsets[beside]).max(0.0) + most_change;
            if side * offsets[at] > most {
                offsets[at] = side * most;
            }
        };
        (1..=last).for_each(|at| limit(at, at - 1));
        (0..last).rev().for_each(|at| limit(at, at + 1));
    }
}

/// Returns the places of a course moved sideways by `offsets`, in the unit of the course.
pub fn moved(course: &[DVec2], offsets: &[f64]) -> Vec<DVec2> {
    let last = course.len() - 1;
    let at = |knot: usize| {
        if knot == 0 || knot == last {
            return course[knot];
        }
        // At right angles to the line from the knot before to the knot after.
        let way = course[knot + 1] - course[knot - 1];
        course[knot] + way.perp() * (offsets[knot] / way.length().max(1.0))
    };
    (0..=last).map(at).collect()
}

/// Cuts the corners of a course, each by a quarter of the segments before and after it.
///
/// Based on: G. Chaikin, An algorithm for high-speed curve generation, 1974.
pub fn rounded(course: &[DVec2]) -> Vec<DVec2> {
    let corners = course.windows(3).flat_map(|three| {
        let (before, after) = (three[1] - three[0], three[2] - three[1]);
        // Where the course hardly turns, there is no corner to cut.
        if before.dot(after) > STRAIGHT * before.length() * after.length() {
            vec![three[1]]
        } else {
            vec![three[0] + before * 0.75, three[1] + after * 0.25]
        }
    });
    std::iter::once(course[0]).chain(corners).chain([course[course.len() - 1]]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_cut_off_by_its_room_comes_gradually_to_the_other_side() {
        let cut = [0.0, 5.0, 9.0, 9.0, 9.0, -9.0, -9.0, -8.0, -1.0, 0.0, 0.5, 0.0];
        let mut drawn = cut;
        draw_in(&mut drawn, 3.0);
        for (before, after) in cut.iter().zip(&drawn) {
            assert!(after.abs() <= before.abs() && after * before >= 0.0, "{drawn:?}");
        }
        assert_eq!(drawn, [0.0, 3.0, 6.0, 6.0, 3.0, -3.0, -6.0, -4.0, -1.0, 0.0, 0.5, 0.0]);
    }

    #[test]
    fn neighbours_that_wander_do_not_meet() {
        let straight = |y: f64| (0..=16).map(|step| DVec2::new(step as f64 * 100.0, y)).collect::<Vec<_>>();
        let line = |y: f64| LineSegment { from: [0.0, y], along: [1600.0, 0.0] };
        for id in 0..200 {
            let offsets = |n: i64| offsets(1, (id, n), 16).iter().map(|share| share * 1600.0).collect::<Vec<_>>();
            let wandered = |n: i64, y: f64, other: f64| {
                let course = straight(y);
                let rooms = rooms(&course, &[line(other)], 1600.0);
                let within: Vec<f64> = offsets(n).iter().zip(rooms).map(|(by, room)| by.clamp(-room, room)).collect();
                rounded(&moved(&course, &within))
            };
            let (upper, lower) = (wandered(0, 0.0, 90.0), wandered(1, 90.0, 0.0));
            let south = upper.iter().map(|place| place.y).fold(f64::MIN, f64::max);
            let north = lower.iter().map(|place| place.y).fold(f64::MAX, f64::min);
            assert!(south < north, "one comes to {south}, and the other, south of it, to {north}");
        }
    }
}
