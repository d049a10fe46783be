//! Features cut off at the edge of a rectangle.

use crate::features::layer::{Geometry, GeometryType};
use crate::geometry::{ClippedEnd, LineSegment};

/// A rectangle in metres east and north. The standards call the bounding box of geometries an envelope.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Envelope {
    pub min: [f64; 2],
    pub max: [f64; 2],
}

impl Envelope {
    /// The empty envelope: joined with another one, it changes nothing.
    pub const NOTHING: Envelope = Envelope { min: [f64::INFINITY; 2], max: [f64::NEG_INFINITY; 2] };

    /// Returns the rectangle around lines.
    pub fn of(lines: &[Vec<[f64; 3]>]) -> Envelope {
        lines
            .iter()
            .flatten()
            .fold(Envelope::NOTHING, |envelope, &[x, y, _]| envelope.and(Envelope { min: [x, y], max: [x, y] }))
    }

    /// Returns the rectangle around two.
    pub fn and(self, other: Envelope) -> Envelope {
        let both = |a: [f64; 2], b: [f64; 2], pick: fn(f64, f64) -> f64| [pick(a[0], b[0]), pick(a[1], b[1])];
        Envelope { min: both(self.min, other.min, f64::min), max: both(self.max, other.max, f64::max) }
    }

    fn holds(&self, point: &[f64; 3]) -> bool {
        (0..2).all(|axis| (self.min[axis]..=self.max[axis]).contains(&point[axis]))
    }

    /// Returns the parts of a feature that lie inside, from its start on: lines are cut, polygons closed along the
    /// edge.
    pub fn clip(&self, shape: GeometryType, geometry: Geometry) -> Vec<Geometry> {
        let around = Envelope::of(&geometry);
        // Most features lie inside as a whole.
        if self.and(around) == *self {
            return vec![geometry];
        }
        match shape {
            GeometryType::Point => Vec::new(),
            GeometryType::Line | GeometryType::LineZ => {
                geometry.iter().flat_map(|line| self.clip_line(line)).map(|line| vec![line]).collect()
            }
            GeometryType::Polygon => self.clip_polygon(geometry),
        }
    }

    fn clip_line(&self, line: &[[f64; 3]]) -> Vec<Vec<[f64; 3]>> {
        let mut parts: Vec<Vec<[f64; 3]>> = Vec::new();
        for pair in line.windows(2) {
            let Some([from, to]) = self.clip_segment(pair[0], pair[1]) else { continue };
            match parts.last_mut().filter(|part| part[part.len() - 1] == from && self.holds(&pair[0])) {
                Some(part) => part.push(to),
                None => parts.push(vec![from, to]),
            }
        }
        // A line that only touches the edge leaves a single point there: drop it.
        parts.retain(|part| part.iter().any(|point| *point != part[0]));
        parts
    }

    /// Returns the part of a straight line that lies inside.
    fn clip_segment(&self, from: [f64; 3], to: [f64; 3]) -> Option<[[f64; 3]; 2]> {
        let flat = |[x, y, _]: [f64; 3]| [x, y];
        let [first, last] = LineSegment::between(flat(from), flat(to)).clipped(self.min, self.max)?;
        let end = |end: ClippedEnd, whole| end.edge.map_or(whole, |(axis, bound)| crossing(from, to, axis, bound));
        Some([end(first, from), end(last, to)])
    }

    fn clip_polygon(&self, rings: Geometry) -> Vec<Geometry> {
        // Drop the last point of each ring, which repeats the first one.
        let mut rings: Vec<Vec<[f64; 3]>> = rings
            .into_iter()
            .map(|mut ring| {
                ring.pop();
                ring
            })
            .collect();
        // Clip at the eastern and the western edge, then at the northern and the southern one.
        for axis in 0..2 {
            rings = Half { axis, bound: self.max[axis], below: true }.clip(rings);
            rings = Half { axis, bound: self.min[axis], below: false }.clip(rings);
        }
        let closed = |mut ring: Vec<[f64; 3]>| {
            ring.dedup();
            ring.push(ring[0]);
            ring
        };
        let rings: Vec<Vec<[f64; 3]>> = rings.into_iter().map(closed).filter(|ring| ring.len() > 3).collect();
        // Islands run clockwise. An island lies in the ring that holds any of its points.
        let (outer, islands): (Vec<_>, Vec<_>) =
            rings.into_iter().filter(|ring| doubled_area(ring) != 0.0).partition(|ring| doubled_area(ring) > 0.0);
        let mut polygons: Vec<Geometry> = outer.into_iter().map(|ring| vec![ring]).collect();
        for island in islands {
            if let Some(polygon) = polygons.iter_mut().find(|polygon| holds(&polygon[0], island[0])) {
                polygon.push(island);
            }
        }
        polygons
    }
}

/// Returns the point where a straight line crosses a bound. The line must cross it.
fn crossing(from: [f64; 3], to: [f64; 3], axis: usize, bound: f64) -> [f64; 3] {
    let share = (bound - from[axis]) / (to[axis] - from[axis]);
    let mut at = [0, 1, 2].map(|axis| from[axis] + (to[axis] - from[axis]) * share);
    // Set the coordinate to the bound, so that rounding cannot move the point off the edge.
    at[axis] = bound;
    at
}

/// Returns twice the area of a closed ring, positive if it runs anticlockwise.
fn doubled_area(ring: &[[f64; 3]]) -> f64 {
    // Measure from the first point: far from the origin, rounding of the products would swallow the area.
    let [x0, y0, _] = ring[0];
    ring.windows(2).map(|pair| (pair[0][0] - x0) * (pair[1][1] - y0) - (pair[1][0] - x0) * (pair[0][1] - y0)).sum()
}

/// Tells whether a closed ring is around a point.
fn holds(ring: &[[f64; 3]], [x, y, _]: [f64; 3]) -> bool {
    let crosses = |pair: &&[[f64; 3]]| {
        let ([ax, ay, _], [bx, by, _]) = (pair[0], pair[1]);
        (ay > y) != (by > y) && x < ax + (bx - ax) * (y - ay) / (by - ay)
    };
    ring.windows(2).filter(crosses).count() % 2 == 1
}

/// A half-plane: all points whose coordinate `axis` lies on one side of `bound`.
struct Half {
    axis: usize,
    bound: f64,
    below: bool,
}

/// A part of a ring inside the half-plane, from the point where it comes in to the point where it goes out.
struct Chain {
    points: Vec<[f64; 3]>,
    /// The chain with which the clipped ring goes on, along the bound.
    next: Option<usize>,
}

impl Half {
    fn has(&self, point: [f64; 3]) -> bool {
        if self.below { point[self.axis] <= self.bound } else { point[self.axis] >= self.bound }
    }

    /// Clips rings, which are given without the repeated first point, and closes them along the bound. The land of a
    /// polygon is on the left of all its rings, and stays there: where a ring goes out, the clipped ring follows the
    /// bound to the next place where a ring comes in.
    fn clip(&self, rings: Vec<Vec<[f64; 3]>>) -> Vec<Vec<[f64; 3]>> {
        let (mut whole, mut chains): (Vec<_>, Vec<Chain>) = (Vec::new(), Vec::new());
        for ring in rings {
            let inside: Vec<bool> = ring.iter().map(|point| self.has(*point)).collect();
            let count = ring.len();
            let Some(start) = (0..count).find(|at| !inside[*at] && inside[(at + 1) % count]) else {
                // The ring lies inside or outside as a whole.
                whole.extend(inside[0].then_some(ring));
                continue;
            };
            let mut chain: Option<Vec<[f64; 3]>> = None;
            for step in 0..count {
                let (at, next) = ((start + step) % count, (start + step + 1) % count);
                match (inside[at], inside[next]) {
                    (false, true) => {
                        chain = Some(vec![crossing(ring[at], ring[next], self.axis, self.bound), ring[next]]);
                    }
                    (true, true) => chain.as_mut().expect("it came in").push(ring[next]),
                    (true, false) => {
                        let mut points = chain.take().expect("it came in");
                        points.push(crossing(ring[at], ring[next], self.axis, self.bound));
                        chains.push(Chain { points, next: None });
                    }
                    (false, false) => {}
                }
            }
        }
        self.link(&mut chains);
        whole.extend(rings_of(chains));
        whole
    }

    fn link(&self, chains: &mut [Chain]) {
        // The direction along the bound that has the inside on the left: north on an eastern bound, west on a northern
        // one, and so on.
        let forward = if self.below == (self.axis == 0) { 1.0 } else { -1.0 };
        let along = |point: [f64; 3]| forward * point[1 - self.axis];
        let mut ends: Vec<(f64, bool, usize)> = Vec::new();
        for (number, chain) in chains.iter().enumerate() {
            ends.push((along(chain.points[chain.points.len() - 1]), false, number));
            ends.push((along(chain.points[0]), true, number));
        }
        // At the same place, a ring goes out before another one comes in.
        ends.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        let mut out: Vec<usize> = Vec::new();
        for (_, comes_in, number) in ends {
            match comes_in {
                false => out.push(number),
                true => {
                    if let Some(before) = out.pop() {
                        chains[before].next = Some(number);
                    }
                }
            }
        }
    }
}

/// Joins chains to rings.
fn rings_of(mut chains: Vec<Chain>) -> Vec<Vec<[f64; 3]>> {
    let mut rings = Vec::new();
    for start in 0..chains.len() {
        let mut ring = std::mem::take(&mut chains[start].points);
        let mut next = chains[start].next;
        while let Some(number) = next.filter(|number| *number != start) {
            ring.append(&mut chains[number].points);
            next = chains[number].next.take();
        }
        // A chain that became part of an earlier ring is empty.
        if !ring.is_empty() {
            rings.push(ring);
        }
    }
    rings
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNIT: Envelope = Envelope { min: [0.0, 0.0], max: [10.0, 10.0] };

    fn ring(points: &[[f64; 2]]) -> Vec<[f64; 3]> {
        points.iter().chain([&points[0]]).map(|[x, y]| [*x, *y, 0.0]).collect()
    }

    fn area(polygons: &[Geometry]) -> f64 {
        polygons.iter().flatten().map(|ring| doubled_area(ring) / 2.0).sum()
    }

    #[test]
    fn lines_are_cut_where_they_cross_the_edge() {
        let line = |points: &[[f64; 3]]| UNIT.clip(GeometryType::LineZ, vec![points.to_vec()]);
        let inside = [[1.0, 1.0, 5.0], [9.0, 2.0, 6.0]];
        assert_eq!(line(&inside), [vec![inside.to_vec()]]);
        // The line comes in, goes out and comes in again; heights at the edge are interpolated.
        let parts = line(&[[-10.0, 5.0, 0.0], [5.0, 5.0, 15.0], [5.0, 15.0, 25.0], [8.0, 15.0, 0.0], [8.0, 5.0, 10.0]]);
        let expected = [
            vec![vec![[0.0, 5.0, 10.0], [5.0, 5.0, 15.0], [5.0, 10.0, 20.0]]],
            vec![vec![[8.0, 10.0, 5.0], [8.0, 5.0, 10.0]]],
        ];
        assert_eq!(parts, expected);
        // Lines across a corner, past a corner, along an edge, and touching an edge.
        assert_eq!(line(&[[-1.0, 2.0, 0.0], [2.0, -1.0, 0.0]]), [vec![vec![[0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]]]);
        assert!(line(&[[-3.0, 2.0, 0.0], [2.0, -3.0, 0.0]]).is_empty());
        assert_eq!(line(&[[10.0, -5.0, 0.0], [10.0, 5.0, 0.0]]), [vec![vec![[10.0, 0.0, 0.0], [10.0, 5.0, 0.0]]]]);
        assert!(line(&[[-5.0, 5.0, 0.0], [0.0, 5.0, 0.0], [-5.0, 6.0, 0.0]]).is_empty());
        assert!(UNIT.clip(GeometryType::Point, vec![vec![[11.0, 0.0, 0.0]]]).is_empty());
    }

    #[test]
    fn polygons_are_closed_along_the_edge() {
        let around =
            UNIT.clip(GeometryType::Polygon, vec![ring(&[[-5.0, -5.0], [15.0, -5.0], [15.0, 15.0], [-5.0, 15.0]])]);
        assert_eq!((around.len(), area(&around)), (1, 100.0));
        // Only the teeth of the comb are inside: three polygons.
        let comb = [
            [12.0, 1.0],
            [5.0, 1.5],
            [12.0, 2.0],
            [12.0, 4.0],
            [5.0, 4.5],
            [12.0, 5.0],
            [12.0, 7.0],
            [5.0, 7.5],
            [12.0, 8.0],
            [13.0, 8.0],
            [13.0, 1.0],
        ];
        let mut comb = ring(&comb);
        comb.reverse();
        let sign = doubled_area(&comb).signum();
        if sign < 0.0 {
            comb.reverse();
        }
        let teeth = UNIT.clip(GeometryType::Polygon, vec![comb]);
        assert_eq!(teeth.len(), 3);
        // An island that the edge cuts becomes a bay, an island inside stays, and one outside is gone.
        let lake = ring(&[[-5.0, 2.0], [9.0, 2.0], [9.0, 8.0], [-5.0, 8.0]]);
        let island = |x: f64| {
            let mut island = ring(&[[x, 4.0], [x + 2.0, 4.0], [x + 2.0, 6.0], [x, 6.0]]);
            island.reverse();
            island
        };
        let cut = UNIT.clip(GeometryType::Polygon, vec![lake, island(-1.0), island(3.0), island(-4.0)]);
        assert_eq!((cut.len(), cut[0].len(), area(&cut)), (1, 2, 54.0 - 2.0 - 4.0));
        for polygon in &cut {
            assert!(polygon.iter().all(|ring| ring[0] == ring[ring.len() - 1]));
        }
    }

    #[test]
    fn a_polygon_has_the_area_that_is_inside_it_whatever_its_shape() {
        // Stars around random places. The area inside is counted by sample points.
        for seed in 0..40_u64 {
            let random = |at: u64| (crate::hash::combine(seed, at) % 1000) as f64 / 1000.0;
            let middle = [random(1) * 14.0 - 2.0, random(2) * 14.0 - 2.0];
            let points: Vec<[f64; 2]> = (0..24)
                .map(|spoke| {
                    let (angle, reach) =
                        (f64::from(spoke as u32) * std::f64::consts::TAU / 24.0, 1.0 + 9.0 * random(10 + spoke));
                    [middle[0] + reach * angle.cos(), middle[1] + reach * angle.sin()]
                })
                .collect();
            let star = ring(&points);
            let clipped = UNIT.clip(GeometryType::Polygon, vec![star.clone()]);
            let side = 400;
            let counted = (0..side * side)
                .filter(|at| {
                    let place = |at: i32| (f64::from(at) + 0.5) * 10.0 / f64::from(side);
                    holds(&star, [place(at % side), place(at / side), 0.0])
                })
                .count();
            let counted = counted as f64 * 100.0 / f64::from(side * side);
            assert!((area(&clipped) - counted).abs() < 0.3, "{seed}: {} and {counted}", area(&clipped));
        }
    }
}
