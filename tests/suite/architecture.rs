//! The house has one staircase: a module imports only what stands above it in lib.rs, and whole crates stand above others.

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

/// The modules of a lib.rs, from the first to the last.
fn modules(text: &str) -> impl Iterator<Item = String> {
    let lines = text.lines().filter_map(|line| line.trim_start_matches("pub ").strip_prefix("mod "));
    lines.filter_map(|module| module.strip_suffix(';')).map(String::from)
}

#[test]
fn no_import_points_up() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let crates = ["crates/engine/src", "crates/output/src", "src"].map(|src| root.join(src));
    let modules: Vec<String> = crates
        .iter()
        .flat_map(|src| modules(&fs::read_to_string(src.join("lib.rs")).unwrap()).collect::<Vec<_>>())
        .collect();
    let floor = |module: &str| modules.iter().position(|known| known == module);
    assert!(modules.len() > 20 && floor("tile").is_some() && floor("tile") < floor("cli"), "{modules:?}");
    let mut seen = 0;
    for src in &crates {
        let mut files = Vec::new();
        sources(src, &mut files);
        for path in files {
            let inside = path.strip_prefix(src).unwrap();
            let own = inside.components().next().unwrap().as_os_str().to_str().unwrap().trim_end_matches(".rs");
            // Tests may load a preset to have a world to look at.
            if ["lib", "main"].contains(&own) || inside.ends_with("tests.rs") {
                continue;
            }
            let place = floor(own).unwrap_or_else(|| panic!("{} is in no module of lib.rs", inside.display()));
            let text = fs::read_to_string(&path).unwrap();
            let code = text.split("#[cfg(test)]").next().unwrap();
            for line in code.lines().filter(|line| !line.trim_start().starts_with("//")) {
                for used in line.split("crate::").skip(1) {
                    let name: String = used.chars().take_while(|it| it.is_alphanumeric() || *it == '_').collect();
                    let Some(other) = floor(&name) else { continue };
                    assert!(other <= place, "{} imports {name}, which stands below {own} in lib.rs", inside.display());
                    seen += 1;
                }
            }
        }
    }
    assert!(seen > 300, "{seen} imports");
}
