//! Queries: the kind of thing to find, its neighbourhood, and bounds on its measures.

use std::str::FromStr;

use crate::error::Error;
use crate::geography::biome::Biome;
use crate::geography::realms::RealmKind;
use crate::places::site::SiteClass;

/// A kind of things that can be found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Thing {
    /// A lake.
    Lake,
    /// A peak.
    Peak,
    /// A river.
    River,
    /// A settlement; of one class only, if it is given.
    Site(Option<SiteClass>),
    /// A continent, a sea, a desert and so on, in a world with a geography.
    Realm(RealmKind),
    /// A place with a climate, in a world with a geography.
    Biome(BiomeLetters),
    /// A volcano, in a world with a geography.
    Volcano,
}

/// The first letters of climates: `Csb` is one climate, `BW` all deserts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BiomeLetters(&'static str);

impl BiomeLetters {
    /// Returns the letters that a text has, in any case; none if no climate begins with them.
    pub fn of(text: &str) -> Option<BiomeLetters> {
        let beginning = |biome: Biome| biome.code().get(..text.len()).filter(|code| code.eq_ignore_ascii_case(text));
        Biome::all().find_map(beginning).filter(|code| !code.is_empty()).map(BiomeLetters)
    }

    /// True if the letters of a climate begin with these.
    pub fn has(self, biome: Biome) -> bool {
        biome.code().starts_with(self.0)
    }
}

/// Water beside which a thing may have to lie.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Beside {
    /// A river.
    River,
    /// A lake.
    Lake,
    /// The sea.
    Sea,
}

/// A property of a thing, in the unit that [`Measure::unit`] names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measure {
    /// Area in square kilometres: of a lake without its islands, or of a continent, a sea, a desert and so on.
    Area,
    /// Height in metres above zero of a peak, of a lake's surface, or of the ground of a settlement; of a volcano, above
    /// the land at its foot.
    Height,
    /// Length of a river in kilometres.
    Length,
    /// Discharge of a river at its end, in cubic metres a second.
    Discharge,
    /// Number of inhabitants of a settlement.
    Population,
}

impl Measure {
    /// Returns the unit of this measure in queries and in results.
    pub fn unit(self) -> &'static str {
        match self {
            Measure::Area => "km2",
            Measure::Height => "m",
            Measure::Length => "km",
            Measure::Discharge => "m3/s",
            Measure::Population => "people",
        }
    }

    /// Returns all measures of a kind of thing.
    pub fn of(thing: Thing) -> &'static [Measure] {
        match thing {
            Thing::Lake => &[Measure::Area, Measure::Height],
            Thing::Peak | Thing::Volcano => &[Measure::Height],
            Thing::River => &[Measure::Length, Measure::Discharge],
            Thing::Site(_) => &[Measure::Population, Measure::Height],
            Thing::Realm(_) => &[Measure::Area],
            Thing::Biome(_) => &[],
        }
    }
}

/// Comparison operator of a bound.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sign {
    /// `>`
    More,
    /// `>=`
    AtLeast,
    /// `<`
    Less,
    /// `<=`
    AtMost,
}

/// A bound on a measure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bound {
    /// Measure that is bounded.
    pub measure: Measure,
    /// Comparison of the measure with the limit.
    pub sign: Sign,
    /// Limit, in the measure's unit.
    pub than: f64,
}

impl Bound {
    /// True if a value of the measure is within the bound.
    fn keeps(&self, value: f64) -> bool {
        match self.sign {
            Sign::More => value > self.than,
            Sign::AtLeast => value >= self.than,
            Sign::Less => value < self.than,
            Sign::AtMost => value <= self.than,
        }
    }
}

/// A search request, such as `lake > 2 km2`, `peak > 3500 m < 3800 m` or `town on river`.
#[derive(Clone, Debug, PartialEq)]
pub struct Query {
    /// Text of the query as it was written.
    pub text: String,
    /// Kind of thing to find.
    pub thing: Thing,
    /// Water beside which the thing must lie, if the query names any.
    pub beside: Option<Beside>,
    /// Bounds on the thing's measures.
    pub bounds: Vec<Bound>,
}

impl Query {
    /// True if the measured values are within all bounds.
    pub fn keeps(&self, values: &[(Measure, f64)]) -> bool {
        let is_kept =
            |bound: &Bound| values.iter().any(|(measure, value)| *measure == bound.measure && bound.keeps(*value));
        self.bounds.iter().all(is_kept)
    }

    /// Returns the largest lower bound on a measure, if there is one.
    pub fn least(&self, measure: Measure) -> Option<f64> {
        let is_lower = |bound: &&Bound| bound.measure == measure && matches!(bound.sign, Sign::More | Sign::AtLeast);
        self.bounds.iter().filter(is_lower).map(|bound| bound.than).max_by(f64::total_cmp)
    }
}

/// Splits a query into words in lower case. Comparison signs are words of their own even without spaces around them.
fn words(text: &str) -> Vec<String> {
    let mut words: Vec<String> = Vec::new();
    for word in text.to_lowercase().replace('\u{2265}', ">=").replace('\u{2264}', "<=").split_whitespace() {
        let is_sign = |letter: char| "<>=".contains(letter);
        let mut before = None;
        for letter in word.chars() {
            match words.last_mut().filter(|_| before == Some(is_sign(letter))) {
                Some(last) => last.push(letter),
                None => words.push(letter.into()),
            }
            before = Some(is_sign(letter));
        }
    }
    words
}

/// True if a word begins an "on river" clause or a bound.
fn leads_on(word: &str) -> bool {
    ["on", "by", "coast"].contains(&word) || word.starts_with(['<', '>', '='])
}

/// Parses a number and returns it with half the value of its last digit: `3.5` gives 3.5 and 0.05.
fn number(text: &str) -> Option<(f64, f64)> {
    let value = text.parse().ok().filter(|value: &f64| value.is_finite())?;
    let decimals = text.split_once('.').map_or(0, |(_, decimals)| decimals.len());
    Some((value, 0.5 / (0..decimals).fold(1.0, |power, _| power * 10.0)))
}

/// Returns the measure that a unit stands for, and the multiplier and divisor that convert to the measure's own unit.
/// An empty unit stands for the thing's first measure.
fn unit(thing: Thing, unit: &str) -> Option<(Measure, f64, f64)> {
    let (unit, times, per) = match (unit, thing) {
        ("m2" | "m\u{b2}", _) => ("km2", 1.0, 1e6),
        ("ha", _) => ("km2", 1.0, 100.0),
        ("km\u{b2}", _) => ("km2", 1.0, 1.0),
        ("m\u{b3}/s", _) => ("m3/s", 1.0, 1.0),
        ("m", Thing::River) => ("km", 1.0, 1000.0),
        ("km", Thing::Lake | Thing::Peak | Thing::Site(_) | Thing::Volcano) => ("m", 1000.0, 1.0),
        (other, _) => (other, 1.0, 1.0),
    };
    let known = Measure::of(thing);
    let measure = if unit.is_empty() { known.first() } else { known.iter().find(|it| it.unit() == unit) };
    measure.map(|measure| (*measure, times, per))
}

/// Lists the units in which measures of a thing can be given, for error messages.
fn units(thing: Thing) -> &'static str {
    match thing {
        Thing::Lake => "m2, ha or km2, or m or km of height",
        Thing::Peak | Thing::Volcano => "m or km",
        Thing::River => "m or km, or m3/s",
        Thing::Site(_) => "people, or m or km of height",
        Thing::Realm(_) => "m2, ha or km2",
        Thing::Biome(_) => "no bound but = and the letters of a climate",
    }
}

impl Thing {
    /// Returns the word for this kind of thing, in the singular.
    pub fn name(self) -> &'static str {
        match self {
            Thing::Lake => "lake",
            Thing::Peak => "peak",
            Thing::River => "river",
            Thing::Site(None) => "place",
            Thing::Site(Some(class)) => class.name(),
            Thing::Realm(kind) => kind.name(),
            Thing::Biome(_) => "biome",
            Thing::Volcano => "volcano",
        }
    }

    /// True if only a world with a geography has such things.
    pub fn is_large(self) -> bool {
        matches!(self, Thing::Realm(_) | Thing::Biome(_) | Thing::Volcano)
    }

    /// Returns the radius in kilometres of a search for which no radius is given.
    pub fn radius_km(self) -> f64 {
        if self.is_large() { 5000.0 } else { 200.0 }
    }

    /// Returns the kind of thing that a word names, in the singular or plural.
    fn of(word: &str) -> Option<Thing> {
        Some(match word {
            "lake" | "lakes" => Thing::Lake,
            "peak" | "peaks" => Thing::Peak,
            "river" | "rivers" => Thing::River,
            "place" | "places" => Thing::Site(None),
            "hamlet" | "hamlets" => Thing::Site(Some(SiteClass::Hamlet)),
            "village" | "villages" => Thing::Site(Some(SiteClass::Village)),
            "town" | "towns" => Thing::Site(Some(SiteClass::Town)),
            "volcano" | "volcanoes" => Thing::Volcano,
            other => {
                let is_named = |kind: &RealmKind| other.strip_suffix('s').unwrap_or(other) == kind.name();
                return RealmKind::ALL.into_iter().find(is_named).map(Thing::Realm);
            }
        })
    }
}

/// Grammar of a query in one sentence, for error messages.
const GRAMMAR: &str = "write a thing (lake, peak, river, place, hamlet, village, town; in a whole world continent, ocean, sea, bay, \
    island, desert, plain, range, volcano), perhaps \"on river\", \"on lake\" or \"on sea\", and bounds: >, >=, <, <= or = and a number of \
    m2, ha, km2, m, km, m3/s or people; such as \"lakes > 20000 m2\", \"peak >= 3500 m\", \"town on river\" or \
    \"desert > 10000 km2\"; or the letters of a climate, perhaps \"on coast\": \"biome = Csb on coast\"";

/// The word that begins a query for a climate.
const BIOME: &str = "biome";

impl Query {
    /// True if a text is meant as a query, even a wrong one, and not as a name. A name may begin with the same word:
    /// `Lake Brond`.
    pub fn is_meant(text: &str) -> bool {
        let words = words(text);
        let goes_on = |word: &String| leads_on(word) || !word.starts_with(char::is_alphabetic);
        let is_thing = |word: &String| word == BIOME || Thing::of(word).is_some();
        words.first().is_some_and(is_thing) && words.get(1).is_none_or(goes_on)
    }
}

impl Query {
    /// Parses queries. A text that begins with `on`, `by`, `coast` or a bound goes on with the query before it, so
    /// `biome = Csb` and `coast` are one query.
    ///
    /// # Errors
    /// When a text is no query.
    pub fn parse_all(texts: &[String]) -> Result<Vec<Query>, Error> {
        let mut whole: Vec<String> = Vec::new();
        for text in texts {
            let goes_on = words(text).first().is_some_and(|word| leads_on(word));
            match whole.last_mut().filter(|_| goes_on) {
                Some(last) => *last = format!("{last} {text}"),
                None => whole.push(text.clone()),
            }
        }
        whole.iter().map(|text| text.parse()).collect()
    }
}

impl FromStr for Query {
    type Err = Error;

    fn from_str(text: &str) -> Result<Query, Error> {
        let refuse = |message: String| Error::Option { message: format!("{text:?}: {message}"), hint: GRAMMAR.into() };
        let words = words(text);
        let mut words = words.iter().map(String::as_str).peekable();
        let Some(word) = words.next() else { return Err(refuse("nothing is looked for".into())) };
        let thing = if word == BIOME {
            if words.next() != Some("=") {
                return Err(refuse("expected = and the letters of a climate after \"biome\"".into()));
            }
            let letters = words.next().unwrap_or("");
            let Some(letters) = BiomeLetters::of(letters) else {
                return Err(refuse(format!("no climate of Köppen and Geiger has the letters {letters:?}")));
            };
            Thing::Biome(letters)
        } else {
            let known = || refuse(format!("{word:?} is nothing that can be found"));
            Thing::of(word).ok_or_else(known)?
        };
        let (mut beside, mut bounds) = (None, Vec::new());
        while let Some(word) = words.next() {
            if word == "coast" {
                beside = Some(Beside::Sea);
                continue;
            }
            if ["on", "by"].contains(&word) {
                beside = Some(match words.next() {
                    Some("river" | "rivers") => Beside::River,
                    Some("lake" | "lakes") => Beside::Lake,
                    Some("sea" | "coast") => Beside::Sea,
                    other => {
                        let other = other.unwrap_or("nothing");
                        return Err(refuse(format!("expected river, lake or sea after {word:?}, found {other}")));
                    }
                });
                continue;
            }
            if ![">", ">=", "<", "<=", "="].contains(&word) {
                return Err(refuse(format!("expected on, >, >=, <, <= or =, found {word:?}")));
            }
            let value = words.next().unwrap_or("");
            let digits = value.find(|c: char| !c.is_ascii_digit() && !".-+".contains(c)).unwrap_or(value.len());
            let (digits, mut of) = value.split_at(digits);
            let Some((than, half)) = number(digits) else {
                return Err(refuse(format!("expected a number after {word}, found {value:?}")));
            };
            if of.is_empty() && words.peek().is_some_and(|word| !leads_on(word)) {
                of = words.next().unwrap_or("");
            }
            let Some((measure, times, per)) = unit(thing, of) else {
                return Err(refuse(format!("expected {}, found {of:?}", units(thing))));
            };
            let mut bound = |sign: Sign, than: f64| bounds.push(Bound { measure, sign, than: than * times / per });
            match word {
                ">" => bound(Sign::More, than),
                ">=" => bound(Sign::AtLeast, than),
                "<" => bound(Sign::Less, than),
                "<=" => bound(Sign::AtMost, than),
                // `=` accepts every value that rounds to the given number.
                _ => {
                    bound(Sign::AtLeast, than - half);
                    bound(Sign::Less, than + half);
                }
            }
        }
        match (thing, beside) {
            (Thing::Realm(kind), Some(_)) => {
                Err(refuse(format!("of a {}, only its size can be asked for", kind.name())))
            }
            (Thing::Biome(_), Some(Beside::River | Beside::Lake)) => {
                Err(refuse("a climate can be looked for on a coast, not on a river or a lake".into()))
            }
            _ => Ok(Query { text: text.to_owned(), thing, beside, bounds }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn queries_are_read_as_people_write_them() {
        let query: Query = "lake >2km2 < 300 ha".parse().unwrap();
        let area = |sign: Sign, than: f64| Bound { measure: Measure::Area, sign, than };
        assert_eq!(
            (query.thing, &query.bounds[..]),
            (Thing::Lake, &[area(Sign::More, 2.0), area(Sign::Less, 3.0)][..])
        );
        assert!(query.keeps(&[(Measure::Area, 2.5)]) && !query.keeps(&[(Measure::Area, 3.5)]));
        assert_eq!(query.least(Measure::Area), Some(2.0));
        let query: Query = "town on river > 900".parse().unwrap();
        assert_eq!((query.thing, query.beside), (Thing::Site(Some(SiteClass::Town)), Some(Beside::River)));
        assert_eq!(query.bounds, [Bound { measure: Measure::Population, sign: Sign::More, than: 900.0 }]);
        assert_eq!("peak > 3.5 km".parse::<Query>().unwrap().least(Measure::Height), Some(3500.0));
        for wrong in
            ["", "castle", "lake > 2 people", "lake >", "town on moon", "peak 3500", "river > many", "peak => 3"]
        {
            let error = wrong.parse::<Query>().unwrap_err();
            assert!(error.to_string().contains(&format!("{wrong:?}")), "{error}");
            assert!(error.hint().is_some_and(|hint| hint.contains("m2, ha, km2")), "{error}");
        }
    }

    #[test]
    fn units_signs_and_plurals_are_taken_as_they_are_written() {
        let one = |text: &str| match text.parse::<Query>().unwrap().bounds[..] {
            [Bound { measure, sign, than }] => (measure, sign, than),
            ref other => panic!("{text}: {other:?}"),
        };
        for (text, bound) in [
            ("lake > 20000 m2", (Measure::Area, Sign::More, 0.02)),
            ("lakes >= 3 ha", (Measure::Area, Sign::AtLeast, 0.03)),
            ("Lakes <=2.5km\u{b2}", (Measure::Area, Sign::AtMost, 2.5)),
            ("lakes > 900 m", (Measure::Height, Sign::More, 900.0)),
            ("peaks >=3 km", (Measure::Height, Sign::AtLeast, 3000.0)),
            ("rivers > 1500m", (Measure::Length, Sign::More, 1.5)),
            ("rivers \u{2265} 30 km", (Measure::Length, Sign::AtLeast, 30.0)),
            ("river<50 m\u{b3}/s", (Measure::Discharge, Sign::Less, 50.0)),
            ("towns > 900 people", (Measure::Population, Sign::More, 900.0)),
        ] {
            assert_eq!(one(text), bound, "{text}");
        }
        for (text, thing) in [
            ("peaks", Thing::Peak),
            ("places", Thing::Site(None)),
            ("hamlets", Thing::Site(Some(SiteClass::Hamlet))),
            ("villages on lakes", Thing::Site(Some(SiteClass::Village))),
        ] {
            assert_eq!(text.parse::<Query>().unwrap().thing, thing);
        }
        let equal: Query = "peak = 492 m".parse().unwrap();
        assert!(equal.keeps(&[(Measure::Height, 491.7)]) && !equal.keeps(&[(Measure::Height, 492.6)]));
        let equal: Query = "lake = 2.50 km2".parse().unwrap();
        assert!(equal.keeps(&[(Measure::Area, 2.503)]) && !equal.keeps(&[(Measure::Area, 2.51)]));
    }

    #[test]
    fn what_is_large_and_climates_are_asked_for_by_words_and_letters() {
        let query: Query = "Deserts > 10000 km2".parse().unwrap();
        assert_eq!((query.thing, query.least(Measure::Area)), (Thing::Realm(RealmKind::Desert), Some(10_000.0)));
        for kind in RealmKind::ALL {
            assert_eq!(kind.name().parse::<Query>().unwrap().thing, Thing::Realm(kind));
        }
        let texts = ["biome = Csb", "coast", "island > 500 km2", "< 90000 ha", "lake"].map(String::from);
        let queries = Query::parse_all(&texts).unwrap();
        let things = [Thing::Biome(BiomeLetters("Csb")), Thing::Realm(RealmKind::Island), Thing::Lake];
        assert_eq!(queries.iter().map(|query| query.thing).collect::<Vec<_>>(), things);
        assert_eq!((queries[0].beside, queries[1].bounds.len()), (Some(Beside::Sea), 2));
        assert_eq!(queries[0].text, "biome = Csb coast");
        let Thing::Biome(deserts) = "biome=bw on sea".parse::<Query>().unwrap().thing else { panic!("no climate") };
        assert!(deserts.has(Biome::BWh) && deserts.has(Biome::BWk) && !deserts.has(Biome::BSh));
        for (wrong, word) in [
            ("biome", "letters"),
            ("biome = Xyz", "Xyz"),
            ("biome = ", "letters"),
            ("biome = Csb > 3 km2", "no bound"),
            ("biome = Csb on river", "coast"),
            ("desert > 3 people", "km2"),
            ("desert on sea", "size"),
            ("coast", "nothing that can be found"),
        ] {
            let error = wrong.parse::<Query>().unwrap_err().to_string().to_lowercase();
            assert!(error.contains(&word.to_lowercase()), "{wrong}: {error}");
        }
        assert!(Query::is_meant("biome = Csb") && Query::is_meant("sea") && !Query::is_meant("Sea of Brond"));
    }

    #[test]
    fn a_name_that_begins_with_the_word_for_a_thing_is_no_query() {
        for query in ["lake", "Peaks > 3500 m", "lake>2 km2", "town on river", "peak 3500", "river by"] {
            assert!(Query::is_meant(query), "{query}");
        }
        for name in ["Lake Brond", "River Toa", "Lakeside", "", "Cima Viala"] {
            assert!(!Query::is_meant(name), "{name}");
        }
    }
}
