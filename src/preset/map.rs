//! What an author says about the map's colours.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::recipe::HEIGHT_LIMIT_M;
use crate::recipe::fault::{Fault, KeyPath};

/// How the map is coloured.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MapStyle {
    /// The hypsometric tint. Default: `temperate`.
    #[serde(default)]
    pub tint: Tint,
    /// Height in metres of the lowest land colour. Default: the sea level, or the lowest height of the world.
    pub low_m: Option<f64>,
    /// Height in metres of the highest land colour. Default: the highest height of the world.
    pub high_m: Option<f64>,
    /// How many times the slopes are steepened before they are shaded, 0.1 to 20. Default: 1.
    pub exaggeration: Option<f64>,
}

/// A scale of land colours by height.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Tint {
    /// Lowland green through straw and brown to grey and white.
    #[default]
    Temperate,
    /// Sand, ochre and red rock.
    Arid,
    /// Dark forest, alpine meadow, rock and snow.
    Alpine,
}

impl MapStyle {
    /// Finds the first value that is out of its range.
    pub(super) fn check(&self, path: &KeyPath) -> Result<(), Fault> {
        for (key, value) in [("low_m", self.low_m), ("high_m", self.high_m)] {
            if let Some(value) = value {
                path.key(key).within(value, -HEIGHT_LIMIT_M..=HEIGHT_LIMIT_M)?;
            }
        }
        if let (Some(low), Some(high)) = (self.low_m, self.high_m)
            && low >= high
        {
            return Err(path.key("high_m").fault(format!("must lie above low_m = {low}, but it is {high}"), ""));
        }
        self.exaggeration.map_or(Ok(()), |times| path.key("exaggeration").within(times, 0.1..=20.0))
    }
}
