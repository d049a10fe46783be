//! Web maps: a pyramid of tiles, packed for the web and the desktop, and a page that shows it without any network.
//!
//! ```text
//!   mercator.rs   the plane of web maps, in which the metres of a world are: degrees
//!   pyramid.rs    bounds, metres of a cell -> zoom levels, tiles, and blocks of them that are drawn at once
//!   encode.rs     pixels -> WebP, PNG; heights -> colours, scripts          meta.rs   what each file says of the map
//!   draft.rs      blocks, functions that draw -> the pictures of tiles
//!   folder.rs     a file a tile, and a list      mbtiles.rs   a database      pmtiles.rs   an archive      archives.rs   both of a layer
//!   page.rs, viewer.html, viewer.css, viewer.js                             the page; the explorer has the last two in common with it
//! ```
//!
//! What tiles show comes from functions of the caller, which are asked for one block after another: this module knows
//! nothing of land. A block is a rectangle of the world's pixels, so whoever draws them needs no notion of tiles, and a
//! tile has the same bytes in every map that holds it.

mod archives;
mod draft;
mod encode;
mod folder;
mod mbtiles;
pub(crate) mod mercator;
mod meta;
mod page;
mod pmtiles;
mod pyramid;

pub use draft::HEIGHT_SPACING_PX;
pub use encode::{Encoding, HEIGHT_STEP_M, height_text, terrain_height_m, terrain_rgb};
pub(crate) use folder::LISTING;
pub use meta::Meta;
pub use page::{LOOK, PROGRAM};
pub use pyramid::{Block, Bounds, MAX_ZOOM, Plan, TILE_PX, TilePlace};

use std::io::Write;
use std::iter::Peekable;
use std::path::Path;

use crate::area::Area;
use crate::bake::FileRecord;
use crate::error::Error;
use crate::file::{PartFile, make_folder, remove};
use archives::Archives;
use draft::{Draft, HEIGHTS, Picture, Set};

/// What records of files call the export.
const EXPORT: &str = "web";

/// Blocks that a thread has in work on average, so that one slow block does not keep the others waiting.
pub(crate) const BLOCKS_A_THREAD: usize = 2;

/// Pixels that are to be drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Zoom level of Web Mercator.
    pub zoom: u8,
    /// How much larger than usual symbols and text are to be drawn, in pixels: 1, or 2 for dense screens.
    pub scale: u32,
    /// Metres on a side of one of these pixels, which are half as large at scale 2.
    pub pixel_m: f64,
    /// Which pixels, counted from the world's origin: pixel (x, y) reaches from `x * pixel_m` to `(x + 1) * pixel_m`
    /// metres east and from `y * pixel_m` to `(y + 1) * pixel_m` metres south. It may reach beyond the plan's bounds by
    /// less than a tile, where there is land as well.
    pub pixels: Area,
}

impl View {
    /// The pixels of some tiles.
    fn new(plan: &Plan, zoom: u8, places: Area, scale: u32) -> View {
        let Area { x0, y0, x1, y1 } = plan.world_pixels(zoom, places);
        let [x0, y0, x1, y1] = [x0, y0, x1, y1].map(|edge| edge * i64::from(scale));
        View { zoom, scale, pixel_m: plan.pixel_m(zoom) / f64::from(scale), pixels: Area { x0, y0, x1, y1 } }
    }
}

/// A function that draws what a view shows: RGB, row by row from the north. Where there are dense tiles, it is asked for these
/// alone, of which the others are made.
pub type Paint<'a> = &'a (dyn Fn(&View) -> Result<Vec<u8>, Error> + Sync);

/// A function that tells the height in metres in the middle of each pixel of a view, row by row from the north.
pub type Heights<'a> = &'a (dyn Fn(&View) -> Result<Vec<f32>, Error> + Sync);

/// A picture of the land that the page can show.
#[derive(Clone, Copy)]
pub struct Layer<'a> {
    /// The name of its folder and of its archives.
    pub name: &'a str,
    /// What the page calls it.
    pub title: &'a str,
    /// Draws it.
    pub paint: Paint<'a>,
}

/// Something with a name that the page finds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Feature<'a> {
    /// What it is called; features without a name are left out.
    pub name: &'a str,
    /// What it is, such as `town`.
    pub kind: &'a str,
    /// Metres east of the origin.
    pub east_m: f64,
    /// Metres north of the origin.
    pub north_m: f64,
    /// How much it matters; 0 matters most.
    pub rank: u8,
}

/// A function that is called alone, with what many views show that are asked for next, and none beyond, at scale 1 whatever
/// theirs.
pub type Prepare<'a> = &'a (dyn Fn(&View) -> Result<(), Error> + Sync);

/// What a map shows.
pub struct Content<'a> {
    /// Prepares for parts of the map.
    pub prepare: Prepare<'a>,
    /// Its pictures; the page begins with the first.
    pub layers: &'a [Layer<'a>],
    /// Its heights, if they are to be there.
    pub heights: Option<Heights<'a>>,
    /// Its names.
    pub features: &'a [Feature<'a>],
}

/// In which form a map is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Choice {
    /// How pictures are written.
    pub encoding: Encoding,
    /// Whether there are tiles with twice the pixels a side, for dense screens, too.
    pub dense: bool,
    /// Whether there is a folder of tiles with a page.
    pub folder: bool,
    /// Whether there is an MBTiles archive of each layer.
    pub mbtiles: bool,
    /// Whether there is a PMTiles archive of each layer.
    pub pmtiles: bool,
}

/// What was written.
#[derive(Clone, Debug, PartialEq)]
pub struct Written {
    /// The archives, the page with its scripts, and the list of the files of tiles; not these themselves.
    pub files: Vec<FileRecord>,
    /// How many pictures there are.
    pub pictures: u64,
    /// How many bytes these have.
    pub picture_bytes: u64,
    /// The BLAKE3 hash of the hashes of all pictures in their order.
    pub digest: blake3::Hash,
}

/// Writes a web map into a folder.
///
/// Tiles are drawn in parallel, in an order that keeps neighbours together, and held for a few blocks only. All files are
/// the same whatever the number of threads. Each appears when it is whole, and `index.html` when all are: where an older
/// one is, it is removed first. `progress` is told of how many more of the plan's tiles are done.
///
/// # Panics
/// When a function returns more or fewer pixels than its view has, or a layer has a name that is taken or is no name.
///
/// # Errors
/// Those of the functions that draw, and when a file cannot be written.
pub fn write(
    folder: &Path,
    plan: &Plan,
    meta: &Meta,
    choice: Choice,
    content: &Content,
    progress: &dyn Fn(u64),
) -> Result<Written, Error> {
    let sets = draft::sets(choice, content);
    begin(folder, &sets)?;
    let archives = sets.iter().map(|set| Archives::create(folder, plan, meta, choice, set));
    let mut archives: Vec<Archives> = archives.collect::<Result<_, _>>()?;
    let draft = Draft { folder, plan, choice, content, sets: &sets };
    let listing = choice.folder.then(|| PartFile::create(folder.join(LISTING)));
    let mut listing = listing.transpose()?;
    let mut tally = Tally::default();
    for zoom in plan.zooms() {
        let mut blocks = plan.blocks(zoom).peekable();
        let mut square = None;
        while let Some(batch) = batch(&mut blocks) {
            let next = batch[0].square();
            if square.replace(next) != Some(next) {
                (content.prepare)(&View::new(plan, zoom, plan.square(zoom, next), 1))?;
            }
            for drawn in draft.draw(&batch)? {
                for picture in &drawn.pictures {
                    archives[picture.set].add(picture)?;
                    tally.add(picture);
                }
                if let Some(listing) = &mut listing {
                    listing.write_all(drawn.listing.as_bytes()).map_err(Error::io(listing.path()))?;
                }
            }
            progress(batch.iter().map(|block| block.places.len() as u64).sum());
        }
    }
    let mut files = Vec::new();
    for archives in archives {
        archives.finish(&mut files)?;
    }
    if let Some(listing) = listing {
        files.push(FileRecord::new(LISTING.to_owned(), EXPORT, listing.finish()?));
        files.extend(page::write(folder, plan, meta, choice, content)?);
    }
    let Tally { hasher, pictures, picture_bytes } = tally;
    Ok(Written { files, pictures, picture_bytes, digest: hasher.finalize() })
}

/// What is counted on the way.
#[derive(Default)]
struct Tally {
    hasher: blake3::Hasher,
    pictures: u64,
    picture_bytes: u64,
}

impl Tally {
    fn add(&mut self, picture: &Picture) {
        self.hasher.update(picture.hash.as_bytes());
        self.pictures += 1;
        self.picture_bytes += picture.bytes.len() as u64;
    }
}

/// The next blocks that are drawn at the same time, all of one square, if there are any.
fn batch(blocks: &mut Peekable<impl Iterator<Item = Block>>) -> Option<Vec<Block>> {
    let mut batch = vec![blocks.next()?];
    let square = batch[0].square();
    while batch.len() < BLOCKS_A_THREAD * rayon::current_num_threads() {
        let Some(block) = blocks.next_if(|block| block.square() == square) else { break };
        batch.push(block);
    }
    Some(batch)
}

/// Makes the folder, and removes from it what would be taken for a whole map.
fn begin(folder: &Path, sets: &[Set]) -> Result<(), Error> {
    make_folder(folder)?;
    remove(&folder.join(page::PAGE))?;
    crate::file::remove_unfinished(folder)?;
    for layer in sets.iter().map(|set| set.layer).chain([HEIGHTS]) {
        folder::clean(&folder.join(layer))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests;
