//! A preset may have any name without control characters: vectors, pages and notes hold it as it is, and other programs read them.
#![no_main]

use std::fs;

use libfuzzer_sys::fuzz_target;
use terrane::area::{Region, TileId};
use terrane::export::{Export, Manifest, Mode, Output, Plan, Profile};
use terrane::preset::Preset;
use terrane::watch::Watch;
use terrane::world::World;

const PRESET: &str = "tile_cells = 16\nnoise = [{ kind = \"fbm\", height_m = 9.0, wavelength_m = 300.0, octaves = 2 }]";

fuzz_target!(|name: &str| {
    let world = World::new(Preset::parse("fuzz.toml", PRESET).unwrap(), None).unwrap();
    let region = Region::new(TileId { x: 0, y: 0 }, 1, 1, 16).unwrap();
    let plan = Plan::new(&world, name, region, Export::parse_list("vector,geojson,obj").unwrap());
    // Those that would do something to other programs are refused, and no others.
    assert_eq!(plan.is_err(), name.len() > 4096 || name.chars().any(char::is_control));
    let Ok(plan) = plan else { return };
    let plan = plan.with_profile(Profile::Blender).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let output = Output::prepare(folder.path(), Mode::New, &plan, &plan.cost(1)).unwrap();
    plan.run(&output, &Watch::default()).unwrap();
    assert_eq!(Manifest::read(folder.path()).unwrap().preset_name, name);
    let database = rusqlite::Connection::open(folder.path().join("vector/vector.gpkg")).unwrap();
    let check: String = database.query_row("PRAGMA integrity_check", (), |row| row.get(0)).unwrap();
    assert_eq!(check, "ok");
    for entry in fs::read_dir(folder.path().join("vector")).unwrap().map(|entry| entry.unwrap().path()) {
        if entry.extension().is_some_and(|ending| ending == "geojson") {
            serde_json::from_slice::<serde_json::Value>(&fs::read(entry).unwrap()).unwrap();
        }
    }
});
