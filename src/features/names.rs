//! Ids that features of several kinds mention, and their names on a map.

use crate::fluvial::point::GRAINS;
use crate::fluvial::trunk::NodeId;
use crate::hash;
use crate::places::site::SiteId;
use crate::world::World;

/// The name of a feature: one of the names of the site cell that a vertex of it lies in, by the numbers of its id. Worlds
/// without places have no names.
pub(super) fn name(world: &World, of: fn(u64, SiteId, u64) -> String, at: [i64; 2], id: &[i64]) -> Option<String> {
    let number = id.iter().fold(0, |number, part| hash::mix(number ^ *part as u64));
    world.places().map(|places| of(world.seed(), places.cell(at), number))
}

/// About where a node of a lattice of the network is, in vertices.
pub(super) fn vertex_of_node(world: &World, level: u32, x: i64, y: i64) -> [i64; 2] {
    let side = world.relief().fluvial().map_or(0, |fluvial| fluvial.fields().side(level));
    [x, y].map(|at| (at * side).div_euclid(GRAINS))
}

/// The id of the lake at a node of the trunk lattice.
pub(super) fn lake_id((x, y): NodeId) -> String {
    format!("l:{x}:{y}")
}

/// The id of the settlement of a site cell.
pub(super) fn site_id(SiteId { i, j }: SiteId) -> String {
    format!("s:{i}:{j}")
}
