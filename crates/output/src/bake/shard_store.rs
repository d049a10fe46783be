//! The store of a shard: a file of the bytes that sinks keep of its tiles, until all shards of the region are merged.
//!
//! The file has a block per tile, from north to south and from west to east, each preceded by its length. A block is
//! the tile's number, and then the bytes that each sink keeps of it, compressed. The same shard always has the same
//! bytes, because a sink's bytes of a tile depend on the tile alone.

use std::fs::File;
use std::io::{self, BufReader, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use flate2::Compression;
use flate2::bufread::DeflateDecoder;
use flate2::write::DeflateEncoder;

use crate::area::{Place, Region, TileId};
use crate::bake::{FileRecord, Kept, Sink, frames};
use crate::clock::Clock;
use crate::error::Error;
use crate::file::PartFile;
use crate::tile::Tile;
use crate::watch::Watch;

/// Name of the file in the folder of a shard.
pub(crate) const PATH: &str = "shard.tiles";

/// Name of the export in the manifest.
pub(crate) const EXPORT: &str = "shard";

/// The fastest level: on 16-bit heights the slower levels save a few hundredths, in three times the time.
const LEVEL: Compression = Compression::new(1);

/// The sink of a shard: stores the bytes that the sinks of the whole region would be handed.
pub(crate) struct Store<'a> {
    /// The region of which the shard is a part.
    whole: Region,
    sinks: Vec<Box<dyn Sink + 'a>>,
    file: Mutex<Option<PartFile>>,
}

impl<'a> Store<'a> {
    /// Creates the file in the folder of the shard, for the bytes of `sinks`, the sinks of the whole region.
    pub fn create(whole: Region, sinks: Vec<Box<dyn Sink + 'a>>, out: &Path) -> Result<Store<'a>, Error> {
        let file = PartFile::create(out.join(PATH))?;
        Ok(Store { whole, sinks, file: Mutex::new(Some(file)) })
    }
}

impl Sink for Store<'_> {
    fn name(&self) -> &str {
        EXPORT
    }

    fn take(&self, tile: &Tile, _place: Place, clock: &Clock) -> Result<Kept, Error> {
        let place = self.whole.place(tile.id()).expect("a shard is a part of its region");
        let (mut pieces, mut files) = (Vec::new(), Vec::new());
        for sink in &self.sinks {
            let kept = sink.take(tile, place, clock)?;
            frames::push(&mut pieces, &kept.piece);
            files.extend(kept.files);
        }
        Ok(Kept { piece: packed(tile.id(), &pieces), files })
    }

    fn append(&self, _row: u64, blocks: &[&[u8]], _clock: &Clock) -> Result<(), Error> {
        let mut file = self.file.lock().expect("no thread panics while it writes");
        let file = file.as_mut().expect("rows come before the end");
        blocks.iter().try_for_each(|block| frames::write(file, block)).map_err(Error::io(file.path()))
    }

    fn finish(&self, _watch: &Watch) -> Result<Vec<FileRecord>, Error> {
        let file = self.file.lock().expect("no thread panics while it writes").take();
        let finished = file.expect("a sink ends once").finish()?;
        Ok(vec![FileRecord::new(PATH.to_owned(), EXPORT, finished)])
    }
}

/// Returns the block of a tile.
fn packed(TileId { x, y }: TileId, pieces: &[u8]) -> Vec<u8> {
    let mut block = [x, y].map(i64::to_le_bytes).concat();
    block.reserve(pieces.len() / 2);
    let mut encoder = DeflateEncoder::new(block, LEVEL);
    encoder.write_all(pieces).expect("memory takes everything");
    encoder.finish().expect("memory takes everything")
}

/// Returns the bytes that each of `sinks` sinks kept of a tile, from the tile's block; `None` if the block is another
/// tile's or damaged.
fn unpacked(block: &[u8], tile: TileId, sinks: usize) -> Option<Vec<Vec<u8>>> {
    let (number, packed) = block.split_at_checked(16)?;
    if number != [tile.x, tile.y].map(i64::to_le_bytes).as_flattened() {
        return None;
    }
    let mut pieces = Vec::new();
    DeflateDecoder::new(packed).read_to_end(&mut pieces).ok()?;
    let pieces: Vec<Vec<u8>> = frames::pieces(&pieces).map(<[u8]>::to_vec).collect();
    (pieces.len() == sinks).then_some(pieces)
}

/// The blocks of a shard, read one after the other.
pub(crate) struct Blocks {
    path: PathBuf,
    file: BufReader<File>,
    /// Number of bytes left.
    left: u64,
}

/// The block of a tile, as it was read.
pub(crate) struct StoredTile(Vec<u8>);

impl Blocks {
    /// Opens the store in the folder of a shard.
    pub fn open(folder: &Path) -> Result<Blocks, Error> {
        let path = folder.join(PATH);
        let file = File::open(&path).map_err(Error::io(&path))?;
        let left = file.metadata().map_err(Error::io(&path))?.len();
        Ok(Blocks { path, file: BufReader::with_capacity(1 << 20, file), left })
    }

    /// Reads the next block.
    pub fn next(&mut self) -> Result<StoredTile, Error> {
        let mut length = [0; 8];
        let mut read = || {
            self.file.read_exact(&mut length)?;
            let length = u64::from_le_bytes(length);
            // Refuse a length beyond the end of the file, whatever the file says.
            self.left =
                self.left.checked_sub(8).and_then(|left| left.checked_sub(length)).ok_or(io::ErrorKind::InvalidData)?;
            let mut block = vec![0; length as usize];
            self.file.read_exact(&mut block)?;
            Ok(StoredTile(block))
        };
        let read: io::Result<StoredTile> = read();
        read.map_err(Error::io(&self.path))
    }
}

impl StoredTile {
    /// Returns the bytes that each of `sinks` sinks kept of a tile, from what should be the tile's block in the folder
    /// of a shard.
    ///
    /// # Errors
    /// If the block differs from what was written.
    pub fn pieces(&self, tile: TileId, sinks: usize, folder: &Path) -> Result<Vec<Vec<u8>>, Error> {
        let lost =
            || Error::io(folder.join(PATH))(io::Error::new(io::ErrorKind::InvalidData, "is not as it was written"));
        unpacked(&self.0, tile, sinks).ok_or_else(lost)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_block_is_that_of_its_tile_and_of_as_many_sinks_as_there_were() {
        let tile = TileId { x: -3, y: i64::MAX };
        let mut pieces = Vec::new();
        for piece in [&b""[..], &[7; 1000]] {
            frames::push(&mut pieces, piece);
        }
        let block = packed(tile, &pieces);
        assert_eq!(unpacked(&block, tile, 2), Some(vec![vec![], vec![7; 1000]]));
        assert_eq!(unpacked(&block, tile, 3), None);
        assert_eq!(unpacked(&block, TileId { x: 3, ..tile }, 2), None);
        for length in 0..block.len() {
            assert_eq!(unpacked(&block[..length], tile, 2), None, "{length}");
        }
    }
}
