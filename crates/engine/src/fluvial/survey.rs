//! The survey: fluvial land as planners of settlements and roads know it, with sparse heights and waters, and rivers as
//! lines.
//!
//! The same kernel that fills tiles fills every `step`th vertex, at the cost of these nodes alone. Heights are those of
//! a tile except for rounding, for breaches that are cut through a tile's hollows, and for gullies, which sparse nodes
//! know less well. Results are cached for a while, block by block, which changes nothing but time.

use crate::area::Area;
use crate::clock::Clock;
use crate::fluvial::Fluvial;
use crate::fluvial::detail::{Detail, SLOPE_STEP};
use crate::fluvial::network::ShownChannels;
use crate::fluvial::segment::{Reach, Segments};
use crate::geometry::lerp;
use crate::grain_point::{self, GRAINS, Point, overlap};
use crate::land::WaterKind;
use crate::lines::FIXED;
use crate::memory::{Memory, Remembers, heap_bytes};
use crate::stop::Stopped;

/// Sides in nodes of a block of sparse land, and of a block with gullies, which is made with a margin around it.
const BLOCK: i64 = 16;
const GULLY_BLOCK: i64 = 32;

/// Sides in vertices of the squares for which channels are gathered at a time, with and without dry brooks. Without dry
/// brooks there are fewer channels, which matter at larger distances.
const PAGE: i64 = 256;
const WET_PAGE: i64 = 512;

/// Largest distance in vertices between points of a river's line: fine enough to follow the bends of the world.
const RIVER_VERTICES: f64 = 3.0;

/// Largest distance by which the world bends a piece of a channel aside, as a share of the piece's length.
const BENDS: f64 = 2.0;

/// Lines are counted in parts of a vertex that are exactly as fine as grains.
const _: () = assert!(FIXED == GRAINS);

/// The resolution at which land is surveyed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Sampling {
    /// Distance between nodes in vertices, a power of two.
    pub step: i64,
    /// True if brooks that hold no water are known; otherwise only their mean effect on the land is. Most channels are
    /// such brooks, so the survey takes a fraction of the time without them.
    pub dry_brooks: bool,
}

impl Sampling {
    /// Creates the sampling that knows all there is at nodes `step` vertices apart.
    pub const fn whole(step: i64) -> Sampling {
        Sampling { step, dry_brooks: true }
    }

    /// Tells whether gullies are known.
    fn has_gullies(self) -> bool {
        self.dry_brooks && self.step <= MOST_GULLY_STEP
    }

    /// Returns the side of a block in nodes.
    fn block(self) -> i64 {
        if self.has_gullies() { GULLY_BLOCK } else { BLOCK }
    }
}

/// The knowledge about the land before anything is planned on it.
///
/// All answers must be pure functions of the place and the sampling: with the same sampling, a vertex has the same
/// height and water in every answer, and a piece of a river is the same in every area that it touches. With longer
/// steps the land may be known less finely.
pub trait Survey: Sync {
    /// Returns the height in metres of the bare land at the vertices `(x0 + i * step, y0 + j * step)`, row by row,
    /// `cols` x `rows`.
    fn heights_m(&self, x0: i64, y0: i64, sampling: Sampling, cols: usize, rows: usize) -> Vec<f32>;

    /// Returns the kind of water on the land at the same vertices, in the same order. A river counts where it is wide
    /// enough for a vertex to lie in it.
    fn waters(&self, x0: i64, y0: i64, sampling: Sampling, cols: usize, rows: usize) -> Vec<WaterKind>;

    /// Returns all pieces of rivers whose middle line touches `area`, in any order.
    fn rivers(&self, area: &Area) -> Vec<RiverPiece>;

    /// Returns the share of the people who would live around a vertex in a mild climate that live there in its own, from
    /// 0 to 1.
    fn habitability(&self, _: [i64; 2]) -> f64 {
        1.0
    }
}

/// A survey, and the clock of the work that asks it.
#[derive(Clone, Copy)]
pub struct Surveyed<'a> {
    /// The survey.
    pub survey: &'a dyn Survey,
    /// The clock, which stops the work.
    pub clock: &'a Clock,
}

/// A straight piece of a river's middle line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RiverPiece {
    /// Upstream end in 1/256 vertex.
    pub from: [i64; 2],
    /// Downstream end in 1/256 vertex.
    pub to: [i64; 2],
    /// Width in metres.
    pub width_m: f32,
    /// Heights in metres of the water's surface, at both ends.
    pub level_m: [f32; 2],
}

heap_bytes!(RiverPiece);

impl RiverPiece {
    /// Returns the key by which pieces are sorted, so that the order in which a survey lists them does not matter.
    pub(crate) fn key(&self) -> ([i64; 2], [i64; 2], u32, [u32; 2]) {
        (self.from, self.to, self.width_m.to_bits(), self.level_m.map(f32::to_bits))
    }
}

/// Largest distance between nodes, in vertices, at which the survey knows of gullies.
pub(super) const MOST_GULLY_STEP: i64 = 4;

/// Distance within which the survey knows channels, in cells of the finest level that it knows. It is shorter than for
/// tiles, because all that lies around the planned land is made for the survey alone. With 3 cells, 2 in 100 vertices
/// differ from the tiles by a centimetre or more, with 4 less than 1 in 1000. Without dry brooks this
/// hardly matters.
const BROOK_CELLS: i64 = 4;
const WET_CELLS: i64 = 3;

/// The caches of a survey.
#[derive(Debug)]
pub(super) struct Memories {
    /// Blocks, by sampling and first node.
    blocks: Memory<(Sampling, [i64; 2]), SurveyBlock>,
    /// Channels around pages, by whether dry brooks are among them, and first vertex.
    pages: Memory<(bool, [i64; 2]), Segments>,
}

impl Default for Memories {
    fn default() -> Memories {
        // A page takes up to a megabyte, and only the few blocks on it ask for it, one soon after the other.
        Memories { blocks: Memory::new(4 << 20), pages: Memory::new(16 << 20) }
    }
}

impl Memories {
    /// Returns the caches.
    pub fn memories(&self) -> Vec<&dyn Remembers> {
        vec![&self.blocks, &self.pages]
    }
}

/// The land on the nodes of a block.
#[derive(Debug)]
struct SurveyBlock {
    heights_m: Vec<f32>,
    waters: Vec<WaterKind>,
}

heap_bytes!(SurveyBlock: heights_m, waters);

/// Metres into the sea from the shore of the lowstand, from which on nobody lives. It is much more than the side of a
/// site cell, so no cell with land is empty for it; and where no site can be, no floor of the sea is made to look for it.
const OPEN_SEA_M: f64 = 40e3;

impl Survey for Fluvial {
    fn habitability(&self, [x, y]: [i64; 2]) -> f64 {
        let (at, Some(geography)) = (Point::at_vertex(x, y), self.fields.geography()) else { return 1.0 };
        if self.fields.inland_m(at) < -OPEN_SEA_M {
            return 0.0;
        }
        geography.settings_at(&[at])[0].habitability()
    }

    fn heights_m(&self, x0: i64, y0: i64, sampling: Sampling, cols: usize, rows: usize) -> Vec<f32> {
        self.sampled([x0, y0], sampling, (cols, rows), 0.0, |block| &block.heights_m)
    }

    fn waters(&self, x0: i64, y0: i64, sampling: Sampling, cols: usize, rows: usize) -> Vec<WaterKind> {
        self.sampled([x0, y0], sampling, (cols, rows), WaterKind::Dry, |block| &block.waters)
    }

    fn rivers(&self, area: &Area) -> Vec<RiverPiece> {
        let fields = self.fields();
        // All that the warp may move into the area, and a vertex more for rounding.
        let rectangle = self.warp.input(area.padded(1), 1);
        let levels = self.wet_levels();
        let origin = Point::at_vertex(area.x0, area.y0);
        let shown = ShownChannels::whole(levels);
        let segments = |clock: &_| self.network().segments(shown, rectangle, origin, Reach::even(0.0), clock);
        let pieces = Clock::unstopped(segments);
        let asked = [Point::at_vertex(area.x0, area.y0), Point::at_vertex(area.x1, area.y1)];
        let mut rivers = Vec::new();
        // The end of the last piece, in the network and in the world.
        let mut world = self.warp.points();
        let mut last = (origin, world.undo(origin));
        for piece in &pieces.all {
            if !fields.holds_water(lerp(piece.discharge_m3s, 1.0)) {
                continue;
            }
            let start = pieces.channels[piece.channel as usize].knots[piece.knot as usize].at;
            let end = start.moved(piece.along);
            // Most pieces begin where the one before has ended.
            let first = if last.0 == start { last.1 } else { world.undo(start) };
            last = (end, world.undo(end));
            // Few pieces come to the area that is asked about. The rest lie in the margin from which others may be bent
            // into the area.
            let aside = BENDS * piece.along.length() + GRAINS as f64;
            let around = grain_point::around([first, last.1], aside).expect("there are two");
            if !overlap(around, asked) {
                continue;
            }
            let parts = (piece.along.length() / (RIVER_VERTICES * GRAINS as f64)).ceil().max(1.0) as usize;
            let mut end = |part: usize| {
                let share = part as f64 / parts as f64;
                let at = match part {
                    0 => first,
                    _ if part == parts => last.1,
                    _ => world.undo_from(start.moved(piece.along * share), first.towards(last.1, share)),
                };
                [at.x, at.y]
            };
            let mut from = end(0);
            for part in 0..parts {
                let to = end(part + 1);
                let middle = (part as f64 + 0.5) / parts as f64;
                let level_m = lerp(piece.level_m, middle);
                let touches = |axis: usize, first: i64, past: i64| {
                    from[axis].min(to[axis]) < past * FIXED && from[axis].max(to[axis]) >= first * FIXED
                };
                if touches(0, area.x0, area.x1)
                    && touches(1, area.y0, area.y1)
                    && from != to
                    && fields.holds_water(lerp(piece.discharge_m3s, middle))
                    && !fields.is_drowned(start.moved(piece.along * middle), level_m)
                    && level_m >= piece.pool_m
                {
                    rivers.push(RiverPiece {
                        from,
                        to,
                        width_m: (2.0 * lerp(piece.river, middle) * fields.metres_a_grain()) as f32,
                        level_m: [part, part + 1]
                            .map(|end| self.lifted_m(lerp(piece.level_m, end as f64 / parts as f64)) as f32),
                    });
                }
                from = to;
            }
        }
        rivers
    }
}

impl Fluvial {
    /// Returns the values of the blocks under some nodes, row by row.
    fn sampled<T: Copy>(
        &self,
        first: [i64; 2],
        sampling: Sampling,
        (cols, rows): (usize, usize),
        value: T,
        of: impl Fn(&SurveyBlock) -> &[T],
    ) -> Vec<T> {
        let Sampling { step, .. } = sampling;
        assert!(step > 0 && step & (step - 1) == 0, "{step} vertices between nodes is no power of two");
        assert!(first.iter().all(|at| at % step == 0), "{first:?} is not a node of every {step} vertices");
        let [x0, y0] = first.map(|at| at / step);
        let nodes = Area::new(x0, y0, cols, rows);
        let mut values = vec![value; nodes.len()];
        let side = sampling.block();
        for part in nodes.squares(side as usize) {
            let own = part.on_grid(side);
            // A block takes little time, so planners look at their clock from block to block.
            let block = || Clock::unstopped(|clock| self.block(sampling, own, clock));
            let block = self.survey.blocks.get((sampling, [own.x0, own.y0]), block);
            for y in part.y0..part.y1 {
                let (source, target) = (own.index(part.x0, y), nodes.index(part.x0, y));
                let len = part.width();
                values[target..target + len].copy_from_slice(&of(&block)[source..source + len]);
            }
        }
        values
    }

    /// Returns the number of levels of channels that may hold water.
    fn wet_levels(&self) -> u32 {
        (0..self.fields().levels()).take_while(|level| self.may_have_rivers(*level)).count() as u32
    }

    /// Returns the detail in which land is surveyed.
    fn surveyed(&self, sampling: Sampling) -> Detail {
        let Sampling { step, dry_brooks } = sampling;
        let levels = if dry_brooks { self.fields().levels() } else { self.wet_levels() };
        let channels = ShownChannels::whole(levels);
        let brook_cells = if dry_brooks { BROOK_CELLS } else { WET_CELLS };
        Detail {
            step,
            slope_step: SLOPE_STEP.max(step),
            channels,
            brook_cells,
            gullies: sampling.has_gullies(),
            breaches: false,
            ..self.detail
        }
    }

    fn block(&self, sampling: Sampling, area: Area, clock: &Clock) -> Result<SurveyBlock, Stopped> {
        let Sampling { step, dry_brooks } = sampling;
        let detail = self.surveyed(sampling);
        // Only channels in this area can reach the block's nodes; a page has many others.
        let around = self.around(area, detail);
        let page_side = if dry_brooks { PAGE } else { WET_PAGE };
        let segments = if sampling.block() * step <= page_side {
            let page = Area::new(area.x0 * step, area.y0 * step, 1, 1).on_grid(page_side);
            let whole = self.surveyed(Sampling { step: 1, dry_brooks });
            let around_page = self.around(page, whole);
            let pieces = || self.segments(around_page, whole, clock);
            let pieces = self.survey.pages.try_get((dry_brooks, [page.x0, page.y0]), pieces)?;
            pieces.near(self.warp.input(around, step), self.reach(detail))
        } else {
            self.segments(around, detail, clock)?
        };
        let land = self.land_of(&segments, area, detail, clock)?;
        let kinds = land.water.expect("fluvial land knows its water").kind;
        Ok(SurveyBlock { heights_m: land.heights.values().to_vec(), waters: kinds.values().to_vec() })
    }
}
