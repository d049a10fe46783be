// What all kernels of tiles are given: src/device/gpu/job.rs.

// The side of a workgroup.
override SIDE: u32 = 8u;

struct Job {
    // Zero, which no compiler knows.
    zero: u32,
    // Words of a block.
    block_words: u32,
    // Where the rule of the ground begins among what is the same for all.
    rule: u32,
}

@group(0) @binding(0) var<uniform> job: Job;
// What is the same for all: the relief and the rule of the ground.
@group(0) @binding(1) var<storage, read> same: array<u32>;
// What bands of rows have for themselves, then what blocks have, then lines.
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

// Words of what bands have for themselves: of so many bands.
const BAND_WORDS: u32 = 16u;
const BANDS: u32 = 64u;
