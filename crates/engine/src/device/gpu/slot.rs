//! Submissions and their buffers, which are kept for the next ones: to make them takes longer than to fill them.

use std::sync::mpsc::{self, Receiver};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use bytemuck::cast_slice;
use wgpu::util::{BufferInitDescriptor, DeviceExt};
use wgpu::{
    BindGroup, BindGroupDescriptor, BindGroupEntry, Buffer, BufferAsyncError, BufferDescriptor, BufferUsages,
    BufferView, BufferViewMut, CommandBuffer, CommandEncoderDescriptor, ComputePass, ComputePassDescriptor, MapMode,
    PollType, SubmissionIndex,
};

use super::adapter::Gpu;

/// The buffers of a submission.
#[derive(Debug)]
pub(super) struct Slot {
    /// What it is told: where the CPU writes it, and where kernels read it.
    up: Buffer,
    own: Buffer,
    /// Planes of values, and where the CPU can read those that come back.
    planes: Buffer,
    back: Buffer,
    group: BindGroup,
}

/// Slots that nothing is under way in, of one size, and what kernels read in all of them.
#[derive(Debug)]
pub(super) struct Slots {
    /// Words that go up and that come back at most, and that do not come back.
    pub words: usize,
    job: Buffer,
    same: Buffer,
    free: Mutex<Vec<Slot>>,
}

/// Words of a submission that go up, and that come back.
#[derive(Clone, Copy, Debug)]
pub(super) struct Words {
    /// Those that go up for it alone.
    pub own: usize,
    /// Those that come back.
    pub back: usize,
}

/// A submission under way.
pub(super) struct UnderWay {
    slot: Slot,
    words: Words,
    index: SubmissionIndex,
    /// Whether the CPU can read what comes back, and write into the slot again.
    mapped: Receiver<Result<(), BufferAsyncError>>,
}

impl Slots {
    /// Slots for so many bytes, if the GPU takes as many. Kernels read the words that are the `same` for all, among which those of a
    /// rule begin at one, and know how many words a block has: `shaders/job.wgsl`.
    pub fn new(gpu: &Gpu, bytes: u64, same: &[u32], [block_words, rule]: [usize; 2]) -> Slots {
        let filled = |words: &[u32], usage: BufferUsages| {
            let contents = cast_slice(words);
            gpu.device.create_buffer_init(&BufferInitDescriptor { label: Some("the same"), contents, usage })
        };
        Slots {
            words: bytes.min(gpu.storage_bytes / 2) as usize / 4,
            // The first is zero, which no compiler knows.
            job: filled(&[0, block_words as u32, rule as u32], BufferUsages::UNIFORM),
            same: filled(same, BufferUsages::STORAGE),
            free: Mutex::default(),
        }
    }

    /// Bytes of the CPU's memory that so many slots take: what goes up and what comes back.
    pub fn host_bytes(&self, count: usize) -> u64 {
        8 * (count * self.words) as u64
    }

    /// A slot that is free, or a new one.
    pub fn take(&self, gpu: &Gpu) -> Slot {
        let free = self.free.lock().unwrap_or_else(PoisonError::into_inner).pop();
        free.unwrap_or_else(|| {
            let buffer = |label: &str, words: usize, usage: BufferUsages| {
                let (size, mapped_at_creation) = (4 * words as u64, usage.contains(BufferUsages::MAP_WRITE));
                gpu.device.create_buffer(&BufferDescriptor { label: Some(label), size, usage, mapped_at_creation })
            };
            let up = buffer("words on their way", self.words, BufferUsages::MAP_WRITE | BufferUsages::COPY_SRC);
            let own = buffer("words", self.words, BufferUsages::STORAGE | BufferUsages::COPY_DST);
            let planes = buffer("planes", 2 * self.words, BufferUsages::STORAGE | BufferUsages::COPY_SRC);
            let back = buffer("planes read back", self.words, BufferUsages::COPY_DST | BufferUsages::MAP_READ);
            let entries: Vec<BindGroupEntry<'_>> = (0..)
                .zip([&self.job, &self.same, &own, &planes])
                .map(|(binding, buffer)| BindGroupEntry { binding, resource: buffer.as_entire_binding() })
                .collect();
            let descriptor = BindGroupDescriptor { label: None, layout: &gpu.layout, entries: &entries };
            let group = gpu.device.create_bind_group(&descriptor);
            Slot { up, own, planes, back, group }
        })
    }

    /// Keeps the slot of a submission whose values were read.
    pub fn give_back(&self, submission: UnderWay) {
        submission.slot.back.unmap();
        self.free.lock().unwrap_or_else(PoisonError::into_inner).push(submission.slot);
    }
}

impl Slot {
    /// Where words are written that go up, from one on: every second can be the first. `None` when something went wrong.
    pub fn view(&self, first: usize, words: usize) -> Option<BufferViewMut> {
        self.up.get_mapped_range_mut(4 * first as u64..4 * (first + words) as u64).ok()
    }

    /// The commands that take up the words, compute, and copy what comes back where the CPU can read it.
    fn commands(&self, gpu: &Gpu, words: Words, compute: impl FnOnce(&mut ComputePass<'_>)) -> CommandBuffer {
        let mut encoder = gpu.device.create_command_encoder(&CommandEncoderDescriptor::default());
        encoder.copy_buffer_to_buffer(&self.up, 0, &self.own, 0, 4 * words.own as u64);
        {
            let mut pass = encoder.begin_compute_pass(&ComputePassDescriptor::default());
            pass.set_bind_group(0, &self.group, &[]);
            compute(&mut pass);
        }
        if words.back > 0 {
            encoder.copy_buffer_to_buffer(&self.planes, 0, &self.back, 0, 4 * words.back as u64);
        }
        encoder.finish()
    }

    /// Hands what was written to the GPU.
    pub fn submit(self, gpu: &Gpu, words: Words, compute: impl FnOnce(&mut ComputePass<'_>)) -> UnderWay {
        self.up.unmap();
        let index = gpu.queue.submit([self.commands(gpu, words, compute)]);
        let (tell, mapped) = mpsc::channel();
        let told = tell.clone();
        // Nobody listens any more where something else went wrong.
        self.back.map_async(MapMode::Read, ..4 * words.back as u64, move |result| _ = tell.send(result));
        self.up.map_async(MapMode::Write, .., move |result| _ = told.send(result));
        UnderWay { slot: self, words, index, mapped }
    }

    /// How long the GPU computes, without what goes up and comes back: for benchmarks. `compute` is asked to compute so many times.
    pub fn time(
        self,
        gpu: &Gpu,
        own: usize,
        times: u32,
        compute: impl Fn(&mut ComputePass<'_>, u32),
    ) -> Option<Duration> {
        self.up.unmap();
        let spent = |times: u32| {
            let commands = self.commands(gpu, Words { own, back: 0 }, |pass| compute(pass, times));
            let start = Instant::now();
            let submission_index = Some(gpu.queue.submit([commands]));
            gpu.device.poll(PollType::Wait { submission_index, timeout: None }).ok()?;
            Some(start.elapsed())
        };
        // What a submission costs is in both.
        spent(times)?;
        let once = spent(times)?;
        Some(spent(2 * times)?.saturating_sub(once) / times)
    }
}

impl UnderWay {
    /// Waits until it has ended; `None` when something went wrong.
    pub fn wait(&self, gpu: &Gpu) -> Option<()> {
        gpu.device.poll(PollType::Wait { submission_index: Some(self.index.clone()), timeout: None }).ok()?;
        self.mapped.iter().all(|result| result.is_ok()).then_some(())
    }

    /// What has come back, once it was [waited](UnderWay::wait) for.
    pub fn values(&self) -> Option<BufferView> {
        self.slot.back.get_mapped_range(..4 * self.words.back as u64).ok()
    }
}
