//! Sheets: a map on paper, surrounded by map furniture such as a title, a frame, a grid, a scale bar, a legend and the
//! recipe of the map.

use std::collections::BTreeSet;
use std::sync::Arc;

use glam::{DVec2, dvec2};

use crate::area::Area;
use crate::clock::Clock;
use crate::error::Error;
use crate::features::landforms::SALT_PAN;
use crate::lines::RoadClass;
use crate::map::canvas::Canvas;
use crate::map::chart::{Chart, Picture};
use crate::map::font::Face;
use crate::map::frame::{self, MapFrame};
use crate::map::plotter::{Item, Page, PageLayer, Pen, Plotter, Shape, ring, widened};
use crate::map::scale::Scale;
use crate::map::style::{Colour, Style, TintBy};
use crate::map::symbols::{draw_peak, draw_site};
use crate::map::terrain::LandClass;
use crate::map::text::{Placed, shape};
use crate::places::site::SiteClass;
use crate::stop::Stopped;
use crate::watch::Watch;

/// Widths in millimetres of the paper beside the map, above it and below it.
const SIDE_MM: f64 = 14.0;
const TOP_MM: f64 = 20.0;
const BOTTOM_MM: f64 = 37.0;

/// Distance in millimetres from the map to the outer frame. The numbers of the grid stand in between.
const FRAME_MM: f64 = 5.0;

/// Smallest distance in millimetres between two lines of the grid.
const GRID_MM: f64 = 40.0;

/// Largest length of a scale bar in millimetres.
const BAR_MM: f64 = 60.0;

/// Height of a row of the legend and width of a column, in millimetres. Two columns fit below a map on paper of 100 mm,
/// with some room for rounding to pixels.
const ROW_MM: f64 = 4.6;
const COLUMN_MM: f64 = 35.5;

/// Width in millimetres of a column of a legend of classes of land, whose names are longer.
const CLASS_COLUMN_MM: f64 = 52.0;

/// Numbers of rows of a legend, and of lines of a recipe, that fit below every map.
const ROWS: usize = 4;
const LINES: usize = 3;

/// Font size of the title in millimetres.
const TITLE_MM: f64 = 8.5;

/// Line spacing and font size of the recipe in millimetres.
const LINE_MM: f64 = 3.0;
const RECIPE_MM: f64 = 2.3;

/// Width in millimetres of the north arrow at the eastern end of the foot, and distance from the foot down to a legend
/// that stands below the arrow and the scale bar.
const NORTH_MM: f64 = 14.0;
const BELOW_MM: f64 = 15.0;

/// Map furniture: the parts of a sheet around its map.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Furniture {
    /// The name of the map, above it.
    Title,
    /// The neatline around the map, and a second line around the neatline.
    Frame,
    /// Grid lines over the map at round numbers of kilometres, with these numbers in the frame.
    Grid,
    /// The scale bar, and the scale as a ratio.
    Scale,
    /// The north arrow.
    North,
    /// The legend, which explains colours and lines.
    Legend,
    /// The recipe, a text that says how to draw the map again.
    Recipe,
}

impl Furniture {
    /// All furniture, in the order of lists.
    pub const ALL: [Furniture; 7] = [
        Furniture::Title,
        Furniture::Frame,
        Furniture::Grid,
        Furniture::Scale,
        Furniture::North,
        Furniture::Legend,
        Furniture::Recipe,
    ];

    /// Returns the name in options.
    pub const fn name(self) -> &'static str {
        match self {
            Furniture::Title => "title",
            Furniture::Frame => "frame",
            Furniture::Grid => "grid",
            Furniture::Scale => "scale",
            Furniture::North => "north",
            Furniture::Legend => "legend",
            Furniture::Recipe => "recipe",
        }
    }
}

/// Texts around a map, and the furniture that its sheet has.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Captions {
    /// The name of the map.
    pub title: String,
    /// Subtitle in smaller letters, at the other end of the title's line.
    pub subtitle: String,
    /// Text that says how to draw the map again.
    pub recipe: String,
    /// Furniture that is drawn.
    pub furniture: BTreeSet<Furniture>,
    /// Cells with numbers over the map.
    pub overlay: Option<Overlay>,
    /// Names of the sheets to the north, east, south and west, where there are any.
    pub neighbours: [Option<String>; 4],
}

/// Numbered cells over a map. A number has two digits for the column, counted from the west, and two for the row,
/// counted from the north.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Overlay {
    /// Form of the cells.
    pub form: Cells,
    /// Distance in metres between opposite sides of a cell.
    pub side_m: f64,
}

/// The form of cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cells {
    /// Squares.
    Squares,
    /// Hexagons in columns; every second column lies half a cell further south.
    Hexagons,
}

/// A map with its furniture. Pixels are counted as on the map, so their coordinates go on to its left and above it.
#[derive(Debug)]
pub struct Sheet<'a> {
    /// None if the sheet has nothing but text.
    picture: Option<&'a Picture>,
    style: &'a Style,
    scale: Scale,
    page: Area,
    marks: Vec<Mark>,
}

/// Something drawn on the paper.
#[derive(Debug)]
enum Mark {
    /// Begins a group: the marks up to the end belong together, such as all of a legend.
    Begin(&'static str),
    End,
    Fill(Shape, Colour),
    Line(Vec<DVec2>, Colour, f64, f32),
    Site(DVec2, SiteClass),
    Peak(DVec2),
    Text(Placed, Colour),
}

impl Sheet<'_> {
    /// Returns the widths in pixels of the paper around a map: west, north, east and south. The whole paper is `paper`
    /// pixels wide from west to east. There is room for all furniture, and for more rows of a legend if `furniture` has
    /// one.
    pub(super) fn margins((style, scale): (&Style, Scale), paper: i64, furniture: &BTreeSet<Furniture>) -> [i64; 4] {
        let form = LegendForm::of(style);
        let map_mm = paper as f64 / scale.pixels(1.0) - 2.0 * SIDE_MM;
        let more_mm = match furniture.contains(&Furniture::Legend) {
            true => form.below(map_mm, form.most).more_mm(form.most),
            false => 0.0,
        };
        [SIDE_MM, TOP_MM, SIDE_MM, BOTTOM_MM + more_mm].map(|mm| scale.pixels(mm).ceil() as i64)
    }

    /// Returns the largest area of pixels that a map and its furniture take: with a legend of everything that a map can
    /// show.
    pub fn area(map: Area, drawn: (&Style, Scale), captions: &Captions) -> Area {
        Sheet::area_of(map, drawn, captions, LegendForm::of(drawn.0).most)
    }

    /// Returns the area of pixels that a map and its furniture take, with `explained` rows in the legend.
    fn area_of(map: Area, (style, scale): (&Style, Scale), captions: &Captions, explained: usize) -> Area {
        let Captions { furniture, recipe, .. } = captions;
        let pixels = |mm: f64| scale.pixels(mm).ceil() as i64;
        let has = |one: Furniture| furniture.contains(&one);
        let side = if Sheet::is_framed(furniture) { pixels(SIDE_MM) } else { 0 };
        let has_foot = [Furniture::Scale, Furniture::North, Furniture::Legend, Furniture::Recipe].into_iter().any(has);
        let top = if has(Furniture::Title) { pixels(TOP_MM) } else { side };
        let (mut east, mut foot_mm) = (side, BOTTOM_MM);
        if has(Furniture::Legend) {
            let form = LegendForm::of(style);
            foot_mm += form.below(map.width() as f64 / scale.pixels(1.0), explained).more_mm(explained);
            // A column of the legend is wider than the smallest maps.
            east = east.max(pixels(form.column_mm) - map.width() as i64);
        }
        if has(Furniture::Recipe) {
            let lines = recipe_lines(recipe, map, (style, scale)).len();
            foot_mm += LINE_MM * lines.saturating_sub(LINES) as f64;
        }
        let bottom = if has_foot { pixels(foot_mm) } else { side };
        Area { x0: map.x0 - side, y0: map.y0 - top, x1: map.x1 + east, y1: map.y1 + bottom }
    }

    /// True if a map with such furniture has paper on all sides, so that it ends at a frame.
    pub fn is_framed(furniture: &BTreeSet<Furniture>) -> bool {
        furniture.contains(&Furniture::Frame) || furniture.contains(&Furniture::Grid)
    }

    /// Returns the picture of a chart for a sheet with such furniture: with a frame, if the map ends at one. `watch`
    /// counts the squares in which everything is found.
    ///
    /// # Errors
    /// When the work is stopped.
    pub fn picture(
        chart: &Arc<Chart>,
        map: Area,
        furniture: &BTreeSet<Furniture>,
        watch: &Watch,
    ) -> Result<Picture, Stopped> {
        let frame = Sheet::is_framed(furniture).then(|| MapFrame::new(map, chart.scale()));
        let mut picture = chart.drawn_picture(map, frame, watch)?;
        if furniture.contains(&Furniture::Legend) {
            picture.find_classes(&watch.clock)?;
        }
        Ok(picture)
    }

    /// Creates the sheet of a picture and its furniture, on as much paper as they take.
    pub fn new<'a>(picture: &'a Picture, captions: &Captions) -> Sheet<'a> {
        let chart = picture.chart();
        let page = Sheet::area_of(picture.area(), (chart.style(), chart.scale()), captions, picture.legend().len());
        Sheet::on_page(picture, captions, page)
    }

    /// Creates the sheet as [`Sheet::new`] does, on a given page that is large enough, such as the largest area that a
    /// sheet [takes](Sheet::area).
    pub(crate) fn on_page<'a>(picture: &'a Picture, captions: &Captions, page: Area) -> Sheet<'a> {
        let chart = picture.chart();
        let (style, scale, map) = (chart.style(), chart.scale(), picture.area());
        let mut printer = SheetPrinter { style, scale, map, page, marks: Vec::new() };
        if let Some(overlay) = captions.overlay {
            printer.group("overlay", |printer| printer.overlay(overlay));
        }
        for furniture in &captions.furniture {
            printer.group(furniture.name(), |printer| match furniture {
                Furniture::Title => printer.title(&captions.title, &captions.subtitle),
                Furniture::Frame => printer.frame(),
                Furniture::Grid => printer.grid(),
                Furniture::Scale => printer.scale_bar(),
                Furniture::North => printer.north(),
                Furniture::Legend => printer.legend(&picture.legend(), chart.interval_m()),
                Furniture::Recipe => printer.recipe(&captions.recipe),
            });
        }
        printer.group("neighbours", |printer| printer.neighbours(&captions.neighbours));
        Sheet { picture: Some(picture), style, scale, page, marks: printer.marks }
    }

    /// Adds frames over the map, each with a name in its middle.
    pub(super) fn add_frames(&mut self, frames: &[(Area, String)]) {
        let (style, scale, page) = (self.style, self.scale, self.page);
        for (map, name) in frames {
            let mut printer = SheetPrinter { style, scale, map: *map, page, marks: Vec::new() };
            let [west, north, east, south] = map.edges();
            printer.line(ring(map.edges()), 0.4);
            let middle = [f64::midpoint(west, east), f64::midpoint(north, south) + printer.mm(2.2)];
            printer.write(name, Face::Bold, 6.5, middle, 0.5);
            self.marks.append(&mut printer.marks);
        }
    }

    /// Creates a page of text. Each line has its text, face, size in millimetres, place in millimetres from the page's
    /// corner, and the share of its width that lies to the left of that place.
    pub(super) fn of_text<'a>(
        style: &'a Style,
        scale: Scale,
        page: Area,
        lines: &[(String, Face, f64, [f64; 2], f64)],
    ) -> Sheet<'a> {
        let mut printer = SheetPrinter { style, scale, map: page, page, marks: Vec::new() };
        for (text, face, size_mm, [x, y], share) in lines {
            let at = [page.x0 as f64 + printer.mm(*x), page.y0 as f64 + printer.mm(*y)];
            printer.write(text, *face, *size_mm, at, *share);
        }
        Sheet { picture: None, style, scale, page, marks: printer.marks }
    }

    /// Returns the letters on the sheet that the fonts lack. Each is drawn as a box.
    pub fn missing_letters(&self) -> BTreeSet<char> {
        let text = |mark: &'_ Mark| if let Mark::Text(text, _) = mark { text.missing().collect() } else { Vec::new() };
        let of_map = self.picture.iter().flat_map(|picture| picture.missing_letters());
        self.marks.iter().flat_map(text).chain(of_map).collect()
    }

    /// Returns the area of pixels that the sheet covers.
    pub fn page(&self) -> Area {
        self.page
    }

    /// Hands the sheet to `write` in strips of whole rows, from north to south: RGB, row by row.
    ///
    /// # Errors
    /// When `write` fails, or `clock` stops the work.
    pub fn strips<E: From<Stopped>>(
        &self,
        clock: &Clock,
        mut write: impl FnMut(&[u8]) -> Result<(), E>,
    ) -> Result<(), E> {
        let Sheet { picture, style, scale, .. } = *self;
        let mut y = self.page.y0;
        while y < self.page.y1 {
            clock.check()?;
            // Strips end where the blocks of the map end, so that each block is drawn only once.
            let mut end = (y.div_euclid(Chart::STRIP as i64) + 1) * Chart::STRIP as i64;
            if let Some(map) = picture.map(Picture::area).filter(|map| y < map.y0) {
                end = end.min(map.y0);
            }
            let strip = Area { y0: y, y1: end.min(self.page.y1), ..self.page };
            let mut canvas = Canvas::new(strip, style.paper);
            if let Some((picture, seen)) = picture.and_then(|picture| Some((picture, picture.area().common(&strip)?))) {
                canvas.put(seen, &picture.pixels(seen, clock)?);
            }
            self.marks.iter().for_each(|mark| mark.draw(&mut canvas, scale, style));
            write(&canvas.pixels(strip))?;
            y = strip.y1;
        }
        Ok(())
    }

    /// Draws the sheet on a page; `watch` counts the rows of its map.
    ///
    /// # Errors
    /// When the page cannot be written.
    pub(crate) fn plot(&self, page: &mut dyn Page, watch: &Watch) -> Result<(), Error> {
        let Sheet { picture, style, scale, .. } = *self;
        let canvas: &mut dyn Plotter = page;
        canvas.layer(PageLayer::Paper, |canvas| canvas.fill(&Shape::rectangle(self.page.edges()), style.paper));
        if let Some(picture) = picture {
            picture.plot(page, watch)?;
        }
        let canvas: &mut dyn Plotter = page;
        canvas.layer(PageLayer::Furniture, |canvas| self.marks.iter().for_each(|mark| mark.draw(canvas, scale, style)));
        Ok(())
    }
}

impl Mark {
    fn draw(&self, plotter: &mut dyn Plotter, scale: Scale, style: &Style) {
        match self {
            Mark::Begin(kind) => plotter.begin_item(&Item::only(kind)),
            Mark::End => plotter.end_item(),
            Mark::Fill(shape, colour) => plotter.fill(shape, *colour),
            Mark::Line(line, colour, width, opacity) => {
                let pen = Pen { opacity: *opacity, ..Pen::solid(*colour, *width) };
                plotter.stroke_shape(&Shape::new(vec![line.clone()]), &pen);
            }
            Mark::Site(at, class) => draw_site(plotter, *at, *class, scale, style),
            Mark::Peak(at) => draw_peak(plotter, *at, scale, style.labels.peak.colour),
            Mark::Text(text, colour) => plotter.write(text, *colour),
        }
    }
}

/// Returns the distance in kilometres from one line of the grid to the next: a round number.
pub(super) fn grid_km(scale: Scale) -> f64 {
    let least_km = GRID_MM * scale.denominator() / 1e6;
    let power = libm::pow(10.0, libm::floor(libm::log10(least_km)));
    [1.0, 2.0, 5.0, 10.0].map(|step| step * power).into_iter().find(|step| *step >= least_km).unwrap_or(least_km)
}

/// Returns the parts of a line within a rectangle: west, north, east and south.
fn clipped(line: &[DVec2], edges: [f64; 4]) -> Vec<Vec<DVec2>> {
    line.windows(2).filter_map(|pair| frame::clipped([pair[0], pair[1]], edges)).map(|part| part.to_vec()).collect()
}

/// Returns the largest length that is at most `most` and 1, 2 or 5 times a power of ten.
fn round_length(most: f64) -> f64 {
    let power = libm::pow(10.0, libm::floor(libm::log10(most)));
    [5.0, 2.0, 1.0].map(|step| step * power).into_iter().find(|step| *step <= most).unwrap_or(power)
}

/// Formats a number with thin spaces between thousands, as maps do.
pub fn thousands(number: f64) -> String {
    let digits = format!("{number:.0}");
    let mut text = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index) % 3 == 0 && digit.is_ascii_digit() && !text.ends_with('-') {
            text.push('\u{2009}');
        }
        text.push(digit);
    }
    text
}

/// Collects the marks of a sheet.
struct SheetPrinter<'a> {
    style: &'a Style,
    scale: Scale,
    map: Area,
    page: Area,
    marks: Vec<Mark>,
}

impl SheetPrinter<'_> {
    fn mm(&self, mm: f64) -> f64 {
        self.scale.pixels(mm)
    }

    /// Prints marks that belong together.
    fn group(&mut self, kind: &'static str, print: impl FnOnce(&mut Self)) {
        self.marks.push(Mark::Begin(kind));
        print(self);
        self.marks.push(Mark::End);
    }

    fn line(&mut self, line: Vec<DVec2>, mm: f64) {
        let width = self.mm(mm);
        self.marks.push(Mark::Line(line, self.style.ink, width, 1.0));
    }

    fn fill(&mut self, edges: [f64; 4], colour: Colour) {
        self.marks.push(Mark::Fill(Shape::rectangle(edges), colour));
    }

    /// Writes a text whose baseline begins at a place (`share` 0), has its middle there (0.5) or ends there (1).
    /// Returns the width of the text in pixels.
    fn write(&mut self, text: &str, face: Face, size_mm: f64, [x, y]: [f64; 2], share: f64) -> f64 {
        let shaped = shape(text, self.style.labels.typeface(face), self.mm(size_mm) as f32, 0.0);
        let placed = shaped.at(dvec2(x - share * shaped.width, y), 0.0);
        self.marks.push(Mark::Text(placed, self.style.ink));
        shaped.width
    }

    fn title(&mut self, title: &str, subtitle: &str) {
        let [west, north, east, _] = self.map.edges();
        let baseline = north - self.mm(FRAME_MM + 3.6);
        // Shrink a title that is wider than the map.
        let usual = shape(title, self.style.labels.typeface(Face::Semibold), self.mm(TITLE_MM) as f32, 0.0).width;
        let size_mm = if usual > east - west { TITLE_MM * (east - west) / usual } else { TITLE_MM };
        let long = self.write(title, Face::Semibold, size_mm, [west, baseline], 0.0);
        let rest = shape(subtitle, self.style.labels.typeface(Face::Italic), self.mm(4.0) as f32, 0.0).width;
        // Without room for the subtitle on a small sheet, the recipe at its foot must do.
        if long + self.mm(6.0) + rest <= east - west {
            self.write(subtitle, Face::Italic, 4.0, [east, baseline], 1.0);
        }
    }

    fn frame(&mut self) {
        self.line(ring(self.map.edges()), 0.15);
        self.line(ring(widened(self.map.edges(), self.mm(FRAME_MM))), 0.5);
    }

    fn grid(&mut self) {
        let [west, north, east, south] = self.map.edges();
        let (km, ink) = (grid_km(self.scale), self.style.ink);
        let step = km * 1000.0 / self.scale.metres_per_pixel;
        let (thin, gap) = (self.mm(0.1), self.mm(FRAME_MM));
        let digits = usize::from(km < 1.0) + usize::from(km < 0.1);
        let lines = |from: f64, to: f64| ((from / step).ceil() as i64)..=((to / step).floor() as i64);
        let small = self.mm(0.9);
        for number in lines(west, east) {
            let x = number as f64 * step;
            self.marks.push(Mark::Line(vec![dvec2(x, north), dvec2(x, south)], ink, thin, 0.28));
            let text = format!("{:.digits$}", number as f64 * km);
            if x > west + gap && x < east - gap {
                self.write(&text, Face::Regular, 2.6, [x, north - 1.6 * small], 0.5);
                self.write(&text, Face::Regular, 2.6, [x, south + 3.4 * small], 0.5);
            }
        }
        for number in lines(north, south) {
            let y = number as f64 * step;
            self.marks.push(Mark::Line(vec![dvec2(west, y), dvec2(east, y)], ink, thin, 0.28));
            // The numbers grow to the north, while rows of pixels are counted to the south.
            let text = format!("{:.digits$}", 0.0 - number as f64 * km);
            for x in [west - 0.5 * gap, east + 0.5 * gap] {
                let shaped = shape(&text, self.style.labels.typeface(Face::Regular), self.mm(2.6) as f32, 0.0);
                // Turned to be read from the right, as the numbers at the sides of maps are.
                let start = dvec2(x + 0.35 * shaped.cap_height, y + 0.5 * shaped.width);
                let placed = shaped.at(start, -std::f64::consts::FRAC_PI_2);
                if y > north + gap && y < south - gap {
                    self.marks.push(Mark::Text(placed, ink));
                }
            }
        }
    }

    /// Draws cells over the map, from its north-western corner on, with their numbers at their tops.
    fn overlay(&mut self, Overlay { form, side_m }: Overlay) {
        let [west, north, east, south] = self.map.edges();
        let side = side_m / self.scale.metres_per_pixel;
        let (ink, width, size_mm) = (self.style.ink, self.mm(0.15), 2.2);
        // Columns of hexagons interlock, so they lie closer together than a hexagon is wide.
        let (step, long) = match form {
            Cells::Squares => (side, side),
            Cells::Hexagons => (side * 3.0_f64.sqrt() / 2.0, side / 3.0_f64.sqrt()),
        };
        let cells = |span: f64, step: f64| (span / step).ceil().clamp(0.0, 9999.0) as i64 + 1;
        for column in 0..cells(east - west, step) {
            for row in 0..cells(south - north, side) {
                let (x, y) = (west + column as f64 * step, north + row as f64 * side);
                let (ring, top) = match form {
                    Cells::Squares => (ring([x, y, x + side, y + side]), dvec2(x + 0.5 * side, y)),
                    Cells::Hexagons => {
                        let middle = dvec2(x + long, y + if column % 2 == 0 { 0.5 } else { 1.0 } * side);
                        let corners = (0..=6).map(|corner| {
                            let angle = f64::from(corner) * std::f64::consts::FRAC_PI_3;
                            middle + long * dvec2(libm::cos(angle), libm::sin(angle))
                        });
                        (corners.collect(), middle - dvec2(0.0, 0.5 * side))
                    }
                };
                for line in clipped(&ring, [west, north, east, south]) {
                    self.marks.push(Mark::Line(line, ink, width, 0.55));
                }
                let at = [top.x, top.y + self.mm(size_mm)];
                if at[0] > west + self.mm(2.0) && at[0] < east - self.mm(2.0) && at[1] < south {
                    self.write(&format!("{:02}{:02}", column + 1, row + 1), Face::Regular, size_mm, at, 0.5);
                }
            }
        }
    }

    /// Writes the names of the neighbouring sheets, in the frame or right beside the map.
    fn neighbours(&mut self, names: &[Option<String>; 4]) {
        let [west, north, east, south] = self.map.edges();
        let (x, y) = (f64::midpoint(west, east), f64::midpoint(north, south));
        let (gap, size_mm) = (self.mm(0.5 * FRAME_MM), 3.0);
        let down = self.mm(1.0);
        let places = [[x, north - gap + down], [east + gap, y + down], [x, south + gap + down], [west - gap, y + down]];
        for (name, at) in names.iter().zip(places) {
            if let Some(name) = name {
                self.write(name, Face::Semibold, size_mm, at, 0.5);
            }
        }
    }

    /// Returns the y of the baseline of the first line below the map.
    fn foot(&self) -> f64 {
        self.map.edges()[3] + self.mm(FRAME_MM + 6.0)
    }

    fn scale_bar(&mut self) {
        let west = self.map.edges()[0];
        let foot = self.foot();
        let denominator = self.scale.denominator();
        self.write(&format!("1 : {}", thousands(denominator)), Face::Semibold, 4.2, [west, foot], 0.0);
        let most_m = BAR_MM.min(self.map.width() as f64 / self.mm(1.0) * 0.3) * denominator / 1000.0;
        let length_m = round_length(most_m);
        let length = length_m / self.scale.metres_per_pixel;
        let (top, bottom) = (foot + self.mm(4.2), foot + self.mm(5.4));
        let parts = 5;
        let (unit, per) = if length_m >= 1000.0 { ("km", 1000.0) } else { ("m", 1.0) };
        for part in 0..parts {
            let at = |part: i32| west + length * f64::from(part) / f64::from(parts);
            let colour = if part % 2 == 0 { self.style.ink } else { self.style.paper };
            self.fill([at(part), top, at(part + 1), bottom], colour);
        }
        self.line(ring([west, top, west + length, bottom]), 0.12);
        let baseline = bottom + self.mm(3.2);
        let number = |metres: f64| {
            let value = metres / per;
            if value.fract() == 0.0 { format!("{value:.0}") } else { format!("{value}") }
        };
        self.write("0", Face::Regular, 2.8, [west, baseline], 0.5);
        self.write(&format!("{} {unit}", number(length_m)), Face::Regular, 2.8, [west + length, baseline], 0.5);
    }

    fn north(&mut self) {
        let east = self.map.edges()[2];
        let (x, top) = (east - self.mm(5.0), self.foot() - self.mm(3.5));
        let (half, height) = (self.mm(2.2), self.mm(11.0));
        let ink = self.style.ink;
        let side = |half: f64| {
            let corners = [[x, top], [x + half, top + height], [x, top + 0.78 * height], [x, top]];
            Vec::from(corners.map(DVec2::from))
        };
        let (left, right) = (side(-half), side(half));
        self.marks.push(Mark::Fill(Shape::new(vec![left.clone()]), ink));
        self.line(right, 0.15);
        self.line(left, 0.15);
        self.write("N", Face::Semibold, 4.2, [x, top + height + self.mm(4.4)], 0.5);
    }

    /// Draws the legend of what is seen on the map, each column from the top to the bottom.
    fn legend(&mut self, shown: &[LegendItem], interval_m: f64) {
        let form = LegendForm::of(self.style);
        let place = form.below(self.map.width() as f64 / self.mm(1.0), shown.len());
        let (from, top) = (self.map.edges()[0] + self.mm(place.from_mm), self.foot() + self.mm(place.top_mm - 1.0));
        let (step, column, sample) = (self.mm(ROW_MM), self.mm(form.column_mm), self.mm(7.0));
        let rows = place.rows(shown.len());
        for (index, item) in shown.iter().copied().enumerate() {
            let [x, y] = [from + (index / rows) as f64 * column, top + (index % rows) as f64 * step];
            self.sample(item, x, y, sample);
            self.write(&item.about(interval_m), Face::Regular, 2.9, [x + sample + self.mm(2.0), y + self.mm(1.0)], 0.0);
        }
    }

    fn sample(&mut self, item: LegendItem, x: f64, y: f64, width: f64) {
        let style = self.style;
        let line = |mm: f64, colour: Colour| {
            Mark::Line(vec![dvec2(x, y), dvec2(x + width, y)], colour, self.scale.pixels(mm), 1.0)
        };
        let middle = dvec2(x + 0.5 * width, y);
        match item {
            LegendItem::Road(class) => {
                let road = style.roads.class(class);
                let marks =
                    [line(road.width_mm + 2.0 * road.casing_mm, style.roads.casing), line(road.width_mm, road.colour)];
                self.marks.extend(marks);
            }
            LegendItem::River => self.marks.push(line(style.water.river_mm[1] * 0.6, style.water.line)),
            LegendItem::Class(class) => {
                self.fill([x, y - self.mm(1.3), x + width, y + self.mm(1.3)], Colour(class.colour()));
            }
            LegendItem::Lake => self.fill([x, y - self.mm(1.3), x + width, y + self.mm(1.3)], style.water.fill),
            LegendItem::Pan => self.fill([x, y - self.mm(1.3), x + width, y + self.mm(1.3)], style.water.pan),
            LegendItem::LakeAndPan => {
                self.fill([x, y - self.mm(1.3), middle.x, y + self.mm(1.3)], style.water.fill);
                self.fill([middle.x, y - self.mm(1.3), x + width, y + self.mm(1.3)], style.water.pan);
            }
            LegendItem::Contour => self.marks.push(line(style.contours.index_width_mm, style.contours.colour)),
            LegendItem::Site(class) => self.marks.push(Mark::Site(middle, class)),
            LegendItem::Peak => self.marks.push(Mark::Peak(middle)),
        }
    }

    /// Writes the recipe, with its last line at the foot of the page.
    fn recipe(&mut self, recipe: &str) {
        let west = self.map.edges()[0];
        for (number, line) in recipe_lines(recipe, self.map, (self.style, self.scale)).iter().rev().enumerate() {
            let y = self.page.y1 as f64 - self.mm(3.0 + LINE_MM * number as f64);
            self.write(line, Face::Regular, RECIPE_MM, [west, y], 0.0);
        }
    }
}

/// Breaks a recipe into lines that are at most as wide as the map.
fn recipe_lines(recipe: &str, map: Area, (style, scale): (&Style, Scale)) -> Vec<String> {
    let typeface = style.labels.typeface(Face::Regular);
    let mut lines = vec![String::new()];
    for word in recipe.split(' ') {
        let last = lines.last_mut().expect("there is a line");
        let longer = if last.is_empty() { word.to_owned() } else { format!("{last} {word}") };
        let width = shape(&longer, typeface, scale.pixels(RECIPE_MM) as f32, 0.0).width;
        if width > map.width() as f64 && !last.is_empty() {
            lines.push(word.to_owned());
        } else {
            *last = longer;
        }
    }
    lines
}

/// The largest number of items of a legend, and the width of its columns in millimetres.
#[derive(Clone, Copy, Debug, PartialEq)]
struct LegendForm {
    most: usize,
    column_mm: f64,
}

/// Place of the rows of a legend below a map.
#[derive(Clone, Copy, Debug, PartialEq)]
struct LegendPlace {
    /// Distances in millimetres from the western edge of the map to the legend, and from the foot down to its first
    /// row.
    from_mm: f64,
    top_mm: f64,
    columns: usize,
}

impl LegendForm {
    /// Returns the form for a style, in which legends have items of all kinds that its maps can show.
    fn of(style: &Style) -> LegendForm {
        match style.tint.by {
            TintBy::Height => LegendForm { most: LegendItem::KINDS, column_mm: COLUMN_MM },
            by => LegendForm { most: LegendItem::KINDS + LandClass::count(by), column_mm: CLASS_COLUMN_MM },
        }
    }

    /// Chooses the place below a map `map_mm` wide: between the scale bar and the north arrow, or below both where that
    /// takes less paper.
    fn below(self, map_mm: f64, explained: usize) -> LegendPlace {
        let from_mm = (BAR_MM + 14.0).min(map_mm * 0.36);
        let beside = LegendPlace { from_mm, top_mm: 0.0, columns: self.columns(map_mm - NORTH_MM - from_mm) };
        let below = LegendPlace { from_mm: 0.0, top_mm: BELOW_MM, columns: self.columns(map_mm).max(1) };
        if beside.columns > 0 && beside.more_mm(explained) <= below.more_mm(explained) { beside } else { below }
    }

    /// Returns the number of columns of a legend that fit into `room_mm` millimetres.
    fn columns(self, room_mm: f64) -> usize {
        (room_mm / self.column_mm).floor().max(0.0) as usize
    }
}

impl LegendPlace {
    /// Returns the number of rows of a legend of `explained` items.
    fn rows(self, explained: usize) -> usize {
        let least = if self.top_mm > 0.0 { 1 } else { ROWS };
        explained.div_ceil(self.columns).max(least)
    }

    /// Returns the height in millimetres by which the legend needs more paper than there is below every map.
    fn more_mm(self, explained: usize) -> f64 {
        (self.top_mm + ROW_MM * (self.rows(explained) as f64 - ROWS as f64)).max(0.0)
    }
}

/// A kind of thing that a legend explains.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum LegendItem {
    Class(LandClass),
    Road(RoadClass),
    River,
    Lake,
    Pan,
    /// Lakes and salt pans in one row: legends of worlds without pans need no more room.
    LakeAndPan,
    Contour,
    Site(SiteClass),
    Peak,
}

impl LegendItem {
    /// Largest number of items in a legend without classes of land: three classes of settlements, three of roads, and the others.
    const KINDS: usize = 10;

    fn about(self, interval_m: f64) -> String {
        match self {
            LegendItem::Class(class) => class.about(),
            LegendItem::Road(RoadClass::Highway) => "highway".into(),
            LegendItem::Road(RoadClass::Road) => "road".into(),
            LegendItem::Road(RoadClass::Track) => "track".into(),
            LegendItem::River => "river".into(),
            LegendItem::Lake => "lake".into(),
            LegendItem::Pan => SALT_PAN.into(),
            LegendItem::LakeAndPan => format!("lake, {SALT_PAN}"),
            LegendItem::Contour => format!("contours, each {interval_m} m"),
            LegendItem::Site(class) => class.name().into(),
            LegendItem::Peak => "peak, height in m".into(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::preset::Preset;
    use crate::recipe::source::RecipeSources;

    #[test]
    fn lengths_are_round_and_thousands_apart() {
        assert_eq!([7.0, 23.0, 1400.0, 99.0].map(round_length), [5.0, 20.0, 1000.0, 50.0]);
        assert_eq!(thousands(50_000.0), "50\u{2009}000");
        assert_eq!(thousands(999.0), "999");
        assert_eq!(thousands(2_000_000.0), "2\u{2009}000\u{2009}000");
    }

    #[test]
    fn a_long_title_ends_with_the_map() {
        let style = Style::load("topographic").unwrap();
        let scale = Scale { metres_per_pixel: 40.0, pixels_per_mm: 4.0 };
        for title in ["", "Map", "The map of all that lies between the mountains and the sea"] {
            let map = Area::new(0, 0, 400, 300);
            let mut printer = SheetPrinter { style: &style, scale, map, page: map, marks: Vec::new() };
            printer.title(title, "");
            let boxes = printer.marks.iter().filter_map(|mark| match mark {
                Mark::Text(text, _) => Some(&text.boxes),
                _ => None,
            });
            assert!(boxes.flatten().flatten().all(|at| at.x < 401.0), "{title}");
        }
    }

    #[test]
    fn a_legend_has_room_for_all_that_a_map_shows() {
        for style in ["topographic", "climate", "geology"] {
            let style = Style::load(style).unwrap();
            let form = LegendForm::of(&style);
            let drawn = (&style, Scale { metres_per_pixel: 40.0, pixels_per_mm: 4.0 });
            let scale = drawn.1;
            let furniture = BTreeSet::from([Furniture::Legend, Furniture::Recipe]);
            let captions =
                Captions { recipe: "terrane map alps --width 90 ".repeat(6), furniture, ..Captions::default() };
            // Narrower than a column, as wide as a few columns, and as wide as everything below a map.
            for map_mm in [1, 20, 40, 70, 100, 130, 200, 300, 400] {
                let map = Area::new(-70, 30, 4 * map_mm, 200);
                for explained in 1..=form.most {
                    let place = form.below(map_mm as f64, explained);
                    let page = Sheet::area_of(map, drawn, &captions, explained);
                    let rows = place.rows(explained);
                    let columns = explained.div_ceil(rows);
                    assert!(columns <= place.columns, "{map_mm} mm: {columns} columns");
                    let east_mm = place.from_mm + columns as f64 * form.column_mm;
                    assert!(scale.pixels(east_mm) <= (page.x1 - map.x0) as f64, "{map_mm} mm: a row is cut off");
                    let last_mm = FRAME_MM + 6.0 + place.top_mm + (rows - 1) as f64 * ROW_MM;
                    let recipe = recipe_lines(&captions.recipe, map, drawn).len();
                    let first_mm = (page.y1 - map.y1) as f64 / scale.pixels(1.0) - 3.0 - LINE_MM * (recipe - 1) as f64;
                    // The last row is about as high as the letters of the recipe.
                    assert!(
                        last_mm + RECIPE_MM < first_mm,
                        "{map_mm} mm: the recipe lies over the last of {rows} rows"
                    );
                }
            }
        }
    }

    #[test]
    fn a_legend_names_the_biomes_that_the_map_shows() {
        // Without waters, which take long to find from so far.
        let text = "extends = \"climate\"\n[water]\ndraw = false\n[labels]\ndraw = false\n[places]\ndraw = false";
        let style = RecipeSources::<Style>::parse("bare.toml", text).unwrap().read_all().unwrap();
        let scale = Scale { metres_per_pixel: 2000.0, pixels_per_mm: 2.0 };
        let chart = Chart::new(&Preset::load("world").unwrap().1, None, style, scale).unwrap();
        // The ranges along a coast west of the origin.
        let map = Area::new(-1620, -440, 120, 80);
        let items = |furniture: &[Furniture]| {
            let furniture = furniture.iter().copied().collect();
            Sheet::picture(&chart, map, &furniture, &Watch::default()).unwrap().legend()
        };
        let named = |items: Vec<LegendItem>| -> Vec<String> {
            let biomes = items.into_iter().filter(|item| matches!(item, LegendItem::Class(_)));
            biomes.map(|biome| biome.about(100.0)).collect()
        };
        let shown = named(items(&[Furniture::Legend]));
        assert!(!shown.is_empty() && shown.iter().all(|name| name.contains(' ')), "{shown:?}");
        assert_eq!(named(items(&[])), [""; 0]);
    }
}
