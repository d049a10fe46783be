//! The map that a bake writes beside its other rasters: one pixel per vertex, in the style `plain`.
//!
//! It is drawn like every map, but from tiles: heights, materials and water are those of the tile's vertices. Roads and
//! places are drawn over them.

use crate::area::Area;
use crate::grain_point::Point;
use crate::grid::Grid;
use crate::land::WaterKind;
use crate::lines::{Bed, LineKind};
use crate::map::canvas::Canvas;
use crate::map::drawing::Drawing;
use crate::map::light::LEAST_RISE_M;
use crate::map::relief::{Lit, ShadedRelief, channels};
use crate::map::scale::Scale;
use crate::map::style::{Colour, Style};
use crate::map::symbols::draw_site;
use crate::tile::Tile;
use crate::world::World;

/// Pixels per millimetre of the style, so that lines are seen at full size on a screen.
const PIXELS_PER_MM: f64 = 4.0;

/// Side, in vertices, of the squares on which roads and places are drawn, counted from the origin. The squares do not
/// depend on the tiles; otherwise the edges of lines would depend on the size of tiles.
const SQUARE: i64 = 128;

/// Colour in sRGB and opacity of the earth of roads that agents have trodden.
const TRODDEN: Colour = Colour([222, 203, 160]);
const TRODDEN_OPACITY: f32 = 0.85;

/// Paints tiles as a map. A pixel is a vertex, so two tiles agree on the pixels of the edge that they share.
pub struct MapPainter {
    style: Style,
    scale: Scale,
    relief: ShadedRelief,
    /// Vertices from a node to the next.
    vertices: i64,
}

impl MapPainter {
    /// Creates the painter of a world, in the colours of its preset.
    ///
    /// # Panics
    /// If the built-in style `plain` is broken.
    pub fn new(world: &World) -> MapPainter {
        let style = Style::load("plain").expect("built-in styles are sound");
        let scale = Scale { metres_per_pixel: world.spacing_m(), pixels_per_mm: PIXELS_PER_MM };
        let relief = ShadedRelief::new(&style, world, scale);
        MapPainter { style, scale, relief, vertices: world.stride().vertices() }
    }

    /// Returns the pixels of the vertices in the first `cols` columns and `rows` rows of a tile: RGB, row by row.
    ///
    /// # Panics
    /// If the tile has fewer columns or rows.
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
        for part in wanted.squares(SQUARE as usize) {
            let mut canvas = Canvas::at_vertices(part.on_grid(SQUARE));
            canvas.put_words(part, &words);
            drawing.draw_roads(&self.style, self.scale, &mut canvas);
            for site in tile.sites() {
                draw_site(&mut canvas, site.at.map(|at| at as f64).into(), site.class, self.scale, &self.style);
            }
            let pixels = canvas.pixels(part);
            for (y, row) in (part.y0..).zip(pixels.chunks_exact(part.width() * 3)) {
                let start = ((y - area.y0) as usize * cols + (part.x0 - area.x0) as usize) * 3;
                painted[start..start + row.len()].copy_from_slice(row);
            }
        }
        painted
    }

    /// Paints the ground and its water.
    fn ground(&self, tile: &Tile) -> Grid<u32> {
        let area = tile.area();
        let covers = self.relief.covers_of(tile.blend().ground(), tile.blend().cover());
        let row_of = |y| (area.x0..area.x1).map(|x| Point::at_vertex(x * self.vertices, y * self.vertices)).collect();
        let land = self.relief.tints_by_dryness(tile.heights(), area, row_of);
        let lit = Lit {
            heights: tile.heights(),
            smooth: tile.heights(),
            texture: None,
            open: None,
            land: land.as_ref(),
            covers: &covers,
        };
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
                        // The lake covers half of a pixel at the shore, and more by its depth relative to the fall of
                        // its floor.
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

    /// Collects the roads between settlements, drawn as on all maps. No road is drawn wider than a tile knows the roads
    /// around it.
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

/// Paints the imprint of agents: trodden roads, and water in the rivers that they have dug.
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

/// Returns a pixel, red in the lowest byte, with a colour over a share of it.
fn mixed(pixel: u32, colour: [f32; 3], share: f32) -> u32 {
    let mut bytes = pixel.to_le_bytes();
    for (channel, over) in bytes.iter_mut().zip(colour) {
        let value = f32::from(*channel);
        *channel = (value + (over - value) * share + 0.5) as u8;
    }
    u32::from_le_bytes(bytes)
}

/// Converts the pixels of an area, red in the lowest byte, to RGB, row by row.
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

    /// Least distance in vertices at which a tile knows the roads beside it: one for its normals, and two at which a
    /// road [concerns](crate::lines::Line::concerns) the ground beside its banks.
    const KNOWN: f64 = 3.0;

    #[test]
    fn no_road_is_drawn_wider_than_tiles_know_of_it() {
        let roads = Style::load("plain").unwrap().roads;
        // Bridges are the widest. Antialiasing adds half a pixel, and simplified bends may be off by another half.
        let widest = roads.classes.map(|class| class.width_mm + 4.0 * class.casing_mm).into_iter().fold(0.0, f64::max);
        assert!(0.5 * widest * PIXELS_PER_MM + 1.0 <= KNOWN, "{widest} mm");
    }
}
