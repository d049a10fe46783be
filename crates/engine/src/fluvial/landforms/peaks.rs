//! Peaks: at most one in each cell of the world, the highest vertex around.

use std::sync::Arc;

use crate::area::Area;
use crate::clock::Clock;
use crate::fluvial::Fluvial;
use crate::memory::heap_bytes;
use crate::stop::Stopped;

/// Metres a side of a cell.
const CELL_M: f64 = 3000.0;

/// Vertices a side of a block, whose lowest and highest heights are kept. Cells consist of whole blocks.
const BLOCK: i64 = 16;

/// Least height of a peak in metres above the lowest ground within half a cell.
const LEAST_RISE_M: f32 = 60.0;

/// Most cells through which the search climbs to a peak: it should be near, and each cell takes long.
pub(super) const MOST_CELLS: usize = 4;

/// A peak.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Peak {
    /// Column and row of the peak's cell, about 3 km a side: the peak's id in the world.
    pub id: (i64, i64),
    /// The peak's vertex.
    pub at: [i64; 2],
    /// Height of the peak in metres.
    pub height_m: f32,
}

/// The highest vertex of a cell, and whether it is a peak.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Rise {
    /// The cell's peak.
    Peak(Peak),
    /// Not a peak: there is higher ground within half a cell, in this other cell.
    Below((i64, i64)),
    /// The highest vertex around but no peak: under the sea, or hardly above its surroundings.
    Low,
}

/// A cell's highest vertex, and the heights of its blocks.
#[derive(Debug)]
pub(super) struct Summits {
    highest: (f32, [i64; 2]),
    /// The lowest and highest height of each block, row by row.
    blocks: Vec<[f32; 2]>,
}

heap_bytes!(Summits: blocks);

/// Vertices a side of a cell. A peak's id is its cell.
pub fn side(fluvial: &Fluvial) -> i64 {
    let vertices = CELL_M / fluvial.node_m();
    // A smaller cell would have too few vertices to choose from; a larger one would take too long.
    ((vertices / BLOCK as f64).round() as i64).clamp(4, 64) * BLOCK
}

impl Summits {
    /// Makes the land of a whole cell at once: in parts it would cost much more.
    pub(super) fn new(fluvial: &Fluvial, cell: (i64, i64), clock: &Clock) -> Result<Summits, Stopped> {
        let side = side(fluvial);
        let area = Area::new(cell.0 * side, cell.1 * side, side as usize, side as usize);
        let columns = (side / BLOCK) as usize;
        let mut blocks = vec![[f32::INFINITY, f32::NEG_INFINITY]; columns * columns];
        // Of equally high vertices the first one, from north to south and from west to east.
        let mut highest = (f32::NEG_INFINITY, [area.x0, area.y0]);
        let heights = fluvial.land(area, clock)?.heights;
        for ((x, y), &height_m) in area.vertices().zip(heights.values()) {
            let block = &mut blocks[((y - area.y0) / BLOCK) as usize * columns + ((x - area.x0) / BLOCK) as usize];
            *block = [block[0].min(height_m), block[1].max(height_m)];
            if height_m > highest.0 {
                highest = (height_m, [x, y]);
            }
        }
        Ok(Summits { highest, blocks })
    }
}

impl Rise {
    /// Returns the rise of a cell. `summits` returns cells, from the cache if they are there.
    pub(super) fn of_cell<E>(
        fluvial: &Fluvial,
        cell: (i64, i64),
        summits: impl Fn((i64, i64)) -> Result<Arc<Summits>, E>,
    ) -> Result<Rise, E> {
        let columns = side(fluvial) / BLOCK;
        let (height_m, at) = summits(cell)?.highest;
        let [i, j] = at.map(|at| at.div_euclid(BLOCK));
        let half = columns / 2;
        let mut lowest_m = height_m;
        for y in (j - half).div_euclid(columns)..=(j + half).div_euclid(columns) {
            for x in (i - half).div_euclid(columns)..=(i + half).div_euclid(columns) {
                let there = summits((x, y))?;
                // Nothing around may be higher; of equal heights the first counts.
                let other = (there.highest.0, there.highest.1);
                let near = (0..2).all(|axis| (other.1[axis].div_euclid(BLOCK) - [i, j][axis]).abs() <= half);
                if near && (other.0 > height_m || (other.0 == height_m && other.1 < at)) {
                    return Ok(Rise::Below((x, y)));
                }
                for row in (j - half).max(y * columns)..=(j + half).min((y + 1) * columns - 1) {
                    for column in (i - half).max(x * columns)..=(i + half).min((x + 1) * columns - 1) {
                        let [low_m, high_m] =
                            there.blocks[((row - y * columns) * columns + column - x * columns) as usize];
                        if high_m > height_m {
                            return Ok(Rise::Below((x, y)));
                        }
                        lowest_m = lowest_m.min(low_m);
                    }
                }
            }
        }
        let is_land = fluvial.fields().sea_level_m() < height_m as f64;
        let is_peak = is_land && height_m - lowest_m >= LEAST_RISE_M;
        Ok(if is_peak { Rise::Peak(Peak { id: cell, at, height_m }) } else { Rise::Low })
    }

    /// Returns the peak, if there is one.
    pub(super) fn peak(self) -> Option<Peak> {
        if let Rise::Peak(peak) = self { Some(peak) } else { None }
    }
}
