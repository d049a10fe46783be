//! The lock of a folder: one bake writes to it at a time.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::thread;
use std::time::Duration;

use crate::error::Error;
use crate::file::{Operation, gate};

/// The file that is locked. It is there as long as somebody writes to the folder, or where one who did was killed, which says
/// nothing.
pub(super) const FILE_NAME: &str = ".terrane.lock";

/// How often a lock is tried, and how long one waits before the next time.
const TRIES: u32 = 20;
const PAUSE: Duration = Duration::from_millis(10);

/// Bytes of what the holder says of itself at most.
const WORDS: u64 = 200;

/// Held by the one that writes to a folder. The system lets go of it when the process ends, however it ends.
#[derive(Debug)]
pub(super) struct Lock {
    path: PathBuf,
    /// None where the file system knows no locks.
    file: Option<File>,
}

impl Lock {
    /// Takes the lock of a folder, which must be there.
    ///
    /// # Errors
    /// When another process holds it, or when there can be no file.
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
                // Removed by the one who held it, after it was opened here; or held by one who only looks.
                Ok(()) | Err(TryLockError::WouldBlock) => thread::sleep(PAUSE),
                Err(TryLockError::Error(_)) => return Ok(Lock { path, file: None }),
            }
        }
        Err(held(folder, &path))
    }

    /// Whether somebody is writing to a folder, which may not be there.
    ///
    /// # Errors
    /// When somebody is.
    pub fn check(folder: &Path) -> Result<(), Error> {
        let path = folder.join(FILE_NAME);
        let Ok(file) = File::open(&path) else { return Ok(()) };
        match file.try_lock_shared() {
            Err(TryLockError::WouldBlock) => Err(held(folder, &path)),
            _ => Ok(()),
        }
    }

    /// Whether nobody else can have it.
    pub fn is_held(&self) -> bool {
        self.file.is_some()
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        // While it is held, so that the name is never that of somebody else's.
        _ = fs::remove_file(&self.path);
    }
}

/// What is said when somebody else writes to a folder.
fn held(folder: &Path, path: &Path) -> Error {
    let mut says = String::new();
    // Some systems let nobody read what is locked.
    _ = File::open(path).and_then(|file| file.take(WORDS).read_to_string(&mut says));
    let by = says.lines().next().map_or(String::new(), |holder| format!(" ({holder})"));
    Error::Output {
        path: folder.into(),
        message: format!("another bake is writing to this folder{by}"),
        hint: "wait until it has ended, or choose another folder with --out".into(),
    }
}

/// Whether a file that was opened is still the one of that name.
#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let number = |of: fs::Metadata| (of.dev(), of.ino());
    file.metadata().ok().map(number) == path.symlink_metadata().ok().map(number)
}

/// Where files cannot be removed while they are open there is nothing to ask.
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
        // What a killed one has left is no lock.
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
