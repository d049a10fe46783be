//! Channels: the middle lines of valleys, from a head down to a mouth.

use super::point::{self, GRAINS, Point};
use super::trunk::NodeId;
use crate::geometry::come;
use crate::lines::{ChannelId, LakeId};
use crate::memory::heap_bytes;

/// Grains from one of the places by which a channel is drawn to the next at most: the world bends what is straight between
/// two knots.
const LINE_STEP: f64 = 3.0 * GRAINS as f64;

/// Grains within which a place where rivers join a channel has no other by which it is drawn: one that comes in along it would
/// come across a bend as short.
const BESIDE_LANDING: f64 = 1.5 * GRAINS as f64;

/// A place of a channel: the number of a knot, and the share of the way to the next one, 0 to 1.
pub type ChannelPlace = (usize, f64);

/// A point of a channel's middle line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Knot {
    /// Where it is.
    pub at: Point,
    /// Height of the water, or of the floor where it is dry or a lake, in metres, before strata and ceiling.
    pub level_m: f64,
    /// Area that drains through it, in cells of the trunk lattice.
    pub area: f64,
    /// Height in metres of the lake that stands over what lies lower, from here to the next knot; negative infinity where
    /// there is none.
    pub pool_m: f64,
}

impl Knot {
    /// The knot at a share of the straight way to the next one.
    #[must_use]
    pub fn towards(&self, next: &Knot, share: f64) -> Knot {
        let mix = |from: f64, to: f64| from + (to - from) * share;
        Knot {
            at: self.at.moved(next.at.from(self.at).map(|way| way * share)),
            level_m: mix(self.level_m, next.level_m),
            area: mix(self.area, next.area),
            pool_m: self.pool_m,
        }
    }
}

/// What the land across a channel is like at a knot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CrossSection {
    /// Slope of its side, as a share of the hillside's.
    pub cross: f32,
    /// How steep its floor is beside the river, as a share of its side.
    pub lean: f32,
    /// Half width of the rounded floor in grains.
    pub trough: f32,
    /// Half width of the river in grains.
    pub river: f32,
    /// Half width in grains of the flood plain, from which terraces rise.
    pub flood_plain: f32,
    /// Grains that a terrace rises, on a side whose slope is 1.
    pub riser: f32,
    /// How sharply it bends: 1 to the right, -1 to the left as sharply as any, seen downstream.
    pub bend: f32,
}

/// What a channel runs into.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mouth {
    /// The channel of that id.
    Channel(ChannelId),
    /// The sea.
    Sea,
    /// A lake that has no outlet, at that node of the trunk lattice.
    Sink(NodeId),
}

/// A channel from its head down to its mouth; of a trunk, the part from one node to the next.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// Its name in the world.
    pub id: ChannelId,
    /// From head to mouth, at least two.
    pub knots: Vec<Knot>,
    /// What it runs into.
    pub mouth: Mouth,
    /// Slope of the hillsides around.
    pub hill_slope: f64,
    /// How steep its floor must rise towards what it runs into near its mouth, so that this does not lie above it: metres a
    /// grain.
    pub joined_slope: f64,
    /// For a trunk, the next node and whether this is that river's own upper course; not for one that the sea cuts
    /// short.
    pub next: Option<(NodeId, bool)>,
    /// The lake that its knots know of: its own, or that of the channel that it runs into.
    pub lake: Option<LakeId>,
    /// Grains from it beyond which its sides do not matter: of a branch, whose trunk has the land beyond. Infinite for others.
    pub near: f64,
    /// One for each knot, once the channel has been [measured](super::segment::measured).
    pub sections: Vec<CrossSection>,
    bounds: [Point; 2],
}

heap_bytes!(Knot);
heap_bytes!(CrossSection);
heap_bytes!(Channel: knots, sections);

impl Channel {
    /// The channel through these knots.
    pub fn new(id: ChannelId, knots: Vec<Knot>, mouth: Mouth, hill_slope: f64) -> Channel {
        let bounds = bounds(&knots);
        Channel {
            id,
            knots,
            mouth,
            hill_slope,
            joined_slope: 0.0,
            next: None,
            lake: None,
            near: f64::INFINITY,
            sections: Vec::new(),
            bounds,
        }
    }

    /// The same channel once its knots have moved, with the cross-sections at them.
    #[must_use]
    pub fn with_sections(self, sections: Vec<CrossSection>) -> Channel {
        Channel { bounds: bounds(&self.knots), sections, ..self }
    }

    /// The same with fewer knots, of which two are so many grains of its way apart, but where a lake begins or ends.
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

    /// The corners of the least rectangle around its knots.
    pub fn bounds(&self) -> [Point; 2] {
        self.bounds
    }

    /// The knot at a place.
    pub fn at(&self, (knot, share): ChannelPlace) -> Knot {
        match self.knots.get(knot + 1) {
            Some(next) => self.knots[knot].towards(next, share),
            None => self.knots[knot],
        }
    }

    /// Half width in grains of its river at a place, once it has been measured.
    pub fn half_width(&self, (knot, share): ChannelPlace) -> f64 {
        let [upper, lower] =
            [knot, (knot + 1).min(self.knots.len() - 1)].map(|knot| f64::from(self.sections[knot].river));
        upper + (lower - upper) * share
    }

    /// The places by which it is drawn as a line, from a knot down: all knots, and places between them a few vertices apart.
    pub fn line_places(&self, from: usize) -> impl Iterator<Item = ChannelPlace> {
        let last = self.knots.len() - 1;
        let between = (from..last).flat_map(|knot| {
            // One at least, also where two knots are at one place: no knot is left out.
            let steps = (self.knots[knot].at.distance(self.knots[knot + 1].at) / LINE_STEP).ceil().max(1.0) as usize;
            (0..steps).map(move |step| (knot, step as f64 / steps as f64))
        });
        between.chain([(last, 0.0)])
    }

    /// The first place at or below one at which rivers may join it: one by which it is drawn, so that the two lines share a
    /// point, and with no other close by.
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

    /// Where its knots are, relative to an origin.
    pub fn course(&self, origin: Point) -> Vec<[f64; 2]> {
        self.knots.iter().map(|knot| knot.at.from(origin)).collect()
    }
}

/// The way from the first knot to each, in grains.
pub fn ways(knots: &[Knot]) -> Vec<f64> {
    come(knots.windows(2).map(|pair| pair[0].at.distance(pair[1].at)))
}

fn bounds(knots: &[Knot]) -> [Point; 2] {
    point::around(knots.iter().map(|knot| knot.at), 0.0).expect("a channel has knots")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fluvial::lake::NO_LAKE;

    fn channel(places: &[[i64; 2]]) -> Channel {
        let knot = |[x, y]: [i64; 2]| Knot { at: Point { x, y }, level_m: -(x as f64), area: 1.0, pool_m: NO_LAKE };
        Channel::new((0, 0, 0), places.iter().copied().map(knot).collect(), Mouth::Sea, 1.0)
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
        // Others end where the channel ends.
        assert_eq!(channel.landing((2, 0.7)), None);
    }
}
