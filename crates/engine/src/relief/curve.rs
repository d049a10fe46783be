//! Piecewise linear maps of a term's value, for plateaus, benches and cliffs.

#[cfg(feature = "gpu")]
use crate::relief::gpu_words::{CurveWords, RampWords};
#[cfg(feature = "gpu")]
use crate::wgsl::push;

/// A piecewise linear map, constant beyond its ends.
///
/// It is stored as a sum of ramps, which needs no search, so that all lanes do the same.
#[derive(Debug)]
pub(super) struct Curve {
    start: f32,
    ramps: Vec<Ramp>,
    bounds: (f32, f32),
}

#[derive(Debug)]
struct Ramp {
    from: f32,
    width: f32,
    slope: f32,
}

impl Curve {
    /// Creates the map through `points` of (in, out), sorted by their inputs.
    pub(super) fn new(points: &[[f64; 2]]) -> Curve {
        let ramp = |pair: &[[f64; 2]]| {
            let [[x0, y0], [x1, y1]] = [pair[0], pair[1]];
            Ramp { from: x0 as f32, width: (x1 - x0) as f32, slope: ((y1 - y0) / (x1 - x0)) as f32 }
        };
        let outs = || points.iter().map(|point| point[1] as f32);
        Curve {
            start: points[0][1] as f32,
            ramps: points.windows(2).map(ramp).collect(),
            bounds: (outs().fold(f32::INFINITY, f32::min), outs().fold(f32::NEG_INFINITY, f32::max)),
        }
    }

    /// Returns the lowest and the highest output.
    pub(super) fn bounds(&self) -> (f32, f32) {
        self.bounds
    }

    /// Packs the map.
    #[cfg(feature = "gpu")]
    pub(super) fn pack(&self, words: &mut Vec<u32>) {
        let Curve { start, ref ramps, bounds: (low, high) } = *self;
        push(words, CurveWords { start, low, high, ramps: ramps.len() as u32 });
        for Ramp { from, width, slope } in ramps {
            push(words, RampWords { begin: *from, width: *width, slope: *slope });
        }
    }

    /// Applies the map to each value.
    pub(super) fn apply(&self, values: &mut [f32]) {
        let (low, high) = self.bounds;
        for value in values {
            let climbed = self
                .ramps
                .iter()
                .fold(self.start, |sum, ramp| sum + (*value - ramp.from).clamp(0.0, ramp.width) * ramp.slope);
            // Rounding may make the sum of ramps miss the last point.
            *value = climbed.clamp(low, high);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curve_goes_through_its_points_and_is_level_beyond() {
        let curve = Curve::new(&[[-0.5, 1.0], [0.0, 3.0], [0.5, 3.0], [1.0, -2.0]]);
        let mut values = [-9.0, -0.5, -0.25, 0.0, 0.3, 0.75, 1.0, 7.0];
        curve.apply(&mut values);
        for (got, expected) in values.iter().zip([1.0, 1.0, 2.0, 3.0, 3.0, 0.5, -2.0, -2.0]) {
            assert!((got - expected).abs() < 1e-6, "{values:?}");
        }
        assert_eq!(curve.bounds(), (-2.0, 3.0));
    }
}
