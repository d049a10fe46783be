//! The vertices that a surface needs, most needed first.
//!
//! Based on: Garland & Heckbert 1995, "Fast polygonal approximation of terrains and height fields": of all vertices the
//! one furthest from the surface is inserted, until none is too far.

use std::collections::BinaryHeap;

use super::border::chain;
use super::delaunay::Delaunay;
use super::steps::Steps;
use super::worst::Worst;
use crate::stop;

/// The triangulation whose every triangle is within `bound` steps of the heights, with the [`chain`] of each edge for
/// `edge_bound`, which is no wider, as its border.
pub fn triangulate(steps: &Steps, bound: f64, edge_bound: f64) -> Delaunay {
    let mut mesh = Delaunay::new(steps);
    insert_border(&mut mesh, steps, edge_bound);
    let mut queue = Queue { bound, heap: BinaryHeap::new(), needs: Vec::new() };
    for triangle in 0..mesh.triangles().len() as u32 {
        queue.update(&mesh, steps, triangle);
    }
    while let Some((triangle, index)) = queue.pop() {
        stop::check();
        let at = [index % steps.side() as u32, index / steps.side() as u32];
        mesh.insert(steps, at, triangle);
        // Only the triangles around the new vertex have changed.
        for place in 0..mesh.star().len() {
            queue.update(&mesh, steps, mesh.star()[place]);
        }
    }
    mesh
}

/// Inserts the kept vertices of the four edges.
fn insert_border(mesh: &mut Delaunay, steps: &Steps, bound: f64) {
    let side = steps.side();
    let last = side as u32 - 1;
    let column = |x: usize| steps.values().iter().skip(x).step_by(side).copied().collect::<Vec<_>>();
    let row = |y: usize| &steps.values()[y * side..][..side];
    let mut insert = |kept: Vec<u32>, at: &dyn Fn(u32) -> [u32; 2]| {
        // Halves first: in order, each would flip all edges of those before.
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

/// The triangles that are too far from the heights.
struct Queue {
    bound: f64,
    /// Need and triangle; some needs are of the past.
    heap: BinaryHeap<(u64, u32)>,
    /// The need of each triangle.
    needs: Vec<u64>,
}

impl Queue {
    /// Looks at a triangle that is new or has changed.
    fn update(&mut self, mesh: &Delaunay, steps: &Steps, triangle: u32) {
        let worst = Worst::beyond(steps, mesh.corners(triangle), self.bound);
        // Triangles only ever become more.
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

    /// The triangle in greatest need of a vertex, and the vertex's place in the steps' values.
    fn pop(&mut self) -> Option<(u32, u32)> {
        loop {
            let (need, triangle) = self.heap.pop()?;
            // Else the triangle has changed since: what it needs now is in the heap too, if anything.
            if self.needs[triangle as usize] == need {
                return Some((triangle, !(need as u32)));
            }
        }
    }
}

/// A number that orders by distance and then, the first before the others, by the vertex. Never zero.
fn need(worst: Worst) -> u64 {
    let distance = (worst.scaled / worst.doubled_area) as f32;
    // The bits of positive floats sort as the floats do; indices are turned over, since the greatest goes first.
    (distance.to_bits() as u64) << 32 | !worst.index as u64
}
