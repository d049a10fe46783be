//! Ways: the beds that rivers and roads leave in the land.

use crate::agents::Direction;
use crate::agents::greedy::Node;
use crate::area::Area;
use crate::grid::Grid;
use crate::memory::heap_bytes;
use crate::preset::{RiverAgents, RoadAgents};

/// A river or a road.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum WayKind {
    /// Carves a bed with banks and leaves sand.
    River,
    /// Leaves dirt, and levels the ground across itself if it is graded.
    Road,
}

/// The bed of a river or a road: a smooth line with width and floor, and a hard end of its effect.
#[derive(Clone, Debug, PartialEq)]
pub struct Way {
    kind: WayKind,
    /// The vertex that points are relative to, so that `f32` is exact enough anywhere.
    origin: Node,
    points: Vec<WayPoint>,
    spacing_m: f32,
    bank_m: f32,
    graded: bool,
    bounds: Area,
}

/// A point of a way's middle line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WayPoint {
    /// Vertices east of the way's origin.
    pub east: f32,
    /// Vertices south of the way's origin.
    pub south: f32,
    /// Metres from the middle line to the edge of the bed or road.
    pub half_width_m: f32,
    /// Height in metres of the bed's floor, or of the road. A river's never rises.
    pub floor_m: f32,
    /// Height in metres of the water's surface, or of the road.
    pub level_m: f32,
}

heap_bytes!(Way: points);
heap_bytes!(WayPoint);

/// How much of the depth of a river's bed is water.
const FILLED: f32 = 0.75;

/// Nodes to each side that are averaged into a point: what makes a line of the search's staircase.
const SMOOTHING: usize = 5;

/// Nodes from a point to the next: about as long as a bed is wide.
const NODES_A_POINT: usize = 3;

/// Cells over which a way of one tile fades towards the tile's edge: little, so that what crosses the edge and is not
/// faded closes the gap.
const EDGE_FADE_CELLS: i64 = 6;

impl Way {
    /// The bed of a river along the nodes of a trace and the heights of the un-carved ground there.
    ///
    /// `before_cells` is how far the river has come when it reaches the first node, and `reach_cells` how far it can
    /// come at all: width and depth grow from source to there.
    ///
    /// # Panics
    /// When there are no nodes, or not as many heights.
    pub fn river(
        nodes: &[Node],
        heights_m: &[f32],
        agents: &RiverAgents,
        spacing_m: f64,
        before_cells: f32,
        reach_cells: f32,
    ) -> Way {
        assert_eq!(nodes.len(), heights_m.len(), "a height belongs to each node");
        let grown = |[source, end]: [f64; 2], progress: f32| source as f32 + (end - source) as f32 * progress;
        let mut lowest_m = f32::INFINITY;
        let beds_m: Vec<(f32, f32)> = heights_m
            .iter()
            .enumerate()
            .map(|(step, height_m)| {
                // The banks never rise; the bed lies below them, deeper and deeper.
                lowest_m = lowest_m.min(*height_m);
                (lowest_m, grown(agents.depth_m, ((before_cells + step as f32) / reach_cells).min(1.0)))
            })
            .collect();
        let point = |step: usize, [east, south]: [f32; 2]| WayPoint {
            east,
            south,
            half_width_m: grown(agents.width_m, ((before_cells + step as f32) / reach_cells).min(1.0)) / 2.0,
            floor_m: beds_m[step].0 - beds_m[step].1,
            level_m: beds_m[step].0 - beds_m[step].1 * (1.0 - FILLED),
        };
        Way::along(WayKind::River, nodes, point, spacing_m, agents.bank_m, true)
    }

    /// The bed of a road along the nodes of a trace, any number of vertices apart, and the heights of the ground there.
    ///
    /// # Panics
    /// When there are no nodes, or not as many heights.
    pub fn road(nodes: &[Node], heights_m: &[f32], agents: &RoadAgents, spacing_m: f64) -> Way {
        assert_eq!(nodes.len(), heights_m.len(), "a height belongs to each node");
        let last = nodes.len() - 1;
        let steps = agents.step_cells as usize;
        // One node a vertex, as rivers have it, so that both are smoothed alike.
        let (mut fine, mut levels_m) = (Vec::new(), Vec::new());
        for (index, &(x, y)) in nodes.iter().enumerate() {
            let (next, next_m) = (nodes[(index + 1).min(last)], heights_m[(index + 1).min(last)]);
            for step in 0..if index == last { 1 } else { steps } {
                let share = step as i64;
                let side = steps as i64;
                fine.push((x + (next.0 - x) * share / side, y + (next.1 - y) * share / side));
                levels_m.push(heights_m[index] + (next_m - heights_m[index]) * (step as f32 / steps as f32));
            }
        }
        let half_width_m = agents.width_m as f32 / 2.0;
        let point = |step: usize, [east, south]: [f32; 2]| {
            let level_m = levels_m[step];
            WayPoint { east, south, half_width_m, floor_m: level_m, level_m }
        };
        Way::along(WayKind::Road, &fine, point, spacing_m, agents.shoulder_m, agents.graded)
    }

    /// The way along nodes that are a vertex apart, smoothed; its ends stay where they are.
    fn along(
        kind: WayKind,
        nodes: &[Node],
        point: impl Fn(usize, [f32; 2]) -> WayPoint,
        spacing_m: f64,
        bank_m: f64,
        graded: bool,
    ) -> Way {
        let origin = *nodes.first().expect("a trace has a node");
        let last = nodes.len() - 1;
        let smoothed = |step: usize| {
            let reach = SMOOTHING.min(step).min(last - step);
            let around = &nodes[step - reach..=step + reach];
            let mean = |coordinate: fn(&Node) -> i64, from: i64| {
                around.iter().map(|node| coordinate(node) - from).sum::<i64>() as f32 / around.len() as f32
            };
            point(step, [mean(|node| node.0, origin.0), mean(|node| node.1, origin.1)])
        };
        let points: Vec<WayPoint> = (0..last).step_by(NODES_A_POINT).chain([last]).map(smoothed).collect();
        let widest_m = points.iter().map(|point| point.half_width_m).fold(0.0, f32::max);
        let reach_cells = ((widest_m as f64 + bank_m) / spacing_m).ceil() as usize + 1;
        let side = |coordinate: fn(&Node) -> i64| {
            let values = || nodes.iter().map(coordinate);
            (values().min().expect("a trace has a node"), values().max().expect("a trace has a node") + 1)
        };
        let ((x0, x1), (y0, y1)) = (side(|node| node.0), side(|node| node.1));
        let bounds = Area { x0, y0, x1, y1 }.padded(reach_cells);
        Way { kind, origin, points, spacing_m: spacing_m as f32, bank_m: bank_m as f32, graded, bounds }
    }

    /// This way with a pond at its end, so many times as wide.
    pub(crate) fn with_pond(mut self, widths: f32) -> Way {
        let end = self.points[self.points.len() - 1];
        let pond = WayPoint { half_width_m: end.half_width_m * widths, ..end };
        self.points.push(pond);
        let more = ((pond.half_width_m - end.half_width_m) / self.spacing_m).ceil() as usize;
        self.bounds = self.bounds.padded(more);
        self
    }

    /// A river or a road.
    pub fn kind(&self) -> WayKind {
        self.kind
    }

    /// The points of the middle line, from its start on; at least one.
    pub fn points(&self) -> &[WayPoint] {
        &self.points
    }

    /// The vertex that points are relative to.
    pub fn origin(&self) -> Node {
        self.origin
    }

    /// All vertices that the way can have an effect on, and then some.
    pub fn bounds(&self) -> Area {
        self.bounds
    }

    /// Whether the way can have an effect on a vertex of `area`.
    pub fn overlaps(&self, area: &Area) -> bool {
        self.bounds.common(area).is_some()
    }

    /// As [`overlaps`](Way::overlaps), asked of each piece of the way by itself, which is exact but for its corners.
    pub fn touches(&self, area: &Area) -> bool {
        let last = self.points.len() - 1;
        let piece = |index: usize| (self.points[index], self.points[(index + 1).min(last)]);
        self.overlaps(area) && (0..last.max(1)).map(piece).any(|(from, to)| !near(self, from, to, *area).is_empty())
    }
}

/// What all ways together do to the vertices of an area.
///
/// Each of its values is a maximum over the ways, so their order does not matter.
#[derive(Debug)]
pub struct Imprint {
    /// Metres by which a river cuts the land down.
    cut_m: Grid<f32>,
    /// Share of the road bed's level, and that level.
    grade: Option<Grid<(f32, f32)>>,
    sand: Grid<f32>,
    water: Grid<f32>,
    dirt: Grid<f32>,
}

impl Imprint {
    /// What `ways` do to `heights`, the bare land; `None` where they do nothing.
    pub fn new<'a>(heights: &Grid<f32>, ways: impl IntoIterator<Item = &'a Way>) -> Option<Imprint> {
        let area = heights.area();
        let mut imprint: Option<Imprint> = None;
        for way in ways {
            if way.overlaps(&area) {
                imprint.get_or_insert_with(|| Imprint::blank(area)).add(way, heights);
            }
        }
        imprint
    }

    /// Nothing done to `area`.
    pub(super) fn blank(area: Area) -> Imprint {
        let grid = || Grid::filled(area, 0.0);
        Imprint { cut_m: grid(), grade: None, sand: grid(), water: grid(), dirt: grid() }
    }

    /// Weakens it towards the edges of `tile`, but for an `open` one, to exactly nothing one vertex before them.
    pub(super) fn fade_out(&mut self, tile: Area, open: Option<Direction>) {
        let area = self.area();
        let far = |direction, cells: i64| if open == Some(direction) { i64::MAX } else { cells };
        let across = |x: i64| far(Direction::West, x - tile.x0).min(far(Direction::East, tile.x1 - 1 - x));
        let down = |y: i64| far(Direction::North, y - tile.y0).min(far(Direction::South, tile.y1 - 1 - y));
        for y in area.y0..area.y1 {
            let cells_south = down(y);
            // Between the western and the eastern edge nothing changes, except by the northern and the southern one.
            let (west, east) = match cells_south > EDGE_FADE_CELLS {
                true => (tile.x0 + EDGE_FADE_CELLS + 1, tile.x1 - 1 - EDGE_FADE_CELLS),
                false => (area.x1, area.x1),
            };
            for x in (area.x0..west.min(area.x1)).chain(east.max(west).max(area.x0)..area.x1) {
                let cells = cells_south.min(across(x));
                if cells > EDGE_FADE_CELLS {
                    continue;
                }
                let share = 1.0 - fade((cells - 1).max(0) as f32 / EDGE_FADE_CELLS as f32);
                for grid in [&mut self.cut_m, &mut self.sand, &mut self.water, &mut self.dirt] {
                    grid.row_mut(y, x, x + 1)[0] *= share;
                }
                if let Some(grade) = &mut self.grade {
                    grade.row_mut(y, x, x + 1)[0].0 *= share;
                }
            }
        }
    }

    /// Adds what another imprint does to a part of this one's area.
    pub(super) fn merge(&mut self, part: &Imprint) {
        let (area, Area { x0, y0, x1, y1 }) = (self.area(), part.area());
        for (x, y) in (y0..y1).flat_map(|y| (x0..x1).map(move |x| (x, y))) {
            raise(&mut self.cut_m, x, y, part.cut_m.at(x, y));
            raise(&mut self.sand, x, y, part.sand.at(x, y));
            raise(&mut self.water, x, y, part.water.at(x, y));
            raise(&mut self.dirt, x, y, part.dirt.at(x, y));
            if let Some(grade) = &part.grade {
                raise(self.grade.get_or_insert_with(|| Grid::filled(area, (0.0, 0.0))), x, y, grade.at(x, y));
            }
        }
    }

    /// The vertices that it covers.
    pub fn area(&self) -> Area {
        self.cut_m.area()
    }

    /// Shapes the bare land: roads are levelled, then rivers cut through all.
    pub fn shape(&self, heights: &mut Grid<f32>) {
        if let Some(grade) = &self.grade {
            for (height_m, (share, level_m)) in heights.values_mut().iter_mut().zip(grade.values()) {
                *height_m += (level_m - *height_m) * share;
            }
        }
        for (height_m, cut_m) in heights.values_mut().iter_mut().zip(self.cut_m.values()) {
            *height_m -= cut_m;
        }
    }

    /// Share of sand by a river, 0 to 1.
    pub fn sand(&self) -> &Grid<f32> {
        &self.sand
    }

    /// Share of a river's water, 0 to 1.
    pub fn water(&self) -> &Grid<f32> {
        &self.water
    }

    /// Share of a road's dirt, 0 to 1.
    pub fn dirt(&self) -> &Grid<f32> {
        &self.dirt
    }

    fn add(&mut self, way: &Way, heights: &Grid<f32>) {
        // What counts is the nearest piece of the way alone. The most that any piece does would do, too, but leaves a
        // ripple along the bank where one piece follows on the other.
        let Some(part) = self.area().common(&way.bounds) else { return };
        let mut nearest = Grid::filled(part, Place { outside_m: f32::INFINITY, floor_m: 0.0 });
        // A way of one point is a round pool or place.
        let last = way.points.len() - 1;
        for index in 0..last.max(1) {
            let (from, to) = (way.points[index], way.points[(index + 1).min(last)]);
            for_each_near(way, from, to, part, |x, y, place| {
                let here = &mut nearest.row_mut(y, x, x + 1)[0];
                if place.outside_m < here.outside_m {
                    *here = place;
                }
            });
        }
        for (x, y) in (part.y0..part.y1).flat_map(|y| (part.x0..part.x1).map(move |x| (x, y))) {
            let place = nearest.at(x, y);
            // A vertex that no piece has visited lies past the end of the effect.
            if place.outside_m < way.bank_m {
                match way.kind {
                    WayKind::River => self.add_river(way, x, y, place, heights.at(x, y)),
                    WayKind::Road => self.add_road(way, x, y, place),
                }
            }
        }
    }

    fn add_river(&mut self, way: &Way, x: i64, y: i64, place: Place, height_m: f32) {
        let fall = fade(place.outside_m / way.bank_m);
        raise(&mut self.cut_m, x, y, (height_m - place.floor_m).max(0.0) * fall);
        // Sand lies in the bed and on the lower half of the bank.
        raise(&mut self.sand, x, y, fade(2.0 * place.outside_m / way.bank_m));
        // Water fills the bed; its edge is as soft as a vertex is wide.
        raise(&mut self.water, x, y, (0.5 - place.outside_m / way.spacing_m).clamp(0.0, 1.0));
    }

    fn add_road(&mut self, way: &Way, x: i64, y: i64, place: Place) {
        let share = fade(place.outside_m / way.bank_m);
        raise(&mut self.dirt, x, y, share);
        if way.graded {
            let area = self.area();
            let grade = self.grade.get_or_insert_with(|| Grid::filled(area, (0.0, 0.0)));
            // The nearest road wins, and of two as near the higher one.
            raise(grade, x, y, (share, place.floor_m));
        }
    }
}

fn raise<T: Copy + PartialOrd>(grid: &mut Grid<T>, x: i64, y: i64, value: T) {
    let here = &mut grid.row_mut(y, x, x + 1)[0];
    if value > *here {
        *here = value;
    }
}

/// 1 up to 0, 0 from 1 on, and smooth between.
fn fade(distance: f32) -> f32 {
    let rest = 1.0 - distance.clamp(0.0, 1.0);
    rest * rest * (3.0 - 2.0 * rest)
}

/// Where a vertex lies by a way.
#[derive(Clone, Copy)]
struct Place {
    /// Metres from the edge of the bed outwards; negative inside.
    outside_m: f32,
    /// Height of the bed there.
    floor_m: f32,
}

/// The vertices of `area` that a piece of a way can have an effect on, and then some.
fn near(way: &Way, from: WayPoint, to: WayPoint, area: Area) -> Area {
    let reach_m = from.half_width_m.max(to.half_width_m) + way.bank_m;
    let reach = reach_m / way.spacing_m;
    let low = |a: f32, b: f32, origin: i64, edge: i64| (origin + (a.min(b) - reach).floor() as i64).max(edge);
    let high = |a: f32, b: f32, origin: i64, edge: i64| (origin + (a.max(b) + reach).ceil() as i64 + 1).min(edge);
    let (x0, x1) = (low(from.east, to.east, way.origin.0, area.x0), high(from.east, to.east, way.origin.0, area.x1));
    let (y0, y1) =
        (low(from.south, to.south, way.origin.1, area.y0), high(from.south, to.south, way.origin.1, area.y1));
    // Beside the area it ends before it begins.
    Area { x0, y0, x1: x1.max(x0), y1: y1.max(y0) }
}

/// Calls `visit` for all vertices of `area` that are nearer to a piece of a way than its reach.
fn for_each_near(way: &Way, from: WayPoint, to: WayPoint, area: Area, mut visit: impl FnMut(i64, i64, Place)) {
    let Area { x0, y0, x1, y1 } = near(way, from, to, area);
    let (along_east, along_south) = (to.east - from.east, to.south - from.south);
    let square = along_east * along_east + along_south * along_south;
    for y in y0..y1 {
        let south = (y - way.origin.1) as f32 - from.south;
        for x in x0..x1 {
            let east = (x - way.origin.0) as f32 - from.east;
            let share =
                if square > 0.0 { ((east * along_east + south * along_south) / square).clamp(0.0, 1.0) } else { 0.0 };
            let (off_east, off_south) = (east - along_east * share, south - along_south * share);
            let distance_m = (off_east * off_east + off_south * off_south).sqrt() * way.spacing_m;
            let half_width_m = from.half_width_m + (to.half_width_m - from.half_width_m) * share;
            let outside_m = distance_m - half_width_m;
            // The hard end of the effect.
            if outside_m < way.bank_m {
                visit(x, y, Place { outside_m, floor_m: from.floor_m + (to.floor_m - from.floor_m) * share });
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn river() -> Way {
        let nodes: Vec<Node> = (0..200).map(|x| (x - 100, x / 4)).collect();
        let heights: Vec<f32> = (0..200).map(|x| 50.0 - 0.1 * x as f32 + (x % 7) as f32 * 0.3).collect();
        Way::river(&nodes, &heights, &RiverAgents::default(), 1.0, 0.0, 300.0)
    }

    #[test]
    fn a_rivers_floor_never_rises_and_its_bed_never_narrows() {
        for pair in river().points().windows(2) {
            assert!(pair[1].floor_m <= pair[0].floor_m && pair[1].half_width_m >= pair[0].half_width_m, "{pair:?}");
        }
    }

    #[test]
    fn ways_do_exactly_nothing_past_their_reach() {
        let road = Way::road(
            &[(-50, 0), (-43, 0), (-43, 7)],
            &[60.0; 3],
            &RoadAgents { graded: true, ..RoadAgents::default() },
            1.0,
        );
        for way in [river(), road] {
            let area = way.bounds().padded(20);
            let bare = Grid::filled(area, 55.0f32);
            let imprint = Imprint::new(&bare, [&way]).unwrap();
            let mut shaped = bare.clone();
            imprint.shape(&mut shaped);
            assert_ne!(shaped, bare, "a way leaves a trace");
            let reach_m = way.points().iter().map(|point| point.half_width_m).fold(0.0, f32::max) + way.bank_m;
            for (x, y) in (area.y0..area.y1).flat_map(|y| (area.x0..area.x1).map(move |x| (x, y))) {
                let distance = way.points().iter().map(|point| {
                    let east = (x - way.origin().0) as f32 - point.east;
                    let south = (y - way.origin().1) as f32 - point.south;
                    (east * east + south * south).sqrt()
                });
                // The middle line passes between two points at most 2 vertices from the nearer one.
                if distance.fold(f32::INFINITY, f32::min) > reach_m + 2.0 {
                    let traces = [imprint.sand(), imprint.water(), imprint.dirt()].map(|grid| grid.at(x, y));
                    assert_eq!((shaped.at(x, y), traces), (55.0, [0.0; 3]), "vertex ({x}, {y})");
                }
            }
        }
    }

    #[test]
    fn the_order_of_ways_does_not_matter() {
        let one = river();
        let nodes: Vec<Node> = (0..60).map(|y| (20, y - 10)).collect();
        let other = Way::river(&nodes, &[44.0; 60], &RiverAgents::default(), 1.0, 0.0, 100.0);
        let road = Way::road(
            &[(0, 20), (7, 20), (14, 20)],
            &[47.0, 48.0, 46.0],
            &RoadAgents { graded: true, ..RoadAgents::default() },
            1.0,
        );
        let bare = Grid::filled(Area::new(-40, -20, 120, 90), 50.0f32);
        let shaped = |ways: [&Way; 3]| {
            let mut heights = bare.clone();
            Imprint::new(&bare, ways).unwrap().shape(&mut heights);
            heights
        };
        assert_eq!(shaped([&one, &other, &road]), shaped([&road, &other, &one]));
    }
}
