//! Ids that features of several kinds mention, and where their names come from.

use crate::fluvial::point::GRAINS;
use crate::lines::NodeId;
use crate::world::World;

/// About where a node of the trunk lattice is, in vertices.
pub(super) fn vertex_of_node(world: &World, node: [i64; 2]) -> [i64; 2] {
    let side = world.relief().fluvial().map_or(0, |fluvial| fluvial.fields().side(0));
    // Nodes are `side` grains apart, and vertices `GRAINS`.
    node.map(|at| (at * side).div_euclid(GRAINS))
}

/// The id of the lake at a node of the trunk lattice.
pub(super) fn lake_id((x, y): NodeId) -> String {
    format!("l:{x}:{y}")
}
