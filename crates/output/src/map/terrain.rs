//! The land at the scale of a map: heights at its pixels, and the materials of the ground.

use std::sync::Arc;

use rayon::prelude::*;

use crate::area::{Area, TileId};
use crate::clock::Clock;
use crate::device::LandMaker;
use crate::geography::biome::Biome;
use crate::geography::climate::PlaceClimate;
use crate::geography::lithology::Lithology;
use crate::geometry::length;
use crate::grain_point::{GRAINS, Point};
use crate::grid::Grid;
use crate::map::scale::Scale;
use crate::map::style::TintBy;
use crate::map::weighted_sums::weigh;
use crate::memory::{Memory, heap_bytes};
use crate::stop::Stopped;
use crate::tile::TilePlan;
use crate::world::World;

/// Size in bytes of the cache of patches of land.
pub(super) const REMEMBERED: usize = 192 << 20;

/// Bytes per node of a patch: its height, and two words of materials.
pub(super) const NODE_BYTES: u64 = 12;

/// Samples of a world: how many along each side of a square, the metres between them, and the nodes per side of each
/// sample.
const LOOKS: i64 = 4;
const LOOK_M: f64 = 37_000.0;
const LOOK: usize = 24;

/// Number of samples that are taken in parallel. Sampling ends once half as many nodes as such a group has are land.
const LOOKS_AT_ONCE: usize = 4;

/// The land of a world for maps of one scale. A pixel is the same whatever area is asked for.
#[derive(Debug)]
pub(super) struct MapTerrain {
    /// The world at the nodes of the scale's stride; its tiles are the patches.
    world: Arc<World>,
    /// Makes the world's land.
    maker: Arc<dyn LandMaker>,
    scale: Scale,
    patches: Memory<TileId, TerrainPatch>,
}

/// The nodes of a tile without those of its eastern and southern edges, row by row.
#[derive(Debug)]
struct TerrainPatch {
    heights: Vec<f32>,
    ground: Vec<u32>,
    cover: Vec<u32>,
}

heap_bytes!(TerrainPatch: heights, ground, cover);

/// A class of land that gives it its colour on a map.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum LandClass {
    Biome(Biome),
    Rock(Lithology),
}

impl LandClass {
    /// Returns the number of the classes that land can have by a property.
    pub fn count(by: TintBy) -> usize {
        match by {
            TintBy::Height => 0,
            TintBy::Biome => Biome::all().count(),
            TintBy::Rock => Lithology::all().count(),
        }
    }

    /// Returns the text of a legend.
    pub fn about(self) -> String {
        match self {
            LandClass::Biome(biome) => format!("{}  {}", biome.code(), biome.name()),
            LandClass::Rock(rock) => rock.name().into(),
        }
    }

    pub fn colour(self) -> [u8; 3] {
        match self {
            LandClass::Biome(biome) => biome.colour(),
            LandClass::Rock(rock) => rock.colour(),
        }
    }
}

/// Land at nodes.
pub(super) struct Nodes {
    pub heights: Grid<f32>,
    /// Weights of materials, as [`Blend`](crate::tile::Blend) packs them.
    pub ground: Grid<u32>,
    pub cover: Grid<u32>,
}

impl MapTerrain {
    /// Cells per side of the tiles in which land is made. The larger the tiles, the less land is made twice.
    pub const TILE_CELLS: u32 = 256;

    /// Returns the cells per side of tiles for a single picture of land at nodes 2^`halvings` times as far apart. The
    /// picture has fewer such nodes, so smaller tiles keep the land that is made beyond its edges as small in
    /// proportion.
    pub fn sketch_tile_cells(halvings: u32) -> u32 {
        (128 >> halvings).max(16)
    }

    /// Creates the land of a world that has the stride of the scale. `maker` makes it tile by tile.
    pub fn new(world: Arc<World>, maker: Arc<dyn LandMaker>, scale: Scale) -> MapTerrain {
        let patches = Memory::within(REMEMBERED, world.budget());
        MapTerrain { world, maker, scale, patches }
    }

    /// The world at the nodes of the land.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// Makes the world's land.
    pub fn maker(&self) -> &dyn LandMaker {
        &*self.maker
    }

    /// Returns the slope (rise over run) of the steeper land of the world: the 80th percentile of samples here and
    /// there. It is the same for all maps of one scale.
    pub fn steepness(&self, clock: &Clock) -> Result<f64, Stopped> {
        let apart = (LOOK_M / self.world.spacing_m()) as i64 + 1;
        let places: Vec<[i64; 2]> =
            (0..LOOKS * LOOKS).map(|at| [at % LOOKS, at / LOOKS].map(|at| at * apart)).collect();
        let look = |[x, y]: &[i64; 2]| {
            let area = Area::new(*x, *y, LOOK, LOOK);
            let heights = self.world.relief().land(area.padded(1), clock)?.heights;
            let sea_level_m = self.world.preset().sea_level_m.map_or(f32::MIN, |level| level as f32);
            let land = area.vertices().filter(|(x, y)| heights.at(*x, *y) > sea_level_m);
            let rise_m = |(x, y)| {
                let rise = [heights.at(x + 1, y) - heights.at(x - 1, y), heights.at(x, y + 1) - heights.at(x, y - 1)];
                length(rise.map(f64::from)) / 2.0
            };
            Ok(land.map(|at| rise_m(at) / self.world.spacing_m()).collect::<Vec<f64>>())
        };
        let mut slopes: Vec<f64> = Vec::new();
        // A sample takes long, because nothing around it is cached. So take no more of them than it takes to see some
        // land.
        for places in places.chunks(LOOKS_AT_ONCE) {
            slopes.extend(places.par_iter().map(look).collect::<Result<Vec<_>, Stopped>>()?.concat());
            if slopes.len() >= LOOKS_AT_ONCE * LOOK * LOOK / 2 {
                break;
            }
        }
        slopes.sort_by(f64::total_cmp);
        // A world that is all sea has no contours, so any value will do for it.
        Ok(slopes.get(slopes.len() * 4 / 5).map_or(1.0, |slope| slope.clamp(0.02, 1.0)))
    }

    /// Nodes per pixel.
    fn nodes_per_pixel(&self) -> f64 {
        self.scale.metres_per_pixel / self.world.spacing_m()
    }

    /// Returns the land at all nodes that the pixels of an area depend on.
    pub fn nodes(&self, pixels: Area, clock: &Clock) -> Result<Nodes, Stopped> {
        let [x, y] = [(pixels.x0, pixels.x1), (pixels.y0, pixels.y1)].map(|(from, to)| {
            let ends = [from, to - 1].map(|pixel| BSpline::at(pixel, self.nodes_per_pixel()).first);
            (ends[0], ends[1] + 4)
        });
        let area = Area { x0: x.0, y0: y.0, x1: x.1, y1: y.1 };
        let side = i64::from(self.world.tile_cells());
        let mut nodes =
            Nodes { heights: Grid::filled(area, 0.0), ground: Grid::filled(area, 0), cover: Grid::filled(area, 0) };
        for [x, y] in area.square_numbers(side) {
            let id = TileId { x, y };
            let (patch, own) = (self.patch(id, clock)?, self.own(id));
            let common = own.common(&area).expect("the patch was chosen by the area");
            for y in common.y0..common.y1 {
                let start = ((y - own.y0) * side + common.x0 - own.x0) as usize;
                let range = start..start + common.width();
                nodes.heights.row_mut(y, common.x0, common.x1).copy_from_slice(&patch.heights[range.clone()]);
                nodes.ground.row_mut(y, common.x0, common.x1).copy_from_slice(&patch.ground[range.clone()]);
                nodes.cover.row_mut(y, common.x0, common.x1).copy_from_slice(&patch.cover[range]);
            }
        }
        Ok(nodes)
    }

    /// Returns the nodes of a tile's patch.
    fn own(&self, id: TileId) -> Area {
        let side = i64::from(self.world.tile_cells());
        Area::new(id.x * side, id.y * side, side as usize, side as usize)
    }

    /// Returns the classes of the pixels of an area, row by row, given the heights there, or `None` if heights give land
    /// its colours. The class of the sea is the one that land at its level would have.
    ///
    /// # Panics
    /// When the world has no geography.
    pub fn classes(&self, by: TintBy, heights: &Grid<f32>, pixels: Area) -> Option<Vec<LandClass>> {
        if by == TintBy::Height {
            return None;
        }
        let preset = self.world.preset();
        let geography = self.world.geography().expect("the style was checked for the world");
        let sea_m = preset.sea_level_m.unwrap_or(0.0);
        let mut classes = Vec::with_capacity(pixels.len());
        for y in pixels.y0..pixels.y1 {
            let places = self.middles(y, pixels.x0, pixels.x1);
            if by == TintBy::Rock {
                let rocks = geography.settings_at(&places);
                classes.extend(rocks.iter().map(|setting| LandClass::Rock(Lithology::of(setting))));
                continue;
            }
            let climates = geography.climates(&places).into_iter().zip(heights.row(y, pixels.x0, pixels.x1));
            let biome =
                |(climate, height_m): (PlaceClimate, &f32)| climate.biome((f64::from(*height_m) - sea_m).max(0.0));
            classes.extend(climates.map(biome).map(LandClass::Biome));
        }
        Some(classes)
    }

    /// Returns the middles of the pixels from `x0` to before `x1` in a row.
    pub fn middles(&self, y: i64, x0: i64, x1: i64) -> Vec<Point> {
        let grains = self.scale.metres_per_pixel * GRAINS as f64 / self.world.preset().spacing_m;
        let middle = |pixel: i64| ((pixel as f64 + 0.5) * grains) as i64;
        (x0..x1).map(|x| Point { x: middle(x), y: middle(y) }).collect()
    }

    fn patch(&self, id: TileId, clock: &Clock) -> Result<Arc<TerrainPatch>, Stopped> {
        self.patches.try_get(id, || {
            let plan = TilePlan::without_lines(&self.world, id);
            let tile = self.maker.tiles(&self.world, vec![plan], clock)?.remove(0);
            let area = self.own(id);
            Ok(TerrainPatch {
                heights: tile.heights().part(area).values().to_vec(),
                ground: tile.blend().ground().part(area).values().to_vec(),
                cover: tile.blend().cover().part(area).values().to_vec(),
            })
        })
    }

    /// Interpolates values at the pixels of an area from values at [its nodes](MapTerrain::nodes). The surface is
    /// smooth and passes near the nodes, not through them.
    pub fn at_pixels(&self, nodes: &Grid<f32>, pixels: Area) -> Grid<f32> {
        let area = nodes.area();
        let columns: Vec<BSpline> = (pixels.x0..pixels.x1).map(|x| BSpline::at(x, self.nodes_per_pixel())).collect();
        let mut values = Grid::filled(pixels, 0.0);
        let mut row = vec![0.0; area.width()];
        for y in pixels.y0..pixels.y1 {
            let spline = BSpline::at(y, self.nodes_per_pixel());
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

/// Distance from a node, in nodes, below which the furthest of the four nodes has no weight: it would weigh less than a
/// part in 10^15.
const LEAST_SHARE: f32 = 1e-5;

/// The first of the four nodes that the value at a pixel's centre is made of, and the weights of the four: a cubic
/// B-spline, which has no creases that light would show.
struct BSpline {
    first: i64,
    weights: [f32; 4],
}

impl BSpline {
    fn at(pixel: i64, nodes_per_pixel: f64) -> BSpline {
        let at = (pixel as f64 + 0.5) * nodes_per_pixel;
        let floor = at.floor();
        let t = (at - floor) as f32;
        let u = 1.0 - t;
        let sixth = 1.0 / 6.0;
        let near = |t: f32| (4.0 - 6.0 * t * t + 3.0 * t * t * t) * sixth;
        // A tiny weight times a value could be a subnormal number, which GPUs flush to zero.
        let far = |t: f32| if t < LEAST_SHARE { 0.0 } else { t * t * t * sixth };
        BSpline { first: floor as i64 - 1, weights: [far(u), near(t), near(u), far(t)] }
    }
}
