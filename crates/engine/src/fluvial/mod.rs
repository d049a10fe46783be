//! Fluvial relief: land that water made. Rivers first, relief second.
//!
//! ```text
//! potential (fields), laws   --> trunks: a coarse lattice that drains over its passes to sinks and the sea
//!                                   |
//!                                   v
//!                     network: level by level, tributaries that join the nearest channel
//!                                   |
//!                                   v      plane warped, so that no line is straight
//!                     valleys: the lowest valley side at each vertex
//!                                   |
//!                                   v
//!                     gullies, moraines, barriers, cones of volcanoes, glaciers, coast, breaches, strata,
//!                     ceiling, beds, dunes, small forms of the ground, ice sheets
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
//! The modules, in the order of that diagram: `potential`, `fields`, `laws`, `rock_laws`, `volcanoes` and
//! `strata_and_ceiling` hold the laws. `trunk_nodes`, `catchments` and `trunk_lattice` are the lattice of the largest
//! rivers; `trunk_curve`, `meander`, `delta` and `trunk_course` make their lines, `lake` their lakes, and `branches` their
//! oxbows and side arms. `tributary_course`, `tributary_bed` and `tributary` make all other channels; `bed_cut` lowers the
//! beds of all. `network` finds channels with their `cross_section`s and `segment`s by place. `warp`, `valley`,
//! `valley_side`, `hillsides`, `gullies`, the `stamp`s (`moraine`, `barrier`, `volcanic_cones` and `glacier`), `coast`,
//! `skerries`, `breach` and `water` make rasters of them, as `stages` asks for them in the `detail` that nodes can show.
//! On `free_ground`, `dunes` and `ground_forms` rise upon these, and an `ice_sheet` buries them. `rivers` and `strahler`
//! know whole rivers, and `survey` measures the land for planning roads. At coarse strides, `brook_relief` is the mean
//! relief of brooks too fine to show, and `node_means` averages finer nodes where even trunks are too fine.

pub mod settings;
mod potential;
pub mod laws;
mod rock_laws;
pub mod fields;
pub mod volcanoes;
mod strata_and_ceiling;
mod plane;
mod course_offsets;
mod meander;
mod trunk_nodes;
mod catchments;
pub mod trunk_lattice;
pub mod channel;
pub mod segment;
pub mod cross_section;
mod bed_cut;
mod segments_above;
mod barrier;
mod lake;
mod trunk_curve;
mod delta;
mod trunk_course;
mod tributary_course;
mod tributary_bed;
mod tributary;
mod branches;
pub mod network;
mod warp;
mod brook_relief;
mod valley_side;
mod valley;
mod detail;
mod hillsides;
mod gullies;
mod stamp;
mod moraine;
mod glacier;
mod volcanic_cones;
mod coast;
mod skerries;
mod breach;
mod dunes;
mod free_ground;
mod ground_forms;
mod ice_sheet;
mod water;
mod node_means;
mod stages;
pub mod rivers;
mod strahler;
pub mod survey;
pub mod landforms;

use std::sync::Arc;

use crate::area::{Area, Stride};
use crate::clock::{Clock, stage};
use crate::geography::Geography;
use crate::grain_point::{Point, overlap, padded};
use crate::hash::{self, Stream};
use crate::land::Land;
use crate::memory::Remembers;
use crate::names::Names;
use crate::stop::Stopped;
use barrier::Barriers;
use detail::{Care, Detail};
pub use dunes::COVERS as SAND_COVERS;
use dunes::Dunes;
use fields::{DEEPEST_RIVER_M, Fields};
use glacier::Glaciers;
use ground_forms::GroundForms;
use gullies::Gullies;
use moraine::Moraines;
use network::Network;
use node_means::Means;
use rivers::RiverMemories;
use settings::FluvialSettings;
use skerries::Skerries;
use strata_and_ceiling::Lift;
use volcanic_cones::VolcanicCones;
use volcanoes::Volcano;
use warp::Warp;
use water::LAKE_DEPTH;

/// The relief of a world, made by water.
#[derive(Debug)]
pub struct Fluvial {
    seed: u64,
    /// Vertices from one node of this land to the next.
    stride: i64,
    /// The detail that these nodes can show.
    detail: Detail,
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
    cones: Option<VolcanicCones>,
    glaciers: Option<Glaciers>,
    dunes: Option<Dunes>,
    ground_forms: Option<GroundForms>,
    lift: Lift,
    rivers: RiverMemories,
    names: Option<Names>,
    survey: survey::Memories,
}

/// Largest distance in metres between nodes at which moraines, barriers and skerries show; and glaciers.
const SMALL_M: f64 = 40.0;
const LARGE_M: f64 = 320.0;

impl Fluvial {
    /// Makes the relief of checked settings at the nodes of a stride, from the metres between vertices. Its rivers take
    /// their names from `names`.
    pub(crate) fn new(
        settings: &FluvialSettings,
        geography: Option<Arc<Geography>>,
        (spacing_m, stride): (f64, Stride),
        sea_level_m: Option<f64>,
        seed: u64,
        names: Option<Names>,
    ) -> Fluvial {
        let fields = Arc::new(Fields::new(settings, geography, spacing_m, sea_level_m, seed));
        let warp = Arc::new(Warp::new(&fields, seed));
        let network = Fluvial::new_network(&fields, stride, seed);
        Fluvial::of_parts((fields, network, warp), stride, seed, names)
    }

    /// Makes the network as it is seen at a stride.
    fn new_network(fields: &Arc<Fields>, stride: Stride, seed: u64) -> Arc<Network> {
        let is_far = detail::is_far(fields, stride.vertices());
        Arc::new(Network::new(Arc::clone(fields), is_far, hash::stream(seed, Stream::Network)))
    }

    /// Returns the same relief at the nodes of another stride.
    pub(crate) fn at_stride(&self, stride: Stride) -> Fluvial {
        // Only the precision with which trunks end at the shore differs between networks seen from near and from far.
        let is_same = detail::is_far(&self.fields, stride.vertices()) == self.detail.is_far || !self.fields.has_sea();
        let network = match is_same {
            true => Arc::clone(&self.network),
            false => Fluvial::new_network(&self.fields, stride, self.seed),
        };
        let parts = (Arc::clone(&self.fields), network, Arc::clone(&self.warp));
        Fluvial::of_parts(parts, stride, self.seed, self.names.clone())
    }

    /// Returns the same relief as a sketch: coarser than its nodes could show, in half the time.
    pub(crate) fn sketched(self) -> Fluvial {
        Fluvial { detail: Detail::new(&self.fields, self.stride, Care::Sketch), ..self }
    }

    /// Puts together the relief at the nodes of a stride from the parts that all strides share.
    fn of_parts(
        (fields, network, warp): (Arc<Fields>, Arc<Network>, Arc<Warp>),
        stride: Stride,
        seed: u64,
        names: Option<Names>,
    ) -> Fluvial {
        let node_m = fields.spacing_m() * stride.vertices() as f64;
        let steps = std::iter::successors(Some(stride), |step| Stride::new(2 * step.vertices() as u64));
        let steps = steps.take_while(|step| *step <= stride || step.vertices() <= survey::MOST_GULLY_STEP);
        let gullies = steps.filter_map(|step| Gullies::new(&fields, step, seed));
        let shows = |most_m: f64| stride == Stride::ONE || node_m <= most_m;
        Fluvial {
            seed,
            stride: stride.vertices(),
            detail: Detail::new(&fields, stride.vertices(), Care::Whole),
            network,
            warp,
            gullies: gullies.collect(),
            skerries: Skerries::new(&fields, seed).filter(|_| shows(SMALL_M)),
            moraines: Moraines::new(&fields, seed).filter(|_| shows(SMALL_M)),
            barriers: Barriers::new(&fields, seed).filter(|_| shows(SMALL_M)),
            cones: VolcanicCones::new(&fields, seed),
            glaciers: Glaciers::new(&fields, seed).filter(|_| shows(LARGE_M)),
            dunes: Dunes::new(&fields, seed),
            ground_forms: GroundForms::new(&fields, seed),
            lift: Lift::new(&fields, seed),
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
        self.fields.spacing_m() * self.stride as f64
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

    /// Returns the volcanoes whose middles lie in a rectangle of the world, given by its corners. Their middles are
    /// those in the world.
    pub fn volcanoes(&self, rectangle: [Point; 2]) -> Vec<Volcano> {
        let of_network = self.fields.volcanoes_in(padded(
            rectangle,
            self.warp.most_m()[0].max(self.warp.most_m()[1]) / self.fields.metres_a_grain(),
        ));
        let in_world = of_network.into_iter().map(|own| Volcano { middle: self.in_world(own.middle), ..own });
        in_world.filter(|own| overlap([own.middle; 2], rectangle)).collect()
    }

    /// Returns the bounds of all heights: (lowest, highest) in metres.
    ///
    /// Beds lie at most the greatest depth of a river or lake below the lowest water. The sea is shallower below its
    /// lowstand than its settings say, and the ceiling is never reached.
    pub fn range_m(&self) -> (f32, f32) {
        let settings = self.fields.settings();
        let sink_m = self.fields.base_m();
        let floor_m = self.fields.lowest_sea_m();
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
    ///
    /// # Errors
    /// When `clock` stops the work.
    pub fn land(&self, area: Area, clock: &Clock) -> Result<Land, Stopped> {
        let detail = self.detail;
        let whole = |area| {
            let segments = clock.time(stage::NETWORK, || self.segments(self.around(area, detail), detail, clock))??;
            self.land_of(&segments, area, detail, clock)
        };
        match self.stride / detail.step {
            1 => whole(area),
            finer => Means::of(area, finer, self.fields.sea_level_m() as f32, whole),
        }
    }
}

#[cfg(test)]
mod tests;
