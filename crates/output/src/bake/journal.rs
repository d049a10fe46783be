//! The journal of a bake: everything known of its tiles, so that an interrupted bake goes on where it stopped.
//!
//! The journal is two files in the folder in which a bake is made. The registry has a row per tile and a row per file,
//! from the first tile on; `pieces` has the bytes that the sinks keep of each tile until they append them. A tile is
//! not made again if its pieces and its files are there. Presence alone proves nothing: everything read is checked by
//! its hash. So the order and the delay in which the disk writes do not matter, and nothing has to wait for it.

use std::fs::{File, OpenOptions};
use std::io::{self, BufWriter, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard};
use std::time::{Duration, Instant};

use crate::agents::record::TileRecord;
use crate::area::TileId;
use crate::bake::{Kept, frames};
use crate::clock::Clock;
use crate::error::Error;
use crate::file::{self, FileRecord, Operation};
use crate::registry::{FILE_NAME, Pieces, Registry, TileRow};
use crate::tile::Tile;

/// Name of the file of the sinks' pieces, beside the registry.
const PIECES: &str = "pieces";

/// Bytes of a tile's pieces up to which they are kept, however quickly the tile was made: so few bytes are always worth
/// keeping.
const ALWAYS_KEPT: usize = 1 << 16;

/// Bytes of pieces that are worth keeping per second of making the tile. Land that is made faster than a disk takes its
/// pieces is made again sooner than read.
const BYTES_FOR_A_SECOND: f64 = 50e6;

/// Least time between two waits for the disk. A power cut may cost as much work as this, beside the work in flight.
const SYNC_INTERVAL: Duration = Duration::from_secs(5);

/// Number of tiles of another bake that are recorded together.
const NOTED_AT_ONCE: usize = 1 << 10;

/// The journal of a bake in progress.
pub(crate) struct Journal {
    /// The folder in which the files of the bake are made.
    files: PathBuf,
    path: PathBuf,
    stride: i64,
    /// Largest size in bytes of the file of pieces.
    room: u64,
    /// Numbers of tiles that were made, and of tiles that were recalled from earlier runs.
    counts: [AtomicU64; 2],
    state: Mutex<JournalState>,
}

/// The pieces that the sinks kept of a tile, and the files of the tile.
type KeptTile = (Vec<Vec<u8>>, Vec<FileRecord>);

struct JournalState {
    registry: Registry,
    pieces: File,
    /// Position in the file at which the next pieces are written.
    end: u64,
    /// Tiles that are not in the registry yet.
    waiting: Vec<(TileRow, Vec<FileRecord>, Option<Pieces>)>,
    synced: Instant,
}

impl Journal {
    /// Opens the journal in a folder, with everything that earlier runs have left there. The bake has a stride, and its
    /// files are made in the folder `files`. Pieces take `room` bytes of the disk at most.
    ///
    /// # Errors
    /// If the files of the journal cannot be opened or made.
    pub fn open(folder: &Path, files: &Path, stride: i64, room: u64) -> Result<Journal, Error> {
        let path = folder.join(PIECES);
        let known = folder.join(FILE_NAME);
        let registry = match Registry::journal(&known) {
            // A damaged registry tells nothing of any tile, so the bake begins anew.
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
        // Start behind anything that a killed run has written but not recorded.
        let end = pieces.seek(SeekFrom::End(0)).map_err(Error::io(&path))?;
        let state = JournalState { registry, pieces, end, waiting: Vec::new(), synced: Instant::now() };
        Ok(Journal {
            files: files.to_owned(),
            path,
            stride,
            room,
            counts: Default::default(),
            state: Mutex::new(state),
        })
    }

    fn state(&self) -> MutexGuard<'_, JournalState> {
        self.state.lock().expect("no thread panics while it records")
    }

    /// Returns the pieces that each of `sinks` sinks kept of a tile in an earlier run, if they and all files of the
    /// tile are intact.
    pub fn recall(&self, tile: TileId, sinks: usize) -> Result<Option<Vec<Vec<u8>>>, Error> {
        let Some((pieces, files)) = self.read(tile, sinks)? else { return Ok(None) };
        if files.iter().any(|file| Clock::unstopped(|clock| file.fault(&self.files, clock)).is_some()) {
            return Ok(None);
        }
        self.counts[1].fetch_add(1, Ordering::Relaxed);
        Ok(Some(pieces))
    }

    /// Returns the pieces that each of `sinks` sinks kept of a tile, which this run has recorded or recalled.
    ///
    /// # Errors
    /// If the pieces cannot be read any more.
    pub fn pieces(&self, tile: TileId, sinks: usize) -> Result<Vec<Vec<u8>>, Error> {
        let lost = || Error::io(&self.path)(io::Error::new(io::ErrorKind::InvalidData, "is not as it was written"));
        self.read(tile, sinks)?.map(|(pieces, _)| pieces).ok_or_else(lost)
    }

    /// Returns the pieces that each of `sinks` sinks kept of a tile, if they are intact, and the files of the tile,
    /// unchecked.
    fn read(&self, tile: TileId, sinks: usize) -> Result<Option<KeptTile>, Error> {
        let mut state = self.state();
        let Some(Pieces { at, bytes, blake3 }) = state.registry.pieces(tile)? else { return Ok(None) };
        let mut read = || {
            // Read no more than there is in the file, whatever the registry says.
            let length = state.pieces.metadata()?.len();
            let mut kept = vec![0; bytes.min(length.saturating_sub(at)) as usize];
            state.pieces.seek(SeekFrom::Start(at))?;
            state.pieces.read_exact(&mut kept)?;
            Ok(kept)
        };
        // Pieces that cannot be read count as unknown.
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

    /// Records a tile that took the time `spent` to make, and returns the pieces that the sinks keep of it.
    pub fn record(&self, tile: &Tile, kept: Vec<Kept>, spent: Duration) -> Result<Vec<Vec<u8>>, Error> {
        let is_worth = |bytes: usize| bytes <= ALWAYS_KEPT || (bytes as f64) < BYTES_FOR_A_SECOND * spent.as_secs_f64();
        self.put(TileRow::of_bake(tile, self.stride), kept, is_worth)
    }

    /// Records a tile of a walk. Its pieces stay until the end, because a walk makes no tile twice.
    pub fn record_walked(&self, tile: &Tile, record: &TileRecord, kept: Vec<Kept>) -> Result<(), Error> {
        self.put(TileRow::of_walked(tile, record), kept, |_| true).map(drop)
    }

    /// Records a tile. Its pieces are kept if there is room for them and if so many bytes are worth it.
    fn put(&self, row: TileRow, kept: Vec<Kept>, is_worth: impl Fn(usize) -> bool) -> Result<Vec<Vec<u8>>, Error> {
        let mut files = Vec::new();
        let mut pieces = Vec::with_capacity(kept.len());
        for kept in kept {
            files.extend(kept.files);
            pieces.push(kept.piece);
        }
        let bytes: usize = pieces.iter().map(Vec::len).sum();
        // Hash before taking the lock, so that no thread waits for the hash.
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

    /// Records a tile of another bake whose files exist. `sinks` sinks have no pieces of it. The tile is known from the
    /// next [`save`](Journal::save) on.
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

    /// Writes the pieces of a tile to the end of the file.
    fn keep(&self, state: &mut JournalState, pieces: &[Vec<u8>], blake3: blake3::Hash) -> Result<Pieces, Error> {
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

    /// Writes waiting tiles to the registry, and from time to time syncs everything to the disk.
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

    /// Returns the files that a sink left when it finished in an earlier run, if all of them are intact.
    pub fn ended(&self, sink: &str, clock: &Clock) -> Result<Option<Vec<FileRecord>>, Error> {
        let files = self.state().registry.ended(sink)?;
        let files = files.filter(|files| files.iter().all(|file| file.fault(&self.files, clock) == Ok(None)));
        clock.check()?;
        Ok(files)
    }

    /// Records the files that a sink has left when it finished.
    pub fn end(&self, sink: &str, files: &[FileRecord]) -> Result<(), Error> {
        self.state().registry.end(sink, files)
    }

    /// Returns the files of single tiles.
    pub fn tile_files(&self) -> Result<Vec<FileRecord>, Error> {
        self.state().registry.tile_files()
    }

    /// Numbers of tiles that this run has made, and of tiles that it recalled from earlier runs.
    pub fn counts(&self) -> [u64; 2] {
        self.counts.each_ref().map(|count| count.load(Ordering::Relaxed))
    }

    /// True if no tile is known.
    pub fn is_empty(&self) -> bool {
        let state = self.state();
        state.waiting.is_empty() && state.registry.tiles().unwrap_or(0) == 0
    }

    /// Visits the rows of all tiles in their order.
    pub fn for_each(&self, visit: impl FnMut(TileRow) -> Result<(), Error>) -> Result<(), Error> {
        self.state().registry.for_each(visit)
    }
}

/// Returns everything that the registry knows of a tile as text. The text differs if any of it differs.
fn told(row: &TileRow, files: &[FileRecord]) -> String {
    let mut files: Vec<String> = files.iter().map(|file| format!("{file:?}")).collect();
    files.sort_unstable();
    format!("{row:?} {files:?}")
}

/// Returns the hash of pieces, as they are written, and of everything that the registry knows of their tile.
fn hash_of(pieces: &[Vec<u8>], row: &TileRow, files: &[FileRecord]) -> blake3::Hash {
    let mut hasher = blake3::Hasher::new();
    for piece in pieces {
        frames::write(&mut hasher, piece).expect("a hash takes everything");
    }
    hasher.update(told(row, files).as_bytes());
    hasher.finalize()
}
