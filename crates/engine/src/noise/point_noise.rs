//! Slowly varying noise at single points, for the few points of a network; rasters use
//! [`Fractal`](crate::noise::Fractal).
//!
//! Eight points at once take less than half the time of eight points one by one, as they fit into one vector. No code
//! here names a vector type: loops over arrays are compiled to the vectors of each [level](crate::simd), so each level
//! computes the same bits.

use crate::grain_point::Point;
use crate::hash;
use crate::simd::{Kernel, Simd, dispatch};

/// Points that are evaluated together: as many doubles as the widest vectors hold.
const TOGETHER: usize = 8;

/// A function with one number for each point. Points that are evaluated together lie within 2^48 vertices.
pub trait PointField: Sized {
    /// Returns the values at some points. Always inlined, so that it is compiled for the caller's vectors.
    fn at_each<const N: usize>(&self, points: [Point; N]) -> [f64; N];

    /// Returns the value at a point.
    fn at(&self, point: Point) -> f64 {
        let [value] = self.at_each([point]);
        value
    }

    /// Returns the values at any number of points.
    fn at_all(&self, points: &[Point]) -> Vec<f64> {
        let mut values = vec![0.0; points.len()];
        dispatch(Fill { field: self, points, values: &mut values });
        values
    }
}

struct Fill<'a, F> {
    field: &'a F,
    points: &'a [Point],
    values: &'a mut [f64],
}

impl<F: PointField> Kernel for Fill<'_, F> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, _: S) {
        for (points, values) in self.points.chunks(TOGETHER).zip(self.values.chunks_mut(TOGETHER)) {
            let mut whole = [Point::default(); TOGETHER];
            whole[..points.len()].copy_from_slice(points);
            values.copy_from_slice(&self.field.at_each(whole)[..values.len()]);
        }
    }
}

/// Smooth noise from -1 to 1: octaves of gradient noise, each with half the wavelength and half the amplitude of the
/// one before.
///
/// Based on: K. Perlin, Improving Noise, 2002.
#[derive(Clone, Debug)]
pub struct PointNoise {
    octaves: Vec<PointOctave>,
}

#[derive(Clone, Debug)]
struct PointOctave {
    /// The octave's seed, already scattered for [`hash::combine`].
    key: u64,
    /// Grains a cell; `scale` is its inverse, in cells a grain.
    wavelength: i64,
    scale: f64,
    amplitude: f64,
}

impl PointNoise {
    /// Makes noise whose first octave has a wavelength of `wavelength` grains.
    pub fn new(wavelength: i64, octaves: u32, seed: u64) -> PointNoise {
        let total: f64 = (0..octaves).map(|octave| 0.5f64.powi(octave as i32)).sum();
        let octave = |index: u32| {
            let wavelength = (wavelength >> index).max(1);
            PointOctave {
                key: hash::scatter(hash::combine(seed, index as u64)),
                wavelength,
                scale: 1.0 / wavelength as f64,
                amplitude: 0.5f64.powi(index as i32) / total,
            }
        };
        PointNoise { octaves: (0..octaves).map(octave).collect() }
    }
}

impl PointField for PointNoise {
    #[inline(always)]
    fn at_each<const N: usize>(&self, points: [Point; N]) -> [f64; N] {
        let mut sums = [0.0; N];
        for octave in &self.octaves {
            octave.add(&points, &mut sums);
        }
        sums
    }
}

#[allow(clippy::needless_range_loop, reason = "a loop over the places of arrays is what becomes vectors")]
impl PointOctave {
    #[inline(always)]
    fn add<const N: usize>(&self, points: &[Point; N], sums: &mut [f64; N]) {
        let (mut x, mut y) = ([0; N], [0; N]);
        for n in 0..N {
            (x[n], y[n]) = (points[n].x, points[n].y);
        }
        let ((columns, x), (rows, y)) = (self.cells(x), self.cells(y));
        let mut is_one_cell = true;
        for n in 1..N {
            is_one_cell &= columns[n] == columns[0];
            is_one_cell &= rows[n] == rows[0];
        }
        let mut corners = [[[0.0; N]; 2]; 2];
        for east in 0..2 {
            for south in 0..2 {
                let off = |n: usize| [x[n] - east as f64, y[n] - south as f64];
                let corner = &mut corners[south][east];
                if is_one_cell {
                    // Hashing takes as long as all else together. Here all points share one hash.
                    let gradient = self.gradient(columns[0] + east as i64, rows[0] + south as i64);
                    for n in 0..N {
                        corner[n] = along(gradient, off(n));
                    }
                } else {
                    for n in 0..N {
                        corner[n] = along(self.gradient(columns[n] + east as i64, rows[n] + south as i64), off(n));
                    }
                }
            }
        }
        let [[north_west, north_east], [south_west, south_east]] = corners;
        for n in 0..N {
            let (u, v) = (fade(x[n]), fade(y[n]));
            // The length of the gradients brings the sum to within 1.
            let north = north_west[n] + (north_east[n] - north_west[n]) * u;
            let south = south_west[n] + (south_east[n] - south_west[n]) * u;
            sums[n] += (north + (south - north) * v) * self.amplitude;
        }
    }

    /// Returns the gradient at a corner of cells.
    #[inline(always)]
    fn gradient(&self, column: i64, row: i64) -> [f64; 2] {
        let column = hash::scatter(hash::with_number(self.key, column as u64));
        GRADIENTS[(hash::with_number(column, row as u64) >> 60) as usize]
    }

    /// Returns the cells of the noise in which places lie along an axis, and their positions in the cells, 0 to 1.
    #[inline(always)]
    fn cells<const N: usize>(&self, at: [i64; N]) -> ([i64; N], [f64; N]) {
        // Gives the results of `div_euclid` and `rem_euclid`, which would take as long as all else. The first place's
        // cell is estimated in two steps, as doubles cannot tell neighbouring cells apart at the end of the world; the
        // others are estimated from there; then each is corrected exactly.
        let far = (at[0] as f64 * self.scale) as i64;
        let first = far + ((at[0] - far * self.wavelength) as f64 * self.scale) as i64;
        let (mut cells, mut shares) = ([0; N], [0.0; N]);
        for n in 0..N {
            let rest = at[n] - first * self.wavelength;
            let near = nearest(rest as f64 * self.scale);
            let rest = rest - near * self.wavelength;
            let off = i64::from(rest >= self.wavelength) - i64::from(rest < 0);
            cells[n] = first + near + off;
            shares[n] = (rest - off * self.wavelength) as f64 * self.scale;
        }
        (cells, shares)
    }
}

/// Returns the whole number nearest to a number below 2^51. It adds a number so large that the sum has no fraction, and
/// reads the bits: a conversion also handles values that are no numbers, and is not compiled to vectors.
#[inline(always)]
fn nearest(value: f64) -> i64 {
    const LARGE: f64 = 1.5 * (1_u64 << 52) as f64;
    (value + LARGE).to_bits() as i64 - LARGE.to_bits() as i64
}

/// Rounds a number below 2^51 to the nearest whole number, halves up.
#[inline(always)]
pub fn rounded(value: f64) -> i64 {
    let value = value + 0.5;
    let whole = nearest(value);
    whole - i64::from(whole as f64 > value)
}

#[inline(always)]
fn along([gx, gy]: [f64; 2], [x, y]: [f64; 2]) -> f64 {
    gx * x + gy * y
}

#[inline(always)]
fn fade(t: f64) -> f64 {
    t * t * t * (t * (t * 6.0 - 15.0) + 10.0)
}

/// Sixteen directions with the length of the square root of two: gradient noise of unit gradients stays within the
/// inverse of that length.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::{Level, dispatch_at};

    /// The noise by its definition: one point at a time, with whole divisions.
    fn plain(noise: &PointNoise, seed: u64, point: Point) -> f64 {
        let octave = |(index, octave): (usize, &PointOctave)| {
            let seed = hash::combine(seed, index as u64);
            let cell =
                |at: i64| (at.div_euclid(octave.wavelength), at.rem_euclid(octave.wavelength) as f64 * octave.scale);
            let ((column, x), (row, y)) = (cell(point.x), cell(point.y));
            let corner = |east: i64, south: i64| {
                let hash = hash::combine(hash::combine(seed, (column + east) as u64), (row + south) as u64);
                let [gx, gy] = GRADIENTS[(hash >> 60) as usize];
                gx * (x - east as f64) + gy * (y - south as f64)
            };
            let across = |south: i64| corner(0, south) + (corner(1, south) - corner(0, south)) * fade(x);
            (across(0) + (across(1) - across(0)) * fade(y)) * octave.amplitude
        };
        noise.octaves.iter().enumerate().map(octave).fold(0.0, |sum, value| sum + value)
    }

    #[test]
    fn points_have_the_same_noise_alone_and_together_anywhere() {
        let far = 1 << 61;
        // Down to a wavelength of a grain: at the end of the world, doubles cannot tell two such cells apart.
        for wavelength in [1, 3, 1000, 655_360, 1 << 40] {
            let noise = PointNoise::new(wavelength, 3, 7);
            let around = |origin: i64| (-20..20).map(move |step| origin + step * (wavelength / 7).max(1));
            let xs: Vec<i64> = [0, 12_345, far, -far].into_iter().flat_map(around).collect();
            // Points on a diagonal, along a row and along a column of cells.
            let aslant = xs.iter().zip(xs.iter().rev()).map(|(x, y)| Point { x: *x, y: *y });
            let row = xs.iter().map(|x| Point { x: *x, y: 5 });
            let column = xs.iter().map(|y| Point { x: 5, y: *y });
            let points: Vec<Point> = aslant.chain(row).chain(column).collect();
            let expected: Vec<u64> = points.iter().map(|point| plain(&noise, 7, *point).to_bits()).collect();
            let alone: Vec<u64> = points.iter().map(|point| noise.at(*point).to_bits()).collect();
            assert_eq!(alone, expected, "{wavelength}");
            // The count need not fill whole vectors.
            for count in [points.len(), 3, 0] {
                let together: Vec<u64> = noise.at_all(&points[..count]).into_iter().map(f64::to_bits).collect();
                assert_eq!(together, expected[..count], "{wavelength}");
            }
            for level in Level::available() {
                let mut values = vec![0.0; points.len()];
                dispatch_at(level, Fill { field: &noise, points: &points, values: &mut values });
                assert!(values.iter().map(|value| value.to_bits()).eq(expected.iter().copied()), "{}", level.name());
            }
        }
    }
}
