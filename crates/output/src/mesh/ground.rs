//! The ground of a tile's mesh: vertices of the raster and, if there are waters, points of their shores and banks.

use std::collections::{HashMap, HashSet};

use spade::handles::{FaceHandle, FixedVertexHandle, InnerTag};
use spade::{CdtEdge, Triangulation};

use super::constrained::{CutVertex, EdgedTriangulation, constrained};
use super::cut_cells;
use super::waterline::Waterlines;
use super::{Facet, Surface};
use crate::area::Area;
use crate::clock::Clock;
use crate::grid::Grid;
use crate::stop::Stopped;

/// Number of parts into which the side of a cell is divided. Positions are whole numbers of parts, so points of shores
/// and banks can lie between the vertices of the raster.
pub const PARTS: i32 = 256;

/// A vertex of a ground.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GroundVertex {
    /// Position in [parts](PARTS) of a cell east and south of the tile's north-western corner.
    pub place: [u32; 2],
    /// Height in metres, as in the raster; under and at the edge of waters it is lowered below their surface.
    pub height_m: f32,
}

/// The ground of a tile.
#[derive(Clone, Debug, PartialEq)]
pub struct Ground {
    /// Cells per side of the tile.
    pub cells: u32,
    /// Vertices, no two of them at the same place.
    pub vertices: Vec<GroundVertex>,
    /// Triangles, as in [`Surface`].
    pub triangles: Vec<[u32; 3]>,
}

impl Ground {
    /// Creates the ground of a surface, with the heights of the raster.
    pub fn new(surface: &Surface, heights: &Grid<f32>, area: Area) -> Ground {
        let vertex = |&at: &[u32; 2]| GroundVertex {
            place: at.map(|at| at * PARTS as u32),
            height_m: heights.at(area.x0 + i64::from(at[0]), area.y0 + i64::from(at[1])),
        };
        let vertices = surface.vertices.iter().map(vertex).collect();
        Ground { cells: surface.cells, vertices, triangles: surface.triangles.clone() }
    }

    /// Cuts the shores and banks of waters into a surface. Away from shores and banks the ground has all vertices of
    /// the surface. Further vertices of the raster are added until none of them lies more than `bound_m` metres above
    /// or below the ground. Vertices under water are not checked, because the ground there lies below the water's
    /// surface and may differ from the raster. If `bound_m` is `None`, the surface must have all vertices of the
    /// raster.
    ///
    /// # Errors
    /// When `clock` stops the work.
    pub fn cut(
        surface: &Surface,
        heights: &Grid<f32>,
        area: Area,
        waters: &Waterlines,
        bound_m: Option<f64>,
        clock: &Clock,
    ) -> Result<Ground, Stopped> {
        let Some(bound_m) = bound_m else { return Ok(cut_cells::cut(surface, heights, area, waters)) };
        let side = i64::from(surface.cells) * i64::from(PARTS);
        let points = waters.points();
        // Drop vertices that are so near to a shore that triangles between both would be slivers. Keep those on the
        // tile's edge, because the neighbouring tile has them too, and its mesh must meet this one.
        let taken: HashSet<[i64; 2]> = points.iter().map(|point| point.place).collect();
        let crowd = Crowd::new(&points);
        let mut vertices: Vec<CutVertex<f32>> = Vec::with_capacity(surface.vertices.len() + points.len());
        for at in &surface.vertices {
            let place = at.map(|at| i64::from(at) * i64::from(PARTS));
            let inner = place.iter().all(|at| *at > 0 && *at < side);
            if taken.contains(&place) || inner && crowd.has_near(place) {
                continue;
            }
            vertices.push(CutVertex { place, is: waters.lowered(*at, height(heights, area, *at)) });
        }
        vertices.extend(points.iter().map(|point| CutVertex { place: point.place, is: point.ground_m }));
        let numbers: HashMap<[i64; 2], usize> =
            vertices.iter().enumerate().map(|(number, vertex)| (vertex.place, number)).collect();
        let edges = waters.pieces().map(|(_, ends)| ends.map(|end| numbers[&end]));
        let mut cut = constrained(vertices, edges);
        refine(&mut cut, heights, area, waters, bound_m, clock)?;
        let vertices = cut.vertices().map(|vertex| {
            let CutVertex { place, is } = *vertex.data();
            GroundVertex { place: place.map(|at| at as u32), height_m: is }
        });
        let corner = |vertex: FixedVertexHandle| vertex.index() as u32;
        let triangles = cut.inner_faces().map(|face| {
            // Spade lists corners counter-clockwise, for a y axis that points up. Here y points south, so its order is
            // clockwise as seen from above. Swap two corners to make it counter-clockwise.
            let [a, b, c] = face.vertices().map(|vertex| corner(vertex.fix()));
            [a, c, b]
        });
        Ok(Ground { cells: surface.cells, vertices: vertices.collect(), triangles: triangles.collect() })
    }

    /// Returns the triangles as facets over the raster, in their order.
    pub fn facets(&self) -> impl Iterator<Item = Facet> {
        let place = |index: u32| self.vertices[index as usize].place.map(|at| at as i32);
        self.triangles.iter().map(move |triangle| Facet(triangle.map(place)))
    }
}

fn height(heights: &Grid<f32>, area: Area, [column, row]: [u32; 2]) -> f32 {
    heights.at(area.x0 + i64::from(column), area.y0 + i64::from(row))
}

type CutFace<'a> = FaceHandle<'a, InnerTag, CutVertex<f32>, (), CdtEdge<()>, ()>;

/// Inserts vertices of the raster until none lies more than `bound_m` metres above or below its triangle. Some do at
/// first: near shores, and where four vertices of the surface lie on one circle. Either diagonal
/// may cut the quadrilateral between such four into triangles, and the cut surface may have the other one.
fn refine(
    cut: &mut EdgedTriangulation<f32>,
    heights: &Grid<f32>,
    area: Area,
    waters: &Waterlines,
    bound_m: f64,
    clock: &Clock,
) -> Result<(), Stopped> {
    // Remember triangles by their corners, because each insertion may change the numbers of faces.
    let corners = |face: CutFace| face.vertices().map(|vertex| *vertex.data());
    let mut open: Vec<[CutVertex<f32>; 3]> = cut.inner_faces().map(corners).collect();
    while let Some(triangle) = open.pop() {
        clock.check()?;
        let Some(at) = furthest(triangle, heights, area, waters, bound_m) else { continue };
        // An earlier insertion may have replaced this triangle. Then this vertex may be unnecessary, which does no
        // harm, and no vertex is missed, because the triangles that replaced this one are checked too.
        let place = at.map(|at| i64::from(at) * i64::from(PARTS));
        let vertex = CutVertex { place, is: height(heights, area, at) };
        let before = cut.num_vertices();
        let Ok(handle) = cut.insert(vertex) else { continue };
        if cut.num_vertices() > before {
            open.extend(cut.vertex(handle).out_edges().filter_map(|edge| edge.face().as_inner()).map(corners));
        }
    }
    Ok(())
}

/// Finds the vertex of the raster that lies furthest above or below a triangle, among those in the triangle that are
/// not under water. Returns `None` if none lies more than `bound_m` metres away.
fn furthest(
    triangle: [CutVertex<f32>; 3],
    heights: &Grid<f32>,
    area: Area,
    waters: &Waterlines,
    bound_m: f64,
) -> Option<[u32; 2]> {
    let [a, b, c] = triangle;
    let facet = Facet([a, c, b].map(|vertex| vertex.place.map(|at| at as i32)));
    let corners_m = [a, c, b].map(|vertex| f64::from(vertex.is));
    let whole = facet.whole() as f64;
    let mut worst: Option<(f64, [u32; 2])> = None;
    for span in facet.spans() {
        for offset in 0..span.count {
            let at = [(span.column + offset) as u32, span.row as u32];
            let share = |corner: usize| (span.shares[corner] + span.growth[corner] * offset as i64) as f64;
            let here_m = (share(0) * corners_m[0] + share(1) * corners_m[1] + share(2) * corners_m[2]) / whole;
            let off_m = (f64::from(height(heights, area, at)) - here_m).abs();
            if off_m > bound_m && worst.is_none_or(|(most_m, _)| off_m > most_m) && !waters.covers(at) {
                worst = Some((off_m, at));
            }
        }
    }
    worst.map(|(_, at)| at)
}

/// The points of shores and banks, grouped by the vertex of the raster that is nearest to each.
struct Crowd(HashMap<[i64; 2], Vec<[i64; 2]>>);

/// Distance in parts of a cell: a vertex of the raster that is nearer than this to a point of a shore is dropped.
const NEAR: i64 = PARTS as i64 / 6;

impl Crowd {
    fn new(points: &[super::waterline::WaterPoint]) -> Crowd {
        let mut cells: HashMap<[i64; 2], Vec<[i64; 2]>> = HashMap::new();
        for point in points {
            cells.entry(Crowd::cell(point.place)).or_default().push(point.place);
        }
        Crowd(cells)
    }

    fn cell(place: [i64; 2]) -> [i64; 2] {
        place.map(|at| (at + i64::from(PARTS) / 2).div_euclid(i64::from(PARTS)))
    }

    fn has_near(&self, place: [i64; 2]) -> bool {
        let near = |point: &[i64; 2]| {
            let [x, y] = [point[0] - place[0], point[1] - place[1]];
            x * x + y * y < NEAR * NEAR
        };
        // Points within `NEAR` of the vertex are in the vertex's own group, because `NEAR` is less than half the
        // distance between vertices. So other groups need no look.
        self.0.get(&Crowd::cell(place)).is_some_and(|points| points.iter().any(near))
    }
}
