//! A folder of tiles: a file each, `{layer}/{zoom}/{x}/{y}`.

use std::fs;
use std::path::Path;

use crate::error::Error;
use crate::file::{remove_unfinished, write_whole};
use crate::web::pyramid::TilePlace;

/// Writes a tile's file; `ending` is what follows its row.
pub(super) fn write_tile(
    folder: &Path,
    layer: &str,
    place: TilePlace,
    ending: &str,
    bytes: &[u8],
) -> Result<(), Error> {
    let column = folder.join(layer).join(place.zoom.to_string()).join(place.x.to_string());
    fs::create_dir_all(&column).map_err(Error::io(&column))?;
    write_whole(column.join(format!("{}{ending}", place.y)), bytes).map(|_| ())
}

/// Removes what a killed run has left of a layer's files; there may be none.
pub(super) fn clean(folder: &Path) -> Result<(), Error> {
    remove_unfinished(folder)?;
    let Ok(entries) = fs::read_dir(folder) else { return Ok(()) };
    for entry in entries.flatten() {
        if entry.file_type().is_ok_and(|kind| kind.is_dir()) {
            clean(&entry.path())?;
        }
    }
    Ok(())
}
