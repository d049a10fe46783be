//! The bytes of every preset, as hashes: no change to them goes unnoticed, on no machine and in no build.
//!
//! `TERRANE_ACCEPT=1 cargo test --release --test suite golden` writes the hashes of today into `tests/golden.txt`. A change there is a
//! change of every world that users have: it belongs in CHANGELOG.md.

use std::fmt::Write;
use std::fs;
use std::path::Path;

use terrane::area::TileId;
use terrane::map::MapPainter;
use terrane::preset::{BUILT_IN, Preset};
use terrane::tile::{Channel, Tile};
use terrane::world::World;

const TILES: [(i64, i64); 4] = [(0, 0), (1_000_000_000, -1_000_000_000), (-7, 3), (1 << 40, -(1 << 40))];

#[test]
fn every_preset_has_its_golden_bytes() {
    let mut lines = format!(
        "# preset, x, y, and the first 16 digits of the BLAKE3 of {} and the map of tiles of 48 cells, seed 1\n",
        Channel::ALL.map(Channel::name).join(", ")
    );
    let presets = || BUILT_IN.iter().map(|(name, text)| (*name, Preset::parse(name, text).unwrap()));
    for (name, preset) in presets() {
        let bare = Preset { places: None, ..preset };
        // Rivers are followed to their ends, wherever a tile is: two places are enough for a build without optimisation.
        let tiles = if bare.fluvial.is_some() { &TILES[..2] } else { &TILES[..] };
        write_hashes(&mut lines, name, bare, tiles);
    }
    // Roads are planned over a wide area, which an optimised build alone has the time for.
    if !cfg!(debug_assertions) {
        for (name, preset) in presets().filter(|(_, preset)| preset.places.is_some()) {
            write_hashes(&mut lines, &format!("{name}-with-places"), preset, &TILES[..1]);
        }
    }
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden.txt");
    if std::env::var_os("TERRANE_ACCEPT").is_some() {
        fs::write(&path, &lines).unwrap();
    }
    let golden = fs::read_to_string(&path).unwrap_or_default();
    for (line, expected) in lines.lines().zip(golden.lines()) {
        assert_eq!(line, expected, "if the change is meant: TERRANE_ACCEPT=1 cargo test --release --test suite golden");
    }
    if !cfg!(debug_assertions) {
        let hint = "TERRANE_ACCEPT=1 cargo test --release --test suite golden";
        assert_eq!(lines.lines().count(), golden.lines().count(), "{hint}");
    }
}

fn write_hashes(lines: &mut String, name: &str, mut preset: Preset, tiles: &[(i64, i64)]) {
    // Debug builds take part, so the tiles are small; the size is no multiple of a lane count on purpose.
    preset.tile_cells = 48;
    let world = World::new(preset, Some(1)).unwrap();
    let painter = MapPainter::new(&world);
    for &(x, y) in tiles {
        let tile = Tile::new(&world, TileId { x, y });
        let mut map = blake3::Hasher::new();
        let mut row = [0; 49 * 3];
        for y in tile.area().y0..tile.area().y1 {
            painter.paint_row(&tile, y, &mut row);
            map.update(&row);
        }
        writeln!(lines, "{name} {x} {y} {:.16} {}", tile.digest(), &map.finalize().to_hex()[..16]).unwrap();
    }
}
