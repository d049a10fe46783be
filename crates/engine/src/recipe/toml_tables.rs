//! Tables of TOML in which each value has its position: merging, changing and searching.

use std::borrow::Cow;
use std::ops::Range;
use std::path::Path;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::recipe::fault::{Fault, KeyPath, KeyStep};

/// Parses a key path such as `noise[0].height_m` or `noise.0.height_m`.
pub(super) fn key_path(text: &str) -> Option<KeyPath> {
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

/// Merges `new` over a value: tables key by key, all other values as a whole.
pub(super) fn merge<'a>(value: &mut Spanned<DeValue<'a>>, new: Spanned<DeValue<'a>>) {
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

/// Puts a folder before the name of a file: the text at a path of keys, if there is one. Recipes name files relative to
/// their own folder, but the program opens files relative to the current directory.
pub(super) fn name_from(table: &mut DeTable<'_>, keys: &[&str], folder: &Path) {
    let Some((key, rest)) = keys.split_first() else { return };
    match table.get_mut(*key).map(Spanned::get_mut) {
        Some(DeValue::Table(inner)) if !rest.is_empty() => name_from(inner, rest, folder),
        Some(DeValue::String(name)) => *name = Cow::Owned(folder.join(name.as_ref()).to_string_lossy().into_owned()),
        _ => {}
    }
}

/// Puts a value at a path of keys and indices. Missing tables are created, with `key` as their position.
pub(super) fn put<'a>(
    value: &mut Spanned<DeValue<'a>>,
    steps: &[KeyStep],
    key: &Range<usize>,
    new: Spanned<DeValue<'a>>,
) -> Result<(), String> {
    let Some((step, rest)) = steps.split_first() else {
        *value = new;
        return Ok(());
    };
    match (step, value.get_mut()) {
        (KeyStep::Key(name), DeValue::Table(table)) => {
            let mut inner = table
                .remove(name.as_str())
                .unwrap_or_else(|| Spanned::new(key.clone(), DeValue::Table(DeTable::new())));
            put(&mut inner, rest, key, new)?;
            table.insert(Spanned::new(key.clone(), Cow::Owned(name.clone())), inner);
            Ok(())
        }
        (KeyStep::Index(index), DeValue::Array(values)) => {
            let count = values.len();
            match values.get_mut(*index) {
                Some(inner) => put(inner, rest, key, new),
                None => Err(format!("there is no [{index}] in a list of {count}")),
            }
        }
        (KeyStep::Key(name), DeValue::Array(_)) => Err(format!("{name} is asked of a list, and it needs an index")),
        (KeyStep::Key(name), _) => Err(format!("{name} is asked of what is no table")),
        (KeyStep::Index(index), _) => Err(format!("[{index}] is asked of what is no list")),
    }
}

/// Returns the position of a fault, and true if the faulty value is written. If it is not, the position is that of the
/// setting which it contradicts, or else that of the nearest table that is written.
pub(super) fn locate(root: &Spanned<DeValue>, fault: &Fault) -> (Range<usize>, bool) {
    let (place, is_written) = find(root, &fault.path, fault.key_itself);
    match &fault.beside {
        Some(other) if !is_written => match find(root, other, false) {
            (other_place, true) => (other_place, false),
            (_, false) => (place, false),
        },
        _ => (place, is_written),
    }
}

/// Returns the position of a value, or of its key, and true if it is written. If it is not, the position is that of the
/// nearest enclosing table that is.
fn find(root: &Spanned<DeValue>, path: &KeyPath, key_itself: bool) -> (Range<usize>, bool) {
    let mut value = root;
    let mut key = root.span();
    for step in &path.0 {
        let next = match step {
            KeyStep::Key(name) => {
                value.get_ref().as_table().and_then(|table| table.get_key_value(name.as_str())).map(|(name, value)| {
                    key = name.span();
                    value
                })
            }
            KeyStep::Index(index) => value.get_ref().get(*index),
        };
        let Some(next) = next else { return (value.span(), false) };
        value = next;
    }
    (if key_itself { key } else { value.span() }, true)
}
