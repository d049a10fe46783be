//! Specifications of fractals: number and length of octaves, and the rule that adds them up.

/// The rule by which octaves are added up.
///
/// Based on: F. K. Musgrave in Ebert et al., Texturing and Modeling: A Procedural Approach. The noise of an octave is
/// within -1 and 1, and its amplitude is `lacunarity^(-h octave)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FractalKind {
    /// Fractal Brownian motion: the sum of `noise amplitude`.
    Fbm,
    /// Ridged multifractal: the sum of `signal amplitude`, with `signal = (offset - |noise|)^2 weight`. The weight is 1
    /// in the first octave, and then `clamp(gain signal, 0, 1)` with the signal of the octave before. Gain is 0, or
    /// from 10^-6 to 10^6.
    Ridged {
        /// Height of a ridge. The thesis: 1.
        offset: f64,
        /// Rate at which rough ground grows rougher. The thesis: 2.
        gain: f64,
    },
    /// Hybrid multifractal: the sum of `weight signal`, with `signal = (noise + offset) amplitude`. The weight is 1 in
    /// the first octave, and then `min(weight signal, 1)` of the octave before. Valleys are smooth.
    Hybrid {
        /// Lifts the noise above zero. Musgrave: 0.7.
        offset: f64,
    },
    /// Heterogeneous terrain: `noise + offset` in the first octave; each further octave adds
    /// `(noise + offset) amplitude` times the value so far. Low ground is smooth.
    Hetero {
        /// Lifts the noise above zero. Musgrave: 0.7 to 1.
        offset: f64,
    },
}

impl FractalKind {
    /// Returns the offset that lifts the noise, 0 for kinds without one.
    pub(super) fn offset(self) -> f64 {
        match self {
            FractalKind::Fbm => 0.0,
            FractalKind::Ridged { offset, .. } | FractalKind::Hybrid { offset } | FractalKind::Hetero { offset } => {
                offset
            }
        }
    }
}

/// The specification of a fractal.
#[derive(Clone, Debug, PartialEq)]
pub struct FractalSpec {
    /// The rule by which octaves are added up.
    pub kind: FractalKind,
    /// Number of octaves, at least one. The thesis: 8.
    pub octaves: u32,
    /// Wavelength of octave 0, in metres. The thesis: 1400.
    pub wavelength_m: f64,
    /// Ratio of an octave's wavelength to that of the next octave, at least 1. The thesis: 2.5.
    pub lacunarity: f64,
    /// The fractal increment: octave i has the amplitude `lacunarity^(-h i)`. The thesis: 2.
    pub h: f64,
}
