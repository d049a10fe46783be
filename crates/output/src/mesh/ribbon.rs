//! Lines as ribbons: roads on their beds, and bridges as decks.
//!
//! To judge the numbers chosen by eye, look at meshes of roads and bridges, in Blender.

use std::cmp::Reverse;
use std::sync::Arc;

use glam::DVec2;

use super::Ground;
use super::drape::draped;
use super::footprint::{RoadCorner, RoadPatch, footprint};
use super::polygon::{TilePoint, UNITS, bounds, doubled_area};
use crate::area::Area;
use crate::clock::Clock;
use crate::geometry::{come, furthest, simplified};
use crate::lines::{Line, LineKind, LinePoint, Lines, StructureKind};
use crate::stop::Stopped;
use crate::world::World;

/// The kind of a ribbon.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum RibbonKind {
    /// A road on the ground, or in a ford.
    Road,
    /// The deck of a bridge.
    Bridge,
}

/// A strip of triangles along a line.
#[derive(Clone, Debug, PartialEq)]
pub struct Ribbon {
    /// A road or a bridge.
    pub kind: RibbonKind,
    /// Vertices of the triangles.
    pub vertices: Vec<RibbonVertex>,
    /// Indices into `vertices`, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

/// A vertex of a ribbon.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RibbonVertex {
    /// Position in vertices of the lattice, east and south of the tile's north-western corner.
    pub place: [f64; 2],
    /// Height in metres.
    pub height_m: f64,
    /// Unit normal: east, up, south.
    pub normal: [f32; 3],
    /// Texture coordinates: across the ribbon from 0 at the left to 1 at the right, and along it, growing by 1 per
    /// ribbon width.
    pub texture: [f32; 2],
}

/// Height in metres of a road above the ground, so that neither shimmers through the other. Chosen by eye.
const LIFT_M: f64 = 0.12;

/// Distance in cells from a tunnel's mouth within which a road is level. In front of the mouth, the ground already
/// rises within a cell towards the slope above the tunnel.
const MOUTH: f64 = 2.0;

/// Greatest length in cells of a patch of road: the roads on a tile depend on no roads further away than this.
const LONGEST: f64 = 16.0;

/// Thickness in metres of a bridge's deck, and extra thickness per metre of its width. Chosen by eye: half a metre to a
/// metre, a twentieth of spans of 10 to 20 m.
const DECK_M: (f64, f64) = (0.5, 0.05);

/// The base that a piece of a road lies on.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Base {
    /// The ground.
    Ground,
    /// Ground that has been levelled for the road, at the mouth of a tunnel.
    Level,
    /// The road's own deck.
    Bridge,
}

/// A point of a line, with the half width and the height of the road.
#[derive(Clone, Copy)]
struct RibbonPoint {
    place: TilePoint,
    half_width_m: f64,
    height_m: f64,
}

impl RibbonPoint {
    /// Returns the vector to another point, in vertices east and south.
    fn way(&self, to: &RibbonPoint) -> DVec2 {
        cells_between(self.place, to.place)
    }

    /// Returns the point at a share of the way to another point.
    fn towards(&self, to: &RibbonPoint, share: f64) -> RibbonPoint {
        let mix = |from: f64, to: f64| from + (to - from) * share;
        RibbonPoint {
            place: [0, 1].map(|axis| self.place[axis] + in_units(self.way(to)[axis] * share)),
            half_width_m: mix(self.half_width_m, to.half_width_m),
            height_m: mix(self.height_m, to.height_m),
        }
    }
}

fn in_cells(units: i64) -> f64 {
    units as f64 / UNITS as f64
}

/// Returns the vector from one place to another, in cells.
fn cells_between(from: TilePoint, to: TilePoint) -> DVec2 {
    [0, 1].map(|axis| in_cells(to[axis] - from[axis])).into()
}

fn in_units(cells: f64) -> i64 {
    (cells * UNITS as f64 + 0.5).floor() as i64
}

/// Finds all roads that may reach into a tile, and the roads that may overlap them there.
///
/// # Errors
/// When `clock` stops the work.
pub fn roads_near(world: &World, area: &Area, clock: &Clock) -> Result<Lines, Stopped> {
    let preset = world.preset();
    let of_places = preset.places.iter().flat_map(|places| places.width_m);
    let widest_m = of_places.chain(preset.roads.iter().map(|roads| roads.width_m)).fold(0.0, f64::max);
    // Reach to the far end of a patch, and from a road's edge to its middle there.
    let around = LONGEST + 2.0 * widest_m / world.spacing_m();
    world.lines_through(LineKind::Road, &area.padded(around.ceil() as usize + 1), clock)
}

/// Returns the ribbons on a tile: roads on its ground, cut at the tile's edges, and the pieces of bridges whose middles
/// lie on the tile. `roads` are the roads [near](roads_near) the tile. Ribbons may be off by `tolerance` cells to the
/// side.
pub fn ribbons(area: &Area, roads: &[Arc<Line>], ground: &Ground, tolerance: f64) -> Vec<Ribbon> {
    let mut builder = RibbonBuilder { area, tolerance, strips: Vec::new(), ends: Vec::new(), all: Vec::new() };
    let mut roads: Vec<&Line> = roads.iter().map(AsRef::as_ref).collect();
    // The better road lies on top of the others, because roads end on a road of higher rank.
    roads.sort_by_key(|road| (Reverse(road.class), road.id));
    for (number, road) in roads.iter().enumerate() {
        builder.add_road(number, road);
    }
    // Joins lie on top of all roads.
    let RibbonBuilder { strips, ends, mut all, .. } = builder;
    let mut patches = joins(ends, roads.len());
    patches.extend(strips);
    let pieces = footprint(&patches, ground.cells);
    if !pieces.is_empty() {
        all.push(draped(&pieces, ground, LIFT_M));
    }
    // A stable sort: ribbons of one kind stay together, and the ribbons of a line keep their order.
    all.sort_by_key(|ribbon| ribbon.kind);
    all
}

/// Returns the round joins where several roads end at one place. `ends` are the ends of all roads with their half
/// widths; the joins are numbered from `first` on.
fn joins(mut ends: Vec<(TilePoint, i64)>, first: usize) -> Vec<RoadPatch> {
    ends.sort_unstable();
    let places = ends.chunk_by(|a, b| a.0 == b.0).filter(|ends| ends.len() > 1);
    // The ends are sorted, so the widest is the last.
    (first..).zip(places).map(|(road, ends)| RoadPatch::join(road, ends[0].0, ends[ends.len() - 1].1 as f64)).collect()
}

struct RibbonBuilder<'a> {
    area: &'a Area,
    tolerance: f64,
    /// Patches of roads on the ground, beginning with the road of the highest rank.
    strips: Vec<RoadPatch>,
    /// Places where roads end on the ground, and their half widths there in units.
    ends: Vec<(TilePoint, i64)>,
    all: Vec<Ribbon>,
}

impl RibbonBuilder<'_> {
    /// Adds the visible parts of a road: tunnels are invisible.
    fn add_road(&mut self, number: usize, road: &Line) {
        if road.points.len() < 2 {
            return;
        }
        let spacing_m = road.spacing_m;
        let corner = [self.area.x0, self.area.y0];
        let point = |point: &LinePoint| RibbonPoint {
            // Round the road's own coordinates first, so that all tiles round alike.
            place: [0, 1].map(|axis| in_units(point.place[axis]) + (road.origin[axis] - corner[axis]) * UNITS),
            half_width_m: point.half_width_m,
            height_m: point.level_m + LIFT_M,
        };
        let ends: Vec<RibbonPoint> = road.points.iter().map(point).collect();
        let (mut points, mut carriers) = (Vec::new(), Vec::new());
        for (pair, carrier) in ends.windows(2).zip(road.carriers()) {
            let parts = (pair[0].way(&pair[1]).length() / LONGEST).ceil().max(1.0) as usize;
            points.extend((0..parts).map(|part| pair[0].towards(&pair[1], part as f64 / parts as f64)));
            carriers.extend(vec![carrier; parts]);
        }
        points.extend(ends.last());
        let along: Vec<f64> = come(points.windows(2).map(|pair| pair[0].way(&pair[1]).length()));
        let bases = bases(&carriers, &along);
        for (end, base) in [(0, bases[0]), (points.len() - 1, bases[bases.len() - 1])] {
            if base == Some(Base::Ground) {
                self.ends.push((points[end].place, in_units(points[end].half_width_m / spacing_m)));
            }
        }
        let sections: Vec<Section> =
            (0..points.len()).map(|index| Section::new(&points, &along, index, spacing_m)).collect();
        let mut first = 0;
        for run in bases.chunk_by(|a, b| a == b) {
            let run_sections = &sections[first..=first + run.len()];
            first += run.len();
            match run[0] {
                Some(Base::Ground) => self.add_strip(number, &self.needed(run_sections, None)),
                Some(base) => self.add_ribbons(base, run_sections, spacing_m),
                None => {}
            }
        }
    }

    /// Adds the patches of a road on the ground, from section to section.
    fn add_strip(&mut self, road: usize, sections: &[Section]) {
        let side = (self.area.width() - 1) as i64 * UNITS;
        // Skip patches that are too far away to touch anything on the tile.
        let around = in_units(LONGEST + 1.0) + sections.iter().map(|section| section.half_width).max().unwrap_or(0) * 4;
        for pair in sections.windows(2) {
            let corners = [pair[0].left, pair[0].right, pair[1].right, pair[1].left];
            let [low, high] = bounds(&corners);
            if (0..2).any(|axis| high[axis] < -around || low[axis] > side + around) {
                continue;
            }
            let corner = |section: &Section, place: TilePoint, across: f32| RoadCorner {
                place,
                normal: section.up,
                texture: [across, section.along],
            };
            let corners = [
                corner(&pair[0], pair[0].left, 0.0),
                corner(&pair[0], pair[0].right, 1.0),
                corner(&pair[1], pair[1].right, 1.0),
                corner(&pair[1], pair[1].left, 0.0),
            ];
            let triangles = quad([0, 1, 2, 3]).map(|triangle| triangle.map(|corner| corners[corner as usize]));
            // In a bend narrower than the road, the inner edge runs backwards; the triangles beside it cover that area.
            let faces_up = |corners: &[RoadCorner; 3]| doubled_area(corners.map(|corner| corner.place)) > 0;
            self.strips
                .extend(triangles.into_iter().filter(faces_up).map(|corners| RoadPatch::triangle(road, corners)));
        }
    }

    /// Adds the tile's pieces of a bridge or of a level road: one ribbon for each run of consecutive pieces.
    fn add_ribbons(&mut self, base: Base, sections: &[Section], spacing_m: f64) {
        let side = 2 * (self.area.width() - 1) as i64 * UNITS;
        let is_ours = |piece: &usize| {
            let doubled_middle = [0, 1].map(|axis| sections[*piece].place[axis] + sections[*piece + 1].place[axis]);
            doubled_middle.into_iter().all(|at| (0..side).contains(&at))
        };
        let ours: Vec<usize> = (0..sections.len() - 1).filter(is_ours).collect();
        for run in ours.chunk_by(|a, b| a + 1 == *b) {
            let sections = self.needed(&sections[run[0]..=run[run.len() - 1] + 1], Some(spacing_m));
            self.all.push(match base {
                Base::Bridge => deck(&sections),
                Base::Ground | Base::Level => strip(RibbonKind::Road, &sections),
            });
        }
    }

    /// Returns the sections needed to keep a ribbon within the tolerance to the side. Given the metres between two
    /// vertices, for a ribbon that does not lie on the ground, heights must be within their tolerance too; otherwise no
    /// piece may become too long.
    fn needed(&self, sections: &[Section], spacing_m: Option<f64>) -> Vec<Section> {
        // Distance of a section from the ribbon without it, in units of the tolerance.
        let miss = |first: &Section, at: &Section, last: &Section| {
            let share = (at.come - first.come) / (last.come - first.come).max(1e-6);
            let aside = |corner: fn(&Section) -> TilePoint| {
                let way = |to: &Section| cells_between(corner(first), corner(to));
                (way(at) - way(last) * share).length()
            };
            let aside = aside(|section| section.left).max(aside(|section| section.right)) / self.tolerance;
            let Some(spacing_m) = spacing_m else { return aside };
            let above_m = first.height_m + (last.height_m - first.height_m) * share - at.height_m;
            let up_m = (self.tolerance * spacing_m).max(LIFT_M);
            aside.max(above_m / up_m).max(-above_m / (0.75 * LIFT_M))
        };
        let split = |first: usize, last: usize| {
            let (start, end) = (&sections[first], &sections[last]);
            let (worst, off) = furthest(first, last, |at| miss(start, &sections[at], end))?;
            let is_long = spacing_m.is_none() && end.come - start.come > LONGEST;
            if off > 1.0 { Some(worst) } else { is_long.then(|| first.midpoint(last)) }
        };
        simplified(sections.len(), split).into_iter().map(|at| sections[at]).collect()
    }
}

/// Returns the base of each piece of a road, `None` in a tunnel. `carriers` are the structures below the pieces,
/// `along` the cells from the road's start to each of its points.
fn bases(carriers: &[Option<StructureKind>], along: &[f64]) -> Vec<Option<Base>> {
    let is_tunnel = |piece: &usize| carriers[*piece] == Some(StructureKind::Tunnel);
    let tunnels: Vec<[f64; 2]> =
        (0..carriers.len()).filter(is_tunnel).map(|piece| [along[piece], along[piece + 1]]).collect();
    let is_mouth = |piece: usize| {
        tunnels.iter().any(|[start, end]| along[piece] < end + MOUTH && along[piece + 1] > start - MOUTH)
    };
    let base = |(piece, carrier): (usize, &Option<StructureKind>)| match carrier {
        Some(StructureKind::Bridge) => Some(Base::Bridge),
        Some(StructureKind::Tunnel) => None,
        Some(StructureKind::Ford) | None => Some(if is_mouth(piece) { Base::Level } else { Base::Ground }),
    };
    carriers.iter().enumerate().map(base).collect()
}

/// A cross section of a line at one of its points, at right angles to the direction between the neighbouring points.
/// Left and right are as seen along the line.
#[derive(Clone, Copy)]
struct Section {
    place: TilePoint,
    left: TilePoint,
    right: TilePoint,
    /// Distance in units from the middle to an edge.
    half_width: i64,
    height_m: f64,
    width_m: f64,
    /// Distance in cells from the line's start, so that patterns along the line do not depend on the tile.
    come: f64,
    /// The same distance in road widths, so that a texture is not stretched.
    along: f32,
    ahead: DVec2,
    up: [f32; 3],
}

impl Section {
    fn new(points: &[RibbonPoint], along: &[f64], index: usize, spacing_m: f64) -> Section {
        let point = points[index];
        let (before, after) = (points[index.saturating_sub(1)], points[(index + 1).min(points.len() - 1)]);
        let way = before.way(&after);
        // Neighbouring points may coincide: then there is no direction, but no NaN either.
        let far = way.length().max(1e-9);
        let ahead = way / far;
        // With x east and y south, left of east is north.
        let aside = (-ahead.perp() * point.half_width_m / spacing_m).to_array().map(in_units);
        let grade = (after.height_m - before.height_m) / (far * spacing_m);
        let up = 1.0 / (1.0 + grade * grade).sqrt();
        Section {
            place: point.place,
            left: [0, 1].map(|axis| point.place[axis] + aside[axis]),
            right: [0, 1].map(|axis| point.place[axis] - aside[axis]),
            half_width: in_units(point.half_width_m / spacing_m),
            height_m: point.height_m,
            width_m: 2.0 * point.half_width_m,
            come: along[index],
            along: (along[index] * spacing_m / (2.0 * point.half_width_m).max(1e-3)) as f32,
            ahead,
            up: [-ahead.x * grade * up, up, -ahead.y * grade * up].map(|axis| axis as f32),
        }
    }

    /// Height in metres of the underside of a deck.
    fn low_m(&self) -> f64 {
        self.height_m - (DECK_M.0 + DECK_M.1 * self.width_m)
    }

    fn vertex(&self, corner: SectionCorner, normal: [f32; 3], across: f32) -> RibbonVertex {
        let (place, height_m) = corner(self);
        RibbonVertex { place: place.map(in_cells), height_m, normal, texture: [across, self.along] }
    }
}

/// A corner of a section: returns its place, and its height in metres.
type SectionCorner = fn(&Section) -> (TilePoint, f64);

const LEFT_TOP: SectionCorner = |section| (section.left, section.height_m);
const RIGHT_TOP: SectionCorner = |section| (section.right, section.height_m);
const LEFT_LOW: SectionCorner = |section| (section.left, section.low_m());
const RIGHT_LOW: SectionCorner = |section| (section.right, section.low_m());

impl Ribbon {
    /// Adds a face along the sections, between two of their corners.
    fn add_face(&mut self, sections: &[Section], corners: [SectionCorner; 2], normal: impl Fn(&Section) -> [f32; 3]) {
        let first = self.vertices.len() as u32;
        for section in sections {
            for (across, corner) in [0.0, 1.0].into_iter().zip(corners) {
                self.vertices.push(section.vertex(corner, normal(section), across));
            }
        }
        let pieces = 0..sections.len() as u32 - 1;
        self.triangles.extend(pieces.flat_map(|piece| quad([0, 1, 3, 2].map(|corner| first + 2 * piece + corner))));
    }
}

/// Creates a strip from the first section to the last.
fn strip(kind: RibbonKind, sections: &[Section]) -> Ribbon {
    let mut ribbon = Ribbon { kind, vertices: Vec::new(), triangles: Vec::new() };
    ribbon.add_face(sections, [LEFT_TOP, RIGHT_TOP], |section| section.up);
    ribbon
}

/// Creates a slab from the first section to the last, with a top, two sides, a bottom and two ends.
fn deck(sections: &[Section]) -> Ribbon {
    let mut ribbon = strip(RibbonKind::Bridge, sections);
    let leftwards = |section: &Section| [section.ahead.y as f32, 0.0, -section.ahead.x as f32];
    ribbon.add_face(sections, [LEFT_LOW, LEFT_TOP], leftwards);
    ribbon.add_face(sections, [RIGHT_TOP, RIGHT_LOW], |section| leftwards(section).map(|axis| -axis));
    ribbon.add_face(sections, [RIGHT_LOW, LEFT_LOW], |section| section.up.map(|axis| -axis));
    // The ends.
    let (start, end) = (&sections[0], &sections[sections.len() - 1]);
    for (section, ahead) in [(start, -1.0), (end, 1.0)] {
        let normal = [section.ahead.x as f32 * ahead, 0.0, section.ahead.y as f32 * ahead];
        let first = ribbon.vertices.len() as u32;
        for (corner, across) in [(LEFT_TOP, 0.0), (RIGHT_TOP, 1.0), (RIGHT_LOW, 1.0), (LEFT_LOW, 0.0)] {
            ribbon.vertices.push(section.vertex(corner, normal, across));
        }
        // Seen from ahead, left and right are swapped.
        let around = if ahead > 0.0 { [0, 1, 2, 3] } else { [1, 0, 3, 2] };
        ribbon.triangles.extend(quad(around.map(|corner| first + corner)));
    }
    ribbon
}

/// Splits a quad into two triangles.
fn quad([a, b, c, d]: [u32; 4]) -> [[u32; 3]; 2] {
    [[a, b, c], [a, c, d]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::LineSegment;
    use crate::grid::Grid;
    use crate::hash::combine;
    use crate::lines::testing::road;
    use crate::lines::{Imprint, LineId, SiteId};
    use crate::mesh::Surface;

    /// Returns the triangles of ribbons in plan: the places of their corners.
    fn triangles(ribbons: &[Ribbon]) -> Vec<[[f64; 2]; 3]> {
        let of = |ribbon: &Ribbon| -> Vec<_> {
            let place = |corner: u32| ribbon.vertices[corner as usize].place;
            ribbon.triangles.iter().map(|triangle| triangle.map(place)).collect()
        };
        ribbons.iter().flat_map(of).collect()
    }

    /// Counts the triangles that a place lies in.
    fn layers(triangles: &[[[f64; 2]; 3]], [x, y]: [f64; 2]) -> usize {
        let left = |[a, b]: [[f64; 2]; 2]| (b[1] - a[1]) * (x - a[0]) - (b[0] - a[0]) * (y - a[1]);
        triangles
            .iter()
            .filter(|[a, b, c]| [[*a, *b], [*b, *c], [*c, *a]].into_iter().all(|edge| left(edge) > 0.0))
            .count()
    }

    /// Makes hilly ground, with metres of difference between neighbouring vertices.
    fn hilly(area: Area) -> Ground {
        let heights = Grid::of(area, |x, y| (combine(x as u64, y as u64) % 1000) as f32 * 0.01);
        Ground::new(&Surface::full(area.width() as u32 - 1), &heights, area)
    }

    /// Makes a straight road between two places, with 8 m between two vertices.
    fn straight(number: i64, from: [f64; 2], to: [f64; 2], half_width_m: f64) -> Arc<Line> {
        let at = |part: i32| [0, 1].map(|axis| from[axis] + (to[axis] - from[axis]) * f64::from(part) / 20.0);
        let mut line = road((0..=20).map(|part| (at(part), 5.0, None)), 8.0);
        line.points.iter_mut().for_each(|point| point.half_width_m = half_width_m);
        line.id = LineId::Road { from: SiteId { i: number, j: 0 }, to: SiteId { i: number, j: 1 }, part: 0 };
        Arc::new(line)
    }

    #[test]
    fn a_road_ends_at_a_tunnel_and_goes_on_behind_it() {
        // A level road at 50 m, 8 m between vertices, through a ridge of 90 m; the tunnel's mouths lie between two
        // vertices.
        let area = Area::new(-70, 9, 33, 33);
        let ridge_m = |x: i64| if (-59..=-50).contains(&x) { 90.0 } else { 50.0 };
        let kind = |x: i64| (-60..=-49).contains(&x).then_some(StructureKind::Tunnel);
        let line = road((-70..=-39).map(|x| ([x as f64 + 0.5, 20.0], 50.0, kind(x))), 8.0);
        let mut heights = Grid::of(area, |x, _| ridge_m(x));
        Imprint::new(&heights, None, [&line]).expect("the road is here").shape(&mut heights, None);
        let ground = Ground::new(&Surface::full(32), &heights, area);
        let all = ribbons(&area, &[Arc::new(line)], &ground, 0.01);
        let columns: Vec<f64> = triangles(&all).iter().flatten().map(|place| place[0] + area.x0 as f64).collect();
        let (low, high) = columns.iter().fold((f64::MAX, f64::MIN), |(low, high), at| (low.min(*at), high.max(*at)));
        assert_eq!((low, high), (-69.5, -38.5));
        assert!(!columns.iter().any(|at| (-59.4..-48.6).contains(at)), "the tunnel is not seen");
        assert!([-59.5, -48.5].iter().all(|mouth| columns.contains(mouth)), "the road goes to both mouths");
        for vertex in all.iter().flat_map(|ribbon| &ribbon.vertices) {
            assert!((vertex.height_m - 50.0 - LIFT_M).abs() < 0.01, "{vertex:?}");
        }
    }

    #[test]
    fn a_road_lies_on_the_ground_all_over() {
        let area = Area::new(-5, 40, 33, 33);
        let ground = hilly(area);
        let line = straight(0, [-3.0, 42.3], [25.0, 69.1], 2.5);
        for tolerance in [1.0 / 32.0, 0.25] {
            let all = ribbons(&area, std::slice::from_ref(&line), &ground, tolerance);
            // Test places inside the triangles and on their edges.
            let mut tried = 0;
            for ribbon in &all {
                for triangle in &ribbon.triangles {
                    let corners = triangle.map(|corner| ribbon.vertices[corner as usize]);
                    for shares in [[0.6, 0.3, 0.1], [0.1, 0.6, 0.3], [0.3, 0.1, 0.6], [0.5, 0.5, 0.0]] {
                        let mix = |value: &dyn Fn(&RibbonVertex) -> f64| -> f64 {
                            corners.iter().zip(shares).map(|(corner, share)| value(corner) * share).sum()
                        };
                        let [x, y] = [mix(&|corner| corner.place[0]), mix(&|corner| corner.place[1])];
                        let above_m = mix(&|corner| corner.height_m) - height_m(&ground, [x, y]);
                        assert!((above_m - LIFT_M).abs() < 0.01, "{above_m} m above the ground at {x} {y}");
                        tried += 1;
                    }
                }
            }
            assert!(tried > 200);
        }
    }

    /// Returns the height in metres of a ground with every vertex, whose cells have a diagonal from south-west to
    /// north-east.
    fn height_m(ground: &Ground, [x, y]: [f64; 2]) -> f64 {
        let (column, row) = (x as usize, y as usize);
        let (u, v) = (x - column as f64, y - row as f64);
        let side = ground.cells as usize + 1;
        let at = |east: usize, south: usize| f64::from(ground.vertices[(row + south) * side + column + east].height_m);
        if u + v <= 1.0 {
            at(0, 0) + (at(1, 0) - at(0, 0)) * u + (at(0, 1) - at(0, 0)) * v
        } else {
            at(1, 1) + (at(0, 1) - at(1, 1)) * (1.0 - u) + (at(1, 0) - at(1, 1)) * (1.0 - v)
        }
    }

    #[test]
    fn roads_that_meet_do_not_lie_on_each_other() {
        let area = Area::new(0, 0, 33, 33);
        let ground = hilly(area);
        let middle = [16.0, 15.5];
        let arms = |ways: &[([f64; 2], f64)]| -> Vec<Arc<Line>> {
            let to = |way: [f64; 2]| [0, 1].map(|axis| middle[axis] + way[axis]);
            (0..)
                .zip(ways)
                .map(|(number, (way, half_width_m))| straight(number, middle, to(*way), *half_width_m))
                .collect()
        };
        let crossing = |from, to| vec![straight(0, [1.0, 15.0], [30.0, 16.0], 3.0), straight(1, from, to, 2.0)];
        for (name, lines) in [
            ("two arms in a line", arms(&[([10.0, 0.0], 2.5), ([-10.0, 0.0], 2.5)])),
            ("two arms in a bend", arms(&[([10.0, 0.0], 2.5), ([0.0, 10.0], 2.5)])),
            ("two arms nearly beside each other", arms(&[([14.0, 0.0], 2.5), ([14.0, 0.7], 4.0)])),
            ("two arms on each other", arms(&[([10.0, 0.0], 2.5), ([10.0, 0.0], 2.5)])),
            (
                "five arms",
                arms(&[
                    ([9.0, 1.0], 1.5),
                    ([3.0, 9.0], 2.5),
                    ([-9.0, 5.0], 4.5),
                    ([-9.0, 2.0], 2.5),
                    ([1.0, -9.0], 1.5),
                ]),
            ),
            ("a road that ends on another", crossing([16.0, 15.5], [20.0, 29.0])),
            ("roads that cross", crossing([12.0, 2.0], [20.0, 29.0])),
        ] {
            let all = triangles(&ribbons(&area, &lines, &ground, 1.0 / 32.0));
            let apart: Vec<_> = lines
                .iter()
                .flat_map(|line| triangles(&ribbons(&area, std::slice::from_ref(line), &ground, 1.0 / 32.0)))
                .collect();
            let mut shared = 0;
            for place in
                (0..160).flat_map(|y| (0..160).map(move |x| [x, y].map(|at| 8.0 + (f64::from(at) + 0.37) * 0.1)))
            {
                let (together, alone) = (layers(&all, place), layers(&apart, place));
                // A place on the edge between two triangles counts as in neither.
                assert!(together <= 1, "{name}: {together} roads lie on each other at {place:?}");
                shared += usize::from(alone > 1);
                let [x, y] = [0, 1].map(|axis| place[axis] - middle[axis]);
                let in_join = x * x + y * y < 0.5625 * 0.5625;
                assert!(together >= alone.min(1) || on_edge(&all, place), "{name}: nothing lies at {place:?}");
                assert!(together <= alone || in_join, "{name}: {place:?} is of no road");
            }
            assert!(shared > 3 || name == "two arms in a line", "{name}: {shared} places are of several roads");
        }
    }

    /// True if a place lies on the edge of a triangle, or within rounding of one.
    fn on_edge(triangles: &[[[f64; 2]; 3]], place: [f64; 2]) -> bool {
        let edges = triangles.iter().flat_map(|[a, b, c]| [[*a, *b], [*b, *c], [*c, *a]]);
        edges.map(|[a, b]| LineSegment::between(a, b).distance(place)).any(|away| away < 2.0 / UNITS as f64)
    }

    #[test]
    fn a_junction_is_the_same_on_both_tiles_at_it() {
        let middle = [32.0, 15.5];
        let lines: Vec<Arc<Line>> = (0..)
            .zip([[9.0, 1.0], [0.3, 12.0], [-9.0, 5.0], [-9.0, 3.0]])
            .map(|(number, way)| straight(number, middle, [0, 1].map(|axis| middle[axis] + way[axis]), 3.0))
            .collect();
        let edge = |column: i64| {
            let area = Area::new(column, 0, 33, 33);
            let ribbons = ribbons(&area, &lines, &hilly(area), 1.0 / 32.0);
            let at = (32 - column) as f64;
            let vertices = ribbons.iter().flat_map(|ribbon| &ribbon.vertices).filter(|vertex| vertex.place[0] == at);
            let mut bits: Vec<_> = vertices
                .map(|vertex| {
                    (
                        vertex.place[1].to_bits(),
                        vertex.height_m.to_bits(),
                        vertex.normal.map(f32::to_bits),
                        vertex.texture.map(f32::to_bits),
                    )
                })
                .collect();
            bits.sort_unstable();
            bits.dedup();
            bits
        };
        assert!(edge(0).len() > 10);
        assert_eq!(edge(0), edge(32));
    }
}
