//! The land as the search for a route sees it: all that the classes of roads, and all tries, need to know of a window.
//!
//! To judge the numbers chosen by eye, look at roads over `plains` and along rivers.

use crate::geometry::bilinear;
use crate::hash::{self, Stream};
use crate::land::WaterKind;
use crate::places::corridor::Corridor;
use crate::places::plan_land::{PlanNode, PlanScale, Window};
use crate::places::river_index::{PlanPiece, RiverIndex};
use crate::places::spans::{REST_M, drawn_m};

/// Distance in nodes between the values of the noise of rough ground: half a kilometre, about as long as a bend of a
/// route over a plain. Chosen by eye.
const WANDER_NODES: i64 = 6;

/// Distance in metres that nodes and routes along a river keep from its drawn edge. Chosen by eye: a verge.
const SHORE_M: f64 = 2.0;
const _: () = assert!(SHORE_M >= REST_M, "what lies beside a bridge is found");

/// A window, and what the search for a route needs to know of its nodes.
pub(super) struct RouteLand {
    pub scale: PlanScale,
    pub window: Window,
    pub rivers: RiverIndex,
    /// For each node, row by row as in all vectors below, true if it is so near to water that no road can stand there.
    wet: Vec<bool>,
    /// True if the node belongs to the corridor. Nothing is known of other nodes.
    held: Vec<bool>,
    /// Gradient, metres up a metre east and south.
    gradient: Vec<[f64; 2]>,
    /// Roughness of the ground, 0 to 1, see [`wander`].
    wander: Vec<f64>,
    /// True if any node lies in a lake or the sea.
    has_open_water: bool,
}

impl RouteLand {
    /// Prepares the land of a window that contains a corridor.
    pub fn new(window: Window, corridor: &Corridor, scale: &PlanScale, seed: u64) -> RouteLand {
        // The margin suits the narrowest river: it is drawn wider than it is by more than any other.
        let rivers = RiverIndex::new(&window, scale, drawn_m(0.0, scale.spacing_m) / 2.0 + SHORE_M + 1.0);
        let in_world = |[x, y]: PlanNode| [x + window.at[0], y + window.at[1]];
        let held: Vec<bool> = window.nodes().map(|node| corridor.holds(in_world(node))).collect();
        let mut near = Vec::new();
        RouteLand {
            scale: *scale,
            wet: of_held(&window, &held, true, |node| is_wet(&window, &rivers, scale, node, &mut near)),
            gradient: of_held(&window, &held, [0.0; 2], |node| window.gradient(node, scale.step_m())),
            // By nodes of the world, so that roads of other windows find the same ground rough.
            wander: of_held(&window, &held, 0.0, |node| wander(seed, in_world(node))),
            held,
            has_open_water: window.has_open_water(),
            window,
            rivers,
        }
    }

    /// True if a node lies in the window and belongs to the corridor.
    pub fn holds(&self, node: PlanNode) -> bool {
        self.window.holds(node) && self.held[self.window.index(node)]
    }

    /// True if a node of the window is so near to water that no road can stand there.
    pub fn is_wet(&self, node: PlanNode) -> bool {
        self.wet[self.window.index(node)]
    }

    /// True if any node lies in a lake or the sea.
    pub fn has_open_water(&self) -> bool {
        self.has_open_water
    }

    /// Returns the gradient at a node, metres up a metre east and south.
    pub fn gradient(&self, node: PlanNode) -> [f64; 2] {
        self.gradient[self.window.index(node)]
    }

    /// Returns the roughness of the ground at a node, which does not show in the heights, 0 to 1.
    pub fn wander(&self, node: PlanNode) -> f64 {
        self.wander[self.window.index(node)]
    }

    /// Returns the height at `part / parts` of the way from one node to another, where one of the two coordinates is a
    /// whole number.
    pub fn height_between(&self, from: PlanNode, to: PlanNode, part: i64, parts: i64) -> f64 {
        let ([low, high], [east, south]) = around(from, to, part, parts);
        let (here, there) = (self.window.height_m(low), self.window.height_m(high));
        here + (there - here) * east.max(south)
    }

    /// True if a lake or the sea lies between two nodes.
    pub fn is_over_open_water(&self, from: PlanNode, to: PlanNode) -> bool {
        let parts = parts(from, to);
        let is_open = |part: i64| around(from, to, part, parts).0.iter().any(|node| self.window.water(*node).is_open());
        self.has_open_water && (1..parts).any(is_open)
    }
}

/// Computes a value for each node of a window that is held, and gives all others the value `other`, row by row.
fn of_held<T: Copy>(window: &Window, held: &[bool], other: T, mut of: impl FnMut(PlanNode) -> T) -> Vec<T> {
    window.nodes().zip(held).map(|(node, held)| if *held { of(node) } else { other }).collect()
}

/// Returns the number of parts of the way from one node to another: the nodes that it goes along a row or a column,
/// whichever are more.
pub(super) fn parts(from: PlanNode, to: PlanNode) -> i64 {
    (to[0] - from[0]).abs().max((to[1] - from[1]).abs())
}

/// Returns the two nodes on both sides of the place at `part / parts` of the way from one node to another, and the
/// share of the distance between them at which the place lies, east and south.
fn around(from: PlanNode, to: PlanNode, part: i64, parts: i64) -> ([PlanNode; 2], [f64; 2]) {
    // Rounded down, not towards zero, since a move may go up the rows; so the share is never negative.
    let far = [0, 1].map(|axis| (to[axis] - from[axis]) * part);
    let low = [0, 1].map(|axis| from[axis] + far[axis].div_euclid(parts));
    let rest = far.map(|far| far.rem_euclid(parts));
    // A place exactly on a node has no second node, which could lie outside the window.
    let high = [0, 1].map(|axis| low[axis] + i64::from(rest[axis] > 0));
    ([low, high], rest.map(|rest| rest as f64 / parts as f64))
}

/// Returns the square of the least distance of a node from the middle of a river, in (1/256 vertex)^2.
// Anything nearer lies in the river as it is drawn, and no road is built there.
pub(super) fn shore2(piece: &PlanPiece, scale: &PlanScale) -> f64 {
    let distance = scale.fixed_length(drawn_m(piece.width_m, scale.spacing_m) / 2.0 + SHORE_M);
    distance * distance
}

/// True if a node is so near to water that no road can stand there.
fn is_wet(window: &Window, rivers: &RiverIndex, scale: &PlanScale, node: PlanNode, near: &mut Vec<u32>) -> bool {
    // Rivers run between nodes, and narrow ones wet none, so their middle lines are checked as well.
    let at = scale.fixed(node);
    let is_beside = |piece: &PlanPiece| piece.middle.distance2(at) < shore2(piece, scale);
    window.water(node) != WaterKind::Dry || rivers.around(at, near).any(is_beside)
}

/// Returns the roughness of the ground at a node of the world, 0 to 1: smooth noise on the lattice of nodes, which does
/// not depend on the heights.
pub(super) fn wander(seed: u64, at: PlanNode) -> f64 {
    let cell = at.map(|at| at.div_euclid(WANDER_NODES));
    let value = |dx: i64, dy: i64| {
        let hash = hash::lattice(hash::stream(seed, Stream::RouteWander), cell[0] + dx, cell[1] + dy);
        // 24 bits are enough for a cost, and the quotient is exact.
        (hash >> 40) as f64 / (1u64 << 24) as f64
    };
    let share = at.map(|at| at.rem_euclid(WANDER_NODES) as f64 / WANDER_NODES as f64);
    bilinear([value(0, 0), value(1, 0), value(0, 1), value(1, 1)], share)
}
