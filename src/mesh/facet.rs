//! A triangle as it lies over the raster: row by row, the vertices in it.

/// A triangle of a surface by its corners: column and row of each, counter-clockwise as in [`Surface`](super::Surface).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Facet(pub [[i32; 2]; 3]);

/// The vertices of a row that lie in a triangle or on its edge: one or more from `column` on.
///
/// The parts of a vertex are each corner's share of it: whole numbers whose sum is the same all over the triangle, 2^24 at
/// most as long as a tile has no more than [`MAX_CELLS`](super::MAX_CELLS) a side, and so exact in floats.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Span {
    /// The row of all of them.
    pub row: usize,
    /// The column of the first vertex.
    pub column: usize,
    /// How many vertices there are.
    pub count: usize,
    /// The parts of the first vertex.
    pub parts: [i32; 3],
    /// What the parts grow by from a vertex to the next.
    pub growth: [i32; 3],
}

impl Facet {
    /// The parts that all vertices in it have together: twice its area.
    pub fn whole(self) -> i32 {
        let [a, b, c] = self.0;
        part([a, b], c)
    }

    /// What lies in it and on its edge, from north to south. Edges belong to the triangles of both sides.
    ///
    /// To try each vertex of the rectangle around it would be to look at twice as many.
    pub fn spans(self) -> impl Iterator<Item = Span> {
        let [a, b, c] = self.0;
        let range = |axis: usize| (a[axis].min(b[axis]).min(c[axis]), a[axis].max(b[axis]).max(c[axis]));
        let ((west, east), (north, south)) = (range(0), range(1));
        // Each corner's part is nothing on the edge across from it.
        let edges = [[b, c], [c, a], [a, b]];
        let growth = edges.map(|[from, to]| to[1] - from[1]);
        let growth_down = edges.map(|[from, to]| from[0] - to[0]);
        let mut parts = edges.map(|edge| part(edge, [west, north]));
        (north..=south).filter_map(move |row| {
            // No part is negative from the first to the last of these, counted from the west.
            let (mut first, mut last) = (0, east - west);
            for (part, growth) in parts.into_iter().zip(growth) {
                if growth > 0 && part < 0 {
                    first = first.max((growth - 1 - part) / growth);
                } else if growth < 0 {
                    // Rounded down, so that a negative part leaves nothing.
                    last = last.min(part.div_euclid(-growth));
                }
            }
            let at_first = [0, 1, 2].map(|corner| parts[corner] + growth[corner] * first);
            parts = [0, 1, 2].map(|corner| parts[corner] + growth_down[corner]);
            let count = usize::try_from(last - first + 1).ok().filter(|count| *count > 0)?;
            Some(Span { row: row as usize, column: (west + first) as usize, count, parts: at_first, growth })
        })
    }
}

/// Twice the area of the triangle of an edge and a place, positive if it faces up.
fn part([[x0, y0], [x1, y1]]: [[i32; 2]; 2], [x, y]: [i32; 2]) -> i32 {
    (y1 - y0) * (x - x0) - (x1 - x0) * (y - y0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What lies in a triangle, by its definition: each place of the rectangle around it is tried.
    fn tried(corners: [[i32; 2]; 3]) -> Vec<([i32; 2], [i32; 3])> {
        let [a, b, c] = corners;
        let places = (0..=SIDE).flat_map(|row| (0..=SIDE).map(move |column| [column, row]));
        let parts = |place: [i32; 2]| [part([b, c], place), part([c, a], place), part([a, b], place)];
        places.map(|place| (place, parts(place))).filter(|(_, parts)| parts.iter().all(|part| *part >= 0)).collect()
    }

    /// Each vertex of a span and its parts.
    fn vertices(span: Span) -> impl Iterator<Item = ([i32; 2], [i32; 3])> {
        (0..span.count as i32).map(move |offset| {
            let parts = [0, 1, 2].map(|corner| span.parts[corner] + span.growth[corner] * offset);
            ([span.column as i32 + offset, span.row as i32], parts)
        })
    }

    /// Cells a side of the raster.
    const SIDE: i32 = 4;

    #[test]
    fn spans_are_the_vertices_in_all_small_triangles() {
        let places: Vec<[i32; 2]> = (0..=SIDE).flat_map(|y| (0..=SIDE).map(move |x| [x, y])).collect();
        for a in &places {
            for b in &places {
                for c in &places {
                    let facet = Facet([*a, *b, *c]);
                    if facet.whole() <= 0 {
                        continue;
                    }
                    let found: Vec<_> = facet.spans().flat_map(vertices).collect();
                    assert_eq!(found, tried(facet.0));
                    assert!(found.iter().all(|(_, parts)| parts.iter().sum::<i32>() == facet.whole()));
                }
            }
        }
    }
}
