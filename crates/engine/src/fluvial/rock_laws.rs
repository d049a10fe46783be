//! Rock in the laws of a place: hard rock stands in steep slopes over narrow floors, soft rock lies low and wide.

use crate::geography::rock::{RockAtPlace, RockKind};

/// Factors by which a rock changes laws.
///
/// Based on: K. X. Whipple, G. E. Tucker, Dynamics of the stream-power river incision model, 1999 (beds are steep in
/// hard rock); A. D. Howard, Badland morphology and evolution, 1997 (soft rock where it is wet and where it is dry);
/// the numbers are chosen by eye.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RockFactors {
    /// Of the slope of hillsides.
    pub hill_slope: f64,
    /// Of the slope of beds.
    pub bed_slope: f64,
    /// Of the half width of floors.
    pub valley: f64,
    /// Of the height by which crests are rounded off.
    pub crest_m: f64,
    /// Of the depth of gullies and rills.
    pub gullies: f64,
    /// Of the density of brooks.
    pub brooks: f64,
}

/// The factors in the order of their fields.
type Factors = [f64; 6];

/// Rocks as they are when all else is equal: massive rock, the hardest and the softest beds of layered rock, limestone,
/// volcanic rock, and soft rock where it is wet and where it is dry.
const WHOLE: Factors = [1.15, 1.2, 0.7, 1.0, 0.5, 0.95];
const HARD_BED: Factors = [1.4, 1.4, 0.5, 0.5, 0.4, 0.85];
const SOFT_BED: Factors = [0.55, 0.7, 1.5, 1.5, 1.0, 1.15];
const LIMESTONE: Factors = [1.15, 1.1, 0.5, 0.8, 0.3, 0.5];
const LAVA: Factors = [1.0, 1.0, 0.7, 0.6, 0.8, 0.95];
const WET_CLAY: Factors = [0.5, 0.6, 1.6, 2.0, 0.6, 1.1];
const DRY_CLAY: Factors = [0.85, 0.6, 1.4, 0.3, 1.5, 1.15];

/// The least and the greatest factors of any rock.
pub const LEAST: RockFactors = RockFactors::of([0.35, 0.45, 0.4, 0.3, 0.3, 0.5]);
pub const MOST: RockFactors = RockFactors::of([1.4, 1.4, 1.7, 2.0, 1.5, 1.15]);

/// Differences between a kind's hardest and softest patches, as a factor of the slopes.
const PATCHES: f64 = 0.3;

impl RockFactors {
    /// Returns the factors of a rock, given the wetness of the place, from 0 to 1.
    pub fn new(rock: &RockAtPlace, wet: f64) -> RockFactors {
        let hard = between(HARD_BED, LIMESTONE, rock.limestone * wet);
        let kinds = RockKind::ALL.map(|kind| match kind {
            RockKind::Massive => patched(WHOLE, rock.patch_hardness),
            RockKind::Layered => between(SOFT_BED, hard, rock.bed_hardness),
            RockKind::Volcanic => patched(LAVA, rock.patch_hardness),
            RockKind::Soft => patched(between(DRY_CLAY, WET_CLAY, wet), rock.patch_hardness),
        });
        let mean = |of: usize| kinds.iter().zip(rock.shares).map(|(kind, share)| kind[of] * share).sum();
        RockFactors::of(std::array::from_fn(mean))
    }

    const fn of([hill_slope, bed_slope, valley, crest_m, gullies, brooks]: Factors) -> RockFactors {
        RockFactors { hill_slope, bed_slope, valley, crest_m, gullies, brooks }
    }
}

/// Returns the factors of a share of the way from some to others.
fn between(from: Factors, to: Factors, share: f64) -> Factors {
    std::array::from_fn(|of| from[of] + (to[of] - from[of]) * share)
}

/// Returns the factors of a patch of this hardness, from 0 to 1, among patches of a kind of rock.
fn patched([hill_slope, bed_slope, others @ ..]: Factors, hardness: f64) -> Factors {
    let harder = 1.0 + PATCHES * (hardness - 0.5);
    let [valley, crest_m, gullies, brooks] = others;
    [hill_slope * harder, bed_slope * harder, valley, crest_m, gullies, brooks]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geography::rock::ROCKS;

    #[test]
    fn no_rock_has_factors_beyond_the_bounds() {
        for kind in 0..ROCKS {
            for step in 0..16 {
                let at = |bit: i32| f64::from(step >> bit & 1);
                let mut shares = [0.0; ROCKS];
                shares[kind] = 1.0;
                let (bed_hardness, patch_hardness, limestone) = (at(0), at(1), at(2));
                let rock = RockAtPlace { shares, bed_hardness, patch_hardness, limestone, beds_m: 0.0 };
                let all = |of: RockFactors| [of.hill_slope, of.bed_slope, of.valley, of.crest_m, of.gullies, of.brooks];
                let factors = all(RockFactors::new(&rock, at(3)));
                for ((factor, least), most) in factors.into_iter().zip(all(LEAST)).zip(all(MOST)) {
                    assert!((least..=most).contains(&factor), "{rock:?}: {factors:?}");
                }
            }
        }
    }
}
