//! What an author says about settlements and roads.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::places::road::RoadClass;
use crate::recipe::fault::{Fault, KeyPath};

/// Settlements and the roads between them. Lists of three are for tracks, roads and highways, in that order.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PlacesSettings {
    /// Side in metres of a site cell, which holds one settlement at most, 200 to 40,000. Default: 4000.
    pub site_m: f64,
    /// Share of the cells with good land that are settled, 0 to 1; poor land has fewer. Default: 0.85.
    pub density: f64,
    /// Height in metres above which nobody settles, -10,000 to 100,000. Default: 2500.
    pub max_height_m: f64,
    /// Width in metres, 0.5 to 50. Default: [3, 5, 9].
    pub width_m: [f64; 3],
    /// The steepest grade, metres up a metre ahead, 0.01 to 0.5. Default: [0.14, 0.10, 0.07].
    pub max_grade: [f64; 3],
    /// The smallest radius of a curve in metres, 1 to 500. Default: [12, 25, 60].
    pub radius_m: [f64; 3],
    /// Width in metres of the widest river that is forded, 0 to 50; wider ones have bridges. Default: [8, 3, 0].
    pub ford_m: [f64; 3],
    /// Length in metres of the longest bridge over water, 0 to 2000, and of the longest dip or ridge that a road goes
    /// straight over or through; where a bank would be too high, a viaduct may be longer. Default: [80, 160, 320].
    pub bridge_m: [f64; 3],
    /// Metres from the water to a bridge, 0.5 to 50. Default: 2.
    pub clearance_m: f64,
    /// Metres from a road's edge to where nothing of its cuts and fills is left, 1 to 200. Default: 32.
    pub bank_m: f64,
}

impl Default for PlacesSettings {
    fn default() -> PlacesSettings {
        PlacesSettings {
            site_m: 4000.0,
            density: 0.85,
            max_height_m: 2500.0,
            width_m: [3.0, 5.0, 9.0],
            max_grade: [0.14, 0.10, 0.07],
            radius_m: [12.0, 25.0, 60.0],
            ford_m: [8.0, 3.0, 0.0],
            bridge_m: [80.0, 160.0, 320.0],
            clearance_m: 2.0,
            bank_m: 32.0,
        }
    }
}

/// Vertices a site cell must have to each side: with fewer there is nothing to plan on.
const LEAST_SIDE: f64 = 32.0;

impl PlacesSettings {
    /// Refuses what is out of its range, at the key where it stands.
    pub(crate) fn check(&self, path: &KeyPath, spacing_m: f64) -> Result<(), Fault> {
        path.key("site_m").within(self.site_m, 200.0..=40_000.0)?;
        if self.site_m < LEAST_SIDE * spacing_m {
            let message = format!(
                "a site cell must have {LEAST_SIDE} vertices a side, but {} m with {spacing_m} m between vertices has {:.1}",
                self.site_m,
                self.site_m / spacing_m
            );
            let hint = format!("give {} or more, or a smaller spacing_m", LEAST_SIDE * spacing_m);
            return Err(path.key("site_m").fault(message, hint));
        }
        path.key("density").within(self.density, 0.0..=1.0)?;
        path.key("max_height_m").within(self.max_height_m, -10_000.0..=100_000.0)?;
        for index in 0..3 {
            let each = |key: &str| path.key(key).index(index);
            each("width_m").within(self.width_m[index], 0.5..=50.0)?;
            each("max_grade").within(self.max_grade[index], 0.01..=0.5)?;
            each("radius_m").within(self.radius_m[index], 1.0..=500.0)?;
            each("ford_m").within(self.ford_m[index], 0.0..=50.0)?;
            each("bridge_m").within(self.bridge_m[index], 0.0..=2000.0)?;
        }
        path.key("clearance_m").within(self.clearance_m, 0.5..=50.0)?;
        path.key("bank_m").within(self.bank_m, 1.0..=200.0)
    }

    /// What is asked of roads of a class.
    pub(super) fn standard(&self, class: RoadClass) -> Standard {
        let index = class as usize;
        Standard {
            width_m: self.width_m[index],
            max_grade: self.max_grade[index],
            radius_m: self.radius_m[index],
            ford_m: self.ford_m[index],
            bridge_m: self.bridge_m[index],
        }
    }
}

/// What is asked of roads of one class: see [`PlacesSettings`].
#[derive(Clone, Copy, Debug)]
pub(super) struct Standard {
    pub width_m: f64,
    pub max_grade: f64,
    pub radius_m: f64,
    pub ford_m: f64,
    pub bridge_m: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_are_sound_and_an_error_names_its_key() {
        assert!(PlacesSettings::default().check(&KeyPath::default(), 1.0).is_ok());
        let steep = PlacesSettings { max_grade: [0.1, 0.1, 3.0], ..PlacesSettings::default() };
        let error = steep.check(&KeyPath::default(), 1.0).unwrap_err().into_error(None).to_string();
        assert!(error.contains("max_grade[2]: expected 0.01 to 0.5, found 3"), "{error}");
        let coarse = PlacesSettings::default().check(&KeyPath::default(), 500.0).unwrap_err().into_error(None);
        assert!(coarse.to_string().contains("site_m: a site cell must have 32 vertices"), "{coarse}");
    }
}
