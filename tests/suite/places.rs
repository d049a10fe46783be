//! Settlements and roads of fluvial worlds: the same whatever is asked for, dry, and no steeper than they may be.

use std::sync::{LazyLock, OnceLock};

use terrane::area::{Area, TileId};
use terrane::clock::Clock;
use terrane::fluvial::survey::{Sampling, Survey};
use terrane::geometry::LineSegment;
use terrane::land::WaterKind;
use terrane::lines::{FIXED, Line, LineId, LineKind, Lines, Structure, StructureKind};
use terrane::preset::Preset;
use terrane::tile::Tile;
use terrane::world::World;

use crate::is_long;
use crate::worlds::lighten;

/// A world whose valleys, lakes and hills are a few kilometres apart, and its settlements as well.
const PLACES: &str = "
    spacing_m = 10
    tile_cells = 64
    sea_level_m = 0
    [fluvial]
    trunk_m = 5120
    levels = 5
    base_m = 60
    trunk_slope = 0.012
    hill_slope = [0.1, 0.35]
    valley = 0.06
    lakes = 0.4
    coast = { below = -0.3 }
    uplift = { mask = { wavelength_m = 16000, octaves = 2, from = -0.4, to = 0.4 }, least = 0.2 }
    [places]
    site_m = 2000
";

fn world() -> World {
    World::new(Preset::parse("places", PLACES).unwrap(), Some(3)).unwrap()
}

/// 10 x 10 km.
fn wide() -> Area {
    Area::new(-300, -500, 1000, 1000)
}

/// All roads that concern an area.
fn roads_of(world: &World, area: &Area) -> Lines {
    world.lines(area, &Clock::default()).unwrap().into_iter().filter(|line| line.kind == LineKind::Road).collect()
}

/// A world and its roads in a wide area, made once for the tests that look at them.
fn settled() -> &'static (World, Lines) {
    static SETTLED: OnceLock<(World, Lines)> = OnceLock::new();
    SETTLED.get_or_init(|| {
        let world = world();
        let roads = roads_of(&world, &wide());
        assert!(roads.len() > 15, "{} roads", roads.len());
        (world, roads)
    })
}

/// A world for those who ask again: it remembers other things, or in the long form nothing.
fn again() -> &'static World {
    static AGAIN: LazyLock<World> = LazyLock::new(world);
    if is_long() { Box::leak(Box::new(world())) } else { &AGAIN }
}

/// A tile far out.
const FAR: TileId = TileId { x: 100_000_000, y: -100_000_000 };

/// Tiles that a road with a crossing runs through; in the long form one far out as well.
fn places_to_look() -> Vec<TileId> {
    let count = if is_long() { 8 } else { 4 };
    let (_, roads) = settled();
    let tile = |at: [i64; 2]| {
        let [x, y] = at.map(|at| at.div_euclid(64 * FIXED));
        TileId { x, y }
    };
    let crossed = roads.iter().flat_map(|road| road.structures.iter().map(|structure| tile(structure.middle(road))));
    let tiles: Vec<TileId> = crossed.take(count).collect();
    assert_eq!(tiles.len(), count);
    tiles.into_iter().chain(is_long().then_some(FAR)).collect()
}

fn bits(tile: &Tile, x: i64, y: i64) -> (u32, u32, u32) {
    (tile.heights().at(x, y).to_bits(), tile.blend().ground().at(x, y), tile.blend().cover().at(x, y))
}

#[test]
fn neighbours_agree_on_their_shared_vertices() {
    let other = again();
    let mut graded = 0;
    for at in places_to_look() {
        let tile = Tile::new(other, at);
        graded += usize::from(tile.lines().iter().any(|line| line.kind == LineKind::Road));
        let Area { x0, y0, x1, y1 } = tile.area();
        let south = Tile::new(&settled().0, TileId { y: at.y + 1, ..at });
        (x0..x1).for_each(|x| assert_eq!(bits(&tile, x, y1 - 1), bits(&south, x, y1 - 1), "{at} at {x}"));
        let east = Tile::new(&settled().0, TileId { x: at.x + 1, ..at });
        (y0..y1).for_each(|y| assert_eq!(bits(&tile, x1 - 1, y), bits(&east, x1 - 1, y), "{at} at {y}"));
    }
    assert!(graded >= 3);
}

#[test]
fn tiles_of_other_sizes_agree_where_they_overlap() {
    // Tiles of 96 cells lie elsewhere than those of 64; what a vertex is does not know of tiles.
    let mut preset = Preset::parse("places", PLACES).unwrap();
    preset.tile_cells = 96;
    let larger = World::new(preset, Some(3)).unwrap();
    let mut changed = 0;
    for at in places_to_look() {
        let tile = Tile::new(&settled().0, at);
        let Area { x0, y0, x1, y1 } = tile.area();
        let other = Tile::new(&larger, TileId { x: x0.div_euclid(96), y: y0.div_euclid(96) });
        let bare = Tile::bare_heights(&larger, other.id());
        let common = tile.area().common(&other.area()).unwrap();
        assert!(common.x0 == x0 && common.y0 == y0 && common.x1 <= x1 && common.y1 <= y1);
        for (x, y) in common.vertices() {
            assert_eq!(bits(&tile, x, y), bits(&other, x, y), "{at} at ({x}, {y})");
            changed += usize::from(bare.at(x, y).to_bits() != tile.heights().at(x, y).to_bits());
        }
    }
    assert!(changed > 50, "{changed} vertices are graded");
}

#[test]
fn far_out_there_are_roads_too() {
    let mut preset = Preset::parse("places", PLACES).unwrap();
    lighten(&mut preset);
    let [world, other] = [(); 2].map(|()| World::new(preset.clone(), Some(3)).unwrap());
    let side = 64 * FAR.x;
    let area = Area::new(side, -side, 600, 600);
    let roads = roads_of(&world, &area);
    let part = Area::new(side + 100, -side + 100, 400, 300);
    let inside: Vec<_> = roads.into_iter().filter(|road| road.concerns(&part)).collect();
    assert!(!inside.is_empty());
    assert_eq!(roads_of(&other, &part), inside);
}

#[test]
fn sites_are_the_same_whatever_is_asked() {
    let (settled, other) = (&settled().0, again());
    let all = settled.sites(&wide(), &Clock::default()).unwrap();
    assert!(all.len() > 10, "{} settlements", all.len());
    for part in [Area::new(-300, -500, 500, 400), Area::new(200, -100, 137, 600), Area::new(0, 0, 1, 1)] {
        let inside = |at: [i64; 2]| part.contains(&Area::new(at[0], at[1], 1, 1));
        let expected: Vec<_> = all.iter().filter(|site| inside(site.at)).cloned().collect();
        assert_eq!(other.sites(&part, &Clock::default()).unwrap(), expected);
    }
    for site in &all {
        let land = settled.relief().land(Area::new(site.at[0], site.at[1], 1, 1), &Clock::default()).unwrap();
        assert_eq!(land.water.unwrap().kind.values()[0], WaterKind::Dry, "{} is dry", site.name);
        assert!((land.heights.values()[0] - site.height_m).abs() < 0.01, "{} stands on the land", site.name);
    }
}

#[test]
fn roads_join_settlements_and_keep_to_their_grade() {
    let (world, roads) = settled();
    let settings = world.preset().places.as_ref().unwrap();
    for road in roads {
        let (LineId::Road { from, to, .. }, Some(class)) = (road.id, road.class) else { panic!("{}", road.id) };
        let most = settings.max_grade[class as usize];
        assert!(road.max_grade() <= most, "{} climbs by {}", road.id, road.max_grade());
        for (id, end) in [(from, road.points.first()), (to, road.points.last())] {
            let site = world.site(id, &Clock::default()).unwrap().expect("a road leads to a settlement");
            let end = road.fixed(end.unwrap());
            // Or on a road that has cut it; where that may be outside of the area nothing is known.
            let [x, y] = end.map(|at| at.div_euclid(FIXED));
            let is_known = wide().contains(&Area::new(x, y, 1, 1));
            let is_on = |other: &Line| {
                other.id != road.id
                    && other.pieces().any(|ends| {
                        let [from, to] = ends.map(|point| {
                            let at = other.fixed(point);
                            [0, 1].map(|axis| (at[axis] - end[axis]) as f64)
                        });
                        LineSegment::between(from, to).distance([0.0; 2]) <= 2.0
                    })
            };
            let joins = end == site.at.map(|at| at * FIXED) || roads.iter().any(|other| is_on(other));
            assert!(!is_known || joins, "{} ends nowhere", road.id);
        }
        for pair in road.points.windows(2) {
            let [dx, dy] = [0, 1].map(|axis| pair[1].place[axis] - pair[0].place[axis]);
            let metres = (dx * dx + dy * dy).sqrt() * world.spacing_m();
            assert!((pair[1].level_m - pair[0].level_m).abs() <= most * metres + 1e-9);
        }
    }
}

#[test]
fn roads_are_dry_but_for_bridges_and_fords() {
    let (world, roads) = settled();
    let land = world.relief().fluvial().unwrap();
    let apart = |a: [i64; 2], b: [i64; 2]| ((a[0] - b[0]) as f64).hypot((a[1] - b[1]) as f64);
    let mut crossed = 0;
    for road in roads {
        let rivers = Survey::rivers(land, &road.bounds);
        for ([from, to], carrier) in road.pieces().zip(road.carriers()) {
            let [from, to] = [from, to].map(|point| road.fixed(point));
            for at in [from, to] {
                let [x, y] = at.map(|at| (at + FIXED / 2).div_euclid(FIXED));
                let water = land.waters(x, y, Sampling::whole(1), 1, 1)[0];
                let bridged = carrier == Some(StructureKind::Bridge);
                // A vertex is wet or not, so next to a crossing a road may still be in the river.
                let near = |structure: &Structure| {
                    let ends = [structure.first, structure.last].map(|point| road.fixed(&road.points[point]));
                    apart(at, structure.middle(road)) <= apart(ends[0], ends[1]) / 2.0 + 2.0 * FIXED as f64
                };
                let crosses = road.structures.iter().any(near);
                assert!(water == WaterKind::Dry || crosses, "{:?} runs along a river at {at:?}", road.id);
                assert!(!water.is_open() || bridged, "{:?} runs into {water:?} at {at:?}", road.id);
            }
            let side = |a: [i64; 2], b: [i64; 2], at: [i64; 2]| {
                ((b[0] - a[0]) as i128 * (at[1] - a[1]) as i128 - (b[1] - a[1]) as i128 * (at[0] - a[0]) as i128) >= 0
            };
            for river in &rivers {
                if side(river.from, river.to, from) != side(river.from, river.to, to)
                    && side(from, to, river.from) != side(from, to, river.to)
                {
                    assert!(carrier.is_some(), "{} at {from:?}", road.id);
                    crossed += 1;
                }
            }
        }
    }
    assert!(crossed >= 10, "{crossed} crossings");
}

#[test]
fn roads_leave_waters_as_they_are() {
    let (world, _) = settled();
    let mut wet = 0;
    for at in places_to_look() {
        let tile = Tile::new(world, at);
        let bare = Tile::bare_heights(world, at);
        let water = tile.water().unwrap();
        for (index, kind) in water.kind.values().iter().enumerate() {
            if *kind != WaterKind::Dry {
                wet += 1;
                assert_eq!(tile.heights().values()[index].to_bits(), bare.values()[index].to_bits());
            }
        }
    }
    assert!(wet > 20, "{wet} wet vertices");
}

#[test]
fn sparse_land_is_that_of_the_vertices() {
    // Nodes far apart have no gullies, so neither does this world.
    let (_, mut preset) = Preset::load("alps").unwrap();
    lighten(&mut preset);
    preset.fluvial.as_mut().unwrap().gullies = 0.0;
    let world = &World::new(preset, Some(1)).unwrap();
    let land = world.relief().fluvial().unwrap();
    let area = Area::new(-64, 128, 256, 192);
    let full = world.relief().land(area, &Clock::default()).unwrap();
    let kinds = full.water.unwrap().kind;
    for step in [1, 2, 4, 8] {
        let (cols, rows) = (area.width() / step as usize, area.height() / step as usize);
        let heights_m = land.heights_m(area.x0, area.y0, Sampling::whole(step), cols, rows);
        let waters = land.waters(area.x0, area.y0, Sampling::whole(step), cols, rows);
        let mut other = 0;
        for (index, (height_m, water)) in heights_m.iter().zip(&waters).enumerate() {
            let (x, y) = (area.x0 + (index % cols) as i64 * step, area.y0 + (index / cols) as i64 * step);
            let same = (*water == WaterKind::Dry) == (kinds.at(x, y) == WaterKind::Dry);
            // Rounding may decide which side of a shore a vertex lies on.
            other += usize::from(!same || (height_m - full.heights.at(x, y)).abs() > 0.01);
        }
        assert!(other * 1000 <= heights_m.len(), "{other} of {} nodes differ with {step}", heights_m.len());
    }
}

#[test]
fn places_need_fluvial_relief_and_sound_values() {
    let error = |text: &str| Preset::parse("x.toml", text).unwrap_err().to_string();
    let noise = "[[noise]]\nkind = \"fbm\"\nheight_m = 10\n[places]\n";
    assert!(error(noise).contains("places: nothing reads it in a world of noise"), "{}", error(noise));
    let dense = "[fluvial]\ntrunk_m = 2000\nlevels = 4\n[places]\ndensity = 3\n";
    assert!(error(dense).contains("places.density: expected 0 to 1, found 3"), "{}", error(dense));
}
