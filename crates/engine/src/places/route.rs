//! The way of least cost between two sites, over the nodes of the plan.
//!
//! What a move costs stands in `move_cost.rs`, what a turn from one to the next does in `turn_cost.rs`. The search sees an
//! corridor between the two sites and nothing else, so the way is a function of them and of the land.
//!
//! Based on: E. Galin, A. Peytavie, N. Marechal, E. Guerin, "Procedural Generation of Roads", 2010.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::places::corridor::Outlook;
use crate::places::move_cost::{FORBIDDEN, Ground, Step, UNIT};
use crate::places::moves::{MOVES, moved};
use crate::places::plan_land::PlanNode;
use crate::places::route_land::RouteLand;
use crate::places::turn_cost::{hairpin, turns};
use crate::stop;

/// Metres of cost beyond that of the best way to a node with which another direction there is still worth a look: more than
/// any turn of a way costs that is made over the shortest move, 80 m on the default cells.
const SLACK_M: f64 = 150.0;

/// A way as nodes. `bridges[k]` tells whether the leg from node k to the next goes over a lake or the sea.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Route {
    pub nodes: Vec<PlanNode>,
    pub bridges: Vec<bool>,
}

/// The way from one node of a window to another, if there is one: A* over nodes and the moves that lead to them. Of ways that
/// cost the same it is always the same one. The outlook is that to the second of the two.
pub(super) fn route(ground: &Ground, outlook: &Outlook, [from, to]: [PlanNode; 2]) -> Option<Route> {
    let Ground { land, standard, .. } = *ground;
    let window = &land.window;
    let turns = turns(standard, land.scale.step_m());
    let nodes = window.cols * window.rows;
    let mut costs = Vec::new();
    costs.resize_with(nodes, || None);
    // A state is a node and the move that has led there.
    let mut best = vec![FORBIDDEN; nodes * MOVES];
    let mut before = vec![u32::MAX; nodes * MOVES];
    // The least cost at which any of a node's states has been reached.
    let mut least = vec![FORBIDDEN; nodes];
    let mut heap = BinaryHeap::new();
    let start = window.index(from);
    least[start] = 0;
    // Ordered by estimate, cost and state: ties are broken by number, never by when they were pushed.
    let to_go = |[x, y]: PlanNode| outlook.to_go([x + window.at[0], y + window.at[1]]);
    heap.push(Reverse((to_go(from), 0, u32::MAX)));
    let slack = (SLACK_M * UNIT) as u32;
    while let Some(Reverse((_, cost, state))) = heap.pop() {
        stop::check();
        let (at, came) = match state {
            u32::MAX => (start, None),
            _ => (state as usize / MOVES, Some(state as usize % MOVES)),
        };
        // A better one has come since this was pushed: entries are left to grow stale rather than looked for.
        if came.is_some() && best[state as usize] < cost || cost > least[at].saturating_add(slack) {
            continue;
        }
        let node = window.node(at);
        if node == to {
            return Some(trace(land, &before, state, from));
        }
        // Up to 32 states leave a node and find its moves at the same cost, and many nodes are never come to.
        if costs[at].is_none() {
            costs[at] = Some(Box::new(ground.costs(node, &costs)));
        }
        let leave = costs[at].as_ref().expect("it has just been made");
        for Step { number, times, cost: step } in leave.steps() {
            let turn = came.map_or(0, |came| turns[came][number]);
            if turn == FORBIDDEN {
                continue;
            }
            // A bridge over many moves arrives as one does: `before` knows where it began, so the state need not.
            let next = moved(node, number, times);
            let (there, mut cost) = (window.index(next), cost + step + turn);
            let state = there * MOVES + number;
            // A dearer direction is kept while it may pay at the next turn; without a bound all 32 would be.
            let pays = |cost: u32| cost < best[state] && cost <= least[there].saturating_add(slack);
            if !pays(cost) {
                continue;
            }
            // Last, since it takes the longest and few turns are so sharp.
            let earthwork = came.map_or(Some(0), |came| hairpin(standard, land.gradient(node), came, number));
            let Some(earthwork) = earthwork else { continue };
            cost += earthwork;
            if !pays(cost) {
                continue;
            }
            best[state] = cost;
            least[there] = least[there].min(cost);
            before[state] = came.map_or(u32::MAX, |came| (at * MOVES + came) as u32);
            // Where there is no way on there is nothing to go on for.
            let left = to_go(next);
            if left != FORBIDDEN {
                heap.push(Reverse((cost + left, cost, state as u32)));
            }
        }
    }
    None
}

/// The way that has led to a state.
fn trace(land: &RouteLand, before: &[u32], last: u32, from: PlanNode) -> Route {
    let (mut nodes, mut state) = (Vec::new(), last);
    while state != u32::MAX {
        nodes.push(land.window.node(state as usize / MOVES));
        state = before[state as usize];
    }
    // The start was left by no move, so it has no state of its own.
    nodes.push(from);
    nodes.reverse();
    let bridges = nodes.windows(2).map(|leg| land.is_over_open_water(leg[0], leg[1])).collect();
    Route { nodes, bridges }
}
