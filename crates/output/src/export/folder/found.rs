//! Checks before a bake: looks at the contents of its folder, and decides whether the bake may go there.

use std::fs;
use std::path::Path;

use crate::area::Place;
use crate::error::Error;
use crate::export::Plan;
use crate::export::folder::check::told;
use crate::export::folder::lock;
use crate::export::folder::manifest::{self, Manifest};
use crate::export::folder::{PLAN, WORK, size};
use crate::export::plan::Bytes;
use crate::export::plan::cost::Cost;
use crate::file::free_bytes;

/// The treatment of what is already in the folder of a bake.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// The folder must be empty.
    New,
    /// A bake that is there is replaced.
    Replace,
    /// The same bake that was cut off goes on. If it is whole, its damaged files are baked again.
    Resume,
    /// A bake of the same world and region gets more exports.
    Add,
    /// A bake of the same world and exports gets a larger region.
    Extend,
    /// The same bake is made again, and damaged files are replaced.
    Repair,
}

impl Mode {
    /// The name in the log of runs.
    pub(super) fn name(self) -> &'static str {
        match self {
            Mode::New => "new",
            Mode::Replace => "replace",
            Mode::Resume => "resume",
            Mode::Add => "add",
            Mode::Extend => "extend",
            Mode::Repair => "repair",
        }
    }
}

/// The contents of a folder.
enum FolderContent {
    Nothing,
    /// Other files, but no bake.
    Others,
    /// A whole bake; without its manifest if the manifest cannot be read.
    Bake(Option<Box<Manifest>>),
    /// A bake that was cut off, with the manifest of its plan.
    CutOff(Box<Manifest>),
}

impl FolderContent {
    /// Returns the manifest of the bake, or of the plan of one that was cut off.
    fn manifest(&self) -> Option<&Manifest> {
        match self {
            FolderContent::Nothing | FolderContent::Others => None,
            FolderContent::Bake(there) => there.as_deref(),
            FolderContent::CutOff(there) => Some(there),
        }
    }
}

/// Largest number of differences between two bakes that a message names.
const SAID: usize = 5;

/// Checks that a bake may go to a folder with the contents that the folder has. Returns the whole bake that is there,
/// if any.
pub(super) fn admit(path: &Path, mode: Mode, plan: &Plan<'_>) -> Result<Option<Box<Manifest>>, Error> {
    let refuse = |message: String, hint: &str| Error::Output { path: path.into(), message, hint: hint.into() };
    let found = found(path)?;
    let draft = plan.draft();
    let same = |there: Option<&Manifest>, counts: &dyn Fn(&str) -> bool, hint: &str| match other(there, &draft, counts)
    {
        None => Ok(()),
        Some(message) => Err(refuse(message, hint)),
    };
    let all = |_: &str| true;
    match (mode, &found) {
        (_, FolderContent::Others) => {
            return Err(refuse(
                match mode {
                    Mode::New => "the folder is not empty".into(),
                    _ => "holds files and no bake, and terrane replaces nothing but bakes".into(),
                },
                "choose another folder with --out",
            ));
        }
        // A repair compares the bakes only when the new one is made.
        (Mode::New | Mode::Replace | Mode::Resume, FolderContent::Nothing)
        | (Mode::Replace, _)
        | (Mode::Repair, FolderContent::Bake(_)) => {}
        (Mode::New, FolderContent::CutOff(there)) => {
            let hint = match same(Some(there), &all, "") {
                Ok(()) => "go on with it with --resume, or begin again with --overwrite",
                Err(_) => "choose another folder with --out, or replace what is there with --overwrite",
            };
            return Err(refuse("holds a bake that was cut off".into(), hint));
        }
        (Mode::New, FolderContent::Bake(there)) => {
            let is_same = same(there.as_deref(), &all, "").is_ok();
            return Err(refuse(
                if is_same { "the folder is not empty: it holds this very bake" } else { "the folder is not empty" }
                    .into(),
                "choose another with --out, replace the bake in it with --overwrite, add exports to it with --add, or look \
                 whether it is whole with terrane verify",
            ));
        }
        (Mode::Resume | Mode::Repair, FolderContent::Bake(_) | FolderContent::CutOff(_)) => {
            let hint = "give what that was baked with, choose another folder with --out, or --overwrite it";
            same(found.manifest(), &all, hint)?;
        }
        (Mode::Add | Mode::Extend, FolderContent::CutOff(there)) => {
            // The hint does not name `terrane clean`, which would also remove the whole bake beside the one that was
            // cut off.
            let hint = "another bake was cut off here: go on with that first, or remove the folder .terrane-bake";
            same(Some(there), &all, hint)?;
        }
        (Mode::Add, FolderContent::Bake(there)) => {
            let counts = |key: &str| there.as_ref().is_some_and(|there| stays(there, key));
            same(there.as_deref(), &counts, "give what that was baked with, but for --export, or leave out --add")?;
            if there.as_ref().is_some_and(|there| plan.exports().iter().all(|export| there.has(*export))) {
                return Err(refuse("has all these exports already".into(), "look at it with terrane info"));
            }
        }
        (Mode::Extend, FolderContent::Bake(there)) if there.as_ref().is_some_and(|there| !is_within(there, plan)) => {
            return Err(refuse(
                "holds tiles that are not in that region".into(),
                "give a region that holds all of the old one, with --at and --size",
            ));
        }
        (Mode::Extend, FolderContent::Bake(there)) => {
            same(there.as_deref(), &|key| key != "region", "bake that region elsewhere")?;
        }
        (Mode::Add | Mode::Extend | Mode::Repair, FolderContent::Nothing) => {
            return Err(refuse("holds no bake".into(), "bake one there first"));
        }
    }
    Ok(match found {
        FolderContent::Bake(old) if mode != Mode::Repair => old,
        _ => told(path).ok().map(Box::new),
    })
}

/// Returns a message if the bake that is there is another one than that of a draft, in the keys that count.
fn other(there: Option<&Manifest>, draft: &Manifest, counts: &dyn Fn(&str) -> bool) -> Option<String> {
    let Some(there) = there else { return Some("holds a bake whose manifest cannot be read".into()) };
    let others = there.differences(draft, counts);
    let more = others.len().saturating_sub(SAID);
    let more = if more > 0 { format!(", and {more} more") } else { String::new() };
    let listed = others.iter().take(SAID).cloned().collect::<Vec<_>>().join("; ");
    (!others.is_empty()).then(|| format!("holds another bake: {listed}{more}"))
}

/// True if a key of a bake's manifest stays the same when exports are added. Options that no file of the old bake
/// depends on may change.
fn stays(there: &Manifest, key: &str) -> bool {
    match key {
        "exports" | "profile" => false,
        "meshes" => there.reads("--lod"),
        "vectors" => there.reads("--clip"),
        "height_range" => there.reads("--height-range"),
        _ => true,
    }
}

/// Checks that there is room for a bake beside the one that is there. Returns the free bytes that the bake does not
/// need.
pub(super) fn spare_room(
    path: &Path,
    mode: Mode,
    plan: &Plan<'_>,
    cost: &Cost,
    old: Option<&Manifest>,
) -> Result<u64, Error> {
    let refuse = |message: String, hint: &str| Err(Error::Output { path: path.into(), message, hint: hint.into() });
    let elsewhere = "choose another disk with --out, a smaller --size or fewer exports";
    let Some(free) = free_bytes(path) else { return Ok(u64::MAX) };
    // The files of a bake that was cut off are on the disk already, and their room is not needed again.
    let told = cost.forecast.as_ref().map_or(0, |forecast| forecast.disk_bytes);
    let needed = told.saturating_sub(if mode == Mode::Replace { 0 } else { size(&path.join(WORK)) });
    if free < needed {
        let there: u64 = old.iter().flat_map(|old| &old.files).map(|file| file.bytes).sum();
        let frees =
            format!("remove the bake that is there with terrane clean, which frees {}, or {elsewhere}", Bytes(there));
        return refuse(
            format!("the bake may take {}, and {} are free", Bytes(needed), Bytes(free)),
            if there > 0 { &frees } else { elsewhere },
        );
    }
    // If a folder inside is on a disk of its own, its files are copied there at the end, so that disk needs room too.
    for folder in plan.folders() {
        let inside = path.join(folder);
        let needed = cost.forecast.as_ref().map_or(0, |forecast| forecast.folder_bytes(folder));
        let free = if is_elsewhere(&inside, path) { free_bytes(&inside) } else { None };
        if let Some(free) = free.filter(|free| *free < needed) {
            let message = format!(
                "{folder} is on another disk, where it may take {}, and {} are free",
                Bytes(needed),
                Bytes(free)
            );
            return refuse(message, elsewhere);
        }
    }
    Ok(free - needed)
}

/// Tells whether a plan's region holds all tiles of a bake.
fn is_within(there: &Manifest, plan: &Plan<'_>) -> bool {
    let Ok(region) = there.region.region() else { return false };
    let last = region.tile(Place { row: region.rows() - 1, col: region.cols() - 1 });
    [region.at(), last].into_iter().all(|tile| plan.region().place(tile).is_some())
}

/// Looks at the contents of a folder.
fn found(path: &Path) -> Result<FolderContent, Error> {
    let refuse =
        |message: String| Error::Output { path: path.into(), message, hint: "choose another folder with --out".into() };
    let entries = match fs::read_dir(path) {
        Ok(entries) => entries,
        Err(_) if path.symlink_metadata().is_err() => return Ok(FolderContent::Nothing),
        Err(error) => {
            return Err(refuse(if path.is_dir() { error.to_string() } else { "is a file, not a folder".into() }));
        }
    };
    let work = path.join(WORK);
    if work.symlink_metadata().is_ok_and(|there| !there.is_dir()) {
        return Err(refuse(format!("has a {WORK} that is no folder")));
    }
    // A work folder without a plan holds nothing that a bake could resume.
    if let Ok(plan) = Manifest::read_file(&work.join(PLAN)) {
        return Ok(FolderContent::CutOff(Box::new(plan)));
    }
    let manifest = fs::read(path.join(manifest::PATH)).unwrap_or_default();
    let says = manifest::FORMAT.as_bytes();
    // A bake of any version counts, even a damaged one, as long as the manifest or the registry shows that it is a
    // bake.
    if manifest.windows(says.len()).any(|words| words == says) || told(path).is_ok() {
        return Ok(FolderContent::Bake(Manifest::read(path).ok().map(Box::new)));
    }
    let is_filled = entries.flatten().any(|entry| entry.file_name() != lock::FILE_NAME && entry.file_name() != WORK);
    Ok(if is_filled { FolderContent::Others } else { FolderContent::Nothing })
}

/// Tells whether a folder is on another file system than the folder around it.
fn is_elsewhere(inside: &Path, folder: &Path) -> bool {
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        let device = |path: &Path| path.metadata().map(|there| there.dev()).ok();
        device(inside).is_some() && device(inside) != device(folder)
    }
    #[cfg(not(unix))]
    {
        // Here another file system shows only when a rename fails.
        _ = (inside, folder);
        false
    }
}
