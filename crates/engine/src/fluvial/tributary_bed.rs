//! The beds of tributaries: how high they lie beside larger valleys and the coast.

use std::cell::Cell;

use glam::DVec2;

use super::bed_cut::{INCISION, nearly_below};
use super::channel::Knot;
use super::fields::{BESIDE, Fields, most_area};
use super::laws::Laws;
use super::segment::{Circle, Segment, SegmentBounds, rise};
use super::segments_above::Above;
use super::trunk_lattice::LEAST_SLOPE;
use crate::geometry::{come, lerp};
use crate::grain_point::Point;

/// Share of the area at its mouth by which a tributary's area is smaller at its head. The head has a quarter, as much
/// as the mouth of a tributary of the next level.
const AREA_FALL: f64 = 0.75;

/// Shares of a step up a tributary at which its bed is compared with the sides of larger valleys, besides the step's
/// upper end. They are closer together towards the lower end, where floors are flattest.
const PLACES: [f64; 5] = [0.0625, 0.125, 0.25, 0.5, 0.75];

/// Least depth in metres of a bed below the sides of larger valleys: as much as rasters of these sides may lose.
const CUT_M: f64 = 0.05;

/// Slopes of the parts of a glacier's valley, from its mouth up, as multiples of a river's slope. The valley hangs over
/// the larger one, which the larger glacier has cut deeper, and rises in steps to the floor of its cirque. The mean is
/// 1, so that both rise as much.
const STAIRS: [f64; 4] = [1.5, 0.7, 1.5, 0.3];

/// The larger valleys near a tributary.
#[derive(Clone, Copy)]
pub(super) struct LargerValleys<'a> {
    pub above: &'a Above,
    /// Middle of the tributary's course, and the radius in grains around it within which the side of a brook matters.
    pub middle: DVec2,
    pub brook: f64,
}

impl<'a> LargerValleys<'a> {
    /// Returns the segments of the valleys, without the groups whose bounds show that they do not matter.
    pub fn which(self, may_matter: impl Fn(&SegmentBounds) -> bool + Copy) -> impl Iterator<Item = &'a Segment> {
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
    pub fn nearly_below(self, circle: &Circle, slope: f64, most_m: f64) -> Vec<&'a Segment> {
        let may_matter = |bounds: &SegmentBounds| bounds.may_be_below(circle.least_of(bounds).powi(2), slope, most_m);
        self.which(&may_matter)
            .filter(|segment| segment.may_be_below(circle.least(segment).powi(2), slope, most_m))
            .collect()
    }
}

/// The bed of a tributary while it is laid, from its shore up.
pub(super) struct TributaryBed<'a> {
    fields: &'a Fields,
    level: u32,
    /// The places that the bed runs through, in grains from the origin.
    places: &'a [DVec2],
    origin: Point,
    /// Distances in metres from the shore up to each place.
    way_m: Vec<f64>,
    /// Metres that a river rises along each step from place to place.
    rises_m: Vec<f64>,
    /// Heights in metres that the coast leaves the bed at each place.
    coast_m: Vec<f64>,
    /// Height in metres to which the valley is filled.
    filled_m: f64,
    /// Metres a grain that hillsides rise.
    hillside: f64,
    /// The gentlest sides that the bed may have.
    beside: GentlestSides,
    is_wet: bool,
    /// The segments of larger valleys that may decide how high the bed keeps, and those whose sides may be below it.
    above: Vec<&'a Segment>,
    near: Vec<&'a Segment>,
    knots: Vec<Knot>,
}

/// The larger valleys whose sides may be below a bed along a step.
struct LowerValleys<'a> {
    segments: Vec<&'a Segment>,
    /// True for a dry brook that has reached a larger valley's floor. It sinks in: it leaves no bed there, and cuts
    /// into no valley's side.
    has_run_out: bool,
}

impl<'a> TributaryBed<'a> {
    /// Prepares the bed of a tributary of a level through some places, the first of which is its shore, given the laws
    /// at its head, the larger valleys near it and the height in metres to which a lake has filled its mouth.
    pub fn new(
        fields: &'a Fields,
        (level, laws): (u32, &Laws),
        (shore, origin): (Knot, Point),
        places: &'a [DVec2],
        valleys: LargerValleys<'a>,
        filled_m: f64,
    ) -> TributaryBed<'a> {
        let way_m = come(places.windows(2).map(|pair| pair[1].distance(pair[0]) * fields.metres_a_grain()));
        // Near the larger valley hillsides may be gentler than at the head.
        let gentlest = fields.laws(shore.at).hill_slope.min(laws.hill_slope);
        let hillside = gentlest * fields.metres_a_grain();
        let beside = GentlestSides { slope: BESIDE * hillside, trough: laws.widest_trough(fields, level) };
        let coast_filled_m = fields.filled_m(level);
        let filled_m = filled_m.max(coast_filled_m);
        let rises_m = rises_m(fields, level, laws, shore.level_m, &way_m);
        // Of the segments nearby, only those are kept that may matter somewhere along the bed.
        let around = Circle::around(places);
        let above = valleys.nearly_above(&around, beside);
        let most_m = above.iter().map(|segment| segment.highest_m()).fold(filled_m.max(shore.level_m), f64::max);
        let most_m = most_m + rises_m.iter().sum::<f64>() + CUT_M;
        let near = valleys.nearly_below(&around, INCISION * hillside, most_m);
        // Listed from the head down, as the function expects.
        let downwards = places.iter().rev().map(|place| origin.moved(*place));
        let mut coast_m = fields.below_coast_along_m(downwards, coast_filled_m);
        coast_m.reverse();
        let is_wet = laws.is_wet(fields, level);
        let knots = vec![shore];
        TributaryBed {
            fields,
            level,
            places,
            origin,
            way_m,
            rises_m,
            coast_m,
            filled_m,
            hillside,
            beside,
            is_wet,
            above,
            near,
            knots,
        }
    }

    /// Returns the knots of the bed from its shore up.
    pub fn knots(mut self) -> Vec<Knot> {
        for step in 1..self.places.len() {
            let here = self.places[step];
            // The bed stays high enough that no larger channel beside it comes to lie on its side, and loses its water
            // to it.
            let beside_m = beside_m(&self.above, here, self.beside);
            let below_m = self.knots[self.knots.len() - 1].level_m;
            let free_m = beside_m.max(below_m + self.rises_m[step - 1]).max(self.filled_m);
            // But the bed must not stand above the sides of larger valleys, and those of lower channels may be lower.
            let lower = self.lower_valleys(step, free_m + CUT_M);
            let mut ground_m = self.ground_m(&lower, here, free_m);
            if !self.is_wet {
                // Where the coast is lower than larger channels leave room for, a dry brook begins only further down.
                if step > 1 && self.coast_m[step] < beside_m {
                    break;
                }
                // Between a steep larger channel and its valley's side further down there may be no room for a bed.
                // Then the larger channel keeps its water, and a dry brook has no valley there.
                ground_m = ground_m.max(beside_m);
            }
            self.rise_to(step, ground_m.min(self.coast_m[step]), &lower);
        }
        self.knots
    }

    /// Returns the area that drains through the bed at a distance in metres from its shore.
    fn area(&self, way_m: f64) -> f64 {
        area_at(self.level, way_m / self.way_m[self.way_m.len() - 1])
    }

    /// Returns the larger valleys whose sides may be below a height somewhere along a step. The bed is straight between
    /// two knots, but the floor of a valley that is wider than the step is round.
    fn lower_valleys(&self, step: usize, most_m: f64) -> LowerValleys<'a> {
        let (middle, step_m) = (self.places[step], self.way_m[step] - self.way_m[step - 1]);
        let circle = Circle { middle, radius: step_m / self.fields.metres_a_grain() };
        let segments = nearly_below(&self.near, &circle, INCISION * self.hillside, most_m);
        let has_run_out = !self.is_wet && segments.iter().any(|segment| segment.has_on_floor(middle));
        LowerValleys { segments, has_run_out }
    }

    /// Returns the height to which the bed cuts into the side of a larger valley at a place, if that is below `most_m`:
    /// not below the height to which its own valley is filled.
    fn side_below_m(&self, lower: &LowerValleys, segment: &Segment, place: DVec2, most_m: f64) -> Option<f64> {
        let cut_m = segment.side_below_m(place, INCISION * self.hillside, most_m)?;
        let ground_m = match cut_m < self.filled_m {
            true => segment.side_m(place, self.hillside).min(self.filled_m),
            false if lower.has_run_out => segment.side_m(place, self.hillside),
            false => cut_m,
        };
        Some(ground_m).filter(|ground_m| *ground_m < most_m)
    }

    /// Returns the height of a bed that would be `free_m` high at a place, but for the sides of larger valleys.
    fn ground_m(&self, lower: &LowerValleys, place: DVec2, free_m: f64) -> f64 {
        lower.segments.iter().fold(free_m, |ground_m, segment| {
            let side_m = self.side_below_m(lower, segment, place, ground_m + CUT_M);
            side_m.map_or(ground_m, |side_m| side_m - CUT_M)
        })
    }

    /// Adds the knot at the upper end of a step, which lies at a height in metres, and before it the knots of a bed
    /// with water where the way there would rise above the sides of larger valleys.
    fn rise_to(&mut self, step: usize, level_m: f64, lower: &LowerValleys) {
        let ([before, here], shore) = ([self.places[step - 1], self.places[step]], self.knots[0]);
        let below = self.knots[self.knots.len() - 1];
        let step_m = self.way_m[step] - self.way_m[step - 1];
        // Across a lake or the floor of a larger valley the bed rises no more than these do, but always a little.
        let least_slope = LEAST_SLOPE.min(self.rises_m[step - 1] / step_m);
        let least_m = |share: f64| step_m * share * least_slope;
        let knot = |place: DVec2, level_m: f64, area: f64| {
            let discharge_m3s = shore.discharge_m3s * (area / shore.area);
            Knot { at: self.origin.moved(place), level_m, area, discharge_m3s, ..shore }
        };
        // The share of the step and the height of the last knot, at first that of the knot below.
        let mut from = (0.0, below.level_m);
        let mut knots = Vec::new();
        for t in PLACES.into_iter().filter(|_| self.is_wet) {
            let place = before.lerp_monotonic(here, t);
            let straight_m = from.1 + (level_m - from.1) * (t - from.0) / (1.0 - from.0);
            let side_m = lower.segments.iter().fold(straight_m + CUT_M, |most_m, segment| {
                self.side_below_m(lower, segment, place, most_m).unwrap_or(most_m)
            });
            if side_m < straight_m + CUT_M {
                from = (t, (side_m - CUT_M).max(from.1 + least_m(t - from.0)));
                knots.push(knot(place, from.1, self.area(lerp([self.way_m[step - 1], step_m], t))));
            }
        }
        let level_m = level_m.max(from.1 + least_m(1.0 - from.0));
        knots.push(knot(here, level_m, self.area(self.way_m[step])));
        self.knots.extend(knots);
    }
}

/// Returns the area that drains through a tributary of a level at a share of its way up.
fn area_at(level: u32, share: f64) -> f64 {
    most_area(level) * (1.0 - AREA_FALL * share)
}

/// Returns the metres that a river with the area of each step's middle rises along the step, given the distances from
/// the shore, which lies at a height.
fn rises_m(fields: &Fields, level: u32, laws: &Laws, shore_m: f64, way_m: &[f64]) -> Vec<f64> {
    // The finest valleys are younger than the ice, so glaciers have not shaped them.
    let iced = if level + 1 < fields.levels() { laws.iced(shore_m) } else { 0.0 };
    let whole_m = way_m[way_m.len() - 1];
    let rise_m = |ends: &[f64]| {
        let middle = f64::midpoint(ends[0] / whole_m, ends[1] / whole_m);
        let stair = 1.0 + iced * (STAIRS[(middle * STAIRS.len() as f64) as usize] - 1.0);
        let slope = (laws.river_slope(area_at(level, middle)) * stair).min(laws.steepest_river());
        (ends[1] - ends[0]) * slope
    };
    way_m.windows(2).map(rise_m).collect()
}

/// The gentlest sides that a bed may have: they rise `slope` metres a grain, beside a rounded floor of the half width
/// `trough` in grains.
#[derive(Clone, Copy)]
pub(super) struct GentlestSides {
    pub slope: f64,
    pub trough: f64,
}

impl GentlestSides {
    /// Returns the metres that a side rises within some grains.
    fn rise_m(self, grains: f64) -> f64 {
        self.slope * rise(grains, 0.0, self.trough, 0.0)
    }

    /// Returns the height in metres above which the bed keeps at a place because of one segment.
    fn above_m(self, segment: &Segment, at: DVec2) -> f64 {
        let (t, square) = segment.nearest(at);
        lerp(segment.level_m, t) - self.rise_m(square.sqrt())
    }
}

/// Returns the height in metres above which a bed with such sides keeps at a place, so that it does not take the water
/// of larger channels beside it.
pub(super) fn beside_m(near: &[&Segment], at: DVec2, beside: GentlestSides) -> f64 {
    near.iter().fold(f64::NEG_INFINITY, |most_m, segment| {
        let above_m = beside.above_m(segment, at);
        // Not `max`, which also checks for NaN.
        if above_m > most_m { above_m } else { most_m }
    })
}
