//! The endless terrain around a walker, and what its agents keep.

use std::collections::BTreeMap;

use terrane::agents::Direction;
use terrane::agents::record::{Passage, TileRecord};
use terrane::agents::settings::{RiverAgents, RoadAgents};
use terrane::area::{Area, TileId};
use terrane::lines::LineKind;
use terrane::preset::Preset;
use terrane::registry::{self, Registry, TileRow};
use terrane::tile::Tile;
use terrane::walker::{Walker, WalkerOptions};
use terrane::world::World;

const CELLS: u32 = 32;
const SIDE_M: f64 = CELLS as f64;

/// The thesis' terrain in small tiles, so that agents meet on every walk.
fn world() -> World {
    let (_, mut preset) = Preset::load("thesis").unwrap();
    // What is looked for lies in the world of the seed alone.
    preset.country = None;
    preset.tile_cells = CELLS;
    preset.rivers = Some(RiverAgents { width_m: [2.0, 4.0], bank_m: 3.0, ..RiverAgents::default() });
    preset.roads = Some(RoadAgents { width_m: 2.0, shoulder_m: 2.0, ..RoadAgents::default() });
    World::new(preset, Some(3)).unwrap()
}

fn id(x: i64, y: i64) -> TileId {
    TileId { x, y }
}

/// Moves to the middle of a tile.
fn go(walker: &mut Walker, x: i64, y: i64) -> Vec<TileId> {
    let middle = |tile: i64| (tile as f64 + 0.5) * SIDE_M;
    walker.move_to(middle(x), middle(y)).unwrap().map_or(Vec::new(), |expansion| expansion.entered)
}

fn walk(walker: &mut Walker, route: &[(i64, i64)]) {
    for (x, y) in route {
        go(walker, *x, *y);
    }
}

fn hashes(walker: &Walker) -> BTreeMap<TileId, String> {
    walker.tiles().map(|tile| (tile.id(), tile.digest().to_string())).collect()
}

/// A walk that turns, comes near its own track and crosses it.
const LOOP: [(i64, i64); 18] = [
    (1, 0),
    (2, 0),
    (3, 1),
    (3, 2),
    (3, 3),
    (2, 4),
    (1, 4),
    (0, 4),
    (-1, 3),
    (-2, 2),
    (-1, 1),
    (0, 1),
    (1, 1),
    (1, 2),
    (1, 3),
    (1, 5),
    (6, 5),
    (6, 6),
];

#[test]
fn expansions_make_three_to_five_tiles_and_remove_as_many() {
    let world = world();
    let mut walker = Walker::new(&world, WalkerOptions::default());
    assert_eq!(walker.tiles().len(), 9);
    assert_eq!(walker.position_m(), [SIDE_M / 2.0; 2]);
    // Inside the tile nothing happens, up to its very edge.
    assert_eq!(walker.move_to(0.0, SIDE_M - 0.001).unwrap(), None);
    let east = walker.move_to(SIDE_M, 1.0).unwrap().unwrap();
    assert_eq!(east.entered, [id(2, 0), id(2, -1), id(2, 1)]);
    assert_eq!(east.left, [id(-1, -1), id(-1, 0), id(-1, 1)]);
    let diagonal = walker.move_to(2.5 * SIDE_M, -1.0).unwrap().unwrap();
    assert_eq!((walker.current(), diagonal.entered.len(), diagonal.left.len()), (id(2, -1), 5, 5));
    assert_eq!(walker.move_to(2.5 * SIDE_M, -2.0).unwrap(), None);
    assert!(walker.tile(id(1, 0)).is_some() && walker.tile(id(0, 0)).is_none());
    assert!(walker.tiles().map(Tile::id).is_sorted());
}

#[test]
fn however_far_it_walks_the_ring_is_all_that_stands() {
    let world = world();
    for layers in [1, 2] {
        let mut walker = Walker::new(&world, WalkerOptions { layers, ..WalkerOptions::default() });
        for step in 1..=150 {
            go(&mut walker, step, step / 3);
            assert_eq!(walker.tiles().len(), (2 * layers as usize + 1).pow(2));
        }
        // Far off, in one step.
        go(&mut walker, 1_000_000_000, -1_000_000_000);
        assert_eq!(walker.tiles().len(), (2 * layers as usize + 1).pow(2));
    }
}

#[test]
fn without_agents_a_tile_is_what_it_is_without_a_walker() {
    let (_, mut preset) = Preset::load("thesis").unwrap();
    preset.tile_cells = CELLS;
    preset.country = None;
    (preset.rivers, preset.roads) = (None, None);
    let bare = World::new(preset, Some(3)).unwrap();
    for (world, agents) in [(&bare, true), (&world(), false)] {
        let mut walker = Walker::new(world, WalkerOptions { agents, ..WalkerOptions::default() });
        go(&mut walker, 1, 1);
        for tile in walker.tiles() {
            assert_eq!(tile.digest(), Tile::new(&bare, tile.id()).digest());
        }
    }
}

#[test]
fn one_tile_a_step_makes_the_same_heights_in_more_steps() {
    let world = world();
    let options = WalkerOptions { one_tile_a_step: true, agents: false, ..WalkerOptions::default() };
    let mut walker = Walker::new(&world, options);
    assert_eq!(walker.tiles().len(), 9);
    for (expected, left) in [(id(1, 2), 5), (id(2, 1), 0), (id(0, 2), 0), (id(2, 0), 0), (id(2, 2), 0)] {
        let expansion = walker.move_to(1.5 * SIDE_M, 1.5 * SIDE_M).unwrap().unwrap();
        assert_eq!((expansion.entered, expansion.left.len()), (vec![expected], left));
    }
    assert_eq!(walker.move_to(1.5 * SIDE_M, 1.5 * SIDE_M).unwrap(), None);
    let mut other = Walker::new(&world, WalkerOptions { one_tile_a_step: false, ..options });
    go(&mut other, 1, 1);
    assert_eq!(hashes(&walker), hashes(&other));
    // One that outruns its terrain first gets the tile that it stands on.
    assert_eq!(go(&mut walker, 50, 0), [id(50, 0)]);
}

#[test]
fn tiles_that_stand_never_change() {
    let world = world();
    let mut walker = Walker::new(&world, WalkerOptions::default());
    let mut known = hashes(&walker);
    for (x, y) in LOOP {
        go(&mut walker, x, y);
        for (tile, hash) in hashes(&walker) {
            assert_eq!(known.entry(tile).or_insert_with(|| hash.clone()), &hash, "tile {tile}");
        }
    }
}

#[test]
fn a_tile_left_and_visited_again_is_the_same_to_the_byte() {
    let world = world();
    for one_tile_a_step in [false, true] {
        let options = WalkerOptions { one_tile_a_step, ..WalkerOptions::default() };
        let mut walker = Walker::new(&world, options);
        for (x, y) in LOOP {
            go(&mut walker, x, y);
        }
        while !walker.missing().is_empty() {
            go(&mut walker, 6, 6);
        }
        let before = hashes(&walker);
        go(&mut walker, 500, 500);
        assert!(walker.tile(id(6, 6)).is_none());
        go(&mut walker, 6, 6);
        while !walker.missing().is_empty() {
            go(&mut walker, 6, 6);
        }
        assert_eq!(hashes(&walker), before);
        // And another walker, which has only the records, by way of their bytes.
        let records = walker.records().iter().map(|record| TileRecord::from_bytes(&record.to_bytes()).unwrap());
        let start = WalkerOptions { start: id(6, 6), ..options };
        let other = Walker::with_records(&world, start, records).unwrap();
        assert_eq!(hashes(&other), before);
        assert_eq!(other.records(), walker.records());
        // The test would prove nothing without rivers and roads in these tiles.
        let kinds: Vec<LineKind> =
            before.keys().flat_map(|tile| other.lines(*tile).iter().map(|line| line.kind)).collect();
        assert!(kinds.contains(&LineKind::River) && kinds.contains(&LineKind::Road), "{kinds:?}");
    }
}

#[test]
fn the_way_goes_on_the_same_after_a_break() {
    let world = world();
    let mut whole = Walker::new(&world, WalkerOptions::default());
    walk(&mut whole, &LOOP);
    let (first, second) = LOOP.split_at(7);
    let mut walker = Walker::new(&world, WalkerOptions::default());
    walk(&mut walker, first);
    let options = WalkerOptions { start: walker.current(), ..WalkerOptions::default() };
    let mut again = Walker::with_records(&world, options, walker.records().to_vec()).unwrap();
    walk(&mut again, second);
    assert_eq!(again.records(), whole.records());
    assert_eq!(hashes(&again), hashes(&whole));
}

#[test]
fn records_that_cannot_be_are_refused() {
    let world = world();
    let walker = Walker::new(&world, WalkerOptions::default());
    let known = walker.records().to_vec();
    let twice = known.iter().chain(&known[..1]).copied();
    let error = Walker::with_records(&world, WalkerOptions::default(), twice).unwrap_err();
    assert!(error.to_string().contains("(-1, -1) has two records"), "{error}");
    let mut outside = known.clone();
    let passage = outside.iter_mut().find_map(|record| record.river.as_mut()).unwrap();
    passage.last = [0, CELLS as u16 + 1];
    let error = Walker::with_records(&world, WalkerOptions::default(), outside).unwrap_err();
    assert!(error.to_string().contains("vertex (0, 33)"), "{error}");
}

fn neighbour(id: TileId, direction: Direction) -> TileId {
    let (east, south) = direction.step();
    TileId { x: id.x + east, y: id.y + south }
}

fn vertex(id: TileId, [east, south]: [u16; 2]) -> (i64, i64) {
    (id.x * i64::from(CELLS) + i64::from(east), id.y * i64::from(CELLS) + i64::from(south))
}

/// Every passage of a walk, with its tile and the vertices from a node to the next.
fn passages(records: &[TileRecord]) -> Vec<(TileId, LineKind, i64, Passage)> {
    let kinds = [(LineKind::River, 1), (LineKind::Road, 7)];
    let of = |record: &TileRecord| kinds.map(|(kind, stride)| Some((record.id, kind, stride, *record.passage(kind)?)));
    records.iter().flat_map(of).flatten().collect()
}

#[test]
fn an_agent_goes_on_beside_where_it_stopped() {
    let world = world();
    let mut walker = Walker::new(&world, WalkerOptions::default());
    walk(&mut walker, &LOOP);
    let find = |id: TileId| walker.records().iter().find(|record| record.id == id);
    let mut crossed = BTreeMap::new();
    for (tile, kind, stride, passage) in passages(walker.records()) {
        let Some(entry) = passage.entry else { continue };
        let from = neighbour(tile, entry.opposite());
        let before = find(from).unwrap().passage(kind).unwrap();
        let (east, south) = entry.step();
        let (x, y) = vertex(from, before.last);
        assert_eq!(vertex(tile, passage.start), (x + east * stride, y + south * stride), "{kind:?} into {tile}");
        assert_eq!((before.exit, before.direction), (Some(entry), passage.direction));
        assert_eq!((before.end_cells(stride as u32), before.lowest_m), (passage.before_cells, passage.lowest_before_m));
        *crossed.entry(kind).or_insert(0) += 1;
    }
    assert!(crossed[&LineKind::River] > 5 && crossed[&LineKind::Road] > 5, "{crossed:?}");
}

#[test]
fn what_waits_waits_only_where_no_tile_was_made() {
    let world = world();
    let mut walker = Walker::new(&world, WalkerOptions::default());
    walk(&mut walker, &LOOP);
    let find = |id: TileId| walker.records().iter().find(|record| record.id == id);
    let (mut waiting, mut ended) = (0, 0);
    for (tile, kind, _, passage) in passages(walker.records()) {
        let Some(exit) = passage.exit else {
            ended += usize::from(passage.entry.is_some());
            continue;
        };
        match find(neighbour(tile, exit)) {
            None => waiting += 1,
            // It went on there, or another of its kind that had come farther did.
            Some(next) => {
                let next = next.passage(kind).unwrap_or_else(|| panic!("{kind:?} of {tile} is not taken over"));
                assert!(next.entry.is_some());
            }
        }
    }
    assert!(waiting > 5 && ended > 2, "{waiting} wait, {ended} have ended");
}

#[test]
fn neighbours_agree_on_their_shared_vertices_with_agents_too() {
    let mut preset = world().preset().clone();
    preset.roads.as_mut().unwrap().graded = true;
    let world = World::new(preset, Some(3)).unwrap();
    let mut walker = Walker::new(&world, WalkerOptions::default());
    let mut touched = 0;
    for (x, y) in LOOP {
        go(&mut walker, x, y);
        for tile in walker.tiles() {
            for direction in [Direction::East, Direction::South] {
                let Some(other) = walker.tile(neighbour(tile.id(), direction)) else { continue };
                let (one, two) = (tile.area(), other.area());
                for (x, y) in
                    (two.y0..one.y1.min(two.y1)).flat_map(|y| (two.x0..one.x1.min(two.x1)).map(move |x| (x, y)))
                {
                    let look = |tile: &Tile| {
                        let normal = tile.normals().at(x, y).map(f32::to_bits);
                        let ground = (tile.blend().ground().at(x, y), tile.blend().cover().at(x, y));
                        (tile.heights().at(x, y).to_bits(), normal, ground)
                    };
                    assert_eq!(look(tile), look(other), "{} and {} at ({x}, {y})", tile.id(), other.id());
                    let grids = tile.imprint().into_iter().flat_map(|it| it.sand().into_iter().chain(it.dirt()));
                    touched += usize::from(grids.map(|grid| grid.at(x, y)).any(|share| share > 0.0));
                }
            }
        }
    }
    assert!(touched > 100, "lines touch {touched} vertices of edges");
}

#[test]
fn rivers_start_on_the_highest_vertex_and_roads_near_the_middle() {
    let world = world();
    let mut walker = Walker::new(&world, WalkerOptions::default());
    walk(&mut walker, &LOOP);
    let (mut rivers, mut roads) = (0, 0);
    for (tile, kind, _, passage) in passages(walker.records()) {
        if passage.entry.is_some() {
            continue;
        }
        match kind {
            LineKind::River => {
                // An eighth of the tile is margin.
                let area = Area::new(tile.x * 32 + 4, tile.y * 32 + 4, 25, 25);
                let heights = world.relief().heights(area);
                let highest_m = heights.values().iter().copied().fold(f32::NEG_INFINITY, f32::max);
                let (x, y) = vertex(tile, passage.start);
                assert_eq!(heights.at(x, y), highest_m, "{tile}");
                assert_eq!(passage.lowest_before_m, highest_m);
                rivers += 1;
            }
            LineKind::Road => {
                // In it, or a step beside it where it is too steep to go on.
                assert!(passage.start.iter().all(|side| [9, 16, 23].contains(side)), "{:?} of {tile}", passage.start);
                roads += 1;
            }
        }
    }
    assert!(rivers > 5 && roads > 5, "{rivers} rivers, {roads} roads");
}

#[test]
fn every_free_tile_starts_a_river_a_road_or_both() {
    // On gentle ground agents go straight on in the direction of growth, so that none comes upon a tile that stands.
    let mut preset = world().preset().clone();
    preset.noise.iter_mut().for_each(|term| term.height_m = 0.05);
    preset.rivers.as_mut().unwrap().density = 0.0;
    preset.roads.as_mut().unwrap().density = 0.0;
    let world = World::new(preset, Some(3)).unwrap();
    let mut walker = Walker::new(&world, WalkerOptions::default());
    for far in 1..=20 {
        go(&mut walker, 100 * far, -70 * far);
    }
    let mut cases = BTreeMap::new();
    for TileRecord { id, river, road } in walker.records() {
        if river.iter().chain(road).any(|passage| passage.entry.is_some()) {
            continue;
        }
        assert!(river.is_some() || road.is_some(), "tile {id} starts nothing");
        *cases.entry((river.is_some(), road.is_some())).or_insert(0) += 1;
    }
    assert!(cases.len() == 3 && cases.values().all(|tiles| *tiles > 20), "{cases:?}");
}

#[test]
fn a_new_tile_aims_where_the_terrain_grows() {
    let world = world();
    let mut walker = Walker::new(&world, WalkerOptions::default());
    let mut started = 0;
    let west = (-8..0).rev().map(|x| (x, 0, Direction::West));
    let south = (1..5).map(|y| (-8, y, Direction::South));
    for (x, y, expected) in west.chain(south) {
        for tile in go(&mut walker, x, y) {
            let record = walker.records().iter().find(|record| record.id == tile).unwrap();
            for passage in record.river.iter().chain(&record.road).filter(|passage| passage.entry.is_none()) {
                assert_eq!(passage.direction, expected, "{tile}");
                started += 1;
            }
        }
    }
    assert!(started > 3, "{started}");
}

#[test]
fn the_route_decides_so_these_agents_cannot_keep_the_promise_of_one_world() {
    let world = world();
    let walked = |route: &[(i64, i64)]| {
        let mut walker = Walker::new(&world, WalkerOptions::default());
        walk(&mut walker, route);
        hashes(&walker)
    };
    let east_first = walked(&[(1, 0), (2, 0), (2, 1), (2, 2)]);
    let south_first = walked(&[(0, 1), (0, 2), (1, 2), (2, 2)]);
    assert!(east_first.keys().eq(south_first.keys()));
    assert_ne!(east_first, south_first);
}

#[test]
fn a_walk_goes_on_from_its_registry() {
    let (world, folder) = (world(), tempfile::tempdir().unwrap());
    let mut whole = Walker::new(&world, WalkerOptions::default());
    walk(&mut whole, &LOOP);
    let mut walker = Walker::new(&world, WalkerOptions::default());
    walk(&mut walker, &LOOP[..9]);
    let path = folder.path().join(registry::FILE_NAME);
    let mut saved = Registry::open(&path).unwrap();
    saved.append(walker.records().iter().map(|record| TileRow::of_walk(record, CELLS))).unwrap();
    saved.close().unwrap();
    // Another day: nothing is left but the file.
    let rows = Registry::read(&path).unwrap().rows().unwrap();
    assert!(rows.iter().any(|row| row.river.is_some()) && rows.iter().any(|row| row.road.is_some()));
    let records = rows.iter().map(|row| row.walk_record().unwrap());
    let (x, y) = LOOP[8];
    let options = WalkerOptions { start: id(x, y), ..WalkerOptions::default() };
    let mut again = Walker::with_records(&world, options, records).unwrap();
    walk(&mut again, &LOOP[9..]);
    assert_eq!(hashes(&again), hashes(&whole));
}
