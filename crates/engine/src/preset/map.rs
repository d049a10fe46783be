//! Settings of the map's colours.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::recipe::HEIGHT_LIMIT_M;
use crate::recipe::fault::{Fault, KeyPath};

/// Colours and shading of the map.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MapStyle {
    /// The hypsometric tint. Default: `temperate`.
    #[serde(default)]
    pub tint: Tint,
    /// Height in metres of the lowest land colour, -100,000 to 100,000. Default: the sea level, or the lowest height of
    /// the world.
    #[schemars(range(min = -HEIGHT_LIMIT_M, max = HEIGHT_LIMIT_M))]
    pub low_m: Option<f64>,
    /// Height in metres of the highest land colour, -100,000 to 100,000; above `low_m`. Default: the highest height of
    /// the world.
    #[schemars(range(min = -HEIGHT_LIMIT_M, max = HEIGHT_LIMIT_M))]
    pub high_m: Option<f64>,
    /// Factor by which slopes are steepened before they are shaded, in addition to that of a style, 0.1 to 20: larger
    /// where land is flat. Default: 1.
    #[schemars(range(min = 0.1, max = 20))]
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
    /// Finds the first value that contradicts another one.
    pub(super) fn check(&self, path: &KeyPath) -> Result<(), Fault> {
        match (self.low_m, self.high_m) {
            (Some(low_m), Some(high_m)) if low_m >= high_m => {
                Err(path.key("high_m").fault(format!("expected more than low_m = {low_m}"), "").found(high_m))
            }
            _ => Ok(()),
        }
    }
}
