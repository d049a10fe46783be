//! Sources of a recipe: its text, the texts that it extends, and single settings on top, read with errors that point at
//! the place.

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
use crate::recipe::location::{Location, read_text, text_of};
use crate::recipe::schema;
use crate::recipe::toml_tables::{key_path, locate, merge, name_from, put};

/// A kind of TOML text that an author writes: a preset or a style.
pub trait Recipe: DeserializeOwned + JsonSchema {
    /// Word for one such text.
    const WHAT: &'static str;
    /// Folder of the built-in texts; also the name of the command that lists them.
    const FOLDER: &'static str;
    /// Names and texts of the built-in recipes.
    const BUILT_IN: &'static [(&'static str, &'static str)];

    /// Key paths whose values name files, relative to the folder of the text in which they are written.
    const FILES: &'static [&'static [&'static str]] = &[];

    /// Finds the first written key that contradicts another one.
    ///
    /// # Errors
    /// When there is such a key.
    fn check_written(_root: &DeValue) -> Result<(), Fault> {
        Ok(())
    }

    /// Fills in the defaults that depend on other keys, and finds the first value that contradicts another one.
    ///
    /// # Errors
    /// When there is such a value.
    fn complete(&mut self) -> Result<(), Fault>;
}

/// Returns the text of a built-in recipe.
///
/// # Errors
/// When no built-in recipe has this name; the hint lists the names.
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

/// The texts that make a recipe: from the base that all others extend to the last single setting.
///
/// Later texts override earlier ones: tables are merged, and all other values are replaced.
#[derive(Debug)]
pub struct RecipeSources<T> {
    name: String,
    texts: Vec<Source>,
    makes: PhantomData<fn() -> T>,
}

/// A text with its start in an imaginary text that joins all sources, so that a position in any of them is a single
/// number.
#[derive(Debug)]
struct Source {
    /// Name in errors.
    file: String,
    /// Folder of the file.
    folder: PathBuf,
    text: String,
    start: usize,
    /// The text for the parser, preceded by spaces up to its start in the imaginary text, so that the parser reports
    /// positions there.
    padded: String,
    /// Key that this source sets, if it is a single setting.
    key: Option<KeyPath>,
}

impl<T: Recipe> RecipeSources<T> {
    fn new(name: &str) -> RecipeSources<T> {
        RecipeSources { name: name.to_owned(), texts: Vec::new(), makes: PhantomData }
    }

    /// Loads the built-in recipe of this name, or else the recipe in the file at this path.
    ///
    /// # Errors
    /// When there is no such recipe, or when it or a recipe that it extends cannot be read.
    pub fn load(name_or_path: &str) -> Result<RecipeSources<T>, Error> {
        let mut sources = RecipeSources::new("");
        let location = Location::find::<T>(name_or_path, Path::new(""))?;
        sources.name = location.name();
        sources.add(&location, &mut Vec::new())?;
        Ok(sources)
    }

    /// Reads a recipe from a reader, such as standard input. `file` is the recipe's name, also in errors.
    ///
    /// # Errors
    /// When the recipe or one that it extends cannot be read.
    pub fn read(file: &str, reader: impl Read) -> Result<RecipeSources<T>, Error> {
        RecipeSources::parse(file, &text_of::<T>(file, reader)?)
    }

    /// Parses the recipe in `text`. `file` is the recipe's name, also in errors.
    ///
    /// # Errors
    /// When the text is not TOML, or when a recipe that it extends cannot be read.
    pub fn parse(file: &str, text: &str) -> Result<RecipeSources<T>, Error> {
        let mut sources = RecipeSources::new(file);
        sources.add_text(file, text, Path::new(""), &mut Vec::new())?;
        Ok(sources)
    }

    /// Returns the recipe's short name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Sets one key on top of all texts. `setting` is `key=value`: the key with dots and indices (`noise[0].height_m`),
    /// the value as in TOML. `option` is the name of the setting in errors.
    ///
    /// # Errors
    /// When the setting is not of that form.
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
        // The short key `v` replaces the long one and keeps the value's position.
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

    /// Reads the recipe with every default filled in.
    ///
    /// # Errors
    /// When a key is unknown or missing, or when a value is out of its range; the error points at the place.
    pub fn read_all(&self) -> Result<T, Error> {
        self.read_with(|_| true)
    }

    /// Reads the recipe without the single settings.
    ///
    /// # Errors
    /// When a key is unknown or missing, or when a value is out of its range.
    pub fn read_unset(&self) -> Result<T, Error> {
        self.read_with(|source| source.key.is_none())
    }

    fn read_with(&self, counts: impl Fn(&Source) -> bool) -> Result<T, Error> {
        let merged = self.merged(counts)?;
        let point = |fault: Fault| {
            let (span, written) = locate(&merged, &fault);
            self.error(fault.sentence(written), span, &fault.hint)
        };
        schema::check_table(T::WHAT, &schema::of::<T>(), merged.get_ref()).map_err(point)?;
        T::check_written(merged.get_ref()).map_err(point)?;
        let DeValue::Table(table) = merged.get_ref() else { unreachable!("the root is a table") };
        let table = Spanned::new(merged.span(), table.clone());
        let mut recipe = T::deserialize(Deserializer::from(table))
            .map_err(|error| self.error(error.message().to_owned(), error.span().unwrap_or(0..0), ""))?;
        recipe.complete().map_err(point)?;
        Ok(recipe)
    }

    fn next_start(&self) -> usize {
        // Two bytes more, so that the position of one text's end is not the start of the next.
        self.texts.last().map_or(0, |last| last.start + last.text.len() + 2)
    }

    /// Adds a recipe after those that it extends. `within` holds the recipes that lead here through `extends`, to
    /// detect cycles.
    fn add(&mut self, location: &Location, within: &mut Vec<Location>) -> Result<(), Error> {
        within.push(location.clone());
        match location {
            Location::BuiltIn(name) => {
                self.add_text(&format!("{}/{name}.toml", T::FOLDER), built_in::<T>(name)?, Path::new(""), within)?;
            }
            Location::File { given, .. } => {
                let folder = given.parent().unwrap_or(Path::new(""));
                self.add_text(&given.to_string_lossy(), &read_text::<T>(given)?, folder, within)?;
            }
        }
        within.pop();
        Ok(())
    }

    fn add_text(&mut self, file: &str, text: &str, folder: &Path, within: &mut Vec<Location>) -> Result<(), Error> {
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
            // Faults inside the other file already name that file, so they pass unchanged.
            let there = |error: Error| match error {
                Error::Preset { message, source_place: None, hint } => {
                    refuse(&format!("extends: {message}"), base.span(), &hint)
                }
                error => error,
            };
            let location = Location::find::<T>(name, folder).map_err(there)?;
            if within.iter().any(|other| other.is(&location)) {
                let message = format!("extends: this {} extends itself", T::WHAT);
                return Err(refuse(&message, base.span(), "leave one of them out"));
            }
            self.add(&location, within).map_err(there)?;
        }
        let start = self.next_start();
        let padded = " ".repeat(start) + text;
        let (file, folder, text) = (file.to_owned(), folder.to_owned(), text.to_owned());
        self.texts.push(Source { file, folder, text, start, padded, key: None });
        Ok(())
    }

    /// Merges the texts for which `counts` is true into one table, in which every value has its position.
    fn merged(&self, counts: impl Fn(&Source) -> bool) -> Result<Spanned<DeValue<'_>>, Error> {
        // A key that is written nowhere is reported at the start of the recipe itself.
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

    /// Makes an error at a position of the imaginary text.
    fn error(&self, message: String, span: Range<usize>, hint: &str) -> Error {
        let source = self.texts.iter().rfind(|source| source.start <= span.start).expect("the first begins at 0");
        let span = span.start - source.start..span.end.saturating_sub(source.start);
        let place = SourcePlace::new(&source.file, &source.text, span);
        Error::Preset { message: clipped(&message), source_place: Some(Box::new(place)), hint: hint.to_owned() }
    }
}
