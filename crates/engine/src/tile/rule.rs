//! The rule of the ground: the settings as ramps, ready to be applied to lanes.

use std::f64::consts::SQRT_2;

use crate::area::Stride;
use crate::hash::{Stream, stream};
#[cfg(feature = "gpu")]
use crate::noise::packed::put;
use crate::noise::{Fractal, FractalKind, FractalSpec};
use crate::preset::Preset;
use crate::preset::ground::GroundSettings;
use crate::simd::Simd;
#[cfg(feature = "gpu")]
use crate::tile::blend::floor_scale;
#[cfg(feature = "gpu")]
use crate::tile::surroundings::{ROLL_SHIFT, Round};
use crate::world::World;

/// Which ground lies where, ready to be applied: each limit as a ramp from 0 to 1.
#[derive(Clone, Debug)]
pub struct GroundRule {
    slope_scale: f32,
    exact_spacing_m: f64,
    pub(super) half_per_spacing: f32,
    pub(super) spacing_m: f32,
    pub(super) dirt: LinearStep,
    pub(super) rock: LinearStep,
    pub(super) no_sand: LinearStep,
    pub(super) steep_sand: LinearStep,
    pub(super) snow: LinearStep,
    /// Metres by which snow lies lower for each part of the normal that points north.
    pub(super) snow_north_m: f32,
    pub(super) snow_slides: LinearStep,
    pub(super) scree: Option<Scree>,
    pub(super) forest: Forest,
    pub(super) wet: Option<Wet>,
    /// What makes the edges of woods, scree and wet ground ragged; `None` where there is none of these.
    pub(super) ragged: Option<Ragged>,
}

/// What makes edges ragged: noise, where vertices show any.
#[derive(Clone, Debug)]
pub(super) struct Ragged {
    pub noise: Option<Fractal>,
}

/// Rubble beneath rock.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scree {
    pub reach_m: f32,
    lies: LinearStep,
}

/// Wet ground beside water.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wet {
    pub reach_m: f32,
}

/// Forest; none where nothing asks for it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Forest {
    /// How far a place of no drawbacks is from the edge of a wood, as the noise has it: below 0 outside of it.
    bias: f32,
    tree_line: LinearStep,
    /// Metres by which the tree line lies lower for each part of the normal that points north.
    pub north_m: f32,
    too_steep: LinearStep,
    no_meadow: LinearStep,
    likes_wet: f32,
    /// How suddenly a wood ends.
    edge: f32,
}

/// What a forest looks at.
#[derive(Clone, Copy)]
pub(super) struct ForestPlace<S: Simd> {
    /// In metres, as if the ground were level.
    pub height: S::F32,
    pub steepness: S::F32,
    /// How steep the way is to the places around: a gully's floor is no meadow.
    pub around: S::F32,
    pub damp: S::F32,
    pub noise: S::F32,
}

/// `clamp(value * scale + shift, 0, 1)`.
#[derive(Clone, Copy, Debug)]
pub(super) struct LinearStep {
    scale: f32,
    shift: f32,
}

impl LinearStep {
    fn between([from, to]: [f64; 2]) -> LinearStep {
        let scale = 1.0 / (to - from);
        LinearStep { scale: scale as f32, shift: (-from * scale) as f32 }
    }

    fn always(value: f32) -> LinearStep {
        LinearStep { scale: 0.0, shift: value }
    }
}

/// How much a place at the end of a ramp has against forest, as the noise has it, which is about -1 to 1. A slope that is
/// nearly too steep keeps its best places; on meadows a few groves are left.
const TREE_LINE: f32 = 1.6;
const STEEP: f32 = 1.2;
const MEADOW: f32 = 1.0;
/// From which part of the way to the water on a bank is as good as any.
const BANK: f32 = 3.0;
/// How suddenly a wood ends: the noise of its edge's two sides is a third apart.
const EDGE: f32 = 3.0;
/// Wavelength in metres of the noise of woods, and how it goes on from there.
const FOREST_M: f64 = 1800.0;
const LACUNARITY: f64 = 2.7;
const H: f64 = 0.45;
const OCTAVES: usize = 6;
/// Vertices that its shortest waves are long at least; and nodes of a stride, from where a wood of a few would be a speck.
const VERTICES: f64 = 3.0;
const AFAR_VERTICES: f64 = 8.0;
/// Standard deviation of its first octave, about.
const NOISE_DEVIATION: f64 = 0.3;
/// From which part of a ramp on the forest dies out whatever the noise says: at its end there is none.
const LAST: f32 = 4.0;

impl GroundRule {
    /// The rule of a world, at its nodes.
    pub fn of(world: &World) -> GroundRule {
        let Preset { ground, sea_level_m, .. } = world.preset();
        let (spacing_m, seed) = (world.spacing_m(), world.chance());
        let rule = GroundRule::new(ground, *sea_level_m, spacing_m, seed);
        if world.stride() == Stride::ONE { rule } else { rule.from_afar(spacing_m, seed) }
    }

    /// Metres from a vertex to the next.
    pub fn spacing_m(&self) -> f64 {
        self.exact_spacing_m
    }

    /// The rule of checked settings on a lattice of this spacing; sand lies about the sea level.
    pub fn new(ground: &GroundSettings, sea_level_m: Option<f64>, spacing_m: f64, seed: u64) -> GroundRule {
        let sea_level_m = sea_level_m.unwrap_or(0.0);
        let or = |ramp: Option<[f64; 2]>, value| ramp.map_or(LinearStep::always(value), LinearStep::between);
        let is_ragged = ground.scree.is_some() || ground.forest_m.is_some() || ground.wet_m.is_some();
        GroundRule {
            slope_scale: ground.slope_scale as f32,
            exact_spacing_m: spacing_m,
            half_per_spacing: (0.5 / spacing_m) as f32,
            spacing_m: spacing_m as f32,
            dirt: LinearStep::between(ground.dirt),
            rock: LinearStep::between(ground.rock),
            no_sand: or(ground.sand_m.map(|ramp| ramp.map(|above_m| sea_level_m + above_m)), 1.0),
            steep_sand: or(ground.sand_slope, 0.0),
            snow: or(ground.snow_m, 0.0),
            snow_north_m: (ground.snow_aspect_m * SQRT_2) as f32,
            snow_slides: LinearStep::between(ground.snow_slope),
            scree: ground.scree.map(|lies| Scree { reach_m: ground.scree_m as f32, lies: LinearStep::between(lies) }),
            forest: Forest {
                // The noise is within 0.8 nearly everywhere: from hardly any wood to hardly any glade.
                bias: ((ground.forest_share - 0.5) * 1.6) as f32,
                // At the end of the ramp everywhere: no forest.
                tree_line: or(ground.forest_m, 1.0),
                north_m: (ground.forest_aspect_m * SQRT_2) as f32,
                too_steep: LinearStep::between(ground.forest_slope),
                no_meadow: or(ground.meadow, 1.0),
                likes_wet: ground.forest_wet as f32,
                edge: EDGE,
            },
            wet: ground.wet_m.map(|reach_m| Wet { reach_m: reach_m as f32 }),
            ragged: is_ragged.then(|| {
                let noise = Fractal::new(&noise_spec(spacing_m), spacing_m, stream(seed, Stream::GroundCover));
                Ragged { noise: Some(noise) }
            }),
        }
    }

    /// The same at the nodes of a stride: of woods that are too small to be seen there is the mean, so their edges are soft.
    #[must_use]
    pub fn from_afar(mut self, spacing_m: f64, seed: u64) -> GroundRule {
        let seen = waves().take_while(|wave_m| *wave_m >= AFAR_VERTICES * spacing_m).count();
        let lost = (seen..OCTAVES).map(|octave| libm::pow(LACUNARITY, -2.0 * H * octave as f64)).sum::<f64>();
        // Half of the ramp of a wood's edge, as the noise has it, and what is left out of that, which is about normal.
        let [ramp, left] = [0.5 / f64::from(EDGE), 1.25 * NOISE_DEVIATION * lost.sqrt()];
        self.forest.edge = (0.5 / (ramp * ramp + left * left).sqrt()) as f32;
        if let Some(ragged) = &mut self.ragged {
            let spec = FractalSpec { octaves: seen as u32, ..noise_spec(FOREST_M / AFAR_VERTICES) };
            ragged.noise = (seen > 0).then(|| Fractal::new(&spec, spacing_m, stream(seed, Stream::GroundCover)));
        }
        self
    }

    /// The rule as words, for kernels that run elsewhere: `shaders/tile.wgsl` has their places by name. Of what needs water there is
    /// nothing.
    #[cfg(feature = "gpu")]
    pub(crate) fn pack(&self, words: &mut Vec<u32>) {
        let ramp = |ramp: LinearStep| [ramp.scale, ramp.shift];
        let Forest { bias, tree_line, north_m, too_steep, no_meadow, likes_wet: _, edge } = self.forest;
        put(words, [self.slope_scale, self.half_per_spacing]);
        put(words, [self.dirt, self.rock, self.no_sand, self.steep_sand, self.snow].into_iter().flat_map(ramp));
        put(words, [self.snow_north_m]);
        put(words, ramp(self.snow_slides));
        let noise = self.ragged.as_ref().is_some_and(|ragged| ragged.noise.is_some());
        words.extend([self.ragged.is_some(), noise, self.scree.is_some()].map(u32::from));
        put(words, ramp(self.scree.map_or(LinearStep::always(0.0), |scree| scree.lies)));
        put(words, [bias]);
        put(words, ramp(tree_line));
        put(words, [north_m]);
        put(words, [too_steep, no_meadow].into_iter().flat_map(ramp));
        put(words, [edge, floor_scale(self.half_per_spacing), ROLL_SHIFT]);
        for round in self.scree.iter().flat_map(|scree| Round::all(self.spacing_m, scree.reach_m)) {
            put(words, round.losses.into_iter().chain(round.roll_scales));
        }
    }

    /// What a rule looks at beside the land itself: noise, and rubble.
    #[cfg(feature = "gpu")]
    pub(crate) fn ragged(&self) -> Option<(Option<&Fractal>, bool)> {
        self.ragged.as_ref().map(|ragged| (ragged.noise.as_ref(), self.scree.is_some()))
    }

    /// How far below the tree line a place is, by its height and by how far its normal points south: 1 where trees stand as they
    /// do anywhere, 0 from where on none does.
    pub fn below_tree_line(&self, height_m: f32, south: f32) -> f32 {
        let line = self.forest.tree_line;
        1.0 - ((height_m - south * self.forest.north_m) * line.scale + line.shift).clamp(0.0, 1.0)
    }

    /// How much of what snow and rock leave is scree, by how much more rubble has come than rock stands there, from none
    /// at 0, and by steepness.
    #[inline(always)]
    pub(super) fn scree_share<S: Simd>(&self, simd: S, rubble: S::F32, steepness: S::F32, noise: S::F32) -> S::F32 {
        let Some(scree) = self.scree else { return simd.splat(0.0) };
        let come = rubble * (simd.splat(1.0) + noise * simd.splat(0.9));
        clamp(simd, come * simd.splat(2.5) - simd.splat(0.3)) * ramp(simd, steepness, scree.lies)
    }
}

/// How much is wetland of what rock and sand leave, by how near water is: 1 at a lake, 0 out of its reach.
#[inline(always)]
pub(super) fn wetland_share<S: Simd>(simd: S, damp: S::F32, noise: S::F32) -> S::F32 {
    let damp = damp * (simd.splat(1.0) + noise * simd.splat(0.6));
    clamp(simd, damp * simd.splat(3.0) - simd.splat(0.9))
}

/// From the size of a forest down to that of a glade, but no finer than what vertices show as a shape.
fn noise_spec(spacing_m: f64) -> FractalSpec {
    let wavelength_m = FOREST_M.max(2.0 * VERTICES * spacing_m);
    let waves = std::iter::successors(Some(wavelength_m), |wave_m| Some(wave_m / LACUNARITY));
    let octaves = waves.take(OCTAVES).take_while(|wave_m| *wave_m >= VERTICES * spacing_m).count();
    FractalSpec { kind: FractalKind::Fbm, octaves: octaves as u32, wavelength_m, lacunarity: LACUNARITY, h: H }
}

/// The wavelengths of its octaves in metres.
fn waves() -> impl Iterator<Item = f64> {
    std::iter::successors(Some(FOREST_M), |wave_m| Some(wave_m / LACUNARITY)).take(OCTAVES)
}

impl Forest {
    /// How much of what is left is forest, at a height that is corrected for its aspect.
    #[inline(always)]
    pub fn share<S: Simd>(self, simd: S, place: &ForestPlace<S>) -> S::F32 {
        let &ForestPlace { height, steepness, around, damp, noise } = place;
        let (zero, one) = (simd.splat(0.0), simd.splat(1.0));
        let high = simd.max(along(simd, height, self.tree_line), zero);
        let steep = simd.max(along(simd, steepness, self.too_steep), zero);
        let meadow = one - ramp(simd, around, self.no_meadow);
        let against = (high * simd.splat(TREE_LINE) + steep * simd.splat(STEEP)) + meadow * simd.splat(MEADOW);
        let bank = clamp(simd, damp * simd.splat(BANK)) * simd.splat(self.likes_wet);
        let score = (noise + simd.splat(self.bias)) + (bank - against);
        let stands = clamp(simd, score * simd.splat(self.edge) + simd.splat(0.5));
        let low_enough = clamp(simd, (one - high) * simd.splat(LAST));
        stands * low_enough * clamp(simd, (one - steep) * simd.splat(LAST))
    }
}

/// The steepness of a vertex whose normal points up so far.
#[inline(always)]
pub(super) fn steepness<S: Simd>(simd: S, up: S::F32, rule: &GroundRule) -> S::F32 {
    let one = simd.splat(1.0);
    simd.min((one - up) * simd.splat(rule.slope_scale), one)
}

/// Where a value lies on a ramp: 0 at its beginning, 1 at its end.
#[inline(always)]
fn along<S: Simd>(simd: S, value: S::F32, ramp: LinearStep) -> S::F32 {
    value * simd.splat(ramp.scale) + simd.splat(ramp.shift)
}

#[inline(always)]
pub(super) fn ramp<S: Simd>(simd: S, value: S::F32, ramp: LinearStep) -> S::F32 {
    clamp(simd, along(simd, value, ramp))
}

#[inline(always)]
pub(super) fn clamp<S: Simd>(simd: S, value: S::F32) -> S::F32 {
    simd.min(simd.max(value, simd.splat(0.0)), simd.splat(1.0))
}
