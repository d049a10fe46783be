//! What files of a region hold does not depend on the size of the tiles that it is baked in.
//!
//! What does, and why, is not tried here: `bake.json`, `registry.sqlite`, `runs.jsonl`, `hashes.txt` and the layer
//! `tiles` are about tiles; files of tiles and of collision are those of tiles; meshes are simplified tile by tile, so
//! that a tile has the same bytes in every region; agents plan from tile to tile. Contours are joined row by row of
//! tiles, so they are there in another order.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use terrane::area::{Region, TileId};
use terrane::export::{Export, Mode, Output, Plan};
use terrane::preset::Preset;
use terrane::watch::Watch;
use terrane::world::World;

use crate::bakes::FLUVIAL;

/// All that is of a region and not of tiles.
const EXPORTS: &str = "height,exr,r16,blend,normal,map,colour,water,depth,flow,slope,aspect,steepness,curvature,accumulation,\
     wetness,scatter,geotiff,blend-geotiff,normal-geotiff,map-geotiff,colour-geotiff,water-geotiff,depth-geotiff,\
     flow-geotiff,slope-geotiff,aspect-geotiff,steepness-geotiff,splines,geojson,web-png";

/// Cells a side of the region, and of the tiles that it is baked in: numbers of two digits, and of one tiles to a side,
/// so that texts that tell of them are as long.
const CELLS: u32 = 192;
const SIDES: [u32; 3] = [32, 64, 96];

/// Files that are not the same, as the documentation above says.
const OF_TILES: [&str; 4] = ["bake.json", "registry.sqlite", "runs.jsonl", "vector/contours.geojson"];

fn files(folder: &Path, all: &mut BTreeMap<String, Vec<u8>>, root: &Path) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files(&path, all, root);
        } else {
            let name = path.strip_prefix(root).unwrap().to_string_lossy().replace('\\', "/");
            all.insert(name, fs::read(&path).unwrap());
        }
    }
}

/// A file without what it tells of tiles: of a PNG without its texts, whose checksums cover that too.
fn without_tiles(name: &str, bytes: Vec<u8>, side: u32) -> Vec<u8> {
    if Path::new(name).extension().is_some_and(|ending| ending == "png") {
        return without_texts(&bytes);
    }
    let told = format!("{0} x {0} tiles of {side} x {side} cells", CELLS / side).into_bytes();
    let Some(at) = bytes.windows(told.len()).position(|part| part == told) else { return bytes };
    let mut bytes = bytes;
    bytes[at..at + told.len()].fill(b'-');
    bytes
}

fn without_texts(png: &[u8]) -> Vec<u8> {
    let (mut kept, mut rest) = (png[..8].to_vec(), &png[8..]);
    while !rest.is_empty() {
        let length = u32::from_be_bytes(rest[..4].try_into().unwrap()) as usize;
        let (chunk, behind) = rest.split_at(length + 12);
        if !chunk[4..8].ends_with(b"Xt") {
            kept.extend(chunk);
        }
        rest = behind;
    }
    kept
}

#[test]
fn files_of_a_region_do_not_depend_on_the_size_of_tiles() {
    let folder = tempfile::tempdir().unwrap();
    let baked = SIDES.map(|side| {
        let mut preset = Preset::parse("test", FLUVIAL).unwrap();
        preset.tile_cells = side;
        let world = World::new(preset, Some(5)).unwrap();
        let count = u64::from(CELLS / side);
        let region = Region::new(TileId { x: 0, y: 0 }, count, count, side).unwrap();
        let plan = Plan::new(&world, "test", region, Export::parse_list(EXPORTS).unwrap()).unwrap();
        let out = folder.path().join(side.to_string());
        let output = Output::prepare(&out, Mode::New, &plan, &plan.cost(2)).unwrap();
        plan.run(&output, &Watch::default()).unwrap();
        let mut all = BTreeMap::new();
        files(&out, &mut all, &out);
        let whole = all.into_iter().filter(|(name, _)| !OF_TILES.contains(&name.as_str()) && !name.starts_with('.'));
        let whole: BTreeMap<String, Vec<u8>> =
            whole.map(|(name, bytes)| (name.clone(), without_tiles(&name, bytes, side))).collect();
        (whole, fs::read_to_string(out.join("vector/contours.geojson")).unwrap())
    });
    let [(first, _), others @ ..] = &baked;
    assert!(first.len() > 60 && first.contains_key("map/map.tif"), "{:?}", first.keys());
    for ((other, _), side) in others.iter().zip(&SIDES[1..]) {
        let differ: Vec<&String> = first.keys().filter(|name| other.get(*name) != first.get(*name)).collect();
        assert!(differ.is_empty() && other.len() == first.len(), "{} and {side}: {differ:?}", SIDES[0]);
    }
    // Contours have the same points where they are as long as the lattice on which these stay.
    let points = baked.map(|(_, contours)| {
        let pairs = contours.match_indices("[[").map(|(at, _)| contours[at..].split("]]").next().unwrap().to_owned());
        let points = pairs.flat_map(|line| line.split("],").map(|it| it.replace('[', "")).collect::<Vec<_>>());
        points.collect::<BTreeSet<String>>()
    });
    assert!(points[0].len() > 1000, "{}", points[0].len());
    assert!(points.iter().all(|other| *other == points[0]), "{:?}", points.each_ref().map(BTreeSet::len));
}
