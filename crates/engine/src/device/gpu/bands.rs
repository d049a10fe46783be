//! Jobs for a GPU, divided into bands of rows, and bands grouped into submissions.

use super::submission::Slots;
use crate::area::Area;
use crate::relief::VertexBlock;
use crate::tile::RUBBLE_REACH;

/// A job: land, and optionally a tile on it.
#[derive(Clone, Debug)]
pub(super) struct LandJob {
    /// Vertices whose land is requested.
    pub land: Area,
    /// Vertices of the tile. The land extends around them as far as the tile's ground depends on it.
    pub cells: Option<Area>,
    /// Packed lines that shape the land ([`pack`](crate::lines::gpu_words::pack)); empty if there are none.
    pub lines: Vec<u32>,
}

impl LandJob {
    /// Returns the number of planes that come back of the land's vertices, and of the tile's.
    pub fn planes(&self) -> [usize; 2] {
        [1 + IMPRINT_PLANES * usize::from(!self.lines.is_empty()), SURFACE_PLANES * usize::from(self.cells.is_some())]
    }
}

/// Number of planes of a tile's vertices: three axes of normals, the slope, and two words of weights.
pub(super) const SURFACE_PLANES: usize = 6;

/// Number of planes of an imprint: cut, sand, water and dirt.
pub(super) const IMPRINT_PLANES: usize = 4;

kernel_words! {
    /// The input of all kernels: zero, which no compiler can know (see `shaders/exact.wgsl`); the number of words per
    /// block; and the offset of the ground rule in the words that all submissions share.
    struct KernelJob in own, JOB_WORDS { zero: u32, block_words: u32, rule: u32 }

    /// A band in the table of bands. First its land: offset of the plane, width and height; then position in this land,
    /// width and height of the tile, and offset of the tile's planes. `noise` and `rubble` are offsets of planes.
    /// `lines` is the offset of the lines, or 0 without any; `row` the row of the lines' area in which the band begins;
    /// `imprint` the offset of the imprint's planes.
    struct BandWords in own, BAND_WORDS {
        land: u32, width: u32, height: u32,
        pad: [u32; 2], cells: [u32; 2], out: u32,
        noise: u32, rubble: [u32; 2],
        lines: u32, row: u32, imprint: u32,
    }

    const TABLE: u32;
}

/// Largest number of bands in a submission, for which the table of bands has room.
pub(super) const BANDS: usize = 64;

/// Number of words in the table of bands, which is the first part of the upload.
pub(super) const TABLE: usize = BANDS * BAND_WORDS;

/// Largest number of workgroups along an axis that every adapter accepts.
const MOST_BLOCKS: usize = 65_535;

/// Number of rows by which a band grows while there is room.
const ROWS: i64 = crate::noise::gpu_words::BLOCK[1] as i64;

/// Inputs of the tiles' ground other than land: noise, and rubble.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct LooksAround {
    pub noise: bool,
    pub rubble: bool,
}

/// Some rows of a job.
#[derive(Clone, Copy, Debug)]
pub(super) struct Band {
    /// Index of the job.
    pub job: usize,
    /// Land that is made for the band, which may overlap that of its neighbours, and the rows of it that are kept.
    pub land: Area,
    pub kept: Area,
    /// Vertices of the tile; empty if no tile is requested.
    pub cells: Area,
    /// Number of planes that come back of the land's vertices, and of the tile's.
    pub planes: [usize; 2],
    /// Number of words of the packed lines.
    lines: usize,
}

impl Band {
    /// Makes the band of a job's rows from `y0` to `y1`: rows of its tile, or of its land if it has no tile.
    fn new(number: usize, job: &LandJob, y0: i64, y1: i64) -> Band {
        let land = job.land;
        let (planes, lines) = (job.planes(), job.lines.len());
        let Some(cells) = job.cells else {
            let land = Area { y0, y1, ..land };
            return Band { job: number, land, kept: land, cells: Area { y1: y0, ..land }, planes, lines };
        };
        let (north, south) = (cells.y0 - land.y0, land.y1 - cells.y1);
        let from = if y0 == cells.y0 { land.y0 } else { y0 };
        let to = if y1 == cells.y1 { land.y1 } else { y1 };
        Band {
            job: number,
            land: Area { y0: y0 - north, y1: y1 + south, ..land },
            kept: Area { y0: from, y1: to, ..land },
            cells: Area { y0, y1, ..cells },
            planes,
            lines,
        }
    }

    /// Returns the number of words in all planes that come back.
    pub fn back_words(&self) -> usize {
        self.planes[0] * self.land.len() + self.planes[1] * self.cells.len()
    }

    /// Splits the band's part off the planes of its job. Bands before it must have taken theirs.
    pub fn split_off<'a>(&self, left: &mut [&'a mut [u32]]) -> Vec<&'a mut [u32]> {
        let of_land = std::iter::repeat_n(self.kept.len(), self.planes[0]);
        let counts = of_land.chain(std::iter::repeat_n(self.cells.len(), self.planes[1]));
        let parts = left.iter_mut().zip(counts).map(|(plane, count)| plane.split_off_mut(..count));
        parts.map(|part| part.expect("a band is a part of its job")).collect()
    }

    /// Returns the vertices of a plane of rubble.
    pub fn rubble(&self) -> Area {
        self.cells.padded(RUBBLE_REACH)
    }

    fn cost(&self, looks: LooksAround) -> SubmissionCost {
        let noise = usize::from(looks.noise);
        SubmissionCost {
            blocks: VertexBlock::count(self.land) + noise * VertexBlock::count(self.cells),
            lines: self.lines + 1,
            back: self.back_words(),
            left: noise * self.cells.len() + 2 * usize::from(looks.rubble) * self.rubble().len(),
        }
    }
}

/// Resources that bands use in a submission: blocks, words of lines, words of planes that come back, and words of
/// planes that stay on the GPU.
#[derive(Clone, Copy, Debug, Default)]
struct SubmissionCost {
    blocks: usize,
    lines: usize,
    back: usize,
    left: usize,
}

impl SubmissionCost {
    fn and(self, other: SubmissionCost) -> SubmissionCost {
        SubmissionCost {
            blocks: self.blocks + other.blocks,
            lines: self.lines + other.lines,
            back: self.back + other.back,
            left: self.left + other.left,
        }
    }

    fn fits(self, slots: &Slots, block_words: usize) -> bool {
        let own = TABLE + self.blocks * block_words + self.lines + 1;
        self.blocks <= MOST_BLOCKS && own.max(self.back).max(self.left) <= slots.words
    }
}

/// Divides jobs into bands, with as many bands per submission as fit; `None` if a single row is too large for one.
pub(super) fn submissions(
    jobs: &[LandJob],
    looks: LooksAround,
    slots: &Slots,
    block_words: usize,
) -> Option<Vec<Vec<Band>>> {
    let mut submissions: Vec<Vec<Band>> = vec![Vec::new()];
    let mut taken = SubmissionCost::default();
    for (number, job) in jobs.iter().enumerate() {
        let rows = job.cells.unwrap_or(job.land);
        let mut y0 = rows.y0;
        while y0 < rows.y1 && !rows.is_empty() {
            // Bands end where rows of blocks end, so that as few blocks as possible are computed twice.
            let next = |y: &i64| (*y < rows.y1).then(|| ((y.div_euclid(ROWS) + 1) * ROWS).min(rows.y1));
            let ends = std::iter::successors(Some(y0), next).skip(1);
            let fits = |y1: &i64| {
                let cost = Band::new(number, job, y0, *y1).cost(looks);
                taken.and(cost).fits(slots, block_words)
            };
            let last = ends.take_while(fits).last();
            let is_first = submissions.last().is_some_and(Vec::is_empty);
            let y1 = match last {
                Some(y1) if submissions.last().is_some_and(|bands| bands.len() < BANDS) => y1,
                // A whole row of blocks is too large for a submission, so the band gets fewer rows.
                None if is_first => (1..ROWS).rev().map(|count| (y0 + count).min(rows.y1)).find(fits)?,
                _ => {
                    submissions.push(Vec::new());
                    taken = SubmissionCost::default();
                    continue;
                }
            };
            let band = Band::new(number, job, y0, y1);
            taken = taken.and(band.cost(looks));
            submissions.last_mut().expect("there is one always").push(band);
            y0 = y1;
        }
    }
    submissions.retain(|bands| !bands.is_empty());
    Some(submissions)
}
