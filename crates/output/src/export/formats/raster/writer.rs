//! Writers of raster files. They take the rows one after the other, so no raster is ever whole in memory.

use std::io::Write;
use std::path::{Path, PathBuf};

use crate::error::Error;
use crate::export::formats::raster::exr::ExrWriter;
use crate::export::formats::raster::facts::Facts;
use crate::file::{Finished, PartFile, SharedFile};

/// The file format in which the samples of a raster are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Encoding {
    /// Portable Network Graphics, 8 or 16 bits per channel, big-endian.
    Png,
    /// OpenEXR scan lines, one 32-bit float channel `Y`.
    Exr,
    /// OpenEXR with the same samples in three channels, R, G and B, for readers that accept no others.
    ExrRgb,
    /// Bare 16-bit samples, little-endian, with a JSON sidecar.
    R16,
    /// Bare 16-bit samples with the extension that engines expect, without a sidecar.
    Raw,
    /// Cloud Optimized GeoTIFF: blocks, with overviews before them.
    GeoTiff,
}

/// Greatest width and height of a PNG in pixels. The format allows 2^31 - 1, but libpng, by which nearly all programs
/// read PNGs, refuses more than this number.
pub(in crate::export) const MOST_PNG: u64 = 1_000_000;

impl Encoding {
    /// Returns the extension of the file's name.
    pub fn extension(self) -> &'static str {
        match self {
            Encoding::Png => "png",
            Encoding::Exr | Encoding::ExrRgb => "exr",
            Encoding::R16 => "r16",
            Encoding::Raw => "raw",
            Encoding::GeoTiff => "tif",
        }
    }

    /// Returns the greatest width in pixels that a file can have, which is also its greatest height.
    pub fn max_side(self) -> u64 {
        match self {
            Encoding::Png => MOST_PNG,
            // The length in bytes of an EXR's line is a signed 32-bit number.
            Encoding::Exr | Encoding::ExrRgb => i32::MAX as u64 / (4 * self.copies()),
            Encoding::GeoTiff => i32::MAX as u64,
            Encoding::R16 | Encoding::Raw => u64::MAX,
        }
    }

    /// Returns the number of channels in which each sample is repeated.
    pub fn copies(self) -> u64 {
        self.exr_channels().len().max(1) as u64
    }

    /// Returns the names of the channels of an OpenEXR file, in the file's order. Other encodings have none.
    fn exr_channels(self) -> &'static [&'static str] {
        match self {
            Encoding::Exr => &["Y"],
            Encoding::ExrRgb => &["B", "G", "R"],
            Encoding::Png | Encoding::R16 | Encoding::Raw | Encoding::GeoTiff => &[],
        }
    }
}

/// Type of a pixel: its channels, and the type of number in them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sample {
    /// One channel of 8 bits.
    Grey8,
    /// One channel of 16 bits.
    Grey16,
    /// Three channels of 8 bits.
    Rgb8,
    /// Four channels of 8 bits.
    Rgba8,
    /// One channel of 32-bit floats.
    Float32,
}

impl Sample {
    /// Returns the number of bytes of a pixel.
    pub fn bytes(self) -> usize {
        match self {
            Sample::Grey8 => 1,
            Sample::Grey16 => 2,
            Sample::Rgb8 => 3,
            Sample::Rgba8 | Sample::Float32 => 4,
        }
    }

    /// True if a pixel is a single number.
    pub fn is_grey(self) -> bool {
        matches!(self, Sample::Grey8 | Sample::Grey16 | Sample::Float32)
    }
}

/// Description of a raster file that is to be written.
pub(crate) struct RasterForm<'a> {
    pub encoding: Encoding,
    pub sample: Sample,
    /// Width and height in pixels, each at most [`Encoding::max_side`].
    pub size: (u64, u64),
    /// Name of the layer, for encodings that have layer names (OpenEXR).
    pub layer: &'a str,
    /// True for pictures in sRGB colours; all other rasters are data.
    pub is_colour: bool,
    /// Red, green and blue of the colours whose numbers the samples are, in files that can hold them (PNG).
    pub palette: Option<Vec<u8>>,
    /// The metadata that is written into the file.
    pub facts: &'a Facts,
}

/// A raster file that is being written.
pub(crate) enum RasterWriter {
    Png { file: SharedFile, stream: Box<png::StreamWriter<'static, SharedFile>> },
    Exr(Box<ExrWriter>),
    Bare(Box<PartFile>),
}

impl RasterWriter {
    /// Begins a raster file.
    pub fn create(path: PathBuf, form: &RasterForm) -> Result<RasterWriter, Error> {
        let (width, height) = form.size;
        let narrow = |side: u64| u32::try_from(side).expect("the plan has checked the size");
        let file = PartFile::create(path.clone())?;
        match form.encoding {
            Encoding::R16 | Encoding::Raw => Ok(RasterWriter::Bare(Box::new(file))),
            Encoding::Exr | Encoding::ExrRgb => {
                let (channels, size) = (form.encoding.exr_channels(), (narrow(width), narrow(height)));
                Ok(RasterWriter::Exr(Box::new(ExrWriter::start(file, form.layer, channels, size, form.facts)?)))
            }
            Encoding::Png => {
                let file = SharedFile::new(file);
                let size = (narrow(width), narrow(height));
                let stream =
                    png_writer(file.clone(), form.sample, size, form.is_colour, form.palette.clone(), form.facts)
                        // Chunks of 256 KiB: fewer chunks mean fewer headers, checksums and writes.
                        .and_then(|writer| writer.into_stream_writer_with_size(1 << 18))
                        .map_err(png_error(&path))?;
                Ok(RasterWriter::Png { file, stream: Box::new(stream) })
            }
            Encoding::GeoTiff => {
                unreachable!("it is not written from the north to the south, and has a sink of its own")
            }
        }
    }

    /// Appends complete rows.
    pub fn write_rows(&mut self, rows: &[u8]) -> Result<(), Error> {
        match self {
            RasterWriter::Png { file, stream } => stream.write_all(rows).map_err(|error| Error::io(file.path())(error)),
            RasterWriter::Exr(writer) => writer.write_rows(rows),
            RasterWriter::Bare(file) => file.write_all(rows).map_err(Error::io(file.path())),
        }
    }

    /// Ends the file. All its rows must have been written.
    pub fn finish(self) -> Result<Finished, Error> {
        match self {
            RasterWriter::Png { file, stream } => {
                let path = file.path();
                stream.finish().map_err(png_error(&path))?;
                file.finish()
            }
            RasterWriter::Exr(writer) => writer.finish(),
            RasterWriter::Bare(file) => file.finish(),
        }
    }
}

/// Returns a complete PNG in memory. With `srgb` it is marked as a picture in sRGB colours.
pub fn png_bytes(sample: Sample, size: (u32, u32), srgb: bool, rows: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut write = || {
        let mut writer = png_writer(&mut bytes, sample, size, srgb, None, &Facts::default())?;
        writer.write_image_data(rows)?;
        writer.finish()
    };
    write().expect("memory takes everything, and the rows are as many as the picture has");
    bytes
}

fn png_writer<W: Write>(
    file: W,
    sample: Sample,
    (width, height): (u32, u32),
    srgb: bool,
    palette: Option<Vec<u8>>,
    facts: &Facts,
) -> Result<png::Writer<W>, png::EncodingError> {
    let mut encoder = png::Encoder::new(file, width, height);
    let (colour, depth) = match sample {
        Sample::Grey8 if palette.is_some() => (png::ColorType::Indexed, png::BitDepth::Eight),
        Sample::Grey8 => (png::ColorType::Grayscale, png::BitDepth::Eight),
        Sample::Grey16 => (png::ColorType::Grayscale, png::BitDepth::Sixteen),
        Sample::Rgb8 => (png::ColorType::Rgb, png::BitDepth::Eight),
        Sample::Rgba8 => (png::ColorType::Rgba, png::BitDepth::Eight),
        Sample::Float32 => unreachable!("PNG has no floats, and no export asks for them"),
    };
    encoder.set_color(colour);
    encoder.set_depth(depth);
    if let Some(palette) = palette {
        encoder.set_palette(palette);
    }
    if srgb {
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    }
    // With the fastest setting, encoding takes less time than making the noise of the terrain. On terrain a fixed
    // filter beats the adaptive one.
    encoder.set_compression(png::Compression::Fast);
    encoder.set_filter(png::Filter::Up);
    for (keyword, text) in facts.texts() {
        // A tEXt chunk is shown by more programs than an iTXt chunk, but it can hold only the characters of Latin-1.
        match text.chars().all(|letter| letter <= '\u{FF}') {
            true => encoder.add_text_chunk(keyword.to_owned(), text)?,
            false => encoder.add_itxt_chunk(keyword.to_owned(), text)?,
        }
    }
    encoder.write_header()
}

fn png_error(path: &Path) -> impl FnOnce(png::EncodingError) -> Error {
    move |error| {
        let source = match error {
            png::EncodingError::IoError(error) => error,
            other => std::io::Error::other(other),
        };
        Error::Io { path: path.to_owned(), source }
    }
}
