//! The surfaces of water: seas and lakes in few triangles, for they are flat; rivers cell by cell.

use super::Drape;
use crate::land::WaterKind;
use crate::tile::Tile;
use crate::world::World;

/// The surface of the water of one kind on a tile.
#[derive(Clone, Debug, PartialEq)]
pub struct Sheet {
    /// River, lake or sea.
    pub kind: WaterKind,
    /// Its vertices: column and row in the tile, and height in metres.
    pub vertices: Vec<([u32; 2], f32)>,
    /// Counter-clockwise seen from above, as in [`Surface`](super::Surface).
    pub triangles: Vec<[u32; 3]>,
}

/// Levels a metre: coarse enough that a lake whose level was a sum of floats is flat.
const LEVELS_A_METRE: f32 = 64.0;

/// Metres by which water is at least above the ground of a coarse surface, and its shore below: some times what rounding to
/// levels moves it.
const CLEAR_M: f32 = 0.05;

/// The surfaces of the water on a tile, of rivers, lakes and the sea, where there is any.
///
/// A surface covers every cell with a wet vertex and so runs into the land, whose surface is then the shore. Along a tile's
/// edge it has all vertices, and its neighbour's has the same. Where a cell has two kinds, the greater water has it.
///
/// On a `ground` that is coarser than the raster rivers rise and shores sink to where they meet it.
pub fn sheets(world: &World, tile: &Tile, ground: Option<&Drape>) -> Vec<Sheet> {
    if is_dry(world, tile) {
        return Vec::new();
    }
    let mut levels = Levels::new(world, tile);
    if let Some(ground) = ground {
        levels.settle(ground);
    }
    let kinds = [WaterKind::River, WaterKind::Lake, WaterKind::Sea];
    let found = kinds.into_iter().filter(|kind| levels.kinds.contains(kind));
    found.map(|kind| Blocks::new(&levels, kind).sheet()).collect()
}

/// Whether nothing of a tile is under water, which is seen much sooner than where it is.
fn is_dry(world: &World, tile: &Tile) -> bool {
    let area = tile.area();
    let sea_m = sea_level_m(world);
    (area.y0..area.y1).all(|y| match tile.water() {
        Some(water) => water.kind.row(y, area.x0, area.x1).iter().all(|kind| *kind == WaterKind::Dry),
        None => !tile.heights().row(y, area.x0, area.x1).iter().any(|height_m| *height_m < sea_m),
    })
}

/// The level of the sea, or one below all land.
fn sea_level_m(world: &World) -> f32 {
    world.preset().sea_level_m.map_or(f32::NEG_INFINITY, |level_m| level_m as f32)
}

/// The water's surface at the vertices of a tile, row by row.
struct Levels {
    /// Cells a side.
    cells: usize,
    /// What stands there.
    kinds: Vec<WaterKind>,
    /// Heights in metres of the surface, which goes on past the shore by a vertex; meaningless further on.
    heights_m: Vec<f32>,
}

impl Levels {
    fn new(world: &World, tile: &Tile) -> Levels {
        let area = tile.area();
        // A vertex more on each side, which a shore at the tile's edge asks for: so neighbours find the same.
        let padded = tile.heights().area();
        let width = padded.width();
        let sea_m = sea_level_m(world);
        // What stands at each vertex of the tile and beside it.
        let mut wet = Vec::with_capacity(padded.len());
        for y in padded.y0..padded.y1 {
            let heights = tile.heights().row(y, padded.x0, padded.x1);
            match tile.water() {
                Some(water) => {
                    let kinds = water.kind.row(y, padded.x0, padded.x1);
                    let depths = water.depth_m.row(y, padded.x0, padded.x1);
                    wet.extend(kinds.iter().zip(heights).zip(depths).map(|((&kind, height_m), depth_m)| match kind {
                        // The preset's own number: the sea is one level everywhere.
                        WaterKind::Sea => (kind, sea_m),
                        _ => (kind, ((height_m + depth_m) * LEVELS_A_METRE).round() / LEVELS_A_METRE),
                    }));
                }
                None => wet.extend(heights.iter().map(|&height_m| match height_m < sea_m {
                    true => (WaterKind::Sea, sea_m),
                    false => (WaterKind::Dry, 0.0),
                })),
            }
        }
        // Past the shore the surface goes on as high as beside it, but not above the land: beyond a spill it would hang in
        // the air.
        let (mut kinds, mut heights_m) = (Vec::with_capacity(area.len()), Vec::with_capacity(area.len()));
        for (row, y) in (area.y0..area.y1).enumerate() {
            for (column, &land_m) in tile.heights().row(y, area.x0, area.x1).iter().enumerate() {
                let (kind, level_m) = wet[(row + 1) * width + column + 1];
                kinds.push(kind);
                heights_m.push(if kind == WaterKind::Dry {
                    let around = (0..3).flat_map(|down| &wet[(row + down) * width + column..][..3]);
                    let beside = around.filter(|(kind, _)| *kind != WaterKind::Dry).copied();
                    // The greater water, and of one kind the higher level.
                    beside.reduce(|a, b| if b > a { b } else { a }).map_or(0.0, |(_, beside_m)| beside_m.min(land_m))
                } else {
                    level_m
                });
            }
        }
        Levels { cells: area.width() - 1, kinds, heights_m }
    }

    /// Lets rivers flow above a ground, and shores end below it.
    fn settle(&mut self, ground: &Drape) {
        let vertices = self.kinds.iter().zip(&mut self.heights_m).enumerate();
        for (index, (kind, height_m)) in vertices {
            let (row, column) = (index / (self.cells + 1), index % (self.cells + 1));
            let ground_m = ground.at(column as u32, row as u32);
            match kind {
                WaterKind::Dry => *height_m = height_m.min(ground_m - CLEAR_M),
                WaterKind::River => *height_m = height_m.max(ground_m + CLEAR_M),
                WaterKind::Lake | WaterKind::Sea => {}
            }
        }
    }

    fn at(&self, column: usize, row: usize) -> (WaterKind, f32) {
        let index = row * (self.cells + 1) + column;
        (self.kinds[index], self.heights_m[index])
    }

    /// The water of a cell: the greatest of its vertices'.
    fn of_cell(&self, column: usize, row: usize) -> WaterKind {
        let corners = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(east, south)| self.at(column + east, row + south).0);
        corners.into_iter().max().expect("a cell has corners")
    }
}

/// A rectangle of cells.
#[derive(Clone, Copy)]
struct Block {
    x0: usize,
    y0: usize,
    x1: usize,
    y1: usize,
}

/// Flat rectangles of water of one kind, as large as halving the tile makes them, and single cells.
struct Blocks<'a> {
    levels: &'a Levels,
    kind: WaterKind,
    all: Vec<Block>,
    /// The number of each vertex that is a corner of a block, row by row, or `NONE`.
    numbers: Vec<u32>,
    sheet: Sheet,
}

const NONE: u32 = u32::MAX;

impl<'a> Blocks<'a> {
    fn new(levels: &'a Levels, kind: WaterKind) -> Blocks<'a> {
        let sheet = Sheet { kind, vertices: Vec::new(), triangles: Vec::new() };
        let numbers = vec![NONE; (levels.cells + 1).pow(2)];
        let mut blocks = Blocks { levels, kind, all: Vec::new(), numbers, sheet };
        blocks.split(Block { x0: 0, y0: 0, x1: levels.cells, y1: levels.cells });
        blocks
    }

    /// Adds the blocks that a rectangle falls into.
    fn split(&mut self, block: Block) {
        let Block { x0, y0, x1, y1 } = block;
        if x1 - x0 == 1 && y1 - y0 == 1 {
            if self.levels.of_cell(x0, y0) == self.kind {
                self.add(block);
            }
        } else if self.is_flat(block) {
            self.add(block);
        } else {
            let middle = |from: usize, to: usize| from + (to - from).div_ceil(2);
            let (xs, ys) = ([x0, middle(x0, x1), x1], [y0, middle(y0, y1), y1]);
            for (y, x) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                if xs[x] < xs[x + 1] && ys[y] < ys[y + 1] {
                    self.split(Block { x0: xs[x], y0: ys[y], x1: xs[x + 1], y1: ys[y + 1] });
                }
            }
        }
    }

    /// Whether a rectangle is one level of our water, has room for a vertex in its middle, and does not touch the tile's
    /// edge, whose vertices all are needed.
    fn is_flat(&self, Block { x0, y0, x1, y1 }: Block) -> bool {
        let inside = x0 > 0 && y0 > 0 && x1 < self.levels.cells && y1 < self.levels.cells;
        let first = self.levels.at(x0, y0);
        let flat = || (y0..=y1).all(|y| (x0..=x1).all(|x| self.levels.at(x, y) == first));
        inside && x1 - x0 > 1 && y1 - y0 > 1 && first.0 == self.kind && flat()
    }

    fn add(&mut self, block: Block) {
        // Before any triangle is made: a corner of one block is a vertex on its neighbour's side.
        for (x, y) in [(block.x0, block.y0), (block.x1, block.y0), (block.x0, block.y1), (block.x1, block.y1)] {
            self.number(x, y);
        }
        self.all.push(block);
    }

    fn number(&mut self, x: usize, y: usize) -> u32 {
        let number = &mut self.numbers[y * (self.levels.cells + 1) + x];
        if *number == NONE {
            *number = self.sheet.vertices.len() as u32;
            self.sheet.vertices.push(([x as u32, y as u32], self.levels.at(x, y).1));
        }
        *number
    }

    /// The triangles of all blocks, with the corners of their neighbours on their sides.
    fn sheet(mut self) -> Sheet {
        let width = self.levels.cells + 1;
        for block in std::mem::take(&mut self.all) {
            let Block { x0, y0, x1, y1 } = block;
            // Counter-clockwise seen from above: down the west, along the south, up the east, back along the north.
            let west = (y0..y1).map(|y| (x0, y));
            let south = (x0..x1).map(|x| (x, y1));
            let east = (y0 + 1..=y1).rev().map(|y| (x1, y));
            let north = (x0 + 1..=x1).rev().map(|x| (x, y0));
            let around = west.chain(south).chain(east).chain(north).map(|(x, y)| self.numbers[y * width + x]);
            let ring: Vec<u32> = around.filter(|number| *number != NONE).collect();
            // No neighbour has a corner on its sides: two triangles will do.
            if let [a, b, c, d] = ring[..] {
                self.sheet.triangles.extend([[a, b, c], [a, c, d]]);
            } else {
                let middle = self.number(x0.midpoint(x1), y0.midpoint(y1));
                let next = ring.iter().cycle().skip(1);
                self.sheet.triangles.extend(ring.iter().zip(next).map(|(a, b)| [middle, *a, *b]));
            }
        }
        self.sheet
    }
}
