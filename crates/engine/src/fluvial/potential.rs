//! The potential of a world with rivers: water flows from where it is high to where it is low.

use super::point::Point;
use super::point_noise::{PointField, PointNoise, rounded};
use crate::hash::Stream;

/// Wavelengths of the bends of shores, as shares of the basins', but for those that are shorter than so many steps of the
/// lattice by which rasters know the shore; their octaves; and how far they go at most, as a share of their own wavelength:
/// further, and more than a few places would fold.
const BEND_WAVES: [f64; 3] = [0.03125, 0.125, 0.5];
const LEAST_BEND: f64 = 8.0;
const BEND_OCTAVES: u32 = 2;
const MOST_BEND: f64 = 0.4;

/// What gives bends their chance, east and south, the short ones first.
const BEND_STREAMS: [[Stream; 2]; 3] = [
    [Stream::LeastCoastEast, Stream::LeastCoastSouth],
    [Stream::ShortCoastEast, Stream::ShortCoastSouth],
    [Stream::CoastEast, Stream::CoastSouth],
];

/// A potential from -1 to 1.
#[derive(Debug)]
pub struct Potential {
    noise: PointNoise,
    /// How the plane is displaced, so that shores are not smooth. What is moved has no hollow that it had not, as octaves of its own
    /// would have by the dozen: each would be a sea without a way out.
    bends: Vec<Bend>,
}

/// A displacement of the plane that does not fold it.
#[derive(Debug)]
struct Bend {
    /// East and south, as shares of the most.
    axes: [PointNoise; 2],
    /// Grains by which a place is moved at most.
    most: f64,
}

impl Potential {
    /// Without shores.
    pub fn smooth(noise: PointNoise) -> Potential {
        Potential { noise, bends: Vec::new() }
    }

    /// With shores, given the length of its basins and a step of the lattice by which rasters know the shore in metres, metres a grain,
    /// and noise of a wavelength in metres and so many octaves.
    pub fn with_shores(
        noise: PointNoise,
        [basin_m, step_m, metres_a_grain]: [f64; 3],
        of: impl Fn(f64, u32, Stream) -> PointNoise,
    ) -> Potential {
        let waves_m = BEND_WAVES.map(|share| share * basin_m);
        // The short ones first: what is bent twice is folded no more than either folds.
        let bends = waves_m.into_iter().zip(BEND_STREAMS);
        let bends = bends.filter(|(wave_m, _)| *wave_m >= LEAST_BEND * step_m);
        let bends = bends.map(|(wave_m, streams)| Bend {
            axes: streams.map(|stream| of(wave_m, BEND_OCTAVES, stream)),
            most: MOST_BEND * wave_m / metres_a_grain,
        });
        Potential { noise, bends: bends.collect() }
    }
}

impl PointField for Potential {
    #[inline(always)]
    #[allow(clippy::needless_range_loop, reason = "a loop over the places of arrays is what becomes vectors")]
    fn at_each<const N: usize>(&self, points: [Point; N]) -> [f64; N] {
        let mut points = points;
        for Bend { axes: [east, south], most } in &self.bends {
            let (east, south) = (east.at_each(points), south.at_each(points));
            for n in 0..N {
                points[n].x += rounded(most * east[n]);
                points[n].y += rounded(most * south[n]);
            }
        }
        self.noise.at_each(points)
    }
}
