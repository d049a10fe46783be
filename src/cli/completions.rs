//! Completion scripts of shells.

use clap::CommandFactory;
use clap_complete::Shell;

use crate::cli::args::{Arguments, preset_names};

/// Returns a shell's script that completes the command's options and the names that they take.
///
/// A preset is a built-in name or a file. Bash completes both by itself; in zsh the files are added here, in fish the
/// names.
pub(super) fn script(shell: Shell) -> String {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Arguments::command(), "terrane", &mut script);
    let script = String::from_utf8(script).expect("scripts are text");
    let names = preset_names().join(" ");
    match shell {
        Shell::Zsh => {
            let both = format!(
                "#compdef terrane\n\n_terrane_preset() {{\n    _alternative 'presets:preset:({names})' 'files:file:_files'\n}}\n"
            );
            // Only for arguments that take a file: `presets` prints only built-in presets.
            let lines = script.lines().map(|line| match line.starts_with("':preset -- ") {
                true => line.replace(&format!(":({names})'"), ":_terrane_preset'"),
                false => line.to_owned(),
            });
            lines.collect::<Vec<_>>().join("\n").replacen("#compdef terrane\n", &both, 1) + "\n"
        }
        Shell::Fish => ["bake", "tile", "presets"].iter().fold(script, |script, command| {
            format!("{script}complete -c terrane -n \"__fish_terrane_using_subcommand {command}\" -a \"{names}\"\n")
        }),
        _ => script,
    }
}
