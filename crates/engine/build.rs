//! Tells the compiler where presets and shaders lie.
//!
//! They are at the top of the workspace, where people look for them. A package has them in itself, by symbolic links,
//! since cargo packages no file from outside. Checkouts on Windows may have a text in the place of a link, so here the
//! top comes first.

use std::env;
use std::path::Path;

fn main() {
    let package = env::var("CARGO_MANIFEST_DIR").expect("cargo says where the package is");
    for (folder, variable) in [("presets", "TERRANE_PRESETS"), ("shaders", "TERRANE_SHADERS")] {
        let top = Path::new(&package).join("../..").join(folder);
        let place = if top.is_dir() { top } else { Path::new(&package).join(folder) };
        println!("cargo:rustc-env={variable}={}", place.display());
    }
    println!("cargo:rerun-if-changed=build.rs");
}
