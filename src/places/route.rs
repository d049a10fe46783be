//! The way of least cost between two sites, over the nodes of the plan.
//!
//! A move goes along any vector of whole numbers up to 3 without a common divisor. Its cost is its length, more where it
//! is steep (by the square, which is what makes switchbacks), where the land falls to its side, and where it crosses a
//! river; a turn costs by the square of its curvature and may not be sharper than the class allows. The search sees an
//! ellipse around the two sites and nothing else, so the way is a function of them and of the land.
//!
//! A turn may go on until its arc needs more room than its legs have, so a way climbs by hairpins what is too steep for a
//! straight one. Their arcs have no transition curves: those of real ones, of 6 to 15 m as a rule, seldom have ("Mountain
//! Roads' Geometric Design: Methodological Proposal for Hairpin Bend Design/Retrofitting", Infrastructures 7(9), 112, 2022).
//!
//! Based on: E. Galin, A. Peytavie, N. Marechal, E. Guerin, "Procedural Generation of Roads", 2010.

use std::cmp::Reverse;
use std::collections::{BTreeSet, BinaryHeap};

use crate::geometry::length;
use crate::hash::{self, Stream};
use crate::land::WaterKind;
use crate::lines::FIXED;
use crate::places::plan_land::{RiverIndex, Scale, Window, distance2};
use crate::places::settings::Standard;

/// A node: column and row in the window.
pub(super) type PlanNode = [i64; 2];

/// The moves of a quarter turn, by angle; the others are these, turned.
const QUARTER: [[i64; 2]; 8] = [[1, 0], [3, 1], [2, 1], [3, 2], [1, 1], [2, 3], [1, 2], [1, 3]];

/// Moves from a node.
const MOVES: usize = 4 * QUARTER.len();

/// What a metre at the steepest grade costs more than a level one. From 1 on, a way takes the length that halves the
/// grade rather than climb straight.
const STEEP: f64 = 2.0;

/// What a metre costs more on land that falls by 1 to the side: an earthwork. Chosen by eye.
const SIDE: f64 = 3.0;

/// Square metres: what the square of a turn's angle costs, times the length over which it is made. Chosen by eye: a right
/// angle over 100 m costs 40 m of way.
const CURVATURE_M2: f64 = 2000.0;

/// How much more a metre costs where it is worst to walk for no reason that the heights show: what keeps ways from
/// following the lattice over a plain. Chosen by eye.
const WANDER: f64 = 0.5;

/// Share of that which the rest of a way is taken to cost: more than the half that it has on average, for the turns and slopes
/// that the estimate leaves out. With a half the bake of four tiles of `alps` took 3 in 100 longer, and its roads were as long.
const EXPECTED: f64 = 0.8;

/// Nodes from one value of that to the next: half a kilometre, as far as a bend of a way over a plain is long. Chosen by eye.
const WANDER_NODES: i64 = 6;

/// Metres that a crossing costs, and that each metre of a river's width costs more: a ford, a bridge. Chosen by eye: a way
/// goes round some hundred metres rather than over a bridge.
const FORD_M: [f64; 2] = [60.0, 10.0];
const BRIDGE_M: [f64; 2] = [200.0, 12.0];

/// The square of the cotangent of the flattest angle at which a river may be crossed: 30 degrees.
const FLATTEST: f64 = 3.0;

/// Share of the maximum grade that a way may have between nodes; the rest is for the corners that are cut later. Chosen by
/// eye.
const GRADE_SHARE: f64 = 0.9;

/// How many times steeper a part of a move may be, a dent or a bump that is filled or cut. Chosen by eye.
const BUMP: f64 = 2.0;

/// Metres that the land may rise through a hairpin beyond what its curve can climb, and what each of them costs: half is
/// filled under its lower arm, half is cut behind its upper one. Chosen by eye.
const HAIRPIN_M: f64 = 12.0;
const EARTHWORK: f64 = 10.0;

/// Metres of cost beyond that of the best way to a node with which another direction there is still worth a look: more than
/// any turn of a way costs that is made over the shortest move, 80 m on the default cells.
const SLACK_M: f64 = 150.0;

/// The ellipse: its longer axis is so many times the distance of the sites, and some nodes for short ones. Chosen by eye: the
/// land that a tile looks at grows with the square of it.
// So a way by any one place in it is at most 1.4 times as long as straight, and those nodes.
const AXIS: f64 = 1.4;
const AXIS_NODES: f64 = 6.0;

/// Metres from a river's edge to a node, and vertices, since the narrowest river is drawn a vertex wide. The metres are chosen
/// by eye: half of a highway, and a verge.
const SHORE_M: f64 = 6.0;
const SHORE_VERTICES: f64 = 1.0;

/// Metres from a river's edge to a node.
pub(super) fn shore_m(scale: &Scale) -> f64 {
    SHORE_M.max(SHORE_VERTICES * scale.spacing_m)
}

/// Parts of a metre in which costs are counted.
// Whole numbers add up to the same in any order, and a u32 has room for 268,000 km of such parts.
const UNIT: f64 = 16.0;

// It also stands for what has not been reached: no cost that is counted comes near it.
const FORBIDDEN: u32 = u32::MAX;

/// The ellipse in which ways between two nodes lie.
#[derive(Clone, Copy, Debug)]
pub(super) struct Domain {
    a: [f64; 2],
    b: [f64; 2],
    axis: f64,
}

impl Domain {
    /// The ellipse around two places, in nodes.
    pub fn new(a: PlanNode, b: PlanNode) -> Domain {
        let [a, b] = [a, b].map(|at| at.map(|at| at as f64));
        Domain { a, b, axis: Domain::axis(distance(a, b)) }
    }

    /// Nodes from one of two places so many nodes apart to any in their ellipse, and on to the other, at most.
    pub fn axis(apart: f64) -> f64 {
        AXIS * apart + AXIS_NODES
    }

    /// Nodes from the middle to the furthest point of the ellipse around two places so many nodes apart.
    pub fn radius(apart: f64) -> f64 {
        Domain::axis(apart) / 2.0
    }

    fn holds(&self, at: PlanNode) -> bool {
        let at = at.map(|at| at as f64);
        distance(at, self.a) + distance(at, self.b) <= self.axis
    }
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    length([a[0] - b[0], a[1] - b[1]])
}

/// A way as nodes. `bridges[k]` tells whether the leg from node k to the next goes over a lake or the sea.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Route {
    pub nodes: Vec<PlanNode>,
    pub bridges: Vec<bool>,
}

/// What all searches in a window ask of its nodes, row by row.
pub(super) struct PlanNodes {
    wet: Vec<bool>,
    gradient: Vec<[f64; 2]>,
    wander: Vec<f64>,
    /// Whether there is a lake or the sea anywhere.
    open_water: bool,
}

impl PlanNodes {
    pub fn new(window: &Window, rivers: &RiverIndex, scale: &Scale, seed: u64) -> PlanNodes {
        let nodes = || (0..window.rows as i64).flat_map(|row| (0..window.cols as i64).map(move |col| [col, row]));
        let mut near = Vec::new();
        PlanNodes {
            wet: nodes().map(|node| is_wet(window, rivers, scale, node, &mut near)).collect(),
            gradient: nodes().map(|[col, row]| window.gradient(col, row, scale.step_m())).collect(),
            // By nodes of the world: roads of other windows find the same places bad.
            wander: nodes().map(|node| wander(seed, [node[0] + window.at[0], node[1] + window.at[1]])).collect(),
            open_water: window.waters.iter().any(|water| water.is_open()),
        }
    }
}

/// What a search knows.
pub(super) struct Search<'a> {
    pub window: &'a Window,
    pub nodes: &'a PlanNodes,
    pub rivers: &'a RiverIndex,
    pub scale: &'a Scale,
    pub standard: Standard,
    /// Moves that have turned out not to be possible, by their ends.
    pub closed: &'a BTreeSet<(PlanNode, PlanNode)>,
}

/// Moves from one node: what each costs, and bridges over more than a move.
struct Costs {
    moves: [u32; MOVES],
    /// Move, how many times, cost.
    spans: Vec<(u8, u8, u32)>,
}

/// How sharp a turn may be, and what it costs: by the move before and the move after.
type Turns = Vec<[u32; MOVES]>;

impl Search<'_> {
    /// The way from one node to another, if there is one. Of ways that cost the same it is always the same one.
    pub fn route(&self, from: PlanNode, to: PlanNode) -> Option<Route> {
        let domain = Domain::new(from, to);
        let turns = self.turns();
        let nodes = self.window.cols * self.window.rows;
        let index = |node: PlanNode| self.index(node);
        let mut costs: Vec<Option<Box<Costs>>> = (0..nodes).map(|_| None).collect();
        // A state is a node and the move that has led there.
        let mut best = vec![FORBIDDEN; nodes * MOVES];
        let mut before = vec![u32::MAX; nodes * MOVES];
        // The least cost at which any of a node's states has been reached.
        let mut least = vec![FORBIDDEN; nodes];
        let mut heap = BinaryHeap::new();
        let start = index(from);
        least[start] = 0;
        // Ordered by estimate, cost and state: ties are broken by number, never by when they were pushed.
        heap.push(Reverse((self.to_go(from, to), 0, u32::MAX)));
        let slack = (SLACK_M * UNIT) as u32;
        while let Some(Reverse((_, cost, state))) = heap.pop() {
            let (at, came) = match state {
                u32::MAX => (start, None),
                _ => (state as usize / MOVES, Some(state as usize % MOVES)),
            };
            // A better one has come since this was pushed: entries are left to grow stale rather than looked for.
            if came.is_some() && best[state as usize] < cost || cost > least[at].saturating_add(slack) {
                continue;
            }
            let node = [(at % self.window.cols) as i64, (at / self.window.cols) as i64];
            if node == to {
                return Some(self.trace(&before, state, from));
            }
            // Up to 32 states leave a node and find its moves at the same cost, and many nodes are never come to.
            if costs[at].is_none() {
                costs[at] = Some(Box::new(self.costs(&domain, node, &costs)));
            }
            let leave = costs[at].as_ref().expect("it has just been made");
            let singles = leave.moves.iter().enumerate().map(|(number, cost)| (number, 1, *cost));
            let spans = leave.spans.iter().map(|&(number, times, cost)| (number as usize, times as i64, cost));
            for (number, times, step) in singles.chain(spans) {
                let turn = came.map_or(0, |came| turns[came][number]);
                if step == FORBIDDEN || turn == FORBIDDEN {
                    continue;
                }
                // A bridge over many moves arrives as one does: `before` knows where it began, so the state need not.
                let next = added(node, number, times);
                let (there, mut cost) = (index(next), cost + step + turn);
                let state = there * MOVES + number;
                // A dearer direction is kept while it may pay at the next turn; without a bound all 32 would be.
                let pays = |cost: u32| cost < best[state] && cost <= least[there].saturating_add(slack);
                if pays(cost) {
                    // Last, since it takes the longest and few turns are so sharp.
                    let Some(earthwork) = came.map_or(Some(0), |came| self.hairpin(at, came, number)) else { continue };
                    cost += earthwork;
                    if !pays(cost) {
                        continue;
                    }
                    best[state] = cost;
                    least[there] = least[there].min(cost);
                    before[state] = came.map_or(u32::MAX, |came| (at * MOVES + came) as u32);
                    heap.push(Reverse((cost + self.to_go(next, to), cost, state as u32)));
                }
            }
        }
        None
    }

    /// The way that has led to a state.
    fn trace(&self, before: &[u32], last: u32, from: PlanNode) -> Route {
        let (mut way, mut state) = (Route { nodes: Vec::new(), bridges: Vec::new() }, last);
        while state != u32::MAX {
            let at = state as usize / MOVES;
            way.nodes.push([(at % self.window.cols) as i64, (at / self.window.cols) as i64]);
            state = before[state as usize];
        }
        // The start was left by no move, so it has no state of its own.
        way.nodes.push(from);
        way.nodes.reverse();
        way.bridges = way.nodes.windows(2).map(|leg| self.is_over_open_water(leg[0], leg[1])).collect();
        way
    }

    /// What is left to pay, about: the cost of the best even climb over open land.
    fn to_go(&self, node: PlanNode, to: PlanNode) -> u32 {
        let length_m = distance(node.map(|at| at as f64), to.map(|at| at as f64)) * self.scale.step_m();
        let rise_m = (self.window.height_m(to[0], to[1]) - self.window.height_m(node[0], node[1])).abs();
        // The length at which a longer way would cost more than it saves.
        let even_m = rise_m * STEEP.sqrt() / self.standard.max_grade;
        let cost_m = match even_m > length_m {
            // The sum below, at the length where it is least.
            true => 2.0 * even_m,
            false if length_m > 0.0 => length_m + even_m * even_m / length_m,
            false => 0.0,
        };
        // What a way is bad to walk on by and by is known about, so few ways are looked at that are longer in the end.
        (cost_m * (1.0 + WANDER * EXPECTED) * UNIT) as u32
    }

    /// What turns cost.
    fn turns(&self) -> Turns {
        let vector = |number: usize| move_by(number).map(|part| part as f64 * self.scale.step_m());
        let cost = |came: usize, goes: usize| {
            let (a, b) = (vector(came), vector(goes));
            let (length_a, length_b) = (distance(a, [0.0; 2]), distance(b, [0.0; 2]));
            let cos = (a[0] * b[0] + a[1] * b[1]) / (length_a * length_b);
            // Half of the shorter leg is there to bend in; nothing turns back on itself.
            let legs_m = length_a.min(length_b);
            if came == goes {
                return 0;
            }
            if bend_m(cos, self.standard.radius_m) > legs_m / 2.0 {
                return FORBIDDEN;
            }
            (CURVATURE_M2 * 2.0 * (1.0 - cos) / legs_m * UNIT) as u32
        };
        (0..MOVES).map(|came| std::array::from_fn(|goes| cost(came, goes))).collect()
    }

    /// What the earthworks of a turn at a node cost, from one move to another: those of a hairpin, if it can be built at all,
    /// and none where it turns by less than a right angle.
    fn hairpin(&self, at: usize, came: usize, goes: usize) -> Option<u32> {
        let (a, b) = (move_by(came), move_by(goes));
        if a[0] * b[0] + a[1] * b[1] >= 0 {
            return Some(0);
        }
        let [a, b] = [a, b].map(|by| {
            let by = by.map(|part| part as f64);
            by.map(|part| part / length(by))
        });
        let cos = a[0] * b[0] + a[1] * b[1];
        let bend_m = bend_m(cos, self.standard.radius_m);
        let [east, south] = self.nodes.gradient[at];
        // From where the curve begins to where it ends, and along it.
        let rise_m = (bend_m * (east * (a[0] + b[0]) + south * (a[1] + b[1]))).abs();
        let climb_m = self.standard.max_grade * self.standard.radius_m * libm::acos(cos);
        let off_m = (rise_m - climb_m).max(0.0);
        (off_m <= HAIRPIN_M).then_some((EARTHWORK * off_m * UNIT) as u32)
    }

    /// The costs of all moves from a node.
    /// Those of other nodes are known in part; the way back costs the same.
    fn costs(&self, domain: &Domain, node: PlanNode, known: &[Option<Box<Costs>>]) -> Costs {
        let mut near = Vec::new();
        let is_open = self.is_open(domain, node);
        let moves: [u32; MOVES] = std::array::from_fn(|number| {
            let next = added(node, number, 1);
            if !self.is_open(domain, next) {
                return FORBIDDEN;
            }
            // A node that no move may end on, as a start may be, has no way back that could be read.
            // Otherwise the move back is the one half of all moves on, since the quarters follow each other.
            match &known[self.index(next)] {
                Some(there) if is_open => there.moves[(number + MOVES / 2) % MOVES],
                _ => self.cost(node, next, &mut near),
            }
        });
        let mut spans = Vec::new();
        for number in (0..MOVES).filter(|number| move_by(*number).iter().all(|part| part.abs() <= 2)) {
            // More than one move at a time pays where the first would end in water.
            let next = added(node, number, 1);
            if moves[number] != FORBIDDEN || !self.window.holds(next[0], next[1]) || !self.nodes.wet[self.index(next)] {
                continue;
            }
            let one_m = distance(move_by(number).map(|part| part as f64), [0.0; 2]) * self.scale.step_m();
            // Some more, since nodes stand back from the water; `cost` refuses what is too long after all.
            let most = ((self.standard.bridge_m / one_m) as i64 + 2).min(u8::MAX as i64);
            // The first landing or none: what goes on from there is another move.
            let landing = (2..=most).find(|times| self.is_open(domain, added(node, number, *times)));
            if let Some(times) = landing {
                let cost = self.cost(node, added(node, number, times), &mut near);
                spans.push((number as u8, times as u8, cost));
            }
        }
        Costs { moves, spans }
    }

    fn index(&self, node: PlanNode) -> usize {
        node[1] as usize * self.window.cols + node[0] as usize
    }

    /// Whether a move may end on a node.
    fn is_open(&self, domain: &Domain, node: PlanNode) -> bool {
        self.window.holds(node[0], node[1]) && domain.holds(node) && !self.nodes.wet[self.index(node)]
    }

    /// What the straight move from one node to another costs.
    fn cost(&self, from: PlanNode, to: PlanNode, near: &mut Vec<u32>) -> u32 {
        // The same there and back, to the bit: so roads that leave a site for two others share a way while they can.
        let (from, to) = if from < to { (from, to) } else { (to, from) };
        if self.closed.contains(&(from, to)) || self.closed.contains(&(to, from)) {
            return FORBIDDEN;
        }
        // What is cheap to refuse comes first: the grade takes two heights, the rivers a search.
        let step_m = self.scale.step_m();
        let length_m = distance(from.map(|at| at as f64), to.map(|at| at as f64)) * step_m;
        let rise_m = self.window.height_m(to[0], to[1]) - self.window.height_m(from[0], from[1]);
        let most = self.standard.max_grade * GRADE_SHARE;
        if rise_m.abs() > most * length_m {
            return FORBIDDEN;
        }
        let Some(crossing_m) = self.crossing_m(from, to, near) else { return FORBIDDEN };
        let mut cost_m = length_m + crossing_m;
        let open = self.is_over_open_water(from, to);
        let squared = |grade: f64| STEEP * grade * grade / (self.standard.max_grade * self.standard.max_grade);
        if open {
            // The nodes at its ends may stand a step back from the shores, so the bridge itself is shorter.
            if length_m > self.standard.bridge_m + 2.0 * step_m {
                return FORBIDDEN;
            }
            cost_m += BRIDGE_M[0] + BRIDGE_M[1] * length_m + length_m * squared(rise_m / length_m);
        } else {
            // Part by part, since a wall or a gorge between level ends would go unseen else.
            let parts = (to[0] - from[0]).abs().max((to[1] - from[1]).abs());
            let part_m = length_m / parts as f64;
            let mut last_m = self.window.height_m(from[0], from[1]);
            for part in 1..=parts {
                let height_m = self.height_between(from, to, part, parts);
                let grade = (height_m - last_m) / part_m;
                if grade.abs() > BUMP * most {
                    return FORBIDDEN;
                }
                cost_m += part_m * squared(grade);
                last_m = height_m;
            }
            let [dx, dy] = [0, 1].map(|axis| (to[axis] - from[axis]) as f64 * step_m / length_m);
            for end in [from, to] {
                let [east, south] = self.nodes.gradient[self.index(end)];
                // The slope across the way only; that along it has been paid for by its parts.
                let side = east * dy - south * dx;
                cost_m += length_m * SIDE / 2.0 * side * side;
            }
        }
        cost_m += length_m * WANDER * (self.nodes.wander[self.index(from)] + self.nodes.wander[self.index(to)]) / 2.0;
        (cost_m * UNIT) as u32
    }

    /// The height at `part / parts` of the way from one node to another, where one of the two coordinates is whole.
    fn height_between(&self, from: PlanNode, to: PlanNode, part: i64, parts: i64) -> f64 {
        let along = |axis: usize| {
            // Rounded down, not to zero, since a move may go up the rows; then the share is never negative.
            let far = (to[axis] - from[axis]) * part;
            (from[axis] + far.div_euclid(parts), far.rem_euclid(parts) as f64 / parts as f64)
        };
        let ((col, east), (row, south)) = (along(0), along(1));
        // A place on a node has no next one: at the window's edge that would be outside.
        let (next_col, next_row) = (col + i64::from(east > 0.0), row + i64::from(south > 0.0));
        let (here, there) = (self.window.height_m(col, row), self.window.height_m(next_col, next_row));
        here + (there - here) * east.max(south)
    }

    /// Whether a lake or the sea lies between two nodes.
    fn is_over_open_water(&self, from: PlanNode, to: PlanNode) -> bool {
        if !self.nodes.open_water {
            return false;
        }
        let parts = (to[0] - from[0]).abs().max((to[1] - from[1]).abs());
        (1..parts).any(|part| {
            let along = |axis: usize| {
                let far = (to[axis] - from[axis]) * part;
                let low = from[axis] + far.div_euclid(parts);
                (low, low + i64::from(far.rem_euclid(parts) > 0))
            };
            let ((col, next_col), (row, next_row)) = (along(0), along(1));
            self.window.water(col, row).is_open() || self.window.water(next_col, next_row).is_open()
        })
    }

    /// Metres that the rivers under a move cost; `None` if it goes along one or cannot cross.
    fn crossing_m(&self, from: PlanNode, to: PlanNode, near: &mut Vec<u32>) -> Option<f64> {
        let (a, b) = (self.fixed(from), self.fixed(to));
        self.rivers.near(a, b, near);
        let (mut cost_m, mut crosses, mut grazes) = (0.0, false, false);
        for piece in near.iter().map(|piece| &self.rivers.pieces[*piece as usize]) {
            let within = self.square_fixed(piece.width_m / 2.0 + shore_m(self.scale));
            if piece.is_crossed(a, b) {
                let along = [a, b, piece.from, piece.to].map(|at| at.map(|at| at as f64));
                let (u, v) = (
                    [along[1][0] - along[0][0], along[1][1] - along[0][1]],
                    [along[3][0] - along[2][0], along[3][1] - along[2][1]],
                );
                // Lines that cross are not parallel, so this does not divide by 0.
                let cot = (u[0] * v[0] + u[1] * v[1]) / (u[0] * v[1] - u[1] * v[0]);
                if cot * cot > FLATTEST {
                    return None;
                }
                let [base_m, more] = if piece.width_m <= self.standard.ford_m { FORD_M } else { BRIDGE_M };
                if piece.width_m > self.standard.bridge_m {
                    return None;
                }
                // By the square of how much longer it is than straight across: 1 / sin^2.
                cost_m += (base_m + more * piece.width_m) * (1.0 + cot * cot);
                crosses = true;
            } else if [piece.from, piece.to].iter().any(|end| distance2(*end, a, b) < within) {
                grazes = true;
            }
        }
        // Beside a piece that is crossed the next ones are near, too. What comes near and crosses none goes along it.
        (crosses || !grazes).then_some(cost_m)
    }

    /// A node in 1/256 vertex from the window's first.
    fn fixed(&self, node: PlanNode) -> [i64; 2] {
        fixed(self.scale, node)
    }

    /// The square of so many metres in (1/256 vertex)^2.
    fn square_fixed(&self, metres: f64) -> f64 {
        square_fixed(self.scale, metres)
    }
}

/// A node in 1/256 vertex from the window's first.
fn fixed(scale: &Scale, node: PlanNode) -> [i64; 2] {
    node.map(|at| at * scale.step * FIXED)
}

/// The square of so many metres in (1/256 vertex)^2.
fn square_fixed(scale: &Scale, metres: f64) -> f64 {
    let fixed = metres / scale.spacing_m * FIXED as f64;
    fixed * fixed
}

/// Whether a road cannot stand on a node.
fn is_wet(window: &Window, rivers: &RiverIndex, scale: &Scale, node: PlanNode, near: &mut Vec<u32>) -> bool {
    if window.water(node[0], node[1]) != WaterKind::Dry {
        return true;
    }
    // Rivers run between nodes, and narrow ones wet none: so their lines are asked about as well.
    let at = fixed(scale, node);
    rivers.near(at, at, near);
    near.iter().any(|piece| {
        let piece = &rivers.pieces[*piece as usize];
        piece.distance2(at) < square_fixed(scale, piece.width_m / 2.0 + shore_m(scale))
    })
}

/// How bad a node of the world is to walk on, 0 to 1: smooth noise on the lattice of nodes.
fn wander(seed: u64, at: PlanNode) -> f64 {
    let cell = at.map(|at| at.div_euclid(WANDER_NODES));
    let [east, south] = at.map(|at| at.rem_euclid(WANDER_NODES) as f64 / WANDER_NODES as f64);
    let value = |dx: i64, dy: i64| {
        let hash = hash::lattice(hash::stream(seed, Stream::RouteWander), cell[0] + dx, cell[1] + dy);
        // 24 bits are many enough for a cost, and the quotient is exact.
        (hash >> 40) as f64 / (1u64 << 24) as f64
    };
    let north = value(0, 0) + (value(1, 0) - value(0, 0)) * east;
    let below = value(0, 1) + (value(1, 1) - value(0, 1)) * east;
    north + (below - north) * south
}

/// Metres to each side of a corner that an arc of `radius_m` takes. `cos` is the cosine of the angle by which the line turns.
pub(super) fn bend_m(cos: f64, radius_m: f64) -> f64 {
    // The tangent of half of the angle; for a line that turns right back very large, but a number.
    radius_m * ((1.0 - cos).max(0.0) / (1.0 + cos).max(1e-9)).sqrt()
}

/// The vector of a move.
fn move_by(number: usize) -> [i64; 2] {
    let [x, y] = QUARTER[number % QUARTER.len()];
    match number / QUARTER.len() {
        0 => [x, y],
        1 => [-y, x],
        2 => [-x, -y],
        _ => [y, -x],
    }
}

fn added(node: PlanNode, number: usize, times: i64) -> PlanNode {
    let [dx, dy] = move_by(number);
    [node[0] + dx * times, node[1] + dy * times]
}
