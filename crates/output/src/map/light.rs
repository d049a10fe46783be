//! Light and shadow on the ground of a map, in SIMD lanes.

use crate::simd::{Kernel, Simd};

/// Pixels lit at once: a multiple of all lane counts.
pub(super) const CHUNK: usize = 256;

/// Number of heights that a row has for a chunk: one more on each side, and room for the last lanes.
pub(super) const WIDE: usize = CHUNK + 2;

/// Brightness of level ground under a light 45 degrees above the horizon.
const FLAT: f32 = std::f32::consts::FRAC_1_SQRT_2;

/// Cosine and sine of 60 degrees: the softer side lights stand this far to the left and right of the main light.
const HALF: f32 = 0.5;
const SINE: f32 = 0.866_025_4;

/// Slope of wide landforms (rise over run) at which the light turns half as far as on steep ones.
const TURNED: f32 = 0.12;

/// Least rise of a shore within a pixel, in metres. Flatter shores get a harder edge than they could have.
pub(super) const LEAST_RISE_M: f32 = 0.02;

/// The parameters of the light, from a style and a scale.
#[derive(Clone, Debug)]
pub(super) struct Lamp {
    pub metres_per_pixel: f32,
    pub sea_level_m: f32,
    /// Direction towards the sun: east and south.
    pub sun: [f32; 2],
    /// Tangent of the largest angle by which the light turns.
    pub turn: f32,
    /// Share of the light that comes from the two side lights together.
    pub soften: f32,
    pub steepening: f32,
    pub strength: f32,
    pub texture: f32,
    pub aerial: f32,
    pub haze: [f32; 3],
    pub haze_share: f32,
    pub under_water: f32,
    pub shadow: [f32; 3],
    pub light: [f32; 3],
    /// Share of `light` that is mixed in where a slope is fully lit.
    pub highlight: f32,
    /// Height of the lowest land in metres, and the factor that turns metres above it into a share of the range of
    /// heights.
    pub low_m: f32,
    pub per_m: f32,
}

/// Lights a chunk of pixels.
pub(super) struct Light<'a> {
    pub lamp: &'a Lamp,
    /// Number of pixels wanted, from the first on.
    pub count: usize,
    /// Heights of the chunk's row and of the rows north and south of it, from a pixel west of the chunk to one east of
    /// it.
    pub heights: [&'a [f32; WIDE]; 3],
    /// The same rows of smoothed heights, in which only wide landforms are left.
    pub smooth: [&'a [f32; WIDE]; 3],
    /// Texture shading: how much ridges stand out, at all sizes alike.
    pub texture: &'a [f32; CHUNK],
    /// Change of tone by the visible sky and by cast shadow; positive is lighter.
    pub open: &'a [f32; CHUNK],
    /// Tints of land and of sea, 0 to 255.
    pub land: &'a [[f32; CHUNK]; 3],
    pub sea: &'a [[f32; CHUNK]; 3],
    /// Cover of the ground: red, green and blue times the visible share, and that share.
    pub cover: [&'a [f32; CHUNK]; 4],
    /// The pixels: red in the lowest byte, then green and blue.
    pub words: &'a mut [u32; CHUNK],
}

impl Kernel for Light<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let lamp = self.lamp;
        let (zero, one) = (simd.splat(0.0), simd.splat(1.0));
        let steepening = simd.splat(lamp.steepening);
        let per_pixel = simd.splat(0.125 / lamp.metres_per_pixel);
        let mut at = 0;
        while at < self.count {
            let [east, south] = slope(simd, self.heights, at);
            let [east, south] = [east * per_pixel, south * per_pixel];
            let [wide_east, wide_south] = slope(simd, self.smooth, at);
            let wide = steepening * per_pixel;
            // Downhill direction of wide landforms, in the frame of the sun. The sine of twice the angle between the
            // two turns the light.
            let [wide_east, wide_south] = [zero - wide_east * wide, zero - wide_south * wide];
            let (sun_east, sun_south) = (simd.splat(lamp.sun[0]), simd.splat(lamp.sun[1]));
            let steep = wide_east * wide_east + wide_south * wide_south;
            let along = wide_east * sun_east + wide_south * sun_south;
            let across = wide_south * sun_east - wide_east * sun_south;
            let twice = (along + along) * across / (steep + simd.splat(TURNED * TURNED));
            let turn = simd.splat(lamp.turn) * twice;
            let length = simd.sqrt(one + turn * turn);
            let main_east = (sun_east - sun_south * turn) / length;
            let main_south = (sun_south + sun_east * turn) / length;
            let (normal_east, normal_south) = (zero - east * steepening, zero - south * steepening);
            let scale = simd.splat(FLAT) / simd.sqrt((one + normal_east * normal_east) + normal_south * normal_south);
            let (half, sine) = (simd.splat(HALF), simd.splat(SINE));
            let main = simd.max(normal_east * main_east + normal_south * main_south + one, zero);
            let left_east = main_east * half - main_south * sine;
            let left_south = main_south * half + main_east * sine;
            let left = simd.max(normal_east * left_east + normal_south * left_south + one, zero);
            let right_east = main_east * half + main_south * sine;
            let right_south = main_south * half - main_east * sine;
            let right = simd.max(normal_east * right_east + normal_south * right_south + one, zero);
            let (ahead, side) = (simd.splat(1.0 - lamp.soften), simd.splat(0.5 * lamp.soften));
            let lit = (main * ahead + (left + right) * side) * scale - simd.splat(FLAT);
            // Aerial perspective: the lower the land, the weaker its shading, since more air lies above it.
            let smooth = simd.load(&self.smooth[1][at + 1..]);
            let elevation = (smooth - simd.splat(lamp.low_m)) * simd.splat(lamp.per_m);
            let low = one - simd.min(simd.max(elevation, zero), one);
            let texture = simd.load(&self.texture[at..]);
            let texture = texture / (one + simd.max(texture, zero - texture) * simd.splat(2.5));
            let tone = lit * (one - low * simd.splat(lamp.aerial)) + texture * simd.splat(lamp.texture);
            let tone = (tone + simd.load(&self.open[at..])) * simd.splat(lamp.strength);
            let deep = lit * simd.splat(lamp.under_water * lamp.strength);
            let haze = low * simd.splat(lamp.haze_share);
            // Share of the pixel that the sea covers, from the distance to the shore: depth divided by the rise within
            // a pixel.
            let rise_m = simd.sqrt(east * east + south * south) * simd.splat(lamp.metres_per_pixel);
            let depth_m = simd.splat(lamp.sea_level_m) - simd.load(&self.heights[1][at + 1..]);
            let sea = depth_m / simd.max(rise_m, simd.splat(LEAST_RISE_M)) + simd.splat(0.5);
            let sea = simd.min(simd.max(sea, zero), one);
            let bare = one - simd.load(&self.cover[3][at..]);
            let [bright, dark] = shares(simd, lamp, tone);
            let [deep_bright, deep_dark] = shares(simd, lamp, deep);
            let mut word = simd.splat_u32(0);
            let mut channel = 3;
            // From blue to red: each round shifts the channels before it up by a byte.
            while channel > 0 {
                channel -= 1;
                let (light, shadow) = (simd.splat(lamp.light[channel]), simd.splat(lamp.shadow[channel]) - one);
                let covered = simd.load(&self.land[channel][at..]) * bare + simd.load(&self.cover[channel][at..]);
                let land = (covered + (light - covered) * bright) * (one + shadow * dark);
                let land = land + (simd.splat(lamp.haze[channel]) - land) * haze;
                let water = simd.load(&self.sea[channel][at..]);
                let water = (water + (light - water) * deep_bright) * (one + shadow * deep_dark);
                let colour = land + (water - land) * sea;
                let colour = simd.min(simd.max(colour, zero) + simd.splat(0.5), simd.splat(255.0));
                word = simd.shl::<8>(word) | simd.truncate_to_i32(colour);
            }
            simd.store_u32(word, &mut self.words[at..]);
            at += S::LANES;
        }
    }
}

/// Returns the share of full light that is mixed in and the depth of the shadow. `tone` is the light relative to level
/// ground.
#[inline(always)]
fn shares<S: Simd>(simd: S, lamp: &Lamp, tone: S::F32) -> [S::F32; 2] {
    let (zero, one) = (simd.splat(0.0), simd.splat(1.0));
    let bright = simd.min(simd.max(tone, zero) * simd.splat(1.0 / (1.0 - FLAT)), one) * simd.splat(lamp.highlight);
    let dark = simd.min(simd.max(zero - tone, zero) * simd.splat(1.0 / FLAT), one);
    [bright, dark]
}

/// Returns eight times the rise per pixel, to the east and to the south: weighted differences of the eight neighbours.
///
/// Based on: B. K. P. Horn, "Hill shading and the reflectance map" (1981).
#[inline(always)]
fn slope<S: Simd>(simd: S, [north, middle, south]: [&[f32; WIDE]; 3], at: usize) -> [S::F32; 2] {
    let [north_west, north_middle, north_east] =
        [simd.load(&north[at..]), simd.load(&north[at + 1..]), simd.load(&north[at + 2..])];
    let [west, east] = [simd.load(&middle[at..]), simd.load(&middle[at + 2..])];
    let [south_west, south_middle, south_east] =
        [simd.load(&south[at..]), simd.load(&south[at + 1..]), simd.load(&south[at + 2..])];
    let two = simd.splat(2.0);
    let rise_east = (north_east - north_west) + two * (east - west) + (south_east - south_west);
    let rise_south = (south_west - north_west) + two * (south_middle - north_middle) + (south_east - north_east);
    [rise_east, rise_south]
}
