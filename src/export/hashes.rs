//! A list of what each tile is, as hashes: the cheapest proof that two bakes agree.

use std::io::Write;
use std::path::Path;
use std::sync::Mutex;

use crate::area::{Place, Region};
use crate::bake::FileRecord;
use crate::bake::Sink;
use crate::error::Error;
use crate::export::file::PartFile;
use crate::tile::Tile;

/// The file in the folder of the bake.
pub(crate) const PATH: &str = "hashes.txt";

/// One line a tile: its number and the BLAKE3 of all its bytes.
pub(crate) struct TileHashes {
    region: Region,
    file: Mutex<Option<PartFile>>,
}

impl TileHashes {
    /// Begins the list in the folder of the bake.
    pub fn create(region: Region, out: &Path) -> Result<TileHashes, Error> {
        Ok(TileHashes { region, file: Mutex::new(Some(PartFile::create(out.join(PATH))?)) })
    }
}

impl Tile {
    /// The hash of everything that the tile holds: heights with their pad, normals and blend weights.
    pub fn hash(&self) -> blake3::Hash {
        let mut hasher = blake3::Hasher::new();
        hasher.update(bytemuck::cast_slice(self.heights().values()));
        for axis in self.normals().axes() {
            hasher.update(bytemuck::cast_slice(axis.values()));
        }
        hasher.update(bytemuck::cast_slice(self.blend().ground().values()));
        hasher.update(bytemuck::cast_slice(self.blend().cover().values()));
        hasher.finalize()
    }
}

impl Sink for TileHashes {
    fn name(&self) -> &str {
        PATH
    }

    fn take(&self, tile: &Tile, _place: Place) -> Result<Vec<u8>, Error> {
        Ok(tile.hash().as_bytes().to_vec())
    }

    fn append(&self, row: u64, pieces: &[&[u8]]) -> Result<(), Error> {
        let mut file = self.file.lock().expect("no thread panics while it writes");
        let file = file.as_mut().expect("rows come before the end");
        for (col, piece) in (0..).zip(pieces) {
            let id = self.region.tile(Place { row, col });
            let hash = blake3::Hash::from_slice(piece).expect("take keeps whole hashes");
            writeln!(file, "{} {} {hash}", id.x, id.y).map_err(Error::io(file.path()))?;
        }
        Ok(())
    }

    fn finish(&self) -> Result<Vec<FileRecord>, Error> {
        let file = self.file.lock().expect("no thread panics while it writes").take();
        let finished = file.expect("a sink ends once").finish()?;
        Ok(vec![FileRecord::new(PATH.to_owned(), "hashes", finished)])
    }
}
