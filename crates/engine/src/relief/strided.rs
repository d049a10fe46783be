//! Fractals at the nodes of a stride: they keep the octaves that the nodes can show, and replace the others by their
//! mean.
//!
//! The contribution of an octave may depend on the octaves before it, and its mean need not be zero. So the mean of the
//! whole fractal, given the kept octaves, is found by sampling: both are computed at places far from each other, and a
//! straight line is fitted to the pairs (linear regression).

use crate::area::{Area, Stride};
use crate::hash;
use crate::noise::{Fractal, FractalSpec};
#[cfg(feature = "gpu")]
use crate::relief::gpu_words::MeanWords;
#[cfg(feature = "gpu")]
use crate::wgsl::push;

/// Shortest wavelength, in nodes, of an octave that is kept.
const LEAST_WAVE: f64 = 2.0;

/// Number of sample places: so many that the error of the mean is about a hundredth of the spread of heights.
const PLACES: u64 = 4096;

/// A fractal at the nodes of a stride.
#[derive(Clone, Debug)]
pub(super) struct StridedFractal {
    /// The kept octaves; `None` if no octave is kept.
    shown: Option<Fractal>,
    /// Map from the kept octaves to the mean of the whole fractal; `None` if all octaves are kept.
    mean: Option<Mean>,
    bounds: (f32, f32),
}

/// The linear map `value * scale + shift`.
#[derive(Clone, Copy, Debug)]
struct Mean {
    scale: f32,
    shift: f32,
}

impl StridedFractal {
    /// Makes the fractal at the nodes of a stride, on a lattice with this spacing of vertices.
    pub fn new(spec: &FractalSpec, spacing_m: f64, stride: Stride, seed: u64) -> StridedFractal {
        let whole = Fractal::new(spec, spacing_m, seed);
        let (bounds, node_m) = (whole.bounds(), spacing_m * stride.vertices() as f64);
        let is_shown =
            |octave: &u32| spec.wavelength_m * libm::pow(spec.lacunarity, -f64::from(*octave)) >= LEAST_WAVE * node_m;
        let octaves = (0..spec.octaves).take_while(is_shown).count() as u32;
        if stride == Stride::ONE || octaves == spec.octaves {
            return StridedFractal { shown: Some(Fractal::new(spec, node_m, seed)), mean: None, bounds };
        }
        let spec = FractalSpec { octaves, ..spec.clone() };
        let coarse = (octaves > 0).then(|| Fractal::new(&spec, spacing_m, seed));
        let mean = Some(Mean::new(&whole, coarse.as_ref(), seed));
        StridedFractal { shown: (octaves > 0).then(|| Fractal::new(&spec, node_m, seed)), mean, bounds }
    }

    /// Wraps a fractal of which all octaves are kept, or the constant zero for `None`.
    #[cfg(feature = "gpu")]
    pub fn of(fractal: Option<Fractal>) -> StridedFractal {
        let bounds = fractal.as_ref().map_or((0.0, 0.0), Fractal::bounds);
        StridedFractal { shown: fractal, mean: None, bounds }
    }

    /// Returns the bounds of the whole fractal, which also hold for the replacement by the mean.
    pub fn bounds(&self) -> (f32, f32) {
        self.bounds
    }

    /// Packs the fractal, with the mean before its octaves, and adds the number of words per block to `block_words`.
    #[cfg(feature = "gpu")]
    pub fn pack(&self, is_warped: bool, words: &mut Vec<u32>, block_words: &mut usize) {
        let Mean { scale, shift } = self.mean.unwrap_or(Mean { scale: 1.0, shift: 0.0 });
        let (low, high) = self.bounds;
        push(words, MeanWords { is_meant: self.mean.is_some().into(), scale, shift, low, high });
        match &self.shown {
            Some(fractal) => fractal.pack(is_warped, words, block_words),
            // No octaves.
            None => push(words, [0; 2]),
        }
    }

    /// Adds the words of the block that begins at vertex `first`.
    #[cfg(feature = "gpu")]
    pub fn pack_block(&self, is_warped: bool, first: (i64, i64), words: &mut Vec<u32>) {
        if let Some(fractal) = &self.shown {
            fractal.pack_block(is_warped, first, words);
        }
    }

    /// Computes the values at the nodes of an area into `out`, at positions displaced by metres if `displaced` is
    /// given.
    pub fn fill(&self, area: Area, displaced: Option<[&[f32]; 2]>, out: &mut [f32]) {
        match &self.shown {
            Some(fractal) => fractal.fill(area, displaced, out),
            None => out.fill(0.0),
        }
        let Some(Mean { scale, shift }) = self.mean else { return };
        let (low, high) = self.bounds;
        for value in out {
            *value = (*value * scale + shift).clamp(low, high);
        }
    }
}

impl Mean {
    /// Fits the mean of the whole fractal as a linear function of the octaves that are left.
    fn new(whole: &Fractal, left: Option<&Fractal>, seed: u64) -> Mean {
        let mut pairs = Vec::with_capacity(PLACES as usize);
        for place in 0..PLACES {
            // Near enough to the origin that positions are exact.
            let [x, y] = [0, 1].map(|axis| (hash::combine(seed, 2 * place + axis) >> 40) as i64);
            let at = Area::new(x, y, 1, 1);
            let value = |fractal: &Fractal| {
                let mut value = [0.0];
                fractal.fill(at, None, &mut value);
                f64::from(value[0])
            };
            pairs.push([left.map_or(0.0, value), value(whole)]);
        }
        let mean = |of: &dyn Fn(&[f64; 2]) -> f64| pairs.iter().map(of).sum::<f64>() / PLACES as f64;
        let means = [mean(&|pair| pair[0]), mean(&|pair| pair[1])];
        let variance = mean(&|pair| (pair[0] - means[0]) * (pair[0] - means[0]));
        let covariance = mean(&|pair| (pair[0] - means[0]) * (pair[1] - means[1]));
        let scale = if variance > 0.0 { covariance / variance } else { 0.0 };
        Mean { scale: scale as f32, shift: (means[1] - scale * means[0]) as f32 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::FractalKind;

    #[test]
    fn what_is_left_out_is_there_in_the_mean() {
        let kinds = [
            FractalKind::Fbm,
            FractalKind::Ridged { offset: 1.0, gain: 2.0 },
            FractalKind::Hybrid { offset: 0.7 },
            FractalKind::Hetero { offset: 0.7 },
        ];
        for kind in kinds {
            let spec = FractalSpec { kind, octaves: 6, wavelength_m: 1400.0, lacunarity: 2.0, h: 0.8 };
            let at = |power: u32| {
                let stride = Stride::new(1 << power).unwrap();
                let mut values = vec![0.0; (256 * 256) >> (2 * power)];
                let side = 256 >> power;
                StridedFractal::new(&spec, 10.0, stride, 7).fill(
                    Area::new(3 * side as i64, 0, side, side),
                    None,
                    &mut values,
                );
                values
            };
            let whole = at(0);
            let spread = |values: &[f32]| {
                let mean = values.iter().sum::<f32>() / values.len() as f32;
                (mean, (values.iter().map(|value| (value - mean).powi(2)).sum::<f32>() / values.len() as f32).sqrt())
            };
            let (mean, deviation) = spread(&whole);
            for power in 1..=5 {
                let (strided, _) = spread(&at(power));
                assert!((strided - mean).abs() < 0.08 * deviation, "{kind:?} 2^{power}: {strided} and not {mean}");
            }
        }
    }
}
