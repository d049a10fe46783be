//! SQLite databases, opened without SQLite's own locks.
//!
//! Some file systems have no locks for parts of a file: NFS without its lock daemon, Lustre without `flock`, some kinds
//! of CIFS. There, SQLite with its locks opens nothing. Its locks are not needed: the folder of a bake has a lock of
//! its own, or the user was told that it has none, and only the holder of the folder writes.
//!
//! A reader of the journal of a bake in progress may come while pages are moved from the write-ahead log to the file.
//! At that moment the reader finds the file damaged.

use std::path::Path;

use rusqlite::config::DbConfig;
use rusqlite::{Connection, OpenFlags};

/// SQLite's interface to the operating system that takes no locks.
const UNLOCKED: &str = if cfg!(windows) { "win32-none" } else { "unix-none" };

/// Opens the database at a path for writing, and creates it if it does not exist.
pub(crate) fn open(path: &Path) -> rusqlite::Result<Connection> {
    unlocked(path, OpenFlags::SQLITE_OPEN_READ_WRITE | OpenFlags::SQLITE_OPEN_CREATE)
}

/// Opens the existing database at a path for reading only.
pub(crate) fn open_to_read(path: &Path) -> rusqlite::Result<Connection> {
    let connection = unlocked(path, OpenFlags::SQLITE_OPEN_READ_ONLY)?;
    // The write-ahead log is the writer's: closing must not move the log into the file and remove it.
    connection.set_db_config(DbConfig::SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, true)?;
    Ok(connection)
}

fn unlocked(path: &Path, how: OpenFlags) -> rusqlite::Result<Connection> {
    let connection = Connection::open_with_flags_and_vfs(path, how | OpenFlags::SQLITE_OPEN_NO_MUTEX, UNLOCKED)?;
    // This keeps the index of a write-ahead log in the memory of this process. Otherwise processes would share it in a
    // file, by locks.
    connection.pragma_update_and_check(None, "locking_mode", "EXCLUSIVE", |_| Ok(()))?;
    Ok(connection)
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    fn count(connection: &Connection) -> i64 {
        connection.query_row("SELECT count(*) FROM rows", (), |row| row.get(0)).unwrap()
    }

    #[test]
    fn a_reader_takes_no_log_away_from_the_writer() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.sqlite");
        let writer = open(&path).unwrap();
        writer.pragma_update_and_check(None, "journal_mode", "WAL", |_| Ok(())).unwrap();
        writer.execute_batch("CREATE TABLE rows (a); INSERT INTO rows VALUES (1)").unwrap();
        for rows in 1..5 {
            let reader = open_to_read(&path).unwrap();
            assert_eq!(count(&reader), rows);
            drop(reader);
            writer.execute_batch("INSERT INTO rows VALUES (2)").unwrap();
        }
        // As a killed writer leaves the files: its rows are in the log alone.
        let left = folder.path().join("b.sqlite");
        fs::copy(&path, &left).unwrap();
        fs::copy(folder.path().join("a.sqlite-wal"), folder.path().join("b.sqlite-wal")).unwrap();
        assert_eq!(count(&open_to_read(&left).unwrap()), 5);
        assert_eq!(count(&open(&left).unwrap()), 5);
        drop(writer);
        assert_eq!(count(&open_to_read(&path).unwrap()), 5);
        assert!(!folder.path().join("a.sqlite-shm").exists());
    }
}
