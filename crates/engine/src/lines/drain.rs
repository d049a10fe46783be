//! Drains: ditches and culverts for the water that cuts and fills of roads would dam, and fills where no drain is
//! possible.
//!
//! Where roads leave a pit, a vertex without a lower neighbour, the water follows the bare land: from each vertex to
//! the lowest one next to it, also through a shallow pit of the bare land. The drain cuts the land along that way,
//! evenly down to the first vertex that is low enough. If there is no such vertex, as above a wide bank or beside a
//! river that stands higher than the cutting, the hollow is filled until it overflows. No drain sees what another one
//! has cut or filled, and a drain overrides a fill, so their order does not matter.

use crate::area::Area;
use crate::grid::Grid;

/// Greatest length of a drain in vertices. Most are shorter; a hollow that needs a longer one is a gorge. Chosen by
/// eye.
const REACH: usize = 8;

/// Greatest distance in vertices from a hollow's lowest vertex to any that is filled. With their neighbours, filled
/// vertices then lie no further off than drains reach.
const FILL_REACH: usize = REACH / 2;

/// Metres by which the bare land along a drain may rise above its start: gullies leave pits of such a depth here and
/// there.
const CLIMB_M: f32 = 1.5;

/// Returns the area of land that the drains of an area depend on: the drains' whole length, and the vertices next to
/// it.
pub(super) fn input(area: Area) -> Area {
    area.padded(REACH + 1)
}

/// Cuts drains into heights that roads have shaped, given the heights of the bare land and, for each vertex, row by
/// row, whether it is wet: drains end at wet vertices. If the grids cover the [`input`] of an area, that area gets all
/// of its drains.
///
/// # Panics
/// When the three are not of the same area.
pub(super) fn drain(bare: &Grid<f32>, wet: &[bool], heights: &mut Grid<f32>) {
    let area = heights.area();
    assert_eq!(bare.area(), area, "bare land and heights are those of one area");
    assert_eq!(wet.len(), area.len(), "every vertex is wet or not");
    // Heights are read from a copy, so that no drain sees what another one has cut.
    let (bare, shaped, width) = (bare.values(), heights.values().to_vec(), area.width());
    let (mut drains, mut fills) = (Vec::new(), Vec::new());
    // Vertices at the edge lack neighbours. They belong to the pad, which nobody reads.
    let is_inside = |at: usize| (1..width - 1).contains(&(at % width)) && (width..shaped.len() - width).contains(&at);
    let is_pit = |at: usize| around(at, width).all(|other| shaped[other] >= shaped[at]);
    for start in (0..shaped.len()).filter(|at| is_inside(*at) && !wet[*at]) {
        if !is_pit(start) {
            continue;
        }
        let mut way = vec![start];
        while way.len() <= REACH && is_inside(way[way.len() - 1]) {
            let others = around(way[way.len() - 1], width).filter(|other| !way.contains(other));
            // Of equally low vertices, the first one is taken, wherever the area begins.
            let next = others.reduce(|low, other| if bare[other] < bare[low] { other } else { low });
            let Some(next) = next.filter(|next| bare[*next] < bare[start] + CLIMB_M) else { break };
            way.push(next);
            if shaped[next] < shaped[start] || wet[next] {
                break;
            }
        }
        // A pit that the bare land has too is not caused by a road.
        if way.iter().all(|at| shaped[*at].to_bits() == bare[*at].to_bits()) {
            continue;
        }
        let (top_m, end_m) = (shaped[start], shaped[way[way.len() - 1]]);
        if end_m < top_m {
            let fall_m = (end_m - top_m) / (way.len() - 1) as f32;
            drains.extend((0..way.len() - 1).map(|step| (way[step], top_m + fall_m * step as f32)));
        } else if let Some((hollow, level_m)) = hollow(start, &shaped, wet, width) {
            // A drain would end no lower than it begins.
            fills.extend(hollow.into_iter().map(|at| (at, level_m)));
        }
    }
    let heights = heights.values_mut();
    for (at, level_m) in fills {
        heights[at] = heights[at].max(level_m);
    }
    for (at, level_m) in drains {
        heights[at] = heights[at].min(level_m).min(shaped[at]);
    }
}

/// Returns the vertices of the hollow around a pit, and the height in metres at which it overflows; `None` if the
/// hollow is too large to be filled.
fn hollow(pit: usize, heights: &[f32], wet: &[bool], width: usize) -> Option<(Vec<usize>, f32)> {
    let (mut hollow, mut level_m) = (vec![pit], heights[pit]);
    let mut shore: Vec<usize> = Vec::new();
    loop {
        let last = hollow[hollow.len() - 1];
        let is_near = (last % width).abs_diff(pit % width).max((last / width).abs_diff(pit / width)) < FILL_REACH;
        let is_inside = (1..width - 1).contains(&(last % width)) && (width..heights.len() - width).contains(&last);
        if !is_near || !is_inside {
            return None;
        }
        let next = around(last, width).filter(|at| !hollow.contains(at));
        shore.extend(next.filter(|at| !shore.contains(at)).collect::<Vec<_>>());
        // Of equally low vertices the first one, wherever the area begins.
        let low = (0..shore.len()).min_by(|one, other| {
            let [one, other] = [one, other].map(|at| shore[*at]);
            heights[one].total_cmp(&heights[other]).then(one.cmp(&other))
        })?;
        let next = shore.swap_remove(low);
        if heights[next] < level_m || wet[next] {
            return Some((hollow, level_m.max(heights[next])));
        }
        level_m = heights[next];
        hollow.push(next);
    }
}

/// Returns the eight vertices around one that is not at the edge.
fn around(at: usize, width: usize) -> impl Iterator<Item = usize> {
    let rows = [at - width, at, at + width];
    rows.into_iter().flat_map(|middle| middle - 1..=middle + 1).filter(move |other| *other != at)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A valley that runs down to the east, and across it the dam or trench of a road. Returns the bare and the shaped
    /// heights.
    fn hollow_land(area: Area, dam_m: f32) -> (Grid<f32>, Grid<f32>) {
        let height_m = |x: i64, y: i64| (y - 3).abs() as f32 * 2.0 - x as f32;
        // A band two vertices wide, which sags to the valley's middle like the land.
        let road_m = |x: i64| if (10..=11).contains(&x) { dam_m } else { 0.0 };
        (Grid::of(area, height_m), Grid::of(area, |x, y| height_m(x, y) + road_m(x)))
    }

    fn pits(heights: &Grid<f32>) -> usize {
        let Area { x0, y0, x1, y1 } = heights.area();
        let is_pit = |x: i64, y: i64| {
            let lower = |(dx, dy): (i64, i64)| heights.at(x + dx, y + dy) < heights.at(x, y);
            !(-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (dx, dy))).any(lower)
        };
        (y0 + 1..y1 - 1).flat_map(|y| (x0 + 1..x1 - 1).map(move |x| (x, y))).filter(|(x, y)| is_pit(*x, *y)).count()
    }

    #[test]
    fn what_a_road_dams_runs_through_it() {
        let area = Area::new(0, -10, 24, 26);
        for dam_m in [5.0, -1.5] {
            let (bare, mut heights) = hollow_land(area, dam_m);
            assert!(pits(&bare) == 0 && pits(&heights) > 0, "{dam_m}");
            drain(&bare, &vec![false; area.len()], &mut heights);
            assert_eq!(pits(&heights), 0, "{dam_m}");
        }
    }

    #[test]
    fn a_shallow_pit_of_the_bare_land_does_not_stop_a_drain() {
        let area = Area::new(0, -10, 24, 26);
        let (mut bare, mut heights) = hollow_land(area, 5.0);
        // The land beyond the road rises a little above the land under it.
        for grid in [&mut bare, &mut heights] {
            grid.row_mut(3, 12, 13)[0] += 1.3;
        }
        assert_eq!(pits(&bare), 1);
        drain(&bare, &vec![false; area.len()], &mut heights);
        assert_eq!(pits(&heights), 0);
    }

    #[test]
    fn what_no_drain_leads_out_of_is_filled() {
        let area = Area::new(0, -10, 24, 26);
        let (bare, mut heights) = hollow_land(area, 0.0);
        let mut wet = vec![false; area.len()];
        for (at, (x, y)) in area.vertices().enumerate() {
            // A cutting three vertices long that goes deeper than the river beside it.
            wet[at] = x >= 13;
            if (10..13).contains(&x) && y == 3 {
                heights.row_mut(y, x, x + 1)[0] = -20.0;
            }
        }
        assert!(pits(&heights) > 0);
        drain(&bare, &wet, &mut heights);
        assert_eq!((10..14).map(|x| heights.at(x, 3)).collect::<Vec<_>>(), [-13.0; 4]);
        assert_eq!(pits(&heights.part(Area::new(0, -10, 10, 26))), 0);
    }

    #[test]
    fn nothing_outside_the_input_matters() {
        let area = Area::new(7, -1, 10, 8);
        let drained = |has_hollow: bool, outside_m: Option<f32>| {
            let (mut bare, mut heights) = hollow_land(Area::new(-10, -20, 44, 46), if has_hollow { 0.0 } else { 5.0 });
            // A hollow too deep for a drain. Its lowest vertex lies as far outside the area as one may that is filled
            // together with vertices inside.
            for x in (16..20).filter(|_| has_hollow) {
                heights.row_mut(3, x, x + 1)[0] = -40.0 - x as f32;
            }
            for grid in [&mut bare, &mut heights] {
                outside_m.inspect(|height_m| grid.fill_outside(input(area), *height_m));
            }
            let wet = vec![false; bare.values().len()];
            let shaped = heights.clone();
            drain(&bare, &wet, &mut heights);
            assert!(heights.part(area) != shaped.part(area), "nothing is drained or filled");
            heights.part(area).values().iter().map(|height_m| height_m.to_bits()).collect::<Vec<_>>()
        };
        for has_hollow in [false, true] {
            assert_eq!(drained(has_hollow, None), drained(has_hollow, Some(f32::NAN)));
        }
    }
}
