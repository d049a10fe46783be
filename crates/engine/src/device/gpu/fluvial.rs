//! Land with rivers on a GPU: valleys, gullies and coasts there, and the rest on the CPU, while the next is under way.

use std::sync::Arc;

use bytemuck::cast_slice;
use rayon::prelude::*;
use wgpu::ComputePass;

use super::adapter::Gpu;
use super::job::TABLE;
use super::slot::{Slots, UnderWay, Words};
use crate::area::Area;
use crate::clock::{Clock, stage};
use crate::device::LandMaker;
use crate::fluvial::Fluvial;
use crate::fluvial::packed::{self, FluvialJob, FluvialKernel, FluvialPlanes, MOST_OCTAVES};
use crate::land::Land;
use crate::noise::packed::BLOCK;
use crate::noise::{Fractal, Stripes};
use crate::relief::{Block, NoiseRelief, PackedRelief};

/// A GPU as a maker of land with rivers.
#[derive(Debug)]
pub struct FluvialMaker {
    pub(super) gpu: Arc<Gpu>,
    pub(super) fluvial: Arc<Fluvial>,
    /// The noises that nodes have, the plane of each, and where it begins among what is the same for all.
    noises: Vec<(NoiseRelief, usize, u32)>,
    /// Words of a block of noise.
    block_words: usize,
    slots: Slots,
}

/// Areas that are asked for at once.
const TOGETHER: usize = 4;

/// Bytes of a submission at most that go up, and that come back: room for the tiles of all presets.
const SUBMISSION_BYTES: u64 = 24 << 20;

/// Planes that come back and that do not, and those that noise is written into: `shaders/fluvial.wgsl` has them by name.
const BACK: usize = 8;
const LEFT: usize = 11;
const EAST: usize = 0;
const SOUTH: usize = 1;
const PATCHES: usize = 17;
const ROUGH: usize = 18;

/// Nodes a side of a patch of valleys, which is a group of threads.
const PATCH: u32 = 8;

/// Words of a block of stripes before what they have for themselves.
const FIRST_WORDS: usize = 2;

/// What a submission computes.
struct Loaded {
    nodes: Area,
    noise_blocks: u32,
    stripe_blocks: u32,
    words: Words,
}

impl FluvialMaker {
    /// A maker of fluvial land.
    pub fn new(gpu: Arc<Gpu>, fluvial: Arc<Fluvial>) -> FluvialMaker {
        let kernel = fluvial.kernel();
        let mut reliefs = PackedRelief::default();
        let mut block_words = 0;
        let mut noise = |fractal: Option<&Fractal>, height_m: f32, plane: usize| {
            let noise = NoiseRelief::of_fractal(fractal, height_m);
            let begins = noise.pack(&mut reliefs);
            block_words = block_words.max(reliefs.block_words);
            (noise, plane, begins)
        };
        // From afar nothing is displaced.
        let (warp, distance_m) =
            kernel.warp().map_or(([None, None], 0.0), |(axes, distance_m)| (axes.each_ref().map(Some), distance_m));
        let mut noises: Vec<_> =
            warp.into_iter().zip([EAST, SOUTH]).map(|(axis, plane)| noise(axis, distance_m, plane)).collect();
        noises.extend(kernel.roughness().map(|roughness| noise(Some(roughness), 1.0, ROUGH)));
        // All octaves that are patchy are by the same noise.
        let patches = kernel.octaves().find_map(|(_, patches)| patches);
        noises.extend(patches.map(|patches| noise(Some(patches), 1.0, PATCHES)));
        let rule = reliefs.words.len();
        kernel.pack(&mut reliefs.words);
        let slots = Slots::new(&gpu, SUBMISSION_BYTES, &reliefs.words, [block_words, rule]);
        FluvialMaker { gpu, fluvial, noises, block_words, slots }
    }

    /// The words of a job: a table, blocks of noise, blocks of stripes, and what the job has for itself. `None` where there are more
    /// than a submission takes.
    fn words(&self, job: &FluvialJob) -> Option<(Vec<u32>, Loaded)> {
        let (kernel, nodes) = (self.fluvial.kernel(), job.nodes);
        if BACK.max(LEFT) * nodes.len() > self.slots.words {
            return None;
        }
        let mut words = vec![0; TABLE];
        let mut noise_blocks = 0;
        for (noise, plane, begins) in &self.noises {
            for block in Block::of(nodes, (plane * nodes.len()) as u32, *begins) {
                let end = words.len() + self.block_words;
                noise.pack_block(&block, &mut words);
                words.resize(end, 0);
                noise_blocks += 1;
            }
        }
        let firsts: Vec<(i64, i64)> = Block::of(nodes, 0, 0).map(|block| block.first()).collect();
        let mut stripes_at = [0; 2 * MOST_OCTAVES];
        for (at, (stripes, _)) in stripes_at.chunks_exact_mut(2).zip(kernel.octaves()) {
            at[0] = words.len();
            at[1] = FIRST_WORDS + Stripes::block_words(stripes);
            for (x, y) in &firsts {
                words.extend([x - nodes.x0, y - nodes.y0].map(|from| from as i32 as u32));
                stripes.pack_block((*x, *y), &mut words);
            }
        }
        let own = words.len();
        let [segments_at, lists_at] = kernel.pack_job(job, &mut words);
        let part = job.part;
        let in_block = [nodes.x0, nodes.y0].map(|at| at.rem_euclid(packed::BLOCK) as usize);
        let blocks = packed::blocks(part);
        let from = [blocks.x0 - nodes.x0.div_euclid(packed::BLOCK), blocks.y0 - nodes.y0.div_euclid(packed::BLOCK)];
        let corners = [part.x0 - nodes.x0, part.y0 - nodes.y0, part.x1 - nodes.x0, part.y1 - nodes.y0];
        let numbers = [nodes.width(), nodes.height()]
            .into_iter()
            .chain(corners.map(|at| at as usize))
            .chain(in_block)
            .chain(from.map(|at| at as usize))
            .chain([blocks.width(), own, own + segments_at, own + lists_at])
            .chain(stripes_at)
            .chain([usize::from(job.has_rest())]);
        let mut table: Vec<u32> = numbers.map(|number| number as u32).collect();
        if kernel.has_sea() {
            table.push(words.len() as u32);
            table.extend(kernel.pack_coast(job, &mut words));
        }
        words[..table.len()].copy_from_slice(&table);
        let loaded = Loaded {
            nodes,
            noise_blocks,
            stripe_blocks: firsts.len() as u32,
            words: Words { own: words.len(), back: BACK * nodes.len() },
        };
        (words.len() <= self.slots.words).then_some((words, loaded))
    }

    /// Kernel after kernel.
    fn compute(&self, pass: &mut ComputePass<'_>, loaded: &Loaded) {
        let (kernels, side) = (self.gpu.fluvial_kernels(), self.gpu.group_side);
        let [width, height] = [loaded.nodes.width(), loaded.nodes.height()].map(|nodes| nodes as u32);
        let [columns, rows] = BLOCK.map(|nodes| nodes as u32 / side);
        let [across, down] = [width, height].map(|nodes| nodes.div_ceil(side));
        pass.set_pipeline(self.gpu.fill());
        pass.dispatch_workgroups(columns, rows, loaded.noise_blocks);
        pass.set_pipeline(&kernels.valleys);
        pass.dispatch_workgroups(width / PATCH, height / PATCH, 1);
        if self.fluvial.kernel().has_sea() {
            pass.set_pipeline(&kernels.coast);
            pass.dispatch_workgroups(across, down, 1);
        }
        if self.fluvial.kernel().roughness().is_none() {
            // No gullies.
            return;
        }
        for kernel in [&kernels.fall_line].into_iter().chain(&kernels.smooth) {
            pass.set_pipeline(kernel);
            pass.dispatch_workgroups(across, down, 1);
        }
        for (octave, _) in kernels.octaves.iter().zip(self.fluvial.kernel().octaves()) {
            pass.set_pipeline(octave);
            pass.dispatch_workgroups(columns, rows, loaded.stripe_blocks);
        }
        pass.set_pipeline(&kernels.roughen);
        pass.dispatch_workgroups(across, down, 1);
    }

    /// Hands a job to the GPU; `None` where it is too large, or something went wrong.
    fn submit(&self, job: &FluvialJob) -> Option<UnderWay> {
        let (words, loaded) = self.words(job)?;
        let slot = self.slots.take(&self.gpu);
        slot.view(0, words.len().next_multiple_of(2))?.slice(..4 * words.len()).copy_from_slice(cast_slice(&words));
        Some(slot.submit(&self.gpu, loaded.words, |pass| self.compute(pass, &loaded)))
    }

    /// Waits for the planes of a job.
    fn read(&self, job: &FluvialJob, submission: UnderWay, clock: &Clock) -> Option<FluvialPlanes> {
        clock.time(stage::GPU_WAITS, || submission.wait(&self.gpu))?;
        let planes = clock.time(stage::GPU_READS, || {
            let bytes = submission.values()?;
            let words: &[u32] = cast_slice(&bytes);
            let mut planes = words.chunks_exact(job.nodes.len());
            let mut floats = || planes.next().map(|plane| cast_slice::<u32, f32>(plane).to_vec());
            let metres = [floats()?, floats()?];
            let [height_m, crest_m, distance_m, share] = [floats()?, floats()?, floats()?, floats()?];
            let segment = planes.next()?.to_vec();
            let coast_m = self.fluvial.kernel().has_sea().then(|| planes.next());
            let coast_m = coast_m.flatten().map(|plane| cast_slice::<u32, f32>(plane).to_vec());
            Some(FluvialPlanes { metres, height_m, crest_m, distance_m, share, segment, coast_m })
        })?;
        self.slots.give_back(submission);
        Some(planes)
    }

    /// The land at the nodes of an area, each by itself.
    fn land(&self, kernel: &FluvialKernel<'_>, area: Area, clock: &Clock) -> Land {
        let job = kernel.job(area, clock);
        let submission = match self.gpu.trouble() {
            None => clock.time(stage::GPU_LOADS, || self.submit(&job)),
            Some(_) => None,
        };
        let planes = submission.map(|submission| {
            let planes = self.read(&job, submission, clock).filter(|_| self.gpu.trouble().is_none());
            if planes.is_none() {
                self.gpu.give_up("gave nothing back");
            }
            planes
        });
        match planes.flatten() {
            Some(planes) => kernel.land(job, planes, clock),
            None => kernel.land_of_cpu(&job, clock),
        }
    }
}

impl LandMaker for FluvialMaker {
    fn name(&self) -> String {
        format!("gpu, {}", self.gpu.name)
    }

    fn host_bytes(&self, threads: usize) -> u64 {
        self.slots.host_bytes(threads)
    }

    fn together(&self) -> usize {
        TOGETHER
    }

    fn lands(&self, areas: &[Area], clock: &Clock) -> Vec<Land> {
        let kernel = self.fluvial.kernel();
        let land = |area: &Area| kernel.land_by(*area, |area| self.land(&kernel, area, clock));
        areas.par_iter().map(land).collect()
    }

    fn gpu(&self) -> Option<Arc<Gpu>> {
        Some(Arc::clone(&self.gpu))
    }

    fn trouble(&self) -> Option<String> {
        self.gpu.trouble()
    }
}
