//! The land as a map of some scale sees it: heights at its pixels, and what the ground is made of.

use std::sync::Arc;

use rayon::prelude::*;

use crate::area::{Area, TileId};
use crate::clock::Clock;
use crate::device::LandMaker;
use crate::geometry::length;
use crate::grid::Grid;
use crate::map::rows::weigh;
use crate::map::scale::Scale;
use crate::memory::{Memory, heap_bytes};
use crate::tile::TilePlan;
use crate::world::World;

/// Bytes of patches of land that are remembered.
pub(super) const REMEMBERED: usize = 192 << 20;

/// Bytes of a node in a patch: its height, and two words of what the ground is.
pub(super) const NODE_BYTES: u64 = 12;

/// Looks at a world along each side of a square, metres from one to the next, and nodes a side of each.
const LOOKS: i64 = 4;
const LOOK_M: f64 = 37_000.0;
const LOOK: usize = 24;

/// Looks that are taken together; half of that must have shown land.
const LOOKS_AT_ONCE: usize = 4;

/// The land of a world for maps of one scale. Whatever is asked for, a pixel is the same.
#[derive(Debug)]
pub(super) struct Terrain {
    /// The world at the nodes of the scale's stride, in tiles that are patches.
    world: Arc<World>,
    /// What makes its land.
    maker: Arc<dyn LandMaker>,
    scale: Scale,
    patches: Memory<TileId, Patch>,
}

/// The nodes of a tile without those of its eastern and southern edges, row by row.
#[derive(Debug)]
struct Patch {
    heights: Vec<f32>,
    ground: Vec<u32>,
    cover: Vec<u32>,
}

heap_bytes!(Patch: heights, ground, cover);

/// Land at nodes.
pub(super) struct Nodes {
    pub heights: Grid<f32>,
    /// Weights of materials, as [`Blend`](crate::tile::Blend) packs them.
    pub ground: Grid<u32>,
    pub cover: Grid<u32>,
}

impl Terrain {
    /// Cells a side of the tiles in which land is made: the larger, the less of it is made twice.
    pub const TILE_CELLS: u32 = 256;

    /// Cells a side of tiles for whoever waits for a single picture of land at nodes that lie 2^`halvings` times as far apart: a picture
    /// has fewer of these, and as little is made beyond its edges.
    pub fn sketch_tile_cells(halvings: u32) -> u32 {
        (128 >> halvings).max(16)
    }

    /// The land of a world that was made for the stride of a scale, tile by tile, by a maker of that land.
    pub fn new(world: Arc<World>, maker: Arc<dyn LandMaker>, scale: Scale) -> Terrain {
        let patches = Memory::within(REMEMBERED, world.budget());
        Terrain { world, maker, scale, patches }
    }

    /// The world at the nodes that the land is made at.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// What makes its land.
    pub fn maker(&self) -> &dyn LandMaker {
        &*self.maker
    }

    /// How many metres the steeper land of the world rises a metre ahead, by looks at it here and there: the same for all maps
    /// of one scale.
    pub fn steepness(&self) -> f64 {
        let apart = (LOOK_M / self.world.spacing_m()) as i64 + 1;
        let places: Vec<[i64; 2]> =
            (0..LOOKS * LOOKS).map(|at| [at % LOOKS, at / LOOKS].map(|at| at * apart)).collect();
        let look = |[x, y]: &[i64; 2]| {
            let area = Area::new(*x, *y, LOOK, LOOK);
            let heights = self.world.relief().heights(area.padded(1));
            let sea_level_m = self.world.preset().sea_level_m.map_or(f32::MIN, |level| level as f32);
            let land = area.vertices().filter(|(x, y)| heights.at(*x, *y) > sea_level_m);
            let rise_m = |(x, y)| {
                let rise = [heights.at(x + 1, y) - heights.at(x - 1, y), heights.at(x, y + 1) - heights.at(x, y - 1)];
                length(rise.map(f64::from)) / 2.0
            };
            land.map(|at| rise_m(at) / self.world.spacing_m()).collect::<Vec<f64>>()
        };
        let mut slopes: Vec<f64> = Vec::new();
        // Each look takes long, for nothing is known around it: no more than it takes to see some land.
        for places in places.chunks(LOOKS_AT_ONCE) {
            slopes.extend(places.par_iter().map(look).collect::<Vec<_>>().concat());
            if slopes.len() >= LOOKS_AT_ONCE * LOOK * LOOK / 2 {
                break;
            }
        }
        slopes.sort_by(f64::total_cmp);
        // A world that is all sea has no contours.
        slopes.get(slopes.len() * 4 / 5).map_or(1.0, |slope| slope.clamp(0.02, 1.0))
    }

    /// Nodes from a pixel to the next.
    fn nodes_per_pixel(&self) -> f64 {
        self.scale.metres_per_pixel / self.world.spacing_m()
    }

    /// The land at all nodes that the pixels of an area are made of.
    pub fn nodes(&self, pixels: Area) -> Nodes {
        let [x, y] = [(pixels.x0, pixels.x1), (pixels.y0, pixels.y1)].map(|(from, to)| {
            let ends = [from, to - 1].map(|pixel| Spline::at(pixel, self.nodes_per_pixel()).first);
            (ends[0], ends[1] + 4)
        });
        let area = Area { x0: x.0, y0: y.0, x1: x.1, y1: y.1 };
        let side = i64::from(self.world.tile_cells());
        let mut nodes =
            Nodes { heights: Grid::filled(area, 0.0), ground: Grid::filled(area, 0), cover: Grid::filled(area, 0) };
        for ty in area.y0.div_euclid(side)..=(area.y1 - 1).div_euclid(side) {
            for tx in area.x0.div_euclid(side)..=(area.x1 - 1).div_euclid(side) {
                let id = TileId { x: tx, y: ty };
                let (patch, own) = (self.patch(id), self.own(id));
                let common = own.common(&area).expect("the patch was chosen by the area");
                for y in common.y0..common.y1 {
                    let start = ((y - own.y0) * side + common.x0 - own.x0) as usize;
                    let range = start..start + common.width();
                    nodes.heights.row_mut(y, common.x0, common.x1).copy_from_slice(&patch.heights[range.clone()]);
                    nodes.ground.row_mut(y, common.x0, common.x1).copy_from_slice(&patch.ground[range.clone()]);
                    nodes.cover.row_mut(y, common.x0, common.x1).copy_from_slice(&patch.cover[range]);
                }
            }
        }
        nodes
    }

    /// The nodes of a tile's patch.
    fn own(&self, id: TileId) -> Area {
        let side = i64::from(self.world.tile_cells());
        Area::new(id.x * side, id.y * side, side as usize, side as usize)
    }

    fn patch(&self, id: TileId) -> Arc<Patch> {
        self.patches.get(id, || {
            let plan = TilePlan::without_lines(&self.world, id);
            let tile = self.maker.tiles(&self.world, vec![plan], &Clock::default()).remove(0);
            let area = self.own(id);
            Patch {
                heights: tile.heights().part(area).values().to_vec(),
                ground: tile.blend().ground().part(area).values().to_vec(),
                cover: tile.blend().cover().part(area).values().to_vec(),
            }
        })
    }

    /// Values at the pixels of an area, given those at [its nodes](Terrain::nodes): a smooth surface, whose bends go through
    /// near the nodes.
    pub fn at_pixels(&self, nodes: &Grid<f32>, pixels: Area) -> Grid<f32> {
        let area = nodes.area();
        let columns: Vec<Spline> = (pixels.x0..pixels.x1).map(|x| Spline::at(x, self.nodes_per_pixel())).collect();
        let mut values = Grid::filled(pixels, 0.0);
        let mut row = vec![0.0; area.width()];
        for y in pixels.y0..pixels.y1 {
            let spline = Spline::at(y, self.nodes_per_pixel());
            let rows = [0, 1, 2, 3].map(|index| nodes.row(spline.first + index, area.x0, area.x1));
            weigh(rows, spline.weights, &mut row);
            for (value, column) in values.row_mut(y, pixels.x0, pixels.x1).iter_mut().zip(&columns) {
                let at = (column.first - area.x0) as usize;
                let [wa, wb, wc, wd] = column.weights;
                let [a, b, c, d] = [row[at], row[at + 1], row[at + 2], row[at + 3]];
                *value = (a * wa + b * wb) + (c * wc + d * wd);
            }
        }
        values
    }
}

/// Nodes from one to a pixel's middle up to which the fourth one does not count: it would for a part in 10^15.
const LEAST_SHARE: f32 = 1e-5;

/// The four nodes that a pixel's middle is made of, and their weights: a cubic B-spline, which has no corners that light
/// would show.
struct Spline {
    first: i64,
    weights: [f32; 4],
}

impl Spline {
    fn at(pixel: i64, nodes_per_pixel: f64) -> Spline {
        let at = (pixel as f64 + 0.5) * nodes_per_pixel;
        let floor = at.floor();
        let t = (at - floor) as f32;
        let u = 1.0 - t;
        let sixth = 1.0 / 6.0;
        let near = |t: f32| (4.0 - 6.0 * t * t + 3.0 * t * t * t) * sixth;
        // What is next to nothing would be less than the least float with all its digits, once it is multiplied, which GPUs take for 0.
        let far = |t: f32| if t < LEAST_SHARE { 0.0 } else { t * t * t * sixth };
        Spline { first: floor as i64 - 1, weights: [far(u), near(t), near(u), far(t)] }
    }
}
