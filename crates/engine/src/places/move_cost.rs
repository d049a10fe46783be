//! Costs of the moves from one node of the plan to another.
//!
//! The cost of a move is its length, plus extra where the move is steep (by the square of the grade, so that routes
//! climb in switchbacks), where the land falls off to its side, and where it crosses a river. A move and its reverse
//! cost the same.
//!
//! To judge the numbers chosen by eye, look at the switchbacks, detours and bridges of roads, on maps of `alps` and
//! `plains`.

use std::collections::BTreeSet;

use crate::geometry::length;
use crate::places::ellipse::apart;
use crate::places::fixed::FixedSegment;
use crate::places::moves::{self, MOVES, moved};
use crate::places::plan_land::PlanNode;
use crate::places::route_land::{RouteLand, parts, shore2};
use crate::places::settings::Standard;

/// Number of units of cost in a metre of level way.
// Costs are whole numbers, so that their sum is the same in any order. A `u32` has room for 268,000 km of these units.
pub(super) const UNIT: f64 = 16.0;

/// Cost of a move that is impossible.
// It also marks states that the search has not reached: no cost that is counted comes near it.
pub(super) const FORBIDDEN: u32 = u32::MAX;

/// Extra cost of a metre at the steepest grade, in metres of level way. Chosen by eye. Above 1, the cheapest climb is
/// gentler than the steepest grade, by a factor of the square root of `STEEP`.
const STEEP: f64 = 2.0;

/// Extra cost, in metres of level way, of a metre along a slope of 45 degrees: the price of earthworks. Chosen by eye.
const SIDE: f64 = 3.0;

/// Extra cost of a way where noise makes the ground roughest, as a share of the way's length. The heights do not show
/// this roughness: it keeps routes over a plain from following the lattice. Chosen by eye.
const WANDER: f64 = 0.5;

/// Cost of a ford and of a bridge in metres of level way: a base, and the cost of each metre of the river's width.
/// Chosen by eye: a route makes a detour of a few hundred metres rather than cross a bridge.
const FORD_COST_M: [f64; 2] = [60.0, 10.0];
const BRIDGE_COST_M: [f64; 2] = [200.0, 12.0];

/// Square of the cotangent of the smallest angle at which a route may cross a river: 30 degrees.
const FLATTEST: f64 = 3.0;

/// Share of the maximum grade that a move may have between nodes. The rest is a reserve, since rounded corners shorten
/// the way. Chosen by eye.
const GRADE_SHARE: f64 = 0.9;

/// Steepest grade of a part of a move, as a multiple of the steepest grade of a move: earthworks fill such dents and
/// cut such bumps. Chosen by eye.
const BUMP: f64 = 2.0;

/// All steps from one node: the cost of each single move, and bridges that take several moves at once.
pub(super) struct Costs {
    moves: [u32; MOVES],
    /// Bridges over several equal moves in a row.
    bridges: Vec<RepeatedMove>,
}

/// A step from a node: a move, the number of times that it is made, and the cost of all together.
#[derive(Clone, Copy)]
pub(super) struct RepeatedMove {
    pub number: usize,
    pub times: i64,
    pub cost: u32,
}

impl Costs {
    /// Returns all possible steps from the node, single moves first.
    pub fn steps(&self) -> impl Iterator<Item = RepeatedMove> {
        let singles =
            self.moves.iter().enumerate().map(|(number, cost)| RepeatedMove { number, times: 1, cost: *cost });
        singles.chain(self.bridges.iter().copied()).filter(|step| step.cost != FORBIDDEN)
    }
}

/// All that the costs of moves depend on: the land, the standard of the road's class, and the moves closed by earlier
/// tries.
pub(super) struct MoveConditions<'a> {
    pub land: &'a RouteLand,
    pub standard: &'a Standard,
    /// Moves that turned out to be impossible to build, by their ends.
    pub closed: &'a BTreeSet<(PlanNode, PlanNode)>,
}

/// Returns the cost in metres of the cheapest even climb of `rise_m` over a straight distance of `length_m`: a longer
/// way if the straight one is too steep.
pub(super) fn even_climb_m(standard: &Standard, length_m: f64, rise_m: f64) -> f64 {
    // The length at which making the way longer costs more than the gentler grade saves.
    let even_m = rise_m * STEEP.sqrt() / standard.max_grade;
    match even_m > length_m {
        // The smallest value of the sum in the other branch.
        true => 2.0 * even_m,
        false => length_m + even_m * even_m / length_m,
    }
}

/// Returns half of the cost, in metres, for the land that falls off to the side of a move of `length_m` metres in
/// direction `[dx, dy]`, given the gradient at one of its ends.
pub(super) fn sideways_m([east, south]: [f64; 2], [dx, dy]: [f64; 2], length_m: f64) -> f64 {
    // Only the slope across the way: callers add the cost of the slope along it.
    let side = east * dy - south * dx;
    length_m * SIDE / 2.0 * side * side
}

/// Returns half of the cost, in metres, for rough ground along `length_m` metres, given the roughness at one of their
/// ends.
pub(super) fn wandering_m(wander: f64, length_m: f64) -> f64 {
    length_m * WANDER / 2.0 * wander
}

/// Returns the extra cost, in metres, of `length_m` metres on a bridge, without the base cost of the bridge.
pub(super) fn over_water_m(length_m: f64) -> f64 {
    BRIDGE_COST_M[1] * length_m
}

impl MoveConditions<'_> {
    /// Returns the costs of all steps from a node. `known` has the costs of the nodes that the search has been at. A
    /// way and its reverse cost the same, so ways back to those nodes are looked up.
    pub fn costs(&self, node: PlanNode, known: &[Option<Box<Costs>>]) -> Costs {
        let window = &self.land.window;
        let mut near = Vec::new();
        let is_open = self.is_open(node);
        let moves: [u32; MOVES] = std::array::from_fn(|number| {
            let next = moved(node, number, 1);
            if !self.is_open(next) {
                return FORBIDDEN;
            }
            // The start may lie where no move may end. Then `known` says that the way back is forbidden, so the cost is
            // computed.
            match &known[window.index(next)] {
                Some(there) if is_open => there.moves[moves::back(number)],
                _ => self.cost(node, next, &mut near),
            }
        });
        let mut bridges = Vec::new();
        for number in (0..MOVES).filter(|number| moves::vector(*number).iter().all(|part| part.abs() <= 2)) {
            // Several moves at once pay only where the first one would end in water.
            let next = moved(node, number, 1);
            if moves[number] != FORBIDDEN || !self.land.holds(next) || !self.land.is_wet(next) {
                continue;
            }
            let one_m = length(moves::vector(number).map(|part| part as f64)) * self.land.scale.step_m();
            // Two more, since nodes stand back from the water. `cost` refuses bridges that are too long after all.
            let most = ((self.standard.bridge_m / one_m) as i64 + 2).min(u8::MAX as i64);
            // Only the first landing counts: whatever goes on from there is another move.
            let mut nodes = (2..=most).map(|times| (times, moved(node, number, times)));
            let landing = nodes.find(|(_, next)| !self.land.holds(*next) || !self.land.is_wet(*next));
            let landing = landing.filter(|(_, next)| self.is_open(*next));
            bridges.extend(landing.map(|(times, next)| {
                let cost = self.cost(node, next, &mut near);
                RepeatedMove { number, times, cost }
            }));
        }
        Costs { moves, bridges }
    }

    /// True if a move may end on a node.
    fn is_open(&self, node: PlanNode) -> bool {
        self.land.holds(node) && !self.land.is_wet(node)
    }

    fn rise_m(&self, from: PlanNode, to: PlanNode) -> f64 {
        self.land.window.height_m(to) - self.land.window.height_m(from)
    }

    /// Returns the cost of the straight move from one node to another, in units, or [`FORBIDDEN`].
    fn cost(&self, from: PlanNode, to: PlanNode, near: &mut Vec<u32>) -> u32 {
        // Ordered, so that both directions cost the same to the bit: roads from one site to two others then share a
        // route while they can.
        let (from, to) = if from < to { (from, to) } else { (to, from) };
        let cost_m = self.cost_m(from, to, near);
        cost_m.map_or(FORBIDDEN, |cost_m| (cost_m * UNIT) as u32)
    }

    /// Returns the cost of a move in metres of level way; `None` if the move is impossible.
    fn cost_m(&self, from: PlanNode, to: PlanNode, near: &mut Vec<u32>) -> Option<f64> {
        if self.closed.contains(&(from, to)) || self.closed.contains(&(to, from)) {
            return None;
        }
        // Cheap reasons to refuse come first: the grade takes two heights, the rivers a search.
        let step_m = self.land.scale.step_m();
        let length_m = apart(from, to) * step_m;
        let rise_m = self.rise_m(from, to);
        if rise_m.abs() > self.most_grade() * length_m {
            return None;
        }
        let mut cost_m = length_m + self.crossing_m(from, to, near)?;
        if self.land.is_over_open_water(from, to) {
            // The nodes at the ends may stand a step back from the shores, so the bridge itself is shorter than the
            // move.
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

    /// Returns the steepest grade of a move.
    fn most_grade(&self) -> f64 {
        self.standard.max_grade * GRADE_SHARE
    }

    /// Returns the extra cost of a metre at a grade, in metres of level way.
    fn climb(&self, grade: f64) -> f64 {
        STEEP * grade * grade / (self.standard.max_grade * self.standard.max_grade)
    }

    /// Adds to `cost_m` the extra cost of the slopes along and across a move on land; `None` if a part of the move is
    /// too steep.
    fn with_slopes(&self, mut cost_m: f64, from: PlanNode, to: PlanNode, length_m: f64) -> Option<f64> {
        // The move is measured part by part: otherwise a wall or a gorge between two level ends would go unnoticed.
        // Each part is added to the sum so far, since another order would round to other costs.
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

    /// Returns the cost of the rivers that a move crosses, in metres; `None` if it runs along a river or cannot cross
    /// one.
    fn crossing_m(&self, from: PlanNode, to: PlanNode, near: &mut Vec<u32>) -> Option<f64> {
        let [from, to] = [from, to].map(|node| self.land.scale.fixed(node));
        let way = FixedSegment { from, to };
        let (mut cost_m, mut crosses, mut grazes) = (0.0, false, false);
        for piece in self.land.rivers.near(way, near) {
            let is_beside = |end: [i64; 2]| way.distance2(end) < shore2(piece, &self.land.scale);
            if piece.middle.crosses(&way) {
                let (u, v) = (way.along(), piece.middle.along());
                // Segments that cross are not parallel, so the divisor is not 0.
                let cot = u.dot(v) / u.perp_dot(v);
                if cot * cot > FLATTEST || piece.width_m > self.standard.bridge_m {
                    return None;
                }
                let is_ford = piece.width_m <= self.standard.ford_m;
                let [base_m, more] = if is_ford { FORD_COST_M } else { BRIDGE_COST_M };
                // The factor is 1 / sin^2 of the angle: the crossing's length relative to the river's width, squared.
                cost_m += (base_m + more * piece.width_m) * (1.0 + cot * cot);
                crosses = true;
            } else if is_beside(piece.middle.from) || is_beside(piece.middle.to) {
                grazes = true;
            }
        }
        // Next to a piece that is crossed, the neighbouring pieces are near too. A move that is near a river and does
        // not cross it runs along its bank.
        (crosses || !grazes).then_some(cost_m)
    }
}
