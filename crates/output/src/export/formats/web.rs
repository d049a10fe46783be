//! The region as a web map: a pyramid of tiles, archives of them, and a page that shows it from the disk.
//!
//! Map tiles are drawn like other maps, each zoom level at its own scale. They are drawn from the world, not from the
//! tiles of the bake, which only supply the names.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, RwLock};

use serde::{Deserialize, Serialize};

use crate::area::{Area, Place, Region};
use crate::bake::{FileRecord, Kept, Sink};
use crate::clock::Clock;
use crate::error::Error;
use crate::export::formats::format::{Format, Request, folder};
use crate::export::formats::locked;
use crate::features::landforms::{LAKES, PEAKS};
use crate::features::lines::RIVERS;
use crate::features::sites::SITES;
use crate::file::Finished;
use crate::map::scale::Scale;
use crate::map::style::Style;
use crate::map::{Chart, Picture};
use crate::places::site::SiteClass;
use crate::tile::Tile;
use crate::watch::Watch;
use crate::web::{self, Bounds, Choice, Feature, MapContent, Meta, Pyramid, TileEncoding, View, WebLayer};
use crate::world::World;

/// The page and its scripts.
const PAGES: [&str; 3] = ["index.html", "map.js", "names.js"];

/// Pixels per millimetre on screens, which sets the size of lines and letters.
const PIXELS_A_MM: f64 = 96.0 / 25.4;

/// The pictures of the map: name, title and style. The first is shown first.
const LAYERS: [(&str, &str, &str); 2] = [("map", "Map", "topographic"), ("relief", "Relief", "relief")];

/// The web map, as a format.
#[derive(Clone, Copy)]
pub(crate) struct WebMap {
    /// Name of the format and of its folder.
    name: &'static str,
    about: &'static str,
    encoding: TileEncoding,
}

/// The web map with WebP tiles, which have the fewest bytes.
pub(crate) const WEBP: WebMap = WebMap {
    name: "web",
    about: "web map: a page, tiles at all zoom levels, PMTiles and MBTiles, and geojson",
    encoding: TileEncoding::WebP,
};

/// The web map with PNG tiles, which all programs read.
pub(crate) const PNG: WebMap = WebMap {
    name: "web-png",
    about: "the web map with PNG tiles, for what reads no WebP",
    encoding: TileEncoding::Png,
};

/// Returns the paths of the files in a folder that are not tiles.
fn files(folder: &str) -> impl Iterator<Item = String> {
    let layers = LAYERS.iter().flat_map(|(name, ..)| [(*name).to_owned(), format!("{name}@2x")]);
    let archives = layers.chain(["terrain".to_owned()]);
    let archives = archives.flat_map(|name| ["mbtiles", "pmtiles"].map(|ending| format!("{name}.{ending}")));
    archives
        .chain([web::LISTING.to_owned()])
        .chain(PAGES.map(str::to_owned))
        .map(move |name| format!("{folder}/{name}"))
}

/// Tells whether a file of a bake is a list of map tiles: these are too many for the manifest, so a file of their own
/// lists them.
pub(crate) fn is_listing(path: &str) -> bool {
    [WEBP, PNG].iter().any(|map| path.strip_prefix(map.name) == Some(&format!("/{}", web::LISTING)[..]))
}

/// Returns the files of map tiles that a list in a bake's folder names; none if the list has changed since it was
/// written.
pub(crate) fn listed(bake: &Path, listing: &FileRecord) -> Vec<FileRecord> {
    if Clock::unstopped(|clock| listing.fault(bake, clock)).is_some() {
        return Vec::new();
    }
    let text = fs::read_to_string(bake.join(&listing.path)).unwrap_or_default();
    let own = folder(&listing.path);
    let record = |line: &str| {
        let (hash, name) = line.split_once("  ")?;
        let path = format!("{own}/{name}");
        // The list has no sizes, so the size on the disk is taken: the hash alone shows changes.
        let bytes = bake.join(&path).metadata().map_or(0, |there| there.len());
        let blake3 = blake3::Hash::from_hex(hash).ok()?;
        Some(FileRecord::new(path, own, Finished { bytes, blake3 }))
    };
    text.lines().filter_map(record).collect()
}

impl Format for WebMap {
    fn name(&self) -> &'static str {
        self.name
    }

    fn about(&self) -> &'static str {
        self.about
    }

    fn needs(&self) -> Option<&'static str> {
        Some("geojson")
    }

    fn check(&self, request: &Request) -> Result<(), Error> {
        pyramid(request.world, &request.region).map(drop)
    }

    fn folders(&self) -> Vec<&'static str> {
        vec![self.name]
    }

    fn files(&self, _request: &Request) -> u64 {
        files(self.name).count() as u64
    }

    fn held_bytes(&self, request: &Request, threads: usize) -> u64 {
        // For each pixel: RGB of the block, of the parts that it is put together from, and of the layer before; the land
        // under it twice, at a quarter of the pixels; and the pictures of all layers that wait for the archives.
        const PIXEL_BYTES: u64 = 32;
        let Ok(pyramid) = pyramid(request.world, &request.region) else { return 0 };
        // One of the first 64 blocks is as large as any block of the region.
        let tiles = pyramid.blocks(pyramid.max_zoom()).take(64).map(|block| block.places.len()).max().unwrap_or(0);
        let pixels = tiles as u64 * (web::TILE_PX * DENSE).pow(2) as u64;
        // At the finest zoom level the land has as many vertices as the bake.
        let remembered = Chart::remembered_bytes(request.world, [request.region.width(), request.region.height()]);
        (threads as u64 * pixels * PIXEL_BYTES).saturating_add(2 * remembered)
    }

    fn units(&self, request: &Request) -> Option<u64> {
        pyramid(request.world, &request.region).map(|pyramid| pyramid.tiles()).ok()
    }

    fn sinks<'a>(&self, request: &Request<'a>, out: &Path) -> Result<Vec<Box<dyn Sink + 'a>>, Error> {
        let Request { name, world, region, .. } = *request;
        let pyramid = pyramid(world, &region)?;
        Ok(vec![Box::new(WebSink {
            form: *self,
            name,
            world,
            pyramid,
            out: out.join(self.name),
            named: Mutex::default(),
        })])
    }
}

/// Plans the tile pyramid of a region; its finest pixels are about as large as the region's cells.
fn pyramid(world: &World, region: &Region) -> Result<Pyramid, Error> {
    let [west_m, south_m, east_m, north_m] = region.bounds_km(world.spacing_m()).map(|km| km * 1000.0);
    Pyramid::new(Bounds { west_m, south_m, east_m, north_m }, world.spacing_m())
}

/// Collects the names from all tiles of the bake, then writes the map.
struct WebSink<'a> {
    form: WebMap,
    name: &'a str,
    world: &'a World,
    pyramid: Pyramid,
    out: PathBuf,
    /// Named features by their ids in the world.
    named: Mutex<BTreeMap<String, NamedFeature>>,
}

/// A named feature.
#[derive(Serialize, Deserialize)]
struct NamedFeature {
    name: String,
    kind: Cow<'static, str>,
    at: [f64; 2],
    rank: u8,
    /// Size of this part of the feature, such as its area or discharge: the label goes to the largest part.
    weight: f64,
}

impl Sink for WebSink<'_> {
    fn name(&self) -> &str {
        self.form.name
    }

    fn take(&self, tile: &Tile, _place: Place, clock: &Clock) -> Result<Kept, Error> {
        let (world, area) = (self.world, tile.area());
        if world.preset().places.is_none() {
            return Ok(Kept::default());
        }
        let mut found = Vec::new();
        let mut add = |id: String, named: NamedFeature| found.push((id, named));
        for site in SITES.find(world, &area, clock)? {
            let (kind, rank) = match site.class {
                SiteClass::Town => ("town", 1),
                SiteClass::Village => ("village", 3),
                SiteClass::Hamlet => ("hamlet", 5),
            };
            let (weight, kind) = (f64::from(site.population), kind.into());
            add(format!("s:{}", site.id), NamedFeature { name: site.name, kind, at: site.at, rank, weight });
        }
        for lake in LAKES.find(world, &area, clock)? {
            let Some(name) = lake.name else { continue };
            let shore = &lake.rings[0];
            let sum = shore.iter().fold([0.0, 0.0], |sum, point| [sum[0] + point[0], sum[1] + point[1]]);
            let at = sum.map(|axis| axis / shore.len() as f64);
            add(
                format!("l:{}", lake.id),
                NamedFeature { name, kind: "lake".into(), at, rank: 2, weight: lake.area_m2 },
            );
        }
        for peak in PEAKS.find(world, &area, clock)? {
            let Some(name) = peak.name else { continue };
            let weight = f64::from(peak.height_m);
            add(format!("p:{}", peak.id), NamedFeature { name, kind: "peak".into(), at: peak.at, rank: 4, weight });
        }
        for river in RIVERS.find(world, &area, clock)? {
            let Some(name) = river.name else { continue };
            let [east, north, _] = river.line[river.line.len() / 2];
            let weight = river.discharge_m3s[1];
            add(
                format!("r:{}", river.course),
                NamedFeature { name, kind: "river".into(), at: [east, north], rank: 4, weight },
            );
        }
        let piece = serde_json::to_vec(&found).expect("texts and finite numbers are JSON");
        Ok(Kept { piece, files: Vec::new() })
    }

    fn append(&self, _row: u64, pieces: &[&[u8]], _clock: &Clock) -> Result<(), Error> {
        let mut all = locked(&self.named);
        for piece in pieces.iter().filter(|piece| !piece.is_empty()) {
            let found: Vec<(String, NamedFeature)> =
                serde_json::from_slice(piece).expect("it was written by this sink");
            for (id, named) in found {
                // Parts come in the order of the tiles, so that among equal weights the same part wins in every bake.
                if all.get(&id).is_none_or(|known| known.weight < named.weight) {
                    all.insert(id, named);
                }
            }
        }
        Ok(())
    }

    fn finish(&self, watch: &Watch) -> Result<Vec<FileRecord>, Error> {
        let world = Chart::world(self.world.preset(), Some(self.world.seed()))?;
        let artist = Artist { world, prepared: RwLock::default(), clock: &watch.clock };
        let named = locked(&self.named);
        let bounds = self.pyramid.bounds();
        let is_shown = |[east, north]: [f64; 2]| {
            (bounds.west_m..=bounds.east_m).contains(&east) && (bounds.south_m..=bounds.north_m).contains(&north)
        };
        // Roads also name places outside the region, which the map does not show.
        let features: Vec<Feature> = named
            .values()
            .filter(|named| is_shown(named.at))
            .map(|NamedFeature { name, kind, at, rank, .. }| {
                let [east_m, north_m] = *at;
                Feature { name, kind, east_m, north_m, rank: *rank }
            })
            .collect();
        let paints = [0, 1].map(|layer| {
            let artist = &artist;
            move |view: &View| artist.paint(layer, view)
        });
        let layers = [0, 1].map(|layer| {
            let (name, title, _) = LAYERS[layer];
            WebLayer { name, title, paint: &paints[layer] }
        });
        let meta = Meta {
            name: self.name.to_owned(),
            description: format!("seed {}, {} m between vertices", self.world.seed(), self.world.spacing_m()),
            version: env!("CARGO_PKG_VERSION").into(),
        };
        let content = MapContent {
            prepare: &|view| artist.prepare(view),
            layers: &layers,
            heights: Some(&|view| artist.heights(view)),
            features: &features,
        };
        watch.begin("drawing the web map", Some((self.pyramid.tiles(), "web tiles")));
        let WebMap { name: folder, encoding, .. } = self.form;
        let choice = Choice { encoding, dense: true, folder: true, mbtiles: true, pmtiles: true };
        let written = web::write(&self.out, &self.pyramid, &meta, choice, &content, watch)?;
        let record =
            |file: FileRecord| FileRecord { path: format!("{folder}/{}", file.path), export: folder.into(), ..file };
        Ok(written.files.into_iter().map(record).collect())
    }
}

/// Draws map tiles.
struct Artist<'a> {
    world: Arc<World>,
    prepared: RwLock<Option<Prepared>>,
    clock: &'a Clock,
}

/// The pictures of a part of a zoom level, one per layer.
struct Prepared {
    zoom: u8,
    pictures: [Picture; LAYERS.len()],
}

/// Pixels of a picture per pixel of the page, along a side: pictures are drawn for dense screens.
const DENSE: i64 = 2;

impl Artist<'_> {
    fn prepare(&self, view: &View) -> Result<(), Error> {
        let mut prepared = self.prepared.write().expect("no thread panics while it prepares");
        let charts = if let Some(last) = prepared.take().filter(|prepared| prepared.zoom == view.zoom) {
            // The last view had the same zoom level, so its chart already knows the land.
            last.pictures.map(Picture::into_chart)
        } else {
            let dense = DENSE as f64;
            let scale = Scale { metres_per_pixel: view.pixel_m / dense, pixels_per_mm: PIXELS_A_MM * dense };
            let map = Chart::of_world(&self.world, Style::load(LAYERS[0].2)?, scale, self.clock)?;
            let relief = map.in_style(Style::load(LAYERS[1].2)?, self.clock)?;
            [map, relief]
        };
        let Area { x0, y0, x1, y1 } = view.pixels;
        let area = Area { x0: DENSE * x0, y0: DENSE * y0, x1: DENSE * x1, y1: DENSE * y1 };
        let [map, relief] = charts.map(|chart| chart.picture(area, self.clock));
        *prepared = Some(Prepared { zoom: view.zoom, pictures: [map?, relief?] });
        Ok(())
    }

    fn paint(&self, layer: usize, view: &View) -> Result<Vec<u8>, Error> {
        let prepared = self.prepared.read().expect("no thread panics while it prepares");
        Ok(prepared.as_ref().expect("a view is prepared for").pictures[layer].pixels(view.pixels, self.clock)?)
    }

    /// Returns heights at the centres of the page's pixels, each the mean of four heights of the picture.
    fn heights(&self, view: &View) -> Result<Vec<f32>, Error> {
        let prepared = self.prepared.read().expect("no thread panics while it prepares");
        let chart = prepared.as_ref().expect("a view is prepared for").pictures[0].chart();
        let Area { x0, y0, x1, y1 } = view.pixels;
        let width = view.pixels.width() * DENSE as usize;
        let area = Area { x0: DENSE * x0, y0: DENSE * y0, x1: DENSE * x1, y1: DENSE * y1 };
        let heights_m = chart.heights_m(area, self.clock)?;
        let mean = |pair: (&[f32], &[f32])| ((pair.0[0] + pair.0[1]) + (pair.1[0] + pair.1[1])) * 0.25;
        let rows = heights_m.chunks_exact(2 * width).map(|rows| rows.split_at(width));
        Ok(rows.flat_map(|(north, south)| north.chunks_exact(2).zip(south.chunks_exact(2)).map(mean)).collect())
    }
}
