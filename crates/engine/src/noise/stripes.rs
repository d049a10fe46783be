//! Noise of stripes that run along a given direction, pivot by pivot.
//!
//! The plane is cut into square cells, and in each chance sets a pivot and a phase. Each pivot emits a plane wave, but
//! each vertex measures the wave along its own direction across the stripes. So the stripes turn where the direction
//! turns, and the error of treating the direction as constant stays limited to the reach of a pivot. The waves that
//! reach a vertex are summed as cosine and sine, weighted by `(1 - d^2)^3` with d the distance in reaches, and the pair
//! is scaled to length one: stripes of different pivots join where their phases agree, and branch where they do not, at
//! full height.
//!
//! As with bumps (`splat.rs`), the pivots around a block of vertices are found once, and those that reach a few rows of
//! a strip are added in the order of their cells. Beyond its reach a pivot adds exactly zero, so a vertex has the same
//! bits whichever further pivots are added in its strip. The cost is about 25 vector operations per vector and pivot;
//! with long waves, 5 to 8 pivots reach a strip.

use super::lattice::{cell, fixed_point, fraction, hash, origin};
use crate::area::Area;
use crate::simd::{self, Kernel, MAX_LANES, Simd};
use std::ops::Range;

/// Columns and rows of a block. Blocks are aligned with the world, so a vertex has the same bits in every area, and
/// these two numbers are part of the noise's definition.
const BLOCK_COLUMNS: usize = 64;
const BLOCK_ROWS: usize = 32;

/// Side of a cell in wavelengths. Larger cells make stripes longer; but a pivot's wave is then bent more where the
/// direction turns.
const CELL_WAVES: f64 = 1.3;
/// Largest distance of a pivot from the middle of its cell along each axis, in cells. More hides the grid better, but
/// then a place may be farther from all pivots.
const JITTER: f64 = 0.3;
/// Reach of a wave from its pivot, in cells: a little more than sqrt(1/2) + sqrt(2) 0.3 = 1.13, the farthest that a
/// place can be from the nearest pivot, so that every place is reached.
const REACH: f64 = 1.25;
/// Reach of a wave from the middle of its pivot's cell along an axis, in cells, with a small margin for rounding.
const CELL_REACH: f64 = REACH + JITTER + 1e-3;
/// The square of the reach: 1 in reaches, and a margin larger than the rounding of positions.
const REACH2: f32 = 1.0002;

/// Least length of the sum for a wave of full height, as a share of the sum of the weights. Where phases agree less,
/// the wave is lower: at the ends of stripes it must pass through zero.
const FULL_SHARE: f32 = 0.45;

/// The shortest waves in vertices: vertices cannot tell shorter waves from longer ones.
const MIN_WAVE: f64 = 2.0;
/// Number of cells that can reach a block along each axis, for the shortest waves.
const CELL_COLUMNS: usize = 32;
const CELL_ROWS: usize = 16;
const _: () = assert!(cells(BLOCK_COLUMNS) <= CELL_COLUMNS && cells(BLOCK_ROWS) <= CELL_ROWS);
/// Distance between two rows of cells in memory: the cells of a row, and room to load a vector from any of them.
const STRIDE: usize = CELL_COLUMNS + MAX_LANES;

/// Largest number of rows that are computed in one go.
const GROUP_ROWS: usize = 16;
/// Largest height of these rows together, in cells: fewer rows are reached by fewer pivots; more rows share the cost of
/// finding them.
const GROUP_CELLS: f64 = 0.8;
/// Number of pivots that can reach these rows of a strip, for the shortest waves.
const MAX_REACHING: usize = cells(MAX_LANES) * 4;
const _: () = assert!(GROUP_CELLS + 2.0 * CELL_REACH < 4.0);

/// Returns the largest number of cells that can reach a stretch of so many vertices, for the shortest waves.
const fn cells(vertices: usize) -> usize {
    ((vertices - 1) as f64 / (MIN_WAVE * CELL_WAVES) + 2.0 * CELL_REACH) as usize + 1
}

/// Stripes that run along a direction which changes slowly from vertex to vertex.
///
/// Around a vertex they look like a plane wave. Where the direction turns, and also at random every few wavelengths,
/// they branch, join and end. The values are a pure function of the vertex, the direction there, and the arguments of
/// [`Stripes::new`]: the bits do not depend on the area or the CPU. The pattern repeats after 2^32 cells of 1.3
/// wavelengths.
///
/// The pair of crest and flank has length 1, except around the ends of stripes, where the length goes down to zero
/// smoothly: it is below 0.9 in an eighth of the area. Where all phases agree, crest and flank are cosine and sine
/// within 0.003. Across the stripes, the slope of the crest is `-flank 2 pi / wavelength` and that of the flank
/// `crest 2 pi / wavelength`, on average.
///
/// Based on: R. Johansen (runevision), Fast and Gorgeous Erosion Filter, 2026.
#[derive(Clone, Debug)]
pub struct Stripes {
    /// Cells per vertex.
    frequency: f64,
    /// Position of vertex (0, 0) in cells, and its change for each vertex: fixed point, see [`cell`] and [`fraction`].
    origin: [u128; 2],
    step: u128,
    /// Distance from the block's first column to each column, in reaches; rows lie as far apart.
    steps: [f32; BLOCK_COLUMNS],
    /// Number of rows that are computed in one go: a power of two. It has no effect on the values.
    group_rows: usize,
}

impl Stripes {
    /// Makes stripes `wavelength_m` apart from crest to crest, for a lattice of vertices `spacing_m` apart.
    ///
    /// The seed should already be mixed for this use of noise: two patterns with the same seed are alike.
    ///
    /// # Panics
    /// If the wavelength is less than two spacings or more than 2^30 of them, or a length is not a positive number.
    pub fn new(wavelength_m: f64, spacing_m: f64, seed: u64) -> Stripes {
        let wave = wavelength_m / spacing_m;
        assert!(
            spacing_m > 0.0 && (MIN_WAVE..=(1_u64 << 30) as f64).contains(&wave),
            "stripes must be from 2 to 2^30 vertex spacings apart, not {wavelength_m} m at a spacing of {spacing_m} m"
        );
        let frequency = 1.0 / (wave * CELL_WAVES);
        // A random window of the lattice, as for the octaves of a fractal, but with a number that no octave uses.
        let origin = origin(seed, 1 << 40);
        let mut steps = [0.0; BLOCK_COLUMNS];
        for (index, step) in steps.iter_mut().enumerate() {
            *step = (index as f64 * frequency / REACH) as f32;
        }
        // As many rows as keep within the height that few pivots reach.
        let mut group_rows = 2;
        while group_rows < GROUP_ROWS && (2 * group_rows - 1) as f64 * frequency <= GROUP_CELLS {
            group_rows *= 2;
        }
        Stripes { frequency, origin, step: fixed_point(frequency), steps, group_rows }
    }

    /// Fills in the wave of the stripes at the vertices of `area`, row by row from the north: `crest` is its cosine,
    /// `flank` its sine, both from -1 to 1, apart from rounding errors of a millionth.
    ///
    /// `across` is the unit vector, east and south, across the stripes at each vertex: the phase grows in its
    /// direction. A shorter vector makes longer waves; with (0, 0) all phases are those of the pivots, which gives
    /// blotches. Components must be within -1000 and 1000, or values may be NaN.
    ///
    /// # Panics
    /// If a slice does not have as many elements as the area has vertices.
    pub fn fill(&self, area: Area, across: &[Vec<f32>; 2], crest: &mut [f32], flank: &mut [f32]) {
        simd::dispatch(self.filling(area, across, crest, flank));
    }

    /// Returns the kernel that does so.
    fn filling<'a>(
        &'a self,
        area: Area,
        across: &'a [Vec<f32>; 2],
        crest: &'a mut [f32],
        flank: &'a mut [f32],
    ) -> StripesFill<'a> {
        let vertices = if area.is_empty() { 0 } else { area.len() };
        assert!(
            [across[0].len(), across[1].len(), crest.len(), flank.len()] == [vertices; 4],
            "one direction and one value for each vertex of the area"
        );
        StripesFill { stripes: self, area, across, crest, flank }
    }
}

/// The kernel that fills an area.
struct StripesFill<'a> {
    stripes: &'a Stripes,
    area: Area,
    across: &'a [Vec<f32>; 2],
    crest: &'a mut [f32],
    flank: &'a mut [f32],
}

/// The pivots of the cells that can reach a block, row by row.
struct Pivots {
    /// Vector from the block's first vertex to the pivot, in reaches.
    x: [f32; STRIDE * CELL_ROWS],
    y: [f32; STRIDE * CELL_ROWS],
    /// Phase in turns.
    phase: [f32; STRIDE * CELL_ROWS],
    /// Vector from the middle of the first cell to the block's first vertex, in cells.
    first: [f64; 2],
}

impl Pivots {
    /// Returns empty room for pivots.
    fn none() -> Pivots {
        let each = [0.0; STRIDE * CELL_ROWS];
        Pivots { x: each, y: each, phase: each, first: [0.0; 2] }
    }
}

/// A pivot that reaches a few rows of a strip.
#[derive(Clone, Copy)]
struct Reaching<S: Simd> {
    /// For each column, the distance east from the pivot to the vertex in reaches, and its square.
    dx: S::F32,
    dx2: S::F32,
    /// For each row, the distance south from the pivot to the vertex, and one less its square.
    dy: [f32; GROUP_ROWS],
    base: [f32; GROUP_ROWS],
    phase: f32,
}

impl Kernel for StripesFill<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(mut self, simd: S) {
        if self.area.is_empty() {
            return;
        }
        let mut pivots = Pivots::none();
        let zero = simd.splat(0.0);
        // Places to be filled; only those that were filled are read.
        let none = Reaching { dx: zero, dx2: zero, dy: [0.0; GROUP_ROWS], base: [0.0; GROUP_ROWS], phase: 0.0 };
        let mut reaching = [none; MAX_REACHING];
        let (columns, rows) = (BLOCK_COLUMNS as i64, BLOCK_ROWS as i64);
        let Area { x0, y0, x1, y1 } = self.area;
        for block_y in y0.div_euclid(rows)..=(y1 - 1).div_euclid(rows) {
            for block_x in x0.div_euclid(columns)..=(x1 - 1).div_euclid(columns) {
                let (x, y) = (block_x * columns, block_y * rows);
                let part_columns = (x0.max(x) - x) as usize..(x1.min(x + columns) - x) as usize;
                let part_rows = (y0.max(y) - y) as usize..(y1.min(y + rows) - y) as usize;
                self.stripes.find_pivots(simd, x, y, &mut pivots);
                // A few rows at a time: the fewer rows, the fewer pivots reach any of them.
                let mut start = part_rows.start;
                while start < part_rows.end {
                    let end = part_rows.end.min((start / self.stripes.group_rows + 1) * self.stripes.group_rows);
                    for strip in part_columns.start / S::LANES..=(part_columns.end - 1) / S::LANES {
                        let column = strip * S::LANES;
                        let count = self.stripes.find_reaching(simd, &pivots, column, start..end, &mut reaching);
                        let wanted = part_columns.start.max(column)..part_columns.end.min(column + S::LANES);
                        let at = (y + start as i64 - y0) as usize * self.area.width()
                            + (x + wanted.start as i64 - x0) as usize;
                        let lanes = wanted.start - column..wanted.end - column;
                        self.add_up(simd, &reaching[..count], end - start, lanes, at);
                    }
                    start = end;
                }
            }
        }
    }
}

impl Stripes {
    /// Finds the pivots around the block whose first vertex is (x, y). Returns the numbers of columns and rows of their
    /// cells.
    #[inline(always)]
    fn find_pivots<S: Simd>(&self, simd: S, x: i64, y: i64, pivots: &mut Pivots) -> [usize; 2] {
        let position_x = self.origin[0].wrapping_add(self.step.wrapping_mul(i128::from(x) as u128));
        let position_y = self.origin[1].wrapping_add(self.step.wrapping_mul(i128::from(y) as u128));
        // The first cell whose middle is near enough, counted from the cell of the vertex.
        let (fraction_x, fraction_y) = (fraction(position_x), fraction(position_y));
        // A cell's position is that of its middle, half a cell after the cell's number.
        let first_x = (fraction_x - 0.5 - CELL_REACH).ceil();
        let first_y = (fraction_y - 0.5 - CELL_REACH).ceil();
        pivots.first = [fraction_x - 0.5 - first_x, fraction_y - 0.5 - first_y];
        let count_x = ((BLOCK_COLUMNS - 1) as f64 * self.frequency + pivots.first[0] + CELL_REACH) as usize + 1;
        let count_y = ((BLOCK_ROWS - 1) as f64 * self.frequency + pivots.first[1] + CELL_REACH) as usize + 1;
        let cell_x = cell(position_x).wrapping_add(first_x as i32 as u32);
        let cell_y = cell(position_y).wrapping_add(first_y as i32 as u32);

        // The random bits: 11 for each coordinate of the pivot, 10 for the phase.
        let cell_side = simd.splat((1.0 / REACH) as f32);
        let jitter = simd.splat((2.0 * JITTER / REACH / 2048.0) as f32);
        let turn = simd.splat(1.0 / 1024.0);
        for row in 0..count_y {
            let of_v = simd.splat_u32(hash::of_v(cell_y.wrapping_add(row as u32)));
            let middle_y = simd.splat(((row as f64 - pivots.first[1] - JITTER) / REACH) as f32);
            let west = simd.splat(((-pivots.first[0] - JITTER) / REACH) as f32);
            for column in (0..count_x).step_by(S::LANES) {
                let local = simd.lane_numbers() + simd.splat_u32(column as u32);
                let chance = hash::word_lanes(simd, hash::of_u_lanes(simd, cell_x, local), of_v);
                let chance_x = simd.i32_to_f32(simd.shr::<21>(chance));
                let chance_y = simd.i32_to_f32(simd.shr::<10>(chance) & simd.splat_u32(2047));
                let chance_phase = simd.i32_to_f32(chance & simd.splat_u32(1023));
                let at = row * STRIDE + column;
                simd.store(simd.i32_to_f32(local) * cell_side + west + chance_x * jitter, &mut pivots.x[at..]);
                simd.store(middle_y + chance_y * jitter, &mut pivots.y[at..]);
                simd.store(chance_phase * turn, &mut pivots.phase[at..]);
            }
        }
        [count_x, count_y]
    }

    /// Finds the pivots that reach some rows of the strip from `column` on, in the order of their cells. Returns their
    /// number.
    #[inline(always)]
    fn find_reaching<S: Simd>(
        &self,
        simd: S,
        pivots: &Pivots,
        column: usize,
        rows: Range<usize>,
        reaching: &mut [Reaching<S>; MAX_REACHING],
    ) -> usize {
        let columns = &self.steps[column..column + S::LANES];
        let cells_x = self.near(pivots.first[0], column..column + S::LANES);
        let cells_y = self.near(pivots.first[1], rows.clone());
        let (west, east) = (simd.splat(columns[0]), simd.splat(columns[S::LANES - 1]));
        let (north, south) = (simd.splat(self.steps[rows.start]), simd.splat(self.steps[rows.end - 1]));
        let (zero, one) = (simd.splat(0.0), simd.splat(1.0));
        let columns = simd.load(columns);
        let mut count = 0;
        for cell_y in cells_y {
            for cell_x in cells_x.clone().step_by(S::LANES) {
                let first = cell_y * STRIDE + cell_x;
                let (x, y) = (simd.load(&pivots.x[first..]), simd.load(&pivots.y[first..]));
                // Distance from the pivot to the nearest vertex of the strip, as for bumps.
                let nearest_dx = simd.max(simd.max(west - x, x - east), zero);
                let nearest_dy = simd.max(simd.max(north - y, y - south), zero);
                let reached = simd.lt(nearest_dx * nearest_dx + nearest_dy * nearest_dy, simd.splat(REACH2));
                // Lanes past the last cell hold values of an earlier block.
                let cells_left = (cells_x.end - cell_x).min(S::LANES) as u32;
                let mut bits = simd.mask_bits(reached) & u32::MAX >> (32 - cells_left);
                while bits != 0 {
                    let pivot = first + bits.trailing_zeros() as usize;
                    bits &= bits - 1;
                    // Values that depend on the column or the row alone are computed here, so that `add_up` has little
                    // to do per vertex.
                    let found = &mut reaching[count];
                    count += 1;
                    found.dx = columns - simd.splat(pivots.x[pivot]);
                    found.dx2 = found.dx * found.dx;
                    found.phase = pivots.phase[pivot];
                    let y = simd.splat(pivots.y[pivot]);
                    for row in (0..rows.len()).step_by(S::LANES) {
                        let dy = simd.load(&self.steps[rows.start + row..]) - y;
                        simd.store(dy, &mut found.dy[row..]);
                        simd.store(one - dy * dy, &mut found.base[row..]);
                    }
                }
            }
        }
        count
    }

    /// Returns the cells, along an axis, that are near enough to reach some vertices of the block.
    #[inline(always)]
    fn near(&self, first: f64, vertices: Range<usize>) -> Range<usize> {
        let start = first + vertices.start as f64 * self.frequency - CELL_REACH;
        let end = first + (vertices.end - 1) as f64 * self.frequency + CELL_REACH;
        // Truncation may add one cell at the start.
        start as usize..end as usize + 1
    }
}

impl StripesFill<'_> {
    /// Adds up the waves in the wanted lanes of `rows` rows of a strip; `at` is the index of the first of these values
    /// in the area.
    #[inline(always)]
    fn add_up<S: Simd>(&mut self, simd: S, reaching: &[Reaching<S>], rows: usize, lanes: Range<usize>, mut at: usize) {
        // Distances are in reaches: this is the number of turns of the phase in a reach.
        let turns = simd.splat((REACH * CELL_WAVES) as f32);
        let zero = simd.splat(0.0);
        // There are never more rows, but this tells the compiler that no index is out of range.
        for row in 0..rows.min(GROUP_ROWS) {
            let across_x = load_part(simd, &self.across[0][at..], &lanes) * turns;
            let across_y = load_part(simd, &self.across[1][at..], &lanes) * turns;
            let mut sum = WaveSum { weight: zero, sine2: zero, both: zero };
            for pivot in reaching {
                // Past its reach the weight is exactly zero, and so is all that the pivot adds.
                let t = simd.max(simd.splat(pivot.base[row]) - pivot.dx2, zero);
                let phase = across_x * pivot.dx + (across_y * simd.splat(pivot.dy[row]) + simd.splat(pivot.phase));
                sum = sum.plus(simd, t * t * t, phase);
            }
            let (crest, flank) = sum.crest_and_flank(simd);
            store_part(simd, crest, &mut self.crest[at..], &lanes);
            store_part(simd, flank, &mut self.flank[at..], &lanes);
            at += self.area.width();
        }
    }
}

/// A weighted sum of waves, expressed by the sine s and the cosine c of half their phases, both scaled.
#[derive(Clone, Copy)]
struct WaveSum<S: Simd> {
    weight: S::F32,
    /// Weighted sum of s^2.
    sine2: S::F32,
    /// Weighted sum of s c.
    both: S::F32,
}

/// Coefficients for the sine and cosine of half a phase. Half a phase is within a quarter turn, where few terms
/// suffice. With r the phase in turns, less the nearest whole number, `sin(pi r)` is
/// `SINE r (r^4 + SINE_1 r^2 + SINE_0)`, within 0.0002, and `cos(pi r)` is `COSINE (r^2 - 1/4) (r^2 - COSINE_0)`,
/// within 0.0012. At r = 1/2 the sine is 1 and flat and the cosine 0, so that the wave is smooth where r jumps. The fit
/// minimises the largest error.
const SINE: f64 = 2.2295;
const SINE_1: f64 = -4.0 / SINE - 0.5;
const SINE_0: f64 = 3.0 / SINE + 0.0625;
const COSINE: f64 = 4.0 * 0.901;
const COSINE_0: f64 = 1.0 / 0.901;

impl<S: Simd> WaveSum<S> {
    /// Returns this sum plus a wave of some weight and phase, in turns.
    #[inline(always)]
    fn plus(self, simd: S, weight: S::F32, phase: S::F32) -> WaveSum<S> {
        // A float of this size has no fraction: adding it rounds to the nearest whole number.
        let rounder = simd.splat(1.5 * (1 << 23) as f32);
        let r = phase - ((phase + rounder) - rounder);
        let r2 = r * r;
        let sine = r * ((r2 + simd.splat(SINE_1 as f32)) * r2 + simd.splat(SINE_0 as f32));
        let cosine = (r2 - simd.splat(0.25)) * (r2 - simd.splat(COSINE_0 as f32));
        let weighted = weight * sine;
        WaveSum {
            weight: self.weight + weight,
            sine2: self.sine2 + weighted * sine,
            both: self.both + weighted * cosine,
        }
    }

    /// Returns the cosine and the sine of the sum, scaled to length one.
    #[inline(always)]
    fn crest_and_flank(self, simd: S) -> (S::F32, S::F32) {
        let cosine = self.weight - self.sine2 * simd.splat((2.0 * SINE * SINE) as f32);
        let sine = self.both * simd.splat((2.0 * SINE * COSINE) as f32);
        let length = simd.sqrt(cosine * cosine + sine * sine);
        let inverse = simd.splat(1.0) / simd.max(length, self.weight * simd.splat(FULL_SHARE));
        // The length is 1 from the full share on; below that it is q (3 - q^2) / 2, which has no kink there.
        let q = length * inverse;
        let scale = inverse * (simd.splat(1.5) - simd.splat(0.5) * (q * q));
        (cosine * scale, sine * scale)
    }
}

/// Loads the first of `from` into the wanted lanes of a vector; the others are zero.
#[inline(always)]
fn load_part<S: Simd>(simd: S, from: &[f32], lanes: &Range<usize>) -> S::F32 {
    if lanes.len() == S::LANES {
        return simd.load(from);
    }
    let mut vector = [0.0; MAX_LANES];
    vector[lanes.clone()].copy_from_slice(&from[..lanes.len()]);
    simd.load(&vector)
}

/// Stores the wanted lanes to the first of `to`.
#[inline(always)]
fn store_part<S: Simd>(simd: S, value: S::F32, to: &mut [f32], lanes: &Range<usize>) {
    if lanes.len() == S::LANES {
        return simd.store(value, to);
    }
    let mut vector = [0.0; MAX_LANES];
    simd.store(value, &mut vector);
    to[..lanes.len()].copy_from_slice(&vector[lanes.clone()]);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::Level;

    /// Areas of the tests: at the origin, at negative coordinates, at 10^12, and 2^50 vertices away.
    const PLACES: [(i64, i64); 4] =
        [(0, 0), (-1000, -77), (1_000_000_000_000, -1_000_000_000_000), (1 << 50, -(1 << 50) + 9)];

    /// Wavelengths in vertices.
    const WAVES: [f64; 6] = [2.0, 3.0, 7.3, 24.0, 110.0, 200.0];

    /// Returns a turning direction, as a function of the vertex alone; it is missing at some vertices.
    fn turning(area: Area) -> [Vec<f32>; 2] {
        let mut across = [Vec::new(), Vec::new()];
        for y in area.y0..area.y1 {
            for x in area.x0..area.x1 {
                let angle = (x.rem_euclid(700) * 9 + y.rem_euclid(500) * 13) as f32 * 1e-3;
                let is_there = (x + 3 * y).rem_euclid(97) != 0;
                across[0].push(if is_there { angle.cos() } else { 0.0 });
                across[1].push(if is_there { angle.sin() } else { 0.0 });
            }
        }
        across
    }

    fn widest() -> Level {
        Level::available()[Level::available().len() - 1]
    }

    fn filled(stripes: &Stripes, level: Level, area: Area, across: &[Vec<f32>; 2]) -> [Vec<f32>; 2] {
        let mut waves = [vec![f32::NAN; area.len()], vec![f32::NAN; area.len()]];
        let [crest, flank] = &mut waves;
        simd::dispatch_at(level, stripes.filling(area, across, crest, flank));
        waves
    }

    fn bits(values: &[f32]) -> Vec<u32> {
        values.iter().map(|value| value.to_bits()).collect()
    }

    #[test]
    fn every_level_has_the_same_bits() {
        for (wave, (x, y)) in WAVES.into_iter().flat_map(|wave| PLACES.map(|place| (wave, place))) {
            let stripes = Stripes::new(wave * 0.7, 0.7, 3);
            let area = Area::new(x - 5, y - 3, 147, 70);
            let across = turning(area);
            let reference = filled(&stripes, Level::Scalar, area, &across).map(|wave| bits(&wave));
            for level in Level::available() {
                let waves = filled(&stripes, level, area, &across).map(|wave| bits(&wave));
                assert!(waves == reference, "waves of {wave} at {x}, {y}: {} differs", level.name());
            }
        }
    }

    #[test]
    fn a_window_is_the_crop_of_a_larger_area() {
        for (wave, (x, y)) in WAVES.into_iter().flat_map(|wave| PLACES.map(|place| (wave, place))) {
            let stripes = Stripes::new(wave, 1.0, 4);
            let large = Area::new(x - 70, y - 40, 150, 90);
            let whole = filled(&stripes, widest(), large, &turning(large));
            for (dx, dy, width, height) in [(0, 0, 1, 1), (13, 7, 64, 32), (69, 39, 3, 50), (1, 88, 149, 1)] {
                let window = Area::new(large.x0 + dx, large.y0 + dy, width, height);
                let across = turning(window);
                for level in Level::available() {
                    let part = filled(&stripes, level, window, &across);
                    for row in 0..height {
                        let start = (dy as usize + row) * large.width() + dx as usize;
                        for (part, whole) in part.iter().zip(&whole) {
                            let (part, whole) = (&part[row * width..][..width], &whole[start..][..width]);
                            assert_eq!(bits(part), bits(whole), "waves of {wave}, {window:?}, {}", level.name());
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn waves_are_within_one_and_of_mean_zero() {
        for (wave, (x, y)) in WAVES.into_iter().flat_map(|wave| PLACES.map(|place| (wave, place))) {
            let area = Area::new(x, y, 400, 400);
            let [crest, flank] = filled(&Stripes::new(wave, 1.0, 5), widest(), area, &turning(area));
            let lengths = crest.iter().zip(&flank).map(|(crest, flank)| crest.hypot(*flank));
            assert!(lengths.clone().all(|length| length <= 1.000_01), "waves of {wave} at {x}, {y}");
            let high = lengths.filter(|length| *length > 0.9).count();
            assert!(high > area.len() * 4 / 5, "waves of {wave} at {x}, {y}: {high} are high");
            // In the area there are too few longer waves for a mean of zero.
            for values in [&crest, &flank].into_iter().filter(|_| wave <= 24.0) {
                let mean = values.iter().map(|value| f64::from(*value)).sum::<f64>() / area.len() as f64;
                assert!(mean.abs() < 0.001 + 0.0007 * wave, "waves of {wave} at {x}, {y}: mean {mean}");
            }
        }
    }

    #[test]
    fn crests_are_a_wavelength_apart_across_and_long_along() {
        for (wave, (x, y)) in [3.0, 12.0, 24.0].into_iter().flat_map(|wave| PLACES.map(|place| (wave, place))) {
            let area = Area::new(x, y, 500, 500);
            for angle in [0.0_f64, 0.3, 0.8, 2.0] {
                let across = [vec![angle.cos() as f32; area.len()], vec![angle.sin() as f32; area.len()]];
                let [crest, flank] = filled(&Stripes::new(wave, 1.0, 6), widest(), area, &across);
                // Returns the mean growth of the phase from a vertex to the next, relative to that of a plane wave
                // straight across.
                let turn = |step: usize| {
                    let (mut real, mut imaginary) = (0.0, 0.0);
                    for at in 0..area.len() - area.width() {
                        let [c0, s0, c1, s1] =
                            [crest[at], flank[at], crest[at + step], flank[at + step]].map(f64::from);
                        real += c0 * c1 + s0 * s1;
                        imaginary += c0 * s1 - s0 * c1;
                    }
                    imaginary.atan2(real) / std::f64::consts::TAU * wave
                };
                let (east, south) = (turn(1), turn(area.width()));
                let across = east * angle.cos() + south * angle.sin();
                let along = south * angle.cos() - east * angle.sin();
                let is_right = (across - 1.0).abs() < 0.05 && along.abs() < 0.05;
                assert!(is_right, "waves of {wave} at {x}, {y}, angle {angle}: {across} waves across, {along} along");
            }
        }
    }

    /// Also across the borders of blocks and cells, and far away.
    #[test]
    fn waves_are_smooth_everywhere() {
        for (wave, (x, y)) in [110.0, 200.0].into_iter().flat_map(|wave| PLACES.map(|place| (wave, place))) {
            let area = Area::new(x - 200, y - 200, 400, 400);
            let across = [vec![0.8; area.len()], vec![0.6; area.len()]];
            let mut roughest = 0.0_f32;
            for values in filled(&Stripes::new(wave, 1.0, 8), widest(), area, &across) {
                for step in [1, area.width()] {
                    for at in step..area.len() - step {
                        let is_inside = step != 1 || !matches!(at % area.width(), 0 | 399);
                        let bend = values[at - step] - 2.0 * values[at] + values[at + step];
                        roughest = if is_inside { roughest.max(bend.abs()) } else { roughest };
                    }
                }
            }
            // The greatest bend of a plane wave; at the ends of stripes it is larger. A jump would be a hundred times
            // this.
            let unit = (std::f32::consts::TAU / wave as f32).powi(2);
            assert!(roughest < 6.0 * unit, "waves of {wave} at {x}, {y}: bent by {} of a wave", roughest / unit);
        }
    }

    #[test]
    #[should_panic(expected = "stripes must be from 2 to 2^30 vertex spacings apart, not 3 m at a spacing of 2 m")]
    fn stripes_closer_than_two_vertices_are_refused() {
        let _ = Stripes::new(3.0, 2.0, 0);
    }
}
