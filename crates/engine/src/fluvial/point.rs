//! Points finer than the lattice of vertices, and what varies slowly from point to point.

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

/// A number from 0 to 1, 1 excluded, for each id of a lattice and each part of what is left to chance there.
pub fn chance(seed: u64, id: (i64, i64), draw: Draw, part: u64) -> f64 {
    hash::share(at_node(hash::combine(seed, draw.number(part)), id.0, id.1))
}

/// The hash of a node of a lattice.
fn at_node(seed: u64, x: i64, y: i64) -> u64 {
    hash::combine(hash::combine(seed, x as u64), y as u64)
}

/// Smooth noise from -1 to 1 at single points: octaves of gradient noise, each half as long and half as high.
///
/// For the few points of a network; rasters have [`Fractal`](crate::noise::Fractal). Based on: K. Perlin, Improving
/// Noise, 2002.
#[derive(Clone, Debug)]
pub struct PointNoise {
    octaves: Vec<PointOctave>,
}

#[derive(Clone, Debug)]
struct PointOctave {
    seed: u64,
    wavelength: i64,
    amplitude: f64,
}

impl PointNoise {
    /// Noise whose first octave is `wavelength` grains long.
    pub fn new(wavelength: i64, octaves: u32, seed: u64) -> PointNoise {
        let total: f64 = (0..octaves).map(|octave| 0.5f64.powi(octave as i32)).sum();
        let octave = |index: u32| PointOctave {
            seed: hash::combine(seed, index as u64),
            wavelength: (wavelength >> index).max(1),
            amplitude: 0.5f64.powi(index as i32) / total,
        };
        PointNoise { octaves: (0..octaves).map(octave).collect() }
    }

    /// The noise at a point.
    pub fn at(&self, point: Point) -> f64 {
        self.octaves.iter().fold(0.0, |sum, octave| sum + octave.at(point) * octave.amplitude)
    }
}

impl PointOctave {
    #[inline]
    fn at(&self, point: Point) -> f64 {
        let ((column, x), (cell_row, y)) = (self.cell(point.x), self.cell(point.y));
        // As `at_node` has it, but for each column once.
        let (west, east) = (self.column(column), self.column(column + 1));
        let corner = |column: u64, row: i64, x: f64, y: f64| {
            let [gx, gy] = GRADIENTS[(hash::combine(column, row as u64) >> 60) as usize];
            gx * x + gy * y
        };
        let fade = |t: f64| t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
        let (u, v) = (fade(x), fade(y));
        let row = |row: i64, y: f64| {
            let west = corner(west, row, x, y);
            west + (corner(east, row, x - 1.0, y) - west) * u
        };
        // A gradient's length brings the sum to within 1.
        let north = row(cell_row, y);
        north + (row(cell_row + 1, y - 1.0) - north) * v
    }

    /// The cell of the noise in which a place lies along an axis, and how far into it, 0 to 1.
    #[inline]
    fn cell(&self, at: i64) -> (i64, f64) {
        // As `div_euclid` and `rem_euclid` have it, which take as long as all else: nearly, and then exactly.
        let scale = 1.0 / self.wavelength as f64;
        let mut cell = (at as f64 * scale) as i64;
        let mut rest = at - cell * self.wavelength;
        while rest < 0 {
            (cell, rest) = (cell - 1, rest + self.wavelength);
        }
        while rest >= self.wavelength {
            (cell, rest) = (cell + 1, rest - self.wavelength);
        }
        (cell, rest as f64 * scale)
    }

    #[inline]
    fn column(&self, column: i64) -> u64 {
        hash::combine(self.seed, column as u64)
    }
}

/// Sixteen directions, as long as the square root of two: gradient noise of unit gradients stays within its half.
const GRADIENTS: [[f64; 2]; 16] = {
    const A: f64 = std::f64::consts::SQRT_2;
    const B: f64 = 1.306_562_964_876_376_5;
    const C: f64 = 0.541_196_100_146_197;
    [
        [A, 0.0],
        [B, C],
        [1.0, 1.0],
        [C, B],
        [0.0, A],
        [-C, B],
        [-1.0, 1.0],
        [-B, C],
        [-A, 0.0],
        [-B, -C],
        [-1.0, -1.0],
        [-C, -B],
        [0.0, -A],
        [C, -B],
        [1.0, -1.0],
        [B, -C],
    ]
};
