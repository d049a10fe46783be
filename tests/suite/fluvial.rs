//! Fluvial relief: rivers in their valleys, unbroken to the sea, and a sea that comes to all that lies under it.

use terrane::area::{Area, TileId};
use terrane::clock::Clock;
use terrane::grain_point::{GRAINS, Point};
use terrane::land::{Land, Water, WaterKind};
use terrane::lines::LineEnd;
use terrane::preset::Preset;
use terrane::world::World;

use crate::worlds::{fluvial, shared};

fn land(world: &World, area: Area) -> Land {
    fluvial(world).land(area, &Clock::default()).unwrap()
}

#[test]
fn the_floor_of_a_wide_valley_ends_where_the_hills_are_as_high() {
    // Here a river whose floor is round over kilometres comes out of the mountains.
    let world = shared("alps", 4);
    let area = Area::new(0, 1700, 300, 400);
    let heights = land(world, area).heights;
    let steepest = fluvial(world).fields().most_laws().hill_slope * world.preset().spacing_m;
    for y in area.y0..area.y1 - 1 {
        for x in area.x0..area.x1 - 1 {
            let step =
                (heights.at(x, y) - heights.at(x + 1, y)).abs().max((heights.at(x, y) - heights.at(x, y + 1)).abs());
            assert!(f64::from(step) < 4.0 * steepest, "{step} m from ({x}, {y}) to the next vertex");
        }
    }
}

#[test]
fn rivers_cut_into_the_lowlands_of_the_coast() {
    let world = shared("archipelago", 5);
    let area = Area::new(0, 0, 700, 700);
    let Land { heights, water } = land(world, area);
    let kinds = water.unwrap().kind;
    let (mut rivers, mut above) = (0, 0);
    for y in area.y0 + 4..area.y1 - 4 {
        for x in area.x0 + 4..area.x1 - 4 {
            if kinds.at(x, y) != WaterKind::River {
                continue;
            }
            rivers += 1;
            let around = (-4..=4).flat_map(|dy| (-4..=4).map(move |dx| (x + dx, y + dy)));
            let banks = around.filter(|&(x, y)| kinds.at(x, y) == WaterKind::Dry);
            let highest = banks.map(|(x, y)| heights.at(x, y)).fold(f32::NEG_INFINITY, f32::max);
            above += u32::from(heights.at(x, y) > highest + 0.5);
        }
    }
    assert!(rivers > 500, "{rivers} vertices of rivers");
    assert!(above * 50 < rivers, "{above} of {rivers} vertices of rivers are higher than both banks");
}

/// The points of rivers of an area that are more than so many vertices wide, each with its vertex.
fn wide(world: &World, area: &Area, vertices: f64) -> Vec<([f64; 2], f64)> {
    let rivers = fluvial(world).rivers(area, &Clock::default()).unwrap();
    let points = rivers.iter().flat_map(|river| {
        river.points.iter().map(|point| (river.place_from([0, 0], point), 2.0 * point.half_width_m / river.spacing_m))
    });
    let inside = |([x, y], wide): &([f64; 2], f64)| {
        *wide > vertices && area.contains(&Area::new(x.round() as i64 - 8, y.round() as i64 - 8, 17, 17))
    };
    points.filter(inside).collect()
}

#[test]
fn dry_brooks_leave_no_land_between_the_banks_of_a_wide_river() {
    let world = shared("plains", 4);
    let widest = wide(world, &Area::new(0, 0, 3000, 3000), 5.0);
    let ([x, y], _) = widest.into_iter().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
    let area = Area::new(x as i64 - 175, y as i64 - 175, 350, 350);
    let kinds = land(world, area).water.unwrap().kind;
    let (mut rivers, mut spurs) = (0, 0);
    for y in area.y0 + 2..area.y1 - 2 {
        for x in area.x0 + 2..area.x1 - 2 {
            let is_river = |dx: i64, dy: i64| kinds.at(x + dx, y + dy) == WaterKind::River;
            rivers += u32::from(is_river(0, 0));
            let between = is_river(-2, 0) && is_river(2, 0) || is_river(0, -2) && is_river(0, 2);
            spurs += u32::from(kinds.at(x, y) == WaterKind::Dry && between);
        }
    }
    assert!(rivers > 5000, "{rivers} vertices of rivers");
    assert!(spurs * 300 < rivers, "{spurs} vertices of land between {rivers} of rivers");
}

#[test]
fn the_beds_of_rivers_are_unbroken() {
    // Where bends, and where the plane is drawn out, once left vertices of the bed undug; and mouths in the sea.
    let places = [
        ("plains", 3, Area::new(80, 60, 500, 300)),
        ("plains", 3, Area::new(980, 210, 300, 300)),
        ("archipelago", 1, Area::new(0, 0, 400, 400)),
        ("archipelago", 2, Area::new(0, 0, 400, 400)),
        ("fjords", 7, Area::new(-90, 170, 300, 600)),
    ];
    for (name, seed, area) in places {
        let Land { heights, water } = land(shared(name, seed), area);
        let Water { kind: kinds, depth_m, .. } = water.unwrap();
        let mut rivers = 0;
        for y in area.y0 + 1..area.y1 - 1 {
            for x in area.x0 + 1..area.x1 - 1 {
                let (is_wet, deep_m) = (kinds.at(x, y) != WaterKind::Dry, depth_m.at(x, y));
                assert_eq!(is_wet, deep_m > 0.0, "{name}, seed {seed}: {deep_m} m deep at {x}, {y}");
                if kinds.at(x, y) != WaterKind::River {
                    continue;
                }
                rivers += 1;
                let around = (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (x + dx, y + dy)));
                let lowest = around.map(|(x, y)| heights.at(x, y)).fold(f32::INFINITY, f32::min);
                assert!(lowest < heights.at(x, y), "{name}, seed {seed}: a pit in the river at {x}, {y}");
            }
        }
        assert!(rivers > 20, "{name}, seed {seed}: {rivers} vertices of rivers in {area:?}");
    }
}

#[test]
fn the_bed_of_a_wide_river_falls_to_its_middle() {
    let world = shared("plains", 3);
    let area = Area::new(0, 1500, 1200, 500);
    let wide = wide(world, &area, 6.0);
    let heights = land(world, area).heights;
    let height_m = |place: [f64; 2]| heights.at(place[0].round() as i64, place[1].round() as i64);
    let (mut middles, mut seen) = (0, 0);
    for pair in wide.windows(2) {
        let ((from, width), (to, _)) = (pair[0], pair[1]);
        let way = [to[0] - from[0], to[1] - from[1]];
        let long = way[0].hypot(way[1]);
        if long > 4.0 {
            continue;
        }
        // Across the river, half a vertex at a time, from bank to bank.
        let reach = width as i32;
        let across = |step: i32| {
            let by = step as f64 / 2.0 / long;
            height_m([from[0] - way[1] * by, from[1] + way[0] * by])
        };
        let lowest = (-reach..=reach).min_by(|a, b| across(*a).total_cmp(&across(*b))).unwrap();
        seen += 1;
        middles += u32::from(lowest.abs() <= 3);
    }
    assert!(seen > 50, "{seen} places of wide rivers");
    // Where another river comes in, that may be lowest.
    assert!(middles * 10 > seen * 9, "at {middles} of {seen} places the middle is lowest");
}

#[test]
fn no_step_dams_a_river_that_comes_to_a_lake() {
    // A lake was once half a metre deep where a river came to it that was three.
    let (_, mut preset) = Preset::load("alps").unwrap();
    // What is looked for lies in the world of the seed alone, on rock that is the same everywhere.
    preset.country = None;
    preset.fluvial.as_mut().unwrap().rock = None;
    let world = World::new(preset, Some(1729)).unwrap();
    let area = TileId { x: -2015, y: 10 }.area(world.tile_cells());
    let land = land(&world, area);
    let kind = |x: i64, y: i64| land.water.as_ref().unwrap().kind.at(x, y);
    let inner = Area::new(area.x0 + 1, area.y0 + 1, area.width() - 2, area.height() - 2);
    let mut mouths = 0;
    for (x, y) in inner.vertices().filter(|(x, y)| kind(*x, *y) == WaterKind::River) {
        let around = Area::new(x - 1, y - 1, 3, 3).vertices().filter(|(x, y)| kind(*x, *y) == WaterKind::Lake);
        if let Some(lowest_m) = around.map(|(x, y)| land.heights.at(x, y)).reduce(f32::min) {
            mouths += 1;
            assert!(lowest_m < land.heights.at(x, y) + 1.0, "a step of {} m", lowest_m - land.heights.at(x, y));
        }
    }
    assert!(mouths > 0);
}

#[test]
fn rivers_that_end_in_the_sea_reach_it() {
    for seed in [1, 2] {
        let world = shared("archipelago", seed);
        let area = Area::new(0, 0, 1024, 1024);
        let kinds = land(world, area).water.unwrap().kind;
        let mut mouths = 0;
        for river in
            fluvial(world).rivers(&area, &Clock::default()).unwrap().iter().filter(|river| river.end == LineEnd::Sea)
        {
            let [x, y] = river.fixed(river.points.last().unwrap());
            let end = Point { x, y };
            let [column, row] = [end.x, end.y].map(|grains| grains.div_euclid(GRAINS));
            if !(area.x0 < column && column + 2 < area.x1 && area.y0 < row && row + 2 < area.y1) {
                continue;
            }
            mouths += 1;
            let around = (0..=1).flat_map(|dy| (0..=1).map(move |dx| (column + dx, row + dy)));
            let reached = around
                .filter(|(x, y)| Point::at_vertex(*x, *y).distance(end) <= GRAINS as f64)
                .any(|(x, y)| kinds.at(x, y) == WaterKind::Sea);
            assert!(reached, "seed {seed}: {} ends beside the sea", river.id);
        }
        assert!(mouths > 8, "seed {seed}: {mouths} rivers end in the sea");
    }
}

/// A sea that has risen has drowned the valleys, and ground under it is sea wherever the tiles have it.
#[test]
fn all_ground_under_the_sea_is_sea() {
    let world = shared("archipelago", 2);
    let Land { heights, water } = land(world, Area::new(0, 0, 512, 512));
    let (kinds, mut drowned) = (water.unwrap().kind, 0);
    for (height_m, kind) in heights.values().iter().zip(kinds.values()) {
        match kind {
            WaterKind::Sea => drowned += u32::from((-30.0..0.0).contains(height_m)),
            WaterKind::Dry => assert!(*height_m >= 0.0, "dry land at {height_m} m"),
            // What is deeper than the sea is a bed, whose water is higher.
            _ => {}
        }
    }
    assert!(drowned > 5000, "{drowned} vertices between the lowstand and the sea's level");
}

/// Where the coast clips the land it has no hollows: the sea comes to all that lies under it, but for single vertices.
#[test]
fn hardly_any_sea_is_cut_off_inland() {
    for seed in [1, 3] {
        let area = Area::new(0, 0, 1200, 1200);
        let kinds = land(shared("archipelago", seed), area).water.unwrap().kind;
        let is_sea = |(x, y): (i64, i64)| kinds.at(x, y) == WaterKind::Sea;
        let mut open = terrane::grid::Grid::filled(area, false);
        let at_edge = |(x, y): (i64, i64)| x == area.x0 || x + 1 == area.x1 || y == area.y0 || y + 1 == area.y1;
        let mut left: Vec<(i64, i64)> = area.vertices().filter(|place| at_edge(*place) && is_sea(*place)).collect();
        while let Some((x, y)) = left.pop() {
            if open.at(x, y) {
                continue;
            }
            open.row_mut(y, x, x + 1)[0] = true;
            let around = (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (x + dx, y + dy)));
            left.extend(around.filter(|&(x, y)| area.contains(&Area::new(x, y, 1, 1)) && is_sea((x, y))));
        }
        let sea = area.vertices().filter(|place| is_sea(*place)).count();
        let closed = area.vertices().filter(|&(x, y)| is_sea((x, y)) && !open.at(x, y)).count();
        assert!(sea > 100_000, "seed {seed}: {sea} vertices of sea");
        assert!(closed <= 8, "seed {seed}: {closed} vertices of sea cut off inland");
    }
}
