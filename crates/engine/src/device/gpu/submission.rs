//! Submissions and their buffers. Buffers are reused, because creating them takes longer than filling them.

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
use super::bands::KernelJob;

/// The buffers of one submission.
#[derive(Debug)]
pub(super) struct Slot {
    /// Input of the submission: `up` is written by the CPU and copied to `own`, which kernels read.
    up: Buffer,
    own: Buffer,
    /// Planes of values that kernels write, and the buffer from which the CPU reads those that come back.
    planes: Buffer,
    back: Buffer,
    group: BindGroup,
}

/// Free slots, all of one size, and the buffers that all of them share.
#[derive(Debug)]
pub(super) struct Slots {
    /// Size of a slot: the largest number of words that are uploaded, that come back, and that stay on the GPU, each.
    pub words: usize,
    job: Buffer,
    same: Buffer,
    free: Mutex<Vec<Slot>>,
}

/// Numbers of words of one submission.
#[derive(Clone, Copy, Debug)]
pub(super) struct Words {
    /// Words that are uploaded for this submission.
    pub own: usize,
    /// Words that come back.
    pub back: usize,
}

/// A submission that the GPU is working on.
pub(super) struct Submission {
    slot: Slot,
    words: Words,
    index: SubmissionIndex,
    /// Receives the result of mapping both buffers: when both are mapped, the CPU can read the values and refill the
    /// slot.
    mapped: Receiver<Result<(), BufferAsyncError>>,
}

impl Slots {
    /// Creates slots for this many bytes, or fewer if the GPU's buffers are smaller. All kernels share the words in
    /// `same`, among which the ground rule begins at word `rule`, and the number of words per block: see
    /// `shaders/job.wgsl`.
    pub fn new(gpu: &Gpu, bytes: u64, same: &[u32], [block_words, rule]: [usize; 2]) -> Slots {
        let filled = |words: &[u32], usage: BufferUsages| {
            let contents = cast_slice(words);
            gpu.device.create_buffer_init(&BufferInitDescriptor { label: Some("the same"), contents, usage })
        };
        let job = KernelJob { zero: 0, block_words: block_words as u32, rule: rule as u32 };
        Slots {
            words: bytes.min(gpu.storage_bytes / 2) as usize / 4,
            job: filled(cast_slice(&[job]), BufferUsages::UNIFORM),
            same: filled(same, BufferUsages::STORAGE),
            free: Mutex::default(),
        }
    }

    /// Returns the bytes of the CPU's memory that this many slots take: for the words that are uploaded and those that
    /// come back.
    pub fn host_bytes(&self, count: usize) -> u64 {
        8 * (count * self.words) as u64
    }

    /// Takes a free slot, or creates a new one.
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

    /// Returns the slot of a submission, whose values have been read, to the free slots.
    pub fn give_back(&self, submission: Submission) {
        submission.slot.back.unmap();
        self.free.lock().unwrap_or_else(PoisonError::into_inner).push(submission.slot);
    }
}

impl Slot {
    /// Returns a mapped view of the input from word `first` on, which must be an even number. `None` if mapping fails.
    pub fn view(&self, first: usize, words: usize) -> Option<BufferViewMut> {
        self.up.get_mapped_range_mut(4 * first as u64..4 * (first + words) as u64).ok()
    }

    /// Encodes the commands that upload the words, compute, and copy the values that come back to where the CPU can
    /// read them.
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

    /// Submits the written input to the GPU.
    pub fn submit(self, gpu: &Gpu, words: Words, compute: impl FnOnce(&mut ComputePass<'_>)) -> Submission {
        self.up.unmap();
        let index = gpu.queue.submit([self.commands(gpu, words, compute)]);
        let (tell, mapped) = mpsc::channel();
        let told = tell.clone();
        // Sending fails if the receiver was dropped after another error; that is ignored.
        self.back.map_async(MapMode::Read, ..4 * words.back as u64, move |result| _ = tell.send(result));
        self.up.map_async(MapMode::Write, .., move |result| _ = told.send(result));
        Submission { slot: self, words, index, mapped }
    }

    /// Measures the time that the GPU computes, without upload and readback, for benchmarks. `compute` repeats its work
    /// as many times as its second argument says.
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
        // The overhead of a submission is in both measurements and cancels out.
        spent(times)?;
        let once = spent(times)?;
        Some(spent(2 * times)?.saturating_sub(once) / times)
    }
}

impl Submission {
    /// Waits until the submission has ended; `None` if it failed.
    pub fn wait(&self, gpu: &Gpu) -> Option<()> {
        gpu.device.poll(PollType::Wait { submission_index: Some(self.index.clone()), timeout: None }).ok()?;
        self.mapped.iter().all(|result| result.is_ok()).then_some(())
    }

    /// Returns the values that came back. Call [`wait`](Submission::wait) first.
    pub fn values(&self) -> Option<BufferView> {
        self.slot.back.get_mapped_range(..4 * self.words.back as u64).ok()
    }
}
