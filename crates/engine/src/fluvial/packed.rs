//! Valleys, gullies and coasts as words: what a kernel needs that makes them, `shaders/fluvial.wgsl`.
//!
//! It runs once a node, in the patches in which lanes do it here, with the names of the functions here. What takes more bits than it
//! has, where a segment lies seen from a block of patches, is computed here.

use super::coast::PackedCoast;
use super::gullies::Gullies;
use super::point::{GRAINS, Point};
use super::rest::Rest;
use super::segment::Segments;
use super::settings::FluvialSettings;
use super::valley::{Hillsides, PATCH, Valleys};
use super::valley_side::Columns;
use super::warp::Displaced;
use super::{Carved, Detail, Fluvial, valley, valley_side};
use crate::area::Area;
use crate::clock::{Clock, stage};
use crate::land::Land;
use crate::noise::packed::put;
use crate::noise::{Fractal, Stripes};

pub(crate) use super::gullies::{MOST_OCTAVES, SMOOTHED};

/// Nodes a side of a block of patches, from whose corner places are told.
pub(crate) const BLOCK: i64 = valley::BLOCK as i64 * PATCH as i64;

/// What a kernel computes of land: all that is the same wherever that is.
pub(crate) struct FluvialKernel<'a> {
    fluvial: &'a Fluvial,
    detail: Detail,
    gullies: Option<&'a Gullies>,
}

/// Some land that a kernel is asked for.
pub(crate) struct FluvialJob {
    area: Area,
    segments: Segments,
    /// The nodes that it is made of, and those of them whose valleys are.
    pub nodes: Area,
    pub part: Area,
    hillsides: Hillsides,
}

/// What a kernel has made of it, at each node.
pub(crate) struct FluvialPlanes {
    pub metres: [Vec<f32>; 2],
    pub height_m: Vec<f32>,
    pub crest_m: Vec<f32>,
    pub distance_m: Vec<f32>,
    pub share: Vec<f32>,
    pub segment: Vec<u32>,
    /// The height of the coast, of a world with a sea.
    pub coast_m: Option<Vec<f32>>,
}

impl FluvialJob {
    /// Whether brooks are not seen, but what they make of the land in the mean.
    pub fn has_rest(&self) -> bool {
        self.hillsides.rest.is_some()
    }
}

impl Fluvial {
    /// What a kernel computes of this land.
    pub(crate) fn kernel(&self) -> FluvialKernel<'_> {
        let detail = self.detail();
        FluvialKernel { fluvial: self, detail, gullies: self.gullies(detail) }
    }
}

impl FluvialKernel<'_> {
    /// Displacements east and south, and metres that they are multiplied by; `None` where there are none.
    pub fn warp(&self) -> Option<(&[Fractal; 2], f32)> {
        self.fluvial.warp.fractals(self.detail.step)
    }

    /// The stripes of each octave of gullies, and the noise of those that are patchy.
    pub fn octaves(&self) -> impl Iterator<Item = (&Stripes, Option<&Fractal>)> {
        self.gullies.into_iter().flat_map(Gullies::octaves)
    }

    /// The noise of the ground; `None` where there are no gullies.
    pub fn roughness(&self) -> Option<&Fractal> {
        self.gullies.map(Gullies::roughness)
    }

    /// Adds the numbers that are the same for all nodes.
    pub fn pack(&self, words: &mut Vec<u32>) {
        let Fluvial { fields, .. } = self.fluvial;
        let FluvialSettings { crest_m, .. } = fields.settings();
        let read_m = self.fluvial.crest_read_m(self.gullies);
        put(words, [valley::spacing_m(fields, self.detail.step), *crest_m as f32, read_m]);
        valley_side::pack_floor(valley::floor(fields), words);
        Stripes::pack_wave(words);
        if let Some(gullies) = self.gullies {
            gullies.pack(words);
        }
    }

    /// The land of an area, given what makes that of its nodes, or of finer ones whose mean it is.
    pub fn land_by(&self, area: Area, whole: impl Fn(Area) -> Land) -> Land {
        self.fluvial.land_by(area, whole)
    }

    /// What is known of an area before any node is, with the time of each stage booked on `clock`.
    pub fn job(&self, area: Area, clock: &Clock) -> FluvialJob {
        let (fluvial, detail) = (self.fluvial, self.detail);
        let nodes = fluvial.around(area, detail);
        let segments = clock.time(stage::NETWORK, || fluvial.segments(nodes, detail));
        let part = fluvial.around_valleys(area, detail);
        FluvialJob { area, segments, nodes, part, hillsides: fluvial.hillsides(nodes, detail) }
    }

    /// Adds the words of a job: how steep the hills are at each node, and where brooks are not seen the two numbers of [`Rest`]; then
    /// of each segment its [`Columns`]; then for each block of patches of the part how many segments may come to it, and of each its
    /// number and where it begins in metres from the block's corner. Returns where segments and blocks begin, from `words` on.
    pub fn pack_job(&self, job: &FluvialJob, words: &mut Vec<u32>) -> [usize; 2] {
        let Fluvial { fields, warp, .. } = self.fluvial;
        let (step, metres, begin) = (self.detail.step, fields.metres_a_grain(), words.len());
        put(words, job.hillsides.slope.iter().copied());
        if let Some(Rest { slope, height_m }) = &job.hillsides.rest {
            put(words, slope.iter().chain(height_m).copied());
        }
        let segments_at = words.len() - begin;
        let mut columns = Columns::default();
        for (number, segment) in job.segments.all.iter().enumerate() {
            columns.push(fields, segment, number as u32, job.hillsides.reach);
        }
        (0..columns.number.len()).for_each(|index| columns.pack(index, words));
        let blocks = blocks(job.part);
        let blocks_at = words.len() - begin;
        let table = words.len();
        words.resize(table + 2 * blocks.len(), 0);
        // From the middle of a block, in grains, to its furthest node once that is displaced; and a node more, for what is rounded.
        let half = (BLOCK * step * GRAINS) as f64 / 2.0;
        let most = warp.most_m().map(|most_m| half + most_m / metres + (step * GRAINS) as f64);
        let around = most[0].hypot(most[1]);
        for (number, (x, y)) in blocks.vertices().enumerate() {
            let corner = Point::at_vertex(x * BLOCK * step, y * BLOCK * step).from(job.segments.origin);
            let middle = corner.map(|at| at + half);
            let first = words.len();
            for (number, segment) in job.segments.all.iter().enumerate() {
                let (_, square) = segment.nearest(middle);
                let within = segment.reach(job.hillsides.reach) + around;
                if square <= within * within {
                    words.push(number as u32);
                    put(words, [0, 1].map(|axis| ((segment.from[axis] - corner[axis]) * metres) as f32));
                }
            }
            words[table + 2 * number] = (first - begin) as u32;
            words[table + 2 * number + 1] = ((words.len() - first) / 3) as u32;
        }
        [segments_at, blocks_at]
    }

    /// Whether there is a sea, and so a coast.
    pub fn has_sea(&self) -> bool {
        self.fluvial.fields.has_sea()
    }

    /// Adds how far inland the points of the coast's lattice around a job are; returns what a kernel asks of it, but for where it begins:
    /// its columns, cells before that of the first node along each axis, vertices from that cell's corner to the node, vertices from
    /// a node to the next and those of a cell; and then seven floats.
    pub fn pack_coast(&self, job: &FluvialJob, words: &mut Vec<u32>) -> Vec<u32> {
        let Fluvial { fields, warp, spacing_m, is_far, .. } = self.fluvial;
        let step = self.detail.step;
        let most = warp.most_m().map(|most_m| most_m / spacing_m);
        let coast = PackedCoast::new(fields, *is_far, job.nodes, step, most);
        put(words, coast.inland_m);
        let whole = [coast.columns as i64].into_iter().chain(coast.before).chain(coast.in_cell);
        let mut numbers: Vec<u32> = whole.chain([step, coast.coarse]).map(|number| number as u32).collect();
        put(&mut numbers, [(1.0 / spacing_m) as f32]);
        put(&mut numbers, fields.coast_numbers());
        put(&mut numbers, [fields.shore_m(), fields.sea_level_m() as f32]);
        numbers
    }

    /// The land of a job, all of it made here.
    pub fn land_of_cpu(&self, job: &FluvialJob, clock: &Clock) -> Land {
        self.fluvial.land_of(&job.segments, job.area, self.detail, clock)
    }

    /// The land of a job, given what a kernel has made of it, with the time of each stage booked on `clock`.
    pub fn land(&self, job: FluvialJob, planes: FluvialPlanes, clock: &Clock) -> Land {
        let FluvialPlanes { metres, height_m, crest_m, distance_m, share, segment, coast_m } = planes;
        let nodes = Displaced { area: job.nodes, step: self.detail.step, metres };
        // Nothing else is asked for but by gullies.
        let valleys = Valleys { height_m, crest_m, distance_m, segment, share, ..Valleys::default() };
        let carved = Carved { nodes, hillsides: job.hillsides, valleys, coast_m };
        self.fluvial.fill_in(&job.segments, job.area, self.detail, carved, clock)
    }
}

/// The blocks of patches that an area of nodes lies in, by column and row.
pub(crate) fn blocks(area: Area) -> Area {
    let last = |past: i64| (past - 1).div_euclid(BLOCK) + 1;
    Area { x0: area.x0.div_euclid(BLOCK), y0: area.y0.div_euclid(BLOCK), x1: last(area.x1), y1: last(area.y1) }
}
