//! An index of segments by place: which of many may come near to one.

use super::segment::{Reach, Segment, Segments, widened};
use crate::geometry::length;

/// Cells a side of an index at most, so that it is small beside what it indexes.
const MOST_CELLS: f64 = 64.0;

/// Segments, and which of them lie in each cell of a raster.
#[derive(Debug)]
pub struct IndexedSegments {
    /// The segments.
    pub segments: Segments,
    raster: Raster,
    /// The place in `numbers` at which each cell begins, row by row, and at last where they end.
    starts: Vec<u32>,
    /// The numbers of the segments whose middles lie in a cell, in order, cell by cell.
    numbers: Vec<u32>,
    /// The longest segment in grains.
    longest: f64,
    /// Half width in grains of the widest floor, and how much further the deepest lake makes a side matter.
    widest: [f64; 2],
}

/// A square of square cells; what lies beside it counts as in the cell at its edge.
#[derive(Clone, Copy, Debug)]
struct Raster {
    /// Its corner, relative to the segments' origin.
    corner: [f64; 2],
    /// Grains a side of a cell.
    cell: f64,
    /// Cells a side.
    side: usize,
}

impl Raster {
    /// The column, or the row, of a place.
    fn line(self, axis: usize, at: f64) -> usize {
        (((at - self.corner[axis]) / self.cell).max(0.0) as usize).min(self.side - 1)
    }
}

impl IndexedSegments {
    /// The index of segments, in cells of so many grains.
    pub fn new(segments: Segments, cell: f64) -> IndexedSegments {
        let middle = |segment: &Segment| [0, 1].map(|axis| segment.from[axis] + 0.5 * segment.along[axis]);
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for at in segments.all.iter().map(middle) {
            low = [low[0].min(at[0]), low[1].min(at[1])];
            high = [high[0].max(at[0]), high[1].max(at[1])];
        }
        let extent = (high[0] - low[0]).max(high[1] - low[1]).max(1.0);
        let cell = cell.max(extent / MOST_CELLS);
        let raster = Raster { corner: low, cell, side: (extent / cell) as usize + 1 };
        let cell_of = |segment: &Segment| {
            let [x, y] = middle(segment);
            raster.line(1, y) * raster.side + raster.line(0, x)
        };
        let cells: Vec<usize> = segments.all.iter().map(cell_of).collect();
        // How many each cell has, which says where the next one begins.
        let mut starts = vec![0; raster.side * raster.side + 1];
        for cell in &cells {
            starts[cell + 1] += 1;
        }
        for cell in 1..starts.len() {
            starts[cell] += starts[cell - 1];
        }
        let (mut next, mut numbers) = (starts.clone(), vec![0; cells.len()]);
        for (number, cell) in (0..).zip(cells) {
            numbers[next[cell] as usize] = number;
            next[cell] += 1;
        }
        let most = |width: fn(&Segment) -> f64| segments.all.iter().map(width).fold(0.0, f64::max);
        let widest = [most(Segment::widest_trough), most(|segment| segment.sunk)];
        let longest = segments.all.iter().map(|segment| length(segment.along)).fold(0.0, f64::max);
        IndexedSegments { segments, raster, starts, numbers, longest, widest }
    }

    /// The segments that may come so near to a place, relative to the segments' origin, with their numbers; in the order
    /// of the raster.
    pub fn around(&self, place: [f64; 2], distance: f64) -> impl Iterator<Item = (usize, &Segment)> {
        let reach = distance + 0.5 * self.longest;
        let [columns, rows] = [0, 1].map(|axis| [-reach, reach].map(|by| self.raster.line(axis, place[axis] + by)));
        // The cells of a row lie one after the other.
        let numbers = (rows[0]..=rows[1]).flat_map(move |row| {
            let [from, to] = [columns[0], columns[1] + 1].map(|column| self.starts[row * self.raster.side + column]);
            &self.numbers[from as usize..to as usize]
        });
        let all = numbers.map(|number| (*number as usize, &self.segments.all[*number as usize]));
        all.filter(move |(_, segment)| segment.line().touches(place, distance))
    }

    /// The segments whose sides have risen less, at a place, than that of a brook without a floor does within so many
    /// grains.
    pub fn beneath(&self, place: [f64; 2], brook: f64) -> Vec<&Segment> {
        let [trough, lake] = self.widest;
        let reach = Reach::even(brook);
        let is_beneath = |segment: &&Segment| segment.nearest(place).1 < segment.reach(reach).powi(2);
        let around = self.around(place, widened(brook, trough) + lake);
        around.map(|(_, segment)| segment).filter(is_beneath).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fluvial::Fluvial;
    use crate::fluvial::point::Point;
    use crate::preset::Preset;

    #[test]
    fn an_index_finds_what_a_look_at_all_finds() {
        let settings = Preset::load("alps").unwrap().1.fluvial.unwrap();
        let fluvial = Fluvial::new(&settings, 10.0, None, 4, None);
        let (cell, origin) = (fluvial.fields().side(2) as f64, Point { x: 1 << 30, y: -(1 << 29) });
        let square = [origin, origin.moved([6.0 * cell; 2])];
        let segments = fluvial.network().segments(3, square, origin, Reach::even(3.0 * cell));
        let index = IndexedSegments::new(segments, cell);
        let all = || index.segments.all.iter().enumerate();
        // In the square, at its edge, and where no segment is.
        for place in
            [[0.4, 0.7], [3.1, 2.2], [5.9, 0.0], [-2.0, 7.5], [80.0, 1.0]].map(|place| place.map(|at| at * cell))
        {
            let mut found: Vec<usize> = index.around(place, 1.3 * cell).map(|(number, _)| number).collect();
            found.sort_unstable();
            let near = all().filter(|(_, segment)| segment.line().touches(place, 1.3 * cell));
            assert_eq!(found, near.map(|(number, _)| number).collect::<Vec<_>>(), "around {place:?}");
            let reach = Reach::even(0.7 * cell);
            let beneath = all().filter(|(_, segment)| segment.nearest(place).1 < segment.reach(reach).powi(2)).count();
            assert_eq!(index.beneath(place, 0.7 * cell).len(), beneath, "beneath {place:?}");
        }
        assert!(index.segments.all.len() > 500, "{} segments", index.segments.all.len());
    }
}
