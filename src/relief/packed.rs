//! Relief of noise as words, for kernels that run elsewhere: `shaders/relief.wgsl` reads them.

use super::curve::Curve;
use super::noise::{NoiseRelief, Share};
use super::strided::StridedFractal;
use crate::area::Area;
use crate::noise::packed::{BLOCK, put};

/// Relief of noise, packed.
#[derive(Clone, Debug)]
pub(crate) struct PackedRelief {
    /// What is the same for all blocks.
    pub words: Vec<u32>,
    /// Words of a block.
    pub block_words: usize,
}

/// Words that say where a block lies.
const AREA_WORDS: usize = 5;

/// Words of a term.
const TERM_WORDS: usize = 5;

impl NoiseRelief {
    /// The relief as words, and what [`pack_blocks`](NoiseRelief::pack_blocks) adds a block.
    pub(crate) fn pack(&self) -> PackedRelief {
        let mut packed = PackedRelief { words: vec![0; 6 + TERM_WORDS * self.terms.len()], block_words: AREA_WORDS };
        // Offset 0 is where the words begin, and says that something is not there.
        if let Some(warp) = &self.warp {
            packed.words[0] = packed.fractal(&warp.east, false);
            packed.words[1] = packed.fractal(&warp.south, false);
            packed.words[2] = warp.distance_m.to_bits();
        }
        let is_warped = self.warp.is_some();
        packed.words[5] = self.terms.len() as u32;
        for (index, term) in self.terms.iter().enumerate() {
            let fractal = packed.fractal(&term.fractal, is_warped);
            let curve = term.curve.as_ref().map_or(0, |curve| packed.curve(curve));
            let mask = term.mask.as_ref().map_or(0, |mask| packed.share(mask, is_warped));
            packed.words[6 + TERM_WORDS * index..][..TERM_WORDS].copy_from_slice(&[
                fractal,
                curve,
                term.height_m.to_bits(),
                term.base_m.to_bits(),
                mask,
            ]);
        }
        if let Some((share, floor_m)) = &self.land {
            packed.words[3] = packed.share(share, is_warped);
            packed.words[4] = floor_m.to_bits();
        }
        packed
    }

    /// Adds the words of the blocks in which an area lies, whose heights are to begin at `first` of those of several areas; returns
    /// how many blocks there are.
    pub(crate) fn pack_blocks(&self, area: Area, first: u32, words: &mut Vec<u32>) -> usize {
        let [columns, rows] = BLOCK.map(|side| side as i64);
        let is_warped = self.warp.is_some();
        let mut count = 0;
        for y in (area.y0.div_euclid(rows)..=(area.y1 - 1).div_euclid(rows)).map(|y| y * rows) {
            for x in (area.x0.div_euclid(columns)..=(area.x1 - 1).div_euclid(columns)).map(|x| x * columns) {
                let at = [x - area.x0, y - area.y0].map(|at| at as i32 as u32);
                words.extend([at[0], at[1], area.width() as u32, area.height() as u32, first]);
                for (fractal, is_warped) in self.fractals(is_warped) {
                    fractal.pack_block(is_warped, (x, y), words);
                }
                count += 1;
            }
        }
        count
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
