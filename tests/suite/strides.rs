//! Land from afar: the same world at the nodes of a stride, whatever is asked for, and the same from one stride to the next.

use terrane::area::{Area, Stride, TileId};
use terrane::clock::Clock;
use terrane::grid::Grid;
use terrane::land::WaterKind;
use terrane::preset::Preset;
use terrane::tile::{Material, Tile};
use terrane::world::World;

fn world(name: &str, vertices: u64) -> World {
    let (_, preset) = Preset::load(name).unwrap();
    World::strided(preset, Some(4), Stride::new(vertices).unwrap()).unwrap()
}

fn heights(world: &World, area: Area) -> Grid<f32> {
    world.relief().heights(area)
}

/// The means around every second node of what lies a node around an area's nodes.
fn halved(world: &World, area: Area) -> Grid<f32> {
    let finer = Area { x0: 2 * area.x0 - 1, y0: 2 * area.y0 - 1, x1: 2 * area.x1, y1: 2 * area.y1 };
    let (fine, mut means) = (heights(world, finer), Grid::filled(area, 0.0));
    for (x, y) in area.vertices() {
        let weight = |off: i64| if off == 0 { 0.5 } else { 0.25 };
        let around = (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (dx, dy)));
        means.row_mut(y, x, x + 1)[0] =
            around.map(|(dx, dy)| weight(dx) * weight(dy) * fine.at(2 * x + dx, 2 * y + dy)).sum();
    }
    means
}

#[test]
fn a_node_is_the_same_in_every_window() {
    for (name, strides) in [
        ("alps", &[2, 8, 32, 128, 512, 1024, 4096][..]),
        ("archipelago", &[4, 16, 64, 256]),
        ("canyon", &[8, 128]),
        ("thesis", &[2, 64]),
    ] {
        for vertices in strides {
            let world = world(name, *vertices);
            let area = Area::new(-40, 24, 72, 48);
            let whole = world.relief().land(area, &Clock::default());
            for part in area.halves() {
                let land = world.relief().land(part, &Clock::default());
                assert_eq!(land.heights, whole.heights.part(part), "{name} at {vertices}");
                if let (Some(water), Some(all)) = (&land.water, &whole.water) {
                    assert_eq!(water.kind, all.kind.part(part), "{name} at {vertices}");
                }
            }
            let (low_m, high_m) = world.height_range_m();
            assert!(whole.heights.values().iter().all(|height_m| (low_m..=high_m).contains(height_m)));
        }
    }
}

#[test]
fn neighbouring_strides_show_the_same_land() {
    // Of what the coarsest of them shows of its relief, how far two may be apart in the mean, and to one side.
    for (name, most, bias) in [("alps", 0.05, 0.015), ("fjords", 0.05, 0.015), ("mountains", 0.03, 0.01)] {
        let relief_m = {
            let land = heights(&world(name, 64), Area::new(0, 0, 96, 96));
            let ends = land.values().iter().fold([f32::MAX, f32::MIN], |[low, high], &m| [low.min(m), high.max(m)]);
            ends[1] - ends[0]
        };
        for power in 0..7 {
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
            let land = world(name, vertices).relief().land(area, &Clock::default());
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
