//! Tells the compiler where the styles of maps lie.
//!
//! They are at the top of the workspace, where people look for them. A package has them in itself, by a symbolic link,
//! since cargo packages no file from outside. Checkouts on Windows may have a text in the place of the link, so here
//! the top comes first.

use std::env;
use std::path::Path;

fn main() {
    let package = env::var("CARGO_MANIFEST_DIR").expect("cargo says where the package is");
    let top = Path::new(&package).join("../../styles");
    let styles = if top.is_dir() { top } else { Path::new(&package).join("styles") };
    println!("cargo:rustc-env=TERRANE_STYLES={}", styles.display());
    println!("cargo:rerun-if-changed=build.rs");
}
