//! Tests that are slow for their own sake: those of the suite for more seeds, presets and places. `.ci/run` runs them.

#[path = "../suite/bakes.rs"]
mod bakes;
#[path = "../suite/channels.rs"]
mod channels;
#[path = "../suite/cost.rs"]
mod cost;
#[path = "../suite/desk.rs"]
mod desk;
#[path = "../suite/features.rs"]
mod features;
#[path = "../suite/folders.rs"]
mod folders;
#[path = "../suite/golden.rs"]
mod golden;
#[path = "../suite/places.rs"]
mod places;
#[path = "../suite/presets_land.rs"]
mod presets_land;
#[path = "../suite/range.rs"]
mod range;
#[path = "../suite/seams.rs"]
mod seams;
#[path = "../suite/simd.rs"]
mod simd;
#[path = "../suite/stops.rs"]
mod stops;
mod varied;
#[path = "../suite/worlds.rs"]
mod worlds;

/// The suite has the same tests for what takes less.
const IS_LONG: bool = true;

/// Bakes whose memory is measured: preset, size, threads, exports. More threads than cores hold more or less by chance.
const BAKES: &[(&str, &str, &str, &str)] = &[
    ("thesis", "3x30", "2", "height,blend"),
    ("hills", "12x4", "1", "height,exr,map-tiles"),
    ("archipelago", "2x2", "2", "height,vector"),
    ("alps", "1x1", "1", "hashes"),
    ("alps", "4x4", "2", "hashes"),
    ("alps", "8x8", "2", "height,blend,normal,map"),
    ("plains", "6x6", "2", "height,geojson"),
    ("canyon", "12x12", "2", "hashes"),
    ("highlands", "3x3", "2", "height,blend,normal,map"),
];

/// How often each is baked.
const TIMES: usize = 3;
