//! GeoJSON: the layers as text, each a collection of features.
//!
//! RFC 7946 means degrees of the Earth; these coordinates are metres east and north of the world's origin, as in the
//! GeoPackage, and for rivers and roads with levels metres up. The files have no `crs` member, since no reference system of the
//! Earth applies.

use std::fmt::Write as _;
use std::io::Write;
use std::path::Path;
use std::sync::Mutex;

use crate::area::Place;
use crate::bake::{FileRecord, Kept, Sink};
use crate::error::Error;
use crate::export::format::{Format, FormatCost, Request};
use crate::export::locked;
use crate::export::vector::store::{FeatureStore, bytes_at_most};
use crate::features::layer::{Head, Shape};
use crate::features::{AnyLayer, Row, layers};
use crate::file::PartFile;
use crate::tile::Tile;
use crate::watch::Watch;
use crate::world::World;

/// The folder of the files in that of the bake.
const FOLDER: &str = "vector";

/// The file of a layer in the folder of the bake.
fn path(layer: &dyn AnyLayer) -> String {
    format!("{FOLDER}/{}.geojson", layer.name())
}

/// GeoJSON, as a format: a file a layer.
pub(crate) struct GeoJson;

impl Format for GeoJson {
    fn name(&self) -> &'static str {
        "geojson"
    }

    fn about(&self) -> &'static str {
        "the same layers as GeoJSON, coordinates in metres"
    }

    fn folders(&self) -> Vec<&'static str> {
        vec![FOLDER]
    }

    fn cost(&self, request: &Request) -> FormatCost {
        let disk_bytes = bytes_at_most(request.world, &request.region);
        FormatCost { files: layers(request.world).len() as u64, disk_bytes, features: true, ..FormatCost::default() }
    }

    fn sinks<'a>(&self, request: &Request<'a>, out: &Path) -> Result<Vec<Box<dyn Sink + 'a>>, Error> {
        Ok(vec![Box::new(GeoJsonSink::create(request.world, out)?)])
    }
}

/// The files under way, one a layer.
pub(crate) struct GeoJsonSink<'a> {
    features: FeatureStore<'a>,
    files: Mutex<Vec<PartFile>>,
}

impl<'a> GeoJsonSink<'a> {
    /// Begins the files in the folder of the bake.
    pub fn create(world: &'a World, out: &Path) -> Result<GeoJsonSink<'a>, Error> {
        let file = |layer: &&dyn AnyLayer| PartFile::create(out.join(path(*layer)));
        let files = layers(world).iter().map(file).collect::<Result<Vec<_>, _>>()?;
        Ok(GeoJsonSink {
            // One store for all layers, named after none of them.
            features: FeatureStore::create(world, &out.join(FOLDER).join("layers.geojson"))?,
            files: Mutex::new(files),
        })
    }

    /// Where its features wait.
    #[cfg(test)]
    pub fn features(&self) -> &FeatureStore<'a> {
        &self.features
    }
}

impl Sink for GeoJsonSink<'_> {
    fn name(&self) -> &'static str {
        "vector/*.geojson"
    }

    fn take(&self, tile: &Tile, _place: Place) -> Result<Kept, Error> {
        Ok(Kept { piece: self.features.take(tile), files: Vec::new() })
    }

    fn append(&self, _row: u64, pieces: &[&[u8]]) -> Result<(), Error> {
        self.features.put(pieces)
    }

    fn finish(&self, _watch: &Watch) -> Result<Vec<FileRecord>, Error> {
        let files = std::mem::take(&mut *locked(&self.files));
        let mut records = Vec::new();
        for (number, (mut file, layer)) in files.into_iter().zip(self.features.layers().iter().copied()).enumerate() {
            write_collection(&mut file, &self.features, number)?;
            records.push(FileRecord::new(path(layer), GeoJson.name(), file.finish()?));
        }
        Ok(records)
    }
}

/// Writes all features of a layer, a line each.
fn write_collection(file: &mut PartFile, features: &FeatureStore, number: usize) -> Result<(), Error> {
    let path = file.path().to_owned();
    let mut write = |text: &str| file.write_all(text.as_bytes()).map_err(Error::io(&path));
    write("{\"type\":\"FeatureCollection\",\"features\":[")?;
    let layer = features.layers()[number];
    let heads = layer.heads();
    // A feature a line, so that files can be compared and read from a stream.
    let mut separator = "\n";
    features.for_each(number, |row| {
        write(separator)?;
        separator = ",\n";
        write(&as_text(layer.shape(), &heads, &row))
    })?;
    write("\n]}\n")
}

/// A feature as text.
fn as_text(shape: Shape, heads: &[Head], row: &Row) -> String {
    let mut text = String::from("{\"type\":\"Feature\",\"properties\":{");
    for (index, (head, value)) in heads.iter().zip(&row.values).enumerate() {
        // Neighbours with the same key are an array.
        let follows = index > 0 && heads[index - 1].key == head.key;
        let goes_on = heads.get(index + 1).is_some_and(|next| next.key == head.key);
        let separator = if index > 0 { "," } else { "" };
        match follows {
            true => text.push_str(separator),
            false => _ = write!(text, "{separator}{:?}:{}", head.key, if goes_on { "[" } else { "" }),
        }
        text.push_str(&json(value));
        if follows && !goes_on {
            text.push(']');
        }
    }
    let (kind, depth) = match shape {
        Shape::Point => ("Point", 0),
        Shape::Line | Shape::LineZ => ("LineString", 1),
        Shape::Polygon => ("Polygon", 2),
    };
    _ = write!(text, "}},\"geometry\":{{\"type\":\"{kind}\",\"coordinates\":");
    // A polygon is a list of rings, a line a list of points, and a point stands alone.
    text.push_str(&"[".repeat(usize::from(depth == 2)));
    for (index, line) in row.lines.iter().enumerate() {
        text.push_str(if index > 0 { "," } else { "" });
        text.push_str(&"[".repeat(usize::from(depth > 0)));
        for (index, point) in line.iter().enumerate() {
            text.push_str(if index > 0 { ",[" } else { "[" });
            for (axis, number) in point[..shape.dimensions()].iter().enumerate() {
                text.push_str(if axis > 0 { "," } else { "" });
                text.push_str(&json(number));
            }
            text.push(']');
        }
        text.push_str(&"]".repeat(usize::from(depth > 0)));
    }
    text.push_str(&"]".repeat(usize::from(depth == 2)));
    text.push_str("}}");
    text
}

fn json(value: &impl serde::Serialize) -> String {
    serde_json::to_string(value).expect("numbers and texts are JSON")
}
