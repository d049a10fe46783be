//! The order-free agents: rivers and roads are whole, stay within their reach and do not depend on who asks.

use terrane::agents::settings::Ending;
use terrane::area::{Area, TileId};
use terrane::clock::Clock;
use terrane::lines::{Line, LineEnd, LineId, LineKind};
use terrane::preset::Preset;
use terrane::tile::{Material, Tile};
use terrane::world::World;

/// The thesis' world with small tiles and many agents.
fn world(change: impl FnOnce(&mut Preset)) -> World {
    let (_, mut preset) = Preset::load("thesis").unwrap();
    // What is looked for lies in the world of the seed alone.
    preset.country = None;
    preset.tile_cells = 64;
    preset.rivers.as_mut().unwrap().density = 0.8;
    preset.roads.as_mut().unwrap().density = 0.6;
    change(&mut preset);
    World::new(preset, Some(3)).unwrap()
}

const PLACES: [(i64, i64); 3] = [(0, 0), (-5, 9), (1_000_000_000, -1_000_000_000)];

/// The tile that a line belongs to.
fn owner(line: &Line) -> TileId {
    match line.id {
        LineId::Agent { owner, .. } => owner,
        other => panic!("{other} is no agent's"),
    }
}

fn around(place: (i64, i64), tiles: i64) -> Area {
    let side = (2 * tiles * 64) as usize;
    Area::new((place.0 - tiles) * 64, (place.1 - tiles) * 64, side, side)
}

#[test]
fn a_path_is_whole_and_the_same_whoever_asks() {
    for place in PLACES {
        let (one, other) = (world(|_| ()), world(|_| ()));
        let all = one.lines(&around(place, 4), &Clock::default()).unwrap();
        assert!(all.iter().any(|path| path.kind == LineKind::River), "there are rivers");
        assert!(all.iter().any(|path| path.kind == LineKind::Road), "there are roads");
        // A world of its own, asked for one tile after another from the far end, knows the same paths of each tile.
        for y in (place.1 - 2..place.1 + 2).rev() {
            for x in (place.0 - 2..place.0 + 2).rev() {
                let tile = TileId { x, y }.area(64);
                let touching: Vec<_> = all.iter().filter(|path| path.concerns(&tile)).collect();
                let asked = other.lines(&tile, &Clock::default()).unwrap();
                assert_eq!(asked.iter().collect::<Vec<_>>(), touching, "tile ({x}, {y})");
            }
        }
    }
}

#[test]
fn a_tile_does_not_depend_on_what_was_made_before() {
    for (x, y) in PLACES {
        let (fresh, used) = (world(|_| ()), world(|_| ()));
        for (east, south) in [(3, -1), (-2, 2), (1, 0), (0, 1)] {
            Tile::new(&used, TileId { x: x + east, y: y + south });
        }
        assert_eq!(Tile::new(&fresh, TileId { x, y }).digest(), Tile::new(&used, TileId { x, y }).digest());
    }
}

#[test]
fn paths_stay_within_their_reach_and_rivers_start_at_the_highest_vertex() {
    let world = world(|_| ());
    let crossed = world.preset().rivers.as_ref().unwrap().max_tiles as i64;
    for path in world.lines(&around((0, 0), 4), &Clock::default()).unwrap() {
        let own = owner(&path).area(64);
        // Nodes stay within the tiles that may be crossed; the bed sticks out by its banks.
        let may = own.padded((crossed * 64) as usize + 64);
        assert!(may.contains(&path.bounds), "{:?} of {}", path.bounds, path.id);
        let [x, y] = path.origin;
        if path.kind == LineKind::River {
            // An eighth of the tile is margin.
            let heights = world.relief().heights(Area::new(own.x0 + 8, own.y0 + 8, 49, 49));
            let highest = heights.values().iter().copied().fold(f32::NEG_INFINITY, f32::max);
            assert_eq!(heights.at(x, y), highest, "{}", path.id);
        } else {
            // A whole number of steps from the middle, and in its tile.
            let (east, south) = (x - (own.x0 + own.x1 - 1) / 2, y - (own.y0 + own.y1 - 1) / 2);
            assert!(east % 7 == 0 && south % 7 == 0 && east.abs().max(south.abs()) < 32, "{}", path.id);
        }
    }
}

#[test]
fn rivers_end_in_other_rivers_in_ponds_or_lose_a_third() {
    let endings = |ending| {
        let world = world(|preset| preset.rivers.as_mut().unwrap().ending = ending);
        let rivers: Vec<_> = world
            .lines(&around((0, 0), 6), &Clock::default())
            .unwrap()
            .into_iter()
            .filter(|line| line.kind == LineKind::River)
            .collect();
        for river in &rivers {
            let LineEnd::Line(other) = river.end else { continue };
            // The river that it meets has its bed there, and so the two are one water.
            let Some(other) = rivers.iter().find(|line| line.id == other) else { continue };
            let end = river.place_from(other.origin, river.points.last().unwrap());
            let far = other.points.iter().map(|point| (point.place[0] - end[0]).hypot(point.place[1] - end[1]));
            let nearest = far.fold(f64::INFINITY, f64::min);
            assert!(nearest < 6.0, "{} ends {nearest} vertices from {}", river.id, other.id);
        }
        let count = |ending: fn(&LineEnd) -> bool| rivers.iter().filter(|river| ending(&river.end)).count();
        (
            count(|ending| matches!(ending, LineEnd::Line(_))),
            count(|ending| *ending == LineEnd::Pond),
            count(|ending| *ending == LineEnd::Nothing),
        )
    };
    let (met, ponds, nothing) = endings(Ending::Trim);
    assert!(met > 3 && ponds == 0 && nothing > 3, "{met} {ponds} {nothing}");
    let (met, ponds, nothing) = endings(Ending::Pond);
    assert!(met > 3 && ponds > 3 && nothing == 0, "{met} {ponds} {nothing}");
}

#[test]
fn beds_are_cut_into_the_land_and_lie_on_the_blend_map() {
    let (bare, world) = (world(|preset| (preset.rivers, preset.roads) = (None, None)), world(|_| ()));
    let (min_m, max_m) = world.height_range_m();
    let (mut cut, mut sand, mut dirt) = (0, 0, 0);
    for (x, y) in (-3..3).flat_map(|y| (-3..3).map(move |x| (x, y))) {
        let (before, after) = (Tile::new(&bare, TileId { x, y }), Tile::new(&world, TileId { x, y }));
        for (x, y) in after.area().vertices() {
            let (low, high) = (after.heights().at(x, y), before.heights().at(x, y));
            assert!(low <= high, "a bed never lies above the land");
            assert!(min_m <= low && low <= max_m, "a bed leaves the range of the world");
            cut += u32::from(low < high - 0.5);
            sand += u32::from(after.blend().weight(Material::Sand, x, y) == 255);
            dirt += u32::from(after.blend().weight(Material::Dirt, x, y) == 255);
        }
    }
    assert!(cut > 100 && sand > 100 && dirt > 100, "{cut} {sand} {dirt}");
}

#[test]
fn without_agents_there_are_no_lines() {
    let world = world(|preset| (preset.rivers, preset.roads) = (None, None));
    assert!(world.lines(&around((0, 0), 6), &Clock::default()).unwrap().is_empty());
    assert!(Tile::new(&world, TileId { x: 0, y: 0 }).imprint().is_none());
}
