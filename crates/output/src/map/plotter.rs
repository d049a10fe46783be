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

/// A part of a page that whoever edits it can hide or change as a whole, from the lowest to the highest.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Layer {
    /// What lies under the map and around it.
    Paper,
    /// The ground as a picture.
    Relief,
    /// Strokes on rock and slopes, and stones.
    Signs,
    /// Contours with their heights, and lines of equal depth.
    Contours,
    /// What is built in settlements.
    Houses,
    /// Lakes, rivers and coasts.
    Waters,
    /// Roads, bridges and tunnels.
    Roads,
    /// Symbols of settlements and peaks.
    Places,
    /// What is written on the map.
    Names,
    /// What stands around the map, and the lines of grids over it.
    Furniture,
}

impl Layer {
    /// What editors show.
    pub const fn name(self) -> &'static str {
        match self {
            Layer::Paper => "paper",
            Layer::Relief => "relief",
            Layer::Signs => "signs",
            Layer::Contours => "contours",
            Layer::Houses => "houses",
            Layer::Waters => "waters",
            Layer::Roads => "roads",
            Layer::Places => "places",
            Layer::Names => "names",
            Layer::Furniture => "furniture",
        }
    }
}

/// One thing of a layer, such as a river, however many strokes it takes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Item<'a> {
    /// What it is, in a word.
    pub kind: &'static str,
    /// Tells it from others of its kind. Empty if there are none.
    pub id: &'a str,
    /// What it is called. Empty if it has no name.
    pub name: &'a str,
}

impl Item<'_> {
    /// The only one of its kind.
    pub fn only(kind: &'static str) -> Item<'static> {
        Item { kind, id: "", name: "" }
    }
}

/// How letters are written on pages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lettering {
    /// As text, with the letters of its fonts in the file: it can be searched, copied and changed.
    Text,
    /// As outlines: they look the same everywhere.
    Outlines,
}

/// A name and what is around its letters.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Inscription<'a> {
    pub item: Item<'a>,
    pub texts: &'a [Placed],
    pub colour: Colour,
    pub halo: Pen,
}

/// Draws at places in pixels of a map, one thing over the other.
pub(crate) trait Plotter {
    /// The pixels that are drawn on.
    fn area(&self) -> Area;

    /// Begins a layer, in which there is what is drawn until it ends. Pixels have no layers.
    fn begin_layer(&mut self, _layer: Layer) {}

    /// Ends the layer.
    fn end_layer(&mut self) {}

    /// Begins one thing of a layer. Pixels do not tell things apart.
    fn begin_item(&mut self, _item: &Item<'_>) {}

    /// Ends the thing.
    fn end_item(&mut self) {}

    /// Fills an area by the even-odd rule.
    fn fill(&mut self, shape: &Shape, colour: Colour);

    /// Draws lines, if the pen has a width.
    fn stroke(&mut self, lines: &[Vec<[f64; 2]>], pen: &Pen);

    /// Writes a text.
    fn write(&mut self, text: &Placed, colour: Colour);

    /// Writes names over what is around their letters. Pages draw one name after the other, each as a thing of its own; on
    /// pixels nothing that is around a name covers another, however wide it is.
    fn inscribe(&mut self, inscriptions: &[Inscription<'_>]);

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
    /// From here on nothing is seen outside a part of the page, until [`open`](Page::open).
    fn clip(&mut self, part: Area);

    /// Begins a picture of a part of the page.
    fn begin_picture(&mut self, part: Area);

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
