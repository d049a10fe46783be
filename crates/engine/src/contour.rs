//! Contours, lines of equal height, through the squares of a lattice.
//!
//! The point where a contour crosses from one square to the next depends only on the two heights at the ends of the
//! shared edge, taken in a fixed order. So the contours of two neighbouring areas meet to the bit.

use std::collections::HashMap;

use crate::area::Area;
use crate::grid::Grid;

/// An edge of a square: x and y of its western or northern end, and true if the edge runs south.
pub type Edge = (i64, i64, bool);

/// Visits the squares of a lattice, `step` vertices a side and aligned to the origin, that overlap an area. Calls
/// `call` with the heights at the square's corners, clockwise from the north-western one, and with its north-western
/// corner.
pub fn for_each_square(heights: &Grid<f32>, area: Area, step: i64, mut call: impl FnMut([f32; 4], [i64; 2])) {
    let first = |at: i64| at.div_euclid(step) * step;
    let last = |at: i64| (at - 1).div_euclid(step) * step + step;
    for y in (first(area.y0)..last(area.y1)).step_by(step as usize) {
        for x in (first(area.x0)..last(area.x1)).step_by(step as usize) {
            call([[0, 0], [1, 0], [1, 1], [0, 1]].map(|[dx, dy]| heights.at(x + dx * step, y + dy * step)), [x, y]);
        }
    }
}

/// Finds the contours through the squares, `step` vertices a side, of an area, given the heights at their corners. Each
/// contour is returned as its number, its height in intervals above 0 m, with the edges that it crosses, in order.
/// Rings end where they begin.
pub fn crossed(heights: &Grid<f32>, area: Area, step: i64, interval_m: f64) -> Vec<(i64, Vec<Edge>)> {
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

/// Adds the segments of a level's contour through a square, each from edge to edge.
pub fn square(corners: [f32; 4], level: f32, [x, y]: [i64; 2], step: i64, segments: &mut Vec<[Edge; 2]>) {
    let above = corners.map(|corner| corner >= level);
    // Northern, eastern, southern and western edge.
    let edges = [(x, y, false), (x + step, y, true), (x, y + step, false), (x, y, true)];
    let crossed: Vec<usize> = (0..4).filter(|edge| above[*edge] != above[(edge + 1) % 4]).collect();
    match crossed[..] {
        [one, other] => segments.push([edges[one], edges[other]]),
        [_, _, _, _] => {
            // At a saddle, the height of the square's middle decides which corners belong together.
            let middle = ((corners[0] + corners[1]) + (corners[2] + corners[3])) * 0.25 >= level;
            let [first, second] = if middle == above[0] { [[0, 1], [2, 3]] } else { [[3, 0], [1, 2]] };
            segments.push(first.map(|edge| edges[edge]));
            segments.push(second.map(|edge| edges[edge]));
        }
        _ => {}
    }
}

/// Returns the point at which a level crosses an edge `step` vertices long, as a share of the edge's length.
pub fn share(heights: &Grid<f32>, (x, y, south): Edge, step: i64, level: f32) -> f64 {
    let end = if south { [x, y + step] } else { [x + step, y] };
    let (from, to) = (f64::from(heights.at(x, y)), f64::from(heights.at(end[0], end[1])));
    (f64::from(level) - from) / (to - from)
}

/// Joins segments into lines as long as possible; a ring ends where it begins.
pub fn chains(segments: &[[Edge; 2]]) -> Vec<Vec<Edge>> {
    let mut at: HashMap<Edge, Vec<usize>> = HashMap::with_capacity(segments.len() * 2);
    for (index, ends) in segments.iter().enumerate() {
        for end in ends {
            at.entry(*end).or_default().push(index);
        }
    }
    let mut used = vec![false; segments.len()];
    let mut lines = Vec::new();
    // First the open lines, from their ends; the segments that are left form rings.
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
