//! The folder of a bake.
//!
//! ```text
//!   out/alps/
//!     .terrane.lock        as long as somebody writes here
//!     .terrane-bake/       a bake under way, or one that was cut off
//!       plan.json          its manifest, as far as it is known before any file is made
//!       registry.sqlite, pieces   its journal
//!       files/             its files, under their names; its manifest comes last, and then all of them move out
//!       old.json           the manifest of the old bake, while the files move
//!     bake.json, ...       the bake that is whole
//! ```
//!
//! So a folder has the files of a whole bake, or none. An old bake stays whole until the new one is whole. Then files
//! are only renamed. If that is cut off, the next command that uses the folder completes the renames.
//!
//! ```text
//!   found.rs      checks before a bake                  lock.rs     one bake at a time
//!   run.rs        plan -> files                         merge.rs    the shards of a bake -> the bake
//!   moving.rs     moves its files to their places       clean.rs    removes a bake
//!   manifest.rs, registry_file.rs, runs.rs              the files that describe every bake
//!   look.rs, check.rs, repair.rs                        the state of a folder
//! ```

pub(crate) mod manifest;
pub(crate) mod runs;
pub(crate) mod lock;
mod found;
pub(crate) mod registry_file;
pub(crate) mod run;
pub(crate) mod merge;
mod moving;
pub(crate) mod look;
pub(crate) mod check;
pub(crate) mod repair;
mod clean;
#[cfg(test)]
mod faults;

pub use clean::{Cleaned, clean};
pub use found::Mode;

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, OnceLock};

use rayon::prelude::*;

use crate::bake::{FileRecord, Journal};
use crate::clock::Clock;
use crate::error::Error;
use crate::export::Plan;
use crate::export::folder::check::check_files;
use crate::export::folder::found::{admit, spare_room};
use crate::export::folder::lock::Lock;
use crate::export::folder::manifest::Manifest;
use crate::export::folder::moving::{Moved, end_moving, move_files};
use crate::export::folder::runs::Log;
use crate::export::formats::locked;
use crate::export::plan::cost::Cost;
use crate::file::{PartFile, copy, make_folder, remove_folder, remove_unfinished, sync_folder, write_whole};
use crate::registry::{self, Registry};
use crate::watch::Watch;

/// Work folder inside the folder of a bake, in which the next bake is made.
const WORK: &str = ".terrane-bake";

/// In the work folder: the plan of the bake, its files, and the manifest of the old bake.
const PLAN: &str = "plan.json";
const FILES: &str = "files";
const OLD: &str = "old.json";

/// A folder that a bake may write to.
#[derive(Debug)]
pub struct Output {
    path: PathBuf,
    /// Lock that is held as long as the folder is written to.
    lock: Lock,
    mode: Mode,
    /// Manifest of the whole bake that is there.
    old: Option<Box<Manifest>>,
    /// Free bytes of the disk that the bake does not need for its files. The journal, from which a bake resumes, may
    /// take half.
    spare: u64,
    moved: Mutex<Moved>,
    /// Changed files of the bake that is there, once they have been checked.
    changed: OnceLock<BTreeSet<String>>,
}

impl Output {
    /// Checks that a bake may go to `path` and has room there, without changing anything.
    ///
    /// # Errors
    /// When a bake is writing to it, when it is a file, when what is in it is not what the mode asks for, or when there
    /// is too little room.
    pub fn check(path: &Path, mode: Mode, plan: &Plan<'_>, cost: &Cost) -> Result<(), Error> {
        Lock::check(path)?;
        let old = admit(path, mode, plan)?;
        spare_room(path, mode, plan, cost, old.as_deref()).map(drop)
    }

    /// Makes the folder ready: it exists, can be written to, and has a place in which the bake is made.
    ///
    /// # Errors
    /// As [`check`](Output::check), and when the folder cannot be made or written to.
    pub fn prepare(path: &Path, mode: Mode, plan: &Plan<'_>, cost: &Cost) -> Result<Output, Error> {
        Output::check(path, mode, plan, cost)?;
        let unwritable = |error: Error| match error {
            Error::Io { source, .. } => Error::Output {
                path: path.into(),
                message: format!("cannot be written to: {source}"),
                hint: "choose another folder with --out".into(),
            },
            other => other,
        };
        make_folder(path).map_err(unwritable)?;
        let lock = Lock::take(path).map_err(unwritable)?;
        // A run that was killed during the test for writing (below) has left an unfinished file.
        remove_unfinished(path)?;
        // A finished bake may have been cut off while its files moved.
        let kept = end_moving(path)?;
        // Another bake may have ended here between the check and the lock.
        let old = admit(path, mode, plan)?;
        let spare = spare_room(path, mode, plan, cost, old.as_deref())?;
        // A file that is begun and dropped shows that files can be written here.
        PartFile::create(path.join(manifest::PATH)).map_err(unwritable)?;
        for folder in plan.folders() {
            if path.join(folder).is_symlink() {
                return Err(Error::Output {
                    path: path.join(folder),
                    message: "is a link, and terrane follows none out of the folder of a bake".into(),
                    hint: "remove it, or choose another folder with --out".into(),
                });
            }
        }
        let work = path.join(WORK);
        // If the same bake is whole already, it is repaired and not resumed.
        let is_there = old.as_ref().is_some_and(|old| old.differences(&plan.draft(), |_| true).is_empty());
        let mode = if mode == Mode::Resume && is_there { Mode::Repair } else { mode };
        if mode == Mode::Replace || Manifest::read_file(&work.join(PLAN)).is_err() {
            remove_folder(&work)?;
        }
        let moved = Mutex::new(Moved { kept, ..Moved::default() });
        Ok(Output { path: path.to_owned(), lock, mode, old, spare, moved, changed: OnceLock::new() })
    }

    /// Makes the folders in which a bake is made, or removes unfinished files of a bake that was cut off.
    pub(super) fn begin(&self, plan: &Plan<'_>) -> Result<Journal, Error> {
        let (work, files) = (self.path.join(WORK), self.files());
        make_folder(&files)?;
        remove_unfinished(&files)?;
        for folder in plan.folders() {
            let folder = files.join(folder);
            make_folder(&folder)?;
            remove_unfinished(&folder)?;
        }
        let told = work.join(PLAN);
        if !told.exists() {
            write_whole(told, plan.draft().to_json().as_bytes())?;
        }
        // The tiles of a walk must be kept, and the check for room counts them.
        let room = if plan.walk().is_some() { u64::MAX } else { self.spare / 2 };
        Journal::open(&work, &files, plan.world().stride().vertices(), room)
    }

    /// Returns the folder in which the files of the bake are made.
    pub(super) fn files(&self) -> PathBuf {
        self.path.join(WORK).join(FILES)
    }

    /// Returns a warning to show before the bake, if the file system has no locks.
    pub fn lock_warning(&self) -> Vec<String> {
        let unlocked = "has no locks: let no other bake in it until this one has ended";
        (!self.lock.is_held())
            .then(|| format!("the file system of {} {unlocked}", self.path.display()))
            .into_iter()
            .collect()
    }

    /// Returns warnings to show after the bake, about files that stood in the way and were renamed.
    pub fn kept_warnings(&self) -> Vec<String> {
        kept_warnings(&locked(&self.moved).kept)
    }

    /// Checks the files of the bake to which something is added, and returns those that have changed since they were
    /// written.
    ///
    /// # Errors
    /// When a changed file is needed: a file that stays as it is, or the registry.
    pub(super) fn changed(&self, watch: &Watch) -> Result<&BTreeSet<String>, Error> {
        let Some(old) = self.added_to() else { return Ok(self.changed.get_or_init(BTreeSet::new)) };
        if let Some(known) = self.changed.get() {
            return Ok(known);
        }
        let faults = check_files(&self.path, &old.all_files(&self.path), watch)?;
        let is_needed = |path: &str| self.mode == Mode::Add || path == registry::FILE_NAME;
        if let Some(fault) = faults.iter().find(|fault| is_needed(&fault.path)) {
            return Err(self.faulty(&fault.path, fault.message.clone()));
        }
        Ok(self.changed.get_or_init(|| faults.into_iter().map(|fault| fault.path).collect()))
    }

    /// Returns warnings to show before the bake, about changed files of the bake to which something is added: the bake
    /// will rename them. Checks the files for that.
    ///
    /// # Errors
    /// When a changed file is needed.
    pub fn changed_warnings(&self, watch: &Watch) -> Result<Vec<String>, Error> {
        let will = "is not as terrane has written it, and gets another name when the bake is whole";
        let is_there = |path: &&String| self.path.join(path).symlink_metadata().is_ok();
        let changed = self.changed(watch)?.iter().filter(is_there);
        Ok(changed.map(|path| format!("{} {will}", self.path.join(path).display())).collect())
    }

    /// Returns the bake to which something is added.
    pub(super) fn added_to(&self) -> Option<&Manifest> {
        self.old().filter(|_| [Mode::Add, Mode::Extend].contains(&self.mode))
    }

    /// Makes the error about a file of the bake to which something is added, or about the whole bake.
    pub(super) fn faulty(&self, path: &str, message: String) -> Error {
        Error::Faulty {
            path: self.path.join(path),
            message,
            hint: format!("terrane repair {} first: it sets aside what was changed", self.path.display()),
        }
    }

    /// Returns the new paths of files that stood where the bake writes and that terrane had not written like that.
    pub(super) fn kept(&self) -> Vec<PathBuf> {
        locked(&self.moved).kept.clone()
    }

    /// Returns the manifest of the bake that was there.
    pub(super) fn old(&self) -> Option<&Manifest> {
        self.old.as_deref()
    }

    /// Returns the treatment of the bake that was there.
    pub(super) fn mode(&self) -> Mode {
        self.mode
    }

    /// Tells whether there is a whole bake, and none was begun beside it.
    pub(super) fn has_old_alone(&self) -> bool {
        self.old.is_some() && !self.path.join(WORK).exists()
    }

    /// True if all files that were asked for were there already.
    pub fn was_whole(&self) -> bool {
        self.mode == Mode::Repair && locked(&self.moved).new.is_empty()
    }

    /// Returns the files that the bake has written anew, as paths in the folder.
    pub fn renewed(&self) -> Vec<String> {
        locked(&self.moved).new.clone()
    }

    /// Number of files that were there already with the same bytes, and were not touched.
    pub fn untouched(&self) -> u64 {
        locked(&self.moved).same
    }

    /// Moves the files of the finished bake to their places, and removes the rest of the old bake.
    pub(super) fn commit(&self, new: &Manifest, clock: &Clock) -> Result<(), Error> {
        self.check_borne_out(new, clock)?;
        write_whole(self.files().join(manifest::PATH), new.to_json().as_bytes())?;
        sync_folder(&self.files())?;
        let now = move_files(&self.path, clock)?;
        let mut moved = locked(&self.moved);
        let kept = [std::mem::take(&mut moved.kept), now.kept].concat();
        *moved = Moved { kept, ..now };
        Ok(())
    }

    /// Checks that a repair has made the bake that was there. A changed manifest may name another world, so it is
    /// trusted only if the files in the folder agree with it.
    fn check_borne_out(&self, new: &Manifest, clock: &Clock) -> Result<(), Error> {
        let Some(old) = self.old().filter(|old| self.mode == Mode::Repair && !old.is_sealed()) else { return Ok(()) };
        let is_known = |record: &FileRecord| old.files.iter().any(|known| known.is_same_file(record));
        // If the manifest is damaged, the list comes from the registry, which has no row for its own file.
        let is_borne_out = |record| is_known(record) || record.fault(&self.path, clock) == Ok(None);
        if new.files.par_iter().all(is_borne_out) {
            return Ok(());
        }
        clock.check()?;
        remove_folder(&self.path.join(WORK))?;
        Err(Error::Faulty {
            path: self.path.join(manifest::PATH),
            message: "is damaged where it says what was baked, and nothing else tells that".into(),
            hint: "bake again with the preset and the seed of this bake, and --overwrite".into(),
        })
    }

    /// Removes the work folder of a bake whose journal has nothing to resume from.
    pub(super) fn abandon(&self, journal: Option<&Journal>) {
        let work = self.path.join(WORK);
        // A journal that could not be opened may still hold tiles.
        let knows = journal.map_or_else(|| work.join(registry::FILE_NAME).exists(), |journal| !journal.is_empty());
        if !knows {
            // If the folder cannot be removed, the next bake resumes from it.
            _ = remove_folder(&work);
        }
    }

    /// Removes the work folder of a bake that can never be finished.
    pub(super) fn discard(&self) {
        // If the folder cannot be removed, the next bake finds it and reports it.
        _ = remove_folder(&self.path.join(WORK));
    }

    /// Begins the log of a run. The log continues the log of the bake that the run changes.
    pub(super) fn begin_log(&self, threads: usize, device: String) -> Result<Log, Error> {
        let work = self.path.join(WORK);
        make_folder(&work)?;
        let log = self.path.join(runs::PATH);
        if self.mode != Mode::Replace && log.is_file() && !work.join(runs::PATH).exists() {
            copy(&log, &work.join(runs::PATH))?;
        }
        Log::begin(&work, self.mode.name(), threads, device)
    }

    /// Tells whether there is a bake to resume.
    pub fn can_resume(&self) -> bool {
        self.path.join(WORK).exists()
    }

    /// The folder.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

/// Returns warnings about files that stood where a bake writes and that terrane had not written like that.
pub fn kept_warnings(kept: &[PathBuf]) -> Vec<String> {
    let about = "is what terrane had not written, and stood where the bake writes";
    kept.iter().map(|path| format!("{} {about}", path.display())).collect()
}

/// Completes a move of a finished bake's files that was cut off. Returns the new paths of files that stood in the way.
pub(super) fn settle(path: &Path) -> Result<Vec<PathBuf>, Error> {
    if !path.join(WORK).exists() {
        return Ok(Vec::new());
    }
    let _lock = Lock::take(path)?;
    end_moving(path)
}

/// Returns the bytes of all files below a folder.
fn size(folder: &Path) -> u64 {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let size = |entry: fs::DirEntry| match entry.metadata() {
        Ok(there) if there.is_dir() => size(&entry.path()),
        Ok(there) => there.len(),
        Err(_) => 0,
    };
    entries.map(size).sum()
}

/// Returns the work folder and the plan of a bake that is under way or was cut off.
pub(super) fn begun(path: &Path) -> Option<(PathBuf, Manifest)> {
    let work = path.join(WORK);
    let plan = Manifest::read_file(&work.join(PLAN)).ok()?;
    Some((work, plan))
}

/// Reads the registry of the bake in a folder: of the whole bake, or else of one that is under way or was cut off.
///
/// # Errors
/// When there is none, or it cannot be read.
pub fn registry(path: &Path) -> Result<Registry, Error> {
    let whole = path.join(registry::FILE_NAME);
    let begun = path.join(WORK).join(registry::FILE_NAME);
    Registry::read(if !whole.exists() && begun.exists() { &begun } else { &whole })
}
