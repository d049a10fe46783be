//! Channels: the middle lines of valleys, from a head down to a mouth.

use super::point::{self, Point};
use super::trunk::NodeId;
use crate::lines::{ChannelId, LakeId};
use crate::memory::heap_bytes;

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
    /// For a trunk, the next node and whether this is that river's own upper course; not for one that the sea cuts
    /// short.
    pub next: Option<(NodeId, bool)>,
    /// The lake that its knots know of: its own, or that of the channel that it runs into.
    pub lake: Option<LakeId>,
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
        Channel { id, knots, mouth, hill_slope, next: None, lake: None, sections: Vec::new(), bounds }
    }

    /// The same channel once its knots have moved, with the cross-sections at them.
    #[must_use]
    pub fn with_sections(self, sections: Vec<CrossSection>) -> Channel {
        Channel { bounds: bounds(&self.knots), sections, ..self }
    }

    /// The corners of the least rectangle around its knots.
    pub fn bounds(&self) -> [Point; 2] {
        self.bounds
    }

    /// Where its knots are, relative to an origin.
    pub fn course(&self, origin: Point) -> Vec<[f64; 2]> {
        self.knots.iter().map(|knot| knot.at.from(origin)).collect()
    }
}

fn bounds(knots: &[Knot]) -> [Point; 2] {
    point::around(knots.iter().map(|knot| knot.at), 0.0).expect("a channel has knots")
}
