//! What rasters can show of a tile, and the painter of their samples.

use crate::export::format::Lack;
use crate::export::raster::writer::{Encoding, Sample};
use crate::land::WaterKind;
use crate::map::{self, MapPainter};
use crate::tile::{Grows, Growth, Material, Tile, WETTEST, has_rivers, has_water};
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
    /// The same of a walk, transparent where no tile is.
    MapOfWalk,
    /// The colour of the ground, without light.
    Colour,
    /// The kind of water, as a grey.
    Water,
    /// Metres from the bed to the water's surface.
    WaterDepth,
    /// Discharge of the channel in cubic metres a second.
    Flow,
    /// How steep the ground is, as 256 steps to a right angle.
    Slope8,
    /// The thesis' blend factor, as 256 steps to 1.
    Steepness8,
    /// The factor itself.
    Steepness,
    /// The same in degrees.
    SlopeDegrees,
    /// How the ground is bent, as a grey.
    Curvature8,
    /// The same, a metre.
    Curvature,
    /// How much land drains through a vertex, as steps of its logarithm.
    Accumulation8,
    /// The same in square metres.
    AccumulationM2,
    /// The topographic wetness index, as steps.
    Wetness8,
    /// The index itself.
    Wetness,
    /// How densely something stands.
    Density(Growth),
}

/// Grey of flat ground in pictures of curvature, and greys to one side of it.
const FLAT: f32 = 128.0;
const BENDS: f32 = 127.0;

/// Curvature times the spacing that is as bright as can be.
const MOST_BENT: f32 = 0.25;

/// Powers of ten, of vertices' squares, that pictures of accumulation show.
const MOST_DRAINED: f32 = 7.0;

impl Quantity {
    /// The sample that holds it.
    pub fn sample(self) -> Sample {
        match self {
            Quantity::Height16 | Quantity::Height16Whole => Sample::Grey16,
            Quantity::HeightMetres
            | Quantity::Control
            | Quantity::WaterDepth
            | Quantity::Flow
            | Quantity::SlopeDegrees
            | Quantity::Steepness
            | Quantity::Curvature
            | Quantity::AccumulationM2
            | Quantity::Wetness => Sample::Float32,
            Quantity::GroundWeights | Quantity::CoverWeights | Quantity::MapOfWalk => Sample::Rgba8,
            Quantity::Normal | Quantity::Map | Quantity::Colour => Sample::Rgb8,
            Quantity::Water
            | Quantity::Weight(_)
            | Quantity::Slope8
            | Quantity::Steepness8
            | Quantity::Curvature8
            | Quantity::Accumulation8
            | Quantity::Wetness8
            | Quantity::Density(_) => Sample::Grey8,
        }
    }

    /// What it is called.
    pub fn name(self) -> &'static str {
        match self {
            Quantity::Height16 | Quantity::Height16Whole | Quantity::HeightMetres => "height",
            Quantity::Weight(material) => material.name(),
            Quantity::Control => "control map",
            Quantity::GroundWeights => "weights of the ground",
            Quantity::CoverWeights => "weights of the cover",
            Quantity::Normal => "normals",
            Quantity::Map | Quantity::MapOfWalk => "map",
            Quantity::Colour => "colour of the ground",
            Quantity::Water => "kind of water",
            Quantity::WaterDepth => "depth of the water",
            Quantity::Flow => "discharge",
            Quantity::Slope8 | Quantity::SlopeDegrees => "slope",
            Quantity::Steepness8 | Quantity::Steepness => "steepness",
            Quantity::Curvature8 | Quantity::Curvature => "mean curvature",
            Quantity::Accumulation8 | Quantity::AccumulationM2 => "flow accumulation",
            Quantity::Wetness8 | Quantity::Wetness => "topographic wetness index",
            Quantity::Density(growth) => growth.about(),
        }
    }

    /// Whether its samples are steps over a range of heights.
    pub fn is_steps(self) -> bool {
        matches!(self, Quantity::Height16 | Quantity::Height16Whole)
    }

    /// The unit of what it shows, as GIS writes it.
    pub fn unit(self) -> Option<&'static str> {
        match self {
            Quantity::Height16 | Quantity::Height16Whole | Quantity::HeightMetres | Quantity::WaterDepth => Some("m"),
            Quantity::Flow => Some("m3/s"),
            Quantity::SlopeDegrees => Some("degree"),
            Quantity::Curvature => Some("1/m"),
            Quantity::AccumulationM2 => Some("m2"),
            _ => None,
        }
    }

    /// How a smaller copy of a raster of it comes about.
    pub fn reduction(self) -> Reduction {
        match self {
            Quantity::Water => Reduction::Commonest,
            // A mean would have rivers fade away, which are a pixel wide.
            Quantity::WaterDepth | Quantity::Flow | Quantity::Accumulation8 | Quantity::AccumulationM2 => {
                Reduction::Greatest
            }
            _ => Reduction::Mean,
        }
    }

    /// The value of pixels that have nothing of it.
    pub fn no_data(self) -> Option<f32> {
        match self {
            // No vertex is without a height, but what cuts or turns such a raster wants a value for what is not in it.
            Quantity::HeightMetres => Some(f32::NAN),
            Quantity::WaterDepth | Quantity::Flow => Some(0.0),
            _ => None,
        }
    }

    /// The same of a walk, of which a raster may have to leave out what no tile shows.
    pub fn of_walk(self) -> Quantity {
        if self == Quantity::Map { Quantity::MapOfWalk } else { self }
    }

    /// The bytes of a pixel where no tile is, if it can say that.
    pub fn gap(self) -> Option<[u8; 4]> {
        match self {
            Quantity::MapOfWalk => Some([0; 4]),
            _ => self.no_data().map(f32::to_le_bytes),
        }
    }

    /// Whether it is for the eye; all else is data.
    pub fn is_colour(self) -> bool {
        matches!(self, Quantity::Map | Quantity::MapOfWalk | Quantity::Colour)
    }

    /// What of it a world has not.
    pub fn lacks(self, world: &World) -> Option<Lack> {
        let (shows, has, is_there, preset) = match self {
            Quantity::Flow => {
                ("the discharge of rivers", "none", has_rivers(world), "a preset with [fluvial] or [rivers]")
            }
            Quantity::Water | Quantity::WaterDepth => (
                "water",
                "neither rivers nor a sea",
                has_water(world),
                "a preset with [fluvial], [rivers] or sea_level_m",
            ),
            _ => return None,
        };
        (!is_there).then_some(Lack { shows, has, preset })
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
            Quantity::MapOfWalk => &["red", "green", "blue", "opacity, 0 where no tile is"],
            Quantity::Water => &["water, 0 = none, 64 = river, 128 = lake, 255 = sea"],
            Quantity::WaterDepth => &["depth of the water in metres"],
            Quantity::Flow => &["discharge in cubic metres a second"],
            Quantity::Slope8 => &["slope, 0 = 0 degrees, 255 = 90 degrees"],
            Quantity::SlopeDegrees => &["slope in degrees"],
            Quantity::Steepness8 => &["steepness min(slope_scale * (1 - normal.up), 1), 0 = 0, 255 = 1"],
            Quantity::Steepness => &["steepness min(slope_scale * (1 - normal.up), 1)"],
            Quantity::Curvature8 => &[
                "mean curvature, 128 = flat, 1 = hollow of -0.25 / spacing_m and more, 255 = ridge of 0.25 / spacing_m",
            ],
            Quantity::Curvature => &["mean curvature a metre, above 0 on ridges, below 0 in hollows"],
            Quantity::Accumulation8 => {
                &["flow accumulation, 255 / 7 * log10(m2 / spacing_m^2), from within 64 vertices and of rivers whole"]
            }
            Quantity::AccumulationM2 => &["flow accumulation in m2, from within 64 vertices and of rivers whole"],
            Quantity::Wetness8 => &["wetness index ln(a / tan b), 0 = 0 and less, 255 = 20 and open water"],
            Quantity::Wetness => &["wetness index ln(a / tan b), a in m2 / m; 20 in open water"],
            Quantity::Density(growth) => growth.channel(),
        }
    }

    /// Whether it is made of land far around a tile: of its accumulation.
    pub fn is_of_accumulation(self) -> bool {
        let is_mask = |it| matches!(it, Quantity::Accumulation8 | Quantity::AccumulationM2);
        is_mask(self) || matches!(self, Quantity::Wetness8 | Quantity::Wetness | Quantity::Density(_))
    }

    /// Whether it is drawn as maps are.
    pub fn is_drawn(self) -> bool {
        matches!(self, Quantity::Map | Quantity::MapOfWalk)
    }

    /// The values that viewers show as black and white, where they are known before the raster is.
    pub fn shown(self) -> Option<[f64; 2]> {
        match self {
            Quantity::SlopeDegrees => Some([0.0, 60.0]),
            Quantity::Steepness => Some([0.0, 1.0]),
            Quantity::Wetness => Some([0.0, f64::from(WETTEST)]),
            _ if self.sample() == Sample::Grey8 => Some([0.0, 255.0]),
            _ => None,
        }
    }
}

/// What four pixels become in a copy of half the size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Reduction {
    Mean,
    Greatest,
    /// What most of them are; of as many the greater.
    Commonest,
}

impl Reduction {
    /// The row that two rows become; where their width is odd, the last pixel is its own neighbour.
    pub fn reduce(self, sample: Sample, upper: &[u8], lower: &[u8]) -> Vec<u8> {
        let bytes = sample.bytes();
        let width = upper.len() / bytes;
        let mut reduced = Vec::with_capacity(width.div_ceil(2) * bytes);
        for west in (0..width).step_by(2) {
            let east = (west + 1).min(width - 1);
            let four = [(upper, west), (upper, east), (lower, west), (lower, east)]
                .map(|(row, at)| &row[at * bytes..][..bytes]);
            match sample {
                Sample::Float32 => {
                    let four = four.map(|pixel| f32::from_le_bytes(pixel.try_into().expect("a float has four bytes")));
                    reduced.extend(self.of_floats(four).to_le_bytes());
                }
                Sample::Grey16 => {
                    let four = four.map(|pixel| u16::from_be_bytes([pixel[0], pixel[1]]));
                    reduced.extend(self.of_numbers(four.map(u32::from)).to_be_bytes().into_iter().skip(2));
                }
                Sample::Grey8 | Sample::Rgb8 | Sample::Rgba8 => {
                    let channels =
                        (0..bytes).map(|channel| self.of_numbers(four.map(|pixel| u32::from(pixel[channel]))) as u8);
                    reduced.extend(channels);
                }
            }
        }
        reduced
    }

    fn of_floats(self, [a, b, c, d]: [f32; 4]) -> f32 {
        match self {
            Reduction::Mean => ((a + b) + (c + d)) * 0.25,
            Reduction::Greatest | Reduction::Commonest => a.max(b).max(c.max(d)),
        }
    }

    fn of_numbers(self, four: [u32; 4]) -> u32 {
        let [a, b, c, d] = four;
        match self {
            Reduction::Mean => (a + b + c + d + 2) / 4,
            Reduction::Greatest => a.max(b).max(c).max(d),
            Reduction::Commonest => {
                let times = |value: u32| four.iter().filter(|other| **other == value).count();
                four.into_iter().max_by_key(|value| (times(*value), *value)).expect("there are four")
            }
        }
    }
}

/// Turns tiles into rows of samples.
pub(crate) struct Painter<'a> {
    world: &'a World,
    quantity: Quantity,
    encoding: Encoding,
    range_m: (f32, f32),
    map: Option<MapPainter>,
    /// Of densities, what grows where.
    grows: Option<Grows<'a>>,
}

impl<'a> Painter<'a> {
    /// Paints a quantity as an encoding has it, 16-bit heights as steps over a range.
    pub fn new(world: &'a World, quantity: Quantity, encoding: Encoding, range_m: (f32, f32)) -> Painter<'a> {
        Painter {
            world,
            quantity,
            encoding,
            range_m: match quantity {
                Quantity::Height16Whole => whole_range_m(range_m),
                _ => range_m,
            },
            map: matches!(quantity, Quantity::Map | Quantity::MapOfWalk).then(|| MapPainter::new(world)),
            grows: matches!(quantity, Quantity::Density(_)).then(|| Grows::new(world)),
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
            let pixels = map.paint(tile, cols, rows);
            return match self.quantity {
                Quantity::MapOfWalk => opaque(&pixels),
                _ => pixels,
            };
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
                    *bytes = control(Material::ALL.map(|material| tile.blend().weight(material, x, y))).to_le_bytes();
                }
            }
            Quantity::HeightMetres => copy_floats(heights, row),
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
            Quantity::Map | Quantity::MapOfWalk => unreachable!("a map is painted tile by tile"),
            Quantity::Colour => map::colour::paint_row(tile, y, row),
            Quantity::Water => {
                for (x, grey) in (x0..).zip(row) {
                    *grey = match tile.water_here(self.world, x, y).kind {
                        WaterKind::Dry => 0,
                        WaterKind::River => 64,
                        WaterKind::Lake => 128,
                        WaterKind::Sea => 255,
                    };
                }
            }
            Quantity::WaterDepth => put_floats(row, (x0..x1).map(|x| tile.water_here(self.world, x, y).depth_m)),
            Quantity::Flow => put_floats(row, (x0..x1).map(|x| tile.water_here(self.world, x, y).flow_m3s)),
            Quantity::Steepness8 => put_greys(row, (x0..x1).map(|x| tile.steepness(self.world, x, y) * 255.0)),
            Quantity::Steepness => put_floats(row, (x0..x1).map(|x| tile.steepness(self.world, x, y))),
            Quantity::Slope8 => put_greys(row, (x0..x1).map(|x| tile.slope_degrees(x, y) * (255.0 / 90.0))),
            Quantity::SlopeDegrees => put_floats(row, (x0..x1).map(|x| tile.slope_degrees(x, y))),
            Quantity::Curvature8 => {
                let scale = tile.spacing_m() as f32 * (BENDS / MOST_BENT);
                let grey = |bent: f32| FLAT + (bent * scale).clamp(-BENDS, BENDS);
                put_greys(row, tile.curvatures(y, x0, x1).into_iter().map(grey));
            }
            Quantity::Curvature => copy_floats(&tile.curvatures(y, x0, x1), row),
            Quantity::Accumulation8 => {
                let square_m2 = (tile.spacing_m() * tile.spacing_m()) as f32;
                let grey = |m2: &f32| libm::log10f((m2 / square_m2).max(1.0)) * (255.0 / MOST_DRAINED);
                put_greys(row, tile.accumulation_m2(self.world).row(y, x0, x1).iter().map(grey));
            }
            Quantity::AccumulationM2 => copy_floats(tile.accumulation_m2(self.world).row(y, x0, x1), row),
            Quantity::Wetness8 => {
                put_greys(row, (x0..x1).map(|x| tile.wetness(self.world, x, y) * (255.0 / WETTEST)));
            }
            Quantity::Wetness => put_floats(row, (x0..x1).map(|x| tile.wetness(self.world, x, y))),
            Quantity::Density(growth) => {
                let grows = self.grows.as_ref().expect("a painter of densities has their rule");
                put_greys(
                    row,
                    grows.densities(tile).row(y, x0, x1).iter().map(|densities| densities[growth as usize] * 255.0),
                );
            }
        }
    }

    /// `round((height - min) / (max - min) * 65535)`.
    fn step(&self, height_m: f32) -> u16 {
        let (min_m, max_m) = self.range_m;
        // The cast cuts off and saturates, so what rounding takes past the ends stays at them.
        ((height_m - min_m) / (max_m - min_m) * 65535.0 + 0.5) as u16
    }
}

/// Pixels with a fourth channel, in which they are there.
fn opaque(pixels: &[u8]) -> Vec<u8> {
    pixels.as_chunks::<3>().0.iter().flat_map(|[red, green, blue]| [*red, *green, *blue, 255]).collect()
}

/// A height range rounded out: HTerrain's dialog takes heights from -2000 to 2000 m, and each multiple of the scale that
/// brings a range into it is a whole number there.
pub(crate) fn whole_range_m((min_m, max_m): (f32, f32)) -> (f32, f32) {
    let scale = hterrain_scale((min_m, max_m));
    let (low, mut high) = ((min_m / scale).floor(), (max_m / scale).ceil());
    // A flat world's range would have no steps at all.
    if low == high {
        high += 1.0;
    }
    (low * scale, high * scale)
}

/// By how much HTerrain must stretch heights: 1, or as much more as brings them into its dialog.
pub(crate) fn hterrain_scale((min_m, max_m): (f32, f32)) -> f32 {
    (min_m.abs().max(max_m.abs()) / 2000.0).ceil().max(1.0)
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

/// Greys, rounded and cut off at their ends.
fn put_greys(row: &mut [u8], greys: impl Iterator<Item = f32>) {
    for (grey, value) in row.iter_mut().zip(greys) {
        // The cast saturates.
        *grey = (value + 0.5) as u8;
    }
}

fn put_floats(row: &mut [u8], floats: impl Iterator<Item = f32>) {
    for (bytes, float) in row.as_chunks_mut().0.iter_mut().zip(floats) {
        *bytes = float.to_le_bytes();
    }
}

fn copy_floats(floats: &[f32], row: &mut [u8]) {
    for (float, bytes) in floats.iter().zip(row.as_chunks_mut().0) {
        *bytes = float.to_le_bytes();
    }
}

fn copy_words(words: &[u32], row: &mut [u8]) {
    for (word, bytes) in words.iter().zip(row.as_chunks_mut().0) {
        *bytes = word.to_le_bytes();
    }
}
