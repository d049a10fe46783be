//! What relief hands on: heights, and the water on them.

use crate::area::Area;
use crate::grid::Grid;
use crate::memory::heap_bytes;

/// The land of an area, and the water on it.
#[derive(Clone, Debug, PartialEq)]
pub struct Land {
    /// Heights in metres: of the ground, so under water of its bed.
    pub heights: Grid<f32>,
    /// What stands or flows on it; `None` where the relief knows of no water.
    pub water: Option<Water>,
}

/// Water on an area.
#[derive(Clone, Debug, PartialEq)]
pub struct Water {
    /// What there is at each vertex.
    pub kind: Grid<WaterKind>,
    /// Whether a vertex lies in the bed of a channel, wet or dry: what fills it is a dam.
    pub bed: Grid<bool>,
    /// Metres from the bed to the surface; 0 where it is dry.
    pub depth_m: Grid<f32>,
    /// Discharge in cubic metres a second of the channel at each vertex, also on the bars in its bed that lie dry; 0 off the
    /// channels.
    pub flow_m3s: Grid<f32>,
    /// Metres of glacier; `None` where the relief has none.
    pub ice_m: Option<Grid<f32>>,
}

impl Water {
    /// An area without any, of a relief that has no glaciers.
    pub(crate) fn none(area: Area) -> Water {
        Water {
            kind: Grid::filled(area, WaterKind::Dry),
            bed: Grid::filled(area, false),
            depth_m: Grid::filled(area, 0.0),
            flow_m3s: Grid::filled(area, 0.0),
            ice_m: None,
        }
    }
}

impl Land {
    /// Bytes of a vertex and of the water on it: four numbers, a kind, and whether it lies in a bed.
    pub const VERTEX_BYTES: u64 = (4 * size_of::<f32>() + size_of::<WaterKind>() + size_of::<bool>()) as u64;

    /// The land of a part of the area, which must be within it.
    pub(crate) fn part(&self, area: Area) -> Land {
        let water = self.water.as_ref().map(|water| Water {
            kind: water.kind.part(area),
            bed: water.bed.part(area),
            depth_m: water.depth_m.part(area),
            flow_m3s: water.flow_m3s.part(area),
            ice_m: water.ice_m.as_ref().map(|ice_m| ice_m.part(area)),
        });
        Land { heights: self.heights.part(area), water }
    }
}

/// Kinds of water.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum WaterKind {
    /// None.
    #[default]
    Dry,
    /// A river or a brook.
    River,
    /// A lake.
    Lake,
    /// The sea.
    Sea,
}

heap_bytes!(WaterKind);

impl WaterKind {
    /// Whether it is a lake or the sea, which roads keep out of.
    pub fn is_open(self) -> bool {
        matches!(self, WaterKind::Lake | WaterKind::Sea)
    }
}
