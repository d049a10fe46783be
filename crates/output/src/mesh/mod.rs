//! A tile as triangles: its terrain, all of it or as few as a bound allows, its waters and its roads.
//!
//! ```text
//!   steps.rs      heights in metres -> whole steps: every comparison below is exact
//!   border.rs     a row of heights -> the vertices kept of an edge, the same for both tiles at it
//!   delaunay.rs   vertices, one by one -> triangles
//!   worst.rs      triangle, heights -> the vertex that is furthest from it
//!   greedy.rs     heights, bound -> border, then the vertex furthest off, again and again
//!   waterline.rs  rivers, levels of water -> banks and shores      water.rs   these -> flat sheets
//!   ground.rs     surface, banks and shores -> the ground; cells.rs, that with every vertex
//!   facet.rs      triangle -> the vertices of the raster in it, in spans of rows
//!   ribbon.rs     roads -> strips, decks
//!   footprint.rs  strips, ends of roads -> roads as seen from above, none on another      polygon.rs   what that takes
//!   drape.rs      these, ground -> roads on the ground
//!   frame.rs      where meshes have their origin, and the steps of positions
//! ```

mod border;
mod cells;
mod delaunay;
mod drape;
mod facet;
mod footprint;
mod frame;
mod greedy;
mod ground;
mod polygon;
mod ribbon;
mod steps;
mod water;
mod waterline;
mod worst;

pub use facet::{Facet, Span};
pub use frame::{Frame, default_origin, middle};
pub use ground::{Ground, GroundVertex, PARTS};
pub use ribbon::{Ribbon, RibbonKind, RibbonVertex, ribbons, roads_near};
pub use steps::{MAX_CELLS, MAX_HEIGHT_M};
pub use water::{Sheet, sheets};
pub use waterline::{WaterPoint, Waterline, Waterlines};

use crate::area::Area;
use crate::grid::Grid;
use steps::{Steps, whole_steps};

/// A tile's terrain as triangles over some of its vertices.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Surface {
    /// Cells a side of the tile.
    pub cells: u32,
    /// Column and row in the tile of each vertex, none twice; the corners are always among them.
    pub vertices: Vec<[u32; 2]>,
    /// Indices into the vertices, counter-clockwise as seen from above with x east and y south: the front faces up
    /// where east is +X, up is +Y and south is +Z. Together they cover the tile once.
    pub triangles: Vec<[u32; 3]>,
}

impl Surface {
    /// All vertices row by row, and two triangles a cell.
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

    /// Few vertices, and triangles that no vertex of `area` lies more than `bound_m` metres above or below.
    ///
    /// Which vertices there are on an edge follows from the heights along that edge alone: neighbours, made apart, share
    /// them all. On an edge the vertices for a wider bound are among those for a narrower one. The same on every machine.
    /// With a bound of less than 2^-12 m all vertices are kept. With `edge_m` the vertices on the edges are those of another
    /// bound: of a narrower one, so that the tile meets neighbours that are made with it.
    ///
    /// # Panics
    /// When the area is not a square of 1 to [`MAX_CELLS`] cells a side or reaches outside of `heights`, when a height
    /// is not finite or beyond [`MAX_HEIGHT_M`], and when the bound is not a number.
    pub fn simplified(heights: &Grid<f32>, area: Area, bound_m: f64, edge_m: Option<f64>) -> Surface {
        let edge_m = edge_m.unwrap_or(bound_m).min(bound_m);
        assert!(!bound_m.is_nan() && !edge_m.is_nan(), "a bound is a number of metres");
        let steps = Steps::new(heights, area);
        let cells = steps.side() as u32 - 1;
        let Some(bound) = whole_steps(bound_m) else {
            return Surface::full(cells);
        };
        // No distance is as small as less than none: all vertices of an edge.
        let mesh = greedy::triangulate(&steps, bound, whole_steps(edge_m).unwrap_or(-1.0));
        let vertices = mesh.vertices().iter().map(|vertex| [vertex.x as u32, vertex.y as u32]).collect();
        Surface { cells, vertices, triangles: mesh.triangles().to_vec() }
    }
}

#[cfg(test)]
mod tests;
