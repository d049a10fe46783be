//! Walks as the command bakes them: the same bytes, the tiles of the walker, agents from tile to tile, and what is
//! refused.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;
use std::process::Stdio;
use std::thread;
use std::time::{Duration, Instant};

use serde_json::Value;
use terrane::agents::Direction;
use terrane::area::TileId;
use terrane::lines::LineKind;
use terrane::preset::Preset;
use terrane::registry::{FILE_NAME, Registry, TileRow, TileState};
use terrane::tile::TilePart;
use terrane::walker::{Camera, Walker, WalkerOptions};
use terrane::world::World;

use crate::desk::{Desk, PATIENCE, Running, files_in};

/// The thesis' agents in tiles so small that they meet on every walk.
const AGENTS: &str = "\
# A small world for walks
tile_cells = 32

[[noise]]
kind = \"ridged\"
height_m = 200.0
wavelength_m = 1400.0
octaves = 8
lacunarity = 2.5

[rivers]
width_m = [2.0, 4.0]
bank_m = 3.0

[roads]
width_m = 2.0
shoulder_m = 2.0
step_cells = 7
";

/// Around a corner and back over the own track; metres east and north.
const WAY: &str = "east_m,north_m\n16,-16\n200,-40\n150,-190\n-20,-70\n90,20\n";

fn desk() -> Desk {
    let desk = Desk::new();
    desk.write("agents.toml", AGENTS);
    desk.write("way.csv", WAY);
    desk
}

fn world() -> World {
    World::new(Preset::parse("agents.toml", AGENTS).unwrap(), None).unwrap()
}

fn rows(folder: &Path) -> Vec<TileRow> {
    Registry::read(&folder.join(FILE_NAME)).unwrap().rows().unwrap()
}

/// The files of a folder and their bytes.
fn contents(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    files_in(folder).into_iter().map(|path| (path.clone(), fs::read(folder.join(path)).unwrap())).collect()
}

const ALL: &str = "height-tiles,blend-tiles,map-tiles,map,exr,geotiff,vector,geojson,hashes";

#[test]
fn a_walk_has_the_same_bytes_on_any_threads_and_is_whole() {
    let desk = desk();
    for (out, threads) in [("one", "1"), ("two", "3")] {
        desk.done(&["walk", "agents.toml", "--path", "way.csv", "--export", ALL, "--threads", threads, "--out", out]);
    }
    assert!(contents(&desk.path("one")) == contents(&desk.path("two")));
    // Files of tiles are of those that were made alone.
    let (manifest, tiles) = (desk.manifest("one"), rows(&desk.path("one")).len());
    let region = &manifest.region;
    assert!(tiles > 40 && (tiles as u64) < region.cols * region.rows, "{tiles} of {} x {}", region.cols, region.rows);
    let count = |export: &str| manifest.files.iter().filter(|file| file.export == export).count();
    assert_eq!((count("height-tiles"), count("blend-tiles"), count("map-tiles")), (tiles, 2 * tiles, tiles));
    let hashes = fs::read_to_string(desk.path("one/hashes.txt")).unwrap();
    assert_eq!(hashes.lines().count(), 1 + tiles);
    // All of its tiles come back by their records, and neighbours meet.
    let verified = desk.done(&["verify", "one", "--all", "--json"]).last_object();
    assert_eq!((&verified["tiles"], &verified["faults"]), (&tiles.into(), &0.into()));
    assert!(verified["seams"].as_u64().unwrap() > 100, "{verified}");
    let info = desk.done(&["info", "one", "--json"]).object();
    assert_eq!((&info["tiles"], &info["tiles_of"], &info["state"]), (&tiles.into(), &tiles.into(), &"whole".into()));
    assert!(info["walk"]["way"]["path"]["places_m"].is_array(), "{info}");
}

#[test]
fn what_is_baked_are_the_tiles_of_a_walker() {
    let desk = desk();
    let world = world();
    let side_m = 32.0;
    desk.done(&["walk", "agents.toml", "--minutes", "0.1", "--speed", "60", "--export", "hashes", "--out", "o"]);
    let baked: BTreeMap<TileId, TileRow> = rows(&desk.path("o")).into_iter().map(|row| (row.tile, row)).collect();
    let mut walker = Walker::new(&world, WalkerOptions::default());
    let mut seen = BTreeSet::new();
    for [east_m, south_m] in Camera::new([side_m / 2.0; 2], 60.0).places_m(0.1) {
        walker.move_to(east_m, south_m).unwrap();
        for tile in walker.tiles().filter(|tile| seen.insert(tile.id())) {
            assert_eq!(baked[&tile.id()].digest, Some(tile.digest()), "tile {}", tile.id());
        }
    }
    assert!(seen.len() > 30 && baked.keys().eq(&seen), "{} of {}", seen.len(), baked.len());
}

#[test]
fn the_registry_has_the_agents_of_all_tiles_and_how_they_go_on() {
    let desk = desk();
    desk.done(&["walk", "agents.toml", "--path", "way.csv", "--export", "height-tiles,geojson", "--out", "o"]);
    let rows = rows(&desk.path("o"));
    let records: BTreeMap<TileId, _> = rows.iter().map(|row| (row.tile, row.walk_record().unwrap())).collect();
    let mut crossed = BTreeMap::new();
    for (tile, record) in &records {
        for kind in [LineKind::River, LineKind::Road] {
            let Some(passage) = record.passage(kind) else { continue };
            let Some(entry) = passage.entry else { continue };
            let (east, south) = entry.opposite().step();
            let before = records[&TileId { x: tile.x + east, y: tile.y + south }].passage(kind).unwrap();
            assert_eq!((before.exit, before.lowest_m), (Some(entry), passage.lowest_before_m), "{kind:?} into {tile}");
            *crossed.entry(kind).or_insert(0) += 1;
        }
    }
    assert!(crossed[&LineKind::River] > 5 && crossed[&LineKind::Road] > 2, "{crossed:?}");
    for row in &rows {
        assert_eq!(row.state, TileState::Walked);
        assert_eq!(row.lines.len(), usize::from(row.river.is_some()) + usize::from(row.road.is_some()));
        assert!(row.digest.unwrap().of(TilePart::Heights).is_some());
        let TileId { x, y } = row.tile;
        assert_eq!(row.files, [format!("height/height_x{x}_y{y}.png")]);
        assert!(row.river.is_none_or(|river| river.direction.is_some_and(|it| Direction::ALL.contains(&it))));
    }
    // The lines of all tiles, each with its tile.
    for (kind, layer) in [(LineKind::River, "rivers"), (LineKind::Road, "roads")] {
        let text = fs::read(desk.path(&format!("o/vector/{layer}.geojson"))).unwrap();
        let json: Value = serde_json::from_slice(&text).unwrap();
        let owner = |feature: &Value| {
            let number = |key: &str| feature["properties"][key].as_i64().unwrap();
            TileId { x: number("owner_x"), y: number("owner_y") }
        };
        let owners: Vec<TileId> = json["features"].as_array().unwrap().iter().map(owner).collect();
        let with = records.iter().filter(|(_, record)| record.passage(kind).is_some()).map(|(tile, _)| *tile);
        assert!(owners.into_iter().eq(with), "{layer}");
    }
    // And the table of the command.
    let listed = desk.done(&["registry", "o", "--start", "river", "--json"]).objects();
    assert_eq!(listed.len(), records.values().filter(|record| record.river.is_some()).count());
    assert!(listed.iter().all(|row| row["state"] == "walked" && row["record_bytes"] == 64));
}

#[test]
fn where_no_tile_is_pictures_are_transparent_and_heights_no_numbers() {
    let desk = desk();
    desk.done(&["walk", "agents.toml", "--path", "way.csv", "--export", "map,map-tiles,geotiff", "--out", "o"]);
    let read = |path: &str| {
        let mut reader = png::Decoder::new(std::io::BufReader::new(fs::File::open(desk.path(path)).unwrap()));
        reader.set_transformations(png::Transformations::IDENTITY);
        let mut reader = reader.read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut pixels).unwrap();
        (info.width as usize, info.color_type, pixels)
    };
    let (width, colour, pixels) = read("o/map/map.png");
    assert_eq!(colour, png::ColorType::Rgba);
    let region = desk.manifest("o").region;
    let made: BTreeSet<TileId> = rows(&desk.path("o")).iter().map(|row| row.tile).collect();
    let mut gaps = 0;
    for (row, col) in (0..region.rows).flat_map(|row| (0..region.cols).map(move |col| (row, col))) {
        let tile = TileId { x: region.at.x + col as i64, y: region.at.y + row as i64 };
        let pixel = |x: usize, y: usize| &pixels[4 * ((row as usize * 32 + y) * width + col as usize * 32 + x)..][..4];
        if made.contains(&tile) {
            let (side, colour, own) = read(&format!("o/map/map_x{}_y{}.png", tile.x, tile.y));
            assert_eq!((side, colour), (33, png::ColorType::Rgb));
            for (x, y) in [(0, 0), (31, 0), (5, 17), (31, 31)] {
                assert_eq!((&pixel(x, y)[..3], pixel(x, y)[3]), (&own[3 * (y * side + x)..][..3], 255), "tile {tile}");
            }
        } else {
            assert!((0..32).all(|at| pixel(at, 31 - at) == [0; 4]), "tile {tile}");
            gaps += 1;
        }
    }
    assert!(gaps > 5, "{gaps}");
    let auxiliary = fs::read_to_string(desk.path("o/map/map.png.aux.xml")).unwrap();
    assert!(!auxiliary.contains("NaN"), "{auxiliary}");
}

#[test]
fn a_walk_that_was_damaged_is_mended_and_one_in_a_folder_is_no_bake() {
    let desk = desk();
    let walk = ["walk", "agents.toml", "--path", "way.csv", "--out", "o"];
    desk.done(&walk);
    let before = contents(&desk.path("o"));
    let tile = before.keys().find(|path| path.starts_with("height/")).unwrap();
    desk.write(&format!("o/{tile}"), "spoiled");
    assert_eq!(desk.run(&["verify", "o"]).code, Some(1));
    desk.done(&["repair", "o"]);
    // What was in its place is kept under another name.
    fs::remove_file(desk.path(&format!("o/{tile}.kept-1"))).unwrap();
    assert!(contents(&desk.path("o")) == before);
    // Not replaced unless told so.
    desk.refused(&walk, &["not empty", "--overwrite"]);
    desk.done(&[&walk[..], &["--overwrite", "--layers", "2"]].concat());
    assert!(rows(&desk.path("o")).len() > 60);
    // What asks the world for its lines shows others than those of the walk.
    desk.refused(&["map", "o", "--out", "map.png"], &["holds a walk"]);
    desk.refused(&["extend", "o", "--size", "20x20"], &["holds a walk"]);
    desk.done(&["clean", "o"]);
    assert!(!desk.path("o").exists());
}

#[test]
fn a_walk_that_cannot_be_is_refused() {
    let desk = desk();
    desk.write("bad.csv", "0,0\n# on\n10;20\n");
    desk.write("word.csv", "east_m,north_m\n0,0\n10, far\n");
    desk.write("none.csv", "# nothing\n");
    desk.write("beyond.csv", "0,0\n1e17,0\n");
    desk.write("long.csv", "0,0\n1e12,0\n");
    fs::create_dir(desk.path("folder")).unwrap();
    let cases: &[(&[&str], &[&str])] = &[
        (&["--path", "bad.csv"], &["bad.csv:3:1: ", "two numbers", "10;20", "east_m,north_m"]),
        (&["--path", "word.csv"], &["word.csv:3:5: ", "a number of metres", "far"]),
        (&["--path", "none.csv"], &["none.csv:1:1: ", "no place"]),
        (&["--path", "beyond.csv"], &["leaves the coordinates"]),
        (&["--path", "long.csv"], &["more than 1048576 tiles", "shorter way"]),
        (&["--path", "folder"], &["is a folder"]),
        (&["--path", "missing.csv"], &["missing.csv", "a place a line"]),
        (&["--path", "way.csv", "--minutes", "1"], &["--minutes"]),
        (&["--minutes", "0"], &["0 minutes", "more than 0"]),
        (&["--speed", "1e6"], &["a tile a frame"]),
        (&["--layers", "0"], &["0 layers", "1 to 16"]),
        (&["--at", "9223372036854775807,0"], &["leaves the coordinates"]),
        (&["--export", "hieght-tiles"], &["hieght-tiles", "did you mean height-tiles"]),
        (&["--export", "height"], &["export height cannot show a walk", "height-tiles", "geojson"]),
        (&["--export", "gltf,map"], &["export gltf cannot show a walk"]),
        (&["--export", "accumulation-tiles"], &["cannot show a walk"]),
    ];
    for (arguments, words) in cases {
        desk.refused(&[&["walk", "agents.toml", "--out", "o"], *arguments].concat(), words);
    }
    desk.refused(&["walk", "alps", "--out", "o"], &["land of noise", "thesis"]);
}

#[test]
fn a_dry_walk_tells_what_it_takes_and_writes_nothing() {
    let desk = desk();
    let before = desk.everything();
    let arguments = ["walk", "agents.toml", "--path", "way.csv", "--dry-run", "--json", "--out", "o"];
    let plan = desk.done(&arguments).last_object();
    assert_eq!(desk.everything(), before);
    desk.done(&["walk", "agents.toml", "--path", "way.csv", "--out", "o"]);
    let manifest = desk.manifest("o");
    let bytes: u64 = manifest.files.iter().map(|file| file.bytes).sum();
    assert_eq!(plan["tiles"], rows(&desk.path("o")).len());
    assert_eq!(plan["files"], manifest.files.len() + 1);
    assert!(bytes <= plan["disk_bytes"].as_u64().unwrap());
}

#[test]
fn a_walk_that_is_killed_looks_like_none_and_goes_on() {
    let desk = desk();
    let walk =
        ["walk", "thesis", "--tile-cells", "64", "--minutes", "0.5", "--threads", "1", "--export", "height-tiles,map"];
    desk.done(&[&walk[..], &["--out", "whole"]].concat());
    let mut command = desk.command(&[&walk[..], &["--out", "o"]].concat());
    let mut running = Running(command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap());
    let (pieces, start) = (desk.path("o/.terrane-bake/pieces"), Instant::now());
    // Some tiles are there, and not all.
    while fs::metadata(&pieces).map_or(0, |there| there.len()) < 1 << 20 {
        assert!(start.elapsed() < PATIENCE && running.0.try_wait().unwrap().is_none(), "it was not under way");
        thread::sleep(Duration::from_millis(1));
    }
    running.0.kill().unwrap();
    running.0.wait().unwrap();
    let left = files_in(&desk.path("o"));
    assert!(left.iter().all(|path| path.starts_with(".terrane-bake/") || path == ".terrane.lock"), "{left:?}");
    assert_eq!(desk.done(&["info", "o", "--json"]).object()["state"], "cut off");
    desk.refused(&[&walk[..], &["--out", "o"]].concat(), &["cut off", "--resume"]);
    desk.refused(
        &[&walk[..], &["--layers", "2", "--resume", "--out", "o"]].concat(),
        &["another bake", "walk.layers: 1, not 2"],
    );
    desk.done(&[&walk[..], &["--resume", "--out", "o"]].concat());
    assert!(contents(&desk.path("o")) == contents(&desk.path("whole")));
    let runs = fs::read_to_string(desk.path("o/runs.jsonl")).unwrap();
    let last: Value = serde_json::from_str(runs.lines().last().unwrap()).unwrap();
    assert!(last["tiles_known"].as_u64().unwrap() > 10 && last["outcome"] == "whole", "{runs}");
}
