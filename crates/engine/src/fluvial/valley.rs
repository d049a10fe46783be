//! Valleys: the lowest of the valley sides that rise from the channels around a vertex.
//!
//! The land rises from a channel with the distance from its water: first a floor that leans towards the water, then the
//! rounded foot of the side, then the straight side. The lowest of all sides has no pits: each side falls to its own
//! channel, and along a channel the bed falls. Where two sides meet there is a crest, sharp or rounded.
//!
//! Vertices, or nodes several vertices apart, are computed in patches aligned with the world, each with the segments
//! whose sides can be lowest in it. A bound on the slope of sides tells which segments cannot, so leaving them out
//! changes nothing. There are four steps, each with the segments that the one before has left: those that may be lowest
//! in a block of patches, in a quarter of the block, in a patch, and the lowest at a vertex.

use super::brook_relief::LaneRest;
use super::fields::Fields;
use super::hillsides::Hillsides;
use super::segment::{Reach, Segments};
use super::valley_side::{CROSS_FALL, Columns, FAR_STEEPER, Floor, LEAST_HALF_WIDTH, LaneSegment, LaneSide, column};
use crate::area::Area;
use crate::clock::Clock;
use crate::grain_point::{GRAINS, Point};
use crate::simd::{Kernel, MAX_LANES, Simd};
use crate::stop::Stopped;

/// Side of a patch in vertices. In a smaller patch fewer segments may be lowest; in a larger one more vertices share
/// the cost of finding them.
pub const PATCH: usize = 8;

/// Sides of a quarter of a block, and of a block, in patches. Segments are picked for a block and for a quarter before
/// they are picked for the parts of either. Larger ones would leave more segments to each patch, smaller ones would
/// look at all segments more often.
const QUARTER: usize = 2;
pub(super) const BLOCK: usize = 2 * QUARTER;

/// Distance in cells of the finest level within which a brook can matter to a vertex, if its sides are as steep as the
/// hill. Measured: of 25,000 vertices of six worlds a dozen are reached over 3 to 4.5 cells.
pub const BROOK_CELLS: i64 = 7;

/// Distance in cells of the finest level within which any channel matters to a vertex.
const MOST_CELLS: i64 = 24;

/// Largest error in metres of the height of a side due to rounding.
const ROUNDING_M: f32 = 0.02;

/// Returns the distances from a displaced vertex within which channels matter, for this number of levels.
pub fn reach(fields: &Fields, levels: u32) -> Reach {
    reach_to(fields, levels, BROOK_CELLS)
}

/// Returns [`reach`] for brooks that are looked for within `brook_cells` cells of the finest of these levels.
pub fn reach_to(fields: &Fields, levels: u32, brook_cells: i64) -> Reach {
    let [brook, most] = [brook_cells, MOST_CELLS].map(|cells| (cells * fields.side(levels - 1)) as f64);
    Reach { brook, most, least_cross: fields.least_cross() }
}

/// Returns the area of nodes whose valleys are computed together with those of an area: whole patches.
pub fn input(area: Area) -> Area {
    area.on_grid(PATCH as i64)
}

/// The valleys at each node of an area whose sides are multiples of a patch's.
#[derive(Debug, Default)]
pub struct Valleys {
    /// Height in metres, before strata, ceiling and gullies.
    pub height_m: Vec<f32>,
    /// Height in metres of the channel that the vertex drains to, at the channel's nearest place.
    pub level_m: Vec<f32>,
    /// Metres by which the next-best side, of another channel, lies higher: 0 on a crest, and no more than is
    /// [read](FillValleys::read_m).
    pub crest_m: Vec<f32>,
    /// Slope of the land as a share of the hillside's slope: less than 1 where crests and floors are rounded.
    pub steepness: Vec<f32>,
    /// Distance in metres from the middle of the channel.
    pub distance_m: Vec<f32>,
    /// Unit vector of the direction in which the land rises, in the warped plane.
    pub away: [Vec<f32>; 2],
    /// The number of the segment that the vertex drains to.
    pub segment: Vec<u32>,
    /// The share of the segment at which it is nearest to the vertex.
    pub share: Vec<f32>,
}

impl Valleys {
    /// Creates valleys with room for `len` vertices.
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
    /// The part of the area whose valleys are wanted, aligned in the same way: nothing is written elsewhere.
    pub part: Area,
    /// Vertices from a node to the next, a power of two; with 1 the nodes are the vertices.
    pub step: i64,
    /// Metres east and south by which each vertex is displaced before the valleys are read.
    pub warp: [&'a [f32]; 2],
    /// The hillsides at each vertex.
    pub hillsides: &'a Hillsides,
    /// Metres above the lowest side up to which the next-best side is exact, for those who read [`Valleys::crest_m`]. A
    /// higher side may be left out or not, by the other segments of its patch, unless it is needed to round crests.
    pub read_m: f32,
    /// The segments around the area, at least all whose [reach](Segment::reach) holds a displaced node.
    pub segments: &'a Segments,
    /// The valleys that are written.
    pub out: &'a mut Valleys,
    pub clock: &'a Clock,
}

/// The warped places of a group of vertices: a circle that holds them all, by its centre and radius in metres.
struct Spread {
    middle: [f32; 2],
    radius: f32,
    /// The gentlest and the steepest slope of the hillsides there.
    slope: [f32; 2],
    /// The most metres by which crests are rounded off there.
    crest_m: f32,
    /// The least and the greatest slope and height of [`Rest`] there.
    rest: Option<[[f32; 2]; 2]>,
}

/// The least and the greatest values of a group of warped places: metres east and south, the slope of the hillsides,
/// the slope and the height of [`Rest`], and the metres by which crests are rounded off.
#[derive(Clone, Copy)]
struct Extent {
    least: [f32; 6],
    most: [f32; 6],
}

impl Extent {
    /// The extent of no place.
    const NONE: Extent = Extent { least: [f32::INFINITY; 6], most: [f32::NEG_INFINITY; 6] };

    /// Returns the extent of the places of both.
    fn and(self, other: &Extent) -> Extent {
        Extent {
            least: [0, 1, 2, 3, 4, 5].map(|part| self.least[part].min(other.least[part])),
            most: [0, 1, 2, 3, 4, 5].map(|part| self.most[part].max(other.most[part])),
        }
    }

    /// Returns the circle that holds the places.
    fn spread(&self) -> Spread {
        let half = [0, 1].map(|axis| (self.most[axis] - self.least[axis]) / 2.0);
        Spread {
            middle: [0, 1].map(|axis| self.least[axis] + half[axis]),
            radius: (half[0] * half[0] + half[1] * half[1]).sqrt(),
            slope: [self.least[2], self.most[2]],
            crest_m: self.most[5],
            rest: (self.least[3] <= self.most[3]).then(|| [self.least, self.most].map(|ends| [ends[3], ends[4]])),
        }
    }
}

impl Kernel for FillValleys<'_> {
    type Output = Result<(), Stopped>;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Result<(), Stopped> {
        let mut work = Workspace::default();
        let reach = self.hillsides.reach;
        for (number, segment) in self.segments.all.iter().enumerate() {
            work.all.push(self.fields, segment, number as u32, reach);
            work.from[0].push(segment.from[0]);
            work.from[1].push(segment.from[1]);
        }
        work.all.pad();
        let mut this = self;
        for block in this.part.squares(BLOCK * PATCH) {
            this.clock.check()?;
            this.block(simd, block, &mut work);
        }
        Ok(())
    }
}

/// The segments of an area, and their upper ends in grains; the segments that may be lowest in a block, and in a
/// quarter of the block; the indices of those of the quarter that may be lowest in a patch; and the limits of segments.
#[derive(Default)]
struct Workspace {
    all: Columns,
    from: [Vec<f64>; 2],
    block: Columns,
    quarter: Columns,
    patch: Vec<usize>,
    limits: SegmentLimits,
    /// The patches of a block, and the extents of their warped vertices.
    patches: Vec<(Area, Extent)>,
}

/// The limits of segments over a group of vertices.
#[derive(Default)]
struct SegmentLimits {
    /// The lowest height in metres that a segment's side can have, less the greatest height at which a side matters:
    /// above 0, the segment never matters.
    low: Vec<f32>,
    /// Metres that are left of the segment's reach at the middle of the group.
    left: Vec<f32>,
    /// Lower bound in metres of the height of the segment's water where it is nearest to a vertex of the group.
    level: Vec<f32>,
}

impl FillValleys<'_> {
    /// Returns the distance between nodes in metres.
    fn spacing_m(&self) -> f32 {
        spacing_m(self.fields, self.step)
    }

    /// Computes the valleys of a part of a block, patch by patch.
    #[inline(always)]
    fn block<S: Simd>(&mut self, simd: S, part: Area, work: &mut Workspace) {
        let Workspace { all, from, block, quarter, patch, limits, patches } = work;
        // The north-western vertex of the whole block. Whichever part is asked for, places are measured from there in
        // metres, which are exact enough in f32 anywhere in the world.
        let corner = [part.x0, part.y0].map(|at| at.div_euclid((BLOCK * PATCH) as i64) * (BLOCK * PATCH) as i64);
        let corner_point = Point::at_vertex(corner[0] * self.step, corner[1] * self.step);
        let (offset, metres) = (corner_point.from(self.segments.origin), self.fields.metres_a_grain());
        for axis in [0, 1] {
            for (to, from) in all.values[column::FROM + axis].iter_mut().zip(&from[axis]) {
                *to = ((from - offset[axis]) * metres) as f32;
            }
        }
        let order = PatchLanes::new(simd);
        patches.clear();
        let mut whole = Extent::NONE;
        for vertices in part.squares(PATCH) {
            let extent = self.extent(simd, corner, vertices, order);
            whole = whole.and(&extent);
            patches.push((vertices, extent));
        }
        self.pick(simd, all, &whole.spread(), limits, block);
        for part in part.squares(QUARTER * PATCH) {
            let own = || patches.iter().filter(|(vertices, _)| part.contains(vertices));
            let whole = own().fold(Extent::NONE, |whole, (_, extent)| whole.and(extent));
            self.pick(simd, block, &whole.spread(), limits, quarter);
            for (vertices, extent) in own() {
                self.measure(simd, quarter, &extent.spread(), 0.0, limits);
                patch.clear();
                patch.extend(lowest(quarter, limits, 0.0));
                self.patch(simd, corner, *vertices, order, quarter, patch);
            }
        }
    }

    /// Puts those segments into `picked` that may be lowest somewhere in a group of patches. A segment whose reach ends
    /// within the group does not rule out others, as it does not count in some of the patches.
    #[inline(always)]
    fn pick<S: Simd>(
        &self,
        simd: S,
        segments: &Columns,
        spread: &Spread,
        limits: &mut SegmentLimits,
        picked: &mut Columns,
    ) {
        // A little more than the radius, to allow for rounding.
        let around_m = spread.radius * 1.01;
        self.measure(simd, segments, spread, around_m, limits);
        picked.clear();
        for index in lowest(segments, limits, -around_m) {
            picked.push_from(segments, index);
        }
        picked.pad();
    }

    /// Returns the extent of a patch's warped vertices, in metres from the block's corner.
    #[inline(always)]
    fn extent<S: Simd>(&self, simd: S, corner: [i64; 2], vertices: Area, order: PatchLanes<S>) -> Extent {
        let (mut least, mut most) = ([simd.splat(f32::INFINITY); 6], [simd.splat(f32::NEG_INFINITY); 6]);
        for group in 0..PATCH * PATCH / S::LANES {
            let (lanes, [east, south]) = order.group(simd, self, corner, vertices, group);
            let mut take = |part: usize, values| {
                least[part] = simd.min(least[part], values);
                most[part] = simd.max(most[part], values);
            };
            take(0, east);
            take(1, south);
            take(2, lanes.load(simd, &self.hillsides.slope));
            if let Some(rest) = &self.hillsides.rest {
                take(3, lanes.load(simd, &rest.slope));
                take(4, lanes.load(simd, &rest.height_m));
            }
            take(5, self.hillsides.crest_m.load_rows(simd, lanes));
        }
        Extent { least: least.map(|values| -greatest(simd, -values)), most: most.map(|values| greatest(simd, values)) }
    }

    /// Returns the properties that the floors of all valleys share.
    fn floor(&self) -> Floor {
        floor(self.fields)
    }

    /// Computes the limits of each segment over a group of vertices: the lowest height that its side can have, less the
    /// greatest height that the lowest side of all can have, with a margin for crests; and the metres left of its reach
    /// at the middle of the group. Only segments whose reach goes on for `beyond_m` from there bound the lowest side:
    /// in a block, those that matter to all of its patches.
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
        limits.level.resize(len, 0.0);
        let middle = [simd.splat(spread.middle[0]), simd.splat(spread.middle[1])];
        let (gentle, steep) = (simd.splat(spread.slope[0]), simd.splat(spread.slope[1]));
        // A little more than the true radius, to allow for rounding.
        let radius = simd.splat(spread.radius * (1.001 + 1.1 * CROSS_FALL) + 0.01);
        let common = self.floor();
        let rests = spread.rest.map(|ends| ends.map(|rest| LaneRest::splat(simd, rest)));
        let (infinity, beyond) = (simd.splat(f32::INFINITY), simd.splat(beyond_m));
        let mut lowest = infinity;
        for start in (0..len).step_by(S::LANES) {
            let segment = LaneSegment::load(simd, segments, start, common);
            let side = segment.side(simd, middle);
            // Bound of the difference between a side's height in the group and in its middle: the change over a radius,
            // along the segment and across it.
            let distance = side.distance;
            let bed_change = simd.load(&segments.values[column::BED_CHANGE][start..]);
            let floor_change = simd.load(&segments.values[column::FLOOR_CHANGE][start..]);
            let turned = simd.load(&segments.values[column::CROSS_CHANGE][start..]) * (distance + radius);
            let is_far = simd.lt(segment.far, distance + radius);
            let across = simd.select(is_far, simd.splat(1.0 + FAR_STEEPER), simd.splat(1.0));
            let slack = (bed_change + steep * (across + floor_change + turned) * segment.steepest_cross(simd)) * radius;
            let left = simd.load(&segments.values[column::REACH][start..]) - distance;
            // The least upper bound of all: a side that is always higher than this is never lowest.
            let (mut highest, mut lowest_here) = (steep * side.rise + slack, gentle * side.rise - slack);
            if let Some([least, most]) = rests {
                let open = segment.open(simd, side.level);
                (highest, lowest_here) = (most.risen(simd, open, highest), least.risen(simd, open, lowest_here));
            }
            let (highest, lowest_here) = (side.level + highest, side.level + lowest_here);
            lowest = simd.min(lowest, simd.select(simd.lt(left, beyond), infinity, highest));
            simd.store(lowest_here, &mut limits.low[start..]);
            simd.store(left, &mut limits.left[start..]);
            simd.store(side.level - bed_change * radius, &mut limits.level[start..]);
        }
        let lowest = -greatest(simd, -lowest);
        // A crest is rounded by no more than its height above the lowest channel there: on plains this is less than the
        // usual rounding.
        let mut level = infinity;
        for start in (0..len).step_by(S::LANES) {
            let is_lowest = simd.lt(simd.load(&limits.low[start..]), simd.splat(lowest));
            level = simd.min(level, simd.select(is_lowest, simd.load(&limits.level[start..]), infinity));
        }
        let crest_m = (lowest + greatest(simd, -level) + ROUNDING_M).min(spread.crest_m);
        let limit = lowest + crest_m.max(self.read_m);
        for low in &mut limits.low {
            *low -= limit;
        }
    }

    /// Finds the lowest sides at vertices in lanes, on hillsides of a slope, among the segments that may be lowest in
    /// their patch. Returns the height of the lowest side, that of the lowest side of another channel, the room for
    /// rounding the crest between both, and the segment with the lowest side.
    #[inline(always)]
    fn lowest_sides<S: Simd>(
        &self,
        simd: S,
        (lanes, at): (InRows, [S::F32; 2]),
        slope: S::F32,
        segments: &Columns,
        patch: &[usize],
    ) -> (S::F32, S::F32, S::F32, S::U32) {
        let (common, three) = (self.floor(), simd.splat(3.0));
        let rest = self.hillsides.rest.as_ref().map(|rest| LaneRest::load(simd, lanes, rest));
        let far = simd.splat(f32::MAX);
        let (mut best, mut second, mut room) = (far, far, far);
        let none = simd.splat_u32(u32::MAX);
        let (mut channel, mut lowest) = (none, none);
        for &segment in patch {
            let candidate = LaneSegment::splat(simd, segments, segment, common);
            let LaneSide { level, rise, .. } = candidate.side(simd, at);
            let risen = slope * rise;
            let risen = match rest {
                Some(rest) => rest.risen(simd, candidate.open(simd, level), risen),
                None => risen,
            };
            let height = level + risen;
            let own = simd.splat_u32(segments.channel[segment]);
            let same = simd.eq_u32(own, channel);
            let lower = simd.lt(height, best);
            // Of this side and the lowest, the higher one counts as the second if the channels differ: segments of one
            // channel have no crest between them.
            let rest = simd.select(lower, best, height);
            second = simd.select(same, second, simd.min(rest, second));
            room = simd.min(room, three * height - level);
            best = simd.select(lower, height, best);
            channel = simd.select_u32(lower, own, channel);
            lowest = simd.select_u32(lower, simd.splat_u32(segment as u32), lowest);
        }
        (best, second, room, lowest)
    }

    /// Computes the valleys of one patch, whose vertices lie in lanes, given the segments that may be lowest in it.
    #[inline(always)]
    fn patch<S: Simd>(
        &mut self,
        simd: S,
        corner: [i64; 2],
        vertices: Area,
        order: PatchLanes<S>,
        segments: &Columns,
        patch: &[usize],
    ) {
        let zero = simd.splat(0.0);
        for group in 0..PATCH * PATCH / S::LANES {
            let (lanes, at) = order.group(simd, self, corner, vertices, group);
            let slope = lanes.load(simd, &self.hillsides.slope);
            let crest_m = self.hillsides.crest_m.load_rows(simd, lanes);
            let (best, second, room, lowest) = self.lowest_sides(simd, (lanes, at), slope, segments, patch);
            // For most segments only the height of the side is needed. All else is computed for the lowest alone.
            let mut owners = [0; MAX_LANES];
            simd.store_u32(lowest, &mut owners);
            let owners = &owners[..S::LANES];
            let LaneSide { level, cross, floor, bed, off, distance, share, .. } =
                sides_of(simd, segments, owners, self.floor(), at);
            let mut number = [u32::MAX; MAX_LANES];
            for (number, owner) in number.iter_mut().zip(owners) {
                *number = segments.number.get(*owner as usize).copied().unwrap_or(u32::MAX);
            }
            // Round the crest by no more than its height above a channel: the least sum of (height - level) and twice
            // the height of a side above the best, over all sides. This has no step where the best or the second
            // changes.
            let gap = second - best;
            let round = simd.max(simd.min(crest_m, room - (best + best)), zero);
            let over = simd.max(round - gap, zero);
            // A fourth would make the crest smooth; but as the room shrinks downhill, more than a fifth would leave a
            // furrow.
            let lowered = over * over / (simd.max(round, simd.splat(1e-3)) * simd.splat(5.0));
            let steepness = simd.min(gap / simd.max(round, simd.splat(1e-3)), simd.splat(1.0));
            let steep = slope * cross;
            let steepness = steepness * floor;
            // The gradient of the land, across the channel and along it: on a steep brook's sides the fall line is
            // aslant.
            let across = steep * floor / simd.max(distance, simd.splat(1e-3));
            let rise = [off[0] * across + bed[0], off[1] * across + bed[1]];
            let steepest = simd.sqrt(rise[0] * rise[0] + rise[1] * rise[1]);
            let per_rise = simd.splat(1.0) / simd.max(steepest, simd.splat(1e-6));
            let out = &mut *self.out;
            lanes.store(simd, best - lowered, &mut out.height_m);
            lanes.store(simd, level, &mut out.level_m);
            lanes.store(simd, simd.min(gap, simd.splat(self.read_m)), &mut out.crest_m);
            lanes.store(simd, steepness, &mut out.steepness);
            lanes.store(simd, distance, &mut out.distance_m);
            lanes.store(simd, rise[0] * per_rise, &mut out.away[0]);
            lanes.store(simd, rise[1] * per_rise, &mut out.away[1]);
            lanes.store(simd, share, &mut out.share);
            lanes.spread(&number[..S::LANES], &mut out.segment);
        }
    }
}

/// Returns the distance in metres between nodes that are `step` vertices apart.
pub(super) fn spacing_m(fields: &Fields, step: i64) -> f32 {
    (fields.metres_a_grain() * (GRAINS * step) as f64) as f32
}

/// Returns the properties that the floors of all valleys of a world share.
pub(super) fn floor(fields: &Fields) -> Floor {
    Floor {
        level_m: (LEAST_HALF_WIDTH * GRAINS as f64 * fields.metres_a_grain()) as f32,
        has_levees: fields.most_laws().levees > 0.0,
        terraces: fields.terraces(),
    }
}

/// Returns the greatest value of the lanes.
#[inline(always)]
fn greatest<S: Simd>(simd: S, values: S::F32) -> f32 {
    let mut lanes = [0.0; MAX_LANES];
    simd.store(values, &mut lanes);
    lanes[..S::LANES].iter().fold(f32::NEG_INFINITY, |a, b| a.max(*b))
}

/// The order of a patch's vertices in lanes: row by row, and several rows in wide lanes.
#[derive(Clone, Copy)]
struct PatchLanes<S: Simd> {
    columns: S::F32,
    rows: S::F32,
}

impl<S: Simd> PatchLanes<S> {
    const ACROSS: usize = if S::LANES < PATCH { S::LANES } else { PATCH };

    #[inline(always)]
    fn new(simd: S) -> PatchLanes<S> {
        let (mut columns, mut rows) = ([0.0; MAX_LANES], [0.0; MAX_LANES]);
        for lane in 0..S::LANES {
            (columns[lane], rows[lane]) = ((lane % Self::ACROSS) as f32, (lane / Self::ACROSS) as f32);
        }
        PatchLanes { columns: simd.load(&columns), rows: simd.load(&rows) }
    }

    /// Returns the vertices of a group of lanes, and their warped places in metres from the block's corner.
    #[inline(always)]
    fn group(
        &self,
        simd: S,
        valleys: &FillValleys,
        corner: [i64; 2],
        vertices: Area,
        group: usize,
    ) -> (InRows, [S::F32; 2]) {
        let (area, first) = (valleys.area, group * S::LANES);
        // Groups that are narrower than a patch lie beside each other in it.
        let (x, y) = (vertices.x0 + (first % PATCH) as i64, vertices.y0 + (first / PATCH) as i64);
        let index = area.index(x, y);
        let lanes = InRows { index, width: area.width(), across: Self::ACROSS };
        let spacing_m = simd.splat(valleys.spacing_m());
        let at = [
            (self.columns + simd.splat((x - corner[0]) as f32)) * spacing_m + lanes.load(simd, valleys.warp[0]),
            (self.rows + simd.splat((y - corner[1]) as f32)) * spacing_m + lanes.load(simd, valleys.warp[1]),
        ];
        (lanes, at)
    }
}

/// Returns the sides of segments, one in each lane, given by index; zeros where there is no segment.
#[inline(always)]
fn sides_of<S: Simd>(simd: S, segments: &Columns, owners: &[u32], common: Floor, at: [S::F32; 2]) -> LaneSide<S> {
    let zero = simd.splat(0.0);
    let (mut level, mut rise, mut cross, mut floor) = (zero, zero, zero, zero);
    let (mut bed, mut off, mut distance, mut share) = ([zero; 2], [zero; 2], zero, zero);
    let lanes = simd.load_u32(owners);
    // Few segments own the vertices of a group of lanes: each is asked once, for all of them.
    for (lane, owner) in owners.iter().enumerate() {
        if owners[..lane].contains(owner) || *owner as usize >= segments.number.len() {
            continue;
        }
        let is_own = simd.eq_u32(lanes, simd.splat_u32(*owner));
        let side = LaneSegment::splat(simd, segments, *owner as usize, common).side(simd, at);
        level = simd.select(is_own, side.level, level);
        rise = simd.select(is_own, side.rise, rise);
        cross = simd.select(is_own, side.cross, cross);
        floor = simd.select(is_own, side.floor, floor);
        for axis in [0, 1] {
            bed[axis] = simd.select(is_own, side.bed[axis], bed[axis]);
            off[axis] = simd.select(is_own, side.off[axis], off[axis]);
        }
        distance = simd.select(is_own, side.distance, distance);
        share = simd.select(is_own, side.share, share);
    }
    LaneSide { level, rise, cross, floor, bed, off, distance, share }
}

/// Lanes that hold parts of rows of nodes, one below the other, each `across` nodes long.
#[derive(Clone, Copy)]
pub struct InRows {
    /// The first node's number in the order of all nodes.
    index: usize,
    /// Nodes in a row.
    width: usize,
    across: usize,
}

impl InRows {
    #[inline(always)]
    pub fn load<S: Simd>(self, simd: S, from: &[f32]) -> S::F32 {
        if self.across == S::LANES {
            return simd.load(&from[self.index..]);
        }
        let mut lanes = [0.0; MAX_LANES];
        for (row, lanes) in lanes[..S::LANES].chunks_exact_mut(self.across).enumerate() {
            lanes.copy_from_slice(&from[self.index + row * self.width..][..self.across]);
        }
        simd.load(&lanes)
    }

    #[inline(always)]
    fn store<S: Simd>(self, simd: S, value: S::F32, to: &mut [f32]) {
        if self.across == S::LANES {
            return simd.store(value, &mut to[self.index..]);
        }
        let mut lanes = [0.0; MAX_LANES];
        simd.store(value, &mut lanes);
        self.spread(&lanes[..S::LANES], to);
    }

    #[inline(always)]
    fn spread<T: Copy>(self, lanes: &[T], to: &mut [T]) {
        for (row, lanes) in lanes.chunks_exact(self.across).enumerate() {
            to[self.index + row * self.width..][..self.across].copy_from_slice(lanes);
        }
    }
}

/// Returns the indices of the segments that may be lowest somewhere and whose reach goes on for `least_m` metres or
/// more.
#[inline(always)]
fn lowest<'a>(segments: &'a Columns, limits: &'a SegmentLimits, least_m: f32) -> impl Iterator<Item = usize> + 'a {
    let may_be = move |index: &usize| {
        limits.low[*index] <= 0.0 && limits.left[*index] >= least_m && segments.number[*index] != u32::MAX
    };
    (0..segments.number.len()).filter(may_be)
}
