// Heights of noise, one thread per vertex. Functions have the names of their counterparts in src/relief/noise.rs and
// src/noise.
//
// Compiled after job.wgsl and exact.wgsl. Every sum or product of numbers with a fraction that reaches a height uses
// add, sub and mul of exact.wgsl.

// Position of a vertex: column and row in its block, and the offset of the block's words.
struct Place {
    column: u32,
    row: u32,
    block: u32,
}

// As in lattice.rs.

const LANE_FRACTION_BITS: u32 = 23u;
const LANE_FRACTION: u32 = 0x7fffffu;

fn hash_gradient(u: u32, v: u32) -> u32 {
    let both = (u * 0x9e3779b1u) ^ (v * 0x85ebca77u);
    let once = (both ^ (both >> 16u)) * 0x7feb352du;
    let twice = (once ^ (once >> 15u)) * 0x846ca68bu;
    return twice >> 28u;
}

// Offsets in the words of an octave: see src/noise/gpu_words.rs.
const OCTAVE_WORDS: u32 = 136u;
const BLOCK_AT: u32 = 1u;
const OFFSET: u32 = 2u;
const AMPLITUDE: u32 = 3u;
const METRES: u32 = 4u;
const GRADIENTS: u32 = 8u;
const COLUMNS: u32 = 40u;
const ROWS: u32 = 104u;

fn bump(t: f32, slope: f32) -> f32 {
    let above = max(t, 0.0);
    let t2 = mul(above, above);
    return mul(mul(t2, t2), slope);
}

// Returns the bump of the lattice point (u, v), whose gradient is stored with the octave.
fn lattice_bump(octave: u32, t: f32, u: u32, v: u32, du: f32, dv: f32) -> f32 {
    let gradient = octave + GRADIENTS + hash_gradient(u, v);
    return bump(t, add(mul(same_f32(gradient), du), mul(same_f32(gradient + 16u), dv)));
}

// As in splat.rs.

const POINT_ROWS: i32 = 5;
const POINT_COLUMNS: i32 = 6;
const POINT_ROW_WORDS: u32 = 20u;
const SQRT_2: f32 = 1.4142135;
// 1 / EDGE of lattice.rs.
const POINTS_A_UNIT: f32 = 1.2247449;
// Largest distance of a point that reaches a vertex, in rows of points, plus a little more than the rounding error.
const REACH_ROWS: f32 = 1.0002;

fn splat_noise(octave: u32, place: Place) -> f32 {
    let at = place.block + same[octave + BLOCK_AT];
    let x = same_f32(octave + COLUMNS + place.column);
    let y = same_f32(octave + ROWS + place.row);
    let row = own_f32(at) + y * SQRT_2;
    // Adds only the bumps that reach the vertex, in the order of rows and columns; all others are zero. The rounded
    // numbers here only select points.
    let last_row = min(i32(floor(row + REACH_ROWS)), POINT_ROWS - 1);
    var sum = 0.0;
    for (var r = max(i32(ceil(row - REACH_ROWS)), 0); r <= last_row; r += 1) {
        let row_at = at + 1u + u32(r) * POINT_ROW_WORDS;
        let dy = add(y, own_f32(row_at));
        let base = sub(0.5, mul(dy, dy));
        let first = i32(floor(own_f32(row_at + 1u) + x * POINTS_A_UNIT));
        let last = min(first + 1, POINT_COLUMNS - 1);
        for (var c = max(first, 0); c <= last; c += 1) {
            let point = row_at + 2u + u32(c) * 3u;
            let dx = add(x, own_f32(point));
            let t = sub(base, mul(dx, dx));
            let slope = add(mul(dx, own_f32(point + 1u)), mul(dy, own_f32(point + 2u)));
            sum = add(sum, bump(t, slope));
        }
    }
    return sum;
}

// As in rows.rs.

fn row_bump(octave: u32, u: u32, v: u32, du: f32, dv: f32, base: f32) -> f32 {
    return lattice_bump(octave, sub(base, mul(du, du)), u, v, du, dv);
}

// Returns the sum of the bumps of one row of points: 0 is the northern row, 1 the southern.
fn row_bumps(octave: u32, at: u32, side: u32, column: u32) -> f32 {
    let v = own[at] + side;
    let side_at = at + 1u + 4u * side;
    let dv = own_f32(side_at + 2u);
    let base = own_f32(side_at + 3u);
    let along = same[octave + COLUMNS + column] + own[side_at + 1u];
    let u = own[side_at] + (along >> LANE_FRACTION_BITS);
    // Puts the fraction into the mantissa of a float from 1 to 2.
    let from_one = bitcast<f32>((along & LANE_FRACTION) | 0x3f800000u);
    let west = row_bump(octave, u, v, sub(from_one, 1.0), dv, base);
    let east = row_bump(octave, u + 1u, v, sub(from_one, 2.0), dv, base);
    return add(west, east);
}

fn row_wise_noise(octave: u32, place: Place) -> f32 {
    let at = place.block + same[octave + BLOCK_AT] + 9u * place.row;
    return add(row_bumps(octave, at, 0u, place.column), row_bumps(octave, at, 1u, place.column));
}

// As in simplex.rs.

fn noise_in_cells(octave: u32, u: u32, v: u32, cell_u: u32, cell_v: u32) -> f32 {
    // Puts the fraction into the mantissa of a float from 2 to 4.
    let from_two_u = bitcast<f32>((u & LANE_FRACTION) | 0x40000000u);
    let from_two_v = bitcast<f32>((v & LANE_FRACTION) | 0x40000000u);
    let uu = sub(from_two_u, 3.0);
    let vv = sub(from_two_v, 3.0);
    let east_u = sub(from_two_u, 2.0);
    let west_u = sub(from_two_u, 4.0);
    let east_v = sub(from_two_v, 2.0);
    let west_v = sub(from_two_v, 4.0);
    let difference = sub(uu, vv);
    let sum = add(uu, vv);
    let e = add(mul(difference, difference), mul(uu, vv));
    let two_less_e = sub(2.0, e);
    let t0 = sub(two_less_e, sum);
    let t1 = sub(mul(abs(difference), 3.0), e);
    let t2 = add(two_less_e, sum);
    // The third corner is (1, 0) in one triangle of the square and (0, 1) in the other.
    let u_first = difference >= 0.0;
    let middle_u = select(cell_u, cell_u + 1u, u_first);
    let middle_v = select(cell_v + 1u, cell_v, u_first);
    let bump0 = lattice_bump(octave, t0, cell_u, cell_v, east_u, east_v);
    let bump1 =
        lattice_bump(octave, t1, middle_u, middle_v, select(east_u, west_u, u_first), select(west_v, east_v, u_first));
    let bump2 = lattice_bump(octave, t2, cell_u + 1u, cell_v + 1u, west_u, west_v);
    return add(add(bump0, bump1), bump2);
}

fn simplex_noise(octave: u32, place: Place) -> f32 {
    let at = place.block + same[octave + BLOCK_AT] + 4u * place.row;
    let u = same[octave + COLUMNS + place.column] + own[at + 2u];
    let v = own[at + 3u];
    return noise_in_cells(octave, u, v, own[at] + (u >> LANE_FRACTION_BITS), own[at + 1u]);
}

// A number of cells: the whole cells, and the rest in the fixed point of positions, at most half a cell either way.
struct Split {
    whole: i32,
    rest: i32,
}

fn split(cells: f32) -> Split {
    let whole = round(cells);
    return Split(i32(whole), i32(round(mul(sub(cells, whole), 8388608.0))));
}

fn noise_warped(octave: u32, place: Place, displaced_m: vec2<f32>) -> f32 {
    let at = place.block + same[octave + BLOCK_AT] + 4u * place.row;
    let metres = octave + METRES;
    let split_u = split(add(
        mul(displaced_m.x, same_f32(metres)),
        mul(displaced_m.y, same_f32(metres + 1u)),
    ));
    let split_v = split(mul(displaced_m.y, same_f32(metres + 2u)));
    let u = bitcast<i32>(same[octave + COLUMNS + place.column] + own[at + 2u]) + split_u.rest;
    let v = bitcast<i32>(own[at + 3u]) + split_v.rest;
    // Signed, because a displacement may lead back to before the row's first cell.
    let cell_u = own[at] + bitcast<u32>((u >> LANE_FRACTION_BITS) + split_u.whole);
    let cell_v = own[at + 1u] + bitcast<u32>((v >> LANE_FRACTION_BITS) + split_v.whole);
    return noise_in_cells(octave, bitcast<u32>(u), bitcast<u32>(v), cell_u, cell_v);
}

// As in fractal.rs and fold.rs.

const FBM: u32 = 0u;
const RIDGED: u32 = 1u;
const HYBRID: u32 = 2u;

fn octave_noise(octave: u32, place: Place, displaced_m: vec2<f32>) -> f32 {
    switch same[octave] {
        case 0u: {
            return splat_noise(octave, place);
        }
        case 1u: {
            return row_wise_noise(octave, place);
        }
        case 2u: {
            return simplex_noise(octave, place);
        }
        default: {
            return noise_warped(octave, place, displaced_m);
        }
    }
}

// Adds up the octaves; `value` and `weight` are carried from octave to octave, like `State` in fold.rs.
fn fractal(at: u32, place: Place, displaced_m: vec2<f32>) -> f32 {
    let kind = same[at];
    let count = same[at + 1u];
    var value = 0.0;
    var weight = 0.0;
    for (var index = 0u; index < count; index += 1u) {
        let octave = at + 2u + index * OCTAVE_WORDS;
        let noise = octave_noise(octave, place, displaced_m);
        let offset = same_f32(octave + OFFSET);
        let amplitude = same_f32(octave + AMPLITUDE);
        if kind == FBM {
            value = select(add(value, noise), noise, index == 0u);
        } else if kind == RIDGED {
            let ridge = sub(offset, abs(noise));
            var signal = mul(ridge, ridge);
            if index != 0u {
                signal = mul(signal, weight);
            }
            let raised = mul(signal, amplitude);
            value = select(add(value, raised), raised, index == 0u);
            weight = min(signal, 1.0);
        } else {
            let lifted = add(noise, offset);
            if index == 0u {
                value = lifted;
                weight = lifted;
            } else if kind == HYBRID {
                weight = mul(min(weight, 1.0), lifted);
                value = add(value, weight);
            } else {
                value = add(value, mul(lifted, value));
            }
        }
    }
    return value;
}

// As in strided.rs: a fractal, and its correction to the mean of all octaves.

const MEAN_WORDS: u32 = 5u;

fn strided_fractal(at: u32, place: Place, displaced_m: vec2<f32>) -> f32 {
    let value = fractal(at + MEAN_WORDS, place, displaced_m);
    if same[at] == 0u {
        return value;
    }
    let moved = add(mul(value, same_f32(at + 1u)), same_f32(at + 2u));
    return clamp(moved, same_f32(at + 3u), same_f32(at + 4u));
}

// As in curve.rs.

fn curve(at: u32, value: f32) -> f32 {
    var sum = same_f32(at);
    let count = same[at + 3u];
    for (var index = 0u; index < count; index += 1u) {
        let ramp = at + 4u + 3u * index;
        let climbed = clamp(sub(value, same_f32(ramp)), 0.0, same_f32(ramp + 1u));
        sum = add(sum, mul(climbed, same_f32(ramp + 2u)));
    }
    return clamp(sum, same_f32(at + 1u), same_f32(at + 2u));
}

// As in noise.rs.

fn share(at: u32, place: Place, displaced_m: vec2<f32>) -> f32 {
    let noise = strided_fractal(at + 2u, place, displaced_m);
    let t = clamp(add(mul(noise, same_f32(at)), same_f32(at + 1u)), 0.0, 1.0);
    return mul(mul(t, t), sub(3.0, mul(2.0, t)));
}

const TERM_WORDS: u32 = 5u;

// Returns the height of a vertex in the relief whose words begin at `at`.
fn height(at: u32, place: Place) -> f32 {
    var displaced_m = vec2(0.0, 0.0);
    if same[at] != 0u {
        let distance_m = same_f32(at + 2u);
        displaced_m = vec2(
            mul(strided_fractal(same[at], place, displaced_m), distance_m),
            mul(strided_fractal(same[at + 1u], place, displaced_m), distance_m),
        );
    }
    let count = same[at + 5u];
    var height = 0.0;
    for (var index = 0u; index < count; index += 1u) {
        let term = at + 6u + TERM_WORDS * index;
        var value = strided_fractal(same[term], place, displaced_m);
        if same[term + 1u] != 0u {
            value = curve(same[term + 1u], value);
        }
        value = add(mul(value, same_f32(term + 2u)), same_f32(term + 3u));
        if same[term + 4u] != 0u {
            value = mul(value, share(same[term + 4u], place, displaced_m));
        }
        height = select(add(height, value), value, index == 0u);
    }
    if same[at + 3u] != 0u {
        let floor_m = same_f32(at + 4u);
        height = add(floor_m, mul(sub(height, floor_m), share(same[at + 3u], place, displaced_m)));
    }
    return height;
}

// Makes the heights of a block. Its words begin with the position of its first vertex in its area, the size of the
// area, the offset of the area's heights, and the offset of the relief.
@compute @workgroup_size(SIDE, SIDE)
fn fill(@builtin(global_invocation_id) id: vec3<u32>) {
    let block = BANDS * BAND_WORDS + id.z * job.block_words;
    let column = bitcast<i32>(own[block]) + i32(id.x);
    let row = bitcast<i32>(own[block + 1u]) + i32(id.y);
    let width = i32(own[block + 2u]);
    if column < 0 || row < 0 || column >= width || row >= i32(own[block + 3u]) {
        return;
    }
    put_f32(own[block + 4u] + u32(row * width + column), height(own[block + 5u], Place(id.x, id.y, block)));
}
