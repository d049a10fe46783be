//! Land from afar: the same world at the nodes of a stride, whatever is asked for, and the same from one stride to the
//! next.

use terrane::area::{Area, Stride, TileId};
use terrane::clock::Clock;
use terrane::grid::Grid;
use terrane::land::{Land, WaterKind};
use terrane::preset::Preset;
use terrane::tile::{Material, Tile};
use terrane::world::World;

use crate::is_long;

fn world(name: &str, vertices: u64) -> World {
    let (_, mut preset) = Preset::load(name).unwrap();
    // Places and bounds of these tests are of the world of the seed alone.
    preset.country = None;
    World::strided(preset, Some(4), Stride::new(vertices).unwrap()).unwrap()
}

fn heights(world: &World, area: Area) -> Grid<f32> {
    world.relief().heights(area)
}

/// The nodes around an area's of which there are so many from one of these to the next.
fn finer(area: Area, by: i64) -> Area {
    let half = by / 2;
    let last = |past: i64| (past - 1) * by + half + 1;
    Area { x0: by * area.x0 - half, y0: by * area.y0 - half, x1: last(area.x1), y1: last(area.y1) }
}

/// The mean around a node of what finer ones are, of which there are so many from it to the next.
fn mean_around([x, y]: [i64; 2], by: i64, of: impl Fn(i64, i64) -> f32) -> f32 {
    let half = by / 2;
    let weight = |off: i64| if off.abs() == half { 0.5 } else { 1.0 } / by as f32;
    let around = (-half..=half).flat_map(|dy| (-half..=half).map(move |dx| (dx, dy)));
    around.map(|(dx, dy)| weight(dx) * weight(dy) * of(by * x + dx, by * y + dy)).sum()
}

/// The means around every second node of what lies a node around an area's nodes.
fn halved(world: &World, area: Area) -> Grid<f32> {
    let fine = heights(world, finer(area, 2));
    Grid::of(area, |x, y| mean_around([x, y], 2, |x, y| fine.at(x, y)))
}

#[test]
fn land_is_the_same_whatever_the_same_world_at_other_nodes_has_found() {
    // Near and far, with a sea, with none, and of noise.
    for (name, strides) in [("archipelago", [2, 64, 2048]), ("badlands", [4, 128, 2048]), ("thesis", [2, 8, 64])] {
        let near = world(name, 1);
        let area = Area::new(-20, 12, 40, 24);
        let rivers =
            |world: &World| world.relief().fluvial().map(|fluvial| fluvial.rivers(&area, &Clock::default()).unwrap());
        // What is found first is found by another one.
        let mut found = vec![(heights(&near, area), rivers(&near))];
        for vertices in strides {
            let (alone, beside) = (world(name, vertices), near.at_stride(Stride::new(vertices).unwrap()));
            assert_eq!(beside.spacing_m(), alone.spacing_m());
            found.push((heights(&beside, area), rivers(&beside)));
            assert!(found.last() == Some(&(heights(&alone, area), rivers(&alone))), "{name} at {vertices}");
        }
        let again = near.at_stride(Stride::ONE);
        assert!(found[0] == (heights(&again, area), rivers(&again)), "{name}");
        assert_eq!(again.places().is_some(), near.places().is_some());
    }
}

#[test]
fn a_sketch_is_about_the_land_that_it_is_of_and_leaves_that_as_it_is() {
    for (name, vertices) in [("alps", 32), ("archipelago", 256), ("badlands", 128), ("thesis", 16)] {
        let (world, stride, area) = (world(name, 1), Stride::new(vertices).unwrap(), Area::new(-30, 20, 64, 64));
        let sketch = world.sketch_at_stride(stride).relief().land(area, &Clock::default()).unwrap();
        let whole = world.at_stride(stride).relief().land(area, &Clock::default()).unwrap();
        let alone = World::strided(world.preset().clone(), Some(4), stride).unwrap();
        assert!(whole.heights == heights(&alone, area), "{name}");
        // Noise has nothing that could be left out.
        assert_eq!(sketch.heights == whole.heights, name == "thesis");
        let [low, high] =
            whole.heights.values().iter().fold([f32::MAX, f32::MIN], |[low, high], m| [low.min(*m), high.max(*m)]);
        let off =
            sketch.heights.values().iter().zip(whole.heights.values()).map(|(sketch, whole)| (sketch - whole).abs());
        let apart = off.sum::<f32>() / area.len() as f32 / (high - low);
        assert!(apart < 0.05, "{name}: {apart} of the relief");
        if let (Some(drawn), Some(water)) = (&sketch.water, &whole.water) {
            let is_sea = |kind: &WaterKind| *kind == WaterKind::Sea;
            let kinds = drawn.kind.values().iter().zip(water.kind.values());
            let others = kinds.filter(|(drawn, kind)| is_sea(drawn) != is_sea(kind)).count();
            assert!(others * 20 < area.len(), "{name}: {others} nodes are sea in one alone");
        }
    }
}

/// Of the strides that a test lists, the suite tries every second one, and its long form all.
fn step() -> usize {
    if is_long() { 1 } else { 2 }
}

#[test]
fn a_node_is_the_same_in_every_window() {
    for (name, strides) in [
        ("alps", &[2, 8, 32, 128, 512, 1024, 4096][..]),
        ("archipelago", &[4, 16, 64, 256, 1024, 4096]),
        ("badlands", &[2048]),
        ("canyon", &[8, 128]),
        ("thesis", &[2, 64]),
    ] {
        for vertices in strides.iter().step_by(step()) {
            let world = world(name, *vertices);
            let area = Area::new(-40, 24, 72, 48);
            let whole = world.relief().land(area, &Clock::default()).unwrap();
            for part in area.halves() {
                let land = world.relief().land(part, &Clock::default()).unwrap();
                assert_eq!(land.heights, whole.heights.part(part), "{name} at {vertices}");
                if let (Some(water), Some(all)) = (&land.water, &whole.water) {
                    assert_eq!(water.kind, all.kind.part(part), "{name} at {vertices}");
                }
            }
            let (low_m, high_m) = world.height_range_m();
            assert!(whole.heights.values().iter().all(|height_m| (low_m..=high_m).contains(height_m)));
            // However much land a node stands for.
            assert!(world.remembered_bytes() <= world.memory_bytes(1), "{name} at {vertices}");
        }
    }
}

#[test]
fn neighbouring_strides_show_the_same_land() {
    // Of what a stride of 64 shows of its relief, how far two may be apart in the mean, and to one side; the last ones
    // are those whose nodes are further apart than the trunks.
    for (name, powers, most, bias) in [
        ("alps", 0..7, 0.05, 0.015),
        ("fjords", 0..7, 0.05, 0.015),
        ("mountains", 0..7, 0.03, 0.01),
        ("alps", 9..12, 0.05, 0.015),
        ("badlands", 9..12, 0.05, 0.015),
        ("canyon", 9..12, 0.05, 0.015),
    ] {
        let relief_m = {
            let land = heights(&world(name, 64), Area::new(0, 0, 96, 96));
            let ends = land.values().iter().fold([f32::MAX, f32::MIN], |[low, high], &m| [low.min(m), high.max(m)]);
            ends[1] - ends[0]
        };
        for power in powers.step_by(step()) {
            let vertices = 1 << power;
            let area = Area::new(0, 0, 96, 96);
            let (fine, coarse) = (halved(&world(name, vertices), area), heights(&world(name, 2 * vertices), area));
            let off = fine.values().iter().zip(coarse.values()).map(|(fine, coarse)| coarse - fine);
            let (sum, all) = off.fold((0.0, 0.0), |(sum, all), off: f32| (sum + off, all + off.abs()));
            let [mean, apart] = [sum, all].map(|sum| sum / area.len() as f32 / relief_m);
            assert!(apart < most && mean.abs() < bias, "{name}, {vertices} to {}: {apart}, {mean}", 2 * vertices);
        }
    }
}

#[test]
fn coasts_stay_where_they_are() {
    for name in ["archipelago", "fjords"] {
        let area = Area::new(-64, -64, 128, 128);
        let kinds = |vertices: u64, area: Area| {
            let land = world(name, vertices).relief().land(area, &Clock::default()).unwrap();
            land.water.unwrap().kind
        };
        let sea = |kinds: &Grid<WaterKind>| kinds.values().iter().filter(|kind| **kind == WaterKind::Sea).count();
        let coarse = kinds(32, area);
        let mut shares = vec![sea(&coarse) as f64 / area.len() as f64];
        for vertices in [64, 128] {
            let by = 32.0 / vertices as f64;
            let side = (128.0 * by) as usize;
            let kinds = kinds(vertices, Area::new(-(side as i64) / 2, -(side as i64) / 2, side, side));
            shares.push(sea(&kinds) as f64 / (side * side) as f64);
        }
        assert!((0.05..0.95).contains(&shares[0]), "{name}: {shares:?}");
        assert!(shares.iter().all(|share| (share - shares[0]).abs() < 0.05), "{name}: {shares:?}");
    }
}

#[test]
fn beyond_the_trunks_a_node_is_the_mean_of_what_shows_them() {
    // Of 512 vertices a trunk's cell is wide, and 128 show it.
    let land =
        |vertices: u64, area: Area| world("archipelago", vertices).relief().land(area, &Clock::default()).unwrap();
    let shown = land(128, finer(Area::new(0, 0, 24, 24), 8));
    let is_sea = |land: &Land, x, y| land.water.as_ref().unwrap().kind.at(x, y) == WaterKind::Sea;
    for by in [8, 16] {
        let area = Area::new(1, 1, 192 / by - 2, 192 / by - 2);
        let far = land(128 * by as u64, area);
        let (mut unlike, mut apart_m, mut higher_m) = (0, 0.0, 0.0);
        for (x, y) in area.vertices() {
            let mean = |of: &dyn Fn(i64, i64) -> f32| mean_around([x, y], by as i64, of);
            let sea = mean(&|x, y| f32::from(u8::from(is_sea(&shown, x, y))));
            let own_m = |of_sea: bool| {
                let height_m = |x, y| if is_sea(&shown, x, y) == of_sea { shown.heights.at(x, y) } else { 0.0 };
                mean(&height_m) / if of_sea { sea } else { 1.0 - sea }
            };
            if is_sea(&far, x, y) != (sea >= 0.5) {
                unlike += 1;
            } else {
                let off_m = far.heights.at(x, y) - own_m(sea >= 0.5);
                (apart_m, higher_m) = (apart_m + off_m.abs(), higher_m + off_m);
            }
        }
        let [unlike, apart_m, higher_m] = [unlike as f32, apart_m, higher_m].map(|sum| sum / area.len() as f32);
        assert!(unlike < 0.02, "{by}: {unlike} of the nodes are sea and should not be, or the other way round");
        assert!(apart_m < 1.0 && higher_m.abs() < 0.3, "{by}: {apart_m} m off, {higher_m} m higher");
    }
}

#[test]
fn tiles_of_a_stride_meet() {
    for vertices in [4, 64] {
        let world = world("alps", vertices);
        let [west, east] = [0, 1].map(|x| Tile::new(&world, TileId { x, y: -3 }));
        let cells = i64::from(world.tile_cells());
        for y in -3 * cells..=-2 * cells {
            assert_eq!(west.heights().at(cells, y), east.heights().at(cells, y));
            assert_eq!(west.normals().at(cells, y), east.normals().at(cells, y));
            let blends = [&west, &east].map(|tile| Material::ALL.map(|it| tile.blend().weight(it, cells, y)));
            assert_eq!(blends[0], blends[1]);
        }
    }
}
