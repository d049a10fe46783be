//! Reduction of a raster to half its width and height, for overviews.

use crate::export::formats::raster::writer::Sample;

/// The rule by which a square of four pixels becomes one pixel of a raster of half the width and height.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Reduction {
    Mean,
    Greatest,
    /// The value that most of the four pixels have, or the greatest of several that are equally common.
    Commonest,
}

impl Reduction {
    /// Reduces two rows to one. If their width is odd, the last pixel is paired with itself.
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
