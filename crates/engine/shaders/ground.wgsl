// The ground of a map, a thread a pixel: src/map/terrain.rs, relief.rs, rows.rs, sky.rs, tint.rs and light.rs, whose functions have
// the same names here.
//
// After job.wgsl, and exact.wgsl, whose add, sub, mul, div and root are all that is done to numbers with a fraction.

// The words of a block, in place of bands: src/map/kernel.rs. First the pixels that heights are made of: how many across and down,
// and by how many these are more than the block's on each side; then the block's, and the nodes under all.
const WIDE: u32 = 0u;
const PAD: u32 = 2u;
const SIDES: u32 = 3u;
const NODES: u32 = 5u;
// Where the splines of columns and rows begin, and heights, ground and cover of the nodes.
const COLUMNS: u32 = 7u;
const ROWS: u32 = 8u;
const NODE_HEIGHTS: u32 = 9u;
const NODE_GROUND: u32 = 10u;
const NODE_COVER: u32 = 11u;
// Nodes of the sky across and down; how many pixels their first is from the first of all, and where the block's first pixel lies
// between them.
const SKY_NODES: u32 = 12u;
const SKY_FROM: u32 = 14u;
const SKY_AT: u32 = 16u;
// Whether the sky is looked at; pixels around the block whose stones are known.
const LOOKS_UP: u32 = 18u;
const STONES_PAD: u32 = 19u;
// Where planes begin.
const HEIGHTS: u32 = 20u;
const PIXELS: u32 = 21u;
const SNOW: u32 = 22u;
const STONES: u32 = 23u;
const ACROSS: u32 = 24u;
const SMOOTH: u32 = 25u;
const TEXTURE: u32 = 27u;
const COVERS: u32 = 28u;
const SKY: u32 = 29u;
const SEEN: u32 = 30u;
const LOWEST: u32 = 31u;

// The numbers that are the same for all blocks.
const PER_PIXEL: u32 = 0u;
const STEEPENING: u32 = 1u;
const SUN: u32 = 2u;
const TURNED_2: u32 = 4u;
const TURN: u32 = 5u;
const AHEAD: u32 = 6u;
const SIDE_SHARE: u32 = 7u;
const LOW_M: u32 = 8u;
const PER_M: u32 = 9u;
const AERIAL: u32 = 10u;
const TEXTURED: u32 = 11u;
const STRENGTH: u32 = 12u;
const DEEP: u32 = 13u;
const HAZE_SHARE: u32 = 14u;
const METRES_PER_PIXEL: u32 = 15u;
const SEA_LEVEL_M: u32 = 16u;
const LIGHT: u32 = 17u;
const SHADOW: u32 = 20u;
const HAZE: u32 = 23u;
const HIGHLIGHT: u32 = 26u;
const PER_BRIGHT: u32 = 27u;
const PER_DARK: u32 = 28u;
const LAND_LOW_M: u32 = 29u;
const LAND_STEPS: u32 = 30u;
const SEA_STEPS: u32 = 31u;
const SHORE_M: u32 = 32u;
const SKY_SHARE: u32 = 33u;
const CAST_SHARE: u32 = 34u;
const SKY_PER_M: u32 = 35u;
const WAY_SHARES: u32 = 36u;
const WAYS_SHARE: u32 = 44u;
const LEVELS_PER_M: u32 = 45u;
const MATERIALS: u32 = 49u;
const LAND_TINTS: u32 = 81u;
const SEA_TINTS: u32 = 3153u;

fn the_f32(at: u32) -> f32 {
    return same_f32(job.rule + at);
}

// terrain.rs

const SPLINE_WORDS: u32 = 5u;

// The node from which on four are read, and where its words are.
fn spline(table: u32, pixel: u32) -> u32 {
    return own[table] + SPLINE_WORDS * pixel;
}

// A value of four rows of a column of nodes, by the weights of a row of pixels.
fn weigh_rows(first: u32, row: u32, is_own: bool) -> f32 {
    let width = own[NODES];
    var sum = 0.0;
    for (var index = 0u; index < 4u; index += 1u) {
        let node = first + index * width;
        var value = 0.0;
        if is_own {
            value = own_f32(node);
        } else {
            value = plane_f32(node);
        }
        let part = mul(value, own_f32(row + 1u + index));
        sum = select(add(sum, part), part, index == 0u);
    }
    return sum;
}

// Values at the nodes, as they are at a pixel of all that heights are made of.
fn at_pixel(values: u32, is_own: bool, pixel: vec2<u32>) -> f32 {
    let column = spline(COLUMNS, pixel.x);
    let row = spline(ROWS, pixel.y);
    let first = values + own[row] * own[NODES] + own[column];
    let a = mul(weigh_rows(first, row, is_own), own_f32(column + 1u));
    let b = mul(weigh_rows(first + 1u, row, is_own), own_f32(column + 2u));
    let c = mul(weigh_rows(first + 2u, row, is_own), own_f32(column + 3u));
    let d = mul(weigh_rows(first + 3u, row, is_own), own_f32(column + 4u));
    return add(add(a, b), add(c, d));
}

fn wide_at(pixel: vec2<u32>) -> u32 {
    return pixel.y * own[WIDE] + pixel.x;
}

@compute @workgroup_size(SIDE, SIDE)
fn heights(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= own[WIDE] || id.y >= own[WIDE + 1u] {
        return;
    }
    put_f32(own[HEIGHTS] + wide_at(id.xy), at_pixel(own[NODE_HEIGHTS], true, id.xy));
}

// relief.rs

const SNOW_WEIGHT: u32 = 4u;
const ROCK_WEIGHT: u32 = 2u;
const SCREE_WEIGHT: u32 = 6u;

fn weight(node: u32, material: u32) -> f32 {
    let word = select(own[own[NODE_GROUND] + node], own[own[NODE_COVER] + node], material >= 4u);
    return f32((word >> (8u * (material & 3u))) & 0xffu);
}

// Planes of nodes: red, green, blue and the share of what covers the ground; then snow, rock and scree.
@compute @workgroup_size(SIDE, SIDE)
fn covers_of(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= own[NODES] || id.y >= own[NODES + 1u] {
        return;
    }
    let node = id.y * own[NODES] + id.x;
    var red = 0.0;
    var green = 0.0;
    var blue = 0.0;
    var covered = 0.0;
    for (var material = 0u; material < 8u; material += 1u) {
        let words = MATERIALS + 4u * material;
        let share = the_f32(words + 3u);
        let has = weight(node, material);
        if share > 0.0 && has > 0.0 {
            let seen = mul(has, share);
            red = add(red, mul(the_f32(words), seen));
            green = add(green, mul(the_f32(words + 1u), seen));
            blue = add(blue, mul(the_f32(words + 2u), seen));
            covered = add(covered, seen);
        }
    }
    let plane = own[NODES] * own[NODES + 1u];
    let at = own[COVERS] + node;
    put_f32(at, red);
    put_f32(at + plane, green);
    put_f32(at + 2u * plane, blue);
    put_f32(at + 3u * plane, covered);
    put_f32(at + 4u * plane, div(weight(node, SNOW_WEIGHT), 255.0));
    put_f32(at + 5u * plane, div(weight(node, ROCK_WEIGHT), 255.0));
    put_f32(at + 6u * plane, div(weight(node, SCREE_WEIGHT), 255.0));
}

fn cover(plane: u32, pixel: vec2<u32>) -> f32 {
    return at_pixel(own[COVERS] + plane * own[NODES] * own[NODES + 1u], false, pixel);
}

// Rock and scree around the block.
@compute @workgroup_size(SIDE, SIDE)
fn stones(@builtin(global_invocation_id) id: vec3<u32>) {
    let sides = vec2(own[SIDES], own[SIDES + 1u]) + 2u * own[STONES_PAD];
    if id.x >= sides.x || id.y >= sides.y {
        return;
    }
    let pixel = id.xy + own[PAD] - own[STONES_PAD];
    let at = own[STONES] + id.y * sides.x + id.x;
    put_f32(at, cover(5u, pixel));
    put_f32(at + sides.x * sides.y, cover(6u, pixel));
}

// rows.rs: from which plane to which, as levels follow each other, and how far apart knots are. Where a plane ends what is read does
// not matter.

override LEVEL: u32 = 0u;

fn fine() -> u32 {
    if LEVEL == 0u {
        return own[HEIGHTS];
    }
    return own[SMOOTH + (LEVEL & 1u)];
}

fn coarse() -> u32 {
    return own[SMOOTH + ((LEVEL + 1u) & 1u)];
}

fn weigh_knots(first: u32, apart: u32) -> f32 {
    var sum = mul(plane_f32(first), 0.0625);
    sum = add(sum, mul(plane_f32(first + apart), 0.25));
    sum = add(sum, mul(plane_f32(first + 2u * apart), 0.375));
    sum = add(sum, mul(plane_f32(first + 3u * apart), 0.25));
    return add(sum, mul(plane_f32(first + 4u * apart), 0.0625));
}

@compute @workgroup_size(SIDE, SIDE)
fn smooth_across(@builtin(global_invocation_id) id: vec3<u32>) {
    let reach = 2u << LEVEL;
    if id.x < reach || id.x + reach >= own[WIDE] || id.y >= own[WIDE + 1u] {
        return;
    }
    let at = wide_at(id.xy);
    put_f32(own[ACROSS] + at, weigh_knots(fine() + at - reach, 1u << LEVEL));
}

@compute @workgroup_size(SIDE, SIDE)
fn smooth_down(@builtin(global_invocation_id) id: vec3<u32>) {
    let reach = 2u << LEVEL;
    if id.y < reach || id.y + reach >= own[WIDE + 1u] || id.x >= own[WIDE] {
        return;
    }
    let at = wide_at(id.xy);
    let width = own[WIDE];
    let smoothed = weigh_knots(own[ACROSS] + at - reach * width, width << LEVEL);
    put_f32(coarse() + at, smoothed);
    var texture = 0.0;
    if LEVEL > 0u {
        texture = plane_f32(own[TEXTURE] + at);
    }
    let per_m = the_f32(LEVELS_PER_M + LEVEL);
    put_f32(own[TEXTURE] + at, add(add(texture, mul(plane_f32(fine() + at), per_m)), mul(smoothed, -per_m)));
}

// sky.rs

const STEP: u32 = 8u;
const FAR: u32 = 4u;
const NEAR: u32 = 2u;
const SQRT_2: f32 = 1.4142135;
const USUAL: f32 = 0.9;
const SUN_RISE: f32 = 0.5;
const SOFT: f32 = 0.35;
// Eight ways: how far each leads east and south, and one more, two bits each, the first in the lowest.
const EASTS: u32 = 0x901au;
const SOUTHS: u32 = 0x01a9u;

@compute @workgroup_size(SIDE, SIDE)
fn sky_heights(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= own[SKY_NODES] || id.y >= own[SKY_NODES + 1u] {
        return;
    }
    let at = own[HEIGHTS] + wide_at(STEP * id.xy + vec2(own[SKY_FROM], own[SKY_FROM + 1u]));
    let north = at - NEAR * own[WIDE];
    let south = at + NEAR * own[WIDE];
    var sum = add(plane_f32(at), plane_f32(north - NEAR));
    sum = add(sum, plane_f32(north + NEAR));
    sum = add(sum, plane_f32(south - NEAR));
    sum = add(sum, plane_f32(south + NEAR));
    put_f32(own[SKY] + id.y * own[SKY_NODES] + id.x, div(sum, 5.0));
}

@compute @workgroup_size(SIDE, SIDE)
fn openness(@builtin(global_invocation_id) id: vec3<u32>) {
    let width = own[SKY_NODES];
    if id.x < FAR || id.y < FAR || id.x + FAR >= width || id.y + FAR >= own[SKY_NODES + 1u] {
        return;
    }
    let here = own[SKY] + id.y * width + id.x;
    let here_m = plane_f32(here);
    var hidden = 0.0;
    var sunny = 0.0;
    for (var way = 0u; way < 8u; way += 1u) {
        // East and south.
        let east = i32((EASTS >> (2u * way)) & 3u) - 1;
        let south = i32((SOUTHS >> (2u * way)) & 3u) - 1;
        let by = south * i32(width) + east;
        let long = select(1.0, SQRT_2, east != 0 && south != 0);
        var rise = 0.0;
        for (var far = 1u; far <= FAR; far += 1u) {
            let rise_m = sub(plane_f32(u32(i32(here) + by * i32(far))), here_m);
            rise = max(rise, div(mul(rise_m, the_f32(SKY_PER_M)), mul(f32(STEP * far), long)));
        }
        hidden = add(hidden, div(rise, root(add(1.0, mul(rise, rise)))));
        sunny = add(sunny, mul(rise, the_f32(WAY_SHARES + way)));
    }
    hidden = mul(hidden, 0.125);
    let shadow = clamp(div(sub(div(sunny, the_f32(WAYS_SHARE)), SUN_RISE), SOFT), 0.0, 1.0);
    let seen = mul(the_f32(SKY_SHARE), sub(sub(1.0, hidden), USUAL));
    put_f32(own[SEEN] + id.y * width + id.x, sub(seen, mul(the_f32(CAST_SHARE), shadow)));
}

// What a pixel of the block is lighter by for the sky that it sees, and darker by for cast shadow.
fn open(pixel: vec2<u32>) -> f32 {
    let place = pixel + vec2(own[SKY_AT], own[SKY_AT + 1u]);
    let node = place / STEP;
    let share = vec2(
        mul(add(f32(place.x % STEP), 0.5), 0.125),
        mul(add(f32(place.y % STEP), 0.5), 0.125),
    );
    let width = own[SKY_NODES];
    let at = own[SEEN] + node.y * width + node.x;
    let north = plane_f32(at);
    let west = add(north, mul(sub(plane_f32(at + width), north), share.y));
    let north_east = plane_f32(at + 1u);
    let east = add(north_east, mul(sub(plane_f32(at + width + 1u), north_east), share.y));
    return add(west, mul(sub(east, west), share.x));
}

// tint.rs

const STEPS: f32 = 1023.0;

fn tint(table: u32, position: f32) -> vec3<f32> {
    let at = table + 3u * u32(clamp(position, 0.0, STEPS));
    return vec3(the_f32(at), the_f32(at + 1u), the_f32(at + 2u));
}

// light.rs

const CHUNK: u32 = 256u;
const FLAT: f32 = 0.70710677;
const HALF: f32 = 0.5;
const SINE: f32 = 0.8660254;
const LEAST_RISE_M: f32 = 0.02;

// The lowest land of each chunk of a row: where it is high above the sea, the sea has no colour.
@compute @workgroup_size(SIDE, SIDE)
fn lowest(@builtin(global_invocation_id) id: vec3<u32>) {
    let chunks = (own[SIDES] + CHUNK - 1u) / CHUNK;
    if id.x >= chunks || id.y >= own[SIDES + 1u] {
        return;
    }
    let first = own[HEIGHTS] + wide_at(vec2(id.x * CHUNK, id.y) + own[PAD]);
    let count = min(CHUNK, own[SIDES] - id.x * CHUNK);
    var low = plane_f32(first);
    for (var index = 1u; index < count; index += 1u) {
        low = min(low, plane_f32(first + index));
    }
    put_f32(own[LOWEST] + id.y * chunks + id.x, low);
}

fn slope(at: u32) -> vec2<f32> {
    let width = own[WIDE];
    let north_west = plane_f32(at - width - 1u);
    let north = plane_f32(at - width);
    let north_east = plane_f32(at - width + 1u);
    let west = plane_f32(at - 1u);
    let east = plane_f32(at + 1u);
    let south_west = plane_f32(at + width - 1u);
    let south = plane_f32(at + width);
    let south_east = plane_f32(at + width + 1u);
    return vec2(
        add(add(sub(north_east, north_west), mul(2.0, sub(east, west))), sub(south_east, south_west)),
        add(add(sub(south_west, north_west), mul(2.0, sub(south, north))), sub(south_east, north_east)),
    );
}

// How much of full light is mixed in, and how deep the shadow is.
fn shares(tone: f32) -> vec2<f32> {
    return vec2(
        mul(min(mul(max(tone, 0.0), the_f32(PER_BRIGHT)), 1.0), the_f32(HIGHLIGHT)),
        min(mul(max(sub(0.0, tone), 0.0), the_f32(PER_DARK)), 1.0),
    );
}

// How much of a light that stands there a slope has.
fn lit_by(normal: vec2<f32>, light: vec2<f32>) -> f32 {
    return max(add(add(mul(normal.x, light.x), mul(normal.y, light.y)), 1.0), 0.0);
}

// What the channels of a pixel have in common: the share of the land that nothing covers; how much of full light is mixed in and how
// deep the shadow is, over land and under water; haze, and the share of the sea.
struct Tones {
    bare: f32,
    land: vec2<f32>,
    deep: vec2<f32>,
    haze: f32,
    sea: f32,
}

// A channel of a pixel in its place.
fn colour(channel: u32, land_tint: f32, sea_tint: f32, pixel: vec2<u32>, tones: Tones) -> u32 {
    let bright = the_f32(LIGHT + channel);
    let shadow = the_f32(SHADOW + channel);
    let covered = add(mul(land_tint, tones.bare), cover(channel, pixel));
    var land = mul(add(covered, mul(sub(bright, covered), tones.land.x)), add(1.0, mul(shadow, tones.land.y)));
    land = add(land, mul(sub(the_f32(HAZE + channel), land), tones.haze));
    let water =
        mul(add(sea_tint, mul(sub(bright, sea_tint), tones.deep.x)), add(1.0, mul(shadow, tones.deep.y)));
    let mixed = add(land, mul(sub(water, land), tones.sea));
    return u32(min(add(max(mixed, 0.0), 0.5), 255.0)) << (8u * channel);
}

@compute @workgroup_size(SIDE, SIDE)
fn light(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= own[SIDES] || id.y >= own[SIDES + 1u] {
        return;
    }
    let here = id.y * own[SIDES] + id.x;
    let pixel = id.xy + own[PAD];
    let at = wide_at(pixel);
    let height_m = plane_f32(own[HEIGHTS] + at);
    let smooth_plane = own[SMOOTH];
    let steepening = the_f32(STEEPENING);
    let per_pixel = the_f32(PER_PIXEL);
    let rises = slope(own[HEIGHTS] + at);
    let east = mul(rises.x, per_pixel);
    let south = mul(rises.y, per_pixel);
    let wide_rises = slope(smooth_plane + at);
    let wide = mul(steepening, per_pixel);
    let wide_east = sub(0.0, mul(wide_rises.x, wide));
    let wide_south = sub(0.0, mul(wide_rises.y, wide));
    let sun = vec2(the_f32(SUN), the_f32(SUN + 1u));
    let steep = add(mul(wide_east, wide_east), mul(wide_south, wide_south));
    let ahead = add(mul(wide_east, sun.x), mul(wide_south, sun.y));
    let across = sub(mul(wide_south, sun.x), mul(wide_east, sun.y));
    let twice = div(mul(add(ahead, ahead), across), add(steep, the_f32(TURNED_2)));
    let turn = mul(the_f32(TURN), twice);
    let length = root(add(1.0, mul(turn, turn)));
    let main = vec2(div(sub(sun.x, mul(sun.y, turn)), length), div(add(sun.y, mul(sun.x, turn)), length));
    let normal = vec2(sub(0.0, mul(east, steepening)), sub(0.0, mul(south, steepening)));
    let scale = div(FLAT, root(add(add(1.0, mul(normal.x, normal.x)), mul(normal.y, normal.y))));
    let left = vec2(
        sub(mul(main.x, HALF), mul(main.y, SINE)),
        add(mul(main.y, HALF), mul(main.x, SINE)),
    );
    let right = vec2(
        add(mul(main.x, HALF), mul(main.y, SINE)),
        sub(mul(main.y, HALF), mul(main.x, SINE)),
    );
    let sides = add(lit_by(normal, left), lit_by(normal, right));
    let all = add(mul(lit_by(normal, main), the_f32(AHEAD)), mul(sides, the_f32(SIDE_SHARE)));
    let lit = sub(mul(all, scale), FLAT);
    // The lower, the weaker, under more air.
    let elevation = mul(sub(plane_f32(smooth_plane + at), the_f32(LOW_M)), the_f32(PER_M));
    let low = sub(1.0, clamp(elevation, 0.0, 1.0));
    let rough = plane_f32(own[TEXTURE] + at);
    let texture = div(rough, add(1.0, mul(max(rough, sub(0.0, rough)), 2.5)));
    var tone = add(mul(lit, sub(1.0, mul(low, the_f32(AERIAL)))), mul(texture, the_f32(TEXTURED)));
    var open_share = 0.0;
    if own[LOOKS_UP] != 0u {
        open_share = open(id.xy);
    }
    tone = mul(add(tone, open_share), the_f32(STRENGTH));
    let deep = mul(lit, the_f32(DEEP));
    let haze = mul(low, the_f32(HAZE_SHARE));
    // The share of the pixel that the sea covers, by how far its shore is.
    let rise_m = mul(root(add(mul(east, east), mul(south, south))), the_f32(METRES_PER_PIXEL));
    let depth_m = sub(the_f32(SEA_LEVEL_M), height_m);
    let sea = clamp(add(div(depth_m, max(rise_m, LEAST_RISE_M)), 0.5), 0.0, 1.0);
    let tones = Tones(sub(1.0, cover(3u, pixel)), shares(tone), shares(deep), haze, sea);
    let land_tint = tint(LAND_TINTS, mul(sub(height_m, the_f32(LAND_LOW_M)), the_f32(LAND_STEPS)));
    var sea_tint = vec3(0.0, 0.0, 0.0);
    let chunks = (own[SIDES] + CHUNK - 1u) / CHUNK;
    if plane_f32(own[LOWEST] + id.y * chunks + id.x / CHUNK) < the_f32(SHORE_M) {
        sea_tint = tint(SEA_TINTS, mul(depth_m, the_f32(SEA_STEPS)));
    }
    planes[own[PIXELS] + here] = colour(0u, land_tint.x, sea_tint.x, pixel, tones)
        | colour(1u, land_tint.y, sea_tint.y, pixel, tones) | colour(2u, land_tint.z, sea_tint.z, pixel, tones);
    put_f32(own[SNOW] + here, cover(4u, pixel));
}
