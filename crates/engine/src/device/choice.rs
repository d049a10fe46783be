//! The choice of the device on which a bake computes.

use std::str::FromStr;
use std::sync::Arc;

#[cfg(feature = "gpu")]
use super::gpu::{Adapter, Gpu, NoiseMaker, adapters};
use super::{Cpu, LandMaker};
use crate::error::{Error, nearest};
use crate::relief::{NoiseRelief, Relief};
use crate::simd::Level;
#[cfg(feature = "gpu")]
use crate::tile::GroundRule;
use crate::world::World;

/// Device requested by the user.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Device {
    /// A GPU if one is available, can make this land, and gives the bits of the CPU; otherwise the CPU.
    Auto,
    /// The CPU.
    #[default]
    Cpu,
    /// A GPU, or a software implementation of one.
    Gpu,
}

/// Default side of a GPU's workgroups, in threads.
pub const GROUP_SIDE: u32 = 8;

impl Device {
    /// All devices.
    pub const ALL: [Device; 3] = [Device::Auto, Device::Cpu, Device::Gpu];

    /// Returns the name, as used on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Device::Auto => "auto",
            Device::Cpu => "cpu",
            Device::Gpu => "gpu",
        }
    }

    /// Describes the CPU with the vector instructions that are used.
    pub fn cpu_name() -> String {
        let level = Level::chosen().map_or_else(|_| "scalar".to_owned(), |level| level.name().to_owned());
        format!("cpu, {level}")
    }

    /// Returns the maker of a world's land and tiles on this device. On a GPU, workgroups have `group_side` by
    /// `group_side` threads: 8, 16 or 32. If the CPU is used although a GPU was allowed, the reason is returned too:
    /// land with rivers is always made by the CPU.
    ///
    /// # Errors
    /// When a GPU is required, but none is available or usable.
    pub fn maker(self, world: &World, group_side: u32) -> Result<(Arc<dyn LandMaker>, Option<String>), Error> {
        let cpu = Cpu::maker(world.relief());
        let because = |reason: &str| Some(format!("the CPU makes the land: {reason}"));
        let noise = match (self, world.relief()) {
            (Device::Cpu, _) => return Ok((cpu, None)),
            (_, Relief::Fluvial(_)) => return Ok((cpu, because("GPUs make land of noise alone, and this has rivers"))),
            (_, Relief::Noise(noise)) => noise,
        };
        match gpu_maker(world, noise, group_side, self == Device::Gpu) {
            Ok(maker) => Ok((maker, None)),
            Err(reason) if self == Device::Auto => Ok((cpu, because(&reason))),
            Err(message) => Err(Error::Device { message, hint: "--device auto takes the CPU then".into() }),
        }
    }
}

#[cfg(feature = "gpu")]
fn gpu_maker(
    world: &World,
    noise: &Arc<NoiseRelief>,
    group_side: u32,
    takes_software: bool,
) -> Result<Arc<dyn LandMaker>, String> {
    let adapters = adapters();
    let is_taken = |adapter: &&Adapter| takes_software || !adapter.is_software();
    let Some(adapter) = adapters.iter().find(is_taken) else {
        return Err(match adapters.first() {
            Some(adapter) => format!("{} is no GPU, but a program for the CPU", adapter.name()),
            None => "no GPU is there, or no driver of it can be reached".into(),
        });
    };
    let gpu = Arc::new(Gpu::open(adapter, group_side)?);
    let maker = NoiseMaker::new(gpu, Arc::clone(noise), GroundRule::of(world));
    maker.probe()?;
    Ok(Arc::new(maker))
}

#[cfg(not(feature = "gpu"))]
fn gpu_maker(_: &World, _: &Arc<NoiseRelief>, _: u32, _: bool) -> Result<Arc<dyn LandMaker>, String> {
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
