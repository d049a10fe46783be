//! Segments: the straight parts of channels, and the valley sides that rise from them.

use std::sync::Arc;

use super::channel::{Channel, ChannelPlace, CrossSection, Knot};
use super::fields::{Fields, across};
use super::lake;
use super::meander::meander_width;
use super::point::{GRAINS, Point};
use crate::geometry::{LineSegment, cross, length, lerp, smooth};
use crate::memory::heap_bytes;

/// The straight segments of the channels around a place, in a fixed order.
#[derive(Debug)]
pub struct Segments {
    /// The point that the lines are relative to.
    pub origin: Point,
    /// The channels, ordered by level and cell.
    pub channels: Vec<Arc<Channel>>,
    /// Their segments, channel by channel, each from its head down.
    pub all: Vec<Segment>,
}

impl Segments {
    /// Returns the segments whose [reach](Segment::reach) touches a rectangle.
    #[must_use]
    pub fn near(&self, rectangle: [Point; 2], reach: Reach) -> Segments {
        let rectangle = rectangle.map(|corner| corner.from(self.origin));
        let near = self.all.iter().filter(|segment| segment.reaches(rectangle, reach));
        Segments { origin: self.origin, channels: self.channels.clone(), all: near.cloned().collect() }
    }
}

/// A straight segment of a channel, from one knot to the next. Each pair of numbers is a value at the upper end, and
/// its change from there to the lower end.
#[derive(Clone, Debug)]
pub struct Segment {
    /// The number of its channel.
    pub channel: u32,
    /// The number of the knot at which it begins.
    pub knot: u32,
    /// The upper end, in grains east and south of the origin.
    pub from: [f64; 2],
    /// The way from the upper end to the lower end, in grains.
    pub along: [f64; 2],
    per_square: f64,
    /// Distance in grains between channels of its level, about.
    side: f64,
    /// Distance in grains beyond which the segment does not matter, whatever its side is like.
    near: f64,
    /// True if its channel is a trunk. Trunks are never so steep that their sides are gentler across by more than
    /// shows.
    is_trunk: bool,
    /// Heights of the water in metres.
    pub level_m: [f64; 2],
    /// Areas that drain through it, in cells of the trunk lattice.
    pub area: [f64; 2],
    /// Slopes of the sides across the channel, as shares of the hillside's: together with the slope of the bed along
    /// the channel, they make the hillside's slope.
    pub cross: [f64; 2],
    /// Half widths of the valley's floor, with the rounded foot of its side, in grains.
    pub trough: [f64; 2],
    /// Slopes of the floor where it rises from the river, as shares of the side's slope.
    pub lean: [f64; 2],
    /// Half widths of the river, in grains.
    pub river: [f64; 2],
    /// Height of its levees, as a share of the greatest height.
    pub levees: f64,
    /// Number of terraces of its floor.
    pub terraces: u32,
    /// Half widths of the flood plain below the terraces, in grains.
    pub flood_plain: [f64; 2],
    /// Largest rise in grains from one terrace to the next, on a side of slope 1.
    pub riser: [f64; 2],
    /// Sharpness of its river's bend: 1 for the sharpest to the right, -1 for the sharpest to the left.
    pub bend: [f64; 2],
    /// Height in metres of the lake that covers lower ground in its valley.
    pub pool_m: f64,
    /// Grains by which its side matters further because it is the floor of a lake.
    pub sunk: f64,
}

heap_bytes!(Segment);
heap_bytes!(Segments: channels, all);

/// Least slope of a valley's floor across the channel, as a multiple of the river's slope along it.
///
/// On a flatter floor, a vertex of the bed would belong to a place further downstream, whose floor is hardly higher
/// there: the vertex would count as land, and interrupt the brook.
const LEAN: f64 = 3.0;

/// Least ratio of a floor's cross slope to its bed's slope upstream. With a smaller one, a bed that rises in a step
/// would come to lie on the floor below the step. It is larger than the factor by which the sides of steep beds are
/// gentler across.
const ABOVE_OWN: f64 = 1.5;

/// Largest slope of a floor, as a share of its side's slope: beside steep brooks the floor is almost as steep as the
/// side.
pub const MOST_LEAN: f64 = 0.95;

/// Share of the half width of a valley's floor that is level across, apart from its lean. The rest is the rounded foot
/// of the side. Chosen by eye.
pub(super) const LEVEL: f64 = 0.7;

/// Height of the highest levees, as a share of their river's half width; their slope towards the river and behind, as
/// shares of the side's slope. The slope behind is less than most floors lean, so that water stands behind few levees.
/// Chosen by eye.
pub(super) const LEVEE: f64 = 0.25;
pub(super) const LEVEE_RISES: f64 = 0.3;
pub(super) const LEVEE_FALLS: f64 = 0.05;

/// Largest slope of a river that runs down the side of another valley, as a share of that side's slope: the river cuts
/// into the side, and is not lost on it. Chosen by eye.
pub const INCISION: f64 = 0.65;

/// Least fall from knot to knot of a bed that is cut into the side of another valley, in metres, and in metres a metre.
/// From one vertex to the next it is large enough for heights in `f32` to show it.
const LEAST_FALL_M: f64 = 0.01;
const LEAST_FALL: f64 = 1e-4;

/// Distance in grains between the places at which a bed is compared with the sides of other valleys, about: eight
/// vertices.
const LONGEST_CUT: f64 = (8 * GRAINS) as f64;

/// Number of knots of a bed that are compared with the sides of other valleys together.
const CUT_RUN: usize = 8;

/// Width of a river where it is straight, and in a sharp bend, as shares of the usual width for its discharge. Chosen
/// by eye.
const STRAIGHT: f64 = 0.9;
const BENT: f64 = 1.2;

/// Distance upstream and downstream of a place, in widths of the river, whose directions are compared to measure a
/// bend; and the sine of the angle between them in a sharp bend, one with a radius of three widths.
const BEND_WIDTHS: f64 = 1.25;
const SINE: f64 = 0.4;

/// Distance in widths of the river from each end of a trunk, from its lakes and from the sea within which it takes on
/// its usual width.
const END_WIDTHS: f64 = 4.0;

/// Distance to which the side of a channel without brooks goes on, as a multiple of the distance to the next channel of
/// its level.
const OWN_SIDES: f64 = 1.0;

/// Returns the grains that a valley side of slope 1 rises within `grains` of its river's middle, given the half width
/// of the river (`shore`), that of the floor (`trough`), and the slope of the floor (`lean`).
pub fn rise(grains: f64, shore: f64, trough: f64, lean: f64) -> f64 {
    rise_over(grains, shore, trough, lean, 0.0)
}

/// Returns [`rise`] where levees and terraces have risen by `raised` grains.
fn rise_over(grains: f64, shore: f64, trough: f64, lean: f64, raised: f64) -> f64 {
    let round = (1.0 - LEVEL) * trough;
    let beyond = (grains - shore.max(LEVEL * trough)).max(0.0);
    let risen = (beyond * beyond + round * round).sqrt() - round + raised;
    risen + lean * ((grains - shore).max(0.0) - risen)
}

/// Returns the distance in grains from a channel beyond which its side has risen more than that of a brook without a
/// floor does within `brook` grains, given the half width of the channel's floor.
pub fn widened(brook: f64, trough: f64) -> f64 {
    brook + trough
}

/// Distances in grains within which channels matter, where no other channels lie in between.
#[derive(Clone, Copy, Debug)]
pub struct Reach {
    /// For brooks whose sides are as steep as the hill. Other channels matter as far as their sides rise no more than
    /// the side of a brook does within this distance.
    pub brook: f64,
    /// Upper limit for the larger channels, whose sides go on where there are no brooks.
    pub most: f64,
    /// Least slope of sides, as a share of the hillside's: gentler sides count as this steep.
    pub least_cross: f64,
}

impl Reach {
    /// Creates a reach that is the same for all channels, as if the sides of all were as steep as the hill.
    pub fn even(brook: f64) -> Reach {
        Reach { brook, most: brook, least_cross: 1.0 }
    }

    /// Returns the distance within which channels matter that are `side` grains apart.
    pub fn of(self, side: f64) -> f64 {
        self.brook.max((OWN_SIDES * side).min(self.most))
    }
}

impl Segment {
    /// Returns the segment's line, relative to the segments' origin.
    pub fn line(&self) -> LineSegment {
        LineSegment { from: self.from, along: self.along }
    }

    /// Returns the corners of the segment's bounding box.
    pub fn bounds(&self) -> [[f64; 2]; 2] {
        let to = [0, 1].map(|axis| self.from[axis] + self.along[axis]);
        [[0, 1].map(|axis| least(self.from[axis], to[axis])), [0, 1].map(|axis| most(self.from[axis], to[axis]))]
    }

    /// Returns the share of the segment at which it is nearest to a point, and the square of the distance in grains.
    pub fn nearest(&self, to: [f64; 2]) -> (f64, f64) {
        self.nearest_off([to[0] - self.from[0], to[1] - self.from[1]])
    }

    /// Returns the same as [`Segment::nearest`] for a point given by its offset from the segment's upper end.
    ///
    /// It does what [`LineSegment::nearest`] does, but for a division, which is done once for all points.
    pub fn nearest_off(&self, off: [f64; 2]) -> (f64, f64) {
        let t = ((off[0] * self.along[0] + off[1] * self.along[1]) * self.per_square).clamp(0.0, 1.0);
        let off = [off[0] - self.along[0] * t, off[1] - self.along[1] * t];
        (t, off[0] * off[0] + off[1] * off[1])
    }

    /// Returns the metres that the bed falls a grain; less than 0 where the bed rises to the sill of a lake.
    pub fn bed_slope(&self) -> f64 {
        -self.level_m[1] / length(self.along)
    }

    /// Returns the least slope of the sides across the channel, as a share of the hillside's.
    pub fn gentlest_cross(&self) -> f64 {
        least(self.cross[0], self.cross[0] + self.cross[1])
    }

    /// Returns the largest half width of the floor, with the rounded foot of its side, in grains.
    pub fn widest_trough(&self) -> f64 {
        most(self.trough[0], self.trough[0] + self.trough[1])
    }

    /// Returns the least slope of the floor, as a share of the side's.
    pub fn least_lean(&self) -> f64 {
        least(self.lean[0], self.lean[0] + self.lean[1])
    }

    /// Returns the largest half width of the river in grains.
    fn shore(&self) -> f64 {
        most(self.river[0], self.river[0] + self.river[1])
    }

    /// Returns the distance in grains from the segment beyond which its side has risen more than that of a brook
    /// without a floor does within the reach of a brook.
    #[inline]
    pub fn reach(&self, reach: Reach) -> f64 {
        let cross = if self.is_trunk { 1.0 } else { self.gentlest_cross().max(reach.least_cross) };
        let risen = widened(reach.of(self.side) / cross, self.widest_trough().max(self.shore())) + self.sunk;
        risen.min(self.near)
    }

    /// Tells whether the [reach](Segment::reach) touches a rectangle, given by its corners.
    pub fn reaches(&self, rectangle: [[f64; 2]; 2], reach: Reach) -> bool {
        touches(self.bounds(), rectangle, self.reach(reach))
    }

    /// Returns the height in metres of the segment's lowest water.
    pub fn lowest_m(&self) -> f64 {
        least(self.level_m[0], self.level_m[0] + self.level_m[1])
    }

    /// Returns the height in metres of the segment's highest water.
    pub fn highest_m(&self) -> f64 {
        most(self.level_m[0], self.level_m[0] + self.level_m[1])
    }

    /// Tells whether a point lies on the floor of the segment's valley.
    pub fn has_on_floor(&self, at: [f64; 2]) -> bool {
        let (t, square) = self.nearest(at);
        square < (LEVEL * lerp(self.trough, t)).powi(2)
    }

    /// Tells whether the side may be below a height at some distance, given as its square, for hillsides that rise
    /// `slope` metres a grain.
    pub fn may_be_below(&self, square: f64, slope: f64, most_m: f64) -> bool {
        let risen = (most_m - self.lowest_m()) / (slope * self.gentlest_cross());
        // Nowhere along the segment has the side risen less than this `rise`.
        risen > 0.0 && rise(square.sqrt(), self.shore(), self.widest_trough(), self.least_lean()) <= risen
    }

    /// Returns [`Segment::side_m`] if it is lower than `most_m`: cheaper than to compute and compare it.
    pub fn side_below_m(&self, at: [f64; 2], slope: f64, most_m: f64) -> Option<f64> {
        if most_m <= self.lowest_m() {
            return None;
        }
        let (t, square) = self.nearest(at);
        if !self.may_be_below(square, slope, most_m) {
            return None;
        }
        Some(self.side_at_m(t, square, slope)).filter(|side_m| *side_m < most_m)
    }

    /// Returns the height in metres of the segment's valley side at a point, for hillsides that rise `slope` metres a
    /// grain.
    pub fn side_m(&self, at: [f64; 2], slope: f64) -> f64 {
        let (t, square) = self.nearest(at);
        self.side_at_m(t, square, slope)
    }

    /// Returns the grains that the terraces have risen at a distance from a place of the segment. From the flood plain
    /// to the foot of the side they are equally far apart, and their risers are as steep as the side. Where they have
    /// no room they are lower.
    fn terraces_risen(&self, t: f64, grains: f64) -> f64 {
        if self.terraces == 0 {
            return 0.0;
        }
        let flood_plain = lerp(self.flood_plain, t).max(lerp(self.river, t));
        let tread = (LEVEL * lerp(self.trough, t) - flood_plain).max(0.0) / f64::from(self.terraces);
        let riser = lerp(self.riser, t).min(tread);
        (0..self.terraces).map(|step| (grains - flood_plain - tread * f64::from(step)).clamp(0.0, riser)).sum()
    }

    /// Returns the grains that the levee rises above the floor at a distance from a place of the segment: as many as
    /// there is room for on the level floor.
    fn levee_risen(&self, t: f64, grains: f64) -> f64 {
        let river = lerp(self.river, t);
        let room = (LEVEL * lerp(self.trough, t) - river).max(0.0);
        let height = (self.levees * LEVEE * river).min(room / (1.0 / LEVEE_RISES + 1.0 / LEVEE_FALLS));
        let beside = (grains - river).max(0.0);
        (LEVEE_RISES * beside).min(height - LEVEE_FALLS * (beside - height / LEVEE_RISES)).max(0.0)
    }

    fn side_at_m(&self, t: f64, square: f64, slope: f64) -> f64 {
        let (grains, shore, trough) = (square.sqrt(), lerp(self.river, t), lerp(self.trough, t));
        let raised = self.terraces_risen(t, grains) + self.levee_risen(t, grains);
        let risen = rise_over(grains, shore, trough, lerp(self.lean, t), raised);
        lerp(self.level_m, t) + slope * lerp(self.cross, t) * risen
    }
}

/// Bounds of the places and values of some segments.
#[derive(Clone, Copy, Debug)]
pub struct SegmentBounds {
    /// The corners of their bounding box.
    rectangle: [[f64; 2]; 2],
    /// The heights in metres of their lowest and their highest water.
    pub level_m: [f64; 2],
    gentlest_cross: f64,
    widest_trough: f64,
    widest_shore: f64,
    least_lean: f64,
    most_sunk: f64,
}

impl SegmentBounds {
    /// Returns the bounds of these segments; without any, no place is near enough to matter.
    pub fn of(segments: &[Segment]) -> SegmentBounds {
        let none = SegmentBounds {
            rectangle: [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]],
            level_m: [f64::INFINITY, f64::NEG_INFINITY],
            gentlest_cross: f64::INFINITY,
            widest_trough: 0.0,
            widest_shore: 0.0,
            least_lean: f64::INFINITY,
            most_sunk: 0.0,
        };
        segments.iter().fold(none, |all, segment| {
            let ([low, high], [all_low, all_high]) = (segment.bounds(), all.rectangle);
            SegmentBounds {
                rectangle: [
                    [0, 1].map(|axis| least(all_low[axis], low[axis])),
                    [0, 1].map(|axis| most(all_high[axis], high[axis])),
                ],
                level_m: [least(all.level_m[0], segment.lowest_m()), most(all.level_m[1], segment.highest_m())],
                gentlest_cross: least(all.gentlest_cross, segment.gentlest_cross()),
                widest_trough: most(all.widest_trough, segment.widest_trough()),
                widest_shore: most(all.widest_shore, segment.shore()),
                least_lean: least(all.least_lean, segment.least_lean()),
                most_sunk: most(all.most_sunk, segment.sunk),
            }
        })
    }

    /// Tells whether the bounding box, widened by some distance, holds a place, as [`LineSegment::touches`] does for a
    /// single line.
    pub fn touches(&self, place: [f64; 2], distance: f64) -> bool {
        self.overlaps([place, place], distance)
    }

    /// Tells whether the bounding box, widened by some distance, overlaps a rectangle.
    pub fn overlaps(&self, [low, high]: [[f64; 2]; 2], distance: f64) -> bool {
        let [own_low, own_high] = self.rectangle;
        let overlaps = |axis: usize| own_low[axis] - distance <= high[axis] && low[axis] <= own_high[axis] + distance;
        overlaps(0) & overlaps(1)
    }

    /// Returns a lower bound of the square of the distance in grains from a place to the nearest segment.
    pub fn least_square(&self, place: [f64; 2]) -> f64 {
        let [low, high] = self.rectangle;
        let off = [0, 1].map(|axis| most(most(low[axis] - place[axis], place[axis] - high[axis]), 0.0));
        off[0] * off[0] + off[1] * off[1]
    }

    /// Returns an upper bound of [`Segment::reach`] for a reach that is [the same](Reach::even) for all channels.
    pub fn reach(&self, brook: f64) -> f64 {
        widened(brook, self.widest_trough.max(self.widest_shore)) + self.most_sunk
    }

    /// Tells whether the side of a segment may be below a height at a place at least this far from all segments, given
    /// as the square, as [`Segment::may_be_below`] does for a single segment.
    pub fn may_be_below(&self, square: f64, slope: f64, most_m: f64) -> bool {
        let risen = (most_m - self.level_m[0]) / (slope * self.gentlest_cross);
        risen > 0.0 && rise(square.sqrt(), self.widest_shore, self.widest_trough, self.least_lean) <= risen
    }
}

/// Tells whether a rectangle, widened by `reach`, touches another one, both given by their corners.
pub fn touches([from, to]: [[f64; 2]; 2], [low, high]: [[f64; 2]; 2], reach: f64) -> bool {
    [0, 1]
        .into_iter()
        .all(|axis| from[axis].max(to[axis]) + reach >= low[axis] && from[axis].min(to[axis]) - reach <= high[axis])
}

/// Returns the smaller of two numbers; `min` would also check for NaN.
fn least(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// Returns the larger of two numbers.
fn most(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// A circle that holds the places of a course.
pub struct Circle {
    /// The centre.
    pub middle: [f64; 2],
    /// The radius in grains.
    pub radius: f64,
}

impl Circle {
    /// Returns the circle that holds all places, around the middle between the first and the last.
    pub fn around(places: &[[f64; 2]]) -> Circle {
        let (first, last) = (places[0], places[places.len() - 1]);
        let middle = [0, 1].map(|axis| f64::midpoint(first[axis], last[axis]));
        let distances = places.iter().map(|place| length([place[0] - middle[0], place[1] - middle[1]]));
        Circle { middle, radius: distances.fold(0.0, f64::max) }
    }

    /// Returns the grains from a segment to the nearest place in the circle.
    pub fn least(&self, segment: &Segment) -> f64 {
        self.left(segment.nearest(self.middle).1)
    }

    /// Returns a lower bound of the grains from some segments to the nearest place in the circle.
    pub fn least_of(&self, bounds: &SegmentBounds) -> f64 {
        self.left(bounds.least_square(self.middle))
    }

    fn left(&self, square: f64) -> f64 {
        (square.sqrt() - self.radius).max(0.0)
    }
}

/// Returns a channel, whose knots are final, with the cross-sections at them.
pub fn measured(fields: &Fields, channel: Channel) -> Channel {
    let bends = bends(fields, &channel);
    let sections = (0..channel.knots.len()).map(|knot| section(fields, &channel, knot, &bends[knot])).collect();
    channel.with_sections(sections)
}

/// Returns the cross-section at a knot of a channel, given the bend there.
fn section(fields: &Fields, channel: &Channel, knot: usize, bend: &Bend) -> CrossSection {
    let Knot { at, area, level_m, .. } = channel.knots[knot];
    let steep = steepness(fields, channel, knot);
    let trough = fields.trough(channel.id.0, area, level_m);
    let upstream = steepest_upstream(fields, channel, knot, trough);
    let (share, riser_m) = fields.terrace(at, area);
    // A lake has drowned its terraces.
    let is_lake = channel.knots[knot.max(1) - 1..=knot].iter().any(|knot| knot.pool_m > f64::NEG_INFINITY);
    let riser_m = if is_lake { 0.0 } else { riser_m };
    CrossSection {
        cross: across(steep) as f32,
        lean: (LEAN * steep.abs()).max(ABOVE_OWN * upstream).min(MOST_LEAN) as f32,
        trough: trough as f32,
        river: (fields.river_width_m(area) / 2.0 / fields.metres_a_grain() * bend.broad) as f32,
        flood_plain: (share * LEVEL * trough) as f32,
        riser: (riser_m / (channel.hill_slope * fields.metres_a_grain())) as f32,
        bend: bend.turn as f32,
    }
}

/// The effect of a bend on a river.
#[derive(Clone)]
struct Bend {
    /// Width of the river, as a share of the usual width for its discharge.
    broad: f64,
    /// Sharpness of the bend: 1 for the sharpest to the right, -1 for the sharpest to the left.
    turn: f64,
}

/// Returns the bend of a channel's river at each of its knots. Only trunks have bends, and are broader in them.
fn bends(fields: &Fields, channel: &Channel) -> Vec<Bend> {
    let knots = &channel.knots;
    let none = Bend { broad: 1.0, turn: 0.0 };
    // A channel of two knots is straight. This is checked first, because finding the ends takes longer.
    if channel.id.0 > 0 || knots.len() == 2 {
        return vec![none; knots.len()];
    }
    // Lakes and the sea count as ends, too.
    let is_end = |knot: &Knot| knot.pool_m > f64::NEG_INFINITY || fields.is_drowned(knot.at, knot.level_m);
    let ends: Vec<bool> = knots.iter().map(is_end).collect();
    let bend = |knot: usize| {
        let Knot { at: here, area, .. } = knots[knot];
        if ends[knot] {
            return none.clone();
        }
        let width = meander_width(fields, area);
        let others = |number: usize| (&knots[number], ends[number]);
        let way_up = ahead(here, (0..knot).rev().map(others), width);
        let way_down = ahead(here, (knot + 1..knots.len()).map(others), width);
        let ([before, after], come) = ([way_up.0, way_down.0], way_up.1.min(way_down.1));
        // The vector `before` leads back upstream, so the cross product of a turn to the right has the opposite sign.
        let sine = -cross(before, after) / (length(before) * length(after)).max(1e-9);
        let sharp = smooth((sine.abs() / SINE).min(1.0));
        // At its ends a trunk has the usual width and no bend, so that it matches the next trunk.
        let inner = smooth((come / (END_WIDTHS * width)).min(1.0));
        let broad = 1.0 + (STRAIGHT + (BENT - STRAIGHT) * sharp - 1.0) * inner;
        Bend { broad, turn: (sharp * inner).copysign(sine) }
    };
    (0..knots.len()).map(bend).collect()
}

/// Returns the offset from a place to the point of the channel that is as many grains ahead as a bend is measured over;
/// and the distance to the next end, as far as it matters. The channel runs through `knots`, each with whether it is an
/// end.
fn ahead<'a>(from: Point, knots: impl Iterator<Item = (&'a Knot, bool)>, width: f64) -> ([f64; 2], f64) {
    let (bend, most) = (BEND_WIDTHS * width, END_WIDTHS * width);
    let (mut come, mut last, mut place) = (0.0, from, [0.0; 2]);
    for (knot, is_end) in knots {
        let way = knot.at.from(last);
        let share = ((bend - come) / length(way).max(1e-9)).clamp(0.0, 1.0);
        place = [0, 1].map(|axis| place[axis] + way[axis] * share);
        (come, last) = (come + length(way), knot.at);
        if come >= most || is_end {
            break;
        }
    }
    (place, come)
}

/// Returns the segments of a [measured] channel that has this number, without those of no length and those whose ends
/// are not `wanted`.
pub fn segments_of(
    fields: &Fields,
    channel: &Channel,
    number: u32,
    origin: Point,
    wanted: impl Fn([[f64; 2]; 2]) -> bool,
) -> impl Iterator<Item = Segment> {
    debug_assert_eq!(channel.sections.len(), channel.knots.len(), "a channel is measured before it has segments");
    let mut before = channel.knots[0].at.from(origin);
    let most_sunk = lake::most_sunk(fields, channel.id.0);
    channel.knots.windows(2).zip(channel.sections.windows(2)).enumerate().filter_map(move |(knot, (pair, sections))| {
        let (from, to) = (before, pair[1].at.from(origin));
        before = to;
        let along = [to[0] - from[0], to[1] - from[1]];
        let square = along[0] * along[0] + along[1] * along[1];
        if square == 0.0 || !wanted([from, to]) {
            return None;
        }
        let values = |upper: f64, lower: f64| [upper, lower - upper];
        let section = |of: fn(&CrossSection) -> f32| values(of(&sections[0]).into(), of(&sections[1]).into());
        let sunk_m = pair[0].pool_m - pair[0].level_m.min(pair[1].level_m);
        Some(Segment {
            channel: number,
            knot: knot as u32,
            from,
            along,
            per_square: 1.0 / square,
            side: fields.side(channel.id.0) as f64,
            near: channel.near,
            is_trunk: channel.id.0 == 0,
            level_m: values(pair[0].level_m, pair[1].level_m),
            area: values(pair[0].area, pair[1].area),
            cross: section(|section| section.cross),
            trough: section(|section| section.trough),
            lean: section(|section| section.lean),
            river: section(|section| section.river),
            levees: fields.settings().levees,
            terraces: fields.settings().terraces,
            flood_plain: section(|section| section.flood_plain),
            riser: section(|section| section.riser),
            bend: section(|section| section.bend),
            pool_m: pair[0].pool_m,
            sunk: (sunk_m / (channel.hill_slope * fields.metres_a_grain())).clamp(0.0, most_sunk),
        })
    })
}

/// Returns the slope of a channel's bed at a knot, as a share of the hillside's slope. The hillside's slope is that of
/// the steepest line on it, of which the slope along the bed is one part and that across the channel the other.
fn steepness(fields: &Fields, channel: &Channel, knot: usize) -> f64 {
    let (above, below) = (&channel.knots[knot.max(1) - 1], &channel.knots[(knot + 1).min(channel.knots.len() - 1)]);
    let way_m = above.at.distance(below.at) * fields.metres_a_grain();
    (above.level_m - below.level_m) / (way_m * channel.hill_slope).max(1e-9)
}

/// Returns the steepest slope from a knot to those upstream within the width of its floor, as a share of the hillside's
/// slope; near the mouth, also the slope towards the channel that this one joins.
///
/// Trunks are never so much steeper further up that it matters, except where they fall from a delta into the sea.
fn steepest_upstream(fields: &Fields, channel: &Channel, knot: usize, trough: f64) -> f64 {
    if channel.id.0 == 0 && channel.knots[knot].level_m >= fields.sea_level_m() {
        return 0.0;
    }
    let last = channel.knots.len() - 1;
    let (here, next, mouth) = (&channel.knots[knot], &channel.knots[last.min(knot + 1)], &channel.knots[last]);
    // If the floor comes to lie beside the joined channel before the next knot, that channel must not lie on the floor
    // either.
    let joined = if next.at.distance(mouth.at) < trough { channel.joined_slope } else { 0.0 };
    let (mut steepest, mut before) = (joined, [0.0; 2]);
    for above in channel.knots[..knot].iter().rev() {
        let beyond = [here.at.distance(above.at), above.level_m - here.level_m];
        // Of the step that leads out of the floor's width, only the part within it counts.
        let share = ((trough - before[0]) / (beyond[0] - before[0]).max(1e-9)).clamp(0.0, 1.0);
        let [way, rise_m] = [0, 1].map(|part| before[part] + (beyond[part] - before[part]) * share);
        steepest = steepest.max(rise_m / way.max(1e-9));
        if beyond[0] >= trough {
            break;
        }
        before = beyond;
    }
    steepest / (fields.metres_a_grain() * channel.hill_slope)
}

/// Returns a circle that holds a bed, and the height of the bed's highest water.
pub fn bed_in(knots: &[Knot], origin: Point) -> (Circle, f64) {
    let places: Vec<[f64; 2]> = knots.iter().map(|knot| knot.at.from(origin)).collect();
    (Circle::around(&places), knots.iter().map(|knot| knot.level_m).fold(f64::NEG_INFINITY, f64::max))
}

/// Returns the segments whose sides may be below a height somewhere in a circle, for hillsides that rise `slope` metres
/// a grain.
pub fn nearly_below<'a>(segments: &[&'a Segment], circle: &Circle, slope: f64, most_m: f64) -> Vec<&'a Segment> {
    let may_be_below = |segment: &&Segment| {
        most_m > segment.lowest_m() && segment.may_be_below(circle.least(segment).powi(2), slope, most_m)
    };
    segments.iter().copied().filter(may_be_below).collect()
}

/// Lowers a bed, from its mouth up, to below the sides of other valleys, given their segments relative to an origin.
/// Where the bed is straight for long, it gets a new knot at each place that is lowered.
pub fn cut_into(fields: &Fields, knots: &mut Vec<Knot>, hill_slope: f64, segments: &[&Segment], origin: Point) {
    let least_slope = INCISION * hill_slope.min(fields.least_hill_slope()) * fields.metres_a_grain();
    let below = |knots: &[Knot], segments| {
        let (circle, highest_m) = bed_in(knots, origin);
        nearly_below(segments, &circle, least_slope, highest_m)
    };
    let near = below(knots, segments);
    let mut cut: Vec<Knot> = knots.last().copied().into_iter().collect();
    // From the mouth up, because each knot must stay above the one below; and in runs, each of which has few segments
    // near.
    for end in (1..knots.len()).rev().step_by(CUT_RUN) {
        let run = &knots[end.saturating_sub(CUT_RUN)..=end];
        let near = below(run, &near);
        for pair in run.windows(2).rev() {
            let (mut here, mut below) = (pair[0], cut[cut.len() - 1]);
            let gentlest = fields.hill_slope(fields.uplift(here.at)).min(hill_slope);
            let slope = INCISION * gentlest * fields.metres_a_grain();
            // The segments whose sides may be below the bed somewhere on the way between the two knots.
            let middle = here.towards(&pair[1], 0.5).at.from(origin);
            let half = here.at.distance(pair[1].at) / 2.0;
            let highest_m = here.level_m.max(pair[1].level_m);
            let may_be_below = |segment: &&Segment| {
                highest_m > segment.lowest_m() && {
                    let least = (segment.nearest(middle).1.sqrt() - half).max(0.0);
                    segment.may_be_below(least * least, slope, highest_m)
                }
            };
            let lower: Vec<&Segment> = near.iter().copied().filter(may_be_below).collect();
            let cut_m = |knot: &Knot| {
                let at = knot.at.from(origin);
                lower
                    .iter()
                    .fold(knot.level_m, |most_m, segment| segment.side_below_m(at, slope, most_m).unwrap_or(most_m))
            };
            // Wherever the bed fell, it still falls by a little at least. In a lake the bed may rise to the sill.
            let whole = (2.0 * half).max(1.0);
            let least_fall_m = LEAST_FALL_M.max(LEAST_FALL * whole * fields.metres_a_grain());
            let least_fall_m = (here.level_m - below.level_m).min(least_fall_m);
            let least_m = |at: Point, below: &Knot| below.level_m + least_fall_m * (at.distance(below.at) / whole);
            here.level_m = cut_m(&here).max(least_m(here.at, &below));
            let parts = (here.at.distance(below.at) / LONGEST_CUT).ceil();
            for part in (1..parts as usize).rev().filter(|_| least_fall_m > 0.0) {
                // The rest of the way down from here is straight, to the last knot that was lowered.
                let straight = here.towards(&pair[1], part as f64 / parts);
                let left = straight.at.distance(below.at) / here.at.distance(below.at);
                let straight = Knot { level_m: below.level_m + (here.level_m - below.level_m) * left, ..straight };
                let level_m = cut_m(&straight).max(least_m(straight.at, &below));
                if level_m < straight.level_m {
                    below = Knot { level_m, ..straight };
                    cut.push(below);
                }
            }
            here.level_m = here.level_m.max(least_m(here.at, &below));
            cut.push(here);
        }
    }
    cut.reverse();
    *knots = cut;
}

/// Returns the place of a channel some grains downstream of another; `None` past the channel's end.
pub fn downstream(channel: &Channel, (mut knot, mut t): ChannelPlace, mut grains: f64) -> Option<ChannelPlace> {
    while let [here, next, ..] = &channel.knots[knot..] {
        let whole = here.at.distance(next.at);
        let left = (1.0 - t) * whole;
        // Two knots may be at one place.
        if grains <= left && whole > 0.0 {
            return Some((knot, t + grains / whole));
        }
        grains -= left;
        (knot, t) = (knot + 1, 0.0);
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fluvial::channel::Mouth;
    use crate::fluvial::settings::FluvialSettings;
    use crate::preset::Preset;

    #[test]
    fn a_bed_is_cut_where_it_is_straight_for_long() {
        let (_, preset) = Preset::load("alps").unwrap();
        let fields = Fields::new(&preset.fluvial.unwrap(), preset.spacing_m, None, 4);
        let knot = |x: i64, y: i64, level_m: f64| Knot {
            at: Point::at_vertex(x, y),
            level_m,
            area: 0.001,
            pool_m: f64::NEG_INFINITY,
        };
        // The knots are a hundred vertices apart, and half way the deep head of another channel lies ten vertices
        // beside the bed.
        let mut bed = vec![knot(0, 0, 1200.0), knot(100, 0, 1000.0)];
        let (head, foot) = (knot(50, 10, 1010.0), knot(50, 60, 900.0));
        let other = Channel::new((3, 0, 0), vec![head, foot], Mouth::Sea, 0.6);
        let origin = Point::at_vertex(0, 0);
        let other = measured(&fields, other);
        let segments: Vec<Segment> = segments_of(&fields, &other, 0, origin, |_| true).collect();
        cut_into(&fields, &mut bed, 0.6, &segments.iter().collect::<Vec<_>>(), origin);
        assert!(bed.len() > 2 && bed.windows(2).all(|pair| pair[0].level_m > pair[1].level_m), "{bed:?}");
        let slope = fields.hill_slope(fields.uplift(head.at)).min(0.6) * fields.metres_a_grain();
        for knot in &bed[1..bed.len() - 1] {
            let side_m = segments[0].side_m(knot.at.from(origin), slope);
            assert!(knot.level_m < side_m, "{knot:?}, but the side is at {side_m}");
        }
    }

    /// Returns the segment of a river half a kilometre long between hillsides of a slope.
    fn reach_of_river(settings: &FluvialSettings, spacing_m: f64, hill_slope: f64) -> Segment {
        let fields = Fields::new(settings, spacing_m, None, 4);
        let knot =
            |x: i64, level_m: f64| Knot { at: Point::at_vertex(x, 0), level_m, area: 8.0, pool_m: f64::NEG_INFINITY };
        let river = Channel::new((0, 0, 0), vec![knot(0, 100.0), knot(50, 99.9)], Mouth::Sea, hill_slope);
        let river = measured(&fields, river);
        segments_of(&fields, &river, 0, Point::at_vertex(0, 0), |_| true).next().unwrap()
    }

    #[test]
    fn a_floor_goes_up_to_its_side_in_terraces() {
        let (_, preset) = Preset::load("plains").unwrap();
        let mut settings = preset.fluvial.unwrap();
        let slope = 0.04;
        let mut segment = |terraces: u32| {
            (settings.terraces, settings.levees) = (terraces, 0.0);
            reach_of_river(&settings, preset.spacing_m, slope)
        };
        let (bare, mut stepped) = (segment(0), segment(2));
        assert!(stepped.riser[0] > 0.0, "{:?}", stepped.riser);
        // Half of the floor is flood plain.
        stepped.flood_plain = [0.5 * LEVEL * stepped.trough[0], 0.0];
        let side_slope = slope / GRAINS as f64 * preset.spacing_m;
        let side_m = |segment: &Segment, grains: f64| segment.side_m([0.0, grains], side_slope);
        let (floor, vertex) = (LEVEL * stepped.trough[0], GRAINS as f64);
        let mut risers = 0;
        let mut was_riser = false;
        for step in 0..(1.5 * floor / vertex) as u32 {
            let (here, next) = (f64::from(step) * vertex, f64::from(step + 1) * vertex);
            let rise_m = side_m(&stepped, next) - side_m(&stepped, here);
            // The floor rises all the way, nowhere more steeply than sides do, and is nowhere lower than without
            // terraces.
            assert!(rise_m >= 0.0 && rise_m <= side_slope * vertex * 1.0001, "{rise_m} m at vertex {step}");
            assert!(side_m(&stepped, here) >= side_m(&bare, here));
            let is_riser = rise_m > 0.5 * side_slope * vertex && next < floor;
            risers += u32::from(is_riser && !was_riser);
            was_riser = is_riser;
        }
        assert_eq!(risers, 2);
        // The flood plain is the same, and at the foot of the side each of the two terraces has risen by twice the
        // river's depth.
        assert_eq!(side_m(&stepped, 0.4 * floor), side_m(&bare, 0.4 * floor));
        let risen_m = side_m(&stepped, floor) - side_m(&bare, floor);
        assert!((2.0..10.0).contains(&risen_m), "{risen_m} m");
    }

    #[test]
    fn a_levee_rises_beside_its_river_and_leaves_the_rest_as_it_was() {
        let (_, preset) = Preset::load("plains").unwrap();
        let mut settings = preset.fluvial.unwrap();
        let mut segment = |levees: f64| {
            (settings.terraces, settings.levees) = (0, levees);
            reach_of_river(&settings, preset.spacing_m, 0.04)
        };
        let (bare, raised) = (segment(0.0), segment(1.0));
        let more = |grains: f64| raised.side_m([0.0, grains], 1.0) - bare.side_m([0.0, grains], 1.0);
        let river = raised.river[0];
        assert_eq!(more(river), 0.0);
        let (top, height) = (river * (1.0 + LEVEE / LEVEE_RISES), LEVEE * river * raised.cross[0]);
        assert!((more(top) / height - 1.0).abs() < 0.1, "{} of {height}", more(top));
        assert!(more(2.0 * top) < more(top) && more(2.0 * top) > 0.0);
        assert_eq!(more(LEVEL * raised.trough[0]), 0.0);
    }

    #[test]
    fn a_valley_has_a_floor_that_leans_to_its_river_and_straight_sides() {
        let (shore, trough, lean) = (10.0, 400.0, 0.05);
        let at = |grains: f64| rise(grains, shore, trough, lean);
        assert_eq!(at(shore), 0.0);
        assert!((at(250.0) - 0.05 * 240.0).abs() < 1e-9, "{}", at(250.0));
        let steep = at(2001.0) - at(2000.0);
        assert!((0.98..=1.0).contains(&steep), "{steep}");
        // A brook without a floor has straight sides from the water up, however steep it is.
        assert_eq!(rise(100.0, shore, 0.0, MOST_LEAN), 90.0);
        // At the distance that `widened` returns, the side has risen more than that of a brook.
        assert!(at(widened(300.0, trough)) > 300.0);
    }
}
