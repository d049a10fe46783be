//! Where a preset is written: its text, those that it extends, and settings on top, read with errors that point there.

use std::io::Read;
use std::ops::Range;
use std::path::Path;

use serde::Deserialize;
use toml::Spanned;
use toml::de::{DeTable, DeValue, Deserializer};

use crate::error::{Error, SourcePlace, clipped};
use crate::preset::built_in::built_in;
use crate::preset::merge::{key_path, locate, merge, put};
use crate::preset::origin::{Origin, read_text, text_of};
use crate::preset::{Preset, check_needs};
use crate::recipe::fault::{Fault, KeyPath};
use crate::recipe::form;

/// The texts that make a preset, from the one that all extend to the last setting.
///
/// Tables are merged, and all else is replaced by what comes later.
#[derive(Debug)]
pub struct Sources {
    name: String,
    texts: Vec<Source>,
}

/// A text, and where it begins in an imaginary one that has all of them: so that a place in any is a single number.
#[derive(Debug)]
struct Source {
    /// What errors name.
    file: String,
    text: String,
    start: usize,
    /// The text as it is parsed: after as many spaces as the imaginary one has before it.
    padded: String,
    /// The key that it sets, if it is a single value.
    key: Option<KeyPath>,
}

impl Sources {
    /// The built-in preset of that name or else the preset in the file of that path.
    ///
    /// # Errors
    /// When there is no such preset, or when it cannot be read, or one that it extends.
    pub fn load(name_or_path: &str) -> Result<Sources, Error> {
        let mut sources = Sources { name: String::new(), texts: Vec::new() };
        let origin = Origin::find(name_or_path, Path::new(""))?;
        sources.name = origin.name();
        sources.add(&origin, &mut Vec::new())?;
        Ok(sources)
    }

    /// The preset that a reader gives, such as standard input. `file` is what errors name, and the preset's name.
    ///
    /// # Errors
    /// When it cannot be read, or one that it extends.
    pub fn read(file: &str, reader: impl Read) -> Result<Sources, Error> {
        Sources::parse(file, &text_of(file, reader)?)
    }

    /// The preset that `text` writes. `file` is what errors name, and the preset's name.
    ///
    /// # Errors
    /// When it is not TOML, or when a preset that it extends cannot be read.
    pub fn parse(file: &str, text: &str) -> Result<Sources, Error> {
        let mut sources = Sources { name: file.to_owned(), texts: Vec::new() };
        sources.add_text(file, text, Path::new(""), &mut Vec::new())?;
        Ok(sources)
    }

    /// The preset's short name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Sets one key on top of all texts: `setting` is `key=value`, the key with dots and indices (`noise[0].height_m`), the
    /// value as in TOML. Errors name it by `option`.
    ///
    /// # Errors
    /// When it is not of that form.
    pub fn set(&mut self, option: &str, setting: &str) -> Result<(), Error> {
        let start = self.next_start();
        let refuse = |message: String, span: Range<usize>, hint: &str| Error::Preset {
            message,
            source_place: Some(Box::new(SourcePlace::new(option, setting, span))),
            hint: hint.into(),
        };
        let form = "write key=value, such as spacing_m=2 or noise[0].height_m=300";
        let Some((key, value)) = setting.split_once('=') else {
            return Err(refuse("there is no = between key and value".into(), 0..setting.len(), form));
        };
        let Some(path) = key_path(key) else {
            return Err(refuse("this is no key".into(), 0..key.len(), form));
        };
        // A short key that takes the place of the long one, so that the value keeps its own.
        let padded = format!("{}v={value}", " ".repeat(start + key.len() - 1));
        match DeTable::parse(&padded) {
            Ok(table) if table.get_ref().len() == 1 => {}
            _ => {
                let hint = "values are as in TOML: 12.5, true, [1, 2], and \"text\" with its quotes";
                return Err(refuse(format!("{path}: this is no value"), key.len() + 1..setting.len(), hint));
            }
        }
        self.texts.push(Source { file: option.into(), text: setting.into(), start, padded, key: Some(path) });
        Ok(())
    }

    /// The preset, with every default filled in.
    ///
    /// # Errors
    /// When a key is unknown or missing, or a value out of its range; the error points at it.
    pub fn preset(&self) -> Result<Preset, Error> {
        let merged = self.merged()?;
        let point = |fault: Fault| {
            let (span, written) = locate(&merged, &fault);
            self.error(fault.sentence(written), span, &fault.hint)
        };
        form::check_table(&form::schema::<Preset>(), merged.get_ref()).map_err(point)?;
        check_needs(merged.get_ref()).map_err(point)?;
        let DeValue::Table(table) = merged.get_ref() else { unreachable!("the root is a table") };
        let table = Spanned::new(merged.span(), table.clone());
        let mut preset = Preset::deserialize(Deserializer::from(table))
            .map_err(|error| self.error(error.message().to_owned(), error.span().unwrap_or(0..0), ""))?;
        preset.fill_defaults();
        preset.check_together().map_err(point)?;
        Ok(preset)
    }

    fn next_start(&self) -> usize {
        // Two bytes more, so that the end of one text is not the beginning of the next.
        self.texts.last().map_or(0, |last| last.start + last.text.len() + 2)
    }

    /// Adds a preset after those that it extends; `within` are those that it is extended by.
    fn add(&mut self, origin: &Origin, within: &mut Vec<Origin>) -> Result<(), Error> {
        within.push(origin.clone());
        match origin {
            Origin::BuiltIn(name) => {
                self.add_text(&format!("presets/{name}.toml"), built_in(name)?, Path::new(""), within)?;
            }
            Origin::File { given, .. } => {
                let folder = given.parent().unwrap_or(Path::new(""));
                self.add_text(&given.to_string_lossy(), &read_text(given)?, folder, within)?;
            }
        }
        within.pop();
        Ok(())
    }

    fn add_text(&mut self, file: &str, text: &str, folder: &Path, within: &mut Vec<Origin>) -> Result<(), Error> {
        let text = text.trim_start_matches('\u{feff}');
        let refuse = |message: &str, span: Range<usize>, hint: &str| Error::Preset {
            message: clipped(message),
            source_place: Some(Box::new(SourcePlace::new(file, text, span))),
            hint: hint.into(),
        };
        let table = DeTable::parse(text).map_err(|error| {
            let hint = "presets are TOML; terrane presets thesis prints one to start from";
            refuse(error.message().trim(), error.span().unwrap_or(0..0), hint)
        })?;
        if let Some(base) = table.get_ref().get("extends") {
            let Some(name) = base.get_ref().as_str() else {
                let hint = "write extends = \"alps\", or a path from here";
                return Err(refuse("extends: expected the name of a preset or of its file", base.span(), hint));
            };
            // What is wrong with the file itself is said with its own name.
            let there = |error: Error| match error {
                Error::Preset { message, source_place: None, hint } => {
                    refuse(&format!("extends: {message}"), base.span(), &hint)
                }
                error => error,
            };
            let origin = Origin::find(name, folder).map_err(there)?;
            if within.iter().any(|other| other.is(&origin)) {
                return Err(refuse("extends: this preset extends itself", base.span(), "leave one of them out"));
            }
            self.add(&origin, within).map_err(there)?;
        }
        let start = self.next_start();
        let padded = " ".repeat(start) + text;
        self.texts.push(Source { file: file.to_owned(), text: text.to_owned(), start, padded, key: None });
        Ok(())
    }

    /// One table of all that is written, every value with its place.
    fn merged(&self) -> Result<Spanned<DeValue<'_>>, Error> {
        // What is written nowhere is missed where the preset itself begins.
        let main = self.texts.iter().rfind(|source| source.key.is_none()).map_or(0, |source| source.start);
        let mut root = Spanned::new(main..main, DeValue::Table(DeTable::new()));
        for source in &self.texts {
            let mut table = DeTable::parse(&source.padded).expect("it has been parsed before").into_inner();
            match &source.key {
                None => {
                    table.remove("extends");
                    merge(&mut root, Spanned::new(main..main, DeValue::Table(table)));
                }
                Some(path) => {
                    let key = source.start..source.start + source.text.find('=').unwrap_or(1);
                    let value = table.remove("v").expect("it has been parsed before");
                    if let Err(message) = put(&mut root, &path.0, &key, value) {
                        let hint = "list indices begin with 0: noise[0].height_m";
                        return Err(self.error(format!("{path}: {message}"), key, hint));
                    }
                }
            }
        }
        Ok(root)
    }

    /// The error at a place of the imaginary text.
    fn error(&self, message: String, span: Range<usize>, hint: &str) -> Error {
        let source = self.texts.iter().rfind(|source| source.start <= span.start).expect("the first begins at 0");
        let span = span.start - source.start..span.end.saturating_sub(source.start);
        let place = SourcePlace::new(&source.file, &source.text, span);
        Error::Preset { message: clipped(&message), source_place: Some(Box::new(place)), hint: hint.to_owned() }
    }
}

impl Preset {
    /// The built-in preset of that name or else the preset in the file of that path, and its short name.
    ///
    /// # Errors
    /// When there is no such preset, or when it cannot be read or understood.
    pub fn load(name_or_path: &str) -> Result<(String, Preset), Error> {
        let sources = Sources::load(name_or_path)?;
        Ok((sources.name().to_owned(), sources.preset()?))
    }

    /// The preset that `text` writes, with every default filled in. `file` is what errors name.
    ///
    /// # Errors
    /// When it is not TOML, has an unknown key, lacks one or has a value out of its range; the error points at it.
    pub fn parse(file: &str, text: &str) -> Result<Preset, Error> {
        Sources::parse(file, text)?.preset()
    }
}
