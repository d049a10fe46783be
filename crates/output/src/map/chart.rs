//! Charts: maps of a world in one style and scale, drawn block by block.
//!
//! A block is a square of the scale's pixels, and its content depends only on its place. So a map is the same whether
//! it is drawn at once, in strips, in sheets or in tiles of a web map.

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::DVec2;
use rayon::prelude::*;

use crate::area::{Area, Stride};
use crate::clock::Clock;
use crate::device::{Cpu, LandMaker};
use crate::error::Error;
use crate::features::sites::SiteFeature;
use crate::lines::RoadClass;
use crate::map::canvas::Canvas;
use crate::map::contour_lines::interval_m;
use crate::map::drawing::{Draughtsman, Drawing, Strokes};
use crate::map::frame::MapFrame;
use crate::map::names::{self, Finders, Writing};
use crate::map::outlines::{GroundLine, Outlines, SQUARE};
use crate::map::plotter::{Inscription, Item, Page, PageLayer, Pen, Plotter, Shape, WIDEST, bounds};
use crate::map::ranges::Afar;
use crate::map::realms;
use crate::map::relief::{GroundPixels, ShadedRelief};
use crate::map::scale::Scale;
use crate::map::sheet::LegendItem;
use crate::map::style::{Colour, Style, TintBy};
use crate::map::summits::PeakSource;
use crate::map::symbols::{draw_peak, draw_site};
use crate::map::terrain::{self, LandClass, MapTerrain};
use crate::map::text::Quad;
use crate::memory::Budget;
use crate::places::site::SiteClass;
use crate::preset::Preset;
use crate::stop::Stopped;
use crate::watch::Watch;
use crate::world::World;

/// Side of a block in pixels.
const BLOCK: i64 = 512;

/// Width from which on a river has banks, as a multiple of the width of the largest river that is a line.
const BANKS: f64 = 1.5;

/// Largest number of vertices per pixel at which the lines of agents are drawn.
const AGENTS: f64 = 8.0;

/// Square millimetres on paper of the least land of a class that a legend explains.
const LEAST_CLASS_MM2: f64 = 1.0;

/// Maps of a world in one style and scale.
#[derive(Debug)]
pub struct Chart {
    style: Style,
    scale: Scale,
    terrain: Arc<MapTerrain>,
    relief: ShadedRelief,
    /// The world at all vertices, with the places, roads and lines of agents that are drawn: a world at coarse nodes
    /// has none. `has_lines` is true if its lines are drawn.
    world: Arc<World>,
    has_lines: bool,
    detail: ChartDetail,
    interval_m: f64,
}

/// Parts of a chart that a sketch leaves out.
#[derive(Clone, Debug, Default)]
struct ChartDetail {
    /// Sources of the names of peaks, and of ranges and valleys.
    summits: Option<Arc<PeakSource>>,
    afar: Option<Arc<Afar>>,
    /// True if the chart leaves out small things.
    is_sketch: bool,
}

/// A part of a chart, with its lines and names, ready to be drawn.
#[derive(Debug)]
pub struct Picture {
    chart: Arc<Chart>,
    area: Area,
    drawing: Drawing,
    writings: Vec<Writing>,
    /// The frame around the picture, if it has one.
    frame: Option<MapFrame>,
    /// The classes of land that the legend of the picture explains.
    classes: Vec<LandClass>,
}

#[expect(clippy::missing_errors_doc, reason = "the only error of what takes a clock is that this stops it")]
impl Chart {
    /// Largest height of a strip in pixels.
    pub const STRIP: usize = BLOCK as usize;

    /// Largest number of bytes that a [world](Chart::world) and all charts of it remember, if they share no other
    /// budget.
    pub const REMEMBERED: usize = 2 * terrain::REMEMBERED;

    /// Returns the largest number of bytes that such a [world](Chart::world) and a chart of it remember, for `nodes` nodes
    /// of land a side. Land is remembered in patches, which reach beyond the edge.
    pub fn remembered_bytes(world: &World, nodes: [u64; 2]) -> u64 {
        // The world at all vertices, and the worlds at the nodes of land, of summits and of ranges. Land of noise is not
        // remembered, and only the first world has agents.
        let worlds = if world.relief().fluvial().is_some() { 4 } else { 1 };
        let sides = nodes.map(|side| side.saturating_add(2 * u64::from(MapTerrain::TILE_CELLS)));
        let land = sides[0].saturating_mul(sides[1]).saturating_mul(terrain::NODE_BYTES);
        land.saturating_add(worlds * world.memory_bytes(1)).min(Chart::REMEMBERED as u64)
    }

    /// Returns the largest number of bytes of memory that a picture of `width` x `height` pixels takes on `threads`
    /// threads while `rows` rows are held at once: those besides what is remembered, and those that are remembered.
    pub fn memory(world: &World, scale: Scale, [width, height]: [usize; 2], rows: usize, threads: usize) -> [u64; 2] {
        // Bytes a pixel of a block, with what lies around the block: heights, lights, colours, weights and a canvas.
        const DRAWN_BYTES: u64 = 128;
        // Bytes a pixel of a strip: of the blocks that it is put together from, and of the strip itself.
        const HELD_BYTES: u64 = 8;
        let node = scale.stride(world.preset().spacing_m).vertices() as f64 * world.preset().spacing_m;
        let nodes = [width, height].map(|side| (side as f64 * scale.metres_per_pixel / node) as u64);
        let drawn = threads as u64 * (BLOCK * BLOCK) as u64 * DRAWN_BYTES;
        let held = (width as u64).saturating_mul(rows as u64).saturating_mul(HELD_BYTES);
        [held.saturating_add(drawn), Chart::remembered_bytes(world, nodes)]
    }

    /// Creates the chart of the world of a preset, with the preset's own seed unless another is given.
    ///
    /// # Errors
    /// When a value of the preset is out of its range, or the world lacks what the style shows.
    pub fn new(preset: &Preset, seed: Option<u64>, style: Style, scale: Scale) -> Result<Arc<Chart>, Error> {
        let world = Chart::world(preset, seed)?;
        style.check_for(&world)?;
        Ok(Clock::unstopped(|clock| Chart::of_world(&world, style, scale, clock)))
    }

    /// Creates the world at all its vertices, which charts of any scale share, with a memory that they share too.
    ///
    /// # Errors
    /// When a value of the preset is out of its range.
    pub fn world(preset: &Preset, seed: Option<u64>) -> Result<Arc<World>, Error> {
        Chart::world_within(preset, seed, &Budget::new(Chart::REMEMBERED))
    }

    /// Creates the same world, within a budget of memory that others may share.
    ///
    /// # Errors
    /// When a value of the preset is out of its range.
    pub fn world_within(preset: &Preset, seed: Option<u64>, budget: &Arc<Budget>) -> Result<Arc<World>, Error> {
        let world = World::new(preset.clone(), seed)?.with_tile_cells(MapTerrain::TILE_CELLS);
        Ok(Arc::new(world.within(budget)))
    }

    /// Creates the chart of such a [world](Chart::world), which must have [what the style shows](Style::check_for).
    pub fn of_world(world: &Arc<World>, style: Style, scale: Scale, clock: &Clock) -> Result<Arc<Chart>, Stopped> {
        Chart::made_by(|world| Ok(Cpu::maker(world.relief())), world, style, scale, clock)
    }

    /// Creates the chart of such a [world](Chart::world), which must have [what the style shows](Style::check_for). `maker` returns the land maker for the land that is lit.
    ///
    /// # Errors
    /// When `maker` fails, or `clock` stops the work.
    pub fn made_by<E: From<Stopped>>(
        maker: impl FnOnce(&World) -> Result<Arc<dyn LandMaker>, E>,
        world: &Arc<World>,
        style: Style,
        scale: Scale,
        clock: &Clock,
    ) -> Result<Arc<Chart>, E> {
        let stride = scale.stride(world.preset().spacing_m);
        let strided = if stride == Stride::ONE {
            Arc::clone(world)
        } else {
            Arc::new(world.at_stride(stride).with_tile_cells(MapTerrain::TILE_CELLS))
        };
        let maker = maker(&strided)?;
        let terrain = Arc::new(MapTerrain::new(strided, maker, scale));
        let is_fluvial = world.preset().fluvial.is_some();
        let summits = is_fluvial.then(|| Arc::new(PeakSource::new(Arc::clone(world), scale)));
        let has_ranges = is_fluvial && Afar::is_of_use(world, scale) && !realms::are_named(world, scale);
        let afar = has_ranges.then(|| Arc::new(Afar::new(world, scale)));
        let detail = ChartDetail { summits, afar, is_sketch: false };
        Ok(Chart::drawn(Arc::clone(world), terrain, detail, style, scale, clock)?)
    }

    /// Creates a sketch of such a [world](Chart::world), for whoever will not wait for the full map. Its land has nodes
    /// that lie 2^`halvings` times as far apart, and it leaves out narrow lakes and the names of peaks, ranges and
    /// valleys.
    pub fn sketch(
        world: &Arc<World>,
        style: Style,
        scale: Scale,
        halvings: u32,
        clock: &Clock,
    ) -> Result<Arc<Chart>, Stopped> {
        let stride = (0..halvings).fold(scale.stride(world.preset().spacing_m), |stride, _| stride.twice());
        let tile_cells = MapTerrain::sketch_tile_cells(halvings);
        let strided = Arc::new(world.sketch_at_stride(stride).with_tile_cells(tile_cells));
        let maker = Cpu::maker(strided.relief());
        let terrain = Arc::new(MapTerrain::new(strided, maker, scale));
        let detail = ChartDetail { is_sketch: true, ..ChartDetail::default() };
        Chart::drawn(Arc::clone(world), terrain, detail, style, scale, clock)
    }

    /// Returns the maker of the land that is lit.
    pub fn maker(&self) -> &dyn LandMaker {
        self.terrain.maker()
    }

    /// Returns the chart of the same world in the same scale and in another style.
    pub fn in_style(&self, style: Style, clock: &Clock) -> Result<Arc<Chart>, Stopped> {
        Chart::drawn(Arc::clone(&self.world), Arc::clone(&self.terrain), self.detail.clone(), style, self.scale, clock)
    }

    fn drawn(
        world: Arc<World>,
        terrain: Arc<MapTerrain>,
        detail: ChartDetail,
        style: Style,
        scale: Scale,
        clock: &Clock,
    ) -> Result<Arc<Chart>, Stopped> {
        let denominator = scale.denominator();
        let relief = ShadedRelief::new(&style, terrain.world(), scale);
        let least = style.roads.classes.iter().map(|class| class.most).fold(0.0, f64::max);
        // Agents go everywhere, and their lines are short: at small scales there would be many lines, too short to be
        // seen.
        let has_lines = match world.preset().places {
            Some(_) => denominator <= least,
            None => scale.metres_per_pixel <= AGENTS * world.preset().spacing_m,
        };
        let steepness =
            if style.contours.draw && style.contours.interval_m.is_none() { terrain.steepness(clock)? } else { 1.0 };
        let chosen_m = interval_m(denominator, style.contours.spacing_mm, steepness, relief.range_m());
        let interval_m = style.contours.interval_m.unwrap_or(chosen_m);
        Ok(Arc::new(Chart { style, scale, terrain, relief, world, has_lines, detail, interval_m }))
    }

    /// Returns the scale of the maps.
    pub fn scale(&self) -> Scale {
        self.scale
    }

    /// Returns the style of the maps.
    pub fn style(&self) -> &Style {
        &self.style
    }

    /// Returns the contour interval in metres.
    pub fn interval_m(&self) -> f64 {
        self.interval_m
    }

    /// Returns the heights of the land in metres in the middles of the pixels of an area, row by row from the north.
    pub fn heights_m(&self, area: Area, clock: &Clock) -> Result<Vec<f32>, Stopped> {
        let nodes = self.terrain.nodes(area, clock)?;
        Ok(self.terrain.at_pixels(&nodes.heights, area).values().to_vec())
    }

    /// Returns the picture of an area of pixels, a part of a map without end: names may go on beyond its edges.
    pub fn picture(self: &Arc<Self>, area: Area, clock: &Clock) -> Result<Picture, Stopped> {
        self.drawn_picture(area, None, &Watch::stopped_by(clock.stop()))
    }

    /// Returns the picture of an area of pixels with a frame around it: no name crosses the frame, and what lies beyond
    /// has no name.
    pub fn framed_picture(self: &Arc<Self>, area: Area, clock: &Clock) -> Result<Picture, Stopped> {
        let frame = MapFrame::new(area, self.scale);
        self.drawn_picture(area, Some(frame), &Watch::stopped_by(clock.stop()))
    }

    /// Returns the picture of an area of pixels, within a frame if there is one. `watch` counts the squares in which
    /// everything is found.
    pub(super) fn drawn_picture(
        self: &Arc<Self>,
        area: Area,
        frame: Option<MapFrame>,
        watch: &Watch,
    ) -> Result<Picture, Stopped> {
        let draughtsman = Draughtsman {
            style: &self.style,
            scale: self.scale,
            world: self.terrain.world(),
            settled: &self.world,
            has_lines: self.has_lines,
            is_sketch: self.detail.is_sketch,
            watch,
        };
        let mut writings = Vec::new();
        let drawing = if self.style.labels.draw {
            // The numbers of contours keep clear of all names in their square, so names are needed in whole squares.
            let named = if self.style.contours.draw { area.on_grid(SQUARE) } else { area };
            let pad = names::pad(self.scale);
            let drawing = draughtsman.draw(named, pad)?;
            let seen = self.detail.afar.as_ref().map(|afar| afar.look(named.padded(pad), &watch.clock)).transpose()?;
            let realms = match self.detail.is_sketch {
                false => realms::seen(&self.world, self.scale, named.padded(pad), &watch.clock)?,
                true => Vec::new(),
            };
            let summits = |area| match &self.detail.summits {
                Some(summits) => summits.find(self.scale, area, &watch.clock),
                None => Ok(Vec::new()),
            };
            let finders = Finders { sites: &|area| draughtsman.sites(area), summits: &summits };
            let style = (&self.style, self.scale);
            writings = names::write(style, &drawing, (seen.as_ref(), &realms), &finders, named, frame.as_ref(), watch)?;
            drawing
        } else {
            draughtsman.draw(area, WIDEST as usize)?
        };
        Ok(Picture { chart: Arc::clone(self), area, drawing, writings, frame, classes: Vec::new() })
    }
}

impl Picture {
    /// Returns the chart of which the picture is a part.
    pub fn chart(&self) -> &Chart {
        &self.chart
    }

    /// Returns the chart and drops the picture.
    pub fn into_chart(self) -> Arc<Chart> {
        self.chart
    }

    /// Finds the classes of land that a legend has to explain, if the picture is coloured by them.
    pub(super) fn find_classes(&mut self, clock: &Clock) -> Result<(), Stopped> {
        let chart = &self.chart;
        if chart.style.tint.by == TintBy::Height {
            return Ok(());
        }
        let sea_m = chart.world.preset().sea_level_m.map_or(f32::MIN, |level| level as f32);
        let count = |part: Area| {
            clock.check()?;
            let nodes = chart.terrain.nodes(part, clock)?;
            let heights = chart.terrain.at_pixels(&nodes.heights, part);
            let mut counts = BTreeMap::<LandClass, usize>::new();
            let classes = chart.terrain.classes(chart.style.tint.by, &heights, part).into_iter().flatten();
            for (class, height_m) in classes.zip(heights.values()) {
                if *height_m >= sea_m {
                    *counts.entry(class).or_default() += 1;
                }
            }
            Ok(counts)
        };
        let parts: Vec<Area> = self.area.squares(BLOCK as usize).collect();
        let mut counts = BTreeMap::<LandClass, usize>::new();
        for (class, count) in
            parts.into_par_iter().map(count).collect::<Result<Vec<_>, Stopped>>()?.into_iter().flatten()
        {
            *counts.entry(class).or_default() += count;
        }
        let least = (LEAST_CLASS_MM2 * chart.scale.pixels_per_mm * chart.scale.pixels_per_mm) as usize;
        self.classes = counts.into_iter().filter(|(_, count)| *count >= least.max(1)).map(|(class, _)| class).collect();
        Ok(())
    }

    /// Returns the items that a legend explains: those that the picture shows.
    pub(super) fn legend(&self) -> Vec<LegendItem> {
        let (style, drawing, area) = (&self.chart.style, &self.drawing, self.area);
        let shows = |shape: &Shape| area.meets(shape.bounds);
        let mut items: Vec<LegendItem> = self.classes.iter().copied().map(LegendItem::Class).collect();
        for class in [SiteClass::Town, SiteClass::Village, SiteClass::Hamlet] {
            let is_seen = |site: &SiteFeature| site.class == class && self.shows(self.chart.scale.pixel(site.at));
            if drawing.sites.iter().any(is_seen) {
                items.push(LegendItem::Site(class));
            }
        }
        for class in [RoadClass::Highway, RoadClass::Road, RoadClass::Track] {
            if drawing.roads.iter().any(|road| road.class == class && shows(&road.shape)) {
                items.push(LegendItem::Road(class));
            }
        }
        if drawing.rivers.iter().any(|river| area.meets(river.bounds)) {
            items.push(LegendItem::River);
        }
        let has = |is_pan| drawing.lakes.iter().any(|lake| lake.is_pan == is_pan && shows(&lake.shape));
        match (has(false), has(true)) {
            (false, false) => {}
            (true, false) => items.push(LegendItem::Lake),
            (false, true) => items.push(LegendItem::Pan),
            (true, true) => items.push(LegendItem::LakeAndPan),
        }
        if self.writings.iter().any(|writing| writing.is_peak() && self.shows(writing.at)) {
            items.push(LegendItem::Peak);
        }
        if style.contours.draw {
            items.push(LegendItem::Contour);
        }
        items
    }

    /// True if a place, in pixels, lies within the picture.
    pub(super) fn shows(&self, at: DVec2) -> bool {
        self.area.meets([at.x, at.y, at.x, at.y])
    }

    /// Returns the names of the features within the picture: the kind of each feature, its name, and its position in
    /// pixels.
    pub fn names(&self) -> impl Iterator<Item = (&'static str, &str, [f64; 2])> {
        let named = self.writings.iter().filter(|writing| !writing.name.is_empty() && self.shows(writing.at));
        named.map(|writing| (writing.kind, writing.name.as_str(), writing.at.to_array()))
    }

    /// Returns the letters of all labels that the fonts lack.
    pub(super) fn missing_letters(&self) -> impl Iterator<Item = char> {
        self.writings.iter().flat_map(|writing| writing.text.missing())
    }

    /// Returns all labels.
    #[cfg(test)]
    pub(super) fn writings(&self) -> &[Writing] {
        &self.writings
    }

    /// Returns the area of pixels that the picture shows.
    pub fn area(&self) -> Area {
        self.area
    }

    /// Hands the picture to `write` in strips of whole rows, from north to south: RGB, row by row.
    ///
    /// # Errors
    /// When `write` fails, or `clock` stops the work.
    pub fn strips<E: From<Stopped>>(
        &self,
        clock: &Clock,
        mut write: impl FnMut(&[u8]) -> Result<(), E>,
    ) -> Result<(), E> {
        self.rows().try_for_each(|strip| write(&self.pixels(strip, clock)?))
    }

    /// Iterates over the parts of the picture in the rows of blocks.
    fn rows(&self) -> impl Iterator<Item = Area> {
        let column = Area { x1: self.area.x0 + 1, ..self.area };
        column.squares(BLOCK as usize).map(|part| Area { x1: self.area.x1, ..part })
    }

    /// Returns the pixels of a part of the picture: RGB, row by row.
    ///
    /// # Errors
    /// When `clock` stops the work.
    ///
    /// # Panics
    /// When the part is not within the picture.
    pub fn pixels(&self, part: Area, clock: &Clock) -> Result<Vec<u8>, Stopped> {
        assert!(self.area.contains(&part), "a picture knows what it shows and no more");
        let parts: Vec<Area> = part.squares(BLOCK as usize).collect();
        let blocks = parts.par_iter().map(|part| self.block(*part, clock));
        let blocks = blocks.collect::<Result<Vec<Vec<u8>>, Stopped>>()?;
        let mut pixels = vec![0; part.len() * 3];
        let bytes = part.width() * 3;
        for (area, block) in parts.iter().zip(&blocks) {
            let left = (area.x0 - part.x0) as usize * 3;
            let lines = pixels.chunks_exact_mut(bytes).skip((area.y0 - part.y0) as usize);
            for (line, block) in lines.zip(block.chunks_exact(area.width() * 3)) {
                line[left..left + block.len()].copy_from_slice(block);
            }
        }
        Ok(pixels)
    }

    /// Returns the pixels of a part of a block.
    fn block(&self, part: Area, clock: &Clock) -> Result<Vec<u8>, Stopped> {
        let (ground, outlines) = self.ground(part, clock)?;
        let mut canvas = Canvas::of_words(&ground.pixels);
        self.draw(std::slice::from_ref(&outlines), &mut canvas, clock)?;
        Ok(canvas.pixels(part))
    }

    /// Returns the ground of the block that a part belongs to, and the lines that follow from its heights.
    fn ground(&self, part: Area, clock: &Clock) -> Result<(GroundPixels, Outlines), Stopped> {
        clock.check()?;
        let (chart, block) = (&self.chart, part.on_grid(BLOCK));
        let ground = chart.relief.ground(&chart.terrain, block, clock)?;
        let boxes = self.writings.iter().flat_map(Writing::boxes);
        // The numbers of contours keep clear of the frame as well as of names.
        let boxes = boxes.chain(self.frame.iter().flat_map(MapFrame::edges));
        let near: Vec<Quad> = boxes.filter(|quad| block.meets(bounds(quad.iter()))).collect();
        let sea_level_m = chart.terrain.world().preset().sea_level_m;
        let outlines =
            Outlines::new((&chart.style, &chart.relief), chart.scale, chart.interval_m, sea_level_m, &ground, &near);
        Ok((ground, outlines))
    }

    /// Draws the picture on a page: the ground as pixels, whose rows `watch` counts, and everything else as vectors.
    ///
    /// # Errors
    /// When the page cannot be written.
    pub(crate) fn plot(&self, page: &mut dyn Page, watch: &Watch) -> Result<(), Error> {
        let mut all = Vec::new();
        page.clip(self.area);
        page.begin_layer(PageLayer::Relief);
        page.begin_picture(self.area);
        for strip in self.rows() {
            let parts: Vec<Area> = strip.squares(BLOCK as usize).collect();
            let blocks = parts.par_iter().map(|part| self.ground(*part, &watch.clock));
            let blocks = blocks.collect::<Result<Vec<(GroundPixels, Outlines)>, Stopped>>()?;
            let mut canvas = Canvas::new(strip, Colour([0; 3]));
            for (part, (ground, outlines)) in parts.into_iter().zip(blocks) {
                canvas.put(part, &Canvas::of_words(&ground.pixels).pixels(part));
                all.push(outlines);
            }
            page.add_rows(&canvas.pixels(strip))?;
            watch.add(strip.height() as u64);
        }
        page.end_picture()?;
        page.end_layer();
        self.draw(&all, page, &watch.clock)?;
        page.open();
        Ok(())
    }

    /// Draws everything that lies over the ground, with the outlines of some blocks.
    fn draw(&self, outlines: &[Outlines], canvas: &mut dyn Plotter, clock: &Clock) -> Result<(), Stopped> {
        draw_outlines(outlines, canvas, clock);
        clock.check()?;
        canvas.layer(PageLayer::Houses, |canvas| {
            self.drawing.houses.iter().for_each(|house| canvas.fill(house, self.chart.style.places.houses));
        });
        canvas.layer(PageLayer::Waters, |canvas| self.draw_waters(outlines, canvas));
        canvas.layer(PageLayer::Roads, |canvas| self.drawing.draw_roads(&self.chart.style, self.chart.scale, canvas));
        canvas.layer(PageLayer::Places, |canvas| self.draw_places(canvas));
        canvas.layer(PageLayer::Names, |canvas| self.draw_names(canvas));
        Ok(())
    }

    fn draw_waters(&self, outlines: &[Outlines], canvas: &mut dyn Plotter) {
        let (style, scale, drawing) = (&self.chart.style, &self.chart.scale, &self.drawing);
        for lake in &drawing.lakes {
            let colour = if lake.is_pan { style.water.pan } else { style.water.fill };
            canvas.item(&lake.item("lake"), |canvas| canvas.fill(&lake.shape, colour));
        }
        let stroke_rivers =
            |canvas: &mut dyn Plotter, kind: &'static str, colour: Colour, drawn: &dyn Fn(&Strokes) -> Vec<f64>| {
                for river in &drawing.rivers {
                    if !canvas.sees(river.bounds) {
                        continue;
                    }
                    canvas.item(&Item { kind, id: &river.id, name: &river.name }, |canvas| {
                        for (width, (_, part)) in drawn(river).into_iter().zip(&river.parts) {
                            canvas.stroke(std::slice::from_ref(part), &Pen::solid(colour, width));
                        }
                    });
                }
            };
        stroke_rivers(canvas, "river", style.water.line, &|river| {
            river.parts.iter().map(|(width, _)| *width).collect()
        });
        let shore = Pen::solid(style.water.line, scale.pixels(style.water.shore_mm));
        for lake in &drawing.lakes {
            canvas.item(&lake.item("shore"), |canvas| canvas.stroke_shape(&lake.shape, &shore));
        }
        canvas.item(&Item::only("coasts"), |canvas| {
            for outlines in outlines {
                canvas.stroke(&outlines.coasts, &shore);
            }
        });
        // Between their banks, wide rivers have the colour of lakes. The water is drawn last, so no line separates it
        // from the lake or river that it runs into.
        let [banks, bank] = [BANKS * style.water.river_mm[1], style.water.shore_mm].map(|mm| scale.pixels(mm));
        stroke_rivers(canvas, "river-water", style.water.fill, &|river| river.open(banks, bank));
    }

    /// Draws the symbols of settlements and peaks.
    fn draw_places(&self, canvas: &mut dyn Plotter) {
        let (style, scale) = (&self.chart.style, self.chart.scale);
        for site in &self.drawing.sites {
            canvas.item(&Item { kind: site.class.name(), id: &site.id.to_string(), name: &site.name }, |canvas| {
                draw_site(canvas, scale.pixel(site.at), site.class, scale, style);
            });
        }
        for Writing { kind, name, at, colour, .. } in self.writings.iter().filter(|writing| writing.is_peak()) {
            canvas.item(&Item { kind, id: name, name }, |canvas| draw_peak(canvas, *at, scale, *colour));
        }
    }

    fn draw_names(&self, canvas: &mut dyn Plotter) {
        let labels = &self.chart.style.labels;
        let halo = Pen { opacity: 0.85, ..Pen::solid(labels.halo, self.chart.scale.pixels(2.0 * labels.halo_mm)) };
        let inscriptions = self.writings.iter().map(|Writing { name, text, colour, .. }| {
            let item = Item { kind: "name", id: name, name };
            Inscription { item, text, colour: *colour, halo }
        });
        canvas.inscribe(&inscriptions.collect::<Vec<_>>());
    }
}

/// Draws the signs, depth contours, contours and heights of some blocks, but not their coasts. Leaves off in the middle
/// once `clock` stops the work.
fn draw_outlines(outlines: &[Outlines], canvas: &mut dyn Plotter, clock: &Clock) {
    let draw = |canvas: &mut dyn Plotter, trace: GroundLine| {
        for outlines in outlines.iter().take_while(|_| clock.check().is_ok()) {
            outlines.draw(trace, canvas);
        }
    };
    canvas.layer(PageLayer::Signs, |canvas| draw(canvas, GroundLine::Sign));
    canvas.layer(PageLayer::Contours, |canvas| {
        for (trace, kind) in [
            (GroundLine::Depth, "depths"),
            (GroundLine::Contour, "intermediate-contours"),
            (GroundLine::IndexContour, "index-contours"),
        ] {
            canvas.item(&Item::only(kind), |canvas| draw(canvas, trace));
        }
        canvas.item(&Item::only("heights"), |canvas| outlines.iter().for_each(|outlines| outlines.write(canvas)));
    });
}
