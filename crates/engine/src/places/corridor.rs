//! The corridor of a road, found on the coarse plan. It limits the search on the fine plan to few nodes, and tells long
//! before that search which areas the road cannot reach.
//!
//! A move on the coarse plan costs as much as the best even climb between its ends. Rivers, turns, and dents between
//! nodes are left out, since only the fine plan knows them. The corridor consists of the nodes through which a route
//! costs little more than the best one, and the road never leaves it.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::clock::Clock;
use crate::memory::heap_bytes;
use crate::places::ellipse::{Ellipse, apart};
use crate::places::move_cost::{FORBIDDEN, UNIT, even_climb_m, over_water_m, sideways_m, wandering_m};
use crate::places::moves;
use crate::places::plan_land::{PlanNode, PlanScale, Window};
use crate::places::route_land::wander;
use crate::places::settings::Standard;
use crate::stop::Stopped;

/// Most nodes that a move on the coarse plan goes along rows or columns.
const FAR: i64 = 2;

/// Largest cost of a route through a node of the corridor: so many times the cost of the best route, and so many metres
/// more, about the width of a side valley. Chosen by measuring: of 41 roads of `archipelago` that a factor of 2 finds,
/// 1.3 finds 40 and 1.15 finds 38.
const DEARER: f64 = 1.3;
const DEARER_M: f64 = 400.0;

/// Expected ratio of a route's cost on the fine plan to its cost on the coarse one: above 1 for the rivers and turns
/// that the coarse plan leaves out. With 1.1 a search looks at 6 to 8 in 10 of the nodes that it looks at with 0.8, for
/// routes that cost 1 in 100 more.
const EXPECTED: f64 = 1.1;

/// Number of fine nodes from a coarse node of the corridor to the furthest node that the middle of a road may touch:
/// those that [belong](Corridor::holds) to the corridor, and half of the longest move between two of them.
const TOUCHED: i64 = 3;

/// The coarse plan as roads of one class see it.
pub(super) struct CoarseGround<'a> {
    window: &'a Window,
    scale: &'a PlanScale,
    standard: &'a Standard,
    /// Gradient of each node, row by row: metres up a metre east and south.
    gradient: Vec<[f64; 2]>,
    /// Roughness of the ground at each node, 0 to 1: see [`wander`].
    wander: Vec<f64>,
    /// For each node, true if it is too far from every shore for a bridge to reach it.
    is_closed: Vec<bool>,
}

impl<'a> CoarseGround<'a> {
    /// Creates the ground from a window of the coarse plan.
    pub fn new(window: &'a Window, scale: &'a PlanScale, standard: &'a Standard, seed: u64) -> CoarseGround<'a> {
        // Sampled at fine nodes, two of which make a coarse step, so that the coarse and the fine search find the same
        // ground rough.
        let fine = |[x, y]: PlanNode| [2 * (x + window.at[0]), 2 * (y + window.at[1])];
        CoarseGround {
            window,
            scale,
            standard,
            gradient: window.nodes().map(|node| window.gradient(node, scale.step_m())).collect(),
            wander: window.nodes().map(|node| wander(seed, fine(node))).collect(),
            is_closed: far_from_shores(window, (standard.bridge_m / 2.0 / scale.step_m() + 1.5) as i64),
        }
    }

    /// Estimates the cost of the move from one node to another.
    fn cost(&self, from: PlanNode, to: PlanNode) -> u32 {
        let length_m = apart(from, to) * self.scale.step_m();
        let rise_m = self.window.height_m(to) - self.window.height_m(from);
        let mut cost_m = even_climb_m(self.standard, length_m, rise_m.abs());
        let way = [0, 1].map(|axis| (to[axis] - from[axis]) as f64 * self.scale.step_m() / length_m);
        for node in [from, to] {
            let end = self.window.index(node);
            cost_m += sideways_m(self.gradient[end], way, length_m);
            cost_m += wandering_m(self.wander[end], length_m);
            if self.window.water(node).is_open() {
                cost_m += over_water_m(length_m / 2.0);
            }
        }
        (cost_m * EXPECTED * UNIT) as u32
    }

    /// Returns the costs of the cheapest routes from `from` to all nodes that `holds` admits, row by row, by Dijkstra's
    /// algorithm. Once `end` is reached at some cost, the search goes on only up to the cost that `most` returns for
    /// it.
    fn spread(
        &self,
        from: PlanNode,
        end: Option<PlanNode>,
        most: impl Fn(u32) -> u32,
        holds: impl Fn(PlanNode) -> bool,
        clock: &Clock,
    ) -> Result<Vec<u32>, Stopped> {
        let window = self.window;
        let mut costs = vec![FORBIDDEN; window.cols * window.rows];
        costs[window.index(from)] = 0;
        let mut heap = BinaryHeap::from([Reverse((0, window.index(from)))]);
        let mut beyond = FORBIDDEN;
        while let Some(Reverse((cost, at))) = heap.pop() {
            clock.check()?;
            if cost > beyond {
                break;
            }
            if cost > costs[at] {
                continue;
            }
            let here = window.node(at);
            if end == Some(here) {
                beyond = most(cost);
            }
            for [dx, dy] in moves::up_to(FAR) {
                let next = [here[0] + dx, here[1] + dy];
                if !window.holds(next) || self.is_closed[window.index(next)] || !holds(next) {
                    continue;
                }
                let (there, cost) = (window.index(next), cost + self.cost(here, next));
                if cost < costs[there] {
                    costs[there] = cost;
                    heap.push(Reverse((cost, there)));
                }
            }
        }
        Ok(costs)
    }
}

/// Returns for each node, row by row, whether open water covers all nodes within `nodes` of it.
fn far_from_shores(window: &Window, nodes: i64) -> Vec<bool> {
    let mut far = vec![false; window.cols * window.rows];
    if !window.has_open_water() {
        return far;
    }
    // Steps of a king on a chessboard to the nearest shore, found by as many rounds over the neighbours.
    let mut shore: Vec<i64> = window.nodes().map(|node| i64::from(window.water(node).is_open()) * i64::MAX).collect();
    let (cols, rows) = (window.cols as i64, window.rows as i64);
    for round in 1..=nodes {
        let before = shore.clone();
        for (index, node) in window.nodes().enumerate().filter(|(index, _)| before[*index] == i64::MAX) {
            let mut around = (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| [node[0] + dx, node[1] + dy]));
            if around.any(|[x, y]| {
                !(0..cols).contains(&x) || !(0..rows).contains(&y) || before[window.index([x, y])] == round - 1
            }) {
                shore[index] = round;
            }
        }
    }
    for (far, shore) in far.iter_mut().zip(shore) {
        *far = shore == i64::MAX;
    }
    far
}

/// The nodes of the coarse plan through which the road between two sites may go.
#[derive(Debug)]
pub(super) struct Corridor {
    /// The first node of the bounding box of all nodes, and the size of that box.
    at: PlanNode,
    cols: i64,
    rows: i64,
    /// For each node of the bounding box, row by row, whether it belongs to the corridor.
    inside: Vec<bool>,
}

heap_bytes!(Corridor: inside);

impl Corridor {
    /// Finds the corridor between two nodes of a window. `None` if there is no route.
    pub fn new(ground: &CoarseGround, [from, to]: [PlanNode; 2], clock: &Clock) -> Result<Option<Corridor>, Stopped> {
        let window = ground.window;
        let ellipse = Ellipse::new([from, to]);
        let most = |best: u32| (f64::from(best) * DEARER + DEARER_M * UNIT) as u32;
        let back = ground.spread(to, Some(from), most, |node| ellipse.holds(node), clock)?;
        let best = back[window.index(from)];
        if best == FORBIDDEN {
            return Ok(None);
        }
        let there = ground.spread(from, Some(to), most, |node| back[window.index(node)] != FORBIDDEN, clock)?;
        let is_inside = |node: PlanNode| {
            let at = window.index(node);
            there[at] != FORBIDDEN && back[at] != FORBIDDEN && there[at] + back[at] <= most(best)
        };
        let (mut low, mut high) = (from, from);
        for node in window.nodes().filter(|node| is_inside(*node)) {
            low = [0, 1].map(|axis| low[axis].min(node[axis]));
            high = [0, 1].map(|axis| high[axis].max(node[axis]));
        }
        let [cols, rows] = [0, 1].map(|axis| high[axis] - low[axis] + 1);
        let nodes = (0..rows).flat_map(|row| (0..cols).map(move |col| [low[0] + col, low[1] + row]));
        let inside = nodes.map(is_inside).collect();
        Ok(Some(Corridor { at: [0, 1].map(|axis| low[axis] + window.at[axis]), cols, rows, inside }))
    }

    /// Returns the coarse nodes of the corridor, row by row.
    pub fn nodes(&self) -> impl Iterator<Item = PlanNode> {
        let inside = (0..).zip(&self.inside).filter(|(_, is_inside)| **is_inside);
        inside.map(|(index, _)| [self.at[0] + index % self.cols, self.at[1] + index / self.cols])
    }

    /// Returns the first fine node that the corridor may be asked about, and the one past the last, along each axis.
    pub fn fine_bounds(&self) -> [PlanNode; 2] {
        let margin = TOUCHED + 1;
        let past = [self.cols, self.rows];
        [self.at.map(|at| 2 * at - margin), [0, 1].map(|axis| 2 * (self.at[axis] + past[axis] - 1) + margin + 1)]
    }

    /// True if a coarse node of the world belongs to the corridor.
    fn is_inside(&self, node: PlanNode) -> bool {
        let [col, row] = [0, 1].map(|axis| node[axis] - self.at[axis]);
        let is_known = (0..self.cols).contains(&col) && (0..self.rows).contains(&row);
        is_known && self.inside[(row * self.cols + col) as usize]
    }

    /// True if a fine node of the world belongs to the corridor: one of the coarse nodes around it does.
    pub fn holds(&self, node: PlanNode) -> bool {
        around(node).into_iter().any(|node| self.is_inside(node))
    }

    /// True if a fine node in columns and rows `low` to `high` lies less than `nodes` fine nodes from the corridor.
    pub fn comes_near(&self, low: PlanNode, high: PlanNode, nodes: i64) -> bool {
        let first = [0, 1].map(|axis| (low[axis] - nodes).div_euclid(2).max(self.at[axis]));
        let counts = [self.cols, self.rows];
        let last = [0, 1].map(|axis| (high[axis] + nodes + 1).div_euclid(2).min(self.at[axis] + counts[axis] - 1));
        (first[1]..=last[1]).any(|row| (first[0]..=last[0]).any(|col| self.is_inside([col, row])))
    }

    /// True if the road, or ground within `beside` fine nodes of it, may touch a fine node in columns and rows `low` to
    /// `high`.
    pub fn may_touch(&self, low: PlanNode, high: PlanNode, beside: i64) -> bool {
        self.comes_near(low, high, TOUCHED + beside)
    }

    /// True if the search may query the land at the fine nodes in columns and rows `low` to `high`.
    pub fn looks_at(&self, low: PlanNode, high: PlanNode) -> bool {
        self.comes_near(low, high, TOUCHED + 1)
    }
}

/// Returns the coarse nodes around a fine one. Some occur twice.
fn around(node: PlanNode) -> [PlanNode; 4] {
    let [left, above] = node.map(|at| at.div_euclid(2));
    let [right, below] = node.map(|at| (at + 1).div_euclid(2));
    [[left, above], [right, above], [left, below], [right, below]]
}

/// Estimated costs from the nodes of a corridor to its end: the heuristic of the search on the fine plan.
pub(super) struct Outlook {
    /// The first coarse node of the window, and the size of the window.
    at: PlanNode,
    cols: i64,
    rows: i64,
    /// Estimated cost of each coarse node, row by row.
    costs: Vec<u32>,
}

impl Outlook {
    /// Estimates the costs to a node of a window from all nodes of a corridor.
    pub fn new(ground: &CoarseGround, corridor: &Corridor, to: PlanNode, clock: &Clock) -> Result<Outlook, Stopped> {
        let window = ground.window;
        let holds = |[x, y]: PlanNode| corridor.is_inside([x + window.at[0], y + window.at[1]]);
        let costs = ground.spread(to, None, |_| FORBIDDEN, holds, clock)?;
        Ok(Outlook { at: window.at, cols: window.cols as i64, rows: window.rows as i64, costs })
    }

    /// Returns the estimated cost from a fine node of the world to the end: the mean over the coarse nodes around it
    /// whose cost is known, or [`FORBIDDEN`] if there is none.
    pub fn to_go(&self, node: PlanNode) -> u32 {
        let costs = around(node).map(|node| {
            let [col, row] = [0, 1].map(|axis| node[axis] - self.at[axis]);
            let is_known = (0..self.cols).contains(&col) && (0..self.rows).contains(&row);
            if is_known { self.costs[(row * self.cols + col) as usize] } else { FORBIDDEN }
        });
        let known = costs.into_iter().filter(|cost| *cost != FORBIDDEN).map(u64::from);
        let (sum, count) = known.fold((0_u64, 0), |(sum, count), cost| (sum + cost, count + 1));
        sum.checked_div(count).map_or(FORBIDDEN, |mean| mean as u32)
    }
}
