//! Where the names of features come from.

use crate::fluvial::point::GRAINS;
use crate::world::World;

/// Where the cell of a level of the network begins, in vertices.
pub(super) fn vertex_of_cell(world: &World, level: u32, cell: [i64; 2]) -> [i64; 2] {
    let side = world.relief().fluvial().map_or(0, |fluvial| fluvial.fields().side(level));
    // Cells are `side` grains apart, and vertices `GRAINS`.
    cell.map(|at| (at * side).div_euclid(GRAINS))
}
