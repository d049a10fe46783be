//! Instances: single trees, shrubs, tufts of grass and rocks, as points.
//!
//! Candidates lie on a lattice of their own over the whole world, one at a hashed place in each cell. A candidate that
//! has another of higher rank nearer than the least distance gives way to it, even if that one gives way too. So the
//! pattern is even, without clumps, and whether a candidate stays follows from the cells around it: no tile needs to
//! know what stands on its neighbour. Each candidate that stays becomes a tree, a shrub, a tuft, a rock or nothing, by
//! the densities at its place.
//!
//! In a world with a geography each is a plant of the biome at its place. Chance moves the temperature there by up to
//! 1.5 degrees and rain by up to 15 in a hundred, so that plants of two biomes mingle where these meet.
//!
//! Based on: the dart throwing of R. L. Cook, "Stochastic sampling in computer graphics", 1986, with ranks instead of
//! an order of throws.

use crate::area::Area;
use crate::geography::climate::PlaceClimate;
use crate::geometry::{LineSegment, bilinear};
use crate::grain_point::{GRAINS, Point};
use crate::hash::{self, Stream};
use crate::lines::{LineKind, StructureKind};
use crate::tile::{Grows, Growth, Plant, Tile};
use crate::world::World;

/// A tree, shrub, tuft of grass or rock on a tile.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instance {
    /// The kind of growth.
    pub growth: Growth,
    /// The plant: one of the biome at the place, or [`Plant::any`] in a world without a geography.
    pub plant: Plant,
    /// Position in vertices east and south of the tile's north-western corner.
    pub place: [f64; 2],
    /// Height of the land there in metres: the lower of the two ways to split a cell into triangles, so that nothing
    /// floats.
    pub height_m: f64,
    /// Rotation about the vertical in degrees, 0 to 360.
    pub yaw_deg: f64,
    /// Size relative to the usual: 0.75 up to 1.25.
    pub scale: f64,
}

/// Smallest and largest [`Instance::scale`].
const SCALES: [f64; 2] = [0.75, 1.25];

impl Instance {
    /// Returns the height of the plant in metres. It grows with the scale, from the lowest such plant to the highest.
    pub fn tall_m(&self) -> f64 {
        let [low, high] = self.plant.heights_m;
        low + (high - low) * (self.scale - SCALES[0]) / (SCALES[1] - SCALES[0])
    }
}

/// Largest change of the temperature in degrees Celsius, and of the rain as a share, by which plants of a biome stand
/// beyond its border.
const MINGLE_C: f64 = 1.5;
const MINGLE_RAIN: f64 = 0.15;

/// Number of instances a hectare at the greatest density of each kind, in the order of [`Growth::ALL`]. There are fewer
/// where vertices lie more than 14 m apart.
pub const A_HECTARE: [f64; 4] = [60.0, 30.0, 30.0, 20.0];

/// Largest side of a candidate cell in metres, where vertices lie at most 14 m apart. The least side there is more than
/// half of this.
const MOST_SIDE_M: f64 = 7.0;

/// Exponent of the least side of a candidate cell, 2^-1 vertices. It allows four candidates in a cell of the tile and
/// no more, which limits the size of files.
const LEAST_POWER: i32 = -1;

/// Bits of a place in a cell along an axis: a side has 2^16 parts.
const PARTS: u32 = 16;

/// Least distance between two instances, in sides of a candidate cell.
const LEAST_DISTANCE: f64 = 0.7;

/// Share of candidates that give way to no other, measured over a million.
const LEFT: f64 = 0.664;

/// Width in metres of the verge beside roads and rivers on which nothing stands.
const VERGE_M: f64 = 1.0;

/// Returns a power of two. It is exact on every machine, which `exp2` need not be.
fn power_of_two(power: i32) -> f64 {
    if power < 0 { 1.0 / (1u64 << -power) as f64 } else { (1u64 << power) as f64 }
}

/// The lattice of candidates of a world.
#[derive(Clone, Copy, Debug)]
struct Candidates {
    stream: u64,
    /// The side of a cell in vertices, as an exponent of two.
    power: i32,
}

/// A candidate for an instance.
#[derive(Clone, Copy, Debug)]
struct InstanceCandidate {
    cell: [i64; 2],
    /// Position in the cell, in parts of the side.
    place: [i64; 2],
    rank: u64,
}

impl Candidates {
    fn new(world: &World) -> Candidates {
        let side_m = |power: i32| world.spacing_m() * power_of_two(power);
        let power = (LEAST_POWER..24).take_while(|power| side_m(*power) <= MOST_SIDE_M).last().unwrap_or(LEAST_POWER);
        Candidates { stream: hash::stream(world.chance(), Stream::Instances), power }
    }

    /// Returns the side of a cell in vertices.
    fn side(self) -> f64 {
        power_of_two(self.power)
    }

    fn of(self, cell: [i64; 2]) -> InstanceCandidate {
        let hash = hash::lattice(self.stream, cell[0], cell[1]);
        let part = |bits: u64| (bits & ((1 << PARTS) - 1)) as i64;
        InstanceCandidate { cell, place: [part(hash), part(hash >> PARTS)], rank: hash::scatter(hash) }
    }

    /// Tells whether a candidate stays, since it gives way to none of the candidates around it.
    fn is_left(self, candidate: &InstanceCandidate) -> bool {
        const LEAST: i64 = (LEAST_DISTANCE * (1 << PARTS) as f64) as i64 + 1;
        // The cells next to it suffice: all others are further away than the least distance.
        let around = Area::new(candidate.cell[0] - 1, candidate.cell[1] - 1, 3, 3).vertices();
        around.map(|(i, j)| [i, j]).filter(|cell| *cell != candidate.cell).all(|cell| {
            let other = self.of(cell);
            let away = [0, 1]
                .map(|axis| ((cell[axis] - candidate.cell[axis]) << PARTS) + other.place[axis] - candidate.place[axis]);
            let is_near = away[0] * away[0] + away[1] * away[1] < LEAST * LEAST;
            // Between candidates of the same rank their cells decide.
            !is_near || (other.rank, other.cell) < (candidate.rank, candidate.cell)
        })
    }

    /// Returns the first and last cell of a tile along an axis, given the tile's first and last vertex there, and the
    /// position at which the first cell begins, in parts of a side from the first vertex.
    fn span(self, first: i64, last: i64) -> ([i64; 2], i64) {
        if self.power <= 0 {
            let cells = 1 << -self.power;
            return ([first * cells, last * cells - 1], 0);
        }
        let side = 1 << self.power;
        let from = first.div_euclid(side);
        let begins = ((from * side - first) << PARTS) / side;
        ([from, (last - 1).div_euclid(side)], begins)
    }
}

/// Returns the least distance between two instances of a world in metres.
pub fn least_distance_m(world: &World) -> f64 {
    Candidates::new(world).side() * world.spacing_m() * LEAST_DISTANCE
}

/// Estimates the largest number of instances on a tile of `cells` cells a side. A tenth and another thousand are added
/// for what chance may do.
pub fn most_instances(world: &World, cells: u32) -> u64 {
    let candidates = Candidates::new(world);
    let side = f64::from(cells) / candidates.side() + 1.0;
    (side * side * LEFT * 1.1 * share_of_all(world, candidates)) as u64 + 1000
}

/// Returns the probability that a candidate becomes anything where all kinds are at their densest.
fn share_of_all(world: &World, candidates: Candidates) -> f64 {
    let side_m = candidates.side() * world.spacing_m();
    let left_a_hectare = LEFT * 10_000.0 / (side_m * side_m);
    (A_HECTARE.iter().sum::<f64>() / left_a_hectare).min(1.0)
}

/// Returns all instances on a tile, in the order of the candidates' cells, row by row from the north. Instances on the
/// edge of two tiles belong to the eastern or southern tile.
pub fn instances(world: &World, grows: &Grows, tile: &Tile) -> Vec<Instance> {
    let candidates = Candidates::new(world);
    let Area { x0, y0, x1, y1 } = tile.area();
    let cells = (x1 - 1 - x0) as usize;
    // The densities at each vertex, and whether anything may stand there.
    let densities = grows.densities(tile).values();
    let open: Vec<bool> = tile.area().vertices().map(|(x, y)| grows.is_open(tile, x, y)).collect();
    let lines = LineIndex::new(tile);
    let all: f64 = A_HECTARE.iter().sum();
    let shares = A_HECTARE.map(|of_kind| of_kind / all * share_of_all(world, candidates));
    let ([i0, i1], east) = candidates.span(x0, x1 - 1);
    let ([j0, j1], south) = candidates.span(y0, y1 - 1);
    let scale = candidates.side() / f64::from(1 << PARTS);
    let (mut instances, mut ranks) = (Vec::new(), Vec::new());
    for (i, j) in (Area { x0: i0, y0: j0, x1: i1 + 1, y1: j1 + 1 }).vertices() {
        let candidate = candidates.of([i, j]);
        let parts = [((i - i0) << PARTS) + east + candidate.place[0], ((j - j0) << PARTS) + south + candidate.place[1]];
        // Exact: whole numbers times a power of two.
        let place = parts.map(|parts| parts as f64 * scale);
        if place.iter().any(|at| *at < 0.0 || *at >= cells as f64) {
            continue;
        }
        let [column, row] = place.map(|at| at as usize);
        let within = [place[0] - column as f64, place[1] - row as f64];
        let north = row * (cells + 1) + column;
        let corners = [north, north + 1, north + cells + 1, north + cells + 2];
        if !corners.iter().all(|corner| open[*corner]) {
            continue;
        }
        // Chance first, since this is cheap: it rejects most candidates without a look at their surroundings.
        let chance = hash::share(hash::combine(candidate.rank, 0));
        let mut sum = 0.0;
        let growth = Growth::ALL.into_iter().find(|growth| {
            let kind = *growth as usize;
            sum += shares[kind] * bilinear(corners.map(|corner| f64::from(densities[corner][kind])), within);
            chance < sum
        });
        let Some(growth) = growth else { continue };
        if !candidates.is_left(&candidate) || lines.hold(place, [column, row]) {
            continue;
        }
        let height = |[x, y]: [usize; 2]| f64::from(tile.heights().at(x0 + (column + x) as i64, y0 + (row + y) as i64));
        let height_m = lower([[0, 0], [1, 0], [0, 1], [1, 1]].map(height), within);
        ranks.push(candidate.rank);
        instances.push(Instance {
            growth,
            plant: Plant::any(growth),
            place,
            height_m,
            yaw_deg: 360.0 * hash::share(hash::combine(candidate.rank, 1)),
            scale: SCALES[0] + (SCALES[1] - SCALES[0]) * hash::share(hash::combine(candidate.rank, 2)),
        });
    }
    choose_plants(world, tile, &mut instances, &ranks);
    instances
}

/// Gives instances of a tile the plants of their places, if the world has a geography. `ranks` are those of the
/// candidates that they were.
fn choose_plants(world: &World, tile: &Tile, instances: &mut [Instance], ranks: &[u64]) {
    let Some(geography) = world.geography() else { return };
    let (vertices, sea_level_m) = (world.stride().vertices(), world.preset().sea_level_m.unwrap_or(0.0));
    let Area { x0, y0, .. } = tile.area();
    let corner = Point::at_vertex(x0 * vertices, y0 * vertices);
    let grains = (vertices * GRAINS) as f64;
    let point = |it: &Instance| corner.moved(it.place.map(|at| at * grains).into());
    let climates = geography.climates(&instances.iter().map(point).collect::<Vec<_>>());
    for ((instance, rank), climate) in instances.iter_mut().zip(ranks).zip(climates) {
        let chance = |number| hash::share(hash::combine(*rank, number));
        let [warmer, wetter] = [3, 4].map(|number| 2.0 * chance(number) - 1.0);
        let climate = PlaceClimate {
            mean_c: climate.mean_c + MINGLE_C * warmer,
            rain_mm: climate.rain_mm.map(|rain| rain * (1.0 + MINGLE_RAIN * wetter)),
            ..climate
        };
        let biome = climate.biome((instance.height_m - sea_level_m).max(0.0));
        instance.plant = Plant::of(instance.growth, biome, chance(5));
    }
}

/// Returns the height at a place in a cell with these corners: the lower of the two ways to split the cell into
/// triangles.
fn lower([nw, ne, sw, se]: [f64; 4], [u, v]: [f64; 2]) -> f64 {
    let falling = if u > v { nw + (ne - nw) * u + (se - ne) * v } else { nw + (sw - nw) * v + (se - sw) * u };
    let rising = match u + v <= 1.0 {
        true => nw + (ne - nw) * u + (sw - nw) * v,
        false => se + (sw - se) * (1.0 - u) + (ne - se) * (1.0 - v),
    };
    falling.min(rising)
}

/// The roads and rivers of a tile, indexed by cell. Many are narrower than the distance between vertices, so vertices
/// do not show them.
struct LineIndex {
    /// Cells, each with the number of a piece that may lie on it; sorted.
    cells: Vec<([usize; 2], usize)>,
    /// Pieces in vertices from the tile's corner, each with the square of the distance within which nothing stands.
    pieces: Vec<(LineSegment, f64)>,
}

impl LineIndex {
    fn new(tile: &Tile) -> LineIndex {
        let Area { x0, y0, x1, .. } = tile.area();
        let last = (x1 - 2 - x0) as f64;
        let (mut cells, mut pieces) = (Vec::new(), Vec::new());
        for line in tile.lines() {
            let carriers = line.carriers();
            for (index, [from, to]) in line.pieces().enumerate() {
                if line.kind == LineKind::Road && carriers.get(index) == Some(&Some(StructureKind::Tunnel)) {
                    continue;
                }
                let reach = (from.half_width_m.max(to.half_width_m) + VERGE_M) / line.spacing_m;
                let [from, to] = [from, to].map(|point| line.place_from([x0, y0], point));
                let span = |axis: usize| {
                    let (low, high) = (from[axis].min(to[axis]) - reach, from[axis].max(to[axis]) + reach);
                    (high >= 0.0 && low <= last + 1.0).then(|| low.max(0.0) as usize..=high.min(last) as usize)
                };
                let Some((columns, rows)) = span(0).zip(span(1)) else { continue };
                for column in columns {
                    cells.extend(rows.clone().map(|row| ([column, row], pieces.len())));
                }
                pieces.push((LineSegment::between(from, to), reach * reach));
            }
        }
        cells.sort_unstable();
        LineIndex { cells, pieces }
    }

    /// Tells whether a place in a cell lies on a road or river or on its verge.
    fn hold(&self, place: [f64; 2], cell: [usize; 2]) -> bool {
        let first = self.cells.partition_point(|(other, _)| *other < cell);
        let of_cell = self.cells[first..].iter().take_while(|(other, _)| *other == cell);
        of_cell.map(|(_, piece)| &self.pieces[*piece]).any(|(piece, square)| piece.nearest(place).1 <= *square)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn as_many_candidates_are_left_as_is_said() {
        let candidates = Candidates { stream: 7, power: 0 };
        let area = Area::new(-512, 300, 1024, 1024);
        let left = area.vertices().filter(|(i, j)| candidates.is_left(&candidates.of([*i, *j]))).count();
        let share = left as f64 / area.len() as f64;
        assert!((share - LEFT).abs() < 0.005, "{share}");
    }

    #[test]
    fn a_tile_has_the_cells_that_it_touches() {
        let span = |power, first, last| Candidates { stream: 7, power }.span(first, last);
        assert_eq!(span(-1, -3, 5), ([-6, 9], 0));
        assert_eq!(span(0, -3, 5), ([-3, 4], 0));
        // With cells of four vertices, the first begins one vertex before the tile.
        assert_eq!(span(2, -3, 5), ([-1, 1], -(1 << (PARTS - 2))));
        assert_eq!(span(3, 16, 24), ([2, 2], 0));
    }
}
