//! Contours: lines between inside and outside, by marching squares.

use std::collections::BTreeMap;

use crate::grid::Grid;

/// A line between vertices, in vertices east and south of the origin; the inside is on its left in a map with north up.
#[derive(Clone, Debug, PartialEq)]
pub struct Contour {
    /// At least two points; in a ring, the last is the first.
    pub points: Vec<[f64; 2]>,
    /// True if the contour is a ring.
    pub closed: bool,
}

/// An edge of the lattice: its western or northern vertex, y before x, and true if it runs south.
type LatticeEdge = (i64, i64, bool);

/// Returns the lines around the vertices whose value is above zero, sorted by their first points from north to south.
///
/// A crossing is computed from the two vertices of its edge alone, always in the same order, so the lines of two grids
/// that share a row of vertices meet there to the bit. Vertices that touch at a corner are not connected.
pub fn contours(values: &Grid<f32>) -> Vec<Contour> {
    let area = values.area();
    let inside = |x: i64, y: i64| values.at(x, y) > 0.0;
    // Each crossed edge has at most one line that leaves it and one that arrives at it.
    let mut next: BTreeMap<LatticeEdge, LatticeEdge> = BTreeMap::new();
    let mut reached: BTreeMap<LatticeEdge, LatticeEdge> = BTreeMap::new();
    for y in area.y0..area.y1 - 1 {
        let (north, south) = (values.row(y, area.x0, area.x1), values.row(y + 1, area.x0, area.x1));
        for (x, (north, south)) in (area.x0..).zip(north.windows(2).zip(south.windows(2))) {
            // Corners clockwise from the north-western one, each with the edge to the next corner.
            let corners = [north[0] > 0.0, north[1] > 0.0, south[1] > 0.0, south[0] > 0.0];
            if corners == [corners[0]; 4] {
                continue;
            }
            let edges = [(y, x, false), (y, x + 1, true), (y + 1, x, false), (y, x, true)];
            for side in 0..4 {
                // Walking around the cell: from the edge where the walk comes inside to the edge where it next goes
                // outside.
                if !corners[side] && corners[(side + 1) % 4] {
                    let leaves = (1..4).map(|step| (side + step) % 4).find(|side| !corners[(side + 1) % 4]);
                    let leaves = edges[leaves.expect("what comes inside goes outside again")];
                    next.insert(edges[side], leaves);
                    reached.insert(leaves, edges[side]);
                }
            }
        }
    }
    let point = |(y, x, south): LatticeEdge| {
        let (a, b) = (values.at(x, y) as f64, (if south { values.at(x, y + 1) } else { values.at(x + 1, y) }) as f64);
        debug_assert_ne!(a > 0.0, inside(x + i64::from(!south), y + i64::from(south)));
        let share = a / (a - b);
        if south { [x as f64, y as f64 + share] } else { [x as f64 + share, y as f64] }
    };
    let mut contours = Vec::new();
    let mut begin = |first: LatticeEdge, next: &mut BTreeMap<LatticeEdge, LatticeEdge>, closed: bool| {
        let mut points = vec![point(first)];
        let mut at = first;
        while let Some(to) = next.remove(&at) {
            points.push(point(to));
            at = to;
        }
        points.dedup();
        if points.len() > 1 {
            contours.push((first, Contour { points, closed }));
        }
    };
    // First the lines that begin at the border, then the rings.
    let starts: Vec<LatticeEdge> = next.keys().filter(|edge| !reached.contains_key(edge)).copied().collect();
    for first in starts {
        begin(first, &mut next, false);
    }
    while let Some((first, _)) = next.first_key_value() {
        let first = *first;
        begin(first, &mut next, true);
    }
    contours.sort_by_key(|(first, _)| *first);
    contours.into_iter().map(|(_, contour)| contour).collect()
}

/// Twice the signed area within a ring, in square vertices: positive if the ring runs anticlockwise in a map.
pub fn twice_area(ring: &[[f64; 2]]) -> f64 {
    // Relative to the ring's first point, so that numbers stay small.
    let [x, y] = ring[0];
    let at = |point: [f64; 2]| [point[0] - x, y - point[1]];
    ring.windows(2).fold(0.0, |sum, pair| {
        let (a, b) = (at(pair[0]), at(pair[1]));
        sum + (a[0] * b[1] - b[0] * a[1])
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::area::Area;

    fn grid(area: Area, value: impl Fn(i64, i64) -> f32) -> Grid<f32> {
        let mut grid = Grid::filled(area, 0.0);
        for y in area.y0..area.y1 {
            for (x, slot) in (area.x0..).zip(grid.row_mut(y, area.x0, area.x1)) {
                *slot = value(x, y);
            }
        }
        grid
    }

    #[test]
    fn a_vertex_has_a_ring_that_runs_anticlockwise() {
        let rings = contours(&grid(Area::new(-2, 3, 5, 5), |x, y| if (x, y) == (0, 5) { 1.0 } else { -1.0 }));
        let ring = [[0.0, 4.5], [-0.5, 5.0], [0.0, 5.5], [0.5, 5.0], [0.0, 4.5]];
        assert_eq!(rings, [Contour { points: ring.to_vec(), closed: true }]);
        assert_eq!(twice_area(&ring), 1.0);
    }

    #[test]
    fn a_hole_runs_clockwise_and_corners_do_not_connect() {
        let hole = contours(&grid(Area::new(0, 0, 7, 7), |x, y| {
            let far = (x - 3).abs().max((y - 3).abs());
            if far == 1 { 1.0 } else { -1.0 }
        }));
        let areas: Vec<f64> = hole.iter().map(|ring| twice_area(&ring.points)).collect();
        assert_eq!(hole.len(), 2);
        assert!(areas[0] > 0.0 && areas[1] < 0.0, "{areas:?}");
        let corners = contours(&grid(Area::new(0, 0, 4, 4), |x, y| if x == y && x % 3 > 0 { 1.0 } else { -1.0 }));
        assert_eq!(corners.len(), 2);
    }

    #[test]
    fn lines_of_neighbours_meet_to_the_bit() {
        let value = |x: i64, y: i64| ((x * 7919 + y * 104_729).rem_euclid(1009) as f32 - 504.3) / 7.7;
        let (west, east) = (grid(Area::new(0, 0, 17, 17), value), grid(Area::new(16, 0, 17, 17), value));
        let ends = |grid: &Grid<f32>| {
            let open = contours(grid).into_iter().filter(|contour| !contour.closed);
            let mut ends: Vec<[u64; 2]> = open
                .flat_map(|line| [line.points[0], line.points[line.points.len() - 1]])
                .filter(|point| point[0] == 16.0)
                .map(|point| point.map(f64::to_bits))
                .collect();
            ends.sort_unstable();
            ends
        };
        assert!(ends(&west).len() > 4);
        assert_eq!(ends(&west), ends(&east));
    }
}
