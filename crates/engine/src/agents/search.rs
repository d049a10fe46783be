//! The greedy search of the thesis: one engine that rivers and roads drive, each with a heuristic of its own.
//!
//! Based on: Grelsson (2014), section 4.2. The search begins with a start vertex and an assigned direction. At each
//! step the open list holds the neighbours along the axes that are in bounds and not in the closed list. A heuristic
//! scores them, the best goes to the closed list, and the open list is emptied. The search repeats this until a rule
//! stops it.

use std::collections::HashSet;

use crate::agents::Direction;
use crate::area::Area;
use crate::memory::HashKeys;

/// A vertex of the lattice.
pub type Node = (i64, i64);

/// The rules of a search: scores the possible next nodes, and tells when the best of them is not good enough.
pub trait Heuristic {
    /// Returns the number of vertices from a node to the next.
    fn stride(&self) -> i64;

    /// Scores the step from `from` to `to` in direction `step`, the lower the better; `None` where the agent may not
    /// go.
    fn score(&mut self, from: Node, to: Node, step: Direction) -> Option<f32>;

    /// True if the agent has to stop instead of going to `to`. Called for the best node of the open list only.
    fn refuses(&mut self, from: Node, to: Node) -> bool;
}

/// Reason why a search ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TraceEnd {
    /// The best next node would leave the bounds, in this direction.
    Edge(Direction),
    /// The heuristic refuses the best next node: it is too far uphill for a river, and too steep or under water for a
    /// road.
    Refused,
    /// No step is possible: every neighbour is in the closed list or forbidden by the heuristic.
    Trapped,
    /// The closed list has reached its largest allowed length.
    Full,
}

/// The way of an agent: its closed list from the start on, and the reason why it ends.
#[derive(Clone, Debug, PartialEq)]
pub struct Trace {
    /// Nodes in the order of the way; at least the start.
    pub nodes: Vec<Node>,
    /// Reason why the way ends.
    pub end: TraceEnd,
}

/// Searches from `start` within `bounds` until the heuristic or the bounds end the way, or until it has `most` nodes.
///
/// On equal scores the first direction in [`Direction::ALL`] wins, so the way is the same on every machine.
pub fn search(heuristic: &mut impl Heuristic, start: Node, bounds: Area, most: usize) -> Trace {
    trace(heuristic, start, HashSet::from_iter([start]), bounds, most)
}

/// Searches as [`search`] does, for an agent that has come from `behind` to `start` and must not go back.
pub fn resume(heuristic: &mut impl Heuristic, behind: Node, start: Node, bounds: Area, most: usize) -> Trace {
    trace(heuristic, start, HashSet::from_iter([behind, start]), bounds, most)
}

/// Lists candidate starts for an agent, which takes the first that has a way on: `middle`, then square rings around it
/// outwards, each row by row. Neighbouring candidates are `stride` vertices apart.
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
        if nodes.len() >= most {
            break TraceEnd::Full;
        }
        // The open list, of which only the best node is kept.
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

    /// Goes east. A wall at x = 5, which reaches less than `wall` vertices to each side, blocks the way.
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
