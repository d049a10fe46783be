//! Merges the shards of a bake into the whole bake, with the same bytes as if one machine had baked all of it.
//!
//! Files of single tiles are taken over unchanged. Files of the region come from the same sinks as in any bake. The
//! sinks get the pieces of tiles that the shards have stored, row by row from north to south. So memory holds two
//! batches of rows, and nothing is computed again but what a sink asks of the world at its end.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use crate::area::{Area, Place, Region, TileId};
use crate::bake::shard_store::{self, Blocks, StoredTile};
use crate::bake::{FileRecord, Journal, Sink, corners, hand_on};
use crate::error::Error;
use crate::export::folder::begun;
use crate::export::folder::manifest::{self, Manifest};
use crate::export::plan::Plan;
use crate::file::{link, path_in};
use crate::generator;
use crate::registry::{self, Registry, TileRow, TileState};
use crate::watch::Watch;
use crate::world::World;

/// All shards of a bake. Together they cover its region; some may have tiles in common.
pub struct Shards {
    whole: Region,
    /// Sorted from north to south and from west to east.
    parts: Vec<ShardFolder>,
}

/// A shard in its folder.
struct ShardFolder {
    folder: PathBuf,
    manifest: Manifest,
    tiles: Region,
}

/// Hint for a shard that is not as it was baked.
const AGAIN: &str = "the command that baked this shard, with --resume, bakes again what is damaged of it";

impl Shards {
    /// Opens the shards in some folders.
    ///
    /// # Errors
    /// When a folder has no whole shard, or a shard of another bake than the first folder's, or a shard that this
    /// program cannot merge; and when a tile of the region is in no shard. Each error names the folder or the tiles.
    pub fn open(folders: &[PathBuf]) -> Result<Shards, Error> {
        let mut parts =
            folders.iter().map(|folder| ShardFolder::open(folder)).collect::<Result<Vec<ShardFolder>, Error>>()?;
        let Some((first, others)) = parts.split_first() else {
            return Err(Error::Option {
                message: "no shard is given".into(),
                hint: "name the folders of all shards of a bake".into(),
            });
        };
        let whole = first.manifest.region.region()?;
        for part in others {
            // Shards may differ in their tiles and in nothing else.
            let differences = part.manifest.differences(&first.manifest, |key| key != "shard");
            if let Some(difference) = differences.first() {
                return Err(part.refused(
                    "",
                    format!("is no shard of the bake of which {} is one: {difference}", first.folder.display()),
                    "bake all shards with the same command but for --shard and --out",
                ));
            }
        }
        parts.sort_by_key(|part| (part.tiles.at().y, part.tiles.at().x));
        let shards = Shards { whole, parts };
        shards.check_covers()?;
        Ok(shards)
    }

    /// Returns the manifest of one of the shards: all manifests agree but for the shard's tiles and files.
    pub fn manifest(&self) -> &Manifest {
        &self.parts[0].manifest
    }

    /// Returns the plan of the whole bake, whose tiles all come from the shards.
    ///
    /// # Errors
    /// When the manifest names an export or a profile that this program does not know.
    pub fn plan<'a>(&'a self, world: &'a World) -> Result<Plan<'a>, Error> {
        Ok(Plan::of_whole(self.manifest(), world)?.with_shards(self))
    }

    /// Refuses shards that leave a gap in the region; the error names the gap.
    fn check_covers(&self) -> Result<(), Error> {
        let edges = |region: &Region| [region.at().y, region.at().y + region.rows() as i64];
        let ends = |region: &Region| [region.at().x, region.at().x + region.cols() as i64];
        let rows: BTreeSet<i64> =
            self.parts.iter().flat_map(|part| edges(&part.tiles)).chain(edges(&self.whole)).collect();
        let rows: Vec<i64> = rows.into_iter().collect();
        for band in rows.windows(2) {
            let [north, south] = [band[0], band[1]];
            let within = |part: &&ShardFolder| (edges(&part.tiles)[0]..edges(&part.tiles)[1]).contains(&north);
            let mut spans: Vec<[i64; 2]> = self.parts.iter().filter(within).map(|part| ends(&part.tiles)).collect();
            let [west, east] = ends(&self.whole);
            spans.push([east, east]);
            spans.sort_unstable();
            let mut covered = west;
            for [from, to] in spans {
                if from > covered {
                    let at = TileId { x: covered, y: north };
                    let (cols, rows) = ((from - covered) as u64, (south - north) as u64);
                    return Err(self.gap(&Region::new(at, cols, rows, self.whole.tile_cells())?));
                }
                covered = covered.max(to);
            }
        }
        Ok(())
    }

    fn gap(&self, missing: &Region) -> Error {
        let records = || self.parts.iter().filter_map(|part| part.manifest.shard.as_ref());
        let of: BTreeSet<u64> = records().map(|shard| shard.of).collect();
        let there: BTreeSet<u64> = records().map(|shard| shard.number).collect();
        // If the shards come from divisions of several sizes, no missing shard can be named by its number.
        let numbers = of.first().filter(|_| of.len() == 1).map(|of| {
            let mut numbers = (1..=*of).filter(|number| !there.contains(number));
            let listed: Vec<String> = numbers.by_ref().take(8).map(|number| format!("{number}/{of}")).collect();
            let more = numbers.count();
            listed.join(", ") + &if more > 0 { format!(" and {more} more") } else { String::new() }
        });
        Error::Option {
            message: format!(
                "{} of the region are in no shard{}",
                corners(missing),
                numbers.as_ref().map_or(String::new(), |numbers| format!(": {numbers} is missing"))
            ),
            hint: "bake what is missing, and name its folder too".into(),
        }
    }

    /// Checks that all files of the shards have the bytes that they were written with, and that shards agree on the
    /// tiles that they have in common, on the threads of the current rayon pool.
    ///
    /// # Errors
    /// When a file was changed, or a tile differs; the error names the shard, and the file or the tile.
    pub fn check(&self, watch: &Watch) -> Result<(), Error> {
        let files: Vec<(&ShardFolder, &FileRecord)> =
            self.parts.iter().flat_map(|part| part.manifest.files.iter().map(move |file| (part, file))).collect();
        watch.begin("reading shards", Some((files.len() as u64, "files")));
        let fault = |(part, file): &(&ShardFolder, &FileRecord)| {
            let fault = match file.fault(&part.folder, &watch.clock) {
                Ok(fault) => fault,
                Err(stopped) => return Some(stopped.into()),
            };
            watch.add(1);
            fault.map(|fault| part.refused(&file.path, format!("{fault}: {} is damaged", part.name()), AGAIN))
        };
        // Of several faults report the first in the order of the list, whichever thread finds one first.
        if let Some(error) = files.par_iter().find_map_first(fault) {
            return Err(error);
        }
        for (number, part) in self.parts.iter().enumerate() {
            for other in &self.parts[..number] {
                part.check_agrees(other)?;
            }
        }
        Ok(())
    }

    /// Takes over the files of single tiles into the folder of the bake, and hands all other pieces to the sinks.
    pub(crate) fn hand_on(
        &self,
        out: &Path,
        sinks: &[Box<dyn Sink + '_>],
        journal: &Journal,
        watch: &Watch,
    ) -> Result<Vec<FileRecord>, Error> {
        let mut files = BTreeMap::new();
        for part in &self.parts {
            for record in part.tile_files() {
                if files.contains_key(&record.path[..]) {
                    continue;
                }
                let from = path_in(&part.folder, &record.path);
                let from = from.ok_or_else(|| part.refused(&record.path, "leads over a link".into(), AGAIN))?;
                link(&from, &out.join(&record.path))?;
                files.insert(&record.path[..], record);
            }
        }
        let mut readers: Vec<Option<Reader>> = self.parts.iter().map(|_| None).collect();
        hand_on(&self.whole, sinks, journal, watch, |first_row, rows| {
            let mut tiles = Vec::new();
            for row in first_row..first_row + rows {
                tiles.extend(self.read_row(row, &mut readers, journal)?);
            }
            let pieces = |(tile, block, part): &(TileId, StoredTile, &ShardFolder)| {
                block.pieces(*tile, sinks.len(), &part.folder)
            };
            tiles.par_iter().map(pieces).collect()
        })?;
        Ok(files.into_values().cloned().collect())
    }

    /// Reads the pieces of one row of tiles from the shards, from west to east, and enters the tiles in the journal.
    fn read_row<'a>(
        &'a self,
        row: u64,
        readers: &mut [Option<Reader>],
        journal: &Journal,
    ) -> Result<Vec<(TileId, StoredTile, &'a ShardFolder)>, Error> {
        let y = self.whole.tile(Place { row, col: 0 }).y;
        let mut tiles = BTreeMap::new();
        for (part, reader) in self.parts.iter().zip(readers) {
            let (first, end) = (part.tiles.at().y, part.tiles.at().y + part.tiles.rows() as i64);
            if !(first..end).contains(&y) {
                continue;
            }
            let open = reader.take().map_or_else(|| Reader::open(part), Ok)?;
            let Reader { blocks, registry } = reader.insert(open);
            for col in 0..part.tiles.cols() {
                let tile = part.tiles.tile(Place { row: (y - first) as u64, col });
                let block = blocks.next()?;
                if tiles.contains_key(&tile.x) {
                    continue;
                }
                let lost = || part.refused(registry::FILE_NAME, format!("has no tile {tile}"), AGAIN);
                let known = registry.row(tile)?.ok_or_else(lost)?;
                let known = TileRow { state: TileState::Made, files: Vec::new(), ..known };
                journal.adopt(known, Vec::new(), 0)?;
                tiles.insert(tile.x, (tile, block, part));
            }
            if y + 1 == end {
                *reader = None;
            }
        }
        Ok(tiles.into_values().collect())
    }
}

/// A shard that is being read, from its first row of tiles to its last.
struct Reader {
    blocks: Blocks,
    registry: Registry,
}

impl Reader {
    fn open(part: &ShardFolder) -> Result<Reader, Error> {
        Ok(Reader { blocks: Blocks::open(&part.folder)?, registry: part.registry()? })
    }
}

impl ShardFolder {
    fn open(folder: &Path) -> Result<ShardFolder, Error> {
        let refuse =
            |path: PathBuf, message: String, hint: &str| Err(Error::Output { path, message, hint: hint.into() });
        if !folder.join(manifest::PATH).exists() && begun(folder).is_some() {
            let message = "holds a shard that is under way or was cut off".into();
            return refuse(folder.into(), message, "the command that began it goes on with it with --resume");
        }
        let manifest = Manifest::read(folder)?;
        if !manifest.is_sealed() {
            return refuse(folder.join(manifest::PATH), "is not as it was written".into(), AGAIN);
        }
        let Some(shard) = &manifest.shard else {
            let hint = "name the folders of shards, which terrane bake makes with --shard";
            return refuse(folder.into(), "holds a whole bake, and no shard".into(), hint);
        };
        // The pieces that sinks store have a form that may differ between versions of the program, even if the layers
        // are the same.
        if manifest.generator != generator::NAME {
            let message = format!("is a shard of {}, and this is {}", manifest.generator, generator::NAME);
            return refuse(folder.into(), message, "merge with the program that has baked it, or bake it again");
        }
        manifest.check_generator()?;
        let Some(tiles) = shard.tiles(&manifest.region.region()?) else {
            let message = "names tiles that are not of its region".into();
            return refuse(folder.join(manifest::PATH), message, AGAIN);
        };
        Ok(ShardFolder { folder: folder.into(), tiles, manifest })
    }

    /// Returns the name of the shard in an error message.
    fn name(&self) -> String {
        self.manifest.shard.as_ref().map_or(String::new(), |shard| format!("shard {shard}"))
    }

    fn refused(&self, path: &str, message: String, hint: &str) -> Error {
        let path = if path.is_empty() { self.folder.clone() } else { self.folder.join(path) };
        Error::Output { path, message, hint: hint.into() }
    }

    fn registry(&self) -> Result<Registry, Error> {
        Registry::read(&self.folder.join(registry::FILE_NAME))
    }

    /// Returns the files of single tiles.
    fn tile_files(&self) -> impl Iterator<Item = &FileRecord> {
        let own = [registry::EXPORT, shard_store::EXPORT];
        self.manifest.files.iter().filter(move |file| !own.contains(&&file.export[..]))
    }

    /// Refuses a shard whose tiles differ from the same tiles of another shard, in their files or in their digests in
    /// the registry.
    fn check_agrees(&self, other: &ShardFolder) -> Result<(), Error> {
        let places = |ShardFolder { tiles, .. }: &ShardFolder| {
            Area::new(tiles.at().x, tiles.at().y, tiles.cols() as usize, tiles.rows() as usize)
        };
        let Some(common) = places(self).common(&places(other)) else { return Ok(()) };
        let differs = |path: &str, what: String| {
            let message = format!("{what} than in {}, which has the same tiles", other.folder.display());
            Err(self.refused(
                path,
                message,
                "leave out the one of which terrane verify --all says that something is wrong",
            ))
        };
        let is_same_shard = self.manifest.shard == other.manifest.shard;
        let is_common = |file: &&FileRecord| {
            let tile = file.tile.map(|TileId { x, y }| Area::new(x, y, 1, 1));
            is_same_shard || tile.is_some_and(|tile| common.contains(&tile))
        };
        let files = |part: &ShardFolder| -> BTreeMap<String, String> {
            let files = part.manifest.files.iter().filter(is_common);
            files.map(|file| (file.path.clone(), file.blake3.clone())).collect()
        };
        let (own, others) = (files(self), files(other));
        let mut paths = own.keys().chain(others.keys());
        if let Some(path) = paths.find(|path| own.get(*path) != others.get(*path)) {
            return differs(path, "has other bytes".into());
        }
        if is_same_shard {
            return Ok(());
        }
        let (own, others) = (self.registry()?, other.registry()?);
        for (x, y) in common.vertices() {
            let tile = TileId { x, y };
            if own.row(tile)? != others.row(tile)? {
                return differs("", format!("has another tile {tile}"));
            }
        }
        Ok(())
    }
}
