//! `terrane verify`, `terrane repair` and `terrane clean`.

use std::fmt::{Arguments, Write};
use std::path::Path;
use std::time::Instant;

use serde_json::json;

use crate::cli::args::{ThreadOptions, VerifyArguments};
use crate::cli::console::Console;
use crate::cli::progress::watched;
use crate::error::Error;
use crate::export::{self, Bytes, Cleaned, Rebake, Repaired};

/// Checks a bake, and prints its faults.
pub(super) fn run(arguments: &VerifyArguments, console: &Console) -> Result<(), Error> {
    let folder = &arguments.folder;
    let rebake = match arguments {
        VerifyArguments { files_only: true, .. } => Rebake::None,
        VerifyArguments { all: true, .. } => Rebake::Share(1.0),
        VerifyArguments { sample, .. } => Rebake::Share(*sample),
    };
    let start = Instant::now();
    let checked = watched(console, arguments.threads, |watch| export::check(folder, rebake, watch))?;
    let mut text = String::new();
    for fault in &checked.faults {
        if console.is_json() {
            console.message(json!({ "type": "fault", "path": fault.path, "message": fault.message }), "")?;
        } else {
            line(&mut text, format_args!("{}: {}", fault.path, fault.message));
        }
    }
    let (faults, seconds) = (checked.faults.len(), start.elapsed().as_secs_f64());
    let object = json!({
        "type": "verified", "folder": folder.to_string_lossy(), "files": checked.files, "bytes": checked.bytes,
        "seams": checked.seams, "tiles": checked.tiles, "faults": faults, "seconds": seconds,
    });
    let (files, seams, tiles) = (checked.files, checked.seams, checked.tiles);
    let (folder_name, bytes) = (folder.display(), Bytes(checked.bytes));
    line(
        &mut text,
        format_args!(
            "{folder_name}: {files} files, {bytes}, {seams} seams and {tiles} tiles baked again: {faults} faults, {seconds:.2} s"
        ),
    );
    console.message(object, &text)?;
    if faults == 0 {
        return Ok(());
    }
    Err(Error::Faulty {
        path: folder.clone(),
        message: format!("{faults} {} with this bake", if faults == 1 { "thing is wrong" } else { "things are wrong" }),
        hint: format!(
            "terrane repair {} bakes again what is wrong, and sets aside what is there instead",
            folder.display()
        ),
    })
}

/// Repairs a bake: bakes its faulty files again.
pub(super) fn repair(folder: &Path, threads: ThreadOptions, console: &Console) -> Result<(), Error> {
    let start = Instant::now();
    let Repaired { files, kept } = watched(console, threads, |watch| export::repair(folder, watch))?;
    let seconds = start.elapsed().as_secs_f64();
    console.warnings(&export::kept_warnings(&kept));
    let object = json!({
        "type": "repaired", "folder": folder.to_string_lossy(), "files": files, "kept": kept, "seconds": seconds,
    });
    let mut text = String::new();
    for path in &files {
        line(&mut text, format_args!("{path}: has its bytes again"));
    }
    line(&mut text, format_args!("{}: {} files repaired, {seconds:.2} s", folder.display(), files.len()));
    console.message(object, &text)
}

/// Removes the files of a bake from a folder.
pub(super) fn clean(folder: &Path, dry: bool, console: &Console) -> Result<(), Error> {
    let Cleaned { files, bytes, kept } = export::clean(folder, dry, &console.watch().clock)?;
    let object = json!({
        "type": if dry { "plan" } else { "cleaned" }, "folder": folder.to_string_lossy(), "files": files, "bytes": bytes,
        "kept": kept,
    });
    let mut text = String::new();
    for path in &kept {
        line(&mut text, format_args!("{path}: has been changed since it was baked, and is kept"));
    }
    let done = if dry { "would be removed" } else { "removed" };
    line(&mut text, format_args!("{}: {files} files {done}, {}", folder.display(), Bytes(bytes)));
    console.message(object, &text)
}

fn line(text: &mut String, line: Arguments<'_>) {
    writeln!(text, "{line}").expect("a String takes everything");
}
