//! Lithology: the rock of a place by the one name that a geological map gives it.

use super::Setting;
use super::rock::RockKind;

/// A rock of geological maps: that of the greatest share at a place, or what ice and wind have laid over it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Lithology {
    /// Massive rock in its harder patches.
    Granite,
    /// Massive rock in its softer patches.
    Gneiss,
    /// A hard bed of layered rock.
    Sandstone,
    /// A hard bed of layered rock in which water makes caves.
    Limestone,
    /// A soft bed of layered rock.
    Shale,
    /// Lava of rifts, and old lava.
    Basalt,
    /// Lava of volcanoes over a plate that sinks.
    Andesite,
    /// Ash of volcanoes, in the softest patches of their rock.
    Tuff,
    /// Soft rock that neither ice nor wind has laid down.
    Clay,
    /// Soft rock that the sheets of ice of the last ice age left.
    Till,
    /// Dust that wind has laid on dry plains beyond the ice.
    Loess,
    /// Sand of sand seas.
    DuneSand,
}

/// Each rock, its name, and its colour.
///
/// Colours are those of the lithologic classes on the maps of the U.S. Geological Survey
/// (<https://mrdata.usgs.gov/catalog/lithclass-color.php>).
const ROWS: [(Lithology, &str, [u8; 3]); 12] = [
    (Lithology::Granite, "granite", [249, 181, 187]),
    (Lithology::Gneiss, "gneiss", [236, 214, 254]),
    (Lithology::Sandstone, "sandstone", [205, 255, 217]),
    (Lithology::Limestone, "limestone", [67, 175, 249]),
    (Lithology::Shale, "shale", [172, 228, 200]),
    (Lithology::Basalt, "basalt", [221, 179, 151]),
    (Lithology::Andesite, "andesite", [177, 72, 1]),
    (Lithology::Tuff, "tuff", [249, 211, 211]),
    (Lithology::Clay, "clay and marl", [255, 219, 103]),
    (Lithology::Till, "till", [210, 194, 124]),
    (Lithology::Loess, "loess", [245, 225, 189]),
    (Lithology::DuneSand, "dune sand", [224, 210, 180]),
];

/// Sand from which on it hides the rock: the edge of a sand sea.
const HIDING_SAND: f64 = 0.1;

/// Hardness below which volcanic rock is tuff, and massive rock gneiss.
const TUFF: f64 = 0.3;
const GNEISS: f64 = 0.5;

/// Hardness of a bed from which on it is no shale, and share of limestone among hard beds from which on it is limestone.
const HARD_BED: f64 = 0.5;
const LIMY: f64 = 0.5;

/// Volcanism, and strength of rifts, from which on lava is young, and from a rift.
const YOUNG_LAVA: f64 = 0.1;
const OF_RIFT: f64 = 0.1;

/// Droughts and mean temperatures in degrees Celsius between which dust stays where it falls, and the greatest uplift of
/// plains: steppes have a drought of 1 to 5.
const LOESS_DROUGHT: [f64; 2] = [1.0, 5.0];
const LOESS_C: [f64; 2] = [0.0, 18.0];
const PLAIN: f64 = 0.1;

impl Lithology {
    /// All rocks, in the order of their numbers in rasters, which begin with 1.
    pub fn all() -> impl Iterator<Item = Lithology> {
        ROWS.iter().map(|row| row.0)
    }

    /// Returns the rock of a place, as land even where it lies in the sea.
    pub fn of(setting: &Setting) -> Lithology {
        let Setting { land, rock, climate, sand } = setting;
        if *sand >= HIDING_SAND {
            return Lithology::DuneSand;
        }
        let share = |kind: &RockKind| rock.shares[*kind as usize];
        let kind = RockKind::ALL.into_iter().max_by(|a, b| share(a).total_cmp(&share(b))).expect("there are four");
        match kind {
            RockKind::Massive if rock.patch_hardness < GNEISS => Lithology::Gneiss,
            RockKind::Massive => Lithology::Granite,
            RockKind::Layered if rock.bed_hardness < HARD_BED => Lithology::Shale,
            RockKind::Layered if rock.limestone >= LIMY * rock.bed_hardness => Lithology::Limestone,
            RockKind::Layered => Lithology::Sandstone,
            RockKind::Volcanic if rock.patch_hardness < TUFF => Lithology::Tuff,
            RockKind::Volcanic if land.volcanism >= YOUNG_LAVA && land.rift < OF_RIFT => Lithology::Andesite,
            RockKind::Volcanic => Lithology::Basalt,
            RockKind::Soft => {
                let height_m = land.planned_m().max(0.0);
                let is_in = |value: f64, [from, to]: [f64; 2]| (from..to).contains(&value);
                let is_steppe = is_in(climate.drought(height_m), LOESS_DROUGHT);
                let is_mild = is_in(climate.temperature_c(height_m), LOESS_C);
                if setting.was_under_ice() > 0.5 {
                    Lithology::Till
                } else if is_steppe && is_mild && land.uplift < PLAIN {
                    Lithology::Loess
                } else {
                    Lithology::Clay
                }
            }
        }
    }

    /// Returns the name, as in `clay and marl`.
    pub fn name(self) -> &'static str {
        ROWS[self as usize].1
    }

    /// Returns red, green and blue (sRGB) of the rock on maps.
    pub fn colour(self) -> [u8; 3] {
        ROWS[self as usize].2
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geography::LandAtLarge;
    use crate::geography::climate::PlaceClimate;
    use crate::geography::rock::RockAtPlace;

    #[test]
    fn a_rock_follows_from_the_kind_of_greatest_share_and_from_ice_and_wind() {
        let plain = Setting {
            land: LandAtLarge { continent: 0.5, uplift: 0.02, youth: 0.0, rift: 0.0, across: 0.0, volcanism: 0.0 },
            rock: RockAtPlace {
                shares: [0.1, 0.2, 0.1, 0.6],
                bed_hardness: 0.8,
                patch_hardness: 0.6,
                limestone: 0.8,
                beds_m: 0.0,
            },
            climate: PlaceClimate { mean_c: 12.0, swing_c: 20.0, rain_mm: [800.0; 3] },
            sand: 0.0,
        };
        let dry = PlaceClimate { rain_mm: [300.0; 3], ..plain.climate };
        let of = |shares, volcanism| {
            let (rock, land) = (RockAtPlace { shares, ..plain.rock }, LandAtLarge { volcanism, ..plain.land });
            Lithology::of(&Setting { land, rock, ..plain })
        };
        assert_eq!(Lithology::of(&plain), Lithology::Clay);
        assert_eq!(Lithology::of(&Setting { climate: dry, ..plain }), Lithology::Loess);
        assert_eq!(Lithology::of(&Setting { sand: 0.5, ..plain }), Lithology::DuneSand);
        let cold = PlaceClimate { mean_c: -5.0, ..plain.climate };
        assert_eq!(Lithology::of(&Setting { climate: cold, ..plain }), Lithology::Till);
        assert_eq!(of([0.9, 0.1, 0.0, 0.0], 0.0), Lithology::Granite);
        assert_eq!(of([0.1, 0.9, 0.0, 0.0], 0.0), Lithology::Limestone);
        assert_eq!(of([0.0, 0.1, 0.9, 0.0], 0.0), Lithology::Basalt);
        assert_eq!(of([0.0, 0.1, 0.9, 0.0], 1.0), Lithology::Andesite);
    }

    #[test]
    fn rows_stand_in_the_order_of_their_rocks() {
        for (number, rock) in Lithology::all().enumerate() {
            let like = |other: &Lithology| other.name() == rock.name() || other.colour() == rock.colour();
            assert_eq!((rock as usize, Lithology::all().filter(like).count()), (number, 1), "{rock:?}");
        }
    }
}
