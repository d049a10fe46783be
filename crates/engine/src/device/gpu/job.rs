//! What is asked of a GPU, divided into bands of rows: as many together as a submission takes.

use super::slot::Slots;
use crate::area::Area;
use crate::relief::Block;
use crate::tile::RUBBLE_REACH;

/// What is asked for: land, and perhaps a tile on it.
#[derive(Clone, Debug)]
pub(super) struct Job {
    /// The vertices whose land is wanted.
    pub land: Area,
    /// The vertices of the tile, with as much land around them as its ground looks at.
    pub cells: Option<Area>,
    /// The lines that shape the land ([`pack`](crate::lines::packed::pack)); empty where there are none.
    pub lines: Vec<u32>,
}

impl Job {
    /// The planes that come back of the land, and of the tile's vertices.
    pub fn planes(&self) -> [usize; 2] {
        [1 + IMPRINT_PLANES * usize::from(!self.lines.is_empty()), SURFACE_PLANES * usize::from(self.cells.is_some())]
    }
}

/// Planes of the vertices of a tile: three axes of normals, the slope, and two words of weights.
pub(super) const SURFACE_PLANES: usize = 6;

/// Planes of what lines do to land: what is cut, sand, water and dirt.
pub(super) const IMPRINT_PLANES: usize = 4;

/// Words that a band has for itself, and bands of a submission at most: their table has room for so many.
pub(super) const BAND_WORDS: usize = 16;
pub(super) const BANDS: usize = 64;

/// Words of their table, which comes first of all that goes up.
pub(super) const TABLE: usize = BANDS * BAND_WORDS;

/// The most groups along an axis, which all adapters take.
const MOST_BLOCKS: usize = 65_535;

/// Rows by which a band grows while there is room.
const ROWS: i64 = crate::noise::packed::BLOCK[1] as i64;

/// What the ground of tiles looks at beside the land: noise, and rubble.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct LooksAround {
    pub noise: bool,
    pub rubble: bool,
}

/// Some rows of a job.
#[derive(Clone, Copy, Debug)]
pub(super) struct Band {
    /// The job's number.
    pub job: usize,
    /// The land that is made for it, which may overlap with that of the bands beside it; and the rows of it that are kept.
    pub land: Area,
    pub kept: Area,
    /// The vertices of the tile; none where no tile is asked for.
    pub cells: Area,
    /// Planes that come back of the land and of the tile's vertices.
    pub planes: [usize; 2],
    /// Words of lines.
    lines: usize,
}

impl Band {
    /// The rows of a job from one to another: of its tile, or of its land where it has none.
    fn new(number: usize, job: &Job, y0: i64, y1: i64) -> Band {
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

    /// Words of planes that come back.
    pub fn back_words(&self) -> usize {
        self.planes[0] * self.land.len() + self.planes[1] * self.cells.len()
    }

    /// Takes what it fills off the planes of its job, of which bands before it have taken theirs.
    pub fn split_off<'a>(&self, left: &mut [&'a mut [u32]]) -> Vec<&'a mut [u32]> {
        let of_land = std::iter::repeat_n(self.kept.len(), self.planes[0]);
        let counts = of_land.chain(std::iter::repeat_n(self.cells.len(), self.planes[1]));
        let parts = left.iter_mut().zip(counts).map(|(plane, count)| plane.split_off_mut(..count));
        parts.map(|part| part.expect("a band is a part of its job")).collect()
    }

    /// The vertices of a plane of rubble.
    pub fn rubble(&self) -> Area {
        self.cells.padded(RUBBLE_REACH)
    }

    fn cost(&self, looks: LooksAround) -> Cost {
        let noise = usize::from(looks.noise);
        Cost {
            blocks: Block::count(self.land) + noise * Block::count(self.cells),
            lines: self.lines + 1,
            back: self.back_words(),
            left: noise * self.cells.len() + 2 * usize::from(looks.rubble) * self.rubble().len(),
        }
    }
}

/// What bands take of a submission: blocks, and words of lines, of planes that come back and of planes that do not.
#[derive(Clone, Copy, Debug, Default)]
struct Cost {
    blocks: usize,
    lines: usize,
    back: usize,
    left: usize,
}

impl Cost {
    fn and(self, other: Cost) -> Cost {
        Cost {
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

/// Jobs in bands, as many together as a submission takes; `None` where a single row is more than that.
pub(super) fn submissions(
    jobs: &[Job],
    looks: LooksAround,
    slots: &Slots,
    block_words: usize,
) -> Option<Vec<Vec<Band>>> {
    let mut submissions: Vec<Vec<Band>> = vec![Vec::new()];
    let mut taken = Cost::default();
    for (number, job) in jobs.iter().enumerate() {
        let rows = job.cells.unwrap_or(job.land);
        let mut y0 = rows.y0;
        while y0 < rows.y1 && !rows.is_empty() {
            // To where the blocks of the world end, so that as few as can be are made twice.
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
                // A row of blocks is too much for a whole submission: fewer rows, then.
                None if is_first => (1..ROWS).rev().map(|count| (y0 + count).min(rows.y1)).find(fits)?,
                _ => {
                    submissions.push(Vec::new());
                    taken = Cost::default();
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
