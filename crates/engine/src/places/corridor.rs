//! Where a road may go, found on the coarse plan: what makes a search on the fine one look at a few nodes, and tells long before
//! that search where no road will come.
//!
//! On the coarse plan a move costs what the best even climb does. What only the fine one knows is left out: rivers, turns,
//! and dents between nodes. The nodes by which a way costs little more than the best make the corridor, which the road never
//! leaves.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::memory::heap_bytes;
use crate::places::ellipse::{Ellipse, apart};
use crate::places::move_cost::{FORBIDDEN, UNIT, even_climb_m, over_water_m, sideways_m, wandering_m};
use crate::places::moves;
use crate::places::plan_land::{PlanNode, Scale, Window};
use crate::places::route_land::wander;
use crate::places::settings::Standard;
use crate::stop;

/// How far moves on the coarse plan go along rows and columns, at most.
const FAR: i64 = 2;

/// What a way may cost that still lies in the corridor: so many times what the best does, and so many metres more, a side
/// valley's width. Chosen by measuring: of 41 roads of `archipelago` that a factor of 2 finds, 1.3 finds 40 and 1.15 finds 38.
const DEARER: f64 = 1.3;
const DEARER_M: f64 = 400.0;

/// What a way on the fine plan is taken to cost, as a share of what it does on the coarse one: more, for the rivers and turns
/// that this leaves out. With 1.1 a search looks at 6 to 8 in 10 of the nodes that it looks at with 0.8, for ways that cost 1 in
/// 100 more.
const EXPECTED: f64 = 1.1;

/// Fine nodes from a coarse one of the corridor to the furthest that a road may touch, beside its own width: those that
/// [belong](Corridor::holds) to it, and half of the longest move between two of them.
const TOUCHED: i64 = 3;

/// The coarse plan as roads of a class see it.
pub(super) struct CoarseGround<'a> {
    window: &'a Window,
    scale: &'a Scale,
    standard: &'a Standard,
    /// By node, row by row: metres up a metre east and south.
    gradient: Vec<[f64; 2]>,
    /// How bad it is to walk on, 0 to 1.
    wander: Vec<f64>,
    /// Whether it is too far from any shore for a bridge.
    is_closed: Vec<bool>,
}

impl<'a> CoarseGround<'a> {
    /// The land of a window of the coarse plan.
    pub fn new(window: &'a Window, scale: &'a Scale, standard: &'a Standard, seed: u64) -> CoarseGround<'a> {
        // By fine nodes, of which two lie as far apart: the searches there find the same places bad.
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

    /// What the move from one node to another costs, about.
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

    /// What ways from one node to all that are held cost, row by row, as far as they cost no more than is told to be the most
    /// once `end` has been come to.
    fn spread(
        &self,
        from: PlanNode,
        end: Option<PlanNode>,
        most: impl Fn(u32) -> u32,
        holds: impl Fn(PlanNode) -> bool,
    ) -> Vec<u32> {
        let window = self.window;
        let mut costs = vec![FORBIDDEN; window.cols * window.rows];
        costs[window.index(from)] = 0;
        let mut heap = BinaryHeap::from([Reverse((0, window.index(from)))]);
        let mut beyond = FORBIDDEN;
        while let Some(Reverse((cost, at))) = heap.pop() {
            stop::check();
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
        costs
    }
}

/// By node, whether there is open water so many nodes around it, row by row.
fn far_from_shores(window: &Window, nodes: i64) -> Vec<bool> {
    let mut far = vec![false; window.cols * window.rows];
    if !window.has_open_water() {
        return far;
    }
    // The nodes to the nearest shore, as a king walks: so many rounds of neighbours.
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

/// The nodes of the coarse plan by which the road between two sites may go.
#[derive(Debug)]
pub(super) struct Corridor {
    /// The first of them, and how many there are in a row and in a column.
    at: PlanNode,
    cols: i64,
    rows: i64,
    /// Row by row.
    inside: Vec<bool>,
}

heap_bytes!(Corridor: inside);

impl Corridor {
    /// The corridor between two nodes of a window, if there is a way.
    pub fn new(ground: &CoarseGround, [from, to]: [PlanNode; 2]) -> Option<Corridor> {
        let window = ground.window;
        let ellipse = Ellipse::new([from, to]);
        let most = |best: u32| (f64::from(best) * DEARER + DEARER_M * UNIT) as u32;
        let back = ground.spread(to, Some(from), most, |node| ellipse.holds(node));
        let best = back[window.index(from)];
        if best == FORBIDDEN {
            return None;
        }
        let there = ground.spread(from, Some(to), most, |node| back[window.index(node)] != FORBIDDEN);
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
        Some(Corridor { at: [0, 1].map(|axis| low[axis] + window.at[axis]), cols, rows, inside })
    }

    /// The first fine node that it may be asked about, and past the last one, along each axis.
    pub fn fine_bounds(&self) -> [PlanNode; 2] {
        let margin = TOUCHED + 1;
        let past = [self.cols, self.rows];
        [self.at.map(|at| 2 * at - margin), [0, 1].map(|axis| 2 * (self.at[axis] + past[axis] - 1) + margin + 1)]
    }

    /// Whether a coarse node of the world is one of it.
    fn is_inside(&self, node: PlanNode) -> bool {
        let [col, row] = [0, 1].map(|axis| node[axis] - self.at[axis]);
        let is_known = (0..self.cols).contains(&col) && (0..self.rows).contains(&row);
        is_known && self.inside[(row * self.cols + col) as usize]
    }

    /// Whether a fine node of the world belongs to it: one of the coarse nodes around does.
    pub fn holds(&self, node: PlanNode) -> bool {
        around(node).into_iter().any(|node| self.is_inside(node))
    }

    /// Whether a node from column and row `low` to `high` of the fine plan lies less than so many nodes from one of it.
    pub fn comes_near(&self, low: PlanNode, high: PlanNode, nodes: i64) -> bool {
        let first = [0, 1].map(|axis| (low[axis] - nodes).div_euclid(2).max(self.at[axis]));
        let counts = [self.cols, self.rows];
        let last = [0, 1].map(|axis| (high[axis] + nodes + 1).div_euclid(2).min(self.at[axis] + counts[axis] - 1));
        (first[1]..=last[1]).any(|row| (first[0]..=last[0]).any(|col| self.is_inside([col, row])))
    }

    /// Whether its road, and what lies so many fine nodes beside that, may touch a node from column and row `low` to `high`.
    pub fn may_touch(&self, low: PlanNode, high: PlanNode, beside: i64) -> bool {
        self.comes_near(low, high, TOUCHED + beside)
    }

    /// Whether what is known of the nodes from column and row `low` to `high` may be asked for.
    pub fn looks_at(&self, low: PlanNode, high: PlanNode) -> bool {
        self.comes_near(low, high, TOUCHED + 1)
    }
}

/// The coarse nodes around a fine one, some of them twice.
fn around(node: PlanNode) -> [PlanNode; 4] {
    let [left, above] = node.map(|at| at.div_euclid(2));
    let [right, below] = node.map(|at| (at + 1).div_euclid(2));
    [[left, above], [right, above], [left, below], [right, below]]
}

/// What is left to pay from the nodes of a corridor to its end, about.
pub(super) struct Outlook {
    /// The first coarse node, and how many there are in a row and in a column.
    at: PlanNode,
    cols: i64,
    rows: i64,
    /// Row by row.
    costs: Vec<u32>,
}

impl Outlook {
    /// What is left to pay to a node of a window, within a corridor.
    pub fn new(ground: &CoarseGround, corridor: &Corridor, to: PlanNode) -> Outlook {
        let window = ground.window;
        let holds = |[x, y]: PlanNode| corridor.is_inside([x + window.at[0], y + window.at[1]]);
        let costs = ground.spread(to, None, |_| FORBIDDEN, holds);
        Outlook { at: window.at, cols: window.cols as i64, rows: window.rows as i64, costs }
    }

    /// What is left from a fine node of the world, or [`FORBIDDEN`]: the mean of what is left from the coarse ones around it.
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
