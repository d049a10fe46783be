//! Fluvial relief: land that water made. Rivers first, relief second.
//!
//! ```text
//! potential, uplift (fields) --> trunks: a coarse lattice that drains over its passes to sinks and the sea
//!                                   |
//!                                   v
//!                     network: level by level, tributaries that join the nearest channel
//!                                   |
//!                                   v      plane warped, so that no line is straight
//!                     valleys: the lowest valley side at each vertex
//!                                   |
//!                                   v
//!                     gullies, moraines, barriers, glaciers, coast, breaches, strata, ceiling, beds
//!                                   |
//!                                   v
//!                     Land: heights and water
//! ```
//!
//! Everything is a pure function of the seed and of lattice ids. A vertex depends on the segments of channels whose
//! [reach](segment::Segment::reach) holds it, a channel on channels of coarser levels within a few cells, and a trunk
//! on its whole basin, which is flooded and cached. The function `input` beside each stage returns the area that the
//! stage reads to make an area.
//!
//! The modules, in the order of that diagram: `point_noise`, `potential`, `fields` and `strata_and_ceiling` hold the
//! laws. `trunk_lattice` is the lattice of the largest rivers; `trunk_curve`, `meander`, `delta` and `trunk_course` make
//! their lines, `lake` their lakes, and `branches` their oxbows and side arms. `tributary_course` and `tributary` make
//! all other channels, and `network` finds channels and their `segment`s by place. `warp`, `valley`, `valley_side`,
//! `gullies`, the `stamp`s (`moraine`, `barrier` and `glacier`), `coast`, `skerries`, `breach` and `water` make rasters
//! of them. `rivers` and `strahler` know whole rivers, and `survey` measures the land for planning roads. At coarse
//! strides, `brook_relief` is the mean relief of brooks too fine to show, and `node_means` averages finer nodes where
//! even trunks are too fine.

pub mod settings;
pub mod grain_point;
mod point_noise;
mod potential;
pub mod fields;
mod strata_and_ceiling;
mod course_offsets;
mod meander;
pub mod trunk_lattice;
pub mod channel;
pub mod segment;
mod segments_above;
mod barrier;
mod lake;
mod trunk_curve;
mod delta;
mod trunk_course;
mod tributary_course;
mod tributary;
mod branches;
pub mod network;
mod warp;
mod brook_relief;
mod valley_side;
mod valley;
mod gullies;
mod stamp;
mod moraine;
mod glacier;
mod coast;
mod skerries;
mod breach;
mod water;
mod node_means;
pub mod rivers;
mod strahler;
pub mod survey;
pub mod landforms;

use std::sync::Arc;

use crate::area::{Area, Stride};
use crate::clock::{Clock, stage};
use crate::hash::{self, Stream};
use crate::land::Land;
use crate::memory::Remembers;
use crate::names::Names;
use crate::simd::dispatch;
use barrier::Barriers;
use brook_relief::{Rest, RestLaw};
use fields::{DEEPEST_RIVER_M, Fields};
use glacier::Glaciers;
use grain_point::{GRAINS, Point};
use gullies::Gullies;
use moraine::Moraines;
use network::{Network, ShownChannels};
use node_means::Means;
use rivers::RiverMemories;
use segment::{Reach, Segments};
use settings::FluvialSettings;
use skerries::{AreaSkerries, Skerries};
use strata_and_ceiling::Lift;
use valley::{FillValleys, Hillsides, Valleys};
use warp::{Displaced, Warp};
use water::{FillWater, LAKE_DEPTH, ShownRivers};

/// The relief of a world, made by water.
#[derive(Debug)]
pub struct Fluvial {
    spacing_m: f64,
    /// Vertices from one node of this land to the next.
    stride: i64,
    /// True if nodes are further apart than the cells of the trunk lattice are wide: each node is then the mean of many
    /// finer ones.
    is_far: bool,
    /// True for a sketch: a picture that must appear soon and is replaced shortly after.
    is_sketch: bool,
    /// The fields, network and warp are the same at every stride. Land at other strides shares them, and with them
    /// their caches.
    fields: Arc<Fields>,
    network: Arc<Network>,
    warp: Arc<Warp>,
    /// Gullies of these nodes, then those of every second node, every fourth, and so on, for surveys.
    gullies: Vec<Gullies>,
    skerries: Option<Skerries>,
    moraines: Option<Moraines>,
    barriers: Option<Barriers>,
    glaciers: Option<Glaciers>,
    lift: Lift,
    rivers: RiverMemories,
    names: Option<Names>,
    survey: survey::Memories,
}

/// The level of detail at which land is made.
#[derive(Clone, Copy, Debug)]
struct Detail {
    /// Vertices from one node to the next, a power of two.
    step: i64,
    /// Vertices from one sample of the slope of the hills to the next, a power of two.
    slope_step: i64,
    /// The channels that are made one by one. Finer ones enter the land as a mean only.
    channels: ShownChannels,
    /// Search radius for brooks, in cells of the finest shown level.
    brook_cells: i64,
    /// True if gullies are carved.
    gullies: bool,
    /// True if breaches are cut. A breach is one vertex wide, and needs a wide pad.
    breaches: bool,
}

/// Land with valleys and gullies only, before any other stage.
#[derive(Debug)]
struct Carved {
    nodes: Displaced,
    hillsides: Hillsides,
    valleys: Valleys,
}

/// Least width, in nodes, of the cells of a level whose channels are shown. Channels of finer levels enter as a mean
/// only.
const LEAST_CELL: i64 = 12;

/// Side, in nodes, of the square whose area is the smallest catchment of a river that is shown. A smaller square would
/// fill the land with rivers.
const LEAST_RIVER_CELL: i64 = 24;

/// Least width in nodes of a trunk cell at which trunks are drawn with bends, and at which they are drawn at all. Where
/// nodes are further apart, finer nodes are made and averaged.
const LEAST_BENT_CELL: i64 = 8;
const LEAST_TRUNK_CELL: i64 = 3;

/// The same least width at which trunks are drawn at all, in a sketch: they show, if not well.
const LEAST_SKETCHED_CELL: i64 = 2;

/// Least distance in nodes between the knots of a channel, where not all levels are shown; and in a sketch.
const LEAST_PIECE: i64 = 2;
const LEAST_SKETCHED_PIECE: i64 = 4;

/// Largest distance in metres between nodes at which moraines, barriers and skerries show; and glaciers.
const SMALL_M: f64 = 40.0;
const LARGE_M: f64 = 320.0;

/// Vertices between samples of the slope of the hills: uplift varies over kilometres only. And nodes between samples,
/// where each node is the mean of whole trunk cells: a cell then holds at least two samples a side.
const SLOPE_STEP: i64 = 32;
const FAR_SLOPE_STEP: i64 = 2;

impl Fluvial {
    /// Makes the relief of checked settings, at every vertex.
    #[cfg(test)]
    pub(crate) fn new(
        settings: &FluvialSettings,
        spacing_m: f64,
        sea_level_m: Option<f64>,
        seed: u64,
        names: Option<Names>,
    ) -> Fluvial {
        Fluvial::strided(settings, (spacing_m, Stride::ONE), sea_level_m, seed, names)
    }

    /// Makes the relief of checked settings at the nodes of a stride, from the metres between vertices. Its rivers take
    /// their names from `names`.
    pub(crate) fn strided(
        settings: &FluvialSettings,
        (spacing_m, strided): (f64, Stride),
        sea_level_m: Option<f64>,
        seed: u64,
        names: Option<Names>,
    ) -> Fluvial {
        let fields = Arc::new(Fields::new(settings, spacing_m, sea_level_m, seed));
        let is_far = Fluvial::sees_no_cells(&fields, strided);
        let network = Arc::new(Network::new(Arc::clone(&fields), is_far, hash::stream(seed, Stream::Network)));
        let warp = Arc::new(Warp::new(&fields, spacing_m, seed));
        Fluvial::grown((fields, network, warp), (spacing_m, strided), sea_level_m, seed, names)
    }

    /// Returns the same relief at the nodes of another stride. `seed` and `sea_level_m` must be those of this relief.
    pub(crate) fn at_stride(&self, strided: Stride, sea_level_m: Option<f64>, seed: u64) -> Fluvial {
        let fields = Arc::clone(&self.fields);
        let is_far = Fluvial::sees_no_cells(&fields, strided);
        // Only the precision with which trunks end at the shore differs between the two networks.
        let network = if is_far == self.is_far || !fields.has_sea() {
            Arc::clone(&self.network)
        } else {
            Arc::new(Network::new(Arc::clone(&fields), is_far, hash::stream(seed, Stream::Network)))
        };
        let shared = (fields, network, Arc::clone(&self.warp));
        Fluvial::grown(shared, (self.spacing_m, strided), sea_level_m, seed, self.names.clone())
    }

    /// Returns the same relief as a sketch: coarser than its nodes could show, in half the time.
    pub(crate) fn sketched(self) -> Fluvial {
        Fluvial { is_sketch: true, ..self }
    }

    /// Tells whether the nodes of a stride are further apart than the trunk cells are wide.
    fn sees_no_cells(fields: &Fields, strided: Stride) -> bool {
        fields.side(0) < strided.vertices() * GRAINS
    }

    /// Puts together the relief at the nodes of a stride from the parts that all strides share.
    fn grown(
        (fields, network, warp): (Arc<Fields>, Arc<Network>, Arc<Warp>),
        (spacing_m, strided): (f64, Stride),
        sea_level_m: Option<f64>,
        seed: u64,
        names: Option<Names>,
    ) -> Fluvial {
        let stride = strided.vertices();
        let node_m = spacing_m * stride as f64;
        let steps = std::iter::successors(Some(strided), |step| Stride::new(2 * step.vertices() as u64));
        let steps = steps.take_while(|step| step.vertices() <= stride.max(survey::MOST_GULLY_STEP));
        let gullies = steps.filter_map(|step| Gullies::new(&fields, (spacing_m, step), seed));
        let shows = |most_m: f64| stride == 1 || node_m <= most_m;
        Fluvial {
            spacing_m,
            stride,
            is_far: Fluvial::sees_no_cells(&fields, strided),
            is_sketch: false,
            network,
            warp,
            gullies: gullies.collect(),
            skerries: Skerries::new(&fields, seed).filter(|_| shows(SMALL_M)),
            moraines: Moraines::new(&fields, spacing_m, seed).filter(|_| shows(SMALL_M)),
            barriers: Barriers::new(&fields, spacing_m, seed).filter(|_| shows(SMALL_M)),
            glaciers: Glaciers::new(&fields, seed).filter(|_| shows(LARGE_M)),
            lift: Lift::new(fields.settings(), sea_level_m, seed),
            rivers: RiverMemories::default(),
            names,
            survey: survey::Memories::default(),
            fields,
        }
    }

    /// Returns the caches of this relief.
    pub(crate) fn memories(&self) -> Vec<&dyn Remembers> {
        let all = [self.fields.memories(), self.network.memories(), self.warp.memories()];
        [all.concat(), self.rivers.memories(), self.survey.memories()].concat()
    }

    /// Returns the point of a node.
    pub(crate) fn at_node(&self, x: i64, y: i64) -> Point {
        Point::at_vertex(x * self.stride, y * self.stride)
    }

    /// Distance in metres from one node to the next.
    pub(crate) fn node_m(&self) -> f64 {
        self.spacing_m * self.stride as f64
    }

    /// Returns the fields from which the relief is made.
    pub fn fields(&self) -> &Fields {
        &self.fields
    }

    /// Returns the place in the world of a point of the network: the warp bends the plane on which the network is laid
    /// out.
    pub fn in_world(&self, network: Point) -> Point {
        self.warp.points().undo(network)
    }

    /// Height in metres, after strata and ceiling, of land or water at a level of the network.
    pub fn lifted_m(&self, level_m: f64) -> f64 {
        self.lift.at(level_m)
    }

    /// Returns the network of channels, as it is before the warp.
    pub fn network(&self) -> &Network {
        &self.network
    }

    /// Returns the bounds of all heights: (lowest, highest) in metres.
    ///
    /// Beds lie at most the greatest depth of a river or lake below the lowest water. The sea is shallower below its
    /// lowstand than its settings say, and the ceiling is never reached.
    pub fn range_m(&self) -> (f32, f32) {
        let settings = self.fields.settings();
        let sink_m = self.fields.sink_level_m(false);
        let floor_m = self.fields.lowstand_level_m() - settings.coast.depth_m;
        // The lift keeps the order of heights but lowers some, so the bound is the lifted lowest height.
        let lowest_m = self.lift.at(if self.fields.has_sea() { floor_m.min(sink_m) } else { sink_m });
        // Skerries are added after the ceiling has pressed the land together, so they need their own bound.
        let skerry_m =
            self.skerries.as_ref().map_or(f64::NEG_INFINITY, |_| self.fields.sea_level_m() + skerries::HIGHEST_M);
        let ceiling_m = settings.ceiling_m.max(skerry_m);
        let lake_m = self.fields.lake_half_width() * self.fields.metres_a_grain() * LAKE_DEPTH as f64;
        // One metre more allows for rounding.
        let deepest_m = lake_m.max(DEEPEST_RIVER_M as f64) + 1.0;
        ((lowest_m - deepest_m) as f32, (ceiling_m + 1.0) as f32)
    }

    /// Makes the land at all nodes of an area. `clock` records the time of each stage.
    pub fn land(&self, area: Area, clock: &Clock) -> Land {
        let detail = self.detail();
        let whole = |area| {
            let segments = clock.time(stage::NETWORK, || self.segments(self.around(area, detail), detail));
            self.land_of(&segments, area, detail, clock)
        };
        match self.stride / detail.step {
            1 => whole(area),
            finer => Means::of(area, finer, self.fields.sea_level_m() as f32, whole),
        }
    }

    /// Returns the detail that the nodes of this stride can show.
    fn detail(&self) -> Detail {
        let levels = self.levels();
        let has_all = levels == self.fields.levels();
        let trunk_cell = self.fields.side(0) / GRAINS;
        let is_straight = trunk_cell < LEAST_BENT_CELL * self.stride;
        let steps = std::iter::successors(Some(self.stride), |step| Some(step / 2));
        let (least_cell, least_piece) = match self.is_sketch {
            true => (LEAST_SKETCHED_CELL, LEAST_SKETCHED_PIECE),
            false => (LEAST_TRUNK_CELL, LEAST_PIECE),
        };
        let mut steps = steps.filter(|step| *step == 1 || trunk_cell >= least_cell * step);
        let step = if is_straight { steps.next().unwrap_or(1) } else { self.stride };
        Detail {
            step,
            slope_step: SLOPE_STEP.max(if self.is_far { FAR_SLOPE_STEP * step } else { step }),
            channels: ShownChannels {
                levels,
                least_piece: if has_all { 0.0 } else { (least_piece * self.stride * GRAINS) as f64 },
                are_straight: is_straight,
            },
            brook_cells: valley::BROOK_CELLS,
            gullies: has_all,
            breaches: !self.gullies.is_empty() && self.stride == 1,
        }
    }

    /// The number of levels whose channels are shown. Trunks always are.
    fn levels(&self) -> u32 {
        let is_wide = |level: &u32| self.stride == 1 || self.fields.side(*level) >= LEAST_CELL * self.stride * GRAINS;
        (1..self.fields.levels()).take_while(is_wide).count() as u32 + 1
    }

    /// Catchment of the smallest river that is shown, in cells of the trunk lattice.
    fn least_area(&self) -> f64 {
        let cells = (LEAST_RIVER_CELL * self.stride * GRAINS) as f64 / self.fields.side(0) as f64;
        if self.stride == 1 { 0.0 } else { cells * cells }
    }

    /// Returns the gullies for a detail, if it has gullies.
    fn gullies(&self, detail: Detail) -> Option<&Gullies> {
        let doubled = (detail.step / self.stride).max(1).ilog2();
        self.gullies.get(doubled as usize).filter(|_| detail.gullies)
    }

    /// Returns the nodes whose warp is read to make those of an area.
    fn around(&self, area: Area, detail: Detail) -> Area {
        let carved = Fluvial::carved(area, detail);
        let bare = self.gullies(detail).map_or(carved, |_| gullies::input(carved));
        valley::input(water::input(area).hull(&bare))
    }

    /// Returns the nodes whose valleys are read to make those of an area.
    fn around_valleys(&self, area: Area, detail: Detail) -> Area {
        let carved = Fluvial::carved(area, detail);
        valley::input(self.gullies(detail).map_or(carved, |_| gullies::valley_input(carved)))
    }

    /// Returns the nodes whose carved land is read to make those of an area.
    fn carved(area: Area, detail: Detail) -> Area {
        if detail.breaches { breach::input(area) } else { area }
    }

    /// Makes the land at the nodes of an area. `segments` holds at least the segments of channels around it.
    fn land_of(&self, segments: &Segments, area: Area, detail: Detail, clock: &Clock) -> Land {
        let carved = self.carve(segments, area, detail, clock);
        self.fill_in(segments, area, detail, carved, clock)
    }

    /// Makes valleys around an area of nodes, and carves gullies into their sides.
    fn carve(&self, segments: &Segments, area: Area, detail: Detail, clock: &Clock) -> Carved {
        let nodes = clock.time(stage::WARP, || self.warp.fill(self.around(area, detail), detail.step));
        let hillsides = self.hillsides(nodes.area, detail);
        let gullies = self.gullies(detail);
        let read_m = self.crest_read_m(gullies);
        let part = self.around_valleys(area, detail);
        let mut valleys = clock.time(stage::VALLEYS, || self.valleys(&nodes, part, &hillsides, segments, read_m));
        if let Some(gullies) = gullies {
            clock.time(stage::GULLIES, || gullies.carve(&nodes, &hillsides.slope, &mut valleys));
        }
        Carved { nodes, hillsides, valleys }
    }

    /// Adds the stages after valleys and gullies: moraines, barriers, glaciers, coast, breaches and water.
    fn fill_in(&self, segments: &Segments, area: Area, detail: Detail, carved: Carved, clock: &Clock) -> Land {
        let Carved { nodes, hillsides, mut valleys } = carved;
        if let Some(moraines) = &self.moraines {
            clock.time(stage::MORAINES, || moraines.raise(segments, &nodes, &mut valleys));
        }
        if let Some(barriers) = &self.barriers {
            clock.time(stage::BARRIERS, || barriers.raise(segments, &nodes, &mut valleys));
        }
        let ice_m = self
            .glaciers
            .as_ref()
            .map(|glaciers| clock.time(stage::GLACIERS, || glaciers.ice_m(segments, &nodes, &valleys)));
        let coast_m = clock.time(stage::COAST, || {
            coast::heights(&self.fields, (self.spacing_m, self.is_far), &nodes, &hillsides, &valleys.height_m)
        });
        if detail.breaches {
            clock.time(stage::BREACHES, || self.breach(nodes.area, segments, coast_m.as_deref(), &mut valleys));
        }
        let mut land =
            clock.time(stage::WATER, || self.water(segments, &nodes, &valleys, coast_m.as_deref()).fill(area));
        if let Some(water) = &mut land.water {
            water.ice_m = ice_m.map(|ice_m| ice_m.part(area));
        }
        land
    }

    /// Returns the segments of channels that can affect an area of nodes.
    fn segments(&self, area: Area, detail: Detail) -> Segments {
        let Detail { step, channels, .. } = detail;
        let origin = Point::at_vertex(area.x0 * step, area.y0 * step);
        self.network.segments(channels, self.warp.input(area, step), origin, self.reach(detail))
    }

    /// Distance from a node within which channels are looked for.
    fn reach(&self, Detail { channels, brook_cells, .. }: Detail) -> Reach {
        valley::reach_to(&self.fields, channels.levels, brook_cells)
    }

    /// Greatest rise in metres above the lowest valley side up to which gullies and moraines need to know the
    /// next-lowest side.
    fn crest_read_m(&self, gullies: Option<&Gullies>) -> f32 {
        let settings = self.fields.settings();
        let steepest = settings.hill_slope[0].max(settings.hill_slope[1]) as f32;
        let by_moraines_m = self.moraines.as_ref().map_or(0.0, |_| moraine::CREST_READ_M);
        let by_gullies_m = gullies.map_or(0.0, |gullies| gullies.crest_read_m(steepest));
        by_gullies_m.max(by_moraines_m)
    }

    /// Makes the valleys at the nodes in `part`, given the hillsides at all nodes. The rise to the next-lowest valley
    /// side is exact up to `read_m` metres.
    fn valleys(
        &self,
        nodes: &Displaced,
        part: Area,
        hillsides: &Hillsides,
        segments: &Segments,
        read_m: f32,
    ) -> Valleys {
        let mut valleys = Valleys::with_len(nodes.area.len());
        let [east, south] = &nodes.metres;
        dispatch(FillValleys {
            fields: &self.fields,
            area: nodes.area,
            part,
            step: nodes.step,
            warp: [east, south],
            hillsides,
            read_m,
            segments,
            out: &mut valleys,
        });
        valleys
    }

    /// Cuts breaches, through which the hollows of carved land drain.
    fn breach(&self, area: Area, segments: &Segments, coast_m: Option<&[f32]>, valleys: &mut Valleys) {
        let Valleys { height_m, segment, .. } = valleys;
        let sea_m = self.fields.sea_level_m() as f32;
        let carved_m = height_m.clone();
        let with_coast_m = coast_m
            .map(|coast_m| carved_m.iter().zip(coast_m).map(|(land, coast)| land.min(*coast)).collect::<Vec<_>>());
        let surface_m = with_coast_m.as_ref().unwrap_or(&carved_m);
        // A lake is level, so no vertex of a lake is a pit.
        let is_lake =
            |at: usize| segments.all.get(segment[at] as usize).is_some_and(|own| (surface_m[at] as f64) < own.pool_m);
        let may_be_pit = |at: usize| surface_m[at] > sea_m && !is_lake(at);
        breach::breach(area, surface_m, may_be_pit, height_m);
    }

    /// Returns the skerries that can lie in an area of nodes `step` vertices apart, if the world has skerries.
    fn skerries(&self, area: Area, step: i64) -> Option<AreaSkerries<'_>> {
        Some(self.skerries.as_ref()?.around(&self.fields, area, step))
    }

    /// Prepares the stage that cuts beds and fills in water at the nodes.
    fn water<'a>(
        &'a self,
        segments: &'a Segments,
        nodes: &'a Displaced,
        valleys: &'a Valleys,
        coast_m: Option<&'a [f32]>,
    ) -> FillWater<'a> {
        let skerries = self.skerries(nodes.area, nodes.step);
        let rivers = ShownRivers {
            spacing_m: self.node_m() as f32,
            least_m3s: self.fields.spring_m3s().max(self.fields.discharge_m3s(self.least_area())),
            cuts_narrow: self.stride == 1,
        };
        FillWater::new(&self.fields, &self.lift, rivers, segments, nodes, valleys, coast_m).with(skerries)
    }

    /// Returns the hillsides at the nodes of an area: sampled at coarse nodes, and interpolated between them.
    fn hillsides(&self, area: Area, detail: Detail) -> Hillsides {
        let (step, levels) = (detail.step, detail.channels.levels);
        let coarse = detail.slope_step;
        let corners = corners(area, coarse / step).vertices().map(|(x, y)| Point::at_vertex(x * coarse, y * coarse));
        let uplifts = self.fields.uplifts(&corners.collect::<Vec<_>>());
        let table = |values: Vec<f32>| bilinear(area, coarse / step, &values);
        let has_rest = levels < self.fields.levels();
        let laws: Vec<RestLaw> =
            uplifts.iter().filter(|_| has_rest).map(|uplift| RestLaw::new(&self.fields, *uplift, levels)).collect();
        Hillsides {
            reach: self.reach(detail),
            slope: table(uplifts.iter().map(|uplift| self.fields.hill_slope(*uplift) as f32).collect()),
            rest: has_rest.then(|| Rest {
                slope: table(laws.iter().map(|law| law.slope as f32).collect()),
                height_m: table(laws.iter().map(|law| law.height_m as f32).collect()),
            }),
        }
    }
}

/// Returns the corners, in cells, of the cells of `step` nodes that hold the nodes of an area.
fn corners(area: Area, step: i64) -> Area {
    let last = |past: i64| (past - 1).div_euclid(step) + 2;
    Area { x0: area.x0.div_euclid(step), y0: area.y0.div_euclid(step), x1: last(area.x1), y1: last(area.y1) }
}

/// Interpolates values at the nodes of an area from those at the [`corners`] of cells of `step` nodes.
fn bilinear(area: Area, step: i64, table: &[f32]) -> Vec<f32> {
    let Area { x0: i0, y0: j0, .. } = corners(area, step);
    let columns = corners(area, step).width();
    let mut out = vec![0.0; area.len()];
    let scale = 1.0 / step as f32;
    for (y, row) in (area.y0..area.y1).zip(out.chunks_exact_mut(area.width())) {
        let j = (y.div_euclid(step) - j0) as usize * columns;
        let v = y.rem_euclid(step) as f32 * scale;
        for (x, value) in (area.x0..area.x1).zip(row) {
            let i = j + (x.div_euclid(step) - i0) as usize;
            let u = x.rem_euclid(step) as f32 * scale;
            let north = table[i] + (table[i + 1] - table[i]) * u;
            let south = table[i + columns] + (table[i + columns + 1] - table[i + columns]) * u;
            *value = north + (south - north) * v;
        }
    }
    out
}

#[cfg(test)]
mod tests;
