//! Segments: the straight parts of channels, and the valley sides that rise from them.

use std::sync::Arc;

use super::channel::{Channel, Knot};
use super::fields::Fields;
use super::point::{GRAINS, Point};
use crate::geometry::{LineSegment, length, lerp};
use crate::memory::heap_bytes;

/// The straight segments of the channels around a place, in a fixed order.
#[derive(Debug)]
pub struct Segments {
    /// What their lines are relative to.
    pub origin: Point,
    /// The channels, in the order of levels, chunks and cells.
    pub channels: Vec<Arc<Channel>>,
    /// Their segments, those of a channel from its head down.
    pub all: Vec<Segment>,
}

/// A straight segment of a channel: from one knot to the next. Pairs are a value at its upper end, and how that changes
/// to its lower end.
#[derive(Clone, Debug)]
pub struct Segment {
    /// The number of its channel.
    pub channel: u32,
    /// The number of the knot at which it begins.
    pub knot: u32,
    /// Where it begins, in grains east and south of the origin.
    pub from: [f64; 2],
    /// The way from there to where it ends.
    pub along: [f64; 2],
    per_square: f64,
    /// Heights of the water in metres.
    pub level_m: [f64; 2],
    /// Areas that drain through it, in cells of the trunk lattice.
    pub area: [f64; 2],
    /// Half widths of the rounding of the valley's floor, in grains.
    pub trough: [f64; 2],
    /// Half widths of a lake, in grains.
    pub lake: [f64; 2],
}

heap_bytes!(Segment);
heap_bytes!(Segments: channels, all);

/// How much steeper than the river the valley's sides are at least, a vertex from its middle.
///
/// It makes floors less round. On rounder ones a vertex of the bed is nearly as high above a place further down, beside
/// whose bed it lies: it would be land, and break the brook.
const STEEPER: f64 = 2.5;

/// Grains from a channel beyond which its side has risen more than that of a brook does within `brook` grains, by the
/// half widths of the rounding of its floor and of its lake.
///
/// A side rises as `sqrt(d^2 - lake^2 + trough^2) - trough`, and a brook's, which has neither, as `d`: solved for d.
pub fn reach(brook: f64, trough: f64, lake: f64) -> f64 {
    (brook * (brook + 2.0 * trough) + lake * lake).sqrt()
}

impl Segment {
    /// The segment's line, relative to the segments' origin.
    pub fn line(&self) -> LineSegment {
        LineSegment { from: self.from, along: self.along }
    }

    /// The share of the segment at which it is nearest to a point, and the square of the distance in grains.
    pub fn nearest(&self, to: [f64; 2]) -> (f64, f64) {
        self.nearest_off([to[0] - self.from[0], to[1] - self.from[1]])
    }

    /// [`Segment::nearest`] to a point so far from where the segment begins.
    ///
    /// [`LineSegment::nearest`] but for a division, which is done once for all points.
    pub fn nearest_off(&self, off: [f64; 2]) -> (f64, f64) {
        let t = ((off[0] * self.along[0] + off[1] * self.along[1]) * self.per_square).clamp(0.0, 1.0);
        let off = [off[0] - self.along[0] * t, off[1] - self.along[1] * t];
        (t, off[0] * off[0] + off[1] * off[1])
    }

    /// The largest half width of its lake in grains.
    pub fn widest_lake(&self) -> f64 {
        self.lake[0].max(self.lake[0] + self.lake[1])
    }

    /// Grains from the segment beyond which its side has risen more than that of a brook without a floor does within
    /// `brook` grains.
    #[inline]
    pub fn reach(&self, brook: f64) -> f64 {
        reach(brook, self.trough[0].max(self.trough[0] + self.trough[1]), self.widest_lake())
    }

    /// Its lowest water in metres.
    pub fn lowest_m(&self) -> f64 {
        self.level_m[0].min(self.level_m[0] + self.level_m[1])
    }

    /// The height of the valley side that rises from it at a point, for hillsides that rise so many metres a grain.
    pub fn side_m(&self, at: [f64; 2], slope: f64) -> f64 {
        let (t, square) = self.nearest(at);
        let (trough, shore) = (lerp(self.trough, t), lerp(self.lake, t));
        let rise = ((square - shore * shore).max(0.0) + trough * trough).sqrt() - trough;
        lerp(self.level_m, t) + slope * rise
    }
}

/// The segments of a channel that has that number, but for those without a length, of those whose ends are wanted.
pub fn segments_of(
    fields: &Fields,
    channel: &Channel,
    number: u32,
    origin: Point,
    wanted: impl Fn([[f64; 2]; 2]) -> bool,
) -> impl Iterator<Item = Segment> {
    channel.knots.windows(2).enumerate().filter_map(move |(knot, pair)| {
        let (from, to) = (pair[0].at.from(origin), pair[1].at.from(origin));
        if !wanted([from, to]) {
            return None;
        }
        let along = [to[0] - from[0], to[1] - from[1]];
        let square = along[0] * along[0] + along[1] * along[1];
        let values = |value: &dyn Fn(&Knot) -> f64| {
            let upper = value(&pair[0]);
            [upper, value(&pair[1]) - upper]
        };
        let fall_m = (pair[0].level_m - pair[1].level_m).max(1e-9);
        let length_m = square.sqrt() * fields.metres_a_grain();
        let roundest = channel.hill_slope * GRAINS as f64 * length_m / (STEEPER * fall_m);
        (square > 0.0).then(|| Segment {
            channel: number,
            knot: knot as u32,
            from,
            along,
            per_square: 1.0 / square,
            level_m: values(&|knot| knot.level_m),
            area: values(&|knot| knot.area),
            trough: values(&|knot| fields.trough(knot.area).min(roundest)),
            lake: values(&|knot| knot.lake),
        })
    })
}

/// The place some grains downstream of a place, at most the end of the channel or of the known segments.
pub fn downstream<'a>(
    segments: &'a [Segment],
    mut segment: &'a Segment,
    mut t: f64,
    mut grains: f64,
) -> (&'a Segment, f64) {
    loop {
        let whole = length(segment.along);
        let left = (1.0 - t) * whole;
        if grains <= left {
            return (segment, t + grains / whole);
        }
        grains -= left;
        let follows = |next: &&Segment| next.knot == segment.knot + 1 && next.channel == segment.channel;
        match segments.iter().find(follows) {
            Some(next) => (segment, t) = (next, 0.0),
            None => return (segment, 1.0),
        }
    }
}
