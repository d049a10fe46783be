//! Fonts: the built-in faces, with which a map looks the same on every machine, and the font files that styles name.

use std::fmt::{self, Debug, Formatter};
use std::fs;
use std::path::Path;
use std::sync::{Mutex, OnceLock};

use harfrust::Font as Shaper;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use skrifa::attribute::Style as Slant;
use skrifa::instance::{LocationRef, Size};
use skrifa::metrics::Metrics;
use skrifa::raw::TableProvider;
use skrifa::string::StringId;
use skrifa::{FontRef, GlyphId, MetadataProvider, Tag};

/// A face of Libertinus Serif. Maps set the names of water in italics and important names in heavier faces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Face {
    /// Upright, of regular weight.
    #[default]
    Regular,
    /// Slanted, of regular weight.
    Italic,
    /// Upright, between regular and bold.
    Semibold,
    /// Slanted, between italic and bold italic.
    SemiboldItalic,
    /// Upright and heavy.
    Bold,
    /// Slanted and heavy.
    BoldItalic,
}

impl Face {
    /// All faces, in the order in which they are declared.
    pub const ALL: [Face; 6] =
        [Face::Regular, Face::Italic, Face::Semibold, Face::SemiboldItalic, Face::Bold, Face::BoldItalic];

    /// Returns the font of the face.
    pub fn font(self) -> Font {
        // Each font is read only once: reading one takes longer than shaping a name.
        static LOADED: [OnceLock<LoadedFont>; Face::ALL.len()] = [const { OnceLock::new() }; Face::ALL.len()];
        Font(LOADED[self as usize].get_or_init(|| self.load()))
    }

    /// Returns the name of the face's font without the family. The full name is `Libertinus Serif`, a space and this
    /// name.
    fn style_name(self) -> &'static str {
        match self {
            Face::Regular => "Regular",
            Face::Italic => "Italic",
            Face::Semibold => "Semibold",
            Face::SemiboldItalic => "Semibold Italic",
            Face::Bold => "Bold",
            Face::BoldItalic => "Bold Italic",
        }
    }

    fn load(self) -> LoadedFont {
        let is_named = |data: &&'static [u8]| {
            let font = FontRef::new(data).expect("the fonts that come with the program can be read");
            let name = font.localized_strings(StringId::FULL_NAME).english_or_first();
            name.is_some_and(|name| name.to_string().strip_prefix("Libertinus Serif ") == Some(self.style_name()))
        };
        let data = typst_assets::fonts().find(is_named).expect("each face comes with the program");
        LoadedFont::new(data).expect("a font that could be read once can be read again")
    }
}

/// The one or two fonts of a text: the font file that the map's style names, if it names one, and a built-in face. The
/// face draws the letters that the file lacks.
#[derive(Clone, Copy, Debug)]
pub struct Typeface {
    /// The built-in face.
    pub face: Face,
    /// The font of the file that the map's style names; `None` if the style names none.
    pub own: Option<Font>,
}

impl From<Face> for Typeface {
    fn from(face: Face) -> Typeface {
        Typeface { face, own: None }
    }
}

impl Typeface {
    /// Returns the preferred font: the one from the file if there is a file, otherwise the one of the face.
    pub fn font(self) -> Font {
        self.own.unwrap_or_else(|| self.face.font())
    }

    /// Returns the font that draws a letter: the preferred font if it has the letter, otherwise the font of the face.
    /// If both lack the letter, returns the preferred font, which draws a box in place of the letter.
    pub fn font_of(self, letter: char) -> Font {
        let mut fonts = self.own.into_iter().chain([self.face.font()]);
        fonts.find(|font| font.glyph_of(letter).is_some()).unwrap_or_else(|| self.font())
    }
}

/// A font that has been read. It stays in memory until the program ends.
#[derive(Clone, Copy)]
pub struct Font(&'static LoadedFont);

struct LoadedFont {
    data: &'static [u8],
    full_name: String,
    family: String,
    weight: u16,
    is_slanted: bool,
    shaper: Shaper,
    outlines: FontRef<'static>,
    metrics: Metrics,
}

impl PartialEq for Font {
    fn eq(&self, other: &Font) -> bool {
        std::ptr::eq(self.0, other.0)
    }
}

impl Debug for Font {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0.full_name)
    }
}

/// Largest size in bytes of a file that is read as a font. A larger file is refused unread: it is hardly a font.
const MAX_BYTES: u64 = 64 << 20;

impl Font {
    /// Reads a font from a TrueType or OpenType file. If the file is a collection, reads its first font; if the font is
    /// variable, takes its default instance.
    ///
    /// # Errors
    /// When the file cannot be read as a font. The message has no subject: the caller puts the file's name before it.
    pub fn read(path: &Path) -> Result<Font, String> {
        // Fonts stay in memory for good, so the same file is kept only once.
        static READ: Mutex<Vec<&'static LoadedFont>> = Mutex::new(Vec::new());
        let size = fs::metadata(path).map_err(|error| error.to_string())?;
        if size.is_dir() || size.len() > MAX_BYTES {
            return Err(format!("is no font file, which has at most {} MB", MAX_BYTES >> 20));
        }
        let data = fs::read(path).map_err(|error| error.to_string())?;
        let mut read = READ.lock().expect("no thread panics while it reads a font");
        if let Some(known) = read.iter().find(|known| known.data == data) {
            return Ok(Font(known));
        }
        let loaded: &'static LoadedFont = Box::leak(Box::new(LoadedFont::new(Vec::leak(data))?));
        read.push(loaded);
        Ok(Font(loaded))
    }

    /// Returns the bytes of the font file, for documents that embed it.
    pub fn data(self) -> &'static [u8] {
        self.0.data
    }

    /// Returns the full name of the font: its family and its style.
    pub fn full_name(self) -> &'static str {
        &self.0.full_name
    }

    /// Returns the name of the font's family.
    pub fn family(self) -> &'static str {
        &self.0.family
    }

    /// Returns the weight of the font on the scale of CSS: 400 is regular, 700 is bold.
    pub fn weight(self) -> u16 {
        self.0.weight
    }

    /// True if the font is slanted.
    pub fn is_slanted(self) -> bool {
        self.0.is_slanted
    }

    /// Returns the font in the form that the text shaper (harfrust) reads.
    pub(super) fn shaper(self) -> &'static Shaper {
        &self.0.shaper
    }

    /// Returns the table of the font file that has this tag; `None` if the file has no such table.
    pub fn table(self, tag: [u8; 4]) -> Option<&'static [u8]> {
        self.0.outlines.table_data(Tag::new(&tag)).map(|table| table.as_bytes())
    }

    /// Returns the parsed font with its outlines and tables.
    pub(super) fn outlines(self) -> &'static FontRef<'static> {
        &self.0.outlines
    }

    /// Returns the metrics of the font in font units. A font size is `units_per_em` font units.
    pub(super) fn metrics(self) -> &'static Metrics {
        &self.0.metrics
    }

    /// Returns the ascent, the descent and the height of capitals, in thousandths of the font's size. Up is positive,
    /// so the descent, which lies below the baseline, is negative.
    pub fn heights(self) -> [f32; 3] {
        let metrics = &self.0.metrics;
        let heights = [metrics.ascent, metrics.descent, metrics.cap_height.unwrap_or(metrics.ascent)];
        heights.map(|units| units * 1000.0 / f32::from(metrics.units_per_em))
    }

    /// Returns the glyph that the font's character map has for a letter, without ligatures or contextual forms; `None`
    /// if the font lacks the letter.
    pub fn glyph_of(self, letter: char) -> Option<u16> {
        let glyph = self.0.outlines.charmap().map(letter)?;
        u16::try_from(glyph.to_u32()).ok().filter(|glyph| *glyph != 0)
    }

    /// Returns the advance of a glyph in thousandths of the font's size.
    pub fn advance(self, glyph: u16) -> f32 {
        let LoadedFont { outlines, metrics, .. } = self.0;
        let widths = outlines.glyph_metrics(Size::unscaled(), LocationRef::default());
        let units = widths.advance_width(GlyphId::new(u32::from(glyph))).unwrap_or(0.0);
        units * 1000.0 / f32::from(metrics.units_per_em)
    }
}

impl LoadedFont {
    fn new(data: &'static [u8]) -> Result<LoadedFont, String> {
        const NO_FONT: &str = "is no TrueType or OpenType font";
        let outlines = FontRef::from_index(data, 0).map_err(|error| format!("{NO_FONT}: {error}"))?;
        if outlines.glyf().is_err() && outlines.cff().is_err() {
            return Err("has no outlines (glyf or CFF), of which maps are drawn".into());
        }
        let shaper = Shaper::new(data, 0).ok_or(NO_FONT)?;
        let text = |id| outlines.localized_strings(id).english_or_first().map(|text| text.to_string());
        let family = text(StringId::TYPOGRAPHIC_FAMILY_NAME).or_else(|| text(StringId::FAMILY_NAME));
        let family = family.unwrap_or_else(|| "Unnamed".into());
        let attributes = outlines.attributes();
        // Some slanted fonts say so only in their attributes, others only in their italic angle.
        let angle = outlines.post().map_or(0.0, |post| post.italic_angle().to_f64());
        Ok(LoadedFont {
            data,
            full_name: text(StringId::FULL_NAME).unwrap_or_else(|| family.clone()),
            family,
            weight: attributes.weight.value() as u16,
            is_slanted: attributes.style != Slant::Normal || angle != 0.0,
            shaper,
            metrics: outlines.metrics(Size::unscaled(), LocationRef::default()),
            outlines,
        })
    }
}

#[cfg(test)]
impl Font {
    /// Writes DejaVu Sans Mono, which is in the crate `typst_assets`, to a file and reads it from there, as a user's
    /// font is read. Its outlines are quadratic, and those of the built-in faces are cubic.
    pub(crate) fn of_file() -> Font {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("own.ttf");
        let is_named = |data: &&[u8]| {
            let name = FontRef::new(data).unwrap().localized_strings(StringId::FULL_NAME).english_or_first();
            name.is_some_and(|name| name.to_string() == "DejaVu Sans Mono")
        };
        fs::write(&path, typst_assets::fonts().find(is_named).unwrap()).unwrap();
        Font::read(&path).unwrap()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_are_six_fonts() {
        for (face, other) in Face::ALL.iter().flat_map(|face| Face::ALL.map(|other| (*face, other))) {
            assert_eq!(face == other, face.font().data() == other.font().data());
        }
        let slanted = Face::ALL.map(|face| face.font().is_slanted());
        assert_eq!(slanted, [false, true, false, true, false, true]);
        assert_eq!(Face::ALL.map(|face| face.font().weight()), [400, 400, 600, 600, 700, 700]);
    }

    #[test]
    fn a_file_is_kept_once_and_one_that_is_no_font_is_refused() {
        assert_eq!(Font::of_file(), Font::of_file());
        assert_eq!((Font::of_file().family(), Font::of_file().weight()), ("DejaVu Sans Mono", 400));
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("own.otf");
        for (content, expected) in [
            (b"a text".to_vec(), "is no TrueType or OpenType font"),
            (b"\0\x01\0\0\0\0\0\0\0\0\0\0".to_vec(), "has no outlines"),
            (Face::Bold.font().data()[..5000].to_vec(), "has no outlines"),
        ] {
            fs::write(&path, content).unwrap();
            let error = Font::read(&path).unwrap_err();
            assert!(error.contains(expected), "{error}");
        }
        assert!(Font::read(folder.path()).unwrap_err().contains("is no font file"));
        assert!(Font::read(&folder.path().join("none.ttf")).is_err());
    }
}
