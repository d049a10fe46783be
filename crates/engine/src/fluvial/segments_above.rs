//! The segments of the levels above a level, found by place.
//!
//! To make a channel, the segments around it are needed, and many channels need the same ones. So each segment is made
//! once, in the patch that holds its middle, and the surroundings of a channel are a list of patches.

use std::cell::Cell;
use std::sync::Arc;

use glam::DVec2;

use super::channel::Channel;
use super::fields::Fields;
use super::lake;
use super::segment::{Reach, Segment, SegmentBounds, segments_of, touches, widened};
use super::trunk_lattice::NodeId;
use crate::grain_point::{Point, overlap, padded};
use crate::lines::ChannelId;
use crate::memory::heap_bytes;

/// Side, in cells of the trunk lattice, of the squares whose corners are the origins of places in patches. Such places
/// are small numbers with room for fractions, and few patches are made with two different origins.
const ORIGIN_CELLS: i64 = 1 << 10;

/// Number of segments in a group, about, and most groups along a side of a patch.
const GROUP: usize = 4;
const MOST_GROUPS: usize = 32;

/// The id of a patch: a cell of a level's lattice, and the origin of the patch's places.
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
    /// The channels to which the segments belong.
    channels: Vec<ChannelId>,
    /// The segments, group by group; within a group in the order of channels, and from their heads down.
    segments: Vec<Segment>,
    /// Groups of segments that lie close together.
    groups: Vec<SegmentGroup>,
    /// SegmentBounds of all segments.
    bounds: SegmentBounds,
}

/// Segments of a patch that lie close together.
#[derive(Debug)]
struct SegmentGroup {
    /// Indices of the group's first segment and of the one after its last.
    places: [u32; 2],
    bounds: SegmentBounds,
}

heap_bytes!(ChannelId);
heap_bytes!(SegmentGroup);
heap_bytes!(Patch: channels, segments, groups);

/// The kind of segments that are asked for in a rectangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChannelPart {
    /// Channels whose lines touch the rectangle.
    Lines,
    /// Channels whose valley sides may be lowest in the rectangle, and their lines.
    Sides,
}

/// A source of channels, and of the segments above a level.
pub trait AsksAbove {
    /// Returns the segments of the levels above `level` that are asked for in a rectangle.
    fn above(&self, level: u32, rectangle: [Point; 2], part: ChannelPart) -> Above;

    /// The channel of an id, if there is one.
    fn channel(&self, id: ChannelId) -> Option<Arc<Channel>>;
}

/// Returns the origin of places near a point.
pub fn origin(fields: &Fields, at: Point) -> Point {
    let grains = ORIGIN_CELLS * fields.side(0);
    // The nearest corner, so that around the world's own origin, which is asked about most, all places have the same
    // origin.
    let nearest = |at: i64| (at + grains / 2).div_euclid(grains) * grains;
    Point { x: nearest(at.x), y: nearest(at.y) }
}

/// Returns the patches of a level that may hold segments asked for in a rectangle.
pub fn patches(
    fields: &Fields,
    level: u32,
    rectangle: [Point; 2],
    part: ChannelPart,
    origin: Point,
) -> impl Iterator<Item = PatchId> {
    let sides = match part {
        ChannelPart::Lines => 0.0,
        ChannelPart::Sides => widened(lake::most_sunk(fields, level), fields.widest_trough(level)),
    };
    // The middle of a line that touches the rectangle is at most half of the line's length away.
    let reach = sides + 0.5 * fields.longest_segment(level);
    let cells = fields.cells(level, padded(rectangle, reach));
    cells.map(move |(level, x, y)| PatchId { level, cell: (x, y), origin })
}

impl PatchId {
    /// Returns the corners of the patch's cell.
    pub fn square(self, fields: &Fields) -> [Point; 2] {
        let side = fields.side(self.level);
        let low = Point { x: self.cell.0 * side, y: self.cell.1 * side };
        [low, Point { x: low.x + side, y: low.y + side }]
    }
}

impl Patch {
    /// Makes a patch. `channels_in` visits all channels of its level that touch its square.
    pub fn new(fields: &Fields, id: PatchId, channels_in: impl FnOnce(&mut dyn FnMut(&Arc<Channel>))) -> Patch {
        let square = id.square(fields);
        let [low, high] = square.map(|corner| corner.from(id.origin));
        let (mut channels, mut segments) = (Vec::new(), Vec::new());
        channels_in(&mut |channel| {
            if !overlap(channel.bounds(), square) {
                return;
            }
            let is_own = |[from, to]: [DVec2; 2]| {
                // A cell includes its northern and western edges only, so each middle lies in exactly one cell.
                (2.0 * low).cmple(from + to).all() && (from + to).cmplt(2.0 * high).all()
            };
            let before = segments.len();
            segments.extend(segments_of(fields, channel, channels.len() as u32, id.origin, is_own));
            if segments.len() > before {
                channels.push(channel.id);
            }
        });
        // Sorted by the cells of a raster, so that segments close together are neighbours in the list too.
        let side = segments.len().div_ceil(GROUP).isqrt().clamp(1, MOST_GROUPS);
        let cell = (high.x - low.x) / side as f64;
        let cell_of = |segment: &Segment| {
            let off = (segment.from + 0.5 * segment.along - low) / cell;
            let [column, row] = off.to_array().map(|off| (off.max(0.0) as usize).min(side - 1));
            row * side + column
        };
        segments.sort_by_cached_key(cell_of);
        let mut groups = Vec::new();
        for group in segments.chunk_by(|a, b| cell_of(a) == cell_of(b)) {
            let from = groups.last().map_or(0, |group: &SegmentGroup| group.places[1]);
            groups.push(SegmentGroup { places: [from, from + group.len() as u32], bounds: SegmentBounds::of(group) });
        }
        let bounds = SegmentBounds::of(&segments);
        debug_assert!(
            segments.iter().all(|segment| segment.along.length() <= fields.longest_segment(id.level)),
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

/// The segments of the levels above a level, around a place.
#[derive(Debug)]
pub struct Above {
    /// The origin of the segments' lines.
    pub origin: Point,
    /// The patches that hold the segments, level by level.
    pub patches: Vec<Arc<Patch>>,
}

impl Above {
    /// Returns the segments of all groups whose bounds `may_matter` accepts, in the order of patches and their groups.
    ///
    /// The iterator is lazy: `may_matter` is called for each group in turn, so results from earlier groups can rule out
    /// later ones.
    pub fn of_groups(&self, may_matter: impl Fn(&SegmentBounds) -> bool + Copy) -> impl Iterator<Item = Near<'_>> {
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

    /// Returns the segments whose bounding boxes overlap a rectangle.
    pub fn overlapping(&self, rectangle: [DVec2; 2]) -> impl Iterator<Item = &Segment> {
        let overlaps = move |bounds: &SegmentBounds| bounds.overlaps(rectangle, 0.0);
        let segments = self.of_groups(overlaps).map(|near| near.segment);
        segments.filter(move |segment| touches(segment.bounds(), rectangle, 0.0))
    }

    /// Returns the segment nearest to a place, among those that may come within `distance` grains of it, with the
    /// square of its distance.
    pub fn nearest(&self, place: DVec2, distance: f64) -> Option<(f64, Near<'_>)> {
        let least = Cell::new(f64::INFINITY);
        let may_be_nearer =
            |bounds: &SegmentBounds| bounds.least_square(place) < least.get() && bounds.touches(place, distance);
        let nearest = self.of_groups(&may_be_nearer).fold(None, |nearest, near| {
            let square = near.segment.nearest(place).1;
            if square < least.get() && near.segment.line().touches(place.into(), distance) {
                least.set(square);
                return Some(near);
            }
            nearest
        });
        nearest.map(|near| (least.get(), near))
    }

    /// Returns the segment whose side is lowest at a place, among those that may come within `distance` grains of it,
    /// with the height of that side in metres. `slope` is the rise of hillsides in metres a grain.
    pub fn lowest_side(&self, place: DVec2, slope: f64, distance: f64) -> Option<(f64, Near<'_>)> {
        let least_m = Cell::new(f64::INFINITY);
        let may_be_lower = |bounds: &SegmentBounds| {
            bounds.touches(place, distance) && bounds.may_be_below(bounds.least_square(place), slope, least_m.get())
        };
        let lowest = self.of_groups(&may_be_lower).fold(None, |lowest, near| {
            if near.segment.line().touches(place.into(), distance)
                && let Some(side_m) = near.segment.side_below_m(place, slope, least_m.get())
            {
                least_m.set(side_m);
                return Some(near);
            }
            lowest
        });
        lowest.map(|near| (least_m.get(), near))
    }

    /// Returns the segments, of groups that `may_matter` accepts, whose sides have risen less at a place than the side
    /// of a brook without a floor rises over `brook` grains.
    pub fn beneath(
        &self,
        place: DVec2,
        brook: f64,
        may_matter: impl Fn(&SegmentBounds) -> bool + Copy,
    ) -> impl Iterator<Item = &Segment> {
        let reach = Reach::even(brook);
        let may_be = move |bounds: &SegmentBounds| {
            bounds.least_square(place) < bounds.reach(brook).powi(2) && may_matter(bounds)
        };
        let is_beneath = move |segment: &&Segment| segment.nearest(place).1 < segment.reach(reach).powi(2);
        self.of_groups(may_be).map(|near| near.segment).filter(is_beneath)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clock::Clock;
    use crate::fluvial::Fluvial;
    use crate::fluvial::network::ShownChannels;
    use crate::grain_point::GRAINS;

    #[test]
    fn patches_have_what_a_look_at_all_finds() {
        let fluvial = Fluvial::of_preset("alps", 4, |_| {});
        let (cell, corner) = (fluvial.fields().side(2) as f64, Point { x: 1 << 30, y: -(1 << 29) });
        let square = [corner, corner.moved(DVec2::splat(6.0 * cell))];
        let origin = origin(fluvial.fields(), corner);
        let all = fluvial
            .network()
            .segments(ShownChannels::whole(2), square, origin, Reach::even(3.0 * cell), &Clock::default())
            .unwrap();
        let name = |segment: &Segment| (all.channels[segment.channel as usize].id, segment.knot);
        let slope = fluvial.fields().least_laws().hill_slope * fluvial.fields().metres_a_grain();
        // Places in the square, at its edge, and where there are hardly any segments.
        for place in [[0.4, 0.7], [3.1, 2.2], [5.9, 0.0], [0.0, 6.0], [4.5, 1.0]] {
            let at = corner.moved(DVec2::from(place) * cell);
            let place = at.from(origin);
            let near = |distance: f64| at.square(distance);
            let distance = 1.3 * cell;
            let above = fluvial.network().above(2, near(distance), ChannelPart::Lines);
            let around = [place - distance, place + distance];
            let names = |segments: &mut dyn Iterator<Item = &Segment>| {
                let mut places: Vec<_> = segments.map(|segment| segment.from.to_array().map(f64::to_bits)).collect();
                places.sort_unstable();
                places
            };
            let touch = || all.all.iter().filter(|segment| segment.line().touches(place.into(), distance));
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
            let above = fluvial.network().above(2, near(brook), ChannelPart::Sides);
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
        let fluvial = Fluvial::of_preset("alps", 4, |_| {});
        for at in [[0, 0], [-1, 1], [1 << 50, -(1 << 50)]] {
            let at = Point { x: at[0], y: at[1] };
            let off = at.from(origin(fluvial.fields(), at));
            let most = (ORIGIN_CELLS * fluvial.fields().side(0)) as f64;
            assert!(off.abs().max_element() <= most / 2.0, "{off:?}");
            // Room for a millionth of a vertex.
            assert!(most * f64::EPSILON < 1e-6 * GRAINS as f64);
        }
    }
}
