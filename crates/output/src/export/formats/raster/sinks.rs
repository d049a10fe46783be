//! The sinks of rasters: one file for the region, or one per tile.

use std::path::{Path, PathBuf};
use std::sync::Mutex;

use serde::Serialize;

use crate::area::{Place, Region, TileId};
use crate::bake::{FileRecord, Kept, Sink};
use crate::clock::Clock;
use crate::error::Error;
use crate::export::formats::format::{Request, file_name};
use crate::export::formats::georeference::{Georeference, Plane};
use crate::export::formats::locked;
use crate::export::formats::raster::auxiliary::auxiliary;
use crate::export::formats::raster::facts::{Facts, Shown};
use crate::export::formats::raster::image::{Image, RowOrder, Sidecar};
use crate::export::formats::raster::painter::Painter;
use crate::export::formats::raster::statistics::Statistics;
use crate::export::formats::raster::writer::{Encoding, RasterForm, RasterWriter};
use crate::export::plan::options::TileNames;
use crate::file::{Finished, write_whole};
use crate::tile::Tile;
use crate::watch::Watch;

/// One image of a format, with everything that its files have in common.
pub(super) struct ImageDrawing<'a> {
    export: &'static str,
    pub image: Image,
    pub painter: Painter<'a>,
    pub region: Region,
    pub plane: Plane,
    shown: Shown,
    names: TileNames,
    spacing_m: f64,
    pub out: PathBuf,
}

impl<'a> ImageDrawing<'a> {
    pub fn new(request: &Request<'a>, export: &'static str, image: Image, out: &Path) -> ImageDrawing<'a> {
        let Request { name, world, region, .. } = *request;
        let shown = Shown { preset_name: name.to_owned(), seed: world.seed(), region, is_walk: request.walk.is_some() };
        ImageDrawing {
            export,
            image,
            painter: Painter::new(world, image.quantity, image.encoding, request.height_range_m),
            region,
            plane: Plane::new(name, world.seed()),
            shown,
            names: request.names,
            spacing_m: world.spacing_m(),
            out: out.to_owned(),
        }
    }

    /// Returns the position of the pixels of a tile's file or, with `None`, of the region's file.
    pub fn georeference(&self, tile: Option<TileId>) -> Georeference {
        let area = tile.unwrap_or(self.region.at()).area(self.region.tile_cells());
        Georeference::of_vertices([area.x0, area.y0], self.spacing_m)
    }

    /// Returns the metadata of a tile's file or, with `None`, of the region's file.
    pub fn facts(&self, tile: Option<TileId>) -> Facts {
        let quantity = self.image.quantity;
        let range_m = quantity.is_steps().then(|| self.painter.range_m());
        Facts::new(&self.shown, quantity, tile, self.georeference(tile), range_m)
    }

    /// Returns the manifest's record of a finished file.
    pub fn record(&self, file: &RasterFile, finished: Finished) -> FileRecord {
        FileRecord {
            width: Some(file.width),
            height: Some(file.height),
            channels: self.image.quantity.channels.iter().map(ToString::to_string).collect(),
            tile: file.tile,
            ..FileRecord::new(file.path.clone(), self.export, finished)
        }
    }
}

/// Writer of a region's file, line by line from north to south.
pub(super) trait RegionWriter: Send + Sized {
    /// Begins the file in the folder of the bake.
    fn begin(drawing: &ImageDrawing, file: &RasterFile) -> Result<Self, Error>;

    /// Writes the next line of samples.
    fn write_line(&mut self, line: &[u8], clock: &Clock) -> Result<(), Error>;

    /// Ends the file with the statistics of all its samples, and writes its sidecar files.
    fn end(
        self,
        drawing: &ImageDrawing,
        file: &RasterFile,
        statistics: &Statistics,
        clock: &Clock,
    ) -> Result<Vec<FileRecord>, Error>;
}

/// One raster of the whole region.
pub(super) struct RegionRaster<'a, W> {
    drawing: ImageDrawing<'a>,
    file: RasterFile,
    under_way: Mutex<Option<OpenRaster<W>>>,
}

/// A file that is being written, and the statistics of its samples so far.
struct OpenRaster<W> {
    writer: W,
    statistics: Statistics,
}

impl<'a, W: RegionWriter> RegionRaster<'a, W> {
    /// Begins the raster in the folder of the bake.
    pub fn create(
        request: &Request<'a>,
        export: &'static str,
        image: Image,
        out: &Path,
    ) -> Result<RegionRaster<'a, W>, Error> {
        let drawing = ImageDrawing::new(request, export, image, out);
        let file = RasterFile::of_region(&drawing);
        let under_way = OpenRaster { writer: W::begin(&drawing, &file)?, statistics: Statistics::default() };
        Ok(RegionRaster { drawing, file, under_way: Mutex::new(Some(under_way)) })
    }
}

impl<W: RegionWriter> Sink for RegionRaster<'_, W> {
    fn name(&self) -> &str {
        &self.file.path
    }

    fn take(&self, tile: &Tile, place: Place, _clock: &Clock) -> Result<Kept, Error> {
        Ok(self.drawing.piece(tile, place))
    }

    fn append(&self, row: u64, pieces: &[&[u8]], clock: &Clock) -> Result<(), Error> {
        let mut under_way = locked(&self.under_way);
        let OpenRaster { writer, statistics } = under_way.as_mut().expect("rows come before the end");
        let image = &self.drawing.image;
        let sample = image.quantity.sample;
        // Viewers stretch greys over the range of the samples. With statistics at hand they need not read all samples.
        let is_told = image.encoding == Encoding::GeoTiff || image.beside().contains(&Sidecar::Auxiliary);
        self.drawing.lines(row, pieces, clock, |line| {
            if is_told && sample.is_grey() {
                statistics.add(line, sample);
            }
            writer.write_line(line, clock)
        })
    }

    fn finish(&self, watch: &Watch) -> Result<Vec<FileRecord>, Error> {
        let OpenRaster { writer, statistics } = locked(&self.under_way).take().expect("a sink ends once");
        writer.end(&self.drawing, &self.file, &statistics, &watch.clock)
    }
}

impl RegionWriter for RasterWriter {
    fn begin(drawing: &ImageDrawing, file: &RasterFile) -> Result<RasterWriter, Error> {
        file.begin(drawing)
    }

    fn write_line(&mut self, line: &[u8], _clock: &Clock) -> Result<(), Error> {
        self.write_rows(line)
    }

    fn end(
        self,
        drawing: &ImageDrawing,
        file: &RasterFile,
        statistics: &Statistics,
        _clock: &Clock,
    ) -> Result<Vec<FileRecord>, Error> {
        file.end(drawing, self, Some(statistics))
    }
}

impl ImageDrawing<'_> {
    /// Returns the samples of a tile, which a raster of the region keeps until it writes the row of tiles.
    fn piece(&self, tile: &Tile, place: Place) -> Kept {
        let (cols, rows) = self.image.owned(&self.region, place);
        Kept { piece: self.painter.paint(tile, cols, rows), files: Vec::new() }
    }

    /// Calls a function with each line of samples of a row of tiles. `pieces` are the samples of the tiles.
    fn lines(
        &self,
        row: u64,
        pieces: &[&[u8]],
        clock: &Clock,
        mut call: impl FnMut(&[u8]) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let (_, rows) = self.image.owned(&self.region, Place { row, col: 0 });
        let mut line = Vec::new();
        for y in 0..rows {
            clock.check()?;
            line.clear();
            for (col, piece) in (0..).zip(pieces) {
                if piece.is_empty() {
                    self.skip(Place { row, col }, &mut line);
                    continue;
                }
                // A tile of the last column may be one vertex wider, so the length is the piece's own.
                let row_bytes = piece.len() / rows;
                line.extend_from_slice(&piece[y * row_bytes..][..row_bytes]);
            }
            call(&line)?;
        }
        Ok(())
    }

    /// Adds one line of pixels without data, in the place of a tile that the walk has not come to.
    fn skip(&self, place: Place, line: &mut Vec<u8>) {
        let (cols, _) = self.image.owned(&self.region, place);
        let gap = self.image.quantity.gap().expect("the plan has checked that it can be silent");
        line.extend(std::iter::repeat_n(gap, cols).flatten());
    }
}

/// One raster per tile, each written by the thread that made the tile.
pub(crate) struct TileRasters<'a> {
    drawing: ImageDrawing<'a>,
}

impl<'a> TileRasters<'a> {
    /// Creates the sink of rasters in the bake's folder.
    pub fn create(request: &Request<'a>, export: &'static str, image: Image, out: &Path) -> TileRasters<'a> {
        TileRasters { drawing: ImageDrawing::new(request, export, image, out) }
    }
}

impl Sink for TileRasters<'_> {
    fn name(&self) -> &str {
        self.drawing.image.stem
    }

    fn take(&self, tile: &Tile, place: Place, _clock: &Clock) -> Result<Kept, Error> {
        let ImageDrawing { image, painter, region, names, .. } = &self.drawing;
        let (cols, rows) = image.owned(region, place);
        let path = image.file(region, Some(place), *names);
        let file = RasterFile { path, width: cols as u64, height: rows as u64, tile: Some(tile.id()) };
        let mut writer = file.begin(&self.drawing)?;
        let mut samples = painter.paint(tile, cols, rows);
        if image.layout.rows == RowOrder::FromSouth {
            let row_bytes = samples.len() / rows;
            // The whole tile is in memory, so its rows can be reversed. A region's raster never is, so its rows cannot.
            samples = samples.chunks_exact(row_bytes).rev().collect::<Vec<_>>().concat();
        }
        writer.write_rows(&samples)?;
        Ok(Kept { piece: Vec::new(), files: file.end(&self.drawing, writer, None)? })
    }

    fn append(&self, _row: u64, _pieces: &[&[u8]], _clock: &Clock) -> Result<(), Error> {
        Ok(())
    }

    fn finish(&self, _watch: &Watch) -> Result<Vec<FileRecord>, Error> {
        Ok(Vec::new())
    }
}

/// JSON sidecar that describes a file of bare samples, which has no header.
#[derive(Serialize)]
struct JsonSidecar {
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

/// A raster's path, its size in pixels, and its tile.
pub(super) struct RasterFile {
    pub path: String,
    pub width: u64,
    pub height: u64,
    pub tile: Option<TileId>,
}

impl RasterFile {
    /// Returns the file of a whole region.
    pub fn of_region(ImageDrawing { image, region, .. }: &ImageDrawing) -> RasterFile {
        let (width, height) = image.size(region);
        RasterFile { path: image.file(region, None, TileNames::default()), width, height, tile: None }
    }

    fn begin(&self, drawing: &ImageDrawing) -> Result<RasterWriter, Error> {
        let image = &drawing.image;
        let form = RasterForm {
            encoding: image.encoding,
            sample: image.quantity.sample,
            size: (self.width, self.height),
            layer: file_name(image.stem),
            is_colour: image.quantity.is_colour,
            palette: image.quantity.classes.map(|classes| classes().iter().flat_map(|class| class.colour).collect()),
            facts: &drawing.facts(self.tile),
        };
        RasterWriter::create(drawing.out.join(&self.path), &form)
    }

    /// Ends the file, and writes its sidecar files. Only rasters of a region have statistics.
    fn end(
        &self,
        drawing: &ImageDrawing,
        writer: RasterWriter,
        statistics: Option<&Statistics>,
    ) -> Result<Vec<FileRecord>, Error> {
        let mut records = vec![drawing.record(self, writer.finish()?)];
        for beside in drawing.image.beside() {
            let path = beside.path(&self.path);
            let text = match beside {
                Sidecar::Json => self.sidecar(drawing),
                Sidecar::WorldFile => drawing.georeference(self.tile).world_file(),
                Sidecar::Auxiliary => {
                    let place = drawing.georeference(self.tile);
                    auxiliary(&drawing.plane, place, drawing.image.quantity, drawing.painter.range_m(), statistics)
                }
            };
            let finished = write_whole(drawing.out.join(&path), text.as_bytes())?;
            records.push(FileRecord { tile: self.tile, ..FileRecord::new(path, drawing.export, finished) });
        }
        Ok(records)
    }

    fn sidecar(&self, ImageDrawing { painter, spacing_m, .. }: &ImageDrawing) -> String {
        let (min_m, max_m) = painter.range_m();
        let sidecar = JsonSidecar {
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
        serde_json::to_string_pretty(&sidecar).expect("numbers and names are JSON") + "\n"
    }
}
