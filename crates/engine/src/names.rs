//! Names of settlements, rivers, lakes, peaks, valleys and ranges, put together from the syllables of a region's
//! tongue.
//!
//! A name is a pure function of the seed, of the site cell in which the named feature lies, and of a number that
//! distinguishes the features of one cell. The tongue changes from region to region, so names of neighbours sound
//! alike.

use crate::hash::{self, Stream};
use crate::lines::SiteId;

/// A tongue: the sounds of a language, and its patterns for names.
struct Tongue {
    /// Beginnings of syllables.
    onsets: &'static [&'static str],
    /// Middles of syllables.
    nuclei: &'static [&'static str],
    /// Endings of the last syllable of a stem.
    codas: &'static [&'static str],
    /// Letters between two syllables.
    links: &'static [&'static str],
    /// Endings of settlements' names; an empty one leaves the stem alone.
    towns: &'static [&'static str],
    /// Patterns of rivers' names; `*` stands for the stem with a capital letter.
    rivers: &'static [&'static str],
    /// Patterns of lakes' names, likewise.
    lakes: &'static [&'static str],
    /// Patterns of peaks' names, likewise.
    peaks: &'static [&'static str],
    /// Patterns of valleys' names, likewise.
    valleys: &'static [&'static str],
    /// Patterns of mountain ranges' names, likewise.
    ranges: &'static [&'static str],
}

const TONGUES: [Tongue; 5] = [
    Tongue {
        onsets: &["b", "br", "d", "dr", "f", "g", "gr", "h", "k", "l", "m", "n", "r", "s", "st", "t", "tr", "v"],
        nuclei: &["a", "e", "i", "o", "u", "ei", "au"],
        codas: &["l", "r", "n", "rn", "ld", "lm", "nd", "rd", "s", "k"],
        links: &["", "", "r", "n", "l"],
        towns: &["stad", "by", "vik", "heim", "torp", "lund", "", ""],
        rivers: &["*a", "*elv", "*"],
        lakes: &["*vatn", "*sjo", "*tjern"],
        peaks: &["*tind", "*horn", "*fjell", "*nut"],
        valleys: &["*dal", "*dalen"],
        ranges: &["*fjella", "*heimen", "*alpene"],
    },
    Tongue {
        onsets: &["b", "c", "d", "f", "g", "l", "m", "n", "p", "r", "s", "t", "v", "br", "tr", "gl"],
        nuclei: &["a", "e", "i", "o", "u", "ia", "ie"],
        codas: &["n", "r", "l", "s", "rn", "nt", "lv", "rs"],
        links: &["", "", "", "n", "r", "l"],
        towns: &["ano", "ella", "ona", "ezza", "ino", "ara", "ole"],
        rivers: &["*o", "*a", "Rio *o"],
        lakes: &["Lago *o", "Lago di *a"],
        peaks: &["Monte *o", "Cima *a", "Pizzo *o"],
        valleys: &["Val *a", "Valle *a"],
        ranges: &["Alpi *e", "Monti *i"],
    },
    Tongue {
        onsets: &["b", "br", "c", "cr", "d", "f", "g", "gl", "l", "m", "n", "p", "r", "s", "t", "tr", "w", "th"],
        nuclei: &["a", "e", "i", "o", "y", "ea", "oa"],
        codas: &["n", "l", "r", "ch", "nd", "rt", "rr", "ll", "sk"],
        links: &["", "", "n", "l", "r"],
        towns: &["ton", "ford", "wick", "ham", "ley", "mere", "bury", ""],
        rivers: &["River *", "*", "* Water"],
        lakes: &["Lake *", "* Mere", "* Water"],
        peaks: &["Mount *", "* Fell", "* Pike", "* Tor"],
        valleys: &["*dale", "* Dale", "Glen *", "Vale of *"],
        ranges: &["* Mountains", "* Range", "* Hills"],
    },
    Tongue {
        onsets: &["b", "d", "g", "j", "k", "kr", "l", "m", "n", "p", "r", "s", "st", "t", "v", "z", "zl", "vr"],
        nuclei: &["a", "e", "i", "o", "u"],
        codas: &["n", "r", "l", "k", "v", "st", "m", "z"],
        links: &["", "", "", "r", "d", "s"],
        towns: &["ov", "ovo", "in", "grad", "ec", "ava", "itsa", "ane"],
        rivers: &["*a", "*ava", "*itsa"],
        lakes: &["*sko Jezero", "*ino Jezero"],
        peaks: &["*ski Vrh", "*ina Gora", "*nik"],
        valleys: &["*ska Dolina", "*ina Dolina"],
        ranges: &["*ske Planine", "*ovo Gorje"],
    },
    Tongue {
        onsets: &["h", "j", "k", "l", "m", "n", "p", "r", "s", "t", "v"],
        nuclei: &["a", "e", "i", "o", "u", "aa", "ii", "ai", "ie", "uo", "oi"],
        codas: &["", "", "n", "s", "l"],
        links: &["", "", "", "l", "n", "s", "r"],
        towns: &["la", "ranta", "maki", "kyla", "salo", "niemi", ""],
        rivers: &["*joki", "*virta"],
        lakes: &["*jarvi", "*lampi"],
        peaks: &["*tunturi", "*vaara", "*maki"],
        valleys: &["*laakso", "*notko"],
        ranges: &["*tunturit", "*selka", "*vaarat"],
    },
];

/// Side, in site cells, of the squares that each contain the home of one tongue.
const HOME_CELLS: i64 = 10;

/// Groups of letters that an English reader would take for something else.
const UNWELCOME: &[&str] = &[
    "anal", "anus", "ass", "bitch", "boob", "cock", "crap", "cum", "cunt", "damn", "dick", "fag", "fuck", "hell",
    "kill", "kkk", "kok", "nazi", "neg", "nig", "paki", "pee", "penis", "pis", "poo", "porn", "pric", "rape", "sex",
    "shit", "slut", "tard", "tit", "turd", "vag", "wank", "whor",
];

/// Returns the name of the settlement of a site cell.
pub fn settlement(seed: u64, id: SiteId) -> String {
    named(seed, Stream::SettlementName, id, 0, |tongue, dice| {
        let ending = dice.pick(tongue.towns);
        // A stem with an ending is mostly short; a stem without one has two syllables.
        let long = ending.is_empty() || dice.below(4) == 0;
        capital(&joined(stem(tongue, dice, long), ending)) + ending
    })
}

/// The names of a world's features, by their positions.
#[derive(Clone, Debug)]
pub struct Names {
    seed: u64,
    /// Side of a site cell in vertices.
    cell_side: i64,
}

impl Names {
    /// Returns the names of a world whose site cells have so many vertices a side.
    pub fn new(seed: u64, cell_side: i64) -> Names {
        Names { seed, cell_side }
    }

    /// Returns the name of a river, made from the site cell of one of the river's vertices and from the numbers of its
    /// id.
    pub fn river(&self, at: [i64; 2], id: &[i64]) -> String {
        river(self.seed, self.cell(at), number(id))
    }

    /// Returns the name of a lake, likewise.
    pub fn lake(&self, at: [i64; 2], id: &[i64]) -> String {
        lake(self.seed, self.cell(at), number(id))
    }

    /// Returns the name of a salt pan, likewise.
    pub fn pan(&self, at: [i64; 2], id: &[i64]) -> String {
        pan(self.seed, self.cell(at), number(id))
    }

    /// Returns the name of a peak, likewise.
    pub fn peak(&self, at: [i64; 2], id: &[i64]) -> String {
        peak(self.seed, self.cell(at), number(id))
    }

    /// Returns the name of a river's valley; its arguments are those of [the river's name](Names::river).
    pub fn valley(&self, at: [i64; 2], id: &[i64]) -> String {
        valley(self.seed, self.cell(at), number(id))
    }

    /// Returns the name of a mountain range, given the position of its highest vertex.
    pub fn range(&self, at: [i64; 2]) -> String {
        range(self.seed, self.cell(at))
    }

    fn cell(&self, at: [i64; 2]) -> SiteId {
        let [i, j] = at.map(|at| at.div_euclid(self.cell_side));
        SiteId { i, j }
    }
}

/// Turns the numbers of an id into one that distinguishes the features of a cell.
fn number(id: &[i64]) -> u64 {
    hash::of(id.iter().map(|part| *part as u64))
}

/// Returns the name of a river. `cell` is the site cell of a place that belongs to this river alone, such as its mouth,
/// and `number` distinguishes the rivers of one cell.
fn river(seed: u64, cell: SiteId, number: u64) -> String {
    thing(seed, Stream::RiverName, cell, number, |tongue| tongue.rivers)
}

/// The name of a lake; see [`river`].
fn lake(seed: u64, cell: SiteId, number: u64) -> String {
    thing(seed, Stream::LakeName, cell, number, |tongue| tongue.lakes)
}

/// The name of a salt pan; see [`river`]. All tongues have taken these patterns from those who live beside pans.
fn pan(seed: u64, cell: SiteId, number: u64) -> String {
    thing(seed, Stream::LakeName, cell, number, |_| &["* Pan", "Salar *", "Chott *"])
}

/// The name of a peak; see [`river`].
fn peak(seed: u64, cell: SiteId, number: u64) -> String {
    thing(seed, Stream::PeakName, cell, number, |tongue| tongue.peaks)
}

/// Returns the name of a river's valley. It uses the random numbers of the river, so both have the same stem.
fn valley(seed: u64, cell: SiteId, number: u64) -> String {
    thing(seed, Stream::RiverName, cell, number, |tongue| tongue.valleys)
}

/// Returns the name of the mountain range whose highest ground lies in a site cell.
fn range(seed: u64, cell: SiteId) -> String {
    thing(seed, Stream::RangeName, cell, 0, |tongue| tongue.ranges)
}

fn thing(
    seed: u64,
    stream: Stream,
    cell: SiteId,
    number: u64,
    patterns: fn(&Tongue) -> &'static [&'static str],
) -> String {
    named(seed, stream, cell, number, |tongue, dice| {
        let pattern = dice.pick(patterns(tongue));
        let ending = pattern.split_once('*').map_or("", |(_, ending)| ending);
        let long = dice.below(3) > 0;
        pattern.replace('*', &capital(&joined(stem(tongue, dice, long), ending)))
    })
}

/// Returns the first name made by `make` that contains no unwelcome group of letters.
fn named(seed: u64, stream: Stream, cell: SiteId, number: u64, make: impl Fn(&Tongue, &mut Dice) -> String) -> String {
    let tongue = tongue(seed, cell);
    let mut dice = Dice { key: hash::mix(cell.hash(seed, stream) ^ hash::mix(number)), thrown: 0 };
    loop {
        let name = make(tongue, &mut dice);
        let small = name.to_lowercase();
        if !UNWELCOME.iter().any(|group| small.contains(group)) {
            return name;
        }
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
    &TONGUES[((hash >> 32) % TONGUES.len() as u64) as usize]
}

/// Returns a stem of one syllable, or of two if it is to be long.
fn stem(tongue: &Tongue, dice: &mut Dice, long: bool) -> String {
    let mut stem = String::new();
    for _ in 0..=usize::from(long) {
        if !stem.is_empty() {
            let link = dice.pick(tongue.links);
            stem.push_str(link);
        }
        let onset = match stem.chars().last() {
            // Two clusters of consonants in a row are hard to say.
            Some(last) if !is_vowel(last) => &dice.pick(tongue.onsets)[..1],
            _ => dice.pick(tongue.onsets),
        };
        stem.push_str(onset);
        stem.push_str(dice.pick(tongue.nuclei));
    }
    stem.push_str(dice.pick(tongue.codas));
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

    fn pick(&mut self, from: &'static [&'static str]) -> &'static str {
        from[self.below(from.len() as u64) as usize]
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn names_differ_and_can_be_said() {
        let ids = || (0..40).flat_map(|j| (0..25).map(move |i| SiteId { i: i - 7, j: j + 10_000_000_000 }));
        let kinds: [&dyn Fn(SiteId) -> String; 6] = [
            &|id| settlement(7, id),
            &|id| river(7, id, 1),
            &|id| lake(7, id, 1),
            &|id| peak(7, id, 1),
            &|id| valley(7, id, 1),
            &|id| range(7, id),
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
            let valley = stem(valley(7, cell, 1));
            stem(river(7, cell, 1)).iter().any(|word| valley.contains(word))
        });
        assert!(alike.count() > 190);
    }

    #[test]
    fn another_seed_or_number_is_another_name() {
        let cells = || (0..1000).map(|i| SiteId { i, j: 3 });
        let same = |other: &dyn Fn(SiteId) -> String| cells().filter(|id| river(1, *id, 1) == other(*id)).count();
        assert!(same(&|id| river(2, id, 1)) < 20);
        assert!(same(&|id| river(1, id, 2)) < 20);
    }

    #[test]
    fn neighbours_mostly_share_a_tongue() {
        let here = |i: i64, j: i64| std::ptr::from_ref(tongue(7, SiteId { i, j }));
        let same = (0..900).filter(|n| here(n / 30, n % 30) == here(n / 30 + 1, n % 30)).count();
        assert!(same > 750, "{same} of 900");
        let spoken: BTreeSet<_> = (0..100).map(|i| here(i * 10, 0)).collect();
        assert_eq!(spoken.len(), TONGUES.len());
    }
}
