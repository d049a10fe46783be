//! Agents' lines as words for the kernel in `shaders/tile.wgsl`, which carves them into land.

use crate::area::Area;
use crate::lines::{Bed, Line, nearest};
use crate::noise::gpu_words::put;

/// Packs the agents' lines in an area: their number, and for each line its kind, its bank and its spacing in metres,
/// the area's corner relative to its origin, the vertices that it may touch, and its pieces. `None` if a line is not an
/// agent's, or has a bank without width: the kernel cannot handle such lines.
pub(crate) fn pack<'a>(lines: impl IntoIterator<Item = &'a Line>, area: Area) -> Option<Vec<u32>> {
    let mut words = vec![0];
    for line in lines {
        let Some(part) = area.common(&line.bounds) else { continue };
        let kind = match line.bed {
            Bed::Dug { .. } => 0,
            Bed::Trodden { graded, .. } => 1 + u32::from(graded),
            Bed::Natural | Bed::Built { .. } => return None,
        };
        let bank_m = nearest::bank_m(line);
        if bank_m <= 0.0 {
            return None;
        }
        let corner = [area.x0, area.y0];
        words[0] += 1;
        words.push(kind);
        put(&mut words, [bank_m, line.spacing_m as f32]);
        for axis in [0, 1] {
            words.push(i32::try_from(corner[axis] - line.origin[axis]).ok()? as u32);
        }
        words.extend(corners(part, corner));
        let at = words.len();
        words.push(0);
        words[at] = nearest::pack(line, part, corner, &mut words);
    }
    Some(words)
}

/// Returns the corners of an area, counted from a vertex near it.
pub(super) fn corners(area: Area, from: [i64; 2]) -> [u32; 4] {
    let Area { x0, y0, x1, y1 } = area;
    [x0 - from[0], y0 - from[1], x1 - from[0], y1 - from[1]].map(|at| at as i32 as u32)
}
