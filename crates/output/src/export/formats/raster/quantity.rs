//! Quantities: descriptions of what the pixels of a raster hold, each with its painter, as data.
//!
//! To add a quantity, write one `static` here, and one row in the table of [products](super::product) if users can ask
//! for it by name.

use crate::area::Area;
use crate::export::formats::format::Lack;
use crate::export::formats::raster::reduction::Reduction;
use crate::export::formats::raster::writer::Sample;
use crate::geography::biome::Biome;
use crate::geography::lithology::Lithology;
use crate::land::WaterKind;
use crate::map;
use crate::tile::{Growth, Material, TileView, WETTEST, has_rivers, has_water};
use crate::world::World;

/// A quantity that the pixels of a raster hold, in one type of sample.
#[derive(Debug)]
pub(crate) struct Quantity {
    /// Name of the quantity in the title of a file.
    pub title: &'static str,
    /// Description of each channel, for the manifest and for the file's metadata.
    pub channels: &'static [&'static str],
    pub sample: Sample,
    /// The unit of the values, spelled as in GIS.
    pub unit: Option<&'static str>,
    /// The value of pixels without data.
    pub no_data: Option<f32>,
    /// The rule by which four pixels become one pixel of an overview.
    pub reduction: Reduction,
    /// The values that viewers show as black and as white, if they are known before the raster is.
    pub shown: Option<[f64; 2]>,
    /// True for pictures in sRGB colours; all other rasters are data.
    pub is_colour: bool,
    /// The classes of a raster whose samples are numbers of classes, from class 0 on.
    pub classes: Option<fn() -> Vec<RasterClass>>,
    pub needs: Needs,
    pub paint: Paint,
    /// The same quantity with an opacity channel, for rasters of walks: these have only some of the region's tiles.
    pub with_gaps: Option<&'static Quantity>,
}

/// A class of a raster: its name, and the sRGB colour in which pictures show it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct RasterClass {
    pub name: String,
    pub colour: [u8; 3],
}

/// The part of a world that a quantity needs in addition to the tile itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Needs {
    Nothing,
    /// Rivers or a sea.
    Water,
    Rivers,
    /// A geography, which has climates.
    Geography,
    /// The land far around a tile, since its water drains through the tile.
    Drainage,
}

/// The method by which a quantity is painted.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Paint {
    /// A function that writes the samples of one row of vertices. The row is an area one vertex high.
    Row(fn(TileView, Area, &mut [u8])),
    /// Heights as 65,536 steps over a range.
    Steps,
    /// Heights as 65,536 steps over a range that is widened to whole metres, for dialogs that take only these.
    WholeSteps,
    /// The weight of one material.
    Weight(Material),
    /// The density of one kind of plant, or of rocks.
    Density(Growth),
    /// The map, drawn a tile at a time.
    Map,
}

/// Two quantities are the same if they are the same `static`.
impl PartialEq for Quantity {
    fn eq(&self, other: &Quantity) -> bool {
        std::ptr::eq(self, other)
    }
}

impl Eq for Quantity {}

/// Grey of flat ground in pictures of curvature.
const FLAT: f32 = 128.0;
/// Number of greys on each side of [`FLAT`]: lighter ones for ridges, darker ones for hollows.
const BENDS: f32 = 127.0;

/// Curvature (1 / m) times the spacing of vertices (m) that pictures show as the lightest grey.
const MOST_BENT: f32 = 0.25;

/// Greatest flow accumulation that pictures can show, as a power of ten: 7 stands for 10^7 grid cells.
const MOST_DRAINED: f32 = 7.0;

/// Returns a quantity with the defaults: it needs nothing, has no unit, and its overviews are means.
const fn plain(title: &'static str, sample: Sample, channels: &'static [&'static str], paint: Paint) -> Quantity {
    Quantity {
        title,
        channels,
        sample,
        unit: None,
        no_data: None,
        reduction: Reduction::Mean,
        shown: match sample {
            Sample::Grey8 => Some([0.0, 255.0]),
            _ => None,
        },
        is_colour: false,
        classes: None,
        needs: Needs::Nothing,
        paint,
        with_gaps: None,
    }
}

const fn grey(title: &'static str, channel: &'static [&'static str], paint: Paint) -> Quantity {
    plain(title, Sample::Grey8, channel, paint)
}

const fn floats(
    title: &'static str,
    unit: Option<&'static str>,
    channel: &'static [&'static str],
    paint: fn(TileView, Area, &mut [u8]),
) -> Quantity {
    Quantity { unit, ..plain(title, Sample::Float32, channel, Paint::Row(paint)) }
}

const fn steps(channel: &'static [&'static str], paint: Paint) -> Quantity {
    Quantity { unit: Some("m"), ..plain("height", Sample::Grey16, channel, paint) }
}

pub(crate) static HEIGHT_STEPS: Quantity = steps(&["height, 0 = min_m, 65535 = max_m"], Paint::Steps);

pub(crate) static WHOLE_HEIGHT_STEPS: Quantity =
    steps(&["height, 0 = min_m and 65535 = max_m, both rounded out as in IMPORT.md"], Paint::WholeSteps);

pub(crate) static HEIGHT: Quantity = Quantity {
    // Every vertex has a height. But programs that clip or rotate the raster need a value for pixels outside it.
    no_data: Some(f32::NAN),
    ..floats("height", Some("m"), &["height in metres"], |view, row, samples| {
        copy_floats(view.tile.heights().row(row.y0, row.x0, row.x1), samples);
    })
};

pub(crate) static GROUND_WEIGHTS: Quantity = plain(
    "weights of the ground",
    Sample::Rgba8,
    &["grass", "dirt", "rock", "sand"],
    Paint::Row(|view, row, samples| copy_words(view.tile.blend().ground().row(row.y0, row.x0, row.x1), samples)),
);

pub(crate) static COVER_WEIGHTS: Quantity = plain(
    "weights of the cover",
    Sample::Rgba8,
    &["snow", "forest", "scree", "wetland"],
    Paint::Row(|view, row, samples| copy_words(view.tile.blend().cover().row(row.y0, row.x0, row.x1), samples)),
);

/// The weights of single materials, in the order of [`Material::ALL`].
pub(crate) static WEIGHTS: [Quantity; Material::ALL.len()] = [
    weight(Material::Grass, &["grass"]),
    weight(Material::Dirt, &["dirt"]),
    weight(Material::Rock, &["rock"]),
    weight(Material::Sand, &["sand"]),
    weight(Material::Snow, &["snow"]),
    weight(Material::Forest, &["forest"]),
    weight(Material::Scree, &["scree"]),
    weight(Material::Wetland, &["wetland"]),
];

const fn weight(material: Material, name: &'static [&'static str]) -> Quantity {
    grey(name[0], name, Paint::Weight(material))
}

/// The two materials of greatest weight and their mix, packed into the bits of a float as Terrain3D reads them.
pub(crate) static CONTROL: Quantity =
    floats("control map", None, &["bits: base << 27 | overlay << 22 | blend << 14"], |view, row, samples| {
        for ((x, y), bytes) in row.vertices().zip(samples.as_chunks_mut().0) {
            let weights = Material::ALL.map(|material| view.tile.blend().weight(material, x, y));
            *bytes = control(weights).to_le_bytes();
        }
    });

/// Normals in the OpenGL convention.
pub(crate) static NORMAL: Quantity = plain(
    "normals",
    Sample::Rgb8,
    &["east", "north", "up"],
    Paint::Row(|view, row, samples| {
        let [east, up, south] = view.tile.normals().row(row.y0, row.x0, row.x1);
        let pixels = samples.as_chunks_mut().0.iter_mut();
        for (((pixel, east), up), south) in pixels.zip(east).zip(up).zip(south) {
            // -1..1 becomes 0..255 with 0 at 127.5. Green points up in the image, which is north.
            *pixel = [*east, -south, *up].map(|axis| (axis * 127.5 + 128.0) as u8);
        }
    }),
);

pub(crate) static MAP: Quantity = Quantity {
    is_colour: true,
    with_gaps: Some(&MAP_WITH_GAPS),
    ..plain("map", Sample::Rgb8, &["red", "green", "blue"], Paint::Map)
};

static MAP_WITH_GAPS: Quantity = Quantity {
    is_colour: true,
    ..plain("map", Sample::Rgba8, &["red", "green", "blue", "opacity, 0 where no tile is"], Paint::Map)
};

pub(crate) static COLOUR: Quantity = Quantity {
    is_colour: true,
    ..plain(
        "colour of the ground",
        Sample::Rgb8,
        &["red", "green", "blue"],
        Paint::Row(|view, row, samples| map::colour::paint_row(view.tile, row.y0, samples)),
    )
};

pub(crate) static WATER: Quantity = Quantity {
    reduction: Reduction::Commonest,
    needs: Needs::Water,
    ..grey(
        "kind of water",
        &["water, 0 = none, 64 = river, 128 = lake, 255 = sea"],
        Paint::Row(|view, row, samples| {
            for ((x, y), grey) in row.vertices().zip(samples) {
                *grey = match view.water(x, y).kind {
                    WaterKind::Dry => 0,
                    WaterKind::River => 64,
                    WaterKind::Lake => 128,
                    WaterKind::Sea => 255,
                };
            }
        }),
    )
};

/// Overviews of rivers keep the greatest value: rivers are often one pixel wide, and would fade away in a mean.
pub(crate) static WATER_DEPTH: Quantity = Quantity {
    no_data: Some(0.0),
    reduction: Reduction::Greatest,
    needs: Needs::Water,
    ..floats("depth of the water", Some("m"), &["depth of the water in metres"], |view, row, samples| {
        put_floats(samples, row.vertices().map(|(x, y)| view.water(x, y).depth_m));
    })
};

pub(crate) static FLOW: Quantity = Quantity {
    no_data: Some(0.0),
    reduction: Reduction::Greatest,
    needs: Needs::Rivers,
    ..floats("discharge", Some("m3/s"), &["discharge in cubic metres a second"], |view, row, samples| {
        put_floats(samples, row.vertices().map(|(x, y)| view.water(x, y).flow_m3s));
    })
};

pub(crate) static SLOPE_GREY: Quantity = grey(
    "slope",
    &["slope, 0 = 0 degrees, 255 = 90 degrees"],
    Paint::Row(|view, row, samples| {
        put_greys(samples, row.vertices().map(|(x, y)| view.tile.slope_degrees(x, y) * (255.0 / 90.0)));
    }),
);

pub(crate) static SLOPE: Quantity = Quantity {
    shown: Some([0.0, 60.0]),
    ..floats("slope", Some("degree"), &["slope in degrees"], |view, row, samples| {
        put_floats(samples, row.vertices().map(|(x, y)| view.tile.slope_degrees(x, y)));
    })
};

pub(crate) static ASPECT_GREY: Quantity = grey(
    "aspect",
    &["aspect, 0 = level, 1 = falls to the north, 64 = to the east, 128 = to the south, 192 = to the west"],
    Paint::Row(|view, row, samples| {
        let grey = |degrees: f32| (degrees * (256.0 / 360.0)).round().rem_euclid(256.0).max(1.0);
        put_greys(samples, row.vertices().map(|(x, y)| view.tile.aspect_degrees(x, y).map_or(0.0, grey)));
    }),
);

pub(crate) static ASPECT: Quantity = Quantity {
    // Level ground has no direction.
    no_data: Some(f32::NAN),
    // A mean is wrong for angles: the mean of two directions on both sides of north, 1 and 359 degrees, is south.
    reduction: Reduction::Greatest,
    shown: Some([0.0, 360.0]),
    ..floats(
        "aspect",
        Some("degree"),
        &["aspect in degrees clockwise from north, none on level ground"],
        |view, row, samples| {
            put_floats(samples, row.vertices().map(|(x, y)| view.tile.aspect_degrees(x, y).unwrap_or(f32::NAN)));
        },
    )
};

pub(crate) static STEEPNESS_GREY: Quantity = grey(
    "steepness",
    &["steepness min(slope_scale * (1 - normal.up), 1), 0 = 0, 255 = 1"],
    Paint::Row(|view, row, samples| {
        put_greys(samples, row.vertices().map(|(x, y)| view.steepness(x, y) * 255.0));
    }),
);

pub(crate) static STEEPNESS: Quantity = Quantity {
    shown: Some([0.0, 1.0]),
    ..floats("steepness", None, &["steepness min(slope_scale * (1 - normal.up), 1)"], |view, row, samples| {
        put_floats(samples, row.vertices().map(|(x, y)| view.steepness(x, y)));
    })
};

pub(crate) static CURVATURE_GREY: Quantity = grey(
    "mean curvature",
    &["mean curvature, 128 = flat, 1 = hollow of -0.25 / spacing_m and more, 255 = ridge of 0.25 / spacing_m"],
    Paint::Row(|view, row, samples| {
        let scale = view.tile.spacing_m() as f32 * (BENDS / MOST_BENT);
        let grey = |bent: f32| FLAT + (bent * scale).clamp(-BENDS, BENDS);
        put_greys(samples, view.tile.curvatures(row.y0, row.x0, row.x1).into_iter().map(grey));
    }),
);

pub(crate) static CURVATURE: Quantity = floats(
    "mean curvature",
    Some("1/m"),
    &["mean curvature a metre, above 0 on ridges, below 0 in hollows"],
    |view, row, samples| copy_floats(&view.tile.curvatures(row.y0, row.x0, row.x1), samples),
);

pub(crate) static ACCUMULATION_GREY: Quantity = Quantity {
    reduction: Reduction::Greatest,
    needs: Needs::Drainage,
    ..grey(
        "flow accumulation",
        &["flow accumulation, 255 / 7 * log10(m2 / spacing_m^2), from within 64 vertices and of rivers whole"],
        Paint::Row(|view, row, samples| {
            let square_m2 = (view.tile.spacing_m() * view.tile.spacing_m()) as f32;
            let grey = |m2: &f32| libm::log10f((m2 / square_m2).max(1.0)) * (255.0 / MOST_DRAINED);
            put_greys(samples, view.accumulation_m2().row(row.y0, row.x0, row.x1).iter().map(grey));
        }),
    )
};

pub(crate) static ACCUMULATION: Quantity = Quantity {
    reduction: Reduction::Greatest,
    needs: Needs::Drainage,
    ..floats(
        "flow accumulation",
        Some("m2"),
        &["flow accumulation in m2, from within 64 vertices and of rivers whole"],
        |view, row, samples| copy_floats(view.accumulation_m2().row(row.y0, row.x0, row.x1), samples),
    )
};

pub(crate) static WETNESS_GREY: Quantity = Quantity {
    needs: Needs::Drainage,
    ..grey(
        "topographic wetness index",
        &["wetness index ln(a / tan b), 0 = 0 and less, 255 = 20 and open water"],
        Paint::Row(|view, row, samples| {
            put_greys(samples, row.vertices().map(|(x, y)| view.wetness(x, y) * (255.0 / WETTEST)));
        }),
    )
};

pub(crate) static WETNESS: Quantity = Quantity {
    needs: Needs::Drainage,
    shown: Some([0.0, WETTEST as f64]),
    ..floats(
        "topographic wetness index",
        None,
        &["wetness index ln(a / tan b), a in m2 / m; 20 in open water"],
        |view, row, samples| put_floats(samples, row.vertices().map(|(x, y)| view.wetness(x, y))),
    )
};

pub(crate) static TEMPERATURE_GREY: Quantity = Quantity {
    needs: Needs::Geography,
    ..grey(
        "mean temperature",
        &["mean temperature of the year, 0 = -64 degrees Celsius and less, 128 = 0, 255 = 63.5"],
        Paint::Row(|view, row, samples| {
            put_greys(samples, temperatures_c(view, row).map(|temperature_c| 2.0 * temperature_c + 128.0));
        }),
    )
};

pub(crate) static TEMPERATURE: Quantity = Quantity {
    needs: Needs::Geography,
    shown: Some([-30.0, 30.0]),
    ..floats(
        "mean temperature",
        Some("degC"),
        &["mean temperature of the year in degrees Celsius, at the ground or the surface of the sea"],
        |view, row, samples| put_floats(samples, temperatures_c(view, row)),
    )
};

fn temperatures_c(view: TileView, row: Area) -> impl Iterator<Item = f32> {
    view.climates(row).into_iter().map(|(climate, height_m)| climate.temperature_c(height_m) as f32)
}

pub(crate) static RAIN_GREY: Quantity = Quantity {
    needs: Needs::Geography,
    ..grey(
        "rain",
        &["rain, 0 = 0 mm a year, 255 = 5100 mm a year and more"],
        Paint::Row(|view, row, samples| put_greys(samples, rain_mm(view, row).map(|rain_mm| rain_mm / 20.0))),
    )
};

pub(crate) static RAIN: Quantity = Quantity {
    needs: Needs::Geography,
    shown: Some([0.0, 3000.0]),
    ..floats("rain", Some("mm/year"), &["rain in millimetres a year"], |view, row, samples| {
        put_floats(samples, rain_mm(view, row));
    })
};

fn rain_mm(view: TileView, row: Area) -> impl Iterator<Item = f32> {
    view.climates(row).into_iter().map(|(climate, _)| climate.rain_mm_a_year() as f32)
}

pub(crate) static SEASON_GREY: Quantity = Quantity {
    needs: Needs::Geography,
    ..grey(
        "season of rain",
        &["share of the rain that falls in the warm half of the year, 0 = 0, 255 = 1"],
        Paint::Row(|view, row, samples| put_greys(samples, summer_shares(view, row).map(|share| share * 255.0))),
    )
};

pub(crate) static SEASON: Quantity = Quantity {
    needs: Needs::Geography,
    shown: Some([0.0, 1.0]),
    ..floats(
        "season of rain",
        None,
        &["share of the rain that falls in the warm half of the year, 0 to 1"],
        |view, row, samples| put_floats(samples, summer_shares(view, row)),
    )
};

fn summer_shares(view: TileView, row: Area) -> impl Iterator<Item = f32> {
    view.climates(row).into_iter().map(|(climate, _)| climate.summer_share() as f32)
}

pub(crate) static BIOME: Quantity = Quantity {
    no_data: Some(0.0),
    reduction: Reduction::Commonest,
    shown: Some([0.0, 30.0]),
    classes: Some(biomes),
    needs: Needs::Geography,
    ..grey(
        "biome",
        &["number of the biome in the order of Peel et al. 2007, 0 = sea, 1 = Af, 4 = BWh, 8 = Csa, 17 = Dsa, 30 = EF"],
        Paint::Row(|view, row, samples| {
            let climates = view.climates(row);
            for (((x, y), number), (climate, height_m)) in row.vertices().zip(samples).zip(climates) {
                *number = match view.lake_or_sea(x, y) {
                    WaterKind::Sea => 0,
                    WaterKind::Dry | WaterKind::River | WaterKind::Lake => 1 + climate.biome(height_m) as u8,
                };
            }
        }),
    )
};

/// Returns the classes of [`BIOME`]: the sea, then the biomes in their order.
fn biomes() -> Vec<RasterClass> {
    let class =
        |biome: Biome| RasterClass { name: format!("{} {}", biome.code(), biome.name()), colour: biome.colour() };
    after_sea(Biome::all().map(class))
}

/// Returns the class 0 of the sea, then others.
fn after_sea(others: impl Iterator<Item = RasterClass>) -> Vec<RasterClass> {
    [RasterClass { name: "sea".into(), colour: [255; 3] }].into_iter().chain(others).collect()
}

pub(crate) static ROCK: Quantity = Quantity {
    no_data: Some(0.0),
    reduction: Reduction::Commonest,
    shown: Some([0.0, 12.0]),
    classes: Some(rocks),
    needs: Needs::Geography,
    ..grey(
        "rock",
        &["number of the rock, 0 = sea, 1 = granite, 3 = sandstone, 4 = limestone, 6 = basalt, 12 = dune sand"],
        Paint::Row(|view, row, samples| {
            for (((x, y), number), rock) in row.vertices().zip(samples).zip(view.lithologies(row)) {
                *number = match view.lake_or_sea(x, y) {
                    WaterKind::Sea => 0,
                    WaterKind::Dry | WaterKind::River | WaterKind::Lake => 1 + rock as u8,
                };
            }
        }),
    )
};

/// Returns the classes of [`ROCK`]: the sea, then the rocks in their order.
fn rocks() -> Vec<RasterClass> {
    after_sea(Lithology::all().map(|rock| RasterClass { name: rock.name().into(), colour: rock.colour() }))
}

pub(crate) static STRIKE_GREY: Quantity = Quantity {
    // A mean is wrong for strikes: the mean of 1 and 179 degrees, which are nearly the same, is 90.
    reduction: Reduction::Greatest,
    needs: Needs::Geography,
    ..grey(
        "strike of the beds",
        &["strike of the beds, 0 = north to south, 64 = north-east to south-west, 128 = east to west"],
        Paint::Row(|view, row, samples| {
            let grey = |degrees: f32| (degrees * (256.0 / 180.0)).round().rem_euclid(256.0);
            put_greys(samples, view.beds(row).into_iter().map(|beds| grey(beds.strike_deg as f32)));
        }),
    )
};

pub(crate) static STRIKE: Quantity = Quantity {
    reduction: Reduction::Greatest,
    needs: Needs::Geography,
    shown: Some([0.0, 180.0]),
    ..floats(
        "strike of the beds",
        Some("degree"),
        &["strike of the beds in degrees clockwise from north, 0 to 180"],
        |view, row, samples| put_floats(samples, view.beds(row).into_iter().map(|beds| beds.strike_deg as f32)),
    )
};

pub(crate) static DIP_GREY: Quantity = Quantity {
    needs: Needs::Geography,
    ..grey(
        "dip of the beds",
        &["dip of the beds, 0 = level, 255 = 90 degrees"],
        Paint::Row(|view, row, samples| {
            put_greys(samples, view.beds(row).into_iter().map(|beds| beds.dip_deg as f32 * (255.0 / 90.0)));
        }),
    )
};

pub(crate) static DIP: Quantity = Quantity {
    needs: Needs::Geography,
    shown: Some([0.0, 60.0]),
    ..floats(
        "dip of the beds",
        Some("degree"),
        &["dip of the beds in degrees, 0 where they lie level"],
        |view, row, samples| put_floats(samples, view.beds(row).into_iter().map(|beds| beds.dip_deg as f32)),
    )
};

pub(crate) static UPLIFT_GREY: Quantity = Quantity {
    needs: Needs::Geography,
    ..grey(
        "uplift",
        &["uplift, 0 = 0, 255 = 1"],
        Paint::Row(|view, row, samples| put_greys(samples, uplifts(view, row).map(|uplift| uplift * 255.0))),
    )
};

pub(crate) static UPLIFT: Quantity = Quantity {
    needs: Needs::Geography,
    shown: Some([0.0, 1.0]),
    ..floats(
        "uplift",
        None,
        &["uplift, 0.02 in plains, 0.1 in hills, up to 1 in young ranges"],
        |view, row, samples| {
            put_floats(samples, uplifts(view, row));
        },
    )
};

fn uplifts(view: TileView, row: Area) -> impl Iterator<Item = f32> {
    view.uplifts(row).into_iter().map(|uplift| uplift as f32)
}

/// The densities of plants and rocks, in the order of [`Growth::ALL`].
pub(crate) static DENSITIES: [Quantity; Growth::ALL.len()] =
    [density(Growth::Tree), density(Growth::Shrub), density(Growth::Grass), density(Growth::Rock)];

const fn density(growth: Growth) -> Quantity {
    Quantity { needs: Needs::Drainage, ..grey(growth.about(), growth.samples(), Paint::Density(growth)) }
}

impl Quantity {
    /// True if the samples are steps over a range of heights.
    pub fn is_steps(&self) -> bool {
        matches!(self.paint, Paint::Steps | Paint::WholeSteps)
    }

    /// True if the land far around a tile must be made to find how much water drains through the tile.
    pub fn is_of_accumulation(&self) -> bool {
        self.needs == Needs::Drainage
    }

    /// Returns the quantity for a region's raster of a walk, which has gaps where there is no tile: the one with an
    /// opacity channel, if there is one.
    pub fn of_walk(&'static self) -> &'static Quantity {
        self.with_gaps.unwrap_or(self)
    }

    /// Returns the bytes of a pixel where there is no tile, or `None` if every value of the quantity has a meaning.
    pub fn gap(&self) -> Option<[u8; 4]> {
        match (self.paint, self.sample) {
            (Paint::Map, Sample::Rgba8) => Some([0; 4]),
            (_, Sample::Float32) => self.no_data.map(f32::to_le_bytes),
            _ => None,
        }
    }

    /// Returns what this quantity would show but a world lacks, or `None` if the world has it.
    pub fn lacks(&self, world: &World) -> Option<Lack> {
        let rivers =
            Lack { shows: "the discharge of rivers", has: "none", preset: "a preset with [fluvial] or [rivers]" };
        let water = Lack {
            shows: "water",
            has: "neither rivers nor a sea",
            preset: "a preset with [fluvial], [rivers] or sea_level_m",
        };
        let geography = Lack {
            shows: "what a whole world has at large",
            has: "no geography",
            preset: "a preset with [geography], such as world",
        };
        match self.needs {
            Needs::Geography => world.geography().is_none().then_some(geography),
            Needs::Rivers => (!has_rivers(world)).then_some(rivers),
            Needs::Water => (!has_water(world)).then_some(water),
            Needs::Nothing | Needs::Drainage => None,
        }
    }
}

/// Returns Terrain3D's control bits of a vertex: the texture of greatest weight, the second, and the second's share of
/// the weight of both. Textures have the numbers of the materials. Based on: Terrain3D's manual, "Control Map
/// Encoding".
fn control(weights: [u8; Material::ALL.len()]) -> u32 {
    let mut order: [usize; Material::ALL.len()] = std::array::from_fn(|material| material);
    // The sort is stable: of materials of equal weight the first one wins.
    order.sort_by_key(|&material| std::cmp::Reverse(weights[material]));
    let [most, second] = [order[0], order[1]].map(|material| u32::from(weights[material]));
    // This is never zero, since the weights of a vertex sum to 255.
    let both = most + second;
    let blend = (second * 255 + both / 2) / both;
    (order[0] as u32) << 27 | (order[1] as u32) << 22 | blend << 14
}

/// Writes greys, rounded and clamped to 0 to 255.
pub(super) fn put_greys(row: &mut [u8], greys: impl Iterator<Item = f32>) {
    for (grey, value) in row.iter_mut().zip(greys) {
        // The cast saturates.
        *grey = (value + 0.5) as u8;
    }
}

fn put_floats(row: &mut [u8], floats: impl Iterator<Item = f32>) {
    for (bytes, float) in row.as_chunks_mut().0.iter_mut().zip(floats) {
        *bytes = float.to_le_bytes();
    }
}

fn copy_floats(floats: &[f32], row: &mut [u8]) {
    put_floats(row, floats.iter().copied());
}

fn copy_words(words: &[u32], row: &mut [u8]) {
    for (word, bytes) in words.iter().zip(row.as_chunks_mut().0) {
        *bytes = word.to_le_bytes();
    }
}
