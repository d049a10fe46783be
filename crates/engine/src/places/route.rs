//! The route of least cost between two sites, over the nodes of the fine plan.
//!
//! `move_cost.rs` has the costs of moves, `turn_cost.rs` those of turns from one move to the next. The search sees
//! nothing but the corridor between the two sites, so the route is a function of the sites and of the land.
//!
//! Based on: E. Galin, A. Peytavie, N. Marechal, E. Guerin, "Procedural Generation of Roads", 2010.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::clock::Clock;
use crate::places::corridor::Outlook;
use crate::places::move_cost::{FORBIDDEN, MoveConditions, RepeatedMove, UNIT};
use crate::places::moves::{MOVES, moved};
use crate::places::plan_land::PlanNode;
use crate::places::route_land::RouteLand;
use crate::places::turn_cost::{hairpin, turns};
use crate::stop::Stopped;

/// Cost in metres, above that of the best state of a node, up to which other directions at the node are kept. It is
/// more than any turn costs that is made over the shortest move, 80 m on the default cells.
const SLACK_M: f64 = 150.0;

/// A route as nodes. `bridges[k]` is true if the leg from node k to the next goes over a lake or the sea.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Route {
    pub nodes: Vec<PlanNode>,
    pub bridges: Vec<bool>,
}

/// Finds the cheapest route from one node of a window to another, if there is one, by A* over states: a node and the
/// move that led there. Routes of equal cost are told apart by a fixed rule, so the result is unique. `outlook`
/// estimates the cost to `to`.
pub(super) fn route(
    ground: &MoveConditions,
    outlook: &Outlook,
    [from, to]: [PlanNode; 2],
    clock: &Clock,
) -> Result<Option<Route>, Stopped> {
    let MoveConditions { land, standard, .. } = *ground;
    let window = &land.window;
    let turns = turns(standard, land.scale.step_m());
    let nodes = window.cols * window.rows;
    let mut costs = Vec::new();
    costs.resize_with(nodes, || None);
    // A state is a node and the move that led there.
    let mut best = vec![FORBIDDEN; nodes * MOVES];
    let mut before = vec![u32::MAX; nodes * MOVES];
    // The least cost at which any state of a node has been reached.
    let mut least = vec![FORBIDDEN; nodes];
    let mut heap = BinaryHeap::new();
    let start = window.index(from);
    least[start] = 0;
    // Ordered by estimate, cost and state: ties are broken by the number of the state, never by the order of insertion.
    let to_go = |[x, y]: PlanNode| outlook.to_go([x + window.at[0], y + window.at[1]]);
    heap.push(Reverse((to_go(from), 0, u32::MAX)));
    let slack = (SLACK_M * UNIT) as u32;
    while let Some(Reverse((_, cost, state))) = heap.pop() {
        clock.check()?;
        let (at, came) = match state {
            u32::MAX => (start, None),
            _ => (state as usize / MOVES, Some(state as usize % MOVES)),
        };
        // A cheaper state has come since this entry was pushed: stale entries stay in the heap and are skipped here.
        if came.is_some() && best[state as usize] < cost || cost > least[at].saturating_add(slack) {
            continue;
        }
        let node = window.node(at);
        if node == to {
            return Ok(Some(trace(land, &before, state, from)));
        }
        // Up to 32 states of a node share the costs of its moves, and many nodes are never reached: so costs are
        // computed on demand and stored.
        if costs[at].is_none() {
            costs[at] = Some(Box::new(ground.costs(node, &costs)));
        }
        let leave = costs[at].as_ref().expect("it has just been made");
        for RepeatedMove { number, times, cost: step } in leave.steps() {
            let turn = came.map_or(0, |came| turns[came][number]);
            if turn == FORBIDDEN {
                continue;
            }
            // A bridge over many moves arrives with the same direction as one move. `before` knows where it began, so
            // the state need not.
            let next = moved(node, number, times);
            let (there, mut cost) = (window.index(next), cost + step + turn);
            let state = there * MOVES + number;
            // A costlier direction is kept while it may pay off at the next turn. Without a bound all 32 would be kept.
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
            // No estimate means that no route leads on from there.
            let left = to_go(next);
            if left != FORBIDDEN {
                heap.push(Reverse((cost + left, cost, state as u32)));
            }
        }
    }
    Ok(None)
}

/// Returns the route that led to a state.
fn trace(land: &RouteLand, before: &[u32], last: u32, from: PlanNode) -> Route {
    let (mut nodes, mut state) = (Vec::new(), last);
    while state != u32::MAX {
        nodes.push(land.window.node(state as usize / MOVES));
        state = before[state as usize];
    }
    // The start has no state of its own, since no move led there.
    nodes.push(from);
    nodes.reverse();
    let bridges = nodes.windows(2).map(|leg| land.is_over_open_water(leg[0], leg[1])).collect();
    Route { nodes, bridges }
}
