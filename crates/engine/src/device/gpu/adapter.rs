//! GPUs: a list of those available, and one of them opened, with compiled kernels.

use std::num::NonZeroU64;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use pollster::block_on;
use wgpu::{
    BindGroupLayout, BindGroupLayoutDescriptor, BindGroupLayoutEntry, BindingType, BufferBindingType, ComputePipeline,
    ComputePipelineDescriptor, Device, DeviceDescriptor, DeviceType, Instance, InstanceDescriptor, Limits,
    PipelineCompilationOptions, PipelineLayout, PipelineLayoutDescriptor, Queue, ShaderModule, ShaderModuleDescriptor,
    ShaderSource, ShaderStages,
};

use super::bands::{self, JOB_WORDS};
use crate::tile::{self, RUBBLE_REACH, RUBBLE_STEPS};
use crate::{lines, noise, relief};

/// Arithmetic of all shaders: sums, products, quotients and roots with the bits of the CPU.
pub(super) const EXACT: &str = include_str!(concat!(env!("TERRANE_SHADERS"), "/exact.wgsl"));

/// An available GPU, or a software implementation of one.
#[derive(Clone, Debug)]
pub struct Adapter(wgpu::Adapter);

/// Returns all GPUs that can be reached, the best first.
pub fn adapters() -> Vec<Adapter> {
    let instance = Instance::new(InstanceDescriptor::new_without_display_handle());
    let mut adapters: Vec<Adapter> =
        block_on(instance.enumerate_adapters(wgpu::Backends::PRIMARY)).into_iter().map(Adapter).collect();
    // A stable sort: GPUs of one type stay in the system's order.
    adapters.sort_by_key(|adapter| match adapter.0.get_info().device_type {
        DeviceType::DiscreteGpu => 0,
        DeviceType::IntegratedGpu => 1,
        DeviceType::VirtualGpu => 2,
        DeviceType::Other => 3,
        DeviceType::Cpu => 4,
    });
    adapters
}

impl Adapter {
    /// Returns the adapter's name.
    pub fn name(&self) -> String {
        self.0.get_info().name
    }

    /// Returns the graphics API and the name of the driver.
    pub fn driver(&self) -> String {
        let info = self.0.get_info();
        let words = [info.driver, info.driver_info].into_iter().filter(|word| !word.is_empty());
        let driver = words.collect::<Vec<_>>().join(" ");
        format!("{:?}, {driver}", info.backend)
    }

    /// True for a software implementation on the CPU, which is slower than making land on the CPU directly.
    pub fn is_software(&self) -> bool {
        self.0.get_info().device_type == DeviceType::Cpu
    }

    /// Returns the size in bytes of the largest buffer that a kernel can read or write.
    pub fn buffer_bytes(&self) -> u64 {
        storage_bytes(&self.0.limits())
    }

    /// Returns the largest number of threads in a workgroup.
    pub fn group_threads(&self) -> u32 {
        group_threads(&self.0.limits())
    }
}

/// The kernels that make a tile of land, in the order in which they run.
#[derive(Debug)]
pub(super) struct Kernels {
    /// Carves lines into the land.
    pub carve: ComputePipeline,
    /// Rock, and the rounds in which rubble spreads downhill from it, each with the number of vertices that it computes
    /// beyond the tile on each side.
    pub rock: (ComputePipeline, usize),
    pub spread: Vec<(ComputePipeline, usize)>,
    /// Computes normals, slopes and the materials of the ground.
    pub surface: ComputePipeline,
}

/// An opened GPU, ready to compute.
#[derive(Debug)]
pub struct Gpu {
    /// Name of the adapter.
    pub name: String,
    /// Creates buffers and kernels.
    pub(super) device: Device,
    pub(super) queue: Queue,
    pub(super) layout: BindGroupLayout,
    pipeline_layout: PipelineLayout,
    kernels: OnceLock<Kernels>,
    fill: ComputePipeline,
    /// Side of a workgroup in threads.
    pub group_side: u32,
    /// Size of the largest buffer in bytes.
    pub(super) storage_bytes: u64,
    trouble: Arc<Mutex<Option<String>>>,
}

impl Gpu {
    /// Opens a GPU with workgroups of `group_side` by `group_side` threads: 8, 16 or 32 to a side.
    ///
    /// # Errors
    /// A sentence that names the limit of the GPU that is exceeded, or the reason why it cannot be opened.
    pub fn open(adapter: &Adapter, group_side: u32) -> Result<Gpu, String> {
        let name = adapter.name();
        let limits = adapter.0.limits();
        let (threads, most) = (group_side * group_side, group_threads(&limits));
        if threads > most || group_side > limits.max_compute_workgroup_size_x.min(limits.max_compute_workgroup_size_y) {
            return Err(format!("{name} takes groups of at most {most} threads, not {group_side} x {group_side}"));
        }
        let descriptor = DeviceDescriptor { required_limits: limits.clone(), ..DeviceDescriptor::default() };
        let opened = block_on(adapter.0.request_device(&descriptor));
        let (device, queue) = opened.map_err(|error| format!("{name} cannot be opened: {error}"))?;
        // From here on errors are recorded as trouble, and the CPU takes over.
        let trouble = Arc::new(Mutex::new(None));
        let kept = Arc::clone(&trouble);
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| keep(&kept, first_line(&error))));
        let kept = Arc::clone(&trouble);
        device.set_device_lost_callback(move |_, message| keep(&kept, message));
        let binding = |binding: u32, ty: BufferBindingType, bytes: u64| BindGroupLayoutEntry {
            binding,
            visibility: ShaderStages::COMPUTE,
            ty: BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: NonZeroU64::new(bytes) },
            count: None,
        };
        let layout = device.create_bind_group_layout(&BindGroupLayoutDescriptor {
            label: None,
            entries: &[
                binding(0, BufferBindingType::Uniform, 4 * JOB_WORDS as u64),
                binding(1, BufferBindingType::Storage { read_only: true }, 4),
                binding(2, BufferBindingType::Storage { read_only: true }, 4),
                binding(3, BufferBindingType::Storage { read_only: false }, 4),
            ],
        });
        let pipeline_layout = device.create_pipeline_layout(&PipelineLayoutDescriptor {
            label: None,
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        let parts = Parts { device: &device, layout: &pipeline_layout, group_side };
        let fill = parts.kernel(&parts.module(Shader::Relief), "fill", &[]);
        let storage_bytes = storage_bytes(&limits);
        let gpu = Gpu {
            name,
            device,
            queue,
            layout,
            pipeline_layout,
            kernels: OnceLock::new(),
            fill,
            group_side,
            storage_bytes,
            trouble,
        };
        gpu.trouble().map_or(Ok(gpu), Err)
    }

    fn parts(&self) -> Parts<'_> {
        let Gpu { device, pipeline_layout, group_side, .. } = self;
        Parts { device, layout: pipeline_layout, group_side: *group_side }
    }

    /// Returns the kernel that makes heights of noise.
    pub(super) fn fill(&self) -> &ComputePipeline {
        &self.fill
    }

    /// Returns the kernels that make a tile. They are compiled at the first call.
    pub(super) fn kernels(&self) -> &Kernels {
        self.kernels.get_or_init(|| {
            let parts = self.parts();
            let tile = parts.module(Shader::Tile);
            let mut left = RUBBLE_REACH;
            let spread = |(number, step): (usize, usize)| {
                left -= step;
                let numbers = [("STEP", step as f64), ("LEFT", left as f64), ("ROUND", number as f64)];
                (parts.kernel(&tile, "spread", &numbers), left)
            };
            Kernels {
                spread: RUBBLE_STEPS.into_iter().enumerate().map(spread).collect(),
                carve: parts.kernel(&tile, "carve", &[]),
                rock: (parts.kernel(&tile, "rock", &[]), RUBBLE_REACH),
                surface: parts.kernel(&tile, "surface", &[]),
            }
        })
    }

    /// Destroys the device, as if the driver had lost it.
    #[cfg(test)]
    pub(super) fn lose(&self) {
        self.device.destroy();
    }

    /// Records that the GPU cannot be used any more, with the reason, unless an earlier reason is recorded.
    pub(super) fn give_up(&self, why: &str) {
        keep(&self.trouble, why.into());
    }

    /// Returns the first error, if there was one. Then no result of this GPU may be used.
    pub fn trouble(&self) -> Option<String> {
        self.trouble
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .as_ref()
            .map(|what| format!("{}: {what}", self.name))
    }
}

/// The objects with which kernels are compiled.
struct Parts<'a> {
    device: &'a Device,
    layout: &'a PipelineLayout,
    group_side: u32,
}

impl Parts<'_> {
    fn module(&self, shader: Shader) -> ShaderModule {
        let source = ShaderSource::Wgsl(shader.source().into());
        self.device.create_shader_module(ShaderModuleDescriptor { label: Some(shader.name()), source })
    }

    /// Compiles a kernel, with `numbers` as its override constants.
    fn kernel(&self, module: &ShaderModule, entry: &str, numbers: &[(&str, f64)]) -> ComputePipeline {
        let side = ("SIDE", f64::from(self.group_side));
        let constants: Vec<(&str, f64)> = std::iter::once(side).chain(numbers.iter().copied()).collect();
        self.device.create_compute_pipeline(&ComputePipelineDescriptor {
            label: Some(entry),
            layout: Some(self.layout),
            module,
            entry_point: Some(entry),
            compilation_options: PipelineCompilationOptions {
                constants: &constants,
                zero_initialize_workgroup_memory: false,
            },
            cache: None,
        })
    }
}

/// Records an error, if it is the first.
fn keep(trouble: &Mutex<Option<String>>, what: String) {
    trouble.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(what);
}

/// A shader with one or more kernels.
#[derive(Clone, Copy, Debug)]
pub(super) enum Shader {
    /// Makes land of noise.
    Relief,
    /// Carves lines, and makes normals and ground weights of tiles.
    Tile,
}

impl Shader {
    #[cfg(test)]
    pub(super) const ALL: [Shader; 2] = [Shader::Relief, Shader::Tile];

    fn name(self) -> &'static str {
        match self {
            Shader::Relief => "relief",
            Shader::Tile => "tile",
        }
    }

    /// Returns the complete source text for the compiler.
    pub fn source(self) -> String {
        let kernels = match self {
            Shader::Relief => include_str!(concat!(env!("TERRANE_SHADERS"), "/relief.wgsl")),
            Shader::Tile => include_str!(concat!(env!("TERRANE_SHADERS"), "/tile.wgsl")),
        };
        [&inputs(), EXACT, kernels].join("\n")
    }
}

/// Returns the inputs of all kernels as WGSL, with the structs and constants that Rust has too.
pub(super) fn inputs() -> String {
    let job = include_str!(concat!(env!("TERRANE_SHADERS"), "/job.wgsl"));
    [
        bands::wgsl(),
        noise::gpu_words::wgsl(),
        relief::gpu_words::wgsl(),
        lines::gpu_words::wgsl(),
        tile::wgsl(),
        job.into(),
    ]
    .concat()
}

fn storage_bytes(limits: &Limits) -> u64 {
    limits.max_storage_buffer_binding_size.min(limits.max_buffer_size)
}

fn group_threads(limits: &Limits) -> u32 {
    limits.max_compute_invocations_per_workgroup
}

/// Returns the first line of an error message; further lines only tell where in wgpu it occurred.
fn first_line(error: &wgpu::Error) -> String {
    error.to_string().lines().next().unwrap_or_default().to_owned()
}
