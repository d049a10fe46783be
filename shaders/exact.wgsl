// Arithmetic of which no compiler knows what comes out, so that it neither fuses nor reorders: the bits of the CPU.
//
// Based on: the measurements in this project's notes on wgpu; a uniform that is zero is xor-ed to the bits of each result.

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

// The fraction of a float with its leading one, 24 bits.
fn significand(bits: u32) -> u32 {
    return (bits & FRACTION) | LEADING;
}

// A quotient, which a GPU may round to one of several numbers nearby. Of normal numbers whose quotient is greater than the
// least of them, or of 0; of others what the GPU makes of it.
//
// What is left of the dividend once the divisor was taken from it so many times is a whole number of few bits, so it is right
// whatever is lost above 32, and tells by how much the quotient is off.
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
    // From 2^23 up to 2^24.
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
    // Never just between two floats.
    if 2 * rest > i32(divisor) {
        whole += 1u;
    }
    // What is rounded up to 2^24 goes on into the exponent.
    let bits = (u32(exponent) << 23u) + (whole - LEADING);
    return bitcast<f32>(bits | ((a_bits ^ b_bits) & 0x80000000u));
}

// A square root, likewise: of normal numbers above 0; of others, what the GPU makes of it.
fn root(value: f32) -> f32 {
    let bits = bitcast<u32>(value);
    let exponent = (bits >> 23u) & EXPONENT;
    if bits >= 0x7f800000u || exponent == 0u {
        return sqrt(value);
    }
    // An even power of two, times a whole number from 2^23 up to 2^25.
    var square = significand(bits);
    let power = i32(exponent) - 127;
    if (power & 1) != 0 {
        square = square << 1u;
    }
    // From 2^23 up to 2^24.
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
