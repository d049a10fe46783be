//! The presets that the program brings along.

use crate::error::{Error, nearest};

/// The built-in presets, as name and text: the files of `presets/`.
pub const BUILT_IN: &[(&str, &str)] = &[
    ("alps", include_str!("../../presets/alps.toml")),
    ("highlands", include_str!("../../presets/highlands.toml")),
    ("archipelago", include_str!("../../presets/archipelago.toml")),
    ("canyon", include_str!("../../presets/canyon.toml")),
    ("plains", include_str!("../../presets/plains.toml")),
    ("fjords", include_str!("../../presets/fjords.toml")),
    ("badlands", include_str!("../../presets/badlands.toml")),
    ("thesis", include_str!("../../presets/thesis.toml")),
    ("mountains", include_str!("../../presets/mountains.toml")),
    ("hills", include_str!("../../presets/hills.toml")),
];

/// The first line of a preset's text without its comment mark: what the preset shows.
pub fn summary(text: &str) -> &str {
    text.lines().next().unwrap_or_default().trim_start_matches('#').trim()
}

/// The text of a built-in preset.
///
/// # Errors
/// When there is none of that name; the hint lists the names.
pub fn built_in(name: &str) -> Result<&'static str, Error> {
    let names = BUILT_IN.iter().map(|(name, _)| *name);
    BUILT_IN.iter().find(|(known, _)| *known == name).map(|(_, text)| *text).ok_or_else(|| Error::Preset {
        message: format!("there is neither a file nor a built-in preset named {name:?}"),
        source_place: None,
        hint: match nearest(name, names.clone()) {
            Some(meant) => format!("did you mean {meant}? built-in presets: {}", names.collect::<Vec<_>>().join(", ")),
            None => format!("built-in presets: {}", names.collect::<Vec<_>>().join(", ")),
        },
    })
}
