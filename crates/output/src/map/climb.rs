//! The climb to a peak: from ground that is high in the land seen from afar, at coarse nodes, to the peak of the full
//! land that this ground belongs to.
//!
//! So maps of all scales show the same peaks. Coarse land is smoother than the full land, and there need be no peak
//! where the coarse land is highest.

use std::sync::Arc;

use crate::area::{Area, Stride};
use crate::clock::Clock;
use crate::fluvial::landforms::peaks::{self, Peak};
use crate::grid::Grid;
use crate::stop::Stopped;
use crate::world::World;

/// Factor by which the nodes of a step lie closer together than those of the step before.
const CLOSER: u64 = 8;

/// Largest distance between the nodes from which the climb goes on in the full land, as a share of the side of a cell
/// that has one peak.
const NEAR_CELLS: f64 = 0.25;

/// The climb to the peaks of a world from high ground at the nodes of a stride.
#[derive(Debug)]
pub(super) struct Climb {
    world: Arc<World>,
    from: Stride,
    /// The world at closer and closer nodes.
    steps: Vec<World>,
}

impl Climb {
    /// Creates the climb in a fluvial world.
    pub fn new(world: Arc<World>, from: Stride) -> Climb {
        let near = NEAR_CELLS * side(&world) as f64;
        let closer = |stride: &Stride| Stride::new(stride.vertices() as u64 / CLOSER);
        let strides = std::iter::successors(Some(from), closer);
        let steps = strides.take_while(|stride| stride.vertices() as f64 > near).filter_map(|stride| closer(&stride));
        let steps = steps.map(|stride| world.at_stride(stride)).collect();
        Climb { world, from, steps }
    }

    /// Returns the largest distance in vertices along each axis from a node to the peak above it.
    pub fn reach(&self) -> i64 {
        let nodes = std::iter::once(self.from).chain(self.steps.iter().map(World::stride));
        side(&self.world) + nodes.map(Stride::vertices).sum::<i64>()
    }

    /// Returns the peak above a node, which is given by its vertex; none if the land there has no peak that is the
    /// highest around.
    pub fn peak(&self, mut at: [i64; 2], clock: &Clock) -> Result<Option<Peak>, Stopped> {
        let mut wide = self.from.vertices();
        for step in &self.steps {
            let stride = step.stride().vertices();
            let [x, y] = at.map(|at| at / stride);
            let around = Area::new(x, y, 1, 1).padded((wide / stride) as usize);
            at = highest(&step.relief().land(around, clock)?.heights, around).0.map(|at| at * stride);
            wide = stride;
        }
        self.world.peak_above(at, clock)
    }
}

/// Returns the side in vertices of the cells of a world that have at most one peak each.
pub(super) fn side(world: &World) -> i64 {
    peaks::side(world.relief().fluvial().expect("worlds of noise have no peaks"))
}

/// Returns the highest node of an area and its height; of equal nodes the first, row by row.
pub(super) fn highest(heights: &Grid<f32>, area: Area) -> ([i64; 2], f32) {
    let mut highest = ([area.x0, area.y0], f32::MIN);
    for (x, y) in area.vertices() {
        if heights.at(x, y) > highest.1 {
            highest = ([x, y], heights.at(x, y));
        }
    }
    highest
}
