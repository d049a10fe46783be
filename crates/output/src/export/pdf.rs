//! PDF: pages with lines as lines, text as text and the ground as a picture.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::PathBuf;

use flate2::Compression;
use flate2::write::ZlibEncoder;
use pdf_writer::types::{
    ActionType, AnnotationType, CidFontType, FontFlags, LineCapStyle, LineJoinStyle, PageMode, Predictor, SystemInfo,
    TextRenderingMode, UnicodeCmap,
};
use pdf_writer::writers::{Catalog, DocumentInfo};
use pdf_writer::{Chunk, Content, Filter, Finish, Name, Rect, Ref, Settings, Str, TextStr};
use subsetter::GlyphRemapper;

use crate::area::Area;
use crate::error::Error;
use crate::file::{Finished, PartFile};
use crate::map::plotter::{Page, Pen, Plotter, Shape, bounds};
use crate::map::scale::Scale;
use crate::map::style::Colour;
use crate::map::text::{Face, Placed};

/// Points of an inch, and millimetres.
const POINTS_A_MM: f64 = 72.0 / 25.4;

/// Control points of a quarter of a circle of radius 1, so that a cubic curve is nearest to it.
const QUARTER: f64 = 0.552_284_75;

const COMPACT: Settings = Settings { pretty: false };

const IDENTITY: SystemInfo<'static> = SystemInfo { registry: Str(b"Adobe"), ordering: Str(b"Identity"), supplement: 0 };

/// A document under way. Objects go to the disk as they are made; what all pages share comes last.
pub(crate) struct Pdf {
    file: PartFile,
    bytes: u64,
    /// Where each object begins, by its number less one.
    offsets: Vec<u64>,
    pages: Vec<Ref>,
    fonts: [Font; Face::ALL.len()],
    /// Graphics states by their opacity in parts of 255.
    states: BTreeMap<u8, Ref>,
    bookmarks: Vec<(String, usize)>,
}

/// The glyphs of a face that are used, and what they stand for.
struct Font {
    id: Ref,
    glyphs: GlyphRemapper,
    texts: BTreeMap<u16, String>,
}

/// A page of a document, which is written when it ends.
pub(crate) struct PdfPage<'a> {
    pdf: &'a mut Pdf,
    number: usize,
    area: Area,
    /// What is seen of it.
    clip: Option<Area>,
    scale: Scale,
    content: Content,
    pictures: Vec<Ref>,
    rows: Option<Rows>,
    links: Vec<([f64; 4], usize)>,
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
        let mut next = OUTLINE.get();
        let fonts = [(); Face::ALL.len()].map(|()| {
            next += 1;
            Font { id: Ref::new(next), glyphs: GlyphRemapper::new(), texts: BTreeMap::new() }
        });
        let file = PartFile::create(path)?;
        let offsets = vec![0; next as usize];
        let mut pdf =
            Pdf { file, bytes: 0, offsets, pages: Vec::new(), fonts, states: BTreeMap::new(), bookmarks: Vec::new() };
        // Bytes above 127 tell those who copy the file that it is no text.
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

    fn state(&mut self, opacity: f32) -> (u8, Ref) {
        let key = (opacity * 255.0 + 0.5) as u8;
        if let Some(id) = self.states.get(&key) {
            return (key, *id);
        }
        let id = self.new_ref();
        self.states.insert(key, id);
        (key, id)
    }

    /// Begins a page of an area of pixels. Pages come one after the other.
    pub fn page(&mut self, number: usize, area: Area, scale: Scale) -> PdfPage<'_> {
        let point = POINTS_A_MM / scale.pixels_per_mm;
        let mut content = Content::with_settings(COMPACT);
        // Pixels go down from the north-western corner, points up from the south-western one.
        content.transform([point as f32, 0.0, 0.0, -point as f32, 0.0, (area.height() as f64 * point) as f32]);
        content.set_line_join(LineJoinStyle::RoundJoin);
        PdfPage {
            pdf: self,
            number,
            area,
            clip: None,
            scale,
            content,
            pictures: Vec::new(),
            rows: None,
            links: Vec::new(),
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
        for face in Face::ALL {
            self.finish_font(face)?;
        }
        for (key, id) in std::mem::take(&mut self.states) {
            let mut object = Chunk::with_settings(COMPACT);
            let opacity = f32::from(key) / 255.0;
            object.ext_graphics(id).stroking_alpha(opacity).non_stroking_alpha(opacity);
            self.put(&object)?;
        }
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
        catalog.viewer_preferences().display_doc_title(true);
        catalog.finish();
        self.put(&object)?;
        let start = self.bytes;
        let count = self.offsets.len() + 1;
        let mut table = format!("xref\n0 {count}\n0000000000 65535 f \n").into_bytes();
        for offset in &self.offsets {
            // What no object uses is free.
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

    /// The list of contents, in one level.
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

    /// The glyphs of a face that were used, as a font of their own, and which letters they are.
    fn finish_font(&mut self, face: Face) -> Result<(), Error> {
        let Font { id, glyphs, texts } = &self.fonts[face as usize];
        if texts.is_empty() {
            return Ok(());
        }
        let (id, texts) = (*id, texts.clone());
        let widths: Vec<f32> = glyphs.remapped_gids().map(|glyph| face.advance(glyph)).collect();
        let font = subsetter::subset(face.data(), 0, glyphs).expect("the fonts that come with the program can be read");
        let outlines = table(&font, *b"CFF ").expect("Libertinus has cubic outlines").to_vec();
        let [cid, descriptor, data, letters] = [(); 4].map(|()| self.new_ref());
        // A tag of six letters says that this is a part of a font.
        let tag = ["TERRAA", "TERRAB", "TERRAC", "TERRAD", "TERRAE", "TERRAF"][face as usize];
        let name = format!("{tag}+{}", face.full_name().replace(' ', "-").replacen('-', "", 1));
        let name = Name(name.as_bytes());
        let mut object = Chunk::with_settings(COMPACT);
        object
            .type0_font(id)
            .base_font(name)
            .encoding_predefined(Name(b"Identity-H"))
            .descendant_font(cid)
            .to_unicode(letters);
        self.put(&object)?;
        let mut object = Chunk::with_settings(COMPACT);
        let mut font = object.cid_font(cid);
        font.subtype(CidFontType::Type0).base_font(name).system_info(IDENTITY).font_descriptor(descriptor);
        font.default_width(0.0).widths().consecutive(0, widths);
        font.finish();
        self.put(&object)?;
        let mut object = Chunk::with_settings(COMPACT);
        let [ascent, descent, cap_height] = face.heights();
        let italic = face.full_name().contains("Italic");
        let mut flags = FontFlags::SERIF | FontFlags::SYMBOLIC;
        flags.set(FontFlags::ITALIC, italic);
        object
            .font_descriptor(descriptor)
            .name(name)
            .flags(flags)
            .bbox(Rect::new(-500.0, descent, 1500.0, ascent))
            .italic_angle(if italic { -12.0 } else { 0.0 })
            .ascent(ascent)
            .descent(descent)
            .cap_height(cap_height)
            .stem_v(80.0)
            .font_file3(data);
        self.put(&object)?;
        let mut object = Chunk::with_settings(COMPACT);
        let packed = deflated(&outlines);
        object.stream(data, &packed).filter(Filter::FlateDecode).pair(Name(b"Subtype"), Name(b"CIDFontType0C"));
        self.put(&object)?;
        let mut map: UnicodeCmap = UnicodeCmap::new(Name(b"Letters"), IDENTITY);
        for (glyph, text) in &texts {
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

/// A table of a font file.
fn table(font: &[u8], tag: [u8; 4]) -> Option<&[u8]> {
    let number = |at: usize| Some(u32::from_be_bytes(font.get(at..at + 4)?.try_into().ok()?) as usize);
    let tables = u16::from_be_bytes(font.get(4..6)?.try_into().ok()?) as usize;
    let record = (0..tables).map(|index| 12 + 16 * index).find(|at| font.get(*at..at + 4) == Some(&tag))?;
    let (start, length) = (number(record + 8)?, number(record + 12)?);
    font.get(start..start + length)
}

/// Hundredths of pixels are finer than what any printer shows, and take few digits.
fn rounded(value: f64) -> f32 {
    ((value * 100.0).round() / 100.0) as f32
}

impl PdfPage<'_> {
    /// A place of the map, from the corner of the page.
    fn at(&self, [x, y]: [f64; 2]) -> [f32; 2] {
        [rounded(x - self.area.x0 as f64), rounded(y - self.area.y0 as f64)]
    }

    fn path(&mut self, lines: &[Vec<[f64; 2]>]) -> bool {
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

    fn set_fill(&mut self, colour: Colour) {
        let [red, green, blue] = colour.0.map(|channel| f32::from(channel) / 255.0);
        self.content.set_fill_rgb(red, green, blue);
    }

    fn set_pen(&mut self, pen: &Pen) {
        let [red, green, blue] = pen.colour.0.map(|channel| f32::from(channel) / 255.0);
        let (key, _) = self.pdf.state(pen.opacity);
        self.content.set_parameters(Name(format!("G{key}").as_bytes()));
        self.content.set_stroke_rgb(red, green, blue).set_line_width(rounded(f64::from(pen.width)));
    }

    /// Shows the glyphs of a text, which readers take for `meant`.
    fn show(&mut self, text: &Placed, meant: &str) {
        let font = &mut self.pdf.fonts[text.face as usize];
        let mut span = self.content.begin_marked_content_with_properties(Name(b"Span"));
        span.properties().actual_text(TextStr(meant));
        span.finish();
        self.content.begin_text();
        self.content.set_font(Name(format!("F{}", text.face as usize).as_bytes()), rounded(text.size_px));
        let mut last = None;
        for glyph in &text.glyphs {
            let new = font.glyphs.remap(glyph.id);
            // Of glyphs that stand for letters together the first is all of them.
            let letters = if last.as_ref() == Some(&glyph.text) { "" } else { &text.text[glyph.text.clone()] };
            last = Some(glyph.text.clone());
            let known = font.texts.entry(new).or_default();
            if known.is_empty() {
                known.push_str(letters);
            }
            let [cos, sin] = glyph.along.map(|axis| axis as f32);
            let [x, y] = [glyph.at[0] - self.area.x0 as f64, glyph.at[1] - self.area.y0 as f64].map(rounded);
            self.content.set_text_matrix([cos, sin, sin, -cos, x, y]);
            self.content.show(Str(&new.to_be_bytes()));
        }
        self.content.end_text();
        self.content.end_marked_content();
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
        let PdfPage { pdf, number, area, scale, content, pictures, links, .. } = self;
        let point = POINTS_A_MM / scale.pixels_per_mm;
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
            let x = |at: f64| ((at - area.x0 as f64) * point) as f32;
            let y = |at: f64| ((area.y1 as f64 - at) * point) as f32;
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
        let size = [area.width(), area.height()].map(|pixels| (pixels as f64 * point) as f32);
        page.parent(PAGES).media_box(Rect::new(0.0, 0.0, size[0], size[1])).contents(stream);
        if !annotations.is_empty() {
            page.annotations(annotations);
        }
        let mut resources = page.resources();
        let mut fonts = resources.fonts();
        for (index, font) in pdf.fonts.iter().enumerate().filter(|(_, font)| !font.texts.is_empty()) {
            fonts.pair(Name(format!("F{index}").as_bytes()), font.id);
        }
        fonts.finish();
        let mut states = resources.ext_g_states();
        for (key, state) in &pdf.states {
            states.pair(Name(format!("G{key}").as_bytes()), *state);
        }
        states.finish();
        let mut images = resources.x_objects();
        for (index, picture) in pictures.iter().enumerate() {
            images.pair(Name(format!("I{index}").as_bytes()), *picture);
        }
        images.finish();
        resources.finish();
        page.finish();
        pdf.put(&object)
    }
}

impl Plotter for PdfPage<'_> {
    fn area(&self) -> Area {
        self.clip.unwrap_or(self.area)
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

    fn stroke(&mut self, lines: &[Vec<[f64; 2]>], pen: &Pen) {
        if pen.width <= 0.0 {
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
        if self.sees(bounds(text.boxes.iter().flatten())) {
            self.set_fill(colour);
            self.content.set_text_rendering_mode(TextRenderingMode::Fill);
            self.show(text, &text.text);
        }
    }

    fn surround(&mut self, text: &Placed, pen: &Pen) {
        if pen.width > 0.0 && self.sees(bounds(text.boxes.iter().flatten())) {
            self.set_pen(pen);
            self.content.set_text_rendering_mode(TextRenderingMode::Stroke);
            // It is read once, where it is written.
            self.show(text, "");
        }
    }

    fn dot(&mut self, [x, y]: [f64; 2], radius: f64, colour: Colour) {
        self.set_fill(colour);
        let at = |dx: f64, dy: f64| self.at([x + dx * radius, y + dy * radius]);
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
        let [x, y] = self.at([part.x0 as f64, part.y0 as f64]);
        self.content.save_state().rect(x, y, part.width() as f32, part.height() as f32).clip_nonzero().end_path();
        self.rows = Some(Rows { area: part, packed: ZlibEncoder::new(Vec::new(), Compression::default()) });
    }

    fn add_rows(&mut self, pixels: &[u8]) -> Result<(), Error> {
        let rows = self.rows.as_mut().expect("a picture was begun");
        let mut filtered = Vec::with_capacity(pixels.len() + pixels.len() / rows.area.width());
        for row in pixels.chunks_exact(rows.area.width() * 3) {
            // PNG's filter 1: what a pixel differs from the one before it.
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
        let name = format!("I{}", self.pictures.len());
        self.pictures.push(id);
        let [x, y] = self.at([area.x0 as f64, area.y0 as f64]);
        self.content.save_state();
        // A picture stands on its foot, and here down is up.
        self.content.transform([width as f32, 0.0, 0.0, -height as f32, x, y + height as f32]);
        self.content.x_object(Name(name.as_bytes())).restore_state();
        Ok(())
    }

    fn open(&mut self) {
        self.clip = None;
        self.content.restore_state();
    }
}
