//! The registry of a bake: a row a tile, in the order in which all files have their tiles.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Mutex;

use crate::agents::paths::PathEnding;
use crate::agents::way::WayKind;
use crate::area::{Place, Region};
use crate::bake::FileRecord;
use crate::bake::Sink;
use crate::error::Error;
use crate::export::Export;
use crate::export::file::PartFile;
use crate::registry::{FILE_NAME, Registry, Start, TileHashes, TileRow};
use crate::tile::Tile;

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
        let last = Place { row: region.rows() - 1, col: region.cols() - 1 };
        let names: usize = files(exports, region, last).map(|name| name.len() + 3).sum();
        // Three hashes, six integers of at most 9 bytes, two directions and the header of the row; a tree's pages are
        // at least half full.
        let row = 2 * (3 * 32 + 6 * 9 + 2 * 5 + 32 + names as u64);
        // What is too long for its page takes whole pages besides.
        let overflow = if names > 700 { 4096 } else { 0 };
        region.tiles().saturating_mul(row + overflow).saturating_add(4 * 4096)
    }
}

/// The rasters that have the vertices of the tile at a place.
fn files(exports: &[Export], region: &Region, place: Place) -> impl Iterator<Item = String> {
    exports.iter().flat_map(move |export| export.0.rasters_of(region, place))
}

impl Tile {
    /// The hashes of what the tile holds, each of its own: of the samples of its EXR, of those of its two blend maps, one
    /// after the other, and of its paths.
    pub fn hashes(&self) -> TileHashes {
        let area = self.area();
        // Without the pad, which no file has; in one piece, since the hash is several times as fast so.
        let own: Vec<f32> = (area.y0..area.y1).flat_map(|y| self.heights().row(y, area.x0, area.x1)).copied().collect();
        let heights = blake3::hash(bytemuck::cast_slice(&own));
        let mut blend = blake3::Hasher::new();
        blend.update(bytemuck::cast_slice(self.blend().ground().values()));
        blend.update(bytemuck::cast_slice(self.blend().cover().values()));
        let mut paths = blake3::Hasher::new();
        for path in self.paths() {
            let (kind, origin) = (path.way.kind(), path.way.origin());
            let (ending, at) = match path.ending {
                PathEnding::Sea => (0, path.owner),
                PathEnding::River(other) => (1, other),
                PathEnding::Pond => (2, path.owner),
                PathEnding::Nothing => (3, path.owner),
            };
            paths.update(&[u8::from(kind == WayKind::Road), ending]);
            for number in [path.owner.x, path.owner.y, at.x, at.y, origin.0, origin.1, path.way.points().len() as i64] {
                paths.update(&number.to_le_bytes());
            }
            for point in path.way.points() {
                for number in [point.east, point.south, point.half_width_m, point.floor_m] {
                    paths.update(&number.to_le_bytes());
                }
            }
        }
        TileHashes { heights, blend: blend.finalize(), paths: paths.finalize() }
    }
}

impl Sink for BakeRegistry {
    fn name(&self) -> &str {
        FILE_NAME
    }

    fn take(&self, tile: &Tile, place: Place) -> Result<Vec<u8>, Error> {
        let start = |kind: WayKind| {
            let own = tile.paths().iter().find(|path| path.owner == tile.id() && path.way.kind() == kind);
            own.map(|path| Start::of(&path.way))
        };
        let row = TileRow {
            tile: tile.id(),
            river: start(WayKind::River),
            road: start(WayKind::Road),
            hashes: Some(tile.hashes()),
            // Named when the row is written: until then they would only take room.
            files: Vec::new(),
            record: None,
        };
        self.made.lock().expect("no thread panics while it adds").insert(place, row);
        Ok(Vec::new())
    }

    fn append(&self, row: u64, _pieces: &[&[u8]]) -> Result<(), Error> {
        let written = {
            let mut made = self.made.lock().expect("no thread panics while it adds");
            let later = made.split_off(&Place { row: row + 1, col: 0 });
            std::mem::replace(&mut *made, later)
        };
        let rows = written.into_iter().map(|(place, row)| {
            let files = files(&self.exports, &self.region, place).collect();
            TileRow { files, ..row }
        });
        let mut file = self.file.lock().expect("no thread panics while it writes");
        file.as_mut().expect("rows come before the end").0.append(rows)
    }

    fn finish(&self) -> Result<Vec<FileRecord>, Error> {
        let file = self.file.lock().expect("no thread panics while it writes").take();
        let (registry, file) = file.expect("a sink ends once");
        registry.close()?;
        Ok(vec![FileRecord::new(FILE_NAME.to_owned(), "registry", file.finish()?)])
    }
}
