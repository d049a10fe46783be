//! Fractals: their octaves, and the loop that fills an area.

use super::bounds::bounds;
use super::fold::{Fbm, Fold, FoldStep, Hetero, Hybrid, OctaveState, Ridged};
use super::lattice::Lattice;
use super::rows::{PointRows, RowWise};
use super::simplex::{RowStart, Simplex};
use super::spec::{FractalKind, FractalSpec};
use super::splat::{Bumps, NoiseSink, Splat};
use crate::area::Area;
use crate::simd::{self, Kernel, Level, MAX_LANES, Simd};
use std::marker::PhantomData;
use std::ops::Range;

/// A fractal, ready to fill areas. A pure function of the vertex, the specification and the seed.
#[derive(Clone, Debug)]
pub struct Fractal {
    pub(super) kind: FractalKind,
    pub(super) octaves: Vec<Octave>,
    bounds: (f32, f32),
    max_warp_m: f32,
}

/// Columns and rows of a block. Blocks are aligned with the world, so a vertex has the same bits in every area, and
/// these two numbers are part of the noise's definition. The sums of a block fit in the first-level cache.
pub(super) const BLOCK_COLUMNS: usize = 64;
pub(super) const BLOCK_ROWS: usize = 32;
const BLOCK_VERTICES: usize = BLOCK_COLUMNS * BLOCK_ROWS;
const _: () = assert!(BLOCK_COLUMNS.is_multiple_of(MAX_LANES) && BLOCK_ROWS.is_multiple_of(MAX_LANES));

/// Largest displacement in cells of the finest octave: a float of this size resolves 2^-13 of a cell.
const MAX_WARP_CELLS: f64 = 1024.0;

#[derive(Clone, Debug)]
pub(super) struct Octave {
    pub lattice: Lattice,
    pub step: FoldStep,
    pub evaluation: Evaluation,
    /// Used for warped areas, and for the shortest waves.
    pub simplex: Simplex<BLOCK_COLUMNS>,
}

/// The method that computes the noise of an octave. All methods compute the same function, but round differently. So
/// the choice depends on the octave's frequency alone, and is part of the noise's definition.
#[derive(Clone, Debug)]
#[allow(clippy::large_enum_variant, reason = "a fractal has a handful of octaves")]
pub(super) enum Evaluation {
    Splat(Splat<BLOCK_COLUMNS, BLOCK_ROWS>),
    RowWise(RowWise<BLOCK_COLUMNS>),
    Simplex,
}

impl Fractal {
    /// Makes the fractal on a vertex lattice of this spacing.
    ///
    /// The seed should already be mixed for this use of noise: two fractals with the same seed are alike.
    ///
    /// # Panics
    /// If there is no octave, a number is not finite, the lacunarity is below one, the gain is out of range, or the
    /// waves of the finest octave are shorter than the spacing.
    pub fn new(spec: &FractalSpec, spacing_m: f64, seed: u64) -> Fractal {
        assert!(spec.octaves >= 1, "a fractal needs an octave");
        assert!(spec.lacunarity >= 1.0, "lacunarity must be at least 1, not {}", spec.lacunarity);
        assert!(spec.h.is_finite() && spec.kind.offset().is_finite(), "h and offset must be finite");
        let mut kind = spec.kind;
        let mut octave_count = spec.octaves;
        if let FractalKind::Ridged { offset, gain } = spec.kind {
            // The noise is scaled by the gain's root, and the amplitude by its inverse: both must be floats without
            // underflow or overflow.
            assert!(gain == 0.0 || (1e-6..=1e6).contains(&gain), "gain must be 0 or from 1e-6 to 1e6, not {gain}");
            if gain == 0.0 {
                // With a gain of 0, every weight after the first octave is zero.
                octave_count = 1;
                kind = FractalKind::Ridged { offset, gain: 1.0 };
            }
        }
        let amplitudes: Vec<f64> =
            (0..octave_count).map(|octave| libm::pow(spec.lacunarity, -spec.h * f64::from(octave))).collect();
        let mut frequency = spacing_m / spec.wavelength_m;
        let mut octaves = Vec::new();
        for (octave, &amplitude) in (0..).zip(&amplitudes) {
            octaves.push(Octave::new(kind, frequency, amplitude, spacing_m, Lattice::new(frequency, seed, octave)));
            // Far away, the last bit of a frequency makes many cells of difference: this rounding is part of the
            // noise's definition.
            frequency *= spec.lacunarity;
        }
        let finest_m = spacing_m / octaves[octaves.len() - 1].lattice.frequency;
        Fractal { kind, bounds: bounds(kind, &amplitudes), max_warp_m: (MAX_WARP_CELLS * finest_m) as f32, octaves }
    }

    /// Returns the least and the greatest possible value, rounding included. The bounds are proved, and
    /// therefore wider than the values that occur.
    pub fn bounds(&self) -> (f32, f32) {
        self.bounds
    }

    /// Returns the largest displacement along an axis, in metres, that [`Fractal::fill_warped`] accepts: 1024
    /// wavelengths of the finest octave. Further away, a float cannot place a vertex precisely enough within a cell.
    pub fn max_warp_m(&self) -> f32 {
        self.max_warp_m
    }

    /// Fills `out` with the values at the vertices of `area`, row by row from the north.
    ///
    /// # Panics
    /// If `out` has not as many elements as the area has vertices.
    pub fn fill(&self, area: Area, out: &mut [f32]) {
        assert_eq!(out.len(), area.width() * area.height(), "one value for each vertex of the area");
        self.run(None, area, None, out);
    }

    /// Fills `out` with the values at the vertices of `area`, each displaced by metres east and south.
    ///
    /// All octaves are computed vertex by vertex, so with a displacement of zero the values differ slightly from those
    /// of [`Fractal::fill`].
    ///
    /// # Panics
    /// If a slice has not as many elements as the area has vertices, or a displacement is beyond
    /// [`Fractal::max_warp_m`] or not a number.
    pub fn fill_warped(&self, area: Area, dx_m: &[f32], dy_m: &[f32], out: &mut [f32]) {
        let warp = self.checked_warp(area, dx_m, dy_m, out.len());
        self.run(None, area, Some(warp), out);
    }

    /// Does the same as [`Fractal::fill`] at a given SIMD level: for tests and benchmarks.
    pub fn fill_at(&self, level: Level, area: Area, out: &mut [f32]) {
        assert_eq!(out.len(), area.width() * area.height(), "one value for each vertex of the area");
        self.run(Some(level), area, None, out);
    }

    /// Does the same as [`Fractal::fill_warped`] at a given SIMD level: for tests and benchmarks.
    pub fn fill_warped_at(&self, level: Level, area: Area, dx_m: &[f32], dy_m: &[f32], out: &mut [f32]) {
        let warp = self.checked_warp(area, dx_m, dy_m, out.len());
        self.run(Some(level), area, Some(warp), out);
    }

    /// Runs the kernel of this fractal's kind, at the given SIMD level or the best one. Each kind has a kernel of its
    /// own: one for all kinds would be a function so large that only an optimising compiler copes with it.
    fn run(&self, level: Option<Level>, area: Area, warp: Option<Displacement<'_>>, out: &mut [f32]) {
        match self.kind {
            FractalKind::Fbm => self.run_kind::<Fbm>(level, area, warp, out),
            FractalKind::Ridged { .. } => self.run_kind::<Ridged>(level, area, warp, out),
            FractalKind::Hybrid { .. } => self.run_kind::<Hybrid>(level, area, warp, out),
            FractalKind::Hetero { .. } => self.run_kind::<Hetero>(level, area, warp, out),
        }
    }

    fn run_kind<F: Fold>(&self, level: Option<Level>, area: Area, warp: Option<Displacement<'_>>, out: &mut [f32]) {
        let fill = FractalFill::<F> { fractal: self, area, warp, out, kind: PhantomData };
        match level {
            Some(level) => simd::dispatch_at(level, fill),
            None => simd::dispatch(fill),
        }
    }

    fn checked_warp<'a>(&self, area: Area, dx_m: &'a [f32], dy_m: &'a [f32], values: usize) -> Displacement<'a> {
        let vertices = area.width() * area.height();
        assert!(
            values == vertices && dx_m.len() == vertices && dy_m.len() == vertices,
            "one value and one displacement for each vertex of the area"
        );
        // Counting takes a tenth of the time of a search that stops at the first hit. NaN counts as too far.
        let too_far = |displacements: &[f32]| {
            displacements.iter().map(|d| u32::from(d.is_nan() || d.abs() > self.max_warp_m)).sum::<u32>()
        };
        assert!(
            too_far(dx_m) + too_far(dy_m) == 0,
            "a displacement is more than {} m, or not a number",
            self.max_warp_m
        );
        Displacement { dx_m, dy_m }
    }
}

impl Octave {
    fn new(kind: FractalKind, frequency: f64, amplitude: f64, spacing_m: f64, lattice: Lattice) -> Octave {
        // Constants for the kind's fold: factors multiplied into the gradients cost nothing per vertex.
        let step = match kind {
            FractalKind::Fbm => FoldStep { noise_scale: amplitude, offset: 0.0, amplitude: 1.0 },
            FractalKind::Ridged { offset, gain } => FoldStep {
                noise_scale: gain.sqrt(),
                offset: (offset * gain.sqrt()) as f32,
                amplitude: (amplitude / gain) as f32,
            },
            FractalKind::Hybrid { offset } | FractalKind::Hetero { offset } => {
                FoldStep { noise_scale: amplitude, offset: (offset * amplitude) as f32, amplitude: 1.0 }
            }
        };
        // The fastest method that supports waves of this length.
        let evaluation = if frequency <= Splat::<BLOCK_COLUMNS, BLOCK_ROWS>::MAX_FREQUENCY {
            Evaluation::Splat(Splat::new(&lattice, step.noise_scale))
        } else if frequency <= RowWise::<BLOCK_COLUMNS>::MAX_FREQUENCY {
            Evaluation::RowWise(RowWise::new(&lattice, step.noise_scale))
        } else {
            Evaluation::Simplex
        };
        Octave { step, evaluation, simplex: Simplex::new(&lattice, spacing_m, step.noise_scale), lattice }
    }
}

/// Displacements of the vertices of an area, in metres.
#[derive(Clone, Copy)]
struct Displacement<'a> {
    dx_m: &'a [f32],
    dy_m: &'a [f32],
}

/// The kernel that fills an area.
struct FractalFill<'a, F> {
    fractal: &'a Fractal,
    area: Area,
    warp: Option<Displacement<'a>>,
    out: &'a mut [f32],
    kind: PhantomData<F>,
}

/// One number for each vertex of a block, stored in strips: each is as wide as the lanes and as high as the block.
#[repr(align(64))]
struct Strips([f32; BLOCK_VERTICES]);

/// The vertices of a block that lie in the area.
struct BlockPart {
    columns: Range<usize>,
    rows: Range<usize>,
}

/// The working memory of a block.
struct BlockScratch {
    bumps: Bumps<BLOCK_ROWS>,
    value: Strips,
    weight: Strips,
    dx_m: Strips,
    dy_m: Strips,
}

impl<F: Fold> Kernel for FractalFill<'_, F> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(mut self, simd: S) {
        if self.out.is_empty() {
            return;
        }
        // The same memory serves all blocks: every value is written for a block before it is read.
        let zeros = || Strips([0.0; BLOCK_VERTICES]);
        let mut scratch =
            BlockScratch { bumps: Bumps::new(), value: zeros(), weight: zeros(), dx_m: zeros(), dy_m: zeros() };
        let (columns, rows) = (BLOCK_COLUMNS as i64, BLOCK_ROWS as i64);
        let Area { x0, y0, x1, y1 } = self.area;
        for block_y in y0.div_euclid(rows)..=(y1 - 1).div_euclid(rows) {
            for block_x in x0.div_euclid(columns)..=(x1 - 1).div_euclid(columns) {
                let (x, y) = (block_x * columns, block_y * rows);
                let part = BlockPart {
                    columns: (x0.max(x) - x) as usize..(x1.min(x + columns) - x) as usize,
                    rows: (y0.max(y) - y) as usize..(y1.min(y + rows) - y) as usize,
                };
                self.block(simd, x, y, &part, &mut scratch);
            }
        }
    }
}

impl<F: Fold> FractalFill<'_, F> {
    /// Computes a part of the block whose first vertex is (x, y).
    #[inline(always)]
    fn block<S: Simd>(&mut self, simd: S, x: i64, y: i64, part: &BlockPart, scratch: &mut BlockScratch) {
        let first = (
            (y + part.rows.start as i64 - self.area.y0) as usize,
            (x + part.columns.start as i64 - self.area.x0) as usize,
        );
        let width = self.area.width();
        if let Some(warp) = self.warp {
            for (row, start) in part.rows.clone().zip((first.0 * width + first.1..).step_by(width)) {
                scratch.dx_m.set_row::<S>(row, part, &warp.dx_m[start..]);
                scratch.dy_m.set_row::<S>(row, part, &warp.dy_m[start..]);
            }
        }
        // Octave by octave, so that an octave looks up its lattice points once for the whole block.
        for (index, octave) in self.fractal.octaves.iter().enumerate() {
            let position = octave.lattice.at(x, y);
            let is_first = index == 0;
            match &octave.evaluation {
                // Displaced vertices do not lie in rows, so nothing can be computed for a whole row.
                _ if self.warp.is_some() => fold_simplex::<S, F, true>(simd, octave, position, is_first, part, scratch),
                Evaluation::Splat(splat) => fold_splat::<S, F>(simd, octave, splat, position, is_first, part, scratch),
                Evaluation::RowWise(rows) => fold_rows::<S, F>(simd, octave, rows, position, is_first, part, scratch),
                Evaluation::Simplex => fold_simplex::<S, F, false>(simd, octave, position, is_first, part, scratch),
            }
        }
        for (row, start) in part.rows.clone().zip((first.0 * width + first.1..).step_by(width)) {
            scratch.value.get_row::<S>(row, part, &mut self.out[start..]);
        }
    }
}

/// Computes an octave bump by bump, and folds it in.
#[inline(always)]
fn fold_splat<S: Simd, F: Fold>(
    simd: S,
    octave: &Octave,
    splat: &Splat<BLOCK_COLUMNS, BLOCK_ROWS>,
    position: [u128; 2],
    is_first: bool,
    part: &BlockPart,
    scratch: &mut BlockScratch,
) {
    splat.find_bumps(simd, position, &mut scratch.bumps);
    for strip in strips::<S>(part) {
        let column = strip * S::LANES;
        // The whole strip, whatever rows are wanted: a strip's place in the block does not depend on the area.
        let range = column * BLOCK_ROWS..(column + S::LANES) * BLOCK_ROWS;
        let mut sink = FoldSink::<F> {
            octave,
            is_first,
            value: &mut scratch.value.0[range.clone()],
            weight: &mut scratch.weight.0[range],
            kind: PhantomData,
        };
        splat.strip(simd, &scratch.bumps, column, &part.rows, &mut sink);
    }
}

/// Folds noise into the values and weights of a strip.
struct FoldSink<'a, F> {
    octave: &'a Octave,
    is_first: bool,
    value: &'a mut [f32],
    weight: &'a mut [f32],
    kind: PhantomData<F>,
}

impl<S: Simd, F: Fold> NoiseSink<S> for FoldSink<'_, F> {
    #[inline(always)]
    fn take(&mut self, simd: S, row: usize, noise: S::F32) {
        let at = row * S::LANES;
        fold::<S, F>(simd, self.octave, self.is_first, noise, &mut self.value[at..], &mut self.weight[at..]);
    }
}

/// Computes an octave row by row, and folds it in.
#[inline(always)]
fn fold_rows<S: Simd, F: Fold>(
    simd: S,
    octave: &Octave,
    rows: &RowWise<BLOCK_COLUMNS>,
    position: [u128; 2],
    is_first: bool,
    part: &BlockPart,
    scratch: &mut BlockScratch,
) {
    // The rows before the part are stepped over: positions are whole numbers, so the steps are exact, and the same in
    // every area.
    let mut points = PointRows::new();
    let mut row_position = position;
    for row in 0..part.rows.end {
        if row >= part.rows.start {
            let vertices = rows.row(simd, row_position, &mut points);
            for strip in strips::<S>(part) {
                let column = strip * S::LANES;
                let at = column * BLOCK_ROWS + row * S::LANES;
                let noise = rows.noise(simd, &vertices, column);
                fold::<S, F>(simd, octave, is_first, noise, &mut scratch.value.0[at..], &mut scratch.weight.0[at..]);
            }
        }
        row_position = octave.lattice.south_of(row_position);
    }
}

/// Computes an octave vertex by vertex, and folds it in.
#[inline(always)]
fn fold_simplex<S: Simd, F: Fold, const WARPED: bool>(
    simd: S,
    octave: &Octave,
    position: [u128; 2],
    is_first: bool,
    part: &BlockPart,
    scratch: &mut BlockScratch,
) {
    // The rows before the part are stepped over, as in `fold_rows`.
    let lanes = octave.simplex.lanes(simd);
    let mut row_position = position;
    for row in 0..part.rows.end {
        if row >= part.rows.start {
            let start = RowStart::new(row_position);
            for strip in strips::<S>(part) {
                let column = strip * S::LANES;
                let at = column * BLOCK_ROWS + row * S::LANES;
                let noise = if WARPED {
                    let (dx_m, dy_m) = (simd.load(&scratch.dx_m.0[at..]), simd.load(&scratch.dy_m.0[at..]));
                    lanes.noise_warped(simd, &start, column, dx_m, dy_m)
                } else {
                    lanes.noise(simd, &start, column)
                };
                fold::<S, F>(simd, octave, is_first, noise, &mut scratch.value.0[at..], &mut scratch.weight.0[at..]);
            }
        }
        row_position = octave.lattice.south_of(row_position);
    }
}

/// Folds the noise of one vector into its value and weight.
#[inline(always)]
fn fold<S: Simd, F: Fold>(
    simd: S,
    octave: &Octave,
    is_first: bool,
    noise: S::F32,
    value: &mut [f32],
    weight: &mut [f32],
) {
    let state = if is_first {
        F::first(simd, &octave.step, noise)
    } else {
        F::next(simd, &octave.step, noise, OctaveState { value: simd.load(value), weight: simd.load(weight) })
    };
    simd.store(state.value, value);
    simd.store(state.weight, weight);
}

/// Returns the range of strips that overlap a part.
#[inline(always)]
fn strips<S: Simd>(part: &BlockPart) -> Range<usize> {
    part.columns.start / S::LANES..(part.columns.end - 1) / S::LANES + 1
}

impl Strips {
    /// Copies the first of `values` into the wanted columns of a row.
    #[inline(always)]
    fn set_row<S: Simd>(&mut self, row: usize, part: &BlockPart, values: &[f32]) {
        let mut done = 0;
        for strip in strips::<S>(part) {
            let start = part.columns.start.max(strip * S::LANES) - strip * S::LANES;
            let end = part.columns.end.min((strip + 1) * S::LANES) - strip * S::LANES;
            let vector = &mut self.0[strip * S::LANES * BLOCK_ROWS + row * S::LANES..][..S::LANES];
            vector[start..end].copy_from_slice(&values[done..done + end - start]);
            done += end - start;
        }
    }

    /// Copies the wanted columns of a row to the first of `values`.
    #[inline(always)]
    fn get_row<S: Simd>(&self, row: usize, part: &BlockPart, values: &mut [f32]) {
        let mut done = 0;
        for strip in strips::<S>(part) {
            let start = part.columns.start.max(strip * S::LANES) - strip * S::LANES;
            let end = part.columns.end.min((strip + 1) * S::LANES) - strip * S::LANES;
            let vector = &self.0[strip * S::LANES * BLOCK_ROWS + row * S::LANES..][..S::LANES];
            if end - start == S::LANES {
                // A whole vector, by far the most frequent case: a copy of known size compiles to a move or two.
                values[done..done + S::LANES].copy_from_slice(vector);
            } else {
                values[done..done + end - start].copy_from_slice(&vector[start..end]);
            }
            done += end - start;
        }
    }
}
