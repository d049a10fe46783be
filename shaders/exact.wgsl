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
