//! Points finer than the lattice of vertices.

use crate::geometry::length;
use crate::hash::{self, Draw};

/// Grains a vertex: points of networks stand on a lattice that much finer than that of the vertices.
///
/// As whole numbers they are exact anywhere, and so are the differences of neighbouring ones in `f32`.
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
    /// The point at a vertex.
    pub const fn at_vertex(x: i64, y: i64) -> Point {
        Point { x: x * GRAINS, y: y * GRAINS }
    }

    /// Grains east and south from `origin` to here: exact.
    pub fn from(self, origin: Point) -> [f64; 2] {
        [(self.x - origin.x) as f64, (self.y - origin.y) as f64]
    }

    /// The point some grains east and south of here, rounded to a grain.
    #[must_use]
    pub fn moved(self, [east, south]: [f64; 2]) -> Point {
        Point { x: self.x + round(east), y: self.y + round(south) }
    }

    /// Grains from here to another point.
    pub fn distance(self, other: Point) -> f64 {
        length(other.from(self))
    }
}

/// Whether two rectangles, each given by its corners, have a point in common.
pub fn overlap(a: [Point; 2], b: [Point; 2]) -> bool {
    a[0].x <= b[1].x && a[1].x >= b[0].x && a[0].y <= b[1].y && a[1].y >= b[0].y
}

/// The least rectangle around points, of which there is one at least, and so many grains more to each side.
pub fn around(points: impl IntoIterator<Item = Point>, grains: f64) -> Option<[Point; 2]> {
    let mut points = points.into_iter();
    let first = points.next()?;
    let [low, high] = points.fold([first; 2], |[low, high], at| {
        [Point { x: low.x.min(at.x), y: low.y.min(at.y) }, Point { x: high.x.max(at.x), y: high.y.max(at.y) }]
    });
    Some([low.moved([-grains; 2]), high.moved([grains; 2])])
}

/// To the nearest whole number, halves up.
#[inline]
fn round(value: f64) -> i64 {
    // Without `floor`, which is a call where nothing is known of the machine.
    let value = value + 0.5;
    let whole = value as i64;
    whole - i64::from(whole as f64 > value)
}

/// The ways from a node of a lattice to the eight around it, row by row.
pub const AROUND: [(i64, i64); 8] = [(-1, -1), (0, -1), (1, -1), (-1, 0), (1, 0), (-1, 1), (0, 1), (1, 1)];

/// A number from 0 to 1, 1 excluded, for each id of a lattice and each part of what is left to chance there.
pub fn chance(seed: u64, id: (i64, i64), draw: Draw, part: u64) -> f64 {
    hash::share(at_node(hash::combine(seed, draw.number(part)), id.0, id.1))
}

/// The hash of a node of a lattice.
fn at_node(seed: u64, x: i64, y: i64) -> u64 {
    hash::combine(hash::combine(seed, x as u64), y as u64)
}
