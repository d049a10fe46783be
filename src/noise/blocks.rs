//! Blocks of vertices: what noise is computed in.

use crate::area::Area;
use crate::simd::MAX_LANES;
use std::ops::Range;

/// Blocks are aligned with the world, which gives a vertex the same bits in every area: these two numbers are part of
/// what the noise is. A block's sums stay in the first-level cache.
pub(super) const BLOCK_COLUMNS: usize = 64;
pub(super) const BLOCK_ROWS: usize = 32;
const _: () = assert!(BLOCK_COLUMNS.is_multiple_of(MAX_LANES) && BLOCK_ROWS.is_multiple_of(MAX_LANES));

/// The vertices of a block that are wanted.
pub(super) struct Part {
    /// The block's first vertex.
    pub x: i64,
    pub y: i64,
    /// Counted from there.
    pub columns: Range<usize>,
    pub rows: Range<usize>,
}

/// The blocks that an area touches, row by row; none for an empty one.
pub(super) fn blocks(area: Area) -> impl Iterator<Item = Part> {
    let Area { x0, y0, x1, y1 } = area;
    let (columns, rows) = (BLOCK_COLUMNS as i64, BLOCK_ROWS as i64);
    // The first vertices of blocks along an axis, from that of the block which holds `start`.
    let first = |start: i64, end: i64, side: i64| (start.div_euclid(side) * side..end).step_by(side as usize);
    let corners = first(y0, y1, rows).flat_map(move |y| first(x0, x1, columns).map(move |x| (x, y)));
    // A block may begin before an empty area and reach past it.
    let corners = corners.take_while(move |_| !area.is_empty());
    corners.map(move |(x, y)| Part {
        x,
        y,
        columns: (x0.max(x) - x) as usize..(x1.min(x + columns) - x) as usize,
        rows: (y0.max(y) - y) as usize..(y1.min(y + rows) - y) as usize,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_parts_of_an_area_are_its_vertices() {
        for area in
            [Area::new(-70, 30, 200, 3), Area::new(64, -32, 64, 32), Area::new(5, 5, 0, 9), Area::new(5, 5, 9, 0)]
        {
            let parts = || blocks(area);
            assert_eq!(parts().map(|part| part.columns.len() * part.rows.len()).sum::<usize>(), area.len(), "{area:?}");
            assert!(parts().all(|part| part.columns.end <= BLOCK_COLUMNS && part.rows.end <= BLOCK_ROWS), "{area:?}");
        }
        assert_eq!(blocks(Area::new(5, 5, 0, 9)).count(), 0);
    }
}
