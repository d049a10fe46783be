//! The network of channels: the trunks, and level by level the tributaries that join what is already there.
//!
//! A cell of a level's lattice may hold the head of a channel, whose course is a straight line to the nearest channel of
//! the levels above it: such lines cannot cross each other, nor what they run to. Where it crosses nothing that may be
//! there, the line runs aslant downstream instead. Around its course a channel wanders, in a tube that no other's tube
//! meets; at last [`Fluvial`](super::Fluvial) warps the plane, channels and hills alike. Where the coast is nearer a
//! channel runs to the coast. Its bed rises from where it ends, by the law of rivers, and never above the valley
//! sides that the levels above it make.
//!
//! Channels come in chunks of cells, each a pure function of its place that asks for the chunks of the levels above.
//!
//! Based on: M. Gaillard, B. Benes, E. Guérin, E. Galin, D. Rohmer, M.-P. Cani, Dendry: a procedural model for dendritic
//! patterns, 2019 (nested lattices that join the nearest channel).

use std::f64::consts::TAU;
use std::sync::Arc;

use super::fields::Fields;
use super::point::{GRAINS, Point, chance, length};
use super::trunk::{Drained, LEAST_SLOPE, NodeId, Trunks, neighbours};
use super::wander::{self, Line};
use crate::memory::{Fill, Memory, heap_bytes};

/// The id of a channel: its level, and the cell of that level's lattice that holds its head.
pub type ChannelId = (u32, i64, i64);

/// A point of a channel's middle line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Knot {
    /// Where it is.
    pub at: Point,
    /// Height of the water, or of the floor where it is dry, in metres, before strata and ceiling.
    pub level_m: f64,
    /// Area that drains through it, in cells of the trunk lattice.
    pub area: f64,
    /// Half width in grains of the lake here, 0 where there is none.
    pub lake: f64,
}

heap_bytes!(Knot);

/// What a channel runs into.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mouth {
    /// The channel of that id.
    Channel(ChannelId),
    /// The sea.
    Sea,
    /// A lake that has no outlet, at that node of the trunk lattice.
    Sink(NodeId),
}

/// A channel from its head down to its mouth; of a trunk, the part from one node to the next.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// Its name in the world.
    pub id: ChannelId,
    /// From head to mouth, at least two.
    pub knots: Vec<Knot>,
    /// What it runs into.
    pub mouth: Mouth,
    /// Slope of the hillsides around.
    pub hill_slope: f64,
    /// Area that drains through what it runs into, there, in cells of the trunk lattice; its own for the sea and lakes.
    pub mouth_area: f64,
    /// For a trunk, the next node and whether this is that river's own upper course; not for one that the sea cuts short.
    pub next: Option<(NodeId, bool)>,
    bounds: [Point; 2],
}

heap_bytes!(Channel: knots);

/// The channels whose heads are in a square of cells.
#[derive(Debug)]
struct Chunk {
    channels: Vec<Arc<Channel>>,
}

heap_bytes!(Chunk: channels);

/// Cells a side of a chunk: of trunks, which are long and cost much, and of tributaries, whose neighbours must be within
/// the next chunk.
const fn chunk_cells(level: u32) -> i64 {
    if level == 0 { 2 } else { 8 }
}

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

/// Cells that a channel sticks out of the cell of its head at most: (trunks, tributaries).
///
/// A trunk runs to a neighbouring node, and its curve bulges by less than its length. A tributary ends within
/// `JOIN_CELLS * sqrt(1 + SLANT^2)`, and wanders by less than a cell.
const REACH_CELLS: (f64, f64) = (2.5, 5.0);

/// Half widths of a lake, as shares of that at its node, from there on along the main river on either side; at the next
/// knot it is as narrow as that. So the water is level just as far as there is a lake.
const LAKE_SHAPE: [f64; 4] = [1.0, 0.94, 0.78, 0.5];

/// Half width of a lake where it ends, as a share of the least that a lake has: of two that are equal rounding would choose.
const LAKE_END: f64 = 0.99;

/// How steep a river runs down the side of a larger one's valley at most, as a share of that side's slope: so it cuts into
/// it, and is not lost on it.
const INCISION: f64 = 0.7;

/// How steep a bed is that goes on under the sea.
const DROWNED_SLOPE: f64 = 0.002;

/// Streams of chance: a level's begin at its multiple of this.
const CHANNELS_A_LEVEL: u64 = 1 << 8;

/// The channels of a world.
#[derive(Debug)]
pub struct Network {
    fields: Arc<Fields>,
    trunks: Trunks,
    seed: u64,
    smooth: Memory<NodeId, Option<Arc<Channel>>>,
    apart: Memory<NodeId, Option<Arc<Channel>>>,
    free: Memory<NodeId, Option<Arc<Channel>>>,
    drafts: Memory<ChannelId, Vec<Draft>>,
    courses: Memory<ChannelId, Vec<Course>>,
    chunks: Memory<ChannelId, Chunk>,
}

/// The straight pieces of the channels around a place, in a fixed order.
#[derive(Debug)]
pub struct Pieces {
    /// What their lines are relative to.
    pub origin: Point,
    /// The channels, in the order of levels, chunks and cells.
    pub channels: Vec<Arc<Channel>>,
    /// Their pieces, those of a channel from its head down.
    pub all: Vec<Piece>,
}

heap_bytes!(Pieces: channels, all);

/// A straight piece of a channel: from one knot to the next. Pairs are a value at its upper end, and how that changes
/// to its lower end.
#[derive(Clone, Debug)]
pub struct Piece {
    /// The number of its channel.
    pub channel: u32,
    /// The number of the knot at which it begins.
    pub knot: u32,
    /// Where it begins, in grains east and south of the origin.
    pub from: [f64; 2],
    /// The way from there to where it ends.
    pub along: [f64; 2],
    per_square: f64,
    /// Heights of the water in metres.
    pub level_m: [f64; 2],
    /// Areas that drain through it, in cells of the trunk lattice.
    pub area: [f64; 2],
    /// Half widths of the rounding of the valley's floor, in grains.
    pub trough: [f64; 2],
    /// Half widths of a lake, in grains.
    pub lake: [f64; 2],
}

heap_bytes!(Piece);

/// Grains from a channel beyond which its side has risen more than that of a brook does within `brook` grains, by the half
/// widths of the rounding of its floor and of its lake.
fn reach(brook: f64, trough: f64, lake: f64) -> f64 {
    (brook * (brook + 2.0 * trough) + lake * lake).sqrt()
}

/// The value at a share of the way along a piece.
pub fn mix([from, change]: [f64; 2], share: f64) -> f64 {
    from + change * share
}

impl Piece {
    /// The share of the piece at which it is nearest to a point, and the square of the distance in grains.
    pub(super) fn nearest(&self, to: [f64; 2]) -> (f64, f64) {
        self.nearest_off([to[0] - self.from[0], to[1] - self.from[1]])
    }

    /// The same for a point so far from where the piece begins.
    pub(super) fn nearest_off(&self, off: [f64; 2]) -> (f64, f64) {
        let t = ((off[0] * self.along[0] + off[1] * self.along[1]) * self.per_square).clamp(0.0, 1.0);
        let off = [off[0] - self.along[0] * t, off[1] - self.along[1] * t];
        (t, off[0] * off[0] + off[1] * off[1])
    }

    /// The largest half width of its lake in grains.
    pub fn widest_lake(&self) -> f64 {
        self.lake[0].max(self.lake[0] + self.lake[1])
    }

    /// Grains from the piece beyond which its side has risen more than that of a brook without a floor does within
    /// `brook` grains.
    #[inline]
    pub fn reach(&self, brook: f64) -> f64 {
        reach(brook, self.trough[0].max(self.trough[0] + self.trough[1]), self.widest_lake())
    }

    /// Its lowest water in metres.
    fn lowest_m(&self) -> f64 {
        self.level_m[0].min(self.level_m[0] + self.level_m[1])
    }

    /// The height of the valley side that rises from it at a point, for hillsides that rise so many metres a grain.
    fn side_m(&self, at: [f64; 2], slope: f64) -> f64 {
        let (t, square) = self.nearest(at);
        let (trough, shore) = (mix(self.trough, t), mix(self.lake, t));
        let rise = ((square - shore * shore).max(0.0) + trough * trough).sqrt() - trough;
        mix(self.level_m, t) + slope * rise
    }
}

impl Network {
    /// The network of a world with these fields.
    pub fn new(fields: Arc<Fields>, seed: u64) -> Network {
        Network {
            trunks: Trunks::new(Arc::clone(&fields), seed),
            fields,
            seed,
            // Measured over 6 x 6 tiles of alps with roads, which plan over some 5000 x 5000 vertices: with half the room for
            // drafts, courses and chunks, those are made three times over, and a bake takes twice as long.
            smooth: Memory::new(8 << 20),
            apart: Memory::new(8 << 20),
            free: Memory::new(8 << 20),
            drafts: Memory::new(24 << 20),
            courses: Memory::new(12 << 20),
            chunks: Memory::new(64 << 20),
        }
    }

    /// How full its memories are.
    pub(super) fn fills(&self) -> Vec<Fill> {
        let trunks = [self.smooth.fill(), self.apart.fill(), self.free.fill()];
        let channels = [self.drafts.fill(), self.courses.fill(), self.chunks.fill()];
        [self.trunks.fills(), trunks.to_vec(), channels.to_vec()].concat()
    }

    /// The trunk lattice.
    pub fn trunks(&self) -> &Trunks {
        &self.trunks
    }

    /// Calls `take` with all channels of a level that may touch a rectangle, in the order of their chunks and ids.
    pub fn channels(&self, level: u32, [low, high]: [Point; 2], mut take: impl FnMut(&Arc<Channel>)) {
        let cell = self.fields.side(level);
        let side = cell * chunk_cells(level);
        let reach = ((if level == 0 { REACH_CELLS.0 } else { REACH_CELLS.1 }) * cell as f64) as i64;
        for y in (low.y - reach).div_euclid(side)..=(high.y + reach).div_euclid(side) {
            for x in (low.x - reach).div_euclid(side)..=(high.x + reach).div_euclid(side) {
                for channel in &self.chunk((level, x, y)).channels {
                    let [from, to] = channel.bounds;
                    if from.x <= high.x && to.x >= low.x && from.y <= high.y && to.y >= low.y {
                        take(channel);
                    }
                }
            }
        }
    }

    /// The channel of an id, if there is one.
    pub fn channel(&self, (level, x, y): ChannelId) -> Option<Arc<Channel>> {
        let cells = chunk_cells(level);
        let chunk = self.chunk((level, x.div_euclid(cells), y.div_euclid(cells)));
        chunk.channels.iter().find(|channel| channel.id == (level, x, y)).cloned()
    }

    /// The pieces of the first `levels` levels whose [reach](Piece::reach), by `brook` grains, touches a rectangle, relative
    /// to `origin`.
    pub fn pieces(&self, levels: u32, rectangle: [Point; 2], origin: Point, brook: f64) -> Pieces {
        let [low, high] = rectangle.map(|corner| corner.from(origin));
        let (mut channels, mut all) = (Vec::new(), Vec::new());
        for level in 0..levels {
            let widest = match level {
                0 => reach(brook, self.fields.widest_trough(), self.fields.lake_half_width()),
                _ => reach(brook, self.fields.trough(most_area(level)), 0.0),
            };
            let around = [rectangle[0].moved([-widest; 2]), rectangle[1].moved([widest; 2])];
            self.channels(level, around, |channel| {
                let before = all.len();
                let touches = |[from, to]: [[f64; 2]; 2], reach: f64| {
                    [0, 1].into_iter().all(|axis| {
                        from[axis].max(to[axis]) + reach >= low[axis] && from[axis].min(to[axis]) - reach <= high[axis]
                    })
                };
                // Most are further than any may be.
                let pieces = self.pieces_where(channel, channels.len() as u32, origin, |ends| touches(ends, widest));
                let reaches = |piece: &Piece| {
                    let to = [0, 1].map(|axis| piece.from[axis] + piece.along[axis]);
                    touches([piece.from, to], piece.reach(brook))
                };
                all.extend(pieces.filter(reaches));
                if all.len() > before {
                    channels.push(Arc::clone(channel));
                }
            });
        }
        Pieces { origin, channels, all }
    }

    /// The pieces of a channel that has that number, but for those without a length, of those whose ends are wanted.
    fn pieces_where(
        &self,
        channel: &Channel,
        number: u32,
        origin: Point,
        wanted: impl Fn([[f64; 2]; 2]) -> bool,
    ) -> impl Iterator<Item = Piece> {
        channel.knots.windows(2).enumerate().filter_map(move |(knot, pair)| {
            let (from, to) = (pair[0].at.from(origin), pair[1].at.from(origin));
            if !wanted([from, to]) {
                return None;
            }
            let along = [to[0] - from[0], to[1] - from[1]];
            let square = along[0] * along[0] + along[1] * along[1];
            let values = |value: &dyn Fn(&Knot) -> f64| {
                let upper = value(&pair[0]);
                [upper, value(&pair[1]) - upper]
            };
            // A floor as round as it can be if the sides, a vertex from the middle, are still this much steeper than the
            // river. On rounder ones a vertex of the bed is nearly as high above a place further down, beside whose bed it
            // lies: it would be land, and break the brook.
            const STEEPER: f64 = 2.5;
            let fall_m = (pair[0].level_m - pair[1].level_m).max(1e-9);
            let length_m = square.sqrt() * self.fields.metres_a_grain();
            let roundest = channel.hill_slope * GRAINS as f64 * length_m / (STEEPER * fall_m);
            (square > 0.0).then(|| Piece {
                channel: number,
                knot: knot as u32,
                from,
                along,
                per_square: 1.0 / square,
                level_m: values(&|knot| knot.level_m),
                area: values(&|knot| knot.area),
                trough: values(&|knot| self.fields.trough(knot.area).min(roundest)),
                lake: values(&|knot| knot.lake),
            })
        })
    }

    fn chunk(&self, id: ChannelId) -> Arc<Chunk> {
        self.chunks.get(id, || {
            let channels = match id.0 {
                0 => cells(id).filter_map(|node| self.trunk(node)).map(Arc::new).collect(),
                _ => self.tributaries(id),
            };
            Chunk { channels }
        })
    }

    /// Straight pieces of a channel of a level, each about as long as the finest level's cells.
    fn pieces_of(&self, level: u32) -> usize {
        1 << (self.fields.levels() - 1 - level).max(2)
    }

    /// The trunk from a node to the next one downstream; `None` for a sink.
    ///
    /// Where it comes to a larger one from the side, it keeps below the sides of that one's valley.
    fn trunk(&self, id: NodeId) -> Option<Channel> {
        let mut trunk = self.free_trunk(id)?.as_ref().clone();
        let Some((to, false)) = trunk.next else { return Some(trunk) };
        let main = self.trunks.drained(to).main;
        let others: Vec<Arc<Channel>> = main.into_iter().chain([to]).filter_map(|id| self.free_trunk(id)).collect();
        let origin = trunk.knots[0].at;
        let pieces: Vec<Piece> =
            others.iter().flat_map(|other| self.pieces_where(other, 0, origin, |_| true)).collect();
        for index in (0..trunk.knots.len() - 1).rev() {
            let (below, here) = (trunk.knots[index + 1], trunk.knots[index]);
            let hill_slope = self.fields.hill_slope(self.fields.uplift(here.at)).min(trunk.hill_slope);
            let slope = INCISION * hill_slope * self.fields.metres_a_grain();
            let relative = here.at.from(origin);
            let sides = pieces.iter().map(|piece| piece.side_m(relative, slope));
            let least_m = below.level_m + (here.level_m - below.level_m).clamp(0.0, 0.01);
            trunk.knots[index].level_m = sides.fold(here.level_m, f64::min).max(least_m);
        }
        Some(trunk)
    }

    /// The trunk from a node to the next one, but for what the sides of other valleys do to it.
    fn free_trunk(&self, id: NodeId) -> Option<Arc<Channel>> {
        self.free.get(id, || self.make_free_trunk(id).map(Arc::new)).as_ref().clone()
    }

    fn make_free_trunk(&self, id: NodeId) -> Option<Channel> {
        let mut trunk = self.apart_trunk(id)?.as_ref().clone();
        if trunk.next.is_none() {
            let in_sea = |knot: &Knot| self.fields.in_sea(knot.at);
            let wet = trunk.knots.iter().position(in_sea).unwrap_or(trunk.knots.len());
            let after = trunk.knots[wet..].iter().take_while(|knot| in_sea(knot)).count();
            trunk.knots.truncate((wet + after).max(2));
            self.cut_into_coast(&mut trunk.knots);
            return Some(Channel { bounds: bounds(&trunk.knots), ..trunk });
        }
        let origin = trunk.knots[0].at;
        let relative = |trunk: &Channel| trunk.knots.iter().map(|knot| knot.at.from(origin)).collect::<Vec<_>>();
        let course = relative(&trunk);
        // Those that start from the nodes around, as smooth as this one.
        let nodes = (-2..=2).flat_map(|y| (-2..=2).map(move |x| (id.0 + x, id.1 + y)));
        let others = nodes.filter(|node| *node != id).filter_map(|node| self.apart_trunk(node));
        let around: Vec<Line> = others.flat_map(|other| lines(&relative(&other), 8)).collect();
        let (from, to) = (trunk.knots[0].at, trunk.knots[course.len() - 1].at);
        let whole = from.distance(to) * self.bend(&self.trunks.drained(id), from, to);
        let mut offsets = wander::offsets(self.seed, id, course.len() - 1);
        for (offset, knot) in offsets.iter_mut().zip(&trunk.knots) {
            *offset *= if knot.lake > 0.0 { 0.0 } else { whole };
        }
        self.meander(&trunk, &mut offsets);
        for (knot, place) in trunk.knots.iter_mut().zip(wander::wandered(&course, &offsets, &around)) {
            knot.at = origin.moved(place);
        }
        self.cut_into_coast(&mut trunk.knots);
        Some(Channel { bounds: bounds(&trunk.knots), ..trunk })
    }

    /// Lowers the bed of a trunk on land to where it cuts into the coast.
    fn cut_into_coast(&self, knots: &mut [Knot]) {
        if !self.fields.has_sea() {
            return;
        }
        let (sea_m, metres) = (self.fields.sea_level_m(), self.fields.metres_a_grain());
        let most_m = self.below_coast_m(knots.iter().map(|knot| knot.at));
        for index in (0..knots.len() - 1).rev() {
            let (below, here) = (knots[index + 1], &mut knots[index]);
            if below.level_m >= sea_m && here.lake == 0.0 {
                let least_m = here.at.distance(below.at) * metres * LEAST_SLOPE;
                let least_m = below.level_m + (here.level_m - below.level_m).min(least_m);
                here.level_m = here.level_m.min(most_m[index]).max(least_m);
            }
        }
    }

    /// The height in metres that the coast leaves the bed of a channel, from its head down: no more than further up.
    fn below_coast_m(&self, course: impl Iterator<Item = Point>) -> Vec<f64> {
        let lower = |most_m: &mut f64, at: Point| {
            *most_m = most_m.min(self.fields.below_coast_m(at));
            Some(*most_m)
        };
        course.scan(f64::INFINITY, lower).collect()
    }

    /// The course of the trunk from a node to the next: a smooth curve, or a straight line where that comes too close to
    /// another one with which it shares a node.
    fn apart_trunk(&self, id: NodeId) -> Option<Arc<Channel>> {
        let make = || {
            let smooth = self.smooth_trunk(id)?;
            let to = self.trunks.drained(id).to?;
            let from = |node: NodeId, to: NodeId| {
                neighbours(to)
                    .filter(move |other| *other != node && self.trunks.drained(*other).to == Some(to))
                    .map(move |other| (other, to))
            };
            // Those that come to its head, those that come to its end with it, and the one that goes on from there.
            let mut others = from(id, id).chain(from(id, to)).chain([(to, to)]);
            let meets = |(other, node): (NodeId, NodeId)| {
                let joint = self.trunks.node(node).at;
                self.smooth_trunk(other).is_some_and(|other| too_close(&smooth.knots, &other.knots, joint))
            };
            if others.any(meets) { self.make_smooth_trunk(id, 0.0).map(Arc::new) } else { Some(smooth) }
        };
        self.apart.get(id, make).as_ref().clone()
    }

    /// The course of the trunk from a node to the next: a smooth curve.
    fn smooth_trunk(&self, id: NodeId) -> Option<Arc<Channel>> {
        self.smooth.get(id, || self.make_smooth_trunk(id, 1.0).map(Arc::new)).as_ref().clone()
    }

    /// The trunk from a node to the next, which bends as much as it may by a share.
    fn make_smooth_trunk(&self, id: NodeId, share: f64) -> Option<Channel> {
        let drained = self.trunks.drained(id);
        let to = drained.to?;
        let below = self.trunks.drained(to);
        let (here, there) = (self.trunks.node(id), self.trunks.node(to));
        let straight = there.at.from(here.at);
        // A river runs through a node in the direction from the one before to the one after.
        let through = |id: NodeId, drained: &Drained| {
            let to = self.trunks.node(drained.to?).at;
            Some(match drained.main {
                Some(main) => to.from(self.trunks.node(main).at).map(|part| part * 0.5),
                None => to.from(self.trunks.node(id).at),
            })
        };
        let is_main = below.main == Some(id);
        let start = through(id, &drained).unwrap_or(straight);
        let end = match through(to, &below) {
            Some(end) if is_main => end,
            Some(end) => [0, 1].map(|axis| 0.5 * (end[axis] + straight[axis])),
            None => straight,
        };
        let pieces = self.pieces_of(0).max(16);
        let bend = share * self.bend(&drained, here.at, there.at);
        // Where the sea comes in between, it ends there.
        let dry = drained.sea_at.unwrap_or(1.0);
        let in_bay = drained.sea_at.is_some() && !there.sea;
        let (below_m, below_lake) =
            if drained.sea_at.is_some() { (self.fields.sea_level_m(), 0.0) } else { (below.level_m, below.lake) };
        // A lake lies along the main river; in the mouths of the others it soon ends, so that it is no star.
        let mouth_shape = if is_main { &LAKE_SHAPE[..] } else { &LAKE_SHAPE[..1] };
        let part = |shape: &[f64]| shape.len() as f64 / pieces as f64;
        let falls = [
            if drained.lake > 0.0 { part(&LAKE_SHAPE) } else { 0.0 },
            if below_lake > 0.0 { 1.0 - part(mouth_shape) } else { dry },
        ];
        let fall_m = drained.level_m - below_m;
        let length_m = length(straight) * self.fields.metres_a_grain();
        // What comes from above; a spring has a quarter of its cell.
        let area_above = (drained.area as f64 - 1.0).max(0.25);
        let lake = |shape: &[f64], step: usize, half_width: f64, least: f64| match shape.get(step) {
            _ if half_width == 0.0 || step > shape.len() => 0.0,
            Some(share) => share * half_width,
            None => LAKE_END * least,
        };
        let knot = |step: usize| {
            let t = step as f64 / pieces as f64;
            let (t2, t3) = (t * t, t * t * t);
            // Hermite's cubic, a little less curved.
            let (leave, arrive) = (0.8 * bend * (t3 - 2.0 * t2 + t), 0.8 * bend * (t3 - t2));
            let go = t + bend * (3.0 * t2 - 2.0 * t3 - t);
            let way = [0, 1].map(|axis| start[axis] * leave + straight[axis] * go + end[axis] * arrive);
            let fallen = ((t - falls[0]) / (falls[1] - falls[0])).clamp(0.0, 1.0);
            // On the floor of the sea it goes on falling a little.
            let drowned_m = (t - dry).max(0.0) * length_m * DROWNED_SLOPE;
            let area = area_above + (drained.area as f64 - area_above) * t;
            let least = self.fields.least_lake(area);
            let lakes =
                [lake(&LAKE_SHAPE, step, drained.lake, least), lake(mouth_shape, pieces - step, below_lake, least)];
            Knot {
                at: here.at.moved(way),
                level_m: drained.level_m - fall_m * fallen - drowned_m,
                area,
                lake: lakes[0].max(lakes[1]),
            }
        };
        let knots: Vec<Knot> = (0..=pieces).map(knot).collect();
        let mouth = match below.to {
            _ if drained.sea_at.is_some() => Mouth::Sea,
            Some(_) => Mouth::Channel((0, to.0, to.1)),
            None => Mouth::Sink(to),
        };
        let hill_slope = self.fields.hill_slope(self.fields.uplift(here.at));
        let next = (!in_bay).then_some((to, is_main));
        Some(Channel { next, ..Channel::new((0, id.0, id.1), knots, mouth, hill_slope) })
    }

    /// How much a trunk may bend, 0 to 1: the closer the straight way comes to the sea before it ends, the less, for the
    /// lattice judges by that way where it comes into it.
    fn bend(&self, drained: &Drained, from: Point, to: Point) -> f64 {
        const PLACES: u32 = 16;
        // Of its length, to the side.
        const BULGE: f64 = 0.2;
        let way = to.from(from);
        if !self.fields.has_sea() {
            return 1.0;
        }
        if drained.sea_at.is_some() && self.fields.potential(to) >= self.fields.sea_potential() {
            // To a bay.
            return 0.0;
        }
        let bulge_m = BULGE * length(way) * self.fields.metres_a_grain();
        let room = |place: u32| {
            let share = place as f64 / PLACES as f64;
            let at = from.moved(way.map(|part| part * share * drained.sea_at.unwrap_or(1.0)));
            self.fields.inland_m(at) / (4.0 * share * (1.0 - share) * bulge_m)
        };
        (1..PLACES).map(room).fold(1.0, f64::min).max(0.0)
    }

    /// Adds meanders to the offsets of a trunk, in grains, where it is flat enough for that.
    ///
    /// Based on: L. B. Leopold, M. G. Wolman, River meanders, 1960 (a wave is about eleven widths long).
    fn meander(&self, trunk: &Channel, offsets: &mut [f64]) {
        const STEEPEST: f64 = 0.008;
        let (knots, pieces) = (&trunk.knots, trunk.knots.len() - 1);
        let whole = knots[0].at.distance(knots[pieces].at);
        let slope = (knots[0].level_m - knots[pieces].level_m) / (whole * self.fields.metres_a_grain());
        let strength = (1.0 - slope / STEEPEST).max(0.0);
        let piece = whole / pieces as f64;
        let width = self.fields.river_width_m(knots[pieces].area) / self.fields.metres_a_grain();
        let wave = (11.0 * width).max(5.0 * piece);
        let id = (trunk.id.1, trunk.id.2);
        let mut phase = chance(self.seed, id, 8);
        for step in 1..pieces {
            // Waves differ in length from one to the next.
            phase += piece / wave * (0.7 + 0.6 * chance(self.seed.wrapping_add(step as u64), id, 9));
            // Straight where it begins and ends, and in lakes.
            let ends = (8.0 * step.min(pieces - step) as f64 / pieces as f64).min(1.0);
            let shore = if knots[step].lake > 0.0 { 0.0 } else { 1.0 };
            offsets[step] += 0.2 * wave * strength * ends * shore * libm::sin(TAU * phase);
        }
    }

    /// The tributaries of a level whose heads are in the cells of a chunk.
    fn tributaries(&self, id: ChannelId) -> Vec<Arc<Channel>> {
        let (level, x, y) = id;
        let above = self.above(id);
        let origin = above.origin;
        // The straight courses of this one's and its neighbours' tributaries.
        let chunks = (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (level, x + dx, y + dy)));
        let courses: Vec<(NodeId, Line)> = chunks
            .flat_map(|chunk| {
                self.courses(chunk)
                    .iter()
                    .map(|course| (course.cell, course.end.line(course.head, origin)))
                    .collect::<Vec<_>>()
            })
            .collect();
        self.courses(id).iter().map(|course| Arc::new(self.tributary(level, course, &above, &courses))).collect()
    }

    /// The pieces of the levels above a chunk's around it, relative to its corner.
    fn above(&self, (level, x, y): ChannelId) -> Pieces {
        let cell = self.fields.side(level);
        let side = chunk_cells(level) * cell;
        let origin = Point { x: x * side, y: y * side };
        // Beyond where a tributary may end it may be under the valley side of what is still further.
        let brook = (JOIN_CELLS + 3.0) * cell as f64;
        self.pieces(level, [origin, Point { x: origin.x + side, y: origin.y + side }], origin, brook)
    }

    /// Where the tributaries of a chunk's cells begin and end.
    ///
    /// Straight lines to the nearest channel do not cross, and aslant they may: so a tributary runs aslant only where that
    /// line crosses neither what is there nor any line that another one may take.
    fn courses(&self, id: ChannelId) -> Arc<Vec<Course>> {
        self.courses.get(id, || {
            let (level, x, y) = id;
            let above = self.above(id);
            let origin = above.origin;
            let chunks = (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (level, x + dx, y + dy)));
            let around: Vec<Arc<Vec<Draft>>> = chunks.map(|chunk| self.drafts(chunk)).collect();
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
                let crosses = |piece: &Piece| Line { from: piece.from, along: piece.along }.crosses(&line);
                let whole = length(line.along);
                let grazes = |piece: &Piece| {
                    Line { from: piece.from, along: piece.along }.touches(line.from, whole)
                        && (1..=GRAZES_AT).any(|step| {
                            let share = step as f64 / GRAZES_AT as f64;
                            let place = [0, 1].map(|axis| line.from[axis] + line.along[axis] * share);
                            let least = GRAZES * share * whole;
                            piece.nearest(place).1 < least * least
                        })
                };
                let free =
                    !others(draft).any(blocked) && !above.all.iter().any(|piece| crosses(piece) || grazes(piece));
                Some(if free { aslant } else { draft.direct })
            };
            let course = |draft: &Draft| Some(Course { cell: draft.cell, head: draft.head, end: take(draft)? });
            self.drafts(id).iter().filter_map(course).collect()
        })
    }

    /// Where the tributaries of a chunk's cells begin and may end.
    fn drafts(&self, id: ChannelId) -> Arc<Vec<Draft>> {
        self.drafts.get(id, || {
            let above = self.above(id);
            cells(id).filter_map(|cell| self.draft(id.0, cell, &above)).collect()
        })
    }

    /// Where the tributary of a cell begins and may end, if there is one, given the pieces of the levels above around it.
    fn draft(&self, level: u32, id: NodeId, above: &Pieces) -> Option<Draft> {
        let (fields, cell) = (&self.fields, self.fields.side(level));
        let seed = self.seed.wrapping_add(level as u64 * CHANNELS_A_LEVEL);
        if chance(seed, id, 2) < LEFT_OUT {
            return None;
        }
        let corner = Point { x: id.0 * cell, y: id.1 * cell };
        let head = corner.moved([0, 1].map(|axis| (0.1 + 0.8 * chance(seed, id, axis)) * cell as f64));
        if fields.potential(head) < fields.sea_potential() {
            return None;
        }
        let origin = above.origin;
        let from = head.from(origin);
        let in_lake = |piece: &Piece| {
            piece.widest_lake() > 0.0 && {
                let (t, square) = piece.nearest(from);
                let shore = mix(piece.lake, t);
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
            .map(|piece| (piece.nearest(from), piece))
            .min_by(|a, b| a.0.1.partial_cmp(&b.0.1).expect("distances are numbers"));
        let distance = nearest.map_or(f64::INFINITY, |((_, square), _)| square.sqrt());
        let most = JOIN_CELLS * cell as f64;
        if let Some([shore, beyond]) = fields.coast_near(head, distance.min(most)) {
            let line = Line { from: beyond.from(origin), along: head.from(beyond) };
            let crosses = |piece: &Piece| Line { from: piece.from, along: piece.along }.crosses(&line);
            let foot = if above.all.iter().any(crosses) { shore } else { beyond };
            let direct = End { foot, shore, level_m: fields.sea_level_m(), mouth: Mouth::Sea, mouth_area: 0.0 };
            return Some(Draft { cell: id, head, direct, aslant: None });
        }
        // Levels that are finer.
        let finer = (fields.levels() - 1 - level) as f64;
        let least = (LEAST_CELLS.0 + LEAST_CELLS.1 * finer) * cell as f64;
        let ((t, _), piece) = nearest.filter(|_| least <= distance && distance <= most)?;
        let end = |piece: &Piece, t: f64| {
            let foot = origin.moved([0, 1].map(|axis| piece.from[axis] + piece.along[axis] * t));
            let mouth = Mouth::Channel(above.channels[piece.channel as usize].id);
            End { foot, shore: foot, level_m: mix(piece.level_m, t), mouth, mouth_area: mix(piece.area, t) }
        };
        // Not where the coast is lower than that.
        let falls = |end: &End| {
            let places = self.pieces_of(level);
            let way = head.from(end.foot).map(|part| part / places as f64);
            let mut places = (1..=places).map(|place| end.foot.moved(way.map(|part| part * place as f64)));
            !fields.has_sea() || places.all(|at| fields.below_coast_m(at) > end.level_m)
        };
        let direct = Some(end(piece, t)).filter(falls)?;
        let slant = (SLANT.0 + SLANT.1 * finer).min(SLANT.2);
        let aslant = downstream(&above.all, piece, t, slant * distance);
        Some(Draft { cell: id, head, direct, aslant: Some(end(aslant.0, aslant.1)).filter(falls) })
    }

    /// A tributary along its course, given the pieces of the levels above and the courses of its own around it.
    fn tributary(&self, level: u32, course: &Course, above: &Pieces, courses: &[(NodeId, Line)]) -> Channel {
        let (fields, cell) = (&self.fields, self.fields.side(level));
        let seed = self.seed.wrapping_add(level as u64 * CHANNELS_A_LEVEL);
        let origin = above.origin;
        let &Course { cell: id, head, end: End { foot, shore, level_m, mouth, mouth_area } } = course;
        let way = head.from(shore);
        let reach = length(way);
        let from = shore.from(origin);
        let middle = [0, 1].map(|axis| from[axis] + way[axis] / 2.0);
        let brook = 1.5 * reach + 1.5 * cell as f64;
        let is_near = |piece: &&Piece| {
            let reach = piece.reach(brook);
            piece.nearest(middle).1 < reach * reach
        };
        let near: Vec<&Piece> = above.all.iter().filter(is_near).collect();
        // Where it goes, from its foot up.
        let pieces = self.pieces_of(level);
        let straight: Vec<[f64; 2]> = (0..=pieces)
            .map(|step| [0, 1].map(|axis| from[axis] + way[axis] * (step as f64 / pieces as f64)))
            .collect();
        let offsets: Vec<f64> = wander::offsets(seed, id, pieces).iter().map(|share| share * reach).collect();
        let others = courses.iter().filter(|(other, _)| *other != id).map(|(_, line)| *line);
        let around: Vec<Line> = others
            .filter(|line| line.touches(middle, reach))
            .chain(
                near.iter()
                    .map(|piece| Line { from: piece.from, along: piece.along })
                    .filter(|line| line.touches(middle, reach)),
            )
            .collect();
        let wandered = wander::wandered(&straight, &offsets, &around);
        // Where the room was misjudged between two knots, the straight course is still there.
        let crosses = |line: &Line| around.iter().any(|other| other.crosses(line));
        let places = if lines(&wandered, 1).iter().any(crosses) { straight } else { wandered };
        // The bed, from the mouth up.
        let uplift = fields.uplift(head);
        let hill_slope = fields.hill_slope(uplift);
        // Where it comes to the larger valley, hillsides may be gentler.
        let gentlest = fields.hill_slope(fields.uplift(shore)).min(hill_slope);
        let side_slope = INCISION * gentlest * fields.metres_a_grain();
        let area_end = most_area(level);
        let area = |share: f64| area_end * (1.0 - 0.75 * share);
        let coast_m = self.below_coast_m(places.iter().rev().map(|place| origin.moved(*place)));
        let mut knots = vec![Knot { at: shore, level_m, area: area_end, lake: 0.0 }];
        for step in 1..=pieces {
            let share = step as f64 / pieces as f64;
            let [before, here] = [places[step - 1], places[step]];
            let step_m = length([here[0] - before[0], here[1] - before[1]]) * fields.metres_a_grain();
            let rise_m = step_m * fields.river_slope(uplift, area(share - 0.5 / pieces as f64));
            let below_m = knots[step - 1].level_m;
            let free_m = below_m + rise_m;
            let lower = near.iter().filter(|piece| piece.lowest_m() < free_m);
            let ground_m = lower.map(|piece| piece.side_m(here, side_slope)).fold(free_m, f64::min);
            // Across a lake or the floor of a larger valley it rises no more than that does, but always a little.
            let least_m = below_m + rise_m.min(step_m * LEAST_SLOPE);
            let ground_m = ground_m.min(coast_m[pieces - step]);
            knots.push(Knot { at: origin.moved(here), level_m: ground_m.max(least_m), area: area(share), lake: 0.0 });
        }
        knots.reverse();
        if foot != shore {
            let drowned_m = shore.distance(foot) * fields.metres_a_grain() * DROWNED_SLOPE;
            knots.push(Knot { at: foot, level_m: level_m - drowned_m, area: area_end, lake: 0.0 });
        }
        let channel = Channel::new((level, id.0, id.1), knots, mouth, hill_slope);
        Channel { mouth_area: channel.mouth_area.max(mouth_area), ..channel }
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

heap_bytes!(Draft);

/// Where a tributary begins and where it ends.
#[derive(Debug)]
struct Course {
    cell: NodeId,
    head: Point,
    end: End,
}

heap_bytes!(Course);

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
    fn line(&self, head: Point, origin: Point) -> Line {
        Line { from: self.foot.from(origin), along: head.from(self.foot) }
    }
}

/// The cells of a chunk.
fn cells((level, x, y): ChannelId) -> impl Iterator<Item = NodeId> {
    let side = chunk_cells(level);
    (0..side * side).map(move |n| (x * side + n % side, y * side + n / side))
}

/// Whether two trunks that share a node cross, or run side by side for long.
fn too_close(trunk: &[Knot], other: &[Knot], joint: Point) -> bool {
    const STEP: usize = 2;
    // Of the way from the node, at least, and as much of the trunk's length from it on.
    const APART: f64 = 0.1;
    const FROM: f64 = 0.25;
    let places = |knots: &[Knot]| knots.iter().map(|knot| knot.at.from(joint)).collect::<Vec<_>>();
    let (trunk, other) = (places(trunk), places(other));
    let (trunk_lines, other_lines) = (lines(&trunk, STEP), lines(&other, STEP));
    let crosses = |line: &Line| other_lines.iter().any(|other| line.crosses(other));
    let whole = length(trunk[0]).max(length(trunk[trunk.len() - 1]));
    let beside = |place: &[f64; 2]| {
        let way = length(*place);
        way > FROM * whole && other_lines.iter().any(|line| line.distance(*place) < APART * way)
    };
    trunk_lines.iter().any(crosses) || trunk.iter().step_by(STEP).any(beside)
}

/// The lines from each `step`th place to the next.
fn lines(places: &[[f64; 2]], step: usize) -> Vec<Line> {
    let places: Vec<[f64; 2]> = places.iter().step_by(step).copied().collect();
    places
        .windows(2)
        .map(|pair| Line { from: pair[0], along: [pair[1][0] - pair[0][0], pair[1][1] - pair[0][1]] })
        .collect()
}

/// The area at the mouth of a tributary of a level, in cells of the trunk lattice.
pub fn most_area(level: u32) -> f64 {
    0.25f64.powi(level as i32)
}

/// The place some grains downstream of a place, at most the end of the channel or of the known pieces.
fn downstream<'a>(pieces: &'a [Piece], mut piece: &'a Piece, mut t: f64, mut grains: f64) -> (&'a Piece, f64) {
    loop {
        let whole = length(piece.along);
        let left = (1.0 - t) * whole;
        if grains <= left {
            return (piece, t + grains / whole);
        }
        grains -= left;
        let follows = |next: &&Piece| next.knot == piece.knot + 1 && next.channel == piece.channel;
        match pieces.iter().find(follows) {
            Some(next) => (piece, t) = (next, 0.0),
            None => return (piece, 1.0),
        }
    }
}

impl Channel {
    fn new(id: ChannelId, knots: Vec<Knot>, mouth: Mouth, hill_slope: f64) -> Channel {
        let (bounds, mouth_area) = (bounds(&knots), knots[knots.len() - 1].area);
        Channel { id, knots, mouth, hill_slope, mouth_area, next: None, bounds }
    }

    /// The corners of the rectangle around its knots.
    pub fn bounds(&self) -> [Point; 2] {
        self.bounds
    }
}

/// The corners of the least rectangle around some knots.
fn bounds(knots: &[Knot]) -> [Point; 2] {
    let mut bounds = [knots[0].at; 2];
    for Knot { at, .. } in knots {
        bounds[0] = Point { x: bounds[0].x.min(at.x), y: bounds[0].y.min(at.y) };
        bounds[1] = Point { x: bounds[1].x.max(at.x), y: bounds[1].y.max(at.y) };
    }
    bounds
}
