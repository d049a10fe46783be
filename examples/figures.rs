//! Draws the figures of `docs/` from the real engine: `cargo run --release --example figures`, for all, or with names.
//!
//! Each figure is a row of panels, and each panel is a part of a world, drawn to scale over its shaded land.

use std::error::Error;
use std::fs;

use glam::{DVec2, dvec2};
use image_webp::{ColorType, WebPEncoder};
use terrane::area::{Area, Stride, TileId};
use terrane::clock::Clock;
use terrane::fluvial::Fluvial;
use terrane::fluvial::survey::Surveyed;
use terrane::grain_point::{GRAINS, Point};
use terrane::land::WaterKind;
use terrane::lines::{Imprint, Line, LineEnd, LineId, LineKind};
use terrane::map::font::Face;
use terrane::map::scale::Scale;
use terrane::map::style::Style;
use terrane::map::{Chart, text};
use terrane::preset::Preset;
use terrane::tile::{accumulation_input, shaped_input};
use terrane::world::World;
use tiny_skia::{
    Color, FillRule, LineCap, LineJoin, Paint, Path, PathBuilder, Pixmap, PixmapPaint, Rect, Stroke, Transform,
};

type Rgb = [u8; 3];

const INK: Rgb = [40, 44, 52];
const PAPER: Rgb = [252, 251, 248];
const RED: Rgb = [196, 48, 43];
const AMBER: Rgb = [232, 163, 23];
/// Colours of the levels of channels, from the trunks down.
const LEVELS: [Rgb; 5] = [[16, 58, 125], [33, 102, 172], [67, 147, 195], [120, 180, 212], [160, 202, 224]];

/// Pixels between the panels of a figure and around them.
const GAP: usize = 14;

/// Height in pixels of a line of a caption.
const LINE: usize = 21;

/// A part of the world, drawn to scale, with the lines of its caption: each has the colour that it explains, if any.
struct Panel {
    pixmap: Pixmap,
    /// North-western corner in vertices, and vertices to a pixel.
    corner: DVec2,
    vertices: f64,
    caption: Vec<(Option<Rgb>, String)>,
}

impl Panel {
    /// Creates an empty panel around a vertex.
    fn blank([x, y]: [i64; 2], vertices: i64, [width, height]: [usize; 2]) -> Panel {
        let mut pixmap = Pixmap::new(width as u32, height as u32).expect("a panel has a size");
        pixmap.fill(colour(PAPER, 1.0));
        let corner = dvec2(x as f64, y as f64) - dvec2(width as f64, height as f64) * (vertices as f64 / 2.0);
        Panel { pixmap, corner, vertices: vertices as f64, caption: Vec::new() }
    }

    /// Creates a panel of shaded land around a vertex: one pixel for each node of a stride.
    fn land(world: &World, middle: [i64; 2], vertices: u64, [width, height]: [usize; 2], light: f32) -> Panel {
        let mut panel = Panel::blank(middle, vertices as i64, [width, height]);
        let at = |axis: usize| (panel.corner[axis] / panel.vertices) as i64;
        let area = Area::new(at(0), at(1), width, height);
        let strided = world.at_stride(Stride::new(vertices).expect("strides are powers of two"));
        let land = strided.relief().land(area.padded(1), &Clock::default()).unwrap();
        // From afar land is gentler, so it is shaded as if it were steeper.
        let step_m = (2.0 * strided.spacing_m()) as f32 / (vertices as f32).sqrt().sqrt();
        let pixels = panel.pixmap.data_mut().as_chunks_mut::<4>().0;
        for ((x, y), pixel) in area.vertices().zip(pixels) {
            let height = |dx: i64, dy: i64| land.heights.at(x + dx, y + dy);
            let [east, south] = [height(1, 0) - height(-1, 0), height(0, 1) - height(0, -1)].map(|m| m / step_m);
            let shade = (0.5 * (east + south) + 0.7) / (1.0 + east * east + south * south).sqrt();
            // Few greys make a small file.
            let grey = ((light + (1.0 - light) * shade.clamp(0.0, 1.0)) * 42.0).round() * 6.0;
            let is_wet = land.water.as_ref().is_some_and(|water| water.kind.at(x, y) != WaterKind::Dry);
            *pixel = match is_wet {
                true => [146, 190, 219, 255],
                false => [grey as u8, grey as u8, (grey * 0.97) as u8, 255],
            };
        }
        panel
    }

    /// Returns the pixel of a place in vertices.
    fn pixel(&self, at: DVec2) -> DVec2 {
        (at - self.corner) / self.vertices
    }

    fn path(&self, points: impl IntoIterator<Item = DVec2>) -> Option<Path> {
        let mut path = PathBuilder::new();
        for point in points {
            let at = self.pixel(point).as_vec2();
            if path.is_empty() { path.move_to(at.x, at.y) } else { path.line_to(at.x, at.y) }
        }
        path.finish()
    }

    /// Draws a line through places in vertices.
    fn line(&mut self, points: impl IntoIterator<Item = DVec2>, rgb: Rgb, width: f32) {
        let stroke = Stroke { width, line_cap: LineCap::Round, line_join: LineJoin::Round, ..Stroke::default() };
        if let Some(path) = self.path(points) {
            self.pixmap.stroke_path(&path, &paint(rgb, 1.0), &stroke, Transform::identity(), None);
        }
    }

    /// Draws the edge of an area, and explains it in the caption.
    fn frame(&mut self, area: Area, rgb: Rgb, name: &str) {
        let [west, north, east, south] = area.edges();
        let corners = [[west, north], [east, north], [east, south], [west, south], [west, north]];
        self.line(corners.map(DVec2::from), rgb, 2.0);
        self.explain(Some(rgb), name);
    }

    /// Fills a disc around a place in vertices.
    fn disc(&mut self, at: DVec2, radius: f32, rgb: Rgb) {
        let at = self.pixel(at).as_vec2();
        let circle = PathBuilder::from_circle(at.x, at.y, radius).expect("a disc has a size");
        self.pixmap.fill_path(&circle, &paint(rgb, 1.0), FillRule::Winding, Transform::identity(), None);
    }

    /// Tints a square of `side` vertices around a place.
    fn square(&mut self, at: DVec2, side: f64, rgb: Rgb, opacity: f32) {
        let [low, high] = [-0.5, 0.5].map(|half| self.pixel(at + half * side).as_vec2());
        let square = Rect::from_ltrb(low.x, low.y, high.x, high.y).expect("a square has a size");
        self.pixmap.fill_rect(square, &paint(rgb, opacity), Transform::identity(), None);
    }

    fn explain(&mut self, rgb: Option<Rgb>, text: &str) {
        self.caption.push((rgb, text.to_string()));
    }
}

fn colour([red, green, blue]: Rgb, opacity: f32) -> Color {
    Color::from_rgba8(red, green, blue, (255.0 * opacity) as u8)
}

fn paint(rgb: Rgb, opacity: f32) -> Paint<'static> {
    let mut paint = Paint { anti_alias: true, ..Paint::default() };
    paint.set_color(colour(rgb, opacity));
    paint
}

/// Writes a text with a pale halo, from a place in pixels on.
fn write(pixmap: &mut Pixmap, text: &str, at: DVec2, face: Face, size: f32) {
    let Some(path) = text::shape(text, face, size, 0.0).at(at, 0.0).path([0; 2]) else { return };
    let halo = Stroke { width: 3.5, line_join: LineJoin::Round, ..Stroke::default() };
    pixmap.stroke_path(&path, &paint(PAPER, 0.9), &halo, Transform::identity(), None);
    pixmap.fill_path(&path, &paint(INK, 1.0), FillRule::Winding, Transform::identity(), None);
}

/// Writes a figure: panels side by side, each with its caption below.
fn save(name: &str, panels: &[Panel]) -> Result<(), Box<dyn Error>> {
    let width = panels.iter().map(|panel| panel.pixmap.width() as usize + GAP).sum::<usize>() + GAP;
    let height = panels.iter().map(|panel| panel.pixmap.height() as usize + LINE * panel.caption.len()).max();
    let height = height.unwrap_or_default() + 2 * GAP;
    let mut figure = Pixmap::new(width as u32, height as u32).expect("a figure has panels");
    figure.fill(colour(PAPER, 1.0));
    let mut left = GAP;
    for panel in panels {
        let (x, y) = (left as i32, GAP as i32);
        figure.draw_pixmap(x, y, panel.pixmap.as_ref(), &PixmapPaint::default(), Transform::identity(), None);
        for (row, (rgb, text)) in panel.caption.iter().enumerate() {
            let line = (GAP + panel.pixmap.height() as usize + LINE * (row + 1)) as f64;
            if let Some(rgb) = rgb {
                let swatch = Rect::from_xywh(left as f32, line as f32 - 8.0, 20.0, 5.0).expect("a swatch has a size");
                figure.fill_rect(swatch, &paint(*rgb, 1.0), Transform::identity(), None);
            }
            let indent = if rgb.is_some() { 28.0 } else { 0.0 };
            write(&mut figure, text, dvec2(left as f64 + indent, line), Face::Regular, 16.0);
        }
        left += panel.pixmap.width() as usize + GAP;
    }
    let pixels: Vec<u8> = figure.pixels().iter().flat_map(|pixel| [pixel.red(), pixel.green(), pixel.blue()]).collect();
    let mut bytes = Vec::new();
    WebPEncoder::new(&mut bytes).encode(&pixels, width as u32, height as u32, ColorType::Rgb8)?;
    println!("docs/{name}.webp: {width} x {height}, {} kB", bytes.len() / 1000);
    Ok(fs::write(format!("docs/{name}.webp"), bytes)?)
}

/// Returns the place in vertices of a point of the network.
fn placed(fluvial: &Fluvial, point: Point) -> DVec2 {
    let Point { x, y } = fluvial.in_world(point);
    dvec2(x as f64, y as f64) / GRAINS as f64
}

/// Draws all channels of some levels, the smallest first.
fn draw_channels(panel: &mut Panel, fluvial: &Fluvial, levels: u32) {
    let size = dvec2(f64::from(panel.pixmap.width()), f64::from(panel.pixmap.height())) * panel.vertices;
    let corners = [panel.corner, panel.corner + size].map(|at| Point::at_vertex(at.x as i64, at.y as i64));
    for level in (0..levels).rev() {
        let rgb = LEVELS[level as usize];
        fluvial.network().channels(level, corners, |channel| {
            let area = channel.knots.iter().map(|knot| knot.area).fold(0.0, f64::max);
            let width = (1.6 + 0.5 * area.sqrt()).min(4.0) / f64::from(level + 1).sqrt();
            panel.line(channel.knots.iter().map(|knot| placed(fluvial, knot.at)), rgb, width as f32);
        });
    }
}

/// Rivers come first: the lattice of trunks, the tributaries level by level, and the land that follows from them.
fn rivers() -> Result<(), Box<dyn Error>> {
    const SIZE: [usize; 2] = [380, 380];
    let world = World::new(Preset::load("highlands")?.1, None)?;
    let fluvial = world.relief().fluvial().expect("highlands are fluvial");
    let side = fluvial.fields().side(0) / GRAINS;
    let middle = [12 * side, 3 * side];
    let vertices = 16;
    let mut lattice = Panel::blank(middle, vertices, SIZE);
    let nodes = fluvial.network().trunks().look();
    let cells = (8..16).flat_map(|x| (-1..7).map(move |y| (x, y)));
    for id in cells.clone() {
        let corner = |dx: i64, dy: i64| dvec2(((id.0 + dx) * side) as f64, ((id.1 + dy) * side) as f64);
        lattice.line([corner(0, 1), corner(0, 0), corner(1, 0)], [215, 213, 208], 1.0);
    }
    for id in cells.clone() {
        let drained = nodes.drained(id);
        if let Some(next) = drained.to {
            let ends = [id, next].map(|id| placed(fluvial, nodes.node(id).at));
            lattice.line(ends, LEVELS[0], (1.0 + 0.5 * f64::from(drained.area).sqrt()).min(4.0) as f32);
        }
    }
    cells.for_each(|id| lattice.disc(placed(fluvial, nodes.node(id).at), 3.5, INK));
    lattice.explain(None, "1. A node in each cell drains to its lowest neighbour:");
    lattice.explain(Some(LEVELS[0]), "trunks, thicker with the land they drain.");
    let mut network = Panel::blank(middle, vertices, SIZE);
    draw_channels(&mut network, fluvial, 3);
    network.explain(None, "2. Tributaries join what is already there:");
    network.explain(Some(LEVELS[1]), "level 1, on a lattice of smaller cells");
    network.explain(Some(LEVELS[2]), "level 2, and so on down to the brooks.");
    let mut land = Panel::land(&world, middle, vertices as u64, SIZE, 0.25);
    land.explain(None, "3. Hillsides rise from all channels. Where two");
    land.explain(None, "of them meet is a ridge.");
    save("rivers", &[lattice, network, land])
}

/// A tile needs no neighbour: the areas that its stages read, drawn to scale.
fn tiles() -> Result<(), Box<dyn Error>> {
    const SIZE: [usize; 2] = [420, 420];
    let world = World::new(Preset::load("alps")?.1, None)?;
    let fluvial = world.relief().fluvial().expect("alps are fluvial");
    let id = TileId { x: 3, y: 5 };
    let tile = id.area(world.tile_cells());
    let middle = [i64::midpoint(tile.x0, tile.x1), i64::midpoint(tile.y0, tile.y1)];
    let shaped = shaped_input(&world, tile);
    let mut near = Panel::land(&world, middle, 1, SIZE, 0.45);
    near.frame(accumulation_input(tile), LEVELS[0], "land from which water flows to the tile's vertices");
    near.frame(Imprint::input(shaped), LEVELS[2], "land around the roads that are built into it");
    near.frame(shaped, AMBER, "shaped land, for ground cover and normals");
    near.frame(tile, RED, "the tile: 256 x 256 cells, 2.6 km");
    let mut far = Panel::land(&world, middle, 32, SIZE, 0.45);
    draw_channels(&mut far, fluvial, 2);
    let corners = [(shaped.x0, shaped.y0), (shaped.x1, shaped.y1)].map(|(x, y)| Point::at_vertex(x, y));
    // Squares of the finest levels are hardly larger than the tile.
    for level in 0..LEVELS.len() as u32 {
        let [low, high] = fluvial.network().input(level, corners).map(|at| [at.x / GRAINS, at.y / GRAINS]);
        let area = Area { x0: low[0], y0: low[1], x1: high[0], y1: high[1] };
        far.frame(area, LEVELS[level as usize], &format!("heads of channels of level {level}"));
    }
    far.frame(tile, RED, "the same tile");
    save("tiles", &[near, far])
}

/// Roads are planned: the coarse lattice, the corridor that was found on it, and the road.
fn roads() -> Result<(), Box<dyn Error>> {
    let world = World::new(Preset::load("alps")?.1, None)?;
    let (fluvial, places) = world.relief().fluvial().zip(world.places()).expect("alps have roads");
    // The longest road that runs whole from one settlement to another and fits the figure.
    let area = Area::new(0, 0, 3000, 3000);
    let is_whole = |line: &Line| matches!((line.id, line.end), (LineId::Road { part: 0, .. }, LineEnd::Site(_)));
    let mut roads = world.lines_through(LineKind::Road, &area, &Clock::default()).unwrap();
    roads.retain(|line| is_whole(line) && line.bounds.width() < 760 && line.bounds.height() < 460);
    let road = roads.into_iter().max_by_key(|line| line.points.len()).expect("a road lies there");
    let LineId::Road { from, to, .. } = road.id else { unreachable!("a road has the id of one") };
    let corridor = places.corridor(Surveyed { survey: fluvial, clock: &Clock::default() }, [from, to]).unwrap();
    let step = corridor.windows(2).map(|pair| pair[1][0] - pair[0][0]).filter(|step| *step > 0).min().unwrap_or(1);
    let bounds = road.bounds;
    let middle = [i64::midpoint(bounds.x0, bounds.x1), i64::midpoint(bounds.y0, bounds.y1)];
    let size = [bounds.width() + 200, bounds.height() + 120];
    let mut panel = Panel::land(&world, middle, 1, size, 0.35);
    for [x, y] in &corridor {
        panel.square(dvec2(*x as f64, *y as f64), step as f64, AMBER, 0.45);
    }
    let nodes = Area::new(middle[0], middle[1], 1, 1).padded(size[0].max(size[1])).square_numbers(step);
    for [x, y] in nodes.collect::<Vec<_>>() {
        panel.disc(dvec2((x * step) as f64, (y * step) as f64), 1.2, [110, 110, 110]);
    }
    let points: Vec<DVec2> = road.points.iter().map(|point| road.place_from([0, 0], point)).map(DVec2::from).collect();
    panel.line(points.iter().copied(), PAPER, 6.0);
    panel.line(points, RED, 3.5);
    for site in [from, to].into_iter().filter_map(|id| world.site(id, &Clock::default()).unwrap()) {
        let at = DVec2::from(site.at.map(|at| at as f64));
        panel.disc(at, 7.0, INK);
        panel.disc(at, 4.0, PAPER);
        let pixel = panel.pixel(at) + dvec2(11.0, -7.0);
        write(&mut panel.pixmap, &site.name, pixel, Face::Semibold, 19.0);
    }
    let metres = step as f64 * world.spacing_m();
    panel.explain(Some([110, 110, 110]), &format!("nodes of the coarse plan, {metres} m apart"));
    panel.explain(Some(AMBER), "corridor: nodes through which a route costs little more than the best");
    panel.explain(Some(RED), "the road, searched on nodes half as far apart and within the corridor alone");
    save("roads", &[panel])
}

/// A label does not depend on the window: two windows of one map, whose common part has the same pixels.
fn labels() -> Result<(), Box<dyn Error>> {
    let (scale, clock) = (Scale { metres_per_pixel: 25.0, pixels_per_mm: 6.0 }, Clock::default());
    let chart = Chart::new(&Preset::load("archipelago")?.1, None, Style::load("topographic")?, scale)?;
    let first = Area::new(-100, -100, 430, 330);
    let windows = [first, Area { x0: first.x0 + 150, x1: first.x1 + 150, y0: first.y0 + 70, y1: first.y1 + 70 }];
    let common = windows[0].common(&windows[1]).expect("the windows overlap");
    let pictures = windows.map(|window| chart.picture(window, &clock).unwrap());
    assert_eq!(pictures[0].pixels(common, &clock)?, pictures[1].pixels(common, &clock)?);
    let panels = pictures.map(|picture| {
        let area = picture.area();
        let mut panel = Panel::blank([0, 0], 1, [area.width(), area.height()]);
        panel.corner = dvec2(area.x0 as f64, area.y0 as f64);
        let pixels = picture.pixels(area, &clock).unwrap();
        for (to, from) in panel.pixmap.data_mut().as_chunks_mut::<4>().0.iter_mut().zip(pixels.chunks(3)) {
            to[..3].copy_from_slice(from);
        }
        panel.frame(common, RED, "the part that both windows show");
        panel
    });
    save("labels", &panels)
}

fn main() -> Result<(), Box<dyn Error>> {
    let wanted: Vec<String> = std::env::args().skip(1).collect();
    let is_wanted = |name: &str| wanted.is_empty() || wanted.iter().any(|other| other == name);
    for (name, draw) in [("rivers", rivers as fn() -> _), ("tiles", tiles), ("roads", roads), ("labels", labels)] {
        if is_wanted(name) {
            draw()?;
        }
    }
    Ok(())
}
