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
//! # use terrane_engine as terrane;
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
#![allow(clippy::wrong_self_convention, reason = "self is the proof that the CPU has the level, not an operand")]

mod lanes;
mod level;
mod scalar;
#[cfg(target_arch = "x86_64")]
mod x86;
#[cfg(test)]
mod tests;

use std::sync::OnceLock;

pub use lanes::{MAX_LANES, Simd};
pub use level::Level;

/// Returns the starts of vectors of `lanes` values that cover `len` values. The last vector overlaps the one before:
/// the same values are written again.
pub fn starts(len: usize, lanes: usize) -> impl Iterator<Item = usize> {
    (0..len).step_by(lanes).map(move |at| at.min(len - lanes))
}

/// A computation over lanes, with its inputs and outputs as fields.
pub trait Kernel {
    /// Type of the result.
    type Output;
    /// Runs with the lanes of one level. Must be `#[inline(always)]`, see the module.
    fn run<S: Simd>(self, simd: S) -> Self::Output;
}

/// Runs a kernel at the level that [`Level::chosen`] returns.
///
/// # Panics
/// If the environment variable is invalid; call [`Level::chosen`] first to report that to a user.
pub fn dispatch<K: Kernel>(kernel: K) -> K::Output {
    // Checked once only, because a kernel may be as small as a row of pixels.
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

/// Runs a kernel at a level, which must be available.
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

/// A separate function for levels that need no target feature. Inlined into the match above, the stack frames of all
/// levels would add up, and without optimisation exceed a thread's stack.
#[inline(never)]
fn run_on<K: Kernel, S: Simd>(kernel: K, simd: S) -> K::Output {
    kernel.run(simd)
}
