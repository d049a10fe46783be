// Tiles made of land, one thread per vertex: carved lines, normals, slopes, and the materials of the ground. Functions
// have the names of their counterparts in src/lines and src/tile.
//
// Compiled after job.wgsl and exact.wgsl. All arithmetic on numbers with a fraction uses add, sub, mul, div and root of
// exact.wgsl.

// A band of rows of a tile: see src/device/gpu/bands.rs.
struct Band {
    // Land of the band: offset of its plane, width and height.
    land: u32,
    width: u32,
    height: u32,
    // Position of the tile's vertices in the band's land, their number across and down, and offset of their planes.
    pad: vec2<u32>,
    cells: vec2<u32>,
    out: u32,
    // Offsets of the plane of noise and of two planes of rubble.
    noise: u32,
    rubble: vec2<u32>,
    // Offset of the lines, or 0 if there are none; the row of the lines' area in which the band begins; offset of the
    // imprint's planes.
    lines: u32,
    row: u32,
    imprint: u32,
}

fn band(number: u32) -> Band {
    let at = number * BAND_WORDS;
    return Band(
        own[at],
        own[at + 1u],
        own[at + 2u],
        vec2(own[at + 3u], own[at + 4u]),
        vec2(own[at + 5u], own[at + 6u]),
        own[at + 7u],
        own[at + 8u],
        vec2(own[at + 9u], own[at + 10u]),
        own[at + 11u],
        own[at + 12u],
        own[at + 13u],
    );
}

// As in nearest.rs.

struct Nearest {
    outside_m: f32,
    floor_m: f32,
}

const FAR: f32 = 3.0e38;

const LINE_WORDS: u32 = 10u;
const PIECE_WORDS: u32 = 12u;

fn is_within(at: u32, column: i32, row: i32) -> bool {
    return column >= bitcast<i32>(own[at]) && row >= bitcast<i32>(own[at + 1u]) && column < bitcast<i32>(own[at + 2u])
        && row < bitcast<i32>(own[at + 3u]);
}

fn between(at: u32, share: f32) -> f32 {
    let start = own_f32(at);
    return add(start, mul(sub(own_f32(at + 1u), start), share));
}

// Returns the distance of a vertex from the edge of a line's piece, and the floor of the piece at the nearest point.
// `x` and `y` are relative to the line's origin.
fn nearest(piece: u32, x: f32, y: f32, spacing_m: f32) -> Nearest {
    let from_east = own_f32(piece + 4u);
    let from_south = own_f32(piece + 5u);
    let along_east = sub(own_f32(piece + 6u), from_east);
    let along_south = sub(own_f32(piece + 7u), from_south);
    let square = add(mul(along_east, along_east), mul(along_south, along_south));
    let east = sub(x, from_east);
    let south = sub(y, from_south);
    var share = 0.0;
    if square > 0.0 {
        share = clamp(div(add(mul(east, along_east), mul(south, along_south)), square), 0.0, 1.0);
    }
    let off_east = sub(east, mul(along_east, share));
    let off_south = sub(south, mul(along_south, share));
    let distance_m = mul(root(add(mul(off_east, off_east), mul(off_south, off_south))), spacing_m);
    return Nearest(sub(distance_m, between(piece + 8u, share)), between(piece + 10u, share));
}

fn fade(distance: f32) -> f32 {
    let rest = sub(1.0, clamp(distance, 0.0, 1.0));
    return mul(mul(rest, rest), sub(3.0, mul(2.0, rest)));
}

// As in imprint.rs, dug.rs and trodden.rs. The planes of the imprint are cut, sand, water and dirt.

const TRODDEN: u32 = 1u;
const GRADED: u32 = 2u;

@compute @workgroup_size(SIDE, SIDE)
fn carve(@builtin(global_invocation_id) id: vec3<u32>) {
    let band = band(id.z);
    if band.lines == 0u || id.x >= band.width || id.y >= band.height {
        return;
    }
    let here = id.y * band.width + id.x;
    let column = i32(id.x);
    let row = i32(id.y + band.row);
    let bare_m = plane_f32(band.land + here);
    var cut_m = 0.0;
    var sand = 0.0;
    var water = 0.0;
    var dirt = 0.0;
    var grade = 0.0;
    var level_m = 0.0;
    var line = band.lines + 1u;
    for (var left = own[band.lines]; left > 0u; left -= 1u) {
        let kind = own[line];
        let bank_m = own_f32(line + 1u);
        let spacing_m = own_f32(line + 2u);
        let pieces = own[line + 9u];
        var place = Nearest(FAR, 0.0);
        if is_within(line + 5u, column, row) {
            let x = f32(column + bitcast<i32>(own[line + 3u]));
            let y = f32(row + bitcast<i32>(own[line + 4u]));
            for (var number = 0u; number < pieces; number += 1u) {
                let piece = line + LINE_WORDS + number * PIECE_WORDS;
                if is_within(piece, column, row) {
                    let other = nearest(piece, x, y, spacing_m);
                    // On a tie the piece further up the line wins.
                    if other.outside_m < place.outside_m {
                        place = other;
                    }
                }
            }
        }
        if place.outside_m < bank_m {
            let share = fade(div(place.outside_m, bank_m));
            if kind >= TRODDEN {
                dirt = max(dirt, share);
                // The nearest road wins, and of two equally near roads the higher one.
                if kind == GRADED && (share > grade || (share == grade && place.floor_m > level_m)) {
                    grade = share;
                    level_m = place.floor_m;
                }
            } else {
                cut_m = max(cut_m, mul(max(sub(bare_m, place.floor_m), 0.0), share));
                sand = max(sand, fade(div(mul(2.0, place.outside_m), bank_m)));
                water = max(water, clamp(sub(0.5, div(place.outside_m, spacing_m)), 0.0, 1.0));
            }
        }
        line += LINE_WORDS + pieces * PIECE_WORDS;
    }
    let levelled_m = add(bare_m, mul(sub(level_m, bare_m), grade));
    put_f32(band.land + here, sub(levelled_m, cut_m));
    let plane = band.width * band.height;
    put_f32(band.imprint + here, cut_m);
    put_f32(band.imprint + plane + here, sand);
    put_f32(band.imprint + 2u * plane + here, water);
    put_f32(band.imprint + 3u * plane + here, dirt);
}

// As in rule.rs: offsets in the words of the ground rule.

const SLOPE_SCALE: u32 = 0u;
const HALF_PER_SPACING: u32 = 1u;
const DIRT: u32 = 2u;
const ROCK: u32 = 4u;
const NO_SAND: u32 = 6u;
const STEEP_SAND: u32 = 8u;
const SNOW: u32 = 10u;
const SNOW_NORTH_M: u32 = 12u;
const SNOW_SLIDES: u32 = 13u;
const LOOKS_AROUND: u32 = 15u;
const HAS_NOISE: u32 = 16u;
const HAS_SCREE: u32 = 17u;
const SCREE: u32 = 18u;
const FOREST_BIAS: u32 = 20u;
const TREE_LINE: u32 = 21u;
const FOREST_NORTH_M: u32 = 23u;
const TOO_STEEP: u32 = 24u;
const NO_MEADOW: u32 = 26u;
const FOREST_EDGE: u32 = 28u;
const FLOOR_SCALE: u32 = 29u;
const ROLL_SHIFT: u32 = 30u;
// Four words per round: the loss of rubble on a straight way and on a diagonal one, then the factors that convert a
// rise on such a way to a share.
const ROUNDS: u32 = 31u;

fn rule_f32(at: u32) -> f32 {
    return same_f32(job.rule + at);
}

fn along(value: f32, ramp: u32) -> f32 {
    return add(mul(value, rule_f32(ramp)), rule_f32(ramp + 1u));
}

fn ramp(value: f32, ramp: u32) -> f32 {
    return clamp(along(value, ramp), 0.0, 1.0);
}

fn steepness(up: f32) -> f32 {
    return min(mul(sub(1.0, up), rule_f32(SLOPE_SCALE)), 1.0);
}

fn scree_share(rubble: f32, steepness: f32, noise: f32) -> f32 {
    if same[job.rule + HAS_SCREE] == 0u {
        return 0.0;
    }
    let come = mul(rubble, add(1.0, mul(noise, 0.9)));
    return mul(clamp(sub(mul(come, 2.5), 0.3), 0.0, 1.0), ramp(steepness, SCREE));
}

const AGAINST_TREE_LINE: f32 = 1.6;
const AGAINST_STEEP: f32 = 1.2;
const AGAINST_MEADOW: f32 = 1.0;
const LAST: f32 = 4.0;

// Returns the share of the remaining ground that is forest, where no water is near.
fn forest_share(height_m: f32, steepness: f32, around: f32, noise: f32) -> f32 {
    let high = max(along(height_m, TREE_LINE), 0.0);
    let steep = max(along(steepness, TOO_STEEP), 0.0);
    let meadow = sub(1.0, ramp(around, NO_MEADOW));
    let against =
        add(add(mul(high, AGAINST_TREE_LINE), mul(steep, AGAINST_STEEP)), mul(meadow, AGAINST_MEADOW));
    let score = add(add(noise, rule_f32(FOREST_BIAS)), sub(0.0, against));
    let stands = clamp(add(mul(score, rule_f32(FOREST_EDGE)), 0.5), 0.0, 1.0);
    let low_enough = clamp(mul(sub(1.0, high), LAST), 0.0, 1.0);
    return mul(mul(stands, low_enough), clamp(mul(sub(1.0, steep), LAST), 0.0, 1.0));
}

// As in normals.rs: the rise of the land to the east and to the south, in metres per metre.

fn rises(land: u32, width: u32) -> vec2<f32> {
    let scale = rule_f32(HALF_PER_SPACING);
    return vec2(
        mul(sub(plane_f32(land + 1u), plane_f32(land - 1u)), scale),
        mul(sub(plane_f32(land + width), plane_f32(land - width)), scale),
    );
}

fn square(rises: vec2<f32>) -> f32 {
    return add(mul(rises.x, rises.x), mul(rises.y, rises.y));
}

// As in surroundings.rs.

const REACH: u32 = 7u;

// Returns the offset of a vertex's land. `at` is its position relative to the north-western vertex of the tile extended
// by `pad`.
fn land_at(band: Band, at: vec2<u32>, pad: u32) -> u32 {
    return band.land + (at.y + band.pad.y - pad) * band.width + (at.x + band.pad.x - pad);
}

@compute @workgroup_size(SIDE, SIDE)
fn rock(@builtin(global_invocation_id) id: vec3<u32>) {
    let band = band(id.z);
    let wide = band.cells + 2u * REACH;
    if id.x >= wide.x || id.y >= wide.y || band.cells.x == 0u {
        return;
    }
    let up = div(1.0, root(add(square(rises(land_at(band, id.xy, REACH), band.width)), 1.0)));
    put_f32(band.rubble.x + id.y * wide.x + id.x, ramp(steepness(up), ROCK));
}

// Step of this round in vertices, reach of the rounds after it, and number of the round, which selects the plane that
// it reads.
override STEP: u32 = 4u;
override LEFT: u32 = 3u;
override ROUND: u32 = 0u;

@compute @workgroup_size(SIDE, SIDE)
fn spread(@builtin(global_invocation_id) id: vec3<u32>) {
    let band = band(id.z);
    let wide = band.cells + 2u * LEFT;
    if id.x >= wide.x || id.y >= wide.y || band.cells.x == 0u {
        return;
    }
    let is_even = (ROUND & 1u) == 0u;
    let source = select(band.rubble.y, band.rubble.x, is_even);
    let target_plane = select(band.rubble.x, band.rubble.y, is_even);
    let source_width = wide.x + 2u * STEP;
    let here = source + (id.y + STEP) * source_width + id.x + STEP;
    let land = land_at(band, id.xy, LEFT);
    let here_m = plane_f32(land);
    let round = ROUNDS + 4u * ROUND;
    var most = plane_f32(here);
    for (var neighbour = 0u; neighbour < 9u; neighbour += 1u) {
        let south = neighbour / 3u;
        let east = neighbour % 3u;
        if south == 1u && east == 1u {
            continue;
        }
        let has = plane_f32(here + (south * STEP * source_width + east * STEP) - (STEP * source_width + STEP));
        if has <= 0.0 {
            continue;
        }
        let there_m = plane_f32(land + (south * STEP * band.width + east * STEP) - (STEP * band.width + STEP));
        let way = select(0u, 1u, south != 1u && east != 1u);
        let rolls =
            clamp(add(mul(sub(there_m, here_m), rule_f32(round + 2u + way)), rule_f32(ROLL_SHIFT)), 0.0, 1.0);
        most = max(most, sub(mul(has, rolls), rule_f32(round + way)));
    }
    put_f32(target_plane + id.y * wide.x + id.x, most);
}

// As in blend.rs.

const FLOOR: u32 = 3u;

fn steepest_around(band: Band, land: u32) -> f32 {
    let here = plane_f32(land);
    let across = max(abs(sub(plane_f32(land - FLOOR), here)), abs(sub(plane_f32(land + FLOOR), here)));
    let south = FLOOR * band.width;
    let along = max(abs(sub(plane_f32(land - south), here)), abs(sub(plane_f32(land + south), here)));
    let rise = mul(max(across, along), rule_f32(FLOOR_SCALE));
    return steepness(div(1.0, root(add(mul(rise, rise), 1.0))));
}

// Returns a share of a weight, rounded.
fn take(weight: u32, share: f32) -> u32 {
    return bitcast<u32>(i32(trunc(add(mul(f32(weight), share), 0.5))));
}

// Returns a vertex's weights after a material covers a share of it. The material is dirt (1) or sand (3) of the
// ground's word.
fn covered(words: vec2<u32>, material: u32, share: f32) -> vec2<u32> {
    let parts = u32(add(mul(share, 255.0), 0.5));
    var given = 0u;
    var left = vec2(0u, 0u);
    for (var channel = 0u; channel < 8u; channel += 1u) {
        let word = select(words.x, words.y, channel >= 4u);
        let shift = 8u * (channel & 3u);
        let weight = (word >> shift) & 0xffu;
        let part = (weight * parts + 127u) / 255u;
        given += part;
        let rest = (weight - part) << shift;
        if channel < 4u {
            left.x |= rest;
        } else {
            left.y |= rest;
        }
    }
    return vec2(left.x + (given << (8u * material)), left.y);
}

@compute @workgroup_size(SIDE, SIDE)
fn surface(@builtin(global_invocation_id) id: vec3<u32>) {
    let band = band(id.z);
    if id.x >= band.cells.x || id.y >= band.cells.y {
        return;
    }
    let here = id.y * band.cells.x + id.x;
    let plane = band.cells.x * band.cells.y;
    let land = land_at(band, id.xy, 0u);
    let rises = rises(land, band.width);
    let square = square(rises);
    let up = div(1.0, root(add(square, 1.0)));
    let south = mul(-rises.y, up);
    put_f32(band.out + here, mul(-rises.x, up));
    put_f32(band.out + plane + here, up);
    put_f32(band.out + 2u * plane + here, south);
    put_f32(band.out + 3u * plane + here, root(square));
    // Each material takes its share of what the materials before it have left.
    let height = plane_f32(land);
    let steepness = steepness(up);
    let looks_around = same[job.rule + LOOKS_AROUND] != 0u;
    let snow_height = sub(height, mul(south, rule_f32(SNOW_NORTH_M)));
    let snow = take(255u, mul(ramp(snow_height, SNOW), sub(1.0, ramp(steepness, SNOW_SLIDES))));
    var left = 255u - snow;
    var cover = snow;
    let bare = ramp(steepness, ROCK);
    let rock = take(left, bare);
    left -= rock;
    var rough = 1.0;
    if looks_around {
        rough = 0.0;
        if same[job.rule + HAS_NOISE] != 0u {
            rough = plane_f32(band.noise + here);
        }
        var rubble = 0.0;
        if same[job.rule + HAS_SCREE] != 0u {
            rubble = plane_f32(band.rubble.y + here);
        }
        let scree = take(left, scree_share(sub(rubble, bare), steepness, rough));
        left -= scree;
        cover |= scree << 16u;
    }
    let flat = sub(1.0, ramp(steepness, STEEP_SAND));
    let sand = take(left, mul(sub(1.0, ramp(height, NO_SAND)), flat));
    left -= sand;
    if looks_around {
        let forest_height = sub(height, mul(south, rule_f32(FOREST_NORTH_M)));
        let forest = take(left, forest_share(forest_height, steepness, steepest_around(band, land), rough));
        left -= forest;
        cover |= forest << 8u;
    }
    let dirt = take(left, ramp(steepness, DIRT));
    let grass = left - dirt;
    var words = vec2((grass | (dirt << 8u)) | ((rock << 16u) | (sand << 24u)), cover);
    if band.lines != 0u {
        let imprint = band.imprint + land - band.land;
        let size = band.width * band.height;
        let sandy = plane_f32(imprint + size);
        if sandy > 0.0 {
            words = covered(words, 3u, sandy);
        }
        let dirty = plane_f32(imprint + 3u * size);
        if dirty > 0.0 {
            words = covered(words, 1u, dirty);
        }
    }
    planes[band.out + 4u * plane + here] = words.x;
    planes[band.out + 5u * plane + here] = words.y;
}
