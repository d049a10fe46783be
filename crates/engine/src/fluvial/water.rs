//! Water: cuts beds into the land, and fills in rivers, lakes and the sea.
//!
//! To judge the numbers chosen by eye, look at the banks and bars of large rivers, as in `plains`.

use glam::DVec2;

use super::fields::{Fields, river_depth_m};
use super::segment::{Segment, Segments};
use super::skerries::AreaSkerries;
use super::strata_and_ceiling::Lift;
use super::valley::Valleys;
use super::valley_side::LEAST_HALF_WIDTH;
use super::warp::Displaced;
use crate::area::Area;
use crate::clock::Clock;
use crate::geometry::{LineSegment, lerp};
use crate::grain_point::{GRAINS, Point};
use crate::grid::Grid;
use crate::land::{Land, Water, WaterKind};
use crate::stop::Stopped;

/// Half width in vertices of the widest bed of a brook, for places where the warp draws vertices apart.
const MOST_HALF_WIDTH: f64 = 3.0;

/// Least half width of a brook's bed, as a share of the distance between vertices: a half, and some more for bends.
const BED_SHARE: f32 = 0.6;

/// Fall of a wide river's floor from its banks to its middle line, as a share of its depth: so that the water of a wide
/// bed runs in the middle, and not along a bank.
const BED_FALL: f32 = 0.3;

/// Half width of the flat middle of a river, as a share of a brook's: wide enough that on the inside of a bend no
/// vertex lies between a vertex of the middle and the next one downstream.
const MIDDLE: f32 = 1.25;

/// Width of a bank as a share of the river's half width, and depth at its outer edge as a share of the river's depth.
/// Chosen by eye.
const BANK: f32 = 0.3;
const LEAST_BANK: f32 = 0.1;

/// Width of the point bar on the inside of the sharpest bends, as a share of the river's half width; and how much wider
/// banks are on the inside and narrower on the outside, as shares of their width on a straight reach. Chosen by eye.
const BAR: f32 = 0.55;
const INNER_BANK: f32 = 1.0;
const OUTER_BANK: f32 = 0.6;

/// Greatest height in metres of the land above a river's water where a bar may lie. Where the land is higher, another
/// valley has cut into the bed.
const BAR_M: f32 = 0.25;

/// Greatest rise of a bed that follows the land around it, as a share of the bed's depth: next to nothing, but enough
/// that no two neighbouring vertices are equally high.
const BED_RISE: f32 = 0.05;

/// Depth of the water where it runs over land as low as its bed, as a share of the river's depth.
const LEAST_DEPTH: f32 = 0.1;

/// Bound on the depth of all lakes, as a share of the half width of the widest: deeper hollows are filled with sediment
/// of their streams. Chosen by eye.
pub const LAKE_DEPTH: f32 = 0.1;

/// Least depth of a lake in metres.
const LEAST_LAKE_M: f32 = 0.01;

/// Vertices a side of a block. For each block the beds that may hold one of its vertices are found together.
const BLOCK: usize = 8;

/// Returns the area whose warp water reads: the neighbours of a vertex tell how far apart the warp draws vertices.
pub fn input(area: Area) -> Area {
    area.padded(1)
}

/// The rivers that are shown.
#[derive(Clone, Copy, Debug)]
pub struct ShownRivers {
    /// Metres between nodes. A river is at least as wide as that, so that it is unbroken.
    pub spacing_m: f32,
    /// Discharge in cubic metres a second from which on a channel holds a river.
    pub least_m3s: f64,
    /// Least area that a shown river drains, in cells of the trunk lattice.
    pub least_area: f64,
    /// True if rivers narrower than the spacing of nodes are cut into the land too. At coarse strides they are not.
    pub cuts_narrow: bool,
}

impl ShownRivers {
    /// Tells whether a channel has a river where its bed is like that.
    fn has(&self, bed: &BedAt) -> bool {
        bed.discharge_m3s >= self.least_m3s && bed.area >= self.least_area
    }
}

/// The stage that cuts beds and fills in water.
pub struct FillWater<'a> {
    fields: &'a Fields,
    lift: &'a Lift,
    skerries: Option<AreaSkerries<'a>>,
    rivers: ShownRivers,
    segments: &'a Segments,
    nodes: &'a Displaced,
    valleys: &'a Valleys,
    /// Height of the coast in metres; `None` if there is no coast here.
    coast_m: Option<&'a [f32]>,
    /// The beds of the segments, in their order.
    beds: Vec<SegmentBed>,
    /// The segments that hold water.
    wet: Vec<WetSegment>,
    /// Least and greatest half width of a brook's bed in metres.
    brook_m: [f32; 2],
    sea_m: f32,
}

/// A segment that holds water: its number, its line, and the distance in grains beyond which it has no bed.
#[derive(Clone, Copy)]
struct WetSegment {
    number: u32,
    line: LineSegment,
    reach: f64,
}

/// The bed of a segment. Each pair is a value at the segment's upper end, and its change to the lower end.
struct SegmentBed {
    area: [f64; 2],
    discharge_m3s: [f64; 2],
    half_m: [f32; 2],
    deepest_m: [f32; 2],
    bend: [f32; 2],
    /// Distance in metres from the segment beyond which it has no bed.
    widest_m: f32,
    /// Height in metres of the lake over the segment, if there is one. It is copied here because it is read at every
    /// vertex, where the whole segment would otherwise have to be fetched.
    pool_m: f64,
}

/// A bed at a place of its segment.
#[derive(Clone, Copy)]
struct BedAt {
    area: f64,
    discharge_m3s: f64,
    half_m: f32,
    deepest_m: f32,
    /// Sharpness of the river's bend: above 0 to its right, below 0 to its left.
    bend: f32,
}

impl BedAt {
    /// Returns the half width of the water in metres. `inside` is from 0 to 1 on the inside of a bend, and down to -1
    /// on the outside. The rest of the bed is a point bar, which leaves the middle of the river free.
    fn wet_m(&self, inside: f32, least_half_m: f32) -> f32 {
        let least_m = self.half_m.min(1.2 * MIDDLE * least_half_m);
        (self.half_m * (1.0 - BAR * inside.max(0.0))).max(least_m)
    }

    /// Returns the depth in metres at a distance from the middle line: a floor that falls to that line, and banks where
    /// the river is wide enough. In a bend the water runs along the outside, whose bank is steep, and a bar lies along
    /// the inside.
    fn depth_m(&self, distance_m: f32, inside: f32, least_half_m: f32) -> f32 {
        let middle_m = MIDDLE * least_half_m;
        if self.half_m <= middle_m || distance_m <= middle_m {
            return self.deepest_m;
        }
        let half_m = self.wet_m(inside, least_half_m);
        let bank_m = half_m * BANK * (1.0 + INNER_BANK * inside.max(0.0) + OUTER_BANK * inside.min(0.0));
        let bank = ((half_m - distance_m) / bank_m).clamp(LEAST_BANK, 1.0);
        let fall = BED_FALL * (1.0 + inside) * (distance_m - middle_m) / (half_m - middle_m);
        self.deepest_m * bank * (1.0 - fall.min(BED_FALL))
    }
}

impl SegmentBed {
    /// Makes the bed of a segment. `brook_m` is the greatest half width of a brook.
    fn new(fields: &Fields, segment: &Segment, brook_m: f32) -> SegmentBed {
        let pair = |upper: f32, lower: f32| [upper, lower - upper];
        let [upper, lower] = [0.0, 1.0].map(|share| {
            let half_m = (lerp(segment.river, share) * fields.metres_a_grain()) as f32;
            (half_m, river_depth_m(lerp(segment.discharge_m3s, share)))
        });
        SegmentBed {
            area: segment.area,
            discharge_m3s: segment.discharge_m3s,
            half_m: pair(upper.0, lower.0),
            deepest_m: pair(upper.1, lower.1),
            bend: segment.bend.map(|bend| bend as f32),
            widest_m: (2.0 * upper.0.max(lower.0)).max(brook_m),
            pool_m: segment.pool_m,
        }
    }

    fn at(&self, share: f64) -> BedAt {
        let lerp32 = |[start, change]: [f32; 2]| start + change * share as f32;
        BedAt {
            area: lerp(self.area, share),
            discharge_m3s: lerp(self.discharge_m3s, share),
            half_m: lerp32(self.half_m),
            deepest_m: lerp32(self.deepest_m),
            bend: lerp32(self.bend),
        }
    }
}

/// Land and water at a vertex.
struct VertexWater {
    height_m: f32,
    kind: WaterKind,
    bed: bool,
    depth_m: f32,
    flow_m3s: f32,
}

/// The place of a channel to which a vertex belongs.
#[derive(Clone, Copy)]
struct NearestChannel {
    segment: usize,
    share: f64,
    distance_m: f32,
    /// 1 to the right of the channel, -1 to its left, 0 where the side does not matter.
    side: f32,
}

impl<'a> FillWater<'a> {
    /// Prepares the stage for the nodes of an area, given their land without water.
    pub fn new(
        (fields, lift): (&'a Fields, &'a Lift),
        rivers: ShownRivers,
        segments: &'a Segments,
        nodes: &'a Displaced,
        valleys: &'a Valleys,
        coast_m: Option<&'a [f32]>,
        skerries: Option<AreaSkerries<'a>>,
    ) -> FillWater<'a> {
        let brook_m = [LEAST_HALF_WIDTH, MOST_HALF_WIDTH].map(|vertices| vertices as f32 * rivers.spacing_m);
        let beds: Vec<SegmentBed> =
            segments.all.iter().map(|segment| SegmentBed::new(fields, segment, brook_m[1])).collect();
        let is_wet = |bed: &SegmentBed| rivers.has(&bed.at(1.0));
        // One grain more allows for rounding: the reach only selects segments for an exact test.
        let reach = |bed: &SegmentBed| {
            let half_m = bed.half_m[0].max(bed.half_m[0] + bed.half_m[1]);
            half_m.max(brook_m[1]) as f64 / fields.metres_a_grain() + 1.0
        };
        let wet = beds.iter().zip(&segments.all).enumerate().filter(|(_, (bed, _))| is_wet(bed));
        let wet = wet.map(|(number, (bed, segment))| WetSegment {
            number: number as u32,
            line: segment.line(),
            reach: reach(bed),
        });
        FillWater {
            wet: wet.collect(),
            beds,
            sea_m: fields.sea_level_m() as f32,
            fields,
            lift,
            skerries,
            rivers,
            segments,
            nodes,
            valleys,
            coast_m,
            brook_m,
        }
    }

    /// Returns heights and water of an area, whose [`input`] must lie within the nodes.
    pub fn fill(&self, area: Area, clock: &Clock) -> Result<Land, Stopped> {
        let (mut heights, mut water) = (Grid::filled(area, 0.0), Water::none(area));
        let [columns, rows] = [area.width(), area.height()].map(|vertices| vertices.div_ceil(BLOCK));
        let mut bounds = Grid::filled(Area::new(0, 0, columns, rows), BoundingBox::NONE);
        for (index, bounds) in bounds.values_mut().iter_mut().enumerate() {
            let block = block(area, [(index % columns) as i64, (index / columns) as i64]);
            *bounds = self.bounds(block);
        }
        wet_blocks(bounds.area(), &bounds, &self.wet, &mut |at, wet| {
            clock.check()?;
            let block = block(area, at);
            for y in block.y0..block.y1 {
                let heights = heights.row_mut(y, block.x0, block.x1);
                let kind = water.kind.row_mut(y, block.x0, block.x1);
                let bed = water.bed.row_mut(y, block.x0, block.x1);
                let depth_m = water.depth_m.row_mut(y, block.x0, block.x1);
                let flow_m3s = water.flow_m3s.row_mut(y, block.x0, block.x1);
                for column in 0..block.width() {
                    let vertex = self.vertex([block.x0 + column as i64, y], wet);
                    heights[column] = vertex.height_m;
                    kind[column] = vertex.kind;
                    bed[column] = vertex.bed;
                    depth_m[column] = vertex.depth_m;
                    flow_m3s[column] = vertex.flow_m3s;
                }
            }
            Ok(())
        })?;
        Ok(Land { heights, water: Some(water) })
    }

    /// Returns the bounds of the displaced nodes of a block, in the plane of the network.
    fn bounds(&self, block: Area) -> BoundingBox {
        let displaced =
            self.nodes.extremes(block).map(|metres| DVec2::from(metres.map(f64::from)) / self.fields.metres_a_grain());
        let place =
            |x: i64, y: i64| Point::at_vertex(x * self.nodes.step, y * self.nodes.step).from(self.segments.origin);
        let corners = [place(block.x0, block.y0), place(block.x1 - 1, block.y1 - 1)];
        BoundingBox { low: corners[0] + displaced[0], high: corners[1] + displaced[1] }
    }

    /// Returns the place of a node in grains east and south of the segments' origin, and its displacement by the warp.
    fn place(&self, at: [i64; 2], index: usize) -> [DVec2; 2] {
        let vertex = Point::at_vertex(at[0] * self.nodes.step, at[1] * self.nodes.step).from(self.segments.origin);
        [vertex, self.nodes.displacement_m(index) / self.fields.metres_a_grain()]
    }

    #[inline]
    fn vertex(&self, at: [i64; 2], wet: &[WetSegment]) -> VertexWater {
        let index = self.nodes.area.index(at[0], at[1]);
        let land_m = self.valleys.height_m[index];
        let lowest_m = self.coast_m.map_or(land_m, |coast_m| coast_m[index].min(land_m));
        let number = self.valleys.segment[index] as usize;
        let own = self.beds.get(number);
        // The coast ends a lake: beyond the coast's edge the land falls away to the sea.
        let is_lake = own.is_some_and(|own| (land_m as f64) < own.pool_m && lowest_m == land_m);
        let lake = is_lake.then(|| &self.segments.all[number]);
        let is_near = own.is_some_and(|own| self.valleys.distance_m[index] <= own.widest_m);
        let place = if wet.is_empty() { [DVec2::ZERO; 2] } else { self.place(at, index) };
        let displaced = (place[0] + place[1]).into();
        let holds = |wet: &&WetSegment| wet.line.touches(displaced, wet.reach);
        let mut wet = wet.iter().filter(holds).map(|wet| wet.number as usize).peekable();
        if is_near || wet.peek().is_some() {
            let [least_m, most_m] = self.brook_m;
            let least_half_m = (BED_SHARE * self.apart_m(index)).clamp(least_m, most_m);
            if let Some(place) = self.channel(index, place, least_half_m, wet) {
                return match lake {
                    Some(own) => self.lake(index, own, land_m, self.river_depth_m(place, least_half_m)),
                    None => self.near_channel(at, place, least_half_m, lowest_m),
                };
            }
        }
        if let Some(own) = lake {
            return self.lake(index, own, land_m, 0.0);
        }
        let ground_m = self.lift.at(lowest_m as f64) as f32;
        if ground_m < self.sea_m { self.off_shore(at, ground_m) } else { dry(ground_m) }
    }

    /// Returns the sea, or a skerry, at a node where the sea's floor is this high.
    fn off_shore(&self, at: [i64; 2], floor_m: f32) -> VertexWater {
        let vertex = at.map(|at| at * self.nodes.step);
        let ground_m = self.skerries.as_ref().map_or(floor_m, |skerries| skerries.raised_m(vertex, floor_m));
        if ground_m < self.sea_m { self.sea(ground_m) } else { dry(ground_m) }
    }

    /// Returns the sea over a floor.
    fn sea(&self, floor_m: f32) -> VertexWater {
        VertexWater { kind: WaterKind::Sea, depth_m: self.sea_m - floor_m, ..dry(floor_m) }
    }

    /// Returns the depth in metres of the river's bed at a place, 0 outside the bed.
    fn river_depth_m(&self, place: NearestChannel, least_half_m: f32) -> f32 {
        let NearestChannel { segment, share, distance_m, side } = place;
        let bed = self.beds[segment].at(share);
        let is_river = distance_m <= bed.half_m.max(least_half_m) && self.rivers.has(&bed);
        if is_river { bed.depth_m(distance_m, side * bed.bend, least_half_m) } else { 0.0 }
    }

    /// Returns the lake over a valley's floor. It is at least as deep as the bed of a river that flows in: a step up at
    /// the shore would dam the river, so the bed goes on to where the lake is deeper.
    fn lake(&self, index: usize, own: &Segment, floor_m: f32, river_depth_m: f32) -> VertexWater {
        let (surface_m, below_m) = (self.lift.at(own.pool_m) as f32, own.pool_m - floor_m as f64);
        let deepest_m = LAKE_DEPTH as f64 * self.fields.lake_half_width() * self.fields.metres_a_grain();
        let depth_m = ((below_m / (1.0 + below_m / deepest_m)) as f32).max(river_depth_m);
        // Below the sea's level there would be sea.
        let depth_m = depth_m.min(surface_m - self.sea_m - LEAST_LAKE_M).max(LEAST_LAKE_M);
        let discharge_m3s = lerp(own.discharge_m3s, self.valleys.share[index] as f64);
        VertexWater {
            height_m: surface_m - depth_m,
            kind: WaterKind::Lake,
            bed: false,
            depth_m,
            flow_m3s: discharge_m3s as f32,
        }
    }

    /// Returns land and water in a channel or close to it. `lowest_m` is the height of the land or of the coast,
    /// whichever is lower.
    fn near_channel(&self, at: [i64; 2], place: NearestChannel, least_half_m: f32, lowest_m: f32) -> VertexWater {
        let NearestChannel { segment, share, distance_m, side } = place;
        let bed = self.beds[segment].at(share);
        let (BedAt { discharge_m3s, half_m, deepest_m, .. }, inside) = (bed, side * bed.bend);
        let level_m = lerp(self.segments.all[segment].level_m, share);
        let surface_m = self.lift.at(level_m) as f32;
        let in_bed = distance_m <= half_m.max(least_half_m);
        let ground_m = self.lift.at(lowest_m as f64) as f32;
        let is_line = half_m < least_half_m && !self.rivers.cuts_narrow;
        let river_bed = || {
            if is_line {
                return ground_m;
            }
            let depth_m = bed.depth_m(distance_m, inside, least_half_m);
            let risen_m = (ground_m - surface_m).max(0.0);
            // Where the land is lower than the bed, as beside a deeper valley, the water runs over the land uncut: a
            // bed dug there would end in a pit.
            ground_m.min(surface_m - depth_m + risen_m / (1.0 + risen_m / (BED_RISE * deepest_m)))
        };
        let wet = self.rivers.has(&bed);
        let is_river = in_bed && wet;
        if ground_m < self.sea_m || (is_river && level_m < self.sea_m as f64) {
            // Water in a bed cut into the sea's floor belongs to the sea. The river keeps its way open through whatever
            // lies across it.
            let open_m = || river_bed().max(self.sea_m - deepest_m);
            return self.off_shore(at, if is_river { ground_m.min(open_m()) } else { ground_m });
        }
        let water = |kind, height_m, depth_m| VertexWater {
            height_m,
            kind,
            bed: in_bed,
            depth_m,
            flow_m3s: discharge_m3s as f32,
        };
        if !in_bed || !wet {
            return VertexWater { bed: in_bed, ..dry(ground_m) };
        }
        // A point bar is as high as the water beside it.
        if distance_m > bed.wet_m(inside, least_half_m).max(least_half_m) && ground_m <= surface_m + BAR_M {
            return VertexWater { bed: true, flow_m3s: discharge_m3s as f32, ..dry(ground_m) };
        }
        let height_m = river_bed();
        let least_depth_m = if is_line { deepest_m } else { LEAST_DEPTH * deepest_m };
        let depth_m = (surface_m.min(ground_m) - height_m).max(least_depth_m);
        water(WaterKind::River, height_m, depth_m)
    }

    /// Returns the place of the channel in whose bed a vertex lies, or else of the channel in whose valley it lies, if
    /// that is near.
    ///
    /// Water further down a bend may be lower than the water beside the vertex, and a valley beside a steep channel may
    /// be deeper: the channel keeps its bed all the same.
    fn channel(
        &self,
        index: usize,
        [vertex, displaced]: [DVec2; 2],
        least_half_m: f32,
        wet: impl Iterator<Item = usize>,
    ) -> Option<NearestChannel> {
        let own = Some(self.valleys.segment[index] as usize).filter(|number| *number < self.segments.all.len());
        let own = own.map(|segment| NearestChannel {
            segment,
            share: self.valleys.share[index] as f64,
            distance_m: self.valleys.distance_m[index],
            side: 0.0,
        });
        let own = own.filter(|own| own.distance_m <= self.beds[own.segment].widest_m);
        let metres = self.fields.metres_a_grain();
        // Of several channels take the one with the lowest floor: at a confluence that is the river that goes on.
        let mut lowest: Option<(f32, NearestChannel)> = None;
        for number in wet {
            let segment = &self.segments.all[number];
            // The difference is exact whatever the origin, except for the last sum, so all windows find the same place.
            let off = (vertex - segment.from) + displaced;
            let (share, square) = segment.nearest_off(off);
            let (distance_m, bed) = ((square.sqrt() * metres) as f32, self.beds[number].at(share));
            if distance_m <= bed.half_m.max(least_half_m) && self.rivers.has(&bed) {
                let side = segment.along.perp_dot(off).signum() as f32;
                let depth_m = bed.depth_m(distance_m, side * bed.bend, least_half_m);
                let floor_m = lerp(segment.level_m, share) as f32 - depth_m;
                if lowest.is_none_or(|(lowest_m, _)| floor_m < lowest_m) {
                    lowest = Some((floor_m, NearestChannel { segment: number, share, distance_m, side }));
                }
            }
        }
        lowest.map(|(_, place)| place).or(own)
    }

    /// Returns the distance in metres, in the warped plane, from a node to the furthest of its neighbours, scaled to
    /// nodes that lie a [bed's spacing](ShownRivers::spacing_m) apart.
    ///
    /// A line that passes between two vertices comes within half of that distance of one of them. With all such
    /// vertices in its bed, the line is unbroken even where the warp draws vertices apart.
    fn apart_m(&self, index: usize) -> f32 {
        let Displaced { area, step, metres } = self.nodes;
        // In a survey, nodes lie further apart than the vertices whose beds they have.
        let node_m = *step as f32 * (GRAINS as f64 * self.fields.metres_a_grain()) as f32;
        let share = self.rivers.spacing_m / node_m;
        let width = area.width();
        let around = [(index - 1, [-1.0, 0.0]), (index + 1, [1.0, 0.0])];
        let around = around.into_iter().chain([(index - width, [0.0, -1.0]), (index + width, [0.0, 1.0])]);
        let ways = around.map(|(other, vertices)| {
            let way = [0, 1].map(|axis| vertices[axis] * self.rivers.spacing_m);
            let warped = metres.each_ref().map(|metres| (metres[other] - metres[index]) * share);
            let [x, y] = [way[0] + warped[0], way[1] + warped[1]];
            x * x + y * y
        });
        ways.fold(0.0, f32::max).sqrt()
    }
}

/// Returns the block in a column and a row of an area's blocks.
fn block(area: Area, [column, row]: [i64; 2]) -> Area {
    let corner = [area.x0 + column * BLOCK as i64, area.y0 + row * BLOCK as i64];
    Area::new(corner[0], corner[1], BLOCK, BLOCK).common(&area).expect("it begins in the area")
}

/// Calls `take` with each block of `part`, and with the wet segments whose beds may hold one of its nodes. The part is
/// halved again and again, and each half tests only the segments that its whole had left.
fn wet_blocks(
    part: Area,
    bounds: &Grid<BoundingBox>,
    wet: &[WetSegment],
    take: &mut impl FnMut([i64; 2], &[WetSegment]) -> Result<(), Stopped>,
) -> Result<(), Stopped> {
    let bounds_of_part = part.vertices().fold(BoundingBox::NONE, |all, (x, y)| all.hull(bounds.at(x, y)));
    let (middle, half) = bounds_of_part.middle_and_half();
    let holds = |wet: &WetSegment| wet.line.touches(middle.into(), wet.reach + half);
    let wet: Vec<WetSegment> = wet.iter().copied().filter(holds).collect();
    if part.len() == 1 {
        return take([part.x0, part.y0], &wet);
    }
    part.halves().into_iter().try_for_each(|half| wet_blocks(half, bounds, &wet, take))
}

/// The bounding box of places.
#[derive(Clone, Copy)]
struct BoundingBox {
    low: DVec2,
    high: DVec2,
}

impl BoundingBox {
    /// The bounding box of no place.
    const NONE: BoundingBox = BoundingBox { low: DVec2::INFINITY, high: DVec2::NEG_INFINITY };

    fn hull(self, other: BoundingBox) -> BoundingBox {
        BoundingBox { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    /// Returns the middle, and half of the longer side.
    fn middle_and_half(self) -> (DVec2, f64) {
        let half = (self.high - self.low) / 2.0;
        (self.low + half, half.max_element())
    }
}

/// Returns ground without water.
fn dry(height_m: f32) -> VertexWater {
    VertexWater { height_m, kind: WaterKind::Dry, bed: false, depth_m: 0.0, flow_m3s: 0.0 }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::clock::Clock;
    use crate::fluvial::Fluvial;
    use crate::fluvial::channel::Channel;
    use crate::fluvial::segment::segments_of;
    use crate::grain_point::GRAINS;

    #[test]
    fn bars_lie_on_the_insides_of_bends_and_leave_their_rivers_whole() {
        let fluvial = Fluvial::of_preset("plains", 5, |_| {});
        let side = 6 * fluvial.fields().side(0);
        let mut bends: Vec<(Arc<Channel>, usize)> = Vec::new();
        fluvial.network().channels(0, [Point { x: -side, y: -side }, Point { x: side, y: side }], |trunk| {
            let is_bend = |knot: &usize| {
                let section = trunk.sections[*knot];
                section.bend.abs() > 0.9 && section.river > 2.5 * GRAINS as f32
            };
            bends.extend((0..trunk.knots.len()).filter(is_bend).map(|knot| (Arc::clone(trunk), knot)).next());
        });
        let mut bars = 0;
        for (trunk, knot) in bends.iter().take(6) {
            let bend = fluvial.in_world(trunk.knots[*knot].at);
            let [x, y] = [bend.x, bend.y].map(|grains| grains.div_euclid(GRAINS));
            let area = Area::new(x - 12, y - 12, 24, 24);
            let land = fluvial.land(area, &Clock::default()).unwrap();
            let water = land.water.unwrap();
            let nodes = fluvial.warp.fill(area, 1);
            let own: Vec<Segment> = segments_of(fluvial.fields(), trunk, 0, trunk.knots[0].at, |_| true).collect();
            for (index, (x, y)) in area.vertices().enumerate() {
                let is_bar = water.kind.at(x, y) == WaterKind::Dry && water.flow_m3s.at(x, y) > 0.0;
                if !is_bar {
                    continue;
                }
                let displaced = nodes.displacement_m(index) / fluvial.fields().metres_a_grain();
                let place = Point::at_vertex(x, y).moved(displaced).from(trunk.knots[0].at);
                let nearest = own.iter().min_by(|a, b| a.nearest(place).1.total_cmp(&b.nearest(place).1)).unwrap();
                let (share, square) = nearest.nearest(place);
                // A vertex of another river that joins here.
                if square.sqrt() > lerp(nearest.river, share) {
                    continue;
                }
                bars += 1;
                assert!(
                    nearest.along.perp_dot(place - nearest.from) * lerp(nearest.bend, share) > 0.0,
                    "outside of a bend at {x}, {y}"
                );
                assert!(square.sqrt() > 0.4 * lerp(nearest.river, share), "in the middle of the river at {x}, {y}");
                assert!(water.bed.at(x, y) && water.depth_m.at(x, y) == 0.0);
            }
        }
        assert!(bars > 40, "{bars} vertices of bars at {} bends", bends.len());
    }
}
