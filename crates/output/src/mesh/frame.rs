//! The origin of meshes, and the step that the positions of their vertices are multiples of.

use super::PARTS;
use crate::area::{Area, Region};
use crate::world::World;

/// The origin of meshes, and the step that positions are multiples of: a power of two of a metre.
///
/// Meshes keep their vertices in `f32`, relative to their tile's north-western corner. Corners and vertices are whole
/// numbers of steps, so two tiles put a vertex that they share at exactly the same place. The number of steps between
/// two vertices is a property of the world, so a tile has the same numbers in every region.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    spacing_m: f64,
    /// The vertex at the origin.
    origin: [i64; 2],
    step_m: f64,
    /// Height in metres from which quantised heights are counted; `None` if heights are not quantised.
    base_m: Option<f64>,
}

/// Least number of steps between neighbouring vertices in unquantised meshes. A vertex is moved by at most half a
/// thousandth of the spacing, and not at all where the spacing is a whole number of steps.
const LEAST_STEPS: f64 = 1024.0;

/// Largest number of steps that quantised positions can count, because they have 16 bits.
const MOST_QUANTA: f64 = 65535.0;

/// Vertices between the origins that regions choose from. No vertex near a region's middle is further than half of this
/// from its origin, where 32-bit floats tell 256 places between two vertices apart; and regions near each other have
/// the same origin.
pub const ORIGINS: i64 = 1 << 17;

impl Frame {
    /// Creates the frame of meshes with an origin. If `quantized`, positions are counted in 16 bits.
    pub fn new(world: &World, origin: [i64; 2], quantized: bool) -> Frame {
        let spacing_m = world.spacing_m();
        if !quantized {
            return Frame { spacing_m, origin, step_m: power_below(spacing_m / LEAST_STEPS), base_m: None };
        }
        // All axes share one step, or normals would be distorted; and all tiles of the world share it.
        let (lowest_m, highest_m) = world.height_range_m();
        let side_m = f64::from(world.tile_cells()) * spacing_m;
        let least_m = side_m.max((highest_m - lowest_m) as f64 + 1.0) / (MOST_QUANTA - 1.0);
        // The next power of two above, so that the side and the heights fit for certain.
        let step_m = 2.0 * power_below(least_m);
        Frame { spacing_m, origin, step_m, base_m: Some((lowest_m as f64 / step_m).floor() * step_m) }
    }

    /// Length of a step in metres.
    pub fn step_m(&self) -> f64 {
        self.step_m
    }

    /// Largest difference in metres between a vertex's height and its height in the mesh.
    pub fn height_error_m(&self) -> f64 {
        if self.base_m.is_some() { self.step_m / 2.0 } else { 0.0 }
    }

    /// Position of the corner of a tile's meshes, in metres east, up and south of the origin.
    pub fn corner_m(&self, area: &Area) -> [f64; 3] {
        let steps = |at: i64, axis: usize| self.steps(at) - self.steps(self.origin[axis]);
        let [east, south] = [(area.x0, 0), (area.y0, 1)].map(|(at, axis)| steps(at, axis) as f64 * self.step_m);
        [east, self.base_m.unwrap_or(0.0), south]
    }

    /// Returns the steps from the corner of an area to a vertex: east and south.
    pub fn local_steps(&self, area: &Area, x: i64, y: i64) -> [i64; 2] {
        [self.steps(x) - self.steps(area.x0), self.steps(y) - self.steps(area.y0)]
    }

    /// Returns the number of parts of a cell, a power of two, that are at least one step long: places this far apart
    /// stay apart in the mesh.
    pub fn grain(&self) -> i64 {
        let steps_a_cell = self.spacing_m / self.step_m;
        let parts = (f64::from(PARTS) / steps_a_cell).max(1.0);
        let grain = (0..7).map(|power| 1_i64 << power).find(|grain| *grain as f64 >= parts);
        grain.unwrap_or(i64::from(PARTS) / 2)
    }

    /// Returns the steps from the corner of an area to a place, given in [parts](PARTS) of a cell from that corner.
    pub fn steps_between(&self, area: &Area, place: [u32; 2]) -> [i64; 2] {
        let steps = |first: i64, parts: u32| {
            let (before, within) = (first + i64::from(parts / PARTS as u32), i64::from(parts % PARTS as u32));
            let steps = self.steps(before) - self.steps(first);
            if within == 0 {
                return steps;
            }
            let cell = self.steps(before + 1) - self.steps(before);
            // Rounded, in the same way in both tiles at an edge.
            steps + (2 * cell * within + i64::from(PARTS)) / (2 * i64::from(PARTS))
        };
        [steps(area.x0, place[0]), steps(area.y0, place[1])]
    }

    /// Returns the metres east and south from the corner of an area to a place, given in vertices from that corner.
    pub fn local_m(&self, area: &Area, place: [f64; 2]) -> [f64; 2] {
        let metres = |first: i64, at: f64| {
            // Interpolate within the cell, so that a place on the tile's edge is where the neighbour has it.
            let before = at.floor();
            let at_vertex = |vertex: i64| self.steps(vertex) - self.steps(first);
            let start = at_vertex(first + before as i64);
            let cell = at_vertex(first + before as i64 + 1) - start;
            (start as f64 + cell as f64 * (at - before)) * self.step_m
        };
        [metres(area.x0, place[0]), metres(area.y0, place[1])]
    }

    /// Returns the steps from the base up to a height, in frames of quantised meshes.
    pub fn height_steps(&self, height_m: f32) -> u16 {
        let base_m = self.base_m.expect("only quantised heights are counted");
        ((height_m as f64 - base_m) / self.step_m + 0.5) as u16
    }

    /// Returns the whole steps from the origin of the world to a vertex.
    fn steps(&self, at: i64) -> i64 {
        // Count block by block. Every block has the same number of steps, so products are exact everywhere.
        let (block, within) = (at.div_euclid(ORIGINS), at.rem_euclid(ORIGINS));
        let steps = |vertices: i64| (vertices as f64 * self.spacing_m / self.step_m + 0.5) as i64;
        block * steps(ORIGINS) + steps(within)
    }
}

/// Returns the origin of a region's meshes if none is asked for: of all vertices that are multiples of `ORIGINS`, the
/// nearest one to the middle of the region. Near the origin of the world, that is the origin of the world.
pub fn default_origin(region: &Region) -> [i64; 2] {
    middle(region).map(|at| (at + ORIGINS / 2).div_euclid(ORIGINS) * ORIGINS)
}

/// Returns the vertex in the middle of a region, or half a cell off the middle where no vertex lies there.
pub fn middle(region: &Region) -> [i64; 2] {
    let cells = region.tile_cells() as i64;
    let middle = |first: i64, count: u64| first * cells + (count as i64 * cells).div_euclid(2);
    [middle(region.at().x, region.cols()), middle(region.at().y, region.rows())]
}

/// Returns the greatest power of two that is not above a positive number.
fn power_below(value: f64) -> f64 {
    // Clearing the mantissa of a number leaves that power of two.
    f64::from_bits(value.to_bits() & !((1 << 52) - 1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::area::TileId;
    use crate::preset::Preset;

    fn world(change: impl FnOnce(&mut Preset)) -> World {
        let (_, mut preset) = Preset::load("hills").unwrap();
        change(&mut preset);
        World::new(preset, None).unwrap()
    }

    #[test]
    fn neighbours_put_a_shared_vertex_at_the_same_place() {
        for spacing_m in [0.3, 1.0, 4.7, 5.0] {
            let world = world(|preset| preset.spacing_m = spacing_m);
            let at = TileId { x: 1_000_000_000, y: -1_000_000_000 };
            let region = Region::new(at, 9, 7, world.tile_cells()).unwrap();
            for quantized in [false, true] {
                let frame = Frame::new(&world, default_origin(&region), quantized);
                let place = |tile: TileId, x: i64, y: i64| {
                    let area = tile.area(world.tile_cells());
                    let corner = frame.corner_m(&area).map(|metres| metres as f32);
                    let [east, south] =
                        frame.local_steps(&area, x, y).map(|steps| (steps as f64 * frame.step_m()) as f32);
                    [corner[0] + east, corner[2] + south]
                };
                let cells = world.tile_cells() as i64;
                for step in 0..8 {
                    let tile = TileId { x: at.x + step, y: at.y + step % 6 };
                    let (x, y) = ((tile.x + 1) * cells, (tile.y + 1) * cells);
                    let east = TileId { x: tile.x + 1, ..tile };
                    let south_east = TileId { x: tile.x + 1, y: tile.y + 1 };
                    assert_eq!(place(tile, x, y), place(east, x, y), "{spacing_m} m");
                    assert_eq!(place(tile, x, y), place(south_east, x, y), "{spacing_m} m");
                }
            }
        }
    }

    #[test]
    fn a_tile_has_the_same_numbers_wherever_the_origin_is() {
        let world = world(|preset| preset.spacing_m = 0.3);
        let area = TileId { x: 700, y: -3 }.area(world.tile_cells());
        let numbers = |origin| {
            let frame = Frame::new(&world, origin, false);
            (area.x0..area.x1).map(|x| frame.local_steps(&area, x, area.y0 + 7)).collect::<Vec<_>>()
        };
        assert_eq!(numbers([0, 0]), numbers([131_072, -5]));
        // The number of steps per cell differs by one at most.
        let steps: Vec<i64> = numbers([0, 0]).windows(2).map(|pair| pair[1][0] - pair[0][0]).collect();
        let (least, most) = (steps.iter().min().unwrap(), steps.iter().max().unwrap());
        assert!(most - least <= 1, "{least} to {most}");
    }

    #[test]
    fn the_origin_is_that_of_the_world_or_far_away_one_near_the_middle() {
        let origin = |x: i64, y: i64| default_origin(&Region::new(TileId { x, y }, 2, 3, 256).unwrap());
        assert_eq!(origin(0, 0), [0, 0]);
        assert_eq!(origin(-255, 250), [0, 0]);
        assert_eq!(origin(256, -700), [131_072, -131_072]);
        let far = 1 << 40;
        let [x, _] = origin(far / 256, 0);
        assert!((x - far).abs() <= ORIGINS && x % ORIGINS == 0);
        assert_eq!(middle(&Region::new(TileId { x: -1, y: 2 }, 2, 4, 256).unwrap()), [0, 4 * 256]);
    }
}
