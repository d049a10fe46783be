//! Recipes: what an author writes, read with errors that point at the place. And what the settings of all stages share: the
//! paths of their keys, their form and their faults, and masks.
//!
//! ```text
//! origin.rs   name or path -> text
//! source.rs   texts that extend each other, options -> one table (merge.rs) -> a Recipe
//! ```
//!
//! A range stands once, as an attribute of the field: the schema that users read has it from there, and so has the check.

pub mod fault;
pub mod form;
pub mod mask;
mod merge;
mod origin;
pub mod source;

/// Heights and their factors may not be larger: 16 bits would be too coarse and `f32` metres too.
pub(crate) const HEIGHT_LIMIT_M: f64 = 100_000.0;

/// Wavelengths of noise in metres: no octave is finer than the vertices, and longer waves are flat on any region.
pub(crate) const WAVELENGTH_M: [f64; 2] = [0.001, 1e9];
