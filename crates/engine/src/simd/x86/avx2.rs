//! AVX2: 8 lanes.

use core::arch::x86_64::*;
use std::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Not, Sub};

use super::super::{Kernel, Level, MAX_LANES, Simd};

#[target_feature(enable = "avx2")]
pub(in crate::simd) fn run_avx2<K: Kernel>(kernel: K) -> K::Output {
    kernel.run(Avx2(()))
}

#[derive(Clone, Copy)]
pub struct Avx2(());
#[derive(Clone, Copy)]
pub struct F32x8(__m256);
#[derive(Clone, Copy)]
pub struct U32x8(__m256i);
#[derive(Clone, Copy)]
pub struct Mask8(__m256i);

operators! {
    F32x8: Add add _mm256_add_ps;
    F32x8: Sub sub _mm256_sub_ps;
    F32x8: Mul mul _mm256_mul_ps;
    F32x8: Div div _mm256_div_ps;
    U32x8: Add add _mm256_add_epi32;
    U32x8: Sub sub _mm256_sub_epi32;
    U32x8: Mul mul _mm256_mullo_epi32;
    U32x8: BitAnd bitand _mm256_and_si256;
    U32x8: BitOr bitor _mm256_or_si256;
    U32x8: BitXor bitxor _mm256_xor_si256;
    Mask8: BitAnd bitand _mm256_and_si256;
    Mask8: BitOr bitor _mm256_or_si256;
    Mask8: BitXor bitxor _mm256_xor_si256;
}
negations!(F32x8, U32x8, _mm256_xor_si256, _mm256_set1_epi32, _mm256_castps_si256, _mm256_castsi256_ps);

impl Not for Mask8 {
    type Output = Mask8;
    #[inline(always)]
    fn not(self) -> Mask8 {
        Mask8((!U32x8(self.0)).0)
    }
}

impl Simd for Avx2 {
    const LANES: usize = 8;
    // A register holds eight values: sixteen take two permutations and a blend.
    const FAST_PERMUTE16: bool = false;
    const LEVEL: Level = Level::Avx2;
    type Mask = Mask8;
    type Table8 = F32x8;
    type Table16 = [F32x8; 2];

    shared_methods! { F32x8, U32x8;
        _mm256_set1_ps _mm256_set1_epi32 _mm256_loadu_ps _mm256_loadu_si256 _mm256_storeu_ps _mm256_storeu_si256
        _mm256_sqrt_ps _mm256_min_ps _mm256_max_ps _mm256_sll_epi32 _mm256_srl_epi32 _mm256_sra_epi32
        _mm256_castps_si256 _mm256_castsi256_ps _mm256_cvtepi32_ps _mm256_cvtps_epi32 _mm256_cvttps_epi32
    }

    #[inline(always)]
    fn lt(self, a: F32x8, b: F32x8) -> Mask8 {
        // Ordered comparison: false if an operand is NaN, as in the reference.
        unsafe { Mask8(_mm256_castps_si256(_mm256_cmp_ps::<_CMP_LT_OQ>(a.0, b.0))) }
    }
    #[inline(always)]
    fn le(self, a: F32x8, b: F32x8) -> Mask8 {
        unsafe { Mask8(_mm256_castps_si256(_mm256_cmp_ps::<_CMP_LE_OQ>(a.0, b.0))) }
    }
    #[inline(always)]
    fn eq(self, a: F32x8, b: F32x8) -> Mask8 {
        unsafe { Mask8(_mm256_castps_si256(_mm256_cmp_ps::<_CMP_EQ_OQ>(a.0, b.0))) }
    }
    #[inline(always)]
    fn eq_u32(self, a: U32x8, b: U32x8) -> Mask8 {
        unsafe { Mask8(_mm256_cmpeq_epi32(a.0, b.0)) }
    }
    #[inline(always)]
    fn gt_i32(self, a: U32x8, b: U32x8) -> Mask8 {
        unsafe { Mask8(_mm256_cmpgt_epi32(a.0, b.0)) }
    }
    #[inline(always)]
    fn select(self, mask: Mask8, yes: F32x8, no: F32x8) -> F32x8 {
        unsafe { F32x8(_mm256_blendv_ps(no.0, yes.0, _mm256_castsi256_ps(mask.0))) }
    }
    #[inline(always)]
    fn select_u32(self, mask: Mask8, yes: U32x8, no: U32x8) -> U32x8 {
        // The intrinsic blends bytes; all bytes of a mask's lane are equal.
        unsafe { U32x8(_mm256_blendv_epi8(no.0, yes.0, mask.0)) }
    }
    #[inline(always)]
    fn keep_u32(self, mask: Mask8, value: U32x8) -> U32x8 {
        unsafe { U32x8(_mm256_and_si256(mask.0, value.0)) }
    }
    #[inline(always)]
    fn mask_bits(self, mask: Mask8) -> u32 {
        unsafe { _mm256_movemask_ps(_mm256_castsi256_ps(mask.0)) as u32 }
    }
    #[inline(always)]
    fn pick(self, from: &[f32], index: U32x8) -> F32x8 {
        self.permute8(self.load(&from[..MAX_LANES]), index)
    }
    #[inline(always)]
    fn table8(self, values: &[f32; 8]) -> F32x8 {
        self.load(values)
    }
    #[inline(always)]
    fn permute8(self, table: F32x8, index: U32x8) -> F32x8 {
        unsafe { F32x8(_mm256_permutevar8x32_ps(table.0, index.0)) }
    }
    #[inline(always)]
    fn table16(self, values: &[f32; 16]) -> [F32x8; 2] {
        [self.load(&values[..8]), self.load(&values[8..])]
    }
    #[inline(always)]
    fn permute16(self, table: [F32x8; 2], index: U32x8) -> F32x8 {
        let low = self.permute8(table[0], index);
        let high = self.permute8(table[1], index);
        // The blend looks at the sign bit: bit 3 of the index moves there.
        self.select(Mask8(self.shl::<28>(index).0), high, low)
    }
}
