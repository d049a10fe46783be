//! The straight courses of tributaries: which cells of a level have one, and where it begins and ends.
//!
//! Straight lines to the nearest channel do not cross, nor do they cross channels; aslant they may. So each cell makes
//! a draft with both ends, of which neighbours know nothing, and then takes one by what the drafts around it might do.

use std::sync::Arc;

use super::channel::Mouth;
use super::chunk::ChunkId;
use super::fields::{BESIDE, Fields};
use super::point::{GRAINS, Point, chance};
use super::segment::{Segment, downstream};
use super::segment_index::IndexedSegments;
use super::tributary::most_area;
use super::trunk::NodeId;
use crate::geometry::{LineSegment, length, lerp};
use crate::hash::{self, Draw};
use crate::lines::LakeId;
use crate::memory::{Memory, Usage, heap_bytes};

/// Cells that a tributary is long at most, before it runs aslant: a head that is further from all channels has none, so
/// that what a channel depends on stays near.
pub const JOIN_CELLS: f64 = 3.0;

/// Cells that lie between a head and the nearest channel at least: at the finest level, and more at each level above
/// it. What begins nearer would be a short stub. Chosen by eye.
const LEAST_CELLS: (f64, f64) = (0.45, 0.12);

/// How far downstream of the nearest point a tributary ends, as a share of the distance: at the finest level, and more
/// at each level above it, up to a most.
///
/// Longer and more slanting tributaries at the coarser levels make large basins longer than wide: Hack's law.
const SLANT: (f64, f64, f64) = (1.1, 0.55, 2.6);

/// Shares of that which are tried, the first first, until one ends so far before the end of its channel, as a share of
/// the distance: there others end as well, and those that run to one place side by side are a fan. Chosen by eye.
const SLANT_SHARES: [f64; 4] = [1.0, 0.75, 0.5, 0.25];
const ENDS_BEFORE: f64 = 0.4;

/// How much further downstream than its fall line leads a tributary may end, as shares of the distance.
/// Only where so many levels are finer: without the larger ones wide hillsides would be bare.
const FURTHER: [f64; 4] = [0.25, 0.5, 1.0, 1.5];
const FURTHER_ABOVE: f64 = 2.0;

/// How far from all channels a tributary that runs aslant keeps, as a share of the way to where it ends, and at how
/// many places: one that comes nearer brushes past a bend of what it runs to, or along it, and in the world they would
/// cross.
const GRAZES: f64 = 0.15;
const GRAZES_AT: u32 = 16;

/// Share of the cells that are left without a channel, so that confluences are not spaced too evenly. Chosen by eye.
const LEFT_OUT: f64 = 0.15;

/// How steep a valley's side is, as a share of what it is further up, below which no dry brook begins: least, and more
/// by chance. On a flood plain it would be a scratch that leads nowhere. Chosen by eye.
const FLAT: (f64, f64) = (0.25, 0.15);

/// Vertices from the ends of a channel that nothing else joins it in: there others begin, and lines would cross by what
/// is rounded.
const CLEAR: f64 = 2.0;

/// So many times that distance, at most, from one to the next of those whose fall lines lead to one place.
const APART: f64 = 8.0;

/// Metres by which a channel beside the end of a tributary may be too high for that.
const BESIDE_M: f64 = 0.5;

/// Share of a cell's side that its head keeps off each edge, and what is left between. Chosen by eye.
const EDGE: f64 = 0.1;
const INNER: f64 = 0.8;

/// How far from a tributary's foot others are looked at that it might come across, in lengths of its direct way. One
/// that runs aslant is less than twice as long.
const AROUND: f64 = 3.0;

/// Cells that a tributary sticks out of the cell of its head at most: it ends within `JOIN_CELLS * sqrt(1 + SLANT^2)`,
/// and wanders by less than a cell.
pub const REACH_CELLS: f64 = 5.0;

/// Where a tributary begins, and where it ends if it runs straight to the nearest channel or if it runs aslant.
#[derive(Debug)]
struct Draft {
    cell: NodeId,
    head: Point,
    direct: TributaryEnd,
    aslant: Option<TributaryEnd>,
}

/// Where a tributary begins and where it ends.
#[derive(Debug)]
pub struct TributaryCourse {
    /// The cell of its head.
    pub cell: NodeId,
    /// Where it begins.
    pub head: Point,
    /// Where it ends.
    pub end: TributaryEnd,
}

/// Where a tributary ends.
#[derive(Clone, Copy, Debug)]
pub struct TributaryEnd {
    /// Where it comes to the channel, or ends in the sea.
    pub foot: Point,
    /// Where its course ends; beyond it, it runs straight on to its foot in the sea.
    pub shore: Point,
    /// Height of the water there in metres.
    pub level_m: f64,
    /// What it runs into.
    pub mouth: Mouth,
    /// Height in metres of the lake in which it ends, and the lake's id.
    pub lake: Option<(f64, LakeId)>,
}

heap_bytes!(Draft);
heap_bytes!(TributaryCourse);

impl TributaryCourse {
    /// The line along it, from its foot up.
    pub fn line(&self, origin: Point) -> LineSegment {
        self.end.line(self.head, origin)
    }
}

impl TributaryEnd {
    fn line(&self, head: Point, origin: Point) -> LineSegment {
        LineSegment { from: self.foot.from(origin), along: head.from(self.foot) }
    }
}

/// The courses of a world's tributaries. What they join, the segments of the levels above a chunk that matter so many
/// cells around it, relative to its corner, is asked of whoever asks for them.
#[derive(Debug)]
pub struct Courses {
    seed: u64,
    fields: Arc<Fields>,
    drafts: Memory<ChunkId, Vec<Draft>>,
    taken: Memory<ChunkId, Vec<TributaryCourse>>,
}

impl Courses {
    /// The courses of a world with these fields.
    pub fn new(fields: Arc<Fields>, seed: u64) -> Courses {
        Courses { seed, fields, drafts: Memory::new(24 << 20), taken: Memory::new(12 << 20) }
    }

    /// How full its memories are.
    pub(super) fn usages(&self) -> Vec<Usage> {
        vec![self.drafts.usage(), self.taken.usage()]
    }

    /// Where the tributaries of a chunk's cells begin and end.
    pub fn of(&self, id: ChunkId, above: &impl Fn(ChunkId, f64) -> IndexedSegments) -> Arc<Vec<TributaryCourse>> {
        self.taken.get(id, || {
            let own = self.drafts(id, above);
            let around: Vec<Arc<Vec<Draft>>> = id.with_neighbours().map(|chunk| self.drafts(chunk, above)).collect();
            let origin = id.square(&self.fields)[0];
            let course = |draft: &Draft| {
                // Those that may come across its line.
                let line = draft.direct.line(draft.head, origin);
                let reach = length(line.along) * AROUND;
                let near = |other: &&Draft| {
                    other.cell != draft.cell && other.direct.line(other.head, origin).touches(line.from, reach)
                };
                let others: Vec<&Draft> = around.iter().flat_map(|drafts| drafts.iter()).filter(near).collect();
                Some(TributaryCourse { cell: draft.cell, head: draft.head, end: taken(draft, &others, origin)? })
            };
            own.iter().filter_map(course).collect()
        })
    }

    /// Where the tributaries of a chunk's cells begin and may end.
    fn drafts(&self, id: ChunkId, above: &impl Fn(ChunkId, f64) -> IndexedSegments) -> Arc<Vec<Draft>> {
        self.drafts.get(id, || {
            let above = above(id, JOIN_CELLS);
            id.cells().filter_map(|cell| self.draft(id.level, cell, &above)).collect()
        })
    }

    /// Where the tributary of a cell begins and may end, if there is one, given the segments of the levels above around
    /// it.
    fn draft(&self, level: u32, id: NodeId, above: &IndexedSegments) -> Option<Draft> {
        let (fields, cell) = (&self.fields, self.fields.side(level));
        let seed = hash::network_level(self.seed, level);
        if chance(seed, id, Draw::Choice, 0) < LEFT_OUT {
            return None;
        }
        // Not at the edge of its cell, so that heads of neighbours keep apart.
        let corner = Point { x: id.0 * cell, y: id.1 * cell };
        let head = corner.moved([0, 1].map(|axis| (EDGE + INNER * chance(seed, id, Draw::Head, axis)) * cell as f64));
        if fields.potential(head) < fields.sea_potential() {
            return None;
        }
        let origin = above.segments.origin;
        let from = head.from(origin);
        // Of all that is known around the chunk, what may matter to this head.
        let near = above.around(from, JOIN_CELLS * cell as f64);
        // At the nearest channel, or at the coast if that is nearer.
        let coasts = if fields.has_sea() { &near[..] } else { &[] };
        let nearest = coasts.iter().map(|(_, segment)| segment.nearest(from).1).fold(f64::INFINITY, f64::min).sqrt();
        let most = JOIN_CELLS * cell as f64;
        if let Some(direct) = self.sea_end(level, head, nearest.min(most), above) {
            return Some(Draft { cell: id, head, direct, aslant: None });
        }
        let to_channel = self.draft_to_channel(level, id, head, &near, above);
        // Where no channel can be come to the coast may, also if it is further: else a shore between mouths would be
        // the bare side of far valleys.
        let is_clear = |end: &TributaryEnd| is_clear(&end.line(head, origin), above);
        to_channel.or_else(|| {
            let direct = self.sea_end(level, head, most, above).filter(is_clear)?;
            Some(Draft { cell: id, head, direct, aslant: None })
        })
    }

    /// Where a tributary of a level ends in the sea, if the coast is no further from its head than `most` grains.
    fn sea_end(&self, level: u32, head: Point, most: f64, above: &IndexedSegments) -> Option<TributaryEnd> {
        let [shore, beyond] = self.fields.coast_near(head, most)?;
        // On into the sea where no channel is in the way.
        let line = LineSegment { from: beyond.from(above.segments.origin), along: head.from(beyond) };
        let crosses = |(_, segment): &(usize, &Segment)| segment.line().crosses(&line);
        let foot = if beside(above, &line, 0.0).iter().any(crosses) { shore } else { beyond };
        Some(TributaryEnd { foot, shore, level_m: self.fields.filled_m(level), mouth: Mouth::Sea, lake: None })
    }

    /// Where the tributary of a cell begins and may end if it runs to a channel, given those near its head.
    fn draft_to_channel(
        &self,
        level: u32,
        id: NodeId,
        head: Point,
        near: &[(usize, &Segment)],
        above: &IndexedSegments,
    ) -> Option<Draft> {
        let (fields, cell) = (&self.fields, self.fields.side(level));
        let hill_slope = fields.hill_slope(fields.uplift(head)) * fields.metres_a_grain();
        let origin = above.segments.origin;
        let (from, most) = (head.from(origin), JOIN_CELLS * cell as f64);
        // By how many levels there is room for finer ones in between.
        let finer = (fields.levels() - 1 - level) as f64;
        let least = (LEAST_CELLS.0 + LEAST_CELLS.1 * finer) * cell as f64;
        // Not to the nearest channel but to the one whose valley it lies in, and down the fall line of its side.
        let (head_m, number) = owner(near, from, hill_slope)?;
        let segment = &above.segments.all[number];
        // Nothing begins in a lake.
        if head_m < segment.pool_m {
            return None;
        }
        let (t, square) = segment.nearest(from);
        let distance = square.sqrt();
        let seed = hash::network_level(self.seed, level);
        let flat = FLAT.0 + FLAT.1 * chance(seed, id, Draw::Flat, 0);
        if !fields.is_wet(most_area(level)) && steepness(segment, t, square) < flat {
            return None;
        }
        let shift = distance * segment.bed_slope().max(0.0) / (hill_slope * segment.gentlest_cross());
        // Where a bed becomes flat, as at a lake, the fall lines of many heads meet: they join one below the other.
        let apart = if t == 0.0 || t == 1.0 { 1.0 + APART * chance(seed, id, Draw::Foot, 0) } else { 0.0 };
        let shift = shift + apart * CLEAR * GRAINS as f64;
        let end = |segment: &Segment, t: f64| {
            let foot = origin.moved([0, 1].map(|axis| segment.from[axis] + segment.along[axis] * t));
            let channel = &above.segments.channels[segment.channel as usize];
            let level_m = lerp(segment.level_m, t);
            let lake = channel.lake.filter(|_| level_m < segment.pool_m).map(|id| (segment.pool_m, id));
            TributaryEnd { foot, shore: foot, level_m, mouth: Mouth::Channel(channel.id), lake }
        };
        // Only where the land is higher than its end all the way: the coast may be lower.
        let falls = |end: &TributaryEnd| {
            let places = fields.segments_a_channel(level);
            let way = head.from(end.foot).map(|part| part / places as f64);
            let mut places = (1..=places).map(|place| end.foot.moved(way.map(|part| part * place as f64)));
            let filled_m = fields.filled_m(level);
            !fields.has_sea() || places.all(|at| fields.below_coast_m(at, filled_m) > end.level_m)
        };
        // Nor does it end under a steep channel beside it, whose water it would take.
        let is_free = |end: &TributaryEnd| {
            let foot = end.foot.from(origin);
            near.iter().filter(|(_, beside)| beside.channel != segment.channel).all(|(_, segment)| {
                let most_m = segment.level_m[0] - end.level_m - BESIDE_M;
                let steep = hill_slope * BESIDE;
                most_m <= 0.0 || !segment.line().touches(foot, most_m / steep) || {
                    let (t, square) = segment.nearest(foot);
                    lerp(segment.level_m, t) - end.level_m - BESIDE_M <= steep * square.sqrt()
                }
            })
        };
        let fits = |end: &TributaryEnd| {
            let way = length(head.from(end.foot));
            falls(end) && least <= way && way <= most && end.level_m < head_m && is_free(end)
        };
        let is_clear = |end: &TributaryEnd| is_clear(&end.line(head, origin), above);
        let at = |shift: f64, left: f64| {
            let clear = CLEAR * GRAINS as f64;
            let down = |number: usize, t: f64, grains: f64| downstream(&above.segments.all, number, t, grains);
            let (mut number, mut t) = down(number, t, shift)?;
            let segment = &above.segments.all[number];
            if segment.knot == 0 && t * length(segment.along) < clear {
                (number, t) = down(number, t, clear)?;
            }
            down(number, t, clear.max(left))?;
            Some(end(&above.segments.all[number], t)).filter(fits)
        };
        let slant = (SLANT.0 + SLANT.1 * finer).min(SLANT.2) * distance;
        // Where the fall line leads is the best end; where that is taken, one further down is better than no valley.
        let first = [shift, apart * CLEAR * GRAINS as f64].into_iter();
        let further = FURTHER.into_iter().filter(|_| finer >= FURTHER_ABOVE).map(|share| shift + share * distance);
        let direct = first.chain(further).find_map(|shift| at(shift, 0.0).filter(is_clear))?;
        let shares = SLANT_SHARES.into_iter().filter(|_| slant > shift);
        let mut slants = shares.filter_map(|share| at(shift + (slant - shift) * share, ENDS_BEFORE * distance));
        let aslant = slants.next();
        Some(Draft { cell: id, head, direct, aslant: aslant.filter(is_clear) })
    }
}

/// The end that a tributary takes, given the drafts around it; `None` if it has to give way.
fn taken(draft: &Draft, others: &[&Draft], origin: Point) -> Option<TributaryEnd> {
    let direct = draft.direct.line(draft.head, origin);
    // Lines to the valleys that heads lie in hardly ever cross, but slopes differ from head to head. Those to the coast
    // may cross any, and give way to all but each other.
    let to_sea = |draft: &Draft| draft.direct.mouth == Mouth::Sea;
    let gives_way = |other: &&Draft| {
        let stays = if to_sea(draft) == to_sea(other) { other.cell < draft.cell } else { to_sea(draft) };
        stays && other.direct.line(other.head, origin).crosses(&direct)
    };
    if others.iter().any(gives_way) {
        return None;
    }
    let Some(aslant) = draft.aslant else { return Some(draft.direct) };
    let line = aslant.line(draft.head, origin);
    // Whichever end the others take: so it does not matter who takes first.
    let blocks = |other: &&Draft| {
        let ends = [Some(other.direct), other.aslant];
        ends.into_iter().flatten().any(|end| end.line(other.head, origin).crosses(&line))
    };
    Some(if others.iter().any(blocks) { draft.direct } else { aslant })
}

/// The segments that may come so near to a line, as a share of its length.
fn beside<'a>(above: &'a IndexedSegments, line: &LineSegment, share: f64) -> Vec<(usize, &'a Segment)> {
    let middle = [0, 1].map(|axis| line.from[axis] + line.along[axis] / 2.0);
    above.around(middle, (0.5 + share) * length(line.along))
}

/// Whether a line from a foot up neither crosses nor [grazes] the channels that it may come near to.
fn is_clear(line: &LineSegment, above: &IndexedSegments) -> bool {
    let meets = |(_, segment): &(usize, &Segment)| segment.line().crosses(line) || grazes(line, segment);
    !beside(above, line, GRAZES).iter().any(meets)
}

/// Whether a line comes near to a segment: from its foot up it may as near as it is far from its foot, by a share.
fn grazes(line: &LineSegment, segment: &Segment) -> bool {
    let whole = length(line.along);
    // Closer together near its foot, where a bend may come back to it.
    [0.25, 0.5].into_iter().chain((1..=GRAZES_AT).map(f64::from)).any(|step| {
        let share = step / f64::from(GRAZES_AT);
        let place = [0, 1].map(|axis| line.from[axis] + line.along[axis] * share);
        let least = GRAZES * share * whole;
        segment.line().touches(place, least) && segment.nearest(place).1 < least * least
    })
}

/// The channel whose side is lowest at a place, of those near it, where hillsides rise so many metres a grain: the height
/// of that side in metres, and the number of the segment that it rises from.
fn owner(near: &[(usize, &Segment)], at: [f64; 2], slope: f64) -> Option<(f64, usize)> {
    near.iter().fold(None, |lowest, (number, segment)| {
        let most_m = lowest.map_or(f64::INFINITY, |(side_m, _)| side_m);
        segment.side_below_m(at, slope, most_m).map(|side_m| (side_m, *number)).or(lowest)
    })
}

/// How steep a segment's side is at a share of it and the square of a distance from it, as a share of what it is further
/// up.
fn steepness(segment: &Segment, t: f64, square: f64) -> f64 {
    let (trough, river) = (lerp(segment.trough, t), lerp(segment.river, t));
    (square / (square + trough * trough - river * river).max(1.0)).sqrt()
}
