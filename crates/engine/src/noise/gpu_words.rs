//! Fractals packed into words, for kernels that run on a GPU and compute the same bits.
//!
//! The GPU's kernel (`shaders/relief.wgsl`, which uses the names of the functions here) runs once per vertex, in the
//! same blocks of 64 x 32 vertices. The position of a block in the lattice of each octave takes more bits than the GPU
//! has, so it is computed here for each block; everything else is the same for all blocks.

use super::fractal::{BLOCK_COLUMNS, BLOCK_ROWS, Evaluation, Fractal, Octave};
use super::rows::pack_row;
use super::simplex::RowStart;
use super::spec::FractalKind;
use super::splat::{FAR, Splat};

/// Columns and rows of the blocks in which fractals are computed; blocks are aligned with the world.
pub(crate) const BLOCK: [usize; 2] = [BLOCK_COLUMNS, BLOCK_ROWS];

/// Number of words of an octave that are the same for all blocks.
const OCTAVE_WORDS: usize = 8 + 32 + BLOCK_COLUMNS + BLOCK_ROWS;

/// Bounds on the lattice points whose bumps reach a block (see `splat.rs`): the number of rows, and of points in a row.
/// And the words of a point and of a row.
const POINT_ROWS: usize = 5;
const POINT_COLUMNS: usize = 6;
const POINT_WORDS: usize = 3;
const POINT_ROW_WORDS: usize = 2 + POINT_WORDS * POINT_COLUMNS;

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
            OctaveMethod::RowWise => BLOCK_ROWS * 9,
            OctaveMethod::Simplex | OctaveMethod::Warped => BLOCK_ROWS * 4,
        }
    }
}

/// Appends floats, as their bits.
pub fn put(words: &mut Vec<u32>, floats: impl IntoIterator<Item = f32>) {
    words.extend(floats.into_iter().map(f32::to_bits));
}

impl Fractal {
    /// Appends the words that are the same for all blocks: the kind, the number of octaves, and the octaves.
    /// `block_words` is the number of words that a block has for fractals packed earlier; this fractal's are added to
    /// it.
    pub(crate) fn pack(&self, is_warped: bool, words: &mut Vec<u32>, block_words: &mut usize) {
        let kind = match self.kind {
            FractalKind::Fbm => 0,
            FractalKind::Ridged { .. } => 1,
            FractalKind::Hybrid { .. } => 2,
            FractalKind::Hetero { .. } => 3,
        };
        words.extend([kind, self.octaves.len() as u32]);
        for octave in &self.octaves {
            let method = OctaveMethod::of(octave, is_warped);
            let end = words.len() + OCTAVE_WORDS;
            words.extend([method as u32, *block_words as u32]);
            put(words, [octave.step.offset, octave.step.amplitude]);
            let (metres, gradients) = octave.simplex.packed();
            put(words, metres);
            words.push(0);
            match &octave.evaluation {
                Evaluation::Splat(splat) if !is_warped => {
                    // The gradients are stored with the points of each block.
                    words.extend([0; 32]);
                    put(words, splat.columns);
                    put(words, splat.rows);
                }
                Evaluation::RowWise(rows) if !is_warped => {
                    put(words, rows.gradients.as_flattened().iter().copied());
                    words.extend(rows.columns);
                }
                _ => {
                    put(words, gradients.as_flattened().iter().copied());
                    words.extend(octave.simplex.columns());
                }
            }
            words.resize(end, 0);
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
                        words.extend(RowStart::new(position).packed());
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
    put(words, [-points.v(*rows.start()) as f32]);
    for row in rows {
        let columns = points.columns(row);
        put(words, [points.dy(row), (points.shift(row) - f64::from(*columns.start())) as f32]);
        let end = words.len() + POINT_COLUMNS * POINT_WORDS;
        for column in columns {
            let [gradient_x, gradient_y] = splat.gradients[points.gradient(column, row)];
            put(words, [points.dx(column, row), gradient_x, gradient_y]);
        }
        debug_assert!(words.len() <= end, "more points in a row than there can be");
        // Unused places get points that are out of reach.
        while words.len() < end {
            put(words, [FAR, 0.0, 0.0]);
        }
    }
}
