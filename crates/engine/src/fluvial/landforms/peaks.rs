//! Peaks: at most one a cell of the world, the highest vertex around.

use std::sync::Arc;

use crate::area::Area;
use crate::clock::Clock;
use crate::fluvial::Fluvial;
use crate::memory::heap_bytes;

/// Metres a side of a cell.
const CELL_M: f64 = 3000.0;

/// Vertices a side of a block, of which the lowest and the highest are known. Cells are whole blocks.
const BLOCK: i64 = 16;

/// Metres that a peak rises above the lowest ground of half a cell around it.
const LEAST_RISE_M: f32 = 60.0;

/// Cells that one goes up through to a peak at most: it is looked for near, and each cell takes long.
pub(super) const MOST_CELLS: usize = 4;

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

/// The highest vertex of a cell, and whether it is a peak.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Rise {
    /// The cell's peak.
    Peak(Peak),
    /// Not the highest around: there is higher ground within half a cell, in another cell.
    Below((i64, i64)),
    /// The highest around, and no peak: under the sea, or hardly above what lies around.
    Low,
}

/// What is known of a cell: its highest vertex, and the heights of its blocks.
#[derive(Debug)]
pub(super) struct Summits {
    highest: (f32, [i64; 2]),
    /// The lowest and the highest of each block, row by row.
    blocks: Vec<[f32; 2]>,
}

heap_bytes!(Summits: blocks);

/// Vertices a side of a cell, which a peak has its name by.
pub fn side(fluvial: &Fluvial) -> i64 {
    let vertices = CELL_M / fluvial.node_m();
    // A cell of fewer vertices has too few to choose from, one of more takes too long.
    ((vertices / BLOCK as f64).round() as i64).clamp(4, 64) * BLOCK
}

impl Summits {
    /// Looks at all of a cell: at once, for land costs much more in parts.
    pub(super) fn new(fluvial: &Fluvial, cell: (i64, i64)) -> Summits {
        let side = side(fluvial);
        let area = Area::new(cell.0 * side, cell.1 * side, side as usize, side as usize);
        let columns = (side / BLOCK) as usize;
        let mut blocks = vec![[f32::INFINITY, f32::NEG_INFINITY]; columns * columns];
        // Of equal vertices the first, from north to south and from west to east.
        let mut highest = (f32::NEG_INFINITY, [area.x0, area.y0]);
        let heights = fluvial.land(area, &Clock::default()).heights;
        for ((x, y), &height_m) in area.vertices().zip(heights.values()) {
            let block = &mut blocks[((y - area.y0) / BLOCK) as usize * columns + ((x - area.x0) / BLOCK) as usize];
            *block = [block[0].min(height_m), block[1].max(height_m)];
            if height_m > highest.0 {
                highest = (height_m, [x, y]);
            }
        }
        Summits { highest, blocks }
    }
}

impl Rise {
    /// The highest vertex of a cell, from the memory of cells if it is there.
    pub(super) fn of_cell(fluvial: &Fluvial, cell: (i64, i64), summits: impl Fn((i64, i64)) -> Arc<Summits>) -> Rise {
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
                    return Rise::Below((x, y));
                }
                for row in (j - half).max(y * columns)..=(j + half).min((y + 1) * columns - 1) {
                    for column in (i - half).max(x * columns)..=(i + half).min((x + 1) * columns - 1) {
                        let [low_m, high_m] =
                            there.blocks[((row - y * columns) * columns + column - x * columns) as usize];
                        if high_m > height_m {
                            return Rise::Below((x, y));
                        }
                        lowest_m = lowest_m.min(low_m);
                    }
                }
            }
        }
        let is_land = fluvial.fields().sea_level_m() < height_m as f64;
        let is_peak = is_land && height_m - lowest_m >= LEAST_RISE_M;
        if is_peak { Rise::Peak(Peak { id: cell, at, height_m }) } else { Rise::Low }
    }

    /// The peak, if it is one.
    pub(super) fn peak(self) -> Option<Peak> {
        if let Rise::Peak(peak) = self { Some(peak) } else { None }
    }
}
