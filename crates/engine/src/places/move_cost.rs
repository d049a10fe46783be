//! What moves from one node of the plan to another cost.
//!
//! The cost of a move is its length, more where it is steep (by the square, which is what makes switchbacks), where the land
//! falls to its side, and where it crosses a river. It is the same there and back.

use std::collections::BTreeSet;

use crate::geometry::length;
use crate::places::ellipse::apart;
use crate::places::fixed::FixedSegment;
use crate::places::moves::{self, MOVES, moved};
use crate::places::plan_land::PlanNode;
use crate::places::route_land::{RouteLand, parts, shore2};
use crate::places::settings::Standard;

/// Parts of a metre in which costs are counted.
// Whole numbers add up to the same in any order, and a u32 has room for 268,000 km of such parts.
pub(super) const UNIT: f64 = 16.0;

/// The cost of what cannot be done.
// It also stands for what has not been reached: no cost that is counted comes near it.
pub(super) const FORBIDDEN: u32 = u32::MAX;

/// Metres of level way that a metre at the steepest grade costs more than a level one. Chosen by eye. From 1 on, a way takes the length that halves the
/// grade rather than climb straight.
const STEEP: f64 = 2.0;

/// Metres of level way that a metre costs more on land that falls by a metre a metre to the side: an earthwork. Chosen by eye.
const SIDE: f64 = 3.0;

/// How much more a metre costs where it is worst to walk for no reason that the heights show: what keeps ways from
/// following the lattice over a plain. Chosen by eye.
const WANDER: f64 = 0.5;

/// Metres that a crossing costs, and that each metre of a river's width costs more: a ford, a bridge. Chosen by eye: a way
/// goes round some hundred metres rather than over a bridge.
const FORD_COST_M: [f64; 2] = [60.0, 10.0];
const BRIDGE_COST_M: [f64; 2] = [200.0, 12.0];

/// The square of the cotangent of the flattest angle at which a river may be crossed: 30 degrees.
const FLATTEST: f64 = 3.0;

/// Share of the maximum grade that a way may have between nodes; the rest is for the corners that are cut later. Chosen by
/// eye.
const GRADE_SHARE: f64 = 0.9;

/// How many times steeper a part of a move may be, a dent or a bump that is filled or cut. Chosen by eye.
const BUMP: f64 = 2.0;

/// Moves from one node: what each costs, and bridges over more than a move.
pub(super) struct Costs {
    moves: [u32; MOVES],
    /// Bridges over several equal moves.
    bridges: Vec<Step>,
}

/// One way to leave a node: a move, how many times it is made, and what that costs.
#[derive(Clone, Copy)]
pub(super) struct Step {
    pub number: usize,
    pub times: i64,
    pub cost: u32,
}

impl Costs {
    /// All ways to leave the node that can be gone, single moves first.
    pub fn steps(&self) -> impl Iterator<Item = Step> {
        let singles = self.moves.iter().enumerate().map(|(number, cost)| Step { number, times: 1, cost: *cost });
        singles.chain(self.bridges.iter().copied()).filter(|step| step.cost != FORBIDDEN)
    }
}

/// What the costs of moves depend on: the land, the class of the road, and what has been tried.
pub(super) struct Ground<'a> {
    pub land: &'a RouteLand,
    pub standard: &'a Standard,
    /// Moves that have turned out not to be possible, by their ends.
    pub closed: &'a BTreeSet<(PlanNode, PlanNode)>,
}

/// What the best even climb over so many metres costs.
pub(super) fn even_climb_m(standard: &Standard, length_m: f64, rise_m: f64) -> f64 {
    // The length at which a longer way would cost more than it saves.
    let even_m = rise_m * STEEP.sqrt() / standard.max_grade;
    match even_m > length_m {
        // The sum below, at the length where it is least.
        true => 2.0 * even_m,
        false => length_m + even_m * even_m / length_m,
    }
}

/// What so many metres cost that go from a node of such a gradient or to it, for the land that falls to their side there: half of
/// them.
pub(super) fn sideways_m([east, south]: [f64; 2], [dx, dy]: [f64; 2], length_m: f64) -> f64 {
    // The slope across the way only; that along it is paid for by its parts.
    let side = east * dy - south * dx;
    length_m * SIDE / 2.0 * side * side
}

/// What so many metres cost for how bad a node at one end is to walk on: half of them.
pub(super) fn wandering_m(wander: f64, length_m: f64) -> f64 {
    length_m * WANDER / 2.0 * wander
}

/// What so many metres on a bridge cost more than on land, without its ends.
pub(super) fn over_water_m(length_m: f64) -> f64 {
    BRIDGE_COST_M[1] * length_m
}

impl Ground<'_> {
    /// The costs of all moves from a node within the corridor. Those of other nodes are known in part; the way back costs the
    /// same.
    pub fn costs(&self, node: PlanNode, known: &[Option<Box<Costs>>]) -> Costs {
        let window = &self.land.window;
        let mut near = Vec::new();
        let is_open = self.is_open(node);
        let moves: [u32; MOVES] = std::array::from_fn(|number| {
            let next = moved(node, number, 1);
            if !self.is_open(next) {
                return FORBIDDEN;
            }
            // A node that no move may end on, as a start may be, has no way back that could be read.
            match &known[window.index(next)] {
                Some(there) if is_open => there.moves[moves::back(number)],
                _ => self.cost(node, next, &mut near),
            }
        });
        let mut bridges = Vec::new();
        for number in (0..MOVES).filter(|number| moves::vector(*number).iter().all(|part| part.abs() <= 2)) {
            // More than one move at a time pays where the first would end in water.
            let next = moved(node, number, 1);
            if moves[number] != FORBIDDEN || !self.land.holds(next) || !self.land.is_wet(next) {
                continue;
            }
            let one_m = length(moves::vector(number).map(|part| part as f64)) * self.land.scale.step_m();
            // Some more, since nodes stand back from the water; `cost` refuses what is too long after all.
            let most = ((self.standard.bridge_m / one_m) as i64 + 2).min(u8::MAX as i64);
            // The first landing or none: what goes on from there is another move.
            let mut nodes = (2..=most).map(|times| (times, moved(node, number, times)));
            let landing = nodes.find(|(_, next)| !self.land.holds(*next) || !self.land.is_wet(*next));
            let landing = landing.filter(|(_, next)| self.is_open(*next));
            bridges.extend(landing.map(|(times, next)| {
                let cost = self.cost(node, next, &mut near);
                Step { number, times, cost }
            }));
        }
        Costs { moves, bridges }
    }

    /// Whether a move may end on a node.
    fn is_open(&self, node: PlanNode) -> bool {
        self.land.holds(node) && !self.land.is_wet(node)
    }

    fn rise_m(&self, from: PlanNode, to: PlanNode) -> f64 {
        self.land.window.height_m(to) - self.land.window.height_m(from)
    }

    /// What the straight move from one node to another costs, in parts of a metre, or [`FORBIDDEN`].
    fn cost(&self, from: PlanNode, to: PlanNode, near: &mut Vec<u32>) -> u32 {
        // The same there and back, to the bit: so roads that leave a site for two others share a way while they can.
        let (from, to) = if from < to { (from, to) } else { (to, from) };
        let cost_m = self.cost_m(from, to, near);
        cost_m.map_or(FORBIDDEN, |cost_m| (cost_m * UNIT) as u32)
    }

    /// What a move costs in metres of level way; `None` if it cannot be made.
    fn cost_m(&self, from: PlanNode, to: PlanNode, near: &mut Vec<u32>) -> Option<f64> {
        if self.closed.contains(&(from, to)) || self.closed.contains(&(to, from)) {
            return None;
        }
        // What is cheap to refuse comes first: the grade takes two heights, the rivers a search.
        let step_m = self.land.scale.step_m();
        let length_m = apart(from, to) * step_m;
        let rise_m = self.rise_m(from, to);
        if rise_m.abs() > self.most_grade() * length_m {
            return None;
        }
        let mut cost_m = length_m + self.crossing_m(from, to, near)?;
        if self.land.is_over_open_water(from, to) {
            // The nodes at its ends may stand a step back from the shores, so the bridge itself is shorter.
            if length_m > self.standard.bridge_m + 2.0 * step_m {
                return None;
            }
            let [base_m, _] = BRIDGE_COST_M;
            cost_m += base_m + over_water_m(length_m) + length_m * self.climb(rise_m / length_m);
        } else {
            cost_m = self.with_slopes(cost_m, from, to, length_m)?;
        }
        Some(cost_m + [from, to].iter().map(|end| wandering_m(self.land.wander(*end), length_m)).sum::<f64>())
    }

    /// The steepest grade between nodes.
    fn most_grade(&self) -> f64 {
        self.standard.max_grade * GRADE_SHARE
    }

    /// What a metre at a grade costs more than a level one.
    fn climb(&self, grade: f64) -> f64 {
        STEEP * grade * grade / (self.standard.max_grade * self.standard.max_grade)
    }

    /// A cost in metres, and what the slopes along and across a move on land add to it; `None` where one is too steep.
    fn with_slopes(&self, mut cost_m: f64, from: PlanNode, to: PlanNode, length_m: f64) -> Option<f64> {
        // To the sum so far, one by one: in another order they would round to other costs.
        // Part by part, since a wall or a gorge between level ends would go unseen else.
        let parts = parts(from, to);
        let part_m = length_m / parts as f64;
        let mut last_m = self.land.window.height_m(from);
        for part in 1..=parts {
            let height_m = self.land.height_between(from, to, part, parts);
            let grade = (height_m - last_m) / part_m;
            if grade.abs() > BUMP * self.most_grade() {
                return None;
            }
            cost_m += part_m * self.climb(grade);
            last_m = height_m;
        }
        let [dx, dy] = [0, 1].map(|axis| (to[axis] - from[axis]) as f64 * self.land.scale.step_m() / length_m);
        for end in [from, to] {
            cost_m += sideways_m(self.land.gradient(end), [dx, dy], length_m);
        }
        Some(cost_m)
    }

    /// Metres that the rivers under a move cost; `None` if it goes along one or cannot cross.
    fn crossing_m(&self, from: PlanNode, to: PlanNode, near: &mut Vec<u32>) -> Option<f64> {
        let [from, to] = [from, to].map(|node| self.land.scale.fixed(node));
        let way = FixedSegment { from, to };
        let (mut cost_m, mut crosses, mut grazes) = (0.0, false, false);
        for piece in self.land.rivers.near(way, near) {
            let is_beside = |end: [i64; 2]| way.distance2(end) < shore2(piece, &self.land.scale);
            if piece.middle.crosses(&way) {
                let (u, v) = (way.along(), piece.middle.along());
                // Lines that cross are not parallel, so this does not divide by 0.
                let cot = (u[0] * v[0] + u[1] * v[1]) / (u[0] * v[1] - u[1] * v[0]);
                if cot * cot > FLATTEST || piece.width_m > self.standard.bridge_m {
                    return None;
                }
                let is_ford = piece.width_m <= self.standard.ford_m;
                let [base_m, more] = if is_ford { FORD_COST_M } else { BRIDGE_COST_M };
                // By the square of how much longer it is than straight across: 1 / sin^2.
                cost_m += (base_m + more * piece.width_m) * (1.0 + cot * cot);
                crosses = true;
            } else if is_beside(piece.middle.from) || is_beside(piece.middle.to) {
                grazes = true;
            }
        }
        // Beside a piece that is crossed the next ones are near, too. What comes near and crosses none goes along it.
        (crosses || !grazes).then_some(cost_m)
    }
}
