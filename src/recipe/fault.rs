//! What is wrong with a setting, and under which key.

use std::fmt::Display;
use std::ops::RangeInclusive;

use crate::error::{Error, SourcePlace};

/// What is wrong with a preset's value, and under which key.
#[derive(Debug)]
pub(crate) struct Fault {
    pub(crate) path: Vec<Step>,
    message: String,
    hint: String,
}

impl Fault {
    /// The error, pointing at a place if there is a text to point into.
    pub(crate) fn into_error(self, source_place: Option<Box<SourcePlace>>) -> Error {
        let key = self.path.iter().fold(String::new(), |text, step| match step {
            Step::Key(key) if text.is_empty() => key.clone(),
            Step::Key(key) => format!("{text}.{key}"),
            Step::Index(index) => format!("{text}[{index}]"),
        });
        Error::Preset { message: format!("{key}: {}", self.message), source_place, hint: self.hint }
    }
}

#[derive(Clone, Debug)]
pub(crate) enum Step {
    Key(String),
    Index(usize),
}

/// The way from the preset's root to a value.
#[derive(Clone, Default)]
pub(crate) struct KeyPath(Vec<Step>);

impl KeyPath {
    pub(crate) fn key(&self, key: &str) -> KeyPath {
        KeyPath([self.0.clone(), vec![Step::Key(key.to_owned())]].concat())
    }

    pub(crate) fn index(&self, index: usize) -> KeyPath {
        KeyPath([self.0.clone(), vec![Step::Index(index)]].concat())
    }

    pub(crate) fn fault(&self, message: impl Into<String>, hint: impl Into<String>) -> Fault {
        Fault { path: self.0.clone(), message: message.into(), hint: hint.into() }
    }

    pub(crate) fn within<T: PartialOrd + Display>(&self, value: T, range: RangeInclusive<T>) -> Result<(), Fault> {
        if range.contains(&value) {
            return Ok(());
        }
        let (low, high) = range.into_inner();
        Err(self.fault(format!("expected {low} to {high}, found {value}"), ""))
    }

    pub(crate) fn rising(&self, [from, to]: [f64; 2], range: RangeInclusive<f64>) -> Result<(), Fault> {
        self.index(0).within(from, range.clone())?;
        self.index(1).within(to, range)?;
        if to - from < 1e-3 {
            let message = format!("expected two numbers of which the second is larger, found [{from}, {to}]");
            return Err(self.fault(message, "between them the ground changes gradually"));
        }
        Ok(())
    }
}
