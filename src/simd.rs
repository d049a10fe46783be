//! Lanes: one kernel, written once, run with the widest vectors that the CPU has.
//!
//! A kernel is a struct with its inputs that implements [`Kernel`]; it is generic over [`Simd`], the
//! trait of lane operations. [`dispatch`] runs it with AVX-512, AVX2, SSE2 or plain arrays. The arrays
//! are the reference, and on a CPU that is not x86 the only level: the compiler turns them into the
//! vectors that are always there (NEON on aarch64).
//!
//! **Every level gives the same bits.** Lanes know only `+ - * /`, `sqrt`, integers, comparisons and
//! moves, all of them exact by IEEE 754 or by definition; a multiply-add is always two operations.
//!
//! **Kernels must be inlined whole.** The target features hold inside the one wrapper function of each
//! level, so `run` and all that it calls on lanes must be `#[inline(always)]`, and must not use closures
//! (nor `array::from_fn`, iterator adaptors and the like around lane operations): a closure does not
//! inherit the features, each lane operation in it becomes a call, and the kernel is six times slower.
//!
//! ```
//! use terrane::simd::{dispatch, Kernel, Simd};
//!
//! struct Scale<'a> { factor: f32, values: &'a mut [f32] }
//!
//! impl Kernel for Scale<'_> {
//!     type Output = ();
//!     #[inline(always)]
//!     fn run<S: Simd>(self, simd: S) {
//!         let factor = simd.splat(self.factor);
//!         for values in self.values.chunks_exact_mut(S::LANES) {
//!             simd.store(simd.load(values) * factor, values);
//!         }
//!     }
//! }
//!
//! let mut values = [1.0; 64];
//! dispatch(Scale { factor: 3.0, values: &mut values });
//! assert_eq!(values, [3.0; 64]);
//! ```

#![allow(unsafe_code, reason = "vector instructions are unsafe to call; nothing else of the crate is")]
#![allow(clippy::wildcard_imports, reason = "the intrinsics of an instruction set come by the dozen")]
#![allow(clippy::wrong_self_convention, reason = "self is the proof that the CPU has the level, not an operand")]

use std::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Not, Sub};
use std::sync::OnceLock;

/// The most lanes that any level has: every multiple of it suits every level.
pub const MAX_LANES: usize = 16;

/// Lane operations of one level. A value of the type is a proof that the CPU has the level.
///
/// Comparisons with NaN are false; which NaN an operation makes may differ between levels. Integers wrap. Slices given to loads and stores must hold at least
/// [`Simd::LANES`] elements, or they panic; only the first `LANES` are touched.
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

/// A computation over lanes, with its inputs and outputs as fields.
pub trait Kernel {
    /// What it returns.
    type Output;
    /// Runs with the lanes of one level. Must be `#[inline(always)]`, see the module.
    fn run<S: Simd>(self, simd: S) -> Self::Output;
}

/// A set of vector instructions, from the narrowest to the widest.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Level {
    /// Arrays of the language: the reference, and NEON on aarch64.
    Scalar,
    /// 4 lanes; every x86-64 CPU.
    Sse2,
    /// 8 lanes.
    Avx2,
    /// 16 lanes (F, BW, DQ and VL, as all CPUs since Skylake-X have them together).
    Avx512,
}

impl Level {
    /// The environment variable that forces a level.
    pub const VARIABLE: &str = "TERRANE_SIMD";
    /// All levels, known to this CPU or not.
    pub const ALL: [Level; 4] = [Level::Scalar, Level::Sse2, Level::Avx2, Level::Avx512];

    /// The name, as written in the environment variable.
    pub fn name(self) -> &'static str {
        match self {
            Level::Scalar => "scalar",
            Level::Sse2 => "sse2",
            Level::Avx2 => "avx2",
            Level::Avx512 => "avx512",
        }
    }

    /// Whether this CPU has the level.
    pub fn is_available(self) -> bool {
        match self {
            Level::Scalar => true,
            #[cfg(target_arch = "x86_64")]
            Level::Sse2 => true,
            #[cfg(target_arch = "x86_64")]
            Level::Avx2 => is_x86_feature_detected!("avx2"),
            #[cfg(target_arch = "x86_64")]
            Level::Avx512 => {
                is_x86_feature_detected!("avx512f")
                    && is_x86_feature_detected!("avx512bw")
                    && is_x86_feature_detected!("avx512dq")
                    && is_x86_feature_detected!("avx512vl")
            }
            #[cfg(not(target_arch = "x86_64"))]
            _ => false,
        }
    }

    /// The levels that this CPU has, narrowest first; never empty.
    pub fn available() -> Vec<Level> {
        Level::ALL.into_iter().filter(|level| level.is_available()).collect()
    }

    /// The level that [`dispatch`] uses: the one named by `TERRANE_SIMD`, or else the widest available.
    ///
    /// # Errors
    /// A sentence for the user, if the variable names no level or one that this CPU lacks.
    pub fn chosen() -> Result<Level, String> {
        static CHOSEN: OnceLock<Result<Level, String>> = OnceLock::new();
        CHOSEN
            .get_or_init(|| match std::env::var_os(Level::VARIABLE) {
                // An empty variable is one that is not set.
                None => Ok(Level::widest()),
                Some(name) if name.is_empty() => Ok(Level::widest()),
                Some(name) => Level::from_name(&name.to_string_lossy()),
            })
            .clone()
    }

    fn widest() -> Level {
        Level::ALL.into_iter().rev().find(|level| level.is_available()).unwrap_or(Level::Scalar)
    }

    fn from_name(name: &str) -> Result<Level, String> {
        let list = |levels: &[Level]| levels.iter().map(|level| level.name()).collect::<Vec<_>>().join(", ");
        let Some(level) = Level::ALL.into_iter().find(|level| level.name() == name) else {
            return Err(format!(
                "{}={name:?} is not a known instruction set; known are {}",
                Level::VARIABLE,
                list(&Level::ALL)
            ));
        };
        if !level.is_available() {
            return Err(format!(
                "{}={name:?} asks for instructions that this CPU lacks; it has {}",
                Level::VARIABLE,
                list(&Level::available())
            ));
        }
        Ok(level)
    }
}

/// Runs a kernel at the level that [`Level::chosen`] names.
///
/// # Panics
/// If the environment variable is bad; call [`Level::chosen`] first to report that to a user.
pub fn dispatch<K: Kernel>(kernel: K) -> K::Output {
    static CHECKED: OnceLock<Level> = OnceLock::new();
    let level = *CHECKED.get_or_init(|| Level::chosen().unwrap_or_else(|message| panic!("{message}")));
    dispatch_checked(level, kernel)
}

/// Runs a kernel at a given level: for tests and benchmarks.
///
/// # Panics
/// If this CPU lacks the level.
pub fn dispatch_at<K: Kernel>(level: Level, kernel: K) -> K::Output {
    assert!(level.is_available(), "this CPU lacks the instructions of level {}", level.name());
    dispatch_checked(level, kernel)
}

/// `level` must be available.
fn dispatch_checked<K: Kernel>(level: Level, kernel: K) -> K::Output {
    match level {
        Level::Scalar => run_on(kernel, scalar::Scalar::new()),
        #[cfg(target_arch = "x86_64")]
        Level::Sse2 => run_on(kernel, x86::Sse2::new()),
        // SAFETY: both callers have checked that the CPU has the level's features.
        #[cfg(target_arch = "x86_64")]
        Level::Avx2 => unsafe { x86::run_avx2(kernel) },
        // SAFETY: both callers have checked that the CPU has the level's features.
        #[cfg(target_arch = "x86_64")]
        Level::Avx512 => unsafe { x86::run_avx512(kernel) },
        #[cfg(not(target_arch = "x86_64"))]
        _ => unreachable!("only the scalar level is available here"),
    }
}

/// A function of its own for the levels that need no target feature: inlined into the match above, their frames would
/// add up with those of the others, and without optimisation that is more than a thread's stack.
#[inline(never)]
fn run_on<K: Kernel, S: Simd>(kernel: K, simd: S) -> K::Output {
    kernel.run(simd)
}

/// Lanes as arrays: the reference for every other level, in safe code.
mod scalar {
    use super::*;

    /// Four lanes: one NEON or SSE register, which the compiler finds reliably.
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
    pub struct Mask([bool; LANES]);

    /// An array whose lane `i` is the expression.
    macro_rules! each_lane {
        ($i:ident => $lane:expr) => {{
            let $i = 0;
            let mut lanes = [$lane; LANES];
            #[allow(clippy::needless_range_loop, reason = "the expression indexes several arrays")]
            for $i in 1..LANES {
                lanes[$i] = $lane;
            }
            lanes
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
    operator!(Mask, BitAnd, bitand, |a, b| a & b);
    operator!(Mask, BitOr, bitor, |a, b| a | b);
    operator!(Mask, BitXor, bitxor, |a, b| a ^ b);

    impl Neg for F32 {
        type Output = F32;
        #[inline(always)]
        fn neg(self) -> F32 {
            F32(each_lane!(i => -self.0[i]))
        }
    }

    impl Not for U32 {
        type Output = U32;
        #[inline(always)]
        fn not(self) -> U32 {
            U32(each_lane!(i => !self.0[i]))
        }
    }

    impl Not for Mask {
        type Output = Mask;
        #[inline(always)]
        fn not(self) -> Mask {
            Mask(each_lane!(i => !self.0[i]))
        }
    }

    impl Simd for Scalar {
        const LANES: usize = LANES;
        const FAST_PERMUTE16: bool = true;
        const LEVEL: Level = Level::Scalar;
        type F32 = F32;
        type U32 = U32;
        type Mask = Mask;
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
        #[inline(always)]
        fn sqrt(self, a: F32) -> F32 {
            F32(each_lane!(i => a.0[i].sqrt()))
        }
        #[inline(always)]
        fn min(self, a: F32, b: F32) -> F32 {
            F32(each_lane!(i => if a.0[i] < b.0[i] { a.0[i] } else { b.0[i] }))
        }
        #[inline(always)]
        fn max(self, a: F32, b: F32) -> F32 {
            F32(each_lane!(i => if a.0[i] > b.0[i] { a.0[i] } else { b.0[i] }))
        }
        #[inline(always)]
        fn lt(self, a: F32, b: F32) -> Mask {
            Mask(each_lane!(i => a.0[i] < b.0[i]))
        }
        #[inline(always)]
        fn le(self, a: F32, b: F32) -> Mask {
            Mask(each_lane!(i => a.0[i] <= b.0[i]))
        }
        #[inline(always)]
        fn eq(self, a: F32, b: F32) -> Mask {
            Mask(each_lane!(i => a.0[i] == b.0[i]))
        }
        #[inline(always)]
        fn eq_u32(self, a: U32, b: U32) -> Mask {
            Mask(each_lane!(i => a.0[i] == b.0[i]))
        }
        #[inline(always)]
        fn gt_i32(self, a: U32, b: U32) -> Mask {
            Mask(each_lane!(i => a.0[i] as i32 > b.0[i] as i32))
        }
        #[inline(always)]
        fn select(self, mask: Mask, yes: F32, no: F32) -> F32 {
            F32(each_lane!(i => if mask.0[i] { yes.0[i] } else { no.0[i] }))
        }
        #[inline(always)]
        fn select_u32(self, mask: Mask, yes: U32, no: U32) -> U32 {
            U32(each_lane!(i => if mask.0[i] { yes.0[i] } else { no.0[i] }))
        }
        #[inline(always)]
        fn keep_u32(self, mask: Mask, value: U32) -> U32 {
            U32(each_lane!(i => if mask.0[i] { value.0[i] } else { 0 }))
        }
        #[inline(always)]
        fn mask_bits(self, mask: Mask) -> u32 {
            let mut bits = 0;
            for i in 0..LANES {
                bits |= (mask.0[i] as u32) << i;
            }
            bits
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
        fn to_bits(self, a: F32) -> U32 {
            U32(each_lane!(i => a.0[i].to_bits()))
        }
        #[inline(always)]
        fn from_bits(self, a: U32) -> F32 {
            F32(each_lane!(i => f32::from_bits(a.0[i])))
        }
        #[inline(always)]
        fn i32_to_f32(self, a: U32) -> F32 {
            F32(each_lane!(i => a.0[i] as i32 as f32))
        }
        #[inline(always)]
        fn round_to_i32(self, a: F32) -> U32 {
            U32(each_lane!(i => a.0[i].round_ties_even() as i32 as u32))
        }
        #[inline(always)]
        fn truncate_to_i32(self, a: F32) -> U32 {
            U32(each_lane!(i => a.0[i] as i32 as u32))
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
}

/// The levels of x86-64.
///
/// SAFETY of every intrinsic here: it needs only that the CPU has its features (loads and stores also
/// that the slice is long enough, which is checked right before). `Sse2` is part of x86-64. The tokens
/// `Avx2` and `Avx512` are made in one place each, the wrapper that is itself only called after the CPU
/// was asked; vectors and masks of a level are made by methods of its token or from other such vectors.
#[cfg(target_arch = "x86_64")]
#[allow(clippy::undocumented_unsafe_blocks, reason = "one argument holds for all, given above")]
mod x86 {
    use super::*;
    use core::arch::x86_64::*;

    #[target_feature(enable = "avx2")]
    pub(super) fn run_avx2<K: Kernel>(kernel: K) -> K::Output {
        kernel.run(Avx2(()))
    }

    #[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl")]
    pub(super) fn run_avx512<K: Kernel>(kernel: K) -> K::Output {
        kernel.run(Avx512(()))
    }

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

    /// 32-bit product by SSE2, which multiplies only the even lanes, to 64 bits.
    #[inline(always)]
    unsafe fn mullo_sse2(a: __m128i, b: __m128i) -> __m128i {
        unsafe {
            let even = _mm_mul_epu32(a, b);
            let odd = _mm_mul_epu32(_mm_srli_epi64::<32>(a), _mm_srli_epi64::<32>(b));
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
        pub(super) fn new() -> Sse2 {
            Sse2(())
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
            let from = &from[..MAX_LANES];
            let mut i = [0; 4];
            self.store_u32(index & self.splat_u32(7), &mut i);
            let pick = [from[i[0] as usize], from[i[1] as usize], from[i[2] as usize], from[i[3] as usize]];
            self.load(&pick)
        }
        #[inline(always)]
        fn table8(self, values: &[f32; 8]) -> [f32; 8] {
            *values
        }
        #[inline(always)]
        fn permute8(self, table: [f32; 8], index: U32x4) -> F32x4 {
            let mut i = [0; 4];
            self.store_u32(index & self.splat_u32(7), &mut i);
            let pick = [table[i[0] as usize], table[i[1] as usize], table[i[2] as usize], table[i[3] as usize]];
            self.load(&pick)
        }
        #[inline(always)]
        fn table16(self, values: &[f32; 16]) -> [f32; 16] {
            *values
        }
        #[inline(always)]
        fn permute16(self, table: [f32; 16], index: U32x4) -> F32x4 {
            let mut i = [0; 4];
            self.store_u32(index & self.splat_u32(15), &mut i);
            let pick = [table[i[0] as usize], table[i[1] as usize], table[i[2] as usize], table[i[3] as usize]];
            self.load(&pick)
        }
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
    }
    negations!(F32x16, U32x16, _mm512_xor_si512, _mm512_set1_epi32, _mm512_castps_si512, _mm512_castsi512_ps);

    impl BitAnd for Mask16 {
        type Output = Mask16;
        #[inline(always)]
        fn bitand(self, other: Mask16) -> Mask16 {
            Mask16(self.0 & other.0)
        }
    }
    impl BitOr for Mask16 {
        type Output = Mask16;
        #[inline(always)]
        fn bitor(self, other: Mask16) -> Mask16 {
            Mask16(self.0 | other.0)
        }
    }
    impl BitXor for Mask16 {
        type Output = Mask16;
        #[inline(always)]
        fn bitxor(self, other: Mask16) -> Mask16 {
            Mask16(self.0 ^ other.0)
        }
    }
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
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs every operation on awkward values and returns the bits of all results.
    struct EveryOperation;

    impl Kernel for EveryOperation {
        type Output = Vec<u32>;

        #[inline(always)]
        fn run<S: Simd>(self, simd: S) -> Vec<u32> {
            const FLOATS: [f32; 16] = [
                0.0,
                -0.0,
                1.0,
                -1.5,
                2.5,
                3.5,
                1e-40,
                -1e30,
                1e30,
                f32::INFINITY,
                0.1,
                -0.5,
                7.75,
                1e6,
                -0.999,
                123.456,
            ];
            let table: [f32; 16] = [1., 2., 3., 4., 5., 6., 7., 8., 9., 10., 11., 12., 13., 14., 15., 16.];
            let table8: [f32; 8] = [1., 2., 3., 4., 5., 6., 7., 8.];
            let mut results = Vec::new();
            for turn in 0..16 {
                let mut others = FLOATS;
                others.rotate_left(turn);
                let mut column = vec![Vec::new(); 64];
                for start in (0..16).step_by(S::LANES) {
                    let a = simd.load(&FLOATS[start..]);
                    let b = simd.load(&others[start..]);
                    let (i, j) = (simd.to_bits(a), simd.to_bits(b));
                    let one = simd.splat(1.0);
                    let (small_a, small_b) = (
                        simd.min(simd.max(a, simd.splat(-1e9)), simd.splat(1e9)),
                        simd.min(simd.max(b, simd.splat(-1e9)), simd.splat(1e9)),
                    );
                    let floats = [
                        a + b,
                        a * b,
                        -a,
                        simd.abs(b),
                        simd.min(a, b),
                        simd.max(a, b),
                        a / (one + simd.abs(b)),
                        simd.sqrt(simd.abs(a)),
                        simd.floor(small_b),
                        simd.select(simd.lt(a, b), a, b),
                        simd.select(simd.ge(a, b), a, b),
                        simd.select(simd.eq(a, b) | simd.gt(a, one), a, b),
                        simd.permute16(simd.table16(&table), j),
                        simd.permute8(simd.table8(&table8), j),
                        simd.i32_to_f32(i),
                        small_a - small_b,
                    ];
                    let integers = [
                        i + j,
                        i - j,
                        i * j,
                        i & j,
                        i | j,
                        i ^ j,
                        !i,
                        simd.and_not(i, j),
                        simd.shl::<5>(i),
                        simd.shr::<7>(j),
                        simd.shr_signed::<3>(i),
                        simd.round_to_i32(small_a),
                        simd.truncate_to_i32(small_b),
                        simd.select_u32(simd.gt_i32(i, j), i, j),
                        simd.keep_u32(!simd.eq_u32(i, j) & simd.le(a, b), i),
                        simd.splat_u32(simd.any(simd.lt(one, one)) as u32 + 2 * simd.all(simd.le(one, one)) as u32),
                    ];
                    for k in 0..16 {
                        let mut bits = [0; MAX_LANES];
                        simd.store_u32(simd.to_bits(floats[k]), &mut bits);
                        column[k].extend_from_slice(&bits[..S::LANES]);
                        simd.store_u32(integers[k], &mut bits);
                        column[16 + k].extend_from_slice(&bits[..S::LANES]);
                    }
                }
                results.extend(column.concat());
            }
            results
        }
    }

    #[test]
    fn every_level_has_the_bits_of_the_reference() {
        let reference = dispatch_at(Level::Scalar, EveryOperation);
        assert_eq!(reference.len(), 16 * 16 * 32);
        for level in Level::available() {
            assert_eq!(dispatch_at(level, EveryOperation), reference, "{}", level.name());
        }
    }

    #[test]
    fn a_bad_name_lists_the_known_ones() {
        let message = Level::from_name("mmx").unwrap_err();
        assert!(
            message.contains("TERRANE_SIMD=\"mmx\"") && message.contains("scalar, sse2, avx2, avx512"),
            "{message}"
        );
        assert_eq!(Level::from_name("scalar"), Ok(Level::Scalar));
    }
}
