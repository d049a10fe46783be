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

/// Bakes of which it is measured what they take: preset, size, and exports one after the other; none are all.
const BAKES: &[(&str, &str, &[&str])] = &[
    ("thesis", "8x8", &[]),
    // The exports whose files or work depend on rivers, roads or a sea: each takes a plan of roads twice.
    (
        "archipelago",
        "8x8",
        &[
            "exr",
            "map",
            "water",
            "depth-tiles",
            "flow-geotiff",
            "accumulation",
            "scatter-tiles",
            "instances",
            "splines",
            "vector",
            "geojson",
            "gltf",
            "gltf-region",
            "obj",
            "collision",
            "web",
        ],
    ),
    ("hills", "24x4", &["height,exr,map-tiles"]),
    ("alps", "1x1", &["hashes"]),
    ("plains", "12x12", &["height,geojson"]),
    ("canyon", "24x24", &["hashes"]),
];
