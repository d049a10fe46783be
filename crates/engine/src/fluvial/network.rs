//! The network of channels: the trunks, and level by level the tributaries that join what is already there.
//!
//! A cell of a level's lattice may hold the head of a channel, whose course is a straight line to the nearest channel
//! of the levels above it: such lines cross neither each other nor the channels that they run to. If a line aslant, to
//! a place further downstream, crosses nothing that may be there, the course takes that line instead. Where the coast
//! is nearer than any channel, the course runs to the coast. Around its course a channel wanders, in a tube that meets
//! no other channel's tube; at last [`Fluvial`](super::Fluvial) warps the plane, channels and hills alike. A bed rises
//! from its mouth, by the law of rivers, and never above the valley sides that the levels above it make.
//!
//! Each channel is a pure function of its cell, which asks for the channels of the levels above.
//!
//! Based on: M. Gaillard, B. Benes, E. Guérin, E. Galin, D. Rohmer, M.-P. Cani, Dendry: a procedural model for
//! dendritic patterns, 2019 (nested lattices that join the nearest channel).

use std::convert::Infallible;
use std::sync::Arc;

use glam::DVec2;

use super::branches::Branches;
use super::channel::Channel;
use super::fields::Fields;
use super::lake;
use super::segment::{Reach, Segments, segments_of, touches, widened};
use super::segments_above::{self, Above, AsksAbove, ChannelPart, Patch, PatchId};
use super::tributary::Tributaries;
use super::tributary_course;
use super::trunk_course::{self, TrunkCourses};
use super::trunk_lattice::Trunks;
use crate::clock::Clock;
use crate::grain_point::{Point, overlap, padded};
use crate::lines::ChannelId;
use crate::memory::{Memory, Remembers};
use crate::stop::Stopped;

/// The choice of the channels that land is made of.
#[derive(Clone, Copy, Debug)]
pub struct ShownChannels {
    /// Number of levels, from the trunks down.
    pub levels: u32,
    /// Least distance in grains between knots: of knots that are nearer to each other some are left out.
    pub least_piece: f64,
    /// True if trunks run straight from node to node. Straight trunks are known long before all that bends them.
    pub are_straight: bool,
}

impl ShownChannels {
    /// Chooses all channels of this many levels.
    pub fn whole(levels: u32) -> ShownChannels {
        ShownChannels { levels, least_piece: 0.0, are_straight: false }
    }
}

/// The channels of a world.
#[derive(Debug)]
pub struct Network {
    fields: Arc<Fields>,
    trunks: TrunkCourses,
    branches: Branches,
    tributaries: Tributaries,
    channels: Memory<ChannelId, Option<Arc<Channel>>>,
    patches: Memory<PatchId, Patch>,
}

impl Network {
    /// Creates the network of a world with these fields. `is_far` is true for a world seen from so far that not even
    /// the trunks' cells show.
    pub fn new(fields: Arc<Fields>, is_far: bool, seed: u64) -> Network {
        Network {
            trunks: TrunkCourses::new(Arc::clone(&fields), is_far, seed),
            branches: Branches::new(Arc::clone(&fields), seed),
            tributaries: Tributaries::new(Arc::clone(&fields), seed),
            fields,
            // Roads are planned over far more land than a tile has, and a channel that is forgotten too soon is made
            // again with all channels around it.
            channels: Memory::new(128 << 20),
            patches: Memory::new(96 << 20),
        }
    }

    /// Returns the caches.
    pub(super) fn memories(&self) -> Vec<&dyn Remembers> {
        let own: Vec<&dyn Remembers> = vec![&self.channels, &self.patches];
        [self.trunks.memories(), self.branches.memories(), self.tributaries.memories(), own].concat()
    }

    /// Returns the trunk lattice.
    pub fn trunks(&self) -> &Trunks {
        self.trunks.nodes()
    }

    /// Returns the rectangle that holds the heads of all channels of a level that may touch a rectangle.
    pub fn input(&self, level: u32, rectangle: [Point; 2]) -> [Point; 2] {
        let reach = match level {
            0 => trunk_course::REACH_CELLS * self.fields.side(level) as f64,
            _ => tributary_course::reach(&self.fields, level),
        };
        padded(rectangle, reach)
    }

    /// Calls `take` with all channels of a level that may touch a rectangle, in the order of their cells.
    pub fn channels(&self, level: u32, rectangle: [Point; 2], mut take: impl FnMut(&Arc<Channel>)) {
        let Ok(()) = self.try_channels(level, 0.0, rectangle, |channel| {
            take(channel);
            Ok::<_, Infallible>(())
        });
    }

    /// Calls `take` with all channels of a level that may touch a rectangle, but not with trunks that drain less than
    /// `least_area` cells of the trunk lattice. The area of tributaries is not looked at, as it is not known before
    /// they are made.
    ///
    /// # Errors
    /// The first error of `take`.
    pub(super) fn try_channels<E>(
        &self,
        level: u32,
        least_area: f64,
        rectangle: [Point; 2],
        mut take: impl FnMut(&Arc<Channel>) -> Result<(), E>,
    ) -> Result<(), E> {
        let mut take = |id: ChannelId| match self.channel(id) {
            Some(channel) if overlap(channel.bounds(), rectangle) => take(&channel),
            _ => Ok(()),
        };
        match level {
            0 => {
                let nodes = self.trunks().look();
                let touches = |(_, x, y): &ChannelId| {
                    f64::from(nodes.drained((*x, *y)).area) >= least_area
                        && TrunkCourses::bounds(&nodes, (*x, *y)).is_some_and(|bounds| overlap(bounds, rectangle))
                };
                self.fields.cells(level, self.input(level, rectangle)).filter(touches).try_for_each(&mut take)
            }
            _ => self.tributaries.touching(level, rectangle, self).into_iter().try_for_each(&mut take),
        }
    }

    /// Returns the segments of the shown channels whose [reach](super::segment::Segment::reach) touches a rectangle,
    /// relative to `origin`.
    ///
    /// # Errors
    /// When `clock` stops the work.
    pub fn segments(
        &self,
        shown: ShownChannels,
        rectangle: [Point; 2],
        origin: Point,
        reach: Reach,
        clock: &Clock,
    ) -> Result<Segments, Stopped> {
        let asked = rectangle.map(|corner| corner.from(origin));
        let (mut channels, mut all) = (Vec::new(), Vec::new());
        for level in 0..shown.levels {
            let own = reach.of(self.fields.side(level) as f64);
            let gentlest = if level == 0 { 1.0 } else { reach.least_cross };
            let widest = widened(own / gentlest, self.fields.widest_trough(level));
            let widest = widest + lake::most_sunk(&self.fields, level);
            let around = padded(rectangle, widest);
            let comes_near = |ends: [DVec2; 2], by: f64| touches(ends, asked, by);
            let mut take = |channel: &Arc<Channel>| {
                let before = all.len();
                // Most segments are further away than any reach.
                let segments =
                    segments_of(&self.fields, channel, channels.len() as u32, origin, |ends| comes_near(ends, widest));
                all.extend(segments.filter(|segment| segment.reaches(asked, reach)));
                if all.len() > before {
                    channels.push(Arc::clone(channel));
                }
            };
            if shown.are_straight {
                let ids = self.fields.cells(level, self.input(level, around));
                let nodes = self.trunks().look();
                ids.filter_map(|(_, x, y)| self.trunks.straight(&nodes, (x, y)))
                    .for_each(|trunk| take(&Arc::new(trunk)));
                continue;
            }
            self.try_channels(level, 0.0, around, |channel| {
                clock.check()?;
                if shown.least_piece > 0.0 {
                    take(&Arc::new(channel.thinned(shown.least_piece)));
                    return Ok(());
                }
                take(channel);
                if level == 0 {
                    // A branch is no further from its trunk than the trunk's floor is wide, so this trunk was found if
                    // its branch is near.
                    let is_wanted =
                        |branch: &Channel| comes_near(branch.bounds().map(|at| at.from(origin)), branch.near);
                    self.branches(channel, is_wanted).iter().for_each(&mut take);
                }
                Ok(())
            })?;
        }
        Ok(Segments { origin, channels, all })
    }

    /// Returns the wanted branches of a trunk, in their order.
    pub(super) fn branches(&self, trunk: &Channel, is_wanted: impl Fn(&Channel) -> bool) -> Vec<Arc<Channel>> {
        self.branches.of(trunk, is_wanted, |rectangle, take| self.wet_channels(rectangle, take))
    }

    /// Tells whether a channel may have a lake of its own, which is known before the channel is made.
    pub(super) fn may_have_lake(&self, id: ChannelId) -> bool {
        id.0 == 0 || self.tributaries.may_have_lake(id)
    }

    /// Calls `take` with all trunks, and all tributaries that hold water, that may touch a rectangle.
    pub(super) fn wet_channels(&self, rectangle: [Point; 2], take: &mut dyn FnMut(&Arc<Channel>)) {
        for level in (0..self.fields.levels()).take_while(|level| *level == 0 || self.fields.may_be_wet(*level)) {
            self.channels(level, rectangle, |channel| {
                if level == 0 || self.fields.holds_water(channel.mouth_knot().discharge_m3s) {
                    take(channel);
                }
            });
        }
    }

    fn patch(&self, id: PatchId) -> Arc<Patch> {
        let channels_in = |take: &mut dyn FnMut(&Arc<Channel>)| self.channels(id.level, id.square(&self.fields), take);
        self.patches.get(id, || Patch::new(&self.fields, id, channels_in))
    }
}

impl AsksAbove for Network {
    fn above(&self, level: u32, rectangle: [Point; 2], part: ChannelPart) -> Above {
        let origin = segments_above::origin(&self.fields, rectangle[0]);
        let ids = (0..level).flat_map(|level| segments_above::patches(&self.fields, level, rectangle, part, origin));
        let patches = ids.map(|id| self.patch(id)).collect();
        Above { origin, patches }
    }

    fn channel(&self, id: ChannelId) -> Option<Arc<Channel>> {
        let make = || match id {
            (0, x, y) => self.trunks.trunk((x, y)),
            _ => self.tributaries.of(id, self),
        };
        self.channels.get(id, make).as_ref().clone()
    }
}

#[cfg(test)]
mod tests {
    use crate::fluvial::Fluvial;
    use crate::fluvial::channel::Mouth;
    use crate::fluvial::segments_above::AsksAbove;
    use crate::grain_point::Point;

    #[test]
    fn a_channel_is_found_wherever_it_runs_and_joins_another_where_that_is_drawn() {
        for name in ["alps", "archipelago"] {
            let fluvial = Fluvial::of_preset(name, 4, |_| {});
            let network = fluvial.network();
            let (mut known, mut joins) = (0, 0);
            for level in 0..fluvial.fields().levels() {
                let side = fluvial.fields().side(level);
                let corner = Point { x: -7 * side, y: 5 * side };
                for id in fluvial.fields().cells(level, [corner, Point { x: 13 * side, y: 25 * side }]) {
                    if let Some(channel) = network.channel(id) {
                        for knot in &channel.knots {
                            let mut is_found = false;
                            network.channels(level, [knot.at; 2], |other| is_found |= other.id == channel.id);
                            assert!(is_found, "{name}: {:?} at {:?}", channel.id, knot.at);
                        }
                        known += 1;
                        // A river ends at a point of the line of the channel that it joins.
                        if let Mouth::Channel(joined) = channel.mouth
                            && fluvial.is_wet(channel.mouth_knot())
                        {
                            let (joined, mouth) = (network.channel(joined).unwrap(), channel.mouth_knot().at);
                            assert!(
                                joined.line_places(0).any(|place| joined.at(place).at == mouth),
                                "{:?}",
                                channel.id
                            );
                            joins += 1;
                        }
                    }
                }
            }
            assert!(known > 200 && joins > 20, "{name}: {known} channels, {joins} rivers that join others");
        }
    }
}
