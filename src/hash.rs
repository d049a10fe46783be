//! The only source of chance: everything random is a hash of the seed and of what it is for, never of a history.

/// A well-mixed function of `value`: each bit of the input changes each bit of the output about half of the time.
///
/// Based on: the finaliser of SplitMix64 with the constants of Stafford's "Mix13".
pub const fn mix(value: u64) -> u64 {
    let mut z = value;
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

/// The seed of one stream of chance (a noise term, say), independent of the seeds of all other streams.
pub const fn stream(seed: u64, stream: u64) -> u64 {
    // The golden ratio's bits keep small numbers, which seeds and streams mostly are, from cancelling out.
    const GOLDEN: u64 = 0x9E37_79B9_7F4A_7C15;
    mix(mix(seed.wrapping_add(GOLDEN)) ^ stream.wrapping_mul(GOLDEN))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_bit_of_seed_or_stream_changes_half_of_the_bits() {
        let mut flipped = 0;
        for bit in 0..64 {
            for n in 0..64 {
                flipped += (stream(n, 3) ^ stream(n ^ (1 << bit), 3)).count_ones();
                flipped += (stream(3, n) ^ stream(3, n ^ (1 << bit))).count_ones();
            }
        }
        let mean = flipped as f64 / (2.0 * 64.0 * 64.0);
        assert!((mean - 32.0).abs() < 0.5, "{mean} of 64 bits change on average");
    }
}
