//! Lines: whole rivers and roads from all their makers, and their effect on the land.
//!
//! ```text
//!   fluvial/ rivers --+                      +--> imprint.rs   effect on an area: dug.rs      beds of agents' rivers
//!   agents/           +--> Line: id, points, |                                    trodden.rs  agents' roads
//!   places/ roads   --+    structures, bed   |                                    built.rs    cuts and fills, drain.rs
//!                                            +--> outline.rs   the points that suffice to draw a road
//!                                            +--> gpu_words.rs agents' lines as words, for kernels of the GPU
//! ```
//!
//! The makers on the left pass their lines to this module. Tiles, meshes, maps and exports take them from here.

mod built;
mod drain;
mod dug;
#[cfg(feature = "gpu")]
pub(crate) mod gpu_words;
mod id;
mod imprint;
mod nearest;
mod outline;
mod structure;
mod trodden;

pub use built::Built;
pub(crate) use built::HIGHEST_FILL_M;
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

/// Units between two vertices: makers count places on lines in these units. Points of fluvial rivers and of built roads
/// are whole numbers of units.
pub const FIXED: i64 = 256;

/// A river or a road.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum LineKind {
    /// A river: its water flows from the first point to the last.
    River,
    /// A road or track.
    Road,
}

impl LineKind {
    /// Returns the name in files.
    pub fn name(self) -> &'static str {
        match self {
            LineKind::River => "river",
            LineKind::Road => "road",
        }
    }
}

/// Class of a road between settlements. Its number is the index into the settings' lists of three values.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum RoadClass {
    /// A steep and narrow road that goes through fords.
    Track = 0,
    /// A road that joins villages.
    Road = 1,
    /// A road that leads to towns: wide, with gentle grades, on bridges.
    Highway = 2,
}

impl RoadClass {
    /// Returns the name in files.
    pub fn name(self) -> &'static str {
        match self {
            RoadClass::Track => "track",
            RoadClass::Road => "road",
            RoadClass::Highway => "highway",
        }
    }
}

/// The end of a line: the thing that its last point leads to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LineEnd {
    /// The sea.
    Sea,
    /// Another line. For a road this is the id of the course, whichever part of the course the line ends on.
    Line(LineId),
    /// A lake of the relief.
    Lake(LakeId),
    /// A pond that the river itself makes.
    Pond,
    /// A basin that has neither an outlet nor a lake.
    Sink,
    /// A settlement.
    Site(SiteId),
    /// Nothing: an agent's river has lost the last third of its length, or a road stops.
    Nothing,
}

impl LineEnd {
    /// Returns the name in files; for another line, the name of its kind.
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

    /// Returns the id as text, for ends that have one.
    pub fn id(self) -> Option<String> {
        match self {
            LineEnd::Line(line) => Some(line.to_string()),
            LineEnd::Lake(lake) => Some(lake.to_string()),
            LineEnd::Site(site) => Some(site.to_string()),
            LineEnd::Sea | LineEnd::Pond | LineEnd::Sink | LineEnd::Nothing => None,
        }
    }
}

/// The way in which a line changes the land.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bed {
    /// No change: the relief has been made around the line.
    Natural,
    /// A bed cut into the land, with sand on its banks.
    Dug {
        /// Metres from the edge of the bed to where the bank meets the land.
        bank_m: f64,
    },
    /// A trodden road: it leaves dirt, and may be levelled across.
    Trodden {
        /// Metres from the road's edge to the end of its effect.
        shoulder_m: f64,
        /// True if the ground is levelled across the road.
        graded: bool,
    },
    /// A built road: the land is cut and filled, with batters at its sides.
    Built {
        /// Metres from the road's edge to the end of its cuts and fills.
        bank_m: f64,
    },
}

/// A point of a line's middle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinePoint {
    /// Vertices east and south of the line's origin.
    pub place: [f64; 2],
    /// Height in metres of the water's surface, or of the road's surface.
    pub level_m: f64,
    /// Height in metres of the bed under the water, or of the road. Along a river it never rises.
    pub floor_m: f64,
    /// Metres from the middle to the edge.
    pub half_width_m: f64,
    /// Discharge in cubic metres a second; 0 for roads and for agents' rivers, whose discharge is unknown.
    pub discharge_m3s: f64,
    /// Area in square metres that drains through the point; 0 for roads and for agents' rivers, likewise.
    pub basin_m2: f64,
}

/// A whole river or road.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    /// Id in the world.
    pub id: LineId,
    /// The kind of line: a river or a road.
    pub kind: LineKind,
    /// Class of the road, if it joins settlements.
    pub class: Option<RoadClass>,
    /// Name on maps, if the line has one.
    pub name: Option<String>,
    /// Id of the first part of the line's course: lakes cut rivers into parts, and other roads cut roads. For agents'
    /// lines, their own id.
    pub course: LineId,
    /// The vertex that points are relative to, so that their places are exact anywhere in the world.
    pub origin: [i64; 2],
    /// The middle line from start to end: at least two points, or one for agents' lines.
    pub points: Vec<LinePoint>,
    /// Bridges, tunnels and fords that carry the line where the land does not, from its start on.
    pub structures: Vec<Structure>,
    /// The thing that the line ends in.
    pub end: LineEnd,
    /// The effect of the line on the land.
    pub bed: Bed,
    /// Metres between the vertices of the line's world.
    pub spacing_m: f64,
    /// All vertices that the line lies on or can have an effect on, with a margin.
    pub bounds: Area,
}

heap_bytes!(LinePoint);
heap_bytes!(Line: name, points, structures);

/// Lines that concern an area, sorted by id.
pub type Lines = Vec<Arc<Line>>;

impl Line {
    /// Returns the place of a point in vertices, relative to a vertex of the world.
    pub fn place_from(&self, vertex: [i64; 2], point: &LinePoint) -> [f64; 2] {
        [0, 1].map(|axis| (self.origin[axis] - vertex[axis]) as f64 + point.place[axis])
    }

    /// Returns the place of a point in the world, in 1/256 vertex: exact, except for agents' lines, where it is
    /// rounded.
    pub fn fixed(&self, point: &LinePoint) -> [i64; 2] {
        [0, 1].map(|axis| self.origin[axis] * FIXED + (point.place[axis] * FIXED as f64).round() as i64)
    }

    /// Returns the pieces from each point to the next. A line of one point, a round pool or place, has one piece, from
    /// that point to itself.
    pub fn pieces(&self) -> impl Iterator<Item = [&LinePoint; 2]> {
        let last = self.points.len() - 1;
        (0..last.max(1)).map(move |index| [&self.points[index], &self.points[(index + 1).min(last)]])
    }

    /// Returns the kind of structure that carries a point; `None` if the land does.
    pub fn carrier(&self, index: usize) -> Option<StructureKind> {
        let carries = |structure: &&Structure| (structure.first..=structure.last).contains(&index);
        self.structures.iter().find(carries).map(|structure| structure.kind)
    }

    /// Returns the kind of structure that carries each piece; `None` if the land does. A structure carries the pieces
    /// between two of its points.
    pub fn carriers(&self) -> Vec<Option<StructureKind>> {
        let mut carriers = vec![None; self.points.len().saturating_sub(1)];
        for structure in &self.structures {
            carriers[structure.first..structure.last].fill(Some(structure.kind));
        }
        carriers
    }

    /// Returns the length of the middle line in metres, as seen from above.
    pub fn length_m(&self) -> f64 {
        self.points.windows(2).map(|pair| piece_m(pair, self.spacing_m)).sum()
    }

    /// Returns the steepest grade anywhere on the line, metres up a metre ahead.
    pub fn max_grade(&self) -> f64 {
        let grade = |pair: &[LinePoint]| (pair[1].level_m - pair[0].level_m).abs() / piece_m(pair, self.spacing_m);
        self.points.windows(2).map(grade).fold(0.0, f64::max)
    }

    /// True if the line can have an effect on a vertex of `area`. A line with a natural bed has no effect: it concerns
    /// the areas that it touches.
    pub fn concerns(&self, area: &Area) -> bool {
        self.bounds.common(area).is_some()
            && match self.bed {
                Bed::Natural => self.touches(area),
                Bed::Built { bank_m } => {
                    let half_width_m = self.points.iter().map(|point| point.half_width_m).fold(0.0, f64::max);
                    // Two vertices more, for rounding.
                    self.touches(&area.padded(((half_width_m + bank_m) / self.spacing_m) as usize + 2))
                }
                Bed::Dug { .. } | Bed::Trodden { .. } => true,
            }
    }

    /// True if a part of the line lies in the rectangle that the outer vertices of an area span: for agents' lines a
    /// part of all ground that they may change, for others a part of the middle line.
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

/// Returns the length in metres of a piece, as seen from above.
pub(crate) fn piece_m(pair: &[LinePoint], spacing_m: f64) -> f64 {
    length([0, 1].map(|axis| pair[1].place[axis] - pair[0].place[axis])) * spacing_m
}

/// Returns the vertices within `reach` vertices of any of the points, and a few more.
pub(crate) fn bounds(origin: [i64; 2], points: &[LinePoint], reach: f64) -> Area {
    let ends = |axis: usize| {
        let places = || points.iter().map(|point| point.place[axis]);
        let (low, high) = (places().fold(f64::INFINITY, f64::min), places().fold(f64::NEG_INFINITY, f64::max));
        (origin[axis] + low.floor() as i64, origin[axis] + high.floor() as i64)
    };
    let ((x0, x1), (y0, y1)) = (ends(0), ends(1));
    // One more for the vertex past the last point, and one since an area ends past its last vertex. The pad is rounded
    // up, with one to spare.
    Area { x0, y0, x1: x1 + 2, y1: y1 + 2 }.padded(reach as usize + 2)
}

/// Lines for tests of this crate and of the crates that depend on it.
#[cfg(any(test, feature = "testing"))]
pub mod testing {
    use super::{Bed, Line, LineEnd, LineId, LineKind, LinePoint, RoadClass, SiteId, Structure, StructureKind, bounds};

    /// Builds a road 5 m wide from the places, levels and carriers of its points, in a world with `spacing_m` metres
    /// between vertices.
    pub fn road(points: impl Iterator<Item = ([f64; 2], f64, Option<StructureKind>)>, spacing_m: f64) -> Line {
        let (mut line_points, mut carriers) = (Vec::new(), Vec::new());
        for (place, level_m, carrier) in points {
            let half_width_m = 2.5;
            let point = LinePoint { place, level_m, floor_m: level_m, half_width_m, discharge_m3s: 0.0, basin_m2: 0.0 };
            line_points.push(point);
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
