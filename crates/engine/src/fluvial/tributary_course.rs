//! The straight courses of tributaries: which cells of a level have one, and where it begins and ends.
//!
//! Straight lines to the nearest channel cross neither each other nor any channel, but lines that run aslant may. So
//! each cell first makes a draft with both ends, without looking at its neighbours. Then it chooses one of the ends, by
//! all that the drafts around it might do.
//!
//! To judge the numbers chosen by eye, look at the pattern of brooks, on a map without relief.

use std::sync::{Arc, OnceLock};

use glam::DVec2;

use super::channel::{Channel, ChannelPlace, Knot, Mouth};
use super::course_offsets;
use super::cross_section::MOST_LEAN;
use super::fields::{Fields, INTO_SEA, most_area};
use super::laws::Laws;
use super::segment::{Segment, SegmentBounds, rise};
use super::segments_above::{Above, AsksAbove, ChannelPart, Near};
use super::trunk_lattice::NodeId;
use crate::geometry::{LineSegment, length, lerp};
use crate::grain_point::{self, GRAINS, Point, chance, overlap};
use crate::hash::{self, Draw};
use crate::lines::{ChannelId, LakeId};
use crate::memory::{Memory, Remembers, heap_bytes};

/// Cells by which the radius around a head within which channels are looked up exceeds the longest tributary, so that
/// channels beside the mouth are found too.
const BESIDE_CELLS: f64 = 0.5;

/// Least length of a tributary's straight course, in cells of its level: at the finest level, and the addition for each
/// level above it. A shorter tributary would be a stub. Chosen by eye.
const LEAST_CELLS: (f64, f64) = (0.45, 0.12);

/// Distance from the point of a channel nearest to the head to the end of a tributary aslant, downstream along the
/// channel, as a share of the distance from the head to the channel: at the finest level, the addition for each level
/// above it, and the maximum.
///
/// Longer and more slanting tributaries at the coarser levels make large basins longer than wide: Hack's law.
const SLANT: (f64, f64, f64) = (0.7, 0.8, 3.5);

/// Shares of the slant that are tried in this order, until one leads to an end that fits. The end must lie upstream of
/// the end of its channel by `ENDS_BEFORE`, as a share of the distance from the head: other tributaries end there as
/// well, and lines that run side by side to one place would form a fan. Chosen by eye.
const SLANT_SHARES: [f64; 4] = [1.0, 0.75, 0.5, 0.25];
const ENDS_BEFORE: f64 = 0.4;

/// Further places at which a tributary may end, downstream of the end of its fall line, as shares of the distance from
/// the head. They are only tried at levels with at least `FURTHER_ABOVE` finer ones: without the large tributaries wide
/// hillsides would be bare.
const FURTHER: [f64; 4] = [0.25, 0.5, 1.0, 1.5];
const FURTHER_ABOVE: f64 = 2.0;

/// Least distance of a tributary's line from all channels, as a share of the distance to its foot, and the number of
/// places of the line at which this is checked. A line that comes nearer brushes past a bend of the channel that it
/// joins, or runs along that channel, and in the world the two would cross.
const GRAZES: f64 = 0.15;
const GRAZES_AT: u32 = 16;

/// Least distance of a tributary from a longer one of its level, as the mean of the distances of its two ends and as a
/// share of its length. A tributary that runs closer gives way, and its land drains to the longer one. Chosen by eye.
const NEEDLE: f64 = 0.15;

/// Search radius for other drafts that cross this one or are [needles](NEEDLE) beside it, as a share of this one's
/// length. The formula follows from `NEEDLE`: no needle is further away, so none is missed.
const BESIDE_WAYS: f64 = 2.0 * NEEDLE / (1.0 - 2.0 * NEEDLE);

/// Side of a [`TributaryPage`] in cells.
const PAGE: i64 = 8;

/// Least slope of a valley's side at which a dry brook begins, as a share of the side's slope further up: the minimum
/// and the addition by chance. On a flood plain a dry brook would be a scratch that leads nowhere. Chosen by eye.
const FLAT: (f64, f64) = (0.25, 0.15);

/// Distance in vertices from the ends of a channel within which nothing joins it: other channels begin there, and
/// rounding could make lines cross.
const CLEAR: f64 = 2.0;

/// Largest random distance, in multiples of [`CLEAR`], that is added between tributaries whose fall lines lead to one
/// place.
const APART: f64 = 8.0;

/// Largest slope at which the land falls from a channel to the end of a tributary beside it, as a share of the
/// hillside's slope: a little less than the [least slope](Fields::least_cross) of a valley's side.
const UNDER: f64 = 0.65;

/// Tolerance in metres: a channel beside the end of a tributary may stand this much higher than [`UNDER`] allows.
const BESIDE_M: f64 = 0.5;

/// Places of a way, its end among them, at which the ground of volcanoes is looked for.
const VOLCANO_PLACES: u32 = 8;

/// Margin along each edge of a cell in which no head lies, as a share of the cell's side, and the share between the
/// margins. Chosen by eye.
const EDGE: f64 = 0.1;
const INNER: f64 = 0.8;

/// Returns the radius in grains around its head that a tributary of a level never leaves.
pub fn reach(fields: &Fields, level: u32) -> f64 {
    (1.0 + course_offsets::MOST_ASIDE) * fields.longest_tributary(level) + into_sea()
}

/// Returns the largest number of grains by which a tributary that runs on into the sea is longer than its course.
fn into_sea() -> f64 {
    (INTO_SEA + 1.0) * GRAINS as f64
}

/// Returns the radius in grains around a head of a level within which channels can decide where its tributary ends.
fn known(fields: &Fields, level: u32) -> f64 {
    fields.longest_tributary(level) + BESIDE_CELLS * fields.side(level) as f64
}

/// The end of a tributary's direct way, and that of its way aslant if it has one.
type Ends = (TributaryEnd, Option<TributaryEnd>);

/// A tributary's head with the ends of the ways that it may take, direct or aslant.
#[derive(Debug)]
struct Draft {
    cell: NodeId,
    head: Point,
    direct: TributaryEnd,
    aslant: Option<TributaryEnd>,
    /// A rectangle that the channel stays in, whichever way it takes.
    bounds: [Point; 2],
}

/// The straight course of a tributary.
#[derive(Clone, Copy, Debug)]
pub struct TributaryCourse {
    /// The head, where the tributary begins.
    pub head: Point,
    /// The end of the course.
    pub end: TributaryEnd,
}

/// The end of a tributary's course.
#[derive(Clone, Copy, Debug)]
pub struct TributaryEnd {
    /// The point at which the tributary meets its channel, or its last point in the sea.
    pub foot: Point,
    /// The end of the course itself. A tributary that runs into the sea goes straight on from here to its foot.
    pub shore: Point,
    /// Height of the water at the shore in metres.
    pub level_m: f64,
    /// The channel or the sea that the tributary runs into.
    pub mouth: Mouth,
    /// Height in metres of the lake in which the tributary ends, and the lake's id.
    pub lake: Option<(f64, LakeId)>,
    /// Least slope, in metres a grain, at which the tributary's floor must rise towards the channel that it joins:
    /// upstream of the confluence that channel's bed is higher, and a flatter floor would lie below it.
    pub joined_slope: f64,
}

/// The tributaries of a square of cells, which are cached together.
#[derive(Debug)]
struct TributaryPage {
    cells: Vec<PageCell>,
}

/// The tributary of a cell. Draft and course take long to compute, so they are only made when somebody first asks.
#[derive(Debug)]
struct PageCell {
    /// The head, whether or not there is land at it; `None` if chance leaves the cell without a tributary.
    head: Option<Point>,
    draft: OnceLock<Option<Draft>>,
    course: OnceLock<Option<TributaryCourse>>,
}

heap_bytes!(PageCell);
heap_bytes!(TributaryPage: cells);

/// Returns the id of the page that holds a cell.
fn page_of((level, x, y): ChannelId) -> ChannelId {
    (level, x.div_euclid(PAGE), y.div_euclid(PAGE))
}

impl TributaryPage {
    /// Returns the entry of one of the page's cells.
    fn cell(&self, (_, x, y): ChannelId) -> &PageCell {
        &self.cells[(y.rem_euclid(PAGE) * PAGE + x.rem_euclid(PAGE)) as usize]
    }
}

/// A draft as its neighbours see it: the lines along its ways, each from the foot up.
struct DraftLines {
    cell: NodeId,
    to_sea: bool,
    direct: LineSegment,
    aslant: Option<LineSegment>,
}

/// A way that a tributary may take.
enum Approach {
    Direct,
    Aslant,
}

impl DraftLines {
    fn new(draft: &Draft, origin: Point) -> DraftLines {
        let line = |end: TributaryEnd| end.line(draft.head, origin);
        DraftLines {
            cell: draft.cell,
            to_sea: draft.direct.mouth == Mouth::Sea,
            direct: line(draft.direct),
            aslant: draft.aslant.map(line),
        }
    }

    fn all(&self) -> impl Iterator<Item = &LineSegment> {
        [&self.direct].into_iter().chain(&self.aslant)
    }
}

impl Draft {
    /// Returns the head and the feet of the draft's ways.
    fn points(&self) -> impl Iterator<Item = Point> {
        [self.head, self.direct.foot].into_iter().chain(self.aslant.map(|end| end.foot))
    }

    /// Returns the length in grains of the longer way.
    fn longest(&self) -> f64 {
        self.points().map(|point| point.distance(self.head)).fold(0.0, f64::max)
    }

    /// Returns the bounding box of the ways, widened to all sides by a share of the draft's length.
    fn around(&self, share: f64) -> [Point; 2] {
        grain_point::around(self.points(), share * self.longest()).expect("a way has ends")
    }
}

impl TributaryCourse {
    /// Returns the line along the course, from the foot up.
    pub fn line(&self, origin: Point) -> LineSegment {
        self.end.line(self.head, origin)
    }
}

impl TributaryEnd {
    fn line(&self, head: Point, origin: Point) -> LineSegment {
        LineSegment { from: self.foot.from(origin).into(), along: head.from(self.foot).into() }
    }
}

/// The courses of a world's tributaries. The channels that they join come from the caller, through [`AsksAbove`].
#[derive(Debug)]
pub struct Courses {
    seed: u64,
    fields: Arc<Fields>,
    /// The pages, by level, column and row in a lattice of pages.
    pages: Memory<ChannelId, TributaryPage>,
}

impl Courses {
    /// Creates the courses of a world with these fields.
    pub fn new(fields: Arc<Fields>, seed: u64) -> Courses {
        Courses { seed, fields, pages: Memory::new(96 << 20) }
    }

    /// Returns the caches.
    pub(super) fn memories(&self) -> Vec<&dyn Remembers> {
        vec![&self.pages]
    }

    /// Returns the cells of a level whose tributaries may touch a rectangle, or with `are_straight` those whose
    /// straight courses may.
    pub fn touching(
        &self,
        level: u32,
        rectangle: [Point; 2],
        above: &impl AsksAbove,
        are_straight: bool,
    ) -> Vec<ChannelId> {
        let mut cells = Vec::new();
        self.drafts_touching(level, rectangle, above, are_straight, |id, _| cells.push(id));
        cells
    }

    /// Calls `take` with the id and the draft of each cell that [`Courses::touching`] returns.
    fn drafts_touching(
        &self,
        level: u32,
        rectangle: [Point; 2],
        above: &impl AsksAbove,
        are_straight: bool,
        mut take: impl FnMut(ChannelId, &Draft),
    ) {
        let longest = self.fields.longest_tributary(level);
        let most = if are_straight { longest + into_sea() } else { reach(&self.fields, level) };
        let heads = grain_point::padded(rectangle, most);
        let side = PAGE * self.fields.side(level);
        let [first, last] = heads.map(|at| [at.x.div_euclid(side), at.y.div_euclid(side)]);
        let rows = first[1]..=last[1];
        let pages = rows.flat_map(|y| (first[0]..=last[0]).map(move |x| self.page((level, x, y))));
        let pages: Vec<Arc<TributaryPage>> = pages.collect();
        for id in self.fields.cells(level, heads) {
            let (_, x, y) = page_of(id);
            let cell = pages[((y - first[1]) * (last[0] - first[0] + 1) + x - first[0]) as usize].cell(id);
            let Some(head) = cell.head else { continue };
            // Cheap tests come first: heads and the largest offsets of channels are known without drafts, and drafts
            // without the channels themselves.
            let comes = |aside: f64| overlap(head.square((1.0 + aside) * longest + into_sea()), rectangle);
            let may_touch =
                comes(0.0) || !are_straight && comes(course_offsets::MOST_ASIDE) && comes(self.most_aside(id));
            if may_touch
                && let Some(draft) = self.draft(id, cell, above)
                && overlap(draft.bounds, rectangle)
            {
                take(id, draft);
            }
        }
    }

    /// Returns the page of an id.
    fn page(&self, page: ChannelId) -> Arc<TributaryPage> {
        self.pages.get(page, || {
            let (level, i, j) = page;
            let ids = (0..PAGE * PAGE).map(|n| (level, i * PAGE + n % PAGE, j * PAGE + n / PAGE));
            let cell = |id| PageCell { head: self.head(id), draft: OnceLock::new(), course: OnceLock::new() };
            TributaryPage { cells: ids.map(cell).collect() }
        })
    }

    /// Returns the course of the tributary of a cell, or `None` if there is none.
    pub fn of(&self, id: ChannelId, above: &impl AsksAbove) -> Option<TributaryCourse> {
        let page = self.page(page_of(id));
        let cell = page.cell(id);
        let course = || {
            let draft = self.draft(id, cell, above)?;
            let origin = draft.head;
            let reach = (1.0 + BESIDE_WAYS) * draft.longest();
            let mut others = Vec::new();
            self.drafts_touching(id.0, draft.around(BESIDE_WAYS), above, true, |other, draft| {
                let lines = DraftLines::new(draft, origin);
                if other != id && lines.all().any(|line| line.touches([0.0; 2], reach)) {
                    others.push(lines);
                }
            });
            let end = match taken(&DraftLines::new(draft, origin), &others)? {
                Approach::Direct => draft.direct,
                Approach::Aslant => draft.aslant?,
            };
            Some(TributaryCourse { head: draft.head, end })
        };
        *cell.course.get_or_init(course)
    }

    /// Returns the draft of the tributary of a cell, if there is one.
    fn draft<'a>(&self, id: ChannelId, cell: &'a PageCell, above: &impl AsksAbove) -> Option<&'a Draft> {
        let draft = || {
            let head = cell.head.filter(|head| self.fields.potential(*head) >= self.fields.sea_potential())?;
            let known = above.above(id.0, head.square(known(&self.fields, id.0)), ChannelPart::Lines);
            let node = (id.1, id.2);
            let (direct, aslant) = self.ends(id.0, node, head, &known, above)?;
            let (direct, aslant) = self.off_volcanoes(head, (direct, aslant))?;
            let draft = Draft { cell: node, head, direct, aslant, bounds: [head; 2] };
            Some(Draft { bounds: draft.around(self.most_aside(id)), ..draft })
        };
        cell.draft.get_or_init(draft).as_ref()
    }

    /// Returns the ends of ways that do not lead from a head outside a volcano into its porous ground, where no water
    /// runs on.
    fn off_volcanoes(&self, head: Point, (direct, aslant): Ends) -> Option<Ends> {
        let near = self.fields.volcanoes_near(head);
        let is_porous = |at: Point| near.iter().any(|volcano| volcano.is_porous(&self.fields, at));
        if near.is_empty() || is_porous(head) {
            return Some((direct, aslant));
        }
        let places = (1..=VOLCANO_PLACES).map(|place| f64::from(place) / f64::from(VOLCANO_PLACES));
        let is_dry = |end: &TributaryEnd| places.clone().any(|share| is_porous(head.towards(end.foot, share)));
        (!is_dry(&direct)).then(|| (direct, aslant.filter(|end| !is_dry(end))))
    }

    /// Returns the largest distance of a cell's channel from its straight course, as a share of the course's length.
    fn most_aside(&self, (level, x, y): ChannelId) -> f64 {
        course_offsets::most_aside(hash::network_level(self.seed, level), (x, y), self.fields.segments_a_channel(level))
    }

    /// Returns the point at which the tributary of a cell begins if there is land, or `None` if chance leaves the cell
    /// out.
    pub fn head(&self, (level, x, y): ChannelId) -> Option<Point> {
        let (side, seed) = (self.fields.side(level), hash::network_level(self.seed, level));
        // The head keeps off the edges of its cell, so that heads of neighbouring cells stay apart.
        let corner = Point { x: x * side, y: y * side };
        let offset = |axis| (EDGE + INNER * chance(seed, (x, y), Draw::Head, axis)) * side as f64;
        let head = corner.moved(DVec2::new(offset(0), offset(1)));
        (!self.fields.leaves_out(level, head, chance(seed, (x, y), Draw::Choice, 0))).then_some(head)
    }

    /// Returns the possible ends of the tributary of a cell, given the segments of the levels above around its head.
    fn ends(&self, level: u32, id: NodeId, head: Point, above: &Above, asker: &impl AsksAbove) -> Option<Ends> {
        let fields = &self.fields;
        let origin = above.origin;
        let from = head.from(origin);
        // The tributary ends at the coast if that is nearer than every channel.
        let nearest = if fields.has_sea() { above.nearest(from, known(fields, level)) } else { None };
        let nearest = nearest.map_or(f64::INFINITY, |(square, _)| square.sqrt());
        let most = fields.longest_tributary(level);
        if let Some(direct) = self.sea_end(level, head, nearest.min(most), above) {
            // A head on the shore itself leaves no room for a course.
            let has_way = head.distance(direct.shore) >= CLEAR * GRAINS as f64;
            return has_way.then_some((direct, None));
        }
        let at_channel = self.ends_at_channel(level, id, head, above, asker);
        // If no channel can be reached, the tributary runs to the coast, even if that is further than a channel.
        // Otherwise the shore between two mouths would be the bare side of a distant valley.
        let is_clear = |end: &TributaryEnd| is_clear(&end.line(head, origin), above);
        at_channel.or_else(|| Some((self.sea_end(level, head, most, above).filter(is_clear)?, None)))
    }

    /// Returns the end in the sea of a level's tributary, if the coast is at most `most` grains from its head.
    fn sea_end(&self, level: u32, head: Point, most: f64, above: &Above) -> Option<TributaryEnd> {
        let [shore, beyond] = self.fields.coast_near(head, most)?;
        // The tributary runs on into the sea, unless a channel is in the way.
        let line = LineSegment { from: beyond.from(above.origin).into(), along: head.from(beyond).into() };
        let crosses = |segment: &Segment| segment.line().crosses(&line);
        let foot = if beside(above, &line, 0.0).any(crosses) { shore } else { beyond };
        Some(TributaryEnd {
            foot,
            shore,
            level_m: self.fields.filled_m(level),
            mouth: Mouth::Sea,
            lake: None,
            joined_slope: 0.0,
        })
    }

    /// Returns the possible ends of the tributary of a cell if it runs to a channel.
    fn ends_at_channel(
        &self,
        level: u32,
        id: NodeId,
        head: Point,
        above: &Above,
        asker: &impl AsksAbove,
    ) -> Option<Ends> {
        let fields = &self.fields;
        let laws = fields.laws(head);
        let hill_slope = laws.hill_slope * fields.metres_a_grain();
        let from = head.from(above.origin);
        let within = known(fields, level);
        let (head_m, owner) = above.lowest_side(from, hill_slope, within)?;
        let segment = owner.segment;
        // Nothing begins in a lake.
        if head_m < segment.pool_m {
            return None;
        }
        let (t, square) = segment.nearest(from);
        let flat = FLAT.0 + FLAT.1 * chance(hash::network_level(self.seed, level), id, Draw::Flat, 0);
        if !laws.is_wet(fields, level) && steepness(segment, t, square) < flat {
            return None;
        }
        // The tributary runs down the fall line to the channel whose valley holds the head, which need not be the
        // nearest channel. If no end fits there, the nearest channel is tried: it may be in the way where it joins the
        // other on the floor of a lake.
        let to = |beside: Near| {
            let channel = asker.channel(beside.channel)?;
            Joining {
                fields,
                laws: &laws,
                level,
                head,
                head_m,
                hill_slope,
                channel: &channel,
                segment: beside.segment,
                above,
            }
            .ends(|| chance(hash::network_level(self.seed, level), id, Draw::Foot, 0))
        };
        to(owner).or_else(|| {
            let (_, nearest) = above.nearest(from, within)?;
            to(Some(nearest).filter(|nearest| nearest.channel != owner.channel)?)
        })
    }
}

/// A tributary in search of its end at a channel.
struct Joining<'a> {
    fields: &'a Fields,
    /// The laws at the head.
    laws: &'a Laws,
    level: u32,
    head: Point,
    head_m: f64,
    /// Metres a grain that hillsides rise at the head.
    hill_slope: f64,
    /// The channel, and its segment in whose valley the head lies.
    channel: &'a Channel,
    segment: &'a Segment,
    above: &'a Above,
}

impl Joining<'_> {
    /// Returns the possible ends of the tributary. `luck` draws a share.
    fn ends(&self, luck: impl FnOnce() -> f64) -> Option<Ends> {
        let (t, square) = self.segment.nearest(self.head.from(self.above.origin));
        let distance = square.sqrt();
        let shift = distance * self.segment.bed_slope().max(0.0) / (self.hill_slope * self.segment.gentlest_cross());
        // At the end of a segment, as where a bed becomes flat at a lake, the fall lines of many heads meet. Random
        // shifts make these tributaries join one below the other.
        let apart = if t == 0.0 || t == 1.0 { 1.0 + APART * luck() } else { 0.0 };
        let shift = shift + apart * CLEAR * GRAINS as f64;
        let is_clear = |end: &TributaryEnd| is_clear(&end.line(self.head, self.above.origin), self.above);
        let at =
            |shift: f64, left: f64| self.end(self.channel.downstream((self.segment.knot as usize, t), shift)?, left);
        let finer = self.finer();
        let slant = (SLANT.0 + SLANT.1 * finer).min(SLANT.2) * distance;
        // The end of the fall line is best. If it does not fit, an end further downstream is better than no valley.
        let first = [shift, apart * CLEAR * GRAINS as f64].into_iter();
        let further = FURTHER.into_iter().filter(|_| finer >= FURTHER_ABOVE).map(|share| shift + share * distance);
        let direct = first.chain(further).find_map(|shift| at(shift, 0.0).filter(is_clear))?;
        let shares = SLANT_SHARES.into_iter().filter(|_| slant > shift);
        let mut slants = shares.filter_map(|share| at(shift + (slant - shift) * share, ENDS_BEFORE * distance));
        let aslant = slants.find(is_clear);
        Some((direct, aslant))
    }

    /// Returns the number of finer levels, for whose channels there must be room in between.
    fn finer(&self) -> f64 {
        (self.fields.levels() - 1 - self.level) as f64
    }

    /// Returns the end at a place of the channel, or a little further down, if the tributary can end there and `left`
    /// grains of the channel are left below it.
    fn end(&self, mut place: ChannelPlace, left: f64) -> Option<TributaryEnd> {
        let (channel, clear) = (self.channel, CLEAR * GRAINS as f64);
        if place.0 == 0 && place.1 * channel.knots[0].at.distance(channel.knots[1].at) < clear {
            place = channel.downstream(place, clear)?;
        }
        if self.laws.is_wet(self.fields, self.level) {
            place = channel.landing(place)?;
        }
        channel.downstream(place, clear.max(left))?;
        let Knot { at: foot, level_m, pool_m, .. } = channel.at(place);
        // Upstream of the confluence the joined channel is higher, and may lie beside the tributary's own floor.
        let trough = self.laws.trough(self.fields, self.level, most_area(self.level), level_m);
        let line = LineSegment { from: [0.0; 2], along: self.head.from(foot).into() };
        let upstream = channel.knots[..=place.0].iter();
        let above = upstream.map(|knot| (line.distance(knot.at.from(foot).into()), knot.level_m - level_m));
        let beside = above.filter(|(way, _)| *way < trough).map(|(way, rise_m)| rise_m / way.max(1.0));
        let joined_slope = beside.fold(0.0, f64::max);
        let lake = channel.lake.filter(|_| level_m < pool_m).map(|id| (pool_m, id));
        let mouth = Mouth::Channel(channel.id);
        Some(TributaryEnd { foot, shore: foot, level_m, mouth, lake, joined_slope }).filter(|end| self.fits(end))
    }

    /// Tells whether the tributary can end there.
    fn fits(&self, end: &TributaryEnd) -> bool {
        let least = (LEAST_CELLS.0 + LEAST_CELLS.1 * self.finer()) * self.fields.side(self.level) as f64;
        let way = self.head.distance(end.foot);
        end.joined_slope <= MOST_LEAN * self.hill_slope
            && self.falls(end)
            && least <= way
            && way <= self.fields.longest_tributary(self.level)
            && end.level_m < self.head_m
            && self.is_free(end)
    }

    /// Tells whether the coast leaves room, all along the way, for a bed that is higher than the end.
    fn falls(&self, end: &TributaryEnd) -> bool {
        let places = self.fields.segments_a_channel(self.level);
        let way = self.head.from(end.foot) / places as f64;
        let mut places = (1..=places).map(|place| end.foot.moved(way * place as f64));
        let filled_m = self.fields.filled_m(self.level);
        !self.fields.has_sea() || places.all(|at| self.fields.below_coast_m(at, filled_m) > end.level_m)
    }

    /// Tells whether the tributary does not end below a steep channel beside it, whose water it would capture.
    fn is_free(&self, end: &TributaryEnd) -> bool {
        let (from, within) = (self.head.from(self.above.origin), known(self.fields, self.level));
        let (foot, steep) = (end.foot.from(self.above.origin), self.hill_slope * UNDER);
        // The least distance in grains to a channel of this height.
        let away = |level_m: f64| (level_m - end.level_m - BESIDE_M) / steep;
        let may_be_steep = |bounds: &SegmentBounds| {
            let away = away(bounds.level_m[1]);
            away > 0.0 && bounds.touches(foot, away) && bounds.touches(from, within)
        };
        self.above.of_groups(&may_be_steep).all(|Near { segment, channel: beside }| {
            let most = away(segment.level_m[0]);
            let is_near = beside != self.channel.id
                && most > 0.0
                && segment.line().touches(foot.into(), most)
                && segment.line().touches(from.into(), within);
            !is_near || {
                let (t, square) = segment.nearest(foot);
                away(lerp(segment.level_m, t)) <= square.sqrt()
            }
        })
    }
}

/// Chooses the way that a tributary takes, given the drafts around it; `None` if the tributary has to give way.
fn taken(draft: &DraftLines, others: &[DraftLines]) -> Option<Approach> {
    let DraftLines { direct, .. } = draft;
    // Lines down the fall line hardly ever cross, but they may, as slopes differ from head to head. Lines to the coast
    // may cross any others; they give way to all lines but those to the coast.
    let gives_way = |other: &DraftLines| {
        let stays = if draft.to_sea == other.to_sea { other.cell < draft.cell } else { draft.to_sea };
        let is_shorter = (length(direct.along), draft.cell) < (length(other.direct.along), other.cell);
        stays && other.direct.crosses(direct) || is_shorter && is_needle(direct, &other.direct)
    };
    if others.iter().any(gives_way) {
        return None;
    }
    let Some(aslant) = &draft.aslant else { return Some(Approach::Direct) };
    // All ways of the others count, whichever they take. So the order in which drafts choose does not matter.
    let meets = |other: &LineSegment| other.crosses(aslant) || is_needle(aslant, other) || is_needle(other, aslant);
    Some(if others.iter().any(|other| other.all().any(meets)) { Approach::Direct } else { Approach::Aslant })
}

/// Tells whether a line runs so close to another, longer one that the land between them would be a needle.
fn is_needle(line: &LineSegment, longer: &LineSegment) -> bool {
    let head = DVec2::from(line.from) + DVec2::from(line.along);
    let apart = f64::midpoint(longer.distance(line.from), longer.distance(head.into()));
    apart < NEEDLE * length(line.along)
}

/// Returns the segments that may come within a share of a line's length of the line.
fn beside<'a>(above: &'a Above, line: &LineSegment, share: f64) -> impl Iterator<Item = &'a Segment> {
    let (apart, from) = (share * length(line.along), DVec2::from(line.from));
    let to = from + DVec2::from(line.along);
    above.overlapping([from.min(to) - apart, from.max(to) + apart])
}

/// Tells whether a line from a foot up neither crosses nor [grazes] the channels that it may come near to.
fn is_clear(line: &LineSegment, above: &Above) -> bool {
    !beside(above, line, GRAZES).any(|segment| segment.line().crosses(line) || grazes(line, segment))
}

/// Tells whether a line comes too near to a segment: nearer than `GRAZES` times the distance to the foot, measured
/// along the line.
fn grazes(line: &LineSegment, segment: &Segment) -> bool {
    let [from, along] = [line.from, line.along].map(DVec2::from);
    let square = along.length_squared();
    // The steps of the line beside which the segment lies. At all other steps the segment is not near.
    let beside = [0.0, 1.0].map(|end| {
        let off = segment.from + segment.along * end - from;
        off.dot(along) / square.max(1.0) * f64::from(GRAZES_AT)
    });
    let [first, last] = [beside[0].min(beside[1]) / (1.0 + GRAZES), beside[0].max(beside[1]) / (1.0 - GRAZES)];
    // Near the foot the steps are closer together, as a bend of the joined channel may come back to the line there.
    let steps = [0.25, 0.5].into_iter().chain((first.max(1.0) as u32..=GRAZES_AT).map(f64::from));
    steps.take_while(|step| *step <= last).any(|step| {
        let share = step / f64::from(GRAZES_AT);
        segment.nearest(from + along * share).1 < (GRAZES * share).powi(2) * square
    })
}

/// Returns the slope of a segment's side, at a share of the segment and the square of a distance from it, as a share of
/// the side's slope further up.
fn steepness(segment: &Segment, t: f64, square: f64) -> f64 {
    let at = |grains: f64| rise(grains, lerp(segment.river, t), lerp(segment.trough, t), lerp(segment.lean, t));
    let distance = square.sqrt();
    (at(distance + GRAINS as f64) - at(distance)) / GRAINS as f64
}
