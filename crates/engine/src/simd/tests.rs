//! Every level must give the bits of the reference.

use super::*;

/// Runs every operation on special and ordinary values and returns the bits of all results.
struct EveryOperation;

impl Kernel for EveryOperation {
    type Output = Vec<u32>;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Vec<u32> {
        const FLOATS: [f32; 16] =
            [0.0, -0.0, 1.0, -1.5, 2.5, 3.5, 1e-40, -1e30, 1e30, f32::INFINITY, 0.1, -0.5, 7.75, 1e6, -0.999, 123.456];
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
                    column[k].extend(bits[..S::LANES].iter().copied().map(told));
                    simd.store_u32(integers[k], &mut bits);
                    column[16 + k].extend_from_slice(&bits[..S::LANES]);
                }
            }
            results.extend(column.concat());
        }
        results
    }
}

/// Returns the bits of a float, with a fixed pattern for NaN under Miri, which chooses the bits of a NaN at random, as
/// the language allows.
fn told(bits: u32) -> u32 {
    if cfg!(miri) && f32::from_bits(bits).is_nan() { f32::NAN.to_bits() } else { bits }
}

/// To test for undefined behaviour: `cargo +nightly miri test --lib --no-default-features -- simd::`, with
/// `RUSTFLAGS="-C target-feature=+avx2"` to include AVX2.
#[test]
fn every_level_has_the_bits_of_the_reference() {
    let reference = dispatch_at(Level::Scalar, EveryOperation);
    assert_eq!(reference.len(), 16 * 16 * 32);
    for level in Level::available() {
        println!("{}", level.name());
        assert_eq!(dispatch_at(level, EveryOperation), reference, "{}", level.name());
    }
}
