//! The colour of the ground by itself, without light: what a mesh is painted with.

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

/// Writes row `y` of a tile as RGB, as many pixels from its western edge as `row` holds: the materials' colours by weight.
pub(crate) fn paint_row(tile: &Tile, y: i64, row: &mut [u8]) {
    let x0 = tile.area().x0;
    let pixels = row.as_chunks_mut::<3>().0;
    let x1 = x0 + pixels.len() as i64;
    let words = tile.blend().ground().row(y, x0, x1).iter().zip(tile.blend().cover().row(y, x0, x1));
    for (pixel, (ground, cover)) in pixels.iter_mut().zip(words) {
        let weights = ground.to_le_bytes().into_iter().chain(cover.to_le_bytes());
        // A half, for the cast cuts off.
        let mut sum = [0.5; 3];
        for (weight, colour) in weights.zip(COLOURS) {
            let share = f32::from(weight) / 255.0;
            sum = [0, 1, 2].map(|channel| sum[channel] + colour[channel] * share);
        }
        *pixel = sum.map(|channel| channel as u8);
    }
}
