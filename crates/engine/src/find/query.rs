//! What is looked for: a thing, what it is beside, and what it measures.

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
    /// A settlement, of that class if one is named.
    Site(Option<SiteClass>),
}

/// What a thing may be beside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Beside {
    /// A river.
    River,
    /// A lake.
    Lake,
    /// The sea.
    Sea,
}

/// What is measured of a thing, in the units of [`Measure::unit`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measure {
    /// Square kilometres of a lake, without its islands.
    Area,
    /// Metres above zero of a peak, of a lake's surface, or of the ground of a settlement.
    Height,
    /// Kilometres of a river from end to end.
    Length,
    /// Cubic metres a second of a river at its end.
    Discharge,
    /// People of a settlement.
    Population,
}

impl Measure {
    /// The unit that it is asked for and told in.
    pub fn unit(self) -> &'static str {
        match self {
            Measure::Area => "km2",
            Measure::Height => "m",
            Measure::Length => "km",
            Measure::Discharge => "m3/s",
            Measure::Population => "people",
        }
    }

    /// All that are known of a thing.
    pub fn of(thing: Thing) -> &'static [Measure] {
        match thing {
            Thing::Lake => &[Measure::Area, Measure::Height],
            Thing::Peak => &[Measure::Height],
            Thing::River => &[Measure::Length, Measure::Discharge],
            Thing::Site(_) => &[Measure::Population, Measure::Height],
        }
    }
}

/// A bound on a measure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bound {
    /// What is bounded.
    pub measure: Measure,
    /// Whether it is to be more than that, or else less.
    pub more: bool,
    /// How much, in the measure's unit.
    pub than: f64,
}

/// What somebody looks for, such as `lake > 2 km2`, `peak > 3500 m < 3800 m` or `town on river`.
#[derive(Clone, Debug, PartialEq)]
pub struct Query {
    /// As it was written.
    pub text: String,
    /// What.
    pub thing: Thing,
    /// What it is beside, if that matters.
    pub beside: Option<Beside>,
    /// What it measures.
    pub bounds: Vec<Bound>,
}

impl Query {
    /// Whether measures keep the bounds.
    pub fn keeps(&self, values: &[(Measure, f64)]) -> bool {
        self.bounds.iter().all(|bound| {
            values.iter().any(|(measure, value)| {
                *measure == bound.measure && if bound.more { *value > bound.than } else { *value < bound.than }
            })
        })
    }

    /// What a measure is to be more than, if that is asked for.
    pub fn least(&self, measure: Measure) -> Option<f64> {
        let more = self.bounds.iter().filter(|bound| bound.more && bound.measure == measure);
        more.map(|bound| bound.than).max_by(f64::total_cmp)
    }
}

impl FromStr for Query {
    type Err = Error;

    fn from_str(text: &str) -> Result<Query, Error> {
        let refuse = |message: String| Error::Option {
            message: format!("{text:?}: {message}"),
            hint: "write such as \"lake > 2 km2\", \"peak > 3500 m\", \"river > 50 m3/s\" or \"town on river\"".into(),
        };
        // Signs are words of their own, however close they stand.
        let spaced = text.replace('>', " > ").replace('<', " < ");
        let mut words = spaced.split_whitespace().peekable();
        let thing = match words.next() {
            Some("lake") => Thing::Lake,
            Some("peak") => Thing::Peak,
            Some("river") => Thing::River,
            Some("place") => Thing::Site(None),
            Some("hamlet") => Thing::Site(Some(SiteClass::Hamlet)),
            Some("village") => Thing::Site(Some(SiteClass::Village)),
            Some("town") => Thing::Site(Some(SiteClass::Town)),
            Some(word) => {
                return Err(refuse(format!("{word:?} is no lake, peak, river, place, hamlet, village or town")));
            }
            None => return Err(refuse("nothing is looked for".into())),
        };
        let (mut beside, mut bounds) = (None, Vec::new());
        while let Some(word) = words.next() {
            match word {
                "on" | "by" => {
                    beside = Some(match words.next() {
                        Some("river") => Beside::River,
                        Some("lake") => Beside::Lake,
                        Some("sea" | "coast") => Beside::Sea,
                        other => {
                            let other = other.unwrap_or("nothing");
                            return Err(refuse(format!("expected river, lake or sea after {word:?}, found {other}")));
                        }
                    });
                }
                ">" | "<" => {
                    let value = words.next().unwrap_or("");
                    let digits = value.find(|c: char| !c.is_ascii_digit() && !".-+".contains(c)).unwrap_or(value.len());
                    let (number, mut unit) = value.split_at(digits);
                    let than: f64 = number
                        .parse()
                        .map_err(|_| refuse(format!("expected a number after {word}, found {value:?}")))?;
                    if unit.is_empty() && words.peek().is_some_and(|word| !["on", "by", ">", "<"].contains(word)) {
                        unit = words.next().unwrap_or("");
                    }
                    let (unit, scale) = match unit {
                        "ha" => ("km2", 0.01),
                        "km²" => ("km2", 1.0),
                        "m³/s" => ("m3/s", 1.0),
                        "km" if thing != Thing::River => ("m", 1000.0),
                        other => (other, 1.0),
                    };
                    let known = Measure::of(thing);
                    let measure =
                        if unit.is_empty() { known.first() } else { known.iter().find(|it| it.unit() == unit) };
                    let Some(measure) = measure else {
                        let units: Vec<_> = known.iter().map(|measure| measure.unit()).collect();
                        return Err(refuse(format!("expected {}, found {unit:?}", units.join(" or "))));
                    };
                    bounds.push(Bound { measure: *measure, more: word == ">", than: than * scale });
                }
                other => return Err(refuse(format!("expected on, > or <, found {other:?}"))),
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
        let area = |more: bool, than: f64| Bound { measure: Measure::Area, more, than };
        assert_eq!((query.thing, &query.bounds[..]), (Thing::Lake, &[area(true, 2.0), area(false, 3.0)][..]));
        assert!(query.keeps(&[(Measure::Area, 2.5)]) && !query.keeps(&[(Measure::Area, 3.5)]));
        assert_eq!(query.least(Measure::Area), Some(2.0));
        let query: Query = "town on river > 900".parse().unwrap();
        assert_eq!((query.thing, query.beside), (Thing::Site(Some(SiteClass::Town)), Some(Beside::River)));
        assert_eq!(query.bounds, [Bound { measure: Measure::Population, more: true, than: 900.0 }]);
        assert_eq!("peak > 3.5 km".parse::<Query>().unwrap().least(Measure::Height), Some(3500.0));
        for wrong in ["", "castle", "lake > 2 people", "lake >", "town on moon", "peak 3500", "river > many"] {
            let error = wrong.parse::<Query>().unwrap_err();
            assert!(error.to_string().contains(&format!("{wrong:?}")) && error.hint().is_some(), "{error}");
        }
    }
}
