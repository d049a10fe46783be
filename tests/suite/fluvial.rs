//! Fluvial relief: the same land whatever is asked for, drained, and within its range.

use std::collections::BTreeMap;
use std::sync::Arc;

use terrane::area::Area;
use terrane::clock::Clock;
use terrane::fluvial::channel::{Channel, ChannelId, Mouth};
use terrane::fluvial::point::{GRAINS, Point};
use terrane::fluvial::Fluvial;
use terrane::land::{Land, WaterKind};
use terrane::lines::LineEnd;
use terrane::preset::{BUILT_IN, Preset};
use terrane::world::World;

fn worlds(seed: u64) -> impl Iterator<Item = (&'static str, World)> {
    BUILT_IN.iter().filter_map(move |(name, text)| {
        let preset = Preset::parse(name, text).unwrap();
        preset.fluvial.is_some().then(|| (*name, World::new(preset, Some(seed)).unwrap()))
    })
}

fn fluvial(world: &World) -> &Fluvial {
    world.relief().fluvial().expect("a world of fluvial relief")
}

fn land(world: &World, area: Area) -> Land {
    fluvial(world).land(area, &Clock::default())
}

#[test]
fn an_area_is_what_it_is_in_any_other_area_near_and_far() {
    let far = 256 * 100_000_000;
    for (name, world) in worlds(3) {
        for (x, y) in [(-300, 77), (far, -far)] {
            let whole = land(&world, Area::new(x, y, 190, 130));
            // A world of its own, so that nothing is remembered; parts that share no border with patches or blocks.
            let other = World::new(world.preset().clone(), Some(3)).unwrap();
            for part in [Area::new(x + 61, y + 3, 1, 1), Area::new(x + 17, y + 29, 101, 67), Area::new(x, y, 33, 130)] {
                let alone = land(&other, part);
                let (water, whole_water) = (alone.water.unwrap(), whole.water.as_ref().unwrap());
                for y in part.y0..part.y1 {
                    let of = |grid: &terrane::grid::Grid<f32>| -> Vec<u32> {
                        grid.row(y, part.x0, part.x1).iter().map(|value| value.to_bits()).collect()
                    };
                    assert_eq!(of(&alone.heights), of(&whole.heights), "{name}: heights of row {y} of {part:?}");
                    assert_eq!(of(&water.depth_m), of(&whole_water.depth_m), "{name}: depths of row {y}");
                    assert_eq!(of(&water.flow_m3s), of(&whole_water.flow_m3s), "{name}: flow of row {y}");
                    let kinds = |grid: &terrane::grid::Grid<WaterKind>| grid.row(y, part.x0, part.x1).to_vec();
                    assert_eq!(kinds(&water.kind), kinds(&whole_water.kind), "{name}: water of row {y}");
                }
            }
        }
    }
}

#[test]
fn nearly_every_vertex_of_dry_land_has_a_lower_neighbour() {
    for seed in 1..=3 {
        for (name, world) in worlds(seed) {
            let side = 640;
            let area = Area::new(1000 * seed as i64, -500, side, side);
            let Land { heights, water } = land(&world, area);
            let kinds = water.unwrap().kind;
            let (mut dry, mut pits) = (0, 0);
            for y in area.y0 + 1..area.y1 - 1 {
                for x in area.x0 + 1..area.x1 - 1 {
                    if kinds.at(x, y) >= WaterKind::Lake {
                        continue;
                    }
                    dry += 1;
                    let here = heights.at(x, y);
                    let around = (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (dx, dy)));
                    pits += u32::from(!around.into_iter().any(|(dx, dy)| heights.at(x + dx, y + dy) < here));
                }
            }
            let share = f64::from(pits) / f64::from(dry.max(1));
            // The limit holds over large areas; in one as small as this there is room for chance.
            assert!(share < 2e-4, "{name}, seed {seed}: {pits} of {dry} vertices have no lower neighbour");
        }
    }
}

#[test]
fn heights_stay_within_a_range_that_they_use() {
    for (name, world) in worlds(2) {
        let (min_m, max_m) = world.height_range_m();
        let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
        for place in 0..100 {
            let area = Area::new(place % 10 * 2003, place / 10 * 2003, 16, 16);
            for &height in land(&world, area).heights.values() {
                assert!(min_m <= height && height <= max_m, "{name}: {height} m is outside {min_m}..{max_m} m");
                (low, high) = (low.min(height), high.max(height));
            }
        }
        assert!(high - low > 0.2 * (max_m - min_m), "{name} uses {low}..{high} m of {min_m}..{max_m} m");
    }
}

fn world(name: &str, seed: u64) -> World {
    worlds(seed).find(|(other, _)| *other == name).expect("a preset of that name").1
}

#[test]
fn the_floor_of_a_wide_valley_ends_where_the_hills_are_as_high() {
    // Here a river whose floor is round over kilometres comes out of the mountains.
    let world = world("alps", 4);
    let area = Area::new(0, 1700, 300, 400);
    let heights = land(&world, area).heights;
    let steepest = fluvial(&world).fields().hill_slope(1.0) * world.preset().spacing_m;
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
    let world = world("archipelago", 5);
    let area = Area::new(440, 580, 260, 240);
    let Land { heights, water } = land(&world, area);
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

#[test]
fn dry_brooks_leave_no_land_between_the_banks_of_a_wide_river() {
    let area = Area::new(1736, 2198, 350, 350);
    let kinds = land(&world("plains", 4), area).water.unwrap().kind;
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
fn lakes_lie_along_their_main_river() {
    let mut others = 0;
    for (name, world) in worlds(4) {
        let fluvial = fluvial(&world);
        for channel in channels(&world, 6000).values() {
            let Some((node, is_main)) = channel.next.filter(|(node, _)| fluvial.has_lake(*node)) else { continue };
            let lower = &channel.knots[channel.knots.len() / 2..];
            let wide = lower.iter().filter(|knot| knot.lake > 0.0).count();
            assert_eq!(is_main, wide > 2, "{name}: {wide} knots of a trunk to {node:?} are lakes");
            others += u32::from(!is_main);
        }
    }
    assert!(others > 3, "{others} rivers come to lakes from the side");
}

/// All channels whose bounds touch a square at the origin of some vertices a side.
fn channels(world: &World, side: i64) -> BTreeMap<(u32, i64, i64), Arc<Channel>> {
    let mut all = BTreeMap::new();
    let network = fluvial(world).network();
    for level in 0..fluvial(world).fields().levels() {
        network.channels(level, [Point::at_vertex(0, 0), Point::at_vertex(side, side)], |channel| {
            all.insert(channel.id, Arc::clone(channel));
        });
    }
    all
}

#[test]
fn channels_fall_grow_and_end_in_what_they_name() {
    for seed in 1..=3 {
        for (name, world) in worlds(seed) {
            let all = channels(&world, 1500);
            assert!(all.len() > 100, "{name} has {} channels", all.len());
            for channel in all.values() {
                let id = channel.id;
                for pair in channel.knots.windows(2) {
                    let flat = pair[0].lake > 0.0 || pair[1].lake > 0.0;
                    assert!(flat || pair[0].level_m > pair[1].level_m, "{name}, seed {seed}: {id:?} does not fall");
                    assert!(pair[0].area <= pair[1].area, "{name}, seed {seed}: {id:?} shrinks");
                }
                let end = channel.knots[channel.knots.len() - 1];
                assert!(channel.mouth_area >= end.area, "{name}, seed {seed}: {id:?} joins what is smaller");
                let Mouth::Channel(other) = channel.mouth else { continue };
                let Some(other) = all.get(&other) else { continue };
                let on_line = |pair: &[terrane::fluvial::channel::Knot]| {
                    let (way, off) = (pair[1].at.from(pair[0].at), end.at.from(pair[0].at));
                    let square = way[0] * way[0] + way[1] * way[1];
                    let t = ((off[0] * way[0] + off[1] * way[1]) / square).clamp(0.0, 1.0);
                    let gap = [off[0] - way[0] * t, off[1] - way[1] * t];
                    gap[0] * gap[0] + gap[1] * gap[1] < 4.0
                };
                assert!(other.knots.windows(2).any(on_line), "{name}, seed {seed}: {id:?} ends beside {:?}", other.id);
            }
        }
    }
}

/// The pairs of channels that cross.
fn crossings<'a>(channels: impl Iterator<Item = &'a Arc<Channel>>) -> Vec<(ChannelId, ChannelId)> {
    let pieces: Vec<_> = channels
        .flat_map(|channel| channel.knots.windows(2).map(move |pair| (channel.id, pair[0].at, pair[1].at)))
        .collect();
    let mut crossings = Vec::new();
    for (index, (id, a, b)) in pieces.iter().enumerate() {
        for (other, c, d) in &pieces[index + 1..] {
            let apart = |u: fn(&Point) -> i64| u(a).max(u(b)) < u(c).min(u(d)) || u(c).max(u(d)) < u(a).min(u(b));
            if id == other || apart(|p| p.x) || apart(|p| p.y) {
                continue;
            }
            let side = |p: &Point, q: &Point, r: &Point| {
                let ([ux, uy], [vx, vy]) = (q.from(*p), r.from(*p));
                ux * vy - uy * vx
            };
            // A foot lies on its piece but for a grain, so a crossing is one by more than that.
            let grain = |p: &Point, q: &Point| 2.0 * p.distance(*q);
            let apart = |p: f64, q: f64, least: f64| (p > least && q < -least) || (p < -least && q > least);
            if apart(side(a, b, c), side(a, b, d), grain(a, b)) && apart(side(c, d, a), side(c, d, b), grain(c, d)) {
                crossings.push((*id, *other));
            }
        }
    }
    crossings
}

#[test]
fn channels_do_not_cross() {
    for seed in 1..=3 {
        for (name, world) in worlds(seed) {
            let all = channels(&world, 1500);
            let crossings = crossings(all.values());
            assert!(crossings.is_empty(), "{name}, seed {seed}: of {} channels cross {crossings:?}", all.len());
        }
    }
}

#[test]
fn trunks_that_come_and_go_close_together_do_not_cross() {
    // Here one comes to a lake from where the lake's own outlet goes.
    let all = channels(&world("highlands", 4), 3000);
    let crossings = crossings(all.values().filter(|channel| channel.id.0 == 0));
    assert!(crossings.is_empty(), "trunks cross: {crossings:?}");
}

#[test]
fn the_beds_of_rivers_are_unbroken() {
    // Where bends, and where the plane is drawn out, once left vertices of the bed undug; and mouths in the sea.
    let places = [
        ("plains", 3, Area::new(80, 60, 60, 30)),
        ("plains", 3, Area::new(580, 640, 100, 40)),
        ("plains", 3, Area::new(1100, 210, 80, 60)),
        ("archipelago", 1, Area::new(470, 1900, 60, 60)),
        ("archipelago", 1, Area::new(290, 470, 60, 60)),
    ];
    for (name, seed, area) in places {
        let (_, preset) = Preset::load(name).unwrap();
        let Land { heights, water } = land(&World::new(preset, Some(seed)).unwrap(), area);
        let kinds = water.unwrap().kind;
        let mut rivers = 0;
        for y in area.y0 + 1..area.y1 - 1 {
            for x in area.x0 + 1..area.x1 - 1 {
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
    let (_, preset) = Preset::load("plains").unwrap();
    let area = Area::new(700, 1780, 40, 32);
    let Land { heights, water } = land(&World::new(preset, Some(3)).unwrap(), area);
    let kinds = water.unwrap().kind;
    for x in area.x0..area.x1 {
        // It runs to the west.
        let across: Vec<i64> = (area.y0..area.y1).filter(|y| kinds.at(x, *y) == WaterKind::River).collect();
        let lowest = across.iter().min_by(|a, b| heights.at(x, **a).total_cmp(&heights.at(x, **b))).unwrap();
        let middle = i64::midpoint(across[0], across[across.len() - 1]);
        assert!((lowest - middle).abs() <= 2, "at {x} it is lowest at {lowest}, and {across:?} are in the river");
    }
}

#[test]
fn rivers_that_end_in_the_sea_reach_it() {
    for (seed, x, y) in [(1, 501, 618), (1, 528, 1888), (2, 1052, 57), (2, 1260, 71)] {
        let (_, preset) = Preset::load("archipelago").unwrap();
        let world = World::new(preset, Some(seed)).unwrap();
        let area = Area::new(x - 20, y - 20, 41, 41);
        let kinds = land(&world, area).water.unwrap().kind;
        let mut mouths = 0;
        for river in fluvial(&world).rivers(&area).iter().filter(|river| river.end == LineEnd::Sea) {
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
        assert!(mouths > 0, "seed {seed}: no river ends in the sea near {x}, {y}");
    }
}

#[test]
fn channels_keep_away_from_what_they_run_to_until_they_end() {
    for seed in 1..=3 {
        for (name, world) in worlds(seed) {
            let all = channels(&world, 1500);
            for channel in all.values().filter(|channel| channel.id.0 > 0) {
                let Mouth::Channel(other) = channel.mouth else { continue };
                let Some(other) = all.get(&other) else { continue };
                let (end, above) = channel.knots.split_last().unwrap();
                for knot in above {
                    let off = other.knots.windows(2).map(|pair| {
                        let (way, off) = (pair[1].at.from(pair[0].at), knot.at.from(pair[0].at));
                        let square = (way[0] * way[0] + way[1] * way[1]).max(1.0);
                        let t = ((off[0] * way[0] + off[1] * way[1]) / square).clamp(0.0, 1.0);
                        (off[0] - way[0] * t).hypot(off[1] - way[1] * t)
                    });
                    let (off, left) = (off.fold(f64::INFINITY, f64::min), knot.at.distance(end.at));
                    assert!(
                        off > 0.05 * left,
                        "{name}, seed {seed}: {:?} lies {off:.1} grains beside {:?}, {left:.0} above its mouth",
                        channel.id,
                        other.id,
                    );
                }
            }
        }
    }
}

#[test]
fn the_warp_bends_the_plane_and_does_not_fold_it() {
    for (name, world) in worlds(5) {
        let fluvial = fluvial(&world);
        // Neighbouring points of the network keep their order in the world, east and south.
        let step = 2;
        let row =
            |y: i64| -> Vec<Point> { (0..200).map(|x| fluvial.in_world(Point::at_vertex(x * step, y))).collect() };
        let (mut above, mut turned) = (row(-step), 0);
        for y in 0..200 {
            let here = row(y * step);
            for x in 1..200 {
                let ([ux, uy], [vx, vy]) = (here[x].from(here[x - 1]), here[x].from(above[x]));
                turned += u32::from(ux * vy - uy * vx <= 0.0);
            }
            above = here;
        }
        assert_eq!(turned, 0, "{name}: the plane is folded");
    }
}
