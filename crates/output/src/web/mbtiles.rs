//! An MBTiles archive: all tiles of a set in one SQLite database, as desktop programs and tile servers read it.
//!
//! Based on: Mapbox, MBTiles 1.3. Rows are counted from the south. Tiles with the same picture share one copy of it:
//! the table `map` has the places of tiles, the table `images` the pictures, and the SQL view `tiles` joins both, as
//! the specification proposes. All tiles have 256 pixels per side, because GDAL before its version 3.10 and many other
//! programs accept no other size. So a dense tile, which has 512, is cut into four tiles of the next zoom level.

use std::path::{Path, PathBuf};

use rusqlite::{Connection, params};

use crate::error::Error;
use crate::file::{Finished, PartFile, database, sqlite_error};
use crate::registry::unjournaled;
use crate::web::meta::Described;
use crate::web::pyramid::TilePlace;

/// The application id `MPBX` in the database's header, by which `file` and GDAL recognise MBTiles.
const APPLICATION_ID: i32 = i32::from_be_bytes(*b"MPBX");

/// Length in bytes of a picture's id: the beginning of the picture's hash, long enough to differ from all other ids.
const ID_BYTES: usize = 16;

const SCHEMA: &str = include_str!("mbtiles.sql");

/// An archive that is being written.
pub(super) struct MbTiles {
    path: PathBuf,
    /// The open database. Fields are dropped in order, so this one stands before `file`: the database is closed before
    /// the file of an unfinished archive is removed.
    connection: Connection,
    file: PartFile,
}

impl MbTiles {
    /// Creates the archive under a temporary name. [`finish`](MbTiles::finish) renames it to `path`.
    pub fn create(path: PathBuf, format: &str, about: &Described) -> Result<MbTiles, Error> {
        let mut file = PartFile::create(path.clone())?;
        let connection = open(file.lend(), format, about).map_err(sqlite_error(&path))?;
        Ok(MbTiles { path, connection, file })
    }

    /// Adds a tile. `hash` is the hash of its bytes.
    pub fn add(&mut self, place: TilePlace, hash: &blake3::Hash, bytes: &[u8]) -> Result<(), Error> {
        let add = || {
            let id = &hash.as_bytes()[..ID_BYTES];
            let mut images = self.connection.prepare_cached("INSERT OR IGNORE INTO images VALUES (?, ?)")?;
            images.execute(params![id, bytes])?;
            let mut map = self.connection.prepare_cached("INSERT INTO map VALUES (?, ?, ?, ?)")?;
            let row = (1_u32 << place.zoom) - 1 - place.y;
            map.execute(params![place.zoom, place.x, row, id])
        };
        add().map(|_| ()).map_err(sqlite_error(&self.path))
    }

    /// Closes the database and gives the file its name.
    pub fn finish(self) -> Result<Finished, Error> {
        self.connection.execute_batch("COMMIT").map_err(sqlite_error(&self.path))?;
        self.connection.close().map_err(|(_, error)| sqlite_error(&self.path)(error))?;
        self.file.finish()
    }
}

fn open(at: &Path, format: &str, about: &Described) -> rusqlite::Result<Connection> {
    let connection = database::open(at)?;
    unjournaled(&connection)?;
    connection.pragma_update(None, "application_id", APPLICATION_ID)?;
    // Use one transaction for all; otherwise each statement would be a transaction of its own.
    connection.execute_batch("BEGIN")?;
    connection.execute_batch(SCHEMA)?;
    let list = |numbers: &[f64]| numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(",");
    let (longitude, latitude, zoom) = about.center();
    let rows = [
        ("name", about.name.clone()),
        ("format", format.to_owned()),
        ("bounds", list(&about.degrees)),
        ("center", format!("{},{zoom}", list(&[longitude, latitude]))),
        ("minzoom", about.zooms.start().to_string()),
        ("maxzoom", about.zooms.end().to_string()),
        ("type", "baselayer".to_owned()),
        ("version", about.version.clone()),
        ("description", about.description.clone()),
        ("json", about.json().to_string()),
    ];
    for (name, value) in rows {
        connection.execute("INSERT INTO metadata VALUES (?, ?)", [name, &value])?;
    }
    Ok(connection)
}
