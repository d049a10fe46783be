//! The recipe of fluvial relief, as a preset writes it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::geography::rock::RockAtLarge;
use crate::recipe::fault::{Fault, KeyPath};
use crate::recipe::mask::Mask;

/// Relief made by water: rivers first, then the land between them.
///
/// Trunk rivers run over a coarse lattice. Tributaries join them level by level; the channels of each level lie half as
/// far apart. Beds rise upstream as in a landscape where uplift and incision are in balance,
/// `slope = trunk_slope * uplift / sqrt(area)`, and hillsides rise from the beds to sharp or rounded crests.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct FluvialSettings {
    /// Metres between trunk rivers, about: 0.064 to 40,960,000 and 64 to 4096 times `spacing_m`. Default: 12,800.
    #[schemars(range(min = 0.064, max = 40_960_000))]
    pub trunk_m: f64,
    /// Levels of tributaries below the trunks, 2 to 7: the channels of the last level are `trunk_m / 2^levels` apart,
    /// at least 8 vertices. Default: 6.
    #[schemars(range(min = 2, max = 7))]
    pub levels: u32,
    /// Wavelength in metres of the large basins, which decide where water flows at large, 0.1 to 1,000,000,000 and 2 to
    /// 512 times `trunk_m`. Default: 5 times.
    #[schemars(range(min = 0.1, max = 1e9))]
    pub basin_m: Option<f64>,
    /// Height of water without an outlet: inland lakes. In metres above the sea level, or above 0; 0 to 10,000.
    /// Default: 200.
    #[schemars(range(min = 0, max = 10_000))]
    pub base_m: f64,
    /// Slope of a river that drains a square of side `trunk_m`, where the uplift is full, 0.0001 to 0.2.
    /// Default: 0.014.
    #[schemars(range(min = 0.0001, max = 0.2))]
    pub trunk_slope: f64,
    /// Slope that no river exceeds, as a share of the slope of the hillsides, 0.05 to 0.9. Default: 0.45.
    #[schemars(range(min = 0.05, max = 0.9))]
    pub channel_slope: f64,
    /// Slope of hillsides where there is no uplift and where it is full, 0.005 to 2. Default: [0.2, 0.8].
    #[schemars(inner(range(min = 0.005, max = 2)))]
    pub hill_slope: [f64; 2],
    /// The uplift map: land that rises fast is mountainous.
    pub uplift: Uplift,
    /// Width of valley floors: half of it as a share of the side of the area that drains there, 0 to 0.2.
    /// Default: 0.03.
    #[schemars(range(min = 0, max = 0.2))]
    pub valley: f64,
    /// Number of terraces between a flood plain and the sides of its valley, each twice as high as the river is deep
    /// where there is room for them, 0 to 3. Default: 0.
    #[schemars(range(min = 0, max = 3))]
    pub terraces: u32,
    /// Height of the levees that floods have left along rivers on wide floors, as a share of what the hillside rises
    /// over an eighth of the river's width, 0 to 1. Default: 0.
    #[schemars(range(min = 0, max = 1))]
    pub levees: f64,
    /// Height in metres above which glaciers have shaped the valleys of tributaries: floors are wide and go up in
    /// steps, heads are cirques, and side valleys hang; 0 to 10,000, above the sea level or above 0. Default: none.
    #[schemars(range(min = 0, max = 10_000))]
    pub ice_m: Option<f64>,
    /// Share of the stretches of wide floors on which a glacier has left moraines, above `ice_m` if that is given,
    /// 0 to 1. Default: 0.
    #[schemars(range(min = 0, max = 1))]
    pub moraines: f64,
    /// Height in metres down to which glaciers come in the heads of valleys, about: 0 to 10,000, above the sea level or
    /// above 0. Default: no glaciers.
    #[schemars(range(min = 0, max = 10_000))]
    pub glacier_m: Option<f64>,
    /// Metres of height by which crests are rounded off, 0 to 1000. Default: 20.
    #[schemars(range(min = 0, max = 1000))]
    pub crest_m: f64,
    /// Bend of all lines away from the straight, 0 to 1. Default: 0.9.
    #[schemars(range(min = 0, max = 1))]
    pub bend: f64,
    /// Depth of gullies on the hillsides, as a share of what slope and spacing allow, 0 to 1. Default: 0.5.
    #[schemars(range(min = 0, max = 1))]
    pub gullies: f64,
    /// Depth of rills, which are the shortest of three sizes of gullies, a fifth of the distance between brooks wide,
    /// on the same scale as `gullies`, 0 to 1; without gullies there are no rills. Default: as `gullies`.
    #[schemars(range(min = 0, max = 1))]
    pub rills: Option<f64>,
    /// Roughness of hillsides, 0 to 1: outcrops and scree, made of waves a third of the distance between brooks long
    /// and shorter; without gullies hillsides are smooth. Default: 0.25.
    #[schemars(range(min = 0, max = 1))]
    pub roughness: f64,
    /// Greatest height of the land in metres: land that comes near it is compressed below it; 10 to 10,000.
    /// Default: 4800.
    #[schemars(range(min = 10, max = 10_000))]
    pub ceiling_m: f64,
    /// Share of the ceiling above which the land is compressed, 0.1 to 0.98: near 1, land that would be higher becomes
    /// a plateau. Default: 0.6.
    #[schemars(range(min = 0.1, max = 0.98))]
    pub knee: f64,
    /// Layers of rock, which show as cliffs and benches. Default: none.
    pub strata: Option<Strata>,
    /// The rocks of the land, which change its slopes, floors, crests, gullies and brooks from place to place. A world
    /// with a `geography` has its own. Default: one rock everywhere.
    pub rock: Option<RockSettings>,
    /// Rain that runs off, in metres a year, 0.01 to 10. Default: 0.8.
    #[schemars(range(min = 0.01, max = 10))]
    pub runoff_m: f64,
    /// Width in metres of a river of one cubic metre a second, 0.1 to 100; widths grow as the root of the discharge.
    /// Default: 5.
    #[schemars(range(min = 0.1, max = 100))]
    pub river_width_m: f64,
    /// Discharge in cubic metres a second above which a channel holds water all year, 0 to 1,000,000. A level of
    /// tributaries that would hold water only on the last quarter of its channels holds none. Default: 0.05.
    #[schemars(range(min = 0, max = 1e6))]
    pub spring_m3s: f64,
    /// Share of the trunks, and of the tributaries with water, that have a lake on their way where there is room for
    /// one, besides lakes in hollows of the land, 0 to 1. Default: 0.1.
    #[schemars(range(min = 0, max = 1))]
    pub lakes: f64,
    /// Half width in metres of the largest lakes between their bays, 0 to 5,120,000 and at most an eighth of `trunk_m`.
    /// Default: a sixteenth of `trunk_m`.
    #[schemars(range(min = 0, max = 5_120_000))]
    pub lake_m: Option<f64>,
    /// Share of the bends of trunks that have an old arm (oxbow lake) beside them, where the flood plain has room for
    /// one and no other river crosses it, 0 to 1. Default: 0.
    #[schemars(range(min = 0, max = 1))]
    pub old_arms: f64,
    /// Share of the reaches of trunks that are braided, under the same conditions: they have side arms around low
    /// islands; 0 to 1. Default: 0.
    #[schemars(range(min = 0, max = 1))]
    pub braids: f64,
    /// The coast; needs `sea_level_m`. Default: as of [`CoastSettings`].
    pub coast: CoastSettings,
}

/// Default of `river_width_m`: the width in metres of a river of one cubic metre a second.
pub(crate) const RIVER_WIDTH_M: f64 = 5.0;

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
            terraces: 0,
            levees: 0.0,
            ice_m: None,
            moraines: 0.0,
            glacier_m: None,
            crest_m: 20.0,
            bend: 0.9,
            gullies: 0.5,
            rills: None,
            roughness: 0.25,
            ceiling_m: 4800.0,
            knee: 0.6,
            strata: None,
            rock: None,
            runoff_m: 0.8,
            river_width_m: RIVER_WIDTH_M,
            spring_m3s: 0.05,
            lakes: 0.1,
            lake_m: None,
            old_arms: 0.0,
            braids: 0.0,
            coast: CoastSettings::default(),
        }
    }
}

/// The uplift map: a mask, and the uplift that is left where the mask is 0.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Uplift {
    /// Mask that is 1 where the uplift is full. Default: five times the default of `trunk_m`, from -0.4 to 0.4.
    pub mask: Mask,
    /// The uplift where the mask is 0, 0.001 to 1. Default: 0.08.
    #[schemars(range(min = 0.001, max = 1))]
    pub least: f64,
}

impl Default for Uplift {
    fn default() -> Uplift {
        Uplift { mask: Mask { wavelength_m: 64_000.0, octaves: 3, from: -0.4, to: 0.4 }, least: 0.08 }
    }
}

/// Layers of rock: hard layers form cliffs, and soft ones benches.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Strata {
    /// Thickness of a layer in metres, 1 to 1000.
    #[schemars(range(min = 1, max = 1000))]
    pub thickness_m: f64,
    /// Ratio of a cliff's slope to the slope of the land around it, 1 to 20.
    #[schemars(range(min = 1, max = 20))]
    pub steepness: f64,
    /// Share of a layer's height that is cliff, 0.05 to 0.95. Default: 0.5.
    #[schemars(range(min = 0.05, max = 0.95))]
    #[serde(default = "half")]
    pub cliff: f64,
}

/// The rocks of a land: their shares, and the folds of the layered ones.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct RockSettings {
    /// Part of massive rock (granite and gneiss): steep, with few brooks; 0 to 1. Default: 0.
    #[schemars(range(min = 0, max = 1))]
    pub massive: f64,
    /// Part of layered rock: bands of hard beds, which stand steep, and of soft ones, which are low; 0 to 1.
    /// Default: 0.
    #[schemars(range(min = 0, max = 1))]
    pub layered: f64,
    /// Part of volcanic rock: somewhat like massive rock; 0 to 1. Default: 0.
    #[schemars(range(min = 0, max = 1))]
    pub volcanic: f64,
    /// Part of soft rock (clay, marl and till): low and wide where it rains, and full of gullies where it is dry;
    /// 0 to 1. Default: 0.
    #[schemars(range(min = 0, max = 1))]
    pub soft: f64,
    /// Height of the folds of layered rock, as a share of those in a young range: bands are wide where there are none,
    /// and narrow and parallel where they are high; 0 to 1. Default: 0.
    #[schemars(range(min = 0, max = 1))]
    pub folded: f64,
}

impl Default for RockSettings {
    fn default() -> RockSettings {
        RockSettings { massive: 0.0, layered: 0.0, volcanic: 0.0, soft: 0.0, folded: 0.0 }
    }
}

impl RockSettings {
    /// Returns the rock of the land at large. The parts need not add up to 1.
    pub(super) fn at_large(&self) -> RockAtLarge {
        let parts = [self.massive, self.layered, self.volcanic, self.soft];
        let all: f64 = parts.iter().sum();
        RockAtLarge { shares: parts.map(|part| part / all), folded: self.folded, across_km: 0.0 }
    }
}

fn half() -> f64 {
    0.5
}

/// The place of the sea, and the shape of its coast.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct CoastSettings {
    /// Value of the basins' noise (about -1 to 1) below which there was sea at the lowstand, -10 to 10. Default: -0.15.
    #[schemars(range(min = -10, max = 10))]
    pub below: f64,
    /// Octaves of that noise, 1 to 10: more make the coast more jagged. From the third on they leave small seas without
    /// an outlet. Default: 2.
    #[schemars(range(min = 1, max = 10))]
    pub octaves: u32,
    /// Metres by which the sea was lower when the rivers cut their valleys, 0 to 500. The sea has risen since and
    /// drowned the valleys; the land between them forms headlands and islands. The ice ages' lowstand was 120 m.
    /// Default: 30.
    #[schemars(range(min = 0, max = 500))]
    pub lowstand_m: f64,
    /// Slope of the land up from the lowstand's shore, which rivers stay below, and slope of the shelf, 0.001 to 2.
    /// Default: [0.15, 0.02].
    #[schemars(inner(range(min = 0.001, max = 2)))]
    pub slope: [f64; 2],
    /// Depth in metres below the lowstand that the sea's floor never reaches, 1 to 10,000. Default: 300.
    #[schemars(range(min = 1, max = 10_000))]
    pub depth_m: f64,
    /// Greatest length of the deltas with which rivers have filled their drowned valleys, as a share of the side of the
    /// area that drains there, 0 to 1. Default: 0.1.
    #[schemars(range(min = 0, max = 1))]
    pub deltas: f64,
    /// Share of the large rivers whose drowned valleys end behind a barrier of sand, 0 to 1: the water behind it is a
    /// lagoon. Default: 0.
    #[schemars(range(min = 0, max = 1))]
    pub lagoons: f64,
    /// Share of the sea near the lowstand's shore that has shoals with skerries, which are small low islands, a few
    /// vertices to fifteen across; 0 to 1. Default: 0.
    #[schemars(range(min = 0, max = 1))]
    pub skerries: f64,
}

impl Default for CoastSettings {
    fn default() -> CoastSettings {
        CoastSettings {
            below: -0.15,
            octaves: 2,
            lowstand_m: 30.0,
            slope: [0.15, 0.02],
            depth_m: 300.0,
            deltas: 0.1,
            lagoons: 0.0,
            skerries: 0.0,
        }
    }
}

impl FluvialSettings {
    /// Finds the first value that does not go with others; each value alone is within its range.
    pub(crate) fn check(&self, path: &KeyPath, spacing_m: f64) -> Result<(), Fault> {
        path.key("trunk_m").times(self.trunk_m, 64.0..=4096.0, ("spacing_m", spacing_m))?;
        let finest = self.trunk_m / spacing_m / (1u32 << self.levels) as f64;
        if finest < 7.5 {
            let message = format!("the last of {} levels has its channels {finest:.1} vertices apart", self.levels);
            let hint = "8 or more are needed: fewer levels, a longer trunk_m or a smaller spacing_m";
            return Err(path.key("levels").fault(message, hint));
        }
        if let Some(basin_m) = self.basin_m {
            path.key("basin_m").times(basin_m, 2.0..=512.0, ("trunk_m", self.trunk_m))?;
        }
        self.uplift.mask.check(&path.key("uplift").key("mask"), spacing_m)?;
        if let Some(RockSettings { massive, layered, volcanic, soft, .. }) = self.rock
            && massive + layered + volcanic + soft <= 0.0
        {
            let message = "the land has no rock at all";
            return Err(path.key("rock").fault(message, "give massive, layered, volcanic or soft a part above 0"));
        }
        let widest_m = self.trunk_m / 8.0;
        path.key("lake_m").at_most(self.lake_m.unwrap_or(0.0), widest_m, "an eighth of trunk_m")
    }
}
