//! Peaks: at most one a cell of the world, the highest vertex around.

use std::sync::Arc;

use crate::area::Area;
use crate::clock::Clock;
use crate::fluvial::Fluvial;
use crate::memory::heap_bytes;

/// Metres a side of a cell.
const CELL_M: f64 = 3000.0;

/// Vertices a side of a block, of which the lowest and the highest looked at are known. Cells are whole blocks.
const BLOCK: i64 = 16;

/// Of so many strips of vertices one is looked at, and a strip's height: as high as the relief makes them at once.
const STRIPS: i64 = 4;
const STRIP: i64 = 4;

/// Metres that a peak rises above the lowest ground of half a cell around it.
const LEAST_RISE_M: f32 = 60.0;

/// A peak.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Peak {
    /// Column and row of its cell, about 3 km a side: its name in the world.
    pub id: (i64, i64),
    /// The vertex.
    pub at: [i64; 2],
    /// Its height in metres.
    pub height_m: f32,
}

/// What is known of a cell: its highest vertex, and the heights of its blocks.
#[derive(Debug)]
pub(super) struct Summits {
    highest: (f32, [i64; 2]),
    /// The lowest and the highest of each block, row by row.
    blocks: Vec<[f32; 2]>,
}

heap_bytes!(Summits: blocks);

/// Vertices a side of a cell.
pub(super) fn side(fluvial: &Fluvial) -> i64 {
    let vertices = CELL_M / fluvial.node_m();
    // A cell of fewer vertices has too few to choose from, one of more takes too long.
    ((vertices / BLOCK as f64).round() as i64).clamp(4, 64) * BLOCK
}

impl Summits {
    /// Looks at strips of a cell, and then from the highest vertex found up to where none around is higher.
    pub(super) fn new(fluvial: &Fluvial, cell: (i64, i64)) -> Summits {
        let side = side(fluvial);
        let (x0, y0) = (cell.0 * side, cell.1 * side);
        let columns = (side / BLOCK) as usize;
        let mut blocks = vec![[f32::INFINITY, f32::NEG_INFINITY]; columns * columns];
        let mut highest = (f32::NEG_INFINITY, [x0, y0]);
        let mut look = |area: Area| {
            let heights = fluvial.land(area, &Clock::default()).heights;
            for y in area.y0..area.y1 {
                for (x, height_m) in (area.x0..).zip(heights.row(y, area.x0, area.x1)) {
                    let block = &mut blocks[((y - y0) / BLOCK) as usize * columns + ((x - x0) / BLOCK) as usize];
                    *block = [block[0].min(*height_m), block[1].max(*height_m)];
                    // Of equal vertices the first, from north to south and from west to east.
                    if *height_m > highest.0 || (*height_m == highest.0 && [y, x] < [highest.1[1], highest.1[0]]) {
                        highest = (*height_m, [x, y]);
                    }
                }
            }
            highest.1
        };
        let mut top = [x0, y0];
        for y in (y0..y0 + side).step_by((STRIPS * STRIP) as usize) {
            top = look(Area { x0, y0: y, x1: x0 + side, y1: y + STRIP });
        }
        // Up from there.
        let cell = Area { x0, y0, x1: x0 + side, y1: y0 + side };
        loop {
            let around = around(top).common(&cell).expect("a vertex of the cell is in it");
            let next = look(around);
            if next == top {
                break;
            }
            top = next;
        }
        Summits { highest, blocks }
    }
}

/// What is looked at around a vertex.
fn around([x, y]: [i64; 2]) -> Area {
    Area::new(x, y, 1, 1).padded((STRIPS * STRIP) as usize)
}

impl Peak {
    /// The peak of a cell, if it has one, given what is known of cells.
    pub(super) fn of_cell(
        fluvial: &Fluvial,
        cell: (i64, i64),
        summits: impl Fn((i64, i64)) -> Arc<Summits>,
    ) -> Option<Peak> {
        let columns = side(fluvial) / BLOCK;
        let (height_m, at) = summits(cell).highest;
        let [i, j] = at.map(|at| at.div_euclid(BLOCK));
        let half = columns / 2;
        let mut lowest_m = height_m;
        for y in (j - half).div_euclid(columns)..=(j + half).div_euclid(columns) {
            for x in (i - half).div_euclid(columns)..=(i + half).div_euclid(columns) {
                let there = summits((x, y));
                // Nothing higher, and of equal heights the first.
                let other = (there.highest.0, there.highest.1);
                let near = (0..2).all(|axis| (other.1[axis].div_euclid(BLOCK) - [i, j][axis]).abs() <= half);
                if near && (other.0 > height_m || (other.0 == height_m && other.1 < at)) {
                    return None;
                }
                for row in (j - half).max(y * columns)..=(j + half).min((y + 1) * columns - 1) {
                    for column in (i - half).max(x * columns)..=(i + half).min((x + 1) * columns - 1) {
                        let [low_m, high_m] =
                            there.blocks[((row - y * columns) * columns + column - x * columns) as usize];
                        if high_m > height_m {
                            return None;
                        }
                        lowest_m = lowest_m.min(low_m);
                    }
                }
            }
        }
        let is_land = fluvial.fields().sea_level_m() < height_m as f64;
        if !is_land || height_m - lowest_m < LEAST_RISE_M {
            return None;
        }
        // The cells around are known by their strips alone.
        let heights = fluvial.land(around(at), &Clock::default()).heights;
        heights.values().iter().all(|other_m| *other_m <= height_m).then_some(Peak { id: cell, at, height_m })
    }
}
