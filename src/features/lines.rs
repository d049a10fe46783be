//! Rivers, roads and their crossings: the features that are lines, or lie on them.

use std::sync::Arc;

use crate::agents::paths::{Path, PathEnding};
use crate::agents::way::WayKind;
use crate::area::{Area, TileId};
use crate::features::layer::{Column, Kind, Layer, Shape, flat, point};
use crate::features::names::{lake_id, name, site_id, vertex_of_node};
use crate::features::plane::{length_m, metres};
use crate::fluvial::point::GRAINS;
use crate::fluvial::rivers::{River, RiverEnding, RiverId};
use crate::places::land::FIXED;
use crate::places::names;
use crate::places::road::{Crossing, Road, RoadClass, RoadKind};
use crate::world::World;

/// A river of a fluvial world, from source to end. Pairs are at its start and at its end.
#[derive(Clone, Debug, PartialEq)]
pub struct RiverFeature {
    /// The channel in which it begins, and its number there: its name in the world.
    pub id: RiverId,
    /// The name on a map of all parts of its course; none in a world without places.
    pub name: Option<String>,
    /// `r`, and the topmost channel of its course, which the parts between lakes have in common.
    pub course: String,
    /// Strahler's order at its end.
    pub order: u32,
    /// Metres from end to end, seen from above.
    pub length_m: f64,
    /// Widths in metres.
    pub width_m: [f64; 2],
    /// Discharges in cubic metres a second.
    pub discharge_m3s: [f64; 2],
    /// Heights of its surface in metres.
    pub level_m: [f64; 2],
    /// What it ends in.
    pub ending: RiverEnding,
    /// Metres east, north and up to the water's surface.
    pub line: Vec<[f64; 3]>,
}

/// All rivers of fluvial worlds.
pub static RIVERS: Layer<Arc<River>, RiverFeature> = Layer {
    name: "rivers",
    about: "rivers, from source to end, with the height of their surface; metres and m3/s",
    shape: Shape::LineZ,
    columns: &[
        Column::new("id", Kind::Text, |river| river.id.to_string().into()),
        Column::optional("name", Kind::Text, |river| river.name.clone().into()),
        Column::new("course", Kind::Text, |river| river.course.clone().into()),
        Column::keyed("strahler", "order", Kind::Integer, |river| i64::from(river.order).into()),
        Column::new("length_m", Kind::Real, |river| river.length_m.into()),
        Column::keyed("width_start_m", "width_m", Kind::Real, |river| river.width_m[0].into()),
        Column::keyed("width_end_m", "width_m", Kind::Real, |river| river.width_m[1].into()),
        Column::keyed("discharge_start_m3s", "discharge_m3s", Kind::Real, |river| river.discharge_m3s[0].into()),
        Column::keyed("discharge_end_m3s", "discharge_m3s", Kind::Real, |river| river.discharge_m3s[1].into()),
        Column::keyed("level_start_m", "level_m", Kind::Real, |river| river.level_m[0].into()),
        Column::keyed("level_end_m", "level_m", Kind::Real, |river| river.level_m[1].into()),
        Column::new("ending", Kind::Text, |river| river_ending(river.ending).0.into()),
        Column::optional("joins", Kind::Text, |river| river_ending(river.ending).1.into()),
    ],
    sources: World::rivers,
    key: |river| river.id.to_string().into(),
    feature: of_river,
    lines: |river| vec![river.line],
};

/// What a river ends in, and the id of that.
fn river_ending(ending: RiverEnding) -> (&'static str, Option<String>) {
    match ending {
        RiverEnding::River(other) => ("river", Some(other.to_string())),
        RiverEnding::Lake(node) => ("lake", Some(lake_id(node))),
        RiverEnding::Sea => ("sea", None),
        RiverEnding::Sink => ("sink", None),
    }
}

fn of_river(world: &World, river: &Arc<River>) -> RiverFeature {
    let place = |axis: i64| axis as f64 / GRAINS as f64;
    let points = river.line.iter().map(|point| {
        let [east, north] = metres([place(point.at.x), place(point.at.y)], world.spacing_m());
        [east, north, point.level_m]
    });
    let line: Vec<[f64; 3]> = points.collect();
    let (level, x, y) = river.course;
    RiverFeature {
        id: river.id,
        name: name(world, names::river, vertex_of_node(world, level, x, y), &[i64::from(level), x, y]),
        course: format!("r{level}:{x}:{y}"),
        order: river.order,
        length_m: length_m(&line),
        width_m: river.width_m,
        discharge_m3s: river.discharge_m3s,
        level_m: [line[0][2], line[line.len() - 1][2]],
        ending: river.ending,
        line,
    }
}

/// A road from one settlement to another.
#[derive(Clone, Debug, PartialEq)]
pub struct RoadFeature {
    /// Its name in the world: `w`, and the cells of both settlements.
    pub id: String,
    /// How well it is built.
    pub class: RoadClass,
    /// The ids of the settlements that it joins.
    pub sites: [String; 2],
    /// The steepest grade anywhere on it, metres up a metre ahead.
    pub max_grade: f64,
    /// Metres from edge to edge.
    pub width_m: f64,
    /// Metres from end to end of the line, seen from above.
    pub length_m: f64,
    /// Metres east, north and up to the road's surface; without points that a straight line shows as well.
    pub line: Vec<[f64; 3]>,
}

/// All roads between settlements.
pub static ROADS: Layer<Arc<Road>, RoadFeature> = Layer {
    name: "roads",
    about: "roads from one settlement to another, with the height of their surface; metres",
    shape: Shape::LineZ,
    columns: &[
        Column::new("id", Kind::Text, |road| road.id.clone().into()),
        Column::new("class", Kind::Text, |road| class_name(road.class).into()),
        // Both keys are words of SQL.
        Column::keyed("from_site", "from", Kind::Text, |road| road.sites[0].clone().into()),
        Column::keyed("to_site", "to", Kind::Text, |road| road.sites[1].clone().into()),
        Column::new("max_grade", Kind::Real, |road| road.max_grade.into()),
        Column::new("width_m", Kind::Real, |road| road.width_m.into()),
        Column::new("length_m", Kind::Real, |road| road.length_m.into()),
    ],
    sources: roads_through,
    key: |road| road_id(road).into(),
    feature: of_road,
    lines: |road| vec![road.line],
};

/// The roads of which the middle line touches an area.
pub(super) fn roads_through(world: &World, area: &Area) -> Vec<Arc<Road>> {
    let mut roads = world.roads(area);
    roads.retain(|road| road.touches(area));
    roads
}

fn road_id(road: &Road) -> String {
    let (from, to) = road.id;
    format!("w:{}:{}:{}:{}", from.i, from.j, to.i, to.j)
}

fn class_name(class: RoadClass) -> &'static str {
    match class {
        RoadClass::Track => "track",
        RoadClass::Road => "road",
        RoadClass::Highway => "highway",
    }
}

/// Metres east and north of a place in 1/256 vertex.
fn metres_of_fixed(at: [i64; 2], spacing_m: f64) -> [f64; 2] {
    metres(at.map(|at| at as f64 / FIXED as f64), spacing_m)
}

fn of_road(world: &World, road: &Arc<Road>) -> RoadFeature {
    let spacing_m = world.spacing_m();
    let points = road.outline(spacing_m).into_iter().map(|point| {
        let [east, north] = metres_of_fixed(point.at, spacing_m);
        [east, north, point.level_m as f64]
    });
    let line: Vec<[f64; 3]> = points.collect();
    RoadFeature {
        id: road_id(road),
        class: road.class,
        sites: [site_id(road.id.0), site_id(road.id.1)],
        max_grade: road.max_grade,
        width_m: road.width_m,
        length_m: length_m(&line),
        line,
    }
}

/// A bridge, a ford or a tunnel of a road.
#[derive(Clone, Debug, PartialEq)]
pub struct CrossingFeature {
    /// Its name in the world: `x`, the numbers of its road, and its own there.
    pub id: String,
    /// Which of the three it is.
    pub kind: RoadKind,
    /// The id of its road.
    pub road: String,
    /// Metres from end to end, seen from above.
    pub length_m: f64,
    /// Metres east and north of its middle.
    pub at: [f64; 2],
}

/// All crossings of the roads that touch an area.
pub static CROSSINGS: Layer<(Arc<Road>, usize, Crossing), CrossingFeature> = Layer {
    name: "crossings",
    about: "bridges, fords and tunnels of the roads; metres",
    shape: Shape::Point,
    columns: &[
        Column::new("id", Kind::Text, |crossing| crossing.id.clone().into()),
        Column::new("kind", Kind::Text, |crossing| kind_name(crossing.kind).into()),
        Column::new("road", Kind::Text, |crossing| crossing.road.clone().into()),
        Column::new("length_m", Kind::Real, |crossing| crossing.length_m.into()),
    ],
    sources: crossings_of_roads,
    key: |crossing| crossing_id(crossing).into(),
    feature: of_crossing,
    lines: |crossing| point(crossing.at),
};

fn crossings_of_roads(world: &World, area: &Area) -> Vec<(Arc<Road>, usize, Crossing)> {
    let crossings = |road: Arc<Road>| {
        let crossings = road.crossings().into_iter().enumerate();
        crossings.map(|(number, crossing)| (Arc::clone(&road), number, crossing)).collect::<Vec<_>>()
    };
    roads_through(world, area).into_iter().flat_map(crossings).collect()
}

fn crossing_id((road, number, _): &(Arc<Road>, usize, Crossing)) -> String {
    // Numbers of a road sort as text.
    format!("x{}:{number:03}", &road_id(road)[1..])
}

fn kind_name(kind: RoadKind) -> &'static str {
    match kind {
        RoadKind::Ground => unreachable!("what crosses something is not on the ground"),
        RoadKind::Bridge => "bridge",
        RoadKind::Ford => "ford",
        RoadKind::Tunnel => "tunnel",
    }
}

fn of_crossing(world: &World, source: &(Arc<Road>, usize, Crossing)) -> CrossingFeature {
    let (road, _, crossing) = source;
    let (first, last) = crossing.points;
    let points = road.points[first..=last].iter().map(|point| metres_of_fixed(point.at, world.spacing_m()));
    CrossingFeature {
        id: crossing_id(source),
        kind: crossing.kind,
        road: road_id(road),
        length_m: length_m(&points.collect::<Vec<_>>()),
        at: metres_of_fixed(crossing.at, world.spacing_m()),
    }
}

/// A river or a road of an agent, whole. Pairs are at its start and at its end.
#[derive(Clone, Debug, PartialEq)]
pub struct PathFeature {
    /// The tile that its agent started from: its name in the world, among its kind.
    pub owner: TileId,
    /// How it ends.
    pub ending: PathEnding,
    /// Metres from end to end.
    pub length_m: f64,
    /// Widths in metres.
    pub width_m: [f32; 2],
    /// Heights of its floor in metres.
    pub floor_m: [f32; 2],
    /// Metres east and north; at least two points, of a path that is one place the same.
    pub line: Vec<[f64; 2]>,
}

const PATH_COLUMNS: &[Column<PathFeature>] = &[
    Column::new("owner_x", Kind::Integer, |path| path.owner.x.into()),
    Column::new("owner_y", Kind::Integer, |path| path.owner.y.into()),
    Column::new("ending", Kind::Text, |path| path_ending(path.ending).0.into()),
    Column::optional("joins_x", Kind::Integer, |path| path_ending(path.ending).1.map(|tile| tile.x).into()),
    Column::optional("joins_y", Kind::Integer, |path| path_ending(path.ending).1.map(|tile| tile.y).into()),
    Column::new("length_m", Kind::Real, |path| path.length_m.into()),
    Column::new("width_start_m", Kind::Real32, |path| path.width_m[0].into()),
    Column::new("width_end_m", Kind::Real32, |path| path.width_m[1].into()),
    Column::new("floor_start_m", Kind::Real32, |path| path.floor_m[0].into()),
    Column::new("floor_end_m", Kind::Real32, |path| path.floor_m[1].into()),
];

/// All rivers of agents.
pub static AGENT_RIVERS: Layer<Arc<Path>, PathFeature> = Layer {
    name: "rivers",
    about: "rivers, from source to end; metres",
    shape: Shape::Line,
    columns: PATH_COLUMNS,
    sources: |world, area| paths_through(world, area, WayKind::River),
    key: |path| path_key(path.owner),
    feature: of_path,
    lines: |path| vec![flat(&path.line)],
};

/// All roads of agents.
pub static AGENT_ROADS: Layer<Arc<Path>, PathFeature> = Layer {
    name: "roads",
    about: "roads, from the middle of the tile that owns each; metres",
    sources: |world, area| paths_through(world, area, WayKind::Road),
    ..AGENT_RIVERS
};

fn paths_through(world: &World, area: &Area, kind: WayKind) -> Vec<Arc<Path>> {
    let mut paths = world.ways(area);
    paths.retain(|path| path.way.kind() == kind && path.way.touches(area));
    paths
}

/// The key of the path that a tile owns: bytes in the order of the tiles' numbers.
fn path_key(owner: TileId) -> Vec<u8> {
    [owner.x, owner.y].map(|number| (number as u64 ^ (1 << 63)).to_be_bytes()).concat()
}

/// How a path ends, and the tile that owns what it ends in.
fn path_ending(ending: PathEnding) -> (&'static str, Option<TileId>) {
    match ending {
        PathEnding::Sea => ("sea", None),
        PathEnding::River(other) => ("river", Some(other)),
        PathEnding::Pond => ("pond", None),
        PathEnding::Nothing => ("nothing", None),
    }
}

fn of_path(world: &World, path: &Arc<Path>) -> PathFeature {
    let (points, origin) = (path.way.points(), path.way.origin());
    let vertices = |east: f32, south: f32| [origin.0 as f64 + east as f64, origin.1 as f64 + south as f64];
    let places = points.iter().map(|point| metres(vertices(point.east, point.south), world.spacing_m()));
    let mut line: Vec<[f64; 2]> = places.collect();
    let length_m = length_m(&line);
    // A line has two points in every format, and a way may be one place.
    if line.len() == 1 {
        line.push(line[0]);
    }
    let ends = [points[0], points[points.len() - 1]];
    PathFeature {
        owner: path.owner,
        ending: path.ending,
        length_m,
        width_m: ends.map(|end| 2.0 * end.half_width_m),
        floor_m: ends.map(|end| end.floor_m),
        line,
    }
}
