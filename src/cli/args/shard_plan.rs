//! Arguments of `shard-plan`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::bake::CommonArguments;
use super::place::PlaceArguments;
use super::shared::{DeviceArguments, ThreadOptions, WorldArguments};
use super::values::within;

#[derive(Args)]
#[command(next_help_heading = "Job")]
#[command(mut_arg("preset", |preset| preset.help("A preset file, or the name of a built-in preset (terrane presets)")))]
pub struct ShardPlanArguments {
    #[command(flatten)]
    pub world: WorldArguments,
    /// The program that runs the job: slurm, kubernetes, or commands for any other, such as GNU parallel: one line per
    /// shard, and last the merge.
    #[arg(long, value_name = "NAME")]
    pub engine: Scheduler,
    /// Number of shards [default: as many as each take about --shard-minutes].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    pub shards: Option<u64>,
    /// Minutes that a shard shall take on this machine's cores, or on as many threads as --threads says.
    #[arg(long, alias = "minutes", value_name = "N", default_value_t = 60.0, value_parser = within(0.1..=1e6, " minutes"))]
    #[arg(conflicts_with = "shards")]
    pub shard_minutes: f64,
    /// Kubernetes: the container image that contains terrane.
    #[arg(long, value_name = "NAME", default_value = "terrane")]
    pub image: String,
    /// Kubernetes: the claim of a volume that all pods can write to.
    #[arg(long, value_name = "NAME", default_value = "terrane")]
    pub claim: String,
    #[command(flatten)]
    pub place: PlaceArguments,
    #[command(flatten)]
    pub common: CommonArguments,
    /// Folder to write to; the shards get folders beside it [default: in out/, named after preset, seed, place and
    /// size].
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    #[command(flatten)]
    pub threads: ThreadOptions,
    #[command(flatten)]
    pub device: DeviceArguments,
}

/// A program that runs jobs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Scheduler {
    /// Slurm: an array of jobs, and a merge job that depends on it.
    Slurm,
    /// Kubernetes: an indexed job, and a suspended merge job that you release when the shards are done.
    Kubernetes,
    /// Plain commands, a line each.
    Commands,
}
