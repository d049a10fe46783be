//! SVG: a page with lines as lines, the ground as pictures, and letters as outlines or as text. Layers and items are
//! groups, which Inkscape shows by their names.
//!
//! Pages use plain SVG because programs differ in what they can read: libxml2 takes no attribute of 10 MB; librsvg
//! ignores embedded fonts, and reads only the first place of a list of places per letter; Inkscape uses only installed
//! fonts.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::PathBuf;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use glam::{DVec2, dvec2};
use tiny_skia::PathSegment;

use crate::area::Area;
use crate::error::Error;
use crate::export::formats::path_data::{Hundredths, PathData};
use crate::export::formats::raster::writer::{Sample, png_bytes};
use crate::export::formats::sfnt::web_font;
use crate::file::{Finished, PartFile};
use crate::map::font::{Face, Font};
use crate::map::plotter::{Inscription, Item, Lettering, Page, PageLayer, Pen, Plotter, Shape, bounds};
use crate::map::scale::Scale;
use crate::map::style::Colour;
use crate::map::text::{Placed, PlacedGlyph, is_right_to_left};

/// A page under way, whose text is written as it is made.
pub(crate) struct Svg {
    file: PartFile,
    text: String,
    area: Area,
    lettering: Lettering,
    /// Visible part of the page while the map is drawn; otherwise all of the page is visible.
    clip: Option<Area>,
    /// Open groups, from the outermost.
    groups: Vec<SvgGroup>,
    /// Number of groups that have asked for each id.
    ids: BTreeMap<String, u32>,
    /// The letters of each font that are written as text.
    written: Vec<(Font, BTreeSet<char>)>,
    picture: Option<PendingRows>,
    /// First error of writing, which `finish` returns.
    refused: Option<Error>,
}

/// A group. Its begin is written with its first element, so that empty groups are left out.
struct SvgGroup {
    begin: String,
    is_written: bool,
}

/// A picture under way: its rows that are not written yet.
struct PendingRows {
    part: Area,
    pixels: Vec<u8>,
    /// Number of rows that are written as one picture.
    at_once: usize,
}

/// Font families of text: readers take the first one that they have.
const FAMILIES: &str = "'Libertinus Serif', 'Linux Libertine', Georgia, serif";

/// Bytes of text that are kept before they are written.
const KEPT: usize = 1 << 16;

/// Largest number of bytes of a picture's pixels. Base64 makes them a third longer, which stays below the 8 MB that all
/// readers take.
const PICTURE_BYTES: usize = 5_500_000;

/// A comment that is repeated after each picture. libxml2 reads at most 10 MB before it must free its buffer, and frees
/// it only where an element or a comment ends less than 500 bytes before the end of its buffer of 4,000 bytes. Between
/// pictures without comments that never happens.
const PAUSE: &str = "<!-- some short lines, after which readers can let go of the picture -->\n";
const PAUSES: usize = 80;

impl Svg {
    /// Begins a page of an area of pixels that will be at `path`.
    ///
    /// # Errors
    /// When the file cannot be begun.
    pub fn create(
        path: PathBuf,
        area: Area,
        scale: Scale,
        lettering: Lettering,
        (title, description): (&str, &str),
    ) -> Result<Svg, Error> {
        let file = PartFile::create(path)?;
        let (width, height) = (area.width(), area.height());
        let [width_mm, height_mm] = [width, height].map(|pixels| pixels as f64 / scale.pixels_per_mm);
        let text = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" xmlns:xlink=\"http://www.w3.org/1999/xlink\" \
             xmlns:inkscape=\"http://www.inkscape.org/namespaces/inkscape\" \
             width=\"{width_mm:.3}mm\" height=\"{height_mm:.3}mm\" viewBox=\"0 0 {width} {height}\" \
             stroke-linejoin=\"round\" font-family=\"{FAMILIES}\" style=\"font-synthesis: none\">\n\
             <title>{}</title>\n<desc>{}</desc>\n",
            escaped(title),
            escaped(description)
        );
        let (groups, ids, written) = (Vec::new(), BTreeMap::new(), Vec::new());
        Ok(Svg { file, text, area, lettering, clip: None, groups, ids, written, picture: None, refused: None })
    }

    /// Ends the page.
    ///
    /// # Errors
    /// When the disk refuses.
    pub fn finish(mut self) -> Result<Finished, Error> {
        debug_assert!(self.groups.is_empty(), "each group ends");
        self.add_fonts()?;
        self.text += "</svg>\n";
        self.flush(0);
        self.refused.map_or_else(|| self.file.finish(), Err)
    }

    /// Embeds the used letters of all fonts of text.
    fn add_fonts(&mut self) -> Result<(), Error> {
        for (font, letters) in std::mem::take(&mut self.written) {
            let data = STANDARD.encode(web_font(font, &letters)?);
            let family = family(font);
            // A style's own font serves all faces: the whole range of weights and `font-synthesis: none` keep browsers
            // from making it bolder or slanted.
            let (weight, style) = match Face::ALL.iter().any(|face| face.font() == font) {
                true => (font.weight().to_string(), if font.is_slanted() { "italic" } else { "normal" }),
                false => ("1 1000".into(), "normal"),
            };
            self.add(format_args!(
                "<style>@font-face {{ font-family: \"{family}\"; font-weight: {weight}; font-style: {style}; \
                 src: url(\"data:font/otf;base64,{data}\"); }}</style>\n"
            ));
        }
        Ok(())
    }

    /// Returns the letters of a font that are written as text, for adding more.
    fn letters_of(&mut self, font: Font) -> &mut BTreeSet<char> {
        let known = self.written.iter().position(|(other, _)| *other == font);
        let number = known.unwrap_or_else(|| {
            self.written.push((font, BTreeSet::new()));
            self.written.len() - 1
        });
        &mut self.written[number].1
    }

    fn flush(&mut self, kept: usize) {
        if self.text.len() > kept && self.refused.is_none() {
            let written = self.file.write_all(self.text.as_bytes());
            self.refused = written.map_err(Error::io(self.file.path())).err();
            self.text.clear();
        }
    }

    /// Converts a place on the map to pixels from the north-western corner of the page.
    fn at(&self, at: DVec2) -> DVec2 {
        at - dvec2(self.area.x0 as f64, self.area.y0 as f64)
    }

    fn add(&mut self, element: std::fmt::Arguments<'_>) {
        for group in self.groups.iter_mut().filter(|group| !group.is_written) {
            self.text += &group.begin;
            group.is_written = true;
        }
        self.text.write_fmt(element).expect("memory takes everything");
        self.flush(KEPT);
    }

    fn begin_group(&mut self, begin: String) {
        self.groups.push(SvgGroup { begin, is_written: false });
    }

    fn end_group(&mut self) {
        if self.groups.pop().expect("a group was begun").is_written {
            self.text += "</g>\n";
        }
    }

    /// Returns an id that no other group has. Characters that an id may not hold become `_`.
    fn id(&mut self, wanted: &str) -> String {
        let is_allowed = |letter: char| letter.is_ascii_alphanumeric() || "-_".contains(letter);
        let id: String = wanted.chars().map(|letter| if is_allowed(letter) { letter } else { '_' }).collect();
        let uses = self.ids.entry(id.clone()).or_insert(0);
        *uses += 1;
        if *uses == 1 { id } else { format!("{id}.{uses}") }
    }

    /// Returns lines as the data of an SVG path.
    fn path(&self, lines: &[Vec<DVec2>]) -> String {
        let mut data = PathData::default();
        for line in lines {
            let closes = line.len() > 2 && line[0] == line[line.len() - 1];
            for (index, point) in line[..line.len() - usize::from(closes)].iter().enumerate() {
                let at = self.at(*point);
                if index == 0 { data.move_to(at) } else { data.line_to(at) }
            }
            if closes {
                data.close();
            }
        }
        data.finish()
    }

    /// Writes a text, as text or outlines, with the attributes `paint`.
    fn letters(&mut self, text: &Placed, paint: &str) {
        if text.glyphs.is_empty() || !self.sees(bounds(text.boxes.iter().flatten())) {
            return;
        }
        match self.lettering {
            Lettering::Outlines => self.outlines(text, paint),
            // Embedded fonts are subsets without the rules for letters that join, as in Arabic.
            Lettering::Text if text.is_joined() => self.outlines(text, paint),
            Lettering::Text => self.text(text, paint),
        }
    }

    fn outlines(&mut self, text: &Placed, paint: &str) {
        let Some(path) = text.path([self.area.x0, self.area.y0]) else { return };
        let mut data = PathData::default();
        let at = |point: tiny_skia::Point| dvec2(point.x.into(), point.y.into());
        for segment in path.segments() {
            match segment {
                PathSegment::MoveTo(to) => data.move_to(at(to)),
                PathSegment::LineTo(to) => data.line_to(at(to)),
                PathSegment::QuadTo(control, to) => data.quadratic_to(at(control), at(to)),
                PathSegment::CubicTo(..) => unreachable!("outlines of letters are quadratic"),
                PathSegment::Close => data.close(),
            }
        }
        self.add(format_args!("<path {paint} d=\"{}\"/>\n", data.finish()));
    }

    /// Writes straight text as one element, in which the font spaces the letters. Bent text gets an element per letter,
    /// since not all readers can rotate single letters of an element.
    fn text(&mut self, text: &Placed, paint: &str) {
        let of_face = text.face.font();
        let mut families = Vec::new();
        for glyph in &text.glyphs {
            self.letters_of(glyph.font).extend(text.text[glyph.text.clone()].chars());
            if glyph.font != of_face && !families.contains(&family(glyph.font)) {
                families.push(family(glyph.font));
            }
        }
        let family = match &families[..] {
            [] => String::new(),
            families => format!(" font-family=\"'{}', {FAMILIES}\"", families.join("', '")),
        };
        let weight = match of_face.weight() {
            400 => String::new(),
            weight => format!(" font-weight=\"{weight}\""),
        };
        let style = if of_face.is_slanted() { " font-style=\"italic\"" } else { "" };
        let font = format!("font-size=\"{}\"{family}{weight}{style} {paint}", Hundredths(text.size_px));
        let first = &text.glyphs[0];
        if text.glyphs.iter().all(|glyph| glyph.along == first.along) {
            let place = self.place(first);
            let spacing = match text.spacing_px {
                0.0 => String::new(),
                spacing => format!(" letter-spacing=\"{}\"", Hundredths(spacing)),
            };
            // The place is the left end of the text, which is where right-to-left text ends.
            let direction = if is_right_to_left(&text.text) { " direction=\"rtl\" text-anchor=\"end\"" } else { "" };
            self.add(format_args!("<text {place} {font}{spacing}{direction}>{}</text>\n", escaped(&text.text)));
            return;
        }
        self.add(format_args!("<g {font}>\n"));
        for letter in text.glyphs.chunk_by(|one, next| one.text == next.text) {
            let place = self.place(&letter[0]);
            self.add(format_args!("<text {place}>{}</text>\n", escaped(&text.text[letter[0].text.clone()])));
        }
        self.add(format_args!("</g>\n"));
    }

    /// Returns the attributes that place and rotate a glyph.
    fn place(&self, glyph: &PlacedGlyph) -> String {
        let [x, y] = self.at(glyph.at).to_array().map(Hundredths);
        match glyph.angle().to_degrees() {
            0.0 => format!("x=\"{x}\" y=\"{y}\""),
            degrees => format!("transform=\"translate({x} {y}) rotate({})\"", Hundredths(degrees)),
        }
    }

    /// Writes the next `rows` rows of the picture as one image. The next image repeats the last of these rows, so that
    /// no gap shows between the two, whatever size they are drawn at.
    fn write_rows(&mut self, rows: usize) {
        let Some(PendingRows { part, pixels, .. }) = &mut self.picture else { return };
        let row_bytes = part.width() * 3;
        let png = png_bytes(Sample::Rgb8, (part.width() as u32, rows as u32), true, &pixels[..rows * row_bytes]);
        let (left, width, top) = ((part.x0 - self.area.x0), part.width(), part.y0 - self.area.y0);
        pixels.drain(..(rows - 1) * row_bytes);
        part.y0 += rows as i64 - 1;
        let data = STANDARD.encode(png);
        self.add(format_args!(
            "<image x=\"{left}\" y=\"{top}\" width=\"{width}\" height=\"{rows}\" \
             xlink:href=\"data:image/png;base64,{data}\"/>\n{}",
            PAUSE.repeat(PAUSES)
        ));
    }
}

/// Returns the name of a font's family, without characters that would end a name in CSS or XML.
fn family(font: Font) -> String {
    font.family().chars().filter(|letter| !letter.is_control() && !"'\"<>&\\".contains(*letter)).collect()
}

/// Escapes the characters of a text that have a meaning in XML.
pub(super) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

impl Plotter for Svg {
    fn area(&self) -> Area {
        self.clip.unwrap_or(self.area)
    }

    fn begin_layer(&mut self, layer: PageLayer) {
        let name = layer.name();
        let id = self.id(name);
        self.begin_group(format!("<g id=\"{id}\" inkscape:groupmode=\"layer\" inkscape:label=\"{name}\">\n"));
    }

    fn end_layer(&mut self) {
        self.end_group();
    }

    fn begin_item(&mut self, Item { kind, id, name }: &Item<'_>) {
        let id = self.id(&if id.is_empty() { (*kind).to_owned() } else { format!("{kind}-{id}") });
        let begin = if name.is_empty() {
            format!("<g id=\"{id}\" class=\"{kind}\">\n")
        } else {
            let name = escaped(name);
            format!("<g id=\"{id}\" class=\"{kind}\" inkscape:label=\"{name}\">\n<title>{name}</title>\n")
        };
        self.begin_group(begin);
    }

    fn end_item(&mut self) {
        self.end_group();
    }

    fn fill(&mut self, shape: &Shape, colour: Colour) {
        if self.sees(shape.bounds) {
            let path = self.path(&shape.lines);
            self.add(format_args!("<path fill=\"{colour}\" fill-rule=\"evenodd\" d=\"{path}\"/>\n"));
        }
    }

    fn stroke(&mut self, lines: &[Vec<DVec2>], pen: &Pen) {
        if pen.width <= 0.0 || !self.sees(bounds(lines.iter().flatten())) {
            return;
        }
        let path = self.path(lines);
        let opacity = if pen.opacity < 1.0 {
            format!(" stroke-opacity=\"{}\"", Hundredths(f64::from(pen.opacity)))
        } else {
            String::new()
        };
        let ends = match pen.dash {
            Some([on, off]) => {
                format!(" stroke-dasharray=\"{} {}\"", Hundredths(f64::from(on)), Hundredths(f64::from(off)))
            }
            None => " stroke-linecap=\"round\"".to_owned(),
        };
        let (colour, width) = (pen.colour, Hundredths(f64::from(pen.width)));
        self.add(format_args!(
            "<path fill=\"none\" stroke=\"{colour}\" stroke-width=\"{width}\"{opacity}{ends} d=\"{path}\"/>\n"
        ));
    }

    fn write(&mut self, text: &Placed, colour: Colour) {
        self.letters(text, &format!("fill=\"{colour}\""));
    }

    fn inscribe(&mut self, inscriptions: &[Inscription<'_>]) {
        for Inscription { item, text, colour, halo } in inscriptions {
            let mut paint = format!("fill=\"{colour}\"");
            if halo.width > 0.0 {
                let (width, opacity) = (Hundredths(f64::from(halo.width)), Hundredths(f64::from(halo.opacity)));
                let colour = halo.colour;
                // One element draws both: the halo (stroke) first, then the letters over it.
                write!(
                    paint,
                    " stroke=\"{colour}\" stroke-width=\"{width}\" stroke-opacity=\"{opacity}\" paint-order=\"stroke\""
                )
                .expect("memory takes everything");
            }
            self.begin_item(item);
            self.letters(text, &paint);
            self.end_item();
        }
    }

    fn dot(&mut self, at: DVec2, radius: f64, colour: Colour) {
        let [x, y] = self.at(at).to_array().map(Hundredths);
        self.add(format_args!("<circle cx=\"{x}\" cy=\"{y}\" r=\"{}\" fill=\"{colour}\"/>\n", Hundredths(radius)));
    }
}

impl Page for Svg {
    fn clip(&mut self, part: Area) {
        self.clip = Some(part);
        let DVec2 { x, y } = self.at(dvec2(part.x0 as f64, part.y0 as f64));
        let (width, height) = (part.width(), part.height());
        self.add(format_args!(
            "<clipPath id=\"neatline\"><rect x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\"/></clipPath>\n"
        ));
        let id = self.id("map");
        self.begin_group(format!(
            "<g id=\"{id}\" inkscape:groupmode=\"layer\" inkscape:label=\"map\" clip-path=\"url(#neatline)\">\n"
        ));
    }

    fn begin_picture(&mut self, part: Area) {
        let rows = (PICTURE_BYTES / (3 * part.width())).max(2);
        self.picture = Some(PendingRows { part, pixels: Vec::new(), at_once: rows });
    }

    fn add_rows(&mut self, pixels: &[u8]) -> Result<(), Error> {
        let PendingRows { part, pixels: kept, at_once } = self.picture.as_mut().expect("a picture was begun");
        kept.extend_from_slice(pixels);
        let (rows, row_bytes) = (*at_once, part.width() * 3);
        // Strictly more: at the end there must be rows left besides the repeated one.
        while self.picture.as_ref().is_some_and(|picture| picture.pixels.len() > rows * row_bytes) {
            self.write_rows(rows);
        }
        Ok(())
    }

    fn end_picture(&mut self) -> Result<(), Error> {
        let rows = self.picture.as_ref().map_or(0, |picture| picture.pixels.len() / (3 * picture.part.width()));
        self.write_rows(rows);
        self.picture = None;
        Ok(())
    }

    fn open(&mut self) {
        self.clip = None;
        self.end_group();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hash;
    use crate::map::font::Typeface;
    use crate::map::text::shape;

    const SCALE: Scale = Scale { metres_per_pixel: 1.0, pixels_per_mm: 1.0 };
    const INK: Colour = Colour([0; 3]);

    /// Returns the SVG of a page of an area on which `draw` has drawn.
    fn page(area: Area, lettering: Lettering, draw: impl FnOnce(&mut Svg)) -> String {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("map.svg");
        let mut svg = Svg::create(path.clone(), area, SCALE, lettering, ("A & B", "")).unwrap();
        draw(&mut svg);
        svg.finish().unwrap();
        std::fs::read_to_string(path).unwrap()
    }

    /// Returns the value of an attribute of an element.
    fn attribute<'a>(element: &'a str, name: &str) -> Option<&'a str> {
        element.split(&format!(" {name}=\"")).nth(1)?.split('"').next()
    }

    #[test]
    fn a_large_ground_is_several_pictures_that_overlap_by_a_row() {
        let area = Area::new(-50, -70, 3600, 1300);
        let text = page(area, Lettering::Outlines, |svg| {
            svg.begin_picture(area);
            let row = |y: i64| (0..3600 * 3).map(move |x| hash::mix((y * 10_800 + x) as u64) as u8);
            for strip in [0..442, 442..954, 954..1300] {
                svg.add_rows(&strip.flat_map(row).collect::<Vec<u8>>()).unwrap();
            }
            svg.end_picture().unwrap();
        });
        let images: Vec<&str> = text.lines().filter(|line| line.starts_with("<image")).collect();
        let mut next = 0;
        for image in &images {
            let [y, height] = ["y", "height"].map(|name| attribute(image, name).unwrap().parse::<i64>().unwrap());
            assert!(y == next && height > 1 && image.len() < 8_000_000);
            next = y + height - 1;
        }
        assert!(next + 1 == 1300 && images.len() > 2, "{next} {}", images.len());
        // After each picture there are enough comments for libxml2 to free its buffer.
        assert!(text.split("<image").skip(1).all(|part| part.len() - part.lines().next().unwrap().len() > 4500));
    }

    #[test]
    fn a_thing_is_one_group_with_a_name_and_an_empty_one_is_left_out() {
        let area = Area::new(0, 0, 100, 100);
        let line = [vec![dvec2(10.0, 10.0), dvec2(20.0, 20.0)]];
        let pen = Pen { colour: INK, opacity: 1.0, width: 1.0, dash: None };
        let text = page(area, Lettering::Outlines, |svg| {
            svg.begin_layer(PageLayer::Waters);
            for part in ["r2:-1:0", "r2:-1:0", "r3:9:9"] {
                svg.begin_item(&Item { kind: "river", id: part, name: "Ache & \"Bach\"" });
                if part != "r3:9:9" {
                    svg.stroke(&line, &pen);
                    svg.stroke(&line, &Pen { width: 2.0, ..pen });
                }
                svg.end_item();
            }
            svg.end_layer();
            svg.begin_layer(PageLayer::Roads);
            svg.end_layer();
        });
        let groups: Vec<&str> = text.lines().filter(|line| line.starts_with("<g")).collect();
        let ids: Vec<_> = groups.iter().map(|group| attribute(group, "id").unwrap()).collect();
        assert_eq!(ids, ["waters", "river-r2_-1_0", "river-r2_-1_0.2"]);
        assert_eq!(attribute(groups[0], "inkscape:groupmode"), Some("layer"));
        assert_eq!(text.matches("<title>Ache &amp; &quot;Bach&quot;</title>").count(), 2);
        assert_eq!(text.matches("<path").count(), 4);
    }

    #[test]
    fn text_of_a_styles_font_names_it_and_letters_that_join_are_outlines() {
        let typeface = Typeface { face: Face::Bold, own: Some(Font::of_file()) };
        let text = page(Area::new(0, 0, 400, 400), Lettering::Text, |svg| {
            for text in ["Alp \u{1f7}", "\u{644}\u{628}"] {
                svg.write(&shape(text, typeface, 10.0, 0.0).at(dvec2(10.0, 50.0), 0.0), INK);
            }
        });
        let written = text.lines().find(|line| line.starts_with("<text")).unwrap();
        assert_eq!(attribute(written, "font-family"), Some(format!("'DejaVu Sans Mono', {FAMILIES}").as_str()));
        assert!(text.contains("font-family: \"DejaVu Sans Mono\"; font-weight: 1 1000"));
        assert!(text.contains("font-family: \"Libertinus Serif\"; font-weight: 700"));
        assert_eq!([text.matches("<text").count(), text.matches("<path").count()], [1, 1]);
    }

    #[test]
    fn a_name_is_one_element_and_bent_text_turns_each_letter_by_itself() {
        let area = Area::new(0, 0, 400, 400);
        let straight = shape("Gross Ache", Face::Italic, 20.0, 0.1).at(dvec2(10.0, 50.0), 0.5);
        let bow = (0..60).map(|t| f64::from(t) * 0.05).map(|t| 200.0 - 150.0 * dvec2(t.cos(), t.sin()));
        let bow: Vec<DVec2> = bow.collect();
        let bent = shape("Bach", Face::Regular, 20.0, 0.0).along(&bow, 150.0, 0.0).unwrap();
        let halo = Pen { colour: Colour([255; 3]), opacity: 0.85, width: 2.0, dash: None };
        let named = |lettering| {
            page(area, lettering, |svg| {
                for text in [&straight, &bent] {
                    let item = Item { kind: "name", id: &text.text, name: &text.text };
                    svg.inscribe(&[Inscription { item, text, colour: INK, halo }]);
                }
            })
        };
        let outlines = named(Lettering::Outlines);
        assert_eq!([outlines.matches("<path").count(), outlines.matches("paint-order").count()], [2, 2]);
        assert!(!outlines.contains("<text") && !outlines.contains("@font-face"));
        let text = named(Lettering::Text);
        assert!(text.contains("letter-spacing=\"2\"") && text.contains(">Gross Ache</text>"));
        // No lists of places or angles per letter: some readers use only their first value.
        let texts: Vec<&str> = text.lines().filter(|line| line.starts_with("<text")).collect();
        assert_eq!(texts.len(), 5);
        assert!(texts.iter().all(|text| !text.contains("rotate=") && text.contains("transform=\"translate(")));
        assert_eq!(text.matches("@font-face").count(), 2);
    }
}
