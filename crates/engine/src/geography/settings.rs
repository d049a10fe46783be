//! The recipe of a world with a geography, as a preset writes it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A whole world: continents and seas on plates, ranges where plates meet, and the climate that follows from latitude,
/// sea and height.
///
/// The world is a map without end: from pole to pole it is `2 * pole_km` long, and mirrors beyond each pole.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct GeographySettings {
    /// Share of the world that is land, 0.05 to 0.95. Default: 0.29, as on Earth.
    #[schemars(range(min = 0.05, max = 0.95))]
    pub land: f64,
    /// Kilometres from the middle of one continent to the next, about, 100 to 20,000. Default: 5,200.
    #[schemars(range(min = 100, max = 20_000))]
    pub continent_km: f64,
    /// Kilometres from the middle of one plate of the crust to the next, about, 50 to 10,000: smaller plates make more
    /// and narrower ranges. Default: 1,600.
    #[schemars(range(min = 50, max = 10_000))]
    pub plate_km: f64,
    /// Kilometres from the equator to a pole, 100 to 100,000. The origin lies at 45 degrees north. Default: 10,000, as
    /// on Earth.
    #[schemars(range(min = 100, max = 100_000))]
    pub pole_km: f64,
    /// Degrees Celsius by which the world is warmer than Earth, -30 to 30. Default: 0.
    #[schemars(range(min = -30, max = 30))]
    pub warmth_c: f64,
    /// Rain, as a multiple of Earth's, 0.05 to 5. Default: 1.
    #[schemars(range(min = 0.05, max = 5))]
    pub wetness: f64,
}

impl Default for GeographySettings {
    fn default() -> GeographySettings {
        GeographySettings {
            land: 0.29,
            continent_km: 5200.0,
            plate_km: 1600.0,
            pole_km: 10_000.0,
            warmth_c: 0.0,
            wetness: 1.0,
        }
    }
}
