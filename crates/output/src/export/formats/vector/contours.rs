//! Contours: found tile by tile, and joined where they cross from tile to tile.
//!
//! The point where a contour crosses the edge of a cell depends only on the heights at the ends of the edge, so
//! contours of neighbouring tiles meet to the bit. A contour with an end on the border to the next row of tiles waits
//! for that row; all others are complete.
//!
//! No contour crosses or touches itself or another one. The contours as they are found do not: the straight lines
//! through a cell have their ends around it in an order in which they cannot meet. Leaving out points keeps this order
//! on every edge: a point is left out only where the line without it crosses the same edge of a cell, less than half
//! way from the point to the next contour and to either end of the edge.

use std::collections::{HashMap, VecDeque};

use crate::area::Area;
use crate::bake::frames;
use crate::contour::{Edge, crossed, share};
use crate::features::layer::{GeometryType, Head, ValueKind};
use crate::features::{Row, Value};
use crate::grid::Grid;
use crate::map::contour_lines::{INDEX, interval_m};
use crate::tile::Tile;
use crate::world::World;

/// Name, description and shape of the layer.
pub(crate) const NAME: &str = "contours";
pub(crate) const ABOUT: &str = "lines of equal height of the ground, also below water; metres";
pub(crate) const SHAPE: GeometryType = GeometryType::Line;

/// Attributes of a contour.
pub(crate) const HEADS: [Head; 3] = [
    Head { name: "height_m", key: "height_m", kind: ValueKind::Real, required: true },
    // 1 for each fifth contour, which maps draw stronger.
    Head { name: "is_index", key: "is_index", kind: ValueKind::Integer, required: true },
    Head { name: "kind", key: "kind", kind: ValueKind::Text, required: true },
];

/// Scale of the map whose contours are taken over: 1:2500 for each metre between vertices, and so 1:25,000 for land of
/// 10 m. Contours on a slope of 45 degrees lie [`APART_MM`] apart on this map.
const DENOMINATOR: f64 = 2500.0;
const APART_MM: f64 = 0.6;

/// Least number of contours from the lowest to the highest land of a world.
const LEAST: f64 = 40.0;

/// Largest distance from the line to a point that is left out, as a share of the spacing.
const MISS: f64 = 1.0 / 16.0;

/// Largest distance by which a contour may be moved along an edge, as a share of the way to the next contour or to the
/// end of the edge. Less than half, so that contours moved towards each other do not meet.
const SLACK: f64 = 0.4;

/// Least distance of a contour from the ends of an edge, as a share of the edge. Where a vertex is as high as the
/// contour, the contour would otherwise go through the vertex, and might do so twice.
const NEAREST: f64 = 1.0 / 1024.0;

/// Distance in vertices between the lattice lines on which points are never left out. Tiles whose sides are multiples
/// of it therefore have the same points.
const STAYS: i64 = 16;

/// Largest number of points of a contour that waits for the next row. A longer contour is written in parts.
const MOST_POINTS: usize = 1 << 14;

/// Returns the metres between two contours of a world if no interval is asked for.
pub(crate) fn default_interval_m(world: &World) -> f64 {
    let (min_m, max_m) = world.height_range_m();
    let range_m = f64::from(max_m - min_m);
    let denominator = DENOMINATOR * world.spacing_m();
    let steepness = (range_m / LEAST / (APART_MM * denominator / 1000.0)).min(1.0);
    // A flat world has no contours at any interval.
    if range_m > 0.0 { interval_m(denominator, APART_MM, steepness, range_m) } else { 1.0 }
}

/// A part of a contour: its height in intervals above 0 m, the edges of cells that it ends on, and its points from the
/// first end to the second.
#[derive(Debug)]
struct ContourPart {
    number: i64,
    ends: [Edge; 2],
    points: VecDeque<[f64; 2]>,
}

/// Finds the contours of a tile.
#[derive(Clone, Copy)]
pub(crate) struct ContourFinder {
    interval_m: f64,
    spacing_m: f64,
}

impl ContourFinder {
    /// Returns the contours of a tile, as bytes.
    pub fn find(&self, tile: &Tile) -> Vec<u8> {
        let (area, heights) = (tile.area(), tile.heights());
        // The cells of the tile, one fewer a side than vertices.
        let cells = Area { x1: area.x1 - 1, y1: area.y1 - 1, ..area };
        let mut piece = Vec::new();
        for (number, mut edges) in crossed(heights, cells, 1, self.interval_m) {
            let cross = |edge: &Edge| Crossing::new(heights, *edge, number, self.interval_m);
            let level = (number as f64 * self.interval_m) as f32;
            if !is_higher_on_the_right(heights, level, edges[0], [0, 1].map(|index| cross(&edges[index]).place)) {
                edges.reverse();
            }
            begin_ring(&mut edges);
            let line: Vec<Crossing> = edges.iter().map(cross).collect();
            let mut bytes = number.to_le_bytes().to_vec();
            for (x, y, south) in [edges[0], edges[edges.len() - 1]] {
                bytes.extend([x, y, i64::from(south)].map(i64::to_le_bytes).as_flattened());
            }
            for Crossing { place: [x, y], .. } in kept(&line).into_iter().map(|index| &line[index]) {
                let point = [x * self.spacing_m, 0.0 - y * self.spacing_m];
                bytes.extend(point.map(f64::to_le_bytes).as_flattened());
            }
            frames::push(&mut piece, &bytes);
        }
        piece
    }
}

/// A point where a contour crosses an edge of a cell, in vertices.
#[derive(Clone, Copy, Debug)]
struct Crossing {
    place: [f64; 2],
    /// Axis along which the edge runs; `slack` is the distance by which the contour may be moved along it to either
    /// side.
    axis: usize,
    slack: f64,
    /// True if the point is never left out.
    stays: bool,
}

impl Crossing {
    fn new(heights: &Grid<f32>, edge: Edge, number: i64, interval_m: f64) -> Crossing {
        let (x, y, south) = edge;
        let [from, to] =
            [[x, y], if south { [x, y + 1] } else { [x + 1, y] }].map(|[x, y]| f64::from(heights.at(x, y)));
        // Distance between neighbouring contours on the edge, as a share of the edge.
        let apart = interval_m / (to - from).abs();
        let nearest = NEAREST.min(0.25 * apart);
        let level = (number as f64 * interval_m) as f32;
        let share = share(heights, edge, 1, level).clamp(nearest, 1.0 - nearest);
        let axis = usize::from(south);
        let mut place = [x as f64, y as f64];
        place[axis] += share;
        let slack = MISS.min(SLACK * apart.min(share).min(1.0 - share));
        Crossing { place, axis, slack, stays: stays(edge) }
    }

    /// Returns how far from this point a straight line crosses the edge, in units of the slack; 0 if within the slack.
    fn excess(&self, from: [f64; 2], to: [f64; 2]) -> f64 {
        let (along, across) = (self.axis, 1 - self.axis);
        let way = to[across] - from[across];
        if way == 0.0 {
            return f64::INFINITY;
        }
        let share = (self.place[across] - from[across]) / way;
        let off = (from[along] + (to[along] - from[along]) * share - self.place[along]).abs();
        if off <= self.slack { 0.0 } else { off / self.slack }
    }
}

/// Tells whether a contour always keeps its point on an edge: on edges that lie on a lattice line where points stay.
fn stays((x, y, south): Edge) -> bool {
    (if south { x } else { y }).rem_euclid(STAYS) == 0
}

/// Tells whether higher ground is on the right of a contour that crosses an edge at the first of two places on its way
/// to the second. All contours are written so, and the points left out do not depend on the direction in which a tile
/// finds a contour.
fn is_higher_on_the_right(heights: &Grid<f32>, level: f32, (x, y, south): Edge, [from, to]: [[f64; 2]; 2]) -> bool {
    // True if the northern or western end of the edge is on the contour's right.
    let is_right = if south { to[0] < from[0] } else { to[1] > from[1] };
    (heights.at(x, y) >= level) == is_right
}

/// Rotates a ring to begin on an edge whose point stays or, without one, on the edge where it begins in any other tile
/// that holds all of it.
fn begin_ring(edges: &mut [Edge]) {
    let last = edges.len() - 1;
    if edges[0] == edges[last] {
        let ring = &mut edges[..last];
        let first = (0..last).min_by_key(|index| (!stays(ring[*index]), ring[*index])).expect("a ring has edges");
        ring.rotate_left(first);
        edges[last] = edges[0];
    }
}

/// Returns the indices of the points that a contour needs: both ends, the points that stay, and as many others as it
/// takes.
///
/// Based on: D. H. Douglas, T. K. Peucker, "Algorithms for the reduction of the number of points", 1973; but here no
/// point is moved so far that lines could meet.
fn kept(line: &[Crossing]) -> Vec<usize> {
    let last = line.len() - 1;
    let mut kept = vec![0];
    let mut first = 0;
    // Ends of the stretches that are still to do, the nearest last.
    let mut ends: Vec<usize> = (1..=last).rev().filter(|index| *index == last || line[*index].stays).collect();
    while let Some(&end) = ends.last() {
        let excess = |index: usize| line[index].excess(line[first].place, line[end].place);
        let worst = (first + 1..end).map(|index| (excess(index), index)).max_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((_, index)) = worst.filter(|(excess, _)| *excess > 0.0) {
            ends.push(index);
            continue;
        }
        kept.push(end);
        first = end;
        ends.pop();
    }
    kept
}

/// The contours of a region, while it is baked.
pub(crate) struct Contours {
    finder: ContourFinder,
    sea_level_m: Option<f64>,
    /// Parts that wait, and their places by number and end.
    parts: Vec<Option<ContourPart>>,
    at: HashMap<(i64, Edge), usize>,
}

impl Contours {
    /// Begins the contours of a world.
    pub fn new(world: &World, interval_m: Option<f64>) -> Contours {
        let interval_m = interval_m.unwrap_or_else(|| default_interval_m(world));
        Contours {
            finder: ContourFinder { interval_m, spacing_m: world.spacing_m() },
            sea_level_m: world.preset().sea_level_m,
            parts: Vec::new(),
            at: HashMap::new(),
        }
    }

    /// Returns the finder for the contours of tiles.
    pub fn finder(&self) -> ContourFinder {
        self.finder
    }

    /// Takes in the contours of a row of tiles, from west to east, and hands on those that are complete. `next` is the
    /// row of vertices that the next row of tiles begins with, if there is one.
    pub fn put<E>(
        &mut self,
        pieces: &[&[u8]],
        next: Option<i64>,
        mut hand_on: impl FnMut(Row) -> Result<(), E>,
    ) -> Result<(), E> {
        for piece in pieces {
            for part in frames::pieces(piece).map(parsed) {
                if let Some(row) = self.join(part).and_then(|whole| self.row(whole)) {
                    hand_on(row)?;
                }
            }
        }
        let waits = |part: &ContourPart| {
            let goes_on = |(_, y, south): Edge| !south && Some(y) == next;
            part.ends.into_iter().any(goes_on) && part.points.len() < MOST_POINTS
        };
        for place in 0..self.parts.len() {
            if let Some(part) = self.parts[place].take_if(|part| !waits(part)) {
                for end in part.ends {
                    self.at.remove(&(part.number, end));
                }
                self.row(part).map_or(Ok(()), &mut hand_on)?;
            }
        }
        // Keep the parts that wait, in the order in which they came.
        self.parts.retain(Option::is_some);
        self.at.clear();
        for (place, part) in self.parts.iter().flatten().enumerate() {
            self.at.extend(part.ends.map(|end| ((part.number, end), place)));
        }
        Ok(())
    }

    /// Joins a part to the waiting parts that it meets. Returns the contour if its ends have met.
    fn join(&mut self, mut part: ContourPart) -> Option<ContourPart> {
        let meets = |at: &HashMap<(i64, Edge), usize>, part: &ContourPart| {
            part.ends.iter().find_map(|end| at.get(&(part.number, *end)).copied())
        };
        while part.ends[0] != part.ends[1] {
            let Some(place) = meets(&self.at, &part) else { break };
            let other = self.parts[place].take().expect("what is known by an end is there");
            for end in other.ends {
                self.at.remove(&(other.number, end));
            }
            part = joined(other, part);
        }
        if part.ends[0] == part.ends[1] {
            return Some(part);
        }
        self.at.extend(part.ends.map(|end| ((part.number, end), self.parts.len())));
        self.parts.push(Some(part));
        None
    }

    /// Returns the row of a contour; `None` for a contour that is only a vertex at its height.
    fn row(&self, part: ContourPart) -> Option<Row> {
        let near = 2.0 * NEAREST * self.finder.spacing_m;
        let is_near = |point: &[f64; 2]| (0..2).all(|axis| (point[axis] - part.points[0][axis]).abs() <= near);
        if part.points.iter().all(is_near) {
            return None;
        }
        let height_m = part.number as f64 * self.finder.interval_m;
        let is_index = part.number.rem_euclid(INDEX) == 0;
        let kind = if self.sea_level_m.is_some_and(|level_m| height_m < level_m) { "depth" } else { "land" };
        let values = vec![Value::Real(height_m), Value::Integer(i64::from(is_index)), Value::Text(kind.to_owned())];
        Some(Row { values, lines: vec![part.points.into_iter().map(|[east, north]| [east, north, 0.0]).collect()] })
    }
}

/// Joins two parts with an end in common.
fn joined(mut one: ContourPart, mut other: ContourPart) -> ContourPart {
    // Keep the longer part, so that fewer points move.
    if one.points.len() < other.points.len() {
        std::mem::swap(&mut one, &mut other);
    }
    let common = usize::from(!other.ends.contains(&one.ends[0]));
    // Turn the other part to begin at the common end.
    if other.ends[0] != one.ends[common] {
        other.ends.reverse();
        other.points.make_contiguous().reverse();
    }
    let points = other.points.into_iter().skip(1);
    match common {
        1 => one.points.extend(points),
        _ => points.for_each(|point| one.points.push_front(point)),
    }
    one.ends[common] = other.ends[1];
    one
}

fn parsed(bytes: &[u8]) -> ContourPart {
    let mut words = bytes.as_chunks::<8>().0.iter();
    let mut number = || i64::from_le_bytes(*words.next().expect("it was packed here"));
    let count = number();
    let ends = [(); 2].map(|()| (number(), number(), number() != 0));
    let numbers: Vec<f64> = words.map(|word| f64::from_le_bytes(*word)).collect();
    ContourPart { number: count, ends, points: numbers.as_chunks::<2>().0.iter().copied().collect() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::area::{Place, Region, TileId};
    use crate::geometry::cross;
    use crate::preset::Preset;

    fn found(region: &Region, world: &World) -> Vec<Row> {
        let mut contours = Contours::new(world, Some(7.0));
        let mut rows = Vec::new();
        for row in 0..region.rows() {
            let tile = |col| contours.finder().find(&Tile::new(world, region.tile(Place { row, col })));
            let pieces: Vec<Vec<u8>> = (0..region.cols()).map(tile).collect();
            let pieces: Vec<&[u8]> = pieces.iter().map(Vec::as_slice).collect();
            let next = (region.at().y + row as i64 + 1) * i64::from(region.tile_cells());
            let next = (row + 1 < region.rows()).then_some(next);
            let put = |row| {
                rows.push(row);
                Ok::<_, ()>(())
            };
            contours.put(&pieces, next, put).unwrap();
        }
        assert!(contours.parts.is_empty() && contours.at.is_empty());
        rows
    }

    /// Returns the length of contours by height, and the number of lines that end within the region.
    fn measured(rows: &[Row], region: &Region) -> (std::collections::BTreeMap<i64, i64>, usize) {
        let bounds = region.bounds_km(1.0).map(|km| km * 1000.0);
        let on_edge = |[x, y, _]: [f64; 3]| [x, y, x, y].iter().zip(bounds).any(|(at, edge)| (at - edge).abs() < 1e-6);
        let (mut lengths, mut loose) = (std::collections::BTreeMap::new(), 0);
        for Row { values, lines } in rows {
            let Value::Real(height_m) = values[0] else { panic!("{values:?}") };
            let line = &lines[0];
            let steps = line.windows(2).map(|pair| (pair[1][0] - pair[0][0]).hypot(pair[1][1] - pair[0][1]));
            // Sum whole centimetres: such a sum does not depend on the order.
            *lengths.entry(height_m as i64).or_insert(0) += steps.map(|step| (step * 100.0) as i64).sum::<i64>();
            let (first, last) = (line[0], line[line.len() - 1]);
            loose += usize::from(first != last && !(on_edge(first) && on_edge(last)));
        }
        (lengths, loose)
    }

    #[test]
    fn contours_go_on_from_tile_to_tile() {
        let text = "tile_cells = 16\nnoise = [{ kind = \"fbm\", height_m = 90.0, wavelength_m = 60.0, octaves = 3 }]";
        let world = World::new(Preset::parse("test", text).unwrap(), None).unwrap();
        let whole = Region::new(TileId { x: -2, y: -2 }, 5, 4, 16).unwrap();
        let rows = found(&whole, &world);
        let (lengths, loose) = measured(&rows, &whole);
        assert!(loose == 0 && rows.len() > 30 && lengths.len() > 5, "{loose} loose of {}", rows.len());
        // Larger tiles give the same lines, but for points that are left out tile by tile.
        let large = world.with_tile_cells(32);
        let other = Region::new(TileId { x: -1, y: -1 }, 2, 2, 32).unwrap();
        let part = Region::new(TileId { x: -2, y: -2 }, 4, 4, 16).unwrap();
        let world = World::new(Preset::parse("test", text).unwrap(), None).unwrap();
        let [one, two] = [found(&part, &world), found(&other, &large)];
        assert_eq!(one.len(), two.len());
        let [(one, _), (two, _)] = [measured(&one, &part), measured(&two, &other)];
        for (height_m, length) in &one {
            assert!((length - two[height_m]).abs() * 100 <= *length, "{height_m} m: {length} and {}", two[height_m]);
        }
    }

    /// Tells whether two straight lines have a point in common.
    fn meet([a, b]: [[f64; 2]; 2], [c, d]: [[f64; 2]; 2]) -> bool {
        let side = |[a, b]: [[f64; 2]; 2], p: [f64; 2]| {
            let turn = cross([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
            if turn == 0.0 { 0 } else { turn.signum() as i32 }
        };
        let overlap = |axis: usize| {
            let ends = |one: [[f64; 2]; 2]| (one[0][axis].min(one[1][axis]), one[0][axis].max(one[1][axis]));
            let ((low, high), (from, to)) = (ends([a, b]), ends([c, d]));
            low <= to && from <= high
        };
        overlap(0) && overlap(1) && side([a, b], c) * side([a, b], d) <= 0 && side([c, d], a) * side([c, d], b) <= 0
    }

    /// Fails if a line meets another one, or itself anywhere but where its pieces follow each other.
    fn check_apart(name: &str, rows: &[Row], spacing_m: f64) {
        // Pieces of lines, by the squares that they may go through. Most pieces are shorter than a square's side.
        let side = 2.0 * spacing_m;
        // The number of a line, the number of a piece in it, and the ends of the piece.
        type Piece = (usize, usize, [[f64; 2]; 2]);
        let mut cells: HashMap<[i64; 2], Vec<Piece>> = HashMap::new();
        let lines: Vec<Vec<[f64; 2]>> =
            rows.iter().map(|row| row.lines[0].iter().map(|[x, y, _]| [*x, *y]).collect()).collect();
        for (line, points) in lines.iter().enumerate() {
            for (number, pair) in points.windows(2).enumerate() {
                let piece = [pair[0], pair[1]];
                let span = |axis: usize| {
                    let ends = piece.map(|point: [f64; 2]| (point[axis] / side).floor() as i64);
                    ends[0].min(ends[1])..=ends[0].max(ends[1])
                };
                for cell in span(0).flat_map(|x| span(1).map(move |y| [x, y])) {
                    cells.entry(cell).or_default().push((line, number, piece));
                }
            }
        }
        let mut looked = 0;
        for pieces in cells.values() {
            for (index, (line, number, piece)) in pieces.iter().enumerate() {
                for (other, next, beside) in &pieces[..index] {
                    let last = lines[*line].len() - 2;
                    let goes_on = line == other && (number.abs_diff(*next) <= 1 || number.abs_diff(*next) == last);
                    looked += 1;
                    assert!(goes_on || !meet(*piece, *beside), "{name}: {piece:?} of {line}, {beside:?} of {other}");
                }
            }
        }
        assert!(looked > 1000, "{name}: {looked} pairs");
    }

    #[test]
    fn no_contour_meets_another_or_itself() {
        let rough = "noise = [{ kind = \"ridged\", height_m = 90.0, wavelength_m = 30.0, octaves = 4 }]";
        // Land with vertices exactly at the height of contours, and with level ground.
        let steps = "noise = [{ kind = \"fbm\", height_m = 90.0, wavelength_m = 60.0, octaves = 3, curve = [[-1.0, -0.7777777777777778], [-0.2, 0.0], [0.1, 0.0], [1.0, 0.7777777777777778]] }]";
        let mut worlds: Vec<(&str, Preset)> =
            [("rough", rough), ("steps", steps)].map(|(name, text)| (name, Preset::parse(name, text).unwrap())).into();
        worlds.extend(["alps", "badlands", "mountains", "hills"].map(|name| (name, Preset::load(name).unwrap().1)));
        for (name, mut preset) in worlds {
            (preset.tile_cells, preset.places) = (48, None);
            let world = World::new(preset, Some(3)).unwrap();
            let region = Region::new(TileId { x: -1, y: 2 }, 3, 3, 48).unwrap();
            check_apart(name, &found(&region, &world), world.spacing_m());
        }
    }

    #[test]
    fn the_points_of_a_contour_do_not_depend_on_tiles() {
        let text = "noise = [{ kind = \"fbm\", height_m = 90.0, wavelength_m = 60.0, octaves = 3 }]";
        let points = |cells: u32| {
            let world = World::new(Preset::parse("test", text).unwrap(), None).unwrap().with_tile_cells(cells);
            let region =
                Region::new(TileId { x: 0, y: 0 }, u64::from(96 / cells), u64::from(96 / cells), cells).unwrap();
            let rows = found(&region, &world);
            let mut points: Vec<[u64; 2]> =
                rows.iter().flat_map(|row| row.lines.concat()).map(|[x, y, _]| [x, y].map(f64::to_bits)).collect();
            points.sort_unstable();
            points.dedup();
            points
        };
        let whole = points(96);
        assert!(whole.len() > 500, "{}", whole.len());
        assert!([16, 32, 48].into_iter().all(|cells| points(cells) == whole));
    }

    #[test]
    fn a_line_that_is_too_long_to_wait_is_handed_on_in_parts() {
        let part = |x: i64, points: usize| ContourPart {
            number: 1,
            ends: [(x, 0, false), (x, 16, false)],
            points: (0..points).map(|at| [x as f64, at as f64]).collect(),
        };
        let world = World::new(Preset::load("thesis").unwrap().1, None).unwrap();
        let mut contours = Contours::new(&world, None);
        assert!(contours.join(part(0, 5)).is_none() && contours.join(part(8, MOST_POINTS)).is_none());
        let mut rows = 0;
        let count = |_| {
            rows += 1;
            Ok::<_, ()>(())
        };
        contours.put(&[], Some(16), count).unwrap();
        assert_eq!((rows, contours.parts.len(), contours.at.len()), (1, 1, 2));
    }
}
