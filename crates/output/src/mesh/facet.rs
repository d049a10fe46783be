//! A triangle over the raster: the vertices in it, row by row.

use super::PARTS;

/// A triangle of a ground: the places of its corners in [parts](PARTS) of a cell east and south, counter-clockwise as
/// in [`Ground`](super::Ground).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Facet(pub [[i32; 2]; 3]);

/// A run of vertices in a row of the raster that lie in a triangle or on its edge.
///
/// A vertex has a share for each corner of the triangle: its barycentric coordinates, as whole numbers. Their sum is
/// the same all over the triangle, and at most 2^40 as long as a tile has no more than [`MAX_CELLS`](super::MAX_CELLS)
/// cells a side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RowSpan {
    /// Row of all vertices of the span.
    pub row: usize,
    /// Column of the first vertex.
    pub column: usize,
    /// Number of vertices; at least one.
    pub count: usize,
    /// The shares of the first vertex.
    pub shares: [i64; 3],
    /// Difference of the shares between a vertex and the next one to the east.
    pub growth: [i64; 3],
}

impl Facet {
    /// Sum of the three shares of any vertex: twice the triangle's area.
    pub fn whole(self) -> i64 {
        let [a, b, c] = self.0;
        share([a, b], c)
    }

    /// Finds the vertices in the triangle and on its edge, from north to south. Vertices on an edge belong to the
    /// triangles of both sides.
    ///
    /// This looks at half as many vertices as testing each one of the bounding box.
    pub fn spans(self) -> impl Iterator<Item = RowSpan> {
        let [a, b, c] = self.0;
        // Columns and rows of the raster, whose vertices are whole cells apart.
        let range = |axis: usize| {
            let (low, high) = (a[axis].min(b[axis]).min(c[axis]), a[axis].max(b[axis]).max(c[axis]));
            ((low + PARTS - 1).div_euclid(PARTS), high.div_euclid(PARTS))
        };
        let ((west, east), (north, south)) = (range(0), range(1));
        // A corner's share is zero on the edge opposite to it.
        let edges = [[b, c], [c, a], [a, b]];
        let cell = i64::from(PARTS);
        let growth = edges.map(|[from, to]| cell * i64::from(to[1] - from[1]));
        let growth_down = edges.map(|[from, to]| cell * i64::from(from[0] - to[0]));
        let mut shares = edges.map(|edge| share(edge, [west * PARTS, north * PARTS]));
        (north..=south).filter_map(move |row| {
            // The first and the last column, counted from the west, between which no share is negative.
            let (mut first, mut last) = (0, i64::from(east - west));
            for (share, growth) in shares.into_iter().zip(growth) {
                if growth > 0 && share < 0 {
                    first = first.max((growth - 1 - share) / growth);
                } else if growth < 0 {
                    // Rounded down, so that a negative share leaves no column.
                    last = last.min(share.div_euclid(-growth));
                } else if growth == 0 && share < 0 {
                    last = -1;
                }
            }
            let at_first = [0, 1, 2].map(|corner| shares[corner] + growth[corner] * first);
            shares = [0, 1, 2].map(|corner| shares[corner] + growth_down[corner]);
            let count = usize::try_from(last - first + 1).ok().filter(|count| *count > 0)?;
            let column = (i64::from(west) + first) as usize;
            Some(RowSpan { row: row as usize, column, count, shares: at_first, growth })
        })
    }
}

/// Returns twice the area of the triangle of an edge and a place, positive if it faces up.
fn share([[x0, y0], [x1, y1]]: [[i32; 2]; 2], [x, y]: [i32; 2]) -> i64 {
    let across = |a: i32, b: i32| i64::from(a) * i64::from(b);
    across(y1 - y0, x - x0) - across(x1 - x0, y - y0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Finds the vertices in a triangle by definition: tests each vertex of the raster.
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

    /// Returns each vertex of a span with its shares.
    fn vertices(span: RowSpan) -> impl Iterator<Item = ([i32; 2], [i64; 3])> {
        (0..span.count as i32).map(move |offset| {
            let shares = [0, 1, 2].map(|corner| span.shares[corner] + span.growth[corner] * i64::from(offset));
            ([span.column as i32 + offset, span.row as i32], shares)
        })
    }

    /// Cells per side of the raster.
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
            // Thin triangles along the lines of the lattice.
            assert_found([[at(0), 2 * PARTS], [at(2), 2 * PARTS + 1], [at(4), 2 * PARTS]]);
        }
    }
}
