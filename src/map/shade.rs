//! The relief shading of the map, and the grounds that show through its tint, on the lanes of simd.

use crate::simd::{Kernel, Simd};

/// Pixels shaded at once: a multiple of all lane counts, small enough to stay in the first-level cache.
pub(super) const CHUNK: usize = 256;

/// Values of a chunk that may be short, and zeros.
pub(super) fn fill<T: Copy + Default>(values: &[T]) -> [T; CHUNK] {
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

/// Colours of the grounds that show through the tint, in sRGB, and their opacities. Chosen by eye.
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

/// How much of the sea floor's shading is seen through the water. Chosen by eye.
const UNDER_WATER: f32 = 0.3;

/// Shades a chunk of pixels.
pub(super) struct Shade<'a> {
    /// How many times steeper the land is shaded than it is.
    pub exaggeration: f32,
    /// Red, green and blue of the tint, 0 to 255.
    pub tints: &'a [[f32; CHUNK]; 3],
    /// 1 where the sea is, 0 elsewhere.
    pub sea: &'a [f32; CHUNK],
    /// Unit normals, by axis.
    pub east: &'a [f32; CHUNK],
    pub up: &'a [f32; CHUNK],
    pub south: &'a [f32; CHUNK],
    /// Weights of materials, as [`Blend`](crate::tile::Blend) packs them.
    pub ground: &'a [u32; CHUNK],
    pub cover: &'a [u32; CHUNK],
    /// The shaded pixels: red in the lowest byte, then green and blue.
    pub words: &'a mut [u32; CHUNK],
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
