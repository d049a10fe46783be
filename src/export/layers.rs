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
use crate::area::TileId;
use crate::fluvial::point::{GRAINS, Point};
use crate::fluvial::rivers::{River, RiverEnding};
use crate::fluvial::trunk::NodeId;
use crate::tile::Tile;
use crate::vectors::coast::Coast;
use crate::vectors::lakes::Lake;
use crate::vectors::peaks::Peak;
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

/// The name that a feature has on a map, by its layer and id; none yet.
fn name(_layer: &str, _id: &str) -> Value {
    Value::Null
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
                visit(river.id.to_string().into(), &|| of_river(&river, world.spacing_m()));
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
                visit(lake_id(lake.id).into(), &|| of_lake(&lake, world.spacing_m()));
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
                visit(peak_id(&peak).into(), &|| of_peak(&peak, world.spacing_m()));
            }
        },
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

fn of_river(river: &River, spacing_m: f64) -> Feature {
    let vertices = |at: Point| [at.x, at.y].map(|grains| grains as f64 / GRAINS as f64);
    let line: Vec<[f64; 3]> = river
        .line
        .iter()
        .map(|point| {
            let [east, north, _] = metres(vertices(point.at), spacing_m);
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
    let id = river.id.to_string();
    let values = vec![
        text(&id),
        name("rivers", &id),
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

fn of_lake(lake: &Lake, spacing_m: f64) -> Feature {
    let id = lake_id(lake.id);
    let values = vec![
        text(&id),
        name("lakes", &id),
        Value::Real(lake.level_m),
        Value::Real(lake.area_m2),
        optional_text(lake.outlet),
    ];
    let ring = |ring: &Vec<[f64; 2]>| ring.iter().map(|point| metres(*point, spacing_m)).collect();
    Feature { values, lines: lake.rings.iter().map(ring).collect() }
}

fn of_coast(coast: &Coast, spacing_m: f64) -> Feature {
    let line: Vec<[f64; 3]> = coast.line.iter().map(|point| metres(*point, spacing_m)).collect();
    Feature { values: vec![text(coast_id(coast)), Value::Real(length_m(&line))], lines: vec![line] }
}

fn of_peak(peak: &Peak, spacing_m: f64) -> Feature {
    let id = peak_id(peak);
    let point = metres(peak.at.map(|at| at as f64), spacing_m);
    Feature { values: vec![text(&id), name("peaks", &id), Value::Real(peak.height_m as f64)], lines: vec![vec![point]] }
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
