//! Tributaries: the lines that they follow around their straight courses, and the heights of their beds.

use std::cell::Cell;
use std::sync::Arc;

use super::above::{self, Above, AsksAbove, ChannelPart};
use super::channel::{Channel, Knot, Mouth};
use super::fields::{BESIDE, Fields, most_area};
use super::lake::{self, Hollow, NO_LAKE};
use super::point::{Point, chance, overlap};
use super::segment::{
    Circle, INCISION, Segment, SegmentBounds, bed_in, cut_into, measured, nearly_below, rise, segments_of,
};
use super::tributary_course::{Courses, TributaryCourse, TributaryEnd};
use super::trunk::{LEAST_SLOPE, NodeId};
use super::trunk_curve::DROWNED_SLOPE;
use super::wander;
use crate::geometry::{LineSegment, length, lerp, lines};
use crate::hash::{self, Draw};
use crate::lines::ChannelId;
use crate::memory::{Memory, Remembers};

/// Share of the area at its mouth by which a tributary's area is smaller at its head. The head has a quarter, as much
/// as the mouth of a tributary of the next level.
const AREA_FALL: f64 = 0.75;

/// Radius around the middle of a tributary's course within which larger valleys are looked up, as a multiple of the sum
/// of the course's length and the side of a cell.
const NEAR: f64 = 1.5;

/// Shares of a step up a tributary at which its bed is compared with the sides of larger valleys, besides the step's
/// upper end. They are closer together towards the lower end, where floors are flattest.
const PLACES: [f64; 5] = [0.0625, 0.125, 0.25, 0.5, 0.75];

/// Least depth in metres of a bed below the sides of larger valleys: as much as rasters of these sides may lose.
const CUT_M: f64 = 0.05;

/// Height in metres above the side of another valley from which on a bed counts as hanging in the air: more than
/// rasters lose.
const HANGS_M: f64 = 1.0;

/// Slopes of the parts of a glacier's valley, from its mouth up, as multiples of a river's slope. The valley hangs over
/// the larger one, which the larger glacier has cut deeper, and rises in steps to the floor of its cirque. The mean is
/// 1, so that both rise as much.
const STAIRS: [f64; 4] = [1.5, 0.7, 1.5, 0.3];

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
    middle: [f64; 2],
    reach: f64,
    courses: Vec<LineSegment>,
}

/// The larger valleys near a tributary.
#[derive(Clone, Copy)]
struct LargerValleys<'a> {
    above: &'a Above,
    /// Middle of the tributary's course, and the radius in grains around it within which the side of a brook matters.
    middle: [f64; 2],
    brook: f64,
}

impl<'a> LargerValleys<'a> {
    /// Returns the segments of the valleys, without the groups whose bounds show that they do not matter.
    fn which(self, may_matter: impl Fn(&SegmentBounds) -> bool + Copy) -> impl Iterator<Item = &'a Segment> {
        self.above.beneath(self.middle, self.brook, may_matter)
    }

    /// Returns the segments that may decide [how high a bed keeps](beside_m) somewhere in a circle.
    fn nearly_above(self, circle: &Circle, beside: GentlestSides) -> Vec<&'a Segment> {
        let highest_m = Cell::new(f64::NEG_INFINITY);
        let may_be_higher = |bounds: &SegmentBounds| {
            bounds.level_m[1] - beside.rise_m(bounds.least_square(circle.middle).sqrt()) > highest_m.get()
        };
        self.which(&may_be_higher).for_each(|segment| {
            let above_m = beside.above_m(segment, circle.middle);
            if above_m > highest_m.get() {
                highest_m.set(above_m);
            }
        });
        // Nowhere in the circle is the height less than this.
        let least_m = highest_m.get() - beside.slope * circle.radius;
        let may_decide = |highest_m: f64, grains: f64| highest_m - beside.rise_m(grains) >= least_m;
        let may_matter = |bounds: &SegmentBounds| may_decide(bounds.level_m[1], circle.least_of(bounds));
        self.which(&may_matter).filter(|segment| may_decide(segment.highest_m(), circle.least(segment))).collect()
    }

    /// Returns the segments whose sides may be below a height somewhere in a circle, if hillsides rise `slope` metres a
    /// grain.
    fn nearly_below(self, circle: &Circle, slope: f64, most_m: f64) -> Vec<&'a Segment> {
        let may_matter = |bounds: &SegmentBounds| bounds.may_be_below(circle.least_of(bounds).powi(2), slope, most_m);
        self.which(&may_matter)
            .filter(|segment| segment.may_be_below(circle.least(segment).powi(2), slope, most_m))
            .collect()
    }
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
        lines.filter(|line| line.touches(self.middle, self.reach)).collect()
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
        // Nobody sees whether a dry bed lies exactly on the ground, so it is not cut into the valleys of others of its
        // level.
        if !self.fields.is_wet(most_area(id.0)) {
            return self.make_free(id, above);
        }
        let mut channel = self.free(id, above)?.as_ref().clone();
        let cell = self.fields.side(id.0) as f64;
        let [low, high] = channel.bounds();
        let seen = [low.moved([-cell; 2]), high.moved([cell; 2])];
        let origin = above::origin(&self.fields, low);
        let others = self.touching(id.0, seen, above).into_iter().filter(|other| *other != id);
        let others = others.filter_map(|other| self.free(other, above)).filter(|other| overlap(other.bounds(), seen));
        let others: Vec<Arc<Channel>> = others.collect();
        // Most others have all of their water above this bed, so they cannot lower it.
        let (_, highest_m) = bed_in(&channel.knots, origin);
        let may_be_lower = |other: &&Arc<Channel>| other.knots.iter().any(|knot| knot.level_m < highest_m);
        let segments = segments_of_all(&self.fields, others.iter().filter(may_be_lower), origin);
        let segments: Vec<&Segment> = segments.iter().collect();
        cut_into(&self.fields, &mut channel.knots, channel.hill_slope, &segments, origin);
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
        Some(Arc::new(measured(&self.fields, self.tributary(id, &course, &surroundings))))
    }

    /// Returns the surroundings of a tributary with this shore and this head.
    fn surroundings(&self, id: ChannelId, [shore, head]: [Point; 2], above: &impl AsksAbove) -> Surroundings {
        let way = head.from(shore);
        let (middle, reach) = (shore.moved(way.map(|way| way / 2.0)), length(way));
        let around = |reach: f64| [-reach, reach].map(|by| middle.moved([by; 2]));
        let cell = self.fields.side(id.0) as f64;
        let above_here = above.above(id.0, around(NEAR * (reach + cell)), ChannelPart::Sides);
        let origin = above_here.origin;
        let others = self.courses.touching(id.0, around(reach), above, true).into_iter().filter(|other| *other != id);
        let courses = others.filter_map(|other| Some(self.courses.of(other, above)?.line(origin))).collect();
        // The exact middle, which need not be a whole number of grains.
        let from = shore.from(origin);
        let middle = [0, 1].map(|axis| from[axis] + way[axis] / 2.0);
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
        let places = self.wander(level, (id.1, id.2), [from, way], &surroundings.lines(near));
        let uplift = fields.uplift(head);
        let mut knots = self.bed(
            level,
            Knot { at: shore, level_m, area: most_area(level), pool_m },
            &places,
            origin,
            near,
            lake.map_or(f64::NEG_INFINITY, |(pool_m, id)| lake::filled_m(id, pool_m, level_m, level)),
        );
        knots.reverse();
        if foot != shore {
            let drowned_m = shore.distance(foot) * fields.metres_a_grain() * DROWNED_SLOPE;
            knots.push(Knot { at: foot, level_m: level_m - drowned_m, area: most_area(level), pool_m });
        }
        let mut channel = Channel::new(id, knots, mouth, fields.hill_slope(uplift));
        channel.lake = lake.map(|(_, id)| id);
        channel.joined_slope = joined_slope;
        if fields.is_wet(most_area(level)) {
            leave_to_captors(
                fields,
                &mut channel,
                |circle, slope, most_m| near.nearly_below(circle, slope, most_m),
                origin,
            );
        }
        channel
    }

    /// Tells whether the tributary of a cell has a lake, provided that the tributary and room for the lake exist. Dry
    /// beds have none.
    pub fn may_have_lake(&self, (level, x, y): ChannelId) -> bool {
        let seed = hash::network_level(self.seed, level);
        self.fields.is_wet(most_area(level)) && chance(seed, (x, y), Draw::Lake, 0) < self.fields.settings().lakes
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
        let beside = GentlestSides { slope: BESIDE * channel.hill_slope * fields.metres_a_grain(), trough: 0.0 };
        let least_m = |at: Point| beside_m(&near, at.from(origin), beside);
        let others = |at: Point| {
            let at = at.from(origin);
            let lines = around.iter().filter(|line| line.distance(mouth) > 1.0);
            lines.map(|line| line.distance(at)).fold(f64::INFINITY, f64::min)
        };
        hollow.dig(fields, channel, is_own, least_m, others);
    }

    /// Returns the places of a tributary's winding line, from its shore up. `from` is the shore relative to the origin,
    /// `way` leads from there to the head, and `around` has the lines that the tributary must not cross.
    fn wander(&self, level: u32, id: NodeId, [from, way]: [[f64; 2]; 2], around: &[LineSegment]) -> Vec<[f64; 2]> {
        let segments = self.fields.segments_a_channel(level);
        let straight: Vec<[f64; 2]> = (0..=segments)
            .map(|step| [0, 1].map(|axis| from[axis] + way[axis] * (step as f64 / segments as f64)))
            .collect();
        let shares = wander::offsets(hash::network_level(self.seed, level), id, segments);
        let offsets: Vec<f64> = shares.iter().map(|share| share * length(way)).collect();
        let most = offsets.iter().map(|offset| offset.abs()).fold(0.0, f64::max);
        let rooms = wander::rooms(&straight, around, most);
        let offsets: Vec<f64> = offsets.iter().zip(rooms).map(|(offset, room)| offset.clamp(-room, room)).collect();
        let wandered = wander::moved(&straight, &offsets);
        // Channels of the finest level, the most numerous by far, are not rounded: their segments are as short as cut
        // corners would be. Of the others, those with water are rounded twice, because corners of water show.
        let times = match level + 1 == self.fields.levels() {
            true => 0,
            false => 1 + usize::from(self.fields.is_wet(most_area(level))),
        };
        let wandered = (0..times).fold(wandered, |places, _| wander::rounded(&places));
        // If the room was misjudged between two knots, the straight course is used instead.
        let crosses = |line: &LineSegment| around.iter().any(|other| other.crosses(line));
        if lines(&wandered, 1).iter().any(crosses) { straight } else { wandered }
    }

    /// Returns the knots of a tributary from its shore up, through places that are relative to an origin, given the
    /// segments of larger valleys near it and the height to which a lake has filled its mouth.
    fn bed(
        &self,
        level: u32,
        shore: Knot,
        places: &[[f64; 2]],
        origin: Point,
        near: LargerValleys,
        filled_m: f64,
    ) -> Vec<Knot> {
        let fields = &self.fields;
        let uplift = fields.uplift(origin.moved(places[places.len() - 1]));
        // Distances in metres from the shore up to each place.
        let mut way_m = vec![0.0];
        for pair in places.windows(2) {
            let step = length([pair[1][0] - pair[0][0], pair[1][1] - pair[0][1]]);
            way_m.push(way_m[way_m.len() - 1] + step * fields.metres_a_grain());
        }
        let segments = places.len() - 1;
        // Near the larger valley hillsides may be gentler than at the head.
        let gentlest = fields.hill_slope(fields.uplift(shore.at)).min(fields.hill_slope(uplift));
        let hillside = gentlest * fields.metres_a_grain();
        let side_slope = INCISION * hillside;
        let beside = GentlestSides { slope: BESIDE * hillside, trough: fields.widest_trough(level) };
        let coast_filled_m = fields.filled_m(level);
        let filled_m = filled_m.max(coast_filled_m);
        let is_wet = fields.is_wet(most_area(level));
        let area = |share: f64| most_area(level) * (1.0 - AREA_FALL * share);
        // The finest valleys are younger than the ice, so glaciers have not shaped them.
        let iced = if level + 1 < fields.levels() { fields.iced(shore.level_m) } else { 0.0 };
        let steepest = fields.settings().channel_slope * fields.hill_slope(uplift);
        // The metres that a river with the area of each step's middle rises along the step.
        let rises_m: Vec<f64> = (1..=segments)
            .map(|step| {
                let middle = f64::midpoint(way_m[step - 1] / way_m[segments], way_m[step] / way_m[segments]);
                let stair = 1.0 + iced * (STAIRS[(middle * STAIRS.len() as f64) as usize] - 1.0);
                let slope = (fields.river_slope(uplift, area(middle)) * stair).min(steepest);
                (way_m[step] - way_m[step - 1]) * slope
            })
            .collect();
        // Of the segments nearby, only those are kept that may matter somewhere along the bed.
        let around = Circle::around(places);
        let above = near.nearly_above(&around, beside);
        let most_m = above.iter().map(|segment| segment.highest_m()).fold(filled_m.max(shore.level_m), f64::max);
        let most_m = most_m + rises_m.iter().sum::<f64>() + CUT_M;
        let near = near.nearly_below(&around, side_slope, most_m);
        // Listed from the head down, as the function expects.
        let coast_m = fields.below_coast_along_m(places.iter().rev().map(|place| origin.moved(*place)), coast_filled_m);
        let mut knots = vec![shore];
        for step in 1..=segments {
            let share = way_m[step] / way_m[segments];
            let [before, here] = [places[step - 1], places[step]];
            let step_m = way_m[step] - way_m[step - 1];
            let rise_m = rises_m[step - 1];
            let below_m = knots[knots.len() - 1].level_m;
            // The bed stays high enough that no larger channel beside it comes to lie on its side, and loses its water
            // to it.
            let beside_m = beside_m(&above, here, beside);
            let free_m = beside_m.max(below_m + rise_m).max(filled_m);
            // But the bed must not stand above the sides of larger valleys, and those of lower channels may be lower.
            // This also holds between two knots: the bed is straight there, but the floor of a valley that is wider
            // than the step is round.
            let mut ground_m = free_m;
            let step_grains = step_m / fields.metres_a_grain();
            let may_be_below = |segment: &&Segment| {
                free_m + CUT_M > segment.lowest_m() && {
                    let least = (segment.nearest(here).1.sqrt() - step_grains).max(0.0);
                    segment.may_be_below(least * least, side_slope, free_m + CUT_M)
                }
            };
            let lower: Vec<&Segment> = near.iter().copied().filter(may_be_below).collect();
            // A dry brook that reaches a larger valley's floor sinks in: it leaves no bed there, and cuts into no
            // valley's side.
            let has_run_out = !is_wet && lower.iter().any(|segment| segment.has_on_floor(here));
            // The bed cuts into the side of a larger valley, but not below the height to which its own valley is
            // filled.
            let side_below_m = |segment: &Segment, place: [f64; 2], most_m: f64| {
                let cut_m = segment.side_below_m(place, side_slope, most_m)?;
                let ground_m = match cut_m < filled_m {
                    true => segment.side_m(place, hillside).min(filled_m),
                    false if has_run_out => segment.side_m(place, hillside),
                    false => cut_m,
                };
                Some(ground_m).filter(|ground_m| *ground_m < most_m)
            };
            for segment in &lower {
                ground_m = side_below_m(segment, here, ground_m + CUT_M).map_or(ground_m, |side_m| side_m - CUT_M);
            }
            // Between a steep larger channel and its valley's side further down there may be no room for a bed. Then
            // the larger channel keeps its water, and a dry brook has no valley there.
            if !is_wet {
                ground_m = ground_m.max(beside_m);
            }
            // Where the coast is lower than that, a dry brook begins only further down.
            if !is_wet && step > 1 && coast_m[segments - step] < beside_m {
                break;
            }
            let level_m = ground_m.min(coast_m[segments - step]);
            // Across a lake or the floor of a larger valley the bed rises no more than these do, but always a little.
            let least_m = |share: f64| step_m * share * LEAST_SLOPE.min(rise_m / step_m);
            let area_at = |t: f64| area(lerp([way_m[step - 1], step_m], t) / way_m[segments]);
            // The share of the step and the height of the last knot, at first that of the knot below.
            let mut from = (0.0, below_m);
            for t in PLACES.into_iter().filter(|_| is_wet) {
                let place = [0, 1].map(|axis| before[axis] + (here[axis] - before[axis]) * t);
                let straight_m = from.1 + (level_m - from.1) * (t - from.0) / (1.0 - from.0);
                let side_m =
                    lower.iter().fold(straight_m + CUT_M, |m, segment| side_below_m(segment, place, m).unwrap_or(m));
                if side_m < straight_m + CUT_M {
                    from = (t, (side_m - CUT_M).max(from.1 + least_m(t - from.0)));
                    knots.push(Knot {
                        at: origin.moved(place),
                        level_m: from.1,
                        area: area_at(t),
                        pool_m: shore.pool_m,
                    });
                }
            }
            let level_m = level_m.max(from.1 + least_m(1.0 - from.0));
            knots.push(Knot { at: origin.moved(here), level_m, area: area(share), pool_m: shore.pool_m });
        }
        knots
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
    let least_slope = channel.hill_slope.min(fields.least_hill_slope()) * fields.metres_a_grain();
    let (circle, highest_m) = bed_in(&channel.knots, origin);
    let others = lower(&circle, least_slope, highest_m);
    let hangs = |knot: &Knot| {
        let at = knot.at.from(origin);
        let gentlest = fields.hill_slope(fields.uplift(knot.at)).min(channel.hill_slope);
        let hillside = gentlest * fields.metres_a_grain();
        others.iter().any(|segment| segment.side_below_m(at, hillside, knot.level_m - HANGS_M).is_some())
    };
    let captured = channel.knots.iter().rposition(hangs).map_or(0, |last| last + 1);
    // A channel keeps two knots at least, and the lower is where it meets another.
    channel.knots.drain(..captured.min(channel.knots.len() - 2));
}

/// The gentlest sides that a bed may have: they rise `slope` metres a grain, beside a rounded floor of the half width
/// `trough` in grains.
#[derive(Clone, Copy)]
struct GentlestSides {
    slope: f64,
    trough: f64,
}

impl GentlestSides {
    /// Returns the metres that a side rises within some grains.
    fn rise_m(self, grains: f64) -> f64 {
        self.slope * rise(grains, 0.0, self.trough, 0.0)
    }

    /// Returns the height in metres above which the bed keeps at a place because of one segment.
    fn above_m(self, segment: &Segment, at: [f64; 2]) -> f64 {
        let (t, square) = segment.nearest(at);
        lerp(segment.level_m, t) - self.rise_m(square.sqrt())
    }
}

/// Returns the height in metres above which a bed with such sides keeps at a place, so that it does not take the water
/// of larger channels beside it.
fn beside_m(near: &[&Segment], at: [f64; 2], beside: GentlestSides) -> f64 {
    near.iter().fold(f64::NEG_INFINITY, |most_m, segment| {
        let above_m = beside.above_m(segment, at);
        // Not `max`, which also checks for NaN.
        if above_m > most_m { above_m } else { most_m }
    })
}
