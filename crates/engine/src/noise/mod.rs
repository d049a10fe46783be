//! Fractal noise over the vertex lattice: exact at any distance, the same bits on every CPU.
//!
//! ```text
//! FractalSpec --> Fractal: for each octave a Lattice (where), gradients (what), a FoldStep (how it is added)
//!                    |
//!                    | fill: blocks of 64 x 32 vertices, aligned with the world; octave by octave
//!                    |   waves of 20 vertices and more  splat.rs    bump by bump
//!                    |   shorter ones                   rows.rs     row by row, four bumps a vertex
//!                    |   below 1.45, and when warped    simplex.rs  vertex by vertex, three corners
//!                    | fold.rs: each octave is folded into value and weight
//!                    v
//!                 values of an Area, within bounds.rs
//! ```
//!
//! All three evaluate the same function, two-dimensional simplex noise, but round differently. The octave's wavelength
//! alone decides which one computes it, so a vertex has the same bits in every area, at every vector width.
//!
//! Number of vector operations per vector and octave: 29 bump by bump where three bumps overlap (7 each), 66 row by
//! row, 102 vertex by vertex. Each includes 7 operations to fold a ridged octave.
//!
//! [`Stripes`] are another noise, on positions that are just as exact: waves along a given direction (`stripes.rs`).

mod bounds;
mod fold;
mod fractal;
#[cfg(feature = "gpu")]
pub mod gpu_words;
mod lattice;
pub mod point_noise;
mod rows;
mod simplex;
mod spec;
mod splat;
mod stripes;

pub use fractal::Fractal;
pub use spec::{FractalKind, FractalSpec};
pub use stripes::Stripes;

#[cfg(test)]
mod tests;
