//! A GeoPackage: all layers and the footprints of the tiles, in one SQLite database.
//!
//! Based on: OGC 12-128r17, GeoPackage Encoding Standard 1.3. The reference system is the world's own plane, as rasters
//! have it. Each layer has the standard's spatial index (its annex F.3), and a style in the table in which QGIS looks
//! for one.

use std::path::{Path, PathBuf};
use std::sync::Mutex;

use rusqlite::{Connection, ToSql, params, params_from_iter};

use crate::area::{Place, Region};
use crate::bake::{FileRecord, Kept, Sink};
use crate::clock::Clock;
use crate::error::Error;
use crate::export::formats::format::{Format, Request, folder};
use crate::export::formats::georeference::Plane;
use crate::export::formats::vector::clip::Envelope;
use crate::export::formats::vector::kept_a_vertex;
use crate::export::formats::vector::store::{footprint, kept};
use crate::export::formats::vector::vectors::Vectors;
use crate::export::formats::vector::{contours, style};
use crate::export::formats::{locked, project};
use crate::features::layer::{Geometry, GeometryType, Head, ValueKind};
use crate::features::{AnyLayer, Row, Value};
use crate::file::{PartFile, database, sqlite_error};
use crate::registry::unjournaled;
use crate::tile::Tile;
use crate::watch::Watch;

/// Path of the file within the folder of the bake.
pub(in crate::export) const PATH: &str = "vector/vector.gpkg";

/// `GPKG` in the header of the database, and version 1.3.0 of the standard.
const APPLICATION_ID: i32 = i32::from_be_bytes(*b"GPKG");
const USER_VERSION: i32 = 10300;

/// The number of the world's plane among the reference systems: one of those that the standard leaves to users.
const PLANE: i32 = 100_000;

/// The time of a layer's last change, which the standard requires. It is fixed, so that the same bake has the same
/// bytes.
const LAST_CHANGE: &str = "1970-01-01T00:00:00.000Z";

/// The tables that the standard requires in every GeoPackage, and the table of styles for QGIS.
const SCHEMA: &str = include_str!("schema.sql");

/// The format GeoPackage.
pub(crate) struct GeoPackage;

impl Format for GeoPackage {
    fn name(&self) -> &'static str {
        "vector"
    }

    fn about(&self) -> &'static str {
        "for GIS: rivers, lakes, coast, peaks, sites, roads, crossings, contours and tiles as one GeoPackage with styles, and a QGIS project"
    }

    fn shows_walks(&self) -> bool {
        true
    }

    fn options(&self) -> &'static [&'static str] {
        &["--clip", "--contours"]
    }

    fn folders(&self) -> Vec<&'static str> {
        vec![folder(project::PATH), folder(PATH)]
    }

    fn files(&self, _request: &Request) -> u64 {
        2
    }

    fn kept_a_vertex(&self, request: &Request) -> u64 {
        kept_a_vertex(request)
    }

    fn blank_pieces(&self, _request: &Request) -> Option<Vec<Vec<u8>>> {
        Some(Vec::new())
    }

    fn sinks<'a>(&self, request: &Request<'a>, out: &Path) -> Result<Vec<Box<dyn Sink + 'a>>, Error> {
        Ok(vec![Box::new(GeoPackageSink::create(request, out)?)])
    }
}

/// A layer as a table of the database.
struct LayerTable<'a> {
    name: &'a str,
    about: &'a str,
    shape: GeometryType,
    /// True if a geometry can have several parts.
    multi: bool,
    heads: Vec<Head>,
}

impl LayerTable<'_> {
    fn geometry_type(&self) -> &'static str {
        match (self.shape, self.multi) {
            (GeometryType::Point, _) => "POINT",
            (GeometryType::Line | GeometryType::LineZ, false) => "LINESTRING",
            (GeometryType::Line | GeometryType::LineZ, true) => "MULTILINESTRING",
            (GeometryType::Polygon, false) => "POLYGON",
            (GeometryType::Polygon, true) => "MULTIPOLYGON",
        }
    }

    /// Returns the SQL that creates the table and its index. Any attribute may be null, so that nobody who draws a new
    /// feature in a GIS has to fill in all of them.
    fn schema(&self) -> String {
        let columns = self.heads.iter().map(|head| {
            let kind = match head.kind {
                ValueKind::Integer => "INTEGER",
                ValueKind::Real | ValueKind::Real32 => "DOUBLE",
                ValueKind::Text => "TEXT",
            };
            format!(",\n        {} {kind}", head.name)
        });
        let (columns, name, shape) = (columns.collect::<String>(), self.name, self.geometry_type());
        format!(
            "CREATE TABLE {name} (fid INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL, geom {shape}{columns});\n\
             CREATE VIRTUAL TABLE rtree_{name}_geom USING rtree(id, minx, maxx, miny, maxy);"
        )
    }

    /// Returns the triggers that keep the index up to date whoever changes the table, in the standard's wording.
    fn triggers(&self) -> String {
        TRIGGERS.replace("<t>", self.name)
    }

    /// Returns the SQL that adds a feature, its geometry first.
    fn insert(&self) -> String {
        let columns: Vec<&str> = ["geom"].into_iter().chain(self.heads.iter().map(|head| head.name)).collect();
        let marks = ", ?".repeat(columns.len() - 1);
        format!("INSERT INTO {} ({}) VALUES (?{marks})", self.name, columns.join(", "))
    }

    /// Returns a geometry in the standard's form for columns: a header with the envelope, then well-known binary.
    fn geometry(&self, parts: &[Geometry]) -> Vec<u8> {
        let Envelope { min, max } = envelope(parts);
        // The version byte 0 means version 1; the flags mean little-endian, with an envelope of x and y.
        let mut bytes = b"GP\x00\x03".to_vec();
        bytes.extend(PLANE.to_le_bytes());
        bytes.extend([min[0], max[0], min[1], max[1]].map(f64::to_le_bytes).as_flattened());
        // Type numbers of the standard, a thousand more with heights.
        let (one, several): (u32, u32) = match self.shape {
            GeometryType::Point => (1, 4),
            GeometryType::Line => (2, 5),
            GeometryType::LineZ => (1002, 1005),
            GeometryType::Polygon => (3, 6),
        };
        let multi = self.multi && self.shape != GeometryType::Point;
        if multi {
            bytes.push(1);
            bytes.extend(several.to_le_bytes());
            bytes.extend((parts.len() as u32).to_le_bytes());
        }
        for part in parts {
            // The byte order: little-endian.
            bytes.push(1);
            bytes.extend(one.to_le_bytes());
            if self.shape == GeometryType::Polygon {
                bytes.extend((part.len() as u32).to_le_bytes());
            }
            for line in part {
                if self.shape != GeometryType::Point {
                    bytes.extend((line.len() as u32).to_le_bytes());
                }
                let numbers = line.iter().flat_map(|point| &point[..self.shape.dimensions()]);
                bytes.extend(numbers.flat_map(|number| number.to_le_bytes()));
            }
        }
        bytes
    }
}

/// Returns the rectangle around the parts of a geometry.
fn envelope(parts: &[Geometry]) -> Envelope {
    parts.iter().map(|part| Envelope::of(part)).fold(Envelope::NOTHING, Envelope::and)
}

/// The triggers of a spatial index, with `<t>` in place of the table's name.
const TRIGGERS: &str = include_str!("triggers.sql");

/// A database being written.
pub(crate) struct GeoPackageSink<'a> {
    region: Region,
    spacing_m: f64,
    vectors: Vectors<'a>,
    /// The tables of the features, in the order of their layers, then those of contours and of tiles.
    tables: Vec<LayerTable<'a>>,
    path: PathBuf,
    file: Mutex<Option<OpenDatabase>>,
}

struct OpenDatabase {
    /// The first field, so that the connection is closed when an abandoned file is removed.
    connection: Connection,
    file: PartFile,
    /// The rectangle around all features of each table.
    envelopes: Vec<Envelope>,
}

impl<'a> GeoPackageSink<'a> {
    /// Begins the database in the folder of the bake.
    pub fn create(request: &Request<'a>, out: &Path) -> Result<GeoPackageSink<'a>, Error> {
        let Request { name, world, region, vectors: options, .. } = *request;
        let path = out.join(PATH);
        let mut file = PartFile::create(path.clone())?;
        let vectors = Vectors::create(request, &path)?;
        let of_layer = |layer: &&'static dyn AnyLayer| LayerTable {
            name: layer.name(),
            about: layer.about(),
            shape: layer.shape(),
            multi: options.clipped,
            heads: layer.heads(),
        };
        let mut tables: Vec<LayerTable> = vectors.features.layers().iter().map(of_layer).collect();
        tables.push(LayerTable {
            name: contours::NAME,
            about: contours::ABOUT,
            shape: contours::SHAPE,
            multi: false,
            heads: contours::HEADS.to_vec(),
        });
        tables.push(tiles());
        let plane = Plane::new(name, world.seed());
        let create = |at: &Path| {
            let connection = database::open(at)?;
            unjournaled(&connection)?;
            // Readers, and the command `file`, tell a GeoPackage from other databases by these numbers.
            connection.pragma_update(None, "application_id", APPLICATION_ID)?;
            connection.pragma_update(None, "user_version", USER_VERSION)?;
            // Use one transaction for all statements; otherwise each would be a transaction of its own.
            connection.execute_batch("BEGIN")?;
            connection.execute_batch(SCHEMA)?;
            connection.execute(
                "INSERT INTO gpkg_spatial_ref_sys VALUES (?1, ?2, 'NONE', ?2, ?3, 'metres east and north of the world''s origin')",
                params![plane.name(), PLANE, plane.wkt1()],
            )?;
            for table in &tables {
                connection.execute_batch(&table.schema())?;
            }
            connection.execute_batch("COMMIT")?;
            Ok(connection)
        };
        let connection = create(file.lend()).map_err(sqlite_error(&path))?;
        let envelopes = vec![Envelope::NOTHING; tables.len()];
        let file = Mutex::new(Some(OpenDatabase { connection, file, envelopes }));
        Ok(GeoPackageSink { region, spacing_m: world.spacing_m(), vectors, tables, path, file })
    }

    /// Writes the features that `write` adds to a table, in one transaction.
    fn fill(
        &self,
        under_way: &mut OpenDatabase,
        number: usize,
        write: impl FnOnce(&mut Add<'_>) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let failed = || sqlite_error(&self.path);
        let table = &self.tables[number];
        let transaction = under_way.connection.transaction().map_err(failed())?;
        let mut insert = transaction.prepare_cached(&table.insert()).map_err(failed())?;
        let index = format!("INSERT INTO rtree_{}_geom VALUES (?, ?, ?, ?, ?)", table.name);
        let mut index = transaction.prepare_cached(&index).map_err(failed())?;
        let around = &mut under_way.envelopes[number];
        write(&mut |values, parts| {
            let shape = table.geometry(parts);
            let values: Vec<_> = values.iter().map(kept).collect();
            let values = values.iter().map(|value| value as &dyn ToSql);
            let row = [&shape as &dyn ToSql].into_iter().chain(values);
            let fid = insert.insert(params_from_iter(row)).map_err(failed())?;
            let own = envelope(parts);
            // Collect the bounds while features pass: the list of layers needs those of all features, and no memory
            // holds these.
            *around = around.and(own);
            let bounds = params![fid, own.min[0], own.max[0], own.min[1], own.max[1]];
            index.execute(bounds).map(|_| ()).map_err(failed())
        })?;
        drop((insert, index));
        transaction.commit().map_err(failed())
    }

    /// Registers a table where readers look for layers, with its index and its style.
    fn register(&self, connection: &Connection, number: usize, around: Envelope) -> rusqlite::Result<()> {
        let table = &self.tables[number];
        // An empty layer has no envelope: all four sides are null.
        let side = |metres: f64| metres.is_finite().then_some(metres);
        connection.execute(
            "INSERT INTO gpkg_contents VALUES (?1, 'features', ?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8)",
            params![
                table.name,
                table.about,
                LAST_CHANGE,
                side(around.min[0]),
                side(around.min[1]),
                side(around.max[0]),
                side(around.max[1]),
                PLANE,
            ],
        )?;
        connection.execute(
            "INSERT INTO gpkg_geometry_columns VALUES (?, 'geom', ?, ?, ?, 0)",
            params![table.name, table.geometry_type(), PLANE, table.shape == GeometryType::LineZ],
        )?;
        connection.execute(
            "INSERT INTO gpkg_extensions VALUES (?, 'geom', 'gpkg_rtree_index', \
             'http://www.geopackage.org/spec120/#extension_rtree', 'write-only')",
            [table.name],
        )?;
        connection.execute_batch(&table.triggers())?;
        if let Some(style) = style::of_layer(table.name, table.shape) {
            connection.execute(
                "INSERT INTO layer_styles (f_table_catalog, f_table_schema, f_table_name, f_geometry_column, styleName, \
                 styleQML, useAsDefault, description, owner, update_time) \
                 VALUES ('', '', ?1, 'geom', 'terrane', ?2, 1, 'as maps of terrane draw it', '', ?3)",
                params![table.name, style.document(), LAST_CHANGE],
            )?;
        }
        Ok(())
    }
}

/// Adds a feature to a table: its values, and the parts of its geometry.
type Add<'a> = dyn FnMut(&[Value], &[Geometry]) -> Result<(), Error> + 'a;

/// Returns the table of the tiles' footprints.
fn tiles() -> LayerTable<'static> {
    let number = |name| Head { name, key: name, kind: ValueKind::Integer, required: true };
    LayerTable {
        name: "tiles",
        about: "the tiles of the region; x and y are their numbers in the world, col and row count from its corner",
        shape: GeometryType::Polygon,
        multi: false,
        heads: ["x", "y", "col", "row"].map(number).to_vec(),
    }
}

impl Sink for GeoPackageSink<'_> {
    fn name(&self) -> &'static str {
        PATH
    }

    fn take(&self, tile: &Tile, _place: Place, clock: &Clock) -> Result<Kept, Error> {
        Ok(Kept { piece: self.vectors.take(tile, clock)?, files: Vec::new() })
    }

    fn append(&self, row: u64, pieces: &[&[u8]], _clock: &Clock) -> Result<(), Error> {
        let mut file = locked(&self.file);
        let under_way = file.as_mut().expect("rows come before the end");
        let [contours, tiles] = [2, 1].map(|from_end| self.tables.len() - from_end);
        self.fill(under_way, contours, |add| {
            self.vectors.put(row, pieces, |Row { values, lines }| add(&values, &[lines]))
        })?;
        self.fill(under_way, tiles, |add| {
            for (col, _) in (0..).zip(pieces).filter(|(_, piece)| !piece.is_empty()) {
                let tile = self.region.tile(Place { row, col });
                let numbers = [tile.x, tile.y, col as i64, row as i64].map(Value::Integer);
                add(&numbers, &[vec![footprint(&self.region, self.spacing_m, tile, 1, 1)]])?;
            }
            Ok(())
        })
    }

    fn finish(&self, watch: &Watch) -> Result<Vec<FileRecord>, Error> {
        let mut under_way = locked(&self.file).take().expect("a sink ends once");
        let failed = || sqlite_error(&self.path);
        let features = &self.vectors.features;
        for number in 0..features.layers().len() {
            self.fill(&mut under_way, number, |add| {
                features.for_each(number, &watch.clock, |values, parts| add(values, parts))
            })?;
        }
        let OpenDatabase { mut connection, file, envelopes } = under_way;
        let list = |connection: &mut Connection| {
            let transaction = connection.transaction()?;
            for (number, around) in envelopes.iter().enumerate() {
                self.register(&transaction, number, *around)?;
            }
            transaction.execute(
                "INSERT INTO gpkg_contents VALUES ('layer_styles', 'attributes', 'layer_styles', 'how QGIS draws the layers', ?, \
                 NULL, NULL, NULL, NULL, 0)",
                [LAST_CHANGE],
            )?;
            transaction.commit()
        };
        list(&mut connection).map_err(failed())?;
        connection.close().map_err(|(_, error)| failed()(error))?;
        Ok(vec![FileRecord::new(PATH.to_owned(), GeoPackage.name(), file.finish()?)])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::area::TileId;
    use crate::export::formats::vector::geojson::GeoJsonSink;
    use crate::export::plan::options::{MeshOptions, TileNames, VectorOptions};
    use crate::preset::Preset;
    use crate::world::World;

    /// Returns features of the agents' layers, with layer and key: two rivers and a road. One river crosses three
    /// tiles, and one is a single place.
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

    fn baked(out: &Path, clipped: bool, order: impl Fn(Vec<(usize, u8, Row)>) -> Vec<(usize, u8, Row)>) {
        let text = "tile_cells = 16\nspacing_m = 2.0\nnoise = [{ kind = \"fbm\", height_m = 10.0, wavelength_m = 300.0, octaves = 2 }]";
        let world = World::new(Preset::parse("test", text).unwrap(), None).unwrap();
        let region = Region::new(TileId { x: 0, y: 0 }, 2, 3, 16).unwrap();
        std::fs::create_dir_all(out.join("vector")).unwrap();
        let (meshes, vectors) = (MeshOptions::default(), VectorOptions { clipped, ..VectorOptions::default() });
        let (height_range_m, names) = (world.height_range_m(), TileNames::default());
        let request = Request {
            name: "test",
            world: &world,
            region,
            meshes: &meshes,
            vectors: &vectors,
            names,
            height_range_m,
            walk: None,
            is_shard: false,
        };
        let package = GeoPackageSink::create(&request, out).unwrap();
        let json = GeoJsonSink::create(&request, out).unwrap();
        for row in 0..3 {
            // Each row of tiles brings all features again.
            let piece = |vectors: &Vectors| {
                let mut piece = Vec::new();
                for (layer, key, row) in order(rows()) {
                    vectors.features.pack(&mut piece, layer, vec![key], || Ok(row.clone())).unwrap();
                }
                Vectors::piece(&piece, &[])
            };
            let beside = Vectors::piece(&[], &[]);
            package.append(row, &[&piece(&package.vectors), &beside], &Clock::default()).unwrap();
            json.append(row, &[&piece(json.vectors()), &beside], &Clock::default()).unwrap();
        }
        let watch = Watch::default();
        assert_eq!((package.finish(&watch).unwrap().len(), json.finish(&watch).unwrap().len()), (1, 3));
        drop((package, json));
        assert_eq!(std::fs::read_dir(out.join("vector")).unwrap().count(), 4, "what was put away is gone");
    }

    fn text(database: &Connection, query: &str) -> String {
        database.query_row(query, (), |row| row.get(0)).unwrap_or_else(|error| panic!("{query}: {error}"))
    }

    #[test]
    fn features_are_written_whole_once_and_sorted() {
        let folder = tempfile::tempdir().unwrap();
        baked(folder.path(), false, |rows| rows);
        let database = Connection::open(folder.path().join(PATH)).unwrap();
        let listed = "SELECT group_concat(owner_x || ',' || owner_y || ' ' || ending || ' ' || length_m, '; ') FROM ";
        assert_eq!(text(&database, &format!("{listed} rivers")), "-1,2 pond 0.0; 1,0 river 80.0");
        assert_eq!(text(&database, &format!("{listed} roads")), "1,1 nothing 28.0");
        let properties = "SELECT printf('%d,%d %g %g %g %g', joins_x, joins_y, width_start_m, width_end_m, \
                          floor_start_m, floor_end_m) FROM rivers WHERE owner_x = 1";
        assert_eq!(text(&database, properties), "7,-7 3 6.6 39.4 28.64");
        // Bounds are in metres, and north is up.
        let bounds = "SELECT printf('%g %g %g %g', min_x, min_y, max_x, max_y) FROM gpkg_contents WHERE table_name = ";
        assert_eq!(text(&database, &format!("{bounds} 'rivers'")), "-10 -20 70 -20");
        assert_eq!(text(&database, &format!("{bounds} 'roads'")), "40 -68 40 -40");
        assert_eq!(text(&database, &format!("{bounds} 'tiles'")), "0 -96 64 0");
        assert_eq!(text(&database, "PRAGMA integrity_check"), "ok");
        let number = |pragma: &str| database.pragma_query_value(None, pragma, |row| row.get::<_, i32>(0)).unwrap();
        assert_eq!((number("application_id"), number("user_version")), (0x4750_4B47, 10300));
        // The GeoJSON has the same lines.
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
        baked(&one, false, |rows| rows);
        baked(&other, false, |rows| rows.into_iter().rev().collect());
        for file in [PATH, "vector/rivers.geojson", "vector/roads.geojson"] {
            assert!(std::fs::read(one.join(file)).unwrap() == std::fs::read(other.join(file)).unwrap(), "{file}");
        }
    }

    #[test]
    fn features_are_cut_off_at_the_edge_of_the_region_on_request() {
        let folder = tempfile::tempdir().unwrap();
        baked(folder.path(), true, |rows| rows);
        let database = Connection::open(folder.path().join(PATH)).unwrap();
        // The river runs from 10 m west of the region to 6 m east of it.
        let bounds = "SELECT printf('%g %g %g %g', min_x, min_y, max_x, max_y) FROM gpkg_contents WHERE table_name = ";
        assert_eq!(text(&database, &format!("{bounds} 'rivers'")), "0 -20 64 -20");
        let kind = "SELECT geometry_type_name FROM gpkg_geometry_columns WHERE table_name = 'rivers'";
        assert_eq!(text(&database, kind), "MULTILINESTRING");
        // Attributes describe the whole river, not its part in the region.
        assert_eq!(text(&database, "SELECT CAST(length_m AS TEXT) FROM rivers WHERE owner_x = 1"), "80.0");
        let json = std::fs::read(folder.path().join("vector/rivers.geojson")).unwrap();
        let json: serde_json::Value = serde_json::from_slice(&json).unwrap();
        assert_eq!(json["features"][1]["geometry"]["coordinates"], serde_json::json!([[0.0, -20.0], [64.0, -20.0]]));
    }

    #[test]
    fn layers_have_an_index_a_style_and_their_plane() {
        let folder = tempfile::tempdir().unwrap();
        baked(folder.path(), false, |rows| rows);
        let database = Connection::open(folder.path().join(PATH)).unwrap();
        let found = "SELECT group_concat(fid) FROM rivers WHERE fid IN \
                     (SELECT id FROM rtree_rivers_geom WHERE minx <= 0 AND maxx >= -5)";
        assert_eq!(text(&database, found), "2");
        let tables = "SELECT group_concat(table_name) FROM gpkg_geometry_columns WHERE srs_id = 100000";
        assert_eq!(text(&database, tables), "rivers,roads,contours,tiles");
        assert_eq!(
            text(&database, "SELECT group_concat(f_table_name) FROM layer_styles"),
            "rivers,roads,contours,tiles"
        );
        let plane = "SELECT srs_name FROM gpkg_spatial_ref_sys WHERE srs_id = 100000";
        assert_eq!(text(&database, plane), "terrane test, seed 1");
    }

    #[test]
    fn a_feature_can_be_added_that_has_nothing_but_a_place() {
        let folder = tempfile::tempdir().unwrap();
        baked(folder.path(), false, |rows| rows);
        let database = Connection::open(folder.path().join(PATH)).unwrap();
        let mut tables = database.prepare("SELECT table_name FROM gpkg_geometry_columns").unwrap();
        let tables: Vec<String> = tables.query_map((), |row| row.get(0)).unwrap().map(Result::unwrap).collect();
        for table in tables {
            let required = format!("SELECT group_concat(name) FROM pragma_table_info('{table}') WHERE \"notnull\"");
            assert_eq!(text(&database, &required), "fid", "{table}");
            // The trigger needs functions that a GIS brings along.
            database.execute_batch(&format!("DROP TRIGGER rtree_{table}_geom_insert")).unwrap();
            let fid = format!("INSERT INTO {table} DEFAULT VALUES RETURNING CAST(fid > 0 AS TEXT)");
            assert_eq!(text(&database, &fid), "1", "{table}");
        }
    }

    #[test]
    fn a_geometry_is_header_envelope_and_well_known_binary() {
        let table = |multi| LayerTable { name: "", about: "", shape: GeometryType::Line, multi, heads: Vec::new() };
        let parts = [vec![vec![[1.0, -2.0, 0.0], [-3.0, 5.0, 0.0]]]];
        let bytes = table(false).geometry(&parts);
        assert_eq!(bytes.len(), 8 + 32 + 9 + 32);
        assert_eq!(bytes[..8], [b'G', b'P', 0, 3, 0xA0, 0x86, 1, 0]);
        let number = |at: usize| f64::from_le_bytes(bytes[at..at + 8].try_into().unwrap());
        assert_eq!([8, 16, 24, 32].map(number), [-3.0, 1.0, -2.0, 5.0]);
        assert_eq!(bytes[40..49], [1, 2, 0, 0, 0, 2, 0, 0, 0]);
        assert_eq!([49, 57, 65, 73].map(number), [1.0, -2.0, -3.0, 5.0]);
        // The same geometry as the only part of a geometry of several parts.
        let several = table(true).geometry(&parts);
        assert_eq!(several[40..49], [1, 5, 0, 0, 0, 1, 0, 0, 0]);
        assert_eq!(several[49..], bytes[40..]);
    }
}
