//! The bytes of every preset, as hashes: no change to them goes unnoticed, on any machine.
//!
//! `TERRANE_ACCEPT=1 cargo test --profile quick --test suite golden` writes the hashes of today into `tests/golden.txt`. A
//! change there is a change of every world that users have: the layer that makes others gets another version in
//! `src/generator.rs`, which the list names, and it belongs in CHANGELOG.md. The suite looks at a tile of a
//! fluvial preset, of some on a road, and in the long form at the others.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;
use std::path::Path;

use rayon::prelude::*;
use terrane::area::{Area, Stride, TileId};
use terrane::clock::Clock;
use terrane::generator;
use terrane::lines::LineKind;
use terrane::map::MapPainter;
use terrane::preset::{BUILT_IN, Preset};
use terrane::tile::{Tile, TilePart};
use terrane::world::World;

use crate::is_long;
use crate::worlds::is_quick;

const TILES: [(i64, i64); 4] = [(0, 0), (1_000_000_000, -1_000_000_000), (-7, 3), (1 << 40, -(1 << 40))];

/// The ending of the names of worlds with roads.
const WITH_PLACES: &str = "-with-places";

/// Presets that are looked at from afar, too, and at which strides: gullies in the mean, brooks, nothing but trunks,
/// and the mean of these; and noise.
const AFAR: [(&str, u64); 5] = [("alps", 4), ("plains", 16), ("archipelago", 32), ("fjords", 1024), ("mountains", 8)];

/// A preset and those of its tiles whose hashes are in the list.
struct Golden {
    name: String,
    preset: Preset,
    stride: Stride,
    tiles: Vec<(i64, i64)>,
}

#[test]
fn every_preset_has_its_golden_bytes() {
    const HINT: &str = "if the change is meant: TERRANE_ACCEPT=1 cargo test --profile quick --test suite golden";
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden.txt");
    let list = fs::read_to_string(&path).expect("the golden hashes can be read");
    let all: Vec<Golden> = goldens(&list);
    if std::env::var_os("TERRANE_ACCEPT").is_some() {
        let parts = TilePart::ALL.map(TilePart::name).join(", ");
        let about = format!(
            "# preset, x, y, and the first 16 digits of the BLAKE3 of {parts} and the map of tiles of 48 cells, seed 1\n"
        );
        let made: Vec<String> = all.par_iter().map(|golden| hashes(golden, &golden.tiles)).collect();
        let made = made.concat();
        // Other presets and tiles may come and go under the same versions, but nothing that is known may be another.
        let key = |line: &str| line.splitn(4, ' ').take(3).collect::<Vec<_>>().join(" ");
        let known: BTreeMap<String, &str> = list.lines().skip(2).map(|line| (key(line), line)).collect();
        let changed = made.lines().find(|line| known.get(&key(line)).is_some_and(|known| known != line));
        if let Some(line) = changed.filter(|_| list.lines().nth(1) == Some(&versions()[..])) {
            panic!(
                "another world under the same version: raise that of the layer you changed in src/generator.rs\n{line}"
            );
        }
        fs::write(&path, format!("{about}{}\n{made}", versions())).unwrap();
        return;
    }
    assert_eq!(list.lines().nth(1), Some(&versions()[..]), "the list is of other versions; {HINT}");
    let lines: Vec<&str> = list.lines().skip(2).collect();
    let tiles: usize = all.iter().map(|golden| golden.tiles.len()).sum();
    assert_eq!(lines.len(), tiles, "the list has other tiles; {HINT}");
    all.par_iter().for_each(|golden| {
        for line in hashes(golden, tried(golden)).lines() {
            assert!(lines.contains(&line), "the list has not\n{line}\n{HINT}");
        }
    });
}

/// The versions of the layers, as the list names them.
fn versions() -> String {
    let layers = generator::LAYERS.map(|(layer, version)| format!("{layer} {version}"));
    format!("# {}", layers.join(", "))
}

/// All presets, bare and with their places, and the tiles that the list has of them.
fn goldens(list: &str) -> Vec<Golden> {
    let listed = |name: &str| -> Vec<(i64, i64)> {
        let words = list.lines().map(|line| line.split(' ').collect::<Vec<_>>());
        let own = words.filter(|words| words[0] == name);
        own.map(|words| (words[1].parse().unwrap(), words[2].parse().unwrap())).collect()
    };
    let presets = || BUILT_IN.iter().map(|(name, text)| (*name, Preset::parse(name, text).unwrap()));
    let bare = presets().map(|(name, preset)| {
        let preset = Preset { places: None, ..preset };
        // Rivers are followed to their ends, wherever a tile is, so two places are enough.
        let tiles = if preset.fluvial.is_some() { &TILES[..2] } else { &TILES[..] };
        Golden { name: name.to_owned(), preset, stride: Stride::ONE, tiles: tiles.to_vec() }
    });
    let settled = presets().filter(|(_, preset)| preset.places.is_some()).map(|(name, preset)| {
        let name = format!("{name}{WITH_PLACES}");
        let tiles = listed(&name);
        // Of a preset that the list does not know yet, the tile of a settlement, to which roads go.
        let tiles = if tiles.is_empty() { vec![settlement(&preset)] } else { tiles };
        Golden { name, preset, stride: Stride::ONE, tiles }
    });
    let afar = AFAR.iter().map(|(preset, vertices)| {
        let name = format!("{preset}-at-{vertices}");
        let (_, preset) = Preset::load(preset).unwrap();
        Golden { name, preset, stride: Stride::new(*vertices).unwrap(), tiles: TILES[..1].to_vec() }
    });
    bare.chain(settled).chain(afar).collect()
}

fn world(preset: &Preset, stride: Stride) -> World {
    // Small tiles, since there are many; the size is no multiple of a lane count on purpose.
    World::strided(Preset { tile_cells: 48, ..preset.clone() }, Some(1), stride).unwrap()
}

/// The tile of a settlement: the first that is found from the origin to the east, since a world may have a sea there.
fn settlement(preset: &Preset) -> (i64, i64) {
    let world = world(preset, Stride::ONE);
    let sites = |east: i64| world.sites(&Area::new(10_240 * east, 0, 2560, 2560), &Clock::default()).unwrap();
    let site = (0..100).find_map(|east| sites(east).into_iter().next()).expect("some land is settled");
    site.at.map(|at| at.div_euclid(48)).into()
}

/// The tiles that are compared here. The suite's are all of noise, which costs nothing, and one of each fluvial preset:
/// of some that with places, which shows all that the bare one does, and the bare one of the others.
fn tried(golden: &Golden) -> &[(i64, i64)] {
    let preset = golden.name.trim_end_matches(WITH_PLACES);
    let has_places = preset != golden.name;
    let shows_most = has_places == is_quick(preset);
    let is_whole = golden.stride == Stride::ONE;
    let quick = if golden.preset.fluvial.is_some() && is_whole { usize::from(shows_most) } else { golden.tiles.len() };
    if is_long() { &golden.tiles[quick..] } else { &golden.tiles[..quick] }
}

/// A line a tile.
fn hashes(golden: &Golden, tiles: &[(i64, i64)]) -> String {
    let mut lines = String::new();
    let world = world(&golden.preset, golden.stride);
    let painter = MapPainter::new(&world);
    for &(x, y) in tiles {
        let tile = Tile::new(&world, TileId { x, y });
        let is_built = !tile.sites().is_empty() || tile.lines().iter().any(|line| line.kind == LineKind::Road);
        assert!(is_built || world.places().is_none(), "take it off the list: {} has no place at {x} {y}", golden.name);
        let side = tile.area().width();
        let map = blake3::hash(&painter.paint(&tile, side, side));
        writeln!(lines, "{} {x} {y} {:.16} {}", golden.name, tile.digest(), &map.to_hex()[..16]).unwrap();
    }
    lines
}
