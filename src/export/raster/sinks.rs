//! The sinks of rasters: one file for the region, or one a tile.

use std::path::{Path, PathBuf};
use std::sync::Mutex;

use serde::Serialize;

use crate::area::{Place, Region, TileId};
use crate::bake::{FileRecord, Kept, Sink};
use crate::error::Error;
use crate::export::format::file_name;
use crate::export::locked;
use crate::export::raster::image::{Image, RowOrder};
use crate::export::raster::quantity::Painter;
use crate::export::raster::writer::RasterWriter;
use crate::file::write_whole;
use crate::stop;
use crate::tile::Tile;
use crate::watch::Watch;
use crate::world::World;

/// An image of a format, and what all its files have in common.
struct Drawing {
    export: &'static str,
    image: Image,
    painter: Painter,
    region: Region,
    spacing_m: f64,
    out: PathBuf,
}

impl Drawing {
    fn new(world: &World, region: Region, export: &'static str, image: Image, out: &Path) -> Drawing {
        let painter = Painter::new(world, image.quantity, image.encoding);
        Drawing { export, image, painter, region, spacing_m: world.spacing_m(), out: out.to_owned() }
    }
}

/// One raster of the whole region, written strip by strip.
pub(crate) struct RegionRaster {
    drawing: Drawing,
    file: RasterFile,
    writer: Mutex<Option<RasterWriter>>,
}

impl RegionRaster {
    /// Begins the raster in the folder of the bake.
    pub fn create(
        world: &World,
        region: Region,
        export: &'static str,
        image: Image,
        out: &Path,
    ) -> Result<RegionRaster, Error> {
        let drawing = Drawing::new(world, region, export, image, out);
        let (width, height) = image.size(&region);
        let file = RasterFile { path: image.file(&region, None), width, height, tile: None };
        let writer = Mutex::new(Some(file.begin(&drawing)?));
        Ok(RegionRaster { drawing, file, writer })
    }
}

impl Sink for RegionRaster {
    fn name(&self) -> &str {
        &self.file.path
    }

    fn take(&self, tile: &Tile, place: Place) -> Result<Kept, Error> {
        let (cols, rows) = self.drawing.image.owned(&self.drawing.region, place);
        Ok(Kept { piece: self.drawing.painter.paint(tile, cols, rows), files: Vec::new() })
    }

    fn append(&self, row: u64, pieces: &[&[u8]]) -> Result<(), Error> {
        let mut writer = locked(&self.writer);
        let writer = writer.as_mut().expect("rows come before the end");
        let (_, rows) = self.drawing.image.owned(&self.drawing.region, Place { row, col: 0 });
        let mut line = Vec::new();
        for y in 0..rows {
            stop::check();
            line.clear();
            for piece in pieces {
                // Tiles of the last column may be a vertex wider.
                let row_bytes = piece.len() / rows;
                line.extend_from_slice(&piece[y * row_bytes..][..row_bytes]);
            }
            writer.write_rows(&line)?;
        }
        Ok(())
    }

    fn finish(&self, _watch: &Watch) -> Result<Vec<FileRecord>, Error> {
        let writer = locked(&self.writer).take();
        self.file.end(&self.drawing, writer.expect("a sink ends once"))
    }
}

/// One raster a tile, each written by the thread that made the tile.
pub(crate) struct TileRasters {
    drawing: Drawing,
}

impl TileRasters {
    /// Rasters that will be in the folder of the bake.
    pub fn create(world: &World, region: Region, export: &'static str, image: Image, out: &Path) -> TileRasters {
        TileRasters { drawing: Drawing::new(world, region, export, image, out) }
    }
}

impl Sink for TileRasters {
    fn name(&self) -> &str {
        self.drawing.image.stem
    }

    fn take(&self, tile: &Tile, place: Place) -> Result<Kept, Error> {
        let Drawing { image, painter, region, .. } = &self.drawing;
        let (cols, rows) = image.owned(region, place);
        let path = image.file(region, Some(place));
        let file = RasterFile { path, width: cols as u64, height: rows as u64, tile: Some(tile.id()) };
        let mut writer = file.begin(&self.drawing)?;
        let mut samples = painter.paint(tile, cols, rows);
        if image.layout.rows == RowOrder::FromSouth {
            let row_bytes = samples.len() / rows;
            // A tile is held whole, so its rows can be turned around; a region's cannot.
            samples = samples.chunks_exact(row_bytes).rev().collect::<Vec<_>>().concat();
        }
        writer.write_rows(&samples)?;
        Ok(Kept { piece: Vec::new(), files: file.end(&self.drawing, writer)? })
    }

    fn append(&self, _row: u64, _pieces: &[&[u8]]) -> Result<(), Error> {
        Ok(())
    }

    fn finish(&self, _watch: &Watch) -> Result<Vec<FileRecord>, Error> {
        Ok(Vec::new())
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
    fn begin(&self, Drawing { image, out, .. }: &Drawing) -> Result<RasterWriter, Error> {
        let (size, samples) = ((self.width, self.height), image.quantity.sample());
        let layer = file_name(image.stem);
        RasterWriter::create(out.join(&self.path), layer, image.encoding, samples, size, image.quantity.is_colour())
    }

    /// Ends the file, and writes its sidecar if it has one.
    fn end(&self, drawing: &Drawing, writer: RasterWriter) -> Result<Vec<FileRecord>, Error> {
        let Drawing { export, image, painter, spacing_m, out, .. } = drawing;
        let raster = FileRecord {
            width: Some(self.width),
            height: Some(self.height),
            channels: image.quantity.channels().iter().map(ToString::to_string).collect(),
            tile: self.tile,
            ..FileRecord::new(self.path.clone(), export, writer.finish()?)
        };
        if !image.encoding.has_sidecar() {
            return Ok(vec![raster]);
        }
        let (min_m, max_m) = painter.range_m();
        let sidecar = Sidecar {
            width: self.width,
            height: self.height,
            sample: "u16",
            byte_order: "little-endian",
            row_order: "from north to south",
            min_m,
            max_m,
            spacing_m: *spacing_m,
            tile: self.tile,
        };
        let path = format!("{}.json", self.path);
        let text = serde_json::to_string_pretty(&sidecar).expect("numbers and names are JSON") + "\n";
        let finished = write_whole(out.join(&path), text.as_bytes())?;
        let sidecar = FileRecord { tile: self.tile, ..FileRecord::new(path, export, finished) };
        Ok(vec![raster, sidecar])
    }
}
