//! The lock of a folder: one bake writes to it at a time.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::thread;
use std::time::Duration;

use crate::error::Error;
use crate::file::{Operation, gate};

/// The file that is locked. It exists while a bake writes to the folder. After a killed bake it stays, but unlocked,
/// which does no harm.
pub(crate) const FILE_NAME: &str = ".terrane.lock";

/// Number of attempts to take a lock, and the pause between two attempts.
const TRIES: u32 = 20;
const PAUSE: Duration = Duration::from_millis(10);

/// Largest number of bytes that are read of the holder's text.
const WORDS: u64 = 200;

/// The lock that a bake holds while it writes to a folder. The system releases the lock when the process ends, however
/// it ends.
#[derive(Debug)]
pub(crate) struct Lock {
    path: PathBuf,
    /// None if the file system has no locks.
    file: Option<File>,
}

impl Lock {
    /// Takes the lock of a folder, which must exist.
    ///
    /// # Errors
    /// When another process holds the lock, or when its file cannot be made.
    pub fn take(folder: &Path) -> Result<Lock, Error> {
        let path = folder.join(FILE_NAME);
        for _ in 0..TRIES {
            if path.symlink_metadata().is_ok_and(|there| !there.is_file()) {
                return Err(Error::Output {
                    path: folder.into(),
                    message: format!("has a {FILE_NAME} that is no file"),
                    hint: "terrane writes its lock there: remove it, or choose another folder with --out".into(),
                });
            }
            gate(Operation::Create, &path)?;
            let mut options = OpenOptions::new();
            let mut file =
                options.read(true).write(true).create(true).truncate(false).open(&path).map_err(Error::io(&path))?;
            match file.try_lock() {
                Ok(()) if is_at(&file, &path) => {
                    let says = format!("process {}\n", std::process::id());
                    let written = file.set_len(0).and_then(|()| file.write_all(says.as_bytes()));
                    written.map_err(Error::io(&path))?;
                    return Ok(Lock { path, file: Some(file) });
                }
                // The previous holder removed the file after it was opened here, or a process that only checks holds
                // the lock.
                Ok(()) | Err(TryLockError::WouldBlock) => thread::sleep(PAUSE),
                Err(TryLockError::Error(_)) => return Ok(Lock { path, file: None }),
            }
        }
        Err(held(folder, &path))
    }

    /// Checks that no bake is writing to a folder. The folder need not exist.
    ///
    /// # Errors
    /// When a bake is writing to it.
    pub fn check(folder: &Path) -> Result<(), Error> {
        let path = folder.join(FILE_NAME);
        let Ok(file) = File::open(&path) else { return Ok(()) };
        match file.try_lock_shared() {
            Err(TryLockError::WouldBlock) => Err(held(folder, &path)),
            _ => Ok(()),
        }
    }

    /// True if the lock keeps others out. On a file system without locks it does not.
    pub fn is_held(&self) -> bool {
        self.file.is_some()
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        // Remove the file while its lock is still held, so that it cannot be the file of another holder.
        _ = fs::remove_file(&self.path);
    }
}

/// Returns the error for a folder that another bake writes to.
fn held(folder: &Path, path: &Path) -> Error {
    let mut says = String::new();
    // Some systems let nobody read a locked file; then the message does not name the holder.
    _ = File::open(path).and_then(|file| file.take(WORDS).read_to_string(&mut says));
    let by = says.lines().next().map_or(String::new(), |holder| format!(" ({holder})"));
    Error::Output {
        path: folder.into(),
        message: format!("another bake is writing to this folder{by}"),
        hint: "wait until it has ended, or choose another folder with --out".into(),
    }
}

/// True if the opened file is still the file at this path.
#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let number = |of: fs::Metadata| (of.dev(), of.ino());
    file.metadata().ok().map(number) == path.symlink_metadata().ok().map(number)
}

/// If the system lets nobody remove an open file, any file at this path is the opened one.
#[cfg(not(unix))]
fn is_at(_file: &File, path: &Path) -> bool {
    path.exists()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lock_has_one_holder_and_goes_with_it() {
        let folder = tempfile::tempdir().unwrap();
        let lock = Lock::take(folder.path()).unwrap();
        assert!(lock.is_held());
        let refused = Lock::take(folder.path()).unwrap_err().to_string();
        assert!(refused.contains(&format!("(process {})", std::process::id())), "{refused}");
        drop(lock);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
        // The file that a killed process left is not locked.
        fs::write(folder.path().join(FILE_NAME), "process 1\n").unwrap();
        drop(Lock::take(folder.path()).unwrap());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    }

    #[cfg(unix)]
    #[test]
    fn no_link_is_followed() {
        let folder = tempfile::tempdir().unwrap();
        let elsewhere = folder.path().join("elsewhere");
        std::os::unix::fs::symlink(&elsewhere, folder.path().join(FILE_NAME)).unwrap();
        assert!(Lock::take(folder.path()).is_err());
        assert!(!elsewhere.exists());
    }
}
