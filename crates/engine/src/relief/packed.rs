//! Relief of noise as words, for kernels that run elsewhere: `shaders/relief.wgsl` reads them.

use super::curve::Curve;
use super::noise::{NoiseRelief, Share};
use super::strided::StridedFractal;
use crate::area::Area;
use crate::noise::packed::{BLOCK, put};

/// Reliefs of noise, packed one behind the other.
#[derive(Clone, Debug, Default)]
pub(crate) struct PackedRelief {
    /// What is the same for all blocks.
    pub words: Vec<u32>,
    /// Words of a block of the one that was packed last.
    pub block_words: usize,
}

/// A block of vertices, as the kernels compute it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Block {
    /// Its first vertex.
    first: (i64, i64),
    /// The area of which it computes a part.
    area: Area,
    /// Where the area's heights begin among those of several areas.
    heights: u32,
    /// Where the relief begins that they are of.
    relief: u32,
}

impl Block {
    /// The blocks in which an area lies, whose heights begin at `heights` and are those of the relief that begins at `relief`.
    pub fn of(area: Area, heights: u32, relief: u32) -> impl Iterator<Item = Block> {
        let [columns, rows] = BLOCK.map(|side| side as i64);
        let firsts = |from: i64, to: i64, side: i64| {
            (from.div_euclid(side)..=(to - 1).div_euclid(side)).map(move |at| at * side)
        };
        let across =
            move |y| firsts(area.x0, area.x1, columns).map(move |x| Block { first: (x, y), area, heights, relief });
        firsts(area.y0, area.y1, rows).flat_map(across)
    }

    /// How many blocks an area lies in.
    pub fn count(area: Area) -> usize {
        let count = |from: i64, to: i64, side: usize| {
            ((to - 1).div_euclid(side as i64) - from.div_euclid(side as i64) + 1).max(0) as usize
        };
        count(area.x0, area.x1, BLOCK[0]) * count(area.y0, area.y1, BLOCK[1])
    }
}

/// Words that say where a block lies.
const AREA_WORDS: usize = 6;

/// Words of a term.
const TERM_WORDS: usize = 5;

impl NoiseRelief {
    /// Adds the relief as words, and says where it begins; then `packed` knows how many [`pack_block`](NoiseRelief::pack_block) adds.
    pub(crate) fn pack(&self, packed: &mut PackedRelief) -> u32 {
        let root = packed.words.len();
        packed.words.resize(root + 6 + TERM_WORDS * self.terms.len(), 0);
        packed.block_words = AREA_WORDS;
        // No part begins with the first word of all: 0 says that it is not there.
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
    pub(crate) fn pack_block(&self, block: &Block, words: &mut Vec<u32>) {
        let Block { first: (x, y), area, heights, relief } = *block;
        let at = [x - area.x0, y - area.y0].map(|at| at as i32 as u32);
        words.extend([at[0], at[1], area.width() as u32, area.height() as u32, heights, relief]);
        for (fractal, is_warped) in self.fractals(self.warp.is_some()) {
            fractal.pack_block(is_warped, (x, y), words);
        }
    }

    /// All fractals in the order in which they are packed, and whether they are read at warped places.
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

impl Block {
    /// Where the relief begins that its heights are of.
    pub fn relief(&self) -> u32 {
        self.relief
    }
}

impl PackedRelief {
    /// Adds a fractal, and says where it is.
    fn fractal(&mut self, fractal: &StridedFractal, is_warped: bool) -> u32 {
        let at = self.words.len() as u32;
        fractal.pack(is_warped, &mut self.words, &mut self.block_words);
        at
    }

    /// Adds a share, and says where it is.
    fn share(&mut self, share: &Share, is_warped: bool) -> u32 {
        let at = self.words.len() as u32;
        put(&mut self.words, [share.scale, share.shift]);
        self.fractal(&share.noise, is_warped);
        at
    }

    /// Adds a curve, and says where it is.
    fn curve(&mut self, curve: &Curve) -> u32 {
        let at = self.words.len() as u32;
        curve.pack(&mut self.words);
        at
    }
}
