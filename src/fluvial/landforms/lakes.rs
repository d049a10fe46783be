//! Lakes: the outline of the water around a node of the trunk lattice.

use crate::area::Area;
use crate::clock::Clock;
use crate::fluvial::Fluvial;
use crate::fluvial::landforms::contour::{contours, twice_area};
use crate::fluvial::point::{GRAINS, Point};
use crate::fluvial::trunk::NodeId;
use crate::geometry::LineSegment;
use crate::grid::Grid;
use crate::land::WaterKind;
use crate::lines::LineId;
use crate::memory::heap_bytes;

/// A lake.
#[derive(Clone, Debug, PartialEq)]
pub struct Lake {
    /// The node of the trunk lattice that it lies around: its name in the world.
    pub id: NodeId,
    /// Its shore, anticlockwise in a map, and those of its islands, clockwise: rings in vertices east and south of the
    /// origin, each ending where it begins.
    pub rings: Vec<Vec<[f64; 2]>>,
    /// Height of its surface in metres.
    pub level_m: f64,
    /// Square metres within the shore, without islands.
    pub area_m2: f64,
    /// The river that runs out of it.
    pub outlet: Option<LineId>,
}

heap_bytes!(Lake: rings);

/// The least metres by which the shore is under or above the water at a vertex: no crossing lies on a vertex.
const LEAST_M: f32 = 1e-3;

impl Lake {
    /// The lake at a node that has one; `None` if it shows at no vertex.
    pub(crate) fn new(fluvial: &Fluvial, id: NodeId) -> Option<Lake> {
        let area = surroundings(fluvial, id);
        let land = fluvial.land(area, &Clock::default());
        let water = land.water?;
        let drained = fluvial.network().trunks().drained(id);
        let level_m = fluvial.lifted_m(drained.level_m);
        // What is connected to the vertex of the lake that is nearest to the node.
        let node = fluvial.in_world(fluvial.network().trunks().node(id).at);
        let distance = |(x, y): (i64, i64)| (Point::at_vertex(x, y).distance(node), x, y);
        let is_lake = |(x, y): (i64, i64)| water.kind.at(x, y) == WaterKind::Lake;
        let vertices = area.vertices();
        let first = vertices
            .filter(|at| is_lake(*at))
            .min_by(|a, b| distance(*a).partial_cmp(&distance(*b)).expect("distances are numbers"))?;
        if distance(first).0 > drained.lake {
            return None;
        }
        let mut values = Grid::filled(area, -LEAST_M);
        for y in area.y0..area.y1 {
            let heights = land.heights.row(y, area.x0, area.x1);
            for (value, height_m) in values.row_mut(y, area.x0, area.x1).iter_mut().zip(heights) {
                *value = (level_m as f32 - height_m).min(-LEAST_M);
            }
        }
        let mut open = vec![first];
        while let Some((x, y)) = open.pop() {
            let value = &mut values.row_mut(y, x, x + 1)[0];
            if *value > 0.0 {
                continue;
            }
            *value = water.depth_m.at(x, y).max(LEAST_M);
            let around = [(x, y - 1), (x - 1, y), (x + 1, y), (x, y + 1)];
            open.extend(
                around.into_iter().filter(|(x, y)| area.contains(&Area::new(*x, *y, 1, 1)) && is_lake((*x, *y))),
            );
        }
        // At the border of what is looked at a lake ends, so that its shore is closed.
        for y in area.y0..area.y1 {
            for x in area.x0..area.x1 {
                if x == area.x0 || y == area.y0 || x + 1 == area.x1 || y + 1 == area.y1 {
                    values.row_mut(y, x, x + 1)[0] = -LEAST_M;
                }
            }
        }
        let mut rings: Vec<Vec<[f64; 2]>> = contours(&values).into_iter().map(|contour| contour.points).collect();
        // The shore runs the other way round than those of islands.
        let shore = rings.iter().position(|ring| twice_area(ring) > 0.0)?;
        rings.swap(0, shore);
        rings[1..].sort_by(|a, b| a[0].partial_cmp(&b[0]).expect("places are numbers"));
        let spacing_m = fluvial.fields().metres_a_grain() * GRAINS as f64;
        let area_m2 = rings.iter().fold(0.0, |sum, ring| sum + twice_area(ring) / 2.0) * spacing_m * spacing_m;
        Some(Lake { id, rings, level_m, area_m2, outlet: fluvial.outlet(id) })
    }

    /// Whether a part of it lies in the rectangle that the outer vertices of an area span.
    pub fn touches(&self, area: &Area) -> bool {
        let corner = [(area.x1 - 1 - area.x0) as f64, (area.y1 - 1 - area.y0) as f64];
        let low = [area.x0 as f64, area.y0 as f64];
        let from = |point: [f64; 2]| [point[0] - low[0], point[1] - low[1]];
        let mut around = false;
        for pair in self.rings.iter().flat_map(|ring| ring.windows(2)) {
            let (a, b) = (from(pair[0]), from(pair[1]));
            if LineSegment::between(a, b).touches_rectangle(corner) {
                return true;
            }
            // Whether the corner is inside: how often a line to the east crosses shores.
            if (a[1] > 0.0) != (b[1] > 0.0) && a[0] + (b[0] - a[0]) * (a[1] / (a[1] - b[1])) > 0.0 {
                around = !around;
            }
        }
        around
    }
}

/// The area in which a lake lies, all of its shore included.
fn surroundings(fluvial: &Fluvial, id: NodeId) -> Area {
    let network = fluvial.network();
    let at = network.trunks().node(id).at;
    let lake = network.trunks().drained(id).lake;
    // Where the trunks that meet at the node are lakes.
    let (mut low, mut high) = (at, at);
    let mut hold = |point: Point, half: f64| {
        let half = half.ceil() as i64;
        low = Point { x: low.x.min(point.x - half), y: low.y.min(point.y - half) };
        high = Point { x: high.x.max(point.x + half), y: high.y.max(point.y + half) };
    };
    hold(at, lake);
    network.channels(0, [at.moved([-1.0; 2]), at.moved([1.0; 2])], |trunk| {
        let last = trunk.knots.len() - 1;
        for (index, knot) in trunk.knots.iter().enumerate().filter(|(_, knot)| knot.lake > 0.0) {
            if ((trunk.id.1, trunk.id.2) == id && 2 * index < last)
                || (trunk.next.is_some_and(|(node, _)| node == id) && 2 * index > last)
            {
                // To where the next piece has no lake any more.
                hold(knot.at, lake);
            }
        }
    });
    fluvial.area_in_world([low, high])
}
