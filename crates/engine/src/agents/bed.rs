//! Lines made of the agents' traces: smooth, with width and floor.

use crate::agents::search::Node;
use crate::agents::settings::{RiverAgents, RoadAgents};
use crate::lines::{self, Bed, Line, LineEnd, LineId, LineKind, LinePoint};

/// Share of the depth of a river's bed that is filled with water.
const FILLED: f32 = 0.75;

/// Number of nodes on each side over which positions are averaged, so that the staircase of the search becomes a line.
const SMOOTHING: usize = 5;

/// Number of nodes from a point to the next: about the width of a bed.
const NODES_A_POINT: usize = 3;

/// Makes the river along the nodes of a trace; `heights_m` are the heights of the un-carved ground there.
///
/// `before_cells` is the length of the river upstream of the first node, and `reach_cells` the longest way that it can
/// take. Width and depth grow from the source to that length.
///
/// # Panics
/// When there are no nodes, or the number of heights differs.
pub fn river(
    id: LineId,
    nodes: &[Node],
    heights_m: &[f32],
    agents: &RiverAgents,
    spacing_m: f64,
    [before_cells, reach_cells]: [f32; 2],
) -> Line {
    assert_eq!(nodes.len(), heights_m.len(), "a height belongs to each node");
    let grown = |[source, end]: [f64; 2], step: usize| {
        source as f32 + (end - source) as f32 * ((before_cells + step as f32) / reach_cells).min(1.0)
    };
    // The banks never rise downstream.
    let lower = |lowest_m: &mut f32, height_m: &f32| {
        *lowest_m = lowest_m.min(*height_m);
        Some(*lowest_m)
    };
    let banks_m: Vec<f32> = heights_m.iter().scan(f32::INFINITY, lower).collect();
    let point = |step: usize, place: [f64; 2]| {
        // The floor lies below the banks, with a depth that grows downstream.
        let depth_m = grown(agents.depth_m, step);
        LinePoint {
            place,
            level_m: f64::from(banks_m[step] - depth_m * (1.0 - FILLED)),
            floor_m: f64::from(banks_m[step] - depth_m),
            half_width_m: f64::from(grown(agents.width_m, step) / 2.0),
            discharge_m3s: 0.0,
            basin_m2: 0.0,
        }
    };
    along(id, LineKind::River, nodes, point, Bed::Dug { bank_m: agents.bank_m }, spacing_m)
}

/// Makes the road along the nodes of a trace, which may be any number of vertices apart; `heights_m` are the heights of
/// the ground there.
///
/// # Panics
/// When there are no nodes, or the number of heights differs.
pub fn road(id: LineId, nodes: &[Node], heights_m: &[f32], agents: &RoadAgents, spacing_m: f64) -> Line {
    assert_eq!(nodes.len(), heights_m.len(), "a height belongs to each node");
    let last = nodes.len() - 1;
    let steps = agents.step_cells as usize;
    // Adds nodes until they are one vertex apart as in rivers, so that both are smoothed alike.
    let (mut fine, mut levels_m) = (Vec::new(), Vec::new());
    for (index, &(x, y)) in nodes.iter().enumerate() {
        let (next, next_m) = (nodes[(index + 1).min(last)], heights_m[(index + 1).min(last)]);
        for step in 0..if index == last { 1 } else { steps } {
            let (share, side) = (step as i64, steps as i64);
            fine.push((x + (next.0 - x) * share / side, y + (next.1 - y) * share / side));
            levels_m.push(heights_m[index] + (next_m - heights_m[index]) * (step as f32 / steps as f32));
        }
    }
    let half_width_m = f64::from(agents.width_m as f32 / 2.0);
    let point = |step: usize, place: [f64; 2]| {
        let level_m = f64::from(levels_m[step]);
        LinePoint { place, level_m, floor_m: level_m, half_width_m, discharge_m3s: 0.0, basin_m2: 0.0 }
    };
    let bed = Bed::Trodden { shoulder_m: agents.shoulder_m, graded: agents.graded };
    along(id, LineKind::Road, &fine, point, bed, spacing_m)
}

/// Makes a smoothed line along nodes that are one vertex apart. The ends keep their places.
fn along(
    id: LineId,
    kind: LineKind,
    nodes: &[Node],
    point: impl Fn(usize, [f64; 2]) -> LinePoint,
    bed: Bed,
    spacing_m: f64,
) -> Line {
    let origin = *nodes.first().expect("a trace has a node");
    let last = nodes.len() - 1;
    let smoothed = |step: usize| {
        let reach = SMOOTHING.min(step).min(last - step);
        let around = &nodes[step - reach..=step + reach];
        let mean = |coordinate: fn(&Node) -> i64, from: i64| {
            f64::from(around.iter().map(|node| coordinate(node) - from).sum::<i64>() as f32 / around.len() as f32)
        };
        point(step, [mean(|node| node.0, origin.0), mean(|node| node.1, origin.1)])
    };
    let origin = [origin.0, origin.1];
    let points: Vec<LinePoint> = (0..last).step_by(NODES_A_POINT).chain([last]).map(smoothed).collect();
    Line {
        id,
        kind,
        class: None,
        name: None,
        course: id,
        origin,
        bounds: lines::bounds(origin, &points, reach(&points, bed, spacing_m)),
        points,
        structures: Vec::new(),
        end: LineEnd::Nothing,
        bed,
        spacing_m,
    }
}

/// Adds a pond at the end of a river, `widths` times as wide as the river there.
pub(super) fn with_pond(mut river: Line, widths: f32) -> Line {
    let end = river.points[river.points.len() - 1];
    river.points.push(LinePoint { half_width_m: f64::from(end.half_width_m as f32 * widths), ..end });
    river.bounds = lines::bounds(river.origin, &river.points, reach(&river.points, river.bed, river.spacing_m));
    river.end = LineEnd::Pond;
    river
}

/// Returns the largest distance in vertices from the middle of a line at which it has an effect.
fn reach(points: &[LinePoint], bed: Bed, spacing_m: f64) -> f64 {
    let bank_m = match bed {
        Bed::Dug { bank_m } | Bed::Built { bank_m } => bank_m,
        Bed::Trodden { shoulder_m, .. } => shoulder_m,
        Bed::Natural => 0.0,
    };
    let widest_m = points.iter().map(|point| point.half_width_m).fold(0.0, f64::max);
    (widest_m + bank_m) / spacing_m
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::area::{Area, TileId};
    use crate::grid::Grid;
    use crate::lines::Imprint;

    fn id(kind: LineKind) -> LineId {
        LineId::Agent { kind, owner: TileId { x: 0, y: 0 } }
    }

    fn a_river() -> Line {
        let nodes: Vec<Node> = (0..200).map(|x| (x - 100, x / 4)).collect();
        let heights: Vec<f32> = (0..200).map(|x| 50.0 - 0.1 * x as f32 + (x % 7) as f32 * 0.3).collect();
        river(id(LineKind::River), &nodes, &heights, &RiverAgents::default(), 1.0, [0.0, 300.0])
    }

    fn a_road(nodes: &[Node], heights_m: &[f32]) -> Line {
        let agents = RoadAgents { graded: true, ..RoadAgents::default() };
        road(id(LineKind::Road), nodes, heights_m, &agents, 1.0)
    }

    fn shaped(bare: &Grid<f32>, lines: &[&Line]) -> (Imprint, Grid<f32>) {
        let imprint = Imprint::new(bare, None, lines.iter().copied()).expect("the lines are here");
        let mut heights = bare.clone();
        imprint.shape(&mut heights, None);
        (imprint, heights)
    }

    #[test]
    fn a_rivers_floor_never_rises_and_its_bed_never_narrows() {
        for pair in a_river().points.windows(2) {
            assert!(pair[1].floor_m <= pair[0].floor_m && pair[1].half_width_m >= pair[0].half_width_m, "{pair:?}");
        }
    }

    #[test]
    fn lines_do_exactly_nothing_past_their_reach() {
        for line in [a_river(), a_road(&[(-50, 0), (-43, 0), (-43, 7)], &[60.0; 3])] {
            let area = line.bounds.padded(20);
            let bare = Grid::filled(area, 55.0f32);
            let (imprint, shaped) = shaped(&bare, &[&line]);
            assert_ne!(shaped, bare, "a line leaves a trace");
            let reach_m = reach(&line.points, line.bed, 1.0);
            for (x, y) in area.vertices() {
                let distance = line.points.iter().map(|point| {
                    let [east, south] = line.place_from([x, y], point);
                    (east * east + south * south).sqrt()
                });
                // The line between two points is at most 2 vertices away from the nearer point.
                if distance.fold(f64::INFINITY, f64::min) > reach_m + 2.0 {
                    let grids =
                        imprint.sand().into_iter().chain(imprint.dirt()).chain(imprint.dug().map(|dug| &dug.water));
                    let traces: f32 = grids.map(|grid| grid.at(x, y)).sum();
                    assert_eq!((shaped.at(x, y), traces), (55.0, 0.0), "vertex ({x}, {y})");
                }
            }
        }
    }

    #[test]
    fn the_order_of_lines_does_not_matter() {
        let one = a_river();
        let nodes: Vec<Node> = (0..60).map(|y| (20, y - 10)).collect();
        let other = river(id(LineKind::River), &nodes, &[44.0; 60], &RiverAgents::default(), 1.0, [0.0, 100.0]);
        let road = a_road(&[(0, 20), (7, 20), (14, 20)], &[47.0, 48.0, 46.0]);
        let bare = Grid::filled(Area::new(-40, -20, 120, 90), 50.0f32);
        assert_eq!(shaped(&bare, &[&one, &other, &road]).1, shaped(&bare, &[&road, &other, &one]).1);
    }
}
