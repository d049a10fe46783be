//! Bounds of a manifest that is read: even with a right hash, it is refused if no bake could have written it.
//!
//! A manifest may be damaged, written by hand or malicious, and the rest of the program uses its values unchecked. So
//! all values are checked here: numbers lie in the ranges of options and presets, derived numbers agree with those that
//! they follow from, and no text or list is longer than a bake makes it.

use std::collections::BTreeSet;
use std::fmt::{self, Debug, Display, Formatter};

use serde::de::{Deserialize, Deserializer, Error, MapAccess, SeqAccess, Visitor};

use crate::area::{MAX_COORDINATE, Region, Stride};
use crate::error;
use crate::export::Export;
use crate::export::folder::manifest::{Manifest, RegionRecord};
use crate::export::plan::options::MAX_LOD;
use crate::file::FileRecord;
use crate::preset::TILE_CELLS;
use crate::walker::LAYERS;

/// Largest number of bytes of a text: most systems allow no longer path.
const MOST_TEXT: usize = 4096;

/// Largest number of layers of the program that a manifest may list.
const MOST_LAYERS: usize = 64;

/// Largest number of channels that a raster may list.
const MOST_CHANNELS: usize = 64;

/// Reads any JSON value, checks its texts and keeps nothing.
pub(crate) struct TextCheck;

impl<'de> Deserialize<'de> for TextCheck {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<TextCheck, D::Error> {
        deserializer.deserialize_any(TextCheck)
    }
}

impl<'de> Visitor<'de> for TextCheck {
    type Value = TextCheck;

    fn expecting(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str("any value")
    }

    fn visit_unit<E: Error>(self) -> Result<TextCheck, E> {
        Ok(self)
    }

    fn visit_bool<E: Error>(self, _: bool) -> Result<TextCheck, E> {
        Ok(self)
    }

    fn visit_i64<E: Error>(self, _: i64) -> Result<TextCheck, E> {
        Ok(self)
    }

    fn visit_u64<E: Error>(self, _: u64) -> Result<TextCheck, E> {
        Ok(self)
    }

    fn visit_f64<E: Error>(self, _: f64) -> Result<TextCheck, E> {
        Ok(self)
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<TextCheck, E> {
        check_text(text).map(|()| self).map_err(E::custom)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut values: A) -> Result<TextCheck, A::Error> {
        while values.next_element::<TextCheck>()?.is_some() {}
        Ok(self)
    }

    fn visit_map<A: MapAccess<'de>>(self, mut entries: A) -> Result<TextCheck, A::Error> {
        while entries.next_entry::<TextCheck, TextCheck>()?.is_some() {}
        Ok(self)
    }
}

/// Checks that a text is safe to give to other programs.
///
/// # Errors
/// When the text is too long, or has a control character, such as the end of a line.
pub(crate) fn check_text(text: &str) -> Result<(), String> {
    if text.len() > MOST_TEXT {
        return Err(format!("a text of {} bytes, and {MOST_TEXT} are the most", text.len()));
    }
    match text.chars().find(|c| c.is_control()) {
        Some(control) => Err(format!("a text with the control character {control:?}")),
        None => Ok(()),
    }
}

/// Finds the first value of a manifest that no bake writes.
///
/// # Errors
/// When there is such a value: its key, what was expected and what was found.
pub(crate) fn check(manifest: &Manifest) -> Result<(), String> {
    manifest.preset.check().map_err(|fault| format!("preset: {}", error::Error::from(fault)))?;
    let region = check_region(manifest)?;
    check_heights(manifest)?;
    check_lists(manifest)?;
    check_meshes(manifest)?;
    if let Some(contours_m) = manifest.vectors.contours_m {
        is(contours_m > 0.0, "vectors.contours_m", "more than 0", contours_m)?;
    }
    if let Some(tour) = &manifest.walk {
        is(
            LAYERS.contains(&tour.layers),
            "walk.layers",
            format_args!("{} to {}", LAYERS.start(), LAYERS.end()),
            tour.layers,
        )?;
    }
    if let Some(shard) = &manifest.shard {
        let is_one = (1..=shard.of).contains(&shard.number) && shard.of <= region.tiles();
        is(is_one, "shard", "one of no more shards than there are tiles", shard)?;
        is(shard.tiles(&region).is_some(), "shard", "tiles of the region", shard)?;
    }
    manifest.files.iter().try_for_each(|record| check_file(record, &region))?;
    let bytes = manifest.files.iter().try_fold(0_u64, |sum, record| sum.checked_add(record.bytes));
    is(bytes.is_some(), "files", "fewer than 2^64 bytes in all", "more")
}

/// Refuses a value that is not as expected; the message names its key.
fn is(is_so: bool, key: impl Display, expected: impl Display, found: impl Debug) -> Result<(), String> {
    if is_so { Ok(()) } else { Err(format!("{key}: expected {expected}, found {found:?}")) }
}

/// Returns the region, if it is possible and all numbers derived from it are right.
fn check_region(manifest: &Manifest) -> Result<Region, String> {
    let Manifest { preset, region, stride, spacing_m, .. } = manifest;
    let cells = format!("{} to {}", TILE_CELLS.start(), TILE_CELLS.end());
    is(TILE_CELLS.contains(&region.tile_cells), "region.tile_cells", &cells, region.tile_cells)?;
    let whole = region.region().map_err(|error| format!("region: {error}"))?;
    let known = u64::try_from(*stride).ok().and_then(Stride::new);
    is(known.is_some(), "stride", "a power of two from 1 to 4096", stride)?;
    let expected_m = preset.spacing_m * *stride as f64;
    is(
        are_near(&[*spacing_m], &[expected_m]),
        "spacing_m",
        format_args!("the preset's, times the stride, which is {expected_m}"),
        spacing_m,
    )?;
    let most_m = MAX_COORDINATE as f64 * spacing_m;
    let is_near = region.mesh_origin_m.iter().all(|side_m| side_m.abs() <= most_m);
    is(is_near, "region.mesh_origin_m", format_args!("at most {most_m} m from the origin"), region.mesh_origin_m)?;
    let derived = RegionRecord::new(&whole, *spacing_m, region.mesh_origin_m);
    let vertices = |record: &RegionRecord| [record.width, record.height];
    let places = |record: &RegionRecord| [&record.bounds_km[..], &record.origin_m].concat();
    let is_derived = vertices(region) == vertices(&derived) && are_near(&places(region), &places(&derived));
    is(is_derived, "region", format_args!("what follows from its tiles, {derived:?}"), region)?;
    Ok(whole)
}

/// True if numbers agree but for the last digits, which another version may compute differently.
fn are_near(numbers: &[f64], others: &[f64]) -> bool {
    numbers.iter().zip(others).all(|(number, other)| (number - other).abs() <= 1e-9 * other.abs().max(1.0))
}

fn check_heights(manifest: &Manifest) -> Result<(), String> {
    let Manifest { preset, height_range, sea_level_m, .. } = manifest;
    let (min_m, max_m) = (height_range.min_m, height_range.max_m);
    let is_range = min_m < max_m && (max_m - min_m).is_finite();
    is(is_range, "height_range", "two heights, the lower one first", [min_m, max_m])?;
    let step_m = (max_m - min_m) / 65535.0;
    is(are_near(&[height_range.step_m.into()], &[step_m.into()]), "height_range.step_m", step_m, height_range.step_m)?;
    is(
        *sea_level_m == preset.sea_level_m,
        "sea_level_m",
        format_args!("the preset's, {:?}", preset.sea_level_m),
        sea_level_m,
    )
}

/// Checks the lengths of all lists but the list of files: none is longer than a bake makes it.
fn check_lists(manifest: &Manifest) -> Result<(), String> {
    let Manifest { layers, exports, .. } = manifest;
    is(layers.len() <= MOST_LAYERS, "layers", format_args!("at most {MOST_LAYERS}"), layers.len())?;
    let names: BTreeSet<&String> = exports.iter().collect();
    is(names.len() == exports.len(), "exports", "each once", exports.len())?;
    let most = Export::known().count();
    is(exports.len() <= most, "exports", format_args!("at most {most}"), exports.len())
}

fn check_meshes(manifest: &Manifest) -> Result<(), String> {
    let meshes = &manifest.meshes;
    let lods = meshes.lods.all();
    let are_levels = lods.is_sorted_by(|one, next| one < next) && lods.iter().all(|lod| *lod <= MAX_LOD);
    is(
        are_levels && !lods.is_empty(),
        "meshes.lods",
        format_args!("levels from 0 to {MAX_LOD}, the finest first"),
        lods,
    )?;
    if let Some(error_m) = meshes.error_m {
        is(error_m > 0.0, "meshes.error_m", "more than 0", error_m)?;
    }
    // Manifests of earlier versions record no origin.
    let Some(origin) = meshes.origin else { return Ok(()) };
    let is_vertex = origin.iter().all(|side| side.unsigned_abs() <= MAX_COORDINATE.unsigned_abs());
    is(is_vertex, "meshes.origin", format_args!("a vertex at most {MAX_COORDINATE} from the origin"), origin)?;
    let derived_m = origin.map(|side| side as f64 * manifest.spacing_m);
    let expected = format!("the place of the vertex {origin:?}, {derived_m:?}");
    is(
        are_near(&manifest.region.mesh_origin_m, &derived_m),
        "region.mesh_origin_m",
        &expected,
        manifest.region.mesh_origin_m,
    )
}

fn check_file(record: &FileRecord, region: &Region) -> Result<(), String> {
    let FileRecord { path, width, height, channels, mesh, tile, bytes, blake3, .. } = record;
    // The registry stores counts as signed numbers.
    let is_count = |count: u64| i64::try_from(count).is_ok();
    is(is_count(*bytes), format_args!("files, {path:?}: bytes"), "fewer than 2^63", bytes)?;
    for (name, side) in [("width", width), ("height", height)] {
        is(side.is_none_or(is_count), format_args!("files, {path:?}: {name}"), "fewer than 2^63 pixels", side)?;
    }
    is(
        channels.len() <= MOST_CHANNELS,
        format_args!("files, {path:?}: channels"),
        format_args!("at most {MOST_CHANNELS}"),
        channels.len(),
    )?;
    is(
        tile.is_none_or(|tile| region.place(tile).is_some()),
        format_args!("files, {path:?}: tile"),
        "a tile of the region",
        tile,
    )?;
    is(
        blake3::Hash::from_hex(blake3).is_ok(),
        format_args!("files, {path:?}: blake3"),
        "64 hexadecimal digits",
        blake3,
    )?;
    let Some(mesh) = mesh else { return Ok(()) };
    is(mesh.lod <= MAX_LOD, format_args!("files, {path:?}: mesh.lod"), format_args!("0 to {MAX_LOD}"), mesh.lod)?;
    is(is_count(mesh.vertices), format_args!("files, {path:?}: mesh.vertices"), "fewer than 2^63", mesh.vertices)?;
    is(is_count(mesh.triangles), format_args!("files, {path:?}: mesh.triangles"), "fewer than 2^63", mesh.triangles)?;
    is(mesh.error_m >= 0.0, format_args!("files, {path:?}: mesh.error_m"), "no less than 0", mesh.error_m)
}
