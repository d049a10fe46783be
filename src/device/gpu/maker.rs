//! The land of areas, made on a GPU in bands of rows: several bands a submission, several submissions under way.

use std::sync::Arc;
use std::sync::mpsc::{self, Receiver};

use rayon::prelude::*;
use wgpu::util::{BufferInitDescriptor, DeviceExt};
use wgpu::{
    BindGroupDescriptor, BindGroupEntry, Buffer, BufferAsyncError, BufferDescriptor, BufferUsages,
    CommandEncoderDescriptor, ComputePassDescriptor, MapMode, PollType, SubmissionIndex,
};

use super::adapter::Gpu;
use crate::area::Area;
use crate::clock::{Clock, stage};
use crate::device::LandMaker;
use crate::grid::Grid;
use crate::land::Land;
use crate::noise::packed::BLOCK;
use crate::relief::{NoiseRelief, PackedRelief};

/// A GPU as a maker of a world's land.
#[derive(Debug)]
pub struct GpuMaker<'a> {
    pub(super) gpu: Arc<Gpu>,
    pub(super) relief: &'a NoiseRelief,
    packed: PackedRelief,
    words: Buffer,
}

/// Tiles that are asked for at once: enough to keep a GPU busy while the CPU encodes the last ones.
const TOGETHER: usize = 4;

/// Bytes of heights of a submission, at most, and of what its blocks have for themselves.
const SUBMISSION_BYTES: u64 = 64 << 20;

/// The most groups along an axis, which all adapters take.
const MOST_GROUPS: u64 = 65_535;

/// Some rows of an area.
#[derive(Clone, Copy, Debug)]
struct Band {
    /// The area's number.
    index: usize,
    rows: Area,
}

/// A submission under way.
struct UnderWay {
    bands: Vec<Band>,
    heights: Buffer,
    index: SubmissionIndex,
    mapped: Receiver<Result<(), BufferAsyncError>>,
}

impl<'a> GpuMaker<'a> {
    /// A maker of the land of a relief.
    pub fn new(gpu: Arc<Gpu>, relief: &'a NoiseRelief) -> GpuMaker<'a> {
        let packed = relief.pack();
        let words = gpu.device.create_buffer_init(&BufferInitDescriptor {
            label: Some("relief"),
            contents: bytemuck::cast_slice(&packed.words),
            usage: BufferUsages::STORAGE,
        });
        GpuMaker { gpu, relief, packed, words }
    }

    /// The heights of each area, or `None` when something went wrong.
    pub(super) fn heights(&self, areas: &[Area]) -> Option<Vec<Grid<f32>>> {
        let mut grids: Vec<Grid<f32>> = areas.iter().map(|area| Grid::filled(*area, 0.0)).collect();
        // All are under way before the first is waited for.
        let under_way: Vec<UnderWay> =
            self.submissions(areas).into_iter().map(|bands| self.submit(bands)).collect::<Option<_>>()?;
        for submission in under_way {
            self.read(submission, &mut grids)?;
        }
        self.gpu.trouble().is_none().then_some(grids)
    }

    /// The areas in bands of whole rows of blocks, as many together as a submission takes.
    fn submissions(&self, areas: &[Area]) -> Vec<Vec<Band>> {
        let most_bytes = SUBMISSION_BYTES.min(self.gpu.storage_bytes);
        let rows = BLOCK[1] as i64;
        let mut submissions: Vec<Vec<Band>> = Vec::new();
        let (mut blocks, mut vertices) = (u64::MAX, 0);
        for (index, area) in areas.iter().enumerate().filter(|(_, area)| !area.is_empty()) {
            let mut y0 = area.y0;
            while y0 < area.y1 {
                let y1 = ((y0.div_euclid(rows) + 1) * rows).min(area.y1);
                let row = Area { y0, y1, ..*area };
                let row_blocks = (area.width() / BLOCK[0] + 2) as u64;
                let is_full = blocks.saturating_add(row_blocks) > MOST_GROUPS
                    || (blocks + row_blocks) * self.packed.block_words as u64 * 4 > most_bytes
                    || (vertices + row.len() as u64) * 4 > most_bytes;
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

    /// Hands bands to the GPU.
    fn submit(&self, bands: Vec<Band>) -> Option<UnderWay> {
        let Gpu { device, queue, layout, pipeline, group_side, .. } = &*self.gpu;
        // Where each band's heights begin.
        let mut vertices = 0;
        let firsts: Vec<(Band, usize)> = bands
            .iter()
            .map(|band| {
                vertices += band.rows.len();
                (*band, vertices - band.rows.len())
            })
            .collect();
        let packed: Vec<(Vec<u32>, usize)> = firsts
            .par_iter()
            .map(|(band, first)| {
                let mut words = Vec::new();
                let blocks = self.relief.pack_blocks(band.rows, *first as u32, &mut words);
                (words, blocks)
            })
            .collect();
        let blocks: usize = packed.iter().map(|(_, blocks)| blocks).sum();
        let words: Vec<u32> = packed.into_iter().flat_map(|(words, _)| words).collect();
        let bytes = vertices as u64 * 4;
        let buffer = |usage: BufferUsages| {
            device.create_buffer(&BufferDescriptor {
                label: Some("heights"),
                size: bytes,
                usage,
                mapped_at_creation: false,
            })
        };
        let initial = |words: &[u32], usage: BufferUsages| {
            device.create_buffer_init(&BufferInitDescriptor {
                label: None,
                contents: bytemuck::cast_slice(words),
                usage,
            })
        };
        let job = initial(&[0, self.packed.block_words as u32], BufferUsages::UNIFORM);
        let words = initial(&words, BufferUsages::STORAGE);
        let made = buffer(BufferUsages::STORAGE | BufferUsages::COPY_SRC);
        let heights = buffer(BufferUsages::COPY_DST | BufferUsages::MAP_READ);
        let entries = [&job, &self.words, &words, &made];
        let entries: Vec<BindGroupEntry<'_>> = (0..)
            .zip(entries)
            .map(|(binding, buffer)| BindGroupEntry { binding, resource: buffer.as_entire_binding() })
            .collect();
        let group = device.create_bind_group(&BindGroupDescriptor { label: None, layout, entries: &entries });
        let mut encoder = device.create_command_encoder(&CommandEncoderDescriptor::default());
        {
            let mut pass = encoder.begin_compute_pass(&ComputePassDescriptor::default());
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, &group, &[]);
            let [columns, rows] = BLOCK.map(|side| side as u32 / group_side);
            pass.dispatch_workgroups(columns, rows, blocks as u32);
        }
        encoder.copy_buffer_to_buffer(&made, 0, &heights, 0, bytes);
        let index = queue.submit([encoder.finish()]);
        let (tell, mapped) = mpsc::channel();
        // Nobody listens any more where something else went wrong.
        heights.map_async(MapMode::Read, .., move |result| _ = tell.send(result));
        self.gpu.trouble().is_none().then_some(UnderWay { bands, heights, index, mapped })
    }

    /// Waits for a submission, and puts its heights where they belong.
    fn read(&self, submission: UnderWay, grids: &mut [Grid<f32>]) -> Option<()> {
        let UnderWay { bands, heights, index, mapped } = submission;
        self.gpu.device.poll(PollType::Wait { submission_index: Some(index), timeout: None }).ok()?;
        mapped.recv().ok()?.ok()?;
        let bytes = heights.get_mapped_range(..).ok()?;
        let mut values: &[f32] = bytemuck::cast_slice(&bytes);
        for Band { index, rows } in bands {
            let (band, rest) = values.split_at(rows.len());
            values = rest;
            let grid = &mut grids[index];
            let first = (rows.y0 - grid.area().y0) as usize * rows.width();
            grid.values_mut()[first..first + band.len()].copy_from_slice(band);
        }
        Some(())
    }
}

impl LandMaker for GpuMaker<'_> {
    fn name(&self) -> String {
        format!("gpu, {}", self.gpu.name)
    }

    fn together(&self) -> usize {
        TOGETHER
    }

    fn lands(&self, areas: &[Area], clock: &Clock) -> Vec<Land> {
        let heights = clock.time(stage::RELIEF, || {
            let made = if self.gpu.trouble().is_none() { self.heights(areas) } else { None };
            made.unwrap_or_else(|| areas.iter().map(|area| self.relief.heights(*area)).collect())
        });
        heights.into_iter().map(|heights| Land { heights, water: None }).collect()
    }

    fn trouble(&self) -> Option<String> {
        self.gpu.trouble()
    }
}
