//! Rasters: each product in each of its containers (PNG, OpenEXR, GeoTIFF, bare samples) is a format.
//!
//! ```text
//!   product.rs     the table of products -> formats    quantity.rs   contents of pixels, as data
//!   painter.rs     tile, quantity -> samples           image.rs      quantity, encoding, layout, file name
//!   sinks.rs       tiles, image -> files               writer.rs     samples -> PNG and bare files, row by row
//!   cog.rs         samples -> GeoTIFF                  exr.rs        samples -> OpenEXR
//!   tiff.rs        tags -> directories                 reduction.rs  samples -> overviews
//!   facts.rs       metadata inside a file              auxiliary.rs  metadata beside it, for GIS
//!   statistics.rs  samples -> range, mean, deviation
//! ```

pub(crate) mod writer;
mod reduction;
pub(super) mod quantity;
pub(super) mod painter;
pub(super) mod image;
pub(super) mod product;
pub(super) mod auxiliary;
mod cog;
mod exr;
mod facts;
mod sinks;
mod statistics;
mod tiff;

use std::path::Path;

use crate::area::{Place, Region};
use crate::bake::Sink;
use crate::error::Error;
use crate::export::formats::format::{Format, Lack, Request, file_name, folder};
use crate::export::formats::raster::cog::CogWriter;
use crate::export::formats::raster::image::{Image, Sidecar};
use crate::export::formats::raster::product::NAMED;
use crate::export::formats::raster::quantity::{MAP, Quantity, RasterClass};
use crate::export::formats::raster::sinks::{RegionRaster, TileRasters};
use crate::export::formats::raster::writer::{Encoding, RasterWriter};
use crate::export::plan::options::TileNames;
use crate::world::World;

/// A format of rasters.
pub(crate) struct Rasters {
    pub name: &'static str,
    pub about: &'static str,
    /// True if each image has one file per tile; else each has one file of the whole region.
    pub tiles: bool,
    /// True if the format is not made for a game engine. Then sidecar files tell GIS where the region's rasters lie,
    /// and tiles may be named after their numbers in the world.
    pub placed: bool,
    pub images: &'static [Image],
}

/// A raster of the whole region whose position GIS can read.
pub(super) struct RasterLayer {
    pub name: &'static str,
    /// Path in the bake's folder.
    pub path: String,
    pub channels: usize,
    /// Values that are shown as black and as white, if they are known before the raster is.
    pub shown: Option<[f64; 2]>,
    /// The classes whose numbers the raster holds, if it holds such.
    pub classes: Option<fn() -> Vec<RasterClass>>,
}

/// Returns the rasters of the whole region, among those of some exports, whose position GIS can read. If both a PNG and
/// a GeoTIFF have the same name, the GeoTIFF is taken.
pub(super) fn layers<'a>(exports: impl Iterator<Item = &'a str>) -> Vec<RasterLayer> {
    let exports: Vec<&str> = exports.collect();
    let placed = |format: &&Rasters| format.placed && !format.tiles && exports.contains(&format.name);
    let images = NAMED.iter().filter(placed).flat_map(Rasters::images);
    // OpenEXR is left out, since only few builds of GDAL can read it.
    let mut images: Vec<Image> =
        images.filter(|image| [Encoding::GeoTiff, Encoding::Png].contains(&image.encoding)).collect();
    images.sort_by_key(|image| (image.stem, image.encoding != Encoding::GeoTiff));
    images.dedup_by_key(|image| image.stem);
    let layer = |image: &Image| {
        let path = format!("{}.{}", image.stem, image.encoding.extension());
        RasterLayer {
            name: file_name(image.stem),
            path,
            channels: image.quantity.channels.len(),
            shown: image.quantity.shown,
            classes: image.quantity.classes,
        }
    };
    images.iter().map(layer).collect()
}

impl Rasters {
    /// Returns the images for a request. If a region's raster shows a walk, its quantity is the one that allows gaps.
    fn images_of(&self, request: &Request) -> impl Iterator<Item = Image> {
        let of_walk = request.walk.is_some() && !self.tiles;
        let quantity = move |quantity: &'static Quantity| if of_walk { quantity.of_walk() } else { quantity };
        self.images().map(move |image| Image { quantity: quantity(image.quantity), ..image })
    }

    fn images(&self) -> impl Iterator<Item = Image> {
        // The table of products lists an image once for the region and for its tiles, so the flags are set here.
        self.images.iter().map(|image| Image { tiles: self.tiles, placed: self.placed, ..*image })
    }
}

impl Format for Rasters {
    fn name(&self) -> &'static str {
        self.name
    }

    fn about(&self) -> &'static str {
        self.about
    }

    fn lacks(&self, world: &World) -> Option<Lack> {
        self.images.iter().find_map(|image| image.quantity.lacks(world))
    }

    fn check(&self, request: &Request) -> Result<(), Error> {
        let region = &request.region;
        let side = region.width().max(region.height());
        let holds = |image: &Image| image.tiles || side <= image.encoding.max_side();
        let Some(image) = self.images().find(|image| !holds(image)) else { return Ok(()) };
        // Formats that show the same quantity and can hold it, such as one file per tile.
        let instead = |other: &&Rasters| other.images().any(|other| other.quantity == image.quantity && holds(&other));
        let others: Vec<_> = NAMED.iter().filter(instead).map(Format::name).collect();
        Err(Error::Export {
            message: format!(
                "export {} writes one {} of the region, which holds at most {} a side; the region has {} x {}",
                self.name,
                image.encoding.extension().to_uppercase(),
                image.encoding.max_side(),
                region.width(),
                region.height()
            ),
            hint: format!("exports that hold it: {}", others.join(", ")),
        })
    }

    fn shows_walks(&self) -> bool {
        let shows = |Image { quantity, encoding, tiles, .. }: Image| {
            // The fourth channel of a GeoTIFF is written as plain data, not as opacity.
            let has_gaps = quantity.of_walk().gap().is_some() && (quantity, encoding) != (&MAP, Encoding::GeoTiff);
            // Accumulation is made from the world's own land and rivers far around a tile, not from those of the walk.
            !quantity.is_of_accumulation() && (tiles || has_gaps)
        };
        self.placed && self.images().all(shows)
    }

    fn options(&self) -> &'static [&'static str] {
        if self.images.iter().any(|image| image.quantity.is_steps()) { &["--height-range"] } else { &[] }
    }

    fn folders(&self) -> Vec<&'static str> {
        self.images.iter().map(|image| folder(image.stem)).collect()
    }

    fn is_of_tiles_alone(&self) -> bool {
        self.tiles
    }

    fn rasters_of(&self, region: &Region, place: Place, names: TileNames) -> Vec<String> {
        let files = self.images().flat_map(|image| {
            let file = image.file(region, image.tiles.then_some(place), names);
            // Of the sidecars only the JSON files are listed. The others are for GIS alone.
            let sidecar = image.beside().contains(&Sidecar::Json).then(|| Sidecar::Json.path(&file));
            [file].into_iter().chain(sidecar)
        });
        files.collect()
    }

    fn files(&self, request: &Request) -> u64 {
        let files_of = |image: Image| {
            let count = if image.tiles { request.tiles() } else { 1 };
            count.saturating_mul(1 + image.beside().len() as u64)
        };
        self.images_of(request).map(files_of).fold(0, u64::saturating_add)
    }

    fn kept_a_vertex(&self, request: &Request) -> u64 {
        // A tile's raster is written at once, by the thread that made the tile.
        let images = self.images_of(request).filter(|image| !image.tiles);
        images.map(|image| image.quantity.sample.bytes() as u64).sum()
    }

    fn held_bytes(&self, request: &Request, _threads: usize) -> u64 {
        let blocks = self.images().filter(|image| image.encoding == Encoding::GeoTiff && !image.tiles);
        let held = blocks.map(|image| CogWriter::held_bytes(image.size(&request.region).0, image.quantity.sample));
        held.fold(0, u64::saturating_add)
    }

    fn blank_pieces(&self, request: &Request) -> Option<Vec<Vec<u8>>> {
        let blank = |image: Image| {
            let (cols, rows) = image.owned(&request.region, Place { row: 0, col: 0 });
            vec![0; cols * rows * image.quantity.sample.bytes()]
        };
        // Only compressed files need blank pieces: the size of the others does not depend on what they show.
        let is_packed = |image: &Image| matches!(image.encoding, Encoding::Png | Encoding::GeoTiff);
        (!self.tiles && self.images.iter().all(is_packed)).then(|| self.images_of(request).map(blank).collect())
    }

    fn sinks<'a>(&self, request: &Request<'a>, out: &Path) -> Result<Vec<Box<dyn Sink + 'a>>, Error> {
        let sink = |image: Image| -> Result<Box<dyn Sink + 'a>, Error> {
            match (image.encoding, image.tiles) {
                (Encoding::GeoTiff, _) => {
                    Ok(Box::new(RegionRaster::<CogWriter>::create(request, self.name, image, out)?))
                }
                (_, true) => Ok(Box::new(TileRasters::create(request, self.name, image, out))),
                (_, false) => Ok(Box::new(RegionRaster::<RasterWriter>::create(request, self.name, image, out)?)),
            }
        };
        self.images_of(request).map(sink).collect()
    }
}
