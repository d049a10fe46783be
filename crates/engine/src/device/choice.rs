//! Which device a bake computes on, of those that are asked for and there.

use std::str::FromStr;
use std::sync::Arc;

#[cfg(feature = "gpu")]
use super::gpu::{Adapter, Arithmetic, FluvialMaker, Gpu, NoiseMaker, adapters};
use super::{Cpu, LandMaker};
use crate::error::{Error, nearest};
#[cfg(feature = "gpu")]
use crate::relief::Relief;
use crate::simd::Level;
#[cfg(feature = "gpu")]
use crate::tile::GroundRule;
use crate::world::World;

/// What is asked to compute.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Device {
    /// A GPU if one is there, makes the land in question, and gives the bits of the CPU; else the CPU.
    Auto,
    /// The CPU.
    #[default]
    Cpu,
    /// A GPU, or a program that does as if it were one.
    Gpu,
}

/// How a GPU is used, where one is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GpuOptions {
    /// Threads to a side of its groups: 8, 16 or 32.
    pub group_side: u32,
    /// Whether it computes as fast as it can, and only nearly as the CPU does: land of noise, and tiles of that.
    pub is_approximate: bool,
}

impl Default for GpuOptions {
    fn default() -> GpuOptions {
        GpuOptions { group_side: 8, is_approximate: false }
    }
}

impl Device {
    /// All of them.
    pub const ALL: [Device; 3] = [Device::Auto, Device::Cpu, Device::Gpu];

    /// The name, as the command knows it.
    pub fn name(self) -> &'static str {
        match self {
            Device::Auto => "auto",
            Device::Cpu => "cpu",
            Device::Gpu => "gpu",
        }
    }

    /// The CPU's instructions that are used.
    pub fn cpu_name() -> String {
        let level = Level::chosen().map_or_else(|_| "scalar".to_owned(), |level| level.name().to_owned());
        format!("cpu, {level}")
    }

    /// What makes the land and the tiles of a world on this device; and for [`Auto`](Device::Auto), why that is not a GPU.
    ///
    /// # Errors
    /// When a GPU is asked for, and none is there or can be used.
    pub fn maker(self, world: &World, options: GpuOptions) -> Result<(Arc<dyn LandMaker>, Option<String>), Error> {
        let cpu = Cpu::maker(world.relief());
        match self {
            Device::Cpu => Ok((cpu, None)),
            Device::Auto => Ok(match gpu_maker(world, options, false) {
                Ok(maker) => (maker, None),
                Err(reason) => (cpu, Some(format!("the CPU makes the land: {reason}"))),
            }),
            Device::Gpu => match gpu_maker(world, options, true) {
                Ok(maker) => Ok((maker, None)),
                Err(message) => Err(Error::Device { message, hint: "--device auto takes the CPU then".into() }),
            },
        }
    }
}

#[cfg(feature = "gpu")]
fn gpu_maker(world: &World, options: GpuOptions, takes_software: bool) -> Result<Arc<dyn LandMaker>, String> {
    let adapters = adapters();
    let is_taken = |adapter: &&Adapter| takes_software || !adapter.is_software();
    let Some(adapter) = adapters.iter().find(is_taken) else {
        return Err(match adapters.first() {
            Some(adapter) => format!("{} is no GPU, but a program for the CPU", adapter.name()),
            None => "no GPU is there, or no driver of it can be reached".into(),
        });
    };
    let GpuOptions { group_side, is_approximate } = options;
    let arithmetic = if is_approximate { Arithmetic::Approximate } else { Arithmetic::Exact };
    let gpu = Arc::new(Gpu::open(adapter, group_side, arithmetic)?);
    match world.relief() {
        Relief::Noise(noise) => {
            let maker = NoiseMaker::new(gpu, Arc::clone(noise), GroundRule::of(world));
            maker.probe()?;
            Ok(Arc::new(maker))
        }
        Relief::Fluvial(_) if is_approximate => Err("GPUs make land with rivers exactly or not at all".into()),
        Relief::Fluvial(fluvial) => {
            let maker = FluvialMaker::new(gpu, Arc::clone(fluvial));
            maker.probe()?;
            Ok(Arc::new(maker))
        }
    }
}

#[cfg(not(feature = "gpu"))]
fn gpu_maker(_: &World, _: GpuOptions, _: bool) -> Result<Arc<dyn LandMaker>, String> {
    Err("this terrane was built without GPUs (feature gpu)".into())
}

impl FromStr for Device {
    type Err = Error;

    fn from_str(name: &str) -> Result<Device, Error> {
        Device::ALL.into_iter().find(|device| device.name() == name).ok_or_else(|| {
            let names = || Device::ALL.into_iter().map(Device::name);
            let list = names().collect::<Vec<_>>().join(", ");
            Error::Option {
                message: format!("there is no device named {name:?}"),
                hint: match nearest(name, names()) {
                    Some(meant) => format!("did you mean {meant}? devices: {list}"),
                    None => format!("devices: {list}"),
                },
            }
        })
    }
}
