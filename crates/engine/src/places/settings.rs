//! The settings of a preset for settlements and roads.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::lines::RoadClass;
use crate::recipe::HEIGHT_LIMIT_M;
use crate::recipe::fault::{Fault, KeyPath};
use crate::recipe::schema;

/// Settlements and the roads between them. Lists of three are for tracks, roads and highways, in that order.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PlacesSettings {
    /// Side in metres of a site cell, which holds one settlement at most, 200 to 40,000 and 32 `spacing_m` or more.
    /// Default: 4000.
    #[schemars(range(min = 200, max = 40000))]
    pub site_m: f64,
    /// Share of the cells with good land that are settled, 0 to 1; poor land has fewer. Default: 0.85.
    #[schemars(range(min = 0, max = 1))]
    pub density: f64,
    /// Height in metres above which nobody settles, -10,000 to 100,000. Default: 2500.
    #[schemars(range(min = -10000, max = HEIGHT_LIMIT_M))]
    pub max_height_m: f64,
    /// Width in metres, 0.5 to 50. Default: [3, 5, 9].
    #[schemars(inner(range(min = 0.5, max = 50)))]
    pub width_m: [f64; 3],
    /// The steepest grade, metres up a metre ahead, 0.01 to 0.5. Default: [0.14, 0.10, 0.07].
    #[schemars(inner(range(min = 0.01, max = 0.5)))]
    pub max_grade: [f64; 3],
    /// The smallest radius of a curve in metres, 1 to 500. Default: [12, 25, 60].
    #[schemars(inner(range(min = 1, max = 500)))]
    pub radius_m: [f64; 3],
    /// Width in metres of the widest river that is forded, 0 to 50; wider rivers have bridges. Default: [8, 3, 0].
    #[schemars(inner(range(min = 0, max = 50)))]
    pub ford_m: [f64; 3],
    /// Length in metres of the longest bridge over water, 0 to 2000, and of the longest dip or ridge that a road goes
    /// straight over or through; where a bank would be too high, a viaduct may be longer. Default: [80, 160, 320].
    #[schemars(inner(range(min = 0, max = 2000)))]
    pub bridge_m: [f64; 3],
    /// Clearance in metres between the water and a bridge, 0.5 to 50. Default: 2.
    #[schemars(range(min = 0.5, max = 50))]
    pub clearance_m: f64,
    /// Metres from a road's edge to the end of its cuts and fills, 1 to 200. Default: 32.
    #[schemars(range(min = 1, max = 200))]
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

/// Share of the maximum grade up to which profiles are built. The rest is a reserve for rounding to 1/256 vertex and to
/// `f32`.
const GRADE_SHARE: f64 = 0.995;

/// Least number of vertices along a side of a site cell: with fewer there is too little land to plan on.
const LEAST_SIDE: f64 = 32.0;

impl PlacesSettings {
    /// Returns an error at the key of the first value that is out of its range.
    pub(crate) fn check(&self, path: &KeyPath, spacing_m: f64) -> Result<(), Fault> {
        schema::check(self, path)?;
        if self.site_m < LEAST_SIDE * spacing_m {
            let message = format!(
                "a site cell must have {LEAST_SIDE} vertices a side, but {} m with {spacing_m} m between vertices has {:.1}",
                self.site_m,
                self.site_m / spacing_m
            );
            let hint = format!("give {} or more, or a smaller spacing_m", LEAST_SIDE * spacing_m);
            return Err(path.key("site_m").fault(message, hint));
        }
        Ok(())
    }

    /// Returns the full width in metres of the widest roads.
    pub(super) fn widest_m(&self) -> f64 {
        self.width_m.into_iter().fold(0.0, f64::max)
    }

    /// Returns the distance in metres from the middle of the widest roads to the end of their cuts and fills.
    pub(super) fn effect_m(&self) -> f64 {
        self.widest_m() / 2.0 + self.bank_m
    }

    /// Returns the dimensions of roads of a class: width, grade, curves and crossings.
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

/// The dimensions that roads of one class keep, see [`PlacesSettings`].
#[derive(Clone, Copy, Debug)]
pub(super) struct Standard {
    pub width_m: f64,
    pub max_grade: f64,
    pub radius_m: f64,
    pub ford_m: f64,
    pub bridge_m: f64,
}

impl Standard {
    /// Returns the steepest grade up to which profiles are built.
    pub fn profile_grade(&self) -> f64 {
        self.max_grade * GRADE_SHARE
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_are_sound_and_an_error_names_its_key() {
        assert!(PlacesSettings::default().check(&KeyPath::default(), 1.0).is_ok());
        let steep = PlacesSettings { max_grade: [0.1, 0.1, 3.0], ..PlacesSettings::default() };
        let error = steep.check(&KeyPath::default(), 1.0).unwrap_err().sentence(true);
        assert!(error.contains("max_grade[2]: expected 0.01 to 0.5, found 3"), "{error}");
        let coarse = PlacesSettings::default().check(&KeyPath::default(), 500.0).unwrap_err().sentence(true);
        assert!(coarse.contains("site_m: a site cell must have 32 vertices"), "{coarse}");
    }
}
