//! Relief of noise packed into 32-bit words for GPU kernels, which read them in `shaders/relief.wgsl`.

use bytemuck::{Zeroable, cast_slice};

use super::curve::Curve;
use super::noise::{NoiseRelief, Share};
use super::strided::StridedFractal;
use crate::area::Area;
use crate::noise::gpu_words::BLOCK;
use crate::wgsl::push;

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

kernel_words! {
    /// A block: position of its first vertex in its area, the size of the area, the offset of the area's heights, and
    /// the offset of the relief. The block's words of each octave follow it.
    struct BlockWords in own, BLOCK_WORDS { first: [i32; 2], width: u32, height: u32, heights: u32, relief: u32 }

    /// A relief: offsets of the warp's fractals and of the mask of land, each 0 if there is none, and the number of
    /// terms, which follow it.
    struct ReliefWords in same, RELIEF_WORDS {
        east: u32, south: u32, distance_m: f32, land: u32, floor_m: f32, terms: u32,
    }

    /// A term, with the offsets of its parts.
    struct TermWords in same, TERM_WORDS { fractal: u32, curve: u32, height_m: f32, base_m: f32, mask: u32 }

    /// A mask. Its noise follows it.
    struct ShareWords in same, SHARE_WORDS { scale: f32, shift: f32 }

    /// The mean of a fractal, which follows it: 1 if there is one, the map to it, and the bounds.
    struct MeanWords in same, MEAN_WORDS { is_meant: u32, scale: f32, shift: f32, low: f32, high: f32 }

    /// A curve: its first output, its bounds, and the number of ramps, which follow it.
    struct CurveWords in same, CURVE_WORDS { start: f32, low: f32, high: f32, ramps: u32 }

    struct RampWords in same, RAMP_WORDS { begin: f32, width: f32, slope: f32 }
}

impl NoiseRelief {
    /// Packs the relief and returns its offset; `packed.block_words` is then the number of words that
    /// [`pack_block`](NoiseRelief::pack_block) adds per block.
    pub(crate) fn pack(&self, packed: &mut PackedRelief) -> u32 {
        let root = packed.words.len();
        let mut terms = vec![TermWords::zeroed(); self.terms.len()];
        // No part begins at word 0 of the buffer, so an offset of 0 marks a missing part.
        let mut own = ReliefWords { terms: terms.len() as u32, ..ReliefWords::zeroed() };
        let first = root + RELIEF_WORDS;
        packed.words.resize(first + TERM_WORDS * terms.len(), 0);
        packed.block_words = BLOCK_WORDS;
        if let Some(warp) = &self.warp {
            own.east = packed.fractal(&warp.east, false);
            own.south = packed.fractal(&warp.south, false);
            own.distance_m = warp.distance_m;
        }
        let is_warped = self.warp.is_some();
        for (term, words) in self.terms.iter().zip(&mut terms) {
            *words = TermWords {
                fractal: packed.fractal(&term.fractal, is_warped),
                curve: term.curve.as_ref().map_or(0, |curve| packed.curve(curve)),
                height_m: term.height_m,
                base_m: term.base_m,
                mask: term.mask.as_ref().map_or(0, |mask| packed.share(mask, is_warped)),
            };
        }
        if let Some((share, floor_m)) = &self.land {
            own.land = packed.share(share, is_warped);
            own.floor_m = *floor_m;
        }
        packed.words[root..first].copy_from_slice(cast_slice(&[own]));
        packed.words[first..][..TERM_WORDS * terms.len()].copy_from_slice(cast_slice(&terms));
        root as u32
    }

    /// Adds the words of a block.
    pub(crate) fn pack_block(&self, block: &VertexBlock, words: &mut Vec<u32>) {
        let VertexBlock { first: (x, y), area, heights, relief } = *block;
        let first = [x - area.x0, y - area.y0].map(|at| at as i32);
        let (width, height) = (area.width() as u32, area.height() as u32);
        push(words, BlockWords { first, width, height, heights, relief });
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
        push(&mut self.words, ShareWords { scale: share.scale, shift: share.shift });
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
