//! Rivers, lakes, coasts, peaks, settlements and roads of fluvial worlds: whole, once, the same in every window, and in
//! their right place.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;
use std::sync::OnceLock;

use rusqlite::Connection;
use rusqlite::types::Value as Cell;
use serde_json::Value;
use tempfile::TempDir;
use terrane::area::{Area, Region, TileId};
use terrane::clock::Clock;
use terrane::fluvial::landforms::lakes::Lake;
use terrane::geometry::LineSegment;
use terrane::land::WaterKind;
use terrane::lines::{Line, LineEnd, LineKind, Lines};
use terrane::preset::Preset;
use terrane::world::World;

use crate::bakes::{FLUVIAL, bake_vectors, fresh, settled, unsettled};
use crate::is_long;

const LAYERS: [&str; 7] = ["rivers", "lakes", "coast", "peaks", "sites", "roads", "crossings"];

fn region(world: &World, x: i64, y: i64, cols: u64, rows: u64) -> Region {
    Region::new(TileId { x, y }, cols, rows, world.tile_cells()).unwrap()
}

/// Ten of vectors, the registry and the manifest.
const FILES: usize = 12;

fn package(out: &Path) -> Connection {
    Connection::open(out.join("vector/vector.gpkg")).unwrap()
}

/// All columns of a layer but its row numbers, by id.
fn rows(out: &Path, layer: &str) -> BTreeMap<String, Vec<Cell>> {
    let database = package(out);
    let mut select = database.prepare(&format!("SELECT * FROM {layer} ORDER BY fid")).unwrap();
    let columns = select.column_count();
    let row = |row: &rusqlite::Row| (1..columns).map(|column| row.get(column)).collect::<Result<Vec<Cell>, _>>();
    let rows: Vec<Vec<Cell>> = select.query_map((), row).unwrap().map(Result::unwrap).collect();
    let id = |row: &Vec<Cell>| match &row[1] {
        Cell::Text(id) => id.clone(),
        other => panic!("{other:?} is no id"),
    };
    let ids: Vec<String> = rows.iter().map(id).collect();
    assert!(ids.is_sorted_by(|a, b| a < b), "{layer} has an id twice, or is not sorted: {ids:?}");
    ids.into_iter().zip(rows).collect()
}

fn features(out: &Path, layer: &str) -> Vec<Value> {
    let text = fs::read(out.join(format!("vector/{layer}.geojson"))).unwrap();
    let mut json: Value = serde_json::from_slice(&text).unwrap();
    serde_json::from_value(json["features"].take()).unwrap()
}

/// A world, a region of it and the folder that it is baked to, made once for the tests that look at them.
fn baked() -> (&'static World, Region, &'static TempDir) {
    static BAKED: OnceLock<(Region, TempDir)> = OnceLock::new();
    let (region, folder) = BAKED.get_or_init(|| {
        let (world, folder) = (settled(), tempfile::tempdir().unwrap());
        let region = region(world, -8, -8, 16, 16);
        bake_vectors(world, region, 2, folder.path(), FILES);
        (region, folder)
    });
    (settled(), *region, folder)
}

#[test]
fn a_feature_is_the_same_in_every_window() {
    let (.., one) = baked();
    let other = tempfile::tempdir().unwrap();
    // Another world of the same recipe: nothing is remembered of the first bake.
    let again = fresh();
    let (wide, high) = if is_long() { (11, 6) } else { (6, 6) };
    bake_vectors(&again, region(&again, -2, -3, wide, high), 3, other.path(), FILES);
    for layer in LAYERS {
        let (first, second) = (rows(one.path(), layer), rows(other.path(), layer));
        let mut shared = 0;
        for (id, row) in &first {
            if let Some(others) = second.get(id) {
                assert_eq!(row, others, "{layer}: {id} differs between two bakes");
                shared += 1;
            }
        }
        assert!(shared > 0 && shared < first.len(), "{shared} of {} {layer} are in both", first.len());
    }
}

#[test]
fn the_bytes_depend_neither_on_threads_nor_on_tiles() {
    let folder = tempfile::tempdir().unwrap();
    let (one, other) = (folder.path().join("one"), folder.path().join("other"));
    // In the long form nothing is remembered of any other bake.
    let fine = if is_long() { &fresh() } else { settled() };
    bake_vectors(fine, region(fine, -2, -2, 4, 4), 1, &one, FILES);
    let coarse = Preset::parse("test", &FLUVIAL.replace("tile_cells = 64", "tile_cells = 128")).unwrap();
    let coarse = World::new(coarse, Some(5)).unwrap();
    bake_vectors(&coarse, region(&coarse, -1, -1, 2, 2), 4, &other, FILES);
    for layer in LAYERS {
        let path = format!("vector/{layer}.geojson");
        assert!(fs::read(one.join(&path)).unwrap() == fs::read(other.join(&path)).unwrap(), "{path}");
        assert_eq!(rows(&one, layer), rows(&other, layer), "{layer}");
    }
}

#[test]
fn both_formats_hold_the_features_that_touch_the_region() {
    let (world, region, folder) = baked();
    let area = Area::new(-512, -512, region.width() as usize, region.height() as usize);
    let expected: [BTreeSet<String>; 2] = [
        rivers_of(world, &area).iter().map(|river| river.id.to_string()).collect(),
        world.lakes(&area, &Clock::default()).unwrap().iter().map(|lake| lake.id.to_string()).collect(),
    ];
    for (layer, expected) in LAYERS.iter().zip(&expected) {
        let found: BTreeSet<String> = rows(folder.path(), layer).into_keys().collect();
        assert_eq!(&found, expected, "{layer}");
    }
    let database = package(folder.path());
    for layer in LAYERS {
        let table = rows(folder.path(), layer);
        let text = features(folder.path(), layer);
        let ids: Vec<&str> = text.iter().map(|feature| feature["properties"]["id"].as_str().unwrap()).collect();
        assert_eq!(ids, table.keys().collect::<Vec<_>>(), "{layer}");
        // The extent of the layer is that of the text's coordinates.
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for feature in &text {
            each_point(&feature["geometry"]["coordinates"], &mut |point| {
                for axis in [0, 1] {
                    low[axis] = low[axis].min(point[axis]);
                    high[axis] = high[axis].max(point[axis]);
                }
            });
        }
        let bounds = "SELECT min_x, min_y, max_x, max_y FROM gpkg_contents WHERE table_name = ?";
        let bounds: [f64; 4] = database
            .query_row(bounds, [layer], |row| Ok([row.get(0)?, row.get(1)?, row.get(2)?, row.get(3)?]))
            .unwrap();
        // The text has six digits after the point.
        let off = [0, 1].map(|axis| (bounds[axis] - low[axis]).abs().max((bounds[axis + 2] - high[axis]).abs()));
        assert!(off.iter().all(|metres| *metres < 0.51e-6), "{layer}: {bounds:?} and {low:?} to {high:?}");
    }
    let shapes = "SELECT group_concat(table_name || ' ' || geometry_type_name || ' ' || z, ', ') FROM \
                  (SELECT * FROM gpkg_geometry_columns ORDER BY rowid)";
    let shapes: String = database.query_row(shapes, (), |row| row.get(0)).unwrap();
    let expected = "rivers LINESTRING 1, lakes POLYGON 0, coast LINESTRING 0, peaks POINT 0, sites POINT 0, \
                    roads LINESTRING 1, crossings POINT 0, contours LINESTRING 0, tiles POLYGON 0";
    assert_eq!(shapes, expected);
    // What a reader of the text looks for.
    let river = &features(folder.path(), "rivers")[0];
    assert_eq!(river["geometry"]["coordinates"][0].as_array().unwrap().len(), 3);
    for pair in ["width_m", "discharge_m3s", "level_m"] {
        assert_eq!(river["properties"][pair].as_array().map(Vec::len), Some(2), "{pair}");
    }
    assert!(river["properties"]["order"].as_u64() >= Some(1));
    assert_eq!(features(folder.path(), "lakes")[0]["geometry"]["type"], "Polygon");
    assert_eq!(features(folder.path(), "peaks")[0]["geometry"]["coordinates"].as_array().unwrap().len(), 2);
}

fn each_point(coordinates: &Value, take: &mut impl FnMut([f64; 2])) {
    let parts = coordinates.as_array().unwrap();
    match parts[0].as_f64() {
        Some(east) => take([east, parts[1].as_f64().unwrap()]),
        None => parts.iter().for_each(|part| each_point(part, take)),
    }
}

#[test]
fn roads_join_settlements_and_things_have_names() {
    let (world, _, folder) = baked();
    let read = |layer: &str| features(folder.path(), layer);
    let [sites, roads, crossings, rivers] = ["sites", "roads", "crossings", "rivers"].map(read);
    let text = |feature: &Value, key: &str| feature["properties"][key].as_str().unwrap().to_owned();
    let places: BTreeMap<String, &Value> =
        sites.iter().map(|site| (text(site, "id"), &site["geometry"]["coordinates"])).collect();
    assert!(roads.len() > 4 && !crossings.is_empty(), "{} roads, {} crossings", roads.len(), crossings.len());
    let mut ids = BTreeSet::new();
    let flat = |at: &Value| [0, 1].map(|axis| at[axis].as_f64().unwrap());
    let line = |road: &Value| -> Vec<[f64; 2]> {
        road["geometry"]["coordinates"].as_array().unwrap().iter().map(flat).collect()
    };
    // From the region's tiles, eight to each side of the origin.
    let side_m = 8.0 * f64::from(world.tile_cells()) * world.spacing_m();
    for road in &roads {
        let own = line(road);
        for (end, key) in [(own[0], "from"), (own[own.len() - 1], "to")] {
            // Lines are drawn to 25 cm.
            let is_on = |other: &Value| {
                let is_near = |ends: &[[f64; 2]]| LineSegment::between(ends[0], ends[1]).distance(end) < 0.3;
                text(other, "id") != text(road, "id") && line(other).windows(2).any(is_near)
            };
            let is_outside = end.iter().any(|at| at.abs() > side_m);
            let joins = end == flat(places[&text(road, key)]) || roads.iter().any(is_on);
            assert!(is_outside || joins, "{} {key}", text(road, "id"));
        }
        ids.insert(text(road, "id"));
    }
    assert!(crossings.iter().all(|crossing| ids.contains(&text(crossing, "road"))));
    let mut courses = BTreeMap::new();
    for river in &rivers {
        let name = text(river, "name");
        assert_eq!(courses.entry(text(river, "course")).or_insert_with(|| name.clone()), &name);
    }
    let named = |feature: &Value| !text(feature, "name").is_empty();
    assert!(sites.iter().chain(&read("lakes")).chain(&read("peaks")).all(named));
}

#[test]
fn a_world_without_places_has_their_layers_empty() {
    let folder = tempfile::tempdir().unwrap();
    let bare = unsettled();
    let world = World::new(Preset::parse("test", bare).unwrap(), Some(5)).unwrap();
    bake_vectors(&world, region(&world, -2, -2, 4, 4), 2, folder.path(), FILES);
    for layer in ["sites", "roads", "crossings"] {
        assert!(rows(folder.path(), layer).is_empty() && features(folder.path(), layer).is_empty(), "{layer}");
    }
    let rivers = features(folder.path(), "rivers");
    assert!(!rivers.is_empty() && rivers.iter().all(|river| river["properties"]["name"].is_null()));
}

/// All rivers of an area.
fn rivers_of(world: &World, area: &Area) -> Lines {
    world.lines(area, &Clock::default()).unwrap().into_iter().filter(|line| line.kind == LineKind::River).collect()
}

/// Vertices from a place to the nearest of a line.
fn distance(line: &Line, to: [f64; 2]) -> f64 {
    line.points.windows(2).fold(f64::INFINITY, |least, pair| {
        let [a, b] = [0, 1].map(|end| line.place_from([0, 0], &pair[end]));
        let (along, off) = ([b[0] - a[0], b[1] - a[1]], [to[0] - a[0], to[1] - a[1]]);
        let square = along[0] * along[0] + along[1] * along[1];
        let share = ((off[0] * along[0] + off[1] * along[1]) / square).clamp(0.0, 1.0);
        least.min((off[0] - along[0] * share).hypot(off[1] - along[1] * share))
    })
}

/// Vertices from a point to a lake, 0 on it.
fn from_lake(lake: &Lake, to: [f64; 2]) -> f64 {
    let (mut inside, mut least) = (false, f64::INFINITY);
    for pair in lake.rings.iter().flat_map(|ring| ring.windows(2)) {
        let [a, b] = [pair[0], pair[1]].map(|[x, y]| [x - to[0], y - to[1]]);
        inside ^= (a[1] > 0.0) != (b[1] > 0.0) && a[0] + (b[0] - a[0]) * (a[1] / (a[1] - b[1])) > 0.0;
        let way = [b[0] - a[0], b[1] - a[1]];
        let share = (-(a[0] * way[0] + a[1] * way[1]) / (way[0] * way[0] + way[1] * way[1])).clamp(0.0, 1.0);
        least = least.min((a[0] + way[0] * share).hypot(a[1] + way[1] * share));
    }
    if inside { 0.0 } else { least }
}

#[test]
fn rivers_fall_and_end_in_what_they_say() {
    let (world, ..) = baked();
    let land = world.relief().fluvial().unwrap();
    let area = Area::new(-512, -512, 1025, 1025);
    let rivers = rivers_of(world, &area);
    let by_id: BTreeMap<_, &Line> = rivers.iter().map(|river| (river.id, &**river)).collect();
    assert!(rivers.len() > 20 && by_id.len() == rivers.len());
    let wide = world.lakes(&area.padded(1024), &Clock::default()).unwrap();
    let (mut seen, mut highest) = ([0; 3], 0);
    for river in &rivers {
        let id = river.id;
        for pair in river.points.windows(2) {
            assert!(pair[0].level_m > pair[1].level_m && pair[0].floor_m > pair[1].floor_m, "{id} does not fall");
            assert!(pair[0].discharge_m3s <= pair[1].discharge_m3s, "{id} shrinks");
        }
        // As broad as its discharge makes it, and a little less in straights and more in bends.
        let usual_m = land.fields().settings().river_width_m / 2.0;
        let shares: Vec<f64> =
            river.points.iter().map(|point| point.half_width_m / (usual_m * point.discharge_m3s.sqrt())).collect();
        assert!(shares.iter().all(|share| (0.89..1.21).contains(share)), "{id} is {shares:?} times as broad as usual");
        assert!(shares.windows(2).all(|pair| (pair[0] / pair[1] - 1.0).abs() < 0.1), "{id} has steps in its banks");
        highest = highest.max(land.order(river, &Clock::default()).unwrap());
        let last = river.points[river.points.len() - 1];
        let end = river.place_from([0, 0], &last);
        match river.end {
            LineEnd::Line(other) => {
                seen[0] += 1;
                // What it joins may be out of the area.
                let Some(other) = by_id.get(&other) else { continue };
                assert!(distance(other, end) < 1.0 / 256.0, "{id} ends beside {}", other.id);
                let mouth = other.points[other.points.len() - 1];
                let is_larger = land.order(other, &Clock::default()).unwrap()
                    >= land.order(river, &Clock::default()).unwrap()
                    && mouth.half_width_m >= last.half_width_m;
                assert!(is_larger && last.level_m >= mouth.level_m, "{id} and {}", other.id);
            }
            LineEnd::Lake(node) => {
                seen[1] += 1;
                let lake = wide.iter().find(|lake| lake.id == node).unwrap_or_else(|| panic!("no lake {node:?}"));
                assert!(from_lake(lake, end) <= 1.0, "{id} ends beside its lake");
                assert!(last.level_m > lake.level_m - 0.01, "{id} ends under its lake");
            }
            LineEnd::Sea => {
                seen[2] += 1;
                let [x, y] = end.map(|at| at.floor() as i64);
                let around = Area::new(x, y, 2, 2).padded(8);
                let water = world.relief().land(around, &Clock::default()).unwrap().water.unwrap();
                assert!(water.kind.values().contains(&WaterKind::Sea), "{id} ends away from the sea");
            }
            other => panic!("{id} ends in {other:?}"),
        }
    }
    assert!(seen.iter().all(|count| *count > 0), "rivers, lakes and the sea: {seen:?}");
    assert!(highest >= 3, "the highest order is {highest}");
}

#[test]
fn rivers_lie_on_the_ground() {
    // Where beds of the same level, of lakes and of dry brooks beside them once left them up to 47 metres in the air;
    // and where a glacier's valley goes up in a step, at which it was 29; and where a head lies beyond a divide, at
    // which it was 35.
    let mut count = 0;
    let places = [
        ("highlands", 90210, -608, -3020, 2.0),
        ("alps", 31001, -321, 14, 2.0),
        ("highlands", 1732, 5, 5005, 2.0),
        ("highlands", 90210, -611, -3019, 2.0),
        ("highlands", 5077, 60, -4321, 2.0),
        ("alps", 20301, 1004, -1, 4.0),
        ("alps", 31001, -321, 13, 2.0),
    ];
    for (name, seed, x, y, most_m) in places.into_iter().take(if is_long() { 7 } else { 2 }) {
        let (_, mut preset) = Preset::load(name).unwrap();
        // These places were found in the worlds of the seeds alone.
        preset.country = None;
        let world = World::new(preset, Some(seed)).unwrap();
        let area = TileId { x, y }.area(world.tile_cells());
        let land = world.relief().land(area, &Clock::default()).unwrap();
        let depth_m = land.water.unwrap().depth_m;
        for river in rivers_of(&world, &area) {
            for point in &river.points {
                let place = river.place_from([area.x0, area.y0], point);
                let [east, south] = place.map(|at| at.floor() as i64);
                if !area.contains(&Area::new(area.x0 + east, area.y0 + south, 2, 2)) {
                    continue;
                }
                let [x, y] = [area.x0 + east, area.y0 + south];
                let corners = [[x, y], [x + 1, y], [x, y + 1], [x + 1, y + 1]];
                let surface_m = corners.map(|[x, y]| f64::from(land.heights.at(x, y) + depth_m.at(x, y)));
                let highest_m = surface_m.into_iter().fold(f64::MIN, f64::max);
                assert!(point.level_m < highest_m + most_m, "{}, {highest_m} m: {point:?}", river.id);
                count += 1;
            }
        }
    }
    assert!(count > if is_long() { 100 } else { 50 }, "{count} points");
}

#[test]
fn lakes_are_rings_around_their_water() {
    let (world, ..) = baked();
    let lakes = world.lakes(&Area::new(-512, -512, 1025, 1025), &Clock::default()).unwrap();
    assert!(lakes.len() > 2);
    for lake in &lakes {
        for ring in &lake.rings {
            assert!(ring.len() >= 4 && ring[0] == ring[ring.len() - 1], "a ring of {:?} is open", lake.id);
        }
        assert!(lake.area_m2 > 0.0);
        // A vertex is lake or not on the two sides of the westernmost point of the shore.
        let west = lake.rings[0].iter().min_by(|a, b| a[0].partial_cmp(&b[0]).unwrap()).unwrap();
        let (x, y) = (west[0].floor() as i64, west[1] as i64);
        let water = world.relief().land(Area::new(x, y, 2, 1), &Clock::default()).unwrap().water.unwrap();
        // To the west of it there may be a river.
        assert_ne!(water.kind.at(x, y), WaterKind::Lake, "{:?}", lake.id);
        assert_eq!(water.kind.at(x + 1, y), WaterKind::Lake, "{:?}", lake.id);
        // What runs out of it begins at its level.
        if let Some(outlet) = lake.outlet {
            let around = lake.rings[0].iter().fold(Area::new(x, y, 1, 1), |area, point| {
                let (x, y) = (point[0] as i64, point[1] as i64);
                Area { x0: area.x0.min(x), y0: area.y0.min(y), x1: area.x1.max(x + 2), y1: area.y1.max(y + 2) }
            });
            let rivers = rivers_of(world, &around.padded(2));
            let river = rivers
                .iter()
                .find(|river| river.id == outlet)
                .unwrap_or_else(|| panic!("{outlet} begins away from lake {:?}", lake.id));
            assert!((river.points[0].level_m - lake.level_m).abs() < 0.5, "{outlet} begins beside its lake");
        }
    }
}

#[test]
fn no_lake_stands_above_the_land_at_its_shore() {
    let (world, ..) = baked();
    let area = Area::new(-1024, -1024, 2049, 2049);
    let land = world.relief().land(area, &Clock::default()).unwrap();
    let water = land.water.unwrap();
    let (mut shores, mut steps) = (0, Vec::new());
    for (x, y) in area.vertices().filter(|(x, y)| water.kind.at(*x, *y) == WaterKind::Lake) {
        let surface_m = land.heights.at(x, y) + water.depth_m.at(x, y);
        for (x, y) in [(x - 1, y), (x + 1, y), (x, y - 1), (x, y + 1)] {
            if area.contains(&Area::new(x, y, 1, 1)) && water.kind.at(x, y) != WaterKind::Lake {
                shores += 1;
                let beside_m = land.heights.at(x, y) + water.depth_m.at(x, y);
                if beside_m < surface_m - 1.0 {
                    steps.push((x, y, surface_m - beside_m));
                }
            }
        }
    }
    // At an outlet the river falls away from one vertex to the next.
    assert!(steps.len() * 200 < shores, "{} of {shores} vertices by lakes lie lower: {:?}", steps.len(), &steps[..9]);
}

#[test]
fn pieces_of_coast_meet_at_the_edges_of_their_cells() {
    let (world, ..) = baked();
    let coasts = world.coasts(&Area::new(-1024, -1024, 2049, 2049), &Clock::default()).unwrap();
    let mut ends: BTreeMap<[u64; 2], usize> = BTreeMap::new();
    let inner = |point: &[f64; 2]| point.iter().all(|at| at.abs() < 1023.0);
    for coast in &coasts {
        let (first, last) = (coast.line[0], coast.line[coast.line.len() - 1]);
        if first != last {
            for end in [first, last].iter().filter(|end| inner(end)) {
                *ends.entry(end.map(f64::to_bits)).or_default() += 1;
            }
        }
    }
    assert!(ends.len() > 2, "{} ends", ends.len());
    assert!(ends.values().all(|count| *count == 2), "a piece of coast ends in nothing");
}

#[test]
fn peaks_are_the_highest_around() {
    let (world, ..) = baked();
    let peaks = world.peaks(&Area::new(-512, -512, 1025, 1025), &Clock::default()).unwrap();
    assert!(peaks.len() > 1);
    for peak in &peaks {
        let [x, y] = peak.at;
        let heights = world.relief().heights(Area::new(x, y, 1, 1).padded(8));
        assert_eq!(heights.at(x, y), peak.height_m);
        assert!(heights.values().iter().all(|height_m| *height_m <= peak.height_m), "{:?}", peak.id);
    }
    for (index, a) in peaks.iter().enumerate() {
        assert!(peaks[index + 1..].iter().all(|b| a.id != b.id && a.at != b.at));
    }
}
