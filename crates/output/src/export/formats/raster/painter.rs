//! Painters: they turn a tile and a quantity into the samples of a raster.

use crate::area::Area;
use crate::export::formats::raster::quantity::{Paint, Quantity, put_greys};
use crate::export::formats::raster::writer::{Encoding, Sample};
use crate::map::MapPainter;
use crate::tile::{Grows, Tile, TileView};
use crate::world::World;

/// Turns tiles of a world into rows of samples.
pub(crate) struct Painter<'a> {
    world: &'a World,
    quantity: &'static Quantity,
    encoding: Encoding,
    range_m: (f32, f32),
    /// The painter of maps, if the quantity is a map.
    map: Option<MapPainter>,
    /// The rule by which plants and rocks are distributed, if the quantity is a density.
    grows: Option<Grows<'a>>,
}

impl<'a> Painter<'a> {
    /// Creates the painter of a quantity for an encoding. 16-bit heights become steps over the range `range_m`.
    pub fn new(world: &'a World, quantity: &'static Quantity, encoding: Encoding, range_m: (f32, f32)) -> Painter<'a> {
        Painter {
            world,
            quantity,
            encoding,
            range_m: match quantity.paint {
                Paint::WholeSteps => whole_range_m(range_m),
                _ => range_m,
            },
            map: matches!(quantity.paint, Paint::Map).then(|| MapPainter::new(world)),
            grows: matches!(quantity.paint, Paint::Density(_)).then(|| Grows::new(world)),
        }
    }

    /// Returns the range of heights in metres that the 16-bit steps divide.
    pub fn range_m(&self) -> (f32, f32) {
        self.range_m
    }

    /// Returns the quantity that is painted.
    pub fn quantity(&self) -> &'static Quantity {
        self.quantity
    }

    /// Returns the samples of the first `rows` rows and `cols` columns of a tile, without padding between rows.
    pub fn paint(&self, tile: &Tile, cols: usize, rows: usize) -> Vec<u8> {
        if let Some(map) = &self.map {
            let pixels = map.paint(tile, cols, rows);
            return if self.quantity.sample == Sample::Rgba8 { opaque(&pixels) } else { pixels };
        }
        let Area { x0, y0, .. } = tile.area();
        let row_bytes = cols * self.quantity.sample.bytes();
        let mut samples = vec![0; rows * row_bytes];
        for (y, row) in (y0..).zip(samples.chunks_exact_mut(row_bytes)) {
            self.paint_row(tile, Area::new(x0, y, cols, 1), row);
        }
        samples
    }

    fn paint_row(&self, tile: &Tile, row: Area, samples: &mut [u8]) {
        match self.quantity.paint {
            Paint::Row(paint) => paint(TileView::new(tile, self.world), row, samples),
            Paint::Steps | Paint::WholeSteps => {
                let heights = tile.heights().row(row.y0, row.x0, row.x1);
                let is_png = self.encoding == Encoding::Png;
                for (pair, &height) in samples.as_chunks_mut().0.iter_mut().zip(heights) {
                    let step = self.step(height);
                    // PNG is big-endian. Bare files are little-endian, as engines demand.
                    *pair = if is_png { step.to_be_bytes() } else { step.to_le_bytes() };
                }
            }
            Paint::Weight(material) => {
                for ((x, y), grey) in row.vertices().zip(samples) {
                    *grey = tile.blend().weight(material, x, y);
                }
            }
            Paint::Density(growth) => {
                let grows = self.grows.as_ref().expect("a painter of densities has their rule");
                let densities = grows.densities(tile).row(row.y0, row.x0, row.x1);
                put_greys(samples, densities.iter().map(|all| all[growth as usize] * 255.0));
            }
            Paint::Map => unreachable!("a map is painted tile by tile"),
        }
    }

    /// Returns the 16-bit step of a height: `round((height - min) / (max - min) * 65535)`.
    fn step(&self, height_m: f32) -> u16 {
        let (min_m, max_m) = self.range_m;
        // The cast truncates and saturates, so a height that rounding moves out of the range gets its nearest end.
        ((height_m - min_m) / (max_m - min_m) * 65535.0 + 0.5) as u16
    }
}

/// Adds a fourth channel, full opacity, to RGB pixels.
fn opaque(pixels: &[u8]) -> Vec<u8> {
    pixels.as_chunks::<3>().0.iter().flat_map(|[red, green, blue]| [*red, *green, *blue, 255]).collect()
}

/// Widens a height range outwards to multiples of HTerrain's scale, in metres. HTerrain's dialog takes only whole
/// numbers from -2000 to 2000 m, and a multiple of the scale divided by the scale is a whole number.
pub(crate) fn whole_range_m((min_m, max_m): (f32, f32)) -> (f32, f32) {
    let scale = hterrain_scale((min_m, max_m));
    let (low, mut high) = ((min_m / scale).floor(), (max_m / scale).ceil());
    // The range of a flat world would be empty, and have no steps.
    if low == high {
        high += 1.0;
    }
    (low * scale, high * scale)
}

/// Returns the factor by which HTerrain must stretch heights: the least whole number that brings the range into the
/// dialog's limits.
pub(crate) fn hterrain_scale((min_m, max_m): (f32, f32)) -> f32 {
    (min_m.abs().max(max_m.abs()) / 2000.0).ceil().max(1.0)
}
