//! What is left to pay to a node of the plan from all others, about: what makes a search look along the best ways first.
//!
//! The same costs as those of moves, of longer moves over fewer nodes, back from the goal. What only the moves themselves
//! know is left out: rivers, turns, and dents between nodes.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::places::ellipse::Ellipse;
use crate::places::move_cost::{FORBIDDEN, Ground};
use crate::places::moves;
use crate::places::plan_land::PlanNode;

/// Nodes of the plan from one that is looked at to the next, along rows and columns.
const APART: i64 = 2;

/// How far the moves between these go along rows and columns, at most.
const FAR: i64 = 2;

/// How many times what the start has to pay others may have that are looked at: what has more is on no way that is taken.
const FURTHER: f64 = 1.25;

/// What is left to pay, by node.
pub(super) struct Outlook {
    /// The first node that is looked at, 0 or 1 each, and how many there are in a row.
    first: PlanNode,
    cols: i64,
    rows: i64,
    /// Row by row.
    costs: Vec<u32>,
    /// What is left from where nothing has been found, at least.
    beyond: u32,
}

impl Outlook {
    /// What is left to pay in the ellipse of two nodes to the second of them.
    pub fn new(ground: &Ground, [from, to]: [PlanNode; 2]) -> Outlook {
        let window = &ground.land.window;
        let ellipse = Ellipse::new([from, to]);
        let first = to.map(|at| at.rem_euclid(APART));
        let [cols, rows] = [window.cols as i64 - first[0], window.rows as i64 - first[1]].map(|n| (n - 1) / APART + 1);
        let mut costs = vec![FORBIDDEN; (cols * rows) as usize];
        let node = |col: i64, row: i64| [first[0] + col * APART, first[1] + row * APART];
        let [to_col, to_row] = [0, 1].map(|axis| (to[axis] - first[axis]) / APART);
        costs[(to_row * cols + to_col) as usize] = 0;
        let mut heap = BinaryHeap::from([Reverse((0, to_row * cols + to_col))]);
        let mut beyond = FORBIDDEN;
        while let Some(Reverse((cost, at))) = heap.pop() {
            if cost > costs[at as usize] {
                continue;
            }
            if cost > beyond {
                break;
            }
            let (col, row) = (at % cols, at / cols);
            let here = node(col, row);
            // Around the start all is known that a way from there may come to.
            if beyond == FORBIDDEN && [0, 1].iter().all(|axis| (here[*axis] - from[*axis]).abs() < APART) {
                beyond = (f64::from(cost) * FURTHER) as u32;
            }
            for [dx, dy] in moves::up_to(FAR) {
                let (col, row) = (col + dx, row + dy);
                if !(0..cols).contains(&col) || !(0..rows).contains(&row) || !ellipse.holds(node(col, row)) {
                    continue;
                }
                let next = row * cols + col;
                let cost = cost + ground.about(node(col, row), here);
                if cost < costs[next as usize] {
                    costs[next as usize] = cost;
                    heap.push(Reverse((cost, next)));
                }
            }
        }
        Outlook { first, cols, rows, costs, beyond }
    }

    /// What is left from a node.
    pub fn to_go(&self, node: PlanNode) -> u32 {
        // The mean of those around it.
        let [x, y] = [0, 1].map(|axis| node[axis] - self.first[axis]);
        let [col, row] = [x.div_euclid(APART), y.div_euclid(APART)];
        let [right, below] = [x, y].map(|at| i64::from(at.rem_euclid(APART) != 0));
        let cost = |col: i64, row: i64| {
            let is_known = (0..self.cols).contains(&col) && (0..self.rows).contains(&row);
            let cost = if is_known { self.costs[(row * self.cols + col) as usize] } else { FORBIDDEN };
            u64::from(cost.min(self.beyond))
        };
        let sum = cost(col, row) + cost(col + right, row) + cost(col, row + below) + cost(col + right, row + below);
        (sum / 4) as u32
    }
}
