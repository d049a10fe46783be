//! Whether a GPU gives the bits of the CPU: looked at, for no rule promises it.

use std::sync::Arc;

use serde::Deserialize;

use super::adapter::{Adapter, Arithmetic, Gpu};
use super::maker::GpuMaker;
use crate::area::{Area, MAX_COORDINATE, Stride};
use crate::relief::NoiseRelief;
use crate::relief::settings::{LandMask, NoiseTerm, WarpSettings};

/// Sides of the areas that are compared: several blocks, whole ones and parts.
const SIDES: [usize; 2] = [200, 100];

/// Whether a GPU makes land of noise with the bits of the CPU: of every kind of fractal, with waves of all lengths, warped, through
/// curves and masks.
///
/// # Errors
/// A sentence that says what differs first, or what the GPU does not take.
pub fn probe(adapter: &Adapter) -> Result<(), String> {
    let gpu = Arc::new(Gpu::open(adapter, 8, Arithmetic::Exact)?);
    probed().into_iter().try_for_each(|relief| GpuMaker::new(Arc::clone(&gpu), Arc::new(relief)).probe())
}

/// Land with all that the kernel knows.
fn probed() -> Vec<NoiseRelief> {
    #[derive(Deserialize)]
    struct Probed {
        relief: Vec<Settings>,
    }
    #[derive(Deserialize)]
    struct Settings {
        noise: Vec<NoiseTerm>,
        warp: Option<WarpSettings>,
        land: Option<LandMask>,
    }
    let probed: Probed = toml::from_str(include_str!("probe.toml")).expect("what a preset may say");
    let relief = |Settings { mut noise, warp, land }: Settings| {
        noise.iter_mut().for_each(NoiseTerm::fill_defaults);
        NoiseRelief::new(&noise, warp.as_ref(), land.as_ref(), (1.0, Stride::ONE), 9)
    };
    probed.relief.into_iter().map(relief).collect()
}

impl GpuMaker {
    /// Compares the heights of some areas, near and far, with those of the CPU.
    ///
    /// # Errors
    /// A sentence that says what differs first.
    pub fn probe(&self) -> Result<(), String> {
        let near = [(0, 0), (-517, 211), (70_001, -40_003)];
        let far = [(1 << 31, -(1 << 33)), (-(1 << 47) - 5, 1 << 50), (MAX_COORDINATE - 300, -MAX_COORDINATE + 77)];
        let [width, height] = SIDES;
        let areas: Vec<Area> = near.into_iter().chain(far).map(|(x, y)| Area::new(x, y, width, height)).collect();
        let made = self
            .heights(&areas)
            .ok_or_else(|| self.gpu.trouble().unwrap_or_else(|| format!("{}: gave no heights", self.gpu.name)))?;
        for (area, made) in areas.iter().zip(made) {
            let reference = self.relief.heights(*area);
            let pairs = area.vertices().zip(made.values().iter().zip(reference.values()));
            for ((x, y), (made, reference)) in pairs {
                if made.to_bits() != reference.to_bits() {
                    return Err(format!(
                        "{}: the height at {x}, {y} is {made} m there, and {reference} m on the CPU",
                        self.gpu.name
                    ));
                }
            }
        }
        Ok(())
    }
}
