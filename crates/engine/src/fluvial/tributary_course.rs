//! The straight courses of tributaries: which cells of a level have one, and where it begins and ends.
//!
//! Straight lines to the nearest channel do not cross, nor do they cross channels; aslant they may. So each cell makes
//! a draft with both ends, of which neighbours know nothing, and then takes one by what the drafts around it might do.

use std::sync::{Arc, OnceLock};

use super::above::{Above, Asked, AsksAbove, Near};
use super::channel::{Channel, ChannelPlace, Knot, Mouth};
use super::fields::{Fields, INTO_SEA, most_area};
use super::point::{self, GRAINS, Point, chance, overlap};
use super::segment::{Bounds, MOST_LEAN, Segment, downstream, rise};
use super::trunk::NodeId;
use super::wander;
use crate::geometry::{LineSegment, dot, length, lerp};
use crate::hash::{self, Draw};
use crate::lines::{ChannelId, LakeId};
use crate::memory::{Memory, Remembers, heap_bytes};

/// Cells further than it may join one in which a head knows of channels, for what is beside its mouth.
const BESIDE_CELLS: f64 = 0.5;

/// Cells that lie between a head and the nearest channel at least: at the finest level, and more at each level above
/// it. What begins nearer would be a short stub. Chosen by eye.
const LEAST_CELLS: (f64, f64) = (0.45, 0.12);

/// How far downstream of the nearest point a tributary ends, as a share of the distance: at the finest level, and more
/// at each level above it, up to a most.
///
/// Longer and more slanting tributaries at the coarser levels make large basins longer than wide: Hack's law.
const SLANT: (f64, f64, f64) = (0.7, 0.8, 3.5);

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

/// How far a tributary is from a longer one of its level, in the mean of its ends, as a share of its length: one that runs
/// closer to it gives way, and what drained to it comes to the other. Chosen by eye.
const NEEDLE: f64 = 0.15;

/// How far from a draft's ways those may be that cross them or are [needles](NEEDLE) beside them, as a share of its length:
/// one whose ends are that near in the mean is no longer than this allows.
const BESIDE_WAYS: f64 = 2.0 * NEEDLE / (1.0 - 2.0 * NEEDLE);

/// Cells a side of a [`Page`].
const PAGE: i64 = 8;

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

/// How steep the land falls from a channel to the end of a tributary beside it at most, as a share of the hillside's slope:
/// a little less than the [least](Fields::least_cross) that a valley's side rises.
const UNDER: f64 = 0.65;

/// Metres by which a channel beside the end of a tributary may be too high for that.
const BESIDE_M: f64 = 0.5;

/// Share of a cell's side that its head keeps off each edge, and what is left between. Chosen by eye.
const EDGE: f64 = 0.1;
const INNER: f64 = 0.8;

/// Grains from its head that a tributary of a level does not leave.
pub fn reach(fields: &Fields, level: u32) -> f64 {
    (1.0 + wander::MOST_ASIDE) * fields.longest_tributary(level) + into_sea()
}

/// Grains that a tributary is longer than its course where it runs on into the sea, at most.
fn into_sea() -> f64 {
    (INTO_SEA + 1.0) * GRAINS as f64
}

/// Grains around a head of a level in which channels matter to where it ends.
fn known(fields: &Fields, level: u32) -> f64 {
    fields.longest_tributary(level) + BESIDE_CELLS * fields.side(level) as f64
}

/// Where a tributary ends if it runs straight to the nearest channel, and if it runs aslant.
type Ends = (TributaryEnd, Option<TributaryEnd>);

/// Where a tributary begins, and where it ends if it runs straight to the nearest channel or if it runs aslant.
#[derive(Debug)]
struct Draft {
    cell: NodeId,
    head: Point,
    direct: TributaryEnd,
    aslant: Option<TributaryEnd>,
    /// A rectangle that no channel along either leaves.
    bounds: [Point; 2],
}

/// Where a tributary begins and where it ends.
#[derive(Clone, Copy, Debug)]
pub struct TributaryCourse {
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
    /// How steep its floor must rise there towards the channel that it comes to, upstream of where it does: metres a grain.
    pub joined_slope: f64,
}

/// What is known of the tributaries of a square of cells, which are looked up together.
#[derive(Debug)]
struct Page {
    cells: Vec<PageCell>,
}

/// What is known of the tributary of a cell: what it takes long to find out only once somebody has asked.
#[derive(Debug)]
struct PageCell {
    /// Where it would begin, if there is land, unless chance wants none.
    head: Option<Point>,
    draft: OnceLock<Option<Draft>>,
    course: OnceLock<Option<TributaryCourse>>,
}

heap_bytes!(PageCell);
heap_bytes!(Page: cells);

/// The id of the page that has a cell.
fn page_of((level, x, y): ChannelId) -> ChannelId {
    (level, x.div_euclid(PAGE), y.div_euclid(PAGE))
}

impl Page {
    /// What is known of one of its cells.
    fn cell(&self, (_, x, y): ChannelId) -> &PageCell {
        &self.cells[(y.rem_euclid(PAGE) * PAGE + x.rem_euclid(PAGE)) as usize]
    }
}

/// What those around a draft know of it: the lines along its ways, from their feet up.
struct DraftLines {
    cell: NodeId,
    to_sea: bool,
    direct: LineSegment,
    aslant: Option<LineSegment>,
}

/// A way that a tributary may take.
enum Way {
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
    /// The ends of its ways.
    fn points(&self) -> impl Iterator<Item = Point> {
        [self.head, self.direct.foot].into_iter().chain(self.aslant.map(|end| end.foot))
    }

    /// The length in grains of the longer one of its ways.
    fn longest(&self) -> f64 {
        self.points().map(|point| point.distance(self.head)).fold(0.0, f64::max)
    }

    /// The least rectangle around its ways, and to all sides a share of its length more.
    fn around(&self, share: f64) -> [Point; 2] {
        point::around(self.points(), share * self.longest()).expect("a way has ends")
    }
}

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

/// The courses of a world's tributaries. What they join is asked of whoever asks for them.
#[derive(Debug)]
pub struct Courses {
    seed: u64,
    fields: Arc<Fields>,
    /// By the ids that their cells have in a lattice of pages.
    pages: Memory<ChannelId, Page>,
}

impl Courses {
    /// The courses of a world with these fields.
    pub fn new(fields: Arc<Fields>, seed: u64) -> Courses {
        Courses { seed, fields, pages: Memory::new(96 << 20) }
    }

    /// Its memories.
    pub(super) fn memories(&self) -> Vec<&dyn Remembers> {
        vec![&self.pages]
    }

    /// The cells of a level whose tributaries may touch a rectangle, or whose courses may, which are straight.
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

    /// Calls `take` with the drafts of those cells.
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
        let heads = [rectangle[0].moved([-most; 2]), rectangle[1].moved([most; 2])];
        let side = PAGE * self.fields.side(level);
        let [first, last] = heads.map(|at| [at.x.div_euclid(side), at.y.div_euclid(side)]);
        let rows = first[1]..=last[1];
        let pages = rows.flat_map(|y| (first[0]..=last[0]).map(move |x| self.page((level, x, y))));
        let pages: Vec<Arc<Page>> = pages.collect();
        for id in self.fields.cells(level, heads) {
            let (_, x, y) = page_of(id);
            let cell = pages[((y - first[1]) * (last[0] - first[0] + 1) + x - first[0]) as usize].cell(id);
            let Some(head) = cell.head else { continue };
            // Where heads are, and how far channels come off their ways, is known before where courses begin and end, and
            // that long before how channels run.
            let comes = |aside: f64| {
                let reach = (1.0 + aside) * longest + into_sea();
                overlap([-reach, reach].map(|by| head.moved([by; 2])), rectangle)
            };
            let may_touch = comes(0.0) || !are_straight && comes(wander::MOST_ASIDE) && comes(self.most_aside(id));
            if may_touch
                && let Some(draft) = self.draft(id, cell, above)
                && overlap(draft.bounds, rectangle)
            {
                take(id, draft);
            }
        }
    }

    /// The page of an id.
    fn page(&self, page: ChannelId) -> Arc<Page> {
        self.pages.get(page, || {
            let (level, i, j) = page;
            let ids = (0..PAGE * PAGE).map(|n| (level, i * PAGE + n % PAGE, j * PAGE + n / PAGE));
            let cell = |id| PageCell { head: self.head(id), draft: OnceLock::new(), course: OnceLock::new() };
            Page { cells: ids.map(cell).collect() }
        })
    }

    /// Where the tributary of a cell begins and ends; `None` if there is none.
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
                Way::Direct => draft.direct,
                Way::Aslant => draft.aslant?,
            };
            Some(TributaryCourse { head: draft.head, end })
        };
        *cell.course.get_or_init(course)
    }

    /// Where the tributary of a cell begins and may end.
    fn draft<'a>(&self, id: ChannelId, cell: &'a PageCell, above: &impl AsksAbove) -> Option<&'a Draft> {
        let draft = || {
            let head = cell.head.filter(|head| self.fields.potential(*head) >= self.fields.sea_potential())?;
            let known = known(&self.fields, id.0);
            let known = above.above(id.0, [-known, known].map(|by| head.moved([by; 2])), Asked::Lines);
            let node = (id.1, id.2);
            let (direct, aslant) = self.ends(id.0, node, head, &known, above)?;
            let draft = Draft { cell: node, head, direct, aslant, bounds: [head; 2] };
            Some(Draft { bounds: draft.around(self.most_aside(id)), ..draft })
        };
        cell.draft.get_or_init(draft).as_ref()
    }

    /// How far a channel of a cell may come off its way, as a share of that.
    fn most_aside(&self, (level, x, y): ChannelId) -> f64 {
        wander::most_aside(hash::network_level(self.seed, level), (x, y), self.fields.segments_a_channel(level))
    }

    /// Where the tributary of a cell would begin, if there is land, unless chance wants none.
    fn head(&self, (level, x, y): ChannelId) -> Option<Point> {
        let (side, seed) = (self.fields.side(level), hash::network_level(self.seed, level));
        if chance(seed, (x, y), Draw::Choice, 0) < LEFT_OUT {
            return None;
        }
        // Not at the edge of its cell, so that heads of neighbours keep apart.
        let corner = Point { x: x * side, y: y * side };
        Some(corner.moved([0, 1].map(|axis| (EDGE + INNER * chance(seed, (x, y), Draw::Head, axis)) * side as f64)))
    }

    /// Where the tributary of a cell may end, given the segments of the levels above around its head.
    fn ends(&self, level: u32, id: NodeId, head: Point, above: &Above, asker: &impl AsksAbove) -> Option<Ends> {
        let fields = &self.fields;
        let origin = above.origin;
        let from = head.from(origin);
        // At the nearest channel, or at the coast if that is nearer.
        let nearest = if fields.has_sea() { above.nearest(from, known(fields, level)) } else { None };
        let nearest = nearest.map_or(f64::INFINITY, |(square, _)| square.sqrt());
        let most = fields.longest_tributary(level);
        if let Some(direct) = self.sea_end(level, head, nearest.min(most), above) {
            // A head on the shore itself has no way to go.
            let has_way = head.distance(direct.shore) >= CLEAR * GRAINS as f64;
            return has_way.then_some((direct, None));
        }
        let at_channel = self.ends_at_channel(level, id, head, above, asker);
        // Where no channel can be come to the coast may, also if it is further: else a shore between mouths would be
        // the bare side of far valleys.
        let is_clear = |end: &TributaryEnd| is_clear(&end.line(head, origin), above);
        at_channel.or_else(|| Some((self.sea_end(level, head, most, above).filter(is_clear)?, None)))
    }

    /// Where a tributary of a level ends in the sea, if the coast is no further from its head than `most` grains.
    fn sea_end(&self, level: u32, head: Point, most: f64, above: &Above) -> Option<TributaryEnd> {
        let [shore, beyond] = self.fields.coast_near(head, most)?;
        // On into the sea where no channel is in the way.
        let line = LineSegment { from: beyond.from(above.origin), along: head.from(beyond) };
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

    /// Where the tributary of a cell may end if it runs to a channel.
    fn ends_at_channel(
        &self,
        level: u32,
        id: NodeId,
        head: Point,
        above: &Above,
        asker: &impl AsksAbove,
    ) -> Option<Ends> {
        let fields = &self.fields;
        let hill_slope = fields.hill_slope(fields.uplift(head)) * fields.metres_a_grain();
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
        if !fields.is_wet(most_area(level)) && steepness(segment, t, square) < flat {
            return None;
        }
        // Not to the nearest channel but to the one whose valley it lies in, and down the fall line of its side. Where a
        // nearer one is in the way, which comes to it on the floor of a lake, to that.
        let to = |beside: Near| {
            let channel = asker.channel(beside.channel)?;
            self.ends_at(level, id, (head, head_m), (&channel, beside.segment), above)
        };
        to(owner).or_else(|| {
            let (_, nearest) = above.nearest(from, within)?;
            to(Some(nearest).filter(|nearest| nearest.channel != owner.channel)?)
        })
    }

    /// Where the tributary of a cell, whose head is so high, may end if it runs to the channel of a segment.
    fn ends_at(
        &self,
        level: u32,
        id: NodeId,
        (head, head_m): (Point, f64),
        (channel, segment): (&Channel, &Segment),
        above: &Above,
    ) -> Option<Ends> {
        let (fields, cell) = (&self.fields, self.fields.side(level));
        let hill_slope = fields.hill_slope(fields.uplift(head)) * fields.metres_a_grain();
        let origin = above.origin;
        // By how many levels there is room for finer ones in between.
        let finer = (fields.levels() - 1 - level) as f64;
        let least = (LEAST_CELLS.0 + LEAST_CELLS.1 * finer) * cell as f64;
        let most = fields.longest_tributary(level);
        let (t, square) = segment.nearest(head.from(origin));
        let distance = square.sqrt();
        let shift = distance * segment.bed_slope().max(0.0) / (hill_slope * segment.gentlest_cross());
        // Where a bed becomes flat, as at a lake, the fall lines of many heads meet: they join one below the other.
        let luck = || chance(hash::network_level(self.seed, level), id, Draw::Foot, 0);
        let apart = if t == 0.0 || t == 1.0 { 1.0 + APART * luck() } else { 0.0 };
        let shift = shift + apart * CLEAR * GRAINS as f64;
        let is_clear = |end: &TributaryEnd| is_clear(&end.line(head, origin), above);
        let end = |place: ChannelPlace| {
            let Knot { at: foot, level_m, pool_m, .. } = channel.at(place);
            // What it joins is higher upstream, and may lie beside its own floor there.
            let trough = fields.trough(level, most_area(level), level_m);
            let line = LineSegment { from: [0.0; 2], along: head.from(foot) };
            let upstream = channel.knots[..=place.0].iter();
            let above = upstream.map(|knot| (line.distance(knot.at.from(foot)), knot.level_m - level_m));
            let beside = above.filter(|(way, _)| *way < trough).map(|(way, rise_m)| rise_m / way.max(1.0));
            let joined_slope = beside.fold(0.0, f64::max);
            let lake = channel.lake.filter(|_| level_m < pool_m).map(|id| (pool_m, id));
            TributaryEnd { foot, shore: foot, level_m, mouth: Mouth::Channel(channel.id), lake, joined_slope }
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
        let (from, within) = (head.from(origin), known(fields, level));
        let is_free = |end: &TributaryEnd| {
            let (foot, steep) = (end.foot.from(origin), hill_slope * UNDER);
            // How far off a channel that is so high must be.
            let away = |level_m: f64| (level_m - end.level_m - BESIDE_M) / steep;
            let may_be_steep = |bounds: &Bounds| {
                let away = away(bounds.level_m[1]);
                away > 0.0 && bounds.touches(foot, away) && bounds.touches(from, within)
            };
            above.of_groups(&may_be_steep).all(|Near { segment, channel: beside }| {
                let most = away(segment.level_m[0]);
                let is_near = beside != channel.id
                    && most > 0.0
                    && segment.line().touches(foot, most)
                    && segment.line().touches(from, within);
                !is_near || {
                    let (t, square) = segment.nearest(foot);
                    away(lerp(segment.level_m, t)) <= square.sqrt()
                }
            })
        };
        let fits = |end: &TributaryEnd| {
            let way = length(head.from(end.foot));
            end.joined_slope <= MOST_LEAN * hill_slope
                && falls(end)
                && least <= way
                && way <= most
                && end.level_m < head_m
                && is_free(end)
        };
        let at = |shift: f64, left: f64| {
            let clear = CLEAR * GRAINS as f64;
            let mut place = downstream(channel, (segment.knot as usize, t), shift)?;
            if place.0 == 0 && place.1 * channel.knots[0].at.distance(channel.knots[1].at) < clear {
                place = downstream(channel, place, clear)?;
            }
            if fields.is_wet(most_area(level)) {
                place = channel.landing(place)?;
            }
            downstream(channel, place, clear.max(left))?;
            Some(end(place)).filter(fits)
        };
        let slant = (SLANT.0 + SLANT.1 * finer).min(SLANT.2) * distance;
        // Where the fall line leads is the best end; where that is taken, one further down is better than no valley.
        let first = [shift, apart * CLEAR * GRAINS as f64].into_iter();
        let further = FURTHER.into_iter().filter(|_| finer >= FURTHER_ABOVE).map(|share| shift + share * distance);
        let direct = first.chain(further).find_map(|shift| at(shift, 0.0).filter(is_clear))?;
        let shares = SLANT_SHARES.into_iter().filter(|_| slant > shift);
        let mut slants = shares.filter_map(|share| at(shift + (slant - shift) * share, ENDS_BEFORE * distance));
        let aslant = slants.find(is_clear);
        Some((direct, aslant))
    }
}

/// The way that a tributary takes, given the drafts around it; `None` if it has to give way.
fn taken(draft: &DraftLines, others: &[DraftLines]) -> Option<Way> {
    let DraftLines { direct, .. } = draft;
    // Lines to the valleys that heads lie in hardly ever cross, but slopes differ from head to head. Those to the coast
    // may cross any, and give way to all but each other.
    let gives_way = |other: &DraftLines| {
        let stays = if draft.to_sea == other.to_sea { other.cell < draft.cell } else { draft.to_sea };
        let is_shorter = (length(direct.along), draft.cell) < (length(other.direct.along), other.cell);
        stays && other.direct.crosses(direct) || is_shorter && is_needle(direct, &other.direct)
    };
    if others.iter().any(gives_way) {
        return None;
    }
    let Some(aslant) = &draft.aslant else { return Some(Way::Direct) };
    // Whichever end the others take: so it does not matter who takes first.
    let meets = |other: &LineSegment| other.crosses(aslant) || is_needle(aslant, other) || is_needle(other, aslant);
    Some(if others.iter().any(|other| other.all().any(meets)) { Way::Direct } else { Way::Aslant })
}

/// Whether a line runs so close to another, longer one that the land between them would be a needle.
fn is_needle(line: &LineSegment, longer: &LineSegment) -> bool {
    let head = [0, 1].map(|axis| line.from[axis] + line.along[axis]);
    let apart = f64::midpoint(longer.distance(line.from), longer.distance(head));
    apart < NEEDLE * length(line.along)
}

/// The segments that may come so near to a line, as a share of its length.
fn beside<'a>(above: &'a Above, line: &LineSegment, share: f64) -> impl Iterator<Item = &'a Segment> {
    let apart = share * length(line.along);
    let to = [0, 1].map(|axis| line.from[axis] + line.along[axis]);
    let low = [0, 1].map(|axis| line.from[axis].min(to[axis]) - apart);
    let high = [0, 1].map(|axis| line.from[axis].max(to[axis]) + apart);
    above.overlapping([low, high])
}

/// Whether a line from a foot up neither crosses nor [grazes] the channels that it may come near to.
fn is_clear(line: &LineSegment, above: &Above) -> bool {
    !beside(above, line, GRAZES).any(|segment| segment.line().crosses(line) || grazes(line, segment))
}

/// Whether a line comes near to a segment: from its foot up it may as near as it is far from its foot, by a share.
fn grazes(line: &LineSegment, segment: &Segment) -> bool {
    let square = dot(line.along, line.along);
    // The shares of the line beside which the segment lies: what is beside none of its places is not near to it.
    let beside = [0.0, 1.0].map(|end| {
        let off = [0, 1].map(|axis| segment.from[axis] + segment.along[axis] * end - line.from[axis]);
        dot(off, line.along) / square.max(1.0) * f64::from(GRAZES_AT)
    });
    let [first, last] = [beside[0].min(beside[1]) / (1.0 + GRAZES), beside[0].max(beside[1]) / (1.0 - GRAZES)];
    // Closer together near its foot, where a bend may come back to it.
    let steps = [0.25, 0.5].into_iter().chain((first.max(1.0) as u32..=GRAZES_AT).map(f64::from));
    steps.take_while(|step| *step <= last).any(|step| {
        let share = step / f64::from(GRAZES_AT);
        let place = [0, 1].map(|axis| line.from[axis] + line.along[axis] * share);
        segment.nearest(place).1 < (GRAZES * share).powi(2) * square
    })
}

/// How steep a segment's side is at a share of it and the square of a distance from it, as a share of what it is further
/// up.
fn steepness(segment: &Segment, t: f64, square: f64) -> f64 {
    let at = |grains: f64| rise(grains, lerp(segment.river, t), lerp(segment.trough, t), lerp(segment.lean, t));
    let distance = square.sqrt();
    (at(distance + GRAINS as f64) - at(distance)) / GRAINS as f64
}
