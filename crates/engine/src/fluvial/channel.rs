//! Channels: the middle lines of valleys, from a head down to a mouth.

use glam::DVec2;

use super::laws::Laws;
use super::trunk_lattice::NodeId;
use crate::geometry::{LineSegment, come};
use crate::grain_point::{self, GRAINS, Point};
use crate::lines::{ChannelId, LakeId};
use crate::memory::heap_bytes;

/// Largest distance in grains between the places by which a channel is drawn: the warp bends the straight lines between
/// knots.
const LINE_STEP: f64 = 3.0 * GRAINS as f64;

/// Least distance in grains from a place where rivers join a channel to the other places by which the channel is drawn.
/// A river that comes in along the channel would cross a bend as short as that.
const BESIDE_LANDING: f64 = 1.5 * GRAINS as f64;

/// A place of a channel: the number of a knot, and the share of the way to the next one, 0 to 1.
pub type ChannelPlace = (usize, f64);

/// A point of a channel's middle line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Knot {
    /// The knot's place in the world.
    pub at: Point,
    /// Height in metres of the water, or of the floor where the channel is dry or has a lake, before strata and
    /// ceiling.
    pub level_m: f64,
    /// Area that drains through the knot, in cells of the trunk lattice.
    pub area: f64,
    /// Discharge through the knot in cubic metres a second.
    pub discharge_m3s: f64,
    /// Height in metres of the lake that covers lower ground from here to the next knot; negative infinity where there
    /// is no lake.
    pub pool_m: f64,
}

impl Knot {
    /// Returns the knot at a share of the straight way to the next one.
    #[must_use]
    pub fn towards(&self, next: &Knot, share: f64) -> Knot {
        let mix = |from: f64, to: f64| from + (to - from) * share;
        Knot {
            at: self.at.towards(next.at, share),
            level_m: mix(self.level_m, next.level_m),
            area: mix(self.area, next.area),
            discharge_m3s: mix(self.discharge_m3s, next.discharge_m3s),
            pool_m: self.pool_m,
        }
    }
}

/// The shape of the land across a channel at a knot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CrossSection {
    /// Slope of the side, as a share of the hillside's.
    pub cross: f32,
    /// Slope of the floor beside the river, as a share of the side's.
    pub lean: f32,
    /// Half width of the floor, with the rounded foot of its side, in grains.
    pub trough: f32,
    /// Half width of the river in grains.
    pub river: f32,
    /// Half width in grains of the flood plain, from which terraces rise.
    pub flood_plain: f32,
    /// Grains that a terrace rises, on a side whose slope is 1.
    pub riser: f32,
    /// Sharpness of the river's bend, seen downstream: 1 for the sharpest to the right, -1 for the sharpest to the
    /// left.
    pub bend: f32,
}

/// The end of a channel: the channel or the water that it runs into.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mouth {
    /// The channel with this id.
    Channel(ChannelId),
    /// The sea.
    Sea,
    /// A lake that has no outlet, at this node of the trunk lattice.
    Sink(NodeId),
}

/// A channel from its head down to its mouth; for a trunk, the part from one node to the next.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// The channel's name in the world.
    pub id: ChannelId,
    /// The knots from head to mouth, at least two.
    pub knots: Vec<Knot>,
    /// The channel or the water that this channel runs into.
    pub mouth: Mouth,
    /// The laws at the channel's head.
    pub laws: Laws,
    /// Least slope, in metres a grain, at which the floor must rise near the mouth towards the channel that this one
    /// joins, so that the joined channel does not lie above the floor.
    pub joined_slope: f64,
    /// For a trunk, the next node, and true if the trunk that goes on from there is the same river. `None` for a trunk
    /// that the sea cuts short.
    pub next: Option<(NodeId, bool)>,
    /// The lake that the knots' `pool_m` belongs to: the channel's own, or that of the channel that it runs into.
    pub lake: Option<LakeId>,
    /// For a branch, the distance in grains from it beyond which its sides do not matter, because its trunk has the
    /// land beyond. Infinite for other channels.
    pub near: f64,
    /// The cross-section at each knot, once the channel has been [measured](super::cross_section::measured).
    pub sections: Vec<CrossSection>,
    bounds: [Point; 2],
}

heap_bytes!(Knot);
heap_bytes!(CrossSection);
heap_bytes!(Channel: knots, sections);

impl Channel {
    /// Creates the channel through these knots.
    pub fn new(id: ChannelId, knots: Vec<Knot>, mouth: Mouth, laws: Laws) -> Channel {
        let bounds = bounds(&knots);
        Channel {
            id,
            knots,
            mouth,
            laws,
            joined_slope: 0.0,
            next: None,
            lake: None,
            near: f64::INFINITY,
            sections: Vec::new(),
            bounds,
        }
    }

    /// Returns the same channel after its knots have moved, with the cross-sections at them.
    #[must_use]
    pub fn with_sections(self, sections: Vec<CrossSection>) -> Channel {
        Channel { bounds: bounds(&self.knots), sections, ..self }
    }

    /// Returns the same channel with fewer knots: those that are left are at least `grains` of its way apart, except at
    /// its ends and where a lake begins or ends.
    #[must_use]
    pub fn thinned(&self, grains: f64) -> Channel {
        let last = self.knots.len() - 1;
        let mut come = 0.0;
        let is_left = |knot: &usize| {
            let here = self.knots[*knot];
            come += self.knots[knot.max(&1) - 1].at.distance(here.at);
            let is_shore = *knot > 0 && self.knots[knot - 1].pool_m != here.pool_m;
            let is_left = *knot == 0 || *knot == last || is_shore || come >= grains;
            if is_left {
                come = 0.0;
            }
            is_left
        };
        let left: Vec<usize> = (0..=last).filter(is_left).collect();
        Channel {
            knots: left.iter().map(|knot| self.knots[*knot]).collect(),
            sections: left.iter().map(|knot| self.sections[*knot]).collect(),
            ..self.clone()
        }
    }

    /// Returns the corners of the bounding box of the knots.
    pub fn bounds(&self) -> [Point; 2] {
        self.bounds
    }

    /// Returns the last knot.
    pub fn mouth_knot(&self) -> &Knot {
        &self.knots[self.knots.len() - 1]
    }

    /// Returns the discharge in cubic metres a second at the place that is nearest to a point.
    pub fn discharge_near_m3s(&self, at: Point) -> f64 {
        let near = |pair: &[Knot]| {
            let line = LineSegment { from: pair[0].at.from(at).into(), along: pair[1].at.from(pair[0].at).into() };
            let (share, square) = line.nearest([0.0; 2]);
            (square, pair[0].towards(&pair[1], share).discharge_m3s)
        };
        let nearest = self.knots.windows(2).map(near).min_by(|one, other| one.0.total_cmp(&other.0));
        nearest.expect("a channel has two knots").1
    }

    /// Returns the knot at a place.
    pub fn at(&self, (knot, share): ChannelPlace) -> Knot {
        match self.knots.get(knot + 1) {
            Some(next) => self.knots[knot].towards(next, share),
            None => self.knots[knot],
        }
    }

    /// Returns the place some grains down the channel from its head; `None` past the channel's end.
    pub fn down(&self, grains: f64) -> Option<ChannelPlace> {
        self.downstream((0, 0.0), grains)
    }

    /// Returns the place some grains downstream of another; `None` past the channel's end.
    pub fn downstream(&self, (mut knot, mut t): ChannelPlace, mut grains: f64) -> Option<ChannelPlace> {
        while let [here, next, ..] = &self.knots[knot..] {
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

    /// Returns the half width in grains of the river at a place, once the channel has been measured.
    pub fn half_width(&self, (knot, share): ChannelPlace) -> f64 {
        let [upper, lower] =
            [knot, (knot + 1).min(self.knots.len() - 1)].map(|knot| f64::from(self.sections[knot].river));
        upper + (lower - upper) * share
    }

    /// Returns the places by which the channel is drawn as a line, from a knot down: all knots, and places between them
    /// a few vertices apart.
    pub fn line_places(&self, from: usize) -> impl Iterator<Item = ChannelPlace> {
        let last = self.knots.len() - 1;
        let between = (from..last).flat_map(|knot| {
            // At least one place a knot, even where two knots are at one place: so no knot is left out.
            let steps = (self.knots[knot].at.distance(self.knots[knot + 1].at) / LINE_STEP).ceil().max(1.0) as usize;
            (0..steps).map(move |step| (knot, step as f64 / steps as f64))
        });
        between.chain([(last, 0.0)])
    }

    /// Returns the first place, at or below a given one, at which rivers may join the channel: a place by which the
    /// channel is drawn, so that the two lines share a point, and with no other such place close by.
    pub fn landing(&self, place: ChannelPlace) -> Option<ChannelPlace> {
        let mut places = self.line_places(place.0.max(1) - 1).map(|place| (place, self.at(place).at));
        let (mut before, mut here) = (places.next()?, places.next()?);
        for after in places {
            let is_clear = [before, after].iter().all(|other| other.1.distance(here.1) > BESIDE_LANDING);
            if here.0 >= place && is_clear {
                return Some(here.0);
            }
            (before, here) = (here, after);
        }
        None
    }

    /// Returns the places of the knots.
    pub fn places(&self) -> Vec<Point> {
        self.knots.iter().map(|knot| knot.at).collect()
    }

    /// Returns the places of the knots, relative to an origin.
    pub fn course(&self, origin: Point) -> Vec<DVec2> {
        self.knots.iter().map(|knot| knot.at.from(origin)).collect()
    }
}

/// Returns the distance in grains along the channel from the first knot to each.
pub fn ways(knots: &[Knot]) -> Vec<f64> {
    come(knots.windows(2).map(|pair| pair[0].at.distance(pair[1].at)))
}

fn bounds(knots: &[Knot]) -> [Point; 2] {
    grain_point::around(knots.iter().map(|knot| knot.at), 0.0).expect("a channel has knots")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fluvial::lake::NO_LAKE;
    use crate::fluvial::settings::FluvialSettings;

    fn channel(places: &[[i64; 2]]) -> Channel {
        let laws = Laws::everywhere(&FluvialSettings::default(), 0.0);
        let knot = |[x, y]: [i64; 2]| {
            let (at, level_m) = (Point { x, y }, -(x as f64));
            Knot { at, level_m, area: 1.0, discharge_m3s: 1.0, pool_m: NO_LAKE }
        };
        Channel::new((0, 0, 0), places.iter().copied().map(knot).collect(), Mouth::Sea, laws)
    }

    #[test]
    fn a_channel_is_drawn_through_its_knots_and_places_between_them() {
        let channel = channel(&[[0, 0], [8 * GRAINS, 0], [8 * GRAINS, 0], [9 * GRAINS, 0]]);
        let places: Vec<ChannelPlace> = channel.line_places(0).collect();
        assert_eq!(places, [(0, 0.0), (0, 1.0 / 3.0), (0, 2.0 / 3.0), (1, 0.0), (2, 0.0), (3, 0.0)]);
        assert_eq!(channel.line_places(1).collect::<Vec<_>>(), places[3..]);
    }

    #[test]
    fn rivers_join_where_the_line_has_a_point_and_no_other_close_by() {
        // A bend of a vertex between two long straights.
        let channel = channel(&[[0, 0], [9 * GRAINS, 0], [10 * GRAINS, GRAINS / 2], [19 * GRAINS, GRAINS / 2]]);
        assert_eq!(channel.landing((0, 0.1)), Some((0, 1.0 / 3.0)));
        assert_eq!(channel.landing((0, 1.0 / 3.0)), Some((0, 1.0 / 3.0)));
        // The two ends of the bend are too close to each other.
        assert_eq!(channel.landing((0, 0.7)), Some((2, 1.0 / 3.0)));
        // Nothing joins where the channel ends: other channels end there.
        assert_eq!(channel.landing((2, 0.7)), None);
    }
}
