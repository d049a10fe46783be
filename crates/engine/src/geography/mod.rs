//! Geography: what lies where at large, before any river is drawn.
//!
//! ```text
//! plates, noise --> land at large: continent, uplift, youth     on a lattice of its own, 8 km on Earth
//!                          |          |
//!                          |          v
//!                          |        rock: its kind, its beds     at each place
//!                          v
//!                   planned heights, latitude --> climate        on a lattice of its own, 32 km
//!                                                    |
//!                                                    v
//!                                               biome, sand
//!
//! land and biomes at coarse nodes --> realms: continents, seas, islands, deserts, plains, ranges
//! ```
//!
//! Everything is a pure function of the seed and of the place. Nothing here depends on rivers or on finished heights:
//! those depend on it.

pub mod settings;
mod sand;
mod turned_noise;
mod plates;
mod spline;
pub mod rock;
pub mod lithology;
pub mod biome;
pub mod climate;
pub mod realms;

use climate::{Climate, PlaceClimate, PlannedLand};
use plates::Plates;
use realms::Realms;
use rock::{BedsLie, RockAtLarge, RockAtPlace, Rocks};
use sand::SandSeas;
use settings::GeographySettings;
use spline::SplineLattice;
use turned_noise::TurnedNoise;

use crate::geometry::smooth;
use crate::grain_point::Point;
use crate::hash::{self, Stream};
use crate::memory::Remembers;
use crate::noise::point_noise::PointField;

/// Grains from node to node of the land at large, as a share of a plate's side: 8 km on Earth.
const LAND_STEP: f64 = 1.0 / 200.0;

/// Number of numbers of the land at large.
const LAND_NUMBERS: usize = 6;

/// Bytes for the land at large: a square of 8,000 km on Earth.
const LAND_BYTES: usize = 24 << 20;

/// Grains from node to node of the climate, as a share of the way from the equator to a pole: 32 km on Earth; and bytes
/// for it.
const CLIMATE_STEP: f64 = 0.0032;
const CLIMATE_BYTES: usize = 6 << 20;

/// Planned heights in metres: of an ocean in the middle, of the middle of a continent without mountains, and of
/// mountains with the greatest uplift. They are about the mean heights of the finished land.
const PLANNED_M: [f64; 3] = [4000.0, 500.0, 3200.0];

/// Uplift of the flattest plains.
pub const LEAST_UPLIFT: f64 = 0.012;

/// Wavelengths, as shares of a plate's side: of swings of the ranges within a belt, of the strength of ranges, of hills
/// away from belts, and of islands in an arc.
const SWING_WAVE: f64 = 0.2;
const RANGE_WAVE: f64 = 0.094;
const HILL_WAVE: f64 = 0.31;
const ARC_WAVE: f64 = 0.088;

/// Wavelength of the noise that gives continents their outline, as a share of the side of a continent's cell.
const OUTLINE_WAVE: f64 = 0.21;

/// Amplitude of each octave of the outline and of the coasts, as a share of the one before: so much that coasts have the
/// dimension of Earth's, 1.2.
const COAST_GAIN: f64 = 0.75;

/// Distance from one range of a belt to the next, as a share of a plate's side, and the swing of ranges to the side, as
/// a multiple of this distance.
const RANGES: f64 = 0.072;
const SWING: f64 = 1.6;

/// Volcanism of arcs of islands, of the fronts of volcanoes beside oceans, and of rifts, by their strengths. Chosen by
/// eye: on maps of the volcanoes of several seeds.
const VOLCANISM: [f64; 3] = [2.0, 1.6, 2.0];

/// Uplift of the shoulders beside the strongest rift. Chosen by eye: the middles of rifts lie some 500 to 1,000 m below
/// them.
const RIFT_SHOULDERS: f64 = 0.35;

/// Places a side of the square, and its side in cells of continents, by which the sea is given its share of the world.
const SAMPLES: i64 = 64;
const SAMPLED: f64 = 4.0;

/// The geography of a world.
#[derive(Debug)]
pub struct Geography {
    settings: GeographySettings,
    plates: Plates,
    old_plates: Plates,
    /// The outline of continents, and of their coasts and islands.
    outline: TurnedNoise,
    coasts: TurnedNoise,
    swing: TurnedNoise,
    ranges: TurnedNoise,
    hills: TurnedNoise,
    arcs: TurnedNoise,
    /// Number of `continent` where the sea begins, before it is taken off.
    sea: f64,
    land: SplineLattice<LAND_NUMBERS>,
    rocks: Rocks,
    climate: Climate,
    climates: SplineLattice<5>,
    realms: Realms,
    sand_seas: SandSeas,
}

/// The land, the rock and the climate of a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setting {
    /// The land.
    pub land: LandAtLarge,
    /// The rock.
    pub rock: RockAtPlace,
    /// The climate.
    pub climate: PlaceClimate,
    /// Sand that lies there: 0 outside sand seas, and up to 1 in the middle of large ones.
    pub sand: f64,
}

/// The land of a place at large.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LandAtLarge {
    /// From about -1 in the middle of an ocean to about 1 in the middle of a continent, 0 at the shore.
    pub continent: f64,
    /// Rate at which the land rises, above 0 to 1: plains have .02, hills .1, and young ranges up to 1.
    pub uplift: f64,
    /// Youth of the mountains, from 0 for those of old plates to 1 for those that rise today.
    pub youth: f64,
    /// Strength of a rift, from 0 to 1.
    pub rift: f64,
    /// Distance across the nearest border between plates, in sides of a plate, negative on one side of the border: the
    /// ranges of a belt run along its lines.
    pub across: f64,
    /// Strength of volcanism, from 0 to 1: in arcs of islands, inland of a shore where an ocean's plate sinks under it,
    /// and in rifts.
    pub volcanism: f64,
}

impl Geography {
    /// Makes the geography of checked settings, in a world with so many metres a grain.
    pub fn new(settings: &GeographySettings, metres_a_grain: f64, seed: u64) -> Geography {
        let grains = |km: f64| km * 1000.0 / metres_a_grain;
        let (plate, continent) = (grains(settings.plate_km), grains(settings.continent_km));
        let noise = |part, wavelength, octaves, gain| {
            TurnedNoise::new(wavelength, octaves, gain, hash::stream(seed, Stream::Geography.of(part)))
        };
        let mut geography = Geography {
            settings: settings.clone(),
            plates: Plates::new(plate, continent, false, seed),
            // They need not fit the new ones, so their cells should not lie upon theirs.
            old_plates: Plates::new(1.1 * plate, continent, true, seed),
            outline: noise(0, OUTLINE_WAVE * continent, 2, COAST_GAIN),
            coasts: noise(1, OUTLINE_WAVE / 4.0 * continent, 4, COAST_GAIN),
            swing: noise(2, SWING_WAVE * plate, 3, 0.5),
            ranges: noise(3, RANGE_WAVE * plate, 3, 0.5),
            hills: noise(4, HILL_WAVE * plate, 3, 0.5),
            arcs: noise(5, ARC_WAVE * plate, 2, 0.5),
            sea: 0.0,
            land: SplineLattice::new(LAND_STEP * plate, LAND_BYTES),
            rocks: Rocks::new(metres_a_grain, seed),
            climate: Climate::new(settings, metres_a_grain),
            climates: SplineLattice::new(CLIMATE_STEP * grains(settings.pole_km), CLIMATE_BYTES),
            realms: Realms::new(settings, metres_a_grain, seed),
            sand_seas: SandSeas::new(metres_a_grain, seed),
        };
        // The coasts' noise depends on where the shore is, so each guess improves the one before.
        for _ in 0..3 {
            geography.sea += geography.sea_for(settings.land, SAMPLED * continent);
        }
        geography
    }

    /// Returns the recipe.
    pub fn settings(&self) -> &GeographySettings {
        &self.settings
    }

    /// Returns the caches.
    pub(crate) fn memories(&self) -> Vec<&dyn Remembers> {
        [&[self.land.memory(), self.climates.memory()][..], &self.realms.memories()].concat()
    }

    /// Returns the number of `continent` that a share of the places within a square around the origin exceeds; 0 if
    /// `sea` is right.
    fn sea_for(&self, land: f64, side: f64) -> f64 {
        let at = |n: i64| ((n as f64 + 0.5) / SAMPLES as f64 - 0.5) * side;
        let places = (0..SAMPLES * SAMPLES).map(|n| Point { x: at(n % SAMPLES) as i64, y: at(n / SAMPLES) as i64 });
        let mut continents: Vec<f32> =
            self.nodes(&places.collect::<Vec<_>>()).into_iter().map(|node| node[0]).collect();
        continents.sort_unstable_by(f32::total_cmp);
        continents[(continents.len() as f64 * (1.0 - land)) as usize].into()
    }

    /// Returns the land of places at large.
    pub fn land_at_large(&self, places: &[Point]) -> Vec<LandAtLarge> {
        self.land.at_all(places, |nodes| self.nodes(nodes)).into_iter().map(LandAtLarge::of).collect()
    }

    /// Returns [`LandAtLarge::continent`] at places.
    pub fn continents<const M: usize>(&self, places: [Point; M]) -> [f64; M] {
        let mut nodes = self.land.at_all(&places, |nodes| self.nodes(nodes)).into_iter();
        places.map(|_| nodes.next().expect("there is one for each place")[0])
    }

    /// Returns the land of places that lie far from each other: exact, where [`Geography::land_at_large`] is smoothed.
    pub(crate) fn land_apart(&self, places: &[Point]) -> Vec<LandAtLarge> {
        self.nodes(places).into_iter().map(|node| LandAtLarge::of(node.map(f64::from))).collect()
    }

    /// Returns the climate of a single place far from all others, exact likewise.
    pub(crate) fn climate_apart(&self, at: Point) -> PlaceClimate {
        self.climate.at_all(&[at], &LandApart(self))[0]
    }

    /// Returns the climates of places.
    pub fn climates(&self, places: &[Point]) -> Vec<PlaceClimate> {
        let node = |climate: PlaceClimate| {
            let PlaceClimate { mean_c, swing_c, rain_mm: [january, spring, july] } = climate;
            [mean_c, swing_c, january, spring, july].map(|value| value as f32)
        };
        let nodes =
            self.climates.at_all(places, |nodes| self.climate.at_all(nodes, self).into_iter().map(node).collect());
        let of = |[mean_c, swing_c, january, spring, july]: [f64; 5]| PlaceClimate {
            mean_c,
            swing_c,
            rain_mm: [january, spring, july],
        };
        nodes.into_iter().map(of).collect()
    }

    /// Returns the rock of places, given the land there.
    pub fn rocks(&self, places: &[Point], land: &[LandAtLarge]) -> Vec<RockAtPlace> {
        let countries: Vec<RockAtLarge> = land.iter().map(|land| self.country(land)).collect();
        self.rocks.at_all(places, &countries)
    }

    /// Returns strike and dip of the beds of a place, given the land there.
    pub fn beds_lie(&self, at: Point, land: &LandAtLarge) -> BedsLie {
        self.rocks.beds_lie(at, self.country(land))
    }

    /// Returns the land, the rock, the climates and the sand of places.
    pub fn settings_at(&self, places: &[Point]) -> Vec<Setting> {
        let land = self.land_at_large(places);
        let rocks = self.rocks(places, &land);
        let all = places.iter().zip(land).zip(rocks).zip(self.climates(places));
        let setting = |(((at, land), rock), climate): (((&Point, LandAtLarge), RockAtPlace), PlaceClimate)| {
            let sand = self.sand_seas.sand(*at, &land, &climate);
            Setting { land, rock, climate, sand }
        };
        all.map(setting).collect()
    }

    /// Returns the rocks of a country, given its land: massive ones in the cores of ranges and above all in worn ones,
    /// layered ones around them, volcanic ones where volcanoes are, and soft ones on plains.
    fn country(&self, land: &LandAtLarge) -> RockAtLarge {
        let hilly = 1.0 - land.flatness();
        let massive = 0.1 + hilly * (0.3 - 0.15 * land.youth);
        let layered = 0.4 + 0.3 * hilly * land.youth;
        let volcanic = 0.03 + 0.6 * land.volcanism;
        let soft = 0.05 + 0.45 * (1.0 - hilly);
        let all = massive + layered + volcanic + soft;
        RockAtLarge {
            shares: [massive, layered, volcanic, soft].map(|share| share / all),
            folded: hilly * (0.3 + 0.7 * land.youth),
            across_km: land.across * self.settings.plate_km,
        }
    }

    /// Returns the mean of the wind along the parallel of a place: from -1, where all air goes west, to 1, where all
    /// goes east.
    pub fn eastward(&self, at: Point) -> f64 {
        self.climate.eastward(at)
    }

    /// Returns the latitude of a place in degrees north.
    pub fn latitude(&self, at: Point) -> f64 {
        self.climate.latitude(at)
    }

    /// Returns the numbers of the land at large at nodes.
    fn nodes(&self, places: &[Point]) -> Vec<[f32; LAND_NUMBERS]> {
        let crusts = self.plates.crust(places);
        let old_crusts = self.old_plates.crust(places);
        let noise = [&self.outline, &self.coasts, &self.swing, &self.ranges, &self.hills, &self.arcs];
        let noise = noise.map(|noise| noise.at_all(places));
        let node = |n: usize| {
            let [outline, coasts, swing, ranges, hills, arcs] = noise.each_ref().map(|noise| noise[n]);
            let (crust, old) = (&crusts[n], old_crusts[n].belt.min(1.0));
            let belt = crust.belt.min(1.0);
            let islands = crust.arc * (2.0 * arcs + 0.4).clamp(0.0, 1.0);
            let lies = crust.kind + 0.9 * outline + 0.45 * belt + 0.35 * islands - 0.3 * crust.rift - self.sea;
            // Bays, islands and peninsulas belong to coasts. Far from them, such noise would leave seas without outlet.
            let near_shore = 1.0 - 0.75 * smooth(lies.abs() / 0.6);
            let continent = lies + 0.77 * near_shore * coasts;
            // Ranges lie side by side along the border, and valleys between them.
            let across = crust.across / RANGES + SWING * swing;
            let crest = 1.0 - 2.0 * (across - across.floor() - 0.5).abs();
            let young = (belt * (0.35 + 0.65 * crest) + 0.6 * islands) * (0.85 + 0.6 * ranges);
            let hilly = smooth((1.6 * hills + 0.05).clamp(0.0, 1.0));
            let worn = 0.28 * old * old * (0.6 + 0.8 * ranges);
            let shoulders = RIFT_SHOULDERS * (crust.rift - crust.graben);
            let uplift = (LEAST_UPLIFT + 0.1 * hilly + worn.max(0.0) + young.max(0.0) + shoulders).min(1.0);
            let youth = young.max(0.0) / (young.max(0.0) + worn.max(0.0) + 0.02);
            let [of_arc, of_front, of_rift] = VOLCANISM;
            let volcanism = (of_arc * crust.arc + of_front * crust.front + of_rift * crust.rift).min(1.0);
            [continent, uplift, youth, crust.rift, crust.across, volcanism].map(|value| value as f32)
        };
        (0..places.len()).map(node).collect()
    }
}

/// Metres of height in which the land passes from that without to that with an ice sheet; and the metres below the snow
/// line down to which the sheets of the ice age went, as far as to the south of the Baltic Sea on Earth.
const ICE_SHEET_M: f64 = 800.0;
const ICE_WENT_M: f64 = 700.0;

/// Height of valley floors as a share of a country's planned height. Chosen by eye.
const FLOORS: f64 = 0.5;

/// Mean temperatures of the warmest month in degrees Celsius between which a country becomes habitable; the share of
/// people who live where it is colder, and where there is hardly any rain, by rivers; and the runoff in metres a year
/// with which nobody lacks water.
const COLD_SUMMER_C: [f64; 2] = [4.0, 14.0];
const HUNTERS: f64 = 0.04;
const OASES: f64 = 0.08;
const FIELDS_RUNOFF_M: f64 = 0.08;

/// Uplift from which on land counts as hilly.
const HILLY: f64 = 0.12;

impl Setting {
    /// Returns the share, from 0 to 1, of an ice sheet that lay on the country in the ice age.
    pub fn was_under_ice(&self) -> f64 {
        self.above_snow_line(self.climate.ice_age_snow_line_m() - ICE_WENT_M)
    }

    /// Returns the share, from 0 to 1, of an ice sheet that lies on the country.
    pub fn is_under_ice(&self) -> f64 {
        self.above_snow_line(self.climate.snow_line_m())
    }

    /// Returns the share of the people who would live there in a mild climate that live in this one, from 0 to 1: few
    /// where summers are cold or rain does not suffice for fields, and none on ice.
    pub fn habitability(&self) -> f64 {
        let height_m = self.land.planned_m().max(0.0);
        let warmest_c = self.climate.temperature_c(height_m) + self.climate.range_c() / 2.0;
        let warm = smooth((warmest_c - COLD_SUMMER_C[0]) / (COLD_SUMMER_C[1] - COLD_SUMMER_C[0]));
        let fields = OASES + (1.0 - OASES) * smooth(self.climate.runoff_m(height_m) / FIELDS_RUNOFF_M);
        (1.0 - self.is_under_ice()) * (HUNTERS + (1.0 - HUNTERS) * warm) * fields
    }

    /// Returns the share, from 0 to 1, of the country whose valley floors lie above a snow line: a sheet, unlike glaciers,
    /// covers them too.
    fn above_snow_line(&self, snow_line_m: f64) -> f64 {
        smooth(0.5 - (snow_line_m - FLOORS * self.land.planned_m().max(0.0)) / ICE_SHEET_M)
    }
}

impl LandAtLarge {
    /// Returns the flatness of the country: from 0 in hills to 1 where nothing has risen.
    pub fn flatness(&self) -> f64 {
        1.0 - smooth(self.uplift / HILLY)
    }

    fn of([continent, uplift, youth, rift, across, volcanism]: [f64; LAND_NUMBERS]) -> LandAtLarge {
        LandAtLarge { continent, uplift, youth, rift, across, volcanism }
    }

    /// Returns the height that is planned for the place in metres, below 0 in the sea.
    pub fn planned_m(&self) -> f64 {
        let [ocean_m, inland_m, mountains_m] = PLANNED_M;
        match self.continent {
            sea if sea < 0.0 => ocean_m * sea,
            land => inland_m * land + mountains_m * self.uplift * smooth(land / 0.05),
        }
    }
}

impl PlannedLand for Geography {
    fn planned_all(&self, places: &[Point]) -> Vec<f64> {
        self.land_at_large(places).iter().map(LandAtLarge::planned_m).collect()
    }
}

/// The land of a geography at places far from each other.
struct LandApart<'a>(&'a Geography);

impl PlannedLand for LandApart<'_> {
    fn planned_all(&self, places: &[Point]) -> Vec<f64> {
        self.0.land_apart(places).iter().map(LandAtLarge::planned_m).collect()
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::f64::consts::TAU;

    use super::*;

    const METRES_A_GRAIN: f64 = 10.0 / 256.0;

    fn geography(seed: u64) -> Geography {
        Geography::new(&GeographySettings::default(), METRES_A_GRAIN, seed)
    }

    /// The place some kilometres east and south of another.
    fn beside(at: Point, [east, south]: [f64; 2]) -> Point {
        at.moved([east * 1000.0 / METRES_A_GRAIN, south * 1000.0 / METRES_A_GRAIN].into())
    }

    /// Places on a square of this side in kilometres.
    fn square(km: f64, side: usize) -> Vec<Point> {
        let at = |n: usize| (n as f64 / side as f64 - 0.5) * km;
        (0..side * side).map(|n| beside(Point::default(), [at(n % side), at(n / side)])).collect()
    }

    #[test]
    fn a_share_of_the_world_is_land() {
        let share = |seed: u64, land: f64| {
            let settings = GeographySettings { land, ..GeographySettings::default() };
            let all = Geography::new(&settings, METRES_A_GRAIN, seed).nodes(&square(20_000.0, 100));
            all.iter().filter(|[continent, ..]| *continent > 0.0).count() as f64 / all.len() as f64
        };
        for seed in 1..=3 {
            for land in [0.1, 0.29, 0.8] {
                let found = share(seed, land);
                assert!((found - land).abs() < 0.03, "seed {seed}: {found} of the world is land, not {land}");
            }
        }
    }

    #[test]
    fn land_has_plains_hills_and_ranges() {
        let land = geography(5).nodes(&square(20_000.0, 200));
        let uplifts = land.iter().filter(|[continent, ..]| *continent > 0.0).map(|[_, uplift, ..]| *uplift);
        let uplifts: Vec<f32> = uplifts.collect();
        let share =
            |is: fn(f32) -> bool| uplifts.iter().filter(|uplift| is(**uplift)).count() as f64 / uplifts.len() as f64;
        let shares = [share(|uplift| uplift < 0.05), share(|uplift| uplift > 0.3), share(|uplift| uplift > 0.6)];
        let [plains, mountains, high] = shares;
        assert!((0.25..0.75).contains(&plains) && (0.05..0.3).contains(&mountains), "{shares:?}");
        assert!((0.01..0.15).contains(&high), "{shares:?}");
        assert!(uplifts.iter().all(|uplift| (LEAST_UPLIFT as f32..=1.0).contains(uplift)));
    }

    /// Where a rift is strongest, the land lies lower than on both of its sides.
    #[test]
    fn rifts_have_shoulders_and_a_low_middle() {
        let ways = |km: f64| {
            let angles = (0..16).map(|n| f64::from(n) / 16.0 * TAU);
            angles.map(move |angle| [libm::cos(angle) * km, libm::sin(angle) * km])
        };
        let (mut middles, mut low) = (BTreeSet::new(), 0);
        for seed in 1..=6 {
            let geography = geography(seed);
            let land = |at: Point| geography.land_at_large(&[at])[0];
            let places = square(12_000.0, 60);
            let lands = geography.land_at_large(&places);
            for (mut at, _) in places.into_iter().zip(lands).filter(|(_, land)| land.rift > 0.3 && land.continent > 0.1)
            {
                // Climb to the middle.
                while let Some(next) =
                    ways(8.0).map(|way| beside(at, way)).find(|next| land(*next).rift > land(at).rift)
                {
                    at = next;
                }
                let middle = land(at);
                if middle.continent < 0.1 || middle.youth > 0.3 || middle.rift < 0.5 || !middles.insert((seed, at)) {
                    continue;
                }
                // The rift fades fastest across it.
                let sides = |way: [f64; 2]| [way, way.map(|km| -km)].map(|way| land(beside(at, way)));
                let fading = |way: &[f64; 2]| sides(*way).map(|side| side.rift).iter().copied().fold(0.0, f64::max);
                let across = ways(70.0).min_by(|a, b| fading(a).total_cmp(&fading(b))).expect("there are ways");
                low += usize::from(sides(across).iter().all(|side| side.uplift > middle.uplift));
            }
        }
        let all = middles.len();
        assert!(all > 10 && low * 10 > all * 8, "{low} of {all} middles are lower than both sides");
    }

    /// No field has a step: not where another plate becomes the nearest, nor at the edge of a patch of nodes.
    #[test]
    fn nothing_jumps_from_place_to_place() {
        let geography = geography(2);
        for start in square(9000.0, 6) {
            let way: Vec<Point> =
                (0..2000).map(|step| beside(start, [step as f64 * 0.25, step as f64 * 0.1])).collect();
            let land = geography.land_at_large(&way);
            for pair in land.windows(2) {
                let [a, b] = [pair[0], pair[1]];
                let jumps = [a.continent - b.continent, a.uplift - b.uplift, a.youth - b.youth, a.rift - b.rift];
                assert!(jumps.iter().all(|jump| jump.abs() < 0.02), "{a:?} and {b:?} are 270 m apart");
            }
        }
    }

    #[test]
    fn a_place_is_the_same_alone_and_among_others() {
        let far = Point { x: 1 << 52, y: -(1 << 51) };
        let places: Vec<Point> = [Point::default(), far]
            .into_iter()
            .flat_map(|from| (0..40).map(move |n| beside(from, [n as f64 * 37.0, n as f64 * -11.0])))
            .collect();
        let together = geography(9).land_at_large(&places);
        let other = geography(9);
        for (place, expected) in places.iter().zip(together).rev() {
            assert_eq!(other.land_at_large(&[*place]), [expected], "{place:?}");
        }
    }
}
