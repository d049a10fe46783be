//! The classic agents: rivers and roads that go as far as there are tiles, and wait there for more.
//!
//! Based on: Grelsson (2014), sections 4.2 and 4.3. An agent sees one tile only. When it leaves that tile, its fate
//! depends on whether the tile behind the edge was ever made. So the result depends on the order in which tiles are
//! made.
//!
//! A tile holds at most one river and one road, as its record does. If several of a kind wait at its edges, the one
//! with the longest way goes on, and the others end just behind the edge.

use crate::agents::heuristic::{RiverHeuristic, RoadHeuristic};
use crate::agents::record::{Passage, Records, TileRecord};
use crate::agents::search::{Heuristic, Node, Trace, TraceEnd, resume, rings, search};
use crate::agents::{Direction, Terrain, bed, highest, margin_cells};
use crate::area::{Area, TileId};
use crate::grid::Grid;
use crate::hash::{self, Stream};
use crate::lines::{Imprint, Line, LineId, LineKind, fade};
use crate::world::World;

/// Largest number of nodes that an agent may have in one tile, per cell of the tile's side; an agent with more walks in
/// circles. Even in the largest tiles the number of nodes fits into the 16 bits of a record.
pub const NODES_A_CELL: usize = 8;

/// Width in cells of the strip along a tile's edge in which the tile's own lines fade out. The strip is narrow, so that
/// the crossings, which do not fade, close the gap.
const EDGE_FADE_CELLS: i64 = 6;

/// Number of cells by which the crossing of an edge is extended to both sides, to close the gap that the faded lines
/// leave.
const CROSSING_CELLS: i64 = 3;

/// A tile in the making, as agents see it.
pub(super) struct TileAgents<'a> {
    world: &'a World,
    id: TileId,
    area: Area,
    heights: &'a Grid<f32>,
}

/// An agent that is about to walk through a tile.
#[derive(Clone, Copy)]
struct Leg {
    /// First node in the tile.
    start: Node,
    /// Last node in the previous tile, and the direction of the step from there.
    behind: Option<(Node, Direction)>,
    direction: Direction,
    before_cells: u32,
    lowest_m: f32,
}

impl<'a> TileAgents<'a> {
    /// Prepares the agents of the tile at `id`; `heights` are its bare heights with their pad.
    pub fn new(world: &'a World, id: TileId, heights: &'a Grid<f32>) -> TileAgents<'a> {
        TileAgents { world, id, area: id.area(world.tile_cells()), heights }
    }

    /// Makes the record and the lines of a tile that is made for the first time. `growth` is the direction in which the
    /// terrain grows there.
    ///
    /// A tile at which no agent waits starts a river, a road or both, as in the thesis. An agent leaves nothing if it
    /// would start in the sea, if it is a road and every way is too steep, or if it meets an existing tile before it
    /// has left its own.
    pub fn settle(&self, records: &Records, growth: Direction) -> (TileRecord, Vec<Line>) {
        let kinds = self.kinds();
        // Agents that wait at the edges go on. The tile starts agents of its own only if none waits.
        let waiting = kinds.filter_map(|kind| Some((kind, self.waiting(kind, records)?)));
        let mut legs: Vec<(LineKind, Leg)> = waiting.collect();
        if legs.is_empty() {
            legs = self.own_kinds().filter_map(|kind| Some((kind, self.started(kind, growth)?))).collect();
        }
        let mut record = TileRecord { id: self.id, river: None, road: None };
        let mut lines = Vec::new();
        for (kind, leg) in legs {
            if let Some((passage, nodes)) = self.walk(kind, leg, records) {
                lines.push(self.line(kind, &passage, nodes));
                match kind {
                    LineKind::River => record.river = Some(passage),
                    LineKind::Road => record.road = Some(passage),
                }
            }
        }
        (record, lines)
    }

    /// Makes the lines of a tile again from its record.
    pub fn lines(&self, record: &TileRecord) -> Vec<Line> {
        let again = |kind| {
            let passage = record.passage(kind)?;
            // A greedy way is the same up to the place where it was cut, so the number of nodes is enough to repeat it.
            let nodes = self.trace(kind, self.leg(kind, passage), passage.nodes as usize).nodes;
            Some(self.line(kind, passage, nodes))
        };
        self.kinds().filter_map(again).collect()
    }

    /// Lists the kinds of agents that the world has.
    fn kinds(&self) -> impl Iterator<Item = LineKind> + Clone + use<> {
        let preset = self.world.preset();
        let river = preset.rivers.is_some().then_some(LineKind::River);
        let road = preset.roads.is_some().then_some(LineKind::Road);
        [river, road].into_iter().flatten()
    }

    /// Lists the kinds of agents that the tile itself starts: the river, the road or both, by the tile's hash; if the
    /// world has one kind only, always that one.
    ///
    /// Densities apply to bakes only. With them most tiles would start no agent, and the thesis has no such tiles.
    fn own_kinds(&self) -> impl Iterator<Item = LineKind> + use<> {
        let stream = hash::stream(self.world.chance(), Stream::WalkerAgent);
        let left_out = match hash::lattice(stream, self.id.x, self.id.y) % 3 {
            0 => Some(LineKind::Road),
            1 => Some(LineKind::River),
            _ => None,
        };
        let is_only = self.kinds().count() == 1;
        self.kinds().filter(move |kind| is_only || Some(*kind) != left_out)
    }

    /// Returns the agent that waits at one of the tile's edges; if several do, the one with the longest way.
    fn waiting(&self, kind: LineKind, records: &Records) -> Option<Leg> {
        let stride = self.stride(kind);
        let mut farthest: Option<Leg> = None;
        for direction in Direction::ALL {
            let from = neighbour(self.id, direction.opposite());
            let Some(passage) = records.find(from).and_then(|record| record.passage(kind)) else { continue };
            let before_cells = passage.end_cells(stride as u32);
            // Of equally long ways the first direction wins, whichever tile was made first.
            if passage.exit == Some(direction) && farthest.is_none_or(|leg| before_cells > leg.before_cells) {
                let behind = vertex(from.area(self.world.tile_cells()), passage.last);
                farthest = Some(Leg {
                    start: step(behind, direction, stride),
                    behind: Some((behind, direction)),
                    direction: passage.direction,
                    before_cells,
                    lowest_m: passage.lowest_m,
                });
            }
        }
        farthest
    }

    /// Returns the agent that starts in the tile, unless the start would be in the sea. A river starts at the highest
    /// vertex, a road in the middle or at the nearest place from which there is a way on.
    fn started(&self, kind: LineKind, direction: Direction) -> Option<Leg> {
        let leg = |start| Leg { start, behind: None, direction, before_cells: 0, lowest_m: self.height_m(start) };
        let is_dry = |start| !self.ground().is_under_water(start);
        match kind {
            LineKind::River => {
                Some(highest(self.heights, self.area, self.margin_cells())).filter(|start| is_dry(*start)).map(leg)
            }
            LineKind::Road => {
                let (half, stride) = (self.world.tile_cells() as i64 / 2, self.stride(kind));
                let middle = (self.area.x0 + half, self.area.y0 + half);
                let dry = rings(middle, stride, (half - self.margin_cells()) / stride).filter(|start| is_dry(*start));
                dry.map(leg).find(|leg| {
                    let Trace { nodes, end } = self.trace(kind, *leg, 2);
                    nodes.len() > 1 || matches!(end, TraceEnd::Edge(_))
                })
            }
        }
    }

    /// Walks an agent through the tile for the first time; `None` if nothing of its way is left.
    fn walk(&self, kind: LineKind, leg: Leg, records: &Records) -> Option<(Passage, Vec<Node>)> {
        let Trace { mut nodes, end } = self.trace(kind, leg, NODES_A_CELL * self.world.tile_cells() as usize);
        let mut exit = None;
        if let TraceEnd::Edge(direction) = end {
            // A tile that was made once always comes back unchanged, so it blocks the way even while it is not loaded.
            if records.find(neighbour(self.id, direction)).is_none() {
                exit = Some(direction);
            } else if leg.behind.is_some() {
                // An agent that comes from another tile is already visible there, so it has to end in this tile: it
                // loses its last third. An agent that starts here was never visible, so it is dropped.
                nodes.truncate(nodes.len() - nodes.len() / 3);
            } else {
                return None;
            }
        }
        // An agent that has not moved is dropped.
        if nodes.len() == 1 && leg.behind.is_none() && exit.is_none() {
            return None;
        }
        // The largest tile has 4096 cells a side, so local coordinates fit into 16 bits.
        let local = |(x, y): Node| [(x - self.area.x0) as u16, (y - self.area.y0) as u16];
        let passage = Passage {
            start: local(leg.start),
            direction: leg.direction,
            entry: leg.behind.map(|(_, step)| step),
            exit,
            nodes: nodes.len() as u16,
            last: local(*nodes.last().expect("a trace has a node")),
            before_cells: leg.before_cells,
            lowest_before_m: leg.lowest_m,
            // Only nodes that are left count: ground that was cut off must not lower the bed beyond.
            lowest_m: nodes.iter().map(|node| self.height_m(*node)).fold(leg.lowest_m, f32::min),
        };
        Some((passage, nodes))
    }

    /// Restores the agent of a passage as it was before it walked through the tile.
    fn leg(&self, kind: LineKind, passage: &Passage) -> Leg {
        let start = vertex(self.area, passage.start);
        let behind = passage.entry.map(|entry| (step(start, entry.opposite(), self.stride(kind)), entry));
        let Passage { direction, before_cells, lowest_before_m, .. } = *passage;
        Leg { start, behind, direction, before_cells, lowest_m: lowest_before_m }
    }

    fn trace(&self, kind: LineKind, leg: Leg, most: usize) -> Trace {
        let (mut ground, preset) = (self.ground(), self.world.preset());
        match (kind, &preset.rivers, &preset.roads) {
            (LineKind::River, Some(rivers), _) => {
                let heuristic = RiverHeuristic::resumed(&mut ground, rivers, leg.direction, leg.lowest_m);
                let mut trace = self.go(heuristic, leg, most);
                // A river ends where it reaches the sea.
                if let Some(mouth) = trace.nodes.iter().position(|node| self.ground().is_under_water(*node)) {
                    trace.nodes.truncate(mouth + 1);
                    // Replaces any other reason: a river that has reached the sea waits at no edge.
                    trace.end = TraceEnd::Refused;
                }
                trace
            }
            (LineKind::Road, _, Some(roads)) => {
                self.go(RoadHeuristic::new(&mut ground, roads, leg.direction), leg, most)
            }
            _ => unreachable!("only kinds that the world has walk"),
        }
    }

    fn go(&self, heuristic: impl Heuristic, leg: Leg, most: usize) -> Trace {
        let mut heuristic = ClearOfEdges { heuristic, area: self.area, margin_cells: self.margin_cells() };
        match leg.behind {
            None => search(&mut heuristic, leg.start, self.area, most),
            // The step over the edge is always taken, because the tile behind already shows it.
            Some((behind, _)) if heuristic.refuses(behind, leg.start) => {
                Trace { nodes: vec![leg.start], end: TraceEnd::Refused }
            }
            Some((behind, _)) => resume(&mut heuristic, behind, leg.start, self.area, most),
        }
    }

    /// Returns the width in cells of the margin in which agents may go across the tile's edge but not along it. A bed
    /// along an edge would be cut off there, because an existing tile never changes. The thesis has no such rule, so
    /// its beds are cut off.
    fn margin_cells(&self) -> i64 {
        margin_cells(self.world.tile_cells())
    }

    /// Makes the line of a passage, from the last node before the tile to the first node after it.
    fn line(&self, kind: LineKind, passage: &Passage, nodes: Vec<Node>) -> Line {
        let leg = self.leg(kind, passage);
        // Also for an agent that still waits: the tile beyond may be made much later, when this tile can no longer
        // change.
        let beyond = passage.exit.map(|exit| step(vertex(self.area, passage.last), exit, self.stride(kind)));
        let line: Vec<Node> = leg.behind.map(|(node, _)| node).into_iter().chain(nodes).chain(beyond).collect();
        let mut heights: Vec<f32> = line.iter().map(|node| self.height_m(*node)).collect();
        if kind == LineKind::River {
            // The floor never rises, not even across edges.
            heights[0] = heights[0].min(leg.lowest_m);
        }
        self.bed(kind, &line, &heights, leg.before_cells)
    }

    /// Makes the line along nodes; `heights` are those of the ground there, and `before_cells` is the length of the way
    /// before the first node.
    fn bed(&self, kind: LineKind, line: &[Node], heights: &[f32], before_cells: u32) -> Line {
        let (preset, spacing_m) = (self.world.preset(), self.world.spacing_m());
        let id = LineId::Agent { kind, owner: self.id };
        match (kind, &preset.rivers, &preset.roads) {
            (LineKind::River, Some(rivers), _) => {
                // A classic river may go further than that length, and then keeps its width. Up to there it grows like
                // an order-free river.
                let reach_cells = (rivers.max_tiles + 1) as f32 * self.world.tile_cells() as f32;
                bed::river(id, line, heights, rivers, spacing_m, [before_cells as f32, reach_cells])
            }
            (LineKind::Road, _, Some(roads)) => bed::road(id, line, heights, roads, spacing_m),
            _ => unreachable!("only kinds that the world has leave a bed"),
        }
    }

    /// Computes the imprint of the tile's lines and crossings.
    ///
    /// An existing tile never changes, and each line is known on one side of the edge only. So lines fade out towards
    /// the edges. There, only the crossings remain: the steps of agents over the edge, which both tiles know. They give
    /// both tiles the same heights, normals and ground at the vertices that they share.
    pub fn imprint(&self, lines: &[Line], crossings: &[(Direction, Line)]) -> Option<Imprint> {
        let mut imprint = Imprint::new(self.heights, None, lines);
        if let Some(imprint) = &mut imprint {
            fade_out(imprint, self.area, None);
        }
        // Added after the tile's own lines have faded; otherwise the crossings would fade with them.
        for (edge, line) in crossings {
            // Limited to the surroundings of the crossing, because the cost of an imprint grows with its area.
            let Some(near) = line.bounds.common(&self.heights.area()) else { continue };
            if let Some(mut crossing) = Imprint::new(&self.heights.part(near), None, [line]) {
                fade_out(&mut crossing, self.area, Some(*edge));
                imprint.get_or_insert_with(|| Imprint::blank(self.heights.area())).merge(&crossing);
            }
        }
        imprint
    }

    /// Returns the steps of agents over each edge of the tile, in both directions: those that were taken, those that
    /// agents wait for, and those that no agent continues.
    pub fn crossings(&self, records: &Records) -> Vec<(Direction, Line)> {
        let mut crossings = Vec::new();
        for kind in self.kinds() {
            for edge in Direction::ALL {
                // From both sides, so that both tiles find the same crossings, whichever was made first.
                for (from, exit) in [(self.id, edge), (neighbour(self.id, edge), edge.opposite())] {
                    let passage = records.find(from).and_then(|record| record.passage(kind));
                    let Some(passage) = passage.filter(|passage| passage.exit == Some(exit)) else { continue };
                    crossings.push((edge, self.crossing(kind, from, passage, exit)));
                }
            }
        }
        crossings
    }

    /// Makes the line of an agent's step over an edge, of which both tiles must compute the same.
    fn crossing(&self, kind: LineKind, from: TileId, passage: &Passage, exit: Direction) -> Line {
        let stride = self.stride(kind);
        let last = vertex(from.area(self.world.tile_cells()), passage.last);
        let end_cells = passage.end_cells(stride as u32);
        match kind {
            LineKind::River => {
                // Straight, because the neighbour's record tells nothing about the nodes before the last one.
                let nodes = (-CROSSING_CELLS..=1 + CROSSING_CELLS).map(|cells| step(last, exit, cells));
                let line: Vec<Node> = nodes.collect();
                let mut heights: Vec<f32> = line.iter().map(|node| self.height_m(*node)).collect();
                let (above, below) = heights.split_at_mut(CROSSING_CELLS as usize);
                self.levels_above(passage, last, exit, above);
                below[0] = below[0].min(passage.lowest_m);
                // The line begins before the last node, perhaps even before the river's source, so the length must not
                // become negative.
                self.bed(kind, &line, &heights, end_cells.saturating_sub(CROSSING_CELLS as u32))
            }
            LineKind::Road => {
                // Agents cross the margin straight, so the road continues straight to both sides.
                let straight = if stride > self.margin_cells() { 0..=1 } else { -1..=2 };
                let line: Vec<Node> = straight.map(|steps| step(last, exit, steps * stride)).collect();
                let heights: Vec<f32> = line.iter().map(|node| self.height_m(*node)).collect();
                self.bed(kind, &line, &heights, end_cells)
            }
        }
    }

    /// Lowers the heights at the nodes before the `last` one of a passage to the lowest ground that its river has
    /// passed, as far as the record tells.
    fn levels_above(&self, passage: &Passage, last: Node, exit: Direction, heights: &mut [f32]) {
        // The river has crossed the margin straight, so its nodes there are known.
        let straight = -self.margin_cells().max(CROSSING_CELLS)..=0;
        let ground: Vec<f32> = straight.map(|cells| self.height_m(step(last, exit, cells))).collect();
        let lowest_m = ground.iter().copied().fold(f32::INFINITY, f32::min);
        // If all this ground is higher than the lowest on the way, the river cuts through a bump and keeps that lowest
        // level. Otherwise it comes down to its lowest ground here.
        let mut level_m = if lowest_m > passage.lowest_m { passage.lowest_m } else { f32::INFINITY };
        let before = ground.len() - 1 - heights.len();
        for (at, height_m) in ground[..ground.len() - 1].iter().enumerate() {
            level_m = level_m.min(*height_m);
            if at >= before {
                heights[at - before] = level_m;
            }
        }
    }

    fn stride(&self, kind: LineKind) -> i64 {
        match (kind, &self.world.preset().roads) {
            (LineKind::Road, Some(roads)) => roads.step_cells as i64,
            _ => 1,
        }
    }

    /// Returns the bare height of a vertex in metres, inside or outside the tile.
    fn height_m(&self, (x, y): Node) -> f32 {
        let place = Area::new(x, y, 1, 1);
        if self.heights.area().contains(&place) {
            self.heights.at(x, y)
        } else {
            // Bare ground outside too: a neighbouring tile is carved, and may not exist yet.
            self.world.relief().heights(place).at(x, y)
        }
    }

    fn ground(&self) -> TileTerrain<'_> {
        let preset = self.world.preset();
        TileTerrain {
            area: self.area,
            heights: self.heights,
            half_per_spacing: (0.5 / preset.spacing_m) as f32,
            slope_scale: preset.ground.slope_scale as f32,
            sea_level_m: preset.sea_level_m.map(|level_m| level_m as f32),
        }
    }
}

/// Wraps a heuristic to keep agents from going along an edge of the tile within its margin.
struct ClearOfEdges<H> {
    heuristic: H,
    area: Area,
    margin_cells: i64,
}

impl<H: Heuristic> Heuristic for ClearOfEdges<H> {
    fn stride(&self) -> i64 {
        self.heuristic.stride()
    }

    fn score(&mut self, from: Node, to: Node, step: Direction) -> Option<f32> {
        let Area { x0, y0, x1, y1 } = self.area;
        let cells = match step {
            Direction::East | Direction::West => (from.1 - y0).min(y1 - 1 - from.1),
            Direction::North | Direction::South => (from.0 - x0).min(x1 - 1 - from.0),
        };
        // Only the way along an edge is closed: across the edge agents must go, or none would leave its tile.
        if cells < self.margin_cells { None } else { self.heuristic.score(from, to, step) }
    }

    fn refuses(&mut self, from: Node, to: Node) -> bool {
        self.heuristic.refuses(from, to)
    }
}

fn step((x, y): Node, direction: Direction, stride: i64) -> Node {
    let (east, south) = direction.step();
    (x + east * stride, y + south * stride)
}

fn neighbour(id: TileId, direction: Direction) -> TileId {
    let (x, y) = step((id.x, id.y), direction, 1);
    TileId { x, y }
}

/// Weakens an imprint towards the edges of `tile`, except an `open` one, until it is exactly zero one vertex before the
/// edge.
fn fade_out(imprint: &mut Imprint, tile: Area, open: Option<Direction>) {
    let area = imprint.area();
    // An open edge is never the nearest, because its distance is set to the maximum.
    let far = |direction, cells: i64| if open == Some(direction) { i64::MAX } else { cells };
    let across = |x: i64| far(Direction::West, x - tile.x0).min(far(Direction::East, tile.x1 - 1 - x));
    let down = |y: i64| far(Direction::North, y - tile.y0).min(far(Direction::South, tile.y1 - 1 - y));
    for y in area.y0..area.y1 {
        let cells_south = down(y);
        // Between the western and eastern strips only the northern and southern edges matter.
        let (west, east) = match cells_south > EDGE_FADE_CELLS {
            true => (tile.x0 + EDGE_FADE_CELLS + 1, tile.x1 - 1 - EDGE_FADE_CELLS),
            false => (area.x1, area.x1),
        };
        // No vertex is weakened twice, even where the two strips would overlap.
        for x in (area.x0..west.min(area.x1)).chain(east.max(west).max(area.x0)..area.x1) {
            let cells = cells_south.min(across(x));
            if cells <= EDGE_FADE_CELLS {
                // Normals on an edge depend on the vertices beside it, so these stay bare as well. In the pad
                // `cells - 1` is below 0.
                imprint.weaken(x, y, 1.0 - fade((cells - 1).max(0) as f32 / EDGE_FADE_CELLS as f32));
            }
        }
    }
}

fn vertex(area: Area, [east, south]: [u16; 2]) -> Node {
    (area.x0 + east as i64, area.y0 + south as i64)
}

/// The bare ground of one tile.
struct TileTerrain<'a> {
    area: Area,
    heights: &'a Grid<f32>,
    half_per_spacing: f32,
    slope_scale: f32,
    sea_level_m: Option<f32>,
}

impl TileTerrain<'_> {
    /// Returns the tile's vertex that is nearest: a road looks several vertices ahead, beyond the edge and its pad.
    fn nearest(&self, (x, y): Node) -> Node {
        (x.clamp(self.area.x0, self.area.x1 - 1), y.clamp(self.area.y0, self.area.y1 - 1))
    }
}

impl Terrain for TileTerrain<'_> {
    fn height_m(&mut self, (x, y): Node) -> f32 {
        self.heights.at(x, y)
    }

    fn steepness(&mut self, node: Node) -> f32 {
        let (x, y) = self.nearest(node);
        let difference = |from: f32, to: f32| (to - from) * self.half_per_spacing;
        // Across an edge the neighbours lie in the pad, which is the same for both tiles.
        let east = difference(self.heights.at(x - 1, y), self.heights.at(x + 1, y));
        let south = difference(self.heights.at(x, y - 1), self.heights.at(x, y + 1));
        let up = 1.0 / (east * east + south * south + 1.0).sqrt();
        (self.slope_scale * (1.0 - up)).min(1.0)
    }

    fn is_under_water(&mut self, node: Node) -> bool {
        let (x, y) = self.nearest(node);
        self.sea_level_m.is_some_and(|level_m| self.heights.at(x, y) < level_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::preset::Preset;
    use crate::tile;
    use crate::walker::{Walker, WalkerOptions};

    /// Rise in metres that is tolerated where a river's floor passes from one of its lines to the next.
    const RISE_M: f64 = 0.05;

    #[test]
    fn roads_start_where_there_is_a_way_on() {
        let mut preset = Preset::load("thesis").unwrap().1;
        // The test relies on the terrain of this seed alone.
        preset.country = None;
        preset.tile_cells = 64;
        let world = World::new(preset, Some(7)).unwrap();
        let (mut middle, mut beside, mut none) = (0, 0, 0);
        // A quarter of these tiles lie on the flank of a mountain, which is too steep everywhere.
        for id in (0..12).flat_map(|y| (0..12).map(move |x| TileId { x, y })) {
            let heights = world.relief().heights(tile::shaped_input(&world, id.area(64)));
            let agents = TileAgents::new(&world, id, &heights);
            match agents.started(LineKind::Road, Direction::South) {
                Some(leg) if leg.start == (id.x * 64 + 32, id.y * 64 + 32) => middle += 1,
                Some(leg) => {
                    let trace = agents.trace(LineKind::Road, leg, 2);
                    assert!(trace.nodes.len() > 1 || trace.end != TraceEnd::Refused, "tile {id}");
                    beside += 1;
                }
                None => none += 1,
            }
        }
        assert!(beside > 20 && none < 50, "{middle} start in the middle, {beside} beside it and {none} not at all");
    }

    #[test]
    fn no_floor_rises_downstream_across_an_edge() {
        let mut preset = Preset::load("thesis").unwrap().1;
        // The test relies on the terrain of this seed alone.
        preset.country = None;
        preset.tile_cells = 64;
        preset.roads = None;
        let world = World::new(preset, Some(7)).unwrap();
        let mut walker = Walker::new(&world, WalkerOptions::default());
        for step in 1..400 {
            let (east, south) = (step % 40, step / 40);
            let east = if south % 2 == 0 { east } else { 40 - east };
            walker.move_to(64.0 * (east as f64 + 0.5), 64.0 * (3 * south) as f64 + 32.0).unwrap();
        }
        let bare = |id: TileId| world.relief().heights(tile::shaped_input(&world, id.area(64)));
        let (mut crossed, mut worst_m, mut risen) = (0, 0f64, 0);
        for record in walker.records() {
            let Some((passage, exit)) = record.river.and_then(|river| Some((river, river.exit?))) else { continue };
            let heights = bare(record.id);
            let agents = TileAgents::new(&world, record.id, &heights);
            let crossing = agents.crossing(LineKind::River, record.id, &passage, exit);
            // The tile on the other side must compute the same.
            let other = neighbour(record.id, exit);
            let beyond = bare(other);
            let theirs = TileAgents::new(&world, other, &beyond).crossing(LineKind::River, record.id, &passage, exit);
            assert_eq!(crossing.points, theirs.points, "out of {} to the {}", record.id, exit.name());
            // Positions in cells along the direction of the exit, from the tile's own line to the crossing.
            let (east, south) = exit.step();
            let cells = |line: &Line, place: [f64; 2]| {
                let [x, y] = [line.origin[0] as f64 + place[0], line.origin[1] as f64 + place[1]];
                x * east as f64 + y * south as f64
            };
            let own = &agents.lines(record)[0];
            for point in &crossing.points {
                let at = cells(&crossing, point.place);
                let above = own.points.iter().rev().find(|above| cells(own, above.place) <= at);
                let Some(above) = above else { continue };
                let rise_m = point.floor_m - above.floor_m;
                risen += usize::from(rise_m > RISE_M);
                worst_m = worst_m.max(rise_m);
            }
            crossed += 1;
        }
        assert!(crossed > 100, "{crossed} rivers cross edges");
        assert!(worst_m <= RISE_M, "{risen} of {crossed} floors rise, by {worst_m} m at most");
    }
}
