//! Rasters that know which part of the lattice they cover.

use crate::area::Area;

/// One value for each vertex of an [`Area`], row by row from the north-western vertex.
///
/// Reading outside the area panics: a stage that declares too small a pad fails at once, instead of reading other
/// memory or a made-up border.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid<T> {
    area: Area,
    values: Vec<T>,
}

impl<T: Copy> Grid<T> {
    /// Returns a grid with the same value at every vertex.
    pub fn filled(area: Area, value: T) -> Grid<T> {
        Grid { area, values: vec![value; area.len()] }
    }

    /// Returns a grid with the value that `of` gives for each vertex, row by row.
    pub fn of(area: Area, mut of: impl FnMut(i64, i64) -> T) -> Grid<T> {
        Grid { area, values: area.vertices().map(|(x, y)| of(x, y)).collect() }
    }

    /// The area that the grid covers.
    pub fn area(&self) -> Area {
        self.area
    }

    /// Returns all values, row by row.
    pub fn values(&self) -> &[T] {
        &self.values
    }

    /// Returns all values for writing, row by row.
    pub fn values_mut(&mut self) -> &mut [T] {
        &mut self.values
    }

    /// Returns the value at a vertex of the lattice.
    ///
    /// # Panics
    /// When the vertex is outside the area.
    pub fn at(&self, x: i64, y: i64) -> T {
        self.row(y, x, x + 1)[0]
    }

    /// Returns the values of row `y` at `x0 <= x < x1`.
    ///
    /// # Panics
    /// When a part of the row is outside the area.
    pub fn row(&self, y: i64, x0: i64, x1: i64) -> &[T] {
        let range = self.range(y, x0, x1);
        &self.values[range]
    }

    /// Returns the values of row `y` at `x0 <= x < x1` for writing.
    ///
    /// # Panics
    /// When a part of the row is outside the area.
    pub fn row_mut(&mut self, y: i64, x0: i64, x1: i64) -> &mut [T] {
        let range = self.range(y, x0, x1);
        &mut self.values[range]
    }

    /// Copies a part of the area into a grid of its own.
    ///
    /// # Panics
    /// When the part is not within the area.
    #[must_use]
    pub fn part(&self, area: Area) -> Grid<T> {
        let values = (area.y0..area.y1).flat_map(|y| self.row(y, area.x0, area.x1)).copied().collect();
        Grid { area, values }
    }

    /// Sets all values outside a part of the area. Tests use it to find out which vertices a stage reads.
    #[cfg(test)]
    pub(crate) fn fill_outside(&mut self, part: Area, value: T) {
        for (x, y) in self.area.vertices() {
            if !part.has(x, y) {
                self.row_mut(y, x, x + 1)[0] = value;
            }
        }
    }

    fn range(&self, y: i64, x0: i64, x1: i64) -> std::ops::Range<usize> {
        let asked = Area { x0, y0: y, x1, y1: y + 1 };
        assert!(self.area.contains(&asked), "{asked:?} reaches outside the grid's {:?}", self.area);
        let start = self.area.index(x0, y);
        start..start + asked.width()
    }
}

/// Returns the corners, in cells, of the cells of `step` nodes that hold the nodes of an area.
pub(crate) fn corners(area: Area, step: i64) -> Area {
    let last = |past: i64| (past - 1).div_euclid(step) + 2;
    Area { x0: area.x0.div_euclid(step), y0: area.y0.div_euclid(step), x1: last(area.x1), y1: last(area.y1) }
}

/// Interpolates values at the nodes of an area from those at the [`corners`] of cells of `step` nodes.
pub(crate) fn between_corners(area: Area, step: i64, table: &[f32]) -> Vec<f32> {
    let Area { x0: i0, y0: j0, .. } = corners(area, step);
    let columns = corners(area, step).width();
    let mut out = vec![0.0; area.len()];
    let scale = 1.0 / step as f32;
    for (y, row) in (area.y0..area.y1).zip(out.chunks_exact_mut(area.width())) {
        let j = (y.div_euclid(step) - j0) as usize * columns;
        let v = y.rem_euclid(step) as f32 * scale;
        for (x, value) in (area.x0..area.x1).zip(row) {
            let i = j + (x.div_euclid(step) - i0) as usize;
            let u = x.rem_euclid(step) as f32 * scale;
            let north = table[i] + (table[i + 1] - table[i]) * u;
            let south = table[i + columns] + (table[i + columns + 1] - table[i + columns]) * u;
            *value = north + (south - north) * v;
        }
    }
    out
}

/// Interpolates values at the nodes of an area by a cubic B-spline from those at the [`corners`] of cells of `step`
/// nodes and at one more corner around them: smooth, and never beyond the corners' least and greatest value.
pub(crate) fn spline_between_corners(area: Area, step: i64, table: &[f32]) -> Vec<f32> {
    let inner = corners(area, step);
    let all = inner.padded(1);
    let scale = 1.0 / step as f32;
    let mut out = vec![0.0; area.len()];
    // The values of one row of nodes at the columns of corners.
    let mut along = vec![0.0; all.width()];
    for (y, row) in (area.y0..area.y1).zip(out.chunks_exact_mut(area.width())) {
        let first = (y.div_euclid(step) - inner.y0) as usize * all.width();
        let [a, b, c, d] = spline_weights(y.rem_euclid(step) as f32 * scale);
        let at = |down: usize| &table[first + down * all.width()..first + (down + 1) * all.width()];
        let rows = at(0).iter().zip(at(1)).zip(at(2)).zip(at(3));
        for (value, (((north, one), two), south)) in along.iter_mut().zip(rows) {
            *value = a * north + b * one + c * two + d * south;
        }
        let mut x = area.x0;
        while x < area.x1 {
            let cell = x.div_euclid(step);
            let end = ((cell + 1) * step).min(area.x1);
            let near = &along[(cell - inner.x0) as usize..][..4];
            for (at, value) in (x..end).zip(&mut row[(x - area.x0) as usize..(end - area.x0) as usize]) {
                let [a, b, c, d] = spline_weights((at - cell * step) as f32 * scale);
                *value = a * near[0] + b * near[1] + c * near[2] + d * near[3];
            }
            x = end;
        }
    }
    out
}

/// Returns the weights of four neighbours in a row at a share of the way from the second to the third.
fn spline_weights(t: f32) -> [f32; 4] {
    let left = 1.0 - t;
    let inner = |t: f32| (4.0 - 6.0 * t * t + 3.0 * t * t * t) / 6.0;
    [left * left * left / 6.0, inner(t), inner(left), t * t * t / 6.0]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_stand_at_their_vertices() {
        let mut grid = Grid::filled(Area::new(-2, 5, 4, 3), 0);
        grid.row_mut(6, -1, 1).copy_from_slice(&[7, 8]);
        assert_eq!((grid.at(-1, 6), grid.at(0, 6), grid.at(1, 6)), (7, 8, 0));
        assert_eq!(grid.values()[5..7], [7, 8]);
    }

    #[test]
    fn areas_agree_on_values_between_corners() {
        let plane = |x: i64, y: i64| (3 * x - 2 * y) as f32;
        let between = |area: Area| {
            let table: Vec<f32> = corners(area, 8).vertices().map(|(x, y)| plane(8 * x, 8 * y)).collect();
            between_corners(area, 8, &table)
        };
        for area in [Area::new(-9, -30, 25, 17), Area::new(0, 8, 9, 1), Area::new(7, -1, 1, 1)] {
            let expected: Vec<f32> = area.vertices().map(|(x, y)| plane(x, y)).collect();
            assert_eq!(between(area), expected);
        }
    }

    #[test]
    fn areas_agree_on_values_of_splines_between_corners_and_planes_stay_planes() {
        let rough = |x: i64, y: i64| ((x * x + 3 * y) % 7) as f32;
        let plane = |x: i64, y: i64| (24 * x - 16 * y) as f32;
        let between = |area: Area, of: &dyn Fn(i64, i64) -> f32| {
            let table: Vec<f32> = corners(area, 8).padded(1).vertices().map(|(x, y)| of(x, y)).collect();
            spline_between_corners(area, 8, &table)
        };
        let large = Area::new(-40, -50, 90, 80);
        let all = between(large, &rough);
        for area in [Area::new(-9, -30, 25, 17), Area::new(0, 8, 9, 1), Area::new(7, -1, 1, 1)] {
            let expected: Vec<f32> = area.vertices().map(|(x, y)| all[large.index(x, y)]).collect();
            assert_eq!(between(area, &rough), expected);
            for ((x, y), value) in area.vertices().zip(between(area, &plane)) {
                assert!((value - (3 * x - 2 * y) as f32).abs() < 1e-3, "{value} at {x}, {y}");
            }
        }
    }

    #[test]
    #[should_panic(expected = "reaches outside")]
    fn reading_outside_panics() {
        Grid::filled(Area::new(0, 0, 4, 4), 0).row(1, 0, 5);
    }
}
