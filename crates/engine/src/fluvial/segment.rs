//! Segments: the straight parts of channels, and the valley sides that rise from them.
//!
//! To judge the numbers chosen by eye, look at hillshades of valley floors: levees in `plains`, feet of valley sides in
//! `alps`.

use std::sync::Arc;

use glam::DVec2;

use super::channel::{Channel, CrossSection};
use super::fields::Fields;
use super::lake;
use crate::geometry::{LineSegment, lerp};
use crate::grain_point::Point;
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
    pub from: DVec2,
    /// The way from the upper end to the lower end, in grains.
    pub along: DVec2,
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
    /// Discharges in cubic metres a second.
    pub discharge_m3s: [f64; 2],
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

/// Share of the half width of a valley's floor that is level across, apart from its lean. The rest is the rounded foot
/// of the side. Chosen by eye.
pub(super) const LEVEL: f64 = 0.7;

/// Height of the highest levees, as a share of their river's half width; their slope towards the river and behind, as
/// shares of the side's slope. The slope behind is less than most floors lean, so that water stands behind few levees.
/// Chosen by eye.
pub(super) const LEVEE: f64 = 0.25;
pub(super) const LEVEE_RISES: f64 = 0.3;
pub(super) const LEVEE_FALLS: f64 = 0.05;

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
        LineSegment { from: self.from.into(), along: self.along.into() }
    }

    /// Returns the corners of the segment's bounding box.
    pub fn bounds(&self) -> [DVec2; 2] {
        let to = self.from + self.along;
        [self.from.min(to), self.from.max(to)]
    }

    /// Returns the share of the segment at which it is nearest to a point, and the square of the distance in grains.
    pub fn nearest(&self, to: DVec2) -> (f64, f64) {
        self.nearest_off(to - self.from)
    }

    /// Returns the same as [`Segment::nearest`] for a point given by its offset from the segment's upper end.
    ///
    /// It does what [`LineSegment::nearest`] does, but for a division, which is done once for all points.
    pub fn nearest_off(&self, off: DVec2) -> (f64, f64) {
        let t = (off.dot(self.along) * self.per_square).clamp(0.0, 1.0);
        (t, (off - self.along * t).length_squared())
    }

    /// Returns the metres that the bed falls a grain; less than 0 where the bed rises to the sill of a lake.
    pub fn bed_slope(&self) -> f64 {
        -self.level_m[1] / self.along.length()
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
    pub fn reaches(&self, rectangle: [DVec2; 2], reach: Reach) -> bool {
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
    pub fn has_on_floor(&self, at: DVec2) -> bool {
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
    pub fn side_below_m(&self, at: DVec2, slope: f64, most_m: f64) -> Option<f64> {
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
    pub fn side_m(&self, at: DVec2, slope: f64) -> f64 {
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
    rectangle: [DVec2; 2],
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
            rectangle: [DVec2::INFINITY, DVec2::NEG_INFINITY],
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
                rectangle: [all_low.min(low), all_high.max(high)],
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
    pub fn touches(&self, place: DVec2, distance: f64) -> bool {
        self.overlaps([place, place], distance)
    }

    /// Tells whether the bounding box, widened by some distance, overlaps a rectangle.
    pub fn overlaps(&self, [low, high]: [DVec2; 2], distance: f64) -> bool {
        let [own_low, own_high] = self.rectangle;
        (own_low - distance).cmple(high).all() & low.cmple(own_high + distance).all()
    }

    /// Returns a lower bound of the square of the distance in grains from a place to the nearest segment.
    pub fn least_square(&self, place: DVec2) -> f64 {
        let [low, high] = self.rectangle;
        (low - place).max(place - high).max(DVec2::ZERO).length_squared()
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
pub fn touches([from, to]: [DVec2; 2], [low, high]: [DVec2; 2], reach: f64) -> bool {
    (from.max(to) + reach).cmpge(low).all() && (from.min(to) - reach).cmple(high).all()
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
    pub middle: DVec2,
    /// The radius in grains.
    pub radius: f64,
}

impl Circle {
    /// Returns the circle that holds all places, around the middle between the first and the last.
    pub fn around(places: &[DVec2]) -> Circle {
        let middle = places[0].midpoint(places[places.len() - 1]);
        let distances = places.iter().map(|place| place.distance(middle));
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

/// Returns the segments of a [measured](super::cross_section::measured) channel that has this number, without those of
/// no length and those whose ends are not `wanted`.
pub fn segments_of(
    fields: &Fields,
    channel: &Channel,
    number: u32,
    origin: Point,
    wanted: impl Fn([DVec2; 2]) -> bool,
) -> impl Iterator<Item = Segment> {
    debug_assert_eq!(channel.sections.len(), channel.knots.len(), "a channel is measured before it has segments");
    let mut before = channel.knots[0].at.from(origin);
    let most_sunk = lake::most_sunk(fields, channel.id.0);
    channel.knots.windows(2).zip(channel.sections.windows(2)).enumerate().filter_map(move |(knot, (pair, sections))| {
        let (from, to) = (before, pair[1].at.from(origin));
        before = to;
        let along = to - from;
        let square = along.length_squared();
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
            discharge_m3s: values(pair[0].discharge_m3s, pair[1].discharge_m3s),
            cross: section(|section| section.cross),
            trough: section(|section| section.trough),
            lean: section(|section| section.lean),
            river: section(|section| section.river),
            levees: channel.laws.levees,
            terraces: fields.terraces(),
            flood_plain: section(|section| section.flood_plain),
            riser: section(|section| section.riser),
            bend: section(|section| section.bend),
            pool_m: pair[0].pool_m,
            sunk: (sunk_m / (channel.laws.hill_slope * fields.metres_a_grain())).clamp(0.0, most_sunk),
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fluvial::channel::{Knot, Mouth};
    use crate::fluvial::cross_section::{MOST_LEAN, measured};
    use crate::fluvial::laws::Laws;
    use crate::fluvial::settings::FluvialSettings;
    use crate::grain_point::GRAINS;

    /// Returns the segment of a river half a kilometre long between hillsides of a slope.
    fn reach_of_river(hill_slope: f64, change: impl FnOnce(&mut FluvialSettings)) -> Segment {
        let fields = Fields::of_preset("plains", 4, change);
        let discharge_m3s = fields.most_laws().discharge_m3s(&fields, 8.0);
        let knot = |x: i64, level_m: f64| {
            let at = Point::at_vertex(x, 0);
            Knot { at, level_m, area: 8.0, discharge_m3s, pool_m: f64::NEG_INFINITY }
        };
        let laws = Laws { hill_slope, ..*fields.most_laws() };
        let river = Channel::new((0, 0, 0), vec![knot(0, 100.0), knot(50, 99.9)], Mouth::Sea, laws);
        let river = measured(&fields, river);
        segments_of(&fields, &river, 0, Point::at_vertex(0, 0), |_| true).next().unwrap()
    }

    #[test]
    fn a_floor_goes_up_to_its_side_in_terraces() {
        let slope = 0.04;
        let segment =
            |terraces: u32| reach_of_river(slope, |settings| (settings.terraces, settings.levees) = (terraces, 0.0));
        let (bare, mut stepped) = (segment(0), segment(2));
        assert!(stepped.riser[0] > 0.0, "{:?}", stepped.riser);
        // Half of the floor is flood plain.
        stepped.flood_plain = [0.5 * LEVEL * stepped.trough[0], 0.0];
        let side_slope = slope * Fields::of_preset("plains", 4, |_| {}).metres_a_grain();
        let side_m = |segment: &Segment, grains: f64| segment.side_m(DVec2::new(0.0, grains), side_slope);
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
        let segment = |levees: f64| reach_of_river(0.04, |settings| (settings.terraces, settings.levees) = (0, levees));
        let (bare, raised) = (segment(0.0), segment(1.0));
        let more = |grains: f64| raised.side_m(DVec2::Y * grains, 1.0) - bare.side_m(DVec2::Y * grains, 1.0);
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
