//! Land and tiles on a GPU: the shaders in `shaders/` run one thread per vertex and give the bits of the CPU.
//!
//! ```text
//!   adapter.rs      the available GPUs, and one of them opened
//!   bands.rs        requested land and tiles -> bands of rows -> submissions
//!   submission.rs   submissions and their buffers
//!   noise.rs        submissions -> kernel after kernel -> planes -> land of noise and tiles of it
//!   probe.rs        the test whether this GPU gives the bits of the CPU
//! ```
//!
//! The rules of Vulkan, Metal and DirectX allow a GPU and its driver to fuse, reorder and round operations. So the
//! shaders hide from the compiler what could be reordered (`shaders/exact.wgsl`), and the probe tests whether that
//! worked.

mod adapter;
mod bands;
mod noise;
mod probe;
mod submission;
#[cfg(test)]
mod tests;

pub use adapter::{Adapter, Gpu, adapters};
pub use noise::NoiseMaker;
pub use probe::probe;
