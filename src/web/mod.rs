//! Web maps: a pyramid of tiles, packed for the web and the desktop, and a page that shows it without any network.
//!
//! ```text
//!   pyramid.rs    bounds, finest pixel -> zoom levels, tiles, and blocks of them that are drawn at once
//!   encode.rs     pixels -> WebP, PNG; heights -> colours, scripts          meta.rs   what each file says of the map
//!   folder.rs     a file a tile      mbtiles.rs   one database      pmtiles.rs   one archive
//!   page.rs, viewer.html, viewer.js                                         the page
//! ```
//!
//! What tiles show comes from functions of the caller, which are asked for one block after another: this module knows
//! nothing of land. A block is a rectangle of the world's pixels, so whoever draws them needs no notion of tiles, and a
//! tile has the same bytes in every map that holds it.

mod encode;
mod folder;
mod mbtiles;
mod meta;
mod page;
mod pmtiles;
mod pyramid;

pub use encode::{Encoding, terrain_height_m, terrain_rgb};
pub use meta::Meta;
pub use pyramid::{Block, Bounds, MAX_ZOOM, Plan, TILE_PX, TilePlace};

use std::fs;
use std::path::Path;

use rayon::prelude::*;

use crate::area::Area;
use crate::bake::{FileRecord, Finished};
use crate::error::Error;
use mbtiles::MbTiles;
use meta::Described;
use pmtiles::PmTiles;

/// What records of files call the export.
const EXPORT: &str = "web";

/// The layers that are made of heights: as colours, and as scripts for the page.
const TERRAIN: &str = "terrain";
const HEIGHTS: &str = "heights";

/// Pixels between two heights that the page reads. At each it would take as much as the pictures, for no metre that shows.
const HEIGHT_SPACING_PX: usize = 2;

/// Blocks that a thread has in work on average, so that one slow block does not keep the others waiting.
const BLOCKS_A_THREAD: usize = 2;

/// Pixels that are to be drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Zoom level; 0 is the coarsest.
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

/// A function that draws what a view shows: RGB, row by row from the north.
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

/// What a map shows.
pub struct Content<'a> {
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
    /// The archives, and the page with its scripts; not the files of tiles.
    pub files: Vec<FileRecord>,
    /// How many pictures there are.
    pub pictures: u64,
    /// How many bytes these have.
    pub picture_bytes: u64,
    /// The BLAKE3 hash of the hashes of all pictures in their order.
    pub digest: blake3::Hash,
}

/// Pictures that belong together: one layer at one scale.
struct Set<'a> {
    layer: &'a str,
    title: &'a str,
    scale: u32,
    /// None for terrain-RGB.
    paint: Option<Paint<'a>>,
}

/// A picture on its way to the archives.
struct Picture {
    set: usize,
    place: TilePlace,
    bytes: Vec<u8>,
    hash: blake3::Hash,
}

/// The archives of a set.
struct Archives {
    stem: String,
    mbtiles: Option<MbTiles>,
    pmtiles: Option<PmTiles>,
}

/// Writes a web map into a folder.
///
/// Tiles are drawn in parallel, in an order that keeps neighbours together, and held for a few blocks only. All files are
/// the same whatever the number of threads. Each appears when it is whole, and `index.html` when all are: where an older
/// one is, it is removed first. `progress` is told how many of the plan's tiles are done.
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
    let sets = sets(choice, content);
    begin(folder, &sets)?;
    let archives = sets.iter().map(|set| Archives::create(folder, plan, meta, choice, set));
    let mut archives: Vec<Archives> = archives.collect::<Result<_, _>>()?;
    let (mut hasher, mut pictures, mut picture_bytes, mut done) = (blake3::Hasher::new(), 0, 0, 0);
    let draft = Draft { folder, plan, choice, content, sets: &sets };
    for zoom in 0..=plan.max_zoom() {
        let mut blocks = plan.blocks(zoom);
        loop {
            let batch: Vec<Block> = blocks.by_ref().take(BLOCKS_A_THREAD * rayon::current_num_threads()).collect();
            if batch.is_empty() {
                break;
            }
            let drawn: Vec<Vec<Picture>> = batch.par_iter().map(|block| draft.draw(block)).collect::<Result<_, _>>()?;
            for picture in drawn.iter().flatten() {
                archives[picture.set].add(picture)?;
                hasher.update(picture.hash.as_bytes());
                pictures += 1;
                picture_bytes += picture.bytes.len() as u64;
            }
            done += batch.iter().map(|block| block.places.len() as u64).sum::<u64>();
            progress(done);
        }
    }
    let mut files = Vec::new();
    for archives in archives {
        archives.finish(&mut files)?;
    }
    if choice.folder {
        files.extend(page::write(folder, plan, meta, choice, content)?);
    }
    Ok(Written { files, pictures, picture_bytes, digest: hasher.finalize() })
}

/// All sets of pictures, those of the layers first.
fn sets<'a>(choice: Choice, content: &Content<'a>) -> Vec<Set<'a>> {
    let mut sets = Vec::new();
    for Layer { name, title, paint } in content.layers {
        let known = sets.iter().any(|set: &Set| set.layer == *name) || [TERRAIN, HEIGHTS].contains(name);
        let plain = !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '-' || c == '_');
        assert!(plain && !known, "{name:?} cannot be the name of a layer");
        let scales = if choice.dense { 1..=2 } else { 1..=1 };
        sets.extend(scales.map(|scale| Set { layer: name, title, scale, paint: Some(*paint) }));
    }
    if content.heights.is_some() {
        sets.push(Set { layer: TERRAIN, title: "terrain-RGB", scale: 1, paint: None });
    }
    sets
}

/// Makes the folder, and removes from it what would be taken for a whole map.
fn begin(folder: &Path, sets: &[Set]) -> Result<(), Error> {
    fs::create_dir_all(folder).map_err(Error::io(folder))?;
    match fs::remove_file(folder.join(page::PAGE)) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            return Err(Error::io(folder.join(page::PAGE))(error));
        }
        _ => crate::file::remove_unfinished(folder)?,
    }
    for layer in sets.iter().map(|set| set.layer).chain([HEIGHTS]) {
        folder::clean(&folder.join(layer))?;
    }
    Ok(())
}

impl Set<'_> {
    /// What follows a tile's number, and the layer's name in those of archives.
    fn mark(&self) -> &'static str {
        if self.scale == 1 { "" } else { "@2x" }
    }
}

/// What all blocks are drawn with.
struct Draft<'a> {
    folder: &'a Path,
    plan: &'a Plan,
    choice: Choice,
    content: &'a Content<'a>,
    sets: &'a [Set<'a>],
}

impl Draft<'_> {
    /// Draws a block of all sets and writes the files of its tiles.
    fn draw(&self, block: &Block) -> Result<Vec<Picture>, Error> {
        let mut pictures = Vec::with_capacity(block.places.len() * self.sets.len());
        let heights = self.content.heights.map(|heights| self.heights(block, heights)).transpose()?;
        for (set, Set { layer, scale, paint, .. }) in self.sets.iter().enumerate() {
            let view = self.view(block, *scale);
            let rgb = match (paint, &heights) {
                (Some(paint), _) => paint(&view)?,
                (None, heights) => heights.as_ref().expect("terrain is drawn where heights are").colours(view.pixels),
            };
            assert_eq!(rgb.len(), 3 * view.pixels.len(), "three bytes for each pixel of {layer}");
            let side = TILE_PX as usize * *scale as usize;
            for place in block.tiles() {
                let tile = cut(&rgb, view.pixels.width(), corner(block, place, side), side);
                let bytes = self.choice.encoding.encode(side as u32, &tile);
                self.write_tile(&self.sets[set], place, &bytes)?;
                pictures.push(Picture { set, place, hash: blake3::hash(&bytes), bytes });
            }
        }
        if let Some(heights) = heights.filter(|_| self.choice.folder) {
            heights.write(self.folder, block)?;
        }
        Ok(pictures)
    }

    fn view(&self, block: &Block, scale: u32) -> View {
        let Area { x0, y0, x1, y1 } = self.plan.world_pixels(block.zoom, block.places);
        let [x0, y0, x1, y1] = [x0, y0, x1, y1].map(|edge| edge * i64::from(scale));
        let pixel_m = self.plan.pixel_m(block.zoom) / f64::from(scale);
        View { zoom: block.zoom, scale, pixel_m, pixels: Area { x0, y0, x1, y1 } }
    }

    /// The heights of a block, with a pixel more in the east and south: the page has those that it is between.
    fn heights(&self, block: &Block, heights: Heights) -> Result<BlockHeights, Error> {
        let mut view = self.view(block, 1);
        view.pixels.x1 += 1;
        view.pixels.y1 += 1;
        let heights_m = heights(&view)?;
        assert_eq!(heights_m.len(), view.pixels.len(), "a height for each pixel");
        Ok(BlockHeights { width: view.pixels.width(), heights_m })
    }

    fn write_tile(&self, set: &Set, place: TilePlace, bytes: &[u8]) -> Result<(), Error> {
        if !self.choice.folder {
            return Ok(());
        }
        let ending = format!("{}.{}", set.mark(), self.choice.encoding.ending());
        folder::write_tile(self.folder, set.layer, place, &ending, bytes)
    }
}

/// The heights of a block's pixels and of those beside it in the east and south.
struct BlockHeights {
    width: usize,
    heights_m: Vec<f32>,
}

impl BlockHeights {
    /// As terrain-RGB, without those beside the block.
    fn colours(&self, pixels: Area) -> Vec<u8> {
        let rows = self.heights_m.chunks(self.width).take(pixels.height());
        rows.flat_map(|row| row[..pixels.width()].iter().flat_map(|height_m| terrain_rgb(*height_m))).collect()
    }

    /// Writes a script for each tile, with the heights of every second pixel and of those where the next tile begins.
    fn write(&self, folder: &Path, block: &Block) -> Result<(), Error> {
        let side = TILE_PX as usize;
        let nodes = side / HEIGHT_SPACING_PX + 1;
        for place in block.tiles() {
            let (x, y) = corner(block, place, side);
            let row = |node: usize| {
                let row = &self.heights_m[(y + node * HEIGHT_SPACING_PX) * self.width + x..];
                row[..=side].iter().step_by(HEIGHT_SPACING_PX).copied()
            };
            let heights_m: Vec<f32> = (0..nodes).flat_map(row).collect();
            let text = encode::height_text(&heights_m, nodes);
            let script = format!("terrane.heights(\"{}/{}/{}\",\"{text}\");\n", place.zoom, place.x, place.y);
            folder::write_tile(folder, HEIGHTS, place, ".js", script.as_bytes())?;
        }
        Ok(())
    }
}

/// Where a tile begins in the picture of its block.
fn corner(block: &Block, place: TilePlace, side: usize) -> (usize, usize) {
    let tiles = |at: u32, first: i64| (i64::from(at) - first) as usize;
    (tiles(place.x, block.places.x0) * side, tiles(place.y, block.places.y0) * side)
}

/// A square of a picture that is `width` pixels wide, from its north-western pixel.
fn cut(rgb: &[u8], width: usize, (x, y): (usize, usize), side: usize) -> Vec<u8> {
    let row = |row: usize| &rgb[3 * ((y + row) * width + x)..][..3 * side];
    (0..side).flat_map(row).copied().collect()
}

impl Archives {
    fn create(folder: &Path, plan: &Plan, meta: &Meta, choice: Choice, set: &Set) -> Result<Archives, Error> {
        let stem = format!("{}{}", set.layer, set.mark());
        let about = Described::new(plan, meta, set.title, set.scale);
        let path = |ending: &str| folder.join(format!("{stem}.{ending}"));
        let mbtiles = || MbTiles::create(path("mbtiles"), choice.encoding.ending(), &about);
        let pmtiles = || PmTiles::create(path("pmtiles"), choice.encoding, &about);
        let (mbtiles, pmtiles) = (choice.mbtiles.then(mbtiles).transpose()?, choice.pmtiles.then(pmtiles).transpose()?);
        Ok(Archives { stem, mbtiles, pmtiles })
    }

    fn add(&mut self, Picture { place, bytes, hash, .. }: &Picture) -> Result<(), Error> {
        if let Some(mbtiles) = &mut self.mbtiles {
            mbtiles.add(*place, hash, bytes)?;
        }
        if let Some(pmtiles) = &mut self.pmtiles {
            pmtiles.add(*place, bytes)?;
        }
        Ok(())
    }

    fn finish(self, files: &mut Vec<FileRecord>) -> Result<(), Error> {
        let mut push = |ending: &str, finished: Finished| {
            files.push(FileRecord::new(format!("{}.{ending}", self.stem), EXPORT, finished));
        };
        if let Some(mbtiles) = self.mbtiles {
            push("mbtiles", mbtiles.finish()?);
        }
        if let Some(pmtiles) = self.pmtiles {
            push("pmtiles", pmtiles.finish()?);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
