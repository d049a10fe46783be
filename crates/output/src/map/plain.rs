//! The map that a bake writes beside its other rasters: a pixel a vertex, in the style `plain`.
//!
//! It is drawn as all maps are, but of tiles: heights and materials are those of the vertices, and so is the water, as the
//! land has it. Roads and places are drawn over them.

use crate::area::Area;
use crate::grid::Grid;
use crate::land::WaterKind;
use crate::lines::{Bed, LineKind};
use crate::map::canvas::Canvas;
use crate::map::drawing::Drawing;
use crate::map::relief::{Lit, Relief, channels};
use crate::map::scale::Scale;
use crate::map::style::{Colour, Style};
use crate::map::symbols::draw_site;
use crate::tile::Tile;
use crate::world::World;

/// Pixels that a millimetre of the style is: its lines are seen at full size on a screen.
const PIXELS_PER_MM: f64 = 4.0;

/// Vertices a side of the squares that roads and places are drawn on, counted from the origin: the same squares whatever the tiles, or
/// the edges of lines would depend on the size of tiles.
const SQUARE: i64 = 128;

/// Metres that a shore rises within a pixel at least: where it is flatter, its edge is not as soft as it could be.
const LEAST_RISE_M: f32 = 0.02;

/// Roads of agents: trodden earth, in sRGB, and its opacity.
const TRODDEN: Colour = Colour([222, 203, 160]);
const TRODDEN_OPACITY: f32 = 0.85;

/// Paints tiles as a map. A pixel is a vertex, so two tiles agree on the pixels of the edge that they share.
pub struct MapPainter {
    style: Style,
    scale: Scale,
    relief: Relief,
}

impl MapPainter {
    /// The painter of a world, in the colours of its preset.
    ///
    /// # Panics
    /// When the built-in style `plain` is broken.
    pub fn new(world: &World) -> MapPainter {
        let style = Style::load("plain").expect("built-in styles are sound");
        let scale = Scale { metres_per_pixel: world.spacing_m(), pixels_per_mm: PIXELS_PER_MM };
        let relief = Relief::new(&style, world, scale);
        MapPainter { style, scale, relief }
    }

    /// The pixels of the vertices in the first `cols` columns and `rows` rows of a tile: RGB, row by row.
    ///
    /// # Panics
    /// When the tile has fewer.
    pub fn paint(&self, tile: &Tile, cols: usize, rows: usize) -> Vec<u8> {
        let area = tile.area();
        let wanted = Area { x1: area.x0 + cols as i64, y1: area.y0 + rows as i64, ..area };
        let mut words = self.ground(tile);
        paint_agents(tile, &mut words, self.style.water.line);
        let drawing = self.drawing(tile);
        if drawing.roads.is_empty() && drawing.tunnels.is_empty() && tile.sites().is_empty() {
            return bytes(&words, wanted);
        }
        let mut painted = vec![0; wanted.len() * 3];
        let all = wanted.on_grid(SQUARE);
        let corners = |from: i64, to: i64| (from..to).step_by(SQUARE as usize);
        for [x, y] in corners(all.y0, all.y1).flat_map(|y| corners(all.x0, all.x1).map(move |x| [x, y])) {
            let square = Area::new(x, y, SQUARE as usize, SQUARE as usize);
            let part = square.common(&wanted).expect("squares were chosen by what is wanted");
            let mut canvas = Canvas::at_vertices(square);
            canvas.put_words(part, &words);
            drawing.draw_roads(&self.style, self.scale, &mut canvas);
            for site in tile.sites() {
                draw_site(&mut canvas, site.at.map(|at| at as f64), site.class, self.scale, &self.style);
            }
            let pixels = canvas.pixels(part);
            for (y, row) in (part.y0..).zip(pixels.chunks_exact(part.width() * 3)) {
                let start = ((y - area.y0) as usize * cols + (part.x0 - area.x0) as usize) * 3;
                painted[start..start + row.len()].copy_from_slice(row);
            }
        }
        painted
    }

    /// The ground with its water.
    fn ground(&self, tile: &Tile) -> Grid<u32> {
        let area = tile.area();
        let covers = self.relief.covers_of(tile.blend().ground(), tile.blend().cover());
        let lit = Lit { heights: tile.heights(), smooth: tile.heights(), texture: None, open: None, covers: &covers };
        let mut pixels = self.relief.light(&lit, area);
        let Some(water) = tile.water() else { return pixels };
        for y in area.y0..area.y1 {
            let kinds = water.kind.row(y, area.x0, area.x1);
            // Most rows are dry.
            if kinds.iter().all(|kind| matches!(kind, WaterKind::Dry | WaterKind::Sea)) {
                continue;
            }
            let depths = water.depth_m.row(y, area.x0, area.x1);
            let [east, up, south] = tile.normals().row(y, area.x0, area.x1);
            let row = pixels.row_mut(y, area.x0, area.x1);
            for (index, (pixel, kind)) in row.iter_mut().zip(kinds).enumerate() {
                match kind {
                    WaterKind::River => *pixel = mixed(*pixel, channels(self.style.water.line), 1.0),
                    WaterKind::Lake => {
                        // Half of a pixel at the shore, by how steeply its floor falls.
                        let slope = (east[index] * east[index] + south[index] * south[index]).sqrt() / up[index];
                        let rise_m = (slope * self.scale.metres_per_pixel as f32).max(LEAST_RISE_M);
                        let share = (depths[index] / rise_m + 0.5).min(1.0);
                        *pixel = mixed(*pixel, self.relief.water(depths[index]), share);
                    }
                    WaterKind::Dry | WaterKind::Sea => {}
                }
            }
        }
        pixels
    }

    /// The roads between settlements, as all maps draw them: they are no wider than a tile knows of them around it.
    fn drawing(&self, tile: &Tile) -> Drawing {
        let mut drawing = Drawing::default();
        for road in tile.lines().iter().filter(|line| line.id.kind() == LineKind::Road) {
            if matches!(road.bed, Bed::Built { .. }) {
                drawing.add_road(&self.style, self.scale, road);
            }
        }
        drawing.roads.sort_by_key(|road| road.class);
        drawing
    }
}

/// What agents have left: trodden roads, and water in the rivers that they have dug.
fn paint_agents(tile: &Tile, pixels: &mut Grid<u32>, water: Colour) {
    let Some(imprint) = tile.imprint() else { return };
    let area = tile.area();
    let trodden = imprint.trodden().map(|trodden| (&trodden.dirt, TRODDEN, TRODDEN_OPACITY));
    let dug = imprint.dug().map(|dug| (&dug.water, water, 1.0));
    for (shares, colour, opacity) in trodden.into_iter().chain(dug) {
        for y in area.y0..area.y1 {
            let row = pixels.row_mut(y, area.x0, area.x1).iter_mut();
            for (pixel, share) in row.zip(shares.row(y, area.x0, area.x1)).filter(|(_, share)| **share > 0.0) {
                *pixel = mixed(*pixel, channels(colour), share * opacity);
            }
        }
    }
}

/// A pixel, red in the lowest byte, of which a colour covers a share.
fn mixed(pixel: u32, colour: [f32; 3], share: f32) -> u32 {
    let mut bytes = pixel.to_le_bytes();
    for (channel, over) in bytes.iter_mut().zip(colour) {
        let value = f32::from(*channel);
        *channel = (value + (over - value) * share + 0.5) as u8;
    }
    u32::from_le_bytes(bytes)
}

/// Pixels of an area, red in the lowest byte, as RGB, row by row.
fn bytes(words: &Grid<u32>, area: Area) -> Vec<u8> {
    let mut bytes = vec![0; area.len() * 3];
    for (y, row) in (area.y0..area.y1).zip(bytes.chunks_exact_mut(area.width() * 3)) {
        for (pixel, word) in row.as_chunks_mut::<3>().0.iter_mut().zip(words.row(y, area.x0, area.x1)) {
            let [red, green, blue, _] = word.to_le_bytes();
            *pixel = [red, green, blue];
        }
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Vertices by which a tile knows of roads beside it at least: one of its normals, and two by which a road
    /// [concerns](crate::lines::Line::concerns) what is beside its banks.
    const KNOWN: f64 = 3.0;

    #[test]
    fn no_road_is_drawn_wider_than_tiles_know_of_it() {
        let roads = Style::load("plain").unwrap().roads;
        // A bridge is the widest; half a pixel is smoothed, and as much is what a bend may be simplified by.
        let widest = roads.classes.map(|class| class.width_mm + 4.0 * class.casing_mm).into_iter().fold(0.0, f64::max);
        assert!(0.5 * widest * PIXELS_PER_MM + 1.0 <= KNOWN, "{widest} mm");
    }
}
