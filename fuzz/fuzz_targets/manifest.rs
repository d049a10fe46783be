//! Any file is the manifest of a bake or is refused, and none leads a check or a clean out of its folder.
#![no_main]

use std::fs;

use libfuzzer_sys::fuzz_target;
use terrane::clock::Clock;
use terrane::export::{self, Manifest, Plan, Rebake};
use terrane::watch::Watch;

fuzz_target!(|bytes: &[u8]| {
    let root = tempfile::tempdir().unwrap();
    let folder = root.path().join("bake");
    fs::create_dir(&folder).unwrap();
    fs::write(root.path().join("victim"), "precious").unwrap();
    fs::write(folder.join("bake.json"), bytes).unwrap();
    if let Ok(manifest) = Manifest::read(&folder) {
        if let Ok(world) = manifest.world() {
            _ = Plan::of(&manifest, &world).map(drop);
        }
        _ = export::look(&folder);
        _ = export::check(&folder, Rebake::None, &Watch::default());
        _ = export::clean(&folder, false, &Clock::default());
    }
    assert_eq!(fs::read(root.path().join("victim")).unwrap(), b"precious");
});
