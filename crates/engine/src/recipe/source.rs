//! Where a recipe is written: its text, those that it extends, and settings on top, read with errors that point there.

use std::io::Read;
use std::marker::PhantomData;
use std::ops::Range;
use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::de::DeserializeOwned;
use toml::Spanned;
use toml::de::{DeTable, DeValue, Deserializer};

use crate::error::{Error, SourcePlace, clipped, nearest};
use crate::recipe::fault::{Fault, KeyPath};
use crate::recipe::form;
use crate::recipe::merge::{key_path, locate, merge, name_from, put};
use crate::recipe::origin::{Origin, read_text, text_of};

/// A kind of text that an author writes, in TOML: a preset, a style.
pub trait Recipe: DeserializeOwned + JsonSchema {
    /// What one is called.
    const WHAT: &'static str;
    /// The folder of those that the program brings along, and the command that lists them.
    const FOLDER: &'static str;
    /// Those that the program brings along, as name and text.
    const BUILT_IN: &'static [(&'static str, &'static str)];

    /// The keys, each with the tables around it, that name files: from the folder of the text that they are written in.
    const FILES: &'static [&'static [&'static str]] = &[];

    /// Finds the first key, as written, that does not go with others.
    ///
    /// # Errors
    /// When there is one.
    fn check_written(_root: &DeValue) -> Result<(), Fault> {
        Ok(())
    }

    /// Writes the defaults that depend on other keys, and finds the first value that does not go with others.
    ///
    /// # Errors
    /// When there is one.
    fn complete(&mut self) -> Result<(), Fault>;
}

/// The text of a recipe that the program brings along.
///
/// # Errors
/// When there is none of that name; the hint lists the names.
pub fn built_in<T: Recipe>(name: &str) -> Result<&'static str, Error> {
    let names = T::BUILT_IN.iter().map(|(name, _)| *name);
    T::BUILT_IN.iter().find(|(known, _)| *known == name).map(|(_, text)| *text).ok_or_else(|| {
        let meant = nearest(name, names.clone()).map_or_else(String::new, |meant| format!("did you mean {meant}? "));
        Error::Preset {
            message: format!("there is neither a file nor a built-in {} named {name:?}", T::WHAT),
            source_place: None,
            hint: format!("{meant}built-in {}s: {}", T::WHAT, names.collect::<Vec<_>>().join(", ")),
        }
    })
}

/// The texts that make a recipe, from the one that all extend to the last setting.
///
/// Tables are merged, and all else is replaced by what comes later.
#[derive(Debug)]
pub struct Sources<T> {
    name: String,
    texts: Vec<Source>,
    makes: PhantomData<fn() -> T>,
}

/// A text, and where it begins in an imaginary one that has all of them: so that a place in any is a single number.
#[derive(Debug)]
struct Source {
    /// What errors name.
    file: String,
    /// Where it lies.
    folder: PathBuf,
    text: String,
    start: usize,
    /// The text as it is parsed: after as many spaces as the imaginary one has before it.
    padded: String,
    /// The key that it sets, if it is a single value.
    key: Option<KeyPath>,
}

impl<T: Recipe> Sources<T> {
    fn new(name: &str) -> Sources<T> {
        Sources { name: name.to_owned(), texts: Vec::new(), makes: PhantomData }
    }

    /// The built-in recipe of that name or else the one in the file of that path.
    ///
    /// # Errors
    /// When there is none, or when it cannot be read, or one that it extends.
    pub fn load(name_or_path: &str) -> Result<Sources<T>, Error> {
        let mut sources = Sources::new("");
        let origin = Origin::find::<T>(name_or_path, Path::new(""))?;
        sources.name = origin.name();
        sources.add(&origin, &mut Vec::new())?;
        Ok(sources)
    }

    /// The recipe that a reader gives, such as standard input. `file` is what errors name, and the recipe's name.
    ///
    /// # Errors
    /// When it cannot be read, or one that it extends.
    pub fn read(file: &str, reader: impl Read) -> Result<Sources<T>, Error> {
        Sources::parse(file, &text_of::<T>(file, reader)?)
    }

    /// The recipe that `text` writes. `file` is what errors name, and the recipe's name.
    ///
    /// # Errors
    /// When it is not TOML, or when one that it extends cannot be read.
    pub fn parse(file: &str, text: &str) -> Result<Sources<T>, Error> {
        let mut sources = Sources::new(file);
        sources.add_text(file, text, Path::new(""), &mut Vec::new())?;
        Ok(sources)
    }

    /// The recipe's short name.
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
        let (file, folder, text) = (option.into(), PathBuf::new(), setting.into());
        self.texts.push(Source { file, folder, text, start, padded, key: Some(path) });
        Ok(())
    }

    /// What is written, with every default filled in.
    ///
    /// # Errors
    /// When a key is unknown or missing, or a value out of its range; the error points at it.
    pub fn read_all(&self) -> Result<T, Error> {
        self.read_with(|_| true)
    }

    /// The same but for single keys that were set.
    ///
    /// # Errors
    /// When a key is unknown or missing, or a value out of its range.
    pub fn read_unset(&self) -> Result<T, Error> {
        self.read_with(|source| source.key.is_none())
    }

    fn read_with(&self, counts: impl Fn(&Source) -> bool) -> Result<T, Error> {
        let merged = self.merged(counts)?;
        let point = |fault: Fault| {
            let (span, written) = locate(&merged, &fault);
            self.error(fault.sentence(written), span, &fault.hint)
        };
        form::check_table(T::WHAT, &form::schema::<T>(), merged.get_ref()).map_err(point)?;
        T::check_written(merged.get_ref()).map_err(point)?;
        let DeValue::Table(table) = merged.get_ref() else { unreachable!("the root is a table") };
        let table = Spanned::new(merged.span(), table.clone());
        let mut recipe = T::deserialize(Deserializer::from(table))
            .map_err(|error| self.error(error.message().to_owned(), error.span().unwrap_or(0..0), ""))?;
        recipe.complete().map_err(point)?;
        Ok(recipe)
    }

    fn next_start(&self) -> usize {
        // Two bytes more, so that the end of one text is not the beginning of the next.
        self.texts.last().map_or(0, |last| last.start + last.text.len() + 2)
    }

    /// Adds a recipe after those that it extends; `within` are those that it is extended by.
    fn add(&mut self, origin: &Origin, within: &mut Vec<Origin>) -> Result<(), Error> {
        within.push(origin.clone());
        match origin {
            Origin::BuiltIn(name) => {
                self.add_text(&format!("{}/{name}.toml", T::FOLDER), built_in::<T>(name)?, Path::new(""), within)?;
            }
            Origin::File { given, .. } => {
                let folder = given.parent().unwrap_or(Path::new(""));
                self.add_text(&given.to_string_lossy(), &read_text::<T>(given)?, folder, within)?;
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
            let example = T::BUILT_IN[T::BUILT_IN.len() - 1].0;
            let hint = format!("{}s are TOML; terrane {} {example} prints one to start from", T::WHAT, T::FOLDER);
            refuse(error.message().trim(), error.span().unwrap_or(0..0), &hint)
        })?;
        if let Some(base) = table.get_ref().get("extends") {
            let Some(name) = base.get_ref().as_str() else {
                let hint = format!("write extends = {:?}, or a path from here", T::BUILT_IN[0].0);
                let message = format!("extends: expected the name of a {} or of its file", T::WHAT);
                return Err(refuse(&message, base.span(), &hint));
            };
            // What is wrong with the file itself is said with its own name.
            let there = |error: Error| match error {
                Error::Preset { message, source_place: None, hint } => {
                    refuse(&format!("extends: {message}"), base.span(), &hint)
                }
                error => error,
            };
            let origin = Origin::find::<T>(name, folder).map_err(there)?;
            if within.iter().any(|other| other.is(&origin)) {
                let message = format!("extends: this {} extends itself", T::WHAT);
                return Err(refuse(&message, base.span(), "leave one of them out"));
            }
            self.add(&origin, within).map_err(there)?;
        }
        let start = self.next_start();
        let padded = " ".repeat(start) + text;
        let (file, folder, text) = (file.to_owned(), folder.to_owned(), text.to_owned());
        self.texts.push(Source { file, folder, text, start, padded, key: None });
        Ok(())
    }

    /// One table of all that is written in texts that count, every value with its place.
    fn merged(&self, counts: impl Fn(&Source) -> bool) -> Result<Spanned<DeValue<'_>>, Error> {
        // What is written nowhere is missed where the recipe itself begins.
        let main = self.texts.iter().rfind(|source| source.key.is_none()).map_or(0, |source| source.start);
        let mut root = Spanned::new(main..main, DeValue::Table(DeTable::new()));
        for source in self.texts.iter().filter(|source| counts(source)) {
            let mut table = DeTable::parse(&source.padded).expect("it has been parsed before").into_inner();
            match &source.key {
                None => {
                    table.remove("extends");
                    for keys in T::FILES {
                        name_from(&mut table, keys, &source.folder);
                    }
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
