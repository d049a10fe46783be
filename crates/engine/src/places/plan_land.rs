//! The lattice of nodes on which settlements and roads are planned, fine and coarse, and the land on it, block by
//! block.
//!
//! To judge the numbers chosen by eye, look at the tightest bends of tracks in `alps`.

use std::collections::BTreeSet;
use std::sync::Arc;

use crate::area::Area;
use crate::fluvial::survey::{RiverPiece, Sampling, Survey, Surveyed};
use crate::land::WaterKind;
use crate::lines::FIXED;
use crate::memory::{Memory, Remembers, heap_bytes};
use crate::stop::Stopped;

/// A node of the plan: column and row, counted from the world's origin or from a window's first node.
pub(super) type PlanNode = [i64; 2];

/// Distances at which the land is sampled. All are whole numbers of vertices, and sites lie on nodes of the plan.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlanScale {
    /// Metres between vertices.
    pub spacing_m: f64,
    /// Vertices from one node of the plan to the next.
    pub step: i64,
    /// Vertices from one point of a planned road to the next.
    pub apart: i64,
    /// Vertices from one sample of the land along a planned road to the next.
    // Twice the distance of the road's points: this takes a quarter of the land, and a profile cannot show the gullies
    // between the samples anyway.
    pub fine: i64,
    /// Nodes along a side of a site cell.
    pub side: i64,
}

/// Largest distance in metres between nodes of the plan. Chosen by eye: half of it is the least room that a curve has
/// to turn in, enough for a track to turn by 145 degrees.
const STEP_M: f64 = 80.0;

impl PlanScale {
    pub fn new(site_m: f64, spacing_m: f64) -> PlanScale {
        // Few nodes would make poor plans, and many would take much memory: a search holds 256 bytes for each of up to
        // 550 x 550 nodes. The longest edges alone need so many.
        let most_m = STEP_M.min(site_m / 32.0).max(site_m / 64.0);
        let mut step = 1;
        while (step * 2) as f64 * spacing_m <= most_m {
            step *= 2;
        }
        // Even, so that the coarse plan has half as many nodes along the same side.
        let side = 2 * (site_m / (2 * step) as f64 / spacing_m + 0.5) as i64;
        PlanScale { spacing_m, step, apart: (step / 8).max(1), fine: (step / 4).max(1), side }
    }

    /// Returns the scale with nodes twice as far apart.
    pub fn doubled(self) -> PlanScale {
        PlanScale { step: 2 * self.step, side: self.side / 2, ..self }
    }

    /// Returns the distance in metres between nodes.
    pub fn step_m(&self) -> f64 {
        self.step as f64 * self.spacing_m
    }

    /// Returns the vertex of a node.
    pub fn vertex(&self, node: PlanNode) -> [i64; 2] {
        node.map(|at| at * self.step)
    }

    /// Returns the node at a vertex, or the next node north-west of it.
    pub fn node(&self, vertex: [i64; 2]) -> PlanNode {
        vertex.map(|at| at.div_euclid(self.step))
    }

    /// Converts a length in metres to 1/256 vertex.
    pub fn fixed_length(&self, metres: f64) -> f64 {
        metres / self.spacing_m * FIXED as f64
    }

    /// Returns the place of a node in 1/256 vertex.
    pub fn fixed(&self, node: PlanNode) -> [i64; 2] {
        self.vertex(node).map(|at| at * FIXED)
    }
}

/// Side of a cached block of land in nodes.
const BLOCK: i64 = 16;

/// Bytes of cached blocks: more than the largest search looks at, which covers 550 x 550 nodes of 5 bytes.
const REMEMBERED: usize = 6 << 20;

/// The fine and the coarse plan of a world.
#[derive(Debug)]
pub(super) struct Plans {
    /// The plan on which routes are searched.
    pub fine: PlanLand,
    /// The plan on which seats and corridors are found: its nodes are twice as far apart, and it leaves out dry brooks.
    pub coarse: PlanLand,
    /// The rivers, for both plans.
    pub rivers: PlanRivers,
}

impl Plans {
    /// Creates the plans of a world from the scale of the fine one.
    pub fn new(scale: PlanScale) -> Plans {
        let coarse = scale.doubled();
        Plans {
            fine: PlanLand::new(scale, true),
            coarse: PlanLand::new(coarse, false),
            rivers: PlanRivers::new(&coarse),
        }
    }

    /// Returns the caches.
    pub fn memories(&self) -> Vec<&dyn Remembers> {
        vec![&self.fine.blocks, &self.coarse.blocks, &self.rivers.squares]
    }
}

/// The land on the nodes of a plan, cached block by block.
#[derive(Debug)]
pub(super) struct PlanLand {
    pub scale: PlanScale,
    /// The sampling of the survey: distance of nodes, and whether dry brooks are included.
    sampling: Sampling,
    blocks: Memory<[i64; 2], PlanBlock>,
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
    /// The first node, in the world. The nodes of a window are counted from it.
    pub at: PlanNode,
    pub cols: usize,
    pub rows: usize,
    /// The height of each node in metres, row by row.
    heights_m: Vec<f32>,
    /// The water on each node, row by row.
    waters: Vec<WaterKind>,
    /// The river pieces that touch the rectangle, and some around it: sorted, without repetition.
    pub rivers: Vec<RiverPiece>,
}

impl PlanLand {
    fn new(scale: PlanScale, dry_brooks: bool) -> PlanLand {
        let sampling = Sampling { step: scale.step, dry_brooks };
        PlanLand { scale, sampling, blocks: Memory::new(REMEMBERED) }
    }

    /// Returns the land on `cols` x `rows` nodes from node `at` on. Only the blocks of nodes that `is_looked_at`
    /// accepts are surveyed; the rest is level and dry.
    pub fn window(
        &self,
        land: Surveyed<'_>,
        rivers: &PlanRivers,
        at: PlanNode,
        (cols, rows): (usize, usize),
        is_looked_at: impl Fn(Area) -> bool,
    ) -> Result<Window, Stopped> {
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
        for [bx, by] in area.square_numbers(BLOCK) {
            let own = Area::new(bx * BLOCK, by * BLOCK, BLOCK as usize, BLOCK as usize);
            if !is_looked_at(own) {
                continue;
            }
            land.clock.check()?;
            let block = self.block(land.survey, [bx, by]);
            let part = area.common(&own).expect("the block lies under the window");
            copy(&block.heights_m, own, &mut window.heights_m, area, part);
            copy(&block.waters, own, &mut window.waters, area, part);
            let [x0, y0] = self.scale.vertex([own.x0, own.y0]);
            let side = own.width() * self.scale.step as usize + 1;
            squares.extend(Area::new(x0, y0, side, side).square_numbers(rivers.side));
        }
        for square in squares {
            land.clock.check()?;
            window.rivers.extend(rivers.of(land.survey, square).iter());
        }
        // A piece that touches several squares is listed by each of them.
        window.rivers.sort_by_key(RiverPiece::key);
        window.rivers.dedup_by_key(|piece| piece.key());
        Ok(window)
    }

    fn block(&self, land: &dyn Survey, at: [i64; 2]) -> Arc<PlanBlock> {
        self.blocks.get(at, || {
            let side = BLOCK as usize;
            let [x0, y0] = self.scale.vertex(at.map(|at| at * BLOCK));
            PlanBlock {
                heights_m: land.heights_m(x0, y0, self.sampling, side, side),
                waters: land.waters(x0, y0, self.sampling, side, side),
            }
        })
    }
}

/// The rivers of the land, cached by squares.
#[derive(Debug)]
pub(super) struct PlanRivers {
    /// Side of a square in vertices.
    side: i64,
    squares: Memory<[i64; 2], Vec<RiverPiece>>,
}

impl PlanRivers {
    /// Creates the cache for a world with such a coarse plan. A square is as large as four blocks of the plan, since
    /// the bends of a river in a square depend on land far around it.
    fn new(scale: &PlanScale) -> PlanRivers {
        PlanRivers { side: 2 * scale.step * BLOCK, squares: Memory::new(REMEMBERED) }
    }

    /// Returns the river pieces that touch a square.
    fn of(&self, land: &dyn Survey, [x, y]: [i64; 2]) -> Arc<Vec<RiverPiece>> {
        let side = self.side as usize;
        self.squares.get([x, y], || land.rivers(&Area::new(x * self.side, y * self.side, side, side)))
    }
}

/// Copies the nodes of `part` from one row-by-row raster to another.
fn copy<T: Copy>(from: &[T], from_area: Area, to: &mut [T], to_area: Area, part: Area) {
    let at = |area: Area, y: i64| (y - area.y0) as usize * area.width() + (part.x0 - area.x0) as usize;
    let len = part.width();
    for y in part.y0..part.y1 {
        let (source, target) = (at(from_area, y), at(to_area, y));
        to[target..target + len].copy_from_slice(&from[source..source + len]);
    }
}

impl Window {
    /// Converts a node of the world to a node of the window.
    pub fn inner(&self, [x, y]: PlanNode) -> PlanNode {
        [x - self.at[0], y - self.at[1]]
    }

    /// True if a node lies in the window.
    pub fn holds(&self, [col, row]: PlanNode) -> bool {
        (0..self.cols as i64).contains(&col) && (0..self.rows as i64).contains(&row)
    }

    /// Returns the index of a node, row by row.
    pub fn index(&self, [col, row]: PlanNode) -> usize {
        row as usize * self.cols + col as usize
    }

    /// Returns the node at an index.
    pub fn node(&self, index: usize) -> PlanNode {
        [(index % self.cols) as i64, (index / self.cols) as i64]
    }

    /// Returns all nodes, row by row.
    pub fn nodes(&self) -> impl Iterator<Item = PlanNode> {
        (0..self.cols * self.rows).map(|index| self.node(index))
    }

    /// Returns the height of a node in metres.
    pub fn height_m(&self, node: PlanNode) -> f64 {
        self.heights_m[self.index(node)] as f64
    }

    /// Returns the water at a node; nodes outside the window are dry.
    pub fn water(&self, node: PlanNode) -> WaterKind {
        if self.holds(node) { self.waters[self.index(node)] } else { WaterKind::Dry }
    }

    /// True if any node lies in a lake or the sea.
    pub fn has_open_water(&self) -> bool {
        self.waters.iter().any(|water| water.is_open())
    }

    /// Returns the gradient at a node from its neighbours, metres up a metre east and south; 0 across the window's
    /// edge.
    pub fn gradient(&self, [col, row]: PlanNode, step_m: f64) -> [f64; 2] {
        let rise = |a: PlanNode, b: PlanNode| match self.holds(a) && self.holds(b) {
            true => (self.height_m(b) - self.height_m(a)) / (2.0 * step_m),
            false => 0.0,
        };
        [rise([col - 1, row], [col + 1, row]), rise([col, row - 1], [col, row + 1])]
    }
}
