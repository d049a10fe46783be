//! The nodes of the trunk lattice, and the ways on which water falls between them.
//!
//! A node lies anywhere near the middle of its cell. Water falls from it to the lowest of its eight neighbours by a
//! potential; in worlds with continents, chance decides between neighbours that are about as low. A node without a
//! lower neighbour is a sink: in the sea where its potential is below the sea's, otherwise in a hollow of the land.
//!
//! Nodes are made and cached in patches. Code that asks about many nodes uses a [`NodeLook`], which keeps the patches
//! that it read last.

use std::cell::RefCell;
use std::sync::Arc;

use glam::DVec2;

use super::fields::Fields;
use crate::grain_point::{AROUND, Point, chance};
use crate::hash::Draw;
use crate::memory::{Memory, Remembers, heap_bytes};

/// A node of the trunk lattice: column and row.
pub type NodeId = (i64, i64);

/// Potential and id of a node, in the order of heights: the id decides between equal potentials.
pub type Height = (f64, NodeId);

/// Nodes a side of a patch. The nodes of a patch are looked up and cached together.
const PATCH: i64 = 16;

/// Patches a side of the square of patches that a [`NodeLook`] holds: most basins lie within it.
const AT_HAND: i64 = 8;

/// Greatest distance of a node from the middle of its cell along each axis, as a share of the cell's side. Below a
/// quarter, no edges between neighbours can cross, except the two diagonals of a square of nodes.
const JITTER: f64 = 0.24;

/// Greatest share of chance in the heights of nodes of continents, in mean differences of the potential from a node to
/// its neighbours. Without chance, rivers of smooth slopes run side by side, and the main rivers of larger basins are
/// too short: their lengths grow with the 0.50th to 0.55th power of the area. With so much it is the 0.57th to 0.61st,
/// as on Earth (J. T. Hack, Studies of longitudinal stream profiles in Virginia and Maryland, 1957).
const WANDER: f64 = 0.7;

/// Nodes a side of a patch with a node more on each side.
const WIDE: i64 = PATCH + 2;

/// A node before any water flows.
#[derive(Clone, Copy, Debug)]
pub struct TrunkNode {
    /// The place of the node.
    pub at: Point,
    /// Potential at the node.
    pub potential: f64,
    /// Potential by which water flows from node to node, from high to low.
    pub height: f64,
    /// True if the node was in the sea at the lowstand.
    pub sea: bool,
}

heap_bytes!(TrunkNode);

/// A patch of nodes: its column and row.
type NodePatch = (i64, i64);

/// The nodes of a world's trunk lattice.
#[derive(Debug)]
pub struct TrunkNodes {
    seed: u64,
    fields: Arc<Fields>,
    /// True if rivers wander, as [`WANDER`] says.
    is_continental: bool,
    nodes: Memory<NodePatch, Vec<TrunkNode>>,
    /// For the nodes of a patch, the index in `AROUND` of the neighbour to which water falls; its length for a sink.
    falls: Memory<NodePatch, Vec<u8>>,
}

/// A reader of the nodes for code that asks about many of them.
pub struct NodeLook<'a> {
    all: &'a TrunkNodes,
    nodes: Hand<TrunkNode>,
    falls: Hand<u8>,
}

/// A cache of patches in which each patch id has a fixed slot.
struct Hand<T>(RefCell<Vec<Option<Held<T>>>>);

type Held<T> = (NodePatch, Arc<Vec<T>>);

impl<T: Copy> Hand<T> {
    fn new() -> Hand<T> {
        Hand(RefCell::new(Vec::new()))
    }

    /// Returns the value of a node. `get` fetches the node's patch if it is not in the cache.
    fn of(&self, id: NodeId, get: impl FnOnce(NodePatch) -> Arc<Vec<T>>) -> T {
        let patch = (id.0.div_euclid(PATCH), id.1.div_euclid(PATCH));
        let place = (patch.1.rem_euclid(AT_HAND) * AT_HAND + patch.0.rem_euclid(AT_HAND)) as usize;
        let node = (id.1.rem_euclid(PATCH) * PATCH + id.0.rem_euclid(PATCH)) as usize;
        if let Some(Some((own, values))) = self.0.borrow().get(place)
            && *own == patch
        {
            return values[node];
        }
        // No borrow is held here: fetching a patch may ask this cache for others.
        let values = get(patch);
        let value = values[node];
        let mut held = self.0.borrow_mut();
        held.resize((AT_HAND * AT_HAND) as usize, None);
        held[place] = Some((patch, values));
        value
    }
}

/// Returns the ids of the nodes of a patch, row by row.
fn nodes_of((column, row): NodePatch) -> impl Iterator<Item = NodeId> {
    (0..PATCH * PATCH).map(move |n| (column * PATCH + n % PATCH, row * PATCH + n / PATCH))
}

/// Returns the ids of the eight nodes around a node.
pub fn neighbours(id: NodeId) -> impl Iterator<Item = NodeId> {
    AROUND.into_iter().map(move |(dx, dy)| (id.0 + dx, id.1 + dy))
}

impl TrunkNodes {
    /// Makes the nodes of a world with these fields. With `is_continental`, rivers wander.
    pub fn new(fields: Arc<Fields>, is_continental: bool, seed: u64) -> TrunkNodes {
        TrunkNodes { seed, fields, is_continental, nodes: Memory::new(6 << 20), falls: Memory::new(2 << 20) }
    }

    /// Returns the caches of the nodes.
    pub(super) fn memories(&self) -> Vec<&dyn Remembers> {
        vec![&self.nodes, &self.falls]
    }

    /// Returns a reader of the nodes, for code that asks about many of them.
    pub fn look(&self) -> NodeLook<'_> {
        NodeLook { all: self, nodes: Hand::new(), falls: Hand::new() }
    }

    fn make_nodes(&self, patch: NodePatch) -> Vec<TrunkNode> {
        let side = self.fields.side(0);
        let place = |id: NodeId| {
            if let Some(volcano) = self.fields.volcano_at(id) {
                return volcano.middle;
            }
            let offset = |axis| 0.5 + 2.0 * JITTER * (chance(self.seed, id, Draw::Head, axis) - 0.5);
            let corner = Point { x: id.0 * side, y: id.1 * side };
            corner.moved(DVec2::new(offset(0), offset(1)) * side as f64)
        };
        let sea_potential = self.fields.sea_potential();
        let smooth = |(at, potential)| TrunkNode { at, potential, height: potential, sea: potential < sea_potential };
        let all = |ids: &[NodeId]| -> Vec<TrunkNode> {
            let places: Vec<Point> = ids.iter().map(|id| place(*id)).collect();
            places.iter().copied().zip(self.fields.potentials(&places)).map(smooth).collect()
        };
        if !self.is_continental {
            return all(&nodes_of(patch).collect::<Vec<_>>());
        }
        let wide = (0..WIDE * WIDE).map(|n| (patch.0 * PATCH - 1 + n % WIDE, patch.1 * PATCH - 1 + n / WIDE));
        let wide = all(&wide.collect::<Vec<_>>());
        let wandering = |(n, id)| {
            let index = (n / PATCH + 1) * WIDE + n % PATCH + 1;
            let node = wide[index as usize];
            if node.sea {
                return node;
            }
            let differences = AROUND.map(|(dx, dy)| wide[(index + dy * WIDE + dx) as usize].potential - node.potential);
            let mean = differences.iter().map(|difference| difference.abs()).sum::<f64>() / AROUND.len() as f64;
            let off = WANDER * mean * (2.0 * chance(self.seed, id, Draw::Wander, 0) - 1.0);
            // Land beside the sea drains into it.
            let rise = self.fields.volcanic_rise(id, node.at);
            TrunkNode { height: (node.potential + off).max(sea_potential) + rise, ..node }
        };
        (0..).zip(nodes_of(patch)).map(wandering).collect()
    }
}

impl NodeLook<'_> {
    /// Returns the node of an id.
    pub fn node(&self, id: NodeId) -> TrunkNode {
        self.nodes.of(id, |patch| self.all.nodes.get(patch, || self.all.make_nodes(patch)))
    }

    /// Returns the height of a node.
    pub fn height(&self, id: NodeId) -> Height {
        (self.node(id).height, id)
    }

    /// Returns the neighbour to which water falls from a node; `None` for a sink.
    pub fn falls_to(&self, id: NodeId) -> Option<NodeId> {
        let make = |patch| {
            let index = |id: NodeId| {
                let lowest = self.lowest_neighbour(id);
                lowest.and_then(|lowest| neighbours(id).position(|other| other == lowest)).unwrap_or(AROUND.len()) as u8
            };
            self.all.falls.get(patch, || nodes_of(patch).map(index).collect())
        };
        let (dx, dy) = AROUND.get(usize::from(self.falls.of(id, make)))?;
        Some((id.0 + dx, id.1 + dy))
    }

    fn lowest_neighbour(&self, id: NodeId) -> Option<NodeId> {
        // Each node at sea is a sink of its own: no river runs along the sea's floor.
        if self.node(id).sea {
            return None;
        }
        // Ids decide between equal potentials, so water always falls and never comes back.
        let height = |id: NodeId| self.height(id);
        let lowest = neighbours(id).map(height).min_by(|a, b| a.partial_cmp(b).expect("potentials are numbers"))?;
        (lowest < height(id)).then_some(lowest.1)
    }

    /// Returns the sink to which water falls from a node.
    pub fn foot(&self, id: NodeId) -> NodeId {
        // A loop instead of recursion: rivers may be longer than the stack is deep.
        let mut foot = id;
        while let Some(next) = self.falls_to(foot) {
            foot = next;
        }
        foot
    }
}
