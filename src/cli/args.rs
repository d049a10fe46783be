//! The command line, from which help, completions and the man page come too.

use std::ffi::OsStr;
use std::io;
use std::path::PathBuf;

use clap::builder::{PossibleValue, StringValueParser, TypedValueParser};
use clap::{Arg, Args, Parser, Subcommand, ValueEnum};

use crate::area::TileId;
use crate::error::Error;
use crate::export::{Export, Lods, MeshOptions, Profile};
use crate::preset::{BUILT_IN, Sources};

/// Bakes endless procedural terrain, offline, into maps and assets.
#[derive(Parser)]
#[command(name = "terrane", version, max_term_width = 100)]
pub(super) struct Arguments {
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Subcommand)]
pub(super) enum Command {
    /// Bake a region of a world into a folder.
    Bake(BakeArguments),
    /// Bake one tile alone: the same bytes as in any region.
    Tile(TileArguments),
    /// List the tile registry of a bake: where rivers and roads start, hashes, files.
    Registry {
        /// Folder of the bake.
        folder: PathBuf,
        /// Print one JSON object a line instead of a table.
        #[arg(long)]
        json: bool,
    },
    /// Time the terrain as it expands before a walking camera, beside the thesis' figures.
    Experiment(ExperimentArguments),
    /// List the built-in presets, or print one to start from.
    Presets {
        /// The preset to print.
        #[arg(value_parser = Named(preset_names), hide_possible_values = true)]
        name: Option<String>,
        /// Print one JSON object a line.
        #[arg(long)]
        json: bool,
    },
    /// Print the JSON schema of a file: of bake.json, or of a preset with all its keys.
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
pub(super) enum Schema {
    /// The manifest that a bake leaves.
    Bake,
    /// A preset.
    Preset,
}

#[derive(Args)]
pub(super) struct BakeArguments {
    /// A preset file, the name of a built-in preset (terrane presets), or - for standard input.
    #[arg(value_parser = Named(preset_names), hide_possible_values = true)]
    pub preset: String,
    /// North-western tile of the region; may be negative.
    #[arg(long, value_name = "X,Y", default_value = "0,0", allow_hyphen_values = true, value_parser = parse_tile)]
    pub at: TileId,
    /// Size of the region in tiles.
    #[arg(long, value_name = "COLSxROWS", default_value = "8x8", value_parser = parse_size)]
    pub size: (u64, u64),
    #[command(flatten)]
    pub common: CommonArguments,
}

#[derive(Args)]
pub(super) struct TileArguments {
    /// A preset file, the name of a built-in preset (terrane presets), or - for standard input.
    #[arg(value_parser = Named(preset_names), hide_possible_values = true)]
    pub preset: String,
    /// Tiles east of tile (0, 0); may be negative.
    #[arg(allow_negative_numbers = true)]
    pub x: i64,
    /// Tiles south of tile (0, 0); may be negative.
    #[arg(allow_negative_numbers = true)]
    pub y: i64,
    #[command(flatten)]
    pub common: CommonArguments,
}

#[derive(Args)]
pub(super) struct CommonArguments {
    /// Seed of the world [default: the preset's].
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
    /// Set a key of the preset, such as sea_level_m=40 or noise[0].height_m=300; the value is as in TOML. May be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    /// Folder for the bake [default: out/ and the preset's name].
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Cells a tile side, 16 to 4096 [default: the preset's].
    #[arg(long, value_name = "N")]
    pub tile_cells: Option<u32>,
    /// What to write, with commas between [default: height,blend,normal,map, or what the profile needs].
    #[arg(long, value_name = "LIST", long_help = export_help())]
    #[arg(value_parser = Named(export_names), hide_possible_values = true)]
    pub export: Option<String>,
    /// The program that the files are for: sizes, names and formats as it takes them, and IMPORT.md.
    #[arg(long, value_name = "NAME", long_help = profile_help())]
    #[arg(value_parser = Named(profile_names), hide_possible_values = true)]
    pub profile: Option<String>,
    /// Levels of detail of meshes, such as 0..3: 0 has every vertex, each further one twice the error [default: 0, or the
    /// profile's].
    #[arg(long, value_name = "LODS", help_heading = "Meshes", allow_hyphen_values = true)]
    pub lod: Option<Lods>,
    /// Metres that LOD 1 may be off at any vertex [default: a quarter of the spacing].
    #[arg(long, value_name = "METRES", help_heading = "Meshes", allow_negative_numbers = true)]
    pub mesh_error: Option<f64>,
    /// Write the numbers of glTF in 8 and 16 bits (KHR_mesh_quantization).
    #[arg(long, help_heading = "Meshes")]
    pub quantize: bool,
    /// Compress the numbers of glTF (EXT_meshopt_compression; Blender cannot read it).
    #[arg(long, help_heading = "Meshes")]
    pub meshopt: bool,
    /// Threads to use [default: one a core].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub threads: Option<u32>,
    /// Say what would be written, and what it would take, and write nothing.
    #[arg(long)]
    pub dry_run: bool,
    /// Replace the bake that is in the folder.
    #[arg(long)]
    pub overwrite: bool,
    /// Print one JSON object a line instead of text.
    #[arg(long)]
    pub json: bool,
    /// Print nothing but errors.
    #[arg(short, long, conflicts_with = "verbose")]
    pub quiet: bool,
    /// Say where the time went.
    #[arg(short, long)]
    pub verbose: bool,
    /// Show no progress.
    #[arg(long)]
    pub no_progress: bool,
}

#[derive(Args)]
pub(super) struct ExperimentArguments {
    /// Cells a tile side, 16 to 4096, with commas between.
    #[arg(long, value_name = "LIST", default_value = "64,128,256,512", value_delimiter = ',')]
    pub sizes: Vec<u32>,
    /// With agents, without, or both.
    #[arg(long, value_name = "LIST", default_value = "on,off", value_delimiter = ',')]
    pub agents: Vec<Switch>,
    /// Minutes that the camera walks, in its own time; it turns each minute.
    #[arg(long, value_name = "N", default_value_t = 5.0, allow_negative_numbers = true)]
    pub minutes: f64,
    /// Metres a second that the camera goes; enough for a hundred expansions of 512-metre tiles in five minutes.
    #[arg(long, value_name = "V", default_value_t = 128.0, allow_negative_numbers = true)]
    pub speed: f64,
    /// What makes the tiles: cpu.
    #[arg(long, value_name = "NAME", default_value = "cpu")]
    pub device: String,
    /// Whether to measure the thesis' plain method too, for the speed-up.
    #[arg(long, value_name = "ON|OFF", default_value = "on")]
    pub baseline: Switch,
    /// Threads to use; the baseline has one [default: one a core].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub threads: Option<u32>,
    /// Folder for the report [default: out/experiment].
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Replace the experiment that is in the folder.
    #[arg(long)]
    pub overwrite: bool,
    /// Print one JSON object instead of tables.
    #[arg(long)]
    pub json: bool,
}

#[derive(Clone, Copy, ValueEnum)]
pub(super) enum Switch {
    On,
    Off,
}

impl Switch {
    pub fn is_on(self) -> bool {
        matches!(self, Switch::On)
    }
}

impl Command {
    /// Whether messages are to be JSON.
    pub fn is_json(&self) -> bool {
        match self {
            Command::Bake(BakeArguments { common, .. }) | Command::Tile(TileArguments { common, .. }) => common.json,
            Command::Registry { json, .. } | Command::Presets { json, .. } => *json,
            Command::Experiment(arguments) => arguments.json,
            _ => false,
        }
    }
}

/// Takes any text, of which the known names are offered by completions: what else it may be is said where it is read.
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

/// The names of the built-in presets.
pub(super) fn preset_names() -> Vec<&'static str> {
    BUILT_IN.iter().map(|(name, _)| *name).collect()
}

fn export_names() -> Vec<&'static str> {
    Export::all().map(Export::name).collect()
}

fn profile_names() -> Vec<&'static str> {
    Profile::ALL.into_iter().map(Profile::name).collect()
}

fn export_help() -> String {
    let line = |export: Export| format!("\n  {:13} {}", export.name(), export.about());
    let list: String = Export::all().map(line).collect();
    format!("What to write, with commas between [default: {}, or what the profile needs]:{list}", Export::DEFAULT)
}

fn profile_help() -> String {
    let line = |profile: Profile| format!("\n  {:15} {}", profile.name(), profile.about());
    let list: String = Profile::ALL.into_iter().map(line).collect();
    format!("The program that the files are for; IMPORT.md beside them has the numbers to type:{list}")
}

fn parse_tile(text: &str) -> Result<TileId, String> {
    let (x, y) = text.split_once(',').ok_or("expected two whole numbers with a comma between, such as -3,12")?;
    let number = |text: &str| {
        text.trim().parse().map_err(|error| format!("expected a whole number of 64 bits, found {text:?}: {error}"))
    };
    Ok(TileId { x: number(x)?, y: number(y)? })
}

fn parse_size(text: &str) -> Result<(u64, u64), String> {
    let (cols, rows) = text.split_once(['x', 'X']).ok_or("expected columns x rows, such as 8x8")?;
    let number = |text: &str| match text.trim().parse() {
        Ok(0) => Err("a region has at least one tile each way, such as 1x1".to_owned()),
        Ok(count) => Ok(count),
        Err(error) => Err(format!("expected a whole number of tiles, found {text:?}: {error}")),
    };
    Ok((number(cols)?, number(rows)?))
}

/// A tile is a region of one.
impl From<TileArguments> for BakeArguments {
    fn from(TileArguments { preset, x, y, common }: TileArguments) -> BakeArguments {
        BakeArguments { preset, at: TileId { x, y }, size: (1, 1), common }
    }
}

impl BakeArguments {
    /// The preset with all that the options set in it.
    pub fn sources(&self) -> Result<Sources, Error> {
        let mut sources = match &self.preset[..] {
            "-" => Sources::read("stdin", io::stdin().lock())?,
            name_or_path => Sources::load(name_or_path)?,
        };
        for setting in &self.common.set {
            sources.set("--set", setting)?;
        }
        if let Some(cells) = self.common.tile_cells {
            // After --set, so that the option with a name of its own wins.
            sources.set("--tile-cells", &format!("tile_cells={cells}"))?;
        }
        Ok(sources)
    }

    pub fn meshes(&self) -> MeshOptions {
        let CommonArguments { lod, mesh_error, quantize, meshopt, .. } = &self.common;
        // A name that is no profile is reported where the profile is read, not here.
        let lods = lod.clone().or_else(|| self.profile().ok().flatten().map(Profile::lods)).unwrap_or_default();
        MeshOptions { lods, error_m: *mesh_error, quantized: *quantize, compressed: *meshopt }
    }

    /// The options of meshes that were given, by name.
    pub fn mesh_options(&self) -> Vec<&'static str> {
        let CommonArguments { lod, mesh_error, quantize, meshopt, .. } = &self.common;
        let all = [
            (lod.is_some(), "--lod"),
            (mesh_error.is_some(), "--mesh-error"),
            (*quantize, "--quantize"),
            (*meshopt, "--meshopt"),
        ];
        all.into_iter().filter_map(|(given, name)| given.then_some(name)).collect()
    }

    pub fn exports(&self) -> Result<Vec<Export>, Error> {
        match (&self.common.export, &self.common.profile) {
            (Some(list), _) => Export::parse_list(list),
            (None, None) => Export::parse_list(Export::DEFAULT),
            // A profile brings its own; what else is wanted must be named.
            (None, Some(_)) => Ok(Vec::new()),
        }
    }

    pub fn profile(&self) -> Result<Option<Profile>, Error> {
        self.common.profile.as_deref().map(str::parse).transpose()
    }
}
