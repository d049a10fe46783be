//! The house has one staircase: a module imports only modules that stand above it in lib.rs, and whole crates stand
//! above others. Its documentation names things, a name of a type has one meaning, and lists of files and words are
//! true.

use std::collections::{BTreeMap, BTreeSet};
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

/// All source files of the three crates.
fn all_sources() -> Vec<PathBuf> {
    let mut files = Vec::new();
    for src in ["crates/engine/src", "crates/output/src", "src"] {
        sources(&Path::new(env!("CARGO_MANIFEST_DIR")).join(src), &mut files);
    }
    files
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
    let (mut blocks, mut nameless) = (0, Vec::new());
    for path in all_sources() {
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

#[test]
fn a_type_name_has_one_meaning() {
    let mut names: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for path in all_sources().into_iter().filter(|path| !path.ends_with("tests.rs")) {
        let text = fs::read_to_string(&path).unwrap();
        let file = path.strip_prefix(env!("CARGO_MANIFEST_DIR")).unwrap().display().to_string();
        for name in defined(&text) {
            names.entry(name).or_default().push(file.clone());
        }
    }
    assert!(names.len() > 500, "{} names", names.len());
    names.retain(|_, files| files.len() > 1);
    let double: Vec<String> = names.iter().map(|(name, files)| format!("{name}: {}", files.join(", "))).collect();
    assert!(double.is_empty(), "names that stand for more than one type:\n{}", double.join("\n"));
}

#[test]
fn a_word_of_the_glossary_names_one_type_or_module() {
    let text = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("src/lib.rs")).unwrap();
    let rows = text.lines().filter_map(|line| line.strip_prefix("//! | [")?.split_once(']'));
    let mut words = BTreeSet::new();
    for (word, row) in rows {
        // Without a target in parentheses, the word itself is the link.
        let target = row.strip_prefix('(').map_or(word, |row| row.split(')').next().unwrap());
        let name = target.rsplit("::").next().unwrap();
        // The link in the documentation proves that there is such a type or module.
        assert_eq!(word, name.to_lowercase());
        assert!(words.insert(word), "{word} has two rows");
    }
    assert!((20..=35).contains(&words.len()), "{} words", words.len());
}

#[test]
fn contributing_names_each_test_file() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let text = fs::read_to_string(root.join("CONTRIBUTING.md")).unwrap();
    for folder in ["tests", "tests/suite", "tests/heap"] {
        for entry in fs::read_dir(root.join(folder)).unwrap().map(Result::unwrap).filter(|it| it.path().is_file()) {
            let name = entry.file_name().into_string().unwrap();
            assert!(text.contains(&format!("`{name}`")), "CONTRIBUTING.md does not tell what {folder}/{name} is for");
        }
    }
}

/// The names of the types and traits that a file defines outside its inline tests. An indented `type` belongs to a
/// trait.
fn defined(text: &str) -> Vec<String> {
    let code = text.split("mod tests {").next().unwrap();
    let names = code.lines().filter_map(|line| {
        let mut words = line.split_whitespace().skip_while(|word| word.starts_with("pub"));
        let kind = words.find(|word| *word != "unsafe")?;
        let is_type =
            ["struct", "enum", "union", "trait"].contains(&kind) || (kind == "type" && !line.starts_with(' '));
        // Macros name their types by a variable.
        let name = words.next().filter(|name| is_type && !name.starts_with('$'))?;
        Some(name.chars().take_while(|it| it.is_alphanumeric()).collect())
    });
    names.collect()
}

#[test]
fn types_are_found_wherever_they_are_defined() {
    let text = "pub(super) struct Area<T>(T);\nunsafe trait Lane {\n    type Mask;\n}\ntype Spot = [i64; 2];\n\
                // enum Gone {\nfn make() {\n    enum Inner {}\n}\nmod tests {\n    struct Fake;\n}\n";
    assert_eq!(defined(text), ["Area", "Lane", "Spot", "Inner"]);
}
