//! Rivers, roads and their crossings: features that are lines or lie on lines.

use std::sync::Arc;

use crate::area::{Area, TileId};
use crate::clock::Clock;
use crate::features::layer::{Column, GeometryType, Layer, MakeRow, ValueKind, flat, point};
use crate::features::plane::{length_m, metres};
use crate::lines::{FIXED, Line, LineEnd, LineId, LineKind, LinePoint, Lines, RoadClass, SiteId, StructureKind};
use crate::stop::Stopped;
use crate::tile::Tile;
use crate::world::World;

/// A river of a fluvial world, from source to end. Pairs hold the values at the start and at the end.
#[derive(Clone, Debug, PartialEq)]
pub struct RiverFeature {
    /// Identifier, unique in the world.
    pub id: LineId,
    /// Name on maps, the same for all parts of the river's course; `None` in a world without places.
    pub name: Option<String>,
    /// Id of the first part of the course. Lakes cut a course into parts, which all have this id in common.
    pub course: LineId,
    /// Strahler order at the end.
    pub order: u32,
    /// Length in metres, seen from above.
    pub length_m: f64,
    /// Widths in metres.
    pub width_m: [f64; 2],
    /// Discharges in cubic metres a second.
    pub discharge_m3s: [f64; 2],
    /// Area in square metres that drains through the end.
    pub basin_m2: f64,
    /// Heights of the water surface in metres.
    pub level_m: [f64; 2],
    /// Object in which the river ends.
    pub ending: LineEnd,
    /// Points in metres east, north and up, at the water surface.
    pub line: Vec<[f64; 3]>,
}

/// The layer of all rivers in fluvial worlds.
pub static RIVERS: Layer<Arc<Line>, RiverFeature> = Layer {
    name: "rivers",
    about: "rivers, from source to end, with the height of their surface; metres and m3/s",
    shape: GeometryType::LineZ,
    columns: &[
        Column::new("id", ValueKind::Text, |river| river.id.to_string().into()),
        Column::optional("name", ValueKind::Text, |river| river.name.clone().into()),
        Column::new("course", ValueKind::Text, |river| river.course.to_string().into()),
        Column::keyed("strahler", "order", ValueKind::Integer, |river| i64::from(river.order).into()),
        Column::new("length_m", ValueKind::Real, |river| river.length_m.into()),
        Column::keyed("width_start_m", "width_m", ValueKind::Real, |river| river.width_m[0].into()),
        Column::keyed("width_end_m", "width_m", ValueKind::Real, |river| river.width_m[1].into()),
        Column::keyed("discharge_start_m3s", "discharge_m3s", ValueKind::Real, |river| river.discharge_m3s[0].into()),
        Column::keyed("discharge_end_m3s", "discharge_m3s", ValueKind::Real, |river| river.discharge_m3s[1].into()),
        Column::new("basin_km2", ValueKind::Real, |river| (river.basin_m2 / 1e6).into()),
        Column::keyed("level_start_m", "level_m", ValueKind::Real, |river| river.level_m[0].into()),
        Column::keyed("level_end_m", "level_m", ValueKind::Real, |river| river.level_m[1].into()),
        Column::new("ending", ValueKind::Text, |river| river.ending.name().into()),
        Column::optional("joins", ValueKind::Text, |river| river.ending.id().into()),
    ],
    sources: |world, area, clock| world.lines_through(LineKind::River, area, clock),
    key: |river| river.id.to_string().into(),
    feature: of_river,
    lines: |river| vec![river.line],
};

/// Converts points of a line to metres east, north and up, with the level of the water or road surface as height.
pub(super) fn line_m<'a>(line: &Line, points: impl IntoIterator<Item = &'a LinePoint>) -> Vec<[f64; 3]> {
    let place = |point: &LinePoint| {
        let [east, north] = metres(line.place_from([0, 0], point), line.spacing_m);
        [east, north, point.level_m]
    };
    points.into_iter().map(place).collect()
}

/// Returns a value of a line's first point and of its last.
fn ends<T>(line: &Line, value: impl Fn(&LinePoint) -> T) -> [T; 2] {
    [&line.points[0], &line.points[line.points.len() - 1]].map(value)
}

fn of_river(world: &World, river: &Arc<Line>, clock: &Clock) -> Result<RiverFeature, Stopped> {
    let line = line_m(river, &river.points);
    Ok(RiverFeature {
        id: river.id,
        name: river.name.clone(),
        course: river.course,
        order: world.relief().fluvial().map_or(Ok(0), |land| land.order(river, clock))?,
        length_m: length_m(&line),
        width_m: ends(river, |point| 2.0 * point.half_width_m),
        discharge_m3s: ends(river, |point| point.discharge_m3s),
        basin_m2: ends(river, |point| point.basin_m2)[1],
        level_m: ends(river, |point| point.level_m),
        ending: river.end,
        line,
    })
}

/// A road from one settlement to another: all of it, or the part that is left where it shares the way with other roads.
#[derive(Clone, Debug, PartialEq)]
pub struct RoadFeature {
    /// Identifier, unique in the world.
    pub id: LineId,
    /// Class of construction.
    pub class: RoadClass,
    /// Settlements at both ends, perhaps reached along other roads.
    pub sites: [SiteId; 2],
    /// Steepest grade on the road, in metres up a metre ahead.
    pub max_grade: f64,
    /// Width in metres.
    pub width_m: f64,
    /// Length in metres, seen from above.
    pub length_m: f64,
    /// Points in metres east, north and up, at the road surface. The line is simplified: points that a straight line
    /// shows as well are left out.
    pub line: Vec<[f64; 3]>,
}

/// The layer of all roads between settlements.
pub static ROADS: Layer<Arc<Line>, RoadFeature> = Layer {
    name: "roads",
    about: "roads that lead from one settlement to another, each drawn once, with the height of their surface; metres",
    shape: GeometryType::LineZ,
    columns: &[
        Column::new("id", ValueKind::Text, |road| road.id.to_string().into()),
        Column::new("class", ValueKind::Text, |road| road.class.name().into()),
        // Both keys are reserved words of SQL, so the columns have other names.
        Column::keyed("from_site", "from", ValueKind::Text, |road| road.sites[0].to_string().into()),
        Column::keyed("to_site", "to", ValueKind::Text, |road| road.sites[1].to_string().into()),
        Column::new("max_grade", ValueKind::Real, |road| road.max_grade.into()),
        Column::new("width_m", ValueKind::Real, |road| road.width_m.into()),
        Column::new("length_m", ValueKind::Real, |road| road.length_m.into()),
    ],
    sources: roads_through,
    key: |road| road.id.to_string().into(),
    feature: |_, road, _| Ok(of_road(road)),
    lines: |road| vec![road.line],
};

/// Returns the roads whose centreline touches an area.
pub(super) fn roads_through(world: &World, area: &Area, clock: &Clock) -> Result<Lines, Stopped> {
    world.lines_through(LineKind::Road, area, clock)
}

fn of_road(road: &Line) -> RoadFeature {
    let (LineId::Road { from, to, .. }, Some(class)) = (road.id, road.class) else {
        unreachable!("roads of fluvial worlds join settlements")
    };
    let line = line_m(road, &road.outline());
    RoadFeature {
        id: road.id,
        class,
        sites: [from, to],
        max_grade: road.max_grade(),
        // A road has the same width everywhere.
        width_m: 2.0 * road.points[0].half_width_m,
        length_m: length_m(&line),
        line,
    }
}

/// A bridge, a ford or a tunnel of a road.
#[derive(Clone, Debug, PartialEq)]
pub struct CrossingFeature {
    /// Identifier, unique in the world: `x`, the numbers of the road's id, and the number of the structure on that
    /// road.
    pub id: String,
    /// Type of structure: bridge, ford or tunnel.
    pub kind: StructureKind,
    /// Road that crosses.
    pub road: LineId,
    /// Length in metres, seen from above.
    pub length_m: f64,
    /// Midpoint in metres east and north.
    pub at: [f64; 2],
}

/// The layer of all crossings on roads that touch an area. Its objects are pairs of a road and the number of a
/// structure on it.
pub static CROSSINGS: Layer<(Arc<Line>, usize), CrossingFeature> = Layer {
    name: "crossings",
    about: "bridges, fords and tunnels of the roads; metres",
    shape: GeometryType::Point,
    columns: &[
        Column::new("id", ValueKind::Text, |crossing| crossing.id.clone().into()),
        Column::new("kind", ValueKind::Text, |crossing| crossing.kind.name().into()),
        Column::new("road", ValueKind::Text, |crossing| crossing.road.to_string().into()),
        Column::new("length_m", ValueKind::Real, |crossing| crossing.length_m.into()),
    ],
    sources: crossings_of_roads,
    key: |crossing| crossing_id(crossing).into(),
    feature: |_, crossing, _| Ok(of_crossing(crossing)),
    lines: |crossing| point(crossing.at),
};

fn crossings_of_roads(world: &World, area: &Area, clock: &Clock) -> Result<Vec<(Arc<Line>, usize)>, Stopped> {
    let crossings = |road: Arc<Line>| (0..road.structures.len()).map(move |number| (Arc::clone(&road), number));
    Ok(roads_through(world, area, clock)?.into_iter().flat_map(crossings).collect())
}

fn crossing_id((road, number): &(Arc<Line>, usize)) -> String {
    // Padded with zeros, so that ids of one road sort by number.
    format!("x{}:{number:03}", &road.id.to_string()[1..])
}

fn of_crossing(source: &(Arc<Line>, usize)) -> CrossingFeature {
    let (road, number) = source;
    let structure = &road.structures[*number];
    let middle = structure.middle(road).map(|at| at as f64 / FIXED as f64);
    CrossingFeature {
        id: crossing_id(source),
        kind: structure.kind,
        road: road.id,
        length_m: length_m(&line_m(road, &road.points[structure.first..=structure.last])),
        at: metres(middle, road.spacing_m),
    }
}

/// A river or a road of an agent, uncut. Pairs hold the values at the start and at the end.
#[derive(Clone, Debug, PartialEq)]
pub struct PathFeature {
    /// Tile in which the agent started: unique among the rivers, and among the roads.
    pub owner: TileId,
    /// Object in which the line ends.
    pub ending: LineEnd,
    /// Length in metres.
    pub length_m: f64,
    /// Widths in metres.
    pub width_m: [f32; 2],
    /// Heights of the bed in metres.
    pub floor_m: [f32; 2],
    /// Points in metres east and north; at least two, even if the path is a single place.
    pub line: Vec<[f64; 2]>,
}

const PATH_COLUMNS: &[Column<PathFeature>] = &[
    Column::new("owner_x", ValueKind::Integer, |path| path.owner.x.into()),
    Column::new("owner_y", ValueKind::Integer, |path| path.owner.y.into()),
    Column::new("ending", ValueKind::Text, |path| path.ending.name().into()),
    Column::optional("joins_x", ValueKind::Integer, |path| joined(path.ending).map(|tile| tile.x).into()),
    Column::optional("joins_y", ValueKind::Integer, |path| joined(path.ending).map(|tile| tile.y).into()),
    Column::new("length_m", ValueKind::Real, |path| path.length_m.into()),
    Column::new("width_start_m", ValueKind::Real32, |path| path.width_m[0].into()),
    Column::new("width_end_m", ValueKind::Real32, |path| path.width_m[1].into()),
    Column::new("floor_start_m", ValueKind::Real32, |path| path.floor_m[0].into()),
    Column::new("floor_end_m", ValueKind::Real32, |path| path.floor_m[1].into()),
];

/// The layer of all rivers of agents.
pub static AGENT_RIVERS: Layer<Arc<Line>, PathFeature> = Layer {
    name: "rivers",
    about: "rivers, from source to end; metres",
    shape: GeometryType::Line,
    columns: PATH_COLUMNS,
    sources: |world, area, clock| world.lines_through(LineKind::River, area, clock),
    key: |path| path_key(owner(path.id)),
    feature: |_, path, _| Ok(of_path(path)),
    lines: |path| vec![flat(&path.line)],
};

/// The layer of all roads of agents.
pub static AGENT_ROADS: Layer<Arc<Line>, PathFeature> = Layer {
    name: "roads",
    about: "roads, from the middle of the tile that owns each; metres",
    sources: |world, area, clock| world.lines_through(LineKind::Road, area, clock),
    ..AGENT_RIVERS
};

/// Visits the rivers and roads of a walker's tile as features of the [layers](super::layers) of its world, each with
/// the number of its layer. A tile of a walker owns the part of an agent's way that lies in it, so each feature ends at
/// the tile's edges.
///
/// # Errors
/// When `clock` stops the work, or `visit` fails.
pub fn visit_walked(
    world: &World,
    tile: &Tile,
    clock: &Clock,
    mut visit: impl FnMut(usize, Vec<u8>, &MakeRow<'_>) -> Result<(), Stopped>,
) -> Result<(), Stopped> {
    let layers = [(&AGENT_RIVERS, LineKind::River), (&AGENT_ROADS, LineKind::Road)];
    for (number, (layer, kind)) in layers.into_iter().enumerate() {
        for line in tile.lines().iter().filter(|line| line.kind == kind) {
            layer.show(world, line, clock, &mut |key, row| visit(number, key, row))?;
        }
    }
    Ok(())
}

/// Returns the tile that owns an agent's line.
fn owner(id: LineId) -> TileId {
    match id {
        LineId::Agent { owner, .. } => owner,
        LineId::River { .. } | LineId::Road { .. } => unreachable!("worlds of noise have lines of agents only"),
    }
}

/// Returns the sort key of the path of a tile: bytes that sort in the order of the tile coordinates.
fn path_key(owner: TileId) -> Vec<u8> {
    // Big-endian with the sign bit flipped, so that bytes sort like the signed numbers.
    [owner.x, owner.y].map(|number| (number as u64 ^ (1 << 63)).to_be_bytes()).concat()
}

/// Returns the owner of the line in which a path ends, if it ends in a line.
fn joined(end: LineEnd) -> Option<TileId> {
    if let LineEnd::Line(other) = end { Some(owner(other)) } else { None }
}

fn of_path(path: &Line) -> PathFeature {
    let mut line: Vec<[f64; 2]> =
        line_m(path, &path.points).into_iter().map(|[east, north, _]| [east, north]).collect();
    let length_m = length_m(&line);
    // Every format wants two points per line, but the path of a pool may be a single place.
    if line.len() == 1 {
        line.push(line[0]);
    }
    PathFeature {
        owner: owner(path.id),
        ending: path.end,
        length_m,
        width_m: ends(path, |point| 2.0 * point.half_width_m as f32),
        floor_m: ends(path, |point| point.floor_m as f32),
        line,
    }
}
