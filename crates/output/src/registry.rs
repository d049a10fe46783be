//! The tile registry: the tiles that exist, the rivers and roads that start in them, and the results.
//!
//! One `registry.sqlite` serves two purposes. For a bake it is a log and an index: it is written beside the exports and
//! never read while tiles are made, since a tile depends only on the world and its place. Without it, the same tiles
//! come back. For the classic walk it is an input: a tile depends on the way of the walker, so the decisions made there
//! must be kept ([`TileRow::record`]) for the tile to come back the same.
//!
//! The table `tiles` has a row per tile:
//!
//! | column | content |
//! |---|---|
//! | `x`, `y` | the tile's number; the primary key is `(y, x)`, the order in which a bake makes tiles |
//! | `state` | `made` while the bake or the walk is in progress, `baked` when all files of a bake are complete, `walked` after a walk |
//! | `stride` | vertices of the preset's spacing from one vertex of the tile to the next: 1, except in a bake at a scale |
//! | `river_x`, `river_y`, `river_direction` | the vertex at which a river starts on the tile, and its direction: `north`, `east`, `south`, `west`; of several rivers the first by id; after a walk, the vertex at which a river starts or crosses the tile's edge; NULL: none |
//! | `road_x`, `road_y`, `road_direction` | the same for a road |
//! | `lines` | the ids of all rivers and roads that concern the tile, as a JSON list |
//! | `heights_hash` and others | BLAKE3, 32 bytes each, of the [parts](crate::tile::TilePart) of the tile; NULL for parts that it does not have, and in a walk that was kept by its records alone |
//! | `files` | the files that hold the tile, as a JSON list of paths in the folder of the bake |
//! | `record` | the classic walk's record of the tile; NULL in a bake |
//!
//! The table `files` has a row per file of the bake, except for the registry itself and the manifest:
//!
//! | column | content |
//! |---|---|
//! | `path` | path in the folder of the bake, with `/` between its parts; the primary key |
//! | `export` | the export that the file belongs to |
//! | `x`, `y` | the tile that the file shows; NULL: the region |
//! | `bytes`, `blake3` | the file's size and its hash, 32 bytes |
//!
//! The table `bake` has one row with `plan`: the manifest as it was before any file existed, which says what is to be
//! baked.
//!
//! While a bake is in progress, its registry has the same tables, in write-ahead mode, and three more for the work that
//! is still to do: `pieces`, the places of the bytes that sinks keep of tiles; `records`, the manifest's entries for
//! files of tiles; `ended`, the files that are finished. The registry that a bake leaves is a plain file. It has the
//! same bytes whenever and in however many runs the bake was made.
//!
//! The database's `application_id` is [`APPLICATION_ID`] and its `user_version` is [`SCHEMA_VERSION`].

use std::path::{Path, PathBuf};

use rusqlite::types::{Type, Value};
use rusqlite::{Connection, ErrorCode, OptionalExtension, Row, params, params_from_iter};

use crate::agents::Direction;
use crate::agents::record::{Passage, TileRecord};
use crate::agents::search::Node;
use crate::area::{Area, TileId};
use crate::error::Error;
use crate::file::{self, FileRecord, Finished, Operation, database, sqlite_error};
use crate::lines::{Line, LineId, LineKind};
use crate::tile::{Digest, Tile, TilePart};

/// Name of the file in the folder of a bake or of a walk.
pub const FILE_NAME: &str = "registry.sqlite";

/// Name of the export in the manifest.
pub(crate) const EXPORT: &str = "registry";

/// Version of the tables, kept as the database's `user_version`. A registry of any other version is refused.
pub const SCHEMA_VERSION: i32 = 3;

/// The database's `application_id`: `TRRG`.
pub const APPLICATION_ID: i32 = i32::from_be_bytes(*b"TRRG");

/// A tile's row in the registry.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TileRow {
    /// Number of the tile.
    pub tile: TileId,
    /// Progress of the tile.
    pub state: TileState,
    /// Vertices of the preset's spacing from one vertex of the tile to the next.
    pub stride: i64,
    /// Start of a river on the tile, if one starts there.
    pub river: Option<Start>,
    /// Start of a road on the tile, if one starts there.
    pub road: Option<Start>,
    /// Ids of all rivers and roads that concern the tile.
    pub lines: Vec<String>,
    /// Hashes of the parts of the tile.
    pub digest: Option<Digest>,
    /// Files that hold the tile: paths in the folder of the bake, with `/` between their parts.
    pub files: Vec<String>,
    /// The classic walk's record of the tile.
    pub record: Option<Vec<u8>>,
}

/// Progress of a tile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TileState {
    /// The tile is made, but the bake or the walk is not complete.
    Made,
    /// The bake is complete.
    Baked,
    /// A classic walk has made the tile.
    Walked,
}

impl TileState {
    /// All states.
    pub const ALL: [TileState; 3] = [TileState::Made, TileState::Baked, TileState::Walked];

    /// Name in the registry.
    pub const fn name(self) -> &'static str {
        match self {
            TileState::Made => "made",
            TileState::Baked => "baked",
            TileState::Walked => "walked",
        }
    }
}

/// Place and hash of the bytes that the sinks keep of a tile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Pieces {
    pub at: u64,
    pub bytes: u64,
    pub blake3: blake3::Hash,
}

impl TileRow {
    /// Creates the row of a tile of a bake in progress, at a stride. The files that hold the tile are not known here.
    pub(crate) fn of_bake(tile: &Tile, stride: i64) -> TileRow {
        TileRow {
            tile: tile.id(),
            state: TileState::Made,
            stride,
            river: start(tile, LineKind::River),
            road: start(tile, LineKind::Road),
            lines: tile.lines().iter().map(|line| line.id.to_string()).collect(),
            digest: Some(tile.digest()),
            files: Vec::new(),
            record: None,
        }
    }

    /// Creates the row of a tile of a classic walk, from the walker's record of the tile alone.
    pub fn of_walk(record: &TileRecord, tile_cells: u32) -> TileRow {
        let area = record.id.area(tile_cells);
        let start = |passage: Passage| Start {
            node: (area.x0 + passage.start[0] as i64, area.y0 + passage.start[1] as i64),
            direction: Some(passage.direction),
        };
        TileRow {
            tile: record.id,
            state: TileState::Walked,
            stride: 1,
            river: record.river.map(start),
            road: record.road.map(start),
            lines: Vec::new(),
            digest: None,
            files: Vec::new(),
            record: Some(record.to_bytes().to_vec()),
        }
    }

    /// Creates the row of a tile of a walk in progress, with the digest of the tile.
    pub(crate) fn of_walked(tile: &Tile, record: &TileRecord) -> TileRow {
        let cells = tile.area().width() as u32 - 1;
        TileRow {
            state: TileState::Made,
            lines: tile.lines().iter().map(|line| line.id.to_string()).collect(),
            digest: Some(tile.digest()),
            ..TileRow::of_walk(record, cells)
        }
    }

    /// Returns the walker's record of the tile; `None` after a bake, or if the bytes are no record.
    pub fn walk_record(&self) -> Option<TileRecord> {
        TileRecord::from_bytes(self.record.as_deref()?.try_into().ok()?)
    }
}

/// Returns the start of a line of a kind on a tile, if one starts there; of several the first by id. Agents' lines
/// start on the tile that owns them.
fn start(tile: &Tile, kind: LineKind) -> Option<Start> {
    let Area { x0, y0, x1, y1 } = tile.area();
    let starts = |id: LineId, [x, y]: [i64; 2]| match id {
        LineId::Agent { owner, .. } => owner == tile.id(),
        _ => (x0..x1 - 1).contains(&x) && (y0..y1 - 1).contains(&y),
    };
    tile.lines().iter().find(|line| line.kind == kind && starts(line.id, line.origin)).map(|line| Start::of(line))
}

/// The start of a river or a road.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Start {
    /// The vertex at which the line starts.
    pub node: Node,
    /// Direction from that vertex; `None` for a path that ends where it starts.
    pub direction: Option<Direction>,
}

impl Start {
    /// Returns the start of a line: its origin, and the axis direction in which its next points mostly lie.
    pub fn of(line: &Line) -> Start {
        let first = line.points[0].place;
        // Look a few points ahead, so that one sidestep of the search does not count as the direction.
        let ahead = line.points.iter().take(4).next_back().expect("a line has a point").place;
        let (east, south) = (ahead[0] - first[0], ahead[1] - first[1]);
        let towards = match east.abs() >= south.abs() {
            true if east > 0.0 => Direction::East,
            true => Direction::West,
            false if south > 0.0 => Direction::South,
            false => Direction::North,
        };
        let [x, y] = line.origin;
        Start { node: (x, y), direction: (east != 0.0 || south != 0.0).then_some(towards) }
    }
}

/// A tile registry on the disk.
#[derive(Debug)]
pub struct Registry {
    path: PathBuf,
    connection: Connection,
}

/// Returns the statements that create the tables. The key of `tiles` has the order in which a bake makes tiles, so that
/// rows are only ever added at the end.
fn schema() -> String {
    let hashes = TilePart::ALL.map(|part| format!("{}_hash BLOB, ", part.name())).concat();
    format!(
        "CREATE TABLE tiles (
            x INTEGER NOT NULL,
            y INTEGER NOT NULL,
            state TEXT NOT NULL,
            stride INTEGER NOT NULL,
            river_x INTEGER,
            river_y INTEGER,
            river_direction TEXT,
            road_x INTEGER,
            road_y INTEGER,
            road_direction TEXT,
            lines TEXT NOT NULL,
            {hashes}
            files TEXT NOT NULL,
            record BLOB,
            PRIMARY KEY (y, x)
        ) STRICT, WITHOUT ROWID;
        CREATE TABLE files (
            path TEXT PRIMARY KEY,
            export TEXT NOT NULL,
            x INTEGER,
            y INTEGER,
            bytes INTEGER NOT NULL,
            blake3 BLOB NOT NULL
        ) STRICT, WITHOUT ROWID;
        CREATE TABLE bake (plan TEXT NOT NULL) STRICT;"
    )
}

/// Message for a registry that SQLite finds broken.
const DAMAGED: &str = "is damaged";

/// Additional tables of a bake in progress.
const JOURNAL_SCHEMA: &str = "
    CREATE TABLE IF NOT EXISTS pieces (
        x INTEGER NOT NULL,
        y INTEGER NOT NULL,
        at INTEGER NOT NULL,
        bytes INTEGER NOT NULL,
        blake3 BLOB NOT NULL,
        PRIMARY KEY (y, x)
    ) STRICT, WITHOUT ROWID;
    CREATE TABLE IF NOT EXISTS records (
        x INTEGER NOT NULL,
        y INTEGER NOT NULL,
        path TEXT NOT NULL,
        record TEXT NOT NULL,
        PRIMARY KEY (y, x, path)
    ) STRICT, WITHOUT ROWID;
    CREATE TABLE IF NOT EXISTS ended (sink TEXT PRIMARY KEY, files TEXT NOT NULL) STRICT, WITHOUT ROWID;";

/// Number of columns of a row in `tiles`.
const COLUMNS: usize = 13 + TilePart::ALL.len();

impl Registry {
    /// Opens the registry at `path`, and creates it if it does not exist. Each batch of rows is safe on the disk once
    /// it is written.
    ///
    /// # Errors
    /// If the file is no registry or one of another version, or cannot be read or written.
    pub fn open(path: &Path) -> Result<Registry, Error> {
        let connection = database::open(path).map_err(sqlite_error(path))?;
        Registry::checked(path, connection, true)
    }

    /// Opens the registry at `path` for reading only; it must exist.
    ///
    /// # Errors
    /// As for [`open`](Registry::open), and if there is no registry.
    pub fn read(path: &Path) -> Result<Registry, Error> {
        if !path.is_file() {
            return Err(Error::Registry {
                path: path.to_owned(),
                message: "there is no tile registry here".into(),
                hint: format!("give the folder of a bake or of a walk, which has a {FILE_NAME}"),
            });
        }
        let connection = database::open_to_read(path).map_err(sqlite_error(path))?;
        Registry::checked(path, connection, false)
    }

    /// Opens the registry of a bake in progress, and creates it if it does not exist. Rows are safe from a crash of the
    /// program at once, and from a crash of the machine after the next [`checkpoint`](Registry::checkpoint).
    pub(crate) fn journal(path: &Path) -> Result<Registry, Error> {
        file::gate(Operation::Create, path)?;
        let connection = database::open(path).map_err(sqlite_error(path))?;
        let prepare = || {
            connection.pragma_update_and_check(None, "journal_mode", "WAL", |_| Ok(()))?;
            connection.pragma_update(None, "synchronous", "NORMAL")
        };
        prepare().map_err(sqlite_error(path))?;
        let registry = Registry::checked(path, connection, true)?;
        registry.connection.execute_batch(JOURNAL_SCHEMA).map_err(sqlite_error(path))?;
        let check = registry.connection.query_row("PRAGMA quick_check(1)", (), |row| row.get::<_, String>(0));
        if check.map_err(sqlite_error(path))? != "ok" {
            return Err(Error::Registry { path: path.to_owned(), message: DAMAGED.into(), hint: String::new() });
        }
        Ok(registry)
    }

    /// True if an error means that the file is not as it was written, and not that it cannot be read or written.
    pub(crate) fn is_damage(error: &Error) -> bool {
        match error {
            Error::Registry { .. } => true,
            Error::Io { source, .. } => {
                let inner = source.get_ref().and_then(|inner| inner.downcast_ref::<rusqlite::Error>());
                let code = inner.and_then(rusqlite::Error::sqlite_error_code);
                matches!(code, Some(ErrorCode::NotADatabase | ErrorCode::DatabaseCorrupt))
            }
            _ => false,
        }
    }

    /// Creates a registry in an empty file that nobody else knows of yet: without a journal and without syncing to the
    /// disk, which is left to the caller who gives the file its name.
    pub(crate) fn aside(path: &Path) -> Result<Registry, Error> {
        let connection = database::open(path).map_err(sqlite_error(path))?;
        unjournaled(&connection).map_err(sqlite_error(path))?;
        Registry::checked(path, connection, true)
    }

    fn checked(path: &Path, connection: Connection, may_create: bool) -> Result<Registry, Error> {
        let refuse =
            |message: String, hint: &str| Error::Registry { path: path.to_owned(), message, hint: hint.into() };
        let stranger = || refuse("is no tile registry of terrane".into(), "give the folder of a bake or of a walk");
        let number = |pragma: &str| connection.pragma_query_value(None, pragma, |row| row.get::<_, i32>(0));
        let header = || Ok((number("application_id")?, number("user_version")?, number("schema_version")?));
        let (application, version, changes) =
            header().map_err(|error: rusqlite::Error| match error.sqlite_error_code() {
                Some(ErrorCode::NotADatabase) => stranger(),
                _ => sqlite_error(path)(error),
            })?;
        // A new file is an empty database.
        if may_create && (application, version, changes) == (0, 0, 0) {
            let create = || {
                // In one transaction: a disk that fills up in between would leave a registry without tables.
                let all_at_once = connection.unchecked_transaction()?;
                all_at_once.pragma_update(None, "application_id", APPLICATION_ID)?;
                all_at_once.pragma_update(None, "user_version", SCHEMA_VERSION)?;
                all_at_once.execute_batch(&schema())?;
                all_at_once.commit()
            };
            create().map_err(sqlite_error(path))?;
        } else if application != APPLICATION_ID {
            return Err(stranger());
        } else if version != SCHEMA_VERSION {
            return Err(refuse(
                format!("has schema version {version}; this program knows {SCHEMA_VERSION}"),
                "use the terrane that has written it, or a newer one",
            ));
        }
        Ok(Registry { path: path.to_owned(), connection })
    }

    /// Writes rows in one transaction. A tile that has a row already gets the new row.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn append(&mut self, rows: impl IntoIterator<Item = TileRow>) -> Result<(), Error> {
        self.write(|connection| rows.into_iter().try_for_each(|row| insert_tile(connection, &row)))
    }

    /// Records tiles of a bake in progress: their rows, their files, and the places of the sinks' pieces, if these are
    /// kept.
    pub(crate) fn note(
        &mut self,
        tiles: impl IntoIterator<Item = (TileRow, Vec<FileRecord>, Option<Pieces>)>,
    ) -> Result<(), Error> {
        self.write(|connection| {
            for (row, files, pieces) in tiles {
                let TileId { x, y } = row.tile;
                insert_tile(connection, &row)?;
                insert_files(connection, &files)?;
                for file in &files {
                    let record = json(file);
                    let mut insert = connection.prepare_cached("INSERT OR REPLACE INTO records VALUES (?, ?, ?, ?)")?;
                    insert.execute(params![x, y, file.path, record])?;
                }
                match pieces {
                    Some(Pieces { at, bytes, blake3 }) => {
                        let mut insert =
                            connection.prepare_cached("INSERT OR REPLACE INTO pieces VALUES (?, ?, ?, ?, ?)")?;
                        insert.execute(params![x, y, at as i64, bytes as i64, blake3.as_bytes()])?
                    }
                    None => connection.prepare_cached("DELETE FROM pieces WHERE y = ? AND x = ?")?.execute((y, x))?,
                };
            }
            Ok(())
        })
    }

    /// Writes the rows of files, and the plan of the bake.
    pub(crate) fn append_files(&mut self, files: &[FileRecord], plan: &str) -> Result<(), Error> {
        self.write(|connection| {
            insert_files(connection, files)?;
            connection.execute("DELETE FROM bake", ())?;
            connection.execute("INSERT INTO bake VALUES (?)", [plan]).map(|_| ())
        })
    }

    /// Records the files that a sink has left when it finished.
    pub(crate) fn end(&mut self, sink: &str, files: &[FileRecord]) -> Result<(), Error> {
        self.write(|connection| {
            insert_files(connection, files)?;
            connection.execute("INSERT OR REPLACE INTO ended VALUES (?, ?)", [sink, &json(&files)]).map(|_| ())
        })
    }

    /// Runs `write` in one transaction.
    fn write(&mut self, write: impl FnOnce(&Connection) -> rusqlite::Result<()>) -> Result<(), Error> {
        file::gate(Operation::Write, &self.path)?;
        let write = || {
            let transaction = self.connection.transaction()?;
            write(&transaction)?;
            transaction.commit()
        };
        write().map_err(sqlite_error(&self.path))
    }

    /// Brings everything in the write-ahead log to the disk.
    pub(crate) fn checkpoint(&self) -> Result<(), Error> {
        file::gate(Operation::Sync, &self.path)?;
        let checkpoint = "PRAGMA wal_checkpoint(PASSIVE)";
        self.connection.query_row(checkpoint, (), |_| Ok(())).map_err(sqlite_error(&self.path))
    }

    /// Number of tiles in the registry.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn tiles(&self) -> Result<u64, Error> {
        let count = self.connection.query_row("SELECT count(*) FROM tiles", (), |row| row.get::<_, i64>(0));
        count.map(|count| count as u64).map_err(sqlite_error(&self.path))
    }

    /// Returns the plan of the bake, as in the manifest; `None` for a walk that was kept by its records alone.
    pub(crate) fn plan(&self) -> Result<Option<String>, Error> {
        let plan = self.connection.query_row("SELECT plan FROM bake", (), |row| row.get(0)).optional();
        plan.map_err(sqlite_error(&self.path))
    }

    /// Visits the rows of all files in the order of their paths.
    ///
    /// # Errors
    /// If the file cannot be read, and the first error of `visit`.
    pub fn for_each_file(&self, mut visit: impl FnMut(FileRow) -> Result<(), Error>) -> Result<(), Error> {
        let wrapped = || sqlite_error(&self.path);
        let mut select = self.connection.prepare_cached("SELECT * FROM files ORDER BY path").map_err(wrapped())?;
        let parse = |row: &Row| {
            let tile = row.get::<_, Option<i64>>("x")?.zip(row.get("y")?);
            Ok(FileRow {
                path: row.get("path")?,
                export: row.get("export")?,
                tile: tile.map(|(x, y)| TileId { x, y }),
                bytes: row.get::<_, i64>("bytes")? as u64,
                blake3: blake3::Hash::from_bytes(row.get("blake3")?),
            })
        };
        for row in select.query_map((), parse).map_err(wrapped())? {
            visit(row.map_err(wrapped())?)?;
        }
        Ok(())
    }

    /// Returns the place of the sinks' pieces of a tile, if it is known.
    pub(crate) fn pieces(&self, tile: TileId) -> Result<Option<Pieces>, Error> {
        let find = || {
            let select = "SELECT at, bytes, blake3 FROM pieces WHERE y = ? AND x = ?";
            let parse = |row: &Row| {
                let number = |column| row.get::<_, i64>(column).map(|number| number as u64);
                Ok(Pieces { at: number(0)?, bytes: number(1)?, blake3: blake3::Hash::from_bytes(row.get(2)?) })
            };
            self.connection.prepare_cached(select)?.query_row((tile.y, tile.x), parse).optional()
        };
        find().map_err(sqlite_error(&self.path))
    }

    /// Returns the files of a tile of a bake in progress.
    pub(crate) fn files_of(&self, tile: TileId) -> Result<Vec<FileRecord>, Error> {
        self.records("SELECT record FROM records WHERE y = ? AND x = ?", &[tile.y, tile.x])
    }

    /// Returns the files of all tiles of a bake in progress.
    pub(crate) fn tile_files(&self) -> Result<Vec<FileRecord>, Error> {
        self.records("SELECT record FROM records", &[])
    }

    fn records(&self, select: &str, tile: &[i64]) -> Result<Vec<FileRecord>, Error> {
        let find = || {
            let mut select = self.connection.prepare_cached(select)?;
            let parse = |row: &Row| parse_json(row, "record");
            select.query_map(params_from_iter(tile), parse)?.collect::<rusqlite::Result<Vec<_>>>()
        };
        find().map_err(sqlite_error(&self.path))
    }

    /// Returns the files that a sink has left when it finished, if it has finished.
    pub(crate) fn ended(&self, sink: &str) -> Result<Option<Vec<FileRecord>>, Error> {
        let find = "SELECT files FROM ended WHERE sink = ?";
        let files = self.connection.query_row(find, [sink], |row| parse_json(row, "files")).optional();
        files.map_err(sqlite_error(&self.path))
    }

    /// Returns the row of a tile, if it has one.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn row(&self, tile: TileId) -> Result<Option<TileRow>, Error> {
        let find = || {
            let mut select = self.connection.prepare_cached("SELECT * FROM tiles WHERE y = ? AND x = ?")?;
            select.query_row((tile.y, tile.x), parse_row).optional()
        };
        find().map_err(sqlite_error(&self.path))
    }

    /// Visits all rows from north to south, and those of equal `y` from west to east, without keeping them in memory.
    ///
    /// # Errors
    /// If the file cannot be read, and the first error of `visit`.
    pub fn for_each(&self, mut visit: impl FnMut(TileRow) -> Result<(), Error>) -> Result<(), Error> {
        let wrapped = || sqlite_error(&self.path);
        let mut select = self.connection.prepare_cached("SELECT * FROM tiles ORDER BY y, x").map_err(wrapped())?;
        for row in select.query_map((), parse_row).map_err(wrapped())? {
            visit(row.map_err(wrapped())?)?;
        }
        Ok(())
    }

    /// Returns all rows, in the order of [`for_each`](Registry::for_each).
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn rows(&self) -> Result<Vec<TileRow>, Error> {
        let mut rows = Vec::new();
        self.for_each(|row| {
            rows.push(row);
            Ok(())
        })?;
        Ok(rows)
    }

    /// Closes the file, so that it can be moved.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn close(self) -> Result<(), Error> {
        let Registry { path, connection } = self;
        connection.close().map_err(|(_, error)| sqlite_error(path)(error))
    }
}

/// A file's row in the registry.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FileRow {
    /// Path in the folder of the bake, with `/` between its parts.
    pub path: String,
    /// The export that the file belongs to.
    pub export: String,
    /// The tile that the file shows; `None` for the region.
    pub tile: Option<TileId>,
    /// Size in bytes.
    pub bytes: u64,
    /// BLAKE3 hash of the file's bytes.
    pub blake3: blake3::Hash,
}

impl FileRow {
    /// Converts the row to an entry of the manifest, as far as the registry knows the file.
    pub(crate) fn record(self) -> FileRecord {
        let finished = Finished { bytes: self.bytes, blake3: self.blake3 };
        FileRecord { tile: self.tile, ..FileRecord::new(self.path, &self.export, finished) }
    }
}

fn insert_tile(connection: &Connection, row: &TileRow) -> rusqlite::Result<()> {
    let text = |text: &str| Some(Value::Text(text.to_owned()));
    let start = |start: Option<Start>| {
        let direction = start.and_then(|start| start.direction).map(|it| Value::Text(it.name().into()));
        let number = |pick: fn(Node) -> i64| start.map(|start| Value::Integer(pick(start.node)));
        [number(|node| node.0), number(|node| node.1), direction]
    };
    let hash = |part| Some(Value::Blob(row.digest.as_ref()?.of(part)?.as_bytes().to_vec()));
    let tile = [row.tile.x, row.tile.y].map(|number| Some(Value::Integer(number)));
    let values = tile.into_iter().chain([text(row.state.name()), Some(Value::Integer(row.stride))]);
    let values = values.chain(start(row.river)).chain(start(row.road)).chain([text(&json(&row.lines))]);
    let values = values.chain(TilePart::ALL.map(hash));
    let values = values.chain([text(&json(&row.files)), row.record.clone().map(Value::Blob)]);
    let marks = ["?"; COLUMNS].join(", ");
    let mut insert = connection.prepare_cached(&format!("INSERT OR REPLACE INTO tiles VALUES ({marks})"))?;
    insert.execute(params_from_iter(values)).map(|_| ())
}

fn insert_files(connection: &Connection, files: &[FileRecord]) -> rusqlite::Result<()> {
    for FileRecord { path, export, tile, bytes, blake3, .. } in files {
        let mut insert = connection.prepare_cached("INSERT OR REPLACE INTO files VALUES (?, ?, ?, ?, ?, ?)")?;
        let hash =
            blake3::Hash::from_hex(blake3).map_err(|error| rusqlite::Error::ToSqlConversionFailure(error.into()))?;
        insert.execute(params![
            path,
            export,
            tile.map(|tile| tile.x),
            tile.map(|tile| tile.y),
            *bytes as i64,
            hash.as_bytes()
        ])?;
    }
    Ok(())
}

fn json(value: &impl serde::Serialize) -> String {
    serde_json::to_string(value).expect("texts and numbers are JSON")
}

fn parse_json<T: serde::de::DeserializeOwned>(row: &Row, column: &str) -> rusqlite::Result<T> {
    let text: String = row.get(column)?;
    serde_json::from_str(&text).map_err(|error| damaged(row, column, error))
}

/// Turns off SQLite's journal and syncing, since the file is lost anyway if the program ends early; and fixes the page
/// size, on which the file's bytes depend.
pub(crate) fn unjournaled(connection: &Connection) -> rusqlite::Result<()> {
    connection.pragma_update(None, "page_size", 4096)?;
    connection.pragma_update_and_check(None, "journal_mode", "OFF", |_| Ok(()))?;
    connection.pragma_update(None, "synchronous", "OFF")
}

fn parse_row(row: &Row) -> rusqlite::Result<TileRow> {
    let start = |x: &str, y: &str, direction: &str| {
        let Some(node) = row.get::<_, Option<i64>>(x)?.zip(row.get(y)?) else { return Ok(None) };
        let name: Option<String> = row.get(direction)?;
        let direction = name.map(|name| {
            let found = Direction::ALL.into_iter().find(|direction| direction.name() == name);
            found.ok_or_else(|| damaged(row, direction, format!("{name:?} is no direction")))
        });
        Ok::<_, rusqlite::Error>(Some(Start { node, direction: direction.transpose()? }))
    };
    let mut hashes = [None; TilePart::ALL.len()];
    for (hash, part) in hashes.iter_mut().zip(TilePart::ALL) {
        let bytes: Option<[u8; 32]> = row.get(format!("{}_hash", part.name()).as_str())?;
        *hash = bytes.map(blake3::Hash::from_bytes);
    }
    let state: String = row.get("state")?;
    let named = TileState::ALL.into_iter().find(|known| known.name() == state);
    Ok(TileRow {
        tile: TileId { x: row.get("x")?, y: row.get("y")? },
        state: named.ok_or_else(|| damaged(row, "state", format!("{state:?} is no state")))?,
        stride: row.get("stride")?,
        river: start("river_x", "river_y", "river_direction")?,
        road: start("road_x", "road_y", "road_direction")?,
        lines: parse_json(row, "lines")?,
        digest: hashes.iter().any(Option::is_some).then(|| Digest::new(hashes)),
        files: parse_json(row, "files")?,
        record: row.get("record")?,
    })
}

fn damaged(row: &Row, column: &str, error: impl Into<Box<dyn std::error::Error + Send + Sync>>) -> rusqlite::Error {
    rusqlite::Error::FromSqlConversionFailure(row.as_ref().column_index(column).unwrap_or(0), Type::Text, error.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tile_row(x: i64, y: i64) -> TileRow {
        let hash = |what: &str| blake3::hash(format!("{what} {x} {y}").as_bytes());
        TileRow {
            tile: TileId { x, y },
            state: TileState::Baked,
            stride: 4,
            river: (x > 0).then_some(Start { node: (x ^ 3, y ^ 1), direction: Some(Direction::West) }),
            road: (y > 0).then_some(Start { node: (x ^ 8, y ^ 8), direction: None }),
            lines: vec![format!("r0:{x}:{y}")],
            digest: (x != y)
                .then(|| Digest::new(TilePart::ALL.map(|it| (it != TilePart::Depth).then(|| hash(it.name()))))),
            files: vec![format!("height/height_x{x}_y{y}.png"), "a \"quoted\" name".into()],
            record: (x == y).then(|| vec![1, 2, x as u8]),
        }
    }

    #[test]
    fn rows_come_back_as_they_went_in_sorted() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(FILE_NAME);
        let mut registry = Registry::open(&path).unwrap();
        registry.append([tile_row(3, 1), tile_row(-2, 1)]).unwrap();
        registry.append([tile_row(i64::MAX, i64::MIN), tile_row(0, 0)]).unwrap();
        let expected = [tile_row(i64::MAX, i64::MIN), tile_row(0, 0), tile_row(-2, 1), tile_row(3, 1)];
        assert_eq!(registry.rows().unwrap(), expected);
        // A registry that is opened again goes on where it stopped.
        registry.close().unwrap();
        let mut registry = Registry::open(&path).unwrap();
        let changed = TileRow { record: Some(vec![7; 40]), ..tile_row(0, 0) };
        registry.append([changed.clone()]).unwrap();
        assert_eq!(registry.row(TileId { x: 0, y: 0 }).unwrap(), Some(changed));
        assert_eq!(registry.row(TileId { x: 5, y: 0 }).unwrap(), None);
        assert_eq!(registry.rows().unwrap().len(), 4);
        assert_eq!(Registry::read(&path).unwrap().rows().unwrap(), registry.rows().unwrap());
    }

    #[test]
    fn what_is_no_registry_is_refused_with_a_hint() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(FILE_NAME);
        let refused = |result: Result<Registry, Error>, word: &str| {
            let error = result.unwrap_err();
            assert!(error.to_string().contains(word) && error.hint().is_some(), "{error}");
            assert_eq!(error.exit_code(), 2);
        };
        refused(Registry::read(&path), "there is no tile registry");
        assert!(!path.exists(), "reading makes no file");
        std::fs::write(&path, "a text that is no database at all, and long enough to be one. ".repeat(20)).unwrap();
        refused(Registry::read(&path), "no tile registry");
        refused(Registry::open(&path), "no tile registry");
        // A database of another program, and an empty file.
        std::fs::remove_file(&path).unwrap();
        Connection::open(&path).unwrap().execute_batch("CREATE TABLE mine (a)").unwrap();
        refused(Registry::open(&path), "no tile registry");
        std::fs::write(&path, "").unwrap();
        refused(Registry::read(&path), "no tile registry");
        // A registry that a newer program has written.
        let registry = Registry::open(&path).unwrap();
        registry.connection.pragma_update(None, "user_version", SCHEMA_VERSION + 1).unwrap();
        registry.close().unwrap();
        refused(Registry::read(&path), "schema version 4");
        refused(Registry::open(&path), "this program knows 3");
    }
}
