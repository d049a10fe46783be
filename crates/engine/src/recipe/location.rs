//! Locations of recipes: built in or in a file, and the reading of their texts.

use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};

use crate::error::Error;
use crate::recipe::source::{Recipe, built_in};

/// Largest size of a recipe in bytes; a longer file is something else.
const MAX_BYTES: u64 = 1 << 20;

/// Location of a recipe.
#[derive(Clone, Debug)]
pub(super) enum Location {
    BuiltIn(&'static str),
    File { given: PathBuf, canonical: Option<PathBuf> },
}

impl Location {
    /// Finds a built-in recipe, or else a file with a path relative to a folder.
    pub fn find<T: Recipe>(name: &str, folder: &Path) -> Result<Location, Error> {
        if let Some((name, _)) = T::BUILT_IN.iter().find(|(known, _)| *known == name) {
            return Ok(Location::BuiltIn(name));
        }
        let given = folder.join(name);
        let canonical = fs::canonicalize(&given).ok();
        if canonical.is_none() && Path::new(name).components().count() == 1 && Path::new(name).extension().is_none() {
            built_in::<T>(name)?;
        }
        Ok(Location::File { given, canonical })
    }

    pub fn name(&self) -> String {
        match self {
            Location::BuiltIn(name) => (*name).to_owned(),
            Location::File { given, .. } => given.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
        }
    }

    pub fn is(&self, other: &Location) -> bool {
        match (self, other) {
            (Location::BuiltIn(one), Location::BuiltIn(other)) => one == other,
            (Location::File { canonical: one, .. }, Location::File { canonical: other, .. }) => {
                one.is_some() && one == other
            }
            _ => false,
        }
    }
}

/// Reads the text of a recipe's file.
pub(super) fn read_text<T: Recipe>(path: &Path) -> Result<String, Error> {
    let refuse = |message: String, hint: &str| {
        let message = format!("{}: {message}", path.display());
        Err(Error::Preset { message, source_place: None, hint: hint.into() })
    };
    match fs::metadata(path) {
        Ok(metadata) if metadata.is_dir() => refuse(format!("is a folder, not a {}", T::WHAT), "name the file in it"),
        Ok(_) => match fs::File::open(path) {
            Ok(file) => text_of::<T>(&path.to_string_lossy(), file),
            Err(error) => refuse(error.to_string(), ""),
        },
        Err(error) => {
            let hint = format!("name a {} file or a built-in {} (terrane {})", T::WHAT, T::WHAT, T::FOLDER);
            refuse(error.to_string(), &hint)
        }
    }
}

/// Reads the text from a reader, if it is valid UTF-8 and not too long.
pub(super) fn text_of<T: Recipe>(file: &str, reader: impl Read) -> Result<String, Error> {
    let refuse = |message: String, hint: &str| {
        Err(Error::Preset { message: format!("{file}: {message}"), source_place: None, hint: hint.into() })
    };
    let mut bytes = Vec::new();
    // One byte more than allowed is enough to tell that the text is too long, even from a device that never ends.
    if let Err(error) = reader.take(MAX_BYTES + 1).read_to_end(&mut bytes) {
        return refuse(error.to_string(), "");
    }
    if bytes.len() as u64 > MAX_BYTES {
        let hint = format!("a {} is a short TOML text", T::WHAT);
        return refuse(format!("is longer than 1 MiB, so it is no {}", T::WHAT), &hint);
    }
    String::from_utf8(bytes).or_else(|error| {
        let at = error.utf8_error().valid_up_to();
        let line = error.as_bytes()[..at].split(|&byte| byte == b'\n').count();
        refuse(format!("is not UTF-8 from byte {at} (line {line}) on"), "save it as UTF-8 text")
    })
}
