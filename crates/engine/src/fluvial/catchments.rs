//! Catchments: the land that drains to a sink, before and after closed basins spill over.
//!
//! At first a catchment is the land from which water falls to its sink. In each round, every catchment with a sink on
//! land spills over the lowest pass of its rim into the neighbouring one, like a lake that has filled up, unless that
//! one spills back and has the higher sink. Catchments that have spilt into each other are one in the next round. A
//! catchment that has come to the sea or is large spills no more, nor does one that keeps its water where it is dry.
//!
//! The lowest pass out of any set of nodes belongs to the minimum spanning tree of the lattice, whose edges are compared
//! by their higher ends, and so does the way on which water falls from a node. So all ways and passes together form no
//! cycle. None of them cross: of two crossing diagonals, the one without the lowest of the four nodes is the highest
//! edge of a triangle with this node.
//!
//! Based on: G. Cordonnier, B. Bovy, J. Braun, A versatile, linear complexity algorithm for flow routing in
//! topographies with depressions, 2019 (basins joined over their passes); O. Borůvka, 1926 (in rounds).

use std::sync::Arc;

use super::fields::Fields;
use super::trunk_nodes::{Height, NodeId, NodeLook, neighbours};
use crate::memory::{Memory, Remembers, heap_bytes};

/// Number of rounds of worlds without continents. Two leave a few lakes without outlet, as there are on Earth.
const FEW_ROUNDS: u32 = 2;

/// Largest number of nodes of a catchment that still spills. The bound makes sure that every search ends; with nodes
/// 15 km apart it is twice the basin of the Amazon.
const MOST_NODES: usize = 1 << 16;

/// Least number of nodes of a catchment that keeps its water where it is dry: smaller ones spill over in the rare years
/// with much rain. Nodes 15 km apart make it 7,000 square kilometres, as basins between ranges have.
const LEAST_DRY: usize = 32;

/// The land that drains to a sink after some rounds of spilling.
#[derive(Debug)]
pub struct Catchment {
    /// Number of nodes.
    size: usize,
    /// True if it spills in no further round, as it is large or keeps its water where it is dry.
    is_settled: bool,
    /// The passes over which its parts have spilt.
    passes: Vec<Pass>,
    /// The catchments around this one, by their sinks, each with the lowest pass to it; the lowest of all passes first.
    rim: Vec<(Pass, NodeId)>,
}

/// An edge of the lattice from a catchment to another, by the heights of its ends.
#[derive(Clone, Copy, Debug)]
struct Pass {
    from: Height,
    to: Height,
}

/// Number of nodes of a catchment, its passes, and passes to the catchments around it, several to each.
type Joined = (usize, Vec<Pass>, Vec<(Pass, NodeId)>);

heap_bytes!(Pass);
heap_bytes!(Catchment: passes, rim);

/// The catchments of a world.
#[derive(Debug)]
pub struct Catchments {
    /// Number of rounds after which nothing spills.
    rounds: u32,
    fields: Arc<Fields>,
    /// The catchments of sinks after some rounds.
    all: Memory<(u32, NodeId), Catchment>,
    /// The sinks after all rounds, by those before the first.
    sinks: Memory<NodeId, NodeId>,
}

impl Pass {
    /// Returns the heights by which passes are compared. They contain ids, so no two passes are equal, and they are the
    /// same from both sides.
    fn order(&self) -> [Height; 2] {
        if self.from < self.to { [self.to, self.from] } else { [self.from, self.to] }
    }

    /// Returns the pass from its other side.
    fn back(self) -> Pass {
        Pass { from: self.to, to: self.from }
    }
}

/// Keeps the lowest pass to each catchment.
fn rim(mut passes: Vec<(Pass, NodeId)>) -> Vec<(Pass, NodeId)> {
    let order = |a: &Pass, b: &Pass| a.order().partial_cmp(&b.order()).expect("potentials are numbers");
    passes.sort_unstable_by(|(a, to), (b, other)| to.cmp(other).then_with(|| order(a, b)));
    passes.dedup_by_key(|(_, to)| *to);
    passes.sort_unstable_by(|(a, _), (b, _)| order(a, b));
    passes
}

impl Catchments {
    /// Makes the catchments of a world with these fields. With `is_continental`, they spill until none is closed that
    /// could spill.
    pub fn new(fields: Arc<Fields>, is_continental: bool) -> Catchments {
        let rounds = if is_continental { u32::MAX } else { FEW_ROUNDS };
        Catchments { rounds, fields, all: Memory::new(6 << 20), sinks: Memory::new(1 << 20) }
    }

    /// Returns the caches of the catchments.
    pub(super) fn memories(&self) -> Vec<&dyn Remembers> {
        vec![&self.all, &self.sinks]
    }

    /// Returns the sink to which a node drains after all rounds.
    pub fn sink(&self, nodes: &NodeLook, id: NodeId) -> NodeId {
        let first = nodes.foot(id);
        let find = || {
            let (mut sink, mut round) = (first, 0);
            while !self.is_settled(nodes, round, sink) {
                sink = self.sink_after(nodes, round, sink);
                round += 1;
            }
            sink
        };
        *self.sinks.get(first, find)
    }

    /// Returns the nodes that drain to a sink after all rounds, each after the node to which it drains, and with this
    /// node.
    pub fn flood(&self, nodes: &NodeLook, sink: NodeId) -> Vec<(NodeId, Option<NodeId>)> {
        let mut round = 0;
        let mut whole = self.at(nodes, round, sink);
        while !whole.rim.iter().all(|(_, other)| self.is_settled(nodes, round, *other)) {
            round += 1;
            whole = self.at(nodes, round, sink);
        }
        let both = whole.passes.iter().flat_map(|pass| [*pass, pass.back()]);
        let mut passes: Vec<(NodeId, NodeId)> = both.map(|pass| (pass.from.1, pass.to.1)).collect();
        passes.sort_unstable();
        // The ways on which water falls and the passes are a tree. Upstream is away from the sink on all of them.
        let mut flood = Vec::with_capacity(whole.size);
        flood.push((sink, None));
        let mut next = 0;
        while next < flood.len() {
            let (id, to) = flood[next];
            next += 1;
            let over = &passes[passes.partition_point(|(from, _)| *from < id)..];
            let over = over.iter().take_while(|(from, _)| *from == id).map(|(_, other)| *other);
            let falling = neighbours(id).filter(|other| nodes.falls_to(*other) == Some(id));
            let upstream = falling.chain(nodes.falls_to(id)).chain(over).filter(|other| Some(*other) != to);
            flood.extend(upstream.map(|other| (other, Some(id))));
        }
        flood
    }

    /// True if a catchment spills in no further round.
    fn is_settled(&self, nodes: &NodeLook, round: u32, sink: NodeId) -> bool {
        nodes.node(sink).sea || round >= self.rounds || self.at(nodes, round, sink).is_settled
    }

    /// Returns the pass over which a catchment spills in a round, and the catchment beyond; `None` if it keeps its
    /// water.
    fn spill(&self, nodes: &NodeLook, round: u32, sink: NodeId) -> Option<(Pass, NodeId)> {
        let lowest = |sink| match self.is_settled(nodes, round, sink) {
            true => None,
            false => self.at(nodes, round, sink).rim.first().copied(),
        };
        let (pass, to) = lowest(sink)?;
        // Two catchments that spill into each other would form a cycle, so the one with the lower sink keeps its water.
        // Longer cycles cannot form: each catchment's pass would have to be lower than that of the one before it, all
        // around.
        let comes_back = lowest(to).is_some_and(|(_, back)| back == sink);
        (!comes_back || nodes.height(to) < nodes.height(sink)).then_some((pass, to))
    }

    /// Returns the sink to which the catchment of a sink belongs after a further round.
    fn sink_after(&self, nodes: &NodeLook, round: u32, sink: NodeId) -> NodeId {
        let mut last = sink;
        while let Some((_, to)) = self.spill(nodes, round, last) {
            last = to;
        }
        last
    }

    /// Returns the catchment of a sink after some rounds.
    fn at(&self, nodes: &NodeLook, rounds: u32, sink: NodeId) -> Arc<Catchment> {
        self.all.get((rounds, sink), || {
            let (size, passes, around) = match rounds.checked_sub(1) {
                None => first(nodes, sink),
                // Only earlier rounds are read here: a cache must not be asked for the entry that it is computing.
                Some(before) => self.joined(nodes, before, sink),
            };
            // The place is asked only once for each catchment, since its climate takes time.
            let keeps_water = || !nodes.node(sink).sea && self.fields.keeps_water(nodes.node(sink).at);
            let is_settled = size > MOST_NODES || (size >= LEAST_DRY && keeps_water());
            Catchment { size, is_settled, passes, rim: rim(around) }
        })
    }

    /// Joins the catchments that spill into that of a sink in a round.
    fn joined(&self, nodes: &NodeLook, round: u32, sink: NodeId) -> Joined {
        let (mut size, mut passes, mut around) = (0, Vec::new(), Vec::new());
        let mut parts = vec![sink];
        while let Some(part) = parts.pop() {
            let own = self.at(nodes, round, part);
            size += own.size;
            passes.extend_from_slice(&own.passes);
            for (pass, other) in &own.rim {
                match self.spill(nodes, round, *other) {
                    Some((_, to)) if to == part => {
                        passes.push(*pass);
                        parts.push(*other);
                    }
                    _ => around.push((*pass, self.sink_after(nodes, round, *other))),
                }
            }
        }
        around.retain(|(_, other)| *other != sink);
        (size, passes, around)
    }
}

/// Returns the land from which water falls to a sink.
fn first(nodes: &NodeLook, sink: NodeId) -> Joined {
    let mut inside = vec![sink];
    let mut next = 0;
    while next < inside.len() {
        let id = inside[next];
        next += 1;
        // Water only falls, so each neighbour is asked if it falls here.
        inside.extend(neighbours(id).filter(|other| nodes.falls_to(*other) == Some(id)));
    }
    let size = inside.len();
    inside.sort_unstable();
    let mut around = Vec::new();
    for id in &inside {
        for other in neighbours(*id).filter(|other| inside.binary_search(other).is_err()) {
            around.push((Pass { from: nodes.height(*id), to: nodes.height(other) }, nodes.foot(other)));
        }
    }
    (size, Vec::new(), around)
}
