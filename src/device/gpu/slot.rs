//! The buffers of a submission, kept for the next one: to make them takes longer than to fill them.

use std::sync::{Mutex, PoisonError};

use wgpu::{BindGroup, BindGroupDescriptor, BindGroupEntry, Buffer, BufferDescriptor, BufferUsages};

use super::adapter::Gpu;

/// The buffers of a submission.
#[derive(Debug)]
pub(super) struct Slot {
    /// What bands, blocks and lines have for themselves: where the CPU writes it, and where kernels read it.
    pub up: Buffer,
    pub own: Buffer,
    /// Planes of values, and where the CPU can read those that come back.
    pub planes: Buffer,
    pub back: Buffer,
    pub group: BindGroup,
}

/// Slots that nothing is under way in, of one size.
#[derive(Debug)]
pub(super) struct Slots {
    /// Bytes that go up and that come back, each.
    pub bytes: u64,
    free: Mutex<Vec<Slot>>,
}

impl Slots {
    pub fn new(bytes: u64) -> Slots {
        Slots { bytes, free: Mutex::default() }
    }

    /// A slot that is free, or a new one, whose kernels also read what is the same for all.
    pub fn take(&self, gpu: &Gpu, [job, same]: [&Buffer; 2]) -> Slot {
        let free = self.free.lock().unwrap_or_else(PoisonError::into_inner).pop();
        free.unwrap_or_else(|| {
            let buffer = |label: &str, size: u64, usage: BufferUsages| {
                let mapped_at_creation = usage.contains(BufferUsages::MAP_WRITE);
                gpu.device.create_buffer(&BufferDescriptor { label: Some(label), size, usage, mapped_at_creation })
            };
            let up = buffer("words on their way", self.bytes, BufferUsages::MAP_WRITE | BufferUsages::COPY_SRC);
            let own = buffer("words", self.bytes, BufferUsages::STORAGE | BufferUsages::COPY_DST);
            // As much again for what does not come back.
            let planes = buffer("planes", 2 * self.bytes, BufferUsages::STORAGE | BufferUsages::COPY_SRC);
            let back = buffer("planes read back", self.bytes, BufferUsages::COPY_DST | BufferUsages::MAP_READ);
            let entries: Vec<BindGroupEntry<'_>> = (0..)
                .zip([job, same, &own, &planes])
                .map(|(binding, buffer)| BindGroupEntry { binding, resource: buffer.as_entire_binding() })
                .collect();
            let descriptor = BindGroupDescriptor { label: None, layout: &gpu.layout, entries: &entries };
            let group = gpu.device.create_bind_group(&descriptor);
            Slot { up, own, planes, back, group }
        })
    }

    /// Keeps a slot for another submission.
    pub fn give_back(&self, slot: Slot) {
        self.free.lock().unwrap_or_else(PoisonError::into_inner).push(slot);
    }
}
