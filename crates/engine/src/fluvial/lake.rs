//! Lakes: hollows in the beds of channels.
//!
//! A channel's bed is dug out on its way, or where it ends in a sink, and water fills the hollow up to the level of the
//! bed at its outlet. The valley sides rise from the hollow's floor as from any bed, and tributaries run down to the
//! lake. So shores are contours of the land, bays are the lower ends of side valleys, and every lake on a channel's way
//! has one outlet.
//!
//! To judge the numbers chosen by eye, look at the lakes of `alps` and `highlands`.

use super::channel::{Channel, Knot, ways};
use super::fields::Fields;
use super::segment::rise;
use super::trunk_lattice::NodeId;
use crate::geometry::smooth;
use crate::grain_point::{Point, chance};
use crate::hash::Draw;
use crate::lines::LakeId;

/// The level of a lake's surface where there is no lake.
pub const NO_LAKE: f64 = f64::NEG_INFINITY;

/// Half widths of lakes as shares of the widest of their level: the least value, and the range that chance adds. Chosen
/// by eye.
const WIDTHS: (f64, f64) = (0.4, 0.6);

/// Ratio of the widths of lakes from one level to the next finer one. Chosen by eye.
const WIDER: f64 = 0.62;

/// Least half width of a lake in half widths of its valley's floor: a narrower lake would have no depth.
const COVERS: f64 = 1.1;

/// Length of a lake in half widths, where there is room: the least value, and the range that chance adds. Real lakes in
/// troughs are 3 to 10 times as long as wide. Chosen by eye.
const LENGTHS: (f64, f64) = (8.0, 9.0);

/// Least length of a lake in half widths: a shorter lake would be round. On a steep bed, where a lake is shorter, it
/// becomes shallower and so narrower instead.
const LEAST_LENGTH: f64 = 8.0;

/// Share of a channel's length at which its lake ends: the least value, and the range that chance adds.
const SILLS: (f64, f64) = (0.5, 0.4);

/// Share of a lake's length over which its floor falls from the sill, and share from which on it rises to the inlet.
const FALLS: f64 = 0.3;
const RISES: f64 = 0.35;

/// Greatest slope of a lake's floor where it falls from the sill or rises to the inlet, as a share of the hillside's
/// slope: for trunks, whose sides count as if their beds were level, and for other channels. The middle of a [smooth]
/// rise is half as steep again as its mean slope.
const STEEPEST_TRUNK: f64 = 0.3;
const STEEPEST_SHARE: f64 = 0.5;
const MIDDLE: f64 = 1.5;

/// Distance from a lake, in its half widths, at which the coast must still be higher than its water. Chosen by eye.
const COAST_WIDTHS: f64 = 3.0;

/// Least depth of a lake as a share of the depth it should have: with less room there is no lake.
const LEAST_DEPTH: f64 = 0.2;

/// Least depth of a lake in metres: shallower water is no lake.
const LEAST_DEPTH_M: f64 = 0.5;

/// Depth in metres for which there must be room all along a lake.
const LEAST_ROOM_M: f64 = 0.25;

/// Depth in metres that a lake keeps where other channels leave no room, and least fall in metres from one knot to the
/// next above the lake.
const SHALLOWS_M: f64 = 0.02;
const LEAST_FALL_M: f64 = 0.001;

/// Least number of straight segments of a channel with a lake: with fewer the lake's floor would have corners.
const LEAST_SEGMENTS: f64 = 32.0;

/// Least distance from the middle of a lake to other channels of its level, in half widths of the lake: their beds do
/// not know of the lake.
const CLEAR: f64 = 2.5;

/// Share of a lake's depth that is left open at the mouths of tributaries, from one level to the next: streams fill the
/// trenches they have dug, which would be needles of water. Chosen by eye.
const LEFT_OPEN: f64 = 0.6;

/// Greatest ratio of the side slope of the channel with the lake to that of a channel that runs into it.
const GENTLER: f64 = 1.5;

/// A lake that a channel may have.
#[derive(Clone, Copy, Debug)]
pub struct Hollow {
    /// Half width of the lake in grains, at its widest.
    half_width: f64,
    /// Greatest length of the lake in half widths.
    length: f64,
    /// Share of its channel's length at which the lake ends.
    sill: f64,
}

impl Hollow {
    /// Draws the lake of a level's channel with the level's seed.
    pub fn new(fields: &Fields, seed: u64, level: u32, id: NodeId) -> Hollow {
        let by_chance = |(least, more): (f64, f64), draw| least + more * chance(seed, id, draw, 0);
        Hollow {
            half_width: Hollow::widest(fields, level) * by_chance(WIDTHS, Draw::LakeWidth),
            length: by_chance(LENGTHS, Draw::LakeLength),
            sill: by_chance(SILLS, Draw::LakeSill),
        }
    }

    /// Returns the half width in grains of the widest lake of a level.
    pub fn widest(fields: &Fields, level: u32) -> f64 {
        fields.lake_half_width() * WIDER.powi(level as i32)
    }

    /// Widens the lake so that it covers its valley's floor, which has this half width in grains.
    pub fn on_floor(self, trough: f64) -> Hollow {
        Hollow { half_width: self.half_width.max(COVERS * trough), ..self }
    }

    /// Half width of the lake in grains.
    pub fn half_width(&self) -> f64 {
        self.half_width
    }

    /// Returns the depth in metres at which the water in a valley, given its side slope and its floor's half width, is
    /// as wide as the lake.
    pub fn depth_m(&self, fields: &Fields, hill_slope: f64, trough: f64) -> f64 {
        depth_m(fields, hill_slope, trough, self.half_width)
    }

    /// Digs the lake into a channel, and tells whether there was room for it. `is_own` tells whether a place lies
    /// outside the floors of larger valleys, `least_m` gives the height below which nothing may be dug at a place, and
    /// `others` the distance in grains to other channels of the level.
    pub fn dig(
        &self,
        fields: &Fields,
        channel: &mut Channel,
        is_own: impl Fn(Point) -> bool,
        least_m: impl Fn(Point) -> f64,
        others: impl Fn(Point) -> f64,
    ) -> bool {
        let hill_slope = channel.laws.hill_slope;
        let whole = ways(&channel.knots).pop().expect("a channel has knots");
        let mut knots = refined(&channel.knots, whole / LEAST_SEGMENTS);
        let way = ways(&knots);
        let sill = way.partition_point(|way| *way < self.sill * whole).clamp(1, knots.len() - 2);
        let Knot { at, level_m, area, discharge_m3s, .. } = knots[sill];
        let laws = if channel.id.0 == 0 { fields.laws(at) } else { channel.laws };
        let trough = laws.trough(fields, channel.id.0, area, level_m);
        let lake = self.on_floor(trough);
        if lake.half_width < 2.0 * fields.least_lake(discharge_m3s) || lake.half_width > fields.lake_half_width() {
            return false;
        }
        let wanted_m = lake.depth_m(fields, hill_slope, trough);
        let shallowest_m = (LEAST_DEPTH * wanted_m).max(LEAST_DEPTH_M);
        let steepest = match channel.id.0 {
            0 => STEEPEST_TRUNK * hill_slope,
            _ => STEEPEST_SHARE * hill_slope,
        };
        // The greatest possible depth of a lake that begins at a knot. Of equally deep lakes the longest is taken.
        let deepest_m = |inlet: usize| {
            let long_m = (way[sill] - way[inlet]) * fields.metres_a_grain();
            let rise_m = steepest / MIDDLE * long_m * (1.0 - RISES) - (knots[inlet].level_m - level_m);
            let narrow_m = depth_m(fields, hill_slope, trough, (way[sill] - way[inlet]) / LEAST_LENGTH);
            wanted_m.min(rise_m).min(narrow_m).min(steepest / MIDDLE * long_m * FALLS)
        };
        // No lake begins at the head, where the channel above ends.
        let inlets = (1..sill).rev().take_while(|inlet| way[sill] - way[*inlet] <= lake.length * lake.half_width);
        let best = inlets.map(|inlet| (deepest_m(inlet), inlet)).max_by(|a, b| a.0.total_cmp(&b.0));
        let Some((_, mut inlet)) = best else { return false };
        let clear_m = |at: Point| level_m - depth_m(fields, hill_slope, trough, others(at) / CLEAR);
        let floor_m = |at: Point| clear_m(at).max(least_m(at));
        // At a place without room for water the lake would be cut in two, so it begins below.
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
        // Beside other channels there may be no room for the least depth.
        if !knots[inlet..sill].iter().any(|knot| knot.level_m < level_m - shallowest_m) {
            return false;
        }
        // The sill itself belongs to the river.
        knots[sill].pool_m = NO_LAKE;
        channel.knots = knots;
        channel.lake = Some(LakeId(channel.id));
        true
    }

    /// True if a lake with this level at a place is so far inland that the coast cannot lower its shore.
    pub fn is_inland(&self, fields: &Fields, at: Point, level_m: f64) -> bool {
        let shore_m = fields.inland_m(at) - COAST_WIDTHS * self.half_width * fields.metres_a_grain();
        level_m >= fields.lowest_lake_m() && (!fields.has_sea() || fields.coast_m(shore_m as f32) as f64 > level_m)
    }

    /// Digs the part of a sink's lake that lies in a channel which ends at the sink, to a depth.
    pub fn dig_sink(&self, channel: &mut Channel, depth_m: f64) {
        let way = ways(&channel.knots);
        let last = way.len() - 1;
        let most = self.length * self.half_width;
        let inlet = (1..last).find(|inlet| way[last] - way[*inlet] <= most).unwrap_or(last - 1);
        let level_m = channel.knots[last].level_m;
        dig(&mut channel.knots[inlet..], level_m, depth_m, false, |_| f64::NEG_INFINITY);
    }
}

/// Returns the depth in metres at which the water in a valley, given its side slope and its floor's half width, reaches
/// `half_width` grains to each side.
fn depth_m(fields: &Fields, hill_slope: f64, trough: f64, half_width: f64) -> f64 {
    hill_slope * fields.metres_a_grain() * rise(half_width, 0.0, trough, 0.0)
}

/// Adds knots to a course, so that none of its segments is longer than `longest` grains.
fn refined(knots: &[Knot], longest: f64) -> Vec<Knot> {
    let between = knots.windows(2).flat_map(|pair| {
        let parts = (pair[0].at.distance(pair[1].at) / longest.max(1.0)).ceil().max(1.0) as usize;
        (0..parts).map(move |part| pair[0].towards(&pair[1], part as f64 / parts as f64))
    });
    between.chain(knots.last().copied()).collect()
}

/// Digs out the bed from a lake's inlet to its sill, or to the middle of a lake without outlet, and nowhere deeper than
/// `least_m` at a place.
fn dig(knots: &mut [Knot], level_m: f64, depth_m: f64, has_outlet: bool, least_m: impl Fn(Point) -> f64) {
    let way = ways(knots);
    let end = way[way.len() - 1];
    for (knot, way) in knots.iter_mut().zip(way) {
        let up = (end - way) / end.max(1.0);
        let out = if has_outlet { smooth(up / FALLS) } else { 1.0 };
        // However little room there is, some water remains all the way, so that it is one lake.
        let floor_m = (level_m - depth_m * out).max(least_m(knot.at)).min(level_m - SHALLOWS_M * out);
        knot.level_m = floor_m + (knot.level_m - floor_m) * smooth((up - RISES) / (1.0 - RISES));
        knot.pool_m = level_m;
    }
    // Even where the room changes from place to place, the bed above the lake must fall towards it.
    for index in (0..knots.len() - 1).rev() {
        let below_m = knots[index + 1].level_m;
        if knots[index].level_m >= level_m {
            knots[index].level_m = knots[index].level_m.max(below_m + LEAST_FALL_M);
        }
    }
}

/// Adapts a lake to beds that have been lowered: the water stands no higher than its sill, and reaches as far up as
/// that. From its deepest place to the sill, the floor lies below the water: former shallows would dam the lake.
pub fn fill(knots: &mut [Knot]) {
    for index in (0..knots.len() - 1).rev() {
        let below = knots[index + 1];
        // The head is never drowned, since the channel above ends there.
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

/// Returns the greatest depth in grains of a lake's floor below its water in a channel of a level, on sides of slope 1:
/// of the channel's own lake, or of the open part of a larger lake at the channel's mouth.
pub fn most_sunk(fields: &Fields, level: u32) -> f64 {
    let own = Hollow::widest(fields, level).max(COVERS * fields.widest_trough(level));
    (GENTLER * own).min(fields.lake_half_width())
}

/// Returns the height to which a valley's mouth is filled where the valley, of this level, ends in a lake of a larger
/// valley whose floor is this high.
pub fn filled_m(lake: LakeId, pool_m: f64, floor_m: f64, level: u32) -> f64 {
    pool_m - (pool_m - floor_m) * LEFT_OPEN.powi((level - lake.0.0) as i32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fluvial::Fluvial;

    #[test]
    fn a_lake_whose_sill_is_lowered_has_no_dam_before_it() {
        let knot = |level_m: f64, pool_m: f64| Knot {
            at: Point { x: 0, y: 0 },
            level_m,
            area: 1.0,
            discharge_m3s: 1.0,
            pool_m,
        };
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
        let fluvial = Fluvial::of_preset("highlands", 3, |settings| settings.lakes = 1.0);
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
                // Going up from the deepest place there is no shallow before the inlet.
                let deepest = (0..depths.len()).max_by(|a, b| depths[*a].total_cmp(&depths[*b])).unwrap();
                let shallow = depths[..deepest].iter().rposition(|depth| *depth < 0.1).map_or(0, |shallow| shallow + 1);
                let beyond = depths[..shallow].iter().copied().fold(0.0, f64::max);
                assert!(beyond < LEAST_ROOM_M, "{:?}: {depths:?}", channel.id);
            });
        }
        assert!(lakes > 100, "{lakes} lakes");
    }
}
