//! Statistics of a raster's samples: minimum, maximum, mean and standard deviation. GIS stretches greys by them, and
//! would have to read all samples if the file did not hold them.

use crate::export::formats::raster::writer::Sample;

/// Number of partial sums that are kept side by side, so that an addition need not wait for the one before it.
const LANES: usize = 8;

/// Statistics of the samples of one channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Statistics {
    pub min: f64,
    pub max: f64,
    count: u64,
    sum: f64,
    squares: f64,
}

impl Default for Statistics {
    /// Returns the statistics of no samples.
    fn default() -> Statistics {
        Statistics { min: f64::INFINITY, max: f64::NEG_INFINITY, count: 0, sum: 0.0, squares: 0.0 }
    }
}

impl Statistics {
    /// Adds a line of samples, in the bytes that writers take.
    ///
    /// # Panics
    /// When the samples have more than one channel.
    pub fn add(&mut self, line: &[u8], sample: Sample) {
        match sample {
            Sample::Grey8 => self.add_all(line.iter().map(|grey| f64::from(*grey))),
            // Big-endian, as in a PNG.
            Sample::Grey16 => self.add_all(line.as_chunks().0.iter().map(|pair| f64::from(u16::from_be_bytes(*pair)))),
            Sample::Float32 => {
                let values = line.as_chunks().0.iter().map(|word| f64::from(f32::from_le_bytes(*word)));
                // NaN marks pixels without data, which do not count.
                match values.clone().any(f64::is_nan) {
                    true => self.add_all(values.filter(|value| !value.is_nan()).collect::<Vec<_>>().into_iter()),
                    false => self.add_all(values),
                }
            }
            Sample::Rgb8 | Sample::Rgba8 => unreachable!("each channel would have its own"),
        }
    }

    fn add_all(&mut self, samples: impl ExactSizeIterator<Item = f64>) {
        let (mut least, mut greatest) = ([f64::INFINITY; LANES], [f64::NEG_INFINITY; LANES]);
        let (mut sums, mut squares) = ([0.0; LANES], [0.0; LANES]);
        self.count += samples.len() as u64;
        // Samples are always added in the same order, so the sums have the same bits in each bake.
        for (index, value) in samples.enumerate() {
            let lane = index % LANES;
            least[lane] = value.min(least[lane]);
            greatest[lane] = value.max(greatest[lane]);
            sums[lane] += value;
            squares[lane] += value * value;
        }
        self.min = least.into_iter().fold(self.min, f64::min);
        self.max = greatest.into_iter().fold(self.max, f64::max);
        self.sum += sums.iter().sum::<f64>();
        self.squares += squares.iter().sum::<f64>();
    }

    /// Returns the mean of all samples.
    pub fn mean(&self) -> f64 {
        self.sum / self.count as f64
    }

    /// Returns the standard deviation of all samples.
    pub fn deviation(&self) -> f64 {
        (self.squares / self.count as f64 - self.mean().powi(2)).max(0.0).sqrt()
    }

    /// Returns these statistics as keys and values of GDAL's metadata.
    pub fn items(&self) -> [(&'static str, f64); 4] {
        [
            ("STATISTICS_MINIMUM", self.min),
            ("STATISTICS_MAXIMUM", self.max),
            ("STATISTICS_MEAN", self.mean()),
            ("STATISTICS_STDDEV", self.deviation()),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_are_measured_whatever_their_form() {
        let mut bytes = Statistics::default();
        bytes.add(&[2, 4, 4, 4, 5], Sample::Grey8);
        bytes.add(&[5, 7, 9], Sample::Grey8);
        assert_eq!((bytes.min, bytes.max, bytes.mean(), bytes.deviation()), (2.0, 9.0, 5.0, 2.0));
        let mut words = Statistics::default();
        words.add(&[1, 0, 0, 4], Sample::Grey16);
        assert_eq!((words.min, words.max, words.mean()), (4.0, 256.0, 130.0));
        let mut floats = Statistics::default();
        floats.add([-1.5_f32, 1.5].map(f32::to_le_bytes).as_flattened(), Sample::Float32);
        assert_eq!((floats.min, floats.max, floats.mean(), floats.deviation()), (-1.5, 1.5, 0.0, 1.5));
    }
}
