//! The land that routes between two nodes see: what all classes of roads, and all tries, ask of a window.

use crate::geometry::bilinear;
use crate::hash::{self, Stream};
use crate::land::WaterKind;
use crate::places::corridor::Corridor;
use crate::places::plan_land::{PlanNode, Scale, Window};
use crate::places::river_index::{PlanPiece, RiverIndex};
use crate::places::spans::{REST_M, drawn_m};

/// Nodes from one value to the next of how bad the ground is to walk on: half a kilometre, as far as a bend of a way over a
/// plain is long. Chosen by eye.
const WANDER_NODES: i64 = 6;

/// Metres from the edge of a river, as it is drawn, to a node and to a way along it. Chosen by eye: a verge.
const SHORE_M: f64 = 2.0;
const _: () = assert!(SHORE_M >= REST_M, "what lies beside a bridge is found");

/// A window, and what routes ask of its nodes.
pub(super) struct RouteLand {
    pub scale: Scale,
    pub window: Window,
    pub rivers: RiverIndex,
    /// By node, row by row, as all below: whether it is so near to water that no road can stand there.
    wet: Vec<bool>,
    /// Whether it belongs to the corridor; of others nothing is known.
    held: Vec<bool>,
    /// Metres up a metre east and south.
    gradient: Vec<[f64; 2]>,
    /// How bad it is to walk on, 0 to 1.
    wander: Vec<f64>,
    /// Whether there is a lake or the sea on any node.
    has_open_water: bool,
}

impl RouteLand {
    /// The land of a window in which a corridor lies.
    pub fn new(window: Window, corridor: &Corridor, scale: &Scale, seed: u64) -> RouteLand {
        // From the edge of the narrowest, which is drawn wider than others by most.
        let rivers = RiverIndex::new(&window, scale, drawn_m(0.0, scale.spacing_m) / 2.0 + SHORE_M + 1.0);
        let in_world = |[x, y]: PlanNode| [x + window.at[0], y + window.at[1]];
        let held: Vec<bool> = window.nodes().map(|node| corridor.holds(in_world(node))).collect();
        let mut near = Vec::new();
        RouteLand {
            scale: *scale,
            wet: of_held(&window, &held, true, |node| is_wet(&window, &rivers, scale, node, &mut near)),
            gradient: of_held(&window, &held, [0.0; 2], |node| window.gradient(node, scale.step_m())),
            // By nodes of the world: roads of other windows find the same places bad.
            wander: of_held(&window, &held, 0.0, |node| wander(seed, in_world(node))),
            held,
            has_open_water: window.has_open_water(),
            window,
            rivers,
        }
    }

    /// Whether a node lies in the window and belongs to the corridor.
    pub fn holds(&self, node: PlanNode) -> bool {
        self.window.holds(node) && self.held[self.window.index(node)]
    }

    /// Whether a node of the window is so near to water that no road can stand there.
    pub fn is_wet(&self, node: PlanNode) -> bool {
        self.wet[self.window.index(node)]
    }

    /// Whether there is a lake or the sea on any node.
    pub fn has_open_water(&self) -> bool {
        self.has_open_water
    }

    /// The steepness at a node, metres up a metre east and south.
    pub fn gradient(&self, node: PlanNode) -> [f64; 2] {
        self.gradient[self.window.index(node)]
    }

    /// How bad a node is to walk on for no reason that the heights show, 0 to 1.
    pub fn wander(&self, node: PlanNode) -> f64 {
        self.wander[self.window.index(node)]
    }

    /// The height at `part / parts` of the way from one node to another, where one of the two coordinates is whole.
    pub fn height_between(&self, from: PlanNode, to: PlanNode, part: i64, parts: i64) -> f64 {
        let ([low, high], [east, south]) = around(from, to, part, parts);
        let (here, there) = (self.window.height_m(low), self.window.height_m(high));
        here + (there - here) * east.max(south)
    }

    /// Whether a lake or the sea lies between two nodes.
    pub fn is_over_open_water(&self, from: PlanNode, to: PlanNode) -> bool {
        let parts = parts(from, to);
        let is_open = |part: i64| around(from, to, part, parts).0.iter().any(|node| self.window.water(*node).is_open());
        self.has_open_water && (1..parts).any(is_open)
    }
}

/// A value for each node of a window that is held, and the same for all others, row by row.
fn of_held<T: Copy>(window: &Window, held: &[bool], other: T, mut of: impl FnMut(PlanNode) -> T) -> Vec<T> {
    window.nodes().zip(held).map(|(node, held)| if *held { of(node) } else { other }).collect()
}

/// The parts of the way from one node to another, as many as it goes along a row or a column, whichever are more.
pub(super) fn parts(from: PlanNode, to: PlanNode) -> i64 {
    (to[0] - from[0]).abs().max((to[1] - from[1]).abs())
}

/// The nodes on both sides of a place `part / parts` of the way from one node to another, and how far from the first it lies
/// between them, east and south.
fn around(from: PlanNode, to: PlanNode, part: i64, parts: i64) -> ([PlanNode; 2], [f64; 2]) {
    // Rounded down, not to zero, since a move may go up the rows; then the share is never negative.
    let far = [0, 1].map(|axis| (to[axis] - from[axis]) * part);
    let low = [0, 1].map(|axis| from[axis] + far[axis].div_euclid(parts));
    let rest = far.map(|far| far.rem_euclid(parts));
    // A place on a node has no next one: at the window's edge that would be outside.
    let high = [0, 1].map(|axis| low[axis] + i64::from(rest[axis] > 0));
    ([low, high], rest.map(|rest| rest as f64 / parts as f64))
}

/// The square of the distance of a node from the middle of a river, at least, in (1/256 vertex)^2.
// What lies nearer is in the river once it is drawn, and a line that goes there is not built.
pub(super) fn shore2(piece: &PlanPiece, scale: &Scale) -> f64 {
    let distance = scale.fixed_length(drawn_m(piece.width_m, scale.spacing_m) / 2.0 + SHORE_M);
    distance * distance
}

/// Whether a node is so near to water that no road can stand there.
fn is_wet(window: &Window, rivers: &RiverIndex, scale: &Scale, node: PlanNode, near: &mut Vec<u32>) -> bool {
    // Rivers run between nodes, and narrow ones wet none: so their lines are asked about as well.
    let at = scale.fixed(node);
    let is_beside = |piece: &PlanPiece| piece.middle.distance2(at) < shore2(piece, scale);
    window.water(node) != WaterKind::Dry || rivers.around(at, near).any(is_beside)
}

/// How bad a node of the world is to walk on, 0 to 1: smooth noise on the lattice of nodes.
pub(super) fn wander(seed: u64, at: PlanNode) -> f64 {
    let cell = at.map(|at| at.div_euclid(WANDER_NODES));
    let value = |dx: i64, dy: i64| {
        let hash = hash::lattice(hash::stream(seed, Stream::RouteWander), cell[0] + dx, cell[1] + dy);
        // 24 bits are many enough for a cost, and the quotient is exact.
        (hash >> 40) as f64 / (1u64 << 24) as f64
    };
    let share = at.map(|at| at.rem_euclid(WANDER_NODES) as f64 / WANDER_NODES as f64);
    bilinear([value(0, 0), value(1, 0), value(0, 1), value(1, 1)], share)
}
