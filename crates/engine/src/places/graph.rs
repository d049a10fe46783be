//! Which sites are joined by a road: the Gabriel graph, with a cap that makes it local.
//!
//! Two sites are neighbours if no third one lies inside the circle whose diameter is the line between them and if they
//! are no further apart than [`CELLS`] site cells. Whether they are depends on the sites in that circle alone.
//!
//! Based on: K. R. Gabriel, R. R. Sokal, "A new statistical approach to geographic variation analysis", 1969.

use crate::area::Area;
use crate::places::site::Seat;

/// The longest edge in site cells. If each cell had a site, no empty circle would be wider than 2.83 of them, and few are
/// wider than 2; the land that a tile looks at for its roads grows with the square of this.
pub(super) const CELLS: i64 = 2;

/// Whether two sites are near enough for an edge; `side` is that of a site cell in vertices.
pub(super) fn within_cap(a: &Seat, b: &Seat, side: i64) -> bool {
    let most = (CELLS * side) as i128;
    apart2(a.at, b.at) <= most * most
}

/// Whether a third site keeps two others from being neighbours.
pub(super) fn separates(third: &Seat, a: &Seat, b: &Seat) -> bool {
    third.id != a.id && third.id != b.id && is_inside(third.at, [a.at, b.at])
}

/// Whether a third site keeps another one from being the neighbour of any on the vertices of `area`.
pub(super) fn separates_all(third: &Seat, a: &Seat, area: Area) -> bool {
    let corners = [[area.x0, area.y0], [area.x1 - 1, area.y0], [area.x0, area.y1 - 1], [area.x1 - 1, area.y1 - 1]];
    // The difference of the squares is linear in the other end, so it is largest at a corner.
    third.id != a.id && corners.iter().all(|b| is_inside(third.at, [a.at, *b]))
}

/// Whether a vertex lies inside the circle whose diameter is the line between two others: by Thales, where the angle that it
/// sees them at is obtuse.
fn is_inside(at: [i64; 2], [a, b]: [[i64; 2]; 2]) -> bool {
    apart2(at, a) + apart2(at, b) < apart2(a, b)
}

fn apart2(a: [i64; 2], b: [i64; 2]) -> i128 {
    length2([a[0] - b[0], a[1] - b[1]])
}

/// The square of the length of a way in vertices: exact at any length.
pub(super) fn length2(way: [i64; 2]) -> i128 {
    let [x, y] = way.map(i128::from);
    x * x + y * y
}
