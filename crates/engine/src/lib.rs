//! The engine of terrane: makes the tiles, lines and features of a world from a preset and a seed, and finds places in
//! it.
//!
//! Use the crate `terrane` instead: it has these modules under its own name, and documents how they work together.
//! Items that only terrane's own crates need are public here but not there, and may change with any version.

pub mod stop;
pub mod error;
pub mod area;
pub mod grid;
pub mod hash;
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
