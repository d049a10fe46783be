//! The command line, a file a command. The help, the completions and the man page are made from it.

mod atlas;
mod bake;
mod experiment;
#[cfg(feature = "explore")]
mod explore;
mod find;
mod folder;
mod map;
mod place;
mod shard_plan;
mod shared;
mod values;
mod walk;

use std::ffi::OsStr;
use std::path::PathBuf;

use clap::builder::{PossibleValue, StringValueParser, TypedValueParser};
use clap::{Arg, Parser, Subcommand, ValueEnum};

pub use atlas::{AtlasArguments, AtlasFormat};
pub use bake::{AskedRange, BakeArguments, ExtendArguments, MergeArguments, TileArguments, WriteArguments};
pub use experiment::{ExperimentArguments, StepSize, Switch};
#[cfg(feature = "explore")]
pub use explore::ExploreArguments;
pub use find::FindArguments;
pub use folder::{RegistryArguments, Started, VerifyArguments};
pub use map::{MapArguments, StyleArguments};
pub use shard_plan::{Scheduler, ShardPlanArguments};
pub use shared::{FolderArguments, Manner, MessageOptions, RunOptions, ThreadOptions, WorldArguments};
pub use walk::WalkArguments;

use crate::map::style::Style;
use crate::preset::Preset;
use crate::recipe::source::Recipe;

/// Bakes endless procedural terrain, offline, into maps and assets.
#[derive(Parser)]
#[command(name = "terrane", version, max_term_width = 100)]
pub struct Arguments {
    #[command(subcommand)]
    pub command: Command,
    #[command(flatten)]
    pub messages: MessageOptions,
}

#[derive(Subcommand)]
pub enum Command {
    /// Bake a region of a world into a folder.
    Bake(BakeArguments),
    /// Bake one tile alone: the same bytes as in any region.
    Tile(TileArguments),
    /// Merge the shards of a bake. The result has the same bytes as if one machine had baked all of it.
    Merge(MergeArguments),
    /// Print a job that bakes in shards on many machines, for a job scheduler: each shard, which may be repeated as
    /// often as needed, and then the merge.
    ShardPlan(ShardPlanArguments),
    /// Draw a map of a part of a world: relief, contours, waters, roads, places and names, at any scale.
    Map(MapArguments),
    /// Draw an atlas: sheets side by side with an index and a gazetteer of all names, as pictures and as one document.
    Atlas(AtlasArguments),
    /// Find the nearest lakes, peaks, rivers and places with the properties you want, or continents, seas, deserts and
    /// climates of a whole world, each with the command that bakes it.
    Find(FindArguments),
    /// Look around in an endless world, on a page in your browser that is drawn as you look, at any scale and in any
    /// style. The page finds places, shows them in three dimensions, changes the preset, and bakes what you mark.
    #[cfg(feature = "explore")]
    Explore(ExploreArguments),
    /// Walk through endless terrain as in the thesis, and bake each tile as the walker comes to it. Rivers and roads
    /// continue from tile to tile, and depend on the way.
    Walk(WalkArguments),
    /// List the tile registry of a bake: where rivers and roads start, hashes and files. Works on a bake that is under
    /// way or was cut off, too.
    Registry(RegistryArguments),
    /// Check a bake: every file against its hash, the edges of tiles, the registry, and some tiles by baking them
    /// again.
    Verify(VerifyArguments),
    /// Extend a bake to a larger region. The old tiles' files stay as they are; files of the region are made anew.
    Extend(ExtendArguments),
    /// Describe the folder of a bake: world, place, heights, files, runs, and what is missing.
    Info {
        /// Folder of the bake.
        #[arg(value_name = "DIR")]
        folder: PathBuf,
    },
    /// Repair a bake: bake damaged and missing files again, with their original bytes. A damaged file is renamed and
    /// kept, for somebody may have changed it.
    Repair {
        /// Folder of the bake.
        #[arg(value_name = "DIR")]
        folder: PathBuf,
        #[command(flatten)]
        threads: ThreadOptions,
    },
    /// Remove the files of a bake from a folder, and nothing else.
    Clean {
        /// Folder of the bake.
        #[arg(value_name = "DIR")]
        folder: PathBuf,
        /// Print what would be done, and do nothing.
        #[arg(long)]
        dry_run: bool,
    },
    /// List the devices that can compute land: the CPU and all GPUs, with their limits, and whether they give the same
    /// bits.
    Devices,
    /// Time how the terrain expands before a walking camera, and compare with the thesis' figures.
    Experiment(ExperimentArguments),
    /// List the built-in presets, or print one to start from.
    Presets {
        /// The preset to print.
        #[arg(value_parser = Named(built_in_names::<Preset>), hide_possible_values = true)]
        name: Option<String>,
    },
    /// List the built-in styles of maps, or print one to start from.
    Styles {
        /// The style to print.
        #[arg(value_parser = Named(built_in_names::<Style>), hide_possible_values = true)]
        name: Option<String>,
    },
    /// Print the JSON schema of a file: of bake.json, or of a preset or a style with all its keys.
    Schema {
        /// The file.
        #[arg(default_value = "bake")]
        of: Schema,
    },
    /// Print a shell's completion script.
    Completions {
        /// The shell.
        shell: clap_complete::Shell,
    },
    /// Print the manual page.
    Man,
}

#[derive(Clone, Copy, ValueEnum)]
pub enum Schema {
    /// The manifest that a bake leaves.
    Bake,
    /// A preset.
    Preset,
    /// A style of maps.
    Style,
}

/// Takes any text; completions offer the known names. Other texts are checked where the option is read.
#[derive(Clone)]
struct Named(fn() -> Vec<&'static str>);

impl TypedValueParser for Named {
    type Value = String;

    fn parse_ref(&self, command: &clap::Command, arg: Option<&Arg>, value: &OsStr) -> Result<String, clap::Error> {
        StringValueParser::new().parse_ref(command, arg, value)
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        Some(Box::new((self.0)().into_iter().map(PossibleValue::new)))
    }
}

/// Returns the names of the built-in recipes of a kind.
pub fn built_in_names<R: Recipe>() -> Vec<&'static str> {
    R::BUILT_IN.iter().map(|(name, _)| *name).collect()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use clap::CommandFactory;

    use super::*;

    /// Options that mean something of their own in one command, which is given too.
    const OTHERS: [(&str, &str); 7] = [
        // A walk has no region, a map is one file, and a registry is asked for one export.
        ("walk", "at"),
        ("map", "out"),
        ("registry", "export"),
        // An experiment compares several.
        ("experiment", "device"),
        ("experiment", "layers"),
        ("experiment", "threads"),
        ("experiment", "workgroup"),
    ];

    #[test]
    fn an_option_means_one_thing_in_all_commands() {
        let mut arguments = Arguments::command();
        arguments.build();
        let mut meanings: BTreeMap<String, BTreeMap<_, Vec<&str>>> = BTreeMap::new();
        for command in arguments.get_subcommands() {
            for arg in command.get_arguments() {
                let Some(long) = arg.get_long().filter(|long| !OTHERS.contains(&(command.get_name(), long))) else {
                    continue;
                };
                let help = arg.get_help().map(ToString::to_string).unwrap_or_default();
                // The first words say what is meant; what follows may be about the command.
                let meant = help.split(['.', ',', ':', ';', '[', '(']).next().unwrap_or_default().trim().to_owned();
                let names = arg.get_value_names().unwrap_or_default().to_vec();
                let meaning = (meant, arg.get_short(), names);
                meanings.entry(long.to_owned()).or_default().entry(meaning).or_default().push(command.get_name());
            }
        }
        assert!(meanings.len() > 70, "{} options", meanings.len());
        meanings.retain(|_, meanings| meanings.len() > 1);
        assert!(meanings.is_empty(), "options with more than one meaning: {meanings:#?}");
    }
}
