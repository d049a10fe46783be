//! Density of growth on the ground: trees, shrubs, grass and loose rocks.
//!
//! Densities follow from the ground materials, in which the tree line, cliffs and snow have their effect, and from
//! slope and wetness. Nothing stands in water, on roads or in settlements. Shares of materials are those of the blend
//! map, and all densities are cut off at 1:
//!
//! ```text
//! moist = (wetness - 4) / 6, low = 1 below the tree line, even = from 0 at 50 degrees to 1 at 35, each 0 to 1
//! soil  = dirt * (1 - 0.95 * desert), of which there is as much as of dirt in a world without a geography
//! lone  = 0.02 there; with a geography up to 0.15 in savannas, and 0 in steppes and deserts
//! tree  = (forest + grass * low * (lone + 0.13 * moist)) * even
//! shrub = (0.3 * forest + 0.4 * wetland * low
//!          + (0.25 * soil + grass * (0.06 + 0.2 * moist)) * (0.3 + 0.7 * low)) * even
//! grass = grass + 0.8 * wetland + 0.3 * soil + 0.25 * forest
//! rock  = scree + (0.6 * rock + 0.15 * dirt) * even + 0.04 * grass
//! ```

use crate::grid::Grid;
use crate::land::WaterKind;
use crate::places::site::SiteClass;
use crate::preset::Preset;
use crate::tile::ground_climate::GroundClimate;
use crate::tile::{GroundRule, Material, Tile, TileView};
use crate::world::World;

/// A kind of thing that stands on the ground. The numbers index lists of four.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Growth {
    /// Trees: woods, and single trees where it is wet.
    Tree = 0,
    /// Shrubs.
    Shrub = 1,
    /// Grass and herbs.
    Grass = 2,
    /// Loose rocks.
    Rock = 3,
}

impl Growth {
    /// All kinds, in the order of their numbers.
    pub const ALL: [Growth; 4] = [Growth::Tree, Growth::Shrub, Growth::Grass, Growth::Rock];

    /// Returns the name in files.
    pub const fn name(self) -> &'static str {
        self.texts()[0]
    }

    /// Returns the title of a raster of the kind's density.
    pub const fn about(self) -> &'static str {
        self.texts()[1]
    }

    /// Returns the description of such a raster's samples, of which each vertex has one.
    pub const fn samples(self) -> &'static [&'static str] {
        self.texts().split_at(2).1
    }

    const fn texts(self) -> &'static [&'static str; 3] {
        match self {
            Growth::Tree => &["tree", "density of trees", "density of trees, 0 = none, 255 = densest"],
            Growth::Shrub => &["shrub", "density of shrubs", "density of shrubs, 0 = none, 255 = densest"],
            Growth::Grass => &["grass", "density of grass", "density of grass, 0 = none, 255 = densest"],
            Growth::Rock => &["rock", "density of loose rocks", "density of loose rocks, 0 = none, 255 = densest"],
        }
    }
}

/// Largest radius in vertices of the bare ground around a settlement: a tile knows of settlements no further away
/// ([`sites_input`](super::sites_input)).
const SITE_CELLS: f64 = 8.0;

/// Share of a road's dirt above which a vertex is road.
const ROAD: f32 = 0.5;

/// Share of the sand of an agents' river from which on a vertex is the river's bed.
const BED: f32 = 0.999;

/// Slopes in metres up a metre, at 35 and 50 degrees: between them the ground becomes too steep for growth.
const STEEP: [f32; 2] = [0.7, 1.19];

/// Density of single trees on grass, and in savannas, where it is 9 trees a hectare.
const LONE: f32 = 0.02;
const LONE_IN_SAVANNA: f32 = 0.15;

/// The rule that gives the densities of growth in a world.
#[derive(Debug)]
pub struct Grows<'a> {
    world: &'a World,
    rule: GroundRule,
    has_woods: bool,
}

impl<'a> Grows<'a> {
    /// Returns the rule of a world.
    pub fn new(world: &'a World) -> Grows<'a> {
        let Preset { ground, sea_level_m, .. } = world.preset();
        let rule = GroundRule::new(ground, *sea_level_m, world.spacing_m(), world.chance());
        Grows { world, rule, has_woods: ground.forest_m.is_some() }
    }

    /// Tells whether anything can stand at a vertex: not in water or on a river's bed, on a road or in a settlement.
    ///
    /// # Panics
    /// When the vertex is not one of the tile's.
    pub fn is_open(&self, tile: &Tile, x: i64, y: i64) -> bool {
        if TileView::new(tile, self.world).lake_or_sea(x, y) != WaterKind::Dry
            || tile.water().is_some_and(|water| water.flow_m3s.at(x, y) > 0.0)
        {
            return false;
        }
        if let Some(imprint) = tile.imprint()
            && (imprint.dirt().any(|dirt| dirt.at(x, y) > ROAD) || imprint.sand().is_some_and(|it| it.at(x, y) >= BED))
        {
            return false;
        }
        let spacing_m = tile.spacing_m();
        tile.sites().iter().all(|site| {
            let radius_m = match site.class {
                SiteClass::Hamlet => 30.0,
                SiteClass::Village => 50.0,
                SiteClass::Town => 80.0,
            };
            let cells = (radius_m / spacing_m).min(SITE_CELLS);
            let [east, south] = [(site.at[0] - x) as f64, (site.at[1] - y) as f64];
            east * east + south * south > cells * cells
        })
    }

    /// Returns the density of each kind at each vertex of a tile, in the order of [`Growth::ALL`]: from 0, none, to 1,
    /// the densest growth.
    pub fn densities<'t>(&self, tile: &'t Tile) -> &'t Grid<[f32; 4]> {
        tile.derived.densities.get_or_init(|| {
            let mut densities = Grid::filled(tile.area(), [0.0; 4]);
            let climate = GroundClimate::new(self.world, tile.heights(), tile.area());
            for ((x, y), at) in tile.area().vertices().zip(densities.values_mut()) {
                *at = self.at(tile, climate.as_ref(), x, y);
            }
            densities
        })
    }

    fn at(&self, tile: &Tile, climate: Option<&GroundClimate>, x: i64, y: i64) -> [f32; 4] {
        if !self.is_open(tile, x, y) {
            return [0.0; 4];
        }
        let [grass, dirt, rock, _, _, forest, scree, wetland] =
            Material::ALL.map(|material| f32::from(tile.blend().weight(material, x, y)) * (1.0 / 255.0));
        let moist = ((TileView::new(tile, self.world).wetness(x, y) - 4.0) * (1.0 / 6.0)).clamp(0.0, 1.0);
        // A ground without woods has no tree line either, so shrubs and single trees stand at any height.
        let low = if self.has_woods { self.low(tile, climate, x, y) } else { 1.0 };
        let slope = tile.normals().slope().at(x, y);
        let even = ((STEEP[1] - slope) / (STEEP[1] - STEEP[0])).clamp(0.0, 1.0);
        let high = 0.3 + 0.7 * low;
        let desert = climate.map_or(0.0, |climate| climate.desert(x, y));
        let soil = dirt * (1.0 - 0.95 * desert);
        let height_m = tile.heights().at(x, y);
        let lone = climate.map_or(LONE, |climate| {
            let [savanna, steppe] = climate.savanna_and_steppe(height_m, x, y);
            (LONE + (LONE_IN_SAVANNA - LONE) * savanna) * (1.0 - steppe)
        });
        let tree = (forest + grass * low * (lone + 0.13 * moist)) * even;
        let shrub = (0.3 * forest + 0.4 * wetland * low + (0.25 * soil + grass * (0.06 + 0.2 * moist)) * high) * even;
        let herbs = grass + 0.8 * wetland + 0.3 * soil + 0.25 * forest;
        let stones = scree + (0.6 * rock + 0.15 * dirt) * even + 0.04 * grass;
        // A road or a bank covers the ground that was there, and leaves less room for growth.
        let left = tile.imprint().map_or(1.0, |imprint| {
            let laid = imprint.dirt().chain(imprint.sand()).map(|share| share.at(x, y)).fold(0.0, f32::max);
            1.0 - laid
        });
        [tree, shrub, herbs, stones].map(|density| density.min(1.0) * left)
    }

    fn low(&self, tile: &Tile, climate: Option<&GroundClimate>, x: i64, y: i64) -> f32 {
        let [_, _, south] = tile.normals().at(x, y);
        let tree_line_m = climate.map(|climate| climate.tree_line_m(x, y));
        self.rule.below_tree_line(tile.heights().at(x, y), south, tree_line_m)
    }
}
