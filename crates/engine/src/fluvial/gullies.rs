//! Gullies: the furrows that run down the hillsides between the channels of the network.
//!
//! Stripes that run down the fall line are carved into the land, octave by octave, each octave down the slopes that the
//! ones before have made; then a little roughness is added. Both fade out towards the channels and the crests. Gullies
//! are so shallow that the land still falls along the fall line. Pits remain where the fall line turns and where the
//! land is rough; breaches open them.
//!
//! Based on: R. Johansen (runevision), Fast and Gorgeous Erosion Filter, 2026.
//!
//! To judge the numbers chosen by eye, look at hillshades of `alps` and `badlands`.

use std::mem;

use crate::area::{Area, Stride};
use crate::clock::Clock;
use crate::fluvial::fields::Fields;
use crate::fluvial::hillsides::{Hillsides, NodeValues};
use crate::fluvial::valley::Valleys;
use crate::fluvial::warp::Displaced;
use crate::hash::{self, Stream};
use crate::noise::{Fractal, FractalKind, FractalSpec, Stripes};
use crate::simd::{Kernel, MAX_LANES, Simd, dispatch};
use crate::stop::Stopped;

/// The gullies of a world.
#[derive(Debug)]
pub struct Gullies {
    octaves: Vec<Wave>,
    /// Mean depths in metres of the octaves that are too short to be seen, where the hillside's slope is 1 and gullies
    /// are deepest, each with true for rills.
    unseen_m: Vec<(f32, bool)>,
    roughness: Fractal,
    /// Height in metres of the roughness where the hillside's slope is 1 and hillsides are roughest.
    rough_m: f32,
    spacing_m: f32,
}

#[derive(Debug)]
struct Wave {
    stripes: Stripes,
    /// True for rills, whose depth differs from place to place in another way than that of the longer gullies.
    are_rills: bool,
    /// Metres from crest to floor where the hillside's slope is 1 and gullies are deepest.
    depth_m: f32,
    /// Noise that makes the octave deep in some places and leaves it out in others.
    patches: Option<Fractal>,
    /// Factor of `flank`, which gives the slope across the stripes where the hillside's slope is 1 and gullies are
    /// deepest.
    slope: f32,
}

/// Wavelength of the first octave in cells of the finest level, so that gullies go on from the brooks; and the ratio of
/// each wavelength to the next. The ratio is not 2, or crests of two octaves would fall together.
const FIRST_WAVE: f64 = 0.9;
const WAVE_RATIO: f64 = 2.1;

/// Wavelength of the noise that decides where rills are deep, in cells of the finest level. Chosen by eye.
const PATCH_WAVE: f64 = 1.5;

/// Largest number of octaves of gullies.
const MOST_OCTAVES: usize = 3;

/// Depth of gullies as a share of their wavelength, where the settings ask for whole gullies on a slope of 1: so
/// shallow that their flanks are less steep than the hillside, and fall along it.
const DEPTH: f64 = 0.2;

/// Wavelength of the roughness in cells of the finest level; the exponent by which each octave is lower than the one
/// before; and its height as a share of its wavelength, where the settings ask for all of it on a slope of 1. Chosen by
/// eye, beside hillshades of real mountains: hillsides look polished without it, and crumpled if its waves are as long
/// as gullies are wide.
const ROUGH_WAVE: f64 = 0.33;
const ROUGH_H: f64 = 0.7;
const ROUGHNESS: f64 = 0.1;

/// Distance below the next-best side, in depths of a gully, from which on a gully has its whole depth: nearer to the
/// crest it is less deep.
const CREST_DEPTHS: f32 = 4.0;

/// Height above the channel, in depths of a gully, below which gullies fade out towards the floor.
const FLOOR_DEPTHS: f32 = 0.5;

/// Wavelength in vertices below which waves cannot be seen.
const SHORTEST: f64 = 3.0;

/// Metres added to a divisor in metres, which may be 0.
const LEAST_M: f32 = 1e-3;

/// Distances in vertices of the passes that smooth the fall line and the channel's height: the sides of a steep channel
/// are facets, from one to the next of which both jump, and gullies would be broken there.
const SMOOTHED: [usize; 3] = [1, 2, 4];

/// Returns the area whose warp gullies read: the fall line at each vertex of their [`valley_input`] depends on the warp
/// of the vertices beside it.
pub fn input(area: Area) -> Area {
    valley_input(area).padded(1)
}

/// Returns the area whose valleys gullies read: the fall line of a vertex depends on those around it.
pub fn valley_input(area: Area) -> Area {
    area.padded(SMOOTHED.iter().sum())
}

impl Gullies {
    /// Creates the gullies of a world with these fields; `None` if it has none.
    ///
    /// Octaves that are too short to be seen are carved as their mean, except at a stride of 1.
    pub fn new(fields: &Fields, stride: Stride, seed: u64) -> Option<Gullies> {
        let carves_unseen = stride != Stride::ONE;
        let spacing_m = fields.spacing_m() * stride.vertices() as f64;
        let most = fields.most_laws();
        let finest_m = fields.side(fields.levels() - 1) as f64 * fields.metres_a_grain();
        if most.gullies == 0.0 {
            return None;
        }
        // A fourth octave would cost as much as each of the three, and be lower than the roughness.
        let waves_m = std::iter::successors(Some(FIRST_WAVE * finest_m), |wave_m| Some(wave_m / WAVE_RATIO));
        let waves_m: Vec<f64> = waves_m.take(MOST_OCTAVES).collect();
        let is_seen = |wave_m: &f64| *wave_m >= SHORTEST * spacing_m;
        // If rills were all over a face, it would look combed.
        let patches = || {
            let wavelength_m = PATCH_WAVE * finest_m;
            let spec = FractalSpec { kind: FractalKind::Fbm, octaves: 1, wavelength_m, lacunarity: 2.0, h: 1.0 };
            Fractal::new(&spec, spacing_m, hash::stream(seed, Stream::Rills))
        };
        let are_rills = |index: usize| index + 1 == MOST_OCTAVES;
        let depth_m = |index: usize, wave_m: f64| {
            let strength = if are_rills(index) { most.rills } else { most.gullies };
            strength * DEPTH * wave_m
        };
        let octave = |(index, wave_m): (usize, &f64)| {
            let depth_m = depth_m(index, *wave_m);
            Wave {
                are_rills: are_rills(index),
                stripes: Stripes::new(*wave_m, spacing_m, hash::stream(seed, Stream::Gullies.of(index as u64))),
                depth_m: depth_m as f32,
                patches: (are_rills(index) && fields.has_rills()).then(patches),
                // The largest slope of `depth / 2 * cos(2 pi x / wave)` along x.
                slope: (depth_m * std::f64::consts::PI / wave_m) as f32,
            }
        };
        let octaves = waves_m.iter().enumerate().filter(|(_, wave_m)| is_seen(wave_m)).map(octave).collect();
        // In the mean half of the depth is carved, and rills are there on half of the faces.
        let unseen = waves_m.iter().enumerate().filter(|(_, wave_m)| !is_seen(wave_m)).map(|(index, wave_m)| {
            let in_patches = are_rills(index) && fields.has_rills();
            ((depth_m(index, *wave_m) * if in_patches { 0.25 } else { 0.5 }) as f32, are_rills(index))
        });
        let unseen_m = unseen.filter(|_| carves_unseen).collect();
        // As many octaves as the lattice can show.
        let rough_wave_m = (ROUGH_WAVE * finest_m).max(spacing_m);
        let count = (1..=5).rev().find(|n| rough_wave_m / f64::from(1 << (n - 1)) >= spacing_m).unwrap_or(1);
        let spec = FractalSpec {
            kind: FractalKind::Fbm,
            octaves: count,
            wavelength_m: rough_wave_m,
            lacunarity: 2.0,
            h: ROUGH_H,
        };
        Some(Gullies {
            octaves,
            unseen_m,
            roughness: Fractal::new(&spec, spacing_m, hash::stream(seed, Stream::Roughness)),
            rough_m: (most.roughness * ROUGHNESS * rough_wave_m) as f32,
            spacing_m: spacing_m as f32,
        })
    }

    /// Returns the metres below the next-best side from which on gullies do not ask how far it is, if no hillside is
    /// steeper than `steepest`.
    pub fn crest_read_m(&self, steepest: f32) -> f32 {
        let deepest_m = self.octaves.iter().map(|octave| octave.depth_m).fold(self.rough_m, f32::max);
        CREST_DEPTHS * deepest_m * steepest + LEAST_M
    }

    /// Carves the heights of all nodes. The results are right at nodes whose [`input`] lies within the nodes. Rows must
    /// be whole patches.
    pub fn carve(
        &self,
        nodes: &Displaced,
        hillsides: &Hillsides,
        valleys: &mut Valleys,
        clock: &Clock,
    ) -> Result<(), Stopped> {
        let area = nodes.area;
        let len = area.len();
        let warp = nodes.metres.each_ref().map(|metres| &metres[..]);
        let mut fall = [vec![0.0; len], vec![0.0; len]];
        dispatch(FallLine { area, spacing_m: self.spacing_m, warp, valleys, fall: &mut fall });
        let mut foot_m = valleys.level_m.clone();
        let [x, y] = &mut fall;
        let mut smoothed = vec![0.0; len];
        for values in [x, y, &mut foot_m] {
            for apart in SMOOTHED {
                for apart in [apart, apart * area.width()] {
                    dispatch(Smooth { apart, values, smoothed: &mut smoothed });
                    mem::swap(values, &mut smoothed);
                }
            }
        }
        let (mut across, mut crest, mut flank) = ([vec![0.0; len], vec![0.0; len]], vec![0.0; len], vec![0.0; len]);
        // Octaves add up what they carve, and the sum is taken off at the end: so all see the hillside as the valleys
        // made it.
        let Valleys { height_m, level_m, crest_m, steepness, .. } = valleys;
        let hillside = Hillside { height_m, level_m, foot_m: &foot_m, crest_m, steepness, slope: &hillsides.slope };
        let depth = |are_rills: bool| if are_rills { &hillsides.rills } else { &hillsides.gullies };
        let mut carved = vec![0.0; len];
        let mut patches = vec![0.0; len];
        for octave in &self.octaves {
            clock.check()?;
            if let Some(noise) = &octave.patches {
                noise.fill(area, None, &mut patches);
            }
            dispatch(Across { fall: &fall, across: &mut across });
            octave.stripes.fill(area, &across, &mut crest, &mut flank);
            dispatch(CarveOctave {
                depth_m: octave.depth_m,
                slope: octave.slope,
                depth: depth(octave.are_rills),
                hillside,
                across: &across,
                crest: &crest,
                flank: &flank,
                patches: octave.patches.as_ref().map(|_| &patches[..]),
                fall: &mut fall,
                carved: &mut carved,
            });
        }
        // The mean of an octave is carved as if the whole hillside were the level floor of a gully.
        crest.fill(-1.0);
        flank.fill(0.0);
        for (depth_m, are_rills) in &self.unseen_m {
            let (across, crest, flank) = (&across, &crest, &flank);
            let (fall, carved) = (&mut fall, &mut carved);
            let (depth_m, slope, depth, patches) = (*depth_m, 0.0, depth(*are_rills), None);
            dispatch(CarveOctave { depth_m, slope, depth, hillside, across, crest, flank, patches, fall, carved });
        }
        self.roughness.fill(area, None, &mut crest);
        dispatch(Roughen {
            rough_m: self.rough_m,
            roughness: &hillsides.roughness,
            hillside,
            noise: &crest,
            carved: &mut carved,
        });
        height_m.copy_from_slice(&carved);
        Ok(())
    }
}

/// The direction in which the land rises at each vertex of the world, derived from the direction in the warped plane.
struct FallLine<'a> {
    area: Area,
    spacing_m: f32,
    warp: [&'a [f32]; 2],
    valleys: &'a Valleys,
    fall: &'a mut [Vec<f32>; 2],
}

impl Kernel for FallLine<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let (width, len) = (self.area.width(), self.area.len());
        let [east, south] = self.warp;
        let one = simd.splat(1.0);
        let per_metre = simd.splat(0.5 / self.spacing_m);
        // Results at the edges are not used, because these vertices lack neighbours.
        for at in (0..len).step_by(S::LANES) {
            let bend =
                |metres: &[f32], by: usize| (after(simd, metres, at, by) - before(simd, metres, at, by)) * per_metre;
            let (east_x, east_y) = (bend(east, 1), bend(east, width));
            let (south_x, south_y) = (bend(south, 1), bend(south, width));
            // By the chain rule: the height's gradient in the plane, times how the plane is bent here.
            let away = [simd.load(&self.valleys.away[0][at..]), simd.load(&self.valleys.away[1][at..])];
            let x = away[0] * (one + east_x) + away[1] * south_x;
            let y = away[0] * east_y + away[1] * (one + south_y);
            simd.store(x, &mut self.fall[0][at..]);
            simd.store(y, &mut self.fall[1][at..]);
        }
    }
}

/// Returns the lanes that lie `by` values before those at an index; any value where there are none.
#[inline(always)]
fn before<S: Simd>(simd: S, values: &[f32], at: usize, by: usize) -> S::F32 {
    beside(simd, values, at as isize - by as isize)
}

/// Returns the lanes that lie `by` values after those at an index; any value where there are none.
#[inline(always)]
fn after<S: Simd>(simd: S, values: &[f32], at: usize, by: usize) -> S::F32 {
    beside(simd, values, at as isize + by as isize)
}

/// Returns the lanes from an index on, which may lie beyond the ends.
#[inline(always)]
fn beside<S: Simd>(simd: S, values: &[f32], first: isize) -> S::F32 {
    match (0..=values.len() as isize - S::LANES as isize).contains(&first) {
        true => simd.load(&values[first as usize..]),
        false => simd.load(&one_by_one(values, first)),
    }
}

/// Returns single values from an index on, and the first or the last value beyond the ends: some lanes of a group may
/// lie there.
// Few groups lie at the ends, and the others are faster if this is not inlined.
#[cold]
#[inline(never)]
fn one_by_one(values: &[f32], first: isize) -> [f32; MAX_LANES] {
    std::array::from_fn(|lane| values[(first + lane as isize).clamp(0, values.len() as isize - 1) as usize])
}

/// The weighted mean of each value and its neighbours on both sides: the value counts for as much as both together.
struct Smooth<'a> {
    /// Distance from a value to its neighbours that count.
    apart: usize,
    values: &'a [f32],
    smoothed: &'a mut [f32],
}

impl Kernel for Smooth<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let half = simd.splat(0.5);
        for at in (0..self.values.len()).step_by(S::LANES) {
            // Values at the edges have no neighbours, and are not used.
            let around = half * (before(simd, self.values, at, self.apart) + after(simd, self.values, at, self.apart));
            simd.store(half * (simd.load(&self.values[at..]) + around), &mut self.smoothed[at..]);
        }
    }
}

/// The unit vector across the fall line.
struct Across<'a> {
    fall: &'a [Vec<f32>; 2],
    across: &'a mut [Vec<f32>; 2],
}

impl Kernel for Across<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        for at in (0..self.fall[0].len()).step_by(S::LANES) {
            let (x, y) = (simd.load(&self.fall[0][at..]), simd.load(&self.fall[1][at..]));
            // On a crest or a floor there is no direction; the least length keeps the vector short instead of
            // undefined.
            let length = simd.sqrt(x * x + y * y);
            let scale = simd.splat(1.0) / simd.max(length, simd.splat(1e-6));
            simd.store(-y * scale, &mut self.across[0][at..]);
            simd.store(x * scale, &mut self.across[1][at..]);
        }
    }
}

/// The hillside at each vertex before anything is carved.
#[derive(Clone, Copy)]
struct Hillside<'a> {
    height_m: &'a [f32],
    /// Height of the channel that the vertex drains to.
    level_m: &'a [f32],
    /// The same, smoothed.
    foot_m: &'a [f32],
    crest_m: &'a [f32],
    steepness: &'a [f32],
    slope: &'a [f32],
}

/// Returns the share of a detail, `detail_m` metres high, that a place takes: 0 in the channel and on the crest.
#[inline(always)]
fn share<S: Simd>(simd: S, place: &Hillside<'_>, at: usize, detail_m: S::F32) -> S::F32 {
    let height_m = simd.load(&place.height_m[at..]);
    let rise_m = simd.max(height_m - simd.load(&place.foot_m[at..]), simd.splat(0.0));
    let crest_m = simd.load(&place.crest_m[at..]);
    let least = simd.splat(LEAST_M);
    // A hyperbola that is a half where the place is a few details above the channel.
    let channel = rise_m / (rise_m + detail_m * simd.splat(3.0) + least);
    // By the smoothed height the share is not 0 in the channel itself, so the true height counts as well.
    let above = (height_m - simd.load(&place.level_m[at..])) / (detail_m * simd.splat(FLOOR_DEPTHS) + least);
    let above = simd.min(simd.max(above, simd.splat(0.0)), simd.splat(1.0));
    let channel = channel * above * above * (simd.splat(3.0) - (above + above));
    // The slope of the share is 0 at the crest, where the land falls less than on the hillside, and at the whole depth,
    // as the distance to the crest is not known further down.
    let below = simd.min(crest_m / (detail_m * simd.splat(CREST_DEPTHS) + least), simd.splat(1.0));
    let crest = below * below * (simd.splat(3.0) - (below + below));
    channel * crest * simd.load(&place.steepness[at..])
}

/// Carves one octave of stripes, and turns the fall line towards its gullies.
struct CarveOctave<'a> {
    /// As of a [`Wave`].
    depth_m: f32,
    slope: f32,
    /// Depth of the gullies at each vertex, as a share of the greatest.
    depth: &'a NodeValues,
    hillside: Hillside<'a>,
    across: &'a [Vec<f32>; 2],
    crest: &'a [f32],
    flank: &'a [f32],
    /// Noise of the patches, if the octave has any.
    patches: Option<&'a [f32]>,
    fall: &'a mut [Vec<f32>; 2],
    carved: &'a mut [f32],
}

impl Kernel for CarveOctave<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let half = simd.splat(0.5);
        for at in (0..self.carved.len()).step_by(S::LANES) {
            let deep = self.depth.load(simd, at);
            let depth = simd.splat(self.depth_m) * simd.load(&self.hillside.slope[at..]) * deep;
            let mut share = share(simd, &self.hillside, at, depth);
            if let Some(patches) = self.patches {
                let patch = half + simd.load(&patches[at..]);
                share = share * simd.min(simd.max(patch, simd.splat(0.0)), simd.splat(1.0));
            }
            let carved = simd.load(&self.carved[at..]) + depth * share * (half - half * simd.load(&self.crest[at..]));
            simd.store(carved, &mut self.carved[at..]);
            // The slope of the stripes, relative to the hillside's slope.
            let turn = share * simd.splat(self.slope) * deep * simd.load(&self.flank[at..]);
            for axis in [0, 1] {
                let fall = simd.load(&self.fall[axis][at..]) - turn * simd.load(&self.across[axis][at..]);
                simd.store(fall, &mut self.fall[axis][at..]);
            }
        }
    }
}

/// Turns the carved depth into the height that is left, and adds the roughness.
struct Roughen<'a> {
    rough_m: f32,
    /// Roughness at each vertex, as a share of the greatest.
    roughness: &'a NodeValues,
    hillside: Hillside<'a>,
    noise: &'a [f32],
    carved: &'a mut [f32],
}

impl Kernel for Roughen<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        for at in (0..self.carved.len()).step_by(S::LANES) {
            let rough = simd.splat(self.rough_m) * simd.load(&self.hillside.slope[at..]);
            let rough = rough * self.roughness.load(simd, at);
            let share = share(simd, &self.hillside, at, rough);
            let (height, level) = (simd.load(&self.hillside.height_m[at..]), simd.load(&self.hillside.level_m[at..]));
            let height = height - simd.load(&self.carved[at..]) + rough * share * simd.load(&self.noise[at..]);
            // Never below the channel.
            simd.store(simd.max(height, level), &mut self.carved[at..]);
        }
    }
}
