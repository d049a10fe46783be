//! What an author says about the ground: which material lies where.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::recipe::HEIGHT_LIMIT_M;
use crate::recipe::fault::{Fault, KeyPath};

/// Which ground lies where: grass, with dirt and rock by slope, sand by height, snow by height and aspect.
///
/// Slope enters as the thesis has it, `slope_scale * (1 - n.up)` for the normal n, cut off at 1. With the thesis' scale
/// of 5, steepness 0.1 is a slope of 11 degrees, 0.5 is 26 and 1 is 37.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GroundSettings {
    /// What `1 - n.up` is multiplied by to give the steepness, 0.1 to 100. Default: 5.
    #[schemars(range(min = 0.1, max = 100))]
    #[serde(default = "thesis_slope_scale")]
    pub slope_scale: f64,
    /// Steepness at which dirt begins and at which it has taken the grass' place, 0 to 1. Default: [0.1, 0.5].
    #[schemars(inner(range(min = 0, max = 1)))]
    #[serde(default = "default_dirt")]
    pub dirt: [f64; 2],
    /// Steepness at which rock begins and at which all is rock, 0 to 1. Default: [0.4, 0.9].
    #[schemars(inner(range(min = 0, max = 1)))]
    #[serde(default = "default_rock")]
    pub rock: [f64; 2],
    /// Metres above the sea level up to which all is sand, and at which sand ends, -100,000 to 100,000; needs
    /// `sea_level_m`. Default: no sand.
    #[schemars(inner(range(min = -HEIGHT_LIMIT_M, max = HEIGHT_LIMIT_M)))]
    pub sand_m: Option<[f64; 2]>,
    /// Height in metres at which snow begins and at which all is snow, -100,000 to 100,000. Default: no snow.
    #[schemars(inner(range(min = -HEIGHT_LIMIT_M, max = HEIGHT_LIMIT_M)))]
    pub snow_m: Option<[f64; 2]>,
    /// Steepness at which snow begins to slide off and at which none is left, 0 to 1; needs `snow_m`. Default: [0.6, 1].
    #[schemars(inner(range(min = 0, max = 1)))]
    #[serde(default = "default_snow_slope")]
    pub snow_slope: [f64; 2],
    /// Metres by which snow reaches further down a slope of 45 degrees that faces north than down level ground, and less
    /// far down one that faces south, -2000 to 2000: below 0 the sun stands in the north. Needs `snow_m`. Default: 0.
    #[schemars(range(min = -2000, max = 2000))]
    #[serde(default)]
    pub snow_aspect_m: f64,
}

impl Default for GroundSettings {
    fn default() -> GroundSettings {
        GroundSettings {
            slope_scale: thesis_slope_scale(),
            dirt: default_dirt(),
            rock: default_rock(),
            sand_m: None,
            snow_m: None,
            snow_slope: default_snow_slope(),
            snow_aspect_m: 0.0,
        }
    }
}

impl GroundSettings {
    /// Finds the first value that does not go with others.
    pub(super) fn check(&self, path: &KeyPath) -> Result<(), Fault> {
        let ramps = [("dirt", Some(self.dirt)), ("rock", Some(self.rock)), ("snow_slope", Some(self.snow_slope))];
        for (key, ramp) in ramps.into_iter().chain([("sand_m", self.sand_m), ("snow_m", self.snow_m)]) {
            ramp.map_or(Ok(()), |ramp| path.key(key).rising(ramp))?;
        }
        Ok(())
    }
}

fn thesis_slope_scale() -> f64 {
    5.0
}

fn default_dirt() -> [f64; 2] {
    [0.1, 0.5]
}

fn default_rock() -> [f64; 2] {
    [0.4, 0.9]
}

fn default_snow_slope() -> [f64; 2] {
    [0.6, 1.0]
}
