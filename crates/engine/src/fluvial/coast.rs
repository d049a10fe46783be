//! The coast: the edge of the land at the sea's lowstand, and the floor below it, by the distance inland.
//!
//! The distance inland is known on a coarse lattice of the plane, and interpolated bilinearly between its points.
//! Rivers that run to the coast read the same lattice ([`Fields::in_lowstand`], [`Fields::is_drowned`]).

use super::fields::{COAST_STEP, Fields};
use super::hillsides::Hillsides;
use super::warp::Displaced;
use crate::area::Area;
use crate::grain_point::Point;
use crate::grid::Grid;

/// Nodes a side of a block. The coarse lattice is read for one block at a time. A block is small enough that whole
/// blocks far inland and far out at sea can be skipped, and large enough that a point of the lattice serves several
/// nodes. At strides at which brooks do not show, no block is skipped, and all nodes are one block, so that each point
/// is read once.
const BLOCK: usize = 32;

/// Returns the cell of a lattice, along one axis, in which a vertex lies once displaced by `by` vertices, and its
/// position in the cell, 0 to 1. The lattice's cells are `coarse` vertices wide.
///
/// Computed relative to the cell of the vertex itself, so it is as exact anywhere as at the origin.
fn cell(coarse: i64, at: i64, by: f32) -> (i64, f32) {
    let own = at.div_euclid(coarse);
    let steps = ((at - own * coarse) as f32 + by) / coarse as f32;
    let whole = steps.floor();
    (own + whole as i64, steps - whole)
}

/// Reads the distances inland in metres at the corners of the cells of the coarse lattice from `first` to `last`. With
/// `is_far`, nodes are so far apart that trunks do not show.
fn inland_m(fields: &Fields, (coarse, is_far): (i64, bool), first: [i64; 2], last: [i64; 2]) -> Grid<f32> {
    let mut window = Grid::filled(Area { x0: first[0], y0: first[1], x1: last[0] + 2, y1: last[1] + 2 }, 0.0);
    let steps = coarse / COAST_STEP;
    let points: Vec<(i64, i64)> = window.area().vertices().map(|(i, j)| (i * steps, j * steps)).collect();
    let vertices = || points.iter().map(|(i, j)| Point::at_vertex(i * COAST_STEP, j * COAST_STEP));
    let inland_m: Vec<f64> = match steps {
        1 => fields.inlands_of_lattice_m(points).collect(),
        _ if is_far => fields.inlands_m(&vertices().collect::<Vec<_>>()),
        // No channel reads points of this coarser lattice, so they are not cached.
        _ => fields.find_inlands_of_lattice_m(&points),
    };
    for (value, inland_m) in window.values_mut().iter_mut().zip(inland_m) {
        *value = inland_m as f32;
    }
    window
}

/// Interpolates the values of such a window at a place in a cell.
fn interpolated(window: &Grid<f32>, (i, u): (i64, f32), (j, v): (i64, f32)) -> f32 {
    let [north, south] = [j, j + 1].map(|j| {
        let row = window.row(j, i, i + 2);
        row[0] + (row[1] - row[0]) * u
    });
    north + (south - north) * v
}

/// Distance in vertices between the points of the lattice that nodes `step` vertices apart read: their own distance, if
/// that is larger than the lattice's.
fn coarse(step: i64) -> i64 {
    COAST_STEP.max(step)
}

/// Returns the height of the coast at the nodes of an area, and infinity where the coast is not lower than the land;
/// `None` if it is lower nowhere. Brooks lower the land's edge, but not by what stands upon the land, `raised_m`. With `is_far`, hollows that do not lead to the sea are left as low as they are:
/// finding them would take longer than all else.
pub fn heights(
    fields: &Fields,
    is_far: bool,
    nodes: &Displaced,
    hillsides: &Hillsides,
    (land_m, raised_m): (&[f32], Option<&[f32]>),
) -> Option<Vec<f32>> {
    if !fields.has_sea() {
        return None;
    }
    let &Displaced { area, step, ref metres } = nodes;
    let per_vertex = (1.0 / fields.spacing_m()) as f32;
    let coarse = coarse(step);
    let shore_m = fields.shore_m();
    let mut coast_m = vec![f32::INFINITY; area.len()];
    let mut any = false;
    let blocks = if hillsides.rest.is_some() { vec![area] } else { area.squares(BLOCK).collect() };
    for block in blocks {
        let indices = || block.vertices().map(|(x, y)| (area.index(x, y), [x, y]));
        let cells = |index: usize, at: [i64; 2]| {
            [0, 1].map(|axis| cell(coarse, at[axis] * step, metres[axis][index] * per_vertex))
        };
        let (mut first, mut last) = ([i64::MAX; 2], [i64::MIN; 2]);
        let mut highest_m = f32::NEG_INFINITY;
        for (index, at) in indices() {
            let cells = cells(index, at);
            for axis in [0, 1] {
                first[axis] = first[axis].min(cells[axis].0);
                last[axis] = last[axis].max(cells[axis].0);
            }
            highest_m = highest_m.max(land_m[index]);
        }
        let window = inland_m(fields, (coarse, is_far), first, last);
        // The coast rises inland. A skipped block's coast lies above its land everywhere, so skipping changes nothing,
        // whichever nodes share the block.
        let nearest_m = window.values().iter().fold(f32::INFINITY, |a, b| a.min(*b));
        if hillsides.rest.is_none() && fields.coast_m(nearest_m) >= highest_m {
            continue;
        }
        any = true;
        for (index, at) in indices() {
            let [column, row] = cells(index, at);
            let inland_m = interpolated(&window, column, row);
            let edge_m = fields.coast_m(inland_m);
            // Brooks on their way to the sea lower the land's edge to this mean height.
            let left_m = hillsides.rest.as_ref().filter(|_| inland_m > shore_m).map_or(edge_m, |rest| {
                let risen_m = hillsides.slope[index] * (inland_m - shore_m);
                fields.sea_level_m() as f32 + rest.risen_m(index, risen_m) + raised_m.map_or(0.0, |all| all[index])
            });
            coast_m[index] = edge_m.min(left_m);
        }
    }
    any.then_some(coast_m)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fluvial::hillsides::NodeValues;
    use crate::fluvial::valley;

    const FAR: i64 = 1 << 40;

    /// Displacements in vertices that end at points of the coarse lattice, or very close to them, from all around.
    fn displacements() -> Vec<f32> {
        let around = |by: f32| [by.next_down(), by, by.next_up(), by - 1e-5, by + 1e-5];
        (-40i16..=40).flat_map(|by| around(f32::from(by))).collect()
    }

    #[test]
    fn a_displaced_vertex_lies_where_its_cell_says() {
        for origin in [0, FAR, -FAR] {
            for at in -17..=17 {
                for by in displacements() {
                    let (cell, share) = cell(COAST_STEP, origin + at, by);
                    assert!((0.0..=1.0).contains(&share), "{at} + {by}: {share}");
                    let got = (cell - origin / COAST_STEP) as f64 + share as f64;
                    let expected = (at as f64 + by as f64) / COAST_STEP as f64;
                    assert!((got - expected).abs() < 1e-6, "{at} + {by} vertices: {got} and not {expected} cells");
                }
            }
        }
    }

    /// Each node alone has the same coast as in a block with others, which has another window.
    #[test]
    fn the_coast_does_not_depend_on_the_window() {
        let fields = Fields::of_preset("archipelago", 1, |_| {});
        let vertices = displacements();
        let metres: Vec<f32> = vertices.iter().map(|by| by * fields.spacing_m() as f32).collect();
        let high_m = vec![1e6; vertices.len()];
        let reach = valley::reach(&fields, fields.levels());
        let hillsides = |len: usize| {
            let [crest_m, gullies, rills, roughness] = [(); 4].map(|()| NodeValues::Same(1.0));
            let sand = NodeValues::Same(0.0);
            Hillsides { reach, slope: vec![0.5; len], crest_m, gullies, rills, roughness, sand, rest: None }
        };
        for corner in [0, -COAST_STEP, 5 * COAST_STEP - 1, FAR, FAR + COAST_STEP, -FAR - 1] {
            let area = Area::new(corner, -corner, vertices.len(), 1);
            let nodes = Displaced { area, step: 1, metres: [metres.clone(), metres.clone()] };
            let together = heights(&fields, false, &nodes, &hillsides(high_m.len()), (&high_m, None))
                .expect("land is higher than any coast");
            for (index, expected_m) in together.iter().enumerate() {
                let area = Area::new(corner + index as i64, -corner, 1, 1);
                let by = vec![metres[index]];
                let nodes = Displaced { area, step: 1, metres: [by.clone(), by] };
                let alone = heights(&fields, false, &nodes, &hillsides(1), (&high_m[..1], None)).expect("likewise");
                assert_eq!(alone[0], *expected_m, "{} vertices from {area:?}", vertices[index]);
            }
        }
    }
}
