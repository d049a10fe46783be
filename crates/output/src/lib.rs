//! What terrane makes of its land: meshes, maps, and the files of bakes.
//!
//! The crate `terrane` has these modules under its own name, and tells of all of them; use that. What only its parts need is public
//! here without being there, and may change with any version.

// As if all were one crate: a module has the same path wherever it is named.
use terrane_engine::{
    agents, area, clock, contour, device, error, features, fluvial, generator, geometry, grid, hash, land, lines,
    memory, places, preset, recipe, simd, stop, tile, walker, watch, world,
};

pub mod mesh;
pub mod map;
pub mod file;
pub mod registry;
pub mod bake;
pub mod web;
pub mod export;
