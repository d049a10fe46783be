//! A picture of the walk from above: tiles by order of making, the rivers and roads on them, and the camera's track.

use crate::export::{Sample, png_bytes};
use crate::tile::Tile;

/// The longer side of the picture in pixels.
const LONGER_SIDE: f64 = 1600.0;
/// Pixels around the tiles.
const MARGIN: f64 = 8.0;
/// Order of a pixel that no tile covers.
const NOTHING: u32 = u32::MAX;

/// The kind of ground at a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
enum PixelGround {
    Land,
    River,
    Road,
}

#[derive(Clone, Copy, Debug)]
struct Pixel {
    /// The number of the expansion that has made this ground.
    order: u32,
    /// Brightness in light from the north-west, 0 to 1.
    light: f32,
    cover: PixelGround,
}

/// The picture while the walk goes on.
#[derive(Debug)]
pub(super) struct WalkPicture {
    width: usize,
    height: usize,
    /// Place of the north-western corner, in metres east and south.
    corner_m: [f64; 2],
    metres_a_pixel: f64,
    pixels: Vec<Pixel>,
    track: Vec<[f64; 2]>,
    last: usize,
}

impl WalkPicture {
    /// Makes a picture with room for `layers` layers of tiles of `side_m` metres around all places of the camera.
    pub fn new(places: impl Iterator<Item = [f64; 2]>, side_m: f64, layers: u32) -> WalkPicture {
        let layers = f64::from(layers);
        let track: Vec<[f64; 2]> = places.collect();
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for place in &track {
            for axis in 0..2 {
                low[axis] = low[axis].min(((place[axis] / side_m).floor() - layers) * side_m);
                high[axis] = high[axis].max(((place[axis] / side_m).floor() + layers + 1.0) * side_m);
            }
        }
        let extent_m = [high[0] - low[0], high[1] - low[1]];
        let metres_a_pixel = extent_m[0].max(extent_m[1]) / (LONGER_SIDE - 2.0 * MARGIN);
        let [width, height] = extent_m.map(|metres| (metres / metres_a_pixel + 2.0 * MARGIN).ceil() as usize);
        let corner_m = low.map(|metres| metres - MARGIN * metres_a_pixel);
        let nothing = Pixel { order: NOTHING, light: 1.0, cover: PixelGround::Land };
        WalkPicture { width, height, corner_m, metres_a_pixel, pixels: vec![nothing; width * height], track, last: 0 }
    }

    /// Adds the tiles of an expansion. Pixels of tiles that were made before stay as they are.
    pub fn add<'a>(&mut self, order: usize, tiles: impl IntoIterator<Item = &'a Tile>, spacing_m: f64) {
        for tile in tiles {
            let area = tile.area();
            let from_metres = |metres: f64, axis: usize, limit: usize| {
                // Take the pixels whose middle is inside.
                let place = (metres - self.corner_m[axis]) / self.metres_a_pixel - 0.5;
                place.ceil().clamp(0.0, limit as f64) as usize
            };
            let cols = from_metres(area.x0 as f64 * spacing_m, 0, self.width)
                ..from_metres((area.x1 - 1) as f64 * spacing_m, 0, self.width);
            let rows = from_metres(area.y0 as f64 * spacing_m, 1, self.height)
                ..from_metres((area.y1 - 1) as f64 * spacing_m, 1, self.height);
            // The number of vertices along a pixel. The first vertex gives the light, all of them the rivers and roads.
            let vertices = self.metres_a_pixel / spacing_m;
            for row in rows {
                let y0 = ((self.corner_m[1] / spacing_m + row as f64 * vertices) as i64).clamp(area.y0, area.y1 - 1);
                let y1 = (y0 + vertices.ceil() as i64).clamp(y0 + 1, area.y1);
                for col in cols.clone() {
                    let x0 =
                        ((self.corner_m[0] / spacing_m + col as f64 * vertices) as i64).clamp(area.x0, area.x1 - 1);
                    let x1 = (x0 + vertices.ceil() as i64).clamp(x0 + 1, area.x1);
                    let pixel = &mut self.pixels[row * self.width + col];
                    if pixel.order == NOTHING {
                        self.last = self.last.max(order);
                        let [east, up, south] = tile.normals().at(x0, y0);
                        // Light from the north-west: brighter where the normal leans there. The divisor 1.31 = sqrt(1 +
                        // 2 0.6^2) is the largest value.
                        let light = ((up - 0.6 * (east + south)) / 1.31).clamp(0.0, 1.0);
                        *pixel = Pixel { order: order as u32, light, cover: cover(tile, [x0, y0, x1, y1]) };
                    }
                }
            }
        }
    }

    /// Returns the finished picture as PNG.
    pub fn to_png(&self) -> Vec<u8> {
        let scale = 1.0 / self.last.max(1) as f32;
        let colour = |pixel: &Pixel| match (pixel.order, pixel.cover) {
            (NOTHING, _) => [245.0, 245.0, 243.0],
            (_, PixelGround::River) => [10.0, 30.0, 190.0],
            (_, PixelGround::Road) => [120.0, 25.0, 5.0],
            (order, PixelGround::Land) => {
                order_colour(order as f32 * scale).map(|channel| channel * (0.35 + 0.85 * pixel.light).min(1.0))
            }
        };
        let mut bytes: Vec<u8> =
            self.pixels.iter().flat_map(|pixel| colour(pixel).map(|channel| channel as u8)).collect();
        // Draw the track black with a white core, so that it shows on every colour, and a ring where it begins.
        for (radius, ink) in [(3.0, [0; 3]), (1.3, [255; 3])] {
            for pair in self.track.windows(2) {
                self.draw_line(&mut bytes, pair[0], pair[1], radius, ink);
            }
        }
        for (radius, ink) in [(10.0, [0; 3]), (8.0, [255; 3]), (4.0, [0; 3])] {
            let start = self.track.first().copied().unwrap_or(self.corner_m);
            self.draw_line(&mut bytes, start, start, radius, ink);
        }
        png_bytes(Sample::Rgb8, (self.width as u32, self.height as u32), true, &bytes)
    }

    /// Draws a line between two places with round ends, `radius` pixels to each side.
    fn draw_line(&self, bytes: &mut [u8], from: [f64; 2], to: [f64; 2], radius: f64, ink: [u8; 3]) {
        let pixel = |place: [f64; 2]| [0, 1].map(|axis| (place[axis] - self.corner_m[axis]) / self.metres_a_pixel);
        let ([x0, y0], [x1, y1]) = (pixel(from), pixel(to));
        let length = (x1 - x0).hypot(y1 - y0);
        // Draw dots half a pixel apart, which look like a line.
        let dots = (length * 2.0).ceil().max(1.0) as usize;
        for dot in 0..=dots {
            let share = dot as f64 / dots as f64;
            let (x, y) = (x0 + (x1 - x0) * share, y0 + (y1 - y0) * share);
            let span = |middle: f64, limit: usize| {
                let side = |value: f64| value.clamp(0.0, limit as f64) as usize;
                side(middle - radius)..side(middle + radius + 1.0)
            };
            for row in span(y, self.height) {
                for col in span(x, self.width) {
                    if (col as f64 + 0.5 - x).hypot(row as f64 + 0.5 - y) <= radius {
                        let at = (row * self.width + col) * 3;
                        bytes[at..at + 3].copy_from_slice(&ink);
                    }
                }
            }
        }
    }
}

/// Returns the kind of ground in a rectangle of vertices, widened by its own size on each side. One vertex of a river
/// or a road is enough, so that thin ones show.
fn cover(tile: &Tile, [x0, y0, x1, y1]: [i64; 4]) -> PixelGround {
    let Some(imprint) = tile.imprint() else { return PixelGround::Land };
    let area = tile.area();
    let (wide, high) = (x1 - x0, y1 - y0);
    let (x0, x1) = ((x0 - wide).max(area.x0), (x1 + wide).min(area.x1));
    let (y0, y1) = ((y0 - high).max(area.y0), (y1 + high).min(area.y1));
    // The share is a half in the middle of a shoulder or bank.
    let holds =
        |share: &crate::grid::Grid<f32>| (y0..y1).any(|y| share.row(y, x0, x1).iter().any(|&share| share > 0.5));
    match (imprint.sand().is_some_and(holds), imprint.dirt().any(holds)) {
        (true, _) => PixelGround::River,
        (_, true) => PixelGround::Road,
        _ => PixelGround::Land,
    }
}

/// Returns the colour of a share of the walk: from violet over green to yellow, pale enough for rivers and roads to
/// show.
fn order_colour(share: f32) -> [f32; 3] {
    const STOPS: [[f32; 3]; 5] =
        [[94.0, 60.0, 153.0], [66.0, 113.0, 178.0], [52.0, 160.0, 145.0], [130.0, 205.0, 100.0], [250.0, 228.0, 60.0]];
    let place = share.clamp(0.0, 1.0) * (STOPS.len() - 1) as f32;
    let below = (place as usize).min(STOPS.len() - 2);
    let along = place - below as f32;
    std::array::from_fn(|channel| {
        let colour = STOPS[below][channel] + (STOPS[below + 1][channel] - STOPS[below][channel]) * along;
        f32::midpoint(colour, 255.0)
    })
}
