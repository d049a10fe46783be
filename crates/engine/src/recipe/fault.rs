//! Faults: errors in settings, with the key that is at fault.

use std::fmt::{self, Display, Formatter};
use std::ops::RangeInclusive;

use crate::error::{Error, clipped};

/// An error in a setting, with the key that is at fault.
#[derive(Debug)]
pub struct Fault {
    /// Path of the setting, or of the table in which it is missing.
    pub path: KeyPath,
    /// True if the key itself is wrong, and not its value.
    pub key_itself: bool,
    /// Setting that this one contradicts; the author may have written either of them.
    pub beside: Option<Box<KeyPath>>,
    /// Description of the expected value.
    message: String,
    /// The actual value, where the message does not contain it.
    found: Option<String>,
    /// Proposal that would solve the fault.
    pub hint: String,
}

impl Fault {
    /// Describes the fault in a sentence. A value that is not `written` in any text is the default.
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

    /// Adds the actual value.
    #[must_use]
    pub fn found(self, found: impl Display) -> Fault {
        Fault { found: Some(found.to_string()), ..self }
    }

    /// Adds the setting that this one contradicts. The error points there if this setting is not written.
    pub(crate) fn beside(self, other: KeyPath) -> Fault {
        Fault { beside: Some(Box::new(other)), ..self }
    }

    /// Makes the fault point at the key instead of its value.
    pub(crate) fn at_key(self) -> Fault {
        Fault { key_itself: true, ..self }
    }
}

impl From<Fault> for Error {
    /// Makes an error without a position, for settings that come from no text.
    fn from(fault: Fault) -> Error {
        Error::Preset { message: clipped(&fault.sentence(true)), source_place: None, hint: fault.hint }
    }
}

/// A step from a table or a list to one of its values.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum KeyStep {
    /// A key of a table.
    Key(String),
    /// An index into a list, from 0.
    Index(usize),
}

/// The path from the root of a preset to a value.
#[derive(Clone, Debug, Default)]
pub struct KeyPath(pub Vec<KeyStep>);

impl Display for KeyPath {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        for (index, step) in self.0.iter().enumerate() {
            match step {
                // Cut to 60 characters: an overlong key is recognizable by its beginning.
                KeyStep::Key(key) if index == 0 => write!(f, "{key:.60}")?,
                KeyStep::Key(key) => write!(f, ".{key:.60}")?,
                KeyStep::Index(index) => write!(f, "[{index}]")?,
            }
        }
        Ok(())
    }
}

impl KeyPath {
    /// Returns the path of a key in the table at this path.
    #[must_use]
    pub fn key(&self, key: &str) -> KeyPath {
        KeyPath([self.0.clone(), vec![KeyStep::Key(key.to_owned())]].concat())
    }

    /// Returns the path of an element in the list at this path.
    #[must_use]
    pub fn index(&self, index: usize) -> KeyPath {
        KeyPath([self.0.clone(), vec![KeyStep::Index(index)]].concat())
    }

    /// Makes a fault of the value at this path, with a hint that would solve it.
    pub fn fault(&self, message: impl Into<String>, hint: impl Into<String>) -> Fault {
        let (message, hint) = (message.into(), hint.into());
        Fault { path: self.clone(), key_itself: false, beside: None, message, found: None, hint }
    }

    /// Checks that a value is within a range of multiples of another key's value; `of` is that key and its value.
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

    /// Checks that a value is at most a limit set by other keys; `what` names them in the sentence of the fault.
    pub(crate) fn at_most<T: PartialOrd + Display>(&self, value: T, most: T, what: &str) -> Result<(), Fault> {
        if value <= most {
            return Ok(());
        }
        Err(self.fault(format!("expected at most {most}, {what}"), "").found(value))
    }

    /// Checks that two values between which something changes gradually rise by at least 0.001.
    pub(crate) fn rising(&self, [from, to]: [f64; 2]) -> Result<(), Fault> {
        if to - from >= 1e-3 {
            return Ok(());
        }
        let hint = "between them the ground changes gradually";
        Err(self.fault("expected two numbers of which the second is larger", hint).found(format!("[{from}, {to}]")))
    }
}

/// A number displayed with at most six decimals, to hide the rounding errors of a product.
struct Short(f64);

impl Display for Short {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let text = format!("{:.6}", self.0);
        f.write_str(text.trim_end_matches('0').trim_end_matches('.'))
    }
}
