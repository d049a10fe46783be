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
mod tile_sizes;
mod vector;
mod walker;
mod walks;
mod water;
mod worlds;

/// Bakes of which it is measured what they take: preset, size, and exports one after the other; none are all.
const BAKES: &[(&str, &str, &[&str])] = &[
    ("thesis", "6x6", &["height,blend,normal,map", "water", "vector", "splines", "gltf-region", "web"]),
    ("archipelago", "6x6", &["vector,splines,water"]),
];

/// `tests/long` has the same tests for what takes longer.
const IS_LONG: bool = false;
