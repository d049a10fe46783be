//! The registry of a bake: a row a tile, in the order in which all files have their tiles.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Mutex;

use crate::area::{Area, Place, Region};
use crate::bake::{FileRecord, Sink};
use crate::error::Error;
use crate::export::{Export, locked};
use crate::file::PartFile;
use crate::lines::{LineId, LineKind};
use crate::registry::{FILE_NAME, Registry, Start, TileRow};
use crate::tile::{Tile, TilePart};
use crate::watch::Watch;

/// Writes `registry.sqlite`, which every bake leaves.
pub(crate) struct BakeRegistry {
    region: Region,
    exports: Vec<Export>,
    /// Rows of tiles that are made and not yet written: two batches at most.
    made: Mutex<BTreeMap<Place, TileRow>>,
    /// The registry first, so that it is closed when an abandoned file is removed.
    file: Mutex<Option<(Registry, PartFile)>>,
}

impl BakeRegistry {
    /// Begins the registry in the folder of a bake with those exports.
    pub fn create(exports: &[Export], region: Region, out: &Path) -> Result<BakeRegistry, Error> {
        let mut file = PartFile::create(out.join(FILE_NAME))?;
        let registry = Registry::aside(file.lend())?;
        Ok(BakeRegistry {
            region,
            exports: exports.to_vec(),
            made: Mutex::default(),
            file: Mutex::new(Some((registry, file))),
        })
    }

    /// The most bytes of the file.
    pub fn bytes_at_most(exports: &[Export], region: &Region) -> u64 {
        // It has the longest names, for its numbers are the largest.
        let last = Place { row: region.rows() - 1, col: region.cols() - 1 };
        let names: usize = files(exports, region, last).map(|name| name.len() + 3).sum();
        // How many lines concern a tile shows only when it is made; this is room for a hundred with ids of 24 characters.
        const LINES: usize = 100 * 24;
        // Hashes, six integers of at most 9 bytes, two directions and the header of the row; a tree's pages are at least
        // half full, and what is too long for its page takes whole pages besides.
        let row = 2 * (34 * TilePart::ALL.len() + 6 * 9 + 2 * 5 + 32 + names + LINES) as u64;
        let overflow = 4096;
        region.tiles().saturating_mul(row + overflow).saturating_add(4 * 4096)
    }
}

/// The rasters that have the vertices of the tile at a place.
fn files(exports: &[Export], region: &Region, place: Place) -> impl Iterator<Item = String> {
    exports.iter().flat_map(move |export| export.0.rasters_of(region, place))
}

/// Where a line of a kind starts on a tile, if one does; of several the first by id. Agents' lines start on the tile that
/// owns them.
fn start(tile: &Tile, kind: LineKind) -> Option<Start> {
    let Area { x0, y0, x1, y1 } = tile.area();
    let starts = |id: LineId, [x, y]: [i64; 2]| match id {
        LineId::Agent { owner, .. } => owner == tile.id(),
        _ => (x0..x1 - 1).contains(&x) && (y0..y1 - 1).contains(&y),
    };
    tile.lines().iter().find(|line| line.kind == kind && starts(line.id, line.origin)).map(|line| Start::of(line))
}

impl Sink for BakeRegistry {
    fn name(&self) -> &str {
        FILE_NAME
    }

    fn take(&self, tile: &Tile, place: Place) -> Result<Vec<u8>, Error> {
        let row = TileRow {
            tile: tile.id(),
            river: start(tile, LineKind::River),
            road: start(tile, LineKind::Road),
            lines: tile.lines().iter().map(|line| line.id.to_string()).collect(),
            digest: Some(tile.digest()),
            // Named when the row is written: until then they would only take room.
            files: Vec::new(),
            record: None,
        };
        locked(&self.made).insert(place, row);
        Ok(Vec::new())
    }

    fn append(&self, row: u64, _pieces: &[&[u8]]) -> Result<(), Error> {
        let written = {
            let mut made = locked(&self.made);
            // Tiles of the next rows may be made already, in any order.
            let later = made.split_off(&Place { row: row + 1, col: 0 });
            std::mem::replace(&mut *made, later)
        };
        let rows = written.into_iter().map(|(place, row)| {
            let files = files(&self.exports, &self.region, place).collect();
            TileRow { files, ..row }
        });
        let mut file = locked(&self.file);
        file.as_mut().expect("rows come before the end").0.append(rows)
    }

    fn finish(&self, _watch: &Watch) -> Result<Vec<FileRecord>, Error> {
        let file = locked(&self.file).take();
        let (registry, file) = file.expect("a sink ends once");
        registry.close()?;
        Ok(vec![FileRecord::new(FILE_NAME.to_owned(), "registry", file.finish()?)])
    }
}
