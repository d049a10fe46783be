//! Rivers and roads with all values of their points, for writers that make splines of them.

use std::sync::Arc;

use crate::clock::Clock;
use crate::features::layer::{AnyLayer, Column, GeometryType, Layer, ValueKind};
use crate::features::lines::line_m;
use crate::lines::{Line, LineId, LineKind, RoadClass, StructureKind};
use crate::stop::Stopped;
use crate::world::World;

/// A river or a road, uncut.
#[derive(Clone, Debug, PartialEq)]
pub struct SplineFeature {
    /// Identifier, unique in the world.
    pub id: LineId,
    /// Name on maps.
    pub name: Option<String>,
    /// Class of construction, of roads between settlements only.
    pub class: Option<&'static str>,
    /// Strahler order at the end, of rivers in fluvial worlds only.
    pub order: Option<i64>,
    /// Points in metres east, north and up.
    pub line: Vec<[f64; 3]>,
    /// Values of each point: width in metres, discharge in cubic metres a second, and the number of the
    /// [structure](carried) that carries it.
    pub values: Vec<[f64; 3]>,
}

const COLUMNS: &[Column<SplineFeature>] = &[
    Column::new("id", ValueKind::Text, |line| line.id.to_string().into()),
    Column::optional("name", ValueKind::Text, |line| line.name.clone().into()),
    Column::optional("class", ValueKind::Text, |line| line.class.into()),
    Column::optional("order", ValueKind::Integer, |line| line.order.into()),
];

/// The layer of all rivers, in any kind of world.
static RIVERS: Layer<Arc<Line>, SplineFeature> = Layer {
    name: "rivers",
    about: "rivers, from source to end, with the height of their surface; metres and m3/s",
    shape: GeometryType::LineZ,
    columns: COLUMNS,
    sources: |world, area, clock| world.lines_through(LineKind::River, area, clock),
    key: |line| line.id.to_string().into(),
    feature: of_line,
    // The values follow as a second line with the same number of points.
    lines: |line| vec![line.line, line.values],
};

/// The layer of all roads, in any kind of world.
static ROADS: Layer<Arc<Line>, SplineFeature> = Layer {
    name: "roads",
    about: "roads, with the height of their surface; metres",
    sources: |world, area, clock| world.lines_through(LineKind::Road, area, clock),
    ..RIVERS
};

/// Layers of roads and rivers with the values of their points: the geometry of a feature is two lines, of which the
/// second holds the [values](SplineFeature::values).
pub const SPLINES: &[&dyn AnyLayer] = &[&ROADS, &RIVERS];

/// Kinds of structures, in the order of their numbers.
const CARRIERS: [StructureKind; 3] = [StructureKind::Bridge, StructureKind::Tunnel, StructureKind::Ford];

/// Returns the structure that carries a point with this number, or `None` for 0, where the line lies on the ground.
pub fn carried(number: f64) -> Option<StructureKind> {
    CARRIERS.get((number as usize).checked_sub(1)?).copied()
}

fn of_line(world: &World, line: &Arc<Line>, clock: &Clock) -> Result<SplineFeature, Stopped> {
    let number = |index: usize| {
        let carrier = line.carrier(index)?;
        CARRIERS.iter().position(|kind| *kind == carrier).map(|at| at + 1)
    };
    let values = line
        .points
        .iter()
        .enumerate()
        .map(|(index, point)| [2.0 * point.half_width_m, point.discharge_m3s, number(index).unwrap_or(0) as f64]);
    let land = world.relief().fluvial().filter(|_| line.kind == LineKind::River);
    let order = land.map(|land| land.order(line, clock)).transpose()?.map(Into::into);
    Ok(SplineFeature {
        id: line.id,
        name: line.name.clone(),
        class: line.class.map(RoadClass::name),
        order,
        line: line_m(line, &line.points),
        values: values.collect(),
    })
}
