//! Rivers and roads with all that their points know, for what makes splines of them.

use std::sync::Arc;

use crate::features::layer::{AnyLayer, Column, Kind, Layer, Shape};
use crate::features::lines::line_m;
use crate::lines::{Line, LineId, LineKind, RoadClass, StructureKind};
use crate::world::World;

/// A river or a road, whole.
#[derive(Clone, Debug, PartialEq)]
pub struct SplineFeature {
    /// Its name in the world.
    pub id: LineId,
    /// What maps call it.
    pub name: Option<String>,
    /// How well it is built, if it is a road between settlements.
    pub class: Option<&'static str>,
    /// Strahler's order at its end, if it is a river of a fluvial world.
    pub order: Option<i64>,
    /// Metres east, north and up of each point.
    pub line: Vec<[f64; 3]>,
    /// Of each point: metres from edge to edge; discharge in cubic metres a second; and the number of [what carries it](carried).
    pub values: Vec<[f64; 3]>,
}

const COLUMNS: &[Column<SplineFeature>] = &[
    Column::new("id", Kind::Text, |line| line.id.to_string().into()),
    Column::optional("name", Kind::Text, |line| line.name.clone().into()),
    Column::optional("class", Kind::Text, |line| line.class.into()),
    Column::optional("order", Kind::Integer, |line| line.order.into()),
];

/// All rivers, of whatever world.
static RIVERS: Layer<Arc<Line>, SplineFeature> = Layer {
    name: "rivers",
    about: "rivers, from source to end, with the height of their surface; metres and m3/s",
    shape: Shape::LineZ,
    columns: COLUMNS,
    sources: |world, area| world.lines_through(LineKind::River, area),
    key: |line| line.id.to_string().into(),
    feature: of_line,
    // The values are a second line, of as many points.
    lines: |line| vec![line.line, line.values],
};

/// All roads, of whatever world.
static ROADS: Layer<Arc<Line>, SplineFeature> = Layer {
    name: "roads",
    about: "roads, with the height of their surface; metres",
    sources: |world, area| world.lines_through(LineKind::Road, area),
    ..RIVERS
};

/// Roads and rivers with their points: the geometry of each is two lines, the second of which has the [values](SplineFeature::values).
pub const SPLINES: &[&dyn AnyLayer] = &[&ROADS, &RIVERS];

/// The kinds of structures by their numbers.
const CARRIERS: [StructureKind; 3] = [StructureKind::Bridge, StructureKind::Tunnel, StructureKind::Ford];

/// What carries a point that has such a number: nothing but the land if it is 0.
pub fn carried(number: f64) -> Option<StructureKind> {
    CARRIERS.get((number as usize).checked_sub(1)?).copied()
}

fn of_line(world: &World, line: &Arc<Line>) -> SplineFeature {
    let number = |index: usize| {
        let carrier = line.carrier(index)?;
        CARRIERS.iter().position(|kind| *kind == carrier).map(|at| at + 1)
    };
    let values = line
        .points
        .iter()
        .enumerate()
        .map(|(index, point)| [2.0 * point.half_width_m, point.discharge_m3s, number(index).unwrap_or(0) as f64]);
    let order = world.relief().fluvial().filter(|_| line.kind == LineKind::River).map(|land| land.order(line).into());
    SplineFeature {
        id: line.id,
        name: line.name.clone(),
        class: line.class.map(RoadClass::name),
        order,
        line: line_m(line, &line.points),
        values: values.collect(),
    }
}
