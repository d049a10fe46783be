//! Slowly varying numbers on a lattice of their own, interpolated between its nodes.

use std::sync::Arc;

use crate::grain_point::Point;
use crate::memory::{Memory, Remembers};

/// Nodes a side of a patch. The nodes of a patch are computed and cached together.
const PATCH: i64 = 16;

/// Rows and columns of nodes that a patch has beyond its own, so that it answers for all places between them.
const BEYOND: [i64; 2] = [1, 2];

/// Nodes a side of a patch, with those beyond its own.
const STORED: i64 = PATCH + BEYOND[0] + BEYOND[1];

/// A patch of nodes: its column and row.
type SplinePatch = (i64, i64);

/// `N` numbers for each place, known at the nodes of a lattice. Between nodes they follow a cubic B-spline: smooth, with
/// continuous curvature, and never beyond the nodes' least and greatest number.
#[derive(Debug)]
pub struct SplineLattice<const N: usize> {
    /// Grains from one node to the next.
    step: i64,
    patches: Memory<SplinePatch, Vec<[f32; N]>>,
}

impl<const N: usize> SplineLattice<N> {
    /// Makes a lattice with so many grains from node to node, which remembers up to `bytes` bytes of its nodes.
    pub fn new(step: f64, bytes: usize) -> SplineLattice<N> {
        SplineLattice { step: step.round().max(1.0) as i64, patches: Memory::new(bytes) }
    }

    /// Returns the cache.
    pub fn memory(&self) -> &dyn Remembers {
        &self.patches
    }

    /// Returns the numbers at places. `make` computes those of nodes.
    pub fn at_all(&self, places: &[Point], make: impl Fn(&[Point]) -> Vec<[f32; N]>) -> Vec<[f64; N]> {
        let side = PATCH * self.step;
        let mut last: Option<(SplinePatch, Arc<Vec<[f32; N]>>)> = None;
        let at = |at: &Point| {
            let patch = (at.x.div_euclid(side), at.y.div_euclid(side));
            let nodes = match last.take().filter(|(own, _)| *own == patch) {
                Some((_, nodes)) => nodes,
                None => self.patches.get(patch, || make(&self.nodes(patch))),
            };
            let value = self.between(&nodes, [at.x.rem_euclid(side), at.y.rem_euclid(side)]);
            last = Some((patch, nodes));
            value
        };
        places.iter().map(at).collect()
    }

    /// Returns the places of the nodes of a patch, row by row.
    fn nodes(&self, (column, row): SplinePatch) -> Vec<Point> {
        let first = [column * PATCH - BEYOND[0], row * PATCH - BEYOND[0]];
        let node = |n: i64| Point { x: (first[0] + n % STORED) * self.step, y: (first[1] + n / STORED) * self.step };
        (0..STORED * STORED).map(node).collect()
    }

    /// Interpolates between the nodes of a patch, at a place some grains east and south of its corner.
    fn between(&self, nodes: &[[f32; N]], [x, y]: [i64; 2]) -> [f64; N] {
        let (column, row) = (x / self.step, y / self.step);
        let along = |grains: i64| weights((grains % self.step) as f64 / self.step as f64);
        let (east, south) = (along(x), along(y));
        let mut sum = [0.0; N];
        for (j, of_row) in south.into_iter().enumerate() {
            let first = ((row + j as i64) * STORED + column) as usize;
            for (node, of_column) in nodes[first..first + 4].iter().zip(east) {
                let weight = of_row * of_column;
                for (sum, value) in sum.iter_mut().zip(node) {
                    *sum += weight * f64::from(*value);
                }
            }
        }
        sum
    }
}

/// Returns the weights of four nodes in a row at a share of the way from the second to the third.
fn weights(t: f64) -> [f64; 4] {
    let left = 1.0 - t;
    let (t2, left2) = (t * t, left * left);
    let inner = |near: f64, far2: f64| (4.0 - 6.0 * far2 + 3.0 * far2 * (1.0 - near)) / 6.0;
    [left2 * left / 6.0, inner(left, t2), inner(t, left2), t2 * t / 6.0]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A lattice whose nodes have their own coordinates, in steps, as numbers.
    fn coordinates(places: &[Point]) -> Vec<[f64; 2]> {
        let lattice: SplineLattice<2> = SplineLattice::new(100.0, 1 << 20);
        lattice
            .at_all(places, |nodes| nodes.iter().map(|node| [node.x as f32 / 100.0, node.y as f32 / 100.0]).collect())
    }

    #[test]
    fn a_spline_of_a_plane_is_the_plane_across_all_patches() {
        let places: Vec<Point> = (-3000..3000).step_by(7).map(|x| Point { x, y: 2 * x + 50 }).collect();
        for (place, [x, y]) in places.iter().zip(coordinates(&places)) {
            assert!(
                (x - place.x as f64 / 100.0).abs() < 1e-5 && (y - place.y as f64 / 100.0).abs() < 1e-5,
                "{place:?}"
            );
        }
    }

    #[test]
    fn the_weights_of_nodes_add_up_to_one() {
        for t in [0.0, 0.25, 0.5, 0.9] {
            assert!((weights(t).iter().sum::<f64>() - 1.0).abs() < 1e-12);
            assert!(weights(t).iter().all(|weight| *weight >= 0.0));
        }
    }
}
