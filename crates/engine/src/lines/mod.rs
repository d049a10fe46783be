//! Lines: rivers and roads, whole, whoever has made them, and what they do to the land.
//!
//! ```text
//!   fluvial/ rivers --+                      +--> imprint.rs   what lines do to an area: dug.rs    the beds of agents' rivers
//!   agents/           +--> Line: id, points, |                                          trodden.rs  agents' roads
//!   places/ roads   --+    structures, bed   |                                          built.rs    cut and filled, drain.rs
//!                                            +--> outline.rs   the points that suffice to draw a road
//!                                            +--> packed.rs    agents' lines as words, for kernels of the GPU
//! ```
//!
//! The makers hand their lines to this room; tiles, meshes, maps and exports take them from it.

mod built;
mod drain;
mod dug;
mod id;
mod imprint;
mod nearest;
mod outline;
#[cfg(feature = "gpu")]
pub(crate) mod packed;
mod structure;
mod trodden;

pub use built::Built;
pub use dug::Dug;
pub(crate) use dug::DugWaters;
pub use id::{ChannelId, LakeId, LineId, SiteId};
pub use imprint::Imprint;
pub(crate) use nearest::fade;
pub use structure::{Structure, StructureKind};
pub use trodden::Trodden;

use std::sync::Arc;

use crate::area::Area;
use crate::geometry::{LineSegment, length};
use crate::memory::heap_bytes;

/// Parts of a vertex in which makers count places on a line: of rivers and of built roads all are whole ones.
pub const FIXED: i64 = 256;

/// A river or a road.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum LineKind {
    /// Water that falls from its first point to its last.
    River,
    /// What people and goods go on.
    Road,
}

impl LineKind {
    /// The name in files.
    pub fn name(self) -> &'static str {
        match self {
            LineKind::River => "river",
            LineKind::Road => "road",
        }
    }
}

/// How well a road is built. The numbers index the lists of three in settings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum RoadClass {
    /// Steep and narrow, through fords.
    Track = 0,
    /// What joins villages.
    Road = 1,
    /// What leads to towns: wide, even, on bridges.
    Highway = 2,
}

impl RoadClass {
    /// The name in files.
    pub fn name(self) -> &'static str {
        match self {
            RoadClass::Track => "track",
            RoadClass::Road => "road",
            RoadClass::Highway => "highway",
        }
    }
}

/// What a line leads to with its last point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LineEnd {
    /// The sea.
    Sea,
    /// Another line. Of a road it is the id of its course, whichever part of that the line ends on.
    Line(LineId),
    /// A lake of the relief.
    Lake(LakeId),
    /// A pond of its own.
    Pond,
    /// A basin without outlet and without a lake.
    Sink,
    /// A settlement.
    Site(SiteId),
    /// Nothing: a river has lost the last third of its way, a road stops.
    Nothing,
}

impl LineEnd {
    /// The name in files; of a line the name of its kind.
    pub fn name(self) -> &'static str {
        match self {
            LineEnd::Sea => "sea",
            LineEnd::Line(line) => line.kind().name(),
            LineEnd::Lake(_) => "lake",
            LineEnd::Pond => "pond",
            LineEnd::Sink => "sink",
            LineEnd::Site(_) => "site",
            LineEnd::Nothing => "nothing",
        }
    }

    /// The id of what has one, as text.
    pub fn id(self) -> Option<String> {
        match self {
            LineEnd::Line(line) => Some(line.to_string()),
            LineEnd::Lake(lake) => Some(lake.to_string()),
            LineEnd::Site(site) => Some(site.to_string()),
            LineEnd::Sea | LineEnd::Pond | LineEnd::Sink | LineEnd::Nothing => None,
        }
    }
}

/// What a line does to the land.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bed {
    /// Nothing: the relief has been made around it.
    Natural,
    /// It cuts into the land, with sand on its banks.
    Dug {
        /// Metres from the bed to where the bank meets the land.
        bank_m: f64,
    },
    /// It leaves dirt, and may be levelled across.
    Trodden {
        /// Metres from its edge to where nothing of it is left.
        shoulder_m: f64,
        /// Whether the ground is levelled across it.
        graded: bool,
    },
    /// The land is cut and filled, with batters at its sides.
    Built {
        /// Metres from its edge to where nothing of its cuts and fills is left.
        bank_m: f64,
    },
}

/// A point of a line's middle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinePoint {
    /// Vertices east and south of the line's origin.
    pub place: [f64; 2],
    /// Height in metres of the water's surface, or of the road's.
    pub level_m: f64,
    /// Height in metres of the bed's floor under the water, or of the road. A river's never rises.
    pub floor_m: f64,
    /// Metres from the middle to the edge.
    pub half_width_m: f64,
    /// Discharge in cubic metres a second; 0 of roads, and of agents' rivers, which know none.
    pub discharge_m3s: f64,
}

/// A river or a road, whole.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    /// Its name in the world.
    pub id: LineId,
    /// A river or a road.
    pub kind: LineKind,
    /// How well it is built, if it is a road between settlements.
    pub class: Option<RoadClass>,
    /// What maps call it, if it has a name.
    pub name: Option<String>,
    /// The first part of its course, which lakes cut into parts if it is a river, and other roads if it is a road; of agents'
    /// lines their own id.
    pub course: LineId,
    /// The vertex that points are relative to, so that they are exact anywhere.
    pub origin: [i64; 2],
    /// Its middle from start to end; at least one point, and two but for agents'.
    pub points: Vec<LinePoint>,
    /// What carries it where the land does not, from its start on.
    pub structures: Vec<Structure>,
    /// What it ends in.
    pub end: LineEnd,
    /// What it does to the land.
    pub bed: Bed,
    /// Metres between the vertices of its world.
    pub spacing_m: f64,
    /// All vertices that it lies on or can have an effect on, and then some.
    pub bounds: Area,
}

heap_bytes!(LinePoint);
heap_bytes!(Line: name, points, structures);

/// Lines that concern an area, sorted by id.
pub type Lines = Vec<Arc<Line>>;

impl Line {
    /// Where a point lies, in vertices from a vertex of the world.
    pub fn place_from(&self, vertex: [i64; 2], point: &LinePoint) -> [f64; 2] {
        [0, 1].map(|axis| (self.origin[axis] - vertex[axis]) as f64 + point.place[axis])
    }

    /// Where a point lies in the world, in 1/256 vertex: exact but for agents' lines.
    pub fn fixed(&self, point: &LinePoint) -> [i64; 2] {
        [0, 1].map(|axis| self.origin[axis] * FIXED + (point.place[axis] * FIXED as f64).round() as i64)
    }

    /// The pieces from each point to the next; of a line of one point, which is a round pool or place, that point twice.
    pub fn pieces(&self) -> impl Iterator<Item = [&LinePoint; 2]> {
        let last = self.points.len() - 1;
        (0..last.max(1)).map(move |index| [&self.points[index], &self.points[(index + 1).min(last)]])
    }

    /// What carries a point, if the land does not.
    pub fn carrier(&self, index: usize) -> Option<StructureKind> {
        let carries = |structure: &&Structure| (structure.first..=structure.last).contains(&index);
        self.structures.iter().find(carries).map(|structure| structure.kind)
    }

    /// What carries each piece, if the land does not: a structure carries the pieces between two of its points.
    pub fn carriers(&self) -> Vec<Option<StructureKind>> {
        let mut carriers = vec![None; self.points.len().saturating_sub(1)];
        for structure in &self.structures {
            carriers[structure.first..structure.last].fill(Some(structure.kind));
        }
        carriers
    }

    /// Metres from start to end along its middle, seen from above.
    pub fn length_m(&self) -> f64 {
        self.points.windows(2).map(|pair| piece_m(pair, self.spacing_m)).sum()
    }

    /// The steepest grade anywhere on it, metres up a metre ahead.
    pub fn max_grade(&self) -> f64 {
        let grade = |pair: &[LinePoint]| (pair[1].level_m - pair[0].level_m).abs() / piece_m(pair, self.spacing_m);
        self.points.windows(2).map(grade).fold(0.0, f64::max)
    }

    /// Whether it can have an effect on a vertex of `area`; lines with natural beds have none, and count where they lie.
    pub fn concerns(&self, area: &Area) -> bool {
        self.bounds.common(area).is_some()
            && match self.bed {
                Bed::Natural => self.touches(area),
                Bed::Built { bank_m } => {
                    let half_width_m = self.points.iter().map(|point| point.half_width_m).fold(0.0, f64::max);
                    // Two more, for what is rounded on the way.
                    self.touches(&area.padded(((half_width_m + bank_m) / self.spacing_m) as usize + 2))
                }
                Bed::Dug { .. } | Bed::Trodden { .. } => true,
            }
    }

    /// Whether a part of it lies in the rectangle that the outer vertices of an area span: of its middle, or of all that an
    /// agent leaves of its way.
    pub fn touches(&self, area: &Area) -> bool {
        if let Bed::Dug { .. } | Bed::Trodden { .. } = self.bed {
            return nearest::touches(self, area);
        }
        let corner = [(area.x1 - 1 - area.x0) as f64, (area.y1 - 1 - area.y0) as f64];
        let from = |point: &LinePoint| self.place_from([area.x0, area.y0], point);
        self.points
            .windows(2)
            .any(|pair| LineSegment::between(from(&pair[0]), from(&pair[1])).touches_rectangle(corner))
    }
}

/// Metres from a point to the next, seen from above.
pub(crate) fn piece_m(pair: &[LinePoint], spacing_m: f64) -> f64 {
    length([0, 1].map(|axis| pair[1].place[axis] - pair[0].place[axis])) * spacing_m
}

/// The vertices within `reach` vertices of any of the points, and a few more.
pub(crate) fn bounds(origin: [i64; 2], points: &[LinePoint], reach: f64) -> Area {
    let ends = |axis: usize| {
        let places = || points.iter().map(|point| point.place[axis]);
        let (low, high) = (places().fold(f64::INFINITY, f64::min), places().fold(f64::NEG_INFINITY, f64::max));
        (origin[axis] + low.floor() as i64, origin[axis] + high.floor() as i64)
    };
    let ((x0, x1), (y0, y1)) = (ends(0), ends(1));
    // To the vertex past the last point, and one more for rounding.
    Area { x0, y0, x1: x1 + 2, y1: y1 + 2 }.padded(reach as usize + 2)
}

/// Lines for tests, of this crate and of those that stand on it.
#[cfg(any(test, feature = "testing"))]
pub mod testing {
    use super::{Bed, Line, LineEnd, LineId, LineKind, LinePoint, RoadClass, SiteId, Structure, StructureKind, bounds};

    /// A road 5 m wide, from places, levels and what carries them, in a world of so many metres between vertices.
    pub fn road(points: impl Iterator<Item = ([f64; 2], f64, Option<StructureKind>)>, spacing_m: f64) -> Line {
        let (mut line_points, mut carriers) = (Vec::new(), Vec::new());
        for (place, level_m, carrier) in points {
            let (half_width_m, discharge_m3s) = (2.5, 0.0);
            line_points.push(LinePoint { place, level_m, floor_m: level_m, half_width_m, discharge_m3s });
            carriers.push(carrier);
        }
        let (from, to) = (SiteId { i: 0, j: 0 }, SiteId { i: 1, j: 0 });
        let id = LineId::Road { from, to, part: 0 };
        Line {
            id,
            kind: LineKind::Road,
            class: Some(RoadClass::Road),
            name: None,
            course: id,
            origin: [0, 0],
            bounds: bounds([0, 0], &line_points, 40.0 / spacing_m),
            points: line_points,
            structures: Structure::of_points(&carriers),
            end: LineEnd::Site(to),
            bed: Bed::Built { bank_m: 32.0 },
            spacing_m,
        }
    }
}
