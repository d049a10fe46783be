//! AVX-512: 16 lanes.

use core::arch::x86_64::*;
use std::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Not, Sub};

use super::super::{Kernel, Level, MAX_LANES, Simd};

#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl")]
pub(in crate::simd) fn run_avx512<K: Kernel>(kernel: K) -> K::Output {
    kernel.run(Avx512(()))
}

#[derive(Clone, Copy)]
pub struct Avx512(());
#[derive(Clone, Copy)]
pub struct F32x16(__m512);
#[derive(Clone, Copy)]
pub struct U32x16(__m512i);
#[derive(Clone, Copy)]
pub struct Mask16(__mmask16);

operators! {
    F32x16: Add add _mm512_add_ps;
    F32x16: Sub sub _mm512_sub_ps;
    F32x16: Mul mul _mm512_mul_ps;
    F32x16: Div div _mm512_div_ps;
    U32x16: Add add _mm512_add_epi32;
    U32x16: Sub sub _mm512_sub_epi32;
    U32x16: Mul mul _mm512_mullo_epi32;
    U32x16: BitAnd bitand _mm512_and_si512;
    U32x16: BitOr bitor _mm512_or_si512;
    U32x16: BitXor bitxor _mm512_xor_si512;
    Mask16: BitAnd bitand _kand_mask16;
    Mask16: BitOr bitor _kor_mask16;
    Mask16: BitXor bitxor _kxor_mask16;
}
negations!(F32x16, U32x16, _mm512_xor_si512, _mm512_set1_epi32, _mm512_castps_si512, _mm512_castsi512_ps);

impl Not for Mask16 {
    type Output = Mask16;
    #[inline(always)]
    fn not(self) -> Mask16 {
        Mask16(!self.0)
    }
}

impl Simd for Avx512 {
    const LANES: usize = 16;
    const FAST_PERMUTE16: bool = true;
    const LEVEL: Level = Level::Avx512;
    type Mask = Mask16;
    type Table8 = F32x16;
    type Table16 = F32x16;

    shared_methods! { F32x16, U32x16;
        _mm512_set1_ps _mm512_set1_epi32 _mm512_loadu_ps _mm512_loadu_si512 _mm512_storeu_ps _mm512_storeu_si512
        _mm512_sqrt_ps _mm512_min_ps _mm512_max_ps _mm512_sll_epi32 _mm512_srl_epi32 _mm512_sra_epi32
        _mm512_castps_si512 _mm512_castsi512_ps _mm512_cvtepi32_ps _mm512_cvtps_epi32 _mm512_cvttps_epi32
    }

    #[inline(always)]
    fn lt(self, a: F32x16, b: F32x16) -> Mask16 {
        unsafe { Mask16(_mm512_cmp_ps_mask::<_CMP_LT_OQ>(a.0, b.0)) }
    }
    #[inline(always)]
    fn le(self, a: F32x16, b: F32x16) -> Mask16 {
        unsafe { Mask16(_mm512_cmp_ps_mask::<_CMP_LE_OQ>(a.0, b.0)) }
    }
    #[inline(always)]
    fn eq(self, a: F32x16, b: F32x16) -> Mask16 {
        unsafe { Mask16(_mm512_cmp_ps_mask::<_CMP_EQ_OQ>(a.0, b.0)) }
    }
    #[inline(always)]
    fn eq_u32(self, a: U32x16, b: U32x16) -> Mask16 {
        unsafe { Mask16(_mm512_cmpeq_epi32_mask(a.0, b.0)) }
    }
    #[inline(always)]
    fn gt_i32(self, a: U32x16, b: U32x16) -> Mask16 {
        unsafe { Mask16(_mm512_cmpgt_epi32_mask(a.0, b.0)) }
    }
    #[inline(always)]
    fn select(self, mask: Mask16, yes: F32x16, no: F32x16) -> F32x16 {
        unsafe { F32x16(_mm512_mask_blend_ps(mask.0, no.0, yes.0)) }
    }
    #[inline(always)]
    fn select_u32(self, mask: Mask16, yes: U32x16, no: U32x16) -> U32x16 {
        unsafe { U32x16(_mm512_mask_blend_epi32(mask.0, no.0, yes.0)) }
    }
    #[inline(always)]
    fn keep_u32(self, mask: Mask16, value: U32x16) -> U32x16 {
        unsafe { U32x16(_mm512_maskz_mov_epi32(mask.0, value.0)) }
    }
    #[inline(always)]
    fn mask_bits(self, mask: Mask16) -> u32 {
        mask.0 as u32
    }
    #[inline(always)]
    fn pick(self, from: &[f32], index: U32x16) -> F32x16 {
        self.permute16(self.load(&from[..MAX_LANES]), index)
    }
    #[inline(always)]
    fn table8(self, values: &[f32; 8]) -> F32x16 {
        let [a, b, c, d, e, f, g, h] = *values;
        // The eight values are stored twice, so that bit 3 of an index, which this permutation reads, makes no
        // difference.
        self.load(&[a, b, c, d, e, f, g, h, a, b, c, d, e, f, g, h])
    }
    #[inline(always)]
    fn permute8(self, table: F32x16, index: U32x16) -> F32x16 {
        self.permute16(table, index)
    }
    #[inline(always)]
    fn table16(self, values: &[f32; 16]) -> F32x16 {
        self.load(values)
    }
    #[inline(always)]
    fn permute16(self, table: F32x16, index: U32x16) -> F32x16 {
        unsafe { F32x16(_mm512_permutexvar_ps(index.0, table.0)) }
    }
}
