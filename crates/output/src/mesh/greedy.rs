//! Greedy insertion: the vertices that a surface needs, the most needed first.
//!
//! Based on: Garland & Heckbert 1995, "Fast polygonal approximation of terrains and height fields": again and again the
//! vertex that is furthest from the surface is inserted, until none is too far.

use std::collections::BinaryHeap;

use super::border::chain;
use super::delaunay::Delaunay;
use super::furthest_vertex::FurthestVertex;
use super::height_steps::HeightSteps;
use crate::clock::Clock;
use crate::stop::Stopped;

/// Returns the triangulation whose triangles are all within `bound` steps of the heights. Its border is the [`chain`]
/// of each edge for `edge_bound`, which is no wider than `bound`.
pub fn triangulate(steps: &HeightSteps, bound: f64, edge_bound: f64, clock: &Clock) -> Result<Delaunay, Stopped> {
    let mut mesh = Delaunay::new(steps);
    insert_border(&mut mesh, steps, edge_bound);
    let mut queue = TriangleQueue { bound, heap: BinaryHeap::new(), needs: Vec::new() };
    for triangle in 0..mesh.triangles().len() as u32 {
        queue.update(&mesh, steps, triangle);
    }
    while let Some((triangle, index)) = queue.pop() {
        clock.check()?;
        let at = [index % steps.side() as u32, index / steps.side() as u32];
        mesh.insert(steps, at, triangle);
        // Only the triangles around the new vertex have changed.
        for place in 0..mesh.star().len() {
            queue.update(&mesh, steps, mesh.star()[place]);
        }
    }
    Ok(mesh)
}

/// Inserts the kept vertices of the four edges.
fn insert_border(mesh: &mut Delaunay, steps: &HeightSteps, bound: f64) {
    let side = steps.side();
    let last = side as u32 - 1;
    let column = |x: usize| steps.values().iter().skip(x).step_by(side).copied().collect::<Vec<_>>();
    let row = |y: usize| &steps.values()[y * side..][..side];
    let mut insert = |kept: Vec<u32>, at: &dyn Fn(u32) -> [u32; 2]| {
        // Insert the middle first, then the halves: in order, each vertex would flip all edges of the vertices before
        // it.
        let mut halves = vec![(0_usize, kept.len() - 1)];
        while let Some((start, end)) = halves.pop() {
            let middle = start.midpoint(end);
            if middle == start {
                continue;
            }
            let at = at(kept[middle]);
            let triangle = mesh.locate(at, mesh.triangles().len() as u32 - 1);
            mesh.insert(steps, at, triangle);
            halves.extend([(start, middle), (middle, end)]);
        }
    };
    insert(chain(row(0), bound), &|x| [x, 0]);
    insert(chain(row(side - 1), bound), &|x| [x, last]);
    insert(chain(&column(0), bound), &|y| [0, y]);
    insert(chain(&column(side - 1), bound), &|y| [last, y]);
}

/// The queue of triangles that are too far from the heights.
struct TriangleQueue {
    bound: f64,
    /// Pairs of a need and a triangle; some of the needs are outdated.
    heap: BinaryHeap<(u64, u32)>,
    /// The current need of each triangle, 0 if none.
    needs: Vec<u64>,
}

impl TriangleQueue {
    /// Computes the need of a triangle that is new or has changed.
    fn update(&mut self, mesh: &Delaunay, steps: &HeightSteps, triangle: u32) {
        let worst = FurthestVertex::beyond(steps, mesh.corners(triangle), self.bound);
        // The number of triangles only grows.
        if self.needs.len() <= triangle as usize {
            self.needs.resize(triangle as usize + 1, 0);
        }
        self.needs[triangle as usize] = if worst.is_beyond(self.bound) {
            let need = need(worst);
            self.heap.push((need, triangle));
            need
        } else {
            0
        };
    }

    /// Takes the triangle in greatest need of a vertex. Returns it and the index of that vertex in the steps' values.
    fn pop(&mut self) -> Option<(u32, u32)> {
        loop {
            let (need, triangle) = self.heap.pop()?;
            // A different need is outdated: the triangle's current need, if any, is in the heap too.
            if self.needs[triangle as usize] == need {
                return Some((triangle, !(need as u32)));
            }
        }
    }
}

/// Returns a number that orders by distance, and at equal distance by vertex, the first one being greatest. Never zero.
fn need(worst: FurthestVertex) -> u64 {
    let distance = (worst.scaled / worst.doubled_area) as f32;
    // The bits of positive floats sort like the floats. Indices are inverted, because the greatest number goes first.
    (distance.to_bits() as u64) << 32 | !worst.index as u64
}
