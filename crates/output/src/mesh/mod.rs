//! A tile as triangles: its ground, complete or simplified within a bound, its waters and its roads.
//!
//! ```text
//!   height_steps.rs     heights in metres -> whole steps: every comparison below is exact
//!   border.rs           a row of heights -> the vertices kept on an edge, the same for both tiles that share the edge
//!   delaunay.rs         vertices, one by one -> triangles
//!   furthest_vertex.rs  triangle, heights -> the vertex that is furthest from the triangle
//!   greedy.rs           heights, bound -> border, then the vertex furthest from the surface, again and again
//!   waterline.rs        rivers, water levels -> banks and shores     water.rs   banks and shores -> flat sheets
//!   ground.rs           surface, banks and shores -> the ground      cut_cells.rs   the same with every vertex
//!   constrained.rs  triangulations with given edges, for these
//!   facet.rs            triangle -> the vertices of the raster in it, in spans of rows
//!   ribbon.rs           roads -> strips, decks
//!   footprint.rs        strips, ends of roads -> roads in plan without overlaps     polygon.rs   convex polygons
//!   drape.rs            roads in plan, ground -> roads on the ground
//!   frame.rs            the origin of meshes, and the step that positions are multiples of
//! ```

mod border;
mod cut_cells;
mod constrained;
mod delaunay;
mod drape;
mod facet;
mod footprint;
mod frame;
mod furthest_vertex;
mod greedy;
mod ground;
mod height_steps;
mod polygon;
mod ribbon;
mod water;
mod waterline;

pub use facet::{Facet, RowSpan};
pub use frame::{Frame, default_origin, middle};
pub use ground::{Ground, GroundVertex, PARTS};
pub use height_steps::{MAX_CELLS, MAX_HEIGHT_M};
pub use ribbon::{Ribbon, RibbonKind, RibbonVertex, ribbons, roads_near};
pub use water::{WaterSheet, sheets};
pub use waterline::{WaterPoint, Waterline, Waterlines};

use crate::area::Area;
use crate::clock::Clock;
use crate::grid::Grid;
use crate::stop::Stopped;
use height_steps::{HeightSteps, whole_steps};

/// A tile's terrain as triangles over some of its vertices.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Surface {
    /// Cells per side of the tile.
    pub cells: u32,
    /// Column and row of each vertex in the tile. All differ, and the four corners are always among them.
    pub vertices: Vec<[u32; 2]>,
    /// Indices into `vertices`, counter-clockwise as seen from above with x east and y south. With east as +X, up as +Y
    /// and south as +Z, front faces face up. The triangles together cover the tile exactly once.
    pub triangles: Vec<[u32; 3]>,
}

impl Surface {
    /// Returns the surface with all vertices, row by row, and two triangles per cell.
    pub fn full(cells: u32) -> Surface {
        let side = cells + 1;
        let vertices = (0..side).flat_map(|y| (0..side).map(move |x| [x, y])).collect();
        let triangles = (0..cells)
            .flat_map(|y| (0..cells).map(move |x| y * side + x))
            .flat_map(|northwest| {
                let [northeast, southwest] = [northwest + 1, northwest + side];
                [[northwest, southwest, northeast], [northeast, southwest, southwest + 1]]
            })
            .collect();
        Surface { cells, vertices, triangles }
    }

    /// Returns a surface with few vertices, from which no vertex of `area` lies more than `bound_m` metres up or down.
    ///
    /// The vertices on an edge follow from the heights along that edge alone, so neighbours that are made separately
    /// share all of them. The vertices on an edge for a wider bound are among those for a narrower one. The result is
    /// the same on every machine. With a bound of less than 2^-12 m all vertices are kept. `edge_m` is another,
    /// narrower bound for the edges, so that the tile meets neighbours that are made with that bound.
    ///
    /// # Errors
    /// When `clock` stops the work.
    ///
    /// # Panics
    /// If the area is not a square of 1 to [`MAX_CELLS`] cells a side or reaches outside of `heights`, if a
    /// height is not finite or beyond [`MAX_HEIGHT_M`], and if a bound is not a number.
    pub fn simplified(
        heights: &Grid<f32>,
        area: Area,
        bound_m: f64,
        edge_m: Option<f64>,
        clock: &Clock,
    ) -> Result<Surface, Stopped> {
        let edge_m = edge_m.unwrap_or(bound_m).min(bound_m);
        assert!(!bound_m.is_nan() && !edge_m.is_nan(), "a bound is a number of metres");
        let steps = HeightSteps::new(heights, area);
        let cells = steps.side() as u32 - 1;
        let Some(bound) = whole_steps(bound_m) else {
            return Ok(Surface::full(cells));
        };
        // With a bound below 0 every distance is too large: all vertices of the edge are kept.
        let mesh = greedy::triangulate(&steps, bound, whole_steps(edge_m).unwrap_or(-1.0), clock)?;
        let vertices = mesh.vertices().iter().map(|vertex| [vertex.x as u32, vertex.y as u32]).collect();
        Ok(Surface { cells, vertices, triangles: mesh.triangles().to_vec() })
    }
}

#[cfg(test)]
mod tests;
