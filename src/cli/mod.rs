//! The command: a thin layer over the library. Only here is anything printed.

mod args;
mod atlas;
mod bake;
mod completions;
mod console;
mod devices;
mod experiment;
#[cfg(feature = "explore")]
mod explore;
mod find;
mod info;
mod jobs;
mod map;
mod merge;
mod progress;
mod registry_list;
mod shard_plan;
mod signals;
mod verify;
mod walk;

use std::env;
use std::ffi::OsString;
use std::process::ExitCode;

use clap::{CommandFactory, Parser};
use serde_json::json;

use args::{Arguments, Command, MessageOptions, Schema};
use console::Console;

use crate::error::{Error, clipped};
use crate::export::Manifest;
use crate::map::style::Style;
use crate::preset::{self, Preset};
use crate::recipe::source::{self, Recipe};
use crate::simd::Level;
use crate::threads::{thread_count, thread_pool};

/// Runs the command that the program was called with.
///
/// The exit code is 0 on success, 2 for a mistake of the user's, 130 after an interrupt, otherwise 1.
pub fn run() -> ExitCode {
    if let Err(error) = check_words(env::args_os()) {
        let json = env::args_os().any(|word| word == "--json");
        Console::new(MessageOptions { json, ..MessageOptions::default() }).error(&error);
        return ExitCode::from(error.exit_code());
    }
    let arguments = Arguments::parse();
    let console = Console::new(arguments.messages);
    signals::listen(console.stop.clone());
    match run_command(arguments.command, &console) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            console.error(&error);
            ExitCode::from(error.exit_code())
        }
    }
}

/// Refuses arguments with control characters. Names, titles and paths are written to scripts, to files that other
/// programs read, and to terminals, where a line break could end a comment and begin a command.
fn check_words(words: impl Iterator<Item = OsString>) -> Result<(), Error> {
    let mut words = words.map(|word| word.to_string_lossy().into_owned());
    match words.find(|word| word.chars().any(char::is_control)) {
        None => Ok(()),
        Some(word) => Err(Error::Option {
            message: clipped(&format!("{word:?} has a control character, such as a line break or a tab")),
            hint: "leave it out; a setting of several lines goes into a preset file".into(),
        }),
    }
}

fn run_command(command: Command, console: &Console) -> Result<(), Error> {
    // Check the environment variable here: a bad value is reported as the user's mistake, not as a panic of a kernel.
    Level::chosen().map_err(|message| Error::Option { message, hint: String::new() })?;
    match command {
        Command::Bake(arguments) => bake::run(&arguments, console),
        Command::Tile(arguments) => bake::run(&arguments.into(), console),
        Command::Merge(arguments) => merge::run(&arguments, console),
        Command::ShardPlan(arguments) => shard_plan::run(arguments, console),
        Command::Map(arguments) => map::run(&arguments, console),
        Command::Atlas(arguments) => atlas::run(&arguments, console),
        Command::Find(arguments) => find::run(&arguments, console),
        #[cfg(feature = "explore")]
        Command::Explore(arguments) => explore::run(arguments, console),
        Command::Registry(arguments) => registry_list::run(&arguments, console),
        Command::Walk(arguments) => walk::run(&arguments, console),
        Command::Extend(arguments) => bake::extend(&arguments, console),
        Command::Info { folder } => info::run(&folder, console),
        Command::Verify(arguments) => verify::run(&arguments, console),
        Command::Repair { folder, threads } => verify::repair(&folder, threads, console),
        Command::Clean { folder, dry_run } => verify::clean(&folder, dry_run, console),
        Command::Devices => devices::run(console),
        Command::Experiment(arguments) => experiment::run(arguments, console),
        Command::Presets { name } => print_built_in::<Preset>(name, console),
        Command::Styles { name } => print_built_in::<Style>(name, console),
        Command::Schema { of } => {
            let schema = match of {
                Schema::Bake => Manifest::schema().to_value(),
                Schema::Preset => Preset::schema(),
                Schema::Style => Style::schema(),
            };
            let text = serde_json::to_string_pretty(&schema).expect("a schema is JSON") + "\n";
            console.message(schema, &text)
        }
        Command::Completions { shell } => {
            let text = completions::script(shell);
            console.message(json!({ "shell": shell.to_string(), "text": text }), &text)
        }
        Command::Man => {
            let mut page = Vec::new();
            let render = |command: clap::Command, page: &mut Vec<u8>| clap_mangen::Man::new(command).render(page);
            let mut command = Arguments::command();
            // `build` gives subcommands their full names and inherited options.
            command.build();
            render(command.clone(), &mut page).expect("a Vec takes everything");
            // Leave out `help`: its page would list all the other subcommands again.
            for subcommand in command.get_subcommands().filter(|subcommand| subcommand.get_name() != "help") {
                render(subcommand.clone(), &mut page).expect("a Vec takes everything");
            }
            let text = String::from_utf8(page).expect("a page is text");
            console.message(json!({ "text": text }), &text)
        }
    }
}

/// Prints a built-in recipe, or the list of all without a name.
fn print_built_in<R: Recipe>(name: Option<String>, console: &Console) -> Result<(), Error> {
    if let Some(name) = name {
        let text = source::built_in::<R>(&name)?;
        return console.message(json!({ "name": name, "about": preset::summary(text), "text": text }), text);
    }
    R::BUILT_IN.iter().try_for_each(|(name, text)| {
        let about = preset::summary(text);
        console.message(json!({ "name": name, "about": about }), &format!("{name:12} {about}\n"))
    })
}
