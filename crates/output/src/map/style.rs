//! Styles: an author's settings for how a map is drawn. They are never part of a world.

use std::fmt::{self, Display, Formatter};
use std::path::Path;

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::{Deserialize, Serialize};
use serde_json::json;

use crate::error::Error;
use crate::lines::RoadClass;
use crate::map::font::{Face, Font, Typeface};
use crate::preset::map::Tint;
use crate::recipe::fault::{Fault, KeyPath};
use crate::recipe::source::{Recipe, RecipeSources};
use crate::world::World;

/// The built-in styles, as name and text: the files of `styles/`.
pub const STYLES: &[(&str, &str)] = &[
    ("topographic", include_str!(concat!(env!("TERRANE_STYLES"), "/topographic.toml"))),
    ("atlas", include_str!(concat!(env!("TERRANE_STYLES"), "/atlas.toml"))),
    ("parchment", include_str!(concat!(env!("TERRANE_STYLES"), "/parchment.toml"))),
    ("satellite", include_str!(concat!(env!("TERRANE_STYLES"), "/satellite.toml"))),
    ("relief", include_str!(concat!(env!("TERRANE_STYLES"), "/relief.toml"))),
    ("night", include_str!(concat!(env!("TERRANE_STYLES"), "/night.toml"))),
    ("plain", include_str!(concat!(env!("TERRANE_STYLES"), "/plain.toml"))),
    ("climate", include_str!(concat!(env!("TERRANE_STYLES"), "/climate.toml"))),
    ("geology", include_str!(concat!(env!("TERRANE_STYLES"), "/geology.toml"))),
];

/// Appearance of a map: the content of a style file. Lengths are millimetres on paper, colours `"#rrggbb"`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Style {
    /// The sheet around the map.
    pub paper: Colour,
    /// Lines and text around the map.
    pub ink: Colour,
    /// Colours by height and depth.
    pub tint: TintStyle,
    /// Light and shadow.
    pub relief: ReliefStyle,
    /// Materials of the ground, seen through the tint.
    pub cover: CoverStyle,
    /// Strokes on rock and slopes, and the stones of scree.
    pub signs: SignsStyle,
    /// Lines of equal height.
    pub contours: ContourStyle,
    /// Rivers, lakes and the sea.
    pub water: WaterStyle,
    /// Roads, by class.
    pub roads: RoadsStyle,
    /// Settlements and peaks.
    pub places: PlacesStyle,
    /// Names and heights.
    pub labels: LabelsStyle,
}

/// Colours by height and depth, interpolated in OKLab, or those of biomes or of rocks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TintStyle {
    /// Property of land that gives it its colour: its height, its biome, whose colours are those of Peel et al. 2007,
    /// or its rock, whose colours are those of the U.S. Geological Survey. Only for a world with a geography can they
    /// be biome and rock. Default: "height".
    #[serde(default)]
    pub by: TintBy,
    /// Land of most presets, from the lowest to the highest.
    #[schemars(length(min = 2, max = 32))]
    pub temperate: Vec<ColourStop>,
    /// Dry land.
    #[schemars(length(min = 2, max = 32))]
    pub arid: Vec<ColourStop>,
    /// High mountains.
    #[schemars(length(min = 2, max = 32))]
    pub alpine: Vec<ColourStop>,
    /// The sea, from the shore to the deepest.
    #[schemars(length(min = 2, max = 32))]
    pub sea: Vec<ColourStop>,
    /// Number of steps in which the colours of the sea change, 0 to 20; 0 is smooth.
    #[schemars(range(min = 0, max = 20))]
    pub depth_steps: u32,
}

/// Property of land that gives it its colour.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum TintBy {
    /// The height.
    #[default]
    Height,
    /// The biome.
    Biome,
    /// The rock.
    Rock,
}

/// A colour at a place on a scale of colours.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Stop")]
pub struct ColourStop {
    /// Place on the scale as a share of its length, 0 to 1.
    #[schemars(range(min = 0, max = 1))]
    pub at: f64,
    /// The colour at this place.
    pub colour: Colour,
}

/// Light and shadow.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ReliefStyle {
    /// Direction from which the main light comes, in degrees clockwise from north, 0 to 360.
    #[schemars(range(min = 0, max = 360))]
    pub sun_deg: f64,
    /// Largest angle in degrees by which the light turns from place to place so that ridges show best, 0 to 60.
    #[schemars(range(min = 0, max = 60))]
    pub turn_deg: f64,
    /// Share of the light that comes from 60 degrees to both sides, 0 to 1.
    #[schemars(range(min = 0, max = 1))]
    pub soften: f64,
    /// Factor by which slopes are steepened at 1:25,000, 0.1 to 20; more at smaller scales, where slopes are gentler.
    #[schemars(range(min = 0.1, max = 20))]
    pub exaggeration: f64,
    /// Strength of light and shadow, 0 to 2.
    #[schemars(range(min = 0, max = 2))]
    pub strength: f64,
    /// Colour by which the colour of the ground is multiplied in full shadow: the darker, the deeper the shadow.
    pub shadow: Colour,
    /// Colour that is mixed into the colour of the ground in full light.
    pub light: Colour,
    /// Share of `light` that is mixed in, 0 to 1.
    #[schemars(range(min = 0, max = 1))]
    pub highlight: f64,
    /// Strength of texture shading, which lightens ridges and darkens hollows of all sizes alike, 0 to 2.
    #[schemars(range(min = 0, max = 2))]
    pub texture: f64,
    /// Strength of the darkening of hollows, which see little of the sky, 0 to 2.
    #[schemars(range(min = 0, max = 2))]
    pub sky: f64,
    /// Strength of the shadows that heights cast in low light, 0 to 2.
    #[schemars(range(min = 0, max = 2))]
    pub cast: f64,
    /// Share by which light and shadow are weaker in the lowlands than on the heights, 0 to 1.
    #[schemars(range(min = 0, max = 1))]
    pub aerial: f64,
    /// The colour of the air over lowlands.
    pub haze: Colour,
    /// Share of `haze` in the colour of the lowest land, 0 to 1.
    #[schemars(range(min = 0, max = 1))]
    pub haze_share: f64,
    /// Strength of light and shadow on the sea floor, 0 to 1.
    #[schemars(range(min = 0, max = 1))]
    pub under_water: f64,
}

/// Materials of the ground, seen through the tint: the colour of each and the share of it that is seen, 0 to 1.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CoverStyle {
    /// Grass.
    pub grass: Cover,
    /// Bare soil.
    pub dirt: Cover,
    /// Rock.
    pub rock: Cover,
    /// Sand.
    pub sand: Cover,
    /// Snow and ice.
    pub snow: Cover,
    /// Forest.
    pub forest: Cover,
    /// Scree.
    pub scree: Cover,
    /// Wet ground.
    pub wetland: Cover,
    /// Strength, 0 to 1, with which these colours differ by climate: with 1, grass is straw in steppes, and forest dark
    /// green in the tropics. A world without a geography has the same colours everywhere. Default: 0.
    #[serde(default)]
    #[schemars(range(min = 0, max = 1))]
    pub by_climate: f64,
}

/// Appearance of a material of the ground.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cover {
    /// Colour of the material.
    pub colour: Colour,
    /// Share of the colour that is seen where the ground is of this material, 0 to 1.
    #[schemars(range(min = 0, max = 1))]
    pub share: f64,
}

/// Strokes on rock and slopes, and the stones of scree.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SignsStyle {
    /// Colour of strokes and stones.
    pub colour: Colour,
    /// Opacity of strokes and stones, 0 to 1.
    #[schemars(range(min = 0, max = 1))]
    pub opacity: f64,
    /// Width of the widest strokes, 0 to 2 mm.
    #[schemars(range(min = 0, max = 2))]
    pub width_mm: f64,
    /// Share of steep rock that has strokes down the slope, 0 to 1.
    #[schemars(range(min = 0, max = 1))]
    pub rock: f64,
    /// Share of scree that has stones, 0 to 1.
    #[schemars(range(min = 0, max = 1))]
    pub scree: f64,
    /// Share of all slopes that have strokes (hachures), as on maps from the time without contours, 0 to 1.
    #[schemars(range(min = 0, max = 1))]
    pub hachures: f64,
    /// Smallest scale at which strokes on rock and stones are drawn, as the second number of 1:25,000;
    /// 1 to 1,000,000,000.
    #[schemars(range(min = 1, max = 1_000_000_000))]
    pub most: f64,
}

/// Lines of equal height.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ContourStyle {
    /// True if contours are drawn.
    pub draw: bool,
    /// Colour of contours on land.
    pub colour: Colour,
    /// Colour of contours on snow and ice.
    pub on_snow: Colour,
    /// Width of the lines between index contours, 0 to 5 mm.
    #[schemars(range(min = 0, max = 5))]
    pub width_mm: f64,
    /// Width of index contours, which are each fifth line, 0 to 5 mm.
    #[schemars(range(min = 0, max = 5))]
    pub index_width_mm: f64,
    /// Opacity of contours, 0 to 1.
    #[schemars(range(min = 0, max = 1))]
    pub opacity: f64,
    /// Millimetres between contours on the steeper slopes of the world, which count as 45 degrees at most, 0.05 to 5:
    /// the interval is chosen by this distance.
    #[schemars(range(min = 0.05, max = 5))]
    pub spacing_mm: f64,
    /// Interval of contours: metres from a line to the next, 0.1 to 10,000. Default: chosen by scale and relief.
    #[schemars(range(min = 0.1, max = 10000))]
    pub interval_m: Option<f64>,
}

/// Rivers, lakes and the sea.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WaterStyle {
    /// True if rivers, lakes and coasts are drawn.
    pub draw: bool,
    /// Colour of rivers and of the lines of shores and coasts.
    pub line: Colour,
    /// Colour of lakes, and of rivers between their banks where there is room between the banks.
    pub fill: Colour,
    /// Colour of salt pans: lakes without outlet in dry lands, whose water is shallow brine upon white salt.
    pub pan: Colour,
    /// Widths of the smallest and of the largest river, 0 to 10 mm.
    #[schemars(length(min = 2, max = 2), inner(range(min = 0, max = 10)))]
    pub river_mm: [f64; 2],
    /// Width of the lines of shores and coasts, 0 to 5 mm.
    #[schemars(range(min = 0, max = 5))]
    pub shore_mm: f64,
    /// Width of depth contours in the sea, which have the interval of contours on land, 0 to 5 mm; 0 for none.
    #[schemars(range(min = 0, max = 5))]
    pub depth_mm: f64,
    /// Square kilometres that drain to the smallest river that is drawn, at a scale of 1:100,000, 0.01 to 10,000. At
    /// larger scales they cover the same area on paper, at smaller ones less of it: 0.3 times as much at 1:1,000,000.
    /// Where runoff differs by place, this is for the mean of Earth's land: drier land needs up to four times as much.
    #[schemars(range(min = 0.01, max = 10000))]
    pub least_km2: f64,
}

/// Roads.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RoadsStyle {
    /// True if roads are drawn.
    pub draw: bool,
    /// Colour of the edges (casings) of roads.
    pub casing: Colour,
    /// Styles of highways, roads and tracks, in this order.
    #[schemars(length(min = 3, max = 3))]
    pub classes: [RoadStyle; 3],
}

/// A class of roads.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RoadStyle {
    /// Colour of the road between its edges.
    pub colour: Colour,
    /// Width of the road without edges, 0 to 10 mm.
    #[schemars(range(min = 0, max = 10))]
    pub width_mm: f64,
    /// The width of each edge, 0 to 5 mm.
    #[schemars(range(min = 0, max = 5))]
    pub casing_mm: f64,
    /// Smallest scale at which the class is drawn, as the second number of 1:25,000; 1 to 1,000,000,000.
    #[schemars(range(min = 1, max = 1_000_000_000))]
    pub most: f64,
}

/// Settlements and peaks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlacesStyle {
    /// True if settlements are drawn.
    pub draw: bool,
    /// Colour of symbols.
    pub colour: Colour,
    /// Colour inside the symbols of settlements.
    pub fill: Colour,
    /// Colour of houses.
    pub houses: Colour,
    /// Smallest scale at which houses are drawn, as the second number of 1:25,000; 1 to 1,000,000.
    #[schemars(range(min = 1, max = 1_000_000))]
    pub houses_most: f64,
}

/// Names and heights.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LabelsStyle {
    /// True if names and heights are written.
    pub draw: bool,
    /// File of a TrueType or OpenType font for all text, also that of the sheet, whatever its face. The file is named
    /// from the style's folder, or with `--style-set` from where the command runs. Letters that the font lacks, and all
    /// text where there is no file, are set in Libertinus Serif.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub font: Option<String>,
    /// The font of that file, once it has been read.
    #[serde(skip)]
    pub own_font: Option<Font>,
    /// Colour of the halo around each letter.
    pub halo: Colour,
    /// Width of the halo, 0 to 3 mm.
    #[schemars(range(min = 0, max = 3))]
    pub halo_mm: f64,
    /// Names of towns, villages and hamlets, in this order.
    #[schemars(length(min = 3, max = 3))]
    pub places: [LabelStyle; 3],
    /// Names and heights of peaks.
    pub peak: LabelStyle,
    /// Names of rivers.
    pub river: LabelStyle,
    /// Names of lakes.
    pub lake: LabelStyle,
    /// Names of mountain ranges, whose letters stand further apart where there is room.
    pub range: LabelStyle,
    /// Names of valleys.
    pub valley: LabelStyle,
    /// Heights of index contours, which are each fifth line, in gaps of the line.
    pub contour: LabelStyle,
}

impl LabelsStyle {
    /// Returns the typeface for text of a face: the face, with the style's own font in front if there is one.
    pub fn typeface(&self, face: Face) -> Typeface {
        Typeface { face, own: self.own_font }
    }
}

/// Lettering of the names of one kind.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LabelStyle {
    /// Colour of the letters.
    pub colour: Colour,
    /// Face of the letters.
    pub face: Face,
    /// Font size, which is the height of a line, 0.1 to 50 mm.
    #[schemars(range(min = 0.1, max = 50))]
    pub size_mm: f64,
    /// Extra space between the letters, as a share of the height of a line, 0 to 5.
    #[schemars(range(min = 0, max = 5))]
    pub spacing: f64,
}

/// A colour in sRGB.
#[derive(Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Colour(pub [u8; 3]);

impl TryFrom<String> for Colour {
    type Error = String;

    fn try_from(text: String) -> Result<Colour, String> {
        let digits = text.strip_prefix('#').filter(|digits| digits.len() == 6 && digits.is_ascii());
        let byte = |at: usize| digits.and_then(|digits| u8::from_str_radix(&digits[at..at + 2], 16).ok());
        match (byte(0), byte(2), byte(4)) {
            (Some(red), Some(green), Some(blue)) => Ok(Colour([red, green, blue])),
            _ => Err(format!("expected a colour such as \"#a0b4c8\", found {text:?}")),
        }
    }
}

impl From<Colour> for String {
    fn from(colour: Colour) -> String {
        colour.to_string()
    }
}

impl Display for Colour {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let [red, green, blue] = self.0;
        write!(f, "#{red:02x}{green:02x}{blue:02x}")
    }
}

impl fmt::Debug for Colour {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        Display::fmt(self, f)
    }
}

impl JsonSchema for Colour {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Colour".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json!({ "type": "string", "pattern": "^#[0-9a-fA-F]{6}$" }).try_into().expect("it is an object")
    }
}

impl TintStyle {
    /// Returns the colours of land of a kind.
    pub fn land(&self, tint: Tint) -> &[ColourStop] {
        match tint {
            Tint::Temperate => &self.temperate,
            Tint::Arid => &self.arid,
            Tint::Alpine => &self.alpine,
        }
    }
}

impl RoadsStyle {
    /// Returns the style of roads of a class.
    pub fn class(&self, class: RoadClass) -> &RoadStyle {
        let [highway, road, track] = &self.classes;
        match class {
            RoadClass::Highway => highway,
            RoadClass::Road => road,
            RoadClass::Track => track,
        }
    }
}

impl SignsStyle {
    /// True if any signs are drawn at a scale, given its denominator.
    pub fn are_drawn(&self, denominator: f64) -> bool {
        let near = denominator <= self.most && self.rock.max(self.scree) > 0.0;
        self.width_mm > 0.0 && (near || self.hachures > 0.0)
    }
}

impl CoverStyle {
    /// Returns the covers of all materials, in the order of [`Material::ALL`](crate::tile::Material::ALL).
    pub fn all(&self) -> [Cover; 8] {
        [self.grass, self.dirt, self.rock, self.sand, self.snow, self.forest, self.scree, self.wetland]
    }
}

impl Style {
    /// Loads the built-in style of that name, or else the style in the file of that path.
    ///
    /// # Errors
    /// When there is no such style, or when it cannot be read or understood.
    pub fn load(name_or_path: &str) -> Result<Style, Error> {
        RecipeSources::load(name_or_path)?.read_all()
    }

    /// Checks that a world has what maps in this style show.
    ///
    /// # Errors
    /// When land is coloured by its biome or its rock, and the world has no geography.
    pub fn check_for(&self, world: &World) -> Result<(), Error> {
        let message = match self.tint.by {
            _ if world.geography().is_some() => return Ok(()),
            TintBy::Height => return Ok(()),
            TintBy::Biome => "the style colours land by its biome, and this world has no climates",
            TintBy::Rock => "the style colours land by its rock, and this world has no geography",
        };
        Err(Error::Option {
            message: message.into(),
            hint: "draw a world with a geography, such as the preset world, or take another style".into(),
        })
    }

    /// Returns the JSON schema of style files.
    pub fn schema() -> serde_json::Value {
        let mut schema = crate::recipe::schema::of::<Style>();
        schema["properties"]["extends"] = json!({
            "type": "string",
            "description": "A built-in style, or the path of a file from this one's folder, on which this one is built: its \
                tables are merged with this one's, and all else here takes the place of what is there. Default: none.",
        });
        schema
    }
}

impl Recipe for Style {
    const WHAT: &'static str = "style";
    const FOLDER: &'static str = "styles";
    const BUILT_IN: &'static [(&'static str, &'static str)] = STYLES;
    const FILES: &'static [&'static [&'static str]] = &[&["labels", "font"]];

    fn complete(&mut self) -> Result<(), Fault> {
        let root = KeyPath::default().key("tint");
        let scales = [
            ("temperate", &self.tint.temperate),
            ("arid", &self.tint.arid),
            ("alpine", &self.tint.alpine),
            ("sea", &self.tint.sea),
        ];
        for (name, stops) in scales {
            let path = root.key(name);
            if let Some(index) = (1..stops.len()).find(|index| stops[*index].at <= stops[index - 1].at) {
                let message = format!("expected more than {}, where the colour before it is", stops[index - 1].at);
                return Err(path.index(index).key("at").fault(message, "").found(stops[index].at));
            }
            if stops[0].at != 0.0 || stops[stops.len() - 1].at != 1.0 {
                return Err(path.fault("expected colours from 0 to 1", "give the first at = 0 and the last at = 1"));
            }
        }
        if let Some(file) = &self.labels.font {
            let refused = |error: String| {
                let hint = "name a TrueType or OpenType file (.ttf, .otf, .ttc) from the folder of the style";
                KeyPath::default().key("labels").key("font").fault(format!("{file:?} {error}"), hint)
            };
            self.labels.own_font = Some(Font::read(Path::new(file)).map_err(refused)?);
        }
        Ok(())
    }
}
