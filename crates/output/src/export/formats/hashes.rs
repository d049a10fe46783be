//! A list of the hashes of each tile: the cheapest proof that two bakes agree.

use std::io::Write;
use std::path::Path;
use std::sync::Mutex;

use crate::area::{Place, Region};
use crate::bake::{FileRecord, Kept, Sink};
use crate::clock::Clock;
use crate::error::Error;
use crate::export::formats::format::{Format, Request, folder};
use crate::export::formats::locked;
use crate::file::PartFile;
use crate::tile::{Tile, TilePart};
use crate::watch::Watch;

/// The file in the folder of the bake.
pub(crate) const PATH: &str = "hashes.txt";

/// The format `hashes`: a bake with it has one more file, the list of hashes.
pub(crate) struct Hashes;

impl Format for Hashes {
    fn name(&self) -> &'static str {
        "hashes"
    }

    fn about(&self) -> &'static str {
        "BLAKE3 of each tile's heights, normals, weights, water, beds, lines and sites"
    }

    fn shows_walks(&self) -> bool {
        true
    }

    fn folders(&self) -> Vec<&'static str> {
        vec![folder(PATH)]
    }

    fn files(&self, _request: &Request) -> u64 {
        1
    }

    fn blank_pieces(&self, _request: &Request) -> Option<Vec<Vec<u8>>> {
        Some(Vec::new())
    }

    fn sinks<'a>(&self, request: &Request<'a>, out: &Path) -> Result<Vec<Box<dyn Sink + 'a>>, Error> {
        Ok(vec![Box::new(TileHashes::create(request.region, out)?)])
    }
}

/// The sink that writes the list, one line per tile: the tile's x and y, and the hash of each of the tile's parts. The
/// first line names the parts.
pub(crate) struct TileHashes {
    region: Region,
    file: Mutex<Option<PartFile>>,
}

impl TileHashes {
    /// Begins the list in the folder of the bake.
    pub fn create(region: Region, out: &Path) -> Result<TileHashes, Error> {
        let mut file = PartFile::create(out.join(PATH))?;
        let names = TilePart::ALL.map(TilePart::name).join(" ");
        writeln!(file, "# x y {names}").map_err(Error::io(file.path()))?;
        Ok(TileHashes { region, file: Mutex::new(Some(file)) })
    }
}

impl Sink for TileHashes {
    fn name(&self) -> &str {
        PATH
    }

    fn take(&self, tile: &Tile, _place: Place, _clock: &Clock) -> Result<Kept, Error> {
        Ok(Kept { piece: tile.digest().to_string().into_bytes(), files: Vec::new() })
    }

    fn append(&self, row: u64, pieces: &[&[u8]], _clock: &Clock) -> Result<(), Error> {
        let mut file = locked(&self.file);
        let file = file.as_mut().expect("rows come before the end");
        for (col, piece) in (0..).zip(pieces).filter(|(_, piece)| !piece.is_empty()) {
            // Write the tile's x and y in the world, not its column and row in the region. So a tile that is in two
            // overlapping regions has the same line in the lists of both, and the lists can be compared.
            let id = self.region.tile(Place { row, col });
            write!(file, "{} {} ", id.x, id.y).map_err(Error::io(file.path()))?;
            file.write_all(piece).and_then(|()| writeln!(file)).map_err(Error::io(file.path()))?;
        }
        Ok(())
    }

    fn finish(&self, _watch: &Watch) -> Result<Vec<FileRecord>, Error> {
        let file = locked(&self.file).take();
        let finished = file.expect("a sink ends once").finish()?;
        Ok(vec![FileRecord::new(PATH.to_owned(), Hashes.name(), finished)])
    }
}
