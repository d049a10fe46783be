//! A list of what each tile is, as hashes ([`Digest`](crate::tile::Digest)): the cheapest proof that two bakes agree.

use std::io::Write;
use std::path::Path;
use std::sync::Mutex;

use crate::area::{Place, Region};
use crate::bake::Sink;
use crate::error::Error;
use crate::export::file::PartFile;
use crate::export::manifest::FileRecord;
use crate::tile::{Channel, Tile};

/// The file in the folder of the bake.
pub(crate) const PATH: &str = "hashes.txt";

/// The most bytes of a tile's line: two numbers of at most 20 characters, a hash of 64 for each channel, and separators.
pub(crate) const LINE_BYTES: u64 = 2 * 21 + 65 * Channel::ALL.len() as u64;

/// One line a tile: its number and the hash of each of its channels; the first line names them.
pub(crate) struct TileHashes {
    region: Region,
    file: Mutex<Option<PartFile>>,
}

impl TileHashes {
    /// Begins the list in the folder of the bake.
    pub fn create(region: Region, out: &Path) -> Result<TileHashes, Error> {
        let mut file = PartFile::create(out.join(PATH))?;
        let names = Channel::ALL.map(Channel::name).join(" ");
        writeln!(file, "# x y {names}").map_err(Error::io(file.path()))?;
        Ok(TileHashes { region, file: Mutex::new(Some(file)) })
    }
}

impl Sink for TileHashes {
    fn name(&self) -> &str {
        PATH
    }

    fn take(&self, tile: &Tile, _place: Place) -> Result<Vec<u8>, Error> {
        Ok(tile.digest().to_string().into_bytes())
    }

    fn append(&self, row: u64, pieces: &[&[u8]]) -> Result<(), Error> {
        let mut file = self.file.lock().expect("no thread panics while it writes");
        let file = file.as_mut().expect("rows come before the end");
        for (col, piece) in (0..).zip(pieces) {
            let id = self.region.tile(Place { row, col });
            write!(file, "{} {} ", id.x, id.y).map_err(Error::io(file.path()))?;
            file.write_all(piece).and_then(|()| writeln!(file)).map_err(Error::io(file.path()))?;
        }
        Ok(())
    }

    fn finish(&self) -> Result<Vec<FileRecord>, Error> {
        let file = self.file.lock().expect("no thread panics while it writes").take();
        let finished = file.expect("a sink ends once").finish()?;
        Ok(vec![FileRecord::new(PATH.to_owned(), "hashes", finished)])
    }
}
