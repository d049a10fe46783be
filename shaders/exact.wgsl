// Arithmetic with the bits of the CPU. Its results are opaque to the compiler, which therefore can neither fuse nor
// reorder operations.
//
// Based on: the measurements in this project's notes on wgpu. The bits of each result are xor-ed with a uniform that is
// zero.

fn opaque(value: f32) -> f32 {
    return bitcast<f32>(bitcast<u32>(value) ^ job.zero);
}

fn add(a: f32, b: f32) -> f32 {
    return opaque(a + b);
}

fn sub(a: f32, b: f32) -> f32 {
    return opaque(a - b);
}

fn mul(a: f32, b: f32) -> f32 {
    return opaque(a * b);
}

const EXPONENT: u32 = 0xffu;
const FRACTION: u32 = 0x7fffffu;
const LEADING: u32 = 0x800000u;

// Returns the fraction of a float with its leading one, 24 bits.
fn significand(bits: u32) -> u32 {
    return (bits & FRACTION) | LEADING;
}

// Divides with the correct rounding of the CPU, although a GPU may round a quotient to one of several numbers nearby.
// This holds for normal numbers whose quotient is greater than the least normal number, and for a dividend of 0; for
// all others the result is that of the GPU.
//
// The remainder (dividend minus quotient times divisor) is a small whole number, so it is exact even though the bits
// above 32 are lost. It tells by how much the quotient is off.
fn div(a: f32, b: f32) -> f32 {
    let quotient = a / b;
    let a_bits = bitcast<u32>(a);
    let b_bits = bitcast<u32>(b);
    let a_exponent = (a_bits >> 23u) & EXPONENT;
    let b_exponent = (b_bits >> 23u) & EXPONENT;
    let divisor = significand(b_bits);
    var dividend = significand(a_bits);
    var exponent = i32(a_exponent) - i32(b_exponent) + 127;
    if dividend < divisor {
        dividend = dividend << 1u;
        exponent -= 1;
    }
    if a_exponent == 0u || a_exponent == EXPONENT || b_exponent == 0u || b_exponent == EXPONENT || exponent < 1 || exponent > 253 {
        return quotient;
    }
    // Approximates the quotient times 2^23 (from 2^23 up to 2^24) as a whole number.
    var whole = u32(f32(dividend) / f32(divisor) * 8388608.0);
    var rest = bitcast<i32>((dividend << 23u) - whole * divisor);
    let off = i32(floor(f32(rest) / f32(divisor)));
    whole += bitcast<u32>(off);
    rest -= off * i32(divisor);
    if rest < 0 {
        whole -= 1u;
        rest += i32(divisor);
    }
    if rest >= i32(divisor) {
        whole += 1u;
        rest -= i32(divisor);
    }
    // A quotient never lies exactly between two floats, so there are no ties.
    if 2 * rest > i32(divisor) {
        whole += 1u;
    }
    // Rounding up to 2^24 carries into the exponent.
    let bits = (u32(exponent) << 23u) + (whole - LEADING);
    return bitcast<f32>(bits | ((a_bits ^ b_bits) & 0x80000000u));
}

// Computes a square root in the same way: with correct rounding for normal numbers above 0; for all others the result
// is that of the GPU.
fn root(value: f32) -> f32 {
    let bits = bitcast<u32>(value);
    let exponent = (bits >> 23u) & EXPONENT;
    if bits >= 0x7f800000u || exponent == 0u {
        return sqrt(value);
    }
    // The number is an even power of two times `square`, a whole number from 2^23 up to 2^25.
    var square = significand(bits);
    let power = i32(exponent) - 127;
    if (power & 1) != 0 {
        square = square << 1u;
    }
    // Approximates the root of `square` times 2^11.5 (from 2^23 up to 2^24) as a whole number.
    var whole = u32(sqrt(f32(square)) * 2896.3093);
    var rest = bitcast<i32>((square << 23u) - whole * whole);
    let off = i32(floor(f32(rest) / f32(2u * whole)));
    whole += bitcast<u32>(off);
    rest = bitcast<i32>((square << 23u) - whole * whole);
    if rest < 0 {
        whole -= 1u;
        rest += bitcast<i32>(2u * whole + 1u);
    }
    if rest > bitcast<i32>(2u * whole) {
        rest -= bitcast<i32>(2u * whole + 1u);
        whole += 1u;
    }
    if rest > bitcast<i32>(whole) {
        whole += 1u;
    }
    return bitcast<f32>((u32((power >> 1u) + 127) << 23u) + (whole - LEADING));
}
