//! Errors, worded so that the reader knows what to do next.

use std::fmt::{self, Display, Formatter};
use std::io;
use std::path::{Path, PathBuf};

use crate::stop::Stopped;

/// The reason why something could not be done. A user's mistake carries a hint at what would work instead.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A text from the user, a preset, a style or a path, that cannot be read or understood.
    #[error("{}{message}{}", Located(source_place), Pictured(source_place))]
    Preset {
        /// The difference between what was expected and what was found.
        message: String,
        /// The place of the mistake, when the preset came from a text.
        source_place: Option<Box<SourcePlace>>,
        /// A hint at what would work.
        hint: String,
    },
    /// A region that cannot exist.
    #[error("{message}")]
    Region {
        /// The reason.
        message: String,
        /// A hint at what would work.
        hint: String,
    },
    /// An export that is unknown or that cannot hold the region.
    #[error("{message}")]
    Export {
        /// The reason.
        message: String,
        /// A hint at what would work.
        hint: String,
    },
    /// An output path that cannot be used.
    #[error("{}: {message}", path.display())]
    Output {
        /// The output path.
        path: PathBuf,
        /// The reason.
        message: String,
        /// A hint at what would work.
        hint: String,
    },
    /// An option or environment variable that makes no sense.
    #[error("{message}")]
    Option {
        /// The reason.
        message: String,
        /// A hint at what would work.
        hint: String,
    },
    /// A device that was asked for and is not available.
    #[error("{message}")]
    Device {
        /// The reason.
        message: String,
        /// A hint at what would work.
        hint: String,
    },
    /// A tile registry that is missing or cannot be understood.
    #[error("{}: {message}", path.display())]
    Registry {
        /// The registry's file.
        path: PathBuf,
        /// The fault that was found.
        message: String,
        /// A hint at what would work.
        hint: String,
    },
    /// A bake whose files differ from those that were written.
    #[error("{}: {message}", path.display())]
    Faulty {
        /// The bake's folder.
        path: PathBuf,
        /// The number and kinds of faults.
        message: String,
        /// A hint at what would work.
        hint: String,
    },
    /// The operating system refused to read or write.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// The operating system's error.
        source: io::Error,
    },
    /// The user stopped the work.
    #[error("interrupted; what was half-written is gone")]
    Interrupted,
}

impl From<Stopped> for Error {
    fn from(_: Stopped) -> Error {
        Error::Interrupted
    }
}

/// Lets a stop pass through what reads and writes; [`Error::io`] makes an interruption of it again.
impl From<Stopped> for io::Error {
    fn from(stopped: Stopped) -> io::Error {
        io::Error::other(stopped)
    }
}

impl Error {
    /// Returns a hint at what would work instead, if the error has one.
    pub fn hint(&self) -> Option<&str> {
        match self {
            Error::Preset { hint, .. }
            | Error::Region { hint, .. }
            | Error::Export { hint, .. }
            | Error::Output { hint, .. }
            | Error::Option { hint, .. }
            | Error::Device { hint, .. }
            | Error::Faulty { hint, .. }
            | Error::Registry { hint, .. } => Some(hint).filter(|hint| !hint.is_empty()).map(String::as_str),
            Error::Io { .. } | Error::Interrupted => None,
        }
    }

    /// Returns the exit code of a command that ends with this error: 2 for the user's mistake, 130 for an interrupt, 1
    /// for errors of the system or of a device and for a bake with faults.
    pub fn exit_code(&self) -> u8 {
        match self {
            Error::Io { .. } | Error::Faulty { .. } | Error::Device { .. } => 1,
            Error::Interrupted => 130,
            _ => 2,
        }
    }

    /// Wraps an error of the operating system about a path.
    pub fn io(path: impl AsRef<Path>) -> impl FnOnce(io::Error) -> Error {
        move |source| match source.get_ref() {
            Some(inner) if inner.is::<Stopped>() => Error::Interrupted,
            _ => Error::Io { path: path.as_ref().to_owned(), source },
        }
    }
}

/// A place in a text at which an error points.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SourcePlace {
    /// The file, or the name of a built-in preset.
    pub file: String,
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// The line itself, cut around the place when it is long; control characters are replaced by their symbols.
    pub text: String,
    /// Number of characters of `text` before the place.
    pub before: usize,
    /// Number of characters of `text` that the error marks; at least 1.
    pub length: usize,
}

impl SourcePlace {
    /// The place of the bytes `span` of `text`.
    pub(crate) fn new(file: &str, text: &str, span: std::ops::Range<usize>) -> SourcePlace {
        let start = text.floor_char_boundary(span.start.min(text.len()));
        let line_start = text[..start].rfind('\n').map_or(0, |at| at + 1);
        let line_end = text[start..].find('\n').map_or(text.len(), |at| start + at);
        let end = text.floor_char_boundary(span.end).clamp(start, line_end);
        let before = &text[line_start..start];
        let after = text[start..line_end].trim_end();
        let column = before.chars().count() + 1;
        // A long line is cut on both sides.
        let cut = column.saturating_sub(SHOWN_BEFORE + 1);
        let shown_before: String = before.chars().skip(cut).collect();
        let shown_after: String = after.chars().take(SHOWN_AFTER).collect();
        let (left, right) =
            (if cut > 0 { "..." } else { "" }, if shown_after.len() < after.len() { "..." } else { "" });
        SourcePlace {
            file: visible(file),
            line: text[..start].matches('\n').count() + 1,
            column,
            text: visible(&format!("{left}{shown_before}{shown_after}{right}")),
            before: left.len() + shown_before.chars().count(),
            length: text[start..end].trim_end().chars().count().clamp(1, SHOWN_AFTER),
        }
    }
}

/// Number of characters of a line that are shown before a place, and from the place on: with the line number, the width
/// of a terminal.
const SHOWN_BEFORE: usize = 40;
const SHOWN_AFTER: usize = 72;

/// Largest number of characters of a message that are shown; a longer message would not be read.
const MESSAGE_CHARACTERS: usize = 800;

/// Replaces the characters that would control a terminal by symbols; tabs stay.
fn visible(text: &str) -> String {
    let picture = |c: char| match c {
        '\t' => c,
        '\0'..='\x1f' => char::from_u32('\u{2400}' as u32 + c as u32).unwrap_or('\u{fffd}'),
        '\x7f' => '\u{2421}',
        // The other control characters, and those that change the direction of writing.
        '\u{80}'..='\u{9f}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}' => '\u{fffd}',
        c => c,
    };
    text.chars().map(picture).collect()
}

/// Makes a message that quotes a user's text fit for a terminal: replaces control characters and cuts off what is too
/// long.
pub fn clipped(message: &str) -> String {
    let end = message.char_indices().nth(MESSAGE_CHARACTERS).map_or(message.len(), |(at, _)| at);
    visible(&message[..end]) + if end < message.len() { "..." } else { "" }
}

/// Shows the place in a text as `file:line:column: `.
struct Located<'a>(&'a Option<Box<SourcePlace>>);

/// Shows the line of the place, with a mark under the characters that are meant.
struct Pictured<'a>(&'a Option<Box<SourcePlace>>);

impl Display for Located<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self.0 {
            Some(place) => write!(f, "{}:{}:{}: ", place.file, place.line, place.column),
            None => Ok(()),
        }
    }
}

impl Display for Pictured<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let Some(place) = self.0 else { return Ok(()) };
        let number = place.line.to_string();
        let margin = " ".repeat(number.len());
        // Tabs before the mark stay tabs, so that the mark stands under the place on any terminal.
        let indent: String =
            place.text.chars().take(place.before).map(|c| if c == '\t' { '\t' } else { ' ' }).collect();
        write!(f, "\n{margin} |\n{number} | {}\n{margin} | {indent}{}", place.text, "^".repeat(place.length))
    }
}

/// Returns the name in `known` that a mistyped `name` was probably meant to be.
pub fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    known
        .into_iter()
        .map(|candidate| (strsim::damerau_levenshtein(name, candidate), candidate))
        // A third of the letters wrong is a typing mistake; more is another word.
        .filter(|(distance, candidate)| *distance * 3 <= candidate.len().max(name.len()))
        .min()
        .map(|(_, candidate)| candidate)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mark_stands_under_the_place() {
        let text = "a = 1\n\toctaves = 1000\n";
        let place = SourcePlace::new("p.toml", text, 17..21);
        let error = Error::Preset { message: "too many".into(), source_place: Some(place.into()), hint: "8".into() };
        assert_eq!(error.to_string(), "p.toml:2:12: too many\n  |\n2 | \toctaves = 1000\n  | \t          ^^^^");
    }

    #[test]
    fn a_slip_is_recognised_and_another_word_is_not() {
        let known = ["height", "blend", "normal"];
        assert_eq!(nearest("hieght", known), Some("height"));
        assert_eq!(nearest("rivers", known), None);
    }
}
