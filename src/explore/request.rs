//! Addresses, the check of who sends a request, and the failures that are reported.
//!
//! A page from elsewhere can make a browser send any request to this machine, so the explorer answers its own page
//! alone: requests must name this machine as their host, and where the browser says which page asks, it must be the
//! explorer's. The port may be another one: whoever looks from elsewhere forwards a port of their own to the explorer.

use std::net::{IpAddr, Ipv4Addr, Ipv6Addr};

use serde::Serialize;

use crate::error::Error;
use crate::explore::tile_address::{Stage, TileAddress};

/// The reason why a request is not answered.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub(super) struct Failure {
    #[serde(skip)]
    pub status: Status,
    pub error: String,
    pub hint: Option<String>,
    /// Place in a preset, with the line.
    pub place: Option<String>,
}

/// The kind of a failure, as an HTTP status code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Status {
    /// The address or the body makes no sense.
    Malformed = 400,
    /// The request comes from elsewhere.
    Forbidden = 403,
    Missing = 404,
    /// The address cannot be used with this method.
    Method = 405,
    /// Not possible in the present state.
    Conflict = 409,
    /// The body is larger than any valid one.
    Large = 413,
    /// The body is not declared as JSON.
    Form = 415,
    /// The request is understood, but cannot be done.
    Faulty = 422,
    /// The program has a fault.
    Broken = 500,
    /// Too much is asked for, or the work was stopped; possible another time.
    Busy = 503,
}

impl Failure {
    pub fn new(status: Status, error: impl Into<String>, hint: impl Into<String>) -> Failure {
        let hint = Some(hint.into()).filter(|hint| !hint.is_empty());
        Failure { status, error: error.into(), hint, place: None }
    }

    /// Converts an error of the library to a failure.
    pub fn of(error: &Error) -> Failure {
        let hint = error.hint().unwrap_or_default();
        match error {
            Error::Preset { message, source_place: Some(_), .. } => {
                let text = error.to_string();
                let place = text.replacen(message, "", 1).trim_end_matches(": ").replacen(": \n", "\n", 1);
                Failure { place: Some(place), ..Failure::new(Status::Faulty, message, hint) }
            }
            Error::Interrupted => Failure::new(Status::Busy, "this was not wanted any more", ""),
            Error::Io { .. } => Failure::new(Status::Broken, error.to_string(), hint),
            _ => Failure::new(Status::Faulty, error.to_string(), hint),
        }
    }

    fn malformed(error: impl Into<String>) -> Failure {
        Failure::new(Status::Malformed, error, "")
    }

    pub fn missing() -> Failure {
        Failure::new(Status::Missing, "there is nothing at this address", "")
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
            Status::Forbidden,
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

/// A request that changes nothing.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum ReadRequest {
    /// A file of the page.
    Page(String),
    Start,
    Schema,
    /// The bytes of memory that all worlds hold, and their limit.
    Memory,
    Tile {
        world: String,
        style: String,
        stage: Stage,
        spot: TileAddress,
    },
    Heights {
        world: String,
        stage: Stage,
        spot: TileAddress,
    },
    Names {
        world: String,
        style: String,
        spot: TileAddress,
    },
    Find {
        world: String,
        query: String,
        near_km: [f64; 2],
        limit: usize,
    },
    Watch {
        world: String,
    },
    Bake(u64),
    Map(u64),
}

/// Reads what an address asks for, from its path and its query.
///
/// # Errors
/// When there is no such address, or a number in it makes no sense.
pub(super) fn read(path: &str, query: &str) -> Result<ReadRequest, Failure> {
    let parts: Vec<&str> = path.strip_prefix('/').ok_or_else(Failure::missing)?.split('/').collect();
    let own = |text: &str| text.to_owned();
    match parts[..] {
        [file] => Ok(ReadRequest::Page(if file.is_empty() { "index.html".into() } else { own(file) })),
        ["api", "start"] => Ok(ReadRequest::Start),
        ["api", "schema"] => Ok(ReadRequest::Schema),
        ["api", "memory"] => Ok(ReadRequest::Memory),
        ["api", "bakes", number] => Ok(ReadRequest::Bake(natural(number)?)),
        ["bakes", number, "map.png"] => Ok(ReadRequest::Map(natural(number)?)),
        ["w", world, "heights", stage, zoom, x, y] => {
            // Full heights would take so long that nobody would still point at the tile: there is no address for them.
            let stage = Stage::named(stage).filter(|stage| *stage != Stage::Full).ok_or_else(Failure::missing)?;
            let y = y.strip_suffix(".js").ok_or_else(Failure::missing)?;
            Ok(ReadRequest::Heights { world: own(world), stage, spot: spot([zoom, x, y], false)? })
        }
        ["w", world, "names", style, zoom, x, y] => {
            let y = y.strip_suffix(".json").ok_or_else(Failure::missing)?;
            Ok(ReadRequest::Names { world: own(world), style: own(style), spot: spot([zoom, x, y], false)? })
        }
        ["w", world, style, stage, zoom, x, y] => {
            let stage = Stage::named(stage).ok_or_else(Failure::missing)?;
            let y = y.strip_suffix(".webp").ok_or_else(Failure::missing)?;
            let (y, is_dense) = y.strip_suffix("@2x").map_or((y, false), |y| (y, true));
            Ok(ReadRequest::Tile { world: own(world), style: own(style), stage, spot: spot([zoom, x, y], is_dense)? })
        }
        ["w", world, "find"] => find(own(world), query),
        ["w", world, "watch"] => Ok(ReadRequest::Watch { world: own(world) }),
        _ => Err(Failure::missing()),
    }
}

/// Largest number of things that a search returns.
const MOST_FOUND: usize = 100;

/// Largest number of characters of a search.
const MOST_LETTERS: usize = 200;

fn find(world: String, query: &str) -> Result<ReadRequest, Failure> {
    let (mut text, mut near_km, mut limit) = (None, [0.0; 2], 20);
    for (key, value) in form_urlencoded::parse(query.as_bytes()) {
        match &*key {
            "q" => text = Some(value.into_owned()),
            "near" => {
                let numbers: Option<Vec<f64>> = value.split(',').map(|number| number.parse().ok()).collect();
                near_km = numbers
                    .and_then(|numbers| numbers.try_into().ok())
                    .filter(|near: &[f64; 2]| near.iter().all(|km| km.is_finite()))
                    .ok_or_else(|| Failure::malformed("near: expected kilometres east and north, such as 12.5,-3"))?;
            }
            "limit" => {
                limit = value
                    .parse()
                    .ok()
                    .filter(|limit| (1..=MOST_FOUND).contains(limit))
                    .ok_or_else(|| Failure::malformed(format!("limit: expected 1 to {MOST_FOUND}")))?;
            }
            _ => {}
        }
    }
    let is_short = |text: &String| !text.trim().is_empty() && text.chars().count() <= MOST_LETTERS;
    let query = text.filter(is_short).ok_or_else(|| Failure::malformed("q: expected what to find"))?;
    Ok(ReadRequest::Find { world, query, near_km, limit })
}

fn spot([zoom, x, y]: [&str; 3], is_dense: bool) -> Result<TileAddress, Failure> {
    let wrong = || Failure::malformed(format!("{zoom}/{x}/{y} is no tile"));
    let zoom = natural(zoom).map_err(|_| wrong())?;
    let [x, y] = [x, y].map(integer);
    let (Some(x), Some(y)) = (x, y) else { return Err(wrong()) };
    TileAddress::new(zoom, x, y, is_dense).ok_or_else(wrong)
}

/// Parses a whole number only as it is usually written, so that no tile has two addresses.
fn integer(text: &str) -> Option<i64> {
    text.parse().ok().filter(|number: &i64| number.to_string() == text)
}

fn natural(text: &str) -> Result<u64, Failure> {
    let number = integer(text).and_then(|number| u64::try_from(number).ok());
    number.ok_or_else(|| Failure::malformed(format!("{text} is no number")))
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
        let tile = |path: &str| read(path, "").map_err(|failure| failure.status as u16);
        let spot = TileAddress::new(9, -3, 12, true).unwrap();
        let asked = ReadRequest::Tile { world: "0f".into(), style: "atlas".into(), stage: Stage::Full, spot };
        assert_eq!(tile("/w/0f/atlas/full/9/-3/12@2x.webp"), Ok(asked));
        let spot = TileAddress::new(0, 0, -1, false).unwrap();
        let heights = ReadRequest::Heights { world: "0f".into(), stage: Stage::Glance, spot };
        assert_eq!(tile("/w/0f/heights/glance/0/0/-1.js"), Ok(heights));
        for wrong in
            ["10/0/0", "-1/0/0", "+1/0/0", "01/0/0", "1/0x1/0", "1/-0/0", "1/1.5/0", "1/1e3/0", "1//0", "1/NaN/0"]
        {
            assert_eq!(tile(&format!("/w/0f/atlas/draft/{wrong}.webp")), Err(400), "{wrong}");
        }
        for number in ["9223372036854775807", "-9223372036854775808", "99999999999999999999999999", "1000000000000000"]
        {
            assert_eq!(tile(&format!("/w/0f/atlas/draft/3/{number}/0.webp")), Err(400), "{number}");
            assert_eq!(tile(&format!("/w/0f/heights/draft/3/0/{number}.js")), Err(400), "{number}");
        }
        for nothing in [
            "",
            "w",
            "/w/0f/atlas/half/1/0/0.webp",
            "/w/0f/atlas/full/1/0/0.png",
            "/w/../../etc/passwd",
            "/a/b/c",
            "/w/0f/heights/full/3/0/0.js",
        ] {
            assert_eq!(tile(nothing), Err(404), "{nothing}");
        }
    }

    #[test]
    fn a_search_says_what_where_and_how_many() {
        let find = |query: &str| read("/w/0f/find", query).map_err(|failure| failure.status as u16);
        let asked =
            |query: &str, near_km, limit| ReadRequest::Find { world: "0f".into(), query: query.into(), near_km, limit };
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
        let failure = Failure::of(&error);
        assert_eq!(failure.status, Status::Faulty);
        let place = failure.place.unwrap();
        assert!(place.starts_with("my.toml:2:13\n") && place.contains("2 | spacing_m = -1\n"), "{place}");
        assert!(failure.error.contains("spacing_m"), "{}", failure.error);
    }
}
