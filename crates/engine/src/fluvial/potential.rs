//! The potential of a world with rivers: water flows from high potential to low.

use std::sync::Arc;

use crate::geography::Geography;
use crate::grain_point::Point;
use crate::hash::Stream;
use crate::noise::point_noise::{PointField, PointNoise, rounded};

/// Wavelengths of the bends of shores, as shares of the size of a basin; bends shorter than `LEAST_BEND` steps of
/// the lattice by which rasters know the shore are left out. Then their octaves, and their greatest displacement as a
/// share of their own wavelength: with a larger one the plane would fold in more than a few places.
const BEND_WAVES: [f64; 3] = [0.03125, 0.125, 0.5];
const LEAST_BEND: f64 = 8.0;
const BEND_OCTAVES: u32 = 2;
const MOST_BEND: f64 = 0.4;

/// Random streams of the bends, east and south, the short bends first.
const BEND_STREAMS: [[Stream; 2]; 3] = [
    [Stream::LeastCoastEast, Stream::LeastCoastSouth],
    [Stream::ShortCoastEast, Stream::ShortCoastSouth],
    [Stream::CoastEast, Stream::CoastSouth],
];

/// A potential from about -1 to 1.
#[derive(Debug)]
pub struct Potential {
    at_large: PotentialAtLarge,
    /// Displacements of the plane that make shores jagged. A displaced potential has no hollows that it did not have
    /// before. More octaves of the potential itself would make dozens, and each would be a sea without an outlet.
    bends: Vec<PlaneDisplacement>,
}

/// The potential before the plane is displaced.
#[derive(Debug)]
pub enum PotentialAtLarge {
    /// Noise, with basins of one size everywhere.
    Noise(PointNoise),
    /// The continents of a geography.
    Continents(Arc<Geography>),
}

/// A displacement of the plane that does not fold it.
#[derive(Debug)]
struct PlaneDisplacement {
    /// Displacement east and south, as a share of `most`.
    axes: [PointNoise; 2],
    /// Greatest displacement of a place in grains.
    most: f64,
}

impl Potential {
    /// Makes a potential without shores.
    pub fn smooth(noise: PointNoise) -> Potential {
        Potential { at_large: PotentialAtLarge::Noise(noise), bends: Vec::new() }
    }

    /// Makes a potential with shores from: the size of its basins and the step of the lattice by which rasters
    /// know the shore, both in metres; the metres a grain; and `of`, which makes noise of a wavelength in metres, with
    /// so many octaves.
    pub fn with_shores(
        at_large: PotentialAtLarge,
        [basin_m, step_m, metres_a_grain]: [f64; 3],
        of: impl Fn(f64, u32, Stream) -> PointNoise,
    ) -> Potential {
        let waves_m = BEND_WAVES.map(|share| share * basin_m);
        // The short bends first. Two bends in a row fold the plane no more than either of them does.
        let bends = waves_m.into_iter().zip(BEND_STREAMS);
        let bends = bends.filter(|(wave_m, _)| *wave_m >= LEAST_BEND * step_m);
        let bends = bends.map(|(wave_m, streams)| PlaneDisplacement {
            axes: streams.map(|stream| of(wave_m, BEND_OCTAVES, stream)),
            most: MOST_BEND * wave_m / metres_a_grain,
        });
        Potential { at_large, bends: bends.collect() }
    }
}

impl PointField for Potential {
    #[inline(always)]
    #[allow(clippy::needless_range_loop, reason = "a loop over the places of arrays is what becomes vectors")]
    fn at_each<const N: usize>(&self, points: [Point; N]) -> [f64; N] {
        let mut points = points;
        for PlaneDisplacement { axes: [east, south], most } in &self.bends {
            let (east, south) = (east.at_each(points), south.at_each(points));
            for n in 0..N {
                points[n].x += rounded(most * east[n]);
                points[n].y += rounded(most * south[n]);
            }
        }
        match &self.at_large {
            PotentialAtLarge::Noise(noise) => noise.at_each(points),
            PotentialAtLarge::Continents(geography) => geography.continents(points),
        }
    }
}
