//! Flow accumulation: how much land drains through each vertex, within a bounded distance upstream.
//!
//! The water of a vertex is divided among all lower neighbours; a steeper way gets more. It is followed for [`STEPS`]
//! steps and no further. So the value of a vertex depends only on the vertices within that distance, and any window
//! finds the same value, to the bit. Hillsides are shorter than that, so their values are complete; callers add what
//! rivers bring from further away.
//!
//! Based on: P. Holmgren, "Multiple flow direction algorithms for runoff modelling in grid based elevation models",
//! 1994.

use std::f32::consts::FRAC_1_SQRT_2;

use crate::area::Area;
use crate::grid::Grid;
use crate::simd::{Kernel, Simd, dispatch, starts};

/// Number of steps from vertex to vertex for which water is followed.
pub(super) const STEPS: usize = 64;

/// Offsets to the eight neighbours, east and south, row by row from the north-western one.
const WAYS: [[i64; 2]; 8] = [[-1, -1], [0, -1], [1, -1], [-1, 0], [1, 0], [-1, 1], [0, 1], [1, 1]];

/// Returns the area of heights that the accumulation of an area depends on.
pub(super) const fn input(area: Area) -> Area {
    area.padded(STEPS + 1)
}

/// Returns how many vertices drain through each vertex of an area within [`STEPS`] steps, itself included. A vertex
/// counts for the square of land around it.
///
/// `levels_m` are the heights of the ground, or of the water on it. Water that flows into a hollow stays there.
///
/// # Panics
/// When `levels_m` does not hold the area's [`input`].
pub(super) fn accumulation(levels_m: &Grid<f32>, area: Area) -> Grid<f32> {
    let wide = area.padded(STEPS);
    let mut shares = WAYS.map(|_| Grid::filled(wide, 0.0));
    dispatch(DivideWater { levels_m, shares: &mut shares });
    let mut drained = Grid::filled(wide, 1.0);
    for left in (0..STEPS).rev() {
        let mut to = Grid::filled(area.padded(left), 0.0);
        dispatch(PassWater { shares: &shares, from: &drained, to: &mut to });
        drained = to;
    }
    drained
}

/// Divides the water of each vertex among its neighbours, by the fourth power of the slopes towards them.
struct DivideWater<'a> {
    levels_m: &'a Grid<f32>,
    shares: &'a mut [Grid<f32>; 8],
}

impl Kernel for DivideWater<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Area { x0, y0, x1, y1 } = self.shares[0].area();
        let width = (x1 - x0) as usize;
        let (zero, one, least) = (simd.splat(0.0), simd.splat(1.0), simd.splat(f32::MIN_POSITIVE));
        for y in y0..y1 {
            let levels = [y - 1, y, y + 1].map(|y| self.levels_m.row(y, x0 - 1, x1 + 1));
            let mut rows = self.shares.each_mut().map(|share| share.row_mut(y, x0, x1));
            for from in starts(width, S::LANES) {
                let here = simd.load(&levels[1][from + 1..]);
                let mut falls = [zero; 8];
                let mut steepest = zero;
                for (way, [east, south]) in WAYS.into_iter().enumerate() {
                    let there = simd.load(&levels[(south + 1) as usize][from + (east + 1) as usize..]);
                    let scale = if east != 0 && south != 0 { FRAC_1_SQRT_2 } else { 1.0 };
                    falls[way] = simd.max((here - there) * simd.splat(scale), zero);
                    steepest = simd.max(steepest, falls[way]);
                }
                // Relative to the steepest slope, so that no power underflows.
                let whole = simd.max(steepest, least);
                let mut sum = zero;
                for fall in &mut falls {
                    let share = *fall / whole;
                    let square = share * share;
                    *fall = square * square;
                    sum = sum + *fall;
                }
                // The steepest way adds 1 to the sum; if no way goes down, all shares are 0.
                let sum = simd.max(sum, one);
                for (way, row) in rows.iter_mut().enumerate() {
                    simd.store(falls[way] / sum, &mut row[from..]);
                }
            }
        }
    }
}

/// One step: through each vertex drains its own square of land, and the shares that its neighbours send on.
struct PassWater<'a> {
    shares: &'a [Grid<f32>; 8],
    from: &'a Grid<f32>,
    to: &'a mut Grid<f32>,
}

impl Kernel for PassWater<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Area { x0, y0, x1, y1 } = self.to.area();
        let width = (x1 - x0) as usize;
        let one = simd.splat(1.0);
        for y in y0..y1 {
            let rows = [y - 1, y, y + 1].map(|y| self.from.row(y, x0 - 1, x1 + 1));
            let mut sent: [&[f32]; 8] = [&[]; 8];
            for (way, [east, south]) in WAYS.into_iter().enumerate() {
                // The neighbour's share for the opposite way, back to this vertex.
                sent[way] = self.shares[7 - way].row(y + south, x0 + east, x1 + east);
            }
            let to = self.to.row_mut(y, x0, x1);
            for from in starts(width, S::LANES) {
                let mut drained = one;
                for (way, [east, south]) in WAYS.into_iter().enumerate() {
                    let there = simd.load(&rows[(south + 1) as usize][from + (east + 1) as usize..]);
                    drained = drained + there * simd.load(&sent[way][from..]);
                }
                simd.store(drained, &mut to[from..]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plane_drains_straight_and_a_valley_gathers() {
        let area = Area::new(-9, 4, 18, 33);
        // The plane falls to the south: a vertex drains the vertices north of it; the diagonal shares of both sides
        // balance.
        let plane = accumulation(&Grid::of(input(area), |_, y| -2.0 * y as f32), area);
        let expected = STEPS as f32 + 1.0;
        assert!(plane.values().iter().all(|drained| (drained - expected).abs() < 0.01), "{:?}", &plane.values()[..4]);
        // A valley gathers much more than its sides.
        let valley = accumulation(&Grid::of(input(area), |x, y| x.abs() as f32 - 0.5 * y as f32), area);
        assert!(valley.at(0, 20) > 20.0 * valley.at(8, 20), "{} and {}", valley.at(0, 20), valley.at(8, 20));
    }

    #[test]
    fn no_water_is_lost_or_made() {
        // A basin within the area: all land within reach drains to its floor.
        let area = Area::new(-40, -40, 81, 81);
        let bowl = |x: i64, y: i64| (x * x + y * y).min(1600) as f32;
        let drained = accumulation(&Grid::of(input(area), bowl), area);
        let within = input(area).vertices().filter(|(x, y)| x * x + y * y <= 1600).count() as f32;
        // Beyond the rim the land is level: it drains only where it touches the rim.
        assert!(
            drained.at(0, 0) > 0.95 * within && drained.at(0, 0) < 1.1 * within,
            "{} of {within}",
            drained.at(0, 0)
        );
    }

    #[test]
    fn level_land_keeps_what_is_its_own() {
        let area = Area::new(0, 0, 16, 16);
        assert!(accumulation(&Grid::filled(input(area), 7.0), area).values().iter().all(|drained| *drained == 1.0));
    }

    #[test]
    fn nothing_outside_the_input_matters() {
        let area = Area::new(-3, 8, 17, 20);
        let mut heights = Grid::of(input(area).padded(3), |x, y| ((x * 7919 + y * 104_729) % 1013) as f32);
        let expected = accumulation(&heights, area);
        heights.fill_outside(input(area), f32::NAN);
        assert_eq!(accumulation(&heights, area), expected);
        assert_eq!(accumulation(&heights.part(input(area)), area), expected);
        // Another window finds the same values.
        let part = Area::new(-3, 10, 16, 16);
        assert_eq!(accumulation(&heights, part), expected.part(part));
    }
}
