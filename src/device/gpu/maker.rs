//! The land of areas, made on a GPU in bands of rows: several bands a submission, several submissions under way.

use std::collections::VecDeque;
use std::sync::mpsc::{self, Receiver};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use rayon::prelude::*;
use wgpu::util::{BufferInitDescriptor, DeviceExt};
use wgpu::{
    BindGroup, BindGroupDescriptor, BindGroupEntry, Buffer, BufferAsyncError, BufferDescriptor, BufferUsages,
    CommandBuffer, CommandEncoderDescriptor, ComputePassDescriptor, MapMode, PollType, SubmissionIndex,
};

use super::adapter::Gpu;
use crate::area::Area;
use crate::clock::{Clock, stage};
use crate::device::LandMaker;
use crate::grid::Grid;
use crate::land::Land;
use crate::noise::packed::BLOCK;
use crate::relief::{Block, NoiseRelief, PackedRelief};

/// A GPU as a maker of a world's land.
#[derive(Debug)]
pub struct GpuMaker {
    pub(super) gpu: Arc<Gpu>,
    pub(super) relief: Arc<NoiseRelief>,
    packed: PackedRelief,
    /// What is the same for all blocks.
    words: Buffer,
    job: Buffer,
    /// Bytes of heights in a slot, and of words.
    slot_bytes: u64,
    /// Slots that nothing is under way in.
    slots: Mutex<Vec<Slot>>,
}

/// Tiles that are asked for at once: enough to keep a GPU busy while the CPU encodes the last ones.
const TOGETHER: usize = 4;

/// Bytes of heights of a submission at most, and of what its blocks have for themselves: so little that the next is made ready while
/// one is under way, and so much that what a submission costs does not count.
const SUBMISSION_BYTES: u64 = 8 << 20;

/// Submissions of one call that are under way at most: each has its buffers.
const UNDER_WAY: usize = 4;

/// The most groups along an axis, which all adapters take.
const MOST_BLOCKS: u64 = 65_535;

/// Blocks that a thread writes at a time: an even number, so that their bytes begin where mapped ranges may.
const PACKED: usize = 64;

/// Heights that a thread copies at a time.
const COPIED: usize = 1 << 16;

/// Some rows of an area.
#[derive(Clone, Copy, Debug)]
struct Band {
    /// The area's number.
    index: usize,
    rows: Area,
}

/// The buffers of a submission, kept for the next one: to make them takes longer than to fill them.
#[derive(Debug)]
struct Slot {
    /// What blocks have for themselves, where the CPU writes it, and where the kernel reads it.
    up: Buffer,
    words: Buffer,
    heights: Buffer,
    /// Heights where the CPU can read them.
    back: Buffer,
    group: BindGroup,
}

/// A submission under way.
struct UnderWay {
    bands: Vec<Band>,
    slot: Slot,
    index: SubmissionIndex,
    /// Whether the CPU can read the heights, and write into the slot again.
    mapped: Receiver<Result<(), BufferAsyncError>>,
}

impl GpuMaker {
    /// A maker of the land of a relief.
    pub fn new(gpu: Arc<Gpu>, relief: Arc<NoiseRelief>) -> GpuMaker {
        let packed = relief.pack();
        let initial = |words: &[u32], usage: BufferUsages| {
            let contents = bytemuck::cast_slice(words);
            gpu.device.create_buffer_init(&BufferInitDescriptor { label: Some("relief"), contents, usage })
        };
        let words = initial(&packed.words, BufferUsages::STORAGE);
        let job = initial(&[0, packed.block_words as u32], BufferUsages::UNIFORM);
        let slot_bytes = SUBMISSION_BYTES.min(gpu.storage_bytes);
        GpuMaker { gpu, relief, packed, words, job, slot_bytes, slots: Mutex::default() }
    }

    /// The heights of each area, or `None` when something went wrong.
    pub(super) fn heights(&self, areas: &[Area]) -> Option<Vec<Grid<f32>>> {
        let mut grids: Vec<Grid<f32>> = areas.iter().map(|area| Grid::filled(*area, 0.0)).collect();
        // What is left to be filled of each: bands come from north to south.
        let mut left: Vec<&mut [f32]> = grids.iter_mut().map(Grid::values_mut).collect();
        // The next are under way while the first is waited for.
        let mut under_way = VecDeque::with_capacity(UNDER_WAY);
        for bands in self.submissions(areas) {
            if under_way.len() == UNDER_WAY {
                self.read(under_way.pop_front()?, &mut left)?;
            }
            under_way.push_back(self.submit(bands)?);
        }
        while let Some(submission) = under_way.pop_front() {
            self.read(submission, &mut left)?;
        }
        self.gpu.trouble().is_none().then_some(grids)
    }

    /// The areas in bands of whole rows of blocks, as many together as a submission takes.
    fn submissions(&self, areas: &[Area]) -> Vec<Vec<Band>> {
        let rows = BLOCK[1] as i64;
        let mut submissions: Vec<Vec<Band>> = Vec::new();
        let (mut blocks, mut vertices) = (u64::MAX, 0);
        for (index, area) in areas.iter().enumerate().filter(|(_, area)| !area.is_empty()) {
            let mut y0 = area.y0;
            while y0 < area.y1 {
                let y1 = ((y0.div_euclid(rows) + 1) * rows).min(area.y1);
                let row = Area { y0, y1, ..*area };
                let row_blocks = (area.width() / BLOCK[0] + 2) as u64;
                let is_full = blocks.saturating_add(row_blocks) > MOST_BLOCKS
                    || (blocks + row_blocks) * self.packed.block_words as u64 * 4 > self.slot_bytes
                    || (vertices + row.len() as u64) * 4 > self.slot_bytes;
                if is_full {
                    submissions.push(Vec::new());
                    (blocks, vertices) = (0, 0);
                }
                blocks += row_blocks;
                vertices += row.len() as u64;
                let bands = submissions.last_mut().expect("the first row of blocks finds all full");
                match bands.last_mut() {
                    Some(band) if band.index == index => band.rows.y1 = y1,
                    _ => bands.push(Band { index, rows: row }),
                }
                y0 = y1;
            }
        }
        submissions
    }

    /// A slot that is free, or a new one.
    fn slot(&self) -> Slot {
        let free = self.slots.lock().unwrap_or_else(PoisonError::into_inner).pop();
        free.unwrap_or_else(|| {
            let device = &self.gpu.device;
            let buffer = |label: &str, usage: BufferUsages| {
                let (size, mapped_at_creation) = (self.slot_bytes, usage.contains(BufferUsages::MAP_WRITE));
                device.create_buffer(&BufferDescriptor { label: Some(label), size, usage, mapped_at_creation })
            };
            let up = buffer("blocks on their way", BufferUsages::MAP_WRITE | BufferUsages::COPY_SRC);
            let words = buffer("blocks", BufferUsages::STORAGE | BufferUsages::COPY_DST);
            let heights = buffer("heights", BufferUsages::STORAGE | BufferUsages::COPY_SRC);
            let back = buffer("heights read back", BufferUsages::COPY_DST | BufferUsages::MAP_READ);
            let entries: Vec<BindGroupEntry<'_>> = (0..)
                .zip([&self.job, &self.words, &words, &heights])
                .map(|(binding, buffer)| BindGroupEntry { binding, resource: buffer.as_entire_binding() })
                .collect();
            let descriptor = BindGroupDescriptor { label: None, layout: &self.gpu.layout, entries: &entries };
            let group = device.create_bind_group(&descriptor);
            Slot { up, words, heights, back, group }
        })
    }

    /// Writes into a slot what the kernel needs for some bands, and says how many blocks they have; `None` when something went wrong.
    fn load(&self, bands: &[Band], slot: &Slot) -> Option<u32> {
        let mut blocks: Vec<Block> = Vec::new();
        let mut vertices = 0;
        for band in bands {
            blocks.extend(Block::of(band.rows, vertices));
            vertices += band.rows.len() as u32;
        }
        let block_bytes = 4 * self.packed.block_words;
        let mut views = Vec::new();
        for (number, blocks) in blocks.chunks(PACKED).enumerate() {
            let first = (number * PACKED * block_bytes) as u64;
            views
                .push((slot.up.get_mapped_range_mut(first..first + (blocks.len() * block_bytes) as u64).ok()?, blocks));
        }
        views.into_par_iter().for_each_init(Vec::new, |words, (mut view, blocks)| {
            for (number, block) in blocks.iter().enumerate() {
                words.clear();
                self.relief.pack_block(block, words);
                view.slice(number * block_bytes..).slice(..block_bytes).copy_from_slice(bytemuck::cast_slice(words));
            }
        });
        slot.up.unmap();
        Some(blocks.len() as u32)
    }

    /// The commands that compute the blocks that were written into a slot, so many times, and then copy heights where the CPU can read
    /// them, if any.
    fn commands(&self, slot: &Slot, blocks: u32, times: u32, vertices: usize) -> CommandBuffer {
        let mut encoder = self.gpu.device.create_command_encoder(&CommandEncoderDescriptor::default());
        let bytes = u64::from(blocks) * 4 * self.packed.block_words as u64;
        encoder.copy_buffer_to_buffer(&slot.up, 0, &slot.words, 0, bytes);
        {
            let mut pass = encoder.begin_compute_pass(&ComputePassDescriptor::default());
            pass.set_pipeline(&self.gpu.pipeline);
            pass.set_bind_group(0, &slot.group, &[]);
            let [columns, rows] = BLOCK.map(|side| side as u32 / self.gpu.group_side);
            for _ in 0..times {
                pass.dispatch_workgroups(columns, rows, blocks);
            }
        }
        if vertices > 0 {
            encoder.copy_buffer_to_buffer(&slot.heights, 0, &slot.back, 0, 4 * vertices as u64);
        }
        encoder.finish()
    }

    /// Hands bands to the GPU.
    fn submit(&self, bands: Vec<Band>) -> Option<UnderWay> {
        let slot = self.slot();
        let blocks = self.load(&bands, &slot)?;
        let vertices = bands.iter().map(|band| band.rows.len()).sum::<usize>();
        let index = self.gpu.queue.submit([self.commands(&slot, blocks, 1, vertices)]);
        let (tell, mapped) = mpsc::channel();
        let told = tell.clone();
        // Nobody listens any more where something else went wrong.
        slot.back.map_async(MapMode::Read, ..4 * vertices as u64, move |result| _ = tell.send(result));
        slot.up.map_async(MapMode::Write, .., move |result| _ = told.send(result));
        self.gpu.trouble().is_none().then_some(UnderWay { bands, slot, index, mapped })
    }

    /// How long the kernel takes for an area, without what goes to the GPU and comes from it: for benchmarks. The area must fit one
    /// submission.
    pub fn kernel_time(&self, area: Area, times: u32) -> Option<Duration> {
        let submissions = self.submissions(&[area]);
        let [bands] = &submissions[..] else { return None };
        let slot = self.slot();
        let blocks = self.load(bands, &slot)?;
        let spent = |times: u32| {
            let commands = self.commands(&slot, blocks, times, 0);
            let start = Instant::now();
            let submission_index = Some(self.gpu.queue.submit([commands]));
            self.gpu.device.poll(PollType::Wait { submission_index, timeout: None }).ok()?;
            Some(start.elapsed())
        };
        // What a submission costs is in both.
        spent(times)?;
        let once = spent(times)?;
        Some(spent(2 * times)?.saturating_sub(once) / times)
    }

    /// Waits for a submission, and puts its heights where they belong: into the first that are left of each area.
    fn read(&self, submission: UnderWay, left: &mut [&mut [f32]]) -> Option<()> {
        let UnderWay { bands, slot, index, mapped } = submission;
        self.gpu.device.poll(PollType::Wait { submission_index: Some(index), timeout: None }).ok()?;
        for result in mapped {
            result.ok()?;
        }
        {
            let vertices = bands.iter().map(|band| band.rows.len()).sum::<usize>();
            let bytes = slot.back.get_mapped_range(..4 * vertices as u64).ok()?;
            let mut values: &[f32] = bytemuck::cast_slice(&bytes);
            let mut copies = Vec::with_capacity(bands.len());
            for Band { index, rows } in bands {
                let (band, rest) = values.split_at(rows.len());
                values = rest;
                copies.push((left[index].split_off_mut(..rows.len()).expect("a band is a part of its area"), band));
            }
            // Fresh memory is slow to be written for the first time.
            copies.into_par_iter().for_each(|(to, band)| {
                to.par_chunks_mut(COPIED).zip(band.par_chunks(COPIED)).for_each(|(to, band)| to.copy_from_slice(band));
            });
        }
        slot.back.unmap();
        self.slots.lock().unwrap_or_else(PoisonError::into_inner).push(slot);
        Some(())
    }
}

impl LandMaker for GpuMaker {
    fn name(&self) -> String {
        format!("gpu, {}", self.gpu.name)
    }

    fn together(&self) -> usize {
        TOGETHER
    }

    fn lands(&self, areas: &[Area], clock: &Clock) -> Vec<Land> {
        let heights = clock.time(stage::RELIEF, || {
            let made = if self.gpu.trouble().is_none() { self.heights(areas) } else { None };
            if made.is_none() {
                self.gpu.give_up("gave no heights");
            }
            made.unwrap_or_else(|| areas.iter().map(|area| self.relief.heights(*area)).collect())
        });
        heights.into_iter().map(|heights| Land { heights, water: None }).collect()
    }

    fn trouble(&self) -> Option<String> {
        self.gpu.trouble()
    }
}
