//! Any text is a preset or is refused with a place in it.
#![no_main]

use libfuzzer_sys::fuzz_target;
use terrane::error::Error;
use terrane::preset::Preset;

fuzz_target!(|text: &str| {
    if let Err(error) = Preset::parse("fuzz.toml", text) {
        assert!(matches!(error, Error::Preset { .. }), "{error:?}");
        assert_eq!(error.exit_code(), 2, "{error}");
    }
});
