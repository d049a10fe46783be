//! Strahler's orders of channels that hold water.
//!
//! Based on: A. N. Strahler, Quantitative analysis of watershed geomorphology, 1957. Where two streams of the same
//! order meet, the stream below has the next higher order; a stream that joins one of higher order changes nothing.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::Fluvial;
use super::channel::{Channel, Mouth};
use super::segments_above::AsksAbove;
use super::trunk_lattice::{NodeId, neighbours};
use crate::clock::Clock;
use crate::geometry::LineSegment;
use crate::grain_point::{Point, padded};
use crate::lines::ChannelId;
use crate::memory::{Memory, Remembers, heap_bytes};
use crate::stop::Stopped;

/// A tributary with water, where it joins a channel.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Join {
    /// Place of the confluence in the channel, as [`locate`] returns it.
    place: f64,
    id: ChannelId,
    order: u32,
}

heap_bytes!(Join);

/// The orders along a channel.
#[derive(Clone, Debug)]
pub struct Orders {
    /// The order at the channel's head.
    start: u32,
    /// The tributaries that join the channel, from the head down.
    joins: Arc<Vec<Join>>,
}

impl Orders {
    /// Returns the order at a place of the channel, after the tributaries that join there.
    pub fn at(&self, place: f64) -> u32 {
        let above = self.joins.iter().take_while(|join| join.place <= place);
        above.fold(self.start, |order, join| met([order, join.order].into_iter()))
    }

    /// Returns the order at the channel's mouth.
    pub fn end(&self) -> u32 {
        self.at(f64::INFINITY)
    }
}

/// Returns the order below a place where streams of some orders meet; 1 if there are none, as at a spring.
fn met(orders: impl Iterator<Item = u32>) -> u32 {
    let (mut most, mut twice) = (1, false);
    let mut any = false;
    for order in orders {
        twice = if any && order == most { true } else { twice && order < most };
        most = order.max(most);
        any = true;
    }
    most + u32::from(twice)
}

/// The caches of orders.
#[derive(Debug)]
pub struct Strahler {
    joins: Memory<ChannelId, Vec<Join>>,
    /// The orders at the heads of trunks.
    starts: Memory<NodeId, u32>,
}

impl Default for Strahler {
    fn default() -> Strahler {
        Strahler { joins: Memory::new(4 << 20), starts: Memory::new(1 << 20) }
    }
}

impl Strahler {
    /// Returns these caches.
    pub(super) fn memories(&self) -> Vec<&dyn Remembers> {
        vec![&self.joins, &self.starts]
    }

    /// Returns the orders of a channel.
    ///
    /// On continents, those of trunks follow from the trunks alone, as if all tributaries of a trunk had their highest
    /// order: above the mouth of a great river there are millions of brooks.
    pub fn orders(&self, fluvial: &Fluvial, channel: &Channel, clock: &Clock) -> Result<Orders, Stopped> {
        if let ((0, x, y), true) = (channel.id, fluvial.fields().has_continents()) {
            let brooks = fluvial.fields().levels() - 1;
            let start = brooks + fluvial.network().trunks().drained((x, y)).order;
            return Ok(Orders { start, joins: Arc::default() });
        }
        let start = match channel.id {
            (0, x, y) => *self.starts.try_get((x, y), || self.start(fluvial, (x, y), clock))?,
            _ => 1,
        };
        Ok(Orders { start, joins: self.joins(fluvial, channel, clock)? })
    }

    /// Computes the order at the node where a trunk begins, from all trunks above the node.
    fn start(&self, fluvial: &Fluvial, node: NodeId, clock: &Clock) -> Result<u32, Stopped> {
        let network = fluvial.network();
        let nodes = &network.trunks().look();
        let donors = |id: NodeId| {
            neighbours(id).filter(move |other| {
                let drained = nodes.drained(*other);
                drained.to == Some(id)
                    && drained.sea_at.is_none()
                    && fluvial.has_river(f64::from(drained.area), drained.discharge_m3s)
            })
        };
        let mut above = vec![node];
        let mut next = 0;
        while next < above.len() {
            above.extend(donors(above[next]));
            next += 1;
        }
        // From the springs down: the reverse of the order in which nodes were found. A loop instead of recursion, as
        // trunks are long.
        let mut ends: BTreeMap<NodeId, u32> = BTreeMap::new();
        for id in above.into_iter().skip(1).rev() {
            let start = met(donors(id).map(|donor| ends[&donor]));
            let channel = network.channel((0, id.0, id.1)).expect("what drains to a node has a channel there");
            ends.insert(id, Orders { start, joins: self.joins(fluvial, &channel, clock)? }.end());
        }
        Ok(met(donors(node).map(|donor| ends[&donor])))
    }

    /// Returns the tributaries with water that join a channel, from its head down.
    fn joins(&self, fluvial: &Fluvial, channel: &Channel, clock: &Clock) -> Result<Arc<Vec<Join>>, Stopped> {
        self.joins.try_get(channel.id, || self.find_joins(fluvial, channel, clock))
    }

    fn find_joins(&self, fluvial: &Fluvial, channel: &Channel, clock: &Clock) -> Result<Vec<Join>, Stopped> {
        let network = fluvial.network();
        let around = padded(channel.bounds(), 1.0);
        let mut joins = Vec::new();
        for level in channel.id.0 + 1..fluvial.fields().levels() {
            if !fluvial.may_have_rivers(level) {
                break;
            }
            network.try_channels(level, 0.0, around, |tributary| {
                clock.check()?;
                if tributary.mouth == Mouth::Channel(channel.id) && fluvial.is_wet(tributary.mouth_knot()) {
                    let order = self.orders(fluvial, tributary, clock)?.end();
                    joins.push(Join { place: locate(channel, tributary.mouth_knot().at), id: tributary.id, order });
                }
                Ok(())
            })?;
        }
        joins.sort_by(|a, b| a.place.total_cmp(&b.place).then(a.id.cmp(&b.id)));
        Ok(joins)
    }
}

/// Returns the place of a channel that is nearest to a point: the number of a knot plus the share of the way to the
/// next knot.
pub fn locate(channel: &Channel, at: Point) -> f64 {
    let mut nearest = (f64::INFINITY, 0.0);
    for (knot, pair) in channel.knots.windows(2).enumerate() {
        let line = LineSegment { from: [0.0; 2], along: pair[1].at.from(pair[0].at).into() };
        let (share, distance) = line.nearest(at.from(pair[0].at).into());
        if distance < nearest.0 {
            nearest = (distance, knot as f64 + share);
        }
    }
    nearest.1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_of_the_same_order_make_one_more() {
        let order = |orders: &[u32]| met(orders.iter().copied());
        assert_eq!(order(&[]), 1);
        assert_eq!(order(&[1]), 1);
        assert_eq!(order(&[1, 1]), 2);
        assert_eq!(order(&[1, 1, 1]), 2);
        assert_eq!(order(&[2, 1, 1]), 2);
        assert_eq!(order(&[1, 1, 2]), 2);
        assert_eq!(order(&[3, 1, 3, 2]), 4);
        assert_eq!(order(&[1, 3]), 3);
    }

    #[test]
    fn the_order_grows_on_the_way_down() {
        // A spring that meets two brooks, then a river of order 2, then one of order 1, then one of order 4.
        let joins = [(0.5, 1), (1.25, 1), (2.0, 2), (2.5, 1), (3.0, 4)];
        let join = |(place, order)| Join { place, id: (1, 0, 0), order };
        let orders = Orders { start: 1, joins: Arc::new(joins.map(join).to_vec()) };
        let along: Vec<u32> = [0.0, 0.5, 1.5, 2.0, 2.75, 3.0].map(|place| orders.at(place)).to_vec();
        assert_eq!(along, [1, 2, 2, 3, 3, 4]);
        assert_eq!(orders.end(), 4);
    }
}
