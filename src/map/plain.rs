//! The plain picture of tiles, a pixel a vertex: what a bake writes beside its other rasters.

use crate::land::WaterKind;
use crate::map::mark;
use crate::map::shade::{CHUNK, Shade, fill};
use crate::map::tint::Tints;
use crate::simd::dispatch;
use crate::tile::Tile;
use crate::world::World;

/// Rivers as the sea's shallows, in sRGB, and their opacity. Chosen by eye, as all colours below are.
const RIVER: [f32; 3] = [96.0, 150.0, 186.0];
const RIVER_OPACITY: f32 = 0.85;
const LAKE_OPACITY: f32 = 0.95;

/// Roads of agents: trodden earth.
const TRODDEN: [f32; 3] = [222.0, 203.0, 160.0];
const TRODDEN_OPACITY: f32 = 0.85;

/// Roads between settlements: a dark line on land of any colour.
const BUILT: [f32; 3] = [104.0, 58.0, 40.0];
const BUILT_OPACITY: f32 = 0.9;

/// Paints tiles as a map: hypsometric tint, touched by what the ground is made of, times a relief shading; the sea in blues.
///
/// A pixel is a vertex, so two tiles agree on the pixels of the edge that they share.
pub struct MapPainter {
    tint: Tints,
    sea_level_m: f32,
    exaggeration: f32,
}

impl MapPainter {
    /// The painter of a world, in the colours of its preset.
    pub fn new(world: &World) -> MapPainter {
        let preset = world.preset();
        MapPainter {
            tint: Tints::plain(world),
            sea_level_m: preset.sea_level_m.map_or(f32::NEG_INFINITY, |level| level as f32),
            exaggeration: preset.map.exaggeration.unwrap_or(1.0) as f32,
        }
    }

    /// Writes row `y` of a tile as RGB, as many pixels from its western edge as `row` holds.
    ///
    /// # Panics
    /// When the tile has no such row, or `row` holds more pixels than the tile is wide.
    pub fn paint_row(&self, tile: &Tile, y: i64, row: &mut [u8]) {
        let (pixels, _) = row.as_chunks_mut::<3>();
        for (chunk, pixels) in (0..).zip(pixels.chunks_mut(CHUNK)) {
            let x0 = tile.area().x0 + chunk * CHUNK as i64;
            self.paint_ground(tile, y, x0, pixels);
            // From here on few pixels are touched, one by one: water, then roads over it, then marks over all.
            self.paint_water(tile, y, x0, pixels);
            paint_lines(tile, y, x0, pixels);
            for site in tile.sites() {
                mark::paint_row(site, x0, y, pixels);
            }
        }
    }

    /// The tints of up to [`CHUNK`] vertices from `x0` on, touched by what the ground is made of, shaded.
    fn paint_ground(&self, tile: &Tile, y: i64, x0: i64, pixels: &mut [[u8; 3]]) {
        let x1 = x0 + pixels.len() as i64;
        // Looked up one by one: lanes cannot read from a table of this size.
        let mut tints = [[0.0; CHUNK]; 3];
        let mut sea = [0.0; CHUNK];
        for (index, &height_m) in tile.heights().row(y, x0, x1).iter().enumerate() {
            let under_water = height_m < self.sea_level_m;
            sea[index] = if under_water { 1.0 } else { 0.0 };
            let colour =
                if under_water { self.tint.sea(self.sea_level_m - height_m) } else { self.tint.land(height_m) };
            [tints[0][index], tints[1][index], tints[2][index]] = colour;
        }
        let mut words = [0; CHUNK];
        let [east, up, south] = tile.normals().row(y, x0, x1);
        // Pixels past the row's end are computed from zeros and not used, so that all lanes are full.
        dispatch(Shade {
            exaggeration: self.exaggeration,
            tints: &tints,
            sea: &sea,
            east: &fill(east),
            up: &fill(up),
            south: &fill(south),
            ground: &fill(tile.blend().ground().row(y, x0, x1)),
            cover: &fill(tile.blend().cover().row(y, x0, x1)),
            words: &mut words,
        });
        for (pixel, word) in pixels.iter_mut().zip(words) {
            // Lanes make a word a pixel; three bytes of it are the pixel.
            let [red, green, blue, _] = word.to_le_bytes();
            *pixel = [red, green, blue];
        }
    }

    /// Rivers and lakes over the ground. The sea is ground already: its floor is tinted by depth.
    fn paint_water(&self, tile: &Tile, y: i64, x0: i64, pixels: &mut [[u8; 3]]) {
        let Some(water) = tile.water() else { return };
        let x1 = x0 + pixels.len() as i64;
        let kinds = water.kind.row(y, x0, x1);
        // Most chunks are dry.
        if kinds.iter().all(|kind| *kind == WaterKind::Dry) {
            return;
        }
        let waters = kinds.iter().zip(water.depth_m.row(y, x0, x1));
        for (pixel, (kind, depth_m)) in pixels.iter_mut().zip(waters) {
            match kind {
                WaterKind::River => composite(pixel, (RIVER_OPACITY, RIVER)),
                WaterKind::Lake => composite(pixel, (LAKE_OPACITY, self.tint.sea(*depth_m))),
                WaterKind::Dry | WaterKind::Sea => {}
            }
        }
    }
}

/// Roads, and rivers of agents, over the ground.
fn paint_lines(tile: &Tile, y: i64, x0: i64, pixels: &mut [[u8; 3]]) {
    let Some(imprint) = tile.imprint() else { return };
    let x1 = x0 + pixels.len() as i64;
    if let Some(trodden) = imprint.trodden() {
        lay(pixels, trodden.dirt.row(y, x0, x1), (TRODDEN_OPACITY, TRODDEN));
    }
    if let Some(dug) = imprint.dug() {
        lay(pixels, dug.water.row(y, x0, x1), (1.0, RIVER));
    }
    if let Some(built) = imprint.built() {
        lay(pixels, built.decks.row(y, x0, x1), (BUILT_OPACITY, BUILT));
    }
}

/// Lets a colour cover a share of each pixel.
fn lay(pixels: &mut [[u8; 3]], shares: &[f32], (opacity, colour): (f32, [f32; 3])) {
    // Nearly all pixels are bare, and so are most chunks.
    if shares.iter().fold(0, |bits, share| bits | share.to_bits()) == 0 {
        return;
    }
    for (pixel, share) in pixels.iter_mut().zip(shares).filter(|(_, share)| **share != 0.0) {
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
