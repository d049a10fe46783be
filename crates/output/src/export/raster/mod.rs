//! The formats of rasters: the rows of a table, each an image or some of the region, or of every tile.
//!
//! ```text
//!   quantity.rs   tile -> samples of what is shown     image.rs   which quantity, under which name, how it lies there
//!   sinks.rs      tiles, image -> files                writer.rs  samples -> PNG, bare, row by row;  exr.rs  OpenEXR
//!   cog.rs        tiles, image -> GeoTIFF              tiff.rs    tags -> directories
//!   facts.rs      what a file says of itself           auxiliary.rs   what one beside it says to GIS
//!   statistics.rs   samples -> their range and mean
//! ```

pub(super) mod writer;
pub(super) mod quantity;
pub(super) mod image;
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
use crate::export::format::{Format, FormatCost, Lack, Request, accumulation_bytes, file_name, folder};
use crate::export::options::TileNames;
use crate::export::raster::cog::CogWriter;
use crate::export::raster::image::{Beside, Image};
use crate::export::raster::quantity::Quantity;
use crate::export::raster::sinks::{RegionRaster, TileRasters};
use crate::export::raster::writer::{Encoding, RasterWriter};
use crate::tile::Growth;
use crate::world::World;

/// A format of rasters.
pub(crate) struct Rasters {
    pub name: &'static str,
    pub about: &'static str,
    /// One file each for the region, or with `tiles` one each a tile.
    pub tiles: bool,
    /// Whether no engine has asked for them: files beside those of the region say to GIS where they lie, and those of tiles may be named
    /// after their place in the world.
    pub placed: bool,
    pub images: &'static [Image],
}

const HEIGHT: &[Image] = &[Image::new("height/height", Quantity::Height16, Encoding::Png)];
const METRES: &[Image] = &[Image::new("height/height", Quantity::HeightMetres, Encoding::Exr)];
const BARE: &[Image] = &[Image::new("height/height", Quantity::Height16, Encoding::R16)];
/// The images of the blend map: four materials each.
const BLEND: &[Image] = &[
    Image::new("blend/blend_ground", Quantity::GroundWeights, Encoding::Png),
    Image::new("blend/blend_cover", Quantity::CoverWeights, Encoding::Png),
];
const NORMAL: &[Image] = &[Image::new("normal/normal", Quantity::Normal, Encoding::Png)];
const MAP: &[Image] = &[Image::new("map/map", Quantity::Map, Encoding::Png)];
const COLOUR: &[Image] = &[Image::new("colour/colour", Quantity::Colour, Encoding::Png)];
const WATER: &[Image] = &[Image::new("water/water", Quantity::Water, Encoding::Png)];
const DEPTH: &[Image] = &[Image::new("water/depth", Quantity::WaterDepth, Encoding::Exr)];
const FLOW: &[Image] = &[Image::new("water/flow", Quantity::Flow, Encoding::Exr)];
const SLOPE: &[Image] = &[Image::new("slope/slope", Quantity::Slope8, Encoding::Png)];
const STEEPNESS: &[Image] = &[Image::new("steepness/steepness", Quantity::Steepness8, Encoding::Png)];
const CURVATURE: &[Image] = &[Image::new("curvature/curvature", Quantity::Curvature8, Encoding::Png)];
const ACCUMULATION: &[Image] = &[Image::new("accumulation/accumulation", Quantity::Accumulation8, Encoding::Png)];
const WETNESS: &[Image] = &[Image::new("wetness/wetness", Quantity::Wetness8, Encoding::Png)];
/// What programs scatter by: an image a kind, since they take one for each thing that they plant.
const SCATTER: &[Image] = &[
    Image::new("scatter/tree", Quantity::Density(Growth::Tree), Encoding::Png),
    Image::new("scatter/shrub", Quantity::Density(Growth::Shrub), Encoding::Png),
    Image::new("scatter/grass", Quantity::Density(Growth::Grass), Encoding::Png),
    Image::new("scatter/rock", Quantity::Density(Growth::Rock), Encoding::Png),
];
/// The same as GeoTIFFs.
const HEIGHT_TIFF: &[Image] = &[Image::new("height/height", Quantity::HeightMetres, Encoding::GeoTiff)];
const NORMAL_TIFF: &[Image] = &[Image::new("normal/normal", Quantity::Normal, Encoding::GeoTiff)];
const MAP_TIFF: &[Image] = &[Image::new("map/map", Quantity::Map, Encoding::GeoTiff)];
const COLOUR_TIFF: &[Image] = &[Image::new("colour/colour", Quantity::Colour, Encoding::GeoTiff)];
const WATER_TIFF: &[Image] = &[Image::new("water/water", Quantity::Water, Encoding::GeoTiff)];
const DEPTH_TIFF: &[Image] = &[Image::new("water/depth", Quantity::WaterDepth, Encoding::GeoTiff)];
const FLOW_TIFF: &[Image] = &[Image::new("water/flow", Quantity::Flow, Encoding::GeoTiff)];
const BLEND_TIFF: &[Image] = &[
    Image::new("blend/blend_ground", Quantity::GroundWeights, Encoding::GeoTiff),
    Image::new("blend/blend_cover", Quantity::CoverWeights, Encoding::GeoTiff),
];
const SLOPE_TIFF: &[Image] = &[Image::new("slope/slope", Quantity::SlopeDegrees, Encoding::GeoTiff)];
const STEEPNESS_TIFF: &[Image] = &[Image::new("steepness/steepness", Quantity::Steepness, Encoding::GeoTiff)];
const CURVATURE_TIFF: &[Image] = &[Image::new("curvature/curvature", Quantity::Curvature, Encoding::GeoTiff)];
const ACCUMULATION_TIFF: &[Image] =
    &[Image::new("accumulation/accumulation", Quantity::AccumulationM2, Encoding::GeoTiff)];
const WETNESS_TIFF: &[Image] = &[Image::new("wetness/wetness", Quantity::Wetness, Encoding::GeoTiff)];

const fn region(name: &'static str, about: &'static str, images: &'static [Image]) -> Rasters {
    Rasters { name, about, tiles: false, placed: true, images }
}

const fn tiles(name: &'static str, about: &'static str, images: &'static [Image]) -> Rasters {
    Rasters { name, about, tiles: true, placed: true, images }
}

/// The rasters that can be asked for by name.
pub(super) static NAMED: [Rasters; 45] = [
    region("height", "16-bit grey PNG of the region, over the world's height range", HEIGHT),
    tiles("height-tiles", "the same, a PNG a tile", HEIGHT),
    region("exr", "heights in metres as 32-bit float OpenEXR", METRES),
    tiles("exr-tiles", "the same, an EXR a tile", METRES),
    region("r16", "16-bit little-endian heights without a header, and a JSON sidecar", BARE),
    tiles("r16-tiles", "the same, a pair a tile", BARE),
    region("blend", "two RGBA PNGs: grass, dirt, rock, sand; snow, forest, scree, wetland", BLEND),
    tiles("blend-tiles", "the same, two PNGs a tile", BLEND),
    region("normal", "normal map, RGB PNG in the OpenGL convention (green is north)", NORMAL),
    tiles("normal-tiles", "the same, a PNG a tile", NORMAL),
    region("map", "top-down picture of the region, RGB PNG", MAP),
    tiles("map-tiles", "the same, a PNG a tile", MAP),
    region("colour", "colour of the ground without light, RGB PNG", COLOUR),
    tiles("colour-tiles", "the same, a PNG a tile", COLOUR),
    region("water", "where water is, 8-bit grey PNG: 64 river, 128 lake, 255 sea", WATER),
    tiles("water-tiles", "the same, a PNG a tile", WATER),
    region("depth", "depth of the water in metres as 32-bit float OpenEXR", DEPTH),
    tiles("depth-tiles", "the same, an EXR a tile", DEPTH),
    region("flow", "discharge of the rivers in m3/s as 32-bit float OpenEXR", FLOW),
    tiles("flow-tiles", "the same, an EXR a tile", FLOW),
    region("slope", "how steep the ground is, 8-bit grey PNG: 0 level, 255 upright", SLOPE),
    tiles("slope-tiles", "the same, a PNG a tile", SLOPE),
    region(
        "steepness",
        "the thesis' blend factor by slope, 8-bit grey PNG: 0 level, 255 as steep as bare rock",
        STEEPNESS,
    ),
    tiles("steepness-tiles", "the same, a PNG a tile", STEEPNESS),
    region("curvature", "ridges and hollows, 8-bit grey PNG: 128 flat, lighter on ridges", CURVATURE),
    tiles("curvature-tiles", "the same, a PNG a tile", CURVATURE),
    region("accumulation", "how much land drains through each vertex, 8-bit grey PNG of the logarithm", ACCUMULATION),
    tiles("accumulation-tiles", "the same, a PNG a tile", ACCUMULATION),
    region("wetness", "topographic wetness index, 8-bit grey PNG: 255 is 20 and open water", WETNESS),
    tiles("wetness-tiles", "the same, a PNG a tile", WETNESS),
    region("scatter", "how densely trees, shrubs, grass and rocks stand, an 8-bit grey PNG each", SCATTER),
    tiles("scatter-tiles", "the same, four PNGs a tile", SCATTER),
    region(
        "geotiff",
        "heights in metres as 32-bit float GeoTIFF for GIS: cloud-optimised, with overviews",
        HEIGHT_TIFF,
    ),
    region("blend-geotiff", "the two images of blend as GeoTIFFs", BLEND_TIFF),
    region("normal-geotiff", "the normal map as a GeoTIFF", NORMAL_TIFF),
    region("map-geotiff", "the picture of map as a GeoTIFF", MAP_TIFF),
    region("colour-geotiff", "the colour of the ground as a GeoTIFF", COLOUR_TIFF),
    region("water-geotiff", "where water is, as a GeoTIFF", WATER_TIFF),
    region("depth-geotiff", "depth of the water in metres as 32-bit float GeoTIFF", DEPTH_TIFF),
    region("flow-geotiff", "discharge of the rivers in m3/s as 32-bit float GeoTIFF", FLOW_TIFF),
    region("slope-geotiff", "slope in degrees as 32-bit float GeoTIFF", SLOPE_TIFF),
    region("steepness-geotiff", "the same factor, 0 to 1, as 32-bit float GeoTIFF", STEEPNESS_TIFF),
    region("curvature-geotiff", "mean curvature a metre as 32-bit float GeoTIFF", CURVATURE_TIFF),
    region("accumulation-geotiff", "flow accumulation in m2 as 32-bit float GeoTIFF", ACCUMULATION_TIFF),
    region("wetness-geotiff", "topographic wetness index as 32-bit float GeoTIFF", WETNESS_TIFF),
];

/// A raster of the region that GIS can place.
pub(super) struct Layer {
    pub name: &'static str,
    /// In the folder of the bake.
    pub path: String,
    pub channels: usize,
    /// Its values that are shown black and white, if they are known.
    pub shown: Option<[f64; 2]>,
}

/// The rasters of the region that GIS can place among those of some exports: of what several show, the GeoTIFF.
pub(super) fn layers<'a>(exports: impl Iterator<Item = &'a str>) -> Vec<Layer> {
    let exports: Vec<&str> = exports.collect();
    let placed = |format: &&Rasters| format.placed && !format.tiles && exports.contains(&format.name);
    let images = NAMED.iter().filter(placed).flat_map(Rasters::images);
    // GDAL reads OpenEXR in few of its builds.
    let mut images: Vec<Image> =
        images.filter(|image| [Encoding::GeoTiff, Encoding::Png].contains(&image.encoding)).collect();
    images.sort_by_key(|image| (image.stem, image.encoding != Encoding::GeoTiff));
    images.dedup_by_key(|image| image.stem);
    let layer = |image: &Image| {
        let path = format!("{}.{}", image.stem, image.encoding.extension());
        Layer {
            name: file_name(image.stem),
            path,
            channels: image.quantity.channels().len(),
            shown: image.quantity.shown(),
        }
    };
    images.iter().map(layer).collect()
}

impl Rasters {
    /// The images of what is asked for.
    fn images_of(&self, request: &Request) -> impl Iterator<Item = Image> {
        let of_walk = request.walk.is_some() && !self.tiles;
        let quantity = move |quantity: Quantity| if of_walk { quantity.of_walk() } else { quantity };
        self.images().map(move |image| Image { quantity: quantity(image.quantity), ..image })
    }

    fn images(&self) -> impl Iterator<Item = Image> {
        // The table shares the images of a region with those of its tiles.
        self.images.iter().map(|image| Image { tiles: self.tiles, placed: self.placed, ..*image })
    }

    fn cost_of(image: &Image, request: &Request) -> FormatCost {
        let region = &request.region;
        let bytes = image.quantity.sample().bytes() as u64;
        let vertices = (u64::from(region.tile_cells()) + 1).pow(2);
        let drawn = if image.quantity.is_drawn() { vertices * DRAWN_BYTES } else { 0 };
        // What a vertex drains is kept with the tile while its files are made.
        let drained = if image.quantity.is_of_accumulation() { accumulation_bytes(region) } else { 0 };
        let count = if image.tiles { request.tiles() } else { 1 };
        FormatCost {
            files: count.saturating_mul(1 + image.beside().len() as u64),
            // A raster of the region waits for its whole row of tiles; one of a tile is written by the thread that made
            // it.
            kept_a_vertex: if image.tiles { 0 } else { bytes },
            // Samples, and samples as they are packed.
            thread_bytes: drawn + drained + 2 * vertices * bytes * image.encoding.copies(),
            held_bytes: match image.encoding {
                Encoding::GeoTiff => CogWriter::held_bytes(image.size(region).0, image.quantity.sample()),
                _ => 0,
            },
            worlds: 0,
        }
    }
}

/// What the map of a tile takes while it is drawn, a vertex: a word, four planes of what covers the ground, a canvas and RGB.
const DRAWN_BYTES: u64 = 4 + 4 * 4 + 4 + 3;

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
        // Those that show the same and have room for it, such as one a tile.
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
            // A fourth channel of GeoTIFFs is a weight and no opacity.
            let has_gaps =
                quantity.of_walk().gap().is_some() && (quantity, encoding) != (Quantity::Map, Encoding::GeoTiff);
            // Accumulation is of land far around, with the rivers that the world has there.
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
            // Of what says where one lies nobody wants to know.
            let sidecar = image.beside().contains(&Beside::Json).then(|| Beside::Json.path(&file));
            [file].into_iter().chain(sidecar)
        });
        files.collect()
    }

    fn cost(&self, request: &Request) -> FormatCost {
        self.images_of(request)
            .map(|image| Rasters::cost_of(&image, request))
            .fold(FormatCost::default(), FormatCost::and)
    }

    fn blank_pieces(&self, request: &Request) -> Option<Vec<Vec<u8>>> {
        let blank = |image: Image| {
            let (cols, rows) = image.owned(&request.region, Place { row: 0, col: 0 });
            vec![0; cols * rows * image.quantity.sample().bytes()]
        };
        // A file of bare samples has as many bytes whatever it shows.
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
