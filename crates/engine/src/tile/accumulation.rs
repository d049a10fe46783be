//! Flow accumulation: how much land drains through each vertex, from a bounded way upstream.
//!
//! Water parts among all lower neighbours, the more goes down a way the steeper that is, and is followed for so many steps and
//! no further. So a vertex depends on what lies within as many vertices and on nothing else: any window finds the same, to the
//! bit. On hillsides, which are shorter, that is all there is; what rivers bring from further away, those who know it add.
//!
//! Based on: P. Holmgren, "Multiple flow direction algorithms for runoff modelling in grid based elevation models", 1994.

use std::f32::consts::FRAC_1_SQRT_2;

use crate::area::Area;
use crate::grid::Grid;
use crate::simd::{Kernel, Simd, dispatch};

/// Steps from vertex to vertex for which water is followed.
pub(super) const STEPS: usize = 64;

/// The ways to the neighbours, east and south: as they are on the page.
const WAYS: [[i64; 2]; 8] = [[-1, -1], [0, -1], [1, -1], [-1, 0], [1, 0], [-1, 1], [0, 1], [1, 1]];

/// The area of land that the accumulation of an area is made of.
pub(super) const fn input(area: Area) -> Area {
    area.padded(STEPS + 1)
}

/// How many vertices' squares of land drain through each vertex of an area within [`STEPS`], its own among them.
///
/// `levels_m` are heights of the ground, or of the water on it. Hollows keep what comes to them.
///
/// # Panics
/// When `levels_m` does not hold the area's input.
pub(super) fn accumulation(levels_m: &Grid<f32>, area: Area) -> Grid<f32> {
    let wide = area.padded(STEPS);
    let mut shares = WAYS.map(|_| Grid::filled(wide, 0.0));
    dispatch(Part { levels_m, shares: &mut shares });
    let mut drained = Grid::filled(wide, 1.0);
    for left in (0..STEPS).rev() {
        let mut to = Grid::filled(area.padded(left), 0.0);
        dispatch(Step { shares: &shares, from: &drained, to: &mut to });
        drained = to;
    }
    drained
}

/// Parts the water of each vertex among its neighbours: by the fourth power of how steep the ways to them are.
struct Part<'a> {
    levels_m: &'a Grid<f32>,
    shares: &'a mut [Grid<f32>; 8],
}

impl Kernel for Part<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Area { x0, y0, x1, y1 } = self.shares[0].area();
        let width = (x1 - x0) as usize;
        let (zero, one, least) = (simd.splat(0.0), simd.splat(1.0), simd.splat(f32::MIN_POSITIVE));
        for y in y0..y1 {
            let levels = [y - 1, y, y + 1].map(|y| self.levels_m.row(y, x0 - 1, x1 + 1));
            let rows = self.shares.each_mut().map(|share| share.row_mut(y, x0, x1));
            let mut at = 0;
            while at < width {
                // The last vector overlaps the one before: the same values are written again.
                let from = at.min(width - S::LANES);
                at += S::LANES;
                let here = simd.load(&levels[1][from + 1..]);
                let mut falls = [zero; 8];
                let mut steepest = zero;
                let mut way = 0;
                while way < 8 {
                    let [east, south] = WAYS[way];
                    let there = simd.load(&levels[(south + 1) as usize][from + (east + 1) as usize..]);
                    let scale = if east != 0 && south != 0 { FRAC_1_SQRT_2 } else { 1.0 };
                    falls[way] = simd.max((here - there) * simd.splat(scale), zero);
                    steepest = simd.max(steepest, falls[way]);
                    way += 1;
                }
                // Of the steepest, so that no power is too small for a float.
                let whole = simd.max(steepest, least);
                let mut sum = zero;
                way = 0;
                while way < 8 {
                    let share = falls[way] / whole;
                    let square = share * share;
                    falls[way] = square * square;
                    sum = sum + falls[way];
                    way += 1;
                }
                // The steepest has 1 of it; where there is none, all have nothing.
                let sum = simd.max(sum, one);
                way = 0;
                while way < 8 {
                    simd.store(falls[way] / sum, &mut rows[way][from..]);
                    way += 1;
                }
            }
        }
    }
}

/// One step: what drains through a vertex is its own square, and what its neighbours send of what drains through them.
struct Step<'a> {
    shares: &'a [Grid<f32>; 8],
    from: &'a Grid<f32>,
    to: &'a mut Grid<f32>,
}

impl Kernel for Step<'_> {
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
                // The neighbour there sends it back the same way.
                sent[way] = self.shares[7 - way].row(y + south, x0 + east, x1 + east);
            }
            let to = self.to.row_mut(y, x0, x1);
            let mut at = 0;
            while at < width {
                let from = at.min(width - S::LANES);
                at += S::LANES;
                let mut drained = one;
                let mut way = 0;
                while way < 8 {
                    let [east, south] = WAYS[way];
                    let there = simd.load(&rows[(south + 1) as usize][from + (east + 1) as usize..]);
                    drained = drained + there * simd.load(&sent[way][from..]);
                    way += 1;
                }
                simd.store(drained, &mut to[from..]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn land(area: Area, height_m: impl Fn(i64, i64) -> f32) -> Grid<f32> {
        let mut heights = Grid::filled(area, 0.0);
        for (x, y) in area.vertices() {
            heights.row_mut(y, x, x + 1)[0] = height_m(x, y);
        }
        heights
    }

    #[test]
    fn a_plane_drains_straight_and_a_valley_gathers() {
        let area = Area::new(-9, 4, 18, 33);
        // It falls to the south: a vertex has those above it, but for what goes aslant, which comes as much from both sides.
        let plane = accumulation(&land(input(area), |_, y| -2.0 * y as f32), area);
        let expected = STEPS as f32 + 1.0;
        assert!(plane.values().iter().all(|drained| (drained - expected).abs() < 0.01), "{:?}", &plane.values()[..4]);
        // With sides, a valley has much more than they.
        let valley = accumulation(&land(input(area), |x, y| x.abs() as f32 - 0.5 * y as f32), area);
        assert!(valley.at(0, 20) > 20.0 * valley.at(8, 20), "{} and {}", valley.at(0, 20), valley.at(8, 20));
    }

    #[test]
    fn no_water_is_lost_or_made() {
        // A basin within the area: all that drains to its floor is the land within so many steps.
        let area = Area::new(-40, -40, 81, 81);
        let bowl = |x: i64, y: i64| (x * x + y * y).min(1600) as f32;
        let drained = accumulation(&land(input(area), bowl), area);
        let within = input(area).vertices().filter(|(x, y)| x * x + y * y <= 1600).count() as f32;
        // Beyond the rim it is level, and drains nowhere but over the rim.
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
        let mut heights = land(input(area).padded(3), |x, y| ((x * 7919 + y * 104_729) % 1013) as f32);
        let expected = accumulation(&heights, area);
        heights.fill_outside(input(area), f32::NAN);
        assert_eq!(accumulation(&heights, area), expected);
        assert_eq!(accumulation(&heights.part(input(area)), area), expected);
        // Another window has the same.
        let part = Area::new(-3, 10, 16, 16);
        assert_eq!(accumulation(&heights, part), expected.part(part));
    }
}
