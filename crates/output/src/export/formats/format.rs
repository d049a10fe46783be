//! The trait of all formats. The plan of a bake, the help, the registry and the removal of old files go through the
//! [list](super::formats) of formats and never refer to a single format by name.

use std::path::Path;

use crate::area::{Place, Region};
use crate::bake::Sink;
use crate::error::Error;
use crate::export::plan::options::{MeshOptions, TileNames, VectorOptions};
use crate::walker::Walk;
use crate::world::World;

/// A bake, as its formats see it.
#[derive(Clone, Copy)]
pub(crate) struct Request<'a> {
    /// The name of the preset.
    pub name: &'a str,
    pub world: &'a World,
    pub region: Region,
    pub meshes: &'a MeshOptions,
    pub vectors: &'a VectorOptions,
    pub names: TileNames,
    /// Metres of the lowest and of the highest step of 16-bit heights.
    pub height_range_m: (f32, f32),
    /// The walk whose tiles are shown, if they are not all tiles of the region.
    pub walk: Option<&'a Walk>,
    /// True if the tiles are those of a shard. Then the pieces that sinks keep of tiles are stored on disk, and must be
    /// the same however often the shard is baked.
    pub is_shard: bool,
}

impl Request<'_> {
    /// Returns the number of tiles.
    pub fn tiles(&self) -> u64 {
        self.walk.map_or(self.region.tiles(), |walk| walk.tiles().len() as u64)
    }

    /// Returns the number of vertices; of a walk, vertices on the edges between tiles count with each tile.
    pub fn vertices(&self) -> u64 {
        let side = u64::from(self.region.tile_cells()) + 1;
        self.walk.map_or(self.region.vertices(), |walk| walk.tiles().len() as u64 * side * side)
    }
}

/// Something that a format shows and a world lacks, in words for an error message.
pub(crate) struct Lack {
    /// The thing that the format shows.
    pub shows: &'static str,
    /// The thing that the world has instead.
    pub has: &'static str,
    /// The preset to bake for this format.
    pub preset: &'static str,
}

/// A format: a kind of files that a bake can leave. Each format lives in one file, and in the list.
pub(crate) trait Format: Sync {
    /// Returns the name, as on the command line and in the manifest.
    fn name(&self) -> &'static str;

    /// Returns a description of the format in a few words.
    fn about(&self) -> &'static str;

    /// Returns the thing that the format shows and the world lacks. Default: nothing.
    fn lacks(&self, _world: &World) -> Option<Lack> {
        None
    }

    /// True if the format can show a walk: it shows tiles as they are given and does not ask the world about their
    /// surroundings, and if it is one of the whole region, it can leave places without a tile empty. Default: no.
    fn shows_walks(&self) -> bool {
        false
    }

    /// Checks that the format can hold what is asked for. Default: it holds everything.
    ///
    /// # Errors
    /// When it cannot; the hint says what will do.
    fn check(&self, _request: &Request) -> Result<(), Error> {
        Ok(())
    }

    /// Checks that the format's files can hold the meshes that are asked for. Called when the mesh options are known.
    /// Default: they can.
    ///
    /// # Errors
    /// When they cannot, however small the meshes turn out to be; the hint says what will do.
    fn check_meshes(&self, _request: &Request) -> Result<(), Error> {
        Ok(())
    }

    /// Returns a warning if the format may prove unable to hold the contents of its files, which shows only when they
    /// are made. Default: none.
    fn warning(&self, _request: &Request) -> Option<String> {
        None
    }

    /// Returns the name of the format that its files refer to, and which must be baked with it. Default: none.
    fn needs(&self) -> Option<&'static str> {
        None
    }

    /// Returns those options that this format reads, among the command's options that only some formats read. Default:
    /// none.
    fn options(&self) -> &'static [&'static str] {
        &[]
    }

    /// Returns the folders of its files, relative to the folder of the bake; `""` is that folder itself.
    fn folders(&self) -> Vec<&'static str>;

    /// Returns the paths of the rasters that hold a tile's vertices, as the registry lists them. Default: none.
    fn rasters_of(&self, _region: &Region, _place: Place, _names: TileNames) -> Vec<String> {
        Vec::new()
    }

    /// True if all its files belong to single tiles and are the same in every region that has those tiles. Default: no.
    fn is_of_tiles_alone(&self) -> bool {
        false
    }

    /// Returns the number of its files.
    fn files(&self, request: &Request) -> u64;

    /// Returns the largest number of bytes kept of each vertex until its row of tiles is written. Default: none.
    fn kept_a_vertex(&self, _request: &Request) -> u64 {
        0
    }

    /// Returns the largest number of bytes of memory, on so many threads, that do not belong to the tiles in work.
    /// Default: none.
    fn held_bytes(&self, _request: &Request, _threads: usize) -> u64 {
        0
    }

    /// Returns the number of units by which its files grow, if these are not tiles. Default: `None`, for files that
    /// grow by tiles.
    fn units(&self, _request: &Request) -> Option<u64> {
        None
    }

    /// Returns for each sink the piece of a tile that shows nothing, if the sink needs such a piece to end a region of
    /// one tile; or `None`. Files that are ended so show the bytes that count once and not for each tile: empty tables
    /// of a database, or the texts in which a picture describes itself. Default: none.
    fn blank_pieces(&self, _request: &Request) -> Option<Vec<Vec<u8>>> {
        None
    }

    /// Creates the sinks that write the format into the folder of a bake.
    ///
    /// # Errors
    /// When a file cannot be begun.
    fn sinks<'a>(&self, request: &Request<'a>, out: &Path) -> Result<Vec<Box<dyn Sink + 'a>>, Error>;
}

/// Returns the folder of a path in the folder of the bake, or `""` if the path has none.
pub(crate) fn folder(path: &str) -> &str {
    path.split_once('/').map_or("", |parts| parts.0)
}

/// Returns the path without its folder.
pub(crate) fn file_name(path: &str) -> &str {
    path.rsplit_once('/').map_or(path, |parts| parts.1)
}
