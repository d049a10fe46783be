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
//!                     coast, gullies, strata, ceiling, beds  -->  Land: heights and water
//! ```
//!
//! Everything is a pure function of the seed and of lattice ids. A vertex depends on the pieces of channels whose
//! [reach](network::Piece::reach) holds it, a channel on those of coarser levels within a few cells, and a trunk on its
//! whole basin, which is flooded and remembered.

pub mod fields;
mod ground;
mod gullies;
pub mod network;
pub mod point;
pub mod rivers;
pub mod settings;
mod strahler;
pub mod trunk;
mod valley;
mod wander;
mod warp;

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::area::Area;
use crate::clock::Clock;
use crate::grid::Grid;
use crate::hash;
use crate::memory::Fill;
use crate::preset::Preset;
use crate::simd::dispatch;
use fields::{COAST_STEP, Fields};
use gullies::Gullies;
use network::{Network, Piece, Pieces, mix};
use point::Point;
use rivers::Rivers;
use settings::{FluvialSettings, Strata};
use trunk::NodeId;
use valley::{FillValleys, LEAST_HALF_WIDTH, PATCH, Valleys};
use warp::Warp;

/// A world's relief, made by water.
#[derive(Debug)]
pub struct Fluvial {
    spacing_m: f64,
    fields: Arc<Fields>,
    network: Network,
    warp: Warp,
    gullies: Option<Gullies>,
    lift: Lift,
    rivers: Rivers,
    ground: ground::Memories,
}

/// The land of an area, and the water on it.
#[derive(Clone, Debug)]
pub struct Land {
    /// Heights in metres: of the ground, so under water of its bed.
    pub heights: Grid<f32>,
    /// What stands or flows on it; `None` where the relief knows of no water.
    pub water: Option<Water>,
}

/// Water on an area.
#[derive(Clone, Debug)]
pub struct Water {
    /// What there is at each vertex.
    pub kind: Grid<WaterKind>,
    /// Whether a vertex lies in the bed of a channel, wet or dry: what fills it is a dam.
    pub bed: Grid<bool>,
    /// Metres from the bed to the surface; 0 where it is dry.
    pub depth_m: Grid<f32>,
    /// Discharge in cubic metres a second of the channel at each vertex; 0 off the channels.
    pub flow_m3s: Grid<f32>,
}

impl Land {
    /// The land of a part of the area, which must be within it.
    pub(crate) fn part(&self, area: Area) -> Land {
        let water = self.water.as_ref().map(|water| Water {
            kind: water.kind.part(area),
            bed: water.bed.part(area),
            depth_m: water.depth_m.part(area),
            flow_m3s: water.flow_m3s.part(area),
        });
        Land { heights: self.heights.part(area), water }
    }
}

/// Kinds of water.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum WaterKind {
    /// None.
    #[default]
    Dry,
    /// A river or a brook.
    River,
    /// A lake.
    Lake,
    /// The sea.
    Sea,
}

/// Streams of chance.
mod stream {
    pub const NETWORK: u64 = 10 << 32;
}

/// Cells of the finest level within which a brook can matter to a vertex; among millions, a few are reached over five.
const REACH_CELLS: i64 = 6;

/// Vertices from one place to the next at which the slope of the hills is known.
const SLOPE_STEP: i64 = 32;

/// No river is deeper, in metres.
const DEEPEST_RIVER_M: f32 = 40.0;

/// Half width in vertices of the widest bed that a brook has where the warp draws vertices apart.
const MOST_HALF_WIDTH: f64 = 3.0;

/// Half width of a brook's bed at least, as a share of the way from a vertex to the next: a half, and some more for bends.
const BED_SHARE: f32 = 0.6;

/// What the floor of a wide river falls from its banks to its middle line, as a share of its depth: the water of a wide
/// bed runs there, and not along a bank.
const BED_FALL: f32 = 0.3;

/// Depth of a lake as a share of its half width.
const LAKE_DEPTH: f32 = 0.1;

impl Fluvial {
    /// How full its memories are.
    pub(crate) fn fills(&self) -> Vec<Fill> {
        [self.network.fills(), self.warp.fills(), self.rivers.fills(), self.ground.fills()].concat()
    }

    /// The relief of a checked preset with those settings.
    pub(crate) fn new(preset: &Preset, settings: &FluvialSettings, seed: u64) -> Fluvial {
        let fields = Arc::new(Fields::new(preset, settings, seed));
        Fluvial {
            spacing_m: preset.spacing_m,
            network: Network::new(Arc::clone(&fields), hash::stream(seed, stream::NETWORK)),
            warp: Warp::new(&fields, preset.spacing_m, seed),
            gullies: Gullies::new(&fields, preset.spacing_m, seed),
            lift: Lift::new(settings, seed),
            rivers: Rivers::default(),
            ground: ground::Memories::default(),
            fields,
        }
    }

    /// The fields that it grows from.
    pub fn fields(&self) -> &Fields {
        &self.fields
    }

    /// Where in the world a point of the network lies: the network is straight, and the world is not.
    pub fn in_world(&self, network: Point) -> Point {
        self.warp.undo(network)
    }

    /// Height in metres of the land, or of water, that the network has at a level.
    pub fn lifted_m(&self, level_m: f64) -> f64 {
        self.lift.at(level_m)
    }

    /// The rivers, straight as they are before the plane is warped.
    pub fn network(&self) -> &Network {
        &self.network
    }

    /// Bounds that no height can leave: (lowest, highest) in metres.
    ///
    /// Beds lie at most a river's or a lake's greatest depth below the lowest water, the sea is less deep than its settings
    /// say, and the ceiling is never reached.
    pub fn range_m(&self) -> (f32, f32) {
        let settings = self.fields.settings();
        let sea_m = self.fields.sea_level_m();
        let floor_m = if sea_m.is_finite() { sea_m - settings.coast.depth_m } else { f64::INFINITY };
        let lowest_m = floor_m.min(self.lift.at(self.fields.sink_level_m(false)));
        let ceiling_m = settings.ceiling_m;
        let lake_m = self.fields.lake_half_width() * self.fields.metres_a_grain() * LAKE_DEPTH as f64;
        // A metre more is for rounding.
        let deepest_m = lake_m.max(DEEPEST_RIVER_M as f64) + 1.0;
        ((lowest_m - deepest_m) as f32, (ceiling_m + 1.0) as f32)
    }

    /// Metres from a vertex, once it is warped, within which brooks matter; other channels do as far as their sides rise
    /// no more than that.
    fn brook_reach_m(&self) -> f64 {
        let finest = self.fields.side(self.fields.levels() - 1);
        (REACH_CELLS * finest) as f64 * self.fields.metres_a_grain()
    }

    /// The land at all vertices of an area, with the time of each stage booked on `clock`.
    pub fn land(&self, area: Area, clock: &Clock) -> Land {
        let pieces = clock.time("network", || self.pieces(aligned(area), 1));
        self.land_of(&pieces, area, 1, clock)
    }

    /// The land at the nodes of an area, which are `step` vertices apart, given the pieces of channels around it and
    /// perhaps more.
    fn land_of(&self, pieces: &Pieces, area: Area, step: i64, clock: &Clock) -> Land {
        // Between nodes far apart nobody sees gullies.
        let gullies = self.gullies.as_ref().filter(|_| step == 1);
        // They and beds look one vertex further, at the warp alone.
        let aligned = aligned(area.padded(1));
        // Where the valleys are read.
        let [east, south] = clock.time("warp", || self.warp.fill(aligned, step));
        let slope = self.slopes(aligned, step);
        let mut valleys = Valleys::with_len(aligned.len());
        clock.time("valleys", || {
            dispatch(FillValleys {
                fields: &self.fields,
                area: aligned,
                step,
                warp: [&east, &south],
                slope: &slope,
                pieces,
                brook_reach_m: self.brook_reach_m(),
                out: &mut valleys,
            });
        });
        if let Some(gullies) = gullies {
            clock.time("gullies", || gullies.carve(aligned, [&east, &south], &slope, &mut valleys));
        }
        let coast = clock.time("coast", || self.coast(aligned, step, &east, &south, &valleys.height_m));
        let nodes = Nodes { area: aligned, step, warp: [&east, &south], valleys: &valleys, coast_m: coast.as_deref() };
        clock.time("water", || self.finish(area, pieces, &nodes))
    }

    /// The pieces of channels that matter to an area of nodes, `step` vertices apart.
    fn pieces(&self, area: Area, step: i64) -> Pieces {
        let metres = self.fields.metres_a_grain();
        let pad = self.warp.most_m().map(|most_m| (most_m / metres).ceil() as i64);
        let [low, high] = [(area.x0, area.y0), (area.x1, area.y1)].map(|(x, y)| Point::at_vertex(x * step, y * step));
        let rectangle =
            [Point { x: low.x - pad[0], y: low.y - pad[1] }, Point { x: high.x + pad[0], y: high.y + pad[1] }];
        self.network.pieces(self.fields.levels(), rectangle, low, self.brook_reach_m() / metres)
    }

    /// The slope of the hillsides at the nodes of an area, from a coarse lattice.
    fn slopes(&self, area: Area, step: i64) -> Vec<f32> {
        let coarse = SLOPE_STEP.max(step);
        let at = |x: i64, y: i64| {
            self.fields.hill_slope(self.fields.uplift(Point::at_vertex(x * coarse, y * coarse))) as f32
        };
        let mut values = vec![0.0; area.len()];
        bilinear(area, coarse / step, at, &mut values);
        values
    }

    /// The height of the coast where it may be lower than the land, infinity elsewhere; `None` where it is nowhere.
    fn coast(&self, area: Area, step: i64, east: &[f32], south: &[f32], land_m: &[f32]) -> Option<Vec<f32>> {
        if !self.fields.sea_level_m().is_finite() {
            return None;
        }
        let mut coast_m = vec![f32::INFINITY; area.len()];
        let mut any = false;
        let per_vertex = (1.0 / self.spacing_m) as f32;
        let (across, down) = (64, 16);
        for y0 in (area.y0..area.y1).step_by(down) {
            for x0 in (area.x0..area.x1).step_by(across) {
                let block = Area { x0, y0, x1: (x0 + across as i64).min(area.x1), y1: (y0 + down as i64).min(area.y1) };
                let rows = || (block.y0..block.y1).map(|y| ((y - area.y0) as usize * area.width(), y));
                let indices = || {
                    rows().flat_map(|(row, y)| {
                        (block.x0..block.x1).map(move |x| (row + (x - area.x0) as usize, x * step, y * step))
                    })
                };
                // Where the block is once warped, in steps of the coarse lattice.
                let (mut low, mut high) = ([i64::MAX; 2], [i64::MIN; 2]);
                let mut highest_m = f32::NEG_INFINITY;
                for (index, x, y) in indices() {
                    let at =
                        [x as f64 + (east[index] * per_vertex) as f64, y as f64 + (south[index] * per_vertex) as f64];
                    for axis in [0, 1] {
                        let cell = (at[axis].floor() as i64).div_euclid(COAST_STEP);
                        low[axis] = low[axis].min(cell);
                        high[axis] = high[axis].max(cell + 1);
                    }
                    highest_m = highest_m.max(land_m[index]);
                }
                let (columns, lines) = ((high[0] - low[0] + 1) as usize, (high[1] - low[1] + 1) as usize);
                let mut table = Vec::with_capacity(columns * lines);
                for j in 0..lines as i64 {
                    for i in 0..columns as i64 {
                        let at = Point::at_vertex((low[0] + i) * COAST_STEP, (low[1] + j) * COAST_STEP);
                        table.push(self.fields.inland_m(at) as f32);
                    }
                }
                let nearest_m = table.iter().fold(f32::INFINITY, |a, b| a.min(*b));
                if self.fields.coast_m(nearest_m) >= highest_m {
                    continue;
                }
                any = true;
                for (index, x, y) in indices() {
                    // Relative to the lattice's cell that holds the vertex: exact anywhere.
                    let (cell_x, cell_y) = (x.div_euclid(COAST_STEP), y.div_euclid(COAST_STEP));
                    let within = |cell: i64, at: i64, metres: f32| {
                        let steps = ((at - cell * COAST_STEP) as f32 + metres * per_vertex) / COAST_STEP as f32;
                        let whole = steps.floor();
                        (cell + whole as i64, steps - whole)
                    };
                    let ((i, u), (j, v)) = (within(cell_x, x, east[index]), within(cell_y, y, south[index]));
                    let (i, j) = ((i - low[0]).clamp(0, columns as i64 - 2), (j - low[1]).clamp(0, lines as i64 - 2));
                    let first = j as usize * columns + i as usize;
                    let north = table[first] + (table[first + 1] - table[first]) * u;
                    let below = &table[first + columns..];
                    let south = below[0] + (below[1] - below[0]) * u;
                    coast_m[index] = self.fields.coast_m(north + (south - north) * v);
                }
            }
        }
        any.then_some(coast_m)
    }

    /// Metres from a piece beyond which it has neither water nor a bed, `most_half` being a brook's widest.
    fn widest_m(&self, piece: &Piece, most_half: f32) -> f32 {
        let lake_m = (piece.widest_lake() * self.fields.metres_a_grain()) as f32;
        (self.fields.river_width_m(mix(piece.area, 1.0)) as f32).max(lake_m).max(most_half)
    }

    /// Heights and water from the valleys and the coast.
    fn finish(&self, area: Area, pieces: &Pieces, nodes: &Nodes<'_>) -> Land {
        let &Nodes { area: aligned, step, warp: [east, south], valleys, coast_m: coast } = nodes;
        let settings = self.fields.settings();
        let spacing_m = self.spacing_m as f32;
        let sea_m = self.fields.sea_level_m() as f32;
        let mut heights = Grid::filled(area, 0.0);
        let mut kinds = Grid::filled(area, WaterKind::Dry);
        let mut beds = Grid::filled(area, false);
        let mut depths = Grid::filled(area, 0.0);
        let mut flows = Grid::filled(area, 0.0);
        let least_half = LEAST_HALF_WIDTH as f32 * spacing_m;
        let most_half = MOST_HALF_WIDTH as f32 * spacing_m;
        let widest: Vec<f32> = pieces.all.iter().map(|piece| self.widest_m(piece, most_half)).collect();
        let upper = UpperPieces::new(pieces);
        for y in area.y0..area.y1 {
            let start = (y - aligned.y0) as usize * aligned.width() + (area.x0 - aligned.x0) as usize;
            let row = start..start + area.width();
            let heights = heights.row_mut(y, area.x0, area.x1);
            let kinds = kinds.row_mut(y, area.x0, area.x1);
            let beds = beds.row_mut(y, area.x0, area.x1);
            let depths = depths.row_mut(y, area.x0, area.x1);
            let flows = flows.row_mut(y, area.x0, area.x1);
            for (column, index) in row.enumerate() {
                let land_m = valleys.height_m[index];
                let coast_m = coast.map_or(f32::INFINITY, |coast| coast[index]);
                let in_sea = coast_m < sea_m;
                let mut sea = |floor_m: f32| {
                    (heights[column], kinds[column], depths[column]) = (floor_m, WaterKind::Sea, sea_m - floor_m);
                };
                let number = valleys.piece[index] as usize;
                if number >= pieces.all.len() || valleys.distance_m[index] > widest[number] {
                    let lowest_m = coast_m.min(land_m);
                    if in_sea {
                        sea(lowest_m);
                    } else {
                        heights[column] = self.lift.at(lowest_m as f64) as f32;
                    }
                    continue;
                }
                // In the channel, or not far from it.
                let least_half = (BED_SHARE * nodes.apart_m(index, spacing_m)).clamp(least_half, most_half);
                let half_m = |piece: &Piece, share: f64| {
                    (self.fields.river_width_m(mix(piece.area, share)) as f32 / 2.0).max(least_half)
                };
                let own = (number, valleys.share[index] as f64, valleys.distance_m[index]);
                // Above a bend the water below it may be lower than that beside the vertex, whose bed is there all the same.
                let beside = || {
                    let vertex = Point::at_vertex((area.x0 + column as i64) * step, y * step).from(pieces.origin);
                    let warped = [east, south].map(|metres| metres[index] as f64 / self.fields.metres_a_grain());
                    upper.of(pieces, number).find_map(|number| {
                        let piece = &pieces.all[number];
                        // Exact whatever the origin, but for the last sum.
                        let off = [0, 1].map(|axis| (vertex[axis] - piece.from[axis]) + warped[axis]);
                        let (share, square) = piece.nearest_off(off);
                        let distance_m = (square.sqrt() * self.fields.metres_a_grain()) as f32;
                        (distance_m <= half_m(piece, share)).then_some((number, share, distance_m))
                    })
                };
                let inside = own.2 <= half_m(&pieces.all[number], own.1);
                let (number, share, distance_m) = if inside { own } else { beside().unwrap_or(own) };
                let piece = &pieces.all[number];
                let channel = &pieces.channels[piece.channel as usize];
                // At its mouth a channel is as deep as what it runs into: a dry one is a notch in its bank, and between
                // the banks there is only that.
                let last = piece.knot as usize + 2 == channel.knots.len();
                let left_m = (1.0 - share) * point::length(piece.along) * self.fields.metres_a_grain();
                let between_banks = last && left_m <= self.fields.river_width_m(channel.mouth_area) / 2.0;
                let at_mouth = between_banks || last && left_m <= 2.0 * least_half as f64;
                let own_area = if between_banks { channel.mouth_area } else { mix(piece.area, share) };
                let area_here = if at_mouth { channel.mouth_area } else { own_area };
                let discharge = self.fields.discharge_m3s(area_here);
                let half_m = self.fields.river_width_m(area_here) as f32 / 2.0;
                let lake_m = (mix(piece.lake, share) * self.fields.metres_a_grain()) as f32;
                let surface = self.lift.at(mix(piece.level_m, share)) as f32;
                let in_bed = distance_m <= half_m.max(least_half);
                let ground_m = self.lift.at((land_m.min(coast_m)) as f64) as f32;
                let river_bed = || {
                    let deepest = river_depth_m(discharge);
                    let depth = bed_depth_m(deepest, distance_m, half_m, least_half);
                    // No two vertices beside each other are equally high: what the land rises, but next to nothing.
                    let risen = (ground_m - surface).max(0.0);
                    surface - depth + risen / (1.0 + risen / (0.05 * deepest))
                };
                if in_sea {
                    let carved = in_bed && self.is_wet(own_area);
                    sea(coast_m.min(land_m).min(if carved { river_bed() } else { f32::INFINITY }));
                    continue;
                }
                beds[column] = in_bed;
                if distance_m < lake_m && lake_m > half_m.max(least_half) {
                    let out = distance_m / lake_m;
                    let depth = LAKE_DEPTH * lake_m * (1.0 - out * out);
                    (heights[column], kinds[column], depths[column]) = (surface - depth, WaterKind::Lake, depth);
                    flows[column] = discharge as f32;
                } else if discharge >= settings.spring_m3s && in_bed {
                    heights[column] = river_bed();
                    if self.is_wet(own_area) {
                        (kinds[column], depths[column]) = (WaterKind::River, surface - heights[column]);
                        flows[column] = discharge as f32;
                    }
                } else {
                    heights[column] = ground_m;
                }
            }
        }
        Land { heights, water: Some(Water { kind: kinds, bed: beds, depth_m: depths, flow_m3s: flows }) }
    }
}

/// What is known at the nodes of an area before there is water on it.
struct Nodes<'a> {
    area: Area,
    /// Vertices from a node to the next.
    step: i64,
    /// Metres east and south to where each node is read in the plane.
    warp: [&'a [f32]; 2],
    valleys: &'a Valleys,
    /// Height of the coast in metres, if it is anywhere.
    coast_m: Option<&'a [f32]>,
}

impl Nodes<'_> {
    /// Metres, in the warped plane, from a node to the furthest of those beside it, as if these were a vertex away.
    ///
    /// A line that runs between two vertices comes within half of that to one of them: with all such ones in its bed, it
    /// is unbroken also where the warp has vertices far apart.
    fn apart_m(&self, index: usize, spacing_m: f32) -> f32 {
        let width = self.area.width();
        let around = [(index - 1, [-1.0, 0.0]), (index + 1, [1.0, 0.0])];
        let around = around.into_iter().chain([(index - width, [0.0, -1.0]), (index + width, [0.0, 1.0])]);
        let ways = around.map(|(other, vertices)| {
            let way = [0, 1].map(|axis| vertices[axis] * spacing_m);
            let warped = self.warp.map(|metres| (metres[other] - metres[index]) / self.step as f32);
            let [x, y] = [way[0] + warped[0], way[1] + warped[1]];
            x * x + y * y
        });
        ways.fold(0.0, f32::max).sqrt()
    }
}

/// The pieces that lead to others.
struct UpperPieces {
    /// Those that end a trunk, by the node that they come to.
    at_nodes: BTreeMap<NodeId, Vec<usize>>,
}

impl UpperPieces {
    fn new(pieces: &Pieces) -> UpperPieces {
        let mut at_nodes: BTreeMap<NodeId, Vec<usize>> = BTreeMap::new();
        for (number, piece) in pieces.all.iter().enumerate() {
            let channel = &pieces.channels[piece.channel as usize];
            if let Some((node, _)) = channel.next.filter(|_| piece.knot as usize + 2 == channel.knots.len()) {
                at_nodes.entry(node).or_default().push(number);
            }
        }
        UpperPieces { at_nodes }
    }

    /// The numbers of the pieces that lead to one.
    fn of(&self, pieces: &Pieces, number: usize) -> impl Iterator<Item = usize> {
        let piece = &pieces.all[number];
        let before = number.checked_sub(1).filter(|before| {
            let before = &pieces.all[*before];
            before.channel == piece.channel && before.knot + 1 == piece.knot
        });
        let (level, x, y) = pieces.channels[piece.channel as usize].id;
        let above = if level == 0 && piece.knot == 0 { self.at_nodes.get(&(x, y)) } else { None };
        before.into_iter().chain(above.into_iter().flatten().copied())
    }
}

/// Depth of a river in metres, by its discharge: the 3/8 th power, which is all square roots.
fn river_depth_m(discharge_m3s: f64) -> f32 {
    let fourth = discharge_m3s.sqrt().sqrt();
    ((0.35 * fourth * fourth.sqrt()) as f32).min(DEEPEST_RIVER_M)
}

/// Depth of a bed in metres at a distance from its middle line: a floor that falls to that line, and banks, where the river
/// is wide enough to have them.
fn bed_depth_m(deepest_m: f32, distance_m: f32, half_m: f32, least_half: f32) -> f32 {
    let beyond = distance_m - least_half;
    if half_m <= least_half || beyond <= 0.0 {
        return deepest_m;
    }
    let bank = ((half_m - distance_m) / (0.3 * half_m)).clamp(0.1, 1.0);
    deepest_m * bank * (1.0 - BED_FALL * beyond / (half_m - least_half))
}

/// The smallest area that is whole patches and holds another.
fn aligned(area: Area) -> Area {
    let (across, down) = (PATCH.0 as i64, PATCH.1 as i64);
    Area {
        x0: area.x0.div_euclid(across) * across,
        y0: area.y0.div_euclid(down) * down,
        x1: (area.x1 + across - 1).div_euclid(across) * across,
        y1: (area.y1 + down - 1).div_euclid(down) * down,
    }
}

/// Fills the vertices of an area between values at every `step`th vertex of the world.
fn bilinear(area: Area, step: i64, at: impl Fn(i64, i64) -> f32, out: &mut [f32]) {
    let (i0, j0) = (area.x0.div_euclid(step), area.y0.div_euclid(step));
    let columns = ((area.x1 - 1).div_euclid(step) - i0 + 2) as usize;
    let lines = ((area.y1 - 1).div_euclid(step) - j0 + 2) as usize;
    let mut table = Vec::with_capacity(columns * lines);
    for j in 0..lines as i64 {
        table.extend((0..columns as i64).map(|i| at(i0 + i, j0 + j)));
    }
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
}

/// What layers of rock and the ceiling make of a height: it rises strictly, so no pit comes of it.
#[derive(Clone, Debug)]
struct Lift {
    strata: Option<Strata>,
    seed: u64,
    knee_m: f64,
    room_m: f64,
}

impl Lift {
    fn new(settings: &FluvialSettings, seed: u64) -> Lift {
        let knee_m = settings.knee * settings.ceiling_m;
        Lift { strata: settings.strata.clone(), seed, knee_m, room_m: settings.ceiling_m - knee_m }
    }

    fn at(&self, height_m: f64) -> f64 {
        let layered_m = match &self.strata {
            None => height_m,
            Some(strata) => {
                let layers = height_m / strata.thickness_m;
                let layer = layers.floor();
                let within = layers - layer;
                // No two layers are alike.
                let cliff = strata.cliff * (0.4 + 0.6 * point::chance(self.seed, (layer as i64, 0), 0));
                let bench = 1.0 - cliff / strata.steepness;
                let risen = if within < bench {
                    within * ((1.0 - cliff) / bench)
                } else {
                    (1.0 - cliff) + (within - bench) * strata.steepness
                };
                (layer + risen) * strata.thickness_m
            }
        };
        let over = layered_m - self.knee_m;
        if over <= 0.0 { layered_m } else { self.knee_m + over / (1.0 + over / self.room_m) }
    }
}

#[cfg(test)]
mod tests {
    use super::network::Piece;
    use super::*;

    /// What lies further than the declared reach, warp included, is never looked at: there may be anything.
    #[test]
    fn nothing_beyond_the_reach_matters() {
        for name in ["alps", "plains", "archipelago"] {
            let (_, preset) = Preset::load(name).unwrap();
            let fluvial = Fluvial::new(&preset, preset.fluvial.as_ref().unwrap(), 4);
            let area = Area::new(-130, 70, 64, 48);
            let expected = fluvial.land(area, &Clock::default());
            let wide = fluvial.pieces(aligned(area.padded(600)), 1);
            let near = fluvial.pieces(aligned(area), 1);
            let key = |pieces: &Pieces, piece: &Piece| (pieces.channels[piece.channel as usize].id, piece.knot);
            let known: std::collections::BTreeSet<_> = near.all.iter().map(|piece| key(&near, piece)).collect();
            let mut poisoned = wide.all.clone();
            let mut beyond = 0;
            for piece in &mut poisoned {
                if !known.contains(&key(&wide, piece)) {
                    piece.level_m = [f64::NAN; 2];
                    piece.area = [f64::NAN; 2];
                    beyond += 1;
                }
            }
            assert!(beyond > 1000, "{name}: {beyond} pieces lie beyond the reach");
            let pieces = Pieces { origin: wide.origin, channels: wide.channels, all: poisoned };
            let land = fluvial.land_of(&pieces, area, 1, &Clock::default());
            assert_eq!(land.heights, expected.heights, "{name}");
        }
    }

    #[test]
    fn strata_and_ceiling_keep_the_order_of_heights() {
        for name in ["alps", "canyon"] {
            let (_, preset) = Preset::load(name).unwrap();
            let settings = preset.fluvial.unwrap();
            let lift = Lift::new(&settings, 1);
            let heights: Vec<f64> = (-1000..20_000).map(|half| lift.at(half as f64 / 2.0)).collect();
            assert!(heights.windows(2).all(|pair| pair[0] < pair[1]), "{name}");
            assert!(heights[heights.len() - 1] < settings.ceiling_m, "{name}");
        }
    }
}
