//! All integration tests in one binary, so that they link once: a file a subject.

mod agents;
mod architecture;
mod bakes;
mod channels;
mod cli;
mod cost;
mod desk;
mod disks;
mod explore;
mod far;
mod features;
mod fluvial;
mod folders;
mod golden;
mod maps;
mod masks;
mod meshes;
mod places;
mod presets;
mod presets_land;
mod profiles;
mod range;
mod resume;
mod seams;
mod shards;
mod simd;
mod stops;
mod strides;
mod vector;
mod walker;
mod walks;
mod water;
mod worlds;

/// Bakes whose memory is measured: preset, size, threads, exports.
const BAKES: &[(&str, &str, &str, &str)] = &[("thesis", "8x8", "2", "height,blend,normal,map")];

/// How often each is baked.
const TIMES: usize = 3;

/// `tests/long` has the same tests for what takes longer.
const IS_LONG: bool = false;
