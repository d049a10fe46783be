//! The sides of valleys in lanes: segments in columns, and the height at a point of the valley side that rises from a
//! segment.
//!
//! To judge the numbers chosen by eye, look for steps at the borders of patches in hillshades.

use super::fields::Fields;
use super::segment::{LEVEE, LEVEE_FALLS, LEVEE_RISES, LEVEL, Reach, Segment};
use crate::geometry::lerp;
use crate::grain_point::GRAINS;
use crate::simd::{MAX_LANES, Simd};

/// Rise of wide water towards its edges, as a share of the hillside's slope: enough for a vertex to belong to the
/// nearest place of a river and not to a place further downstream.
pub const CROSS_FALL: f32 = 0.02;

/// Rise of all floors towards their sides, as a share of the hillside's slope: next to nothing, so that no two vertices
/// are equally high.
const FLOOR_FALL: f32 = 0.001;

/// Half width in vertices of the narrowest bed. Its floor is level across, so that in whichever direction it runs an
/// unbroken line of vertices lies in it, each lower than the one before. The width is more than half a diagonal,
/// because the warp stretches lengths.
pub const LEAST_HALF_WIDTH: f64 = 1.0;

/// Share of a segment's reach from which on its side is steeper, and the additional slope, as a share of the
/// hillside's. So the side beside bare land becomes lowest before the reach ends; otherwise the borders of patches
/// would show there as steps. Chosen by eye.
const FAR: f32 = 0.8;
pub const FAR_STEEPER: f32 = 1.5;

/// The columns of a segment's numbers. The first nine numbers take two columns each. For a place and a way, these are
/// metres east and south. For the others, they are the value at the upper end and the change to the lower end, so that
/// a value between the ends takes one product and one sum.
pub mod column {
    pub const FROM: usize = 0;
    pub const ALONG: usize = 2;
    pub const LEVEL: usize = 4;
    pub const CROSS: usize = 6;
    pub const TROUGH: usize = 8;
    pub const LEAN: usize = 10;
    pub const RIVER: usize = 12;
    pub const FLOOD_PLAIN: usize = 14;
    pub const RISER: usize = 16;
    /// One over the square of the length.
    pub const PER_SQUARE: usize = 18;
    /// Change of a segment's level per metre along it.
    pub const BED_CHANGE: usize = 19;
    /// Largest change of the rise of a segment's side per metre along the segment, by all changes of its widths, for a
    /// hillside of slope 1.
    pub const FLOOR_CHANGE: usize = 20;
    /// Change of a segment's slope across the channel per metre along it.
    pub const CROSS_CHANGE: usize = 21;
    pub const REACH: usize = 22;
    /// Height in metres of the lake or the sea that stands over a segment.
    pub const POOL: usize = 23;
    /// Height of levees in half widths of their river, on a hillside of slope 1.
    pub const LEVEES: usize = 24;
    pub const COUNT: usize = 25;
}

/// Segments in columns, in metres from the origin of a block.
#[derive(Debug, Default)]
pub struct Columns {
    /// Their numbers, by [`column`].
    pub values: [Vec<f32>; column::COUNT],
    pub channel: Vec<u32>,
    pub number: Vec<u32>,
}

impl Columns {
    pub fn clear(&mut self) {
        self.values.iter_mut().for_each(Vec::clear);
        self.channel.clear();
        self.number.clear();
    }

    /// Adds a segment, which is given in grains from the segments' own origin and matters within `reach`.
    pub fn push(&mut self, fields: &Fields, segment: &Segment, number: u32, reach: Reach) {
        let metres = fields.metres_a_grain();
        let pair = |pair: [f64; 2]| pair.map(|value| value as f32);
        let in_metres = |grains: [f64; 2]| pair(grains.map(|grains| grains * metres));
        // Inexact if the origin is far. Before a block is measured, places are replaced by those relative to its own
        // corner.
        let [from, along] = [segment.from, segment.along].map(|way| in_metres(way.into()));
        let [level, cross, lean] = [segment.level_m, segment.cross, segment.lean].map(pair);
        let [trough, flood_plain, riser] = [segment.trough, segment.flood_plain, segment.riser].map(in_metres);
        let least_m = LEAST_HALF_WIDTH * GRAINS as f64 * metres;
        let half_width = |end: f64| (lerp(segment.river, end) * metres).max(least_m);
        let upper = half_width(0.0);
        let river = pair([upper, half_width(1.0) - upper]);
        let square = along[0] * along[0] + along[1] * along[1];
        // All changes are added, though seldom do all act at one place: the bound may be too wide, but never too
        // narrow.
        let change = |pair: [f32; 2]| pair[1].abs() / square.sqrt();
        // The lean acts on no more than the width of the floor.
        let widest = (segment.widest_trough() * metres) as f32 + river[0].max(river[0] + river[1]);
        let floor = change(trough) + change(lean) * widest + change(river);
        let terraces = segment.terraces as f32 * (change(trough) + change(river) + change(flood_plain) + change(riser));
        // The height of a levee changes less than the width of its river.
        let levees = if segment.levees > 0.0 { change(river) } else { 0.0 };
        // Finite, because the lanes compute with it.
        let pool = segment.pool_m.max(fields.sea_level_m()).max(-1e9) as f32;
        let pairs = [from, along, level, cross, trough, lean, river, flood_plain, riser];
        let changes = [change(level), floor + terraces + levees, change(cross)];
        let reach = (segment.reach(reach) * metres) as f32;
        let levee = segment.levees as f32 * LEVEE as f32;
        let values = pairs.into_iter().flatten().chain([1.0 / square]).chain(changes).chain([reach, pool, levee]);
        for (column, value) in self.values.iter_mut().zip(values) {
            column.push(value);
        }
        self.channel.push(segment.channel);
        self.number.push(number);
    }

    /// Adds a segment of other columns.
    pub fn push_from(&mut self, other: &Columns, index: usize) {
        for (column, other) in self.values.iter_mut().zip(&other.values) {
            column.push(other[index]);
        }
        self.channel.push(other.channel[index]);
        self.number.push(other.number[index]);
    }

    /// Fills the last lanes with segments that do not matter: they are too far away, and their reach is 0.
    pub fn pad(&mut self) {
        let len = self.number.len().next_multiple_of(MAX_LANES);
        for (number, column) in self.values.iter_mut().enumerate() {
            // Far away, and yet its square fits an f32: infinity times 0 would be NaN.
            column.resize(len, if number < column::ALONG { 1e18 } else { 0.0 });
        }
        // No segment has this number, so later choices can tell these lanes and leave them out.
        self.channel.resize(len, u32::MAX);
        self.number.resize(len, u32::MAX);
    }

    /// Returns the values of a column: in each lane those of one segment, from `at` on, or with `ONE` in all lanes
    /// those of the segment `at`.
    #[inline(always)]
    fn read<S: Simd, const ONE: bool>(&self, simd: S, column: usize, at: usize) -> S::F32 {
        if ONE { simd.splat(self.values[column][at]) } else { simd.load(&self.values[column][at..]) }
    }

    /// Returns the values of a column and of the next.
    #[inline(always)]
    fn pair<S: Simd, const ONE: bool>(&self, simd: S, column: usize, at: usize) -> [S::F32; 2] {
        [self.read::<S, ONE>(simd, column, at), self.read::<S, ONE>(simd, column + 1, at)]
    }
}

/// The properties that the floors of all valleys of a world share.
#[derive(Clone, Copy)]
pub struct Floor {
    /// Half width in metres of the part of a river that is level across.
    pub level_m: f32,
    /// True if there are levees anywhere.
    pub has_levees: bool,
    /// Number of terraces from the flood plain to the side.
    pub terraces: u32,
}

/// Segments, one in each lane, or a single segment in all of them.
#[derive(Clone, Copy)]
pub struct LaneSegment<S: Simd> {
    from: [S::F32; 2],
    along: [S::F32; 2],
    per_square: S::F32,
    level: [S::F32; 2],
    cross: [S::F32; 2],
    trough: [S::F32; 2],
    lean: [S::F32; 2],
    river: [S::F32; 2],
    flood_plain: [S::F32; 2],
    riser: [S::F32; 2],
    /// Distance in metres from the segment from which on its side is steeper.
    pub far: S::F32,
    pool: S::F32,
    levee: S::F32,
    floor: Floor,
}

/// The side of a segment's valley at a point.
pub struct LaneSide<S: Simd> {
    pub level: S::F32,
    /// Metres that the side has risen on a hillside of slope 1: the factor of the hillside's slope.
    pub rise: S::F32,
    /// The slope across the channel, as a share of the hillside's.
    pub cross: S::F32,
    /// Slope of the side at the point, as a share of its slope further up.
    pub floor: S::F32,
    /// Gradient of the bed, in metres a metre.
    pub bed: [S::F32; 2],
    pub off: [S::F32; 2],
    pub distance: S::F32,
    pub share: S::F32,
}

impl<S: Simd> LaneSegment<S> {
    /// Returns the segments from `at` on.
    #[inline(always)]
    pub fn load(simd: S, segments: &Columns, at: usize, floor: Floor) -> LaneSegment<S> {
        LaneSegment::read::<false>(simd, segments, at, floor)
    }

    /// Returns one segment in all lanes.
    #[inline(always)]
    pub fn splat(simd: S, segments: &Columns, at: usize, floor: Floor) -> LaneSegment<S> {
        LaneSegment::read::<true>(simd, segments, at, floor)
    }

    #[inline(always)]
    fn read<const ONE: bool>(simd: S, segments: &Columns, at: usize, floor: Floor) -> LaneSegment<S> {
        LaneSegment {
            from: segments.pair::<S, ONE>(simd, column::FROM, at),
            along: segments.pair::<S, ONE>(simd, column::ALONG, at),
            per_square: segments.read::<S, ONE>(simd, column::PER_SQUARE, at),
            level: segments.pair::<S, ONE>(simd, column::LEVEL, at),
            cross: segments.pair::<S, ONE>(simd, column::CROSS, at),
            trough: segments.pair::<S, ONE>(simd, column::TROUGH, at),
            lean: segments.pair::<S, ONE>(simd, column::LEAN, at),
            river: segments.pair::<S, ONE>(simd, column::RIVER, at),
            flood_plain: segments.pair::<S, ONE>(simd, column::FLOOD_PLAIN, at),
            riser: segments.pair::<S, ONE>(simd, column::RISER, at),
            far: segments.read::<S, ONE>(simd, column::REACH, at) * simd.splat(FAR),
            pool: segments.read::<S, ONE>(simd, column::POOL, at),
            levee: segments.read::<S, ONE>(simd, column::LEVEES, at),
            floor,
        }
    }

    /// Returns the greatest slope across the segment, as a share of the hillside's, but 1 at least.
    #[inline(always)]
    pub fn steepest_cross(&self, simd: S) -> S::F32 {
        let ends = simd.max(self.cross[0], self.cross[0] + self.cross[1]);
        simd.max(ends, simd.splat(1.0))
    }

    /// Returns the metres of water over the segment's bed where the bed lies at `level`.
    #[inline(always)]
    pub fn open(&self, simd: S, level: S::F32) -> S::F32 {
        simd.max(self.pool - level, simd.splat(0.0))
    }

    #[inline(always)]
    pub fn side(&self, simd: S, at: [S::F32; 2]) -> LaneSide<S> {
        let (zero, one) = (simd.splat(0.0), simd.splat(1.0));
        // The nearest place of the segment.
        let off = [at[0] - self.from[0], at[1] - self.from[1]];
        // The division by the square of the length is done once a segment; here it is a multiplication.
        let share = (off[0] * self.along[0] + off[1] * self.along[1]) * self.per_square;
        let share = simd.min(simd.max(share, zero), one);
        let off = [off[0] - self.along[0] * share, off[1] - self.along[1] * share];
        let square = off[0] * off[0] + off[1] * off[1];
        // The channel's properties there.
        let trough = self.trough[0] + self.trough[1] * share;
        let lean = self.lean[0] + self.lean[1] * share;
        let river = self.river[0] + self.river[1] * share;
        let distance = simd.sqrt(square);
        // The side is level as far as the water is wide, rounded at the foot, then straight; and the floor leans.
        let cross = self.cross[0] + self.cross[1] * share;
        let dry = simd.max(distance - river, zero);
        let level = trough * simd.splat(LEVEL as f32);
        let beyond = simd.max(distance - simd.max(river, level), zero);
        let round = trough * simd.splat(1.0 - LEVEL as f32);
        let root = simd.sqrt(beyond * beyond + round * round);
        // In the water the side has not risen. Without a rounded foot `root` is 0 at the edge of the floor, so the
        // divisor has a minimum.
        let (mut risen, straight) = (root - round, beyond / simd.max(root, simd.splat(1e-3)));
        if self.floor.terraces > 0 {
            // Terraces are equally far apart from the flood plain to the foot of the side, and their risers are as
            // steep as the side. But they are too low for gullies, whose furrows would go on across the treads, so they
            // do not count in the slope of the floor.
            let flood_plain = simd.max(self.flood_plain[0] + self.flood_plain[1] * share, river);
            let tread = simd.max(level - flood_plain, zero) * simd.splat(1.0 / self.floor.terraces as f32);
            let riser = simd.min(self.riser[0] + self.riser[1] * share, tread);
            for step in 0..self.floor.terraces {
                let up = simd.max(distance - flood_plain - tread * simd.splat(step as f32), zero);
                risen = risen + simd.min(up, riser);
            }
        }
        if self.floor.has_levees {
            // The levee is so low that it has room to fall again on the level floor.
            let room =
                simd.max(level - river, zero) * simd.splat((1.0 / (1.0 / LEVEE_RISES + 1.0 / LEVEE_FALLS)) as f32);
            let height = simd.min(river * self.levee, room);
            let behind = dry - height * simd.splat((1.0 / LEVEE_RISES) as f32);
            let falling = height - behind * simd.splat(LEVEE_FALLS as f32);
            risen = risen + simd.max(simd.min(dry * simd.splat(LEVEE_RISES as f32), falling), zero);
        }
        let rise = (risen + lean * (dry - risen)) * cross;
        // Water is almost level: it rises a little up to the river's edge, beyond which the valley's side rises enough.
        // The greater of both rises counts, so that vertices of the level floor differ, too.
        let sideways = (simd.min(distance, river) - simd.splat(self.floor.level_m)) * simd.splat(CROSS_FALL);
        let rise = rise + simd.max(sideways, distance * simd.splat(FLOOR_FALL));
        let rise = rise + simd.max(distance - self.far, zero) * simd.splat(FAR_STEEPER);
        // Beyond the ends of the segment the bed is level along it.
        let fall = self.level[1] * self.per_square;
        let fall = simd.select(simd.lt(zero, share), simd.select(simd.lt(share, one), fall, zero), zero);
        let bed = [self.along[0] * fall, self.along[1] * fall];
        let floor = simd.select(simd.lt(zero, dry), straight + lean * (one - straight), zero);
        LaneSide { level: self.level[0] + self.level[1] * share, rise, cross, floor, bed, off, distance, share }
    }
}
