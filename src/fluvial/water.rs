//! Water: beds, lakes and the sea, cut into the land.

use std::collections::BTreeMap;

use super::fields::Fields;
use super::lift::Lift;
use super::point::Point;
use super::segment::{Segment, Segments};
use super::trunk::NodeId;
use super::valley::Valleys;
use super::valley_side::LEAST_HALF_WIDTH;
use super::warp::Displaced;
use crate::area::Area;
use crate::geometry::{length, lerp};
use crate::grid::Grid;
use crate::land::{Land, Water, WaterKind};

/// No river is deeper, in metres: about as deep as the lower Amazon.
pub const DEEPEST_RIVER_M: f32 = 40.0;

/// Half width in vertices of the widest bed that a brook has where the warp draws vertices apart.
const MOST_HALF_WIDTH: f64 = 3.0;

/// Half width of a brook's bed at least, as a share of the way from a vertex to the next: a half, and some more for
/// bends.
const BED_SHARE: f32 = 0.6;

/// What the floor of a wide river falls from its banks to its middle line, as a share of its depth: the water of a wide
/// bed runs there, and not along a bank.
const BED_FALL: f32 = 0.3;

/// Width of a bank as a share of the river's half width, and its depth at its outer edge as a share of the river's.
/// Chosen by eye.
const BANK: f32 = 0.3;
const LEAST_BANK: f32 = 0.1;

/// What a bed rises at most where the land around it does, as a share of its depth: next to nothing, but enough that no
/// two vertices beside each other are equally high.
const BED_RISE: f32 = 0.05;

/// Depth of a lake as a share of its half width. Chosen by eye.
pub const LAKE_DEPTH: f32 = 0.1;

/// The area whose warp water reads: that of the vertices beside a vertex tells how far apart they are.
pub fn input(area: Area) -> Area {
    area.padded(1)
}

/// Cuts beds and fills in water.
pub struct FillWater<'a> {
    fields: &'a Fields,
    lift: &'a Lift,
    spacing_m: f32,
    segments: &'a Segments,
    nodes: &'a Displaced,
    valleys: &'a Valleys,
    /// Height of the coast in metres, if it is anywhere.
    coast_m: Option<&'a [f32]>,
    /// Metres from each segment beyond which it has neither water nor a bed.
    widest_m: Vec<f32>,
    /// The segments that end a trunk, by the node that they come to.
    at_nodes: BTreeMap<NodeId, Vec<usize>>,
    /// Half widths in metres of the bed of a brook: least and most.
    brook_m: [f32; 2],
    sea_m: f32,
}

/// What there is at a vertex.
struct VertexWater {
    height_m: f32,
    kind: WaterKind,
    bed: bool,
    depth_m: f32,
    flow_m3s: f32,
}

/// The place of a channel that a vertex belongs to.
#[derive(Clone, Copy)]
struct NearestChannel {
    segment: usize,
    share: f64,
    distance_m: f32,
}

impl<'a> FillWater<'a> {
    /// What is needed for the nodes of an area, given all that is known of them before there is water.
    pub fn new(
        fields: &'a Fields,
        lift: &'a Lift,
        spacing_m: f64,
        segments: &'a Segments,
        nodes: &'a Displaced,
        valleys: &'a Valleys,
        coast_m: Option<&'a [f32]>,
    ) -> FillWater<'a> {
        let spacing_m = spacing_m as f32;
        let brook_m = [LEAST_HALF_WIDTH, MOST_HALF_WIDTH].map(|vertices| vertices as f32 * spacing_m);
        let widest_m = |segment: &Segment| {
            let lake_m = (segment.widest_lake() * fields.metres_a_grain()) as f32;
            (fields.river_width_m(lerp(segment.area, 1.0)) as f32).max(lake_m).max(brook_m[1])
        };
        let mut at_nodes: BTreeMap<NodeId, Vec<usize>> = BTreeMap::new();
        for (number, segment) in segments.all.iter().enumerate() {
            let channel = &segments.channels[segment.channel as usize];
            if let Some((node, _)) = channel.next.filter(|_| segment.knot as usize + 2 == channel.knots.len()) {
                at_nodes.entry(node).or_default().push(number);
            }
        }
        FillWater {
            widest_m: segments.all.iter().map(widest_m).collect(),
            sea_m: fields.sea_level_m() as f32,
            fields,
            lift,
            spacing_m,
            segments,
            nodes,
            valleys,
            coast_m,
            at_nodes,
            brook_m,
        }
    }

    /// Heights and water of an area, whose [`input`] must be within the nodes.
    pub fn fill(&self, area: Area) -> Land {
        let mut heights = Grid::filled(area, 0.0);
        let mut kind = Grid::filled(area, WaterKind::Dry);
        let mut bed = Grid::filled(area, false);
        let mut depth_m = Grid::filled(area, 0.0);
        let mut flow_m3s = Grid::filled(area, 0.0);
        let all = self.nodes.area;
        for y in area.y0..area.y1 {
            let first = (y - all.y0) as usize * all.width() + (area.x0 - all.x0) as usize;
            let heights = heights.row_mut(y, area.x0, area.x1);
            let kind = kind.row_mut(y, area.x0, area.x1);
            let bed = bed.row_mut(y, area.x0, area.x1);
            let depth_m = depth_m.row_mut(y, area.x0, area.x1);
            let flow_m3s = flow_m3s.row_mut(y, area.x0, area.x1);
            for column in 0..area.width() {
                let vertex = self.vertex([area.x0 + column as i64, y], first + column);
                heights[column] = vertex.height_m;
                kind[column] = vertex.kind;
                bed[column] = vertex.bed;
                depth_m[column] = vertex.depth_m;
                flow_m3s[column] = vertex.flow_m3s;
            }
        }
        Land { heights, water: Some(Water { kind, bed, depth_m, flow_m3s }) }
    }

    #[inline]
    fn vertex(&self, at: [i64; 2], index: usize) -> VertexWater {
        let land_m = self.valleys.height_m[index];
        let coast_m = self.coast_m.map_or(f32::INFINITY, |coast_m| coast_m[index]);
        let in_sea = coast_m < self.sea_m;
        let lowest_m = coast_m.min(land_m);
        let number = self.valleys.segment[index] as usize;
        if number < self.segments.all.len() && self.valleys.distance_m[index] <= self.widest_m[number] {
            return self.near_channel(at, index, lowest_m, in_sea);
        }
        if in_sea { self.sea(lowest_m) } else { dry(self.lift.at(lowest_m as f64) as f32) }
    }

    /// The sea over a floor.
    fn sea(&self, floor_m: f32) -> VertexWater {
        VertexWater { kind: WaterKind::Sea, depth_m: self.sea_m - floor_m, ..dry(floor_m) }
    }

    /// What there is in a channel, or not far from it, given the height of the land or of the coast that is lower.
    fn near_channel(&self, at: [i64; 2], index: usize, lowest_m: f32, in_sea: bool) -> VertexWater {
        let fields = self.fields;
        let [least_m, most_m] = self.brook_m;
        let least_half_m = (BED_SHARE * self.apart_m(index)).clamp(least_m, most_m);
        let NearestChannel { segment, share, distance_m } = self.place(at, index, least_half_m);
        let segment = &self.segments.all[segment];
        let channel = &self.segments.channels[segment.channel as usize];
        // At its mouth a channel is as deep as what it runs into: a dry one is a notch in its bank, and between the
        // banks there is only that.
        let last = segment.knot as usize + 2 == channel.knots.len();
        let left_m = (1.0 - share) * length(segment.along) * fields.metres_a_grain();
        let between_banks = last && left_m <= fields.river_width_m(channel.mouth_area) / 2.0;
        let at_mouth = between_banks || last && left_m <= 2.0 * least_half_m as f64;
        let own_area = if between_banks { channel.mouth_area } else { lerp(segment.area, share) };
        let area_here = if at_mouth { channel.mouth_area } else { own_area };
        let discharge = fields.discharge_m3s(area_here);
        let half_m = fields.river_width_m(area_here) as f32 / 2.0;
        let lake_m = (lerp(segment.lake, share) * fields.metres_a_grain()) as f32;
        let surface_m = self.lift.at(lerp(segment.level_m, share)) as f32;
        let in_bed = distance_m <= half_m.max(least_half_m);
        let ground_m = self.lift.at(lowest_m as f64) as f32;
        let river_bed = || {
            let deepest_m = river_depth_m(discharge);
            let depth_m = bed_depth_m(deepest_m, distance_m, half_m, least_half_m);
            let risen_m = (ground_m - surface_m).max(0.0);
            surface_m - depth_m + risen_m / (1.0 + risen_m / (BED_RISE * deepest_m))
        };
        let wet = fields.is_wet(own_area);
        if in_sea {
            // What a river has cut into the sea's floor is the sea's.
            return self.sea(if in_bed && wet { lowest_m.min(river_bed()) } else { lowest_m });
        }
        let water =
            |kind, height_m, depth_m| VertexWater { height_m, kind, bed: in_bed, depth_m, flow_m3s: discharge as f32 };
        if distance_m < lake_m && lake_m > half_m.max(least_half_m) {
            // A parabola from shore to shore.
            let out = distance_m / lake_m;
            let depth_m = LAKE_DEPTH * lake_m * (1.0 - out * out);
            return water(WaterKind::Lake, surface_m - depth_m, depth_m);
        }
        if !in_bed || !fields.is_wet(area_here) {
            return VertexWater { bed: in_bed, ..dry(ground_m) };
        }
        let height_m = river_bed();
        if wet {
            water(WaterKind::River, height_m, surface_m - height_m)
        } else {
            VertexWater { bed: true, ..dry(height_m) }
        }
    }

    /// The place of the channel whose bed a vertex is in, or else of that whose valley it is in.
    ///
    /// Above a bend the water below it may be lower than that beside the vertex, whose bed is there all the same.
    fn place(&self, at: [i64; 2], index: usize, least_half_m: f32) -> NearestChannel {
        let metres_a_grain = self.fields.metres_a_grain();
        let is_inside = |place: &NearestChannel| {
            let area = lerp(self.segments.all[place.segment].area, place.share);
            place.distance_m <= (self.fields.river_width_m(area) as f32 / 2.0).max(least_half_m)
        };
        let own = NearestChannel {
            segment: self.valleys.segment[index] as usize,
            share: self.valleys.share[index] as f64,
            distance_m: self.valleys.distance_m[index],
        };
        if is_inside(&own) {
            return own;
        }
        let vertex = Point::at_vertex(at[0] * self.nodes.step, at[1] * self.nodes.step).from(self.segments.origin);
        let warped = self.nodes.metres.each_ref().map(|metres| metres[index] as f64 / metres_a_grain);
        let above = self.above(own.segment).map(|number| {
            let segment = &self.segments.all[number];
            // Exact whatever the origin, but for the last sum.
            let off = [0, 1].map(|axis| (vertex[axis] - segment.from[axis]) + warped[axis]);
            let (share, square) = segment.nearest_off(off);
            NearestChannel { segment: number, share, distance_m: (square.sqrt() * metres_a_grain) as f32 }
        });
        above.into_iter().find(is_inside).unwrap_or(own)
    }

    /// The numbers of the segments that lead to one: the one before it in its channel, and those that end where it
    /// begins.
    fn above(&self, number: usize) -> impl Iterator<Item = usize> {
        let segment = &self.segments.all[number];
        let before = number.checked_sub(1).filter(|before| {
            let before = &self.segments.all[*before];
            before.channel == segment.channel && before.knot + 1 == segment.knot
        });
        let (level, x, y) = self.segments.channels[segment.channel as usize].id;
        let to_node = if level == 0 && segment.knot == 0 { self.at_nodes.get(&(x, y)) } else { None };
        before.into_iter().chain(to_node.into_iter().flatten().copied())
    }

    /// Metres, in the warped plane, from a node to the furthest of those beside it, as if these were a vertex away.
    ///
    /// A line that runs between two vertices comes within half of that to one of them: with all such ones in its bed,
    /// it is unbroken also where the warp has vertices far apart.
    fn apart_m(&self, index: usize) -> f32 {
        let Displaced { area, step, metres } = self.nodes;
        let width = area.width();
        let around = [(index - 1, [-1.0, 0.0]), (index + 1, [1.0, 0.0])];
        let around = around.into_iter().chain([(index - width, [0.0, -1.0]), (index + width, [0.0, 1.0])]);
        let ways = around.map(|(other, vertices)| {
            let way = [0, 1].map(|axis| vertices[axis] * self.spacing_m);
            let warped = metres.each_ref().map(|metres| (metres[other] - metres[index]) / *step as f32);
            let [x, y] = [way[0] + warped[0], way[1] + warped[1]];
            x * x + y * y
        });
        ways.fold(0.0, f32::max).sqrt()
    }
}

/// Ground without water.
fn dry(height_m: f32) -> VertexWater {
    VertexWater { height_m, kind: WaterKind::Dry, bed: false, depth_m: 0.0, flow_m3s: 0.0 }
}

/// Depth of a river in metres, by its discharge: the 3/8 th power, which is all square roots.
///
/// Based on: L. B. Leopold, T. Maddock, The hydraulic geometry of stream channels, 1953, where depth goes with about
/// the 0.4 th power of discharge.
pub(super) fn river_depth_m(discharge_m3s: f64) -> f32 {
    let fourth = discharge_m3s.sqrt().sqrt();
    ((0.35 * fourth * fourth.sqrt()) as f32).min(DEEPEST_RIVER_M)
}

/// Depth of a bed in metres at a distance from its middle line: a floor that falls to that line, and banks, where the
/// river is wide enough to have them.
fn bed_depth_m(deepest_m: f32, distance_m: f32, half_m: f32, least_half_m: f32) -> f32 {
    let beyond = distance_m - least_half_m;
    if half_m <= least_half_m || beyond <= 0.0 {
        return deepest_m;
    }
    let bank = ((half_m - distance_m) / (BANK * half_m)).clamp(LEAST_BANK, 1.0);
    deepest_m * bank * (1.0 - BED_FALL * beyond / (half_m - least_half_m))
}
