//! Devices that compute land: the CPU, which is the reference, or a GPU that gives the same bytes.
//!
//! ```text
//!   choice.rs    the choice of a device that is available and allowed
//!   gpu/         land and tiles on a GPU, by the shaders in shaders/
//! ```
//!
//! A bake gets a [`LandMaker`] beside its world and asks it for several tiles at once; a walker asks it for the land of
//! several tiles. Everything else that needs land, such as agents, asks the world itself. The bytes are the same either
//! way.

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
use crate::stop::Stopped;
use crate::tile::{Tile, TilePlan};
use crate::world::World;

/// Makes the land of areas, before lines shape it, and tiles on this land.
#[expect(clippy::missing_errors_doc, reason = "the only error of what takes a clock is that this stops it")]
pub trait LandMaker: Debug + Send + Sync {
    /// Describes the device in a few words.
    fn name(&self) -> String;

    /// Returns the largest number of bytes of the CPU's memory that the maker takes when this many threads use it.
    fn host_bytes(&self, _threads: usize) -> u64 {
        0
    }

    /// Returns the number of tiles that the maker should best be asked for at once.
    fn together(&self) -> usize;

    /// Makes the land of each area, and books the time of each stage on `clock`.
    fn lands(&self, areas: &[Area], clock: &Clock) -> Result<Vec<Land>, Stopped>;

    /// Makes tiles from plans in `world`, which must be the world of this maker's land, and books the time of each
    /// stage on `clock`.
    fn tiles(&self, world: &World, plans: Vec<TilePlan>, clock: &Clock) -> Result<Vec<Tile>, Stopped> {
        self.tiles_of_lands(world, plans, clock)
    }

    /// Makes the same tiles, but only their [lands](LandMaker::lands) on the device and the rest on the CPU.
    fn tiles_of_lands(&self, world: &World, plans: Vec<TilePlan>, clock: &Clock) -> Result<Vec<Tile>, Stopped> {
        let lands = self.lands(&plans.iter().map(|plan| plan.land).collect::<Vec<Area>>(), clock)?;
        let made = plans.into_par_iter().zip(lands);
        made.map(|(plan, land)| Tile::of_plan(world, plan, land, clock)).collect()
    }

    /// Returns the first error of the device, if there was one. Whatever the device could not make, the CPU has made.
    fn trouble(&self) -> Option<String> {
        None
    }
}

/// The CPU as a land maker.
#[derive(Clone, Debug)]
pub struct Cpu {
    relief: Relief,
}

impl Cpu {
    /// Creates a maker of a relief's land.
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

    fn lands(&self, areas: &[Area], clock: &Clock) -> Result<Vec<Land>, Stopped> {
        areas.par_iter().map(|area| self.relief.land(*area, clock)).collect()
    }
}
