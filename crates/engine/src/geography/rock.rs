//! Rock: the kind of rock at the surface of a place, and how hard it is.
//!
//! Four kinds of rock share the land in provinces of some tens of kilometres. Layered rock lies in beds, hard ones upon
//! soft ones; where they are tilted or folded, each bed comes to the surface in a band of its own. Bands are the level
//! lines of the height at which the beds lie, so they run along the folds, and around basins and domes.
//!
//! Everything is a function of the place alone.

use super::turned_noise::TurnedNoise;
use crate::geometry::{length, smooth};
use crate::grain_point::Point;
use crate::hash::{self, Stream};
use crate::noise::point_noise::PointField;

/// A kind of rock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RockKind {
    /// Granite and gneiss.
    Massive,
    /// Beds of sandstone, limestone and shale.
    Layered,
    /// Basalt, andesite and tuff.
    Volcanic,
    /// Clay, marl, loess and till.
    Soft,
}

/// Number of kinds of rock.
pub const ROCKS: usize = RockKind::ALL.len();

impl RockKind {
    /// All kinds, in the order of [`RockAtPlace::shares`].
    pub const ALL: [RockKind; 4] = [RockKind::Massive, RockKind::Layered, RockKind::Volcanic, RockKind::Soft];
}

/// The rock of a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RockAtPlace {
    /// Share of each [kind](RockKind::ALL) of rock; together 1.
    pub shares: [f64; ROCKS],
    /// Hardness of the layered rock's bed that lies at the surface, from 0 for soft shale to 1 for hard sandstone or
    /// limestone.
    pub bed_hardness: f64,
    /// Hardness of the other rocks among their kind, from 0 to 1: it differs from patch to patch.
    pub patch_hardness: f64,
    /// Share of limestone in the hard beds, from 0 to 1.
    pub limestone: f64,
    /// Height in metres at which the lowest bed lies, counted from the level of the sea.
    pub beds_m: f64,
}

impl RockAtPlace {
    /// Returns the share of limestone in the rock, from 0 to 1.
    pub fn limestone_share(&self) -> f64 {
        self.shares[RockKind::Layered as usize] * self.limestone
    }
}

/// The shares of rocks that a country has at large, and how its beds lie.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RockAtLarge {
    /// Shares of the rocks, as in [`RockAtPlace::shares`].
    pub shares: [f64; ROCKS],
    /// Share of the whole folds that the beds have, from 0, where they lie as they were laid, to 1.
    pub folded: f64,
    /// Kilometres across the belt in whose direction the folds run.
    pub across_km: f64,
}

/// Strike and dip of the beds of a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BedsLie {
    /// Direction of a level line on a bed, in degrees clockwise from north, 0 to 180.
    pub strike_deg: f64,
    /// Greatest slope of a bed in degrees, 0 to 90.
    pub dip_deg: f64,
}

/// The rocks of a world.
#[derive(Clone, Debug)]
pub struct Rocks {
    metres_a_grain: f64,
    beds_seed: u64,
    kinds: [TurnedNoise; ROCKS],
    basins: TurnedNoise,
    folds: TurnedNoise,
    patches: TurnedNoise,
}

/// Wavelengths in metres: of the provinces of a kind of rock, of basins and domes, of the bends of folds, and of patches
/// of harder and softer rock.
const PROVINCE_M: f64 = 45e3;
const BASIN_M: f64 = 60e3;
const FOLD_BEND_M: f64 = 50e3;
const PATCH_M: f64 = 8e3;

/// Addition to a kind's noise for the root of its share, and the difference from the greatest sum within which kinds
/// blend into each other. Chosen by eye: with so much, a kind of half the share has about half of the land.
const SHARE_WEIGHT: f64 = 0.6;
const BLENDED: f64 = 0.12;

/// Height in metres of basins and domes, and of folds; distance from one fold to the next, and the bends of folds to
/// their sides, in kilometres.
const BASINS_M: f64 = 1600.0;
const FOLDS_M: f64 = 1100.0;
const FOLD_KM: f64 = 7.0;
const FOLD_BEND_KM: f64 = 34.0;

/// Thickness of beds in metres, of formations and of the members of which they consist, and the part of formations in
/// the hardness where there are no folds. In folds, members would lie in bands too narrow to be seen.
const BEDS_M: [f64; 2] = [460.0, 120.0];
const FORMATIONS: f64 = 0.65;

/// Share of a bed's thickness in which its hardness passes into that of the next one.
const PASSAGE: f64 = 0.6;

/// Metres to both sides over which the slope of the beds is taken.
const DIP_M: f64 = 200.0;

impl Rocks {
    /// Makes the rocks of a world with so many metres a grain.
    pub fn new(metres_a_grain: f64, seed: u64) -> Rocks {
        let noise = |part: u64, wavelength_m: f64, octaves, gain| {
            TurnedNoise::new(wavelength_m / metres_a_grain, octaves, gain, hash::stream(seed, Stream::Rock.of(part)))
        };
        Rocks {
            metres_a_grain,
            beds_seed: hash::stream(seed, Stream::Beds),
            kinds: [0, 1, 2, 3].map(|kind| noise(kind, PROVINCE_M, 3, 0.6)),
            basins: noise(4, BASIN_M, 2, 0.5),
            folds: noise(5, FOLD_BEND_M, 2, 0.5),
            patches: noise(6, PATCH_M, 3, 0.6),
        }
    }

    /// Returns the rock of places, given what each country has at large.
    pub fn at_all(&self, places: &[Point], countries: &[RockAtLarge]) -> Vec<RockAtPlace> {
        let kinds = self.kinds.each_ref().map(|kind| kind.at_all(places));
        let (patches, beds_m) = (self.patches.at_all(places), self.beds_m(places, countries));
        let rock = |n: usize| {
            let [bed_hardness, lime] = self.bed(beds_m[n], countries[n].folded);
            RockAtPlace {
                shares: shares(kinds.each_ref().map(|kind| kind[n]), countries[n].shares),
                bed_hardness,
                patch_hardness: (0.5 + patches[n]).clamp(0.0, 1.0),
                limestone: lime * bed_hardness,
                beds_m: beds_m[n],
            }
        };
        (0..places.len()).map(rock).collect()
    }

    /// Returns the strike and the dip of the beds of a place, given what its country has at large.
    pub fn beds_lie(&self, at: Point, country: RockAtLarge) -> BedsLie {
        let off = DIP_M / self.metres_a_grain;
        let around = [[off, 0.0], [-off, 0.0], [0.0, off], [0.0, -off]].map(|way| at.moved(way.into()));
        let [east, west, south, north] = self.beds_m(&around, &[country; 4]).try_into().expect("four for four");
        let slope = [east - west, south - north].map(|rise_m: f64| rise_m / (2.0 * DIP_M));
        // The level line lies square to the slope, of which the second part points south.
        let strike_deg = libm::atan2(-slope[1], -slope[0]).to_degrees().rem_euclid(180.0);
        BedsLie { strike_deg, dip_deg: libm::atan(length(slope)).to_degrees() }
    }

    /// Returns [`RockAtPlace::beds_m`] of places.
    fn beds_m(&self, places: &[Point], countries: &[RockAtLarge]) -> Vec<f64> {
        let (basins, bends) = (self.basins.at_all(places), self.folds.at_all(places));
        let beds_m = |n: usize| {
            let RockAtLarge { folded, across_km, .. } = countries[n];
            let fold = (across_km + FOLD_BEND_KM * bends[n]) / FOLD_KM;
            let arch = smooth(1.0 - 2.0 * (fold - fold.floor() - 0.5).abs());
            BASINS_M * basins[n] + FOLDS_M * folded * arch
        };
        (0..places.len()).map(beds_m).collect()
    }

    /// Returns the hardness and the share of limestone of the bed at the level of the sea, where the lowest bed lies at
    /// this height in metres and beds are folded by this share.
    fn bed(&self, beds_m: f64, folded: f64) -> [f64; 2] {
        let [formation, member] = [0, 1].map(|of| {
            let beds = beds_m / BEDS_M[of];
            let here = beds.floor();
            let luck = |part: u64, bed: f64| {
                hash::share(hash::lattice(hash::combine(self.beds_seed, 2 * of as u64 + part), bed as i64, 0))
            };
            // A hard bed lies upon each soft one.
            let hardness = |bed: f64| 0.5 * luck(0, bed) + if (bed as i64).rem_euclid(2) == 0 { 0.0 } else { 0.5 };
            let passed = smooth((beds - here - (1.0 - PASSAGE)) / PASSAGE);
            let between = |of: &dyn Fn(f64) -> f64| of(here) + (of(here + 1.0) - of(here)) * passed;
            [between(&hardness), between(&|bed| if luck(1, bed) < 0.4 { 1.0 } else { 0.0 })]
        });
        let members = (1.0 - FORMATIONS) * (1.0 - folded);
        [formation[0] + members * (member[0] - formation[0]), formation[1]]
    }
}

/// Returns the shares of rocks at a place, given each kind's noise there and its share of the country.
fn shares(noise: [f64; ROCKS], country: [f64; ROCKS]) -> [f64; ROCKS] {
    let scores: [f64; ROCKS] = std::array::from_fn(|kind| noise[kind] + SHARE_WEIGHT * country[kind].sqrt());
    // A kind that the country lacks, or nearly lacks, wins nowhere.
    let there = country.map(|share| (share / 0.02).min(1.0));
    let most = (0..ROCKS).filter(|kind| there[*kind] > 0.0).map(|kind| scores[kind]).fold(f64::NEG_INFINITY, f64::max);
    let weights: [f64; ROCKS] = std::array::from_fn(|kind| {
        let left = (1.0 - (most - scores[kind]) / BLENDED).max(0.0);
        there[kind] * left * left
    });
    let total: f64 = weights.iter().sum();
    weights.map(|weight| weight / total)
}

#[cfg(test)]
mod tests {
    use super::*;

    const METRES_A_GRAIN: f64 = 10.0 / 256.0;

    fn country(shares: [f64; ROCKS], folded: f64) -> RockAtLarge {
        RockAtLarge { shares, folded, across_km: 0.0 }
    }

    /// Places on a square of this side in kilometres, row by row.
    fn square(km: f64, side: usize) -> Vec<Point> {
        let at = |n: usize| ((n as f64 / side as f64 - 0.5) * km * 1000.0 / METRES_A_GRAIN) as i64;
        (0..side * side).map(|n| Point { x: at(n % side), y: at(n / side) }).collect()
    }

    #[test]
    fn kinds_have_about_the_shares_of_their_country_and_are_mostly_pure() {
        let places = square(2000.0, 120);
        for shares in [[0.5, 0.3, 0.0, 0.2], [0.1, 0.7, 0.1, 0.1]] {
            let rocks = Rocks::new(METRES_A_GRAIN, 3).at_all(&places, &vec![country(shares, 0.0); places.len()]);
            for (kind, asked) in shares.into_iter().enumerate() {
                let found = rocks.iter().map(|rock| rock.shares[kind]).sum::<f64>() / rocks.len() as f64;
                assert!((found - asked).abs() < 0.15 && (asked > 0.0 || found == 0.0), "{kind}: {found}, not {asked}");
            }
            let pure = rocks.iter().filter(|rock| rock.shares.iter().any(|share| *share > 0.9)).count();
            assert!(pure * 3 > rocks.len() * 2, "{pure} of {}", rocks.len());
            assert!(rocks.iter().all(|rock| (rock.shares.iter().sum::<f64>() - 1.0).abs() < 1e-9));
        }
    }

    /// Bands of a hard bed are some hundreds of metres to a few kilometres wide in folds, and wider in basins.
    #[test]
    fn hard_and_soft_beds_come_to_the_surface_in_bands() {
        let rocks = Rocks::new(METRES_A_GRAIN, 5);
        let changes = |folded: f64| {
            let along = |row: i64| {
                (0..2000).map(move |step| Point { x: step * 100 * 256 / 10, y: row * 17_000 * 256 / 10 }).collect()
            };
            let rows: Vec<Vec<Point>> = (0..10).map(along).collect();
            let hard = |row: &Vec<Point>| {
                let all = rocks.at_all(row, &vec![country([0.0, 1.0, 0.0, 0.0], folded); row.len()]);
                all.windows(2).filter(|pair| (pair[0].bed_hardness > 0.5) != (pair[1].bed_hardness > 0.5)).count()
            };
            rows.iter().map(hard).sum::<usize>() as f64 / 2000.0
        };
        let [flat, folds] = [0.0, 1.0].map(changes);
        assert!((0.03..0.3).contains(&flat) && (0.3..2.0).contains(&folds), "{flat} and {folds} edges a kilometre");
    }

    #[test]
    fn beds_dip_gently_in_basins_and_steeply_in_folds() {
        let rocks = Rocks::new(METRES_A_GRAIN, 5);
        let places = square(300.0, 30);
        let median = |folded: f64| {
            let lie = |at: &Point| rocks.beds_lie(*at, country([0.0, 1.0, 0.0, 0.0], folded));
            let mut all: Vec<f64> = places.iter().map(|at| lie(at).dip_deg).collect();
            all.sort_unstable_by(f64::total_cmp);
            all[all.len() / 2]
        };
        let [flat, folds] = [0.0, 1.0].map(median);
        assert!(flat < 5.0 && (8.0..60.0).contains(&folds), "{flat} and {folds} degrees");
    }

    #[test]
    fn a_place_has_the_same_rock_alone_and_among_others_also_far_away() {
        let rocks = Rocks::new(METRES_A_GRAIN, 9);
        for from in [Point::default(), Point { x: 1 << 52, y: -(1 << 51) }] {
            let places: Vec<Point> = (0..50).map(|n| Point { x: from.x + n * 7001, y: from.y - n * 3001 }).collect();
            let here = country([0.3, 0.4, 0.1, 0.2], 0.5);
            let together = rocks.at_all(&places, &[here; 50]);
            for (place, expected) in places.iter().zip(together) {
                assert_eq!(rocks.at_all(&[*place], &[here]), [expected], "{place:?}");
            }
        }
    }
}
