//! The bytes of every preset, as hashes: no change to them goes unnoticed, on no machine and in no build.
//!
//! `TERRANE_ACCEPT=1 cargo test --profile quick --test suite golden` writes the hashes of today into `tests/golden.txt`. A
//! change there is a change of every world that users have: it belongs in CHANGELOG.md.

use std::fmt::Write;
use std::fs;
use std::path::Path;

use rayon::prelude::*;
use terrane::area::{Area, TileId};
use terrane::map::MapPainter;
use terrane::preset::{BUILT_IN, Preset};
use terrane::tile::{Tile, TileChannel};
use terrane::world::World;

const TILES: [(i64, i64); 4] = [(0, 0), (1_000_000_000, -1_000_000_000), (-7, 3), (1 << 40, -(1 << 40))];

/// What the names of worlds with roads end in: roads are planned over a wide area, which an optimised build alone has
/// the time for.
const WITH_PLACES: &str = "-with-places";

#[test]
fn every_preset_has_its_golden_bytes() {
    const HINT: &str = "if the change is meant: TERRANE_ACCEPT=1 cargo test --profile quick --test suite golden";
    let presets = || BUILT_IN.iter().map(|(name, text)| (*name, Preset::parse(name, text).unwrap()));
    let bare = presets().map(|(name, preset)| {
        let bare = Preset { places: None, ..preset };
        // Rivers are followed to their ends, wherever a tile is: two places are enough for a build without optimisation.
        let tiles = if bare.fluvial.is_some() { &TILES[..2] } else { &TILES[..] };
        (name.to_owned(), bare, tiles)
    });
    let settled = presets().filter(|(_, preset)| preset.places.is_some());
    let settled = settled.map(|(name, preset)| (format!("{name}{WITH_PLACES}"), preset, &[][..]));
    let is_made = |name: &str| !cfg!(debug_assertions) || !name.ends_with(WITH_PLACES);
    let worlds: Vec<_> = bare.chain(settled).filter(|(name, ..)| is_made(name)).collect();
    let found: Vec<String> = worlds.into_par_iter().map(|(name, preset, tiles)| hashes(&name, preset, tiles)).collect();
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden.txt");
    // A build without optimisation does not make all lines.
    if !cfg!(debug_assertions) && std::env::var_os("TERRANE_ACCEPT").is_some() {
        let channels = TileChannel::ALL.map(TileChannel::name).join(", ");
        let about = format!(
            "# preset, x, y, and the first 16 digits of the BLAKE3 of {channels} and the map of tiles of 48 cells, seed 1\n"
        );
        fs::write(&path, format!("{about}{}", found.concat())).unwrap();
    }
    let golden = fs::read_to_string(&path).expect("the golden hashes can be read");
    let golden = golden.lines().skip(1).filter(|line| line.split(' ').next().is_some_and(is_made));
    let found = found.concat();
    let mut found = found.lines();
    for expected in golden {
        assert_eq!(found.next(), Some(expected), "{HINT}");
    }
    assert_eq!(found.next(), None, "{HINT}");
}

/// A line a tile; given none, for that of the first settlement, to which roads go.
fn hashes(name: &str, mut preset: Preset, tiles: &[(i64, i64)]) -> String {
    let mut lines = String::new();
    // Debug builds take part, so the tiles are small; the size is no multiple of a lane count on purpose.
    preset.tile_cells = 48;
    let world = World::new(preset, Some(1)).unwrap();
    let painter = MapPainter::new(&world);
    let site = || world.sites(&Area::new(0, 0, 1280, 1280))[0].at.map(|at| at.div_euclid(48)).into();
    let tiles = if tiles.is_empty() { vec![site()] } else { tiles.to_vec() };
    for (x, y) in tiles {
        let tile = Tile::new(&world, TileId { x, y });
        let mut map = blake3::Hasher::new();
        let mut row = [0; 49 * 3];
        for y in tile.area().y0..tile.area().y1 {
            painter.paint_row(&tile, y, &mut row);
            map.update(&row);
        }
        writeln!(lines, "{name} {x} {y} {:.16} {}", tile.digest(), &map.finalize().to_hex()[..16]).unwrap();
    }
    lines
}
