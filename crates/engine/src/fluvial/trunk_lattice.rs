//! The trunks: the largest rivers, on a coarse lattice of jittered nodes.
//!
//! A node drains to the lowest of its eight neighbours by a smooth potential. A node without a lower neighbour is a
//! sink: in the sea where its potential is below the sea's, otherwise in an inland basin. In each of a few rounds,
//! every inland basin spills over the lowest pass of its rim into the neighbouring basin, unless that basin spills back
//! and has the higher sink. Basins left after the last round drain into a lake without outlet.
//!
//! Each answer is a pure function of the node: links are followed until they end, and basins are flooded until they are
//! whole. The results are cached: nodes in patches, and basins by their sinks. Code that asks about many nodes uses a
//! [`Look`], which keeps the patches and the basin that it read last.
//!
//! Based on: G. Cordonnier, B. Bovy, J. Braun, A versatile, linear complexity algorithm for flow routing in
//! topographies with depressions, 2019 (basins joined over their passes).

use std::cell::RefCell;
use std::sync::Arc;

use glam::DVec2;

use super::fields::{DryWay, FEW_SHORE_HALVINGS, Fields, SHORE_HALVINGS};
use crate::grain_point::{AROUND, Point, chance};
use crate::hash::Draw;
use crate::memory::{Memory, Remembers, heap_bytes};

/// A node of the trunk lattice: column and row.
pub type NodeId = (i64, i64);

/// Rounds in which inland basins spill into their neighbours. Two rounds leave a few lakes without outlet, as there are
/// on Earth.
const SPILL_ROUNDS: usize = 2;

/// Most nodes of a basin that still spills. The bound makes sure that every flood ends.
const MOST_NODES: usize = 4096;

/// Nodes a side of a patch. The nodes of a patch are looked up and cached together.
const PATCH: i64 = 16;

/// Patches a side of the square of patches that a [`Look`] holds: most basins lie within it.
const AT_HAND: i64 = 8;

/// Greatest distance of a node from the middle of its cell along each axis, as a share of the cell's side. Below a
/// quarter, no edges between neighbours can cross, except the two diagonals of a square of nodes.
const JITTER: f64 = 0.24;

/// Least slope of a bed where larger valleys or the coast keep it low: 40 cm in a kilometre, as large rivers have.
pub(super) const LEAST_SLOPE: f64 = 0.0004;

/// A node before any water flows.
#[derive(Clone, Copy, Debug)]
pub struct TrunkNode {
    /// The place of the node.
    pub at: Point,
    /// Potential of the node: water flows from high to low.
    pub potential: f64,
    /// True if the node was in the sea at the lowstand.
    pub sea: bool,
}

/// All nodes that drain to the same sink, in the order of their ids.
#[derive(Debug)]
pub struct Basin {
    nodes: Vec<(NodeId, Drained)>,
}

/// For each node of a basin, the least potential on its way to the next node, as far as the way is on land.
type Ways = Vec<f64>;

/// A node with the drainage of its basin.
#[derive(Clone, Copy, Debug)]
pub struct Drained {
    /// The next node downstream; `None` for the sink of the basin.
    pub to: Option<NodeId>,
    /// Share of the way to the next node at which it first meets the sea, if it does. The river ends there, though land
    /// may follow.
    pub sea_at: Option<f64>,
    /// The node with the most area of those that drain to this one: the river's own upper course.
    pub main: Option<NodeId>,
    /// Number of cells of the trunk lattice that drain through the node, its own included.
    pub area: u32,
    /// Discharge in cubic metres a second: the water that runs off all these cells.
    pub discharge_m3s: f64,
    /// Height of the valley's floor in metres.
    pub level_m: f64,
    /// True if a lake may lie on the way to the next node, or at the sink.
    pub lake: bool,
}

/// Potential and id of a node, in the order of heights: the id decides between equal potentials.
type Height = (f64, NodeId);

#[derive(Debug)]
struct Spill {
    /// The pass: a node of the basin, and its neighbour beyond the rim. `None` if the basin does not spill.
    pass: Option<(NodeId, NodeId)>,
    /// The nodes from the pass to the sink. Their links turn around if the basin spills.
    path: Vec<NodeId>,
}

heap_bytes!(TrunkNode);
heap_bytes!(Basin: nodes);
heap_bytes!(Drained);
heap_bytes!(Spill: path);

/// A patch of nodes: its column and row.
type NodePatch = (i64, i64);

/// The trunk lattice of a world.
#[derive(Debug)]
pub struct Trunks {
    seed: u64,
    fields: Arc<Fields>,
    /// Number of halvings of a way in the search for the place where it meets the shore.
    halvings: u32,
    nodes: Memory<NodePatch, Vec<TrunkNode>>,
    /// The links of the nodes of a patch after some rounds of spilling: which of its neighbours each node drains to.
    links: Memory<(usize, NodePatch), Vec<u8>>,
    rims: Memory<(usize, NodeId), Spill>,
    spills: Memory<(usize, NodeId), Spill>,
    basins: Memory<NodeId, Basin>,
}

/// A reader of the trunk lattice for code that asks about many nodes: it keeps what it read last.
pub struct Look<'a> {
    trunks: &'a Trunks,
    fields: &'a Fields,
    nodes: Hand<TrunkNode>,
    links: [Hand<u8>; SPILL_ROUNDS + 1],
    basin: RefCell<Option<(NodeId, Arc<Basin>)>>,
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

impl Trunks {
    /// Makes the trunk lattice of a world with these fields. With `is_far`, its cells are too small to be seen, and
    /// shores are found less precisely.
    pub fn new(fields: Arc<Fields>, is_far: bool, seed: u64) -> Trunks {
        Trunks {
            seed,
            fields,
            halvings: if is_far { FEW_SHORE_HALVINGS } else { SHORE_HALVINGS },
            nodes: Memory::new(6 << 20),
            links: Memory::new(2 << 20),
            rims: Memory::new(1 << 20),
            spills: Memory::new(1 << 20),
            basins: Memory::new(11 << 20),
        }
    }

    /// Returns the caches of the lattice.
    pub(super) fn memories(&self) -> Vec<&dyn Remembers> {
        vec![&self.nodes, &self.links, &self.rims, &self.spills, &self.basins]
    }

    /// Returns a reader of the lattice, for code that asks about many nodes.
    pub fn look(&self) -> Look<'_> {
        let links = std::array::from_fn(|_| Hand::new());
        Look { trunks: self, fields: &self.fields, nodes: Hand::new(), links, basin: RefCell::new(None) }
    }

    /// Returns the node of an id.
    pub fn node(&self, id: NodeId) -> TrunkNode {
        self.look().node(id)
    }

    /// Returns a node as its basin drains it.
    pub fn drained(&self, id: NodeId) -> Drained {
        self.look().drained(id)
    }

    fn make_nodes(&self, patch: NodePatch) -> Vec<TrunkNode> {
        let side = self.fields.side(0);
        let place = |id: NodeId| {
            let offset = |axis| 0.5 + 2.0 * JITTER * (chance(self.seed, id, Draw::Head, axis) - 0.5);
            let corner = Point { x: id.0 * side, y: id.1 * side };
            corner.moved(DVec2::new(offset(0), offset(1)) * side as f64)
        };
        let places: Vec<Point> = nodes_of(patch).map(place).collect();
        let node = |(at, potential)| TrunkNode { at, potential, sea: potential < self.fields.sea_potential() };
        places.iter().copied().zip(self.fields.potentials(&places)).map(node).collect()
    }
}

impl Look<'_> {
    /// Returns the node of an id.
    pub fn node(&self, id: NodeId) -> TrunkNode {
        self.nodes.of(id, |patch| self.trunks.nodes.get(patch, || self.trunks.make_nodes(patch)))
    }

    /// Returns a node as its basin drains it.
    pub fn drained(&self, id: NodeId) -> Drained {
        let sink = self.root(SPILL_ROUNDS, id);
        if let Some((own, basin)) = &*self.basin.borrow()
            && *own == sink
        {
            return basin.nodes[basin.place(id)].1;
        }
        let basin = self.trunks.basins.get(sink, || self.basin(sink));
        let drained = basin.nodes[basin.place(id)].1;
        *self.basin.borrow_mut() = Some((sink, basin));
        drained
    }

    /// Returns the next node downstream after some rounds of spilling.
    fn receiver(&self, rounds: usize, id: NodeId) -> Option<NodeId> {
        let get = |patch| self.trunks.links.get((rounds, patch), || self.links(rounds, patch));
        let (dx, dy) = AROUND.get(usize::from(self.links[rounds].of(id, get)))?;
        Some((id.0 + dx, id.1 + dy))
    }

    /// Makes the links of the nodes of a patch: the neighbour's index in `AROUND`, or its length for a sink.
    fn links(&self, rounds: usize, patch: NodePatch) -> Vec<u8> {
        let link = |id: NodeId, to: Option<NodeId>| {
            let place = to.and_then(|to| neighbours(id).position(|other| other == to));
            place.unwrap_or(AROUND.len()) as u8
        };
        if rounds == 0 {
            return nodes_of(patch).map(|id| link(id, self.lowest_neighbour(id))).collect();
        }
        // From here on only earlier rounds are read: a cache must not be asked for the entry that it is computing.
        let before = rounds - 1;
        let mut last: Option<(NodeId, Arc<Spill>)> = None;
        let spilt = |id: NodeId| {
            let sink = self.root(before, id);
            let spill = match last.take().filter(|(own, _)| *own == sink) {
                Some((_, spill)) => spill,
                None => self.spill(before, sink),
            };
            // On the path from the pass to the sink the links turn around; at the pass the water leaves the basin.
            let to = match spill.path.iter().position(|node| *node == id) {
                Some(0) => spill.pass.map(|(_, beyond)| beyond),
                Some(place) => Some(spill.path[place - 1]),
                None => self.receiver(before, id),
            };
            last = Some((sink, spill));
            link(id, to)
        };
        nodes_of(patch).map(spilt).collect()
    }

    fn lowest_neighbour(&self, id: NodeId) -> Option<NodeId> {
        let here = self.node(id);
        // Each node at sea is a sink of its own: no river runs along the sea's floor.
        if here.sea {
            return None;
        }
        let height = |id: NodeId| (self.node(id).potential, id);
        // Ids decide between equal potentials, so links always lead down and never form a cycle.
        let lowest = neighbours(id).map(height).min_by(|a, b| a.partial_cmp(b).expect("potentials are numbers"))?;
        (lowest < (here.potential, id)).then_some(lowest.1)
    }

    /// Returns the sink to which a node drains after some rounds of spilling.
    fn root(&self, rounds: usize, id: NodeId) -> NodeId {
        // A loop instead of recursion: rivers may be longer than the stack is deep.
        let mut root = id;
        while let Some(next) = self.receiver(rounds, root) {
            root = next;
        }
        root
    }

    /// Returns all nodes that drain to a sink after some rounds of spilling, each after the node that it drains to.
    fn flood(&self, rounds: usize, sink: NodeId) -> Vec<NodeId> {
        let mut nodes = vec![sink];
        let mut next = 0;
        while next < nodes.len() {
            let id = nodes[next];
            next += 1;
            // Links only lead downstream, so each neighbour is asked if its link leads here.
            nodes.extend(neighbours(id).filter(|other| self.receiver(rounds, *other) == Some(id)));
        }
        nodes
    }

    /// Returns the lowest pass of a basin's rim, and the path from the pass to the sink.
    fn rim(&self, rounds: usize, sink: NodeId) -> Arc<Spill> {
        self.trunks.rims.get((rounds, sink), || {
            let nodes = self.flood(rounds, sink);
            if nodes.len() > MOST_NODES || self.node(sink).sea {
                return Spill { pass: None, path: Vec::new() };
            }
            let height = |id: NodeId| (self.node(id).potential, id);
            let mut inside = nodes.clone();
            inside.sort_unstable();
            // The lowest edge out of the basin, compared by its higher end and then by its lower end.
            let mut lowest: Option<(Height, Height, NodeId, NodeId)> = None;
            for &id in &nodes {
                for other in neighbours(id) {
                    if inside.binary_search(&other).is_ok() || self.is_crossed(rounds, id, other) {
                        continue;
                    }
                    let (a, b) = (height(id), height(other));
                    // An edge has the same height from both sides, so both basins agree on it. Heights contain ids: no
                    // two edges are equal, and the order of the nodes does not matter.
                    let (high, low) = if a < b { (b, a) } else { (a, b) };
                    if lowest.is_none_or(|least| (high, low) < (least.0, least.1)) {
                        lowest = Some((high, low, id, other));
                    }
                }
            }
            let Some((_, _, pass, beyond)) = lowest else { return Spill { pass: None, path: Vec::new() } };
            let mut path = vec![pass];
            while let Some(next) = self.receiver(rounds, path[path.len() - 1]) {
                path.push(next);
            }
            Spill { pass: Some((pass, beyond)), path }
        })
    }

    /// True if an edge between two diagonal neighbours would cross water that flows along the other diagonal of their
    /// square.
    fn is_crossed(&self, rounds: usize, a: NodeId, b: NodeId) -> bool {
        // No edge crosses one along an axis: nodes stand less than a quarter of a cell off its middle.
        if a.0 == b.0 || a.1 == b.1 {
            return false;
        }
        let (c, d) = ((a.0, b.1), (b.0, a.1));
        self.receiver(rounds, c) == Some(d) || self.receiver(rounds, d) == Some(c)
    }

    /// Returns the pass and path of a basin if it spills. It does not if the basin beyond spills back and has the
    /// higher sink.
    fn spill(&self, rounds: usize, sink: NodeId) -> Arc<Spill> {
        self.trunks.spills.get((rounds, sink), || {
            let none = Spill { pass: None, path: Vec::new() };
            let rim = self.rim(rounds, sink);
            let Some((pass, beyond)) = rim.pass else { return none };
            // Two basins that spill into each other would form a cycle, so the one with the lower sink keeps its water.
            // Longer cycles cannot form: each basin's pass would have to be lower than that of the basin before it, all
            // around.
            let target = self.root(rounds, beyond);
            let back = self.rim(rounds, target).pass.map(|(_, beyond)| self.root(rounds, beyond));
            let height = |id: NodeId| (self.node(id).potential, id);
            if back == Some(sink) && height(sink) < height(target) {
                return none;
            }
            Spill { pass: Some((pass, beyond)), path: rim.path.clone() }
        })
    }

    /// True if a node may have a lake: in a hollow of the land, or by chance.
    fn lake(&self, id: NodeId) -> bool {
        let (node, hollow) = (self.node(id), self.lowest_neighbour(id).is_none());
        let luck = chance(self.trunks.seed, id, Draw::Choice, 0);
        let has_lake = || luck < self.fields.most_laws().lakes && luck < self.fields.laws(node.at).lakes;
        !node.sea && (hollow || has_lake())
    }

    /// Makes the basin of a sink: all its nodes with their areas and levels.
    fn basin(&self, sink: NodeId) -> Basin {
        let flood = self.flood(SPILL_ROUNDS, sink);
        // Sorted by id for binary search. The flood keeps the order in which water runs.
        let mut ids = flood.clone();
        ids.sort_unstable();
        let (mut basin, mut ways) = (Basin { nodes: Vec::with_capacity(ids.len()) }, Ways::with_capacity(ids.len()));
        for id in ids {
            let to = if id == sink { None } else { self.receiver(SPILL_ROUNDS, id) };
            let DryWay { sea_at, least } =
                to.map_or(DryWay { sea_at: None, least: f64::INFINITY }, |to| self.way(id, to));
            let drained =
                Drained { to, sea_at, main: None, area: 1, discharge_m3s: 0.0, level_m: 0.0, lake: self.lake(id) };
            basin.nodes.push((id, drained));
            ways.push(least);
        }
        let runoff_m3s: Vec<f64> = basin
            .nodes
            .iter()
            .map(|(id, _)| self.fields.laws(self.node(*id).at).discharge_m3s(self.fields, 1.0))
            .collect();
        basin.add_areas(&flood, &runoff_m3s);
        let flood = self.part_confluences(sink, &mut basin, &mut ways);
        basin.add_areas(&flood, &runoff_m3s);
        self.set_levels(&flood, &ways, &mut basin);
        basin
    }

    /// Examines the straight way from a node on land to another node.
    fn way(&self, id: NodeId, to: NodeId) -> DryWay {
        let there = self.node(to);
        self.fields.dry_way([self.node(id).at, there.at], || there.potential, self.trunks.halvings)
    }

    /// Makes sure that no two nodes side by side drain to the same third node: the one with less area drains to the
    /// other.
    ///
    /// Where the land falls to one node from all sides, up to seven rivers would meet there, and their valleys would
    /// form a star; real rivers join one after the other. Returns the nodes in the order of a flood from the sink
    /// upstream.
    fn part_confluences(&self, sink: NodeId, basin: &mut Basin, ways: &mut Ways) -> Vec<NodeId> {
        let mut inflows: Vec<Vec<usize>> = vec![Vec::new(); basin.nodes.len()];
        for (place, (_, drained)) in basin.nodes.iter().enumerate() {
            if let Some(to) = drained.to {
                inflows[basin.place(to)].push(place);
            }
        }
        let mut flood = vec![basin.place(sink)];
        let mut next = 0;
        while next < flood.len() {
            let here = flood[next];
            next += 1;
            let mut coming = std::mem::take(&mut inflows[here]);
            coming.sort_unstable_by_key(|place| std::cmp::Reverse((basin.nodes[*place].1.area, *place)));
            let first = flood.len();
            for place in coming {
                let id = basin.nodes[place].0;
                // Not across an arm of the sea. Only neighbours along an axis count as side by side: no other way
                // crosses between them.
                let larger = flood[first..].iter().copied().find_map(|larger| {
                    let other = basin.nodes[larger].0;
                    let beside = (id.0 - other.0).abs() + (id.1 - other.1).abs() == 1;
                    let way = beside.then(|| self.way(id, other)).filter(|way| way.sea_at.is_none());
                    way.map(|way| (larger, way.least))
                });
                match larger {
                    Some((larger, least)) => {
                        let to = Some(basin.nodes[larger].0);
                        let drained = &mut basin.nodes[place].1;
                        (drained.to, drained.sea_at) = (to, None);
                        ways[place] = least;
                        inflows[larger].push(place);
                    }
                    None => flood.push(place),
                }
            }
        }
        flood.into_iter().map(|place| basin.nodes[place].0).collect()
    }

    /// Returns for each node of a basin the largest height in metres that it may have beside the coast. A river never
    /// rises, so a node's limit also holds for all nodes downstream.
    fn below_coast_m(&self, flood: &[NodeId], ways: &Ways, basin: &Basin) -> Vec<f64> {
        let below_m = |potential: f64| self.fields.below_coast_of_m(potential, self.fields.lowstand_level_m());
        let mut most_m: Vec<f64> = basin.nodes.iter().map(|(id, _)| below_m(self.node(*id).potential)).collect();
        // From the springs down: the reverse of the flood.
        for id in flood.iter().rev().filter(|_| self.fields.has_sea()) {
            let here = basin.place(*id);
            // A river that ends in the sea hands nothing on. Both ends of a way are nodes, whose heights are known
            // already.
            let Drained { to: Some(to), sea_at: None, .. } = basin.nodes[here].1 else { continue };
            let there = basin.place(to);
            most_m[there] = most_m[there].min(most_m[here]).min(below_m(ways[here]));
        }
        most_m
    }

    /// Sets the levels of a basin's nodes from the sink up: by the slope of rivers, but no higher than the coast
    /// permits.
    fn set_levels(&self, flood: &[NodeId], ways: &Ways, basin: &mut Basin) {
        let most_m = self.below_coast_m(flood, ways, basin);
        for id in flood {
            let here = basin.place(*id);
            let (node, Drained { to, sea_at, area, .. }) = (self.node(*id), basin.nodes[here].1);
            // The flood begins at the sink, so the node downstream has its level already.
            let Some(to) = to else {
                basin.nodes[here].1.level_m = self.fields.sink_level_m(node.sea);
                continue;
            };
            // The river ends where the way meets the sea.
            let (below_m, dry) = match sea_at {
                Some(dry) => (self.fields.lowstand_level_m(), dry),
                None => (basin.nodes[basin.place(to)].1.level_m, 1.0),
            };
            let length_m = node.at.distance(self.node(to).at) * dry * self.fields.metres_a_grain();
            let slope = self.fields.laws(node.at).river_slope(area as f64);
            let free_m = below_m + length_m * slope;
            let drained = &mut basin.nodes[here].1;
            // The least fall is applied last, since a falling river matters more than a bed below the coast. The fall
            // is never steeper than the law of rivers makes it.
            drained.level_m = free_m.min(most_m[here]).max(below_m + length_m * slope.min(LEAST_SLOPE));
            if most_m[here] < free_m || drained.level_m < self.fields.lowest_lake_m() {
                // The land falls away towards the sea, or the sea has come in.
                drained.lake = false;
            }
        }
    }
}

impl Basin {
    /// Returns the index of a node in the basin.
    fn place(&self, id: NodeId) -> usize {
        self.nodes.binary_search_by_key(&id, |(id, _)| *id).expect("a basin holds what drains to its sink")
    }

    /// Adds up the areas, and what runs off them, from the springs down, which is the reverse of the flood. The inflow
    /// with the most area is a node's main river; the id decides between equal ones. `runoff_m3s` is that of each
    /// node's own cell.
    fn add_areas(&mut self, flood: &[NodeId], runoff_m3s: &[f64]) {
        for ((_, drained), runoff_m3s) in self.nodes.iter_mut().zip(runoff_m3s) {
            (drained.area, drained.discharge_m3s, drained.main) = (1, *runoff_m3s, None);
        }
        for id in flood.iter().rev() {
            let here = self.nodes[self.place(*id)].1;
            // A river that ends in the sea does not reach the next node.
            let Some(to) = here.to.filter(|_| here.sea_at.is_none()) else { continue };
            let to = self.place(to);
            self.nodes[to].1.area += here.area;
            self.nodes[to].1.discharge_m3s += here.discharge_m3s;
            // Each node receives all its inflows before its own area is handed on, so compared areas are complete.
            let larger = self.nodes[to].1.main.is_none_or(|main| {
                let main_area = self.nodes[self.place(main)].1.area;
                (here.area, *id) > (main_area, main)
            });
            if larger {
                self.nodes[to].1.main = Some(*id);
            }
        }
    }
}

/// Returns the ids of the eight nodes around a node.
pub(super) fn neighbours(id: NodeId) -> impl Iterator<Item = NodeId> {
    AROUND.into_iter().map(move |(dx, dy)| (id.0 + dx, id.1 + dy))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn as_much_water_flows_through_a_node_as_runs_off_the_cells_above_it() {
        let mut largest = 0;
        for name in ["alps", "archipelago"] {
            let fields = Arc::new(Fields::of_preset(name, 3, |_| {}));
            let trunks = Trunks::new(Arc::clone(&fields), false, 3);
            let look = trunks.look();
            for id in (0..32 * 32).map(|n| (n % 32, n / 32)) {
                let drained = look.drained(id);
                // All cells of one land have the same runoff.
                let expected_m3s = fields.most_laws().discharge_m3s(&fields, f64::from(drained.area));
                let off = (drained.discharge_m3s / expected_m3s - 1.0).abs();
                assert!(off < 1e-12, "{name}: {id:?} has {} m3/s and not {expected_m3s}", drained.discharge_m3s);
                largest = largest.max(drained.area);
            }
        }
        assert!(largest > 20, "the largest river drains {largest} cells");
    }

    /// If nodes side by side drained to the same node, their valleys would form a fan of as many as seven.
    #[test]
    fn nodes_side_by_side_drain_to_one_only_across_the_sea() {
        for name in ["alps", "highlands", "archipelago"] {
            let fields = Arc::new(Fields::of_preset(name, 3, |_| {}));
            let trunks = Trunks::new(Arc::clone(&fields), false, 3);
            let mut pairs = 0;
            for id in (0..32 * 32).map(|n| (n % 32, n / 32)).filter(|id| !trunks.node(*id).sea) {
                let to = trunks.drained(id).to;
                for beside in [(id.0 + 1, id.1), (id.0, id.1 + 1)].into_iter().filter(|id| !trunks.node(*id).sea) {
                    pairs += 1;
                    if to.is_some() && trunks.drained(beside).to == to {
                        let dry = fields.dry_share(trunks.node(id).at, trunks.node(beside).at).is_none();
                        assert!(!dry, "{name}: {id:?} and {beside:?} both drain to {to:?}");
                    }
                }
            }
            assert!(pairs > 100, "{name}: {pairs} pairs on land");
        }
    }
}
