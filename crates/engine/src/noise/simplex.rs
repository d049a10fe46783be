//! Noise vertex by vertex, for warped positions and for the shortest waves: adds the bumps of the three corners of the
//! vertex's triangle.

use super::lattice::{
    DIRECTIONS, EDGE, LANE_FRACTION, LANE_FRACTION_BITS, Lattice, NORMALISATION, cell, hash, lane_fraction,
};
use crate::simd::Simd;

/// A table of one component of the sixteen gradients.
#[derive(Clone, Copy)]
pub(super) struct GradientTable<S: Simd> {
    // Both tables, since the instructions available decide which lookup is cheaper: see `bump`.
    sixteen: S::Table16,
    first_eight: S::Table8,
}

impl<S: Simd> GradientTable<S> {
    #[inline(always)]
    fn new(simd: S, values: &[f32; 16]) -> GradientTable<S> {
        let [a, b, c, d, e, f, g, h, ..] = *values;
        GradientTable { sixteen: simd.table16(values), first_eight: simd.table8(&[a, b, c, d, e, f, g, h]) }
    }
}

/// Constants for evaluating an octave vertex by vertex, for blocks `COLUMNS` wide.
#[derive(Clone, Debug)]
pub(super) struct Simplex<const COLUMNS: usize> {
    /// Change of u for each column.
    columns: [u32; COLUMNS],
    /// Components of the gradients along doubled u and v, scaled.
    gradients: [[f32; 16]; 2],
    /// Changes of position per metre: of u for a metre east, and of (u, v) for a metre south.
    u_per_metre_east: f32,
    per_metre_south: [f32; 2],
}

/// Position of the first vertex of a block's row.
#[derive(Clone, Copy)]
pub(super) struct RowStart {
    pub cell: [u32; 2],
    pub fraction: [u32; 2],
}

impl RowStart {
    /// Converts the position of the block's first vertex in this row.
    #[inline(always)]
    pub fn new(position: [u128; 2]) -> RowStart {
        RowStart {
            cell: [cell(position[0]), cell(position[1])],
            fraction: [lane_fraction(position[0]), lane_fraction(position[1])],
        }
    }
}

/// The tables of one octave in lanes.
#[derive(Clone, Copy)]
pub(super) struct SimplexLanes<'a, S: Simd, const COLUMNS: usize> {
    simplex: &'a Simplex<COLUMNS>,
    gradient_u: GradientTable<S>,
    gradient_v: GradientTable<S>,
}

impl<const COLUMNS: usize> Simplex<COLUMNS> {
    /// Makes the constants of an octave; its noise is multiplied by `scale`.
    pub fn new(lattice: &Lattice, spacing_m: f64, scale: f64) -> Simplex<COLUMNS> {
        // The bumps are computed with a factor of 6^4, see `noise_in_cells`, and with doubled coordinates.
        let scale = scale * NORMALISATION / (6.0 * 6.0 * 6.0 * 6.0) / 2.0;
        let (u_per_metre_east, per_metre_south) = lattice.per_metre(spacing_m);
        Simplex {
            columns: lattice.columns(),
            gradients: [
                // Components along u and v, not east and south: a step of u goes EDGE east, a step of v goes half of
                // EDGE west and 1 / sqrt(2) south.
                DIRECTIONS.map(|[gx, _]| (gx * EDGE * scale) as f32),
                DIRECTIONS.map(|[gx, gy]| ((gy * std::f64::consts::FRAC_1_SQRT_2 - gx * EDGE / 2.0) * scale) as f32),
            ],
            u_per_metre_east,
            per_metre_south,
        }
    }

    /// Returns the changes per metre, of u to the east and of u and v to the south; and the gradients.
    #[cfg(feature = "gpu")]
    pub fn packed(&self) -> ([f32; 3], [[f32; 16]; 2]) {
        let [south_u, south_v] = self.per_metre_south;
        ([self.u_per_metre_east, south_u, south_v], self.gradients)
    }

    /// Returns the change of u for each column.
    #[cfg(feature = "gpu")]
    pub fn columns(&self) -> [u32; COLUMNS] {
        self.columns
    }

    #[inline(always)]
    pub fn lanes<S: Simd>(&self, simd: S) -> SimplexLanes<'_, S, COLUMNS> {
        SimplexLanes {
            simplex: self,
            gradient_u: GradientTable::new(simd, &self.gradients[0]),
            gradient_v: GradientTable::new(simd, &self.gradients[1]),
        }
    }
}

impl<S: Simd, const COLUMNS: usize> SimplexLanes<'_, S, COLUMNS> {
    /// Returns the noise at `LANES` vertices of a row, from `column` on.
    #[inline(always)]
    pub fn noise(&self, simd: S, row: &RowStart, column: usize) -> S::F32 {
        let u = simd.load_u32(&self.simplex.columns[column..]) + simd.splat_u32(row.fraction[0]);
        let v = simd.splat_u32(row.fraction[1]);
        let cell_u = simd.shr::<LANE_FRACTION_BITS>(u);
        // Rows of the lattice lie along x, so v is the same for all vertices of a row.
        self.noise_in_cells(simd, row, u, v, cell_u, simd.splat_u32(0))
    }

    /// Returns the noise at `LANES` vertices of a row, from `column` on, each displaced by metres.
    #[inline(always)]
    pub fn noise_warped(&self, simd: S, row: &RowStart, column: usize, dx_m: S::F32, dy_m: S::F32) -> S::F32 {
        // Whole cells and the rest are kept apart, since together they need more bits than a lane has.
        let [south_u, south_v] = self.simplex.per_metre_south;
        let (whole_u, rest_u) =
            split(simd, dx_m * simd.splat(self.simplex.u_per_metre_east) + dy_m * simd.splat(south_u));
        let (whole_v, rest_v) = split(simd, dy_m * simd.splat(south_v));
        let u = simd.load_u32(&self.simplex.columns[column..]) + simd.splat_u32(row.fraction[0]) + rest_u;
        let v = simd.splat_u32(row.fraction[1]) + rest_v;
        // A signed shift, since a displacement may lead to a place before the row's first cell.
        let cell_u = simd.shr_signed::<LANE_FRACTION_BITS>(u) + whole_u;
        let cell_v = simd.shr_signed::<LANE_FRACTION_BITS>(v) + whole_v;
        self.noise_in_cells(simd, row, u, v, cell_u, cell_v)
    }

    /// Returns the noise at the fractions of `u` and `v`, in cells counted from the row's first.
    ///
    /// The computation uses coordinates U and V, twice the fraction less one, so that a cell's square is from -1 to 1
    /// and all corners are treated alike. With D = U - V, S = U + V and E = D^2 + U V, six times `1/2 - d.d` is
    /// `2 - E - S` for the corner (0, 0), `2 - E + S` for (1, 1), and `3 |D| - E` for the nearer of the other two:
    /// (1, 0) if D >= 0, else (0, 1).
    #[inline(always)]
    fn noise_in_cells(&self, simd: S, row: &RowStart, u: S::U32, v: S::U32, cell_u: S::U32, cell_v: S::U32) -> S::F32 {
        // The fraction becomes the mantissa of a float from 2 to 4.
        let mantissa = simd.splat_u32(LANE_FRACTION);
        let two = simd.splat_u32(2.0_f32.to_bits());
        let from_two_u = simd.from_bits(u & mantissa | two);
        let from_two_v = simd.from_bits(v & mantissa | two);
        // All these differences are exact: a number from 2 to 4 and the numbers 2, 3 and 4 differ by at most a factor
        // of two.
        let (uu, vv) = (from_two_u - simd.splat(3.0), from_two_v - simd.splat(3.0));
        let (east_u, west_u) = (from_two_u - simd.splat(2.0), from_two_u - simd.splat(4.0));
        let (east_v, west_v) = (from_two_v - simd.splat(2.0), from_two_v - simd.splat(4.0));

        let difference = uu - vv;
        let sum = uu + vv;
        let e = difference * difference + uu * vv;
        let two_less_e = simd.splat(2.0) - e;
        let t0 = two_less_e - sum;
        let t1 = simd.abs(difference) * simd.splat(3.0) - e;
        let t2 = two_less_e + sum;
        let u_first = simd.ge(difference, simd.splat(0.0));

        // One product per axis: the shares of the far corners are those of the near corners plus a constant.
        let h_u = hash::of_u_lanes(simd, row.cell[0], cell_u);
        let h_v = hash::of_v_lanes(simd, row.cell[1], cell_v);
        let next_u = hash::next_u(simd, h_u);
        let next_v = hash::next_v(simd, h_v);
        // The third corner is (1, 0) in one triangle of the square and (0, 1) in the other.
        let middle_u = simd.select_u32(u_first, next_u, h_u);
        let middle_v = simd.select_u32(u_first, h_v, next_v);

        let bump0 = self.bump(simd, t0, hash::gradient_lanes(simd, h_u, h_v), east_u, east_v);
        let bump1 = self.bump(
            simd,
            t1,
            hash::gradient_lanes(simd, middle_u, middle_v),
            simd.select(u_first, west_u, east_u),
            simd.select(u_first, east_v, west_v),
        );
        let bump2 = self.bump(simd, t2, hash::gradient_lanes(simd, next_u, next_v), west_u, west_v);
        bump0 + bump1 + bump2
    }

    /// Returns `max(0, t)^4 (g.d)`.
    #[inline(always)]
    fn bump(&self, simd: S, t: S::F32, gradient: S::U32, du: S::F32, dv: S::F32) -> S::F32 {
        let t = simd.max(t, simd.splat(0.0));
        let t2 = t * t;
        let slope = if S::FAST_PERMUTE16 {
            simd.permute16(self.gradient_u.sixteen, gradient) * du
                + simd.permute16(self.gradient_v.sixteen, gradient) * dv
        } else {
            // The second eight are the first eight negated: negating the sum gives the same bits.
            let slope = simd.permute8(self.gradient_u.first_eight, gradient) * du
                + simd.permute8(self.gradient_v.first_eight, gradient) * dv;
            let sign = simd.shl::<28>(gradient) & simd.splat_u32(0x8000_0000);
            simd.from_bits(simd.to_bits(slope) ^ sign)
        };
        t2 * t2 * slope
    }
}

/// Splits a number into whole cells and the rest in a lane's fixed point, at most half a cell either way.
#[inline(always)]
fn split<S: Simd>(simd: S, cells: S::F32) -> (S::U32, S::U32) {
    let whole = simd.round_to_i32(cells);
    let rest = cells - simd.i32_to_f32(whole);
    (whole, simd.round_to_i32(rest * simd.splat((LANE_FRACTION + 1) as f32)))
}
