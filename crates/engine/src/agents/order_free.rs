//! The order-free agents: rivers and roads that belong to tiles, the same whatever is baked and in whatever order.
//!
//! A tile owns an agent if its hash says so. The agent's trace runs over the un-carved lattice and across tile edges,
//! so it is a pure function of the world and its tile. It may cross `max_tiles` edges, which limits its reach. A tile
//! asks for the lines of all owners within that reach, and is carved by those that touch it.
//!
//! **Rivers that meet.** Owners have a rank, by hash. A river ends where it meets the bed of a river with a higher
//! rank. But that river may itself end upstream of the place, in a third one. So the end of a river is settled against
//! settled rivers: recursively against those of higher rank that it crosses, three deep. Rivers beyond that depth are
//! taken as traced: chains of that length are rare, and the worst result is a river that stops where another has just
//! ended.

use std::collections::HashMap;
use std::sync::Arc;

use crate::agents::heuristic::{RiverHeuristic, RoadHeuristic};
use crate::agents::search::{Node, Trace, rings, search};
use crate::agents::settings::{Aim, Ending, RiverAgents, RoadAgents};
use crate::agents::{Direction, Terrain, bed, highest, margin_cells};
use crate::area::{Area, TileId};
use crate::clock::Clock;
use crate::grid::Grid;
use crate::hash::{self, Stream};
use crate::lines::{Line, LineEnd, LineId, LineKind, Lines};
use crate::memory::{HashKeys, Memory, Remembers, heap_bytes};
use crate::relief::Relief;
use crate::stop::Stopped;

/// Depth of the recursion that settles rivers against each other; beyond it a river is taken as it was traced.
const SETTLED_AGAINST: u32 = 3;

/// Least size in bytes of the caches of traces and of settled lines: enough around a single tile.
const REMEMBERED: usize = 16 << 20;

/// Number of rows of tiles that one row of a region depends on: the owners of lines that reach the row, and the rivers
/// that these lines meet.
const ROWS_REMEMBERED: usize = 24;

/// Cache size in bytes per tile. A river of a thousand nodes in every other tile, or its line, takes about half of this
/// on average; the rest leaves room for the tiles that were asked for last.
const REMEMBERED_A_TILE: usize = 16 << 10;

/// Least number of nodes of a river or cells of a road; shorter ones are dropped.
const LEAST_NODES: usize = 24;

/// All order-free agents of a world. Traces are cached, which changes nothing but the time.
#[derive(Debug)]
pub(crate) struct Agents {
    seed: u64,
    cells: i64,
    spacing_m: f64,
    sea_level_m: f32,
    slope_scale: f32,
    rivers: Option<RiverAgents>,
    roads: Option<RoadAgents>,
    traced: Memory<TileId, Option<TracedRiver>>,
    settled: Memory<TileId, Lines>,
}

/// A river as its agent traced it, before other rivers cut it short.
#[derive(Debug)]
struct TracedRiver {
    nodes: Vec<Node>,
    heights_m: Vec<f32>,
    bounds: Area,
    ends_in_sea: bool,
}

heap_bytes!(TracedRiver: nodes, heights_m);

/// End of a river after it was settled: the number of nodes that it keeps, and the object in which it ends.
#[derive(Clone, Copy)]
struct Settled {
    nodes: usize,
    ending: LineEnd,
}

impl Agents {
    /// Creates the agents of settings that have been checked. Steepness is slope scaled by the ground's `slope_scale`.
    pub(crate) fn new(
        (rivers, roads): (Option<&RiverAgents>, Option<&RoadAgents>),
        tile_cells: u32,
        spacing_m: f64,
        sea_level_m: Option<f64>,
        slope_scale: f64,
        seed: u64,
    ) -> Agents {
        Agents {
            seed,
            cells: tile_cells as i64,
            spacing_m,
            // Nothing is lower than minus infinity, so without a sea nothing is under water.
            sea_level_m: sea_level_m.map_or(f32::NEG_INFINITY, |level| level as f32),
            slope_scale: slope_scale as f32,
            rivers: rivers.cloned(),
            roads: roads.cloned(),
            traced: Memory::new(REMEMBERED),
            settled: Memory::new(REMEMBERED),
        }
    }

    /// Enlarges the caches for baking a region of this many columns of tiles row by row.
    pub(crate) fn prepare_for(&self, cols: u64) {
        // A region may be very wide: on overflow the sizes must saturate, not wrap to less room than needed.
        let tiles = (cols as usize).saturating_add(ROWS_REMEMBERED).saturating_mul(ROWS_REMEMBERED);
        let bytes = tiles.saturating_mul(REMEMBERED_A_TILE);
        self.traced.reserve(bytes);
        self.settled.reserve(bytes);
    }

    /// Returns the distance in vertices from which lines can reach an area, including the rivers that those lines meet.
    pub(crate) fn reach(&self) -> i64 {
        let crossed =
            self.rivers.iter().map(|rivers| rivers.max_tiles).chain(self.roads.iter().map(|roads| roads.max_tiles));
        // Doubled: once for the line and once for the river that it meets, each with one tile more for the bed that
        // sticks out.
        crossed.max().map_or(0, |tiles| 2 * (tiles as i64 + 1) * self.cells)
    }

    /// Returns the caches.
    pub(crate) fn memories(&self) -> Vec<&dyn Remembers> {
        if self.rivers.is_none() && self.roads.is_none() {
            return Vec::new();
        }
        vec![&self.traced, &self.settled]
    }

    /// Returns all lines that may affect `area`, sorted by id.
    pub(crate) fn touching(&self, relief: &Relief, area: &Area, clock: &Clock) -> Result<Lines, Stopped> {
        let crossed = |tiles: Option<u32>| tiles.map_or(0, |tiles| tiles as i64);
        let reach = crossed(self.rivers.as_ref().map(|rivers| rivers.max_tiles))
            .max(crossed(self.roads.as_ref().map(|roads| roads.max_tiles)));
        if self.rivers.is_none() && self.roads.is_none() {
            return Ok(Vec::new());
        }
        let mut lines = Vec::new();
        // A bed reaches at most one tile beyond the tiles that contain its nodes.
        for owner in self.tiles(area, reach + 1) {
            let own = self.settled.try_get(owner, || self.settle(relief, owner, clock))?;
            lines.extend(own.iter().filter(|line| line.concerns(area)).cloned());
        }
        lines.sort_by_key(|line| line.id);
        Ok(lines)
    }

    /// Lists the tiles that contain a vertex of `area`, and `more` tiles around them, in order.
    fn tiles(&self, area: &Area, more: i64) -> impl Iterator<Item = TileId> + use<> {
        area.padded((more * self.cells) as usize).square_numbers(self.cells).map(|[x, y]| TileId { x, y })
    }

    /// Returns the final lines of a tile, with rivers settled against each other.
    fn settle(&self, relief: &Relief, owner: TileId, clock: &Clock) -> Result<Lines, Stopped> {
        let mut lines = Lines::new();
        if let Some(agents) = &self.rivers
            && let Some(river) = self.traced(relief, owner, clock)?.as_ref()
        {
            let settled = self.settle_river(relief, owner, river, SETTLED_AGAINST, clock)?;
            if settled.nodes >= LEAST_NODES {
                lines.push(Arc::new(self.river(agents, owner, river, settled)));
            }
        }
        clock.check()?;
        lines.extend(self.roads.as_ref().and_then(|agents| self.road(relief, owner, agents)).map(Arc::new));
        Ok(lines)
    }

    /// Determines how much of a traced river is left: up to the place where it meets a river of higher rank, or else
    /// what its ending leaves.
    fn settle_river(
        &self,
        relief: &Relief,
        owner: TileId,
        river: &TracedRiver,
        depth: u32,
        clock: &Clock,
    ) -> Result<Settled, Stopped> {
        let rank = self.rank(owner);
        let reach = self.rivers.as_ref().map_or(0, |rivers| rivers.max_tiles as i64);
        let mut end = Settled {
            nodes: river.nodes.len(),
            ending: if river.ends_in_sea { LineEnd::Sea } else { LineEnd::Nothing },
        };
        let mut steps: Option<HashMap<Node, usize, HashKeys>> = None;
        for other in self.tiles(&river.bounds, reach) {
            // The river's own tile is among them. Only higher ranks count, so that two rivers never wait for each
            // other.
            if self.rank(other) <= rank {
                continue;
            }
            let traced = self.traced(relief, other, clock)?;
            let Some(beside) = traced.as_ref() else { continue };
            // A cheap test that ends most pairs: a river that is near no other needs no table of its steps.
            if river.bounds.common(&beside.bounds).is_none() {
                continue;
            }
            // Steps go along the axes, so two ways that cross have a common node. Comparing nodes is enough.
            let steps =
                steps.get_or_insert_with(|| river.nodes.iter().enumerate().map(|(step, node)| (*node, step)).collect());
            // The first meeting place along this river counts, wherever it lies along the other river.
            let meets = |nodes: usize| beside.nodes[..nodes].iter().filter_map(|node| steps.get(node)).min().copied();
            // Only rivers whose traces meet at all are settled to find where the other river really ends.
            let Some(mut step) = meets(beside.nodes.len()) else { continue };
            if depth > 0 {
                let kept = self.settle_river(relief, other, beside, depth - 1, clock)?.nodes;
                match meets(kept) {
                    Some(met) => step = met,
                    None => continue,
                }
            }
            // If several rivers meet at one place, the first owner in order wins, so that ties do not depend on
            // history.
            if step + 1 < end.nodes || (step + 1 == end.nodes && end.ending == LineEnd::Nothing) {
                end = Settled { nodes: step + 1, ending: LineEnd::Line(river_id(other)) };
            }
        }
        if end.ending == LineEnd::Nothing {
            match self.rivers.as_ref().map(|rivers| rivers.ending) {
                Some(Ending::Pond) => end.ending = LineEnd::Pond,
                // As in the thesis: the river loses the last third of its way.
                _ => end.nodes -= end.nodes / 3,
            }
        }
        Ok(end)
    }

    /// Returns the rank by which rivers give way to each other, unique for each tile.
    fn rank(&self, owner: TileId) -> (u64, TileId) {
        (self.hash(Stream::AgentRank, owner), owner)
    }

    fn hash(&self, stream: Stream, owner: TileId) -> u64 {
        hash::lattice(hash::stream(self.seed, stream), owner.x, owner.y)
    }

    /// Returns the hash of a tile if it owns an agent of this kind, else `None`.
    fn owns(&self, stream: Stream, owner: TileId, density: f64) -> Option<u64> {
        // Because of the 1 subtracted below, no tile is an owner at density 0 and every tile is one at density 1.
        let hash = self.hash(stream, owner);
        // The upper 53 bits make a fraction that a double holds exactly; the lowest two choose a direction.
        ((hash >> 11) as f64 <= density * (1u64 << 53) as f64 - 1.0).then_some(hash)
    }

    fn traced(&self, relief: &Relief, owner: TileId, clock: &Clock) -> Result<Arc<Option<TracedRiver>>, Stopped> {
        self.traced.try_get(owner, || {
            clock.check()?;
            let trace = |agents: &RiverAgents| {
                let hash = self.owns(Stream::AgentRiver, owner, agents.density)?;
                self.trace_river(relief, owner, agents, hash)
            };
            Ok(self.rivers.as_ref().and_then(trace))
        })
    }

    /// Traces a tile's river from the highest vertex outside the margin to the sea, or to where it cannot go on.
    fn trace_river(&self, relief: &Relief, owner: TileId, agents: &RiverAgents, hash: u64) -> Option<TracedRiver> {
        let area = owner.area(self.cells as u32);
        let heights = relief.heights(area);
        let start = highest(&heights, area, margin_cells(self.cells as u32));
        let direction = match agents.aim {
            Aim::Hash => Direction::ALL[(hash & 3) as usize],
            Aim::Slope => downhill(&heights),
        };
        let mut ground = self.ground(relief);
        let mut heuristic = RiverHeuristic::new(&mut ground, agents, direction, start);
        let bounds = area.padded((self.cells * agents.max_tiles as i64) as usize);
        let Trace { mut nodes, .. } = search(&mut heuristic, start, bounds, self.most_nodes(agents.max_tiles));
        self.stop_at_crossing(&mut nodes, agents.max_tiles);
        // A river ends at its first vertex under water.
        let sea = nodes.iter().position(|node| ground.is_under_water(*node));
        nodes.truncate(sea.map_or(nodes.len(), |at| at + 1));
        if nodes.len() < LEAST_NODES {
            return None;
        }
        // Stored with the trace, so that settling the river need not make its ground again.
        let heights_m = nodes.iter().map(|node| ground.height_m(*node)).collect();
        let bounds = bounds_of(&nodes);
        Some(TracedRiver { nodes, heights_m, bounds, ends_in_sea: sea.is_some() })
    }

    /// Makes the line of a river from the part of its trace that it keeps.
    fn river(&self, agents: &RiverAgents, owner: TileId, river: &TracedRiver, settled: Settled) -> Line {
        let nodes = &river.nodes[..settled.nodes];
        // Width and depth depend on the longest possible way, not on the actual one: cutting a river short must not
        // change its bed upstream.
        let grown = [0.0, (self.cells * (1 + agents.max_tiles as i64)) as f32];
        let heights_m = &river.heights_m[..settled.nodes];
        let line = bed::river(river_id(owner), nodes, heights_m, agents, self.spacing_m, grown);
        match settled.ending {
            LineEnd::Pond => bed::with_pond(line, POND_WIDTHS),
            end => Line { end, ..line },
        }
    }

    /// Makes a tile's road. It starts in the middle of the tile, or at the nearest place from which there is a way on.
    fn road(&self, relief: &Relief, owner: TileId, agents: &RoadAgents) -> Option<Line> {
        let hash = self.owns(Stream::AgentRoad, owner, agents.density)?;
        let area = owner.area(self.cells as u32);
        let middle = ((area.x0 + area.x1 - 1) / 2, (area.y0 + area.y1 - 1) / 2);
        let direction = Direction::ALL[(hash & 3) as usize];
        let bounds = area.padded((self.cells * agents.max_tiles as i64) as usize);
        let mut ground = self.ground(relief);
        let stride = agents.step_cells as i64;
        let start = rings(middle, stride, (self.cells / 2 - 1) / stride).find(|start| {
            // The search never checks its start, only the nodes that it goes to.
            let goes_on =
                |ground| search(&mut RoadHeuristic::new(ground, agents, direction), *start, bounds, 2).nodes.len() > 1;
            !ground.is_under_water(*start) && goes_on(&mut ground)
        })?;
        let mut heuristic = RoadHeuristic::new(&mut ground, agents, direction);
        // As long a way as a river may take, in fewer and longer steps.
        let most = self.most_nodes(agents.max_tiles) / agents.step_cells as usize;
        let Trace { mut nodes, .. } = search(&mut heuristic, start, bounds, most);
        self.stop_at_crossing(&mut nodes, agents.max_tiles);
        if nodes.len() * (agents.step_cells as usize) < LEAST_NODES {
            return None;
        }
        let heights_m: Vec<f32> = nodes.iter().map(|node| ground.height_m(*node)).collect();
        let id = LineId::Agent { kind: LineKind::Road, owner };
        Some(bed::road(id, &nodes, &heights_m, agents, self.spacing_m))
    }

    /// Cuts a trace off before it crosses more than `max_tiles` tile edges.
    fn stop_at_crossing(&self, nodes: &mut Vec<Node>, max_tiles: u32) {
        let tile = |node: &Node| (node.0.div_euclid(self.cells), node.1.div_euclid(self.cells));
        let mut crossed = 0;
        let last = nodes.windows(2).position(|pair| {
            // A step is no longer than a tile, so it crosses at most one edge. Crossing the same edge back counts too,
            // so that even a winding way stays within its reach.
            crossed += u32::from(tile(&pair[0]) != tile(&pair[1]));
            crossed > max_tiles
        });
        nodes.truncate(last.map_or(nodes.len(), |last| last + 1));
    }

    /// Returns the number of nodes at which a trace is given up: as many as two crossings of each tile that it may
    /// enter.
    fn most_nodes(&self, max_tiles: u32) -> usize {
        self.cells as usize * 2 * (1 + max_tiles as usize)
    }

    fn ground<'a>(&self, relief: &'a Relief) -> BareTerrain<'a> {
        BareTerrain {
            relief,
            blocks: HashMap::default(),
            sea_level_m: self.sea_level_m,
            slope_scale: self.slope_scale,
            half_per_spacing: (0.5 / self.spacing_m) as f32,
        }
    }
}

/// Width of a pond as a multiple of the width of the river that ends in it.
const POND_WIDTHS: f32 = 3.0;

/// Returns the id of a tile's river.
fn river_id(owner: TileId) -> LineId {
    LineId::Agent { kind: LineKind::River, owner }
}

fn bounds_of(nodes: &[Node]) -> Area {
    let first = Area::new(nodes[0].0, nodes[0].1, 1, 1);
    nodes.iter().fold(first, |area, &(x, y)| Area {
        x0: area.x0.min(x),
        y0: area.y0.min(y),
        x1: area.x1.max(x + 1),
        y1: area.y1.max(y + 1),
    })
}

/// Returns the direction in which an area falls as a whole, judged from its corners and the middles of its edges, which
/// show the large-scale form.
fn downhill(heights: &Grid<f32>) -> Direction {
    let Area { x0, y0, x1, y1 } = heights.area();
    let (middle_x, middle_y) = ((x0 + x1 - 1) / 2, (y0 + y1 - 1) / 2);
    let column = |x: i64| heights.at(x, y0) + heights.at(x, middle_y) + heights.at(x, y1 - 1);
    let row = |y: i64| heights.at(x0, y) + heights.at(middle_x, y) + heights.at(x1 - 1, y);
    let (east, south) = (column(x0) - column(x1 - 1), row(y0) - row(y1 - 1));
    // Ties go to east or west, and to west on level ground: any rule does that is the same everywhere.
    match (east.abs() >= south.abs(), east > 0.0, south > 0.0) {
        (true, true, _) => Direction::East,
        (true, false, _) => Direction::West,
        (false, _, true) => Direction::South,
        (false, _, false) => Direction::North,
    }
}

/// Un-carved ground anywhere, made block by block where an agent looks.
struct BareTerrain<'a> {
    relief: &'a Relief,
    blocks: HashMap<(i64, i64), Grid<f32>, HashKeys>,
    sea_level_m: f32,
    slope_scale: f32,
    half_per_spacing: f32,
}

/// Side of a block of ground in vertices, similar to the blocks in which noise is computed.
const BLOCK: i64 = 32;

impl BareTerrain<'_> {
    fn at(&mut self, x: i64, y: i64) -> f32 {
        // Euclidean division as for tiles, so that blocks on both sides of the origin have the same size.
        let block = (x.div_euclid(BLOCK), y.div_euclid(BLOCK));
        let area = Area::new(block.0 * BLOCK, block.1 * BLOCK, BLOCK as usize, BLOCK as usize);
        self.blocks.entry(block).or_insert_with(|| self.relief.heights(area)).at(x, y)
    }
}

impl Terrain for BareTerrain<'_> {
    fn height_m(&mut self, (x, y): Node) -> f32 {
        self.at(x, y)
    }

    fn steepness(&mut self, (x, y): Node) -> f32 {
        // Central differences: with the vertex's own height, a slope and its mirror image would differ.
        let rise_east = (self.at(x + 1, y) - self.at(x - 1, y)) * self.half_per_spacing;
        let rise_south = (self.at(x, y + 1) - self.at(x, y - 1)) * self.half_per_spacing;
        let up = 1.0 / (rise_east * rise_east + rise_south * rise_south + 1.0).sqrt();
        ((1.0 - up) * self.slope_scale).min(1.0)
    }

    fn is_under_water(&mut self, (x, y): Node) -> bool {
        self.at(x, y) < self.sea_level_m
    }
}
