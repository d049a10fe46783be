//! Tributaries: which cells of a level have one, where it joins the levels above, how it runs there and how its bed rises.

use std::sync::Arc;

use super::channel::{Channel, Knot, Mouth};
use super::chunk::ChunkId;
use super::fields::Fields;
use super::point::{Point, chance};
use super::segment::{Segment, Segments, downstream};
use super::trunk::{LEAST_SLOPE, NodeId};
use super::trunk_course::{DROWNED_SLOPE, INCISION};
use super::wander;
use crate::geometry::{LineSegment, length, lerp, lines};
use crate::hash::{self, Draw};
use crate::memory::Memory;

/// Cells that a tributary is long at most, before it runs aslant.
const JOIN_CELLS: f64 = 2.5;

/// Cells that lie between a head and the nearest channel at least: at the finest level, and more at each level above it.
const LEAST_CELLS: (f64, f64) = (0.45, 0.12);

/// How far downstream of the nearest point a tributary ends, as a share of the distance: at the finest level, and more at
/// each level above it, up to a most.
///
/// Longer and more slanting tributaries at the coarser levels make large basins longer than wide: Hack's law.
const SLANT: (f64, f64, f64) = (0.35, 0.2, 1.3);

/// How far from all channels a tributary that runs aslant keeps, as a share of the way to where it ends, and at how many
/// places: one that comes nearer brushes past a bend of what it runs to, or along it, and in the world they would cross.
const GRAZES: f64 = 0.15;
const GRAZES_AT: u32 = 16;

/// Share of the cells that are left without a channel, so that confluences are not spaced too evenly.
const LEFT_OUT: f64 = 0.15;

/// Cells that a tributary sticks out of the cell of its head at most: it ends within `JOIN_CELLS * sqrt(1 + SLANT^2)`, and
/// wanders by less than a cell.
pub const REACH_CELLS: f64 = 5.0;

/// Cells around a chunk beyond which no channel of the levels above it matters: further than a tributary may end, it may be
/// under the valley side of what is still further.
pub const ABOVE_CELLS: f64 = JOIN_CELLS + 3.0;

/// The tributaries of a world. What they join, the segments of the levels above a chunk and around it, relative to its
/// corner, is asked of whoever asks for them.
#[derive(Debug)]
pub struct Tributaries {
    seed: u64,
    fields: Arc<Fields>,
    drafts: Memory<ChunkId, Vec<Draft>>,
    courses: Memory<ChunkId, Vec<Course>>,
}

impl Tributaries {
    /// The tributaries of a world with these fields.
    pub fn new(fields: Arc<Fields>, seed: u64) -> Tributaries {
        Tributaries { seed, fields, drafts: Memory::new(1 << 11), courses: Memory::new(1 << 11) }
    }

    /// The tributaries whose heads are in the cells of a chunk.
    pub fn of(&self, id: ChunkId, above: &impl Fn(ChunkId) -> Segments) -> Vec<Arc<Channel>> {
        let segments = above(id);
        // The straight courses of this one's and its neighbours' tributaries.
        let mut courses: Vec<(NodeId, LineSegment)> = Vec::new();
        for chunk in id.with_neighbours() {
            let line = |course: &Course| (course.cell, course.end.line(course.head, segments.origin));
            courses.extend(self.courses(chunk, above).iter().map(line));
        }
        let own = self.courses(id, above);
        own.iter().map(|course| Arc::new(self.tributary(id.level, course, &segments, &courses))).collect()
    }

    /// Where the tributaries of a chunk's cells begin and end.
    ///
    /// Straight lines to the nearest channel do not cross, and aslant they may: so a tributary runs aslant only where that
    /// line crosses neither what is there nor any line that another one may take.
    fn courses(&self, id: ChunkId, above: &impl Fn(ChunkId) -> Segments) -> Arc<Vec<Course>> {
        self.courses.get(id, || {
            let own = self.drafts(id, above);
            let around: Vec<Arc<Vec<Draft>>> = id.with_neighbours().map(|chunk| self.drafts(chunk, above)).collect();
            let above = above(id);
            let origin = above.origin;
            let others = |draft: &Draft| {
                let (cell, line) = (draft.cell, draft.direct.line(draft.head, origin));
                let reach = length(line.along) * 3.0;
                around.iter().flat_map(|drafts| drafts.iter()).filter(move |other| {
                    other.cell != cell && other.direct.line(other.head, origin).touches(line.from, reach)
                })
            };
            let take = |draft: &Draft| {
                let direct = draft.direct.line(draft.head, origin);
                if draft.direct.mouth == Mouth::Sea {
                    // The coast is no channel, so lines to it may cross others: those that do give way.
                    let gives_way = |other: &Draft| {
                        let stays = other.direct.mouth != Mouth::Sea || other.cell < draft.cell;
                        stays && other.direct.line(other.head, origin).crosses(&direct)
                    };
                    return (!others(draft).any(gives_way)).then_some(draft.direct);
                }
                let Some(aslant) = draft.aslant else { return Some(draft.direct) };
                let line = aslant.line(draft.head, origin);
                let blocked = |other: &Draft| {
                    let ends = [Some(other.direct), other.aslant];
                    ends.into_iter().flatten().any(|end| end.line(other.head, origin).crosses(&line))
                };
                let crosses = |segment: &Segment| segment.line().crosses(&line);
                let whole = length(line.along);
                let grazes = |segment: &Segment| {
                    segment.line().touches(line.from, whole)
                        && (1..=GRAZES_AT).any(|step| {
                            let share = step as f64 / GRAZES_AT as f64;
                            let place = [0, 1].map(|axis| line.from[axis] + line.along[axis] * share);
                            let least = GRAZES * share * whole;
                            segment.nearest(place).1 < least * least
                        })
                };
                let free =
                    !others(draft).any(blocked) && !above.all.iter().any(|segment| crosses(segment) || grazes(segment));
                Some(if free { aslant } else { draft.direct })
            };
            let course = |draft: &Draft| Some(Course { cell: draft.cell, head: draft.head, end: take(draft)? });
            own.iter().filter_map(course).collect()
        })
    }

    /// Where the tributaries of a chunk's cells begin and may end.
    fn drafts(&self, id: ChunkId, above: &impl Fn(ChunkId) -> Segments) -> Arc<Vec<Draft>> {
        self.drafts.get(id, || {
            let above = above(id);
            id.cells().filter_map(|cell| self.draft(id.level, cell, &above)).collect()
        })
    }

    /// Where the tributary of a cell begins and may end, if there is one, given the segments of the levels above around it.
    fn draft(&self, level: u32, id: NodeId, above: &Segments) -> Option<Draft> {
        let (fields, cell) = (&self.fields, self.fields.side(level));
        let seed = hash::network_level(self.seed, level);
        if chance(seed, id, Draw::Choice, 0) < LEFT_OUT {
            return None;
        }
        let corner = Point { x: id.0 * cell, y: id.1 * cell };
        let head = corner.moved([0, 1].map(|axis| (0.1 + 0.8 * chance(seed, id, Draw::Head, axis)) * cell as f64));
        if fields.potential(head) < fields.sea_potential() {
            return None;
        }
        let origin = above.origin;
        let from = head.from(origin);
        let in_lake = |segment: &Segment| {
            segment.widest_lake() > 0.0 && {
                let (t, square) = segment.nearest(from);
                let shore = lerp(segment.lake, t);
                square < shore * shore
            }
        };
        if above.all.iter().any(in_lake) {
            return None;
        }
        // At the nearest channel, or at the coast if that is nearer.
        let nearest = above
            .all
            .iter()
            .map(|segment| (segment.nearest(from), segment))
            .min_by(|a, b| a.0.1.partial_cmp(&b.0.1).expect("distances are numbers"));
        let distance = nearest.map_or(f64::INFINITY, |((_, square), _)| square.sqrt());
        let most = JOIN_CELLS * cell as f64;
        if let Some([shore, beyond]) = fields.coast_near(head, distance.min(most)) {
            let line = LineSegment { from: beyond.from(origin), along: head.from(beyond) };
            let crosses = |segment: &Segment| segment.line().crosses(&line);
            let foot = if above.all.iter().any(crosses) { shore } else { beyond };
            let direct = End { foot, shore, level_m: fields.sea_level_m(), mouth: Mouth::Sea, mouth_area: 0.0 };
            return Some(Draft { cell: id, head, direct, aslant: None });
        }
        // Levels that are finer.
        let finer = (fields.levels() - 1 - level) as f64;
        let least = (LEAST_CELLS.0 + LEAST_CELLS.1 * finer) * cell as f64;
        let ((t, _), segment) = nearest.filter(|_| least <= distance && distance <= most)?;
        let end = |segment: &Segment, t: f64| {
            let foot = origin.moved([0, 1].map(|axis| segment.from[axis] + segment.along[axis] * t));
            let mouth = Mouth::Channel(above.channels[segment.channel as usize].id);
            End { foot, shore: foot, level_m: lerp(segment.level_m, t), mouth, mouth_area: lerp(segment.area, t) }
        };
        // Not where the coast is lower than that.
        let falls = |end: &End| {
            let places = fields.segments_a_channel(level);
            let way = head.from(end.foot).map(|part| part / places as f64);
            let mut places = (1..=places).map(|place| end.foot.moved(way.map(|part| part * place as f64)));
            !fields.has_sea() || places.all(|at| fields.below_coast_m(at) > end.level_m)
        };
        let direct = Some(end(segment, t)).filter(falls)?;
        let slant = (SLANT.0 + SLANT.1 * finer).min(SLANT.2);
        let aslant = downstream(&above.all, segment, t, slant * distance);
        Some(Draft { cell: id, head, direct, aslant: Some(end(aslant.0, aslant.1)).filter(falls) })
    }

    /// A tributary along its course, given the segments of the levels above and the courses of its own around it.
    fn tributary(&self, level: u32, course: &Course, above: &Segments, courses: &[(NodeId, LineSegment)]) -> Channel {
        let (fields, cell) = (&self.fields, self.fields.side(level));
        let seed = hash::network_level(self.seed, level);
        let origin = above.origin;
        let &Course { cell: id, head, end: End { foot, shore, level_m, mouth, mouth_area } } = course;
        let way = head.from(shore);
        let reach = length(way);
        let from = shore.from(origin);
        let middle = [0, 1].map(|axis| from[axis] + way[axis] / 2.0);
        let brook = 1.5 * reach + 1.5 * cell as f64;
        let is_near = |segment: &&Segment| {
            let reach = segment.reach(brook);
            segment.nearest(middle).1 < reach * reach
        };
        let near: Vec<&Segment> = above.all.iter().filter(is_near).collect();
        // Where it goes, from its foot up.
        let segments = fields.segments_a_channel(level);
        let straight: Vec<[f64; 2]> = (0..=segments)
            .map(|step| [0, 1].map(|axis| from[axis] + way[axis] * (step as f64 / segments as f64)))
            .collect();
        let offsets: Vec<f64> = wander::offsets(seed, id, segments).iter().map(|share| share * reach).collect();
        let others = courses.iter().filter(|(other, _)| *other != id).map(|(_, line)| *line);
        let around: Vec<LineSegment> = others
            .filter(|line| line.touches(middle, reach))
            .chain(near.iter().map(|segment| segment.line()).filter(|line| line.touches(middle, reach)))
            .collect();
        let wandered = wander::wandered(&straight, &offsets, &around);
        // Where the room was misjudged between two knots, the straight course is still there.
        let crosses = |line: &LineSegment| around.iter().any(|other| other.crosses(line));
        let places = if lines(&wandered, 1).iter().any(crosses) { straight } else { wandered };
        // The bed, from the mouth up.
        let uplift = fields.uplift(head);
        let hill_slope = fields.hill_slope(uplift);
        // Where it comes to the larger valley, hillsides may be gentler.
        let gentlest = fields.hill_slope(fields.uplift(shore)).min(hill_slope);
        let side_slope = INCISION * gentlest * fields.metres_a_grain();
        let area_end = most_area(level);
        let area = |share: f64| area_end * (1.0 - 0.75 * share);
        let coast_m = fields.below_coast_along_m(places.iter().rev().map(|place| origin.moved(*place)));
        let mut knots = vec![Knot { at: shore, level_m, area: area_end, lake: 0.0 }];
        for step in 1..=segments {
            let share = step as f64 / segments as f64;
            let [before, here] = [places[step - 1], places[step]];
            let step_m = length([here[0] - before[0], here[1] - before[1]]) * fields.metres_a_grain();
            let rise_m = step_m * fields.river_slope(uplift, area(share - 0.5 / segments as f64));
            let below_m = knots[step - 1].level_m;
            let free_m = below_m + rise_m;
            let lower = near.iter().filter(|segment| segment.lowest_m() < free_m);
            let ground_m = lower.map(|segment| segment.side_m(here, side_slope)).fold(free_m, f64::min);
            // Across a lake or the floor of a larger valley it rises no more than that does, but always a little.
            let least_m = below_m + rise_m.min(step_m * LEAST_SLOPE);
            let ground_m = ground_m.min(coast_m[segments - step]);
            knots.push(Knot { at: origin.moved(here), level_m: ground_m.max(least_m), area: area(share), lake: 0.0 });
        }
        knots.reverse();
        if foot != shore {
            let drowned_m = shore.distance(foot) * fields.metres_a_grain() * DROWNED_SLOPE;
            knots.push(Knot { at: foot, level_m: level_m - drowned_m, area: area_end, lake: 0.0 });
        }
        let mut channel = Channel::new((level, id.0, id.1), knots, mouth, hill_slope);
        channel.mouth_area = channel.mouth_area.max(mouth_area);
        channel
    }
}

/// Where a tributary begins, and where it ends if it runs straight to the nearest channel or if it runs aslant.
#[derive(Debug)]
struct Draft {
    cell: NodeId,
    head: Point,
    direct: End,
    aslant: Option<End>,
}

/// Where a tributary begins and where it ends.
#[derive(Debug)]
struct Course {
    cell: NodeId,
    head: Point,
    end: End,
}

/// Where a tributary ends.
#[derive(Clone, Copy, Debug)]
struct End {
    foot: Point,
    /// Where its course ends; beyond it, it runs straight on to its foot in the sea.
    shore: Point,
    /// Height of the water there in metres.
    level_m: f64,
    mouth: Mouth,
    mouth_area: f64,
}

impl End {
    fn line(&self, head: Point, origin: Point) -> LineSegment {
        LineSegment { from: self.foot.from(origin), along: head.from(self.foot) }
    }
}

/// The area at the mouth of a tributary of a level, in cells of the trunk lattice.
pub fn most_area(level: u32) -> f64 {
    0.25f64.powi(level as i32)
}
