//! The table of products: everything that can be exported as rasters. One row makes up to three formats: files of the
//! region, files per tile (`-tiles`), and GeoTIFFs of the region (`-geotiff`).

use std::sync::LazyLock;

use crate::export::formats::raster::Rasters;
use crate::export::formats::raster::image::Image;
use crate::export::formats::raster::quantity::{
    ACCUMULATION, ACCUMULATION_GREY, ASPECT, ASPECT_GREY, BIOME, COLOUR, COVER_WEIGHTS, CURVATURE, CURVATURE_GREY,
    DENSITIES, DIP, DIP_GREY, FLOW, GROUND_WEIGHTS, HEIGHT, HEIGHT_STEPS, MAP, NORMAL, RAIN, RAIN_GREY, ROCK, SEASON,
    SEASON_GREY, SLOPE, SLOPE_GREY, STEEPNESS, STEEPNESS_GREY, STRIKE, STRIKE_GREY, TEMPERATURE, TEMPERATURE_GREY,
    UPLIFT, UPLIFT_GREY, WATER, WATER_DEPTH, WETNESS, WETNESS_GREY,
};
use crate::export::formats::raster::writer::Encoding::{Exr, GeoTiff, Png, R16};
use crate::tile::Growth;

/// A product: a raster or set of rasters that users ask for by name, and get in one of its containers.
struct RasterProduct {
    name: &'static str,
    about: &'static str,
    images: &'static [Image],
    /// Number and kind of the files of a tile, for the help.
    a_tile: &'static str,
    geotiff: Option<GeoTiffs>,
}

/// The GeoTIFFs of a product. Where pictures hold grey levels, GeoTIFFs hold values in their unit.
struct GeoTiffs {
    name: &'static str,
    about: &'static str,
    images: &'static [Image],
}

static PRODUCTS: [RasterProduct; 20] = [
    RasterProduct {
        name: "height",
        about: "16-bit grey PNG of the region, over the world's height range",
        images: &[Image::new("height/height", &HEIGHT_STEPS, Png)],
        a_tile: "a PNG",
        geotiff: Some(GeoTiffs {
            name: "geotiff",
            about: "heights in metres as 32-bit float GeoTIFF for GIS: cloud-optimised, with overviews",
            images: &[Image::new("height/height", &HEIGHT, GeoTiff)],
        }),
    },
    RasterProduct {
        name: "exr",
        about: "heights in metres as 32-bit float OpenEXR",
        images: &[Image::new("height/height", &HEIGHT, Exr)],
        a_tile: "an EXR",
        geotiff: None,
    },
    RasterProduct {
        name: "r16",
        about: "16-bit little-endian heights without a header, and a JSON sidecar",
        images: &[Image::new("height/height", &HEIGHT_STEPS, R16)],
        a_tile: "a pair",
        geotiff: None,
    },
    RasterProduct {
        name: "blend",
        about: "two RGBA PNGs: grass, dirt, rock, sand; snow, forest, scree, wetland",
        images: &[
            Image::new("blend/blend_ground", &GROUND_WEIGHTS, Png),
            Image::new("blend/blend_cover", &COVER_WEIGHTS, Png),
        ],
        a_tile: "two PNGs",
        geotiff: Some(GeoTiffs {
            name: "blend-geotiff",
            about: "the two images of blend as GeoTIFFs",
            images: &[
                Image::new("blend/blend_ground", &GROUND_WEIGHTS, GeoTiff),
                Image::new("blend/blend_cover", &COVER_WEIGHTS, GeoTiff),
            ],
        }),
    },
    RasterProduct {
        name: "normal",
        about: "normal map, RGB PNG in the OpenGL convention (green is north)",
        images: &[Image::new("normal/normal", &NORMAL, Png)],
        a_tile: "a PNG",
        geotiff: Some(GeoTiffs {
            name: "normal-geotiff",
            about: "the normal map as a GeoTIFF",
            images: &[Image::new("normal/normal", &NORMAL, GeoTiff)],
        }),
    },
    RasterProduct {
        name: "map",
        about: "top-down picture of the region, RGB PNG",
        images: &[Image::new("map/map", &MAP, Png)],
        a_tile: "a PNG",
        geotiff: Some(GeoTiffs {
            name: "map-geotiff",
            about: "the picture of map as a GeoTIFF",
            images: &[Image::new("map/map", &MAP, GeoTiff)],
        }),
    },
    RasterProduct {
        name: "colour",
        about: "colour of the ground without light, RGB PNG",
        images: &[Image::new("colour/colour", &COLOUR, Png)],
        a_tile: "a PNG",
        geotiff: Some(GeoTiffs {
            name: "colour-geotiff",
            about: "the colour of the ground as a GeoTIFF",
            images: &[Image::new("colour/colour", &COLOUR, GeoTiff)],
        }),
    },
    RasterProduct {
        name: "water",
        about: "where water is, 8-bit grey PNG: 64 river, 128 lake, 255 sea",
        images: &[Image::new("water/water", &WATER, Png)],
        a_tile: "a PNG",
        geotiff: Some(GeoTiffs {
            name: "water-geotiff",
            about: "where water is, as a GeoTIFF",
            images: &[Image::new("water/water", &WATER, GeoTiff)],
        }),
    },
    RasterProduct {
        name: "depth",
        about: "depth of the water in metres as 32-bit float OpenEXR",
        images: &[Image::new("water/depth", &WATER_DEPTH, Exr)],
        a_tile: "an EXR",
        geotiff: Some(GeoTiffs {
            name: "depth-geotiff",
            about: "depth of the water in metres as 32-bit float GeoTIFF",
            images: &[Image::new("water/depth", &WATER_DEPTH, GeoTiff)],
        }),
    },
    RasterProduct {
        name: "flow",
        about: "discharge of the rivers in m3/s as 32-bit float OpenEXR",
        images: &[Image::new("water/flow", &FLOW, Exr)],
        a_tile: "an EXR",
        geotiff: Some(GeoTiffs {
            name: "flow-geotiff",
            about: "discharge of the rivers in m3/s as 32-bit float GeoTIFF",
            images: &[Image::new("water/flow", &FLOW, GeoTiff)],
        }),
    },
    RasterProduct {
        name: "slope",
        about: "how steep the ground is, 8-bit grey PNG: 0 level, 255 upright",
        images: &[Image::new("slope/slope", &SLOPE_GREY, Png)],
        a_tile: "a PNG",
        geotiff: Some(GeoTiffs {
            name: "slope-geotiff",
            about: "slope in degrees as 32-bit float GeoTIFF",
            images: &[Image::new("slope/slope", &SLOPE, GeoTiff)],
        }),
    },
    RasterProduct {
        name: "aspect",
        about: "which way the ground falls, 8-bit grey PNG: 0 level, 1 north, 64 east, 128 south, 192 west",
        images: &[Image::new("aspect/aspect", &ASPECT_GREY, Png)],
        a_tile: "a PNG",
        geotiff: Some(GeoTiffs {
            name: "aspect-geotiff",
            about: "aspect in degrees clockwise from north as 32-bit float GeoTIFF",
            images: &[Image::new("aspect/aspect", &ASPECT, GeoTiff)],
        }),
    },
    RasterProduct {
        name: "steepness",
        about: "the thesis' blend factor by slope, 8-bit grey PNG: 0 level, 255 as steep as bare rock",
        images: &[Image::new("steepness/steepness", &STEEPNESS_GREY, Png)],
        a_tile: "a PNG",
        geotiff: Some(GeoTiffs {
            name: "steepness-geotiff",
            about: "the same factor, 0 to 1, as 32-bit float GeoTIFF",
            images: &[Image::new("steepness/steepness", &STEEPNESS, GeoTiff)],
        }),
    },
    RasterProduct {
        name: "curvature",
        about: "ridges and hollows, 8-bit grey PNG: 128 flat, lighter on ridges",
        images: &[Image::new("curvature/curvature", &CURVATURE_GREY, Png)],
        a_tile: "a PNG",
        geotiff: Some(GeoTiffs {
            name: "curvature-geotiff",
            about: "mean curvature a metre as 32-bit float GeoTIFF",
            images: &[Image::new("curvature/curvature", &CURVATURE, GeoTiff)],
        }),
    },
    RasterProduct {
        name: "accumulation",
        about: "how much land drains through each vertex, 8-bit grey PNG of the logarithm",
        images: &[Image::new("accumulation/accumulation", &ACCUMULATION_GREY, Png)],
        a_tile: "a PNG",
        geotiff: Some(GeoTiffs {
            name: "accumulation-geotiff",
            about: "flow accumulation in m2 as 32-bit float GeoTIFF",
            images: &[Image::new("accumulation/accumulation", &ACCUMULATION, GeoTiff)],
        }),
    },
    RasterProduct {
        name: "wetness",
        about: "topographic wetness index, 8-bit grey PNG: 255 is 20 and open water",
        images: &[Image::new("wetness/wetness", &WETNESS_GREY, Png)],
        a_tile: "a PNG",
        geotiff: Some(GeoTiffs {
            name: "wetness-geotiff",
            about: "topographic wetness index as 32-bit float GeoTIFF",
            images: &[Image::new("wetness/wetness", &WETNESS, GeoTiff)],
        }),
    },
    RasterProduct {
        name: "climate",
        about: "8-bit PNGs of mean temperature, rain, share of it in the warm half-year, and Koeppen's biomes; whole worlds only",
        images: &[
            Image::new("climate/temperature", &TEMPERATURE_GREY, Png),
            Image::new("climate/rain", &RAIN_GREY, Png),
            Image::new("climate/season", &SEASON_GREY, Png),
            Image::new("climate/biome", &BIOME, Png),
        ],
        a_tile: "four PNGs",
        geotiff: Some(GeoTiffs {
            name: "climate-geotiff",
            about: "degrees Celsius, mm a year and the share as 32-bit float GeoTIFFs, biomes as an 8-bit one with a colour table",
            images: &[
                Image::new("climate/temperature", &TEMPERATURE, GeoTiff),
                Image::new("climate/rain", &RAIN, GeoTiff),
                Image::new("climate/season", &SEASON, GeoTiff),
                Image::new("climate/biome", &BIOME, GeoTiff),
            ],
        }),
    },
    RasterProduct {
        name: "rock",
        about: "8-bit PNGs of the rock of a geological map, and of strike and dip of its beds; whole worlds only",
        images: &[
            Image::new("rock/rock", &ROCK, Png),
            Image::new("rock/strike", &STRIKE_GREY, Png),
            Image::new("rock/dip", &DIP_GREY, Png),
        ],
        a_tile: "three PNGs",
        geotiff: Some(GeoTiffs {
            name: "rock-geotiff",
            about: "the rock as an 8-bit GeoTIFF with a colour table, strike and dip in degrees as 32-bit float ones",
            images: &[
                Image::new("rock/rock", &ROCK, GeoTiff),
                Image::new("rock/strike", &STRIKE, GeoTiff),
                Image::new("rock/dip", &DIP, GeoTiff),
            ],
        }),
    },
    RasterProduct {
        name: "uplift",
        about: "rate at which the land rises, 8-bit grey PNG: 0 plains, 255 young ranges; whole worlds only",
        images: &[Image::new("uplift/uplift", &UPLIFT_GREY, Png)],
        a_tile: "a PNG",
        geotiff: Some(GeoTiffs {
            name: "uplift-geotiff",
            about: "uplift, 0 to 1, as 32-bit float GeoTIFF",
            images: &[Image::new("uplift/uplift", &UPLIFT, GeoTiff)],
        }),
    },
    // One image per kind of object, since scatter tools take one mask for each kind that they plant.
    RasterProduct {
        name: "scatter",
        about: "how densely trees, shrubs, grass and rocks stand, an 8-bit grey PNG each",
        images: &[
            Image::new("scatter/tree", &DENSITIES[Growth::Tree as usize], Png),
            Image::new("scatter/shrub", &DENSITIES[Growth::Shrub as usize], Png),
            Image::new("scatter/grass", &DENSITIES[Growth::Grass as usize], Png),
            Image::new("scatter/rock", &DENSITIES[Growth::Rock as usize], Png),
        ],
        a_tile: "four PNGs",
        geotiff: None,
    },
];

/// All raster formats that users can ask for by name: for each product the files of the region and those of tiles, then
/// all GeoTIFFs.
pub(in crate::export) static NAMED: LazyLock<Vec<Rasters>> = LazyLock::new(|| {
    let rasters = |name, about, tiles, images| Rasters { name, about, tiles, placed: true, images };
    let files = PRODUCTS.iter().flat_map(|product| {
        let RasterProduct { name, about, images, a_tile, .. } = *product;
        // The leak is harmless: these texts are made once, and live as long as the program, like the table.
        let [of_tiles, about_tiles] = [format!("{name}-tiles"), format!("the same, {a_tile} a tile")].map(String::leak);
        [rasters(name, about, false, images), rasters(of_tiles, about_tiles, true, images)]
    });
    let geotiffs = PRODUCTS.iter().filter_map(|product| product.geotiff.as_ref());
    files.chain(geotiffs.map(|GeoTiffs { name, about, images }| rasters(name, about, false, images))).collect()
});
