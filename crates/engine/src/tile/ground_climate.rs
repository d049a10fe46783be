//! The climate of the ground: snow line, tree line and drought at the vertices of an area.
//!
//! Climates vary over tens of kilometres. So they are asked for at corners that are far apart, on a lattice of the whole
//! world, and interpolated between these. A vertex has the same climate in all areas.

use crate::area::Area;
use crate::fluvial::SAND_COVERS;
use crate::geography::Setting;
use crate::geography::climate::{LAPSE, PlaceClimate};
use crate::grain_point::Point;
use crate::grid::{Grid, between_corners, corners};
use crate::simd::Simd;
use crate::tile::rule::clamp;
use crate::world::World;

/// Largest number of nodes from corner to corner: a power of two.
const MOST_STEP: i64 = 32;

/// Corners from the equator to a pole at least: they are 8 km apart on Earth, a quarter of the way between two places
/// whose climate is computed.
const CORNERS_TO_POLE: f64 = 1250.0;

/// Heights in metres above the sea, evenly spaced from 0 on, at which drought is asked for. It falls with height, more
/// and more slowly, and is taken as linear between them.
const DROUGHTS_M: [f64; 3] = [0.0, 2000.0, 4000.0];

/// Greatest drought; see [`PlaceClimate::drought`]. It is far more than a desert has.
const MOST_DROUGHT: f64 = 40.0;

/// Droughts from which on trees stand in favourable places, and at which they grow as well as anywhere: aridity indices
/// of 0.35, as at the edge between steppe and savanna, and of 1.25.
const WOODS: [f32; 2] = [2.857, 0.8];

/// Droughts at which grass begins to thin out and at which none is left: aridity indices of 0.67 and 0.17.
const STEPPE: [f32; 2] = [1.5, 6.0];

/// Droughts at which a desert begins and at which it is complete: aridity indices of 0.2, below which a climate is
/// called arid (UNEP, World atlas of desertification, 1992), and of 0.1.
const DESERT: [f32; 2] = [5.0, 10.0];

/// Mean temperatures in degrees Celsius from which on trees stand far apart in grass where it is dry, and at which they
/// do so most; and droughts at which such a savanna begins and is complete.
const SAVANNA_C: [f32; 2] = [18.0, 23.0];
const SAVANNA: [f32; 2] = [0.8, 1.6];

/// Droughts at which single trees in the grass grow rare and at which none is left, first where it is cold, then where
/// it is hot: trees of savannas stand more drought.
const TREELESS: [[f32; 2]; 2] = [[2.0, 3.5], [3.5, 6.0]];

/// Metres above the tree line at which the ground of the tundra is as bare as it gets, and its share that is then bare.
const TUNDRA_M: f32 = 1200.0;
const TUNDRA: f32 = 0.8;

/// The climate of the ground at the vertices of an area.
#[derive(Debug)]
pub(crate) struct GroundClimate {
    area: Area,
    /// Heights in metres above which snow stays, and above which no trees grow; drought; and the share of ground that a
    /// sand sea covers.
    numbers: [Vec<f32>; 4],
    /// Mean temperatures in degrees Celsius at height 0.
    means_c: Vec<f32>,
}

/// The climate of the ground at some vertices of a row.
#[derive(Clone, Copy)]
pub(super) struct LaneClimate<S: Simd> {
    /// Height in metres above which snow stays.
    pub snow_line_m: S::F32,
    /// Height in metres above which no trees grow.
    pub tree_line_m: S::F32,
    /// Share of the ground that a sand sea covers.
    pub sand_sea: S::F32,
    drought: S::F32,
}

impl GroundClimate {
    /// Returns the climate at the vertices of an area, given their heights; `None` in a world without a geography.
    ///
    /// # Panics
    /// When `heights` does not hold the area.
    pub fn new(world: &World, heights: &Grid<f32>, area: Area) -> Option<GroundClimate> {
        let geography = world.geography()?;
        let most_m = geography.settings().pole_km * 1000.0 / CORNERS_TO_POLE;
        let mut halves = std::iter::successors(Some(MOST_STEP), |step| (*step > 1).then_some(step / 2));
        let step = halves.find(|step| *step as f64 * world.spacing_m() <= most_m).unwrap_or(1);
        let vertices = step * world.stride().vertices();
        let places = corners(area, step).vertices().map(|(x, y)| Point::at_vertex(x * vertices, y * vertices));
        let settings = geography.settings_at(&places.collect::<Vec<_>>());
        let table_of = |of: &dyn Fn(&Setting) -> f64| {
            between_corners(area, step, &settings.iter().map(|setting| of(setting) as f32).collect::<Vec<_>>())
        };
        let table = |of: &dyn Fn(&PlaceClimate) -> f64| table_of(&|setting| of(&setting.climate));
        let sea_level_m = world.preset().sea_level_m.unwrap_or(0.0);
        let [mut drought, higher, highest] =
            DROUGHTS_M.map(|height_m| table(&|climate| climate.drought(height_m).min(MOST_DROUGHT)));
        for (row, y) in (area.y0..area.y1).enumerate() {
            let first = row * area.width();
            for (column, height_m) in heights.row(y, area.x0, area.x1).iter().enumerate() {
                let at = first + column;
                let up = (height_m - sea_level_m as f32) / (DROUGHTS_M[1] as f32);
                // Drought is convex over height, so of two lines the greater is the one between whose ends the height
                // lies.
                let low = drought[at] + (higher[at] - drought[at]) * up;
                drought[at] = low.max(higher[at] + (highest[at] - higher[at]) * (up - 1.0));
            }
        }
        let snow_line_m = table(&|climate| climate.snow_line_m() + sea_level_m);
        let tree_line_m = table(&|climate| climate.tree_line_m() + sea_level_m);
        let sand_sea = table_of(&|setting| (setting.sand / SAND_COVERS).min(1.0));
        let means_c = table(&|climate| climate.temperature_c(-sea_level_m));
        Some(GroundClimate { area, numbers: [snow_line_m, tree_line_m, drought, sand_sea], means_c })
    }

    /// Returns row `y` of snow line, tree line, drought and the share of a sand sea.
    pub fn row(&self, y: i64) -> [&[f32]; 4] {
        let row = self.area.index(self.area.x0, y)..self.area.index(self.area.x1, y);
        self.numbers.each_ref().map(|numbers| &numbers[row.clone()])
    }

    /// Returns the height in metres above which no trees grow at a vertex.
    pub fn tree_line_m(&self, x: i64, y: i64) -> f32 {
        self.numbers[1][self.area.index(x, y)]
    }

    /// Returns the share of a desert at a vertex.
    pub fn desert(&self, x: i64, y: i64) -> f32 {
        position(self.numbers[2][self.area.index(x, y)], DESERT)
    }

    /// Returns the shares of a savanna and of a steppe without trees at a vertex, given its height in metres.
    pub fn savanna_and_steppe(&self, height_m: f32, x: i64, y: i64) -> [f32; 2] {
        let at = self.area.index(x, y);
        let drought = self.numbers[2][at];
        let warm = position(self.means_c[at] - LAPSE as f32 * height_m, SAVANNA_C);
        let [cold, hot] = TREELESS;
        let treeless = [0, 1].map(|end| cold[end] + (hot[end] - cold[end]) * warm);
        [warm * position(drought, SAVANNA), position(drought, treeless)]
    }
}

impl<S: Simd> LaneClimate<S> {
    /// Loads the climate of vertices from the rows of a [`GroundClimate`], from column `first` on.
    #[inline(always)]
    pub fn load(simd: S, [snow_line_m, tree_line_m, drought, sand_sea]: [&[f32]; 4], first: usize) -> LaneClimate<S> {
        LaneClimate {
            snow_line_m: simd.load(&snow_line_m[first..]),
            tree_line_m: simd.load(&tree_line_m[first..]),
            drought: simd.load(&drought[first..]),
            sand_sea: simd.load(&sand_sea[first..]),
        }
    }

    /// Returns the same climate where nearby water makes up for drought; `damp` is from 0 to 1.
    #[inline(always)]
    #[must_use]
    pub fn watered(self, simd: S, damp: S::F32) -> LaneClimate<S> {
        LaneClimate { drought: self.drought * (simd.splat(1.0) - damp), ..self }
    }

    /// Returns the ease with which trees grow: from 0, where it is too dry for them, to 1.
    #[inline(always)]
    pub fn woods(self, simd: S) -> S::F32 {
        rise(simd, self.drought, WOODS)
    }

    /// Returns the share of a desert in the ground.
    #[inline(always)]
    pub fn desert(self, simd: S, noise: S::F32) -> S::F32 {
        rise(simd, self.ragged(simd, noise), DESERT)
    }

    /// Returns the share of bare ground where it is dry.
    #[inline(always)]
    pub fn thinned(self, simd: S, noise: S::F32) -> S::F32 {
        rise(simd, self.ragged(simd, noise), STEPPE)
    }

    /// Returns the share of bare ground where it is cold, given the height in metres that counts for trees.
    #[inline(always)]
    pub fn tundra(self, simd: S, height_m: S::F32, noise: S::F32) -> S::F32 {
        let above = (height_m - self.tree_line_m) * simd.splat(1.0 / TUNDRA_M);
        clamp(simd, above * (simd.splat(1.0) + noise * simd.splat(0.6))) * simd.splat(TUNDRA)
    }

    /// Returns the drought with the differences between places near to each other.
    #[inline(always)]
    fn ragged(self, simd: S, noise: S::F32) -> S::F32 {
        self.drought * (simd.splat(1.0) + noise * simd.splat(0.3))
    }
}

/// Returns the position of a value between two others: 0 at the first and before, 1 at the second and beyond.
fn position(value: f32, [from, to]: [f32; 2]) -> f32 {
    ((value - from) / (to - from)).clamp(0.0, 1.0)
}

/// Returns the same positions for lanes.
#[inline(always)]
fn rise<S: Simd>(simd: S, value: S::F32, [from, to]: [f32; 2]) -> S::F32 {
    clamp(simd, (value - simd.splat(from)) * simd.splat(1.0 / (to - from)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::area::{Stride, TileId};
    use crate::geography::Setting;
    use crate::preset::Preset;
    use crate::tile::{Material, Tile};

    /// The built-in world with small tiles.
    fn earth() -> World {
        let preset = Preset { tile_cells: 64, ..Preset::load("world").unwrap().1 };
        World::new(preset, None).unwrap()
    }

    /// Returns tiles 200 km from each other, from the north pole to beyond the equator, with what is there at large.
    fn places(world: &World) -> Vec<(TileId, Setting)> {
        let apart = (200_000.0 / (world.spacing_m() * f64::from(world.tile_cells()))) as i64;
        let ids = Area::new(-25, -20, 51, 71).vertices().map(|(x, y)| TileId { x: x * apart, y: y * apart });
        let corner = |id: TileId| {
            let Area { x0, y0, .. } = id.area(world.tile_cells());
            Point::at_vertex(x0, y0)
        };
        let settings = world.geography().unwrap().settings_at(&ids.clone().map(corner).collect::<Vec<_>>());
        ids.zip(settings).collect()
    }

    /// Finds the tile on plains within the land with the least score, given climate and drought.
    fn plain(places: &[(TileId, Setting)], score: fn(&PlaceClimate, f64) -> f64) -> TileId {
        let plains = places.iter().filter(|(_, at)| at.land.continent > 0.1 && at.land.uplift < 0.05);
        let scored = plains.map(|(id, at)| (score(&at.climate, at.climate.drought(at.land.planned_m())), *id));
        scored.min_by(|one, other| one.0.total_cmp(&other.0)).expect("a world has plains").1
    }

    /// Returns the shares of all materials in the dry ground of a tile.
    fn shares(tile: &Tile) -> [f64; 8] {
        let water = tile.water().unwrap();
        let is_dry = |(x, y): &(i64, i64)| water.kind.at(*x, *y) == crate::land::WaterKind::Dry;
        let dry: Vec<(i64, i64)> = tile.area().vertices().filter(is_dry).collect();
        assert!(dry.len() * 2 > tile.area().len());
        Material::ALL.map(|material| {
            let sum: f64 = dry.iter().map(|(x, y)| f64::from(tile.blend().weight(material, *x, *y))).sum();
            sum / (255.0 * dry.len() as f64)
        })
    }

    #[test]
    fn deserts_are_bare_and_wet_plains_wooded_and_neighbours_agree() {
        let world = earth();
        let places = places(&world);
        let desert = plain(&places, |_, drought| -drought);
        let wet = plain(&places, |climate, drought| if climate.mean_c > 20.0 { drought } else { f64::INFINITY });
        let tiles = [desert, wet].map(|id| Tile::new(&world, id));
        let [[_, dirt, rock, sand, _, woods, ..], [.., forest, _, _]] = tiles.each_ref().map(shares);
        assert!(dirt + rock + sand > 0.8 && sand > 0.1 && woods < 0.05, "{dirt}, {rock}, {sand}, {woods}");
        assert!(forest > 0.6, "{forest}");
        let steppe = plain(&places, |_, drought| (drought - 3.2).abs());
        let [grass, dirt, _, _, _, woods, ..] = shares(&Tile::new(&world, steppe));
        assert!(grass > 0.3 && dirt > 0.1 && woods < 0.1, "{grass}, {dirt}, {woods}");
        for tile in tiles {
            let TileId { x, y } = tile.id();
            let east = Tile::new(&world, TileId { x: x + 1, y });
            let Area { y0, x1, y1, .. } = tile.area();
            for y in y0..y1 {
                for material in Material::ALL {
                    let weights = [&tile, &east].map(|tile| tile.blend().weight(material, x1 - 1, y));
                    assert_eq!(weights[0], weights[1], "{material:?} at {y}");
                }
            }
        }
    }

    #[test]
    fn trees_stand_alone_in_savannas_and_not_in_cold_steppes() {
        let world = earth();
        let places = places(&world);
        let of = |score: fn(&PlaceClimate, f64) -> f64| {
            let id = plain(&places, score);
            let Area { x0, y0, .. } = id.area(world.tile_cells());
            let height_m = places.iter().find(|(other, _)| *other == id).unwrap().1.land.planned_m() as f32;
            let heights = Grid::filled(Area::new(x0, y0, 1, 1), height_m);
            let climate = GroundClimate::new(&world, &heights, heights.area()).unwrap();
            climate.savanna_and_steppe(height_m, x0, y0)
        };
        let [savanna, steppe] = of(|climate, drought| (drought - 2.2).abs() + (25.0 - climate.mean_c).max(0.0));
        assert!(savanna > 0.8 && steppe < 0.1, "{savanna}, {steppe}");
        let [savanna, steppe] = of(|climate, drought| (drought - 4.0).abs() + (climate.mean_c - 15.0).max(0.0));
        assert!(savanna < 0.1 && steppe > 0.8, "{savanna}, {steppe}");
    }

    #[test]
    fn vertices_have_one_climate_in_all_areas_and_about_the_same_at_all_strides() {
        let world = earth();
        let of = |world: &World, area: Area| {
            let heights = Grid::of(area, |x, _| (x.rem_euclid(64) * 60) as f32);
            GroundClimate::new(world, &heights, area).unwrap()
        };
        for at in [0, 1 << 30] {
            let [large, part] = [Area::new(at - 70, -35, 200, 100), Area::new(at + 3, -1, 29, 40)];
            let (all, few) = (of(&world, large), of(&world, part));
            for y in part.y0..part.y1 {
                let columns = (part.x0 - large.x0) as usize..(part.x1 - large.x0) as usize;
                for (all, few) in all.row(y).into_iter().zip(few.row(y)) {
                    assert_eq!(&all[columns.clone()], few);
                }
            }
            for power in [1, 3, 6] {
                let stride = Stride::new(1 << power).unwrap();
                let (node, vertex) = (Area::new(at >> power, 0, 16, 1), Area::new(at, 0, 1, 1));
                let flat = |world: &World, area| GroundClimate::new(world, &Grid::filled(area, 0.0), area).unwrap();
                let [far, near] = [flat(&world.at_stride(stride), node), flat(&world, vertex)]
                    .map(|climate| climate.numbers.map(|numbers| numbers[0]));
                assert!(far.into_iter().zip(near).all(|(far, near)| (far - near).abs() < 0.01 * near.abs() + 0.01));
            }
        }
    }
}
