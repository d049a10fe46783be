//! Completion scripts of shells.

use clap::{Arg, CommandFactory};
use clap_complete::Shell;

use crate::cli::args::{Arguments, built_in_names};
use crate::preset::Preset;

/// Returns a shell's script that completes the command's options and the names that they take.
///
/// A preset is a built-in name or a file. Bash completes both by itself; in zsh the files are added here, in fish the
/// names, as those of all that is no option.
pub(super) fn script(shell: Shell) -> String {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Arguments::command(), "terrane", &mut script);
    let script = String::from_utf8(script).expect("scripts are text");
    match shell {
        Shell::Zsh => {
            let names = built_in_names::<Preset>().join(" ");
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
        Shell::Fish => Arguments::command().get_subcommands().fold(script, |script, command| {
            let known = command.get_positionals().flat_map(Arg::get_possible_values);
            let names: Vec<String> = known.map(|value| value.get_name().to_owned()).collect();
            let (command, names) = (command.get_name(), names.join(" "));
            match names.is_empty() {
                true => script,
                false => format!(
                    "{script}complete -c terrane -n \"__fish_terrane_using_subcommand {command}\" -a \"{names}\"\n"
                ),
            }
        }),
        _ => script,
    }
}
