//! Barriers: sand bars that waves have laid across the mouths of drowned valleys. The water behind a barrier is a
//! lagoon.
//!
//! A barrier runs from one side of the valley to the other, slightly bowed towards the land, with an inlet at the bed
//! of the river. It raises the floor of the valley only: higher land stays as it is.
//!
//! To judge the numbers chosen by eye, look at the coast of `archipelago`, which has barriers.

use std::sync::Arc;

use glam::DVec2;

use super::channel::{Channel, Mouth, ways};
use super::fields::Fields;
use super::segment::{Segment, Segments};
use super::stamp::{self, Stamp};
use super::valley::Valleys;
use super::warp::Displaced;
use crate::clock::Clock;
use crate::geometry::{length, lerp, smooth};
use crate::grain_point::{Point, chance};
use crate::hash::{self, Draw, Stream};
use crate::noise::point_noise::{PointField, PointNoise};
use crate::stop::Stopped;

/// The barriers of a world.
#[derive(Debug)]
pub struct Barriers {
    fields: Arc<Fields>,
    seed: u64,
    /// Noise that makes barriers higher here and lower there.
    uneven: PointNoise,
}

/// Height of a barrier's crest above the sea in metres, without noise: the least value, and the range that chance adds.
const CREST_M: (f64, f64) = (1.6, 1.4);

/// Half width of a barrier above the sea in metres: the least value, and the range that chance adds; and the least in
/// vertices. Chosen by eye.
const HALF_M: (f64, f64) = (22.0, 26.0);
const LEAST_HALF: f64 = 2.5;

/// Slope from a barrier down to the sea's floor, and down to the lagoon's. Chosen by eye.
const FALL: f64 = 0.13;
const INNER_FALL: f64 = 0.05;

/// Depth in metres to which a lagoon is filled, and distance in metres behind the barrier up to which it is. Chosen by
/// eye.
const LAGOON_M: f64 = 3.0;
const FILLED_M: f64 = 420.0;

/// Least height in metres of the land's edge above the sea beside a barrier: otherwise the barrier would lie in the
/// open sea.
const LEAST_EDGE_M: f32 = 5.0;

/// Least and greatest distance in metres from the river's mouth to the barrier.
const AWAY_M: [f64; 2] = [240.0, 460.0];

/// Places of a drowned bed that are tried, from the sea upstream.
const TRIES: usize = 12;

/// Greatest distance in metres from the inlet to a barrier's ends. An end that meets no shore is narrow and low like a
/// spit: over the share `TIP` of the distance its outline is half an ellipse above the sea, and over the share `END`
/// beyond that it falls to the sea's floor.
const LONGEST_M: f64 = 500.0;
const TIP: f64 = 0.2;
const END: f64 = 0.1;

/// Radius in metres of a barrier's bow. Chosen by eye.
const BOW_M: f64 = 1600.0;

/// Depth in metres of the water in the inlet, and in its channel through the lagoon.
const INLET_M: f64 = 5.0;

/// Half width of the inlet in half widths of its river, and the least in vertices; and distance in metres from the
/// inlet's edge to where the barrier has its full height.
const INLET: f64 = 1.3;
const LEAST_INLET: f64 = 1.5;
const INLET_BANK_M: f64 = 20.0;

/// Wavelength in metres of the noise in a barrier's height, and its amplitude as a share of the height.
const WAVE_M: f64 = 160.0;
const UNEVEN: f64 = 0.5;

/// One barrier.
#[derive(Clone, Copy, Debug)]
struct Barrier {
    /// The place of the barrier on the river's bed.
    middle: Point,
    /// Unit vector down the valley.
    down: DVec2,
    half_m: f64,
    crest_m: f64,
    /// Greatest depth in metres of water to which the barrier's slopes go down.
    deepest_m: f64,
}

impl Barrier {
    /// Returns the barrier's place, and the distance in metres beyond which the barrier changes nothing.
    fn reach(&self) -> (Point, f64) {
        let bow_m = LONGEST_M * LONGEST_M / (2.0 * BOW_M);
        let seaward_m = bow_m + self.half_m + self.deepest_m / FALL;
        (self.middle, length([LONGEST_M, seaward_m.max(FILLED_M + (self.deepest_m - LAGOON_M) / FALL)]))
    }

    /// Returns the height of the barrier in metres above the sea at an offset in metres east and south of its middle,
    /// given the noise there.
    fn top_m(&self, off: DVec2, uneven: f64) -> f64 {
        let (along_m, across_m) = (off.dot(self.down), self.down.perp_dot(off));
        let seaward_m = along_m - across_m * across_m / (2.0 * BOW_M);
        let to_end = across_m.abs() / LONGEST_M;
        // Position within the tip: 0 where the tip begins, 1 at the end of the half ellipse.
        let tip = (to_end - (1.0 - END - TIP)).max(0.0) / TIP;
        let beside_m = length([seaward_m, tip * self.half_m]) - self.half_m;
        let crest_m = self.crest_m * (1.0 + UNEVEN * uneven) * (1.0 - (1.0 + beside_m.min(0.0) / self.half_m).powi(2));
        let beside_m = beside_m.max(0.0);
        let fallen_m = match seaward_m > 0.0 {
            true => FALL * beside_m,
            false => (INNER_FALL * beside_m).min(LAGOON_M) + FALL * (-seaward_m - FILLED_M).max(0.0),
        };
        let end = 1.0 - smooth((1.0 - to_end) / END);
        crest_m - fallen_m - end * (self.crest_m + self.deepest_m)
    }
}

/// A barrier, and the segments of its river in an area.
struct AreaBarrier<'a> {
    barrier: Barrier,
    beds: Vec<&'a Segment>,
}

impl Stamp for AreaBarrier<'_> {
    fn reach(&self) -> (Point, f64) {
        self.barrier.reach()
    }
}

impl Barriers {
    /// Returns the barriers of a world with these fields; `None` if it has none.
    pub fn new(fields: &Arc<Fields>, seed: u64) -> Option<Barriers> {
        let wave = (WAVE_M / fields.metres_a_grain()).round() as i64;
        (fields.has_sea() && fields.settings().coast.lagoons > 0.0).then(|| Barriers {
            fields: Arc::clone(fields),
            seed: hash::stream(seed, Stream::Barriers),
            uneven: PointNoise::new(wave, 2, hash::stream(seed, Stream::BarrierShape)),
        })
    }

    /// Raises the land at an area's nodes.
    pub fn raise(
        &self,
        segments: &Segments,
        nodes: &Displaced,
        valleys: &mut Valleys,
        clock: &Clock,
    ) -> Result<(), Stopped> {
        let fields = &self.fields;
        let barriers: Vec<AreaBarrier> = segments
            .channels
            .iter()
            .zip(0..)
            .filter_map(|(channel, number)| {
                // Few channels have a barrier, so look for the barrier first and for its segments after.
                let barrier = self.of(channel)?;
                let beds = segments.all.iter().filter(|segment| segment.channel == number).collect();
                Some(AreaBarrier { barrier, beds })
            })
            .collect();
        stamp::nodes_of((fields, clock), &barriers, nodes, |index, vertex, near| {
            let height_m = f64::from(valleys.height_m[index]) - fields.sea_level_m();
            let raised_m = near.iter().map(|AreaBarrier { barrier, beds }| {
                let off_m = stamp::off_m(fields, nodes, index, vertex, barrier.middle);
                let top_m = barrier.top_m(off_m, self.uneven.at(vertex).clamp(-1.0, 1.0));
                // Most nodes near a barrier are not raised by it.
                if top_m <= height_m {
                    return 0.0;
                }
                let at = barrier.middle.from(segments.origin) + off_m / fields.metres_a_grain();
                let inlet_m = height_m.max(top_m.min(-INLET_M));
                let share = self.share(beds, at);
                inlet_m + (top_m - inlet_m) * share - height_m
            });
            valleys.height_m[index] += raised_m.fold(0.0, f64::max) as f32;
        })
    }

    /// Returns the share of a barrier that stands at a place: 0 in the inlet, which is the bed of its river.
    fn share(&self, beds: &[&Segment], place: DVec2) -> f64 {
        let metres = self.fields.metres_a_grain();
        let beside_m = beds.iter().map(|bed| {
            let (share, square) = bed.nearest(place);
            let river_m = lerp(bed.river, share) * metres;
            square.sqrt() * metres - (INLET * river_m).max(LEAST_INLET * self.fields.spacing_m())
        });
        smooth(beside_m.fold(f64::INFINITY, f64::min) / INLET_BANK_M)
    }

    /// Returns the barrier across the drowned valley of a channel, if there is one.
    fn of(&self, channel: &Channel) -> Option<Barrier> {
        let (fields, (level, x, y)) = (&self.fields, channel.id);
        let luck = |part: u64| chance(self.seed, (x, y), Draw::Barrier, part);
        if level > 0 || channel.mouth != Mouth::Sea || luck(0) >= fields.settings().coast.lagoons {
            return None;
        }
        let (sea_m, metres) = (fields.sea_level_m(), fields.metres_a_grain());
        let wet = channel.knots.iter().position(|knot| fields.is_drowned(knot.at, knot.level_m))?;
        let shore = ways(&channel.knots)[wet];
        let at = |way: f64| Some(channel.at(channel.down(way)?));
        // As far out as the valley still has sides.
        let away = |part: usize| lerp([AWAY_M[1], AWAY_M[0] - AWAY_M[1]], part as f64 / TRIES as f64);
        let ways = (0..=TRIES).map(|part| shore + away(part) / metres);
        let is_valley = |way: &f64| at(*way).is_some_and(|knot| fields.edge_m(knot.at) > sea_m as f32 + LEAST_EDGE_M);
        let way = ways.into_iter().find(is_valley)?;
        let middle = at(way)?.at;
        let beside = AWAY_M[0] / 2.0 / metres;
        let down = at(way + beside)?.at.from(at(way - beside)?.at);
        let barrier = Barrier {
            middle,
            down: down / down.length().max(1.0),
            half_m: (HALF_M.0 + HALF_M.1 * luck(1)).max(LEAST_HALF * self.fields.spacing_m()),
            crest_m: CREST_M.0 + CREST_M.1 * luck(2),
            deepest_m: sea_m - fields.lowstand_level_m(),
        };
        // Every vertex within the barrier's reach must know the channel's segment here.
        (barrier.reach().1 <= stamp::known_m(fields, level)).then_some(barrier)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::area::Area;
    use crate::clock::Clock;
    use crate::fluvial::Fluvial;
    use crate::grain_point::GRAINS;
    use crate::land::WaterKind;

    fn archipelago(lagoons: f64) -> Fluvial {
        Fluvial::of_preset("archipelago", 11, |settings| settings.coast.lagoons = lagoons)
    }

    #[test]
    fn a_barrier_has_round_ends() {
        for (half_m, crest_m) in [(24.0, 1.8), (48.0, 3.0)] {
            let middle = Point { x: 0, y: 0 };
            let barrier = Barrier { middle, down: DVec2::Y, half_m, crest_m, deepest_m: 40.0 };
            // Width of the barrier above the sea, at some distance in metres from its inlet.
            let wide_m = |across: i32| {
                let is_land = |along: &i32| barrier.top_m(DVec2::new(across.into(), (*along).into()), 0.0) > 0.0;
                (-200..300).filter(is_land).count() as f64
            };
            let widths: Vec<f64> = (0..=LONGEST_M as i32).map(wide_m).collect();
            let whole = widths[0];
            assert!((whole - 2.0 * half_m).abs() < 2.0);
            let last = widths.iter().rposition(|width| *width > 0.0).unwrap();
            assert!(widths[last - 15] < 0.65 * whole && widths[last - 50] > 0.8 * whole, "{:?}", &widths[last - 50..]);
            // At its end nothing of the barrier is left.
            assert!(
                (-300..300).all(|along| barrier.top_m(DVec2::new(LONGEST_M, along.into()), 0.0) <= -barrier.deepest_m)
            );
        }
    }

    #[test]
    fn a_barrier_is_low_land_and_its_lagoon_open_to_the_sea() {
        let [fluvial, bare] = [1.0, 0.0].map(archipelago);
        let barriers = fluvial.barriers.as_ref().unwrap();
        assert!(bare.barriers.is_none());
        let side = 5 * fluvial.fields().side(0);
        let mut found = Vec::new();
        fluvial.network().channels(0, [Point { x: -side, y: -side }, Point { x: side, y: side }], |trunk| {
            found.extend(barriers.of(trunk));
        });
        assert!(found.len() > 5, "{} barriers", found.len());
        let (sea_m, mut raised) = (fluvial.fields().sea_level_m() as f32, 0);
        for barrier in found.iter().take(5) {
            let vertex = |metres: f64| {
                let at =
                    fluvial.in_world(barrier.middle.moved(barrier.down * metres / fluvial.fields().metres_a_grain()));
                [at.x, at.y].map(|grains| grains.div_euclid(GRAINS))
            };
            let [x, y] = vertex(0.0);
            let area = Area::new(x - 70, y - 70, 141, 141);
            let [land, before] = [&fluvial, &bare].map(|fluvial| fluvial.land(area, &Clock::default()).unwrap());
            let [water, wide] = [&land, &before].map(|land| land.water.as_ref().unwrap());
            for (x, y) in area.vertices() {
                if wide.kind.at(x, y) == WaterKind::Sea && water.kind.at(x, y) == WaterKind::Dry {
                    raised += 1;
                    let height_m = land.heights.at(x, y) - sea_m;
                    let highest_m = (CREST_M.0 + CREST_M.1) * (1.0 + UNEVEN);
                    assert!((0.0..=highest_m as f32).contains(&height_m), "{height_m} m at {x}, {y}");
                }
            }
            // A flood fill over the sea leads from the lagoon through the inlet.
            let mut reached = vec![false; area.len()];
            let index = |[x, y]: [i64; 2]| area.index(x, y);
            let mut open = vec![vertex(-120.0)];
            while let Some(at) = open.pop() {
                let is_sea = area.has(at[0], at[1]) && water.kind.at(at[0], at[1]) == WaterKind::Sea;
                if is_sea && !std::mem::replace(&mut reached[index(at)], true) {
                    open.extend([[1, 0], [-1, 0], [0, 1], [0, -1]].map(|way| [at[0] + way[0], at[1] + way[1]]));
                }
            }
            assert!(reached[index(vertex(120.0))], "{barrier:?}");
        }
        assert!(raised > 300, "{raised} vertices of barriers");
    }
}
