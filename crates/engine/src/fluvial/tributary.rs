//! Tributaries: the lines that they follow around their straight courses, and the heights of their beds.

use std::sync::Arc;

use glam::DVec2;

use super::bed_cut::{bed_in, cut_into, nearly_below};
use super::channel::{Channel, Knot, Mouth};
use super::course_offsets;
use super::cross_section::measured;
use super::fields::{BESIDE, Fields, most_area};
use super::lake::{self, Hollow, NO_LAKE};
use super::laws::Laws;
use super::plane::lines;
use super::segment::{Circle, Segment, SegmentBounds, segments_of};
use super::segments_above::{self, Above, AsksAbove, ChannelPart};
use super::tributary_bed::{GentlestSides, LargerValleys, TributaryBed, beside_m};
use super::tributary_course::{Courses, TributaryCourse, TributaryEnd};
use super::trunk_curve::DROWNED_SLOPE;
use crate::geometry::LineSegment;
use crate::grain_point::{Point, chance, overlap, padded};
use crate::hash::{self, Draw};
use crate::lines::ChannelId;
use crate::memory::{Memory, Remembers};

/// Radius around the middle of a tributary's course within which larger valleys are looked up, as a multiple of the sum
/// of the course's length and the side of a cell.
const NEAR: f64 = 1.5;

/// Height in metres above the side of another valley from which on a bed counts as hanging in the air: more than
/// rasters lose.
const HANGS_M: f64 = 1.0;

/// The tributaries of a world.
#[derive(Debug)]
pub struct Tributaries {
    seed: u64,
    fields: Arc<Fields>,
    courses: Courses,
    free: Memory<ChannelId, Option<Arc<Channel>>>,
}

/// The surroundings of a tributary: the segments of the levels above, and the straight courses of other tributaries of
/// its level, relative to the segments' origin.
struct Surroundings {
    above: Above,
    /// Middle of the tributary's course, and the course's length in grains.
    middle: DVec2,
    reach: f64,
    courses: Vec<LineSegment>,
}

impl Surroundings {
    /// Returns the larger valleys near the tributary, given the side of its level's cells.
    fn valleys(&self, cell: f64) -> LargerValleys<'_> {
        LargerValleys { above: &self.above, middle: self.middle, brook: NEAR * (self.reach + cell) }
    }

    /// Returns the lines that the tributary must not cross, those of larger valleys among them.
    fn lines(&self, valleys: LargerValleys) -> Vec<LineSegment> {
        let may_touch = |bounds: &SegmentBounds| bounds.touches(self.middle, self.reach);
        let lines = self.courses.iter().copied().chain(valleys.which(&may_touch).map(Segment::line));
        lines.filter(|line| line.touches(self.middle.into(), self.reach)).collect()
    }
}

impl Tributaries {
    /// Creates the tributaries of a world with these fields.
    pub fn new(fields: Arc<Fields>, seed: u64) -> Tributaries {
        Tributaries { seed, courses: Courses::new(Arc::clone(&fields), seed), fields, free: Memory::new(24 << 20) }
    }

    /// Returns the caches.
    pub(super) fn memories(&self) -> Vec<&dyn Remembers> {
        let own: &dyn Remembers = &self.free;
        [self.courses.memories(), vec![own]].concat()
    }

    /// Returns the cells of a level whose tributaries may touch a rectangle.
    pub fn touching(&self, level: u32, rectangle: [Point; 2], above: &impl AsksAbove) -> Vec<ChannelId> {
        self.courses.touching(level, rectangle, above, false)
    }

    /// Returns the tributary whose head is in a cell, if there is one.
    pub fn of(&self, id: ChannelId, above: &impl AsksAbove) -> Option<Arc<Channel>> {
        let head = self.courses.head(id)?;
        // Nobody sees whether a dry bed lies exactly on the ground, so it is not cut into the valleys of others of its
        // level.
        if !self.fields.is_wet_at(id.0, head) {
            return self.make_free(id, above);
        }
        let mut channel = self.free(id, above)?.as_ref().clone();
        let seen = padded(channel.bounds(), self.fields.side(id.0) as f64);
        let origin = segments_above::origin(&self.fields, channel.bounds()[0]);
        let others = self.touching(id.0, seen, above).into_iter().filter(|other| *other != id);
        let others = others.filter_map(|other| self.free(other, above)).filter(|other| overlap(other.bounds(), seen));
        let others: Vec<Arc<Channel>> = others.collect();
        // Most others have all of their water above this bed, so they cannot lower it.
        let (_, highest_m) = bed_in(&channel.knots, origin);
        let may_be_lower = |other: &&Arc<Channel>| other.knots.iter().any(|knot| knot.level_m < highest_m);
        let segments = segments_of_all(&self.fields, others.iter().filter(may_be_lower), origin);
        let segments: Vec<&Segment> = segments.iter().collect();
        cut_into(&self.fields, &mut channel.knots, channel.laws.hill_slope, &segments, origin);
        let lower = |circle: &Circle, slope, most_m| nearly_below(&segments, circle, slope, most_m);
        leave_to_captors(&self.fields, &mut channel, lower, origin);
        if channel.lake.is_none() && channel.mouth != Mouth::Sea {
            self.dig_lake(&mut channel, &others, above);
        }
        Some(Arc::new(measured(&self.fields, channel)))
    }

    /// Returns the tributary of a cell before others of its level lower its bed, and without a lake on its way.
    fn free(&self, id: ChannelId, above: &impl AsksAbove) -> Option<Arc<Channel>> {
        self.free.get(id, || self.make_free(id, above)).as_ref().clone()
    }

    fn make_free(&self, id: ChannelId, above: &impl AsksAbove) -> Option<Arc<Channel>> {
        let course = self.courses.of(id, above)?;
        let surroundings = self.surroundings(id, [course.end.shore, course.head], above);
        let mut channel = self.tributary(id, &course, &surroundings);
        self.sink_in(&mut channel, above);
        Some(Arc::new(measured(&self.fields, channel)))
    }

    /// Returns the surroundings of a tributary with this shore and this head.
    fn surroundings(&self, id: ChannelId, [shore, head]: [Point; 2], above: &impl AsksAbove) -> Surroundings {
        let way = head.from(shore);
        let (middle, reach) = (shore.moved(way / 2.0), way.length());
        let cell = self.fields.side(id.0) as f64;
        let above_here = above.above(id.0, middle.square(NEAR * (reach + cell)), ChannelPart::Sides);
        let origin = above_here.origin;
        let others = self.courses.touching(id.0, middle.square(reach), above, true).into_iter();
        let others = others.filter(|other| *other != id);
        let courses = others.filter_map(|other| Some(self.courses.of(other, above)?.line(origin))).collect();
        // The exact middle, which need not be a whole number of grains.
        let middle = shore.from(origin) + way / 2.0;
        Surroundings { above: above_here, middle, reach, courses }
    }

    /// Makes a tributary along its course, before others of its level lower its bed.
    fn tributary(&self, id: ChannelId, course: &TributaryCourse, surroundings: &Surroundings) -> Channel {
        let (fields, level) = (&self.fields, id.0);
        let origin = surroundings.above.origin;
        let &TributaryCourse { head, end } = course;
        let TributaryEnd { foot, shore, level_m, mouth, lake, joined_slope } = end;
        let pool_m = lake.map_or(NO_LAKE, |(level_m, _)| level_m);
        let way = head.from(shore);
        let from = shore.from(origin);
        let near = surroundings.valleys(fields.side(level) as f64);
        let laws = fields.laws(head);
        let is_wet = laws.is_wet(fields, level);
        let places = self.wander((id, is_wet), [from, way], &surroundings.lines(near));
        let discharge_m3s = laws.mouth_m3s(fields, level);
        let knot = Knot { at: shore, level_m, area: most_area(level), discharge_m3s, pool_m };
        let filled_m = lake.map_or(f64::NEG_INFINITY, |(pool_m, id)| lake::filled_m(id, pool_m, level_m, level));
        let mut knots = TributaryBed::new(fields, (level, &laws), (knot, origin), &places, near, filled_m).knots();
        knots.reverse();
        if foot != shore {
            let drowned_m = shore.distance(foot) * fields.metres_a_grain() * DROWNED_SLOPE;
            knots.push(Knot { at: foot, level_m: level_m - drowned_m, ..knot });
        }
        let mut channel = Channel::new(id, knots, mouth, laws);
        channel.lake = lake.map(|(_, id)| id);
        channel.joined_slope = joined_slope;
        if is_wet {
            leave_to_captors(
                fields,
                &mut channel,
                |circle, slope, most_m| near.nearly_below(circle, slope, most_m),
                origin,
            );
        }
        channel
    }

    /// Lets the water of a tributary sink into the ground of volcanoes: where it runs there and above, and everywhere if
    /// it joins a channel that is dry because of that.
    fn sink_in(&self, channel: &mut Channel, above: &impl AsksAbove) {
        // No tributary is as long as the distance up to which these are known.
        let volcanoes = self.fields.volcanoes_near(channel.knots[0].at);
        if volcanoes.is_empty() {
            return;
        }
        let foot = channel.mouth_knot().at;
        let is_porous = |at: Point| volcanoes.iter().any(|volcano| volcano.is_porous(&self.fields, at));
        let joins_dry = || match channel.mouth {
            Mouth::Channel(id) => {
                above.channel(id).is_some_and(|joined| !self.fields.holds_water(joined.discharge_near_m3s(foot)))
            }
            _ => false,
        };
        let dry = match is_porous(foot) || joins_dry() {
            true => channel.knots.len(),
            // No water comes from above a dry stretch.
            false => channel.knots.iter().rposition(|knot| is_porous(knot.at)).map_or(0, |last| last + 1),
        };
        for knot in &mut channel.knots[..dry] {
            knot.discharge_m3s = 0.0;
        }
    }

    /// Tells whether the tributary of a cell has a lake, provided that the tributary and room for the lake exist. Dry
    /// beds have none.
    pub fn may_have_lake(&self, id @ (level, x, y): ChannelId) -> bool {
        let seed = hash::network_level(self.seed, level);
        let luck = chance(seed, (x, y), Draw::Lake, 0);
        let has_lake = |laws: Laws| luck < laws.lakes && laws.is_wet(&self.fields, level);
        has_lake(*self.fields.most_laws()) && self.courses.head(id).is_some_and(|head| has_lake(self.fields.laws(head)))
    }

    /// Digs the lake of a tributary that has one, given others of its level near it.
    fn dig_lake(&self, channel: &mut Channel, others: &[Arc<Channel>], above: &impl AsksAbove) {
        if !self.may_have_lake(channel.id) {
            return;
        }
        let (fields, (level, x, y)) = (&self.fields, channel.id);
        let hollow = Hollow::new(fields, hash::network_level(self.seed, level), level, (x, y));
        let (head, mouth) = (channel.knots[0].at, channel.knots[channel.knots.len() - 1].at);
        let surroundings = self.surroundings(channel.id, [mouth, head], above);
        let origin = surroundings.above.origin;
        let valleys = surroundings.valleys(fields.side(level) as f64);
        let (around, mouth) = (surroundings.lines(valleys), mouth.from(origin));
        let larger: Vec<&Segment> = valleys.which(|_| true).collect();
        let mut near = larger.clone();
        let is_own = |at: Point| !larger.iter().any(|segment| segment.has_on_floor(at.from(origin)));
        let others = segments_of_all(fields, others.iter(), origin);
        near.extend(&others);
        let beside = GentlestSides { slope: BESIDE * channel.laws.hill_slope * fields.metres_a_grain(), trough: 0.0 };
        let least_m = |at: Point| beside_m(&near, at.from(origin), beside);
        let others = |at: Point| {
            let at = at.from(origin);
            let lines = around.iter().filter(|line| line.distance(mouth.into()) > 1.0);
            lines.map(|line| line.distance(at.into())).fold(f64::INFINITY, f64::min)
        };
        hollow.dig(fields, channel, is_own, least_m, others);
    }

    /// Returns the places of a tributary's winding line, from its shore up. `from` is the shore relative to the origin,
    /// `way` leads from there to the head, and `around` has the lines that the tributary must not cross.
    fn wander(
        &self,
        ((level, x, y), is_wet): (ChannelId, bool),
        [from, way]: [DVec2; 2],
        around: &[LineSegment],
    ) -> Vec<DVec2> {
        let segments = self.fields.segments_a_channel(level);
        let straight: Vec<DVec2> = (0..=segments).map(|step| from + way * (step as f64 / segments as f64)).collect();
        let shares = course_offsets::offsets(hash::network_level(self.seed, level), (x, y), segments);
        let offsets: Vec<f64> = shares.iter().map(|share| share * way.length()).collect();
        let most = offsets.iter().map(|offset| offset.abs()).fold(0.0, f64::max);
        let rooms = course_offsets::rooms(&straight, around, most);
        let offsets: Vec<f64> = offsets.iter().zip(rooms).map(|(offset, room)| offset.clamp(-room, room)).collect();
        let wandered = course_offsets::moved(&straight, &offsets);
        // Channels of the finest level, the most numerous by far, are not rounded: their segments are as short as cut
        // corners would be. Of the others, those with water are rounded twice, because corners of water show.
        let times = match level + 1 == self.fields.levels() {
            true => 0,
            false => 1 + usize::from(is_wet),
        };
        let wandered = (0..times).fold(wandered, |places, _| course_offsets::rounded(&places));
        // If the room was misjudged between two knots, the straight course is used instead.
        let crosses = |line: &LineSegment| around.iter().any(|other| other.crosses(line));
        if lines(&wandered, 1).iter().any(crosses) { straight } else { wandered }
    }
}

/// Returns the segments of some channels.
fn segments_of_all<'a>(
    fields: &Fields,
    channels: impl Iterator<Item = &'a Arc<Channel>>,
    origin: Point,
) -> Vec<Segment> {
    let mut segments = Vec::new();
    channels.for_each(|channel| segments.extend(segments_of(fields, channel, 0, origin, |_| true)));
    segments
}

/// Lets a tributary begin below all places where its bed hangs in the air: other valleys are so much lower there that
/// they have captured the water from above. `lower` returns the other valleys' segments whose sides may be below a
/// height in a circle, given the circle, the slope of the sides and the height.
fn leave_to_captors<'a>(
    fields: &Fields,
    channel: &mut Channel,
    lower: impl FnOnce(&Circle, f64, f64) -> Vec<&'a Segment>,
    origin: Point,
) {
    let least_slope = channel.laws.hill_slope.min(fields.least_laws().hill_slope) * fields.metres_a_grain();
    let (circle, highest_m) = bed_in(&channel.knots, origin);
    let others = lower(&circle, least_slope, highest_m);
    if others.is_empty() {
        return;
    }
    let laws = fields.all_laws(&channel.places());
    let hangs = |(knot, laws): (&Knot, &Laws)| {
        let at = knot.at.from(origin);
        let hillside = laws.hill_slope.min(channel.laws.hill_slope) * fields.metres_a_grain();
        others.iter().any(|segment| segment.side_below_m(at, hillside, knot.level_m - HANGS_M).is_some())
    };
    let captured = channel.knots.iter().zip(&laws).rposition(hangs).map_or(0, |last| last + 1);
    // A channel keeps two knots at least, and the lower is where it meets another.
    channel.knots.drain(..captured.min(channel.knots.len() - 2));
}
