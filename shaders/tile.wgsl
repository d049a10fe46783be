// Tiles made of land, one thread per vertex: carved lines, normals, slopes, and the materials of the ground. Functions
// have the names of their counterparts in src/lines and src/tile.
//
// Compiled after job.wgsl and exact.wgsl. All arithmetic on numbers with a fraction uses add, sub, mul, div and root of
// exact.wgsl.

// As in nearest.rs.

struct Nearest {
    outside_m: f32,
    floor_m: f32,
}

const FAR: f32 = 3.0e38;

fn is_within(near: vec4i, column: i32, row: i32) -> bool {
    return column >= near.x && row >= near.y && column < near.z && row < near.w;
}

fn between(ends: vec2f, share: f32) -> f32 {
    return add(ends.x, mul(sub(ends.y, ends.x), share));
}

// Returns the distance of a vertex from the edge of a line's piece, and the floor of the piece at the nearest point.
// `x` and `y` are relative to the line's origin.
fn nearest(piece: PieceWords, x: f32, y: f32, spacing_m: f32) -> Nearest {
    let along_east = sub(piece.end.x, piece.begin.x);
    let along_south = sub(piece.end.y, piece.begin.y);
    let square = add(mul(along_east, along_east), mul(along_south, along_south));
    let east = sub(x, piece.begin.x);
    let south = sub(y, piece.begin.y);
    var share = 0.0;
    if square > 0.0 {
        share = clamp(div(add(mul(east, along_east), mul(south, along_south)), square), 0.0, 1.0);
    }
    let off_east = sub(east, mul(along_east, share));
    let off_south = sub(south, mul(along_south, share));
    let distance_m = mul(root(add(mul(off_east, off_east), mul(off_south, off_south))), spacing_m);
    return Nearest(sub(distance_m, between(piece.half_width_m, share)), between(piece.floor_m, share));
}

fn fade(distance: f32) -> f32 {
    let rest = sub(1.0, clamp(distance, 0.0, 1.0));
    return mul(mul(rest, rest), sub(3.0, mul(2.0, rest)));
}

// As in imprint.rs, dug.rs and trodden.rs. The planes of the imprint are cut, sand, water and dirt.

@compute @workgroup_size(SIDE, SIDE)
fn carve(@builtin(global_invocation_id) id: vec3<u32>) {
    let band = own_BandWords(id.z * BAND_WORDS);
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
    var line_at = band.lines + 1u;
    for (var left = own[band.lines]; left > 0u; left -= 1u) {
        let line = own_LineWords(line_at);
        var place = Nearest(FAR, 0.0);
        if is_within(line.near, column, row) {
            let x = f32(column + line.corner.x);
            let y = f32(row + line.corner.y);
            for (var number = 0u; number < line.pieces; number += 1u) {
                let piece = own_PieceWords(line_at + LINE_WORDS + number * PIECE_WORDS);
                if is_within(piece.near, column, row) {
                    let other = nearest(piece, x, y, line.spacing_m);
                    // On a tie the piece further up the line wins.
                    if other.outside_m < place.outside_m {
                        place = other;
                    }
                }
            }
        }
        if place.outside_m < line.bank_m {
            let share = fade(div(place.outside_m, line.bank_m));
            if line.kind >= TRODDEN {
                dirt = max(dirt, share);
                // The nearest road wins, and of two equally near roads the higher one.
                if line.kind == GRADED && (share > grade || (share == grade && place.floor_m > level_m)) {
                    grade = share;
                    level_m = place.floor_m;
                }
            } else {
                cut_m = max(cut_m, mul(max(sub(bare_m, place.floor_m), 0.0), share));
                sand = max(sand, fade(div(mul(2.0, place.outside_m), line.bank_m)));
                water = max(water, clamp(sub(0.5, div(place.outside_m, line.spacing_m)), 0.0, 1.0));
            }
        }
        line_at += LINE_WORDS + line.pieces * PIECE_WORDS;
    }
    let levelled_m = add(bare_m, mul(sub(level_m, bare_m), grade));
    put_f32(band.land + here, sub(levelled_m, cut_m));
    let plane = band.width * band.height;
    put_f32(band.imprint + here, cut_m);
    put_f32(band.imprint + plane + here, sand);
    put_f32(band.imprint + 2u * plane + here, water);
    put_f32(band.imprint + 3u * plane + here, dirt);
}

// As in rule.rs.

fn ground_rule() -> RuleWords {
    return same_RuleWords(job.rule);
}

fn along(value: f32, ramp: vec2f) -> f32 {
    return add(mul(value, ramp.x), ramp.y);
}

fn ramp(value: f32, ramp: vec2f) -> f32 {
    return clamp(along(value, ramp), 0.0, 1.0);
}

fn steepness(up: f32) -> f32 {
    return min(mul(sub(1.0, up), ground_rule().slope_scale), 1.0);
}

fn scree_share(rubble: f32, steepness: f32, noise: f32) -> f32 {
    if ground_rule().has_scree == 0u {
        return 0.0;
    }
    let come = mul(rubble, add(1.0, mul(noise, 0.9)));
    return mul(clamp(sub(mul(come, 2.5), 0.3), 0.0, 1.0), ramp(steepness, ground_rule().scree));
}

// Returns the share of the remaining ground that is forest, where no water is near.
fn forest_share(height_m: f32, steepness: f32, around: f32, noise: f32) -> f32 {
    let rule = ground_rule();
    let high = max(along(height_m, rule.tree_line), 0.0);
    let steep = max(along(steepness, rule.too_steep), 0.0);
    let meadow = sub(1.0, ramp(around, rule.no_meadow));
    let against = add(add(mul(high, TREE_LINE), mul(steep, STEEP)), mul(meadow, MEADOW));
    let score = add(add(noise, rule.forest_bias), sub(0.0, against));
    let stands = clamp(add(mul(score, rule.forest_edge), 0.5), 0.0, 1.0);
    let low_enough = clamp(mul(sub(1.0, high), LAST), 0.0, 1.0);
    return mul(mul(stands, low_enough), clamp(mul(sub(1.0, steep), LAST), 0.0, 1.0));
}

// As in normals.rs: the rise of the land to the east and to the south, in metres per metre.

fn rises(land: u32, width: u32) -> vec2<f32> {
    let scale = ground_rule().half_per_spacing;
    return vec2(
        mul(sub(plane_f32(land + 1u), plane_f32(land - 1u)), scale),
        mul(sub(plane_f32(land + width), plane_f32(land - width)), scale),
    );
}

fn square(rises: vec2<f32>) -> f32 {
    return add(mul(rises.x, rises.x), mul(rises.y, rises.y));
}

// As in surroundings.rs.

// Returns the offset of a vertex's land. `at` is its position relative to the north-western vertex of the tile extended
// by `pad`.
fn land_at(band: BandWords, at: vec2<u32>, pad: u32) -> u32 {
    return band.land + (at.y + band.pad.y - pad) * band.width + (at.x + band.pad.x - pad);
}

@compute @workgroup_size(SIDE, SIDE)
fn rock(@builtin(global_invocation_id) id: vec3<u32>) {
    let band = own_BandWords(id.z * BAND_WORDS);
    let wide = band.cells + 2u * REACH;
    if id.x >= wide.x || id.y >= wide.y || band.cells.x == 0u {
        return;
    }
    let up = div(1.0, root(add(square(rises(land_at(band, id.xy, REACH), band.width)), 1.0)));
    put_f32(band.rubble.x + id.y * wide.x + id.x, ramp(steepness(up), ground_rule().rock));
}

// Step of this round in vertices, reach of the rounds after it, and number of the round, which selects the plane that
// it reads.
override STEP: u32 = 4u;
override LEFT: u32 = 3u;
override ROUND: u32 = 0u;

@compute @workgroup_size(SIDE, SIDE)
fn spread(@builtin(global_invocation_id) id: vec3<u32>) {
    let band = own_BandWords(id.z * BAND_WORDS);
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
    let round = same_RoundWords(job.rule + RULE_WORDS + ROUND_WORDS * ROUND);
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
        let rolls = clamp(add(mul(sub(there_m, here_m), round.roll_scales[way]), ROLL_SHIFT), 0.0, 1.0);
        most = max(most, sub(mul(has, rolls), round.losses[way]));
    }
    put_f32(target_plane + id.y * wide.x + id.x, most);
}

// As in blend.rs.

fn steepest_around(band: BandWords, land: u32) -> f32 {
    let here = plane_f32(land);
    let across = max(abs(sub(plane_f32(land - FLOOR), here)), abs(sub(plane_f32(land + FLOOR), here)));
    let south = FLOOR * band.width;
    let along = max(abs(sub(plane_f32(land - south), here)), abs(sub(plane_f32(land + south), here)));
    let rise = mul(max(across, along), ground_rule().floor_scale);
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
    let band = own_BandWords(id.z * BAND_WORDS);
    if id.x >= band.cells.x || id.y >= band.cells.y {
        return;
    }
    let rule = ground_rule();
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
    let looks_around = rule.looks_around != 0u;
    let snow_height = sub(height, mul(south, rule.snow_north_m));
    let snow = take(255u, mul(ramp(snow_height, rule.snow), sub(1.0, ramp(steepness, rule.snow_slides))));
    var left = 255u - snow;
    var cover = snow;
    let bare = ramp(steepness, rule.rock);
    let rock = take(left, bare);
    left -= rock;
    var rough = 1.0;
    if looks_around {
        rough = 0.0;
        if rule.has_noise != 0u {
            rough = plane_f32(band.noise + here);
        }
        var rubble = 0.0;
        if rule.has_scree != 0u {
            rubble = plane_f32(band.rubble.y + here);
        }
        let scree = take(left, scree_share(sub(rubble, bare), steepness, rough));
        left -= scree;
        cover |= scree << 16u;
    }
    let flat = sub(1.0, ramp(steepness, rule.steep_sand));
    let sand = take(left, mul(sub(1.0, ramp(height, rule.no_sand)), flat));
    left -= sand;
    if looks_around {
        let forest_height = sub(height, mul(south, rule.forest_north_m));
        let forest = take(left, forest_share(forest_height, steepness, steepest_around(band, land), rough));
        left -= forest;
        cover |= forest << 8u;
    }
    let dirt = take(left, ramp(steepness, rule.dirt));
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
