//! The house has one staircase: a module imports only modules that stand above it in lib.rs, and whole crates stand above others. And
//! its documentation names things.

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
            for name in imported(&text) {
                let Some(other) = floor(&name) else { continue };
                assert!(other <= place, "{} imports {name}, which stands below {own} in lib.rs", inside.display());
                seen += 1;
            }
        }
    }
    assert!(seen > 300, "{seen} imports");
}

/// The names that follow `crate::` in the code of a file, without its comments and its inline tests.
fn imported(text: &str) -> Vec<String> {
    let code = text.split("#[cfg(test)]\nmod tests {").next().unwrap();
    let code: Vec<&str> = code.lines().filter(|line| !line.trim_start().starts_with("//")).collect();
    let name = |path: &str| path.trim_start().chars().take_while(|it| it.is_alphanumeric() || *it == '_').collect();
    let names = |used: &str| -> Vec<String> {
        let Some(list) = used.strip_prefix('{') else { return vec![name(used)] };
        // Braces within braces hold parts of a module.
        let mut depth = 0;
        let parts = list.split(|it| {
            depth += i32::from(it == '{') - i32::from(it == '}');
            (it == ',' && depth == 0) || depth < 0
        });
        let end = list.find(';').unwrap_or(list.len());
        parts.take_while(|part| part.as_ptr() as usize - (list.as_ptr() as usize) < end).map(name).collect()
    };
    code.join("\n").split("crate::").skip(1).flat_map(names).collect()
}

#[test]
fn imports_are_found_in_braces_and_beside_test_modules() {
    let text = "#[cfg(test)]\nmod faults;\nuse crate::{area::{Area, Place}, stop};\nuse crate::tile::Tile; // crate::late\n\
                /// crate::told\n#[cfg(test)]\nmod tests {\n    use crate::preset;\n}\n";
    assert_eq!(
        imported(text).into_iter().filter(|name| !name.is_empty()).collect::<Vec<_>>(),
        ["area", "stop", "tile", "late"]
    );
}

/// The most blocks of documentation, in a hundred, that may open with a word that names nothing. It may only fall.
const MOST_NAMELESS: f64 = 0.5;

#[test]
fn documentation_opens_with_the_thing() {
    const NAMELESS: [&str; 10] = ["What", "How", "Whether", "That", "Where", "Which", "Those", "Of", "Its", "Such"];
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut files = Vec::new();
    for src in ["crates/engine/src", "crates/output/src", "src"] {
        sources(&root.join(src), &mut files);
    }
    let (mut blocks, mut nameless) = (0, Vec::new());
    for path in files {
        let text = fs::read_to_string(&path).unwrap();
        let mut is_inside = false;
        for line in text.lines().map(str::trim_start) {
            let documentation = line.strip_prefix("/// ").or_else(|| line.strip_prefix("//! "));
            if let Some(first) = documentation.filter(|_| !is_inside) {
                blocks += 1;
                let word = first.split(|it: char| !it.is_alphanumeric()).next().unwrap_or_default();
                nameless.extend(NAMELESS.contains(&word).then(|| format!("{}: {first}", path.display())));
            }
            is_inside = line.starts_with("///") || line.starts_with("//!");
        }
    }
    let share = nameless.len() as f64 * 100.0 / f64::from(blocks);
    assert!(share <= MOST_NAMELESS, "{share:.1} of 100, with\n{}", nameless.join("\n"));
}
