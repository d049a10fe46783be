//! Saving a world of the page as a preset file.

use std::path::Path;

use axum::http::StatusCode;
use toml::{Table, Value};

use crate::error::Error;
use crate::explore::request::Failure;
use crate::explore::worlds::Opened;
use crate::file::write_whole;
use crate::preset::Preset;

/// Largest number of letters of a preset's name.
const MOST_LETTERS: usize = 64;

/// Writes a world's preset into the folder that the explorer was started in, and returns the name of the file.
///
/// # Errors
/// When the name is not valid, when there is a file of this name and `overwrite` is false, or when the file cannot be
/// written.
pub(super) fn save(opened: &Opened, name: &str, overwrite: bool) -> Result<String, Failure> {
    let is_plain = |letter: char| letter.is_ascii_alphanumeric() || letter == '-' || letter == '_';
    if name.is_empty() || name.len() > MOST_LETTERS || !name.chars().all(is_plain) {
        let hint = format!("up to {MOST_LETTERS} letters, digits, - and _");
        return Err(Failure::new(StatusCode::BAD_REQUEST, format!("{name:?} is no name for a preset"), hint));
    }
    let file = format!("{name}.toml");
    if Path::new(&file).exists() && !overwrite {
        return Err(Failure::new(
            StatusCode::CONFLICT,
            format!("{file} is there already"),
            "replace it, or take another name",
        ));
    }
    let text = text(opened)?;
    write_whole(file.clone().into(), text.as_bytes())?;
    Ok(file)
}

/// Returns the text of a preset that makes the world: the preset that it extends, and the settings on top.
fn text(opened: &Opened) -> Result<String, Error> {
    let wanted = Preset { seed: opened.world.seed(), ..opened.preset.clone() };
    let text = extending(opened, &wanted).map(|text| format!("# {}, with changes\n{text}", opened.name));
    let is_it = |text: &String| Preset::parse("saved", text).is_ok_and(|preset| preset == wanted);
    text.filter(is_it).ok_or_else(|| Error::Option {
        message: "no preset file can say what is set here".into(),
        hint: "a seed in a file is below 2^63".into(),
    })
}

fn extending(opened: &Opened, wanted: &Preset) -> Option<String> {
    let mut root = Table::new();
    root.insert("extends".into(), opened.source.clone().into());
    if let Some(seed) = opened.recipe.seed {
        root.insert("seed".into(), i64::try_from(seed).ok()?.into());
    }
    for setting in &opened.recipe.set {
        if let Ok(parsed) = toml::from_str(setting) {
            merge(&mut root, parsed);
            continue;
        }
        // A key with an index cannot stand in a TOML table, so write the whole list, with the setting in it.
        let (list, _) = setting.split_once(['[', '.', '='])?;
        let all = Table::try_from(Preset { seed: 0, ..wanted.clone() }).ok()?;
        root.insert(list.to_owned(), all.get(list)?.clone());
    }
    toml::to_string(&root).ok()
}

fn merge(into: &mut Table, from: Table) {
    for (key, value) in from {
        match (into.get_mut(&key), value) {
            (Some(Value::Table(known)), Value::Table(new)) => merge(known, new),
            (_, value) => _ = into.insert(key, value),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::explore::worlds::{Given, WorldRecipe, Worlds};
    use crate::memory::Budget;

    #[test]
    fn a_saved_preset_makes_the_same_world() {
        for (preset, seed, set) in [
            ("alps", None, vec![]),
            ("alps", Some(7), vec!["fluvial.ceiling_m=2000", "fluvial.runoff_m=1", "spacing_m=8"]),
            ("thesis", None, vec!["noise[0].height_m=300", "spacing_m=2"]),
        ] {
            let worlds =
                Worlds::new(Given { preset: preset.into(), seed: None, set: Vec::new() }, Budget::new(1 << 20));
            let set: Vec<String> = set.into_iter().map(str::to_owned).collect();
            let opened = worlds.open(&WorldRecipe { preset: preset.into(), seed, set }).unwrap();
            let text = text(&opened).unwrap();
            assert!(text.contains(&format!("extends = \"{preset}\"")) && text.lines().count() < 30, "{text}");
            let saved = Preset::parse("saved", &text).unwrap();
            assert_eq!(saved, Preset { seed: opened.world.seed(), ..opened.preset.clone() });
        }
    }

    #[test]
    fn a_seed_that_no_file_can_have_is_refused() {
        let worlds =
            Worlds::new(Given { preset: "thesis".into(), seed: Some(u64::MAX), set: Vec::new() }, Budget::new(1 << 20));
        assert!(text(&worlds.open(&worlds.first()).unwrap()).is_err());
    }

    #[test]
    fn names_stay_in_the_folder() {
        let worlds = Worlds::new(Given { preset: "thesis".into(), seed: None, set: Vec::new() }, Budget::new(1 << 20));
        let opened = worlds.open(&worlds.first()).unwrap();
        for name in ["", "..", "../x", "a/b", "a\\b", "a.b", "ä", "a b", &"a".repeat(65)] {
            assert_eq!(save(&opened, name, true).unwrap_err().status, StatusCode::BAD_REQUEST, "{name}");
        }
    }
}
