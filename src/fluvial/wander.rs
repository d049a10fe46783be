//! How channels wander off the straight, at all scales, without coming across each other.
//!
//! A channel keeps to a tube around its straight course that is narrower than half of the way to the next course: so no
//! two tubes meet, whichever channel is asked for first.
//!
//! Based on: A. Fournier, D. Fussell, L. Carpenter, Computer rendering of stochastic models, 1982 (midpoint
//! displacement).

use super::point::chance;
use crate::geometry::{LineSegment, length};
use crate::hash::Draw;

/// How far the middle of a stretch lies to the side at most, as a share of its length.
///
/// What each halving adds to the length of a channel is what makes long rivers longer than their basins are wide:
/// Hack's law. Half is a corner of 90 degrees, at most.
const SWING: f64 = 0.5;

/// How much of the way to the next course a channel may take: less than a half, so that two never meet, with some room
/// for their widths.
const TUBE: f64 = 0.4;

/// Shares of a channel's length by which it lies to the side at the ends of its segments, whose number is a power of
/// two; 0 at both ends.
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

/// The places at the ends of the segments of a course once they are moved to the side by `offsets`, in the unit of the
/// course, or by as much of it as the lines of the courses around leave room for.
pub fn wandered(course: &[[f64; 2]], offsets: &[f64], around: &[LineSegment]) -> Vec<[f64; 2]> {
    // Half of the way to the nearest line around would be a place as near to that as to its own course.
    let room = |place: [f64; 2]| around.iter().map(|line| line.distance(place)).fold(f64::INFINITY, f64::min);
    let within = |a: [f64; 2], b: [f64; 2], t: f64| [a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t];
    let last = course.len() - 1;
    let at_knots: Vec<f64> = course.iter().map(|place| room(*place)).collect();
    // Between two knots, where the room may be less than at both.
    let between: Vec<f64> = course
        .windows(2)
        .map(|pair| {
            [0.25, 0.5, 0.75].map(|t| room(within(pair[0], pair[1], t))).into_iter().fold(f64::INFINITY, f64::min)
        })
        .collect();
    (0..=last)
        .map(|knot| {
            if knot == 0 || knot == last {
                return course[knot];
            }
            let room = at_knots[knot].min(between[knot - 1]).min(between[knot]);
            let side = offsets[knot].clamp(-TUBE * room, TUBE * room);
            // At right angles to the way from the knot before to the one after.
            let (before, after) = (course[knot - 1], course[knot + 1]);
            let way = [after[0] - before[0], after[1] - before[1]];
            let scale = side / length(way).max(1.0);
            [course[knot][0] - way[1] * scale, course[knot][1] + way[0] * scale]
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_that_wander_do_not_meet() {
        let straight = |y: f64| (0..=16).map(|step| [step as f64 * 100.0, y]).collect::<Vec<_>>();
        let line = |y: f64| LineSegment { from: [0.0, y], along: [1600.0, 0.0] };
        for id in 0..200 {
            let offsets = |n: i64| offsets(1, (id, n), 16).iter().map(|share| share * 1600.0).collect::<Vec<_>>();
            let upper = wandered(&straight(0.0), &offsets(0), &[line(90.0)]);
            let lower = wandered(&straight(90.0), &offsets(1), &[line(0.0)]);
            for (upper, lower) in upper.iter().zip(&lower) {
                assert!(upper[1] < lower[1], "{upper:?} is south of {lower:?}");
            }
        }
    }
}
