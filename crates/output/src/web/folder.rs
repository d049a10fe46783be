//! A folder of tiles: a file per tile, `{layer}/{zoom}/{x}/{y}`, and a list of all with their hashes, as `b3sum` reads
//! it.

use std::fs;
use std::path::Path;

use crate::error::Error;
use crate::file::{make_folder, remove_unfinished, write_whole};
use crate::web::pyramid::TilePlace;

/// The list of the files of tiles.
pub(crate) const LISTING: &str = "tiles.b3";

/// Writes a tile's file and returns its line of the list. `ending` follows the tile's row in the name of the file.
pub(super) fn write_tile(
    folder: &Path,
    layer: &str,
    place: TilePlace,
    ending: &str,
    bytes: &[u8],
) -> Result<String, Error> {
    let column = format!("{layer}/{}/{}", place.zoom, place.x);
    let name = format!("{}{ending}", place.y);
    make_folder(&folder.join(&column))?;
    let finished = write_whole(folder.join(&column).join(&name), bytes)?;
    Ok(format!("{}  {column}/{name}\n", finished.blake3))
}

/// Removes unfinished files of a killed run from a layer's folder, if it exists.
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
