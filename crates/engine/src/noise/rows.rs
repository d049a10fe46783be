//! Noise row by row, for short waves: values that the vertices of a row share are computed once.
//!
//! A row of vertices runs between two rows of lattice points, at a constant distance from each. A vertex is reached by
//! at most two points of such a row, the next to the west and the next to the east: a bump is sqrt(2) wide, and the
//! points are `EDGE` apart, which is more than half of that. So four bumps are added, without determining in which
//! triangle the vertex lies. Their gradients are picked from a short stretch of the row of points, so no hash is
//! computed per vertex.

#[cfg(feature = "gpu")]
use super::gpu_words::SideWords;
use super::lattice::{
    DIRECTIONS, EDGE, FRACTION_BITS, LANE_FRACTION, LANE_FRACTION_BITS, Lattice, NORMALISATION, cell, fraction, hash,
    lane_fraction,
};
use crate::simd::{MAX_LANES, Simd};
#[cfg(feature = "gpu")]
use crate::wgsl::push;

/// Number of points of a row that a block can need: as many as it has columns, and a vector more, since tables are read
/// in whole vectors.
const POINTS: usize = 96;

/// Largest number of vectors in a row of a block: with four lanes, the fewest.
const MOST_VECTORS: usize = 16;

/// Constants for evaluating an octave row by row, for blocks `COLUMNS` wide.
#[derive(Clone, Debug)]
pub(super) struct RowWise<const COLUMNS: usize> {
    /// Change of u for each column.
    pub columns: [u32; COLUMNS],
    /// Components of the gradients east and south, scaled to fit fractions of u and v.
    pub gradients: [[f32; 16]; 2],
}

/// The gradients of a stretch of a row of points.
#[derive(Clone, Copy)]
struct PointRow {
    v: u32,
    first_u: u32,
    gradient_x: [f32; POINTS],
    gradient_y: [f32; POINTS],
}

/// The two rows of points around a row of vertices: the even row first, then the odd one.
pub(super) struct PointRows {
    rows: [PointRow; 2],
    filled: [bool; 2],
}

impl PointRows {
    #[inline(always)]
    pub fn new() -> PointRows {
        PointRows {
            rows: [PointRow { v: 0, first_u: 0, gradient_x: [0.0; POINTS], gradient_y: [0.0; POINTS] }; 2],
            filled: [false; 2],
        }
    }
}

/// The position of a row of vertices between its two rows of points: the northern one, number 0, and the southern one,
/// number 1.
#[derive(Clone, Copy)]
struct Between {
    /// The number of the northern row.
    v: u32,
    /// Distance from the northern row to the vertices, in row distances.
    below: f64,
    /// Position of the first vertex along each row, in points: each row is shifted by half a point against the one
    /// before.
    along: [u128; 2],
}

impl Between {
    #[inline(always)]
    fn new([u, v]: [u128; 2]) -> Between {
        const HALF: u128 = 1 << (FRACTION_BITS - 1);
        let from_north = u.wrapping_sub((v & ((1 << FRACTION_BITS) - 1)) >> 1);
        Between { v: cell(v), below: fraction(v), along: [from_north, from_north.wrapping_add(HALF)] }
    }

    /// Returns the number of a row of points.
    #[inline(always)]
    fn row(&self, side: usize) -> u32 {
        self.v.wrapping_add(side as u32)
    }

    /// Returns the distance from a row of points to the vertices, in row distances.
    #[inline(always)]
    fn dv(&self, side: usize) -> f32 {
        (self.below - side as f64) as f32
    }

    /// Returns `3/4 (1 - dv^2)`, the height of the bumps' base.
    #[inline(always)]
    fn base(&self, side: usize) -> f32 {
        let dv = self.below - side as f64;
        (0.75 * (1.0 - dv * dv)) as f32
    }
}

/// One of the two rows of points, seen from a row of vertices.
#[derive(Clone, Copy)]
struct RowSide<'a> {
    points: &'a PointRow,
    /// For each vector of vertices, the number of the last point west of its first vertex, and the position of the
    /// block's first vertex relative to that point, in a lane's fixed point.
    first: [u32; MOST_VECTORS],
    start: [u32; MOST_VECTORS],
    /// Distance from the points to the vertices, in row distances.
    dv: f32,
    /// `3/4 (1 - dv^2)`: the height of the bumps' base.
    base: f32,
}

/// A row of vertices between its two rows of points.
#[derive(Clone, Copy)]
pub(super) struct VertexRow<'a> {
    north: RowSide<'a>,
    south: RowSide<'a>,
}

/// Appends the words of the row of vertices whose first vertex in the block is at `position`: the number of the
/// northern row of points, and the two rows of points beside the row.
#[cfg(feature = "gpu")]
pub(super) fn pack_row(position: [u128; 2], words: &mut Vec<u32>) {
    let between = Between::new(position);
    words.push(between.v);
    for side in 0..2 {
        let (along, dv, base) = (between.along[side], between.dv(side), between.base(side));
        push(words, SideWords { u: cell(along), along: lane_fraction(along), dv, base });
    }
}

impl<const COLUMNS: usize> RowWise<COLUMNS> {
    /// The highest frequency at which a vector of points, of eight points at least, serves a vector of vertices. The
    /// last of `n` vertices is `(n - 1) sqrt(3/2) frequency` points after the first vertex, which is up to one point
    /// after the first point; and one more point is needed to its east. For `n` = 8 that is 7.92 points.
    pub const MAX_FREQUENCY: f64 = 0.69;

    /// Makes the constants of an octave; its noise is multiplied by `scale`.
    pub fn new(lattice: &Lattice, scale: f64) -> RowWise<COLUMNS> {
        const { assert!(COLUMNS + 3 + MAX_LANES <= POINTS && COLUMNS <= 4 * MOST_VECTORS) };
        // The bumps are computed with a factor of (3/2)^4, see `bumps`.
        let scale = scale * NORMALISATION / (1.5 * 1.5 * 1.5 * 1.5);
        RowWise {
            columns: lattice.columns(),
            gradients: [
                DIRECTIONS.map(|[gx, _]| (gx * EDGE * scale) as f32),
                DIRECTIONS.map(|[_, gy]| (gy * std::f64::consts::FRAC_1_SQRT_2 * scale) as f32),
            ],
        }
    }

    /// Prepares the row of vertices whose first vertex in the block is at `position`.
    #[inline(always)]
    pub fn row<'a, S: Simd>(&self, simd: S, position: [u128; 2], points: &'a mut PointRows) -> VertexRow<'a> {
        let between = Between::new(position);
        let north = self.point_row(simd, between.row(0), cell(between.along[0]), points);
        let south = self.point_row(simd, between.row(1), cell(between.along[1]), points);
        let side = |side: usize, place: usize| {
            // Each vector counts points from one of its own, so that its numbers are small enough to pick from a short
            // slice.
            let (mut firsts, mut starts) = ([0; MOST_VECTORS], [0; MOST_VECTORS]);
            let start = lane_fraction(between.along[side]);
            for ((first, from), columns) in firsts.iter_mut().zip(&mut starts).zip(self.columns.chunks_exact(S::LANES))
            {
                *first = start.wrapping_add(columns[0]) >> LANE_FRACTION_BITS;
                *from = start.wrapping_sub(*first << LANE_FRACTION_BITS);
            }
            RowSide {
                points: &points.rows[place],
                first: firsts,
                start: starts,
                dv: between.dv(side),
                base: between.base(side),
            }
        };
        VertexRow { north: side(0, north), south: side(1, south) }
    }

    /// Computes the gradients of a row of points, unless they are there already, and returns the row's place.
    #[inline(always)]
    fn point_row<S: Simd>(&self, simd: S, v: u32, first_u: u32, points: &mut PointRows) -> usize {
        // Of two neighbouring rows one is even and one is odd, so neither overwrites the other while both are needed.
        let place = (v & 1) as usize;
        let row = &mut points.rows[place];
        if points.filled[place] && row.v == v && row.first_u == first_u {
            return place;
        }
        points.filled[place] = true;
        (row.v, row.first_u) = (v, first_u);
        let (table_x, table_y) = (simd.table16(&self.gradients[0]), simd.table16(&self.gradients[1]));
        let of_v = simd.splat_u32(hash::of_v(v));
        let mut of_u = hash::of_u_lanes(simd, first_u, simd.lane_numbers());
        let step = simd.splat_u32(hash::of_u(S::LANES as u32));
        // One point more for the fraction with which the row starts, one for the point to the east, one since the first
        // is number 0; and a vector is read beyond the last.
        let needed = (self.columns[COLUMNS - 1] >> LANE_FRACTION_BITS) as usize + 3 + S::LANES;
        let vectors = row.gradient_x.chunks_exact_mut(S::LANES).zip(row.gradient_y.chunks_exact_mut(S::LANES));
        for (x, y) in vectors.take(needed.div_ceil(S::LANES)) {
            let gradient = hash::gradient_lanes(simd, of_u, of_v);
            simd.store(simd.permute16(table_x, gradient), x);
            simd.store(simd.permute16(table_y, gradient), y);
            of_u = of_u + step;
        }
        place
    }

    /// Returns the noise at `LANES` vertices of a row, from `column` on.
    #[inline(always)]
    pub fn noise<S: Simd>(&self, simd: S, row: &VertexRow<'_>, column: usize) -> S::F32 {
        self.bumps(simd, &row.north, column) + self.bumps(simd, &row.south, column)
    }

    /// Returns the bumps of one row of points: `(3/4 (1 - dv^2) - du^2)^4`, which is `3/2 (1/2 - d.d)` to the fourth
    /// power, times the slope.
    #[inline(always)]
    fn bumps<S: Simd>(&self, simd: S, side: &RowSide<'_>, column: usize) -> S::F32 {
        let columns = &self.columns[column..column + S::LANES];
        let first = side.first[column / S::LANES] as usize;
        let start = side.start[column / S::LANES];
        let along = simd.load_u32(columns) + simd.splat_u32(start);
        let point = simd.shr::<LANE_FRACTION_BITS>(along);
        // The fraction becomes the mantissa of a float from 1 to 2.
        let from_one = simd.from_bits(along & simd.splat_u32(LANE_FRACTION) | simd.splat_u32(1.0_f32.to_bits()));
        let west = bump(simd, side, first, point, from_one - simd.splat(1.0));
        let east = bump(simd, side, first, point + simd.splat_u32(1), from_one - simd.splat(2.0));
        west + east
    }
}

/// Returns the bumps of points in a row, given by their numbers, at vertices `du` away along the row.
#[inline(always)]
fn bump<S: Simd>(simd: S, side: &RowSide<'_>, first: usize, point: S::U32, du: S::F32) -> S::F32 {
    let t = simd.max(simd.splat(side.base) - du * du, simd.splat(0.0));
    let t2 = t * t;
    let slope = simd.pick(&side.points.gradient_x[first..], point) * du
        + simd.pick(&side.points.gradient_y[first..], point) * simd.splat(side.dv);
    t2 * t2 * slope
}
