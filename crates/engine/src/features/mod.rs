//! Features: the objects of a world as maps, GeoPackage and GeoJSON show them, uncut and with typed attributes.
//!
//! ```text
//! World, area --> lines.rs       rivers, roads, crossings; rivers and roads of agents
//!                 landforms.rs   lakes, coast, peaks
//!                 sites.rs       settlements
//!                 splines.rs     rivers and roads again, with all values of their points
//!                     |          each a plain struct, in metres by plane.rs
//!                     v
//!                 layer.rs       the features of one kind, and the columns that describe them
//! ```
//!
//! A feature is uncut, even where it leaves the requested area, and the same for every area that it touches.
//! Coordinates are metres in the plane of the world: x points east and y north, so y is minus the lattice's south, and
//! a map shows north up. No coordinate reference system of the Earth applies.
//!
//! To add a kind of feature, write a struct with its [`Layer`] in one of the files and list the layer in [`layers`].

mod plane;
pub mod layer;
pub mod landforms;
pub mod lines;
pub mod sites;
pub mod splines;

#[cfg(test)]
mod tests;

use crate::world::World;
pub use layer::{AnyLayer, Layer, MakeRow, Row, Value};
pub use lines::visit_walked;

/// Layers of fluvial worlds.
const FLUVIAL: &[&dyn AnyLayer] = &[
    &lines::RIVERS,
    &landforms::LAKES,
    &landforms::COAST,
    &landforms::PEAKS,
    &sites::SITES,
    &lines::ROADS,
    &lines::CROSSINGS,
];

/// Layers of worlds of noise, whose rivers and roads are made by agents.
const AGENTS: &[&dyn AnyLayer] = &[&lines::AGENT_RIVERS, &lines::AGENT_ROADS];

/// Returns the layers that a world has, including empty ones.
pub fn layers(world: &World) -> &'static [&'static dyn AnyLayer] {
    if world.relief().fluvial().is_some() { FLUVIAL } else { AGENTS }
}
