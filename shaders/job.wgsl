// Inputs of all kernels: see src/device/gpu/bands.rs. Structs and constants that Rust has too come before this file: see
// src/wgsl.rs.

// Side of a workgroup in threads.
override SIDE: u32 = 8u;

@group(0) @binding(0) var<uniform> job: KernelJob;
// Words that are the same for all submissions: the relief and the ground rule.
@group(0) @binding(1) var<storage, read> same: array<u32>;
// Words of this submission: the table of bands, then blocks, then lines.
@group(0) @binding(2) var<storage, read> own: array<u32>;
// Values at vertices, plane after plane: whole numbers, or the bits of floats.
@group(0) @binding(3) var<storage, read_write> planes: array<u32>;

fn same_f32(at: u32) -> f32 {
    return bitcast<f32>(same[at]);
}

fn own_f32(at: u32) -> f32 {
    return bitcast<f32>(own[at]);
}

fn plane_f32(at: u32) -> f32 {
    return bitcast<f32>(planes[at]);
}

fn put_f32(at: u32, value: f32) {
    planes[at] = bitcast<u32>(value);
}
