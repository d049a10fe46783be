//! The built-in presets.

/// Names and texts of the built-in presets: the files of `presets/`.
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

/// Returns the first line of a preset's text without its comment mark, which describes the preset.
pub fn summary(text: &str) -> &str {
    text.lines().next().unwrap_or_default().trim_start_matches('#').trim()
}
