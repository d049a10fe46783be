//! Tests that are slow for their own sake: the laws of the suite for more seeds and presets. `.ci/run` runs them.

#[path = "../suite/channels.rs"]
mod channels;
#[path = "../suite/cost.rs"]
mod cost;
#[path = "../suite/simd.rs"]
mod simd;
mod varied;
#[path = "../suite/worlds.rs"]
mod worlds;

/// Seeds of the worlds whose laws are checked.
const SEEDS: std::ops::RangeInclusive<u64> = 2..=4;

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

/// Presets that the suite tries with all instruction sets.
const WITHOUT: &[&str] = &["thesis", "archipelago", "canyon"];
