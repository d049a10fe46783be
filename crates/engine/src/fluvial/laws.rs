//! The laws of the land at one place: values from which slopes follow. They differ from place to place, over kilometres
//! and more.

use std::sync::Arc;

use super::fields::{Fields, SECONDS_A_YEAR, WIDEST_TROUGH, most_area};
use super::rock_laws::{self, RockFactors};
use super::settings::FluvialSettings;
use crate::geography::rock::{RockAtLarge, Rocks};
use crate::geography::{Geography, LEAST_UPLIFT, Setting};
use crate::geometry::smooth;
use crate::grain_point::Point;
use crate::noise::point_noise::{PointField, PointNoise};

/// The laws of the land at one place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Laws {
    /// Slope of hillsides.
    pub hill_slope: f64,
    /// Slope of a river that drains one cell of the trunk lattice, if nothing keeps it gentler.
    pub bed_slope: f64,
    /// Slope that no river exceeds, as a share of the slope of hillsides.
    pub channel_slope: f64,
    /// Half width of valley floors, as a share of the side of the area that drains there.
    pub valley: f64,
    /// Height in metres above which glaciers have shaped the valleys of tributaries; infinite where there were none.
    pub ice_m: f64,
    /// Height of a terrace in depths of its river; 0 where floors have no terraces.
    pub terrace_depths: f64,
    /// Height of levees, as a share of what the hillside rises over an eighth of the river's width.
    pub levees: f64,
    /// Share of the stretches of wide floors on which a glacier has left moraines.
    pub moraines: f64,
    /// Height in metres down to which glaciers come in the heads of valleys, about; infinite where there are none.
    pub glacier_m: f64,
    /// Metres of height by which crests are rounded off.
    pub crest_m: f64,
    /// Depth of gullies, as a share of what slope and spacing allow.
    pub gullies: f64,
    /// Depth of rills, on the same scale.
    pub rills: f64,
    /// Roughness of hillsides, 0 to 1.
    pub roughness: f64,
    /// Rain that runs off, in metres a year.
    pub runoff_m: f64,
    /// Share of the channels with water that have a lake on their way where there is room for one.
    pub lakes: f64,
    /// Share of the bends of trunks that have an old arm beside them where there is room for one.
    pub old_arms: f64,
    /// Share of the reaches of trunks that are braided where there is room for it.
    pub braids: f64,
    /// Share of the cells of fine levels that have no brook.
    pub left_out: f64,
    /// Sand that lies there: 0 outside sand seas, up to 1 where it is deepest.
    pub sand: f64,
}

/// Ranges of the laws of a whole world: the half width of floors, in mountains and on plains; gullies, where it is wet
/// and where it is dry; lakes, elsewhere and where ice sheets lay; the greatest share of old arms and of braids; and the
/// share of moraines. They are those of the presets of one land of each kind.
const WORLD_VALLEY: [f64; 2] = [0.018, 0.055];
const WORLD_GULLIES: [f64; 2] = [0.06, 0.5];
const WORLD_LAKES: [f64; 2] = [0.03, 0.5];
const WORLD_OLD_ARMS: f64 = 0.5;
const WORLD_BRAIDS: f64 = 0.2;
const WORLD_MORAINES: f64 = 0.8;

/// Strength of a rift from which on there are more lakes, and the further strength with which there are most.
const RIFT_LAKES: [f64; 2] = [0.15, 0.3];

/// Share of the cells that are left without a channel, so that confluences are not spaced too evenly. Chosen by eye.
const LEFT_OUT: f64 = 0.15;

/// The same share on plains that ice sheets have left.
const ICE_LEFT_OUT: f64 = 0.6;

/// Number of the finest levels whose density depends on the rock.
const ROCK_LEVELS: u32 = 2;

/// Runoff in metres a year from which on land counts as wet.
const WET_RUNOFF_M: f64 = 0.25;

/// Sand from which on it has buried all hillsides.
const BURIES: f64 = 0.2;

/// Least and greatest runoff of a place in metres a year.
const LEAST_RUNOFF_M: f64 = 0.0005;
const MOST_RUNOFF_M: f64 = 6.0;

/// Lowest line of ice in metres above the sea that is told from lower ones, which cover all land.
const LEAST_ICE_M: f64 = -5000.0;

/// Share of the root of the uplift in the slopes of rivers in a whole world.
const PLAINS_RISE: f64 = 0.15;

/// Metres above the lowest glaciers from which on valleys have wholly the shape that ice gives them. Chosen by eye.
const ICE_RISE_M: f64 = 300.0;

/// Height of a terrace in depths of its river. Chosen by eye.
const TERRACE_DEPTHS: f64 = 2.0;

/// Largest discharge of a spring as a share of that at its channel's mouth. With more, the channel's water would be a
/// stub beside the larger river. Chosen by eye; the stub would have the last quarter of the channel.
const MOST_SPRING: f64 = 0.8;

/// The source of the laws of each place.
#[derive(Debug)]
pub enum LawSource {
    /// Noise that says how fast the land rises, and the rocks, if they differ. All else is the same everywhere.
    Uplift(PointNoise, Option<Box<(Rocks, RockAtLarge)>>),
    /// The geography of a whole world.
    Geography(Arc<Geography>),
}

impl Laws {
    /// Returns the laws of a land with these settings, whose heights count from a datum in metres, as far as they are
    /// the same everywhere.
    pub fn everywhere(settings: &FluvialSettings, datum_m: f64) -> Laws {
        Laws {
            hill_slope: 0.0,
            bed_slope: 0.0,
            channel_slope: settings.channel_slope,
            valley: settings.valley,
            ice_m: settings.ice_m.map_or(f64::INFINITY, |ice_m| ice_m + datum_m),
            terrace_depths: if settings.terraces > 0 { TERRACE_DEPTHS } else { 0.0 },
            levees: settings.levees,
            moraines: settings.moraines,
            glacier_m: settings.glacier_m.map_or(f64::INFINITY, |glacier_m| glacier_m + datum_m),
            crest_m: settings.crest_m,
            gullies: settings.gullies,
            rills: settings.rills.unwrap_or(settings.gullies),
            roughness: settings.roughness,
            runoff_m: settings.runoff_m,
            lakes: settings.lakes,
            old_arms: settings.old_arms,
            braids: settings.braids,
            left_out: LEFT_OUT,
            sand: 0.0,
        }
    }

    /// Returns the least and the greatest value of each law over all places of a land with these settings, given the
    /// laws that hold [everywhere](Laws::everywhere). `has_geography` is true for a whole world.
    pub fn bounds(settings: &FluvialSettings, everywhere: Laws, datum_m: f64, has_geography: bool) -> [Laws; 2] {
        let [low, high] = settings.hill_slope;
        let bound = |hill_slope, uplift| Laws { hill_slope, bed_slope: settings.trunk_slope * uplift, ..everywhere };
        let (low, high) = (low.min(high), low.max(high));
        if !has_geography {
            let bounds = [bound(low, settings.uplift.least), bound(high, 1.0)];
            return if settings.rock.is_some() { Laws::bounds_on_rocks(bounds) } else { bounds };
        }
        let of_world = |end: usize, laws: Laws| Laws {
            valley: WORLD_VALLEY[end],
            gullies: WORLD_GULLIES[end],
            runoff_m: [LEAST_RUNOFF_M, MOST_RUNOFF_M][end],
            lakes: [0.0, WORLD_LAKES[1]][end],
            old_arms: [0.0, WORLD_OLD_ARMS][end],
            braids: [0.0, WORLD_BRAIDS][end],
            levees: [0.0, 1.0][end],
            ice_m: [LEAST_ICE_M + datum_m, f64::INFINITY][end],
            glacier_m: [LEAST_ICE_M + datum_m, f64::INFINITY][end],
            moraines: WORLD_MORAINES,
            left_out: [LEFT_OUT, ICE_LEFT_OUT][end],
            sand: [0.0, 1.0][end],
            ..laws
        };
        let least = bound(low, mixed_root(LEAST_UPLIFT, PLAINS_RISE));
        Laws::bounds_on_rocks([of_world(0, least), of_world(1, bound(high, 1.0))])
    }

    /// Widens the least and the greatest values of laws to those on any rock.
    fn bounds_on_rocks([least, most]: [Laws; 2]) -> [Laws; 2] {
        let (low, high) = (least.on(&rock_laws::LEAST), most.on(&rock_laws::MOST));
        // The more brooks there are, the fewer are left out.
        let left_out = [least.on(&rock_laws::MOST), most.on(&rock_laws::LEAST)].map(|laws| laws.left_out);
        [Laws { left_out: left_out[0], ..low }, Laws { left_out: left_out[1], ..high }]
    }

    /// Returns the laws on a rock with these factors.
    fn on(self, rock: &RockFactors) -> Laws {
        Laws {
            hill_slope: self.hill_slope * rock.hill_slope,
            bed_slope: self.bed_slope * rock.bed_slope,
            valley: self.valley * rock.valley,
            crest_m: self.crest_m * rock.crest_m,
            gullies: (self.gullies * rock.gullies).min(1.0),
            rills: (self.rills * rock.gullies).min(1.0),
            left_out: (1.0 - (1.0 - self.left_out) * rock.brooks).max(0.0),
            ..self
        }
    }

    /// Returns the slope of a river, by the area that it drains, in cells of the trunk lattice.
    pub fn river_slope(&self, area: f64) -> f64 {
        let slope = self.bed_slope / area.sqrt();
        // Stay below a fixed share of the hill slope; otherwise hillsides could not rise from the channel.
        slope / (1.0 + slope / self.steepest_river())
    }

    /// Returns the density of the channels of a level as a multiple of that where all rock is alike.
    pub fn brook_density(&self, fields: &Fields, level: u32) -> f64 {
        if fields.is_thinned_by_rock(level) { (1.0 - self.left_out) / (1.0 - LEFT_OUT) } else { 1.0 }
    }

    /// Returns the slope that no river exceeds.
    pub fn steepest_river(&self) -> f64 {
        self.channel_slope * self.hill_slope
    }

    /// Returns the share, from 0 to 1, to which glaciers have shaped a valley whose bed lies at this height.
    pub fn iced(&self, level_m: f64) -> f64 {
        smooth((level_m - self.ice_m) / ICE_RISE_M)
    }

    /// Returns the half width in grains of the floor of a level's valley, by the area that drains there and the height
    /// of its bed.
    pub fn trough(&self, fields: &Fields, level: u32, area: f64, level_m: f64) -> f64 {
        self.water_trough(fields, area) + fields.most_iced(level) * self.iced(level_m)
    }

    /// Returns the half width in grains that no floor of a level exceeds whose valley is a tributary's.
    pub fn widest_trough(&self, fields: &Fields, level: u32) -> f64 {
        let iced = if self.ice_m < f64::INFINITY { fields.most_iced(level) } else { 0.0 };
        self.water_trough(fields, most_area(level)) + iced
    }

    /// Returns the half width in grains of a valley's floor that water alone has made, by the area that drains there.
    fn water_trough(&self, fields: &Fields, area: f64) -> f64 {
        // Like the river's width, the floor's grows with the root of the area, but less and less for large rivers.
        let share = self.valley * area.sqrt() / WIDEST_TROUGH;
        fields.widest_water_trough() * share / (1.0 + share * share).sqrt()
    }

    /// Returns the discharge in cubic metres a second that runs off an area, in cells of the trunk lattice.
    pub fn discharge_m3s(&self, fields: &Fields, area: f64) -> f64 {
        let side_m = fields.side(0) as f64 * fields.metres_a_grain();
        area * side_m * side_m * self.runoff_m / SECONDS_A_YEAR
    }

    /// Tells whether a tributary of a level holds water, if these are the laws at its head. One that would hold water
    /// on its very last stretch alone holds none.
    pub fn is_wet(&self, fields: &Fields, level: u32) -> bool {
        MOST_SPRING * self.discharge_m3s(fields, most_area(level)) >= fields.spring_m3s()
    }

    /// Returns the discharge in cubic metres a second at the mouth of a tributary of a level, if these are the laws at
    /// its head: less than that of a spring if the tributary holds no water.
    pub fn mouth_m3s(&self, fields: &Fields, level: u32) -> f64 {
        let mouth_m3s = self.discharge_m3s(fields, most_area(level));
        if self.is_wet(fields, level) { mouth_m3s } else { mouth_m3s.min(fields.spring_m3s().next_down()) }
    }
}

/// Returns a number, of which a share is replaced by its root.
fn mixed_root(number: f64, share: f64) -> f64 {
    number + (number.sqrt() - number) * share
}

impl Fields {
    /// Returns the laws at a point.
    pub fn laws(&self, at: Point) -> Laws {
        self.all_laws(&[at])[0]
    }

    /// Returns the [laws](Fields::laws) at any number of points, for callers that know all points beforehand.
    pub fn all_laws(&self, points: &[Point]) -> Vec<Laws> {
        match &self.law_source {
            LawSource::Uplift(noise, rocks) => {
                let laws = noise.at_all(points).into_iter().map(|noise| self.laws_by(noise));
                let Some((rocks, country)) = rocks.as_deref() else { return laws.collect() };
                let wet = smooth(self.settings().runoff_m / WET_RUNOFF_M);
                let rocks = rocks.at_all(points, &vec![*country; points.len()]);
                laws.zip(rocks).map(|(laws, rock)| laws.on(&RockFactors::new(&rock, wet))).collect()
            }
            LawSource::Geography(geography) => {
                let mut laws: Vec<Laws> =
                    geography.settings_at(points).iter().map(|setting| self.laws_of(setting)).collect();
                self.shape_by_volcanoes(points, &mut laws);
                laws
            }
        }
    }

    /// Tells whether rock decides where channels of a level begin. Larger rivers come from further away, and cross any
    /// rock.
    fn is_thinned_by_rock(&self, level: u32) -> bool {
        level + ROCK_LEVELS >= self.levels()
    }

    /// Tells whether the cell of a level with this head has no channel, by a chance from 0 to 1.
    pub(super) fn leaves_out(&self, level: u32, head: Point, chance: f64) -> bool {
        if !self.is_thinned_by_rock(level) {
            return chance < LEFT_OUT;
        }
        let [least, most] = [self.least_laws(), self.most_laws()].map(|laws| laws.left_out);
        chance < most && (chance < least || chance < self.laws(head).left_out)
    }

    /// Returns the laws where the uplift's noise has this value: the land rises at a rate from `uplift.least` to 1.
    fn laws_by(&self, noise: f64) -> Laws {
        let FluvialSettings { uplift, hill_slope: [low, high], trunk_slope, .. } = self.settings();
        let t = ((noise - uplift.mask.from) / (uplift.mask.to - uplift.mask.from)).clamp(0.0, 1.0);
        let uplift = uplift.least + (1.0 - uplift.least) * t * t * (3.0 - 2.0 * t);
        Laws { hill_slope: low + (high - low) * uplift, bed_slope: trunk_slope * uplift, ..self.everywhere }
    }

    /// Returns the laws of a place of a whole world.
    fn laws_of(&self, setting: &Setting) -> Laws {
        let Setting { land, rock, climate, sand } = setting;
        let FluvialSettings { hill_slope: [low, high], trunk_slope, .. } = self.settings();
        // Hills are steep long before their rivers are: a tenth of the uplift of high mountains makes a fifth of their
        // slopes. So much of it lifts the plains that half of all land lies above 500 m, as on Earth.
        let buried = smooth(sand / BURIES);
        let steepness = mixed_root(land.uplift, 0.5) * (1.0 - buried);
        let bed_slope = trunk_slope * mixed_root(land.uplift, PLAINS_RISE);
        let planned_m = land.planned_m().max(0.0);
        // Under an ice sheet nothing runs: its ice goes to the sea.
        let under_ice = setting.is_under_ice();
        let runoff_m = climate.runoff_m(planned_m).clamp(LEAST_RUNOFF_M, MOST_RUNOFF_M);
        let runoff_m = runoff_m + (LEAST_RUNOFF_M - runoff_m) * smooth(2.0 * under_ice);
        let (wet, flat) = (smooth(runoff_m / WET_RUNOFF_M), land.flatness());
        // Ice has scoured hollows where it once lay thick on the land, and left no order in its brooks.
        let iced_over = setting.was_under_ice();
        // The floor of a rift sinks unevenly.
        let hollow = iced_over.max(smooth((land.rift - RIFT_LAKES[0]) / RIFT_LAKES[1]));
        let between = |[least, most]: [f64; 2], share: f64| least + (most - least) * share;
        Laws {
            hill_slope: low + (high - low) * steepness,
            bed_slope,
            valley: between(WORLD_VALLEY, flat),
            ice_m: climate.ice_age_snow_line_m().max(LEAST_ICE_M) + self.datum_m(),
            glacier_m: climate.snow_line_m().max(LEAST_ICE_M) + self.datum_m(),
            gullies: between(WORLD_GULLIES, (1.0 - wet) * (1.0 - buried)),
            runoff_m,
            lakes: wet * between(WORLD_LAKES, hollow) * (1.0 - under_ice),
            left_out: LEFT_OUT + (ICE_LEFT_OUT - LEFT_OUT) * iced_over * flat,
            old_arms: wet * flat * WORLD_OLD_ARMS,
            braids: flat * WORLD_BRAIDS,
            levees: flat,
            moraines: WORLD_MORAINES,
            sand: *sand,
            ..self.everywhere
        }
        .on(&RockFactors::new(rock, wet))
    }
}
