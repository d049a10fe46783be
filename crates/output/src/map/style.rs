//! Styles: what an author says about how a map is drawn. Never part of a world.

use std::fmt::{self, Display, Formatter};
use std::path::Path;

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::{Deserialize, Serialize};
use serde_json::json;

use crate::error::Error;
use crate::map::font::{Face, Font, Typeface};
use crate::preset::map::Tint;
use crate::recipe::fault::{Fault, KeyPath};
use crate::recipe::source::{Recipe, Sources};

/// The built-in styles, as name and text: the files of `styles/`.
pub const STYLES: &[(&str, &str)] = &[
    ("topographic", include_str!(concat!(env!("TERRANE_STYLES"), "/topographic.toml"))),
    ("atlas", include_str!(concat!(env!("TERRANE_STYLES"), "/atlas.toml"))),
    ("parchment", include_str!(concat!(env!("TERRANE_STYLES"), "/parchment.toml"))),
    ("satellite", include_str!(concat!(env!("TERRANE_STYLES"), "/satellite.toml"))),
    ("relief", include_str!(concat!(env!("TERRANE_STYLES"), "/relief.toml"))),
    ("night", include_str!(concat!(env!("TERRANE_STYLES"), "/night.toml"))),
    ("plain", include_str!(concat!(env!("TERRANE_STYLES"), "/plain.toml"))),
];

/// How a map is drawn: the content of a style file. Lengths are millimetres on paper, colours `"#rrggbb"`.
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
    /// What the ground is made of, seen through the tint.
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

/// Colours by height and depth, interpolated in OKLab.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TintStyle {
    /// Land of most presets, from the lowest to the highest.
    #[schemars(length(min = 2, max = 32))]
    pub temperate: Vec<Stop>,
    /// Dry land.
    #[schemars(length(min = 2, max = 32))]
    pub arid: Vec<Stop>,
    /// High mountains.
    #[schemars(length(min = 2, max = 32))]
    pub alpine: Vec<Stop>,
    /// The sea, from the shore to the deepest.
    #[schemars(length(min = 2, max = 32))]
    pub sea: Vec<Stop>,
    /// Steps that the colours of the sea go in, 0 to 20; 0 is smooth.
    #[schemars(range(min = 0, max = 20))]
    pub depth_steps: u32,
}

/// A colour at a share of a scale.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Stop {
    /// The share of the scale, 0 to 1.
    #[schemars(range(min = 0, max = 1))]
    pub at: f64,
    /// The colour there.
    pub colour: Colour,
}

/// Light and shadow.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ReliefStyle {
    /// Where the main light comes from, in degrees clockwise from north, 0 to 360.
    #[schemars(range(min = 0, max = 360))]
    pub sun_deg: f64,
    /// Degrees by which the light turns towards what ridges show best, 0 to 60.
    #[schemars(range(min = 0, max = 60))]
    pub turn_deg: f64,
    /// How much of the light comes from 60 degrees to both sides, 0 to 1.
    #[schemars(range(min = 0, max = 1))]
    pub soften: f64,
    /// How many times the slopes are steepened at 1:25,000, 0.1 to 20; more at smaller scales, where slopes are gentler.
    #[schemars(range(min = 0.1, max = 20))]
    pub exaggeration: f64,
    /// How much of light and shadow is seen, 0 to 2.
    #[schemars(range(min = 0, max = 2))]
    pub strength: f64,
    /// What a colour is multiplied by in full shadow: the darker, the deeper.
    pub shadow: Colour,
    /// What a colour is mixed with in full light.
    pub light: Colour,
    /// How much of that is mixed in, 0 to 1.
    #[schemars(range(min = 0, max = 1))]
    pub highlight: f64,
    /// How much ridges are lightened and hollows darkened at all sizes alike, 0 to 2.
    #[schemars(range(min = 0, max = 2))]
    pub texture: f64,
    /// How much darker hollows are, which see little of the sky, 0 to 2.
    #[schemars(range(min = 0, max = 2))]
    pub sky: f64,
    /// How much of the shadows that heights cast in low light is seen, 0 to 2.
    #[schemars(range(min = 0, max = 2))]
    pub cast: f64,
    /// How much weaker light and shadow are in the lowlands than on the heights, 0 to 1.
    #[schemars(range(min = 0, max = 1))]
    pub aerial: f64,
    /// The colour of the air over lowlands.
    pub haze: Colour,
    /// How much of it is seen over the lowest land, 0 to 1.
    #[schemars(range(min = 0, max = 1))]
    pub haze_share: f64,
    /// How much of the light and shadow of the sea floor is seen, 0 to 1.
    #[schemars(range(min = 0, max = 1))]
    pub under_water: f64,
}

/// What the ground is made of, seen through the tint: colours and how much of each is seen, 0 to 1.
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
}

/// How a material is seen.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cover {
    /// Its colour.
    pub colour: Colour,
    /// How much of it is seen, 0 to 1.
    #[schemars(range(min = 0, max = 1))]
    pub share: f64,
}

/// Strokes on rock and slopes, and the stones of scree.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SignsStyle {
    /// Their colour.
    pub colour: Colour,
    /// Their opacity, 0 to 1.
    #[schemars(range(min = 0, max = 1))]
    pub opacity: f64,
    /// Width of the widest strokes, 0 to 2 mm.
    #[schemars(range(min = 0, max = 2))]
    pub width_mm: f64,
    /// How much of steep rock has strokes down the slope, 0 to 1.
    #[schemars(range(min = 0, max = 1))]
    pub rock: f64,
    /// How much of scree has stones, 0 to 1.
    #[schemars(range(min = 0, max = 1))]
    pub scree: f64,
    /// How much of all slopes has strokes, as maps had before contours, 0 to 1.
    #[schemars(range(min = 0, max = 1))]
    pub hachures: f64,
    /// The scale from which on strokes on rock and stones are left out, as the second number of 1:25,000; 1 to 1,000,000,000.
    #[schemars(range(min = 1, max = 1_000_000_000))]
    pub most: f64,
}

/// Lines of equal height.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ContourStyle {
    /// Whether there are any.
    pub draw: bool,
    /// Their colour on land.
    pub colour: Colour,
    /// Their colour on snow and ice.
    pub on_snow: Colour,
    /// Widths of the lines between, and of each fifth, 0 to 5 mm.
    #[schemars(range(min = 0, max = 5))]
    pub width_mm: f64,
    /// Width of each fifth line, 0 to 5 mm.
    #[schemars(range(min = 0, max = 5))]
    pub index_width_mm: f64,
    /// Opacity, 0 to 1.
    #[schemars(range(min = 0, max = 1))]
    pub opacity: f64,
    /// Millimetres between the lines on a slope of 45 degrees, 0.05 to 5: what the interval is chosen by.
    #[schemars(range(min = 0.05, max = 5))]
    pub spacing_mm: f64,
    /// Metres from a line to the next, 0.1 to 10,000. Default: chosen by scale and relief.
    #[schemars(range(min = 0.1, max = 10000))]
    pub interval_m: Option<f64>,
}

/// Rivers, lakes and the sea.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WaterStyle {
    /// Whether rivers, lakes and coasts are drawn.
    pub draw: bool,
    /// Rivers and the lines of shores and coasts.
    pub line: Colour,
    /// Lakes, and rivers between their banks where these are apart.
    pub fill: Colour,
    /// Width of the least and of the largest river, 0 to 10 mm.
    #[schemars(length(min = 2, max = 2), inner(range(min = 0, max = 10)))]
    pub river_mm: [f64; 2],
    /// Width of the lines of shores and coasts, 0 to 5 mm.
    #[schemars(range(min = 0, max = 5))]
    pub shore_mm: f64,
    /// Width of lines of equal depth in the sea, as far apart as contours, 0 to 5 mm; 0 for none.
    #[schemars(range(min = 0, max = 5))]
    pub depth_mm: f64,
    /// Square kilometres that drain to the least river, at a scale of 1:100,000, 0.01 to 10,000; by the area of the paper at others.
    #[schemars(range(min = 0.01, max = 10000))]
    pub least_km2: f64,
}

/// Roads.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RoadsStyle {
    /// Whether they are drawn.
    pub draw: bool,
    /// Their edges.
    pub casing: Colour,
    /// Highways, roads and tracks, from the best.
    #[schemars(length(min = 3, max = 3))]
    pub classes: [RoadStyle; 3],
}

/// A class of roads.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RoadStyle {
    /// Its colour.
    pub colour: Colour,
    /// Its width without edges, 0 to 10 mm.
    #[schemars(range(min = 0, max = 10))]
    pub width_mm: f64,
    /// The width of each edge, 0 to 5 mm.
    #[schemars(range(min = 0, max = 5))]
    pub casing_mm: f64,
    /// The scale from which on it is left out, as the second number of 1:25,000; 1 to 1,000,000,000.
    #[schemars(range(min = 1, max = 1_000_000_000))]
    pub most: f64,
}

/// Settlements and peaks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlacesStyle {
    /// Whether they are drawn.
    pub draw: bool,
    /// Their symbols.
    pub colour: Colour,
    /// What their symbols are filled with.
    pub fill: Colour,
    /// Houses.
    pub houses: Colour,
    /// The scale from which on there are no houses, as the second number of 1:25,000; 1 to 1,000,000.
    #[schemars(range(min = 1, max = 1_000_000))]
    pub houses_most: f64,
}

/// Names and heights.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LabelsStyle {
    /// Whether there are any.
    pub draw: bool,
    /// The file of a TrueType or OpenType font in which all text is set, that of the sheet too, whatever its face: named from the
    /// style's folder, or by `--style-set` from where the command runs. Letters that it lacks, and all text where there is no file,
    /// are set in Libertinus Serif.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub font: Option<String>,
    /// The font of that file, once it has been read.
    #[serde(skip)]
    pub own_font: Option<Font>,
    /// What is around each letter.
    pub halo: Colour,
    /// How wide it is, 0 to 3 mm.
    #[schemars(range(min = 0, max = 3))]
    pub halo_mm: f64,
    /// Towns, villages and hamlets.
    #[schemars(length(min = 3, max = 3))]
    pub places: [LabelStyle; 3],
    /// Peaks, and their heights.
    pub peak: LabelStyle,
    /// Rivers.
    pub river: LabelStyle,
    /// Lakes.
    pub lake: LabelStyle,
    /// Mountain ranges, whose letters stand further apart where there is room.
    pub range: LabelStyle,
    /// Valleys.
    pub valley: LabelStyle,
    /// Heights of each fifth contour, in gaps of its line.
    pub contour: LabelStyle,
}

impl LabelsStyle {
    /// What text of a face is set in.
    pub fn typeface(&self, face: Face) -> Typeface {
        Typeface { face, own: self.own_font }
    }
}

/// How names of one kind are written.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LabelStyle {
    /// Their colour.
    pub colour: Colour,
    /// The cut of their letters.
    pub face: Face,
    /// The height of a line, 0.1 to 50 mm.
    #[schemars(range(min = 0.1, max = 50))]
    pub size_mm: f64,
    /// Space between the letters, in parts of the height of a line, 0 to 5.
    #[schemars(range(min = 0, max = 5))]
    pub spacing: f64,
}

/// A colour, as sRGB.
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
    /// The colours of land of a kind.
    pub fn land(&self, tint: Tint) -> &[Stop] {
        match tint {
            Tint::Temperate => &self.temperate,
            Tint::Arid => &self.arid,
            Tint::Alpine => &self.alpine,
        }
    }
}

impl SignsStyle {
    /// Whether there are any at a scale.
    pub fn are_drawn(&self, denominator: f64) -> bool {
        let near = denominator <= self.most && self.rock.max(self.scree) > 0.0;
        self.width_mm > 0.0 && (near || self.hachures > 0.0)
    }
}

impl CoverStyle {
    /// How each material is seen, in the order of [`Material::ALL`](crate::tile::Material::ALL).
    pub fn all(&self) -> [Cover; 8] {
        [self.grass, self.dirt, self.rock, self.sand, self.snow, self.forest, self.scree, self.wetland]
    }
}

impl Style {
    /// The built-in style of that name or else the style in the file of that path.
    ///
    /// # Errors
    /// When there is no such style, or when it cannot be read or understood.
    pub fn load(name_or_path: &str) -> Result<Style, Error> {
        Sources::load(name_or_path)?.read_all()
    }

    /// The JSON schema of style files.
    pub fn schema() -> serde_json::Value {
        let mut schema = crate::recipe::form::schema::<Style>();
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
