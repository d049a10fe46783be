//! The built-in presets.

/// Names and texts of the built-in presets: the files of `presets/`.
pub const BUILT_IN: &[(&str, &str)] = &[
    ("alps", include_str!(concat!(env!("TERRANE_PRESETS"), "/alps.toml"))),
    ("highlands", include_str!(concat!(env!("TERRANE_PRESETS"), "/highlands.toml"))),
    ("archipelago", include_str!(concat!(env!("TERRANE_PRESETS"), "/archipelago.toml"))),
    ("canyon", include_str!(concat!(env!("TERRANE_PRESETS"), "/canyon.toml"))),
    ("plains", include_str!(concat!(env!("TERRANE_PRESETS"), "/plains.toml"))),
    ("fjords", include_str!(concat!(env!("TERRANE_PRESETS"), "/fjords.toml"))),
    ("badlands", include_str!(concat!(env!("TERRANE_PRESETS"), "/badlands.toml"))),
    ("world", include_str!(concat!(env!("TERRANE_PRESETS"), "/world.toml"))),
    ("thesis", include_str!(concat!(env!("TERRANE_PRESETS"), "/thesis.toml"))),
    ("mountains", include_str!(concat!(env!("TERRANE_PRESETS"), "/mountains.toml"))),
    ("hills", include_str!(concat!(env!("TERRANE_PRESETS"), "/hills.toml"))),
];

/// Returns the first line of a preset's text without its comment mark, which describes the preset.
pub fn summary(text: &str) -> &str {
    text.lines().next().unwrap_or_default().trim_start_matches('#').trim()
}
