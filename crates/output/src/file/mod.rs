//! Files that are either complete or do not exist.

pub(crate) mod database;
mod disk;
mod record;

#[cfg(test)]
pub(crate) use disk::{Disk, double};
pub(crate) use disk::{Operation, copy, free_bytes, gate, link, remove, remove_folder, rename};
pub use disk::{make_folder, sync_folder};
pub(crate) use record::path_in;
pub use record::{FileRecord, Finished, MeshRecord};

use std::fs::{self, Permissions};
use std::io::{self, BufWriter, IntoInnerError, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard};

use tempfile::NamedTempFile;

use crate::error::Error;

/// Wraps an error of SQLite about a database.
pub(crate) fn sqlite_error(path: impl AsRef<Path>) -> impl FnOnce(rusqlite::Error) -> Error {
    move |error| Error::Io { path: path.as_ref().to_owned(), source: io::Error::other(error) }
}

/// Ending of the names of unfinished files; their names begin with a dot.
const UNFINISHED: &str = ".part";

/// A file in progress: written beside its final name, renamed when complete, and removed if it is dropped before that.
///
/// The hash is taken of the bytes as they pass, so nothing is read back unless the writer has gone back in the file.
pub(crate) struct PartFile {
    path: PathBuf,
    file: BufWriter<Gated>,
    hasher: blake3::Hasher,
    bytes: u64,
    rewritten: bool,
}

impl PartFile {
    /// Creates the file that will be at `path`.
    pub fn create(path: PathBuf) -> Result<PartFile, Error> {
        let (folder, name) = (path.parent().unwrap_or(Path::new(".")), path.file_name().unwrap_or_default());
        let mut builder = tempfile::Builder::new();
        let prefix = format!(".{}.", name.to_string_lossy());
        // In the same folder, because a rename is a single step only within a file system.
        builder.prefix(&prefix).suffix(UNFINISHED);
        // With the permissions of any new file; temporary files are more private by default.
        #[cfg(unix)]
        builder.permissions(<Permissions as std::os::unix::fs::PermissionsExt>::from_mode(0o666));
        gate(Operation::Create, &path)?;
        let file = Gated(builder.tempfile_in(folder).map_err(Error::io(&path))?);
        // Rows come in small pieces. Buffers larger than half a mebibyte per system call do not pay.
        let file = BufWriter::with_capacity(1 << 19, file);
        Ok(PartFile { path, file, hasher: blake3::Hasher::new(), bytes: 0, rewritten: false })
    }

    /// Final path of the file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the path of the unfinished file, for a library that opens files by itself. The library must close the
    /// file before [`finish`](PartFile::finish).
    pub fn lend(&mut self) -> &Path {
        self.rewritten = true;
        self.file.get_ref().0.path()
    }

    /// Syncs the bytes to the disk and gives the file its name.
    pub fn finish(mut self) -> Result<Finished, Error> {
        let finished = self.seal().map_err(Error::io(&self.path))?;
        let file = self.file.into_inner().map_err(IntoInnerError::into_error);
        let Gated(file) = file.map_err(Error::io(&self.path))?;
        gate(Operation::Rename, &self.path)?;
        file.persist(&self.path).map_err(|error| Error::Io { path: self.path.clone(), source: error.error })?;
        Ok(finished)
    }

    fn seal(&mut self) -> io::Result<Finished> {
        self.file.flush()?;
        let Gated(file) = self.file.get_mut();
        disk::allow(Operation::Sync, &self.path, 0)?;
        let file = file.as_file_mut();
        // Sync before the rename, or after a power cut there may be a name without the bytes.
        file.sync_all()?;
        if !self.rewritten {
            return Ok(Finished { bytes: self.bytes, blake3: self.hasher.finalize() });
        }
        // Another writer wrote, or the writer went back: the bytes that passed are not the file's bytes.
        let mut hasher = blake3::Hasher::new();
        file.seek(SeekFrom::Start(0))?;
        hasher.update_reader(file)?;
        Ok(Finished { bytes: hasher.count(), blake3: hasher.finalize() })
    }
}

/// A file to which the [disk] may refuse to write.
struct Gated(NamedTempFile);

impl Write for Gated {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let count = disk::allow(Operation::Write, self.0.path(), bytes.len())?;
        self.0.write(&bytes[..count])
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.flush()
    }
}

impl Seek for Gated {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.0.seek(to)
    }
}

impl Write for PartFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.file.write(bytes)?;
        if !self.rewritten {
            self.hasher.update(&bytes[..written]);
            self.bytes += written as u64;
        }
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl Seek for PartFile {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let position = self.file.seek(to)?;
        // Asking for the position is a seek too, and changes nothing.
        self.rewritten |= position != self.bytes;
        Ok(position)
    }
}

/// A file that a writer owns as well, for writers that do not give their file back.
#[derive(Clone)]
pub(crate) struct SharedFile(Arc<Mutex<PartFile>>);

impl SharedFile {
    /// Shares a file.
    pub fn new(file: PartFile) -> SharedFile {
        SharedFile(Arc::new(Mutex::new(file)))
    }

    /// Final path of the file.
    pub fn path(&self) -> PathBuf {
        self.lock().path().to_owned()
    }

    /// Finishes the file, as [`PartFile::finish`]. The writer must be gone.
    pub fn finish(self) -> Result<Finished, Error> {
        let file = Arc::into_inner(self.0).expect("the writer is gone").into_inner();
        file.expect("no thread panics while it writes").finish()
    }

    fn lock(&self) -> MutexGuard<'_, PartFile> {
        self.0.lock().expect("no thread panics while it writes")
    }
}

impl Write for SharedFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.lock().write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.lock().flush()
    }
}

impl Seek for SharedFile {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.lock().seek(to)
    }
}

/// Writes a small file at once.
///
/// # Errors
/// If the disk refuses it. Then the file does not exist, or is as it was.
pub fn write_whole(path: PathBuf, content: &[u8]) -> Result<Finished, Error> {
    let mut file = PartFile::create(path)?;
    file.write_all(content).map_err(Error::io(file.path()))?;
    file.finish()
}

/// Removes the unfinished files of a killed bake from a folder, if the folder exists.
///
/// # Errors
/// If the disk refuses it.
pub fn remove_unfinished(folder: &Path) -> Result<(), Error> {
    // A folder that does not exist has no leftovers.
    let Ok(entries) = fs::read_dir(folder) else { return Ok(()) };
    for entry in entries.flatten() {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        if name.starts_with('.') && name.ends_with(UNFINISHED) {
            remove(&entry.path())?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_has_its_name_only_when_whole() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.bin");
        let mut file = PartFile::create(path.clone()).unwrap();
        file.write_all(b"half").unwrap();
        assert!(!path.exists());
        drop(file);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0, "an abandoned file leaves nothing");
        let finished = write_whole(path.clone(), b"whole").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"whole");
        assert_eq!((finished.bytes, finished.blake3), (5, blake3::hash(b"whole")));
    }

    #[test]
    fn the_hash_is_of_the_final_bytes_even_if_the_writer_went_back() {
        let folder = tempfile::tempdir().unwrap();
        let mut file = PartFile::create(folder.path().join("a.bin")).unwrap();
        file.write_all(b"????tail").unwrap();
        file.seek(SeekFrom::Start(0)).unwrap();
        file.write_all(b"head").unwrap();
        let finished = file.finish().unwrap();
        assert_eq!((finished.bytes, finished.blake3), (8, blake3::hash(b"headtail")));
    }

    #[test]
    fn leftovers_of_a_killed_bake_are_removed_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        for name in [".height.png.ab12.part", "kept.part", ".kept"] {
            fs::write(folder.path().join(name), "x").unwrap();
        }
        remove_unfinished(folder.path()).unwrap();
        let mut left: Vec<_> = fs::read_dir(folder.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
        left.sort();
        assert_eq!(left, [".kept", "kept.part"]);
    }
}
