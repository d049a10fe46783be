//! Charts: maps of a world in one style and scale, drawn block by block.
//!
//! A block is a square of the scale's pixels and a pure function of its place, so a map drawn at once, in strips, in sheets or
//! in tiles of a web map is the same.

use rayon::prelude::*;
use tiny_skia::{Color, FillRule, LineCap, LineJoin, Paint, Path, PathBuilder, Pixmap, Stroke, StrokeDash, Transform};

use crate::area::Area;
use crate::error::Error;
use crate::lines::RoadClass;
use crate::map::contour::{contours, interval_m, shores};
use crate::map::drawing::{Draughtsman, Drawing, Shape};
use crate::map::names::{self, Writing, symbol_mm};
use crate::map::relief::{Ground, Relief};
use crate::map::scale::Scale;
use crate::map::style::{Colour, Style};
use crate::map::summits::Summits;
use crate::map::terrain::{self, Terrain};
use crate::places::site::SiteClass;
use crate::preset::Preset;
use crate::world::World;

/// Pixels a side of a block.
const BLOCK: i64 = 512;

/// Pixels that a line may be wide at most, half on each side: what lies so far from a block may reach into it.
const WIDEST: f64 = 64.0;

/// Maps of a world in one style and scale.
#[derive(Debug)]
pub struct Chart {
    style: Style,
    scale: Scale,
    terrain: Terrain,
    relief: Relief,
    settled: Option<World>,
    summits: Option<Summits>,
    interval_m: f64,
}

/// A part of a chart, whose lines and names are known.
#[derive(Debug)]
pub struct Picture<'a> {
    chart: &'a Chart,
    area: Area,
    drawing: Drawing,
    writings: Vec<Writing>,
}

impl Chart {
    /// Pixels that a strip is high at most.
    pub const STRIP: usize = BLOCK as usize;

    /// Bytes of land that a chart remembers at most.
    pub const REMEMBERED: usize = 2 * terrain::REMEMBERED;

    /// The maps of the world of a preset, with the preset's own seed unless another is given.
    ///
    /// # Errors
    /// When a value of the preset is out of its range.
    pub fn new(preset: &Preset, seed: Option<u64>, style: Style, scale: Scale) -> Result<Chart, Error> {
        let stride = scale.stride(preset.spacing_m);
        let terrain = Terrain::new(World::strided(preset.clone(), seed, stride)?, scale);
        let denominator = scale.denominator();
        let relief = Relief::new(&style, &terrain, denominator, scale.metres_per_pixel);
        // Nodes from afar know of no settlements.
        let least = style.roads.classes.iter().map(|class| class.most).fold(0.0, f64::max);
        let is_settled = preset.places.is_some() && denominator <= least;
        let settled = is_settled.then(|| World::new(preset.clone(), seed)).transpose()?;
        let (low_m, high_m) = terrain.world().height_range_m();
        let range_m = f64::from(high_m - low_m.max(preset.sea_level_m.map_or(low_m, |level| level as f32)));
        let interval_m =
            style.contours.interval_m.unwrap_or_else(|| interval_m(denominator, style.contours.spacing_mm, range_m));
        let has_peaks = style.labels.draw && preset.fluvial.is_some();
        let summits = has_peaks.then(|| Summits::new(preset, seed, scale)).transpose()?;
        Ok(Chart { style, scale, terrain, relief, settled, summits, interval_m })
    }

    /// The scale of the maps.
    pub fn scale(&self) -> Scale {
        self.scale
    }

    /// Metres from a contour to the next.
    pub fn interval_m(&self) -> f64 {
        self.interval_m
    }

    /// The picture of an area of pixels.
    pub fn picture(&self, area: Area) -> Picture<'_> {
        let draughtsman = Draughtsman {
            style: &self.style,
            scale: self.scale,
            world: self.terrain.world(),
            settled: self.settled.as_ref(),
        };
        let pad = if self.style.labels.draw { names::pad(self.scale) } else { WIDEST as usize };
        let drawing = draughtsman.draw(area.padded(pad));
        let mut writings = Vec::new();
        if self.style.labels.draw {
            let summits =
                self.summits.iter().flat_map(|summits| summits.find(self.scale, area.padded(pad))).collect::<Vec<_>>();
            writings = names::write(&self.style, self.scale, &drawing, &summits, area);
        }
        Picture { chart: self, area, drawing, writings }
    }
}

impl Picture<'_> {
    /// The pixels that it shows.
    pub fn area(&self) -> Area {
        self.area
    }

    /// Hands on the picture in strips of whole rows, from north to south: RGB, row by row.
    ///
    /// # Errors
    /// When `write` fails.
    pub fn strips<E>(&self, mut write: impl FnMut(&[u8]) -> Result<(), E>) -> Result<(), E> {
        let rows = self.area.y0.div_euclid(BLOCK)..=(self.area.y1 - 1).div_euclid(BLOCK);
        rows.map(|row| Area { y0: row * BLOCK, y1: (row + 1) * BLOCK, ..self.area })
            .filter_map(|strip| strip.common(&self.area))
            .try_for_each(|strip| write(&self.pixels(strip)))
    }

    /// The pixels of a part of it: RGB, row by row.
    ///
    /// # Panics
    /// When it is not within the picture.
    pub fn pixels(&self, part: Area) -> Vec<u8> {
        assert!(self.area.contains(&part), "a picture knows what it shows and no more");
        let span = |from: i64, to: i64| from.div_euclid(BLOCK)..=(to - 1).div_euclid(BLOCK);
        let columns = span(part.x0, part.x1);
        let places: Vec<[i64; 2]> =
            span(part.y0, part.y1).flat_map(|row| columns.clone().map(move |column| [column, row])).collect();
        let blocks: Vec<(Area, Vec<u8>)> =
            places.par_iter().map(|[column, row]| self.block(part, *column, *row)).collect();
        let mut pixels = vec![0; part.len() * 3];
        let bytes = part.width() * 3;
        for (area, block) in &blocks {
            let left = (area.x0 - part.x0) as usize * 3;
            let lines = pixels.chunks_exact_mut(bytes).skip((area.y0 - part.y0) as usize);
            for (line, block) in lines.zip(block.chunks_exact(area.width() * 3)) {
                line[left..left + block.len()].copy_from_slice(block);
            }
        }
        pixels
    }

    /// The pixels of a block that lie in a part.
    fn block(&self, part: Area, column: i64, row: i64) -> (Area, Vec<u8>) {
        let block = Area::new(column * BLOCK, row * BLOCK, BLOCK as usize, BLOCK as usize);
        let seen = block.common(&part).expect("the block was chosen by the area");
        let ground = self.chart.relief.ground(&self.chart.terrain, block);
        let mut canvas = Canvas::new(&ground);
        self.draw(&ground, &mut canvas);
        let mut pixels = Vec::with_capacity(seen.len() * 3);
        for y in seen.y0..seen.y1 {
            let start = ((y - block.y0) * BLOCK + seen.x0 - block.x0) as usize;
            for pixel in &canvas.pixmap.pixels()[start..start + seen.width()] {
                pixels.extend([pixel.red(), pixel.green(), pixel.blue()]);
            }
        }
        (seen, pixels)
    }

    /// Draws all lines over the ground.
    fn draw(&self, ground: &Ground, canvas: &mut Canvas) {
        let (style, scale, drawing) = (&self.chart.style, &self.chart.scale, &self.drawing);
        if style.contours.draw {
            self.draw_contours(ground, canvas);
        }
        let line = |colour: Colour, mm: f64| Pen { colour, opacity: 1.0, width: scale.pixels(mm) as f32, dash: None };
        for lake in &drawing.lakes {
            canvas.fill(&lake.shape, style.water.fill);
        }
        for river in &drawing.rivers {
            if !canvas.sees(river.bounds) {
                continue;
            }
            for (width, part) in &river.parts {
                let pen = Pen { colour: style.water.line, opacity: 1.0, width: *width as f32, dash: None };
                canvas.stroke(std::slice::from_ref(part), &pen);
            }
        }
        let shore = line(style.water.line, style.water.shore_mm);
        for lake in &drawing.lakes {
            canvas.stroke_shape(&lake.shape, &shore);
        }
        if let Some(level) = self.chart.terrain.world().preset().sea_level_m.filter(|_| style.water.draw) {
            let moved = |[x, y]: [f64; 2]| [x + ground.area.x0 as f64, y + ground.area.y0 as f64];
            let coasts: Vec<Vec<[f64; 2]>> = shores(&ground.heights, ground.area, level as f32)
                .into_iter()
                .map(|line| line.into_iter().map(moved).collect())
                .collect();
            canvas.stroke(&coasts, &shore);
        }
        let class = |class: RoadClass| &style.roads.classes[2 - class as usize];
        for (of, tunnel) in &drawing.tunnels {
            let mut pen = line(style.roads.casing, class(*of).width_mm * 0.5);
            pen.dash = Some([scale.pixels(0.6) as f32, scale.pixels(0.4) as f32]);
            canvas.stroke_shape(tunnel, &pen);
        }
        for (of, bridge) in &drawing.bridges {
            canvas.stroke_shape(bridge, &line(style.roads.casing, class(*of).width_mm + 4.0 * class(*of).casing_mm));
        }
        for (of, road) in &drawing.roads {
            let road_style = class(*of);
            canvas.stroke_shape(road, &line(style.roads.casing, road_style.width_mm + 2.0 * road_style.casing_mm));
        }
        for (of, road) in &drawing.roads {
            canvas.stroke_shape(road, &line(class(*of).colour, class(*of).width_mm));
        }
        for site in &drawing.sites {
            let at = [site.at[0], -site.at[1]].map(|metres| metres / scale.metres_per_pixel);
            let radius = scale.pixels(symbol_mm(site.class));
            canvas.dot(at, radius, style.places.colour);
            canvas.dot(at, radius - scale.pixels(0.2), style.places.fill);
            if site.class == SiteClass::Town {
                canvas.dot(at, radius - scale.pixels(0.45), style.places.colour);
            }
        }
        for writing in &self.writings {
            if let Some([x, y]) = writing.peak {
                let (half, up) = (scale.pixels(0.5), scale.pixels(0.55));
                let triangle =
                    vec![[x - half, y + 0.6 * up], [x, y - up], [x + half, y + 0.6 * up], [x - half, y + 0.6 * up]];
                canvas.fill(&Shape::new(vec![triangle]), writing.style.colour);
            }
        }
        let halo = scale.pixels(2.0 * style.labels.halo_mm) as f32;
        for writing in &self.writings {
            canvas.write(writing, Some((style.labels.halo, halo)));
        }
        for writing in &self.writings {
            canvas.write(writing, None);
        }
    }

    fn draw_contours(&self, ground: &Ground, canvas: &mut Canvas) {
        let (style, sea_level_m) = (&self.chart.style.contours, self.chart.terrain.world().preset().sea_level_m);
        let sea_level_m = sea_level_m.map_or(f32::NEG_INFINITY, |level| level as f32);
        for line in contours(&ground.heights, ground.area, self.chart.interval_m, sea_level_m) {
            let mm = if line.is_index() { style.index_width_mm } else { style.width_mm };
            let [x, y] = [ground.area.x0 as f64, ground.area.y0 as f64];
            // In runs on snow and off it, which overlap by a point.
            let is_snow = |[x, y]: [f64; 2]| {
                let at = [x, y].map(|axis| (axis as i64).clamp(0, BLOCK - 1));
                ground.snow.at(ground.area.x0 + at[0], ground.area.y0 + at[1]) > 0.5
            };
            let mut run = Vec::new();
            let mut on_snow = is_snow(line.points[0]);
            let mut draw = |run: &mut Vec<[f64; 2]>, on_snow: bool| {
                let colour = if on_snow { style.on_snow } else { style.colour };
                let pen = Pen {
                    colour,
                    opacity: style.opacity as f32,
                    width: self.chart.scale.pixels(mm) as f32,
                    dash: None,
                };
                canvas.stroke(std::slice::from_ref(run), &pen);
                run.drain(..run.len() - 1);
            };
            for point in &line.points {
                run.push([point[0] + x, point[1] + y]);
                if is_snow(*point) != on_snow {
                    draw(&mut run, on_snow);
                    on_snow = !on_snow;
                }
            }
            draw(&mut run, on_snow);
        }
    }
}

/// How a line is drawn.
struct Pen {
    colour: Colour,
    opacity: f32,
    width: f32,
    dash: Option<[f32; 2]>,
}

/// A block that is drawn on.
struct Canvas {
    pixmap: Pixmap,
    corner: [f64; 2],
}

impl Canvas {
    fn new(ground: &Ground) -> Canvas {
        let mut pixmap = Pixmap::new(BLOCK as u32, BLOCK as u32).expect("a block has a size");
        for (bytes, pixel) in pixmap.data_mut().as_chunks_mut::<4>().0.iter_mut().zip(&ground.pixels) {
            let [red, green, blue, _] = pixel.to_le_bytes();
            *bytes = [red, green, blue, 255];
        }
        Canvas { pixmap, corner: [ground.area.x0 as f64, ground.area.y0 as f64] }
    }

    /// Whether something that spans so much may be seen on the block.
    fn sees(&self, [west, north, east, south]: [f64; 4]) -> bool {
        let [x, y] = self.corner;
        let side = BLOCK as f64 + WIDEST;
        east > x - WIDEST && west < x + side && south > y - WIDEST && north < y + side
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

    fn fill(&mut self, shape: &Shape, colour: Colour) {
        if !self.sees(shape.bounds) {
            return;
        }
        if let Some(path) = self.path(&shape.lines) {
            let paint = Canvas::paint(colour, 1.0);
            self.pixmap.fill_path(&path, &paint, FillRule::EvenOdd, Transform::identity(), None);
        }
    }

    fn stroke_shape(&mut self, shape: &Shape, pen: &Pen) {
        if self.sees(shape.bounds) {
            self.stroke(&shape.lines, pen);
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

    /// Writes names, or what is around their letters: a line of a colour and a width.
    fn write(&mut self, writing: &Writing, halo: Option<(Colour, f32)>) {
        for text in &writing.texts {
            let points = || text.boxes.iter().flatten();
            let bounds = points().fold([f64::MAX, f64::MAX, f64::MIN, f64::MIN], |[w, n, e, s], [x, y]| {
                [w.min(*x), n.min(*y), e.max(*x), s.max(*y)]
            });
            if !self.sees(bounds) {
                continue;
            }
            let Some(path) = text.path(self.corner.map(|axis| axis as i64)) else { continue };
            if let Some((colour, width)) = halo {
                let stroke = Stroke { width, line_join: LineJoin::Round, ..Stroke::default() };
                self.pixmap.stroke_path(&path, &Canvas::paint(colour, 0.85), &stroke, Transform::identity(), None);
            } else {
                let paint = Canvas::paint(writing.style.colour, 1.0);
                self.pixmap.fill_path(&path, &paint, FillRule::Winding, Transform::identity(), None);
            }
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
