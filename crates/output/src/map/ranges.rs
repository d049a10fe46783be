//! Mountain ranges, and the depth of valleys, found in the land as it is seen from afar: at coarse nodes that suit the
//! scale of names.
//!
//! A range is high ground around a top. The top is the highest point within more than twice the reach of a name, so the
//! names of two ranges never meet, and each range can be found from the land around it alone.

use std::cmp::Ordering;
use std::sync::Arc;

use glam::{DVec2, dvec2};
use rayon::prelude::*;

use crate::area::{Area, Stride};
use crate::clock::Clock;
use crate::grid::Grid;
use crate::map::climb::Climb;
use crate::map::scale::Scale;
use crate::map::style::LabelsStyle;
use crate::map::text::{Placed, length, shape};
use crate::map::weighted_sums::smoothed;
use crate::stop::Stopped;
use crate::world::World;

/// Largest distance in millimetres on paper from a coarse node to the next.
const NODE_MM: f64 = 2.0;

/// Steps, in nodes, by which the land is smoothed one after the other until a range is one form: as far as 10 mm.
const STEPS: [i64; 3] = [1, 2, 4];

/// Width in nodes of the margin around an area that smoothing looks at.
const HALO: usize = 14;

/// Largest distance in millimetres on paper from the top of a range to the end of its name.
const REACH_MM: f64 = 30.0;

/// Smallest distance in millimetres on paper between the tops of two ranges: more than twice the reach of a name.
const APART_MM: f64 = 64.0;

/// Smallest scale denominator at which ranges have names, and the denominators at which valleys have names.
const LEAST_RANGES: f64 = 90_000.0;
const VALLEYS: std::ops::RangeInclusive<f64> = 30_000.0..=750_000.0;

/// Smallest height in metres by which a range rises above the low ground around it.
const LEAST_RISE_M: f32 = 400.0;

/// Smallest height in metres of the land beside a named valley above its floor, and the distance in millimetres within
/// which that land is looked for.
const LEAST_DEPTH_M: f32 = 250.0;
const BESIDE_MM: f64 = 10.0;

/// Share of the ground around a top that is too low to be a part of the range.
const LOW_SHARE: f64 = 0.5;

/// Largest distance from the middle of the range's ground to the end of its name, in standard deviations of the ground
/// along the name.
const MOST_SPREAD: f64 = 2.6;

/// Largest bend of a name: the distance from its middle to the straight line between its ends, as a share of that line.
const MOST_BEND: f64 = 0.16;

/// Largest width of a name, as a multiple of its width with the usual space between letters.
const MOST_STRETCH: f64 = 2.2;

/// Distances in millimetres from the crest to the middle of a name. Beside the crest, the name makes room for the
/// symbols of settlements.
const BESIDE_LINE_MM: [f64; 5] = [0.0, 3.0, -3.0, 6.0, -6.0];

/// Side in nodes of the parts in which land is made.
const PART: i64 = 64;

/// The land of a world at the coarse nodes of a stride that suits the scale of names.
#[derive(Debug)]
pub(super) struct Afar {
    world: World,
    scale: Scale,
    /// Climb from the highest coarse node of a range to its highest peak.
    climb: Climb,
}

/// The coarse land around an area of pixels.
pub(super) struct CoarseLand<'a> {
    afar: &'a Afar,
    /// Heights of the ground in metres, or of the sea where the sea is higher.
    heights: Grid<f32>,
    /// The same heights without small forms, on an area 14 nodes narrower on each side.
    smooth: Grid<f32>,
    /// Nodes of the area of pixels, and of the reach of a name around it.
    area: Area,
}

/// A mountain range.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Range {
    /// Node of the top, which identifies the range among all ranges of a scale.
    pub id: [i64; 2],
    pub name: String,
    /// Highest place of the smoothed land, in pixels.
    pub top: DVec2,
    /// Line along the crest, from left to right.
    pub line: Vec<DVec2>,
}

impl Afar {
    /// Creates the coarse land of a fluvial world for maps of a scale.
    pub fn new(world: &Arc<World>, scale: Scale) -> Afar {
        let most_m = NODE_MM * scale.denominator() / 1000.0;
        let stride = Stride::within(most_m, world.spacing_m());
        Afar { world: world.at_stride(stride), scale, climb: Climb::new(Arc::clone(world), stride) }
    }

    /// True if ranges or valleys have names at the scale, so that the coarse land is needed.
    pub fn is_of_use(world: &World, scale: Scale) -> bool {
        let denominator = scale.denominator();
        world.names().is_some() && (denominator >= LEAST_RANGES || VALLEYS.contains(&denominator))
    }

    fn pixels_per_node(&self) -> f64 {
        self.world.spacing_m() / self.scale.metres_per_pixel
    }

    /// Returns the land around an area of pixels, as far as it decides on the names of ranges that may be seen there.
    pub fn look(&self, pixels: Area, clock: &Clock) -> Result<CoarseLand<'_>, Stopped> {
        let nodes = |mm: f64| (self.scale.pixels(mm) / self.pixels_per_node()).ceil() as usize + 1;
        let area = self.scale.nodes_of(pixels, self.world.spacing_m()).padded(nodes(REACH_MM));
        let wide = area.padded(nodes(APART_MM) + HALO);
        let sea_level_m = self.world.preset().sea_level_m.map_or(f32::MIN, |level| level as f32);
        let mut heights = Grid::filled(wide, 0.0);
        let parts: Vec<Area> = wide.squares(PART as usize).collect();
        let make = |part| Ok(self.world.relief().land(part, clock)?.heights);
        for part in parts.into_par_iter().map(make).collect::<Result<Vec<Grid<f32>>, Stopped>>()? {
            let Area { x0, y0, x1, y1 } = part.area();
            for y in y0..y1 {
                let row = heights.row_mut(y, x0, x1).iter_mut();
                row.zip(part.row(y, x0, x1)).for_each(|(to, from)| *to = from.max(sea_level_m));
            }
        }
        let mut smooth = heights.part(wide);
        for step in STEPS {
            let Area { x0, y0, x1, y1 } = smooth.area();
            let by = 2 * step;
            smooth = smoothed(&smooth, Area { x0: x0 + by, y0: y0 + by, x1: x1 - by, y1: y1 - by }, step);
        }
        Ok(CoarseLand { afar: self, heights, smooth, area })
    }
}

impl CoarseLand<'_> {
    /// Returns the ranges whose names may reach into the area.
    pub fn ranges(&self, clock: &Clock) -> Result<Vec<Range>, Stopped> {
        if self.afar.scale.denominator() < LEAST_RANGES {
            return Ok(Vec::new());
        }
        let Area { x0, y0, x1, y1 } = self.area;
        let rows = (y0..y1).into_par_iter();
        let tops = rows.flat_map_iter(|y| (x0..x1).map(move |x| [x, y]).filter(|at| self.is_top(*at)));
        tops.filter_map(|top| self.range(top, clock).transpose()).collect()
    }

    /// True if the floor of a valley lies so far below the heights beside it that the valley has a name of its own.
    pub fn is_valley(&self, at: DVec2) -> bool {
        let Afar { scale, .. } = self.afar;
        if !VALLEYS.contains(&scale.denominator()) {
            return false;
        }
        let node = (at / self.afar.pixels_per_node()).round().to_array().map(|at| at as i64);
        let beside = scale.pixels(BESIDE_MM);
        // Rivers reach far beyond the coarse land. Names out there are not seen, so `false` will do.
        let known = Area::new(node[0], node[1], 1, 1).padded((beside / self.afar.pixels_per_node()) as usize);
        if !self.heights.area().contains(&known) {
            return false;
        }
        let around = self.around(node, beside);
        let (low_m, high_m) = around.fold((f32::MAX, f32::MIN), |(low, high), [x, y]| {
            let height_m = self.heights.at(x, y);
            (low.min(height_m), high.max(height_m))
        });
        high_m - low_m >= LEAST_DEPTH_M
    }

    /// Returns the nodes of a disc around a node, given its radius in pixels.
    fn around(&self, [x, y]: [i64; 2], pixels: f64) -> impl Iterator<Item = [i64; 2]> {
        let nodes = pixels / self.afar.pixels_per_node();
        let most = nodes as i64;
        let within = move |[east, south]: &[i64; 2]| dvec2(*east as f64, *south as f64).length() <= nodes;
        let offsets = (-most..=most).flat_map(move |south| (-most..=most).map(move |east| [east, south]));
        offsets.filter(within).map(move |[east, south]| [x + east, y + south])
    }

    /// True if a node is the highest within `APART_MM`; of equal nodes, only the first is.
    fn is_top(&self, top: [i64; 2]) -> bool {
        let height_m = |[x, y]: [i64; 2]| self.smooth.at(x, y);
        let is_below = |at: [i64; 2]| match height_m(at).total_cmp(&height_m(top)) {
            Ordering::Less => true,
            Ordering::Equal => at >= top,
            Ordering::Greater => false,
        };
        let [x, y] = top;
        // Compare with the neighbours first: nearly all nodes have a higher neighbour, and the wide disc takes longer.
        let beside = [[x - 1, y], [x + 1, y], [x, y - 1], [x, y + 1]];
        beside.into_iter().all(is_below) && self.around(top, self.afar.scale.pixels(APART_MM)).all(is_below)
    }

    /// Returns the range around a top, if it stands out from the land around it.
    fn range(&self, top: [i64; 2], clock: &Clock) -> Result<Option<Range>, Stopped> {
        let Afar { world, scale, climb } = self.afar;
        let reach = scale.pixels(REACH_MM);
        let nodes: Vec<[i64; 2]> = self.around(top, reach).collect();
        let mut ground: Vec<f32> = nodes.iter().map(|[x, y]| self.heights.at(*x, *y)).collect();
        ground.sort_by(f32::total_cmp);
        let at_share = |of: &[f32], share: f64| of[((of.len() - 1) as f64 * share) as usize];
        if at_share(&ground, 0.95) - at_share(&ground, 0.05) < LEAST_RISE_M {
            return Ok(None);
        }
        let highest = |a: &[i64; 2], b: &[i64; 2]| {
            self.heights.at(a[0], a[1]).total_cmp(&self.heights.at(b[0], b[1])).then(b.cmp(a))
        };
        // A range is named after its highest peak, which is the same at all scales. So a range on a map of a smaller
        // scale has the name of its highest part.
        let highest = nodes.iter().copied().max_by(highest).expect("the top is one of them");
        let peak = climb.peak(highest.map(|at| at * world.stride().vertices()), clock)?;
        let Some((peak, names)) = peak.zip(world.names()) else { return Ok(None) };
        let name = names.range(peak.at);
        let mut smooth: Vec<f32> = nodes.iter().map(|[x, y]| self.smooth.at(*x, *y)).collect();
        smooth.sort_by(f32::total_cmp);
        let foot_m = at_share(&smooth, LOW_SHARE);
        let pixels_per_node = self.afar.pixels_per_node();
        let pixel = |[x, y]: [i64; 2]| dvec2(x as f64, y as f64) * pixels_per_node;
        let (id, top) = (top, pixel(top));
        let weighed = nodes.iter().map(|at| {
            let from_top = pixel(*at) - top;
            // Far ground counts less; otherwise the next range would turn the name of this range.
            let near = 1.0 - from_top.length_squared() / (reach * reach);
            (f64::from((self.smooth.at(at[0], at[1]) - foot_m).max(0.0)) * near, from_top)
        });
        let weighed: Vec<(f64, DVec2)> = weighed.filter(|(weight, _)| *weight > 0.0).collect();
        Ok(crest(&weighed, top, reach).map(|line| Range { id, name, top, line }))
    }
}

/// Fits a parabola along weighted places, which are given relative to `from`. The parabola goes no further than `reach`
/// from there.
fn crest(weighed: &[(f64, DVec2)], from: DVec2, reach: f64) -> Option<Vec<DVec2>> {
    let sum = |of: &dyn Fn(DVec2) -> f64| weighed.iter().map(|(weight, at)| weight * of(*at)).sum::<f64>();
    let whole = sum(&|_| 1.0);
    if whole <= 0.0 {
        return None;
    }
    let middle = dvec2(sum(&|at| at.x), sum(&|at| at.y)) / whole;
    let moment = |a: usize, b: usize| sum(&|at| (at - middle)[a] * (at - middle)[b]) / whole;
    let (xx, xy, yy) = (moment(0, 0), moment(0, 1), moment(1, 1));
    // Angle of the axis along which the places spread most.
    let angle = 0.5 * libm::atan2(2.0 * xy, xx - yy);
    let along = dvec2(libm::cos(angle), libm::sin(angle));
    let frame = |at: DVec2| dvec2((at - middle).dot(along), (at - middle).dot(along.perp()));
    let spread = (sum(&|at| frame(at).x * frame(at).x) / whole).sqrt();
    // The parabola `bend * (t^2 - spread^2)` beside the axis, as near to the places as can be (least squares).
    let square = |at: DVec2| frame(at).x * frame(at).x - spread * spread;
    let squares = sum(&|at| square(at) * square(at));
    let half = (MOST_SPREAD * spread).min(reach - middle.length());
    if half <= 0.0 || squares <= 0.0 {
        return None;
    }
    let most = 2.0 * MOST_BEND / half;
    let bend = (sum(&|at| square(at) * frame(at).y) / squares).clamp(-most, most);
    const PIECES: i32 = 32;
    let place = |piece: i32| {
        let t = half * (f64::from(2 * piece) / f64::from(PIECES) - 1.0);
        let beside = bend * (t * t - half * half / 3.0);
        from + middle + along * t + along.perp() * beside
    };
    let is_within = |at: &DVec2| at.distance(from) <= reach;
    Some((0..=PIECES).map(place).filter(is_within).collect())
}

impl Range {
    /// Returns the places of the name along the crest or somewhat beside it, the best first. The letters stand as far
    /// apart as there is room. There are no places if the crest is too short for the name.
    pub fn write(&self, scale: Scale, labels: &LabelsStyle) -> Vec<Placed> {
        let style = labels.range;
        let typeface = labels.typeface(style.face);
        let (size_px, spacing, reach) = (scale.pixels(style.size_mm), style.spacing, scale.pixels(REACH_MM));
        let (room, size) = (length(&self.line), size_px as f32);
        let usual = shape(&self.name, typeface, size, spacing as f32).width;
        let gaps = (self.name.chars().count() - 1).max(1) as f64 * size_px;
        // A little less than the length of the line, to allow for rounding.
        let width = (room - 0.5 * size_px).min(MOST_STRETCH * usual);
        if width < usual {
            return Vec::new();
        }
        let name = shape(&self.name, typeface, size, (spacing + (width - usual) / gaps) as f32);
        let is_near = |at: &DVec2| at.distance(self.top) <= reach;
        let beside = BESIDE_LINE_MM.map(|mm| scale.pixels(mm) - 0.5 * name.cap_height);
        let places = beside.into_iter().filter_map(|lift| name.along(&self.line, 0.5 * (room - name.width), lift));
        places.filter(|placed| placed.boxes.iter().flatten().all(is_near)).collect()
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::preset::Preset;

    #[test]
    fn ranges_lie_apart_and_are_the_same_in_every_window() {
        let (_, mut preset) = Preset::load("alps").unwrap();
        // The expected ranges were found in the world of the bare seed; a country would make it another world.
        preset.country = None;
        let scale = Scale { metres_per_pixel: 1000.0, pixels_per_mm: 1.0 };
        let afar = Afar::new(&Arc::new(World::new(preset, Some(5)).unwrap()), scale);
        let clock = Clock::default();
        let ranges = |area| afar.look(area, &clock).unwrap().ranges(&clock).unwrap();
        let whole = ranges(Area::new(-300, -250, 600, 500));
        assert!(whole.len() > 10, "{}", whole.len());
        let apart = |a: &Range, b: &Range| a.top.distance(b.top);
        for (index, range) in whole.iter().enumerate() {
            let nearest = whole[..index].iter().map(|other| apart(range, other)).fold(f64::MAX, f64::min);
            assert!(nearest >= scale.pixels(APART_MM), "{} and another are {nearest} apart", range.name);
        }
        let part = Area::new(-180, -40, 300, 240);
        let reach = scale.pixels(REACH_MM) as usize;
        let near = |range: &&Range| {
            let DVec2 { x, y } = range.top;
            part.padded(reach).meets([x, y, x, y])
        };
        let seen = ranges(part);
        let [of_whole, of_part] = [&whole, &seen].map(|ranges| ranges.iter().filter(near).cloned().collect::<Vec<_>>());
        assert!(of_part.len() > 3 && of_part == of_whole, "{of_part:?}");
    }

    #[test]
    fn a_crest_follows_an_arc() {
        let arc = (-40..=40).map(|degrees| {
            let angle = f64::from(degrees) / 360.0 * TAU;
            (1.0, dvec2(100.0 * libm::sin(angle), 100.0 - 100.0 * libm::cos(angle)))
        });
        let arc: Vec<_> = arc.collect();
        let line = crest(&arc, dvec2(5.0, 7.0), 90.0).expect("there are places");
        assert!(line.windows(2).all(|pair| pair[1].x > pair[0].x));
        // Beyond the places, the crest goes on as a parabola and leaves the arc.
        let along_arc = |at: &&DVec2| (at.x - 5.0).abs() < 65.0;
        assert!(line.iter().filter(along_arc).count() > 20);
        for at in line.iter().filter(along_arc) {
            assert!((at.distance(dvec2(5.0, 107.0)) - 100.0).abs() < 7.0, "{at}");
        }
    }
}
