//! Lakes: hollows in the beds of channels.
//!
//! A channel's bed is dug out on its way, or where it ends in a sink, and water stands in the hollow as high as the bed is
//! where it goes on. The valley sides rise from the hollow's floor as from any bed, and tributaries come down to it: so
//! shores are contours of the land, their bays the lower ends of side valleys, and every lake has one outlet.

use super::channel::{Channel, Knot, ways};
use super::fields::Fields;
use super::point::{Point, chance};
use super::segment::rise;
use super::trunk::NodeId;
use crate::geometry::smooth;
use crate::hash::Draw;
use crate::lines::LakeId;

/// The height of a lake's surface where there is none.
pub const NO_LAKE: f64 = f64::NEG_INFINITY;

/// Half widths of lakes, as shares of the widest of their level: least, and so much more by chance. Chosen by eye.
const WIDTHS: (f64, f64) = (0.4, 0.6);

/// How much wider lakes are than those of the next finer level. Chosen by eye.
const WIDER: f64 = 0.62;

/// Half widths of its valley's floor that a lake has at least: of less it would have no depth.
const COVERS: f64 = 1.1;

/// Half widths that a lake is long where there is room, least, and so much more by chance: real ones in troughs are 3 to 10
/// times as long as wide. Chosen by eye.
const LENGTHS: (f64, f64) = (8.0, 9.0);

/// Half widths that it is long at least: a shorter one would be round, and the less deep and so the narrower it is where
/// the bed is steep.
const LEAST_LENGTH: f64 = 8.0;

/// Share of a channel's way at which its lake ends: first, and so much later by chance.
const SILLS: (f64, f64) = (0.5, 0.4);

/// Share of a lake's length over which its floor falls from the sill, and from which on it rises to the inlet.
const FALLS: f64 = 0.3;
const RISES: f64 = 0.35;

/// How steep a lake's floor is at most where it falls from the sill or rises to the inlet, as a share of the hillside's
/// slope: of trunks, whose sides count as if their beds were level, and of others.
/// A [smooth] rise is half again as steep in its middle as on the whole.
const STEEPEST_TRUNK: f64 = 0.3;
const STEEPEST_SHARE: f64 = 0.5;
const MIDDLE: f64 = 1.5;

/// Half widths of a lake within which the coast is still higher than its water. Chosen by eye.
const COAST_WIDTHS: f64 = 3.0;

/// Share of its depth that a lake has at least: what has less room is none.
const LEAST_DEPTH: f64 = 0.2;

/// The depth in metres that it has at least: water without depth is no lake.
const LEAST_DEPTH_M: f64 = 0.5;

/// The depth in metres for which there is room all along a lake, at least.
const LEAST_ROOM_M: f64 = 0.25;

/// The depth in metres that is left where others are too near for more, and what falls from one knot to the next at least
/// above the lake.
const SHALLOWS_M: f64 = 0.02;
const LEAST_FALL_M: f64 = 0.001;

/// Straight segments of a channel that has a lake, at least: of fewer its floor would have corners.
const LEAST_SEGMENTS: f64 = 32.0;

/// Half widths of a lake that lie between its middle and other channels of its level at least, whose beds do not know of it.
const CLEAR: f64 = 2.5;

/// What is left open of a lake's depth where smaller streams come in, from one level to the next as a share: streams fill
/// what they have dug, and it would be a needle of water. Chosen by eye.
const LEFT_OPEN: f64 = 0.6;

/// How much gentler the sides of a channel are than those of the channel whose lake it comes to, at most.
const GENTLER: f64 = 1.5;

/// A lake that a channel may have.
#[derive(Clone, Copy, Debug)]
pub struct Hollow {
    /// Half its width in grains, where it is widest.
    half_width: f64,
    /// Half widths that it is long at most.
    length: f64,
    /// The share of its channel's way at which it ends.
    sill: f64,
}

impl Hollow {
    /// The lake of the channel of that id in a level, drawn with the level's seed.
    pub fn new(fields: &Fields, seed: u64, level: u32, id: NodeId) -> Hollow {
        let by_chance = |(least, more): (f64, f64), draw| least + more * chance(seed, id, draw, 0);
        Hollow {
            half_width: Hollow::widest(fields, level) * by_chance(WIDTHS, Draw::LakeWidth),
            length: by_chance(LENGTHS, Draw::LakeLength),
            sill: by_chance(SILLS, Draw::LakeSill),
        }
    }

    /// Half the width in grains that no lake of a level exceeds.
    pub fn widest(fields: &Fields, level: u32) -> f64 {
        fields.lake_half_width() * WIDER.powi(level as i32)
    }

    /// The same lake in a valley whose floor has that half width in grains: it covers it.
    pub fn on_floor(self, trough: f64) -> Hollow {
        Hollow { half_width: self.half_width.max(COVERS * trough), ..self }
    }

    /// Half its width in grains.
    pub fn half_width(&self) -> f64 {
        self.half_width
    }

    /// The depth in metres at which a valley with those sides and that half width of its floor is as wide as the lake.
    pub fn depth_m(&self, fields: &Fields, hill_slope: f64, trough: f64) -> f64 {
        depth_m(fields, hill_slope, trough, self.half_width)
    }

    /// Digs the lake into a channel, and says whether there is room for it. `is_own` tells whether a place lies on no floor of
    /// a larger valley, `least_m` below which height nothing may be dug there, and `others` how many grains away other channels
    /// of the level are.
    pub fn dig(
        &self,
        fields: &Fields,
        channel: &mut Channel,
        is_own: impl Fn(Point) -> bool,
        least_m: impl Fn(Point) -> f64,
        others: impl Fn(Point) -> f64,
    ) -> bool {
        let hill_slope = channel.hill_slope;
        let whole = ways(&channel.knots).pop().expect("a channel has knots");
        let mut knots = refined(&channel.knots, whole / LEAST_SEGMENTS);
        let way = ways(&knots);
        let sill = way.partition_point(|way| *way < self.sill * whole).clamp(1, knots.len() - 2);
        let Knot { level_m, area, .. } = knots[sill];
        let trough = fields.trough(channel.id.0, area, level_m);
        let lake = self.on_floor(trough);
        if lake.half_width < 2.0 * fields.least_lake(area) || lake.half_width > fields.lake_half_width() {
            return false;
        }
        let wanted_m = lake.depth_m(fields, hill_slope, trough);
        let shallowest_m = (LEAST_DEPTH * wanted_m).max(LEAST_DEPTH_M);
        let steepest = match channel.id.0 {
            0 => STEEPEST_TRUNK * hill_slope,
            _ => STEEPEST_SHARE * hill_slope,
        };
        // The deepest that it may be if it begins at a knot; of equal ones the longest.
        let deepest_m = |inlet: usize| {
            let long_m = (way[sill] - way[inlet]) * fields.metres_a_grain();
            let rise_m = steepest / MIDDLE * long_m * (1.0 - RISES) - (knots[inlet].level_m - level_m);
            let narrow_m = depth_m(fields, hill_slope, trough, (way[sill] - way[inlet]) / LEAST_LENGTH);
            wanted_m.min(rise_m).min(narrow_m).min(steepest / MIDDLE * long_m * FALLS)
        };
        // Never from the head: there the channel above goes on.
        let inlets = (1..sill).rev().take_while(|inlet| way[sill] - way[*inlet] <= lake.length * lake.half_width);
        let best = inlets.map(|inlet| (deepest_m(inlet), inlet)).max_by(|a, b| a.0.total_cmp(&b.0));
        let Some((_, mut inlet)) = best else { return false };
        let clear_m = |at: Point| level_m - depth_m(fields, hill_slope, trough, others(at) / CLEAR);
        let floor_m = |at: Point| clear_m(at).max(least_m(at));
        // Where there is no room for water it would be two lakes: it begins below that.
        let is_narrow = |inlet: usize, knot: &usize| {
            let up = (way[sill] - way[*knot]) / (way[sill] - way[inlet]);
            up > FALLS && floor_m(knots[*knot].at) > level_m - LEAST_ROOM_M
        };
        while let Some(narrow) = (inlet..sill).rev().find(|knot| is_narrow(inlet, knot)) {
            inlet = narrow + 1;
        }
        let deep_m = if inlet < sill { deepest_m(inlet) } else { 0.0 };
        if deep_m < shallowest_m {
            return false;
        }
        let may_lie = |knot: &Knot| lake.is_inland(fields, knot.at, level_m) && is_own(knot.at);
        if !knots[inlet..=sill].iter().all(may_lie) {
            return false;
        }
        dig(&mut knots[inlet..=sill], level_m, deep_m, true, floor_m);
        // Beside others there may be no room for its depth.
        if !knots[inlet..sill].iter().any(|knot| knot.level_m < level_m - shallowest_m) {
            return false;
        }
        // The sill itself is the river's again.
        knots[sill].pool_m = NO_LAKE;
        channel.knots = knots;
        channel.lake = Some(LakeId(channel.id));
        true
    }

    /// Whether a lake of that level at a place is one that the coast does not come near.
    pub fn is_inland(&self, fields: &Fields, at: Point, level_m: f64) -> bool {
        let shore_m = fields.inland_m(at) - COAST_WIDTHS * self.half_width * fields.metres_a_grain();
        level_m >= fields.lowest_lake_m() && (!fields.has_sea() || fields.coast_m(shore_m as f32) as f64 > level_m)
    }

    /// Digs the part of the lake at a sink that lies in a channel which ends there, where it is so deep.
    pub fn dig_sink(&self, channel: &mut Channel, depth_m: f64) {
        let way = ways(&channel.knots);
        let last = way.len() - 1;
        let most = self.length * self.half_width;
        let inlet = (1..last).find(|inlet| way[last] - way[*inlet] <= most).unwrap_or(last - 1);
        let level_m = channel.knots[last].level_m;
        dig(&mut channel.knots[inlet..], level_m, depth_m, false, |_| f64::NEG_INFINITY);
    }
}

/// The depth in metres at which a valley with those sides and that half width of its floor is so many grains wide to each
/// side.
fn depth_m(fields: &Fields, hill_slope: f64, trough: f64, half_width: f64) -> f64 {
    hill_slope * fields.metres_a_grain() * rise(half_width, 0.0, trough, 0.0)
}

/// The same course with more knots, so that none of its segments is longer than so many grains.
fn refined(knots: &[Knot], longest: f64) -> Vec<Knot> {
    let between = knots.windows(2).flat_map(|pair| {
        let parts = (pair[0].at.distance(pair[1].at) / longest.max(1.0)).ceil().max(1.0) as usize;
        (0..parts).map(move |part| pair[0].towards(&pair[1], part as f64 / parts as f64))
    });
    between.chain(knots.last().copied()).collect()
}

/// Digs out the bed from a lake's inlet to its sill, or to the middle of one that has no outlet, and nowhere deeper than
/// some height at a place.
fn dig(knots: &mut [Knot], level_m: f64, depth_m: f64, has_outlet: bool, least_m: impl Fn(Point) -> f64) {
    let way = ways(knots);
    let end = way[way.len() - 1];
    for (knot, way) in knots.iter_mut().zip(way) {
        let up = (end - way) / end.max(1.0);
        let out = if has_outlet { smooth(up / FALLS) } else { 1.0 };
        // However little room there is, some water is left all the way, so that it is one lake.
        let floor_m = (level_m - depth_m * out).max(least_m(knot.at)).min(level_m - SHALLOWS_M * out);
        knot.level_m = floor_m + (knot.level_m - floor_m) * smooth((up - RISES) / (1.0 - RISES));
        knot.pool_m = level_m;
    }
    // Where the room changes from place to place, what comes down to the lake falls all the same.
    for index in (0..knots.len() - 1).rev() {
        let below_m = knots[index + 1].level_m;
        if knots[index].level_m >= level_m {
            knots[index].level_m = knots[index].level_m.max(below_m + LEAST_FALL_M);
        }
    }
}

/// Lets the water of a lake stand no higher than its sill, and as far up as that is, once beds have been lowered; and its floor
/// no higher than that from its deepest place to the sill: what was shallows before would be a dam.
pub fn fill(knots: &mut [Knot]) {
    for index in (0..knots.len() - 1).rev() {
        let below = knots[index + 1];
        // Never to the head: there the channel above goes on.
        let is_drowned = index > 0 && below.pool_m > below.level_m;
        if knots[index].pool_m > NO_LAKE || is_drowned {
            knots[index].pool_m = if below.pool_m > NO_LAKE { below.pool_m } else { below.level_m };
        }
    }
    for lake in knots.chunk_by_mut(|one, other| one.pool_m == other.pool_m).filter(|lake| lake[0].pool_m > NO_LAKE) {
        let deepest = (0..lake.len()).min_by(|a, b| lake[*a].level_m.total_cmp(&lake[*b].level_m)).unwrap_or(0);
        for knot in &mut lake[deepest..] {
            knot.level_m = knot.level_m.min(knot.pool_m - SHALLOWS_M);
        }
    }
}

/// Grains that the floor of a lake lies under its water at most in a channel of a level, on sides of slope 1: its own lake, or
/// what is left open of a larger one where it comes to that.
pub fn most_sunk(fields: &Fields, level: u32) -> f64 {
    let own = Hollow::widest(fields, level).max(COVERS * fields.widest_trough(level));
    (GENTLER * own).min(fields.lake_half_width())
}

/// Height to which the mouth of a valley of a level is filled that ends in a lake of a larger one, at a floor so high.
pub fn filled_m(lake: LakeId, pool_m: f64, floor_m: f64, level: u32) -> f64 {
    pool_m - (pool_m - floor_m) * LEFT_OPEN.powi((level - lake.0.0) as i32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fluvial::Fluvial;
    use crate::preset::Preset;

    #[test]
    fn a_lake_whose_sill_is_lowered_has_no_dam_before_it() {
        let knot = |level_m: f64, pool_m: f64| Knot { at: Point { x: 0, y: 0 }, level_m, area: 1.0, pool_m };
        let lake = [560.0, 547.0, 537.0, 541.0, 546.0, 546.9].map(|level_m| knot(level_m, 547.0));
        let mut knots = [&[knot(580.0, NO_LAKE)], &lake[..], &[knot(541.2, NO_LAKE), knot(530.0, NO_LAKE)]].concat();
        fill(&mut knots);
        let water_m = 541.2 - SHALLOWS_M;
        let levels_m: Vec<f64> = knots.iter().map(|knot| knot.level_m).collect();
        assert_eq!(levels_m, [580.0, 560.0, 547.0, 537.0, 541.0, water_m, water_m, 541.2, 530.0]);
        assert!(knots[1..7].iter().all(|knot| knot.pool_m == 541.2));
    }

    #[test]
    fn a_lake_has_water_all_along() {
        let (_, preset) = Preset::load("highlands").unwrap();
        let mut settings = preset.fluvial.unwrap();
        settings.lakes = 1.0;
        let fluvial = Fluvial::new(&settings, preset.spacing_m, None, 3, None);
        let mut lakes = 0;
        for level in 1..4 {
            let side = 16 * fluvial.fields().side(level);
            fluvial.network().channels(level, [Point { x: -side, y: -side }, Point { x: side, y: side }], |channel| {
                if channel.lake != Some(LakeId(channel.id)) {
                    return;
                }
                lakes += 1;
                let depths: Vec<f64> = channel
                    .knots
                    .iter()
                    .filter(|knot| knot.pool_m > NO_LAKE)
                    .map(|knot| knot.pool_m - knot.level_m)
                    .collect();
                // Up from the deepest place it comes to its inlet, and before that to no shallows.
                let deepest = (0..depths.len()).max_by(|a, b| depths[*a].total_cmp(&depths[*b])).unwrap();
                let shallow = depths[..deepest].iter().rposition(|depth| *depth < 0.1).map_or(0, |shallow| shallow + 1);
                let beyond = depths[..shallow].iter().copied().fold(0.0, f64::max);
                assert!(beyond < LEAST_ROOM_M, "{:?}: {depths:?}", channel.id);
            });
        }
        assert!(lakes > 100, "{lakes} lakes");
    }
}
