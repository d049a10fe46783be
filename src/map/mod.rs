//! The map: a top-down picture of the land.

pub(crate) mod colour;
mod mark;
mod tint;

use crate::land::WaterKind;
use crate::lines::Imprint;
use crate::simd::{Kernel, Simd, dispatch};
use crate::tile::Tile;
use crate::world::World;
use tint::TintScale;

/// Paints tiles as a map: hypsometric tint, touched by what the ground is made of, times a relief shading; the sea in blues.
///
/// A pixel is a vertex, so two tiles agree on the pixels of the edge that they share.
pub struct MapPainter {
    tint: TintScale,
    sea_level_m: f32,
    exaggeration: f32,
}

impl MapPainter {
    /// The painter of a world, in the style of its preset.
    pub fn new(world: &World) -> MapPainter {
        let preset = world.preset();
        let (lowest_m, highest_m) = world.height_range_m();
        let sea_level_m = preset.sea_level_m.map_or(f32::NEG_INFINITY, |level| level as f32);
        let low_m = preset.map.low_m.map_or(sea_level_m.max(lowest_m), |low| low as f32);
        let high_m = preset.map.high_m.map_or(highest_m, |high| high as f32);
        MapPainter {
            // A metre at least, or level land would divide by zero.
            tint: TintScale::new(preset.map.tint, lowest_m, low_m, high_m.max(low_m + 1.0)),
            sea_level_m,
            exaggeration: preset.map.exaggeration.unwrap_or(1.0) as f32,
        }
    }

    /// Writes row `y` of a tile as RGB, as many pixels from its western edge as `row` holds.
    pub fn paint_row(&self, tile: &Tile, y: i64, row: &mut [u8]) {
        let x0 = tile.area().x0;
        let (pixels, _) = row.as_chunks_mut::<3>();
        for (chunk, pixels) in (0..).zip(pixels.chunks_mut(CHUNK)) {
            let x0 = x0 + chunk * CHUNK as i64;
            let x1 = x0 + pixels.len() as i64;
            // Looked up one by one: lanes cannot read from a table of this size.
            let mut tints = [[0.0; CHUNK]; 3];
            let mut sea = [0.0; CHUNK];
            let heights = tile.heights().row(y, x0, x1);
            for (index, &height) in heights.iter().enumerate() {
                let under_water = height < self.sea_level_m;
                sea[index] = if under_water { 1.0 } else { 0.0 };
                let colour =
                    if under_water { self.tint.sea(self.sea_level_m - height) } else { self.tint.land(height) };
                [tints[0][index], tints[1][index], tints[2][index]] = colour;
            }
            let mut words = [0; CHUNK];
            let [east, up, south] = tile.normals().row(y, x0, x1);
            let ground = tile.blend().ground().row(y, x0, x1);
            let cover = tile.blend().cover().row(y, x0, x1);
            // Pixels past the row's end are computed from zeros and not used, so that all lanes are full.
            dispatch(Shade {
                exaggeration: self.exaggeration,
                tints: &tints,
                sea: &sea,
                east: &fill(east),
                up: &fill(up),
                south: &fill(south),
                ground: &fill(ground),
                cover: &fill(cover),
                words: &mut words,
            });
            for (pixel, word) in pixels.iter_mut().zip(words) {
                // Lanes make a word a pixel; three bytes of it are the pixel.
                let [red, green, blue, _] = word.to_le_bytes();
                *pixel = [red, green, blue];
            }
            // From here on few pixels are touched, one by one: water, then ways over it, then marks over all.
            if let Some(water) = tile.water() {
                let depths = water.depth_m.row(y, x0, x1);
                for ((pixel, kind), depth_m) in pixels.iter_mut().zip(water.kind.row(y, x0, x1)).zip(depths) {
                    match kind {
                        WaterKind::River => composite(pixel, (RIVER_OPACITY, RIVER)),
                        WaterKind::Lake => composite(pixel, (LAKE_OPACITY, self.tint.sea(*depth_m))),
                        WaterKind::Dry | WaterKind::Sea => {}
                    }
                }
            }
            let imprint = tile.imprint();
            if let Some(trodden) = imprint.and_then(Imprint::trodden) {
                lay(pixels, trodden.dirt.row(y, x0, x1), (ROAD_OPACITY, ROAD));
            }
            if let Some(dug) = imprint.and_then(Imprint::dug) {
                lay(pixels, dug.water.row(y, x0, x1), (1.0, RIVER));
            }
            if let Some(built) = imprint.and_then(Imprint::built) {
                lay(pixels, built.decks.row(y, x0, x1), (WAY_OPACITY, WAY));
            }
            for site in tile.sites() {
                mark::paint_row(site, x0, y, pixels);
            }
        }
    }
}

/// Lets a colour cover a share of each pixel.
fn lay(pixels: &mut [[u8; 3]], shares: &[f32], (opacity, colour): (f32, [f32; 3])) {
    for (pixel, share) in pixels.iter_mut().zip(shares) {
        composite(pixel, (share * opacity, colour));
    }
}

/// Lets an opaque share of a colour cover a pixel.
fn composite(pixel: &mut [u8; 3], (opacity, colour): (f32, [f32; 3])) {
    for (channel, colour) in pixel.iter_mut().zip(colour) {
        let value = f32::from(*channel);
        *channel = (value + (colour - value) * opacity + 0.5) as u8;
    }
}

/// Pixels shaded at once: a multiple of all lane counts, small enough to stay in the first-level cache.
const CHUNK: usize = 256;

fn fill<T: Copy + Default>(values: &[T]) -> [T; CHUNK] {
    let mut filled = [T::default(); CHUNK];
    filled[..values.len()].copy_from_slice(values);
    filled
}

/// A directional light: towards it, and how much of the relief shading it gives.
struct Light {
    east: f32,
    up: f32,
    south: f32,
    share: f32,
}

/// Light from the north-west above all, as the eye of a map reader expects; softer lights from west and north keep
/// ridges that run towards the main light from vanishing. All 45 degrees high; the shares, chosen by eye, sum to 1.
const LIGHTS: [Light; 3] = [
    Light { east: -0.5, up: std::f32::consts::FRAC_1_SQRT_2, south: -0.5, share: 0.6 },
    Light { east: -std::f32::consts::FRAC_1_SQRT_2, up: std::f32::consts::FRAC_1_SQRT_2, south: 0.0, share: 0.2 },
    Light { east: 0.0, up: std::f32::consts::FRAC_1_SQRT_2, south: -std::f32::consts::FRAC_1_SQRT_2, share: 0.2 },
];

/// What the tint is multiplied by in full shadow and in full light: bluish violet and a warm white, chosen so that
/// level ground (0.707 of the light) keeps its tint.
const SHADOW: [f32; 3] = [0.24, 0.26, 0.36];
const FULL_LIGHT: [f32; 3] = [1.315, 1.307, 1.265];

/// Colours of the grounds that show through the tint, in sRGB, and their opacities. Chosen by eye, as all colours below are.
const ROCK: [f32; 3] = [139.0, 130.0, 122.0];
const ROCK_OPACITY: f32 = 0.45;
const SAND: [f32; 3] = [231.0, 216.0, 172.0];
const SAND_OPACITY: f32 = 0.75;
const SNOW: [f32; 3] = [248.0, 250.0, 252.0];
const SNOW_OPACITY: f32 = 0.92;
const FOREST: [f32; 3] = [66.0, 92.0, 64.0];
const FOREST_OPACITY: f32 = 0.72;
const SCREE: [f32; 3] = [172.0, 167.0, 162.0];
const SCREE_OPACITY: f32 = 0.55;
const WETLAND: [f32; 3] = [118.0, 148.0, 118.0];
const WETLAND_OPACITY: f32 = 0.6;

/// Rivers as the sea's shallows, roads as trodden earth.
const RIVER: [f32; 3] = [96.0, 150.0, 186.0];
const RIVER_OPACITY: f32 = 0.85;
const LAKE_OPACITY: f32 = 0.95;
const ROAD: [f32; 3] = [222.0, 203.0, 160.0];
const ROAD_OPACITY: f32 = 0.85;
/// Roads between settlements: a dark line on land of any colour.
const WAY: [f32; 3] = [104.0, 58.0, 40.0];
const WAY_OPACITY: f32 = 0.9;

/// How much of the sea floor's shading is seen through the water. Chosen by eye.
const UNDER_WATER: f32 = 0.3;

struct Shade<'a> {
    exaggeration: f32,
    tints: &'a [[f32; CHUNK]; 3],
    sea: &'a [f32; CHUNK],
    east: &'a [f32; CHUNK],
    up: &'a [f32; CHUNK],
    south: &'a [f32; CHUNK],
    ground: &'a [u32; CHUNK],
    cover: &'a [u32; CHUNK],
    words: &'a mut [u32; CHUNK],
}

impl Kernel for Shade<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let (zero, one) = (simd.splat(0.0), simd.splat(1.0));
        let exaggeration = simd.splat(self.exaggeration);
        let byte = simd.splat_u32(255);
        let mut at = 0;
        while at < CHUNK {
            // The relief shading, from the normal of the steepened land.
            let east = simd.load(&self.east[at..]) * exaggeration;
            let south = simd.load(&self.south[at..]) * exaggeration;
            let up = simd.load(&self.up[at..]);
            let length = simd.sqrt((east * east + south * south) + up * up);
            // A lane past the row's end has no normal; any length but zero does.
            let scale = one / simd.max(length, simd.splat(1e-6));
            let mut shade = zero;
            for light in &LIGHTS {
                let lit = (east * simd.splat(light.east) + south * simd.splat(light.south)) + up * simd.splat(light.up);
                shade = shade + simd.max(lit * scale, zero) * simd.splat(light.share);
            }
            // What level ground has of the light; under water only a part of the difference is seen.
            let flat = simd.splat(LIGHTS[0].up);
            let sea = simd.load(&self.sea[at..]);
            let land = one - sea;
            shade = flat + (shade - flat) * (land + sea * simd.splat(UNDER_WATER));
            // The grounds that show through the tint on land.
            let ground = simd.load_u32(&self.ground[at..]);
            let cover = simd.load_u32(&self.cover[at..]);
            let rock = simd.i32_to_f32(simd.shr::<16>(ground) & byte) * land * simd.splat(ROCK_OPACITY / 255.0);
            let sand = simd.i32_to_f32(simd.shr::<24>(ground)) * land * simd.splat(SAND_OPACITY / 255.0);
            let snow = simd.i32_to_f32(cover & byte) * land * simd.splat(SNOW_OPACITY / 255.0);
            let forest = simd.i32_to_f32(simd.shr::<8>(cover) & byte) * land * simd.splat(FOREST_OPACITY / 255.0);
            let scree = simd.i32_to_f32(simd.shr::<16>(cover) & byte) * land * simd.splat(SCREE_OPACITY / 255.0);
            let wetland = simd.i32_to_f32(simd.shr::<24>(cover)) * land * simd.splat(WETLAND_OPACITY / 255.0);
            let mut word = simd.splat_u32(0);
            let mut channel = 3;
            // From blue to red, since each shifts those before it up by a byte.
            while channel > 0 {
                channel -= 1;
                let mut colour = simd.load(&self.tints[channel][at..]);
                colour = colour + (simd.splat(ROCK[channel]) - colour) * rock;
                colour = colour + (simd.splat(SAND[channel]) - colour) * sand;
                colour = colour + (simd.splat(WETLAND[channel]) - colour) * wetland;
                colour = colour + (simd.splat(FOREST[channel]) - colour) * forest;
                colour = colour + (simd.splat(SCREE[channel]) - colour) * scree;
                colour = colour + (simd.splat(SNOW[channel]) - colour) * snow;
                let (dark, bright) = (SHADOW[channel], FULL_LIGHT[channel]);
                colour = colour * (simd.splat(dark) + shade * simd.splat(bright - dark));
                colour = simd.min(simd.max(colour, zero) + simd.splat(0.5), simd.splat(255.0));
                word = simd.shl::<8>(word) | simd.truncate_to_i32(colour);
            }
            simd.store_u32(word, &mut self.words[at..]);
            at += S::LANES;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn level_ground_keeps_its_tint() {
        for channel in 0..3 {
            let flat = SHADOW[channel] + LIGHTS[0].up * (FULL_LIGHT[channel] - SHADOW[channel]);
            assert!((flat - 1.0).abs() < 0.005, "channel {channel} is multiplied by {flat}");
        }
        assert_eq!(LIGHTS.iter().map(|light| light.share).sum::<f32>(), 1.0);
    }
}
