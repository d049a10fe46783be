//! Queries: the kind of thing to find, its neighbourhood, and bounds on its measures.

use std::str::FromStr;

use crate::error::Error;
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
    /// Area of a lake in square kilometres, without its islands.
    Area,
    /// Height in metres above zero of a peak, of a lake's surface, or of the ground of a settlement.
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
            Thing::Peak => &[Measure::Height],
            Thing::River => &[Measure::Length, Measure::Discharge],
            Thing::Site(_) => &[Measure::Population, Measure::Height],
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
    ["on", "by"].contains(&word) || word.starts_with(['<', '>', '='])
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
        ("km", Thing::Lake | Thing::Peak | Thing::Site(_)) => ("m", 1000.0, 1.0),
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
        Thing::Peak => "m or km",
        Thing::River => "m or km, or m3/s",
        Thing::Site(_) => "people, or m or km of height",
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
        }
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
            _ => return None,
        })
    }
}

/// Grammar of a query in one sentence, for error messages.
const GRAMMAR: &str = "write a thing (lake, peak, river, place, hamlet, village, town), perhaps \"on river\", \"on lake\" or \
    \"on sea\", and bounds: >, >=, <, <= or = and a number of m2, ha, km2, m, km, m3/s or people; such as \"lakes > 20000 m2\", \
    \"peak >= 3500 m\" or \"town on river\"";

impl Query {
    /// True if a text is meant as a query, even a wrong one, and not as a name. A name may begin with the same word:
    /// `Lake Brond`.
    pub fn is_meant(text: &str) -> bool {
        let words = words(text);
        let goes_on = |word: &String| leads_on(word) || !word.starts_with(char::is_alphabetic);
        words.first().is_some_and(|word| Thing::of(word).is_some()) && words.get(1).is_none_or(goes_on)
    }
}

impl FromStr for Query {
    type Err = Error;

    fn from_str(text: &str) -> Result<Query, Error> {
        let refuse = |message: String| Error::Option { message: format!("{text:?}: {message}"), hint: GRAMMAR.into() };
        let words = words(text);
        let mut words = words.iter().map(String::as_str).peekable();
        let Some(word) = words.next() else { return Err(refuse("nothing is looked for".into())) };
        let Some(thing) = Thing::of(word) else {
            return Err(refuse(format!("{word:?} is no lake, peak, river, place, hamlet, village or town")));
        };
        let (mut beside, mut bounds) = (None, Vec::new());
        while let Some(word) = words.next() {
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
        Ok(Query { text: text.to_owned(), thing, beside, bounds })
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
    fn a_name_that_begins_with_the_word_for_a_thing_is_no_query() {
        for query in ["lake", "Peaks > 3500 m", "lake>2 km2", "town on river", "peak 3500", "river by"] {
            assert!(Query::is_meant(query), "{query}");
        }
        for name in ["Lake Brond", "River Toa", "Lakeside", "", "Cima Viala"] {
            assert!(!Query::is_meant(name), "{name}");
        }
    }
}
