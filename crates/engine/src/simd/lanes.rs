//! The operations on lanes.

use std::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Not, Sub};

use super::level::Level;

/// Largest number of lanes at any level. A multiple of it is a multiple of every level's number of lanes.
pub const MAX_LANES: usize = 16;

/// Lane operations of one level. A value of this type proves that the CPU has the level.
///
/// Comparisons with NaN are false; levels may differ in which NaN an operation produces. Integers wrap. Slices for
/// loads and stores must hold at least [`Simd::LANES`] elements, or the call panics; only the first `LANES` elements
/// are touched.
pub trait Simd: Copy + Send + Sync + 'static {
    /// Number of lanes in a vector: a power of two, at most [`MAX_LANES`].
    const LANES: usize;
    /// True if [`Simd::permute16`] is cheap. If not, [`Simd::permute8`] and arithmetic may be cheaper.
    const FAST_PERMUTE16: bool;
    /// Level of these operations.
    const LEVEL: Level;

    /// A vector of `f32`.
    type F32: Copy
        + Add<Output = Self::F32>
        + Sub<Output = Self::F32>
        + Mul<Output = Self::F32>
        + Div<Output = Self::F32>
        + Neg<Output = Self::F32>;
    /// A vector of 32-bit integers, signed or unsigned depending on the operation.
    type U32: Copy
        + Add<Output = Self::U32>
        + Sub<Output = Self::U32>
        + Mul<Output = Self::U32>
        + BitAnd<Output = Self::U32>
        + BitOr<Output = Self::U32>
        + BitXor<Output = Self::U32>
        + Not<Output = Self::U32>;
    /// A vector of truth values.
    type Mask: Copy
        + BitAnd<Output = Self::Mask>
        + BitOr<Output = Self::Mask>
        + BitXor<Output = Self::Mask>
        + Not<Output = Self::Mask>;
    /// Eight values, prepared for [`Simd::permute8`].
    type Table8: Copy;
    /// Sixteen values, prepared for [`Simd::permute16`].
    type Table16: Copy;

    /// Returns `value` in every lane.
    fn splat(self, value: f32) -> Self::F32;
    /// Returns `value` in every lane.
    fn splat_u32(self, value: u32) -> Self::U32;
    /// Returns `value` in every lane.
    #[inline(always)]
    fn splat_i32(self, value: i32) -> Self::U32 {
        self.splat_u32(value as u32)
    }
    /// Returns the number of each lane: 0, 1, 2, ...
    #[inline(always)]
    fn lane_numbers(self) -> Self::U32 {
        self.load_u32(&[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15])
    }

    /// Loads the first elements of a slice.
    fn load(self, from: &[f32]) -> Self::F32;
    /// Loads the first elements of a slice.
    fn load_u32(self, from: &[u32]) -> Self::U32;
    /// Loads the first elements of a slice.
    fn load_i32(self, from: &[i32]) -> Self::U32;
    /// Stores the lanes into the first elements of a slice.
    fn store(self, value: Self::F32, to: &mut [f32]);
    /// Stores the lanes into the first elements of a slice.
    fn store_u32(self, value: Self::U32, to: &mut [u32]);
    /// Stores the lanes into the first elements of a slice.
    fn store_i32(self, value: Self::U32, to: &mut [i32]);

    /// Returns the square root, correctly rounded.
    fn sqrt(self, a: Self::F32) -> Self::F32;
    /// Returns `if a < b { a } else { b }`, as x86 does: `b` if either is NaN, or if both are zeros of whatever sign.
    fn min(self, a: Self::F32, b: Self::F32) -> Self::F32;
    /// Returns `if a > b { a } else { b }`, as x86 does: `b` if either is NaN, or if both are zeros of whatever sign.
    fn max(self, a: Self::F32, b: Self::F32) -> Self::F32;
    /// Returns `a` without its sign bit.
    #[inline(always)]
    fn abs(self, a: Self::F32) -> Self::F32 {
        self.from_bits(self.to_bits(a) & self.splat_u32(0x7fff_ffff))
    }
    /// Returns the largest whole number not above `a`; |a| must be less than 2^31.
    #[inline(always)]
    fn floor(self, a: Self::F32) -> Self::F32 {
        let toward_zero = self.i32_to_f32(self.truncate_to_i32(a));
        // Truncation rounds negative numbers up, so they may need 1 less.
        let above = self.lt(a, toward_zero);
        toward_zero - self.select(above, self.splat(1.0), self.splat(0.0))
    }

    /// True in lanes where `a < b`.
    fn lt(self, a: Self::F32, b: Self::F32) -> Self::Mask;
    /// True in lanes where `a <= b`.
    fn le(self, a: Self::F32, b: Self::F32) -> Self::Mask;
    /// True in lanes where `a == b`.
    fn eq(self, a: Self::F32, b: Self::F32) -> Self::Mask;
    /// True in lanes where `a > b`.
    #[inline(always)]
    fn gt(self, a: Self::F32, b: Self::F32) -> Self::Mask {
        self.lt(b, a)
    }
    /// True in lanes where `a >= b`.
    #[inline(always)]
    fn ge(self, a: Self::F32, b: Self::F32) -> Self::Mask {
        self.le(b, a)
    }
    /// True in lanes where `a == b`.
    fn eq_u32(self, a: Self::U32, b: Self::U32) -> Self::Mask;
    /// True in lanes where `a > b`, compared as signed numbers.
    fn gt_i32(self, a: Self::U32, b: Self::U32) -> Self::Mask;

    /// Returns `yes` where the mask is true, `no` elsewhere.
    fn select(self, mask: Self::Mask, yes: Self::F32, no: Self::F32) -> Self::F32;
    /// Returns `yes` where the mask is true, `no` elsewhere.
    fn select_u32(self, mask: Self::Mask, yes: Self::U32, no: Self::U32) -> Self::U32;
    /// Returns `value` where the mask is true, zero elsewhere.
    fn keep_u32(self, mask: Self::Mask, value: Self::U32) -> Self::U32;
    /// Returns the mask with one bit per lane, the first lane lowest.
    fn mask_bits(self, mask: Self::Mask) -> u32;
    /// True if any lane is true.
    #[inline(always)]
    fn any(self, mask: Self::Mask) -> bool {
        self.mask_bits(mask) != 0
    }
    /// True if every lane is true.
    #[inline(always)]
    fn all(self, mask: Self::Mask) -> bool {
        self.mask_bits(mask) == u32::MAX >> (32 - Self::LANES)
    }

    /// Returns `!a & b`.
    #[inline(always)]
    fn and_not(self, a: Self::U32, b: Self::U32) -> Self::U32 {
        !a & b
    }
    /// Shifts left by `BITS`, 0 to 31, and fills with zeros.
    fn shl<const BITS: u32>(self, a: Self::U32) -> Self::U32;
    /// Shifts right by `BITS`, 0 to 31, and fills with zeros.
    fn shr<const BITS: u32>(self, a: Self::U32) -> Self::U32;
    /// Shifts right by `BITS`, 0 to 31, and fills with copies of the sign bit.
    fn shr_signed<const BITS: u32>(self, a: Self::U32) -> Self::U32;

    /// Returns the bits of the floats.
    fn to_bits(self, a: Self::F32) -> Self::U32;
    /// Returns the floats with these bits.
    fn from_bits(self, a: Self::U32) -> Self::F32;
    /// Converts signed integers to floats, to nearest, ties to even.
    fn i32_to_f32(self, a: Self::U32) -> Self::F32;
    /// Rounds floats to signed integers, to nearest, ties to even; |a| must be less than 2^31, or levels may differ.
    fn round_to_i32(self, a: Self::F32) -> Self::U32;
    /// Truncates floats to signed integers, toward zero; |a| must be less than 2^31, or levels may differ.
    fn truncate_to_i32(self, a: Self::F32) -> Self::U32;

    /// Returns `from[index]` in every lane, out of the first `max(8, LANES)` elements; the slice must have at least
    /// [`MAX_LANES`]. Higher bits of the index, beyond that range, are ignored.
    fn pick(self, from: &[f32], index: Self::U32) -> Self::F32;
    /// Prepares eight values for lookups. Call it once per kernel, outside its loop.
    fn table8(self, values: &[f32; 8]) -> Self::Table8;
    /// Returns the value whose number is in the low three bits of each lane of `index`; other bits are ignored.
    fn permute8(self, table: Self::Table8, index: Self::U32) -> Self::F32;
    /// Prepares sixteen values for lookups. Call it once per kernel, outside its loop.
    fn table16(self, values: &[f32; 16]) -> Self::Table16;
    /// Returns the value whose number is in the low four bits of each lane of `index`; other bits are ignored.
    fn permute16(self, table: Self::Table16, index: Self::U32) -> Self::F32;
}
