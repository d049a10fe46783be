//! An incremental Delaunay triangulation of vertices of a square.
//!
//! Based on: Lawson 1977, "Software for C1 surface interpolation": a new vertex splits the triangle that contains it,
//! and edges around it are flipped until each triangle's circumcircle is empty again. All arithmetic is in integers, so
//! there are no near-collinear cases.
//!
//! Edge `3 t + i` goes from corner `i` of triangle `t` to the next corner, counter-clockwise. Its twin is the same edge
//! in the triangle on the other side.

use super::height_steps::HeightSteps;

/// The twin of an edge on the border, where there is no triangle on the other side.
pub const NONE: u32 = u32::MAX;

/// A vertex: column, row, and height in steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GridPoint {
    pub x: i32,
    pub y: i32,
    pub z: i32,
}

/// A triangulation of a square.
pub struct Delaunay {
    vertices: Vec<GridPoint>,
    triangles: Vec<[u32; 3]>,
    twins: Vec<[u32; 3]>,
    /// The triangles around the last inserted vertex.
    star: Vec<u32>,
}

impl Delaunay {
    /// Creates the square of all steps, as two triangles.
    pub fn new(steps: &HeightSteps) -> Delaunay {
        let last = steps.side() as u32 - 1;
        let corners = [[0, 0], [0, last], [last, last], [last, 0]];
        Delaunay {
            vertices: corners.map(|at| vertex(steps, at)).to_vec(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            twins: vec![[NONE, NONE, 3], [2, NONE, NONE]],
            star: Vec::new(),
        }
    }

    /// All vertices, in the order in which they were inserted.
    pub fn vertices(&self) -> &[GridPoint] {
        &self.vertices
    }

    /// All triangles, counter-clockwise as seen from above with y south.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// The triangles around the last inserted vertex. The insertion has changed no other triangle.
    pub fn star(&self) -> &[u32] {
        &self.star
    }

    /// The corners of a triangle.
    pub fn corners(&self, triangle: u32) -> [GridPoint; 3] {
        self.triangles[triangle as usize].map(|index| self.vertices[index as usize])
    }

    /// Finds the triangle that contains a vertex by a walk that starts at the triangle `from`.
    pub fn locate(&self, [x, y]: [u32; 2], from: u32) -> u32 {
        let at = GridPoint { x: x as i32, y: y as i32, z: 0 };
        let mut triangle = from;
        // Cross any edge that has the place on its far side. In a Delaunay triangulation such a walk never goes round
        // in circles.
        'walk: loop {
            let [a, b, c] = self.corners(triangle);
            for (edge, (from, to)) in [(a, b), (b, c), (c, a)].into_iter().enumerate() {
                if doubled_area(from, to, at) < 0 {
                    triangle = self.twins[triangle as usize][edge] / 3;
                    continue 'walk;
                }
            }
            return triangle;
        }
    }

    /// Inserts a vertex into the triangle that contains it or has it on an edge.
    ///
    /// # Panics
    /// If there is a vertex at this place already.
    pub fn insert(&mut self, steps: &HeightSteps, at: [u32; 2], triangle: u32) {
        let new = vertex(steps, at);
        let [a, b, c] = self.corners(triangle);
        let areas = [doubled_area(a, b, new), doubled_area(b, c, new), doubled_area(c, a, new)];
        self.vertices.push(new);
        // Exact: in integers a vertex is either on an edge or not.
        let Some(on) = areas.iter().position(|area| *area == 0) else {
            // Inside: three triangles replace one.
            let outline = [0, 1, 2].map(|edge| self.side(triangle, edge));
            self.surround(&outline, &[triangle], true);
            return;
        };
        // On an edge: split the two triangles at the edge, or the only one on the border.
        let [next, last] = [(on + 1) % 3, (on + 2) % 3];
        assert!(areas[next] > 0 && areas[last] > 0, "there is a vertex at {at:?} already");
        let [first, second] = [next, last].map(|edge| self.side(triangle, edge));
        let twin = self.twins[triangle as usize][on];
        if twin == NONE {
            self.surround(&[first, second], &[triangle], false);
        } else {
            let [third, fourth] = [1, 2].map(|turn| self.side(twin / 3, (twin as usize + turn) % 3));
            self.surround(&[first, second, third, fourth], &[triangle, twin / 3], true);
        }
    }

    /// Returns an edge of a triangle: its start, its end and its twin.
    fn side(&self, triangle: u32, edge: usize) -> HalfEdge {
        let corners = self.triangles[triangle as usize];
        HalfEdge { from: corners[edge], to: corners[(edge + 1) % 3], twin: self.twins[triangle as usize][edge] }
    }

    /// Builds the star of the last vertex: a triangle from each edge of an outline, counter-clockwise, to the vertex.
    /// The star takes over the numbers of the triangles in `reuse`. On the border the outline is open.
    fn surround(&mut self, outline: &[HalfEdge], reuse: &[u32], closed: bool) {
        let tip = self.vertices.len() as u32 - 1;
        self.star.clear();
        // Reuse the old numbers, so that no number stays unused.
        self.star.extend_from_slice(reuse);
        let fresh = self.triangles.len() as u32;
        self.star.extend(fresh..fresh + (outline.len() - reuse.len()) as u32);
        self.triangles.resize(self.triangles.len() + outline.len() - reuse.len(), [0; 3]);
        self.twins.resize(self.triangles.len(), [NONE; 3]);
        for (place, side) in outline.iter().enumerate() {
            let triangle = self.star[place];
            self.triangles[triangle as usize] = [side.from, side.to, tip];
            self.twins[triangle as usize] = [NONE; 3];
            self.link(3 * triangle, side.twin);
        }
        for place in 0..outline.len() - usize::from(!closed) {
            let next = self.star[(place + 1) % outline.len()];
            self.link(3 * self.star[place] + 1, 3 * next + 2);
        }
        // Flips add triangles to the star; each keeps the tip as its last corner.
        let mut place = 0;
        while place < self.star.len() {
            let triangle = self.star[place];
            while let Some(other) = self.flip(triangle) {
                self.star.push(other);
            }
            place += 1;
        }
    }

    /// Flips the first edge of a triangle of the star if the opposite corner behind it lies in the triangle's
    /// circumcircle. Returns the triangle behind it, which then belongs to the star.
    fn flip(&mut self, triangle: u32) -> Option<u32> {
        // The outer edge is the first, since the tip is the last corner of each triangle of the star.
        let [_, right, left] = self.twins[triangle as usize];
        let twin = self.twins[triangle as usize][0];
        if twin == NONE {
            return None;
        }
        let [a, b, tip] = self.triangles[triangle as usize];
        let other = twin / 3;
        let [beyond_a, beyond_b] = [1, 2].map(|turn| self.side(other, (twin as usize + turn) % 3));
        let across = beyond_b.from;
        if !in_circle([a, b, tip].map(|index| self.vertices[index as usize]), self.vertices[across as usize]) {
            return None;
        }
        self.triangles[triangle as usize] = [a, across, tip];
        self.triangles[other as usize] = [across, b, tip];
        // Edge 2 keeps its number, so its twin still points to it.
        self.twins[triangle as usize][2] = left;
        self.link(3 * triangle, beyond_a.twin);
        self.link(3 * other, beyond_b.twin);
        self.link(3 * other + 1, right);
        self.link(3 * triangle + 1, 3 * other + 2);
        Some(other)
    }

    /// Makes two edges each other's twins.
    fn link(&mut self, edge: u32, twin: u32) {
        self.twins[edge as usize / 3][edge as usize % 3] = twin;
        if twin != NONE {
            self.twins[twin as usize / 3][twin as usize % 3] = edge;
        }
    }
}

/// An edge of a triangle: its ends and its twin.
#[derive(Clone, Copy)]
struct HalfEdge {
    from: u32,
    to: u32,
    twin: u32,
}

fn vertex(steps: &HeightSteps, [x, y]: [u32; 2]) -> GridPoint {
    GridPoint { x: x as i32, y: y as i32, z: steps.at([x, y]) }
}

/// Twice the area of a triangle, positive if it is counter-clockwise as seen from above with y south.
pub fn doubled_area(a: GridPoint, b: GridPoint, c: GridPoint) -> i32 {
    (b.y - a.y) * (c.x - a.x) - (b.x - a.x) * (c.y - a.y)
}

/// True if `d` is inside the circle through the corners of a counter-clockwise triangle. With coordinates up to 2^12 no
/// product is above 2^50.
fn in_circle(corners: [GridPoint; 3], d: GridPoint) -> bool {
    let [(ax, ay, a), (bx, by, b), (cx, cy, c)] = corners.map(|corner| {
        let (x, y) = ((corner.x - d.x) as i64, (corner.y - d.y) as i64);
        (x, y, x * x + y * y)
    });
    a * (by * cx - bx * cy) + b * (cy * ax - cx * ay) + c * (ay * bx - ax * by) > 0
}
