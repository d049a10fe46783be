//! Whose arithmetic the bytes of a bake have.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Whose arithmetic the bytes of a bake have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum DeviceProfile {
    /// The CPU's: the reference, the same bytes on every machine, and on each GPU that is used.
    Cpu,
    /// A GPU's, as fast as it can: nearly the CPU's, and not the same on another GPU.
    GpuApproximate,
}
