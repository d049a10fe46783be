//! Arguments of `bake`, `tile`, `extend` and `merge`.

use std::path::PathBuf;

use clap::Args;

use super::Named;
use super::place::PlaceArguments;
use super::shared::{FolderArguments, Manner, RunOptions, VectorArguments, WorldArguments, given};
use super::values::parse_numbers;
use crate::area::{MAX_COORDINATE, Region, Stride, TileId};
use crate::bake::Shard;
use crate::error::Error;
use crate::export::{Export, Lods, MeshOptions, Mode, Profile, TileNames};
use crate::mesh::middle;
use crate::preset::Sources;

#[derive(Args)]
pub struct BakeArguments {
    #[command(flatten)]
    pub world: WorldArguments,
    #[command(flatten)]
    pub place: PlaceArguments,
    /// Bake one shard of the region alone: 3/16 is the third of sixteen equal rectangles of its tiles. A shard has
    /// files of tiles only; terrane merge makes those of the region when all shards are baked.
    #[arg(long, value_name = "I/N", conflicts_with = "add")]
    pub shard: Option<Shard>,
    #[command(flatten)]
    pub common: CommonArguments,
    #[command(flatten)]
    pub write: WriteArguments,
}

#[derive(Args)]
pub struct TileArguments {
    #[command(flatten)]
    pub world: WorldArguments,
    /// Tiles east of tile (0, 0); may be negative.
    #[arg(allow_negative_numbers = true)]
    pub x: i64,
    /// Tiles south of tile (0, 0); may be negative.
    #[arg(allow_negative_numbers = true)]
    pub y: i64,
    #[command(flatten)]
    pub common: CommonArguments,
    #[command(flatten)]
    pub write: WriteArguments,
}

#[derive(Args)]
#[command(mut_arg("at", |at| at.help("North-western tile of the region, the larger one [default: the bake's]")))]
#[command(mut_arg("size", |size| size.help("Size of the region in tiles [default: to the bake's far edges]")))]
pub struct ExtendArguments {
    /// Folder of the bake.
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
    #[command(flatten)]
    pub place: PlaceArguments,
    #[command(flatten)]
    pub manner: Manner,
}

#[derive(Args)]
pub struct MergeArguments {
    /// Folders of the shards, in any order. Shards may share tiles if the bytes are the same.
    #[arg(required = true, value_name = "DIR")]
    pub shards: Vec<PathBuf>,
    #[command(flatten)]
    pub folder: FolderArguments,
    #[command(flatten)]
    pub run: RunOptions,
}

/// The files of a bake.
#[derive(Args)]
pub struct CommonArguments {
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
    #[command(flatten)]
    pub meshes: MeshArguments,
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
    /// Keep every N-th vertex in each direction, of land as it looks from that far: 2, 4, 8 and so on to 4096.
    #[arg(long, alias = "scale", value_name = "N", default_value = "1", value_parser = parse_stride)]
    pub stride: Stride,
    /// Refuse to bake unless this program makes the worlds of the given version.
    #[arg(long, value_name = "VERSION")]
    pub generator: Option<String>,
}

/// Options for meshes.
#[derive(Args)]
#[command(next_help_heading = "Meshes")]
pub struct MeshArguments {
    /// Levels of detail of meshes, such as 0..3: level 0 has every vertex, each further level twice the error of the
    /// one before [default: 0, or the profile's].
    #[arg(long, value_name = "LODS", allow_hyphen_values = true)]
    pub lod: Option<Lods>,
    /// Largest error of LOD 1 at any vertex, in metres [default: a quarter of the spacing].
    #[arg(long, value_name = "METRES", allow_negative_numbers = true)]
    pub mesh_error: Option<f64>,
    /// Write the numbers of glTF in 8 and 16 bits (KHR_mesh_quantization).
    #[arg(long)]
    pub quantize: bool,
    /// Compress the numbers of glTF (EXT_meshopt_compression; Blender cannot read it).
    #[arg(long)]
    pub meshopt: bool,
    /// Keep all vertices of the finest level on the edges of tiles, so that tiles of different levels meet without a
    /// crack.
    #[arg(long)]
    pub even_borders: bool,
    /// The origin of all meshes, and of the positions in a profile's IMPORT.md: middle for the middle of the region, or
    /// metres east and north in the world [default: the world's origin, or far away from it a nearer place, which
    /// neighbouring regions share].
    #[arg(long, value_name = "middle|X,Y", allow_hyphen_values = true, value_parser = parse_origin)]
    pub mesh_origin: Option<AskedOrigin>,
}

/// The folder of a bake, and how it is written.
#[derive(Args)]
pub struct WriteArguments {
    #[command(flatten)]
    pub folder: FolderArguments,
    /// Add the exports to the bake of the same world and region that is in the folder; its files stay as they are.
    #[arg(long, help_heading = "Folder", conflicts_with_all = ["overwrite", "resume"])]
    pub add: bool,
    #[command(flatten)]
    pub manner: Manner,
}

impl WriteArguments {
    /// Returns the way in which the folder is written to.
    pub fn mode(&self) -> Mode {
        if self.add { Mode::Add } else { self.folder.mode() }
    }
}

/// The origin of meshes that the user asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AskedOrigin {
    /// The middle of the region.
    Middle,
    /// Metres east and north of the world's origin.
    Metres([f64; 2]),
}

/// The range of heights that the user asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AskedRange {
    /// The range of the region.
    Auto,
    /// Lowest and highest height in metres.
    Metres([f32; 2]),
}

/// Baking one tile is baking a region of one tile.
impl From<TileArguments> for BakeArguments {
    fn from(TileArguments { world, x, y, common, write }: TileArguments) -> BakeArguments {
        let place = PlaceArguments { at: Some(TileId { x, y }), size: Some((1, 1)), bounds: None, around: None };
        BakeArguments { world, place, shard: None, common, write }
    }
}

impl BakeArguments {
    /// Returns the preset with the settings of the options applied.
    pub fn sources(&self) -> Result<Sources, Error> {
        self.world.sources_in_tiles(self.common.tile_cells)
    }

    /// True if an option sets the size of the region or of its tiles. --stride counts too, as it changes a given region.
    pub fn asks_for_size(&self) -> bool {
        let PlaceArguments { size, bounds, around, .. } = &self.place;
        let CommonArguments { tile_cells, stride, .. } = &self.common;
        let is_size = |setting: &String| setting.split('=').next().is_some_and(|key| key.trim() == "tile_cells");
        let in_tiles = size.is_some() || tile_cells.is_some() || self.world.set.iter().any(is_size);
        in_tiles || bounds.is_some() || around.is_some() || *stride != Stride::ONE
    }

    /// Returns the options for the meshes of a region.
    ///
    /// # Errors
    /// Fails if no vertex lies at the origin that is asked for.
    pub fn meshes(&self, region: &Region, spacing_m: f64) -> Result<MeshOptions, Error> {
        let MeshArguments { lod, mesh_error, quantize, meshopt, even_borders, mesh_origin } = &self.common.meshes;
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
        let MeshArguments { lod, mesh_error, quantize, meshopt, even_borders, mesh_origin } = &self.common.meshes;
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

fn export_names() -> Vec<&'static str> {
    Export::all().map(Export::name).collect()
}

fn profile_names() -> Vec<&'static str> {
    Profile::ALL.into_iter().map(Profile::name).collect()
}

fn export_help() -> String {
    let line = |export: Export| format!("\n  {:20} {}", export.name(), export.about());
    let list: String = Export::all().map(line).collect();
    format!("What to write, with commas between [default: {}, or what the profile needs]:{list}", Export::DEFAULT)
}

fn profile_help() -> String {
    let line = |profile: Profile| format!("\n  {:15} {}", profile.name(), profile.about());
    let list: String = Profile::ALL.into_iter().map(line).collect();
    format!("The program that the files are for; IMPORT.md beside them has the numbers to type:{list}")
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

/// Reads a stride such as 4, or 1/4.
fn parse_stride(text: &str) -> Result<Stride, String> {
    let stride = text.strip_prefix("1/").unwrap_or(text).parse().ok().and_then(Stride::new);
    let paper = if text.contains(':') { "; a scale on paper is for map and atlas" } else { "" };
    stride.ok_or_else(|| format!("expected 1, 2, 4, 8 and so on to 4096{paper}"))
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
