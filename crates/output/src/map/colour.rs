//! The colour of the ground by itself, without light. Meshes are painted with it.
//!
//! To judge the numbers chosen by eye, look at meshes with textures and at `colour` rasters.

use crate::map::light::CHUNK;
use crate::map::relief::filled;
use crate::simd::{Kernel, Simd, dispatch};
use crate::tile::{Material, Tile};

/// sRGB of each material, in the order of [`Material::ALL`]. Chosen by eye.
const COLOURS: [[f32; 3]; Material::ALL.len()] = [
    [92.0, 112.0, 58.0],
    [124.0, 99.0, 70.0],
    [122.0, 116.0, 110.0],
    [199.0, 182.0, 141.0],
    [240.0, 243.0, 248.0],
    [52.0, 72.0, 42.0],
    [148.0, 141.0, 131.0],
    [84.0, 98.0, 62.0],
];

/// Writes the westernmost pixels of row `y` of a tile as RGB, as many as `row` holds: the colours of the materials,
/// mixed by weight.
pub(crate) fn paint_row(tile: &Tile, y: i64, row: &mut [u8]) {
    let pixels = row.as_chunks_mut::<3>().0;
    for (x0, pixels) in (tile.area().x0..).step_by(CHUNK).zip(pixels.chunks_mut(CHUNK)) {
        let x1 = x0 + pixels.len() as i64;
        let mut words = [0; CHUNK];
        dispatch(Colours {
            weights: [&filled(tile.blend().ground().row(y, x0, x1)), &filled(tile.blend().cover().row(y, x0, x1))],
            count: pixels.len(),
            words: &mut words,
        });
        for (pixel, word) in pixels.iter_mut().zip(words) {
            // The kernel stores a word per pixel; its lower three bytes are the colour.
            let [red, green, blue, _] = word.to_le_bytes();
            *pixel = [red, green, blue];
        }
    }
}

/// Mixes the colours of a chunk of pixels.
struct Colours<'a> {
    /// Weights of materials, four in a word, as [`Blend`](crate::tile::Blend) packs them.
    weights: [&'a [u32; CHUNK]; 2],
    /// Number of pixels wanted, from the first on.
    count: usize,
    /// The pixels: red in the lowest byte, then green and blue.
    words: &'a mut [u32; CHUNK],
}

impl Kernel for Colours<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let (byte, none) = (simd.splat_u32(255), simd.splat_u32(0));
        let mut at = 0;
        while at < self.count {
            // Start at a half: the cast truncates, so the sum comes out rounded.
            let half = simd.splat(0.5);
            let [mut red, mut green, mut blue] = [half, half, half];
            let mut material = 0;
            while material < COLOURS.len() {
                let mut words = simd.load_u32(&self.weights[material / 4][at..]);
                let colours = COLOURS.as_chunks::<4>().0;
                let mut within = 0;
                while within < 4 {
                    let weight = words & byte;
                    // Most vertices have one or two materials; skip the others.
                    if simd.any(simd.gt_i32(weight, none)) {
                        let share = simd.i32_to_f32(weight) / simd.splat(255.0);
                        let colour = colours[material / 4][within];
                        red = red + simd.splat(colour[0]) * share;
                        green = green + simd.splat(colour[1]) * share;
                        blue = blue + simd.splat(colour[2]) * share;
                    }
                    words = simd.shr::<8>(words);
                    within += 1;
                }
                material += 4;
            }
            let [red, green, blue] =
                [simd.truncate_to_i32(red), simd.truncate_to_i32(green), simd.truncate_to_i32(blue)];
            simd.store_u32(red | simd.shl::<8>(green) | simd.shl::<16>(blue), &mut self.words[at..]);
            at += S::LANES;
        }
    }
}
