//! Pictures, heights and names of tiles: from the cache on the disk, or drawn.

use std::sync::{Arc, LazyLock};

use serde_json::json;

use crate::area::Area;
use crate::clock::Clock;
use crate::error::Error;
use crate::explore::cache::Cache;
use crate::explore::charts::Charts;
use crate::explore::queue::{Lane, Product, Queue, Ticket};
use crate::explore::request::Failure;
use crate::explore::tile_address::{Stage, TileAddress};
use crate::explore::worlds::Opened;
use crate::map::Chart;
use crate::map::style::STYLES;
use crate::stop::Stopped;
use crate::web::{HEIGHT_SPACING_PX, TILE_PX, TileEncoding, height_text};

/// Side of a block in pixels. A block is drawn at once: it is a block of a chart, and holds four tiles or one dense
/// tile.
const BLOCK_PX: i64 = 2 * TILE_PX;

/// Style of the charts that heights are read from. Any would do: heights do not depend on the style.
const HEIGHTS_STYLE: &str = "topographic";

/// Version of glances and drafts. Raise it with each change to their pictures, so that pictures in the cache are drawn
/// again. For full maps, the digest of the world has the version of their layer.
const SKETCHES: u8 = 3;

/// Draws tiles, with the cache and the queue that it needs.
pub(super) struct Studio {
    pub charts: Charts,
    pub cache: Option<Cache>,
    pub queue: Queue,
}

/// One part of a product that is here already, or on its way.
pub(super) enum Pending {
    Here(Vec<u8>),
    Coming(Ticket, usize),
}

impl Pending {
    /// Waits for the part.
    ///
    /// # Errors
    /// When the part cannot be made.
    pub async fn bytes(self) -> Result<Vec<u8>, Failure> {
        match self {
            Pending::Here(bytes) => Ok(bytes),
            Pending::Coming(ticket, part) => Ok(ticket.await?[part].clone()),
        }
    }
}

/// The subject of a picture: world, style and stage.
#[derive(Clone)]
struct Subject {
    opened: Arc<Opened>,
    style: &'static str,
    stage: Stage,
}

/// The kind of product that a digest stands for, beside the place of its tile.
#[derive(Clone, Copy)]
#[repr(u8)]
enum TileProduct {
    Picture,
    Names,
    Heights,
    Block,
}

/// Digest of the texts of all styles, those that others extend among them, and of the version of sketches: a change to
/// any of them changes pictures.
static STYLES_DIGEST: LazyLock<blake3::Hash> = LazyLock::new(|| {
    let mut hasher = blake3::Hasher::new();
    hasher.update(&[SKETCHES]);
    for (name, text) in STYLES {
        hasher.update(name.as_bytes()).update(&[0]).update(text.as_bytes()).update(&[0]);
    }
    hasher.finalize()
});

impl Subject {
    fn new(opened: &Arc<Opened>, style: &str, stage: Stage) -> Result<Subject, Failure> {
        // Look only among the built-in styles: a style of this name may be a file in the folder, which the browser must
        // not read.
        let known = STYLES.iter().find(|(name, _)| *name == style).map(|(name, _)| *name);
        Ok(Subject { opened: opened.clone(), style: known.ok_or_else(Failure::missing)?, stage })
    }

    /// Returns the digest of all that a product depends on. For names pass a fixed `is_dense`, since they do not depend
    /// on the screen's pixels.
    fn key(&self, kind: TileProduct, zoom: u8, is_dense: bool, x: i64, y: i64) -> blake3::Hash {
        let mut hasher = blake3::Hasher::new();
        hasher.update(self.opened.digest.as_bytes()).update(STYLES_DIGEST.as_bytes());
        hasher.update(self.style.as_bytes()).update(&[0, self.stage as u8, kind as u8, zoom, is_dense.into()]);
        hasher.update(&x.to_le_bytes()).update(&y.to_le_bytes());
        hasher.finalize()
    }
}

/// Returns the tiles of a block, from the north-west row by row.
fn tiles_of(zoom: u8, is_dense: bool, [x, y]: [i64; 2]) -> Vec<TileAddress> {
    if is_dense {
        return vec![TileAddress { zoom, x, y, is_dense }];
    }
    [(0, 0), (1, 0), (0, 1), (1, 1)]
        .map(|(right, down)| TileAddress { zoom, x: 2 * x + right, y: 2 * y + down, is_dense })
        .to_vec()
}

/// Returns the column and row of the block that a tile is in.
fn block_of(spot: TileAddress) -> [i64; 2] {
    let Area { x0, y0, .. } = spot.pixels();
    [x0, y0].map(|at| at.div_euclid(BLOCK_PX))
}

impl Studio {
    /// Returns the picture of a tile.
    ///
    /// # Errors
    /// When there is no such style, or too many requests wait.
    pub fn picture(
        self: &Arc<Self>,
        opened: &Arc<Opened>,
        style: &str,
        stage: Stage,
        spot: TileAddress,
    ) -> Result<Pending, Failure> {
        let subject = Subject::new(opened, style, stage)?;
        let key = subject.key(TileProduct::Picture, spot.zoom, spot.is_dense, spot.x, spot.y);
        self.kept_or(&key, || {
            let ticket = self.block(subject, spot)?;
            Ok(Pending::Coming(ticket, place_in_block(spot)))
        })
    }

    /// Returns the names that are written in a tile, as JSON.
    ///
    /// # Errors
    /// As for [`picture`](Studio::picture).
    pub fn names(self: &Arc<Self>, opened: &Arc<Opened>, style: &str, spot: TileAddress) -> Result<Pending, Failure> {
        let subject = Subject::new(opened, style, Stage::Full)?;
        let key = subject.key(TileProduct::Names, spot.zoom, false, spot.x, spot.y);
        self.kept_or(&key, || {
            let ticket = self.block(subject, spot)?;
            // In a product, the names of all tiles follow the pictures.
            Ok(Pending::Coming(ticket, tiles_of(spot.zoom, spot.is_dense, block_of(spot)).len() + place_in_block(spot)))
        })
    }

    /// Returns the heights of a tile as a script for the page: the heights of the land that the tile's picture at this
    /// stage shows. They come from the pointer lane, since somebody points at the tile.
    ///
    /// # Errors
    /// When too many requests wait.
    pub fn heights(
        self: &Arc<Self>,
        opened: &Arc<Opened>,
        stage: Stage,
        spot: TileAddress,
    ) -> Result<Pending, Failure> {
        let subject = Subject::new(opened, HEIGHTS_STYLE, stage)?;
        let key = subject.key(TileProduct::Heights, spot.zoom, false, spot.x, spot.y);
        self.kept_or(&key, || {
            let studio = self.clone();
            let work = move |clock: &Clock| {
                let Subject { opened, style, stage } = subject;
                let chart = studio.charts.chart(&opened, (spot.zoom, false), style, stage, clock)?;
                let script = height_script(&chart, spot, clock)?.into_bytes();
                studio.keep(&key, &script);
                Ok(Arc::new(vec![script]))
            };
            Ok(Pending::Coming(self.queue.ask(Lane::Pointer, key, work)?, 0))
        })
    }

    fn kept_or(&self, key: &blake3::Hash, make: impl FnOnce() -> Result<Pending, Failure>) -> Result<Pending, Failure> {
        match self.cache.as_ref().and_then(|cache| cache.get(key)) {
            Some(bytes) => Ok(Pending::Here(bytes)),
            None => make(),
        }
    }

    fn keep(&self, key: &blake3::Hash, bytes: &[u8]) {
        if let Some(cache) = &self.cache {
            cache.put(key, bytes);
        }
    }

    /// Asks for the block that a tile is in: the pictures of its tiles, and the names in each.
    fn block(self: &Arc<Self>, subject: Subject, spot: TileAddress) -> Result<Ticket, Failure> {
        let [x, y] = block_of(spot);
        let key = subject.key(TileProduct::Block, spot.zoom, spot.is_dense, x, y);
        let lane = if subject.stage == Stage::Full { Lane::Slow } else { Lane::Quick };
        let studio = self.clone();
        self.queue.ask(lane, key, move |clock| studio.draw(&subject, spot.zoom, spot.is_dense, [x, y], clock))
    }

    fn draw(
        &self,
        subject: &Subject,
        zoom: u8,
        is_dense: bool,
        block: [i64; 2],
        clock: &Clock,
    ) -> Result<Product, Error> {
        let chart = self.charts.chart(&subject.opened, (zoom, is_dense), subject.style, subject.stage, clock)?;
        let area = Area::new(block[0] * BLOCK_PX, block[1] * BLOCK_PX, BLOCK_PX as usize, BLOCK_PX as usize);
        let picture = chart.picture(area, clock)?;
        let tiles = tiles_of(zoom, is_dense, block);
        let mut product = Vec::new();
        let block_pixels = picture.pixels(area, clock)?;
        for tile in &tiles {
            let bytes = encoded(&block_pixels, area, tile.pixels());
            self.keep(&subject.key(TileProduct::Picture, zoom, is_dense, tile.x, tile.y), &bytes);
            product.push(bytes);
        }
        if subject.stage == Stage::Full {
            let metres = chart.scale().metres_per_pixel;
            for tile in &tiles {
                let pixels = tile.pixels();
                let here = picture.names().filter(|(.., [x, y])| pixels.meets([*x, *y, *x, *y]));
                let names = here.map(|(kind, name, [x, y])| {
                    let [east, north] = [x * metres, 0.0 - y * metres].map(|metres| (metres * 10.0).round() / 10.0);
                    json!({ "name": name, "kind": kind, "at": [east, north] })
                });
                let bytes = json!(names.collect::<Vec<_>>()).to_string().into_bytes();
                self.keep(&subject.key(TileProduct::Names, zoom, false, tile.x, tile.y), &bytes);
                product.push(bytes);
            }
        }
        Ok(Arc::new(product))
    }
}

/// Returns the index of a tile among the tiles of its block.
fn place_in_block(spot: TileAddress) -> usize {
    let tiles = tiles_of(spot.zoom, spot.is_dense, block_of(spot));
    tiles.iter().position(|tile| *tile == spot).expect("a tile is in its block")
}

/// Encodes the picture of a part of an area.
fn encoded(rgb: &[u8], area: Area, part: Area) -> Vec<u8> {
    let row = |y: i64| {
        let first = (y - area.y0) as usize * area.width() + (part.x0 - area.x0) as usize;
        &rgb[3 * first..][..3 * part.width()]
    };
    let cut: Vec<u8> = (part.y0..part.y1).flat_map(row).copied().collect();
    TileEncoding::WebP.encode(part.width() as u32, &cut)
}

/// Returns a script with the heights of every second pixel of a tile, up to the first row and column of the next tiles.
fn height_script(chart: &Chart, spot: TileAddress, clock: &Clock) -> Result<String, Stopped> {
    let mut area = spot.pixels();
    area.x1 += 1;
    area.y1 += 1;
    let heights_m = chart.heights_m(area, clock)?;
    let rows = heights_m.chunks(area.width()).step_by(HEIGHT_SPACING_PX);
    let nodes: Vec<f32> = rows.flat_map(|row| row.iter().step_by(HEIGHT_SPACING_PX).copied()).collect();
    let text = height_text(&nodes, TILE_PX as usize / HEIGHT_SPACING_PX + 1);
    Ok(format!("terrane.heights(\"{}/{}/{}\",\"{text}\");\n", spot.zoom, spot.x, spot.y))
}
