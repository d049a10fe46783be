//! The lines where water meets land on a tile: the banks of rivers, as smooth as the rivers are, and the shores of
//! lakes and the sea, where the land rises above the water.
//!
//! A river is known by its centre line and its width, which may be less than a cell: its banks lie between the vertices
//! of the raster. The shore of standing water crosses the edges of cells. Both lines have as few points as a tolerance
//! allows. Their points on the edge of a tile follow from what both tiles at the edge know.

use std::collections::{HashMap, HashSet};
use std::ops::RangeInclusive;

use glam::{DVec2, dvec2};

use super::PARTS;
use crate::area::Area;
use crate::clock::Clock;
use crate::contour::{Edge, chains, square};
use crate::geometry::{LineSegment, furthest, simplified};
use crate::grid::Grid;
use crate::land::WaterKind;
use crate::lines::{Line, LineKind, LinePoint};
use crate::stop::Stopped;
use crate::tile::Tile;
use crate::world::World;

/// Distance in metres by which the ground lies below the water's surface at its edge, so that neither shimmers through
/// the other.
pub const CLEAR_M: f32 = 0.05;

/// Parts per cell.
const CELL: f64 = PARTS as f64;

/// Vertices around a tile in which rivers are looked for: half the width of the widest river, and some more.
const AROUND: usize = 24;

/// A bank inside its own river, as in a tight bend, is left out if it lies within this share of the river's half width,
/// less these parts of a cell.
const INSIDE: (f64, f64) = (0.9, 4.0);

/// Parts of a cell by which a bank ends in front of the bank of a river that it joins, so that the two do not cross.
const APART: f64 = 3.0;

/// Parts of a cell beside a river's banks within which the raster's river is this river.
const BESIDE: f64 = 1.75 * CELL;

/// Number of edge crossings, the first of them counted twice, of a ring around four vertices. A shorter ring is no
/// river.
const SCRAP: usize = 9;

/// Least and greatest share of an edge on the wet side of a shore, so that no shore runs through a vertex.
const SHARE: [f64; 2] = [0.06, 0.94];

/// Distance in cells by which any line may be off to the side.
const FINEST: f64 = 1.0 / 32.0;

/// Number of sides of a round pool.
const POOL: usize = 12;

/// A point of a shore, of a bank, or of a river's centre line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WaterPoint {
    /// Position in [parts](PARTS) of a cell east and south of the tile's north-western corner.
    pub place: [i64; 2],
    /// Height in metres of the water's surface.
    pub level_m: f32,
    /// Height in metres of the ground.
    pub ground_m: f32,
}

/// A shore or a bank, point after point. The water is on its left if x east and y south are drawn with y up.
#[derive(Clone, Debug, PartialEq)]
pub struct Waterline {
    /// The water whose edge the line is.
    pub kind: WaterKind,
    /// The points of the line; at least one.
    pub points: Vec<WaterPoint>,
}

/// The waters of a tile, by their edges.
#[derive(Debug)]
pub struct Waterlines {
    /// Cells per side of the tile.
    cells: usize,
    /// Places of points are multiples of this number of parts.
    grain: i64,
    lines: Vec<Waterline>,
    /// Points of the rivers' centre lines, with the ground below them.
    beds: Vec<WaterPoint>,
    courses: Vec<CentreLine>,
    reaches: Reaches,
    standing: Standing,
    /// Water level at each vertex of the tile that a river covers, by column and row.
    covered: HashMap<[u32; 2], f32>,
}

/// A river: its centre line, in parts of a cell from the tile's corner.
#[derive(Debug)]
struct CentreLine {
    points: Vec<CentrePoint>,
}

#[derive(Clone, Copy, Debug)]
struct CentrePoint {
    place: [i64; 2],
    /// Distance in parts of a cell from the centre line to a bank.
    half: f64,
    level_m: f32,
    bed_m: f32,
}

/// Lookup of the pieces of rivers that may cover a place, each with the number of its river, by squares of the tile.
#[derive(Debug)]
struct Reaches {
    /// Number of squares per side.
    side: usize,
    /// Pieces in each square, row by row, in the order of the rivers.
    squares: Vec<Vec<(usize, [CentrePoint; 2])>>,
}

impl Reaches {
    /// Cells per side of a square.
    const SQUARE: usize = 16;

    fn new(courses: &[CentreLine], cells: usize) -> Reaches {
        let side = cells.div_ceil(Reaches::SQUARE);
        let mut squares = vec![Vec::new(); side * side];
        let square = Reaches::SQUARE as f64 * CELL;
        let pieces =
            courses.iter().enumerate().flat_map(|(number, course)| course.pieces().map(move |pair| (number, pair)));
        for (number, [from, to]) in pieces {
            let half = from.half.max(to.half) + APART;
            let range = |axis: usize| {
                let (low, high) = (from.place[axis].min(to.place[axis]), from.place[axis].max(to.place[axis]));
                let first = ((low as f64 - half) / square).floor().max(0.0) as usize;
                // Empty where the piece lies before the first square.
                first..((high as f64 + half) / square + 1.0).floor().clamp(0.0, side as f64) as usize
            };
            for row in range(1) {
                for column in range(0) {
                    squares[row * side + column].push((number, [*from, *to]));
                }
            }
        }
        Reaches { side, squares }
    }

    fn around(&self, place: [f64; 2]) -> &[(usize, [CentrePoint; 2])] {
        let at = |at: f64| ((at / (Reaches::SQUARE as f64 * CELL)) as usize).min(self.side - 1);
        &self.squares[at(place[1]) * self.side + at(place[0])]
    }
}

/// Standing water at the vertices of a tile and one vertex around them.
#[derive(Debug)]
struct Standing {
    /// Kind and level in metres of the water at each vertex, counted from the tile's corner.
    wet: Grid<Option<(WaterKind, f32)>>,
    heights_m: Grid<f32>,
}

impl Waterlines {
    /// Finds the waters of a tile; `None` if there are none. Lines may be off by `tolerance` cells to the side. Places
    /// are multiples of `grain` [parts](PARTS) of a cell, a power of two, so different points are at least that far
    /// apart.
    ///
    /// # Errors
    /// When `clock` stops the work.
    pub fn new(
        world: &World,
        tile: &Tile,
        tolerance: f64,
        grain: i64,
        clock: &Clock,
    ) -> Result<Option<Waterlines>, Stopped> {
        let area = tile.area();
        let near = area.padded(AROUND);
        let lines = world.lines_through(LineKind::River, &near, clock)?;
        let courses: Vec<CentreLine> =
            lines.iter().map(|line| CentreLine::new(line, &area, tolerance, grain)).collect();
        let standing = Standing::new(world, tile, &courses);
        if courses.is_empty() && standing.wet.values().iter().all(Option::is_none) {
            return Ok(None);
        }
        let cells = area.width() - 1;
        let reaches = Reaches::new(&courses, cells);
        let (lines, beds) = (Vec::new(), Vec::new());
        let mut waters = Waterlines { cells, grain, lines, beds, courses, reaches, standing, covered: HashMap::new() };
        waters.cover();
        waters.add_shores(tolerance);
        waters.add_rivers();
        Ok((!waters.lines.is_empty() || waters.standing.has_any(area)).then_some(waters))
    }

    /// Returns all points, no two of them at the same place.
    pub fn points(&self) -> Vec<WaterPoint> {
        let mut known: HashSet<[i64; 2]> = HashSet::new();
        let all = self.lines.iter().flat_map(|line| &line.points).chain(&self.beds);
        all.filter(|point| known.insert(point.place)).copied().collect()
    }

    /// Returns the pieces of shores and banks: the water whose edge each piece is, and its ends.
    pub fn pieces(&self) -> impl Iterator<Item = (WaterKind, [[i64; 2]; 2])> {
        self.lines
            .iter()
            .flat_map(|line| line.points.windows(2).map(|pair| (line.kind, [pair[0].place, pair[1].place])))
    }

    /// Returns the shores and banks.
    pub fn lines(&self) -> &[Waterline] {
        &self.lines
    }

    /// Number of parts of a cell that places are multiples of.
    pub fn grain(&self) -> i64 {
        self.grain
    }

    /// Cells per side of the tile.
    pub fn cells(&self) -> usize {
        self.cells
    }

    /// Returns the kind and the level in metres of the water at a vertex of the tile: standing water, or else a river.
    pub fn at_vertex(&self, [column, row]: [u32; 2]) -> Option<(WaterKind, f32)> {
        let river = || self.covered.get(&[column, row]).map(|level_m| (WaterKind::River, *level_m));
        self.standing.at(column.into(), row.into()).or_else(river)
    }

    /// True if a vertex of the tile is under water.
    pub fn covers(&self, [column, row]: [u32; 2]) -> bool {
        self.at_vertex([column, row]).is_some()
    }

    /// Returns the vertices of the tile that rivers cover, in any order.
    pub fn covered(&self) -> impl Iterator<Item = [u32; 2]> {
        self.covered.keys().copied()
    }

    /// Returns the height of the ground at a vertex of the tile: if a river covers it, lowered below the river's
    /// surface.
    pub fn lowered(&self, at: [u32; 2], height_m: f32) -> f32 {
        self.covered.get(&at).map_or(height_m, |level_m| height_m.min(level_m - 2.0 * CLEAR_M))
    }

    /// Returns the standing water at a place in the tile, as far as the four vertices around it tell.
    pub fn standing_at(&self, place: [f64; 2]) -> Option<WaterKind> {
        self.standing.between(place).filter(|(_, share)| *share >= 0.5).map(|((kind, _), _)| kind)
    }

    /// Returns the level of the standing water at a place in the tile or beside it.
    pub fn standing_level_m(&self, place: [f64; 2]) -> Option<f32> {
        self.standing.between(place).map(|((_, level_m), _)| level_m)
    }

    /// Returns the water at a piece of the tile's edge; the outer `None` means that the piece does not lie on the edge.
    pub fn border(&self, [from, to]: [[i64; 2]; 2]) -> Option<Option<WaterKind>> {
        let side = self.cells as i64 * i64::from(PARTS);
        let on_edge = |axis: usize| from[axis] == to[axis] && (from[axis] == 0 || from[axis] == side);
        let axis = if on_edge(0) {
            0
        } else if on_edge(1) {
            1
        } else {
            return None;
        };
        let middle = [0, 1].map(|axis| (from[axis] + to[axis]) as f64 / 2.0);
        let standing = || self.standing.on_edge(1 - axis, middle);
        // As everywhere, standing water comes before a river.
        Some(standing().or_else(|| self.is_river(middle).then_some(WaterKind::River)))
    }

    /// True if a river covers a place in the tile.
    pub fn is_river(&self, place: [f64; 2]) -> bool {
        self.river_at(place, 1.0, 0.0).is_some()
    }

    /// Returns the level of the river that covers a place, with its half width scaled by `share` and reduced by `less`
    /// parts.
    fn river_at(&self, place: [f64; 2], share: f64, less: f64) -> Option<f32> {
        let pieces = self.reaches.around(place).iter();
        let covering = pieces.filter_map(|(_, [from, to])| covering([from, to], place, share, less));
        // Of pieces that cover the place equally well, the first one is taken.
        covering.reduce(|best, next| if next.0 > best.0 { next } else { best }).map(|(_, level_m)| level_m)
    }

    /// True if a bank of a river must end at or in front of a place: at another river, or well inside its own river.
    fn is_joined(&self, course: usize, place: [f64; 2]) -> bool {
        self.reaches.around(place).iter().any(|(other, [from, to])| {
            let (share, less) = if *other == course { INSIDE } else { (1.0, -APART) };
            covering([from, to], place, share, less).is_some()
        })
    }

    /// Finds the vertices that rivers cover.
    fn cover(&mut self) {
        let mut covered: HashMap<[u32; 2], (f64, f32)> = HashMap::new();
        for pair in self.courses.iter().flat_map(CentreLine::pieces) {
            for vertex in vertices_near(pair, 0.0, 0..=self.cells as i64) {
                let Some((inside, level_m)) = covering(pair, vertex.map(|at| at as f64 * CELL), 1.0, 0.0) else {
                    continue;
                };
                let entry = covered.entry(vertex.map(|at| at as u32)).or_insert((inside, level_m));
                if inside > entry.0 {
                    *entry = (inside, level_m);
                }
            }
        }
        self.covered = covered.into_iter().map(|(at, (_, level_m))| (at, level_m)).collect();
    }

    /// Adds the shores of standing water.
    fn add_shores(&mut self, tolerance: f64) {
        let mut segments: Vec<[Edge; 2]> = Vec::new();
        for (column, row) in Area::new(0, 0, self.cells, self.cells).vertices() {
            // Two waters that touch at a corner are connected, because water narrower than a cell goes on there.
            let is_wet = |[dx, dy]: [i64; 2]| self.standing.at(column + dx, row + dy).is_some();
            let wet = [[0, 0], [1, 0], [1, 1], [0, 1]].map(|corner| if is_wet(corner) { 1.0 } else { 0.0 });
            square(wet, 0.5, [column, row], 1, &mut segments);
        }
        let miss = tolerance * CELL;
        let mut left_out: Vec<Vec<Edge>> = Vec::new();
        for chain in chains(&segments) {
            let points: Vec<WaterPoint> = chain.iter().map(|edge| self.standing.shore(*edge, self.grain)).collect();
            let split = |first: usize, end: usize| {
                let chord = LineSegment::between(points[first].at(), points[end].at());
                let (furthest, off) = furthest(first, end, |at| chord.nearest(points[at].at()).1)?;
                (off > miss * miss).then_some(furthest)
            };
            let kept = simplified(points.len(), split);
            // Leave out a ring that simplification reduces to a line, since it is as small as the tolerance; and a ring
            // of a vertex or two that the raster calls a river, since that is left over beside the river's banks.
            let is_ring = chain[0] == chain[chain.len() - 1];
            let is_scrap = self.standing.kind_at(chain[0]) == WaterKind::River && chain.len() < SCRAP;
            if is_ring && (kept.len() < 4 || is_scrap) {
                left_out.push(chain);
                continue;
            }
            // A shore ends at the mouth of a river.
            let is_shore = |point: &WaterPoint| !self.is_river(point.at());
            let mut kept: Vec<WaterPoint> = kept.into_iter().map(|at| points[at]).collect();
            if !self.standing.is_left(chain[0], [&points[0], &points[1]]) {
                kept.reverse();
            }
            let kind = self.standing.kind_at(chain[0]);
            let lines = runs(kept.into_iter(), is_shore, self.grain);
            self.lines.extend(lines.into_iter().map(|points| Waterline { kind, points }));
        }
        // Water without a shore must not stop banks either, so it is dried.
        for ring in &left_out {
            self.standing.dry(ring);
        }
    }

    /// Adds the banks and beds of rivers.
    fn add_rivers(&mut self) {
        let (mut lines, mut beds) = (Vec::new(), Vec::new());
        for (number, course) in self.courses.iter().enumerate() {
            let is_flowing = |point: &WaterPoint| self.standing.nearest(point.at()).is_none();
            let is_free = |point: &WaterPoint| is_flowing(point) && !self.is_joined(number, point.at());
            for side in course.banks(self.grain) {
                for line in clipped(&side, self.cells, self.grain) {
                    // Where a river joins another, its banks end, and the ground is a bed.
                    let joined = line.iter().filter(|point| is_flowing(point) && !is_free(point));
                    beds.extend(joined.map(|point| WaterPoint { ground_m: point.level_m - 4.0 * CLEAR_M, ..*point }));
                    lines.extend(runs(line.into_iter(), is_free, self.grain));
                }
            }
            for line in clipped(&course.bed(), self.cells, self.grain) {
                beds.extend(line.into_iter().filter(is_flowing));
            }
        }
        self.lines.extend(lines.into_iter().map(|points| Waterline { kind: WaterKind::River, points }));
        self.beds = beds;
    }
}

/// Returns the parts of a line whose points are good, extended to the last good point on the line. A single point stays
/// too: on the edge of a tile, the neighbour may have more of the line.
fn runs(
    line: impl Iterator<Item = WaterPoint>,
    is_good: impl Fn(&WaterPoint) -> bool,
    grain: i64,
) -> Vec<Vec<WaterPoint>> {
    let mut runs = vec![Vec::new()];
    let mut before: Option<(WaterPoint, bool)> = None;
    for point in line {
        let good = is_good(&point);
        if let Some((last, was_good)) = before
            && was_good != good
        {
            let (inside, outside) = if good { (point, last) } else { (last, point) };
            let end = last_good(inside, outside, &is_good, grain);
            let run: &mut Vec<WaterPoint> = runs.last_mut().expect("there is one");
            push(run, end);
            if !good {
                runs.push(Vec::new());
            }
        }
        if good {
            push(runs.last_mut().expect("there is one"), point);
        }
        before = Some((point, good));
    }
    runs.retain(|run| !run.is_empty());
    runs
}

/// Finds the last good point on the way from a good point to a bad one, by bisection.
fn last_good(good: WaterPoint, bad: WaterPoint, is_good: &impl Fn(&WaterPoint) -> bool, grain: i64) -> WaterPoint {
    let between = |share: f64| good.towards(&bad, share, grain);
    let (mut low, mut high) = (0.0, 1.0);
    // Sixteen steps find a part of a cell on lines of 256 cells.
    for _ in 0..16 {
        let middle = f64::midpoint(low, high);
        if is_good(&between(middle)) { low = middle } else { high = middle }
    }
    between(low)
}

/// Returns how far inside a piece of a river a place is, in parts, and the level there; `None` outside. The river's
/// half width is scaled by `share` and reduced by `less` parts.
fn covering([from, to]: [&CentrePoint; 2], place: [f64; 2], share: f64, less: f64) -> Option<(f64, f32)> {
    let (at, square) = LineSegment::between(from.at(), to.at()).nearest(place);
    let inside = (from.half + (to.half - from.half) * at) * share - less - square.sqrt();
    (inside > 0.0).then_some((inside, from.level_m + (to.level_m - from.level_m) * at as f32))
}

/// Returns the vertices, of those of some numbers along both axes, that a piece of a river may reach, if it is wider by
/// some parts to each side.
fn vertices_near(pair: [&CentrePoint; 2], wider: f64, within: RangeInclusive<i64>) -> impl Iterator<Item = [i64; 2]> {
    let reach = pair[0].half.max(pair[1].half) + wider;
    let range = move |axis: usize| {
        let [a, b] = pair.map(|point| point.place[axis]);
        let first = ((a.min(b) as f64 - reach) / CELL).ceil() as i64;
        first.max(*within.start())..=(((a.max(b) as f64 + reach) / CELL).floor() as i64).min(*within.end())
    };
    let columns = range(0);
    range(1).flat_map(move |row| columns.clone().map(move |column| [column, row]))
}

impl WaterPoint {
    /// Returns the place as numbers that are computed with.
    fn at(&self) -> [f64; 2] {
        self.place.map(|at| at as f64)
    }

    /// Returns the point at a share of the way to another one, on a multiple of `grain`.
    pub(super) fn towards(&self, to: &WaterPoint, share: f64, grain: i64) -> WaterPoint {
        let mix = |from: f32, to: f32| from + (to - from) * share as f32;
        WaterPoint {
            place: [0, 1]
                .map(|axis| self.place[axis] + snapped((to.place[axis] - self.place[axis]) as f64 * share, grain)),
            level_m: mix(self.level_m, to.level_m),
            ground_m: mix(self.ground_m, to.ground_m),
        }
    }
}

impl CentreLine {
    /// Simplifies a river near a tile within the tolerance. The whole river is looked at, so that each tile gets the
    /// same line.
    fn new(line: &Line, area: &Area, tolerance: f64, grain: i64) -> CentreLine {
        let spacing_m = line.spacing_m;
        let point = |point: &LinePoint| {
            let place = line.place_from([area.x0, area.y0], point);
            CentrePoint {
                place: place.map(|at| snapped(at * CELL, grain)),
                half: point.half_width_m / spacing_m * CELL,
                level_m: point.level_m as f32,
                bed_m: (point.floor_m as f32).min(point.level_m as f32 - 4.0 * CLEAR_M),
            }
        };
        let points: Vec<CentrePoint> = line.points.iter().map(point).collect();
        // Leave out points that are closer to a straight line than these tolerances: to the side, in width, and in
        // height. A narrow river may move by half of its half width at most, or by `FINEST`, which is invisible.
        let narrow = |point: &CentrePoint| (point.half / 2.0).max(FINEST * CELL);
        let miss_m = (tolerance * spacing_m / 8.0) as f32;
        let split = |first: usize, end: usize| {
            let off = |at: usize| {
                let miss = (tolerance * CELL).min(narrow(&points[at]));
                points[at].miss(&points[first], &points[end], miss, miss_m)
            };
            furthest(first, end, off).filter(|(_, off)| *off > 1.0).map(|(at, _)| at)
        };
        CentreLine { points: simplified(points.len(), split).into_iter().map(|at| points[at]).collect() }
    }

    fn pieces(&self) -> impl Iterator<Item = [&CentrePoint; 2]> {
        let last = self.points.len() - 1;
        (0..last.max(1)).map(move |at| [&self.points[at], &self.points[(at + 1).min(last)]])
    }

    /// Returns the two banks, or the ring around a round pool.
    fn banks(&self, grain: i64) -> Vec<Vec<WaterPoint>> {
        let at = |point: &CentrePoint, aside: DVec2| WaterPoint {
            place: [0, 1].map(|axis| point.place[axis] + snapped(aside[axis], grain)),
            level_m: point.level_m,
            ground_m: point.level_m - CLEAR_M,
        };
        if let [pool] = &self.points[..] {
            let corner = |corner: usize| {
                let angle = (corner % POOL) as f64 / POOL as f64 * std::f64::consts::TAU;
                at(pool, pool.half * dvec2(libm::cos(angle), libm::sin(angle)))
            };
            return vec![(0..=POOL).map(corner).collect()];
        }
        let (mut left, mut right) = (Vec::new(), Vec::new());
        for (index, point) in self.points.iter().enumerate() {
            let before = &self.points[index.saturating_sub(1)];
            let after = &self.points[(index + 1).min(self.points.len() - 1)];
            let unit = |way: DVec2| way / way.length().max(1e-9);
            let way = |from: &CentrePoint, to: &CentrePoint| unit(DVec2::from(to.at()) - DVec2::from(from.at()));
            let aside = unit(way(before, point) + way(point, after)).perp() * point.half;
            left.push(at(point, -aside));
            right.push(at(point, aside));
        }
        // The banks are joined around the source, and open where the river ends in other water.
        right.insert(0, left[0]);
        right.reverse();
        vec![left, right]
    }

    /// Returns the centre line on the river's bed.
    fn bed(&self) -> Vec<WaterPoint> {
        let point =
            |point: &CentrePoint| WaterPoint { place: point.place, level_m: point.level_m, ground_m: point.bed_m };
        self.points.iter().map(point).collect()
    }
}

impl CentrePoint {
    /// Returns the place as numbers that are computed with.
    fn at(&self) -> [f64; 2] {
        self.place.map(|at| at as f64)
    }

    /// Returns the distance from the line between two points, in width and height too, in units of the tolerances.
    fn miss(&self, from: &CentrePoint, to: &CentrePoint, miss: f64, miss_m: f32) -> f64 {
        let (at, square) = LineSegment::between(from.at(), to.at()).nearest(self.at());
        let narrow = (self.half - (from.half + (to.half - from.half) * at)).abs();
        let up = (self.level_m - (from.level_m + (to.level_m - from.level_m) * at as f32)).abs();
        (square.sqrt() / miss).max(narrow / miss).max(f64::from(up / miss_m))
    }
}

impl Standing {
    fn new(world: &World, tile: &Tile, courses: &[CentreLine]) -> Standing {
        let Area { x0, y0, .. } = tile.area();
        // One vertex around the tile is used, even if the tile knows more, so that neighbours agree.
        let area = Area::new(0, 0, tile.area().width(), tile.area().height()).padded(1);
        let sea_m = world.preset().sea_level_m.map_or(f32::NEG_INFINITY, |level_m| level_m as f32);
        let heights_m = Grid::of(area, |column, row| tile.heights().at(x0 + column, y0 + row));
        let wet = Grid::of(area, |column, row| {
            let (x, y, height_m) = (x0 + column, y0 + row, heights_m.at(column, row));
            let kind = match tile.water() {
                Some(water) => water.kind.at(x, y),
                None if height_m < sea_m => WaterKind::Sea,
                None => WaterKind::Dry,
            };
            match kind {
                WaterKind::Dry => None,
                WaterKind::Sea => Some((kind, sea_m)),
                WaterKind::Lake | WaterKind::River => {
                    let depth_m = tile.water().map_or(0.0, |water| water.depth_m.at(x, y));
                    // Round levels, so that a lake whose level was a sum of floats is flat.
                    Some((kind, ((height_m + depth_m) * LEVELS_A_METRE).round() / LEVELS_A_METRE))
                }
            }
        });
        let mut standing = Standing { wet, heights_m };
        standing.leave_out(courses);
        standing
    }

    /// Removes the raster's water of rivers that have banks of their own. Side arms and oxbow lakes have none and stay.
    fn leave_out(&mut self, courses: &[CentreLine]) {
        for pair in courses.iter().flat_map(CentreLine::pieces) {
            // Reach beyond the banks to the next vertices: the raster's rivers are a little wider and begin a little
            // earlier.
            for [column, row] in vertices_near(pair, BESIDE, -1..=self.last() + 1) {
                let place = [column, row].map(|at| at as f64 * CELL);
                let beside = covering(pair, place, 1.0, -BESIDE).is_some();
                if beside && matches!(self.at(column, row), Some((WaterKind::River, _))) {
                    self.wet.row_mut(row, column, column + 1)[0] = None;
                }
            }
        }
    }

    fn has_any(&self, area: Area) -> bool {
        (0..area.height() as i64).any(|row| (0..area.width() as i64).any(|column| self.at(column, row).is_some()))
    }

    /// Returns the last column and row of the tile.
    fn last(&self) -> i64 {
        self.wet.area().x1 - 2
    }

    /// Returns the water at a vertex, counted from the tile's corner.
    fn at(&self, column: i64, row: i64) -> Option<(WaterKind, f32)> {
        self.wet.at(column, row)
    }

    /// Returns the water at the vertex nearest to a place.
    fn nearest(&self, place: [f64; 2]) -> Option<(WaterKind, f32)> {
        let [column, row] = place.map(|at| ((at / CELL).round() as i64).clamp(0, self.last()));
        self.at(column, row)
    }

    /// Returns the two ends of an edge between vertices, and the index of the end that is under water.
    fn ends(&self, (column, row, south): Edge) -> ([(i64, i64); 2], usize) {
        let (dx, dy) = if south { (0, 1) } else { (1, 0) };
        let ends = [(column, row), (column + dx, row + dy)];
        (ends, usize::from(self.at(ends[0].0, ends[0].1).is_none()))
    }

    /// Returns the kind of water whose shore crosses an edge.
    fn kind_at(&self, edge: Edge) -> WaterKind {
        let (ends, under) = self.ends(edge);
        self.at(ends[under].0, ends[under].1).expect("a shore has water on one side").0
    }

    /// Dries the water inside a ring of edges that its shore crosses. A ring around land, an island, changes nothing.
    fn dry(&mut self, ring: &[Edge]) {
        // The northernmost edge that runs south enters the ring from outside.
        let Some(first) = ring.iter().filter(|(_, _, south)| *south).min_by_key(|(_, row, _)| *row) else { return };
        let ([_, inside], 1) = self.ends(*first) else { return };
        let mut open = vec![inside];
        while let Some((column, row)) = open.pop() {
            if self.wet.row_mut(row, column, column + 1)[0].take().is_some() {
                // Waters that touch at a corner are connected.
                open.extend((-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (column + dx, row + dy))));
            }
        }
    }

    /// True if the water is on the left of a shore that begins on an edge.
    fn is_left(&self, edge: Edge, [first, second]: [&WaterPoint; 2]) -> bool {
        let (ends, under) = self.ends(edge);
        let wet = [ends[under].0, ends[under].1].map(|at| at * i64::from(PARTS));
        let along = [0, 1].map(|axis| second.place[axis] - first.place[axis]);
        let aside = [0, 1].map(|axis| wet[axis] - first.place[axis]);
        along[0] * aside[1] - along[1] * aside[0] > 0
    }

    /// Returns the standing water at the vertices around a place, and the share of the surroundings that is under
    /// water.
    fn between(&self, place: [f64; 2]) -> Option<((WaterKind, f32), f64)> {
        let [column, row] = place.map(|at| ((at / CELL).floor() as i64).clamp(0, self.last() - 1));
        let [u, v] = [place[0] / CELL - column as f64, place[1] / CELL - row as f64];
        let corners = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(dx, dy)| self.at(column + dx, row + dy));
        let shares = [(1.0 - u) * (1.0 - v), u * (1.0 - v), (1.0 - u) * v, u * v];
        let wet: f64 = corners.iter().zip(shares).filter(|(corner, _)| corner.is_some()).map(|(_, share)| share).sum();
        // Of the waters at the corners, the greatest kind; of one kind, the highest level.
        let greatest = corners.into_iter().flatten().reduce(|a, b| if b > a { b } else { a });
        greatest.map(|greatest| (greatest, wet))
    }

    /// Returns the standing water at a place on a line of the raster that runs along an axis.
    fn on_edge(&self, axis: usize, place: [f64; 2]) -> Option<WaterKind> {
        let mut first = place.map(|at| (at / CELL).round() as i64);
        first[axis] = ((place[axis] / CELL).floor() as i64).clamp(0, self.last() - 1);
        let mut second = first;
        second[axis] += 1;
        let ends = [first, second].map(|[column, row]| self.at(column, row));
        match ends {
            [Some((kind, _)), Some((other, _))] => Some(kind.max(other)),
            [None, None] => None,
            _ => {
                let edge = (first[0], first[1], axis == 1);
                let shore = self.share(edge) * CELL + first[axis] as f64 * CELL;
                let is_first = place[axis] < shore;
                ends[usize::from(!is_first)].map(|(kind, _)| kind)
            }
        }
    }

    /// Returns the share of an edge between two vertices at which a shore crosses it.
    fn share(&self, edge: Edge) -> f64 {
        let (ends, under) = self.ends(edge);
        let heights_m = ends.map(|(column, row)| self.heights_m.at(column, row));
        let over = 1 - under;
        let (_, level_m) = self.at(ends[under].0, ends[under].1).expect("a shore has water on one side");
        let rise_m = f64::from(heights_m[over] - heights_m[under]);
        let share = match f64::from(level_m - heights_m[under]) {
            depth_m if rise_m > depth_m && depth_m >= 0.0 => depth_m / rise_m,
            // The land is no higher than the water, as beyond a spillway.
            _ => 0.5,
        };
        let share = share.clamp(SHARE[0], SHARE[1]);
        if under == 0 { share } else { 1.0 - share }
    }

    /// Returns the point of a shore on an edge between two vertices.
    fn shore(&self, edge: Edge, grain: i64) -> WaterPoint {
        let (ends, under) = self.ends(edge);
        let (_, level_m) = self.at(ends[under].0, ends[under].1).expect("a shore has water on one side");
        let along = snapped(self.share(edge) * CELL, grain);
        let (column, row, south) = edge;
        let (dx, dy) = if south { (0, along) } else { (along, 0) };
        let place = [column * i64::from(PARTS) + dx, row * i64::from(PARTS) + dy];
        WaterPoint { place, level_m, ground_m: level_m - CLEAR_M }
    }
}

/// Water levels are rounded to steps; this is the number of steps per metre.
const LEVELS_A_METRE: f32 = 64.0;

/// Returns the parts of a line within a square of `cells` cells, with points where the line crosses the square's edge.
/// Their places do not depend on the side of the edge on which the square lies.
fn clipped(line: &[WaterPoint], cells: usize, grain: i64) -> Vec<Vec<WaterPoint>> {
    let side = cells as i64 * i64::from(PARTS);
    let is_within = |point: &WaterPoint| point.place.iter().all(|at| (0..=side).contains(at));
    let mut parts: Vec<Vec<WaterPoint>> = vec![Vec::new()];
    for (index, point) in line.iter().enumerate() {
        if index > 0 {
            let mut crossings = crossings(&line[index - 1], point, side, grain);
            crossings.sort_by(|a, b| a.0.total_cmp(&b.0));
            for (_, crossing) in crossings {
                push(parts.last_mut().expect("there is one"), crossing);
            }
            if !is_within(point) && parts.last().is_some_and(|part| !part.is_empty()) {
                parts.push(Vec::new());
            }
        }
        if is_within(point) {
            push(parts.last_mut().expect("there is one"), *point);
        }
    }
    parts.retain(|part| !part.is_empty());
    parts
}

fn push(part: &mut Vec<WaterPoint>, point: WaterPoint) {
    if part.last().is_none_or(|last| last.place != point.place) {
        part.push(point);
    }
}

/// Returns the multiple of `grain` that is nearest to a number of parts.
pub(super) fn snapped(parts: f64, grain: i64) -> i64 {
    // Halves are rounded in the same direction, whatever the corner from which they are counted.
    (parts / grain as f64 + 0.5).floor() as i64 * grain
}

/// Returns the points where a straight piece crosses the edge of a square, with their shares of its length.
fn crossings(from: &WaterPoint, to: &WaterPoint, side: i64, grain: i64) -> Vec<(f64, WaterPoint)> {
    let mut found = Vec::new();
    for axis in 0..2 {
        let (start, end) = (from.place[axis], to.place[axis]);
        for edge in [0, side] {
            if (start < edge) == (end < edge) || start == edge || end == edge {
                continue;
            }
            // Whole numbers, computed from the same end in both tiles, are rounded alike wherever the corner is.
            let (across, along) = (to.place[1 - axis] - from.place[1 - axis], end - start);
            let at = from.place[1 - axis] + (2 * across * (edge - start) + along).div_euclid(2 * along);
            let at = (at + grain / 2).div_euclid(grain) * grain;
            if !(0..=side).contains(&at) {
                continue;
            }
            let share = (edge - start) as f64 / along as f64;
            let mut point = from.towards(to, share, grain);
            (point.place[axis], point.place[1 - axis]) = (edge, at);
            found.push((share, point));
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    const CELLS: usize = 16;

    /// Makes standing water of a kind at some vertices of a tile without rivers: half a metre deep, between ground at 7
    /// m.
    fn standing(kind: WaterKind, at: impl Fn(i64, i64) -> bool) -> Waterlines {
        let area = Area::new(0, 0, CELLS + 1, CELLS + 1).padded(1);
        let wet = Grid::of(area, |x, y| at(x, y).then_some((kind, 6.0)));
        let heights_m = Grid::of(area, |x, y| if at(x, y) { 5.5 } else { 7.0 });
        let mut waters = Waterlines {
            cells: CELLS,
            grain: 1,
            lines: Vec::new(),
            beds: Vec::new(),
            courses: Vec::new(),
            reaches: Reaches::new(&[], CELLS),
            standing: Standing { wet, heights_m },
            covered: HashMap::new(),
        };
        waters.add_shores(FINEST);
        waters
    }

    fn is_wet(waters: &Waterlines, column: u32, row: u32) -> bool {
        let place = [column, row].map(|at| f64::from(at) * CELL);
        assert_eq!(waters.standing.nearest(place).is_some(), waters.covers([column, row]));
        waters.covers([column, row])
    }

    #[test]
    fn water_without_a_shore_is_none() {
        // A scrap of a river beside a real one; and a lake just as small.
        let is_scrap = |x, y| (x, y) == (4, 5) || (x, y) == (5, 5);
        let scrap = standing(WaterKind::River, |x, y| is_scrap(x, y) || (9..14).contains(&x) && (3..9).contains(&y));
        assert_eq!(scrap.lines.len(), 1);
        assert!(!is_wet(&scrap, 4, 5) && !is_wet(&scrap, 5, 5) && is_wet(&scrap, 9, 3) && is_wet(&scrap, 13, 8));
        let lake = standing(WaterKind::Lake, is_scrap);
        assert_eq!(lake.lines.len(), 1);
        assert!(is_wet(&lake, 4, 5) && is_wet(&lake, 5, 5));
    }

    #[test]
    fn an_island_without_a_shore_leaves_its_water() {
        let pool = |x: i64, y: i64| (3..13).contains(&x) && (3..13).contains(&y) && (x, y) != (7, 8);
        let waters = standing(WaterKind::River, pool);
        assert_eq!(waters.lines.len(), 1);
        assert!(is_wet(&waters, 7, 7) && is_wet(&waters, 3, 12) && !is_wet(&waters, 7, 8));
    }
}
