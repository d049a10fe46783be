//! The ground of a map on a GPU, with the bits of the CPU: `shaders/ground.wgsl`.

use std::sync::{Arc, OnceLock};

use bytemuck::cast_slice;
use wgpu::{ComputePass, ComputePipeline};

use crate::area::Area;
use crate::device::gpu::{Gpu, Shader, Slots, TABLE, Words};
use crate::grid::Grid;
use crate::map::light::CHUNK;
use crate::map::relief::{Ground, LEVELS, Relief};
use crate::map::signs;
use crate::map::sky;
use crate::map::terrain::{Nodes, Terrain};
use crate::noise::packed::put;

/// The ground of maps in one style and scale, on a GPU.
#[derive(Debug)]
pub(super) struct GroundKernel {
    gpu: Arc<Gpu>,
    kernels: Kernels,
    slots: Slots,
    looks_up: bool,
    has_stones: bool,
    /// Whether the first block had the bits of the CPU.
    is_right: OnceLock<bool>,
}

/// The kernels, in their order.
#[derive(Debug)]
struct Kernels {
    heights: ComputePipeline,
    covers_of: ComputePipeline,
    stones: ComputePipeline,
    /// Across and down of each level of detail.
    smooth: Vec<[ComputePipeline; 2]>,
    sky_heights: ComputePipeline,
    openness: ComputePipeline,
    lowest: ComputePipeline,
    light: ComputePipeline,
}

/// Bytes of a submission at most that go up, and that come back: room for blocks of half a node a pixel.
const SUBMISSION_BYTES: u64 = 16 << 20;

/// Planes of nodes: four of what covers the ground, snow, rock and scree.
const COVERS: usize = 7;

/// A block as it goes up.
struct Packed {
    words: Vec<u32>,
    wide: Area,
    stones: Area,
    nodes: [usize; 2],
    sky: [usize; 2],
    back: usize,
}

impl GroundKernel {
    /// The ground of a map on a GPU.
    pub fn new(gpu: Arc<Gpu>, relief: &Relief) -> GroundKernel {
        let module = gpu.module(Shader::Ground);
        let kernel = |entry: &str| gpu.kernel(&module, entry, &[]);
        let smooth = |level: usize| {
            ["smooth_across", "smooth_down"].map(|entry| gpu.kernel(&module, entry, &[("LEVEL", level as f64)]))
        };
        let kernels = Kernels {
            heights: kernel("heights"),
            covers_of: kernel("covers_of"),
            stones: kernel("stones"),
            smooth: (0..LEVELS).map(smooth).collect(),
            sky_heights: kernel("sky_heights"),
            openness: kernel("openness"),
            lowest: kernel("lowest"),
            light: kernel("light"),
        };
        let mut words = Vec::new();
        relief.pack(&mut words);
        let slots = Slots::new(&gpu, SUBMISSION_BYTES, &words, [0, 0]);
        let (looks_up, has_stones) = (relief.looks_up(), relief.has_stones());
        GroundKernel { gpu, kernels, slots, looks_up, has_stones, is_right: OnceLock::new() }
    }

    /// The ground at the pixels of an area, given the nodes under it and [what is around](Relief::wide) it; `None` where the GPU
    /// cannot make it, or makes another one. The first is compared with what `reference` makes.
    pub fn ground(
        &self,
        (terrain, nodes): (&Terrain, &Nodes),
        wide: Area,
        area: Area,
        reference: impl FnOnce() -> Ground,
    ) -> Option<Ground> {
        if self.is_right.get() == Some(&false) {
            return None;
        }
        let made = self.made((terrain, nodes), wide, area)?;
        self.is_right.get_or_init(|| made == reference()).then_some(made)
    }

    /// What is wrong with it, if anything is.
    pub fn trouble(&self) -> Option<String> {
        let is_wrong = self.is_right.get() == Some(&false);
        is_wrong.then(|| format!("{} makes other pixels than the CPU", self.gpu.name))
    }

    /// The ground as the GPU makes it.
    fn made(&self, (terrain, nodes): (&Terrain, &Nodes), wide: Area, area: Area) -> Option<Ground> {
        if self.gpu.trouble().is_some() {
            return None;
        }
        let packed = self.pack((terrain, nodes), wide, area)?;
        let slot = self.slots.take(&self.gpu);
        let count = packed.words.len();
        slot.view(0, count.next_multiple_of(2))?.slice(..4 * count).copy_from_slice(cast_slice(&packed.words));
        let words = Words { own: count, back: packed.back };
        let submission = slot.submit(&self.gpu, words, |pass| self.compute(pass, &packed, area));
        submission.wait(&self.gpu)?;
        let ground = self.read(cast_slice(&submission.values()?), &packed, area);
        self.slots.give_back(submission);
        self.gpu.trouble().is_none().then_some(ground)
    }

    /// The words of a block; `None` where they, or its planes, are more than a submission takes.
    fn pack(&self, (terrain, nodes): (&Terrain, &Nodes), wide: Area, area: Area) -> Option<Packed> {
        let stones = area.padded(signs::REACH);
        let under = nodes.heights.area();
        let sky = sky::nodes(area);
        let mut words = vec![0; TABLE];
        let mut put_splines = |pixels: std::ops::Range<i64>, from: i64| {
            let at = words.len();
            for pixel in pixels {
                let (first, weights) = terrain.spline(pixel);
                words.push((first - from) as u32);
                put(&mut words, weights);
            }
            at
        };
        let columns = put_splines(wide.x0..wide.x1, under.x0);
        let rows = put_splines(wide.y0..wide.y1, under.y0);
        let heights = words.len();
        put(&mut words, nodes.heights.values().iter().copied());
        let ground = words.len();
        words.extend_from_slice(nodes.ground.values());
        let cover = words.len();
        words.extend_from_slice(nodes.cover.values());
        let mut planes = 0;
        let mut plane = |count: usize| {
            planes += count;
            planes - count
        };
        let back_planes = [
            plane(wide.len()),
            plane(area.len()),
            plane(area.len()),
            plane(if self.has_stones { 2 * stones.len() } else { 0 }),
        ];
        let back = plane(0);
        let left_planes = [
            plane(wide.len()),
            plane(wide.len()),
            plane(wide.len()),
            plane(wide.len()),
            plane(COVERS * under.len()),
            plane(sky.len()),
            plane(sky.len()),
            plane(area.height() * area.width().div_ceil(CHUNK)),
        ];
        let step = sky::STEP;
        let numbers = [wide.width(), wide.height(), (area.x0 - wide.x0) as usize, area.width(), area.height()]
            .into_iter()
            .chain([under.width(), under.height(), columns, rows, heights, ground, cover, sky.width(), sky.height()])
            .chain([sky.x0 * step - wide.x0, sky.y0 * step - wide.y0].map(|pixels| pixels.max(0) as usize))
            .chain([area.x0 - sky.x0 * step, area.y0 - sky.y0 * step].map(|pixels| pixels as usize))
            .chain([usize::from(self.looks_up), signs::REACH])
            .chain(back_planes)
            .chain(left_planes);
        for (word, number) in words.iter_mut().zip(numbers) {
            *word = number as u32;
        }
        let fits = words.len().max(back) < self.slots.words && plane(0) <= 2 * self.slots.words;
        let (nodes, sky) = ([under.width(), under.height()], [sky.width(), sky.height()]);
        fits.then_some(Packed { words, wide, stones, nodes, sky, back })
    }

    /// Kernel after kernel.
    fn compute(&self, pass: &mut ComputePass<'_>, packed: &Packed, area: Area) {
        let kernels = &self.kernels;
        let mut over = |kernel: &ComputePipeline, [across, down]: [usize; 2]| {
            let [columns, rows] = [across, down].map(|count| (count as u32).div_ceil(self.gpu.group_side));
            pass.set_pipeline(kernel);
            pass.dispatch_workgroups(columns, rows, 1);
        };
        let sides = |area: Area| [area.width(), area.height()];
        over(&kernels.heights, sides(packed.wide));
        over(&kernels.covers_of, packed.nodes);
        if self.has_stones {
            over(&kernels.stones, sides(packed.stones));
        }
        for kernel in kernels.smooth.iter().flatten() {
            over(kernel, sides(packed.wide));
        }
        if self.looks_up {
            over(&kernels.sky_heights, packed.sky);
            over(&kernels.openness, packed.sky);
        }
        over(&kernels.lowest, [area.width().div_ceil(CHUNK), area.height()]);
        over(&kernels.light, sides(area));
    }

    /// The ground of what has come back.
    fn read(&self, words: &[u32], packed: &Packed, area: Area) -> Ground {
        let mut left = words;
        let mut take = |area: Area| {
            let (plane, rest) = left.split_at(area.len());
            left = rest;
            plane
        };
        let floats = |plane: &[u32], area: Area| {
            let mut grid = Grid::filled(area, 0.0);
            grid.values_mut().copy_from_slice(cast_slice(plane));
            grid
        };
        let heights = floats(take(packed.wide), packed.wide);
        let mut pixels = Grid::filled(area, 0);
        pixels.values_mut().copy_from_slice(take(area));
        let snow = floats(take(area), area);
        let stones = self.has_stones.then(|| [(); 2].map(|()| floats(take(packed.stones), packed.stones)));
        Ground { area, pixels, heights, snow, stones }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::Cpu;
    use crate::device::gpu::{Arithmetic, adapters};
    use crate::map::scale::Scale;
    use crate::map::style::Style;
    use crate::preset::Preset;
    use crate::world::World;

    #[test]
    fn pixels_have_the_bits_of_the_cpu() {
        let Some(adapter) = adapters().into_iter().next() else {
            return eprintln!("SKIPPED: no GPU, and no program that does as if it were one");
        };
        let gpu = Arc::new(Gpu::open(&adapter, 16, Arithmetic::Exact).expect("a GPU that can be opened"));
        let mut preset = Preset::load("mountains").expect("it is built in").1;
        // Shores, so steep and so level, and ground of all kinds.
        preset.sea_level_m = Some(1200.0);
        preset.ground.sand_m = Some([2.0, 8.0]);
        preset.ground.scree = Some([0.3, 0.9]);
        preset.ground.forest_m = Some([1250.0, 1500.0]);
        let world = World::new(preset, Some(8)).expect("it is sound").with_tile_cells(Terrain::TILE_CELLS);
        let world = Arc::new(world);
        for style in ["topographic", "relief"] {
            let style = Style::load(style).expect("it is built in");
            let scale = Scale { metres_per_pixel: 0.7 * world.spacing_m(), pixels_per_mm: 8.0 };
            let terrain = Terrain::new(Arc::clone(&world), Cpu::maker(world.relief()), scale);
            let relief = Relief::new(&style, &world, scale);
            let kernel = GroundKernel::new(Arc::clone(&gpu), &relief);
            for area in [Area::new(0, 0, 512, 512), Area::new(-512, 1 << 20, 512, 512), Area::new(-8, 64, 300, 77)] {
                let wide = relief.wide(area);
                let nodes = terrain.nodes(wide);
                let expected = relief.ground_of(&terrain, &nodes, wide, area);
                let made = kernel.made((&terrain, &nodes), wide, area).expect("the GPU makes it");
                let differs = |what: &str, one: &Grid<f32>, other: &Grid<f32>| {
                    let at = one.area().vertices().find(|(x, y)| one.at(*x, *y) != other.at(*x, *y));
                    assert!(
                        at.is_none(),
                        "{what} of {area:?} at {at:?}: {:?}",
                        at.map(|(x, y)| [one, other].map(|it| it.at(x, y)))
                    );
                };
                differs("height", &made.heights, &expected.heights);
                differs("snow", &made.snow, &expected.snow);
                for (one, other) in made.stones.iter().flatten().zip(expected.stones.iter().flatten()) {
                    differs("stones", one, other);
                }
                let pixels = made.pixels.values().iter().zip(expected.pixels.values());
                let pixels: Vec<_> = pixels.enumerate().filter(|(_, (one, other))| one != other).collect();
                assert!(
                    pixels.is_empty(),
                    "{} pixels of {area:?}: {:x?}",
                    pixels.len(),
                    &pixels[..pixels.len().min(9)]
                );
                assert!(made == expected);
                assert_eq!(gpu.trouble(), None);
            }
        }
    }
}
