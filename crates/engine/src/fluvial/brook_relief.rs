//! The rest: the mean relief that channels finer than the shown ones add to the land between them.
//!
//! Without its brooks, a valley side would rise straight to the divide. With them it rises to their beds, and on beside
//! them: first as steep as a hillside, then as steep as a brook, with the land between the brooks at a mean height
//! above their beds. Land under water stays as it is, so that shores keep their place.

use super::fields::{Fields, most_area};
use super::laws::Laws;
use super::valley::InRows;
use crate::simd::Simd;

/// Mean distance from a place to the nearest channel of a level, in that level's cells. Fitted to land with all
/// channels: of the values from 0.15 to 0.4, the one with the least bias in seven presets at strides of 8 to 64.
const NEAREST: f64 = 0.28;

/// Metres added to a divisor that may be zero.
const LEAST_M: f32 = 1e-3;

/// The mean relief at nodes beside the finest shown channels.
#[derive(Debug)]
pub struct Rest {
    /// Slope of the brooks, as a share of the hillside's.
    pub slope: Vec<f32>,
    /// Mean height in metres of the land above the brooks.
    pub height_m: Vec<f32>,
}

impl Rest {
    /// Returns the metres that the land rises at a node where a valley side alone would rise `risen_m`.
    pub fn risen_m(&self, node: usize, risen_m: f32) -> f32 {
        let above_m = risen_m * (1.0 - self.slope[node]);
        risen_m - above_m * above_m / (above_m + self.height_m[node] + LEAST_M)
    }
}

/// The mean relief at one place.
#[derive(Clone, Copy, Debug)]
pub struct RestLaw {
    /// Slope of the brooks, as a share of the hillside's.
    pub slope: f64,
    /// Mean height in metres of the land above the brooks.
    pub height_m: f64,
}

impl RestLaw {
    /// Makes the law for land between channels of `levels` levels, by the laws of the place.
    pub fn new(fields: &Fields, laws: &Laws, levels: u32) -> RestLaw {
        let hill_slope = laws.hill_slope;
        let cell_m = |level: u32| fields.side(level) as f64 * fields.metres_a_grain();
        let nearest_m = |level: u32| NEAREST * cell_m(level) / laws.brook_density(fields, level).sqrt();
        // The slope of a channel at the place through which half of its area drains.
        let slope = |level: u32| laws.river_slope(most_area(level) / 2.0).min(hill_slope);
        let finest = fields.levels() - 1;
        let mut height_m = hill_slope * nearest_m(finest);
        for level in (levels..finest).rev() {
            height_m += slope(level + 1) * nearest_m(level);
        }
        RestLaw { slope: slope(levels) / hill_slope, height_m }
    }
}

/// The law in lanes.
#[derive(Clone, Copy)]
pub struct LaneRest<S: Simd> {
    left: S::F32,
    height_m: S::F32,
}

impl<S: Simd> LaneRest<S> {
    #[inline(always)]
    pub fn splat(simd: S, [slope, height_m]: [f32; 2]) -> LaneRest<S> {
        LaneRest { left: simd.splat(1.0 - slope), height_m: simd.splat(height_m) }
    }

    #[inline(always)]
    pub fn load(simd: S, lanes: InRows, rest: &Rest) -> LaneRest<S> {
        let left = simd.splat(1.0) - lanes.load(simd, &rest.slope);
        LaneRest { left, height_m: lanes.load(simd, &rest.height_m) }
    }

    /// Returns the rise of the land in metres beside a channel where its side alone would rise `risen`, of which `open`
    /// lies under water: at the water as steep as the side, and further away as steep as the brooks, at a mean height
    /// above them.
    #[inline(always)]
    pub fn risen(&self, simd: S, open: S::F32, risen: S::F32) -> S::F32 {
        let above = simd.max(risen - open, simd.splat(0.0)) * self.left;
        risen - above * above / (above + self.height_m + simd.splat(LEAST_M))
    }
}
