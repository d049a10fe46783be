//! Constrained triangulations: Delaunay, but for edges that are given.

use spade::{ConstrainedDelaunayTriangulation, HasPosition, Point2};

/// A vertex of a triangulation.
#[derive(Clone, Copy, Debug)]
pub(super) struct CutVertex<T> {
    /// Position in [parts](super::PARTS) of a cell.
    pub place: [i64; 2],
    /// All else that is known of the vertex.
    pub is: T,
}

impl<T> HasPosition for CutVertex<T> {
    type Scalar = f64;

    fn position(&self) -> Point2<f64> {
        let [x, y] = self.place;
        Point2::new(x as f64, y as f64)
    }
}

/// A triangulation of vertices.
pub(super) type EdgedTriangulation<T> = ConstrainedDelaunayTriangulation<CutVertex<T>>;

/// Triangulates vertices with some edges between them, by their indices. Edges without length are left out, and where
/// edges cross, as banks do at a mouth, the crossing is left to the triangulation.
pub(super) fn constrained<T>(
    vertices: Vec<CutVertex<T>>,
    edges: impl Iterator<Item = [usize; 2]>,
) -> EdgedTriangulation<T> {
    let edges = edges.filter(|[from, to]| from != to).collect();
    EdgedTriangulation::try_bulk_load_cdt(vertices, edges, |_| {}).expect("places are whole numbers")
}
