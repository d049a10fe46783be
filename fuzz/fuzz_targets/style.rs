//! Any text is a style of maps or is refused with a place in it.
#![no_main]

use libfuzzer_sys::fuzz_target;
use terrane::error::Error;
use terrane::map::style::Style;
use terrane::recipe::source::RecipeSources;

fuzz_target!(|text: &str| {
    let read = RecipeSources::<Style>::parse("fuzz.toml", text).and_then(|sources| sources.read_all());
    if let Err(error) = read {
        assert!(matches!(error, Error::Preset { .. }), "{error:?}");
        assert_eq!(error.exit_code(), 2, "{error}");
    }
});
