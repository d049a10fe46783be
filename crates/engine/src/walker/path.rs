//! The text file in which a user writes a walker's way: one place per line, as `east_m,north_m`.
//!
//! Both numbers are metres from the world's origin, as in all vector files that a bake writes. The first line may be
//! the table header `east_m,north_m`. Empty lines and lines that begin with `#` are ignored.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use crate::error::{Error, SourcePlace, clipped};

/// Header of a table of places.
const HEADS: &str = "east_m,north_m";

/// Largest size of a file in bytes: 200,000 places with all their digits.
const MAX_BYTES: u64 = 8 << 20;

/// Reads the places of a file, in metres east and north of the origin; at least one.
///
/// # Errors
/// When the file cannot be read, or when a line is no place; the error points at that line.
pub(super) fn read(path: &Path) -> Result<Vec<[f64; 2]>, Error> {
    let file = path.to_string_lossy();
    let refuse = |message: String, hint: &str| {
        Err(Error::Preset { message: format!("{file}: {message}"), source_place: None, hint: hint.into() })
    };
    if path.is_dir() {
        return refuse("is a folder, not a path".into(), "name the file in it");
    }
    let mut bytes = Vec::new();
    let opened = File::open(path).and_then(|file| file.take(MAX_BYTES + 1).read_to_end(&mut bytes));
    if let Err(error) = opened {
        return refuse(error.to_string(), "name a text file with a place a line, such as 0,0 and 500,-250");
    }
    if bytes.len() as u64 > MAX_BYTES {
        return refuse(
            "is longer than 8 MiB".into(),
            "give fewer places: the walker goes straight from each to the next",
        );
    }
    match String::from_utf8(bytes) {
        Ok(text) => parse(&file, &text),
        Err(error) => {
            let at = error.utf8_error().valid_up_to();
            let line = error.as_bytes()[..at].split(|byte| *byte == b'\n').count();
            refuse(format!("is not UTF-8 from byte {at} (line {line}) on"), "save it as UTF-8 text")
        }
    }
}

/// Parses the places of a text. `file` is its name in errors.
fn parse(file: &str, text: &str) -> Result<Vec<[f64; 2]>, Error> {
    let refuse = |start: usize, length: usize, message: String| Error::Preset {
        message,
        source_place: Some(Box::new(SourcePlace::new(file, text, start..start + length))),
        hint: format!("a line has metres east and north of the origin with a comma between, as the heads say: {HEADS}"),
    };
    let mut places = Vec::new();
    let mut start = 0;
    let mut is_first = true;
    for line in text.split_inclusive('\n') {
        let said = line.trim();
        // An editor may have put a byte order mark before the content.
        let said = said.trim_start_matches('\u{feff}').trim();
        let from = start + (said.as_ptr() as usize - line.as_ptr() as usize);
        start += line.len();
        if said.is_empty() || said.starts_with('#') {
            continue;
        }
        let is_heads = std::mem::take(&mut is_first) && said.replace(' ', "") == HEADS;
        if is_heads {
            continue;
        }
        let parts: Vec<&str> = said.split(',').collect();
        let [east, north] = parts[..] else {
            let found = clipped(said);
            return Err(refuse(
                from,
                said.len(),
                format!("expected two numbers with a comma between, found {found:?}"),
            ));
        };
        let number = |part: &str| {
            let trimmed = part.trim();
            let at = part.as_ptr() as usize - said.as_ptr() as usize + (part.len() - part.trim_start().len());
            let number = trimmed.parse::<f64>().ok().filter(|number| number.is_finite());
            let found = clipped(trimmed);
            number.ok_or_else(|| {
                refuse(from + at, trimmed.len(), format!("expected a number of metres, found {found:?}"))
            })
        };
        places.push([number(east)?, number(north)?]);
    }
    match places.is_empty() {
        true => Err(refuse(0, 0, "lists no place".into())),
        false => Ok(places),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_read_with_and_without_heads() {
        let places = vec![[0.0, -12.5], [1e3, 7.0]];
        for text in
            ["0,-12.5\n1000,7", "# a way\neast_m, north_m\r\n\r\n 0 , -12.5 \r\n1e3,7\r\n", "\u{feff}0,-12.5\n1000,7\n"]
        {
            assert_eq!(parse("p.csv", text).unwrap(), places, "{text:?}");
        }
    }

    #[test]
    fn what_is_no_place_is_refused_where_it_stands() {
        let cases = [
            ("0,0\n\n5;7\n", "p.csv:3:1: expected two numbers"),
            ("0,0\n5,seven\n", "p.csv:2:3: expected a number of metres, found \"seven\""),
            ("0, inf\n", "p.csv:1:4: expected a number"),
            ("0,0\n1,2,3", "p.csv:2:1: expected two numbers"),
            ("0,0\neast_m,north_m\n", "p.csv:2:1: expected a number of metres, found \"east_m\""),
            ("# nothing\n", "p.csv:1:1: lists no place"),
        ];
        for (text, words) in cases {
            let error = parse("p.csv", text).unwrap_err();
            assert!(error.to_string().starts_with(words) && error.hint().is_some(), "{text:?}: {error}");
            assert_eq!(error.exit_code(), 2);
        }
    }
}
