//! The sides of valleys in lanes: segments in columns, and the height at a point of the valley side that rises from a
//! segment.

use super::fields::Fields;
use super::grain_point::GRAINS;
use super::segment::{LEVEE, LEVEE_FALLS, LEVEE_RISES, LEVEL, Reach, Segment};
use crate::geometry::lerp;
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

/// Segments in columns, in metres from the origin of a block.
#[derive(Debug, Default)]
pub struct Columns {
    pub from: [Vec<f32>; 2],
    pub along: [Vec<f32>; 2],
    pub per_square: Vec<f32>,
    pub level: [Vec<f32>; 2],
    pub cross: [Vec<f32>; 2],
    pub trough: [Vec<f32>; 2],
    pub lean: [Vec<f32>; 2],
    pub river: [Vec<f32>; 2],
    pub flood_plain: [Vec<f32>; 2],
    pub riser: [Vec<f32>; 2],
    /// Change of a segment's level per metre along it.
    pub bed_change: Vec<f32>,
    /// Largest change per metre along a segment of the rise of its side, by all changes of its widths, for a hillside
    /// of slope 1.
    pub floor_change: Vec<f32>,
    /// Change of a segment's slope across the channel per metre along it.
    pub cross_change: Vec<f32>,
    pub reach: Vec<f32>,
    /// Height in metres of the lake or the sea that stands over a segment.
    pub pool: Vec<f32>,
    pub channel: Vec<u32>,
    pub number: Vec<u32>,
}

impl Columns {
    pub fn clear(&mut self) {
        // Destructured without `..`, so that a column that is forgotten here does not compile.
        let Columns {
            from,
            along,
            per_square,
            level,
            cross,
            trough,
            lean,
            river,
            flood_plain,
            riser,
            bed_change,
            floor_change,
            cross_change,
            reach,
            pool,
            channel,
            number,
        } = self;
        let pairs = [from, along, level, cross, trough, lean, river, flood_plain, riser];
        for column in
            pairs.into_iter().flatten().chain([per_square, bed_change, floor_change, cross_change, reach, pool])
        {
            column.clear();
        }
        channel.clear();
        number.clear();
    }

    /// Adds a segment, which is given in grains from the segments' own origin and matters within `reach`.
    pub fn push(&mut self, fields: &Fields, segment: &Segment, number: u32, reach: Reach) {
        let metres = fields.metres_a_grain();
        // A pair is the value at the upper end and the change to the lower one, so a place between takes a product and
        // a sum.
        let pair = |[upper, change]: [f64; 2]| [upper as f32, change as f32];
        let level = pair(segment.level_m);
        let cross = pair(segment.cross);
        let trough = pair(segment.trough.map(|grains| grains * metres));
        let lean = pair(segment.lean);
        let flood_plain = pair(segment.flood_plain.map(|grains| grains * metres));
        let riser = pair(segment.riser.map(|grains| grains * metres));
        let least_m = LEAST_HALF_WIDTH * GRAINS as f64 * metres;
        let half_width = |end: f64| (lerp(segment.river, end) * metres).max(least_m);
        let upper = half_width(0.0);
        let river = pair([upper, half_width(1.0) - upper]);
        let along = segment.along.map(|part| (part * metres) as f32);
        let square = along[0] * along[0] + along[1] * along[1];
        for axis in [0, 1] {
            // Inexact if the origin is far. Before a block is measured, these are replaced by places relative to its
            // own corner.
            self.from[axis].push((segment.from[axis] * metres) as f32);
            self.along[axis].push(along[axis]);
            self.level[axis].push(level[axis]);
            self.cross[axis].push(cross[axis]);
            self.trough[axis].push(trough[axis]);
            self.lean[axis].push(lean[axis]);
            self.river[axis].push(river[axis]);
            self.flood_plain[axis].push(flood_plain[axis]);
            self.riser[axis].push(riser[axis]);
        }
        self.per_square.push(1.0 / square);
        // All changes are added, though seldom do all act at one place: the bound may be too wide, but never too
        // narrow.
        let change = |pair: [f32; 2]| pair[1].abs() / square.sqrt();
        // The lean acts on no more than the width of the floor.
        let widest = (segment.widest_trough() * metres) as f32 + river[0].max(river[0] + river[1]);
        let floor = change(trough) + change(lean) * widest + change(river);
        let terraces = segment.terraces as f32 * (change(trough) + change(river) + change(flood_plain) + change(riser));
        // The height of a levee changes less than the width of its river.
        let levees = if segment.levees > 0.0 { change(river) } else { 0.0 };
        self.bed_change.push(change(level));
        self.floor_change.push(floor + terraces + levees);
        self.cross_change.push(change(cross));
        self.reach.push((segment.reach(reach) * metres) as f32);
        // Finite, because the lanes compute with it.
        self.pool.push(segment.pool_m.max(fields.sea_level_m()).max(-1e9) as f32);
        self.channel.push(segment.channel);
        self.number.push(number);
    }

    /// Adds a segment of other columns.
    pub fn push_from(&mut self, other: &Columns, index: usize) {
        for axis in [0, 1] {
            self.from[axis].push(other.from[axis][index]);
            self.along[axis].push(other.along[axis][index]);
            self.level[axis].push(other.level[axis][index]);
            self.cross[axis].push(other.cross[axis][index]);
            self.trough[axis].push(other.trough[axis][index]);
            self.lean[axis].push(other.lean[axis][index]);
            self.river[axis].push(other.river[axis][index]);
            self.flood_plain[axis].push(other.flood_plain[axis][index]);
            self.riser[axis].push(other.riser[axis][index]);
        }
        self.per_square.push(other.per_square[index]);
        self.bed_change.push(other.bed_change[index]);
        self.floor_change.push(other.floor_change[index]);
        self.cross_change.push(other.cross_change[index]);
        self.reach.push(other.reach[index]);
        self.pool.push(other.pool[index]);
        self.channel.push(other.channel[index]);
        self.number.push(other.number[index]);
    }

    /// Fills the last lanes with segments that do not matter: they are too far away, and their reach is 0.
    pub fn pad(&mut self) {
        while !self.number.len().is_multiple_of(MAX_LANES) {
            for axis in [0, 1] {
                // Far away, and yet its square fits an f32: infinity times 0 would be NaN.
                self.from[axis].push(1e18);
                self.along[axis].push(0.0);
                self.level[axis].push(0.0);
                self.cross[axis].push(0.0);
                self.trough[axis].push(0.0);
                self.lean[axis].push(0.0);
                self.river[axis].push(0.0);
                self.flood_plain[axis].push(0.0);
                self.riser[axis].push(0.0);
            }
            self.per_square.push(0.0);
            self.bed_change.push(0.0);
            self.floor_change.push(0.0);
            self.cross_change.push(0.0);
            self.reach.push(0.0);
            self.pool.push(0.0);
            self.channel.push(u32::MAX);
            // No segment has this number, so later choices can tell these lanes and leave them out.
            self.number.push(u32::MAX);
        }
    }
}

/// The properties that the floors of all valleys of a world share.
#[derive(Clone, Copy)]
pub struct Floor {
    /// Half width in metres of the part of a river that is level across.
    pub level_m: f32,
    /// Height of levees, as a share of the greatest height.
    pub levees: f32,
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
    #[inline(always)]
    pub fn load(simd: S, segments: &Columns, start: usize, floor: Floor) -> LaneSegment<S> {
        let Columns {
            from, along, per_square, level, cross, trough, lean, river, flood_plain, riser, reach, pool, ..
        } = segments;
        LaneSegment {
            from: [simd.load(&from[0][start..]), simd.load(&from[1][start..])],
            along: [simd.load(&along[0][start..]), simd.load(&along[1][start..])],
            per_square: simd.load(&per_square[start..]),
            level: [simd.load(&level[0][start..]), simd.load(&level[1][start..])],
            cross: [simd.load(&cross[0][start..]), simd.load(&cross[1][start..])],
            trough: [simd.load(&trough[0][start..]), simd.load(&trough[1][start..])],
            lean: [simd.load(&lean[0][start..]), simd.load(&lean[1][start..])],
            river: [simd.load(&river[0][start..]), simd.load(&river[1][start..])],
            flood_plain: [simd.load(&flood_plain[0][start..]), simd.load(&flood_plain[1][start..])],
            riser: [simd.load(&riser[0][start..]), simd.load(&riser[1][start..])],
            far: simd.load(&reach[start..]) * simd.splat(FAR),
            pool: simd.load(&pool[start..]),
            floor,
        }
    }

    #[inline(always)]
    pub fn splat(simd: S, segments: &Columns, index: usize, floor: Floor) -> LaneSegment<S> {
        let Columns {
            from, along, per_square, level, cross, trough, lean, river, flood_plain, riser, reach, pool, ..
        } = segments;
        LaneSegment {
            from: [simd.splat(from[0][index]), simd.splat(from[1][index])],
            along: [simd.splat(along[0][index]), simd.splat(along[1][index])],
            per_square: simd.splat(per_square[index]),
            level: [simd.splat(level[0][index]), simd.splat(level[1][index])],
            cross: [simd.splat(cross[0][index]), simd.splat(cross[1][index])],
            trough: [simd.splat(trough[0][index]), simd.splat(trough[1][index])],
            lean: [simd.splat(lean[0][index]), simd.splat(lean[1][index])],
            river: [simd.splat(river[0][index]), simd.splat(river[1][index])],
            flood_plain: [simd.splat(flood_plain[0][index]), simd.splat(flood_plain[1][index])],
            riser: [simd.splat(riser[0][index]), simd.splat(riser[1][index])],
            far: simd.splat(reach[index]) * simd.splat(FAR),
            pool: simd.splat(pool[index]),
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
        if self.floor.levees > 0.0 {
            // As high as leaves room for the levee to fall again on the level floor.
            let room =
                simd.max(level - river, zero) * simd.splat((1.0 / (1.0 / LEVEE_RISES + 1.0 / LEVEE_FALLS)) as f32);
            let height = simd.min(river * simd.splat(self.floor.levees * LEVEE as f32), room);
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
