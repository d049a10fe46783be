//! Noise bump by bump, for long waves: each lattice point around a strip of vertices adds its bump.
//!
//! A bump is `max(0, 1/2 - dx^2 - dy^2)^4 (gx dx + gy dy)`, with (dx, dy) the vector from the lattice point to the
//! vertex in lattice units. On a row dy is constant, and in a column dx: terms that depend on one of them alone are
//! computed once. Seven operations per vector remain, for each of the three or four bumps that overlap in a strip of
//! long waves.
//!
//! Points are added in the order of their rows and columns. Outside its radius a bump adds exactly zero. So a vertex
//! has the same bits whichever further bumps are added in its strip, which depends on the number of lanes.

use super::lattice::{DIRECTIONS, EDGE, Lattice, NORMALISATION, cell, fraction, hash};
use crate::simd::{MAX_LANES, Simd};
use std::f64::consts::{FRAC_1_SQRT_2, SQRT_2};
use std::ops::{Range, RangeInclusive};

/// Reach of a bump: its radius of sqrt(1/2) lattice units, and a margin larger than the rounding of positions.
const REACH: f64 = FRAC_1_SQRT_2 + 1e-4;

/// A distance out of reach of every bump, whose square is still finite.
pub(super) const FAR: f32 = 4.6e18;

/// Number of bumps that can reach a block: with the shortest waves, of 20 vertices, a block of 64 x 32 with the reach
/// around it is 4.57 x 2.97 lattice units, which holds at most five rows of six points.
const MAX_BUMPS: usize = 32;

/// Number of rows that are computed in one go. Fewer rows are reached by fewer bumps; more rows share the cost of
/// finding these bumps.
const STRIP_ROWS: usize = 16;

/// Number of bumps that can reach these rows of a strip: with the shortest waves, rows and reach are 2.17 lattice units
/// wide and high, which holds at most four rows of three points.
const MAX_REACHING: usize = 12;

/// Constants for splatting an octave, for blocks of `COLUMNS` x `ROWS`.
#[derive(Clone, Debug)]
pub(super) struct Splat<const COLUMNS: usize, const ROWS: usize> {
    /// Distance in lattice units from the block's first column to each column, and from its first row to each row.
    pub columns: [f32; COLUMNS],
    pub rows: [f32; ROWS],
    /// The gradients, scaled.
    pub gradients: [[f32; 2]; 16],
}

/// The bumps that reach a block.
pub(super) struct Bumps<const ROWS: usize> {
    /// Vector from the lattice point to the block's first vertex; far away in unused places.
    dx: [f32; MAX_BUMPS],
    dy: [f32; MAX_BUMPS],
    gradient_x: [f32; MAX_BUMPS],
    /// `1/2 - dy^2` and `gy dy` for every row of vertices.
    base: [[f32; ROWS]; MAX_BUMPS],
    slope: [[f32; ROWS]; MAX_BUMPS],
    count: usize,
}

/// The lattice points whose bumps reach a block. Rows and columns are counted from the cell of the block's first
/// vertex.
#[derive(Clone, Copy)]
pub(super) struct Points {
    cell: [u32; 2],
    fraction: [f64; 2],
    /// Largest distance of a point from the first vertex, east and south, in lattice units.
    reach: [f64; 2],
}

impl Points {
    /// Returns the rows of points whose bumps reach into the block; rows are 1 / sqrt(2) apart.
    #[inline(always)]
    pub fn rows(&self) -> RangeInclusive<i32> {
        let [_, fraction_v] = self.fraction;
        (fraction_v - REACH * SQRT_2).ceil() as i32..=(fraction_v + self.reach[1] * SQRT_2).floor() as i32
    }

    /// Returns the columns of a row.
    #[inline(always)]
    pub fn columns(&self, row: i32) -> RangeInclusive<i32> {
        let shift = self.shift(row);
        (shift - REACH / EDGE).ceil() as i32..=(shift + self.reach[0] / EDGE).floor() as i32
    }

    /// Returns the column, with a fraction, at which a row is as far east as the first vertex: each row begins half a
    /// point further west.
    #[inline(always)]
    pub fn shift(&self, row: i32) -> f64 {
        self.fraction[0] + self.v(row) / 2.0
    }

    /// Returns the distance from the first vertex to a row, in rows.
    #[inline(always)]
    pub fn v(&self, row: i32) -> f64 {
        f64::from(row) - self.fraction[1]
    }

    /// Returns the distance east from a point to the block's first vertex.
    #[inline(always)]
    pub fn dx(&self, column: i32, row: i32) -> f32 {
        let u = f64::from(column) - self.fraction[0];
        (EDGE * (self.v(row) / 2.0 - u)) as f32
    }

    /// Returns the distance south from the points of a row to the block's first vertex.
    #[inline(always)]
    pub fn dy(&self, row: i32) -> f32 {
        (-self.v(row) * FRAC_1_SQRT_2) as f32
    }

    /// Returns the number of a point's gradient.
    #[inline(always)]
    pub fn gradient(&self, column: i32, row: i32) -> usize {
        let [of_u, of_v] = [self.cell[0].wrapping_add(column as u32), self.cell[1].wrapping_add(row as u32)];
        hash::gradient(hash::of_u(of_u), hash::of_v(of_v))
    }
}

/// A consumer of the noise of a strip, vector by vector.
pub(super) trait NoiseSink<S: Simd> {
    /// Takes the noise of one vector, in a row of the block.
    fn take(&mut self, simd: S, row: usize, noise: S::F32);
}

impl<const ROWS: usize> Bumps<ROWS> {
    #[inline(always)]
    pub fn new() -> Bumps<ROWS> {
        Bumps {
            dx: [0.0; MAX_BUMPS],
            dy: [0.0; MAX_BUMPS],
            gradient_x: [0.0; MAX_BUMPS],
            base: [[0.0; ROWS]; MAX_BUMPS],
            slope: [[0.0; ROWS]; MAX_BUMPS],
            count: 0,
        }
    }
}

impl<const COLUMNS: usize, const ROWS: usize> Splat<COLUMNS, ROWS> {
    /// The highest frequency at which few enough bumps reach a block.
    pub const MAX_FREQUENCY: f64 = 1.0 / 20.0;

    /// Makes the constants of an octave; its noise is multiplied by `scale`.
    pub fn new(lattice: &Lattice, scale: f64) -> Splat<COLUMNS, ROWS> {
        let mut columns = [0.0; COLUMNS];
        let mut rows = [0.0; ROWS];
        for (column, step) in columns.iter_mut().enumerate() {
            *step = (column as f64 * lattice.frequency) as f32;
        }
        for (row, step) in rows.iter_mut().enumerate() {
            *step = (row as f64 * lattice.frequency) as f32;
        }
        let gradients = DIRECTIONS.map(|g| g.map(|component| (component * NORMALISATION * scale) as f32));
        Splat { columns, rows, gradients }
    }

    /// Returns the lattice points whose bumps reach the block whose first vertex is at `position`.
    #[inline(always)]
    pub fn points(&self, position: [u128; 2]) -> Points {
        Points {
            cell: [cell(position[0]), cell(position[1])],
            fraction: [fraction(position[0]), fraction(position[1])],
            reach: [f64::from(self.columns[COLUMNS - 1]) + REACH, f64::from(self.rows[ROWS - 1]) + REACH],
        }
    }

    /// Finds the bumps that reach the block whose first vertex is at `position`.
    #[inline(always)]
    pub fn find_bumps<S: Simd>(&self, simd: S, position: [u128; 2], bumps: &mut Bumps<ROWS>) {
        let points = self.points(position);
        bumps.count = 0;
        // Lanes past the last bump are out of reach, at a distance whose square is still finite.
        bumps.dx = [FAR; MAX_BUMPS];
        for row in points.rows() {
            for column in points.columns(row) {
                let [gradient_x, gradient_y] = self.gradients[points.gradient(column, row)];
                let bump = bumps.count;
                bumps.count += 1;
                bumps.dx[bump] = points.dx(column, row);
                bumps.dy[bump] = points.dy(row);
                bumps.gradient_x[bump] = gradient_x;
                // Values that a row of vertices shares for this bump are computed here, once.
                let rows = self.rows.chunks_exact(S::LANES);
                let bases = bumps.base[bump].chunks_exact_mut(S::LANES);
                let slopes = bumps.slope[bump].chunks_exact_mut(S::LANES);
                for ((row, base), slope) in rows.zip(bases).zip(slopes) {
                    let dy = simd.load(row) + simd.splat(bumps.dy[bump]);
                    simd.store(simd.splat(0.5) - dy * dy, base);
                    simd.store(dy * simd.splat(gradient_y), slope);
                }
            }
        }
    }

    /// Hands the noise of a strip of vertices, as wide as the lanes, to `sink`.
    #[inline(always)]
    pub fn strip<S: Simd>(
        &self,
        simd: S,
        bumps: &Bumps<ROWS>,
        column: usize,
        rows: &Range<usize>,
        sink: &mut impl NoiseSink<S>,
    ) {
        let columns = &self.columns[column..column + S::LANES];
        let mut start = rows.start;
        while start < rows.end {
            let end = rows.end.min((start / STRIP_ROWS + 1) * STRIP_ROWS);
            let reaching = self.reaching(simd, bumps, columns, start..end);
            // A count known to the compiler keeps all bumps in registers. If there are fewer bumps, dummies that add
            // zero take their places.
            match reaching.count_ones() {
                0..=2 => add_bumps::<S, ROWS, 2>(simd, bumps, columns, start..end, reaching, sink),
                3 => add_bumps::<S, ROWS, 3>(simd, bumps, columns, start..end, reaching, sink),
                4 => add_bumps::<S, ROWS, 4>(simd, bumps, columns, start..end, reaching, sink),
                5 => add_bumps::<S, ROWS, 5>(simd, bumps, columns, start..end, reaching, sink),
                6 => add_bumps::<S, ROWS, 6>(simd, bumps, columns, start..end, reaching, sink),
                7..=8 => add_bumps::<S, ROWS, 8>(simd, bumps, columns, start..end, reaching, sink),
                _ => add_bumps::<S, ROWS, MAX_REACHING>(simd, bumps, columns, start..end, reaching, sink),
            }
            start = end;
        }
    }

    /// Returns one bit for each bump, set if the bump reaches the vertices in these columns and rows.
    #[inline(always)]
    fn reaching<S: Simd>(&self, simd: S, bumps: &Bumps<ROWS>, columns: &[f32], rows: Range<usize>) -> u32 {
        let (west, east) = (simd.splat(columns[0]), simd.splat(columns[S::LANES - 1]));
        let (north, south) = (simd.splat(self.rows[rows.start]), simd.splat(self.rows[rows.end - 1]));
        let zero = simd.splat(0.0);
        let reach2 = simd.splat((REACH * REACH) as f32);
        let mut bits = 0;
        for first in (0..bumps.count).step_by(S::LANES) {
            let (dx, dy) = (simd.load(&bumps.dx[first..]), simd.load(&bumps.dy[first..]));
            // Distance from the point to the nearest vertex of the strip, along each axis: 0 if the point lies between
            // the strip's edges.
            let nearest_dx = simd.max(simd.max(dx + west, -dx - east), zero);
            let nearest_dy = simd.max(simd.max(dy + north, -dy - south), zero);
            let reached = simd.lt(nearest_dx * nearest_dx + nearest_dy * nearest_dy, reach2);
            bits |= simd.mask_bits(reached) << first;
        }
        bits
    }
}

/// Hands the sum of at most `COUNT` bumps to `sink`.
#[inline(always)]
fn add_bumps<S: Simd, const ROWS: usize, const COUNT: usize>(
    simd: S,
    bumps: &Bumps<ROWS>,
    columns: &[f32],
    rows: Range<usize>,
    mut reaching: u32,
    sink: &mut impl NoiseSink<S>,
) {
    // An unused place adds zero: its base is at most 1/2, and less 1 that is below zero.
    let mut less_dx2 = [simd.splat(-1.0); COUNT];
    let mut slope_x = [simd.splat(0.0); COUNT];
    let mut base = [&bumps.base[0][rows.clone()]; COUNT];
    let mut slope = [&bumps.slope[0][rows.clone()]; COUNT];
    for i in 0..COUNT {
        if reaching != 0 {
            let bump = reaching.trailing_zeros() as usize;
            reaching &= reaching - 1;
            let dx = simd.load(columns) + simd.splat(bumps.dx[bump]);
            less_dx2[i] = -(dx * dx);
            slope_x[i] = dx * simd.splat(bumps.gradient_x[bump]);
            base[i] = &bumps.base[bump][rows.clone()];
            slope[i] = &bumps.slope[bump][rows.clone()];
        }
    }
    assert_eq!(reaching, 0, "more bumps reach a strip than can be");
    for (index, row) in rows.enumerate() {
        let mut sum = simd.splat(0.0);
        for i in 0..COUNT {
            // Seven operations: everything else was computed once per row or column.
            let t = simd.max(simd.splat(base[i][index]) + less_dx2[i], simd.splat(0.0));
            let t2 = t * t;
            sum = sum + t2 * t2 * (slope_x[i] + simd.splat(slope[i][index]));
        }
        sink.take(simd, row, sum);
    }
}

const _: () = assert!(MAX_BUMPS.is_multiple_of(MAX_LANES) && MAX_BUMPS <= 32);
