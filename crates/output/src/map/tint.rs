//! Hypsometric tints: colours by height and by depth.

use crate::map::style::{ColourStop, TintStyle};
use crate::preset::map::Tint;
use crate::world::World;

/// Entries of a colour table: four for each of the 256 levels of a colour channel. As `f32` they take 12 KiB, which
/// fits into a first-level cache.
const STEPS: usize = 1024;

/// The colours of a world's heights and depths, as tables of sRGB 0 to 255.
#[derive(Debug)]
pub(super) struct Tints {
    land: Vec<[f32; 3]>,
    dry_land: Vec<[f32; 3]>,
    land_low_m: f32,
    land_steps_per_m: f32,
    sea: Vec<[f32; 3]>,
    sea_steps_per_m: f32,
}

impl Tints {
    /// Creates the colours of a style for a world.
    pub fn new(style: &TintStyle, world: &World) -> Tints {
        let stops =
            |stops: &[ColourStop]| -> Vec<TintStop> { stops.iter().map(|it| (it.at as f32, it.colour.0)).collect() };
        let land = [world.preset().map.tint, Tint::Arid].map(|tint| stops(style.land(tint)));
        let mut tints = Tints::of_stops(world, land, &stops(&style.sea));
        if style.depth_steps > 0 {
            // Each step has one colour, that of its middle.
            let (smooth, steps) = (tints.sea.clone(), style.depth_steps as usize);
            for (index, colour) in tints.sea.iter_mut().enumerate() {
                // Steps are equal in the square root of depth, so that they are wider in the deep, where depths vary
                // more.
                let step = ((index as f32 / STEPS as f32).sqrt() * steps as f32).floor();
                let share = (step + 0.5) / steps as f32;
                *colour = smooth[((share * share * STEPS as f32) as usize).min(STEPS - 1)];
            }
        }
        tints
    }

    /// Creates the tables. `land` has the colours of usual and of dry land, which run from the lowest to the highest
    /// height that a map of the world shows; sea colours run down to the greatest depth that the world can have.
    ///
    /// Without a range in the preset, land colours run from the sea level (or the lowest height) to the highest height
    /// that the world can have.
    fn of_stops(world: &World, land: [Vec<TintStop>; 2], sea: &[TintStop]) -> Tints {
        let preset = world.preset();
        let (lowest_m, highest_m) = world.height_range_m();
        let sea_level_m = preset.sea_level_m.map_or(f32::NEG_INFINITY, |level| level as f32);
        let low_m = preset.map.low_m.map_or(sea_level_m.max(lowest_m), |low| low as f32);
        let high_m = preset.map.high_m.map_or(highest_m, |high| high as f32);
        // The range is that of the world and not of a tile, so that neighbours agree on a colour. It is a metre at
        // least, because level land would divide by zero.
        let [land, dry_land] = land.map(|stops| table(&stops));
        Tints {
            land,
            dry_land,
            land_low_m: low_m,
            land_steps_per_m: (STEPS - 1) as f32 / (high_m - low_m).max(1.0),
            sea: table(sea),
            sea_steps_per_m: (STEPS - 1) as f32 / (low_m - lowest_m).max(1.0),
        }
    }

    /// The lowest and the highest land that the colours tell apart, in metres.
    pub fn range_m(&self) -> (f32, f32) {
        (self.land_low_m, self.land_low_m + (STEPS - 1) as f32 / self.land_steps_per_m)
    }

    /// Returns the colour of land at a height. Heights beyond the ends of the table have the colour of that end.
    pub fn land(&self, height_m: f32) -> [f32; 3] {
        self.land[self.step_of(height_m)]
    }

    /// Returns the colour of land at a height, given its dryness from 0, where it has the usual colours, to 1.
    pub fn land_by_dryness(&self, height_m: f32, dryness: f32) -> [f32; 3] {
        let (usual, dry) = (self.land(height_m), self.dry_land[self.step_of(height_m)]);
        [0, 1, 2].map(|channel| usual[channel] + (dry[channel] - usual[channel]) * dryness)
    }

    fn step_of(&self, height_m: f32) -> usize {
        step((height_m - self.land_low_m) * self.land_steps_per_m)
    }

    /// Returns the colour of the sea over a depth.
    pub fn sea(&self, depth_m: f32) -> [f32; 3] {
        self.sea[step(depth_m * self.sea_steps_per_m)]
    }
}

fn step(position: f32) -> usize {
    // Casts to integers saturate, so heights below the scale have its first colour.
    (position as usize).min(STEPS - 1)
}

/// A colour at a position on the scale, 0 to 1.
type TintStop = (f32, [u8; 3]);

/// Makes a table of colours between stops, interpolated in OKLab, where equal steps look equal.
fn table(stops: &[TintStop]) -> Vec<[f32; 3]> {
    let stops: Vec<(f32, [f32; 3])> = stops.iter().map(|(at, colour)| (*at, oklab(*colour))).collect();
    let colour = |index: usize| {
        let at = index as f32 / (STEPS - 1) as f32;
        // The first stop at or after the position, but at least the second one, so that there is a stop before it.
        let after = stops.iter().position(|stop| stop.0 >= at).unwrap_or(stops.len() - 1).max(1);
        let ((low, from), (high, to)) = (stops[after - 1], stops[after]);
        let share = (at - low) / (high - low);
        srgb([0, 1, 2].map(|axis| from[axis] + (to[axis] - from[axis]) * share))
    };
    (0..STEPS).map(colour).collect()
}

// OKLab. Based on: Björn Ottosson, "A perceptual color space for image processing" (2020). `libm` instead of the
// platform's functions keeps the picture's bytes the same everywhere.

fn oklab(colour: [u8; 3]) -> [f32; 3] {
    let [r, g, b] = colour.map(|channel| {
        let channel = channel as f32 / 255.0;
        if channel <= 0.040_45 { channel / 12.92 } else { libm::powf((channel + 0.055) / 1.055, 2.4) }
    });
    let l = libm::cbrtf(0.412_221_46 * r + 0.536_332_55 * g + 0.051_445_995 * b);
    let m = libm::cbrtf(0.211_903_5 * r + 0.680_699_5 * g + 0.107_396_96 * b);
    let s = libm::cbrtf(0.088_302_46 * r + 0.281_718_85 * g + 0.629_978_7 * b);
    [
        0.210_454_26 * l + 0.793_617_8 * m - 0.004_072_047 * s,
        1.977_998_5 * l - 2.428_592_2 * m + 0.450_593_7 * s,
        0.025_904_037 * l + 0.782_771_77 * m - 0.808_675_77 * s,
    ]
}

fn srgb([lightness, a, b]: [f32; 3]) -> [f32; 3] {
    let l = lightness + 0.396_337_78 * a + 0.215_803_76 * b;
    let m = lightness - 0.105_561_346 * a - 0.063_854_17 * b;
    let s = lightness - 0.089_484_18 * a - 1.291_485_5 * b;
    let [l, m, s] = [l * l * l, m * m * m, s * s * s];
    [
        4.076_741_7 * l - 3.307_711_6 * m + 0.230_969_94 * s,
        -1.268_438 * l + 2.609_757_4 * m - 0.341_319_4 * s,
        -0.004_196_086 * l - 0.703_418_6 * m + 1.707_614_7 * s,
    ]
    .map(|channel| {
        let channel = channel.clamp(0.0, 1.0);
        255.0 * if channel <= 0.003_130_8 { channel * 12.92 } else { 1.055 * libm::powf(channel, 1.0 / 2.4) - 0.055 }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map::style::Style;
    use crate::preset::Preset;

    #[test]
    fn stops_keep_their_colours() {
        let style = Style::load("plain").unwrap();
        let (_, mut preset) = Preset::load("alps").unwrap();
        (preset.map.low_m, preset.map.high_m) = (Some(0.0), Some(1000.0));
        for tint in [Tint::Temperate, Tint::Arid, Tint::Alpine] {
            preset.map.tint = tint;
            let tints = Tints::new(&style.tint, &World::new(preset.clone(), None).unwrap());
            let stops = style.tint.land(tint);
            for (height_m, stop) in [(-5.0, stops[0]), (1500.0, stops[stops.len() - 1])] {
                for (got, expected) in tints.land(height_m).iter().zip(stop.colour.0) {
                    assert!((got - f32::from(expected)).abs() < 0.5, "{tint:?} {:?} {stop:?}", tints.land(height_m));
                }
            }
        }
    }
}
