//! Agents' lines as words for the kernel in `shaders/tile.wgsl`, which carves them into land.

use bytemuck::cast_slice;

use crate::area::Area;
use crate::lines::{Bed, Line, nearest};
use crate::wgsl::push;

kernel_words! {
    /// A line: its kind, its bank and its spacing in metres, the area's corner relative to its origin, the vertices
    /// that it may touch, and the number of its pieces, which follow it.
    struct LineWords in own, LINE_WORDS {
        kind: u32, bank_m: f32, spacing_m: f32, corner: [i32; 2], near: [i32; 4], pieces: u32,
    }

    /// A piece of a line: the vertices that it is near to; its ends; half widths and floors there.
    struct PieceWords in own, PIECE_WORDS {
        near: [i32; 4], begin: [f32; 2], end: [f32; 2], half_width_m: [f32; 2], floor_m: [f32; 2],
    }

    const TRODDEN: u32, GRADED: u32;
}

/// Numbers of the kinds of lines.
const DUG: u32 = 0;
const TRODDEN: u32 = 1;
const GRADED: u32 = 2;

/// Packs the agents' lines in an area: their number, and the lines with their pieces. `None` if a line is not an
/// agent's, or has a bank without width: the kernel cannot handle such lines.
pub(crate) fn pack<'a>(lines: impl IntoIterator<Item = &'a Line>, area: Area) -> Option<Vec<u32>> {
    let mut words = vec![0];
    for line in lines {
        let Some(part) = area.common(&line.bounds) else { continue };
        let kind = match line.bed {
            Bed::Dug { .. } => DUG,
            Bed::Trodden { graded: false, .. } => TRODDEN,
            Bed::Trodden { graded: true, .. } => GRADED,
            Bed::Natural | Bed::Built { .. } => return None,
        };
        let bank_m = nearest::bank_m(line);
        if bank_m <= 0.0 {
            return None;
        }
        let from = [area.x0, area.y0];
        let [east, south] = [0, 1].map(|axis| i32::try_from(from[axis] - line.origin[axis]));
        let pieces = nearest::pack(line, part, from);
        words[0] += 1;
        let corner = [east.ok()?, south.ok()?];
        let (near, spacing_m, count) = (corners(part, from), line.spacing_m as f32, pieces.len() as u32);
        push(&mut words, LineWords { kind, bank_m, spacing_m, corner, near, pieces: count });
        words.extend_from_slice(cast_slice(&pieces));
    }
    Some(words)
}

/// Returns the corners of an area, counted from a vertex near it.
pub(super) fn corners(area: Area, from: [i64; 2]) -> [i32; 4] {
    let Area { x0, y0, x1, y1 } = area;
    [x0 - from[0], y0 - from[1], x1 - from[0], y1 - from[1]].map(|at| at as i32)
}
