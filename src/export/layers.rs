//! The layers of the vector exports: their columns, and how a tile's features become rows.
//!
//! Coordinates are metres in the plane of the world: east is x, north is y, so y is the negative of the lattice's
//! south and a map shows north up. No coordinate reference system of the Earth applies. A feature is whole, even where
//! it leaves the region, and once, however many tiles it crosses.
//!
//! A new layer is a [`Layer`] here and a place in [`FLUVIAL`] or [`AGENTS`]; both formats have it then.

use rusqlite::types::Value;

use crate::agents::paths::{Path, PathEnding};
use crate::agents::way::WayKind;
use crate::area::{Area, TileId};
use crate::fluvial::landforms::coast::Coast;
use crate::fluvial::landforms::lakes::Lake;
use crate::fluvial::landforms::peaks::Peak;
use crate::fluvial::point::{GRAINS, Point};
use crate::fluvial::rivers::{River, RiverEnding};
use crate::fluvial::trunk::NodeId;
use crate::hash;
use crate::places::land::FIXED;
use crate::places::names;
use crate::places::road::{Crossing, Road, RoadClass, RoadKind, RoadPoint};
use crate::places::site::{Site, SiteClass, SiteId};
use crate::tile::Tile;
use crate::world::World;

/// A kind of features.
pub(crate) struct Layer {
    /// The table of the GeoPackage, and the file of the GeoJSON.
    pub name: &'static str,
    pub about: &'static str,
    pub shape: Shape,
    pub columns: &'static [Column],
    /// Shows the features that touch a tile: each with its key, and what makes the feature of it.
    visit: fn(&World, &Tile, &mut Visit<'_>),
}

/// Takes a feature's key, by which a layer is sorted, and what makes the feature.
pub(crate) type Visit<'a> = dyn FnMut(Vec<u8>, &dyn Fn() -> Feature) + 'a;

/// What the geometries of a layer are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Shape {
    /// A point.
    Point,
    /// A line.
    Line,
    /// A line whose points have heights.
    LineZ,
    /// A polygon: its outer ring, then its holes.
    Polygon,
}

impl Shape {
    /// Numbers a point.
    pub fn dimensions(self) -> usize {
        if self == Shape::LineZ { 3 } else { 2 }
    }
}

/// A property.
pub(crate) struct Column {
    /// Its column in the GeoPackage.
    pub name: &'static str,
    /// Its key in the GeoJSON. Neighbours of the same key are an array.
    pub key: &'static str,
    pub kind: Kind,
    /// Whether each feature has it.
    pub required: bool,
}

/// What a property holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Integer,
    /// A number of 64 bits, and one that text has with as many digits as 32 bits need.
    Real,
    Real32,
    Text,
}

/// A row of a layer.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Feature {
    /// The values of the layer's columns.
    pub values: Vec<Value>,
    /// A line, the rings of a polygon, or a point alone: metres east and north, and up where the layer has heights.
    pub lines: Vec<Vec<[f64; 3]>>,
}

impl Layer {
    /// Shows the features of a tile.
    pub fn visit(&self, world: &World, tile: &Tile, visit: &mut Visit<'_>) {
        (self.visit)(world, tile, visit);
    }
}

/// The layers that a world has, besides the footprints of its tiles.
pub(crate) fn layers(world: &World) -> &'static [Layer] {
    if world.relief().fluvial().is_some() { FLUVIAL } else { AGENTS }
}

const fn column(name: &'static str, kind: Kind) -> Column {
    Column { name, key: name, kind, required: true }
}

const fn optional(name: &'static str, kind: Kind) -> Column {
    Column { name, key: name, kind, required: false }
}

const fn keyed(name: &'static str, key: &'static str, kind: Kind) -> Column {
    Column { name, key, kind, required: true }
}

fn text(value: impl ToString) -> Value {
    Value::Text(value.to_string())
}

fn optional_text(value: Option<impl ToString>) -> Value {
    value.map_or(Value::Null, text)
}

/// The name that a feature has on a map: one of the names of the site cell that a vertex of it lies in, by the numbers
/// of its id. Worlds without places have no names.
fn name(world: &World, of: fn(u64, SiteId, u64) -> String, at: [i64; 2], id: &[i64]) -> Value {
    let number = id.iter().fold(0, |number, part| hash::mix(number ^ *part as u64));
    world.places().map_or(Value::Null, |places| text(of(world.seed(), places.cell(at), number)))
}

/// About where a node of a lattice of the network is, in vertices.
fn vertex_of_node(world: &World, level: u32, x: i64, y: i64) -> [i64; 2] {
    let side = world.relief().fluvial().map_or(0, |fluvial| fluvial.fields().side(level));
    [x, y].map(|at| (at * side).div_euclid(GRAINS))
}

// ---------------------------------------------------------------------------------------------------------------------
// Fluvial worlds.

/// The layers of fluvial worlds.
pub(crate) const FLUVIAL: &[Layer] = &[
    Layer {
        name: "rivers",
        about: "rivers, from source to end, with the height of their surface; metres and m3/s",
        shape: Shape::LineZ,
        columns: &[
            column("id", Kind::Text),
            optional("name", Kind::Text),
            column("course", Kind::Text),
            keyed("strahler", "order", Kind::Integer),
            column("length_m", Kind::Real),
            keyed("width_start_m", "width_m", Kind::Real),
            keyed("width_end_m", "width_m", Kind::Real),
            keyed("discharge_start_m3s", "discharge_m3s", Kind::Real),
            keyed("discharge_end_m3s", "discharge_m3s", Kind::Real),
            keyed("level_start_m", "level_m", Kind::Real),
            keyed("level_end_m", "level_m", Kind::Real),
            column("ending", Kind::Text),
            optional("joins", Kind::Text),
        ],
        visit: |world, tile, visit| {
            for river in world.rivers(&tile.area()) {
                visit(river.id.to_string().into(), &|| of_river(world, &river));
            }
        },
    },
    Layer {
        name: "lakes",
        about: "lakes with their islands; metres",
        shape: Shape::Polygon,
        columns: &[
            column("id", Kind::Text),
            optional("name", Kind::Text),
            column("level_m", Kind::Real),
            column("area_m2", Kind::Real),
            optional("outlet", Kind::Text),
        ],
        visit: |world, tile, visit| {
            for lake in world.lakes(&tile.area()) {
                visit(lake_id(lake.id).into(), &|| of_lake(world, &lake));
            }
        },
    },
    Layer {
        name: "coast",
        about: "the line between land and sea, land on its left; metres",
        shape: Shape::Line,
        columns: &[column("id", Kind::Text), column("length_m", Kind::Real)],
        visit: |world, tile, visit| {
            for coast in world.coasts(&tile.area()) {
                visit(coast_id(&coast).into(), &|| of_coast(&coast, world.spacing_m()));
            }
        },
    },
    Layer {
        name: "peaks",
        about: "peaks; metres",
        shape: Shape::Point,
        columns: &[column("id", Kind::Text), optional("name", Kind::Text), column("height_m", Kind::Real32)],
        visit: |world, tile, visit| {
            for peak in world.peaks(&tile.area()) {
                visit(peak_id(&peak).into(), &|| of_peak(world, &peak));
            }
        },
    },
    Layer {
        name: "sites",
        about: "settlements, also those elsewhere that the roads of the region lead to; metres",
        shape: Shape::Point,
        columns: &[
            column("id", Kind::Text),
            column("name", Kind::Text),
            column("class", Kind::Text),
            column("population", Kind::Integer),
            column("height_m", Kind::Real32),
        ],
        visit: visit_sites,
    },
    Layer {
        name: "roads",
        about: "roads from one settlement to another, with the height of their surface; metres",
        shape: Shape::LineZ,
        columns: &[
            column("id", Kind::Text),
            column("class", Kind::Text),
            // Both are words of SQL.
            keyed("from_site", "from", Kind::Text),
            keyed("to_site", "to", Kind::Text),
            column("max_grade", Kind::Real),
            column("width_m", Kind::Real),
            column("length_m", Kind::Real),
        ],
        visit: |world, tile, visit| {
            for road in roads(tile) {
                visit(road_id(road).into(), &|| of_road(road, world.spacing_m()));
            }
        },
    },
    Layer {
        name: "crossings",
        about: "bridges, fords and tunnels of the roads; metres",
        shape: Shape::Point,
        columns: &[
            column("id", Kind::Text),
            column("kind", Kind::Text),
            column("road", Kind::Text),
            column("length_m", Kind::Real),
        ],
        visit: |world, tile, visit| roads(tile).for_each(|road| visit_crossings(road, world.spacing_m(), visit)),
    },
];

fn lake_id((x, y): NodeId) -> String {
    format!("l:{x}:{y}")
}

fn coast_id(coast: &Coast) -> String {
    let (x, y) = coast.id.cell;
    // Numbers of a cell sort as text.
    format!("c:{x}:{y}:{:05}", coast.id.number)
}

fn peak_id(peak: &Peak) -> String {
    format!("p:{}:{}", peak.id.0, peak.id.1)
}

/// Metres east and north of vertices east and south.
fn metres([x, y]: [f64; 2], spacing_m: f64) -> [f64; 3] {
    // Not the negative, which has a zero of its own.
    [x * spacing_m, 0.0 - y * spacing_m, 0.0]
}

fn length_m(line: &[[f64; 3]]) -> f64 {
    let step_m = |pair: &[[f64; 3]]| {
        let [east, north] = [pair[1][0] - pair[0][0], pair[1][1] - pair[0][1]];
        (east * east + north * north).sqrt()
    };
    // Not `sum`, whose nothing is the negative zero.
    line.windows(2).map(step_m).fold(0.0, |sum, step| sum + step)
}

fn of_river(world: &World, river: &River) -> Feature {
    let vertices = |at: Point| [at.x, at.y].map(|grains| grains as f64 / GRAINS as f64);
    let line: Vec<[f64; 3]> = river
        .line
        .iter()
        .map(|point| {
            let [east, north, _] = metres(vertices(point.at), world.spacing_m());
            [east, north, point.level_m]
        })
        .collect();
    let (level, x, y) = river.course;
    let (ending, joins) = match river.ending {
        RiverEnding::River(other) => ("river", Some(other.to_string())),
        RiverEnding::Lake(node) => ("lake", Some(lake_id(node))),
        RiverEnding::Sea => ("sea", None),
        RiverEnding::Sink => ("sink", None),
    };
    let source = vertex_of_node(world, level, x, y);
    let values = vec![
        text(river.id),
        // All parts of a course have one name.
        name(world, names::river, source, &[i64::from(level), x, y]),
        text(format!("r{level}:{x}:{y}")),
        Value::Integer(river.order as i64),
        Value::Real(length_m(&line)),
        Value::Real(river.width_m[0]),
        Value::Real(river.width_m[1]),
        Value::Real(river.discharge_m3s[0]),
        Value::Real(river.discharge_m3s[1]),
        Value::Real(line[0][2]),
        Value::Real(line[line.len() - 1][2]),
        text(ending),
        optional_text(joins),
    ];
    Feature { values, lines: vec![line] }
}

fn of_lake(world: &World, lake: &Lake) -> Feature {
    let (x, y) = lake.id;
    let values = vec![
        text(lake_id(lake.id)),
        name(world, names::lake, vertex_of_node(world, 0, x, y), &[x, y]),
        Value::Real(lake.level_m),
        Value::Real(lake.area_m2),
        optional_text(lake.outlet),
    ];
    let ring = |ring: &Vec<[f64; 2]>| ring.iter().map(|point| metres(*point, world.spacing_m())).collect();
    Feature { values, lines: lake.rings.iter().map(ring).collect() }
}

fn of_coast(coast: &Coast, spacing_m: f64) -> Feature {
    let line: Vec<[f64; 3]> = coast.line.iter().map(|point| metres(*point, spacing_m)).collect();
    Feature { values: vec![text(coast_id(coast)), Value::Real(length_m(&line))], lines: vec![line] }
}

fn of_peak(world: &World, peak: &Peak) -> Feature {
    let values = vec![
        text(peak_id(peak)),
        name(world, names::peak, peak.at, &[peak.id.0, peak.id.1]),
        Value::Real(peak.height_m as f64),
    ];
    Feature { values, lines: vec![vec![metres(peak.at.map(|at| at as f64), world.spacing_m())]] }
}

/// Shows the settlements of a tile, and those elsewhere that its roads end at.
fn visit_sites(world: &World, tile: &Tile, visit: &mut Visit<'_>) {
    let mut show = |site: &Site| visit(site_id(site.id).into(), &|| of_site(site, world.spacing_m()));
    let here = |at: [i64; 2]| tile.area().contains(&Area::new(at[0], at[1], 1, 1));
    tile.sites().iter().filter(|site| here(site.at)).for_each(|site| show(site));
    for road in roads(tile) {
        [road.id.0, road.id.1].into_iter().filter_map(|id| world.site(id)).for_each(|site| show(&site));
    }
}

/// The roads of which the middle line touches a tile.
fn roads(tile: &Tile) -> impl Iterator<Item = &Road> {
    tile.roads().iter().map(|road| &**road).filter(|road| road.touches(&tile.area()))
}

fn site_id(SiteId { i, j }: SiteId) -> String {
    format!("s:{i}:{j}")
}

fn road_id(road: &Road) -> String {
    let (from, to) = road.id;
    format!("w:{}:{}:{}:{}", from.i, from.j, to.i, to.j)
}

/// Metres east and north of a place in 1/256 vertex.
fn metres_of_fixed(at: [i64; 2], spacing_m: f64) -> [f64; 3] {
    metres(at.map(|at| at as f64 / FIXED as f64), spacing_m)
}

fn of_site(site: &Site, spacing_m: f64) -> Feature {
    let class = match site.class {
        SiteClass::Hamlet => "hamlet",
        SiteClass::Village => "village",
        SiteClass::Town => "town",
    };
    let values = vec![
        text(site_id(site.id)),
        text(&site.name),
        text(class),
        Value::Integer(i64::from(site.population)),
        Value::Real(site.height_m as f64),
    ];
    Feature { values, lines: vec![vec![metres(site.at.map(|at| at as f64), spacing_m)]] }
}

fn of_road(road: &Road, spacing_m: f64) -> Feature {
    let class = match road.class {
        RoadClass::Track => "track",
        RoadClass::Road => "road",
        RoadClass::Highway => "highway",
    };
    let place = |point: &RoadPoint| {
        let [east, north, _] = metres_of_fixed(point.at, spacing_m);
        [east, north, point.level_m as f64]
    };
    let line: Vec<[f64; 3]> = road.outline(spacing_m).iter().map(place).collect();
    let values = vec![
        text(road_id(road)),
        text(class),
        text(site_id(road.id.0)),
        text(site_id(road.id.1)),
        Value::Real(road.max_grade),
        Value::Real(road.width_m),
        Value::Real(length_m(&line)),
    ];
    Feature { values, lines: vec![line] }
}

/// Shows the crossings of a road.
fn visit_crossings(road: &Road, spacing_m: f64, visit: &mut Visit<'_>) {
    for (number, crossing) in road.crossings().iter().enumerate() {
        // Numbers of a road sort as text.
        let id = format!("x{}:{number:03}", &road_id(road)[1..]);
        visit(id.clone().into(), &|| of_crossing(&id, road, crossing, spacing_m));
    }
}

fn of_crossing(id: &str, road: &Road, crossing: &Crossing, spacing_m: f64) -> Feature {
    let kind = match crossing.kind {
        RoadKind::Ground => unreachable!("what crosses something is not on the ground"),
        RoadKind::Bridge => "bridge",
        RoadKind::Ford => "ford",
        RoadKind::Tunnel => "tunnel",
    };
    let (first, last) = crossing.points;
    let line: Vec<[f64; 3]> =
        road.points[first..=last].iter().map(|point| metres_of_fixed(point.at, spacing_m)).collect();
    let values = vec![text(id), text(kind), text(road_id(road)), Value::Real(length_m(&line))];
    Feature { values, lines: vec![vec![metres_of_fixed(crossing.at, spacing_m)]] }
}

// ---------------------------------------------------------------------------------------------------------------------
// Worlds of noise, whose rivers and roads agents make.

const PATH_COLUMNS: &[Column] = &[
    column("owner_x", Kind::Integer),
    column("owner_y", Kind::Integer),
    column("ending", Kind::Text),
    optional("joins_x", Kind::Integer),
    optional("joins_y", Kind::Integer),
    column("length_m", Kind::Real),
    column("width_start_m", Kind::Real32),
    column("width_end_m", Kind::Real32),
    column("floor_start_m", Kind::Real32),
    column("floor_end_m", Kind::Real32),
];

/// The layers of worlds of noise.
pub(crate) const AGENTS: &[Layer] = &[
    Layer {
        name: "rivers",
        about: "rivers, from source to end; metres",
        shape: Shape::Line,
        columns: PATH_COLUMNS,
        visit: |world, tile, visit| visit_paths(world, tile, WayKind::River, visit),
    },
    Layer {
        name: "roads",
        about: "roads, from the middle of the tile that owns each; metres",
        shape: Shape::Line,
        columns: PATH_COLUMNS,
        visit: |world, tile, visit| visit_paths(world, tile, WayKind::Road, visit),
    },
];

fn visit_paths(world: &World, tile: &Tile, kind: WayKind, visit: &mut Visit<'_>) {
    // A tile has all paths that may touch its pad too.
    let touching = tile.paths().iter().filter(|path| path.way.kind() == kind && path.way.touches(&tile.area()));
    for path in touching {
        visit(path_key(path.owner), &|| of_path(path, world.spacing_m()));
    }
}

/// The key of the path that a tile owns: bytes in the order of the tiles' numbers.
pub(crate) fn path_key(owner: TileId) -> Vec<u8> {
    [owner.x, owner.y].map(|number| (number as u64 ^ (1 << 63)).to_be_bytes()).concat()
}

/// A path as a row.
pub(crate) fn of_path(path: &Path, spacing_m: f64) -> Feature {
    let (points, origin) = (path.way.points(), path.way.origin());
    let vertices = |east: f32, south: f32| [origin.0 as f64 + east as f64, origin.1 as f64 + south as f64];
    let mut line: Vec<[f64; 3]> =
        points.iter().map(|point| metres(vertices(point.east, point.south), spacing_m)).collect();
    let length_m = length_m(&line);
    // A line has two points in every format, and a way may be one place.
    if line.len() == 1 {
        line.push(line[0]);
    }
    let (first, last) = (points[0], points[points.len() - 1]);
    let (ending, joins) = match path.ending {
        PathEnding::Sea => ("sea", None),
        PathEnding::River(other) => ("river", Some(other)),
        PathEnding::Pond => ("pond", None),
        PathEnding::Nothing => ("nothing", None),
    };
    let number = |number: Option<i64>| number.map_or(Value::Null, Value::Integer);
    let values = vec![
        Value::Integer(path.owner.x),
        Value::Integer(path.owner.y),
        text(ending),
        number(joins.map(|tile| tile.x)),
        number(joins.map(|tile| tile.y)),
        Value::Real(length_m),
        Value::Real((2.0 * first.half_width_m) as f64),
        Value::Real((2.0 * last.half_width_m) as f64),
        Value::Real(first.floor_m as f64),
        Value::Real(last.floor_m as f64),
    ];
    Feature { values, lines: vec![line] }
}
