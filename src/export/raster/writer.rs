//! Writers of whole rasters, fed row by row: a raster is never held.

use std::io::{Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;

use exr::block::UncompressedBlock;
use exr::block::writer::ChunksWriter;
use exr::compression::Compression;
use exr::meta::BlockDescription;
use exr::meta::attribute::{ChannelDescription, LineOrder, SampleType};
use exr::meta::header::Header;
use exr::prelude::SmallVec;

use crate::error::Error;
use crate::export::locked;
use crate::file::{Finished, Operation, PartFile, gate};

/// How the samples of a raster are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Encoding {
    /// Portable Network Graphics, 8 or 16 bits a channel, big-endian.
    Png,
    /// OpenEXR scan lines, one 32-bit float channel `Y`, not compressed: float terrain hardly shrinks.
    Exr,
    /// OpenEXR with one channel thrice, as R, G and B, for readers that know no other.
    ExrRgb,
    /// Bare 16-bit samples, little-endian, with a JSON sidecar.
    R16,
    /// Bare 16-bit samples under the name that engines ask for, without a sidecar.
    Raw,
}

impl Encoding {
    /// The ending of the file's name.
    pub fn extension(self) -> &'static str {
        match self {
            Encoding::Png => "png",
            Encoding::Exr | Encoding::ExrRgb => "exr",
            Encoding::R16 => "r16",
            Encoding::Raw => "raw",
        }
    }

    /// The most samples that it can hold from west to east, and as many from north to south.
    pub fn max_side(self) -> u64 {
        match self {
            // PNG allows 2^31 - 1; the data window of EXR has signed corners of 32 bits.
            Encoding::Png | Encoding::Exr | Encoding::ExrRgb => i32::MAX as u64,
            Encoding::R16 | Encoding::Raw => u64::MAX,
        }
    }

    /// Whether a JSON file beside it says what it does not say itself.
    pub fn has_sidecar(self) -> bool {
        self == Encoding::R16
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
            Encoding::Png | Encoding::R16 | Encoding::Raw => &[],
        }
    }
}

/// The samples of one pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Sample {
    Grey8,
    Grey16,
    Rgb8,
    Rgba8,
    Float32,
}

impl Sample {
    pub fn bytes(self) -> usize {
        match self {
            Sample::Grey8 => 1,
            Sample::Grey16 => 2,
            Sample::Rgb8 => 3,
            Sample::Rgba8 | Sample::Float32 => 4,
        }
    }
}

/// A raster file under way.
pub(crate) enum RasterWriter {
    Png { file: SharedFile, stream: Box<png::StreamWriter<'static, SharedFile>> },
    Exr(ExrWriter),
    Bare(Box<PartFile>),
}

impl RasterWriter {
    /// Begins a raster of `width` x `height` pixels, which the encoding can hold. `layer` names it where layers have
    /// names; `srgb` marks colours for the eye; all other rasters are data.
    pub fn create(
        path: PathBuf,
        layer: &'static str,
        encoding: Encoding,
        sample: Sample,
        (width, height): (u64, u64),
        srgb: bool,
    ) -> Result<RasterWriter, Error> {
        let fits = "the plan has checked the size";
        let file = PartFile::create(path.clone())?;
        match encoding {
            Encoding::R16 | Encoding::Raw => Ok(RasterWriter::Bare(Box::new(file))),
            Encoding::Exr | Encoding::ExrRgb => Ok(RasterWriter::Exr(ExrWriter::start(
                file,
                layer,
                encoding.exr_channels(),
                width.try_into().expect(fits),
                height.try_into().expect(fits),
            )?)),
            Encoding::Png => {
                let file = SharedFile(Arc::new(Mutex::new(Some(file))));
                let size = (width.try_into().expect(fits), height.try_into().expect(fits));
                let stream = png_writer(file.clone(), sample, size, srgb)
                    // Chunks of a quarter of a mebibyte: each has a header and a checksum, and is a write.
                    .and_then(|writer| writer.into_stream_writer_with_size(1 << 18))
                    .map_err(png_error(&path))?;
                Ok(RasterWriter::Png { file, stream: Box::new(stream) })
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
pub(crate) fn png_bytes(sample: Sample, size: (u32, u32), srgb: bool, rows: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut write = || {
        let mut writer = png_writer(&mut bytes, sample, size, srgb)?;
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

/// An EXR file under way. The library asks for its blocks, we are given rows: a thread of its own turns one into the
/// other, at most two batches of rows behind.
pub(crate) struct ExrWriter {
    path: PathBuf,
    rows: Option<SyncSender<Vec<u8>>>,
    thread: Option<JoinHandle<Result<(), exr::error::Error>>>,
    file: SharedFile,
}

impl ExrWriter {
    fn start(
        file: PartFile,
        layer: &'static str,
        channels: &'static [&'static str],
        width: usize,
        height: usize,
    ) -> Result<ExrWriter, Error> {
        let path = file.path().to_owned();
        let shared = SharedFile(Arc::new(Mutex::new(Some(file))));
        let (rows, incoming) = sync_channel(2);
        // Ours too, for the writer drops its own when it is done.
        let target = shared.clone();
        gate(Operation::Thread, &path)?;
        let write = move || write_exr(target, layer, channels, (width, height), incoming);
        let thread = std::thread::Builder::new().spawn(write).map_err(Error::io(&path))?;
        Ok(ExrWriter { path, rows: Some(rows), thread: Some(thread), file: shared })
    }

    fn write_rows(&mut self, rows: &[u8]) -> Result<(), Error> {
        let sender = self.rows.as_ref().expect("rows come before the end");
        // A closed channel means that the thread has ended with an error; joining it says which.
        if sender.send(rows.to_vec()).is_err() { self.join() } else { Ok(()) }
    }

    fn join(&mut self) -> Result<(), Error> {
        // Closed: the thread's loop over rows ends.
        self.rows = None;
        let Some(thread) = self.thread.take() else { return Ok(()) };
        let result = thread.join().expect("the EXR thread does not panic");
        result.map_err(|error| Error::Io {
            path: self.path.clone(),
            source: match error {
                exr::error::Error::Io(error) => error,
                other => std::io::Error::other(other),
            },
        })
    }

    fn finish(mut self) -> Result<Finished, Error> {
        self.join()?;
        self.file.clone().take().finish()
    }
}

impl Drop for ExrWriter {
    /// Waits for the thread, which holds the file, so that an abandoned one is gone before the program is.
    fn drop(&mut self) {
        _ = self.join();
    }
}

impl Seek for SharedFile {
    fn seek(&mut self, to: SeekFrom) -> std::io::Result<u64> {
        locked(&self.0).as_mut().expect("the file is taken last").seek(to)
    }
}

/// Writes an EXR file from rows of native floats as they come in.
fn write_exr(
    file: SharedFile,
    layer: &str,
    channels: &[&str],
    (width, height): (usize, usize),
    rows: Receiver<Vec<u8>>,
) -> exr::error::UnitResult {
    let described = channels.iter().map(|name| ChannelDescription::named(*name, SampleType::F32)).collect();
    let header = Header::new(layer.into(), (width, height), SmallVec::from_vec(described)).with_encoding(
        Compression::Uncompressed,
        BlockDescription::ScanLines,
        LineOrder::Increasing,
    );
    exr::block::write(file, SmallVec::from_vec(vec![header]), true, |meta, chunks| {
        let mut blocks = meta.enumerate_ordered_header_block_indices();
        let mut compressor = chunks.sequential_blocks_compressor(&meta);
        for rows in rows {
            for row in rows.chunks_exact(width * size_of::<f32>()) {
                // An uncompressed block is one scan line, and has one channel after the other.
                let (index_in_header, index) = blocks.next().expect("no more rows than the raster has");
                compressor
                    .compress_block(index_in_header, UncompressedBlock { index, data: row.repeat(channels.len()) })?;
            }
        }
        // After a bake that stopped early, blocks are missing; the file is dropped, and the library's complaint too.
        Ok(())
    })
}
