//! The recipe of fluvial relief, as a preset writes it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::recipe::HEIGHT_LIMIT_M;
use crate::recipe::fault::{Fault, KeyPath};
use crate::recipe::mask::Mask;

/// Relief that water made: rivers first, and the land between them after.
///
/// Trunk rivers run over a coarse lattice; level by level tributaries join them, each level half as far apart. Beds rise
/// upstream as in a landscape where uplift and incision are in balance, `slope = trunk_slope * uplift / sqrt(area)`,
/// and hillsides rise from the beds to sharp or rounded crests.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct FluvialSettings {
    /// Metres between trunk rivers, about: 64 to 4096 vertices. Default: 12,800.
    pub trunk_m: f64,
    /// Levels of tributaries below the trunks, 2 to 7: the last is `trunk_m / 2^levels` apart, at least 8 vertices.
    /// Default: 6.
    pub levels: u32,
    /// Wavelength in metres of what decides where the water flows at large, 2 to 64 times `trunk_m`. Default: 5 times.
    pub basin_m: Option<f64>,
    /// Height of the water that has no way out: inland lakes. In metres above the sea level, or above 0. Default: 200.
    pub base_m: f64,
    /// Slope of a river that drains a square of side `trunk_m`, where the uplift is whole, 0.0001 to 0.2.
    /// Default: 0.014.
    pub trunk_slope: f64,
    /// Slope that no river exceeds, as a share of that of the hillsides, 0.05 to 0.9. Default: 0.45.
    pub channel_slope: f64,
    /// Slope of hillsides where there is no uplift and where it is whole, 0.005 to 2. Default: [0.2, 0.8].
    pub hill_slope: [f64; 2],
    /// Where the land rises, and so is mountainous.
    pub uplift: Uplift,
    /// How rounded valley floors are: half their width as a share of the side of the area that drains there, 0 to 0.2.
    /// Default: 0.03.
    pub valley: f64,
    /// Metres of height by which crests are rounded off, 0 to 1000. Default: 20.
    pub crest_m: f64,
    /// How far all lines bend from the straight, 0 to 1. Default: 0.9.
    pub bend: f64,
    /// Gullies on the hillsides: their depth as a share of what slope and spacing allow, 0 to 1. Default: 0.5.
    pub gullies: f64,
    /// No land is higher than this many metres, and what comes near is pressed together. Default: 4800.
    pub ceiling_m: f64,
    /// Share of the ceiling from which on the land is pressed together, 0.1 to 0.98: near 1, and what would be higher is a
    /// plateau. Default: 0.6.
    pub knee: f64,
    /// Layers of rock which the land meets as it rises. Default: none.
    pub strata: Option<Strata>,
    /// Rain that runs off, in metres a year, 0.01 to 10. Default: 0.8.
    pub runoff_m: f64,
    /// Width in metres of a river of one cubic metre a second, 0.1 to 100; widths grow as the root of the discharge.
    /// Default: 5.
    pub river_width_m: f64,
    /// Discharge in cubic metres a second from which on a channel holds water all year. Default: 0.05.
    pub spring_m3s: f64,
    /// Share of the trunks' nodes that are lakes, besides those that must be, 0 to 1. Default: 0.1.
    pub lakes: f64,
    /// Half width in metres of the largest lakes. Default: a sixteenth of `trunk_m`.
    pub lake_m: Option<f64>,
    /// The coast; needs `sea_level_m`. Default: as of [`Coast`].
    pub coast: Coast,
}

impl Default for FluvialSettings {
    fn default() -> FluvialSettings {
        FluvialSettings {
            trunk_m: 12_800.0,
            levels: 6,
            basin_m: None,
            base_m: 200.0,
            trunk_slope: 0.014,
            channel_slope: 0.45,
            hill_slope: [0.2, 0.8],
            uplift: Uplift::default(),
            valley: 0.03,
            crest_m: 20.0,
            bend: 0.9,
            gullies: 0.5,
            ceiling_m: 4800.0,
            knee: 0.6,
            strata: None,
            runoff_m: 0.8,
            river_width_m: 5.0,
            spring_m3s: 0.05,
            lakes: 0.1,
            lake_m: None,
            coast: Coast::default(),
        }
    }
}

/// The uplift map: a mask, and what is left where it is 0.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Uplift {
    /// Where the uplift is whole. Default: five times the default of `trunk_m`, from -0.4 to 0.4.
    pub mask: Mask,
    /// The uplift where the mask is 0, 0.001 to 1. Default: 0.08.
    pub least: f64,
}

impl Default for Uplift {
    fn default() -> Uplift {
        Uplift { mask: Mask { wavelength_m: 64_000.0, octaves: 3, from: -0.4, to: 0.4 }, least: 0.08 }
    }
}

/// Layers of rock, hard ones making cliffs and soft ones benches.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Strata {
    /// Metres from one layer to the next.
    pub thickness_m: f64,
    /// How much steeper than the land around it a layer's cliff is, 1 to 20.
    pub steepness: f64,
    /// Share of a layer's height that is cliff, 0.05 to 0.95. Default: 0.5.
    #[serde(default = "half")]
    pub cliff: f64,
}

fn half() -> f64 {
    0.5
}

/// Where the sea is and how it meets the land.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Coast {
    /// The noise (about -1 to 1) of the basins below which the sea is. Default: -0.15.
    pub below: f64,
    /// Octaves of that noise, 1 to 10: how jagged the coast is. Default: 4.
    pub octaves: u32,
    /// Slope of the land's edge and of the shelf, 0.001 to 2. Default: [0.15, 0.02].
    pub slope: [f64; 2],
    /// Depth in metres that the sea does not reach. Default: 300.
    pub depth_m: f64,
}

impl Default for Coast {
    fn default() -> Coast {
        Coast { below: -0.15, octaves: 4, slope: [0.15, 0.02], depth_m: 300.0 }
    }
}

impl FluvialSettings {
    /// Finds the first value that is out of its range.
    pub(crate) fn check(&self, path: &KeyPath, spacing_m: f64) -> Result<(), Fault> {
        path.key("trunk_m").within(self.trunk_m, 64.0 * spacing_m..=4096.0 * spacing_m)?;
        path.key("levels").within(self.levels, 2..=7)?;
        let finest = self.trunk_m / spacing_m / (1u32 << self.levels) as f64;
        if finest < 7.5 {
            let message = format!("the last of {} levels has its channels {finest:.1} vertices apart", self.levels);
            let hint = "8 or more are needed: fewer levels, a longer trunk_m or a smaller spacing_m";
            return Err(path.key("levels").fault(message, hint));
        }
        if let Some(basin_m) = self.basin_m {
            path.key("basin_m").within(basin_m, 2.0 * self.trunk_m..=64.0 * self.trunk_m)?;
        }
        path.key("base_m").within(self.base_m, 0.0..=HEIGHT_LIMIT_M / 10.0)?;
        path.key("trunk_slope").within(self.trunk_slope, 0.0001..=0.2)?;
        path.key("channel_slope").within(self.channel_slope, 0.05..=0.9)?;
        for end in 0..2 {
            path.key("hill_slope").index(end).within(self.hill_slope[end], 0.005..=2.0)?;
        }
        let uplift = path.key("uplift");
        self.uplift.mask.check(&uplift.key("mask"), spacing_m)?;
        uplift.key("least").within(self.uplift.least, 0.001..=1.0)?;
        path.key("valley").within(self.valley, 0.0..=0.2)?;
        path.key("crest_m").within(self.crest_m, 0.0..=1000.0)?;
        path.key("bend").within(self.bend, 0.0..=1.0)?;
        path.key("gullies").within(self.gullies, 0.0..=1.0)?;
        path.key("ceiling_m").within(self.ceiling_m, 10.0..=HEIGHT_LIMIT_M / 10.0)?;
        path.key("knee").within(self.knee, 0.1..=0.98)?;
        if let Some(strata) = &self.strata {
            let path = path.key("strata");
            path.key("thickness_m").within(strata.thickness_m, 1.0..=1000.0)?;
            path.key("steepness").within(strata.steepness, 1.0..=20.0)?;
            path.key("cliff").within(strata.cliff, 0.05..=0.95)?;
        }
        path.key("runoff_m").within(self.runoff_m, 0.01..=10.0)?;
        path.key("river_width_m").within(self.river_width_m, 0.1..=100.0)?;
        path.key("spring_m3s").within(self.spring_m3s, 0.0..=1e6)?;
        path.key("lakes").within(self.lakes, 0.0..=1.0)?;
        if let Some(lake_m) = self.lake_m {
            path.key("lake_m").within(lake_m, 0.0..=self.trunk_m / 8.0)?;
        }
        let coast = path.key("coast");
        coast.key("below").within(self.coast.below, -10.0..=10.0)?;
        coast.key("octaves").within(self.coast.octaves, 1..=10)?;
        for part in 0..2 {
            coast.key("slope").index(part).within(self.coast.slope[part], 0.001..=2.0)?;
        }
        coast.key("depth_m").within(self.coast.depth_m, 1.0..=HEIGHT_LIMIT_M / 10.0)
    }
}
