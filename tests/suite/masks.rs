//! Masks, what grows, and splines: the same in every window, true to the land, and in their right place.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::sync::{Arc, LazyLock};

use terrane::area::{Area, Region, TileId};
use terrane::clock::Clock;
use terrane::export::{Export, Manifest, Mode, Output, Plan};
use terrane::land::WaterKind;
use terrane::lines::{Line, LineKind, StructureKind};
use terrane::mesh::default_origin;
use terrane::preset::Preset;
use terrane::tile::{A_HECTARE, Grows, Growth, Instance, Tile, TileView, instances, least_distance_m};
use terrane::watch::Watch;
use terrane::world::World;

use crate::bakes::settled;

/// The thesis' world of noise, with small tiles: its rivers and roads are those of agents.
fn noise() -> &'static World {
    static WORLD: LazyLock<World> = LazyLock::new(|| {
        let (_, mut preset) = Preset::load("thesis").unwrap();
        preset.tile_cells = 64;
        // What these masks must show lies in the world of the seed alone.
        preset.country = None;
        World::new(preset, Some(5)).unwrap()
    });
    &WORLD
}

fn worlds() -> [(&'static str, &'static World); 2] {
    [("settled", settled()), ("thesis", noise())]
}

const FAR: TileId = TileId { x: 1_000_000_000, y: -1_000_000_000 };

fn bake(
    world: &World,
    at: (i64, i64),
    (cols, rows): (u64, u64),
    exports: &str,
    threads: usize,
    out: &Path,
) -> Manifest {
    let region = Region::new(TileId { x: at.0, y: at.1 }, cols, rows, world.tile_cells()).unwrap();
    let plan = Plan::new(world, "test", region, Export::parse_list(exports).unwrap()).unwrap();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let cost = plan.cost(threads);
    let output = Output::prepare(out, Mode::New, &plan, &cost).unwrap();
    let manifest = pool.install(|| plan.run(&output, &Watch::default())).unwrap();
    assert_eq!(manifest.files.len() as u64 + 1, cost.files);
    manifest
}

/// All that masks show of a vertex, as bits.
fn look(world: &World, grows: &Grows, tile: &Tile, x: i64, y: i64) -> Vec<u32> {
    let view = TileView::new(tile, world);
    let mut values = vec![tile.slope_degrees(x, y), view.accumulation_m2().at(x, y), view.wetness(x, y)];
    values.extend([view.steepness(x, y), tile.aspect_degrees(x, y).unwrap_or(-1.0)]);
    values.extend(tile.curvatures(y, x, x + 1));
    values.extend(grows.densities(tile).at(x, y));
    values.into_iter().map(f32::to_bits).collect()
}

#[test]
fn neighbours_agree_on_the_masks_of_their_shared_vertices() {
    for (name, world) in worlds() {
        let grows = Grows::new(world);
        for at in [TileId { x: -1, y: -1 }, FAR] {
            let tile = |x: i64, y: i64| Tile::new(world, TileId { x: at.x + x, y: at.y + y });
            let (here, east, south) = (tile(0, 0), tile(1, 0), tile(0, 1));
            let Area { x0, y0, x1, y1 } = here.area();
            for step in 0..y1 - y0 {
                for (other, x, y) in [(&east, x1 - 1, y0 + step), (&south, x0 + step, y1 - 1)] {
                    let both = [&here, other].map(|tile| look(world, &grows, tile, x, y));
                    assert_eq!(both[0], both[1], "{name}: ({x}, {y}) of tiles {} and {}", here.id(), other.id());
                }
            }
        }
    }
}

#[test]
fn masks_are_the_same_bytes_in_every_window() {
    let exports =
        "slope-tiles,aspect-tiles,steepness-tiles,curvature-tiles,accumulation-tiles,wetness-tiles,scatter-tiles";
    let folder = tempfile::tempdir().unwrap();
    for (name, world) in worlds() {
        let files = |out: &str, at, size, threads| {
            let out = folder.path().join(format!("{name}-{out}"));
            let manifest = bake(world, at, size, exports, threads, &out);
            let kind = |path: &str| path.split("_x").next().unwrap().to_owned();
            let read = |file: &terrane::bake::FileRecord| {
                ((file.tile.unwrap(), kind(&file.path)), fs::read(out.join(&file.path)).unwrap())
            };
            manifest.files.iter().filter(|file| file.tile.is_some()).map(read).collect::<BTreeMap<_, _>>()
        };
        let (one, other) = (files("one", (-2, -1), (3, 2), 1), files("other", (-1, -1), (2, 3), 3));
        let shared: Vec<_> = one.iter().filter(|(key, _)| other.contains_key(*key)).collect();
        // Four tiles, of each six masks and four densities.
        assert_eq!(shared.len(), 4 * 10, "{name}");
        assert!(shared.iter().all(|(key, bytes)| other[*key] == **bytes), "{name}");
    }
}

#[test]
fn masks_are_within_their_ranges_and_show_the_land() {
    for (name, world) in worlds() {
        let tile = Tile::new(world, TileId { x: 0, y: 0 });
        let (area, view) = (tile.area(), TileView::new(&tile, world));
        let cell_m2 = (world.spacing_m() * world.spacing_m()) as f32;
        let (mut steep, mut sum) = (0.0_f32, 0.0);
        for (x, y) in area.vertices() {
            let (slope, wetness) = (tile.slope_degrees(x, y), view.wetness(x, y));
            let drained_m2 = view.accumulation_m2().at(x, y);
            assert!((0.0..90.0).contains(&slope) && wetness.is_finite(), "{name}: {slope} {wetness}");
            match view.lake_or_sea(x, y) {
                WaterKind::Sea => assert_eq!((drained_m2, wetness), (0.0, 20.0), "{name}"),
                _ => assert!(drained_m2 >= cell_m2 && drained_m2.is_finite(), "{name}: {drained_m2}"),
            }
            steep = steep.max(slope);
            // The thesis' factor: by its scale what the cosine of the slope is less than 1.
            let factor = (world.preset().ground.slope_scale as f32 * (1.0 - slope.to_radians().cos())).min(1.0);
            assert!((view.steepness(x, y) - factor).abs() < 1e-4, "{name}: {slope} degrees");
            // A step in the direction of the aspect goes down the plane of the normal.
            let [east, up, south] = tile.normals().at(x, y);
            match tile.aspect_degrees(x, y) {
                Some(aspect) => {
                    assert!((0.0..360.0).contains(&aspect), "{name}: {aspect}");
                    let (sin, cos) = aspect.to_radians().sin_cos();
                    let rise = -(east * sin - south * cos) / up;
                    assert!((rise + slope.to_radians().tan()).abs() < 1e-3, "{name}: {aspect} degrees at {x}, {y}");
                }
                None => assert_eq!(slope, 0.0, "{name}"),
            }
            sum += f64::from(tile.curvatures(y, x, x + 1)[0]);
        }
        assert!(steep > 5.0, "{name}: nowhere steeper than {steep}");
        // Hollows and ridges are about as many.
        assert!((sum / area.len() as f64 * world.spacing_m()).abs() < 0.05, "{name}: {sum}");
    }
}

/// The rivers of a world of which a part lies in the tile.
fn rivers(world: &World, tile: &Tile) -> Vec<Arc<Line>> {
    world.lines_through(LineKind::River, &tile.area(), &Clock::default()).unwrap()
}

#[test]
fn accumulation_grows_downstream_and_rivers_are_its_lines() {
    let world = settled();
    let (mut steps, mut falls) = (0, 0);
    let [mut wet, mut dry] = [Vec::new(), Vec::new()];
    for (x, y) in [(-1, -1), (0, -1), (-1, 0), (0, 0)] {
        let tile = Tile::new(world, TileId { x, y });
        let (area, drained_m2) = (tile.area(), TileView::new(&tile, world).accumulation_m2());
        let kinds = &tile.water().unwrap().kind;
        for (x, y) in area.vertices() {
            match kinds.at(x, y) {
                WaterKind::River => wet.push(drained_m2.at(x, y)),
                WaterKind::Dry => dry.push(drained_m2.at(x, y)),
                WaterKind::Lake | WaterKind::Sea => {}
            }
        }
        for river in rivers(world, &tile) {
            let places = river.points.iter().map(|point| {
                let [x, y] = river.place_from([0, 0], point).map(|at| at.round() as i64);
                let inside = area.contains(&Area::new(x, y, 1, 1)) && kinds.at(x, y) == WaterKind::River;
                inside.then(|| drained_m2.at(x, y))
            });
            for pair in places.collect::<Vec<_>>().windows(2) {
                let (Some(above), Some(below)) = (pair[0], pair[1]) else { continue };
                steps += 1;
                // A side may have a little more than the middle.
                falls += usize::from(below < 0.98 * above);
            }
        }
    }
    assert!(steps > 20 && falls * 20 <= steps, "{falls} of {steps} steps downstream lose water");
    let middle = |values: &mut Vec<f32>| {
        values.sort_by(f32::total_cmp);
        values[values.len() / 2]
    };
    let [wet, dry] = [middle(&mut wet), middle(&mut dry)];
    assert!(wet > 30.0 * dry, "{wet} m2 at rivers, {dry} beside them");
}

#[test]
fn agents_rivers_gather_water_too() {
    let world = noise();
    let [mut beds, mut all] = [Vec::new(), Vec::new()];
    for (x, y) in Area::new(-3, -3, 6, 6).vertices() {
        let tile = Tile::new(world, TileId { x, y });
        let area = tile.area();
        all.extend(TileView::new(&tile, world).accumulation_m2().part(area).values());
        for river in rivers(world, &tile) {
            // Not at its very start.
            for point in river.points.iter().skip(20) {
                let [x, y] = river.place_from([0, 0], point).map(|at| at.round() as i64);
                if area.contains(&Area::new(x, y, 1, 1)) {
                    beds.push(TileView::new(&tile, world).accumulation_m2().at(x, y));
                }
            }
        }
    }
    let mean = |values: &[f32]| values.iter().sum::<f32>() / values.len() as f32;
    assert!(beds.len() > 100, "{} points of rivers", beds.len());
    assert!(mean(&beds) > 2.0 * mean(&all), "{} m2 in beds, {} anywhere", mean(&beds), mean(&all));
}

#[test]
fn nothing_grows_in_water_on_roads_or_where_there_is_snow_alone() {
    let world = settled();
    let grows = Grows::new(world);
    let (mut wet, mut grown) = (0, [0.0_f64; 4]);
    for (x, y) in [(-1, -1), (0, -1), (-1, 0), (0, 0), (-3, 2)] {
        let tile = Tile::new(world, TileId { x, y });
        for (x, y) in tile.area().vertices() {
            let densities = grows.densities(&tile).at(x, y);
            assert!(densities.iter().all(|density| (0.0..=1.0).contains(density)));
            let is_road = tile.imprint().is_some_and(|imprint| imprint.dirt().any(|dirt| dirt.at(x, y) > 0.5));
            if TileView::new(&tile, world).lake_or_sea(x, y) != WaterKind::Dry || is_road {
                assert_eq!(densities, [0.0; 4]);
                wet += 1;
            }
            for (sum, density) in grown.iter_mut().zip(densities) {
                *sum += f64::from(density);
            }
        }
    }
    assert!(
        wet > 500 && grown[Growth::Tree as usize] > 100.0 && grown[Growth::Grass as usize] > 100.0,
        "{wet} {grown:?}"
    );
}

/// Instances in metres east and south of the world's origin.
fn placed(tile: &Tile, instances: &[Instance]) -> Vec<[f64; 2]> {
    let Area { x0, y0, .. } = tile.area();
    let metres = |at: i64, off: f64| (at as f64 + off) * tile.spacing_m();
    instances.iter().map(|it| [metres(x0, it.place[0]), metres(y0, it.place[1])]).collect()
}

#[test]
fn instances_keep_their_distance_across_seams_and_stay_out_of_water() {
    for (name, world) in worlds() {
        let grows = Grows::new(world);
        let mut all: Vec<[f64; 2]> = Vec::new();
        let mut kinds = [0; 4];
        for (x, y) in [(-1, -1), (0, -1), (-1, 0), (0, 0)] {
            let tile = Tile::new(world, TileId { x, y });
            let view = TileView::new(&tile, world);
            let found = instances(world, &grows, &tile);
            assert_eq!(found, instances(world, &Grows::new(world), &Tile::new(world, tile.id())));
            let Area { x0, y0, .. } = tile.area();
            let cells = f64::from(world.tile_cells());
            for it in &found {
                assert!(it.place.iter().all(|at| (0.0..cells).contains(at)), "{name}: {it:?}");
                assert!((0.0..360.0).contains(&it.yaw_deg) && (0.75..1.25).contains(&it.scale));
                let [x, y] = [x0 + it.place[0] as i64, y0 + it.place[1] as i64];
                let corners = [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)];
                assert!(corners.iter().all(|(x, y)| view.lake_or_sea(*x, *y) == WaterKind::Dry), "{name}: {it:?}");
                let heights = corners.map(|(x, y)| f64::from(tile.heights().at(x, y)));
                let (low, high) = (
                    heights.iter().copied().fold(f64::INFINITY, f64::min),
                    heights.iter().copied().fold(f64::NEG_INFINITY, f64::max),
                );
                assert!((low..=high).contains(&it.height_m));
                kinds[it.growth as usize] += 1;
            }
            all.extend(placed(&tile, &found));
        }
        let hectares = 4.0 * (f64::from(world.tile_cells()) * world.spacing_m()).powi(2) / 10_000.0;
        let most = A_HECTARE.iter().sum::<f64>() * hectares * 1.1 + 50.0;
        assert!(all.len() > 20 && (all.len() as f64) < most, "{name}: {kinds:?} on {hectares} ha");
        all.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let least_m = least_distance_m(world);
        for (index, one) in all.iter().enumerate() {
            for other in all[index + 1..].iter().take_while(|other| other[0] - one[0] < least_m) {
                let away = (other[0] - one[0]).hypot(other[1] - one[1]);
                assert!(away >= least_m * 0.9999, "{name}: {away} m apart, at least {least_m}");
            }
        }
    }
}

#[test]
fn instances_are_written_where_they_stand() {
    let folder = tempfile::tempdir().unwrap();
    let world = settled();
    let manifest = bake(world, (-1, -1), (2, 2), "instances", 2, folder.path());
    let region = Region::new(TileId { x: -1, y: -1 }, 2, 2, world.tile_cells()).unwrap();
    let origin = default_origin(&region);
    let grows = Grows::new(world);
    let mut rows = 0;
    for file in manifest.files.iter().filter(|file| file.export == "instances") {
        let tile = Tile::new(world, file.tile.unwrap());
        let expected = instances(world, &grows, &tile);
        let text = fs::read_to_string(folder.path().join(&file.path)).unwrap();
        let mut lines = text.lines();
        assert_eq!(lines.next(), Some("kind,x_m,y_m,z_m,east_m,north_m,yaw_deg,scale,plant,tall_m"));
        let lines: Vec<&str> = lines.collect();
        assert_eq!(lines.len(), expected.len());
        for (line, (it, [east, south])) in lines.iter().zip(expected.iter().zip(placed(&tile, &expected))) {
            let cells: Vec<&str> = line.split(',').collect();
            let number = |index: usize| cells[index].parse::<f64>().unwrap();
            let near = |index: usize, value: f64| assert!((number(index) - value).abs() < 6e-4, "{line}: {value}");
            assert_eq!(cells[0], it.growth.name());
            let spacing_m = world.spacing_m();
            near(1, east - origin[0] as f64 * spacing_m);
            near(2, it.height_m);
            near(3, south - origin[1] as f64 * spacing_m);
            near(4, east);
            near(5, -south);
            assert_eq!(cells[8], it.growth.name());
            assert!((number(9) - it.tall_m()).abs() < 0.006, "{line}");
            rows += 1;
        }
    }
    assert!(rows > 100, "{rows}");
}

type Place = [f64; 3];

/// A part of a line as its table has it.
#[derive(Debug, Default, PartialEq)]
struct Spline {
    is_whole: bool,
    /// Metres east, up and south of the world's origin.
    knots: Vec<Place>,
    widths_m: Vec<f64>,
    along_m: Vec<f64>,
    last: Vec<String>,
}

fn splines(world: &World, region: &Region, out: &Path, table: &str) -> BTreeMap<(String, usize), Spline> {
    let text = fs::read_to_string(out.join(format!("splines/{table}.csv"))).unwrap();
    let origin = default_origin(region).map(|at| at as f64 * world.spacing_m());
    let mut splines: BTreeMap<(String, usize), Spline> = BTreeMap::new();
    for line in text.lines().skip(1) {
        let cells: Vec<&str> = line.split(',').collect();
        assert_eq!(cells.len(), 12, "{line}");
        let number = |index: usize| cells[index].parse::<f64>().unwrap();
        let spline = splines.entry((cells[0].to_owned(), cells[1].parse().unwrap())).or_default();
        assert_eq!(spline.knots.len(), cells[5].parse::<usize>().unwrap());
        spline.is_whole = cells[2] == "1";
        spline.knots.push([number(6) + origin[0], number(7), number(8) + origin[1]]);
        spline.widths_m.push(number(9));
        spline.along_m.push(number(10));
        spline.last.push(cells[11].to_owned());
    }
    splines
}

fn distance(place: Place, [from, to]: [Place; 2]) -> f64 {
    let dot = |a: Place, b: Place| (0..3).map(|axis| (a[axis] - from[axis]) * (b[axis] - from[axis])).sum::<f64>();
    let square = dot(to, to);
    let share = if square > 0.0 { (dot(place, to) / square).clamp(0.0, 1.0) } else { 0.0 };
    let off = [0, 1, 2].map(|axis| place[axis] - from[axis] - (to[axis] - from[axis]) * share);
    off.iter().map(|off| off * off).sum::<f64>().sqrt()
}

/// The uniform Catmull-Rom spline through knots, as the files' README has it.
fn curve(knots: &[Place]) -> Vec<Place> {
    let last = knots.len() - 1;
    let tangent = |at: usize| {
        let (from, to, scale) = match at {
            0 => (knots[0], knots[1], 1.0),
            at if at == last => (knots[last - 1], knots[last], 1.0),
            at => (knots[at - 1], knots[at + 1], 0.5),
        };
        [0, 1, 2].map(|axis| (to[axis] - from[axis]) * scale)
    };
    let mut curve = Vec::new();
    for span in 0..last {
        let (from, to, a, b) = (knots[span], knots[span + 1], tangent(span), tangent(span + 1));
        for look in 0..=40 {
            let t = f64::from(look) / 40.0;
            let [h00, h10] = [2.0 * t * t * t - 3.0 * t * t + 1.0, t * t * t - 2.0 * t * t + t];
            let [h01, h11] = [3.0 * t * t - 2.0 * t * t * t, t * t * t - t * t];
            curve.push([0, 1, 2].map(|axis| h00 * from[axis] + h10 * a[axis] + h01 * to[axis] + h11 * b[axis]));
        }
    }
    curve
}

#[test]
fn splines_stay_near_their_lines_and_in_the_region() {
    let folder = tempfile::tempdir().unwrap();
    for ((name, world), (cols, rows)) in worlds().into_iter().zip([(5, 4), (4, 4)]) {
        let out = folder.path().join(name);
        bake(world, (-3, -2), (cols, rows), "splines", 2, &out);
        let region = Region::new(TileId { x: -3, y: -2 }, cols, rows, world.tile_cells()).unwrap();
        let (cells, spacing_m) = (i64::from(world.tile_cells()), world.spacing_m());
        let area = Area::new(-3 * cells, -2 * cells, region.width() as usize, region.height() as usize);
        let edges = [area.x0, area.x1 - 1, area.y0, area.y1 - 1].map(|at| at as f64 * spacing_m);
        let is_inside = |[east, _, south]: Place, off: f64| {
            east >= edges[0] - off && east <= edges[1] + off && south >= edges[2] - off && south <= edges[3] + off
        };
        for (table, kind) in [("roads", LineKind::Road), ("rivers", LineKind::River)] {
            let found = splines(world, &region, &out, table);
            let lines = world.lines_through(kind, &area, &Clock::default()).unwrap();
            let (mut knots, mut points, mut whole) = (0, 0, 0);
            for ((id, _), spline) in &found {
                let line = lines.iter().find(|line| line.id.to_string() == *id).expect("it is one of the world's");
                let metres = |place: [f64; 2]| place.map(|at| at * spacing_m);
                let original: Vec<Place> = line
                    .points
                    .iter()
                    .map(|point| {
                        let [east, south] = metres(line.place_from([0, 0], point));
                        [east, point.level_m, south]
                    })
                    .collect();
                assert!(spline.knots.iter().all(|knot| is_inside(*knot, 1e-3)), "{name}: {id}");
                assert!(spline.along_m.is_sorted_by(|a, b| a <= b) && spline.widths_m.iter().all(|width| *width > 0.0));
                // The curve is near the line, and the line in the part near the curve. Half a millimetre is for the
                // digits.
                let nearest = |place: Place, line: &[Place]| {
                    line.windows(2).map(|pair| distance(place, [pair[0], pair[1]])).fold(f64::INFINITY, f64::min)
                };
                let curve = curve(&spline.knots);
                for place in &curve {
                    let off = nearest(*place, &original);
                    assert!(off <= 0.5 + 1e-3, "{name}: the curve of {id} is {off} m off its line at {place:?}");
                }
                if spline.is_whole {
                    for place in &original {
                        let off = nearest(*place, &curve);
                        assert!(off <= 0.5 + 1e-3, "{name}: {id} is {off} m off its curve at {place:?}");
                    }
                    let ends = [spline.knots[0], spline.knots[spline.knots.len() - 1]];
                    let expected = [original[0], original[original.len() - 1]];
                    for (end, expected) in ends.iter().zip(expected) {
                        assert!((0..3).all(|axis| (end[axis] - expected[axis]).abs() < 1e-3), "{name}: {id}");
                    }
                    whole += 1;
                    points += original.len();
                    knots += spline.knots.len();
                    check_structures(line, spline);
                } else {
                    let on_edge = |knot: &Place| !is_inside(*knot, -1e-3);
                    let ends = [&spline.knots[0], &spline.knots[spline.knots.len() - 1]];
                    assert!(ends.into_iter().any(on_edge), "{name}: {id} is cut, and not at the edge");
                }
                if kind == LineKind::River && name == "settled" {
                    assert!(spline.last.iter().all(|flow| flow.parse::<f64>().is_ok_and(|flow| flow > 0.0)), "{id}");
                }
            }
            assert!(!found.is_empty() && whole > 0, "{name}: {whole} whole {table} of {}", found.len());
            println!("{name}: {} parts of {table}, of whole ones {knots} knots for {points} points", found.len());
            // Lines with a point a vertex can do with far fewer; of others each bend is a corner that a curve must be
            // held to.
            assert!(knots < 2 * points, "{name}: {knots} knots for {points} points of {table}");
        }
        check_json(world, &region, &out);
        let readme = fs::read_to_string(out.join("splines/README.md")).unwrap();
        assert!(readme.contains("X = 100 * x") && readme.contains("0.5 m apart") && !readme.contains("ORIGIN"));
    }
}

/// Each bridge, tunnel and ford of a road is one of its spline.
fn check_structures(line: &Line, spline: &Spline) {
    let named = |kind: StructureKind| spline.last.iter().filter(|name| **name == kind.name()).count();
    for kind in [StructureKind::Bridge, StructureKind::Tunnel, StructureKind::Ford] {
        let has = line.structures.iter().any(|structure| structure.kind == kind);
        assert_eq!(named(kind) > 0, has, "{}: {}", line.id, kind.name());
    }
}

/// The JSON has the same lines as the tables.
fn check_json(world: &World, region: &Region, out: &Path) {
    let text = fs::read_to_string(out.join("splines/splines.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(json["axes"]["z"], "south");
    let origin = default_origin(region).map(|at| at as f64 * world.spacing_m());
    assert_eq!(json["origin"]["east_m"].as_f64(), Some(origin[0]));
    assert_eq!(json["origin"]["north_m"].as_f64(), Some(0.0 - origin[1]));
    let mut lines = 0;
    for (table, kind) in [("roads", "road"), ("rivers", "river")] {
        for ((id, part), spline) in splines(world, region, out, table) {
            let all = json["splines"].as_array().unwrap();
            let same = |line: &&serde_json::Value| line["id"] == id && line["part"] == part && line["kind"] == kind;
            let line = all.iter().find(same).expect("a line of a table is in the JSON");
            let points = line["points"].as_array().unwrap();
            assert_eq!(points.len(), spline.knots.len());
            for (point, knot) in points.iter().zip(&spline.knots) {
                assert!((point[0].as_f64().unwrap() + origin[0] - knot[0]).abs() < 1e-9);
                assert_eq!(point[1].as_f64(), Some(knot[1]));
            }
            lines += 1;
        }
    }
    assert_eq!(json["splines"].as_array().unwrap().len(), lines);
}

#[test]
fn whole_splines_are_the_same_in_every_region_on_any_threads() {
    let folder = tempfile::tempdir().unwrap();
    let world = settled();
    let found = |name: &str, at: (i64, i64), size: (u64, u64), threads: usize| {
        let out = folder.path().join(name);
        bake(world, at, size, "splines", threads, &out);
        let region = Region::new(TileId { x: at.0, y: at.1 }, size.0, size.1, world.tile_cells()).unwrap();
        splines(world, &region, &out, "rivers")
    };
    let (one, other) = (found("one", (-4, -4), (7, 7), 1), found("other", (-3, -4), (6, 8), 3));
    let mut shared = 0;
    for (id, spline) in one.iter().filter(|(_, spline)| spline.is_whole) {
        let Some(again) = other.get(id).filter(|spline| spline.is_whole) else { continue };
        assert_eq!(spline.knots.len(), again.knots.len(), "{id:?}");
        let same = |(a, b): (&Place, &Place)| (0..3).all(|axis| (a[axis] - b[axis]).abs() < 1.1e-3);
        assert!(spline.knots.iter().zip(&again.knots).all(same), "{id:?}");
        shared += 1;
    }
    assert!(shared > 3, "{shared} rivers are whole in both");
}
