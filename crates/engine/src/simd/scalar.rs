//! Lanes as arrays: the reference for every other level, in safe code.

use std::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Not, Sub};

use super::{Level, MAX_LANES, Simd};

/// Four lanes, as in a NEON or SSE register: the compiler vectorizes such arrays reliably.
const LANES: usize = 4;

#[derive(Clone, Copy)]
pub struct Scalar(());

impl Scalar {
    pub(super) fn new() -> Scalar {
        Scalar(())
    }
}

#[derive(Clone, Copy)]
pub struct F32(pub(super) [f32; LANES]);
#[derive(Clone, Copy)]
pub struct U32(pub(super) [u32; LANES]);
#[derive(Clone, Copy)]
pub struct LaneMask([bool; LANES]);

/// Makes an array whose lane `i` is the value of the expression.
macro_rules! each_lane {
    ($i:ident => $lane:expr) => {{
        // Without a loop, because the compiler would unroll one for each operation of each kernel, which took two
        // thirds of all kernels' compile time. Without `array::from_fn`, because closures keep kernels from being
        // inlined whole.
        const _: () = assert!(LANES == 4);
        [
            {
                let $i = 0;
                $lane
            },
            {
                let $i = 1;
                $lane
            },
            {
                let $i = 2;
                $lane
            },
            {
                let $i = 3;
                $lane
            },
        ]
    }};
}

macro_rules! operator {
    ($type:ident, $trait:ident, $method:ident, |$a:ident, $b:ident| $lane:expr) => {
        impl $trait for $type {
            type Output = $type;
            #[inline(always)]
            fn $method(self, other: $type) -> $type {
                $type(each_lane!(i => { let ($a, $b) = (self.0[i], other.0[i]); $lane }))
            }
        }
    };
}

operator!(F32, Add, add, |a, b| a + b);
operator!(F32, Sub, sub, |a, b| a - b);
operator!(F32, Mul, mul, |a, b| a * b);
operator!(F32, Div, div, |a, b| a / b);
operator!(U32, Add, add, |a, b| a.wrapping_add(b));
operator!(U32, Sub, sub, |a, b| a.wrapping_sub(b));
operator!(U32, Mul, mul, |a, b| a.wrapping_mul(b));
operator!(U32, BitAnd, bitand, |a, b| a & b);
operator!(U32, BitOr, bitor, |a, b| a | b);
operator!(U32, BitXor, bitxor, |a, b| a ^ b);
operator!(LaneMask, BitAnd, bitand, |a, b| a & b);
operator!(LaneMask, BitOr, bitor, |a, b| a | b);
operator!(LaneMask, BitXor, bitxor, |a, b| a ^ b);

macro_rules! negation {
    ($type:ident, $trait:ident, $method:ident, |$a:ident| $lane:expr) => {
        impl $trait for $type {
            type Output = $type;
            #[inline(always)]
            fn $method(self) -> $type {
                $type(each_lane!(i => { let $a = self.0[i]; $lane }))
            }
        }
    };
}

negation!(F32, Neg, neg, |a| -a);
negation!(U32, Not, not, |a| !a);
negation!(LaneMask, Not, not, |a| !a);

/// Defines methods in which each lane of the result is computed from the same lane of all arguments.
macro_rules! by_lane {
    ($(fn $method:ident($($a:ident: $type:ident),+) -> $result:ident { $lane:expr })*) => {
        $(#[inline(always)]
        fn $method(self, $($a: $type),+) -> $result {
            $result(each_lane!(i => { $(let $a = $a.0[i];)+ $lane }))
        })*
    };
}

impl Simd for Scalar {
    const LANES: usize = LANES;
    // Tables are looked up in memory, where sixteen values cost no more than eight.
    const FAST_PERMUTE16: bool = true;
    const LEVEL: Level = Level::Scalar;
    type F32 = F32;
    type U32 = U32;
    type Mask = LaneMask;
    type Table8 = [f32; 8];
    type Table16 = [f32; 16];

    #[inline(always)]
    fn splat(self, value: f32) -> F32 {
        F32([value; LANES])
    }
    #[inline(always)]
    fn splat_u32(self, value: u32) -> U32 {
        U32([value; LANES])
    }
    #[inline(always)]
    fn load(self, from: &[f32]) -> F32 {
        let from = &from[..LANES];
        F32(each_lane!(i => from[i]))
    }
    #[inline(always)]
    fn load_u32(self, from: &[u32]) -> U32 {
        let from = &from[..LANES];
        U32(each_lane!(i => from[i]))
    }
    #[inline(always)]
    fn load_i32(self, from: &[i32]) -> U32 {
        let from = &from[..LANES];
        U32(each_lane!(i => from[i] as u32))
    }
    #[inline(always)]
    fn store(self, value: F32, to: &mut [f32]) {
        to[..LANES].copy_from_slice(&value.0);
    }
    #[inline(always)]
    fn store_u32(self, value: U32, to: &mut [u32]) {
        to[..LANES].copy_from_slice(&value.0);
    }
    #[inline(always)]
    fn store_i32(self, value: U32, to: &mut [i32]) {
        to[..LANES].copy_from_slice(&each_lane!(i => value.0[i] as i32));
    }
    by_lane! {
        fn sqrt(a: F32) -> F32 { a.sqrt() }
        fn min(a: F32, b: F32) -> F32 { if a < b { a } else { b } }
        fn max(a: F32, b: F32) -> F32 { if a > b { a } else { b } }
        fn lt(a: F32, b: F32) -> LaneMask { a < b }
        fn le(a: F32, b: F32) -> LaneMask { a <= b }
        fn eq(a: F32, b: F32) -> LaneMask { a == b }
        fn eq_u32(a: U32, b: U32) -> LaneMask { a == b }
        fn gt_i32(a: U32, b: U32) -> LaneMask { a as i32 > b as i32 }
        fn select(mask: LaneMask, yes: F32, no: F32) -> F32 { if mask { yes } else { no } }
        fn select_u32(mask: LaneMask, yes: U32, no: U32) -> U32 { if mask { yes } else { no } }
        fn keep_u32(mask: LaneMask, value: U32) -> U32 { if mask { value } else { 0 } }
        fn to_bits(a: F32) -> U32 { a.to_bits() }
        fn from_bits(a: U32) -> F32 { f32::from_bits(a) }
        fn i32_to_f32(a: U32) -> F32 { a as i32 as f32 }
        fn round_to_i32(a: F32) -> U32 { a.round_ties_even() as i32 as u32 }
        fn truncate_to_i32(a: F32) -> U32 { a as i32 as u32 }
    }

    #[inline(always)]
    fn mask_bits(self, mask: LaneMask) -> u32 {
        let [a, b, c, d] = each_lane!(i => (mask.0[i] as u32) << i);
        a | b | c | d
    }
    #[inline(always)]
    fn shl<const BITS: u32>(self, a: U32) -> U32 {
        U32(each_lane!(i => a.0[i] << BITS))
    }
    #[inline(always)]
    fn shr<const BITS: u32>(self, a: U32) -> U32 {
        U32(each_lane!(i => a.0[i] >> BITS))
    }
    #[inline(always)]
    fn shr_signed<const BITS: u32>(self, a: U32) -> U32 {
        U32(each_lane!(i => (a.0[i] as i32 >> BITS) as u32))
    }
    #[inline(always)]
    fn pick(self, from: &[f32], index: U32) -> F32 {
        let from = &from[..MAX_LANES];
        F32(each_lane!(i => from[(index.0[i] & 7) as usize]))
    }
    #[inline(always)]
    fn table8(self, values: &[f32; 8]) -> [f32; 8] {
        *values
    }
    #[inline(always)]
    fn permute8(self, table: [f32; 8], index: U32) -> F32 {
        F32(each_lane!(i => table[(index.0[i] & 7) as usize]))
    }
    #[inline(always)]
    fn table16(self, values: &[f32; 16]) -> [f32; 16] {
        *values
    }
    #[inline(always)]
    fn permute16(self, table: [f32; 16], index: U32) -> F32 {
        F32(each_lane!(i => table[(index.0[i] & 15) as usize]))
    }
}
