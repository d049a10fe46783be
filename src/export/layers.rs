//! The layers of the vector exports: their columns, and how a tile's features become rows.
//!
//! Coordinates are metres in the plane of the world: east is x, north is y, so y is the negative of the lattice's
//! south and a map shows north up. No coordinate reference system of the Earth applies. A feature is whole, even where
//! it leaves the region, and once, however many tiles it crosses.
//!
//! A new layer is a [`Layer`] here and a place in [`FLUVIAL`] or [`AGENTS`]; both formats have it then.

use rusqlite::types::Value;

use crate::area::{Area, TileId};
use crate::fluvial::point::GRAINS;
use crate::lines::{FIXED, Line, LineClass, LineEnd, LineId, LineKind, LinePoint, NodeId, RoadClass, Structure};
use crate::places::site::{Site, SiteClass};
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
        visit: |_, tile, visit| {
            for river in lines(tile, LineKind::River) {
                visit(river.id.to_string().into(), &|| of_river(river));
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
            for road in lines(tile, LineKind::Road) {
                visit(road.id.to_string().into(), &|| of_road(road));
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
        visit: |_, tile, visit| lines(tile, LineKind::Road).for_each(|road| visit_crossings(road, visit)),
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

/// The middle of a line in metres, with the levels of its points.
fn line_m<'a>(line: &Line, points: impl IntoIterator<Item = &'a LinePoint>) -> Vec<[f64; 3]> {
    let place = |point: &LinePoint| {
        let [east, north, _] = metres(line.place_from([0, 0], point), line.spacing_m);
        [east, north, point.level_m]
    };
    points.into_iter().map(place).collect()
}

fn of_river(river: &Line) -> Feature {
    let line = line_m(river, &river.points);
    let (start, end) = (river.points[0], river.points[river.points.len() - 1]);
    let (ending, joins) = match river.end {
        LineEnd::Line(other) => ("river", Some(other.to_string())),
        LineEnd::Lake(node) => ("lake", Some(lake_id(node))),
        LineEnd::Sea => ("sea", None),
        _ => ("sink", None),
    };
    let order = if let LineClass::Order(order) = river.class { i64::from(order) } else { 0 };
    let values = vec![
        text(river.id),
        optional_text(river.name.as_ref()),
        text(river.course),
        Value::Integer(order),
        Value::Real(length_m(&line)),
        Value::Real(2.0 * start.half_width_m),
        Value::Real(2.0 * end.half_width_m),
        Value::Real(start.discharge_m3s),
        Value::Real(end.discharge_m3s),
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
        optional_text(world.names().map(|names| names.lake(vertex_of_node(world, 0, x, y), &[x, y]))),
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
        optional_text(world.names().map(|names| names.peak(peak.at, &[peak.id.0, peak.id.1]))),
        Value::Real(peak.height_m as f64),
    ];
    Feature { values, lines: vec![vec![metres(peak.at.map(|at| at as f64), world.spacing_m())]] }
}

/// Shows the settlements of a tile, and those elsewhere that its roads end at.
fn visit_sites(world: &World, tile: &Tile, visit: &mut Visit<'_>) {
    let mut show = |site: &Site| visit(site.id.to_string().into(), &|| of_site(site, world.spacing_m()));
    let here = |at: [i64; 2]| tile.area().contains(&Area::new(at[0], at[1], 1, 1));
    tile.sites().iter().filter(|site| here(site.at)).for_each(|site| show(site));
    for road in lines(tile, LineKind::Road) {
        let LineId::Road { from, to } = road.id else { continue };
        [from, to].into_iter().filter_map(|id| world.site(id)).for_each(|site| show(&site));
    }
}

/// The lines of a kind that touch a tile.
fn lines(tile: &Tile, kind: LineKind) -> impl Iterator<Item = &Line> {
    tile.lines().iter().map(AsRef::as_ref).filter(move |line| line.kind == kind && line.touches(&tile.area()))
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
        text(site.id),
        text(&site.name),
        text(class),
        Value::Integer(i64::from(site.population)),
        Value::Real(site.height_m as f64),
    ];
    Feature { values, lines: vec![vec![metres(site.at.map(|at| at as f64), spacing_m)]] }
}

fn of_road(road: &Line) -> Feature {
    let class = match road.class {
        LineClass::Road(RoadClass::Track) => "track",
        LineClass::Road(RoadClass::Highway) => "highway",
        _ => "road",
    };
    let line = line_m(road, &road.outline());
    let (from, to) =
        if let LineId::Road { from, to } = road.id { (text(from), text(to)) } else { (Value::Null, Value::Null) };
    let values = vec![
        text(road.id),
        text(class),
        from,
        to,
        Value::Real(road.max_grade()),
        Value::Real(2.0 * road.points[0].half_width_m),
        Value::Real(length_m(&line)),
    ];
    Feature { values, lines: vec![line] }
}

/// Shows the crossings of a road.
fn visit_crossings(road: &Line, visit: &mut Visit<'_>) {
    for (number, structure) in road.structures.iter().enumerate() {
        // Numbers of a road sort as text.
        let id = format!("x{}:{number:03}", &road.id.to_string()[1..]);
        visit(id.clone().into(), &|| of_crossing(&id, road, structure));
    }
}

fn of_crossing(id: &str, road: &Line, structure: &Structure) -> Feature {
    let line = line_m(road, &road.points[structure.first..=structure.last]);
    let values = vec![text(id), text(structure.kind.name()), text(road.id), Value::Real(length_m(&line))];
    Feature { values, lines: vec![vec![metres_of_fixed(structure.middle(road), road.spacing_m)]] }
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
        visit: |_, tile, visit| visit_paths(tile, LineKind::River, visit),
    },
    Layer {
        name: "roads",
        about: "roads, from the middle of the tile that owns each; metres",
        shape: Shape::Line,
        columns: PATH_COLUMNS,
        visit: |_, tile, visit| visit_paths(tile, LineKind::Road, visit),
    },
];

fn visit_paths(tile: &Tile, kind: LineKind, visit: &mut Visit<'_>) {
    for line in lines(tile, kind) {
        visit(path_key(owner(line.id)), &|| of_path(line));
    }
}

/// The tile that an agent's line belongs to.
pub(crate) fn owner(id: LineId) -> TileId {
    match id {
        LineId::Agent { owner, .. } => owner,
        LineId::River { .. } | LineId::Road { .. } => unreachable!("worlds of noise have lines of agents only"),
    }
}

/// The key of the line that a tile owns: bytes in the order of the tiles' numbers.
pub(crate) fn path_key(owner: TileId) -> Vec<u8> {
    [owner.x, owner.y].map(|number| (number as u64 ^ (1 << 63)).to_be_bytes()).concat()
}

/// An agent's line as a row.
pub(crate) fn of_path(path: &Line) -> Feature {
    let mut line: Vec<[f64; 3]> = line_m(path, &path.points);
    line.iter_mut().for_each(|place| place[2] = 0.0);
    let length_m = length_m(&line);
    // A line has two points in every format, and a pool may be one place.
    if line.len() == 1 {
        line.push(line[0]);
    }
    let (first, last) = (path.points[0], path.points[path.points.len() - 1]);
    let (ending, joins) = match path.end {
        LineEnd::Sea => ("sea", None),
        LineEnd::Line(other) => ("river", Some(owner(other))),
        LineEnd::Pond => ("pond", None),
        _ => ("nothing", None),
    };
    let number = |number: Option<i64>| number.map_or(Value::Null, Value::Integer);
    let values = vec![
        Value::Integer(owner(path.id).x),
        Value::Integer(owner(path.id).y),
        text(ending),
        number(joins.map(|tile| tile.x)),
        number(joins.map(|tile| tile.y)),
        Value::Real(length_m),
        Value::Real(2.0 * first.half_width_m),
        Value::Real(2.0 * last.half_width_m),
        Value::Real(first.floor_m),
        Value::Real(last.floor_m),
    ];
    Feature { values, lines: vec![line] }
}
