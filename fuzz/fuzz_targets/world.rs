//! Whatever preset is accepted is a world or is refused, and a tile of it has numbers within its range.
#![no_main]

use libfuzzer_sys::fuzz_target;
use terrane::area::TileId;
use terrane::preset::Preset;
use terrane::tile::Tile;
use terrane::world::World;

fuzz_target!(|text: &str| {
    let Ok(preset) = Preset::parse("fuzz.toml", text) else { return };
    // Roads of a whole neighbourhood take seconds, and large tiles too: the same code sees small ones.
    let preset = Preset { places: None, tile_cells: 16, ..preset };
    let Ok(world) = World::new(preset, None) else { return };
    let (min_m, max_m) = world.height_range_m();
    // Here and far away, where it differs from text to text.
    let far = i64::from(blake3::hash(text.as_bytes()).as_bytes()[0]) << 24;
    for id in [TileId { x: 0, y: 0 }, TileId { x: far, y: -far }] {
        let tile = Tile::new(&world, id);
        let heights = tile.heights().values();
        assert!(heights.iter().all(|height| (min_m..=max_m).contains(height)), "{min_m} to {max_m}: {heights:?}");
    }
});
