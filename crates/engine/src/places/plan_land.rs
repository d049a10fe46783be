//! The coarse lattice on which places are planned, and the land on it, block by block.

use std::collections::BTreeSet;
use std::sync::Arc;

use crate::area::Area;
use crate::fluvial::survey::{RiverPiece, Sampling, Survey};
use crate::land::WaterKind;
use crate::lines::FIXED;
use crate::memory::{Memory, Remembers, heap_bytes};

/// A node of the plan: column and row, from the world's origin or from a window's first node.
pub(super) type PlanNode = [i64; 2];

/// How far apart things are looked at. All lengths are whole vertices, and sites lie on nodes of the plan.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scale {
    /// Metres between vertices.
    pub spacing_m: f64,
    /// Vertices from a node of the plan to the next.
    pub step: i64,
    /// Vertices from a point of a planned road to the next.
    pub apart: i64,
    /// Vertices from a node to the next of the land that is asked about along a planned road.
    // Twice as far as its points: a quarter of the land, which is all that a profile sees of its gullies.
    pub fine: i64,
    /// Nodes a side of a site cell.
    pub side: i64,
}

/// Metres between nodes of the plan, at most. Chosen by eye: half of it is the least that a curve has to turn in, enough for an
/// arc of a track by 145 degrees.
const STEP_M: f64 = 80.0;

impl Scale {
    pub fn new(site_m: f64, spacing_m: f64) -> Scale {
        // Few nodes would make poor plans, and many would take much memory: a search holds 256 bytes for each of up to
        // 550 x 550, of which there are so many only for the longest edges.
        let most_m = STEP_M.min(site_m / 32.0).max(site_m / 64.0);
        let mut step = 1;
        while (step * 2) as f64 * spacing_m <= most_m {
            step *= 2;
        }
        // Even, so that half as many are a side of the same length.
        let side = 2 * (site_m / (2 * step) as f64 / spacing_m + 0.5) as i64;
        Scale { spacing_m, step, apart: (step / 8).max(1), fine: (step / 4).max(1), side }
    }

    /// That of nodes twice as far apart.
    pub fn doubled(self) -> Scale {
        Scale { step: 2 * self.step, side: self.side / 2, ..self }
    }

    /// Metres between nodes.
    pub fn step_m(&self) -> f64 {
        self.step as f64 * self.spacing_m
    }

    /// The vertex of a node.
    pub fn vertex(&self, node: PlanNode) -> [i64; 2] {
        node.map(|at| at * self.step)
    }

    /// The node of a vertex, or the next one north-west of it.
    pub fn node(&self, vertex: [i64; 2]) -> PlanNode {
        vertex.map(|at| at.div_euclid(self.step))
    }

    /// A length in metres in 1/256 vertex.
    pub fn fixed_length(&self, metres: f64) -> f64 {
        metres / self.spacing_m * FIXED as f64
    }

    /// A node in 1/256 vertex.
    pub fn fixed(&self, node: PlanNode) -> [i64; 2] {
        self.vertex(node).map(|at| at * FIXED)
    }
}

/// Nodes a side of a block of land that is remembered.
const BLOCK: i64 = 16;

/// Bytes of blocks that are remembered: more than the largest search looks at, which has 550 x 550 nodes of 5 bytes.
const REMEMBERED: usize = 6 << 20;

/// The plans of a world.
#[derive(Debug)]
pub(super) struct Plans {
    /// That on which ways are searched.
    pub fine: PlanLand,
    /// That on which seats and corridors are looked for: its nodes are twice as far apart, and dry brooks are not known.
    pub coarse: PlanLand,
    /// The rivers of both.
    pub rivers: PlanRivers,
}

impl Plans {
    /// Those of a world with such a fine plan.
    pub fn new(scale: Scale) -> Plans {
        let coarse = scale.doubled();
        Plans {
            fine: PlanLand::new(scale, true),
            coarse: PlanLand::new(coarse, false),
            rivers: PlanRivers::new(&coarse),
        }
    }

    /// Their memories.
    pub fn memories(&self) -> Vec<&dyn Remembers> {
        vec![&self.fine.blocks, &self.coarse.blocks, &self.rivers.squares]
    }
}

/// The land on the nodes of the plan, remembered block by block.
#[derive(Debug)]
pub(super) struct PlanLand {
    pub scale: Scale,
    /// How finely it is surveyed.
    sampling: Sampling,
    blocks: Memory<(i64, i64), PlanBlock>,
}

#[derive(Debug)]
struct PlanBlock {
    heights_m: Vec<f32>,
    waters: Vec<WaterKind>,
}

heap_bytes!(PlanBlock: heights_m, waters);

/// The land on a rectangle of nodes.
#[derive(Debug)]
pub(super) struct Window {
    /// The first node. In a window others are counted from it.
    pub at: PlanNode,
    pub cols: usize,
    pub rows: usize,
    /// A height a node, row by row.
    heights_m: Vec<f32>,
    /// The water on each node, row by row.
    waters: Vec<WaterKind>,
    /// Each piece that touches the rectangle once, sorted.
    pub rivers: Vec<RiverPiece>,
}

impl PlanLand {
    fn new(scale: Scale, dry_brooks: bool) -> PlanLand {
        let sampling = Sampling { step: scale.step, dry_brooks };
        PlanLand { scale, sampling, blocks: Memory::new(REMEMBERED) }
    }

    /// The land on `cols` x `rows` nodes from node `at` on, in those blocks of nodes that will be looked at; elsewhere it is
    /// level and dry.
    pub fn window(
        &self,
        land: &dyn Survey,
        rivers: &PlanRivers,
        at: PlanNode,
        (cols, rows): (usize, usize),
        is_looked_at: impl Fn(Area) -> bool,
    ) -> Window {
        let mut window = Window {
            at,
            cols,
            rows,
            heights_m: vec![0.0; cols * rows],
            waters: vec![WaterKind::Dry; cols * rows],
            rivers: Vec::new(),
        };
        let area = Area::new(at[0], at[1], cols, rows);
        let mut squares = BTreeSet::new();
        let blocks = |from: i64, to: i64| from.div_euclid(BLOCK)..=(to - 1).div_euclid(BLOCK);
        for by in blocks(area.y0, area.y1) {
            for bx in blocks(area.x0, area.x1) {
                let own = Area::new(bx * BLOCK, by * BLOCK, BLOCK as usize, BLOCK as usize);
                if !is_looked_at(own) {
                    continue;
                }
                let block = self.block(land, (bx, by));
                let part = area.common(&own).expect("the block lies under the window");
                copy(&block.heights_m, own, &mut window.heights_m, area, part);
                copy(&block.waters, own, &mut window.waters, area, part);
                let [x0, y0] = self.scale.vertex([own.x0, own.y0]);
                let side = own.width() * self.scale.step as usize + 1;
                squares.extend(rivers.squares(Area::new(x0, y0, side, side)));
            }
        }
        for square in squares {
            window.rivers.extend(rivers.of(land, square).iter());
        }
        // Squares that a piece lies in both have it.
        window.rivers.sort_by_key(RiverPiece::key);
        window.rivers.dedup_by_key(|piece| piece.key());
        window
    }

    fn block(&self, land: &dyn Survey, (bx, by): (i64, i64)) -> Arc<PlanBlock> {
        self.blocks.get((bx, by), || {
            let side = BLOCK as usize;
            let [x0, y0] = self.scale.vertex([bx * BLOCK, by * BLOCK]);
            PlanBlock {
                heights_m: land.heights_m(x0, y0, self.sampling, side, side),
                waters: land.waters(x0, y0, self.sampling, side, side),
            }
        })
    }
}

/// The rivers of the land, remembered by squares.
#[derive(Debug)]
pub(super) struct PlanRivers {
    /// Vertices a side of a square.
    side: i64,
    squares: Memory<(i64, i64), Vec<RiverPiece>>,
}

impl PlanRivers {
    /// Those of a world with such a coarse plan: in squares of four of its blocks, since rivers are bent into a square from far
    /// around.
    fn new(scale: &Scale) -> PlanRivers {
        PlanRivers { side: 2 * scale.step * BLOCK, squares: Memory::new(REMEMBERED) }
    }

    /// The squares that an area lies in.
    fn squares(&self, area: Area) -> impl Iterator<Item = (i64, i64)> + use<> {
        let side = self.side;
        let span = move |from: i64, to: i64| from.div_euclid(side)..=(to - 1).div_euclid(side);
        span(area.y0, area.y1).flat_map(move |y| span(area.x0, area.x1).map(move |x| (x, y)))
    }

    /// The pieces that touch a square.
    fn of(&self, land: &dyn Survey, (x, y): (i64, i64)) -> Arc<Vec<RiverPiece>> {
        let side = self.side as usize;
        self.squares.get((x, y), || land.rivers(&Area::new(x * self.side, y * self.side, side, side)))
    }
}

/// Copies the nodes of `part`.
fn copy<T: Copy>(from: &[T], from_area: Area, to: &mut [T], to_area: Area, part: Area) {
    let at = |area: Area, y: i64| (y - area.y0) as usize * area.width() + (part.x0 - area.x0) as usize;
    let len = part.width();
    for y in part.y0..part.y1 {
        let (source, target) = (at(from_area, y), at(to_area, y));
        to[target..target + len].copy_from_slice(&from[source..source + len]);
    }
}

impl Window {
    /// A node of the world as one of the window.
    pub fn inner(&self, [x, y]: PlanNode) -> PlanNode {
        [x - self.at[0], y - self.at[1]]
    }

    /// Whether a node lies in the window.
    pub fn holds(&self, [col, row]: PlanNode) -> bool {
        (0..self.cols as i64).contains(&col) && (0..self.rows as i64).contains(&row)
    }

    /// The number of a node, row by row.
    pub fn index(&self, [col, row]: PlanNode) -> usize {
        row as usize * self.cols + col as usize
    }

    /// The node of a number.
    pub fn node(&self, index: usize) -> PlanNode {
        [(index % self.cols) as i64, (index / self.cols) as i64]
    }

    /// All nodes, row by row.
    pub fn nodes(&self) -> impl Iterator<Item = PlanNode> {
        (0..self.cols * self.rows).map(|index| self.node(index))
    }

    /// The height of a node in metres.
    pub fn height_m(&self, node: PlanNode) -> f64 {
        self.heights_m[self.index(node)] as f64
    }

    /// The water at a node; what is outside is dry.
    pub fn water(&self, node: PlanNode) -> WaterKind {
        if self.holds(node) { self.waters[self.index(node)] } else { WaterKind::Dry }
    }

    /// Whether there is a lake or the sea on any node.
    pub fn has_open_water(&self) -> bool {
        self.waters.iter().any(|water| water.is_open())
    }

    /// The steepness at a node from its neighbours, metres up a metre east and south; 0 across the window's edge.
    pub fn gradient(&self, [col, row]: PlanNode, step_m: f64) -> [f64; 2] {
        let rise = |a: PlanNode, b: PlanNode| match self.holds(a) && self.holds(b) {
            true => (self.height_m(b) - self.height_m(a)) / (2.0 * step_m),
            false => 0.0,
        };
        [rise([col - 1, row], [col + 1, row]), rise([col, row - 1], [col, row + 1])]
    }
}
