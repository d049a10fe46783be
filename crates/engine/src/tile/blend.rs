//! The blend map: the ground materials of each vertex, with their weights.

use crate::area::Area;
use crate::grid::Grid;
use crate::land::{Water, WaterKind};
use crate::lines::Imprint;
use crate::preset::ground::GroundSettings;
use crate::simd::{Kernel, Simd, dispatch, starts};
use crate::tile::Normals;
use crate::tile::ground_climate::{GroundClimate, LaneClimate};
use crate::tile::rule::{ForestPlace, GroundRule, ramp, steepness, stony, wetland_share};
use crate::tile::surroundings::{self, GroundSurroundings};

/// A ground material of the blend map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Material {
    /// Grass, where no other material lies.
    Grass,
    /// Bare soil on slopes, and where it is too dry or too cold for grass.
    Dirt,
    /// Rock on steep slopes, and stones in deserts and high above the trees.
    Rock,
    /// Sand by the sea and in deserts.
    Sand,
    /// Snow at great heights, and further down on slopes that face away from the sun.
    Snow,
    /// Trees, up to the tree line.
    Forest,
    /// Rubble beneath rock.
    Scree,
    /// Wet ground beside water.
    Wetland,
}

impl Material {
    /// All materials in the order of their channels: four in the ground words, then four in the cover words.
    pub const ALL: [Material; 8] = [
        Material::Grass,
        Material::Dirt,
        Material::Rock,
        Material::Sand,
        Material::Snow,
        Material::Forest,
        Material::Scree,
        Material::Wetland,
    ];

    /// Tells whether a ground may have the material: every ground has the first five, the others only if its settings
    /// ask for them.
    pub fn is_of(self, ground: &GroundSettings) -> bool {
        match self {
            Material::Forest => ground.forest_m.is_some(),
            Material::Scree => ground.scree.is_some(),
            Material::Wetland => ground.wet_m.is_some(),
            _ => true,
        }
    }

    /// Returns the name in files.
    pub const fn name(self) -> &'static str {
        ["grass", "dirt", "rock", "sand", "snow", "forest", "scree", "wetland"][self as usize]
    }
}

/// Distance in vertices of the four places around a vertex that must be about as high for it to count as meadow.
pub(super) const FLOOR: i64 = 3;

/// Thickness of ice in metres from which on no ground shows through.
const WHOLE_ICE_M: f32 = 5.0;

/// Returns the area of heights and water that the weights of an area depend on. Mud beside water needs one vertex more,
/// and forest, scree and wetland need what the settings say.
pub(super) fn input(ground: &GroundSettings, area: Area) -> Area {
    if ground.scree.is_some() || ground.wet_m.is_some() {
        surroundings::input(area).hull(&area.padded(FLOOR as usize))
    } else if ground.forest_m.is_some() {
        area.padded(FLOOR as usize)
    } else {
        area.padded(1)
    }
}

/// Weights of all materials at every vertex; the weights of a vertex sum to exactly 255.
#[derive(Debug)]
pub struct Blend {
    ground: Grid<u32>,
    cover: Grid<u32>,
}

impl Blend {
    /// Computes the blend weights of all vertices that have a normal, on land with the given water. They follow the
    /// climate if there is one, which is that of the same vertices.
    ///
    /// # Panics
    /// When `heights` or `water` does not hold the whole input of the area.
    pub(crate) fn new(
        rule: &GroundRule,
        climate: Option<&GroundClimate>,
        heights: &Grid<f32>,
        water: Option<&Water>,
        normals: &Normals,
    ) -> Blend {
        let area = normals.up().area();
        let mut blend = Blend { ground: Grid::filled(area, 0), cover: Grid::filled(area, 0) };
        let surroundings = GroundSurroundings::new(rule, heights, water, area);
        let (surroundings, to) = (surroundings.as_ref(), &mut blend);
        match (surroundings, climate) {
            (Some(_), Some(_)) => dispatch(Weigh::<true, true> { rule, climate, heights, normals, surroundings, to }),
            (Some(_), None) => dispatch(Weigh::<true, false> { rule, climate, heights, normals, surroundings, to }),
            (None, Some(_)) => dispatch(Weigh::<false, true> { rule, climate, heights, normals, surroundings, to }),
            (None, None) => dispatch(Weigh::<false, false> { rule, climate, heights, normals, surroundings, to }),
        }
        if let Some(water) = water {
            if let Some(ice_m) = &water.ice_m {
                blend.lay(Material::Snow, ice_m, |ice_m| (ice_m / WHOLE_ICE_M).min(1.0));
            }
            blend.wet(rule, climate, water);
        }
        blend
    }

    /// Takes over weights that a kernel on another device has computed, as words of the ground and of the cover.
    #[cfg(feature = "gpu")]
    pub(crate) fn of_words(ground: Grid<u32>, cover: Grid<u32>) -> Blend {
        Blend { ground, cover }
    }

    /// Covers the ground with the sand of rivers, and then with the dirt of roads.
    pub(super) fn cover_with(&mut self, imprint: &Imprint) {
        if let Some(sand) = imprint.sand() {
            self.lay(Material::Sand, sand, |share| share);
        }
        for dirt in imprint.dirt() {
            self.lay(Material::Dirt, dirt, |share| share);
        }
    }

    /// Covers a share of each vertex's ground with a material: the share that follows from a value above 0.
    fn lay(&mut self, material: Material, values: &Grid<f32>, share: impl Fn(f32) -> f32) {
        let Area { x0, y0, x1, y1 } = self.ground.area();
        for y in y0..y1 {
            let ground = self.ground.row_mut(y, x0, x1);
            let cover = self.cover.row_mut(y, x0, x1);
            for ((ground, cover), value) in ground.iter_mut().zip(cover).zip(values.row(y, x0, x1)) {
                if *value > 0.0 {
                    (*ground, *cover) = covered(*ground, *cover, material, share(*value));
                }
            }
        }
    }

    /// Covers the beds of rivers and of the sea, the bars of rivers and the salt of lakes in deserts with sand, the beds
    /// of other lakes with dirt, and the ground next to rivers and lakes with dirt or wetland.
    fn wet(&mut self, rule: &GroundRule, climate: Option<&GroundClimate>, water: &Water) {
        let rim = if rule.wet_m.is_some() { Material::Wetland } else { Material::Dirt };
        let Area { x0, y0, x1, y1 } = self.ground.area();
        for y in y0..y1 {
            let rows = [y - 1, y, y + 1].map(|y| water.kind.row(y, x0 - 1, x1 + 1));
            // Find the range of columns with water or flow first, since most rows have water in few places.
            let is_wet = |kind: &WaterKind| *kind != WaterKind::Dry;
            let flows = water.flow_m3s.row(y, x0 - 1, x1 + 1);
            let is_flow = |flow_m3s: &f32| *flow_m3s > 0.0;
            let first = rows.iter().map(|row| row.iter().position(is_wet)).chain([flows.iter().position(is_flow)]);
            let last = rows.iter().map(|row| row.iter().rposition(is_wet)).chain([flows.iter().rposition(is_flow)]);
            let Some((first, last)) = first.flatten().min().zip(last.flatten().max()) else { continue };
            let columns = first.saturating_sub(2)..(last + 1).min((x1 - x0) as usize);
            let ground = &mut self.ground.row_mut(y, x0, x1)[columns.clone()];
            let cover = &mut self.cover.row_mut(y, x0, x1)[columns.clone()];
            for (column, (ground, cover)) in columns.zip(ground.iter_mut().zip(cover)) {
                let around = rows.iter().flat_map(|row| &row[column..column + 3]);
                // Number of vertices with a river or a lake, out of the vertex and its eight neighbours.
                let wet = around.filter(|kind| matches!(kind, WaterKind::River | WaterKind::Lake)).count();
                let is_salt = || climate.is_some_and(|climate| climate.desert(x0 + column as i64, y) > 0.5);
                let (material, share) = match rows[1][column + 1] {
                    WaterKind::River | WaterKind::Sea => (Material::Sand, 1.0),
                    WaterKind::Lake if is_salt() => (Material::Sand, 1.0),
                    WaterKind::Lake => (Material::Dirt, 1.0),
                    // A dry vertex with flow is a bar in a river's bed.
                    WaterKind::Dry if flows[column + 1] > 0.0 => (Material::Sand, 1.0),
                    WaterKind::Dry => (rim, wet as f32 / 9.0),
                };
                if share > 0.0 {
                    (*ground, *cover) = covered(*ground, *cover, material, share);
                }
            }
        }
    }

    /// Grass, dirt, rock and sand, in this order from the lowest byte of each word.
    pub fn ground(&self) -> &Grid<u32> {
        &self.ground
    }

    /// Snow, forest, scree and wetland, in this order from the lowest byte of each word.
    pub fn cover(&self) -> &Grid<u32> {
        &self.cover
    }

    /// Returns the weight of a material at a vertex, 0 to 255.
    ///
    /// # Panics
    /// When the vertex is outside the area.
    pub fn weight(&self, material: Material, x: i64, y: i64) -> u8 {
        let (words, byte) = match material as usize {
            channel @ 0..4 => (&self.ground, channel),
            channel => (&self.cover, channel - 4),
        };
        words.at(x, y).to_le_bytes()[byte]
    }
}

/// Weighs the materials; with `AROUND`, also the materials that depend on the surroundings of a vertex; with `CLIMATE`,
/// by the climate of each vertex.
struct Weigh<'a, const AROUND: bool, const CLIMATE: bool> {
    rule: &'a GroundRule,
    climate: Option<&'a GroundClimate>,
    heights: &'a Grid<f32>,
    normals: &'a Normals,
    surroundings: Option<&'a GroundSurroundings>,
    to: &'a mut Blend,
}

impl<const AROUND: bool, const CLIMATE: bool> Kernel for Weigh<'_, AROUND, CLIMATE> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Area { x0, y0, x1, y1 } = self.normals.up().area();
        let width = (x1 - x0) as usize;
        let rule = self.rule;
        let (zero, one) = (simd.splat(0.0), simd.splat(1.0));
        for y in y0..y1 {
            let climate = self.climate.map(|climate| climate.row(y));
            let heights = self.heights.row(y, x0, x1);
            let [_, ups, souths] = self.normals.row(y, x0, x1);
            let [roughs, rubbles, damps] = match self.surroundings {
                Some(around) => [&around.noise, &around.rubble, &around.damp].map(|grid| grid.row(y, x0, x1)),
                None => [&[] as &[f32]; 3],
            };
            let far = match AROUND {
                true => [y - FLOOR, y, y + FLOOR].map(|y| self.heights.row(y, x0 - FLOOR, x1 + FLOOR)),
                false => [&[] as &[f32]; 3],
            };
            let ground = self.to.ground.row_mut(y, x0, x1);
            let cover = self.to.cover.row_mut(y, x0, x1);
            for from in starts(width, S::LANES) {
                let height = simd.load(&heights[from..]);
                let south = simd.load(&souths[from..]);
                let up = simd.load(&ups[from..]);
                let (steepness, tilt) = (steepness(simd, up, rule), one - up);
                let rough = if AROUND { simd.load(&roughs[from..]) } else { zero };
                let damp = if AROUND { simd.load(&damps[from..]) } else { zero };
                // Heights of ground with the same snow and the same trees in the climate of the settings.
                let mut snow_height = height - south * simd.splat(rule.snow_north_m);
                let mut forest_height = height - south * simd.splat(rule.forest.north_m);
                let (mut woods, mut desert, mut sand_sea, mut barren, mut bare_stones) = (one, zero, zero, zero, zero);
                if CLIMATE && let Some(climate) = climate {
                    let climate = LaneClimate::load(simd, climate, from).watered(simd, damp);
                    (woods, desert, sand_sea) = (climate.woods(simd), climate.desert(simd, rough), climate.sand_sea);
                    let tundra = climate.tundra(simd, forest_height, rough);
                    barren = simd.max(climate.thinned(simd, rough), tundra);
                    bare_stones = stony(simd, simd.max(desert, tundra), tilt);
                    snow_height = snow_height - (climate.snow_line_m - simd.splat(rule.half_snow_m));
                    forest_height = forest_height - (climate.tree_line_m - simd.splat(rule.forest.last_trees_m));
                }
                // Each material takes its share of the weight that the materials above it have left.
                let snow = ramp(simd, snow_height, rule.snow) * (one - ramp(simd, steepness, rule.snow_slides));
                let (snow, mut left) = take(simd, simd.splat_u32(255), snow);
                let mut cover_word = snow;
                let bare = ramp(simd, steepness, rule.rock);
                let mut rock;
                (rock, left) = take(simd, left, bare);
                if AROUND {
                    let rubble = simd.load(&rubbles[from..]);
                    let scree;
                    (scree, left) = take(simd, left, rule.scree_share(simd, rubble - bare, steepness, rough));
                    cover_word = cover_word | simd.shl::<16>(scree);
                }
                let flat = one - ramp(simd, steepness, rule.steep_sand);
                let mut sandy = (one - ramp(simd, height, rule.no_sand)) * flat;
                if CLIMATE {
                    let sheets = rule.desert_sand(simd, desert, tilt, rough);
                    sandy = simd.max(sandy, simd.max(sheets, sand_sea));
                }
                let sand;
                (sand, left) = take(simd, left, sandy);
                if AROUND {
                    let (wetland, forest);
                    (wetland, left) = take(simd, left, wetland_share(simd, damp, rough));
                    let around = steepest_around(simd, &far, from, rule);
                    let place =
                        ForestPlace { height: forest_height, steepness, around, damp, noise: rough, climate: woods };
                    (forest, left) = take(simd, left, rule.forest.share(simd, &place));
                    cover_word = cover_word | simd.shl::<8>(forest) | simd.shl::<24>(wetland);
                }
                let (mut dirt, grass) = take(simd, left, simd.max(ramp(simd, steepness, rule.dirt), barren));
                if CLIMATE {
                    let stones;
                    (stones, dirt) = take(simd, dirt, bare_stones);
                    rock = rock + stones;
                }
                let word = (grass | simd.shl::<8>(dirt)) | (simd.shl::<16>(rock) | simd.shl::<24>(sand));
                simd.store_u32(word, &mut ground[from..]);
                simd.store_u32(cover_word, &mut cover[from..]);
            }
        }
    }
}

/// Returns the factor that turns a difference in height over [`FLOOR`] vertices into a slope.
pub(super) fn floor_scale(half_per_spacing: f32) -> f32 {
    2.0 * half_per_spacing / FLOOR as f32
}

/// Returns the greatest steepness from vertices to those [`FLOOR`] vertices to the north, west, east and south.
#[inline(always)]
fn steepest_around<S: Simd>(simd: S, rows: &[&[f32]; 3], from: usize, rule: &GroundRule) -> S::F32 {
    let (one, pad) = (simd.splat(1.0), FLOOR as usize);
    let here = simd.load(&rows[1][from + pad..]);
    let [north, south] = [rows[0], rows[2]];
    let across =
        simd.max(simd.abs(simd.load(&rows[1][from..]) - here), simd.abs(simd.load(&rows[1][from + 2 * pad..]) - here));
    let along =
        simd.max(simd.abs(simd.load(&north[from + pad..]) - here), simd.abs(simd.load(&south[from + pad..]) - here));
    let rise = simd.max(across, along) * simd.splat(floor_scale(rule.half_per_spacing));
    steepness(simd, one / simd.sqrt(rise * rise + one), rule)
}

/// Splits whole weights: returns (`share` of `weight`, rounded; the rest).
#[inline(always)]
fn take<S: Simd>(simd: S, weight: S::U32, share: S::F32) -> (S::U32, S::U32) {
    let taken = simd.truncate_to_i32(simd.i32_to_f32(weight) * share + simd.splat(0.5));
    (taken, weight - taken)
}

/// Covers a share of a vertex with a material: each weight gives up that share. Returns the new words of ground and
/// cover.
fn covered(ground: u32, cover: u32, material: Material, share: f32) -> (u32, u32) {
    let parts = (share * 255.0 + 0.5) as u32;
    let (mut given, mut weights) = (0, [ground.to_le_bytes(), cover.to_le_bytes()]);
    for weight in weights.iter_mut().flatten() {
        let part = ((*weight as u32 * parts + 127) / 255) as u8;
        *weight -= part;
        given += part;
    }
    weights.as_flattened_mut()[material as usize] += given;
    (u32::from_le_bytes(weights[0]), u32::from_le_bytes(weights[1]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn snow_lies_lower_where_the_sun_does_not_reach() {
        // A ridge from west to east with sides of 45 degrees, 1 m between vertices.
        let area = Area::new(0, -400, 16, 801);
        let heights = Grid::of(area.padded(1), |_, y| 1000.0 - y.abs() as f32);
        let normals = Normals::new(&heights, area, 1.0);
        let lowest_snow_m = |aspect_m: f64| {
            let ground = GroundSettings {
                slope_scale: 1.0,
                snow_m: Some([800.0, 801.0]),
                snow_aspect_m: aspect_m,
                ..GroundSettings::default()
            };
            let blend = Blend::new(&GroundRule::new(&ground, None, 1.0, 1), None, &heights, None, &normals);
            let snowy = |y: &i64| blend.weight(Material::Snow, 3, *y) > 127;
            // On the northern side and on the southern side.
            [(-400..0).find(snowy), (1..=400).rev().find(snowy)].map(|y| heights.at(3, y.unwrap()))
        };
        let [[north, south], [shady, sunny], [hot, cold]] = [0.0, 100.0, -100.0].map(lowest_snow_m);
        assert_eq!(north, south);
        assert_eq!([shady, sunny], [north - 100.0, south + 100.0]);
        assert_eq!([hot, cold], [sunny, shady]);
    }

    /// Returns ground settings with all materials, for land with a metre between vertices.
    fn everything() -> GroundSettings {
        GroundSettings {
            slope_scale: 2.0,
            rock: [0.5, 0.8],
            scree: Some([0.15, 0.25]),
            scree_m: 10.0,
            forest_m: Some([300.0, 400.0]),
            forest_share: 1.0,
            wet_m: Some(7.0),
            ..GroundSettings::default()
        }
    }

    /// Returns the weights of land given by functions for height and flow, with a metre between vertices.
    fn weights(area: Area, height_m: impl Fn(i64, i64) -> f32, flow_m3s: impl Fn(i64, i64) -> f32) -> Blend {
        let ground = everything();
        let wide = input(&ground, area);
        let heights = Grid::of(wide, height_m);
        let water = Water {
            kind: Grid::of(wide, |x, y| if flow_m3s(x, y) > 0.0 { WaterKind::River } else { WaterKind::Dry }),
            bed: Grid::filled(wide, false),
            depth_m: Grid::filled(wide, 0.0),
            flow_m3s: Grid::of(wide, flow_m3s),
            ice_m: None,
        };
        let normals = Normals::new(&heights, area, 1.0);
        Blend::new(&GroundRule::new(&ground, None, 1.0, 1), None, &heights, Some(&water), &normals)
    }

    #[test]
    fn scree_lies_below_cliffs() {
        // From the north: a gentle slope, a cliff that falls twice as far as it is wide, a slope of 31 degrees, and
        // level ground.
        let area = Area::new(0, -30, 64, 90);
        let down = |y: i64, from: i64, to: i64| (y.clamp(from, to) - from) as f32;
        let slope_m = |y: i64| 0.25 * down(y, -60, 0) + 2.0 * down(y, 0, 10) + 0.6 * down(y, 10, 40);
        let blend = weights(area, |_, y| 1000.0 - slope_m(y), |_, _| 0.0);
        let scree = |y: i64| (0..64).map(|x| u32::from(blend.weight(Material::Scree, x, y))).sum::<u32>() / 64;
        assert!((-30..10).all(|y| scree(y) == 0), "on the cliff and above it");
        assert!((11..13).all(|y| scree(y) > 200), "at its foot: {} and {}", scree(11), scree(12));
        assert!((20..60).all(|y| scree(y) == 0), "further down");
    }

    #[test]
    fn forest_ends_at_the_tree_line_and_at_cliffs() {
        // The land rises to the south at 20 degrees, and has cliffs in the east.
        let area = Area::new(0, 0, 64, 1400);
        let blend = weights(area, |x, y| 0.36 * y as f32 + 3.0 * (x - 40).max(0) as f32, |_, _| 0.0);
        let forest = |x, y| blend.weight(Material::Forest, x, y);
        let tree_line = (400.0_f32 / 0.36).ceil() as i64;
        assert!((0..40).all(|x| (tree_line..1400).all(|y| forest(x, y) == 0)));
        assert!((42..64).all(|x| (0..1400).all(|y| forest(x, y) == 0)));
        let wooded = area.vertices().filter(|(x, y)| *x < 38 && *y < 800 && forest(*x, *y) > 127).count();
        assert!(wooded > 38 * 800 / 2, "{wooded}");
    }

    #[test]
    fn wet_ground_follows_the_water() {
        let area = Area::new(-20, 0, 40, 400);
        let width = |flow_m3s: f32| {
            let blend = weights(area, |_, _| 500.0, |x, _| if x == 0 { flow_m3s } else { 0.0 });
            let wet = |(x, y): &(i64, i64)| blend.weight(Material::Wetland, *x, *y) > 0;
            assert!(area.vertices().filter(wet).all(|(x, _)| x.abs() < 7), "out of reach");
            area.vertices().filter(wet).count() as f32 / 400.0
        };
        let [brook, river] = [0.02, 2.0].map(width);
        assert!(brook >= 2.0 && river > brook + 2.0, "{brook} and {river} vertices");
        // Wet ground does not climb a bank.
        let blend = weights(area, |x, _| 500.0 + 3.0 * x.max(0) as f32, |x, _| if x == 0 { 2.0 } else { 0.0 });
        assert!(area.vertices().all(|(x, y)| x < 2 || blend.weight(Material::Wetland, x, y) == 0));
    }

    #[test]
    fn nothing_outside_the_input_matters() {
        for ground in [GroundSettings::default(), everything()] {
            only_the_input_matters(&ground);
        }
    }

    fn only_the_input_matters(ground: &GroundSettings) {
        let area = Area::new(-3, 8, 17, 20);
        let wide = area.padded(12);
        let mut heights = Grid::filled(wide, 0.0);
        let mut kind = Grid::filled(wide, WaterKind::Dry);
        for (index, (height_m, kind)) in heights.values_mut().iter_mut().zip(kind.values_mut()).enumerate() {
            *height_m = (index * 7919 % 1013) as f32;
            *kind = [WaterKind::Dry, WaterKind::Dry, WaterKind::River, WaterKind::Lake][index * 31 % 97 % 4];
        }
        let normals = Normals::new(&heights, area, 300.0);
        let dry = Grid::filled(wide, 0.0);
        let made = |heights: &Grid<f32>, kind: &Grid<WaterKind>| {
            let rule = GroundRule::new(ground, None, 300.0, 1);
            let bed = Grid::filled(wide, false);
            let water = Water { kind: kind.clone(), bed, depth_m: dry.clone(), flow_m3s: dry.clone(), ice_m: None };
            let blend = Blend::new(&rule, None, heights, Some(&water), &normals);
            [blend.ground, blend.cover]
        };
        let expected = made(&heights, &kind);
        heights.fill_outside(input(ground, area), f32::NAN);
        kind.fill_outside(input(ground, area), WaterKind::Sea);
        assert_eq!(made(&heights, &kind), expected);
        kind.fill_outside(area, WaterKind::Sea);
        assert_ne!(made(&heights, &kind), expected, "mud lies beside water that is not in the area");
    }
}
