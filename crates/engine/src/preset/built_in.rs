//! The presets that the program brings along.

/// The built-in presets, as name and text: the files of `presets/`.
pub const BUILT_IN: &[(&str, &str)] = &[
    ("alps", include_str!(concat!(env!("TERRANE_PRESETS"), "/alps.toml"))),
    ("highlands", include_str!(concat!(env!("TERRANE_PRESETS"), "/highlands.toml"))),
    ("archipelago", include_str!(concat!(env!("TERRANE_PRESETS"), "/archipelago.toml"))),
    ("canyon", include_str!(concat!(env!("TERRANE_PRESETS"), "/canyon.toml"))),
    ("plains", include_str!(concat!(env!("TERRANE_PRESETS"), "/plains.toml"))),
    ("fjords", include_str!(concat!(env!("TERRANE_PRESETS"), "/fjords.toml"))),
    ("badlands", include_str!(concat!(env!("TERRANE_PRESETS"), "/badlands.toml"))),
    ("thesis", include_str!(concat!(env!("TERRANE_PRESETS"), "/thesis.toml"))),
    ("mountains", include_str!(concat!(env!("TERRANE_PRESETS"), "/mountains.toml"))),
    ("hills", include_str!(concat!(env!("TERRANE_PRESETS"), "/hills.toml"))),
];

/// The first line of a preset's text without its comment mark: what the preset shows.
pub fn summary(text: &str) -> &str {
    text.lines().next().unwrap_or_default().trim_start_matches('#').trim()
}
