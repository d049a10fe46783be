//! What lines, areas and letters are drawn on: pixels, or pages of vectors.

use crate::area::Area;
use crate::error::Error;
use crate::map::style::Colour;
use crate::map::text::Placed;

/// Pixels that a line may be wide at most, half on each side: what lies so far from an area may reach into it.
pub(crate) const WIDEST: f64 = 64.0;

/// Lines, or the rings of an area, in pixels, and what they span: west, north, east and south.
#[derive(Clone, Debug)]
pub(crate) struct Shape {
    pub bounds: [f64; 4],
    pub lines: Vec<Vec<[f64; 2]>>,
}

impl Shape {
    /// Lines, or the rings of an area.
    pub fn new(lines: Vec<Vec<[f64; 2]>>) -> Shape {
        Shape { bounds: bounds(lines.iter().flatten()), lines }
    }

    /// The ring of a rectangle: west, north, east and south.
    pub fn rectangle([west, north, east, south]: [f64; 4]) -> Shape {
        Shape::new(vec![vec![[west, north], [east, north], [east, south], [west, south], [west, north]]])
    }
}

/// What points span: west, north, east and south.
pub(crate) fn bounds<'a>(points: impl Iterator<Item = &'a [f64; 2]>) -> [f64; 4] {
    let none = [f64::MAX, f64::MAX, f64::MIN, f64::MIN];
    points.fold(none, |[w, n, e, s], [x, y]| [w.min(*x), n.min(*y), e.max(*x), s.max(*y)])
}

/// How a line is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pen {
    pub colour: Colour,
    pub opacity: f32,
    /// In pixels, as all lengths here.
    pub width: f32,
    /// A stroke and a gap.
    pub dash: Option<[f32; 2]>,
}

/// Draws at places in pixels of a map, one thing over the other.
pub(crate) trait Plotter {
    /// The pixels that are drawn on.
    fn area(&self) -> Area;

    /// Fills an area by the even-odd rule.
    fn fill(&mut self, shape: &Shape, colour: Colour);

    /// Draws lines, if the pen has a width.
    fn stroke(&mut self, lines: &[Vec<[f64; 2]>], pen: &Pen);

    /// Writes a text.
    fn write(&mut self, text: &Placed, colour: Colour);

    /// Draws what is around the letters of a text, if the pen has a width.
    fn surround(&mut self, text: &Placed, pen: &Pen);

    /// Draws a disc.
    fn dot(&mut self, at: [f64; 2], radius: f64, colour: Colour);

    /// Whether something that spans so much, west, north, east and south, may be seen.
    fn sees(&self, span: [f64; 4]) -> bool {
        self.area().padded(WIDEST as usize).meets(span)
    }

    /// Draws the lines of a shape, if they may be seen.
    fn stroke_shape(&mut self, shape: &Shape, pen: &Pen) {
        if self.sees(shape.bounds) {
            self.stroke(&shape.lines, pen);
        }
    }
}

/// A page of vectors, on which there are pictures too.
pub(crate) trait Page: Plotter {
    /// From here on nothing is seen outside a part of the page, until [`open`](Page::open); and a picture of that part begins.
    fn clip(&mut self, part: Area);

    /// The next rows of the picture, from the north: RGB.
    ///
    /// # Errors
    /// When the page cannot be written.
    fn add_rows(&mut self, pixels: &[u8]) -> Result<(), Error>;

    /// Ends the picture, over which all else is drawn.
    ///
    /// # Errors
    /// When the page cannot be written.
    fn end_picture(&mut self) -> Result<(), Error>;

    /// Ends what [`clip`](Page::clip) began.
    fn open(&mut self);
}
