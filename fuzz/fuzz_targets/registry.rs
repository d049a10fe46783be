//! Any file is a tile registry or is refused, whatever of it is damaged.
#![no_main]

use std::fs;

use libfuzzer_sys::fuzz_target;
use terrane::area::TileId;
use terrane::registry::{FILE_NAME, Registry};

fuzz_target!(|bytes: &[u8]| {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(FILE_NAME);
    fs::write(&path, bytes).unwrap();
    let Ok(registry) = Registry::read(&path) else { return };
    _ = registry.tiles();
    _ = registry.row(TileId { x: 0, y: 0 });
    _ = registry.for_each(|_| Ok(()));
    _ = registry.for_each_file(|_| Ok(()));
});
