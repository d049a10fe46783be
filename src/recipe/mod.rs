//! What the settings of all stages share: key paths, faults, ranges, masks.

pub(crate) mod fault;
pub mod mask;

/// Heights and their factors may not be larger: 16 bits would be too coarse and `f32` metres too.
pub(crate) const HEIGHT_LIMIT_M: f64 = 100_000.0;
