//! The disk as the rest of the program sees it. Everything that changes files or folders goes through here, so that
//! tests can simulate a disk that is full, broken or read-only at any operation.

use std::fs::{self, File};
use std::io;
use std::path::Path;

use crate::error::Error;
use crate::file::PartFile;

/// An operation on the disk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Operation {
    /// Make or open a file.
    Create,
    /// Write to a file.
    Write,
    /// Wait until a file is on the disk.
    Sync,
    /// Rename a file.
    Rename,
    /// Remove a file.
    Remove,
    /// Make a folder.
    Folder,
}

/// Decides whether an operation succeeds.
pub(crate) trait Disk: Send + Sync {
    /// Returns the number of bytes, of `bytes`, that an operation may write; 0 for an operation that writes none.
    fn allow(&self, operation: Operation, path: &Path, bytes: usize) -> io::Result<usize>;
}

/// The real disk, which allows everything.
struct Plain;

impl Disk for Plain {
    fn allow(&self, _operation: Operation, _path: &Path, bytes: usize) -> io::Result<usize> {
        Ok(bytes)
    }
}

/// Returns the number of bytes that an operation may write.
pub(crate) fn allow(operation: Operation, path: &Path, bytes: usize) -> io::Result<usize> {
    #[cfg(test)]
    if let Some(double) = double::at(path) {
        return double.allow(operation, path, bytes);
    }
    Plain.allow(operation, path, bytes)
}

/// Checks an operation that a library then does by itself.
///
/// # Errors
/// If the disk refuses it.
pub(crate) fn gate(operation: Operation, path: &Path) -> Result<(), Error> {
    allow(operation, path, 0).map(drop).map_err(Error::io(path))
}

/// Makes a folder and its parents; the folder may exist already.
///
/// # Errors
/// If the disk refuses it.
pub fn make_folder(path: &Path) -> Result<(), Error> {
    gate(Operation::Folder, path)?;
    fs::create_dir_all(path).map_err(Error::io(path))
}

/// Renames a file in one step, and replaces a file that has the new name. If the new name is on another file system,
/// the file is copied there first.
pub(crate) fn rename(from: &Path, to: &Path) -> Result<(), Error> {
    gate(Operation::Rename, to)?;
    match fs::rename(from, to) {
        Err(error) if error.kind() == io::ErrorKind::CrossesDevices => {
            copy(from, to)?;
            remove(from)
        }
        done => done.map_err(Error::io(to)),
    }
}

/// Removes a file, if it exists.
pub(crate) fn remove(path: &Path) -> Result<(), Error> {
    gate(Operation::Remove, path)?;
    match fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(Error::io(path)(error)),
        _ => Ok(()),
    }
}

/// Gives a file a second name, or makes a copy where the file system has no hard links. A file that has the new name is
/// replaced.
pub(crate) fn link(from: &Path, to: &Path) -> Result<(), Error> {
    // Remove the old file first: it may already be the same file, and copying a file onto itself would leave nothing.
    remove(to)?;
    gate(Operation::Create, to)?;
    fs::hard_link(from, to).or_else(|_| copy(from, to))
}

/// Copies a file, and replaces a file that has the new name.
pub(crate) fn copy(from: &Path, to: &Path) -> Result<(), Error> {
    let mut copy = PartFile::create(to.to_owned())?;
    io::copy(&mut File::open(from).map_err(Error::io(from))?, &mut copy).map_err(Error::io(to))?;
    copy.finish().map(drop)
}

/// Removes a folder with everything in it, if it exists. Links are not followed.
pub(crate) fn remove_folder(path: &Path) -> Result<(), Error> {
    gate(Operation::Remove, path)?;
    match fs::remove_dir_all(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(Error::io(path)(error)),
        _ => Ok(()),
    }
}

/// Syncs a folder's list of names to the disk, so that renamed files keep their names after a power cut.
///
/// # Errors
/// If the disk refuses it.
pub fn sync_folder(folder: &Path) -> Result<(), Error> {
    gate(Operation::Sync, folder)?;
    if cfg!(unix) {
        File::open(folder).and_then(|folder| folder.sync_all()).map_err(Error::io(folder))?;
    }
    Ok(())
}

/// Returns the free bytes of the file system where a path will be. None if the file system does not tell: then the bake
/// goes on, and fails later if there is too little room.
pub(crate) fn free_bytes(path: &Path) -> Option<u64> {
    // The folder may not exist yet; the nearest existing folder above it is on the same disk.
    let existing = path.ancestors().find(|part| part.exists()).unwrap_or(Path::new("."));
    let existing = if existing.as_os_str().is_empty() { Path::new(".") } else { existing };
    let room = fs4::statvfs(existing).ok().filter(|room| room.total_space() > 0)?;
    Some(room.available_space())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_may_get_its_second_name_twice() {
        let folder = tempfile::tempdir().unwrap();
        let [from, to] = ["from", "to"].map(|name| folder.path().join(name));
        fs::write(&from, "precious").unwrap();
        for _ in 0..2 {
            link(&from, &to).unwrap();
            assert!([&from, &to].iter().all(|path| fs::read(path).unwrap() == b"precious"));
        }
        copy(&from, &to).unwrap();
        fs::write(&to, "other").unwrap();
        assert_eq!(fs::read(&from).unwrap(), b"precious");
    }
}

/// Simulated disks for tests, each for one folder.
#[cfg(test)]
pub(crate) mod double {
    use std::path::PathBuf;
    use std::sync::{Arc, RwLock};

    use super::*;

    static DOUBLES: RwLock<Vec<(PathBuf, Arc<dyn Disk>)>> = RwLock::new(Vec::new());

    pub(super) fn at(path: &Path) -> Option<Arc<dyn Disk>> {
        let doubles = DOUBLES.read().unwrap();
        doubles.iter().find(|(folder, _)| path.starts_with(folder)).map(|(_, disk)| disk.clone())
    }

    /// Runs `work` while a folder is on a simulated disk.
    pub(crate) fn with<T>(folder: &Path, disk: Arc<dyn Disk>, work: impl FnOnce() -> T) -> T {
        DOUBLES.write().unwrap().push((folder.to_owned(), disk));
        let result = work();
        DOUBLES.write().unwrap().retain(|(other, _)| other != folder);
        result
    }
}
