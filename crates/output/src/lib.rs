//! The outputs of terrane: meshes, maps, and the files of bakes.
//!
//! Use the crate `terrane` instead: it re-exports these modules under its own name, and documents them all. Items that
//! only the parts of `terrane` need are public here but not there, and may change with any version.

// With these imports a module has the same path in all crates, as if they were one.
use terrane_engine::{
    agents, area, clock, contour, device, error, features, fluvial, generator, geography, geometry, grain_point, grid,
    hash, land, lines, memory, places, preset, recipe, simd, stop, tile, walker, watch, world,
};

pub mod mesh;
pub mod map;
pub mod file;
pub mod registry;
pub mod bake;
pub mod web;
pub mod export;
