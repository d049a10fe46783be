//! Masks: numbers that describe the shape of the land at a vertex, for materials, scattering and GIS.
//!
//! All are functions of the vertex's surroundings alone: slope and curvature of the heights around it, accumulation of
//! the land within a bounded distance upstream and of the river there, and wetness of slope and accumulation.

use std::sync::OnceLock;

use crate::area::{Area, Stride};
use crate::clock::Clock;
use crate::grid::Grid;
use crate::land::{Water, WaterKind};
use crate::lines::{DugWaters, Imprint, LineKind};
use crate::tile::accumulation::{accumulation, input};
use crate::tile::{Tile, TileView};
use crate::world::World;

/// Least slope used for wetness, in metres up a metre: on level ground the index would be infinite.
const LEAST_SLOPE: f32 = 1e-3;

/// Degrees of a radian.
const DEGREES: f32 = 180.0 / std::f32::consts::PI;

/// The wetness index of open water, and the largest that rasters distinguish.
pub const WETTEST: f32 = 20.0;

/// Returns the area of land that is made for the accumulation of an area.
pub fn accumulation_input(area: Area) -> Area {
    input(area)
}

/// Parts of a tile that are computed when they are first asked for: several exports need them, and most bakes have no
/// such export.
#[derive(Debug, Default)]
pub(super) struct Derived {
    accumulation_m2: OnceLock<Grid<f32>>,
    pub densities: OnceLock<Grid<[f32; 4]>>,
    pub dug_waters: OnceLock<DugWaters>,
}

impl Tile {
    /// Returns the slope at a vertex in degrees, 0 to 90.
    ///
    /// # Panics
    /// When the vertex is not one of the tile's.
    pub fn slope_degrees(&self, x: i64, y: i64) -> f32 {
        libm::atanf(self.normals.slope().at(x, y)) * DEGREES
    }

    /// Returns the aspect at a vertex, the direction in which the ground falls: in degrees clockwise from north, 0 up
    /// to 360. `None` on level ground.
    ///
    /// # Panics
    /// When the vertex is not one of the tile's.
    pub fn aspect_degrees(&self, x: i64, y: i64) -> Option<f32> {
        // Normals lean downhill.
        let [east, _, south] = self.normals.at(x, y);
        let degrees = libm::atan2f(east, -south) * DEGREES;
        let clockwise = if degrees < 0.0 { degrees + 360.0 } else { degrees };
        // The sum of a tiny negative angle and 360 rounds up to a whole turn.
        (east != 0.0 || south != 0.0).then_some(if clockwise < 360.0 { clockwise } else { 0.0 })
    }
}

impl TileView<'_> {
    /// Returns the thesis' blend factor at a vertex, from 0 on level ground to 1: `slope_scale` of the preset's ground
    /// times one minus the normal's upward component, at most 1. By this factor rock shows through the ground, and
    /// roads keep to low values.
    ///
    /// Based on: Grelsson (2014), section 4.1, which multiplies the upward component itself: that exceeds 1 on all but
    /// walls.
    ///
    /// # Panics
    /// When the vertex is not one of the tile's.
    pub fn steepness(self, x: i64, y: i64) -> f32 {
        let slope_scale = self.world.preset().ground.slope_scale as f32;
        ((1.0 - self.tile.normals.up().at(x, y)) * slope_scale).min(1.0)
    }
}

impl Tile {
    /// Returns the mean curvature at the vertices of row `y` at `x0 <= x < x1`, in 1 / metre: positive on ridges,
    /// negative in hollows, 0 on planes. On a ridge it is half of the reciprocal of the ridge's radius.
    ///
    /// It is computed from second differences over three by three vertices.
    ///
    /// # Panics
    /// When a part of the row is outside the tile.
    pub fn curvatures(&self, y: i64, x0: i64, x1: i64) -> Vec<f32> {
        let spacing_m = self.spacing_m as f32;
        let (half, square) = (0.5 / spacing_m, 1.0 / (spacing_m * spacing_m));
        let rows = [y - 1, y, y + 1].map(|y| self.heights.row(y, x0 - 1, x1 + 1));
        let curvature = |at: usize| {
            let [north, middle, south] = rows.map(|row| &row[at - 1..=at + 1]);
            let [p, q] = [(middle[2] - middle[0]) * half, (south[1] - north[1]) * half];
            let r = ((middle[2] - middle[1]) - (middle[1] - middle[0])) * square;
            let t = ((south[1] - middle[1]) - (middle[1] - north[1])) * square;
            let s = ((south[2] - south[0]) - (north[2] - north[0])) * (0.25 * square);
            let whole = 1.0 + p * p + q * q;
            let bent = (1.0 + q * q) * r - 2.0 * p * q * s + (1.0 + p * p) * t;
            -bent / (2.0 * whole * whole.sqrt())
        };
        (1..=(x1 - x0) as usize).map(curvature).collect()
    }
}

impl<'a> TileView<'a> {
    /// Returns the square metres of land that drain through each vertex of the tile: on hillsides from within 64
    /// vertices, in rivers and lakes their whole catchment. 0 in the sea.
    ///
    /// Roads are left out: water passes beneath them.
    pub fn accumulation_m2(self) -> &'a Grid<f32> {
        let TileView { tile, world } = self;
        tile.derived.accumulation_m2.get_or_init(|| {
            let (levels_m, water) = levels(world, tile.area);
            let mut drained = accumulation(&levels_m, tile.area);
            drop(levels_m);
            let spacing_m = tile.spacing_m as f32;
            let square_m2 = spacing_m * spacing_m;
            for drained in drained.values_mut() {
                *drained *= square_m2;
            }
            if let (Some(water), Some(land)) = (&water, world.relief().fluvial()) {
                add_rivers(&mut drained, water, land.fields().drained_m2(1.0) as f32);
            }
            for (x, y) in tile.area.vertices().filter(|(x, y)| self.lake_or_sea(*x, *y) == WaterKind::Sea) {
                drained.row_mut(y, x, x + 1)[0] = 0.0;
            }
            drained
        })
    }

    /// Returns the kind of water at a vertex, without the rivers that agents dig. Where the relief has no water, that
    /// is the sea wherever the land lies below its level.
    ///
    /// # Panics
    /// When the vertex is not one of the tile's.
    pub fn lake_or_sea(self, x: i64, y: i64) -> WaterKind {
        match (&self.tile.water, self.world.preset().sea_level_m) {
            (Some(water), _) => water.kind.at(x, y),
            (None, Some(sea_m)) if self.tile.heights.at(x, y) < sea_m as f32 => WaterKind::Sea,
            (None, _) => WaterKind::Dry,
        }
    }

    /// Returns the topographic wetness index at a vertex, `ln(a / tan b)`: `a` is the accumulation in square metres per
    /// metre of the vertex' width, `tan b` the slope, of at least a thousandth. 20 in open water.
    ///
    /// Based on: K. J. Beven, M. J. Kirkby, "A physically based, variable contributing area model of basin hydrology",
    /// 1979.
    ///
    /// # Panics
    /// When the vertex is not one of the tile's.
    pub fn wetness(self, x: i64, y: i64) -> f32 {
        if self.lake_or_sea(x, y).is_open() {
            return WETTEST;
        }
        let a = self.accumulation_m2().at(x, y) / self.tile.spacing_m as f32;
        libm::logf(a / self.tile.normals.slope().at(x, y).max(LEAST_SLOPE))
    }
}

/// Returns the heights of the surface on which water runs, in the whole input of the area's accumulation, and the water
/// there.
fn levels(world: &World, area: Area) -> (Grid<f32>, Option<Water>) {
    let wide = input(area);
    let land = Clock::unstopped(|clock| world.relief().land(wide, clock));
    let mut levels_m = land.heights;
    if let Some(water) = land.water {
        for (level_m, depth_m) in levels_m.values_mut().iter_mut().zip(water.depth_m.values()) {
            *level_m += depth_m;
        }
        return (levels_m, Some(water));
    }
    if world.stride() == Stride::ONE {
        // Agents' rivers run in the beds that they dig, so the beds are dug first.
        let lines = Clock::unstopped(|clock| world.lines(&wide, clock));
        let rivers = lines.iter().map(AsRef::as_ref).filter(|line| line.kind == LineKind::River);
        if let Some(imprint) = Imprint::new(&levels_m, None, rivers) {
            imprint.shape(&mut levels_m, None);
        }
    }
    // The sea's surface is level, whatever its floor.
    if let Some(sea_m) = world.preset().sea_level_m {
        for level_m in levels_m.values_mut() {
            *level_m = level_m.max(sea_m as f32);
        }
    }
    (levels_m, None)
}

/// Raises the accumulation of rivers and lakes to their catchments, given the square metres that yield a cubic metre a
/// second.
fn add_rivers(drained: &mut Grid<f32>, water: &Water, m2_a_m3s: f32) {
    let Area { x0, y0, x1, y1 } = drained.area();
    for y in y0..y1 {
        let flows = water.flow_m3s.row(y, x0, x1);
        for (drained, flow_m3s) in drained.row_mut(y, x0, x1).iter_mut().zip(flows) {
            *drained = drained.max(flow_m3s * m2_a_m3s);
        }
    }
}
