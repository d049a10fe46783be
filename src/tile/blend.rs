//! The blend map: what the ground of each vertex is made of.

use std::f64::consts::SQRT_2;

use crate::area::Area;
use crate::grid::Grid;
use crate::land::{Water, WaterKind};
use crate::lines::Imprint;
use crate::preset::ground::GroundSettings;
use crate::simd::{Kernel, Simd, dispatch};
use crate::tile::Normals;

/// A ground material of the blend map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Material {
    /// What is left where nothing else lies.
    Grass,
    /// Bare soil on slopes.
    Dirt,
    /// Rock on steep slopes.
    Rock,
    /// Sand by the sea.
    Sand,
    /// Snow on heights, further down where the sun does not reach.
    Snow,
}

impl Material {
    /// All materials, in the order of their channels: four in the ground words, then four in the cover words.
    pub const ALL: [Material; 5] = [Material::Grass, Material::Dirt, Material::Rock, Material::Sand, Material::Snow];

    /// The name in files.
    pub const fn name(self) -> &'static str {
        match self {
            Material::Grass => "grass",
            Material::Dirt => "dirt",
            Material::Rock => "rock",
            Material::Sand => "sand",
            Material::Snow => "snow",
        }
    }
}

/// The area of land that the weights of an area are made of: mud lies beside water too.
pub(super) const fn input(area: Area) -> Area {
    area.padded(1)
}

/// How much of each material every vertex has; the weights of a vertex sum to exactly 255.
#[derive(Debug)]
pub struct Blend {
    ground: Grid<u32>,
    cover: Grid<u32>,
}

impl Blend {
    /// The blend weights of all vertices that have a normal.
    ///
    /// # Panics
    /// When `heights` does not hold all of them.
    pub fn new(rule: &GroundRule, heights: &Grid<f32>, normals: &Normals) -> Blend {
        let area = normals.up().area();
        let mut blend = Blend { ground: Grid::filled(area, 0), cover: Grid::filled(area, 0) };
        dispatch(Weigh { rule, heights, normals, blend: &mut blend });
        blend
    }

    /// Lays the sand of rivers and then the dirt of roads over what is there.
    pub(super) fn cover_with(&mut self, imprint: &Imprint) {
        if let Some(sand) = imprint.sand() {
            self.lay(Material::Sand, sand);
        }
        for dirt in imprint.dirt() {
            self.lay(Material::Dirt, dirt);
        }
    }

    /// Lays a share of a material over what is there.
    fn lay(&mut self, material: Material, shares: &Grid<f32>) {
        let Area { x0, y0, x1, y1 } = self.ground.area();
        for y in y0..y1 {
            let ground = self.ground.row_mut(y, x0, x1);
            let cover = self.cover.row_mut(y, x0, x1);
            for ((ground, cover), share) in ground.iter_mut().zip(cover).zip(shares.row(y, x0, x1)) {
                if *share > 0.0 {
                    (*ground, *cover) = covered(*ground, *cover, material, *share);
                }
            }
        }
    }

    /// Lays gravel and mud on the beds of rivers and lakes, and next to them.
    pub(super) fn wet(&mut self, water: &Water) {
        let Area { x0, y0, x1, y1 } = self.ground.area();
        for y in y0..y1 {
            let rows = [y - 1, y, y + 1].map(|y| water.kind.row(y, x0 - 1, x1 + 1));
            let ground = self.ground.row_mut(y, x0, x1);
            let cover = self.cover.row_mut(y, x0, x1);
            for (column, (ground, cover)) in ground.iter_mut().zip(cover).enumerate() {
                let around = rows.iter().flat_map(|row| &row[column..column + 3]);
                // Of the vertex and its eight neighbours.
                let wet = around.filter(|kind| matches!(kind, WaterKind::River | WaterKind::Lake)).count();
                let (material, share) = match rows[1][column + 1] {
                    WaterKind::River | WaterKind::Sea => (Material::Sand, 1.0),
                    WaterKind::Lake => (Material::Dirt, 1.0),
                    WaterKind::Dry => (Material::Dirt, wet as f32 / 9.0),
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

    /// Snow in the lowest byte of each word; the other three are free.
    pub fn cover(&self) -> &Grid<u32> {
        &self.cover
    }

    /// The weight of a material at a vertex, 0 to 255.
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

/// Which ground lies where, ready to be applied: each limit as a ramp from 0 to 1.
#[derive(Clone, Debug)]
pub struct GroundRule {
    slope_scale: f32,
    dirt: LinearStep,
    rock: LinearStep,
    no_sand: LinearStep,
    snow: LinearStep,
    /// Metres by which snow lies lower for each part of the normal that points north.
    snow_north_m: f32,
    snow_slides: LinearStep,
}

/// `clamp(value * scale + shift, 0, 1)`.
#[derive(Clone, Copy, Debug)]
struct LinearStep {
    scale: f32,
    shift: f32,
}

impl LinearStep {
    fn between([from, to]: [f64; 2]) -> LinearStep {
        let scale = 1.0 / (to - from);
        LinearStep { scale: scale as f32, shift: (-from * scale) as f32 }
    }

    fn always(value: f32) -> LinearStep {
        LinearStep { scale: 0.0, shift: value }
    }
}

impl GroundRule {
    /// The rule of checked settings; sand lies about the sea level.
    pub fn new(ground: &GroundSettings, sea_level_m: Option<f64>) -> GroundRule {
        let sea_level_m = sea_level_m.unwrap_or(0.0);
        GroundRule {
            slope_scale: ground.slope_scale as f32,
            dirt: LinearStep::between(ground.dirt),
            rock: LinearStep::between(ground.rock),
            no_sand: match ground.sand_m {
                Some([all, none]) => LinearStep::between([sea_level_m + all, sea_level_m + none]),
                None => LinearStep::always(1.0),
            },
            snow: ground.snow_m.map_or(LinearStep::always(0.0), LinearStep::between),
            snow_north_m: (ground.snow_aspect_m * SQRT_2) as f32,
            snow_slides: LinearStep::between(ground.snow_slope),
        }
    }
}

struct Weigh<'a> {
    rule: &'a GroundRule,
    heights: &'a Grid<f32>,
    normals: &'a Normals,
    blend: &'a mut Blend,
}

impl Kernel for Weigh<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Area { x0, y0, x1, y1 } = self.normals.up().area();
        let width = (x1 - x0) as usize;
        let rule = self.rule;
        let one = simd.splat(1.0);
        for y in y0..y1 {
            let heights = self.heights.row(y, x0, x1);
            let [_, ups, souths] = self.normals.row(y, x0, x1);
            let ground = self.blend.ground.row_mut(y, x0, x1);
            let cover = self.blend.cover.row_mut(y, x0, x1);
            let mut at = 0;
            while at < width {
                // The last vector overlaps the one before: the same values are written again.
                let from = at.min(width - S::LANES);
                let height = simd.load(&heights[from..]);
                let steepness = (one - simd.load(&ups[from..])) * simd.splat(rule.slope_scale);
                let steepness = simd.min(steepness, one);
                // Each material takes its share of what the ones above it have left.
                let snow_height = height - simd.load(&souths[from..]) * simd.splat(rule.snow_north_m);
                let snow = ramp(simd, snow_height, rule.snow) * (one - ramp(simd, steepness, rule.snow_slides));
                let (snow, left) = take(simd, simd.splat_u32(255), snow);
                let (rock, left) = take(simd, left, ramp(simd, steepness, rule.rock));
                let (sand, left) = take(simd, left, one - ramp(simd, height, rule.no_sand));
                let (dirt, grass) = take(simd, left, ramp(simd, steepness, rule.dirt));
                let word = (grass | simd.shl::<8>(dirt)) | (simd.shl::<16>(rock) | simd.shl::<24>(sand));
                simd.store_u32(word, &mut ground[from..]);
                simd.store_u32(snow, &mut cover[from..]);
                at += S::LANES;
            }
        }
    }
}

#[inline(always)]
fn ramp<S: Simd>(simd: S, value: S::F32, ramp: LinearStep) -> S::F32 {
    let value = value * simd.splat(ramp.scale) + simd.splat(ramp.shift);
    simd.min(simd.max(value, simd.splat(0.0)), simd.splat(1.0))
}

/// Splits whole weights: (`share` of `weight`, rounded; the rest).
#[inline(always)]
fn take<S: Simd>(simd: S, weight: S::U32, share: S::F32) -> (S::U32, S::U32) {
    let taken = simd.truncate_to_i32(simd.i32_to_f32(weight) * share + simd.splat(0.5));
    (taken, weight - taken)
}

/// The words of a vertex when `material`, one of the ground's, covers a share of it: each weight gives up that share.
fn covered(ground: u32, cover: u32, material: Material, share: f32) -> (u32, u32) {
    let parts = (share * 255.0 + 0.5) as u32;
    let (mut given, mut weights) = (0, [ground.to_le_bytes(), cover.to_le_bytes()]);
    for weight in weights.iter_mut().flatten() {
        let part = ((*weight as u32 * parts + 127) / 255) as u8;
        *weight -= part;
        given += part;
    }
    weights[0][material as usize] += given;
    (u32::from_le_bytes(weights[0]), u32::from_le_bytes(weights[1]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn snow_lies_lower_where_the_sun_does_not_reach() {
        // A ridge from west to east whose sides are as steep as they are wide, 1 m between vertices.
        let area = Area::new(0, -400, 16, 801);
        let mut heights = Grid::filled(area.padded(1), 0.0);
        for y in area.y0 - 1..=area.y1 {
            heights.row_mut(y, area.x0 - 1, area.x1 + 1).fill(1000.0 - y.abs() as f32);
        }
        let normals = Normals::new(&heights, area, 1.0);
        let lowest_snow_m = |aspect_m: f64| {
            let ground = GroundSettings {
                slope_scale: 1.0,
                snow_m: Some([800.0, 801.0]),
                snow_aspect_m: aspect_m,
                ..GroundSettings::default()
            };
            let blend = Blend::new(&GroundRule::new(&ground, None), &heights, &normals);
            let snowy = |y: &i64| blend.weight(Material::Snow, 3, *y) > 127;
            // On the northern side and on the southern one.
            [(-400..0).find(snowy), (1..=400).rev().find(snowy)].map(|y| heights.at(3, y.unwrap()))
        };
        let [[north, south], [shady, sunny], [hot, cold]] = [0.0, 100.0, -100.0].map(lowest_snow_m);
        assert_eq!(north, south);
        assert_eq!([shady, sunny], [north - 100.0, south + 100.0]);
        assert_eq!([hot, cold], [sunny, shady]);
    }
    #[test]
    fn nothing_outside_the_input_matters() {
        let area = Area::new(-3, 8, 17, 20);
        let wide = area.padded(9);
        let mut heights = Grid::filled(wide, 0.0);
        let mut kind = Grid::filled(wide, WaterKind::Dry);
        for (index, (height_m, kind)) in heights.values_mut().iter_mut().zip(kind.values_mut()).enumerate() {
            *height_m = (index * 7919 % 1013) as f32;
            *kind = [WaterKind::Dry, WaterKind::Dry, WaterKind::River, WaterKind::Lake][index * 31 % 97 % 4];
        }
        let normals = Normals::new(&heights, area, 300.0);
        let dry = Grid::filled(wide, 0.0);
        let made = |heights: &Grid<f32>, kind: &Grid<WaterKind>| {
            let mut blend = Blend::new(&GroundRule::new(&GroundSettings::default(), None), heights, &normals);
            let bed = Grid::filled(wide, false);
            blend.wet(&Water { kind: kind.clone(), bed, depth_m: dry.clone(), flow_m3s: dry.clone() });
            [blend.ground, blend.cover]
        };
        let expected = made(&heights, &kind);
        heights.fill_outside(input(area), f32::NAN);
        kind.fill_outside(input(area), WaterKind::Sea);
        assert_eq!(made(&heights, &kind), expected);
        kind.fill_outside(area, WaterKind::Sea);
        assert_ne!(made(&heights, &kind), expected, "mud lies beside water that is not in the area");
    }
}
