//! Lines and areas of a map: rivers, lakes, roads, houses and settlements of a part of the world, in pixels of its
//! scale.
//!
//! A line is simplified and smoothed as a whole, wherever the map ends, so that every map of one scale shows the same
//! line.

use std::collections::BTreeMap;

use glam::{DVec2, dvec2};
use rayon::prelude::*;

use crate::area::Area;
use crate::features::landforms::{LAKES, LakeFeature, SALT_PAN, valley_name};
use crate::features::sites::SiteFeature;
use crate::fluvial::landforms::lakes::LARGEST_LAKE;
use crate::lines::{Line, LineKind, LinePoint, RoadClass, StructureKind};
use crate::map::generalise::{bend, smooth, thinned};
use crate::map::houses::{self, Town};
use crate::map::names::{self, is_drawn};
use crate::map::plotter::{Item, Pen, Plotter, Shape, WIDEST, bounds, widened};
use crate::map::scale::Scale;
use crate::map::style::{Colour, Style};
use crate::map::symbols;
use crate::places::Places;
use crate::places::site::SiteClass;
use crate::stop::Stopped;
use crate::watch::Watch;
use crate::world::World;

/// Side in nodes of the parts of the world that are searched one by one.
const PART: i64 = 512;

/// Largest distance in metres from the middle of a river to its bank.
const WIDEST_M: f64 = 1000.0;

/// Smallest area in square pixels that a bend of a line spans; smaller bends are removed.
const LEAST_BEND: f64 = 0.4;

/// Side in millimetres of paper of the squares that show one town each, where there is not room for all.
const TOWN_MM: f64 = 36.0;

/// Number of equal strips into which a lake is cut from north to south. The chords between the strips are compared to
/// find the widest place.
const CHORDS: u32 = 12;

/// Area in square pixels of the smallest lake that is drawn.
const LEAST_LAKE: f64 = 6.0;

/// Smallest half width in pixels of the widest lakes of a level: levels on which all lakes are narrower are left out. No
/// lake is larger than [`LARGEST_LAKE`] squares of that half width, so none of theirs is as large as [`LEAST_LAKE`].
const LEAST_HALF_WIDTH: f64 = 0.15;
const _: () = assert!(LARGEST_LAKE * LEAST_HALF_WIDTH * LEAST_HALF_WIDTH <= LEAST_LAKE);

/// The same half width in a sketch, which leaves out some lakes that would be large enough.
const SKETCHED_HALF_WIDTH: f64 = 2.0;

/// Size of the smallest river that has a name, as a multiple of that of the smallest river that is drawn.
const NAMED: f64 = 6.0;

/// Size of the smallest river that is drawn at full width, as a multiple of that of the smallest river that is drawn.
const LARGEST: f64 = 3000.0;

/// Basin with which a river is as large as one with the usual runoff of its basin, as a multiple of that one's basin.
/// Dry countries would have no rivers on maps if discharge alone counted.
const DRY_BASINS: f64 = 4.0;

/// Exponent with which the basin of the smallest river that is drawn grows with the scale's denominator beyond
/// 1:100,000. At 2 it would cover the same area on paper at all scales, and a sheet of a continent would have none of its
/// rivers. By 1.5 it covers 0.8 cm2 at 1:1,000,000 and a fifth of that at 1:30,000,000 if it covers 2.5 cm2 at 1:100,000,
/// about as in atlases.
const BASIN_GROWTH: f64 = 1.5;

/// Size from which on a river is drawn that is large enough further down, as a multiple of that of the smallest river that
/// is drawn: maps choose whole rivers, and show them almost up to their springs.
const BEGINS: f64 = 0.2;

const SECONDS_A_YEAR: f64 = 31_557_600.0;

/// The size of the smallest river that is drawn.
#[derive(Clone, Copy, Debug)]
struct LeastRiver {
    /// Discharge in cubic metres a second.
    discharge_m3s: f64,
    /// Area in square metres that gives this discharge where the runoff is the usual one.
    basin_m2: f64,
}

impl LeastRiver {
    /// Returns the size of a river at a point, as a multiple of this one: 1 for agents' rivers, whose size is unknown.
    fn times(self, point: &LinePoint) -> f64 {
        if point.basin_m2 == 0.0 {
            return 1.0;
        }
        let by_basin = point.basin_m2 / (DRY_BASINS * self.basin_m2);
        (point.discharge_m3s / self.discharge_m3s.max(1e-9)).max(by_basin)
    }
}

/// Everything that a map draws as lines and areas in a part of the world.
#[derive(Debug, Default)]
pub(super) struct Drawing {
    pub lakes: Vec<LakeShape>,
    pub rivers: Vec<Strokes>,
    /// Parts of roads, from the worst class to the best.
    pub roads: Vec<RoadPart>,
    pub bridges: Vec<RoadPart>,
    pub tunnels: Vec<RoadPart>,
    pub houses: Vec<Shape>,
    pub sites: Vec<SiteFeature>,
    pub named: Vec<NamedRiver>,
}

/// A lake, in pixels.
#[derive(Clone, Debug)]
pub(super) struct LakeShape {
    pub shape: Shape,
    pub id: String,
    pub name: Option<String>,
    /// True for a salt pan.
    pub is_pan: bool,
    pub area_px: f64,
    /// A point well inside the lake, and the width of the lake there from west to east.
    pub middle: DVec2,
    pub widest: f64,
}

/// A river with a name, downstream from where it is large enough to be drawn, in pixels.
#[derive(Clone, Debug)]
pub(super) struct NamedRiver {
    pub id: String,
    pub name: String,
    /// Name of the valley in which the river flows, if it has one.
    pub valley: Option<String>,
    pub line: Vec<DVec2>,
    /// Largest width at which the river is drawn.
    pub width: f64,
    /// Size where it is largest, as a multiple of that of the smallest river that is drawn.
    pub size: f64,
}

/// A part of a road, in pixels.
#[derive(Debug)]
pub(super) struct RoadPart {
    pub class: RoadClass,
    /// Id of the whole road. The parts of a road follow one another in a list.
    pub id: String,
    pub shape: Shape,
}

/// A river in parts of one width each, in pixels, with its bounding box, which includes the width.
#[derive(Debug)]
pub(super) struct Strokes {
    pub id: String,
    pub name: String,
    pub bounds: [f64; 4],
    pub parts: Vec<(f64, Vec<DVec2>)>,
}

/// Smallest width of an open river, as a multiple of the width of a bank: two banks, and as much water as a bank
/// between them.
const LEAST_OPEN: f64 = 3.0;

impl Strokes {
    /// Returns the width of the water between the banks for each part, from the source on; 0 where the river is a line.
    ///
    /// The river is a line up to where it is wider than `banks`. From there on it is open as long as there is room
    /// between two banks that are `bank` pixels wide. If the river were open only where it is wider than `banks`, a
    /// river of about this width would come out dashed.
    pub fn open(&self, banks: f64, bank: f64) -> Vec<f64> {
        let mut is_open = false;
        let mut between = |width: f64| {
            is_open = width > if is_open { LEAST_OPEN * bank } else { banks };
            if is_open { width - 2.0 * bank } else { 0.0 }
        };
        self.parts.iter().map(|(width, _)| between(*width)).collect()
    }
}

impl LakeShape {
    fn new(lake: LakeFeature, rings: Vec<Vec<DVec2>>, area_px: f64) -> LakeShape {
        let shape = Shape::new(rings);
        let (middle, widest) = shape.widest(shape.bounds);
        let is_pan = lake.kind == SALT_PAN;
        LakeShape { shape, id: lake.id, name: lake.name, is_pan, area_px, middle, widest }
    }

    /// Returns the lake, or a part of it, as an object of a page.
    pub fn item(&self, kind: &'static str) -> Item<'_> {
        Item { kind, id: &self.id, name: self.name.as_deref().unwrap_or_default() }
    }
}

impl Shape {
    /// Returns the middle of the widest of some chords from west to east, within a rectangle, and the length of that
    /// chord.
    pub(super) fn widest(&self, [west, north, east, south]: [f64; 4]) -> (DVec2, f64) {
        let chords = (1..CHORDS).map(|number| north + (south - north) * f64::from(number) / f64::from(CHORDS));
        let widest = chords.map(|y| (self.widest_at(y, [west, east]), y)).max_by(|a, b| a.0.1.total_cmp(&b.0.1));
        let ((x, widest), y) = widest.expect("there are some chords");
        (dvec2(x, y), widest)
    }

    /// Returns the middle and the width of the widest part inside the shape at the row `y` of the map, between two
    /// edges.
    fn widest_at(&self, y: f64, [west, east]: [f64; 2]) -> (f64, f64) {
        let mut crossings: Vec<f64> = Vec::new();
        for pair in self.lines.iter().flat_map(|line| line.windows(2)) {
            let (from, to) = (pair[0], pair[1]);
            if (from.y <= y) != (to.y <= y) {
                crossings.push(from.x + (to.x - from.x) * (y - from.y) / (to.y - from.y));
            }
        }
        crossings.sort_by(f64::total_cmp);
        let within = crossings.chunks_exact(2).map(|pair| [pair[0].max(west), pair[1].min(east)]);
        let inside = within.filter(|pair| pair[0] < pair[1]).map(|pair| ((pair[0] + pair[1]) * 0.5, pair[1] - pair[0]));
        inside.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((west, 0.0))
    }
}

/// Finds everything that a map draws in a part of the world, and prepares it in a style and a scale.
pub(super) struct Draughtsman<'a> {
    pub style: &'a Style,
    pub scale: Scale,
    /// The world at the nodes of the scale.
    pub world: &'a World,
    /// The world at all vertices, which has the settlements. If `has_lines`, all settlements are drawn, and also roads
    /// and the rivers of agents.
    pub settled: &'a World,
    pub has_lines: bool,
    /// True if small things may be left out.
    pub is_sketch: bool,
    /// Counts the squares in which everything is found.
    pub watch: &'a Watch,
}

impl Draughtsman<'_> {
    /// Returns everything that lies in an area of pixels or reaches into it, and the named water within `pad` pixels
    /// around the area.
    pub fn draw(&self, seen: Area, pad: usize) -> Result<Drawing, Stopped> {
        let wide = (WIDEST_M / self.scale.metres_per_pixel) as usize;
        let area = seen.padded(pad.max(wide + WIDEST as usize));
        let mut drawing = Drawing::default();
        if self.style.water.draw {
            self.draw_water(area, &mut drawing)?;
        }
        let vertices = |area| self.scale.nodes_of(area, self.settled.spacing_m());
        let mut lines = Vec::new();
        if self.style.roads.draw && self.has_lines {
            // Roads cost more to plan than everything else, so plan only those that can be seen. A bridge is the widest
            // line of a road.
            let widest_mm = self.style.roads.classes.iter().map(|class| class.width_mm + 4.0 * class.casing_mm);
            let mut reach = self.scale.pixels(widest_mm.fold(0.0, f64::max)).min(WIDEST);
            if self.has_houses() {
                reach = reach.max(houses::REACH_M / self.scale.metres_per_pixel);
            }
            lines = self.draw_roads(vertices(seen.padded(reach as usize + 1)), &mut drawing)?;
        }
        let houses_px = if self.has_houses() { houses::MOST_M / self.scale.metres_per_pixel } else { 0.0 };
        let symbol_px = symbols::site_px(SiteClass::Town, self.scale);
        drawing.sites = self.sites(seen.padded((houses_px + symbol_px) as usize + 1))?;
        if self.has_houses() {
            let town = |site: &SiteFeature| Town { at: self.scale.pixel(site.at), population: site.population };
            let towns: Vec<Town> = drawing.sites.iter().map(town).collect();
            drawing.houses = houses::houses(&lines, &towns, self.scale.metres_per_pixel);
        }
        Ok(drawing)
    }

    /// True if the map shows houses: the scale is large enough, and the style draws settlements.
    fn has_houses(&self) -> bool {
        self.style.places.draw && self.has_lines && self.scale.denominator() <= self.style.places.houses_most
    }

    /// Finds everything in an area of nodes, part by part, as a stage of its own if it has a name. A thing that lies in
    /// several parts is returned once. The order is that of the keys.
    fn find<T: Send, K: Ord + Send>(
        &self,
        stage: Option<&'static str>,
        area: Area,
        find: impl Fn(&Area) -> Result<Vec<T>, Stopped> + Sync,
        key: impl Fn(&T) -> K + Sync,
    ) -> Result<Vec<T>, Stopped> {
        let part = |[x, y]: [i64; 2]| Area::new(x * PART, y * PART, PART as usize + 1, PART as usize + 1);
        let parts: Vec<Area> = area.square_numbers(PART).filter_map(|at| part(at).common(&area)).collect();
        if let Some(stage) = stage {
            self.watch.begin(stage, Some((parts.len() as u64, "squares")));
        }
        let found = |part: &Area| {
            let found = find(part)?;
            stage.map(|_| self.watch.add(1));
            Ok(found.into_iter().map(|it| (key(&it), it)).collect())
        };
        let found = parts.par_iter().map(found).collect::<Result<Vec<Vec<(K, T)>>, Stopped>>()?;
        Ok(found.into_iter().flatten().collect::<BTreeMap<K, T>>().into_values().collect())
    }

    fn draw_water(&self, area: Area, drawing: &mut Drawing) -> Result<(), Stopped> {
        let clock = &self.watch.clock;
        let nodes = self.scale.nodes_of(area, self.world.spacing_m());
        let outline = |ring: &Vec<[f64; 2]>| {
            let ring: Vec<DVec2> = ring.iter().map(|at| self.scale.pixel(*at)).collect();
            thinned(&ring, LEAST_BEND).into_iter().map(|index| ring[index]).collect::<Vec<_>>()
        };
        let least_px = if self.is_sketch { SKETCHED_HALF_WIDTH } else { LEAST_HALF_WIDTH };
        let lakes = |part: &Area| {
            let lakes = self.world.wide_lakes(part, least_px * self.scale.metres_per_pixel, clock)?;
            LAKES.features(self.world, lakes, clock)
        };
        for lake in self.find(Some("finding lakes"), nodes, lakes, |lake| lake.id.clone())? {
            let area_px = lake.area_m2 / self.scale.metres_per_pixel / self.scale.metres_per_pixel;
            if area_px >= LEAST_LAKE {
                let rings: Vec<Vec<DVec2>> = lake.rings.iter().map(|ring| smooth(&outline(ring))).collect();
                drawing.lakes.push(LakeShape::new(lake, rings, area_px));
            }
        }
        let least = self.least_river();
        let rivers = |world: &World, area: Area| {
            let through = |part: &Area| world.lines_through(LineKind::River, part, clock);
            self.find(Some("finding rivers"), area, through, |river| river.id)
        };
        let found = match (self.world.relief().fluvial(), self.has_lines) {
            (Some(_), _) => rivers(self.world, nodes)?,
            (None, true) => rivers(self.settled, self.scale.nodes_of(area, self.settled.spacing_m()))?,
            (None, false) => Vec::new(),
        };
        for river in found {
            let Some(strokes) = self.river(&river, least) else { continue };
            let size = river.points.iter().map(|point| least.times(point)).fold(0.0, f64::max);
            if let Some(name) = river.name.as_ref().filter(|_| size >= NAMED) {
                let line = strokes.parts.iter().flat_map(|(_, part)| part).copied().collect();
                let width = strokes.parts.iter().map(|(width, _)| *width).fold(0.0, f64::max);
                let (id, name, valley) = (river.id.to_string(), name.clone(), valley_name(self.world, &river));
                drawing.named.push(NamedRiver { id, name, valley, line, width, size });
            }
            drawing.rivers.push(strokes);
        }
        Ok(())
    }

    /// Returns the smallest river that is drawn.
    fn least_river(&self) -> LeastRiver {
        let runoff_m = self.world.relief().fluvial().map_or(0.0, |fluvial| fluvial.fields().usual_runoff_m());
        let share = self.scale.denominator() / 100_000.0;
        let growth = libm::pow(share, if share > 1.0 { BASIN_GROWTH } else { 2.0 });
        let least_km2 = self.style.water.least_km2 * growth;
        LeastRiver { basin_m2: least_km2 * 1e6, discharge_m3s: least_km2 * 1e6 * runoff_m / SECONDS_A_YEAR }
    }

    /// Returns the strokes of a river that is large enough somewhere, downstream from where it [begins](BEGINS).
    fn river(&self, river: &Line, least: LeastRiver) -> Option<Strokes> {
        let from = |size: f64| river.points.iter().position(|point| least.times(point) >= size);
        from(1.0)?;
        let points = &river.points[from(BEGINS)?..];
        let pixels_per_vertex = river.spacing_m / self.scale.metres_per_pixel;
        let place = |point| DVec2::from(river.place_from([0, 0], point)) * pixels_per_vertex;
        let at: Vec<DVec2> = points.iter().map(place).collect();
        let kept = thinned(&at, LEAST_BEND);
        let width = |index: usize| {
            let point = &points[index];
            let share = libm::log(least.times(point).max(1.0)) / libm::log(LARGEST);
            let [least, most] = self.style.water.river_mm.map(|mm| self.scale.pixels(mm));
            let drawn = least + (most - least) * share.min(1.0);
            // Round the width to sixths of a pixel, steps too small for the eye to see, so that a stroke covers many
            // points.
            (drawn.max(2.0 * point.half_width_m / self.scale.metres_per_pixel) * 6.0).round() / 6.0
        };
        let line: Vec<DVec2> = kept.iter().map(|index| at[*index]).collect();
        let mut parts: Vec<(f64, Vec<DVec2>)> = Vec::new();
        for (number, piece) in smooth_pieces(&line).into_iter().enumerate() {
            let width = width(kept[number]);
            match parts.last_mut() {
                Some((last, part)) if *last == width => part.extend(&piece[1..]),
                _ => parts.push((width, piece)),
            }
        }
        let half = parts.iter().map(|(width, _)| width / 2.0).fold(0.0, f64::max);
        let bounds = widened(bounds(parts.iter().flat_map(|(_, part)| part)), half);
        let (id, name) = (river.id.to_string(), river.name.clone().unwrap_or_default());
        Some(Strokes { id, name, bounds, parts })
    }

    /// Returns the settlements of an area of pixels that a map has room for: all of them, or the first town of each
    /// square of the world that reaches into the area.
    pub fn sites(&self, area: Area) -> Result<Vec<SiteFeature>, Stopped> {
        if !self.style.places.draw {
            return Ok(Vec::new());
        }
        let (settled, clock) = (self.settled, &self.watch.clock);
        let vertices = self.scale.nodes_of(area, settled.spacing_m());
        if self.has_lines {
            let sites = self.find(None, vertices, |part| settled.sites(part, clock), |site| site.id)?;
            let drawn = sites.into_iter().filter(|site| is_drawn(site.class, self.scale));
            return Ok(drawn.map(|site| SiteFeature::new(settled, &site)).collect());
        }
        let Some(cell_side) = settled.places().map(Places::site_side) else { return Ok(Vec::new()) };
        let square_m = TOWN_MM * self.scale.denominator() / 1000.0;
        let cells = (square_m / (cell_side as f64 * settled.spacing_m())).ceil() as i64;
        let side = cells * cell_side;
        let squares: Vec<[i64; 2]> = vertices.square_numbers(side).collect();
        let town = |square| {
            let site = settled.chief_site(square, cells, clock)?;
            Ok(site.map(|site| SiteFeature::new(settled, &site)))
        };
        squares.into_par_iter().filter_map(|square| town(square).transpose()).collect()
    }

    /// Draws roads. Returns the whole line of each road, with a number of its own.
    fn draw_roads(&self, vertices: Area, drawing: &mut Drawing) -> Result<Vec<(u64, Vec<DVec2>)>, Stopped> {
        let roads = |part: &Area| self.settled.lines_through(LineKind::Road, part, &self.watch.clock);
        let mut lines = Vec::new();
        for road in self.find(Some("planning roads"), vertices, roads, |road| road.id)? {
            if let Some(line) = drawing.add_road(self.style, self.scale, &road) {
                lines.push((names::hash_of(&road.id.to_string()), line));
            }
        }
        drawing.roads.sort_by_key(|road| road.class);
        Ok(lines)
    }
}

impl Drawing {
    /// Adds a road, if roads of its class are drawn at the scale. Returns the whole line, in pixels.
    pub fn add_road(&mut self, style: &Style, scale: Scale, road: &Line) -> Option<Vec<DVec2>> {
        let class = road.class.unwrap_or(RoadClass::Track);
        if scale.denominator() > style.roads.class(class).most {
            return None;
        }
        let pixels_per_vertex = road.spacing_m / scale.metres_per_pixel;
        let place = |point| DVec2::from(road.place_from([0, 0], point)) * pixels_per_vertex;
        let at: Vec<DVec2> = road.points.iter().map(place).collect();
        let part = |range: std::ops::RangeInclusive<usize>| {
            let part = &at[range];
            let line: Vec<DVec2> = thinned(part, LEAST_BEND * 0.25).into_iter().map(|index| part[index]).collect();
            RoadPart { class, id: road.id.to_string(), shape: Shape::new(vec![smooth(&line)]) }
        };
        // Tunnels are drawn apart from the visible parts of the road.
        let mut seen = 0;
        for structure in &road.structures {
            match structure.kind {
                StructureKind::Tunnel => {
                    if structure.first > seen {
                        self.roads.push(part(seen..=structure.first));
                    }
                    if structure.last > structure.first {
                        self.tunnels.push(part(structure.first..=structure.last));
                    }
                    seen = structure.last;
                }
                StructureKind::Bridge if structure.last > structure.first => {
                    self.bridges.push(part(structure.first..=structure.last));
                }
                _ => {}
            }
        }
        if seen + 1 < at.len() {
            self.roads.push(part(seen..=at.len() - 1));
        }
        Some(at)
    }

    /// Draws the roads: first tunnels, then bridges, then all casings, and last all roads, the better classes over the
    /// worse.
    pub fn draw_roads(&self, style: &Style, scale: Scale, canvas: &mut dyn Plotter) {
        let casing = style.roads.casing;
        let class = |class| style.roads.class(class);
        let line = |colour: Colour, mm: f64| Pen::solid(colour, scale.pixels(mm));
        let tunnel = |of: RoadClass| Pen {
            dash: Some([scale.pixels(0.6) as f32, scale.pixels(0.4) as f32]),
            ..line(casing, class(of).width_mm * 0.5)
        };
        stroke_parts(canvas, &self.tunnels, |_| "tunnel", tunnel);
        let bridge = |of: RoadClass| line(casing, class(of).width_mm + 4.0 * class(of).casing_mm);
        stroke_parts(canvas, &self.bridges, |_| "bridge", bridge);
        let cased = |of: RoadClass| line(casing, class(of).width_mm + 2.0 * class(of).casing_mm);
        stroke_parts(canvas, &self.roads, |_| "casing", cased);
        stroke_parts(canvas, &self.roads, RoadClass::name, |of| line(class(of).colour, class(of).width_mm));
    }
}

/// Draws parts of roads. The parts of one road form one object.
fn stroke_parts(
    canvas: &mut dyn Plotter,
    parts: &[RoadPart],
    kind: impl Fn(RoadClass) -> &'static str,
    pen: impl Fn(RoadClass) -> Pen,
) {
    for road in parts.chunk_by(|one, next| one.id == next.id) {
        canvas.item(&Item { kind: kind(road[0].class), id: &road[0].id, name: "" }, |canvas| {
            for part in road {
                canvas.stroke_shape(&part.shape, &pen(part.class));
            }
        });
    }
}

/// Returns one piece of a smooth line for each of its points, from the middle of the segment before the point to the
/// middle of the segment after it.
fn smooth_pieces(line: &[DVec2]) -> Vec<Vec<DVec2>> {
    let last = line.len() - 1;
    (0..line.len())
        .map(|index| {
            let from = if index == 0 { line[0] } else { line[index - 1].midpoint(line[index]) };
            let to = if index == last { line[last] } else { line[index].midpoint(line[index + 1]) };
            bend(from, line[index], to)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_river_about_as_wide_as_one_with_banks_is_not_dashed() {
        let strokes = |widths: &[f64]| Strokes {
            id: String::new(),
            name: String::new(),
            bounds: [0.0; 4],
            parts: widths.iter().map(|width| (*width, vec![DVec2::ZERO, DVec2::X])).collect(),
        };
        // A line at first, then open from the first wide part on, though later parts are narrower again and again.
        let river = strokes(&[2.0, 3.9, 4.1, 3.9, 4.1, 3.5, 4.2]);
        let open = river.open(4.0, 0.5);
        let between: Vec<f64> = [4.1, 3.9, 4.1, 3.5, 4.2].iter().map(|width| width - 1.0).collect();
        assert_eq!((&open[..2], &open[2..]), (&[0.0, 0.0][..], &between[..]));
        // Where there is no room for water between banks, the river is a line again.
        assert_eq!(strokes(&[5.0, 1.5, 2.0, 5.0]).open(4.0, 0.5), [4.0, 0.0, 0.0, 4.0]);
    }
}
