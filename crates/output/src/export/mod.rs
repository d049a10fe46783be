//! Exports: the files that a bake leaves, their formats, and the folder that holds them.
//!
//! ```text
//!   plan/      what is asked for, and the manifest of an old bake -> a checked plan, with its memory, disk and time
//!   formats/   tiles and features -> files: a file for each format
//!   folder/    where the files go: locks, checks, repair, and the files that describe every bake
//! ```

mod plan;
mod formats;
mod folder;

pub use crate::map::plotter::Lettering;
pub use folder::check::{BakeFault, Checked, Rebake, check};
pub use folder::look::{BakeState, Contents, look};
pub use folder::manifest::{Axes, HeightRange, Manifest, RegionRecord, ShardRecord};
pub use folder::merge::Shards;
pub use folder::repair::{Repaired, repair};
pub use folder::runs::{Run, runs};
pub use folder::{Cleaned, Mode, Output, clean, kept_warnings, registry};
pub use formats::Export;
pub use formats::atlas::{AtlasFiles, WrittenAtlas};
pub use formats::map_picture::{MapPicture, SMALLER, Texts};
pub use formats::profile::Profile;
pub use formats::raster::writer::{Sample, png_bytes};
pub use plan::cost::{Cost, Forecast, Trial};
pub use plan::digits::shortest_that;
pub use plan::measure::measured_range_m;
pub use plan::memory::{Limit, told as told_memory_bytes};
pub use plan::options::{Lods, MeshOptions, TileNames, VectorOptions};
pub use plan::request::PlanRequest;
pub use plan::{Bytes, Plan};
