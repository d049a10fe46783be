//! Settings of the ground: the distribution of materials.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::recipe::HEIGHT_LIMIT_M;
use crate::recipe::fault::{Fault, KeyPath};

/// Distribution of the ground's materials: grass, with dirt and rock by slope, sand by height, and snow by height and
/// aspect; on request also scree below rock, forest up to a tree line, and wet ground beside water.
///
/// In a world with a `geography`, ground follows the climate as well. Snow begins about the snow line of the place and
/// forest ends at its tree line; forest is rarer the drier it is; grass gives way to dirt, stones and sand in steppes
/// and deserts, and to dirt and stones above the trees.
///
/// Slope enters as steepness, `slope_scale * (1 - n.up)` for the normal n, cut off at 1. With the thesis' scale of 5,
/// steepness 0.1 is a slope of 11 degrees, 0.5 is 26 and 1 is 37. The thesis itself writes five times `n.up`. But that
/// is 5 on level ground and more than 1 up to 78 degrees, so after the cut-off most slopes would look alike.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GroundSettings {
    /// Factor that converts `1 - n.up` to steepness, 0.1 to 100. Default: 5.
    #[schemars(range(min = 0.1, max = 100))]
    #[serde(default = "thesis_slope_scale")]
    pub slope_scale: f64,
    /// Steepness at which dirt begins and at which it has replaced all grass, 0 to 1. Default: [0.1, 0.5].
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
    /// Steepness at which sand begins to thin out and at which none is left, 0 to 1; needs `sand_m`. Default: at no
    /// slope, so sand lies on any.
    #[schemars(inner(range(min = 0, max = 1)))]
    pub sand_slope: Option<[f64; 2]>,
    /// Height in metres at which snow begins and at which all is snow, -100,000 to 100,000. With a `geography` both are
    /// moved until their middle is the snow line of the place. Default: no snow.
    #[schemars(inner(range(min = -HEIGHT_LIMIT_M, max = HEIGHT_LIMIT_M)))]
    pub snow_m: Option<[f64; 2]>,
    /// Steepness at which snow begins to slide off and at which none is left, 0 to 1; needs `snow_m`.
    /// Default: [0.6, 1].
    #[schemars(inner(range(min = 0, max = 1)))]
    #[serde(default = "default_snow_slope")]
    pub snow_slope: [f64; 2],
    /// Metres by which snow reaches further down on a slope of 45 degrees that faces north than on level ground, and
    /// less far down on one that faces south, -2000 to 2000: negative where the sun stands in the north. Needs
    /// `snow_m`. Default: 0.
    #[schemars(range(min = -2000, max = 2000))]
    #[serde(default)]
    pub snow_aspect_m: f64,
    /// Steepness at which scree begins and at which it covers all ground below rock, 0 to 1. Default: no scree.
    #[schemars(inner(range(min = 0, max = 1)))]
    pub scree: Option<[f64; 2]>,
    /// Metres that scree reaches down from rock, 1 to 10,000, and at most seven vertices; needs `scree`. Default: 80.
    #[schemars(range(min = 1, max = 10000))]
    #[serde(default = "default_scree_m")]
    pub scree_m: f64,
    /// Height in metres up to which forest grows freely and above which there is none, -100,000 to 100,000: the tree
    /// line varies between the two. With a `geography` both are moved until the second is the tree line of the place.
    /// Default: no forest.
    #[schemars(inner(range(min = -HEIGHT_LIMIT_M, max = HEIGHT_LIMIT_M)))]
    pub forest_m: Option<[f64; 2]>,
    /// Share of the land below the tree line that forest covers where nothing else prevents it, 0 to 1; needs
    /// `forest_m`. With a `geography`, the share in wet climates. Default: 0.6.
    #[schemars(range(min = 0, max = 1))]
    #[serde(default = "default_forest_share")]
    pub forest_share: f64,
    /// Steepness at which forest begins to thin out and at which none is left, 0 to 1; needs `forest_m`.
    /// Default: [0.6, 0.9].
    #[schemars(inner(range(min = 0, max = 1)))]
    #[serde(default = "default_forest_slope")]
    pub forest_slope: [f64; 2],
    /// Metres by which the tree line lies lower on a slope of 45 degrees that faces north than on level ground, and
    /// higher on one that faces south, -2000 to 2000; needs `forest_m`. Default: 0.
    #[schemars(range(min = -2000, max = 2000))]
    #[serde(default)]
    pub forest_aspect_m: f64,
    /// Steepness up to which meadows replace most of the forest and from which on they replace none, 0 to 1; needs
    /// `forest_m`. Default: no meadows.
    #[schemars(inner(range(min = 0, max = 1)))]
    pub meadow: Option<[f64; 2]>,
    /// Width in metres of wet ground on level ground beside a lake or a river of 2 m3/s or more, 1 to 10,000, and at
    /// most seven vertices: narrower beside smaller rivers and up a bank; needs `fluvial`. Default: none but a rim of
    /// mud.
    #[schemars(range(min = 1, max = 10000))]
    pub wet_m: Option<f64>,
    /// Preference of forest for wet ground, 0 to 2: with 1 it stands on most banks; needs `wet_m`. Default: 0.
    #[schemars(range(min = 0, max = 2))]
    #[serde(default)]
    pub forest_wet: f64,
}

impl Default for GroundSettings {
    fn default() -> GroundSettings {
        GroundSettings {
            slope_scale: thesis_slope_scale(),
            dirt: default_dirt(),
            rock: default_rock(),
            sand_m: None,
            sand_slope: None,
            snow_m: None,
            snow_slope: default_snow_slope(),
            snow_aspect_m: 0.0,
            scree: None,
            scree_m: default_scree_m(),
            forest_m: None,
            forest_share: default_forest_share(),
            forest_slope: default_forest_slope(),
            forest_aspect_m: 0.0,
            meadow: None,
            wet_m: None,
            forest_wet: 0.0,
        }
    }
}

impl GroundSettings {
    /// Finds the first value that contradicts another one.
    pub(super) fn check(&self, path: &KeyPath) -> Result<(), Fault> {
        let ramps = [
            ("dirt", Some(self.dirt)),
            ("rock", Some(self.rock)),
            ("sand_m", self.sand_m),
            ("sand_slope", self.sand_slope),
            ("snow_m", self.snow_m),
            ("snow_slope", Some(self.snow_slope)),
            ("scree", self.scree),
            ("forest_m", self.forest_m),
            ("forest_slope", Some(self.forest_slope)),
            ("meadow", self.meadow),
        ];
        for (key, ramp) in ramps {
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

fn default_scree_m() -> f64 {
    80.0
}

fn default_forest_share() -> f64 {
    0.6
}

fn default_forest_slope() -> [f64; 2] {
    [0.6, 0.9]
}
