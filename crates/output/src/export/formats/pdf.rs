//! PDF: pages with lines as lines, text as text and the ground as a picture. Layers can be hidden in viewers (optional
//! content), and each thing, such as a river, is drawn as one object (a form), which editors take for a group.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::PathBuf;

use flate2::Compression;
use flate2::write::ZlibEncoder;
use glam::{DVec2, Vec2, dvec2, vec2};
use pdf_writer::types::{
    ActionType, AnnotationType, CidFontType, FontFlags, LineCapStyle, LineJoinStyle, PageMode, Predictor, SystemInfo,
    TextRenderingMode, UnicodeCmap,
};
use pdf_writer::writers::{Catalog, DocumentInfo, Resources};
use pdf_writer::{Chunk, Content, Filter, Finish, Name, Rect, Ref, Settings, Str, TextStr};
use subsetter::GlyphRemapper;
use tiny_skia::PathSegment;

use crate::area::Area;
use crate::error::Error;
use crate::export::formats::sfnt::{subset, table};
use crate::file::{Finished, PartFile};
use crate::map::font::Font;
use crate::map::plotter::{Inscription, Item, Lettering, Page, PageLayer, Pen, Plotter, Shape, bounds};
use crate::map::scale::Scale;
use crate::map::style::Colour;
use crate::map::text::Placed;

/// Points (72 an inch) per millimetre.
const POINTS_A_MM: f64 = 72.0 / 25.4;

/// Largest side of a page in millimetres: 14,400 points, the limit of PDF.
const MOST_MM: f64 = 5080.0;

/// Distance of the control points from the ends of a cubic curve that approximates a quarter of a circle of radius 1.
const QUARTER: f64 = 0.552_284_75;

const COMPACT: Settings = Settings { pretty: false };

const IDENTITY: SystemInfo<'static> = SystemInfo { registry: Str(b"Adobe"), ordering: Str(b"Identity"), supplement: 0 };

/// A document under way. Objects go to the disk as they are made; what all pages share comes last.
pub(crate) struct Pdf {
    file: PartFile,
    bytes: u64,
    /// Byte offset of each object in the file, indexed by its number minus one; 0 if it is not written.
    offsets: Vec<u64>,
    pages: Vec<Ref>,
    /// Fonts that any text is set in, indexed by their numbers.
    fonts: Vec<UsedFont>,
    /// Graphics states by their opacity in parts of 255.
    states: BTreeMap<u8, Ref>,
    /// Layers that any page has, as optional content.
    layers: BTreeMap<PageLayer, Ref>,
    bookmarks: Vec<(String, usize)>,
}

/// The used glyphs of a font, and the text that each stands for.
struct UsedFont {
    font: Font,
    id: Ref,
    glyphs: GlyphRemapper,
    texts: BTreeMap<u16, String>,
}

/// A page of a document, which is written when it ends.
pub(crate) struct PdfPage<'a> {
    pdf: &'a mut Pdf,
    number: usize,
    area: Area,
    /// Visible part of the page while the map is drawn; otherwise all of the page is visible.
    clip: Option<Area>,
    /// Points per unit of the page, and units per pixel.
    user_unit: f64,
    units_per_pixel: f64,
    lettering: Lettering,
    /// Object that lists the fonts, pictures and all else that the page's content names.
    resources: Ref,
    content: Content,
    /// Current opacity in parts of 255, and the opacity to return to when the map ends.
    opacity: u8,
    outer_opacity: u8,
    /// While an item is drawn: the content of the page around the item, and the opacity there.
    around: Option<(Content, u8)>,
    /// Pictures and items (forms), in the order of their names `X0`, `X1`, ...
    objects: Vec<Ref>,
    rows: Option<Rows>,
    links: Vec<([f64; 4], usize)>,
    refused: Option<Error>,
}

/// A picture under way.
struct Rows {
    area: Area,
    packed: ZlibEncoder<Vec<u8>>,
}

const CATALOG: Ref = Ref::new(1);
const PAGES: Ref = Ref::new(2);
const INFO: Ref = Ref::new(3);
const OUTLINE: Ref = Ref::new(4);

impl Pdf {
    /// Begins a document that will be at `path`.
    ///
    /// # Errors
    /// When the file cannot be begun.
    pub fn create(path: PathBuf) -> Result<Pdf, Error> {
        let file = PartFile::create(path)?;
        let offsets = vec![0; OUTLINE.get() as usize];
        let (pages, bookmarks, fonts) = (Vec::new(), Vec::new(), Vec::new());
        let (states, layers) = (BTreeMap::new(), BTreeMap::new());
        let mut pdf = Pdf { file, bytes: 0, offsets, pages, fonts, states, layers, bookmarks };
        // Bytes above 127 tell programs that copy the file that it is binary.
        pdf.write(b"%PDF-1.7\n%\x80\x80\x80\x80\n")?;
        Ok(pdf)
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), Error> {
        self.file.write_all(bytes).map_err(Error::io(self.file.path()))?;
        self.bytes += bytes.len() as u64;
        Ok(())
    }

    fn new_ref(&mut self) -> Ref {
        self.offsets.push(0);
        Ref::new(self.offsets.len() as i32)
    }

    /// Writes one object.
    fn put(&mut self, object: &Chunk) -> Result<(), Error> {
        for id in object.refs() {
            self.offsets[id.get() as usize - 1] = self.bytes;
        }
        debug_assert_eq!(object.refs().len(), 1);
        self.write(object.as_bytes())
    }

    fn page_ref(&mut self, number: usize) -> Ref {
        while self.pages.len() <= number {
            let id = self.new_ref();
            self.pages.push(id);
        }
        self.pages[number]
    }

    /// Adds a graphics state of an opacity unless there is one.
    fn add_state(&mut self, opacity: u8) {
        if !self.states.contains_key(&opacity) {
            let id = self.new_ref();
            self.states.insert(opacity, id);
        }
    }

    /// Adds a layer unless there is one.
    fn add_layer(&mut self, layer: PageLayer) {
        if !self.layers.contains_key(&layer) {
            let id = self.new_ref();
            self.layers.insert(layer, id);
        }
    }

    /// Begins a page of an area of pixels. Pages come one after the other.
    pub fn page(&mut self, number: usize, area: Area, scale: Scale, lettering: Lettering) -> PdfPage<'_> {
        let user_unit = user_unit([area.width(), area.height()].map(|pixels| pixels as f64 / scale.pixels_per_mm));
        let units_per_pixel = POINTS_A_MM / scale.pixels_per_mm / user_unit;
        let (unit, height) = (units_per_pixel as f32, area.height() as f64 * units_per_pixel);
        let mut content = Content::with_settings(COMPACT);
        // Pixels go down from the north-western corner, units up from the south-western one.
        content.transform([unit, 0.0, 0.0, -unit, 0.0, height as f32]);
        content.set_line_join(LineJoinStyle::RoundJoin);
        PdfPage {
            number,
            area,
            clip: None,
            user_unit,
            units_per_pixel,
            lettering,
            resources: self.new_ref(),
            content,
            opacity: u8::MAX,
            outer_opacity: u8::MAX,
            around: None,
            objects: Vec::new(),
            rows: None,
            links: Vec::new(),
            refused: None,
            pdf: self,
        }
    }

    /// Adds a line to the list of contents that viewers show beside the pages.
    pub fn bookmark(&mut self, title: &str, page: usize) {
        self.bookmarks.push((title.to_owned(), page));
    }

    /// Ends the document, whose title and description readers show.
    ///
    /// # Errors
    /// When the disk refuses.
    pub fn finish(mut self, title: &str, description: &str, program: &str) -> Result<Finished, Error> {
        for (number, font) in std::mem::take(&mut self.fonts).into_iter().enumerate() {
            self.finish_font(number, &font)?;
        }
        for (key, id) in std::mem::take(&mut self.states) {
            let mut object = Chunk::with_settings(COMPACT);
            let opacity = f32::from(key) / 255.0;
            object.ext_graphics(id).stroking_alpha(opacity).non_stroking_alpha(opacity);
            self.put(&object)?;
        }
        self.finish_layers()?;
        self.finish_outline()?;
        let mut object = Chunk::with_settings(COMPACT);
        object.pages(PAGES).count(self.pages.len() as i32).kids(self.pages.iter().copied());
        self.put(&object)?;
        let mut object = Chunk::with_settings(COMPACT);
        object
            .indirect(INFO)
            .start::<DocumentInfo>()
            .title(TextStr(title))
            .subject(TextStr(description))
            .creator(TextStr(program))
            .producer(TextStr(program));
        self.put(&object)?;
        let mut object = Chunk::with_settings(COMPACT);
        let mut catalog = object.indirect(CATALOG).start::<Catalog>();
        catalog.pages(PAGES);
        if !self.bookmarks.is_empty() {
            catalog.outlines(OUTLINE).page_mode(PageMode::UseOutlines);
        }
        if !self.layers.is_empty() {
            let mut layers = catalog.insert(Name(b"OCProperties")).dict();
            layers.insert(Name(b"OCGs")).array().items(self.layers.values().copied());
            let mut shown = layers.insert(Name(b"D")).dict();
            // Lists of layers begin with the highest.
            shown.insert(Name(b"Order")).array().items(self.layers.values().rev().copied());
        }
        catalog.viewer_preferences().display_doc_title(true);
        catalog.finish();
        self.put(&object)?;
        let start = self.bytes;
        let count = self.offsets.len() + 1;
        let mut table = format!("xref\n0 {count}\n0000000000 65535 f \n").into_bytes();
        for offset in &self.offsets {
            // A number without an object is marked as free.
            let kind = if *offset == 0 { "65535 f" } else { "00000 n" };
            table.extend(format!("{offset:010} {kind} \n").into_bytes());
        }
        let (root, info) = (CATALOG.get(), INFO.get());
        let trailer =
            format!("trailer\n<< /Size {count} /Root {root} 0 R /Info {info} 0 R >>\nstartxref\n{start}\n%%EOF\n");
        table.extend(trailer.into_bytes());
        self.write(&table)?;
        self.file.finish()
    }

    /// Writes the layers with their names.
    fn finish_layers(&mut self) -> Result<(), Error> {
        for (layer, id) in self.layers.clone() {
            let mut object = Chunk::with_settings(COMPACT);
            object.indirect(id).dict().pair(Name(b"Type"), Name(b"OCG")).pair(Name(b"Name"), TextStr(layer.name()));
            self.put(&object)?;
        }
        Ok(())
    }

    /// Writes the list of contents (outline), in one level.
    fn finish_outline(&mut self) -> Result<(), Error> {
        let bookmarks = self.bookmarks.clone();
        if bookmarks.is_empty() {
            return Ok(());
        }
        let ids: Vec<Ref> = bookmarks.iter().map(|_| self.new_ref()).collect();
        let mut object = Chunk::with_settings(COMPACT);
        object.outline(OUTLINE).first(ids[0]).last(ids[ids.len() - 1]).count(ids.len() as i32);
        self.put(&object)?;
        for (index, (title, page)) in bookmarks.iter().enumerate() {
            let page = self.page_ref(*page);
            let mut object = Chunk::with_settings(COMPACT);
            let mut item = object.outline_item(ids[index]);
            item.title(TextStr(title)).parent(OUTLINE);
            if index > 0 {
                item.prev(ids[index - 1]);
            }
            if let Some(next) = ids.get(index + 1) {
                item.next(*next);
            }
            item.dest().page(page).fit();
            item.finish();
            self.put(&object)?;
        }
        Ok(())
    }

    /// Returns the number of a font among the document's fonts; adds the font if it is new.
    fn number_of(&mut self, font: Font) -> usize {
        let known = self.fonts.iter().position(|used| used.font == font);
        known.unwrap_or_else(|| {
            let id = self.new_ref();
            self.fonts.push(UsedFont { font, id, glyphs: GlyphRemapper::new(), texts: BTreeMap::new() });
            self.fonts.len() - 1
        })
    }

    /// Writes the used glyphs of a font as a font of their own, with a map from glyphs to text so that readers can
    /// search and copy it.
    fn finish_font(&mut self, number: usize, used: &UsedFont) -> Result<(), Error> {
        let UsedFont { font, id, glyphs, texts } = used;
        let widths: Vec<f32> = glyphs.remapped_gids().map(|glyph| font.advance(glyph)).collect();
        let part = subset(*font, glyphs)?;
        // Cubic outlines are in one table (CFF), which is embedded alone; quadratic ones need the whole font file.
        let cubic = table(&part, *b"CFF ");
        let [cid, descriptor, data, letters] = [(); 4].map(|()| self.new_ref());
        // A tag of six letters before the name marks a subset of a font.
        let [sixth, fifth] = [1, 26].map(|place| char::from(b'A' + (number / place % 26) as u8));
        let known_as: String = font.full_name().chars().filter(char::is_ascii_alphanumeric).collect();
        let name = format!("TERR{fifth}{sixth}+{known_as}");
        let name = Name(name.as_bytes());
        let mut object = Chunk::with_settings(COMPACT);
        object
            .type0_font(*id)
            .base_font(name)
            .encoding_predefined(Name(b"Identity-H"))
            .descendant_font(cid)
            .to_unicode(letters);
        self.put(&object)?;
        let mut object = Chunk::with_settings(COMPACT);
        let mut cid_font = object.cid_font(cid);
        cid_font.base_font(name).system_info(IDENTITY).font_descriptor(descriptor);
        match cubic {
            Some(_) => cid_font.subtype(CidFontType::Type0),
            None => cid_font.subtype(CidFontType::Type2).cid_to_gid_map_predefined(Name(b"Identity")),
        };
        cid_font.default_width(0.0).widths().consecutive(0, widths);
        cid_font.finish();
        self.put(&object)?;
        let mut object = Chunk::with_settings(COMPACT);
        let [ascent, descent, cap_height] = font.heights();
        let italic = font.is_slanted();
        let mut flags = FontFlags::SERIF | FontFlags::SYMBOLIC;
        flags.set(FontFlags::ITALIC, italic);
        let mut described = object.font_descriptor(descriptor);
        described
            .name(name)
            .flags(flags)
            .bbox(Rect::new(-500.0, descent, 1500.0, ascent))
            .italic_angle(if italic { -12.0 } else { 0.0 })
            .ascent(ascent)
            .descent(descent)
            .cap_height(cap_height)
            .stem_v(80.0);
        match cubic {
            Some(_) => described.font_file3(data),
            None => described.font_file2(data),
        };
        described.finish();
        self.put(&object)?;
        let mut object = Chunk::with_settings(COMPACT);
        let packed = deflated(cubic.unwrap_or(&part));
        let mut stream = object.stream(data, &packed);
        stream.filter(Filter::FlateDecode);
        match cubic {
            Some(_) => stream.pair(Name(b"Subtype"), Name(b"CIDFontType0C")),
            None => stream.pair(Name(b"Length1"), part.len() as i32),
        };
        stream.finish();
        self.put(&object)?;
        let mut map: UnicodeCmap = UnicodeCmap::new(Name(b"Letters"), IDENTITY);
        for (glyph, text) in texts {
            map.pair_with_multiple(*glyph, text.chars());
        }
        let mut object = Chunk::with_settings(COMPACT);
        let packed = deflated(&map.finish());
        object.cmap(letters, &packed).filter(Filter::FlateDecode);
        self.put(&object)
    }
}

fn deflated(bytes: &[u8]) -> Vec<u8> {
    let mut packed = ZlibEncoder::new(Vec::new(), Compression::default());
    packed.write_all(bytes).and_then(|()| packed.finish()).expect("memory takes everything")
}

/// Returns the points per unit for a page of a size: 1 for pages of up to 14,400 points a side, and for larger ones the
/// least whole number that keeps the page within 14,400 units.
pub(super) fn user_unit([width_mm, height_mm]: [f64; 2]) -> f64 {
    (width_mm.max(height_mm) / MOST_MM).ceil().max(1.0)
}

/// Rounds to hundredths of a pixel, which are finer than any printer shows and take few digits.
fn rounded(value: f64) -> f32 {
    ((value * 100.0).round() / 100.0) as f32
}

impl PdfPage<'_> {
    /// Converts a place on the map to pixels from the north-western corner of the page.
    fn at(&self, at: DVec2) -> [f32; 2] {
        [rounded(at.x - self.area.x0 as f64), rounded(at.y - self.area.y0 as f64)]
    }

    fn path(&mut self, lines: &[Vec<DVec2>]) -> bool {
        let mut is_begun = false;
        for line in lines {
            let closes = line.len() > 2 && line[0] == line[line.len() - 1];
            let points = &line[..line.len() - usize::from(closes)];
            for (index, point) in points.iter().enumerate() {
                let [x, y] = self.at(*point);
                if index == 0 {
                    self.content.move_to(x, y)
                } else {
                    self.content.line_to(x, y)
                };
                is_begun = true;
            }
            if closes {
                self.content.close_path();
            }
        }
        is_begun
    }

    /// Sets the opacity of all that is drawn after this call.
    fn set_opacity(&mut self, opacity: f32) {
        let opacity = (opacity * 255.0 + 0.5) as u8;
        if opacity != self.opacity {
            self.opacity = opacity;
            self.pdf.add_state(opacity);
            self.content.set_parameters(Name(format!("G{opacity}").as_bytes()));
        }
    }

    /// Sets a colour and full opacity for fills.
    fn set_fill(&mut self, colour: Colour) {
        let [red, green, blue] = colour.0.map(|channel| f32::from(channel) / 255.0);
        self.set_opacity(1.0);
        self.content.set_fill_rgb(red, green, blue);
    }

    fn set_pen(&mut self, pen: &Pen) {
        let [red, green, blue] = pen.colour.0.map(|channel| f32::from(channel) / 255.0);
        self.set_opacity(pen.opacity);
        self.content.set_stroke_rgb(red, green, blue).set_line_width(rounded(f64::from(pen.width)));
    }

    /// Adds the outlines of a text to the path; returns whether there are any.
    fn outlines(&mut self, text: &Placed) -> bool {
        let Some(path) = text.path([self.area.x0, self.area.y0]) else { return false };
        let mut last = Vec2::ZERO;
        for segment in path.segments() {
            match segment {
                PathSegment::MoveTo(to) => {
                    last = vec2(to.x, to.y);
                    self.content.move_to(to.x, to.y);
                }
                PathSegment::LineTo(to) => {
                    last = vec2(to.x, to.y);
                    self.content.line_to(to.x, to.y);
                }
                PathSegment::QuadTo(control, to) => {
                    // PDF has cubic curves only; every quadratic curve can be written as a cubic one.
                    let (control, to) = (vec2(control.x, control.y), vec2(to.x, to.y));
                    let [a, b] = [last, to].map(|end| (end + 2.0 * control) / 3.0);
                    self.content.cubic_to(a.x, a.y, b.x, b.y, to.x, to.y);
                    last = to;
                }
                PathSegment::CubicTo(..) => unreachable!("outlines of letters are quadratic"),
                PathSegment::Close => _ = self.content.close_path(),
            }
        }
        true
    }

    fn surround(&mut self, text: &Placed, pen: &Pen) {
        if pen.width <= 0.0 || !self.sees(bounds(text.boxes.iter().flatten())) {
            return;
        }
        self.set_pen(pen);
        match self.lettering {
            Lettering::Text => {
                self.content.set_text_rendering_mode(TextRenderingMode::Stroke);
                // The halo gets an empty text: readers find the text once, at the letters that are drawn over the halo.
                self.show(text, "");
            }
            Lettering::Outlines => {
                if self.outlines(text) {
                    self.content.stroke();
                }
            }
        }
    }

    /// Draws the glyphs of a text. Readers that search or copy get `meant` instead of the glyphs.
    fn show(&mut self, text: &Placed, meant: &str) {
        let mut span = self.content.begin_marked_content_with_properties(Name(b"Span"));
        span.properties().actual_text(TextStr(meant));
        span.finish();
        self.content.begin_text();
        let mut last = None;
        let mut set = None;
        for glyph in &text.glyphs {
            let number = self.pdf.number_of(glyph.font);
            if set != Some(number) {
                self.content.set_font(Name(format!("F{number}").as_bytes()), rounded(text.size_px));
                set = Some(number);
            }
            let font = &mut self.pdf.fonts[number];
            let new = font.glyphs.remap(glyph.id);
            // If several glyphs stand for the same letters, the first one gets all the letters and the others none.
            let letters = if last.as_ref() == Some(&glyph.text) { "" } else { &text.text[glyph.text.clone()] };
            last = Some(glyph.text.clone());
            let known = font.texts.entry(new).or_default();
            if known.is_empty() {
                known.push_str(letters);
            }
            let Vec2 { x: cos, y: sin } = glyph.along.as_vec2();
            let [x, y] = self.at(glyph.at);
            self.content.set_text_matrix([cos, sin, sin, -cos, x, y]);
            self.content.show(Str(&new.to_be_bytes()));
        }
        self.content.end_text();
        self.content.end_marked_content();
    }

    /// Draws a picture or an item that was written as an object.
    fn show_object(&mut self, id: Ref) {
        let name = format!("X{}", self.objects.len());
        self.objects.push(id);
        self.content.x_object(Name(name.as_bytes()));
    }

    /// Makes a part of the page a link to another page.
    pub fn link(&mut self, part: [f64; 4], page: usize) {
        self.links.push((part, page));
    }

    /// Writes the page.
    ///
    /// # Errors
    /// When the disk refuses.
    pub fn finish(self) -> Result<(), Error> {
        let PdfPage {
            pdf, number, area, user_unit, units_per_pixel, resources, content, objects, links, refused, ..
        } = self;
        if let Some(error) = refused {
            return Err(error);
        }
        let stream = pdf.new_ref();
        let mut object = Chunk::with_settings(COMPACT);
        let packed = deflated(&content.finish());
        object.stream(stream, &packed).filter(Filter::FlateDecode);
        pdf.put(&object)?;
        let mut annotations = Vec::new();
        for ([west, north, east, south], target) in links {
            let id = pdf.new_ref();
            let target = pdf.page_ref(target);
            let mut object = Chunk::with_settings(COMPACT);
            let mut link = object.annotation(id);
            let x = |at: f64| ((at - area.x0 as f64) * units_per_pixel) as f32;
            let y = |at: f64| ((area.y1 as f64 - at) * units_per_pixel) as f32;
            link.subtype(AnnotationType::Link).rect(Rect::new(x(west), y(south), x(east), y(north)));
            link.border(0.0, 0.0, 0.0, None);
            link.action().action_type(ActionType::GoTo).destination().page(target).fit();
            link.finish();
            pdf.put(&object)?;
            annotations.push(id);
        }
        let id = pdf.page_ref(number);
        let mut object = Chunk::with_settings(COMPACT);
        let mut page = object.page(id);
        let size = [area.width(), area.height()].map(|pixels| (pixels as f64 * units_per_pixel) as f32);
        page.parent(PAGES).media_box(Rect::new(0.0, 0.0, size[0], size[1])).contents(stream);
        if user_unit > 1.0 {
            page.user_unit(user_unit as f32);
        }
        page.pair(Name(b"Resources"), resources);
        if !annotations.is_empty() {
            page.annotations(annotations);
        }
        page.finish();
        pdf.put(&object)?;
        pdf.put_resources(resources, &objects)
    }
}

impl Pdf {
    /// Writes the resources of a page: the objects, fonts, states and layers that its content names.
    fn put_resources(&mut self, id: Ref, objects: &[Ref]) -> Result<(), Error> {
        let mut object = Chunk::with_settings(COMPACT);
        let mut resources = object.indirect(id).start::<Resources>();
        let mut fonts = resources.fonts();
        for (index, font) in self.fonts.iter().enumerate() {
            fonts.pair(Name(format!("F{index}").as_bytes()), font.id);
        }
        fonts.finish();
        let mut states = resources.ext_g_states();
        for (key, state) in &self.states {
            states.pair(Name(format!("G{key}").as_bytes()), *state);
        }
        states.finish();
        let mut named = resources.x_objects();
        for (index, object) in objects.iter().enumerate() {
            named.pair(Name(format!("X{index}").as_bytes()), *object);
        }
        named.finish();
        let mut layers = resources.insert(Name(b"Properties")).dict();
        for (layer, id) in &self.layers {
            layers.pair(Name(layer.name().as_bytes()), *id);
        }
        layers.finish();
        resources.finish();
        self.put(&object)
    }
}

impl Plotter for PdfPage<'_> {
    fn area(&self) -> Area {
        self.clip.unwrap_or(self.area)
    }

    fn begin_layer(&mut self, layer: PageLayer) {
        self.pdf.add_layer(layer);
        self.content.begin_marked_content_with_properties(Name(b"OC")).properties_named(Name(layer.name().as_bytes()));
    }

    fn end_layer(&mut self) {
        self.content.end_marked_content();
    }

    fn begin_item(&mut self, _item: &Item<'_>) {
        debug_assert!(self.around.is_none(), "a thing is no part of another");
        let around = std::mem::replace(&mut self.content, Content::with_settings(COMPACT));
        self.around = Some((around, self.opacity));
    }

    fn end_item(&mut self) {
        let (around, opacity) = self.around.take().expect("a thing was begun");
        let content = std::mem::replace(&mut self.content, around).finish();
        self.opacity = opacity;
        if content.is_empty() || self.refused.is_some() {
            return;
        }
        let id = self.pdf.new_ref();
        let packed = deflated(&content);
        let mut object = Chunk::with_settings(COMPACT);
        let mut form = object.form_xobject(id, &packed);
        form.filter(Filter::FlateDecode);
        form.bbox(Rect::new(0.0, 0.0, self.area.width() as f32, self.area.height() as f32));
        form.pair(Name(b"Resources"), self.resources);
        form.finish();
        self.refused = self.pdf.put(&object).err();
        self.show_object(id);
    }

    fn fill(&mut self, shape: &Shape, colour: Colour) {
        if !self.sees(shape.bounds) {
            return;
        }
        self.set_fill(colour);
        if self.path(&shape.lines) {
            self.content.fill_even_odd();
        }
    }

    fn stroke(&mut self, lines: &[Vec<DVec2>], pen: &Pen) {
        if pen.width <= 0.0 || !self.sees(bounds(lines.iter().flatten())) {
            return;
        }
        self.set_pen(pen);
        match pen.dash {
            Some(dash) => {
                let dash = dash.map(|length| rounded(f64::from(length)));
                self.content.set_line_cap(LineCapStyle::ButtCap).set_dash_pattern(dash, 0.0);
            }
            None => _ = self.content.set_line_cap(LineCapStyle::RoundCap),
        }
        if self.path(lines) {
            self.content.stroke();
        }
        if pen.dash.is_some() {
            self.content.set_dash_pattern([], 0.0);
        }
    }

    fn write(&mut self, text: &Placed, colour: Colour) {
        if !self.sees(bounds(text.boxes.iter().flatten())) {
            return;
        }
        self.set_fill(colour);
        match self.lettering {
            Lettering::Text => {
                self.content.set_text_rendering_mode(TextRenderingMode::Fill);
                self.show(text, &text.text);
            }
            Lettering::Outlines => {
                if self.outlines(text) {
                    self.content.fill_nonzero();
                }
            }
        }
    }

    fn inscribe(&mut self, inscriptions: &[Inscription<'_>]) {
        for Inscription { item, text, colour, halo } in inscriptions {
            self.begin_item(item);
            self.surround(text, halo);
            self.write(text, *colour);
            self.end_item();
        }
    }

    fn dot(&mut self, middle: DVec2, radius: f64, colour: Colour) {
        self.set_fill(colour);
        let at = |dx: f64, dy: f64| self.at(middle + radius * dvec2(dx, dy));
        let corners = [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0], [1.0, 0.0]];
        let start = at(1.0, 0.0);
        let curves: Vec<[[f32; 2]; 3]> = corners
            .windows(2)
            .map(|pair| {
                let [[ax, ay], [bx, by]] = [pair[0], pair[1]];
                [at(ax + bx * QUARTER, ay + by * QUARTER), at(bx + ax * QUARTER, by + ay * QUARTER), at(bx, by)]
            })
            .collect();
        self.content.move_to(start[0], start[1]);
        for [a, b, c] in curves {
            self.content.cubic_to(a[0], a[1], b[0], b[1], c[0], c[1]);
        }
        self.content.fill_nonzero();
    }
}

impl Page for PdfPage<'_> {
    fn clip(&mut self, part: Area) {
        self.clip = Some(part);
        let [x, y] = self.at(dvec2(part.x0 as f64, part.y0 as f64));
        self.content.save_state().rect(x, y, part.width() as f32, part.height() as f32).clip_nonzero().end_path();
        self.outer_opacity = self.opacity;
    }

    fn begin_picture(&mut self, part: Area) {
        self.rows = Some(Rows { area: part, packed: ZlibEncoder::new(Vec::new(), Compression::default()) });
    }

    fn add_rows(&mut self, pixels: &[u8]) -> Result<(), Error> {
        let rows = self.rows.as_mut().expect("a picture was begun");
        let mut filtered = Vec::with_capacity(pixels.len() + pixels.len() / rows.area.width());
        for row in pixels.chunks_exact(rows.area.width() * 3) {
            // PNG's filter 1: each pixel as its difference from the pixel before it.
            filtered.push(1);
            filtered.extend(&row[..3]);
            filtered.extend(row[3..].iter().zip(row).map(|(here, before)| here.wrapping_sub(*before)));
        }
        rows.packed.write_all(&filtered).expect("memory takes everything");
        Ok(())
    }

    fn end_picture(&mut self) -> Result<(), Error> {
        let Rows { area, packed } = self.rows.take().expect("a picture was begun");
        let packed = packed.finish().expect("memory takes everything");
        let (width, height) = (area.width() as i32, area.height() as i32);
        let id = self.pdf.new_ref();
        let mut object = Chunk::with_settings(COMPACT);
        let mut image = object.image_xobject(id, &packed);
        image.filter(Filter::FlateDecode);
        image.width(width).height(height).bits_per_component(8);
        image.color_space().device_rgb();
        image.decode_parms().predictor(Predictor::PngSub).colors(3).columns(width);
        image.finish();
        self.pdf.put(&object)?;
        let [x, y] = self.at(dvec2(area.x0 as f64, area.y0 as f64));
        self.content.save_state();
        // PDF draws pictures with y upwards. The page's y goes down, so the picture is flipped.
        self.content.transform([width as f32, 0.0, 0.0, -height as f32, x, y + height as f32]);
        self.show_object(id);
        self.content.restore_state();
        Ok(())
    }

    fn open(&mut self) {
        self.clip = None;
        self.content.restore_state();
        self.opacity = self.outer_opacity;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map::font::{Face, Typeface};
    use crate::map::text::shape;

    const SCALE: Scale = Scale { metres_per_pixel: 1.0, pixels_per_mm: 1.0 };
    const INK: Colour = Colour([0; 3]);

    /// Returns each fill, stroke and text operator of some content, with its opacity in parts of 255.
    fn painted(content: &[u8]) -> Vec<(String, u8)> {
        // A name may follow an operator without a space.
        let text = String::from_utf8_lossy(content).replace('/', " /");
        let words: Vec<&str> = text.split_ascii_whitespace().collect();
        let (mut opacity, mut outer, mut painted) = (255, Vec::new(), Vec::new());
        for (index, word) in words.iter().enumerate() {
            match *word {
                "q" => outer.push(opacity),
                "Q" => opacity = outer.pop().unwrap(),
                "gs" => opacity = words[index - 1].trim_start_matches("/G").parse().unwrap(),
                "f" | "f*" | "S" => painted.push(((*word).to_owned(), opacity)),
                // There is no space between a text and its operator.
                text if text.ends_with("Tj") => painted.push(("Tj".to_owned(), opacity)),
                _ => {}
            }
        }
        painted
    }

    #[test]
    fn a_document_carries_each_font_that_its_text_is_set_in() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("map.pdf");
        let mut pdf = Pdf::create(path.clone()).unwrap();
        let mut page = pdf.page(0, Area::new(0, 0, 100, 100), SCALE, Lettering::Text);
        // The style's font file lacks the last letter, so another font draws it.
        let typeface = Typeface { face: Face::Bold, own: Some(Font::of_file()) };
        page.write(&shape("Alp \u{1f7}", typeface, 10.0, 0.0).at(dvec2(10.0, 50.0), 0.0), INK);
        page.finish().unwrap();
        pdf.finish("", "", "").unwrap();
        let text = String::from_utf8_lossy(&std::fs::read(path).unwrap()).into_owned();
        for part in ["TERRAA+DejaVuSansMono", "TERRAB+LibertinusSerifBold", "/FontFile2", "/FontFile3", "/CIDFontType2"]
        {
            assert!(text.contains(part), "{part}");
        }
        // Fonts that no text is set in are left out.
        assert_eq!(text.matches("/Type/FontDescriptor").count(), 2);
    }

    #[test]
    fn a_pale_pen_leaves_what_comes_after_it_as_it_is() {
        let folder = tempfile::tempdir().unwrap();
        let mut pdf = Pdf::create(folder.path().join("map.pdf")).unwrap();
        let area = Area::new(0, 0, 100, 100);
        let mut page = pdf.page(0, area, SCALE, Lettering::Text);
        let pale = Pen { colour: INK, opacity: 0.28, width: 1.0, dash: None };
        let shape_of = Shape::rectangle([10.0, 10.0, 20.0, 20.0]);
        let text = shape("1 : 25 000", Face::Regular, 10.0, 0.0).at(dvec2(10.0, 50.0), 0.0);
        let pale_line = |page: &mut PdfPage| page.stroke_shape(&shape_of, &pale);
        pale_line(&mut page);
        page.fill(&shape_of, INK);
        pale_line(&mut page);
        page.dot(dvec2(30.0, 30.0), 2.0, INK);
        // An opacity set within the map ends with the map.
        page.clip(area);
        pale_line(&mut page);
        page.open();
        page.write(&text, INK);
        // An opacity set within an item ends with the item.
        page.begin_item(&Item::only("grid"));
        pale_line(&mut page);
        page.end_item();
        page.stroke_shape(&shape_of, &Pen { opacity: 1.0, ..pale });
        page.fill(&shape_of, INK);
        let content = std::mem::replace(&mut page.content, Content::with_settings(COMPACT)).finish();
        let painted = painted(&content);
        let expected = [("S", 71), ("f*", 255), ("S", 71), ("f", 255), ("S", 71)];
        let expected = expected.map(|(operator, opacity)| (operator.to_owned(), opacity));
        assert_eq!(painted[..5], expected, "{}", String::from_utf8_lossy(&content));
        assert!(painted[5..].iter().all(|(_, opacity)| *opacity == 255) && painted.len() > 12, "{painted:?}");
    }

    #[test]
    fn a_page_of_more_than_14_400_points_has_a_larger_unit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("map.pdf");
        // 12 m a side, which are 34,015.7 points.
        let mut pdf = Pdf::create(path.clone()).unwrap();
        pdf.page(0, Area::new(0, 0, 12_000, 6_000), SCALE, Lettering::Text).finish().unwrap();
        pdf.page(1, Area::new(0, 0, 5_000, 5_080), SCALE, Lettering::Text).finish().unwrap();
        pdf.finish("", "", "").unwrap();
        let bytes = std::fs::read(path).unwrap();
        let text = String::from_utf8_lossy(&bytes);
        assert!(text.contains("/MediaBox[0 0 11338.58") && text.contains("/UserUnit 3"), "{text}");
        assert_eq!(text.matches("/UserUnit").count(), 1, "a smaller page has points");
    }
}
