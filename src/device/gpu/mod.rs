//! Land of noise on a GPU: the shader `shaders/relief.wgsl`, a thread a vertex, with the bits of the CPU.
//!
//! ```text
//!   adapter.rs   which GPUs there are, and one of them opened
//!   maker.rs     areas -> blocks -> submissions -> heights
//!   probe.rs     whether this GPU gives the bits of the CPU
//! ```
//!
//! A GPU and its driver may fuse, reorder and round as the rules of Vulkan, Metal and DirectX let them. So the shader takes care
//! that they cannot know what they would be reordering (`shaders/exact.wgsl`), and the probe looks whether that held.

mod adapter;
mod maker;
mod probe;
#[cfg(test)]
mod tests;

#[cfg(test)]
use adapter::relief_shader;
pub use adapter::{Adapter, Arithmetic, Gpu, adapters};
pub use maker::GpuMaker;
pub use probe::probe;
