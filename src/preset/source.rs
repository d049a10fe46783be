//! Where a preset is written: its text, those that it extends, and settings on top, read with errors that point there.

use std::borrow::Cow;
use std::fs;
use std::io::Read;
use std::ops::Range;
use std::path::{Path, PathBuf};

use serde::Deserialize;

use toml::Spanned;
use toml::de::{DeTable, DeValue, Deserializer};

use crate::error::{Error, SourcePlace, clipped};
use crate::preset::{BUILT_IN, Preset, built_in};
use crate::recipe::fault::{Fault, KeyPath, Step};
use crate::recipe::form;

/// No preset is longer than this; a longer file is something else.
const MAX_PRESET_BYTES: u64 = 1 << 20;

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

/// Where a preset is found.
#[derive(Clone, Debug)]
enum Origin {
    BuiltIn(&'static str),
    File { given: PathBuf, canonical: Option<PathBuf> },
}

impl Origin {
    /// A built-in preset, or else a file, as named from a folder.
    fn find(name: &str, folder: &Path) -> Result<Origin, Error> {
        if let Some((name, _)) = BUILT_IN.iter().find(|(known, _)| *known == name) {
            return Ok(Origin::BuiltIn(name));
        }
        let given = folder.join(name);
        let canonical = fs::canonicalize(&given).ok();
        if canonical.is_none() && Path::new(name).components().count() == 1 && Path::new(name).extension().is_none() {
            built_in(name)?;
        }
        Ok(Origin::File { given, canonical })
    }

    fn name(&self) -> String {
        match self {
            Origin::BuiltIn(name) => (*name).to_owned(),
            Origin::File { given, .. } => given.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
        }
    }

    fn is(&self, other: &Origin) -> bool {
        match (self, other) {
            (Origin::BuiltIn(one), Origin::BuiltIn(other)) => one == other,
            (Origin::File { canonical: one, .. }, Origin::File { canonical: other, .. }) => {
                one.is_some() && one == other
            }
            _ => false,
        }
    }
}

/// Keys that nothing reads unless another one is written too.
const NEEDS: &[(&str, &str)] = &[
    ("fluvial.coast", "sea_level_m"),
    ("ground.sand_m", "sea_level_m"),
    ("ground.snow_slope", "ground.snow_m"),
    ("ground.snow_aspect_m", "ground.snow_m"),
];

fn check_needs(root: &DeValue) -> Result<(), Fault> {
    let path = |keys: &str| keys.split('.').fold(KeyPath::default(), |path, key| path.key(key));
    let is_written =
        |keys: &str| keys.split('.').try_fold(root, |value, key| value.get(key).map(Spanned::get_ref)).is_some();
    match NEEDS.iter().find(|(key, needed)| is_written(key) && !is_written(needed)) {
        Some((key, needed)) => {
            let hint = format!("give {needed}, or leave it out");
            Err(path(key).fault(format!("nothing reads it without {needed}"), hint).at_key())
        }
        None => Ok(()),
    }
}

/// The keys of `noise[0].height_m` or `noise.0.height_m`.
fn key_path(text: &str) -> Option<KeyPath> {
    let mut path = KeyPath::default();
    for part in text.trim().split('.') {
        let mut names = part.split('[');
        let name =
            names.next().filter(|name| name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-'))?;
        path = match name.parse() {
            Ok(index) => path.index(index),
            Err(_) if name.is_empty() => return None,
            Err(_) => path.key(name),
        };
        for index in names {
            path = path.index(index.strip_suffix(']')?.parse().ok()?);
        }
    }
    Some(path)
}

/// Lets `new` come over what is there: table by table, all else whole.
fn merge<'a>(value: &mut Spanned<DeValue<'a>>, new: Spanned<DeValue<'a>>) {
    let span = new.span();
    match (value.get_mut(), new.into_inner()) {
        (DeValue::Table(table), DeValue::Table(new)) => {
            let mut old = std::mem::take(table);
            for (key, mut new) in new {
                if let Some(mut merged) = old.remove(key.get_ref().as_ref()) {
                    merge(&mut merged, new);
                    new = merged;
                }
                old.insert(key, new);
            }
            *value = Spanned::new(span, DeValue::Table(old));
        }
        (_, new) => *value = Spanned::new(span, new),
    }
}

/// Puts a value at a path of keys and indices; tables that are not there are made, and begin at `key`.
fn put<'a>(
    value: &mut Spanned<DeValue<'a>>,
    steps: &[Step],
    key: &Range<usize>,
    new: Spanned<DeValue<'a>>,
) -> Result<(), String> {
    let Some((step, rest)) = steps.split_first() else {
        *value = new;
        return Ok(());
    };
    match (step, value.get_mut()) {
        (Step::Key(name), DeValue::Table(table)) => {
            let mut inner = table
                .remove(name.as_str())
                .unwrap_or_else(|| Spanned::new(key.clone(), DeValue::Table(DeTable::new())));
            put(&mut inner, rest, key, new)?;
            table.insert(Spanned::new(key.clone(), Cow::Owned(name.clone())), inner);
            Ok(())
        }
        (Step::Index(index), DeValue::Array(values)) => {
            let count = values.len();
            match values.get_mut(*index) {
                Some(inner) => put(inner, rest, key, new),
                None => Err(format!("there is no [{index}] in a list of {count}")),
            }
        }
        (Step::Key(name), DeValue::Array(_)) => Err(format!("{name} is asked of a list, and it needs an index")),
        (Step::Key(name), _) => Err(format!("{name} is asked of what is no table")),
        (Step::Index(index), _) => Err(format!("[{index}] is asked of what is no list")),
    }
}

/// Where a fault is, and whether its value is written at all; if not, the place is the nearest table that is.
fn locate(root: &Spanned<DeValue>, fault: &Fault) -> (Range<usize>, bool) {
    let mut value = root;
    let mut key = root.span();
    for step in &fault.path.0 {
        let next = match step {
            Step::Key(name) => {
                value.get_ref().as_table().and_then(|table| table.get_key_value(name.as_str())).map(|(name, value)| {
                    key = name.span();
                    value
                })
            }
            Step::Index(index) => value.get_ref().get(*index),
        };
        let Some(next) = next else { return (value.span(), false) };
        value = next;
    }
    (if fault.key_itself { key } else { value.span() }, true)
}

/// The text of a preset file.
fn read_text(path: &Path) -> Result<String, Error> {
    let refuse = |message: String, hint: &str| {
        let message = format!("{}: {message}", path.display());
        Err(Error::Preset { message, source_place: None, hint: hint.into() })
    };
    match fs::metadata(path) {
        Ok(metadata) if metadata.is_dir() => refuse("is a folder, not a preset".into(), "name the file in it"),
        Ok(_) => match fs::File::open(path) {
            Ok(file) => text_of(&path.to_string_lossy(), file),
            Err(error) => refuse(error.to_string(), ""),
        },
        Err(error) => refuse(error.to_string(), "name a preset file or a built-in preset (terrane presets)"),
    }
}

/// The text that a reader gives, if it is one.
fn text_of(file: &str, reader: impl Read) -> Result<String, Error> {
    let refuse = |message: String, hint: &str| {
        Err(Error::Preset { message: format!("{file}: {message}"), source_place: None, hint: hint.into() })
    };
    let mut bytes = Vec::new();
    // One byte more than allowed is enough to know, even of a device that never ends.
    if let Err(error) = reader.take(MAX_PRESET_BYTES + 1).read_to_end(&mut bytes) {
        return refuse(error.to_string(), "");
    }
    if bytes.len() as u64 > MAX_PRESET_BYTES {
        return refuse("is longer than 1 MiB, so it is no preset".into(), "a preset is a short TOML text");
    }
    String::from_utf8(bytes).or_else(|error| {
        let at = error.utf8_error().valid_up_to();
        let line = error.as_bytes()[..at].split(|&byte| byte == b'\n').count();
        refuse(format!("is not UTF-8 from byte {at} (line {line}) on"), "save it as UTF-8 text")
    })
}
