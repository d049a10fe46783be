//! Land and tiles of it on a GPU: the shaders in `shaders/`, a thread a vertex, with the bits of the CPU.
//!
//! ```text
//!   adapter.rs   which GPUs there are, and one of them opened
//!   job.rs       land and tiles that are asked for -> bands of rows -> submissions
//!   slot.rs      the buffers of submissions
//!   noise.rs     submissions -> kernel after kernel -> planes -> land of noise and tiles of it
//!   probe.rs     whether this GPU gives the bits of the CPU
//! ```
//!
//! A GPU and its driver may fuse, reorder and round as the rules of Vulkan, Metal and DirectX let them. So the shader takes care
//! that they cannot know what they would be reordering (`shaders/exact.wgsl`), and the probe looks whether that held.

mod adapter;
mod job;
mod noise;
mod probe;
mod slot;
#[cfg(test)]
mod tests;

pub use adapter::{Adapter, Gpu, adapters};
pub use noise::NoiseMaker;
pub use probe::probe;
