//! What a bake is computed on.

use std::str::FromStr;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::error::{Error, nearest};

/// What a bake was computed on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum DeviceProfile {
    /// The CPU: the reference, the same bytes on every machine.
    Cpu,
}

impl DeviceProfile {
    /// All devices.
    pub const ALL: [DeviceProfile; 1] = [DeviceProfile::Cpu];

    /// The name, as the command knows it.
    pub fn name(self) -> &'static str {
        match self {
            DeviceProfile::Cpu => "cpu",
        }
    }
}

impl FromStr for DeviceProfile {
    type Err = Error;

    fn from_str(name: &str) -> Result<DeviceProfile, Error> {
        DeviceProfile::ALL.into_iter().find(|device| device.name() == name).ok_or_else(|| {
            let names = || DeviceProfile::ALL.into_iter().map(DeviceProfile::name);
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
