//! The rule of the ground: the preset's settings as ramps, ready for SIMD lanes.

use std::f64::consts::SQRT_2;

use crate::area::Stride;
use crate::hash::{Stream, stream};
use crate::noise::{Fractal, FractalKind, FractalSpec};
use crate::preset::Preset;
use crate::preset::ground::GroundSettings;
use crate::simd::Simd;
#[cfg(feature = "gpu")]
use crate::tile::blend::{FLOOR, floor_scale};
#[cfg(feature = "gpu")]
use crate::tile::surroundings::{REACH, ROLL_SHIFT, Round};
#[cfg(feature = "gpu")]
use crate::wgsl::push;
use crate::world::World;

/// The rule that decides where each ground material lies. Each limit of the settings is a ramp from 0 to 1.
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
    /// Height in metres where half of the level ground is snow.
    pub(super) half_snow_m: f32,
    /// Metres by which snow lies lower, per unit of the normal's northward component.
    pub(super) snow_north_m: f32,
    pub(super) snow_slides: LinearStep,
    pub(super) scree: Option<Scree>,
    pub(super) forest: Forest,
    /// Distance in metres to which water wets the ground beside it.
    pub(super) wet_m: Option<f32>,
    /// True if the ground has woods, scree or wet ground, which have ragged edges.
    pub(super) is_ragged: bool,
    /// Noise for ragged edges; `None` where the vertices are too far apart to show any.
    pub(super) noise: Option<Fractal>,
}

/// Rubble beneath rock.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scree {
    pub reach_m: f32,
    lies: LinearStep,
}

/// Forest; its ramps leave none where the settings ask for none.
#[derive(Clone, Copy, Debug)]
pub(super) struct Forest {
    /// Score of a place without drawbacks, in units of the noise: below 0 it lies outside a wood.
    bias: f32,
    /// Part of `bias` that is lost where it is too dry for trees.
    bias_of_rain: f32,
    tree_line: LinearStep,
    /// Height in metres above which no trees grow.
    pub last_trees_m: f32,
    /// Metres by which the tree line lies lower, per unit of the normal's northward component.
    pub north_m: f32,
    too_steep: LinearStep,
    no_meadow: LinearStep,
    likes_wet: f32,
    /// Slope of the share of forest across a wood's edge, per unit of score.
    edge: f32,
}

/// Properties of a place that decide about forest.
#[derive(Clone, Copy)]
pub(super) struct ForestPlace<S: Simd> {
    /// Height in metres, corrected for aspect: that of level ground with the same trees.
    pub height: S::F32,
    pub steepness: S::F32,
    /// Greatest steepness of the ways to the places around: the floor of a gully is no meadow.
    pub around: S::F32,
    pub damp: S::F32,
    pub noise: S::F32,
    /// Ease with which trees grow in the climate, from 0 to 1.
    pub climate: S::F32,
}

/// `clamp(value * scale + shift, 0, 1)`.
#[derive(Clone, Copy, Debug)]
pub(super) struct LinearStep {
    scale: f32,
    shift: f32,
}

impl LinearStep {
    const fn between([from, to]: [f64; 2]) -> LinearStep {
        let scale = 1.0 / (to - from);
        LinearStep { scale: scale as f32, shift: (-from * scale) as f32 }
    }

    fn always(value: f32) -> LinearStep {
        LinearStep { scale: 0.0, shift: value }
    }
}

/// Penalties for forest at the end of each ramp, in units of the noise, which is about -1 to 1. On a slope that is
/// nearly too steep only the best places keep trees; on meadows a few groves are left.
const TREE_LINE: f32 = 1.6;
const STEEP: f32 = 1.2;
const MEADOW: f32 = 1.0;
/// Factor of dampness in the bonus of banks: from a third of full dampness on, the bonus is whole.
const BANK: f32 = 3.0;
/// Difference in score between a land of forest and one without any.
const WHOLE_BIAS: f64 = 1.6;
/// Slope of the share of forest across a wood's edge: from none to full in a third of a unit of the noise.
const EDGE: f32 = 3.0;
/// Wavelength in metres of the noise's first octave, the size of woods; lacunarity, exponent and number of its octaves.
const FOREST_M: f64 = 1800.0;
const LACUNARITY: f64 = 2.7;
const H: f64 = 0.45;
const OCTAVES: usize = 6;
/// Least wavelength of the noise in vertices; and in nodes of a stride, where a wood of a few nodes would be a speck.
const VERTICES: f64 = 3.0;
const AFAR_VERTICES: f64 = 8.0;
/// Standard deviation of the noise's first octave, about.
const NOISE_DEVIATION: f64 = 0.3;
/// Slope with which forest dies out whatever the noise: over the last quarter of a ramp, to none at its end.
const LAST: f32 = 4.0;

/// Bias of the noise with which sand lies in a desert, and the part of it that is lost at a desert's edge: a bit more
/// than half of the level ground of a desert is sand.
const SAND_BIAS: f32 = 0.1;
const SAND_OF_DESERT: f32 = 0.9;
/// Tilts at which the sand of a desert begins to thin out and at which none is left: on slopes of 5 and 11 degrees.
const NO_DUNES: LinearStep = LinearStep::between([0.004, 0.018]);
/// Share of stones in the bare ground of a level desert, and tilts from which on they are more and at which they are
/// all: slopes of 8 and 26 degrees.
const LEVEL_STONES: f32 = 0.2;
const STONES: LinearStep = LinearStep::between([0.01, 0.1]);

#[cfg(feature = "gpu")]
kernel_words! {
    /// A ground rule, with its ramps as scale and shift. The rounds of rubble follow it.
    struct RuleWords in same, RULE_WORDS {
        slope_scale: f32, half_per_spacing: f32,
        dirt: [f32; 2], rock: [f32; 2], no_sand: [f32; 2], steep_sand: [f32; 2],
        snow: [f32; 2], snow_north_m: f32, snow_slides: [f32; 2],
        looks_around: u32, has_noise: u32, has_scree: u32, scree: [f32; 2],
        forest_bias: f32, tree_line: [f32; 2], forest_north_m: f32, too_steep: [f32; 2], no_meadow: [f32; 2],
        forest_edge: f32, floor_scale: f32,
    }

    /// A round of rubble, as in [`Round`].
    struct RoundWords in same, ROUND_WORDS { losses: [f32; 2], roll_scales: [f32; 2] }

    const TREE_LINE: f32, STEEP: f32, MEADOW: f32, LAST: f32, ROLL_SHIFT: f32, FLOOR: u32, REACH: u32;
}

impl GroundRule {
    /// Returns the rule of a world, at the world's nodes.
    pub fn of(world: &World) -> GroundRule {
        let Preset { ground, sea_level_m, .. } = world.preset();
        let (spacing_m, seed) = (world.spacing_m(), world.chance());
        let rule = GroundRule::new(ground, *sea_level_m, spacing_m, seed);
        if world.stride() == Stride::ONE { rule } else { rule.from_afar(spacing_m, seed) }
    }

    /// Returns the distance in metres from a vertex to the next.
    pub fn spacing_m(&self) -> f64 {
        self.exact_spacing_m
    }

    /// Makes the rule of checked settings on a lattice of the given spacing. Sand lies about the sea level.
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
            half_snow_m: ground.snow_m.map_or(0.0, |[from, to]| 0.5 * (from + to)) as f32,
            snow_north_m: (ground.snow_aspect_m * SQRT_2) as f32,
            snow_slides: LinearStep::between(ground.snow_slope),
            scree: ground.scree.map(|lies| Scree { reach_m: ground.scree_m as f32, lies: LinearStep::between(lies) }),
            forest: Forest {
                // The noise is within 0.8 nearly everywhere: the bias leads from hardly any wood to hardly any glade.
                bias: ((ground.forest_share - 0.5) * WHOLE_BIAS) as f32,
                bias_of_rain: (ground.forest_share * WHOLE_BIAS) as f32,
                // Without a tree line, every place is at the ramp's end: there is no forest.
                tree_line: or(ground.forest_m, 1.0),
                last_trees_m: ground.forest_m.map_or(0.0, |[_, none]| none) as f32,
                north_m: (ground.forest_aspect_m * SQRT_2) as f32,
                too_steep: LinearStep::between(ground.forest_slope),
                no_meadow: or(ground.meadow, 1.0),
                likes_wet: ground.forest_wet as f32,
                edge: EDGE,
            },
            wet_m: ground.wet_m.map(|reach_m| reach_m as f32),
            is_ragged,
            noise: is_ragged
                .then(|| Fractal::new(&noise_spec(spacing_m), spacing_m, stream(seed, Stream::GroundCover))),
        }
    }

    /// Adapts the rule to the nodes of a stride. Woods too small to be seen enter as their mean, so the edges of woods
    /// are soft.
    #[must_use]
    pub fn from_afar(mut self, spacing_m: f64, seed: u64) -> GroundRule {
        let seen = waves().take_while(|wave_m| *wave_m >= AFAR_VERTICES * spacing_m).count();
        let lost = (seen..OCTAVES).map(|octave| libm::pow(LACUNARITY, -2.0 * H * octave as f64)).sum::<f64>();
        // Half of the ramp across a wood's edge in units of the noise, and the deviation of the octaves left out, which
        // is about normal.
        let [ramp, left] = [0.5 / f64::from(EDGE), 1.25 * NOISE_DEVIATION * lost.sqrt()];
        self.forest.edge = (0.5 / (ramp * ramp + left * left).sqrt()) as f32;
        let spec = FractalSpec { octaves: seen as u32, ..noise_spec(FOREST_M / AFAR_VERTICES) };
        self.noise =
            (self.is_ragged && seen > 0).then(|| Fractal::new(&spec, spacing_m, stream(seed, Stream::GroundCover)));
        self
    }

    /// Packs the rule into words for kernels on other devices. Settings that need water are left out.
    #[cfg(feature = "gpu")]
    pub(crate) fn pack(&self, words: &mut Vec<u32>) {
        let ramp = |ramp: LinearStep| [ramp.scale, ramp.shift];
        let rule = RuleWords {
            slope_scale: self.slope_scale,
            half_per_spacing: self.half_per_spacing,
            dirt: ramp(self.dirt),
            rock: ramp(self.rock),
            no_sand: ramp(self.no_sand),
            steep_sand: ramp(self.steep_sand),
            snow: ramp(self.snow),
            snow_north_m: self.snow_north_m,
            snow_slides: ramp(self.snow_slides),
            looks_around: self.is_ragged.into(),
            has_noise: self.noise.is_some().into(),
            has_scree: self.scree.is_some().into(),
            scree: ramp(self.scree.map_or(LinearStep::always(0.0), |scree| scree.lies)),
            forest_bias: self.forest.bias,
            tree_line: ramp(self.forest.tree_line),
            forest_north_m: self.forest.north_m,
            too_steep: ramp(self.forest.too_steep),
            no_meadow: ramp(self.forest.no_meadow),
            forest_edge: self.forest.edge,
            floor_scale: floor_scale(self.half_per_spacing),
        };
        push(words, rule);
        for Round { losses, roll_scales } in
            self.scree.iter().flat_map(|scree| Round::all(self.spacing_m, scree.reach_m))
        {
            push(words, RoundWords { losses, roll_scales });
        }
    }

    /// Returns the inputs of the rule beside the land itself, if it has any: noise, and whether it needs rubble.
    #[cfg(feature = "gpu")]
    pub(crate) fn ragged(&self) -> Option<(Option<&Fractal>, bool)> {
        self.is_ragged.then(|| (self.noise.as_ref(), self.scree.is_some()))
    }

    /// Returns how far a place lies below the tree line, given its height and the normal's southward component: 1 where
    /// the tree line does not thin out trees, 0 where it allows none. `last_trees_m` is the height above which there
    /// are none by the climate of the place, if it has one.
    pub fn below_tree_line(&self, height_m: f32, south: f32, last_trees_m: Option<f32>) -> f32 {
        let line = self.forest.tree_line;
        let up_m = last_trees_m.map_or(0.0, |last_m| last_m - self.forest.last_trees_m);
        1.0 - ((height_m - up_m - south * self.forest.north_m) * line.scale + line.shift).clamp(0.0, 1.0)
    }

    /// Returns the share of sand in the ground of a desert that rock and scree leave, given the share of a desert in
    /// the ground, the tilt, which is 1 less the upward component of the normal, and noise. Sand lies in fields, on
    /// ground that is about level.
    #[inline(always)]
    pub(super) fn desert_sand<S: Simd>(&self, simd: S, desert: S::F32, tilt: S::F32, noise: S::F32) -> S::F32 {
        let score = (noise + simd.splat(SAND_BIAS)) - (simd.splat(1.0) - desert) * simd.splat(SAND_OF_DESERT);
        let lies = clamp(simd, score * simd.splat(self.forest.edge) + simd.splat(0.5));
        let level = simd.splat(1.0) - ramp(simd, tilt, NO_DUNES);
        lies * clamp(simd, desert * simd.splat(LAST)) * level
    }

    /// Returns the share of scree in the ground that snow and rock leave. `rubble` is the amount of rubble beyond the
    /// rock at the place itself; at 0 there is no scree.
    #[inline(always)]
    pub(super) fn scree_share<S: Simd>(&self, simd: S, rubble: S::F32, steepness: S::F32, noise: S::F32) -> S::F32 {
        let Some(scree) = self.scree else { return simd.splat(0.0) };
        let come = rubble * (simd.splat(1.0) + noise * simd.splat(0.9));
        clamp(simd, come * simd.splat(2.5) - simd.splat(0.3)) * ramp(simd, steepness, scree.lies)
    }
}

/// Returns the share of stones in bare ground, given the share of ground that is barren by climate, and the tilt as
/// for [`GroundRule::desert_sand`]: rain and plants have not made soil of them.
#[inline(always)]
pub(super) fn stony<S: Simd>(simd: S, barren: S::F32, tilt: S::F32) -> S::F32 {
    barren * (simd.splat(LEVEL_STONES) + ramp(simd, tilt, STONES) * simd.splat(1.0 - LEVEL_STONES))
}

/// Returns the share of wetland in the ground that rock and sand leave. `damp` is 1 at a lake and 0 out of reach of
/// water.
#[inline(always)]
pub(super) fn wetland_share<S: Simd>(simd: S, damp: S::F32, noise: S::F32) -> S::F32 {
    let damp = damp * (simd.splat(1.0) + noise * simd.splat(0.6));
    clamp(simd, damp * simd.splat(3.0) - simd.splat(0.9))
}

/// Returns the noise of the ground: from the size of a forest down to the size of a glade, but no finer than vertices
/// can show.
fn noise_spec(spacing_m: f64) -> FractalSpec {
    let wavelength_m = FOREST_M.max(2.0 * VERTICES * spacing_m);
    let waves = std::iter::successors(Some(wavelength_m), |wave_m| Some(wave_m / LACUNARITY));
    let octaves = waves.take(OCTAVES).take_while(|wave_m| *wave_m >= VERTICES * spacing_m).count();
    FractalSpec { kind: FractalKind::Fbm, octaves: octaves as u32, wavelength_m, lacunarity: LACUNARITY, h: H }
}

/// Returns the wavelengths of the noise's octaves in metres.
fn waves() -> impl Iterator<Item = f64> {
    std::iter::successors(Some(FOREST_M), |wave_m| Some(wave_m / LACUNARITY)).take(OCTAVES)
}

impl Forest {
    /// Returns the share of forest in the ground that other materials leave.
    #[inline(always)]
    pub fn share<S: Simd>(self, simd: S, place: &ForestPlace<S>) -> S::F32 {
        let &ForestPlace { height, steepness, around, damp, noise, climate } = place;
        let (zero, one) = (simd.splat(0.0), simd.splat(1.0));
        let high = simd.max(along(simd, height, self.tree_line), zero);
        let steep = simd.max(along(simd, steepness, self.too_steep), zero);
        let meadow = one - ramp(simd, around, self.no_meadow);
        let against = (high * simd.splat(TREE_LINE) + steep * simd.splat(STEEP)) + meadow * simd.splat(MEADOW);
        let bank = clamp(simd, damp * simd.splat(BANK)) * simd.splat(self.likes_wet);
        // The share of forest rises with the square of the ease.
        let too_dry = (one - climate * climate) * simd.splat(self.bias_of_rain);
        let score = (noise + (simd.splat(self.bias) - too_dry)) + (bank - against);
        let stands = clamp(simd, score * simd.splat(self.edge) + simd.splat(0.5));
        let low_enough = clamp(simd, (one - high) * simd.splat(LAST));
        let wet_enough = clamp(simd, climate * simd.splat(LAST));
        stands * low_enough * clamp(simd, (one - steep) * simd.splat(LAST)) * wet_enough
    }
}

/// Returns the steepness of vertices, given the upward component of their normals.
#[inline(always)]
pub(super) fn steepness<S: Simd>(simd: S, up: S::F32, rule: &GroundRule) -> S::F32 {
    let one = simd.splat(1.0);
    simd.min((one - up) * simd.splat(rule.slope_scale), one)
}

/// Returns the position of a value on a ramp: 0 at its beginning, 1 at its end, and beyond.
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
