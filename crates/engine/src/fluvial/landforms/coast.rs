//! Coasts: the lines between land and sea, cut into pieces at the borders of cells of the world.

use crate::area::Area;
use crate::clock::Clock;
use crate::fluvial::Fluvial;
use crate::fluvial::landforms::contour::contours;
use crate::geometry::LineSegment;
use crate::grid::Grid;
use crate::land::WaterKind;
use crate::memory::heap_bytes;
use crate::stop::Stopped;

/// Vertices a side of a cell.
pub(super) const CELL: i64 = 512;

/// Least height in metres above or below the water at a vertex, so that no crossing lies exactly on a vertex.
const LEAST_M: f32 = 1e-3;

/// The id of a piece of coast: its cell, and its number in that cell from north to south.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct CoastId {
    /// Column and row of the cell, 512 vertices a side.
    pub cell: (i64, i64),
    /// Number of the piece in its cell, from 0.
    pub number: u32,
}

/// A piece of coast, with the land on its left in a map.
#[derive(Clone, Debug, PartialEq)]
pub struct Coast {
    /// The id of the piece, the same in every area.
    pub id: CoastId,
    /// Vertices east and south of the origin; for an island within a cell, the last point is the first.
    pub line: Vec<[f64; 2]>,
}

heap_bytes!(Coast: line);

impl Coast {
    /// Finds all pieces of a cell.
    pub(super) fn of_cell(fluvial: &Fluvial, cell: (i64, i64), clock: &Clock) -> Result<Vec<Coast>, Stopped> {
        let area = Area::new(cell.0 * CELL, cell.1 * CELL, CELL as usize + 1, CELL as usize + 1);
        if !fluvial.may_have_coast(area, clock)? {
            return Ok(Vec::new());
        }
        let land = fluvial.land(area, clock)?;
        let Some(water) = land.water else { return Ok(Vec::new()) };
        let sea_m = fluvial.fields().sea_level_m() as f32;
        let mut values = Grid::filled(area, 0.0);
        for y in area.y0..area.y1 {
            let kinds = water.kind.row(y, area.x0, area.x1);
            let heights = land.heights.row(y, area.x0, area.x1);
            for ((value, kind), height_m) in values.row_mut(y, area.x0, area.x1).iter_mut().zip(kinds).zip(heights) {
                // A river's bed may lie deeper than the sea's level without being sea.
                let above_m = height_m - sea_m;
                *value = if *kind == WaterKind::Sea { above_m.min(-LEAST_M) } else { above_m.max(LEAST_M) };
            }
        }
        let lines = contours(&values).into_iter().map(|contour| contour.points);
        Ok((0..).zip(lines).map(|(number, line)| Coast { id: CoastId { cell, number }, line }).collect())
    }

    /// Tells whether a part of the coast lies in the rectangle that the outer vertices of an area span.
    pub fn touches(&self, area: &Area) -> bool {
        let corner = [(area.x1 - 1 - area.x0) as f64, (area.y1 - 1 - area.y0) as f64];
        let from = |point: [f64; 2]| [point[0] - area.x0 as f64, point[1] - area.y0 as f64];
        self.line.windows(2).any(|pair| LineSegment::between(from(pair[0]), from(pair[1])).touches_rectangle(corner))
    }
}
