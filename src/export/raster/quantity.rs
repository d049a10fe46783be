//! What rasters can show of a tile, and the painter of their samples.

use crate::export::raster::writer::{Encoding, Sample};
use crate::land::{Water, WaterKind};
use crate::map::{self, MapPainter};
use crate::tile::{Material, Tile};
use crate::world::World;

/// What the pixels of a raster show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Quantity {
    /// The height, as 65,536 steps over the world's range.
    Height16,
    /// The height, as 65,536 steps over the range rounded out to whole metres, for dialogs that take no others.
    Height16Whole,
    /// The height in metres.
    HeightMetres,
    /// The weight of one material.
    Weight(Material),
    /// The two strongest materials and how they mix, as Terrain3D has it in the bits of a float.
    Control,
    /// Weights of grass, dirt, rock and sand.
    GroundWeights,
    /// Weights of snow, forest, scree and wetland.
    CoverWeights,
    /// The normal, OpenGL convention.
    Normal,
    /// The picture of the map.
    Map,
    /// The colour of the ground, without light.
    Colour,
    /// The kind of water, as a grey.
    Water,
    /// Metres from the bed to the water's surface.
    WaterDepth,
    /// Discharge of the channel in cubic metres a second.
    Flow,
}

impl Quantity {
    /// The sample that holds it.
    pub fn sample(self) -> Sample {
        match self {
            Quantity::Height16 | Quantity::Height16Whole => Sample::Grey16,
            Quantity::HeightMetres | Quantity::Control | Quantity::WaterDepth | Quantity::Flow => Sample::Float32,
            Quantity::GroundWeights | Quantity::CoverWeights => Sample::Rgba8,
            Quantity::Normal | Quantity::Map | Quantity::Colour => Sample::Rgb8,
            Quantity::Water | Quantity::Weight(_) => Sample::Grey8,
        }
    }

    /// Whether it is for the eye; all else is data.
    pub fn is_colour(self) -> bool {
        matches!(self, Quantity::Map | Quantity::Colour)
    }

    /// Whether only worlds have it whose relief knows of water.
    pub fn needs_water(self) -> bool {
        matches!(self, Quantity::Water | Quantity::WaterDepth | Quantity::Flow)
    }

    /// What each channel holds, for the manifest.
    pub fn channels(self) -> &'static [&'static str] {
        match self {
            Quantity::Height16 => &["height, 0 = min_m, 65535 = max_m"],
            Quantity::Height16Whole => &["height, 0 = min_m and 65535 = max_m, both rounded out as in IMPORT.md"],
            Quantity::HeightMetres => &["height in metres"],
            Quantity::Weight(Material::Grass) => &["grass"],
            Quantity::Weight(Material::Dirt) => &["dirt"],
            Quantity::Weight(Material::Rock) => &["rock"],
            Quantity::Weight(Material::Sand) => &["sand"],
            Quantity::Weight(Material::Snow) => &["snow"],
            Quantity::Weight(Material::Forest) => &["forest"],
            Quantity::Weight(Material::Scree) => &["scree"],
            Quantity::Weight(Material::Wetland) => &["wetland"],
            Quantity::Control => &["bits: base << 27 | overlay << 22 | blend << 14"],
            Quantity::GroundWeights => &["grass", "dirt", "rock", "sand"],
            Quantity::CoverWeights => &["snow", "forest", "scree", "wetland"],
            Quantity::Normal => &["east", "north", "up"],
            Quantity::Map | Quantity::Colour => &["red", "green", "blue"],
            Quantity::Water => &["water, 0 = none, 64 = river, 128 = lake, 255 = sea"],
            Quantity::WaterDepth => &["depth of the water in metres"],
            Quantity::Flow => &["discharge in cubic metres a second"],
        }
    }
}

/// Turns tiles into rows of samples.
pub(crate) struct Painter {
    quantity: Quantity,
    encoding: Encoding,
    range_m: (f32, f32),
    map: Option<MapPainter>,
}

impl Painter {
    /// Paints a quantity as an encoding has it.
    pub fn new(world: &World, quantity: Quantity, encoding: Encoding) -> Painter {
        Painter {
            quantity,
            encoding,
            range_m: match quantity {
                Quantity::Height16Whole => whole_range_m(world),
                _ => world.height_range_m(),
            },
            map: (quantity == Quantity::Map).then(|| MapPainter::new(world)),
        }
    }

    /// Bounds of the heights that 16 bits are steps of.
    pub fn range_m(&self) -> (f32, f32) {
        self.range_m
    }

    /// What the pixels show.
    pub fn quantity(&self) -> Quantity {
        self.quantity
    }

    /// The samples of the first `rows` rows and `cols` columns of a tile, without gaps.
    pub fn paint(&self, tile: &Tile, cols: usize, rows: usize) -> Vec<u8> {
        let area = tile.area();
        let row_bytes = cols * self.quantity.sample().bytes();
        if let Some(map) = &self.map {
            return map.paint(tile, cols, rows);
        }
        let mut samples = vec![0; rows * row_bytes];
        for (y, row) in (area.y0..).zip(samples.chunks_exact_mut(row_bytes)) {
            self.paint_row(tile, y, area.x0, row);
        }
        samples
    }

    fn paint_row(&self, tile: &Tile, y: i64, x0: i64, row: &mut [u8]) {
        let x1 = x0 + (row.len() / self.quantity.sample().bytes()) as i64;
        let heights = tile.heights().row(y, x0, x1);
        match self.quantity {
            Quantity::Height16 | Quantity::Height16Whole => {
                let is_png = self.encoding == Encoding::Png;
                for (pair, &height) in row.as_chunks_mut().0.iter_mut().zip(heights) {
                    let step = self.step(height);
                    // PNG has the upper byte first; bare files have the lower one first, as engines ask for.
                    *pair = if is_png { step.to_be_bytes() } else { step.to_le_bytes() };
                }
            }
            Quantity::Weight(material) => {
                for (x, grey) in (x0..).zip(row) {
                    *grey = tile.blend().weight(material, x, y);
                }
            }
            Quantity::Control => {
                for (x, bytes) in (x0..).zip(row.as_chunks_mut().0) {
                    *bytes = control(Material::ALL.map(|material| tile.blend().weight(material, x, y))).to_ne_bytes();
                }
            }
            // Floats go to the writer in the machine's own order, and OpenEXR's library puts them right.
            Quantity::HeightMetres => row.copy_from_slice(bytemuck::cast_slice(heights)),
            Quantity::GroundWeights => copy_words(tile.blend().ground().row(y, x0, x1), row),
            Quantity::CoverWeights => copy_words(tile.blend().cover().row(y, x0, x1), row),
            Quantity::Normal => {
                let [east, up, south] = tile.normals().row(y, x0, x1);
                let pixels = row.as_chunks_mut().0.iter_mut();
                for (((pixel, east), up), south) in pixels.zip(east).zip(up).zip(south) {
                    // -1..1 becomes 0..255 with 0 at 127.5; green is the image's up, which is north.
                    *pixel = [*east, -south, *up].map(|axis| (axis * 127.5 + 128.0) as u8);
                }
            }
            Quantity::Map => unreachable!("a map is painted tile by tile"),
            Quantity::Colour => map::colour::paint_row(tile, y, row),
            Quantity::Water => {
                for (grey, kind) in row.iter_mut().zip(water(tile).kind.row(y, x0, x1)) {
                    *grey = match kind {
                        WaterKind::Dry => 0,
                        WaterKind::River => 64,
                        WaterKind::Lake => 128,
                        WaterKind::Sea => 255,
                    };
                }
            }
            Quantity::WaterDepth => row.copy_from_slice(bytemuck::cast_slice(water(tile).depth_m.row(y, x0, x1))),
            Quantity::Flow => row.copy_from_slice(bytemuck::cast_slice(water(tile).flow_m3s.row(y, x0, x1))),
        }
    }

    /// `round((height - min) / (max - min) * 65535)`.
    fn step(&self, height_m: f32) -> u16 {
        let (min_m, max_m) = self.range_m;
        // The cast cuts off and saturates, so what rounding takes past the ends stays at them.
        ((height_m - min_m) / (max_m - min_m) * 65535.0 + 0.5) as u16
    }
}

/// The world's height range rounded out: HTerrain's dialog takes heights from -2000 to 2000 m, and each multiple of the
/// scale that brings a range into it is a whole number there.
pub(crate) fn whole_range_m(world: &World) -> (f32, f32) {
    let ((min_m, max_m), scale) = (world.height_range_m(), hterrain_scale(world));
    let (low, mut high) = ((min_m / scale).floor(), (max_m / scale).ceil());
    // A flat world's range would have no steps at all.
    if low == high {
        high += 1.0;
    }
    (low * scale, high * scale)
}

/// By how much HTerrain must stretch heights: 1, or as much more as brings them into its dialog.
pub(crate) fn hterrain_scale(world: &World) -> f32 {
    let (min_m, max_m) = world.height_range_m();
    (min_m.abs().max(max_m.abs()) / 2000.0).ceil().max(1.0)
}

fn water(tile: &Tile) -> &Water {
    tile.water().expect("the plan has checked that the world has water")
}

/// The bits that Terrain3D reads of a vertex: the texture that there is most of, the second, and its share of both. Based
/// on: Terrain3D's manual, "Control Map Encoding"; textures have the numbers of the materials.
fn control(weights: [u8; Material::ALL.len()]) -> u32 {
    let mut order: [usize; Material::ALL.len()] = std::array::from_fn(|material| material);
    // Stable: of equal weights the first material is the stronger one.
    order.sort_by_key(|&material| std::cmp::Reverse(weights[material]));
    let [most, second] = [order[0], order[1]].map(|material| u32::from(weights[material]));
    // Never zero: the weights of a vertex sum to 255.
    let both = most + second;
    let blend = (second * 255 + both / 2) / both;
    (order[0] as u32) << 27 | (order[1] as u32) << 22 | blend << 14
}

fn copy_words(words: &[u32], row: &mut [u8]) {
    for (word, bytes) in words.iter().zip(row.as_chunks_mut().0) {
        *bytes = word.to_le_bytes();
    }
}
