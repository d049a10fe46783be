//! The courses of trunks: curves from node to node that meander and keep clear of each other, and their beds.
//!
//! In four steps, each of which asks for the one before of the trunks around: a smooth curve; a straight line instead, where
//! the curve comes too close to that of a trunk that shares a node; meanders, in a tube that no other's tube meets; and a
//! bed that keeps below the coast and the sides of the larger valley that it comes to.

use std::f64::consts::TAU;
use std::sync::Arc;

use super::channel::{Channel, Knot, Mouth};
use super::fields::Fields;
use super::point::{Point, chance};
use super::segment::{Segment, segments_of};
use super::trunk::{Drained, LEAST_SLOPE, NodeId, Trunks, neighbours};
use super::wander;
use crate::geometry::{LineSegment, length, lines};
use crate::hash::Draw;
use crate::memory::Memory;

/// Half widths of a lake, as shares of that at its node, from there on along the main river on either side; at the next
/// knot it is as narrow as that. So the water is level just as far as there is a lake.
const LAKE_SHAPE: [f64; 4] = [1.0, 0.94, 0.78, 0.5];

/// Half width of a lake where it ends, as a share of the least that a lake has: of two that are equal rounding would choose.
const LAKE_END: f64 = 0.99;

/// How steep a river runs down the side of a larger one's valley at most, as a share of that side's slope: so it cuts into
/// it, and is not lost on it.
pub(super) const INCISION: f64 = 0.7;

/// How steep a bed is that goes on under the sea.
pub(super) const DROWNED_SLOPE: f64 = 0.002;

/// Cells of the trunk lattice that a trunk sticks out of the cell of its upper node at most: it runs to a neighbouring one,
/// and its curve bulges by less than its length.
pub const REACH_CELLS: f64 = 2.5;

/// The trunks of a world.
#[derive(Debug)]
pub struct TrunkCourses {
    seed: u64,
    fields: Arc<Fields>,
    nodes: Trunks,
    smooth: Memory<NodeId, Option<Arc<Channel>>>,
    apart: Memory<NodeId, Option<Arc<Channel>>>,
    free: Memory<NodeId, Option<Arc<Channel>>>,
}

impl TrunkCourses {
    /// The trunks of a world with these fields.
    pub fn new(fields: Arc<Fields>, seed: u64) -> TrunkCourses {
        TrunkCourses {
            seed,
            nodes: Trunks::new(Arc::clone(&fields), seed),
            fields,
            smooth: Memory::new(1 << 10),
            apart: Memory::new(1 << 10),
            free: Memory::new(1 << 10),
        }
    }

    /// The lattice that they run on.
    pub fn nodes(&self) -> &Trunks {
        &self.nodes
    }

    /// The trunk from a node to the next one downstream; `None` for a sink.
    ///
    /// Where it comes to a larger one from the side, it keeps below the sides of that one's valley.
    pub fn trunk(&self, id: NodeId) -> Option<Channel> {
        let mut trunk = self.free_trunk(id)?.as_ref().clone();
        let Some((to, false)) = trunk.next else { return Some(trunk) };
        let main = self.nodes.drained(to).main;
        let others: Vec<Arc<Channel>> = main.into_iter().chain([to]).filter_map(|id| self.free_trunk(id)).collect();
        let origin = trunk.knots[0].at;
        let segments: Vec<Segment> =
            others.iter().flat_map(|other| segments_of(&self.fields, other, 0, origin, |_| true)).collect();
        for index in (0..trunk.knots.len() - 1).rev() {
            let (below, here) = (trunk.knots[index + 1], trunk.knots[index]);
            let hill_slope = self.fields.hill_slope(self.fields.uplift(here.at)).min(trunk.hill_slope);
            let slope = INCISION * hill_slope * self.fields.metres_a_grain();
            let relative = here.at.from(origin);
            let sides = segments.iter().map(|segment| segment.side_m(relative, slope));
            let least_m = below.level_m + (here.level_m - below.level_m).clamp(0.0, 0.01);
            trunk.knots[index].level_m = sides.fold(here.level_m, f64::min).max(least_m);
        }
        Some(trunk)
    }

    /// The trunk from a node to the next one, but for what the sides of other valleys do to it.
    fn free_trunk(&self, id: NodeId) -> Option<Arc<Channel>> {
        self.free.get(id, || self.make_free_trunk(id).map(Arc::new)).as_ref().clone()
    }

    fn make_free_trunk(&self, id: NodeId) -> Option<Channel> {
        let mut trunk = self.apart_trunk(id)?.as_ref().clone();
        if trunk.next.is_none() {
            let in_sea = |knot: &Knot| self.fields.in_sea(knot.at);
            let wet = trunk.knots.iter().position(in_sea).unwrap_or(trunk.knots.len());
            let after = trunk.knots[wet..].iter().take_while(|knot| in_sea(knot)).count();
            trunk.knots.truncate((wet + after).max(2));
            self.cut_into_coast(&mut trunk.knots);
            return Some(trunk.bounded());
        }
        let origin = trunk.knots[0].at;
        let course = trunk.course(origin);
        // Those that start from the nodes around, as smooth as this one.
        let nodes = (-2..=2).flat_map(|y| (-2..=2).map(move |x| (id.0 + x, id.1 + y)));
        let others = nodes.filter(|node| *node != id).filter_map(|node| self.apart_trunk(node));
        let around: Vec<LineSegment> = others.flat_map(|other| lines(&other.course(origin), 8)).collect();
        let (from, to) = (trunk.knots[0].at, trunk.knots[course.len() - 1].at);
        let whole = from.distance(to) * self.bend(&self.nodes.drained(id), from, to);
        let mut offsets = wander::offsets(self.seed, id, course.len() - 1);
        for (offset, knot) in offsets.iter_mut().zip(&trunk.knots) {
            *offset *= if knot.lake > 0.0 { 0.0 } else { whole };
        }
        self.meander(&trunk, &mut offsets);
        for (knot, place) in trunk.knots.iter_mut().zip(wander::wandered(&course, &offsets, &around)) {
            knot.at = origin.moved(place);
        }
        self.cut_into_coast(&mut trunk.knots);
        Some(trunk.bounded())
    }

    /// Lowers the bed of a trunk on land to where it cuts into the coast.
    fn cut_into_coast(&self, knots: &mut [Knot]) {
        if !self.fields.has_sea() {
            return;
        }
        let (sea_m, metres) = (self.fields.sea_level_m(), self.fields.metres_a_grain());
        let most_m = self.fields.below_coast_along_m(knots.iter().map(|knot| knot.at));
        for index in (0..knots.len() - 1).rev() {
            let (below, here) = (knots[index + 1], &mut knots[index]);
            if below.level_m >= sea_m && here.lake == 0.0 {
                let least_m = here.at.distance(below.at) * metres * LEAST_SLOPE;
                let least_m = below.level_m + (here.level_m - below.level_m).min(least_m);
                here.level_m = here.level_m.min(most_m[index]).max(least_m);
            }
        }
    }

    /// The course of the trunk from a node to the next: a smooth curve, or a straight line where that comes too close to
    /// another one with which it shares a node.
    fn apart_trunk(&self, id: NodeId) -> Option<Arc<Channel>> {
        let make = || {
            let smooth = self.smooth_trunk(id)?;
            let to = self.nodes.drained(id).to?;
            let from = |node: NodeId, to: NodeId| {
                neighbours(to)
                    .filter(move |other| *other != node && self.nodes.drained(*other).to == Some(to))
                    .map(move |other| (other, to))
            };
            // Those that come to its head, those that come to its end with it, and the one that goes on from there.
            let mut others = from(id, id).chain(from(id, to)).chain([(to, to)]);
            let meets = |(other, node): (NodeId, NodeId)| {
                let joint = self.nodes.node(node).at;
                self.smooth_trunk(other).is_some_and(|other| too_close(&smooth.knots, &other.knots, joint))
            };
            if others.any(meets) { self.make_smooth_trunk(id, 0.0).map(Arc::new) } else { Some(smooth) }
        };
        self.apart.get(id, make).as_ref().clone()
    }

    /// The course of the trunk from a node to the next: a smooth curve.
    fn smooth_trunk(&self, id: NodeId) -> Option<Arc<Channel>> {
        self.smooth.get(id, || self.make_smooth_trunk(id, 1.0).map(Arc::new)).as_ref().clone()
    }

    /// The trunk from a node to the next, which bends as much as it may by a share.
    fn make_smooth_trunk(&self, id: NodeId, share: f64) -> Option<Channel> {
        let drained = self.nodes.drained(id);
        let to = drained.to?;
        let below = self.nodes.drained(to);
        let (here, there) = (self.nodes.node(id), self.nodes.node(to));
        let straight = there.at.from(here.at);
        // A river runs through a node in the direction from the one before to the one after.
        let through = |id: NodeId, drained: &Drained| {
            let to = self.nodes.node(drained.to?).at;
            Some(match drained.main {
                Some(main) => to.from(self.nodes.node(main).at).map(|part| part * 0.5),
                None => to.from(self.nodes.node(id).at),
            })
        };
        let is_main = below.main == Some(id);
        let start = through(id, &drained).unwrap_or(straight);
        let end = match through(to, &below) {
            Some(end) if is_main => end,
            Some(end) => [0, 1].map(|axis| 0.5 * (end[axis] + straight[axis])),
            None => straight,
        };
        let segments = self.fields.segments_a_channel(0).max(16);
        let bend = share * self.bend(&drained, here.at, there.at);
        // Where the sea comes in between, it ends there.
        let dry = drained.sea_at.unwrap_or(1.0);
        let in_bay = drained.sea_at.is_some() && !there.sea;
        let (below_m, below_lake) =
            if drained.sea_at.is_some() { (self.fields.sea_level_m(), 0.0) } else { (below.level_m, below.lake) };
        // A lake lies along the main river; in the mouths of the others it soon ends, so that it is no star.
        let mouth_shape = if is_main { &LAKE_SHAPE[..] } else { &LAKE_SHAPE[..1] };
        let part = |shape: &[f64]| shape.len() as f64 / segments as f64;
        let falls = [
            if drained.lake > 0.0 { part(&LAKE_SHAPE) } else { 0.0 },
            if below_lake > 0.0 { 1.0 - part(mouth_shape) } else { dry },
        ];
        let fall_m = drained.level_m - below_m;
        let length_m = length(straight) * self.fields.metres_a_grain();
        // What comes from above; a spring has a quarter of its cell.
        let area_above = (drained.area as f64 - 1.0).max(0.25);
        let lake = |shape: &[f64], step: usize, half_width: f64, least: f64| match shape.get(step) {
            _ if half_width == 0.0 || step > shape.len() => 0.0,
            Some(share) => share * half_width,
            None => LAKE_END * least,
        };
        let knot = |step: usize| {
            let t = step as f64 / segments as f64;
            let (t2, t3) = (t * t, t * t * t);
            // Hermite's cubic, a little less curved.
            let (leave, arrive) = (0.8 * bend * (t3 - 2.0 * t2 + t), 0.8 * bend * (t3 - t2));
            let go = t + bend * (3.0 * t2 - 2.0 * t3 - t);
            let way = [0, 1].map(|axis| start[axis] * leave + straight[axis] * go + end[axis] * arrive);
            let fallen = ((t - falls[0]) / (falls[1] - falls[0])).clamp(0.0, 1.0);
            // On the floor of the sea it goes on falling a little.
            let drowned_m = (t - dry).max(0.0) * length_m * DROWNED_SLOPE;
            let area = area_above + (drained.area as f64 - area_above) * t;
            let least = self.fields.least_lake(area);
            let lakes =
                [lake(&LAKE_SHAPE, step, drained.lake, least), lake(mouth_shape, segments - step, below_lake, least)];
            Knot {
                at: here.at.moved(way),
                level_m: drained.level_m - fall_m * fallen - drowned_m,
                area,
                lake: lakes[0].max(lakes[1]),
            }
        };
        let knots: Vec<Knot> = (0..=segments).map(knot).collect();
        let mouth = match below.to {
            _ if drained.sea_at.is_some() => Mouth::Sea,
            Some(_) => Mouth::Channel((0, to.0, to.1)),
            None => Mouth::Sink(to),
        };
        let hill_slope = self.fields.hill_slope(self.fields.uplift(here.at));
        let next = (!in_bay).then_some((to, is_main));
        let mut trunk = Channel::new((0, id.0, id.1), knots, mouth, hill_slope);
        trunk.next = next;
        Some(trunk)
    }

    /// How much a trunk may bend, 0 to 1: the closer the straight way comes to the sea before it ends, the less, for the
    /// lattice judges by that way where it comes into it.
    fn bend(&self, drained: &Drained, from: Point, to: Point) -> f64 {
        const PLACES: u32 = 16;
        // Of its length, to the side.
        const BULGE: f64 = 0.2;
        let way = to.from(from);
        if !self.fields.has_sea() {
            return 1.0;
        }
        if drained.sea_at.is_some() && self.fields.potential(to) >= self.fields.sea_potential() {
            // To a bay.
            return 0.0;
        }
        let bulge_m = BULGE * length(way) * self.fields.metres_a_grain();
        let room = |place: u32| {
            let share = place as f64 / PLACES as f64;
            let at = from.moved(way.map(|part| part * share * drained.sea_at.unwrap_or(1.0)));
            self.fields.inland_m(at) / (4.0 * share * (1.0 - share) * bulge_m)
        };
        (1..PLACES).map(room).fold(1.0, f64::min).max(0.0)
    }

    /// Adds meanders to the offsets of a trunk, in grains, where it is flat enough for that.
    ///
    /// Based on: L. B. Leopold, M. G. Wolman, River meanders, 1960 (a wave is about eleven widths long).
    fn meander(&self, trunk: &Channel, offsets: &mut [f64]) {
        const STEEPEST: f64 = 0.008;
        let (knots, segments) = (&trunk.knots, trunk.knots.len() - 1);
        let whole = knots[0].at.distance(knots[segments].at);
        let slope = (knots[0].level_m - knots[segments].level_m) / (whole * self.fields.metres_a_grain());
        let strength = (1.0 - slope / STEEPEST).max(0.0);
        let segment = whole / segments as f64;
        let width = self.fields.river_width_m(knots[segments].area) / self.fields.metres_a_grain();
        let wave = (11.0 * width).max(5.0 * segment);
        let id = (trunk.id.1, trunk.id.2);
        let mut phase = chance(self.seed, id, Draw::MeanderPhase, 0);
        for step in 1..segments {
            // Waves differ in length from one to the next.
            phase +=
                segment / wave * (0.7 + 0.6 * chance(self.seed.wrapping_add(step as u64), id, Draw::MeanderWave, 0));
            // Straight where it begins and ends, and in lakes.
            let ends = (8.0 * step.min(segments - step) as f64 / segments as f64).min(1.0);
            let shore = if knots[step].lake > 0.0 { 0.0 } else { 1.0 };
            offsets[step] += 0.2 * wave * strength * ends * shore * libm::sin(TAU * phase);
        }
    }
}

/// Whether two trunks that share a node cross, or run side by side for long.
fn too_close(trunk: &[Knot], other: &[Knot], joint: Point) -> bool {
    const STEP: usize = 2;
    // Of the way from the node, at least, and as much of the trunk's length from it on.
    const APART: f64 = 0.1;
    const FROM: f64 = 0.25;
    let places = |knots: &[Knot]| knots.iter().map(|knot| knot.at.from(joint)).collect::<Vec<_>>();
    let (trunk, other) = (places(trunk), places(other));
    let (trunk_lines, other_lines) = (lines(&trunk, STEP), lines(&other, STEP));
    let crosses = |line: &LineSegment| other_lines.iter().any(|other| line.crosses(other));
    let whole = length(trunk[0]).max(length(trunk[trunk.len() - 1]));
    let beside = |place: &[f64; 2]| {
        let way = length(*place);
        way > FROM * whole && other_lines.iter().any(|line| line.distance(*place) < APART * way)
    };
    trunk_lines.iter().any(crosses) || trunk.iter().step_by(STEP).any(beside)
}
