//! The greedy search of the thesis: one engine, which rivers and roads drive with a heuristic each.
//!
//! Based on: Grelsson (2014), section 4.2. A start vertex and an assigned direction; the axis neighbours that are in
//! bounds and not in the closed list make the open list, a heuristic scores them, the best goes to the closed list, the
//! open list is emptied, and so on until a rule says stop.

use std::collections::HashSet;

use crate::agents::Direction;
use crate::area::Area;
use crate::memory::HashKeys;
use crate::stop;

/// A vertex of the lattice.
pub type Node = (i64, i64);

/// What drives a search: how good a next node is, and when there is none good enough.
pub trait Heuristic {
    /// Vertices from a node to the next.
    fn stride(&self) -> i64;

    /// The score of stepping in `step` from `from` to `to`, the lower the better; `None` where the agent may not go.
    fn score(&mut self, from: Node, to: Node, step: Direction) -> Option<f32>;

    /// Called for the best of the open list before the agent goes there: whether it has to stop instead.
    fn refuses(&mut self, from: Node, to: Node) -> bool;
}

/// Why a search has ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TraceEnd {
    /// The best next node would leave the bounds, in this direction.
    Edge(Direction),
    /// The heuristic refuses the best next node: the only way on is too far uphill.
    Refused,
    /// All neighbours are in the closed list.
    Trapped,
    /// The closed list is as long as it may be.
    Full,
}

/// The way of an agent: its closed list, from the start on, and why it is not longer.
#[derive(Clone, Debug, PartialEq)]
pub struct Trace {
    /// The nodes in the order in which the agent went there; at least the start.
    pub nodes: Vec<Node>,
    /// Why there are no more.
    pub end: TraceEnd,
}

/// Searches from `start` within `bounds` until the heuristic, the bounds or `most` nodes end it.
///
/// Ties go to the direction that is named first in [`Direction::ALL`], so the way is the same on every machine.
pub fn search(heuristic: &mut impl Heuristic, start: Node, bounds: Area, most: usize) -> Trace {
    trace(heuristic, start, HashSet::from_iter([start]), bounds, most)
}

/// As [`search`], of an agent that has come to `start` from `behind` and does not go back there.
pub fn resume(heuristic: &mut impl Heuristic, behind: Node, start: Node, bounds: Area, most: usize) -> Trace {
    trace(heuristic, start, HashSet::from_iter([behind, start]), bounds, most)
}

/// Places to start from, of which an agent takes the first that it gets away from: `middle` and the vertices up to so
/// many steps of `stride` beside it, ring by ring outwards and each row by row.
pub fn rings(middle: Node, stride: i64, rings: i64) -> impl Iterator<Item = Node> {
    let around = (0..=rings).flat_map(|ring| {
        let square = (-ring..=ring).flat_map(move |south| (-ring..=ring).map(move |east| (east, south)));
        square.filter(move |(east, south)| east.abs().max(south.abs()) == ring)
    });
    around.map(move |(east, south)| (middle.0 + east * stride, middle.1 + south * stride))
}

fn trace(
    heuristic: &mut impl Heuristic,
    start: Node,
    mut closed: HashSet<Node, HashKeys>,
    bounds: Area,
    most: usize,
) -> Trace {
    let stride = heuristic.stride();
    let mut nodes = vec![start];
    let mut here = start;
    let end = loop {
        stop::check();
        if nodes.len() >= most {
            break TraceEnd::Full;
        }
        // The open list, of which only the best is ever looked at.
        let mut best: Option<(f32, Direction, Node)> = None;
        for direction in Direction::ALL {
            let (east, south) = direction.step();
            let node = (here.0 + east * stride, here.1 + south * stride);
            if closed.contains(&node) {
                continue;
            }
            let Some(score) = heuristic.score(here, node, direction) else { continue };
            if best.is_none_or(|(lowest, ..)| score < lowest) {
                best = Some((score, direction, node));
            }
        }
        let Some((_, direction, node)) = best else { break TraceEnd::Trapped };
        if !bounds.contains(&Area::new(node.0, node.1, 1, 1)) {
            break TraceEnd::Edge(direction);
        }
        if heuristic.refuses(here, node) {
            break TraceEnd::Refused;
        }
        closed.insert(node);
        nodes.push(node);
        here = node;
    };
    Trace { nodes, end }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Goes east over a wall of given height that stands in its way.
    struct Eastward {
        wall: i64,
    }

    impl Heuristic for Eastward {
        fn stride(&self) -> i64 {
            1
        }

        fn score(&mut self, _from: Node, to: Node, step: Direction) -> Option<f32> {
            let blocked = to.0 == 5 && to.1.abs() < self.wall;
            (!blocked).then_some(-step.along(Direction::East) as f32)
        }

        fn refuses(&mut self, _from: Node, to: Node) -> bool {
            to.0 > 9
        }
    }

    #[test]
    fn the_search_keeps_its_direction_and_goes_around() {
        let bounds = Area::new(-20, -20, 41, 41);
        let straight = search(&mut Eastward { wall: 0 }, (0, 0), bounds, 100);
        assert_eq!(straight.nodes, (0..=9).map(|x| (x, 0)).collect::<Vec<_>>());
        assert_eq!(straight.end, TraceEnd::Refused);
        let around = search(&mut Eastward { wall: 3 }, (0, 0), bounds, 100);
        assert!(around.nodes.contains(&(5, -3)), "{around:?}");
        assert_eq!(around.end, TraceEnd::Refused);
    }

    #[test]
    fn rings_go_outwards_and_leave_out_nothing() {
        let places: Vec<Node> = rings((10, 20), 7, 2).collect();
        assert_eq!((places.len(), places[0], places[1], places[8]), (25, (10, 20), (3, 13), (17, 27)));
        assert_eq!(places.iter().collect::<HashSet<_>>().len(), 25);
    }

    #[test]
    fn bounds_and_length_end_it() {
        let bounds = Area::new(0, 0, 4, 4);
        let trace = search(&mut Eastward { wall: 0 }, (0, 0), bounds, 100);
        assert_eq!((trace.nodes.len(), trace.end), (4, TraceEnd::Edge(Direction::East)));
        assert_eq!(search(&mut Eastward { wall: 0 }, (0, 0), bounds, 3).end, TraceEnd::Full);
    }
}
