//! What computes land: the CPU, which is the reference, or a GPU that gives the same bytes.
//!
//! ```text
//!   choice.rs    which device is taken, of those that are asked for and there
//!   gpu/         land and tiles on a GPU, by the shaders in shaders/
//! ```
//!
//! A bake is handed a [`LandMaker`] beside its world, and asks it for several tiles at once, a walker for the land of several.
//! Whatever else asks for land, as agents do, asks the world itself: it makes no difference, byte for byte.

mod choice;
#[cfg(feature = "gpu")]
pub mod gpu;

use std::fmt::Debug;
use std::sync::Arc;

use rayon::prelude::*;

pub use choice::{Device, GROUP_SIDE};

use crate::area::Area;
use crate::clock::Clock;
use crate::land::Land;
use crate::relief::Relief;
use crate::tile::{Tile, TilePlan};
use crate::world::World;

/// What makes the land of areas, as it is before any line shapes it, and tiles of it.
pub trait LandMaker: Debug + Send + Sync {
    /// What it computes on, in a few words.
    fn name(&self) -> String;

    /// Bytes of memory that it takes of the CPU's at most, when so many threads ask it.
    fn host_bytes(&self, _threads: usize) -> u64 {
        0
    }

    /// For how many tiles it would rather be asked at once.
    fn together(&self) -> usize;

    /// The land of each area, with the time of each stage booked on `clock`.
    fn lands(&self, areas: &[Area], clock: &Clock) -> Vec<Land>;

    /// The tiles of plans in `world`, the one whose land it makes, with the time of each stage booked on `clock`.
    fn tiles(&self, world: &World, plans: Vec<TilePlan>, clock: &Clock) -> Vec<Tile> {
        self.tiles_of_lands(world, plans, clock)
    }

    /// The same, with all but the [lands](LandMaker::lands) made by the CPU.
    fn tiles_of_lands(&self, world: &World, plans: Vec<TilePlan>, clock: &Clock) -> Vec<Tile> {
        let lands = self.lands(&plans.iter().map(|plan| plan.land).collect::<Vec<Area>>(), clock);
        let made = plans.into_par_iter().zip(lands);
        made.map(|(plan, land)| Tile::of_plan(world, plan, land, clock)).collect()
    }

    /// What went wrong with it, if anything did: what it could not make itself was made by the CPU.
    fn trouble(&self) -> Option<String> {
        None
    }
}

/// The CPU as a maker of land.
#[derive(Clone, Debug)]
pub struct Cpu {
    relief: Relief,
}

impl Cpu {
    /// A maker of the land of a relief.
    pub fn maker(relief: &Relief) -> Arc<dyn LandMaker> {
        Arc::new(Cpu { relief: relief.clone() })
    }
}

impl LandMaker for Cpu {
    fn name(&self) -> String {
        Device::cpu_name()
    }

    fn together(&self) -> usize {
        1
    }

    fn lands(&self, areas: &[Area], clock: &Clock) -> Vec<Land> {
        areas.par_iter().map(|area| self.relief.land(*area, clock)).collect()
    }
}
