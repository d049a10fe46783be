//! Settings of relief made of noise.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::noise::{Fractal, FractalKind, FractalSpec};
use crate::recipe::fault::{Fault, KeyPath};
use crate::recipe::mask::{MASK_LACUNARITY, Mask, check_octaves, default_octaves, plain};
use crate::recipe::{HEIGHT_LIMIT_M, WAVELENGTH_M};

/// One fractal noise term: `height_m * curve(fractal) + base_m`, times its mask.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NoiseTerm {
    /// Rule by which the octaves combine.
    pub kind: NoiseKind,
    /// Height in metres of one unit of noise, -100,000 to 100,000.
    #[schemars(range(min = -HEIGHT_LIMIT_M, max = HEIGHT_LIMIT_M))]
    pub height_m: f64,
    /// Metres added where the term applies, -100,000 to 100,000. Default: 0.
    #[schemars(range(min = -HEIGHT_LIMIT_M, max = HEIGHT_LIMIT_M))]
    #[serde(default)]
    pub base_m: f64,
    /// Wavelength of the first octave in metres, 0.001 to 1,000,000,000; that of the last is no less than `spacing_m`.
    /// Default: 1400.
    #[schemars(range(min = WAVELENGTH_M[0], max = WAVELENGTH_M[1]))]
    #[serde(default = "thesis_wavelength_m")]
    pub wavelength_m: f64,
    /// Octaves, 1 to 16. Default: 8.
    #[schemars(range(min = 1, max = 16))]
    #[serde(default = "thesis_octaves")]
    pub octaves: u32,
    /// Musgrave's H: octave i has the amplitude `lacunarity^(-H i)`, 0 to 4. Default: 2 for `ridged`, 0.25 for
    /// `hybrid`, else 1.
    #[schemars(range(min = 0, max = 4))]
    pub dimension: Option<f64>,
    /// Ratio of the frequencies of neighbouring octaves, 1.5 to 8. Default: 2.5.
    #[schemars(range(min = 1.5, max = 8))]
    #[serde(default = "thesis_lacunarity")]
    pub lacunarity: f64,
    /// `ridged`, `hybrid` and `hetero` only: number added to the noise (for `ridged` the absolute value of the noise is
    /// subtracted from it), 0 to 4. Default: 0.7 for `hybrid`, else 1.
    #[schemars(range(min = 0, max = 4))]
    pub offset: Option<f64>,
    /// `ridged` only: strength with which an octave's signal lets the next octave in, 0 to 16. Default: 2.
    #[schemars(range(min = 0, max = 16))]
    pub gain: Option<f64>,
    /// A piecewise linear map `[[in, out], ...]` of the fractal's value, 2 to 64 points with numbers of -1000 to 1000,
    /// constant beyond its ends. Default: the value itself.
    #[schemars(length(min = 2, max = 64), inner(inner(range(min = -1000, max = 1000))))]
    pub curve: Option<Vec<[f64; 2]>>,
    /// Mask of the area in which the term applies. Default: everywhere.
    pub mask: Option<Mask>,
}

/// Rule by which the octaves of a term combine. Based on: Ebert et al., *Texturing and Modeling*, chapter 16
/// (Musgrave).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum NoiseKind {
    /// Fractional Brownian motion: the plain sum.
    Fbm,
    /// Ridged multifractal: sharp crests, with detail where the octave before was high.
    Ridged,
    /// Hybrid multifractal: smooth in the valleys, rough on the heights.
    Hybrid,
    /// Heterogeneous terrain: roughness grows with the height itself.
    Hetero,
}

/// Domain warp: displacement of the positions at which the noise is evaluated.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WarpSettings {
    /// Wavelength of the first octave in metres, 0.001 to 1,000,000,000; that of the last is no less than `spacing_m`.
    #[schemars(range(min = WAVELENGTH_M[0], max = WAVELENGTH_M[1]))]
    pub wavelength_m: f64,
    /// Octaves, 1 to 16. Default: 3.
    #[schemars(range(min = 1, max = 16))]
    #[serde(default = "default_octaves")]
    pub octaves: u32,
    /// Displacement in metres of one unit of noise, 0 to 100,000.
    #[schemars(range(min = 0, max = HEIGHT_LIMIT_M))]
    pub distance_m: f64,
}

/// Distribution of land and sea: heights are those of the terms where the mask is 1, and `floor_m` where it is 0.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LandMask {
    /// Mask of the land.
    pub mask: Mask,
    /// Height of the sea floor far from land, in metres, -100,000 to 100,000.
    #[schemars(range(min = -HEIGHT_LIMIT_M, max = HEIGHT_LIMIT_M))]
    pub floor_m: f64,
}

impl LandMask {
    /// Finds the first value that contradicts another one.
    pub(crate) fn check(&self, path: &KeyPath, spacing_m: f64) -> Result<(), Fault> {
        self.mask.check(&path.key("mask"), spacing_m)
    }
}

impl NoiseTerm {
    /// Fills in the defaults that depend on the kind.
    pub(crate) fn fill_defaults(&mut self) {
        let (dimension, offset, gain) = match self.kind {
            NoiseKind::Ridged => (2.0, Some(1.0), Some(2.0)),
            NoiseKind::Hybrid => (0.25, Some(0.7), None),
            NoiseKind::Hetero => (1.0, Some(1.0), None),
            NoiseKind::Fbm => (1.0, None, None),
        };
        self.dimension.get_or_insert(dimension);
        self.offset = self.offset.or(offset);
        self.gain = self.gain.or(gain);
    }

    /// Finds the first value that contradicts another one, or that a term of this kind does not use.
    pub(crate) fn check(&self, path: &KeyPath, spacing_m: f64) -> Result<(), Fault> {
        check_octaves(path, self.wavelength_m, self.octaves, self.lacunarity, spacing_m)?;
        let unread = |key: &str, kinds: &str| {
            let message = format!("nothing reads {key:?} in a term of kind {:?}", self.kind);
            Err(path.key(key).fault(message.to_lowercase(), format!("leave it out; it is for {kinds}")))
        };
        match self.offset {
            Some(_) if self.kind == NoiseKind::Fbm => return unread("offset", "ridged, hybrid and hetero"),
            _ => {}
        }
        match self.gain {
            Some(_) if self.kind != NoiseKind::Ridged => return unread("gain", "ridged"),
            // A gain that is almost 0 would turn into a step between weights of 0 and 1.
            Some(gain) if gain != 0.0 && gain < 1e-6 => {
                return Err(path.key("gain").fault("expected 0, or 0.000001 or more", "").found(gain));
            }
            _ => {}
        }
        if let Some(curve) = &self.curve {
            let path = path.key("curve");
            for (index, point) in curve.iter().enumerate() {
                // Nearer points would make a step finer than the noise itself.
                if index > 0 && point[0] - curve[index - 1][0] < 1e-4 {
                    let message =
                        format!("the inputs of a curve must rise by 0.0001 or more, but {} does not", point[0]);
                    return Err(path.index(index).fault(message, "sort the points by their first number"));
                }
            }
        }
        self.mask.as_ref().map_or(Ok(()), |mask| mask.check(&path.key("mask"), spacing_m))
    }

    /// Returns the fractal of this term, whose defaults must be filled in.
    pub(crate) fn fractal(&self) -> FractalSpec {
        let filled = "fill_defaults has run";
        let kind = match self.kind {
            NoiseKind::Fbm => FractalKind::Fbm,
            NoiseKind::Ridged => {
                FractalKind::Ridged { offset: self.offset.expect(filled), gain: self.gain.expect(filled) }
            }
            NoiseKind::Hybrid => FractalKind::Hybrid { offset: self.offset.expect(filled) },
            NoiseKind::Hetero => FractalKind::Hetero { offset: self.offset.expect(filled) },
        };
        FractalSpec {
            kind,
            octaves: self.octaves,
            wavelength_m: self.wavelength_m,
            lacunarity: self.lacunarity,
            h: self.dimension.expect(filled),
        }
    }
}

impl WarpSettings {
    /// Finds the first value that contradicts another one. The finest octave of all `noises` limits the length of the
    /// warp.
    pub(crate) fn check(
        &self,
        path: &KeyPath,
        noises: impl Iterator<Item = FractalSpec>,
        spacing_m: f64,
    ) -> Result<(), Fault> {
        check_octaves(path, self.wavelength_m, self.octaves, MASK_LACUNARITY, spacing_m)?;
        let fractal = |spec: FractalSpec| Fractal::new(&spec, spacing_m, 0);
        let (low, high) = fractal(self.fractal()).bounds();
        let reach_m = low.abs().max(high.abs()) as f64 * self.distance_m;
        let most_m = noises.map(|spec| fractal(spec).max_warp_m()).fold(f32::INFINITY, f32::min) as f64;
        if reach_m <= most_m {
            return Ok(());
        }
        let message = format!("the warp reaches {reach_m:.0} m, and the finest octave follows {most_m:.0} m");
        Err(path.key("distance_m").fault(message, "a smaller distance_m, or fewer octaves in the terms"))
    }

    /// Returns the noise of each of the two displacements.
    pub(crate) fn fractal(&self) -> FractalSpec {
        plain(self.wavelength_m, self.octaves)
    }
}

// From the thesis' table 4.1, and the scale of its coordinates.
fn thesis_octaves() -> u32 {
    8
}

fn thesis_lacunarity() -> f64 {
    2.5
}

fn thesis_wavelength_m() -> f64 {
    1400.0
}
