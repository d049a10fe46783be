//! Searches of the page: for things by kind and measures, or for a thing by its name.

use std::sync::{Arc, PoisonError};

use serde_json::{Value, json};

use crate::clock::Clock;
use crate::error::Error;
use crate::explore::queue::Product;
use crate::explore::worlds::Opened;
use crate::find::{Finder, Found, Query, named_in};
use crate::watch::Watch;

/// A parsed search.
#[derive(Clone, Debug)]
pub(super) enum Search {
    Things(Query),
    Name(String),
}

impl Search {
    /// Parses the text of a search.
    ///
    /// # Errors
    /// When the text begins like a query and is not a valid one.
    pub fn new(text: &str) -> Result<Search, Error> {
        let text = text.trim();
        if Query::is_meant(text) { text.parse().map(Search::Things) } else { Ok(Search::Name(text.to_owned())) }
    }

    /// Finds things near a place, and returns them as JSON for the page.
    ///
    /// # Errors
    /// When the world has no such things, or nothing of that name.
    pub fn run(&self, opened: &Opened, near_km: [f64; 2], limit: usize, clock: &Clock) -> Result<Product, Error> {
        let watch = Watch::stopped_by(clock.stop());
        // A search that panicked leaves the finder in a good state, so a poisoned lock may be used.
        let mut finder = opened.finder.lock().unwrap_or_else(PoisonError::into_inner);
        let finder = match &mut *finder {
            Some(finder) => finder,
            none => none.insert(Finder::of_world(opened.world.clone())?),
        };
        let (kind, radius_km, found) = match self {
            Search::Name(name) => (None, None, vec![named_in(finder, name, near_km, &watch.clock)?]),
            Search::Things(query) => {
                let radius_km = query.thing.radius_km();
                (Some(query.thing.name()), Some(radius_km), finder.find(query, near_km, radius_km, limit, &watch)?)
            }
        };
        let found: Vec<Value> = found.iter().map(|found| told(found, kind)).collect();
        Ok(Arc::new(vec![json!({ "found": found, "radius_km": radius_km }).to_string().into_bytes()]))
    }
}

fn told(found: &Found, kind: Option<&str>) -> Value {
    let value = |value: f64| if value.abs() >= 100.0 { value.round() } else { (value * 100.0).round() / 100.0 };
    let values =
        found.values.iter().map(|(measure, much)| json!({ "text": format!("{} {}", value(*much), measure.unit()) }));
    json!({
        "id": found.id, "name": found.name, "kind": kind, "at_km": found.at_km, "distance_km": found.distance_km,
        "around_km": found.around_km, "values": values.collect::<Vec<_>>(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_is_a_query_or_a_name() {
        for query in
            ["lake", "Peak > 3500 m", " river > 30 km ", "town on river", "Lakes >= 20000 m2", "biome = Csb coast"]
        {
            assert!(matches!(Search::new(query), Ok(Search::Things(_))), "{query}");
        }
        for name in ["Feanmere", "Lakeside", "Old Town", "Lake Brond"] {
            assert!(matches!(Search::new(name), Ok(Search::Name(_))), "{name}");
        }
        for wrong in ["lake >", "peak > 3 km2", "river on fire"] {
            assert!(Search::new(wrong).is_err(), "{wrong}");
        }
    }
}
