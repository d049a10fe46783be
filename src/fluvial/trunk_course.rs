//! The courses of trunks from node to node, and their beds.
//!
//! In four steps, each of which asks for the one before of the trunks around, so that it does not matter which comes
//! first: a smooth curve; a straight line instead, where the curve comes too close to that of a trunk that shares a
//! node; meanders, in a tube that no other's tube meets; and a bed that keeps below the coast and below the sides of
//! the larger valley that it comes to.

use std::f64::consts::TAU;
use std::sync::Arc;

use super::channel::{Channel, Knot};
use super::fields::Fields;
use super::point::chance;
use super::segment::{Segment, segments_of};
use super::trunk::{LEAST_SLOPE, NodeId, Trunks, neighbours};
use super::trunk_curve::{bend_share, curve, too_close};
use super::wander;
use crate::geometry::{LineSegment, lines};
use crate::hash::{self, Draw};
use crate::memory::{Memory, Usage};

/// How steep a river runs down the side of a larger one's valley at most, as a share of that side's slope: so it cuts
/// into it, and is not lost on it. Chosen by eye.
pub const INCISION: f64 = 0.7;

/// Cells of the trunk lattice that a trunk sticks out of the cell of its upper node at most: it runs to a neighbouring
/// one, and its curve bulges by less than its length.
pub const REACH_CELLS: f64 = 2.5;

/// Knots from one to the next of the lines by which a trunk keeps clear of others: its tube is much wider than what the
/// curve does between them.
const CLEAR_STEP: usize = 8;

/// Slope from which on a river does not meander. Chosen by eye.
const STEEPEST_MEANDER: f64 = 0.008;

/// Length of a meander in widths of the river.
///
/// Based on: L. B. Leopold, M. G. Wolman, River meanders, 1960.
const WAVE_WIDTHS: f64 = 11.0;

/// Straight segments that a meander has at least: with fewer it would be a zigzag.
const WAVE_SEGMENTS: f64 = 5.0;

/// How far a meander swings to the side, as a share of its length. Chosen by eye.
const WAVE_SWING: f64 = 0.2;

/// How long a wave of meanders is, as a share of the mean: least, and so much more by chance.
const WAVE_LENGTHS: (f64, f64) = (0.7, 0.6);

/// Share of a trunk's length at each end over which meanders grow: an eighth.
const ENDS: f64 = 8.0;

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
            smooth: Memory::new(8 << 20),
            apart: Memory::new(8 << 20),
            free: Memory::new(8 << 20),
        }
    }

    /// How full its memories are.
    pub(super) fn usages(&self) -> Vec<Usage> {
        let courses = [self.smooth.usage(), self.apart.usage(), self.free.usage()];
        [self.nodes.usages(), courses.to_vec()].concat()
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
        // The larger river above the node, and the one that goes on from there.
        let main = self.nodes.drained(to).main;
        let others: Vec<Arc<Channel>> = main.into_iter().chain([to]).filter_map(|id| self.free_trunk(id)).collect();
        let origin = trunk.knots[0].at;
        let segments: Vec<Segment> =
            others.iter().flat_map(|other| segments_of(&self.fields, other, 0, origin, |_| true)).collect();
        // From the mouth up, so that each knot knows what it must stay above.
        for index in (0..trunk.knots.len() - 1).rev() {
            let (below, here) = (trunk.knots[index + 1], trunk.knots[index]);
            let hill_slope = self.fields.hill_slope(self.fields.uplift(here.at)).min(trunk.hill_slope);
            let slope = INCISION * hill_slope * self.fields.metres_a_grain();
            let relative = here.at.from(origin);
            let sides = segments.iter().map(|segment| segment.side_m(relative, slope));
            // It goes on falling, by a centimetre at least where it did.
            let least_m = below.level_m + (here.level_m - below.level_m).clamp(0.0, 0.01);
            trunk.knots[index].level_m = sides.fold(here.level_m, f64::min).max(least_m);
        }
        Some(trunk)
    }

    /// The trunk from a node to the next one, but for what the sides of other valleys do to it.
    fn free_trunk(&self, id: NodeId) -> Option<Arc<Channel>> {
        let make = || {
            let mut trunk = self.apart_trunk(id)?.as_ref().clone();
            match trunk.next {
                Some(_) => self.wander(id, &mut trunk),
                None => self.end_in_sea(&mut trunk.knots),
            }
            self.cut_into_coast(&mut trunk.knots);
            Some(Arc::new(trunk.bounded()))
        };
        self.free.get(id, make).as_ref().clone()
    }

    /// Ends a trunk that the sea cuts short with the first stretch of sea that it comes to.
    fn end_in_sea(&self, knots: &mut Vec<Knot>) {
        let in_sea = |knot: &Knot| self.fields.in_sea(knot.at);
        let wet = knots.iter().position(in_sea).unwrap_or(knots.len());
        let after = knots[wet..].iter().take_while(|knot| in_sea(knot)).count();
        knots.truncate((wet + after).max(2));
    }

    /// Moves the knots of a trunk to the side, as far as the trunks around leave room.
    fn wander(&self, id: NodeId, trunk: &mut Channel) {
        let origin = trunk.knots[0].at;
        let course = trunk.course(origin);
        // All that may come near start from the nodes around; as they are before they wander, like this one.
        let nodes = (-2..=2).flat_map(|y| (-2..=2).map(move |x| (id.0 + x, id.1 + y)));
        let others = nodes.filter(|node| *node != id).filter_map(|node| self.apart_trunk(node));
        let around: Vec<LineSegment> = others.flat_map(|other| lines(&other.course(origin), CLEAR_STEP)).collect();
        let (from, to) = (trunk.knots[0].at, trunk.knots[course.len() - 1].at);
        let whole = from.distance(to) * bend_share(&self.fields, &self.nodes.drained(id), from, to);
        let mut offsets = wander::offsets(self.seed, id, course.len() - 1);
        // A lake stays where its node is.
        for (offset, knot) in offsets.iter_mut().zip(&trunk.knots) {
            *offset *= if knot.lake > 0.0 { 0.0 } else { whole };
        }
        self.meander(trunk, &mut offsets);
        for (knot, place) in trunk.knots.iter_mut().zip(wander::wandered(&course, &offsets, &around)) {
            knot.at = origin.moved(place);
        }
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
            // Under the sea the coast leaves nothing, and a lake is level.
            if below.level_m >= sea_m && here.lake == 0.0 {
                let least_m = here.at.distance(below.at) * metres * LEAST_SLOPE;
                let least_m = below.level_m + (here.level_m - below.level_m).min(least_m);
                here.level_m = here.level_m.min(most_m[index]).max(least_m);
            }
        }
    }

    /// The course of the trunk from a node to the next: a smooth curve, or a straight line where that comes too close
    /// to another one with which it shares a node.
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
            if others.any(meets) { curve(&self.fields, &self.nodes, id, 0.0).map(Arc::new) } else { Some(smooth) }
        };
        self.apart.get(id, make).as_ref().clone()
    }

    /// The course of the trunk from a node to the next: a smooth curve.
    fn smooth_trunk(&self, id: NodeId) -> Option<Arc<Channel>> {
        self.smooth.get(id, || curve(&self.fields, &self.nodes, id, 1.0).map(Arc::new)).as_ref().clone()
    }

    /// Adds meanders to the offsets of a trunk, in grains, where it is flat enough for that.
    fn meander(&self, trunk: &Channel, offsets: &mut [f64]) {
        let (knots, segments) = (&trunk.knots, trunk.knots.len() - 1);
        let whole = knots[0].at.distance(knots[segments].at);
        let slope = (knots[0].level_m - knots[segments].level_m) / (whole * self.fields.metres_a_grain());
        let strength = (1.0 - slope / STEEPEST_MEANDER).max(0.0);
        let segment = whole / segments as f64;
        let width = self.fields.river_width_m(knots[segments].area) / self.fields.metres_a_grain();
        let wave = (WAVE_WIDTHS * width).max(WAVE_SEGMENTS * segment);
        let id = (trunk.id.1, trunk.id.2);
        let mut phase = chance(self.seed, id, Draw::MeanderPhase, 0);
        for step in 1..segments {
            // Waves differ in length from one to the next.
            let luck = chance(hash::network_knot(self.seed, step), id, Draw::MeanderWave, 0);
            phase += segment / wave * (WAVE_LENGTHS.0 + WAVE_LENGTHS.1 * luck);
            // Straight where it begins and ends, and in lakes.
            let ends = (ENDS * step.min(segments - step) as f64 / segments as f64).min(1.0);
            let shore = if knots[step].lake > 0.0 { 0.0 } else { 1.0 };
            offsets[step] += WAVE_SWING * wave * strength * ends * shore * libm::sin(TAU * phase);
        }
    }
}
