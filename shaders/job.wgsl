// Inputs of all kernels: see src/device/gpu/bands.rs.

// Side of a workgroup in threads.
override SIDE: u32 = 8u;

struct Job {
    // Zero, which no compiler can know.
    zero: u32,
    // Number of words per block.
    block_words: u32,
    // Offset of the ground rule in `same`.
    rule: u32,
}

@group(0) @binding(0) var<uniform> job: Job;
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

// Size of the table of bands: words per band, and number of bands.
const BAND_WORDS: u32 = 16u;
const BANDS: u32 = 64u;
