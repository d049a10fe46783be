//! SSE2: 4 lanes, on every x86-64 CPU.

use core::arch::x86_64::*;
use std::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Not, Sub};

use super::super::{Level, MAX_LANES, Simd};

/// Multiplies 32-bit lanes with SSE2, which multiplies only even lanes, to 64 bits.
#[inline(always)]
unsafe fn mullo_sse2(a: __m128i, b: __m128i) -> __m128i {
    unsafe {
        let even = _mm_mul_epu32(a, b);
        let odd = _mm_mul_epu32(_mm_srli_epi64::<32>(a), _mm_srli_epi64::<32>(b));
        // The lower halves of the products, back in the order of the lanes.
        _mm_unpacklo_epi32(_mm_shuffle_epi32::<0b00_00_10_00>(even), _mm_shuffle_epi32::<0b00_00_10_00>(odd))
    }
}

#[derive(Clone, Copy)]
pub struct Sse2(());
#[derive(Clone, Copy)]
pub struct F32x4(__m128);
#[derive(Clone, Copy)]
pub struct U32x4(__m128i);
#[derive(Clone, Copy)]
pub struct Mask4(__m128i);

impl Sse2 {
    pub(in crate::simd) fn new() -> Sse2 {
        Sse2(())
    }

    /// Returns `from[index]` lane by lane, because SSE2 has no permutation by a register.
    #[inline(always)]
    fn look_up(self, from: &[f32], index: U32x4) -> F32x4 {
        let mut i = [0; 4];
        self.store_u32(index, &mut i);
        self.load(&[from[i[0] as usize], from[i[1] as usize], from[i[2] as usize], from[i[3] as usize]])
    }
}

operators! {
    F32x4: Add add _mm_add_ps;
    F32x4: Sub sub _mm_sub_ps;
    F32x4: Mul mul _mm_mul_ps;
    F32x4: Div div _mm_div_ps;
    U32x4: Add add _mm_add_epi32;
    U32x4: Sub sub _mm_sub_epi32;
    U32x4: Mul mul mullo_sse2;
    U32x4: BitAnd bitand _mm_and_si128;
    U32x4: BitOr bitor _mm_or_si128;
    U32x4: BitXor bitxor _mm_xor_si128;
    Mask4: BitAnd bitand _mm_and_si128;
    Mask4: BitOr bitor _mm_or_si128;
    Mask4: BitXor bitxor _mm_xor_si128;
}
negations!(F32x4, U32x4, _mm_xor_si128, _mm_set1_epi32, _mm_castps_si128, _mm_castsi128_ps);

impl Not for Mask4 {
    type Output = Mask4;
    #[inline(always)]
    fn not(self) -> Mask4 {
        Mask4((!U32x4(self.0)).0)
    }
}

impl Simd for Sse2 {
    const LANES: usize = 4;
    // Tables are looked up in memory, where sixteen values cost no more than eight.
    const FAST_PERMUTE16: bool = true;
    const LEVEL: Level = Level::Sse2;
    type Mask = Mask4;
    type Table8 = [f32; 8];
    type Table16 = [f32; 16];

    shared_methods! { F32x4, U32x4;
        _mm_set1_ps _mm_set1_epi32 _mm_loadu_ps _mm_loadu_si128 _mm_storeu_ps _mm_storeu_si128
        _mm_sqrt_ps _mm_min_ps _mm_max_ps _mm_sll_epi32 _mm_srl_epi32 _mm_sra_epi32
        _mm_castps_si128 _mm_castsi128_ps _mm_cvtepi32_ps _mm_cvtps_epi32 _mm_cvttps_epi32
    }

    #[inline(always)]
    fn lt(self, a: F32x4, b: F32x4) -> Mask4 {
        unsafe { Mask4(_mm_castps_si128(_mm_cmplt_ps(a.0, b.0))) }
    }
    #[inline(always)]
    fn le(self, a: F32x4, b: F32x4) -> Mask4 {
        unsafe { Mask4(_mm_castps_si128(_mm_cmple_ps(a.0, b.0))) }
    }
    #[inline(always)]
    fn eq(self, a: F32x4, b: F32x4) -> Mask4 {
        unsafe { Mask4(_mm_castps_si128(_mm_cmpeq_ps(a.0, b.0))) }
    }
    #[inline(always)]
    fn eq_u32(self, a: U32x4, b: U32x4) -> Mask4 {
        unsafe { Mask4(_mm_cmpeq_epi32(a.0, b.0)) }
    }
    #[inline(always)]
    fn gt_i32(self, a: U32x4, b: U32x4) -> Mask4 {
        unsafe { Mask4(_mm_cmpgt_epi32(a.0, b.0)) }
    }
    #[inline(always)]
    fn select(self, mask: Mask4, yes: F32x4, no: F32x4) -> F32x4 {
        // Blend instructions with a mask came with SSE4.1.
        self.from_bits(self.select_u32(mask, self.to_bits(yes), self.to_bits(no)))
    }
    #[inline(always)]
    fn select_u32(self, mask: Mask4, yes: U32x4, no: U32x4) -> U32x4 {
        unsafe { U32x4(_mm_or_si128(_mm_and_si128(mask.0, yes.0), _mm_andnot_si128(mask.0, no.0))) }
    }
    #[inline(always)]
    fn keep_u32(self, mask: Mask4, value: U32x4) -> U32x4 {
        unsafe { U32x4(_mm_and_si128(mask.0, value.0)) }
    }
    #[inline(always)]
    fn mask_bits(self, mask: Mask4) -> u32 {
        unsafe { _mm_movemask_ps(_mm_castsi128_ps(mask.0)) as u32 }
    }
    #[inline(always)]
    fn pick(self, from: &[f32], index: U32x4) -> F32x4 {
        self.look_up(&from[..MAX_LANES], index & self.splat_u32(7))
    }
    #[inline(always)]
    fn table8(self, values: &[f32; 8]) -> [f32; 8] {
        *values
    }
    #[inline(always)]
    fn permute8(self, table: [f32; 8], index: U32x4) -> F32x4 {
        self.look_up(&table, index & self.splat_u32(7))
    }
    #[inline(always)]
    fn table16(self, values: &[f32; 16]) -> [f32; 16] {
        *values
    }
    #[inline(always)]
    fn permute16(self, table: [f32; 16], index: U32x4) -> F32x4 {
        self.look_up(&table, index & self.splat_u32(15))
    }
}
