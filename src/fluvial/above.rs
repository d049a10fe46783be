//! What is above a level: the segments of its coarser levels, by place.
//!
//! Whoever makes a chunk asks for those around it, and most ask for the same ones. So each is made once, in the patch that
//! holds its middle, and what is around a chunk is a list of patches.

use std::sync::Arc;

use super::channel::Channel;
use super::fields::Fields;
use super::point::{Point, overlap};
use super::segment::{Reach, Segment, segments_of, widened};
use super::trunk::NodeId;
use crate::geometry::length;
use crate::lines::ChannelId;
use crate::memory::heap_bytes;

/// Cells of the trunk lattice a side of the squares from whose corners places in patches are told: small numbers, with room
/// for fractions, and yet hardly a patch is made from two corners.
const ORIGIN_CELLS: i64 = 1 << 10;

/// Segments for which a patch has a cell in its raster, about, and cells a side of that at most.
const SEGMENTS_A_CELL: usize = 4;
const MOST_CELLS: usize = 32;

/// The id of a patch: a cell of a level's lattice, and where its places are told from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct PatchId {
    /// The level of its channels.
    pub level: u32,
    cell: NodeId,
    origin: Point,
}

/// The segments of a level whose middles lie in one cell of its lattice.
#[derive(Debug)]
pub struct Patch {
    /// The channels that they belong to.
    channels: Vec<ChannelId>,
    /// The segments, in the order of the raster's cells, and in each of the channels' and from their heads down.
    segments: Vec<Segment>,
    raster: Raster,
    /// The place in `segments` at which each cell of the raster begins, row by row, and at last where they end.
    starts: Vec<u32>,
    /// The longest segment in grains.
    longest: f64,
    /// Half width in grains of the widest floor, and how much further the deepest lake makes a side matter.
    widest: [f64; 2],
}

heap_bytes!(ChannelId);
heap_bytes!(Patch: channels, segments, starts);

/// A square of square cells; what lies beside it counts as in the cell at its edge.
#[derive(Clone, Copy, Debug)]
struct Raster {
    /// Its corner, relative to the origin.
    corner: [f64; 2],
    /// Grains a side of a cell.
    cell: f64,
    /// Cells a side.
    side: usize,
}

impl Raster {
    /// The column, or the row, of a place.
    fn line(self, axis: usize, at: f64) -> usize {
        (((at - self.corner[axis]) / self.cell).max(0.0) as usize).min(self.side - 1)
    }

    /// The columns, or the rows, that lie within some grains of a place; none if all lie further off.
    fn lines(self, axis: usize, at: f64, reach: f64) -> Option<[usize; 2]> {
        let off = at - self.corner[axis];
        let touches = off + reach >= 0.0 && off - reach <= self.cell * self.side as f64;
        touches.then(|| [-reach, reach].map(|by| self.line(axis, at + by)))
    }
}

/// What of the levels above is asked for in a rectangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Asked {
    /// The lines that touch it.
    Lines,
    /// The channels whose sides may be lowest in it, and their lines.
    Sides,
}

/// Whom to ask for what is above a level.
pub trait AsksAbove {
    /// What of the levels above one is asked for in a rectangle.
    fn above(&self, level: u32, rectangle: [Point; 2], asked: Asked) -> Above;

    /// The channel of an id, if there is one.
    fn channel(&self, id: ChannelId) -> Option<Arc<Channel>>;
}

/// Where places near a point are told from.
pub fn origin(fields: &Fields, at: Point) -> Point {
    let grains = ORIGIN_CELLS * fields.side(0);
    // The nearest corner: where the world is asked about most, around its own origin, that is one.
    let nearest = |at: i64| (at + grains / 2).div_euclid(grains) * grains;
    Point { x: nearest(at.x), y: nearest(at.y) }
}

/// The patches of a level whose segments may be what is asked for in a rectangle.
pub fn patches(
    fields: &Fields,
    level: u32,
    [low, high]: [Point; 2],
    asked: Asked,
    origin: Point,
) -> impl Iterator<Item = PatchId> {
    let sides = match asked {
        Asked::Lines => 0.0,
        Asked::Sides => widened(fields.lake_half_width(), fields.widest_trough(level)),
    };
    // A line that touches it has its middle no further off than half of its length.
    let reach = sides + 0.5 * fields.longest_segment(level);
    let (low, high, side) = (low.moved([-reach; 2]), high.moved([reach; 2]), fields.side(level));
    let columns = low.x.div_euclid(side)..=high.x.div_euclid(side);
    let rows = low.y.div_euclid(side)..=high.y.div_euclid(side);
    rows.flat_map(move |y| columns.clone().map(move |x| PatchId { level, cell: (x, y), origin }))
}

impl PatchId {
    /// The corners of its cell.
    pub fn square(self, fields: &Fields) -> [Point; 2] {
        let side = fields.side(self.level);
        let low = Point { x: self.cell.0 * side, y: self.cell.1 * side };
        [low, Point { x: low.x + side, y: low.y + side }]
    }
}

impl Patch {
    /// The patch, given how to see all channels of its level that touch its square.
    pub fn new(fields: &Fields, id: PatchId, channels_in: impl FnOnce(&mut dyn FnMut(&Arc<Channel>))) -> Patch {
        let square = id.square(fields);
        let [low, high] = square.map(|corner| corner.from(id.origin));
        let (mut channels, mut segments) = (Vec::new(), Vec::new());
        channels_in(&mut |channel| {
            if !overlap(channel.bounds(), square) {
                return;
            }
            let is_own = |[from, to]: [[f64; 2]; 2]| {
                // A cell has its north-western edges only, so that each middle lies in one.
                [0, 1].into_iter().all(|axis| {
                    let twice = from[axis] + to[axis];
                    2.0 * low[axis] <= twice && twice < 2.0 * high[axis]
                })
            };
            let before = segments.len();
            segments.extend(segments_of(fields, channel, channels.len() as u32, id.origin, is_own));
            if segments.len() > before {
                channels.push(channel.id);
            }
        });
        let side = segments.len().div_ceil(SEGMENTS_A_CELL).isqrt().clamp(1, MOST_CELLS);
        let raster = Raster { corner: low, cell: (high[0] - low[0]) / side as f64, side };
        let cell_of = |segment: &Segment| {
            let [column, row] = [0, 1].map(|axis| raster.line(axis, segment.from[axis] + 0.5 * segment.along[axis]));
            row * side + column
        };
        segments.sort_by_cached_key(cell_of);
        // How many each cell has, which says where the next one begins.
        let mut starts = vec![0; side * side + 1];
        for segment in &segments {
            starts[cell_of(segment) + 1] += 1;
        }
        for cell in 1..starts.len() {
            starts[cell] += starts[cell - 1];
        }
        let most = |width: fn(&Segment) -> f64| segments.iter().map(width).fold(0.0, f64::max);
        let widest = [most(Segment::widest_trough), most(|segment| segment.sunk)];
        let longest = most(|segment| length(segment.along));
        debug_assert!(longest <= fields.longest_segment(id.level), "a segment of {longest} grains at {id:?}");
        Patch { channels, segments, raster, starts, longest, widest }
    }

    /// The segments that may come so near to a place, with their channels.
    fn around(&self, place: [f64; 2], distance: f64) -> impl Iterator<Item = Near<'_>> {
        let reach = distance + 0.5 * self.longest;
        let columns = self.raster.lines(0, place[0], reach);
        let rows = self.raster.lines(1, place[1], reach);
        let cells = columns.zip(rows).into_iter();
        let segments = cells.flat_map(move |(columns, rows)| {
            // The cells of a row lie one after the other.
            (rows[0]..=rows[1]).flat_map(move |row| {
                let [from, to] =
                    [columns[0], columns[1] + 1].map(|column| self.starts[row * self.raster.side + column]);
                &self.segments[from as usize..to as usize]
            })
        });
        let near = segments.filter(move |segment| segment.line().touches(place, distance));
        near.map(|segment| Near { channel: self.channels[segment.channel as usize], segment })
    }
}

/// A segment with its channel.
#[derive(Clone, Copy, Debug)]
pub struct Near<'a> {
    /// The channel's id.
    pub channel: ChannelId,
    /// The segment.
    pub segment: &'a Segment,
}

/// The segments of the levels above one, around a place.
#[derive(Debug)]
pub struct Above {
    /// What their lines are relative to.
    pub origin: Point,
    /// The patches that hold them, level by level.
    pub patches: Vec<Arc<Patch>>,
}

impl Above {
    /// The segments that may come so near to a place, relative to the origin, in the order of patches and their rasters.
    pub fn around(&self, place: [f64; 2], distance: f64) -> impl Iterator<Item = Near<'_>> {
        self.patches.iter().flat_map(move |patch| patch.around(place, distance))
    }

    /// The segments whose sides have risen less, at a place, than that of a brook without a floor does within so many
    /// grains.
    pub fn beneath(&self, place: [f64; 2], brook: f64) -> Vec<&Segment> {
        let reach = Reach::even(brook);
        let is_beneath = |segment: &&Segment| segment.nearest(place).1 < segment.reach(reach).powi(2);
        let around = self.patches.iter().flat_map(|patch| {
            let [trough, lake] = patch.widest;
            patch.around(place, widened(brook, trough) + lake)
        });
        around.map(|near| near.segment).filter(is_beneath).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fluvial::Fluvial;
    use crate::fluvial::point::GRAINS;
    use crate::preset::Preset;

    #[test]
    fn patches_have_what_a_look_at_all_finds() {
        let settings = Preset::load("alps").unwrap().1.fluvial.unwrap();
        let fluvial = Fluvial::new(&settings, 10.0, None, 4, None);
        let (cell, corner) = (fluvial.fields().side(2) as f64, Point { x: 1 << 30, y: -(1 << 29) });
        let square = [corner, corner.moved([6.0 * cell; 2])];
        let origin = origin(fluvial.fields(), corner);
        let all = fluvial.network().segments(2, square, origin, Reach::even(3.0 * cell));
        let names = |segment: &Segment, channel: ChannelId| (channel, segment.knot);
        // In the square, at its edge, and where hardly a segment is.
        for place in [[0.4, 0.7], [3.1, 2.2], [5.9, 0.0], [0.0, 6.0], [4.5, 1.0]] {
            let at = corner.moved(place.map(|at| at * cell));
            let place = at.from(origin);
            let near = |distance: f64| [-distance, distance].map(|by| at.moved([by; 2]));
            let distance = 1.3 * cell;
            let above = fluvial.network().above(2, near(distance), Asked::Lines);
            let mut found: Vec<_> =
                above.around(place, distance).map(|near| names(near.segment, near.channel)).collect();
            found.sort_unstable();
            let touches = |segment: &&Segment| segment.line().touches(place, distance);
            let name = |segment: &Segment| names(segment, all.channels[segment.channel as usize].id);
            let mut expected: Vec<_> = all.all.iter().filter(touches).map(name).collect();
            expected.sort_unstable();
            assert_eq!(found, expected, "around {place:?}");
            let brook = 0.7 * cell;
            let above = fluvial.network().above(2, near(brook), Asked::Sides);
            let is_beneath = |segment: &&Segment| segment.nearest(place).1 < segment.reach(Reach::even(brook)).powi(2);
            assert_eq!(above.beneath(place, brook).len(), all.all.iter().filter(is_beneath).count(), "{place:?}");
        }
        assert!(all.all.len() > 500, "{} segments", all.all.len());
    }

    #[test]
    fn places_are_told_from_a_corner_near_by() {
        let settings = Preset::load("alps").unwrap().1.fluvial.unwrap();
        let fluvial = Fluvial::new(&settings, 10.0, None, 4, None);
        for at in [[0, 0], [-1, 1], [1 << 50, -(1 << 50)]] {
            let at = Point { x: at[0], y: at[1] };
            let off = at.from(origin(fluvial.fields(), at));
            let most = (ORIGIN_CELLS * fluvial.fields().side(0)) as f64;
            assert!(off.iter().all(|off| off.abs() <= most / 2.0), "{off:?}");
            // Room for a millionth of a vertex.
            assert!(most * f64::EPSILON < 1e-6 * GRAINS as f64);
        }
    }
}
