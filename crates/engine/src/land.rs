//! Land: the output of relief, which is heights and the water on them.

use crate::area::Area;
use crate::grid::Grid;
use crate::memory::heap_bytes;

/// The land of an area, and the water on it.
#[derive(Clone, Debug, PartialEq)]
pub struct Land {
    /// Heights of the ground in metres; under water, those of its bed.
    pub heights: Grid<f32>,
    /// Standing and flowing water; `None` where the relief has no water.
    pub water: Option<Water>,
}

/// Water on an area.
#[derive(Clone, Debug, PartialEq)]
pub struct Water {
    /// Kind of water at each vertex.
    pub kind: Grid<WaterKind>,
    /// True where a vertex lies in the bed of a channel, wet or dry: ground filled up there is a dam.
    pub bed: Grid<bool>,
    /// Depth of the water in metres, from the bed to the surface; 0 where it is dry.
    pub depth_m: Grid<f32>,
    /// Discharge in cubic metres a second of the channel at each vertex, also on the dry bars in its bed; 0 off the
    /// channels.
    pub flow_m3s: Grid<f32>,
    /// Thickness of glacier ice in metres; `None` where the relief has no glaciers.
    pub ice_m: Option<Grid<f32>>,
}

impl Water {
    /// Returns an area without water, of a relief without glaciers.
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
    /// Bytes of a vertex with the water on it: four numbers, a kind, and whether it lies in a bed.
    pub const VERTEX_BYTES: u64 = (4 * size_of::<f32>() + size_of::<WaterKind>() + size_of::<bool>()) as u64;

    /// Copies a part of the area, which must be within it.
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
    /// No water.
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
    /// True for a lake or the sea: roads keep out of both.
    pub fn is_open(self) -> bool {
        matches!(self, WaterKind::Lake | WaterKind::Sea)
    }
}
