//! Addresses, the check of who sends a request, and the failures that are reported.
//!
//! A page from elsewhere can make a browser send any request to this machine, so the explorer answers its own page
//! alone: requests must name this machine as their host, and where the browser says which page asks, it must be the
//! explorer's. The port may be another one: whoever looks from elsewhere forwards a port of their own to the explorer.

use std::net::{IpAddr, Ipv4Addr, Ipv6Addr};

use axum::extract::Query;
use axum::http::{StatusCode, Uri};
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize};

use crate::error::Error;
use crate::explore::tile_address::TileAddress;

/// The reason why a request is not answered.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub(super) struct Failure {
    #[serde(skip)]
    pub status: StatusCode,
    pub error: String,
    pub hint: Option<String>,
    /// Place in a preset, with the line.
    pub place: Option<String>,
}

impl Failure {
    pub fn new(status: StatusCode, error: impl Into<String>, hint: impl Into<String>) -> Failure {
        let hint = Some(hint.into()).filter(|hint| !hint.is_empty());
        Failure { status, error: error.into(), hint, place: None }
    }

    pub fn broken(error: impl Into<String>) -> Failure {
        Failure::new(StatusCode::INTERNAL_SERVER_ERROR, error, "")
    }

    pub fn malformed(error: impl Into<String>) -> Failure {
        Failure::new(StatusCode::BAD_REQUEST, error, "")
    }

    pub fn missing() -> Failure {
        Failure::new(StatusCode::NOT_FOUND, "there is nothing at this address", "")
    }
}

impl From<Error> for Failure {
    fn from(error: Error) -> Failure {
        let hint = error.hint().unwrap_or_default();
        match &error {
            Error::Preset { message, source_place: Some(_), .. } => {
                let text = error.to_string();
                let place = text.replacen(message, "", 1).trim_end_matches(": ").replacen(": \n", "\n", 1);
                Failure { place: Some(place), ..Failure::new(StatusCode::UNPROCESSABLE_ENTITY, message, hint) }
            }
            Error::Interrupted => Failure::new(StatusCode::SERVICE_UNAVAILABLE, "this was not wanted any more", ""),
            Error::Io { .. } => Failure::new(StatusCode::INTERNAL_SERVER_ERROR, error.to_string(), hint),
            _ => Failure::new(StatusCode::UNPROCESSABLE_ENTITY, error.to_string(), hint),
        }
    }
}

/// The headers with which a browser says where a request comes from.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sender<'a> {
    pub host: Option<&'a str>,
    pub origin: Option<&'a str>,
    /// The header `Sec-Fetch-Site`.
    pub site: Option<&'a str>,
}

impl Sender<'_> {
    /// Checks that the request is for the explorer, at any port of this machine, and comes from the explorer's own page
    /// or from no page.
    ///
    /// # Errors
    /// When it does not.
    pub fn check(&self, port: u16) -> Result<(), Failure> {
        let is_near = |site: &str| matches!(site, "same-origin" | "none");
        let is_own = |host: &str| {
            let of_host =
                |origin: &str| origin.strip_prefix("http://").is_some_and(|own| own.eq_ignore_ascii_case(host));
            is_this_machine(host) && self.origin.is_none_or(of_host)
        };
        if self.host.is_some_and(is_own) && self.site.is_none_or(is_near) {
            return Ok(());
        }
        Err(Failure::new(
            StatusCode::FORBIDDEN,
            "the explorer answers to its own page alone",
            format!("open http://127.0.0.1:{port}/"),
        ))
    }
}

/// Tells whether a host, with or without a port, can only be this machine: `localhost` or a loopback address. Other
/// names are refused, since somebody else may have made their name lead to this machine.
fn is_this_machine(host: &str) -> bool {
    let name = match host.rsplit_once(':') {
        Some((name, port)) if port.parse::<u16>().is_ok() => name,
        _ => host,
    };
    let address = name
        .strip_prefix('[')
        .and_then(|name| name.strip_suffix(']'))
        .map_or_else(|| name.parse::<Ipv4Addr>().map(IpAddr::V4), |inner| inner.parse::<Ipv6Addr>().map(IpAddr::V6));
    name.eq_ignore_ascii_case("localhost") || address.is_ok_and(|address| address.is_loopback())
}

/// Reads the tile at the end of a path, before `ending`. Numbers count only as they are usually written, without escapes,
/// so that no tile has two addresses.
///
/// # Errors
/// When the path has another ending, or there is no such tile.
pub(super) fn tile_at(path: &str, ending: &str, is_dense: bool) -> Result<TileAddress, Failure> {
    let integer = |text: &str| text.parse().ok().filter(|number: &i64| number.to_string() == text);
    let mut parts = path.strip_suffix(ending).ok_or_else(Failure::missing)?.rsplit('/').map(integer);
    let mut tile = || {
        let [y, x, zoom] = [parts.next()??, parts.next()??, parts.next()??];
        TileAddress::new(zoom, x, y, is_dense)
    };
    tile().ok_or_else(|| Failure::malformed(format!("{path} is no tile")))
}

/// Largest number of things that a search returns.
const MOST_FOUND: usize = 100;

/// Largest number of characters of a search.
const MOST_LETTERS: usize = 200;

/// The query of a search.
#[derive(Debug, PartialEq, Deserialize)]
pub(super) struct FindQuery {
    #[serde(rename = "q")]
    pub text: String,
    /// Kilometres east and north of the origin, near which things are searched.
    #[serde(rename = "near", default, deserialize_with = "kilometres")]
    pub near_km: [f64; 2],
    /// Largest number of things to return.
    #[serde(default = "usual_limit")]
    pub limit: usize,
}

fn usual_limit() -> usize {
    20
}

fn kilometres<'de, D: Deserializer<'de>>(deserializer: D) -> Result<[f64; 2], D::Error> {
    let text = String::deserialize(deserializer)?;
    let numbers: Option<Vec<f64>> = text.split(',').map(|number| number.parse().ok()).collect();
    numbers
        .and_then(|numbers| numbers.try_into().ok())
        .filter(|near: &[f64; 2]| near.iter().all(|km| km.is_finite()))
        .ok_or_else(|| D::Error::custom("expected kilometres east and north, such as 12.5,-3"))
}

impl FindQuery {
    /// Reads the query of an address.
    ///
    /// # Errors
    /// When there is nothing to find, or a number makes no sense.
    pub fn read(uri: &Uri) -> Result<FindQuery, Failure> {
        let Query(query) =
            Query::<FindQuery>::try_from_uri(uri).map_err(|error| Failure::malformed(error.body_text()))?;
        if query.text.trim().is_empty() || query.text.chars().count() > MOST_LETTERS {
            return Err(Failure::malformed("q: expected what to find"));
        }
        if !(1..=MOST_FOUND).contains(&query.limit) {
            return Err(Failure::malformed(format!("limit: expected 1 to {MOST_FOUND}")));
        }
        Ok(query)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn its_own_page_may_ask_and_no_other() {
        let sender = |host: Option<&str>, origin: Option<&str>, site: Option<&str>| {
            Sender { host, origin, site }.check(8123).is_ok()
        };
        assert!(sender(Some("127.0.0.1:8123"), None, None));
        assert!(sender(Some("LOCALHOST:8123"), Some("http://localhost:8123"), Some("same-origin")));
        assert!(sender(Some("127.0.0.1:8123"), Some("http://127.0.0.1:8123"), Some("none")));
        // Another port, of this machine or another, that is forwarded to the explorer.
        for host in ["127.0.0.1", "127.0.0.1:80", "localhost:9000", "127.0.0.2:9000", "[::1]:9000", "[::1]"] {
            assert!(sender(Some(host), None, None), "{host}");
            assert!(sender(Some(host), Some(&format!("http://{host}")), Some("same-origin")), "{host}");
        }
        for (host, origin, site) in [
            (None, None, None),
            // Names of other owners that lead to this machine.
            (Some("terrane.example:8123"), None, None),
            (Some("localhost.terrane.example:8123"), None, None),
            (Some("127.0.0.1.terrane.example"), None, None),
            (Some("terrane.example:8123"), Some("http://terrane.example:8123"), Some("same-origin")),
            (Some("192.168.0.7:8123"), None, None),
            (Some("::1"), None, None),
            (Some("localhost:8123:80"), None, None),
            (Some("localhost:99999"), None, None),
            (Some(""), None, None),
            // Pages of other servers, also on this machine.
            (Some("127.0.0.1:8123"), Some("http://terrane.example"), None),
            (Some("127.0.0.1:8123"), Some("http://127.0.0.1:9000"), None),
            (Some("127.0.0.1:8123"), Some("http://localhost:8123"), None),
            (Some("127.0.0.1:8123"), Some("https://127.0.0.1:8123"), None),
            (Some("127.0.0.1:8123"), Some("null"), None),
            (Some("127.0.0.1:8123"), None, Some("cross-site")),
            (Some("127.0.0.1:8123"), None, Some("same-site")),
        ] {
            assert!(!sender(host, origin, site), "{host:?} {origin:?} {site:?}");
        }
    }

    #[test]
    fn tiles_have_one_address_each_and_others_are_malformed() {
        let tile = |path: &str| tile_at(path, ".webp", false).map_err(|failure| failure.status.as_u16());
        let dense = TileAddress::new(9, -3, 12, true).unwrap();
        assert_eq!(tile_at("/w/0f/atlas/full/9/-3/12@2x.webp", "@2x.webp", true), Ok(dense));
        assert_eq!(tile("/w/0f/atlas/glance/0/0/-1.webp"), Ok(TileAddress::new(0, 0, -1, false).unwrap()));
        for wrong in [
            "10/0/0", "-1/0/0", "+1/0/0", "01/0/0", "1/0x1/0", "1/-0/0", "1/1.5/0", "1/1e3/0", "1//0", "1/NaN/0",
            "1/%30/0",
        ] {
            assert_eq!(tile(&format!("/w/0f/atlas/draft/{wrong}.webp")), Err(400), "{wrong}");
        }
        for number in ["9223372036854775807", "-9223372036854775808", "99999999999999999999999999", "1000000000000000"]
        {
            assert_eq!(tile(&format!("/w/0f/atlas/draft/3/{number}/0.webp")), Err(400), "{number}");
            assert_eq!(tile(&format!("/w/0f/atlas/draft/3/0/{number}.webp")), Err(400), "{number}");
        }
        assert_eq!(tile("/w/0f/atlas/full/1/0/0.png"), Err(404));
    }

    #[test]
    fn a_search_says_what_where_and_how_many() {
        let find = |query: &str| {
            let address = format!("/w/0f/find?{query}").parse().unwrap();
            FindQuery::read(&address).map_err(|failure| failure.status.as_u16())
        };
        let asked = |text: &str, near_km, limit| FindQuery { text: text.into(), near_km, limit };
        assert_eq!(find("q=lake+%3E+2%20km2&near=-3.5,12&limit=7"), Ok(asked("lake > 2 km2", [-3.5, 12.0], 7)));
        assert_eq!(find("q=Feanmere"), Ok(asked("Feanmere", [0.0, 0.0], 20)));
        for wrong in [
            "",
            "q=",
            "q=%20",
            "q=a&near=1",
            "q=a&near=1,inf",
            "q=a&limit=0",
            "q=a&limit=1000",
            &format!("q={}", "a".repeat(201)),
        ] {
            assert_eq!(find(wrong), Err(400), "{wrong}");
        }
    }

    #[test]
    fn an_error_of_a_preset_is_told_with_its_place() {
        let text = "seed = 1\nspacing_m = -1\n";
        let error = crate::preset::Preset::parse("my.toml", text).unwrap_err();
        let failure = Failure::from(error);
        assert_eq!(failure.status, StatusCode::UNPROCESSABLE_ENTITY);
        let place = failure.place.unwrap();
        assert!(place.starts_with("my.toml:2:13\n") && place.contains("2 | spacing_m = -1\n"), "{place}");
        assert!(failure.error.contains("spacing_m"), "{}", failure.error);
    }
}
