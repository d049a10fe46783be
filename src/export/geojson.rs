//! GeoJSON: rivers and roads as text, each a collection of lines.
//!
//! RFC 7946 means degrees of the Earth; these coordinates are metres east and north of the world's origin, as in the
//! GeoPackage. The files have no `crs` member, since no reference system of the Earth applies.

use std::io::{self, Write};
use std::path::Path;
use std::sync::Mutex;

use serde::Serialize;

use crate::agents::way::WayKind;
use crate::area::{Place, Region};
use crate::bake::Sink;
use crate::error::Error;
use crate::export::file::PartFile;
use crate::export::manifest::FileRecord;
use crate::export::vector::{Feature, PathStore};
use crate::tile::Tile;
use crate::world::World;

/// The files in the folder of the bake, as [`KINDS`] has them.
pub(crate) const PATHS: &[&str] = &["vector/rivers.geojson", "vector/roads.geojson"];
const KINDS: [WayKind; 2] = [WayKind::River, WayKind::Road];

/// The two files under way.
pub(crate) struct GeoJson {
    paths: PathStore,
    files: Mutex<Vec<PartFile>>,
}

#[derive(Serialize)]
struct Line<'a> {
    r#type: &'static str,
    properties: Properties,
    geometry: Geometry<'a>,
}

#[derive(Serialize)]
struct Properties {
    owner_x: i64,
    owner_y: i64,
    ending: &'static str,
    joins_x: Option<i64>,
    joins_y: Option<i64>,
    length_m: f64,
    width_start_m: f32,
    width_end_m: f32,
    floor_start_m: f32,
    floor_end_m: f32,
}

#[derive(Serialize)]
struct Geometry<'a> {
    r#type: &'static str,
    coordinates: &'a [[f64; 2]],
}

impl GeoJson {
    /// Begins the files in the folder of the bake.
    pub fn create(world: &World, region: &Region, out: &Path) -> Result<GeoJson, Error> {
        let files = PATHS.iter().map(|path| PartFile::create(out.join(path))).collect::<Result<Vec<_>, _>>()?;
        Ok(GeoJson { paths: PathStore::create(world, region, &out.join(PATHS[0]))?, files: Mutex::new(files) })
    }

    /// Where its paths wait.
    #[cfg(test)]
    pub fn paths(&self) -> &PathStore {
        &self.paths
    }
}

impl Sink for GeoJson {
    fn name(&self) -> &'static str {
        "vector/*.geojson"
    }

    fn take(&self, tile: &Tile, _place: Place) -> Result<Vec<u8>, Error> {
        self.paths.take(tile);
        Ok(Vec::new())
    }

    fn append(&self, _row: u64, _pieces: &[&[u8]]) -> Result<(), Error> {
        self.paths.flush()
    }

    fn finish(&self) -> Result<Vec<FileRecord>, Error> {
        let files = std::mem::take(&mut *self.files.lock().expect("no thread panics while it writes"));
        let mut records = Vec::new();
        for ((mut file, path), kind) in files.into_iter().zip(PATHS).zip(KINDS) {
            write_collection(&mut file, &self.paths, kind)?;
            records.push(FileRecord::new((*path).to_owned(), "geojson", file.finish()?));
        }
        Ok(records)
    }
}

/// Writes all features of a kind, a line each.
fn write_collection(file: &mut PartFile, paths: &PathStore, kind: WayKind) -> Result<(), Error> {
    let path = file.path().to_owned();
    let mut write = |text: &[u8]| file.write_all(text).map_err(Error::io(&path));
    write(b"{\"type\":\"FeatureCollection\",\"features\":[")?;
    let mut separator: &[u8] = b"\n";
    paths.for_each(kind, |feature| {
        write(separator)?;
        separator = b",\n";
        let text = serde_json::to_vec(&Line::new(&feature)).map_err(io::Error::from).map_err(Error::io(&path))?;
        write(&text)
    })?;
    write(b"\n]}\n")
}

impl Line<'_> {
    fn new(feature: &Feature) -> Line<'_> {
        Line {
            r#type: "Feature",
            properties: Properties {
                owner_x: feature.owner.x,
                owner_y: feature.owner.y,
                ending: feature.ending,
                joins_x: feature.joins.map(|tile| tile.x),
                joins_y: feature.joins.map(|tile| tile.y),
                length_m: feature.length_m,
                width_start_m: feature.width_m[0],
                width_end_m: feature.width_m[1],
                floor_start_m: feature.floor_m[0],
                floor_end_m: feature.floor_m[1],
            },
            geometry: Geometry { r#type: "LineString", coordinates: &feature.line },
        }
    }
}
