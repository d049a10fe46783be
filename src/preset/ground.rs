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
    #[serde(default = "thesis_slope_scale")]
    pub slope_scale: f64,
    /// Steepness at which dirt begins and at which it has taken the grass' place. Default: [0.1, 0.5].
    #[serde(default = "default_dirt")]
    pub dirt: [f64; 2],
    /// Steepness at which rock begins and at which all is rock. Default: [0.4, 0.9].
    #[serde(default = "default_rock")]
    pub rock: [f64; 2],
    /// Metres above the sea level up to which all is sand, and at which sand ends. Default: no sand.
    pub sand_m: Option<[f64; 2]>,
    /// Height in metres at which snow begins and at which all is snow. Default: no snow.
    pub snow_m: Option<[f64; 2]>,
    /// Steepness at which snow begins to slide off and at which none is left. Default: [0.6, 1].
    #[serde(default = "default_snow_slope")]
    pub snow_slope: [f64; 2],
    /// Metres by which snow reaches further down a slope of 45 degrees that faces north than down level ground, and less
    /// far down one that faces south, -2000 to 2000: below 0 the sun stands in the north. Default: 0.
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
    /// Finds the first value that is out of its range or that nothing would read.
    pub(super) fn check(&self, path: &KeyPath, sea: bool) -> Result<(), Fault> {
        path.key("slope_scale").within(self.slope_scale, 0.1..=100.0)?;
        let steepness = 0.0..=1.0;
        path.key("dirt").rising(self.dirt, steepness.clone())?;
        path.key("rock").rising(self.rock, steepness.clone())?;
        path.key("snow_slope").rising(self.snow_slope, steepness)?;
        if let Some(sand) = self.sand_m {
            if !sea {
                let message = "sand lies by the sea, and this world has none";
                return Err(path.key("sand_m").fault(message, "give sea_level_m, or leave it out"));
            }
            path.key("sand_m").rising(sand, -HEIGHT_LIMIT_M..=HEIGHT_LIMIT_M)?;
        }
        if let Some(snow) = self.snow_m {
            path.key("snow_m").rising(snow, -HEIGHT_LIMIT_M..=HEIGHT_LIMIT_M)?;
        } else if self.snow_aspect_m != 0.0 {
            let message = "there is no snow that could reach further down";
            return Err(path.key("snow_aspect_m").fault(message, "give snow_m, or leave it out"));
        }
        path.key("snow_aspect_m").within(self.snow_aspect_m, -2000.0..=2000.0)
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
