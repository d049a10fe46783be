//! Names of settlements, rivers, lakes, peaks, valleys, ranges and realms, put together from the syllables of a
//! region's tongue.
//!
//! A name is a pure function of the seed, of the site cell in which the named feature lies, and of a number that
//! distinguishes the features of one cell. The tongue changes from region to region, so names of neighbours sound
//! alike. In a world with a geography the regions are those of its [peoples](cultures), and each part of a region has a
//! dialect, which prefers some syllables of the tongue.

pub mod cultures;
mod tongues;

use std::sync::Arc;

use cultures::{Cultures, Homeland};
use tongues::{OF_ONE_LAND, TONGUES, Tongue};

use crate::geography::realms::{Realm, RealmKind};
use crate::grain_point::{GRAINS, Point};
use crate::hash::{self, Stream, StreamNumber};
use crate::lines::SiteId;

/// Side, in site cells, of the squares that each contain the home of one tongue.
const HOME_CELLS: i64 = 10;

/// Groups of letters that an English reader would take for something else.
const UNWELCOME: &[&str] = &[
    "anal", "anus", "ass", "bitch", "boob", "cock", "crap", "cum", "cunt", "damn", "dick", "fag", "fuck", "hell",
    "kill", "kkk", "kok", "nazi", "neg", "nig", "paki", "pee", "penis", "pis", "poo", "porn", "pric", "rape", "sex",
    "shit", "slut", "tard", "tit", "turd", "vag", "wank", "whor",
];

/// The names of a world's features, by their positions.
#[derive(Clone, Debug)]
pub struct Names {
    seed: u64,
    /// Side of a site cell in vertices.
    cell_side: i64,
    /// The peoples of a world with a geography.
    cultures: Option<Arc<Cultures>>,
}

impl Names {
    /// Returns the names of a world whose site cells have so many vertices a side, with its peoples if it has a
    /// geography.
    pub fn new(seed: u64, cell_side: i64, cultures: Option<Arc<Cultures>>) -> Names {
        Names { seed, cell_side, cultures }
    }

    /// Returns the peoples that the names are taken from; none in a world without a geography.
    pub fn cultures(&self) -> Option<&Arc<Cultures>> {
        self.cultures.as_ref()
    }

    /// Returns the name of the settlement of a site cell.
    pub fn settlement(&self, id: SiteId) -> String {
        self.named(Stream::SettlementName, id, 0, |speech, dice| {
            let ending = speech.syllable(dice, speech.tongue.towns);
            // A stem with an ending is mostly short; a stem without one has two syllables.
            let long = ending.is_empty() || dice.below(4) == 0;
            capital(&joined(stem(speech, dice, long), ending)) + ending
        })
    }

    /// Returns the name of a continent, a sea and so on, in the tongue of its middle.
    pub fn realm(&self, realm: &Realm) -> String {
        let Point { x, y } = realm.middle;
        let patterns: fn(&Tongue) -> Patterns = match realm.kind {
            RealmKind::Continent => |tongue| tongue.continents,
            RealmKind::Island => |tongue| tongue.islands,
            RealmKind::Ocean => |tongue| tongue.oceans,
            RealmKind::Sea => |tongue| tongue.seas,
            RealmKind::Bay => |tongue| tongue.bays,
            RealmKind::Desert => |tongue| tongue.deserts,
            RealmKind::Plain => |tongue| tongue.plains,
            RealmKind::Range => |tongue| tongue.ranges,
        };
        let stream = Stream::Realms.of(RealmKind::ALL.len() as u64 + realm.kind as u64);
        self.thing(stream, self.cell([x, y].map(|grains| grains.div_euclid(GRAINS))), 0, patterns)
    }

    /// Returns the name of a river, made from the site cell of one of the river's vertices and from the numbers of its
    /// id.
    pub fn river(&self, at: [i64; 2], id: &[i64]) -> String {
        self.thing(Stream::RiverName, self.cell(at), number(id), |tongue| tongue.rivers)
    }

    /// Returns the name of a lake, likewise.
    pub fn lake(&self, at: [i64; 2], id: &[i64]) -> String {
        self.thing(Stream::LakeName, self.cell(at), number(id), |tongue| tongue.lakes)
    }

    /// Returns the name of a salt pan, likewise. All tongues have taken these patterns from those who live beside pans.
    pub fn pan(&self, at: [i64; 2], id: &[i64]) -> String {
        self.thing(Stream::LakeName, self.cell(at), number(id), |_| &["* Pan", "Salar *", "Chott *"])
    }

    /// Returns the name of a peak, likewise.
    pub fn peak(&self, at: [i64; 2], id: &[i64]) -> String {
        self.thing(Stream::PeakName, self.cell(at), number(id), |tongue| tongue.peaks)
    }

    /// Returns the name of a river's valley; its arguments are those of [the river's name](Names::river).
    pub fn valley(&self, at: [i64; 2], id: &[i64]) -> String {
        // With the random numbers of the river, so that both have the same stem.
        self.thing(Stream::RiverName, self.cell(at), number(id), |tongue| tongue.valleys)
    }

    /// Returns the name of a mountain range, given the position of its highest vertex.
    pub fn range(&self, at: [i64; 2]) -> String {
        self.thing(Stream::RangeName, self.cell(at), 0, |tongue| tongue.ranges)
    }

    fn cell(&self, at: [i64; 2]) -> SiteId {
        let [i, j] = at.map(|at| at.div_euclid(self.cell_side));
        SiteId { i, j }
    }

    /// Returns the name of a thing in a site cell by patterns of the tongue. `number` distinguishes the things of one
    /// kind in the cell.
    fn thing(
        &self,
        stream: impl Into<StreamNumber>,
        cell: SiteId,
        number: u64,
        patterns: fn(&Tongue) -> Patterns,
    ) -> String {
        self.named(stream, cell, number, |speech, dice| {
            let pattern = dice.pick(patterns(speech.tongue));
            let ending = pattern.split_once('*').map_or("", |(_, ending)| ending);
            let long = dice.below(3) > 0;
            pattern.replace('*', &capital(&joined(stem(speech, dice, long), ending)))
        })
    }

    /// Returns the first name made by `make` that contains no unwelcome group of letters.
    fn named(
        &self,
        stream: impl Into<StreamNumber>,
        cell: SiteId,
        number: u64,
        make: impl Fn(&Speech, &mut Dice) -> String,
    ) -> String {
        let speech = self.speech(cell);
        let mut dice = Dice { key: hash::mix(cell.hash(self.seed, stream) ^ hash::mix(number)), thrown: 0 };
        loop {
            let name = make(&speech, &mut dice);
            let small = name.to_lowercase();
            if !UNWELCOME.iter().any(|group| small.contains(group)) {
                return name;
            }
        }
    }

    /// Returns the tongue and the dialect of a site cell.
    fn speech(&self, cell: SiteId) -> Speech {
        let Some(cultures) = &self.cultures else {
            return Speech { tongue: tongue(self.seed, cell), dialect: None };
        };
        let [x, y] = [cell.i, cell.j].map(|cell| cell * self.cell_side + self.cell_side / 2);
        let culture = cultures.at(Point::at_vertex(x, y));
        let tongues = tongues_of(culture.homeland);
        let tongue = tongues[((culture.people >> 32) % tongues.len() as u64) as usize];
        Speech { tongue: &TONGUES[tongue], dialect: Some(culture.dialect) }
    }
}

/// Turns the numbers of an id into one that distinguishes the features of a cell.
fn number(id: &[i64]) -> u64 {
    hash::of(id.iter().map(|part| *part as u64))
}

/// Returns the tongues that are spoken by peoples of a land, by their numbers in [`TONGUES`].
fn tongues_of(homeland: Homeland) -> &'static [usize] {
    match homeland {
        Homeland::Islands => &[7, 8],
        Homeland::RainForest => &[13, 8],
        Homeland::Savanna => &[9, 8, 13],
        Homeland::HotDesert => &[5],
        Homeland::Steppe => &[6, 12],
        Homeland::DrySummers => &[1, 12],
        Homeland::RainySummers => &[14, 9, 8],
        Homeland::Oceanic => &[2, 0],
        Homeland::ColdWinters => &[3, 0, 2],
        Homeland::North => &[4, 10],
        Homeland::Mountains => &[11],
    }
}

/// Returns the tongue spoken in a site cell: that of the nearest home.
fn tongue(seed: u64, cell: SiteId) -> &'static Tongue {
    let square = (cell.i.div_euclid(HOME_CELLS), cell.j.div_euclid(HOME_CELLS));
    let homes = (-1..=1).flat_map(|dj| (-1..=1).map(move |di| (di, dj))).map(|(di, dj)| {
        let (i, j) = (square.0 + di, square.1 + dj);
        let hash = SiteId { i, j }.hash(seed, Stream::Tongue);
        let at = |square: i64, bits: u64| square * HOME_CELLS + (bits % HOME_CELLS as u64) as i64;
        let (east, south) = (at(i, hash & 0xFFFF) - cell.i, at(j, (hash >> 16) & 0xFFFF) - cell.j);
        (east * east + south * south, hash)
    });
    let (_, hash) = homes.min().expect("there are nine squares");
    &TONGUES[((hash >> 32) % OF_ONE_LAND as u64) as usize]
}

/// Returns a stem of one syllable, or of two if it is to be long.
fn stem(speech: &Speech, dice: &mut Dice, long: bool) -> String {
    let mut stem = String::new();
    for _ in 0..=usize::from(long) {
        if !stem.is_empty() {
            let link = dice.pick(speech.tongue.links);
            stem.push_str(link);
        }
        let onset = match stem.chars().last() {
            // Two clusters of consonants in a row are hard to say.
            Some(last) if !is_vowel(last) => &speech.syllable(dice, speech.tongue.onsets)[..1],
            _ => speech.syllable(dice, speech.tongue.onsets),
        };
        stem.push_str(onset);
        stem.push_str(speech.syllable(dice, speech.tongue.nuclei));
    }
    stem.push_str(speech.syllable(dice, speech.tongue.codas));
    stem
}

/// Cuts letters from a stem that cannot stand before its ending: vowels before a vowel, and before a consonant the same
/// letter or the end of a cluster.
fn joined(mut stem: String, ending: &str) -> String {
    let Some(first) = ending.chars().next() else { return stem };
    let last = |stem: &str| stem.chars().last();
    if is_vowel(first) {
        while stem.len() > 2 && last(&stem).is_some_and(is_vowel) {
            stem.pop();
        }
    } else if first != ' ' {
        let cluster = stem.chars().rev().take_while(|letter| !is_vowel(*letter)).count() > 1;
        if stem.len() > 2 && (cluster || last(&stem) == Some(first)) {
            stem.pop();
        }
    }
    stem
}

fn is_vowel(letter: char) -> bool {
    "aeiouy".contains(letter)
}

fn capital(word: &str) -> String {
    let mut letters = word.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// Patterns of names, or parts of syllables.
type Patterns = &'static [&'static str];

/// A tongue as it is spoken at a place.
struct Speech {
    tongue: &'static Tongue,
    /// A random number of the dialect; none if all syllables of the tongue are in use.
    dialect: Option<u64>,
}

/// Parts of syllables of a tongue that a dialect uses, of eight; and the number of throws for one that it uses, after
/// which others are taken.
const USED: u64 = 5;
const THROWS: u64 = 6;

impl Speech {
    /// Chooses one of the parts of syllables that the dialect uses.
    fn syllable(&self, dice: &mut Dice, from: Patterns) -> &'static str {
        let mut part = dice.pick(from);
        let Some(dialect) = self.dialect else { return part };
        let is_used = |part: &str| hash::with_text(dialect, part) % 8 < USED;
        for _ in 1..THROWS {
            if is_used(part) {
                break;
            }
            part = dice.pick(from);
        }
        part
    }
}

/// A sequence of hashes of one key.
struct Dice {
    key: u64,
    thrown: u64,
}

impl Dice {
    fn below(&mut self, limit: u64) -> u64 {
        self.thrown += 1;
        (hash::combine(self.key, self.thrown) >> 16) % limit
    }

    fn pick(&mut self, from: Patterns) -> &'static str {
        from[self.below(from.len() as u64) as usize]
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::geography::Geography;
    use crate::geography::settings::GeographySettings;

    /// Names of a world of one land whose site cells are vertices.
    fn names(seed: u64) -> Names {
        Names::new(seed, 1, None)
    }

    const METRES_A_GRAIN: f64 = 10.0 / 256.0;

    /// The geography of a world, and its names; site cells are 4 km wide.
    fn of_world(seed: u64) -> (Arc<Geography>, Names) {
        let geography = Arc::new(Geography::new(&GeographySettings::default(), METRES_A_GRAIN, seed));
        let cultures = Arc::new(Cultures::new(Arc::clone(&geography), METRES_A_GRAIN, seed));
        (geography, Names::new(seed, 400, Some(cultures)))
    }

    /// The site cell some kilometres east and south of the origin.
    fn cell_at([east, south]: [i64; 2]) -> SiteId {
        SiteId { i: east / 4, j: south / 4 }
    }

    #[test]
    fn names_differ_and_can_be_said() {
        let ids = || (0..40).flat_map(|j| (0..25).map(move |i| SiteId { i: i - 7, j: j + 10_000_000_000 }));
        let names = names(7);
        let at = |id: SiteId| [id.i, id.j];
        let kinds: [&dyn Fn(SiteId) -> String; 6] = [
            &|id| names.settlement(id),
            &|id| names.river(at(id), &[1]),
            &|id| names.lake(at(id), &[1]),
            &|id| names.peak(at(id), &[1]),
            &|id| names.valley(at(id), &[1]),
            &|id| names.range(at(id)),
        ];
        for make in kinds {
            let names: Vec<String> = ids().map(make).collect();
            assert_eq!(names, ids().map(make).collect::<Vec<_>>());
            let distinct: BTreeSet<&String> = names.iter().collect();
            assert!(distinct.len() >= 900, "{} of 1000 differ", distinct.len());
            for name in &names {
                assert!((3..=24).contains(&name.len()), "{name}");
                assert!(name.chars().all(|letter| letter.is_ascii_alphabetic() || letter == ' '), "{name}");
                assert!(name.chars().next().is_some_and(|first| first.is_ascii_uppercase()), "{name}");
                let hard = name.split(|letter: char| is_vowel(letter.to_ascii_lowercase()) || letter == ' ');
                assert!(hard.clone().all(|cluster| cluster.len() <= 4), "{name}");
            }
        }
    }

    #[test]
    fn a_valley_is_called_as_its_river_is() {
        let alike = (0..200).filter(|i| {
            let cell = SiteId { i: *i, j: 5 };
            // Endings may cut a letter of the stem, and names may begin with a word for the kind of feature.
            let stem =
                |name: String| name.split(' ').map(|word| word[..word.len().min(3)].to_owned()).collect::<Vec<_>>();
            let valley = stem(names(7).valley([cell.i, cell.j], &[1]));
            stem(names(7).river([cell.i, cell.j], &[1])).iter().any(|word| valley.contains(word))
        });
        assert!(alike.count() > 190);
    }

    #[test]
    fn another_seed_or_number_is_another_name() {
        let same = |seed: u64, number: i64| {
            let is_same = |i: &i64| names(1).river([*i, 3], &[1]) == names(seed).river([*i, 3], &[number]);
            (0..1000).filter(is_same).count()
        };
        assert!(same(2, 1) < 20 && same(1, 2) < 20);
    }

    #[test]
    fn neighbours_mostly_share_a_tongue() {
        let here = |i: i64, j: i64| std::ptr::from_ref(tongue(7, SiteId { i, j }));
        let same = (0..900).filter(|n| here(n / 30, n % 30) == here(n / 30 + 1, n % 30)).count();
        assert!(same > 750, "{same} of 900");
        let spoken: BTreeSet<_> = (0..100).map(|i| here(i * 10, 0)).collect();
        assert_eq!(spoken.len(), OF_ONE_LAND);
    }

    #[test]
    fn each_tongue_has_names_for_all_that_is_large() {
        for tongue in &TONGUES {
            let kinds = [tongue.oceans, tongue.seas, tongue.bays, tongue.islands, tongue.continents, tongue.deserts];
            let others = [tongue.plains, tongue.ranges, tongue.rivers, tongue.lakes, tongue.peaks, tongue.valleys];
            for pattern in kinds.into_iter().chain(others).flatten() {
                assert_eq!(pattern.matches('*').count(), 1, "{pattern}");
                let small = pattern.to_lowercase();
                assert!(!UNWELCOME.iter().any(|group| small.contains(group)), "{pattern}");
                assert!(pattern.chars().all(|it| it.is_ascii_alphabetic() || " *".contains(it)), "{pattern}");
            }
        }
        let spoken: BTreeSet<usize> =
            Homeland::ALL.iter().flat_map(|homeland| tongues_of(*homeland)).copied().collect();
        assert_eq!(spoken.len(), TONGUES.len(), "each tongue is spoken somewhere: {spoken:?}");
    }

    #[test]
    fn a_world_has_many_tongues_each_in_a_region() {
        let (_, names) = of_world(3);
        let here = |at: [i64; 2]| std::ptr::from_ref(names.speech(cell_at(at)).tongue);
        let places = || (0..40 * 40).map(|n| [n % 40 * 250 - 5000, n / 40 * 250 - 5000]);
        let spoken: BTreeSet<_> = places().map(here).collect();
        assert!(spoken.len() >= 10, "{} tongues in 10,000 km", spoken.len());
        // 20 km further the tongue is mostly the same, 1500 km further it is mostly another.
        let same = |km: i64| places().filter(|[x, y]| here([*x, *y]) == here([*x + km, *y])).count();
        assert!(same(20) > 1500 && same(1500) < 600, "{} and {} of 1600", same(20), same(1500));
        for at in places() {
            for name in [names.settlement(cell_at(at)), names.range([at[0] * 100, at[1] * 100])] {
                assert!((3..=24).contains(&name.len()), "{name}");
                let hard = name.split(|letter: char| is_vowel(letter.to_ascii_lowercase()) || letter == ' ');
                assert!(hard.clone().all(|cluster| cluster.len() <= 4), "{name}");
            }
        }
    }

    /// Borders between peoples run along coasts and ranges more often than a random line does.
    #[test]
    fn regions_end_at_coasts_and_ranges() {
        let (geography, names) = of_world(3);
        let cultures = names.cultures().unwrap();
        let at = |n: i64, further: i64| {
            let grains = |km: i64| (km as f64 * 1000.0 / METRES_A_GRAIN) as i64;
            Point { x: grains(n % 80 * 100 - 4000 + further), y: grains(n / 80 * 100 - 4000) }
        };
        // Of all steps of 60 km, and of those across a border: all that have land at one end, and those that cross a
        // shore or a range.
        let mut steps = [[0.0; 2]; 2];
        for n in 0..80 * 80 {
            let land = geography.land_at_large(&[at(n, 0), at(n, 60)]);
            let is_land = land.iter().filter(|land| land.continent > 0.0).count();
            let is_hard = is_land == 1 || is_land == 2 && land.iter().any(|land| land.uplift > 0.4);
            let is_border = cultures.at(at(n, 0)).people != cultures.at(at(n, 60)).people;
            for (of, counts) in [true, is_border].into_iter().zip(&mut steps) {
                counts[0] += f64::from(u8::from(of && is_land > 0));
                counts[1] += f64::from(u8::from(of && is_hard));
            }
        }
        let [anywhere, at_borders] = steps.map(|[all, hard]| hard / all);
        assert!(steps[1][0] > 100.0 && at_borders > 1.4 * anywhere, "{steps:?}: {at_borders} and {anywhere} anywhere");
    }

    #[test]
    fn names_do_not_depend_on_other_names() {
        let realms = |names: &Names, geography: &Geography| -> Vec<String> {
            let realms = RealmKind::ALL.iter().flat_map(|kind| geography.realms_of_block(*kind, (1, 0)));
            realms.map(|realm| names.realm(&realm)).collect()
        };
        let (geography, names) = of_world(5);
        let known = realms(&names, &geography);
        assert!(known.iter().collect::<BTreeSet<_>>().len() > 20, "{known:?}");
        let (other_geography, other) = of_world(5);
        let far = SiteId { i: 1 << 30, j: -(1 << 31) };
        assert_eq!(other.settlement(far), names.settlement(far));
        assert_eq!(realms(&other, &other_geography), known);
    }
}
