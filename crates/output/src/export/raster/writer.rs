//! Writers of whole rasters, fed row by row: a raster is never held.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use crate::error::Error;
use crate::export::locked;
use crate::export::raster::exr::ExrWriter;
use crate::export::raster::facts::Facts;
use crate::file::{Finished, PartFile};

/// How the samples of a raster are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Encoding {
    /// Portable Network Graphics, 8 or 16 bits a channel, big-endian.
    Png,
    /// OpenEXR scan lines, one 32-bit float channel `Y`.
    Exr,
    /// OpenEXR with one channel thrice, as R, G and B, for readers that know no other.
    ExrRgb,
    /// Bare 16-bit samples, little-endian, with a JSON sidecar.
    R16,
    /// Bare 16-bit samples under the name that engines ask for, without a sidecar.
    Raw,
    /// GeoTIFF in the order of the cloud: tiles, with smaller copies before them.
    GeoTiff,
}

/// Pixels a side of a PNG at most: the format allows 2^31 - 1, and libpng, by which nearly all programs read it, refuses more than
/// these.
pub(in crate::export) const MOST_PNG: u64 = 1_000_000;

impl Encoding {
    /// The ending of the file's name.
    pub fn extension(self) -> &'static str {
        match self {
            Encoding::Png => "png",
            Encoding::Exr | Encoding::ExrRgb => "exr",
            Encoding::R16 => "r16",
            Encoding::Raw => "raw",
            Encoding::GeoTiff => "tif",
        }
    }

    /// The most samples that it can hold from west to east, and as many from north to south.
    pub fn max_side(self) -> u64 {
        match self {
            Encoding::Png => MOST_PNG,
            // The data window of EXR has signed corners of 32 bits.
            Encoding::Exr | Encoding::ExrRgb | Encoding::GeoTiff => i32::MAX as u64,
            Encoding::R16 | Encoding::Raw => u64::MAX,
        }
    }

    /// How often each sample is written.
    pub fn copies(self) -> u64 {
        self.exr_channels().len().max(1) as u64
    }

    /// The channels of an OpenEXR file, in the order in which it has them; none in other files.
    fn exr_channels(self) -> &'static [&'static str] {
        match self {
            Encoding::Exr => &["Y"],
            Encoding::ExrRgb => &["B", "G", "R"],
            Encoding::Png | Encoding::R16 | Encoding::Raw | Encoding::GeoTiff => &[],
        }
    }
}

/// The samples of one pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sample {
    /// One channel of 8 bits.
    Grey8,
    /// One of 16 bits.
    Grey16,
    /// Three of 8 bits.
    Rgb8,
    /// Four of 8 bits.
    Rgba8,
    /// One of 32-bit floats.
    Float32,
}

impl Sample {
    /// Bytes of a pixel.
    pub fn bytes(self) -> usize {
        match self {
            Sample::Grey8 => 1,
            Sample::Grey16 => 2,
            Sample::Rgb8 => 3,
            Sample::Rgba8 | Sample::Float32 => 4,
        }
    }

    /// Whether a pixel is one number.
    pub fn is_grey(self) -> bool {
        matches!(self, Sample::Grey8 | Sample::Grey16 | Sample::Float32)
    }
}

/// What a raster file is to hold.
pub(crate) struct Form<'a> {
    pub encoding: Encoding,
    pub sample: Sample,
    /// Pixels from west to east and from north to south, as many as the encoding can hold.
    pub size: (u64, u64),
    /// Its name where layers have names.
    pub layer: &'a str,
    /// Whether it has colours for the eye; all other rasters are data.
    pub is_colour: bool,
    /// What it says of itself.
    pub facts: &'a Facts,
}

/// A raster file under way.
pub(crate) enum RasterWriter {
    Png { file: SharedFile, stream: Box<png::StreamWriter<'static, SharedFile>> },
    Exr(Box<ExrWriter>),
    Bare(Box<PartFile>),
}

impl RasterWriter {
    /// Begins a raster.
    pub fn create(path: PathBuf, form: &Form) -> Result<RasterWriter, Error> {
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
                let file = SharedFile(Arc::new(Mutex::new(Some(file))));
                let size = (narrow(width), narrow(height));
                let stream = png_writer(file.clone(), form.sample, size, form.is_colour, form.facts)
                    // Chunks of a quarter of a mebibyte: each has a header and a checksum, and is a write.
                    .and_then(|writer| writer.into_stream_writer_with_size(1 << 18))
                    .map_err(png_error(&path))?;
                Ok(RasterWriter::Png { file, stream: Box::new(stream) })
            }
            Encoding::GeoTiff => {
                unreachable!("it is not written from the north to the south, and has a sink of its own")
            }
        }
    }

    /// Appends whole rows.
    pub fn write_rows(&mut self, rows: &[u8]) -> Result<(), Error> {
        match self {
            RasterWriter::Png { file, stream } => stream.write_all(rows).map_err(|error| Error::io(file.path())(error)),
            RasterWriter::Exr(writer) => writer.write_rows(rows),
            RasterWriter::Bare(file) => file.write_all(rows).map_err(Error::io(file.path())),
        }
    }

    /// Ends the file, which must have all its rows.
    pub fn finish(self) -> Result<Finished, Error> {
        match self {
            RasterWriter::Png { file, stream } => {
                let path = file.path();
                stream.finish().map_err(png_error(&path))?;
                file.take().finish()
            }
            RasterWriter::Exr(writer) => writer.finish(),
            RasterWriter::Bare(file) => file.finish(),
        }
    }
}

/// A whole PNG in memory.
pub fn png_bytes(sample: Sample, size: (u32, u32), srgb: bool, rows: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut write = || {
        let mut writer = png_writer(&mut bytes, sample, size, srgb, &Facts::default())?;
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
    facts: &Facts,
) -> Result<png::Writer<W>, png::EncodingError> {
    let mut encoder = png::Encoder::new(file, width, height);
    let (colour, depth) = match sample {
        Sample::Grey8 => (png::ColorType::Grayscale, png::BitDepth::Eight),
        Sample::Grey16 => (png::ColorType::Grayscale, png::BitDepth::Sixteen),
        Sample::Rgb8 => (png::ColorType::Rgb, png::BitDepth::Eight),
        Sample::Rgba8 => (png::ColorType::Rgba, png::BitDepth::Eight),
        Sample::Float32 => unreachable!("PNG has no floats, and no export asks for them"),
    };
    encoder.set_color(colour);
    encoder.set_depth(depth);
    if srgb {
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    }
    // The fastest setting keeps the encoders behind the noise; on terrain a fixed filter beats the adaptive one.
    encoder.set_compression(png::Compression::Fast);
    encoder.set_filter(png::Filter::Up);
    for (keyword, text) in facts.texts() {
        // The plain kind, which more programs show, has the letters of western Europe alone.
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

/// A file that the PNG stream writes to and that is still ours when the stream has ended.
#[derive(Clone)]
pub(crate) struct SharedFile(Arc<Mutex<Option<PartFile>>>);

impl SharedFile {
    fn path(&self) -> PathBuf {
        locked(&self.0).as_ref().expect("the file is taken last").path().to_owned()
    }

    fn take(self) -> PartFile {
        locked(&self.0).take().expect("the file is taken once")
    }
}

impl Write for SharedFile {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        locked(&self.0).as_mut().expect("the file is taken last").write(bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        locked(&self.0).as_mut().expect("the file is taken last").flush()
    }
}
