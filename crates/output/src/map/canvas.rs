//! The raster canvas: pixels, and the lines, areas and letters drawn on them. tiny-skia draws, because its edges are
//! the same on every machine.
//!
//! tiny-skia clips lines at the edges of its pixmap, and beside such a cut, lines at most a pixel wide come out up to
//! two pixels off. So each canvas has a margin of pixels that is drawn on but never read. To get the same pixels of a
//! line in two pictures, draw the line on the same canvases.

use std::ops::Range;

use glam::{DVec2, dvec2};
use tiny_skia::{Color, FillRule, LineCap, LineJoin, Paint, Path, PathBuilder, Pixmap, Stroke, StrokeDash, Transform};

use crate::area::Area;
use crate::grid::Grid;
use crate::map::plotter::{Inscription, Pen, Plotter, Shape, bounds};
use crate::map::style::Colour;
use crate::map::text::Placed;

/// Width in pixels of the margin around a canvas that is drawn on and never read: twice as far as a line is off beside
/// an edge.
const AROUND: usize = 4;

/// A rectangle of pixels to draw on.
pub(super) struct Canvas {
    /// The pixels of the area and of its margin, [`AROUND`] wide.
    pixmap: Pixmap,
    area: Area,
    /// North-western corner of the margin, in pixels.
    corner: DVec2,
}

impl Canvas {
    /// Creates a canvas of one colour.
    pub fn new(area: Area, colour: Colour) -> Canvas {
        let mut canvas = Canvas::clear(area);
        let [red, green, blue] = colour.0;
        canvas.pixmap.data_mut().as_chunks_mut::<4>().0.fill([red, green, blue, 255]);
        canvas
    }

    /// Creates a canvas that starts with the colours of `words`: red in the lowest byte, then green and blue.
    pub fn of_words(words: &Grid<u32>) -> Canvas {
        let mut canvas = Canvas::clear(words.area());
        canvas.put_words(words.area(), words);
        canvas
    }

    /// Creates an empty canvas whose pixel centres lie at whole numbers, as vertices do.
    pub fn at_vertices(area: Area) -> Canvas {
        let canvas = Canvas::clear(area);
        Canvas { corner: canvas.corner - 0.5, ..canvas }
    }

    fn clear(area: Area) -> Canvas {
        let wide = area.padded(AROUND);
        let pixmap = Pixmap::new(wide.width() as u32, wide.height() as u32).expect("a canvas has a size");
        Canvas { pixmap, area, corner: dvec2(wide.x0 as f64, wide.y0 as f64) }
    }

    /// Returns the range in the pixmap of row `y` of a part of the canvas.
    fn span(&self, part: Area, y: i64) -> Range<usize> {
        let wide = self.area.padded(AROUND);
        let start = (y - wide.y0) as usize * wide.width() + (part.x0 - wide.x0) as usize;
        start..start + part.width()
    }

    /// Copies colours into a part of the canvas: red in the lowest byte, then green and blue.
    pub fn put_words(&mut self, part: Area, words: &Grid<u32>) {
        for y in part.y0..part.y1 {
            let span = self.span(part, y);
            let row = &mut self.pixmap.data_mut().as_chunks_mut::<4>().0[span];
            for (bytes, word) in row.iter_mut().zip(words.row(y, part.x0, part.x1)) {
                let [red, green, blue, _] = word.to_le_bytes();
                *bytes = [red, green, blue, 255];
            }
        }
    }

    /// Copies RGB pixels, row by row, into a part of the canvas.
    pub fn put(&mut self, part: Area, pixels: &[u8]) {
        for (y, row) in (part.y0..).zip(pixels.chunks_exact(part.width() * 3)) {
            let span = self.span(part, y);
            let data = &mut self.pixmap.data_mut().as_chunks_mut::<4>().0[span];
            for (bytes, pixel) in data.iter_mut().zip(row.as_chunks::<3>().0) {
                *bytes = [pixel[0], pixel[1], pixel[2], 255];
            }
        }
    }

    /// Returns the pixels of a part of the canvas: RGB, row by row.
    pub fn pixels(&self, part: Area) -> Vec<u8> {
        let mut pixels = vec![0; part.len() * 3];
        for (y, row) in (part.y0..part.y1).zip(pixels.chunks_exact_mut(part.width() * 3)) {
            let from = &self.pixmap.pixels()[self.span(part, y)];
            for (pixel, from) in row.as_chunks_mut::<3>().0.iter_mut().zip(from) {
                *pixel = [from.red(), from.green(), from.blue()];
            }
        }
        pixels
    }

    /// Returns the visible parts of a line of the given width, each with its ends out of sight: few points of a long
    /// line.
    fn seen<'a>(&self, line: &'a [DVec2], width: f32) -> Vec<&'a [DVec2]> {
        let reach = self.area.padded(AROUND + (0.5 * width).ceil() as usize + 1);
        let mut parts = Vec::new();
        let mut start = None;
        for (index, pair) in line.windows(2).enumerate() {
            match (reach.meets(bounds(pair.iter())), start) {
                (true, None) => start = Some(index),
                (false, Some(first)) => {
                    parts.push(&line[first..=index]);
                    start = None;
                }
                _ => {}
            }
        }
        parts.extend(start.map(|first| &line[first..]));
        parts
    }

    fn path<'a>(&self, lines: impl IntoIterator<Item = &'a [DVec2]>) -> Option<Path> {
        let mut path = PathBuilder::new();
        for line in lines {
            let mut points = line.iter().map(|point| (point - self.corner).as_vec2());
            let Some(first) = points.next() else { continue };
            path.move_to(first.x, first.y);
            points.for_each(|point| path.line_to(point.x, point.y));
        }
        path.finish()
    }

    fn paint(colour: Colour, opacity: f32) -> Paint<'static> {
        let [red, green, blue] = colour.0;
        let mut paint = Paint { anti_alias: true, ..Paint::default() };
        paint.set_color(Color::from_rgba8(red, green, blue, (opacity * 255.0 + 0.5) as u8));
        paint
    }

    /// Draws the halo around the letters of a text, if the pen has a width.
    fn surround(&mut self, text: &Placed, pen: &Pen) {
        if let Some(path) = self.outline(text).filter(|_| pen.width > 0.0) {
            let stroke = Stroke { width: pen.width, line_join: LineJoin::Round, ..Stroke::default() };
            let paint = Canvas::paint(pen.colour, pen.opacity);
            self.pixmap.stroke_path(&path, &paint, &stroke, Transform::identity(), None);
        }
    }

    /// Returns the outlines of a text's letters, if the text may be visible.
    fn outline(&self, text: &Placed) -> Option<Path> {
        let span = bounds(text.boxes.iter().flatten());
        let wide = self.area.padded(AROUND);
        self.sees(span).then(|| text.path([wide.x0, wide.y0])).flatten()
    }
}

impl Plotter for Canvas {
    fn area(&self) -> Area {
        self.area
    }

    fn fill(&mut self, shape: &Shape, colour: Colour) {
        if !self.sees(shape.bounds) {
            return;
        }
        if let Some(path) = self.path(shape.lines.iter().map(Vec::as_slice)) {
            let paint = Canvas::paint(colour, 1.0);
            self.pixmap.fill_path(&path, &paint, FillRule::EvenOdd, Transform::identity(), None);
        }
    }

    fn stroke(&mut self, lines: &[Vec<DVec2>], pen: &Pen) {
        if pen.width <= 0.0 {
            return;
        }
        // Keep a dashed line whole: the position of a dash depends on the length of the line in front of it.
        let path = match pen.dash {
            Some(_) => self.path(lines.iter().map(Vec::as_slice)),
            None => self.path(lines.iter().flat_map(|line| self.seen(line, pen.width))),
        };
        let Some(path) = path else { return };
        let stroke = Stroke {
            width: pen.width,
            line_cap: if pen.dash.is_some() { LineCap::Butt } else { LineCap::Round },
            line_join: LineJoin::Round,
            dash: pen.dash.and_then(|dash| StrokeDash::new(dash.to_vec(), 0.0)),
            ..Stroke::default()
        };
        let paint = Canvas::paint(pen.colour, pen.opacity);
        self.pixmap.stroke_path(&path, &paint, &stroke, Transform::identity(), None);
    }

    fn write(&mut self, text: &Placed, colour: Colour) {
        if let Some(path) = self.outline(text) {
            let paint = Canvas::paint(colour, 1.0);
            self.pixmap.fill_path(&path, &paint, FillRule::Winding, Transform::identity(), None);
        }
    }

    fn inscribe(&mut self, inscriptions: &[Inscription<'_>]) {
        for inscription in inscriptions {
            self.surround(inscription.text, &inscription.halo);
        }
        for inscription in inscriptions {
            self.write(inscription.text, inscription.colour);
        }
    }

    fn dot(&mut self, at: DVec2, radius: f64, colour: Colour) {
        let at = (at - self.corner).as_vec2();
        if let Some(path) = PathBuilder::from_circle(at.x, at.y, radius as f32) {
            let paint = Canvas::paint(colour, 1.0);
            self.pixmap.fill_path(&path, &paint, FillRule::Winding, Transform::identity(), None);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_the_same_beside_the_edge_of_a_canvas_and_in_the_middle_of_one() {
        let black = Colour([0; 3]);
        let (wide, part) = (Area::new(0, 0, 192, 192), Area::new(64, 64, 64, 64));
        // The line runs along each edge of the part, crossing it to and fro: a spiral of short pieces, as roads and
        // contours have them.
        let turn = |index: u32| {
            let [x, y] = [f64::from(index % 128), f64::from(index / 128)];
            let off = 1.3 * (f64::from(index) * 0.7).sin();
            match y as u32 {
                0 => dvec2(x + 32.0, 64.0 + off),
                1 => dvec2(128.0 + off, x + 32.0),
                2 => dvec2(160.0 - x, 128.0 + off),
                _ => dvec2(64.0 + off, 160.0 - x),
            }
        };
        let line: Vec<DVec2> = (0..512).map(turn).collect();
        for width in [0.4, 0.7, 1.0, 1.6, 4.0] {
            let pen = Pen { colour: Colour([255; 3]), opacity: 1.0, width, dash: None };
            let pixels = |area: Area| {
                let mut canvas = Canvas::new(area, black);
                canvas.stroke(std::slice::from_ref(&line), &pen);
                canvas.pixels(part)
            };
            let off = pixels(wide).iter().zip(pixels(part)).map(|(a, b)| a.abs_diff(b)).max();
            // The canvas's edge cuts the line and the cut ends are rounded: that may change 3 of the 16 samples of a
            // pixel.
            assert!(off <= Some(48), "{width} pixels wide: {off:?} of 255");
        }
    }
}
