//! The order-free agents: rivers and roads that belong to tiles, the same whatever is baked in which order.
//!
//! A tile owns an agent if its hash says so. The agent's trace runs over the un-carved lattice, straight across tile
//! edges, so it is a pure function of the world and of that tile; it may cross `max_tiles` edges and so has a reach. A
//! tile asks for the lines of all owners within that reach and is carved by those that touch it.
//!
//! **Rivers that meet.** Owners have a rank, by hash. A river ends where it comes upon the bed of one with a higher
//! rank. That one may itself end before the place, in a third; so a river is settled against settled rivers, each
//! against those of higher rank that it crosses, three deep. What is deeper is taken as it was traced:
//! chains so long are rare, and their end is a river that stops where another has just ended.

use std::collections::HashMap;
use std::sync::Arc;

use crate::agents::heuristic::{RiverHeuristic, RoadHeuristic};
use crate::agents::search::{Node, Trace, rings, search};
use crate::agents::settings::{Aim, Ending, RiverAgents, RoadAgents};
use crate::agents::{Direction, Terrain, bed, highest, margin_cells};
use crate::area::{Area, TileId};
use crate::grid::Grid;
use crate::hash::{self, Stream};
use crate::lines::{Line, LineEnd, LineId, LineKind, Lines};
use crate::memory::{HashKeys, Memory, Remembers, heap_bytes};
use crate::relief::Relief;

/// How many rivers, each settled against the next, are followed before one is taken as it was traced.
const SETTLED_AGAINST: u32 = 3;

/// Bytes of traces, and of settled lines, that are remembered in any case: enough around a single tile.
const REMEMBERED: usize = 16 << 20;

/// Rows of tiles that a row of a region has to do with: the owners of lines that reach it, and what those meet.
const ROWS_REMEMBERED: usize = 24;

/// Bytes that a remembered tile takes, in the middle: a river of a thousand nodes, for every other tile, or its line.
/// Twice as much is room for those that were asked for last.
const REMEMBERED_A_TILE: usize = 16 << 10;

/// A river that comes to less than this many nodes is none.
const LEAST_NODES: usize = 24;

/// All order-free agents of a world. What has been traced is remembered for a while, which changes nothing but time.
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

/// A river as its agent went, before others cut it short.
#[derive(Debug)]
struct TracedRiver {
    nodes: Vec<Node>,
    heights_m: Vec<f32>,
    bounds: Area,
    ends_in_sea: bool,
}

heap_bytes!(TracedRiver: nodes, heights_m);

/// How far a river keeps its trace, and what is there.
#[derive(Clone, Copy)]
struct Settled {
    nodes: usize,
    ending: LineEnd,
}

impl Agents {
    /// The agents of those settings, which have been checked; steepness is what the ground's `slope_scale` makes of slopes.
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
            // Nothing is lower than that, so without a sea nothing is under water.
            sea_level_m: sea_level_m.map_or(f32::NEG_INFINITY, |level| level as f32),
            slope_scale: slope_scale as f32,
            rivers: rivers.cloned(),
            roads: roads.cloned(),
            traced: Memory::new(REMEMBERED),
            settled: Memory::new(REMEMBERED),
        }
    }

    /// Remembers at least as many tiles as a region of so many columns needs to be baked row by row.
    pub(crate) fn prepare_for(&self, cols: u64) {
        // A region may be very wide: what overflows must not wrap to less room than it needs.
        let tiles = (cols as usize).saturating_add(ROWS_REMEMBERED).saturating_mul(ROWS_REMEMBERED);
        let bytes = tiles.saturating_mul(REMEMBERED_A_TILE);
        self.traced.reserve(bytes);
        self.settled.reserve(bytes);
    }

    /// Vertices around an area that lines of it may come from, and what those meet.
    pub(crate) fn reach(&self) -> i64 {
        let crossed =
            self.rivers.iter().map(|rivers| rivers.max_tiles).chain(self.roads.iter().map(|roads| roads.max_tiles));
        // Once for the line and once for what it meets, each with a tile more for the bed that sticks out.
        crossed.max().map_or(0, |tiles| 2 * (tiles as i64 + 1) * self.cells)
    }

    /// Its memories.
    pub(crate) fn memories(&self) -> Vec<&dyn Remembers> {
        if self.rivers.is_none() && self.roads.is_none() {
            return Vec::new();
        }
        vec![&self.traced, &self.settled]
    }

    /// All lines whose effect may touch `area`, sorted by id.
    pub(crate) fn touching(&self, relief: &Relief, area: &Area) -> Lines {
        let crossed = |tiles: Option<u32>| tiles.map_or(0, |tiles| tiles as i64);
        let reach = crossed(self.rivers.as_ref().map(|rivers| rivers.max_tiles))
            .max(crossed(self.roads.as_ref().map(|roads| roads.max_tiles)));
        if self.rivers.is_none() && self.roads.is_none() {
            return Vec::new();
        }
        let mut lines = Vec::new();
        // A bed sticks out of the tiles that its nodes are in by at most a tile.
        for owner in self.tiles(area, reach + 1) {
            let own = self.settled.get(owner, || self.settle(relief, owner));
            lines.extend(own.iter().filter(|line| line.concerns(area)).cloned());
        }
        lines.sort_by_key(|line| line.id);
        lines
    }

    /// All tiles that hold a vertex of `area`, and `more` around them, in order.
    fn tiles(&self, area: &Area, more: i64) -> impl Iterator<Item = TileId> + use<> {
        // Euclidean, so that tiles west and north of the origin are as large as all others.
        let span = |from: i64, to: i64| from.div_euclid(self.cells) - more..=(to - 1).div_euclid(self.cells) + more;
        let columns = span(area.x0, area.x1);
        span(area.y0, area.y1).flat_map(move |y| columns.clone().map(move |x| TileId { x, y }))
    }

    /// The lines of a tile, as they are in the end.
    fn settle(&self, relief: &Relief, owner: TileId) -> Lines {
        let river = self.rivers.as_ref().and_then(|agents| {
            let traced = self.traced(relief, owner);
            let river = traced.as_ref().as_ref()?;
            let settled = self.settle_river(relief, owner, river, SETTLED_AGAINST);
            (settled.nodes >= LEAST_NODES).then(|| self.river(agents, owner, river, settled))
        });
        let road = self.roads.as_ref().and_then(|agents| self.road(relief, owner, agents));
        river.into_iter().chain(road).map(Arc::new).collect()
    }

    /// How far a traced river goes before it meets one of higher rank, or how much of it is left if it meets none.
    fn settle_river(&self, relief: &Relief, owner: TileId, river: &TracedRiver, depth: u32) -> Settled {
        let rank = self.rank(owner);
        let reach = self.rivers.as_ref().map_or(0, |rivers| rivers.max_tiles as i64);
        let mut end = Settled {
            nodes: river.nodes.len(),
            ending: if river.ends_in_sea { LineEnd::Sea } else { LineEnd::Nothing },
        };
        let mut steps: Option<HashMap<Node, usize, HashKeys>> = None;
        for other in self.tiles(&river.bounds, reach) {
            // Its own tile is among them. Only upwards in rank, so that two rivers never wait for each other.
            if self.rank(other) <= rank {
                continue;
            }
            let traced = self.traced(relief, other);
            let Some(beside) = traced.as_ref() else { continue };
            // Cheap, and most pairs end here: a river that is near to none needs no table of its steps.
            if river.bounds.common(&beside.bounds).is_none() {
                continue;
            }
            // Steps go along the axes, so two ways cannot cross without a common node: to compare nodes is enough.
            let steps =
                steps.get_or_insert_with(|| river.nodes.iter().enumerate().map(|(step, node)| (*node, step)).collect());
            // The first place on this river's way counts, wherever on the other's it is.
            let meets = |nodes: usize| beside.nodes[..nodes].iter().filter_map(|node| steps.get(node)).min().copied();
            // Only rivers that cross at all are asked how far the other one really comes.
            let Some(mut step) = meets(beside.nodes.len()) else { continue };
            if depth > 0 {
                let kept = self.settle_river(relief, other, beside, depth - 1).nodes;
                match meets(kept) {
                    Some(met) => step = met,
                    None => continue,
                }
            }
            // Where several meet at one place, the first owner in order has it: ties do not depend on history.
            if step + 1 < end.nodes || (step + 1 == end.nodes && end.ending == LineEnd::Nothing) {
                end = Settled { nodes: step + 1, ending: LineEnd::Line(river_id(other)) };
            }
        }
        if end.ending == LineEnd::Nothing {
            match self.rivers.as_ref().map(|rivers| rivers.ending) {
                Some(Ending::Pond) => end.ending = LineEnd::Pond,
                // As in the thesis.
                _ => end.nodes -= end.nodes / 3,
            }
        }
        end
    }

    /// The order in which rivers give way; no two tiles have the same.
    fn rank(&self, owner: TileId) -> (u64, TileId) {
        (self.hash(Stream::AgentRank, owner), owner)
    }

    fn hash(&self, stream: Stream, owner: TileId) -> u64 {
        hash::lattice(hash::stream(self.seed, stream), owner.x, owner.y)
    }

    /// The hash of a tile that owns an agent of a kind, and `None` for all others.
    fn owns(&self, stream: Stream, owner: TileId, density: f64) -> Option<u64> {
        // With one less below, a density of 0 has no owner and one of 1 has all of them.
        let hash = self.hash(stream, owner);
        // 53 bits make a fraction that a double holds exactly; two others choose a direction.
        ((hash >> 11) as f64 <= density * (1u64 << 53) as f64 - 1.0).then_some(hash)
    }

    fn traced(&self, relief: &Relief, owner: TileId) -> Arc<Option<TracedRiver>> {
        self.traced.get(owner, || {
            let agents = self.rivers.as_ref()?;
            let hash = self.owns(Stream::AgentRiver, owner, agents.density)?;
            self.trace_river(relief, owner, agents, hash)
        })
    }

    /// The trace of a tile's river, from its highest vertex beyond the margin to the sea or to where it can go no further.
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
        // A river ends with its first vertex under water.
        let sea = nodes.iter().position(|node| ground.is_under_water(*node));
        nodes.truncate(sea.map_or(nodes.len(), |at| at + 1));
        if nodes.len() < LEAST_NODES {
            return None;
        }
        // Kept with the trace: when the river is settled, its ground is not made a second time.
        let heights_m = nodes.iter().map(|node| ground.height_m(*node)).collect();
        let bounds = bounds_of(&nodes);
        Some(TracedRiver { nodes, heights_m, bounds, ends_in_sea: sea.is_some() })
    }

    /// The bed of a river that keeps a part of its trace.
    fn river(&self, agents: &RiverAgents, owner: TileId, river: &TracedRiver, settled: Settled) -> Line {
        let nodes = &river.nodes[..settled.nodes];
        // By how far it could come and not by how far it does: where it is cut short must not change its bed upstream.
        let grown = [0.0, (self.cells * (1 + agents.max_tiles as i64)) as f32];
        let heights_m = &river.heights_m[..settled.nodes];
        let line = bed::river(river_id(owner), nodes, heights_m, agents, self.spacing_m, grown);
        match settled.ending {
            LineEnd::Pond => bed::with_pond(line, POND_WIDTHS),
            end => Line { end, ..line },
        }
    }

    /// A tile's road, from its middle on, or from the nearest place to it where there is a way on.
    fn road(&self, relief: &Relief, owner: TileId, agents: &RoadAgents) -> Option<Line> {
        let hash = self.owns(Stream::AgentRoad, owner, agents.density)?;
        let area = owner.area(self.cells as u32);
        let middle = ((area.x0 + area.x1 - 1) / 2, (area.y0 + area.y1 - 1) / 2);
        let direction = Direction::ALL[(hash & 3) as usize];
        let bounds = area.padded((self.cells * agents.max_tiles as i64) as usize);
        let mut ground = self.ground(relief);
        let stride = agents.step_cells as i64;
        let start = rings(middle, stride, (self.cells / 2 - 1) / stride).find(|start| {
            // The search asks only of nodes that it goes to, never of its start.
            let goes_on =
                |ground| search(&mut RoadHeuristic::new(ground, agents, direction), *start, bounds, 2).nodes.len() > 1;
            !ground.is_under_water(*start) && goes_on(&mut ground)
        })?;
        let mut heuristic = RoadHeuristic::new(&mut ground, agents, direction);
        // As long a way as a river's, in fewer and longer steps.
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

    /// Cuts a trace off before it crosses one tile edge more than it may.
    fn stop_at_crossing(&self, nodes: &mut Vec<Node>, max_tiles: u32) {
        let tile = |node: &Node| (node.0.div_euclid(self.cells), node.1.div_euclid(self.cells));
        let mut crossed = 0;
        let last = nodes.windows(2).position(|pair| {
            // A step is no longer than a tile, so it crosses one edge at most. Back over the same edge counts, too:
            // however the way winds, it stays within its reach.
            crossed += u32::from(tile(&pair[0]) != tile(&pair[1]));
            crossed > max_tiles
        });
        nodes.truncate(last.map_or(nodes.len(), |last| last + 1));
    }

    /// Nodes at which a trace is given up: it has wandered twice through each tile that it may see.
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

/// A pond is so many times as wide as the river that ends in it.
const POND_WIDTHS: f32 = 3.0;

/// The river of a tile.
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

/// The direction in which an area falls on the whole: from the corners and edges' middles, which see its large form.
fn downhill(heights: &Grid<f32>) -> Direction {
    let Area { x0, y0, x1, y1 } = heights.area();
    let (middle_x, middle_y) = ((x0 + x1 - 1) / 2, (y0 + y1 - 1) / 2);
    let column = |x: i64| heights.at(x, y0) + heights.at(x, middle_y) + heights.at(x, y1 - 1);
    let row = |y: i64| heights.at(x0, y) + heights.at(middle_x, y) + heights.at(x1 - 1, y);
    let (east, south) = (column(x0) - column(x1 - 1), row(y0) - row(y1 - 1));
    // On a tie east or west, and west where it is level: any rule does that is the same everywhere.
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

/// Vertices a side of a block of ground: the noise is made in blocks of about that size too.
const BLOCK: i64 = 32;

impl BareTerrain<'_> {
    fn at(&mut self, x: i64, y: i64) -> f32 {
        // Euclidean, as with tiles: no block is cut in two at the origin.
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
        // From both sides: with the vertex's own height a slope and its mirror image would differ.
        let rise_east = (self.at(x + 1, y) - self.at(x - 1, y)) * self.half_per_spacing;
        let rise_south = (self.at(x, y + 1) - self.at(x, y - 1)) * self.half_per_spacing;
        let up = 1.0 / (rise_east * rise_east + rise_south * rise_south + 1.0).sqrt();
        ((1.0 - up) * self.slope_scale).min(1.0)
    }

    fn is_under_water(&mut self, (x, y): Node) -> bool {
        self.at(x, y) < self.sea_level_m
    }
}
