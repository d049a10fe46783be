//! Moves: the steps that a route may take from a node of the plan, by number.
//!
//! A move follows a vector of whole numbers up to 3 without a common divisor. Numbers rise with the angle, clockwise
//! from east.

use crate::places::plan_land::PlanNode;

/// The moves of one quadrant, by angle. The other quadrants are these vectors, rotated.
const QUARTER: [[i64; 2]; 8] = [[1, 0], [3, 1], [2, 1], [3, 2], [1, 1], [2, 3], [1, 2], [1, 3]];

/// Number of moves from a node.
pub(super) const MOVES: usize = 4 * QUARTER.len();

/// Returns the vector of a move: nodes east and south.
pub(super) fn vector(number: usize) -> [i64; 2] {
    let [x, y] = QUARTER[number % QUARTER.len()];
    match number / QUARTER.len() {
        0 => [x, y],
        1 => [-y, x],
        2 => [-x, -y],
        _ => [y, -x],
    }
}

/// Returns the vectors of all moves that go at most `most` nodes along rows and along columns.
pub(super) fn up_to(most: i64) -> impl Iterator<Item = [i64; 2]> {
    (0..MOVES).map(vector).filter(move |vector| vector.iter().all(|part| part.abs() <= most))
}

/// Returns the number of the opposite move: half of all moves further on, since the quadrants follow each other.
pub(super) fn back(number: usize) -> usize {
    (number + MOVES / 2) % MOVES
}

/// Returns the node at which `times` equal moves end.
pub(super) fn moved(node: PlanNode, number: usize, times: i64) -> PlanNode {
    let [dx, dy] = vector(number);
    [node[0] + dx * times, node[1] + dy * times]
}
