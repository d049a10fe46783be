//! Sand seas: the parts of deserts where wind has gathered sand.
//!
//! On Earth they are a fifth of the dry land, with edges that one can stand on (N. Lancaster, Geomorphology of desert
//! dunes, 1995).

use super::LandAtLarge;
use super::climate::PlaceClimate;
use super::turned_noise::TurnedNoise;
use crate::geometry::smooth;
use crate::grain_point::Point;
use crate::hash::{self, Stream};
use crate::noise::point_noise::PointField;

/// Distance in metres from one sand sea to the next, about, and octaves of their outlines, down to bays of 4 km.
const APART_M: f64 = 260e3;
const OCTAVES: u32 = 7;

/// Droughts at which sand begins to stay bare and at which all of it does; see [`PlaceClimate::drought`]. A warm desert
/// with 120 mm of rain a year has 14.
const BARE: [f64; 2] = [8.0, 14.0];

/// Uplifts at which sand begins to keep away and at which there is none: it gathers on plains and in basins.
const HILLY: [f64; 2] = [0.045, 0.1];

/// Noise at which a sand sea begins, which leaves a fifth of the driest plains to them; and rise of the noise from there
/// to the deepest sand.
const FROM: f64 = -0.02;
const OVER: f64 = 0.35;

/// Noise that must make up for a place that is not wholly a dry plain.
const UNLIKELY: f64 = 0.5;

/// The sand seas of a world.
#[derive(Debug)]
pub struct SandSeas {
    gathers: TurnedNoise,
}

impl SandSeas {
    /// Makes the sand seas of a world with so many metres a grain.
    pub fn new(metres_a_grain: f64, seed: u64) -> SandSeas {
        let seed = hash::stream(seed, Stream::Sand);
        SandSeas { gathers: TurnedNoise::new(APART_M / metres_a_grain, OCTAVES, 0.55, seed) }
    }

    /// Returns the sand at a place, from 0 outside sand seas to 1 where it is deepest.
    pub fn sand(&self, at: Point, land: &LandAtLarge, climate: &PlaceClimate) -> f64 {
        let rises = |value: f64, [from, to]: [f64; 2]| smooth((value - from) / (to - from));
        let flat = 1.0 - rises(land.uplift, HILLY);
        if flat == 0.0 || land.continent < 0.0 {
            return 0.0;
        }
        let fits = flat * rises(climate.drought(land.planned_m()), BARE);
        // The noise takes longest, so it is asked last.
        if fits == 0.0 {
            return 0.0;
        }
        ((self.gathers.at(at) - FROM - UNLIKELY * (1.0 - fits)) / OVER).clamp(0.0, 1.0)
    }
}
