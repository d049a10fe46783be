//! The level of detail at which land is made, by the distance between its nodes.

use super::fields::Fields;
use super::network::ShownChannels;
use super::valley;
use crate::grain_point::GRAINS;

/// The level of detail at which land is made.
#[derive(Clone, Copy, Debug)]
pub(super) struct Detail {
    /// Vertices from one node to the next, a power of two.
    pub step: i64,
    /// Vertices from one sample of the slope of the hills to the next, a power of two.
    pub slope_step: i64,
    /// The channels that are made one by one. Finer ones enter the land as a mean only.
    pub channels: ShownChannels,
    /// Search radius for brooks, in cells of the finest shown level.
    pub brook_cells: i64,
    /// True if gullies are carved.
    pub gullies: bool,
    /// True if breaches are cut. A breach is one vertex wide, and needs a wide pad.
    pub breaches: bool,
    /// Catchment of the smallest river that is shown, in cells of the trunk lattice.
    pub least_area: f64,
    /// True if nodes are further apart than the cells of the trunk lattice are wide: each node is then the mean of many
    /// finer ones.
    pub is_far: bool,
}

/// The time that land may take.
#[derive(Clone, Copy, Debug)]
pub(super) enum Care {
    /// As long as a bake takes.
    Whole,
    /// Half as long: for a sketch, a picture that must appear soon and is replaced shortly after.
    Sketch,
}

/// Least width, in nodes, of the cells of a level whose channels are shown. Channels of finer levels enter as a mean
/// only.
const LEAST_CELL: i64 = 12;

/// Side, in nodes, of the square whose area is the smallest catchment of a river that is shown. A smaller square would
/// fill the land with rivers.
const LEAST_RIVER_CELL: i64 = 12;

/// Least width in nodes of a trunk cell at which trunks are drawn with bends, and at which they are drawn at all. Where
/// nodes are further apart, finer nodes are made and averaged.
const LEAST_BENT_CELL: i64 = 8;
const LEAST_TRUNK_CELL: i64 = 3;

/// The same least width at which trunks are drawn at all, in a sketch: they show, if not well.
const LEAST_SKETCHED_CELL: i64 = 2;

/// Least distance in nodes between the knots of a channel, where not all levels are shown; and in a sketch.
const LEAST_PIECE: i64 = 2;
const LEAST_SKETCHED_PIECE: i64 = 4;

/// Vertices between samples of the slope of the hills: bands of rock, in which it varies most, are some hundreds of
/// metres wide and more.
pub(super) const SLOPE_STEP: i64 = 16;

/// Nodes between these samples where each node is the mean of whole trunk cells: a cell then holds at least two samples a
/// side.
const FAR_SLOPE_STEP: i64 = 2;

impl Detail {
    /// Returns the detail that the nodes of a stride can show.
    pub fn new(fields: &Fields, stride: i64, care: Care) -> Detail {
        let (is_whole, is_far) = (stride == 1, is_far(fields, stride));
        let trunk_cell = fields.side(0) / GRAINS;
        let (least_cell, least_piece) = match care {
            Care::Whole => (LEAST_TRUNK_CELL, LEAST_PIECE),
            Care::Sketch => (LEAST_SKETCHED_CELL, LEAST_SKETCHED_PIECE),
        };
        // Trunks are always shown.
        let is_wide = |level: &u32| is_whole || fields.side(*level) >= LEAST_CELL * stride * GRAINS;
        let levels = (1..fields.levels()).take_while(is_wide).count() as u32 + 1;
        let has_all = levels == fields.levels();
        let is_straight = trunk_cell < LEAST_BENT_CELL * stride;
        let finer = std::iter::successors(Some(stride), |step| Some(step / 2));
        let mut finer = finer.filter(|step| *step == 1 || trunk_cell >= least_cell * step);
        let step = if is_straight { finer.next().unwrap_or(1) } else { stride };
        let river_cells = (LEAST_RIVER_CELL * stride * GRAINS) as f64 / fields.side(0) as f64;
        Detail {
            step,
            slope_step: SLOPE_STEP.max(if is_far { FAR_SLOPE_STEP * step } else { step }),
            channels: ShownChannels {
                levels,
                least_piece: if has_all { 0.0 } else { (least_piece * stride * GRAINS) as f64 },
                are_straight: is_straight,
            },
            brook_cells: valley::BROOK_CELLS,
            gullies: has_all,
            breaches: is_whole && fields.most_laws().gullies > 0.0,
            least_area: if is_whole { 0.0 } else { river_cells * river_cells },
            is_far,
        }
    }
}

/// Tells whether nodes `stride` vertices apart are further apart than the trunk cells are wide.
pub(super) fn is_far(fields: &Fields, stride: i64) -> bool {
    fields.side(0) < stride * GRAINS
}
