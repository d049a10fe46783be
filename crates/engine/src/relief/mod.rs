//! Relief: the height of any vertex, and the water on it if the relief is fluvial.

mod curve;
#[cfg(feature = "gpu")]
pub(crate) mod gpu_words;
mod noise;
mod strided;
pub mod settings;

#[cfg(feature = "gpu")]
pub(crate) use gpu_words::{PackedRelief, VertexBlock};
pub use noise::NoiseRelief;

use std::sync::Arc;

use crate::area::Area;
use crate::clock::{Clock, stage};
use crate::fluvial::Fluvial;
use crate::grid::Grid;
use crate::land::Land;
use crate::stop::Stopped;

/// A world's relief, shared by its copies. Heights are a pure function of the vertex: they have the same bits in
/// whatever area they are computed.
#[derive(Clone, Debug)]
pub enum Relief {
    /// Fractal noise, as in the thesis.
    Noise(Arc<NoiseRelief>),
    /// Fluvial land, shaped by water.
    Fluvial(Arc<Fluvial>),
}

impl Relief {
    /// Returns bounds that no height leaves, whatever the vertex: (lowest, highest) in metres.
    pub fn range_m(&self) -> (f32, f32) {
        match self {
            Relief::Noise(noise) => noise.range_m(),
            Relief::Fluvial(fluvial) => fluvial.range_m(),
        }
    }

    /// Returns the heights in metres at all vertices of `area`.
    pub fn heights(&self, area: Area) -> Grid<f32> {
        Clock::unstopped(|clock| self.land(area, clock)).heights
    }

    /// Returns heights and water at all vertices of `area`, and books the time of each stage on `clock`.
    ///
    /// # Errors
    /// When `clock` stops the work.
    pub fn land(&self, area: Area, clock: &Clock) -> Result<Land, Stopped> {
        match self {
            Relief::Noise(noise) => {
                let heights = clock.time(stage::RELIEF, || noise.heights(area, clock))??;
                Ok(Land { heights, water: None })
            }
            Relief::Fluvial(fluvial) => fluvial.land(area, clock),
        }
    }

    /// Returns the fluvial relief, or `None` for a relief of noise.
    pub fn fluvial(&self) -> Option<&Fluvial> {
        match self {
            Relief::Noise(_) => None,
            Relief::Fluvial(fluvial) => Some(fluvial),
        }
    }
}
