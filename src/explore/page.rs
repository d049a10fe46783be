//! The files of the page, which are part of the program.

use crate::web::{LOOK, PROGRAM};

const HTML: &str = "text/html; charset=utf-8";
const STYLE: &str = "text/css; charset=utf-8";
const SCRIPT: &str = "text/javascript; charset=utf-8";

/// Name, content type and content of each file.
const FILES: &[(&str, &str, &str)] = &[
    ("index.html", HTML, include_str!("page/index.html")),
    ("viewer.css", STYLE, LOOK),
    ("explore.css", STYLE, include_str!("page/explore.css")),
    ("viewer.js", SCRIPT, PROGRAM),
    ("page.js", SCRIPT, include_str!("page/page.js")),
    ("server.js", SCRIPT, include_str!("page/server.js")),
    ("finder.js", SCRIPT, include_str!("page/finder.js")),
    ("pair.js", SCRIPT, include_str!("page/pair.js")),
    ("rectangle.js", SCRIPT, include_str!("page/rectangle.js")),
    ("scene.js", SCRIPT, include_str!("page/scene.js")),
    ("sliders.js", SCRIPT, include_str!("page/sliders.js")),
    ("explore.js", SCRIPT, include_str!("page/explore.js")),
];

/// Returns the content type and the content of a file of the page.
pub(super) fn file(name: &str) -> Option<(&'static str, &'static str)> {
    FILES.iter().find(|(known, ..)| *known == name).map(|(_, kind, content)| (*kind, *content))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_that_the_page_asks_for_is_there() {
        let (_, page) = file("index.html").unwrap();
        let named = |attribute: &str| {
            page.split(attribute).skip(1).map(|rest| rest.split('"').next().unwrap().to_owned()).collect::<Vec<_>>()
        };
        let asked = [named("src=\""), named("href=\"")].concat();
        let asked: Vec<String> = asked.into_iter().filter(|name| !name.starts_with("data:")).collect();
        assert!(asked.len() >= 4, "{asked:?}");
        for name in asked {
            assert!(file(name.trim_start_matches("./")).is_some(), "{name}");
        }
    }
}
