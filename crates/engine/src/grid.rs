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
    #[should_panic(expected = "reaches outside")]
    fn reading_outside_panics() {
        Grid::filled(Area::new(0, 0, 4, 4), 0).row(1, 0, 5);
    }
}
