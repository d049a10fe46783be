//! Recipes: texts that an author writes, read with errors that point at the place. Also the parts that the settings of
//! all stages share: key paths, schemas, faults and masks.
//!
//! ```text
//! location.rs   name or path -> text
//! source.rs     texts that extend each other, options -> one table (toml_tables.rs) -> a Recipe
//! ```
//!
//! A range is written once, as an attribute of the field. Both the schema for users and the check take it from there.

pub mod fault;
mod location;
pub mod mask;
pub mod schema;
pub mod source;
mod toml_tables;

/// Limit of heights and of the factors of heights in metres: beyond it, 16-bit heights and `f32` metres would be too
/// coarse.
pub(crate) const HEIGHT_LIMIT_M: f64 = 100_000.0;

/// Range of wavelengths of noise in metres: no octave is finer than the vertices, and longer waves are flat in any
/// region.
pub(crate) const WAVELENGTH_M: [f64; 2] = [0.001, 1e9];
