//! Fluvial land of the built-in presets: the same whatever is asked for, drained, and bent without a fold.
//!
//! The suite looks at some presets, in its long form at the others.

use terrane::area::Area;
use terrane::clock::Clock;
use terrane::grain_point::Point;
use terrane::land::{Land, WaterKind};
use terrane::preset::Preset;
use terrane::world::World;

use crate::worlds::{fluvial, fluvial_names, is_tried, lighten, shared};

fn land(world: &World, area: Area) -> Land {
    fluvial(world).land(area, &Clock::default()).unwrap()
}

fn names() -> impl Iterator<Item = &'static str> {
    fluvial_names().filter(|name| is_tried(name))
}

#[test]
fn an_area_is_what_it_is_in_any_other_area_near_and_far() {
    // Far out one world is as good as another.
    let far = 256 * 100_000_000;
    let places = fluvial_names().map(|name| (name, -300, 77)).chain([("archipelago", far, -far)]);
    for (name, x, y) in places.filter(|(name, ..)| is_tried(name)) {
        let (_, mut preset) = Preset::load(name).unwrap();
        lighten(&mut preset);
        // Two worlds, so that nothing is remembered; parts that share no border with patches or blocks.
        let [world, other] = [(); 2].map(|()| World::new(preset.clone(), Some(1)).unwrap());
        let whole = land(&world, Area::new(x, y, 190, 130));
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

#[test]
fn nearly_every_vertex_of_dry_land_has_a_lower_neighbour() {
    for name in names() {
        let area = Area::new(200, 300, 640, 640);
        let Land { heights, water } = land(shared(name, 1), area);
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
        assert!(share < 2e-5, "{name}: {pits} of {dry} vertices have no lower neighbour");
    }
}

#[test]
fn the_warp_bends_the_plane_and_does_not_fold_it() {
    for name in names() {
        let fluvial = fluvial(shared(name, 5));
        // Neighbouring points of the network keep their order in the world, east and south.
        let step = 2;
        let row =
            |y: i64| -> Vec<Point> { (0..200).map(|x| fluvial.in_world(Point::at_vertex(x * step, y))).collect() };
        let (mut above, mut turned) = (row(-step), 0);
        for y in 0..200 {
            let here = row(y * step);
            for x in 1..200 {
                turned += u32::from(here[x].from(here[x - 1]).perp_dot(here[x].from(above[x])) <= 0.0);
            }
            above = here;
        }
        assert_eq!(turned, 0, "{name}: the plane is folded");
    }
}
