//! Contours: lines of equal height through the pixels of a map.
//!
//! The point at which a line crosses from one square of pixels to the next depends on the two heights there alone,
//! taken in a fixed order. So the lines of neighbouring areas meet to the bit.

use glam::{DVec2, dvec2};

use crate::area::Area;
use crate::contour::{Edge, chains, crossed, for_each_square, share, square};
use crate::grid::Grid;

/// Side, in pixels, of the squares in which lines are found. Squares are counted from the origin of the scale.
const STEP: i64 = 2;

/// Every `INDEX`th contour is an index contour.
pub(crate) const INDEX: i64 = 5;

/// A line of one height, in pixels of the scale.
pub(super) struct ContourLine {
    /// Number of intervals above 0 m.
    pub number: i64,
    /// Pixels east and south of the scale's origin.
    pub points: Vec<DVec2>,
}

impl ContourLine {
    /// True if the line is drawn as an index contour.
    pub fn is_index(&self) -> bool {
        self.number.rem_euclid(INDEX) == 0
    }
}

/// Finds the lines of a single height, in the same way as [`contours`]: shores.
pub(super) fn shores(heights: &Grid<f32>, area: Area, level_m: f32) -> Vec<Vec<DVec2>> {
    let mut segments = Vec::new();
    for_each_square(heights, area, STEP, |corners, at| square(corners, level_m, at, STEP, &mut segments));
    let line = |chain: Vec<Edge>| chain.into_iter().map(|edge| in_pixels(heights, edge, level_m)).collect();
    chains(&segments).into_iter().map(line).collect()
}

/// Finds the contours in an area and up to two pixels around it. `heights` has the heights at the centres of its pixels
/// and of some around it; `interval_m` is the contour interval.
pub(super) fn contours(heights: &Grid<f32>, area: Area, interval_m: f64) -> Vec<ContourLine> {
    let contour = |(number, chain): (i64, Vec<Edge>)| {
        let level = (number as f64 * interval_m) as f32;
        ContourLine { number, points: chain.into_iter().map(|edge| in_pixels(heights, edge, level)).collect() }
    };
    crossed(heights, area, STEP, interval_m).into_iter().map(contour).collect()
}

/// Returns the point, in pixels, at which a level crosses an edge.
fn in_pixels(heights: &Grid<f32>, (x, y, south): Edge, level: f32) -> DVec2 {
    let share = share(heights, (x, y, south), STEP, level) * STEP as f64;
    let [east, down] = if south { [0.0, share] } else { [share, 0.0] };
    // A pixel's height is the height at its centre.
    dvec2(x as f64 + 0.5 + east, y as f64 + 0.5 + down)
}

/// Largest number of contours between the lowest and the highest land. With more, the walls of a world that is flat
/// elsewhere would become one stain.
const MOST: f64 = 150.0;

/// Returns the contour interval in metres for the scale 1:`denominator`. Contours lie about `spacing_mm` apart on land
/// of slope `steepness` (rise over run), and about [`MOST`] at most fit into `range_m`, from the lowest to the highest
/// land.
pub(crate) fn interval_m(denominator: f64, spacing_mm: f64, steepness: f64, range_m: f64) -> f64 {
    let least_m = (spacing_mm * denominator / 1000.0 * steepness).max(range_m / MOST);
    let power = libm::pow(10.0, libm::floor(libm::log10(least_m)));
    [1.0, 2.0, 5.0, 10.0].map(|step| step * power).into_iter().find(|step| *step >= least_m * 0.8).unwrap_or(least_m)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cone(area: Area) -> Grid<f32> {
        Grid::of(area, |x, y| {
            let (east, south) = (x as f32 - 20.3, y as f32 - 31.7);
            500.0 - 9.0 * (east * east + south * south).sqrt()
        })
    }

    #[test]
    fn a_contour_lies_at_its_height_and_rings_close() {
        let area = Area::new(-40, -40, 130, 140);
        let heights = cone(area.padded(4));
        let lines = contours(&heights, area, 20.0);
        let mut rings = 0;
        for line in &lines {
            for DVec2 { x, y } in &line.points {
                let (east, south) = (x - 0.5 - 20.3, y - 0.5 - 31.7);
                let height_m = 500.0 - 9.0 * (east * east + south * south).sqrt();
                let near_top = line.number as f64 * 20.0 > 460.0;
                assert!(
                    (height_m - line.number as f64 * 20.0).abs() < 1.0 || near_top,
                    "{height_m} of {}",
                    line.number
                );
            }
            rings += usize::from(line.points[0] == line.points[line.points.len() - 1]);
        }
        assert!(rings >= 20, "{rings} rings of {}", lines.len());
        assert!(lines.iter().any(ContourLine::is_index));
    }

    #[test]
    fn contours_are_as_high_as_they_say() {
        let area = Area::new(-100, -100, 300, 300);
        let heights = Grid::of(area.padded(4), |x, y| {
            let (east, south) = (x as f32 * 0.11, y as f32 * 0.07);
            900.0 + 300.0 * east.sin() * south.cos() + 2.0 * (x - y) as f32
        });
        let height_at = |DVec2 { x, y }| {
            // Heights belong to pixel centres, and edges span two pixels.
            let at = |at: f64| ((at - 0.5) / STEP as f64).floor() as i64 * STEP;
            let (west, north) = (at(x), at(y));
            let (east, down) = (x - 0.5 - west as f64, y - 0.5 - north as f64);
            let height = |dx: i64, dy: i64| f64::from(heights.at(west + dx, north + dy));
            let share = east.max(down) / STEP as f64;
            let next = if east > 0.0 { height(STEP, 0) } else { height(0, STEP) };
            height(0, 0) + (next - height(0, 0)) * share
        };
        let lines = contours(&heights, area, 100.0);
        let points: Vec<(f64, DVec2)> = lines
            .iter()
            .flat_map(|line| line.points.iter().map(|point| (line.number as f64 * 100.0, *point)))
            .collect();
        assert!(points.len() > 10_000, "{} points", points.len());
        for (level_m, point) in points {
            assert!((height_at(point) - level_m).abs() < 1e-6, "{} at {point:?}, not {level_m}", height_at(point));
        }
    }

    #[test]
    fn intervals_are_round_and_grow_with_the_scale() {
        let intervals = [25_000.0, 50_000.0, 250_000.0, 2_000_000.0].map(|scale| interval_m(scale, 0.6, 1.0, 2800.0));
        assert_eq!(intervals, [20.0, 50.0, 200.0, 1000.0]);
        assert_eq!(interval_m(25_000.0, 0.6, 0.1, 200.0), 2.0);
        assert_eq!(interval_m(25_000.0, 0.6, 0.1, 500.0), 5.0, "the walls of a canyon");
    }
}
