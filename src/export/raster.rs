//! What rasters can show of a tile, and the sinks that write it: one file for the region, or one a tile.

use std::path::{Path, PathBuf};
use std::sync::Mutex;

use serde::Serialize;

use crate::area::{Place, Region, TileId};
use crate::bake::FileRecord;
use crate::bake::Sink;
use crate::error::Error;
use crate::export::file::write_whole;
use crate::export::image::{Image, Rows};
use crate::export::profile;
use crate::export::writer::{Format, RasterWriter, Sample};
use crate::fluvial::{Water, WaterKind};
use crate::map::{self, MapPainter};
use crate::tile::{Material, Tile};
use crate::world::World;

/// What the pixels of a raster show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Quantity {
    /// The height, as 65,536 steps over the world's range.
    Height16,
    /// The same over the range rounded out to whole metres, for dialogs that take no others.
    Height16Whole,
    /// The height in metres.
    HeightMetres,
    /// The weight of one material.
    Weight(Material),
    /// The two strongest materials and how they mix, as Terrain3D has it in the bits of a float.
    Control,
    /// Weights of grass, dirt, rock and sand.
    GroundWeights,
    /// Weights of snow and of what may follow.
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
            Quantity::Control => &["bits: base << 27 | overlay << 22 | blend << 14"],
            Quantity::GroundWeights => &["grass", "dirt", "rock", "sand"],
            Quantity::CoverWeights => &["snow", "unused", "unused", "unused"],
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
    format: Format,
    range_m: (f32, f32),
    spacing_m: f64,
    map: Option<MapPainter>,
}

impl Painter {
    /// Paints a quantity as a format has it.
    pub fn new(world: &World, quantity: Quantity, format: Format) -> Painter {
        Painter {
            quantity,
            format,
            range_m: match quantity {
                Quantity::Height16Whole => profile::whole_range_m(world),
                _ => world.height_range_m(),
            },
            spacing_m: world.spacing_m(),
            map: (quantity == Quantity::Map).then(|| MapPainter::new(world)),
        }
    }

    /// What the pixels show.
    pub fn quantity(&self) -> Quantity {
        self.quantity
    }

    /// The samples of the first `rows` rows and `cols` columns of a tile, without gaps.
    pub fn paint(&self, tile: &Tile, cols: usize, rows: usize) -> Vec<u8> {
        let area = tile.area();
        let row_bytes = cols * self.quantity.sample().bytes();
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
                let is_png = self.format == Format::Png;
                for (pair, &height) in row.as_chunks_mut().0.iter_mut().zip(heights) {
                    let step = self.step(height);
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
            Quantity::Map => self.map.as_ref().expect("a map has its painter").paint_row(tile, y, row),
            Quantity::Colour => map::ground::paint_row(tile, y, row),
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
        ((height_m - min_m) / (max_m - min_m) * 65535.0 + 0.5) as u16
    }
}

fn water(tile: &Tile) -> &Water {
    tile.water().expect("the plan has checked that the world has water")
}

/// The bits that Terrain3D reads of a vertex: the texture that there is most of, the second, and its share of both. Based
/// on: Terrain3D's manual, "Control Map Format"; textures have the numbers of the materials.
fn control(weights: [u8; Material::ALL.len()]) -> u32 {
    let mut order: [usize; Material::ALL.len()] = std::array::from_fn(|material| material);
    // Stable: of equal weights the first material is the stronger one.
    order.sort_by_key(|&material| std::cmp::Reverse(weights[material]));
    let [most, second] = [order[0], order[1]].map(|material| u32::from(weights[material]));
    let both = most + second;
    let blend = (second * 255 + both / 2) / both;
    (order[0] as u32) << 27 | (order[1] as u32) << 22 | blend << 14
}

fn copy_words(words: &[u32], row: &mut [u8]) {
    for (word, bytes) in words.iter().zip(row.as_chunks_mut().0) {
        *bytes = word.to_le_bytes();
    }
}

/// One raster of the whole region, written strip by strip.
pub(crate) struct RegionRaster {
    image: Image,
    painter: Painter,
    region: Region,
    file: RasterFile,
    out: PathBuf,
    writer: Mutex<Option<RasterWriter>>,
}

impl RegionRaster {
    /// Begins the raster in the folder of the bake.
    pub fn create(world: &World, region: Region, image: Image, out: &Path) -> Result<RegionRaster, Error> {
        let (width, height) = image.size(&region);
        let file = RasterFile { path: image.file(&region, None), width, height, tile: None };
        let writer = Mutex::new(Some(file.begin(&image, out)?));
        Ok(RegionRaster {
            image,
            painter: Painter::new(world, image.quantity, image.format),
            region,
            file,
            out: out.to_owned(),
            writer,
        })
    }
}

impl Sink for RegionRaster {
    fn name(&self) -> &str {
        &self.file.path
    }

    fn take(&self, tile: &Tile, place: Place) -> Result<Vec<u8>, Error> {
        let (cols, rows) = self.image.owned(&self.region, place);
        Ok(self.painter.paint(tile, cols, rows))
    }

    fn append(&self, row: u64, pieces: &[&[u8]]) -> Result<(), Error> {
        let mut writer = self.writer.lock().expect("no thread panics while it writes");
        let writer = writer.as_mut().expect("rows come before the end");
        let (_, rows) = self.image.owned(&self.region, Place { row, col: 0 });
        let mut line = Vec::new();
        for y in 0..rows {
            line.clear();
            for piece in pieces {
                let row_bytes = piece.len() / rows;
                line.extend_from_slice(&piece[y * row_bytes..][..row_bytes]);
            }
            writer.write_rows(&line)?;
        }
        Ok(())
    }

    fn finish(&self) -> Result<Vec<FileRecord>, Error> {
        let writer = self.writer.lock().expect("no thread panics while it writes").take();
        self.file.end(&self.image, writer.expect("a sink ends once"), &self.painter, &self.out)
    }
}

/// One raster a tile, each written by the thread that made the tile.
pub(crate) struct TileRasters {
    image: Image,
    painter: Painter,
    region: Region,
    out: PathBuf,
    records: Mutex<Vec<FileRecord>>,
}

impl TileRasters {
    /// Rasters that will be in the folder of the bake.
    pub fn create(world: &World, region: Region, image: Image, out: &Path) -> TileRasters {
        let painter = Painter::new(world, image.quantity, image.format);
        TileRasters { image, painter, region, out: out.to_owned(), records: Mutex::default() }
    }
}

impl Sink for TileRasters {
    fn name(&self) -> &str {
        self.image.stem
    }

    fn take(&self, tile: &Tile, place: Place) -> Result<Vec<u8>, Error> {
        let (cols, rows) = self.image.owned(&self.region, place);
        let path = self.image.file(&self.region, Some(place));
        let file = RasterFile { path, width: cols as u64, height: rows as u64, tile: Some(tile.id()) };
        let mut writer = file.begin(&self.image, &self.out)?;
        let mut samples = self.painter.paint(tile, cols, rows);
        if self.image.layout.rows == Rows::FromSouth {
            let row_bytes = samples.len() / rows;
            samples = samples.chunks_exact(row_bytes).rev().collect::<Vec<_>>().concat();
        }
        writer.write_rows(&samples)?;
        let records = file.end(&self.image, writer, &self.painter, &self.out)?;
        self.records.lock().expect("no thread panics while it adds").extend(records);
        Ok(Vec::new())
    }

    fn append(&self, _row: u64, _pieces: &[&[u8]]) -> Result<(), Error> {
        Ok(())
    }

    fn finish(&self) -> Result<Vec<FileRecord>, Error> {
        Ok(std::mem::take(&mut *self.records.lock().expect("no thread panics while it adds")))
    }
}

/// What a bare raster does not say about itself.
#[derive(Serialize)]
struct Sidecar {
    width: u64,
    height: u64,
    sample: &'static str,
    byte_order: &'static str,
    row_order: &'static str,
    min_m: f32,
    max_m: f32,
    spacing_m: f64,
    tile: Option<TileId>,
}

/// A raster's place and size.
struct RasterFile {
    path: String,
    width: u64,
    height: u64,
    tile: Option<TileId>,
}

impl RasterFile {
    fn begin(&self, image: &Image, out: &Path) -> Result<RasterWriter, Error> {
        let size = (self.width, self.height);
        let layer = image.stem.rsplit_once('/').map_or(image.stem, |(_, name)| name);
        RasterWriter::create(
            out.join(&self.path),
            layer,
            image.format,
            image.quantity.sample(),
            size,
            image.quantity.is_colour(),
        )
    }

    /// Ends the file, and writes its sidecar where the format says nothing about itself.
    fn end(
        &self,
        image: &Image,
        writer: RasterWriter,
        painter: &Painter,
        out: &Path,
    ) -> Result<Vec<FileRecord>, Error> {
        let raster = FileRecord {
            width: Some(self.width),
            height: Some(self.height),
            channels: image.quantity.channels().iter().map(ToString::to_string).collect(),
            tile: self.tile,
            ..FileRecord::new(self.path.clone(), image.export, writer.finish()?)
        };
        if image.format != Format::R16 {
            return Ok(vec![raster]);
        }
        let (min_m, max_m) = painter.range_m;
        let sidecar = Sidecar {
            width: self.width,
            height: self.height,
            sample: "u16",
            byte_order: "little-endian",
            row_order: "from north to south",
            min_m,
            max_m,
            spacing_m: painter.spacing_m,
            tile: self.tile,
        };
        let path = format!("{}.json", self.path);
        let text = serde_json::to_string_pretty(&sidecar).expect("numbers and names are JSON") + "\n";
        let finished = write_whole(out.join(&path), text.as_bytes())?;
        let sidecar = FileRecord { tile: self.tile, ..FileRecord::new(path, image.export, finished) };
        Ok(vec![raster, sidecar])
    }
}
