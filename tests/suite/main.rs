//! All integration tests in one binary, so that they link once: a file a subject.

mod agents;
mod architecture;
mod bakes;
mod channels;
mod cli;
mod climates;
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
mod varied;
mod vector;
mod walker;
mod walks;
mod water;
mod wording;
mod worlds;

/// True in the long form of the suite (`TERRANE_LONG=1`): more seeds, presets and places by the same tests.
fn is_long() -> bool {
    std::env::var_os("TERRANE_LONG").is_some()
}
