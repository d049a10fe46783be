//! What every format has to say of itself. The plan of a bake, the help, the registry and the removal of old files ask
//! the [list](super::formats) and nobody by name.

use std::path::Path;

use crate::area::{Place, Region};
use crate::bake::Sink;
use crate::error::Error;
use crate::export::options::{MeshOptions, TileNames, VectorOptions};
use crate::land::Land;
use crate::tile::accumulation_input;
use crate::walker::Walk;
use crate::world::World;

/// What a bake asks of its formats.
#[derive(Clone, Copy)]
pub(crate) struct Request<'a> {
    /// The name of the preset.
    pub name: &'a str,
    pub world: &'a World,
    pub region: Region,
    pub meshes: &'a MeshOptions,
    pub vectors: &'a VectorOptions,
    pub names: TileNames,
    /// Metres of the least and of the greatest step of 16-bit heights.
    pub height_range_m: (f32, f32),
    /// The walk whose tiles are shown, if they are not all of the region.
    pub walk: Option<&'a Walk>,
    /// Whether the tiles are those of a shard: what sinks keep of them is written down, and the same however often it is made.
    pub is_shard: bool,
}

impl Request<'_> {
    /// How many tiles there are.
    pub fn tiles(&self) -> u64 {
        self.walk.map_or(self.region.tiles(), |walk| walk.tiles().len() as u64)
    }

    /// Their vertices; of a walk those of its edges are counted with each tile.
    pub fn vertices(&self) -> u64 {
        let side = u64::from(self.region.tile_cells()) + 1;
        self.walk.map_or(self.region.vertices(), |walk| walk.tiles().len() as u64 * side * side)
    }
}

/// Memory that a format takes while it is written, beside the tiles themselves; and its files.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct FormatCost {
    /// Files.
    pub files: u64,
    /// The most bytes that are kept of each vertex until its row of tiles is written: the row waits whole, and so does the next.
    pub kept_a_vertex: u64,
    /// The most bytes that a thread takes to draw a tile and to pack its file.
    pub thread_bytes: u64,
    /// The most bytes that are held besides, once.
    pub held_bytes: u64,
    /// Worlds that remember as much as the one that is baked.
    pub worlds: u64,
}

impl FormatCost {
    /// The cost of two formats together: a thread makes the files of one after those of the other, so the larger of both counts there.
    pub fn and(self, other: FormatCost) -> FormatCost {
        FormatCost {
            files: self.files.saturating_add(other.files),
            kept_a_vertex: self.kept_a_vertex + other.kept_a_vertex,
            thread_bytes: self.thread_bytes.max(other.thread_bytes),
            held_bytes: self.held_bytes.saturating_add(other.held_bytes),
            worlds: self.worlds + other.worlds,
        }
    }
}

/// What a thread takes to find how much land drains through each vertex of a tile, and what grows there: of each vertex of the land
/// around the tile its height, water, eight shares, and what has come there before a step and after it; and four densities.
pub(crate) fn accumulation_bytes(region: &Region) -> u64 {
    let tile = region.at().area(region.tile_cells());
    let around = accumulation_input(tile).len() as u64;
    around * (Land::VERTEX_BYTES + 8 * 4 + 2 * 4) + tile.len() as u64 * (4 + 4 * 4)
}

/// What a format would show and a world has not, in words of an error.
pub(crate) struct Lack {
    /// What the format shows.
    pub shows: &'static str,
    /// What the world has instead.
    pub has: &'static str,
    /// What preset to bake for it.
    pub preset: &'static str,
}

/// A format: something that a bake can leave. It lives in one file, and in the list.
pub(crate) trait Format: Sync {
    /// The name, as the command and the manifest know it.
    fn name(&self) -> &'static str;

    /// What the format holds, in a few words.
    fn about(&self) -> &'static str;

    /// What a world has not and it would show. Default: nothing.
    fn lacks(&self, _world: &World) -> Option<Lack> {
        None
    }

    /// Whether it shows tiles as they are given, and not what the world says of their place; and where it is of the region, can be
    /// silent where no tile is. Others cannot show a walk. Default: no.
    fn shows_walks(&self) -> bool {
        false
    }

    /// Whether it can hold what is asked for. Default: it holds everything.
    ///
    /// # Errors
    /// When it cannot; the hint says what will do.
    fn check(&self, _request: &Request) -> Result<(), Error> {
        Ok(())
    }

    /// Whether its files can hold the meshes that are asked for; looked at when it is known how these are made. Default: they can.
    ///
    /// # Errors
    /// When they cannot, however small the meshes turn out to be; the hint says what will do.
    fn check_meshes(&self, _request: &Request) -> Result<(), Error> {
        Ok(())
    }

    /// What may turn out only when it is made: that its files cannot hold it. Default: nothing.
    fn warning(&self, _request: &Request) -> Option<String> {
        None
    }

    /// The name of the format that its files refer to, and which must be baked with it. Default: none.
    fn needs(&self) -> Option<&'static str> {
        None
    }

    /// The options of the command that only some formats read, and that this one reads. Default: none.
    fn options(&self) -> &'static [&'static str] {
        &[]
    }

    /// The folders of its files in that of the bake; `""` is that folder itself.
    fn folders(&self) -> Vec<&'static str>;

    /// The rasters that have a tile's vertices, as the registry lists them. Default: none.
    fn rasters_of(&self, _region: &Region, _place: Place, _names: TileNames) -> Vec<String> {
        Vec::new()
    }

    /// Whether all that it leaves are files of single tiles, which are the same in every region that has them. Default: no.
    fn is_of_tiles_alone(&self) -> bool {
        false
    }

    /// How many files it has, and what memory these take.
    fn cost(&self, request: &Request) -> FormatCost;

    /// By what its files grow: by tiles, unless it counts something else. Default: nothing else.
    fn units(&self, _request: &Request) -> Option<u64> {
        None
    }

    /// For each of its sinks the piece of a tile that shows nothing, if the sink needs one to end a region of one tile; or `None`. Files
    /// that are ended so have bytes that count once and not for each tile: empty tables of a database, or texts of a picture about
    /// itself. Default: none.
    fn blank_pieces(&self, _request: &Request) -> Option<Vec<Vec<u8>>> {
        None
    }

    /// The sinks that write it into the folder of a bake.
    ///
    /// # Errors
    /// When a file cannot be begun.
    fn sinks<'a>(&self, request: &Request<'a>, out: &Path) -> Result<Vec<Box<dyn Sink + 'a>>, Error>;
}

/// The folder of a path in that of a bake, `""` for that folder itself.
pub(crate) fn folder(path: &str) -> &str {
    path.split_once('/').map_or("", |parts| parts.0)
}

/// The path without its folder.
pub(crate) fn file_name(path: &str) -> &str {
    path.rsplit_once('/').map_or(path, |parts| parts.1)
}
