//! A fractal as wanted: how many octaves, how long, and how they are added up.

/// How octaves are added up.
///
/// Based on: F. K. Musgrave in Ebert et al., Texturing and Modeling: A Procedural Approach. The noise of an octave is within -1
/// and 1, and its amplitude is `lacunarity^(-h octave)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FractalKind {
    /// Fractal Brownian motion: the sum of `noise amplitude`.
    Fbm,
    /// Ridged multifractal: the sum of `signal amplitude`, with `signal = (offset - |noise|)^2 weight`; the weight is one at
    /// first, and then `clamp(gain signal, 0, 1)` of the signal before. Gain is 0, or from 10^-6 to 10^6.
    Ridged {
        /// Height of a ridge. The thesis: 1.
        offset: f64,
        /// How fast rough ground grows rougher. The thesis: 2.
        gain: f64,
    },
    /// Hybrid multifractal: the sum of `weight signal`, with `signal = (noise + offset) amplitude`; the weight is one at first,
    /// and then `min(weight signal, 1)` of the octave before. Valleys are smooth.
    Hybrid {
        /// Lifts the noise above zero. Musgrave: 0.7.
        offset: f64,
    },
    /// Heterogeneous terrain: `noise + offset` at first, and then each octave adds `(noise + offset) amplitude` times the
    /// value so far. Low ground is smooth.
    Hetero {
        /// Lifts the noise above zero. Musgrave: 0.7 to 1.
        offset: f64,
    },
}

impl FractalKind {
    /// What lifts the noise, zero where nothing does.
    pub(super) fn offset(self) -> f64 {
        match self {
            FractalKind::Fbm => 0.0,
            FractalKind::Ridged { offset, .. } | FractalKind::Hybrid { offset } | FractalKind::Hetero { offset } => {
                offset
            }
        }
    }
}

/// A fractal as wanted.
#[derive(Clone, Debug, PartialEq)]
pub struct FractalSpec {
    /// How octaves are added up.
    pub kind: FractalKind,
    /// How many octaves, at least one. The thesis: 8.
    pub octaves: u32,
    /// Wavelength of octave 0, in metres. The thesis: 1400.
    pub wavelength_m: f64,
    /// How many times shorter the waves of each further octave are, at least 1. The thesis: 2.5.
    pub lacunarity: f64,
    /// The fractal increment: octave i has the amplitude `lacunarity^(-h i)`. The thesis: 2.
    pub h: f64,
}
