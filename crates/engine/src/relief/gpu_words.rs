//! Relief of noise packed into 32-bit words for GPU kernels, which read them in `shaders/relief.wgsl`.

use super::curve::Curve;
use super::noise::{NoiseRelief, Share};
use super::strided::StridedFractal;
use crate::area::Area;
use crate::noise::gpu_words::{BLOCK, put};

/// Several reliefs of noise, packed one after the other.
#[derive(Clone, Debug, Default)]
pub(crate) struct PackedRelief {
    /// Words that are the same for all blocks.
    pub words: Vec<u32>,
    /// Number of words per block of the relief that was packed last.
    pub block_words: usize,
}

/// A block of vertices, the unit that the kernels compute.
#[derive(Clone, Copy, Debug)]
pub(crate) struct VertexBlock {
    /// First (north-western) vertex.
    first: (i64, i64),
    /// Area of which the block computes a part.
    area: Area,
    /// Offset of the area's heights in the buffer for several areas.
    heights: u32,
    /// Offset of the packed relief that the heights belong to.
    relief: u32,
}

impl VertexBlock {
    /// Lists the blocks that cover an area. `heights` is the offset of the area's heights, and `relief` that of the
    /// packed relief they belong to.
    pub fn of(area: Area, heights: u32, relief: u32) -> impl Iterator<Item = VertexBlock> {
        let [columns, rows] = BLOCK.map(|side| side as i64);
        let firsts = |from: i64, to: i64, side: i64| {
            (from.div_euclid(side)..=(to - 1).div_euclid(side)).map(move |at| at * side)
        };
        let across = move |y| {
            firsts(area.x0, area.x1, columns).map(move |x| VertexBlock { first: (x, y), area, heights, relief })
        };
        firsts(area.y0, area.y1, rows).flat_map(across)
    }

    /// Returns the number of blocks that cover an area.
    pub fn count(area: Area) -> usize {
        let count = |from: i64, to: i64, side: usize| {
            ((to - 1).div_euclid(side as i64) - from.div_euclid(side as i64) + 1).max(0) as usize
        };
        count(area.x0, area.x1, BLOCK[0]) * count(area.y0, area.y1, BLOCK[1])
    }
}

/// Number of words that describe a block's position.
const AREA_WORDS: usize = 6;

/// Number of words per term.
const TERM_WORDS: usize = 5;

impl NoiseRelief {
    /// Packs the relief and returns its offset; `packed.block_words` is then the number of words that
    /// [`pack_block`](NoiseRelief::pack_block) adds per block.
    pub(crate) fn pack(&self, packed: &mut PackedRelief) -> u32 {
        let root = packed.words.len();
        packed.words.resize(root + 6 + TERM_WORDS * self.terms.len(), 0);
        packed.block_words = AREA_WORDS;
        // No part begins at word 0 of the buffer, so an offset of 0 marks a missing part.
        if let Some(warp) = &self.warp {
            packed.words[root] = packed.fractal(&warp.east, false);
            packed.words[root + 1] = packed.fractal(&warp.south, false);
            packed.words[root + 2] = warp.distance_m.to_bits();
        }
        let is_warped = self.warp.is_some();
        packed.words[root + 5] = self.terms.len() as u32;
        for (index, term) in self.terms.iter().enumerate() {
            let fractal = packed.fractal(&term.fractal, is_warped);
            let curve = term.curve.as_ref().map_or(0, |curve| packed.curve(curve));
            let mask = term.mask.as_ref().map_or(0, |mask| packed.share(mask, is_warped));
            packed.words[root + 6 + TERM_WORDS * index..][..TERM_WORDS].copy_from_slice(&[
                fractal,
                curve,
                term.height_m.to_bits(),
                term.base_m.to_bits(),
                mask,
            ]);
        }
        if let Some((share, floor_m)) = &self.land {
            packed.words[root + 3] = packed.share(share, is_warped);
            packed.words[root + 4] = floor_m.to_bits();
        }
        root as u32
    }

    /// Adds the words of a block.
    pub(crate) fn pack_block(&self, block: &VertexBlock, words: &mut Vec<u32>) {
        let VertexBlock { first: (x, y), area, heights, relief } = *block;
        let at = [x - area.x0, y - area.y0].map(|at| at as i32 as u32);
        words.extend([at[0], at[1], area.width() as u32, area.height() as u32, heights, relief]);
        for (fractal, is_warped) in self.fractals(self.warp.is_some()) {
            fractal.pack_block(is_warped, (x, y), words);
        }
    }

    /// Lists all fractals in the order of packing, each with true if it is evaluated at warped positions.
    fn fractals(&self, is_warped: bool) -> impl Iterator<Item = (&StridedFractal, bool)> {
        let displacements = self.warp.iter().flat_map(|warp| [(&warp.east, false), (&warp.south, false)]);
        let terms = self
            .terms
            .iter()
            .flat_map(|term| std::iter::once(&term.fractal).chain(term.mask.as_ref().map(|mask| &mask.noise)));
        let land = self.land.iter().map(|(share, _)| &share.noise);
        displacements.chain(terms.chain(land).map(move |fractal| (fractal, is_warped)))
    }
}

impl VertexBlock {
    /// Returns the offset of the packed relief that the heights belong to.
    pub fn relief(&self) -> u32 {
        self.relief
    }
}

impl PackedRelief {
    /// Packs a fractal and returns its offset.
    fn fractal(&mut self, fractal: &StridedFractal, is_warped: bool) -> u32 {
        let at = self.words.len() as u32;
        fractal.pack(is_warped, &mut self.words, &mut self.block_words);
        at
    }

    /// Packs a mask and returns its offset.
    fn share(&mut self, share: &Share, is_warped: bool) -> u32 {
        let at = self.words.len() as u32;
        put(&mut self.words, [share.scale, share.shift]);
        self.fractal(&share.noise, is_warped);
        at
    }

    /// Packs a curve and returns its offset.
    fn curve(&mut self, curve: &Curve) -> u32 {
        let at = self.words.len() as u32;
        curve.pack(&mut self.words);
        at
    }
}
