//! What lanes can do.

use std::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Not, Sub};

use super::level::Level;

/// The most lanes that any level has: every multiple of it suits every level.
pub const MAX_LANES: usize = 16;

/// Lane operations of one level. A value of the type is a proof that the CPU has the level.
///
/// Comparisons with NaN are false; which NaN an operation makes may differ between levels. Integers wrap. Slices given
/// to loads and stores must hold at least [`Simd::LANES`] elements, or they panic; only the first `LANES` are touched.
pub trait Simd: Copy + Send + Sync + 'static {
    /// Lanes of one vector: a power of two, at most [`MAX_LANES`].
    const LANES: usize;
    /// Whether [`Simd::permute16`] is one instruction. If not, [`Simd::permute8`] and arithmetic may be cheaper.
    const FAST_PERMUTE16: bool;
    /// The level that this is.
    const LEVEL: Level;

    /// A vector of `f32`.
    type F32: Copy
        + Add<Output = Self::F32>
        + Sub<Output = Self::F32>
        + Mul<Output = Self::F32>
        + Div<Output = Self::F32>
        + Neg<Output = Self::F32>;
    /// A vector of 32-bit integers, signed or not as the operation says.
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
    /// Eight values, made ready for [`Simd::permute8`].
    type Table8: Copy;
    /// Sixteen values, made ready for [`Simd::permute16`].
    type Table16: Copy;

    /// `value` in every lane.
    fn splat(self, value: f32) -> Self::F32;
    /// `value` in every lane.
    fn splat_u32(self, value: u32) -> Self::U32;
    /// `value` in every lane.
    #[inline(always)]
    fn splat_i32(self, value: i32) -> Self::U32 {
        self.splat_u32(value as u32)
    }
    /// The number of each lane: 0, 1, 2, ...
    #[inline(always)]
    fn lane_numbers(self) -> Self::U32 {
        self.load_u32(&[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15])
    }

    /// The first lanes of a slice.
    fn load(self, from: &[f32]) -> Self::F32;
    /// The first lanes of a slice.
    fn load_u32(self, from: &[u32]) -> Self::U32;
    /// The first lanes of a slice.
    fn load_i32(self, from: &[i32]) -> Self::U32;
    /// Writes the first lanes of a slice.
    fn store(self, value: Self::F32, to: &mut [f32]);
    /// Writes the first lanes of a slice.
    fn store_u32(self, value: Self::U32, to: &mut [u32]);
    /// Writes the first lanes of a slice.
    fn store_i32(self, value: Self::U32, to: &mut [i32]);

    /// The square root, correctly rounded.
    fn sqrt(self, a: Self::F32) -> Self::F32;
    /// `if a < b { a } else { b }`: for NaN, and for zeros of both signs, it is `b` (the order of x86).
    fn min(self, a: Self::F32, b: Self::F32) -> Self::F32;
    /// `if a > b { a } else { b }`: for NaN, and for zeros of both signs, it is `b` (the order of x86).
    fn max(self, a: Self::F32, b: Self::F32) -> Self::F32;
    /// `a` without its sign bit.
    #[inline(always)]
    fn abs(self, a: Self::F32) -> Self::F32 {
        self.from_bits(self.to_bits(a) & self.splat_u32(0x7fff_ffff))
    }
    /// The largest whole number not above `a`; |a| must be less than 2^31.
    #[inline(always)]
    fn floor(self, a: Self::F32) -> Self::F32 {
        let toward_zero = self.i32_to_f32(self.truncate_to_i32(a));
        // Below zero, what is cut off makes a number larger.
        let above = self.lt(a, toward_zero);
        toward_zero - self.select(above, self.splat(1.0), self.splat(0.0))
    }

    /// Where `a < b`.
    fn lt(self, a: Self::F32, b: Self::F32) -> Self::Mask;
    /// Where `a <= b`.
    fn le(self, a: Self::F32, b: Self::F32) -> Self::Mask;
    /// Where `a == b`.
    fn eq(self, a: Self::F32, b: Self::F32) -> Self::Mask;
    /// Where `a > b`.
    #[inline(always)]
    fn gt(self, a: Self::F32, b: Self::F32) -> Self::Mask {
        self.lt(b, a)
    }
    /// Where `a >= b`.
    #[inline(always)]
    fn ge(self, a: Self::F32, b: Self::F32) -> Self::Mask {
        self.le(b, a)
    }
    /// Where `a == b`.
    fn eq_u32(self, a: Self::U32, b: Self::U32) -> Self::Mask;
    /// Where `a > b`, as signed numbers.
    fn gt_i32(self, a: Self::U32, b: Self::U32) -> Self::Mask;

    /// `yes` where the mask is true, `no` elsewhere.
    fn select(self, mask: Self::Mask, yes: Self::F32, no: Self::F32) -> Self::F32;
    /// `yes` where the mask is true, `no` elsewhere.
    fn select_u32(self, mask: Self::Mask, yes: Self::U32, no: Self::U32) -> Self::U32;
    /// `value` where the mask is true, zero elsewhere.
    fn keep_u32(self, mask: Self::Mask, value: Self::U32) -> Self::U32;
    /// One bit a lane, the first lane lowest.
    fn mask_bits(self, mask: Self::Mask) -> u32;
    /// Whether any lane is true.
    #[inline(always)]
    fn any(self, mask: Self::Mask) -> bool {
        self.mask_bits(mask) != 0
    }
    /// Whether every lane is true.
    #[inline(always)]
    fn all(self, mask: Self::Mask) -> bool {
        self.mask_bits(mask) == u32::MAX >> (32 - Self::LANES)
    }

    /// `!a & b`.
    #[inline(always)]
    fn and_not(self, a: Self::U32, b: Self::U32) -> Self::U32 {
        !a & b
    }
    /// Left by `BITS`, 0 to 31, zeros come in.
    fn shl<const BITS: u32>(self, a: Self::U32) -> Self::U32;
    /// Right by `BITS`, 0 to 31, zeros come in.
    fn shr<const BITS: u32>(self, a: Self::U32) -> Self::U32;
    /// Right by `BITS`, 0 to 31, copies of the sign come in.
    fn shr_signed<const BITS: u32>(self, a: Self::U32) -> Self::U32;

    /// The bits of the floats.
    fn to_bits(self, a: Self::F32) -> Self::U32;
    /// The floats with these bits.
    fn from_bits(self, a: Self::U32) -> Self::F32;
    /// Signed integers as floats, to nearest, ties to even.
    fn i32_to_f32(self, a: Self::U32) -> Self::F32;
    /// Floats as signed integers, to nearest, ties to even; |a| must be less than 2^31, or levels may differ.
    fn round_to_i32(self, a: Self::F32) -> Self::U32;
    /// Floats as signed integers, toward zero; |a| must be less than 2^31, or levels may differ.
    fn truncate_to_i32(self, a: Self::F32) -> Self::U32;

    /// `from[index]` in every lane, out of the first `max(8, LANES)` elements of a slice that has at least [`MAX_LANES`];
    /// of the index only the bits that count so far are looked at.
    fn pick(self, from: &[f32], index: Self::U32) -> Self::F32;
    /// Makes eight values ready to be looked up; once a kernel, not in its loop.
    fn table8(self, values: &[f32; 8]) -> Self::Table8;
    /// The value whose number is in the low three bits of each lane of `index`; other bits are ignored.
    fn permute8(self, table: Self::Table8, index: Self::U32) -> Self::F32;
    /// Makes sixteen values ready to be looked up; once a kernel, not in its loop.
    fn table16(self, values: &[f32; 16]) -> Self::Table16;
    /// The value whose number is in the low four bits of each lane of `index`; other bits are ignored.
    fn permute16(self, table: Self::Table16, index: Self::U32) -> Self::F32;
}
