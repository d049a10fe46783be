//! Lakes, coast and peaks.

use std::sync::Arc;

use crate::features::layer::{Column, Kind, Layer, Shape, flat, point};
use crate::features::plane::{length_m, metres};
use crate::fluvial::landforms::coast::Coast;
use crate::fluvial::landforms::lakes::Lake;
use crate::fluvial::landforms::peaks::Peak;
use crate::fluvial::point::GRAINS;
use crate::lines::{LakeId, Line, LineId};
use crate::world::World;

/// A lake.
#[derive(Clone, Debug, PartialEq)]
pub struct LakeFeature {
    /// Its name in the world: `l` with the level of the channel that it lies in, and that channel's cell.
    pub id: String,
    /// Its name on a map; none in a world without places.
    pub name: Option<String>,
    /// Height of its surface in metres.
    pub level_m: f64,
    /// Square metres within its shore, without islands.
    pub area_m2: f64,
    /// The river that runs out of it.
    pub outlet: Option<LineId>,
    /// Its shore, anticlockwise, and those of its islands, clockwise: metres east and north, each ending where it begins.
    pub rings: Vec<Vec<[f64; 2]>>,
}

/// All lakes.
pub static LAKES: Layer<Arc<Lake>, LakeFeature> = Layer {
    name: "lakes",
    about: "lakes with their islands; metres",
    shape: Shape::Polygon,
    columns: &[
        Column::new("id", Kind::Text, |lake| lake.id.clone().into()),
        Column::optional("name", Kind::Text, |lake| lake.name.clone().into()),
        Column::new("level_m", Kind::Real, |lake| lake.level_m.into()),
        Column::new("area_m2", Kind::Real, |lake| lake.area_m2.into()),
        Column::optional("outlet", Kind::Text, |lake| lake.outlet.map(|river| river.to_string()).into()),
    ],
    sources: World::lakes,
    key: |lake| lake.id.to_string().into(),
    feature: of_lake,
    lines: |lake| lake.rings.iter().map(|ring| flat(ring)).collect(),
};

fn of_lake(world: &World, lake: &Arc<Lake>) -> LakeFeature {
    let ring = |ring: &Vec<[f64; 2]>| ring.iter().map(|point| metres(*point, world.spacing_m())).collect();
    LakeFeature {
        id: lake.id.to_string(),
        name: lake_name(world, lake.id),
        level_m: lake.level_m,
        area_m2: lake.area_m2,
        outlet: lake.outlet,
        rings: lake.rings.iter().map(ring).collect(),
    }
}

/// The name of the lake of an id, whether there is one; none in a world without places.
pub(crate) fn lake_name(world: &World, LakeId((level, x, y)): LakeId) -> Option<String> {
    world.names().map(|names| names.lake(first_vertex(world, level, [x, y]), &[i64::from(level), x, y]))
}

/// The name of the valley of a river; none in a world without places, and none of rivers of agents.
pub fn valley_name(world: &World, river: &Line) -> Option<String> {
    let LineId::River { channel: (level, x, y), .. } = river.course else { return None };
    world.names().map(|names| names.valley(first_vertex(world, level, [x, y]), &[i64::from(level), x, y]))
}

/// The vertex at which a cell of a level of the network begins: names go by the place, since a tongue is at home in a part of
/// the world.
fn first_vertex(world: &World, level: u32, cell: [i64; 2]) -> [i64; 2] {
    let fluvial = world.relief().fluvial().expect("only fluvial worlds have lakes");
    // Cells are `side` grains apart, and vertices `GRAINS`.
    cell.map(|at| (at * fluvial.fields().side(level)).div_euclid(GRAINS))
}

/// A piece of coast.
#[derive(Clone, Debug, PartialEq)]
pub struct CoastFeature {
    /// Its name in the world: `c`, its cell, and its number there.
    pub id: String,
    /// Metres from end to end.
    pub length_m: f64,
    /// Metres east and north, with the land on its left.
    pub line: Vec<[f64; 2]>,
}

/// All of the coast.
pub static COAST: Layer<Arc<Coast>, CoastFeature> = Layer {
    name: "coast",
    about: "the line between land and sea, land on its left; metres",
    shape: Shape::Line,
    columns: &[
        Column::new("id", Kind::Text, |coast| coast.id.clone().into()),
        Column::new("length_m", Kind::Real, |coast| coast.length_m.into()),
    ],
    sources: World::coasts,
    key: |coast| coast_id(coast).into(),
    feature: of_coast,
    lines: |coast| vec![flat(&coast.line)],
};

fn coast_id(coast: &Coast) -> String {
    let (x, y) = coast.id.cell;
    // Numbers of a cell sort as text.
    format!("c:{x}:{y}:{:05}", coast.id.number)
}

fn of_coast(world: &World, coast: &Arc<Coast>) -> CoastFeature {
    let line: Vec<[f64; 2]> = coast.line.iter().map(|point| metres(*point, world.spacing_m())).collect();
    CoastFeature { id: coast_id(coast), length_m: length_m(&line), line }
}

/// A peak.
#[derive(Clone, Debug, PartialEq)]
pub struct PeakFeature {
    /// Its name in the world: `p`, and its cell.
    pub id: String,
    /// Its name on a map; none in a world without places.
    pub name: Option<String>,
    /// Its height in metres.
    pub height_m: f32,
    /// Metres east and north.
    pub at: [f64; 2],
}

/// All peaks.
pub static PEAKS: Layer<Peak, PeakFeature> = Layer {
    name: "peaks",
    about: "peaks; metres",
    shape: Shape::Point,
    columns: &[
        Column::new("id", Kind::Text, |peak| peak.id.clone().into()),
        Column::optional("name", Kind::Text, |peak| peak.name.clone().into()),
        Column::new("height_m", Kind::Real32, |peak| peak.height_m.into()),
    ],
    sources: World::peaks,
    key: |peak| peak_id(peak).into(),
    feature: of_peak,
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
