//! The lattice of an octave: its place in the world, and the random gradients of its points.
//!
//! Simplex noise needs a lattice of equilateral triangles with sides of [`EDGE`]. Here the lattice's rows lie along x
//! and are 1/sqrt(2) apart, so everything that depends on y is computed once for a row of vertices. Point (u, v) lies
//! at `x = EDGE (u - v / 2)`, `y = v / sqrt(2)`. In these skewed coordinates the square from (0, 0) to (1, 1) is cut
//! into two triangles along the diagonal between these two corners.

use crate::hash::scatter;

/// Side of a triangle: sqrt(2/3), in lattice units (a lattice unit is a wavelength).
pub(super) const EDGE: f64 = 0.816_496_580_927_726;
/// Change of u for a lattice unit east: sqrt(3/2).
pub(super) const U_EAST: f64 = 1.224_744_871_391_589;
/// Change of u for a lattice unit south: sqrt(1/2).
const U_SOUTH: f64 = std::f64::consts::FRAC_1_SQRT_2;
/// Change of v for a lattice unit south: sqrt(2).
pub(super) const V_SOUTH: f64 = std::f64::consts::SQRT_2;

/// Bits behind the binary point of a [`Lattice`] position, a `u128`: 32 for the cell, 96 for the fraction. So the
/// lattice wraps after 2^32 cells. A position is an exact multiple of a step: steps are doubles, and doubles above
/// 2^-44 lose no bit.
pub(super) const FRACTION_BITS: u32 = 96;

/// Bits behind the binary point of a position in lanes: 23, as in a float's mantissa. The other nine count cells within
/// a block. Or-ing an exponent to the fraction makes it a float without rounding.
pub(super) const LANE_FRACTION_BITS: u32 = f32::MANTISSA_DIGITS - 1;
pub(super) const LANE_FRACTION: u32 = (1 << LANE_FRACTION_BITS) - 1;

/// Multipliers of columns and rows of points in the hash: the first two 32-bit primes of xxHash, chosen there for even
/// mixing.
pub(super) const HASH_U: u32 = 0x9e37_79b1;
pub(super) const HASH_V: u32 = 0x85eb_ca77;
/// Multipliers that mix columns with rows: those of `lowbias32`, found by search to have the least bias (C. Wellons,
/// hash-prospector).
pub(super) const HASH_ONCE: u32 = 0x7feb_352d;
pub(super) const HASH_TWICE: u32 = 0x846c_a68b;

/// The lattice of one octave.
#[derive(Clone, Debug)]
pub(super) struct Lattice {
    /// Lattice units per vertex.
    pub frequency: f64,
    /// Position of vertex (0, 0).
    origin: [u128; 2],
    /// Change of u for a vertex east.
    u_east: u128,
    /// Changes of u and v for a vertex south.
    south: [u128; 2],
}

impl Lattice {
    /// Makes the lattice of an octave, shifted at random. The shift alone distinguishes seeds and octaves: all use
    /// windows of one lattice of 2^64 points, and two windows drawn at random never meet. Nor do two octaves share a
    /// point at the origin.
    pub fn new(frequency: f64, seed: u64, octave: u32) -> Lattice {
        // A small margin, since the frequency was multiplied up from octave 0.
        assert!(frequency > 0.0 && frequency < 1.000_001, "an octave's waves must span at least one vertex spacing");
        Lattice {
            frequency,
            origin: origin(seed, u64::from(octave) << 8),
            u_east: fixed_point(frequency * U_EAST),
            south: [fixed_point(frequency * U_SOUTH), fixed_point(frequency * V_SOUTH)],
        }
    }

    /// Returns the skewed position (u, v) of a vertex, in fixed point.
    pub fn at(&self, x: i64, y: i64) -> [u128; 2] {
        // Products of two's complements wrap to the right bits, for negative coordinates too.
        let (x, y) = (i128::from(x) as u128, i128::from(y) as u128);
        let south = self.south.map(|step| step.wrapping_mul(y));
        [
            self.origin[0].wrapping_add(self.u_east.wrapping_mul(x)).wrapping_add(south[0]),
            self.origin[1].wrapping_add(south[1]),
        ]
    }

    /// Returns the skewed position one vertex further south.
    #[inline(always)]
    pub fn south_of(&self, at: [u128; 2]) -> [u128; 2] {
        [at[0].wrapping_add(self.south[0]), at[1].wrapping_add(self.south[1])]
    }

    /// Returns the change of u for each column of a block, in a lane's fixed point. Each is rounded only once, so that
    /// rounding errors do not add up.
    pub fn columns<const COLUMNS: usize>(&self) -> [u32; COLUMNS] {
        // Adding half of the dropped unit first turns truncation into rounding.
        const DROPPED: u32 = FRACTION_BITS - LANE_FRACTION_BITS;
        let mut columns = [0; COLUMNS];
        for (column, step) in columns.iter_mut().enumerate() {
            *step = ((self.u_east * column as u128 + (1 << (DROPPED - 1))) >> DROPPED) as u32;
        }
        columns
    }

    /// Returns the changes of position per metre: of u for a metre east, and of (u, v) for a metre south.
    pub fn per_metre(&self, spacing_m: f64) -> (f32, [f32; 2]) {
        let units = self.frequency / spacing_m;
        ((units * U_EAST) as f32, [(units * U_SOUTH) as f32, (units * V_SOUTH) as f32])
    }
}

/// Returns the random position of vertex (0, 0). A seed has one for each `number`; the lowest two bits of `number` must
/// be 0.
pub(super) fn origin(seed: u64, number: u64) -> [u128; 2] {
    let word = |index: u64| scatter(seed ^ scatter(number | index));
    let wide = |index: u64| u128::from(word(index)) << 64 | u128::from(word(index + 1));
    [wide(0), wide(2)]
}

/// Returns the whole cells of a position; they wrap.
#[inline(always)]
pub(super) fn cell(position: u128) -> u32 {
    (position >> FRACTION_BITS) as u32
}

/// Returns the fraction of a position, exact to 53 bits, in [0, 1).
#[inline(always)]
pub(super) fn fraction(position: u128) -> f64 {
    const BITS: u32 = f64::MANTISSA_DIGITS;
    // A double holds 53 of the 96 bits; the others are cut off, so the fraction is never rounded up to 1.
    let bits = (position >> (FRACTION_BITS - BITS)) as u64 & ((1 << BITS) - 1);
    bits as f64 * (1.0 / (1_u64 << BITS) as f64)
}

/// Returns the fraction of a position in a lane's fixed point, cut off.
#[inline(always)]
pub(super) fn lane_fraction(position: u128) -> u32 {
    (position >> (FRACTION_BITS - LANE_FRACTION_BITS)) as u32 & LANE_FRACTION
}

/// Converts `value` in [0, 2^32) to fixed point with 96 bits of fraction; exact for values above 2^-44.
pub(super) fn fixed_point(value: f64) -> u128 {
    (value * (1_u128 << FRACTION_BITS) as f64) as u128
}

/// Hash of a lattice point, in steps that lanes can share between the corners of a cell.
///
/// The products of the row and of the column are xor-ed and then mixed in two rounds. A sum instead of xor would repeat
/// the noise every 2^16 cells or so, by the pigeonhole principle. With one round, the noise 2^31 cells away is the same
/// but for its sign.
pub(super) mod hash {
    use super::{HASH_ONCE, HASH_TWICE, HASH_U, HASH_V};
    use crate::simd::Simd;

    /// Returns the share of a column of points in the hash.
    #[inline(always)]
    pub fn of_u(u: u32) -> u32 {
        u.wrapping_mul(HASH_U)
    }

    /// Returns the share of a row of points in the hash.
    #[inline(always)]
    pub fn of_v(v: u32) -> u32 {
        v.wrapping_mul(HASH_V)
    }

    /// Returns the number, 0 to 15, of the gradient at the point with these shares.
    #[inline(always)]
    pub fn gradient(of_u: u32, of_v: u32) -> usize {
        let both = of_u ^ of_v;
        let once = (both ^ both >> 16).wrapping_mul(HASH_ONCE);
        let twice = (once ^ once >> 15).wrapping_mul(HASH_TWICE);
        (twice >> 28) as usize
    }

    /// Computes [`gradient`] in lanes.
    #[inline(always)]
    pub fn gradient_lanes<S: Simd>(simd: S, of_u: S::U32, of_v: S::U32) -> S::U32 {
        simd.shr::<28>(mixed_lanes(simd, of_u, of_v))
    }

    /// Returns all 32 bits of the hash at the points with these shares; [`gradient_lanes`] takes the upper four.
    #[inline(always)]
    pub fn word_lanes<S: Simd>(simd: S, of_u: S::U32, of_v: S::U32) -> S::U32 {
        let mixed = mixed_lanes(simd, of_u, of_v);
        mixed ^ simd.shr::<16>(mixed)
    }

    /// Mixes both shares. The upper bits are the best: each depends on all lower bits of both shares.
    #[inline(always)]
    fn mixed_lanes<S: Simd>(simd: S, of_u: S::U32, of_v: S::U32) -> S::U32 {
        let both = of_u ^ of_v;
        let once = (both ^ simd.shr::<16>(both)) * simd.splat_u32(HASH_ONCE);
        (once ^ simd.shr::<15>(once)) * simd.splat_u32(HASH_TWICE)
    }

    /// Returns [`of_u`] of the next column.
    #[inline(always)]
    pub fn next_u<S: Simd>(simd: S, of_u: S::U32) -> S::U32 {
        of_u + simd.splat_u32(HASH_U)
    }

    /// Returns [`of_v`] of the next row.
    #[inline(always)]
    pub fn next_v<S: Simd>(simd: S, of_v: S::U32) -> S::U32 {
        of_v + simd.splat_u32(HASH_V)
    }

    /// Returns [`of_u`] of the columns that are `local` columns after `first`.
    #[inline(always)]
    pub fn of_u_lanes<S: Simd>(simd: S, first: u32, local: S::U32) -> S::U32 {
        // The product of a sum is the sum of the products, also where both wrap.
        local * simd.splat_u32(HASH_U) + simd.splat_u32(of_u(first))
    }

    /// Returns [`of_v`] of the rows that are `local` rows after `first`.
    #[inline(always)]
    pub fn of_v_lanes<S: Simd>(simd: S, first: u32, local: S::U32) -> S::U32 {
        local * simd.splat_u32(HASH_V) + simd.splat_u32(of_v(first))
    }
}

/// Sixteen unit vectors, turned half a step off the axes so that none lies along a row; the second half is the first
/// half, negated.
pub(super) const DIRECTIONS: [[f64; 2]; 16] = {
    // Cosine and sine of 11.25 and 33.75 degrees.
    const C1: f64 = 0.980_785_280_403_230_4;
    const S1: f64 = 0.195_090_322_016_128_28;
    const C3: f64 = 0.831_469_612_302_545_2;
    const S3: f64 = 0.555_570_233_019_602_2;
    [
        [C1, S1],
        [C3, S3],
        [S3, C3],
        [S1, C1],
        [-S1, C1],
        [-S3, C3],
        [-C3, S3],
        [-C1, S1],
        [-C1, -S1],
        [-C3, -S3],
        [-S3, -C3],
        [-S1, -C1],
        [S1, -C1],
        [S3, -C3],
        [C3, -S3],
        [C1, -S1],
    ]
};

/// Factor that keeps the sum of bumps `max(0, 1/2 - d.d)^4 (g.d)` within -1 and 1.
///
/// The largest sum over all unit gradients is 2 (1/3)^4 sqrt(1/6) = 1/99.20433, in the middle of a triangle's side (a
/// test proves it). The factor is a ten-thousandth less than 99.20433: ten times the error that rounding of positions
/// and sums to `f32` can add.
pub(super) const NORMALISATION: f64 = 99.194;
