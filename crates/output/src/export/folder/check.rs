//! Checks of a whole bake: every file against its hash, the registry and the manifest against each other, the edges of
//! neighbouring tiles against each other, and tiles against the same tiles baked again.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File};
use std::io::BufReader;
use std::path::Path;

use rayon::prelude::*;

use crate::area::TileId;
use crate::clock::Clock;
use crate::error::Error;
use crate::export::folder::begun;
use crate::export::folder::manifest::{self, Manifest};
use crate::file::{FileRecord, path_in};
use crate::registry::{self, FileRow, Registry, TileRow};
use crate::stop::Stopped;
use crate::tile::{Tile, TilePart};
use crate::walker::Walked;
use crate::watch::Watch;

/// Number of tiles of a bake that are baked again for the check.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Rebake {
    /// No tile.
    None,
    /// A share of the tiles, 0 to 1, spread evenly over the region; at least one tile.
    Share(f64),
}

/// A fault of a bake.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct BakeFault {
    /// The file, as a path in the folder of the bake.
    pub path: String,
    /// Description of the fault.
    pub message: String,
}

/// Results of a check.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Checked {
    /// Number of files of the bake.
    pub files: u64,
    /// Bytes of these files.
    pub bytes: u64,
    /// Number of pairs of files of neighbouring tiles whose edges were compared.
    pub seams: u64,
    /// Number of tiles that were baked again.
    pub tiles: u64,
    /// The faults, sorted by path.
    pub faults: Vec<BakeFault>,
}

impl Checked {
    fn add(&mut self, path: &str, message: impl Into<String>) {
        self.faults.push(BakeFault { path: path.to_owned(), message: message.into() });
    }
}

/// Checks the bake in a folder, on the threads of the current rayon pool.
///
/// # Errors
/// When neither the manifest nor the registry says what was baked, or when tiles are to be baked again and cannot be.
pub fn check(folder: &Path, rebake: Rebake, watch: &Watch) -> Result<Checked, Error> {
    if !folder.join(manifest::PATH).exists() && begun(folder).is_some() {
        return Err(Error::Faulty {
            path: folder.into(),
            message: "holds a bake that is under way or was cut off".into(),
            hint: "the command that began it goes on with it with --resume".into(),
        });
    }
    let read = Manifest::read(folder);
    let mut checked = Checked::default();
    let manifest = match &read {
        Ok(manifest) => manifest.clone(),
        Err(_) => told(folder)?,
    };
    if let Err(error) = &read {
        checked.add(manifest::PATH, error.to_string());
    } else {
        let path = folder.join(manifest::PATH);
        let text = fs::read_to_string(&path).map_err(Error::io(&path))?;
        // A manifest has exactly one text form, and contains its own hash.
        if !manifest.is_sealed() || text != manifest.to_json() {
            checked.add(manifest::PATH, "is not as it was written");
        }
    }
    let files = manifest.all_files(folder);
    checked.files = files.len() as u64;
    checked.bytes = files.iter().map(|record| record.bytes).sum();
    checked.faults.extend(check_files(folder, &files, watch)?);
    let is_sound = |path: &str, checked: &Checked| checked.faults.iter().all(|fault| fault.path != path);
    check_seams(folder, &manifest, &mut checked, &watch.clock)?;
    if is_sound(registry::FILE_NAME, &checked) {
        check_registry(folder, &manifest, rebake, watch, &mut checked)?;
    }
    checked.faults.sort();
    Ok(checked)
}

/// Returns the faults of the files of a bake.
///
/// # Errors
/// When the work is stopped.
pub(crate) fn check_files(folder: &Path, files: &[FileRecord], watch: &Watch) -> Result<Vec<BakeFault>, Stopped> {
    watch.begin("reading files", Some((files.len() as u64, "files")));
    let fault = |record: &FileRecord| {
        let message = record.fault(folder, &watch.clock)?;
        watch.add(1);
        Ok(message.map(|message| BakeFault { path: record.path.clone(), message }))
    };
    files.par_iter().filter_map(|record| fault(record).transpose()).collect()
}

/// Returns the manifest of the bake in a folder. If the file's hash is wrong, the manifest is put together from the
/// registry, and if the registry cannot be read either, the file is taken as it is.
///
/// # Errors
/// When neither can be read, or the manifest is missing.
pub(crate) fn told(folder: &Path) -> Result<Manifest, Error> {
    let read = Manifest::read(folder);
    if read.as_ref().is_ok_and(Manifest::is_sealed) {
        return read;
    }
    let by_registry = || {
        let registry = Registry::read(&folder.join(registry::FILE_NAME)).ok()?;
        let plan = Manifest::parse(&registry.plan().ok()??).ok().filter(Manifest::is_sealed)?;
        let mut files = Vec::new();
        let list = |file: FileRow| {
            files.push(file.record());
            Ok(())
        };
        registry.for_each_file(list).ok()?;
        // Without a hash, so that callers see that this manifest was not read from its file.
        Manifest { files, blake3: String::new(), ..plan }.checked().ok()
    };
    // A missing manifest was removed, or never written: the registry does not replace it.
    if folder.join(manifest::PATH).exists() { by_registry().map_or(read, Ok) } else { read }
}

/// Compares the edges that files of neighbouring tiles share. Reads PNG, and bare 16-bit heights.
fn check_seams(folder: &Path, manifest: &Manifest, checked: &mut Checked, clock: &Clock) -> Result<(), Stopped> {
    let faulty: BTreeSet<&str> = checked.faults.iter().map(|fault| &fault.path[..]).collect();
    // Neighbours share an edge only if their rasters hold all vertices of a tile, those on its edges included.
    let side = manifest.region.tile_cells as usize + 1;
    let edges = |record: &FileRecord| {
        let tile = record.tile.filter(|_| record.width == Some(side as u64) && record.height == record.width)?;
        let path = path_in(folder, &record.path).filter(|_| !faulty.contains(&record.path[..]))?;
        clock.check().ok()?;
        Some(((stem(&record.path), tile.y, tile.x), (record.path.clone(), Edges::read(&path, side)?)))
    };
    let edges: BTreeMap<(String, i64, i64), (String, Edges)> =
        manifest.files.par_iter().filter_map(edges).collect::<Vec<_>>().into_iter().collect();
    clock.check()?;
    let mut faults = Vec::new();
    for ((stem, y, x), (path, own)) in &edges {
        let neighbour = |x: i64, y: i64| edges.get(&(stem.clone(), y, x));
        for (other, is_same, way) in [
            (
                neighbour(x + 1, *y),
                (|own: &Edges, other: &Edges| own.east == other.west) as fn(&Edges, &Edges) -> bool,
                "east",
            ),
            (neighbour(*x, y + 1), |own: &Edges, other: &Edges| own.south == other.north, "south"),
        ] {
            let Some((_, other)) = other else { continue };
            checked.seams += 1;
            if !is_same(own, other) {
                faults.push(BakeFault {
                    path: path.clone(),
                    message: format!("does not meet its neighbour to the {way}"),
                });
            }
        }
    }
    checked.faults.extend(faults);
    Ok(())
}

/// Returns the path without the tile's `x0_y0`, which is the same for all tiles of an export.
fn stem(path: &str) -> String {
    // Numbers of tiles in the world may be negative.
    let number = |text: &str| {
        let digits = text.strip_prefix('-').unwrap_or(text);
        let count = digits.bytes().take_while(u8::is_ascii_digit).count();
        if count > 0 { text.len() - digits.len() + count } else { 0 }
    };
    for (at, _) in path.match_indices('x') {
        let columns = number(&path[at + 1..]);
        let after = &path[at + 1 + columns..];
        if let Some(rows) = after.strip_prefix("_y").map(number).filter(|rows| columns > 0 && *rows > 0) {
            return format!("{}{}", &path[..at], &after[2 + rows..]);
        }
    }
    path.to_owned()
}

/// Hashes of the samples along the edges of a tile's raster.
struct Edges {
    north: blake3::Hash,
    east: blake3::Hash,
    south: blake3::Hash,
    west: blake3::Hash,
}

impl Edges {
    fn read(path: &Path, side: usize) -> Option<Edges> {
        let (samples, bytes) = match path.extension()?.to_str()? {
            "png" => {
                let mut reader = png::Decoder::new(BufReader::new(File::open(path).ok()?)).read_info().ok()?;
                let mut samples = vec![0; reader.output_buffer_size()?];
                let info = reader.next_frame(&mut samples).ok()?;
                (samples, info.line_size / side)
            }
            "r16" => (fs::read(path).ok()?, 2),
            _ => return None,
        };
        let line = side * bytes;
        if samples.len() != line * side || side == 0 {
            return None;
        }
        let column = |at: usize| {
            let mut hasher = blake3::Hasher::new();
            samples.chunks_exact(line).for_each(|row| _ = hasher.update(&row[at * bytes..(at + 1) * bytes]));
            hasher.finalize()
        };
        let row = |at: usize| blake3::hash(&samples[at * line..(at + 1) * line]);
        Some(Edges { north: row(0), south: row(side - 1), west: column(0), east: column(side - 1) })
    }
}

const NAME: &str = registry::FILE_NAME;

/// Compares the registry with the manifest, and some of its tiles with the same tiles baked again.
fn check_registry(
    folder: &Path,
    manifest: &Manifest,
    rebake: Rebake,
    watch: &Watch,
    checked: &mut Checked,
) -> Result<(), Error> {
    let read = || {
        let registry = Registry::read(&folder.join(NAME))?;
        Ok::<_, Error>((registry.rows()?, registry))
    };
    let (rows, registry) = match read() {
        Ok(read) => read,
        Err(error) => {
            checked.add(NAME, format!("cannot be read: {error}"));
            return Ok(());
        }
    };
    let Ok(wanted) = manifest.tiles() else {
        checked.add(manifest::PATH, "has a region or a walk that cannot be");
        return Ok(());
    };
    let there: BTreeSet<TileId> = rows.iter().map(|row| row.tile).collect();
    if wanted != there {
        checked.add(NAME, format!("has {} tiles, and the manifest {}", there.len(), wanted.len()));
    }
    compare_files(&registry, &rows, manifest, checked)?;
    match rebake {
        Rebake::None => Ok(()),
        Rebake::Share(share) => bake_again(&rows, share, manifest, watch, checked),
    }
}

/// Compares the files in the registry with those in the manifest.
fn compare_files(
    registry: &Registry,
    rows: &[TileRow],
    manifest: &Manifest,
    checked: &mut Checked,
) -> Result<(), Error> {
    let mut others = Vec::new();
    let known: BTreeMap<&str, &FileRecord> = manifest.files.iter().map(|record| (&record.path[..], record)).collect();
    let mut count = 0;
    let compare = |file: FileRow| {
        count += 1;
        let is_same = known.get(&file.path[..]).is_some_and(|known| file.clone().record().is_same_file(known));
        if !is_same {
            others.push(file.path);
        }
        Ok(())
    };
    registry.for_each_file(compare)?;
    for path in others {
        checked.add(NAME, format!("has another {path} than the manifest"));
    }
    // The registry has no row for its own file, so the manifest lists one file more.
    if count + 1 != known.len() && manifest.is_sealed() {
        checked.add(NAME, format!("has {count} files, and the manifest {} besides it", known.len().saturating_sub(1)));
    }
    for (row, file) in rows.iter().flat_map(|row| row.files.iter().map(move |file| (row, file))) {
        if !known.contains_key(&file[..]) {
            let TileId { x, y } = row.tile;
            checked.add(NAME, format!("says that tile {x}, {y} is in {file}, which the manifest does not list"));
        }
    }
    Ok(())
}

/// Bakes a share of the tiles again, and compares them with their rows in the registry.
fn bake_again(
    rows: &[TileRow],
    share: f64,
    manifest: &Manifest,
    watch: &Watch,
    checked: &mut Checked,
) -> Result<(), Error> {
    let count = ((rows.len() as f64 * share).ceil() as usize).clamp(1, rows.len().max(1)).min(rows.len());
    let chosen: Vec<&TileRow> = (0..count).map(|number| &rows[number * rows.len() / count]).collect();
    let world = manifest.world()?;
    // A tile of a walk is made again from the records of all tiles.
    let records = rows.iter().filter_map(TileRow::walk_record);
    let walked = manifest.walk.is_some().then(|| Walked::new(&world, records)).transpose()?;
    watch.begin("baking tiles again", Some((count as u64, "tiles")));
    let differs = |row: &&TileRow| {
        let made = match &walked {
            None => Some(Tile::timed(&world, row.tile, &watch.clock)?),
            Some(walked) => walked.tile(row.tile, &watch.clock)?,
        };
        let made = made.map(|tile| tile.digest());
        watch.add(1);
        let parts = TilePart::ALL.into_iter();
        let other: Vec<&str> = parts
            .filter(|part| row.digest.and_then(|digest| digest.of(*part)) != made.and_then(|made| made.of(*part)))
            .map(TilePart::name)
            .collect();
        Ok((!other.is_empty()).then(|| (row.tile, other.join(", "))))
    };
    let faults = chosen.par_iter().filter_map(|row| differs(row).transpose());
    for (TileId { x, y }, parts) in faults.collect::<Result<Vec<(TileId, String)>, Stopped>>()? {
        checked.add(NAME, format!("has another tile {x}, {y} than is baked now: {parts}"));
    }
    checked.tiles = count as u64;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_of_tiles_are_told_from_others() {
        assert_eq!(stem("map/map_x0_y12.png"), stem("map/map_x10_y0.png"));
        assert_eq!(stem("map/map_x-3_y12.png"), stem("map/map_x10_y-40.png"));
        assert_ne!(stem("a/splat1_x0_y0.png"), stem("a/splat2_x0_y0.png"));
        assert_eq!(stem("exr/exit.exr"), "exr/exit.exr");
    }
}
