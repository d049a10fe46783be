//! Dug beds in the land: the rivers of agents.
//!
//! Each value is a maximum over the lines, so their order does not matter.

use crate::area::Area;
use crate::grid::Grid;
use crate::lines::nearest::{self, Nearest, fade, raise};
use crate::lines::{Bed, Line};

/// The effect of all dug lines together on the vertices of an area.
#[derive(Clone, Debug)]
pub struct Dug {
    /// Metres by which the land is cut down.
    pub cut_m: Grid<f32>,
    /// Share of sand, 0 to 1.
    pub sand: Grid<f32>,
    /// Share of water, 0 to 1.
    pub water: Grid<f32>,
}

/// Share of water from which on a vertex counts as wet.
const WET: f32 = 0.5;

impl Dug {
    /// Creates the effect of no lines on `area`.
    pub(super) fn blank(area: Area) -> Dug {
        let grid = || Grid::filled(area, 0.0);
        Dug { cut_m: grid(), sand: grid(), water: grid() }
    }

    /// Adds the effect of a line, given the heights of the bare land.
    pub(super) fn add(&mut self, line: &Line, heights: &Grid<f32>) {
        let Bed::Dug { bank_m } = line.bed else { return };
        let (bank_m, spacing_m) = (bank_m as f32, line.spacing_m as f32);
        nearest::visit(line, self.cut_m.area(), |x, y, place| {
            let fall = fade(place.outside_m / bank_m);
            raise(&mut self.cut_m, x, y, (heights.at(x, y) - place.floor_m).max(0.0) * fall);
            // Sand lies in the bed and on the lower half of the bank.
            raise(&mut self.sand, x, y, fade(2.0 * place.outside_m / bank_m));
            raise(&mut self.water, x, y, share_of_water(&place, spacing_m));
        });
    }

    /// True if a vertex lies in the water of a river.
    ///
    /// # Panics
    /// When the vertex is not in the area.
    pub fn is_wet(&self, x: i64, y: i64) -> bool {
        self.water.at(x, y) >= WET
    }

    /// Cuts the beds into the heights.
    pub(super) fn shape(&self, heights: &mut Grid<f32>) {
        for (height_m, cut_m) in heights.values_mut().iter_mut().zip(self.cut_m.values()) {
            *height_m -= cut_m;
        }
    }

    /// Adds the effect of `other`, whose area is a part of this one's.
    pub(super) fn merge(&mut self, other: &Dug) {
        for (x, y) in other.cut_m.area().vertices() {
            raise(&mut self.cut_m, x, y, other.cut_m.at(x, y));
            raise(&mut self.sand, x, y, other.sand.at(x, y));
            raise(&mut self.water, x, y, other.water.at(x, y));
        }
    }

    /// Reduces the effect on a vertex to a share.
    pub(super) fn weaken(&mut self, x: i64, y: i64, share: f32) {
        for grid in [&mut self.cut_m, &mut self.sand, &mut self.water] {
            grid.row_mut(y, x, x + 1)[0] *= share;
        }
    }

    /// Returns the effect on a part of the area, which must lie within it.
    pub(super) fn part(&self, area: Area) -> Dug {
        Dug { cut_m: self.cut_m.part(area), sand: self.sand.part(area), water: self.water.part(area) }
    }
}

/// Depth and width of the water of dug rivers. Few exports need them, so they are not part of the imprint of every
/// tile.
#[derive(Clone, Debug)]
pub(crate) struct DugWaters {
    /// Metres from the floor of the bed to the water's surface; 0 outside the water.
    pub depth_m: Grid<f32>,
    /// Metres from edge to edge of the river at the vertex; 0 outside the water.
    pub width_m: Grid<f32>,
}

impl DugWaters {
    /// Returns the waters of the dug rivers among `lines`, on an area.
    pub fn new<'a>(lines: impl IntoIterator<Item = &'a Line>, area: Area) -> DugWaters {
        let mut waters = DugWaters { depth_m: Grid::filled(area, 0.0), width_m: Grid::filled(area, 0.0) };
        for line in lines.into_iter().filter(|line| matches!(line.bed, Bed::Dug { .. })) {
            nearest::visit(line, area, |x, y, place| {
                if share_of_water(&place, line.spacing_m as f32) >= WET {
                    raise(&mut waters.depth_m, x, y, place.filled_m);
                    raise(&mut waters.width_m, x, y, 2.0 * place.half_width_m);
                }
            });
        }
        waters
    }
}

/// Returns the share of water at a place: 1 in the bed, 0 outside, with an edge as soft as a vertex is wide.
fn share_of_water(place: &Nearest, spacing_m: f32) -> f32 {
    (0.5 - place.outside_m / spacing_m).clamp(0.0, 1.0)
}
