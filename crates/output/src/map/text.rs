//! Text as outlines: shaped once, then set on a straight line or along a bent one.
//!
//! Lengths are in pixels, y points down, and text stands on its baseline.

use std::ops::Range;
use std::sync::Arc;

use glam::{DVec2, Vec2, dvec2, vec2};
use harfrust::{Buffer, Direction, Feature, ShapeOptions, ShaperFont, Tag};
use skrifa::instance::{LocationRef, Size};
use skrifa::outline::{DrawSettings, OutlinePen};
use skrifa::{GlyphId, MetadataProvider};
use tiny_skia::{Path, PathBuilder};
use unicode_bidi::{BidiInfo, ParagraphInfo, get_base_direction};

use crate::geometry::come;
use crate::map::font::{Face, Font, Typeface};

/// An oriented box: its corners in order around it.
pub type Quad = [DVec2; 4];

/// One line of text, as glyphs with their places on a baseline that begins at 0.
#[derive(Clone, Debug, PartialEq)]
pub struct Shaped {
    text: Arc<str>,
    face: Face,
    size_px: f64,
    spacing_px: f64,
    glyphs: Vec<ShapedGlyph>,
    /// Distance from the start of the first glyph to the end of the last.
    pub width: f64,
    /// Height of the tallest letters of the face above the baseline.
    pub ascent: f64,
    /// Depth of the lowest letters of the face below the baseline.
    pub descent: f64,
    /// Height of capital letters.
    pub cap_height: f64,
    /// Height of small letters such as x.
    pub x_height: f64,
    /// Bounding box of the ink of this text: left, top, right, bottom. All zero if the glyphs leave no ink.
    pub ink: [f64; 4],
}

#[derive(Clone, Debug, PartialEq)]
struct ShapedGlyph {
    id: u16,
    font: Font,
    /// Range of bytes of the text that the glyph stands for, alone or together with neighbours that have the same
    /// range.
    text: Range<usize>,
    /// Position of the pen before the glyph, and the distance by which the glyph moves it on.
    pen: f64,
    advance: f64,
    /// The glyph's origin.
    at: DVec2,
    /// Bounding box of the glyph's ink: left, top, right and bottom, from the start of the baseline.
    ink: Option<[f64; 4]>,
}

/// Shapes one line of text, each script in its own direction. `spacing_em` is the extra space between letters, as a
/// multiple of the font size.
///
/// Spaced letters form no ligatures. A character that no font has becomes the box for missing glyphs of the first font.
pub fn shape(text: &str, typeface: impl Into<Typeface>, size_px: f32, spacing_em: f32) -> Shaped {
    let typeface = typeface.into();
    let size_px = f64::from(size_px);
    let mut glyphs: Vec<ShapedGlyph> = Vec::with_capacity(text.len());
    let mut pen = 0.0;
    for TextRun { range, direction, font } in runs(text, typeface) {
        let scale = size_px / f64::from(font.metrics().units_per_em);
        let shaper = ShaperFont::new(font.shaper());
        let buffer = glyphs_of(&text[range.clone()], direction, &shaper, spacing_em > 0.0);
        let (infos, positions) = (buffer.glyph_infos(), buffer.glyph_positions());
        for (info, position) in infos.iter().zip(positions) {
            let start = range.start + info.cluster as usize;
            // A glyph of the same letter, such as an accent, gets no extra space before it.
            if glyphs.last().is_some_and(|last| last.text.start != start) {
                pen += f64::from(spacing_em) * size_px;
            }
            let starts = infos.iter().map(|other| range.start + other.cluster as usize);
            let end = starts.filter(|other| *other > start).min();
            let px = |units: i32| f64::from(units) * scale;
            let at = dvec2(pen + px(position.x_offset), -px(position.y_offset));
            let extents = shaper.glyph_extents(GlyphId::new(info.glyph_id)).filter(|extents| extents.width != 0);
            glyphs.push(ShapedGlyph {
                id: u16::try_from(info.glyph_id).expect("a font has at most 65,536 glyphs"),
                font,
                text: start..end.unwrap_or(range.end),
                pen,
                advance: px(position.x_advance),
                at,
                // The height is measured downwards as a negative number.
                ink: extents.map(|ink| {
                    let (left, top) = (at.x + px(ink.x_bearing), at.y - px(ink.y_bearing));
                    [left, top, left + px(ink.width), top - px(ink.height)]
                }),
            });
            pen += px(position.x_advance);
        }
    }
    let metrics = typeface.font().metrics();
    let px = |units: f32| f64::from(units) * size_px / f64::from(metrics.units_per_em);
    Shaped {
        text: text.into(),
        face: typeface.face,
        size_px,
        spacing_px: f64::from(spacing_em) * size_px,
        width: pen,
        ascent: px(metrics.ascent),
        descent: -px(metrics.descent),
        cap_height: px(metrics.cap_height.unwrap_or(metrics.ascent)),
        x_height: px(metrics.x_height.unwrap_or(metrics.ascent)),
        ink: ink_of(&glyphs).unwrap_or_default(),
        glyphs,
    }
}

/// A part of a text that is read in one direction and set in one font.
struct TextRun {
    range: Range<usize>,
    direction: Direction,
    font: Font,
}

/// Splits a text into runs, in the order in which they stand from left to right.
fn runs(text: &str, typeface: Typeface) -> Vec<TextRun> {
    let mut runs = Vec::new();
    for (part, direction) in directed(text) {
        let first = runs.len();
        for (at, letter) in text[part.clone()].char_indices().map(|(at, letter)| (part.start + at, letter)) {
            let end = at + letter.len_utf8();
            match runs[first..].last_mut() {
                Some(TextRun { range, font, .. }) if goes_on(*font, letter, typeface) => range.end = end,
                _ => runs.push(TextRun { range: at..end, direction, font: typeface.font_of(letter) }),
            }
        }
        if direction == Direction::RightToLeft {
            runs[first..].reverse();
        }
    }
    runs
}

/// True if a letter is set in the font of the letter before it: if that font is its own, or if the character is no
/// letter or digit, such as an accent or a space, and that font has it.
fn goes_on(font: Font, letter: char, typeface: Typeface) -> bool {
    let is_letter = letter.is_alphanumeric();
    typeface.font_of(letter) == font || !is_letter && font.glyph_of(letter).is_some()
}

/// Splits a text into parts of one reading direction, in the order in which they stand from left to right (the
/// bidirectional algorithm of Unicode).
fn directed(text: &str) -> Vec<(Range<usize>, Direction)> {
    let order = BidiInfo::new(text, None);
    if !order.has_rtl() {
        return vec![(0..text.len(), Direction::LeftToRight)];
    }
    let of_paragraph = |paragraph: &ParagraphInfo| {
        let (levels, runs) = order.visual_runs(paragraph, paragraph.range.clone());
        let direct = |run: Range<usize>| {
            let is_rtl = levels[run.start].is_rtl();
            (run, if is_rtl { Direction::RightToLeft } else { Direction::LeftToRight })
        };
        runs.into_iter().map(direct).collect::<Vec<_>>()
    };
    order.paragraphs.iter().flat_map(of_paragraph).collect()
}

/// True if a text as a whole is read from right to left, judged by its first letter.
pub fn is_right_to_left(text: &str) -> bool {
    matches!(get_base_direction(text), unicode_bidi::Direction::Rtl)
}

/// Returns the glyphs of a text from left to right, in units of the font. If the letters stand `apart`, they form no
/// ligatures.
fn glyphs_of(text: &str, direction: Direction, font: &ShaperFont, apart: bool) -> Buffer {
    let mut buffer = Buffer::new();
    buffer.push_str(text);
    buffer.set_direction(direction);
    buffer.guess_segment_properties();
    let without_ligatures = [b"liga", b"clig"].map(|tag| Feature::new(Tag::new(tag), 0, ..));
    let features = if apart { without_ligatures.as_slice() } else { &[] };
    harfrust::shape(font, &mut buffer, ShapeOptions::new().features(features))
        .expect("a buffer of text with a direction can be shaped");
    buffer
}

/// Returns the bounding box of the ink of some glyphs; none without ink.
fn ink_of(glyphs: &[ShapedGlyph]) -> Option<[f64; 4]> {
    let join = |a: [f64; 4], b: [f64; 4]| [a[0].min(b[0]), a[1].min(b[1]), a[2].max(b[2]), a[3].max(b[3])];
    glyphs.iter().filter_map(|glyph| glyph.ink).reduce(join)
}

/// Text with its place on the map.
#[derive(Clone, Debug, PartialEq)]
pub struct Placed {
    /// The text as a string.
    pub text: Arc<str>,
    /// The face that was asked for.
    pub face: Face,
    /// The size of the font.
    pub size_px: f64,
    /// Extra space between letters, in addition to that of the font.
    pub spacing_px: f64,
    /// The glyphs in visual order, from left to right.
    pub glyphs: Vec<PlacedGlyph>,
    /// Boxes that the ink covers: one for straight text, one for each letter of bent text, none where there is no ink.
    pub boxes: Vec<Quad>,
}

/// A glyph with its place on the map.
#[derive(Clone, Debug, PartialEq)]
pub struct PlacedGlyph {
    /// Number of the glyph in its font.
    pub id: u16,
    /// Font of the text's face, or another font where the face lacks the letter.
    pub font: Font,
    /// Range of bytes of the text that the glyph stands for, alone or together with neighbours that have the same
    /// range.
    pub text: Range<usize>,
    /// Origin of the glyph, on the baseline.
    pub at: DVec2,
    /// Reading direction as a vector of length 1: the cosine and the sine of its angle, clockwise from east.
    pub along: DVec2,
}

impl PlacedGlyph {
    /// Returns the angle by which the glyph is turned, clockwise from east, in radians.
    pub fn angle(&self) -> f64 {
        libm::atan2(self.along.y, self.along.x)
    }
}

/// Cosine of the largest turn from one letter to the next: 25 degrees. Beyond it, letters of usual spacing run into
/// each other.
const TURN_COS: f64 = 0.906_307_787;

/// Cosine of the largest angle between a letter and the direction of the whole text: 60 degrees. Beyond it, a name is
/// read around a corner.
const SPREAD_COS: f64 = 0.5;

impl Shaped {
    /// Sets the text on a straight baseline from `start` on, turned clockwise by an angle in radians.
    pub fn at(&self, start: DVec2, angle: f64) -> Placed {
        let mut placed = self.nowhere();
        placed.push(&self.glyphs, 0.0, start, dvec2(libm::cos(angle), libm::sin(angle)));
        placed
    }

    /// Sets the text along a line, from the distance `start` along the line on, and shifted by `lift` to the left of
    /// the line's direction: above the line, where it leads to the east. Each letter stands with its middle on the line
    /// and turns with the line.
    ///
    /// Returns `None` where the text would begin before the line or end after it, or where the line bends too much for
    /// the text. Otherwise the text is set, upside down if the line leads to the west.
    pub fn along(&self, line: &[DVec2], start: f64, lift: f64) -> Option<Placed> {
        let measured = MeasuredLine::new(line)?;
        if start < 0.0 || start + self.width > measured.length() {
            return None;
        }
        let mut placed = self.nowhere();
        for letter in self.glyphs.chunk_by(|a, b| a.text == b.text) {
            let pen = letter[0].pen;
            let half = 0.5 * letter.iter().map(|glyph| glyph.advance).sum::<f64>();
            let middle = start + pen + half;
            // Measure the direction over at least half the font size; otherwise narrow letters would turn with every
            // little bend.
            let along = measured.way(middle, half.max(0.25 * self.size_px))?;
            placed.push(letter, pen, measured.place(middle) - along * half - along.perp() * lift, along);
        }
        placed.bends_little().then_some(placed)
    }

    fn nowhere(&self) -> Placed {
        Placed {
            text: Arc::clone(&self.text),
            face: self.face,
            size_px: self.size_px,
            spacing_px: self.spacing_px,
            glyphs: Vec::new(),
            boxes: Vec::new(),
        }
    }
}

impl Placed {
    /// Adds glyphs on a straight baseline in the direction `along`. `start` is the point of the map where the pen was
    /// at `pen`.
    fn push(&mut self, glyphs: &[ShapedGlyph], pen: f64, start: DVec2, along: DVec2) {
        let turn = |at: DVec2| start + (at - dvec2(pen, 0.0)).rotate(along);
        let placed = |&ShapedGlyph { id, font, ref text, at, .. }: &ShapedGlyph| PlacedGlyph {
            id,
            font,
            text: text.clone(),
            at: turn(at),
            along,
        };
        self.glyphs.extend(glyphs.iter().map(placed));
        if let Some([left, top, right, bottom]) = ink_of(glyphs) {
            let corners = [[left, top], [right, top], [right, bottom], [left, bottom]];
            self.boxes.push(corners.map(|corner| turn(corner.into())));
        }
    }

    /// Returns the letters that no font has. Each is drawn as a box.
    pub fn missing(&self) -> impl Iterator<Item = char> {
        let boxes = self.glyphs.iter().filter(|glyph| glyph.id == 0);
        boxes.flat_map(|glyph| self.text[glyph.text.clone()].chars())
    }

    /// True if letters have other shapes than when they stand alone, as in scripts that join them. Only all rules of
    /// the font can set such a text.
    pub fn is_joined(&self) -> bool {
        /// Start of the Hebrew letters. In the scripts before it letters stand alone, and only ligatures differ.
        const FIRST: char = '\u{590}';
        let is_joined = |glyphs: &[PlacedGlyph]| {
            let mut letters = self.text[glyphs[0].text.clone()].chars();
            let alone = letters.next().and_then(|letter| glyphs[0].font.glyph_of(letter));
            let is_one = letters.next().is_none() && glyphs.len() == 1;
            glyphs[0].id != 0 && !(is_one && alone == Some(glyphs[0].id))
        };
        let of_letter = self.glyphs.chunk_by(|one, next| one.text == next.text);
        of_letter
            .filter(|glyphs| self.text[glyphs[0].text.clone()].chars().any(|letter| letter >= FIRST))
            .any(is_joined)
    }

    /// True if no letter is turned far from the one before it or from the direction of the whole text.
    fn bends_little(&self) -> bool {
        let [Some(first), Some(last)] = [self.glyphs.first(), self.glyphs.last()] else { return true };
        let whole = last.at - first.at;
        let spread = SPREAD_COS * whole.length();
        self.glyphs.iter().all(|glyph| glyph.along.dot(whole) >= spread)
            && self.glyphs.windows(2).all(|pair| pair[0].along.dot(pair[1].along) >= TURN_COS)
    }

    /// Returns the outlines of all glyphs relative to an origin, to be filled by the non-zero rule. `None` if there is
    /// no ink.
    ///
    /// Points are rounded to 1/256 of a pixel, the finest step of the rasteriser, so that within 65,536 pixels of the
    /// origin the same glyphs have the same shapes from every origin. All curves are quadratic: tiny-skia strokes cubic
    /// curves with the cosine of the machine's library, which may differ between machines.
    pub fn path(&self, origin: [i64; 2]) -> Option<Path> {
        let mut builder = PathBuilder::new();
        for PlacedGlyph { id, font, at, along, .. } in &self.glyphs {
            let mut pen = GlyphPen {
                builder: &mut builder,
                scale: self.size_px / f64::from(font.metrics().units_per_em),
                at: *at,
                along: *along,
                origin: origin.map(|axis| axis as f64).into(),
                last: DVec2::ZERO,
            };
            let settings = DrawSettings::unhinted(Size::unscaled(), LocationRef::default());
            // A user's font may lack an outline that its tables promise; nothing is drawn for that glyph.
            if let Some(outline) = font.outlines().outline_glyphs().get(GlyphId::new(u32::from(*id))) {
                let _ = outline.draw(settings, &mut pen);
            }
        }
        builder.finish()
    }
}

/// Number of subpixel steps of the rasteriser in a pixel.
const STEPS: f64 = 256.0;

/// Largest distance in pixels between a quadratic curve and the font's cubic curve, too small for the eye to see.
const CURVE_ERROR_PX: f64 = 0.02;

/// Moves an outline from units of the font, in which y points up, to its place on the map.
struct GlyphPen<'a> {
    builder: &'a mut PathBuilder,
    scale: f64,
    at: DVec2,
    along: DVec2,
    origin: DVec2,
    /// Position of the pen, in units of the font.
    last: DVec2,
}

impl GlyphPen<'_> {
    /// Returns the point on the map, relative to the origin, for a point in units of the font.
    fn map(&self, at: DVec2) -> Vec2 {
        let at = self.at + (dvec2(at.x, -at.y) * self.scale).rotate(self.along);
        // Round before subtracting the origin; otherwise each origin would have its own rounding.
        ((at * STEPS).round() / STEPS - self.origin).as_vec2()
    }

    /// Moves the pen to a point in units of the font. Returns the point on the map.
    fn go(&mut self, x: f32, y: f32) -> Vec2 {
        self.last = dvec2(x.into(), y.into());
        self.map(self.last)
    }

    fn quadratic(&mut self, control: DVec2, end: DVec2) {
        let (control, to) = (self.map(control), self.map(end));
        self.builder.quad_to(control.x, control.y, to.x, to.y);
        self.last = end;
    }
}

impl OutlinePen for GlyphPen<'_> {
    fn move_to(&mut self, x: f32, y: f32) {
        let to = self.go(x, y);
        self.builder.move_to(to.x, to.y);
    }

    fn line_to(&mut self, x: f32, y: f32) {
        let to = self.go(x, y);
        self.builder.line_to(to.x, to.y);
    }

    fn quad_to(&mut self, control_x: f32, control_y: f32, x: f32, y: f32) {
        self.quadratic(vec2(control_x, control_y).into(), vec2(x, y).into());
    }

    fn curve_to(&mut self, ax: f32, ay: f32, bx: f32, by: f32, x: f32, y: f32) {
        let cubic = [self.last, vec2(ax, ay).into(), vec2(bx, by).into(), vec2(x, y).into()];
        for [control, end] in quadratics(cubic, CURVE_ERROR_PX / self.scale) {
            self.quadratic(control, end);
        }
    }

    fn close(&mut self) {
        self.builder.close();
    }
}

/// Returns the control points and ends of quadratic curves that follow a cubic curve to within `error`.
///
/// Based on: a quadratic curve whose control point is (3 (a + b) - start - end) / 4 is at most √3 / 36 of the cubic's
/// third difference away. Each of n equal parts has a third difference n³ times smaller.
fn quadratics(cubic: [DVec2; 4], error: f64) -> impl Iterator<Item = [DVec2; 2]> {
    const SHARE: f64 = 0.048_112_522;
    let [start, a, b, end] = cubic;
    let least = SHARE * (end - 3.0 * b + 3.0 * a - start).length() / error;
    let parts = (1..16).find(|parts| f64::from(parts * parts * parts) >= least).unwrap_or(16);
    let step = 1.0 / f64::from(parts);
    // Point and derivative of the cubic curve at parameter `t`.
    let place = move |t: f64| {
        let s = 1.0 - t;
        s * s * s * start + 3.0 * s * s * t * a + 3.0 * s * t * t * b + t * t * t * end
    };
    let way = move |t: f64| {
        let s = 1.0 - t;
        3.0 * (s * s * (a - start) + 2.0 * s * t * (b - a) + t * t * (end - b))
    };
    (0..parts).map(move |part| {
        let (from, to) = (f64::from(part) * step, f64::from(part + 1) * step);
        let (first, last) = (place(from), if part + 1 == parts { end } else { place(to) });
        [first.midpoint(last) + 0.25 * step * (way(from) - way(to)), last]
    })
}

/// A polyline with the distance along it to each of its points.
pub(super) struct MeasuredLine<'a> {
    line: &'a [DVec2],
    come: Vec<f64>,
}

/// Returns the length of a polyline.
pub(super) fn length(line: &[DVec2]) -> f64 {
    line.windows(2).map(|pair| pair[0].distance(pair[1])).sum()
}

impl MeasuredLine<'_> {
    /// Returns `None` for a line of fewer than two points or of no length.
    pub fn new(line: &[DVec2]) -> Option<MeasuredLine<'_>> {
        let come = come(line.windows(2).map(|pair| pair[0].distance(pair[1])));
        (line.len() > 1 && come[line.len() - 1] > 0.0).then_some(MeasuredLine { line, come })
    }

    /// The length of the line.
    pub fn length(&self) -> f64 {
        self.come[self.come.len() - 1]
    }

    /// Returns the point at a distance along the line. Before its start and after its end, the first and the last
    /// segment are extended.
    pub fn place(&self, distance: f64) -> DVec2 {
        let after = self.come.partition_point(|come| *come <= distance).clamp(1, self.line.len() - 1);
        let (from, to) = (self.line[after - 1], self.line[after]);
        let step = self.come[after] - self.come[after - 1];
        let share = if step > 0.0 { (distance - self.come[after - 1]) / step } else { 0.0 };
        from + (to - from) * share
    }

    /// The corners of the line that lie between two distances along it.
    pub fn between(&self, from: f64, to: f64) -> &[DVec2] {
        let first = self.come.partition_point(|come| *come <= from);
        &self.line[first..self.come.partition_point(|come| *come < to).max(first)]
    }

    /// Returns the direction of the line at a distance along it, as a vector of length 1 from `half` before to `half`
    /// after it. `None` where these two points coincide.
    fn way(&self, distance: f64, half: f64) -> Option<DVec2> {
        let way = self.place(distance + half) - self.place(distance - half);
        let length = way.length();
        (length > 0.0).then(|| way / length)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map::font::Face;

    #[test]
    fn all_letters_and_digits_have_outlines_within_their_boxes() {
        let characters = ('a'..='z').chain('A'..='Z').chain('0'..='9').chain("äöüßéèøåñç'-.".chars());
        for character in characters {
            for face in Face::ALL {
                let placed = shape(&character.to_string(), face, 20.0, 0.0).at(dvec2(3.0, 30.0), 0.0);
                assert!(placed.glyphs.iter().all(|glyph| glyph.id != 0), "{face:?} lacks {character}");
                let bounds = placed.path([0, 0]).expect("a letter leaves ink").bounds();
                let [[left, top], _, [right, bottom], _] = placed.boxes[0].map(|corner| corner.as_vec2().to_array());
                let ends = [left - bounds.left(), top - bounds.top(), bounds.right() - right, bounds.bottom() - bottom];
                // The tolerance covers rounding to subpixels, extents in whole units of the font, and control points
                // outside their curves.
                assert!(ends.iter().all(|end| *end < 0.25), "{face:?} {character}: {ends:?}");
            }
        }
    }

    #[test]
    fn bold_text_is_wider() {
        assert!(shape("Weight", Face::Bold, 20.0, 0.0).width > shape("Weight", Face::Regular, 20.0, 0.0).width);
    }

    #[test]
    fn a_name_is_as_wide_as_its_glyphs_and_wider_if_spaced() {
        let plain = shape("Sarnbruck", Face::Regular, 40.0, 0.0);
        let sum: f64 = plain.glyphs.iter().map(|glyph| glyph.advance).sum();
        assert!((plain.width - sum).abs() < 1e-9);
        let spaced = shape("Sarnbruck", Face::Regular, 40.0, 0.25);
        assert!((spaced.width - (sum + 8.0 * 10.0)).abs() < 1e-9, "room between nine letters, none after the last");
        let small = shape("Sarnbruck", Face::Regular, 20.0, 0.0);
        assert!((small.width * 2.0 - plain.width).abs() < 1e-9);
        assert!(plain.x_height < plain.cap_height && plain.cap_height < plain.ascent && plain.descent > 0.0);
    }

    #[test]
    fn spaced_letters_form_no_ligatures_and_keep_their_accents() {
        assert!(shape("Tiefffluss", Face::Regular, 40.0, 0.0).glyphs.len() < 10);
        assert_eq!(shape("Tiefffluss", Face::Regular, 40.0, 0.1).glyphs.len(), 10);
        // No font has a single glyph for a letter with a tilde and a ring.
        let accented = shape("m\u{303}\u{325}n", Face::Regular, 40.0, 0.1);
        let widths: f64 = accented.glyphs.iter().map(|glyph| glyph.advance).sum();
        assert!((accented.width - widths - 4.0).abs() < 1e-6, "room before an accent");
        assert_eq!(accented.glyphs[0].text, 0..5);
    }

    #[test]
    fn hebrew_stands_from_right_to_left_between_what_does_not() {
        let text = "Alp \u{5e2}\u{5d1}\u{5e8} 12";
        let placed = shape(text, Face::Regular, 20.0, 0.0).at(DVec2::ZERO, 0.0);
        let read: String = placed.glyphs.iter().map(|glyph| &text[glyph.text.clone()]).collect();
        // Numbers after Hebrew stand to its left, but their digits are read from left to right.
        assert_eq!(read, "Alp 12 \u{5e8}\u{5d1}\u{5e2}");
        assert!(placed.glyphs.windows(2).all(|pair| pair[0].at.x < pair[1].at.x));
        assert_eq!(placed.missing().count(), 0);
        assert!(is_right_to_left("\u{5e2}!") && !is_right_to_left(text) && !is_right_to_left("12"));
    }

    #[test]
    fn a_font_of_a_style_is_used_where_it_has_the_letters() {
        let own = Font::of_file();
        let typeface = Typeface { face: Face::Italic, own: Some(own) };
        // The face has no Arabic, and neither font has Chinese.
        let text = "Alp \u{644}\u{628} \u{65e5}";
        let placed = shape(text, typeface, 20.0, 0.0).at(DVec2::ZERO, 0.0);
        let fonts: Vec<(&str, Font)> =
            placed.glyphs.iter().map(|glyph| (&text[glyph.text.clone()], glyph.font)).collect();
        assert!(fonts[..4].iter().all(|(_, font)| *font == own), "{fonts:?}");
        assert_eq!(placed.missing().collect::<String>(), "\u{65e5}");
        assert!(placed.is_joined(), "the letters of Arabic join");
        let arabic: Vec<&str> = fonts.iter().map(|(text, _)| *text).filter(|text| *text >= "\u{600}").collect();
        assert_eq!(arabic[..2], ["\u{628}", "\u{644}"]);
        assert!(placed.path([0, 0]).is_some());
        let plain = shape("Tiefffluss \u{5e2}\u{5d1}", typeface, 20.0, 0.0).at(DVec2::ZERO, 0.0);
        assert!(!plain.is_joined());
        // A letter that the file lacks comes from the face.
        let rare = shape("A\u{1f7}", typeface, 20.0, 0.0).at(DVec2::ZERO, 0.0);
        assert_eq!(rare.glyphs.iter().map(|glyph| glyph.font).collect::<Vec<_>>(), [own, Face::Italic.font()]);
    }

    #[test]
    fn letters_that_a_font_lacks_are_told() {
        let placed = shape("Alp \u{65e5}\u{672c} \u{628}", Face::Italic, 20.0, 0.0).at(DVec2::ZERO, 0.0);
        assert_eq!(placed.missing().collect::<String>(), "\u{65e5}\u{672c}\u{628}");
    }

    #[test]
    fn along_a_straight_line_text_is_straight() {
        let shaped = shape("Große Ache", Face::Italic, 30.0, 0.1);
        let angle = 0.4;
        let (origin, along) = (dvec2(50.0, 70.0), dvec2(libm::cos(angle), libm::sin(angle)));
        let line = [0.0, 90.0, 91.0, 400.0].map(|far| origin + along * far);
        let start = origin + along * 20.0 - along.perp() * 5.0;
        let (straight, bent) = (shaped.at(start, angle), shaped.along(&line, 20.0, 5.0).expect("the line is long"));
        assert_eq!(straight.glyphs.len(), bent.glyphs.len());
        for (one, other) in straight.glyphs.iter().zip(&bent.glyphs) {
            assert_eq!((one.id, &one.text), (other.id, &other.text));
            assert!(one.at.distance(other.at) < 1e-9);
            assert!((one.angle() - angle).abs() < 1e-12 && (other.angle() - angle).abs() < 1e-12);
        }
    }

    #[test]
    fn text_follows_a_bow_but_no_corner() {
        let shaped = shape("Steinbach", Face::Italic, 20.0, 0.0);
        let bow: Vec<DVec2> =
            (0..60).map(|step| f64::from(step) * 0.05).map(|t| -150.0 * dvec2(libm::cos(t), libm::sin(t))).collect();
        let placed = shaped.along(&bow, 200.0 - 0.5 * shaped.width, 0.0).expect("the bow is wide");
        assert!(placed.glyphs.windows(2).all(|pair| pair[0].angle() < pair[1].angle()));
        assert_eq!(placed.boxes.len(), 9);
        let corner = [DVec2::ZERO, dvec2(60.0, 0.0), dvec2(60.0, 60.0)];
        assert_eq!(shaped.along(&corner, 10.0, 0.0), None);
        let back = [DVec2::ZERO, dvec2(60.0, 0.0), DVec2::ZERO];
        assert_eq!(shaped.along(&back, 10.0, 0.0), None);
    }

    #[test]
    fn text_that_does_not_fit_on_its_line_is_not_set() {
        let shaped = shape("Steinbach", Face::Regular, 20.0, 0.0);
        let line = [DVec2::ZERO, dvec2(shaped.width + 10.0, 0.0)];
        assert!(shaped.along(&line, 10.0, 0.0).is_some());
        assert_eq!(shaped.along(&line, 10.5, 0.0), None);
        assert_eq!(shaped.along(&line, -0.5, 0.0), None);
        assert_eq!(shaped.along(&line[..1], 0.0, 0.0), None);
        assert_eq!(shaped.along(&[DVec2::ONE; 2], 0.0, 0.0), None);
    }

    #[test]
    fn text_without_ink_has_neither_boxes_nor_a_path() {
        for text in ["", " "] {
            let placed = shape(text, Face::Regular, 20.0, 0.0).at(DVec2::ZERO, 0.0);
            assert_eq!((placed.boxes.len(), placed.path([0, 0])), (0, None));
        }
    }

    #[test]
    fn a_path_has_the_same_shape_from_every_origin() {
        let at = dvec2(40_000.3, 50_000.7);
        let placed = shape("Sarnbruck", Face::Bold, 33.0, 0.0).at(at, 0.3);
        let (far, near) = (placed.path([0, 0]).unwrap(), placed.path([39_990, 49_980]).unwrap());
        for (far, near) in far.points().iter().zip(near.points()) {
            assert_eq!([far.x - 39_990.0, far.y - 49_980.0], [near.x, near.y]);
        }
    }

    #[test]
    fn quadratic_curves_follow_a_cubic_one() {
        // An S, whose middle a single quadratic curve would miss.
        let cubic = [[0.0, 0.0], [100.0, 0.0], [0.0, 80.0], [100.0, 80.0]].map(DVec2::from);
        let point = |t: f64| {
            let s = 1.0 - t;
            let weights = [s * s * s, 3.0 * s * s * t, 3.0 * s * t * t, t * t * t];
            (0..4).map(|i| weights[i] * cubic[i]).sum::<DVec2>()
        };
        let mut from = cubic[0];
        for [control, to] in quadratics(cubic, 0.02) {
            for t in [0.25, 0.5, 0.75] {
                let s = 1.0 - t;
                let at = s * s * from + 2.0 * s * t * control + t * t * to;
                let away = (0..=10_000).map(|step| point(f64::from(step) / 10_000.0));
                let nearest = away.map(|on| on.distance(at)).fold(f64::MAX, f64::min);
                assert!(nearest < 0.03, "{nearest}");
            }
            from = to;
        }
        assert_eq!(from, cubic[3]);
    }
}
