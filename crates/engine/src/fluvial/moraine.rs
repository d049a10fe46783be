//! Moraines: walls around the ends of glaciers that have gone.
//!
//! A moraine is an arc across the floor of a valley, furthest down at the river, whose two ends run on up the valley.
//! It raises the land by a function of the distance from a fixed point, but by nothing beside the bed of a channel and
//! on a crest. So water runs in its channels as without the moraine, and along the wall down to the gap at the river.

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
use crate::hash::{self, Draw, Stream};
use crate::noise::point_noise::{PointField, PointNoise};
use crate::stop::Stopped;

/// The moraines of a world.
#[derive(Debug)]
pub struct Moraines {
    fields: Arc<Fields>,
    seed: u64,
    /// Noise that makes the walls uneven.
    uneven: PointNoise,
}

/// Greatest height of a moraine in metres. All sizes of moraines are chosen by eye, after the walls that the glaciers
/// of 1850 left.
const HIGHEST_M: f64 = 24.0;

/// Half width in metres of the narrowest and of the widest floor that has moraines, and of the narrowest in vertices.
/// On a narrower floor moraines have no shape; across a wider one they would look like dams.
const FLOOR_M: [f64; 2] = [75.0, 450.0];
const LEAST_FLOOR: f64 = 7.0;

/// Greatest cross slope of a floor that has moraines, as a share of its valley side's slope: on a steeper floor nothing
/// stays.
const MOST_LEAN: f32 = 0.45;

/// Length of channel for each chance of moraines, in distances between channels of the finest level.
const STRETCH: f64 = 5.0;

/// Places compared in each stretch; moraines lie at the flattest.
const TRIES: usize = 4;

/// Greatest number of arcs one behind the other, and the range of their distance in half widths of an arc.
const MOST_ARCS: usize = 3;
const APART: [f64; 2] = [3.0, 6.0];

/// Range of a moraine's height, and its half width, as shares of the half width of its floor; and the least and
/// greatest half width in metres. Breaches cannot cut through a wider wall, which would then dam water behind it here
/// and there.
const HEIGHT: [f64; 2] = [0.06, 0.13];
const HALF: f64 = 0.2;
const HALF_M: [f64; 2] = [30.0, 38.0];

/// Radius of an arc, and the range of the length of its straight ends up the valley, in half widths of the floor.
const RADIUS: f64 = 0.95;
const TAIL: [f64; 2] = [0.8, 2.5];

/// Least cosine of the angle between a moraine's axis and its river, above and below its middle. Chosen by eye.
const MOST_BEND: f64 = 0.94;

/// Wavelength in metres of the noise in a moraine's height, and the least share of the height that it leaves.
const WAVE_M: f64 = 240.0;
const LEAST_SHARE: f64 = 0.2;

/// Distance over which a moraine fades, in heights of the moraine: below the next-lowest valley side, where a crest is
/// near, and in metres from the bed of a channel. There the wall is as steep as a hillside.
const CREST_HEIGHTS: f64 = 1.0;
const BANK_HEIGHTS: f64 = 2.0;

/// Greatest height in metres below the next-lowest side that moraines need to know.
pub const CREST_READ_M: f32 = (CREST_HEIGHTS * HIGHEST_M) as f32;

/// Least half width in vertices of the bed of a channel, which moraines leave free.
const BED: f64 = 3.0;

/// One wall.
#[derive(Clone, Copy, Debug)]
struct Moraine {
    /// The centre of its arc.
    middle: Point,
    /// Unit vector down the valley.
    down: DVec2,
    radius_m: f64,
    /// Half width of the wall.
    half_m: f64,
    /// Length of its straight ends up the valley.
    tail_m: f64,
    height_m: f64,
    /// Heights of its two sides, as shares of the whole height.
    sides: [f64; 2],
}

impl Stamp for Moraine {
    fn reach(&self) -> (Point, f64) {
        (self.middle, length([self.radius_m + self.half_m, self.tail_m]))
    }
}

impl Moraine {
    /// Returns the wall's height at an offset in metres east and south from its centre, before channels and crests
    /// reduce it.
    fn height_m(&self, off: DVec2) -> f64 {
        let (along_m, across_m) = (off.dot(self.down), self.down.perp_dot(off));
        // Upstream of the centre the ends of the wall are straight.
        let ring_m = if along_m > 0.0 { off.length() } else { across_m.abs() };
        let beside = (ring_m - self.radius_m) / self.half_m;
        if beside.abs() >= 1.0 || along_m <= -self.tail_m {
            return 0.0;
        }
        let ridge = 1.0 - beside * beside;
        let side = between(self.sides, smooth(0.5 + 0.5 * across_m / self.radius_m));
        self.height_m * side * ridge * ridge * smooth(1.0 + along_m / self.tail_m)
    }
}

/// Interpolates between two values.
fn between([from, to]: [f64; 2], share: f64) -> f64 {
    lerp([from, to - from], share)
}

impl Moraines {
    /// Returns the moraines of a world with these fields; `None` if it has none.
    pub fn new(fields: &Arc<Fields>, seed: u64) -> Option<Moraines> {
        let wave = (WAVE_M / fields.metres_a_grain()).round() as i64;
        (fields.most_laws().moraines > 0.0).then(|| Moraines {
            fields: Arc::clone(fields),
            seed: hash::stream(seed, Stream::Moraines),
            uneven: PointNoise::new(wave, 2, hash::stream(seed, Stream::MoraineShape)),
        })
    }

    /// Raises the land at an area's nodes. Where two moraines overlap, the higher one counts.
    pub fn raise(
        &self,
        segments: &Segments,
        nodes: &Displaced,
        valleys: &mut Valleys,
        clock: &Clock,
    ) -> Result<(), Stopped> {
        let (fields, moraines) = (&self.fields, self.around(segments));
        stamp::nodes_of((fields, clock), &moraines, nodes, |index, vertex, near| {
            let raised = near.iter().map(|moraine| {
                let height_m = moraine.height_m(stamp::off_m(fields, nodes, index, vertex, moraine.middle));
                // Most nodes near a moraine are not raised by it, so skip the costly share.
                if height_m == 0.0 { 0.0 } else { height_m * self.share(segments, valleys, index, moraine.height_m) }
            });
            let raised_m = raised.fold(0.0, f64::max);
            if raised_m > 0.0 {
                let share = (0.7 + 0.9 * self.uneven.at(vertex)).clamp(LEAST_SHARE, 1.0);
                valleys.height_m[index] += (raised_m * share) as f32;
            }
        })
    }

    /// Returns the share of a moraine's height that a node gets: 0 beside the bed of its channel and on a crest.
    fn share(&self, segments: &Segments, valleys: &Valleys, index: usize, height_m: f64) -> f64 {
        let Some(own) = segments.all.get(valleys.segment[index] as usize) else { return 0.0 };
        let river_m = lerp(own.river, valleys.share[index] as f64) * self.fields.metres_a_grain();
        let dry_m = valleys.distance_m[index] as f64 - river_m.max(BED * self.fields.spacing_m());
        let crest_m = valleys.crest_m[index] as f64;
        smooth(dry_m / (BANK_HEIGHTS * height_m)) * smooth(crest_m / (CREST_HEIGHTS * height_m))
    }

    /// Returns all moraines near an area, given the area's segments.
    fn around(&self, segments: &Segments) -> Vec<Moraine> {
        // The finest valleys are younger than the ice.
        let channels = segments.channels.iter().filter(|channel| channel.id.0 + 1 < self.fields.levels());
        channels.flat_map(|channel| self.of(channel)).collect()
    }

    /// Returns the moraines on the floor of a channel.
    fn of(&self, channel: &Channel) -> Vec<Moraine> {
        let (level, x, y) = channel.id;
        let seed = hash::network_level(self.seed, level);
        let metres = self.fields.metres_a_grain();
        let long = ways(&channel.knots).pop().expect("a channel has knots");
        let finest = self.fields.side(self.fields.levels() - 1) as f64;
        let stretches = (long / (STRETCH * finest)).ceil().max(1.0);
        let mut moraines = Vec::new();
        for stretch in 0..stretches as usize {
            let parts = 3 + TRIES + 2 * MOST_ARCS;
            let luck = |part: usize| chance(seed, (x, y), Draw::Moraine, (parts * stretch + part) as u64);
            if luck(0) >= channel.laws.moraines {
                continue;
            }
            let lean = |way: &f64| {
                let place = channel.down(*way);
                place.map_or(f32::INFINITY, |(knot, _)| channel.sections[knot].lean)
            };
            let tries = (0..TRIES).map(|part| (stretch as f64 + luck(3 + part)) / stretches * long);
            let mut way = tries.min_by(|one, other| lean(one).total_cmp(&lean(other))).expect("there are some tries");
            let arcs = 1 + (luck(1) * MOST_ARCS as f64) as usize;
            for arc in 0..arcs {
                let [size, side] = [0, 1].map(|part| luck(3 + TRIES + 2 * arc + part));
                let Some(floor_m) = self.floor_m(channel, way) else { break };
                let half_m = (HALF * floor_m).clamp(HALF_M[0], HALF_M[1]).max(3.0 * self.fields.spacing_m());
                moraines.extend(self.moraine(channel, way, [floor_m, half_m], [luck(2), size, side]));
                // The next arc further down the valley was left by an older glacier.
                way += between(APART, size) * half_m / metres;
            }
        }
        moraines
    }

    /// Returns the half width in metres of the level part of the floor `way` grains down a channel, if moraines can lie
    /// there.
    fn floor_m(&self, channel: &Channel, way: f64) -> Option<f64> {
        let (knot, _) = channel.down(way)?;
        let section = &channel.sections[knot];
        let floor_m = LEVEL * f64::from(section.trough) * self.fields.metres_a_grain();
        let is_wide = floor_m >= FLOOR_M[0].max(LEAST_FLOOR * self.fields.spacing_m()) && floor_m <= FLOOR_M[1];
        (is_wide && section.lean <= MOST_LEAN).then_some(floor_m)
    }

    /// Returns the moraine `way` grains down a channel, if a glacier was there. Its sizes follow from the half widths
    /// in metres of the floor and of the wall, and from chance.
    fn moraine(
        &self,
        channel: &Channel,
        way: f64,
        [floor_m, half_m]: [f64; 2],
        [tail, size, side]: [f64; 3],
    ) -> Option<Moraine> {
        let metres = self.fields.metres_a_grain();
        let radius_m = RADIUS * floor_m;
        let at = |way: f64| Some(channel.at(channel.down(way.max(0.0))?));
        let knot = at(way)?;
        let unit = |way: DVec2| way / way.length().max(1.0);
        let front = at(way + radius_m / metres)?.at;
        let down = unit(front.from(at(way - radius_m / metres)?.at));
        let tail_m = floor_m * between(TAIL, tail);
        // Water behind a straight wall in a bend would have no way out.
        let [came, goes] = [knot.at.from(at(way - tail_m / metres)?.at), front.from(knot.at)].map(unit);
        if came.dot(down) < MOST_BEND || goes.dot(down) < MOST_BEND {
            return None;
        }
        let moraine = Moraine {
            middle: knot.at.moved(-down * radius_m / metres),
            down,
            radius_m,
            half_m,
            tail_m,
            height_m: (floor_m * between(HEIGHT, size)).min(HIGHEST_M),
            sides: [1.0 - 0.5 * side, 0.5 + 0.5 * side],
        };
        let (middle, reach_m) = moraine.reach();
        let is_iced = channel.laws.ice_m == f64::INFINITY || channel.laws.iced(knot.level_m) > 0.5;
        let is_sea = knot.level_m < self.fields.lowest_lake_m();
        let is_lake = |knot: &Knot| knot.pool_m > f64::NEG_INFINITY && knot.at.distance(middle) * metres < reach_m;
        // Every vertex within the moraine's reach must know the channel's segment here.
        let is_known = radius_m + reach_m <= stamp::known_m(&self.fields, channel.id.0);
        (is_iced && is_known && !is_sea && !channel.knots.iter().any(is_lake)).then_some(moraine)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::area::Area;
    use crate::clock::Clock;
    use crate::fluvial::Fluvial;

    fn alps(moraines: f64) -> Fluvial {
        Fluvial::of_preset("alps", 61, |settings| settings.moraines = moraines)
    }

    const AREA: Area = Area { x0: 10_368, y0: -22_464, x1: 10_624, y1: -22_080 };

    #[test]
    fn there_is_nothing_of_a_moraine_past_its_reach() {
        let fluvial = alps(1.0);
        let moraines = fluvial
            .moraines
            .as_ref()
            .unwrap()
            .around(&fluvial.segments(AREA, fluvial.detail, &Clock::default()).unwrap());
        assert!(moraines.len() > 10, "{} moraines", moraines.len());
        for moraine in &moraines {
            let (_, reach_m) = moraine.reach();
            let mut highest_m = 0.0f64;
            for place in 0..64 * 64 {
                let off = DVec2::from([place % 64, place / 64].map(f64::from));
                let off = (off / 31.5 - 1.0) * 1.1 * reach_m;
                let height_m = moraine.height_m(off);
                assert!((0.0..=HIGHEST_M).contains(&height_m), "{moraine:?}");
                assert!(height_m == 0.0 || off.length() <= reach_m, "{moraine:?} at {off:?}");
                highest_m = highest_m.max(height_m);
            }
            assert!(highest_m > 0.3 * moraine.height_m, "{highest_m} m of {moraine:?}");
        }
    }

    #[test]
    fn moraines_raise_floors_and_no_beds() {
        let [bare, raised] = [0.0, 1.0].map(|moraines| alps(moraines).land(AREA, &Clock::default()).unwrap());
        let (water, mut highest_m) = (bare.water.unwrap(), 0.0f32);
        for (x, y) in AREA.vertices() {
            let raised_m = raised.heights.at(x, y) - bare.heights.at(x, y);
            highest_m = highest_m.max(raised_m);
            assert!(!water.bed.at(x, y) || raised_m <= 0.0, "a bed is {raised_m} m higher at {x},{y}");
        }
        assert!(highest_m > 5.0, "{highest_m} m");
        assert_eq!(raised.water.unwrap().kind, water.kind);
    }

    #[test]
    fn windows_agree_on_moraines() {
        let fluvial = alps(1.0);
        let whole = fluvial.land(AREA, &Clock::default()).unwrap().heights;
        for part in AREA.halves() {
            assert_eq!(fluvial.land(part, &Clock::default()).unwrap().heights, whole.part(part));
        }
    }
}
