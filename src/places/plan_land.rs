//! The coarse lattice on which places are planned, and the land on it, block by block.

use std::sync::Arc;

use crate::area::Area;
use crate::fluvial::survey::{RiverPiece, Survey};
use crate::geometry::LineSegment;
use crate::land::WaterKind;
use crate::lines::FIXED;
use crate::memory::{Memory, Usage, heap_bytes};

/// How far apart things are looked at. All lengths are whole vertices, and sites lie on nodes of the plan.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scale {
    /// Metres between vertices.
    pub spacing_m: f64,
    /// Vertices from a node of the plan to the next.
    pub step: i64,
    /// Vertices from a sample along a planned road to the next.
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
        let side = (site_m / (step as f64 * spacing_m) + 0.5) as i64;
        Scale { spacing_m, step, fine: (step / 8).max(1), side }
    }

    /// Metres between nodes.
    pub fn step_m(&self) -> f64 {
        self.step as f64 * self.spacing_m
    }
}

/// Nodes a side of a block of land that is remembered.
const BLOCK: i64 = 32;

/// Bytes of blocks that are remembered: more than the largest search looks at, which has 550 x 550 nodes of 5 bytes, and
/// rivers.
const REMEMBERED: usize = 12 << 20;

/// The land on the nodes of the plan, remembered block by block.
#[derive(Debug)]
pub(super) struct PlanLand {
    pub scale: Scale,
    blocks: Memory<(i64, i64), PlanBlock>,
}

#[derive(Debug)]
struct PlanBlock {
    heights_m: Vec<f32>,
    waters: Vec<WaterKind>,
    rivers: Vec<RiverPiece>,
}

heap_bytes!(PlanBlock: heights_m, waters, rivers);

/// The land on a rectangle of nodes.
#[derive(Debug)]
pub(super) struct Window {
    /// Column and row of the first node.
    pub at: [i64; 2],
    pub cols: usize,
    pub rows: usize,
    /// A height a node.
    pub heights_m: Vec<f32>,
    /// What stands on each.
    pub waters: Vec<WaterKind>,
    /// Each piece that touches the rectangle once, sorted.
    pub rivers: Vec<RiverPiece>,
}

impl PlanLand {
    pub fn new(scale: Scale) -> PlanLand {
        PlanLand { scale, blocks: Memory::new(REMEMBERED) }
    }

    /// How full its memories are.
    pub fn usages(&self) -> Vec<Usage> {
        vec![self.blocks.usage()]
    }

    /// The land on `cols` x `rows` nodes from node `at` on, in those blocks of nodes that will be looked at; elsewhere it is
    /// level and dry.
    pub fn window(
        &self,
        land: &dyn Survey,
        at: [i64; 2],
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
                window.rivers.extend(&block.rivers);
            }
        }
        // Blocks that a piece lies in both have it.
        window.rivers.sort_by_key(RiverPiece::key);
        window.rivers.dedup_by_key(|piece| piece.key());
        window
    }

    fn block(&self, land: &dyn Survey, (bx, by): (i64, i64)) -> Arc<PlanBlock> {
        self.blocks.get((bx, by), || {
            let Scale { step, .. } = self.scale;
            let (x0, y0, side) = (bx * BLOCK * step, by * BLOCK * step, BLOCK as usize);
            let area = Area::new(x0, y0, side * step as usize + 1, side * step as usize + 1);
            PlanBlock {
                heights_m: land.heights_m(x0, y0, step, side, side),
                waters: land.waters(x0, y0, step, side, side),
                rivers: land.rivers(&area),
            }
        })
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
    /// Whether a node lies in the window.
    pub fn holds(&self, col: i64, row: i64) -> bool {
        (0..self.cols as i64).contains(&col) && (0..self.rows as i64).contains(&row)
    }

    /// The height of a node, counted from the window's first.
    pub fn height_m(&self, col: i64, row: i64) -> f64 {
        self.heights_m[row as usize * self.cols + col as usize] as f64
    }

    /// The water at a node, counted from the window's first; what is outside is dry.
    pub fn water(&self, col: i64, row: i64) -> WaterKind {
        match self.holds(col, row) {
            true => self.waters[row as usize * self.cols + col as usize],
            false => WaterKind::Dry,
        }
    }

    /// The steepness at a node from its neighbours, metres up a metre east and south; 0 across the window's edge.
    pub fn gradient(&self, col: i64, row: i64, step_m: f64) -> [f64; 2] {
        let rise = |a: (i64, i64), b: (i64, i64)| match self.holds(a.0, a.1) && self.holds(b.0, b.1) {
            true => (self.height_m(b.0, b.1) - self.height_m(a.0, a.1)) / (2.0 * step_m),
            false => 0.0,
        };
        [rise((col - 1, row), (col + 1, row)), rise((col, row - 1), (col, row + 1))]
    }
}

/// The river pieces of a window by place: in 1/256 vertex from the window's first node, so that products are exact.
#[derive(Debug)]
pub(super) struct RiverIndex {
    pub pieces: Vec<PlanPiece>,
    buckets: Vec<Vec<u32>>,
    cols: i64,
    rows: i64,
    side: i64,
}

/// A piece of a river, relative to a window.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlanPiece {
    pub from: [i64; 2],
    pub to: [i64; 2],
    pub width_m: f64,
    /// At both ends.
    pub level_m: [f64; 2],
}

/// Nodes a side of a bucket of river pieces.
const BUCKET: i64 = 2;

impl RiverIndex {
    /// The pieces of a window. `margin_m` is how far from a river's edge it is still found.
    pub fn new(window: &Window, scale: &Scale, margin_m: f64) -> RiverIndex {
        let origin = window.at.map(|at| at * scale.step * FIXED);
        let side = BUCKET * scale.step * FIXED;
        let buckets = |nodes: usize| nodes as i64 / BUCKET + 1;
        let (cols, rows) = (buckets(window.cols), buckets(window.rows));
        let mut rivers =
            RiverIndex { pieces: Vec::new(), buckets: vec![Vec::new(); (cols * rows) as usize], cols, rows, side };
        for piece in &window.rivers {
            let relative = |at: [i64; 2]| [at[0] - origin[0], at[1] - origin[1]];
            let width_m = piece.width_m as f64;
            let own = PlanPiece {
                from: relative(piece.from),
                to: relative(piece.to),
                width_m,
                level_m: piece.level_m.map(f64::from),
            };
            // One more for rounding: a piece that is found in vain costs little, and one that is missed a road in a river.
            let margin = ((width_m / 2.0 + margin_m) / scale.spacing_m * FIXED as f64) as i64 + 1;
            let index = rivers.pieces.len() as u32;
            for bucket in rivers.under(own.from, own.to, margin) {
                rivers.buckets[bucket].push(index);
            }
            rivers.pieces.push(own);
        }
        rivers
    }

    /// The buckets under the bounds of a line and a margin.
    fn under(&self, a: [i64; 2], b: [i64; 2], margin: i64) -> impl Iterator<Item = usize> + use<> {
        let (cols, side) = (self.cols, self.side);
        let span = |a: i64, b: i64, count: i64| {
            let first = (a.min(b) - margin).div_euclid(side).max(0);
            first..=(a.max(b) + margin).div_euclid(side).min(count - 1)
        };
        let columns = span(a[0], b[0], self.cols);
        span(a[1], b[1], self.rows).flat_map(move |row| columns.clone().map(move |col| (row * cols + col) as usize))
    }

    /// The numbers of all pieces that may come near the line from `a` to `b`, rising, into `near`.
    pub fn near(&self, a: [i64; 2], b: [i64; 2], near: &mut Vec<u32>) {
        near.clear();
        for bucket in self.under(a, b, 0) {
            near.extend(&self.buckets[bucket]);
        }
        near.sort_unstable();
        near.dedup();
    }
}

impl PlanPiece {
    /// Whether the line from `a` to `b` crosses the middle line. Of pieces that follow on each other, and of lines that
    /// do, exactly one is crossed where a crossing meets their common end.
    pub fn is_crossed(&self, a: [i64; 2], b: [i64; 2]) -> bool {
        let side = |from: [i64; 2], to: [i64; 2], at: [i64; 2]| {
            let (ax, ay) = ((to[0] - from[0]) as i128, (to[1] - from[1]) as i128);
            ax * (at[1] - from[1]) as i128 - ay * (at[0] - from[0]) as i128 >= 0
        };
        side(self.from, self.to, a) != side(self.from, self.to, b) && side(a, b, self.from) != side(a, b, self.to)
    }

    /// The height of the water's surface where the middle line is nearest to a place.
    pub fn surface_m(&self, at: [i64; 2]) -> f64 {
        let [from, to] = [self.from, self.to].map(|end| [(end[0] - at[0]) as f64, (end[1] - at[1]) as f64]);
        let (share, _) = LineSegment::between(from, to).nearest([0.0; 2]);
        self.level_m[0] + (self.level_m[1] - self.level_m[0]) * share
    }

    /// The square of the distance from a place to the middle line, in (1/256 vertex)^2.
    pub fn distance2(&self, at: [i64; 2]) -> f64 {
        distance2(at, self.from, self.to)
    }
}

/// The square of the distance from a place to the line between two others.
pub(super) fn distance2(at: [i64; 2], from: [i64; 2], to: [i64; 2]) -> f64 {
    // From the line's start, in whole numbers as long as they are large.
    let way = |place: [i64; 2]| [0, 1].map(|axis| (place[axis] - from[axis]) as f64);
    LineSegment { from: [0.0; 2], along: way(to) }.nearest(way(at)).1
}
