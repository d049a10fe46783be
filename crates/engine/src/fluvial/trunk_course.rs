//! The courses of trunks from node to node, and their beds.
//!
//! A course is made in four steps. Each step reads the step before it of the trunks around, so the order in which
//! trunks are made does not matter: a smooth curve; a curve that bends less, where the first comes too close to the
//! curve of a trunk that shares a node; meanders, in a tube that no other trunk's tube meets; and a bed that stays
//! below the coast and below the sides of the larger valley that it joins.
//!
//! To judge the numbers chosen by eye, look at the courses of the largest rivers, on a map of many trunk cells.

use std::sync::Arc;

use glam::DVec2;

use super::bed_cut::cut_into;
use super::channel::{Channel, Knot, Mouth};
use super::course_offsets;
use super::cross_section::measured;
use super::delta;
use super::fields::Fields;
use super::lake::{self, Hollow, NO_LAKE};
use super::meander::{self, CONFINED_TURN, LinePlace, MOST_TURN, Meander, WAVE_WIDTHS, meander_width};
use super::plane::lines;
use super::segment::{LEVEL, Segment, segments_of};
use super::trunk_curve::{BULGE, VOLCANO_FALL, bend_share, curve, directions, head_m, too_close};
use super::trunk_lattice::{Drained, LEAST_SLOPE, Look, NodeId, Trunks, neighbours};
use crate::geometry::{LineSegment, lerp, smooth};
use crate::grain_point::{self, Point, chance};
use crate::hash::{self, Draw};
use crate::lines::LakeId;
use crate::memory::{Memory, Remembers};

/// Greatest distance by which a trunk leaves the cell of its upper node, in cells of the trunk lattice: it runs to a
/// neighbouring cell, and its curve bulges by less than its length.
pub const REACH_CELLS: f64 = 2.5;

/// Step, in knots, at which the lines of other trunks are sampled to keep clear of them: a tube is much wider than a
/// curve bends between two samples.
const CLEAR_STEP: usize = 8;

/// Shares of the full bend: for a trunk, and for one that with the full bend would come too close to another. With the
/// smaller share it still has the same directions at its ends, and leaves room there for a wide river to turn. Chosen
/// by eye.
const BENDS: [f64; 2] = [1.0, 0.4];

/// Slope at and above which rivers do not meander. Chosen by eye.
const STEEPEST_MEANDER: f64 = 0.008;

/// Least length of the stretches in which a trunk wanders, in segments of its course and in meanders: shorter bends are
/// left to the meanders.
const WANDER_SEGMENTS: usize = 4;
const WANDER_WAVES: f64 = 2.0;

/// Length of a meander as a share of the least length, and its greatest turn as a share of the most: the least value,
/// and the range that chance adds.
const WAVE_LENGTHS: (f64, f64) = (1.0, 0.3);
const WAVE_TURNS: (f64, f64) = (0.7, 0.3);

/// Greatest sideways change of a trunk's offset per length of its course. Chosen by eye: without meanders, the course
/// turns by at most 60 degrees.
const MOST_SKEW: f64 = 0.6;

/// Number of parts of a trunk's course. The room beside the trunk is measured for each part.
const ROOMS: usize = 32;

/// Greatest distance of a trunk from its course, as a share of its length.
const MOST_ROOM: f64 = 0.25;

/// Inverse of the share of a trunk's length at each end over which wandering grows to its full size: an eighth.
const ENDS: f64 = 8.0;

/// Meanders from each end of a trunk over which their swing grows to its full size, and the share of the room beside
/// the trunk that meanders may take.
const END_WAVES: f64 = 1.0;
const MEANDER_ROOM: f64 = 0.8;

/// Length of a delta as a share of the most: the least value, and the range that chance adds.
const DELTA_LENGTHS: (f64, f64) = (0.4, 0.6);

/// Depth in metres of the brine on a salt pan.
const PAN_M: f64 = 0.4;

/// The courses of the trunks of a world.
#[derive(Debug)]
pub struct TrunkCourses {
    seed: u64,
    fields: Arc<Fields>,
    nodes: Trunks,
    /// For each of [`BENDS`], the curves of the trunks. After the first bend, only curves that differ from those with
    /// the bend before are kept.
    bent: [Memory<NodeId, Option<Arc<Channel>>>; BENDS.len()],
    free: Memory<NodeId, Option<Arc<Channel>>>,
}

impl TrunkCourses {
    /// Makes the trunks of a world with these fields. With `is_far`, the cells of the lattice are too small to be seen,
    /// and shores are found less precisely.
    pub fn new(fields: Arc<Fields>, is_far: bool, seed: u64) -> TrunkCourses {
        TrunkCourses {
            seed,
            nodes: Trunks::new(Arc::clone(&fields), is_far, seed),
            fields,
            bent: [24 << 20, 8 << 20].map(Memory::new),
            free: Memory::new(32 << 20),
        }
    }

    /// Returns the caches of the courses.
    pub(super) fn memories(&self) -> Vec<&dyn Remembers> {
        let courses = self.bent.iter().chain([&self.free]).map(|memory| memory as &dyn Remembers).collect();
        [self.nodes.memories(), courses].concat()
    }

    /// Returns the lattice on which the trunks run.
    pub fn nodes(&self) -> &Trunks {
        &self.nodes
    }

    /// Returns a rectangle that the trunk from a node does not leave; `None` for a sink. The nodes alone tell it, so
    /// the course need not be made.
    pub fn bounds(nodes: &Look, id: NodeId) -> Option<[Point; 2]> {
        let (from, to) = (nodes.node(id).at, nodes.node(nodes.drained(id).to?).at);
        grain_point::around([from, to], (BULGE + MOST_ROOM) * from.distance(to))
    }

    /// Returns the trunk from a node straight to the next node downstream, or to the sea; `None` for a sink.
    pub fn straight(&self, nodes: &Look, id: NodeId) -> Option<Channel> {
        let here = nodes.node(id);
        // Nodes at sea are all sinks, so their basins need not be made.
        if here.sea {
            return None;
        }
        let Drained { to, sea_at, area, discharge_m3s, .. } = nodes.drained(id);
        let (to, fields) = (to?, &self.fields);
        // From so far away, all of a volcano's trunk counts as dry.
        let discharge_m3s = if fields.volcano_at(id).is_some() { 0.0 } else { discharge_m3s };
        let knot =
            |at: Point, level_m: f64| Knot { at, level_m, area: f64::from(area), discharge_m3s, pool_m: NO_LAKE };
        let (from, there) = (here.at, nodes.node(to));
        let end = match sea_at {
            Some(share) => knot(from.towards(there.at, share), fields.lowstand_level_m()),
            None => knot(there.at, nodes.drained(to).level_m),
        };
        let length_m = from.distance(end.at) * fields.metres_a_grain();
        let level_m = head_m(fields, nodes, id, end.level_m + VOLCANO_FALL * length_m);
        let mouth = if sea_at.is_some() || there.sea { Mouth::Sea } else { Mouth::Channel((0, to.0, to.1)) };
        let trunk = Channel::new((0, id.0, id.1), vec![knot(from, level_m), end], mouth, fields.laws(from));
        Some(measured(fields, trunk))
    }

    /// Returns the trunk from a node to the next node downstream; `None` for a sink.
    ///
    /// Where it joins a larger trunk from the side, its bed stays below the sides of that trunk's valley.
    pub fn trunk(&self, id: NodeId) -> Option<Arc<Channel>> {
        let free = self.free_trunk(id)?;
        let Some((to, false)) = free.next else { return Some(free) };
        let mut trunk = free.as_ref().clone();
        // The larger river above the node, and the trunk that leaves the node.
        let main = self.nodes.drained(to).main;
        let others: Vec<Arc<Channel>> = main.into_iter().chain([to]).filter_map(|id| self.free_trunk(id)).collect();
        let origin = trunk.knots[0].at;
        let segments: Vec<Segment> =
            others.iter().flat_map(|other| segments_of(&self.fields, other, 0, origin, |_| true)).collect();
        cut_into(&self.fields, &mut trunk.knots, trunk.laws.hill_slope, &segments.iter().collect::<Vec<_>>(), origin);
        lake::fill(&mut trunk.knots);
        Some(Arc::new(measured(&self.fields, trunk)))
    }

    /// Returns the trunk from a node to the next before its bed is cut into the sides of other valleys.
    fn free_trunk(&self, id: NodeId) -> Option<Arc<Channel>> {
        let make = || {
            let mut trunk = self.apart_trunk(id)?.as_ref().clone();
            match trunk.next {
                Some(_) => self.wander(id, &mut trunk),
                None => self.end_in_sea(&mut trunk.knots),
            }
            self.cut_into_coast(&mut trunk.knots);
            self.build_delta(id, &mut trunk.knots);
            self.dig_lake(id, &mut trunk);
            Some(Arc::new(measured(&self.fields, trunk)))
        };
        self.free.get(id, make).as_ref().clone()
    }

    /// Builds a delta, which fills the drowned valley where the trunk meets the sea.
    fn build_delta(&self, id: NodeId, knots: &mut Vec<Knot>) {
        let deltas = self.fields.settings().coast.deltas;
        if self.fields.has_sea() && deltas > 0.0 {
            let area = knots[knots.len() - 1].area;
            let luck = chance(self.seed, id, Draw::Delta, 0);
            let share = DELTA_LENGTHS.0 + DELTA_LENGTHS.1 * luck;
            delta::build(&self.fields, knots, share * deltas * area.sqrt() * self.fields.side(0) as f64);
        }
    }

    /// Digs the lake on a trunk's way, or the lake at the sink where the trunk ends.
    fn dig_lake(&self, id: NodeId, trunk: &mut Channel) {
        let (fields, nodes) = (&self.fields, self.nodes.look());
        let Some((to, _)) = trunk.next else { return };
        let (here, sink) = (nodes.drained(id), nodes.drained(to));
        if sink.to.is_none() && sink.lake {
            // All trunks that end at the sink reach the same depth.
            let at = nodes.node(to).at;
            let laws = fields.laws(at);
            let trough = laws.trough(fields, 0, sink.area as f64, sink.level_m);
            let hollow = Hollow::new(fields, self.seed, 0, to).on_floor(trough);
            if hollow.half_width() >= 2.0 * fields.least_lake(sink.discharge_m3s)
                && hollow.is_inland(fields, at, sink.level_m)
            {
                let depth_m = hollow.depth_m(fields, laws.hill_slope, trough);
                // What its rivers bring has filled the hollow up to a level floor of salt.
                hollow.dig_sink(trunk, if fields.keeps_water(at) { depth_m.min(PAN_M) } else { depth_m });
                trunk.lake = Some(LakeId((0, to.0, to.1)));
            }
        } else if here.lake {
            let origin = trunk.knots[0].at;
            let around = self.around(id, origin);
            let others = |at: Point| {
                let at = at.from(origin).into();
                around.iter().map(|line| line.distance(at)).fold(f64::INFINITY, f64::min)
            };
            Hollow::new(fields, self.seed, 0, id).dig(fields, trunk, |_| true, |_| f64::NEG_INFINITY, others);
        }
    }

    /// Cuts off a trunk that ends in the sea after the first stretch of sea that it crosses.
    fn end_in_sea(&self, knots: &mut Vec<Knot>) {
        let in_sea = |knot: &Knot| self.fields.in_lowstand(knot.at);
        let wet = knots.iter().position(in_sea).unwrap_or(knots.len());
        let after = knots[wet..].iter().take_while(|knot| in_sea(knot)).count();
        knots.truncate((wet + after).max(2));
    }

    /// Returns the lines of all trunks that may come near one, before they wander.
    fn around(&self, id: NodeId, origin: Point) -> Vec<LineSegment> {
        // Such trunks start from the nodes around.
        let nodes = (-2..=2).flat_map(|y| (-2..=2).map(move |x| (id.0 + x, id.1 + y)));
        let others = nodes.filter(|node| *node != id).filter_map(|node| self.apart_trunk(node));
        let sparse = |other: Arc<Channel>| -> Vec<DVec2> {
            other.knots.iter().step_by(CLEAR_STEP).map(|knot| knot.at.from(origin)).collect()
        };
        others.flat_map(|other| lines(&sparse(other), 1)).collect()
    }

    /// Moves the knots of a trunk sideways, as far as the trunks around leave room, and adds meanders.
    fn wander(&self, id: NodeId, trunk: &mut Channel) {
        let (origin, nodes) = (trunk.knots[0].at, self.nodes.look());
        let course = trunk.course(origin);
        let around = self.around(id, origin);
        let last = course.len() - 1;
        let (from, to) = (trunk.knots[0].at, trunk.knots[last].at);
        let bend = bend_share(&self.fields, &nodes.drained(id), from, to);
        let whole = from.distance(to) * bend;
        let rooms = rooms(&course, &around, MOST_ROOM * whole);
        let mut meanders = self.meanders(trunk, bend);
        // If a course wandered in stretches shorter than its meanders, it would have corners.
        let longest = meanders.iter().map(|meander| meander.wave).fold(0.0, f64::max) * last as f64 / from.distance(to);
        let stretch = (WANDER_SEGMENTS.max((WANDER_WAVES * longest).ceil() as usize)).next_power_of_two().min(last / 2);
        let mut offsets = course_offsets::smooth_offsets(self.seed, id, last, stretch);
        for step in 0..=last {
            // Towards the ends, wandering fades out: trunks that meet at a node pass through it in one direction.
            let (end, meander) = (step.min(last - step) as f64 / last as f64, &mut meanders[step]);
            let free = smooth(ENDS * end);
            // Meanders take most of the room; wandering takes the rest.
            meander.turn *= smooth(end * whole / (END_WAVES * meander.wave));
            let swing = Meander::swing(meander.wave, meander.turn);
            let room = rooms[step];
            meander.turn *= (MEANDER_ROOM * room / swing.max(1e-9)).min(1.0);
            let left = room - swing.min(MEANDER_ROOM * room);
            offsets[step] = (offsets[step] * whole * free).clamp(-left, left);
        }
        course_offsets::draw_in(&mut offsets, MOST_SKEW * from.distance(to) / last as f64);
        let width = meander_width(&self.fields, trunk.knots[last].discharge_m3s);
        let course = course_offsets::moved(&course, &offsets);
        let ends = trunk.next.map(|(to, _)| directions(&nodes, id, to));
        let ends = [0, 1].map(|end| ends.map(|ends| ends[end]));
        let places = meander::line(&course, ends, &meanders, width);
        let knot = |place: &LinePlace| {
            let (upper, lower) = (&trunk.knots[place.segment], &trunk.knots[place.segment + 1]);
            Knot { at: origin.moved(place.at), ..upper.towards(lower, place.share) }
        };
        trunk.knots = places.iter().map(knot).collect();
    }

    /// Returns the meanders of a trunk at its knots, in grains. Their turn is 0 where the trunk is too steep to
    /// meander.
    fn meanders(&self, trunk: &Channel, bend: f64) -> Vec<Meander> {
        let knots = &trunk.knots;
        let segments = knots.len() - 1;
        let whole = knots[0].at.distance(knots[segments].at);
        let slope = (knots[0].level_m - knots[segments].level_m) / (whole * self.fields.metres_a_grain());
        let strength = bend * (1.0 - slope / STEEPEST_MEANDER).max(0.0);
        let segment = whole / segments as f64;
        let id = (trunk.id.1, trunk.id.2);
        let mut phase = chance(self.seed, id, Draw::MeanderPhase, 0);
        let mut meanders = Vec::with_capacity(knots.len());
        let laws = self.fields.all_laws(&trunk.places());
        for (step, (knot, laws)) in knots.iter().zip(&laws).enumerate() {
            // Chance changes from meander to meander, and is interpolated within each.
            let (wave, within) = (phase.floor() as usize, phase - phase.floor());
            let luck = |draw| {
                let of = |wave: usize| chance(hash::network_knot(self.seed, wave), id, draw, 0);
                of(wave) + (of(wave + 1) - of(wave)) * within
            };
            let wave = WAVE_WIDTHS * meander_width(&self.fields, knot.discharge_m3s);
            let wave = wave * (WAVE_LENGTHS.0 + WAVE_LENGTHS.1 * luck(Draw::MeanderWave));
            // Where the valley's floor is wide enough for the whole meander belt, the river turns further.
            let floor = LEVEL * laws.trough(&self.fields, trunk.id.0, knot.area, knot.level_m);
            let fits = (floor / Meander::swing(wave, MOST_TURN)).min(1.0);
            let most = CONFINED_TURN + (MOST_TURN - CONFINED_TURN) * fits;
            let turn = most * strength * (WAVE_TURNS.0 + WAVE_TURNS.1 * luck(Draw::MeanderTurn));
            meanders.push(Meander { phase, turn, wave });
            phase += segment / meanders[step].wave;
        }
        meanders
    }

    /// Lowers the bed of a trunk on land so that it cuts into the coast.
    fn cut_into_coast(&self, knots: &mut [Knot]) {
        if !self.fields.has_sea() {
            return;
        }
        let (lowstand_m, metres) = (self.fields.lowstand_level_m(), self.fields.metres_a_grain());
        let most_m = self.fields.below_coast_along_m(knots.iter().map(|knot| knot.at), lowstand_m);
        for index in (0..knots.len() - 1).rev() {
            let (below, here) = (knots[index + 1], &mut knots[index]);
            // Below the lowstand, the coast does not limit the bed.
            if below.level_m >= lowstand_m {
                let least_m = here.at.distance(below.at) * metres * LEAST_SLOPE;
                let least_m = below.level_m + (here.level_m - below.level_m).min(least_m);
                here.level_m = here.level_m.min(most_m[index]).max(least_m);
            }
        }
    }

    /// Returns the course of the trunk from a node to the next: a smooth curve, which bends less where it would come
    /// too close to trunks that share a node with it.
    fn apart_trunk(&self, id: NodeId) -> Option<Arc<Channel>> {
        self.bent_trunk(id, BENDS.len() - 1)
    }

    /// Returns the course of a trunk after so many rounds of comparing it with the trunks around, each as in the round
    /// before.
    fn bent_trunk(&self, id: NodeId, looks: usize) -> Option<Arc<Channel>> {
        let bent = || curve(&self.fields, &self.nodes.look(), id, BENDS[looks]).map(Arc::new);
        let Some(before) = looks.checked_sub(1) else { return self.bent[0].get(id, bent).as_ref().clone() };
        let make = || {
            let trunk = self.bent_trunk(id, before)?;
            let nodes = &self.nodes.look();
            let to = nodes.drained(id).to?;
            let from = |node: NodeId, to: NodeId| {
                neighbours(to)
                    .filter(move |other| *other != node && nodes.drained(*other).to == Some(to))
                    .map(move |other| (other, to))
            };
            // Trunks that end at this trunk's head, other trunks that end at its end, and the trunk that leaves its
            // end.
            let mut others = from(id, id).chain(from(id, to)).chain([(to, to)]);
            let meets = |(other, node): (NodeId, NodeId)| {
                let joint = nodes.node(node).at;
                self.bent_trunk(other, before).is_some_and(|other| too_close(&trunk.knots, &other.knots, joint))
            };
            if others.any(meets) { bent() } else { None }
        };
        self.bent[looks].get(id, make).as_ref().clone().or_else(|| self.bent_trunk(id, before))
    }
}

/// Returns the room for each place of a trunk's course to move sideways, at most `most`. It changes gradually, over a
/// few [`ROOMS`]ths of the course.
fn rooms(course: &[DVec2], around: &[LineSegment], most: f64) -> Vec<f64> {
    let last = course.len() - 1;
    let step = (last / ROOMS).max(1);
    let coarse: Vec<DVec2> = course.iter().copied().step_by(step).collect();
    let rooms = course_offsets::rooms(&coarse, around, most);
    let around = |values: &[f64], at: usize| values[at.max(2) - 2..(at + 3).min(values.len())].to_vec();
    // The least room of each place and of its neighbours.
    let least: Vec<f64> =
        (0..rooms.len()).map(|at| around(&rooms, at).into_iter().fold(f64::INFINITY, f64::min)).collect();
    let mean = |at: usize| {
        let values = around(&least, at);
        values.iter().sum::<f64>() / values.len() as f64
    };
    let means: Vec<f64> = (0..rooms.len()).map(mean).collect();
    let at = |knot: usize| {
        let (from, share) = (knot / step, (knot % step) as f64 / step as f64);
        lerp([means[from], means[(from + 1).min(means.len() - 1)] - means[from]], share)
    };
    (0..=last).map(at).collect()
}
