//! Generalisation: removes the bends of lines that a scale cannot show, and rounds their corners.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use glam::DVec2;

/// Returns the indices of the points of a line that remain after thinning. A point is removed if its triangle with its
/// neighbours has less than `least` area, the smallest triangle first. The ends stay.
///
/// Based on: M. Visvalingam and J. D. Whyatt, "Line generalisation by repeated elimination of points" (1993).
pub(super) fn thinned(line: &[DVec2], least: f64) -> Vec<usize> {
    let count = line.len();
    if count < 3 {
        return (0..count).collect();
    }
    let area = |a: usize, b: usize, c: usize| 0.5 * (line[b] - line[a]).perp_dot(line[c] - line[a]).abs();
    let mut before: Vec<usize> = (0..count).map(|index| index.saturating_sub(1)).collect();
    let mut after: Vec<usize> = (1..=count).collect();
    let inner =
        |index: usize| if (1..count - 1).contains(&index) { area(index - 1, index, index + 1) } else { f64::MAX };
    let mut areas: Vec<f64> = (0..count).map(inner).collect();
    let mut heap: BinaryHeap<Least> = (1..count - 1).map(|index| Least { area: areas[index], index }).collect();
    let mut left = vec![true; count];
    while let Some(Least { area: smallest, index }) = heap.pop() {
        if !left[index] || smallest != areas[index] {
            continue;
        }
        if smallest >= least {
            break;
        }
        left[index] = false;
        let (from, to) = (before[index], after[index]);
        (after[from], before[to]) = (to, from);
        for other in [from, to] {
            if other > 0 && other < count - 1 {
                // An area never gets smaller than the last one removed; otherwise a whole bend would go at once.
                areas[other] = area(before[other], other, after[other]).max(smallest);
                heap.push(Least { area: areas[other], index: other });
            }
        }
    }
    (0..count).filter(|index| left[*index]).collect()
}

/// A point and the area of its triangle. The order is reversed, so that a heap yields the smallest area first.
#[derive(PartialEq)]
struct Least {
    area: f64,
    index: usize,
}

impl Eq for Least {}

impl Ord for Least {
    fn cmp(&self, other: &Least) -> Ordering {
        other.area.total_cmp(&self.area).then(other.index.cmp(&self.index))
    }
}

impl PartialOrd for Least {
    fn partial_cmp(&self, other: &Least) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// Rounds the corners of a line: the result goes through the middles of the segments and bends around the points. A
/// ring stays a ring.
pub(super) fn smooth(line: &[DVec2]) -> Vec<DVec2> {
    let count = line.len();
    if count < 3 {
        return line.to_vec();
    }
    let is_ring = line[0] == line[count - 1];
    let mut points = vec![if is_ring { line[0].midpoint(line[1]) } else { line[0] }];
    for index in 1..count - 1 {
        let from = points[points.len() - 1];
        let is_last = index == count - 2 && !is_ring;
        let to = if is_last { line[count - 1] } else { line[index].midpoint(line[index + 1]) };
        points.extend(&bend(from, line[index], to)[1..]);
    }
    if is_ring {
        let (from, to) = (points[points.len() - 1], points[0]);
        points.extend(&bend(from, line[0], to)[1..]);
    }
    points
}

/// Returns a parabola from one point to another, bent towards a third (the control point), in pieces that are short
/// where it bends.
pub(super) fn bend(from: DVec2, towards: DVec2, to: DVec2) -> Vec<DVec2> {
    // The chord of a piece is off by an eighth of `bent` over the square of the number of pieces. The number keeps this
    // below a tenth of a pixel.
    let bent = (from - 2.0 * towards + to).length();
    let pieces = (bent / 0.8).sqrt().ceil().clamp(1.0, 16.0);
    let at = |index: usize| {
        let t = index as f64 / pieces;
        let u = 1.0 - t;
        u * u * from + 2.0 * u * t * towards + t * t * to
    };
    (0..=pieces as usize).map(|index| if index as f64 == pieces { to } else { at(index) }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_bends_go_and_large_ones_stay() {
        let line: Vec<DVec2> = (0..200)
            .map(|index| {
                let x = f64::from(index) * 0.25;
                DVec2::new(x, 10.0 * (x * 0.2).sin() + 0.05 * f64::from(index % 2))
            })
            .collect();
        let kept = thinned(&line, 0.4);
        assert!(kept.len() < 60 && kept.len() > 10, "{}", kept.len());
        assert_eq!((kept[0], kept[kept.len() - 1]), (0, 199));
        for pair in kept.windows(2) {
            for index in pair[0]..pair[1] {
                let share = (line[index][0] - line[pair[0]][0]) / (line[pair[1]][0] - line[pair[0]][0]);
                let height = line[pair[0]][1] + share * (line[pair[1]][1] - line[pair[0]][1]);
                assert!((height - line[index][1]).abs() < 0.6, "{index}");
            }
        }
    }

    #[test]
    fn a_smooth_line_keeps_its_ends_and_a_ring_closes() {
        let line = [[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [20.0, 10.0]].map(DVec2::from);
        let smoothed = smooth(&line);
        assert_eq!((smoothed[0], smoothed[smoothed.len() - 1]), (line[0], line[3]));
        let ring = smooth(&[[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 0.0]].map(DVec2::from));
        assert_eq!(ring[0], ring[ring.len() - 1]);
        for triple in smoothed.windows(3) {
            let (a, b) = (triple[1] - triple[0], triple[2] - triple[1]);
            let turn = a.perp_dot(b).atan2(a.dot(b));
            assert!(turn.abs() < 0.7, "{turn}");
        }
    }
}
