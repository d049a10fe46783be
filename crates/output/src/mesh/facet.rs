//! A triangle as it lies over the raster: row by row, the vertices in it.

use super::PARTS;

/// A triangle of a ground by its corners: [parts](PARTS) of a cell east and south of each, counter-clockwise as in
/// [`Ground`](super::Ground).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Facet(pub [[i32; 2]; 3]);

/// The vertices of a row of the raster that lie in a triangle or on its edge: one or more from `column` on.
///
/// The shares of a vertex are each corner's: whole numbers whose sum is the same all over the triangle, 2^40 at most as long as a
/// tile has no more than [`MAX_CELLS`](super::MAX_CELLS) a side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Span {
    /// The row of all of them.
    pub row: usize,
    /// The column of the first vertex.
    pub column: usize,
    /// How many vertices there are.
    pub count: usize,
    /// The shares of the first vertex.
    pub shares: [i64; 3],
    /// What the shares grow by from a vertex to the next.
    pub growth: [i64; 3],
}

impl Facet {
    /// The shares that all vertices in it have together: twice its area.
    pub fn whole(self) -> i64 {
        let [a, b, c] = self.0;
        share([a, b], c)
    }

    /// What lies in it and on its edge, from north to south. Edges belong to the triangles of both sides.
    ///
    /// To try each vertex of the rectangle around it would be to look at twice as many.
    pub fn spans(self) -> impl Iterator<Item = Span> {
        let [a, b, c] = self.0;
        // Of the raster, whose vertices are whole cells apart.
        let range = |axis: usize| {
            let (low, high) = (a[axis].min(b[axis]).min(c[axis]), a[axis].max(b[axis]).max(c[axis]));
            ((low + PARTS - 1).div_euclid(PARTS), high.div_euclid(PARTS))
        };
        let ((west, east), (north, south)) = (range(0), range(1));
        // Each corner's share is nothing on the edge across from it.
        let edges = [[b, c], [c, a], [a, b]];
        let cell = i64::from(PARTS);
        let growth = edges.map(|[from, to]| cell * i64::from(to[1] - from[1]));
        let growth_down = edges.map(|[from, to]| cell * i64::from(from[0] - to[0]));
        let mut shares = edges.map(|edge| share(edge, [west * PARTS, north * PARTS]));
        (north..=south).filter_map(move |row| {
            // No share is negative from the first to the last of these, counted from the west.
            let (mut first, mut last) = (0, i64::from(east - west));
            for (share, growth) in shares.into_iter().zip(growth) {
                if growth > 0 && share < 0 {
                    first = first.max((growth - 1 - share) / growth);
                } else if growth < 0 {
                    // Rounded down, so that a negative share leaves nothing.
                    last = last.min(share.div_euclid(-growth));
                } else if growth == 0 && share < 0 {
                    last = -1;
                }
            }
            let at_first = [0, 1, 2].map(|corner| shares[corner] + growth[corner] * first);
            shares = [0, 1, 2].map(|corner| shares[corner] + growth_down[corner]);
            let count = usize::try_from(last - first + 1).ok().filter(|count| *count > 0)?;
            let column = (i64::from(west) + first) as usize;
            Some(Span { row: row as usize, column, count, shares: at_first, growth })
        })
    }
}

/// Twice the area of the triangle of an edge and a place, positive if it faces up.
fn share([[x0, y0], [x1, y1]]: [[i32; 2]; 2], [x, y]: [i32; 2]) -> i64 {
    let across = |a: i32, b: i32| i64::from(a) * i64::from(b);
    across(y1 - y0, x - x0) - across(x1 - x0, y - y0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What lies in a triangle, by its definition: each place of the rectangle around it is tried.
    fn tried(corners: [[i32; 2]; 3]) -> Vec<([i32; 2], [i64; 3])> {
        let [a, b, c] = corners;
        let places = (0..=SIDE).flat_map(|row| (0..=SIDE).map(move |column| [column, row]));
        let shares = |place: [i32; 2]| {
            let place = place.map(|at| at * PARTS);
            [share([b, c], place), share([c, a], place), share([a, b], place)]
        };
        places
            .map(|place| (place, shares(place)))
            .filter(|(_, shares)| shares.iter().all(|share| *share >= 0))
            .collect()
    }

    /// Each vertex of a span and its shares.
    fn vertices(span: Span) -> impl Iterator<Item = ([i32; 2], [i64; 3])> {
        (0..span.count as i32).map(move |offset| {
            let shares = [0, 1, 2].map(|corner| span.shares[corner] + span.growth[corner] * i64::from(offset));
            ([span.column as i32 + offset, span.row as i32], shares)
        })
    }

    /// Cells a side of the raster.
    const SIDE: i32 = 4;

    fn assert_found(corners: [[i32; 2]; 3]) {
        let facet = Facet(corners);
        if facet.whole() <= 0 {
            return;
        }
        let found: Vec<_> = facet.spans().flat_map(vertices).collect();
        assert_eq!(found, tried(facet.0), "{corners:?}");
        assert!(found.iter().all(|(_, shares)| shares.iter().sum::<i64>() == facet.whole()));
    }

    #[test]
    fn spans_are_the_vertices_in_all_small_triangles() {
        let places: Vec<[i32; 2]> = (0..=SIDE).flat_map(|y| (0..=SIDE).map(move |x| [x * PARTS, y * PARTS])).collect();
        for a in &places {
            for b in &places {
                for c in &places {
                    assert_found([*a, *b, *c]);
                }
            }
        }
    }

    #[test]
    fn corners_may_lie_between_the_vertices() {
        for seed in 0..4000 {
            let at = |index: u64| (crate::hash::combine(seed, index) % (SIDE * PARTS + 1) as u64) as i32;
            assert_found([[at(0), at(1)], [at(2), at(3)], [at(4), at(5)]]);
            // Thin ones along the lattice's lines.
            assert_found([[at(0), 2 * PARTS], [at(2), 2 * PARTS + 1], [at(4), 2 * PARTS]]);
        }
    }
}
