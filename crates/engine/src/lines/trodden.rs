//! Trodden roads in the land: the roads of agents.
//!
//! Each value is a maximum over the lines, so their order does not matter.

use crate::area::Area;
use crate::grid::Grid;
use crate::lines::nearest::{self, fade, raise};
use crate::lines::{Bed, Line};

/// The effect of all trodden lines together on the vertices of an area.
#[derive(Clone, Debug)]
pub struct Trodden {
    /// Share of dirt, 0 to 1.
    pub dirt: Grid<f32>,
    /// Share to which a vertex is brought to the level of a road, and that level; `None` if no road is levelled.
    grade: Option<Grid<(f32, f32)>>,
}

impl Trodden {
    /// Creates the effect of no lines on `area`.
    pub(super) fn blank(area: Area) -> Trodden {
        Trodden { dirt: Grid::filled(area, 0.0), grade: None }
    }

    /// Creates the effect of dirt alone, on land that has been levelled already.
    #[cfg(feature = "gpu")]
    pub(super) fn of_dirt(dirt: Grid<f32>) -> Trodden {
        Trodden { dirt, grade: None }
    }

    /// Adds the effect of a line.
    pub(super) fn add(&mut self, line: &Line) {
        let Bed::Trodden { shoulder_m, graded } = line.bed else { return };
        let (shoulder_m, area) = (shoulder_m as f32, self.dirt.area());
        nearest::visit(line, area, |x, y, place| {
            let share = fade(place.outside_m / shoulder_m);
            raise(&mut self.dirt, x, y, share);
            if graded {
                // The nearest road wins, and of two equally near roads the higher one.
                raise(self.grade.get_or_insert_with(|| no_grade(area)), x, y, (share, place.floor_m));
            }
        });
    }

    /// Levels the heights.
    pub(super) fn shape(&self, heights: &mut Grid<f32>) {
        let Some(grade) = &self.grade else { return };
        for (height_m, (share, level_m)) in heights.values_mut().iter_mut().zip(grade.values()) {
            *height_m += (level_m - *height_m) * share;
        }
    }

    /// Adds the effect of `other`, whose area is a part of this one's.
    pub(super) fn merge(&mut self, other: &Trodden) {
        let area = self.dirt.area();
        for (x, y) in other.dirt.area().vertices() {
            raise(&mut self.dirt, x, y, other.dirt.at(x, y));
            if let Some(grade) = &other.grade {
                raise(self.grade.get_or_insert_with(|| no_grade(area)), x, y, grade.at(x, y));
            }
        }
    }

    /// Reduces the effect on a vertex to a share.
    pub(super) fn weaken(&mut self, x: i64, y: i64, share: f32) {
        self.dirt.row_mut(y, x, x + 1)[0] *= share;
        if let Some(grade) = &mut self.grade {
            grade.row_mut(y, x, x + 1)[0].0 *= share;
        }
    }

    /// Returns the effect on a part of the area, which must lie within it.
    pub(super) fn part(&self, area: Area) -> Trodden {
        Trodden { dirt: self.dirt.part(area), grade: self.grade.as_ref().map(|grade| grade.part(area)) }
    }
}

fn no_grade(area: Area) -> Grid<(f32, f32)> {
    Grid::filled(area, (0.0, 0.0))
}
