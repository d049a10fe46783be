//! Plane geometry of straight lines. Places are given as distances east and south of some origin, in any unit.

/// Returns the length of a vector.
pub fn length([x, y]: [f64; 2]) -> f64 {
    // A square root is exact on every machine; the result of `hypot` depends on the machine's library.
    (x * x + y * y).sqrt()
}

/// Interpolates linearly between a start value and the start plus a change, at a share of the way.
pub fn lerp([start, change]: [f64; 2], share: f64) -> f64 {
    start + change * share
}

/// Returns the dot product of two vectors.
pub fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

/// Returns the cross product of two vectors: positive if the second turns clockwise from the first, where y points
/// down.
pub fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

/// Interpolates bilinearly in a cell, from the values at its north-western, north-eastern, south-western and
/// south-eastern corner; `east` and `south` are shares of the cell's side.
pub fn bilinear([a, b, c, d]: [f64; 4], [east, south]: [f64; 2]) -> f64 {
    let (north, below) = (a + (b - a) * east, c + (d - c) * east);
    north + (below - north) * south
}

/// Smoothstep: rises from 0 to 1 as `t` does, but level at both ends; in the middle it is half again as steep as `t`.
pub fn smooth(t: f64) -> f64 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Returns the distance travelled at each point of a path, given the lengths of its steps: 0 at the first point.
pub fn come(steps: impl Iterator<Item = f64>) -> Vec<f64> {
    let sums = steps.scan(0.0, |come, step| {
        *come += step;
        Some(*come)
    });
    std::iter::once(0.0).chain(sums).collect()
}

/// Returns the distance along a polyline at each of its points.
pub fn come_along(places: &[[f64; 2]]) -> Vec<f64> {
    come(places.windows(2).map(|pair| length([pair[1][0] - pair[0][0], pair[1][1] - pair[0][1]])))
}

/// The straight line segment between two places.
#[derive(Clone, Copy, Debug)]
pub struct LineSegment {
    /// The start.
    pub from: [f64; 2],
    /// The vector from the start to the end.
    pub along: [f64; 2],
}

/// An end of a part of a line segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClippedEnd {
    /// Share of the segment's length at which the part ends.
    pub share: f64,
    /// The edge that cuts the segment there, if one does: its axis, 0 or 1, and its coordinate on that axis.
    pub edge: Option<(usize, f64)>,
}

impl LineSegment {
    /// Returns the segment from one place to another.
    pub fn between(from: [f64; 2], to: [f64; 2]) -> LineSegment {
        LineSegment { from, along: [to[0] - from[0], to[1] - from[1]] }
    }

    /// Tells whether the segment's bounding rectangle, widened by `distance`, holds a place. If not, the place is
    /// further away than `distance`.
    pub fn touches(&self, place: [f64; 2], distance: f64) -> bool {
        // Tells whether the place lies at most `distance` beyond the segment's extent along an axis.
        let beside = |axis: usize| {
            let half = 0.5 * self.along[axis];
            (place[axis] - self.from[axis] - half).abs() - half.abs() <= distance
        };
        beside(0) & beside(1)
    }

    /// Tells whether the segment clearly crosses another: the ends of each lie on different sides of the other, more
    /// than one and a half units away from it. To touch is not to cross, and ends that are rounded to whole units may
    /// cross by rounding alone.
    pub fn crosses(&self, other: &LineSegment) -> bool {
        let apart = |line: &LineSegment, by: &LineSegment| {
            let side = |off: [f64; 2]| cross(line.along, off);
            let start = [by.from[0] - line.from[0], by.from[1] - line.from[1]];
            let (a, b) = (side(start), side([start[0] + by.along[0], start[1] + by.along[1]]));
            // Most segments have both ends on one side: the signs show that, without a square root.
            (a > 0.0) != (b > 0.0) && {
                let least = 1.5 * length(line.along);
                (a > least && b < -least) || (a < -least && b > least)
            }
        };
        apart(self, other) && apart(other, self)
    }

    /// Finds the point of the segment that is nearest to a place. Returns it as a share of the length, 0 to 1, and the
    /// square of its distance. A segment without length is nearest at its start.
    pub fn nearest(&self, to: [f64; 2]) -> (f64, f64) {
        let off = [to[0] - self.from[0], to[1] - self.from[1]];
        let square = self.along[0] * self.along[0] + self.along[1] * self.along[1];
        let share = if square > 0.0 { (off[0] * self.along[0] + off[1] * self.along[1]) / square } else { 0.0 };
        let share = share.clamp(0.0, 1.0);
        let away = [off[0] - self.along[0] * share, off[1] - self.along[1] * share];
        (share, away[0] * away[0] + away[1] * away[1])
    }

    /// Returns the segment's distance from a place.
    pub fn distance(&self, to: [f64; 2]) -> f64 {
        self.nearest(to).1.sqrt()
    }

    /// Tells whether the segment touches the rectangle from the origin to `corner`, edges included.
    pub fn touches_rectangle(&self, corner: [f64; 2]) -> bool {
        self.clipped([0.0; 2], corner).is_some()
    }

    /// Returns the ends of the part of the segment that lies in a rectangle, edges included; `None` if no part does.
    ///
    /// Based on: Y.-D. Liang, B. A. Barsky, "A new concept and method for line clipping", 1984. Each edge narrows the
    /// part that lies within all four edges.
    pub fn clipped(&self, min: [f64; 2], max: [f64; 2]) -> Option<[ClippedEnd; 2]> {
        let [mut first, mut last] = [0.0, 1.0].map(|share| ClippedEnd { share, edge: None });
        for axis in [0, 1] {
            let (from, along) = (self.from[axis], self.along[axis]);
            if along == 0.0 && (from < min[axis] || from > max[axis]) {
                return None;
            }
            let edges = [(min[axis], along > 0.0), (max[axis], along < 0.0)];
            for (bound, enters) in edges.into_iter().filter(|_| along != 0.0) {
                let end = ClippedEnd { share: (bound - from) / along, edge: Some((axis, bound)) };
                if enters && end.share > first.share {
                    first = end;
                } else if !enters && end.share < last.share {
                    last = end;
                }
            }
        }
        (first.share <= last.share).then_some([first, last])
    }
}

/// Returns the segments from each `step`th place to the next.
pub fn lines(places: &[[f64; 2]], step: usize) -> Vec<LineSegment> {
    let ends = places.iter().step_by(step);
    ends.clone().zip(ends.skip(1)).map(|(from, to)| LineSegment::between(*from, *to)).collect()
}

/// Simplifies a polyline of `count` points, at least one: returns the indices of its ends, and of each point at which
/// `split` divides the stretch from one kept point to the next.
///
/// Based on: D. H. Douglas, T. K. Peucker, "Algorithms for the reduction of the number of points", 1973.
pub fn simplified(count: usize, split: impl Fn(usize, usize) -> Option<usize>) -> Vec<usize> {
    // A stack of ends of the stretches still to be simplified, the next one on top.
    let (mut kept, mut ends) = (vec![0], vec![count - 1]);
    while let Some(&end) = ends.last() {
        let first = kept[kept.len() - 1];
        if let Some(at) = split(first, end) {
            ends.push(at);
            continue;
        }
        if end > first {
            kept.push(end);
        }
        ends.pop();
    }
    kept
}

/// Returns the last of the numbers between two for which `off` is greatest, and that value; `None` if there are none
/// between.
pub fn furthest(first: usize, end: usize, off: impl Fn(usize) -> f64) -> Option<(usize, f64)> {
    (first + 1..end).map(|at| (at, off(at))).max_by(|a, b| a.1.total_cmp(&b.1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_simplified_line_passes_near_what_it_leaves_out() {
        let simple = |points: &[[f64; 2]], miss: f64| -> Vec<[f64; 2]> {
            let split = |first: usize, end: usize| {
                let chord = LineSegment::between(points[first], points[end]);
                furthest(first, end, |at| chord.distance(points[at])).filter(|(_, off)| *off > miss).map(|(at, _)| at)
            };
            simplified(points.len(), split).into_iter().map(|at| points[at]).collect()
        };
        let line: Vec<[f64; 2]> = (0..200).map(|x| [f64::from(x), 9.0 * (f64::from(x) / 15.0).sin()]).collect();
        let kept = simple(&line, 0.25);
        assert!(kept.len() < 60 && kept[0] == line[0] && kept[kept.len() - 1] == line[199], "{}", kept.len());
        for point in &line {
            let off = kept.windows(2).map(|pair| LineSegment::between(pair[0], pair[1]).distance(*point));
            assert!(off.fold(f64::INFINITY, f64::min) <= 0.25);
        }
        // A ring and a single point.
        let ring = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 0.0]];
        assert_eq!(simple(&ring, 0.1), [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 0.0]]);
        assert_eq!(simple(&ring[..1], 0.1), [[0.0, 0.0]]);
    }

    #[test]
    fn lines_cross_where_both_go_well_past_each_other() {
        let line = LineSegment::between([0.0, 0.0], [100.0, 0.0]);
        let crosses = |from, to| line.crosses(&LineSegment::between(from, to));
        assert!(crosses([50.0, -9.0], [50.0, 9.0]));
        assert!(!crosses([50.0, 0.0], [50.0, 9.0]), "it touches");
        assert!(!crosses([50.0, -1.0], [50.0, 9.0]), "it goes past by less than rounding");
        assert!(!crosses([150.0, -9.0], [150.0, 9.0]), "it passes by");
        assert!(!crosses([0.0, 5.0], [100.0, 5.0]), "it is parallel");
    }

    #[test]
    fn the_nearest_place_is_within_the_line() {
        let line = LineSegment::between([10.0, 0.0], [10.0, 20.0]);
        assert_eq!(line.nearest([13.0, 5.0]), (0.25, 9.0));
        assert_eq!(line.nearest([10.0, -2.0]), (0.0, 4.0));
        assert_eq!(line.nearest([6.0, 23.0]), (1.0, 25.0));
        assert_eq!(line.distance([6.0, 23.0]), 5.0);
        assert_eq!(LineSegment::between([1.0, 1.0], [1.0, 1.0]).nearest([4.0, 5.0]), (0.0, 25.0));
    }

    #[test]
    fn a_rectangle_is_touched_inside_across_and_at_its_edges() {
        let touches = |from, to| LineSegment::between(from, to).touches_rectangle([8.0, 4.0]);
        assert!(touches([1.0, 1.0], [2.0, 3.0]));
        assert!(touches([-1.0, 2.0], [9.0, 2.0]));
        assert!(touches([8.0, -3.0], [8.0, 9.0]));
        assert!(touches([-2.0, 2.0], [2.0, -2.0]), "through a corner");
        assert!(!touches([-3.0, 2.0], [2.0, -3.0]), "past a corner");
        assert!(!touches([-3.0, 5.0], [9.0, 5.0]));
    }
}
