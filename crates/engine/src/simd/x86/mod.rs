//! The levels of x86-64.
//!
//! SAFETY of every intrinsic here: it needs only that the CPU has its features (loads and stores also
//! that the slice is long enough, which is checked right before). `Sse2` is part of x86-64. The tokens
//! `Avx2` and `Avx512` are made in one place each, the wrapper that is itself only called after the CPU
//! was asked; vectors and masks of a level are made by methods of its token or from other such vectors.

#![allow(clippy::undocumented_unsafe_blocks, reason = "one argument holds for all, given above")]
#![allow(clippy::wildcard_imports, reason = "the intrinsics of an instruction set come by the dozen")]

macro_rules! operators {
    ($($type:ident: $trait:ident $method:ident $intrinsic:ident;)*) => {
        $(impl $trait for $type {
            type Output = $type;
            #[inline(always)]
            fn $method(self, other: $type) -> $type {
                unsafe { $type($intrinsic(self.0, other.0)) }
            }
        })*
    };
}

macro_rules! negations {
    ($float:ident, $uint:ident, $xor:ident, $splat:ident, $cast:ident, $cast_back:ident) => {
        impl Neg for $float {
            type Output = $float;
            #[inline(always)]
            fn neg(self) -> $float {
                // Flips the sign bit: subtraction from zero would give +0 for 0.
                unsafe { $float($cast_back($xor($cast(self.0), $splat(i32::MIN)))) }
            }
        }
        impl Not for $uint {
            type Output = $uint;
            #[inline(always)]
            fn not(self) -> $uint {
                unsafe { $uint($xor(self.0, $splat(-1))) }
            }
        }
    };
}

/// The methods that differ between levels by the name of one intrinsic.
macro_rules! shared_methods {
    ($float:ident, $uint:ident;
     $splat:ident $splat_u32:ident $load:ident $load_u32:ident $store:ident $store_u32:ident
     $sqrt:ident $min:ident $max:ident $shl:ident $shr:ident $shr_signed:ident
     $to_bits:ident $from_bits:ident $to_f32:ident $round:ident $truncate:ident) => {
        type F32 = $float;
        type U32 = $uint;

        #[inline(always)]
        fn splat(self, value: f32) -> $float {
            unsafe { $float($splat(value)) }
        }
        #[inline(always)]
        fn splat_u32(self, value: u32) -> $uint {
            unsafe { $uint($splat_u32(value as i32)) }
        }
        #[inline(always)]
        fn load(self, from: &[f32]) -> $float {
            let from = &from[..Self::LANES];
            unsafe { $float($load(from.as_ptr())) }
        }
        #[inline(always)]
        fn load_u32(self, from: &[u32]) -> $uint {
            let from = &from[..Self::LANES];
            unsafe { $uint($load_u32(from.as_ptr().cast())) }
        }
        #[inline(always)]
        fn load_i32(self, from: &[i32]) -> $uint {
            let from = &from[..Self::LANES];
            unsafe { $uint($load_u32(from.as_ptr().cast())) }
        }
        #[inline(always)]
        fn store(self, value: $float, to: &mut [f32]) {
            let to = &mut to[..Self::LANES];
            unsafe { $store(to.as_mut_ptr(), value.0) }
        }
        #[inline(always)]
        fn store_u32(self, value: $uint, to: &mut [u32]) {
            let to = &mut to[..Self::LANES];
            unsafe { $store_u32(to.as_mut_ptr().cast(), value.0) }
        }
        #[inline(always)]
        fn store_i32(self, value: $uint, to: &mut [i32]) {
            let to = &mut to[..Self::LANES];
            unsafe { $store_u32(to.as_mut_ptr().cast(), value.0) }
        }
        #[inline(always)]
        fn sqrt(self, a: $float) -> $float {
            unsafe { $float($sqrt(a.0)) }
        }
        #[inline(always)]
        fn min(self, a: $float, b: $float) -> $float {
            unsafe { $float($min(a.0, b.0)) }
        }
        #[inline(always)]
        fn max(self, a: $float, b: $float) -> $float {
            unsafe { $float($max(a.0, b.0)) }
        }
        // Shifts by a register: with a constant count the compiler makes them immediate.
        #[inline(always)]
        fn shl<const BITS: u32>(self, a: $uint) -> $uint {
            unsafe { $uint($shl(a.0, _mm_cvtsi32_si128(BITS as i32))) }
        }
        #[inline(always)]
        fn shr<const BITS: u32>(self, a: $uint) -> $uint {
            unsafe { $uint($shr(a.0, _mm_cvtsi32_si128(BITS as i32))) }
        }
        #[inline(always)]
        fn shr_signed<const BITS: u32>(self, a: $uint) -> $uint {
            unsafe { $uint($shr_signed(a.0, _mm_cvtsi32_si128(BITS as i32))) }
        }
        #[inline(always)]
        fn to_bits(self, a: $float) -> $uint {
            unsafe { $uint($to_bits(a.0)) }
        }
        #[inline(always)]
        fn from_bits(self, a: $uint) -> $float {
            unsafe { $float($from_bits(a.0)) }
        }
        #[inline(always)]
        fn i32_to_f32(self, a: $uint) -> $float {
            unsafe { $float($to_f32(a.0)) }
        }
        #[inline(always)]
        fn round_to_i32(self, a: $float) -> $uint {
            unsafe { $uint($round(a.0)) }
        }
        #[inline(always)]
        fn truncate_to_i32(self, a: $float) -> $uint {
            unsafe { $uint($truncate(a.0)) }
        }
    };
}

mod avx2;
mod avx512;
mod sse2;

pub(super) use avx2::run_avx2;
pub(super) use avx512::run_avx512;
pub(super) use sse2::Sse2;
