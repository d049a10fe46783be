//! The rasters of water: what the tiles have, and refused where there is none.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use exr::prelude::{FlatSamples, read_first_flat_layer_from_file};
use terrane::area::{Region, TileId};
use terrane::export::{Export, Mode, Output, Plan};
use terrane::preset::Preset;
use terrane::tile::Tile;
use terrane::watch::Watch;
use terrane::world::World;

use crate::bakes::unsettled;

/// The bits of a scan-line EXR's only channel, row by row.
fn exr_bits(path: &Path) -> Vec<u32> {
    let image = read_first_flat_layer_from_file(path).unwrap();
    let FlatSamples::F32(samples) = &image.layer_data.channel_data.list[0].sample_data else { panic!("32-bit floats") };
    samples.iter().map(|sample| sample.to_bits()).collect()
}

fn grey(path: &Path) -> Vec<u8> {
    let mut reader = png::Decoder::new(BufReader::new(File::open(path).unwrap())).read_info().unwrap();
    let mut samples = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut samples).unwrap();
    assert_eq!((info.color_type, info.bit_depth), (png::ColorType::Grayscale, png::BitDepth::Eight));
    samples
}

#[test]
fn the_rasters_hold_the_water_of_the_tiles() {
    let folder = tempfile::tempdir().unwrap();
    let world = World::new(Preset::parse("test", unsettled()).unwrap(), Some(5)).unwrap();
    let region = Region::new(TileId { x: -4, y: -4 }, 8, 8, world.tile_cells()).unwrap();
    let exports = "water,depth,flow,water-tiles,depth-tiles,flow-tiles";
    let plan = Plan::new(&world, "test", region, Export::parse_list(exports).unwrap()).unwrap();
    let cost = plan.cost(2);
    plan.run(&Output::prepare(folder.path(), Mode::New, &plan, &cost).unwrap(), &Watch::default()).unwrap();
    let file = |name: &str| folder.path().join("water").join(name);
    let (kinds, depths, flows) = (grey(&file("water.png")), exr_bits(&file("depth.exr")), exr_bits(&file("flow.exr")));
    let width = region.width() as usize;
    let mut seen = [0; 4];
    for (col, row) in [(0, 0), (3, 5), (7, 7)] {
        let tile = Tile::new(&world, TileId { x: col - 4, y: row - 4 });
        let (water, area) = (tile.water().unwrap(), tile.area());
        let parts = [
            grey(&file(&format!("water_x{col}_y{row}.png"))).into_iter().map(u32::from).collect(),
            exr_bits(&file(&format!("depth_x{col}_y{row}.exr"))),
            exr_bits(&file(&format!("flow_x{col}_y{row}.exr"))),
        ];
        for (index, (x, y)) in area.vertices().enumerate() {
            let at = (y - area.y0 + row * 64) as usize * width + (x - area.x0 + col * 64) as usize;
            let grey = [0, 64, 128, 255][water.kind.at(x, y) as usize];
            let expected = [grey, water.depth_m.at(x, y).to_bits(), water.flow_m3s.at(x, y).to_bits()];
            assert_eq!([u32::from(kinds[at]), depths[at], flows[at]], expected, "region at {x}, {y}");
            assert_eq!(parts.each_ref().map(|part: &Vec<u32>| part[index]), expected, "tile at {x}, {y}");
        }
    }
    for kind in kinds {
        seen[[0, 64, 128, 255].iter().position(|grey| *grey == kind).unwrap()] += 1;
    }
    assert!(seen.iter().all(|count| *count > 0), "dry, river, lake and sea: {seen:?}");
}

#[test]
fn the_rasters_hold_the_rivers_that_agents_dig_and_the_sea() {
    let folder = tempfile::tempdir().unwrap();
    let (_, mut preset) = Preset::load("thesis").unwrap();
    // What is looked for lies in the world of the seed alone.
    preset.country = None;
    (preset.tile_cells, preset.sea_level_m) = (64, Some(40.0));
    let world = World::new(preset, Some(5)).unwrap();
    let region = Region::new(TileId { x: -2, y: -2 }, 8, 6, 64).unwrap();
    let exports = "water,depth,flow,water-tiles,depth-tiles,flow-tiles,water-geotiff,depth-geotiff,flow-geotiff,exr";
    let plan = Plan::new(&world, "test", region, Export::parse_list(exports).unwrap()).unwrap();
    let cost = plan.cost(2);
    plan.run(&Output::prepare(folder.path(), Mode::New, &plan, &cost).unwrap(), &Watch::default()).unwrap();
    let file = |name: &str| folder.path().join(name);
    let kinds = grey(&file("water/water.png"));
    let floats = |name: &str| exr_bits(&file(name)).into_iter().map(f32::from_bits).collect::<Vec<_>>();
    let (depths, flows, heights) = (floats("water/depth.exr"), floats("water/flow.exr"), floats("height/height.exr"));
    let rivers = world.preset().rivers.clone().unwrap();
    // As deep as three quarters of the bed, and with the discharge of a river that is as wide.
    let (most_deep_m, flow_m3s) =
        (0.75 * rivers.depth_m[1] as f32, rivers.width_m.map(|width_m| (width_m as f32 / 5.0).powi(2)));
    let mut seen = [0; 2];
    for (index, kind) in kinds.iter().enumerate() {
        let (depth_m, flow) = (depths[index], flows[index]);
        match kind {
            0 => assert_eq!((depth_m, flow), (0.0, 0.0)),
            64 => {
                assert!(heights[index] >= 40.0 && depth_m > 0.0 && depth_m <= most_deep_m * 1.001, "{depth_m} m");
                assert!((0.999 * flow_m3s[0]..=1.001 * flow_m3s[1]).contains(&flow), "{flow} m3/s");
                seen[0] += 1;
            }
            255 => {
                assert_eq!((depth_m, flow), (40.0 - heights[index], 0.0));
                seen[1] += 1;
            }
            other => panic!("there is no water of the kind {other} here"),
        }
    }
    assert!(seen[0] > 1000 && seen[1] > 1000, "{seen:?}");
    // Water lies where the map of the same tile is blue: in the middle of each bed.
    let tile = Tile::new(&world, TileId { x: 1, y: 1 });
    let grey = grey(&file("water/water_x3_y3.png"));
    let dug = tile.imprint().and_then(|imprint| imprint.dug());
    for ((x, y), grey) in tile.area().vertices().zip(grey) {
        let is_wet = dug.is_some_and(|dug| dug.water.at(x, y) >= 0.5) && tile.heights().at(x, y) >= 40.0;
        assert_eq!(grey == 64, is_wet, "({x}, {y})");
    }
}

#[test]
fn a_world_without_water_has_no_such_rasters() {
    let mut preset = Preset::load("thesis").unwrap().1;
    preset.rivers = None;
    let world = World::new(preset.clone(), None).unwrap();
    let region = Region::new(TileId { x: 0, y: 0 }, 1, 1, world.tile_cells()).unwrap();
    let refused = |world: &World, name: &str| {
        let error = Plan::new(world, "thesis", region, Export::parse_list(name).unwrap()).err()?;
        assert_eq!(error.exit_code(), 2);
        Some(format!("{error}; {}", error.hint().unwrap()))
    };
    for name in ["water", "depth-tiles", "flow"] {
        let said = refused(&world, name).unwrap();
        assert!([name, "fluvial", "[rivers]", "thesis", "height"].iter().all(|word| said.contains(word)), "{said}");
    }
    // A sea is water, and no river.
    preset.sea_level_m = Some(30.0);
    let world = World::new(preset, None).unwrap();
    assert_eq!(refused(&world, "water,depth"), None);
    assert!(refused(&world, "flow-geotiff").unwrap().contains("discharge"));
}
