//! What is drawn on: pixels, and lines, areas and letters on them. Lines by tiny-skia, whose edges are the same on every machine.

use tiny_skia::{Color, FillRule, LineCap, LineJoin, Paint, Path, PathBuilder, Pixmap, Stroke, StrokeDash, Transform};

use crate::area::Area;
use crate::grid::Grid;
use crate::map::plotter::{Pen, Plotter, Shape, bounds};
use crate::map::style::Colour;
use crate::map::text::Placed;

/// A rectangle of pixels that is drawn on.
pub(super) struct Canvas {
    pixmap: Pixmap,
    area: Area,
    /// Where its north-western pixel begins.
    corner: [f64; 2],
}

impl Canvas {
    /// A canvas of one colour.
    pub fn new(area: Area, colour: Colour) -> Canvas {
        let mut canvas = Canvas::clear(area);
        let [red, green, blue] = colour.0;
        canvas.pixmap.data_mut().as_chunks_mut::<4>().0.fill([red, green, blue, 255]);
        canvas
    }

    /// A canvas on which there are colours already: red in the lowest byte, then green and blue.
    pub fn of_words(words: &Grid<u32>) -> Canvas {
        let mut canvas = Canvas::clear(words.area());
        canvas.put_words(words.area(), words);
        canvas
    }

    /// A canvas without colours whose pixels have their middles at whole numbers, as vertices are.
    pub fn at_vertices(area: Area) -> Canvas {
        let canvas = Canvas::clear(area);
        Canvas { corner: canvas.corner.map(|axis| axis - 0.5), ..canvas }
    }

    fn clear(area: Area) -> Canvas {
        let pixmap = Pixmap::new(area.width() as u32, area.height() as u32).expect("a canvas has a size");
        Canvas { pixmap, area, corner: [area.x0 as f64, area.y0 as f64] }
    }

    /// Puts colours into a part of the canvas: red in the lowest byte, then green and blue.
    pub fn put_words(&mut self, part: Area, words: &Grid<u32>) {
        let width = self.area.width();
        let data = self.pixmap.data_mut().as_chunks_mut::<4>().0;
        for y in part.y0..part.y1 {
            let start = (y - self.area.y0) as usize * width + (part.x0 - self.area.x0) as usize;
            for (bytes, word) in data[start..].iter_mut().zip(words.row(y, part.x0, part.x1)) {
                let [red, green, blue, _] = word.to_le_bytes();
                *bytes = [red, green, blue, 255];
            }
        }
    }

    /// Puts pixels, RGB and row by row, into a part of the canvas.
    pub fn put(&mut self, part: Area, pixels: &[u8]) {
        let width = self.area.width();
        let data = self.pixmap.data_mut().as_chunks_mut::<4>().0;
        for (y, row) in (part.y0..).zip(pixels.chunks_exact(part.width() * 3)) {
            let start = (y - self.area.y0) as usize * width + (part.x0 - self.area.x0) as usize;
            for (bytes, pixel) in data[start..].iter_mut().zip(row.as_chunks::<3>().0) {
                *bytes = [pixel[0], pixel[1], pixel[2], 255];
            }
        }
    }

    /// The pixels of a part of the canvas: RGB, row by row.
    pub fn pixels(&self, part: Area) -> Vec<u8> {
        let mut pixels = vec![0; part.len() * 3];
        for (y, row) in (part.y0..part.y1).zip(pixels.chunks_exact_mut(part.width() * 3)) {
            let start = (y - self.area.y0) as usize * self.area.width() + (part.x0 - self.area.x0) as usize;
            let from = &self.pixmap.pixels()[start..start + part.width()];
            for (pixel, from) in row.as_chunks_mut::<3>().0.iter_mut().zip(from) {
                *pixel = [from.red(), from.green(), from.blue()];
            }
        }
        pixels
    }

    fn path(&self, lines: &[Vec<[f64; 2]>]) -> Option<Path> {
        let mut path = PathBuilder::new();
        for line in lines {
            let mut points = line.iter().map(|point| [0, 1].map(|axis| (point[axis] - self.corner[axis]) as f32));
            let Some([x, y]) = points.next() else { continue };
            path.move_to(x, y);
            points.for_each(|[x, y]| path.line_to(x, y));
        }
        path.finish()
    }

    fn paint(colour: Colour, opacity: f32) -> Paint<'static> {
        let [red, green, blue] = colour.0;
        let mut paint = Paint { anti_alias: true, ..Paint::default() };
        paint.set_color(Color::from_rgba8(red, green, blue, (opacity * 255.0 + 0.5) as u8));
        paint
    }

    /// The outlines of a text's letters, if it may be seen.
    fn outline(&self, text: &Placed) -> Option<Path> {
        let span = bounds(text.boxes.iter().flatten());
        self.sees(span).then(|| text.path([self.area.x0, self.area.y0])).flatten()
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
        if let Some(path) = self.path(&shape.lines) {
            let paint = Canvas::paint(colour, 1.0);
            self.pixmap.fill_path(&path, &paint, FillRule::EvenOdd, Transform::identity(), None);
        }
    }

    fn stroke(&mut self, lines: &[Vec<[f64; 2]>], pen: &Pen) {
        if pen.width <= 0.0 {
            return;
        }
        let Some(path) = self.path(lines) else { return };
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

    fn surround(&mut self, text: &Placed, pen: &Pen) {
        if let Some(path) = self.outline(text).filter(|_| pen.width > 0.0) {
            let stroke = Stroke { width: pen.width, line_join: LineJoin::Round, ..Stroke::default() };
            let paint = Canvas::paint(pen.colour, pen.opacity);
            self.pixmap.stroke_path(&path, &paint, &stroke, Transform::identity(), None);
        }
    }

    fn dot(&mut self, at: [f64; 2], radius: f64, colour: Colour) {
        let [x, y] = [0, 1].map(|axis| (at[axis] - self.corner[axis]) as f32);
        if let Some(path) = PathBuilder::from_circle(x, y, radius as f32) {
            let paint = Canvas::paint(colour, 1.0);
            self.pixmap.fill_path(&path, &paint, FillRule::Winding, Transform::identity(), None);
        }
    }
}
