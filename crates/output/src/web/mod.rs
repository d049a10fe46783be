//! Web maps: a pyramid of tiles, packed for the web and the desktop, and a page that shows it without any network.
//!
//! ```text
//!   mercator.rs        the plane of web maps, in which the metres of a world lie: degrees
//!   pyramid.rs         bounds, metres of a cell -> zoom levels, tiles, and blocks of tiles that are drawn at once
//!   encode.rs          pixels -> WebP, PNG; heights -> colours, scripts     meta.rs   the metadata of each file
//!   block_painter.rs   blocks, functions that draw -> the pictures of tiles
//!   folder.rs          a file per tile, a list of the files     mbtiles.rs   a database     pmtiles.rs   an archive
//!   archives.rs        the MBTiles and PMTiles archives of a layer
//!   page.rs, viewer.html, viewer.css, viewer.js   the page; the explorer shares the last two
//! ```
//!
//! The content of tiles comes from functions of the caller, which are called for one block after another: this module
//! knows nothing of land. A block is a rectangle of the world's pixels, so the functions that draw need no notion of
//! tiles, and a tile has the same bytes in every map that holds it.

mod archives;
mod block_painter;
mod encode;
mod folder;
mod mbtiles;
pub(crate) mod mercator;
mod meta;
mod page;
mod pmtiles;
mod pyramid;

pub use block_painter::HEIGHT_SPACING_PX;
pub use encode::{HEIGHT_STEP_M, TileEncoding, height_text, terrain_height_m, terrain_rgb};
pub(crate) use folder::LISTING;
pub use meta::Meta;
pub use page::{LOOK, PROGRAM};
pub use pyramid::{Block, Bounds, MAX_ZOOM, Pyramid, TILE_PX, TilePlace};

use std::io::Write;
use std::iter::Peekable;
use std::path::Path;

use crate::area::Area;
use crate::bake::FileRecord;
use crate::error::Error;
use crate::file::{PartFile, make_folder, remove};
use crate::watch::Watch;
use archives::Archives;
use block_painter::{BlockPainter, HEIGHTS, Set, TilePicture};

/// Name of this export in the records of files.
const EXPORT: &str = "web";

/// Number of blocks in work per thread, on average. With more than one, a slow block does not keep the others waiting.
pub(crate) const BLOCKS_A_THREAD: usize = 2;

/// A rectangle of pixels to draw.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Zoom level of Web Mercator.
    pub zoom: u8,
    /// Factor by which symbols and text are enlarged, in pixels: 1, or 2 for dense screens.
    pub scale: u32,
    /// Side length in metres of one of these pixels. At scale 2 a pixel is half as large.
    pub pixel_m: f64,
    /// The pixels to draw, counted from the world's origin: pixel (x, y) reaches from `x * pixel_m` to `(x + 1) *
    /// pixel_m` metres east and from `y * pixel_m` to `(y + 1) * pixel_m` metres south. They may reach beyond the
    /// plan's bounds by less than a tile; there is land as well.
    pub pixels: Area,
}

impl View {
    /// Returns the view of some tiles.
    fn new(pyramid: &Pyramid, zoom: u8, places: Area, scale: u32) -> View {
        let Area { x0, y0, x1, y1 } = pyramid.world_pixels(zoom, places);
        let [x0, y0, x1, y1] = [x0, y0, x1, y1].map(|edge| edge * i64::from(scale));
        View { zoom, scale, pixel_m: pyramid.pixel_m(zoom) / f64::from(scale), pixels: Area { x0, y0, x1, y1 } }
    }
}

/// A function that draws a view: RGB, row by row from the north. If there are dense tiles, it is called for these
/// alone, and the others are made from them.
pub type PaintView<'a> = &'a (dyn Fn(&View) -> Result<Vec<u8>, Error> + Sync);

/// A function that returns the height in metres at the centre of each pixel of a view, row by row from the north.
pub type Heights<'a> = &'a (dyn Fn(&View) -> Result<Vec<f32>, Error> + Sync);

/// A picture of the land that the page can show.
#[derive(Clone, Copy)]
pub struct WebLayer<'a> {
    /// Name of the layer's folder and of its archives.
    pub name: &'a str,
    /// Title of the layer on the page.
    pub title: &'a str,
    /// Draws the layer.
    pub paint: PaintView<'a>,
}

/// A named feature that the page's search finds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Feature<'a> {
    /// Name of the feature; features without a name are left out.
    pub name: &'a str,
    /// Kind of the feature, such as `town`.
    pub kind: &'a str,
    /// Metres east of the origin.
    pub east_m: f64,
    /// Metres north of the origin.
    pub north_m: f64,
    /// Rank of the feature; 0 is the most important.
    pub rank: u8,
}

/// A function that prepares for the next views, and runs alone. Its view, at scale 1, covers them all and none beyond
/// them.
pub type Prepare<'a> = &'a (dyn Fn(&View) -> Result<(), Error> + Sync);

/// The content of a map.
pub struct MapContent<'a> {
    /// Prepares for parts of the map.
    pub prepare: Prepare<'a>,
    /// Pictures of the map; the page begins with the first.
    pub layers: &'a [WebLayer<'a>],
    /// Heights of the map, if tiles of heights are wanted.
    pub heights: Option<Heights<'a>>,
    /// Named features.
    pub features: &'a [Feature<'a>],
}

/// The forms in which a map is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Choice {
    /// Image format of the pictures.
    pub encoding: TileEncoding,
    /// True if there are also dense tiles, with twice the pixels per side, for dense screens.
    pub dense: bool,
    /// True if there is a folder of tiles with a page.
    pub folder: bool,
    /// True if there is an MBTiles archive of each layer.
    pub mbtiles: bool,
    /// True if there is a PMTiles archive of each layer.
    pub pmtiles: bool,
}

/// The result of writing a map.
#[derive(Clone, Debug, PartialEq)]
pub struct Written {
    /// The archives, the page with its scripts, and the list of the files of tiles; the files of tiles are not among
    /// them.
    pub files: Vec<FileRecord>,
    /// Number of pictures.
    pub pictures: u64,
    /// Number of bytes of all pictures.
    pub picture_bytes: u64,
    /// The BLAKE3 hash of the hashes of all pictures in their order.
    pub digest: blake3::Hash,
}

/// Writes a web map into a folder.
///
/// Tiles are drawn in parallel, in an order that keeps neighbours together, and only a few blocks are in memory at a
/// time. All files are the same whatever the number of threads. Each file appears when it is complete, and `index.html`
/// when all are; an older `index.html` is removed first. `watch` counts the plan's tiles.
///
/// # Panics
/// If a function returns more or fewer pixels than its view has, or if a layer's name is taken or invalid.
///
/// # Errors
/// Those of the functions that draw, and when a file cannot be written or the work is stopped.
pub fn write(
    folder: &Path,
    pyramid: &Pyramid,
    meta: &Meta,
    choice: Choice,
    content: &MapContent,
    watch: &Watch,
) -> Result<Written, Error> {
    let sets = block_painter::sets(choice, content);
    begin(folder, &sets)?;
    let archives = sets.iter().map(|set| Archives::create(folder, pyramid, meta, choice, set));
    let mut archives: Vec<Archives> = archives.collect::<Result<_, _>>()?;
    let painter = BlockPainter { folder, pyramid, choice, content, sets: &sets, clock: &watch.clock };
    let listing = choice.folder.then(|| PartFile::create(folder.join(LISTING)));
    let mut listing = listing.transpose()?;
    let mut tally = Tally::default();
    for zoom in pyramid.zooms() {
        let mut blocks = pyramid.blocks(zoom).peekable();
        let mut square = None;
        while let Some(batch) = batch(&mut blocks) {
            let next = batch[0].square();
            if square.replace(next) != Some(next) {
                (content.prepare)(&View::new(pyramid, zoom, pyramid.square(zoom, next), 1))?;
            }
            for drawn in painter.draw(&batch)? {
                for picture in &drawn.pictures {
                    archives[picture.set].add(picture)?;
                    tally.add(picture);
                }
                if let Some(listing) = &mut listing {
                    listing.write_all(drawn.listing.as_bytes()).map_err(Error::io(listing.path()))?;
                }
            }
            watch.add(batch.iter().map(|block| block.places.len() as u64).sum());
        }
    }
    let mut files = Vec::new();
    for archives in archives {
        archives.finish(&mut files)?;
    }
    if let Some(listing) = listing {
        files.push(FileRecord::new(LISTING.to_owned(), EXPORT, listing.finish()?));
        files.extend(page::write(folder, pyramid, meta, choice, content)?);
    }
    let Tally { hasher, pictures, picture_bytes } = tally;
    Ok(Written { files, pictures, picture_bytes, digest: hasher.finalize() })
}

/// Counts of the pictures written so far, and the hash of their hashes.
#[derive(Default)]
struct Tally {
    hasher: blake3::Hasher,
    pictures: u64,
    picture_bytes: u64,
}

impl Tally {
    fn add(&mut self, picture: &TilePicture) {
        self.hasher.update(picture.hash.as_bytes());
        self.pictures += 1;
        self.picture_bytes += picture.bytes.len() as u64;
    }
}

/// Takes the next blocks to draw at the same time, all of one square; `None` at the end.
fn batch(blocks: &mut Peekable<impl Iterator<Item = Block>>) -> Option<Vec<Block>> {
    let mut batch = vec![blocks.next()?];
    let square = batch[0].square();
    while batch.len() < BLOCKS_A_THREAD * rayon::current_num_threads() {
        let Some(block) = blocks.next_if(|block| block.square() == square) else { break };
        batch.push(block);
    }
    Some(batch)
}

/// Makes the folder, and removes files from it that would be mistaken for a complete map.
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
