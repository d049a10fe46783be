//! Features: what maps, GeoPackage and GeoJSON show of a world, whole and with typed attributes.
//!
//! ```text
//! World, area --> lines.rs       rivers, roads, crossings; rivers and roads of agents
//!                 landforms.rs   lakes, coast, peaks
//!                 sites.rs       settlements
//!                 splines.rs     rivers and roads again, with all that their points know
//!                     |          each a plain struct, in metres by plane.rs
//!                     v
//!                 layer.rs       the features of one kind, and the columns that describe them
//! ```
//!
//! A feature is whole, even where it leaves the area that was asked about, and the same for every area that it touches.
//! Coordinates are metres in the plane of the world: east is x, north is y, so y is the negative of the lattice's south
//! and a map shows north up. No coordinate reference system of the Earth applies.
//!
//! A new kind of features is a struct with its [`Layer`] in one of the files, and a place in [`layers`].

mod plane;
pub mod layer;
pub mod landforms;
pub mod lines;
pub mod sites;
pub mod splines;

#[cfg(test)]
mod tests;

use crate::world::World;
pub use layer::{AnyLayer, Layer, Row, Value};
pub use lines::visit_walked;

/// The layers of fluvial worlds.
const FLUVIAL: &[&dyn AnyLayer] = &[
    &lines::RIVERS,
    &landforms::LAKES,
    &landforms::COAST,
    &landforms::PEAKS,
    &sites::SITES,
    &lines::ROADS,
    &lines::CROSSINGS,
];

/// The layers of worlds of noise, whose rivers and roads agents make.
const AGENTS: &[&dyn AnyLayer] = &[&lines::AGENT_RIVERS, &lines::AGENT_ROADS];

/// The layers that a world has, whether there is a feature in them or not.
pub fn layers(world: &World) -> &'static [&'static dyn AnyLayer] {
    if world.relief().fluvial().is_some() { FLUVIAL } else { AGENTS }
}
