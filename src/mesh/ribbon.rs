//! Lines as ribbons: roads on their beds, and bridges as decks.

use super::Drape;
use crate::area::Area;
use crate::geometry::{LineSegment, length};
use crate::hash::combine;
use crate::lines::{Line, LineKind, LinePoint, StructureKind};
use crate::tile::Tile;

/// What a ribbon is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum RibbonKind {
    /// A road on the ground, or in a ford.
    Road,
    /// The deck of a bridge.
    Bridge,
}

/// Triangles along a line.
#[derive(Clone, Debug, PartialEq)]
pub struct Ribbon {
    /// What it is.
    pub kind: RibbonKind,
    /// Its vertices.
    pub vertices: Vec<RibbonVertex>,
    /// Counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

/// A vertex of a ribbon.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RibbonVertex {
    /// Where, in vertices of the lattice east and south of the tile's north-western corner.
    pub place: [f64; 2],
    /// Height in metres.
    pub height_m: f64,
    /// Unit normal: east, up, south.
    pub normal: [f32; 3],
    /// Across the ribbon from 0 to 1 from left to right, and along it, once a width.
    pub texture: [f32; 2],
}

/// How far a road lies above its bed in metres, so that the land between two vertices does not show through.
/// Chosen by eye.
const LIFT_M: f64 = 0.12;

/// Pieces of a road a cell: the ground bulges between two sections that are further apart.
const PIECES_A_CELL: f64 = 3.0;

/// Pieces beside a tunnel's mouth.
const MOUTH: usize = 6;

/// Metres between roads that lie on each other.
const STACK_M: f64 = 0.005;

/// Thickness in metres of a bridge's deck, and more a metre of its width. Chosen by eye: half a metre to a whole one, a
/// twentieth of spans of 10 to 20 m.
const DECK_M: (f64, f64) = (0.5, 0.05);

/// A point of a line: place in vertices of the lattice relative to some vertex, half width and height in metres.
#[derive(Clone, Copy)]
struct RibbonPoint {
    place: [f64; 2],
    half_width_m: f64,
    height_m: f64,
}

impl RibbonPoint {
    /// The way to another point, in vertices east and south.
    fn way(&self, to: &RibbonPoint) -> [f64; 2] {
        [0, 1].map(|axis| to.place[axis] - self.place[axis])
    }

    /// The point at a share of the way to another.
    fn towards(&self, to: &RibbonPoint, share: f64) -> RibbonPoint {
        let mix = |from: f64, to: f64| from + (to - from) * share;
        RibbonPoint {
            place: [0, 1].map(|axis| mix(self.place[axis], to.place[axis])),
            half_width_m: mix(self.half_width_m, to.half_width_m),
            height_m: mix(self.height_m, to.height_m),
        }
    }
}

/// The ribbons on a tile: those pieces of each road whose middle lies on it, the same wherever else it goes. They lie on the
/// `ground`, and may be off `tolerance` cells to the side.
pub fn ribbons(tile: &Tile, spacing_m: f64, ground: &Drape, tolerance: f64) -> Vec<Ribbon> {
    let area = tile.area();
    let mut builder = RibbonBuilder { area, spacing_m, ground, tolerance, lift_m: LIFT_M, all: Vec::new() };
    for line in tile.lines() {
        let others = tile.lines().iter().filter(|other| other.kind == LineKind::Road && other.id != line.id);
        builder.add_line(line, &others.map(AsRef::as_ref).collect::<Vec<&Line>>());
    }
    // Stable: ribbons of a kind follow each other, those of a line in its order.
    builder.all.sort_by_key(|ribbon| ribbon.kind);
    builder.all
}

struct RibbonBuilder<'a> {
    area: Area,
    spacing_m: f64,
    ground: &'a Drape,
    tolerance: f64,
    /// How far the road that is added lies above the ground, in metres.
    lift_m: f64,
    all: Vec<Ribbon>,
}

impl RibbonBuilder<'_> {
    /// Adds what is seen of a line; rivers have sheets of water, and a road that ends on one of the others ends at its edge.
    fn add_line(&mut self, line: &Line, others: &[&Line]) {
        if line.kind != LineKind::Road {
            return;
        }
        // Where roads meet they lie on each other: the better one above, and of two as good each at a height of its own.
        let class = line.class.map_or(0.0, |class| class as u8 as f64);
        let own = line.id.to_string().bytes().fold(0, |hash, byte| combine(hash, byte.into())) % 4;
        self.lift_m = LIFT_M + (class * 4.0 + own as f64) * STACK_M;
        let lift_m = self.lift_m;
        let corner = [self.area.x0, self.area.y0];
        let point = |point: &LinePoint| RibbonPoint {
            place: line.place_from(corner, point),
            half_width_m: point.half_width_m,
            height_m: point.level_m + lift_m,
        };
        let points: Vec<RibbonPoint> = line.points.iter().map(point).collect();
        let carriers = line.carriers();
        let kind = |piece: usize| match carriers[piece] {
            Some(StructureKind::Bridge) => Some(RibbonKind::Bridge),
            Some(StructureKind::Tunnel) => None,
            Some(StructureKind::Ford) | None => Some(RibbonKind::Road),
        };
        let covered = |point: &&RibbonPoint| others.iter().any(|other| self.covers(other, point));
        let is_hidden = hidden(&points, covered);
        self.add(&points, |piece| kind(piece).filter(|_| !is_hidden[piece] || !is_hidden[piece + 1]));
    }

    /// Whether a point lies on a road, but for where that ends: where several end none gives way.
    fn covers(&self, road: &Line, point: &RibbonPoint) -> bool {
        let corner = [self.area.x0, self.area.y0];
        let ends =
            [&road.points[0], &road.points[road.points.len() - 1]].map(|end| (road.place_from(corner, end), end));
        let is_end = |(place, end): &([f64; 2], &LinePoint)| {
            length([0, 1].map(|axis| place[axis] - point.place[axis])) < 2.0 * end.half_width_m / self.spacing_m
        };
        !ends.iter().any(is_end)
            && road.pieces().any(|[from, to]| {
                let piece = LineSegment::between(road.place_from(corner, from), road.place_from(corner, to));
                let half_width = from.half_width_m.min(to.half_width_m) / self.spacing_m;
                piece.touches(point.place, half_width) && piece.distance(point.place) < half_width
            })
    }

    /// Adds the pieces of a line that are the tile's, as one ribbon for each run of the same kind. Those without a kind, in
    /// the land, are not seen.
    fn add(&mut self, line: &[RibbonPoint], kind: impl Fn(usize) -> Option<RibbonKind>) {
        let side = (self.area.width() - 1) as f64;
        // On the ground a piece is a part of a cell, so that it follows it, and ends where the tile does.
        let (mut points, mut kinds) = (Vec::new(), Vec::new());
        for (piece, pair) in line.windows(2).enumerate() {
            let kind = kind(piece);
            points.push(pair[0]);
            kinds.push(kind);
            if kind == Some(RibbonKind::Bridge) || is_apart([&pair[0], &pair[1]], side) {
                continue;
            }
            let parts = (length(pair[0].way(&pair[1])) * PIECES_A_CELL).ceil().max(1.0);
            let mut inner: Vec<(f64, RibbonPoint)> = (1..parts as usize)
                .map(|part| part as f64 / parts)
                .map(|share| (share, pair[0].towards(&pair[1], share)))
                .collect();
            inner.extend(at_edges([&pair[0], &pair[1]], side));
            inner.sort_by(|a, b| a.0.total_cmp(&b.0));
            kinds.extend(inner.iter().map(|_| kind));
            points.extend(inner.into_iter().map(|(_, point)| point));
        }
        points.extend(line.last());
        let points = &points[..];
        // Next to a tunnel's mouth the ground rises between two vertices, in front of what is above it.
        let is_mouth =
            |index: usize| kinds[index.saturating_sub(MOUTH)..(index + MOUTH).min(kinds.len())].contains(&None);
        let is_ours = |piece: usize| {
            let middle = [0, 1].map(|axis| points[piece].place[axis].midpoint(points[piece + 1].place[axis]));
            middle.into_iter().all(|at| (0.0..side).contains(&at))
        };
        let ours: Vec<usize> =
            (0..points.len().saturating_sub(1)).filter(|piece| kinds[*piece].is_some() && is_ours(*piece)).collect();
        if ours.is_empty() {
            return;
        }
        // Metres from the line's start, so that what repeats along it does not depend on the tile.
        let mut along_m = vec![0.0];
        along_m.extend(points.windows(2).scan(0.0, |sum, pair| {
            *sum += length(pair[0].way(&pair[1])) * self.spacing_m;
            Some(*sum)
        }));
        for run in ours.chunk_by(|a, b| a + 1 == *b && kinds[*a] == kinds[*b]) {
            let (first, last) = (run[0], run[run.len() - 1] + 1);
            let kind = kinds[first].expect("what has no kind has been left out");
            let sections: Vec<Section> =
                (first..=last).map(|index| self.section(points, &along_m, index, kind, is_mouth(index))).collect();
            let sections = self.needed(sections);
            self.all.push(match kind {
                RibbonKind::Bridge => deck(&sections),
                RibbonKind::Road => strip(kind, &sections),
            });
        }
    }

    /// The sections without which a ribbon would be too far off to the side, or above or below the others.
    fn needed(&self, sections: Vec<Section>) -> Vec<Section> {
        let up_m = (self.tolerance * self.spacing_m).max(LIFT_M);
        // How far a section is from where it would be without it, in what may be missed. None may come to lie in the ground.
        let miss = |first: &Section, at: &Section, last: &Section| {
            let share = (at.along - first.along) / (last.along - first.along).max(1e-6);
            let between = |from: f64, to: f64| from + (to - from) * f64::from(share);
            let aside = |corner: fn(&Section) -> [f64; 2]| {
                let (from, to, here) = (corner(first), corner(last), corner(at));
                length([0, 1].map(|axis| here[axis] - between(from[axis], to[axis])))
            };
            let above_m = between(first.height_m, last.height_m) - at.height_m;
            let aside = aside(|section| section.left).max(aside(|section| section.right));
            (aside / self.tolerance).max(above_m / up_m).max(-above_m / (0.75 * LIFT_M))
        };
        let last = sections.len() - 1;
        let mut kept = vec![false; sections.len()];
        (kept[0], kept[last]) = (true, true);
        let mut open = vec![(0, last)];
        while let Some((first, last)) = open.pop() {
            let off = |at: &usize| miss(&sections[first], &sections[*at], &sections[last]);
            let worst = (first + 1..last).max_by(|a, b| off(a).total_cmp(&off(b)));
            if let Some(at) = worst.filter(|at| off(at) > 1.0) {
                kept[at] = true;
                open.extend([(first, at), (at, last)]);
            }
        }
        sections.into_iter().zip(kept).filter_map(|(section, kept)| kept.then_some(section)).collect()
    }

    /// The line across a point: left and right seen along the line, at right angles to where its neighbours lie.
    fn section(
        &self,
        points: &[RibbonPoint],
        along_m: &[f64],
        index: usize,
        kind: RibbonKind,
        is_mouth: bool,
    ) -> Section {
        let point = points[index];
        let (before, after) = (points[index.saturating_sub(1)], points[(index + 1).min(points.len() - 1)]);
        let way = before.way(&after);
        // Neighbours may lie at one place: then there is no direction, but no NaN either.
        let far = length(way).max(1e-9);
        let ahead = way.map(|axis| axis / far);
        // With x east and y south, what is left of east is north.
        let aside = [ahead[1], -ahead[0]].map(|axis| axis * point.half_width_m / self.spacing_m);
        let grade = (after.height_m - before.height_m) / (far * self.spacing_m);
        let up = 1.0 / (1.0 + grade * grade).sqrt();
        let left = [0, 1].map(|axis| point.place[axis] + aside[axis]);
        let right = [0, 1].map(|axis| point.place[axis] - aside[axis]);
        // Where tiles meet, both ask for the ground on the edge that they share, for no more of it is the same in both.
        let side = (self.area.width() - 1) as f64;
        let on_edge = point.place.map(|at| at == 0.0 || at == side);
        let under = |place: [f64; 2]| {
            let place = [0, 1].map(|axis| if on_edge[axis] { point.place[axis] } else { place[axis] });
            self.ground.between(place) + self.lift_m
        };
        let height_m = match kind {
            RibbonKind::Road if is_mouth => point.height_m,
            // Between two vertices the land may be higher than at either side of a road or in its middle.
            RibbonKind::Road => [left, point.place, right].map(under).into_iter().fold(f64::NEG_INFINITY, f64::max),
            RibbonKind::Bridge => point.height_m,
        };
        Section {
            left,
            right,
            height_m,
            width_m: 2.0 * point.half_width_m,
            // Once a width, so that a texture is not stretched; a river may begin without any.
            along: (along_m[index] / (2.0 * point.half_width_m).max(1e-3)) as f32,
            ahead,
            up: [-ahead[0] * grade * up, up, -ahead[1] * grade * up].map(|axis| axis as f32),
        }
    }
}

/// Whether a piece lies beside the square of a tile, by more than a road is wide.
fn is_apart([from, to]: [&RibbonPoint; 2], side: f64) -> bool {
    const BESIDE: f64 = 4.0;
    (0..2).any(|axis| {
        let (low, high) = (from.place[axis].min(to.place[axis]), from.place[axis].max(to.place[axis]));
        high < -BESIDE || low > side + BESIDE
    })
}

/// Where a piece crosses the edges of a tile, and at which share of it.
fn at_edges([from, to]: [&RibbonPoint; 2], side: f64) -> Vec<(f64, RibbonPoint)> {
    let mut found = Vec::new();
    for axis in 0..2 {
        let (start, end) = (from.place[axis], to.place[axis]);
        for edge in [0.0, side] {
            if (start < edge) != (end < edge) && start != edge && end != edge {
                let share = (edge - start) / (end - start);
                let mut point = from.towards(to, share);
                point.place[axis] = edge;
                found.push((share, point));
            }
        }
    }
    found
}

/// Of the points of a road that others cover, those from its ends on: what it shares with a road that it crosses is its own.
fn hidden(points: &[RibbonPoint], covered: impl Fn(&&RibbonPoint) -> bool) -> Vec<bool> {
    let from_start = points.iter().take_while(&covered).count();
    let from_end = points.iter().rev().take_while(covered).count();
    (0..points.len()).map(|at| at < from_start || at + from_end >= points.len()).collect()
}

/// What lies across a line at one of its points.
struct Section {
    left: [f64; 2],
    right: [f64; 2],
    height_m: f64,
    width_m: f64,
    along: f32,
    ahead: [f64; 2],
    up: [f32; 3],
}

impl Section {
    /// Height in metres of the underside of a deck.
    fn low_m(&self) -> f64 {
        self.height_m - (DECK_M.0 + DECK_M.1 * self.width_m)
    }

    fn vertex(&self, corner: Corner, normal: [f32; 3], across: f32) -> RibbonVertex {
        let (place, height_m) = corner(self);
        RibbonVertex { place, height_m, normal, texture: [across, self.along] }
    }
}

/// A corner of a section: where it lies, and its height in metres.
type Corner = fn(&Section) -> ([f64; 2], f64);

const LEFT_TOP: Corner = |section| (section.left, section.height_m);
const RIGHT_TOP: Corner = |section| (section.right, section.height_m);
const LEFT_LOW: Corner = |section| (section.left, section.low_m());
const RIGHT_LOW: Corner = |section| (section.right, section.low_m());

impl Ribbon {
    /// Adds a face along the sections, from one of their corners to another.
    fn add_face(&mut self, sections: &[Section], corners: [Corner; 2], normal: impl Fn(&Section) -> [f32; 3]) {
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

/// A strip from the first section to the last.
fn strip(kind: RibbonKind, sections: &[Section]) -> Ribbon {
    let mut ribbon = Ribbon { kind, vertices: Vec::new(), triangles: Vec::new() };
    ribbon.add_face(sections, [LEFT_TOP, RIGHT_TOP], |section| section.up);
    ribbon
}

/// A slab from the first section to the last, with a top, two sides, a bottom and two ends.
fn deck(sections: &[Section]) -> Ribbon {
    let mut ribbon = strip(RibbonKind::Bridge, sections);
    let leftwards = |section: &Section| [section.ahead[1] as f32, 0.0, -section.ahead[0] as f32];
    ribbon.add_face(sections, [LEFT_LOW, LEFT_TOP], leftwards);
    ribbon.add_face(sections, [RIGHT_TOP, RIGHT_LOW], |section| leftwards(section).map(|axis| -axis));
    ribbon.add_face(sections, [RIGHT_LOW, LEFT_LOW], |section| section.up.map(|axis| -axis));
    // The ends.
    let (start, end) = (&sections[0], &sections[sections.len() - 1]);
    for (section, ahead) in [(start, -1.0), (end, 1.0)] {
        let normal = [section.ahead[0] as f32 * ahead, 0.0, section.ahead[1] as f32 * ahead];
        let first = ribbon.vertices.len() as u32;
        for (corner, across) in [(LEFT_TOP, 0.0), (RIGHT_TOP, 1.0), (RIGHT_LOW, 1.0), (LEFT_LOW, 0.0)] {
            ribbon.vertices.push(section.vertex(corner, normal, across));
        }
        // Seen from ahead, left is on the right.
        let around = if ahead > 0.0 { [0, 1, 2, 3] } else { [1, 0, 3, 2] };
        ribbon.triangles.extend(quad(around.map(|corner| first + corner)));
    }
    ribbon
}

/// Two triangles for four corners.
fn quad([a, b, c, d]: [u32; 4]) -> [[u32; 3]; 2] {
    [[a, b, c], [a, c, d]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Grid;
    use crate::lines::Imprint;
    use crate::lines::tests::road;
    use crate::mesh::{Ground, Surface};

    #[test]
    fn a_road_ends_at_a_tunnel_and_goes_on_behind_it() {
        // Level at 50 m, 8 m between vertices, through a ridge of 90 m, with mouths between two of them.
        let area = Area::new(-70, 9, 33, 33);
        let ridge_m = |x: i64| if (-59..=-50).contains(&x) { 90.0 } else { 50.0 };
        let kind = |x: i64| (-60..=-49).contains(&x).then_some(StructureKind::Tunnel);
        let line = road((-70..=-39).map(|x| ([x as f64 + 0.5, 20.0], 50.0, kind(x))), 8.0);
        let mut heights = Grid::filled(area, 50.0);
        for y in area.y0..area.y1 {
            (area.x0..area.x1).for_each(|x| heights.row_mut(y, x, x + 1)[0] = ridge_m(x));
        }
        Imprint::new(&heights, None, [&line]).expect("the road is here").shape(&mut heights, None);
        let ground = Drape::new(&Ground::new(&Surface::full(32), &heights, area), &heights, area);
        let mut builder =
            RibbonBuilder { area, spacing_m: 8.0, ground: &ground, tolerance: 0.01, lift_m: LIFT_M, all: Vec::new() };
        builder.add_line(&line, &[]);
        let columns = |ribbon: &Ribbon| {
            let columns = || ribbon.vertices.iter().map(|vertex| vertex.place[0] + area.x0 as f64);
            (columns().fold(f64::INFINITY, f64::min), columns().fold(f64::NEG_INFINITY, f64::max))
        };
        assert_eq!(builder.all.iter().map(columns).collect::<Vec<_>>(), [(-69.5, -59.5), (-48.5, -38.5)]);
        for vertex in builder.all.iter().flat_map(|ribbon| &ribbon.vertices) {
            let above_m = vertex.height_m - 50.0 - LIFT_M;
            assert!((0.0..12.0 * STACK_M).contains(&above_m), "{vertex:?}");
        }
    }
}
