//! What is wrong with a setting, and under which key.

use std::fmt::{self, Display, Formatter};
use std::ops::RangeInclusive;

use crate::error::{Error, clipped};

/// What is wrong with a setting, and under which key.
#[derive(Debug)]
pub struct Fault {
    /// The setting, or the table where it should be.
    pub path: KeyPath,
    /// Whether it is the key itself that is wrong, and not its value.
    pub key_itself: bool,
    /// The setting with which it does not go, which may be the one that was given.
    pub beside: Option<Box<KeyPath>>,
    /// What was expected.
    message: String,
    /// The value that was there instead, where the message does not say it.
    found: Option<String>,
    /// What would do.
    pub hint: String,
}

impl Fault {
    /// What is wrong, in words. A value that is not `written` in any text is the default.
    pub(crate) fn sentence(&self, written: bool) -> String {
        let Fault { path, message, found, .. } = self;
        let value = match found {
            Some(found) if written => format!(", found {found}"),
            Some(found) => format!(", but the default is {found}"),
            None => String::new(),
        };
        match (path.0.is_empty(), written) {
            (true, _) => format!("{message}{value}"),
            (_, true) => format!("{path}: {message}{value}"),
            (_, false) => format!("{path} (not given): {message}{value}"),
        }
    }

    /// The same, saying that `found` was there.
    #[must_use]
    pub fn found(self, found: impl Display) -> Fault {
        Fault { found: Some(found.to_string()), ..self }
    }

    /// The same, pointing at another setting, with which this one does not go, where this one is not written.
    pub(crate) fn beside(self, other: KeyPath) -> Fault {
        Fault { beside: Some(Box::new(other)), ..self }
    }

    /// The same, pointing at the key and not at its value.
    pub(crate) fn at_key(self) -> Fault {
        Fault { key_itself: true, ..self }
    }
}

impl From<Fault> for Error {
    /// The error where there is no text to point into.
    fn from(fault: Fault) -> Error {
        Error::Preset { message: clipped(&fault.sentence(true)), source_place: None, hint: fault.hint }
    }
}

/// A step from a table or a list to what is in it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Step {
    /// A key of a table.
    Key(String),
    /// A place in a list, from 0.
    Index(usize),
}

/// The way from the preset's root to a value.
#[derive(Clone, Debug, Default)]
pub struct KeyPath(pub Vec<Step>);

impl Display for KeyPath {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        for (index, step) in self.0.iter().enumerate() {
            match step {
                // A key that is longer than any is known again by its beginning.
                Step::Key(key) if index == 0 => write!(f, "{key:.60}")?,
                Step::Key(key) => write!(f, ".{key:.60}")?,
                Step::Index(index) => write!(f, "[{index}]")?,
            }
        }
        Ok(())
    }
}

impl KeyPath {
    /// The path of a key of the table at this path.
    #[must_use]
    pub fn key(&self, key: &str) -> KeyPath {
        KeyPath([self.0.clone(), vec![Step::Key(key.to_owned())]].concat())
    }

    /// The path of a value of the list at this path.
    #[must_use]
    pub fn index(&self, index: usize) -> KeyPath {
        KeyPath([self.0.clone(), vec![Step::Index(index)]].concat())
    }

    /// What is wrong with the value at this path, and what would do.
    pub fn fault(&self, message: impl Into<String>, hint: impl Into<String>) -> Fault {
        let (message, hint) = (message.into(), hint.into());
        Fault { path: self.clone(), key_itself: false, beside: None, message, found: None, hint }
    }

    /// Checks a value whose range is so many times that of another key: `of` is its name, and what it has.
    pub(crate) fn times(&self, value: f64, range: RangeInclusive<f64>, of: (&str, f64)) -> Result<(), Fault> {
        let (low, high) = (*range.start() * of.1, *range.end() * of.1);
        if (low..=high).contains(&value) {
            return Ok(());
        }
        let (least, most) = (range.start(), range.end());
        let message = format!("expected {least} to {most} times {}, which is {} to {}", of.0, Short(low), Short(high));
        let hint = if value < low { format!("or a smaller {}", of.0) } else { format!("or a larger {}", of.0) };
        Err(self.fault(message, format!("a value in this range, {hint}")).found(value))
    }

    /// Checks a value that other keys keep small: `what` names them, in the sentence's words.
    pub(crate) fn at_most<T: PartialOrd + Display>(&self, value: T, most: T, what: &str) -> Result<(), Fault> {
        if value <= most {
            return Ok(());
        }
        Err(self.fault(format!("expected at most {most}, {what}"), "").found(value))
    }

    /// Checks two values between which something changes gradually.
    pub(crate) fn rising(&self, [from, to]: [f64; 2]) -> Result<(), Fault> {
        if to - from >= 1e-3 {
            return Ok(());
        }
        let hint = "between them the ground changes gradually";
        Err(self.fault("expected two numbers of which the second is larger", hint).found(format!("[{from}, {to}]")))
    }
}

/// A number without the last digits that a product leaves.
struct Short(f64);

impl Display for Short {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let text = format!("{:.6}", self.0);
        f.write_str(text.trim_end_matches('0').trim_end_matches('.'))
    }
}
