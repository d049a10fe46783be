// Valleys, the gullies in their sides and the coast, a thread a node: valley.rs, valley_side.rs, rest.rs, gullies.rs and coast.rs of
// src/fluvial and src/noise/stripes.rs, whose functions have the same names here.
//
// After job.wgsl, and exact.wgsl or approximate.wgsl, whose add, sub, mul, div and root are all that is done to numbers with a
// fraction.

// The words of a job, in place of bands: src/device/gpu/fluvial.rs.
const WIDTH: u32 = 0u;
const HEIGHT: u32 = 1u;
// The part whose valleys are made, from its first column and row to behind its last.
const PART: u32 = 2u;
// How far the first node of all is from the corner of its block of patches; and blocks of the part: where they begin, counted from that
// one, and how many are beside each other.
const IN_BLOCK: u32 = 6u;
const BLOCKS_FROM: u32 = 8u;
const BLOCKS_ACROSS: u32 = 10u;
// Where slopes, segments and the lists of blocks begin, and the blocks of the stripes of each octave, and how many words each has.
const SLOPES: u32 = 11u;
const SEGMENTS: u32 = 12u;
const LISTS: u32 = 13u;
const STRIPES: u32 = 14u;
// Whether brooks are not seen: then slopes are followed by the two numbers of rest.rs at each node.
const HAS_REST: u32 = 20u;
// How far inland the points of a lattice are: where that begins, its columns, and by how many cells it begins before that of the first
// node along each axis; how far that node is from the corner of its cell, vertices from a node to the next, and those of a cell. 0
// without a sea.
const INLAND: u32 = 21u;
const INLAND_COLUMNS: u32 = 22u;
const CELLS_BEFORE: u32 = 23u;
const IN_CELL: u32 = 25u;
const STEP: u32 = 27u;
const CELL: u32 = 28u;
// Numbers of the coast.
const PER_VERTEX: u32 = 29u;
const LOWSTAND_M: u32 = 30u;
const LAND_SLOPE: u32 = 31u;
const SHELF_SLOPE: u32 = 32u;
const DEEPEST_M: u32 = 33u;
const SHORE_M: u32 = 34u;
const SEA_LEVEL_M: u32 = 35u;

// The planes, in their order: those first that come back.
const EAST: u32 = 0u;
const SOUTH: u32 = 1u;
const HEIGHT_M: u32 = 2u;
const CREST_M: u32 = 3u;
const DISTANCE_M: u32 = 4u;
const SHARE: u32 = 5u;
const SEGMENT: u32 = 6u;
const COAST_M: u32 = 7u;
const LEVEL_M: u32 = 8u;
const STEEPNESS: u32 = 9u;
const FALL_X: u32 = 10u;
const FALL_Y: u32 = 11u;
const FOOT_M: u32 = 12u;
// What is smoothed goes there and back; before there is a fall line, the first two have the way in which the land rises.
const ROOM: u32 = 13u;
const CARVED: u32 = 16u;
const PATCHES: u32 = 17u;
const ROUGH: u32 = 18u;

// The numbers that are the same for all nodes.
const SPACING_M: u32 = 0u;
const MOST_CREST_M: u32 = 1u;
const READ_M: u32 = 2u;
const TERRACES: u32 = 3u;
const LEVEL_HALF_M: u32 = 4u;
const LEVEES: u32 = 5u;
const PER_TERRACE: u32 = 6u;
const LEVEL_SHARE: u32 = 7u;
const ROUND_SHARE: u32 = 8u;
const LEVEE_ROOM: u32 = 9u;
const LEVEE_FOOT: u32 = 10u;
const LEVEE_FALLS: u32 = 11u;
const LEVEE_RISES: u32 = 12u;
const SINE_1: u32 = 13u;
const SINE_0: u32 = 14u;
const COSINE_0: u32 = 15u;
const SINE_2: u32 = 16u;
const BOTH_2: u32 = 17u;
const TURNS: u32 = 18u;
const PER_METRE: u32 = 19u;
const ROUGH_M: u32 = 20u;
const UNSEEN: u32 = 21u;
const UNSEEN_M: u32 = 22u;
const OCTAVES: u32 = 25u;
const OCTAVE_WORDS: u32 = 68u;

fn the_f32(at: u32) -> f32 {
    return same_f32(job.rule + at);
}

fn nodes() -> u32 {
    return own[WIDTH] * own[HEIGHT];
}

fn node_f32(plane: u32, node: u32) -> f32 {
    return plane_f32(plane * nodes() + node);
}

fn put_node(plane: u32, node: u32, value: f32) {
    put_f32(plane * nodes() + node, value);
}

// valley_side.rs: a segment in its words.

const SEGMENT_WORDS: u32 = 23u;
const ALONG: u32 = 0u;
const PER_SQUARE: u32 = 2u;
const LEVEL: u32 = 3u;
const CROSS: u32 = 5u;
const TROUGH: u32 = 7u;
const LEAN: u32 = 9u;
const RIVER: u32 = 11u;
const FLOOD_PLAIN: u32 = 13u;
const RISER: u32 = 15u;
const BED_CHANGE: u32 = 17u;
const FLOOR_CHANGE: u32 = 18u;
const CROSS_CHANGE: u32 = 19u;
const SEGMENT_REACH: u32 = 20u;
const POOL: u32 = 21u;
const CHANNEL: u32 = 22u;

const LEAST_M: f32 = 1e-3;
const CROSS_FALL: f32 = 0.02;
const FLOOR_FALL: f32 = 0.001;
const FAR: f32 = 0.8;
const FAR_STEEPER: f32 = 1.5;

struct Side {
    level: f32,
    rise: f32,
    cross: f32,
    floor: f32,
    bed: vec2<f32>,
    off: vec2<f32>,
    distance: f32,
    share: f32,
}

// The value at a share of the way from the upper end of a segment to the lower one.
fn along(at: u32, share: f32) -> f32 {
    return add(own_f32(at), mul(own_f32(at + 1u), share));
}

fn side(segment: u32, begin: vec2<f32>, at: vec2<f32>) -> Side {
    let way = vec2(own_f32(segment + ALONG), own_f32(segment + ALONG + 1u));
    let per_square = own_f32(segment + PER_SQUARE);
    let to = vec2(sub(at.x, begin.x), sub(at.y, begin.y));
    let share = clamp(mul(add(mul(to.x, way.x), mul(to.y, way.y)), per_square), 0.0, 1.0);
    let off = vec2(sub(to.x, mul(way.x, share)), sub(to.y, mul(way.y, share)));
    let square = add(mul(off.x, off.x), mul(off.y, off.y));
    let trough = along(segment + TROUGH, share);
    let lean = along(segment + LEAN, share);
    let river = along(segment + RIVER, share);
    let distance = root(square);
    let cross = along(segment + CROSS, share);
    let dry = max(sub(distance, river), 0.0);
    let level = mul(trough, the_f32(LEVEL_SHARE));
    let beyond = max(sub(distance, max(river, level)), 0.0);
    let round = mul(trough, the_f32(ROUND_SHARE));
    let hypotenuse = root(add(mul(beyond, beyond), mul(round, round)));
    var risen = sub(hypotenuse, round);
    let straight = div(beyond, max(hypotenuse, 1e-3));
    let terraces = same[job.rule + TERRACES];
    if terraces > 0u {
        let flood_plain = max(along(segment + FLOOD_PLAIN, share), river);
        let tread = mul(max(sub(level, flood_plain), 0.0), the_f32(PER_TERRACE));
        let riser = min(along(segment + RISER, share), tread);
        for (var step = 0u; step < terraces; step += 1u) {
            let up = max(sub(sub(distance, flood_plain), mul(tread, f32(step))), 0.0);
            risen = add(risen, min(up, riser));
        }
    }
    if the_f32(LEVEES) > 0.0 {
        let room = mul(max(sub(level, river), 0.0), the_f32(LEVEE_ROOM));
        let height = min(mul(river, the_f32(LEVEES)), room);
        let behind = sub(dry, mul(height, the_f32(LEVEE_FOOT)));
        let falling = sub(height, mul(behind, the_f32(LEVEE_FALLS)));
        risen = add(risen, max(min(mul(dry, the_f32(LEVEE_RISES)), falling), 0.0));
    }
    var rise = mul(add(risen, mul(lean, sub(dry, risen))), cross);
    let sideways = mul(sub(min(distance, river), the_f32(LEVEL_HALF_M)), CROSS_FALL);
    rise = add(rise, max(sideways, mul(distance, FLOOR_FALL)));
    let far = mul(own_f32(segment + SEGMENT_REACH), FAR);
    rise = add(rise, mul(max(sub(distance, far), 0.0), FAR_STEEPER));
    var fall = 0.0;
    if share > 0.0 && share < 1.0 {
        fall = mul(own_f32(segment + LEVEL + 1u), per_square);
    }
    var floor = 0.0;
    if dry > 0.0 {
        floor = add(straight, mul(lean, sub(1.0, straight)));
    }
    let bed = vec2(mul(way.x, fall), mul(way.y, fall));
    return Side(along(segment + LEVEL, share), rise, cross, floor, bed, off, distance, share);
}

// rest.rs: metres that the land rises beside a channel where its side alone would rise so many, and so many lie under water.

fn risen_m(slope: f32, height_m: f32, open: f32, risen: f32) -> f32 {
    let above = mul(max(sub(risen, open), 0.0), sub(1.0, slope));
    return sub(risen, div(mul(above, above), add(add(above, height_m), LEAST_M)));
}

// What a side rises at a node whose slopes are given, over a segment's water at a level.
fn risen(segment: u32, level: f32, slopes: vec3<f32>, rise: f32) -> f32 {
    let side = mul(slopes.x, rise);
    if own[HAS_REST] == 0u {
        return side;
    }
    return risen_m(slopes.y, slopes.z, max(sub(own_f32(segment + POOL), level), 0.0), side);
}

// valley.rs

const PATCH: u32 = 8u;
const THREADS: u32 = 64u;
const BLOCK_PATCHES: u32 = 4u;
const NONE: u32 = 0xffffffffu;
const MOST: f32 = 3.40282347e+38;

// The least and the most of where the nodes of a patch are once warped, and of how steep their hills are: of the three slopes.
var<workgroup> least: array<array<f32, 5>, 64>;
var<workgroup> most: array<array<f32, 5>, 64>;
// The highest that the lowest side can be.
var<workgroup> highest: array<f32, 64>;
// Which of so many segments may be lowest, and these in their order.
var<workgroup> may_be: array<u32, 64>;
var<workgroup> chosen: array<u32, 64>;
var<workgroup> chosen_count: u32;

// The limits of a segment's side over a patch: the lowest and the highest that it can be, and what is left of its reach.
struct Limits {
    low: f32,
    high: f32,
    left: f32,
}

// What a list has of a segment: its words, and where it begins.
fn listed(entry: u32) -> u32 {
    return own[SEGMENTS] + own[entry] * SEGMENT_WORDS;
}

fn begin_of(entry: u32) -> vec2<f32> {
    return vec2(own_f32(entry + 1u), own_f32(entry + 2u));
}

// A little wider than the CPU's: what they leave out changes nothing, so they need not be the same bits. What is left of the reach
// must be.
fn measure(entry: u32, middle: vec2<f32>, radius_m: f32, gentle: vec3<f32>, steep: vec3<f32>) -> Limits {
    let segment = listed(entry);
    let side = side(segment, begin_of(entry), middle);
    let radius = radius_m * (1.002 + 1.11 * CROSS_FALL) + 0.02;
    let turned = own_f32(segment + CROSS_CHANGE) * (side.distance + radius);
    let reach = own_f32(segment + SEGMENT_REACH);
    let across = select(1.0, 1.0 + FAR_STEEPER, reach * FAR < side.distance + radius);
    let cross = own_f32(segment + CROSS);
    let steepest = max(max(cross, cross + own_f32(segment + CROSS + 1u)), 1.0);
    let change = steep.x * (across + own_f32(segment + FLOOR_CHANGE) + turned) * steepest;
    let slack = (own_f32(segment + BED_CHANGE) + change) * radius * 1.001 + 0.02;
    var high = steep.x * side.rise + slack;
    var low = gentle.x * side.rise - slack;
    if own[HAS_REST] != 0u {
        let open = max(own_f32(segment + POOL) - side.level, 0.0);
        high = risen_m(steep.y, steep.z, open, high) + 0.02;
        low = risen_m(gentle.y, gentle.z, open, low) - 0.02;
    }
    high += side.level;
    low += side.level;
    return Limits(low, high, sub(reach, side.distance));
}

// A group of threads is a patch.
@compute @workgroup_size(8, 8)
fn valleys(
    @builtin(workgroup_id) patch_at: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
    @builtin(global_invocation_id) id: vec3<u32>,
) {
    let node = id.y * own[WIDTH] + id.x;
    let corner = PATCH * patch_at.xy;
    let is_part = corner.x >= own[PART] && corner.y >= own[PART + 1u] && corner.x < own[PART + 2u]
        && corner.y < own[PART + 3u];
    // All of a patch or nothing of it.
    if !is_part {
        for (var plane = HEIGHT_M; plane <= STEEPNESS; plane += 1u) {
            put_node(plane, node, 0.0);
        }
        put_node(ROOM, node, 0.0);
        put_node(ROOM + 1u, node, 0.0);
        return;
    }
    // The block of patches, and where the node lies from its corner.
    let in_block = vec2(own[IN_BLOCK], own[IN_BLOCK + 1u]);
    let block = (corner + in_block) / (PATCH * BLOCK_PATCHES) - vec2(own[BLOCKS_FROM], own[BLOCKS_FROM + 1u]);
    let from_corner = (id.xy + in_block) % (PATCH * BLOCK_PATCHES);
    let list = own[LISTS] + 2u * (block.y * own[BLOCKS_ACROSS] + block.x);
    let first = own[SLOPES] + own[list];
    let count = own[list + 1u];
    let spacing_m = the_f32(SPACING_M);
    let at = vec2(
        add(mul(f32(from_corner.x), spacing_m), node_f32(EAST, node)),
        add(mul(f32(from_corner.y), spacing_m), node_f32(SOUTH, node)),
    );
    var slopes = vec3(own_f32(own[SLOPES] + node), 0.0, 0.0);
    if own[HAS_REST] != 0u {
        slopes.y = own_f32(own[SLOPES] + nodes() + node);
        slopes.z = own_f32(own[SLOPES] + 2u * nodes() + node);
    }
    let slope = slopes.x;
    least[thread] = array(at.x, at.y, slopes.x, slopes.y, slopes.z);
    most[thread] = least[thread];
    workgroupBarrier();
    for (var step = THREADS / 2u; step > 0u; step = step >> 1u) {
        if thread < step {
            for (var part = 0u; part < 5u; part += 1u) {
                least[thread][part] = min(least[thread][part], least[thread + step][part]);
                most[thread][part] = max(most[thread][part], most[thread + step][part]);
            }
        }
        workgroupBarrier();
    }
    let half = vec2(mul(sub(most[0][0], least[0][0]), 0.5), mul(sub(most[0][1], least[0][1]), 0.5));
    let middle = vec2(add(least[0][0], half.x), add(least[0][1], half.y));
    let radius = sqrt(half.x * half.x + half.y * half.y) * 1.0001;
    let gentle = vec3(least[0][2], least[0][3], least[0][4]);
    let steep = vec3(most[0][2], most[0][3], most[0][4]);
    // The highest that the lowest can be.
    var lowest_high = MOST;
    for (var number = thread; number < count; number += THREADS) {
        let limits = measure(first + 3u * number, middle, radius, gentle, steep);
        if limits.left >= 0.0 {
            lowest_high = min(lowest_high, limits.high);
        }
    }
    highest[thread] = lowest_high;
    workgroupBarrier();
    for (var step = THREADS / 2u; step > 0u; step = step >> 1u) {
        if thread < step {
            highest[thread] = min(highest[thread], highest[thread + step]);
        }
        workgroupBarrier();
    }
    let limit = highest[0] + max(the_f32(MOST_CREST_M), the_f32(READ_M));
    let most_crest_m = the_f32(MOST_CREST_M);
    var best = MOST;
    var second = MOST;
    var room = MOST;
    var channel = NONE;
    var lowest = NONE;
    for (var start = 0u; start < count; start += THREADS) {
        let number = start + thread;
        var is_chosen = 0u;
        if number < count {
            let limits = measure(first + 3u * number, middle, radius, gentle, steep);
            is_chosen = select(0u, 1u, limits.left >= 0.0 && limits.low <= limit);
        }
        may_be[thread] = is_chosen;
        workgroupBarrier();
        // In their order, for of two that are as low the first stays.
        var before = 0u;
        for (var other = 0u; other < thread; other += 1u) {
            before += may_be[other];
        }
        if is_chosen == 1u {
            chosen[before] = first + 3u * number;
        }
        if thread == THREADS - 1u {
            chosen_count = before + is_chosen;
        }
        let count = workgroupUniformLoad(&chosen_count);
        for (var index = 0u; index < count; index += 1u) {
            let entry = chosen[index];
            let segment = listed(entry);
            let side = side(segment, begin_of(entry), at);
            let height = add(side.level, risen(segment, side.level, slopes, side.rise));
            let own_channel = own[segment + CHANNEL];
            let lower = height < best;
            let rest = select(height, best, lower);
            if own_channel != channel {
                second = min(rest, second);
            }
            room = min(room, sub(mul(3.0, height), side.level));
            if lower {
                best = height;
                channel = own_channel;
                lowest = entry;
            }
        }
        workgroupBarrier();
    }
    var owner = Side(0.0, 0.0, 0.0, 0.0, vec2(0.0, 0.0), vec2(0.0, 0.0), 0.0, 0.0);
    var owner_number = NONE;
    if lowest != NONE {
        owner = side(listed(lowest), begin_of(lowest), at);
        owner_number = own[lowest];
    }
    let gap = sub(second, best);
    let round = max(min(most_crest_m, sub(room, add(best, best))), 0.0);
    let over = max(sub(round, gap), 0.0);
    let lowered = div(mul(over, over), mul(max(round, 1e-3), 5.0));
    let steepness = mul(min(div(gap, max(round, 1e-3)), 1.0), owner.floor);
    let across = div(mul(mul(slope, owner.cross), owner.floor), max(owner.distance, 1e-3));
    let rise = vec2(add(mul(owner.off.x, across), owner.bed.x), add(mul(owner.off.y, across), owner.bed.y));
    let steepest = root(add(mul(rise.x, rise.x), mul(rise.y, rise.y)));
    let per_rise = div(1.0, max(steepest, 1e-6));
    put_node(HEIGHT_M, node, sub(best, lowered));
    put_node(LEVEL_M, node, owner.level);
    put_node(CREST_M, node, min(gap, the_f32(READ_M)));
    put_node(STEEPNESS, node, steepness);
    put_node(DISTANCE_M, node, owner.distance);
    put_node(ROOM, node, mul(rise.x, per_rise));
    put_node(ROOM + 1u, node, mul(rise.y, per_rise));
    put_node(SHARE, node, owner.share);
    planes[SEGMENT * nodes() + node] = owner_number;
}

// gullies.rs

// The number of a node so many before or after another, in the order of all; of those at the ends where there is none.
fn beside(node: u32, by: i32) -> u32 {
    return u32(clamp(i32(node) + by, 0, i32(nodes()) - 1));
}

fn bend(plane: u32, node: u32, by: u32) -> f32 {
    let after = node_f32(plane, beside(node, i32(by)));
    return mul(sub(after, node_f32(plane, beside(node, -i32(by)))), the_f32(PER_METRE));
}

@compute @workgroup_size(SIDE, SIDE)
fn fall_line(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= own[WIDTH] || id.y >= own[HEIGHT] {
        return;
    }
    let width = own[WIDTH];
    let node = id.y * width + id.x;
    let away = vec2(node_f32(ROOM, node), node_f32(ROOM + 1u, node));
    put_node(
        FALL_X,
        node,
        add(mul(away.x, add(1.0, bend(EAST, node, 1u))), mul(away.y, bend(SOUTH, node, 1u))),
    );
    put_node(
        FALL_Y,
        node,
        add(mul(away.x, bend(EAST, node, width)), mul(away.y, add(1.0, bend(SOUTH, node, width)))),
    );
    put_node(FOOT_M, node, node_f32(LEVEL_M, node));
}

// How far apart the nodes are of which the mean is made, along which axis, and in which way the planes go.
override APART: u32 = 1u;
override IS_DOWN: bool = false;

@compute @workgroup_size(SIDE, SIDE)
fn smooth_planes(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= own[WIDTH] || id.y >= own[HEIGHT] {
        return;
    }
    let node = id.y * own[WIDTH] + id.x;
    let apart = i32(select(APART, APART * own[WIDTH], IS_DOWN));
    for (var plane = 0u; plane < 3u; plane += 1u) {
        let source = select(FALL_X, ROOM, IS_DOWN) + plane;
        let to = select(ROOM, FALL_X, IS_DOWN) + plane;
        let around =
            mul(0.5, add(node_f32(source, beside(node, -apart)), node_f32(source, beside(node, apart))));
        put_node(to, node, mul(0.5, add(node_f32(source, node), around)));
    }
}

const CREST_DEPTHS: f32 = 4.0;
const FLOOR_DEPTHS: f32 = 0.5;

// How much of a detail so many metres high a place takes.
fn share(node: u32, detail_m: f32) -> f32 {
    let height_m = node_f32(HEIGHT_M, node);
    let rise_m = max(sub(height_m, node_f32(FOOT_M, node)), 0.0);
    let rising = div(rise_m, add(add(rise_m, mul(detail_m, 3.0)), LEAST_M));
    let depths = add(mul(detail_m, FLOOR_DEPTHS), LEAST_M);
    let above = clamp(div(sub(height_m, node_f32(LEVEL_M, node)), depths), 0.0, 1.0);
    let channel = mul(mul(mul(rising, above), above), sub(3.0, add(above, above)));
    let below = min(div(node_f32(CREST_M, node), add(mul(detail_m, CREST_DEPTHS), LEAST_M)), 1.0);
    let crest = mul(mul(below, below), sub(3.0, add(below, below)));
    return mul(mul(channel, crest), node_f32(STEEPNESS, node));
}

// coast.rs and fields.rs

const EDGE_STEEPER: f32 = 6.0;

// The height that the coast alone gives a place so far inland.
fn coast_m(inland_m: f32) -> f32 {
    if inland_m > 0.0 {
        let rise_m = mul(mul(inland_m, own_f32(LAND_SLOPE)), EDGE_STEEPER);
        return add(own_f32(LOWSTAND_M), mul(rise_m, add(1.0, div(rise_m, 100.0))));
    }
    let depth_m = mul(-inland_m, own_f32(SHELF_SLOPE));
    return sub(own_f32(LOWSTAND_M), div(depth_m, add(1.0, div(depth_m, own_f32(DEEPEST_M)))));
}

@compute @workgroup_size(SIDE, SIDE)
fn coast(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= own[WIDTH] || id.y >= own[HEIGHT] {
        return;
    }
    let node = id.y * own[WIDTH] + id.x;
    // The cell of the lattice that the node lies in once it is displaced, and how far into it.
    let cell = own[CELL];
    let vertices = vec2(own[IN_CELL], own[IN_CELL + 1u]) + own[STEP] * id.xy;
    let by = vec2(mul(node_f32(EAST, node), own_f32(PER_VERTEX)), mul(node_f32(SOUTH, node), own_f32(PER_VERTEX)));
    let steps = vec2(
        div(add(f32(vertices.x % cell), by.x), f32(cell)),
        div(add(f32(vertices.y % cell), by.y), f32(cell)),
    );
    let whole = floor(steps);
    let share = vec2(sub(steps.x, whole.x), sub(steps.y, whole.y));
    let own_cell = vertices / cell + vec2(own[CELLS_BEFORE], own[CELLS_BEFORE + 1u]);
    let at = vec2<u32>(vec2<i32>(own_cell) + vec2<i32>(whole));
    let columns = own[INLAND_COLUMNS];
    let point = own[INLAND] + at.y * columns + at.x;
    let west = own_f32(point);
    let north = add(west, mul(sub(own_f32(point + 1u), west), share.x));
    let below = own_f32(point + columns);
    let south = add(below, mul(sub(own_f32(point + columns + 1u), below), share.x));
    let inland_m = add(north, mul(sub(south, north), share.y));
    var height_m = coast_m(inland_m);
    if own[HAS_REST] != 0u && inland_m > own_f32(SHORE_M) {
        // What brooks that run to the sea leave of the land's edge, in the mean.
        let slopes = own[SLOPES] + node;
        let risen = mul(own_f32(slopes), sub(inland_m, own_f32(SHORE_M)));
        let above = mul(risen, sub(1.0, own_f32(slopes + nodes())));
        let left = add(add(above, own_f32(slopes + 2u * nodes())), LEAST_M);
        height_m = min(height_m, add(own_f32(SEA_LEVEL_M), sub(risen, div(mul(above, above), left))));
    }
    put_node(COAST_M, node, height_m);
}

// stripes.rs

// Cells that a pivot reaches, from the middle of its own, and a little more than is rounded.
const CELL_REACH: f32 = 1.56;
const FULL_SHARE: f32 = 0.45;
const ROUNDER: f32 = 12582912.0;
const PIVOT_WORDS: u32 = 3u;

// The crest and the flank of the stripes at a node of a block, in the words of an octave.
fn stripes(octave: u32, block: u32, at: vec2<u32>, across: vec2<f32>) -> vec2<f32> {
    let steps = octave + 4u;
    let frequency = same_f32(octave + 3u);
    let x = same_f32(steps + at.x);
    let y = same_f32(steps + at.y);
    let columns = own[block];
    let rows = own[block + 1u];
    // The cells whose pivots may reach it, in their order: the others add zero.
    let cell = vec2(own_f32(block + 2u), own_f32(block + 3u)) + vec2<f32>(at) * frequency;
    let first = vec2<u32>(max(cell - CELL_REACH, vec2(0.0, 0.0)));
    let last = min(vec2<u32>(max(cell + CELL_REACH, vec2(0.0, 0.0))) + 1u, vec2(columns, rows));
    let turns = the_f32(TURNS);
    let across_x = mul(across.x, turns);
    let across_y = mul(across.y, turns);
    var weights = 0.0;
    var sine2 = 0.0;
    var both = 0.0;
    for (var row = first.y; row < last.y; row += 1u) {
        for (var column = first.x; column < last.x; column += 1u) {
            let pivot = block + 4u + PIVOT_WORDS * (row * columns + column);
            let dx = sub(x, own_f32(pivot));
            let dy = sub(y, own_f32(pivot + 1u));
            let t = max(sub(sub(1.0, mul(dy, dy)), mul(dx, dx)), 0.0);
            if t == 0.0 {
                continue;
            }
            let phase = add(mul(across_x, dx), add(mul(across_y, dy), own_f32(pivot + 2u)));
            // plus
            let weight = mul(mul(t, t), t);
            let r = sub(phase, sub(add(phase, ROUNDER), ROUNDER));
            let r2 = mul(r, r);
            let sine = mul(r, add(mul(add(r2, the_f32(SINE_1)), r2), the_f32(SINE_0)));
            let cosine = mul(sub(r2, 0.25), sub(r2, the_f32(COSINE_0)));
            let weighted = mul(weight, sine);
            weights = add(weights, weight);
            sine2 = add(sine2, mul(weighted, sine));
            both = add(both, mul(weighted, cosine));
        }
    }
    // crest_and_flank
    let cosine = sub(weights, mul(sine2, the_f32(SINE_2)));
    let sine = mul(both, the_f32(BOTH_2));
    let length = root(add(mul(cosine, cosine), mul(sine, sine)));
    let inverse = div(1.0, max(length, mul(weights, FULL_SHARE)));
    let q = mul(length, inverse);
    let scale = mul(inverse, sub(1.5, mul(0.5, mul(q, q))));
    return vec2(mul(cosine, scale), mul(sine, scale));
}

override OCTAVE: u32 = 0u;

// A block begins with where its first node lies in the area.
const STRIPES_FIRST: u32 = 2u;

@compute @workgroup_size(SIDE, SIDE)
fn carve_octave(@builtin(global_invocation_id) id: vec3<u32>) {
    let block = own[STRIPES + 2u * OCTAVE] + id.z * own[STRIPES + 2u * OCTAVE + 1u];
    let column = bitcast<i32>(own[block]) + i32(id.x);
    let row = bitcast<i32>(own[block + 1u]) + i32(id.y);
    if column < 0 || row < 0 || column >= i32(own[WIDTH]) || row >= i32(own[HEIGHT]) {
        return;
    }
    let node = u32(row) * own[WIDTH] + u32(column);
    let octave = job.rule + OCTAVES + 1u + OCTAVE * OCTAVE_WORDS;
    // Across
    let x = node_f32(FALL_X, node);
    let y = node_f32(FALL_Y, node);
    let scale = div(1.0, max(root(add(mul(x, x), mul(y, y))), 1e-6));
    let across = vec2(mul(-y, scale), mul(x, scale));
    let wave = stripes(octave, block + STRIPES_FIRST, id.xy, across);
    // CarveOctave
    let depth = mul(same_f32(octave), own_f32(own[SLOPES] + node));
    var share = share(node, depth);
    if same[octave + 2u] != 0u {
        share = mul(share, clamp(add(0.5, node_f32(PATCHES, node)), 0.0, 1.0));
    }
    var carved = 0.0;
    if OCTAVE != 0u {
        carved = node_f32(CARVED, node);
    }
    put_node(CARVED, node, add(carved, mul(mul(depth, share), sub(0.5, mul(0.5, wave.x)))));
    let turn = mul(mul(share, same_f32(octave + 1u)), wave.y);
    put_node(FALL_X, node, sub(x, mul(turn, across.x)));
    put_node(FALL_Y, node, sub(y, mul(turn, across.y)));
}

// What octaves that are not seen take in the mean, and the roughness; then what was carved is taken off.
@compute @workgroup_size(SIDE, SIDE)
fn roughen(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= own[WIDTH] || id.y >= own[HEIGHT] {
        return;
    }
    let node = id.y * own[WIDTH] + id.x;
    let slope = own_f32(own[SLOPES] + node);
    var carved = 0.0;
    if same[job.rule + OCTAVES] != 0u {
        carved = node_f32(CARVED, node);
    }
    for (var unseen = 0u; unseen < same[job.rule + UNSEEN]; unseen += 1u) {
        let depth = mul(the_f32(UNSEEN_M + unseen), slope);
        carved = add(carved, mul(depth, share(node, depth)));
    }
    let rough = mul(the_f32(ROUGH_M), slope);
    let share = share(node, rough);
    let left = sub(node_f32(HEIGHT_M, node), carved);
    let height = add(left, mul(mul(rough, share), node_f32(ROUGH, node)));
    put_node(HEIGHT_M, node, max(height, node_f32(LEVEL_M, node)));
}
