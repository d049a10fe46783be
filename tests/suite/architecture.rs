//! The house has one staircase: a module imports only what stands above it in lib.rs.

use std::fs;
use std::path::{Path, PathBuf};

/// All source files below a folder.
fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap().map(Result::unwrap) {
        let path = entry.path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
}

/// The modules of lib.rs, from the first to the last.
fn modules(text: &str) -> Vec<&str> {
    let lines = text.lines().filter_map(|line| line.trim_start_matches("pub ").strip_prefix("mod "));
    lines.filter_map(|module| module.strip_suffix(';')).collect()
}

#[test]
fn no_import_points_up() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let lib = fs::read_to_string(src.join("lib.rs")).unwrap();
    let modules = modules(&lib);
    assert!(modules.len() > 20 && modules.contains(&"tile"), "{modules:?}");
    let mut files = Vec::new();
    sources(&src, &mut files);
    let mut seen = 0;
    for path in files {
        let inside = path.strip_prefix(&src).unwrap();
        let own = inside.components().next().unwrap().as_os_str().to_str().unwrap().trim_end_matches(".rs");
        // Tests may load a preset to have a world to look at.
        if ["lib", "main"].contains(&own) || inside.ends_with("tests.rs") {
            continue;
        }
        let floor = modules.iter().position(|module| *module == own);
        let floor = floor.unwrap_or_else(|| panic!("{} is in no module of lib.rs", inside.display()));
        let text = fs::read_to_string(&path).unwrap();
        let code = text.split("#[cfg(test)]").next().unwrap();
        for line in code.lines().filter(|line| !line.trim_start().starts_with("//")) {
            for used in line.split("crate::").skip(1) {
                let name: String = used.chars().take_while(|it| it.is_alphanumeric() || *it == '_').collect();
                let Some(other) = modules.iter().position(|module| *module == name) else { continue };
                assert!(other <= floor, "{} imports {name}, which stands below {own} in lib.rs", inside.display());
                seen += 1;
            }
        }
    }
    assert!(seen > 300, "{seen} imports");
}
