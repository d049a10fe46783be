//! Tributaries: how they run along their courses, and how their beds rise.

use std::sync::Arc;

use super::channel::{Channel, Knot};
use super::chunk::ChunkId;
use super::fields::Fields;
use super::point::Point;
use super::segment::{Segment, Segments};
use super::tributary_course::{Courses, TributaryCourse, TributaryEnd};
use super::trunk::{LEAST_SLOPE, NodeId};
use super::trunk_course::INCISION;
use super::trunk_curve::DROWNED_SLOPE;
use super::wander;
use crate::geometry::{LineSegment, length, lines};
use crate::hash;
use crate::memory::Usage;

/// The area at the mouth of a tributary of a level, in cells of the trunk lattice.
pub fn most_area(level: u32) -> f64 {
    0.25f64.powi(level as i32)
}

/// Share of its area that a tributary has at its head less than at its mouth: a head has a quarter of it, as much as
/// the mouth of a tributary of the next level.
const AREA_FALL: f64 = 0.75;

/// How far from the middle of its course channels are looked for that a tributary may be under: in lengths of the
/// course, and in cells more.
const NEAR: f64 = 1.5;

/// The tributaries of a world.
#[derive(Debug)]
pub struct Tributaries {
    seed: u64,
    fields: Arc<Fields>,
    courses: Courses,
}

impl Tributaries {
    /// The tributaries of a world with these fields.
    pub fn new(fields: Arc<Fields>, seed: u64) -> Tributaries {
        Tributaries { seed, courses: Courses::new(Arc::clone(&fields), seed), fields }
    }

    /// How full its memories are.
    pub(super) fn usages(&self) -> Vec<Usage> {
        self.courses.usages()
    }

    /// The tributaries whose heads are in the cells of a chunk, given whom to ask for the segments of the levels above
    /// one.
    pub fn of(&self, id: ChunkId, above: &impl Fn(ChunkId) -> Segments) -> Vec<Arc<Channel>> {
        let segments = above(id);
        // The straight courses of this one's and its neighbours' tributaries.
        let mut courses: Vec<(NodeId, LineSegment)> = Vec::new();
        for chunk in id.with_neighbours() {
            let lines = self.courses.of(chunk, above);
            courses.extend(lines.iter().map(|course| (course.cell, course.line(segments.origin))));
        }
        let own = self.courses.of(id, above);
        own.iter().map(|course| Arc::new(self.tributary(id.level, course, &segments, &courses))).collect()
    }

    /// A tributary along its course, given the segments of the levels above and the courses of its own around it.
    fn tributary(
        &self,
        level: u32,
        course: &TributaryCourse,
        above: &Segments,
        courses: &[(NodeId, LineSegment)],
    ) -> Channel {
        let (fields, cell) = (&self.fields, self.fields.side(level) as f64);
        let origin = above.origin;
        let &TributaryCourse { cell: id, head, end: TributaryEnd { foot, shore, level_m, mouth, mouth_area } } = course;
        let way = head.from(shore);
        let reach = length(way);
        let from = shore.from(origin);
        let middle = [0, 1].map(|axis| from[axis] + way[axis] / 2.0);
        let brook = NEAR * reach + NEAR * cell;
        let is_near = |segment: &&Segment| {
            let reach = segment.reach(brook);
            segment.nearest(middle).1 < reach * reach
        };
        let near: Vec<&Segment> = above.all.iter().filter(is_near).collect();
        let others = courses.iter().filter(|(other, _)| *other != id).map(|(_, line)| *line);
        let lines = others.chain(near.iter().map(|segment| segment.line()));
        let around: Vec<LineSegment> = lines.filter(|line| line.touches(middle, reach)).collect();
        let places = self.wander(level, id, [from, way], &around);
        let uplift = fields.uplift(head);
        let mut knots = self.bed(
            level,
            uplift,
            Knot { at: shore, level_m, area: most_area(level), lake: 0.0 },
            &places,
            origin,
            &near,
        );
        knots.reverse();
        if foot != shore {
            let drowned_m = shore.distance(foot) * fields.metres_a_grain() * DROWNED_SLOPE;
            knots.push(Knot { at: foot, level_m: level_m - drowned_m, area: most_area(level), lake: 0.0 });
        }
        let mut channel = Channel::new((level, id.0, id.1), knots, mouth, fields.hill_slope(uplift));
        channel.mouth_area = channel.mouth_area.max(mouth_area);
        channel
    }

    /// Where a tributary goes, from its shore up, which is so far [from the origin, and from the shore to the head];
    /// around it are the lines that it must not cross.
    fn wander(&self, level: u32, id: NodeId, [from, way]: [[f64; 2]; 2], around: &[LineSegment]) -> Vec<[f64; 2]> {
        let segments = self.fields.segments_a_channel(level);
        let straight: Vec<[f64; 2]> = (0..=segments)
            .map(|step| [0, 1].map(|axis| from[axis] + way[axis] * (step as f64 / segments as f64)))
            .collect();
        let shares = wander::offsets(hash::network_level(self.seed, level), id, segments);
        let offsets: Vec<f64> = shares.iter().map(|share| share * length(way)).collect();
        let wandered = wander::wandered(&straight, &offsets, around);
        // Where the room was misjudged between two knots, the straight course is still there.
        let crosses = |line: &LineSegment| around.iter().any(|other| other.crosses(line));
        if lines(&wandered, 1).iter().any(crosses) { straight } else { wandered }
    }

    /// The knots of a tributary from its shore up, through places that are relative to an origin, given the segments of
    /// larger valleys near it.
    fn bed(
        &self,
        level: u32,
        uplift: f64,
        shore: Knot,
        places: &[[f64; 2]],
        origin: Point,
        near: &[&Segment],
    ) -> Vec<Knot> {
        let fields = &self.fields;
        let segments = places.len() - 1;
        // Where it comes to the larger valley, hillsides may be gentler.
        let gentlest = fields.hill_slope(fields.uplift(shore.at)).min(fields.hill_slope(uplift));
        let side_slope = INCISION * gentlest * fields.metres_a_grain();
        let area = |share: f64| most_area(level) * (1.0 - AREA_FALL * share);
        // From its head down, as the coast's height is told.
        let coast_m = fields.below_coast_along_m(places.iter().rev().map(|place| origin.moved(*place)));
        let mut knots = vec![shore];
        for step in 1..=segments {
            let share = step as f64 / segments as f64;
            let [before, here] = [places[step - 1], places[step]];
            let step_m = length([here[0] - before[0], here[1] - before[1]]) * fields.metres_a_grain();
            // What a river of the area half way there rises.
            let rise_m = step_m * fields.river_slope(uplift, area(share - 0.5 / segments as f64));
            let below_m = knots[step - 1].level_m;
            let free_m = below_m + rise_m;
            // But it does not stand above the sides of larger valleys: those of lower water may be lower.
            let lower = near.iter().filter(|segment| segment.lowest_m() < free_m);
            let ground_m = lower.map(|segment| segment.side_m(here, side_slope)).fold(free_m, f64::min);
            // Across a lake or the floor of a larger valley it rises no more than that does, but always a little.
            let least_m = below_m + rise_m.min(step_m * LEAST_SLOPE);
            let level_m = ground_m.min(coast_m[segments - step]).max(least_m);
            knots.push(Knot { at: origin.moved(here), level_m, area: area(share), lake: 0.0 });
        }
        knots
    }
}
