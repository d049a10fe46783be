//! Cloud Optimized GeoTIFF: a raster in blocks, with overviews (smaller copies), so that a reader loads only the blocks
//! that it shows.
//!
//! Based on: OGC 21-026, Cloud Optimized GeoTIFF; OGC 19-008, GeoTIFF 1.1; GDAL's "Cloud Optimized GeoTIFF layout",
//! whose readers fetch a block in one request if its size stands before it. All directories come first, then the blocks
//! of the smallest overview, and so on up to the blocks of the raster itself. But rows arrive from north to south, and
//! the length of a block is known only after its compression. Therefore the blocks wait in a temporary file, and are
//! copied into their final order at the end.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom, Write};

use flate2::Compression;
use flate2::write::ZlibEncoder;
use rayon::prelude::*;

use crate::bake::FileRecord;
use crate::clock::Clock;
use crate::error::Error;
use crate::export::formats::raster::quantity::RasterClass;
use crate::export::formats::raster::reduction::Reduction;
use crate::export::formats::raster::sinks::{ImageDrawing, RasterFile, RegionWriter};
use crate::export::formats::raster::statistics::Statistics;
use crate::export::formats::raster::tiff::{Directory, TagValues, head};
use crate::export::formats::raster::writer::Sample;
use crate::export::formats::svg::escaped;
use crate::file::{Finished, PartFile};
use crate::generator;

/// Side of a block in pixels.
pub(super) const BLOCK: usize = 512;

/// Compression level of blocks, of at most 9. Level 6 takes two to three times as long for heights, weights, normals
/// and a map, and makes the files only 2 to 8 % smaller.
const LEVEL: Compression = Compression::new(3);

/// Number of blocks that are compressed in parallel before they are written. It bounds the memory for compressed
/// blocks.
const AT_ONCE: usize = 32;

/// GDAL's description of the block layout, which stands between the file header and the first directory. The zero byte
/// at its end fills it up to an even offset, where GDAL's validator expects the first directory.
const STRUCTURE: &str = "GDAL_STRUCTURAL_METADATA_SIZE=000140 bytes\nLAYOUT=IFDS_BEFORE_DATA\nBLOCK_ORDER=ROW_MAJOR\n\
                         BLOCK_LEADER=SIZE_AS_UINT4\nBLOCK_TRAILER=LAST_4_BYTES_REPEATED\nKNOWN_INCOMPATIBLE_EDITION=NO\n \0";

/// Largest size in bytes of a classic TIFF, whose offsets have 32 bits. Longer files are BigTIFFs.
const CLASSIC: u64 = u32::MAX as u64;

/// Writer of one Cloud Optimized GeoTIFF.
pub(super) struct CogWriter {
    sample: Sample,
    reduction: Reduction,
    levels: Vec<PyramidLevel>,
    /// Temporary file of the compressed blocks. [`PartFile::finish`] is never called on it, so it is deleted with the
    /// writer.
    blocks: PartFile,
    /// Number of bytes in the temporary file.
    written: u64,
}

impl RegionWriter for CogWriter {
    fn begin(drawing: &ImageDrawing, file: &RasterFile) -> Result<CogWriter, Error> {
        Ok(CogWriter {
            sample: drawing.image.quantity.sample,
            reduction: drawing.image.quantity.reduction,
            levels: PyramidLevel::all(file.width as usize, file.height as usize),
            blocks: PartFile::create(drawing.out.join(format!("{}.blocks", file.path)))?,
            written: 0,
        })
    }

    fn write_line(&mut self, line: &[u8], clock: &Clock) -> Result<(), Error> {
        self.push(0, line, clock)
    }

    fn end(
        self,
        drawing: &ImageDrawing,
        file: &RasterFile,
        statistics: &Statistics,
        clock: &Clock,
    ) -> Result<Vec<FileRecord>, Error> {
        let finished = self.finish(drawing, file, statistics, clock)?;
        Ok(vec![drawing.record(file, finished)])
    }
}

impl CogWriter {
    /// Returns the bytes of memory for writing a raster of a width in pixels, in addition to the samples of its tiles.
    /// A level holds the rows of one row of blocks. Each level is half as wide as the one before, so all together take
    /// about twice as much as the first. The blocks under compression are held both raw and compressed.
    pub fn held_bytes(width: u64, sample: Sample) -> u64 {
        let block = (BLOCK * BLOCK * sample.bytes()) as u64;
        let columns = width.div_ceil(BLOCK as u64);
        2 * columns * block + 2 * columns.min(AT_ONCE as u64) * block
    }
}

/// The raster itself, or one of its overviews. Each overview has half the width and height of the level before it.
struct PyramidLevel {
    width: usize,
    height: usize,
    /// Rows that wait until there are enough for a whole row of blocks.
    rows: Vec<u8>,
    /// Number of rows that are in blocks already.
    done: usize,
    /// Offset in the temporary file and length of each compressed block, in bytes. The blocks are in row-major order.
    blocks: Vec<(u64, u32)>,
}

impl PyramidLevel {
    /// Returns the levels of a raster. Width and height are halved until the last level fits in one block.
    fn all(width: usize, height: usize) -> Vec<PyramidLevel> {
        let level = |width, height| PyramidLevel { width, height, rows: Vec::new(), done: 0, blocks: Vec::new() };
        let mut levels = vec![level(width, height)];
        let (mut width, mut height) = (width, height);
        while width.max(height) > BLOCK {
            (width, height) = (width.div_ceil(2), height.div_ceil(2));
            levels.push(level(width, height));
        }
        levels
    }
}

impl CogWriter {
    /// Appends a row of pixels to a level, and writes a row of blocks when it is complete.
    fn push(&mut self, number: usize, row: &[u8], clock: &Clock) -> Result<(), Error> {
        let level = &mut self.levels[number];
        level.rows.extend_from_slice(row);
        let rows = level.rows.len() / row.len();
        if rows < BLOCK && level.done + rows < level.height {
            return Ok(());
        }
        // The buffer is given back below, so that it is not allocated again for each row of blocks.
        let mut strip = std::mem::take(&mut level.rows);
        level.done += rows;
        self.write_blocks(number, &strip, clock)?;
        if number + 1 < self.levels.len() {
            let row_bytes = row.len();
            for pair in strip.chunks(2 * row_bytes) {
                // The last row of an odd number of rows is paired with itself.
                let (upper, lower) = (&pair[..row_bytes], &pair[pair.len() - row_bytes..]);
                let reduced = self.reduction.reduce(self.sample, upper, lower);
                self.push(number + 1, &reduced, clock)?;
            }
        }
        strip.clear();
        self.levels[number].rows = strip;
        Ok(())
    }

    /// Compresses a row of blocks and writes it to the temporary file. `strip` holds the rows of pixels of these
    /// blocks.
    fn write_blocks(&mut self, number: usize, strip: &[u8], clock: &Clock) -> Result<(), Error> {
        let (sample, width) = (self.sample, self.levels[number].width);
        let columns: Vec<usize> = (0..width).step_by(BLOCK).collect();
        for columns in columns.chunks(AT_ONCE) {
            clock.check()?;
            let compress = |column: &usize| compressed(&block(strip, width, *column, sample), sample);
            let blocks: Vec<Vec<u8>> = columns.par_iter().map(compress).collect();
            for block in blocks {
                self.blocks.write_all(&block).map_err(Error::io(self.blocks.path()))?;
                self.levels[number].blocks.push((self.written, block.len() as u32));
                self.written += block.len() as u64;
            }
        }
        Ok(())
    }

    /// Writes the final file: header, directories, then all blocks in their final order.
    fn finish(
        mut self,
        drawing: &ImageDrawing,
        file: &RasterFile,
        statistics: &Statistics,
        clock: &Clock,
    ) -> Result<Finished, Error> {
        let path = drawing.out.join(&file.path);
        let failed = || Error::io(&path);
        self.blocks.flush().map_err(failed())?;
        // Returns the offset of each directory, and of the first byte after them. The length of a directory does not
        // depend on the block offsets in it, so 0 stands in for the first one here.
        let lay_out = |big: bool| {
            let mut at = (head(big, 0).len() + STRUCTURE.len()) as u64;
            let starts: Vec<u64> = (0..self.levels.len())
                .map(|level| {
                    let start = at;
                    at += self.directory(level, drawing, statistics, 0).encoded(big, start, false).len() as u64;
                    start
                })
                .collect();
            (starts, at)
        };
        let bytes = |level: &PyramidLevel| level.blocks.iter().map(|(_, bytes)| u64::from(*bytes) + 8).sum::<u64>();
        let all: u64 = self.levels.iter().map(bytes).sum();
        let big = lay_out(false).1 + all > CLASSIC;
        let (starts, mut at) = lay_out(big);
        // Offset of each level's first block. The blocks of the smallest overview come first.
        let mut firsts = vec![0; self.levels.len()];
        for (level, first) in self.levels.iter().zip(&mut firsts).rev() {
            *first = at;
            at += bytes(level);
        }
        let mut out = PartFile::create(path.clone())?;
        let mut write = |bytes: &[u8]| out.write_all(bytes).map_err(failed());
        write(&head(big, starts[0]))?;
        write(STRUCTURE.as_bytes())?;
        for (level, (start, first)) in starts.iter().zip(&firsts).enumerate() {
            let is_last = level + 1 == self.levels.len();
            write(&self.directory(level, drawing, statistics, *first).encoded(big, *start, is_last))?;
        }
        let mut blocks = File::open(self.blocks.lend()).map_err(failed())?;
        let mut block = Vec::new();
        for level in self.levels.iter().rev() {
            for (offset, bytes) in &level.blocks {
                clock.check()?;
                block.resize(*bytes as usize, 0);
                blocks.seek(SeekFrom::Start(*offset)).map_err(failed())?;
                blocks.read_exact(&mut block).map_err(failed())?;
                write(&bytes.to_le_bytes())?;
                write(&block)?;
                // GDAL's layout repeats the last four bytes of a block. By them a reader detects that a program
                // which does not know the layout has changed the file.
                write(&block[block.len() - 4..])?;
            }
        }
        out.finish()
    }

    /// Returns the directory of a level. `first` is the offset in the file of the level's first block.
    fn directory(&self, number: usize, drawing: &ImageDrawing, statistics: &Statistics, first: u64) -> Directory {
        let level = &self.levels[number];
        let quantity = drawing.image.quantity;
        let channels = quantity.channels.len();
        let (bits, format) = match self.sample {
            Sample::Float32 => (32, 3),
            Sample::Grey16 => (16, 1),
            Sample::Grey8 | Sample::Rgb8 | Sample::Rgba8 => (8, 1),
        };
        let each = |value: u16| TagValues::Shorts(vec![value; channels]);
        let one = |value: u16| TagValues::Shorts(vec![value]);
        let mut at = first;
        let places = level.blocks.iter().map(|(_, bytes)| {
            // The block's data begins after the four bytes of its size.
            let place = at + 4;
            at += u64::from(*bytes) + 8;
            place
        });
        let places = TagValues::Offsets(places.collect());
        let sizes = TagValues::Longs(level.blocks.iter().map(|(_, bytes)| *bytes).collect());
        let is_rgb = self.sample == Sample::Rgb8;
        let mut tags = Vec::new();
        if number > 0 {
            // A reduced-resolution copy of another image.
            tags.push((254, TagValues::Longs(vec![1])));
        }
        tags.extend([
            (256, TagValues::Longs(vec![level.width as u32])),
            (257, TagValues::Longs(vec![level.height as u32])),
            (258, each(bits)),
            // Deflate.
            (259, one(8)),
            // Red, green and blue; a palette; or grey, in which 0 is black.
            (
                262,
                one(if is_rgb {
                    2
                } else if quantity.classes.is_some() {
                    3
                } else {
                    1
                }),
            ),
            (277, one(channels as u16)),
            (284, one(1)),
            (317, one(predictor(self.sample))),
            (322, one(BLOCK as u16)),
            (323, one(BLOCK as u16)),
            (324, places),
            (325, sizes),
        ]);
        if let Some(classes) = quantity.classes {
            tags.push((320, TagValues::Shorts(colour_map(&classes()))));
        }
        if channels > 1 && !is_rgb {
            // The channels after the first are plain data, not opacity.
            tags.push((338, TagValues::Shorts(vec![0; channels - 1])));
        }
        tags.push((339, each(format)));
        if number == 0 {
            let place = drawing.georeference(None);
            let [east, north] = place.first_m;
            let plane = drawing.plane.name();
            let facts: Vec<_> = drawing.facts(None).texts().collect();
            let title = facts.iter().find(|(key, _)| *key == "Title").map_or(String::new(), |(_, title)| title.clone());
            tags.extend([
                (270, TagValues::Text(ascii(&title))),
                (305, TagValues::Text(generator::NAME.to_owned())),
                (33550, TagValues::Doubles(vec![place.spacing_m, place.spacing_m, 0.0])),
                (33922, TagValues::Doubles(vec![0.0, 0.0, 0.0, east, north, 0.0])),
                (34735, TagValues::Shorts(geo_keys(plane))),
                (34737, TagValues::Text(format!("{plane}|"))),
                (42112, TagValues::Text(self.metadata(drawing, statistics, &facts))),
            ]);
            tags.sort_by_key(|(tag, _)| *tag);
        }
        if let Some(no_data) = quantity.no_data {
            tags.push((42113, TagValues::Text(if no_data.is_nan() { "nan".into() } else { no_data.to_string() })));
        }
        Directory(tags)
    }

    /// Returns GDAL's XML metadata: everything for which TIFF has no tag.
    fn metadata(&self, drawing: &ImageDrawing, statistics: &Statistics, facts: &[(&str, String)]) -> String {
        use std::fmt::Write;
        let quantity = drawing.image.quantity;
        let mut text = String::from("<GDALMetadata>");
        // Title and software have TIFF tags of their own.
        for (key, value) in facts.iter().filter(|(key, _)| !["Title", "Software"].contains(key)) {
            _ = write!(text, "<Item name=\"{key}\">{}</Item>", escaped(value));
        }
        for (number, about) in quantity.channels.iter().enumerate() {
            _ = write!(
                text,
                "<Item name=\"DESCRIPTION\" sample=\"{number}\" role=\"description\">{}</Item>",
                escaped(about)
            );
        }
        if let Some(unit) = quantity.unit {
            _ = write!(text, "<Item name=\"UNITTYPE\" sample=\"0\" role=\"unittype\">{unit}</Item>");
        }
        if self.sample.is_grey() {
            for (key, value) in statistics.items() {
                _ = write!(text, "<Item name=\"{key}\" sample=\"0\">{value}</Item>");
            }
        }
        ascii(&(text + "</GDALMetadata>"))
    }
}

/// Returns the GeoTIFF keys of a named plane: its unit is the metre, and pixels are points, since they hold the values
/// of vertices.
fn geo_keys(plane: &str) -> Vec<u16> {
    let keys: [[u16; 4]; 4] = [
        // The coordinate reference system is user-defined, and pixels are points.
        [1024, 0, 1, 32767],
        [1025, 0, 1, 2],
        // The plane's name is a text in tag 34737. The length includes the `|` at its end.
        [1026, 34737, plane.len() as u16 + 1, 0],
        // EPSG code 9001 is the metre.
        [3076, 0, 1, 9001],
    ];
    // Version 1 of the key directory, revision 1.1 of the keys, and the number of keys.
    [[1, 1, 1, keys.len() as u16]].into_iter().chain(keys).flatten().collect()
}

/// Returns a TIFF's map of the 256 values of a byte to colours: all reds, all greens, then all blues, of 16 bits each.
/// Values that stand for no class are black.
fn colour_map(classes: &[RasterClass]) -> Vec<u16> {
    let shade =
        |channel: usize, value: usize| classes.get(value).map_or(0, |class| u16::from(class.colour[channel]) * 257);
    (0..3)
        .flat_map(|channel| (0..256).map(move |value| (channel, value)))
        .map(|(channel, value)| shade(channel, value))
        .collect()
}

/// Returns a text in ASCII, as TIFF demands. Each other letter becomes an XML character reference (`&#228;`).
fn ascii(text: &str) -> String {
    let letter = |letter: char| match letter {
        // GDAL parses its metadata as XML and gets the letter back. A title shows the reference as it is.
        letter if !letter.is_ascii() => format!("&#{};", u32::from(letter)),
        letter => letter.to_string(),
    };
    text.chars().map(letter).collect()
}

/// Cuts the block that begins at a column out of a strip. All blocks have the same size: pixels beyond the raster's
/// edges are zero.
fn block(strip: &[u8], width: usize, column: usize, sample: Sample) -> Vec<u8> {
    let bytes = sample.bytes();
    let (row_bytes, block_bytes) = (width * bytes, BLOCK * bytes);
    let mut block = vec![0; BLOCK * block_bytes];
    let count = (width - column).min(BLOCK) * bytes;
    for (row, into) in strip.chunks_exact(row_bytes).zip(block.chunks_exact_mut(block_bytes)) {
        into[..count].copy_from_slice(&row[column * bytes..][..count]);
    }
    block
}

/// Returns TIFF's number of the predictor: 2 for differences of integers, 3 for differences of the bytes of floats.
fn predictor(sample: Sample) -> u16 {
    if sample == Sample::Float32 { 3 } else { 2 }
}

/// Returns a compressed block. The predictor replaces each row by differences, which compress better.
fn compressed(block: &[u8], sample: Sample) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::with_capacity(block.len() / 2), LEVEL);
    let mut line = vec![0; BLOCK * sample.bytes()];
    for row in block.chunks_exact(line.len()) {
        differences(row, sample, &mut line);
        encoder.write_all(&line).expect("memory takes everything");
    }
    encoder.finish().expect("memory takes everything")
}

/// Applies the predictor to a row of samples, and writes the result to `line`.
fn differences(row: &[u8], sample: Sample, line: &mut [u8]) {
    // Distance in bytes to the byte that is subtracted: the one before, or the same channel of the pixel before.
    let step = match sample {
        Sample::Rgb8 => 3,
        Sample::Rgba8 => 4,
        _ => 1,
    };
    match sample {
        Sample::Float32 => {
            // First the highest bytes of all numbers, which differ least, then the next lower ones, and so on. The
            // differences are taken below, over all of these bytes.
            let count = row.len() / 4;
            for (at, word) in row.as_chunks::<4>().0.iter().enumerate() {
                for (plane, byte) in word.iter().rev().enumerate() {
                    line[plane * count + at] = *byte;
                }
            }
        }
        Sample::Grey16 => {
            // The samples come as big-endian numbers. The differences are those of the numbers, not of single bytes,
            // and are little-endian like the rest of the file.
            let mut before = 0;
            for (pair, into) in row.as_chunks::<2>().0.iter().zip(line.as_chunks_mut().0) {
                let value = u16::from_be_bytes(*pair);
                *into = value.wrapping_sub(before).to_le_bytes();
                before = value;
            }
            return;
        }
        Sample::Grey8 | Sample::Rgb8 | Sample::Rgba8 => line.copy_from_slice(row),
    }
    for at in (step..line.len()).rev() {
        line[at] = line[at].wrapping_sub(line[at - step]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_directory_lies_right_behind_the_structure() {
        // GDAL's validator finds the first directory so: after the line with the size it skips as many bytes as the
        // line says, and goes on to the next even offset.
        let line = STRUCTURE.find('\n').unwrap() + 1;
        let told: usize = STRUCTURE["GDAL_STRUCTURAL_METADATA_SIZE=".len()..][..6].parse().unwrap();
        for (big, first) in [(false, 192), (true, 200)] {
            let head = head(big, 0).len();
            assert_eq!((head + line + told).next_multiple_of(2), first);
            assert_eq!(head + STRUCTURE.len(), first);
        }
    }

    #[test]
    fn a_raster_is_halved_until_it_fits_in_a_block() {
        let sizes = |width, height| -> Vec<_> {
            PyramidLevel::all(width, height).iter().map(|level| (level.width, level.height)).collect()
        };
        assert_eq!(sizes(512, 3), [(512, 3)]);
        assert_eq!(sizes(1025, 513), [(1025, 513), (513, 257), (257, 129)]);
    }

    #[test]
    fn rows_are_differences_that_give_them_back() {
        let mut line = vec![0; 8];
        differences(&[5, 7, 7, 6, 6, 1, 0, 255], Sample::Grey8, &mut line);
        assert_eq!(line, [5, 2, 0, 255, 0, 251, 255, 255]);
        differences(&[1, 2, 3, 4, 6, 6, 4, 2], Sample::Rgba8, &mut line);
        assert_eq!(line, [1, 2, 3, 4, 5, 4, 1, 254]);
        differences(&[1, 0, 1, 1, 0, 255, 0, 0], Sample::Grey16, &mut line);
        assert_eq!(line, [0, 1, 1, 0, 254, 255, 1, 255]);
        differences([1.0_f32, -2.0].map(f32::to_le_bytes).as_flattened(), Sample::Float32, &mut line);
        assert_eq!(line, [0x3F, 0x81, 0xC0, 0x80, 0, 0, 0, 0]);
    }
}
