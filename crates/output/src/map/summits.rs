//! The peaks that a map of some scale has room for.

use std::sync::Arc;

use rayon::prelude::*;

use crate::area::{Area, Stride};
use crate::clock::Clock;
use crate::features::landforms::{PEAKS, PeakFeature};
use crate::fluvial::landforms::peaks::Peak;
use crate::map::climb::{self, Climb, highest};
use crate::map::scale::Scale;
use crate::memory::{Memory, heap_bytes};
use crate::stop;
use crate::world::World;

/// Millimetres on paper in which there is one peak at most.
const ROOM_MM: f64 = 22.0;

/// Nodes from afar that this is.
const CELL: i64 = 16;

/// Cells a side of what is looked at at once.
const BLOCK: i64 = 2;

/// Bytes of blocks that are remembered.
const REMEMBERED: usize = 1 << 20;

/// Metres that a peak rises above the lowest ground of a cell around it, as it is seen from afar.
const LEAST_RISE_M: f32 = 100.0;

/// A peak, by its vertex.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Summit {
    /// Metres east and north.
    pub at: [f64; 2],
    pub height_m: f32,
    pub name: Option<String>,
    /// Its vertex, which tells it from all others.
    pub id: [i64; 2],
}

heap_bytes!(Summit: name);

/// Where the peaks of a world are found.
#[derive(Debug)]
pub(super) struct Summits {
    world: Arc<World>,
    /// Where there is not room for all.
    afar: Option<FromAfar>,
}

/// The world from afar, in which high ground is looked for, and the way from there to the peak; what was found, block by block.
#[derive(Debug)]
struct FromAfar {
    world: World,
    climb: Climb,
    blocks: Memory<[i64; 2], Vec<Summit>>,
}

impl Summits {
    /// The peaks of a fluvial world for maps of a scale.
    pub fn new(world: Arc<World>, scale: Scale) -> Summits {
        let room_m = ROOM_MM * scale.denominator() / 1000.0;
        // A cell of the world has one peak at most: where that has the room it needs, all have.
        let has_room = room_m <= climb::side(&world) as f64 * world.spacing_m();
        let afar = (!has_room).then(|| {
            let stride = Stride::within(room_m / CELL as f64, world.spacing_m());
            let climb = Climb::new(Arc::clone(&world), stride);
            let blocks = Memory::within(REMEMBERED, world.budget());
            FromAfar { world: world.at_stride(stride), climb, blocks }
        });
        Summits { world, afar }
    }

    /// All peaks in an area of pixels.
    pub fn find(&self, scale: Scale, pixels: Area) -> Vec<Summit> {
        let all = || self.all(scale.nodes_of(pixels, self.world.spacing_m()));
        self.afar.as_ref().map_or_else(all, |afar| afar.find(&self.world, scale, pixels))
    }

    /// All that the vectors of a bake have.
    fn all(&self, area: Area) -> Vec<Summit> {
        let rows: Vec<Area> =
            (area.y0..area.y1).step_by(512).map(|y0| Area { y0, y1: area.y1.min(y0 + 512), ..area }).collect();
        let found: Vec<Vec<Peak>> = rows.par_iter().map(|row| self.world.peaks(row)).collect();
        found.into_iter().flatten().map(|peak| Summit::new(&self.world, peak)).collect()
    }
}

impl Summit {
    fn new(world: &World, peak: Peak) -> Summit {
        let id = peak.at;
        let PeakFeature { at, height_m, name, .. } = PEAKS.features(world, vec![peak]).remove(0);
        Summit { at, height_m, name, id }
    }
}

impl FromAfar {
    /// The peaks of a whole world in an area of pixels.
    fn find(&self, whole: &World, scale: Scale, pixels: Area) -> Vec<Summit> {
        let stride = self.world.stride().vertices();
        // What is high from afar has its peak not far from there.
        let reach = self.climb.reach() / stride + 1;
        let area = scale.nodes_of(pixels, self.world.spacing_m()).padded(reach as usize);
        let side = BLOCK * CELL;
        let span = |from: i64, to: i64| from.div_euclid(side)..=(to - 1).div_euclid(side);
        let blocks: Vec<[i64; 2]> =
            span(area.y0, area.y1).flat_map(|y| span(area.x0, area.x1).map(move |x| [x, y])).collect();
        let block = |block: &[i64; 2]| self.blocks.get(*block, || self.block(whole, *block));
        let found: Vec<Arc<Vec<Summit>>> = blocks.par_iter().map(block).collect();
        let vertices = scale.nodes_of(pixels, whole.spacing_m());
        let within = |summit: &&Summit| vertices.contains(&Area::new(summit.id[0], summit.id[1], 1, 1));
        let mut found: Vec<Summit> = found.iter().flat_map(|block| block.iter()).filter(within).cloned().collect();
        // Of two that one climbs to the same peak, one is enough.
        found.sort_by(|a, b| b.height_m.total_cmp(&a.height_m).then(a.id.cmp(&b.id)));
        found.dedup_by_key(|summit| summit.id);
        found
    }

    /// The peaks above a block of cells.
    fn block(&self, whole: &World, [x, y]: [i64; 2]) -> Vec<Summit> {
        let side = (BLOCK * CELL) as usize;
        let area = Area::new(x * BLOCK * CELL, y * BLOCK * CELL, side, side);
        let land = self.world.relief().land(area.padded(CELL as usize), &Clock::default());
        let sea_level_m = self.world.preset().sea_level_m.map_or(f32::MIN, |level| level as f32);
        let mut found = Vec::new();
        for cell_y in (area.y0..area.y1).step_by(CELL as usize) {
            for cell_x in (area.x0..area.x1).step_by(CELL as usize) {
                stop::check();
                let cell = Area::new(cell_x, cell_y, CELL as usize, CELL as usize);
                let (top, height_m) = highest(&land.heights, cell);
                let around = Area::new(top[0], top[1], 1, 1).padded((CELL * 3 / 4) as usize);
                let around = around.common(&land.heights.area()).expect("it is in the area");
                let lowest_m = around.vertices().map(|(x, y)| land.heights.at(x, y)).fold(f32::MAX, f32::min);
                if highest(&land.heights, around).0 == top
                    && height_m - lowest_m >= LEAST_RISE_M
                    && height_m > sea_level_m
                {
                    let peak = self.climb.peak(top.map(|at| at * self.world.stride().vertices()));
                    found.extend(peak.map(|peak| Summit::new(whole, peak)));
                }
            }
        }
        found
    }
}
