//! The registry that a bake leaves: the journal's rows of tiles, in the tiles' order, and all files of the bake.

use std::path::Path;

use crate::area::Place;
use crate::bake::{FileRecord, Journal};
use crate::error::Error;
use crate::export::{Export, Plan};
use crate::file::PartFile;
use crate::registry::{EXPORT, FILE_NAME, Registry, TileRow, TileState};
use crate::tile::TilePart;

/// Rows that are written at once.
const ROWS: usize = 1 << 10;

/// Writes `registry.sqlite` into a folder: the same bytes however often the bake was cut off.
pub(crate) fn write(plan: &Plan, journal: &Journal, files: &[FileRecord], folder: &Path) -> Result<FileRecord, Error> {
    let mut file = PartFile::create(folder.join(FILE_NAME))?;
    let mut registry = Registry::aside(file.lend())?;
    let region = plan.region();
    let mut rows = Vec::with_capacity(ROWS);
    let state = if plan.walk().is_some() { TileState::Walked } else { TileState::Baked };
    journal.for_each(|row| {
        // A row with a tile outside the region is damaged; its tile is made again.
        let Some(place) = region.place(row.tile) else { return Ok(()) };
        let files = rasters(plan, place).collect();
        rows.push(TileRow { state, files, ..row });
        if rows.len() < ROWS { Ok(()) } else { registry.append(rows.drain(..)) }
    })?;
    registry.append(rows)?;
    registry.append_files(files, &plan.draft().to_json())?;
    registry.close()?;
    Ok(FileRecord::new(FILE_NAME.to_owned(), EXPORT, file.finish()?))
}

/// Estimates the bytes of the registry of a bake with so many files.
pub(crate) fn bytes(plan: &Plan, files: u64) -> u64 {
    // Bytes of the empty tables and of the plan.
    const PAGES: u64 = 8 * 4096;
    // The number of lines of a tile is known only when the tile is made: allow for ten with ids of 24 characters.
    const LINES: usize = 10 * 24;
    let names: usize = rasters(plan, Place { row: 0, col: 0 }).map(|name| name.len() + 3).sum();
    // Hashes, seven integers of at most 9 bytes, three words and the header of the row.
    let row = (34 * TilePart::ALL.len() + 7 * 9 + 3 * 6 + 32 + names + LINES) as u64;
    // A file's path, export, numbers and hash, and its path once more in an index.
    const FILE: u64 = 256;
    plan.tiles().saturating_mul(row).saturating_add(files.saturating_mul(FILE)).saturating_add(PAGES)
}

/// Returns the files of rasters that hold the vertices of the tile at a place. A shard has no rasters of the whole
/// region.
fn rasters(plan: &Plan, place: Place) -> impl Iterator<Item = String> {
    let is_there = |export: &&Export| plan.shard().is_none() || export.0.is_of_tiles_alone();
    let exports = plan.exports().iter().filter(is_there);
    exports.flat_map(move |export| export.0.rasters_of(plan.region(), place, plan.names()))
}
