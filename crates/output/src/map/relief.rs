//! The ground of a map: hypsometric tints, the cover of the ground, light and shadow.

use std::sync::Arc;

use glam::DVec2;

use crate::area::Area;
use crate::clock::Clock;
use crate::geography::Geography;
use crate::geometry::smooth;
use crate::grain_point::Point;
use crate::grid::Grid;
use crate::map::climate_colours::add_changes;
use crate::map::light::{CHUNK, Lamp, Light, WIDE};
use crate::map::scale::Scale;
use crate::map::signs::REACH;
use crate::map::sky;
use crate::map::style::{Colour, Style, TintBy};
use crate::map::terrain::{LandClass, MapTerrain, Nodes};
use crate::map::tint::Tints;
use crate::map::weighted_sums::{smoothed, weigh};
use crate::simd::dispatch;
use crate::stop::Stopped;
use crate::tile::Material;
use crate::world::World;

/// Number of levels of detail that texture shading sums up, each twice as wide as the one before.
pub(super) const LEVELS: usize = 4;

/// Pixels around an area that its light depends on: the reach of the widest level of detail, and one for slopes.
const HALO: usize = 2 * ((1 << LEVELS) - 1) + 1;

/// Scale denominator at which slopes have the exaggeration of the style, and the exponent by which smaller scales
/// exaggerate slopes more.
const TRUE_SCALE: f64 = 25_000.0;
const STEEPENED: f64 = 0.22;

/// Droughts, as [`PlaceClimate::drought`](crate::geography::climate::PlaceClimate::drought) has them, from which on the
/// tints of dry land show and at which they show alone: sub-humid land, and deserts (UNEP, World atlas of desertification,
/// 1992).
const DRY: [f64; 2] = [1.5, 6.0];

/// The ground of a world's maps in one style and scale.
#[derive(Debug)]
pub(super) struct ShadedRelief {
    tints: Tints,
    /// Colours of the materials, and the visible share of each per unit of weight (255 is all of the ground).
    covers: [([f32; 3], f32); 8],
    /// Strength with which the colours of the ground differ by climate, 0 to 1.
    by_climate: f32,
    lamp: Lamp,
    has_stones: bool,
    /// Property of land that gives it its colours.
    by: TintBy,
    /// The geography that tells how dry land is, if land has its colours by its height.
    geography: Option<Arc<Geography>>,
    /// Strengths of sky shading and of cast shadow.
    sky: [f32; 2],
}

/// The ground at the pixels of an area.
pub(super) struct GroundPixels {
    pub area: Area,
    /// Red in the lowest byte, then green and blue.
    pub pixels: Grid<u32>,
    /// Heights of the area and of some pixels around it.
    pub heights: Grid<f32>,
    /// Share of snow, 0 to 1.
    pub snow: Grid<f32>,
    /// Shares of rock and of scree, 0 to 1, in the area and [`REACH`] around it, if the map draws signs.
    pub stones: Option<[Grid<f32>; 2]>,
}

/// The inputs of the light at the pixels of an area.
pub(super) struct Lit<'a> {
    /// Heights, and smoothed heights (wide landforms alone), with one more pixel on each side.
    pub heights: &'a Grid<f32>,
    pub smooth: &'a Grid<f32>,
    /// Texture shading: how much ridges stand out, at all sizes alike.
    pub texture: Option<&'a Grid<f32>>,
    /// Change of tone by the visible sky and by cast shadow; positive is lighter.
    pub open: Option<&'a Grid<f32>>,
    /// Colours of the land, if they do not follow from its heights alone.
    pub land: Option<&'a Grid<[f32; 3]>>,
    /// Cover of the ground, from [`ShadedRelief::covers_of`].
    pub covers: &'a [Grid<f32>; 4],
}

pub(super) fn channels(colour: Colour) -> [f32; 3] {
    colour.0.map(f32::from)
}

impl ShadedRelief {
    /// Prepares the ground of a world in a style and scale.
    pub fn new(style: &Style, world: &World, scale: Scale) -> ShadedRelief {
        let relief = &style.relief;
        let radians = relief.sun_deg.to_radians();
        let denominator = scale.denominator();
        let of_world = world.preset().map.exaggeration.unwrap_or(1.0);
        let steepening = relief.exaggeration * of_world * libm::pow((denominator / TRUE_SCALE).max(0.3), STEEPENED);
        let tints = Tints::new(&style.tint, world);
        let (low_m, high_m) = tints.range_m();
        let lamp = Lamp {
            metres_per_pixel: scale.metres_per_pixel as f32,
            // Without a sea, a level below all land. Not infinite: infinity less a height, divided by a rise, would be
            // no number.
            sea_level_m: world.preset().sea_level_m.map_or(f32::MIN / 1e6, |level| level as f32),
            sun: [libm::sin(radians) as f32, -libm::cos(radians) as f32],
            soften: relief.soften as f32,
            turn: libm::tan(relief.turn_deg.to_radians()) as f32,
            steepening: steepening as f32,
            strength: relief.strength as f32,
            texture: relief.texture as f32,
            aerial: relief.aerial as f32,
            haze: channels(relief.haze),
            haze_share: relief.haze_share as f32,
            under_water: relief.under_water as f32,
            shadow: channels(relief.shadow).map(|channel| channel / 255.0),
            light: channels(relief.light),
            highlight: relief.highlight as f32,
            low_m,
            per_m: 1.0 / (high_m - low_m),
        };
        let covers = style.cover.all().map(|cover| (channels(cover.colour), cover.share as f32 / 255.0));
        let has_stones = style.signs.are_drawn(denominator);
        let sky = [relief.sky, relief.cast].map(|share| share as f32);
        let by_climate = style.cover.by_climate as f32;
        let by = style.tint.by;
        let geography = world.geography().filter(|_| by == TintBy::Height).cloned();
        ShadedRelief { tints, covers, by_climate, lamp, has_stones, by, geography, sky }
    }

    /// Height in metres up to which a soft shore may reach: where the lowest land of some pixels is lower, they may
    /// show sea.
    fn shore_m(&self) -> f32 {
        self.lamp.sea_level_m + self.lamp.metres_per_pixel * 8.0
    }

    /// Factor from metres of height between neighbouring pixels to the exaggerated slope.
    fn per_m(&self) -> f32 {
        self.lamp.steepening / self.lamp.metres_per_pixel
    }

    /// The same factor for one level of detail: heights relative to the level's width in metres.
    fn level_per_m(&self, level: usize) -> f32 {
        self.lamp.steepening / (self.lamp.metres_per_pixel * (2 << level) as f32)
    }

    /// The colour of water over a depth, in metres.
    pub fn water(&self, depth_m: f32) -> [f32; 3] {
        self.tints.sea(depth_m)
    }

    pub fn looks_up(&self) -> bool {
        self.sky != [0.0; 2]
    }

    /// Height range in metres from the lowest to the highest land that the colours tell apart.
    pub fn range_m(&self) -> f64 {
        let (low_m, high_m) = self.tints.range_m();
        f64::from(high_m - low_m)
    }

    /// Factor by which slopes are exaggerated.
    pub fn steepening(&self) -> f64 {
        f64::from(self.lamp.steepening)
    }

    /// Direction to the sun: east and south.
    pub fn sun(&self) -> DVec2 {
        self.lamp.sun.map(f64::from).into()
    }

    /// Returns the pixels whose heights the ground of an area depends on.
    pub fn wide(&self, area: Area) -> Area {
        area.padded(if self.looks_up() { HALO.max(sky::REACH) } else { HALO })
    }

    /// Returns the ground at the pixels of an area.
    pub fn ground(&self, terrain: &MapTerrain, area: Area, clock: &Clock) -> Result<GroundPixels, Stopped> {
        let wide = self.wide(area);
        let nodes = terrain.nodes(wide, clock)?;
        let heights = terrain.at_pixels(&nodes.heights, wide);
        let (texture, smooth) = self.texture_of(&heights, area);
        let open = self.looks_up().then(|| sky::openness(&heights, area, self.per_m(), self.lamp.sun, self.sky));
        // A plane of zeros needs no interpolation between the nodes.
        let at_pixels = |plane: Grid<f32>| match plane.values().iter().all(|value| *value == 0.0) {
            true => Grid::filled(area, 0.0),
            false => terrain.at_pixels(&plane, area),
        };
        let mut covers = self.covers_of(&nodes.ground, &nodes.cover);
        if self.by_climate > 0.0 {
            add_changes(&mut covers, &nodes, terrain.world(), self.by_climate);
        }
        let covers = covers.map(at_pixels);
        let snow = at_pixels(share_of(&nodes, Material::Snow));
        let stones = self.has_stones.then(|| {
            [Material::Rock, Material::Scree]
                .map(|material| terrain.at_pixels(&share_of(&nodes, material), area.padded(REACH)))
        });
        let of_classes = |classes: Vec<LandClass>| {
            let mut colours = Grid::filled(area, [0.0; 3]);
            for (colour, class) in colours.values_mut().iter_mut().zip(classes) {
                *colour = class.colour().map(f32::from);
            }
            colours
        };
        let by_dryness = || self.tints_by_dryness(&heights, area, |y| terrain.middles(y, area.x0, area.x1));
        let land = terrain.classes(self.by, &heights, area).map(of_classes).or_else(by_dryness);
        let lit = Lit {
            heights: &heights,
            smooth: &smooth,
            texture: Some(&texture),
            open: open.as_ref(),
            land: land.as_ref(),
            covers: &covers,
        };
        let pixels = self.light(&lit, area);
        Ok(GroundPixels { area, pixels, heights, snow, stones })
    }

    /// Returns the tints of land by its height and its dryness, given the places of each row of an area; none where all
    /// land is equally dry.
    ///
    /// Based on: T. Patterson, Cross-blended hypsometric tints, 2011: lowlands of deserts are not green.
    pub fn tints_by_dryness(
        &self,
        heights: &Grid<f32>,
        area: Area,
        row_of: impl Fn(i64) -> Vec<Point>,
    ) -> Option<Grid<[f32; 3]>> {
        let geography = self.geography.as_ref()?;
        let mut tints = Grid::filled(area, [0.0; 3]);
        for y in area.y0..area.y1 {
            let heights = heights.row(y, area.x0, area.x1);
            // The sea needs no climate, but the land's tint is mixed in a little beyond its soft shore.
            let deep_m = 2.0 * self.lamp.sea_level_m - self.shore_m();
            if heights.iter().all(|height_m| *height_m < deep_m) {
                continue;
            }
            let climates = geography.climates(&row_of(y));
            for ((tint, height_m), climate) in tints.row_mut(y, area.x0, area.x1).iter_mut().zip(heights).zip(climates)
            {
                let drought = climate.drought(f64::from(height_m - self.lamp.sea_level_m).max(0.0));
                let dryness = smooth((drought - DRY[0]) / (DRY[1] - DRY[0]));
                *tint = self.tints.land_by_dryness(*height_m, dryness as f32);
            }
        }
        Some(tints)
    }

    /// Lights the pixels of an area.
    pub fn light(&self, lit: &Lit<'_>, area: Area) -> Grid<u32> {
        let mut pixels = Grid::filled(area, 0);
        // At the end of a row, fewer values are left than a chunk needs: they are copied into this room.
        let mut room = ([[0.0; WIDE]; 6], [[0.0; CHUNK]; 6]);
        for y in area.y0..area.y1 {
            for (x0, pixels) in (area.x0..).step_by(CHUNK).zip(pixels.row_mut(y, area.x0, area.x1).chunks_mut(CHUNK)) {
                let x1 = x0 + pixels.len() as i64;
                let mut words = [0; CHUNK];
                let [a, b, c, d, e, f] = &mut room.0;
                let row = |grid, by, room| whole(Grid::row(grid, y + by, x0 - 1, x1 + 1), room);
                let heights = [row(lit.heights, -1, a), row(lit.heights, 0, b), row(lit.heights, 1, c)];
                let smooth = [row(lit.smooth, -1, d), row(lit.smooth, 0, e), row(lit.smooth, 1, f)];
                let [a, b, c, d, e, f] = &mut room.1;
                let row = |grid, room| whole(Grid::row(grid, y, x0, x1), room);
                let plane = |grid: Option<_>, room| grid.map_or(&NONE, |grid| row(grid, room));
                let [red, green, blue, share] = lit.covers;
                let own = lit.land.map(|colours| colours.row(y, x0, x1));
                let [land, sea] = self.tints_of(&heights[1][1..=pixels.len()], own);
                dispatch(Light {
                    lamp: &self.lamp,
                    count: pixels.len(),
                    heights,
                    smooth,
                    texture: plane(lit.texture, a),
                    open: plane(lit.open, b),
                    land: &land,
                    sea: &sea,
                    cover: [row(red, c), row(green, d), row(blue, e), row(share, f)],
                    words: &mut words,
                });
                pixels.copy_from_slice(&words[..pixels.len()]);
            }
        }
        pixels
    }

    /// Looks up the tints of heights as land, unless it has `own` colours, and as sea, by channel. One by one, because
    /// lanes cannot read from a table of this size.
    fn tints_of(&self, heights: &[f32], own: Option<&[[f32; 3]]>) -> [[[f32; CHUNK]; 3]; 2] {
        let mut tints = [[[0.0; CHUNK]; 3]; 2];
        let lowest_m = heights.iter().fold(f32::MAX, |low, height_m| low.min(*height_m));
        let mut put = |kind: usize, index: usize, colour: [f32; 3]| {
            (0..3).for_each(|channel| tints[kind][channel][index] = colour[channel]);
        };
        for (index, height_m) in heights.iter().enumerate() {
            put(0, index, own.map_or_else(|| self.tints.land(*height_m), |own| own[index]));
        }
        // A shore is soft, so land a little above the sea may be mixed with the sea's tint.
        if lowest_m < self.shore_m() {
            for (index, height_m) in heights.iter().enumerate() {
                put(1, index, self.tints.sea(self.lamp.sea_level_m - height_m));
            }
        }
        tints
    }

    /// Returns the planes of the ground's cover, given weights of materials as [`Blend`](crate::tile::Blend) packs
    /// them: red, green and blue times the visible share, and that share.
    pub fn covers_of(&self, ground: &Grid<u32>, cover: &Grid<u32>) -> [Grid<f32>; 4] {
        let area = ground.area();
        let mut planes = [(); 4].map(|()| Grid::filled(area, 0.0));
        let [red, green, blue, share] = &mut planes;
        let sums = red.values_mut().iter_mut().zip(green.values_mut()).zip(blue.values_mut()).zip(share.values_mut());
        let words = ground.values().iter().zip(cover.values());
        let covers: Vec<(u32, &([f32; 3], f32))> = (0..).zip(&self.covers).filter(|(_, cover)| cover.1 > 0.0).collect();
        for ((((red, green), blue), share), (ground, cover)) in sums.zip(words) {
            let weights = u64::from(*ground) | u64::from(*cover) << 32;
            for (number, (colour, seen)) in &covers {
                let weight = (weights >> (8 * number)) as u8;
                if weight == 0 {
                    continue;
                }
                let seen = f32::from(weight) * seen;
                *red += colour[0] * seen;
                *green += colour[1] * seen;
                *blue += colour[2] * seen;
                *share += seen;
            }
        }
        planes
    }

    /// Returns texture shading and the heights of wide landforms alone. Heights are smoothed level by level, and the
    /// detail that each level removes counts by its steepness, so that landforms of all sizes are equally visible.
    ///
    /// An approximation of: L. Brown, "Texture shading: a new technique for depicting terrain relief" (2010).
    fn texture_of(&self, heights: &Grid<f32>, area: Area) -> (Grid<f32>, Grid<f32>) {
        let mut texture = Grid::filled(area, 0.0f32);
        let mut sum = vec![0.0; area.width()];
        let mut fine = heights.part(area.padded(HALO));
        for level in 0..LEVELS {
            let step = 1 << level;
            let Area { x0, y0, x1, y1 } = fine.area();
            let by = 2 * step;
            let coarse = smoothed(&fine, Area { x0: x0 + by, y0: y0 + by, x1: x1 - by, y1: y1 - by }, step);
            let per_m = self.level_per_m(level);
            for y in area.y0..area.y1 {
                let rows =
                    [texture.row(y, area.x0, area.x1), fine.row(y, area.x0, area.x1), coarse.row(y, area.x0, area.x1)];
                weigh(rows, [1.0, per_m, -per_m], &mut sum);
                texture.row_mut(y, area.x0, area.x1).copy_from_slice(&sum);
            }
            fine = coarse;
        }
        (texture, fine)
    }
}

/// Zeros for a chunk of pixels, in place of a plane that is missing.
const NONE: [f32; CHUNK] = [0.0; CHUNK];

/// Returns `values` as an array. If they are fewer, they are copied into `room`, and what was behind them there stays.
fn whole<'a, const N: usize>(values: &'a [f32], room: &'a mut [f32; N]) -> &'a [f32; N] {
    if let Ok(values) = values.try_into() {
        return values;
    }
    room[..values.len()].copy_from_slice(values);
    room
}

/// Copies values, which may be fewer than wanted, into an array and fills it up with zeros.
pub(super) fn filled<T: Copy + Default, const N: usize>(values: &[T]) -> [T; N] {
    let mut filled = [T::default(); N];
    filled[..values.len()].copy_from_slice(values);
    filled
}

/// Returns each node's share of a material, 0 to 1.
fn share_of(nodes: &Nodes, material: Material) -> Grid<f32> {
    let number = Material::ALL.iter().position(|other| *other == material).expect("all are there");
    let words = if number < 4 { &nodes.ground } else { &nodes.cover };
    let mut share = Grid::filled(words.area(), 0.0);
    for (value, word) in share.values_mut().iter_mut().zip(words.values()) {
        *value = f32::from(word.to_le_bytes()[number % 4]) / 255.0;
    }
    share
}
