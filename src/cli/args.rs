//! The command line. The help, the completions and the man page are made from it.

use std::ffi::OsStr;
use std::io;
use std::path::PathBuf;
use std::sync::Arc;

use clap::builder::{PossibleValue, StringValueParser, TypedValueParser};
use clap::{Arg, Args, Parser, Subcommand, ValueEnum};

use crate::area::{MAX_COORDINATE, Region, Stride, TileId};
use crate::bake::Shard;
use crate::cli::console::Console;
use crate::device::{Device, LandMaker};
use crate::error::Error;
use crate::export::{Export, Lettering, Lods, MeshOptions, Profile, TileNames, VectorOptions};
use crate::find;
use crate::map::sheet::{Cells, Overlay};
use crate::map::style::{STYLES, Style};
use crate::mesh::middle;
use crate::preset::{BUILT_IN, Preset, Sources};
use crate::recipe::source::RecipeSources;
use crate::threads::thread_count;
use crate::walker::{Tour, Way};
use crate::world::World;

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
    /// Merge the shards of a bake. The result has the same bytes as if one machine had baked all of it.
    Merge(MergeArguments),
    /// Print a job that bakes in shards on many machines, for a job scheduler: each shard, which may be repeated as
    /// often as needed, and then the merge.
    ShardPlan(ShardPlanArguments),
    /// Draw a map of a part of a world: relief, contours, waters, roads, places and names, at any scale.
    Map(MapArguments),
    /// Draw an atlas: sheets side by side with an index and a gazetteer of all names, as pictures and as one document.
    Atlas(AtlasArguments),
    /// Find the nearest lakes, peaks, rivers and places with the properties you want, each with the command that bakes
    /// it.
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
        folder: PathBuf,
        /// Print one JSON object.
        #[arg(long)]
        json: bool,
    },
    /// Repair a bake: bake damaged and missing files again, with their original bytes. A damaged file is renamed and
    /// kept, for somebody may have changed it.
    Repair {
        /// Folder of the bake.
        folder: PathBuf,
        /// Threads to use [default: one a core].
        #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4096))]
        threads: Option<u32>,
        /// Print one JSON object.
        #[arg(long)]
        json: bool,
    },
    /// Remove the files of a bake from a folder, and nothing else.
    Clean {
        /// Folder of the bake.
        folder: PathBuf,
        /// Say what would be removed and remove nothing.
        #[arg(long)]
        dry_run: bool,
        /// Print one JSON object.
        #[arg(long)]
        json: bool,
    },
    /// List the devices that can compute land: the CPU and all GPUs, with their limits, and whether they give the same
    /// bits.
    Devices {
        /// Print one JSON object a line.
        #[arg(long)]
        json: bool,
    },
    /// Time how the terrain expands before a walking camera, and compare with the thesis' figures.
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
    /// List the built-in styles of maps, or print one to start from.
    Styles {
        /// The style to print.
        #[arg(value_parser = Named(style_names), hide_possible_values = true)]
        name: Option<String>,
        /// Print one JSON object a line.
        #[arg(long)]
        json: bool,
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
pub(super) enum Schema {
    /// The manifest that a bake leaves.
    Bake,
    /// A preset.
    Preset,
    /// A style of maps.
    Style,
}

#[derive(Args)]
pub(super) struct BakeArguments {
    /// A preset file, the name of a built-in preset (terrane presets), or - for standard input.
    #[arg(value_parser = Named(preset_names), hide_possible_values = true)]
    pub preset: String,
    #[command(flatten)]
    pub place: PlaceArguments,
    /// Bake one shard of the region alone: 3/16 is the third of sixteen equal rectangles of its tiles. A shard has
    /// files of tiles only; terrane merge makes those of the region when all shards are baked.
    #[arg(long, value_name = "I/N", conflicts_with = "add")]
    pub shard: Option<Shard>,
    #[command(flatten)]
    pub common: CommonArguments,
}

#[derive(Args)]
pub(super) struct MergeArguments {
    /// Folders of the shards, in any order. Shards may share tiles if the bytes are the same.
    #[arg(required = true, value_name = "DIR")]
    pub shards: Vec<PathBuf>,
    /// Folder for the bake [default: in out/, named after preset, seed, place and size].
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Replace the bake in the folder. The old bake stays whole until the new one is complete.
    #[arg(long, help_heading = "Folder")]
    pub overwrite: bool,
    /// Resume this merge where it was cut off; if it is complete, make damaged files again.
    #[arg(long, help_heading = "Folder", conflicts_with = "overwrite")]
    pub resume: bool,
    #[command(flatten)]
    pub run: RunOptions,
}

#[derive(Args)]
pub(super) struct ShardPlanArguments {
    /// A preset file, or the name of a built-in preset (terrane presets).
    #[arg(value_parser = Named(preset_names), hide_possible_values = true)]
    pub preset: String,
    /// The program that runs the job: slurm, kubernetes, or commands for any other, such as GNU parallel: one line per
    /// shard, and last the merge.
    #[arg(long, value_name = "NAME", help_heading = "Job")]
    pub engine: Scheduler,
    /// Number of shards [default: as many as each take about --minutes].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..), help_heading = "Job")]
    pub shards: Option<u64>,
    /// Minutes that a shard shall take on this machine's cores, or on as many threads as --threads says.
    #[arg(long, value_name = "N", default_value_t = 60.0, value_parser = parse_minutes, help_heading = "Job")]
    #[arg(conflicts_with = "shards")]
    pub minutes: f64,
    /// Kubernetes: the container image that contains terrane.
    #[arg(long, value_name = "NAME", default_value = "terrane", help_heading = "Job")]
    pub image: String,
    /// Kubernetes: the claim of a volume that all pods can write to.
    #[arg(long, value_name = "NAME", default_value = "terrane", help_heading = "Job")]
    pub claim: String,
    #[command(flatten)]
    pub place: PlaceArguments,
    #[command(flatten)]
    pub common: CommonArguments,
}

/// A program that runs jobs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Scheduler {
    /// Slurm: an array of jobs, and a merge job that depends on it.
    Slurm,
    /// Kubernetes: an indexed job, and a suspended merge job that you release when the shards are done.
    Kubernetes,
    /// Plain commands, a line each.
    Commands,
}

#[derive(Args)]
pub(super) struct WalkArguments {
    /// A preset file, the name of a built-in preset (terrane presets), or - for standard input. The preset must be one
    /// of noise, with [rivers] and [roads].
    #[arg(value_parser = Named(preset_names), hide_possible_values = true)]
    pub preset: String,
    /// The walker's way, straight from place to place: a text file with one place per line, metres east and north of
    /// the origin with a comma between.
    #[arg(long, value_name = "FILE", help_heading = "Way")]
    #[arg(conflicts_with_all = ["minutes", "speed", "at"])]
    pub path: Option<PathBuf>,
    /// Minutes that the walker goes like the camera of the thesis' experiment, which turns to the right each minute.
    #[arg(long, value_name = "N", default_value_t = 5.0, allow_negative_numbers = true, help_heading = "Way")]
    pub minutes: f64,
    /// Speed of the camera in metres per second.
    #[arg(long, value_name = "V", default_value_t = 128.0, allow_negative_numbers = true, help_heading = "Way")]
    pub speed: f64,
    /// Tile in whose middle the camera starts; may be negative.
    #[arg(long, value_name = "X,Y", default_value = "0,0", allow_hyphen_values = true, value_parser = parse_tile)]
    #[arg(help_heading = "Way")]
    pub at: TileId,
    /// Layers of tiles around the walker's own tile, made as the walker comes near.
    #[arg(long, value_name = "N", default_value_t = 1, help_heading = "Way")]
    pub layers: u32,
    /// Seed of the world [default: the preset's].
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
    /// Set a key of the preset, as for bake. May be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    /// Cells a tile side, 16 to 4096 [default: the preset's].
    #[arg(long, value_name = "N")]
    pub tile_cells: Option<u32>,
    /// The exports to write, with commas between: files of tiles, vectors, hashes, and those files of the region around
    /// all tiles that may be empty where there is no tile.
    #[arg(long, value_name = "LIST", default_value = Export::DEFAULT_OF_WALKS, long_help = walk_export_help())]
    #[arg(value_parser = Named(walk_export_names), hide_possible_values = true)]
    pub export: String,
    /// Name files of tiles after the number of the tile in the world, or after its place in the region around all
    /// tiles.
    #[arg(long, value_name = "region|world", default_value = "world")]
    pub names: TileNames,
    #[command(flatten)]
    pub vectors: VectorArguments,
    /// Folder for the walk [default: in out/, named after preset, seed and way].
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Replace the walk or bake in the folder. The old one stays whole until the new one is complete.
    #[arg(long, help_heading = "Folder")]
    pub overwrite: bool,
    /// Resume this walk where it was cut off; files that were written are not written again.
    #[arg(long, help_heading = "Folder", conflicts_with = "overwrite")]
    pub resume: bool,
    #[command(flatten)]
    pub manner: Manner,
}

#[derive(Args)]
pub(super) struct ExtendArguments {
    /// Folder of the bake.
    pub folder: PathBuf,
    #[command(flatten)]
    pub place: PlaceArguments,
    #[command(flatten)]
    pub manner: Manner,
}

/// A part of a world.
#[derive(Args, Clone)]
pub(super) struct PlaceArguments {
    /// North-western tile of the region; may be negative [default: 0,0].
    #[arg(long, value_name = "X,Y", allow_hyphen_values = true, value_parser = parse_tile)]
    pub at: Option<TileId>,
    /// Size of the region in tiles [default: 8x8].
    #[arg(long, value_name = "COLSxROWS", value_parser = parse_size)]
    pub size: Option<(u64, u64)>,
    /// The region in kilometres east and north of the origin. A bake takes all tiles that the region touches.
    #[arg(long, value_name = "W,S,E,N", allow_hyphen_values = true, value_parser = parse_numbers::<4>)]
    #[arg(conflicts_with_all = ["at", "size", "around"])]
    pub bounds: Option<[f64; 4]>,
    /// The middle of the region in kilometres east and north of the origin, or the name of something (a settlement
    /// within 300 km of the origin, or a lake, river or peak within 30 km), and the region's width and height in
    /// kilometres.
    #[arg(long, value_name = "X,Y,KM|NAME[,KM]", allow_hyphen_values = true, value_parser = parse_around)]
    #[arg(conflicts_with_all = ["at", "size"])]
    pub around: Option<Around>,
}

/// The origin of meshes that the user asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum AskedOrigin {
    /// The middle of the region.
    Middle,
    /// Metres east and north of the world's origin.
    Metres([f64; 2]),
}

/// The range of heights that the user asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum AskedRange {
    /// The range of the region.
    Auto,
    /// Lowest and highest height in metres.
    Metres([f32; 2]),
}

/// The middle of a region, with the region's width and height in kilometres.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Around {
    /// Kilometres east and north of the origin, and the width and height.
    Place([f64; 2], f64),
    /// The name of something, and the width and height; by default the region is as wide as the named thing.
    Named(String, Option<f64>),
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
    /// Set a key of the preset, such as sea_level_m=40 or noise[0].height_m=300; the value is as in TOML. May be
    /// repeated. Setting another spacing_m moves rivers, lakes and towns and changes their names.
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    /// Folder for the bake [default: in out/, named after preset, seed, place and size].
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Cells a tile side, 16 to 4096 [default: the preset's].
    #[arg(long, value_name = "N")]
    pub tile_cells: Option<u32>,
    /// The exports to write, with commas between [default: height,blend,normal,map, or what the profile needs].
    #[arg(long, value_name = "LIST", long_help = export_help())]
    #[arg(value_parser = Named(export_names), hide_possible_values = true)]
    pub export: Option<String>,
    /// The program that the files are for: sets sizes, names and formats as the program needs them, and adds IMPORT.md.
    #[arg(long, value_name = "NAME", long_help = profile_help())]
    #[arg(value_parser = Named(profile_names), hide_possible_values = true)]
    pub profile: Option<String>,
    /// Levels of detail of meshes, such as 0..3: level 0 has every vertex, each further level twice the error of the
    /// one before [default: 0, or the profile's].
    #[arg(long, value_name = "LODS", help_heading = "Meshes", allow_hyphen_values = true)]
    pub lod: Option<Lods>,
    /// Largest error of LOD 1 at any vertex, in metres [default: a quarter of the spacing].
    #[arg(long, value_name = "METRES", help_heading = "Meshes", allow_negative_numbers = true)]
    pub mesh_error: Option<f64>,
    /// Write the numbers of glTF in 8 and 16 bits (KHR_mesh_quantization).
    #[arg(long, help_heading = "Meshes")]
    pub quantize: bool,
    /// Compress the numbers of glTF (EXT_meshopt_compression; Blender cannot read it).
    #[arg(long, help_heading = "Meshes")]
    pub meshopt: bool,
    /// Keep all vertices of the finest level on the edges of tiles, so that tiles of different levels meet without a
    /// crack.
    #[arg(long, help_heading = "Meshes")]
    pub even_borders: bool,
    /// The origin of all meshes, and of the positions in a profile's IMPORT.md: middle for the middle of the region, or
    /// metres east and north in the world [default: the world's origin, or far away from it a nearer place, which
    /// neighbouring regions share].
    #[arg(long, value_name = "middle|X,Y", help_heading = "Meshes", allow_hyphen_values = true, value_parser = parse_origin)]
    pub mesh_origin: Option<AskedOrigin>,
    /// Heights in metres of the values 0 and 65535 in 16-bit heights, such as 0,1200, or auto: the range of the region.
    /// Bakes with different ranges do not fit together [default: the range of the world, which is the same everywhere].
    #[arg(long, value_name = "auto|MIN,MAX", help_heading = "GIS", allow_hyphen_values = true, value_parser = parse_range)]
    pub height_range: Option<AskedRange>,
    #[command(flatten)]
    pub vectors: VectorArguments,
    /// Name files of tiles after the place of the tile in the region, or after its number in the world, which is the
    /// same in every region.
    #[arg(long, value_name = "region|world", default_value = "region")]
    pub names: TileNames,
    /// The scale of the bake: 1/2, 1/4 to 1/4096 keep every second, every fourth vertex and so on in each direction, of
    /// land as it looks from that far.
    #[arg(long, value_name = "1/N", default_value = "1", value_parser = parse_scale)]
    pub scale: Stride,
    /// Refuse to bake unless this program makes the worlds of the given version.
    #[arg(long, value_name = "VERSION")]
    pub generator: Option<String>,
    /// Replace the bake in the folder. The old bake stays whole until the new one is complete.
    #[arg(long, help_heading = "Folder")]
    pub overwrite: bool,
    /// Resume this bake where it was cut off; if it is complete, bake damaged files again.
    #[arg(long, help_heading = "Folder", conflicts_with = "overwrite")]
    pub resume: bool,
    /// Add the exports to the bake of the same world and region that is in the folder; its files stay as they are.
    #[arg(long, help_heading = "Folder", conflicts_with_all = ["overwrite", "resume"])]
    pub add: bool,
    #[command(flatten)]
    pub manner: Manner,
}

/// Options for writing vectors.
#[derive(Args)]
pub(super) struct VectorArguments {
    /// Clip features at the edge of the region; by default they are whole and reach beyond it.
    #[arg(long, help_heading = "GIS")]
    pub clip: bool,
    /// Metres between two contours [default: by the spacing and the heights of the world].
    #[arg(long, value_name = "METRES", help_heading = "GIS", allow_negative_numbers = true)]
    pub contours: Option<f64>,
    /// Write longitudes and latitudes to GeoJSON. They are the inverse of web mercator (EPSG:3857), with the world's
    /// metres as its metres, so the world's origin lies at 0, 0.
    #[arg(long, help_heading = "GIS")]
    pub degrees: bool,
}

impl VectorArguments {
    /// Returns the options for writing vectors.
    pub fn options(&self) -> VectorOptions {
        let VectorArguments { clip, degrees, contours } = self;
        VectorOptions { clipped: *clip, degrees: *degrees, contours_m: *contours }
    }

    /// Returns the names of the options that were given.
    pub fn given(&self) -> Vec<&'static str> {
        let VectorArguments { clip, degrees, contours } = self;
        given(&[(*clip, "--clip"), (*degrees, "--degrees"), (contours.is_some(), "--contours")])
    }
}

/// Returns the names of the options that were given.
fn given(all: &[(bool, &'static str)]) -> Vec<&'static str> {
    all.iter().filter_map(|(given, name)| given.then_some(*name)).collect()
}

/// The device that makes land.
#[derive(Args)]
pub(super) struct DeviceArguments {
    /// The device that makes land and tiles: auto (a GPU if there is one that gives the same bits), cpu or gpu; the
    /// bytes are the same.
    #[arg(long, value_name = "NAME", default_value = "cpu")]
    #[arg(value_parser = Named(device_names), hide_possible_values = true)]
    pub device: String,
    /// Threads along one side of a GPU's workgroups: 8, 16 or 32.
    #[arg(long, value_name = "N", default_value = "8", value_parser = parse_group_side)]
    pub workgroup: u32,
}

impl DeviceArguments {
    /// Returns the maker of a world's land and tiles. Prints a warning if a reason is given why no GPU is used.
    pub fn maker(&self, world: &World, console: &Console) -> Result<Arc<dyn LandMaker>, Error> {
        let device: Device = self.device.parse()?;
        let (maker, reason) = device.maker(world, self.workgroup)?;
        console.warnings(reason.as_slice());
        Ok(maker)
    }
}

fn parse_group_side(text: &str) -> Result<u32, String> {
    let side = text.trim().parse().ok().filter(|side| [8, 16, 32].contains(side));
    side.ok_or_else(|| format!("expected 8, 16 or 32, found {text:?}"))
}

fn device_names() -> Vec<&'static str> {
    Device::ALL.map(Device::name).to_vec()
}

/// Options for how a bake runs.
#[derive(Args)]
pub(super) struct Manner {
    #[command(flatten)]
    pub run: RunOptions,
    #[command(flatten)]
    pub device: DeviceArguments,
}

/// Options for how a bake runs, on any device.
#[derive(Args)]
pub(super) struct RunOptions {
    /// Threads to use [default: one a core].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub threads: Option<u32>,
    /// Print what would be written and what it would cost, and write nothing.
    #[arg(long)]
    pub dry_run: bool,
    /// Print one JSON object a line instead of text.
    #[arg(long)]
    pub json: bool,
    /// Print nothing but errors.
    #[arg(short, long, conflicts_with = "verbose")]
    pub quiet: bool,
    /// Print where the time went.
    #[arg(short, long)]
    pub verbose: bool,
    /// Show no progress.
    #[arg(long)]
    pub no_progress: bool,
}

/// Options for drawing maps.
#[derive(Args)]
pub(super) struct StyleArguments {
    /// The style: a built-in one (terrane styles), or a file.
    #[arg(long, value_name = "NAME|FILE", default_value = "topographic")]
    #[arg(value_parser = Named(style_names), hide_possible_values = true)]
    pub style: String,
    /// Set a key of the style, such as relief.sun_deg=300 or contours.interval_m=50; the value is as in TOML. May be
    /// repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    pub style_set: Vec<String>,
    /// Pixels per inch of paper; sets how large lines and letters are.
    #[arg(long, value_name = "N", default_value_t = 200.0, value_parser = parse_dpi, help_heading = "Scale")]
    pub dpi: f64,
    /// The furniture around a map, with commas between: title, frame, grid, scale, north, legend, recipe, or all, or
    /// none.
    #[arg(long, value_name = "LIST", default_value = "all", help_heading = "Sheet")]
    pub furniture: String,
    /// The title [default: the preset's name].
    #[arg(long, value_name = "TEXT", help_heading = "Sheet")]
    pub title: Option<String>,
    /// Numbered cells over a map, with their width in kilometres.
    #[arg(long, value_name = "squares:KM|hexes:KM", value_parser = parse_overlay, help_heading = "Sheet")]
    pub overlay: Option<Overlay>,
    /// Seed of the world [default: the preset's].
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
    /// Set a key of the preset, as for bake. May be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    /// Threads to use [default: one a core].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub threads: Option<u32>,
    /// Replace files that are there.
    #[arg(long)]
    pub overwrite: bool,
    /// Print how much memory it would take, and write nothing.
    #[arg(long)]
    pub dry_run: bool,
    /// Print one JSON object a line instead of text.
    #[arg(long)]
    pub json: bool,
}

#[derive(Args)]
pub(super) struct MapArguments {
    /// A preset file, the name of a built-in preset (terrane presets), - for standard input, or the folder of a bake,
    /// whose world and region are drawn.
    #[arg(value_name = "PRESET|DIR", value_parser = Named(preset_names), hide_possible_values = true)]
    pub preset: String,
    /// The file to write: .png or .webp, with a world file beside it that places the map in a GIS, or .pdf or .svg,
    /// with vector lines in named layers [default: in out/, named after preset, seed, place, size, scale and style,
    /// .png].
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    #[command(flatten)]
    pub place: PlaceArguments,
    /// The scale on paper, such as 1:50000.
    #[arg(long, value_name = "1:N", value_parser = parse_map_scale, help_heading = "Scale")]
    #[arg(conflicts_with_all = ["width", "metres_per_pixel"])]
    pub scale: Option<f64>,
    /// Pixels from west to east [default: 2048].
    #[arg(long, value_name = "PIXELS", value_parser = clap::value_parser!(u32).range(16..=1_000_000), help_heading = "Scale")]
    #[arg(conflicts_with = "metres_per_pixel")]
    pub width: Option<u32>,
    /// Metres per pixel.
    #[arg(long, value_name = "METRES", value_parser = parse_positive, help_heading = "Scale")]
    pub metres_per_pixel: Option<f64>,
    /// Letters in a .pdf or .svg: as text with its fonts in the file, which can be searched and changed; or as
    /// outlines, which look the same in every program [default: text in .pdf; outlines in .svg, whose fonts only
    /// browsers use].
    #[arg(long, value_name = "HOW", value_parser = parse_lettering, help_heading = "Sheet")]
    pub text: Option<Lettering>,
    #[command(flatten)]
    pub device: DeviceArguments,
    #[command(flatten)]
    pub style: StyleArguments,
}

#[derive(Args)]
pub(super) struct AtlasArguments {
    /// A preset file, the name of a built-in preset (terrane presets), or - for standard input.
    #[arg(value_parser = Named(preset_names), hide_possible_values = true)]
    pub preset: String,
    /// The folder to write to [default: in out/, named after preset, seed, place, sheets, scale and style].
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// The formats to write: png for one picture per sheet, pdf for one document of all sheets.
    #[arg(long, value_name = "LIST", default_value = "png,pdf", value_delimiter = ',')]
    pub format: Vec<AtlasFormat>,
    /// Sheets from west to east and from north to south.
    #[arg(long, value_name = "COLSxROWS", default_value = "2x2", value_parser = parse_size)]
    pub sheets: (u64, u64),
    /// The middle of all sheets in kilometres east and north of the origin, or the name of something there.
    #[arg(long, value_name = "X,Y|NAME", default_value = "0,0", allow_hyphen_values = true, value_parser = parse_middle)]
    pub middle: Around,
    /// The scale on paper.
    #[arg(long, value_name = "1:N", default_value = "1:50000", value_parser = parse_map_scale, help_heading = "Scale")]
    pub scale: f64,
    /// The paper: a0 to a6, letter, legal or tabloid, or millimetres such as 420x297.
    #[arg(long, value_name = "NAME|WxH", default_value = "a3", value_parser = parse_paper, help_heading = "Sheet")]
    pub paper: [f64; 2],
    /// Stand the paper upright.
    #[arg(long, help_heading = "Sheet")]
    pub portrait: bool,
    /// Overlap of neighbouring sheets in millimetres.
    #[arg(long, value_name = "MM", default_value_t = 10.0, value_parser = parse_overlap, help_heading = "Sheet")]
    pub overlap: f64,
    #[command(flatten)]
    pub style: StyleArguments,
}

/// A file format of an atlas.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum AtlasFormat {
    /// One picture per sheet.
    Png,
    /// One document of all sheets, with links.
    Pdf,
}

#[derive(Args)]
pub(super) struct RegistryArguments {
    /// Folder of the bake.
    pub folder: PathBuf,
    /// List files with their sizes and hashes instead of tiles.
    #[arg(long)]
    pub files: bool,
    /// Only this tile, or with --files only its files.
    #[arg(long, value_name = "X,Y", allow_hyphen_values = true, value_parser = parse_tile)]
    pub tile: Option<TileId>,
    /// Only tiles on which a river or a road starts.
    #[arg(long, value_name = "KIND", conflicts_with = "files")]
    pub start: Option<Started>,
    /// Only files of this export.
    #[arg(long, value_name = "NAME", requires = "files")]
    pub export: Option<String>,
    /// Print one JSON object a line instead of a table.
    #[arg(long)]
    pub json: bool,
}

/// A thing that starts on a tile.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Started {
    /// A river.
    River,
    /// A road.
    Road,
}

#[derive(Args)]
pub(super) struct VerifyArguments {
    /// Folder of the bake.
    pub folder: PathBuf,
    /// Share of the tiles to bake again and compare, in percent; at least one tile.
    #[arg(long, value_name = "PERCENT", default_value = "1", value_parser = parse_percent)]
    pub sample: f64,
    /// Bake all of its tiles again.
    #[arg(long, conflicts_with = "sample")]
    pub all: bool,
    /// Check only the files, and bake no tile again.
    #[arg(long, conflicts_with_all = ["sample", "all"])]
    pub files: bool,
    /// Threads to use [default: one a core].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub threads: Option<u32>,
    /// Print one JSON object a line: each fault, and a summary of what was checked.
    #[arg(long)]
    pub json: bool,
}

#[derive(Args)]
pub(super) struct FindArguments {
    /// A preset file, the name of a built-in preset (terrane presets), or - for standard input.
    #[arg(value_parser = Named(preset_names), hide_possible_values = true)]
    pub preset: String,
    /// Queries: lake, peak, river, place, hamlet, village or town; on river, on lake or on sea; >, >=, <, <= or = a
    /// number of m2, ha, km2, m, km, m3/s or people.
    #[arg(required = true, value_name = "QUERY")]
    #[arg(
        long_help = "What to find, each as one argument: a thing, perhaps what it is on, and any number of bounds.\n\n  thing   lake, peak, river, place (any settlement), hamlet, village or town; or many: lakes\n  on      on river, on lake or on sea\n  bound   >, >=, <, <= or = and a number with its unit; = is as nearly as the number says\n  units   of lakes m2, ha, km2 (area), m, km (height); of peaks m, km; of rivers m, km (length), m3/s;\n          of settlements people, m, km (height); without a unit km2, m, km and people\n\n  \"lake > 2 km2\", \"lakes > 20000 m2 < 40 ha\", \"peak >= 3500 m\", \"river > 50 m3/s\", \"river > 30 km\",\n  \"town on river\", \"village on lake > 300 people\", \"hamlets on sea\", \"place\""
    )]
    pub queries: Vec<String>,
    /// The place to search from, in kilometres east and north of the origin.
    #[arg(long, value_name = "X,Y", default_value = "0,0", allow_hyphen_values = true, value_parser = parse_numbers::<2>)]
    pub near: [f64; 2],
    /// Search radius around that place, in kilometres.
    #[arg(long, value_name = "KM", default_value = "200km", allow_hyphen_values = true, value_parser = parse_kilometres)]
    pub radius: f64,
    /// Largest number of results per query.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..))]
    pub limit: u32,
    /// Seed of the world [default: the preset's].
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
    /// Set a key of the preset, as for bake. May be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    /// Threads to use [default: one a core].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub threads: Option<u32>,
    /// Print how much memory it would take, and find nothing.
    #[arg(long)]
    pub dry_run: bool,
    /// Print one JSON object a line instead of tables.
    #[arg(long)]
    pub json: bool,
}

#[cfg(feature = "explore")]
#[derive(Args)]
pub(super) struct ExploreArguments {
    /// A preset file, which may be edited while the page is open, or the name of a built-in preset (terrane presets).
    #[arg(value_parser = Named(preset_names), hide_possible_values = true)]
    pub preset: String,
    /// The part of the world that the page shows first.
    #[command(flatten)]
    pub place: PlaceArguments,
    /// Seed of the world [default: the preset's].
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
    /// Set a key of the preset, as for bake. May be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    /// The port of the page's address on this machine; 0 takes any free one. Other machines cannot reach it.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub port: u16,
    /// Open the page in the browser.
    #[arg(long)]
    pub open: bool,
    /// The cache folder for what was drawn, so that it is there at once the next time [default: in the user's cache
    /// folder].
    #[arg(long, value_name = "DIR")]
    pub cache: Option<PathBuf>,
    /// Size limit of the cache folder, such as 500MB or 4GB; 0 keeps nothing.
    #[arg(long, value_name = "SIZE", default_value = "1GB", value_parser = parse_bytes)]
    pub cache_limit: u64,
    /// Memory limit for the data of all worlds that are looked at, such as 500MB or 4GB: with a lower limit, data must
    /// be made again sooner. The drawing in progress takes some 300 MB more.
    #[arg(long, value_name = "SIZE", default_value = "500MB", value_parser = parse_bytes)]
    pub memory_limit: u64,
    /// Threads to use [default: one a core].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub threads: Option<u32>,
    /// Print the address as a JSON object.
    #[arg(long)]
    pub json: bool,
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
    /// Speed of the camera in metres per second; the default is enough for a hundred expansions of 512-metre tiles in
    /// five minutes.
    #[arg(long, value_name = "V", default_value_t = 128.0, allow_negative_numbers = true)]
    pub speed: f64,
    /// The device that makes the land of tiles: cpu, gpu, or both side by side.
    #[arg(long, value_name = "LIST", default_value = "cpu", value_delimiter = ',')]
    pub device: Vec<String>,
    /// Threads along one side of a GPU's workgroups, 8, 16 or 32, with commas between.
    #[arg(long, value_name = "LIST", default_value = "8", value_delimiter = ',', value_parser = parse_group_side)]
    pub workgroup: Vec<u32>,
    /// Layers of tiles around the camera's own, 1 to 16, with commas between: 1 are the eight neighbours of the thesis.
    #[arg(long, value_name = "LIST", default_value = "1", value_delimiter = ',')]
    pub layers: Vec<u32>,
    /// Tiles that a step makes: all that are missing, as in the thesis, or one, the nearest; or both.
    #[arg(long, value_name = "LIST", default_value = "all", value_delimiter = ',')]
    pub step: Vec<StepSize>,
    /// Measure the thesis' plain method too, for the speed-up.
    #[arg(long, value_name = "ON|OFF", default_value = "on")]
    pub baseline: Switch,
    /// Threads to use, or several numbers to compare, such as 1,all; all means one a core. The baseline has one.
    #[arg(long, value_name = "LIST", default_value = "all", value_delimiter = ',', value_parser = parse_threads)]
    pub threads: Vec<usize>,
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

/// The tiles that a step of the experiment makes.
#[derive(Clone, Copy, ValueEnum)]
pub(super) enum StepSize {
    /// All missing tiles.
    All,
    /// The nearest missing tile.
    One,
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
    /// True if messages shall be JSON.
    pub fn is_json(&self) -> bool {
        match self {
            Command::Bake(BakeArguments { common, .. }) | Command::Tile(TileArguments { common, .. }) => {
                common.manner.run.json
            }
            Command::Extend(arguments) => arguments.manner.run.json,
            Command::Walk(arguments) => arguments.manner.run.json,
            Command::Merge(arguments) => arguments.run.json,
            Command::ShardPlan(arguments) => arguments.common.manner.run.json,
            Command::Registry(RegistryArguments { json, .. })
            | Command::Repair { json, .. }
            | Command::Info { json, .. }
            | Command::Clean { json, .. }
            | Command::Devices { json }
            | Command::Presets { json, .. }
            | Command::Styles { json, .. } => *json,
            Command::Map(MapArguments { style, .. }) | Command::Atlas(AtlasArguments { style, .. }) => style.json,
            Command::Find(arguments) => arguments.json,
            #[cfg(feature = "explore")]
            Command::Explore(arguments) => arguments.json,
            Command::Verify(arguments) => arguments.json,
            Command::Experiment(arguments) => arguments.json,
            _ => false,
        }
    }
}

/// Reads a number of threads; `all` is one per core.
fn parse_threads(text: &str) -> Result<usize, String> {
    let number = match text.trim() {
        "all" => Some(thread_count(None)),
        number => number.parse().ok().filter(|number| (1..=4096).contains(number)),
    };
    number.ok_or_else(|| format!("expected 1 to 4096, or all, found {text:?}"))
}

/// Reads a percentage, with or without the % sign, as a share of 1.
fn parse_percent(text: &str) -> Result<f64, String> {
    let number = text.trim().trim_end_matches('%').trim_end().parse::<f64>();
    let share = number.ok().map(|percent| percent / 100.0).filter(|share| *share > 0.0 && *share <= 1.0);
    share.ok_or_else(|| format!("expected more than 0 and at most 100 percent, such as 5 or 5%; found {text:?}"))
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

/// The names of the built-in presets.
pub(super) fn preset_names() -> Vec<&'static str> {
    BUILT_IN.iter().map(|(name, _)| *name).collect()
}

fn style_names() -> Vec<&'static str> {
    STYLES.iter().map(|(name, _)| *name).collect()
}

fn export_names() -> Vec<&'static str> {
    Export::all().map(Export::name).collect()
}

/// Returns the names of the exports that walks can write.
fn walk_export_names() -> Vec<&'static str> {
    Export::of_walks().map(Export::name).collect()
}

fn profile_names() -> Vec<&'static str> {
    Profile::ALL.into_iter().map(Profile::name).collect()
}

fn export_help() -> String {
    let line = |export: Export| format!("\n  {:20} {}", export.name(), export.about());
    let list: String = Export::all().map(line).collect();
    format!("What to write, with commas between [default: {}, or what the profile needs]:{list}", Export::DEFAULT)
}

fn walk_export_help() -> String {
    let (tiles, region): (Vec<&str>, Vec<&str>) = walk_export_names().iter().partition(|name| name.ends_with("-tiles"));
    format!(
        "What to write, with commas between; terrane bake --help says what each holds:\n  a file a tile: {}\n  of all tiles, and \
         empty where none is: {}",
        tiles.join(", "),
        region.join(", ")
    )
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

/// Reads exactly `N` numbers with commas between.
pub(super) fn parse_numbers<const N: usize>(text: &str) -> Result<[f64; N], String> {
    let number = |part: &str| match part.trim().parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(number),
        _ => Err(format!("expected a number, found {part:?}")),
    };
    let numbers: Vec<f64> = text.split(',').map(number).collect::<Result<_, _>>()?;
    let found = numbers.len();
    numbers.try_into().map_err(|_| format!("expected {N} numbers with commas between, found {found}"))
}

fn parse_origin(text: &str) -> Result<AskedOrigin, String> {
    if text == "middle" {
        return Ok(AskedOrigin::Middle);
    }
    parse_numbers::<2>(text).map(AskedOrigin::Metres).map_err(|error| format!("{error}; or middle"))
}

fn parse_range(text: &str) -> Result<AskedRange, String> {
    if text == "auto" {
        return Ok(AskedRange::Auto);
    }
    let metres = parse_numbers::<2>(text).map_err(|error| format!("{error}; or auto"))?;
    Ok(AskedRange::Metres(metres.map(|metres| metres as f32)))
}

fn parse_around(text: &str) -> Result<Around, String> {
    let is_number = |part: &str| part.trim().parse::<f64>().is_ok();
    if text.split(',').next().is_some_and(is_number) {
        return parse_numbers::<3>(text).map(|[x, y, km]| Around::Place([x, y], km));
    }
    let name = |text: &str| match text.trim() {
        "" => Err("expected X,Y,KM or a name".to_owned()),
        name => Ok(name.to_owned()),
    };
    match text.rsplit_once(',') {
        Some((before, km)) => Ok(Around::Named(name(before)?, Some(parse_kilometres(km)?))),
        None => Ok(Around::Named(name(text)?, None)),
    }
}

/// Reads a place in kilometres east and north, or a name.
fn parse_middle(text: &str) -> Result<Around, String> {
    match text.split(',').next().is_some_and(|part| part.trim().parse::<f64>().is_ok()) {
        true => parse_numbers::<2>(text).map(|middle| Around::Place(middle, 0.0)),
        false if text.trim().is_empty() => Err("expected X,Y or a name".to_owned()),
        false => Ok(Around::Named(text.trim().to_owned(), None)),
    }
}

fn parse_overlay(text: &str) -> Result<Overlay, String> {
    let expected = || format!("expected squares:KM or hexes:KM, such as hexes:5, found {text:?}");
    let (form, km) = text.split_once(':').ok_or_else(expected)?;
    let form = match form.trim() {
        "square" | "squares" => Cells::Squares,
        "hex" | "hexes" | "hexagons" => Cells::Hexagons,
        _ => return Err(expected()),
    };
    Ok(Overlay { form, side_m: 1000.0 * parse_kilometres(km)? })
}

/// Reads a paper size in millimetres: the longer side first for named sizes, in the given order for numbers.
fn parse_paper(text: &str) -> Result<[f64; 2], String> {
    let known = match text.trim().to_lowercase().as_str() {
        "a0" => [1189.0, 841.0],
        "a1" => [841.0, 594.0],
        "a2" => [594.0, 420.0],
        "a3" => [420.0, 297.0],
        "a4" => [297.0, 210.0],
        "a5" => [210.0, 148.0],
        "a6" => [148.0, 105.0],
        "letter" => [279.4, 215.9],
        "legal" => [355.6, 215.9],
        "tabloid" | "ledger" => [431.8, 279.4],
        other => {
            let sides: Option<Vec<f64>> = other.split('x').map(|side| side.trim().parse().ok()).collect();
            let expected =
                || format!("expected a0 to a6, letter, legal, tabloid or millimetres such as 420x297, found {text:?}");
            let sides: [f64; 2] = sides.and_then(|sides| sides.try_into().ok()).ok_or_else(expected)?;
            if !sides.iter().all(|mm| (30.0..=5000.0).contains(mm)) {
                return Err(format!("paper has sides of 30 to 5000 mm, found {text:?}"));
            }
            sides
        }
    };
    Ok(known)
}

fn parse_overlap(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(mm) if (0.0..=1000.0).contains(&mm) => Ok(mm),
        _ => Err(format!("expected 0 to 1000 millimetres, found {text:?}")),
    }
}

/// Reads kilometres above 0, with or without the unit.
fn parse_kilometres(text: &str) -> Result<f64, String> {
    let number = text.trim();
    match number.strip_suffix("km").unwrap_or(number).trim_end().parse::<f64>() {
        Ok(km) if km.is_finite() && km > 0.0 => Ok(km),
        _ => Err(format!("expected kilometres above 0, such as 200km, found {text:?}")),
    }
}

/// Reads a number of bytes, with units in powers of ten.
#[cfg(feature = "explore")]
fn parse_bytes(text: &str) -> Result<u64, String> {
    let units = [("kB", 1e3), ("KB", 1e3), ("MB", 1e6), ("GB", 1e9), ("TB", 1e12), ("B", 1.0), ("", 1.0)];
    let bytes = units.iter().find_map(|(unit, bytes)| {
        let number: f64 = text.trim().strip_suffix(unit)?.trim().parse().ok()?;
        Some(number * bytes)
    });
    let bytes = bytes.filter(|bytes| (0.0..=1e18).contains(bytes));
    bytes.map(|bytes| bytes as u64).ok_or_else(|| "expected bytes, such as 500MB or 4GB".into())
}

fn parse_minutes(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(minutes) if (0.1..=1e6).contains(&minutes) => Ok(minutes),
        _ => Err(format!("expected minutes, 0.1 to 1,000,000, found {text:?}")),
    }
}

fn parse_scale(text: &str) -> Result<Stride, String> {
    let vertices = text.strip_prefix("1/").unwrap_or(if text == "1" { "1" } else { "" });
    let stride = vertices.parse().ok().and_then(Stride::new);
    stride.ok_or_else(|| "expected 1, or 1/2, 1/4, 1/8 and so on to 1/4096".to_owned())
}

/// Reads a scale on paper such as 1:50000, and returns its denominator.
fn parse_map_scale(text: &str) -> Result<f64, String> {
    let number = text.trim().strip_prefix("1:").unwrap_or_default().replace(['_', ' '], "");
    match number.parse::<f64>() {
        Ok(number) if (1.0..=1e12).contains(&number) => Ok(number),
        _ => Err(format!("expected 1: and a number from 1 on, such as 1:50000, found {text:?}")),
    }
}

fn parse_dpi(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(number) if (10.0..=2400.0).contains(&number) => Ok(number),
        _ => Err(format!("expected 10 to 2400, found {text:?}")),
    }
}

fn parse_lettering(text: &str) -> Result<Lettering, String> {
    match text.trim() {
        "text" => Ok(Lettering::Text),
        "outlines" => Ok(Lettering::Outlines),
        other => Err(format!("expected text or outlines, found {other:?}")),
    }
}

fn parse_positive(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(number) if (0.001..=1e9).contains(&number) => Ok(number),
        _ => Err(format!("expected metres, 0.001 to 1,000,000,000, found {text:?}")),
    }
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

/// Baking one tile is baking a region of one tile.
impl From<TileArguments> for BakeArguments {
    fn from(TileArguments { preset, x, y, common }: TileArguments) -> BakeArguments {
        let place = PlaceArguments { at: Some(TileId { x, y }), size: Some((1, 1)), bounds: None, around: None };
        BakeArguments { preset, place, shard: None, common }
    }
}

/// Distance in kilometres from the origin to the furthest vertices.
fn most_km(spacing_m: f64) -> f64 {
    MAX_COORDINATE as f64 * spacing_m / 1000.0
}

/// Returns the vertex at a place in metres east and north of the origin.
fn vertex_at([east_m, north_m]: [f64; 2], spacing_m: f64) -> Result<[i64; 2], Error> {
    // Rows of the lattice count to the south, so north is negative.
    let places = [east_m / spacing_m, 0.0 - north_m / spacing_m];
    let nearest = places.map(f64::round);
    // Tolerate the rounding error of the division.
    let is_vertex = (0..2).all(|axis| (places[axis] - nearest[axis]).abs() <= 1e-9 * places[axis].abs().max(1.0));
    let is_near = nearest.iter().all(|place| place.abs() <= MAX_COORDINATE as f64);
    if is_vertex && is_near {
        return Ok(nearest.map(|place| place as i64));
    }
    let [x, y] = nearest.map(|place| place.clamp(-(MAX_COORDINATE as f64), MAX_COORDINATE as f64) * spacing_m);
    Err(Error::Option {
        message: format!("--mesh-origin {east_m},{north_m}: there is no vertex, and the origin of meshes is one"),
        hint: format!("the nearest is --mesh-origin={},{}; vertices lie {spacing_m} m apart", x, 0.0 - y),
    })
}

/// Rounds kilometres to the nanometre, to drop the noise that a sum leaves in the last digits.
fn without_noise(km: f64) -> f64 {
    const NANOMETRES: f64 = 1e12;
    // Far from the origin, doubles hold no such fine digits, and the product would not be an exact whole number.
    if km.abs() < MAX_COORDINATE as f64 / NANOMETRES { (km * NANOMETRES).round() / NANOMETRES } else { km }
}

/// Loads a preset and applies the settings.
pub(super) fn sources(preset: &str, settings: &[String]) -> Result<Sources, Error> {
    let mut sources = match preset {
        "-" => Sources::read("stdin", io::stdin().lock())?,
        name_or_path => Sources::load(name_or_path)?,
    };
    for setting in settings {
        sources.set("--set", setting)?;
    }
    Ok(sources)
}

impl PlaceArguments {
    /// True if any place is given.
    pub fn is_given(&self) -> bool {
        self.at.is_some() || self.size.is_some() || self.bounds.is_some() || self.around.is_some()
    }

    /// Returns the same place by numbers alone: a name is looked up in the world of a preset.
    ///
    /// # Errors
    /// When nothing has the name.
    pub fn located(&self, preset: &Preset, seed: Option<u64>) -> Result<PlaceArguments, Error> {
        let mut located = self.clone();
        if let Some(Around::Named(name, km)) = &self.around {
            let found = find::named(preset.clone(), seed, name, [0.0; 2])?;
            located.around = Some(Around::Place(found.at_km, km.unwrap_or(found.around_km)));
        }
        Ok(located)
    }

    /// Returns the rectangle from --bounds or --around in kilometres, if one is given: west, south, east and north.
    fn bounds_km(&self, spacing_m: f64) -> Result<Option<[f64; 4]>, Error> {
        let around = self.around.as_ref().map(|around| match around {
            Around::Place([x, y], km) => [x - km / 2.0, y - km / 2.0, x + km / 2.0, y + km / 2.0].map(without_noise),
            Around::Named(name, _) => unreachable!("{name} has not been located"),
        });
        let bounds = self.bounds.or(around);
        let Some([west, south, east, north]) = bounds else { return Ok(None) };
        if west >= east || south >= north {
            return Err(Error::Region {
                message: format!("from {west} to {east} km east and from {south} to {north} km north there is nothing"),
                hint: "give west, south, east and north, such as --bounds=-10,-10,10,10".into(),
            });
        }
        let most_km = most_km(spacing_m);
        if [west, south, east, north].iter().any(|km| km.abs() > most_km) {
            return Err(Error::Region {
                message: format!("{west},{south},{east},{north} km leaves the coordinates"),
                hint: format!("no vertex lies more than {most_km:.0} km from the origin"),
            });
        }
        Ok(bounds)
    }

    /// Returns the region of all tiles that are asked for or touched, with `tile_cells` cells a side of `spacing_m`
    /// metres each.
    pub fn region(&self, tile_cells: u32, spacing_m: f64) -> Result<Region, Error> {
        let Some([west, south, east, north]) = self.bounds_km(spacing_m)? else {
            let (cols, rows) = self.size.unwrap_or((8, 8));
            return Region::new(self.at.unwrap_or(TileId { x: 0, y: 0 }), cols, rows, tile_cells);
        };
        let tile_km = f64::from(tile_cells) * spacing_m / 1000.0;
        // Rows count to the south.
        let [x0, y0, x1, y1] = [west, -north, east, -south].map(|km| km / tile_km);
        let at = TileId { x: x0.floor() as i64, y: y0.floor() as i64 };
        Region::new(at, (x1.ceil() - x0.floor()) as u64, (y1.ceil() - y0.floor()) as u64, tile_cells)
    }

    /// Returns the bounds of the place in metres east and north of the origin: west, south, east and north.
    pub fn bounds_m(&self, tile_cells: u32, spacing_m: f64) -> Result<[f64; 4], Error> {
        let km = match self.bounds_km(spacing_m)? {
            Some(bounds) => bounds,
            None => self.region(tile_cells, spacing_m)?.bounds_km(spacing_m),
        };
        Ok(km.map(|km| km * 1000.0))
    }
}

impl StyleArguments {
    /// Returns the style with the settings of the options applied.
    pub fn style(&self) -> Result<Style, Error> {
        let mut sources: RecipeSources<Style> = RecipeSources::load(&self.style)?;
        for setting in &self.style_set {
            sources.set("--style-set", setting)?;
        }
        sources.read_all()
    }
}

impl FindArguments {
    /// Returns the preset with the settings of the options applied.
    pub fn sources(&self) -> Result<Sources, Error> {
        sources(&self.preset, &self.set)
    }
}

/// Loads a preset and applies the settings, and the cells per tile side if given.
fn sources_in_tiles(preset: &str, settings: &[String], tile_cells: Option<u32>) -> Result<Sources, Error> {
    let mut sources = sources(preset, settings)?;
    if let Some(cells) = tile_cells {
        // After --set, so that the option with a name of its own wins.
        sources.set("--tile-cells", &format!("tile_cells={cells}"))?;
    }
    Ok(sources)
}

impl WalkArguments {
    /// Returns the preset with the settings of the options applied.
    pub fn sources(&self) -> Result<Sources, Error> {
        sources_in_tiles(&self.preset, &self.set, self.tile_cells)
    }

    /// Returns the tour that the options ask for.
    pub fn tour(&self) -> Result<Tour, Error> {
        let WalkArguments { path, minutes, speed, at, layers, .. } = self;
        let way = match path {
            Some(path) => Way::of_file(path)?,
            None => Way::Camera { at: *at, minutes: *minutes, speed_m_s: *speed },
        };
        Ok(Tour { way, layers: *layers })
    }
}

impl BakeArguments {
    /// Returns the preset with the settings of the options applied.
    pub fn sources(&self) -> Result<Sources, Error> {
        sources_in_tiles(&self.preset, &self.common.set, self.common.tile_cells)
    }

    /// True if an option sets the size of the region or of its tiles. --scale counts too, as it scales a given region.
    pub fn asks_for_size(&self) -> bool {
        let PlaceArguments { size, bounds, around, .. } = &self.place;
        let CommonArguments { tile_cells, set, scale, .. } = &self.common;
        let is_size = |setting: &String| setting.split('=').next().is_some_and(|key| key.trim() == "tile_cells");
        let in_tiles = size.is_some() || tile_cells.is_some() || set.iter().any(is_size);
        in_tiles || bounds.is_some() || around.is_some() || *scale != Stride::ONE
    }

    /// Returns the options for the meshes of a region.
    ///
    /// # Errors
    /// Fails if no vertex lies at the origin that is asked for.
    pub fn meshes(&self, region: &Region, spacing_m: f64) -> Result<MeshOptions, Error> {
        let CommonArguments { lod, mesh_error, quantize, meshopt, even_borders, mesh_origin, .. } = &self.common;
        // A name that is no profile is reported where the profile is read, not here.
        let profile = self.profile().ok().flatten();
        let lods = lod.clone().or_else(|| profile.map(Profile::lods)).unwrap_or_default();
        let asked_origin = mesh_origin.map(|asked| match asked {
            AskedOrigin::Middle => Ok(middle(region)),
            AskedOrigin::Metres(place_m) => vertex_at(place_m, spacing_m),
        });
        let origin = asked_origin.transpose()?.or_else(|| profile.and_then(|profile| profile.origin(region)));
        Ok(MeshOptions {
            lods,
            error_m: *mesh_error,
            quantized: *quantize,
            compressed: *meshopt,
            even_borders: *even_borders,
            origin,
        })
    }

    /// Returns the names of the given options that only some exports read: of meshes, of vectors, of 16-bit heights.
    pub fn format_options(&self) -> [Vec<&'static str>; 3] {
        let CommonArguments { lod, mesh_error, quantize, meshopt, even_borders, mesh_origin, .. } = &self.common;
        let CommonArguments { vectors, height_range, .. } = &self.common;
        let meshes = [
            (lod.is_some(), "--lod"),
            (mesh_error.is_some(), "--mesh-error"),
            (*quantize, "--quantize"),
            (*meshopt, "--meshopt"),
            (*even_borders, "--even-borders"),
            (mesh_origin.is_some(), "--mesh-origin"),
        ];
        let heights = [(height_range.is_some(), "--height-range")];
        [given(&meshes), vectors.given(), given(&heights)]
    }

    pub fn exports(&self) -> Result<Vec<Export>, Error> {
        match (&self.common.export, &self.common.profile) {
            (Some(list), _) => Export::parse_list(list),
            (None, None) => Export::parse_list(Export::DEFAULT),
            // A profile brings its own exports; any others must be named.
            (None, Some(_)) => Ok(Vec::new()),
        }
    }

    pub fn profile(&self) -> Result<Option<Profile>, Error> {
        self.common.profile.as_deref().map(str::parse).transpose()
    }
}
