//! The peaks that a map of some scale has room for.

use std::collections::BTreeSet;
use std::sync::Arc;

use rayon::prelude::*;

use crate::area::{Area, Stride};
use crate::clock::Clock;
use crate::features::landforms::PEAKS;
use crate::fluvial::landforms::peaks;
use crate::grid::Grid;
use crate::map::scale::Scale;
use crate::memory::{Memory, heap_bytes};
use crate::stop;
use crate::world::World;

/// Millimetres on paper in which there is one peak at most.
const ROOM_MM: f64 = 22.0;

/// Metres of ground that this is from where on peaks are looked for from afar: with less, all land takes less time than climbing
/// each of so many.
const ROOM_M: f64 = 1500.0;

/// Nodes from afar that this is.
const CELL: i64 = 16;

/// Cells a side of what is looked at at once.
const BLOCK: i64 = 2;

/// Bytes of blocks that are remembered.
const REMEMBERED: usize = 1 << 20;

/// Metres that a peak rises above the lowest ground of a cell around it.
const LEAST_RISE_M: f32 = 100.0;

/// How often a peak is looked for higher up than where it is from afar: land where nothing is known yet takes long.
const MOVES: usize = 6;

/// Nodes from afar to each side in which it is looked for at once, and vertices at most.
const NEAR_NODES: i64 = 4;
const NEAR: i64 = 64;

/// A peak, by its vertex.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Summit {
    /// Metres east and north.
    pub at: [f64; 2],
    pub height_m: f32,
    pub name: Option<String>,
    /// Tells it from all others.
    pub id: [i64; 2],
}

heap_bytes!(Summit: name);

/// Where the peaks of a world are found.
#[derive(Debug)]
pub(super) struct Summits {
    world: Arc<World>,
    /// The world from afar, in which peaks are looked for where there is not room for all, block by block.
    afar: Option<World>,
    blocks: Memory<[i64; 2], Vec<Summit>>,
}

impl Summits {
    /// The peaks of a world for maps of a scale.
    pub fn new(world: Arc<World>, scale: Scale) -> Summits {
        let room_m = ROOM_MM * scale.denominator() / 1000.0;
        let stride = Stride::within(room_m / CELL as f64, world.spacing_m());
        let afar = (room_m > ROOM_M).then(|| world.at_stride(stride));
        Summits { world, afar, blocks: Memory::new(REMEMBERED) }
    }

    /// All peaks in an area of pixels.
    pub fn find(&self, scale: Scale, pixels: Area) -> Vec<Summit> {
        let vertices = scale.nodes_of(pixels, self.world.spacing_m());
        let Some((afar, fluvial)) = self.afar.as_ref().zip(self.world.relief().fluvial()) else {
            return self.all(vertices);
        };
        // Whole cells of names: the highest peak of each has its name.
        let cell = peaks::side(fluvial);
        let area = scale.nodes_of(pixels, afar.spacing_m()).padded((cell / afar.stride().vertices()) as usize + 1);
        let side = BLOCK * CELL;
        let span = |from: i64, to: i64| from.div_euclid(side)..=(to - 1).div_euclid(side);
        let blocks: Vec<[i64; 2]> =
            span(area.y0, area.y1).flat_map(|y| span(area.x0, area.x1).map(move |x| [x, y])).collect();
        let block = |block: &[i64; 2]| self.blocks.get(*block, || self.block(afar, *block));
        let found: Vec<Arc<Vec<Summit>>> = blocks.par_iter().map(block).collect();
        let mut found: Vec<Summit> = found.iter().flat_map(|block| block.iter().cloned()).collect();
        found.sort_by(|a, b| b.height_m.total_cmp(&a.height_m).then(a.id.cmp(&b.id)));
        // Of two that one climbs to the same vertex, one is enough.
        found.dedup_by_key(|summit| summit.id);
        let mut named = BTreeSet::new();
        for summit in &mut found {
            if !named.insert(summit.id.map(|at| at.div_euclid(cell))) {
                summit.name = None;
            }
        }
        found.retain(|summit| vertices.contains(&Area::new(summit.id[0], summit.id[1], 1, 1)));
        found
    }

    /// All that the vectors of a bake have.
    fn all(&self, area: Area) -> Vec<Summit> {
        let rows: Vec<Area> =
            (area.y0..area.y1).step_by(512).map(|y0| Area { y0, y1: area.y1.min(y0 + 512), ..area }).collect();
        let found: Vec<Vec<Summit>> = rows
            .par_iter()
            .map(|row| {
                let peaks = PEAKS.find(&self.world, row).into_iter();
                let number = |at: f64| (at / self.world.spacing_m()).round() as i64;
                peaks
                    .map(|peak| Summit {
                        id: peak.at.map(number),
                        at: peak.at,
                        height_m: peak.height_m,
                        name: peak.name,
                    })
                    .collect()
            })
            .collect();
        found.into_iter().flatten().collect()
    }

    /// The peaks of a block of cells from afar, each where it is at the vertices.
    fn block(&self, afar: &World, [x, y]: [i64; 2]) -> Vec<Summit> {
        let side = (BLOCK * CELL) as usize;
        let area = Area::new(x * BLOCK * CELL, y * BLOCK * CELL, side, side);
        let land = afar.relief().land(area.padded(CELL as usize), &Clock::default());
        let mut found = Vec::new();
        for cell_y in (area.y0..area.y1).step_by(CELL as usize) {
            for cell_x in (area.x0..area.x1).step_by(CELL as usize) {
                let cell = Area::new(cell_x, cell_y, CELL as usize, CELL as usize);
                let (top, height_m) = highest(&land.heights, cell);
                let around = Area::new(top[0], top[1], 1, 1).padded((CELL * 3 / 4) as usize);
                let around = around.common(&land.heights.area()).expect("it is in the area");
                let lowest_m = around.vertices().map(|(x, y)| land.heights.at(x, y)).fold(f32::MAX, f32::min);
                let sea_level_m = afar.preset().sea_level_m.map_or(f32::MIN, |level| level as f32);
                if highest(&land.heights, around).0 == top
                    && height_m - lowest_m >= LEAST_RISE_M
                    && height_m > sea_level_m
                {
                    let stride = afar.stride().vertices();
                    found.push(self.summit(top.map(|at| at * stride), (NEAR_NODES * stride).min(NEAR)));
                }
            }
        }
        found
    }

    /// The peak that one climbs from a vertex.
    fn summit(&self, mut at: [i64; 2], near: i64) -> Summit {
        let mut height_m = 0.0;
        for _ in 0..MOVES {
            stop::check();
            let area = Area::new(at[0], at[1], 1, 1).padded(near as usize);
            let (top, top_m) = highest(&self.world.relief().heights(area), area);
            height_m = top_m;
            if std::mem::replace(&mut at, top) == top {
                break;
            }
        }
        let name = self
            .world
            .names()
            .zip(self.world.relief().fluvial())
            .map(|(names, fluvial)| names.peak(at, &at.map(|at| at.div_euclid(peaks::side(fluvial)))));
        let spacing_m = self.world.spacing_m();
        Summit { at: [at[0] as f64 * spacing_m, -at[1] as f64 * spacing_m], height_m, name, id: at }
    }
}

/// The highest of the vertices of an area; of equals the first, row by row.
fn highest(heights: &Grid<f32>, area: Area) -> ([i64; 2], f32) {
    let mut highest = ([area.x0, area.y0], f32::MIN);
    for (x, y) in area.vertices() {
        if heights.at(x, y) > highest.1 {
            highest = ([x, y], heights.at(x, y));
        }
    }
    highest
}
