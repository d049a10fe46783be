//! OpenEXR: scan lines of 32-bit floats, not compressed, since float terrain hardly shrinks.
//!
//! Without compression the offset of each line is known before the line is written. A file is a header, a table of the
//! offsets, and the lines. Based on: The OpenEXR File Layout, openexr.com, version 2 of the format. terrane has its own
//! writer, because the Rust crate for OpenEXR writes attributes in a different order each time, but the same bake must
//! give the same bytes.

use std::io::Write;

use crate::error::Error;
use crate::export::formats::raster::facts::{Fact, Facts};
use crate::file::{Finished, PartFile};

/// Greatest length in bytes of an attribute's name that every reader accepts.
const MAX_NAME: usize = 31;

/// An OpenEXR file that is being written.
pub(crate) struct ExrWriter {
    file: PartFile,
    width: usize,
    /// Number of channels. All hold the same samples, so each row is written this many times.
    channels: usize,
    /// Number of lines that are written already.
    lines: u32,
}

impl ExrWriter {
    /// Begins a file, and writes its header and the table of offsets. `layer` is the name in the file. `channels` are
    /// in alphabetical order, and all hold the same samples.
    pub fn start(
        file: PartFile,
        layer: &str,
        channels: &[&str],
        (width, height): (u32, u32),
        facts: &Facts,
    ) -> Result<ExrWriter, Error> {
        let mut writer = ExrWriter { file, width: width as usize, channels: channels.len(), lines: 0 };
        let mut head = header(layer, channels, (width, height), facts);
        let first = head.len() as u64 + 8 * u64::from(height);
        // Before each line stand its number and its length in bytes.
        let line_bytes = 8 + 4 * u64::from(width) * channels.len() as u64;
        for line in 0..u64::from(height) {
            head.extend((first + line * line_bytes).to_le_bytes());
        }
        writer.write(&head)?;
        Ok(writer)
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), Error> {
        self.file.write_all(bytes).map_err(Error::io(self.file.path()))
    }

    /// Appends complete rows of little-endian floats.
    pub fn write_rows(&mut self, rows: &[u8]) -> Result<(), Error> {
        let bytes = 4 * self.width;
        for row in rows.chunks_exact(bytes) {
            self.write(&[self.lines, (bytes * self.channels) as u32].map(u32::to_le_bytes).concat())?;
            for _ in 0..self.channels {
                self.write(row)?;
            }
            self.lines += 1;
        }
        Ok(())
    }

    /// Ends the file. All its rows must have been written.
    pub fn finish(self) -> Result<Finished, Error> {
        self.file.finish()
    }
}

fn header(layer: &str, channels: &[&str], (width, height): (u32, u32), facts: &Facts) -> Vec<u8> {
    // The magic number, and version 2 without flags: scan lines, names of at most 31 bytes, and one part.
    let mut head = vec![0x76, 0x2F, 0x31, 0x01, 2, 0, 0, 0];
    let mut attribute = |name: &str, kind: &str, value: &[u8]| {
        debug_assert!(name.len() <= MAX_NAME, "{name}");
        for text in [name, kind] {
            head.extend(text.as_bytes());
            head.push(0);
        }
        head.extend((value.len() as u32).to_le_bytes());
        head.extend(value);
    };
    let mut list = Vec::new();
    for channel in channels {
        list.extend(channel.as_bytes());
        list.push(0);
        // 2 is the type of 32-bit floats. Then pLinear (0) with its reserved bytes, and the sampling in x and y: every
        // pixel.
        list.extend([2_u32, 0, 1, 1].map(u32::to_le_bytes).as_flattened());
    }
    list.push(0);
    let window = [0, 0, width - 1, height - 1].map(u32::to_le_bytes).concat();
    let one = 1_f32.to_le_bytes();
    attribute("channels", "chlist", &list);
    attribute("compression", "compression", &[0]);
    attribute("dataWindow", "box2i", &window);
    attribute("displayWindow", "box2i", &window);
    attribute("lineOrder", "lineOrder", &[0]);
    attribute("pixelAspectRatio", "float", &one);
    attribute("screenWindowCenter", "v2f", &[0; 8]);
    attribute("screenWindowWidth", "float", &one);
    attribute("name", "string", layer.as_bytes());
    for (key, fact) in &facts.0 {
        // The names of these attributes in the OpenEXR standard and its tools.
        let key = match *key {
            "Description" => "comments",
            "Software" => "software",
            "Title" => "title",
            other => other,
        };
        match fact {
            Fact::Text(text) => attribute(key, "string", text.as_bytes()),
            Fact::Number(number) => attribute(key, "double", &number.to_le_bytes()),
            Fact::Pair(pair) => attribute(key, "v2d", pair.map(f64::to_le_bytes).as_flattened()),
        }
    }
    head.push(0);
    head
}
