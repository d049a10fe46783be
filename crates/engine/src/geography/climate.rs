//! Climate: how warm and how wet a place is through the year, from its latitude, the sea and the land around it.
//!
//! Air comes to a place along four ways, from the north-east, the south-east, the north-west and the south-west. Along
//! each it takes up water over the sea, and loses it over land and on slopes that it climbs. The belts of wind say how
//! often each way is taken in January, in July, and between. Everything is a function of latitude and of the planned
//! height of the land, so nothing here depends on chance, on rivers or on finished heights.
//!
//! The numbers without a source were fitted together: on maps of six worlds of 16,000 x 20,000 km, the shares of the
//! climates A to E in land spread evenly over a sphere are 21, 28, 13, 23 and 15 in a hundred. Earth has 19, 30, 13, 25
//! and 13 (Peel et al. 2007).

use super::biome::{Biome, Month};
use super::settings::GeographySettings;

use crate::geometry::smooth;
use crate::grain_point::Point;

/// Kilometres from the equator to a pole on Earth. All lengths here are Earth's, and scale with
/// [`GeographySettings::pole_km`].
const EARTH_POLE_KM: f64 = 10_000.0;

/// Sine of the latitude of the poles of the map, which lie 80 degrees from the equator.
const POLE_SINE: f64 = 0.985;

/// Share of the way from a pole to the equator along which the latitude turns, so that it has no kink at the pole.
const TURN: f64 = 0.1;

/// Sine of the latitude for each length from the equator to a pole, before it turns.
const SINE_RATE: f64 = POLE_SINE / (1.0 - 0.5 * TURN);

/// Sine of 45 degrees, the latitude of the origin.
const ORIGIN_SINE: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// Steps along each way to a place, the length of the nearest in kilometres, and the growth of the others from one to
/// the next: the farthest begins 1,025 km from the place. Twice as many steps of half the length change the shares of
/// climates by less than half of one in a hundred.
const STEPS: usize = 20;
const NEAREST_KM: f64 = 25.0;
const GROWTH: f64 = 1.07;

/// Places along each way: the beginnings of the steps, the place itself, and one beyond, since rain begins before a
/// slope.
const STATIONS: usize = STEPS + 2;

/// Kilometres from a place to each station.
const AWAY_KM: [f64; STATIONS] = {
    let mut away = [0.0; STATIONS];
    let (mut station, mut step) = (STEPS, NEAREST_KM);
    away[STATIONS - 1] = -NEAREST_KM;
    while station > 0 {
        station -= 1;
        away[station] = away[station + 1] + step;
        step *= GROWTH;
    }
    away
};

/// Shares in a place's rain of the rain at the last three stations.
const SPREAD: [f64; 3] = [0.25, 0.5, 0.25];

/// Ways that air takes to a place: signs of the directions, east and south, from which it comes.
const WAYS: [[f64; 2]; 4] = [[1.0, -1.0], [1.0, 1.0], [-1.0, -1.0], [-1.0, 1.0]];

/// Cosine and sine of the 25 degrees between each way and the parallel.
const WAY_SLANT: [f64; 2] = [0.906_307_787, 0.422_618_262];

/// Seasons: January, April and October, and July. The number multiplies the swing of all that follows the sun.
const SEASONS: [f64; 3] = [-1.0, 0.0, 1.0];

/// Cosines of the months from January to December, of which July is the warmest in the north.
const MONTHS: [f64; 12] =
    [-1.0, -HALF_ROOT_3, -0.5, 0.0, 0.5, HALF_ROOT_3, 1.0, HALF_ROOT_3, 0.5, 0.0, -0.5, -HALF_ROOT_3];
const HALF_ROOT_3: f64 = 0.866_025_403_784_438_6;

/// Degrees Celsius by which air is colder for each metre of height: the standard atmosphere's.
pub(crate) const LAPSE: f64 = 0.0065;

/// Height and depth in metres of the planned land beyond which a place is land or sea alone.
const SHORE_M: f64 = 80.0;

/// Kilometres in which air becomes that of the land or of the sea below it.
const INLAND_KM: f64 = 700.0;

/// Kilometres in which air over the sea takes up water, and the share of saturation that it strives for.
const FETCH_KM: f64 = 300.0;
const SEA_HUMIDITY: f64 = 0.85;

/// Stations that tell by their share of land which air a way begins with. More than one, so that no line runs through
/// the land where the first station of a place comes to a shore.
const FIRST_STATIONS: usize = 6;

/// [Inland](Brought::inland) of the air that a way begins with over land.
const FIRST_INLAND: f64 = 0.6;

/// Shares of saturation of the air that a way begins with: over the sea; over land without rain, and more of it for the
/// rain of the [`belt`].
const FIRST_AT_SEA: f64 = 0.8;
const FIRST_ON_LAND: [f64; 2] = [0.3, 0.32];

/// Kilometres in which saturated air over flat land rains out.
const RAIN_KM: f64 = 2400.0;

/// Metres of climb in which saturated air loses its water, and the share of this water that falls there. The rest
/// passes by, as air goes round mountains, or comes from elsewhere for a part of the time.
const LIFT_M: f64 = 6000.0;
const LIFT_SHARE: f64 = 0.3;

/// Metres below the last crest at which air rains half as much, and kilometres in which it forgets the crest.
const LEE_M: f64 = 800.0;
const LEE_KM: f64 = 200.0;

/// The greatest share of the rain that evaporates back into the air, and the degree to which dry ground prevents this.
const RETURN_SHARE: f64 = 0.95;
const RETURN_HUMIDITY: f64 = 1.4;

/// Rain in a belt of winds, as a multiple of that which [`RAIN_KM`] gives: at the equator, and beyond 44 degrees.
const EQUATOR_BELT: f64 = 1.4;
const OUTER_BELT: f64 = 1.1;

/// Rain around 28 degrees, where air sinks and deserts lie, as such a multiple: of air that has come from the east over
/// warm sea, and of all other air.
const EASTERN_DRY_BELT: f64 = 0.6;
const DRY_BELT: f64 = 0.02;

/// Metres by which the snow line of the last ice age was lower.
const ICE_AGE_M: f64 = 1000.0;

/// Water that wind carries over each metre across it in air that is saturated at 20 degrees Celsius, in millimetres a
/// year times kilometres: a column of about 30 mm at 6 m/s.
const WATER: f64 = 5.6e6;

/// The climates of a world.
///
/// From its north pole to its south pole a world is twice `pole_km` long. Beyond each pole it goes on mirrored, so the
/// latitude repeats each 4 `pole_km`. The sine of the latitude is in proportion to the distance from the equator except
/// near the poles: each climate has the share in the map that it has on a sphere.
#[derive(Clone, Debug)]
pub struct Climate {
    /// Grains from the equator to a pole.
    pole: i64,
    /// Grains from the north pole to the origin.
    origin: i64,
    warmth_c: f64,
    wetness: f64,
    /// Steps of each of the [`WAYS`] from a place to its stations, in grains; the last is the one beyond the place.
    stations: [[Point; STATIONS]; 4],
}

/// Land of which the climate asks.
pub trait PlannedLand {
    /// Returns the planned heights of places in metres: 0 at the shore, below 0 in the sea.
    ///
    /// They must not depend on the climate. Land much rougher than steps of 25 km makes the climate rough.
    fn planned_all(&self, places: &[Point]) -> Vec<f64>;
}

/// The latitude of a place.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Parallel {
    /// Degrees north of the equator.
    degrees: f64,
    /// 1 where the north is that of the map, -1 where it is mirrored, between them near the poles.
    north: f64,
}

/// The climate of a place. All numbers may be interpolated between places.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PlaceClimate {
    /// Mean temperature at the sea's level in degrees Celsius.
    pub mean_c: f64,
    /// Temperature of July less that of January, in degrees Celsius: below 0 in the south.
    pub swing_c: f64,
    /// Rain in millimetres a year, at the rates of January, of April and October, and of July.
    pub rain_mm: [f64; 3],
}

/// The air that a way brings to a place.
#[derive(Clone, Copy, Debug, Default)]
struct Brought {
    /// Rain in each season, in the units of [`WATER`] for each kilometre.
    rain: [f64; 3],
    /// From 0 for air of the sea to 1 for air of the inland.
    inland: f64,
}

impl Climate {
    /// Makes the climates of checked settings, in a world with so many metres a grain.
    pub fn new(settings: &GeographySettings, metres_a_grain: f64) -> Climate {
        let pole = (settings.pole_km * 1000.0 / metres_a_grain).round().max(1.0);
        let grains = |km: f64| (km * pole / EARTH_POLE_KM).round() as i64;
        let stations = WAYS.map(|[east, south]| {
            AWAY_KM.map(|km| Point { x: grains(east * WAY_SLANT[0] * km), y: grains(south * WAY_SLANT[1] * km) })
        });
        Climate {
            pole: pole as i64,
            origin: ((1.0 - ORIGIN_SINE / SINE_RATE) * pole).round() as i64,
            warmth_c: settings.warmth_c,
            wetness: settings.wetness,
            stations,
        }
    }

    /// Returns the latitude of a place in degrees, from -80 at the south pole to 80 at the north pole.
    pub fn latitude(&self, at: Point) -> f64 {
        self.parallel(at).degrees
    }

    /// Returns the mean of the wind along the parallel over a year: from -1, where all air goes west, to 1, where all
    /// goes east.
    pub fn eastward(&self, at: Point) -> f64 {
        let here = self.parallel(at);
        let season = |sun| WAYS.iter().zip(shares(here, sun)).map(|([east, _], share)| -east * share).sum::<f64>();
        let [january, spring, july] = SEASONS.map(season);
        0.5 * spring + 0.25 * (january + july)
    }

    /// Returns the climates of places.
    pub fn at_all(&self, places: &[Point], land: &impl PlannedLand) -> Vec<PlaceClimate> {
        let ways = || self.stations.iter().flatten();
        let all = places.iter().flat_map(|at| ways().map(|by| Point { x: at.x + by.x, y: at.y + by.y }));
        let all: Vec<Point> = all.collect();
        let heights = land.planned_all(&all);
        let stations = all.chunks_exact(4 * STATIONS).zip(heights.chunks_exact(4 * STATIONS));
        places.iter().zip(stations).map(|(at, (places, heights))| self.gathered(*at, places, heights)).collect()
    }

    fn parallel(&self, at: Point) -> Parallel {
        let (pole, period) = (self.pole, 4 * self.pole);
        // Whole numbers as long as they are large, so that far places are as exact as near ones.
        let south = (at.y.rem_euclid(period) + self.origin).rem_euclid(period);
        let (south, side) = if south < 2 * pole { (south, 1.0) } else { (period - south, -1.0) };
        let way = 1.0 - south as f64 / pole as f64;
        let over = (way.abs() - (1.0 - TURN)).max(0.0);
        let sine = SINE_RATE * (way.abs() - over * over / (2.0 * TURN));
        Parallel { degrees: arcsine(sine).copysign(way), north: side * (1.0 - over / TURN) }
    }

    /// Returns the climate of a place from the heights of its stations, those of one way after those of another.
    fn gathered(&self, at: Point, places: &[Point], heights: &[f64]) -> PlaceClimate {
        let here = self.parallel(at);
        let ways = places.chunks_exact(STATIONS).zip(heights.chunks_exact(STATIONS));
        let mut brought = [Brought::default(); 4];
        for ((brought, [east, _]), (places, heights)) in brought.iter_mut().zip(WAYS).zip(ways) {
            *brought = self.brought(east < 0.0, places, heights);
        }
        let (mut rain, mut inland) = ([0.0; 3], 0.0);
        for (rain, (season, sun)) in rain.iter_mut().zip(SEASONS.into_iter().enumerate()) {
            for (share, brought) in shares(here, sun).into_iter().zip(brought) {
                *rain += self.wetness * WATER * share * brought.rain[season];
                inland += share * brought.inland / SEASONS.len() as f64;
            }
        }
        // Below this, the parabola of `months` would have less than no rain in spring.
        rain[1] = rain[1].max(0.25 * (rain[0] + rain[2]));
        PlaceClimate {
            mean_c: self.mean_c(here.degrees, inland),
            swing_c: swing_c(here.degrees, inland),
            rain_mm: rain,
        }
    }

    /// Returns the mean temperature at the sea's level in degrees Celsius.
    ///
    /// Air that was long over land is warmer than that of the sea below 24 degrees, and colder above.
    fn mean_c(&self, degrees: f64, inland: f64) -> f64 {
        let square = degrees * degrees;
        27.0 + self.warmth_c - 0.0064 * square + 3.2 * smooth(inland) * (0.6 - square / 1000.0)
    }

    /// Follows air along a way.
    ///
    /// Based on: R. B. Smith and I. Barstad, A linear theory of orographic precipitation, 2004, in its simplest form:
    /// water falls with a length of its own, and where the land lifts the air.
    fn brought(&self, is_western: bool, places: &[Point], heights: &[f64]) -> Brought {
        let (mut crest, mut inland) = (0.0, 0.0);
        let mut water = [0.0; 3];
        let mut rain = [0.0; 3];
        for (station, (at, height)) in places.iter().zip(heights).enumerate() {
            let degrees = self.parallel(*at).degrees;
            let land = land_share(*height);
            let sea = 1.0 - land;
            let ground = height.max(0.0);
            let warmth = |inland: f64, sun: f64| {
                // Air is not quite as warm and as cold as the ground.
                self.mean_c(degrees, inland) + 0.85 * 0.5 * sun * swing_c(degrees, inland)
            };
            if station == 0 {
                let first = &heights[..FIRST_STATIONS];
                let land = first.iter().map(|height| land_share(*height)).sum::<f64>() / FIRST_STATIONS as f64;
                (crest, inland) = (ground, FIRST_INLAND * land);
                water = SEASONS.map(|sun| {
                    let on_land = FIRST_ON_LAND[0] + FIRST_ON_LAND[1] * belt(in_belts(degrees, sun), 0.0);
                    (FIRST_AT_SEA + land * (on_land - FIRST_AT_SEA)) * saturation(warmth(inland, sun))
                });
                continue;
            }
            let km = AWAY_KM[station - 1] - AWAY_KM[station];
            inland += (land - inland) * km / (INLAND_KM + km);
            let climb = (ground - crest).max(0.0);
            crest = ground.max(ground + (crest - ground) / (1.0 + km / LEE_KM));
            let lee = 1.0 / (1.0 + (crest - ground) / LEE_M);
            let share = (station + SPREAD.len()).checked_sub(STATIONS).map_or(0.0, |last| SPREAD[last]);
            let dry = if is_western { DRY_BELT } else { EASTERN_DRY_BELT * (1.0 - inland) + DRY_BELT * inland };
            for (season, sun) in SEASONS.into_iter().enumerate() {
                let saturated = saturation(warmth(inland, sun));
                let taken = sea * km / FETCH_KM;
                let held = (water[season] + taken * SEA_HUMIDITY * saturated) / (1.0 + taken);
                let humidity = held / saturated;
                let falls = humidity * lee * belt(in_belts(degrees, sun), dry) * km / RAIN_KM;
                let lifted = humidity * climb / LIFT_M;
                let left = held / (1.0 + falls + lifted);
                rain[season] += share * left * (falls + LIFT_SHARE * lifted) / km;
                let returned = RETURN_SHARE * saturated.min(1.0) * (RETURN_HUMIDITY * humidity).min(1.0);
                // The sea gives back what falls there.
                water[season] = sea * held + land * left * (1.0 + falls * returned);
            }
        }
        Brought { rain, inland }
    }
}

impl PlaceClimate {
    /// Returns the mean temperature at a height in metres, in degrees Celsius.
    pub fn temperature_c(&self, height_m: f64) -> f64 {
        self.mean_c - LAPSE * height_m
    }

    /// Returns the temperature of the warmest month less that of the coldest, in degrees Celsius.
    pub fn range_c(&self) -> f64 {
        self.swing_c.abs()
    }

    /// Returns the rain of a year in millimetres.
    pub fn rain_mm_a_year(&self) -> f64 {
        let [january, spring, july] = self.rain_mm;
        0.5 * spring + 0.25 * (january + july)
    }

    /// Returns the share of rain that falls in the warmer half of the year: 0.07 to 0.93.
    pub fn summer_share(&self) -> f64 {
        let months = self.months(0.0);
        let warmer = if self.swing_c < 0.0 { [0, 1, 2, 9, 10, 11] } else { [3, 4, 5, 6, 7, 8] };
        let summer: f64 = warmer.into_iter().map(|month| months[month].rain_mm).sum();
        summer / self.rain_mm_a_year().max(f64::MIN_POSITIVE)
    }

    /// Returns the months from January to December at a height in metres.
    ///
    /// Temperatures follow a cosine, and rain a parabola over this cosine.
    pub fn months(&self, height_m: f64) -> [Month; 12] {
        let [january, spring, july] = self.rain_mm.map(|rate| rate / 12.0);
        // The middle number of a Bernstein polynomial, which is never below the least of its three numbers.
        let between = 2.0 * spring - 0.5 * (january + july);
        MONTHS.map(|cosine| {
            let to_july = 0.5 * (1.0 + cosine);
            let to_january = 1.0 - to_july;
            Month {
                temperature_c: self.temperature_c(height_m) + 0.5 * self.swing_c * cosine,
                rain_mm: (january * to_january + 2.0 * between * to_july) * to_january + july * to_july * to_july,
            }
        })
    }

    /// Returns the biome at a height in metres.
    pub fn biome(&self, height_m: f64) -> Biome {
        Biome::of(&self.months(height_m))
    }

    /// Returns the millimetres of water that would evaporate in a year at a height in metres if there were enough.
    ///
    /// Based on: L. Turc, Le bilan d'eau des sols, 1954.
    pub fn potential_evaporation_mm(&self, height_m: f64) -> f64 {
        // The formula's own range ends at about this temperature.
        let warmth = self.temperature_c(height_m).max(-8.0);
        300.0 + 25.0 * warmth + 0.05 * warmth * warmth * warmth
    }

    /// Returns the drought at a height in metres: the water that could evaporate as a multiple of the rain, at most as
    /// with a millimetre of rain. It is the inverse of the aridity index; in deserts it is more than 5.
    pub fn drought(&self, height_m: f64) -> f64 {
        self.potential_evaporation_mm(height_m) / self.rain_mm_a_year().max(1.0)
    }

    /// Returns the millimetres of a year's rain that evaporate at a height in metres: less than all rain.
    ///
    /// Based on: L. Turc, Le bilan d'eau des sols, 1954, as changed by J. G. Pike, The estimation of annual run-off
    /// from meteorological data in a tropical climate, 1964: 1 in place of 0.9, so that some rain always stays.
    pub fn evaporation_mm(&self, height_m: f64) -> f64 {
        let (rain, most) = (self.rain_mm_a_year(), self.potential_evaporation_mm(height_m));
        rain / (1.0 + (rain / most) * (rain / most)).sqrt()
    }

    /// Returns the metres of water that run off in a year at a height in metres: at least a hundredth of the rain.
    pub fn runoff_m(&self, height_m: f64) -> f64 {
        let rain = self.rain_mm_a_year();
        (rain - self.evaporation_mm(height_m)).max(0.01 * rain) / 1000.0
    }

    /// Returns the height in metres above which glaciers live, below 0 where ice reaches the sea.
    ///
    /// Based on: A. Ohmura, P. Kasser and M. Funk, Climate at the equilibrium line of glaciers, 1992: the summer's mean
    /// there is the higher, the more snow falls.
    pub fn snow_line_m(&self) -> f64 {
        // The solution for T of `rain = 645 + 296 T + 9 T^2`.
        let at_line = (-296.0 + (296.0f64 * 296.0 - 36.0 * (645.0 - self.rain_mm_a_year())).sqrt()) / 18.0;
        // The mean of the cosines of the three warmest months.
        let summer = self.mean_c + 0.5 * self.range_c() * (1.0 + 2.0 * HALF_ROOT_3) / 3.0;
        (summer - at_line) / LAPSE
    }

    /// Returns the [snow line](Self::snow_line_m) of the last ice age, which gave valleys their shape.
    pub fn ice_age_snow_line_m(&self) -> f64 {
        self.snow_line_m() - ICE_AGE_M
    }

    /// Returns the height in metres above which no trees grow, below 0 where none grow at all.
    ///
    /// Based on: C. Körner and J. Paulsen, A world-wide study of high altitude treeline temperatures, 2004: the
    /// growing season has a mean of 6.4 degrees there. So has the year near the equator; elsewhere the warmest month
    /// then has about 10 degrees.
    pub fn tree_line_m(&self) -> f64 {
        let range = self.range_c() * self.range_c();
        let at_line = 6.4 + 3.6 * range / (range + 100.0);
        (self.mean_c + 0.5 * self.range_c() - at_line) / LAPSE
    }
}

/// Returns the temperature of July less that of January at the sea's level, in degrees Celsius.
fn swing_c(degrees: f64, inland: f64) -> f64 {
    degrees * (0.16 + 0.69 * smooth(inland))
}

/// Returns the share of land around a place of this planned height.
fn land_share(height_m: f64) -> f64 {
    smooth(0.5 + height_m / (2.0 * SHORE_M))
}

/// Returns the latitude in the belts of wind, which follow the sun: by 12 degrees near the equator, and by 4 beyond 45.
fn in_belts(degrees: f64, sun: f64) -> f64 {
    degrees - sun * (12.0 - 8.0 * smooth((degrees.abs() - 10.0) / 35.0))
}

/// Returns the rain of a belt of wind, given that around 28 degrees; see [`EQUATOR_BELT`].
fn belt(degrees: f64, dry: f64) -> f64 {
    let away = degrees.abs();
    let inner = (EQUATOR_BELT - dry) * (1.0 - smooth(away / 20.0));
    dry + inner + (OUTER_BELT - dry) * smooth((away - 31.0) / 13.0)
}

/// Returns the share of time for which air takes each of the [`WAYS`].
///
/// Trade winds blow from the east and from the poles up to about 28 degrees, westerlies from the west and from the
/// equator up to 62, and polar winds from the east and from the poles again. In summer, more air comes from the
/// equator, and in winter from the poles.
fn shares(here: Parallel, sun: f64) -> [f64; 4] {
    let degrees = in_belts(here.degrees, sun);
    let rises = |from: f64, over: f64| smooth((degrees.abs() - from) / over);
    let eastern = 1.0 - 0.85 * rises(26.0, 14.0) + 0.65 * rises(58.0, 14.0);
    let trades = rises(0.0, 10.0) * (1.0 - rises(14.0, 16.0));
    let westerlies = rises(28.0, 14.0) * (1.0 - rises(52.0, 14.0));
    let from_pole = trades - 0.7 * westerlies + 0.6 * rises(58.0, 12.0);
    let northern = 0.5 + here.north * (0.35 * degrees.signum() * from_pole - 0.1 * sun);
    WAYS.map(|[east, south]| {
        let across = if east > 0.0 { eastern } else { 1.0 - eastern };
        let along = if south < 0.0 { northern } else { 1.0 - northern };
        across * along
    })
}

/// Returns the water that saturated air holds, as a multiple of that at 20 degrees Celsius.
///
/// Based on: P. R. Lowe, An approximating polynomial for the computation of saturation vapor pressure, 1977. It holds
/// from -50 to 50 degrees; beyond, the water stays the same.
fn saturation(degrees: f64) -> f64 {
    const LOWE: [f64; 7] = [
        6.136_820_929e-11,
        2.034_080_948e-8,
        3.031_240_396e-6,
        2.650_648_471e-4,
        1.428_945_805e-2,
        4.436_518_521e-1,
        6.107_799_961,
    ];
    /// The polynomial's value at 20 degrees, in hectopascals.
    const AT_20: f64 = 23.37;
    let degrees = degrees.clamp(-50.0, 50.0);
    LOWE.into_iter().fold(0.0, |sum, factor| sum * degrees + factor) / AT_20
}

/// Returns the angle from 0 to 90 degrees whose sine this is, from 0 to 1.
///
/// Based on: M. Abramowitz and I. A. Stegun, Handbook of Mathematical Functions, 1964, 4.4.46, within 2e-6 degrees.
fn arcsine(sine: f64) -> f64 {
    const FACTORS: [f64; 8] = [
        -0.001_262_491_1,
        0.006_670_090_1,
        -0.017_088_125_6,
        0.030_891_881_0,
        -0.050_174_304_6,
        0.088_978_987_4,
        -0.214_598_801_6,
        1.570_796_305_0,
    ];
    let sum = FACTORS.into_iter().fold(0.0, |sum, factor| sum * sine + factor);
    90.0 - (1.0 - sine).sqrt() * sum.to_degrees()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Metres a grain of a world with vertices 10 m apart.
    const METRES_A_GRAIN: f64 = 10.0 / 256.0;

    /// Land whose planned height is a function of the kilometres east and south of the origin.
    struct DrawnLand<F>(F);

    impl<F: Fn(f64, f64) -> f64> PlannedLand for DrawnLand<F> {
        fn planned_all(&self, places: &[Point]) -> Vec<f64> {
            let km = |grains: i64| grains as f64 * METRES_A_GRAIN / 1000.0;
            places.iter().map(|at| (self.0)(km(at.x), km(at.y))).collect()
        }
    }

    fn earth() -> Climate {
        Climate::new(&GeographySettings::default(), METRES_A_GRAIN)
    }

    fn at_km(x: f64, y: f64) -> Point {
        Point { x: (x * 1000.0 / METRES_A_GRAIN) as i64, y: (y * 1000.0 / METRES_A_GRAIN) as i64 }
    }

    /// Returns the place at a latitude, some kilometres east of the origin's meridian.
    fn at_latitude(x: f64, degrees: f64) -> Point {
        at_km(x, (ORIGIN_SINE - degrees.to_radians().sin()) / SINE_RATE * EARTH_POLE_KM)
    }

    fn one<F: Fn(f64, f64) -> f64>(at: Point, land: F) -> PlaceClimate {
        earth().at_all(&[at], &DrawnLand(land))[0]
    }

    /// Flat land from x = 0 to a width, with the sea on both sides.
    fn continent(width: f64) -> impl Fn(f64, f64) -> f64 {
        move |x, _| (x.min(width - x) * 2.0).clamp(-3000.0, 200.0)
    }

    #[test]
    fn the_sine_of_latitude_follows_the_distance_from_the_equator() {
        let earth = earth();
        assert!((earth.latitude(Point::default()) - 45.0).abs() < 0.001);
        for degrees in [-60.0, -30.0, -1.0, 1.0, 12.5, 50.0, 65.0] {
            let found = earth.latitude(at_latitude(0.0, degrees));
            assert!((found - degrees).abs() < 0.001, "{degrees}: {found}");
        }
        // 80 degrees north, then south; beyond the pole the latitude falls again.
        let north = -(1.0 - ORIGIN_SINE / SINE_RATE) * EARTH_POLE_KM;
        assert!((earth.latitude(at_km(0.0, north)) - 80.07).abs() < 0.01);
        assert!((earth.latitude(at_km(0.0, north + 2.0 * EARTH_POLE_KM)) + 80.07).abs() < 0.01);
        let beside = |km: f64| earth.latitude(at_km(0.0, north + km));
        for km in [1.0, 250.0, 4000.0, 9999.0] {
            assert!((beside(km) - beside(-km)).abs() < 1e-6);
        }
        let mut before = beside(-30_000.0);
        for km in -29_999..30_000 {
            let now = beside(f64::from(km));
            assert!((now - before).abs() < 0.02, "{km} km: {before} to {now}");
            before = now;
        }
    }

    #[test]
    fn a_period_further_on_everything_is_the_same() {
        let earth = earth();
        let period = 4 * earth.pole;
        let land = DrawnLand(|x: f64, _: f64| x.rem_euclid(2000.0) - 700.0);
        let near: Vec<Point> = (-30..30).map(|n| at_km(210.0, f64::from(n) * 700.0)).collect();
        for periods in [1, -1, 1_000, -3_000_000] {
            let far: Vec<Point> = near.iter().map(|at| Point { x: at.x, y: at.y + periods * period }).collect();
            assert_eq!(earth.at_all(&near, &land), earth.at_all(&far, &land));
        }
    }

    #[test]
    fn many_places_at_once_are_as_one_by_one() {
        let earth = earth();
        let land = DrawnLand(continent(2500.0));
        let places: Vec<Point> = (0..20).map(|n| at_km(f64::from(n) * 150.0, f64::from(n * n) * 30.0)).collect();
        let alone: Vec<PlaceClimate> = places.iter().map(|at| earth.at_all(&[*at], &land)[0]).collect();
        assert_eq!(earth.at_all(&places, &land), alone);
    }

    #[test]
    fn mountains_shelter_the_land_behind_them() {
        // A range 200 km wide on a wide plain, 700 km from both coasts.
        let range = |x: f64, _: f64| {
            let rise = 2000.0 * (1.0 - (x - 700.0).abs() / 100.0).max(0.0);
            continent(1400.0)(x, 0.0).max(if rise > 0.0 { 200.0 + rise } else { -3000.0 })
        };
        let rain = |degrees: f64, from: i32| {
            let strip = (from..from + 100).step_by(10).map(|x| at_latitude(f64::from(x), degrees));
            let strip = earth().at_all(&strip.collect::<Vec<_>>(), &DrawnLand(range));
            strip.iter().map(PlaceClimate::rain_mm_a_year).sum::<f64>() / strip.len() as f64
        };
        // Westerlies at 50 degrees, trade winds at 14.
        for (degrees, windward, lee) in [(50.0, 600, 700), (-50.0, 600, 700), (14.0, 700, 600), (-14.0, 700, 600)] {
            let (windward, lee) = (rain(degrees, windward), rain(degrees, lee));
            assert!(lee < 0.5 * windward, "{degrees} degrees: {windward} mm, behind the range {lee} mm");
        }
    }

    #[test]
    fn deserts_lie_in_the_west_at_25_degrees_and_rain_forests_at_the_equator() {
        for degrees in [25.0, -25.0] {
            let biome = |x: f64| one(at_latitude(x, degrees), continent(3500.0)).biome(200.0);
            assert_eq!([biome(400.0), biome(1000.0)], [Biome::BWh; 2]);
            let [west, east] =
                [150.0, 3350.0].map(|x| one(at_latitude(x, degrees), continent(3500.0)).rain_mm_a_year());
            assert!(east > 3.0 * west, "{west} and {east} mm");
        }
        let equator = one(at_latitude(2900.0, 0.0), continent(3500.0));
        assert!(equator.rain_mm_a_year() > 1500.0 && equator.biome(200.0) == Biome::Af, "{equator:?}");
        let savanna = one(at_latitude(2000.0, 9.0), continent(3500.0));
        assert_eq!(savanna.biome(200.0), Biome::Aw);
        assert!(savanna.summer_share() > 0.7);
    }

    #[test]
    fn west_coasts_have_dry_summers_at_36_degrees_and_rain_all_year_at_52() {
        for side in [1.0, -1.0] {
            let biome = |degrees: f64| one(at_latitude(60.0, side * degrees), continent(3000.0)).biome(100.0);
            assert!([Biome::Csa, Biome::Csb].contains(&biome(36.0)), "{:?}", biome(36.0));
            assert_eq!(biome(52.0), Biome::Cfb);
        }
    }

    #[test]
    fn the_sea_evens_out_the_year() {
        let range = |x: f64| one(at_latitude(x, 50.0), continent(4000.0)).range_c();
        let [sea, west, middle, east] = [-1000.0, 50.0, 2000.0, 3950.0].map(range);
        assert!(sea < 12.0 && west < 18.0 && middle > 30.0, "{sea}, {west}, {middle} degrees");
        // The wind blows from the west.
        assert!(east > west + 6.0, "{west} in the west, {east} in the east");
        let southern = one(at_latitude(2000.0, -50.0), continent(4000.0));
        assert!(southern.swing_c < -30.0);
    }

    #[test]
    fn neighbours_have_like_climates() {
        let land = |x: f64, y: f64| 150.0 * ((x / 600.0).sin() + (y / 500.0).cos()) + 40.0 * (x / 90.0).cos();
        let period = 40_000.0;
        for x in [0.0, 1234.0] {
            let row: Vec<Point> = (0..1600).map(|n| at_km(x, f64::from(n) / 1600.0 * period)).collect();
            let column: Vec<Point> = (0..400).map(|n| at_km(x + f64::from(n) * 25.0, 300.0 * x)).collect();
            for line in [row, column] {
                for pair in earth().at_all(&line, &DrawnLand(land)).array_windows() {
                    let [a, b]: &[PlaceClimate; 2] = pair;
                    assert!((a.mean_c - b.mean_c).abs() < 1.5 && (a.swing_c - b.swing_c).abs() < 3.0, "{a:?} {b:?}");
                    for (a, b) in a.rain_mm.iter().zip(b.rain_mm) {
                        assert!((a - b).abs() < 100.0 + 0.15 * (a + b), "{a} and {b} mm");
                    }
                }
            }
        }
    }

    #[test]
    fn a_warmer_or_wetter_world_is_so_everywhere() {
        let at: Vec<Point> = (0..16).map(|n| at_km(f64::from(n) * 200.0, f64::from(n) * 1000.0)).collect();
        let world = |warmth_c: f64, wetness: f64| {
            let settings = GeographySettings { warmth_c, wetness, ..GeographySettings::default() };
            Climate::new(&settings, METRES_A_GRAIN).at_all(&at, &DrawnLand(continent(2500.0)))
        };
        for ((plain, warm), wet) in world(0.0, 1.0).iter().zip(world(5.0, 1.0)).zip(world(0.0, 2.0)) {
            assert!((warm.mean_c - plain.mean_c - 5.0).abs() < 1e-9);
            assert!((wet.rain_mm_a_year() / plain.rain_mm_a_year() - 2.0).abs() < 1e-9);
        }
    }

    #[test]
    fn a_small_world_has_the_climates_of_a_large_one() {
        let settings = GeographySettings { pole_km: 100.0, ..GeographySettings::default() };
        let small = Climate::new(&settings, METRES_A_GRAIN);
        let land = DrawnLand(|x: f64, y: f64| continent(25.0)(x * 100.0, y));
        let small = small.at_all(&[at_km(6.0, 20.0)], &land)[0];
        let large = one(at_km(600.0, 2000.0), |x, y| continent(25.0)(x, y));
        assert!((small.mean_c - large.mean_c).abs() < 0.1, "{small:?} {large:?}");
    }

    #[test]
    fn months_add_up_to_the_year() {
        let wet_july = PlaceClimate { mean_c: 10.0, swing_c: 20.0, rain_mm: [0.0, 300.0, 1200.0] };
        let dry_july = PlaceClimate { rain_mm: [1200.0, 300.0, 0.0], ..wet_july };
        let southern = PlaceClimate { swing_c: -20.0, ..dry_july };
        for climate in [wet_july, dry_july, southern] {
            let months = climate.months(1000.0);
            let rain: f64 = months.iter().map(|month| month.rain_mm).sum();
            assert!((rain - climate.rain_mm_a_year()).abs() < 1e-9 && (rain - 450.0).abs() < 1e-9);
            let mean = months.iter().map(|month| month.temperature_c).sum::<f64>() / 12.0;
            assert!((mean - 3.5).abs() < 1e-9);
            assert!(months.iter().all(|month| month.rain_mm >= 0.0));
        }
        let share = wet_july.summer_share();
        assert!(share > 0.9 && share < 0.94, "{share}");
        assert!((southern.summer_share() - share).abs() < 1e-9);
        assert!((dry_july.summer_share() + share - 1.0).abs() < 1e-9);
    }

    #[test]
    fn water_that_does_not_evaporate_runs_off() {
        let with_rain = |mean_c: f64, rain: f64| PlaceClimate { mean_c, swing_c: 15.0, rain_mm: [rain; 3] };
        // The Rhine, the Amazon, the Sahara and Siberia: Earth's rivers carry about .45, 1.1, 0 and .2 m.
        for (mean_c, rain, least, most) in
            [(9.0, 950.0, 0.4, 0.6), (26.0, 2300.0, 0.8, 1.3), (25.0, 60.0, 0.0005, 0.002), (-8.0, 400.0, 0.15, 0.35)]
        {
            let runoff = with_rain(mean_c, rain).runoff_m(0.0);
            assert!((least..most).contains(&runoff), "{rain} mm at {mean_c} degrees: {runoff} m");
        }
        for mean_c in [-40.0, -8.0, 0.0, 30.0] {
            for rain in [0.0, 10.0, 500.0, 10_000.0] {
                let climate = with_rain(mean_c, rain);
                assert!((0.0..=rain).contains(&climate.evaporation_mm(0.0)));
                assert!(climate.runoff_m(0.0) >= 0.01 * rain / 1000.0);
                assert!(climate.evaporation_mm(1000.0) <= climate.evaporation_mm(0.0));
            }
        }
    }

    #[test]
    fn ice_and_trees_end_where_they_do_on_earth() {
        // The Alps, Kenya, Norway's west coast and the Lena's mouth. Snow lines in metres: 2,900, 4,700, 1,400, 600;
        // tree lines: 2,000, 3,300, 700, none.
        let places = [
            ([12.0, 18.0, 1500.0], [2300, 3200], [1600, 2300]),
            ([26.0, 2.0, 1200.0], [3700, 4800], [2900, 3500]),
            ([6.0, 13.0, 2200.0], [900, 1500], [500, 900]),
            ([-11.0, 38.0, 250.0], [500, 1300], [-2000, 0]),
        ];
        for ([mean_c, swing_c, rain], snow, trees) in places {
            let climate = PlaceClimate { mean_c, swing_c, rain_mm: [rain; 3] };
            let (snow_line, tree_line) = (climate.snow_line_m() as i32, climate.tree_line_m() as i32);
            assert!((snow[0]..snow[1]).contains(&snow_line), "{mean_c} degrees: {snow_line} m");
            assert!((trees[0]..trees[1]).contains(&tree_line), "{mean_c} degrees: {tree_line} m");
            assert!((climate.ice_age_snow_line_m() - climate.snow_line_m() + 1000.0).abs() < 1e-9);
            let wetter = PlaceClimate { rain_mm: [2.0 * rain; 3], ..climate };
            assert!(wetter.snow_line_m() < climate.snow_line_m());
        }
    }

    #[test]
    fn approximations_are_close() {
        for n in 0..=1000 {
            let sine = f64::from(n) / 1000.0;
            assert!((arcsine(sine) - libm::asin(sine).to_degrees()).abs() < 1e-5, "{sine}");
        }
        assert!((saturation(20.0) - 1.0).abs() < 0.001);
        for degrees in -50..50 {
            let rise = saturation(f64::from(degrees) + 1.0) / saturation(f64::from(degrees));
            assert!((1.04..1.13).contains(&rise), "{degrees}: {rise}");
        }
    }
}
