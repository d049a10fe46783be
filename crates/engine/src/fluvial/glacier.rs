//! Glaciers: ice in the heads of high valleys.
//!
//! The surface of the ice is level across the valley and falls with the valley's floor, away from the valley's head.
//! Where the surface is higher than the land, there is ice. It ends in a steep front where the floor is too low for
//! ice, or holds a river. Ice is a kind of ground and does not change heights: otherwise water would be dammed where
//! ice meets brooks, which run on under the ice.
//!
//! To judge the numbers chosen by eye, look at the cirques of `alps`.

use std::sync::Arc;

use glam::DVec2;

use super::channel::{Channel, Knot, ways};
use super::fields::Fields;
use super::segment::{LEVEL, Segments};
use super::stamp::{self, Stamp};
use super::valley::Valleys;
use super::warp::Displaced;
use crate::clock::Clock;
use crate::geometry::{length, lerp, smooth};
use crate::grain_point::{Point, chance};
use crate::grid::Grid;
use crate::hash::{self, Draw, Stream};
use crate::stop::Stopped;

/// The glaciers of a world.
#[derive(Debug)]
pub struct Glaciers {
    fields: Arc<Fields>,
    seed: u64,
}

/// Least height in metres above the lowest glaciers of the floor where a glacier begins; all glaciers end within the
/// same height. A glacier is fed by snow that falls higher up. Chosen by eye.
const FED_M: f64 = 250.0;

/// Least and greatest length of a glacier in metres: a shorter one would be a patch of snow.
const LONG_M: [f64; 2] = [450.0, 2200.0];

/// Half width in metres of the narrowest floor that has a glacier.
const LEAST_FLOOR_M: f64 = 75.0;

/// Parts of a glacier between the places at which the height of its floor is known.
const PARTS: usize = 8;

/// Thickness of the ice in its middle, as a share of the half width of its floor; and its limits in metres. Chosen by
/// eye.
const THICK: f64 = 0.3;
const THICK_M: [f64; 2] = [15.0, 50.0];

/// Drop of the tongue's surface from its middle to its sides, as a share of its thickness.
const BOWED: f64 = 0.7;

/// Slope of the firn at the head, and slope of the ice's edge where no valley side holds it.
const FIRN: f64 = 0.12;
const EDGE: f64 = 0.5;

/// Metres below a glacier's floor down to which its ice spills into another valley, and metres over which it fades out
/// there.
const SPILLED_M: (f64, f64) = (25.0, 15.0);

/// A glacier. Its head is its fixed point as a stamp.
#[derive(Clone, Debug)]
struct Glacier {
    head: Point,
    /// Unit vector from the head to the front.
    down: DVec2,
    long_m: f64,
    wide_m: f64,
    thick_m: f64,
    /// Heights of the floor and of the ice's surface, from head to front.
    floor_m: [f64; PARTS + 1],
    ice_m: [f64; PARTS + 1],
}

impl Stamp for Glacier {
    fn reach(&self) -> (Point, f64) {
        (self.head, self.long_m + 2.0 * self.wide_m)
    }
}

impl Glacier {
    /// Returns the range of heights in which all of the glacier's floor and ice lie.
    fn range_m(&self) -> [f64; 2] {
        // Beds fall. Behind the head the ice rises over no more than its half width, and falls beyond. One metre allows
        // for rounding.
        [self.floor_m[PARTS] - 1.0, self.ice_m[0] + FIRN * self.wide_m + 1.0]
    }

    /// Returns the heights of the floor and of the ice's surface at an offset in metres from the head.
    fn at(&self, off: DVec2) -> [f64; 2] {
        let (along_m, across_m) = (off.dot(self.down), self.down.perp_dot(off).abs());
        let part = (along_m / self.long_m).clamp(0.0, 1.0) * PARTS as f64;
        let first = (part as usize).min(PARTS - 1);
        let of = |heights_m: &[f64; PARTS + 1]| {
            lerp([heights_m[first], heights_m[first + 1] - heights_m[first]], part - first as f64)
        };
        // The tongue is bowed up in the middle; at the head the ice rises, and it falls off where nothing holds it.
        let bowed_m = self.thick_m * BOWED * (part / PARTS as f64) * (across_m / self.wide_m).powi(2);
        let above_m = (-along_m).max(0.0);
        let beside_m = (length([above_m, across_m]) - self.wide_m).max(0.0);
        let beyond_m = beside_m + (along_m - self.long_m).max(0.0);
        [of(&self.floor_m), of(&self.ice_m) + FIRN * above_m - bowed_m - (EDGE + FIRN) * beyond_m]
    }
}

impl Glaciers {
    /// Returns the glaciers of a world with these fields; `None` if it has none.
    pub fn new(fields: &Arc<Fields>, seed: u64) -> Option<Glaciers> {
        let glaciers = || Glaciers { fields: Arc::clone(fields), seed: hash::stream(seed, Stream::Glaciers) };
        (fields.least_laws().glacier_m < f64::INFINITY).then(glaciers)
    }

    /// Returns the thickness of the ice in metres at each node.
    pub fn ice_m(
        &self,
        segments: &Segments,
        nodes: &Displaced,
        valleys: &Valleys,
        clock: &Clock,
    ) -> Result<Grid<f32>, Stopped> {
        let fields = &self.fields;
        let glaciers: Vec<Glacier> = segments.channels.iter().filter_map(|channel| self.glacier(channel)).collect();
        let mut ice_m = Grid::filled(nodes.area, 0.0);
        stamp::nodes_of((fields, clock), &glaciers, nodes, |index, vertex, near| {
            let land_m = valleys.height_m[index] as f64;
            // Most nodes near a glacier are higher than all of it, or too far below it.
            let may_hold = |glacier: &&&Glacier| {
                let [lowest_m, highest_m] = glacier.range_m();
                land_m < highest_m && land_m > lowest_m - SPILLED_M.0
            };
            let thickest_m = near.iter().filter(may_hold).fold(0.0, |most_m: f64, glacier| {
                let off_m = stamp::off_m(fields, nodes, index, vertex, glacier.head);
                let [floor_m, surface_m] = glacier.at(off_m);
                let is_beyond = surface_m <= land_m || off_m.length() >= glacier.reach().1;
                let held = smooth((land_m - floor_m + SPILLED_M.0) / SPILLED_M.1);
                if is_beyond { most_m } else { most_m.max((surface_m - land_m) * held) }
            });
            ice_m.values_mut()[index] = thickest_m as f32;
        })?;
        Ok(ice_m)
    }

    /// Returns the glacier in the valley of a channel, if there is one.
    fn glacier(&self, channel: &Channel) -> Option<Glacier> {
        let fields = &self.fields;
        let ((level, x, y), metres) = (channel.id, fields.metres_a_grain());
        let (head, line_m) = (channel.knots[0], channel.laws.glacier_m);
        // Trunks begin at other trunks, and the finest valleys are younger than the ice.
        if level == 0 || level + 1 >= fields.levels() || head.level_m < line_m + FED_M {
            return None;
        }
        let seed = hash::network_level(self.seed, level);
        let front_m = line_m + FED_M * chance(seed, (x, y), Draw::Glacier, 0);
        // The glacier ends above the first river or lake.
        let is_iced = |knot: &&Knot| {
            knot.level_m > front_m && !fields.holds_water(knot.discharge_m3s) && knot.pool_m == f64::NEG_INFINITY
        };
        let iced = channel.knots.iter().take_while(is_iced).count();
        let long = ways(&channel.knots[..iced]).pop().map_or(0.0, |long| long.min(LONG_M[1] / metres));
        if long * metres < LONG_M[0] {
            return None;
        }
        let front = channel.at(channel.down(long)?).at;
        let chord = front.from(head.at);
        let long_m = chord.length() * metres;
        let wide_m = f64::from(channel.sections[0].trough) * metres;
        let thick_m = (THICK * LEVEL * wide_m).clamp(THICK_M[0], THICK_M[1]);
        let (mut floor_m, mut ice_m) = ([0.0; PARTS + 1], [0.0; PARTS + 1]);
        for part in 0..=PARTS {
            let share = part as f64 / PARTS as f64;
            let place = channel.down(share * long * (1.0 - 1e-9))?;
            floor_m[part] = channel.at(place).level_m;
            // The ice thins towards its front, ever faster.
            ice_m[part] = floor_m[part] + thick_m * (1.0 - share * share).sqrt();
        }
        // Even where the floor goes down in steps, the ice's surface falls.
        for part in (0..PARTS).rev() {
            ice_m[part] = ice_m[part].max(ice_m[part + 1] + 1.0);
        }
        let down = chord * metres / long_m.max(1e-9);
        let glacier = Glacier { head: head.at, down, long_m, wide_m, thick_m, floor_m, ice_m };
        let (_, reach_m) = glacier.reach();
        let is_narrow = wide_m * LEVEL < LEAST_FLOOR_M;
        if is_narrow || long_m < LONG_M[0] / 2.0 || reach_m > stamp::known_m(fields, channel.id.0) {
            return None;
        }
        Some(glacier)
    }
}

#[cfg(test)]
mod tests {
    use super::PARTS;
    use crate::area::Area;
    use crate::clock::Clock;
    use crate::fluvial::Fluvial;
    use crate::land::WaterKind;

    fn alps(glacier_m: f64) -> Fluvial {
        Fluvial::of_preset("alps", 61, |settings| settings.glacier_m = Some(glacier_m))
    }

    #[test]
    fn glaciers_lie_high_and_windows_agree_on_them() {
        let fluvial = alps(2300.0);
        let area = Area::new(11_008, -22_400, 256, 384);
        let land = fluvial.land(area, &Clock::default()).unwrap();
        let water = land.water.unwrap();
        let ice_m = water.ice_m.unwrap();
        let iced = area.vertices().filter(|(x, y)| ice_m.at(*x, *y) > 1.0).count();
        assert!(iced > 500 && iced < area.len() / 4, "{iced} vertices");
        for (x, y) in area.vertices().filter(|(x, y)| ice_m.at(*x, *y) > 1.0) {
            assert!(land.heights.at(x, y) > 2250.0, "{} m at {x},{y}", land.heights.at(x, y));
            assert_ne!(water.kind.at(x, y), WaterKind::Lake);
        }
        for part in area.halves() {
            let of_part = fluvial.land(part, &Clock::default()).unwrap().water.unwrap().ice_m.unwrap();
            assert_eq!(of_part, ice_m.part(part));
        }
    }

    #[test]
    fn glaciers_end_where_they_are_told_to_and_are_longer_where_that_is_lower() {
        let whole_m = [2300.0, 2600.0].map(|line_m| {
            let fluvial = alps(line_m);
            let glaciers = fluvial.glaciers.as_ref().unwrap();
            let segments =
                fluvial.segments(Area::new(10_000, -23_400, 2048, 2048), fluvial.detail, &Clock::default()).unwrap();
            let all: Vec<_> = segments.channels.iter().filter_map(|channel| glaciers.glacier(channel)).collect();
            assert!(all.len() > 10, "{} glaciers", all.len());
            for glacier in &all {
                assert!(glacier.floor_m[PARTS] > line_m, "{glacier:?} comes below {line_m} m");
                assert!(glacier.ice_m.windows(2).all(|pair| pair[0] > pair[1]), "the ice of {glacier:?} rises");
            }
            all.iter().map(|glacier| glacier.long_m).sum::<f64>()
        });
        assert!(whole_m[0] > whole_m[1], "{whole_m:?} m of glaciers");
    }
}
