//! Rivers as lines: each whole, from its source to its end, and the same in every query.
//!
//! The channels of a river's course are followed from node to node, and cut where no river is drawn: above the springs,
//! in lakes and in the sea. Each remaining part is a river of its own, so that its water falls from point to point. All
//! parts of a course share one name.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::Fluvial;
use super::channel::{Channel, ChannelPlace, Knot, Mouth};
use super::fields::{COAST_STEP, most_area, river_depth_m};
use super::lake::{Hollow, NO_LAKE};
use super::segments_above::AsksAbove;
use super::strahler::{Strahler, locate};
use super::trunk_lattice::neighbours;
use super::valley;
use crate::area::Area;
use crate::clock::Clock;
use crate::grain_point::{GRAINS, Point, padded};
use crate::lines::{self, Bed, ChannelId, LakeId, Line, LineEnd, LineId, LineKind, LinePoint};
use crate::memory::{Memory, Remembers, heap_bytes};
use crate::stop::Stopped;

/// Greatest distance in grains from the place where a channel begins to hold water to the first point of its river,
/// further down: so the nearest vertex of the rasters is wet.
const PAST_SPRING: f64 = GRAINS as f64;

/// Grains that a river's line runs on into the sea. Otherwise the nearest sea vertex of the rasters could be more than
/// one vertex away.
const PAST_COAST: f64 = 0.5 * GRAINS as f64;

/// The caches of rivers.
#[derive(Debug)]
pub(super) struct RiverMemories {
    strahler: Strahler,
    courses: Memory<ChannelId, Course>,
    of_courses: Memory<ChannelId, Vec<Arc<Line>>>,
}

impl Default for RiverMemories {
    fn default() -> RiverMemories {
        RiverMemories { strahler: Strahler::default(), courses: Memory::new(8 << 20), of_courses: Memory::new(8 << 20) }
    }
}

impl RiverMemories {
    /// Returns these caches.
    pub fn memories(&self) -> Vec<&dyn Remembers> {
        let own: Vec<&dyn Remembers> = vec![&self.courses, &self.of_courses];
        [self.strahler.memories(), own].concat()
    }
}

/// The channels from a spring down to a confluence or the sea, and the parts of them that are drawn.
#[derive(Debug)]
struct Course {
    channels: Vec<Arc<Channel>>,
    parts: Vec<RiverPart>,
}

/// A part of a course that is a river.
#[derive(Debug)]
struct RiverPart {
    id: LineId,
    samples: Vec<CoursePoint>,
    /// The ground that cuts the part off; `None` where the course itself ends.
    end: Option<LiesIn>,
}

/// A place of a course, in the plane of the network and not in the world.
#[derive(Clone, Copy, Debug)]
struct CoursePoint {
    /// The number of the channel, and the place in the channel as [`locate`] returns it.
    place: (usize, f64),
    at: Point,
    level_m: f64,
    area: f64,
    discharge_m3s: f64,
    /// Half width of the river in grains.
    river: f64,
}

heap_bytes!(Course: channels, parts);
heap_bytes!(RiverPart: samples);
heap_bytes!(CoursePoint);

impl CoursePoint {
    /// Returns the place at a share of the way to another one.
    fn towards(&self, other: &CoursePoint, share: f64) -> CoursePoint {
        let mix = |from: f64, to: f64| from + (to - from) * share;
        CoursePoint {
            // Both places lie in one channel: places of two channels cannot be interpolated.
            place: (self.place.0, mix(self.place.1, other.place.1)),
            at: self.at.towards(other.at, share),
            level_m: mix(self.level_m, other.level_m),
            area: mix(self.area, other.area),
            discharge_m3s: mix(self.discharge_m3s, other.discharge_m3s),
            river: mix(self.river, other.river),
        }
    }
}

/// The ground in which a place of a course lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum LiesIn {
    Dry,
    Channel,
    Lake(LakeId),
    Sea,
}

impl Fluvial {
    /// Returns all rivers of which a part lies in the rectangle that the outer vertices of an area span, whole, sorted
    /// by id.
    ///
    /// # Errors
    /// When `clock` stops the work.
    pub fn rivers(&self, area: &Area, clock: &Clock) -> Result<Vec<Arc<Line>>, Stopped> {
        let rectangle = self.network_around(area, 0);
        // Many channels of an area belong to the same river, so collect each river once.
        let mut found = BTreeMap::new();
        // Catchments shrink from level to level: below the first level without rivers there are none.
        for level in (0..self.fields.levels()).take_while(|level| self.may_have_rivers(*level)) {
            self.network.try_channels(level, self.detail.least_area, rectangle, |channel| {
                clock.check()?;
                // A channel drains most at its mouth: if the mouth is dry, the channel has no river.
                if self.is_wet(channel.mouth_knot()) {
                    let rivers = self.rivers_of(self.top(channel.id), clock)?;
                    found.extend(
                        rivers.iter().filter(|river| river.touches(area)).map(|river| (river.id, Arc::clone(river))),
                    );
                }
                Ok(())
            })?;
        }
        Ok(found.into_values().collect())
    }

    /// Returns all rivers of the course that begins in a channel, sorted by id; none if no course begins there.
    ///
    /// # Errors
    /// When `clock` stops the work.
    pub fn rivers_from(&self, top: ChannelId, clock: &Clock) -> Result<Vec<Arc<Line>>, Stopped> {
        if self.top(top) == top { Ok(self.rivers_of(top, clock)?.to_vec()) } else { Ok(Vec::new()) }
    }

    /// Returns the name of the rivers of the course that begins in a channel, even if it has no rivers; `None` in a
    /// world without names.
    pub fn river_name(&self, (level, x, y): ChannelId) -> Option<String> {
        // The name comes from the cell of the head: the first point of the line depends on where it is cut off.
        let source = [x, y].map(|at| (at * self.fields.side(level)).div_euclid(GRAINS));
        self.names.as_ref().map(|names| names.river(source, &[i64::from(level), x, y]))
    }

    /// Returns the lakes that may touch an area, sorted, of all levels whose widest lakes have at least this half width
    /// in metres.
    ///
    /// # Errors
    /// When `clock` stops the work.
    pub fn lake_ids(&self, area: &Area, least_half_width_m: f64, clock: &Clock) -> Result<Vec<LakeId>, Stopped> {
        let rectangle = self.network_around(area, Hollow::widest(&self.fields, 0) as i64);
        let mut lakes = Vec::new();
        let widest_m = |level| Hollow::widest(&self.fields, level) * self.fields.metres_a_grain();
        for level in (0..self.detail.channels.levels).take_while(|level| widest_m(*level) >= least_half_width_m) {
            // Every channel that runs into a lake names the lake, so the channels in its bays find it too.
            self.network.try_channels(level, 0.0, rectangle, |channel| {
                lakes.extend(channel.lake);
                clock.check()
            })?;
        }
        lakes.sort_unstable();
        lakes.dedup();
        Ok(lakes)
    }

    /// Tells whether a lake with this id may exist, without making any land.
    pub fn may_be_lake(&self, lake: LakeId) -> bool {
        self.network.may_have_lake(lake.0)
    }

    /// Tells whether the lake with this id, if it exists, is a salt pan: the sink of a closed basin in a dry land, with
    /// some decimetres of brine on a level floor of salt.
    pub fn is_pan(&self, LakeId((level, x, y)): LakeId) -> bool {
        level == 0 && self.fields.has_continents() && self.network.trunks().is_pan((x, y))
    }

    /// Returns the channels whose valley floors lie in a lake: the channel of the lake's id, or all that end at its
    /// sink.
    pub(super) fn lake_channels(&self, lake: LakeId) -> Vec<Arc<Channel>> {
        let LakeId(id @ (level, x, y)) = lake;
        let ends =
            neighbours((x, y)).filter(|node| level == 0 && self.network.trunks().drained(*node).to == Some((x, y)));
        let ids = std::iter::once(id).chain(ends.map(|node| (0, node.0, node.1)));
        ids.filter_map(|id| self.network.channel(id)).filter(|channel| channel.lake == Some(lake)).collect()
    }

    /// Returns the river that leaves a lake, if there is one.
    ///
    /// # Errors
    /// When `clock` stops the work.
    pub fn outlet(&self, lake: LakeId, clock: &Clock) -> Result<Option<LineId>, Stopped> {
        let course = self.course(self.top(lake.0), clock)?;
        let number = course.channels.iter().position(|channel| channel.id == lake.0);
        let sill_of = |number: &usize| course.channels[*number].knots.iter().rposition(|knot| knot.pool_m > NO_LAKE);
        let Some((number, sill)) = number.and_then(|number| Some((number, sill_of(&number)?))) else { return Ok(None) };
        // The river begins between the last knot of the lake and the next knot, where the lake ends.
        let begins = |part: &&RiverPart| {
            let first = part.samples[0].place;
            first.0 == number && (sill as f64..=(sill + 1) as f64).contains(&first.1)
        };
        Ok(course.parts.iter().find(begins).map(|part| part.id))
    }

    /// Returns Strahler's order of a river at its end, counting only channels that hold water.
    ///
    /// The order needs all tributaries of the river, so it is not stored in the river's line.
    ///
    /// # Errors
    /// When `clock` stops the work.
    pub fn order(&self, river: &Line, clock: &Clock) -> Result<u32, Stopped> {
        let LineId::River { channel: top, .. } = river.course else {
            unreachable!("rivers of the land run in channels")
        };
        let course = self.course(top, clock)?;
        let part = course.parts.iter().find(|part| part.id == river.id).expect("a course has all of its rivers");
        let (number, place) = part.samples[part.samples.len() - 1].place;
        Ok(self.rivers.strahler.orders(self, &course.channels[number], clock)?.at(place))
    }

    /// Returns the rectangle of the network that a channel must touch to touch an area of the world, with `spare`
    /// grains more on each side.
    fn network_around(&self, area: &Area, spare: i64) -> [Point; 2] {
        padded(self.warp.input(*area, self.stride), spare as f64)
    }

    /// Returns an area that holds all of the world whose points lie in a rectangle of the network.
    pub(crate) fn area_in_world(&self, [low, high]: [Point; 2]) -> Area {
        // Add the greatest displacement of the warp, and some more for rounding to vertices.
        let node_m = self.node_m();
        let [east, south] = self.warp.most_m().map(|metres| (metres / node_m).ceil() as i64 + 2);
        let node = |grains: i64| grains.div_euclid(GRAINS * self.stride);
        Area {
            x0: node(low.x) - east,
            y0: node(low.y) - south,
            x1: node(high.x) + east + 1,
            y1: node(high.y) + south + 1,
        }
    }

    /// Tells whether an area may have both land and sea.
    pub(crate) fn may_have_coast(&self, area: Area, clock: &Clock) -> Result<bool, Stopped> {
        if !self.fields.sea_level_m().is_finite() {
            return Ok(false);
        }
        let [low, high] = self.network_around(&area, 0);
        if self.skerries(area, self.stride).is_some_and(|skerries| !skerries.is_empty()) {
            return Ok(true);
        }
        let sea_m = self.fields.sea_level_m();
        // The coast is interpolated between these places: if all of them are under the sea, so is the whole area.
        let places = COAST_STEP.max(self.stride);
        let step = places * GRAINS;
        let rows = low.y.div_euclid(step)..=high.y.div_euclid(step) + 1;
        let mut wet = rows.flat_map(|j| {
            let columns = low.x.div_euclid(step)..=high.x.div_euclid(step) + 1;
            columns.map(move |i| {
                let inland_m = self.fields.inland_m(Point::at_vertex(i * places, j * places));
                (self.fields.coast_m(inland_m as f32) as f64) < sea_m
            })
        });
        if wet.next() == Some(true) {
            return Ok(wet.any(|wet| !wet));
        }
        // Where the coast is above the sea everywhere, a drowned valley may still come in.
        let segments = || self.segments(valley::input(area), self.detail, clock);
        Ok(wet.any(|wet| wet) || segments()?.all.iter().any(|segment| segment.lowest_m() < sea_m))
    }

    /// Tells whether channels of a level may have rivers.
    pub fn may_have_rivers(&self, level: u32) -> bool {
        level == 0 || self.fields.may_be_wet(level) && most_area(level) >= self.detail.least_area
    }

    /// Tells whether a channel has a river at a knot.
    pub(super) fn is_wet(&self, knot: &Knot) -> bool {
        self.has_river(knot.area, knot.discharge_m3s)
    }

    /// Tells whether a channel has a river where it drains this area, in cells of the trunk lattice, and has this
    /// discharge in cubic metres a second.
    pub(super) fn has_river(&self, area: f64, discharge_m3s: f64) -> bool {
        self.fields.holds_water(discharge_m3s) && area >= self.detail.least_area
    }

    /// Returns the channel in which the course of a channel begins, at a spring.
    fn top(&self, (level, x, y): ChannelId) -> ChannelId {
        let mut node = (x, y);
        // Only trunks have an upper course in other channels: a tributary begins at its own spring.
        if level == 0 {
            let nodes = self.network.trunks().look();
            while let Some(main) = nodes.drained(node).main {
                node = main;
            }
        }
        (level, node.0, node.1)
    }

    /// Returns the course that begins in a channel.
    fn course(&self, top: ChannelId, clock: &Clock) -> Result<Arc<Course>, Stopped> {
        self.rivers.courses.try_get(top, || {
            let mut channels: Vec<Arc<Channel>> = Vec::new();
            let mut next = Some(top);
            while let Some(channel) = next.and_then(|id| self.network.channel(id)) {
                clock.check()?;
                // Only a main upper course goes on, so each channel belongs to one course.
                let goes_on = channel.next.filter(|(_, is_main)| *is_main);
                next = goes_on.map(|(node, _)| (0, node.0, node.1));
                channels.push(channel);
            }
            let parts = self.parts(&channels, clock)?;
            Ok(Course { channels, parts })
        })
    }

    /// Returns the parts of a course's channels that are drawn.
    fn parts(&self, channels: &[Arc<Channel>], clock: &Clock) -> Result<Vec<RiverPart>, Stopped> {
        let mut parts: Vec<RiverPart> = Vec::new();
        let mut open: Vec<CoursePoint> = Vec::new();
        let mut last: Option<(CoursePoint, LiesIn)> = None;
        for (number, channel) in channels.iter().enumerate() {
            clock.check()?;
            let ground = |sample: &CoursePoint| self.ground(sample, channel);
            for sample in self.samples(number, channel) {
                let here = ground(&sample);
                if let Some((before, was)) = last
                    && (was == LiesIn::Channel) != (here == LiesIn::Channel)
                {
                    // Between two channels there is nothing to bisect: the next one begins where the first ends.
                    let edge = if before.place.0 == number { between(before, sample, ground) } else { sample };
                    // At least one grain: the sample may lie on the edge itself.
                    let left = edge.at.distance(sample.at).max(1.0);
                    let past_edge = |grains: f64| edge.towards(&sample, (grains / left).min(1.0));
                    open.push(if was == LiesIn::Dry { past_edge(PAST_SPRING) } else { edge });
                    if here == LiesIn::Sea {
                        open.push(past_edge(PAST_COAST));
                    }
                    if here != LiesIn::Channel {
                        // The ground just behind the edge is what cuts the part off.
                        close(&mut parts, channels, std::mem::take(&mut open), Some(here));
                    }
                }
                if here == LiesIn::Channel {
                    open.push(sample);
                }
                last = Some((sample, here));
            }
        }
        close(&mut parts, channels, open, None);
        Ok(parts)
    }

    /// Returns the places by which a channel of a course is drawn, both ends included, and no denser than nodes can
    /// show.
    fn samples(&self, number: usize, channel: &Channel) -> Vec<CoursePoint> {
        let sample = |place: ChannelPlace| {
            let Knot { at, level_m, area, discharge_m3s, .. } = channel.at(place);
            let river = channel.half_width(place);
            CoursePoint { place: (number, place.0 as f64 + place.1), at, level_m, area, discharge_m3s, river }
        };
        let mut samples: Vec<CoursePoint> = channel.line_places(0).map(sample).collect();
        if self.stride > 1 {
            let (first, last) = (samples[0], samples[samples.len() - 1]);
            let mut before = first;
            samples.retain(|sample| {
                let is_far = sample.at.distance(before.at) >= (GRAINS * self.stride) as f64;
                if is_far {
                    before = *sample;
                }
                is_far
            });
            samples.insert(0, first);
            if samples[samples.len() - 1].at != last.at {
                samples.push(last);
            }
        }
        samples
    }

    /// Returns the ground in which a sample of a channel lies.
    fn ground(&self, sample: &CoursePoint, channel: &Channel) -> LiesIn {
        if !self.has_river(sample.area, sample.discharge_m3s) {
            return LiesIn::Dry;
        }
        // The lake of a knot counts up to the next knot. Lakes are checked before the sea, as their floors may lie
        // under its level.
        let knot = channel.knots[sample.place.1 as usize];
        if let Some(lake) = channel.lake.filter(|_| sample.level_m < knot.pool_m) {
            return LiesIn::Lake(lake);
        }
        if self.fields.is_drowned(sample.at, sample.level_m) { LiesIn::Sea } else { LiesIn::Channel }
    }

    /// Returns all rivers of the course that begins in a channel.
    fn rivers_of(&self, top: ChannelId, clock: &Clock) -> Result<Arc<Vec<Arc<Line>>>, Stopped> {
        self.rivers.of_courses.try_get(top, || {
            let course = self.course(top, clock)?;
            let rivers = course.parts.iter().filter_map(|part| self.river(&course, part, top, clock).transpose());
            rivers.map(|river| river.map(Arc::new)).collect()
        })
    }

    fn river(
        &self,
        course: &Course,
        part: &RiverPart,
        whole: ChannelId,
        clock: &Clock,
    ) -> Result<Option<Line>, Stopped> {
        let samples = self.falling(&part.samples);
        if samples.len() < 2 {
            return Ok(None);
        }
        let first = samples[0].at;
        // Relative to a vertex near by, places are small numbers with room for fractions anywhere in the world.
        let node = GRAINS * self.stride;
        let origin = [first.x, first.y].map(|grains| grains.div_euclid(node));
        let corner = Point { x: origin[0] * node, y: origin[1] * node };
        let node_m = self.node_m();
        let cell_m = self.fields.side(0) as f64 * self.fields.metres_a_grain();
        let point = |&CoursePoint { at, level_m, area, discharge_m3s, river, .. }: &CoursePoint| LinePoint {
            place: (at.from(corner) / node as f64).into(),
            level_m,
            floor_m: level_m - river_depth_m(discharge_m3s) as f64,
            half_width_m: river * self.fields.metres_a_grain(),
            discharge_m3s,
            basin_m2: area * cell_m * cell_m,
        };
        let points: Vec<LinePoint> = samples.iter().map(point).collect();
        let end = part.samples[part.samples.len() - 1];
        let channel = &course.channels[end.place.0];
        let widest_m = points.iter().map(|point| point.half_width_m).fold(0.0, f64::max);
        Ok(Some(Line {
            id: part.id,
            kind: LineKind::River,
            class: None,
            // All parts of a course have one name.
            name: self.river_name(whole),
            course: LineId::River { channel: whole, part: 0 },
            origin,
            bounds: lines::bounds(origin, &points, widest_m / node_m),
            points,
            structures: Vec::new(),
            end: self.end(part, channel, end.at, clock)?,
            bed: Bed::Natural,
            spacing_m: node_m,
        }))
    }

    /// Returns what a part of a course ends in, in a channel at a point.
    fn end(&self, part: &RiverPart, channel: &Channel, at: Point, clock: &Clock) -> Result<LineEnd, Stopped> {
        Ok(match part.end {
            Some(LiesIn::Lake(lake)) => LineEnd::Lake(lake),
            Some(LiesIn::Sea) => LineEnd::Sea,
            Some(LiesIn::Dry | LiesIn::Channel) => LineEnd::Sink,
            None => match channel.mouth {
                Mouth::Sea => LineEnd::Sea,
                Mouth::Sink(_) => LineEnd::Sink,
                Mouth::Channel(other) => self.joined(other, at, clock)?.map_or(LineEnd::Sink, LineEnd::Line),
            },
        })
    }

    /// Moves samples to their places in the world, with the level of their water there, and keeps those that fall.
    fn falling(&self, samples: &[CoursePoint]) -> Vec<CoursePoint> {
        let mut line: Vec<CoursePoint> = Vec::with_capacity(samples.len());
        // A line that falls in the network may not fall in the world: levels are lifted, and places are rounded to
        // grains.
        let falls = |from: &CoursePoint, to: &CoursePoint| from.level_m > to.level_m && from.at != to.at;
        for (index, sample) in samples.iter().enumerate() {
            let point = CoursePoint { at: self.in_world(sample.at), level_m: self.lifted_m(sample.level_m), ..*sample };
            // The end stays in place; points before it go if they do not lie above it.
            while index + 1 == samples.len() && line.len() > 1 && !falls(&line[line.len() - 1], &point) {
                line.pop();
            }
            if line.last().is_none_or(|last| falls(last, &point)) {
                line.push(point);
            }
        }
        line
    }

    /// Returns the river to which a channel belongs at a point, or else the next river further down.
    fn joined(&self, id: ChannelId, at: Point, clock: &Clock) -> Result<Option<LineId>, Stopped> {
        let course = self.course(self.top(id), clock)?;
        let Some(number) = course.channels.iter().position(|channel| channel.id == id) else { return Ok(None) };
        // The point is rounded to a grain, so allow a little less.
        let place = (number, locate(&course.channels[number], at) - 1e-3);
        let reaches = |part: &&RiverPart| part.samples[part.samples.len() - 1].place >= place;
        Ok(course.parts.iter().find(reaches).or(course.parts.last()).map(|part| part.id))
    }
}

/// Finds by bisection the last place in the bed between two places, one of which is in the bed.
fn between(from: CoursePoint, to: CoursePoint, ground: impl Fn(&CoursePoint) -> LiesIn) -> CoursePoint {
    let (mut bed, mut other) = if ground(&from) == LiesIn::Channel { (0.0, 1.0) } else { (1.0, 0.0) };
    // The two are at most three vertices apart: halved this often, that is less than a grain, to which points are
    // rounded anyway.
    for _ in 0..16 {
        let middle = f64::midpoint(bed, other);
        if ground(&from.towards(&to, middle)) == LiesIn::Channel { bed = middle } else { other = middle }
    }
    // Return the end that was found to be in the bed: the other would lie on the far side.
    from.towards(&to, bed)
}

/// Ends the part that is open, if it has two points or more.
fn close(parts: &mut Vec<RiverPart>, channels: &[Arc<Channel>], samples: Vec<CoursePoint>, end: Option<LiesIn>) {
    if samples.len() < 2 {
        return;
    }
    let channel = channels[samples[0].place.0].id;
    // Parts are numbered within the channel in which they begin.
    let begun = |part: &&RiverPart| matches!(part.id, LineId::River { channel: other, .. } if other == channel);
    let part = parts.iter().filter(begun).count() as u32;
    parts.push(RiverPart { id: LineId::River { channel, part }, samples, end });
}
