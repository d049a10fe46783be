//! Proof of a fractal's range, by interval arithmetic over the octaves.

use super::spec::FractalKind;

/// A closed interval.
#[derive(Clone, Copy, Debug)]
struct Interval(f64, f64);

impl Interval {
    fn times(self, other: Interval) -> Interval {
        let products = [self.0 * other.0, self.0 * other.1, self.1 * other.0, self.1 * other.1];
        Interval(
            products.into_iter().fold(f64::INFINITY, f64::min),
            products.into_iter().fold(f64::NEG_INFINITY, f64::max),
        )
    }

    fn plus(self, other: Interval) -> Interval {
        Interval(self.0 + other.0, self.1 + other.1)
    }

    /// Returns the range of the squares of the interval's values.
    fn squared(self) -> Interval {
        let (a, b) = (self.0 * self.0, self.1 * self.1);
        Interval(if self.0 <= 0.0 && self.1 >= 0.0 { 0.0 } else { a.min(b) }, a.max(b))
    }

    fn clamped(self, low: f64, high: f64) -> Interval {
        Interval(self.0.clamp(low, high), self.1.clamp(low, high))
    }

    fn magnitude(self) -> f64 {
        self.0.abs().max(self.1.abs())
    }
}

/// Share of the largest intermediate magnitude by which the range is widened for rounding: a few hundred roundings of
/// 2^-24.
const ROUNDING: f64 = 1.0 / 65536.0;

/// Returns the range of a fractal with these octave amplitudes, given that noise stays within -1 and 1.
pub(super) fn bounds(kind: FractalKind, amplitudes: &[f64]) -> (f32, f32) {
    let noise = Interval(-1.0, 1.0);
    let point = |value: f64| Interval(value, value);
    let mut value = point(0.0);
    let mut weight = point(1.0);
    let mut magnitude = 0.0_f64;
    for (octave, &amplitude) in amplitudes.iter().enumerate() {
        let scale = point(amplitude);
        let added = match kind {
            FractalKind::Fbm => noise.times(scale),
            FractalKind::Ridged { offset, gain } => {
                // noise| is from 0 to 1, so the ridge is from offset - 1 to offset.
                let signal = Interval(offset - 1.0, offset).squared().times(weight);
                weight = signal.times(point(gain)).clamped(0.0, 1.0);
                signal.times(scale)
            }
            FractalKind::Hybrid { offset } => {
                let signal = noise.plus(point(offset)).times(scale).times(weight);
                // The weight of the next octave is limited from above only, to 1.
                weight = signal.clamped(f64::NEG_INFINITY, 1.0);
                signal
            }
            FractalKind::Hetero { offset } if octave == 0 => noise.plus(point(offset)),
            FractalKind::Hetero { offset } => {
                // value + signal value, as one product: in a sum of two intervals the two values could differ.
                let grown = point(1.0).plus(noise.plus(point(offset)).times(scale)).times(value);
                value = point(0.0);
                grown
            }
        };
        // Intermediate values may be larger than the result, and so are their roundings.
        value = value.plus(added);
        magnitude = magnitude.max(value.magnitude()).max(added.magnitude());
        if let FractalKind::Ridged { offset, .. } | FractalKind::Hybrid { offset } | FractalKind::Hetero { offset } =
            kind
        {
            magnitude = magnitude.max(offset.abs() * amplitude);
        }
    }
    let margin = magnitude * ROUNDING;
    ((value.0 - margin) as f32, (value.1 + margin) as f32)
}
