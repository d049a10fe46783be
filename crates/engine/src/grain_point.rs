//! Points on a lattice finer than that of the vertices.

use glam::DVec2;

use crate::hash::{self, Draw};

/// Grains from one vertex to the next: points of networks stand on a lattice this much finer than that of the vertices.
///
/// As whole numbers, points are exact anywhere in the world, and so are differences of neighbouring points in `f32`.
pub const GRAINS: i64 = 256;

/// A place in the world in grains, east and south of the origin.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Point {
    /// Grains east.
    pub x: i64,
    /// Grains south.
    pub y: i64,
}

impl Point {
    /// Returns the point at a vertex.
    pub const fn at_vertex(x: i64, y: i64) -> Point {
        Point { x: x * GRAINS, y: y * GRAINS }
    }

    /// Returns the grains east and south from `origin` to this point: exact.
    pub fn from(self, origin: Point) -> DVec2 {
        DVec2::new((self.x - origin.x) as f64, (self.y - origin.y) as f64)
    }

    /// Returns the point some grains east and south of this one, rounded to a grain.
    #[must_use]
    pub fn moved(self, by: DVec2) -> Point {
        Point { x: self.x + round(by.x), y: self.y + round(by.y) }
    }

    /// Returns the point at a share of the straight way to another.
    #[must_use]
    pub fn towards(self, other: Point, share: f64) -> Point {
        self.moved(other.from(self) * share)
    }

    /// Returns the square around this point whose sides are `grains` away.
    pub fn square(self, grains: f64) -> [Point; 2] {
        padded([self; 2], grains)
    }

    /// Distance in grains to another point.
    pub fn distance(self, other: Point) -> f64 {
        other.from(self).length()
    }
}

/// Tells whether two rectangles, each given by its corners, have a point in common.
pub fn overlap(a: [Point; 2], b: [Point; 2]) -> bool {
    a[0].x <= b[1].x && a[1].x >= b[0].x && a[0].y <= b[1].y && a[1].y >= b[0].y
}

/// Returns the bounding box of points, padded by `grains` on each side; `None` without points.
pub fn around(points: impl IntoIterator<Item = Point>, grains: f64) -> Option<[Point; 2]> {
    let mut points = points.into_iter();
    let first = points.next()?;
    let [low, high] = points.fold([first; 2], |[low, high], at| {
        [Point { x: low.x.min(at.x), y: low.y.min(at.y) }, Point { x: high.x.max(at.x), y: high.y.max(at.y) }]
    });
    Some(padded([low, high], grains))
}

/// Returns a rectangle, given by its corners, padded by `grains` on each side.
pub fn padded([low, high]: [Point; 2], grains: f64) -> [Point; 2] {
    [low.moved(DVec2::splat(-grains)), high.moved(DVec2::splat(grains))]
}

/// Rounds to the nearest whole number, halves up.
#[inline]
fn round(value: f64) -> i64 {
    // Without `floor`, which compiles to a call if the target's features are unknown.
    let value = value + 0.5;
    let whole = value as i64;
    whole - i64::from(whole as f64 > value)
}

/// Steps from a node of a lattice to its eight neighbours, row by row.
pub const AROUND: [(i64, i64); 8] = [(-1, -1), (0, -1), (1, -1), (-1, 0), (1, 0), (-1, 1), (0, 1), (1, 1)];

/// Returns a random number from 0 to 1, 1 excluded, for an id of a lattice, a kind of draw, and a part of that draw.
pub fn chance(seed: u64, id: (i64, i64), draw: Draw, part: u64) -> f64 {
    hash::share(at_node(hash::combine(seed, draw.number(part)), id.0, id.1))
}

/// Hashes a node of a lattice.
fn at_node(seed: u64, x: i64, y: i64) -> u64 {
    hash::combine(hash::combine(seed, x as u64), y as u64)
}
