//! Heights as whole numbers, so that all distances are exact.

use crate::area::Area;
use crate::grid::Grid;

/// Steps per metre. A power of two, so that scaling is exact; a quarter of a millimetre is the last bit of an `f32` at
/// 4 km.
const PER_METRE: f64 = 4096.0;

/// Largest height in metres, above or below zero. Together with [`MAX_CELLS`] it keeps every number in
/// `furthest_vertex.rs` below 2^53.
pub const MAX_HEIGHT_M: f32 = 65_535.0;

/// Largest number of cells per side.
pub const MAX_CELLS: u32 = 4096;

/// Heights of a square of vertices in steps, rounded to the nearest.
pub struct HeightSteps {
    side: usize,
    values: Vec<i32>,
}

impl HeightSteps {
    /// Converts the heights of the vertices of `area`.
    ///
    /// # Panics
    /// If the area is not a square of 1 to [`MAX_CELLS`] cells a side, reaches outside of `heights`, or holds
    /// a height that is not finite or beyond [`MAX_HEIGHT_M`].
    pub fn new(heights: &Grid<f32>, area: Area) -> HeightSteps {
        let side = area.width();
        assert_eq!(side, area.height(), "a surface is as wide as high");
        assert!((2..=MAX_CELLS as usize + 1).contains(&side), "{side} vertices a side are not 1 to {MAX_CELLS} cells");
        let mut values = Vec::with_capacity(side * side);
        for y in area.y0..area.y1 {
            let row = heights.row(y, area.x0, area.x1);
            // Adding and subtracting 1.5 * 2^52 rounds to whole numbers without an instruction that some CPUs lack.
            const ROUND: f64 = 6_755_399_441_055_744.0;
            values.extend(row.iter().map(|height_m| (*height_m as f64 * PER_METRE + ROUND - ROUND) as i32));
            // No branch, so that the loop can be vectorised. NaN fails the comparison too.
            let all_good = row.iter().fold(true, |good, height_m| good & (height_m.abs() <= MAX_HEIGHT_M));
            assert!(all_good, "a height in row {y} is not finite or beyond {MAX_HEIGHT_M} m");
        }
        HeightSteps { side, values }
    }

    /// Number of vertices per side.
    pub fn side(&self) -> usize {
        self.side
    }

    /// All heights, row by row.
    pub fn values(&self) -> &[i32] {
        &self.values
    }

    /// The height at a vertex.
    pub fn at(&self, [x, y]: [u32; 2]) -> i32 {
        self.values[y as usize * self.side + x as usize]
    }
}

/// Returns the largest distance in whole steps that keeps all heights within `bound_m` metres: rounding moves the
/// vertex by up to half a step, and the triangle by as much again. `None` if even zero steps are too many.
pub fn whole_steps(bound_m: f64) -> Option<f64> {
    // More than any two heights differ by, so it can stand for an infinite bound.
    const MOST: f64 = 2.0 * MAX_HEIGHT_M as f64 * PER_METRE;
    let steps = (bound_m * PER_METRE - 1.0).floor().min(MOST);
    (steps >= 0.0).then_some(steps)
}
