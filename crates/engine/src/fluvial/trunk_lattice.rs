//! The trunks: the largest rivers, on a coarse lattice of jittered nodes.
//!
//! A trunk leads from a node to the next, by the [catchments](super::catchments): down the potential, and over the
//! passes of closed basins that spill. A basin is all that drains to one sink in the end. Those that spill nowhere drain
//! into a lake without outlet.
//!
//! Each answer is a pure function of the node: ways are followed until they end, and basins are flooded until they are
//! whole. Basins are cached by their sinks. Code that asks about many nodes uses a [`Look`], which keeps the basin that
//! it read last.

use std::cell::RefCell;
use std::sync::Arc;

use super::catchments::Catchments;
use super::fields::{DryWay, FEW_SHORE_HALVINGS, Fields, SHORE_HALVINGS};
pub use super::trunk_nodes::{NodeId, TrunkNode, neighbours};
use super::trunk_nodes::{NodeLook, TrunkNodes};
use crate::grain_point::chance;
use crate::hash::Draw;
use crate::memory::{Memory, Remembers, heap_bytes};

/// Least slope of a bed where larger valleys or the coast keep it low: 40 cm in a kilometre, as large rivers have.
pub(super) const LEAST_SLOPE: f64 = 0.0004;

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

heap_bytes!(Basin: nodes);
heap_bytes!(Drained);

/// The trunk lattice of a world.
#[derive(Debug)]
pub struct Trunks {
    seed: u64,
    fields: Arc<Fields>,
    /// Number of halvings of a way in the search for the place where it meets the shore.
    halvings: u32,
    nodes: TrunkNodes,
    catchments: Catchments,
    basins: Memory<NodeId, Basin>,
}

/// A reader of the trunk lattice for code that asks about many nodes: it keeps what it read last.
pub struct Look<'a> {
    trunks: &'a Trunks,
    fields: &'a Fields,
    nodes: NodeLook<'a>,
    basin: RefCell<Option<Arc<Basin>>>,
}

impl Trunks {
    /// Makes the trunk lattice of a world with these fields. With `is_far`, its cells are too small to be seen, and
    /// shores are found less precisely.
    pub fn new(fields: Arc<Fields>, is_far: bool, seed: u64) -> Trunks {
        Trunks {
            seed,
            halvings: if is_far { FEW_SHORE_HALVINGS } else { SHORE_HALVINGS },
            nodes: TrunkNodes::new(Arc::clone(&fields), seed),
            catchments: Catchments::new(Arc::clone(&fields)),
            basins: Memory::new(11 << 20),
            fields,
        }
    }

    /// Returns the caches of the lattice.
    pub(super) fn memories(&self) -> Vec<&dyn Remembers> {
        [self.nodes.memories(), self.catchments.memories(), vec![&self.basins]].concat()
    }

    /// Returns a reader of the lattice, for code that asks about many nodes.
    pub fn look(&self) -> Look<'_> {
        Look { trunks: self, fields: &self.fields, nodes: self.nodes.look(), basin: RefCell::new(None) }
    }

    /// Returns the node of an id.
    pub fn node(&self, id: NodeId) -> TrunkNode {
        self.look().node(id)
    }

    /// Returns a node as its basin drains it.
    pub fn drained(&self, id: NodeId) -> Drained {
        self.look().drained(id)
    }
}

impl Look<'_> {
    /// Returns the node of an id.
    pub fn node(&self, id: NodeId) -> TrunkNode {
        self.nodes.node(id)
    }

    /// Returns a node as its basin drains it.
    pub fn drained(&self, id: NodeId) -> Drained {
        let held = self.basin.borrow().as_ref().and_then(|basin| basin.find(id).map(|place| basin.nodes[place].1));
        held.unwrap_or_else(|| {
            let sink = self.trunks.catchments.sink(&self.nodes, id);
            let basin = self.trunks.basins.get(sink, || self.basin(sink));
            let drained = basin.nodes[basin.place(id)].1;
            *self.basin.borrow_mut() = Some(basin);
            drained
        })
    }

    /// True if a node may have a lake: in a hollow of the land, or by chance.
    fn lake(&self, id: NodeId) -> bool {
        let (node, hollow) = (self.node(id), self.nodes.falls_to(id).is_none());
        let luck = chance(self.trunks.seed, id, Draw::Choice, 0);
        let has_lake = || luck < self.fields.most_laws().lakes && luck < self.fields.laws(node.at).lakes;
        !node.sea && (hollow || has_lake())
    }

    /// Makes the basin of a sink: all its nodes with their areas and levels.
    fn basin(&self, sink: NodeId) -> Basin {
        let flood = self.trunks.catchments.flood(&self.nodes, sink);
        // Sorted by id for binary search. The flood keeps the order in which water runs.
        let mut ways_down = flood.clone();
        ways_down.sort_unstable();
        let flood: Vec<NodeId> = flood.into_iter().map(|(id, _)| id).collect();
        let (mut basin, mut ways) =
            (Basin { nodes: Vec::with_capacity(flood.len()) }, Ways::with_capacity(flood.len()));
        for (id, to) in ways_down {
            let DryWay { sea_at, least } =
                to.map_or(DryWay { sea_at: None, least: f64::INFINITY }, |to| self.way(id, to));
            let lake = self.lake(id);
            let drained = Drained { to, sea_at, main: None, area: 1, discharge_m3s: 0.0, level_m: 0.0, lake };
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
    /// Returns the index of a node, if it is in the basin.
    fn find(&self, id: NodeId) -> Option<usize> {
        self.nodes.binary_search_by_key(&id, |(id, _)| *id).ok()
    }

    /// Returns the index of a node of the basin.
    fn place(&self, id: NodeId) -> usize {
        self.find(id).expect("a basin holds what drains to its sink")
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

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::{BTreeMap, BTreeSet};
    use std::time::Instant;

    /// Makes the trunks of a world of continents, whose closed basins spill until none is left.
    fn continental(basin_m: f64, octaves: u32, below: f64, seed: u64) -> Trunks {
        let (_, preset) = crate::preset::Preset::load("alps").unwrap();
        let mut settings = preset.fluvial.unwrap();
        settings.basin_m = Some(basin_m);
        (settings.coast.octaves, settings.coast.below) = (octaves, below);
        let fields = Arc::new(Fields::new(&settings, None, preset.spacing_m, Some(0.0), seed));
        let mut trunks = Trunks::new(fields, false, seed);
        trunks.catchments.rounds = u32::MAX;
        trunks
    }

    /// Prints the figures by which rivers of continents are compared with those of Earth: their length, the exponent of
    /// Hack's law (.54 to .62), closed basins, and the time that basins take.
    #[test]
    #[ignore = "prints figures and asserts nothing"]
    fn figures_of_continents() {
        for (basin_m, octaves, rounds) in [
            (600e3, 6, 2),
            (600e3, 6, u32::MAX),
            (3000e3, 2, u32::MAX),
            (3000e3, 6, 2),
            (3000e3, 6, u32::MAX),
            (3000e3, 8, u32::MAX),
        ] {
            for seed in 1..=2 {
                let mut trunks = continental(basin_m, octaves, -0.05, seed);
                trunks.catchments.rounds = rounds;
                let side: i64 = 256;
                let cell_km2 = (trunks.fields.side(0) as f64 * trunks.fields.metres_a_grain() / 1000.0).powi(2);
                let look = trunks.look();
                let ids = || (0..side * side).map(|n| (n % side, n / side));
                let start = Instant::now();
                let land: Vec<NodeId> = ids().filter(|id| !look.node(*id).sea).collect();
                let nodes_s = start.elapsed().as_secs_f64();
                let start = Instant::now();
                let feet: BTreeSet<NodeId> = land.iter().map(|id| look.nodes.foot(*id)).collect();
                let falls_s = start.elapsed().as_secs_f64();
                let start = Instant::now();
                let sinks: Vec<NodeId> = land.iter().map(|id| trunks.catchments.sink(&look.nodes, *id)).collect();
                let sinks_s = start.elapsed().as_secs_f64();
                let mut of: BTreeMap<NodeId, u32> = BTreeMap::new();
                sinks.iter().for_each(|sink| *of.entry(*sink).or_default() += 1);
                let start = Instant::now();
                for sink in of.keys() {
                    trunks.catchments.flood(&look.nodes, *sink);
                }
                let flood_s = start.elapsed().as_secs_f64();
                let start = Instant::now();
                let basins: Vec<(NodeId, Basin)> = of.keys().map(|sink| (*sink, look.basin(*sink))).collect();
                let basins_s = start.elapsed().as_secs_f64();
                let closed: Vec<&NodeId> = of.keys().filter(|sink| !look.node(**sink).sea).collect();
                let dry: u32 = closed.iter().map(|sink| of[sink]).sum();
                let hollows = feet.iter().filter(|id| !look.node(**id).sea).count();
                let (mut longest_km, mut largest, mut all) = (0.0f64, 0, 0);
                // Sums for the fits over all nodes, and over mouths.
                let mut fits = [[0.0f64; 5]; 2];
                for (_, basin) in &basins {
                    all += basin.nodes.len();
                    let mut order: Vec<usize> = (0..basin.nodes.len()).collect();
                    order.sort_by_key(|n| basin.nodes[*n].1.area);
                    let mut km = vec![0.0f64; order.len()];
                    for n in order {
                        let (id, drained) = basin.nodes[n];
                        let area_km2 = f64::from(drained.area) * cell_km2;
                        let mut add = |fit: usize| {
                            let (x, y) = (area_km2.ln(), km[n].ln());
                            let terms = [1.0, x, y, x * x, x * y];
                            fits[fit].iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
                        };
                        let counts = drained.area >= 4 && area_km2 < 1.2e6;
                        let ends = drained.to.is_none() || drained.sea_at.is_some();
                        if counts {
                            add(0);
                        }
                        if counts && ends {
                            add(1);
                        }
                        largest = largest.max(drained.area);
                        longest_km = longest_km.max(km[n]);
                        if let Some(to) = drained.to.filter(|_| drained.sea_at.is_none()) {
                            let there = basin.place(to);
                            let way_km =
                                look.node(id).at.distance(look.node(to).at) * trunks.fields.metres_a_grain() / 1e3;
                            km[there] = km[there].max(km[n] + way_km);
                        }
                    }
                }
                let slope = |[n, x, y, xx, xy]: [f64; 5]| (n * xy - x * y) / (n * xx - x * x);
                println!(
                    "basin_m {:.0} km, {octaves} octaves, {} rounds, seed {seed}: land {:.0} %, hollows {hollows}, \
                     closed {} with {:.1} % of land; longest {longest_km:.0} km, largest {:.2} M km2, \
                     Hack {:.3} nodes, {:.3} mouths; {all} nodes, ms: nodes {:.0}, falls {:.0}, sinks {:.0}, \
                     floods {:.0}, basins {:.0}",
                    basin_m / 1e3,
                    rounds,
                    land.len() as f64 * 100.0 / (side * side) as f64,
                    closed.len(),
                    f64::from(dry) * 100.0 / land.len() as f64,
                    f64::from(largest) * cell_km2 / 1e6,
                    slope(fits[0]),
                    slope(fits[1]),
                    nodes_s * 1e3,
                    falls_s * 1e3,
                    sinks_s * 1e3,
                    flood_s * 1e3,
                    basins_s * 1e3,
                );
            }
        }
    }

    /// Links that formed a cycle would be followed for ever.
    #[test]
    fn every_trunk_of_a_continent_leads_to_a_sink_in_its_basin() {
        for seed in 1..=3 {
            let trunks = continental(600e3, 6, -0.05, seed);
            let look = trunks.look();
            let (mut land, mut closed, mut nodes) = (0, 0, BTreeMap::new());
            for id in (0..128 * 128).map(|n| (n % 128 - 64, n / 128)).filter(|id| !look.node(*id).sea) {
                let mut last = id;
                let mut steps = 0;
                while let Some(to) = look.drained(last).to {
                    last = to;
                    steps += 1;
                    assert!(steps < 1000, "{id:?} leads to no sink");
                }
                land += 1;
                closed += i32::from(!look.node(last).sea);
                let basin = nodes.entry(last).or_insert_with(|| look.basin(last));
                assert!(basin.find(id).is_some(), "{id:?} is not in the basin of {last:?}");
            }
            assert!(land > 1000 && closed == 0, "{closed} of {land} nodes on land do not drain to the sea");
        }
    }

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
