//! GeoJSON: a text file for each layer, each a collection of features.
//!
//! RFC 7946 prescribes degrees on the Earth. These files have metres east and north of the world's origin, as in the
//! GeoPackage, and metres up for rivers and roads with levels. They have no `crs` member, since no reference system of
//! the Earth applies. Programs that read GeoJSON take the numbers for degrees all the same: for them, longitudes and
//! latitudes are written on request, chosen so that web maps show them at these metres.

use std::fmt::Write as _;
use std::io::Write;
use std::path::Path;
use std::sync::Mutex;

use crate::area::Place;
use crate::bake::{FileRecord, Kept, Sink};
use crate::clock::Clock;
use crate::error::Error;
use crate::export::formats::format::{Format, Request};
use crate::export::formats::locked;
use crate::export::formats::vector::contours;
use crate::export::formats::vector::kept_a_vertex;
use crate::export::formats::vector::vectors::Vectors;
use crate::features::layer::{Geometry, GeometryType, Head};
use crate::features::{Row, Value, layers};
use crate::file::PartFile;
use crate::tile::Tile;
use crate::watch::Watch;
use crate::web::mercator;

/// Folder of the files within that of the bake.
const FOLDER: &str = "vector";

/// Converts metres east and north to the longitude and latitude of which web Mercator makes the same metres.
fn degrees(place_m: [f64; 2]) -> [f64; 2] {
    // A hundred-millionth of a degree is a millimetre.
    mercator::degrees(place_m).map(|angle| rounded(angle, 1e8))
}

/// Rounds a number to the nearest `1 / parts`, so that it is written without meaningless digits.
fn rounded(number: f64, parts: f64) -> f64 {
    // Adding 0.0 turns -0.0 into 0.0.
    (number * parts).round() / parts + 0.0
}

/// Parts of a metre, or of an attribute's unit, that numbers are rounded to: rivers fall by less than a millimetre from
/// point to point.
const PARTS: f64 = 1e6;

/// The format GeoJSON: a file for each layer.
pub(crate) struct GeoJson;

impl Format for GeoJson {
    fn name(&self) -> &'static str {
        "geojson"
    }

    fn about(&self) -> &'static str {
        "the same layers as GeoJSON, coordinates in metres, which GIS takes for degrees: give it vector, or --degrees"
    }

    fn shows_walks(&self) -> bool {
        true
    }

    fn options(&self) -> &'static [&'static str] {
        &["--clip", "--contours", "--degrees"]
    }

    fn folders(&self) -> Vec<&'static str> {
        vec![FOLDER]
    }

    fn files(&self, request: &Request) -> u64 {
        layers(request.world).len() as u64 + 1
    }

    fn kept_a_vertex(&self, request: &Request) -> u64 {
        kept_a_vertex(request)
    }

    fn blank_pieces(&self, _request: &Request) -> Option<Vec<Vec<u8>>> {
        Some(Vec::new())
    }

    fn sinks<'a>(&self, request: &Request<'a>, out: &Path) -> Result<Vec<Box<dyn Sink + 'a>>, Error> {
        Ok(vec![Box::new(GeoJsonSink::create(request, out)?)])
    }
}

/// The files being written, one for each layer.
pub(crate) struct GeoJsonSink<'a> {
    vectors: Vectors<'a>,
    files: Mutex<Collections>,
}

struct Collections {
    /// The files of features, which are written at the end.
    features: Vec<Collection>,
    contours: Option<Collection>,
}

impl<'a> GeoJsonSink<'a> {
    /// Begins the files in the folder of the bake.
    pub fn create(request: &Request<'a>, out: &Path) -> Result<GeoJsonSink<'a>, Error> {
        let begin = |layer: &str| Collection::begin(layer, request.vectors.degrees, out);
        let features = layers(request.world).iter().map(|layer| begin(layer.name())).collect::<Result<_, _>>()?;
        let files = Collections { features, contours: Some(begin(contours::NAME)?) };
        // One store for all layers, named after none of them.
        let vectors = Vectors::create(request, &out.join(FOLDER).join("layers.geojson"))?;
        Ok(GeoJsonSink { vectors, files: Mutex::new(files) })
    }

    /// Returns the features and contours, which other formats have in common with this one.
    #[cfg(test)]
    pub fn vectors(&self) -> &Vectors<'a> {
        &self.vectors
    }
}

impl Sink for GeoJsonSink<'_> {
    fn name(&self) -> &'static str {
        "vector/*.geojson"
    }

    fn take(&self, tile: &Tile, _place: Place, clock: &Clock) -> Result<Kept, Error> {
        Ok(Kept { piece: self.vectors.take(tile, clock)?, files: Vec::new() })
    }

    fn append(&self, row: u64, pieces: &[&[u8]], _clock: &Clock) -> Result<(), Error> {
        let mut files = locked(&self.files);
        let file = files.contours.as_mut().expect("rows come before the end");
        self.vectors
            .put(row, pieces, |Row { values, lines }| file.add(contours::SHAPE, &contours::HEADS, &values, &[lines]))
    }

    fn finish(&self, watch: &Watch) -> Result<Vec<FileRecord>, Error> {
        let Collections { features, contours } = &mut *locked(&self.files);
        let mut records = Vec::new();
        let store = &self.vectors.features;
        for (number, (mut file, layer)) in std::mem::take(features).into_iter().zip(store.layers()).enumerate() {
            let heads = layer.heads();
            store.for_each(number, &watch.clock, |values, parts| file.add(layer.shape(), &heads, values, parts))?;
            records.push(file.end()?);
        }
        records.push(contours.take().expect("a sink ends once").end()?);
        Ok(records)
    }
}

/// A file of features being written: one feature a line, so that files can be compared and read as a stream.
struct Collection {
    path: String,
    file: PartFile,
    degrees: bool,
    separator: &'static str,
}

impl Collection {
    fn begin(layer: &str, degrees: bool, out: &Path) -> Result<Collection, Error> {
        let path = format!("{FOLDER}/{layer}.geojson");
        let mut collection = Collection { file: PartFile::create(out.join(&path))?, path, degrees, separator: "\n" };
        collection.write("{\"type\":\"FeatureCollection\",\"features\":[")?;
        Ok(collection)
    }

    fn write(&mut self, text: &str) -> Result<(), Error> {
        self.file.write_all(text.as_bytes()).map_err(Error::io(self.file.path()))
    }

    /// Adds a feature of one part or several.
    fn add(&mut self, shape: GeometryType, heads: &[Head], values: &[Value], parts: &[Geometry]) -> Result<(), Error> {
        self.write(self.separator)?;
        self.separator = ",\n";
        let mut text = String::from("{\"type\":\"Feature\",\"properties\":{");
        add_properties(&mut text, heads, values);
        text.push_str("},\"geometry\":{\"type\":\"");
        let name = match shape {
            GeometryType::Point => "Point",
            GeometryType::Line | GeometryType::LineZ => "LineString",
            GeometryType::Polygon => "Polygon",
        };
        let of_part = |text: &mut String, part: &Geometry| add_coordinates(text, shape, part, self.degrees);
        if let [part] = parts {
            _ = write!(text, "{name}\",\"coordinates\":");
            of_part(&mut text, part);
        } else {
            _ = write!(text, "Multi{name}\",\"coordinates\":[");
            for (index, part) in parts.iter().enumerate() {
                text.push_str(if index > 0 { "," } else { "" });
                of_part(&mut text, part);
            }
            text.push(']');
        }
        text.push_str("}}");
        self.write(&text)
    }

    fn end(mut self) -> Result<FileRecord, Error> {
        self.write("\n]}\n")?;
        Ok(FileRecord::new(self.path, GeoJson.name(), self.file.finish()?))
    }
}

fn add_properties(text: &mut String, heads: &[Head], values: &[Value]) {
    for (index, (head, value)) in heads.iter().zip(values).enumerate() {
        // Neighbouring attributes with the same key form an array.
        let follows = index > 0 && heads[index - 1].key == head.key;
        let goes_on = heads.get(index + 1).is_some_and(|next| next.key == head.key);
        let separator = if index > 0 { "," } else { "" };
        match follows {
            true => text.push_str(separator),
            false => _ = write!(text, "{separator}{:?}:{}", head.key, if goes_on { "[" } else { "" }),
        }
        text.push_str(&match value {
            Value::Real(number) => json(&rounded(*number, PARTS)),
            value => json(value),
        });
        if follows && !goes_on {
            text.push(']');
        }
    }
}

/// Adds the coordinates of a geometry. A polygon is a list of rings, a line a list of points, and a point stands alone.
fn add_coordinates(text: &mut String, shape: GeometryType, lines: &[Vec<[f64; 3]>], in_degrees: bool) {
    let (list_of_lines, list_of_points) = (shape == GeometryType::Polygon, shape != GeometryType::Point);
    text.push_str(if list_of_lines { "[" } else { "" });
    for (index, line) in lines.iter().enumerate() {
        text.push_str(if index > 0 { "," } else { "" });
        text.push_str(if list_of_points { "[" } else { "" });
        for (index, point) in line.iter().enumerate() {
            text.push_str(if index > 0 { ",[" } else { "[" });
            let [x_m, y_m, height_m] = point.map(|at| rounded(at, PARTS));
            let [x, y] = if in_degrees { degrees([point[0], point[1]]) } else { [x_m, y_m] };
            for (axis, number) in [x, y, height_m][..shape.dimensions()].iter().enumerate() {
                text.push_str(if axis > 0 { "," } else { "" });
                text.push_str(&json(number));
            }
            text.push(']');
        }
        text.push_str(if list_of_points { "]" } else { "" });
    }
    text.push_str(if list_of_lines { "]" } else { "" });
}

fn json(value: &impl serde::Serialize) -> String {
    serde_json::to_string(value).expect("numbers and texts are JSON")
}
