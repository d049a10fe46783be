//! The disk, as all that writes sees it: whatever changes files or folders goes through here, so that tests can have a disk that
//! is full, broken or read-only at any operation they like.

use std::fs::{self, File};
use std::io;
use std::path::Path;

use crate::error::Error;
use crate::file::PartFile;

/// What is done to the disk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Operation {
    /// To make or open a file.
    Create,
    /// To write to it.
    Write,
    /// To wait until it is on the disk.
    Sync,
    /// To give it another name.
    Rename,
    /// To remove it.
    Remove,
    /// To make a folder.
    Folder,
}

/// Who decides whether something can be done.
pub(crate) trait Disk: Send + Sync {
    /// How many bytes an operation may take of those that it would; 0 for one that takes none.
    fn allow(&self, operation: Operation, path: &Path, bytes: usize) -> io::Result<usize>;
}

/// The disk as it is.
struct Plain;

impl Disk for Plain {
    fn allow(&self, _operation: Operation, _path: &Path, bytes: usize) -> io::Result<usize> {
        Ok(bytes)
    }
}

/// How many bytes an operation may take.
pub(crate) fn allow(operation: Operation, path: &Path, bytes: usize) -> io::Result<usize> {
    #[cfg(test)]
    if let Some(double) = double::at(path) {
        return double.allow(operation, path, bytes);
    }
    Plain.allow(operation, path, bytes)
}

/// Lets an operation pass that a library does by itself.
///
/// # Errors
/// When it cannot be done.
pub(crate) fn gate(operation: Operation, path: &Path) -> Result<(), Error> {
    allow(operation, path, 0).map(drop).map_err(Error::io(path))
}

/// Makes a folder and those that it is in; it may be there already.
///
/// # Errors
/// When the disk refuses it.
pub fn make_folder(path: &Path) -> Result<(), Error> {
    gate(Operation::Folder, path)?;
    fs::create_dir_all(path).map_err(Error::io(path))
}

/// Gives a file another name, in one step; what has that name is gone. Where that is on another file system the file is copied
/// there first.
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

/// Removes a file; one that is not there is no mistake.
pub(crate) fn remove(path: &Path) -> Result<(), Error> {
    gate(Operation::Remove, path)?;
    match fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(Error::io(path)(error)),
        _ => Ok(()),
    }
}

/// Gives a file a second name, or where the file system knows no such thing makes a copy; what has that name is gone.
pub(crate) fn link(from: &Path, to: &Path) -> Result<(), Error> {
    // First: it may be that very file already, of which a copy would leave nothing.
    remove(to)?;
    gate(Operation::Create, to)?;
    fs::hard_link(from, to).or_else(|_| copy(from, to))
}

/// Copies a file; what has that name is gone.
pub(crate) fn copy(from: &Path, to: &Path) -> Result<(), Error> {
    let mut copy = PartFile::create(to.to_owned())?;
    io::copy(&mut File::open(from).map_err(Error::io(from))?, &mut copy).map_err(Error::io(to))?;
    copy.finish().map(drop)
}

/// Removes a folder with all that is in it, following no link; it may not be there.
pub(crate) fn remove_folder(path: &Path) -> Result<(), Error> {
    gate(Operation::Remove, path)?;
    match fs::remove_dir_all(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(Error::io(path)(error)),
        _ => Ok(()),
    }
}

/// Brings a folder's list of names to the disk, so that renamed files keep their names after a power cut.
///
/// # Errors
/// When the disk refuses it.
pub fn sync_folder(folder: &Path) -> Result<(), Error> {
    gate(Operation::Sync, folder)?;
    if cfg!(unix) {
        File::open(folder).and_then(|folder| folder.sync_all()).map_err(Error::io(folder))?;
    }
    Ok(())
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

/// Disks of tests, each that of a folder.
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

    /// What is done with a folder that is on another disk meanwhile.
    pub(crate) fn with<T>(folder: &Path, disk: Arc<dyn Disk>, work: impl FnOnce() -> T) -> T {
        DOUBLES.write().unwrap().push((folder.to_owned(), disk));
        let result = work();
        DOUBLES.write().unwrap().retain(|(other, _)| other != folder);
        result
    }
}
