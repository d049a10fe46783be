//! The climb to a peak: from ground that is high as it is seen from afar, to the peak of the whole land that it belongs to.
//!
//! Maps of all scales show the same peaks so. Land from afar is smoother than it is, and where it is highest no peak need be.

use std::sync::Arc;

use crate::area::{Area, Stride};
use crate::fluvial::landforms::peaks::{self, Peak};
use crate::grid::Grid;
use crate::stop;
use crate::world::World;

/// How many times closer the nodes of the next step lie.
const CLOSER: u64 = 8;

/// Nodes are this share of a cell of peaks wide at most where the climb goes on in the whole land.
const NEAR_CELLS: f64 = 0.25;

/// The way up to the peaks of a world from high ground at the nodes of a stride.
#[derive(Debug)]
pub(super) struct Climb {
    world: Arc<World>,
    from: Stride,
    /// The world at closer and closer nodes.
    steps: Vec<World>,
}

impl Climb {
    /// The way up in a fluvial world.
    pub fn new(world: Arc<World>, from: Stride) -> Climb {
        let near = NEAR_CELLS * side(&world) as f64;
        let closer = |stride: &Stride| Stride::new(stride.vertices() as u64 / CLOSER);
        let strides = std::iter::successors(Some(from), closer);
        let steps = strides.take_while(|stride| stride.vertices() as f64 > near).filter_map(|stride| closer(&stride));
        let steps = steps.map(|stride| world.at_stride(stride)).collect();
        Climb { world, from, steps }
    }

    /// Vertices to each side within which the peak above a node lies.
    pub fn reach(&self) -> i64 {
        let nodes = std::iter::once(self.from).chain(self.steps.iter().map(World::stride));
        side(&self.world) + nodes.map(Stride::vertices).sum::<i64>()
    }

    /// The peak above a node, given by its vertex; none if the land there has no peak that is the highest around.
    pub fn peak(&self, mut at: [i64; 2]) -> Option<Peak> {
        let mut wide = self.from.vertices();
        for step in &self.steps {
            stop::check();
            let stride = step.stride().vertices();
            let [x, y] = at.map(|at| at / stride);
            let around = Area::new(x, y, 1, 1).padded((wide / stride) as usize);
            at = highest(&step.relief().heights(around), around).0.map(|at| at * stride);
            wide = stride;
        }
        self.world.peak_above(at)
    }
}

/// Vertices a side of the cells of a world that have one peak at most.
pub(super) fn side(world: &World) -> i64 {
    peaks::side(world.relief().fluvial().expect("worlds of noise have no peaks"))
}

/// The highest of the nodes of an area; of equals the first, row by row.
pub(super) fn highest(heights: &Grid<f32>, area: Area) -> ([i64; 2], f32) {
    let mut highest = ([area.x0, area.y0], f32::MIN);
    for (x, y) in area.vertices() {
        if heights.at(x, y) > highest.1 {
            highest = ([x, y], heights.at(x, y));
        }
    }
    highest
}
