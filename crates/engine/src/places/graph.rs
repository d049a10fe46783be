//! The Gabriel graph of the sites, which tells which sites a road joins, with a cap on its edges that makes it local.
//!
//! Two sites are neighbours if no third one lies inside the circle whose diameter is the line between them and if they
//! are no further apart than [`CELLS`] site cells. Whether they are neighbours thus depends only on the sites in that
//! circle.
//!
//! Based on: K. R. Gabriel, R. R. Sokal, "A new statistical approach to geographic variation analysis", 1969.

use crate::area::Area;
use crate::places::site::Seat;

/// Longest edge in site cells. If each cell had a site, no empty circle would be wider than 2.83 cells, and few circles
/// are wider than 2. The land that a tile looks at for its roads grows with the square of this length.
pub(super) const CELLS: i64 = 2;

/// True if two sites are near enough for an edge. `side` is the side of a site cell in vertices.
pub(super) fn within_cap(a: &Seat, b: &Seat, side: i64) -> bool {
    let most = (CELLS * side) as i128;
    apart2(a.at, b.at) <= most * most
}

/// True if a third site lies in the circle of two others, so that they are no neighbours.
pub(super) fn separates(third: &Seat, a: &Seat, b: &Seat) -> bool {
    third.id != a.id && third.id != b.id && is_inside(third.at, [a.at, b.at])
}

/// True if a third site separates `a` from sites on any vertex of `area`.
pub(super) fn separates_all(third: &Seat, a: &Seat, area: Area) -> bool {
    let corners = [[area.x0, area.y0], [area.x1 - 1, area.y0], [area.x0, area.y1 - 1], [area.x1 - 1, area.y1 - 1]];
    // The test is linear in the place of `b`, so it holds on the whole rectangle if it holds at its corners.
    third.id != a.id && corners.iter().all(|b| is_inside(third.at, [a.at, *b]))
}

/// True if a vertex lies inside the circle whose diameter is the line between two others. By Thales' theorem, the lines
/// from such a vertex to the two others form an obtuse angle.
fn is_inside(at: [i64; 2], [a, b]: [[i64; 2]; 2]) -> bool {
    apart2(at, a) + apart2(at, b) < apart2(a, b)
}

fn apart2(a: [i64; 2], b: [i64; 2]) -> i128 {
    length2([a[0] - b[0], a[1] - b[1]])
}

/// Returns the square of the length of a vector in vertices, exact at any length.
pub(super) fn length2(way: [i64; 2]) -> i128 {
    let [x, y] = way.map(i128::from);
    x * x + y * y
}
