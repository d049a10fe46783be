//! Noise row by row, for short waves: values that the vertices of a row share are computed once.
//!
//! A row of vertices runs between two rows of lattice points, at a constant distance from each. From each of these two
//! rows only the bumps of two points reach a vertex: of the next point to the west and the next to the east. The reason
//! is that a bump reaches sqrt(1/2) lattice units to each side, less than the distance `EDGE` between the points. So
//! four bumps are added for each vertex, without determining in which triangle the vertex lies. The gradients of all
//! points of a row that a block needs are computed once, so no hash is computed per vertex.

#[cfg(feature = "gpu")]
use super::gpu_words::SideWords;
use super::lattice::{
    DIRECTIONS, EDGE, FRACTION_BITS, LANE_FRACTION, LANE_FRACTION_BITS, Lattice, NORMALISATION, cell, fraction, hash,
    lane_fraction,
};
use crate::simd::{MAX_LANES, Simd};
#[cfg(feature = "gpu")]
use crate::wgsl::push;

/// Number of gradients that a [`PointRow`] has room for. A block needs fewer than `COLUMNS + 3` points of a row, and
/// up to one vector of gradients is read beyond these; [`RowWise::new`] checks that there is room.
const POINTS: usize = 96;

/// Largest number of vectors in a row of a block. Vectors have at least four lanes, and blocks at most 64 columns.
const MOST_VECTORS: usize = 16;

/// Constants for evaluating an octave row by row, for blocks `COLUMNS` wide.
#[derive(Clone, Debug)]
pub(super) struct RowWise<const COLUMNS: usize> {
    /// Change of u for each column.
    pub columns: [u32; COLUMNS],
    /// Eastern and southern components of the gradients in the units of `du` and `dv`: multiplied by the distance
    /// between the points of a row and between rows, and by the factor of the octave.
    pub gradients: [[f32; 16]; 2],
}

/// The gradients of consecutive points in a row of points.
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
    /// Distance from the northern row to the vertices, as a share of the distance between the two rows, 0 to 1.
    below: f64,
    /// Position of the first vertex along each of the two rows of points, in distances between points, in fixed point.
    /// The positions differ by half a distance, because the southern row is shifted west by this much.
    along: [u128; 2],
}

impl Between {
    #[inline(always)]
    fn new([u, v]: [u128; 2]) -> Between {
        const HALF: u128 = 1 << (FRACTION_BITS - 1);
        let from_north = u.wrapping_sub((v & ((1 << FRACTION_BITS) - 1)) >> 1);
        Between { v: cell(v), below: fraction(v), along: [from_north, from_north.wrapping_add(HALF)] }
    }

    /// Returns the number of the row of points on a side: 0 is north, 1 is south.
    #[inline(always)]
    fn row(&self, side: usize) -> u32 {
        self.v.wrapping_add(side as u32)
    }

    /// Returns the distance south from a row of points to the vertices, as a share of the distance between the two
    /// rows. For the southern row it is negative.
    #[inline(always)]
    fn dv(&self, side: usize) -> f32 {
        (self.below - side as f64) as f32
    }

    /// Returns `3/4 (1 - dv^2)`: the part of the bumps' formula that is the same for all vertices of the row.
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
    /// For each vector of vertices, the index in `points` of the last point that is not east of the vector's first
    /// vertex.
    first: [u32; MOST_VECTORS],
    /// For each vector of vertices, the position of the block's first vertex relative to the point in `first`, in a
    /// lane's fixed point. It wraps if it is negative.
    start: [u32; MOST_VECTORS],
    /// Distance south from the points to the vertices, as in [`Between::dv`].
    dv: f32,
    /// The part of the bumps' formula that is the same for all vertices of the row, as in [`Between::base`].
    base: f32,
}

/// A row of vertices between its two rows of points.
#[derive(Clone, Copy)]
pub(super) struct VertexRow<'a> {
    north: RowSide<'a>,
    south: RowSide<'a>,
}

/// Appends to `words` the data from which a GPU computes the noise of one row of vertices: the number of the northern
/// row of points, then [`SideWords`] for the northern and the southern row. `position` is that of the row's first
/// vertex in the block.
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
    /// Highest frequency of an octave in lattice units per vertex. Up to this frequency, all points that a vector of
    /// `n` vertices needs are among the `max(8, n)` points from which [`Simd::pick`] can pick. The first vertex lies up
    /// to one point east of the first of these points, and the last vertex `(n - 1) sqrt(3/2) frequency` points east of
    /// the first vertex. The point to the east of the last vertex is one point more. For `n` = 8 the sum is 7.92
    /// points.
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
            // Each vector counts points from the last one that is not east of its first vertex. So all the counts are
            // small, and `Simd::pick`, which looks at a few gradients only, can serve the vector.
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

    /// Computes the gradients of a row of points, unless `points` has them, and returns the row's index in `points`.
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
        // The shift drops the fraction of the last vertex's distance from the first. Add one point because the two
        // vertices' fractions may sum to 1 or more, one for the point east of the last vertex, and one because points
        // are counted from 0. Add a vector because gradients are read in whole vectors.
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

    /// Returns the sum of the bumps of one row of points at `LANES` vertices, from `column` on. A bump is the slope
    /// times `(3/4 (1 - dv^2) - du^2)^4`, which is `(3/2 (1/2 - d.d))^4` with `d` the vector from the point to the
    /// vertex.
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

/// Returns in each lane the bump of one point at one vertex. `point` is the point's number after `first`, and `du` the
/// vertex's distance east of the point.
#[inline(always)]
fn bump<S: Simd>(simd: S, side: &RowSide<'_>, first: usize, point: S::U32, du: S::F32) -> S::F32 {
    let t = simd.max(simd.splat(side.base) - du * du, simd.splat(0.0));
    let t2 = t * t;
    let slope = simd.pick(&side.points.gradient_x[first..], point) * du
        + simd.pick(&side.points.gradient_y[first..], point) * simd.splat(side.dv);
    t2 * t2 * slope
}
