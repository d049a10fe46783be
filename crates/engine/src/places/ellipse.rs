//! The ellipse around two nodes of the coarse plan that bounds all routes between them.
//!
//! To judge the numbers chosen by eye, look at roads of `alps` that go far round a mountain.

use crate::geometry::length;
use crate::places::plan_land::PlanNode;

/// Major axis of the ellipse as a multiple of the distance between the two nodes, and nodes that are added to it for
/// short distances. Chosen by eye: the land that a tile looks at grows with the square of the axis.
// A way straight to any node of the ellipse and on to the end is at most 1.4 times as long as the straight line, plus
// `AXIS_NODES`.
const AXIS: f64 = 1.4;
const AXIS_NODES: f64 = 3.0;

/// The ellipse that bounds the routes between two nodes, its foci.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ellipse {
    foci: [PlanNode; 2],
    axis: f64,
}

impl Ellipse {
    /// Creates the ellipse around two nodes.
    pub fn new(foci: [PlanNode; 2]) -> Ellipse {
        Ellipse { foci, axis: Ellipse::axis(apart(foci[0], foci[1])) }
    }

    /// Returns the major axis, in nodes, of the ellipse around two foci so many nodes apart: the longest way from one
    /// focus to the other by a node of the ellipse.
    pub fn axis(apart: f64) -> f64 {
        AXIS * apart + AXIS_NODES
    }

    /// Returns the largest radius, in nodes, of the ellipse around two foci so many nodes apart.
    pub fn radius(apart: f64) -> f64 {
        Ellipse::axis(apart) / 2.0
    }

    /// True if a node lies in the ellipse.
    pub fn holds(&self, node: PlanNode) -> bool {
        apart(node, self.foci[0]) + apart(node, self.foci[1]) <= self.axis
    }
}

/// Returns the straight distance between two nodes, in nodes.
pub(super) fn apart(a: PlanNode, b: PlanNode) -> f64 {
    length([0, 1].map(|axis| (b[axis] - a[axis]) as f64))
}
