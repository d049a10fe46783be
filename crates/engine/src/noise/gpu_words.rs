//! Fractals packed into words, for kernels that run on a GPU and compute the same bits.
//!
//! The GPU's kernel (`shaders/relief.wgsl`, which uses the names of the functions here) runs once per vertex, in the
//! same blocks of 64 x 32 vertices. The position of a block in the lattice of each octave takes more bits than the GPU
//! has, so it is computed here for each block; everything else is the same for all blocks.

use bytemuck::cast;

use super::fractal::{BLOCK_COLUMNS, BLOCK_ROWS, Evaluation, Fractal, Octave};
use super::lattice::{HASH_ONCE, HASH_TWICE, HASH_U, HASH_V, LANE_FRACTION, LANE_FRACTION_BITS, U_EAST, V_SOUTH};
use super::rows::pack_row;
use super::simplex::RowStart;
use super::spec::FractalKind;
use super::splat::{FAR, Splat};
use crate::wgsl::push;

/// Columns and rows of the blocks in which fractals are computed; blocks are aligned with the world.
pub(crate) const BLOCK: [usize; 2] = [BLOCK_COLUMNS, BLOCK_ROWS];

kernel_words! {
    /// A fractal: its kind, and the number of its octaves, which follow it.
    struct FractalWords in same, FRACTAL_WORDS { kind: u32, octaves: u32 }

    /// Words of an octave that are the same for all blocks: its method; the offset of the block's own words; changes
    /// per metre, of u to the east and of u and v to the south; gradients; and numbers for each column and row.
    struct OctaveWords in same, OCTAVE_WORDS {
        method: u32, block_at: u32, offset: f32, amplitude: f32, metres: [f32; 3],
        gradients: [f32; 32], columns: [u32; BLOCK_COLUMNS], rows: [f32; BLOCK_ROWS],
    }

    /// A row of lattice points: its distance to the south, the position of the block's first vertex among its points;
    /// and the points, which follow it.
    struct PointRowWords in own, POINT_ROW_START { dy: f32, x: f32 }

    /// A lattice point: its distance to the east, and its gradient.
    struct PointWords in own, POINT_WORDS { dx: f32, gradient: [f32; 2] }

    /// A row of lattice points beside a row of vertices: the point west of the first vertex, the position of the vertex
    /// after this point, the distance to the row, and the bumps' base.
    struct SideWords in own, SIDE_WORDS { u: u32, along: u32, dv: f32, base: f32 }

    /// Position of the first vertex of a block's row.
    struct StartWords in own, START_WORDS { cell: [u32; 2], fraction: [u32; 2] }

    const POINT_ROWS: i32, POINT_COLUMNS: i32, POINT_ROW_WORDS: u32, BETWEEN_WORDS: u32,
        FBM: u32, RIDGED: u32, HYBRID: u32, SPLAT: u32, ROW_WISE: u32, SIMPLEX: u32,
        LANE_FRACTION_BITS: u32, LANE_FRACTION: u32, HASH_U: u32, HASH_V: u32, HASH_ONCE: u32, HASH_TWICE: u32,
        U_EAST: f32, V_SOUTH: f32;
}

/// Bounds on the lattice points whose bumps reach a block (see `splat.rs`): the number of rows, and of points in a row.
const POINT_ROWS: usize = 5;
const POINT_COLUMNS: usize = 6;
const POINT_ROW_WORDS: usize = POINT_ROW_START + POINT_WORDS * POINT_COLUMNS;

/// Number of words of a row of vertices between two rows of points.
const BETWEEN_WORDS: usize = 1 + 2 * SIDE_WORDS;

/// Numbers of the methods of octaves, and of the kinds of fractals.
const SPLAT: OctaveMethod = OctaveMethod::Splat;
const ROW_WISE: OctaveMethod = OctaveMethod::RowWise;
const SIMPLEX: OctaveMethod = OctaveMethod::Simplex;
const FBM: u32 = 0;
const RIDGED: u32 = 1;
const HYBRID: u32 = 2;
const HETERO: u32 = 3;

/// The method by which a kernel computes an octave.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
enum OctaveMethod {
    Splat,
    RowWise,
    Simplex,
    Warped,
}

impl OctaveMethod {
    fn of(octave: &Octave, is_warped: bool) -> OctaveMethod {
        match &octave.evaluation {
            _ if is_warped => OctaveMethod::Warped,
            Evaluation::Splat(_) => OctaveMethod::Splat,
            Evaluation::RowWise(_) => OctaveMethod::RowWise,
            Evaluation::Simplex => OctaveMethod::Simplex,
        }
    }

    /// Returns the number of words of an octave that each block has of its own.
    fn block_words(self) -> usize {
        match self {
            OctaveMethod::Splat => 1 + POINT_ROWS * POINT_ROW_WORDS,
            OctaveMethod::RowWise => BLOCK_ROWS * BETWEEN_WORDS,
            OctaveMethod::Simplex | OctaveMethod::Warped => BLOCK_ROWS * START_WORDS,
        }
    }
}

impl Fractal {
    /// Appends the words that are the same for all blocks: the kind, the number of octaves, and the octaves.
    /// `block_words` is the number of words that a block has for fractals packed earlier; this fractal's are added to
    /// it.
    pub(crate) fn pack(&self, is_warped: bool, words: &mut Vec<u32>, block_words: &mut usize) {
        let kind = match self.kind {
            FractalKind::Fbm => FBM,
            FractalKind::Ridged { .. } => RIDGED,
            FractalKind::Hybrid { .. } => HYBRID,
            FractalKind::Hetero { .. } => HETERO,
        };
        push(words, FractalWords { kind, octaves: self.octaves.len() as u32 });
        for octave in &self.octaves {
            let method = OctaveMethod::of(octave, is_warped);
            let (metres, gradients) = octave.simplex.packed();
            let no_rows = [0.0; BLOCK_ROWS];
            let (gradients, columns, rows) = match &octave.evaluation {
                // The gradients are stored with the points of each block.
                Evaluation::Splat(splat) if !is_warped => ([[0.0; 16]; 2], splat.columns.map(f32::to_bits), splat.rows),
                Evaluation::RowWise(rows) if !is_warped => (rows.gradients, rows.columns, no_rows),
                _ => (gradients, octave.simplex.columns(), no_rows),
            };
            push(
                words,
                OctaveWords {
                    method: method as u32,
                    block_at: *block_words as u32,
                    offset: octave.step.offset,
                    amplitude: octave.step.amplitude,
                    metres,
                    gradients: cast(gradients),
                    columns,
                    rows,
                },
            );
            *block_words += method.block_words();
        }
    }

    /// Appends the words of the block whose first vertex is (x, y).
    pub(crate) fn pack_block(&self, is_warped: bool, (x, y): (i64, i64), words: &mut Vec<u32>) {
        for octave in &self.octaves {
            let mut position = octave.lattice.at(x, y);
            let method = OctaveMethod::of(octave, is_warped);
            let end = words.len() + method.block_words();
            match (method, &octave.evaluation) {
                (OctaveMethod::Splat, Evaluation::Splat(splat)) => pack_points(splat, position, words),
                (OctaveMethod::RowWise, _) => {
                    for _ in 0..BLOCK_ROWS {
                        pack_row(position, words);
                        position = octave.lattice.south_of(position);
                    }
                }
                _ => {
                    for _ in 0..BLOCK_ROWS {
                        let RowStart { cell, fraction } = RowStart::new(position);
                        push(words, StartWords { cell, fraction });
                        position = octave.lattice.south_of(position);
                    }
                }
            }
            debug_assert!(words.len() <= end, "more than a block has room for");
            words.resize(end, 0);
        }
    }
}

/// Appends the points whose bumps reach a block: the position of the block's first vertex among the rows of points; for
/// each row its distance to the south and the position of the vertex among its points; for each point its distance to
/// the east, and the gradient.
fn pack_points(splat: &Splat<BLOCK_COLUMNS, BLOCK_ROWS>, position: [u128; 2], words: &mut Vec<u32>) {
    let points = splat.points(position);
    let rows = points.rows();
    push(words, -points.v(*rows.start()) as f32);
    for row in rows {
        let columns = points.columns(row);
        let x = (points.shift(row) - f64::from(*columns.start())) as f32;
        push(words, PointRowWords { dy: points.dy(row), x });
        let end = words.len() + POINT_COLUMNS * POINT_WORDS;
        for column in columns {
            let gradient = splat.gradients[points.gradient(column, row)];
            push(words, PointWords { dx: points.dx(column, row), gradient });
        }
        debug_assert!(words.len() <= end, "more points in a row than there can be");
        // Unused places get points that are out of reach.
        while words.len() < end {
            push(words, PointWords { dx: FAR, gradient: [0.0; 2] });
        }
    }
}
