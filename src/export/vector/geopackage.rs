//! A GeoPackage: all layers and the footprints of the tiles, in one SQLite database.
//!
//! Based on: OGC 12-128r17, GeoPackage Encoding Standard 1.3. The reference system is the standard's own "undefined
//! Cartesian" (-1): metres east and north of the world's origin.

use std::path::{Path, PathBuf};
use std::sync::Mutex;

use rusqlite::{Connection, ToSql, params, params_from_iter};

use crate::area::{Place, Region, TileId};
use crate::bake::{FileRecord, Kept, Sink};
use crate::error::Error;
use crate::export::format::{Format, FormatCost, Request, folder};
use crate::export::locked;
use crate::export::vector::store::{FeatureStore, bytes_at_most};
use crate::features::AnyLayer;
use crate::features::layer::{Kind, Shape};
use crate::file::PartFile;
use crate::registry::unjournaled;
use crate::tile::Tile;
use crate::watch::Watch;
use crate::world::World;

/// The file in the folder of the bake.
const PATH: &str = "vector/vector.gpkg";

/// `GPKG` in the header of the database, and version 1.3.0 of the standard.
const APPLICATION_ID: i32 = i32::from_be_bytes(*b"GPKG");
const USER_VERSION: i32 = 10300;

/// The reference system of a plane that is nowhere on the Earth.
const UNDEFINED_CARTESIAN: i32 = -1;

/// The standard asks for the time of a layer's last change; the same bake has the same bytes, so it is none.
const LAST_CHANGE: &str = "1970-01-01T00:00:00.000Z";

/// What the standard asks every GeoPackage to have.
const SCHEMA: &str = "
    CREATE TABLE gpkg_spatial_ref_sys (
        srs_name TEXT NOT NULL,
        srs_id INTEGER NOT NULL PRIMARY KEY,
        organization TEXT NOT NULL,
        organization_coordsys_id INTEGER NOT NULL,
        definition TEXT NOT NULL,
        description TEXT
    );
    INSERT INTO gpkg_spatial_ref_sys VALUES
        ('Undefined Cartesian SRS', -1, 'NONE', -1, 'undefined', 'undefined Cartesian coordinate reference system'),
        ('Undefined geographic SRS', 0, 'NONE', 0, 'undefined', 'undefined geographic coordinate reference system'),
        ('WGS 84 geodetic', 4326, 'EPSG', 4326, 'GEOGCS[\"WGS 84\",DATUM[\"WGS_1984\",SPHEROID[\"WGS 84\",6378137,298.257223563,AUTHORITY[\"EPSG\",\"7030\"]],AUTHORITY[\"EPSG\",\"6326\"]],PRIMEM[\"Greenwich\",0,AUTHORITY[\"EPSG\",\"8901\"]],UNIT[\"degree\",0.0174532925199433,AUTHORITY[\"EPSG\",\"9122\"]],AUTHORITY[\"EPSG\",\"4326\"]]', 'longitude and latitude in degrees');
    CREATE TABLE gpkg_contents (
        table_name TEXT NOT NULL PRIMARY KEY,
        data_type TEXT NOT NULL,
        identifier TEXT UNIQUE,
        description TEXT DEFAULT '',
        last_change DATETIME NOT NULL DEFAULT (strftime('%Y-%m-%dT%H:%M:%fZ','now')),
        min_x DOUBLE,
        min_y DOUBLE,
        max_x DOUBLE,
        max_y DOUBLE,
        srs_id INTEGER,
        CONSTRAINT fk_gc_r_srs_id FOREIGN KEY (srs_id) REFERENCES gpkg_spatial_ref_sys(srs_id)
    );
    CREATE TABLE gpkg_geometry_columns (
        table_name TEXT NOT NULL,
        column_name TEXT NOT NULL,
        geometry_type_name TEXT NOT NULL,
        srs_id INTEGER NOT NULL,
        z TINYINT NOT NULL,
        m TINYINT NOT NULL,
        CONSTRAINT pk_geom_cols PRIMARY KEY (table_name, column_name),
        CONSTRAINT uk_gc_table_name UNIQUE (table_name),
        CONSTRAINT fk_gc_tn FOREIGN KEY (table_name) REFERENCES gpkg_contents(table_name),
        CONSTRAINT fk_gc_srs FOREIGN KEY (srs_id) REFERENCES gpkg_spatial_ref_sys (srs_id)
    );
    CREATE TABLE tiles (
        fid INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL,
        geom POLYGON,
        x INTEGER NOT NULL,
        y INTEGER NOT NULL,
        col INTEGER NOT NULL,
        row INTEGER NOT NULL
    );
";

/// GeoPackage, as a format.
pub(crate) struct GeoPackage;

impl Format for GeoPackage {
    fn name(&self) -> &'static str {
        "vector"
    }

    fn about(&self) -> &'static str {
        "rivers, lakes, coast, peaks, sites, roads, crossings and tiles as one GeoPackage"
    }

    fn folders(&self) -> Vec<&'static str> {
        vec![folder(PATH)]
    }

    fn cost(&self, request: &Request) -> FormatCost {
        let disk_bytes = bytes_at_most(request.world, &request.region);
        FormatCost { files: 1, disk_bytes, features: true, ..FormatCost::default() }
    }

    fn sinks<'a>(&self, request: &Request<'a>, out: &Path) -> Result<Vec<Box<dyn Sink + 'a>>, Error> {
        Ok(vec![Box::new(GeoPackageSink::create(request.world, request.region, out)?)])
    }
}

/// The table of a layer.
fn table(layer: &dyn AnyLayer) -> String {
    let columns = layer.heads().into_iter().map(|head| {
        let kind = match head.kind {
            Kind::Integer => "INTEGER",
            Kind::Real | Kind::Real32 => "DOUBLE",
            Kind::Text => "TEXT",
        };
        format!(",\n        {} {kind}{}", head.name, if head.required { " NOT NULL" } else { "" })
    });
    let columns: String = columns.collect();
    let (name, shape) = (layer.name(), shape_name(layer.shape()));
    format!("CREATE TABLE {name} (fid INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL, geom {shape}{columns});")
}

fn shape_name(shape: Shape) -> &'static str {
    match shape {
        Shape::Point => "POINT",
        Shape::Line | Shape::LineZ => "LINESTRING",
        Shape::Polygon => "POLYGON",
    }
}

/// The rectangle around geometries: the standard's word for it.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Envelope {
    min: [f64; 2],
    max: [f64; 2],
}

impl Envelope {
    // Added to anything, it changes nothing.
    const NOTHING: Envelope = Envelope { min: [f64::INFINITY; 2], max: [f64::NEG_INFINITY; 2] };

    fn of(lines: &[Vec<[f64; 3]>]) -> Envelope {
        lines
            .iter()
            .flatten()
            .fold(Envelope::NOTHING, |envelope, &[x, y, _]| envelope.and(Envelope { min: [x, y], max: [x, y] }))
    }

    fn and(self, other: Envelope) -> Envelope {
        let both = |a: [f64; 2], b: [f64; 2], pick: fn(f64, f64) -> f64| [pick(a[0], b[0]), pick(a[1], b[1])];
        Envelope { min: both(self.min, other.min, f64::min), max: both(self.max, other.max, f64::max) }
    }
}

/// A geometry as the standard has it in a column: its header with the envelope, then well-known binary.
fn geometry(shape: Shape, lines: &[Vec<[f64; 3]>]) -> Vec<u8> {
    let Envelope { min, max } = Envelope::of(lines);
    let points: usize = lines.iter().map(Vec::len).sum();
    let mut bytes = Vec::with_capacity(8 + 32 + 9 + 4 * lines.len() + 8 * shape.dimensions() * points);
    // Version 1 of the form is 0; little-endian, with an envelope of x and y.
    bytes.extend(*b"GP\x00\x03");
    bytes.extend(UNDEFINED_CARTESIAN.to_le_bytes());
    bytes.extend([min[0], max[0], min[1], max[1]].map(f64::to_le_bytes).as_flattened());
    // Well-known binary, little-endian; its kinds are numbers of the standard, a thousand more with heights.
    bytes.push(1);
    let kind: u32 = match shape {
        Shape::Point => 1,
        Shape::Line => 2,
        Shape::LineZ => 1002,
        Shape::Polygon => 3,
    };
    bytes.extend(kind.to_le_bytes());
    if shape == Shape::Polygon {
        bytes.extend((lines.len() as u32).to_le_bytes());
    }
    for line in lines {
        if shape != Shape::Point {
            bytes.extend((line.len() as u32).to_le_bytes());
        }
        let numbers = line.iter().flat_map(|point| &point[..shape.dimensions()]);
        bytes.extend(numbers.flat_map(|number| number.to_le_bytes()));
    }
    bytes
}

/// The database under way.
pub(crate) struct GeoPackageSink<'a> {
    region: Region,
    spacing_m: f64,
    features: FeatureStore<'a>,
    path: PathBuf,
    /// The connection first, so that it is closed when an abandoned file is removed.
    file: Mutex<Option<(Connection, PartFile)>>,
}

impl<'a> GeoPackageSink<'a> {
    /// Begins the database in the folder of the bake.
    pub fn create(world: &'a World, region: Region, out: &Path) -> Result<GeoPackageSink<'a>, Error> {
        let path = out.join(PATH);
        let mut file = PartFile::create(path.clone())?;
        let features = FeatureStore::create(world, &path)?;
        let create = |at: &Path| {
            let connection = Connection::open(at)?;
            unjournaled(&connection)?;
            // How readers and `file` tell a GeoPackage from any other database.
            connection.pragma_update(None, "application_id", APPLICATION_ID)?;
            connection.pragma_update(None, "user_version", USER_VERSION)?;
            // One transaction for all: each statement alone would be one of its own.
            connection.execute_batch("BEGIN")?;
            connection.execute_batch(SCHEMA)?;
            for layer in features.layers() {
                connection.execute_batch(&table(*layer))?;
            }
            connection.execute_batch("COMMIT")?;
            Ok(connection)
        };
        let connection = create(file.lend()).map_err(Error::sqlite(&path))?;
        let file = Mutex::new(Some((connection, file)));
        Ok(GeoPackageSink { region, spacing_m: world.spacing_m(), features, path, file })
    }

    /// The corners of a rectangle of tiles, anticlockwise from the south-western one and back to it.
    fn footprint(&self, at: TileId, cols: u64, rows: u64) -> Vec<[f64; 3]> {
        let cells = self.region.tile_cells() as i64;
        let metres = |tile: i64| (tile * cells) as f64 * self.spacing_m;
        let (west, east) = (metres(at.x), metres(at.x + cols as i64));
        // Not the negative, which has a zero of its own.
        let (south, north) = (0.0 - metres(at.y + rows as i64), 0.0 - metres(at.y));
        [[west, south], [east, south], [east, north], [west, north], [west, south]].map(|[x, y]| [x, y, 0.0]).to_vec()
    }

    fn write_tiles(&self, connection: &mut Connection, row: u64) -> rusqlite::Result<()> {
        let transaction = connection.transaction()?;
        let mut insert =
            transaction.prepare_cached("INSERT INTO tiles (geom, x, y, col, row) VALUES (?, ?, ?, ?, ?)")?;
        for col in 0..self.region.cols() {
            let tile = self.region.tile(Place { row, col });
            let shape = geometry(Shape::Polygon, &[self.footprint(tile, 1, 1)]);
            insert.execute(params![shape, tile.x, tile.y, col as i64, row as i64])?;
        }
        drop(insert);
        transaction.commit()
    }

    /// Writes a layer and returns its envelope, if it has any feature.
    fn write_layer(&self, connection: &mut Connection, number: usize) -> Result<Option<Envelope>, Error> {
        let failed = || Error::sqlite(&self.path);
        let layer = self.features.layers()[number];
        let mut envelope: Option<Envelope> = None;
        let transaction = connection.transaction().map_err(failed())?;
        let columns: Vec<&str> = ["geom"].into_iter().chain(layer.heads().iter().map(|head| head.name)).collect();
        let marks = ", ?".repeat(columns.len() - 1);
        let insert = format!("INSERT INTO {} ({}) VALUES (?{marks})", layer.name(), columns.join(", "));
        let mut insert = transaction.prepare(&insert).map_err(failed())?;
        // While they pass, since the list of layers wants the bounds of all and nothing holds them.
        self.features.for_each(number, |row| {
            let own = Envelope::of(&row.lines);
            envelope = Some(envelope.map_or(own, |envelope| envelope.and(own)));
            let shape = geometry(layer.shape(), &row.lines);
            let values = row.values.iter().map(|value| value as &dyn ToSql);
            let row = [&shape as &dyn ToSql].into_iter().chain(values);
            insert.execute(params_from_iter(row)).map(|_| ()).map_err(failed())
        })?;
        drop(insert);
        transaction.commit().map_err(failed())?;
        Ok(envelope)
    }
}

/// Lists a layer where readers look for layers.
fn register(
    connection: &Connection,
    (layer, shape, about): (&str, Shape, &str),
    envelope: Option<Envelope>,
) -> rusqlite::Result<()> {
    // An empty layer has no envelope: null in all four.
    let side = |pick: fn(&Envelope) -> f64| envelope.as_ref().map(pick);
    connection.execute(
        "INSERT INTO gpkg_contents VALUES (?1, 'features', ?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8)",
        params![
            layer,
            about,
            LAST_CHANGE,
            side(|envelope| envelope.min[0]),
            side(|envelope| envelope.min[1]),
            side(|envelope| envelope.max[0]),
            side(|envelope| envelope.max[1]),
            UNDEFINED_CARTESIAN,
        ],
    )?;
    connection.execute(
        "INSERT INTO gpkg_geometry_columns VALUES (?, 'geom', ?, ?, ?, 0)",
        params![layer, shape_name(shape), UNDEFINED_CARTESIAN, shape == Shape::LineZ],
    )?;
    Ok(())
}

impl Sink for GeoPackageSink<'_> {
    fn name(&self) -> &'static str {
        PATH
    }

    fn take(&self, tile: &Tile, _place: Place) -> Result<Kept, Error> {
        Ok(Kept { piece: self.features.take(tile), files: Vec::new() })
    }

    fn append(&self, row: u64, pieces: &[&[u8]]) -> Result<(), Error> {
        self.features.put(pieces)?;
        let mut file = locked(&self.file);
        let (connection, _) = file.as_mut().expect("rows come before the end");
        self.write_tiles(connection, row).map_err(Error::sqlite(&self.path))
    }

    fn finish(&self, _watch: &Watch) -> Result<Vec<FileRecord>, Error> {
        let (mut connection, file) = locked(&self.file).take().expect("a sink ends once");
        let failed = || Error::sqlite(&self.path);
        for (number, layer) in self.features.layers().iter().enumerate() {
            let envelope = self.write_layer(&mut connection, number)?;
            register(&connection, (layer.name(), layer.shape(), layer.about()), envelope).map_err(failed())?;
        }
        let all = Envelope::of(&[self.footprint(self.region.at(), self.region.cols(), self.region.rows())]);
        let about =
            "the tiles of the region; x and y are their numbers in the world, col and row count from its corner";
        register(&connection, ("tiles", Shape::Polygon, about), Some(all)).map_err(failed())?;
        connection.close().map_err(|(_, error)| failed()(error))?;
        Ok(vec![FileRecord::new(PATH.to_owned(), GeoPackage.name(), file.finish()?)])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::vector::geojson::GeoJsonSink;
    use crate::features::{Row, Value};
    use crate::preset::Preset;

    /// Of the layers of agents, two rivers and a road with their keys: one river crosses three tiles, one is a place.
    fn rows() -> Vec<(usize, u8, Row)> {
        let row = |owner: [i64; 2],
                   ending: &str,
                   joins: [Option<i64>; 2],
                   length_m: f64,
                   ends: [f32; 4],
                   line: &[[f64; 2]]| {
            let head = [owner[0].into(), owner[1].into(), ending.to_owned().into(), joins[0].into(), joins[1].into()];
            let values = head.into_iter().chain([length_m.into()]).chain(ends.map(Value::from)).collect();
            Row { values, lines: vec![line.iter().map(|[east, north]| [*east, *north, 0.0]).collect()] }
        };
        let (river, road) = ([3.0, 6.6, 39.4, 28.64], [4.0, 4.0, 5.0, 8.0]);
        vec![
            (0, 2, row([1, 0], "river", [Some(7), Some(-7)], 80.0, river, &[[-10.0, -20.0], [70.0, -20.0]])),
            (0, 1, row([-1, 2], "pond", [None; 2], 0.0, river, &[[24.0, -20.0], [24.0, -20.0]])),
            (1, 1, row([1, 1], "nothing", [None; 2], 28.0, road, &[[40.0, -40.0], [40.0, -54.0], [40.0, -68.0]])),
        ]
    }

    fn baked(out: &Path, order: impl Fn(Vec<(usize, u8, Row)>) -> Vec<(usize, u8, Row)>) {
        let text = "tile_cells = 16\nspacing_m = 2.0\nnoise = [{ kind = \"fbm\", height_m = 10.0, wavelength_m = 300.0, octaves = 2 }]";
        let world = World::new(Preset::parse("test", text).unwrap(), None).unwrap();
        let region = Region::new(TileId { x: 0, y: 0 }, 2, 3, 16).unwrap();
        std::fs::create_dir_all(out.join("vector")).unwrap();
        let (package, json) =
            (GeoPackageSink::create(&world, region, out).unwrap(), GeoJsonSink::create(&world, out).unwrap());
        for row in 0..3 {
            // Each row of tiles brings all features again.
            let piece = |store: &FeatureStore| {
                let mut piece = Vec::new();
                for (layer, key, row) in order(rows()) {
                    store.pack(&mut piece, layer, vec![key], || row.clone());
                }
                piece
            };
            package.append(row, &[&piece(&package.features)]).unwrap();
            json.append(row, &[&piece(json.features())]).unwrap();
        }
        let watch = Watch::default();
        assert_eq!((package.finish(&watch).unwrap().len(), json.finish(&watch).unwrap().len()), (1, 2));
        drop((package, json));
        assert_eq!(std::fs::read_dir(out.join("vector")).unwrap().count(), 3, "what was put away is gone");
    }

    fn text(database: &Connection, query: &str) -> String {
        database.query_row(query, (), |row| row.get(0)).unwrap_or_else(|error| panic!("{query}: {error}"))
    }

    #[test]
    fn features_are_written_whole_once_and_sorted() {
        let folder = tempfile::tempdir().unwrap();
        baked(folder.path(), |rows| rows);
        let database = Connection::open(folder.path().join(PATH)).unwrap();
        let listed = "SELECT group_concat(owner_x || ',' || owner_y || ' ' || ending || ' ' || length_m, '; ') FROM ";
        assert_eq!(text(&database, &format!("{listed} rivers")), "-1,2 pond 0.0; 1,0 river 80.0");
        assert_eq!(text(&database, &format!("{listed} roads")), "1,1 nothing 28.0");
        let properties = "SELECT printf('%d,%d %g %g %g %g', joins_x, joins_y, width_start_m, width_end_m, \
                          floor_start_m, floor_end_m) FROM rivers WHERE owner_x = 1";
        assert_eq!(text(&database, properties), "7,-7 3 6.6 39.4 28.64");
        // Metres, and north up.
        let bounds = "SELECT printf('%g %g %g %g', min_x, min_y, max_x, max_y) FROM gpkg_contents WHERE table_name = ";
        assert_eq!(text(&database, &format!("{bounds} 'rivers'")), "-10 -20 70 -20");
        assert_eq!(text(&database, &format!("{bounds} 'roads'")), "40 -68 40 -40");
        assert_eq!(text(&database, &format!("{bounds} 'tiles'")), "0 -96 64 0");
        assert_eq!(text(&database, "PRAGMA integrity_check"), "ok");
        let number = |pragma: &str| database.pragma_query_value(None, pragma, |row| row.get::<_, i32>(0)).unwrap();
        assert_eq!((number("application_id"), number("user_version")), (0x4750_4B47, 10300));
        // The text has the same lines.
        let json = std::fs::read(folder.path().join("vector/rivers.geojson")).unwrap();
        let json: serde_json::Value = serde_json::from_slice(&json).unwrap();
        let river = &json["features"][1];
        assert_eq!(json["features"].as_array().unwrap().len(), 2);
        assert_eq!((&river["properties"]["owner_x"], &river["properties"]["length_m"]), (&1.into(), &80.0.into()));
        let line = river["geometry"]["coordinates"].as_array().unwrap();
        assert_eq!((&line[0], line.last().unwrap()), (&vec![-10.0, -20.0].into(), &vec![70.0, -20.0].into()));
    }

    #[test]
    fn the_order_in_which_features_come_does_not_matter() {
        let folder = tempfile::tempdir().unwrap();
        let (one, other) = (folder.path().join("one"), folder.path().join("other"));
        baked(&one, |rows| rows);
        baked(&other, |rows| rows.into_iter().rev().collect());
        for file in [PATH, "vector/rivers.geojson", "vector/roads.geojson"] {
            assert!(std::fs::read(one.join(file)).unwrap() == std::fs::read(other.join(file)).unwrap(), "{file}");
        }
    }

    #[test]
    fn a_geometry_is_header_envelope_and_well_known_binary() {
        let bytes = geometry(Shape::Line, &[vec![[1.0, -2.0, 0.0], [-3.0, 5.0, 0.0]]]);
        assert_eq!(bytes.len(), 8 + 32 + 9 + 32);
        assert_eq!(bytes[..8], [b'G', b'P', 0, 3, 0xFF, 0xFF, 0xFF, 0xFF]);
        let number = |at: usize| f64::from_le_bytes(bytes[at..at + 8].try_into().unwrap());
        assert_eq!([8, 16, 24, 32].map(number), [-3.0, 1.0, -2.0, 5.0]);
        assert_eq!(bytes[40..49], [1, 2, 0, 0, 0, 2, 0, 0, 0]);
        assert_eq!([49, 57, 65, 73].map(number), [1.0, -2.0, -3.0, 5.0]);
    }
}
