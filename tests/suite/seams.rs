//! Promises 1 and 2: a tile is the same in every window, and neighbours agree on the vertices that they share.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::sync::OnceLock;

use terrane::area::{Area, Region, TileId};
use terrane::export::{Export, Manifest, Mode, Output, Plan};
use terrane::preset::{BUILT_IN, Preset};
use terrane::tile::{Material, Tile};
use terrane::watch::Watch;
use terrane::world::World;

use crate::worlds::{is_tried, lighten};
use crate::{bakes, is_long};

/// A world with all that a preset can have, where the built-in ones have only what suits them.
const EVERYTHING: &str = r#"
    sea_level_m = 20.0
    noise = [
        { kind = "ridged", height_m = 120.0, mask = { wavelength_m = 900.0, from = 0.2, to = -0.3 } },
        { kind = "hybrid", height_m = 40.0, wavelength_m = 700.0, lacunarity = 2.0 },
        { kind = "hetero", height_m = 20.0, wavelength_m = 400.0, lacunarity = 2.0 },
        { kind = "fbm", height_m = 30.0, curve = [[-0.5, 0.0], [0.1, 0.2], [0.3, 1.0]] },
    ]
    warp = { wavelength_m = 500.0, distance_m = 40.0 }
    land = { floor_m = -80.0, mask = { wavelength_m = 600.0, from = -0.2, to = 0.3 } }
    ground = { sand_m = [2.0, 9.0], snow_m = [90.0, 130.0], scree = [0.4, 0.6], forest_m = [60.0, 110.0] }
"#;

/// The worlds of the built-in presets that are tried, with small tiles, and that one. Roads, which are planned over a
/// wide area, has one of them here, and in the suite the small world of the features' tests.
fn worlds() -> impl Iterator<Item = (&'static str, &'static World)> {
    static WORLDS: OnceLock<Vec<(&str, World)>> = OnceLock::new();
    let world = |(name, text): &(&'static str, &str)| {
        let mut preset = Preset::parse(name, text).unwrap();
        preset.tile_cells = 64;
        lighten(&mut preset);
        preset.places = preset.places.filter(|_| *name == "highlands");
        (*name, World::new(preset, Some(5)).unwrap())
    };
    let tried = BUILT_IN.iter().filter(|(name, _)| is_tried(name)).chain(&[("everything", EVERYTHING)]);
    let worlds = WORLDS.get_or_init(|| tried.map(world).collect());
    let settled = (!is_long()).then(|| ("settled", bakes::settled()));
    worlds.iter().map(|(name, world)| (*name, world)).chain(settled)
}

/// Where tiles are looked at: what is planned around one is remembered for all tests.
const PLACES: [TileId; 3] =
    [TileId { x: 0, y: 0 }, TileId { x: -3, y: 2 }, TileId { x: 1_000_000_000, y: -1_000_000_000 }];

#[test]
fn neighbours_agree_on_their_shared_vertices() {
    for (name, world) in worlds() {
        for at in PLACES {
            let west = Tile::new(world, at);
            let east = Tile::new(world, TileId { x: at.x + 1, ..at });
            let south = Tile::new(world, TileId { y: at.y + 1, ..at });
            let Area { x0, y0, x1, y1 } = west.area();
            for (x, y) in (y0..y1).map(|y| (x1 - 1, y)) {
                assert_same_vertex(&west, &east, x, y, name);
            }
            for (x, y) in (x0..x1).map(|x| (x, y1 - 1)) {
                assert_same_vertex(&west, &south, x, y, name);
            }
        }
    }
}

fn assert_same_vertex(one: &Tile, other: &Tile, x: i64, y: i64, name: &str) {
    let look = |tile: &Tile| {
        let normal = tile.normals().at(x, y).map(f32::to_bits);
        let weights = (tile.blend().ground().at(x, y), tile.blend().cover().at(x, y));
        let water = tile.water().map(|water| {
            let metres = [&water.depth_m, &water.flow_m3s].map(|grid| grid.at(x, y).to_bits());
            (water.kind.at(x, y), water.bed.at(x, y), metres)
        });
        (tile.heights().at(x, y).to_bits(), normal, weights, water)
    };
    assert_eq!(look(one), look(other), "{name}: tiles {} and {} differ at vertex ({x}, {y})", one.id(), other.id());
}

#[test]
fn one_large_area_equals_its_tiles() {
    for (name, world) in worlds() {
        let large = world.relief().heights(Area::new(-270, -140, 500, 300));
        for (tx, ty) in [(-4, -2), (0, 0), (2, 1)] {
            let bare = Tile::bare_heights(world, TileId { x: tx, y: ty });
            let area = bare.area();
            for y in area.y0..area.y1 {
                let bits = |row: &[f32]| row.iter().map(|height| height.to_bits()).collect::<Vec<_>>();
                assert_eq!(
                    bits(bare.row(y, area.x0, area.x1)),
                    bits(large.row(y, area.x0, area.x1)),
                    "{name}: row {y} of tile ({tx}, {ty})"
                );
            }
        }
    }
}

#[test]
fn weights_sum_to_255_at_every_vertex() {
    for (name, world) in worlds() {
        for at in &PLACES[..2] {
            let tile = Tile::new(world, *at);
            for (x, y) in tile.area().vertices() {
                let sum: u32 = Material::ALL.iter().map(|&material| tile.blend().weight(material, x, y) as u32).sum();
                assert_eq!(sum, 255, "{name}: vertex ({x}, {y})");
            }
        }
    }
}

#[test]
fn vertices_are_those_of_the_thesis() {
    let (_, mut preset) = Preset::load("thesis").unwrap();
    preset.tile_cells = 64;
    let world = &World::new(preset, Some(5)).unwrap();
    let tile = Tile::new(world, TileId { x: 3, y: -2 });
    let vertices: Vec<_> = tile.vertices().collect();
    assert_eq!(size_of_val(&vertices[0]), 32);
    assert_eq!(vertices.len(), 65 * 65);
    let (first, last) = (vertices[0], vertices[65 * 65 - 1]);
    assert_eq!((first.texture, last.texture), ([0.0, 0.0], [1.0, 1.0]));
    assert_eq!([first.position[0], first.position[2]], [-32.0, -32.0]);
    assert_eq!([last.position[0], last.position[2]], [32.0, 32.0]);
    assert_eq!(tile.centre_m(), [3.5 * 64.0, -1.5 * 64.0]);
    assert_eq!(first.position[1], tile.heights().at(192, -128));
}

/// Bakes a region into a folder of its own, with a file a tile for all that can have one.
fn bake(world: &World, at: (i64, i64), (cols, rows): (u64, u64), threads: usize, out: &Path) -> Manifest {
    let region = Region::new(TileId { x: at.0, y: at.1 }, cols, rows, world.tile_cells()).unwrap();
    let exports = "height-tiles,exr-tiles,r16-tiles,blend-tiles,normal-tiles,map-tiles,hashes,vector,geojson";
    let exports = Export::parse_list(exports).unwrap();
    let plan = Plan::new(world, "test", region, exports).unwrap();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let output = Output::prepare(out, Mode::New, &plan, &plan.cost(threads)).unwrap();
    pool.install(|| plan.run(&output, &Watch::default())).unwrap()
}

/// The bytes of all files of single tiles, by the tile's true number and the kind of file.
fn tile_files(manifest: &Manifest, out: &Path) -> BTreeMap<(TileId, String), Vec<u8>> {
    let of_tiles = manifest.files.iter().filter_map(|file| file.tile.map(|tile| (tile, file)));
    let kind = |path: &str| {
        let (stem, ending) = (path.split("_x").next().unwrap(), path.split_once('.').unwrap().1);
        format!("{stem}.{ending}")
    };
    of_tiles.map(|(tile, file)| ((tile, kind(&file.path)), fs::read(out.join(&file.path)).unwrap())).collect()
}

#[test]
fn overlapping_bakes_agree_byte_for_byte() {
    let folder = tempfile::tempdir().unwrap();
    for (name, world) in worlds() {
        let (one, other) = (folder.path().join(format!("{name}-1")), folder.path().join(format!("{name}-2")));
        // The second is another window, another shape and another number of threads, so tiles are made in another
        // order.
        let first = tile_files(&bake(world, (-2, -1), (4, 3), 1, &one), &one);
        let second = tile_files(&bake(world, (-1, 0), (2, 5), 3, &other), &other);
        let mut shared = 0;
        // Of all that has no file of its own, flow, beds and lines among it, the lists have hashes.
        let listed = |out: &Path| -> BTreeMap<(String, String), String> {
            let text = fs::read_to_string(out.join("hashes.txt")).unwrap();
            let tile = |line: &str| {
                let mut parts = line.splitn(3, ' ').map(str::to_owned);
                ((parts.next().unwrap(), parts.next().unwrap()), parts.next().unwrap())
            };
            text.lines().skip(1).map(tile).collect()
        };
        let (listed, others) = (listed(&one), listed(&other));
        let common: Vec<_> = listed.iter().filter(|(tile, _)| others.contains_key(*tile)).collect();
        assert_eq!(common.len(), 4, "{name}");
        assert!(common.iter().all(|(tile, hashes)| others[*tile] == **hashes), "{name}: {common:?} {others:?}");
        for (key, bytes) in &first {
            if let Some(others) = second.get(key) {
                // The sidecar of a bare file is text; all else is a raster.
                assert_eq!(bytes, others, "{name}: {} of tile {} differs between two bakes", key.1, key.0);
                shared += 1;
            }
        }
        // 2 x 2 tiles in common, with height, EXR, r16 and its sidecar, two blend maps, normals and map of each.
        assert_eq!(shared, 4 * 8, "{name}");
    }
}

#[test]
fn a_bake_does_not_depend_on_its_threads() {
    let folder = tempfile::tempdir().unwrap();
    let (_, world) = worlds().find(|(_, world)| world.places().is_some()).expect("one has roads");
    let listed = |threads: usize| {
        let out = folder.path().join(threads.to_string());
        bake(world, (-2, -1), (3, 6), threads, &out).files
    };
    let alone = listed(1);
    assert!(alone.len() > 18 * 8);
    assert_eq!(alone, listed(2));
    assert_eq!(alone, listed(5));
}
