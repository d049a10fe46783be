//! Convex polygons in whole numbers: their intersection and difference.
//!
//! All corners are whole [units](UNITS), so the side of an edge on which a place lies is exact, and independent of the
//! corner from which places are counted. Crossings of edges are rounded to units, in the same way for all polygons that
//! have these edges.

use super::MAX_CELLS;

/// Units per cell. A unit is too small to be visible, and a power of two, so that places are exact in floats.
pub(super) const UNITS: i64 = 1 << 14;

// Coordinates reach across the largest tile and as much again on either side: a doubled product of two of them fits 64
// bits.
const _: () = assert!((3 * MAX_CELLS as i64 * UNITS).checked_mul(2 * 3 * MAX_CELLS as i64 * UNITS).is_some());

/// Position in units east and south of the tile's north-western corner.
pub(super) type TilePoint = [i64; 2];

/// Returns twice the area of a triangle, positive if it is counter-clockwise seen from above, as in
/// [`Surface`](super::Surface).
pub(super) fn doubled_area([a, b, c]: [TilePoint; 3]) -> i64 {
    (b[1] - a[1]) * (c[0] - a[0]) - (b[0] - a[0]) * (c[1] - a[1])
}

/// Returns the edges of a polygon, from corner to corner.
fn edges(polygon: &[TilePoint]) -> impl Iterator<Item = [TilePoint; 2]> + '_ {
    (0..polygon.len()).map(|at| [polygon[at], polygon[(at + 1) % polygon.len()]])
}

/// Returns the bounding box of places: the least and the greatest coordinates.
pub(super) fn bounds(places: &[TilePoint]) -> [TilePoint; 2] {
    let by = |pick: fn(i64, i64) -> i64| {
        places.iter().copied().reduce(|a, b| [pick(a[0], b[0]), pick(a[1], b[1])]).unwrap_or_default()
    };
    [by(i64::min), by(i64::max)]
}

/// True if the interiors of two polygons intersect. Polygons that only touch do not overlap.
pub(super) fn overlap(a: &[TilePoint], b: &[TilePoint]) -> bool {
    let ([low, high], [other_low, other_high]) = (bounds(a), bounds(b));
    let beside = |axis: usize| high[axis] <= other_low[axis] || other_high[axis] <= low[axis];
    let parted = |a: &[TilePoint], b: &[TilePoint]| {
        edges(a).any(|[from, to]| b.iter().all(|place| doubled_area([from, to, *place]) <= 0))
    };
    !beside(0) && !beside(1) && !parted(a, b) && !parted(b, a)
}

/// Returns the intersection of two polygons; it is empty if it has no area.
pub(super) fn common(a: &[TilePoint], b: &[TilePoint]) -> Vec<TilePoint> {
    let holds =
        |polygon: &[TilePoint], place: TilePoint| edges(polygon).all(|[from, to]| doubled_area([from, to, place]) >= 0);
    let mut corners: Vec<TilePoint> = a.iter().copied().filter(|place| holds(b, *place)).collect();
    corners.extend(b.iter().copied().filter(|place| holds(a, *place)));
    for edge in edges(a) {
        corners.extend(edges(b).filter_map(|other| crossing(other, edge)));
    }
    hull(corners)
}

/// Returns the parts of a polygon outside of another polygon.
pub(super) fn without(polygon: &[TilePoint], other: &[TilePoint]) -> Vec<Vec<TilePoint>> {
    let mut rest = polygon.to_vec();
    let mut parts = Vec::new();
    for [from, to] in edges(other) {
        parts.push(beside(&rest, [to, from]));
        rest = beside(&rest, [from, to]);
    }
    parts.retain(|part| part.len() > 2);
    parts
}

/// Returns the part of a polygon on one side of a straight line: the side of any polygon that has the line as an edge.
fn beside(polygon: &[TilePoint], [from, to]: [TilePoint; 2]) -> Vec<TilePoint> {
    let side = |place: TilePoint| doubled_area([from, to, place]);
    let mut corners: Vec<TilePoint> = polygon.iter().copied().filter(|place| side(*place) >= 0).collect();
    corners.extend(edges(polygon).filter_map(|edge| on_way(edge, edge.map(side))));
    hull(corners)
}

/// Returns the point at which two edges cross, computed along the first; `None` if they only touch or are apart.
fn crossing([from, to]: [TilePoint; 2], other: [TilePoint; 2]) -> Option<TilePoint> {
    let sides = |[a, b]: [TilePoint; 2], ends: [TilePoint; 2]| ends.map(|end| doubled_area([a, b, end]));
    let [start, end] = sides([from, to], other);
    (start.signum() * end.signum() < 0).then(|| on_way([from, to], sides(other, [from, to])))?
}

/// Returns the point on an edge where it crosses a line, given the signed distances of its ends; `None` if both are on
/// one side.
fn on_way([from, to]: [TilePoint; 2], [start, end]: [i64; 2]) -> Option<TilePoint> {
    if start.signum() * end.signum() >= 0 {
        return None;
    }
    // Always compute from the same end, whatever the direction of the edge.
    let ((from, start), (to, end)) = if from < to { ((from, start), (to, end)) } else { ((to, end), (from, start)) };
    let share = start as f64 / (start as f64 - end as f64);
    Some([0, 1].map(|axis| from[axis] + ((to[axis] - from[axis]) as f64 * share + 0.5).floor() as i64))
}

/// Returns the convex hull of places, without corners along its edges.
///
/// Based on: A. M. Andrew, "Another efficient algorithm for convex hulls in two dimensions", 1979.
fn hull(mut places: Vec<TilePoint>) -> Vec<TilePoint> {
    places.sort_unstable();
    places.dedup();
    if places.len() < 3 {
        return Vec::new();
    }
    let chain = |places: &mut dyn Iterator<Item = TilePoint>| {
        let mut chain: Vec<TilePoint> = Vec::new();
        for place in places {
            while let [.., a, b] = chain[..]
                && doubled_area([a, b, place]) <= 0
            {
                chain.pop();
            }
            chain.push(place);
        }
        // The next chain begins where this one ends, so drop the shared corner.
        chain.pop();
        chain
    };
    let mut hull = chain(&mut places.iter().copied());
    hull.extend(chain(&mut places.iter().rev().copied()));
    if hull.len() > 2 { hull } else { Vec::new() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hash::combine;

    fn area(polygon: &[TilePoint]) -> i64 {
        (2..polygon.len()).map(|at| doubled_area([polygon[0], polygon[at - 1], polygon[at]])).sum()
    }

    /// Returns a pseudo-random triangle that has an area.
    fn triangle(seed: u64, side: u64) -> Vec<TilePoint> {
        let at = |index: u64| (combine(seed, index) % side) as i64;
        let [a, b, c] = [[at(0), at(1)], [at(2), at(3)], [at(4), at(5)]];
        match doubled_area([a, b, c]) {
            0 => vec![[0, 0], [0, 1], [1, 0]],
            area if area > 0 => vec![a, b, c],
            _ => vec![a, c, b],
        }
    }

    #[test]
    fn a_polygon_is_what_it_has_in_common_with_another_and_what_that_leaves() {
        for (seed, side) in (0..20_000).map(|seed| (seed, [5, 40, 1 << 20][seed as usize % 3])) {
            let [a, b] = [triangle(seed, side), triangle(seed + 1_000_000, side)];
            let (both, left) = (common(&a, &b), without(&a, &b));
            assert_eq!(overlap(&a, &b), overlap(&b, &a));
            assert!(overlap(&a, &b) || both.is_empty(), "{a:?} {b:?}");
            // Rounding along all edges may change the area by this much.
            let parts: i64 = left.iter().map(|part| area(part)).sum();
            let off = area(&a) - area(&both) - parts;
            assert!(off.abs() <= 16 * side as i64, "{a:?} without {b:?} is {left:?}, {off} off");
        }
    }

    #[test]
    fn what_touches_has_nothing_in_common() {
        let west: [TilePoint; 3] = [[0, 0], [0, 9], [9, 9]];
        let east: [TilePoint; 3] = [[0, 0], [9, 9], [9, 0]];
        assert!(!overlap(&west, &east));
        assert_eq!(without(&west, &east), [west.to_vec()]);
        assert!(without(&west, &west).is_empty());
        assert_eq!(common(&west, &west), hull(west.to_vec()));
    }

    #[test]
    fn edges_cross_at_the_same_place_from_all_sides() {
        for seed in 0..2000 {
            let at = |index: u64| (combine(seed, index) % 100_000) as i64;
            let ([a, b], [c, d]) = ([[at(0), at(1)], [at(2), at(3)]], [[at(4), at(5)], [at(6), at(7)]]);
            let found = crossing([a, b], [c, d]);
            assert!([crossing([b, a], [c, d]), crossing([a, b], [d, c])].iter().all(|other| *other == found));
            // The crossing does not depend on the corner from which places are counted.
            let moved = |[x, y]: TilePoint| [x - 7 * UNITS, y + 3 * UNITS];
            assert_eq!(crossing([moved(a), moved(b)], [moved(c), moved(d)]), found.map(moved));
        }
    }
}
