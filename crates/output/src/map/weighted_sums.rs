//! Weighted sums of rows of numbers, in SIMD lanes.

use crate::area::Area;
use crate::grid::Grid;
use crate::simd::{Kernel, Simd, dispatch};

/// Sets each number of `out` to the weighted sum of the numbers in its column, added from the first row to the last.
pub(super) fn weigh<const N: usize>(rows: [&[f32]; N], weights: [f32; N], out: &mut [f32]) {
    let count = out.len();
    // All slices have the length of `out`, so the loop needs no bounds check.
    dispatch(WeightedSum { rows: rows.map(|row| &row[..count]), weights, out });
}

struct WeightedSum<'a, const N: usize> {
    rows: [&'a [f32]; N],
    weights: [f32; N],
    out: &'a mut [f32],
}

impl<const N: usize> Kernel for WeightedSum<'_, N> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let count = self.out.len();
        let mut at = 0;
        while at + S::LANES <= count {
            let mut sum = simd.load(&self.rows[0][at..]) * simd.splat(self.weights[0]);
            let mut row = 1;
            while row < N {
                sum = sum + simd.load(&self.rows[row][at..]) * simd.splat(self.weights[row]);
                row += 1;
            }
            simd.store(sum, &mut self.out[at..]);
            at += S::LANES;
        }
        while at < count {
            let mut sum = self.rows[0][at] * self.weights[0];
            let mut row = 1;
            while row < N {
                sum += self.rows[row][at] * self.weights[row];
                row += 1;
            }
            self.out[at] = sum;
            at += 1;
        }
    }
}

/// The two-scale mask of a cubic B-spline: 1, 4, 6, 4 and 1 sixteenths.
const KNOTS: [f32; 5] = [0.0625, 0.25, 0.375, 0.25, 0.0625];

/// Smooths a grid by a cubic B-spline whose knots are `2 * step` apart, within an area that keeps `2 * step` off its
/// edges.
pub(super) fn smoothed(grid: &Grid<f32>, area: Area, step: i64) -> Grid<f32> {
    let tall = Area { y0: grid.area().y0, y1: grid.area().y1, ..area };
    let mut across = Grid::filled(tall, 0.0);
    for y in tall.y0..tall.y1 {
        let rows = [-2, -1, 0, 1, 2].map(|by| grid.row(y, area.x0 + by * step, area.x1 + by * step));
        weigh(rows, KNOTS, across.row_mut(y, area.x0, area.x1));
    }
    let mut down = Grid::filled(area, 0.0);
    for y in area.y0..area.y1 {
        let rows = [-2, -1, 0, 1, 2].map(|by| across.row(y + by * step, area.x0, area.x1));
        weigh(rows, KNOTS, down.row_mut(y, area.x0, area.x1));
    }
    down
}
