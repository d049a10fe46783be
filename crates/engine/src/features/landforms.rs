//! Lakes, coasts and peaks as features.

use std::sync::Arc;

use crate::features::layer::{Column, GeometryType, Layer, ValueKind, flat, point};
use crate::features::plane::{length_m, metres};
use crate::fluvial::landforms::coast::Coast;
use crate::fluvial::landforms::lakes::Lake;
use crate::fluvial::landforms::peaks::Peak;
use crate::grain_point::GRAINS;
use crate::lines::{LakeId, Line, LineId};
use crate::world::World;

/// Kind of a lake without outlet in a dry land: brine on a level floor of salt.
pub const SALT_PAN: &str = "salt pan";

/// A lake.
#[derive(Clone, Debug, PartialEq)]
pub struct LakeFeature {
    /// Identifier, unique in the world: `l`, the network level of the channel in which the lake lies, and that
    /// channel's cell.
    pub id: String,
    /// Name on maps; `None` in a world without places.
    pub name: Option<String>,
    /// `lake`, or [`SALT_PAN`].
    pub kind: &'static str,
    /// Height of the water surface in metres.
    pub level_m: f64,
    /// Area within the shore in square metres, without islands.
    pub area_m2: f64,
    /// River that flows out of the lake, if there is one.
    pub outlet: Option<LineId>,
    /// Shoreline of the lake, anticlockwise, then those of its islands, clockwise: closed rings in metres east and
    /// north.
    pub rings: Vec<Vec<[f64; 2]>>,
}

/// The layer of all lakes.
pub static LAKES: Layer<Arc<Lake>, LakeFeature> = Layer {
    name: "lakes",
    about: "lakes with their islands; metres",
    shape: GeometryType::Polygon,
    columns: &[
        Column::new("id", ValueKind::Text, |lake| lake.id.clone().into()),
        Column::optional("name", ValueKind::Text, |lake| lake.name.clone().into()),
        Column::new("kind", ValueKind::Text, |lake| lake.kind.into()),
        Column::new("level_m", ValueKind::Real, |lake| lake.level_m.into()),
        Column::new("area_m2", ValueKind::Real, |lake| lake.area_m2.into()),
        Column::optional("outlet", ValueKind::Text, |lake| lake.outlet.map(|river| river.to_string()).into()),
    ],
    sources: World::lakes,
    key: |lake| lake.id.to_string().into(),
    feature: |world, lake, _| Ok(of_lake(world, lake)),
    lines: |lake| lake.rings.iter().map(|ring| flat(ring)).collect(),
};

fn of_lake(world: &World, lake: &Lake) -> LakeFeature {
    let ring = |ring: &Vec<[f64; 2]>| ring.iter().map(|point| metres(*point, world.spacing_m())).collect();
    LakeFeature {
        id: lake.id.to_string(),
        name: lake_name(world, lake.id),
        kind: if is_pan(world, lake.id) { SALT_PAN } else { "lake" },
        level_m: lake.level_m,
        area_m2: lake.area_m2,
        outlet: lake.outlet,
        rings: lake.rings.iter().map(ring).collect(),
    }
}

/// Returns the name that the lake with this id has, or would have if it existed; `None` in a world without places.
pub(crate) fn lake_name(world: &World, lake: LakeId) -> Option<String> {
    let LakeId((level, x, y)) = lake;
    let (at, id) = (first_vertex(world, level, [x, y]), [i64::from(level), x, y]);
    world.names().map(|names| if is_pan(world, lake) { names.pan(at, &id) } else { names.lake(at, &id) })
}

/// Tells whether a lake is a salt pan.
fn is_pan(world: &World, lake: LakeId) -> bool {
    world.relief().fluvial().is_some_and(|fluvial| fluvial.is_pan(lake))
}

/// Returns the name of a river's valley; `None` in a world without places, and for rivers of agents.
pub fn valley_name(world: &World, river: &Line) -> Option<String> {
    let LineId::River { channel: (level, x, y), .. } = river.course else { return None };
    world.names().map(|names| names.valley(first_vertex(world, level, [x, y]), &[i64::from(level), x, y]))
}

/// Returns the first (north-western) vertex of a cell on a level of the channel network. Names depend on the place,
/// since each language is spoken in a part of the world.
fn first_vertex(world: &World, level: u32, cell: [i64; 2]) -> [i64; 2] {
    let fluvial = world.relief().fluvial().expect("only fluvial worlds have lakes");
    // A cell is `side` grains wide, and neighbouring vertices are `GRAINS` grains apart.
    cell.map(|at| (at * fluvial.fields().side(level)).div_euclid(GRAINS))
}

/// A piece of coastline.
#[derive(Clone, Debug, PartialEq)]
pub struct CoastFeature {
    /// Identifier, unique in the world: `c`, the coast cell, and the number of the piece in that cell.
    pub id: String,
    /// Length in metres.
    pub length_m: f64,
    /// Points in metres east and north, with the land on the left of the line.
    pub line: Vec<[f64; 2]>,
}

/// The layer of the whole coast.
pub static COAST: Layer<Arc<Coast>, CoastFeature> = Layer {
    name: "coast",
    about: "the line between land and sea, land on its left; metres",
    shape: GeometryType::Line,
    columns: &[
        Column::new("id", ValueKind::Text, |coast| coast.id.clone().into()),
        Column::new("length_m", ValueKind::Real, |coast| coast.length_m.into()),
    ],
    sources: World::coasts,
    key: |coast| coast_id(coast).into(),
    feature: |world, coast, _| Ok(of_coast(world, coast)),
    lines: |coast| vec![flat(&coast.line)],
};

fn coast_id(coast: &Coast) -> String {
    let (x, y) = coast.id.cell;
    // Padded with zeros, so that ids of one cell sort by number.
    format!("c:{x}:{y}:{:05}", coast.id.number)
}

fn of_coast(world: &World, coast: &Coast) -> CoastFeature {
    let line: Vec<[f64; 2]> = coast.line.iter().map(|point| metres(*point, world.spacing_m())).collect();
    CoastFeature { id: coast_id(coast), length_m: length_m(&line), line }
}

/// A peak.
#[derive(Clone, Debug, PartialEq)]
pub struct PeakFeature {
    /// Identifier, unique in the world: `p` and the peak's cell.
    pub id: String,
    /// Name on maps; `None` in a world without places.
    pub name: Option<String>,
    /// Height in metres.
    pub height_m: f32,
    /// Position in metres east and north.
    pub at: [f64; 2],
}

/// The layer of all peaks.
pub static PEAKS: Layer<Peak, PeakFeature> = Layer {
    name: "peaks",
    about: "peaks; metres",
    shape: GeometryType::Point,
    columns: &[
        Column::new("id", ValueKind::Text, |peak| peak.id.clone().into()),
        Column::optional("name", ValueKind::Text, |peak| peak.name.clone().into()),
        Column::new("height_m", ValueKind::Real32, |peak| peak.height_m.into()),
    ],
    sources: World::peaks,
    key: |peak| peak_id(peak).into(),
    feature: |world, peak, _| Ok(of_peak(world, peak)),
    lines: |peak| point(peak.at),
};

fn peak_id(peak: &Peak) -> String {
    format!("p:{}:{}", peak.id.0, peak.id.1)
}

fn of_peak(world: &World, peak: &Peak) -> PeakFeature {
    PeakFeature {
        id: peak_id(peak),
        name: world
            .names()
            .map(|names| names.peak(peak.at.map(|at| at * world.stride().vertices()), &[peak.id.0, peak.id.1])),
        height_m: peak.height_m,
        at: metres(peak.at.map(|at| at as f64), world.spacing_m()),
    }
}
