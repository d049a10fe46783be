//! What is above a level: the segments of its coarser levels, by place.
//!
//! Whoever makes a channel asks for those around it, and most ask for the same ones. So each is made once, in the patch that
//! holds its middle, and what is around a channel is a list of patches.

use std::cell::Cell;
use std::sync::Arc;

use super::channel::Channel;
use super::fields::Fields;
use super::lake;
use super::point::{Point, overlap};
use super::segment::{Bounds, Reach, Segment, segments_of, widened};
use super::trunk::NodeId;
use crate::geometry::length;
use crate::lines::ChannelId;
use crate::memory::heap_bytes;

/// Cells of the trunk lattice a side of the squares from whose corners places in patches are told: small numbers, with room
/// for fractions, and yet hardly a patch is made from two corners.
const ORIGIN_CELLS: i64 = 1 << 10;

/// Segments of a group, about, and groups along a side of a patch at most.
const GROUP: usize = 4;
const MOST_GROUPS: usize = 32;

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
    /// The segments, group by group, and in each of the channels' and from their heads down.
    segments: Vec<Segment>,
    /// Those that lie close together.
    groups: Vec<Group>,
    /// What all have in common.
    bounds: Bounds,
}

/// Segments of a patch that lie close together.
#[derive(Debug)]
struct Group {
    /// The place of the first one, and that behind the last.
    places: [u32; 2],
    bounds: Bounds,
}

heap_bytes!(ChannelId);
heap_bytes!(Group);
heap_bytes!(Patch: channels, segments, groups);

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
        Asked::Sides => widened(lake::most_sunk(fields, level), fields.widest_trough(level)),
    };
    // A line that touches it has its middle no further off than half of its length.
    let reach = sides + 0.5 * fields.longest_segment(level);
    let cells = fields.cells(level, [low.moved([-reach; 2]), high.moved([reach; 2])]);
    cells.map(move |(level, x, y)| PatchId { level, cell: (x, y), origin })
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
        // By the cells of a raster, what lies close together comes to lie so here.
        let side = segments.len().div_ceil(GROUP).isqrt().clamp(1, MOST_GROUPS);
        let cell = (high[0] - low[0]) / side as f64;
        let cell_of = |segment: &Segment| {
            let [column, row] = [0, 1].map(|axis| {
                let off = segment.from[axis] + 0.5 * segment.along[axis] - low[axis];
                ((off / cell).max(0.0) as usize).min(side - 1)
            });
            row * side + column
        };
        segments.sort_by_cached_key(cell_of);
        let mut groups = Vec::new();
        for group in segments.chunk_by(|a, b| cell_of(a) == cell_of(b)) {
            let from = groups.last().map_or(0, |group: &Group| group.places[1]);
            groups.push(Group { places: [from, from + group.len() as u32], bounds: Bounds::of(group) });
        }
        let bounds = Bounds::of(&segments);
        debug_assert!(
            segments.iter().all(|segment| length(segment.along) <= fields.longest_segment(id.level)),
            "{id:?}"
        );
        Patch { channels, segments, groups, bounds }
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
    /// The segments of all groups that may matter by their bounds, in the order of patches and their groups.
    ///
    /// Groups are asked about one after the other, so what is known from those before may decide about the next.
    pub fn of_groups(&self, may_matter: impl Fn(&Bounds) -> bool + Copy) -> impl Iterator<Item = Near<'_>> {
        let patches = self.patches.iter().filter(move |patch| !patch.groups.is_empty() && may_matter(&patch.bounds));
        patches.flat_map(move |patch| {
            let groups = patch.groups.iter().filter(move |group| may_matter(&group.bounds));
            groups.flat_map(move |group| {
                let [from, to] = group.places.map(|place| place as usize);
                patch.segments[from..to]
                    .iter()
                    .map(|segment| Near { channel: patch.channels[segment.channel as usize], segment })
            })
        })
    }

    /// The segments whose bounding rectangles overlap one.
    pub fn overlapping(&self, rectangle: [[f64; 2]; 2]) -> impl Iterator<Item = &Segment> {
        let overlaps = move |bounds: &Bounds| bounds.overlaps(rectangle, 0.0);
        self.of_groups(overlaps).map(|near| near.segment).filter(move |segment| {
            let [low, high] = segment.bounds();
            let overlaps = |axis: usize| rectangle[0][axis] <= high[axis] && low[axis] <= rectangle[1][axis];
            overlaps(0) & overlaps(1)
        })
    }

    /// The segment that is nearest to a place, of those that may come so near to it, and the square of how far away it is.
    pub fn nearest(&self, place: [f64; 2], distance: f64) -> Option<(f64, Near<'_>)> {
        let least = Cell::new(f64::INFINITY);
        let may_be_nearer =
            |bounds: &Bounds| bounds.least_square(place) < least.get() && bounds.touches(place, distance);
        let nearest = self.of_groups(&may_be_nearer).fold(None, |nearest, near| {
            let square = near.segment.nearest(place).1;
            if square < least.get() && near.segment.line().touches(place, distance) {
                least.set(square);
                return Some(near);
            }
            nearest
        });
        nearest.map(|near| (least.get(), near))
    }

    /// The segment whose side is lowest at a place, of those that may come so near to it, and the height of that side in
    /// metres, where hillsides rise so many metres a grain.
    pub fn lowest_side(&self, place: [f64; 2], slope: f64, distance: f64) -> Option<(f64, Near<'_>)> {
        let least_m = Cell::new(f64::INFINITY);
        let may_be_lower = |bounds: &Bounds| {
            bounds.touches(place, distance) && bounds.may_be_below(bounds.least_square(place), slope, least_m.get())
        };
        let lowest = self.of_groups(&may_be_lower).fold(None, |lowest, near| {
            if near.segment.line().touches(place, distance)
                && let Some(side_m) = near.segment.side_below_m(place, slope, least_m.get())
            {
                least_m.set(side_m);
                return Some(near);
            }
            lowest
        });
        lowest.map(|near| (least_m.get(), near))
    }

    /// The segments whose sides have risen less, at a place, than that of a brook without a floor does within so many
    /// grains, of those groups that may matter.
    pub fn beneath(
        &self,
        place: [f64; 2],
        brook: f64,
        may_matter: impl Fn(&Bounds) -> bool + Copy,
    ) -> impl Iterator<Item = &Segment> {
        let reach = Reach::even(brook);
        let may_be =
            move |bounds: &Bounds| bounds.least_square(place) < bounds.reach(brook).powi(2) && may_matter(bounds);
        let is_beneath = move |segment: &&Segment| segment.nearest(place).1 < segment.reach(reach).powi(2);
        self.of_groups(may_be).map(|near| near.segment).filter(is_beneath)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fluvial::Fluvial;
    use crate::fluvial::network::ShownChannels;
    use crate::fluvial::point::GRAINS;
    use crate::preset::Preset;

    #[test]
    fn patches_have_what_a_look_at_all_finds() {
        let settings = Preset::load("alps").unwrap().1.fluvial.unwrap();
        let fluvial = Fluvial::new(&settings, 10.0, None, 4, None);
        let (cell, corner) = (fluvial.fields().side(2) as f64, Point { x: 1 << 30, y: -(1 << 29) });
        let square = [corner, corner.moved([6.0 * cell; 2])];
        let origin = origin(fluvial.fields(), corner);
        let all = fluvial.network().segments(ShownChannels::whole(2), square, origin, Reach::even(3.0 * cell));
        let name = |segment: &Segment| (all.channels[segment.channel as usize].id, segment.knot);
        let slope = fluvial.fields().least_hill_slope() * fluvial.fields().metres_a_grain();
        // In the square, at its edge, and where hardly a segment is.
        for place in [[0.4, 0.7], [3.1, 2.2], [5.9, 0.0], [0.0, 6.0], [4.5, 1.0]] {
            let at = corner.moved(place.map(|at| at * cell));
            let place = at.from(origin);
            let near = |distance: f64| [-distance, distance].map(|by| at.moved([by; 2]));
            let distance = 1.3 * cell;
            let above = fluvial.network().above(2, near(distance), Asked::Lines);
            let around = [-distance, distance].map(|by| place.map(|at| at + by));
            let names = |segments: &mut dyn Iterator<Item = &Segment>| {
                let mut places: Vec<_> = segments.map(|segment| segment.from.map(f64::to_bits)).collect();
                places.sort_unstable();
                places
            };
            let touch = || all.all.iter().filter(|segment| segment.line().touches(place, distance));
            assert_eq!(names(&mut above.overlapping(around)), names(&mut touch()), "around {place:?}");
            let nearest = touch().map(|segment| segment.nearest(place).1).min_by(f64::total_cmp);
            assert_eq!(above.nearest(place, distance).map(|(square, _)| square), nearest, "{place:?}");
            let lowest = touch().map(|segment| segment.side_m(place, slope)).min_by(f64::total_cmp);
            let found = above.lowest_side(place, slope, distance);
            assert_eq!(found.map(|(side_m, _)| side_m), lowest, "{place:?}");
            if let Some((side_m, near)) = found {
                let of_id = touch().find(|segment| name(segment) == (near.channel, near.segment.knot)).unwrap();
                assert_eq!(of_id.side_m(place, slope), side_m, "the channel's id is another's");
            }
            let brook = 0.7 * cell;
            let above = fluvial.network().above(2, near(brook), Asked::Sides);
            let is_beneath = |segment: &&Segment| segment.nearest(place).1 < segment.reach(Reach::even(brook)).powi(2);
            assert_eq!(
                above.beneath(place, brook, |_| true).count(),
                all.all.iter().filter(is_beneath).count(),
                "{place:?}"
            );
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
