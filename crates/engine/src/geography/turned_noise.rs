//! Noise at points without a grain: each octave lies aslant to the one before.

use crate::grain_point::Point;
use crate::hash;
use crate::noise::point_noise::{PointField, PointNoise};

/// Smooth noise from -1 to 1, as [`PointNoise`], but with octaves that are turned and shifted against each other.
///
/// All octaves of [`PointNoise`] are zero at the corners of its first octave's cells, and its steepest slopes lie along
/// the axes. At the size of a continent both show: coasts would run straight from corner to corner.
#[derive(Clone, Debug)]
pub struct TurnedNoise {
    octaves: Vec<TurnedOctave>,
}

#[derive(Clone, Debug)]
struct TurnedOctave {
    noise: PointNoise,
    /// Shift of the plane in grains, after it is turned.
    shift: Point,
    amplitude: f64,
}

/// Factor by which [`turned`] enlarges the plane: the root of 1.25.
const ENLARGED: f64 = 1.118_033_988_749_895;

/// Returns a point after the plane is turned by 27 degrees and enlarged, in whole numbers: exact anywhere.
#[inline(always)]
fn turned(Point { x, y }: Point) -> Point {
    Point { x: x + (y >> 1), y: y - (x >> 1) }
}

impl TurnedNoise {
    /// Makes noise whose first octave has a wavelength of `wavelength` grains. Each octave has half the wavelength of
    /// the one before, and `gain` times its amplitude.
    pub fn new(wavelength: f64, octaves: u32, gain: f64, seed: u64) -> TurnedNoise {
        let total: f64 = (0..octaves).map(|octave| gain.powi(octave as i32)).sum();
        let octave = |index: u32| {
            let seed = hash::combine(seed, u64::from(index));
            let wave = (wavelength * (ENLARGED / 2.0).powi(index as i32)).round().max(1.0) as i64;
            let shift = |axis: u64| (hash::share(hash::combine(seed, axis)) * wave as f64) as i64;
            TurnedOctave {
                noise: PointNoise::new(wave, 1, seed),
                shift: Point { x: shift(1), y: shift(2) },
                amplitude: gain.powi(index as i32) / total,
            }
        };
        TurnedNoise { octaves: (0..octaves).map(octave).collect() }
    }
}

impl PointField for TurnedNoise {
    #[inline(always)]
    #[allow(clippy::needless_range_loop, reason = "a loop over the places of arrays is what becomes vectors")]
    fn at_each<const N: usize>(&self, points: [Point; N]) -> [f64; N] {
        let (mut turned_points, mut sums) = (points, [0.0; N]);
        for octave in &self.octaves {
            let mut shifted = turned_points;
            for n in 0..N {
                shifted[n].x += octave.shift.x;
                shifted[n].y += octave.shift.y;
                turned_points[n] = turned(turned_points[n]);
            }
            let values = octave.noise.at_each(shifted);
            for n in 0..N {
                sums[n] += values[n] * octave.amplitude;
            }
        }
        sums
    }
}
