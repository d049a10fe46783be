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

fn hash_gradient(u: u32, v: u32) -> u32 {
    let both = (u * HASH_U) ^ (v * HASH_V);
    let once = (both ^ (both >> 16u)) * HASH_ONCE;
    let twice = (once ^ (once >> 15u)) * HASH_TWICE;
    return twice >> 28u;
}

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

// Largest distance of a point that reaches a vertex, in rows of points, plus a little more than the rounding error.
const REACH_ROWS: f32 = 1.0002;

fn splat_noise(octave: u32, place: Place) -> f32 {
    let at = place.block + same_OctaveWords(octave).block_at;
    let x = same_f32(octave + COLUMNS + place.column);
    let y = same_f32(octave + ROWS + place.row);
    let row = own_f32(at) + y * V_SOUTH;
    // Adds only the bumps that reach the vertex, in the order of rows and columns; all others are zero. The rounded
    // numbers here only select points.
    let last_row = min(i32(floor(row + REACH_ROWS)), POINT_ROWS - 1);
    var sum = 0.0;
    for (var r = max(i32(ceil(row - REACH_ROWS)), 0); r <= last_row; r += 1) {
        let row_at = at + 1u + u32(r) * POINT_ROW_WORDS;
        let points = own_PointRowWords(row_at);
        let dy = add(y, points.dy);
        let base = sub(0.5, mul(dy, dy));
        let first = i32(floor(points.x + x * U_EAST));
        let last = min(first + 1, POINT_COLUMNS - 1);
        for (var c = max(first, 0); c <= last; c += 1) {
            let point = own_PointWords(row_at + POINT_ROW_START + u32(c) * POINT_WORDS);
            let dx = add(x, point.dx);
            let t = sub(base, mul(dx, dx));
            let slope = add(mul(dx, point.gradient.x), mul(dy, point.gradient.y));
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
    let points = own_SideWords(at + 1u + SIDE_WORDS * side);
    let along = same[octave + COLUMNS + column] + points.along;
    let u = points.u + (along >> LANE_FRACTION_BITS);
    // Puts the fraction into the mantissa of a float from 1 to 2.
    let from_one = bitcast<f32>((along & LANE_FRACTION) | 0x3f800000u);
    let west = row_bump(octave, u, v, sub(from_one, 1.0), points.dv, points.base);
    let east = row_bump(octave, u + 1u, v, sub(from_one, 2.0), points.dv, points.base);
    return add(west, east);
}

fn row_wise_noise(octave: u32, place: Place) -> f32 {
    let at = place.block + same_OctaveWords(octave).block_at + BETWEEN_WORDS * place.row;
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

fn row_start(octave: u32, place: Place) -> StartWords {
    return own_StartWords(place.block + same_OctaveWords(octave).block_at + START_WORDS * place.row);
}

fn simplex_noise(octave: u32, place: Place) -> f32 {
    let start = row_start(octave, place);
    let u = same[octave + COLUMNS + place.column] + start.fraction.x;
    let v = start.fraction.y;
    return noise_in_cells(octave, u, v, start.cell.x + (u >> LANE_FRACTION_BITS), start.cell.y);
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
    let start = row_start(octave, place);
    let metres = same_OctaveWords(octave).metres;
    let split_u = split(add(mul(displaced_m.x, metres.x), mul(displaced_m.y, metres.y)));
    let split_v = split(mul(displaced_m.y, metres.z));
    let u = bitcast<i32>(same[octave + COLUMNS + place.column] + start.fraction.x) + split_u.rest;
    let v = bitcast<i32>(start.fraction.y) + split_v.rest;
    // Signed, because a displacement may lead back to before the row's first cell.
    let cell_u = start.cell.x + bitcast<u32>((u >> LANE_FRACTION_BITS) + split_u.whole);
    let cell_v = start.cell.y + bitcast<u32>((v >> LANE_FRACTION_BITS) + split_v.whole);
    return noise_in_cells(octave, bitcast<u32>(u), bitcast<u32>(v), cell_u, cell_v);
}

// As in fractal.rs and fold.rs.

fn octave_noise(octave: u32, place: Place, displaced_m: vec2<f32>) -> f32 {
    switch same_OctaveWords(octave).method {
        case SPLAT: {
            return splat_noise(octave, place);
        }
        case ROW_WISE: {
            return row_wise_noise(octave, place);
        }
        case SIMPLEX: {
            return simplex_noise(octave, place);
        }
        default: {
            return noise_warped(octave, place, displaced_m);
        }
    }
}

// Adds up the octaves; `value` and `weight` are carried from octave to octave, like `State` in fold.rs.
fn fractal(at: u32, place: Place, displaced_m: vec2<f32>) -> f32 {
    let kind = same_FractalWords(at).kind;
    let count = same_FractalWords(at).octaves;
    var value = 0.0;
    var weight = 0.0;
    for (var index = 0u; index < count; index += 1u) {
        let octave = at + FRACTAL_WORDS + index * OCTAVE_WORDS;
        let step = same_OctaveWords(octave);
        let noise = octave_noise(octave, place, displaced_m);
        if kind == FBM {
            value = select(add(value, noise), noise, index == 0u);
        } else if kind == RIDGED {
            let ridge = sub(step.offset, abs(noise));
            var signal = mul(ridge, ridge);
            if index != 0u {
                signal = mul(signal, weight);
            }
            let raised = mul(signal, step.amplitude);
            value = select(add(value, raised), raised, index == 0u);
            weight = min(signal, 1.0);
        } else {
            let lifted = add(noise, step.offset);
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

fn strided_fractal(at: u32, place: Place, displaced_m: vec2<f32>) -> f32 {
    let value = fractal(at + MEAN_WORDS, place, displaced_m);
    let mean = same_MeanWords(at);
    if mean.is_meant == 0u {
        return value;
    }
    return clamp(add(mul(value, mean.scale), mean.shift), mean.low, mean.high);
}

// As in curve.rs.

fn curve(at: u32, value: f32) -> f32 {
    let curve = same_CurveWords(at);
    var sum = curve.start;
    for (var index = 0u; index < curve.ramps; index += 1u) {
        let ramp = same_RampWords(at + CURVE_WORDS + RAMP_WORDS * index);
        sum = add(sum, mul(clamp(sub(value, ramp.begin), 0.0, ramp.width), ramp.slope));
    }
    return clamp(sum, curve.low, curve.high);
}

// As in noise.rs.

fn share(at: u32, place: Place, displaced_m: vec2<f32>) -> f32 {
    let mask = same_ShareWords(at);
    let noise = strided_fractal(at + SHARE_WORDS, place, displaced_m);
    let t = clamp(add(mul(noise, mask.scale), mask.shift), 0.0, 1.0);
    return mul(mul(t, t), sub(3.0, mul(2.0, t)));
}

// Returns the height of a vertex in the relief whose words begin at `at`.
fn height(at: u32, place: Place) -> f32 {
    let relief = same_ReliefWords(at);
    var displaced_m = vec2(0.0, 0.0);
    if relief.east != 0u {
        displaced_m = vec2(
            mul(strided_fractal(relief.east, place, displaced_m), relief.distance_m),
            mul(strided_fractal(relief.south, place, displaced_m), relief.distance_m),
        );
    }
    var height = 0.0;
    for (var index = 0u; index < relief.terms; index += 1u) {
        let term = same_TermWords(at + RELIEF_WORDS + TERM_WORDS * index);
        var value = strided_fractal(term.fractal, place, displaced_m);
        if term.curve != 0u {
            value = curve(term.curve, value);
        }
        value = add(mul(value, term.height_m), term.base_m);
        if term.mask != 0u {
            value = mul(value, share(term.mask, place, displaced_m));
        }
        height = select(add(height, value), value, index == 0u);
    }
    if relief.land != 0u {
        let above_m = sub(height, relief.floor_m);
        height = add(relief.floor_m, mul(above_m, share(relief.land, place, displaced_m)));
    }
    return height;
}

// Makes the heights of a block.
@compute @workgroup_size(SIDE, SIDE)
fn fill(@builtin(global_invocation_id) id: vec3<u32>) {
    let at = TABLE + id.z * job.block_words;
    let block = own_BlockWords(at);
    let column = block.first.x + i32(id.x);
    let row = block.first.y + i32(id.y);
    let width = i32(block.width);
    if column < 0 || row < 0 || column >= width || row >= i32(block.height) {
        return;
    }
    put_f32(block.heights + u32(row * width + column), height(block.relief, Place(id.x, id.y, at)));
}
