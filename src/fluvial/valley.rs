//! Valleys: the lowest of the valley sides that rise from the channels around a vertex.
//!
//! From a channel the land rises as `slope * (sqrt(d^2 + f^2) - f)` with the distance d from its water: rounded over
//! the width f of its floor, then straight. The lowest of all sides has no pits: away from a channel its own side falls
//! to it, and along a channel the bed falls. Where two sides meet is a crest, sharp or rounded.
//!
//! Vertices, or every so many of them, are done in patches aligned with the world, each with the segments that can be
//! lowest in it: a bound on how steep sides are tells which cannot, so leaving them out changes nothing. In three
//! steps, each with what the one before has left: segments by their reach and those that may be lowest in a block of
//! patches, those that may be lowest in a patch, the lowest at a vertex.

use super::fields::Fields;
use super::point::{GRAINS, Point};
use super::segment::{Reach, Segments};
use super::valley_side::{CROSS_FALL, Columns, LEAST_HALF_WIDTH, LaneSegment};
use crate::area::Area;
use crate::simd::{Kernel, MAX_LANES, Simd};

/// Vertices of a patch: across, and down. As wide as the widest lanes.
pub const PATCH: (usize, usize) = (16, 4);

/// Patches of a block, for which segments are picked before they are for each patch: 32 x 32 vertices. Larger ones
/// would leave more segments to each patch, smaller ones look at all segments more often.
const BLOCK: (usize, usize) = (2, 8);

/// Cells of the finest level within which a brook can matter to a vertex, where its sides are as steep as the hill;
/// measured: of 25,000 vertices of six worlds a dozen are reached over 3 to 4.5.
const BROOK_CELLS: i64 = 7;

/// Cells of the finest level within which any channel matters to one.
const MOST_CELLS: i64 = 24;

/// How far from a vertex, once it is displaced, channels matter.
pub fn reach(fields: &Fields) -> Reach {
    let [brook, most] = [BROOK_CELLS, MOST_CELLS].map(|cells| (cells * fields.side(fields.levels() - 1)) as f64);
    Reach { brook, most, least_cross: fields.least_cross() }
}

/// The area of nodes that valleys are made for together with those of an area: whole patches.
pub fn input(area: Area) -> Area {
    let (across, down) = (PATCH.0 as i64, PATCH.1 as i64);
    Area {
        x0: area.x0.div_euclid(across) * across,
        y0: area.y0.div_euclid(down) * down,
        x1: (area.x1 + across - 1).div_euclid(across) * across,
        y1: (area.y1 + down - 1).div_euclid(down) * down,
    }
}

/// What the valleys are around each node of an area whose sides are multiples of a patch's.
#[derive(Debug, Default)]
pub struct Valleys {
    /// Height in metres, before strata, ceiling and gullies.
    pub height_m: Vec<f32>,
    /// Height in metres of the channel that the vertex drains to, where it is nearest.
    pub level_m: Vec<f32>,
    /// Metres that the next-best side of another channel lies higher: 0 on a crest, and no more than is
    /// [told](FillValleys::told_m).
    pub crest_m: Vec<f32>,
    /// How steep the land is where crests and floors are rounded, as a share of the hillside's slope.
    pub steepness: Vec<f32>,
    /// Metres from the middle of the channel.
    pub distance_m: Vec<f32>,
    /// Unit vector of the way in which the land rises, in the warped plane.
    pub away: [Vec<f32>; 2],
    /// The number of the segment that the vertex drains to.
    pub segment: Vec<u32>,
    /// The share of the segment at which it is nearest.
    pub share: Vec<f32>,
}

impl Valleys {
    /// Room for some vertices.
    pub fn with_len(len: usize) -> Valleys {
        let floats = || vec![0.0; len];
        Valleys {
            height_m: floats(),
            level_m: floats(),
            crest_m: floats(),
            steepness: floats(),
            distance_m: floats(),
            away: [floats(), floats()],
            segment: vec![0; len],
            share: floats(),
        }
    }
}

/// The computation of the valleys of an area.
pub struct FillValleys<'a> {
    /// The fields.
    pub fields: &'a Fields,
    /// An area of nodes, aligned with patches.
    pub area: Area,
    /// Vertices from a node to the next, a power of two; with 1 the nodes are the vertices.
    pub step: i64,
    /// Metres by which each vertex is displaced before the valleys are read.
    pub warp: [&'a [f32]; 2],
    /// Slope of the hillsides at each vertex.
    pub slope: &'a [f32],
    /// Metres above the lowest side up to which the next-best one is told. What is higher is left out of a patch or not
    /// by what else is in it, so nobody may read it.
    pub told_m: f32,
    /// The segments around the area, at least all whose [reach](Segment::reach) holds
    /// a displaced node.
    pub segments: &'a Segments,
    /// Where it is written.
    pub out: &'a mut Valleys,
}

/// Where a group of vertices is once warped: all within a circle, whose middle and radius are in metres.
struct Spread {
    middle: [f32; 2],
    radius: f32,
    /// The gentlest and the steepest slope of their hillsides.
    slope: [f32; 2],
}

impl Kernel for FillValleys<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let (across, down) = (BLOCK.0 * PATCH.0, BLOCK.1 * PATCH.1);
        let Area { x0, y0, x1, y1 } = self.area;
        let mut work = Work::default();
        let reach = reach(self.fields);
        for (number, segment) in self.segments.all.iter().enumerate() {
            work.all.push(self.fields, segment, number as u32, reach);
        }
        let mut this = self;
        let mut y = y0.div_euclid(down as i64) * down as i64;
        while y < y1 {
            let mut x = x0.div_euclid(across as i64) * across as i64;
            while x < x1 {
                // The part of the block that is wanted.
                let part = Area {
                    x0: x.max(x0),
                    y0: y.max(y0),
                    x1: (x + across as i64).min(x1),
                    y1: (y + down as i64).min(y1),
                };
                this.block(simd, [x, y], part, &mut work);
                x += across as i64;
            }
            y += down as i64;
        }
    }
}

/// The segments of an area, those that may reach a block, and those that may be lowest in it; of these the ones that may
/// be lowest in a patch, by their index; and their limits there.
#[derive(Default)]
struct Work {
    all: Columns,
    near: Columns,
    block: Columns,
    patch: Vec<usize>,
    limits: SegmentLimits,
}

/// The limits of segments over a group of vertices.
#[derive(Default)]
struct SegmentLimits {
    /// Metres by which a segment's side is lower, at its lowest, than what is lowest can be: above 0 it never is.
    low: Vec<f32>,
    /// Metres that are left of its reach at the middle of the group.
    left: Vec<f32>,
}

impl FillValleys<'_> {
    /// Metres between nodes.
    fn spacing_m(&self) -> f32 {
        (self.fields.metres_a_grain() * (GRAINS * self.step) as f64) as f32
    }

    /// The valleys of a part of a block whose north-western vertex is `corner`, patch by patch.
    #[inline(always)]
    fn block<S: Simd>(&mut self, simd: S, corner: [i64; 2], part: Area, work: &mut Work) {
        let Work { all, near, block, patch, limits } = work;
        let corner_point = Point::at_vertex(corner[0] * self.step, corner[1] * self.step);
        let offset = corner_point.from(self.segments.origin);
        let spread = self.spread(corner, part);
        // Segments that may reach it, by their bounding rectangles; from here on in metres from the block's corner,
        // which are exact enough in f32 wherever in the world that is.
        near.clear();
        let metres = self.fields.metres_a_grain();
        // A little more than the radius, for its rounding.
        let around = (spread.radius * 1.01) as f64;
        for (number, segment) in self.segments.all.iter().enumerate() {
            let reach = all.reach[number] as f64 + around;
            let from = [0, 1].map(|axis| (segment.from[axis] - offset[axis]) * metres);
            let is_near = |axis: usize| {
                let start = from[axis] - spread.middle[axis] as f64;
                let end = start + segment.along[axis] * metres;
                start.min(end) <= reach && start.max(end) >= -reach
            };
            if is_near(0) && is_near(1) {
                near.push_from(all, number, from.map(|part| part as f32));
            }
        }
        near.pad();
        // Of those the ones that may be lowest somewhere in the near. A segment whose reach ends within it bounds
        // nothing: in some of its patches it does not count.
        self.measure(simd, near, &spread, around as f32, limits);
        block.clear();
        for index in lowest(near, limits, f32::NEG_INFINITY) {
            block.push_from(near, index, [near.from[0][index], near.from[1][index]]);
        }
        block.pad();
        // The same again for each patch, whose circle is smaller.
        let mut y = part.y0;
        while y < part.y1 {
            let mut x = part.x0;
            while x < part.x1 {
                let vertices = Area { x0: x, y0: y, x1: x + PATCH.0 as i64, y1: y + PATCH.1 as i64 };
                let spread = self.spread(corner, vertices);
                self.measure(simd, block, &spread, 0.0, limits);
                patch.clear();
                patch.extend(lowest(block, limits, 0.0));
                self.patch(simd, corner, vertices, block, patch);
                x += PATCH.0 as i64;
            }
            y += PATCH.1 as i64;
        }
    }

    /// Where the vertices of a part of a block are once warped, in metres from the block's corner.
    #[inline(always)]
    fn spread(&self, corner: [i64; 2], part: Area) -> Spread {
        let spacing_m = self.spacing_m();
        let (mut least, mut most) = ([f32::INFINITY; 2], [f32::NEG_INFINITY; 2]);
        let mut slope = [f32::INFINITY, f32::NEG_INFINITY];
        for y in part.y0..part.y1 {
            let row = (y - self.area.y0) as usize * self.area.width();
            for x in part.x0..part.x1 {
                let index = row + (x - self.area.x0) as usize;
                let at = [
                    (x - corner[0]) as f32 * spacing_m + self.warp[0][index],
                    (y - corner[1]) as f32 * spacing_m + self.warp[1][index],
                ];
                for axis in [0, 1] {
                    least[axis] = least[axis].min(at[axis]);
                    most[axis] = most[axis].max(at[axis]);
                }
                slope = [slope[0].min(self.slope[index]), slope[1].max(self.slope[index])];
            }
        }
        let half = [(most[0] - least[0]) / 2.0, (most[1] - least[1]) / 2.0];
        let radius = (half[0] * half[0] + half[1] * half[1]).sqrt();
        Spread { middle: [least[0] + half[0], least[1] + half[1]], radius, slope }
    }

    /// Half width in metres of the part of a river that is level across.
    fn level_floor_m(&self) -> f32 {
        (LEAST_HALF_WIDTH * GRAINS as f64 * self.fields.metres_a_grain()) as f32
    }

    /// SegmentLimits of each segment's side over a group of vertices: the lowest that it can be, less the highest that the
    /// lowest of all can be; and what is left of its reach, in metres, once it has come to the middle. The lowest is
    /// one of those whose reach goes on for `beyond_m` from there: of a block's segments, one that matters to all of
    /// its patches.
    #[inline(always)]
    fn measure<S: Simd>(
        &self,
        simd: S,
        segments: &Columns,
        spread: &Spread,
        beyond_m: f32,
        limits: &mut SegmentLimits,
    ) {
        let len = segments.number.len();
        limits.low.resize(len, 0.0);
        limits.left.resize(len, 0.0);
        let middle = [simd.splat(spread.middle[0]), simd.splat(spread.middle[1])];
        let (gentle, steep) = (simd.splat(spread.slope[0]), simd.splat(spread.slope[1]));
        // A little more than the true one, for what rounding does.
        let radius = simd.splat(spread.radius * (1.001 + 1.1 * CROSS_FALL) + 0.01);
        let level_floor = self.level_floor_m();
        let (infinity, beyond) = (simd.splat(f32::INFINITY), simd.splat(beyond_m));
        let mut lowest = infinity;
        for start in (0..len).step_by(S::LANES) {
            let segment = LaneSegment::load(simd, segments, start, level_floor);
            let side = segment.side(simd, middle);
            // By how much a side may differ from what it is in the middle: no more than it changes in a radius, along
            // the segment and across it.
            let distance = simd.sqrt(side.square);
            let (steepness, change) = (simd.load(&segments.steepness[start..]), simd.load(&segments.change[start..]));
            let turned = steep * change * (distance + radius);
            let slack = (steep + steepness * (simd.splat(1.0) + steep) + turned) * radius;
            let left = simd.load(&segments.reach[start..]) - distance;
            // The lowest of the highest: what is always higher than that is never lowest.
            let highest = side.level + steep * side.rise + slack;
            lowest = simd.min(lowest, simd.select(simd.lt(left, beyond), infinity, highest));
            simd.store(side.level + gentle * side.rise - slack, &mut limits.low[start..]);
            simd.store(left, &mut limits.left[start..]);
        }
        let mut lanes = [0.0; MAX_LANES];
        simd.store(lowest, &mut lanes);
        let lowest = lanes[..S::LANES].iter().fold(f32::INFINITY, |a, b| a.min(*b));
        let limit = lowest + self.told_m;
        for low in &mut limits.low {
            *low -= limit;
        }
    }

    /// The valleys of one patch, whose vertices lie in lanes, given which segments may be lowest in it.
    #[inline(always)]
    fn patch<S: Simd>(&mut self, simd: S, corner: [i64; 2], vertices: Area, segments: &Columns, patch: &[usize]) {
        let spacing_m = simd.splat(self.spacing_m());
        let crest_m = simd.splat(self.fields.settings().crest_m as f32);
        let (zero, three) = (simd.splat(0.0), simd.splat(3.0));
        let level_floor = self.level_floor_m();
        for row in 0..PATCH.1 {
            let y = vertices.y0 + row as i64;
            for column in (0..PATCH.0).step_by(S::LANES) {
                let x = vertices.x0 + column as i64;
                let index = (y - self.area.y0) as usize * self.area.width() + (x - self.area.x0) as usize;
                let columns = simd.i32_to_f32(simd.lane_numbers() + simd.splat_i32((x - corner[0]) as i32));
                let at = [
                    columns * spacing_m + simd.load(&self.warp[0][index..]),
                    simd.splat((y - corner[1]) as f32) * spacing_m + simd.load(&self.warp[1][index..]),
                ];
                let slope = simd.load(&self.slope[index..]);
                // The lowest side and the second-lowest of another channel, between which the crest is; and the room
                // that there is to round it.
                let far = simd.splat(f32::MAX);
                let (mut best, mut second, mut room) = (far, far, far);
                let (mut level, mut off, mut share) = (zero, [zero, zero], zero);
                let (mut cross, mut bed) = (zero, [zero, zero]);
                let (mut channel, mut number) = (simd.splat_u32(u32::MAX), simd.splat_u32(u32::MAX));
                for &segment in patch {
                    let candidate = LaneSegment::splat(simd, segments, segment, level_floor);
                    let side = candidate.side(simd, at);
                    let height = side.level + slope * side.rise;
                    let own = simd.splat_u32(segments.channel[segment]);
                    let same = simd.eq_u32(own, channel);
                    let lower = simd.lt(height, best);
                    // What is not lowest, of another channel than what is: segments of one channel have no crest
                    // between them. They come one after the other, so what was second stays.
                    let rest = simd.select(lower, best, height);
                    second = simd.select(same, second, simd.min(rest, second));
                    room = simd.min(room, three * height - side.level);
                    best = simd.select(lower, height, best);
                    level = simd.select(lower, side.level, level);
                    off = [simd.select(lower, side.off[0], off[0]), simd.select(lower, side.off[1], off[1])];
                    share = simd.select(lower, side.share, share);
                    cross = simd.select(lower, side.cross, cross);
                    bed = [simd.select(lower, side.bed[0], bed[0]), simd.select(lower, side.bed[1], bed[1])];
                    channel = simd.select_u32(lower, own, channel);
                    number = simd.select_u32(lower, simd.splat_u32(segments.number[segment]), number);
                }
                // Round the crest, by no more than it stands above a channel: the least of (height - level) and twice
                // what a side is higher than the best, which has no step where the best or the second changes.
                let gap = second - best;
                let round = simd.max(simd.min(crest_m, room - (best + best)), zero);
                let over = simd.max(round - gap, zero);
                // A fourth would round a crest off; as the room shrinks downhill, more than a fifth would leave a
                // furrow.
                let lowered = over * over / (simd.max(round, simd.splat(1e-3)) * simd.splat(5.0));
                let steepness = simd.min(gap / simd.max(round, simd.splat(1e-3)), simd.splat(1.0));
                let distance = simd.sqrt(off[0] * off[0] + off[1] * off[1]);
                // The slope of a floor of radius f is d / sqrt(d^2 + f^2), and what it has risen tells f.
                let steep = slope * cross;
                let risen = (best - level) / steep;
                let floor = (risen + risen) * distance / (distance * distance + risen * risen + simd.splat(1e-3));
                let floor = simd.max(simd.min(floor, simd.splat(1.0)), zero);
                let steepness = steepness * floor;
                // What the land rises across the channel and along it: on a steep brook's sides the fall line is aslant.
                let across = steep * floor / simd.max(distance, simd.splat(1e-3));
                let rise = [off[0] * across + bed[0], off[1] * across + bed[1]];
                let steepest = simd.sqrt(rise[0] * rise[0] + rise[1] * rise[1]);
                let per_rise = simd.splat(1.0) / simd.max(steepest, simd.splat(1e-6));
                simd.store(best - lowered, &mut self.out.height_m[index..]);
                simd.store(level, &mut self.out.level_m[index..]);
                simd.store(simd.min(gap, simd.splat(self.told_m)), &mut self.out.crest_m[index..]);
                simd.store(steepness, &mut self.out.steepness[index..]);
                simd.store(distance, &mut self.out.distance_m[index..]);
                simd.store(rise[0] * per_rise, &mut self.out.away[0][index..]);
                simd.store(rise[1] * per_rise, &mut self.out.away[1][index..]);
                simd.store(share, &mut self.out.share[index..]);
                simd.store_u32(number, &mut self.out.segment[index..]);
            }
        }
    }
}

/// The segments that may be lowest somewhere, by their index, of those whose reach goes on for so many metres.
#[inline(always)]
fn lowest<'a>(segments: &'a Columns, limits: &'a SegmentLimits, least_m: f32) -> impl Iterator<Item = usize> + 'a {
    let may_be = move |index: &usize| {
        limits.low[*index] <= 0.0 && limits.left[*index] >= least_m && segments.number[*index] != u32::MAX
    };
    (0..segments.number.len()).filter(may_be)
}
