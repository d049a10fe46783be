//! The ellipse around two nodes of the coarse plan, in which all ways between them lie.

use crate::geometry::length;
use crate::places::plan_land::PlanNode;

/// The ellipse: its longer axis is so many times the distance of the nodes, and some nodes for short ones. Chosen by eye: the
/// land that a tile looks at grows with the square of it.
// So a way by any one place in it is at most 1.4 times as long as straight, and those nodes.
const AXIS: f64 = 1.4;
const AXIS_NODES: f64 = 3.0;

/// The ellipse in which ways between two nodes lie.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ellipse {
    foci: [PlanNode; 2],
    axis: f64,
}

impl Ellipse {
    /// The ellipse around two nodes.
    pub fn new(foci: [PlanNode; 2]) -> Ellipse {
        Ellipse { foci, axis: Ellipse::axis(apart(foci[0], foci[1])) }
    }

    /// Nodes from one of two places so many nodes apart to any in their ellipse, and on to the other, at most.
    pub fn axis(apart: f64) -> f64 {
        AXIS * apart + AXIS_NODES
    }

    /// Nodes from the middle to the furthest point of the ellipse around two places so many nodes apart.
    pub fn radius(apart: f64) -> f64 {
        Ellipse::axis(apart) / 2.0
    }

    /// Whether a node lies in it.
    pub fn holds(&self, node: PlanNode) -> bool {
        apart(node, self.foci[0]) + apart(node, self.foci[1]) <= self.axis
    }
}

/// Nodes from one node to another, as the crow flies.
pub(super) fn apart(a: PlanNode, b: PlanNode) -> f64 {
    length([0, 1].map(|axis| (b[axis] - a[axis]) as f64))
}
