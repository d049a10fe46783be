//! Plotters: surfaces on which lines, areas and letters are drawn, either pixels or pages of vectors.

use glam::DVec2;

use crate::area::Area;
use crate::error::Error;
use crate::map::style::Colour;
use crate::map::text::Placed;

/// Largest width of a line in pixels, half on each side. Anything that lies this close to an area may reach into it.
pub(crate) const WIDEST: f64 = 64.0;

/// Lines, or the rings of an area, in pixels, with their bounding box: west, north, east and south.
#[derive(Clone, Debug)]
pub(crate) struct Shape {
    pub bounds: [f64; 4],
    pub lines: Vec<Vec<DVec2>>,
}

impl Shape {
    /// Creates a shape of lines, or of the rings of an area.
    pub fn new(lines: Vec<Vec<DVec2>>) -> Shape {
        Shape { bounds: bounds(lines.iter().flatten()), lines }
    }

    /// Creates the ring of a rectangle, given its west, north, east and south.
    pub fn rectangle(edges: [f64; 4]) -> Shape {
        Shape::new(vec![ring(edges)])
    }
}

/// Returns the ring around a rectangle, given its west, north, east and south.
pub(crate) fn ring([west, north, east, south]: [f64; 4]) -> Vec<DVec2> {
    [[west, north], [east, north], [east, south], [west, south], [west, north]].map(DVec2::from).into()
}

/// Returns a rectangle (west, north, east and south) that is larger by a distance on each side.
pub(crate) fn widened([west, north, east, south]: [f64; 4], by: f64) -> [f64; 4] {
    [west - by, north - by, east + by, south + by]
}

/// Returns the bounding box of points: west, north, east and south.
pub(crate) fn bounds<'a>(points: impl Iterator<Item = &'a DVec2>) -> [f64; 4] {
    let none = [f64::MAX, f64::MAX, f64::MIN, f64::MIN];
    points.fold(none, |[w, n, e, s], at| [w.min(at.x), n.min(at.y), e.max(at.x), s.max(at.y)])
}

/// The pen that draws a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pen {
    pub colour: Colour,
    pub opacity: f32,
    /// Width in pixels, as all lengths here.
    pub width: f32,
    /// Lengths of a stroke and of a gap; none for a solid line.
    pub dash: Option<[f32; 2]>,
}

impl Pen {
    /// Returns an opaque pen without dashes.
    pub fn solid(colour: Colour, width: f64) -> Pen {
        Pen { colour, opacity: 1.0, width: width as f32, dash: None }
    }
}

/// Layers of a page, from the lowest to the highest. Whoever edits the page can hide or change a layer as a whole.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum PageLayer {
    /// The background under the map and around it.
    Paper,
    /// The ground as a picture.
    Relief,
    /// Strokes on rock and slopes, and stones.
    Signs,
    /// Contours with their heights, and lines of equal depth.
    Contours,
    /// Houses of settlements.
    Houses,
    /// Lakes, rivers and coasts.
    Waters,
    /// Roads, bridges and tunnels.
    Roads,
    /// Symbols of settlements and peaks.
    Places,
    /// Names on the map, and the heights of peaks.
    Names,
    /// Furniture around the map, and the lines of grids over it.
    Furniture,
}

impl PageLayer {
    /// Returns the name that editors show.
    pub const fn name(self) -> &'static str {
        match self {
            PageLayer::Paper => "paper",
            PageLayer::Relief => "relief",
            PageLayer::Signs => "signs",
            PageLayer::Contours => "contours",
            PageLayer::Houses => "houses",
            PageLayer::Waters => "waters",
            PageLayer::Roads => "roads",
            PageLayer::Places => "places",
            PageLayer::Names => "names",
            PageLayer::Furniture => "furniture",
        }
    }
}

/// One object of a layer, such as a river, however many strokes it takes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Item<'a> {
    /// Kind of the object, in a word.
    pub kind: &'static str,
    /// Identifies the object among others of its kind. Empty if it is the only one.
    pub id: &'a str,
    /// Name of the object. Empty if it has none.
    pub name: &'a str,
}

impl Item<'_> {
    /// Creates the item of an object that is the only one of its kind.
    pub fn only(kind: &'static str) -> Item<'static> {
        Item { kind, id: "", name: "" }
    }
}

/// Form in which letters are written on pages of vectors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lettering {
    /// As text, with the letters of its fonts embedded in the file: the text can be searched, copied and changed.
    Text,
    /// As outlines, which look the same everywhere.
    Outlines,
}

/// A name and the halo around its letters.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Inscription<'a> {
    pub item: Item<'a>,
    pub text: &'a Placed,
    pub colour: Colour,
    pub halo: Pen,
}

/// Draws at places given in pixels of a map, each drawing over those before it.
pub(crate) trait Plotter {
    /// Returns the pixels that are drawn on.
    fn area(&self) -> Area;

    /// Begins a layer: everything drawn until its end belongs to it. Pixels have no layers.
    fn begin_layer(&mut self, _layer: PageLayer) {}

    /// Ends the layer.
    fn end_layer(&mut self) {}

    /// Begins one object of a layer. Pixels do not tell objects apart.
    fn begin_item(&mut self, _item: &Item<'_>) {}

    /// Ends the object.
    fn end_item(&mut self) {}

    /// Fills an area by the even-odd rule.
    fn fill(&mut self, shape: &Shape, colour: Colour);

    /// Draws lines, if the pen has a width.
    fn stroke(&mut self, lines: &[Vec<DVec2>], pen: &Pen);

    /// Writes a text.
    fn write(&mut self, text: &Placed, colour: Colour);

    /// Writes names over their halos. Pages draw one name after the other, each as an object of its own. On pixels all
    /// halos are drawn before all names, so no halo covers a name, however wide it is.
    fn inscribe(&mut self, inscriptions: &[Inscription<'_>]);

    /// Draws a disc.
    fn dot(&mut self, at: DVec2, radius: f64, colour: Colour);

    /// True if something with this bounding box (west, north, east and south) may be visible.
    fn sees(&self, span: [f64; 4]) -> bool {
        self.area().padded(WIDEST as usize).meets(span)
    }

    /// Draws the lines of a shape, if they may be visible.
    fn stroke_shape(&mut self, shape: &Shape, pen: &Pen) {
        if self.sees(shape.bounds) {
            self.stroke(&shape.lines, pen);
        }
    }
}

impl dyn Plotter + '_ {
    /// Draws a layer.
    pub fn layer(&mut self, layer: PageLayer, draw: impl FnOnce(&mut Self)) {
        self.begin_layer(layer);
        draw(self);
        self.end_layer();
    }

    /// Draws one object of a layer.
    pub fn item(&mut self, item: &Item<'_>, draw: impl FnOnce(&mut Self)) {
        self.begin_item(item);
        draw(self);
        self.end_item();
    }
}

/// A page of vectors, which can hold pictures of pixels too.
pub(crate) trait Page: Plotter {
    /// Clips everything drawn from here on to a part of the page, until [`open`](Page::open).
    fn clip(&mut self, part: Area);

    /// Begins a picture that fills a part of the page.
    fn begin_picture(&mut self, part: Area);

    /// Adds the next rows of the picture, from the north: RGB.
    ///
    /// # Errors
    /// When the page cannot be written.
    fn add_rows(&mut self, pixels: &[u8]) -> Result<(), Error>;

    /// Ends the picture. Everything else is drawn over it.
    ///
    /// # Errors
    /// When the page cannot be written.
    fn end_picture(&mut self) -> Result<(), Error>;

    /// Ends the clipping that [`clip`](Page::clip) began.
    fn open(&mut self);
}
