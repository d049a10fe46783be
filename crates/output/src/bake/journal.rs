//! The journal of a bake: what is known of its tiles, so that a bake that was cut off goes on where it was.
//!
//! It is two files in the folder in which a bake is made. The registry has a row a tile and a row a file, from the first tile on;
//! `pieces` has what the sinks keep of each tile until they append it. A tile whose pieces are there, and whose files are, is not
//! made again. Nothing is trusted because it is there: of all that is read the hash is compared, so neither order nor haste of the
//! disk matters, and nothing has to be waited for.

use std::fs::{File, OpenOptions};
use std::io::{self, BufWriter, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use crate::agents::record::TileRecord;
use crate::area::TileId;
use crate::bake::{Kept, frames};
use crate::error::Error;
use crate::file::{self, FileRecord, Operation};
use crate::registry::{FILE_NAME, Pieces, Registry, TileRow};
use crate::tile::Tile;

/// The file of what sinks keep, beside the registry.
const PIECES: &str = "pieces";

/// Pieces of a tile that are kept whatever they cost: they are what only some bytes are known of.
const ALWAYS_KEPT: usize = 1 << 16;

/// Bytes of pieces for which a second of making is worth to be kept: land that is made faster than a disk takes what comes of it
/// is made again sooner than it is read.
const BYTES_FOR_A_SECOND: f64 = 50e6;

/// The least time from one wait for the disk to the next: so much work a power cut may cost, beside what is in flight.
const SYNC_INTERVAL: Duration = Duration::from_secs(5);

/// Tiles of another bake that are noted together.
const NOTED_AT_ONCE: usize = 1 << 10;

/// The journal of a bake under way.
pub(crate) struct Journal {
    /// Where the files of the bake are made.
    files: PathBuf,
    path: PathBuf,
    stride: i64,
    /// Bytes that pieces may take.
    room: u64,
    /// Tiles that were made, and those that were known.
    counts: [AtomicU64; 2],
    state: Mutex<State>,
}

/// What each sink kept of a tile, and the files of the tile.
type Known = (Vec<Vec<u8>>, Vec<FileRecord>);

struct State {
    registry: Registry,
    pieces: File,
    /// Where the next pieces go.
    end: u64,
    /// What is not in the registry yet.
    waiting: Vec<(TileRow, Vec<FileRecord>, Option<Pieces>)>,
    synced: Instant,
}

impl Journal {
    /// The journal in a folder, with what earlier runs have left there, of a bake at a stride whose files are made in the folder
    /// `files`. Pieces take `room` bytes of the disk at most.
    ///
    /// # Errors
    /// When its files cannot be opened or made.
    pub fn open(folder: &Path, files: &Path, stride: i64, room: u64) -> Result<Journal, Error> {
        let path = folder.join(PIECES);
        let known = folder.join(FILE_NAME);
        let registry = match Registry::journal(&known) {
            // Of tiles that nobody can tell of none is known: the bake begins anew.
            Err(error) if Registry::is_damage(&error) => {
                for ending in ["", "-wal", "-shm"] {
                    file::remove(&folder.join(format!("{FILE_NAME}{ending}")))?;
                }
                Registry::journal(&known)?
            }
            opened => opened?,
        };
        file::gate(Operation::Create, &path)?;
        let opened = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(&path);
        let mut pieces = opened.map_err(Error::io(&path))?;
        // Behind whatever a killed run has written and not told of.
        let end = pieces.seek(SeekFrom::End(0)).map_err(Error::io(&path))?;
        let state = State { registry, pieces, end, waiting: Vec::new(), synced: Instant::now() };
        Ok(Journal {
            files: files.to_owned(),
            path,
            stride,
            room,
            counts: Default::default(),
            state: Mutex::new(state),
        })
    }

    /// A stop or a panic elsewhere leaves the state as it was between two tiles.
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// What each of so many sinks kept of a tile in an earlier run, if all of it is there and so are the tile's files.
    pub fn recall(&self, tile: TileId, sinks: usize) -> Result<Option<Vec<Vec<u8>>>, Error> {
        let Some((pieces, files)) = self.read(tile, sinks)? else { return Ok(None) };
        if files.iter().any(|file| file.fault(&self.files).is_some()) {
            return Ok(None);
        }
        self.counts[1].fetch_add(1, Ordering::Relaxed);
        Ok(Some(pieces))
    }

    /// What each of so many sinks kept of a tile that this run has noted or recalled.
    ///
    /// # Errors
    /// When it cannot be read any more.
    pub fn pieces(&self, tile: TileId, sinks: usize) -> Result<Vec<Vec<u8>>, Error> {
        let lost = || Error::io(&self.path)(io::Error::new(io::ErrorKind::InvalidData, "is not as it was written"));
        self.read(tile, sinks)?.map(|(pieces, _)| pieces).ok_or_else(lost)
    }

    /// What each of so many sinks kept of a tile, if that is as it was written, and the files of the tile, which may not be.
    fn read(&self, tile: TileId, sinks: usize) -> Result<Option<Known>, Error> {
        let mut state = self.state();
        let Some(Pieces { at, bytes, blake3 }) = state.registry.pieces(tile)? else { return Ok(None) };
        let mut read = || {
            // No more than there can be, whatever the registry says.
            let length = state.pieces.metadata()?.len();
            let mut kept = vec![0; bytes.min(length.saturating_sub(at)) as usize];
            state.pieces.seek(SeekFrom::Start(at))?;
            state.pieces.read_exact(&mut kept)?;
            Ok(kept)
        };
        // What cannot be read is as little known as what was never there.
        let read: io::Result<Vec<u8>> = read();
        let Ok(kept) = read else { return Ok(None) };
        let files = state.registry.files_of(tile)?;
        let Some(row) = state.registry.row(tile)? else { return Ok(None) };
        drop(state);
        let mut hasher = blake3::Hasher::new();
        hasher.update(&kept).update(told(&row, &files).as_bytes());
        if hasher.finalize() != blake3 {
            return Ok(None);
        }
        let pieces: Vec<Vec<u8>> = frames::pieces(&kept).map(<[u8]>::to_vec).collect();
        Ok((pieces.len() == sinks).then_some((pieces, files)))
    }

    /// Notes a tile that took so long, and returns the pieces that the sinks keep of it.
    pub fn record(&self, tile: &Tile, kept: Vec<Kept>, spent: Duration) -> Result<Vec<Vec<u8>>, Error> {
        let is_worth = |bytes: usize| bytes <= ALWAYS_KEPT || (bytes as f64) < BYTES_FOR_A_SECOND * spent.as_secs_f64();
        self.put(TileRow::of_bake(tile, self.stride), kept, is_worth)
    }

    /// Notes a tile of a walk, which is not made twice: the pieces that the sinks keep of it are there until the end.
    pub fn record_walked(&self, tile: &Tile, record: &TileRecord, kept: Vec<Kept>) -> Result<(), Error> {
        self.put(TileRow::of_walked(tile, record), kept, |_| true).map(drop)
    }

    /// Notes a tile, with its pieces if there is room for them and so many bytes are worth it.
    fn put(&self, row: TileRow, kept: Vec<Kept>, is_worth: impl Fn(usize) -> bool) -> Result<Vec<Vec<u8>>, Error> {
        let mut files = Vec::new();
        let mut pieces = Vec::with_capacity(kept.len());
        for kept in kept {
            files.extend(kept.files);
            pieces.push(kept.piece);
        }
        let bytes: usize = pieces.iter().map(Vec::len).sum();
        // Before anybody has to wait for the file.
        let hash = is_worth(bytes).then(|| hash_of(&pieces, &row, &files));
        let mut state = self.state();
        let stored = match hash {
            Some(hash) if state.end + bytes as u64 <= self.room => Some(self.keep(&mut state, &pieces, hash)?),
            _ => None,
        };
        state.waiting.push((row, files, stored));
        self.counts[0].fetch_add(1, Ordering::Relaxed);
        Ok(pieces)
    }

    /// Takes over a tile of another bake, with files that are there, of which so many sinks have nothing more to know.
    /// It is known from the next [`save`](Journal::save) on.
    pub fn adopt(&self, row: TileRow, files: Vec<FileRecord>, sinks: usize) -> Result<(), Error> {
        let nothing = vec![Vec::new(); sinks];
        let mut state = self.state();
        let pieces = self.keep(&mut state, &nothing, hash_of(&nothing, &row, &files))?;
        state.waiting.push((row, files, Some(pieces)));
        if state.waiting.len() < NOTED_AT_ONCE {
            return Ok(());
        }
        let waiting = std::mem::take(&mut state.waiting);
        state.registry.note(waiting)
    }

    /// Writes the pieces of a tile behind all others.
    fn keep(&self, state: &mut State, pieces: &[Vec<u8>], blake3: blake3::Hash) -> Result<Pieces, Error> {
        let at = state.end;
        file::gate(Operation::Write, &self.path)?;
        let mut write = || {
            state.pieces.seek(SeekFrom::Start(at))?;
            let mut file = BufWriter::new(&state.pieces);
            pieces.iter().try_for_each(|piece| frames::write(&mut file, piece))?;
            file.flush()?;
            drop(file);
            state.pieces.stream_position()
        };
        state.end = write().map_err(Error::io(&self.path))?;
        Ok(Pieces { at, bytes: state.end - at, blake3 })
    }

    /// Brings to the registry what it has not yet, and to the disk now and then.
    pub fn save(&self) -> Result<(), Error> {
        let mut state = self.state();
        let waiting = std::mem::take(&mut state.waiting);
        state.registry.note(waiting)?;
        if state.synced.elapsed() >= SYNC_INTERVAL {
            file::gate(Operation::Sync, &self.path)?;
            state.pieces.sync_data().map_err(Error::io(&self.path))?;
            state.registry.checkpoint()?;
            state.synced = Instant::now();
        }
        Ok(())
    }

    /// The files that a sink left when it ended in an earlier run, if all of them are whole.
    pub fn ended(&self, sink: &str) -> Result<Option<Vec<FileRecord>>, Error> {
        let files = self.state().registry.ended(sink)?;
        Ok(files.filter(|files| files.iter().all(|file| file.fault(&self.files).is_none())))
    }

    /// Notes the files that a sink has left at its end.
    pub fn end(&self, sink: &str, files: &[FileRecord]) -> Result<(), Error> {
        self.state().registry.end(sink, files)
    }

    /// The files of single tiles.
    pub fn tile_files(&self) -> Result<Vec<FileRecord>, Error> {
        self.state().registry.tile_files()
    }

    /// How many tiles this run has made, and how many it had from earlier ones.
    pub fn counts(&self) -> [u64; 2] {
        self.counts.each_ref().map(|count| count.load(Ordering::Relaxed))
    }

    /// Whether no tile is known.
    pub fn is_empty(&self) -> bool {
        let state = self.state();
        state.waiting.is_empty() && state.registry.tiles().unwrap_or(0) == 0
    }

    /// Visits the rows of all tiles in their order.
    pub fn for_each(&self, visit: impl FnMut(TileRow) -> Result<(), Error>) -> Result<(), Error> {
        self.state().registry.for_each(visit)
    }
}

/// What the registry knows of a tile, as a text that is another one if any of it is.
fn told(row: &TileRow, files: &[FileRecord]) -> String {
    let mut files: Vec<String> = files.iter().map(|file| format!("{file:?}")).collect();
    files.sort_unstable();
    format!("{row:?} {files:?}")
}

/// The hash of pieces as they are written, and of what the registry knows of their tile.
fn hash_of(pieces: &[Vec<u8>], row: &TileRow, files: &[FileRecord]) -> blake3::Hash {
    let mut hasher = blake3::Hasher::new();
    for piece in pieces {
        frames::write(&mut hasher, piece).expect("a hash takes everything");
    }
    hasher.update(told(row, files).as_bytes());
    hasher.finalize()
}
