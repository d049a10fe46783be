//! Arguments of `walk`.

use std::path::PathBuf;

use clap::Args;

use super::Named;
use super::shared::{CameraArguments, FolderArguments, Manner, VectorArguments, WorldArguments};
use super::values::parse_tile;
use crate::area::TileId;
use crate::error::Error;
use crate::export::{Export, TileNames};
use crate::preset::Sources;
use crate::walker::{Tour, Way};

#[derive(Args)]
pub struct WalkArguments {
    #[command(flatten)]
    pub world: WorldArguments,
    /// The walker's way, straight from place to place: a text file with one place per line, metres east and north of
    /// the origin with a comma between.
    #[arg(long, value_name = "FILE", help_heading = "Camera")]
    #[arg(conflicts_with_all = ["minutes", "speed", "at"])]
    pub path: Option<PathBuf>,
    #[command(flatten)]
    pub camera: CameraArguments,
    /// Tile in whose middle the camera starts: tiles east and tiles south of tile 0,0; may be negative.
    #[arg(long, value_name = "X,Y", default_value = "0,0", allow_hyphen_values = true, value_parser = parse_tile)]
    #[arg(help_heading = "Camera")]
    pub at: TileId,
    /// Layers of tiles around the walker's own tile, made as the walker comes near.
    #[arg(long, value_name = "N", default_value_t = 1, help_heading = "Camera")]
    pub layers: u32,
    /// Cells a tile side, 16 to 4096 [default: the preset's].
    #[arg(long, value_name = "N")]
    pub tile_cells: Option<u32>,
    /// The exports to write, with commas between: files of tiles, vectors, hashes, and those files of the region around
    /// all tiles that may be empty where there is no tile.
    #[arg(long, value_name = "LIST", default_value = Export::DEFAULT_OF_WALKS, long_help = walk_export_help())]
    #[arg(value_parser = Named(walk_export_names), hide_possible_values = true)]
    pub export: String,
    /// Name files of tiles after the place of the tile in the region, which lies around all, or after its number in the
    /// world.
    #[arg(long, value_name = "region|world", default_value = "world")]
    pub names: TileNames,
    #[command(flatten)]
    pub vectors: VectorArguments,
    #[command(flatten)]
    pub folder: FolderArguments,
    #[command(flatten)]
    pub manner: Manner,
}

impl WalkArguments {
    /// Returns the preset with the settings of the options applied.
    pub fn sources(&self) -> Result<Sources, Error> {
        self.world.sources_in_tiles(self.tile_cells)
    }

    /// Returns the tour that the options ask for.
    pub fn tour(&self) -> Result<Tour, Error> {
        let WalkArguments { path, camera: CameraArguments { minutes, speed }, at, layers, .. } = self;
        let way = match path {
            Some(path) => Way::of_file(path)?,
            None => Way::Camera { at: *at, minutes: *minutes, speed_m_s: *speed },
        };
        Ok(Tour { way, layers: *layers })
    }
}

/// Returns the names of the exports that walks can write.
fn walk_export_names() -> Vec<&'static str> {
    Export::of_walks().map(Export::name).collect()
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
