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
use crate::stop::Stopped;
use crate::world::World;

/// Side in millimetres on paper of a square that has at most one peak.
const ROOM_MM: f64 = 22.0;

/// Side of that square in coarse nodes, at which the land is seen from afar.
const CELL: i64 = 16;

/// Side in cells of the blocks that are searched as a whole.
const BLOCK: i64 = 2;

/// Largest number of bytes of blocks that are remembered.
const REMEMBERED: usize = 1 << 20;

/// Smallest height by which a peak rises above the lowest coarse ground around it, within three quarters of a cell: in
/// metres, and as a share of the side of the square that has it alone. So maps of continents name the peaks of high
/// ranges only. Chosen by eye.
const LEAST_RISE_M: f64 = 100.0;
const LEAST_RISE: f64 = 0.004;

/// A peak with its height and its name.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Summit {
    /// Position in metres east and north.
    pub at: [f64; 2],
    pub height_m: f32,
    pub name: Option<String>,
    /// Vertex of the peak, which identifies it.
    pub id: [i64; 2],
}

heap_bytes!(Summit: name);

/// Source of the peaks of a world.
#[derive(Debug)]
pub(super) struct PeakSource {
    world: Arc<World>,
    /// The coarse world, which is searched where there is not room for all peaks.
    afar: Option<FromAfar>,
}

/// The world at coarse nodes, in which high ground is looked for; the climb from there to the peak; and the peaks
/// found, block by block.
#[derive(Debug)]
struct FromAfar {
    world: World,
    least_rise_m: f32,
    climb: Climb,
    blocks: Memory<[i64; 2], Vec<Summit>>,
}

impl PeakSource {
    /// Creates the source of the peaks of a fluvial world for maps of a scale.
    pub fn new(world: Arc<World>, scale: Scale) -> PeakSource {
        let room_m = ROOM_MM * scale.denominator() / 1000.0;
        // A cell of the world has at most one peak. If a cell is as large as the room that a peak needs, there is room
        // for all peaks.
        let has_room = room_m <= climb::side(&world) as f64 * world.spacing_m();
        let afar = (!has_room).then(|| {
            let stride = Stride::within(room_m / CELL as f64, world.spacing_m());
            let climb = Climb::new(Arc::clone(&world), stride);
            let blocks = Memory::within(REMEMBERED, world.budget());
            let least_rise_m = LEAST_RISE_M.max(LEAST_RISE * room_m) as f32;
            FromAfar { world: world.at_stride(stride), least_rise_m, climb, blocks }
        });
        PeakSource { world, afar }
    }

    /// Returns all peaks in an area of pixels that there is room for.
    pub fn find(&self, scale: Scale, pixels: Area, clock: &Clock) -> Result<Vec<Summit>, Stopped> {
        let all = || self.all(scale.nodes_of(pixels, self.world.spacing_m()), clock);
        self.afar.as_ref().map_or_else(all, |afar| afar.find(&self.world, scale, pixels, clock))
    }

    /// Returns all peaks in an area of vertices, which are those in the vectors of a bake.
    fn all(&self, area: Area, clock: &Clock) -> Result<Vec<Summit>, Stopped> {
        let rows: Vec<Area> =
            (area.y0..area.y1).step_by(512).map(|y0| Area { y0, y1: area.y1.min(y0 + 512), ..area }).collect();
        let found = rows.par_iter().map(|row| self.world.peaks(row, clock));
        let found = found.collect::<Result<Vec<Vec<Peak>>, Stopped>>()?;
        found.into_iter().flatten().map(|peak| Summit::new(&self.world, peak, clock)).collect()
    }
}

impl Summit {
    fn new(world: &World, peak: Peak, clock: &Clock) -> Result<Summit, Stopped> {
        let id = peak.at;
        let PeakFeature { at, height_m, name, .. } = PEAKS.features(world, vec![peak], clock)?.remove(0);
        Ok(Summit { at, height_m, name, id })
    }
}

impl FromAfar {
    /// Returns the peaks of a whole world in an area of pixels.
    fn find(&self, whole: &World, scale: Scale, pixels: Area, clock: &Clock) -> Result<Vec<Summit>, Stopped> {
        let stride = self.world.stride().vertices();
        // The peak lies no further from the coarse high ground than the climb reaches.
        let reach = self.climb.reach() / stride + 1;
        let area = scale.nodes_of(pixels, self.world.spacing_m()).padded(reach as usize);
        let blocks: Vec<[i64; 2]> = area.square_numbers(BLOCK * CELL).collect();
        let block = |block: &[i64; 2]| self.blocks.try_get(*block, || self.block(whole, *block, clock));
        let found = blocks.par_iter().map(block).collect::<Result<Vec<Arc<Vec<Summit>>>, Stopped>>()?;
        let vertices = scale.nodes_of(pixels, whole.spacing_m());
        let within = |summit: &&Summit| vertices.contains(&Area::new(summit.id[0], summit.id[1], 1, 1));
        let mut found: Vec<Summit> = found.iter().flat_map(|block| block.iter()).filter(within).cloned().collect();
        // High ground at two places may lead to the same peak, which counts once.
        found.sort_by(|a, b| b.height_m.total_cmp(&a.height_m).then(a.id.cmp(&b.id)));
        found.dedup_by_key(|summit| summit.id);
        Ok(found)
    }

    /// Returns the peaks above the high ground of a block of cells.
    fn block(&self, whole: &World, [x, y]: [i64; 2], clock: &Clock) -> Result<Vec<Summit>, Stopped> {
        let side = (BLOCK * CELL) as usize;
        let area = Area::new(x * BLOCK * CELL, y * BLOCK * CELL, side, side);
        let land = self.world.relief().land(area.padded(CELL as usize), clock)?;
        let sea_level_m = self.world.preset().sea_level_m.map_or(f32::MIN, |level| level as f32);
        let mut found = Vec::new();
        for cell in area.squares(CELL as usize) {
            clock.check()?;
            let (top, height_m) = highest(&land.heights, cell);
            let around = Area::new(top[0], top[1], 1, 1).padded((CELL * 3 / 4) as usize);
            let around = around.common(&land.heights.area()).expect("it is in the area");
            let lowest_m = around.vertices().map(|(x, y)| land.heights.at(x, y)).fold(f32::MAX, f32::min);
            let is_top = highest(&land.heights, around).0 == top;
            if is_top && height_m - lowest_m >= self.least_rise_m && height_m > sea_level_m {
                let peak = self.climb.peak(top.map(|at| at * self.world.stride().vertices()), clock)?;
                found.extend(peak.map(|peak| Summit::new(whole, peak, clock)).transpose()?);
            }
        }
        Ok(found)
    }
}
