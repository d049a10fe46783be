//! Contours: found tile by tile, and joined where they cross from tile to tile.
//!
//! Where a contour crosses from a cell to the next depends on the two heights there alone, so those of neighbouring tiles meet to
//! the bit. What has an end in the row of tiles that comes next waits for it; all else is whole.

use std::collections::{HashMap, VecDeque};

use crate::area::Area;
use crate::bake::frames;
use crate::contour::{Edge, crossed, share};
use crate::features::layer::{Head, Kind, Shape};
use crate::features::{Row, Value};
use crate::geometry::simplified;
use crate::map::contour::{INDEX, interval_m};
use crate::tile::Tile;
use crate::world::World;

/// What readers call them, and know of them.
pub(crate) const NAME: &str = "contours";
pub(crate) const ABOUT: &str = "lines of equal height of the ground, also below water; metres";
pub(crate) const SHAPE: Shape = Shape::Line;

/// Their attributes.
pub(crate) const HEADS: [Head; 3] = [
    Head { name: "height_m", key: "height_m", kind: Kind::Real, required: true },
    // Whether it is each fifth, which maps draw stronger.
    Head { name: "is_index", key: "is_index", kind: Kind::Integer, required: true },
    Head { name: "kind", key: "kind", kind: Kind::Text, required: true },
];

/// Metres between them on a slope of 45 degrees for each metre between vertices: as a map at 1:25,000 has them of land of 10 m.
const DENOMINATOR: f64 = 2500.0;
const APART_MM: f64 = 0.6;

/// There are no fewer from the lowest to the highest land of a world.
const LEAST: f64 = 40.0;

/// A point that is left out lies no further from the line, in parts of the spacing.
const MISS: f64 = 1.0 / 16.0;

/// The most points that wait. A longer contour is written in parts.
const MOST_POINTS: usize = 1 << 14;

/// Metres between two contours of a world when nothing is asked for.
pub(crate) fn default_interval_m(world: &World) -> f64 {
    let (min_m, max_m) = world.height_range_m();
    let range_m = f64::from(max_m - min_m);
    let denominator = DENOMINATOR * world.spacing_m();
    let steepness = (range_m / LEAST / (APART_MM * denominator / 1000.0)).min(1.0);
    // A flat world has none, however far apart.
    if range_m > 0.0 { interval_m(denominator, APART_MM, steepness, range_m) } else { 1.0 }
}

/// A part of a contour: how many intervals above 0 m, the edges of cells that it ends on, and its points from the one to the
/// other.
#[derive(Debug)]
struct Part {
    number: i64,
    ends: [Edge; 2],
    points: VecDeque<[f64; 2]>,
}

/// What finds the contours of a tile.
#[derive(Clone, Copy)]
pub(crate) struct Finder {
    interval_m: f64,
    spacing_m: f64,
}

impl Finder {
    /// The contours of a tile, as bytes.
    pub fn find(&self, tile: &Tile) -> Vec<u8> {
        let (area, heights) = (tile.area(), tile.heights());
        // Cells, of which there is one fewer a side than vertices.
        let cells = Area { x1: area.x1 - 1, y1: area.y1 - 1, ..area };
        let mut piece = Vec::new();
        for (number, edges) in crossed(heights, cells, 1, self.interval_m) {
            let level = (number as f64 * self.interval_m) as f32;
            let point = |edge: &Edge| {
                let (x, y, south) = *edge;
                let share = share(heights, *edge, 1, level);
                let [east, down] = if south { [0.0, share] } else { [share, 0.0] };
                [(x as f64 + east) * self.spacing_m, 0.0 - (y as f64 + down) * self.spacing_m]
            };
            let points: Vec<[f64; 2]> = edges.iter().map(point).collect();
            let mut bytes = number.to_le_bytes().to_vec();
            for (x, y, south) in [edges[0], edges[edges.len() - 1]] {
                bytes.extend([x, y, i64::from(south)].map(i64::to_le_bytes).as_flattened());
            }
            for point in simplified(&points, MISS * self.spacing_m) {
                bytes.extend(point.map(f64::to_le_bytes).as_flattened());
            }
            frames::push(&mut piece, &bytes);
        }
        piece
    }
}

/// The contours of a region under way.
pub(crate) struct Contours {
    finder: Finder,
    sea_level_m: Option<f64>,
    /// Parts that wait, and by number and end where they are.
    parts: Vec<Option<Part>>,
    at: HashMap<(i64, Edge), usize>,
}

impl Contours {
    /// None yet, of a world.
    pub fn new(world: &World, interval_m: Option<f64>) -> Contours {
        let interval_m = interval_m.unwrap_or_else(|| default_interval_m(world));
        Contours {
            finder: Finder { interval_m, spacing_m: world.spacing_m() },
            sea_level_m: world.preset().sea_level_m,
            parts: Vec::new(),
            at: HashMap::new(),
        }
    }

    /// What finds those of tiles.
    pub fn finder(&self) -> Finder {
        self.finder
    }

    /// Takes in those of a row of tiles, from west to east, and hands on what is whole. `next` is the row of vertices that the next
    /// row of tiles begins with, if there is one.
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
        let waits = |part: &Part| {
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
        // Those that are left, in the order in which they came.
        self.parts.retain(Option::is_some);
        self.at.clear();
        for (place, part) in self.parts.iter().flatten().enumerate() {
            self.at.extend(part.ends.map(|end| ((part.number, end), place)));
        }
        Ok(())
    }

    /// Joins a part to those that it meets. Returns it if its ends have met.
    fn join(&mut self, mut part: Part) -> Option<Part> {
        let meets = |at: &HashMap<(i64, Edge), usize>, part: &Part| {
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

    /// What is written of a contour; nothing of one that is but a vertex at its height.
    fn row(&self, part: Part) -> Option<Row> {
        if part.points.iter().all(|point| *point == part.points[0]) {
            return None;
        }
        let height_m = part.number as f64 * self.finder.interval_m;
        let is_index = part.number.rem_euclid(INDEX) == 0;
        let kind = if self.sea_level_m.is_some_and(|level_m| height_m < level_m) { "depth" } else { "land" };
        let values = vec![Value::Real(height_m), Value::Integer(i64::from(is_index)), Value::Text(kind.to_owned())];
        Some(Row { values, lines: vec![part.points.into_iter().map(|[east, north]| [east, north, 0.0]).collect()] })
    }
}

/// Two parts with an end in common, as one.
fn joined(mut one: Part, mut other: Part) -> Part {
    // So that the longer one stays and the shorter one moves.
    if one.points.len() < other.points.len() {
        std::mem::swap(&mut one, &mut other);
    }
    let common = usize::from(!other.ends.contains(&one.ends[0]));
    // The other from the common end on.
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

fn parsed(bytes: &[u8]) -> Part {
    let mut words = bytes.as_chunks::<8>().0.iter();
    let mut number = || i64::from_le_bytes(*words.next().expect("it was packed here"));
    let count = number();
    let ends = [(); 2].map(|()| (number(), number(), number() != 0));
    let numbers: Vec<f64> = words.map(|word| f64::from_le_bytes(*word)).collect();
    Part { number: count, ends, points: numbers.as_chunks::<2>().0.iter().copied().collect() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::area::{Place, Region, TileId};
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

    /// Length by height, and how many lines there are that end within the region.
    fn measured(rows: &[Row], region: &Region) -> (std::collections::BTreeMap<i64, i64>, usize) {
        let bounds = region.bounds_km(1.0).map(|km| km * 1000.0);
        let on_edge = |[x, y, _]: [f64; 3]| [x, y, x, y].iter().zip(bounds).any(|(at, edge)| (at - edge).abs() < 1e-6);
        let (mut lengths, mut loose) = (std::collections::BTreeMap::new(), 0);
        for Row { values, lines } in rows {
            let Value::Real(height_m) = values[0] else { panic!("{values:?}") };
            let line = &lines[0];
            let steps = line.windows(2).map(|pair| (pair[1][0] - pair[0][0]).hypot(pair[1][1] - pair[0][1]));
            // In centimetres, as whole numbers, whose sum does not depend on their order.
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
        // The same lines as in one tile of that size, but for the points that are left out tile by tile.
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

    #[test]
    fn a_line_that_is_too_long_to_wait_is_handed_on_in_parts() {
        let part = |x: i64, points: usize| Part {
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
