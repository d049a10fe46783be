//! The drawing of a map: the caller's functions draw blocks of pixels, which are cut into tiles.

use std::path::Path;

use rayon::prelude::*;

use crate::area::Area;
use crate::clock::Clock;
use crate::error::Error;
use crate::web::encode::{height_text, terrain_rgb};
use crate::web::folder;
use crate::web::pyramid::{Block, Pyramid, TILE_PX, TilePlace};
use crate::web::{Choice, Heights, MapContent, PaintView, View, WebLayer};

/// Names of the layers made from heights: as colours, and as scripts for the page.
pub(super) const TERRAIN: &str = "terrain";
pub(super) const HEIGHTS: &str = "heights";

/// Pixels between two heights that the page reads. Heights at every pixel would take as many bytes as the pictures, but
/// the page would show no more metres by them.
pub const HEIGHT_SPACING_PX: usize = 2;

/// Pictures that belong together: one layer at one scale.
pub(super) struct Set<'a> {
    pub layer: &'a str,
    pub title: &'a str,
    pub scale: u32,
    source: PixelSource<'a>,
}

/// The source of the pixels of a set.
#[derive(Clone, Copy)]
enum PixelSource<'a> {
    Paint(PaintView<'a>),
    /// Pictures of the next set, which has twice the pixels per side, halved.
    Dense(PaintView<'a>),
    Heights,
}

/// A picture for the archives.
pub(super) struct TilePicture {
    pub set: usize,
    pub place: TilePlace,
    pub bytes: Vec<u8>,
    pub hash: blake3::Hash,
    /// The four tiles of the next zoom level into which a dense picture is cut for MBTiles.
    pub quarters: Option<[Quarter; 4]>,
}

/// A quarter of a dense picture, as a tile of its own.
pub(super) struct Quarter {
    pub place: TilePlace,
    pub bytes: Vec<u8>,
    pub hash: blake3::Hash,
}

/// The result of drawing a block.
pub(super) struct Drawn {
    pub pictures: Vec<TilePicture>,
    /// Lines of the block's files in the list.
    pub listing: String,
}

/// Returns all sets of pictures, those of the layers first.
pub(super) fn sets<'a>(choice: Choice, content: &MapContent<'a>) -> Vec<Set<'a>> {
    let mut sets = Vec::new();
    for WebLayer { name, title, paint } in content.layers {
        let known = sets.iter().any(|set: &Set| set.layer == *name) || [TERRAIN, HEIGHTS].contains(name);
        let plain = !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '-' || c == '_');
        assert!(plain && !known, "{name:?} cannot be the name of a layer");
        let mut push = |scale, source| sets.push(Set { layer: name, title, scale, source });
        if choice.dense {
            push(1, PixelSource::Dense(*paint));
            push(2, PixelSource::Paint(*paint));
        } else {
            push(1, PixelSource::Paint(*paint));
        }
    }
    if content.heights.is_some() {
        sets.push(Set { layer: TERRAIN, title: "terrain-RGB", scale: 1, source: PixelSource::Heights });
    }
    sets
}

impl Set<'_> {
    /// Mark of the scale: it follows a tile's number in the names of files, and the layer's name in those of archives.
    pub fn mark(&self) -> &'static str {
        if self.scale == 1 { "" } else { "@2x" }
    }

    /// Zoom levels from a tile to the tiles of usual size into which it is cut.
    pub fn further(&self) -> u8 {
        u8::from(self.scale > 1)
    }
}

/// Everything needed to draw blocks.
pub(super) struct BlockPainter<'a> {
    pub folder: &'a Path,
    pub pyramid: &'a Pyramid,
    pub choice: Choice,
    pub content: &'a MapContent<'a>,
    pub sets: &'a [Set<'a>],
    pub clock: &'a Clock,
}

impl BlockPainter<'_> {
    /// Draws blocks in parallel and writes the files of their tiles. Returns the results in the order of the blocks.
    pub fn draw(&self, blocks: &[Block]) -> Result<Vec<Drawn>, Error> {
        blocks.par_iter().map(|block| self.draw_block(block)).collect()
    }

    fn draw_block(&self, block: &Block) -> Result<Drawn, Error> {
        let mut pictures = Vec::with_capacity(block.places.len() * self.sets.len());
        let mut listing = String::new();
        let heights = self.content.heights.map(|heights| self.heights(block, heights)).transpose()?;
        let paint = |paint: PaintView, scale: u32, layer: &str| {
            let view = self.view(block, scale);
            let rgb = paint(&view)?;
            assert_eq!(rgb.len(), 3 * view.pixels.len(), "three bytes for each pixel of {layer}");
            Ok::<_, Error>(rgb)
        };
        let mut dense = None;
        for (set, Set { layer, scale, source, .. }) in self.sets.iter().enumerate() {
            let width = self.view(block, *scale).pixels.width();
            let rgb = match source {
                PixelSource::Dense(twice) => {
                    let twice = dense.insert(paint(*twice, 2 * scale, layer)?);
                    halved(twice, 2 * width)
                }
                PixelSource::Paint(own) => dense.take().map_or_else(|| paint(*own, *scale, layer), Ok)?,
                PixelSource::Heights => {
                    let heights = heights.as_ref().expect("terrain is drawn where heights are");
                    heights.colours(self.view(block, 1).pixels)
                }
            };
            let side = TILE_PX as usize * *scale as usize;
            for place in block.tiles() {
                self.clock.check()?;
                let tile = cut(&rgb, width, corner(block, place, side), side);
                let bytes = self.choice.encoding.encode(side as u32, &tile);
                if self.choice.folder {
                    let ending = format!("{}.{}", self.sets[set].mark(), self.choice.encoding.ending());
                    listing += &folder::write_tile(self.folder, layer, place, &ending, &bytes)?;
                }
                let is_cut = self.choice.mbtiles && self.sets[set].further() > 0;
                let quarters = is_cut.then(|| self.quarters(place, &tile, side));
                pictures.push(TilePicture { set, place, hash: blake3::hash(&bytes), bytes, quarters });
            }
        }
        if let Some(heights) = heights.filter(|_| self.choice.folder) {
            listing += &heights.write(self.folder, block)?;
        }
        Ok(Drawn { pictures, listing })
    }

    /// Cuts a dense tile into four tiles of the next zoom level.
    fn quarters(&self, place: TilePlace, tile: &[u8], side: usize) -> [Quarter; 4] {
        let half = side / 2;
        place.quarters().map(|quarter| {
            let [column, row] = [quarter.x % 2, quarter.y % 2].map(|at| at as usize * half);
            let bytes = self.choice.encoding.encode(half as u32, &cut(tile, side, (column, row), half));
            Quarter { place: quarter, hash: blake3::hash(&bytes), bytes }
        })
    }

    fn view(&self, block: &Block, scale: u32) -> View {
        View::new(self.pyramid, block.zoom, block.places, scale)
    }

    /// Returns the heights of a block, with one more pixel in the east and south, so that the page can interpolate up
    /// to the edge.
    fn heights(&self, block: &Block, heights: Heights) -> Result<BlockHeights, Error> {
        let mut view = self.view(block, 1);
        view.pixels.x1 += 1;
        view.pixels.y1 += 1;
        let heights_m = heights(&view)?;
        assert_eq!(heights_m.len(), view.pixels.len(), "a height for each pixel");
        Ok(BlockHeights { width: view.pixels.width(), heights_m })
    }
}

/// The heights of a block's pixels, and of one more pixel in the east and south.
struct BlockHeights {
    width: usize,
    heights_m: Vec<f32>,
}

impl BlockHeights {
    /// Returns the heights of the block as terrain-RGB, without the additional pixels.
    fn colours(&self, pixels: Area) -> Vec<u8> {
        let rows = self.heights_m.chunks(self.width).take(pixels.height());
        rows.flat_map(|row| row[..pixels.width()].iter().flat_map(|height_m| terrain_rgb(*height_m))).collect()
    }

    /// Writes a script for each tile, with the heights of every second pixel and those at the beginning of the next
    /// tile. Returns the lines of the scripts in the list.
    fn write(&self, folder: &Path, block: &Block) -> Result<String, Error> {
        let side = TILE_PX as usize;
        let mut listing = String::new();
        let nodes = side / HEIGHT_SPACING_PX + 1;
        for place in block.tiles() {
            let (x, y) = corner(block, place, side);
            let row = |node: usize| {
                let row = &self.heights_m[(y + node * HEIGHT_SPACING_PX) * self.width + x..];
                row[..=side].iter().step_by(HEIGHT_SPACING_PX).copied()
            };
            let heights_m: Vec<f32> = (0..nodes).flat_map(row).collect();
            let text = height_text(&heights_m, nodes);
            let script = format!("terrane.heights(\"{}/{}/{}\",\"{text}\");\n", place.zoom, place.x, place.y);
            listing += &folder::write_tile(folder, HEIGHTS, place, ".js", script.as_bytes())?;
        }
        Ok(listing)
    }
}

/// Returns the pixel at which a tile begins in the picture of its block.
fn corner(block: &Block, place: TilePlace, side: usize) -> (usize, usize) {
    let tiles = |at: u32, first: i64| (i64::from(at) - first) as usize;
    (tiles(place.x, block.places.x0) * side, tiles(place.y, block.places.y0) * side)
}

/// Halves the pixels per side of a picture: each pixel is the mean of four. Lines and letters are as sharp as if they
/// had been drawn at that size, with less than half of the work.
fn halved(rgb: &[u8], width: usize) -> Vec<u8> {
    let mut half = Vec::with_capacity(rgb.len() / 4);
    for rows in rgb.chunks_exact(2 * 3 * width) {
        let (north, south) = rows.split_at(3 * width);
        for (north, south) in north.as_chunks::<6>().0.iter().zip(south.as_chunks::<6>().0) {
            half.extend([0, 1, 2].map(|channel| {
                let four = [north[channel], north[channel + 3], south[channel], south[channel + 3]];
                ((four.map(u32::from).iter().sum::<u32>() + 2) / 4) as u8
            }));
        }
    }
    half
}

/// Cuts a square out of a picture that is `width` pixels wide, from its north-western pixel on.
fn cut(rgb: &[u8], width: usize, (x, y): (usize, usize), side: usize) -> Vec<u8> {
    let row = |row: usize| &rgb[3 * ((y + row) * width + x)..][..3 * side];
    (0..side).flat_map(row).copied().collect()
}
