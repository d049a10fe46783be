//! Land of noise and tiles of it, made on a GPU in bands of rows: with several bands per submission, and several
//! submissions at a time.

use std::sync::Arc;
use std::time::Duration;

use bytemuck::{Zeroable, cast_slice, cast_slice_mut};
use rayon::prelude::*;
use wgpu::{ComputePass, ComputePipeline};

use super::adapter::Gpu;
use super::bands::{BANDS, Band, BandWords, IMPRINT_PLANES, LandJob, LooksAround, SURFACE_PLANES, TABLE, submissions};
use super::submission::{Slot, Slots, Submission, Words};
use crate::area::Area;
use crate::clock::{Clock, stage};
use crate::device::LandMaker;
use crate::grid::Grid;
use crate::land::Land;
use crate::lines::{Imprint, Line, gpu_words};
use crate::noise::gpu_words::BLOCK;
use crate::relief::{NoiseRelief, PackedRelief, VertexBlock};
use crate::stop::Stopped;
use crate::tile::{Blend, GroundRule, Normals, Tile, TilePlan, TileSurface};
use crate::world::World;

/// A GPU as a maker of land of noise, and of tiles on it.
#[derive(Debug)]
pub struct NoiseMaker {
    pub(super) gpu: Arc<Gpu>,
    pub(super) relief: Arc<NoiseRelief>,
    pub(super) rule: GroundRule,
    /// Noise of the ground, and its offset in the words that all blocks share.
    rough: Option<(u32, NoiseRelief)>,
    looks: LooksAround,
    /// Number of words per block.
    block_words: usize,
    slots: Slots,
}

/// Number of tiles that should be requested at once: enough to keep a GPU busy while the CPU encodes earlier tiles.
const TOGETHER: usize = 4;

/// Largest size in bytes of a submission's upload, and of its readback: so small that the next submission can be
/// prepared while one is under way, and so large that the overhead of a submission does not matter.
const SUBMISSION_BYTES: u64 = 8 << 20;

/// Largest number of submissions of one call at a time, each with buffers of its own.
const UNDER_WAY: usize = 16;

/// The bands of a submission, and the planes that receive their values.
type Bands<'a> = (Vec<Band>, Vec<&'a mut [u32]>);

/// Sizes of a submission whose slot has been filled.
struct SubmissionSizes {
    blocks: u32,
    bands: u32,
    words: Words,
    /// Largest width and height, over all bands, of the land that lines shape, and of the tile.
    carved: [usize; 2],
    cells: [usize; 2],
}

/// Result of a job.
pub(super) struct Made {
    pub heights: Grid<f32>,
    imprint: Vec<Grid<f32>>,
    normals: Vec<Grid<f32>>,
    weights: Vec<Grid<u32>>,
}

impl NoiseMaker {
    /// Creates a maker of a relief's land, and of tiles with this ground rule.
    pub fn new(gpu: Arc<Gpu>, relief: Arc<NoiseRelief>, rule: GroundRule) -> NoiseMaker {
        let mut packed = PackedRelief::default();
        relief.pack(&mut packed);
        let mut block_words = packed.block_words;
        let ragged = rule.ragged();
        let rough = ragged.and_then(|(noise, _)| noise).map(|noise| {
            let noise = NoiseRelief::of_fractal(Some(noise), 1.0);
            let begins = noise.pack(&mut packed);
            block_words = block_words.max(packed.block_words);
            (begins, noise)
        });
        let looks = LooksAround { noise: ragged.is_some(), rubble: ragged.is_some_and(|(_, has_scree)| has_scree) };
        let rule_at = packed.words.len();
        rule.pack(&mut packed.words);
        let slots = Slots::new(&gpu, SUBMISSION_BYTES, &packed.words, [block_words, rule_at]);
        NoiseMaker { gpu, relief, rule, rough, looks, block_words, slots }
    }

    /// Makes the job of a tile from its vertices, the land that it is made of, and its lines; `None` if the kernels do
    /// not support these lines.
    pub(super) fn tile_job<'a>(cells: Area, land: Area, lines: impl IntoIterator<Item = &'a Line>) -> Option<LandJob> {
        let mut lines = gpu_words::pack(lines, land)?;
        if lines[0] == 0 {
            lines.clear();
        }
        Some(LandJob { land, cells: Some(cells), lines })
    }

    /// Carries out all jobs. `None` if a job is too large, or if something failed, which is then recorded as
    /// [trouble](Gpu::trouble).
    pub(super) fn make(&self, jobs: &[LandJob], clock: &Clock) -> Result<Option<Vec<Made>>, Stopped> {
        let Some(submissions) = submissions(jobs, self.looks, &self.slots, self.block_words) else { return Ok(None) };
        let made = self.make_all(jobs, submissions, clock)?;
        if made.is_none() {
            self.gpu.give_up("gave nothing back");
        }
        Ok(made.filter(|_| self.gpu.trouble().is_none()))
    }

    /// Carries out all submissions, on the calling thread alone if there is only one. The caller of a small request may
    /// hold a lock that other work of the pool waits for, so such work must not begin on its thread.
    fn make_all(
        &self,
        jobs: &[LandJob],
        submissions: Vec<Vec<Band>>,
        clock: &Clock,
    ) -> Result<Option<Vec<Made>>, Stopped> {
        let is_one = submissions.len() < 2;
        let mut made: Vec<Made> = match is_one {
            true => jobs.iter().map(Made::room).collect(),
            // In parallel, because clearing memory takes as long as filling it.
            false => jobs.par_iter().map(Made::room).collect(),
        };
        // The part of each plane that is not filled yet. Bands fill it from north to south.
        let mut left: Vec<Vec<&mut [u32]>> = made.iter_mut().map(Made::planes_mut).collect();
        let mut lanes: Vec<Vec<Bands<'_>>> = Vec::new();
        lanes.resize_with(UNDER_WAY.min(submissions.len()), Vec::new);
        for (number, bands) in submissions.into_iter().enumerate() {
            let room = bands.iter().flat_map(|band| band.split_off(&mut left[band.job])).collect();
            lanes[number % UNDER_WAY].push((bands, room));
        }
        // The error of a lane is none if the GPU failed.
        let carry_out = |lane: Vec<Bands<'_>>| {
            lane.into_iter().try_for_each(|(bands, room)| {
                let submission = clock.time(stage::GPU_LOADS, || self.submit(jobs, &bands)).map_err(Some)?;
                self.read(&bands, submission.ok_or(None)?, room, clock).map_err(Some)?.ok_or(None)
            })
        };
        let carried_out = match is_one {
            true => lanes.into_iter().try_for_each(carry_out),
            // The CPU prepares or reads one submission while the GPU computes another.
            false => lanes.into_par_iter().map(carry_out).collect(),
        };
        match carried_out {
            Ok(()) => Ok(Some(made)),
            Err(None) => Ok(None),
            Err(Some(stopped)) => Err(stopped),
        }
    }

    /// Writes the kernels' input for some bands into a slot; `None` if mapping fails.
    fn load(&self, jobs: &[LandJob], bands: &[Band], slot: &Slot) -> Option<SubmissionSizes> {
        let mut blocks: Vec<VertexBlock> = Vec::new();
        let mut table = [BandWords::zeroed(); BANDS];
        let mut lines = Vec::new();
        let count = |band: &Band| {
            VertexBlock::count(band.land) + if self.rough.is_some() { VertexBlock::count(band.cells) } else { 0 }
        };
        let lines_at = TABLE + self.block_words * bands.iter().map(count).sum::<usize>();
        // Mapped ranges must begin at an even word.
        let lines_at = lines_at.next_multiple_of(2);
        let mut back = 0;
        // Planes that stay on the GPU lie behind all that come back.
        let mut left: usize = bands.iter().map(Band::back_words).sum();
        let (mut carved, mut cells) = ([0; 2], [0; 2]);
        let widen = |most: &mut [usize; 2], area: Area| {
            *most = [most[0].max(area.width()), most[1].max(area.height())];
        };
        for (band, words) in bands.iter().zip(&mut table) {
            let job = &jobs[band.job];
            let (heights, imprint) = (back, back + band.land.len());
            let out = back + band.planes[0] * band.land.len();
            back += band.back_words();
            let noise = left;
            let rubble = [noise + band.cells.len(), noise + band.cells.len() + band.rubble().len()];
            if self.looks.noise {
                left = rubble[0] + if self.looks.rubble { 2 * band.rubble().len() } else { 0 };
            }
            blocks.extend(VertexBlock::of(band.land, heights as u32, 0));
            if let Some((rough, _)) = &self.rough {
                blocks.extend(VertexBlock::of(band.cells, noise as u32, *rough));
            }
            let has_lines = !job.lines.is_empty();
            let [east, south] = [band.cells.x0 - band.land.x0, band.cells.y0 - band.land.y0];
            *words = BandWords {
                land: heights as u32,
                width: band.land.width() as u32,
                height: band.land.height() as u32,
                pad: if band.cells.is_empty() { [0; 2] } else { [east as u32, south as u32] },
                cells: [band.cells.width() as u32, band.cells.height() as u32],
                out: out as u32,
                noise: noise as u32,
                rubble: rubble.map(|at| at as u32),
                lines: if has_lines { (lines_at + lines.len()) as u32 } else { 0 },
                row: (band.land.y0 - job.land.y0) as u32,
                imprint: imprint as u32,
            };
            lines.extend_from_slice(&job.lines);
            if has_lines {
                widen(&mut carved, band.land);
            }
            widen(&mut cells, band.cells);
        }
        slot.view(0, TABLE)?.copy_from_slice(cast_slice(&table));
        if !lines.is_empty() {
            slot.view(lines_at, lines.len())?.copy_from_slice(cast_slice(&lines));
        }
        let mut view = slot.view(TABLE, lines_at - TABLE)?;
        let (block_bytes, mut words) = (4 * self.block_words, Vec::new());
        for (number, block) in blocks.iter().enumerate() {
            words.clear();
            let rough = self.rough.as_ref().filter(|(begins, _)| *begins == block.relief());
            rough.map_or(&*self.relief, |(_, noise)| noise).pack_block(block, &mut words);
            words.resize(self.block_words, 0);
            view.slice(number * block_bytes..).slice(..block_bytes).copy_from_slice(cast_slice(&words));
        }
        drop(view);
        Some(SubmissionSizes {
            blocks: blocks.len() as u32,
            bands: bands.len() as u32,
            words: Words { own: lines_at + lines.len(), back },
            carved,
            cells,
        })
    }

    /// Encodes all kernels of a submission, one after the other.
    fn compute(&self, pass: &mut ComputePass<'_>, loaded: &SubmissionSizes) {
        let kernels = self.gpu.kernels();
        let side = self.gpu.group_side;
        let [columns, rows] = BLOCK.map(|vertices| vertices as u32 / side);
        pass.set_pipeline(self.gpu.fill());
        pass.dispatch_workgroups(columns, rows, loaded.blocks);
        let mut over = |kernel: &ComputePipeline, vertices: [usize; 2]| {
            if vertices[0] > 0 {
                let [columns, rows] = vertices.map(|vertices| (vertices as u32).div_ceil(side));
                pass.set_pipeline(kernel);
                pass.dispatch_workgroups(columns, rows, loaded.bands);
            }
        };
        over(&kernels.carve, loaded.carved);
        if self.looks.rubble {
            for (kernel, reach) in [&kernels.rock].into_iter().chain(&kernels.spread) {
                over(kernel, loaded.cells.map(|vertices| if vertices > 0 { vertices + 2 * reach } else { 0 }));
            }
        }
        over(&kernels.surface, loaded.cells);
    }

    /// Submits bands to the GPU.
    fn submit(&self, jobs: &[LandJob], bands: &[Band]) -> Option<Submission> {
        let slot = self.slots.take(&self.gpu);
        let loaded = self.load(jobs, bands, &slot)?;
        let submission = slot.submit(&self.gpu, loaded.words, |pass| self.compute(pass, &loaded));
        self.gpu.trouble().is_none().then_some(submission)
    }

    /// Waits for the submission of some bands, and copies its values to the planes of their jobs.
    fn read(
        &self,
        bands: &[Band],
        submission: Submission,
        room: Vec<&mut [u32]>,
        clock: &Clock,
    ) -> Result<Option<()>, Stopped> {
        if clock.time(stage::GPU_WAITS, || submission.wait(&self.gpu))?.is_none() {
            return Ok(None);
        }
        let read = clock.time(stage::GPU_READS, || {
            let bytes = submission.values()?;
            let mut values: &[u32] = cast_slice(&bytes);
            let mut planes = Vec::with_capacity(room.len());
            for band in bands {
                let (land, rest) = values.split_at(band.planes[0] * band.land.len());
                let (cells, rest) = rest.split_at(band.planes[1] * band.cells.len());
                values = rest;
                let first = (band.kept.y0 - band.land.y0) as usize * band.land.width();
                planes.extend(land.chunks_exact(band.land.len()).map(|plane| &plane[first..][..band.kept.len()]));
                planes.extend(cells.chunks_exact(band.cells.len().max(1)));
            }
            room.into_iter().zip(planes).for_each(|(to, plane)| to.copy_from_slice(plane));
            Some(())
        })?;
        if read.is_some() {
            self.slots.give_back(submission);
        }
        Ok(read)
    }

    /// Measures the time of the kernels for the land of an area, or for a tile on it without lines, excluding upload
    /// and readback, for benchmarks. `None` if something fails, or if the work does not fit into one submission.
    pub fn kernel_time(&self, land: Area, cells: Option<Area>, times: u32) -> Option<Duration> {
        let jobs = [LandJob { land, cells, lines: Vec::new() }];
        let submissions = submissions(&jobs, self.looks, &self.slots, self.block_words)?;
        let [bands] = &submissions[..] else { return None };
        let slot = self.slots.take(&self.gpu);
        let loaded = self.load(&jobs, bands, &slot)?;
        slot.time(&self.gpu, loaded.words.own, times, |pass, times| {
            (0..times).for_each(|_| self.compute(pass, &loaded));
        })
    }
}

impl Made {
    /// Allocates the planes for the result of a job.
    fn room(job: &LandJob) -> Made {
        let [of_land, of_cells] = job.planes();
        let cells = job.cells.filter(|_| of_cells == SURFACE_PLANES).unwrap_or(Area { x1: job.land.x0, ..job.land });
        let grids = |count: usize, area: Area| (0..count).map(|_| Grid::filled(area, 0.0)).collect();
        let axes = of_cells.saturating_sub(WORDS);
        Made {
            heights: Grid::filled(job.land, 0.0),
            imprint: grids(of_land - 1, job.land),
            normals: grids(axes, cells),
            weights: (axes..of_cells).map(|_| Grid::filled(cells, 0)).collect(),
        }
    }

    /// Returns all planes, in the order in which they come back.
    fn planes_mut(&mut self) -> Vec<&mut [u32]> {
        let floats = [&mut self.heights].into_iter().chain(&mut self.imprint).chain(&mut self.normals);
        let floats = floats.map(|grid| cast_slice_mut(grid.values_mut()));
        floats.chain(self.weights.iter_mut().map(Grid::values_mut)).collect()
    }

    /// Returns the land, and the surface of the tile on it; `lines` are those that shaped the land.
    pub fn into_parts<'a>(self, lines: impl IntoIterator<Item = &'a Line>) -> (Grid<f32>, TileSurface) {
        let Made { heights, imprint, normals, weights } = self;
        let imprint: Option<[Grid<f32>; IMPRINT_PLANES]> = imprint.try_into().ok();
        let normals: [Grid<f32>; SURFACE_PLANES - WORDS] = normals.try_into().expect("a tile was asked for");
        let [ground, cover]: [Grid<u32>; WORDS] = weights.try_into().expect("a tile was asked for");
        let surface = TileSurface {
            normals: Normals::of_planes(normals),
            blend: Blend::of_words(ground, cover),
            imprint: imprint.map(|planes| Imprint::of_planes(planes, lines)),
        };
        (heights, surface)
    }
}

/// Number of planes among those of a surface that hold words of weights.
const WORDS: usize = 2;

impl LandMaker for NoiseMaker {
    fn name(&self) -> String {
        format!("gpu, {}", self.gpu.name)
    }

    fn host_bytes(&self, threads: usize) -> u64 {
        self.slots.host_bytes(threads)
    }

    fn together(&self) -> usize {
        TOGETHER
    }

    fn lands(&self, areas: &[Area], clock: &Clock) -> Result<Vec<Land>, Stopped> {
        let jobs: Vec<LandJob> =
            areas.iter().map(|area| LandJob { land: *area, cells: None, lines: Vec::new() }).collect();
        let made = if self.gpu.trouble().is_none() { self.make(&jobs, clock)? } else { None };
        let heights = match made {
            Some(made) => made.into_iter().map(|made| made.heights).collect(),
            None => clock.time(stage::RELIEF, || {
                areas.iter().map(|area| self.relief.heights(*area, clock)).collect::<Result<Vec<_>, _>>()
            })??,
        };
        Ok(heights.into_iter().map(|heights| Land { heights, water: None }).collect())
    }

    fn tiles(&self, world: &World, plans: Vec<TilePlan>, clock: &Clock) -> Result<Vec<Tile>, Stopped> {
        let job = |plan: &TilePlan| NoiseMaker::tile_job(plan.cells(world), plan.land, plan.lines());
        let jobs =
            if self.gpu.trouble().is_none() { plans.iter().map(job).collect::<Option<Vec<LandJob>>>() } else { None };
        let made = jobs.map(|jobs| self.make(&jobs, clock)).transpose()?.flatten();
        let Some(made) = made else { return self.tiles_of_lands(world, plans, clock) };
        let tile = |(plan, made): (TilePlan, Made)| {
            let (heights, surface) = made.into_parts(plan.lines());
            Tile::build(world, plan, Land { heights, water: None }, surface)
        };
        Ok(plans.into_iter().zip(made).map(tile).collect())
    }

    fn trouble(&self) -> Option<String> {
        self.gpu.trouble()
    }
}
