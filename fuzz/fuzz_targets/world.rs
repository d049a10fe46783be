//! Whatever preset is accepted is a world or is refused, and a tile of it has numbers within its range.
#![no_main]

use libfuzzer_sys::fuzz_target;
use terrane::area::TileId;
use terrane::preset::Preset;
use terrane::tile::Tile;
use terrane::world::World;

fuzz_target!(|input: (&str, i32, i32, u64)| {
    let (text, x, y, seed) = input;
    let Ok(preset) = Preset::parse("fuzz.toml", text) else { return };
    // Roads of a whole neighbourhood take seconds, and large tiles too: the same code sees small ones.
    let preset = Preset { places: None, tile_cells: 16, ..preset };
    let Ok(world) = World::new(preset, Some(seed)) else { return };
    let (min_m, max_m) = world.height_range_m();
    let tile = Tile::new(&world, TileId { x: x.into(), y: y.into() });
    let heights = tile.heights().values();
    assert!(heights.iter().all(|height| (min_m..=max_m).contains(height)), "{min_m} to {max_m}: {heights:?}");
});
