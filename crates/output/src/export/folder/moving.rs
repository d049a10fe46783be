//! The files of a finished bake, on their way to their places.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use crate::bake::FileRecord;
use crate::clock::Clock;
use crate::error::Error;
use crate::export::folder::manifest::{self, Manifest};
use crate::export::folder::runs;
use crate::export::folder::{FILES, OLD, WORK};
use crate::export::formats::web;
use crate::file::{make_folder, path_in, remove, remove_folder, rename, sync_folder, write_whole};
use crate::stop::Stopped;

/// The outcome of moving a bake's files.
#[derive(Debug, Default)]
pub(super) struct Moved {
    /// Files that have new bytes, as paths in the folder.
    pub new: Vec<String>,
    /// Number of files that were here already, with the same bytes.
    pub same: u64,
    /// Files in the bake's way that terrane had not written like that, and that were renamed: their new paths.
    pub kept: Vec<PathBuf>,
}

/// Completes a move of a finished bake's files that was cut off, in a folder that is locked. Returns the new paths of
/// files that stood in the way.
pub(super) fn end_moving(path: &Path) -> Result<Vec<PathBuf>, Error> {
    let is_whole = path.join(WORK).join(FILES).join(manifest::PATH).is_file();
    if is_whole { move_files(path, &Clock::default()).map(|moved| moved.kept) } else { Ok(Vec::new()) }
}

/// Moves the files of a finished bake to their places. A file in the way gets another name, unless it is an unchanged
/// file of the old bake or has the bytes of the new file.
pub(super) fn move_files(path: &Path, clock: &Clock) -> Result<Moved, Error> {
    let is_intact = |record: &FileRecord| record.fault(path, clock).map(|fault| fault.is_none());
    let work = path.join(WORK);
    let (files, old) = (work.join(FILES), work.join(OLD));
    let new = Manifest::read(&files)?;
    let mut moved = Moved::default();
    let before = if old.exists() { Manifest::read_file(&old).ok() } else { Manifest::read(path).ok() };
    let known = before.as_ref().map_or(Vec::new(), |before| before.all_files(path));
    let known: BTreeMap<&str, &FileRecord> = known.iter().map(|record| (&record.path[..], record)).collect();
    // The files of the new bake that were made, and their places. Lists of files come last, since the listed files are
    // found by them.
    let mut made: Vec<FileRecord> = new.all_files(&files);
    made.sort_by_key(|record| web::is_listing(&record.path));
    if !old.exists() {
        moved.kept = set_aside(path, &made, &known, clock)?;
        // During the move the folder is no whole bake. Without its manifest it does not look like one.
        match rename(&path.join(manifest::PATH), &old) {
            Err(Error::Io { source, .. }) if source.kind() == io::ErrorKind::NotFound => {
                write_whole(old, b"")?;
            }
            done => done?,
        }
        sync_folder(&work)?;
        sync_folder(path)?;
    }
    if work.join(runs::PATH).exists() {
        rename(&work.join(runs::PATH), &path.join(runs::PATH))?;
    }
    // Unchanged files of the old bake that the new one does not have are removed.
    let there = new.all_files(path);
    let new_paths: BTreeSet<&str> = made.iter().chain(&there).map(|record| &record.path[..]).collect();
    let stale = known.values().filter(|record| !new_paths.contains(&record.path[..]));
    for record in stale {
        if is_intact(record)? {
            remove(&path.join(&record.path))?;
            remove_empty_above(path, &record.path);
        }
    }
    let mut folders = vec![path.to_owned()];
    for record in &made {
        let (from, to) = (files.join(&record.path), place(path, record)?);
        // The file has moved already, or the old bake's file is kept.
        if !from.exists() {
            continue;
        }
        if let Some(known) = known.get(&record.path[..]).filter(|known| known.blake3 == record.blake3)
            && is_intact(known)?
        {
            moved.same += 1;
            continue;
        }
        let folder = to.parent().unwrap_or(path);
        if folders.last().is_none_or(|last| last != folder) {
            make_folder(folder)?;
            folders.push(folder.to_owned());
        }
        rename(&from, &to)?;
        moved.new.push(record.path.clone());
    }
    folders.sort();
    folders.dedup();
    folders.iter().try_for_each(|folder| sync_folder(folder))?;
    if before.as_ref() != Some(&new) {
        moved.new.push(manifest::PATH.to_owned());
    }
    rename(&files.join(manifest::PATH), &path.join(manifest::PATH))?;
    sync_folder(path)?;
    remove_folder(&work)?;
    Ok(moved)
}

/// Returns the path of a file in the folder of a bake; an error if the path leads over a link.
fn place(folder: &Path, record: &FileRecord) -> Result<PathBuf, Error> {
    path_in(folder, &record.path).ok_or_else(|| Error::Output {
        path: folder.join(&record.path),
        message: "would be written over a link".into(),
        hint: "remove the link, and go on with --resume".into(),
    })
}

/// Renames the files that stand in the way of those that were made, and that no bake has written as they are: they
/// belong to somebody. Returns their new paths.
fn set_aside(
    folder: &Path,
    made: &[FileRecord],
    known: &BTreeMap<&str, &FileRecord>,
    clock: &Clock,
) -> Result<Vec<PathBuf>, Error> {
    let is_stranger = |record: &FileRecord| {
        let is_intact = |record: &FileRecord| record.fault(folder, clock).map(|fault| fault.is_none());
        let is_known = || known.get(&record.path[..]).map_or(Ok(false), |known| is_intact(known));
        let is_there = folder.join(&record.path).symlink_metadata().is_ok();
        Ok(is_there && !is_known()? && !is_intact(record)?)
    };
    // All strangers are found before the first is renamed.
    let strangers = made.par_iter().map(is_stranger).collect::<Result<Vec<bool>, Stopped>>()?;
    let aside = |record: &FileRecord| {
        let numbered = (1..).map(|number| folder.join(format!("{}.kept-{number}", record.path)));
        let to = numbered.into_iter().find(|to| to.symlink_metadata().is_err()).expect("some number is free");
        rename(&place(folder, record)?, &to)?;
        Ok(to)
    };
    made.iter().zip(strangers).filter(|(_, is_stranger)| *is_stranger).map(|(record, _)| aside(record)).collect()
}

/// Removes the folders of a path that are empty.
pub(super) fn remove_empty_above(folder: &Path, path: &str) {
    let above = Path::new(path).ancestors().skip(1).filter(|above| !above.as_os_str().is_empty());
    // `remove_dir` fails for folders that are not empty.
    above.take_while(|above| fs::remove_dir(folder.join(above)).is_ok()).for_each(drop);
}
