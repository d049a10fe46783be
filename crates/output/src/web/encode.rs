//! The encodings of tiles: pictures, heights as colours, heights as a script.

use std::io::Write;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use image_webp::{ColorType, WebPEncoder};

/// Image format of the pictures of tiles; both formats are lossless.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TileEncoding {
    /// WebP, which makes smaller files.
    WebP,
    /// PNG, which every program reads.
    Png,
}

impl TileEncoding {
    /// Extension of a file's name, which is also the name of the format in MBTiles.
    pub fn ending(self) -> &'static str {
        match self {
            TileEncoding::WebP => "webp",
            TileEncoding::Png => "png",
        }
    }

    /// Encodes a square picture from its pixels: RGB, rows from the north.
    pub fn encode(self, side: u32, rgb: &[u8]) -> Vec<u8> {
        let mut bytes = Vec::new();
        match self {
            TileEncoding::WebP => WebPEncoder::new(&mut bytes)
                .encode(rgb, side, side, ColorType::Rgb8)
                .expect("memory takes everything, and WebP holds squares of this size"),
            TileEncoding::Png => {
                png(&mut bytes, side, rgb).expect("memory takes everything, and the rows are a square's");
            }
        }
        bytes
    }
}

fn png(bytes: &mut Vec<u8>, side: u32, rgb: &[u8]) -> Result<(), png::EncodingError> {
    let mut encoder = png::Encoder::new(bytes, side, side);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Balanced);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(rgb)?;
    writer.finish()
}

/// Height in metres at which terrain-RGB begins, and its steps per metre.
const LOWEST_M: f64 = -10_000.0;
const STEPS_A_METRE: f64 = 10.0;

/// Returns the colour of a height in Mapbox's terrain-RGB, to a tenth of a metre.
///
/// Heights range from -10,000 m to 1,667,721.5 m; others become the nearest of these, and NaN the lowest.
///
/// Based on: Mapbox, "Access elevation data": `height = -10000 + (R * 65536 + G * 256 + B) * 0.1`.
pub fn terrain_rgb(height_m: f32) -> [u8; 3] {
    // Count tenths as whole numbers in f64: a tenth has no exact float, but all multiples that an f32 can tell apart
    // are counted.
    let steps = ((height_m as f64 - LOWEST_M) * STEPS_A_METRE).round().clamp(0.0, 16_777_215.0);
    let [_, red, green, blue] = (steps as u32).to_be_bytes();
    [red, green, blue]
}

/// Returns the height in metres that a colour of terrain-RGB stands for.
pub fn terrain_height_m([red, green, blue]: [u8; 3]) -> f64 {
    LOWEST_M + f64::from(u32::from_be_bytes([0, red, green, blue])) / STEPS_A_METRE
}

/// Height step in metres of the heights that the page reads. The page shows whole metres.
pub const HEIGHT_STEP_M: f32 = 0.5;

/// Encodes heights as text for a script: height steps as differences from the western neighbour, compressed, in base64.
///
/// The first height of a row is a difference from the first of the row before, and the very first from zero. A
/// difference is a zigzag number with seven bits per byte, lowest first; all bytes are compressed with zlib. Heights
/// come to the page as scripts, because a page opened from the disk may run scripts beside it but may not read the
/// pixels of pictures beside it.
pub fn height_text(heights_m: &[f32], width: usize) -> String {
    let mut numbers = Vec::with_capacity(2 * heights_m.len());
    let mut first = 0;
    for row in heights_m.chunks(width) {
        let mut last = first;
        for (index, height_m) in row.iter().enumerate() {
            let steps = (height_m / HEIGHT_STEP_M).round() as i32;
            push_zigzag(&mut numbers, steps.wrapping_sub(last));
            last = steps;
            if index == 0 {
                first = steps;
            }
        }
    }
    let mut packed = ZlibEncoder::new(Vec::new(), Compression::default());
    let packed = packed.write_all(&numbers).and_then(|()| packed.finish()).expect("memory takes everything");
    STANDARD.encode(packed)
}

fn push_zigzag(bytes: &mut Vec<u8>, number: i32) {
    let mut rest = ((number << 1) ^ (number >> 31)) as u32;
    while rest >= 0x80 {
        bytes.push(rest as u8 | 0x80);
        rest >>= 7;
    }
    bytes.push(rest as u8);
}

#[cfg(test)]
mod tests {
    use std::io::Read;

    use flate2::read::ZlibDecoder;

    use super::*;

    #[test]
    fn a_colour_is_a_height_to_a_tenth_of_a_metre() {
        // Mapbox's own examples: sea level is (1, 134, 160), and the lowest height is (0, 0, 0).
        assert_eq!((terrain_rgb(0.0), terrain_rgb(-10_000.0)), ([1, 134, 160], [0, 0, 0]));
        for tenth in -100_000..100_000 {
            let height_m = tenth as f32 / 10.0;
            let error_m = terrain_height_m(terrain_rgb(height_m)) - f64::from(tenth) / 10.0;
            assert!(error_m.abs() < 1e-9, "{height_m} m");
        }
        assert!((terrain_height_m(terrain_rgb(8848.86)) - 8848.9).abs() < 1e-9);
        assert_eq!((terrain_rgb(-1e9), terrain_rgb(1e9), terrain_rgb(f32::NAN)), ([0; 3], [255; 3], [0; 3]));
    }

    #[test]
    fn pictures_lose_nothing() {
        let rgb: Vec<u8> = (0..32_u32 * 32 * 3).map(|index| (index * index / 7) as u8).collect();
        let webp = TileEncoding::WebP.encode(32, &rgb);
        let mut decoder = image_webp::WebPDecoder::new(std::io::Cursor::new(webp)).unwrap();
        let mut decoded = vec![0; decoder.output_buffer_size().unwrap()];
        decoder.read_image(&mut decoded).unwrap();
        assert!(decoded == rgb);
        let png = TileEncoding::Png.encode(32, &rgb);
        let mut reader = png::Decoder::new(std::io::Cursor::new(png)).read_info().unwrap();
        decoded.fill(0);
        reader.next_frame(&mut decoded).unwrap();
        assert!(decoded == rgb);
    }

    #[test]
    fn heights_come_back_from_their_text() {
        let heights_m = [0.0, 1.2, -70.3, 4000.0, 4000.0, -11_000.0];
        let mut numbers = Vec::new();
        let packed = STANDARD.decode(height_text(&heights_m, 3)).unwrap();
        ZlibDecoder::new(&packed[..]).read_to_end(&mut numbers).unwrap();
        let mut numbers = numbers.into_iter();
        let mut next = || {
            let (mut number, mut shift) = (0_u32, 0);
            loop {
                let byte = numbers.next().unwrap();
                number |= u32::from(byte & 0x7F) << shift;
                shift += 7;
                if byte < 0x80 {
                    return (number >> 1) as i32 ^ -((number & 1) as i32);
                }
            }
        };
        let steps: Vec<i32> = (0..6).map(|_| next()).collect();
        assert_eq!(steps, [0, 2, -143, 8000, 0, -30_000]);
        assert_eq!(numbers.next(), None);
    }
}
