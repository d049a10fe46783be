//! The guarantees of a surface, checked vertex by vertex.

use std::collections::{BTreeMap, BTreeSet};

use super::polygon::doubled_area;
use super::*;
use crate::area::TileId;
use crate::clock::Clock;
use crate::hash::combine;
use crate::preset::Preset;
use crate::tile::Tile;
use crate::world::World;

const BOUNDS_M: [f64; 6] = [0.001, 0.3, 1.0, 4.0, 30.0, 1e9];

/// Makes a grid of heights by a rule, for a tile that is not at the origin.
fn grid(cells: usize, height_m: impl Fn(i64, i64) -> f32) -> Grid<f32> {
    let area = Area::new(-70, 9, cells + 1, cells + 1);
    Grid::of(area, |x, y| height_m(x - area.x0, y - area.y0))
}

fn chance(x: i64, y: i64) -> f32 {
    (combine(x as u64, y as u64) % 100_000) as f32 * 1e-5
}

/// Grids that go to the limits: flat, sloped, stepped, spiky, random, tiny, and with sides that are no power of two.
fn grids() -> Vec<(String, Grid<f32>)> {
    let mut grids = Vec::new();
    for cells in [1, 2, 3, 7, 32, 45] {
        let last = cells as i64;
        let mut add = |name: &str, grid| grids.push((format!("{name} {cells}"), grid));
        add("flat", grid(cells, |_, _| 812.7));
        add("slope", grid(cells, |x, y| 0.25 * x as f32 - 1.5 * y as f32));
        add("steps", grid(cells, |x, y| if x + 2 * y < last { -9876.543 } else { 9876.543 }));
        add("spikes", grid(cells, |x, y| if chance(x, y) < 0.1 { 500.0 } else { 0.0 }));
        add("chance", grid(cells, |x, y| 100.0 * chance(x, y)));
        add("dust", grid(cells, |x, y| 8000.0 + 0.01 * chance(x, y)));
        add("limits", grid(cells, |x, y| if chance(x, y) < 0.5 { -MAX_HEIGHT_M } else { MAX_HEIGHT_M }));
        add("bowl", grid(cells, |x, y| 0.1 * ((2 * x - last).pow(2) + (2 * y - last).pow(2)) as f32));
    }
    grids
}

/// A built-in world with small tiles.
fn world(name: &str) -> World {
    let (_, mut preset) = Preset::load(name).unwrap();
    preset.tile_cells = 64;
    World::new(preset, Some(4)).unwrap()
}

/// Returns the largest distance in metres of a vertex from its triangles, edges included, in `f64`.
fn greatest_error_m(surface: &Surface, heights: &Grid<f32>, area: Area) -> f64 {
    let mut greatest: f64 = 0.0;
    let mut covered = BTreeSet::new();
    for triangle in &surface.triangles {
        let corners = triangle.map(|index| surface.vertices[index as usize].map(i64::from));
        let heights_m = corners.map(|[x, y]| heights.at(area.x0 + x, area.y0 + y) as f64);
        let [columns, rows] = [0, 1].map(|axis| {
            let along = corners.map(|corner| corner[axis]);
            along.into_iter().min().unwrap()..=along.into_iter().max().unwrap()
        });
        for y in rows {
            for x in columns.clone() {
                let weights = [(1, 2), (2, 0), (0, 1)].map(|(b, c)| doubled_area([corners[b], corners[c], [x, y]]));
                if weights.iter().any(|weight| *weight < 0) {
                    continue;
                }
                let sum: i64 = weights.iter().sum();
                let plane_m: f64 = (0..3).map(|at| weights[at] as f64 / sum as f64 * heights_m[at]).sum();
                greatest = greatest.max((heights.at(area.x0 + x, area.y0 + y) as f64 - plane_m).abs());
                covered.insert([x, y]);
            }
        }
    }
    assert_eq!(covered.len(), area.len(), "a vertex is in no triangle");
    greatest
}

/// Asserts everything that is true of every surface.
fn assert_sound(surface: &Surface, name: &str) {
    let cells = surface.cells as i64;
    let distinct: BTreeSet<_> = surface.vertices.iter().collect();
    assert_eq!(distinct.len(), surface.vertices.len(), "{name}: a vertex is there twice");
    let mut sum = 0;
    let mut edges: BTreeMap<(u32, u32), usize> = BTreeMap::new();
    for triangle in &surface.triangles {
        let area = doubled_area(triangle.map(|index| surface.vertices[index as usize].map(i64::from)));
        assert!(area > 0, "{name}: {triangle:?} has no area or faces down");
        sum += area;
        for (from, to) in [(0, 1), (1, 2), (2, 0)] {
            *edges.entry((triangle[from], triangle[to])).or_default() += 1;
        }
    }
    assert_eq!(sum, 2 * cells * cells, "{name}: triangles overlap or leave gaps");
    for ((from, to), count) in &edges {
        assert_eq!(*count, 1, "{name}: two triangles are on the same side of an edge");
        let ends = [*from, *to].map(|index| surface.vertices[index as usize].map(i64::from));
        let on_border = [0, 1].iter().any(|axis| [0, cells].iter().any(|at| ends.iter().all(|end| end[*axis] == *at)));
        assert_eq!(edges.contains_key(&(*to, *from)), !on_border, "{name}: {ends:?} has the wrong number of sides");
    }
    let used: BTreeSet<_> = surface.triangles.iter().flatten().collect();
    assert_eq!(used.len(), surface.vertices.len(), "{name}: a vertex is in no triangle");
}

#[test]
fn no_vertex_is_beyond_the_bound() {
    for (name, heights) in grids() {
        for bound_m in BOUNDS_M {
            let surface = Surface::simplified(&heights, heights.area(), bound_m, None, &Clock::default()).unwrap();
            assert_sound(&surface, &name);
            let error_m = greatest_error_m(&surface, &heights, heights.area());
            assert!(error_m <= bound_m + 1e-9, "{name}: {error_m} m with a bound of {bound_m} m");
        }
    }
}

#[test]
fn tiles_are_within_the_bound_and_far_fewer_triangles() {
    let bare = include_str!("../../../../tests/settled.toml").split_once("[places]").expect("places are last").0;
    let fluvial = World::new(Preset::parse("fluvial", bare).unwrap(), Some(5)).unwrap();
    let worlds = [("thesis", 0.5, world("thesis")), ("mountains", 2.0, world("mountains"))];
    for (name, bound_m, world) in worlds.into_iter().chain([("fluvial", 4.0, fluvial)]) {
        let tile = Tile::new(&world, TileId { x: 3, y: -5 });
        let surface = Surface::simplified(tile.heights(), tile.area(), bound_m, None, &Clock::default()).unwrap();
        assert_sound(&surface, name);
        let error_m = greatest_error_m(&surface, tile.heights(), tile.area());
        assert!(error_m <= bound_m + 1e-9, "{name}: {error_m} m");
        assert!(surface.triangles.len() < 64 * 64, "{name}: {} triangles", surface.triangles.len());
    }
}

#[test]
fn neighbours_share_the_vertices_of_their_edge() {
    let on = |surface: &Surface, axis: usize, at: u32| -> BTreeSet<u32> {
        surface.vertices.iter().filter(|vertex| vertex[axis] == at).map(|vertex| vertex[1 - axis]).collect()
    };
    for name in ["thesis", "mountains"] {
        let world = world(name);
        let at = TileId { x: -1, y: 7 };
        let [here, east, south] = [at, TileId { x: at.x + 1, ..at }, TileId { y: at.y + 1, ..at }].map(|id| {
            let tile = Tile::new(&world, id);
            [0.1, 2.0].map(|bound_m| {
                Surface::simplified(tile.heights(), tile.area(), bound_m, None, &Clock::default()).unwrap()
            })
        });
        for level in 0..2 {
            assert_eq!(on(&here[level], 0, 64), on(&east[level], 0, 0), "{name}");
            assert_eq!(on(&here[level], 1, 64), on(&south[level], 1, 0), "{name}");
        }
        // A coarse tile can meet a fine neighbour, or one with all vertices, if it is asked to.
        let tile = Tile::new(&world, at);
        let coarse =
            |edge_m| Surface::simplified(tile.heights(), tile.area(), 2.0, Some(edge_m), &Clock::default()).unwrap();
        assert_eq!(on(&coarse(0.1), 0, 64), on(&here[0], 0, 64), "{name}");
        assert_eq!(on(&coarse(0.0), 1, 0).len(), 65, "{name}");
        assert!(on(&here[0], 0, 64).len() > 2, "{name}: an edge without vertices proves nothing");
        assert!(on(&here[0], 0, 64).is_superset(&on(&here[1], 0, 64)), "{name}");
    }
}

#[test]
fn flat_land_is_two_triangles() {
    for cells in [1, 2, 5, 64, 100] {
        for heights in [grid(cells, |_, _| -3.3), grid(cells, |x, y| 2.0 * x as f32 - 0.5 * y as f32)] {
            assert_eq!(
                Surface::simplified(&heights, heights.area(), 0.001, None, &Clock::default()).unwrap().triangles.len(),
                2
            );
        }
    }
}

#[test]
fn a_bound_below_the_steps_keeps_everything() {
    let heights = grid(6, chance);
    for bound_m in [1e-4, 0.0, -1.0] {
        assert_eq!(
            Surface::simplified(&heights, heights.area(), bound_m, None, &Clock::default()).unwrap(),
            Surface::full(6)
        );
    }
    assert_sound(&Surface::full(1), "one cell");
    assert_sound(&Surface::full(6), "full");
    assert_eq!((Surface::full(6).vertices.len(), Surface::full(6).triangles.len()), (49, 72));
}

#[test]
fn what_is_around_the_area_does_not_matter() {
    let inside = Area::new(-60, 19, 26, 26);
    let heights = grid(45, |x, y| 100.0 * chance(x, y));
    let surface = Surface::simplified(&heights, inside, 5.0, None, &Clock::default()).unwrap();
    let mut other = Grid::filled(inside.padded(1), f32::NAN);
    for y in inside.y0..inside.y1 {
        other.row_mut(y, inside.x0, inside.x1).copy_from_slice(heights.row(y, inside.x0, inside.x1));
    }
    assert_eq!(Surface::simplified(&other, inside, 5.0, None, &Clock::default()).unwrap(), surface);
}

#[test]
fn the_same_triangles_on_every_machine() {
    let heights = grid(100, |x, y| 300.0 * chance(x / 9, y / 7) + 10.0 * chance(x, y));
    let surface = Surface::simplified(&heights, heights.area(), 3.0, None, &Clock::default()).unwrap();
    let mut hasher = blake3::Hasher::new();
    hasher.update(bytemuck::cast_slice(&surface.vertices)).update(bytemuck::cast_slice(&surface.triangles));
    assert_eq!(hasher.finalize().to_hex()[..16], *"41ac6d43024190ba");
}

#[test]
#[should_panic(expected = "not finite")]
fn heights_that_are_no_numbers_are_refused() {
    let heights = grid(4, |x, y| if (x, y) == (4, 4) { f32::NAN } else { 0.0 });
    Surface::simplified(&heights, heights.area(), 1.0, None, &Clock::default()).unwrap();
}
