//! The engine of terrane: makes the tiles, lines and features of a world from a preset and a seed, and finds places in
//! it.
//!
//! Other programs use the crate `terrane`: it re-exports these modules, and documents how they work together. Some
//! items are public only so that the other crates of terrane can use them. `terrane` does not re-export these items,
//! and any version may change them.

pub mod stop;
pub mod error;
pub mod area;
pub mod grid;
pub mod hash;
pub mod grain_point;
pub mod geometry;
pub mod contour;
pub mod clock;
pub mod watch;
pub mod threads;
pub mod memory;
pub mod generator;
pub mod simd;
#[cfg(feature = "gpu")]
#[macro_use]
mod wgsl;

pub mod noise;
pub mod recipe;
pub mod geography;
pub mod land;
pub mod lines;
pub mod names;
pub mod fluvial;
pub mod relief;
pub mod places;
pub mod agents;
pub mod preset;
pub mod world;
pub mod tile;
pub mod device;
pub mod walker;
pub mod features;
pub mod find;
