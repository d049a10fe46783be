//! Masks: slowly varying shares, and the check of octaves for any noise.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::noise::{FractalKind, FractalSpec};
use crate::recipe::WAVELENGTH_M;
use crate::recipe::fault::{Fault, KeyPath};

/// A slowly varying share from 0 to 1: plain noise, eased from 0 at `from` to 1 at `to`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Mask {
    /// Wavelength of the first octave in metres, 0.001 to 1,000,000,000; that of the last is no less than `spacing_m`.
    #[schemars(range(min = WAVELENGTH_M[0], max = WAVELENGTH_M[1]))]
    pub wavelength_m: f64,
    /// Octaves, 1 to 16. Default: 3.
    #[schemars(range(min = 1, max = 16))]
    #[serde(default = "default_octaves")]
    pub octaves: u32,
    /// Value of the noise (about -1 to 1) at which the share is 0, -10 to 10.
    #[schemars(range(min = -10, max = 10))]
    pub from: f64,
    /// Value of the noise at which the share is 1, -10 to 10. If it is below `from`, the mask is inverted.
    #[schemars(range(min = -10, max = 10))]
    pub to: f64,
}

impl Mask {
    /// Returns the noise from which the shares are made.
    pub(crate) fn fractal(&self) -> FractalSpec {
        plain(self.wavelength_m, self.octaves)
    }

    /// Finds the first value that contradicts another one.
    pub(crate) fn check(&self, path: &KeyPath, spacing_m: f64) -> Result<(), Fault> {
        check_octaves(path, self.wavelength_m, self.octaves, MASK_LACUNARITY, spacing_m)?;
        if (self.from - self.to).abs() < 1e-3 {
            let message = format!("must differ from `from` = {} by 0.001 or more, but it is {}", self.from, self.to);
            return Err(path.key("to").fault(message, "a step without a width would be a cliff"));
        }
        Ok(())
    }
}

/// Returns the plain noise of masks and warps.
pub(crate) fn plain(wavelength_m: f64, octaves: u32) -> FractalSpec {
    FractalSpec { kind: FractalKind::Fbm, octaves, wavelength_m, lacunarity: MASK_LACUNARITY, h: 1.0 }
}

/// Checks a wavelength and its octaves: the finest octave must not be finer than the vertices.
pub(crate) fn check_octaves(
    path: &KeyPath,
    wavelength_m: f64,
    octaves: u32,
    lacunarity: f64,
    spacing_m: f64,
) -> Result<(), Fault> {
    if wavelength_m < spacing_m {
        let message = format!("expected spacing_m = {spacing_m} or more");
        return Err(path.key("wavelength_m").fault(message, "or a smaller spacing_m").found(wavelength_m));
    }
    let finest = |octaves: u32| (1..octaves).fold(wavelength_m, |wavelength, _| wavelength / lacunarity);
    if finest(octaves) < spacing_m {
        let most = (1..octaves).rev().find(|&n| finest(n) >= spacing_m).unwrap_or(1);
        let message = format!(
            "the last of {octaves} octaves has a wavelength of {:.3} m, finer than the vertices ({spacing_m} m apart)",
            finest(octaves)
        );
        let hint = format!("give octaves = {most}, or a longer wavelength_m, or a smaller spacing_m");
        return Err(path.key("octaves").fault(message, hint));
    }
    Ok(())
}

/// Ratio of the frequencies of neighbouring octaves in masks and warps: an octave in the musician's sense.
pub(crate) const MASK_LACUNARITY: f64 = 2.0;

pub(crate) fn default_octaves() -> u32 {
    3
}
