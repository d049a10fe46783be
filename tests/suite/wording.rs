//! The words of the command, as they were last read: `INSTA_UPDATE=always cargo test --profile quick --test suite --
//! wording` accepts others.

use crate::cli::small_with;
use crate::desk::Desk;

fn assert_worded(name: &str, text: &str) {
    insta::with_settings!({ prepend_module_to_snapshot => false, omit_expression => true }, {
        insta::assert_snapshot!(name, text);
    });
}

#[test]
fn the_help_of_each_command_is_as_read() {
    let desk = Desk::new();
    let help = desk.done(&["--help"]).stdout;
    assert_worded("terrane", &help);
    let list = help.split("Commands:\n").nth(1).and_then(|rest| rest.split("\n\n").next()).unwrap();
    let names = list.lines().filter_map(|line| line.strip_prefix("  ")).filter(|line| !line.starts_with(' '));
    let names: Vec<&str> = names.filter_map(|line| line.split(' ').next()).filter(|name| *name != "help").collect();
    assert!(names.len() > 20, "{names:?}");
    for name in names {
        assert_worded(name, &desk.done(&[name, "--help"]).stdout);
    }
}

#[test]
fn mistakes_are_refused_in_the_words_that_were_read() {
    let desk = Desk::new();
    let told = |line: &str| format!("$ terrane {line}\n{}\n", refused(&desk, &line.split(' ').collect::<Vec<_>>()));
    assert_worded("mistakes", &include_str!("mistakes.txt").lines().map(told).collect::<String>());
}

#[test]
fn bad_presets_are_refused_in_the_words_that_were_read() {
    let desk = Desk::new();
    // Each has a line of the small world, by number, replaced by another or by several.
    let told = |line: &str| {
        let (number, new) = line.split_once(' ').unwrap();
        desk.write("bad.toml", small_with(&[(number.parse().unwrap(), &new.replace("\\n", "\n"))]));
        format!("{}\n", refused(&desk, &["bake", "bad.toml", "--size", "1x1"]))
    };
    assert_worded("bad_presets", &include_str!("bad_lines.txt").lines().map(told).collect::<String>());
}

fn refused(desk: &Desk, words: &[&str]) -> String {
    let outcome = desk.refused(words, &[]);
    assert_eq!(outcome.stdout, "", "{words:?}");
    outcome.stderr
}
