//! Fluvial tiles on one thread: nanoseconds a vertex by stage, as the tables of docs/speed.md.
//!
//! `cargo bench --bench fluvial` makes 16 x 16 tiles of each fluvial preset from nothing, channels and roads among them.
//! `TERRANE_SIMD=avx2` and the like choose the instruction set.

use terrane::area::TileId;
use terrane::clock::{Clock, stage};
use terrane::preset::{BUILT_IN, Preset};
use terrane::simd::Level;
use terrane::tile::Tile;
use terrane::world::World;

const TILES: i64 = 16;

/// The stages of a tile's land.
const STAGES: [&str; 13] = [
    stage::NETWORK,
    stage::WARP,
    stage::VALLEYS,
    stage::GULLIES,
    stage::MORAINES,
    stage::BARRIERS,
    stage::GLACIERS,
    stage::COAST,
    stage::BREACHES,
    stage::WATER,
    stage::IMPRINT,
    stage::NORMALS,
    stage::BLEND,
];

fn main() {
    let level = Level::chosen().expect("the variable names a level of this CPU");
    println!("One thread, {}, {TILES} x {TILES} tiles; ns a vertex:\n", level.name());
    println!("| preset | {} | land in all | {} |", STAGES.join(" | "), stage::LINES);
    println!("|---|{}", "---|".repeat(STAGES.len() + 2));
    for (name, text) in BUILT_IN {
        let mut preset = Preset::parse(name, text).expect("it is built in");
        if preset.fluvial.is_none() {
            continue;
        }
        // Roads ask for channels before the land does, which then finds them made: the land is timed in a world
        // without.
        let with_roads = spent(preset.clone());
        preset.places = None;
        let land_alone = spent(preset);
        let nanoseconds = |stage: &str| {
            let stages = if [stage::IMPRINT, stage::LINES].contains(&stage) { &with_roads } else { &land_alone };
            stages.iter().find(|(name, _)| name == stage).map_or(0.0, |(_, nanoseconds)| *nanoseconds)
        };
        let cells: Vec<String> = STAGES.iter().map(|stage| format!("{:.1}", nanoseconds(stage))).collect();
        let land: f64 = STAGES.iter().map(|stage| nanoseconds(stage)).sum();
        println!("| {name} | {} | {land:.0} | {:.0} |", cells.join(" | "), nanoseconds(stage::LINES));
    }
}

/// Nanoseconds a vertex of each stage of all tiles of a new world.
fn spent(preset: Preset) -> Vec<(String, f64)> {
    let world = World::new(preset, None).expect("built-in presets are sound");
    let (clock, cells) = (Clock::default(), world.tile_cells() as i64);
    for tile in 0..TILES * TILES {
        Tile::timed(&world, TileId { x: tile % TILES, y: tile / TILES }, &clock).unwrap();
    }
    let vertices = (TILES * TILES * cells * cells) as f64;
    clock.stages().into_iter().map(|(stage, time)| (stage, time.as_nanos() as f64 / vertices)).collect()
}
