//! The trunks: the largest rivers, on a coarse lattice of jittered nodes.
//!
//! A trunk leads from a node to the next, by the `catchments`: down the potential, and over the
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
use crate::memory::{HeapBytes, Memory, Remembers, heap_bytes};

/// Least slope of a bed where larger valleys or the coast keep it low: 40 cm in a kilometre, as large rivers have.
pub(super) const LEAST_SLOPE: f64 = 0.0004;

/// Least slope of a bed below the level of the sea, unless the coast keeps it low. Since the lowstand rivers have filled
/// flatter valleys, so the sea comes no further than some tens of kilometres into a plain. Chosen by eye.
const FILLED_SLOPE: f64 = 0.001;

/// Number of basins as large as the largest that the cache has room for: one in each generation of each of the parts of
/// which a [`Memory`] consists, so that threads in different basins leave each other theirs.
const BASINS: usize = 32;

/// Height in metres that beds hardly exceed: the greatest ceiling of the land.
const HIGHEST_BED_M: f64 = 10_000.0;

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
    /// Strahler's order of the river by the trunks alone: 1 where no other trunk comes in.
    pub order: u32,
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
    /// True if the world has continents.
    is_continental: bool,
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
        let is_continental = fields.has_continents();
        Trunks::of_kind(fields, is_continental, is_far, seed)
    }

    fn of_kind(fields: Arc<Fields>, is_continental: bool, is_far: bool, seed: u64) -> Trunks {
        Trunks {
            seed,
            is_continental,
            halvings: if is_far { FEW_SHORE_HALVINGS } else { SHORE_HALVINGS },
            nodes: TrunkNodes::new(Arc::clone(&fields), is_continental, seed),
            catchments: Catchments::new(Arc::clone(&fields), is_continental),
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

    /// Tells whether a lake at a node, if there is one, is a salt pan: it lies in a hollow where it is too dry for an
    /// outlet. No basin need be made to tell.
    pub fn is_pan(&self, id: NodeId) -> bool {
        let nodes = self.nodes.look();
        nodes.falls_to(id).is_none() && !nodes.node(id).sea && self.fields.keeps_water(nodes.node(id).at)
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
            let basin = self.trunks.basins.get(sink, || {
                let basin = self.basin(sink);
                self.trunks.basins.reserve(BASINS * basin.heap_bytes());
                basin
            });
            let drained = basin.nodes[basin.place(id)].1;
            *self.basin.borrow_mut() = Some(basin);
            drained
        })
    }

    /// True if a node that drains to `to` may have a lake: in a hollow of the land, or by chance. On continents only
    /// basins without outlet have a lake in their hollow, as there are too many hollows.
    fn lake(&self, id: NodeId, to: Option<NodeId>) -> bool {
        let hollow = if self.trunks.is_continental { to.is_none() } else { self.nodes.falls_to(id).is_none() };
        let (node, luck) = (self.node(id), chance(self.trunks.seed, id, Draw::Choice, 0));
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
            let lake = self.lake(id, to);
            let drained = Drained { to, sea_at, main: None, area: 1, discharge_m3s: 0.0, order: 1, level_m: 0.0, lake };
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

    /// Examines the straight way from a node on land to a neighbour.
    fn way(&self, id: NodeId, to: NodeId) -> DryWay {
        if self.is_far_inland(id) {
            return DryWay { sea_at: None, least: f64::INFINITY };
        }
        let there = self.node(to);
        self.fields.dry_way([self.node(id).at, there.at], || there.potential, self.trunks.halvings)
    }

    /// True if no way from a node to a neighbour comes to the sea, or so near to it that the coast keeps its bed low.
    ///
    /// The potential between nodes is not looked at, which would take longer than all else. It is taken to be no further
    /// below the potentials of all nodes within two cells than half of the range of these; a quarter is the most that
    /// was found, whatever the octaves.
    fn is_far_inland(&self, (column, row): NodeId) -> bool {
        if !self.fields.has_sea() {
            return true;
        }
        let around = (0..25).map(|n| self.node((column + n % 5 - 2, row + n / 5 - 2)).potential);
        let (low, high) =
            around.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), here| (low.min(here), high.max(here)));
        self.fields.below_coast_of_m(low - (high - low) / 2.0, self.fields.lowstand_level_m()) >= HIGHEST_BED_M
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
                    // Nothing flows through a volcano.
                    if self.fields.volcano_at(other).is_some() {
                        return None;
                    }
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

    /// Returns the height of a bed that lies this many metres upstream of a height, by the slope of rivers.
    fn risen_m(&self, below_m: f64, length_m: f64, slope: f64) -> f64 {
        let filled_slope = slope.max(FILLED_SLOPE);
        let drowned_m = length_m.min((self.fields.sea_level_m() - below_m).max(0.0) / filled_slope);
        below_m + drowned_m * filled_slope + (length_m - drowned_m) * slope
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
                basin.nodes[here].1.level_m = self.fields.sink_level_m(node.sea, node.at);
                continue;
            };
            // The river ends where the way meets the sea.
            let (below_m, dry) = match sea_at {
                Some(dry) => (self.fields.lowstand_level_m(), dry),
                None => (basin.nodes[basin.place(to)].1.level_m, 1.0),
            };
            let length_m = node.at.distance(self.node(to).at) * dry * self.fields.metres_a_grain();
            let slope = self.fields.laws(node.at).river_slope(area as f64);
            let free_m = self.risen_m(below_m, length_m, slope);
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

    /// Adds up the areas, what runs off them, and the orders, from the springs down, which is the reverse of the flood. The inflow
    /// with the most area is a node's main river; the id decides between equal ones. `runoff_m3s` is that of each
    /// node's own cell.
    fn add_areas(&mut self, flood: &[NodeId], runoff_m3s: &[f64]) {
        for ((_, drained), runoff_m3s) in self.nodes.iter_mut().zip(runoff_m3s) {
            (drained.area, drained.discharge_m3s, drained.main) = (1, *runoff_m3s, None);
        }
        // For each node the highest order of its inflows so far, and if two have it.
        let mut met = vec![(0, false); self.nodes.len()];
        for id in flood.iter().rev() {
            let place = self.place(*id);
            let (most, twice) = met[place];
            self.nodes[place].1.order = (most + u32::from(twice)).max(1);
            let here = self.nodes[place].1;
            // A river that ends in the sea does not reach the next node.
            let Some(to) = here.to.filter(|_| here.sea_at.is_none()) else { continue };
            let to = self.place(to);
            self.nodes[to].1.area += here.area;
            self.nodes[to].1.discharge_m3s += here.discharge_m3s;
            let (most, twice) = met[to];
            met[to] = (most.max(here.order), if here.order > most { false } else { twice || here.order == most });
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
    use std::collections::{BTreeMap, BTreeSet};

    use super::*;
    use crate::preset::Preset;

    /// Makes the trunks of a world of continents.
    fn continental(basin_m: f64, octaves: u32, seed: u64) -> Trunks {
        let (_, preset) = Preset::load("alps").unwrap();
        let mut settings = preset.fluvial.unwrap();
        settings.basin_m = Some(basin_m);
        (settings.coast.octaves, settings.coast.below) = (octaves, -0.05);
        let fields = Arc::new(Fields::new(&settings, None, preset.spacing_m, Some(0.0), seed));
        Trunks::of_kind(fields, true, false, seed)
    }

    /// The rivers of a square of continents, as far as they are compared with those of Earth.
    #[derive(Debug)]
    struct Figures {
        land: usize,
        /// Number of closed basins, and of the nodes on land in them.
        closed: usize,
        kept: usize,
        longest_km: f64,
        largest_km2: f64,
        /// Exponents of the length of the longest river by area, over all nodes and over the mouths of basins of four
        /// cells to a million square kilometres.
        hack: [f64; 2],
    }

    /// Returns the slope of the line that fits points best.
    fn slope(points: &[[f64; 2]]) -> f64 {
        let mean = |of: &dyn Fn(&[f64; 2]) -> f64| points.iter().map(of).sum::<f64>() / points.len() as f64;
        let [x, y] = [0, 1].map(|axis| mean(&|point| point[axis]));
        mean(&|point| (point[0] - x) * (point[1] - y)) / mean(&|point| (point[0] - x) * (point[0] - x))
    }

    fn figures(trunks: &Trunks, side: i64) -> Figures {
        let look = trunks.look();
        let cell_km2 = (trunks.fields.side(0) as f64 * trunks.fields.metres_a_grain() / 1e3).powi(2);
        let land: Vec<NodeId> =
            (0..side * side).map(|n| (n % side, n / side)).filter(|id| !look.node(*id).sea).collect();
        let mut own: BTreeMap<NodeId, usize> = BTreeMap::new();
        for id in &land {
            *own.entry(trunks.catchments.sink(&look.nodes, *id)).or_default() += 1;
        }
        let closed: Vec<usize> = own.iter().filter(|(sink, _)| !look.node(**sink).sea).map(|(_, own)| *own).collect();
        let (mut longest_km, mut largest) = (0.0f64, 0);
        let mut points = [Vec::new(), Vec::new()];
        for sink in own.keys() {
            let basin = look.basin(*sink);
            let mut order: Vec<usize> = (0..basin.nodes.len()).collect();
            order.sort_by_key(|place| basin.nodes[*place].1.area);
            let mut km = vec![0.0f64; order.len()];
            for place in order {
                let (id, drained) = basin.nodes[place];
                let area_km2 = f64::from(drained.area) * cell_km2;
                let to = drained.to.filter(|_| drained.sea_at.is_none());
                if drained.area >= 4 && area_km2 <= 1e6 {
                    let point = [area_km2.ln(), km[place].ln()];
                    points[0].push(point);
                    points[1].extend(to.is_none().then_some(point));
                }
                (longest_km, largest) = (longest_km.max(km[place]), largest.max(drained.area));
                if let Some(to) = to {
                    let way = look.node(id).at.distance(look.node(to).at);
                    let there = basin.place(to);
                    km[there] = km[there].max(km[place] + way * trunks.fields.metres_a_grain() / 1e3);
                }
            }
        }
        Figures {
            land: land.len(),
            closed: closed.len(),
            kept: closed.iter().sum(),
            longest_km,
            largest_km2: f64::from(largest) * cell_km2,
            hack: points.map(|points| slope(&points)),
        }
    }

    /// Prints its figures.
    #[test]
    #[ignore = "slow for its own sake"]
    fn rivers_of_continents_are_long_and_drain_to_the_sea() {
        for (basin_m, octaves, least_km) in [(600e3, 6, 600.0), (3000e3, 6, 2000.0)] {
            for seed in 1..=3 {
                let figures = figures(&continental(basin_m, octaves, seed), 256);
                let Figures { land, closed, kept, longest_km, largest_km2, hack } = figures;
                println!(
                    "basin_m {} km, {octaves} octaves, seed {seed}: {land} nodes on land, {kept} of them in {closed} closed \
                     basins; longest river {longest_km:.0} km, largest basin {largest_km2:.0} km2, Hack {hack:.3?}",
                    basin_m / 1e3,
                );
                assert!(land > 20_000 && closed == 0 && kept == 0);
                assert!(longest_km > least_km && largest_km2 > least_km * least_km / 10.0);
                assert!(hack.iter().all(|hack| (0.54..=0.62).contains(hack)));
            }
        }
    }

    #[test]
    fn no_way_far_inland_comes_to_the_sea() {
        for (basin_m, octaves) in [(600e3, 6), (600e3, 10), (3000e3, 6)] {
            let trunks = continental(basin_m, octaves, 5);
            let look = trunks.look();
            let (mut land, mut inland) = (0, 0);
            for id in (0..128 * 128).map(|n| (n % 128, n / 128)).filter(|id| !look.node(*id).sea) {
                land += 1;
                if !look.is_far_inland(id) {
                    continue;
                }
                inland += 1;
                for to in neighbours(id) {
                    let DryWay { sea_at, least } =
                        trunks.fields.dry_way([id, to].map(|id| look.node(id).at), || look.node(to).potential, 3);
                    let below_m = trunks.fields.below_coast_of_m(least, trunks.fields.lowstand_level_m());
                    assert!(
                        sea_at.is_none() && below_m > HIGHEST_BED_M,
                        "{basin_m} m, {octaves} octaves: {id:?} to {to:?}: {below_m} m"
                    );
                }
            }
            assert!(
                inland > land / 4,
                "{basin_m} m, {octaves} octaves: {inland} of {land} nodes on land are far inland"
            );
        }
    }

    /// Each way to the sea has its highest node as low as any way has.
    #[test]
    fn closed_basins_spill_over_their_lowest_passes() {
        const SIDE: i64 = 96;
        for seed in 1..=2 {
            let trunks = continental(600e3, 6, seed);
            let nodes = trunks.nodes.look();
            let ids = || (0..SIDE * SIDE).map(|n| (n % SIDE, n / SIDE));
            let mut lowest: BTreeMap<NodeId, f64> = ids().map(|id| (id, f64::INFINITY)).collect();
            // From node to node, until nothing changes.
            let mut changed = true;
            while std::mem::take(&mut changed) {
                for id in ids().chain(ids().collect::<Vec<_>>().into_iter().rev()) {
                    let node = nodes.node(id);
                    let around = neighbours(id).filter_map(|other| lowest.get(&other).copied());
                    let level = if node.sea {
                        f64::NEG_INFINITY
                    } else {
                        around.fold(f64::INFINITY, f64::min).max(node.height)
                    };
                    changed |= lowest.insert(id, level) != Some(level);
                }
            }
            let sinks: BTreeSet<NodeId> = ids().map(|id| trunks.catchments.sink(&nodes, id)).collect();
            let (mut highest, mut over_passes) = (BTreeMap::new(), 0);
            for sink in sinks.into_iter().filter(|sink| nodes.node(*sink).sea) {
                for (id, to) in trunks.catchments.flood(&nodes, sink) {
                    let level = to.map_or(f64::NEG_INFINITY, |to| nodes.node(id).height.max(highest[&to]));
                    highest.insert(id, level);
                    if let Some(lowest) = lowest.get(&id) {
                        assert!(level <= *lowest, "{id:?} drains over {level}, and not over {lowest}");
                        over_passes += i32::from(level > nodes.node(id).height);
                    }
                }
            }
            assert!(over_passes > 100, "{over_passes} nodes drain over passes");
        }
    }

    /// Links that formed a cycle would be followed for ever.
    #[test]
    fn every_trunk_of_a_continent_leads_to_a_sink_in_its_basin() {
        for seed in 1..=3 {
            let trunks = continental(600e3, 6, seed);
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
