//! Contours: lines of equal height through the pixels of a map.
//!
//! Where a line crosses from a square of pixels to the next depends on the two heights there alone, taken in one order, so the
//! lines of two areas meet to the bit.

use std::collections::HashMap;

use crate::area::Area;
use crate::grid::Grid;

/// Pixels a side of the squares that lines are found in, counted from the origin of the scale.
const STEP: i64 = 2;

/// Each so manieth line is an index line.
pub(crate) const INDEX: i64 = 5;

/// A line of one height, in pixels of the scale.
pub(super) struct Contour {
    /// How many intervals it is above 0 m.
    pub number: i64,
    /// East and south of the scale's origin, in pixels.
    pub points: Vec<[f64; 2]>,
}

impl Contour {
    /// Whether it is drawn as an index line.
    pub fn is_index(&self) -> bool {
        self.number.rem_euclid(INDEX) == 0
    }
}

/// The lines of one height, as [`contours`] has them: shores.
pub(super) fn shores(heights: &Grid<f32>, area: Area, level_m: f32) -> Vec<Vec<[f64; 2]>> {
    let mut segments = Vec::new();
    for_each_square(heights, area, STEP, |corners, at| square(corners, level_m, at, STEP, &mut segments));
    let line = |chain: Vec<Edge>| chain.into_iter().map(|edge| in_pixels(heights, edge, level_m)).collect();
    chains(&segments).into_iter().map(line).collect()
}

/// Calls with the heights at the corners of each square of so many a side that lies in an area and around it, from the
/// north-western one clockwise.
fn for_each_square(heights: &Grid<f32>, area: Area, step: i64, mut call: impl FnMut([f32; 4], [i64; 2])) {
    let first = |at: i64| at.div_euclid(step) * step;
    let last = |at: i64| (at - 1).div_euclid(step) * step + step;
    for y in (first(area.y0)..last(area.y1)).step_by(step as usize) {
        for x in (first(area.x0)..last(area.x1)).step_by(step as usize) {
            call([[0, 0], [1, 0], [1, 1], [0, 1]].map(|[dx, dy]| heights.at(x + dx * step, y + dy * step)), [x, y]);
        }
    }
}

/// An edge of a square: its western or northern end, and whether it runs south.
pub(crate) type Edge = (i64, i64, bool);

/// The contours in an area and up to two pixels around it, given the heights at the middles of its pixels and of some
/// around, and the metres between two lines.
pub(super) fn contours(heights: &Grid<f32>, area: Area, interval_m: f64) -> Vec<Contour> {
    let contour = |(number, chain): (i64, Vec<Edge>)| {
        let level = (number as f64 * interval_m) as f32;
        Contour { number, points: chain.into_iter().map(|edge| in_pixels(heights, edge, level)).collect() }
    };
    crossed(heights, area, STEP, interval_m).into_iter().map(contour).collect()
}

/// The contours through the squares, of so many a side, of an area, given the heights at their corners: how many intervals each is
/// above 0 m, and the edges that it crosses, one after the other. Rings end where they begin.
pub(crate) fn crossed(heights: &Grid<f32>, area: Area, step: i64, interval_m: f64) -> Vec<(i64, Vec<Edge>)> {
    let mut segments: HashMap<i64, Vec<[Edge; 2]>> = HashMap::new();
    for_each_square(heights, area, step, |corners, at| {
        let (low, high) = corners.iter().fold((f32::MAX, f32::MIN), |(low, high), &m| (low.min(m), high.max(m)));
        let from = (f64::from(low) / interval_m).ceil() as i64;
        for number in from..=(f64::from(high) / interval_m).floor() as i64 {
            square(corners, (number as f64 * interval_m) as f32, at, step, segments.entry(number).or_default());
        }
    });
    let mut numbers: Vec<i64> = segments.keys().copied().collect();
    numbers.sort_unstable();
    let lines = |number: i64| chains(&segments[&number]).into_iter().map(move |chain| (number, chain));
    numbers.into_iter().flat_map(lines).collect()
}

/// Adds the lines of a level through a square: from edge to edge.
fn square(corners: [f32; 4], level: f32, [x, y]: [i64; 2], step: i64, segments: &mut Vec<[Edge; 2]>) {
    let above = corners.map(|corner| corner >= level);
    // Northern, eastern, southern and western edge.
    let edges = [(x, y, false), (x + step, y, true), (x, y + step, false), (x, y, true)];
    let crossed: Vec<usize> = (0..4).filter(|edge| above[*edge] != above[(edge + 1) % 4]).collect();
    match crossed[..] {
        [one, other] => segments.push([edges[one], edges[other]]),
        [_, _, _, _] => {
            // A saddle: its middle says which corners belong together.
            let middle = ((corners[0] + corners[1]) + (corners[2] + corners[3])) * 0.25 >= level;
            let [first, second] = if middle == above[0] { [[0, 1], [2, 3]] } else { [[3, 0], [1, 2]] };
            segments.push(first.map(|edge| edges[edge]));
            segments.push(second.map(|edge| edges[edge]));
        }
        _ => {}
    }
}

/// Where a level crosses an edge, in pixels.
fn in_pixels(heights: &Grid<f32>, (x, y, south): Edge, level: f32) -> [f64; 2] {
    let share = share(heights, (x, y, south), STEP, level) * STEP as f64;
    let [east, down] = if south { [0.0, share] } else { [share, 0.0] };
    // A pixel's height is that of its middle.
    [x as f64 + 0.5 + east, y as f64 + 0.5 + down]
}

/// How far along an edge, of so many, a level crosses it: a share of it.
pub(crate) fn share(heights: &Grid<f32>, (x, y, south): Edge, step: i64, level: f32) -> f64 {
    let end = if south { [x, y + step] } else { [x + step, y] };
    let (from, to) = (f64::from(heights.at(x, y)), f64::from(heights.at(end[0], end[1])));
    (f64::from(level) - from) / (to - from)
}

/// Segments joined into lines as long as they can be; a ring ends where it begins.
fn chains(segments: &[[Edge; 2]]) -> Vec<Vec<Edge>> {
    let mut at: HashMap<Edge, Vec<usize>> = HashMap::with_capacity(segments.len() * 2);
    for (index, ends) in segments.iter().enumerate() {
        for end in ends {
            at.entry(*end).or_default().push(index);
        }
    }
    let mut used = vec![false; segments.len()];
    let mut lines = Vec::new();
    // Open lines from their ends first, then what is left: rings.
    let is_end = |index: usize| segments[index].iter().any(|end| at[end].len() == 1);
    let order = (0..segments.len()).filter(|index| is_end(*index)).chain(0..segments.len());
    for start in order {
        if used[start] {
            continue;
        }
        used[start] = true;
        let [a, b] = segments[start];
        let mut line = if at[&a].len() == 1 { vec![a, b] } else { vec![b, a] };
        loop {
            let end = line[line.len() - 1];
            let Some(&next) = at[&end].iter().find(|index| !used[**index]) else { break };
            used[next] = true;
            let [a, b] = segments[next];
            line.push(if a == end { b } else { a });
        }
        lines.push(line);
    }
    lines
}

/// Contours from the lowest to the highest land at most: with more of them the walls of a world that is flat elsewhere would be
/// one stain.
const MOST: f64 = 150.0;

/// Metres between two contours for a scale, about so many millimetres apart on land that rises so many metres a metre ahead, and
/// so many metres from the lowest to the highest.
pub(crate) fn interval_m(denominator: f64, spacing_mm: f64, steepness: f64, range_m: f64) -> f64 {
    let least_m = (spacing_mm * denominator / 1000.0 * steepness).max(range_m / MOST);
    let power = libm::pow(10.0, libm::floor(libm::log10(least_m)));
    [1.0, 2.0, 5.0, 10.0].map(|step| step * power).into_iter().find(|step| *step >= least_m * 0.8).unwrap_or(least_m)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cone(area: Area) -> Grid<f32> {
        let mut grid = Grid::filled(area, 0.0);
        for (x, y) in area.vertices() {
            let (east, south) = (x as f32 - 20.3, y as f32 - 31.7);
            grid.row_mut(y, x, x + 1)[0] = 500.0 - 9.0 * (east * east + south * south).sqrt();
        }
        grid
    }

    #[test]
    fn a_contour_lies_at_its_height_and_rings_close() {
        let area = Area::new(-40, -40, 130, 140);
        let heights = cone(area.padded(4));
        let lines = contours(&heights, area, 20.0);
        let mut rings = 0;
        for line in &lines {
            for [x, y] in &line.points {
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
        assert!(lines.iter().any(Contour::is_index));
    }

    #[test]
    fn contours_are_as_high_as_they_say() {
        let area = Area::new(-100, -100, 300, 300);
        let mut heights = Grid::filled(area.padded(4), 0.0);
        for (x, y) in heights.area().vertices() {
            let (east, south) = (x as f32 * 0.11, y as f32 * 0.07);
            heights.row_mut(y, x, x + 1)[0] = 900.0 + 300.0 * east.sin() * south.cos() + 2.0 * (x - y) as f32;
        }
        let height_at = |[x, y]: [f64; 2]| {
            // Heights are those of the middles of pixels, and lines go from one to the next but one.
            let at = |at: f64| ((at - 0.5) / STEP as f64).floor() as i64 * STEP;
            let (west, north) = (at(x), at(y));
            let (east, down) = (x - 0.5 - west as f64, y - 0.5 - north as f64);
            let height = |dx: i64, dy: i64| f64::from(heights.at(west + dx, north + dy));
            let share = east.max(down) / STEP as f64;
            let next = if east > 0.0 { height(STEP, 0) } else { height(0, STEP) };
            height(0, 0) + (next - height(0, 0)) * share
        };
        let lines = contours(&heights, area, 100.0);
        let points: Vec<(f64, [f64; 2])> = lines
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
