//! Biomes: the climates of Köppen and Geiger, each with the plants that grow there.
//!
//! Based on: M. C. Peel, B. L. Finlayson and T. A. McMahon, Updated world map of the Köppen-Geiger climate
//! classification, 2007: the criteria of their table 1.

/// A month, or the mean of this month over many years.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Month {
    /// Mean temperature in degrees Celsius.
    pub temperature_c: f64,
    /// Rain and melted snow in millimetres.
    pub rain_mm: f64,
}

/// A climate by its letters: first how warm or dry it is, then its rain, then its summers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Biome {
    /// Tropical rain forest.
    Af,
    /// Tropical monsoon forest.
    Am,
    /// Savanna.
    Aw,
    /// Hot desert.
    BWh,
    /// Cold desert.
    BWk,
    /// Hot steppe.
    BSh,
    /// Cold steppe.
    BSk,
    /// Mediterranean scrub.
    Csa,
    /// Mediterranean woods.
    Csb,
    /// Cool dry-summer heath.
    Csc,
    /// Subtropical monsoon woods.
    Cwa,
    /// Subtropical highland.
    Cwb,
    /// Cool dry-winter highland.
    Cwc,
    /// Humid subtropical forest.
    Cfa,
    /// Oceanic forest.
    Cfb,
    /// Cool oceanic heath.
    Cfc,
    /// Continental dry-summer scrub.
    Dsa,
    /// Continental dry-summer woods.
    Dsb,
    /// Dry-summer boreal forest.
    Dsc,
    /// Dry-summer larch forest.
    Dsd,
    /// Continental monsoon forest.
    Dwa,
    /// Continental monsoon woods.
    Dwb,
    /// Dry-winter boreal forest.
    Dwc,
    /// Dry-winter larch forest.
    Dwd,
    /// Continental forest.
    Dfa,
    /// Mixed forest.
    Dfb,
    /// Boreal forest.
    Dfc,
    /// Larch forest.
    Dfd,
    /// Tundra.
    ET,
    /// Ice.
    EF,
}

/// A biome, its letters, its name, its colour, and what grows there.
type BiomeRow = (Biome, &'static str, &'static str, [u8; 3], &'static str);

/// All biomes, in the order of the legend of Peel et al., with its colours.
#[rustfmt::skip]
const ROWS: [BiomeRow; 30] = [
    (Biome::Af, "Af", "tropical rain forest", [0, 0, 255],
     "Tall evergreen forest of many storeys, with lianas."),
    (Biome::Am, "Am", "tropical monsoon forest", [0, 120, 255],
     "Evergreen forest that outlasts a short dry season."),
    (Biome::Aw, "Aw", "savanna", [70, 170, 250],
     "Tall grass with scattered trees that shed their leaves when it is dry."),
    (Biome::BWh, "BWh", "hot desert", [255, 0, 0],
     "Bare rock, gravel and sand; shrubs and herbs along dry beds."),
    (Biome::BWk, "BWk", "cold desert", [255, 150, 150],
     "Bare gravel and sand with low, salt-loving shrubs."),
    (Biome::BSh, "BSh", "hot steppe", [245, 165, 0],
     "Thorny shrubs and tufts of grass with bare ground between."),
    (Biome::BSk, "BSk", "cold steppe", [255, 220, 100],
     "Short grass and sagebrush, with trees beside water only."),
    (Biome::Csa, "Csa", "Mediterranean scrub", [255, 255, 0],
     "Evergreen oaks and pines, olives, and scrub with hard leaves."),
    (Biome::Csb, "Csb", "Mediterranean woods", [200, 200, 0],
     "Oak woods, pines and conifers that stand dry summers."),
    (Biome::Csc, "Csc", "cool dry-summer heath", [150, 150, 0],
     "Low conifers, heath and grass on high or windy slopes."),
    (Biome::Cwa, "Cwa", "subtropical monsoon woods", [150, 255, 150],
     "Evergreen broad-leaved woods, and grass where they were cleared."),
    (Biome::Cwb, "Cwb", "subtropical highland", [100, 200, 100],
     "Highland grass with oaks, pines and cloud forest in the valleys."),
    (Biome::Cwc, "Cwc", "cool dry-winter highland", [50, 150, 50],
     "Bunch grass and low shrubs, below the mountains' bare tops."),
    (Biome::Cfa, "Cfa", "humid subtropical forest", [200, 255, 80],
     "Evergreen and deciduous broad-leaved forest, with pines on sand."),
    (Biome::Cfb, "Cfb", "oceanic forest", [100, 255, 80],
     "Deciduous beech and oak forest, lush meadows."),
    (Biome::Cfc, "Cfc", "cool oceanic heath", [50, 200, 0],
     "Moor, heath, wind-bent birches and grass."),
    (Biome::Dsa, "Dsa", "continental dry-summer scrub", [255, 0, 255],
     "Steppe and open oak woods, with snow in winter."),
    (Biome::Dsb, "Dsb", "continental dry-summer woods", [200, 0, 200],
     "Open pine and juniper woods with grass between."),
    (Biome::Dsc, "Dsc", "dry-summer boreal forest", [150, 50, 150],
     "Spruce and fir on shady slopes, dry meadows on others."),
    (Biome::Dsd, "Dsd", "dry-summer larch forest", [150, 100, 150],
     "Open larch forest on frozen ground, with lichens."),
    (Biome::Dwa, "Dwa", "continental monsoon forest", [170, 175, 255],
     "Deciduous oak and maple forest, bare in dry winters."),
    (Biome::Dwb, "Dwb", "continental monsoon woods", [90, 120, 220],
     "Mixed forest of oak, birch, pine and larch."),
    (Biome::Dwc, "Dwc", "dry-winter boreal forest", [75, 80, 180],
     "Larch and pine forest on ground that is frozen in places."),
    (Biome::Dwd, "Dwd", "dry-winter larch forest", [50, 0, 135],
     "Larches that shed their needles, on ground that never thaws below."),
    (Biome::Dfa, "Dfa", "continental forest", [0, 255, 255],
     "Deciduous forest, and tall-grass prairie where it is drier."),
    (Biome::Dfb, "Dfb", "mixed forest", [55, 200, 255],
     "Spruce, pine, birch, oak and maple together."),
    (Biome::Dfc, "Dfc", "boreal forest", [0, 125, 125],
     "Spruce, fir and pine without end, with bogs."),
    (Biome::Dfd, "Dfd", "larch forest", [0, 70, 95],
     "Low, open larches on ground that never thaws below."),
    (Biome::ET, "ET", "tundra", [178, 178, 178],
     "Moss, lichens, sedges and dwarf shrubs; no trees."),
    (Biome::EF, "EF", "ice", [102, 102, 102],
     "Ice, and bare rock with lichens."),
];

impl Biome {
    /// All biomes, in the order of the legend of Peel et al.
    pub fn all() -> impl Iterator<Item = Biome> {
        ROWS.iter().map(|row| row.0)
    }

    /// Returns the biome of a place with these means of the months from January to December.
    ///
    /// Summer is the warmer half of the year, of April to September and October to March. Dry climates come first, as
    /// with Peel et al. Where both summers and winters are dry enough for a letter, the drier half year gives it.
    pub fn of(months: &[Month; 12]) -> Biome {
        let year = Year::of(months);
        match () {
            () if year.rain < 10.0 * year.dry_below => dry(&year),
            () if year.hottest < 10.0 => [Biome::EF, Biome::ET][usize::from(year.hottest > 0.0)],
            () if year.coldest >= 18.0 => tropical(&year),
            () => temperate(&year),
        }
    }

    /// Returns the letters, as in `Cfb`.
    pub fn code(self) -> &'static str {
        self.row().1
    }

    /// Returns the name, as in `oceanic forest`.
    pub fn name(self) -> &'static str {
        self.row().2
    }

    /// Returns a sentence on what grows there.
    pub fn plants(self) -> &'static str {
        self.row().4
    }

    /// Returns the red, green and blue (sRGB) of the legend of Peel et al.
    pub fn colour(self) -> [u8; 3] {
        self.row().3
    }

    fn row(self) -> &'static BiomeRow {
        &ROWS[self as usize]
    }
}

/// Months from January on that are summer where April to September is the warmer half of the year.
const APRIL_TO_SEPTEMBER: std::ops::Range<usize> = 3..9;

/// A year in the terms of Peel et al. Temperatures in degrees Celsius, rain in millimetres.
struct Year {
    mean: f64,
    hottest: f64,
    coldest: f64,
    /// Months of 10 degrees and more.
    mild_months: usize,
    rain: f64,
    /// A tenth of the rain in a year below which the place is dry.
    dry_below: f64,
    driest: f64,
    /// Rain of the driest and of the wettest month of summer, then of winter.
    summer: [f64; 2],
    winter: [f64; 2],
    summer_share: f64,
}

impl Year {
    fn of(months: &[Month; 12]) -> Year {
        let half = |is_in: bool| {
            let own = months.iter().enumerate().filter(move |(n, _)| APRIL_TO_SEPTEMBER.contains(n) == is_in);
            let [mut warmth, mut rain, mut driest, mut wettest] = [0.0, 0.0, f64::MAX, 0.0];
            for (_, month) in own {
                warmth += month.temperature_c;
                rain += month.rain_mm;
                driest = month.rain_mm.min(driest);
                wettest = month.rain_mm.max(wettest);
            }
            (warmth, rain, [driest, wettest])
        };
        let [april, october] = [half(true), half(false)];
        let (summer, winter) = if april.0 >= october.0 { (april, october) } else { (october, april) };
        let rain = summer.1 + winter.1;
        let mean = (summer.0 + winter.0) / 12.0;
        let season = if summer.1 >= 0.7 * rain {
            28.0
        } else if winter.1 >= 0.7 * rain {
            0.0
        } else {
            14.0
        };
        let temperatures = months.iter().map(|month| month.temperature_c);
        Year {
            mean,
            hottest: temperatures.clone().fold(f64::MIN, f64::max),
            coldest: temperatures.clone().fold(f64::MAX, f64::min),
            mild_months: temperatures.filter(|warmth| *warmth >= 10.0).count(),
            rain,
            dry_below: 2.0 * mean + season,
            driest: summer.2[0].min(winter.2[0]),
            summer: summer.2,
            winter: winter.2,
            summer_share: summer.1 / rain.max(f64::MIN_POSITIVE),
        }
    }
}

fn dry(year: &Year) -> Biome {
    let is_cold = usize::from(year.mean < 18.0);
    let is_steppe = usize::from(year.rain >= 5.0 * year.dry_below);
    [[Biome::BWh, Biome::BWk], [Biome::BSh, Biome::BSk]][is_steppe][is_cold]
}

fn tropical(year: &Year) -> Biome {
    if year.driest >= 60.0 {
        Biome::Af
    } else if year.driest >= 100.0 - year.rain / 25.0 {
        Biome::Am
    } else {
        Biome::Aw
    }
}

/// Returns the biome of a place of the classes C and D.
fn temperate(year: &Year) -> Biome {
    let has_dry_summer = year.summer[0] < 40.0 && year.summer[0] < year.winter[1] / 3.0;
    let has_dry_winter = year.winter[0] < year.summer[1] / 10.0;
    let rain = match (has_dry_summer, has_dry_winter) {
        (true, true) => usize::from(year.summer_share >= 0.5),
        (true, false) => 0,
        (false, true) => 1,
        (false, false) => 2,
    };
    let is_hot = year.hottest >= 22.0;
    if year.coldest > 0.0 {
        let summers = if is_hot { 0 } else { 1 + usize::from(year.mild_months < 4) };
        return [
            [Biome::Csa, Biome::Csb, Biome::Csc],
            [Biome::Cwa, Biome::Cwb, Biome::Cwc],
            [Biome::Cfa, Biome::Cfb, Biome::Cfc],
        ][rain][summers];
    }
    let summers = match () {
        () if is_hot => 0,
        () if year.mild_months >= 4 => 1,
        () => 2 + usize::from(year.coldest < -38.0),
    };
    [
        [Biome::Dsa, Biome::Dsb, Biome::Dsc, Biome::Dsd],
        [Biome::Dwa, Biome::Dwb, Biome::Dwc, Biome::Dwd],
        [Biome::Dfa, Biome::Dfb, Biome::Dfc, Biome::Dfd],
    ][rain][summers]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn months(temperatures: [f64; 12], rain: [f64; 12]) -> [Month; 12] {
        std::array::from_fn(|n| Month { temperature_c: temperatures[n], rain_mm: rain[n] })
    }

    /// Cities and stations with their means from January to December, rounded: degrees Celsius, then millimetres.
    #[rustfmt::skip]
    const STATIONS: [(&str, Biome, [f64; 12], [f64; 12]); 32] = [
        ("Singapore", Biome::Af,
         [26.5, 27.0, 27.5, 28.0, 28.3, 28.3, 27.9, 27.9, 27.6, 27.6, 27.0, 26.4],
         [235.0, 115.0, 170.0, 155.0, 170.0, 135.0, 155.0, 150.0, 155.0, 165.0, 250.0, 330.0]),
        ("Miami", Biome::Am,
         [20.0, 21.1, 22.3, 24.3, 26.5, 27.9, 28.7, 28.7, 28.1, 26.3, 23.7, 21.3],
         [41.0, 57.0, 76.0, 80.0, 136.0, 246.0, 165.0, 226.0, 251.0, 161.0, 83.0, 60.0]),
        ("Mumbai", Biome::Aw,
         [24.0, 25.0, 27.0, 28.5, 30.0, 29.0, 27.5, 27.5, 27.5, 28.5, 27.5, 25.5],
         [0.0, 1.0, 0.0, 0.0, 12.0, 520.0, 800.0, 550.0, 310.0, 65.0, 10.0, 5.0]),
        ("Darwin", Biome::Aw,
         [28.3, 28.2, 28.3, 28.3, 27.0, 25.1, 24.8, 25.7, 27.8, 29.2, 29.4, 29.0],
         [430.0, 375.0, 320.0, 100.0, 21.0, 2.0, 1.0, 5.0, 16.0, 72.0, 142.0, 250.0]),
        ("Cairo", Biome::BWh,
         [14.0, 15.0, 18.0, 21.5, 25.0, 27.5, 28.0, 28.0, 26.5, 24.0, 19.0, 15.0],
         [5.0, 4.0, 4.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 3.0, 6.0]),
        ("Alice Springs", Biome::BWh,
         [28.9, 27.9, 25.2, 20.4, 15.6, 12.3, 12.0, 14.6, 19.0, 23.1, 25.9, 27.7],
         [41.0, 43.0, 32.0, 17.0, 19.0, 13.0, 15.0, 9.0, 8.0, 21.0, 28.0, 37.0]),
        ("Kashgar", Biome::BWk,
         [-5.0, -0.5, 8.5, 16.0, 20.0, 24.0, 26.0, 24.5, 20.0, 13.0, 5.0, -3.0],
         [2.0, 5.0, 6.0, 6.0, 13.0, 9.0, 10.0, 10.0, 6.0, 3.0, 1.0, 1.0]),
        ("Niamey", Biome::BSh,
         [24.5, 27.5, 31.5, 34.0, 34.0, 31.5, 29.0, 28.0, 29.5, 31.0, 28.0, 25.0],
         [0.0, 0.0, 4.0, 6.0, 35.0, 70.0, 150.0, 170.0, 90.0, 16.0, 0.0, 0.0]),
        ("Denver", Biome::BSk,
         [-0.5, 0.5, 5.0, 9.0, 14.0, 20.0, 23.5, 22.5, 18.0, 11.0, 4.0, -1.0],
         [10.0, 11.0, 30.0, 43.0, 57.0, 45.0, 52.0, 43.0, 28.0, 25.0, 18.0, 10.0]),
        ("Rome", Biome::Csa,
         [7.5, 8.0, 10.5, 13.5, 18.0, 22.0, 24.5, 24.5, 21.0, 17.0, 12.0, 8.5],
         [70.0, 70.0, 65.0, 65.0, 50.0, 30.0, 15.0, 30.0, 70.0, 100.0, 115.0, 90.0]),
        ("Perth", Biome::Csa,
         [24.5, 24.9, 23.1, 19.6, 16.2, 13.7, 12.8, 13.3, 14.7, 17.0, 20.2, 22.6],
         [17.0, 13.0, 20.0, 37.0, 90.0, 128.0, 146.0, 123.0, 83.0, 41.0, 25.0, 12.0]),
        ("Santiago", Biome::Csb,
         [21.0, 20.0, 18.5, 14.5, 11.0, 8.5, 8.0, 9.5, 11.5, 14.5, 17.5, 20.0],
         [1.0, 1.0, 4.0, 15.0, 55.0, 80.0, 70.0, 50.0, 28.0, 13.0, 8.0, 4.0]),
        ("Balmaceda", Biome::Csc,
         [11.8, 11.6, 9.5, 6.5, 3.4, 0.9, 0.4, 1.8, 3.9, 6.4, 8.7, 10.7],
         [24.0, 22.0, 36.0, 48.0, 84.0, 76.0, 74.0, 68.0, 46.0, 36.0, 32.0, 30.0]),
        ("Hong Kong", Biome::Cwa,
         [16.5, 17.0, 19.0, 23.0, 26.5, 28.0, 29.0, 28.5, 28.0, 25.5, 22.0, 18.0],
         [33.0, 39.0, 75.0, 153.0, 290.0, 491.0, 386.0, 453.0, 321.0, 120.0, 39.0, 29.0]),
        ("Mexico City", Biome::Cwb,
         [14.6, 16.0, 18.2, 19.6, 19.7, 19.0, 18.0, 18.1, 17.8, 17.0, 15.8, 14.8],
         [8.0, 5.0, 11.0, 23.0, 53.0, 135.0, 180.0, 170.0, 145.0, 65.0, 12.0, 6.0]),
        ("Tokyo", Biome::Cfa,
         [5.0, 6.0, 9.0, 14.0, 18.5, 22.0, 25.5, 27.0, 23.0, 18.0, 12.5, 7.5],
         [60.0, 57.0, 116.0, 134.0, 140.0, 168.0, 156.0, 155.0, 225.0, 235.0, 97.0, 58.0]),
        ("Buenos Aires", Biome::Cfa,
         [25.0, 24.0, 22.0, 18.0, 14.5, 12.0, 11.0, 13.0, 15.0, 18.0, 21.0, 23.5],
         [139.0, 127.0, 140.0, 119.0, 92.0, 59.0, 61.0, 75.0, 72.0, 127.0, 117.0, 117.0]),
        ("London", Biome::Cfb,
         [5.0, 5.5, 8.0, 10.5, 13.5, 16.5, 18.5, 18.5, 15.5, 12.0, 8.0, 5.5],
         [55.0, 41.0, 42.0, 44.0, 49.0, 45.0, 45.0, 50.0, 49.0, 69.0, 59.0, 55.0]),
        ("Wellington", Biome::Cfb,
         [17.0, 17.0, 16.0, 14.0, 12.0, 10.0, 9.0, 9.5, 11.0, 12.0, 13.5, 15.5],
         [75.0, 70.0, 87.0, 87.0, 118.0, 133.0, 137.0, 112.0, 98.0, 115.0, 99.0, 86.0]),
        ("Reykjavik", Biome::Cfc,
         [0.5, 0.7, 1.0, 3.7, 6.7, 9.8, 11.6, 11.0, 8.2, 5.0, 2.2, 0.8],
         [83.0, 86.0, 82.0, 57.0, 53.0, 43.0, 50.0, 65.0, 90.0, 83.0, 85.0, 95.0]),
        ("Salt Lake City", Biome::Dsa,
         [-0.8, 2.0, 7.0, 10.5, 15.5, 21.5, 26.5, 25.5, 19.5, 12.0, 5.0, -0.5],
         [36.0, 35.0, 45.0, 54.0, 46.0, 24.0, 12.0, 15.0, 27.0, 33.0, 35.0, 37.0]),
        ("Flagstaff", Biome::Dsb,
         [-1.0, 0.0, 3.0, 6.0, 11.0, 16.0, 19.0, 18.0, 15.0, 9.0, 3.0, -1.0],
         [53.0, 56.0, 55.0, 30.0, 15.0, 8.0, 66.0, 79.0, 50.0, 42.0, 44.0, 50.0]),
        ("Beijing", Biome::Dwa,
         [-3.0, 0.0, 7.0, 15.0, 21.0, 25.0, 27.0, 26.0, 21.0, 13.5, 5.0, -1.0],
         [3.0, 5.0, 8.0, 25.0, 35.0, 78.0, 185.0, 160.0, 50.0, 22.0, 8.0, 3.0]),
        ("Vladivostok", Biome::Dwb,
         [-12.3, -8.4, -1.9, 5.1, 9.8, 13.6, 17.6, 19.8, 16.0, 8.9, -0.9, -9.1],
         [12.0, 15.0, 27.0, 48.0, 81.0, 110.0, 164.0, 156.0, 115.0, 59.0, 29.0, 18.0]),
        ("Irkutsk", Biome::Dwc,
         [-18.0, -15.0, -7.0, 2.0, 9.5, 15.5, 18.0, 15.5, 8.5, 1.5, -8.0, -15.5],
         [13.0, 8.0, 11.0, 20.0, 33.0, 75.0, 110.0, 95.0, 52.0, 22.0, 18.0, 17.0]),
        ("Oymyakon", Biome::Dwd,
         [-46.0, -43.0, -33.0, -15.0, 2.5, 12.0, 14.5, 10.5, 2.0, -15.0, -36.0, -45.0],
         [6.0, 6.0, 5.0, 4.0, 14.0, 33.0, 61.0, 37.0, 22.0, 13.0, 12.0, 8.0]),
        ("Chicago", Biome::Dfa,
         [-4.0, -2.0, 4.0, 10.0, 16.0, 21.5, 24.0, 23.0, 19.0, 12.5, 5.5, -1.5],
         [50.0, 50.0, 63.0, 95.0, 115.0, 104.0, 94.0, 108.0, 81.0, 87.0, 63.0, 54.0]),
        ("Moscow", Biome::Dfb,
         [-6.5, -6.0, -0.5, 7.0, 13.5, 17.0, 19.0, 17.0, 11.5, 5.5, -1.0, -5.0],
         [53.0, 44.0, 39.0, 37.0, 61.0, 78.0, 84.0, 78.0, 66.0, 70.0, 52.0, 51.0]),
        ("Fairbanks", Biome::Dfc,
         [-22.0, -19.0, -12.0, 0.5, 9.8, 16.0, 17.0, 14.0, 7.5, -4.0, -16.0, -20.0],
         [15.0, 11.0, 6.0, 8.0, 15.0, 35.0, 55.0, 48.0, 28.0, 21.0, 17.0, 16.0]),
        ("Yakutsk", Biome::Dfd,
         [-38.5, -34.0, -20.0, -5.0, 7.5, 16.0, 19.5, 15.5, 6.0, -8.0, -27.5, -37.5],
         [9.0, 8.0, 7.0, 8.0, 20.0, 35.0, 39.0, 37.0, 31.0, 18.0, 16.0, 10.0]),
        ("Barrow", Biome::ET,
         [-25.0, -25.5, -25.0, -17.0, -6.0, 2.0, 5.0, 4.0, 0.5, -8.0, -17.0, -22.0],
         [3.0, 4.0, 3.0, 4.0, 5.0, 8.0, 25.0, 27.0, 18.0, 10.0, 5.0, 4.0]),
        ("Vostok", Biome::EF,
         [-32.0, -44.0, -58.0, -65.0, -66.0, -65.0, -67.0, -68.0, -66.0, -57.0, -43.0, -32.0],
         [0.0, 0.0, 1.0, 2.0, 3.0, 2.0, 2.0, 2.0, 2.0, 2.0, 1.0, 0.0]),
    ];

    #[test]
    fn stations_have_the_climates_that_they_are_known_for() {
        for (name, biome, temperatures, rain) in STATIONS {
            assert_eq!(Biome::of(&months(temperatures, rain)), biome, "{name}");
        }
    }

    #[test]
    fn summer_is_the_warmer_half_of_the_year() {
        for (name, biome, temperatures, rain) in STATIONS {
            let (mut temperatures, mut rain) = (temperatures, rain);
            temperatures.rotate_left(6);
            rain.rotate_left(6);
            assert_eq!(Biome::of(&months(temperatures, rain)), biome, "{name} on the other half of the Earth");
        }
    }

    #[test]
    fn rows_stand_in_the_order_of_their_biomes() {
        for (number, biome) in Biome::all().enumerate() {
            assert_eq!((biome as usize, biome.code()), (number, format!("{biome:?}").as_str()));
            assert!(biome.plants().ends_with('.'));
            let like = |other: Biome| other.name() == biome.name() || other.colour() == biome.colour();
            assert_eq!(Biome::all().filter(|other| like(*other)).count(), 1, "{biome:?}");
        }
        assert_eq!(Biome::all().count(), 30);
    }
}
