//! Rivers, roads and tiles as vectors: each path whole and once, whatever the tiling, in both formats.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use rusqlite::Connection;
use serde_json::Value;
use terrane::area::{Area, Region, TileId};
use terrane::clock::Clock;
use terrane::lines::{LineId, LineKind};
use terrane::preset::Preset;
use terrane::world::World;

use crate::bakes::bake_vectors;

const WITH_PATHS: &str = r#"
    tile_cells = 32
    noise = [{ kind = "ridged", height_m = 60.0, wavelength_m = 500.0, octaves = 4 }]
    rivers = { density = 1.0, width_m = [1.0, 4.0], bank_m = 3.0 }
    roads = { density = 1.0 }
"#;

const WITHOUT_PATHS: &str = r#"
    tile_cells = 32
    noise = [{ kind = "ridged", height_m = 60.0, wavelength_m = 500.0, octaves = 4 }]
"#;

const LAYERS: [(&str, LineKind); 2] = [("rivers", LineKind::River), ("roads", LineKind::Road)];

fn world(text: &str) -> World {
    World::new(Preset::parse("test", text).unwrap(), Some(3)).unwrap()
}

/// Five of vectors, the registry and the manifest.
const FILES: usize = 7;

/// The geometries of a layer in the order of the file, by owner.
fn layer(out: &Path, name: &str) -> Vec<(TileId, Vec<u8>)> {
    let database = Connection::open(out.join("vector/vector.gpkg")).unwrap();
    let mut select = database.prepare(&format!("SELECT owner_x, owner_y, geom FROM {name} ORDER BY fid")).unwrap();
    let rows = select.query_map((), |row| Ok((TileId { x: row.get(0)?, y: row.get(1)? }, row.get(2)?))).unwrap();
    rows.map(Result::unwrap).collect()
}

fn text(out: &Path, name: &str) -> Value {
    serde_json::from_slice(&fs::read(out.join(format!("vector/{name}.geojson"))).unwrap()).unwrap()
}

#[test]
fn each_path_that_touches_the_region_is_there_once_in_both_formats() {
    let folder = tempfile::tempdir().unwrap();
    let world = world(WITH_PATHS);
    let region = Region::new(TileId { x: -3, y: 2 }, 5, 4, world.tile_cells()).unwrap();
    bake_vectors(&world, region, 2, folder.path(), FILES);
    let area = Area::new(-96, 64, region.width() as usize, region.height() as usize);
    for (name, kind) in LAYERS {
        let lines = world.lines(&area, &Clock::default()).unwrap();
        let of_kind = lines.iter().filter(|line| line.kind == kind && line.touches(&area));
        let owner = |id| if let LineId::Agent { owner, .. } = id { owner } else { panic!("{id} is no agent's") };
        let expected: BTreeSet<TileId> = of_kind.map(|line| owner(line.id)).collect();
        let found: Vec<TileId> = layer(folder.path(), name).into_iter().map(|(owner, _)| owner).collect();
        assert_eq!(found, expected.iter().copied().collect::<Vec<_>>(), "{name}");
        let text = text(folder.path(), name);
        let owners = text["features"].as_array().unwrap().iter().map(|feature| {
            let number = |key: &str| feature["properties"][key].as_i64().unwrap();
            TileId { x: number("owner_x"), y: number("owner_y") }
        });
        assert_eq!(owners.collect::<Vec<_>>(), found, "{name}");
    }
}

#[test]
fn a_path_is_the_same_in_every_window() {
    let folder = tempfile::tempdir().unwrap();
    let world = world(WITH_PATHS);
    let (one, other) = (folder.path().join("one"), folder.path().join("other"));
    let region = |x, y, cols, rows| Region::new(TileId { x, y }, cols, rows, world.tile_cells()).unwrap();
    bake_vectors(&world, region(-2, -2, 4, 4), 1, &one, FILES);
    bake_vectors(&world, region(0, -1, 2, 5), 3, &other, FILES);
    for (name, _) in LAYERS {
        let others: BTreeMap<_, _> = layer(&other, name).into_iter().collect();
        for (owner, geometry) in layer(&one, name) {
            assert!(others.get(&owner).is_none_or(|other| *other == geometry), "{name} of tile {owner}");
        }
    }
}

#[test]
fn a_world_without_paths_has_empty_layers_and_its_tiles() {
    let folder = tempfile::tempdir().unwrap();
    let world = world(WITHOUT_PATHS);
    bake_vectors(
        &world,
        Region::new(TileId { x: -1, y: 5 }, 2, 3, world.tile_cells()).unwrap(),
        2,
        folder.path(),
        FILES,
    );
    for (name, _) in LAYERS {
        assert_eq!(layer(folder.path(), name), []);
        assert_eq!(text(folder.path(), name)["features"], Value::Array(Vec::new()));
    }
    let database = Connection::open(folder.path().join("vector/vector.gpkg")).unwrap();
    let listed = "SELECT group_concat(x || ',' || y || ' ' || col || ',' || row, '; ') FROM tiles ORDER BY fid";
    let listed: String = database.query_row(listed, (), |row| row.get(0)).unwrap();
    assert_eq!(listed, "-1,5 0,0; 0,5 1,0; -1,6 0,1; 0,6 1,1; -1,7 0,2; 0,7 1,2");
    let bounds = "SELECT min_x, min_y, max_x, max_y FROM gpkg_contents WHERE table_name = 'tiles'";
    let bounds: [f64; 4] =
        database.query_row(bounds, (), |row| Ok([row.get(0)?, row.get(1)?, row.get(2)?, row.get(3)?])).unwrap();
    // Three rows of 32 cells, the first 160 m south of the origin: north is up.
    assert_eq!(bounds, [-32.0, -256.0, 32.0, -160.0]);
}
