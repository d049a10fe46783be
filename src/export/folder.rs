//! The folder of a bake: whether one may write to it, and what is removed from it.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use crate::bake::FileRecord;
use crate::error::Error;
use crate::export::check;
use crate::export::cost::Cost;
use crate::export::lock::{self, Lock};
use crate::export::manifest::{self, Manifest};
use crate::export::plan::{Bytes, folders};
use crate::export::{Export, profile, repair};
use crate::file::{PartFile, remove_unfinished, sync_folder};

/// A folder that a bake may write to.
#[derive(Debug)]
pub struct Output {
    path: PathBuf,
    /// Held as long as the folder is written to.
    lock: Lock,
    /// What was here, was not written by terrane as it is, and stood where the bake writes: where it is now.
    kept: Vec<PathBuf>,
}

impl Output {
    /// Whether a bake may go to `path` and whether it has room there, without changing anything.
    ///
    /// # Errors
    /// When a bake is writing to it, when it is a file, or a folder with something in it and no `overwrite`, or with something
    /// in it and no bake, or has too little room.
    pub fn check(path: &Path, overwrite: bool, cost: &Cost) -> Result<(), Error> {
        Lock::check(path)?;
        Output::look(path, overwrite, cost)
    }

    /// What [`check`](Output::check) does, whoever is writing to the folder.
    fn look(path: &Path, overwrite: bool, cost: &Cost) -> Result<(), Error> {
        let refuse = |message: String, hint: &str| Err(Error::Output { path: path.into(), message, hint: hint.into() });
        let is_filled = |entries: fs::ReadDir| entries.flatten().any(|entry| entry.file_name() != lock::FILE_NAME);
        match fs::read_dir(path).map(is_filled) {
            Ok(true) if !overwrite => {
                return refuse(
                    "the folder is not empty".into(),
                    "choose another with --out, or replace the bake in it with --overwrite",
                );
            }
            Ok(true) if !holds_bake(path) => {
                return refuse(
                    "holds files and no bake, and terrane replaces nothing but bakes".into(),
                    "choose another folder with --out",
                );
            }
            Err(error) if path.exists() || path.symlink_metadata().is_ok() => {
                return refuse(
                    if path.is_dir() { error.to_string() } else { "is a file, not a folder".into() },
                    "choose another folder with --out",
                );
            }
            _ => {}
        }
        let Some(free_bytes) = free_bytes(path) else { return Ok(()) };
        if free_bytes < cost.disk_bytes {
            return refuse(
                format!("the bake may take {}, and {} are free", Bytes(cost.disk_bytes), Bytes(free_bytes)),
                "choose another disk with --out, a smaller --size or fewer exports",
            );
        }
        Ok(())
    }

    /// Makes the folder ready: it exists, can be written to, and holds no manifest and nothing half-written.
    ///
    /// # Errors
    /// As [`check`](Output::check), and when the folder cannot be made or written to.
    pub fn prepare(path: &Path, overwrite: bool, cost: &Cost) -> Result<Output, Error> {
        Output::check(path, overwrite, cost)?;
        let unwritable = |source: std::io::Error| Error::Output {
            path: path.into(),
            message: format!("cannot be written to: {source}"),
            hint: "choose another folder with --out".into(),
        };
        fs::create_dir_all(path).map_err(unwritable)?;
        let unwritable_or = |error: Error| match error {
            Error::Io { source, .. } => unwritable(source),
            other => other,
        };
        let lock = Lock::take(path).map_err(unwritable_or)?;
        // Another bake may have ended here between the look and the lock.
        Output::look(path, overwrite, cost)?;
        // A file that is begun and dropped shows that files can be written here.
        PartFile::create(path.join(manifest::PATH)).map_err(unwritable_or)?;
        for folder in folders(Export::known()).into_iter().filter(|folder| !folder.is_empty()) {
            if path.join(folder).is_symlink() {
                return Err(Error::Output {
                    path: path.join(folder),
                    message: "is a link, and terrane follows none out of the folder of a bake".into(),
                    hint: "remove it, or choose another folder with --out".into(),
                });
            }
        }
        let kept = keep_others(path)?;
        // From here on the folder is no whole bake, and must not look like one.
        lock.mark();
        let old = path.join(manifest::PATH);
        if old.exists() {
            fs::remove_file(&old).map_err(Error::io(&old))?;
            sync_folder(path)?;
        }
        for folder in folders(Export::known()) {
            remove_unfinished(&path.join(folder))?;
        }
        Ok(Output { path: path.to_owned(), lock, kept })
    }

    /// What the one who bakes should know of the folder.
    pub fn warnings(&self) -> Vec<String> {
        let unlocked = "knows no locks: start no other bake in it until this one has ended";
        let unlocked = (!self.lock.is_held()).then(|| format!("the file system of {} {unlocked}", self.path.display()));
        let kept = self
            .kept
            .iter()
            .map(|path| format!("{} is what terrane had not written, and stood where the bake writes", path.display()));
        unlocked.into_iter().chain(kept).collect()
    }

    /// Says that the bake is whole, so that nothing is left of its lock.
    pub(super) fn finish(&self) {
        self.lock.unmark();
    }

    /// Says that the bake has not come to its end; a folder that holds nothing needs no mark of that.
    pub(super) fn abandon(&self) {
        let entries = fs::read_dir(&self.path).into_iter().flatten().flatten();
        if entries.filter(|entry| entry.file_name() != lock::FILE_NAME).count() == 0 {
            self.lock.unmark();
        }
    }

    /// The folder.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Removes what an earlier bake has left here, whole or interrupted, and the new one has not written again. What
    /// has no name that a bake gives stays.
    pub(super) fn remove_stale(&self, manifest: &Manifest) {
        let kept: BTreeSet<&str> = manifest.files.iter().map(|file| &file.path[..]).collect();
        for file in named_as_ours(&self.path).into_iter().filter(|file| !kept.contains(&file[..])) {
            _ = fs::remove_file(self.path.join(file));
        }
    }
}

/// Whether a folder holds a bake: its manifest, of whatever version and even if it is damaged, or the mark of one that did not
/// come to its end.
fn holds_bake(path: &Path) -> bool {
    let manifest = fs::read(path.join(manifest::PATH)).unwrap_or_default();
    let says = manifest::FORMAT.as_bytes();
    manifest.windows(says.len()).any(|words| words == says) || path.join(lock::FILE_NAME).is_file()
}

/// Gives other names to files where a bake may write that are not those that the bake in a folder has left there. Of one that
/// did not come to its end all are its own that have the names of a bake. Returns where they are now.
fn keep_others(path: &Path) -> Result<Vec<PathBuf>, Error> {
    let Ok(manifest) = Manifest::read(path) else { return Ok(Vec::new()) };
    let ours = |record: &FileRecord| check::file_fault(path, record).is_none().then(|| record.path.clone());
    let ours: BTreeSet<String> = manifest.files.par_iter().filter_map(ours).collect();
    let mut kept = Vec::new();
    for file in named_as_ours(path).into_iter().filter(|file| file != manifest::PATH && !ours.contains(file)) {
        let from = path.join(&file);
        let numbered = (1..).map(|number| path.join(format!("{file}.kept-{number}")));
        let to = numbered.into_iter().find(|to| to.symlink_metadata().is_err()).expect("some number is free");
        fs::rename(&from, &to).map_err(Error::io(&from))?;
        kept.push(to);
    }
    Ok(kept)
}

/// All that has the name of a file of a bake, in a folder and in those that bakes make in it, as paths in it.
fn named_as_ours(path: &Path) -> Vec<String> {
    let mut files = Vec::new();
    for folder in folders(Export::known()) {
        let Ok(entries) = fs::read_dir(path.join(folder)) else { continue };
        for name in entries.flatten().filter_map(|entry| entry.file_name().into_string().ok()) {
            let file = if folder.is_empty() { name } else { format!("{folder}/{name}") };
            if profile::names(&file) || Export::known().any(|export| export.0.owns(&file)) {
                files.push(file);
            }
        }
    }
    files
}

/// What was removed of a bake.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Cleaned {
    /// Files that were removed.
    pub files: u64,
    /// Their bytes.
    pub bytes: u64,
    /// Files that the bake has written and somebody has changed since: they are kept.
    pub kept: Vec<String>,
}

/// Removes what a bake has left in a folder, and nothing else: files that its manifest lists and that nobody has changed, the
/// manifest, what a killed bake has left half-written, and folders that hold nothing then. `dry` removes nothing.
///
/// # Errors
/// When there is no manifest, when a bake is writing to the folder, or when a file cannot be removed.
pub fn clean(path: &Path, dry: bool) -> Result<Cleaned, Error> {
    let manifest = Manifest::read(path)?;
    Lock::check(path)?;
    let lock = if dry { None } else { Some(Lock::take(path)?) };
    let mut cleaned = Cleaned::default();
    let mut remove = |file: PathBuf| {
        cleaned.files += 1;
        cleaned.bytes += file.metadata().map_or(0, |there| there.len());
        if dry { Ok(()) } else { fs::remove_file(&file).map_err(Error::io(&file)) }
    };
    let ours: Vec<Option<PathBuf>> = manifest
        .files
        .par_iter()
        .map(|record| check::path_in(path, &record.path).filter(|_| check::file_fault(path, record).is_none()))
        .collect();
    // First, so that what is left is no bake if this is cut off.
    remove(path.join(manifest::PATH))?;
    for file in ours.iter().flatten() {
        remove(file.clone())?;
    }
    for folder in folders(Export::known()).into_iter().filter(|folder| !folder.is_empty()) {
        let Some(inside) = check::path_in(path, folder).filter(|inside| inside.is_dir()) else { continue };
        let owner = |file: &str| Export::known().any(|export| export.0.owns_unlisted(file));
        for file in files_below(&inside, folder)? {
            if owner(&file) {
                remove(path.join(file))?;
            }
        }
        if !dry {
            remove_unfinished(&inside)?;
            remove_empty(&inside);
        }
    }
    let changed = manifest.files.iter().zip(&ours).filter(|(_, ours)| ours.is_none()).map(|(record, _)| &record.path);
    cleaned.kept = changed.filter(|file| path.join(file).symlink_metadata().is_ok()).cloned().collect();
    if let Some(lock) = lock {
        remove_unfinished(path)?;
        // What a repair that was cut off has left; no link is followed.
        _ = fs::remove_dir_all(path.join(repair::AGAIN));
        lock.unmark();
        drop(lock);
        _ = fs::remove_dir(path);
    }
    Ok(cleaned)
}

/// The files below a folder, without following links, as paths in that of the bake.
fn files_below(folder: &Path, name: &str) -> Result<Vec<String>, Error> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).map_err(Error::io(folder))? {
        let entry = entry.map_err(Error::io(folder))?;
        let Ok(own) = entry.file_name().into_string() else { continue };
        let path = format!("{name}/{own}");
        match entry.file_type() {
            Ok(kind) if kind.is_dir() => files.extend(files_below(&entry.path(), &path)?),
            Ok(kind) if kind.is_file() => files.push(path),
            _ => {}
        }
    }
    Ok(files)
}

/// Removes a folder and those below it that hold nothing.
fn remove_empty(folder: &Path) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        if entry.file_type().is_ok_and(|kind| kind.is_dir()) {
            remove_empty(&entry.path());
        }
    }
    // One that holds something cannot be removed so.
    _ = fs::remove_dir(folder);
}

/// Bytes that are free where a path will be, if the file system says how much room it has: if not it may have enough, and
/// whether it takes a file shows later.
pub(super) fn free_bytes(path: &Path) -> Option<u64> {
    // The folder may not be there yet: what counts is the disk that it will be on.
    let existing = path.ancestors().find(|part| part.exists()).unwrap_or(Path::new("."));
    let existing = if existing.as_os_str().is_empty() { Path::new(".") } else { existing };
    let room = fs4::statvfs(existing).ok().filter(|room| room.total_space() > 0)?;
    Some(room.available_space())
}
