//! Sky shading and cast shadow: the share of the sky that the ground sees, and the ground that lies in shadow. Both are
//! wide and soft, so they are computed at every eighth pixel only.

use crate::area::Area;
use crate::grid::Grid;

/// Pixels between the nodes at which the sky is computed, counted from the origin of the scale; and how many nodes away
/// the horizon is looked for.
const STEP: i64 = 8;
const FAR: i64 = 4;

/// Pixels to each side of a node over which its height is averaged.
const NEAR: i64 = 2;

/// Pixels around an area whose heights its sky depends on.
pub(super) const REACH: usize = (STEP * (FAR + 1) + NEAR + 2) as usize;

/// Share of the sky that land of usual relief sees. Land that sees less is drawn darker, land that sees more lighter.
const USUAL: f32 = 0.9;

/// Slope (rise over run) of the horizon towards the sun from which on land lies in shadow; and how much steeper the
/// horizon is in full shadow.
const SUN_RISE: f32 = 0.5;
const SOFT: f32 = 0.35;

/// The eight directions, east and south.
const WAYS: [[i64; 2]; 8] = [[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1]];

/// Returns the nodes that the sky over an area depends on: those around the area, and [`FAR`] more on each side.
fn nodes(area: Area) -> Area {
    let span = |from: i64, to: i64| (from.div_euclid(STEP), (to - 1).div_euclid(STEP) + 2);
    let ((x0, x1), (y0, y1)) = (span(area.x0, area.x1), span(area.y0, area.y1));
    Area { x0: x0 - FAR, y0: y0 - FAR, x1: x1 + FAR, y1: y1 + FAR }
}

/// Returns the weights of the eight directions as directions to the sun, by nearness, and their sum. Only directions
/// within 45 degrees of the sun count.
fn way_shares(sun: [f32; 2]) -> ([f32; 8], f32) {
    let shares = WAYS.map(|[dx, dy]| {
        let long = ((dx * dx + dy * dy) as f32).sqrt();
        let cos = (dx as f32 * sun[0] + dy as f32 * sun[1]) / long;
        (cos - std::f32::consts::FRAC_1_SQRT_2).max(0.0)
    });
    (shares, shares.iter().sum::<f32>().max(1e-6))
}

/// Returns the change of tone over an area: lighter by the visible sky, darker by cast shadow. Needs heights of the
/// area and [`REACH`] around it, the factor from metres to exaggerated slopes, the direction to the sun, and the
/// strengths of both.
pub(super) fn openness(heights: &Grid<f32>, area: Area, per_m: f32, sun: [f32; 2], [sky, cast]: [f32; 2]) -> Grid<f32> {
    let wide = nodes(area);
    let coarse = Grid::of(wide, |x, y| {
        let corners = [[0, 0], [-NEAR, -NEAR], [NEAR, -NEAR], [-NEAR, NEAR], [NEAR, NEAR]];
        let sum: f32 = corners.iter().map(|[dx, dy]| heights.at(x * STEP + dx, y * STEP + dy)).sum();
        sum / corners.len() as f32
    });
    let nodes = Area { x0: wide.x0 + FAR, y0: wide.y0 + FAR, x1: wide.x1 - FAR, y1: wide.y1 - FAR };
    let (shares, all) = way_shares(sun);
    let seen = Grid::of(nodes, |x, y| {
        // The steepest rise to a node in each direction: the horizon.
        let rises = WAYS.map(|[dx, dy]| {
            let long = if dx != 0 && dy != 0 { std::f32::consts::SQRT_2 } else { 1.0 };
            (1..=FAR)
                .map(|far| {
                    let rise_m = coarse.at(x + dx * far, y + dy * far) - coarse.at(x, y);
                    rise_m * per_m / ((STEP * far) as f32 * long)
                })
                .fold(0.0f32, f32::max)
        });
        let hidden = rises.iter().map(|rise| rise / (1.0 + rise * rise).sqrt()).sum::<f32>() / WAYS.len() as f32;
        let rise = rises.iter().zip(shares).map(|(rise, share)| rise * share).sum::<f32>() / all;
        let shadow = ((rise - SUN_RISE) / SOFT).clamp(0.0, 1.0);
        sky * (1.0 - hidden - USUAL) - cast * shadow
    });
    let mut shade = Grid::filled(area, 0.0f32);
    let share = |at: i64| (at.rem_euclid(STEP) as f32 + 0.5) / STEP as f32;
    let shares: [f32; STEP as usize] = std::array::from_fn(|at| share(at as i64));
    let mut between = vec![0.0f32; nodes.width()];
    for y in area.y0..area.y1 {
        let (row, down) = (y.div_euclid(STEP), share(y));
        let (north, south) = (seen.row(row, nodes.x0, nodes.x1), seen.row(row + 1, nodes.x0, nodes.x1));
        for ((value, north), south) in between.iter_mut().zip(north).zip(south) {
            *value = north + (south - north) * down;
        }
        // Interpolate from node to node; the first and the last node may lie outside the area.
        let mut out = shade.row_mut(y, area.x0, area.x1);
        let mut skipped = area.x0.rem_euclid(STEP) as usize;
        for pair in between.windows(2) {
            let count = (STEP as usize - skipped).min(out.len());
            let (here, rest) = out.split_at_mut(count);
            for (value, share) in here.iter_mut().zip(&shares[skipped..]) {
                *value = pair[0] + (pair[1] - pair[0]) * share;
            }
            (out, skipped) = (rest, 0);
        }
    }
    shade
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn valleys_see_less_of_the_sky_than_ridges_and_lie_in_shadow() {
        let area = Area::new(-20, -20, 120, 60);
        // North-south ridges, 80 pixels apart, with sides of 45 degrees.
        let ridges = |x: i64, _| 400.0 - 10.0 * ((x + 40).rem_euclid(80) - 40).abs() as f32;
        let heights = Grid::of(area.padded(REACH), ridges);
        let west = [-1.0, 0.0];
        let open = openness(&heights, area, 0.1, west, [1.0, 0.0]);
        let (ridge, valley) = (open.at(0, 0), open.at(40, 0));
        assert!(ridge > 0.0 && valley < -0.1, "{ridge} {valley}");
        let cast = openness(&heights, area, 0.1, west, [0.0, 1.0]);
        let (lit, shaded) = (cast.at(70, 0), cast.at(10, 0));
        assert!(lit == 0.0 && shaded < -0.5, "{lit} {shaded}");
        // A part of an area gets the same values as the whole area there.
        let part = Area::new(3, 5, 30, 20);
        let own = openness(&heights, part, 0.1, west, [1.0, 1.0]);
        let whole = openness(&heights, area, 0.1, west, [1.0, 1.0]);
        assert!(part.vertices().all(|(x, y)| own.at(x, y) == whole.at(x, y)));
    }
}
