//! The plain method of the thesis, as a baseline for the speed of terrane's own: scalar, on one thread, from a
//! permutation table.
//!
//! It is written as an application of 2014 would be: `f32` throughout, as its 32-byte vertices are; a grid that is
//! copied for each tile; the ridged multifractal for one vertex after another, with its exponents in a table; normals
//! from the tile's own heights; a blend value by slope. Agents are left out, which favours the baseline.

use crate::area::TileId;
use crate::clock::{Clock, stage};
use crate::hash;
use crate::relief::settings::NoiseTerm;
use crate::stop::Stopped;
use crate::tile::Vertex;
use crate::world::World;

/// Simplex noise in two dimensions from a permutation table.
///
/// Based on: Stefan Gustavson, "Simplex noise demystified" (2005).
#[derive(Debug)]
pub struct TableNoise {
    /// The permutation of 0 to 255, twice, so that a sum of two indices needs no wrapping.
    permutation: [u8; 512],
    /// The same values modulo the number of gradients.
    gradient: [u8; 512],
}

/// The gradients of the classic noise: the middles of a cube's edges. Only two of the three coordinates are used.
const GRADIENTS: [[f32; 2]; 12] = [
    [1.0, 1.0],
    [-1.0, 1.0],
    [1.0, -1.0],
    [-1.0, -1.0],
    [1.0, 0.0],
    [-1.0, 0.0],
    [1.0, 0.0],
    [-1.0, 0.0],
    [0.0, 1.0],
    [0.0, -1.0],
    [0.0, 1.0],
    [0.0, -1.0],
];

impl TableNoise {
    /// Makes the noise of a seed.
    pub fn new(seed: u64) -> TableNoise {
        let mut order: [u8; 256] = std::array::from_fn(|index| index as u8);
        // The shuffle of Fisher and Yates.
        for last in (1..order.len()).rev() {
            let other = hash::combine(seed, last as u64) % (last as u64 + 1);
            order.swap(last, other as usize);
        }
        let permutation: [u8; 512] = std::array::from_fn(|index| order[index & 255]);
        TableNoise { permutation, gradient: permutation.map(|value| value % GRADIENTS.len() as u8) }
    }

    /// Returns the noise at a point: about -1 to 1, 0 at the corners of the simplices.
    // Always inlined: as a call, the spills around it cost more than the noise, and a slow baseline would flatter
    // terrane.
    #[inline(always)]
    pub fn at(&self, x: f32, y: f32) -> f32 {
        // (sqrt(3) - 1) / 2 and (3 - sqrt(3)) / 6 convert between the square and the triangular lattice.
        const SKEW: f32 = 0.366_025_4;
        const UNSKEW: f32 = 0.211_324_87;
        let skew = (x + y) * SKEW;
        let (i, j) = (fast_floor(x + skew), fast_floor(y + skew));
        let unskew = (i + j) as f32 * UNSKEW;
        let (x0, y0) = (x - (i as f32 - unskew), y - (j as f32 - unskew));
        // The point is in the lower or the upper triangle of the square.
        let (step_i, step_j) = if x0 > y0 { (1, 0) } else { (0, 1) };
        let (x1, y1) = (x0 - step_i as f32 + UNSKEW, y0 - step_j as f32 + UNSKEW);
        let (x2, y2) = (x0 - 1.0 + 2.0 * UNSKEW, y0 - 1.0 + 2.0 * UNSKEW);
        let (i, j) = ((i & 255) as usize, (j & 255) as usize);
        let gradient = |i: usize, j: usize| GRADIENTS[self.gradient[i + self.permutation[j] as usize] as usize];
        let corner = |x: f32, y: f32, [east, south]: [f32; 2]| {
            let t = 0.5 - x * x - y * y;
            if t < 0.0 { 0.0 } else { t * t * t * t * (east * x + south * y) }
        };
        // The factor 70 brings the sum to -1..1.
        70.0 * (corner(x0, y0, gradient(i, j))
            + corner(x1, y1, gradient(i + step_i, j + step_j))
            + corner(x2, y2, gradient(i + 1, j + 1)))
    }
}

/// Returns the floor of a number in the range of `i32`. It is faster than the library's where no instruction does that.
fn fast_floor(x: f32) -> i32 {
    let truncated = x as i32;
    if x < truncated as f32 { truncated - 1 } else { truncated }
}

/// The thesis' method for tiles of one size.
#[derive(Debug)]
pub struct Baseline {
    noise: TableNoise,
    exponents: Vec<f32>,
    lacunarity: f32,
    offset: f32,
    gain: f32,
    wavelength_m: f32,
    height_m: f32,
    slope_scale: f32,
    spacing_m: f32,
    side: usize,
    grid: Vec<Vertex>,
}

/// A tile as the baseline makes it.
#[derive(Debug)]
pub struct BaselineTile {
    /// All vertices, row by row, local to the tile's centre.
    pub vertices: Vec<Vertex>,
    /// The part of the blend map that depends on slope.
    pub blend: Vec<u8>,
}

impl Baseline {
    /// Prepares the method for the tiles of a world, with the parameters of the world's first noise term.
    ///
    /// # Panics
    /// When the world's preset has no noise term, which every checked preset has.
    pub fn new(world: &World) -> Baseline {
        let preset = world.preset();
        let term: &NoiseTerm = preset.noise.first().expect("a checked preset has a noise term");
        let lacunarity = term.lacunarity as f32;
        let dimension = term.dimension.expect("a world has its defaults filled in") as f32;
        let side = world.tile_cells() as usize + 1;
        let spacing_m = world.spacing_m() as f32;
        let local = |index: usize| (index as f32 / (side - 1) as f32 - 0.5) * (side - 1) as f32 * spacing_m;
        let share = |index: usize| index as f32 / (side - 1) as f32;
        let vertex = |index: usize| Vertex {
            position: [local(index % side), 0.0, local(index / side)],
            normal: [0.0, 1.0, 0.0],
            texture: [share(index % side), share(index / side)],
        };
        Baseline {
            noise: TableNoise::new(world.seed()),
            // Computed once into a table, as in Musgrave's own code.
            exponents: (0..term.octaves).map(|octave| lacunarity.powi(octave as i32).powf(-dimension)).collect(),
            lacunarity,
            offset: term.offset.unwrap_or(1.0) as f32,
            gain: term.gain.unwrap_or(2.0) as f32,
            wavelength_m: term.wavelength_m as f32,
            height_m: term.height_m as f32,
            slope_scale: preset.ground.slope_scale as f32,
            spacing_m,
            side,
            grid: (0..side * side).map(vertex).collect(),
        }
    }

    /// Makes a tile, with the time of each stage booked on `clock`.
    ///
    /// # Errors
    /// When `clock` stops the work.
    pub fn tile(&self, id: TileId, clock: &Clock) -> Result<BaselineTile, Stopped> {
        // Copy the flat grid, then set the height of each vertex.
        let mut vertices = self.grid.clone();
        clock.time(stage::RELIEF, || {
            let side_m = (self.side - 1) as f32 * self.spacing_m;
            // The place is `f32` like all the rest, so far from the origin it is coarse.
            let centre = [(id.x as f32 + 0.5) * side_m, (id.y as f32 + 0.5) * side_m];
            for vertex in &mut vertices {
                let [east, _, south] = vertex.position;
                let fractal =
                    self.ridged((east + centre[0]) / self.wavelength_m, (south + centre[1]) / self.wavelength_m);
                vertex.position[1] = fractal * self.height_m;
            }
        })?;
        clock.time(stage::NORMALS, || self.fill_normals(&mut vertices))?;
        let blend = clock.time(stage::BLEND, || {
            // The dot product of the normal and straight up is the normal's second coordinate.
            let steepness = |vertex: &Vertex| ((1.0 - vertex.normal[1]) * self.slope_scale).min(1.0);
            vertices.iter().map(|vertex| (steepness(vertex) * 255.0) as u8).collect()
        })?;
        Ok(BaselineTile { vertices, blend })
    }

    /// Returns Musgrave's ridged multifractal at a point.
    ///
    /// Based on: Ebert et al., *Texturing and Modeling*, chapter 16.
    fn ridged(&self, x: f32, y: f32) -> f32 {
        let mut value = 0.0;
        let mut weight = 1.0;
        // Multiplying x and y themselves again and again is the obvious way. But the compiler may then pack them into
        // half a vector, whose idle half sinks into denormal numbers and more than doubles the time.
        let mut frequency = 1.0;
        for exponent in &self.exponents {
            let signal = self.offset - self.noise.at(x * frequency, y * frequency).abs();
            let signal = signal * signal * weight;
            value += signal * exponent;
            weight = (signal * self.gain).clamp(0.0, 1.0);
            frequency *= self.lacunarity;
        }
        value
    }

    /// Computes normals from the heights of both neighbours along each axis; at the tile's edge, where one is missing,
    /// from the vertex itself and the other.
    fn fill_normals(&self, vertices: &mut [Vertex]) {
        let side = self.side;
        for row in 0..side {
            let (north, south) = (row.saturating_sub(1), (row + 1).min(side - 1));
            for col in 0..side {
                let (west, east) = (col.saturating_sub(1), (col + 1).min(side - 1));
                let height = |row: usize, col: usize| vertices[row * side + col].position[1];
                let rise_east = (height(row, east) - height(row, west)) / ((east - west) as f32 * self.spacing_m);
                let rise_south = (height(south, col) - height(north, col)) / ((south - north) as f32 * self.spacing_m);
                let length = (rise_east * rise_east + rise_south * rise_south + 1.0).sqrt();
                vertices[row * side + col].normal = [-rise_east / length, 1.0 / length, -rise_south / length];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::preset::Preset;

    #[test]
    fn the_noise_fills_its_range_and_does_not_leave_it() {
        let noise = TableNoise::new(1);
        let mut sum = 0.0;
        let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
        let steps = 500;
        for row in 0..steps {
            for col in 0..steps {
                let value = noise.at(col as f32 * 0.173 - 40.0, row as f32 * 0.191 - 45.0);
                low = low.min(value);
                high = high.max(value);
                sum += value as f64;
            }
        }
        assert!((-1.0..=-0.8).contains(&low) && (0.8..=1.0).contains(&high), "{low} to {high}");
        assert!((sum / (steps * steps) as f64).abs() < 0.02, "{sum}");
    }

    #[test]
    fn the_noise_is_continuous_and_zero_at_the_lattice() {
        let noise = TableNoise::new(7);
        assert_eq!(noise.at(0.0, 0.0), 0.0);
        for step in 0..20_000 {
            let x = step as f32 * 0.001 - 10.0;
            let jump = (noise.at(x, 0.3 * x) - noise.at(x + 0.001, 0.3 * x)).abs();
            assert!(jump < 0.01, "{jump} at {x}");
        }
    }

    #[test]
    fn a_tile_is_like_ours() {
        let (_, mut preset) = Preset::load("thesis").unwrap();
        preset.tile_cells = 64;
        let world = World::new(preset, None).unwrap();
        let baseline = Baseline::new(&world);
        let clock = Clock::default();
        let (min_m, max_m) = world.height_range_m();
        let mut steep = 0;
        for x in -4..4 {
            let tile = baseline.tile(TileId { x, y: 3 }, &clock).unwrap();
            assert_eq!((tile.vertices.len(), tile.blend.len()), (65 * 65, 65 * 65));
            for vertex in &tile.vertices {
                assert!((min_m..=max_m).contains(&vertex.position[1]), "{vertex:?}");
                let length: f32 = vertex.normal.iter().map(|axis| axis * axis).sum();
                assert!((length - 1.0).abs() < 1e-5, "{vertex:?}");
            }
            steep += tile.blend.iter().filter(|&&value| value > 100).count();
        }
        assert!(steep > 0, "somewhere it is steep");
        // Neighbours meet at their edge, as in the thesis.
        let [west, east] = [0, 1].map(|x| baseline.tile(TileId { x, y: 0 }, &clock).unwrap().vertices);
        let apart = (0..65).map(|row| (west[row * 65 + 64].position[1] - east[row * 65].position[1]).abs());
        assert!(apart.fold(0.0, f32::max) < 0.05);
    }
}
